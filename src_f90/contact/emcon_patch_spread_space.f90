!> From derivatives of a patch's gap by its frame and vertices to those by nodes.
module emcon_patch_spread_space
   use emcon_constraint, only : condition_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap_t
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: patch_uses, patch_spread

contains

   !> Which nodes of a stencil a gap depends on: those of the slave, and of the vertices it sees.
   pure function patch_uses(stencil, vertex) result(is_used)
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: vertex(:)           !! that it depends on
      logical :: is_used(stencil%n_node)
      integer :: k

      associate (column => columns(vertex))
         is_used = [(any(abs(stencil%weight(k, column)) > 0.0_wp), k = 1, stencil%n_node)]
      end associate
      is_used(:stencil%n_slave) = .true.
   end function patch_uses

   !> The sums of nodes that a gap depends on.
   pure function columns(vertex) result(column)
      integer, intent(in) :: vertex(:)
      integer :: column(2 + size(vertex))

      column = [1, 2, 2 + vertex]
   end function columns

   !> Add a gap by `scale` and its derivatives to a condition.
   pure subroutine patch_spread(stencil, gap, is_used, scale, place, item)
      type(patch_stencil_t), intent(in) :: stencil
      type(patch_gap_t), intent(in) :: gap
      logical, intent(in) :: is_used(:)          !! (n_node of the stencil) of `patch_uses`
      real(wp), intent(in) :: scale              !! > 0, what the value is divided by
      integer, intent(in) :: place(:)            !! (number used) of these nodes in `item`
      type(condition_t), intent(inout) :: item   !! with room for them
      integer :: k

      item%gap0 = item%gap0 + gap%f0/scale
      item%gap1 = item%gap1 + gap%f1/scale
      item%dgap = item%dgap + gap%df/scale
      associate (row => pack([(k, k = 2, stencil%n_node)], is_used(2:)))
         call spread_to_nodes(gap, stencil%weight(row, columns(gap%vertex)), 1.0_wp/scale, place, &
            item)
      end associate
   end subroutine patch_spread

   !> Derivatives by nodes from those by sums of nodes.
   pure subroutine spread_to_nodes(gap, weight, factor, place, item)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: weight(:, :)       !! (n - 1, 2 + n_vertex) of nodes in the sums
      real(wp), intent(in) :: factor
      integer, intent(in) :: place(:)            !! (n)
      type(condition_t), intent(inout) :: item
      real(wp), allocatable :: half(:, :), full(:, :)
      integer :: i, j, k, n

      n = size(place)
      associate (n_dim => size(item%g, 1))
         call nodes_add_first(factor, of_nodes(gap%g), place, item%g)
         call nodes_add_first(factor, of_nodes(gap%c), place, item%c)
         if (item%leaves_second) return
         associate (m => size(gap%g))
            allocate(half(n_dim*(n - 1), m), full(n_dim*(n - 1), n_dim*(n - 1)))
            do k = 1, m
               half(:, k) = of_nodes(gap%h(:, k))
            end do
            full = 0.0_wp
            do j = 1, size(weight, 2)
               do i = 1, n - 1
                  if (.not. abs(weight(i, j)) > 0.0_wp) cycle
                  associate (to => full(:, n_dim*(i - 1) + 1:n_dim*i))
                     to = to + weight(i, j)*half(:, n_dim*(j - 1) + 1:n_dim*j)
                  end associate
               end do
            end do
         end associate
         call nodes_add_second(factor, n_dim, full, place, item%h)
      end associate

   contains

      !> The components of each node but the first.
      pure function of_nodes(part) result(nodes)
         real(wp), intent(in) :: part(:)         !! components of each sum
         real(wp) :: nodes(size(item%g, 1)*size(weight, 1))

         nodes = reshape(matmul(reshape(part, [size(item%g, 1), size(weight, 2)]), &
            transpose(weight)), shape(nodes))
      end function of_nodes

   end subroutine spread_to_nodes

end module emcon_patch_spread_space
