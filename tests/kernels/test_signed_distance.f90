!> Distances of points from surfaces in space, against closed forms, all triangles and solid angles.
module test_signed_distance
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_signed_distance_space, only : signed_distance_find, signed_distance_init, &
      signed_distance_t, signed_distance_to, signed_foot_t
   use random_draws, only : draw_random
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_signed_distance

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 64.0_wp*eps
   real(wp), parameter :: origin(3) = 0.0_wp, unit(3) = 1.0_wp
   integer, parameter :: n_point = 400

contains

   subroutine collect_signed_distance(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a box", test_box), &
         test_case_t("a crumpled body", test_crumpled), &
         test_case_t("units", test_units), &
         test_case_t("beyond free sides", test_free), &
         test_case_t("a surface of nodes has none", test_none)]
   end subroutine collect_signed_distance

   !> Points around a box, and in it, at random and exactly over its faces, edges and corners.
   subroutine test_box(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(signed_distance_t) :: surface
      type(signed_foot_t) :: foot
      real(wp) :: point(3, n_point), off(3), expected
      character(len=4), parameter :: name(2) = ["C3D8", "C3D4"]
      integer :: i, k

      do k = 1, 2
         call space_begin(scene)
         call add_box(scene, name(k), origin, unit, [2, 3, 4])
         call facets_init(facets, scene, skin(scene), error)
         if (allocated(error)) return
         call signed_distance_init(surface, facets, scene%x, 0.0_wp*scene%x)
         call draw_random(point)
         point = 3.0_wp*point - 1.0_wp
         point(:, ::4) = real(nint(4.0_wp*point(:, ::4)), wp)/4.0_wp
         do i = 1, n_point
            call signed_distance_find(surface, point(:, i), foot)
            off = max(0.0_wp - point(:, i), point(:, i) - 1.0_wp)
            expected = maxval(off)
            if (expected > 0.0_wp) expected = norm2(max(off, 0.0_wp))
            call check_near(error, foot%distance, expected, tol, 1.0_wp, "distance")
            call check_near(error, norm2(foot%way), 1.0_wp, tol, 1.0_wp, "unit")
            call check_near(error, foot%past, 0.0_wp, tol, 1.0_wp, "closed")
            call check_equal(error, foot%facet, surface%split%facet(foot%simplex), "facet")
            off = point(:, i) - foot%distance*foot%way
            call check_near(error, max(maxval(off), 1.0_wp - minval(off)), 1.0_wp, tol, 1.0_wp, &
               "on it")
         end do
      end do
   end subroutine test_box

   !> A body with ridges, valleys and spikes: the nearest of all triangles, and inside by the solid
   !> angle that the surface is seen under.
   subroutine test_crumpled(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(signed_distance_t) :: surface
      type(signed_foot_t) :: foot, other
      real(wp), allocatable :: radius(:)
      real(wp) :: point(3, n_point), least
      integer :: i, k

      call space_begin(scene)
      call add_box(scene, "C3D4", -unit, 2.0_wp*unit, [2, 2, 2])
      allocate(radius(size(scene%x, 2)))
      call draw_random(radius)
      do i = 1, size(radius)
         scene%x(:, i) = (0.3_wp + radius(i))*scene%x(:, i)
      end do
      call facets_init(facets, scene, skin(scene), error)
      if (allocated(error)) return
      call signed_distance_init(surface, facets, scene%x, 0.0_wp*scene%x)
      call draw_random(point)
      point = 3.0_wp*point - 1.5_wp
      do i = 1, n_point
         call signed_distance_find(surface, point(:, i), foot)
         least = huge(least)
         do k = 1, size(surface%split%facet)
            call signed_distance_to(surface, k, point(:, i), other)
            least = min(least, abs(other%distance))
         end do
         call check_near(error, abs(foot%distance), least, tol, 1.0_wp, "the nearest")
         call check_true(error, (foot%distance < 0.0_wp) .eqv. is_inside(point(:, i)), "side")
      end do

   contains

      !> The solid angle of all triangles, by its closed form, is -4 pi or 0.
      logical function is_inside(p)
         real(wp), intent(in) :: p(3)
         real(wp) :: v(3, 3), r(3), total
         integer :: f, j

         total = 0.0_wp
         do f = 1, facets%n_facet
            do j = 1, 3
               v(:, j) = scene%x(:, facets%facet(j, f)) - p
               r(j) = norm2(v(:, j))
            end do
            total = total + 2.0_wp*atan2(dot_product(v(:, 1), cross_product(v(:, 2), v(:, 3))), &
               product(r) + dot_product(v(:, 1), v(:, 2))*r(3) &
               + dot_product(v(:, 2), v(:, 3))*r(1) + dot_product(v(:, 3), v(:, 1))*r(2))
         end do
         is_inside = abs(total) > 6.0_wp
      end function is_inside

   end subroutine test_crumpled

   !> Lengths times a power of two: the same bits.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(signed_distance_t) :: surface, large
      type(signed_foot_t) :: foot, other
      real(wp) :: point(3, n_point)
      real(wp), parameter :: factor = 2.0_wp**20
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", origin, unit, [2, 3, 4])
      call facets_init(facets, scene, skin(scene), error)
      if (allocated(error)) return
      call draw_random(point)
      call signed_distance_init(surface, facets, scene%x, 0.0_wp*scene%x)
      call signed_distance_init(large, facets, factor*scene%x, 0.0_wp*scene%x)
      do i = 1, n_point
         call signed_distance_find(surface, 2.0_wp*point(:, i), foot)
         call signed_distance_find(large, factor*2.0_wp*point(:, i), other)
         call check_near(error, other%distance, factor*foot%distance, 0.0_wp, 1.0_wp, "bits")
         call check_equal(error, other%simplex, foot%simplex, "triangle")
      end do
   end subroutine test_units

   !> Over one face alone: past its end by how far points are beside it.
   subroutine test_free(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(surface_t) :: face
      type(facets_t) :: facets
      type(signed_distance_t) :: surface
      type(signed_foot_t) :: foot
      real(wp), parameter :: past(4) = [0.0_wp, 0.0_wp, 0.25_wp, 0.5_wp*sqrt(2.0_wp)]
      real(wp), parameter :: point(3, 4) = reshape([0.3_wp, 0.4_wp, 1.5_wp, &
         1.0_wp, 0.4_wp, 0.5_wp, &
         1.25_wp, 0.4_wp, 1.5_wp, &
         -0.5_wp, 1.5_wp, 0.5_wp], [3, 4])
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", origin, unit, [1, 1, 1])
      face%name = "TOP"
      face%element = [1]
      face%face = [2]
      call facets_init(facets, scene, face, error)
      if (allocated(error)) return
      call signed_distance_init(surface, facets, scene%x, 0.0_wp*scene%x)
      do i = 1, size(past)
         call signed_distance_find(surface, point(:, i), foot)
         call check_near(error, foot%past, past(i), tol, 1.0_wp, "past")
         call check_near(error, foot%distance, sign(norm2([point(3, i) - 1.0_wp, past(i)]), &
            point(3, i) - 1.0_wp), tol, 1.0_wp, "distance")
      end do
   end subroutine test_free

   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(surface_t) :: surface
      type(facets_t) :: facets
      type(signed_distance_t) :: distance
      type(signed_foot_t) :: foot

      call space_begin(scene)
      call add_box(scene, "C3D8", origin, unit, [1, 1, 1])
      surface%name = "NODES"
      surface%is_nodal = .true.
      surface%node = [1, 2]
      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call signed_distance_init(distance, facets, scene%x, 0.0_wp*scene%x)
      call signed_distance_find(distance, origin, foot)
      call check_equal(error, foot%simplex, 0, "no triangle")
   end subroutine test_none

end module test_signed_distance
