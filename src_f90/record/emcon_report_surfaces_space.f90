!> Rows of the scene report for the contact surfaces of a scene in space: how many faces of which
!> size, how sharp they are, where they end.
module emcon_report_surfaces_space
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : find_turns, ridge_angle, ridges_find, ridges_t
   use emcon_facets, only : facets_init, facets_length, facets_t
   use emcon_kinds, only : wp
   use emcon_report_row, only : report_row_t, report_rows_t, row_begin, row_put, rows_add
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: report_surfaces

contains

   !> A row for each surface of faces that is in a pair, in the order of the deck.
   subroutine report_surfaces(scene, rows)
      type(scene_t), intent(in) :: scene
      type(report_rows_t), intent(inout) :: rows
      type(facets_t) :: facets
      type(error_t), allocatable :: error
      integer :: s

      if (scene%n_dim < 3) return
      do s = 1, size(scene%surface)
         if (.not. any(scene%pair%slave == s .or. scene%pair%master == s)) cycle
         call facets_init(facets, scene, scene%surface(s), error)
         if (allocated(error) .or. facets%n_facet == 0) cycle
         call describe(scene, s, facets, rows)
      end do
   end subroutine report_surfaces

   subroutine describe(scene, s, facets, rows)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: s                   !! number of the surface
      type(facets_t), intent(in) :: facets
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      type(ridges_t) :: ridges
      real(wp), allocatable :: turn(:, :)
      real(wp) :: length(facets%n_facet)
      integer :: f

      length = [(facets_length(facets, f), f = 1, facets%n_facet)]
      call row_begin(row, "surfaces", "surface")
      call row_put(row, "name", scene%surface(s)%name, " #")
      call row_put(row, "faces", facets%n_facet, ": # faces")
      call row_put(row, "nodes", size(facets%node), " (# nodes, ")
      call row_put(row, "parts", maxval(facets%part), "connected parts: #)")
      call row_put(row, "area", sum(facets%size), ", area #")
      call row_put(row, "shortest", minval(length), ", faces # ")
      call row_put(row, "longest", maxval(length), "to # long")
      call find_turns(facets, scene%x, turn)
      call ridges_find(ridges, facets, scene%x, ridge_angle)
      associate (has_other => turn < huge(turn))
         call row_put(row, "sharpest_degrees", max(0.0_wp, maxval(turn, mask=has_other)), &
            "; sides of faces turn by up to # degrees outwards")
         call row_put(row, "deepest_degrees", max(0.0_wp, -minval(turn, mask=has_other)), &
            ", # inwards")
      end associate
      call row_put(row, "features", size(ridges%facet, 2), ", # of them by more ")
      call row_put(row, "feature_angle", ridge_angle, "than # outwards")
      call row_put(row, "free_sides", size(ridges%free_facet), "; # free sides")
      call rows_add(rows, row)
   end subroutine describe

end module emcon_report_surfaces_space
