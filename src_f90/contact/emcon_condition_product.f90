!> Products of conditions: what is covered of a facet, to the third power, times a gap of it.
!>
!> Source: docs/theory.md, section 14.
module emcon_condition_product
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: condition_start, condition_add_cubed

contains

   !> Begin a sum with no value and no derivatives over nodes.
   pure subroutine condition_start(item, node, n_dim)
      type(condition_t), intent(inout) :: item
      integer, intent(in) :: node(:)             !! of the scene
      integer, intent(in) :: n_dim               !! of the scene

      call condition_resize(item, size(node), n_dim)
      item%node(:size(node)) = node
      item%gap0 = 0.0_wp
      item%gap1 = 0.0_wp
      item%dgap = 0.0_wp
      item%g = 0.0_wp
      item%c = 0.0_wp
      if (.not. item%leaves_second) item%h = 0.0_wp
   end subroutine condition_start

   !> Add cover**3 times a gap to a condition, all of them over the same nodes, by the discrete
   !> gradient of a product.
   pure subroutine condition_add_cubed(item, cover, gap)
      type(condition_t), intent(inout) :: item
      type(condition_t), intent(in) :: cover, gap
      real(wp) :: theta(0:1), by_cover, mean, mean_gap
      real(wp), allocatable, dimension(:) :: g_cover, c_cover, g_gap, c_gap
      integer :: j, m

      theta = [cover%gap0, cover%gap1]**3
      by_cover = cover%gap0**2 + cover%gap0*cover%gap1 + cover%gap1**2
      mean = 0.5_wp*sum(theta)
      mean_gap = 0.5_wp*(gap%gap0 + gap%gap1)
      item%gap0 = item%gap0 + theta(0)*gap%gap0
      item%gap1 = item%gap1 + theta(1)*gap%gap1
      item%dgap = item%dgap + mean*gap%dgap + mean_gap*by_cover*cover%dgap
      associate (n => item%n_node)
         m = size(item%g, 1)*n
         item%g(:, :n) = item%g(:, :n) + mean*gap%g(:, :n) + mean_gap*by_cover*cover%g(:, :n)
         item%c(:, :n) = item%c(:, :n) + theta(1)*gap%c(:, :n) &
            + gap%gap1*3.0_wp*cover%gap1**2*cover%c(:, :n)
         if (item%leaves_second) return
         g_cover = reshape(cover%g(:, :n), [m])
         c_cover = reshape(cover%c(:, :n), [m])
         g_gap = reshape(gap%g(:, :n), [m])
         c_gap = reshape(gap%c(:, :n), [m])
      end associate
      do j = 1, m
         item%h(:m, j) = item%h(:m, j) + mean*gap%h(:m, j) + mean_gap*by_cover*cover%h(:m, j) &
            + 1.5_wp*cover%gap1**2*c_cover(j)*g_gap &
            + (mean_gap*(cover%gap0 + 2.0_wp*cover%gap1)*c_cover(j) &
            + 0.5_wp*by_cover*c_gap(j))*g_cover
      end do
   end subroutine condition_add_cubed

end module emcon_condition_product
