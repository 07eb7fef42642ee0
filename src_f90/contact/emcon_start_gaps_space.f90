!> Gaps of nodes over faces before the first step: how far they are from the surface, which side of
!> it they are on.
module emcon_start_gaps_space
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t
   use emcon_facets, only : facets_init, facets_length, facets_normal, facets_rim, facets_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_signed_distance_space, only : signed_distance_find, signed_distance_init, &
      signed_distance_reaches, signed_distance_t, signed_distance_to, signed_foot_t
   use emcon_start_gaps, only : is_master, is_slave, start_gaps_t
   implicit none
   private
   public :: start_gaps_space_t, start_gaps_space_init

   !> A node counts as over a surface so far beyond its end, per facet: rims meet rims.
   real(wp), parameter :: end_tol = 1.0e-3_wp
   !> Nodes are near so far from a facet, by its length. Behind a closed surface they always are, in
   !> front of any so far as ADJUST moves them.
   real(wp), parameter :: near_per_facet = 0.5_wp
   !> Surfaces face each other where the cosine of their normals is below minus this.
   real(wp), parameter :: least_facing = 0.25_wp

   type, extends(start_gaps_t) :: start_gaps_space_t
      type(signed_distance_t), private :: master !! where it is at the start
      type(signed_foot_t), allocatable, private :: foot(:)   !! (n) as last measured
      real(wp), private :: pad = 0.0_wp          !! gaps are counted from it on [L]
      real(wp), private :: reach = 0.0_wp        !! in front of the master nodes are near so far [L]
      real(wp), private :: farthest = 0.0_wp     !! what is farther is not near, or in a body [L]
   contains
      procedure :: nearest
      procedure :: measure
      procedure :: offset => offset_off
      procedure :: faces
      procedure :: is_sharp
      procedure :: crossing
   end type start_gaps_space_t

contains

   !> The pair `pair` of `scene`.
   subroutine start_gaps_space_init(self, scene, pair, error)
      type(start_gaps_space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call facets_init(self%surface(is_slave), scene, scene%surface(pair%slave), error)
      if (allocated(error)) return
      call facets_init(self%surface(is_master), scene, scene%surface(pair%master), error)
      if (allocated(error)) return
      call signed_distance_init(self%master, self%surface(is_master), scene%x, scene%u0)
      self%node = self%surface(is_slave)%node
      self%n = size(self%node)
      self%is_self = pair%slave == pair%master
      self%pad = pair%interaction%offset
      self%reach = self%pad + max(0.0_wp, pair%adjust%distance)
      if (pair%adjust%set > 0) self%reach = 0.5_wp*sqrt(huge(self%reach))
      associate (master => self%surface(is_master))
         self%farthest = max(self%reach, self%pad + near_per_facet* &
            maxval([0.0_wp, (facets_length(master, i), i = 1, master%n_facet)]))
         self%farthest = (1.0_wp + 4.0_wp*epsilon(1.0_wp))*self%farthest
      end associate
      self%place = [(i, i = 1, self%n)]
      allocate(self%duplicate(self%n), self%facet(self%n), source=0)
      allocate(self%doubt(self%n), source=0.0_wp)
      allocate(self%state(self%n), self%foot(self%n))
      associate (master => self%surface(is_master))
         self%is_closed = .not. any(master%neighbour == 0 .and. master%facet > 0)
      end associate
   end subroutine start_gaps_space_init

   pure subroutine nearest(self, i, scene, gap, is_over)
      class(start_gaps_space_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! not past an end of the surface

      call signed_distance_find(self%master, place_of(self, i, scene), self%foot(i))
      self%facet(i) = self%foot(i)%facet
      self%state(i) = state_of(self, i)
      gap = self%state(i)%gap0
      is_over = self%state(i)%is_over
   end subroutine nearest

   pure subroutine measure(self, scene)
      class(start_gaps_space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: i

      self%facet = 0
      do i = 1, self%n
         associate (place => place_of(self, i, scene))
            if (self%is_closed .and. signed_distance_reaches(self%master, place)) then
               call signed_distance_find(self%master, place, self%foot(i))
            else
               call signed_distance_find(self%master, place, self%foot(i), self%farthest)
            end if
         end associate
         self%state(i) = state_of(self, i)
         if (self%state(i)%is_near) self%facet(i) = self%foot(i)%facet
      end do
   end subroutine measure

   !> Where node `i` is at the start.
   pure function place_of(self, i, scene) result(place)
      type(start_gaps_space_t), intent(in) :: self
      integer, intent(in) :: i
      type(scene_t), intent(in) :: scene
      real(wp) :: place(size(scene%x, 1))

      place = scene%x(:, self%node(i)) + scene%u0(:, self%node(i))
   end function place_of

   !> The state of node `i` by its foot.
   pure type(gap_state_t) function state_of(self, i) result(state)
      type(start_gaps_space_t), intent(in) :: self
      integer, intent(in) :: i

      associate (foot => self%foot(i))
         if (foot%facet == 0) return
         state%size = facets_length(self%surface(is_master), foot%facet)
         state%gap0 = foot%distance - self%pad
         state%gap1 = state%gap0
         state%is_over = foot%past <= end_tol*state%size
         state%is_near = abs(foot%distance) <= self%pad + near_per_facet*state%size .or. &
            merge(self%is_closed, foot%distance <= self%reach, foot%distance < 0.0_wp)
      end associate
   end function state_of

   pure subroutine offset_off(self, i, scene, offset, is_last)
      class(start_gaps_space_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: offset(:)         !! (3) [L]
      logical, intent(out) :: is_last            !! it is round-off

      associate (place => place_of(self, i, scene), foot => self%foot(i))
         call signed_distance_to(self%master, (foot%simplex), place, foot)
         offset = (foot%distance - self%pad)*foot%way
         is_last = abs(foot%distance - self%pad) <= epsilon(1.0_wp)*maxval(abs(place))
      end associate
   end subroutine offset_off

   pure logical function faces(self, i, scene)
      class(start_gaps_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), dimension(size(scene%x, 1)) :: mean, normal
      integer :: k

      mean = 0.0_wp
      associate (slave => self%surface(is_slave))
         do k = slave%around_start(i), slave%around_start(i + 1) - 1
            normal = facets_normal(slave, slave%around(k), scene%x, scene%u0)
            mean = mean + normal/sqrt(dot_product(normal, normal))
         end do
      end associate
      normal = facets_normal(self%surface(is_master), self%facet(i), scene%x, scene%u0)
      faces = self%is_closed .or. dot_product(mean, normal) < &
         -least_facing*sqrt(dot_product(mean, mean)*dot_product(normal, normal))
   end function faces

   pure subroutine is_sharp(self, scene, angle, sharp)
      class(start_gaps_space_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: angle              !! [degrees]
      logical, intent(out) :: sharp(:)           !! (n)
      type(facet_groups_t) :: groups

      call facets_rim(self%surface(is_slave), sharp)
      call facet_groups_init(groups, self%surface(is_slave), scene%x, angle)
      associate (start => groups%node_start)
         sharp = sharp .or. start(2:) - start(:self%n) /= 1
      end associate
   end subroutine is_sharp

   !> It is not looked for.
   pure subroutine crossing(self, which, scene, first, second)
      class(start_gaps_space_t), intent(in) :: self
      integer, intent(in) :: which               !! `is_slave` or `is_master`
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: first, second      !! 0, 0: nowhere

      first = 0
      second = 0
   end subroutine crossing

end module emcon_start_gaps_space
