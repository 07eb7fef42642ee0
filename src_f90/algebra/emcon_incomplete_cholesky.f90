! build: streams
!> Incomplete Cholesky factors of a symmetric definite matrix by blocks: L has the pattern of the
!> matrix, and L L^T about its values.
!>
!> In single precision: it is a preconditioner, of which memory is what counts. Where a pivot is not
!> positive, which what is left out may do to a definite matrix, the diagonal is made larger and
!> it is tried again. Rows of both ends of the mesh need none of each other: two threads take one
!> each. Source: T. A. Manteuffel, Math. Comp. 34 (1980) 473-497.
module emcon_incomplete_cholesky
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use emcon_kinds, only : dp
   use emcon_node_blocks, only : n_end, n_side, node_blocks_are_shared, node_blocks_t
   implicit none
   private
   public :: incomplete_cholesky_t, incomplete_cholesky_factorise, incomplete_cholesky_forward, &
      incomplete_cholesky_backward

   !> The diagonal is raised by this part of itself, then by four times as much, up to one.
   real(dp), parameter :: first_shift = 2.0_dp**(-10), next_shift = 4.0_dp

   type :: incomplete_cholesky_t
      !> (n_side, n_side, blocks) as of the matrix; of its own block the inverse triangle
      real(sp), allocatable :: value(:, :, :)
      real(dp) :: shift = 0.0_dp                 !! >= 0, the part by which the diagonal was raised
   end type incomplete_cholesky_t

