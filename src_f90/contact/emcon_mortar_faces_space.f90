!> Slave facets of mortar contact in space: their triangles, the multipliers of their vertices, and
!> what of the master each triangle may see. Source: docs/theory.md, section 14.2.
module emcon_mortar_faces_space
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_frames_init
   use emcon_facets, only : facets_init, facets_length
   use emcon_interactions, only : contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_mortar_itself_space, only : mortar_itself_facet, mortar_itself_init, &
      mortar_itself_meets, mortar_itself_t
   use emcon_mortar_slave_space, only : mortar_slave_init, mortar_slave_t
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_patch_sides_space, only : patch_sides_t, patch_triangles_init
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_t
   use emcon_scene, only : scene_t
   use emcon_touch_rule_space, only : touch_rule_space_init
   implicit none
   private
   public :: mortar_faces_t, mortar_faces_init, mortar_faces_look, mortar_faces_choose

   type, extends(mortar_slave_t) :: mortar_faces_t
      type(patch_sides_t) :: sides
      type(mortar_itself_t) :: itself                 !! in contact with itself
      type(near_list_t) :: near
      real(wp) :: beyond = 0.0_wp                     !! of its reach what is beside stencils [L]
      integer :: n_sifted = 0                         !! the list that `sift` has gone through
      type(patch_stencil_t), allocatable :: stencil(:)   !! (n_triangle)
   end type mortar_faces_t

contains

   !> Set up the facets of `pair`.
   subroutine mortar_faces_init(self, scene, pair, error)
      type(mortar_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: f

      associate (sides => self%sides)
         call facets_init(sides%slave, scene, scene%surface(pair%slave), error)
         if (allocated(error)) return
         allocate(sides%master)
         call facets_init(sides%master, scene, scene%surface(pair%master), error)
         if (allocated(error)) return
         if (pair%slave == pair%master) then
            call touch_rule_space_init(sides%rule, sides%master, [integer ::], scene)
            call mortar_itself_init(self%itself, sides%slave, sides%rule, scene%x)
         end if
         call mortar_slave_init(self, sides%slave, scene%x)
         if (sides%rule%is_self) then
            sides%rule%facet_of_point = mortar_itself_facet(self%itself, self%split%facet)
            sides%rule%body_of_point = sides%rule%body(sides%rule%facet_of_point)
         end if
         call facet_frames_init(sides%frames, sides%slave, self%split)
         call patch_triangles_init(sides%triangles, sides%master, scene%x)
         allocate(sides%mirror(sides%master%n_facet), source=0)
         ! Lists end beside what a triangle sees: all that meets with that is listed.
         self%beyond = maxval([0.0_wp, (facets_length(sides%master, f), &
            f = 1, sides%master%n_facet)])
         call near_list_init(self%near, sides%slave%facet, sides%master%facet, scene%x, scene%u0, &
            self%beyond + pair%interaction%offset + interaction_reach(pair%interaction))
      end associate
      allocate(self%stencil(size(self%split%facet)))
   end subroutine mortar_faces_init

   !> Look for what facets of the master are near each of the slave.
   pure subroutine mortar_faces_look(self, x, u0, du, reach)
      type(mortar_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(inout) :: reach           !! what is farther is not near; it only grows [L]

      call near_list_update(self%near, x, u0, du, reach)
      if (self%sides%rule%is_self .and. self%n_sifted /= self%near%n_list) call sift(self)
   end subroutine mortar_faces_look

   !> Leave out of a new list of candidates what a surface never touches of itself.
   pure subroutine sift(self)
      type(mortar_faces_t), intent(inout) :: self
      integer :: f, k, from, n

      n = 0
      associate (list => self%near%candidates, sides => self%sides)
         do f = 1, size(list%start) - 1
            from = list%start(f)
            list%start(f) = n + 1
            do k = from, list%start(f + 1) - 1
               if (.not. mortar_itself_meets(self%itself, sides%rule, sides%master, f, &
                  list%facet(k))) cycle
               n = n + 1
               list%facet(n) = list%facet(k)
            end do
         end do
         list%start(size(list%start)) = n + 1
      end associate
      self%near%candidates%facet = self%near%candidates%facet(:n)
      if (n == 0) self%near%nearest = self%near%reach
      self%n_sifted = self%near%n_list
   end subroutine sift

   !> The stencils of the triangles of slave facet `f`; none of them where nothing comes near.
   pure subroutine mortar_faces_choose(self, f, x, u0, reach)
      type(mortar_faces_t), intent(inout) :: self
      integer, intent(in) :: f                   !! 1..n_facet of the slave
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! what is farther is not seen [L]
      integer :: k, t

      self%stencil(self%split%start(f):self%split%start(f + 1) - 1)%triangle = 0
      associate (list => self%near%candidates)
         associate (of => list%facet(list%start(f):list%start(f + 1) - 1))
            associate (is_near => [(near_list_within(self%near, f, of(k), reach), k = 1, &
                  size(of))], is_beside => [(.not. near_list_within(self%near, f, of(k), &
                  reach - self%beyond), k = 1, size(of))])
               if (all(is_beside)) return
               do t = self%split%start(f), self%split%start(f + 1) - 1
                  call patch_stencil_choose(self%stencil(t), self%sides, t, pack(of, is_near), x, &
                     u0, pack(is_beside, is_near))
               end do
            end associate
         end associate
      end associate
   end subroutine mortar_faces_choose

end module emcon_mortar_faces_space
