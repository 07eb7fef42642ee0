!> Gaps of nodes over edges before the first step, as contact node to segment measures them.
module emcon_start_gaps_plane
   use emcon_chain_plane, only : chain_corners, chain_crossing, next
   use emcon_circles_plane, only : off_circles
   use emcon_constraint, only : condition_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_init, midside_points, midside_t
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_scene, only : scene_t
   use emcon_self_contact_plane, only : chain_faces
   use emcon_start_gaps, only : is_master, is_slave, start_gaps_t
   implicit none
   private
   public :: start_gaps_plane_t, start_gaps_plane_init

   type, extends(start_gaps_t) :: start_gaps_plane_t
      type(nts_t), private :: nts
      real(wp), allocatable, private :: still(:, :)  !! (2, n_node) no displacement [L]
      real(wp), allocatable, private :: u(:, :)  !! (2, n_node) initial, of contact points [L]
   contains
      procedure :: nearest
      procedure :: measure
      procedure :: offset => offset_off
      procedure :: faces
      procedure :: is_sharp
      procedure :: crossing
   end type start_gaps_plane_t

contains

   !> The pair `pair` of `scene`, whose master is smoothed if `options` say so; without them it is
   !> the polygon.
   subroutine start_gaps_plane_init(self, scene, pair, error, options)
      type(start_gaps_plane_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t), intent(in), optional :: options
      type(midside_t) :: midside

      call nts_init(self%nts, scene, pair, error)
      if (allocated(error)) return
      self%nts%every_face = .true.
      if (present(options)) call self%nts%configure(scene%x, options)
      allocate(self%still(size(scene%x, 1), size(scene%x, 2)), source=0.0_wp)
      self%n = self%nts%n_constraint
      self%is_self = self%nts%is_self
      self%surface(is_slave) = self%nts%slave%facets_t
      self%surface(is_master) = self%nts%master%facets_t
      self%node = self%nts%node
      self%duplicate = self%nts%duplicate
      self%place = self%nts%chain_node
      self%facet = self%nts%edge
      self%state = self%nts%state
      allocate(self%doubt(self%n), source=0.0_wp)
      call midside_init(midside, scene, [pair%slave, pair%master])
      self%u = scene%u0
      if (midside%n > 0) self%u = midside_points(midside, scene%u0)
   end subroutine start_gaps_plane_init

   pure subroutine nearest(self, i, scene, gap, is_over)
      class(start_gaps_plane_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! not past an end of the surface

      call nts_nearest(self%nts, i, scene%x, self%u, self%still, gap, is_over)
      self%facet(i) = self%nts%edge(i)
   end subroutine nearest

   pure subroutine measure(self, scene)
      class(start_gaps_plane_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene

      self%nts%reach = 0.0_wp
      call self%nts%begin_points(scene%x, self%u, self%still)
      call self%nts%measure_points(scene%x, self%u, self%still)
      self%facet = self%nts%edge
      self%state = self%nts%state
      if (allocated(self%nts%circles)) self%doubt = off_circles(self%nts%circles, &
         self%nts%master, self%facet)
   end subroutine measure

   pure subroutine offset_off(self, i, scene, gap, offset, is_last)
      class(start_gaps_plane_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: gap                !! that is wanted [L]
      real(wp), intent(out) :: offset(:)         !! (2) [L]
      logical, intent(out) :: is_last            !! it is round-off
      type(condition_t) :: item(1)

      call self%nts%evaluate_points([i], scene%x, self%u, self%still, [0.0_wp], item)
      associate (normal => item(1)%c(:, 1))
         offset = (item(1)%gap1 - gap)*normal/dot_product(normal, normal)
      end associate
      is_last = abs(item(1)%gap1 - gap) <= epsilon(1.0_wp)*item(1)%size
   end subroutine offset_off

   pure logical function faces(self, i, scene)
      class(start_gaps_plane_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene

      faces = chain_faces(self%nts%slave, self%place(i), &
         self%nts%master%facet(:, self%facet(i)), scene%x, scene%u0)
   end function faces

   pure subroutine is_sharp(self, scene, angle, sharp)
      class(start_gaps_plane_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: angle              !! [degrees]
      logical, intent(out) :: sharp(:)           !! (n)
      logical :: is_corner(self%nts%slave%n_facet)
      integer :: i

      call chain_corners(self%nts%slave, scene%x, angle, is_corner)
      do i = 1, self%n
         associate (here => self%nts%slave%node_edge(next, self%place(i)))
            sharp(i) = here == 0
            if (here > 0) sharp(i) = is_corner(here)
         end associate
      end do
   end subroutine is_sharp

   pure subroutine crossing(self, which, scene, first, second)
      class(start_gaps_plane_t), intent(in) :: self
      integer, intent(in) :: which               !! `is_slave` or `is_master`
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: first, second      !! first < second; 0, 0: nowhere

      if (which == is_slave) then
         call chain_crossing(self%nts%slave, scene%x, scene%u0, first, second)
      else
         call chain_crossing(self%nts%master, scene%x, scene%u0, first, second)
      end if
   end subroutine crossing

end module emcon_start_gaps_plane
