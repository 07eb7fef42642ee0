! build: elements
!> From derivatives by the coordinates of all nodes but the first to those by all.
!>
!> What is made of differences of positions does not change if all move alike: its derivatives by
!> the first node are minus the sum of the others. Source: docs/theory.md, section 2.
module emcon_dgrad_nodes
   use emcon_kinds, only : wp
   implicit none
   private
   public :: nodes_add_first, nodes_add_second

contains

   !> Add `factor` times first derivatives to those of nodes at `place`. Each of these is added to
   !> once: two parts give the same bits in either order.
   pure subroutine nodes_add_first(factor, part, place, full)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: part(:)            !! (>= n_dim (n - 1)) by nodes 2 to n
      integer, intent(in) :: place(:)            !! (n) of the nodes in `full`
      real(wp), intent(inout) :: full(:, :)      !! (n_dim, >= n)
      real(wp) :: total
      integer :: a, i, k, n_dim

      n_dim = size(full, 1)
      do a = 1, n_dim
         total = 0.0_wp
         do k = 2, size(place)
            i = n_dim*(k - 2) + a
            total = total + part(i)
            full(a, place(k)) = full(a, place(k)) + factor*part(i)
         end do
         full(a, place(1)) = full(a, place(1)) - factor*total
      end do
   end subroutine nodes_add_first

   !> Add `factor` times second derivatives to those of nodes at `place`, in the same way.
   pure subroutine nodes_add_second(factor, n_dim, part, place, full)
      real(wp), intent(in) :: factor
      integer, intent(in) :: n_dim
      real(wp), intent(in) :: part(:, :)         !! (>= m, >= m), m = n_dim (n - 1)
      integer, intent(in) :: place(:)            !! (n) of the nodes in `full`
      real(wp), intent(inout) :: full(:, :)      !! (>= n_dim n, >= n_dim n)
      real(wp) :: total, corner
      integer :: a, b, i, j, k, row, column

      do b = 1, n_dim
         do a = 1, n_dim
            row = n_dim*(place(1) - 1) + a
            corner = 0.0_wp
            do k = 2, size(place)
               j = n_dim*(k - 2) + b
               total = 0.0_wp
               do i = 2, size(place)
                  total = total + part(n_dim*(i - 2) + a, j)
               end do
               column = n_dim*(place(k) - 1) + b
               full(row, column) = full(row, column) - factor*total
               corner = corner + total
            end do
            column = n_dim*(place(1) - 1) + b
            full(row, column) = full(row, column) + factor*corner
         end do
         call add_others(factor, n_dim, part, place, b, full)
      end do
   end subroutine nodes_add_second

   !> Add derivatives of the others' components, by component `b` of each node.
   pure subroutine add_others(factor, n_dim, part, place, b, full)
      real(wp), intent(in) :: factor, part(:, :)
      integer, intent(in) :: n_dim, place(:), b
      real(wp), intent(inout) :: full(:, :)
      real(wp) :: total
      integer :: a, i, j, k, row, column

      do i = 2, size(place)
         do a = 1, n_dim
            row = n_dim*(place(i) - 1) + a
            total = 0.0_wp
            do k = 2, size(place)
               j = n_dim*(k - 2) + b
               column = n_dim*(place(k) - 1) + b
               total = total + part(n_dim*(i - 2) + a, j)
               full(row, column) = full(row, column) + factor*part(n_dim*(i - 2) + a, j)
            end do
            column = n_dim*(place(1) - 1) + b
            full(row, column) = full(row, column) - factor*total
         end do
      end do
   end subroutine add_others

end module emcon_dgrad_nodes
