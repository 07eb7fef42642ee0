! build: elements
!> From derivatives of a patch's gap by its frame and vertices to those by nodes.
module emcon_patch_spread_space
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : wp
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_patch_gap_space, only : patch_gap_t
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: patch_uses, patch_weights, patch_spread

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

   !> The weights of the nodes that are used, but the first, in the sums that a gap depends on.
   pure function patch_weights(stencil, vertex, is_used) result(weight)
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: vertex(:)           !! that it depends on
      logical, intent(in) :: is_used(:)          !! (n_node of the stencil) of `patch_uses`
      real(wp) :: weight(count(is_used(2:)), 2 + size(vertex))
      integer :: k

      weight = stencil%weight(pack([(k, k = 2, stencil%n_node)], is_used(2:)), columns(vertex))
   end function patch_weights

   !> Add a gap by `scale` and its derivatives to a condition.
   pure subroutine patch_spread(gap, weight, scale, place, item)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: weight(:, :)       !! of `patch_weights`
      real(wp), intent(in) :: scale              !! > 0, what the value is divided by
      integer, intent(in) :: place(:)            !! (number used) of these nodes in `item`
      type(condition_t), intent(inout) :: item   !! with room for them

      item%gap0 = item%gap0 + gap%f0/scale
      item%gap1 = item%gap1 + gap%f1/scale
      item%dgap = item%dgap + gap%df/scale
      call node_sums_first(gap%g, weight, 1.0_wp/scale, place, item%g)
      call node_sums_first(gap%c, weight, 1.0_wp/scale, place, item%c)
      if (.not. item%leaves_second) call node_sums_second(gap%h, weight, 1.0_wp/scale, place, &
         item%h)
   end subroutine patch_spread

end module emcon_patch_spread_space
