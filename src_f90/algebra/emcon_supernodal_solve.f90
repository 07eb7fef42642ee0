! build: streams
!> Substitution with a factor of dense blocks: each half alone, and for sparse right-hand sides.
!>
!> Numbers of single precision are taken in double; sums run over eight lanes in a fixed order.
module emcon_supernodal_solve
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_supernodal_factor, only : supernodal_factor_t
   use emcon_supernodes, only : n_lane, n_side, packed_size, supernodes_t
   implicit none
   private
   public :: supernodal_forward, supernodal_backward, supernodal_reach, supernodal_error

contains

   !> y = L^-1 y
   pure subroutine supernodal_forward(self, nodes, y)
      type(supernodal_factor_t), intent(in) :: self
      type(supernodes_t), intent(in) :: nodes
      real(dp), intent(inout), contiguous :: y(:)      !! (n)
      real(dp) :: t(nodes%widest + n_lane)
      integer :: s

      do s = 1, nodes%n_node
         call forward_node(self%value, nodes, s, y, t)
      end do
   end subroutine supernodal_forward

   !> The part of node `s`.
   pure subroutine forward_node(value, nodes, s, y, t)
      real(sp), intent(in), contiguous :: value(:)     !! of the factor
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: s
      real(dp), intent(inout), contiguous :: y(:)      !! (n)
      real(dp), intent(out), contiguous :: t(:)        !! work space
      integer :: i, m, n, n_lanes, at

      n = nodes%first(s + 1) - nodes%first(s)
      m = nodes%row_start(s + 1) - nodes%row_start(s) - n
      n_lanes = (m + n_lane - 1)/n_lane
      call forward_triangle(n, value(nodes%value_start(s) + 1:), y(nodes%first(s) + 1:))
      if (m == 0) return
      call multiply(n_lanes, n, value(nodes%value_start(s) + packed_size(n) + 1:), &
         y(nodes%first(s) + 1:), t)
      at = nodes%row_start(s) + n
      do i = 1, m
         y(nodes%row(at + i)) = y(nodes%row(at + i)) - t(i)
      end do
   end subroutine forward_node

   !> x = M x with a packed triangle.
   pure subroutine forward_triangle(n, m, x)
      integer, intent(in) :: n
      real(sp), intent(in) :: m(*)
      real(dp), intent(inout) :: x(n)
      integer :: i, j, k

      k = int(packed_size(n))
      do j = n, 1, -1
         k = k - (n - j + 1)
         do i = j + 1, n
            x(i) = x(i) + m(k + 1 + i - j)*x(j)
         end do
         x(j) = m(k + 1)*x(j)
      end do
   end subroutine forward_triangle

   !> t = B x, side by side: the compiler makes one loop of each width.
   pure subroutine multiply(n_lanes, n, b, x, t)
      integer, intent(in) :: n_lanes, n
      real(sp), intent(in) :: b(*)
      real(dp), intent(in) :: x(n)
      real(dp), intent(out) :: t(n_lane, n_lanes)
      integer :: j, k

      t = 0.0_dp
      k = 0
      do j = 1, n - n_side + 1, n_side
         call add_columns(n_lanes, n_side, b(k + 1), x(j), t)
         k = k + n_side*n_lane*n_lanes
      end do
      select case (n - j + 1)
      case (1)
         call add_columns(n_lanes, 1, b(k + 1), x(j), t)
      case (2)
         call add_columns(n_lanes, 2, b(k + 1), x(j), t)
      case (3)
         call add_columns(n_lanes, 3, b(k + 1), x(j), t)
      end select
   end subroutine multiply

   !> t = t + B x for `n` columns.
   pure subroutine add_columns(n_lanes, n, b, x, t)
      integer, intent(in) :: n_lanes, n
      real(sp), intent(in) :: b(n_lane, n, n_lanes)
      real(dp), intent(in) :: x(n)
      real(dp), intent(inout) :: t(n_lane, n_lanes)
      real(dp) :: total
      integer :: i, j, k

      do k = 1, n_lanes
         !$omp simd private(total)
         do i = 1, n_lane
            total = t(i, k)
            do j = 1, n
               total = total + b(i, j, k)*x(j)
            end do
            t(i, k) = total
         end do
      end do
   end subroutine add_columns

   !> y = L^-T y
   pure subroutine supernodal_backward(self, nodes, y)
      type(supernodal_factor_t), intent(in) :: self
      type(supernodes_t), intent(in) :: nodes
      real(dp), intent(inout), contiguous :: y(:)      !! (n)
      real(dp) :: t(nodes%widest + n_lane)
      integer :: s, i, m, n, at

      do s = nodes%n_node, 1, -1
         n = nodes%first(s + 1) - nodes%first(s)
         at = nodes%row_start(s) + n
         m = nodes%row_start(s + 1) - at
         do i = 1, m
            t(i) = y(nodes%row(at + i))
         end do
         t(m + 1:m + n_lane - 1) = 0.0_dp
         call subtract_products((m + n_lane - 1)/n_lane, n, &
            self%value(nodes%value_start(s) + packed_size(n) + 1:), t, y(nodes%first(s) + 1:))
         call backward_triangle(n, self%value(nodes%value_start(s) + 1:), y(nodes%first(s) + 1:))
      end do
   end subroutine supernodal_backward

   !> x = x - B^T t, backwards through memory.
   pure subroutine subtract_products(n_lanes, n, b, t, x)
      integer, intent(in) :: n_lanes, n
      real(sp), intent(in) :: b(*)
      real(dp), intent(in) :: t(n_lane, n_lanes)
      real(dp), intent(inout) :: x(n)
      integer :: j, k

      k = n*n_lane*n_lanes
      j = modulo(n, n_side)
      k = k - j*n_lane*n_lanes
      select case (j)
      case (1)
         call subtract_columns(n_lanes, 1, b(k + 1), t, x(n))
      case (2)
         call subtract_columns(n_lanes, 2, b(k + 1), t, x(n - 1))
      case (3)
         call subtract_columns(n_lanes, 3, b(k + 1), t, x(n - 2))
      end select
      do j = n - j - n_side + 1, 1, -n_side
         k = k - n_side*n_lane*n_lanes
         call subtract_columns(n_lanes, n_side, b(k + 1), t, x(j))
      end do
   end subroutine subtract_products

   !> x = x - B^T t for `n` columns.
   pure subroutine subtract_columns(n_lanes, n, b, t, x)
      integer, intent(in) :: n_lanes, n
      real(sp), intent(in) :: b(n_lane, n, n_lanes)
      real(dp), intent(in) :: t(n_lane, n_lanes)
      real(dp), intent(inout) :: x(n)
      real(dp) :: part(n_lane, n_side)
      integer :: i, j, k

      part(:, :n) = 0.0_dp
      do k = n_lanes, 1, -1
         do j = 1, n
            !$omp simd
            do i = 1, n_lane
               part(i, j) = part(i, j) + b(i, j, k)*t(i, k)
            end do
         end do
      end do
      do j = 1, n
         x(j) = x(j) - sum_of(part(:, j))
      end do
   end subroutine subtract_columns

   !> The sum over lanes.
   pure real(dp) function sum_of(part)
      real(dp), intent(in) :: part(n_lane)

      sum_of = sum(part(:n_lane/2) + part(n_lane/2 + 1:))
   end function sum_of

   !> x = M^T x with a packed triangle.
   pure subroutine backward_triangle(n, m, x)
      integer, intent(in) :: n
      real(sp), intent(in) :: m(*)
      real(dp), intent(inout) :: x(n)
      real(dp) :: total
      integer :: i, j, k

      k = 0
      do j = 1, n
         total = m(k + 1)*x(j)
         do i = j + 1, n
            total = total + m(k + 1 + i - j)*x(i)
         end do
         x(j) = total
         k = k + n - j + 1
      end do
   end subroutine backward_triangle

   !> L^-1 of a sparse right-hand side: what of it is not zero, column by column of the nodes on the
   !> ways from its entries to the roots.
   pure subroutine supernodal_reach(self, nodes, column, value, n_reached, index, x)
      type(supernodal_factor_t), intent(inout) :: self
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in), contiguous :: column(:)     !! (m) columns of the entries
      real(dp), intent(in), contiguous :: value(:)     !! (m)
      integer, intent(out) :: n_reached
      integer, intent(inout), contiguous :: index(:)   !! (n) columns of the solution, from 0
      real(dp), intent(inout), contiguous :: x(:)      !! (n) and values, the first n_reached
      real(dp) :: t(nodes%widest + n_lane)
      integer :: at(size(column)), s, j, k

      n_reached = 0
      do k = 1, size(column)
         at(k) = nodes%of(column(k))
         self%zero(column(k)) = value(k)
      end do
      do
         s = minval(at, mask=at > 0)
         if (s > nodes%n_node) return
         call forward_node(self%value, nodes, s, self%zero, t)
         do j = nodes%first(s) + 1, nodes%first(s + 1)
            n_reached = n_reached + 1
            index(n_reached) = j - 1
            x(n_reached) = self%zero(j)
            self%zero(j) = 0.0_dp
         end do
         where (at == s) at = nodes%parent(s)
      end do
   end subroutine supernodal_reach

   !> The largest error of L^-T L^-1 A x for x = 1 everywhere: a motion of a body as a whole, which
   !> has the smallest forces of all, is what is lost first.
   pure real(dp) function supernodal_error(self, nodes, pattern, value)
      type(supernodal_factor_t), intent(in) :: self
      type(supernodes_t), intent(in) :: nodes
      type(csr_t), intent(in) :: pattern               !! its values are not read
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot) those of the matrix
      real(dp), allocatable :: y(:)              ! not on the stack of a thread
      integer :: i

      allocate(y(nodes%n))
      do i = 1, nodes%n
         y(nodes%place(i)) = sum(value(pattern%row_start(i) + 1:pattern%row_start(i + 1)))
      end do
      call supernodal_forward(self, nodes, y)
      call supernodal_backward(self, nodes, y)
      supernodal_error = huge(supernodal_error)
      if (all(y == y)) supernodal_error = maxval(abs(y - 1.0_dp))
   end function supernodal_error

end module emcon_supernodal_solve
