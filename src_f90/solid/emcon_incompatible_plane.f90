!> Elements in the plane, side by side, with incompatible modes.
!>
!> The law answers to relaxed strains; what works on the nodes is its stress, returned by the
!> transpose of that map. Source: docs/theory.md, eqs. (11) and (11g).
module emcon_incompatible_plane
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_t, n_lane
   use emcon_pack_points_plane, only : column, n_dim, n_strain, pack_add_point, pack_point, &
      pack_point_check, pack_point_t, row
   implicit none
   private

   include "emcon_incompatible_pack.inc"

   pure subroutine answer(law, points, with_tangent)
      class(law_t), intent(in) :: law
      type(law_points_t), intent(inout) :: points
      logical, intent(in) :: with_tangent

      call law%respond(points, with_tangent)
   end subroutine answer

end module emcon_incompatible_plane
