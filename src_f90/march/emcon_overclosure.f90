!> Overclosure that a step resolves: is it that of the bodies, or of the edges that stand for arcs?
module emcon_overclosure
   use emcon_arc_dip_plane, only : arc_dip
   use emcon_interactions, only : formulation_nts, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_surface_edges, only : surface_edges
   use emcon_system, only : system_t
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: overclosure_check

   !> Edges may dip into their arcs by this part of the overclosure.
   real(wp), parameter :: small_dip = 0.1_wp

contains

   !> Warn of pairs whose overclosure `overclosure` is not much more than edges dip into arcs,
   !> unless nodes meet nodes: there the gaps of all are the same. Gaps at the start have been
   !> measured.
   subroutine overclosure_check(system, scene, overclosure, warnings)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: overclosure(:)     !! (n_constraint) gaps that are closed, else 0 [L]
      type(notes_t), intent(inout) :: warnings
      real(wp) :: deepest, dip
      logical :: is_smooth
      integer :: i

      is_smooth = scene%step(system%i_step)%contact%smoothing == smoothing_hermite
      do i = 1, system%n_pair
         associate (contact => system%contact(i)%contact, pair => scene%pair(i), &
               first => system%first_constraint(i) + 1, last => system%first_constraint(i + 1))
            deepest = -minval(overclosure(first:last))
            if (.not. deepest > 0.0_wp) cycle
            if (is_smooth .and. pair%formulation == formulation_nts) cycle
            dip = surface_dip(scene, pair%slave) + surface_dip(scene, pair%master)
            if (dip <= small_dip*deepest) cycle
            if (.not. is_smooth .and. .not. any(contact%state%is_near .and. contact%state%is_over &
               .and. abs(contact%state%gap0 + deepest) > small_dip*deepest .and. &
               contact%state%gap0 < dip)) cycle
            call note_add(warnings, "the overclosure of surface " // &
               scene%surface(pair%slave)%name // " on " // scene%surface(pair%master)%name // &
               ", " // to_text(deepest, 3) // ", is not much more than their edges dip into " // &
               "arcs, up to " // to_text(dip, 3) // ": pressures are off by that part; let " // &
               "nodes meet nodes, take smaller edges, or TYPE=NODE TO SURFACE with " // &
               "*SURFACE SMOOTHING, TYPE=HERMITE")
         end associate
      end do
   end subroutine overclosure_check

   !> How far edges of surface `number` dip into arcs, without its corners [L].
   real(wp) function surface_dip(scene, number) result(dip)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number              !! of the surface
      integer, allocatable :: edge(:, :)

      dip = 0.0_wp
      if (scene%surface(number)%is_nodal) return
      call surface_edges(scene, scene%surface(number), edge)
      dip = arc_dip(scene%x, edge, scene%step(1)%contact%normal_angle)
   end function surface_dip

end module emcon_overclosure
