!> Which master edges a slave node looks at, and what its gap is made of: against a look at all
!> edges, with several bodies in one surface, at corners, and over joints.
module test_nts_choice
   use check, only : check_equal, check_near, check_true, test_case_t
   use cut_scenes, only : make_cut_blocks, merge_surfaces
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_nts_choice, only : choice_covers
   use emcon_polygon_stencil_plane, only : edge_distance
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, make_block, &
      make_two_blocks, right, scene_begin, shake, top
   implicit none
   private
   public :: collect_nts_choice

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_nts_choice(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("five bodies in one surface: four classes", test_classes), &
         test_case_t("a body alone touches nothing of itself", test_alone), &
         test_case_t("both nodes of a joint", test_twins), &
         test_case_t("corners that bear are part of the gap", test_stencils), &
         test_case_t("corners are rounded by their edges", test_rounding), &
         test_case_t("an edge and its neighbours, or the next but one", test_covers), &
         test_case_t("along its own surface a node leaves its own edges out", test_own_edges)]
   end subroutine collect_nts_choice

   !> Five squares a tenth apart: a node has a constraint for each class of bodies, which looks at
   !> the nearest edge of these but for its own body.
   subroutine test_classes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_body = 5, n_class = 4, n_edge = 8
      type(scene_t) :: scene
      type(block_t) :: block
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: least
      integer :: i, e, n, n_near

      call scene_begin(scene)
      do i = 0, n_body - 1
         call add_block(scene, "CPE4", [2, 2], 2.1_wp*[real(mod(i, 3), wp), real(i/3, wp)], &
            [2.0_wp, 2.0_wp], block)
         call add_surface(scene, "ONE", block, [bottom, right, top, left])
         if (i > 0) call merge_surfaces(scene, "ALL", i + max(0, i - 1), 2*i)
         if (i > 0) scene%surface = [scene%surface(:2*i - 1), scene%surface(2*i:)]
      end do
      n = size(scene%surface)
      call nts_init(nts, scene, contact_pair_t(slave=n, master=n, both_sides=.true.), error)
      if (allocated(error)) return
      call check_equal(error, [nts%rule%n_class, nts%slave%n_facet, nts%n_constraint], [n_class, &
         n_body*n_edge, n_class*n_body*n_edge], "classes, edges, constraints")
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      call shake(u, 0.02_wp)
      du(1, :) = 0.3_wp
      call nts%begin_step(scene%x, u, du)
      call check_equal(error, nts%n_sifted, nts%near%n_list, "sifted once a list")
      n_near = 0
      do i = 1, nts%n_constraint
         call check_equal(error, nts%node(i), nts%slave%node(nts%chain_node(i)), "node")
         call check_equal(error, nts%near%item(1, nts%near_item(i)), nts%node(i), "its candidates")
         least = huge(least)
         do e = 1, nts%master%n_facet
            if (body_of(nts%master%facet(1, e)) == body_of(nts%node(i))) cycle
            if (1 + mod(body_of(nts%master%facet(1, e)) - 1, n_class) /= class_of(i)) cycle
            least = min(least, distance_of(i, e))
         end do
         if (least < nts%reach) then
            n_near = n_near + 1
            call check_true(error, nts%edge(i) > 0, "near: " // to_text(i))
            if (allocated(error)) return
            call check_equal(error, 1 + mod(body_of(nts%master%facet(1, nts%edge(i))) - 1, &
               n_class), class_of(i), "class of constraint " // to_text(i))
            call check_near(error, distance_of(i, nts%edge(i)), least, tol, 1.0_wp, "the nearest")
         else
            call check_equal(error, nts%edge(i), 0, "none of constraint " // to_text(i))
         end if
      end do
      call check_true(error, n_near > 20, "near: " // to_text(n_near))

   contains

      !> Each body has nine nodes.
      pure integer function body_of(node)
         integer, intent(in) :: node

         body_of = 1 + (node - 1)/9
      end function body_of

      pure integer function class_of(i)
         integer, intent(in) :: i

         class_of = 1 + (i - 1)/(n_body*n_edge)
      end function class_of

      pure real(wp) function distance_of(i, e)
         integer, intent(in) :: i, e

         distance_of = edge_distance(scene%x, u, nts%node(i), nts%master%facet(:, e))
      end function distance_of

   end subroutine test_classes

   !> No candidate is left, and from then on it is known that nothing is near.
   subroutine test_alone(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(nts_t) :: nts
      real(wp) :: gap
      logical :: is_over
      integer :: step

      call make_block(scene, "CPE4", [1, 1], block)
      call add_surface(scene, "ALL", block, [bottom, right, top, left])
      call nts_init(nts, scene, contact_pair_t(slave=1, master=1), error)
      if (allocated(error)) return
      do step = 1, 2
         nts%reach = 0.0_wp
         call nts%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         call check_equal(error, size(nts%near%candidates%facet), 0, "candidates")
         call check_equal(error, nts%near%candidates%start, [1, 1, 1, 1, 1], "of each node")
         call check_equal(error, nts%edge, [0, 0, 0, 0], "edges")
         call check_true(error, (nts%clearance > 0.0_wp) .eqv. step > 1, "step " // to_text(step))
      end do
      nts%edge = 1                               ! whatever was chosen before
      call nts_nearest(nts, 1, scene%x, scene%u0, 0.0_wp*scene%x, gap, is_over)
      call check_true(error, nts%edge(1) == 0 .and. .not. is_over, "none of all edges")
   end subroutine test_alone

   !> The second node of a joint comes behind all first ones, with the place and class of its first.
   subroutine test_twins(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(nts_t) :: nts, twins
      integer :: n, first

      call make_cut_blocks(scene, 0.25_wp)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      call nts_init(twins, scene, scene%pair(1), error, has_twins=.true.)
      if (allocated(error)) return
      n = nts%n_constraint
      call check_equal(error, [n, count(nts%duplicate > 0)], [3, 1], "nodes, joints")
      first = maxloc(nts%duplicate, 1)
      call check_equal(error, twins%node, [nts%node, nts%duplicate(first)], "nodes")
      call check_equal(error, twins%chain_node, [nts%chain_node, first], "places")
      call check_equal(error, [twins%class, size(twins%near_item)], [1, 1, 1, 1, 4], "classes")
      call check_equal(error, twins%duplicate, [0, 0, 0, 0], "none has a second one now")
      call twins%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
      call twins%measure(scene%x, scene%u0, 0.0_wp*scene%x)
      call check_near(error, twins%state%gap0, [0.25_wp, 0.25_wp, 0.25_wp, 0.25_wp], tol, 1.0_wp, &
         "gaps")
   end subroutine test_twins

   !> A bottom over the top of a block of one, two or three edges: the neighbours on the top are
   !> part of the gap, its sides are not; nor are they for a curve, which is told what to do at
   !> corners.
   subroutine test_stencils(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      integer :: n, k, own, top_node
      integer, allocatable :: expected(:)

      do n = 1, 3
         call scene_begin(scene)
         call add_block(scene, "CPE4", [n, 1], [0.0_wp, 0.0_wp], [real(n, wp), 1.0_wp], lower)
         call add_block(scene, "CPE4", [4*n, 1], [-0.5_wp*n, 1.125_wp], [2.0_wp*n, 1.0_wp], upper)
         call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
         call add_surface(scene, "UPPER", upper, [bottom])
         call nts_init(nts, scene, contact_pair_t(slave=2, master=1), error)
         if (allocated(error)) return
         call nts%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         do k = 1, n
            ! Over the middle of top edge k: nodes of the top from the left, the edge runs back.
            own = findloc(abs(scene%x(1, nts%node) - (k - 0.5_wp)) < 0.01_wp, .true., 1)
            top_node = n + 1 + k
            expected = [nts%node(own), top_node + 1, top_node]
            if (k < n) expected = [expected, top_node + 2]
            if (k > 1) expected = [expected, top_node - 1]
            associate (stencil => nts%polygon(1, own))
               call check_equal(error, stencil%node(:stencil%n), expected, "nodes " // to_text(n))
               call check_equal(error, [stencil%before, stencil%after], [merge(4, 0, k < n), &
                  merge(size(expected), 0, k > 1)], "neighbours " // to_text(n))
            end associate
            if (allocated(error)) return
         end do
      end do
   end subroutine test_stencils

   !> By the edge; with static steps tops twice as much, in a sharp step not at all.
   subroutine test_rounding(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp) :: top_width
      integer :: k

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      scene%x(1, :) = 0.5_wp*scene%x(1, :)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      do k = 0, 3
         call nts%configure(scene%x, contact_options_t())
         call nts%suit_steps(btest(k, 0))
         nts%step%is_sharp = btest(k, 1)
         call nts%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         top_width = merge(0.0_wp, merge(2.0_wp, 1.0_wp, btest(k, 0)), btest(k, 1))
         call check_near(error, [nts%polygon(1, 2)%rounding], 0.5_wp*nts%rounding*[1.0_wp, &
            top_width, 1.0_wp, top_width], tol*nts%rounding, 1.0_wp, "case " // to_text(k))
      end do
      call nts%configure(scene%x, contact_options_t(smoothing=smoothing_hermite))
      call nts%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
      call check_near(error, nts%smooth%curve%rounding, spread(0.5_wp*nts%rounding, 1, 3), &
         tol*nts%rounding, 1.0_wp, "of a curve")
   end subroutine test_rounding

   !> Random sides and nodes: the stencil of an edge holds as long as none of the edges after its
   !> neighbours is nearer than all three.
   subroutine test_covers(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: far(4)
      integer :: case, e, n_held, k
      logical :: expected

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 1], [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.5_wp], [1.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [top])
      call add_surface(scene, "UPPER", upper, [bottom])
      call nts_init(nts, scene, contact_pair_t(slave=2, master=1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      nts%every_face = .true.
      n_held = 0
      do case = 1, 100
         call shake(u, 0.4_wp)
         call shake(du, 0.4_wp)
         du(1, nts%node(1)) = 5.0_wp*du(1, nts%node(1))
         far = [(edge_distance(scene%x, u + du, nts%node(1), nts%master%facet(:, k)), k = 1, 4)]
         do e = 1, 4
            expected = minval(far(max(1, e - 1):min(4, e + 1))) <= minval([huge(1.0_wp), &
               far(max(1, e - 2):e - 2), far(e + 2:min(4, e + 2))])
            call check_true(error, choice_covers(nts, 1, e, scene%x, u, du) .eqv. expected, &
               "edge " // to_text(e) // " of case " // to_text(case))
            call check_true(error, choice_covers(nts, 1, e, scene%x, u + du) .eqv. expected, &
               "without a motion")
            if (expected) n_held = n_held + 1
         end do
      end do
      call check_true(error, n_held > 100 .and. n_held < 390, "both: " // to_text(n_held))
   end subroutine test_covers

   !> The side of a strip: seen from an edge farther on, what is nearer to the node are its own
   !> edges, which it never touches.
   subroutine test_own_edges(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(nts_t) :: nts
      integer :: own, k, e

      call make_block(scene, "CPE4", [12, 1], block)
      call add_surface(scene, "ALL", block, [bottom, right, top, left])
      call nts_init(nts, scene, contact_pair_t(slave=1, master=1, both_sides=.true.), error)
      if (allocated(error)) return
      nts%every_face = .true.
      own = findloc(nts%node, 4, 1)
      do k = 2, 8
         ! The edge that begins k edges after the node.
         e = findloc(nts%master%facet(1, :), 4 + k, 1)
         call check_true(error, choice_covers(nts, own, e, scene%x, scene%u0) .eqv. k < 4, &
            "edge " // to_text(k))
      end do
   end subroutine test_own_edges

end module test_nts_choice
