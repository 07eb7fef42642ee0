!> Node-to-segment contact of a moving surface: nearest edges, gap states, evaluation, areas.
module test_nts
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_nts_stencil, only : smooth_stencil, smooth_stencil_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_touch_rule_plane, only : touch_rule_may
   use small_scenes, only : add_block, add_surface, block_node, block_t, bottom, left, &
      make_two_blocks, right, scene_begin, shake, top
   implicit none
   private
   public :: collect_nts

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_nts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps of a block over another", test_states), &
         test_case_t("past the end of the surface", test_past_end), &
         test_case_t("nearest edge all along a random walk", test_walk), &
         test_case_t("no candidates while far apart", test_apart), &
         test_case_t("evaluation equals the state", test_evaluate), &
         test_case_t("a stencil holds up to the edge beside", test_covers), &
         test_case_t("areas", test_area), &
         test_case_t("smoothed: values, identity, momenta", test_smooth), &
         test_case_t("smoothed: lost near the centre of curvature", test_lost), &
         test_case_t("smoothed surface ends at its own slave node", test_own_node), &
         test_case_t("a strip in contact with itself", test_self), &
         test_case_t("corners that meet are held by the faces that bear", test_corners), &
         test_case_t("faces stay chosen where gaps are evaluated at the end", test_faces_stay), &
         test_case_t("sharp corners are the polygon, round ones stand out", test_sharp), &
         test_case_t("wide tops where corners face each other", test_wide_tops)]
   end subroutine collect_nts

   !> A gap of 1/4 that closes by 3/8 in the middle of the step.
   subroutine test_states(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      real(wp), allocatable :: du(:, :)
      integer :: i

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.375_wp
      call nts%begin_step(scene%x, scene%u0, du)
      call check_equal(error, nts%node, [11, 12, 13], "slave nodes")
      call check_equal(error, nts%edge, [3, 2, 1], "edges under them, counted from the right")
      do i = 1, 3
         call nts%measure(scene%x, scene%u0, du)
         state = nts%state(i)
         call check_true(error, state%is_near .and. state%is_over .and. state%is_covered, "near")
         call check_near(error, [state%gap0, state%gap1, state%size], [0.25_wp, -0.125_wp, &
            1.0_wp], tol, 1.0_wp, "gap")
      end do
   end subroutine test_states

   !> A square on its twin, a tenth below its top and to a side by little: of the two corners on the
   !> left one at least has the depth, with one side held and with both, and not the way out to the
   !> side. A corner that is in front of the side is no contact of its own.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: depth = 0.1_wp, sideways(3) = [1.0e-12_wp, 0.0_wp, -1.0e-12_wp]
      real(wp), parameter :: rounding = 1.0e-6_wp      ! of corners, per edge
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(contact_pair_t) :: pair
      type(nts_t) :: nts(2)
      real(wp), allocatable :: u(:, :)
      real(wp) :: gap(2)
      integer :: side, k
      logical :: has_both

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
      call add_surface(scene, "UPPER", upper, [bottom, right, top, left])
      allocate(u, source=0.0_wp*scene%x)
      u(2, 5:) = -depth
      do k = 1, 6
         has_both = k > 3
         u(1, 5:) = sideways(1 + mod(k - 1, 3))
         do side = 1, 2
            pair%slave = side
            pair%master = 3 - side
            pair%both_sides = has_both
            call nts_init(nts(side), scene, pair, error)
            if (allocated(error)) return
            call nts(side)%begin_step(scene%x, u, 0.0_wp*u)
            call nts(side)%measure(scene%x, u, 0.0_wp*u)
         end do
         call check_near(error, least_way_out(scene%x + u), depth, tol, 1.0_wp, &
            "the squares as convex sets, case " // to_text(k))
         gap(1) = nts(1)%state(findloc(nts(1)%node, block_node(lower, 0, 1), 1))%gap0
         gap(2) = nts(2)%state(findloc(nts(2)%node, block_node(upper, 0, 0), 1))%gap0
         call check_near(error, minval(gap), -depth, rounding, 1.0_wp, "corner behind, case " &
            // to_text(k))
      end do

   contains

      !> The shortest way by which the second square leaves the first, over directions a degree
      !> apart.
      pure real(wp) function least_way_out(x) result(way)
         real(wp), intent(in) :: x(:, :)         !! (2, 8), four nodes of each
         real(wp) :: direction(2)
         integer :: i

         way = huge(way)
         do i = 0, 359
            direction = [cos(i*acos(-1.0_wp)/180.0_wp), sin(i*acos(-1.0_wp)/180.0_wp)]
            way = min(way, maxval(matmul(direction, x(:, :4))) &
               - minval(matmul(direction, x(:, 5:))))
         end do
      end function least_way_out

   end subroutine test_corners

   !> A square right on its twin goes in by a tenth and aside by as much. Statics evaluate gaps
   !> there with no motion left: the corner, which the side does not bear, is still held by the top.
   subroutine test_faces_stay(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(2) = [-0.1_wp, -0.1_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(contact_pair_t) :: pair
      type(nts_t) :: nts
      type(condition_t) :: item(1)
      real(wp), allocatable :: zero(:, :), u(:, :)
      integer :: i, own

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
      call add_surface(scene, "UPPER", upper, [bottom, right, top, left])
      pair = contact_pair_t(slave=2, master=1, both_sides=.true.)
      call nts_init(nts, scene, pair, error)
      if (allocated(error)) return
      allocate(zero, u, source=0.0_wp*scene%x)
      u(:, 5:) = spread(way, 2, size(u, 2) - 4)
      call nts%begin_step(scene%x, zero, u)
      own = findloc(nts%node, block_node(upper, 0, 0), 1)
      call nts%evaluate([own], scene%x, u, zero, [0.0_wp], item)
      call check_near(error, item(1)%gap1, way(2), tol, 1.0_wp, "gap")
      i = findloc(item(1)%node(:item(1)%n_node), nts%node(own), 1)
      call check_near(error, item(1)%c(:, i), [0.0_wp, 1.0_wp], tol, 1.0_wp, "its gradient")
   end subroutine test_faces_stay

   !> A node beside the bisector of a corner of a right angle, by half of the width over which the
   !> corner is rounded: with `is_sharp` the gap is that over the polygon, else it is smaller, by a
   !> part of that width.
   subroutine test_sharp(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: width = 1.0e-4_wp, up = 0.01_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(condition_t) :: item(1)
      real(wp), allocatable :: u(:, :), zero(:, :)
      real(wp) :: gap(2)
      integer :: k

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [1, 1], [1.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
      call add_surface(scene, "UPPER", upper, [bottom, right, top, left])
      call nts_init(nts, scene, contact_pair_t(slave=2, master=1, both_sides=.true.), error)
      if (allocated(error)) return
      call nts%configure(scene%x, contact_options_t())
      call check_true(error, nts%may_sharpen, "polygons may be sharp")
      call nts%suit_steps(.true.)
      allocate(u, zero, source=0.0_wp*scene%x)
      u(1, 5:) = up - 0.5_wp*width
      u(2, 5:) = up
      do k = 1, 2
         nts%step%is_sharp = k == 1
         call nts%begin_step(scene%x, u, zero)
         call nts%evaluate([findloc(nts%node, block_node(upper, 0, 0), 1)], scene%x, u, zero, &
            [0.0_wp], item)
         gap(k) = item(1)%gap1
      end do
      call check_near(error, gap(1), up, tol, 1.0_wp, "sharp: the distance from the top")
      call check_true(error, gap(2) < gap(1) - min(tol, 0.01_wp*width) .and. &
         gap(2) > gap(1) - 0.26_wp*width, "round: smaller by " // to_text(gap(1) - gap(2)))
   end subroutine test_sharp

   !> Two rhombs corner on corner, blunt as vertices of a curve: the top is round over a quarter of
   !> an edge, by the part of the normals that both corners have. Turned by half of their turn half
   !> of them are left, by all one; the corner of a block that lies flat on another one has one
   !> normal only.
   subroutine test_wide_tops(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp), parameter :: angle(4) = pi*[0.0_wp, 0.25_wp, -0.25_wp, 0.5_wp]/3.0_wp
      !> Squares pressed flat along a diagonal: their corners there turn by 30 degrees.
      real(wp), parameter :: part = tan(pi/12.0_wp), edge = sqrt(0.5_wp*(1.0_wp + part**2))
      real(wp), parameter :: flatten(2, 2) = 0.5_wp*reshape([1.0_wp + part, part - 1.0_wp, &
         part - 1.0_wp, 1.0_wp + part], [2, 2])
      real(wp), parameter :: share(4) = [1.0_wp, 0.5_wp, 0.5_wp, 0.0_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :)
      integer :: k

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [1, 1], [1.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
      call add_surface(scene, "UPPER", upper, [bottom, right, top, left])
      allocate(u, source=0.0_wp*scene%x)
      call begin()
      if (allocated(error)) return
      call check_near(error, top_width(), 0.0_wp, tol, 1.0_wp, "corners of squares")
      scene%x = 1.0_wp + matmul(flatten, scene%x - 1.0_wp)
      call begin()
      if (allocated(error)) return
      do k = 1, size(angle)
         associate (arm => scene%x(:, 5:) - 1.0_wp, c => cos(angle(k)), s => sin(angle(k)))
            u(1, 5:) = (c - 1.0_wp)*arm(1, :) - s*arm(2, :)
            u(2, 5:) = s*arm(1, :) + (c - 1.0_wp)*arm(2, :)
         end associate
         call check_near(error, top_width(), 0.25_wp*share(k)*edge, tol, 1.0_wp, &
            "turned: " // to_text(k))
      end do
      ! Moved to the left by an edge, it lies on the top of the lower one with its side.
      u = 0.0_wp
      u(:, 5:) = spread(-flatten(:, 1), 2, 4)
      call check_near(error, top_width(), 0.0_wp, tol, 1.0_wp, "flat on the other")
      u = 0.0_wp
      call nts%suit_steps(.true.)
      call check_near(error, top_width(), 0.0_wp, tol, 1.0_wp, "in statics")

   contains

      subroutine begin()
         call nts_init(nts, scene, contact_pair_t(slave=2, master=1), error)
         if (allocated(error)) return
         call nts%configure(scene%x, contact_options_t())
         call nts%suit_steps(.false.)
      end subroutine begin

      !> For the first corner of the upper block at the corner of the lower one where it stands.
      real(wp) function top_width()
         integer :: node, side

         node = block_node(upper, 0, 0)
         nts%were_sharp = .not. nts%step%is_sharp     ! stencils are to be chosen anew
         call nts%begin_step(scene%x, u, 0.0_wp*u)
         associate (stencil => nts%polygon(1, findloc(nts%node, node, 1)))
            side = merge(1, 2, norm2(scene%x(:, stencil%node(2)) - scene%x(:, node) - u(:, node)) &
               < 0.5_wp)
            ! Where nothing faces, the top is as narrow as dents are, or twice that.
            top_width = stencil%rounding(2, side)
            if (top_width <= 2.0_wp*stencil%rounding(1, side)) top_width = 0.0_wp
         end associate
      end function top_width

   end subroutine test_wide_tops

   !> Over the side of the lower block no constraint may act; at its corner one may.
   subroutine test_past_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp), parameter :: way(3) = [0.5_wp, 0.874_wp, 0.877_wp]
      integer :: k

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.5_wp
      do k = 1, 3
         u(1, 11:) = way(k)                      ! the right node is at 1.125 + way
         call nts%begin_step(scene%x, u, du)
         call nts%measure(scene%x, u, du)
         state = nts%state(3)
         call check_true(error, state%is_over .eqv. k < 3, "over the surface " // to_text(k))
      end do
      u(1, 11:) = 0.5_wp                         ! flies over the end on its way down
      du(1, 11:) = 1.0_wp
      call nts%begin_step(scene%x, u, du)
      call nts%measure(scene%x, u, du)
      state = nts%state(3)
      call check_true(error, .not. state%is_over, "past the end where the gap closes")
   end subroutine test_past_end

   !> A slave square tumbles over a master square: at each step the edge is the nearest of all
   !> wherever the node could touch in this step. Where nothing is near it is known how far apart
   !> they are at least, and not else.
   subroutine test_walk(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(contact_pair_t) :: pair
      type(nts_t) :: nts, all
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: gap, speed(2, 1), path(2), apart
      logical :: is_over
      integer :: i, step, n_near, n_apart

      call scene_begin(scene)
      call add_block(scene, "CPE4", [8, 8], [0.0_wp, 0.0_wp], [8.0_wp, 8.0_wp], lower)
      call add_block(scene, "CPE3", [5, 5], [9.0_wp, 1.0_wp], [3.0_wp, 3.0_wp], upper)
      call add_surface(scene, "MASTER", lower, [bottom, right, top, left])
      call add_surface(scene, "SLAVE", upper, [bottom, right, top, left])
      pair%slave = 2
      pair%master = 1
      call nts_init(nts, scene, pair, error)
      if (allocated(error)) return
      call nts_init(all, scene, pair, error)
      allocate(u, du, source=0.0_wp*scene%x)
      n_near = 0
      n_apart = 0
      do step = 1, 400
         call shake(du, 0.02_wp)
         call shake(speed, 0.3_wp)
         path = [-5.0_wp, 2.0_wp] + [5.0_wp*sin(0.01_wp*step), 5.0_wp*cos(0.017_wp*step)]
         do i = 82, size(u, 2)
            du(:, i) = du(:, i) + speed(:, 1) + 0.05_wp*(path - u(:, i))
         end do
         call nts%begin_step(scene%x, u, du)
         do i = 1, nts%n_constraint
            call nts_nearest(all, i, scene%x, u, 0.0_wp*u, gap, is_over)
            if (distance(all%node(i), all%master%facet(:, all%edge(i))) > 2.0_wp*length_of(du)) then
               cycle
            end if
            n_near = n_near + 1
            if (nts%edge(i) /= all%edge(i)) call check_near(error, &
               distance(nts%node(i), nts%master%facet(:, max(1, nts%edge(i)))), &
               distance(all%node(i), all%master%facet(:, all%edge(i))), tol, 1.0_wp, &
               "distance of the nearest edge in step " // to_text(step))
         end do
         apart = axis_distance(scene%x + u)
         if (nts%clearance > 0.0_wp) n_apart = n_apart + 1
         call check_true(error, apart >= nts%clearance, "apart at least so far")
         call check_true(error, (nts%clearance > 0.0_wp) .eqv. apart > nts%reach, &
            "what is not near is known to be apart, step " // to_text(step))
         if (allocated(error)) return
         u = u + du
      end do
      call check_true(error, n_apart > 20, "often apart: " // to_text(n_apart))
      call check_true(error, n_near > 1000, "many nodes come near: " // to_text(n_near))

   contains

      !> The least distance along the axes of a slave node from the box around a master edge.
      pure real(wp) function axis_distance(at) result(least)
         real(wp), intent(in) :: at(:, :)        !! (2, n_node) [L]
         integer :: k, e

         least = huge(1.0_wp)
         do k = 1, size(nts%node)
            do e = 1, nts%master%n_facet
               associate (a => at(:, nts%master%facet(1, e)), b => at(:, nts%master%facet(2, e)))
                  least = min(least, max(0.0_wp, maxval(max(min(a, b) - at(:, nts%node(k)), &
                     at(:, nts%node(k)) - max(a, b)))))
               end associate
            end do
         end do
      end function axis_distance

      pure real(wp) function distance(node, edge)
         integer, intent(in) :: node, edge(2)
         real(wp) :: a(2), b(2)

         a = scene%x(:, edge(2)) + u(:, edge(2)) - scene%x(:, edge(1)) - u(:, edge(1))
         b = scene%x(:, node) + u(:, node) - scene%x(:, edge(1)) - u(:, edge(1))
         b = b - max(0.0_wp, min(1.0_wp, dot_product(a, b)/dot_product(a, a)))*a
         distance = sqrt(dot_product(b, b))
      end function distance

   end subroutine test_walk

   pure real(wp) function length_of(field)
      real(wp), intent(in) :: field(:, :)

      length_of = sqrt(maxval(sum(field**2, dim=1)))
   end function length_of

   !> Bodies 50 edges apart: an empty list that stands until half of the way is gone.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: step

      call make_two_blocks(scene, 50.0_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.1_wp
      do step = 1, 450
         call nts%begin_step(scene%x, u, du)
         call check_equal(error, size(nts%near%candidates%facet), 0, "candidates in step " &
            // to_text(step))
         u = u + du
      end do
      call check_true(error, nts%near%n_list <= 5, "few lists: " // to_text(nts%near%n_list))
   end subroutine test_apart

   !> Nodes 1/4 above edges of length 1 slide to a side. The first stands at 1/8 of its edge: after
   !> 15/8 it is over the end of the edge beside; beyond, the edge after next is nearer.
   subroutine test_covers(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(5) = [-0.125_wp, 1.0_wp, 1.75_wp, 2.0_wp, 2.5_wp]
      logical, parameter :: expected(5) = [.true., .true., .true., .false., .false.]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: du(:, :)
      integer :: k

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(du, source=0.0_wp*scene%x)
      call nts%begin_step(scene%x, scene%u0, du)
      do k = 1, size(way)
         du(1, 11:) = way(k)
         call nts%measure(scene%x, scene%u0, du)
         call check_true(error, nts%covers(1, scene%x, scene%u0, du) .eqv. expected(k), &
            "covered after way " // to_text(k))
      end do
      du(1, 11:) = 0.0_wp
      call nts%measure(scene%x, scene%u0, du)
      do k = 1, 3
         call check_true(error, nts%covers(k, scene%x, scene%u0, du), "at rest: " // to_text(k))
      end do
   end subroutine test_covers

   subroutine test_evaluate(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      type(condition_t) :: item(1)
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, k, n

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      do k = 1, 20
         call shake(u, 0.1_wp)
         call shake(du, 0.2_wp)
         call nts%begin_step(scene%x, u, du)
         do i = 1, 3
            call nts%measure(scene%x, u, du)
            state = nts%state(i)
            call nts%evaluate([i], scene%x, u, du, [0.0_wp], item)
            associate (constraint => item(1))
               n = constraint%n_node
               call check_equal(error, constraint%node(1), nts%node(i), "slave node first")
               call check_near(error, [constraint%gap0, constraint%gap1, constraint%size], &
                  [state%gap0, state%gap1, state%size], tol, 1.0_wp, "values")
               call check_near(error, sum(constraint%g(:, :n)*du(:, constraint%node(:n))), &
                  constraint%dgap, tol, 1.0_wp, "identity")
            end associate
         end do
      end do
   end subroutine test_evaluate

   !> Lengths of the slave edges times the thickness: their sum is the area of the surface.
   subroutine test_area(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp) :: area(3), length(3)

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      scene%section(1)%thickness = 0.5_wp
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      call nts%area(scene%x, 2.0_wp*scene%x, area, length)
      call check_near(error, area, [0.75_wp, 1.5_wp, 0.75_wp], tol, 1.0_wp, "areas at scale 3")
      call check_near(error, length, 2.0_wp*area, tol, 1.0_wp, "lengths")
   end subroutine test_area

   !> Both blocks in contact over a smoothed surface, smooth and with corners.
   subroutine make_smooth(scene, nts, angle, error)
      type(scene_t), intent(out) :: scene
      type(nts_t), intent(out) :: nts
      real(wp), intent(in) :: angle              !! of corners [degrees]
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      options%smoothing = smoothing_hermite
      options%smoothing_angle = angle
      call nts%configure(scene%x, options)
   end subroutine make_smooth

   !> What is evaluated is what is measured; the discrete gradient makes up the difference of the
   !> gaps and has neither force nor moment. A place or a normal is known to some 100 roundings.
   subroutine test_smooth(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(nts_t) :: nts
      type(condition_t) :: item(1)
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: middle(2), moment
      integer :: i, j, k, n, most

      most = 0
      do k = 1, 60
         call make_smooth(scene, nts, 60.0_wp, error)
         if (allocated(error)) return
         if (mod(k, 3) == 0) nts%is_corner([2, 4]) = .true.
         nts%rounding = merge(1.0e-2_wp, 0.0_wp, mod(k, 2) == 0)
         allocate(u, du, source=0.0_wp*scene%x)
         call shake(u, 0.1_wp)
         call shake(du, 0.2_wp)
         call nts%begin_step(scene%x, u, du)
         call nts%measure(scene%x, u, du)
         do i = 1, 3
            call nts%evaluate([i], scene%x, u, du, [0.125_wp], item)
            associate (constraint => item(1), state => nts%state(i))
               n = constraint%n_node
               most = max(most, n)
               call check_equal(error, constraint%node(1), nts%node(i), "slave node first")
               call check_near(error, [constraint%gap0, constraint%gap1, constraint%size], &
                  [state%gap0 - 0.125_wp, state%gap1 - 0.125_wp, state%size], 16.0_wp*tol, 1.0_wp, &
                  "values")
               call check_near(error, sum(constraint%g(:, :n)*du(:, constraint%node(:n))), &
                  constraint%dgap, 16.0_wp*tol, 1.0_wp, "identity")
               call check_near(error, constraint%dgap, constraint%gap1 - constraint%gap0, &
                  16.0_wp*tol, 1.0_wp, "difference of the gaps")
               call check_near(error, sum(constraint%g(:, :n), dim=2), [0.0_wp, 0.0_wp], &
                  16.0_wp*tol, 1.0_wp, "force")
               moment = 0.0_wp
               do j = 1, n
                  middle = scene%x(:, constraint%node(j)) + u(:, constraint%node(j)) &
                     + 0.5_wp*du(:, constraint%node(j))
                  moment = moment + middle(1)*constraint%g(2, j) - middle(2)*constraint%g(1, j)
               end do
               call check_near(error, moment, 0.0_wp, 16.0_wp*tol, 2.0_wp, "moment")
            end associate
         end do
         if (allocated(error)) return
         deallocate(u, du)
      end do
      call check_equal(error, most, 6, "nodes of the largest stencil: four edges")
      call check_true(error, .not. any(nts%is_lost), "no closest point was lost")
   end subroutine test_smooth

   !> In the middle of a circular dent each point of the surface is equally close: the polygon takes
   !> over in what is measured and evaluated, and the stencil does not hold.
   subroutine test_lost(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(nts_t) :: nts, polygon
      type(condition_t) :: item(1)
      real(wp), allocatable :: u(:, :), zero(:, :)
      real(wp), parameter :: radius = 5.0_wp
      real(wp) :: angle, middle(2), below(2)     ! the edge from 0 to 1 is below
      integer :: i

      call make_smooth(scene, nts, 60.0_wp, error)
      if (allocated(error)) return
      call nts_init(polygon, scene, scene%pair(1), error)
      allocate(u, zero, source=0.0_wp*scene%x)
      do i = 6, 10
         angle = scene%x(1, i)/radius
         u(:, i) = radius*[sin(angle), 1.0_wp - cos(angle)] - scene%x(:, i)
      end do
      middle = [0.0_wp, radius]
      below = radius*[sin(0.5_wp/radius), -cos(0.5_wp/radius)]
      u(:, 12) = middle + 0.05_wp*below - scene%x(:, 12)
      nts%reach = 0.0_wp
      zero(2, 12) = 4.0_wp                       ! so far what is near has to reach
      call nts%begin_step(scene%x, u, zero)
      call polygon%begin_step(scene%x, u, zero)
      zero = 0.0_wp
      call nts%measure(scene%x, u, zero)
      call polygon%measure(scene%x, u, zero)
      call nts%evaluate([2], scene%x, u, zero, [0.0_wp], item)
      call check_true(error, nts%state(2)%is_near, "still measured")
      call check_true(error, .not. nts%state(2)%is_covered, "stencil does not hold")
      call check_near(error, [nts%state(2)%gap0, nts%state(2)%gap1], polygon%state(2)%gap0 &
         *[1.0_wp, 1.0_wp], 0.0_wp, 1.0_wp, "gap of the polygon")
      call check_near(error, item(1)%gap1, polygon%state(2)%gap1, tol, radius, "evaluated")
      u(:, 12) = middle + 0.5_wp*below - scene%x(:, 12)
      call nts%begin_step(scene%x, u, zero)
      call nts%measure(scene%x, u, zero)
      call check_true(error, .not. nts%state(2)%is_covered, "it was lost on the way")
      call nts%measure(scene%x, u, zero)
      call check_true(error, nts%state(2)%is_covered, "told once")
      call nts%evaluate([2], scene%x, u, zero, [0.0_wp], item)
      call nts%measure(scene%x, u, zero)
      call check_true(error, nts%state(2)%is_covered, "found nearer to the surface")
   end subroutine test_lost

   !> The third edge of a closed surface, with the slave node at the beginning of the first one.
   subroutine test_own_node(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(contact_pair_t) :: pair
      type(nts_t) :: nts
      type(smooth_stencil_t) :: stencil
      logical :: is_corner(8)

      call scene_begin(scene)
      call add_block(scene, "CPE4", [3, 1], [0.0_wp, 0.0_wp], [3.0_wp, 1.0_wp], block)
      call add_surface(scene, "ALL", block, [bottom, right, top, left])
      pair%slave = 1
      pair%master = 1
      call nts_init(nts, scene, pair, error)
      if (allocated(error)) return
      is_corner = .false.
      call smooth_stencil(stencil, nts%master, is_corner, 1, 3, scene%x, scene%u0)
      call check_equal(error, stencil%node(:stencil%n), [1, 3, 4, 2, 8, 7], "nodes")
      call check_equal(error, stencil%curve%node, [0, 4, 2, 3, 5, 6], "nodes along the surface")
   end subroutine test_own_node

   !> A strip bent into a U, its top inside. The surface runs along the outside from the left to the
   !> right end and back inside: nodes of the right leg are slaves of edges of the left one.
   subroutine test_self(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(contact_pair_t) :: pair
      type(nts_t) :: nts, all
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp), parameter :: leg = 4.0_wp, radius = 1.5_wp, thickness = 0.5_wp
      real(wp), parameter :: pi = acos(-1.0_wp)
      integer, parameter :: n = 24
      real(wp) :: gap, s
      logical :: is_over
      integer :: i, k, side, node

      call scene_begin(scene)
      call add_block(scene, "CPE4", [n, 1], [0.0_wp, 0.0_wp], &
         [2.0_wp*leg + pi*radius, thickness], block)
      call add_surface(scene, "ALL", block, [bottom, right, top, left])
      pair%slave = 1
      pair%master = 1
      call nts_init(nts, scene, pair, error)
      if (allocated(error)) return
      call nts_init(all, scene, pair, error)
      allocate(u, du, source=0.0_wp*scene%x)
      do k = 1, size(u, 2)
         u(:, k) = bent(scene%x(:, k)) - scene%x(:, k)
      end do
      du(1, :) = 1.6_wp                          ! the search reaches from leg to leg
      call nts%begin_step(scene%x, u, du)
      associate (near => nts%near%candidates)
         call check_true(error, size(near%facet) > 0, "candidates")
         do i = 1, nts%n_constraint
            do k = near%start(i), near%start(i + 1) - 1
               call check_true(error, touch_rule_may(nts%rule, nts%slave, nts%chain_node(i), &
                  near%facet(k)), "nothing that is never touched, node " // to_text(nts%node(i)))
            end do
         end do
      end associate
      do side = 0, 1
         do i = 1, n - 1
            node = block_node(block, i, side)
            k = findloc(nts%node, node, 1)
            s = scene%x(1, node)
            call nts_nearest(all, k, scene%x, u, 0.0_wp*u, gap, is_over)
            call check_equal(error, nts%edge(k), all%edge(k), "edge among the candidates")
            if (side == 1 .and. s > leg + pi*radius + 1.0_wp) then
               call check_near(error, gap, 2.0_wp*(radius - thickness), tol, 10.0_wp, &
                  "distance of the legs at node " // to_text(node))
               call check_true(error, is_over, "over the other leg")
            else if (side == 0 .or. s < leg) then
               call check_equal(error, all%edge(k), 0, "no edge for node " // to_text(node))
            end if
         end do
      end do

   contains

      !> Down the left leg, around the bottom, up the right leg.
      pure function bent(x) result(y)
         real(wp), intent(in) :: x(2)
         real(wp) :: y(2), angle

         angle = max(0.0_wp, min(pi, (x(1) - leg)/radius))
         y = (radius - x(2))*[-cos(angle), -sin(angle)]
         if (x(1) < leg) y(2) = leg - x(1)
         if (x(1) > leg + pi*radius) y(2) = x(1) - leg - pi*radius
      end function bent

   end subroutine test_self

end module test_nts
