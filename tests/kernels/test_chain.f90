!> Contact surfaces as chains of edges.
module test_chain
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_corners, chain_crossing, chain_distance, chain_init, &
      chain_t, chain_tributary
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_element_registry, only : find_element_row
   use emcon_errors, only : err_input, error_t
   use emcon_facets, only : facets_rim
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts, &
      formulation_segment
   use emcon_kinds, only : dp, wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, make_block, right, &
      scene_begin, top
   implicit none
   private
   public :: collect_chain

   real(wp), parameter :: pi = acos(-1.0_wp)
   real(wp), parameter :: tol = 8.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_chain(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("top of a block", test_open), &
         test_case_t("faces in any order", test_order), &
         test_case_t("closed chain", test_closed), &
         test_case_t("two bodies in one surface", test_two_bodies), &
         test_case_t("surface of nodes", test_nodal), &
         test_case_t("branching surface", test_branch), &
         test_case_t("nodes in space", test_in_space), &
         test_case_t("tributary lengths", test_tributary), &
         test_case_t("parts, places and distances", test_parts), &
         test_case_t("corners of a block", test_corners_right), &
         test_case_t("corners of any turn", test_corners_any), &
         test_case_t("crossing between nodes", test_crossing), &
         test_case_t("crossing at nodes", test_crossing_nodes), &
         test_case_t("crossing of random chains", test_crossing_random), &
         test_case_t("touching is not crossing", test_touching), &
         test_case_t("touching with rounded coordinates", test_touching_rounded), &
         test_case_t("crossing of a long chain", test_crossing_long)]
   end subroutine collect_chain

   !> A chain of nodes with three coordinates is refused, not written past its ends.
   subroutine test_in_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      class(contact_t), allocatable :: contact
      integer, parameter :: formulation(*) = [formulation_nts, formulation_segment, &
         formulation_mortar]
      integer :: k

      call make_block(scene, "CPE4", [3, 1], block)
      call add_surface(scene, "TOP", block, [top])
      call add_surface(scene, "BOTTOM", block, [bottom])
      scene%x = reshape([scene%x, scene%x(:1, :)], [3, size(scene%x, 2)])
      call chain_init(chain, scene, scene%surface(1), raised)
      call check_error(error, raised, err_input, "surface TOP: chains of edges are of the plane", &
         "chain")
      do k = 1, size(formulation)
         call new_contact(scene, contact_pair_t(slave=1, master=2, formulation=formulation(k)), &
            contact, raised)
         call check_error(error, raised, err_input, "3 coordinates", "formulation " // to_text(k))
      end do
   end subroutine test_in_space

   !> Edges run with the body to the left: from right to left on top, triangles as quadrilaterals.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      character(len=4), parameter :: name(2) = ["CPE3", "CPE4"]
      logical :: is_rim(4)
      integer :: k

      do k = 1, 2
         call make_block(scene, name(k), [3, 1], block)
         call add_surface(scene, "TOP", block, [top])
         call chain_init(chain, scene, scene%surface(1), error)
         if (allocated(error)) return
         call check_equal(error, reshape(chain%facet, [6]), [8, 7, 7, 6, 6, 5], name(k) // " edges")
         call check_equal(error, chain%neighbour(1, :), [0, 1, 2], "previous")
         call check_equal(error, chain%neighbour(2, :), [2, 3, 0], "next")
         call check_equal(error, chain%node, [5, 6, 7, 8], "nodes")
         if (allocated(error)) return
         is_rim = .true.
         call facets_rim(chain, is_rim)
         call check_true(error, all(is_rim .eqv. [.true., .false., .false., .true.]), "rim")
      end do
   end subroutine test_open

   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain

      call make_block(scene, "CPE4", [3, 1], block)
      call add_surface(scene, "TOP", block, [top])
      scene%surface(1)%element = scene%surface(1)%element([2, 1, 3])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%neighbour(1, :), [2, 0, 1], "previous")
      call check_equal(error, chain%neighbour(2, :), [3, 1, 0], "next")
   end subroutine test_order

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: area
      integer :: i

      call make_block(scene, "CPE3", [3, 2], block)
      call add_surface(scene, "ALL", block, [left, top, bottom, right])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%n_facet, 10, "edges")
      call check_equal(error, chain%neighbour(2, chain%neighbour(1, :)), [(i, i = 1, 10)], &
         "next of the previous")
      area = 0.0_wp
      do i = 1, 10
         area = area + 0.5_wp*(scene%x(1, chain%facet(1, i))*scene%x(2, chain%facet(2, i)) &
            - scene%x(2, chain%facet(1, i))*scene%x(1, chain%facet(2, i)))
      end do
      call check_near(error, area, 6.0_wp, tol, 6.0_wp, "enclosed area, counter-clockwise")
   end subroutine test_closed

   subroutine test_two_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: one, other
      type(chain_t) :: chain

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], one)
      call add_block(scene, "CPE4", [1, 1], [1.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], other)
      call add_surface(scene, "ONE", one, [top])
      call add_surface(scene, "OTHER", other, [top])
      scene%surface(1)%element = [scene%surface(1)%element, scene%surface(2)%element]
      scene%surface(1)%face = [scene%surface(1)%face, scene%surface(2)%face]
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%neighbour(1, :), [0, 0], "edges at the same place, other nodes")
      call check_equal(error, chain%node, [3, 4, 7, 8], "nodes")
   end subroutine test_two_bodies

   subroutine test_nodal(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(surface_t) :: surface
      type(chain_t) :: chain
      real(wp) :: length(3)

      call make_block(scene, "CPE4", [3, 1], block)
      surface%name = "NODES"
      surface%is_nodal = .true.
      surface%node = [4, 2, 4, 1]
      call chain_init(chain, scene, surface, error)
      if (allocated(error)) return
      call check_equal(error, chain%node, [1, 2, 4], "nodes")
      call check_equal(error, chain%n_facet, 0, "edges")
      call chain_tributary(chain, scene%x, scene%u0, length)
      call check_near(error, length, [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "lengths")
   end subroutine test_nodal

   !> Two cells one above the other with all their sides: two edges begin at the shared corners.
   subroutine test_branch(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain

      call make_block(scene, "CPE4", [2, 1], block)
      call add_surface(scene, "FORK", block, [bottom])
      scene%surface(1)%element = [1, 1, 2]
      scene%surface(1)%face = [1, 2, 1]          ! bottom and right side of 1, bottom of 2
      call chain_init(chain, scene, scene%surface(1), raised)
      call check_error(error, raised, err_input, "FORK", "branching surface")
      call check_true(error, index(raised%message, "node 2") > 0, "the node is named")
   end subroutine test_branch

   !> Half of the edges beside a node, deformed.
   subroutine test_tributary(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: length(4), u(2, 8)

      call make_block(scene, "CPE4", [3, 1], block)
      call add_surface(scene, "TOP", block, [top])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      u = 1.0e3_wp
      u(2, 8) = u(2, 8) + 0.75_wp                ! the last edge has the length 1.25
      call chain_tributary(chain, scene%x, u, length)
      call check_near(error, length, [0.5_wp, 1.0_wp, 1.125_wp, 0.625_wp], tol, 1.0_wp, "lengths")
   end subroutine test_tributary

   !> A chain of the edges `edge` between the points `x`: each edge a side of a triangle.
   subroutine make_chain(x, edge, scene, chain, error)
      real(wp), intent(in) :: x(:, :)            !! (2, n_node)
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      type(scene_t), intent(out) :: scene
      type(chain_t), intent(out) :: chain
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: surface
      integer :: i, n

      n = size(edge, 2)
      call scene_begin(scene)
      scene%x = x
      scene%u0 = 0.0_wp*x
      deallocate(scene%element%node)
      allocate(scene%element%node(3, n), source=0)
      scene%element%node(:2, :) = edge
      scene%element%kind = [(find_element_row("CPE3"), i = 1, n)]
      scene%node%label = [(i, i = 1, size(x, 2))]
      surface%name = "CHAIN"
      surface%element = [(i, i = 1, n)]
      surface%face = [(1, i = 1, n)]
      call chain_init(chain, scene, surface, error)
   end subroutine make_chain

   !> The edges from each of the nodes first..last to the one after it, and back to the first.
   pure function edges_along(first, last, is_closed) result(edge)
      integer, intent(in) :: first, last
      logical, intent(in) :: is_closed
      integer, allocatable :: edge(:, :)
      integer :: i

      allocate(edge(2, last - first + merge(1, 0, is_closed)))
      do i = 1, size(edge, 2)
         edge(:, i) = [first + i - 1, first + mod(i, last - first + 1)]
      end do
   end function edges_along

   !> A closed part, one of three edges and one of one edge, in a shuffled list.
   subroutine test_parts(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: x(2, 10)
      integer :: i
      integer, parameter :: edge(2, 8) = &
         reshape([7, 8, 2, 3, 9, 10, 5, 6, 1, 2, 8, 5, 3, 4, 6, 7], [2, 8])

      do i = 1, 10
         x(:, i) = [3.0_wp*real(i, wp), 2.0_wp*real(i*i, wp)]
      end do
      call make_chain(x, edge, scene, chain, error)
      if (allocated(error)) return
      call check_equal(error, chain%part, [1, 2, 3, 1, 2, 1, 2, 1], "parts")
      call check_equal(error, chain%place, [1, 6, 8, 3, 5, 2, 7, 4], "places")
      call check_equal(error, chain%start, [1, 5, 8, 9], "starts")
      call check_equal(error, size(chain%is_closed), 3, "number of parts")
      call check_true(error, all(chain%is_closed .eqv. [.true., .false., .false.]), "closed")
      call check_equal(error, reshape(chain%node_edge, [20]), &
         [0, 5, 5, 2, 2, 7, 7, 0, 6, 4, 4, 8, 8, 1, 1, 6, 0, 3, 3, 0], "edges of the nodes")
      call check_equal(error, [(chain_distance(chain, 1, i), i = 1, 8)], &
         [0, huge(1), huge(1), 2, huge(1), 1, huge(1), 1], "distance, closed part")
      call check_equal(error, [(chain_distance(chain, i, 7), i = 1, 8)], &
         [huge(1), 1, huge(1), huge(1), 2, huge(1), 0, huge(1)], "distance, open part")
      call check_near(error, chain%size([3, 6]), [sqrt(1453.0_wp), sqrt(6165.0_wp)], tol, &
         100.0_wp, "lengths")
   end subroutine test_parts

   !> Turns of 90 and 0 degrees, also where the block is turned and far away.
   subroutine test_corners_right(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp), allocatable :: x(:, :)
      real(wp) :: phi
      logical :: is_corner(10)
      logical, parameter :: expected(10) = [.true., .false., .false., .true., .false., .true., &
         .false., .true., .false., .false.]
      integer :: k

      call make_block(scene, "CPE4", [3, 2], block)
      call add_surface(scene, "ALL", block, [bottom, right, left, top])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      allocate(x(2, size(scene%x, 2)))
      do k = 0, 20
         phi = 0.3_wp*real(k, wp)
         x(1, :) = 100.0_wp + cos(phi)*scene%x(1, :) - sin(phi)*scene%x(2, :)
         x(2, :) = sin(phi)*scene%x(1, :) + cos(phi)*scene%x(2, :)
         call chain_corners(chain, x, 89.0_wp, is_corner)
         call check_true(error, all(is_corner .eqv. expected), "corners, angle 89, turn " &
            // to_text(k))
         call chain_corners(chain, x, 90.0_wp, is_corner)
         call check_true(error, .not. any(is_corner), "no corners, angle 90, turn " // to_text(k))
         call chain_corners(chain, x, 0.0_wp, is_corner)
         call check_true(error, all(is_corner .eqv. expected), "straight sides, turn " &
            // to_text(k))
      end do
   end subroutine test_corners_right

   !> Known turns to both sides, the angle just above, at and below each.
   subroutine test_corners_any(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp), parameter :: turn(9) = [5.0_wp, -10.0_wp, 30.0_wp, -60.0_wp, 90.0_wp, -120.0_wp, &
         150.0_wp, -175.0_wp, 0.0_wp]            ! the last one after the end
      real(wp) :: x(2, 10), phi
      logical :: is_corner(9)
      integer :: i, k

      phi = 0.2_wp
      x(:, 1) = 0.0_wp
      do i = 1, 9
         x(:, i + 1) = x(:, i) + real(i, wp)*[cos(phi), sin(phi)]
         phi = phi + pi/180.0_wp*turn(i)
      end do
      do k = -20, 20, 20
         call make_chain(scale(x, k), edges_along(1, 10, .false.), scene, chain, error)
         if (allocated(error)) return
         do i = 1, 8
            call chain_corners(chain, scene%x, abs(turn(i)), is_corner)
            call check_equal(error, count(is_corner), 9 - i, "angle of turn " // to_text(i))
            call chain_corners(chain, scene%x, abs(turn(i)) - 0.01_wp, is_corner)
            call check_equal(error, count(is_corner), 10 - i, "angle below turn " // to_text(i))
            call check_true(error, is_corner(1) .and. all(is_corner(i + 1:)), "which corners")
         end do
         call chain_corners(chain, scene%x, 180.0_wp, is_corner)
         call check_true(error, is_corner(1) .and. .not. any(is_corner(2:)), "angle 180")
      end do
   end subroutine test_corners_any

   !> The chain of `x` crosses itself first in the two edges of `expected`, in either direction, on
   !> any scale, mirrored or displaced; 0, 0: nowhere.
   subroutine check_crossing(error, x, edge, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: edge(:, :), expected(2)
      character(len=*), intent(in) :: what
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: y(2, size(x, 2))
      integer :: k, pair(2)

      do k = 1, 4
         y = x
         if (k == 2) y(1, :) = -x(2, :) - 3.0_wp
         if (k == 2) y(2, :) = x(1, :) + 5.0_wp
         if (k == 3) y = scale(x, -20)
         if (k == 4) then
            call make_chain(y, edge([2, 1], :), scene, chain, failed)
         else
            call make_chain(y, edge, scene, chain, failed)
         end if
         if (allocated(failed)) then
            call move_alloc(failed, error)
            return
         end if
         call chain_crossing(chain, y, 0.0_wp*y, pair(1), pair(2))
         call check_equal(error, pair, expected, what // ", variant " // to_text(k))
         call chain_crossing(chain, 0.0_wp*y, y, pair(1), pair(2))
         call check_equal(error, pair, expected, what // ", displaced, variant " // to_text(k))
      end do
   end subroutine check_crossing

   subroutine test_crossing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: z = 0.0_wp, one = 1.0_wp, two = 2.0_wp, three = 3.0_wp, four = 4.0_wp
      real(wp) :: x(2, 4)

      x = reshape([z, z, four, three, four, z, z, two], [2, 4])
      call check_crossing(error, x, edges_along(1, 4, .false.), [1, 3], "bow")
      call check_crossing(error, x, edges_along(1, 4, .true.), [1, 3], "closed bow")
      call check_crossing(error, x, reshape([3, 4, 1, 2], [2, 2]), [1, 2], "two parts")
      x(:, 2) = [one, 0.5_wp]
      call check_crossing(error, x, edges_along(1, 4, .true.), [0, 0], "quadrilateral")
      ! An edge of one thousandth across one of 4: what touches is measured against the short one.
      x = reshape([z, z, four, z, two, -0.5e-3_wp, two, 0.5e-3_wp], [2, 4])
      call check_crossing(error, x, reshape([1, 2, 3, 4], [2, 2]), [1, 2], "short across long")
   end subroutine test_crossing

   !> The chain passes through itself where nodes lie on edges or on nodes.
   subroutine test_crossing_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: z = 0.0_wp, one = 1.0_wp, two = 2.0_wp, four = 4.0_wp
      real(wp) :: x(2, 6)
      integer :: edge(2, 4), k

      edge = reshape([1, 2, 2, 3, 4, 5, 5, 6], [2, 4])
      x = reshape([z, z, two, two, four, four, z, four, two, two, four, z], [2, 6])
      call check_crossing_any(error, x, edge, "node on node")
      x(:, 3) = [four, z]
      x(:, 6) = [four, four]
      call check_crossing(error, x, edge, [0, 0], "node at node, not passing")
      x = reshape([z, z, two, z, four, z, two, -two, two, z, z, two], [2, 6])
      call check_crossing_any(error, x, edge, "corner through a straight line")
      x(:, 2) = [two + one, z]
      call check_crossing_any(error, x, edge, "node on edge")
      do k = 2, 50
         x(2, 5) = scale(one, -k)
         call check_crossing_any(error, x, edge, "node beside edge, " // to_text(k))
         x(2, 5) = -x(2, 5)
         call check_crossing_any(error, x, edge, "node before edge, " // to_text(k))
      end do
   end subroutine test_crossing_nodes

   !> The two parts of two edges cross; which edges are named is left open.
   subroutine check_crossing_any(error, x, edge, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: edge(:, :)
      character(len=*), intent(in) :: what
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(chain_t) :: chain
      integer :: k, pair(2)

      do k = 1, 4                                ! each part forwards and backwards
         associate (one => edge(:, :2), two => edge(:, 3:))
            select case (k)
            case (1)
               call make_chain(x, edge, scene, chain, failed)
            case (2)
               call make_chain(x, reshape([one([2, 1], :), two], [2, 4]), scene, chain, failed)
            case (3)
               call make_chain(x, reshape([one, two([2, 1], :)], [2, 4]), scene, chain, failed)
            case default
               call make_chain(x, edge([2, 1], [3, 4, 1, 2]), scene, chain, failed)
            end select
         end associate
         if (allocated(failed)) then
            call move_alloc(failed, error)
            return
         end if
         call chain_crossing(chain, x, 0.0_wp*x, pair(1), pair(2))
         call check_true(error, pair(1) >= 1 .and. pair(1) <= 2 .and. pair(2) >= 3, &
            what // " is found, variant " // to_text(k))
      end do
   end subroutine check_crossing_any

   !> Against all pairs: what is found crosses, and no pair before it clearly does.
   subroutine test_crossing_random(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 40
      !> Fraction of an edge at its ends where it is left open whether it touches or crosses.
      real(wp), parameter :: margin = 0.01_wp
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: x(2, n), key(n - 1)
      integer :: edge(2, n - 1), case, i, j, pair(2)

      do case = 1, 40
         call draw_random(x)
         do i = 2, n                             ! steps of a fifth: few crossings to many
            x(:, i) = x(:, i - 1) + 0.2_wp*(x(:, i) - 0.4_wp)
         end do
         call draw_random(key)
         edge = edges_along(1, n, .false.)
         edge = edge(:, sort_order(real(key, dp)))
         call make_chain(x, edge, scene, chain, error)
         if (allocated(error)) return
         call chain_crossing(chain, x, 0.0_wp*x, pair(1), pair(2))
         if (pair(1) > 0) then
            call check_true(error, crosses(pair(1), pair(2), -margin), "the pair found crosses")
         else
            pair(1) = n
         end if
         do i = 1, n - 1
            do j = i + 1, n - 1
               if (any(chain%neighbour(2, [i, j]) == [j, i])) cycle
               if (i > pair(1) .or. (i == pair(1) .and. j >= pair(2))) cycle
               call check_true(error, .not. crosses(i, j, margin), "no pair crosses before, case " &
                  // to_text(case))
            end do
         end do
         if (allocated(error)) return
      end do

   contains

      !> Do edges `i` and `j` meet, each at least `inside` of its length from its ends?
      logical function crosses(i, j, inside)
         integer, intent(in) :: i, j
         real(wp), intent(in) :: inside
         real(wp) :: a(2), b(2), c(2), det, s, t

         a = x(:, edge(2, i)) - x(:, edge(1, i))
         b = x(:, edge(2, j)) - x(:, edge(1, j))
         c = x(:, edge(1, j)) - x(:, edge(1, i))
         det = a(1)*b(2) - a(2)*b(1)
         s = c(1)*b(2) - c(2)*b(1)
         t = c(1)*a(2) - c(2)*a(1)
         if (det < 0.0_wp) then
            det = -det
            s = -s
            t = -t
         end if
         crosses = min(s, t) >= inside*det .and. max(s, t) <= (1.0_wp - inside)*det
         ! At a small angle, too, touching and crossing are close.
         if (inside > 0.0_wp) crosses = crosses .and. det > margin*norm2(a)*norm2(b)
      end function crosses

   end subroutine test_crossing_random

   !> Coincident nodes, nodes on edges, edges on edges, and a tip between two edges.
   subroutine test_touching(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: z = 0.0_wp, one = 1.0_wp, two = 2.0_wp, half = 0.5_wp
      real(wp) :: x(2, 8)
      integer :: edge(2, 8)

      edge(:, :4) = edges_along(1, 4, .true.)
      edge(:, 5:) = edges_along(5, 8, .true.)
      x(:, :4) = reshape([z, z, one, z, one, one, z, one], [2, 4])
      x(:, 5:) = x(:, :4)
      x(1, 5:) = x(1, :4) + one
      call check_crossing(error, x, edge, [0, 0], "two squares, nodes on nodes")
      x(2, 5:) = x(2, 5:) + one
      call check_crossing(error, x, edge, [0, 0], "two squares, corner on corner")
      x(2, 5:) = x(2, 5:) - half
      call check_crossing(error, x, edge, [0, 0], "two squares, halves of edges")
      x(:, 5:) = reshape([one, half, two, z, two, half, two, one], [2, 4])
      call check_crossing(error, x, edge, [0, 0], "corner on edge")
      x(:, 5:) = reshape([half, half, one, half, one, one, half, one], [2, 4])
      call check_crossing(error, x, edge, [0, 0], "square inside, edges on edges")
      x(:, 5:) = reshape([half, half, two, half, two, two, half, two], [2, 4])
      call check_crossing(error, x, edge, [2, 5], "overlapping squares")
   end subroutine test_touching

   !> Two blocks along a slanting line with other divisions, coordinates rounded to six digits.
   subroutine test_touching_rounded(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 7, m = 10
      real(wp), parameter :: digit = 1.0e6_wp
      real(wp) :: x(2, n + m + 2), slope
      integer :: edge(2, n + m), i, k

      edge(:, :n) = edges_along(1, n + 1, .false.)
      edge(:, n + 1:) = edges_along(n + 2, n + m + 2, .false.)
      do k = 1, 20
         slope = 0.37_wp*real(k, wp) - 4.0_wp
         do i = 0, n
            x(:, i + 1) = [one_of(i, n), slope*one_of(i, n)]
         end do
         do i = 0, m
            x(:, n + 2 + i) = [one_of(m - i, m), slope*one_of(m - i, m)]
         end do
         x = anint(digit*x)/digit
         call check_crossing(error, x, edge, [0, 0], "slope " // to_text(k))
      end do

   contains

      pure real(wp) function one_of(part, whole)
         integer, intent(in) :: part, whole

         one_of = real(part, wp)/real(whole, wp)
      end function one_of

   end subroutine test_touching_rounded

   !> A spiral does not cross itself; with its last edge across the turns, it does.
   subroutine test_crossing_long(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20000, per_turn = 400
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp), allocatable :: x(:, :), u(:, :)
      real(wp) :: phi
      integer :: i, first, second

      allocate(x(2, n), u(2, n))
      do i = 1, n
         phi = 2.0_wp*pi*real(i, wp)/real(per_turn, wp)
         x(:, i) = (per_turn + i)*[cos(phi), sin(phi)]
      end do
      u = 0.0_wp
      call make_chain(x, edges_along(1, n, .false.), scene, chain, error)
      if (allocated(error)) return
      call chain_crossing(chain, x, u, first, second)
      call check_equal(error, [first, second], [0, 0], "spiral")
      u(:, n) = -x(:, n)                         ! into the centre, where nothing is
      call chain_crossing(chain, x, u, first, second)
      call check_equal(error, second, n - 1, "the last edge crosses")
      call check_true(error, first > 0 .and. first <= per_turn, "the innermost turn first")
   end subroutine test_crossing_long

end module test_chain
