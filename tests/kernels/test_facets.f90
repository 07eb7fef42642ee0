!> Facets of surfaces: closed ones of bodies in space and in the plane, and lists of what is near.
module test_facets
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_element_kind, only : find_element_kind
   use emcon_errors, only : err_input, error_t
   use emcon_facets, only : facets_init, facets_normal, facets_t, facets_text
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_scene, only : scene_t
   use emcon_search, only : box_distance, search_boxes
   use random_draws, only : draw_random
   use small_scenes, only : add_surface, block_t, bottom, left, make_block, right, shake, top
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_facets

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over some dozen facets, each of a few roundings.
   real(wp), parameter :: tol = 256.0_wp*eps
   !> A box of so many cells, and its edges.
   integer, parameter :: n_cell(3) = [2, 3, 1]
   real(wp), parameter :: extent(3) = [2.0_wp, 1.5_wp, 0.7_wp]

contains

   subroutine collect_facets(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("closed surfaces in space", test_closed), &
         test_case_t("faces with nodes between corners", test_between), &
         test_case_t("two bodies, hexahedra and tetrahedra", test_two_bodies), &
         test_case_t("an open surface", test_open), &
         test_case_t("a face that two elements share", test_shared), &
         test_case_t("a closed surface in the plane", test_plane), &
         test_case_t("what is near in space, by all pairs", test_near)]
   end subroutine collect_facets

   !> Each side is shared by two facets that name each other, V - E + F = 2 for each part, and each
   !> node knows its facets.
   subroutine check_closed(error, facets, n_part, what)
      type(error_t), allocatable, intent(inout) :: error
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: n_part
      character(len=*), intent(in) :: what
      integer :: f, k, n, n_side

      n_side = 0
      do f = 1, facets%n_facet
         n = count(facets%facet(:, f) > 0)
         n_side = n_side + n
         call check_true(error, all(facets%neighbour(:n, f) > 0), what // ", closed")
         call check_true(error, all(facets%neighbour(n + 1:, f) == 0), what // ", no more sides")
         if (allocated(error)) return
         do k = 1, n
            associate (beyond => facets%neighbour(k, f), node => facets%corner(k, f))
               call check_true(error, any(facets%neighbour(:, beyond) == f), what // ", mutual")
               call check_equal(error, facets%node(node), facets%facet(k, f), what // ", node")
               call check_equal(error, count(facets%around(facets%around_start(node): &
                  facets%around_start(node + 1) - 1) == f), 1, what // ", facets of nodes")
            end associate
         end do
      end do
      call check_equal(error, size(facets%around), n_side, what // ", nothing else around nodes")
      call check_equal(error, size(facets%node) - n_side/2 + facets%n_facet, 2*n_part, &
         what // ", Euler characteristic")
      call check_equal(error, maxval(facets%part), n_part, what // ", parts")
   end subroutine check_closed

   !> Normals point outwards: what they enclose is the volume, and they sum up to 0.
   subroutine check_normals(error, facets, x, u, volume, area, what)
      type(error_t), allocatable, intent(inout) :: error
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :), u(:, :)
      real(wp), intent(in) :: volume, area       !! expected at x + u, and at x
      character(len=*), intent(in) :: what
      real(wp) :: total(size(x, 1)), enclosed, normal(size(x, 1))
      integer :: f

      total = 0.0_wp
      enclosed = 0.0_wp
      do f = 1, facets%n_facet
         normal = facets_normal(facets, f, x, u)
         total = total + normal
         ! A flat facet: any of its points will do.
         associate (node => facets%facet(1, f))
            enclosed = enclosed + dot_product(normal, x(:, node) + u(:, node))/real(size(x, 1), wp)
         end associate
      end do
      call check_near(error, total, 0.0_wp*total, tol, area, what // ", sum of normals")
      call check_near(error, enclosed, volume, tol, volume, what // ", enclosed")
      call check_near(error, sum(facets%size), area, tol, area, what // ", size")
   end subroutine check_normals

   pure real(wp) function box_area()
      box_area = 2.0_wp*(extent(1)*extent(2) + extent(2)*extent(3) + extent(3)*extent(1))
   end function box_area

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: u(:, :)
      !> A motion that is homogeneous keeps faces flat: its gradient, whose determinant is 1.
      real(wp), parameter :: shear(3, 3) = reshape([1.0_wp, 0.3_wp, 0.0_wp, &
         0.0_wp, 1.0_wp, 0.2_wp, &
         0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      character(len=4), parameter :: name(2) = ["C3D8", "C3D4"]
      integer :: k

      do k = 1, 2
         call space_begin(scene)
         call add_box(scene, name(k), [0.1_wp, -0.4_wp, 0.3_wp], extent, n_cell)
         call facets_init(facets, scene, skin(scene), error)
         if (allocated(error)) return
         call check_equal(error, facets%n_facet, k*2*(6 + 3 + 2), name(k) // ", facets")
         call check_closed(error, facets, 1, name(k))
         allocate(u, source=matmul(shear, scene%x) - scene%x + 0.5_wp)
         call check_normals(error, facets, scene%x, u, product(extent), box_area(), name(k))
         deallocate(u)
      end do
   end subroutine test_closed

   !> One element of each kind by the natural coordinates of its nodes: sides are half as long.
   subroutine test_between(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: u(:, :)
      character(len=5), parameter :: name(2) = ["C3D20", "C3D10"]
      real(wp), parameter :: volume(2) = [8.0_wp, 1.0_wp/6.0_wp]
      real(wp), parameter :: area(2) = [24.0_wp, 1.5_wp + 0.5_wp*sqrt(3.0_wp)]
      integer :: k, i, row

      do k = 1, 2
         call space_begin(scene)
         row = find_element_kind(scene%element%kinds, name(k))
         call scene%element%kinds(row)%shape%places(scene%x)
         scene%element%node = reshape([(i, i = 1, size(scene%x, 2))], [size(scene%x, 2), 1])
         scene%element%kind = [row]
         scene%node%label = scene%element%node(:, 1)
         call facets_init(facets, scene, skin(scene), error)
         if (allocated(error)) return
         call check_closed(error, facets, 1, name(k))
         allocate(u, source=0.0_wp*scene%x)
         call check_normals(error, facets, scene%x, u, volume(k), area(k), name(k))
         deallocate(u)
      end do
   end subroutine test_between

   !> Facets of three nodes beside others of four; each knows its element and its face.
   subroutine test_two_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(surface_t) :: surface
      type(facets_t) :: facets
      character(len=:), allocatable :: text
      real(wp), allocatable :: u(:, :)
      integer :: f, k

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, 0.0_wp], extent, n_cell)
      call add_box(scene, "C3D4", [0.0_wp, 0.0_wp, 2.0_wp], extent, n_cell)
      surface = skin(scene)
      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call check_closed(error, facets, 2, "bodies")
      allocate(u, source=0.0_wp*scene%x)
      call check_normals(error, facets, scene%x, u, 2.0_wp*product(extent), &
         2.0_wp*box_area(), "bodies")
      do f = 1, facets%n_facet
         associate (kind => scene%element%kinds(scene%element%kind(facets%element(f))))
            associate (face => scene%element%node(kind%face(facets%face(f)), facets%element(f)))
               do k = 1, kind%n_face_node
                  call check_true(error, any(face == facets%facet(k, f)), "of its element")
               end do
            end associate
         end associate
      end do
      call facets_text(facets, scene, 1, text)
      call check_true(error, text == "face S1 of element 1 (nodes 1, 4, 5, 2)", text)
   end subroutine test_two_bodies

   !> The upper faces alone: sides of the rim have nothing beyond.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(surface_t) :: surface
      type(facets_t) :: facets

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, 0.0_wp], extent, n_cell)
      surface = skin(scene)
      surface%element = pack(surface%element, surface%face == 2)
      surface%face = pack(surface%face, surface%face == 2)
      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call check_equal(error, count(facets%neighbour == 0), 2*sum(n_cell(:2)), "rim")
      call check_equal(error, maxval(facets%part), 1, "one part")
      call check_near(error, facets%size, 0.0_wp*facets%size + &
         product(extent(:2)/n_cell(:2)), tol, &
         1.0_wp, "sizes")
      call check_near(error, facets_normal(facets, 1, scene%x, 0.0_wp*scene%x), &
         [0.0_wp, 0.0_wp, facets%size(1)], tol, 1.0_wp, "upwards")
   end subroutine test_open

   !> A face inside a body, from both sides, branches off the skin.
   subroutine test_shared(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(surface_t) :: surface
      type(facets_t) :: facets

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, 0.0_wp], extent, n_cell)
      surface = skin(scene)
      surface%element = [surface%element, 1]
      surface%face = [surface%face, 4]
      call facets_init(facets, scene, surface, raised)
      call check_error(error, raised, err_input, "surface SKIN branches at node ", "branch")
   end subroutine test_shared

   subroutine test_plane(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(facets_t) :: facets

      call make_block(scene, "CPE3", [3, 2], block)
      call add_surface(scene, "ALL", block, [left, top, bottom, right])
      call facets_init(facets, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, [facets%n_facet, size(facets%node), minval(facets%neighbour)], &
         [10, 10, 1], "closed")
      call check_normals(error, facets, scene%x, 0.0_wp*scene%x, 6.0_wp, 10.0_wp, "plane")
   end subroutine test_plane

   !> Facets of three and of four nodes and points about them, which move at random: lists hold all
   !> that is near in a step, and the nearest facet of each point.
   subroutine test_near(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(near_list_t) :: list
      real(wp), allocatable :: x(:, :), u(:, :), du(:, :), point(:, :, :), box(:, :, :)
      real(wp) :: within
      integer, parameter :: n_point = 20
      integer :: before, step, i

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, 0.0_wp], extent, n_cell)
      call add_box(scene, "C3D4", [1.0_wp, 1.0_wp, 1.0_wp], extent, n_cell)
      call facets_init(facets, scene, skin(scene), error)
      if (allocated(error)) return
      before = size(scene%x, 2)
      allocate(x(3, before + n_point), u(3, before + n_point), du(3, before + n_point))
      call draw_random(x)
      x = 6.0_wp*x - 1.5_wp
      x(:, :before) = scene%x
      u = 0.0_wp
      call near_list_init(list, reshape([(before + i, i = 1, n_point)], [1, n_point]), &
         facets%facet, x, u, 0.05_wp)
      do step = 1, 20
         call shake(du, merge(0.3_wp, 0.02_wp, mod(step, 7) == 0))
         within = 0.0_wp
         call near_list_update(list, x, u, du, within)
         call search_boxes(x, u, list%item, point)
         call search_boxes(x, u, list%facet, box)
         do i = 1, n_point
            call check_item(error, i)
            if (allocated(error)) return
         end do
         u = u + du
      end do
      call check_true(error, list%n_list > 1 .and. list%n_list < step - 1, "lists are kept")

   contains

      !> Item `i` against all facets.
      subroutine check_item(error, i)
         type(error_t), allocatable, intent(inout) :: error
         integer, intent(in) :: i
         real(wp) :: distance(facets%n_facet)
         integer :: f

         distance = [(box_distance(point(:, i, 1), point(:, i, 2), box(:, f, 1), box(:, f, 2)), &
            f = 1, facets%n_facet)]
         associate (near => list%candidates)
            associate (listed => near%facet(near%start(i):near%start(i + 1) - 1))
               do f = 1, facets%n_facet
                  call check_true(error, near_list_within(list, i, f, within) .eqv. &
                     distance(f) <= within, "near")
                  if (distance(f) <= within) call check_true(error, any(listed == f), "listed")
               end do
               if (minval(distance) <= within) call check_near(error, minval(distance(listed)), &
                  minval(distance), 0.0_wp, 1.0_wp, "the nearest")
            end associate
         end associate
      end subroutine check_item

   end subroutine test_near

end module test_facets
