!> Elements in the plane, side by side, whose volume resists in the mean alone.
!>
!> A law W = rest + U(v), v its change of volume, is taken as rest(E) + U(mean of v): one resistance
!> to a change of volume per element, so that nearly incompressible ones do not lock. The mean is a
!> sum of discrete-gradient numbers and U one divided difference of it: energy and momenta stay
!> exact, and there are no unknowns beside the displacements. Source: docs/theory.md, eq. (11c).
module emcon_mean_volume_plane
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : answer_change => law_change_points, change_t => change_points_t, &
      law_points_t, law_t, n_lane
   use emcon_pack_points_plane, only : n_dim, n_strain, pack_add_point, pack_point, &
      pack_point_check, pack_point_t, place
   use emcon_shape, only : max_node => max_plane_nodes
   implicit none
   private
   public :: mean_volume_hold

   include "emcon_mean_volume_pack.inc"

   !> Stress of the points of one element that does not move, with that normal to the plane.
   pure subroutine mean_volume_hold(law, rest, weight, points)
      class(law_t), intent(in) :: law            !! U and v
      class(law_t), intent(in) :: rest           !! of the law, without U
      real(wp), intent(in) :: weight(:)          !! (n_gp <= n_lane) reference volumes [L^3]
      type(law_points_t), intent(inout) :: points    !! of the element; `dstrain` is 0
      type(change_t) :: change
      type(dg_t) :: u

      change%strain = points%strain
      call answer_change(law, .false., change)
      u = law%volume(dg_variable(1, dot_product(weight, change%start(:size(weight)))/sum(weight), &
         0.0_wp))
      call rest%hold(points)
      points%stress = points%stress + u%g(1)*change%stress
      points%stress_33 = points%stress_33 + u%g(1)*change%stress_33
   end subroutine mean_volume_hold

   pure subroutine answer(law, points, with_tangent)
      class(law_t), intent(in) :: law
      type(law_points_t), intent(inout) :: points
      logical, intent(in) :: with_tangent

      call law%respond(points, with_tangent)
   end subroutine answer

end module emcon_mean_volume_plane