contains

   !> Factorise a matrix whose values are filled in, in the range of single precision.
   subroutine incomplete_cholesky_factorise(self, matrix, is_definite)
      type(incomplete_cholesky_t), intent(inout) :: self
      type(node_blocks_t), intent(in) :: matrix
      logical, intent(out) :: is_definite        !! else there is no factor

      if (allocated(self%value)) then
         if (size(self%value, 3) /= size(matrix%column)) deallocate(self%value)
      end if
      if (.not. allocated(self%value)) allocate(self%value(n_side, n_side, size(matrix%column)))
      self%shift = 0.0_dp
      do
         call try(self, matrix, is_definite)
         if (is_definite .or. .not. self%shift < 1.0_dp) return
         self%shift = max(first_shift, next_shift*self%shift)
      end do
   end subroutine incomplete_cholesky_factorise

   !> Factorise with the present shift.
   subroutine try(self, matrix, is_definite)
      type(incomplete_cholesky_t), intent(inout) :: self
      type(node_blocks_t), intent(in) :: matrix
      logical, intent(out) :: is_definite
      logical :: is_done(n_end)
      integer :: e

      associate (before => matrix%first_row)
         if (node_blocks_are_shared(matrix)) then
            !$omp parallel do default(none) shared(self, matrix, is_done) schedule(static, 1) &
            !$omp num_threads(matrix%n_thread)
            do e = 1, n_end
               call factorise_rows(self, matrix, matrix%first_row(e), matrix%first_row(e + 1), &
                  is_done(e))
            end do
            !$omp end parallel do
            is_definite = all(is_done)
         else
            call factorise_rows(self, matrix, 0, before(n_end + 1), is_definite)
         end if
         if (is_definite) call factorise_rows(self, matrix, before(n_end + 1), matrix%n_block, &
            is_definite)
      end associate
   end subroutine try

   !> The rows behind `before` up to `last`: those that they meet are done.
   pure subroutine factorise_rows(self, matrix, before, last, is_definite)
      type(incomplete_cholesky_t), intent(inout) :: self
      type(node_blocks_t), intent(in) :: matrix
      integer, intent(in) :: before, last
      logical, intent(out) :: is_definite
      real(dp), allocatable :: row(:, :, :)      ! of L, by columns
      logical, allocatable :: is_here(:)
      real(dp) :: block(n_side, n_side)
      integer :: b, c, i, k, l

      allocate(row(n_side, n_side, matrix%n_block))
      allocate(is_here(matrix%n_block), source=.false.)
      is_definite = .true.
      associate (start => matrix%row_start, column => matrix%column)
         do b = before + 1, last
            do k = start(b) + 1, start(b + 1) - 1
               c = column(k)
               block = matrix%value(:, :, k)
               do l = start(c) + 1, start(c + 1) - 1
                  if (is_here(column(l))) block = block - times_transposed(row(:, :, column(l)), &
                     real(self%value(:, :, l), dp))
               end do
               row(:, :, c) = times_transposed(block, real(self%value(:, :, start(c + 1)), dp))
               self%value(:, :, k) = real(row(:, :, c), sp)
               is_here(c) = .true.
            end do
            block = matrix%value(:, :, start(b + 1))
            do i = 1, n_side
               block(i, i) = block(i, i) + self%shift*block(i, i)
            end do
            do k = start(b) + 1, start(b + 1) - 1
               block = block - times_transposed(row(:, :, column(k)), row(:, :, column(k)))
               is_here(column(k)) = .false.
            end do
            call invert(block, is_definite)
            if (.not. is_definite) return
            self%value(:, :, start(b + 1)) = real(block, sp)
         end do
      end associate
   end subroutine factorise_rows

   !> A B^T
   pure function times_transposed(a, b) result(c)
      real(dp), intent(in) :: a(n_side, n_side), b(n_side, n_side)
      real(dp) :: c(n_side, n_side)
      integer :: i, j

      c = 0.0_dp
      do i = 1, n_side
         do j = 1, n_side
            c(:, j) = c(:, j) + a(:, i)*b(j, i)
         end do
      end do
   end function times_transposed

   !> The inverse of the lower triangle whose square the block is.
   pure subroutine invert(a, is_definite)
      real(dp), intent(inout) :: a(n_side, n_side)
      logical, intent(out) :: is_definite
      real(dp) :: l(n_side, n_side), least
      integer :: i, j

      l = 0.0_dp
      is_definite = .false.
      do j = 1, n_side
         ! A pivot of round-off makes a factor that is worse than none.
         least = 2.0_dp**(-20)*abs(a(j, j))
         l(j, j) = a(j, j) - dot_product(l(j, :j - 1), l(j, :j - 1))
         if (.not. l(j, j) > least) return
         l(j, j) = sqrt(l(j, j))
         do i = j + 1, n_side
            l(i, j) = (a(i, j) - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
      end do
      is_definite = .true.
      a = 0.0_dp
      do j = 1, n_side
         a(j, j) = 1.0_dp/l(j, j)
         do i = j + 1, n_side
            a(i, j) = -dot_product(l(i, j:i - 1), a(j:i - 1, j))/l(i, i)
         end do
      end do
   end subroutine invert

   !> y = L^-1 y, a vector of blocks.
   subroutine incomplete_cholesky_forward(self, matrix, y)
      type(incomplete_cholesky_t), intent(in) :: self
      type(node_blocks_t), intent(in) :: matrix
      real(dp), intent(inout) :: y(n_side, matrix%n_block)
      integer :: e

      associate (before => matrix%first_row)
         if (node_blocks_are_shared(matrix)) then
            !$omp parallel do default(none) shared(self, matrix, y) schedule(static, 1) &
            !$omp num_threads(matrix%n_thread)
            do e = 1, n_end
               call forward_rows(self, matrix, matrix%first_row(e), matrix%first_row(e + 1), y)
            end do
            !$omp end parallel do
         else
            call forward_rows(self, matrix, 0, before(n_end + 1), y)
         end if
         call forward_rows(self, matrix, before(n_end + 1), matrix%n_block, y)
      end associate
   end subroutine incomplete_cholesky_forward

   !> The rows behind `before` up to `last`.
   pure subroutine forward_rows(self, matrix, before, last, y)
      type(incomplete_cholesky_t), intent(in) :: self
      type(node_blocks_t), intent(in) :: matrix
      integer, intent(in) :: before, last
      real(dp), intent(inout) :: y(n_side, matrix%n_block)
      real(dp) :: total(n_side)
      integer :: b, c, j, k

      do b = before + 1, last
         total = y(:, b)
         do k = matrix%row_start(b) + 1, matrix%row_start(b + 1) - 1
            c = matrix%column(k)
            do j = 1, n_side
               total = total - self%value(:, j, k)*y(j, c)
            end do
         end do
         k = matrix%row_start(b + 1)
         y(:, b) = 0.0_dp
         do j = 1, n_side                        ! the triangle has zeros above its diagonal
            y(:, b) = y(:, b) + self%value(:, j, k)*total(j)
         end do
      end do
   end subroutine forward_rows

   !> y = L^-T y, a vector of blocks.
   subroutine incomplete_cholesky_backward(self, matrix, y)
      type(incomplete_cholesky_t), intent(in) :: self
      type(node_blocks_t), intent(in) :: matrix
      real(dp), intent(inout) :: y(n_side, matrix%n_block)
      integer :: e

      associate (before => matrix%first_row)
         call backward_rows(self, matrix, before(n_end + 1), matrix%n_block, y)
         if (node_blocks_are_shared(matrix)) then
            !$omp parallel do default(none) shared(self, matrix, y) schedule(static, 1) &
            !$omp num_threads(matrix%n_thread)
            do e = 1, n_end
               call backward_rows(self, matrix, matrix%first_row(e), matrix%first_row(e + 1), y)
            end do
            !$omp end parallel do
         else
            call backward_rows(self, matrix, 0, before(n_end + 1), y)
         end if
      end associate
   end subroutine incomplete_cholesky_backward

   !> The rows from `last` down to those behind `before`.
   pure subroutine backward_rows(self, matrix, before, last, y)
      type(incomplete_cholesky_t), intent(in) :: self
      type(node_blocks_t), intent(in) :: matrix
      integer, intent(in) :: before, last
      real(dp), intent(inout) :: y(n_side, matrix%n_block)
      real(dp) :: x(n_side)
      integer :: b, c, j, k

      do b = last, before + 1, -1
         k = matrix%row_start(b + 1)
         do j = 1, n_side
            x(j) = dot_product(self%value(:, j, k), y(:, b))
         end do
         y(:, b) = x
         do k = matrix%row_start(b) + 1, matrix%row_start(b + 1) - 1
            c = matrix%column(k)
            do j = 1, n_side
               y(j, c) = y(j, c) - dot_product(self%value(:, j, k), x)
            end do
         end do
      end do
   end subroutine backward_rows

end module emcon_incomplete_cholesky
