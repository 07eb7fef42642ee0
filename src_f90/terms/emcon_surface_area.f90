!> Area and centre of surfaces of faces: of sheets with their thickness, of solids of revolution
!> around the whole circle.
module emcon_surface_area
   use emcon_element_registry, only : face_shape_create
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_pressure_ring_plane, only : ring_area
   use emcon_pressure_space, only : face_area
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_is_flat
   use emcon_shape, only : shape_t, shape_table_t, shape_tabulate
   implicit none
   private
   public :: surface_area

   integer, parameter :: n_space = 3

contains

   !> Area, and the place of its centre; that of no area is the origin.
   subroutine surface_area(scene, surface, place, area, centre)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface     !! of faces of elements
      real(wp), intent(in) :: place(:, :)        !! (n_dim, n_node) where the nodes are [L]
      real(wp), intent(out) :: area              !! [L^2]
      real(wp), intent(out) :: centre(:)         !! (n_dim) [L]
      class(shape_t), allocatable :: shape
      type(shape_table_t) :: table
      real(wp) :: size_of(1 + size(place, 1)), total(1 + size(place, 1))
      real(wp), allocatable :: at(:, :)
      integer :: i

      total = 0.0_wp
      do i = 1, size(surface%element)
         associate (e => surface%element(i))
            associate (kind => scene%element%kinds(scene%element%kind(e)), &
                  section => scene%section(scene%element%section(e)))
               at = place(:, scene%element%node(kind%face(surface%face(i)), e))
               if (scene%n_dim == n_space) then
                  call face_shape_create(kind%n_face_node, shape)
                  call shape_tabulate(shape, .true., table)
                  call face_area(table, at, size_of)
               else
                  call ring_area(at, .not. scene_is_flat(scene), size_of)
                  if (scene_is_flat(scene)) size_of = section%thickness*size_of
               end if
            end associate
         end associate
         total = total + size_of
      end do
      area = total(1)
      centre = 0.0_wp
      if (area > 0.0_wp) centre = total(2:)/area
   end subroutine surface_area

end module emcon_surface_area
