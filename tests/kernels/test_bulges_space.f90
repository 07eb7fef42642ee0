!> What facets are below the curved surface that their nodes are on.
module test_bulges_space
   use check, only : check_near, check_true, test_case_t
   use emcon_bulges_space, only : bulges_find, bulges_largest, bulges_rise, bulges_t
   use emcon_errors, only : error_t
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_bulges_space

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: radius = 2.0_wp
   !> Curvatures are told to the root of round-off; a hundredth of this is left.
   real(wp), parameter :: unknown = 100.0_wp*radius*sqrt(epsilon(1.0_wp))
   integer, parameter :: is_flat = 0, is_cylinder = 1, is_sphere = 2

contains

   subroutine collect_bulges_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("none over a flat surface", test_flat), &
         test_case_t("over facets of a cylinder and a sphere", test_round)]
   end subroutine collect_bulges_space

   !> The upper faces of a box of 4 x n cells that is bent about an axis below, or above.
   subroutine begin(shape, sign, n, scene, facets, split, error)
      integer, intent(in) :: shape
      real(wp), intent(in) :: sign               !! 1: bulges out of the box, -1: is hollow
      integer, intent(in) :: n                   !! cells along the axis
      type(scene_t), intent(out) :: scene
      type(facets_t), intent(out) :: facets
      type(facet_split_t), intent(out) :: split
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: surface
      real(wp) :: way(3)
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", [-0.5_wp, -0.375_wp, -0.25_wp], [1.0_wp, 0.75_wp, 0.25_wp], &
         [4, n, 1])
      surface = skin(scene)
      associate (is_top => surface%face == 2)
         surface%element = pack(surface%element, is_top)
         surface%face = pack(surface%face, is_top)
      end associate
      do i = 1, size(scene%x, 2)
         associate (x => scene%x(:, i))
            way = [x(1), x(2), radius]
            if (shape == is_cylinder) then
               x = x + [x(1)*(radius/norm2(way([1, 3])) - 1.0_wp), 0.0_wp, &
                  sign*(radius**2/norm2(way([1, 3])) - radius)]
            else if (shape == is_sphere) then
               x = x + [x(:2)*(radius/norm2(way) - 1.0_wp), sign*(radius**2/norm2(way) - radius)]
            end if
         end associate
      end do
      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call facet_split_init(split, facets)
   end subroutine begin

   subroutine test_flat(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_split_t) :: split
      type(bulges_t) :: bulges
      integer :: t

      call begin(is_flat, 1.0_wp, 3, scene, facets, split, error)
      if (allocated(error)) return
      call bulges_find(bulges, facets, split, scene%x, 60.0_wp)
      do t = 1, size(split%facet)
         call check_near(error, bulges_rise(bulges, split, t, [0.3_wp, 0.3_wp, 0.4_wp]), 0.0_wp, &
            tol, radius, "flat")
      end do
   end subroutine test_flat

   !> In the middle of sides of facets and in their centres: a part of a hundredth is of fourth
   !> order, (l/R)^2/4 of facets of 1/4 on a radius of 2 being 1/256.
   subroutine test_round(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_split_t) :: split
      type(bulges_t) :: bulges
      real(wp) :: sign, exact, most
      integer :: k, n, shape, t

      do shape = is_cylinder, is_sphere
         do k = 1, 4
            sign = merge(1.0_wp, -1.0_wp, btest(k, 0))
            n = merge(3, 1, k <= 2 .or. shape == is_sphere)  ! one cell tells of one curvature
            call begin(shape, sign, n, scene, facets, split, error)
            if (allocated(error)) return
            call bulges_find(bulges, facets, split, scene%x, 60.0_wp)
            most = 0.0_wp
            do t = 1, size(split%facet)
               exact = rise_over(0.5_wp*(at(split%corner(1, t)) + at(split%corner(2, t))))
               call check_near(error, bulges_rise(bulges, split, t, [0.5_wp, 0.5_wp, 0.0_wp]), &
                  exact, 0.01_wp, abs(exact) + unknown, "middle of a side")
               exact = rise_over(at(split%corner(3, t)))
               call check_near(error, bulges_rise(bulges, split, t, [0.0_wp, 0.0_wp, 1.0_wp]), &
                  exact, 0.01_wp, abs(exact) + unknown, "centre")
               most = max(most, abs(exact)/sqrt(facets%size(split%facet(t))))
            end do
            call check_true(error, bulges_largest(bulges, split, &
               sqrt(facets%size(split%facet))) >= 0.99_wp*most, "the largest one")
         end do
      end do

   contains

      !> Point `i` of the split.
      function at(i)
         integer, intent(in) :: i
         real(wp) :: at(3)

         if (i <= split%n_node) then
            at = scene%x(:, facets%node(i))
         else
            associate (f => split%of_centre(i - split%n_node))
               at = sum(scene%x(:, facets%facet(:, f)), 2)/size(facets%facet, 1)
            end associate
         end if
      end function at

      !> The round surface above `place`, out of the body.
      real(wp) function rise_over(place) result(rise)
         real(wp), intent(in) :: place(3)
         real(wp) :: way(3)

         way = place
         way(3) = place(3) + sign*radius
         if (shape == is_cylinder) way(2) = 0.0_wp
         rise = sign*(radius - norm2(way))
      end function rise_over

   end subroutine test_round

end module test_bulges_space
