!> Smooth groups of facets around nodes, ridges and free sides of bodies in space.
module test_facet_groups
   use check, only : check_equal, check_true, test_case_t
   use emcon_element_kind, only : find_element_kind
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle, ridge_angle, &
      ridges_find, ridges_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_facet_groups

   real(wp), parameter :: origin(3) = 0.0_wp, unit(3) = 1.0_wp

contains

   subroutine collect_facet_groups(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a cube", test_cube), &
         test_case_t("a sphere", test_sphere), &
         test_case_t("an L, whose inner side is none", test_inner), &
         test_case_t("nodes between corners", test_between), &
         test_case_t("angles", test_angles), &
         test_case_t("an open surface", test_open)]
   end subroutine collect_facet_groups

   !> The skin of a scene, its groups and its ridges.
   subroutine find(scene, surface, angle, facets, groups, ridges, error)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      real(wp), intent(in) :: angle              !! of ridges [degrees]
      type(facets_t), intent(out) :: facets
      type(facet_groups_t), intent(out) :: groups
      type(ridges_t), intent(out) :: ridges
      type(error_t), allocatable, intent(out) :: error

      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call facet_groups_init(groups, facets, scene%x, group_angle)
      call ridges_find(ridges, facets, scene%x, angle)
      call check_groups(error, facets, groups)
   end subroutine find

   !> Each facet is in one group at each of its nodes, whose ring has all other nodes of its facets.
   subroutine check_groups(error, facets, groups)
      type(error_t), allocatable, intent(inout) :: error
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      integer :: i, g, k, j

      call check_equal(error, groups%n_group, groups%node_start(size(facets%node) + 1) - 1, "last")
      call check_equal(error, size(groups%facet), size(facets%around), "facets")
      do i = 1, size(facets%node)
         do g = groups%node_start(i), groups%node_start(i + 1) - 1
            associate (own => groups%facet(groups%start(g):groups%start(g + 1) - 1), &
                  ring => groups%ring(groups%ring_start(g):groups%ring_start(g + 1) - 1))
               call check_true(error, all(own(2:) > own(:size(own) - 1)), "ascending")
               call check_true(error, .not. any(ring == i), "others")
               do k = 1, size(own)
                  call check_true(error, any(facets%facet(:, own(k)) == facets%node(i)), "at it")
                  do j = 1, count(facets%facet(:, own(k)) > 0)
                     call check_true(error, facets%corner(j, own(k)) == i .or. &
                        any(ring == facets%corner(j, own(k))), "in the ring")
                  end do
               end do
               do k = 1, size(ring)
                  call check_true(error, any(facets%facet(:, own) == facets%node(ring(k))), "near")
               end do
            end associate
         end do
      end do
   end subroutine check_groups

   !> How many groups node `node` of the scene has.
   pure integer function n_groups(facets, groups, node)
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      integer, intent(in) :: node

      associate (i => findloc(facets%node, node, 1))
         n_groups = groups%node_start(i + 1) - groups%node_start(i)
      end associate
   end function n_groups

   !> Three at its corners, two along its edges, one within its faces; twelve edges of three sides.
   subroutine test_cube(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", origin, unit, [3, 3, 3])
      call find(scene, skin(scene), ridge_angle, facets, groups, ridges, error)
      if (allocated(error)) return
      do i = 1, size(facets%node)
         associate (at => scene%x(:, facets%node(i)))
            call check_equal(error, n_groups(facets, groups, facets%node(i)), &
               count(at < 0.1_wp .or. at > 0.9_wp), "groups")
         end associate
      end do
      call check_equal(error, size(ridges%facet, 2), 12*3, "ridges")
      call check_equal(error, size(ridges%free_facet), 0, "free sides")
      do i = 1, size(ridges%facet, 2)
         call check_true(error, any(facets%neighbour(:, ridges%facet(1, i)) == &
            ridges%facet(2, i)), "neighbours")
         associate (to => scene%x(:, facets%node(ridges%point(2, i))), &
               from => scene%x(:, facets%node(ridges%point(1, i))))
            call check_equal(error, count(abs(to - from) > 0.3_wp), 1, "along an edge")
            call check_equal(error, count(min(to, from) > 0.9_wp .or. max(to, from) < 0.1_wp), 2, &
               "on an edge")
         end associate
      end do
   end subroutine test_cube

   subroutine test_sphere(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      real(wp), parameter :: pi = acos(-1.0_wp)
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", -unit, 2.0_wp*unit, [6, 6, 6])
      associate (x => scene%x)
         do i = 1, size(x, 2)
            associate (top => maxval(abs(x(:, i))))
               if (top <= 0.0_wp) cycle
               x(:, i) = tan(0.25_wp*pi*x(:, i)/top)*top
               x(:, i) = x(:, i)*(top/norm2(x(:, i)))
            end associate
         end do
      end associate
      call find(scene, skin(scene), ridge_angle, facets, groups, ridges, error)
      if (allocated(error)) return
      call check_equal(error, groups%n_group, size(facets%node), "one each")
      call check_equal(error, size(ridges%facet, 2), 0, "ridges")
   end subroutine test_sphere

   !> Groups end at the inner side as at others, but it is no ridge.
   subroutine test_inner(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", origin, unit, [2, 1, 2])
      scene%element%kind = scene%element%kind(:3)
      scene%element%node = scene%element%node(:, :3)
      scene%element%label = scene%element%label(:3)
      call find(scene, skin(scene), ridge_angle, facets, groups, ridges, error)
      if (allocated(error)) return
      ! Of two L 8 sides each, of which one pair meets inside, and 5 edges across.
      call check_equal(error, size(ridges%facet, 2), 2*8 + 5, "ridges")
      do i = 1, size(facets%node)
         associate (at => scene%x(:, facets%node(i)))
            if (abs(at(1) - 0.5_wp) < 0.1_wp .and. abs(at(3) - 0.5_wp) < 0.1_wp) then
               call check_equal(error, n_groups(facets, groups, facets%node(i)), 3, "inside")
            end if
         end associate
      end do
      do i = 1, size(ridges%facet, 2)
         associate (point => facets%node(ridges%point(:, i)))
            call check_true(error, .not. all(abs(scene%x([1, 1, 3, 3], point) - 0.5_wp) < 0.1_wp), &
               "no ridge inside")
         end associate
      end do
   end subroutine test_inner

   !> A node between two corners is at two groups, and has two ridges.
   subroutine test_between(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      character(len=5), parameter :: name(2) = ["C3D20", "C3D10"]
      integer, parameter :: n_ridge(2) = [24, 12], n_corner(2) = [8, 4], n_other(2) = [7, 5]
      integer :: k, i, row

      do k = 1, 2
         call space_begin(scene)
         row = find_element_kind(scene%element%kinds, name(k))
         call scene%element%kinds(row)%shape%places(scene%x)
         scene%element%node = reshape([(i, i = 1, size(scene%x, 2))], [size(scene%x, 2), 1])
         scene%element%kind = [row]
         scene%node%label = scene%element%node(:, 1)
         call find(scene, skin(scene), ridge_angle, facets, groups, ridges, error)
         if (allocated(error)) return
         call check_equal(error, size(ridges%facet, 2), n_ridge(k), name(k) // ", ridges")
         do i = 1, size(scene%x, 2)
            call check_equal(error, n_groups(facets, groups, i), merge(3, 2, i <= n_corner(k)), &
               name(k) // ", groups")
            associate (ring => groups%ring_start(groups%node_start(i):groups%node_start(i) + 1))
               call check_equal(error, ring(2) - ring(1), n_other(k), name(k) // ", ring")
            end associate
         end do
      end do
   end subroutine test_between

   !> Two wedges side by side make a roof of a given turn: which angles it is a ridge for.
   subroutine test_angles(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      type(surface_t) :: surface
      real(wp), parameter :: turn(4) = [19.0_wp, 20.0_wp, 59.0_wp, 61.0_wp]
      real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
      integer :: k, side

      do k = 1, size(turn)
         do side = -1, 1, 2
            call space_begin(scene)
            call add_box(scene, "C3D8", origin, [2.0_wp, 1.0_wp, 1.0_wp], [2, 1, 1])
            where (abs(scene%x(1, :) - 1.0_wp) < 0.1_wp .and. scene%x(3, :) > 0.5_wp) &
               scene%x(3, :) = 1.0_wp + side*tan(0.5_wp*turn(k)*degree)
            surface = skin(scene)
            surface%element = pack(surface%element, surface%face == 2)
            surface%face = pack(surface%face, surface%face == 2)
            call find(scene, surface, ridge_angle, facets, groups, ridges, error)
            if (allocated(error)) return
            call check_equal(error, size(ridges%facet, 2), &
               merge(1, 0, side > 0 .and. turn(k) > 20.5_wp), "ridge")
            call check_equal(error, groups%n_group, merge(6, 8, turn(k) < 60.0_wp), "groups")
         end do
      end do
   end subroutine test_angles

   !> The upper faces of a box: all sides of the rim are free, and run as their facets do.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(facet_groups_t) :: groups
      type(ridges_t) :: ridges
      type(surface_t) :: surface
      real(wp) :: area
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D4", origin, unit, [2, 3, 1])
      surface = skin(scene)
      associate (on_top => [(all(scene%x(3, top(i)) > 0.9_wp), i = 1, size(surface%face))])
         surface%element = pack(surface%element, on_top)
         surface%face = pack(surface%face, on_top)
      end associate
      call find(scene, surface, ridge_angle, facets, groups, ridges, error)
      if (allocated(error)) return
      call check_equal(error, [size(ridges%facet, 2), size(ridges%free_facet)], [0, 10], "sides")
      area = 0.0_wp
      do i = 1, 10
         associate (from => scene%x(:, facets%node(ridges%free_point(1, i))), &
               to => scene%x(:, facets%node(ridges%free_point(2, i))))
            area = area + 0.5_wp*(from(1)*to(2) - from(2)*to(1))
         end associate
      end do
      call check_true(error, abs(area - 1.0_wp) < 1.0e-3_wp, "around the surface")

   contains

      function top(i) result(node)
         integer, intent(in) :: i
         integer, allocatable :: node(:)

         associate (e => surface%element(i))
            associate (kind => scene%element%kinds(scene%element%kind(e)))
               node = scene%element%node(kind%face(surface%face(i)), e)
            end associate
         end associate
      end function top

   end subroutine test_open

end module test_facet_groups
