! build: elements
!> From derivatives by sums of nodes to those by the nodes.
!>
!> The sums are of places from the first node on: derivatives by that are minus the sum of the
!> others.
module emcon_node_sums
   use emcon_dgrad_nodes, only : nodes_add_second
   use emcon_kinds, only : wp
   implicit none
   private
   public :: node_sums_first, node_sums_second, node_sums_across

contains

   !> Add derivatives by nodes from those by sums of nodes.
   pure subroutine node_sums_first(part, weight, factor, place, of_node)
      real(wp), intent(in) :: part(:)            !! by the components of each sum
      real(wp), intent(in) :: weight(:, :)       !! (n - 1, sums) of nodes in the sums
      real(wp), intent(in) :: factor             !! of what is added
      integer, intent(in) :: place(:)            !! (n) of the nodes among those of `of_node`
      real(wp), intent(inout) :: of_node(:, :)   !! (n_dim, any)
      real(wp), dimension(size(of_node, 1)) :: own, total
      integer :: i, j

      total = 0.0_wp
      associate (n_dim => size(of_node, 1))
         do i = 1, size(weight, 1)
            own = 0.0_wp
            ! Most sums are of one node.
            do j = 1, size(weight, 2)
               if (.not. abs(weight(i, j)) > 0.0_wp) cycle
               own = own + weight(i, j)*part(n_dim*(j - 1) + 1:n_dim*j)
            end do
            of_node(:, place(1 + i)) = of_node(:, place(1 + i)) + factor*own
            total = total + own
         end do
      end associate
      of_node(:, place(1)) = of_node(:, place(1)) - factor*total
   end subroutine node_sums_first

   !> The same of second derivatives.
   pure subroutine node_sums_second(part, weight, factor, place, of_node)
      real(wp), intent(in) :: part(:, :)         !! by the components of the sums, twice
      real(wp), intent(in) :: weight(:, :)       !! (n - 1, sums) of nodes in the sums
      real(wp), intent(in) :: factor             !! of what is added
      integer, intent(in) :: place(:)            !! (n) of the nodes among those of `of_node`
      real(wp), intent(inout) :: of_node(:, :)   !! components of nodes, twice
      real(wp), allocatable :: half(:, :), full(:, :)
      integer :: a, i, j, k, n, n_dim

      n = size(place)
      n_dim = size(part, 1)/size(weight, 2)
      allocate(half(n_dim*(n - 1), size(part, 1)), full(n_dim*(n - 1), n_dim*(n - 1)))
      half = 0.0_wp
      ! Most sums are of one node.
      do j = 1, size(weight, 2)
         do i = 1, n - 1
            if (.not. abs(weight(i, j)) > 0.0_wp) cycle
            do k = 1, size(part, 1)
               do a = 1, n_dim
                  half(n_dim*(i - 1) + a, k) = half(n_dim*(i - 1) + a, k) &
                     + weight(i, j)*part(n_dim*(j - 1) + a, k)
               end do
            end do
         end do
      end do
      full = 0.0_wp
      do j = 1, size(weight, 2)
         do i = 1, n - 1
            if (.not. abs(weight(i, j)) > 0.0_wp) cycle
            do a = 1, n_dim
               full(:, n_dim*(i - 1) + a) = full(:, n_dim*(i - 1) + a) &
                  + weight(i, j)*half(:, n_dim*(j - 1) + a)
            end do
         end do
      end do
      call nodes_add_second(factor, n_dim, full, place, of_node)
   end subroutine node_sums_second

   !> Derivatives of those by the sums, by the components of one more sum.
   pure subroutine node_sums_across(part, weight, by, factor, place, of_node)
      real(wp), intent(in) :: part(:, :)         !! (components of the sums, n_dim)
      real(wp), intent(in) :: weight(:, :)       !! (n - 1, sums) of nodes in the sums
      real(wp), intent(in) :: by(:)              !! (n - 1) of nodes in the one more
      real(wp), intent(in) :: factor             !! of what is added
      integer, intent(in) :: place(:)            !! (n) of the nodes among those of `of_node`
      real(wp), intent(inout) :: of_node(:, :)   !! components of nodes, twice
      real(wp) :: full(size(part, 2)*size(by), size(part, 2)*size(by))
      integer :: n_dim, a, i, j, k

      n_dim = size(part, 2)
      full = 0.0_wp
      do k = 1, size(by)
         if (.not. abs(by(k)) > 0.0_wp) cycle
         do j = 1, size(weight, 2)
            do i = 1, size(by)
               do a = 1, n_dim
                  associate (to => full(n_dim*(i - 1) + 1:n_dim*i, n_dim*(k - 1) + a))
                     to = to + weight(i, j)*by(k)*part(n_dim*(j - 1) + 1:n_dim*j, a)
                  end associate
               end do
            end do
         end do
      end do
      call nodes_add_second(factor, n_dim, full, place, of_node)
   end subroutine node_sums_across

end module emcon_node_sums
