!> Gaps of nodes over faces before the first step: how far they are from the surface, which side of
!> it they are on. In a surface in contact with itself each body is one for the nodes of others.
module emcon_start_gaps_space
   use emcon_bodies, only : bodies_find
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t
   use emcon_facets, only : facets_init, facets_length, facets_normal, facets_rim, facets_t
   use emcon_interactions, only : contact_pair_t
   use emcon_guards, only : touching_bar
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_overlap_query, only : overlap_names, overlap_t
   use emcon_overlap_space, only : overlap_space_own
   use emcon_scene, only : scene_t
   use emcon_signed_distance_space, only : signed_distance_find, signed_distance_init, &
      signed_distance_reaches, signed_distance_t, signed_distance_to, signed_foot_t
   use emcon_start_gaps, only : is_master, is_slave, start_gaps_t
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
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

   !> What nodes are measured against: the master, or a body of it.
   type :: side_t
      type(signed_distance_t) :: at              !! where it is at the start
      integer, allocatable :: facet(:)           !! of the master
      integer :: body = 0                        !! its nodes are not measured; 0: all are
      logical :: is_closed = .false.
   end type side_t

   type, extends(start_gaps_t) :: start_gaps_space_t
      type(side_t), allocatable, private :: side(:)
      integer, allocatable, private :: body(:)   !! (n) of each node, if it must not meet its own
      integer, allocatable, private :: of_foot(:)            !! (n) the side that its foot is on
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
      allocate(self%state(self%n), self%foot(self%n), self%of_foot(self%n))
      self%of_foot = 1
      self%is_closed = is_closed(self%surface(is_master))
      if (self%is_self) then
         call make_bodies(self, scene, scene%surface(pair%master), error)
      else
         allocate(self%side(1), self%body(self%n))
         self%body = -1
         call make_side(self%side(1), self%surface(is_master), scene, &
            [(i, i = 1, self%surface(is_master)%n_facet)], 0)
      end if
   end subroutine start_gaps_space_init

   !> Has a surface no rim?
   pure logical function is_closed(facets)
      type(facets_t), intent(in) :: facets

      is_closed = .not. any(facets%neighbour == 0 .and. facets%facet > 0)
   end function is_closed

   !> The facets `facet` of the master, by themselves, as a side for nodes of other bodies than
   !> `body`.
   pure subroutine make_side(side, facets, scene, facet, body)
      type(side_t), intent(out) :: side
      type(facets_t), intent(in) :: facets       !! of them alone
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: facet(:), body

      side%facet = facet
      side%body = body
      side%is_closed = is_closed(facets)
      call signed_distance_init(side%at, facets, scene%x, scene%u0)
   end subroutine make_side

   !> A side for each body of the surface; facets without elements are none.
   subroutine make_bodies(self, scene, surface, error)
      type(start_gaps_space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(inout) :: error
      type(surface_t) :: part
      type(facets_t) :: facets
      integer, allocatable :: body(:), own(:)
      integer :: of_facet(self%surface(is_master)%n_facet), b, f, k, n_body

      call bodies_find(scene%element%node, size(scene%x, 2), body, n_body)
      self%body = body(self%node)
      of_facet = body(self%surface(is_master)%facet(1, :))
      allocate(self%side(count([(any(of_facet == b), b = 1, n_body)])))
      k = 0
      do b = 1, n_body
         own = pack([(f, f = 1, size(of_facet))], of_facet == b)
         if (size(own) == 0) cycle
         k = k + 1
         part = surface
         part%element = surface%element(own)
         part%face = surface%face(own)
         call facets_init(facets, scene, part, error)
         if (allocated(error)) return
         call make_side(self%side(k), facets, scene, own, b)
      end do
   end subroutine make_bodies

   pure subroutine nearest(self, i, scene, gap, is_over)
      class(start_gaps_space_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! not past an end of the surface

      call find_foot(self, i, scene, 0.5_wp*sqrt(huge(gap)))
      gap = self%state(i)%gap0
      is_over = self%state(i)%is_over
   end subroutine nearest

   pure subroutine measure(self, scene)
      class(start_gaps_space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: i

      do i = 1, self%n
         call find_foot(self, i, scene, self%farthest)
         if (.not. self%state(i)%is_near) self%facet(i) = 0
      end do
   end subroutine measure

   !> The foot of node `i`, where it is no farther than `farthest` or in a closed body: of several
   !> sides that of the least gap.
   pure subroutine find_foot(self, i, scene, farthest)
      class(start_gaps_space_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: farthest           !! [L]
      type(signed_foot_t) :: foot
      real(wp) :: place(size(scene%x, 1))
      integer :: k

      place = place_of(self, i, scene)
      self%foot(i) = signed_foot_t()
      do k = 1, size(self%side)
         associate (side => self%side(k))
            if (side%body == self%body(i)) cycle
            if (side%is_closed .and. signed_distance_reaches(side%at, place)) then
               call signed_distance_find(side%at, place, foot)
            else
               call signed_distance_find(side%at, place, foot, farthest)
            end if
         end associate
         if (foot%facet == 0 .or. .not. foot%distance < self%foot(i)%distance) cycle
         self%foot(i) = foot
         self%of_foot(i) = k
      end do
      self%facet(i) = 0
      if (self%foot(i)%facet > 0) self%facet(i) = self%side(self%of_foot(i))%facet( &
         self%foot(i)%facet)
      self%state(i) = state_of(self, i)
   end subroutine find_foot

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
         state%size = facets_length(self%surface(is_master), self%facet(i))
         state%gap0 = foot%distance - self%pad
         state%gap1 = state%gap0
         state%is_over = foot%past <= end_tol*state%size
         state%is_near = abs(foot%distance) <= self%pad + near_per_facet*state%size .or. &
            merge(self%side(self%of_foot(i))%is_closed, foot%distance <= self%reach, &
            foot%distance < 0.0_wp)
      end associate
   end function state_of

   pure subroutine offset_off(self, i, scene, gap, offset, is_last)
      class(start_gaps_space_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: gap                !! that is wanted [L]
      real(wp), intent(out) :: offset(:)         !! (3) [L]
      logical, intent(out) :: is_last            !! it is round-off

      associate (place => place_of(self, i, scene), foot => self%foot(i))
         call signed_distance_to(self%side(self%of_foot(i))%at, (foot%simplex), place, foot)
         offset = (foot%distance - self%pad - gap)*foot%way
         is_last = abs(foot%distance - self%pad - gap) <= epsilon(1.0_wp)*maxval(abs(place))
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

   !> Looked for where a surface is in contact with itself, in each of its bodies.
   subroutine crossing(self, which, scene, first, second)
      class(start_gaps_space_t), intent(in) :: self
      integer, intent(in) :: which               !! `is_slave` or `is_master`
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: first, second      !! 0, 0: nowhere
      type(triangles_t) :: triangles
      type(overlap_t) :: overlap
      integer :: k, f

      first = 0
      second = 0
      if (.not. self%is_self) return
      associate (facets => self%surface(which))
         do k = 1, size(self%side)
            associate (own => self%side(k)%facet)
               call triangles_init(triangles, scene%x, facets%facet(:, own), &
                  [(facets_length(facets, own(f)), f = 1, size(own))])
               call triangles_place(triangles, scene%x, scene%u0, 0.0_wp*scene%u0, 0.0_wp)
               overlap = overlap_t()
               call overlap_space_own(triangles, overlap)
               if (.not. overlap%depth > touching_bar) cycle
               first = own(findloc([(any(facets%facet(:, own(f)) == overlap%node), f = 1, &
                  size(own))], .true., 1))
               second = own(findloc([(all(facets%facet(:, own(f)) == overlap%facet(: &
                  size(facets%facet, 1))), f = 1, size(own))], .true., 1))
               return
            end associate
         end do
      end associate
   end subroutine crossing

end module emcon_start_gaps_space
