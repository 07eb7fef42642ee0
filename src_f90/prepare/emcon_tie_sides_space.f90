!> The two sides of a tie in space: their facets, split into triangles, and how far the master is
!> from a point.
module emcon_tie_sides_space
   use emcon_box_tree, only : box_tree_init, box_tree_next, box_tree_t, leaf_size
   use emcon_couplings, only : tie_t
   use emcon_errors, only : error_t
   use emcon_facet_split, only : facet_split_init, facet_split_place, facet_split_t
   use emcon_facets, only : facets_init, facets_length, facets_t
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_t, nearest_update
   use emcon_scene, only : scene_t
   use emcon_tie_shapes_space, only : tie_skew
   implicit none
   private
   public :: tie_sides_t, tie_side_t, tie_sides_init, tie_sides_nearest, tie_sides_tolerance
   public :: tie_sides_reach, triangle_at

   type :: tie_side_t
      type(facets_t) :: facets
      type(facet_split_t) :: split
      real(wp), allocatable :: at(:, :)          !! (3, n_point) of the split [L]
      real(wp), allocatable :: skew(:, :)        !! (2, n_facet) of `tie_skew`
   end type tie_side_t

   type :: tie_sides_t
      type(tie_side_t) :: slave, master
      !> of the triangles of the master, blown up by what these reach: with the reach of a slave
      !> facet that is as far as the longer of the two asks for
      type(box_tree_t) :: tree
      real(wp) :: tolerance = -1.0_wp            !! of positions; < 0: by default [L]
      real(wp) :: noise = 0.0_wp                 !! of positions, by rounding [L]
   end type tie_sides_t

   !> The default tolerance, per length of the longer of two facets that face each other.
   real(wp), parameter :: default_tolerance = 0.1_wp
   !> Between its nodes a facet may be farther off than at them, per length of the longer one: by
   !> the sagitta of an arc that turns by 60 degrees, tan(15 degrees)/2.
   real(wp), parameter :: sagitta = 0.5_wp*(2.0_wp - sqrt(3.0_wp))
   !> Coordinates in a deck are rounded: so many epsilons of them are no distance.
   real(wp), parameter :: rounding = 8.0_wp*epsilon(1.0_wp)

contains

   subroutine tie_sides_init(self, scene, tie, error)
      type(tie_sides_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: low(:, :), high(:, :)
      real(wp) :: reach
      integer :: t

      self%tolerance = tie%tolerance
      call side_init(self%slave, scene, tie%slave, error)
      if (.not. allocated(error)) call side_init(self%master, scene, tie%master, error)
      if (allocated(error)) return
      if (min(size(self%slave%at), size(self%master%at)) == 0) return
      self%noise = rounding*max(maxval(abs(self%slave%at)), maxval(abs(self%master%at)))
      associate (split => self%master%split)
         allocate(low(3, size(split%facet)), high(3, size(split%facet)))
         do t = 1, size(split%facet)
            reach = tie_sides_reach(self, facets_length(self%master%facets, split%facet(t)))
            low(:, t) = minval(triangle_at(self%master, t), 2) - reach
            high(:, t) = maxval(triangle_at(self%master, t), 2) + reach
         end do
      end associate
      call box_tree_init(self%tree, low, high)
   end subroutine tie_sides_init

   subroutine side_init(self, scene, surface, error)
      type(tie_side_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: surface             !! its number
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: still(:, :)
      integer :: f

      call facets_init(self%facets, scene, scene%surface(surface), error)
      if (allocated(error)) return
      call facet_split_init(self%split, self%facets)
      allocate(self%at(3, self%split%n_point))
      allocate(still(size(scene%x, 1), size(scene%x, 2)), source=0.0_wp)
      call facet_split_place(self%split, self%facets, scene%x, still, self%at)
      allocate(self%skew(2, self%facets%n_facet))
      do f = 1, self%facets%n_facet
         associate (node => self%facets%facet(:, f))
            self%skew(:, f) = tie_skew(scene%x(:, node(:count(node > 0))))
         end associate
      end do
   end subroutine side_init

   !> The corners of a triangle of a side.
   pure function triangle_at(side, t) result(corner)
      type(tie_side_t), intent(in) :: side
      integer, intent(in) :: t                   !! its number in the split
      real(wp) :: corner(3, 3)                   !! (3, corner) [L]

      corner = side%at(:, side%split%corner(:, t))
   end function triangle_at

   !> How far apart nodes may be from facets, the longer of which has that length.
   pure real(wp) function tie_sides_tolerance(self, length) result(tolerance)
      type(tie_sides_t), intent(in) :: self
      real(wp), intent(in) :: length             !! [L]

      tolerance = self%noise + merge(default_tolerance*length, self%tolerance, &
         self%tolerance < 0.0_wp)
   end function tie_sides_tolerance

   !> The same of places between nodes.
   pure real(wp) function tie_sides_reach(self, length) result(reach)
      type(tie_sides_t), intent(in) :: self
      real(wp), intent(in) :: length             !! [L]

      reach = tie_sides_tolerance(self, length) + sagitta*length
   end function tie_sides_reach

   !> The place of the master nearest to a point, whichever way it looks.
   pure subroutine tie_sides_nearest(self, point, nearest)
      type(tie_sides_t), intent(in) :: self
      real(wp), intent(in) :: point(3)           !! [L]
      type(nearest_t), intent(out) :: nearest
      integer :: found(leaf_size), n, k, i

      k = 1
      do
         call box_tree_next(self%tree, point, sqrt(nearest%square), k, found, n)
         if (n == 0) return
         do i = 1, n
            call nearest_update(nearest, found(i), point, triangle_at(self%master, found(i)))
         end do
      end do
   end subroutine tie_sides_nearest

end module emcon_tie_sides_space
