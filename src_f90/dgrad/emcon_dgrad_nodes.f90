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

   !> Add `factor` times first derivatives to those of nodes at `place`.
   pure subroutine nodes_add_first(factor, part, place, full)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: part(:)            !! (>= n_dim (n - 1)) by nodes 2 to n
      integer, intent(in) :: place(:)            !! (n) of the nodes in `full`
      real(wp), intent(inout) :: full(:, :)      !! (n_dim, >= n)
      real(wp) :: value
      integer :: a, k, n_dim

      n_dim = size(full, 1)
      do k = 2, size(place)
         do a = 1, n_dim
            value = factor*part(n_dim*(k - 2) + a)
            full(a, place(k)) = full(a, place(k)) + value
            full(a, place(1)) = full(a, place(1)) - value
         end do
      end do
   end subroutine nodes_add_first

   !> Add `factor` times second derivatives to those of nodes at `place`.
   pure subroutine nodes_add_second(factor, n_dim, part, place, full)
      real(wp), intent(in) :: factor
      integer, intent(in) :: n_dim
      real(wp), intent(in) :: part(:, :)         !! (>= m, >= m), m = n_dim (n - 1)
      integer, intent(in) :: place(:)            !! (n) of the nodes in `full`
      real(wp), intent(inout) :: full(:, :)      !! (>= n_dim n, >= n_dim n)
      real(wp) :: value
      integer :: a, b, i, j, row, column, first_row, first_column

      do j = 2, size(place)
         do b = 1, n_dim
            column = n_dim*(place(j) - 1) + b
            first_column = n_dim*(place(1) - 1) + b
            do i = 2, size(place)
               do a = 1, n_dim
                  value = factor*part(n_dim*(i - 2) + a, n_dim*(j - 2) + b)
                  row = n_dim*(place(i) - 1) + a
                  first_row = n_dim*(place(1) - 1) + a
                  full(row, column) = full(row, column) + value
                  full(first_row, column) = full(first_row, column) - value
                  full(row, first_column) = full(row, first_column) - value
                  full(first_row, first_column) = full(first_row, first_column) + value
               end do
            end do
         end do
      end do
   end subroutine nodes_add_second

end module emcon_dgrad_nodes
