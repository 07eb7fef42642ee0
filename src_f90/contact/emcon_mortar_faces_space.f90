!> Slave facets of mortar contact in space: their triangles, the multipliers of their vertices, and
!> what of the master each triangle may see. Source: docs/theory.md, section 15.2.
module emcon_mortar_faces_space
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_frames_init
   use emcon_facets, only : facets_init, facets_length
   use emcon_interactions, only : contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_mortar_slave_space, only : mortar_slave_init, mortar_slave_t
   use emcon_near_list, only : near_list_init, near_list_t, near_list_within
   use emcon_patch_sides_space, only : patch_sides_t, patch_triangles_init
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: mortar_faces_t, mortar_faces_init, mortar_faces_choose

   type, extends(mortar_slave_t) :: mortar_faces_t
      type(patch_sides_t) :: sides
      type(near_list_t) :: near
      real(wp) :: beyond = 0.0_wp                     !! of its reach what is beside stencils [L]
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
         call mortar_slave_init(self, sides%slave, scene%x)
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
