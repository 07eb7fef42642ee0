!> Gaps of nodes over a wall before the first step.
module emcon_start_gaps_wall_space
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t
   use emcon_facets, only : facets_length, facets_normal, facets_rim
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_slave_faces_space, only : slave_faces_init
   use emcon_start_gaps, only : is_slave, start_gaps_t
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_at, wall_ends_here, wall_find, wall_is_solid, &
      wall_spot_t
   implicit none
   private
   public :: start_gaps_wall_t, start_gaps_wall_init

   !> In front nodes are near within this part of a facet, or as far as ADJUST moves them.
   real(wp), parameter :: near_per_facet = 0.5_wp
   !> Surfaces face each other where the cosine of their normals is below minus this.
   real(wp), parameter :: least_facing = 0.25_wp

   type, extends(start_gaps_t) :: start_gaps_wall_t
      type(wall_t), private :: wall
      type(wall_spot_t), allocatable, private :: spot(:)     !! (n) as last measured
      real(wp), allocatable, private :: size(:)  !! (n) facets at each node, in the mean [L]
      real(wp), private :: pad = 0.0_wp          !! gaps are counted from it on [L]
      real(wp), private :: reach = 0.0_wp        !! in front nodes are near so far [L]
   contains
      procedure :: nearest
      procedure :: measure
      procedure :: offset => offset_off
      procedure :: faces
      procedure :: is_sharp
      procedure :: crossing
      procedure :: other_size
      procedure :: other_text
   end type start_gaps_wall_t

contains

   !> The pair `pair` of `scene`, whose master is a wall.
   subroutine start_gaps_wall_init(self, scene, pair, error)
      type(start_gaps_wall_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      logical, allocatable :: is_meant(:)
      integer :: i, k

      associate (slave => self%surface(is_slave), master => scene%surface(pair%master))
         call slave_faces_init(slave, scene, scene%surface(pair%slave), is_meant, error)
         if (allocated(error)) return
         self%wall = master%wall
         self%is_closed = wall_is_solid(self%wall)
         self%place = pack([(i, i = 1, size(is_meant))], is_meant)
         self%node = slave%node(self%place)
         self%n = size(self%node)
         allocate(self%size(self%n))
         do i = 1, self%n
            associate (first => slave%around_start(self%place(i)), &
                  last => slave%around_start(self%place(i) + 1) - 1)
               self%size(i) = sum([(facets_length(slave, slave%around(k)), k = first, last)]) &
                  /real(last - first + 1, wp)
            end associate
         end do
      end associate
      self%pad = pair%interaction%offset
      self%reach = self%pad + max(0.0_wp, pair%adjust%distance)
      if (pair%adjust%set > 0) self%reach = 0.5_wp*sqrt(huge(self%reach))
      allocate(self%duplicate(self%n), self%facet(self%n), source=0)
      allocate(self%doubt(self%n), source=0.0_wp)
      allocate(self%state(self%n), self%spot(self%n))
   end subroutine start_gaps_wall_init

   pure subroutine nearest(self, i, scene, gap, is_over)
      class(start_gaps_wall_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! not past an end of the surface

      call look(self, i, scene)
      self%facet(i) = 1
      gap = self%state(i)%gap0
      is_over = self%state(i)%is_over
   end subroutine nearest

   !> What node `i` sees.
   pure subroutine look(self, i, scene)
      type(start_gaps_wall_t), intent(inout) :: self
      integer, intent(in) :: i
      type(scene_t), intent(in) :: scene

      self%spot(i) = wall_find(self%wall, wall_at(self%wall, scene%x, scene%u0), &
         scene%x(:, self%node(i)) + scene%u0(:, self%node(i)))
      associate (state => self%state(i), spot => self%spot(i))
         state = gap_state_t()
         state%size = self%size(i)
         state%gap0 = spot%distance - self%pad
         state%gap1 = state%gap0
         state%is_over = .not. wall_ends_here(self%wall, spot)
         state%is_near = abs(spot%distance) <= self%pad + near_per_facet*state%size .or. &
            merge(self%is_closed, spot%distance <= self%reach, spot%distance < 0.0_wp)
      end associate
   end subroutine look

   pure subroutine measure(self, scene)
      class(start_gaps_wall_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: i

      do i = 1, self%n
         call look(self, i, scene)
      end do
      self%facet = merge(1, 0, self%state%is_near)
   end subroutine measure

   pure subroutine offset_off(self, i, scene, gap, offset, is_last)
      class(start_gaps_wall_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: gap                !! that is wanted [L]
      real(wp), intent(out) :: offset(:)         !! (3) [L]
      logical, intent(out) :: is_last            !! it is round-off

      call look(self, i, scene)
      offset = (self%state(i)%gap0 - gap)*self%spot(i)%normal
      is_last = abs(self%state(i)%gap0 - gap) <= epsilon(1.0_wp)*maxval(abs( &
         scene%x(:, self%node(i)) + scene%u0(:, self%node(i))))
   end subroutine offset_off

   pure logical function faces(self, i, scene)
      class(start_gaps_wall_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), dimension(size(scene%x, 1)) :: mean, normal
      integer :: k

      mean = 0.0_wp
      associate (slave => self%surface(is_slave))
         do k = slave%around_start(self%place(i)), slave%around_start(self%place(i) + 1) - 1
            normal = facets_normal(slave, slave%around(k), scene%x, scene%u0)
            mean = mean + normal/sqrt(dot_product(normal, normal))
         end do
      end associate
      faces = self%is_closed .or. dot_product(mean, self%spot(i)%normal) &
         < -least_facing*sqrt(dot_product(mean, mean))
   end function faces

   pure subroutine is_sharp(self, scene, angle, sharp)
      class(start_gaps_wall_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: angle              !! [degrees]
      logical, intent(out) :: sharp(:)           !! (n)
      type(facet_groups_t) :: groups
      logical :: is_rim(size(self%surface(is_slave)%node))

      call facets_rim(self%surface(is_slave), is_rim)
      call facet_groups_init(groups, self%surface(is_slave), scene%x, angle)
      sharp = is_rim(self%place) .or. groups%node_start(self%place + 1) &
         - groups%node_start(self%place) /= 1
   end subroutine is_sharp

   !> A shape crosses itself nowhere; of the slave it is not looked for.
   pure subroutine crossing(self, which, scene, first, second)
      class(start_gaps_wall_t), intent(in) :: self
      integer, intent(in) :: which               !! `is_slave` or `is_master`
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: first, second      !! 0, 0: nowhere

      first = 0
      second = 0
   end subroutine crossing

   !> A wall has no facets: depths are told by those of the slave.
   pure real(wp) function other_size(self, i)
      class(start_gaps_wall_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n

      other_size = self%size(i)
   end function other_size

   subroutine other_text(self, i, scene, text)
      class(start_gaps_wall_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text     !! no line ends

      text = "its shape"
   end subroutine other_text

end module emcon_start_gaps_wall_space
