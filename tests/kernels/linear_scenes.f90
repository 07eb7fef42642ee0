!> Linear constraints made by hand: equations, ties of straight lines, rows, and what they give.
module linear_scenes
   use emcon_couplings, only : equation_t, tie_rows_t, tie_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_numbering, only : numbering_t
   use emcon_scene, only : scene_t
   use random_draws, only : draw_random
   implicit none
   private
   public :: add_equation, add_node, put_row, begin_rows, make_random_rows, dense_terms
   public :: add_tie_by_hand

contains

   !> Add the equation sum of coefficient times displacement = 0.
   subroutine add_equation(scene, node, dof, coefficient)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: node(:), dof(:)
      real(wp), intent(in) :: coefficient(:)
      type(equation_t), allocatable :: all(:)
      integer :: n

      n = size(scene%equation)
      allocate(all(n + 1))
      all(:n) = scene%equation
      all(n + 1)%node = node
      all(n + 1)%dof = dof
      all(n + 1)%coefficient = coefficient
      call move_alloc(all, scene%equation)
   end subroutine add_equation

   !> Add a node without element; `node` is its number.
   subroutine add_node(scene, x, node)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: x(2)
      integer, intent(out) :: node
      integer :: i

      node = size(scene%x, 2) + 1
      scene%x = reshape([scene%x, x], [2, node])
      scene%u0 = reshape([scene%u0, 0.0_wp, 0.0_wp], [2, node])
      scene%v0 = reshape([scene%v0, 0.0_wp, 0.0_wp], [2, node])
      scene%node%label = [(i, i = 1, node)]
      deallocate(scene%node%origin)
      allocate(scene%node%origin(node))
   end subroutine add_node

   !> A tie whose row k says: slave node k is the mean, by weights, of its masters. Rows carry
   !> `size`; they are an open chain.
   subroutine add_tie_by_hand(scene, slave, master, weight, size_of)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: slave(:)            !! (n)
      integer, intent(in) :: master(:, :)        !! (m, n)
      real(wp), intent(in) :: weight(:, :)       !! (m, n), each column sums up to 1
      real(wp), intent(in) :: size_of(:)         !! (n)
      type(tie_rows_t) :: rows
      type(tie_t), allocatable :: ties(:)
      integer :: k, n, m, t

      n = size(slave)
      m = size(master, 1)
      allocate(rows%slave, source=slave)
      allocate(rows%neighbour(2, n), rows%start(n + 1))
      rows%neighbour = reshape([(merge(k - 1, 0, k > 1), merge(k + 1, 0, k < n), k = 1, n)], [2, n])
      rows%start = [((m + 1)*k, k = 0, n)]
      allocate(rows%node((m + 1)*n), rows%weight((m + 1)*n))
      do k = 1, n
         rows%node(rows%start(k) + 1:rows%start(k + 1)) = [slave(k), master(:, k)]
         rows%weight(rows%start(k) + 1:rows%start(k + 1)) = size_of(k)*[1.0_wp, -weight(:, k)]
      end do
      allocate(rows%size, source=size_of)
      t = size(scene%tie)
      allocate(ties(t + 1))
      ties(:t) = scene%tie
      ties(t + 1)%name = "HAND" // achar(iachar("A") + t)
      ties(t + 1)%rows = rows
      call move_alloc(ties, scene%tie)
   end subroutine add_tie_by_hand

   !> No rows yet.
   subroutine begin_rows(linear)
      type(linear_rows_t), intent(out) :: linear

      allocate(linear%is_gone(0))
      allocate(linear%is_used(0), linear%tie(0), linear%place(0), linear%own(0), linear%size(0))
      allocate(linear%dof(0), linear%weight(0))
      linear%start = [0]
   end subroutine begin_rows

   !> Append a row over degrees of freedom, which ascend.
   subroutine put_row(linear, own, dof, weight)
      type(linear_rows_t), intent(inout) :: linear
      integer, intent(in) :: own, dof(:)
      real(wp), intent(in) :: weight(:)

      linear%n = linear%n + 1
      linear%is_used = [linear%is_used, .true.]
      linear%is_gone = [linear%is_gone, .false.]
      linear%tie = [linear%tie, 0]
      linear%place = [linear%place, linear%n]
      linear%own = [linear%own, own]
      linear%size = [linear%size, 1.0_wp]
      linear%dof = [linear%dof, dof]
      linear%weight = [linear%weight, weight]
      linear%start = [linear%start, size(linear%dof)]
   end subroutine put_row

   !> Rows for 30 nodes: nodes 1, 3, 4 and 18 follow others in both directions, 3 and 4 in a chain,
   !> among them prescribed ones of `random_constraints`; sums of weights vanish.
   subroutine make_random_rows(linear)
      type(linear_rows_t), intent(out) :: linear
      integer, parameter :: own(4) = [1, 3, 4, 18]
      integer, parameter :: other(3, 4) = reshape([9, 23, 29, 4, 21, 26, 5, 6, 30, 19, 22, 24], &
         [3, 4])
      integer :: a, k
      real(wp) :: w(2)

      call begin_rows(linear)
      do a = 1, 2
         do k = 1, 4
            call draw_random(w)
            w = 0.25_wp + 0.25_wp*w
            call put_row(linear, 2*(own(k) - 1) + a, 2*([own(k), other(:, k)] - 1) + a, &
               [1.0_wp, -w(1), -w(2), w(1) + w(2) - 1.0_wp])
         end do
      end do
   end subroutine make_random_rows

   !> T: all degrees of freedom from the unknowns.
   pure function dense_terms(numbering) result(t)
      type(numbering_t), intent(in) :: numbering
      real(wp) :: t(size(numbering%start) - 1, numbering%n_unknown)
      integer :: d, s

      t = 0.0_wp
      do d = 1, size(t, 1)
         do s = numbering%start(d) + 1, numbering%start(d + 1)
            if (numbering%column(s) > 0) t(d, numbering%column(s)) = numbering%weight(s)
         end do
      end do
   end function dense_terms

end module linear_scenes
