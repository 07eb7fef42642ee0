!> Contact surfaces over tied pieces: joints, and contact as if the surface were in one piece.
module test_joints
   use check, only : check_equal, check_near, check_true, test_case_t
   use cut_scenes, only : add_tie, make_cut_blocks, make_cut_strip, merge_surfaces, same_node
   use emcon_chain_plane, only : chain_corners, chain_crossing, chain_distance, chain_init, &
      chain_is_seam, chain_t, chain_touches, chain_tributary
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      formulation_segment, integration_elements, integration_segments, multiplier_dual, &
      multiplier_standard, normal_edge, normal_nodal, smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_mortar, only : mortar_init, mortar_t
   use emcon_mortar_frame, only : moment_cover
   use emcon_scene, only : scene_t
   use emcon_seams_plane, only : chain_join
   use emcon_text, only : notes_t, to_text
   use emcon_ties, only : ties_prepare
   use small_scenes, only : add_block, add_surface, bend_scene, block_t, bottom, left, &
      make_two_blocks, right, scene_begin, shake, top
   implicit none
   private
   public :: collect_joints

   real(wp), parameter :: pi = acos(-1.0_wp)
   !> Sums over a few pairs, each of some 500 roundings.
   real(wp), parameter :: tol = 2048.0_wp*epsilon(1.0_wp)
   !> NTS on a polygon and smoothed, segment, mortar with all combinations of its options.
   integer, parameter :: n_variant = 20

contains

   subroutine collect_joints(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("open surface over two pieces", test_open), &
         test_case_t("closed surface over four pieces", test_closed), &
         test_case_t("the node that stands for both", test_kept), &
         test_case_t("how far the nodes may be apart", test_tolerance), &
         test_case_t("two continuations", test_two_ways), &
         test_case_t("contact as in one piece", test_as_whole), &
         test_case_t("self-contact as in one piece", test_self), &
         test_case_t("self-contact of both sides as in one piece", test_self_both), &
         test_case_t("nodes a little apart", test_apart), &
         test_case_t("forces of a uniform pressure", test_pressure), &
         test_case_t("identity and momenta, nodes apart", test_momenta), &
         test_case_t("gradient and second derivatives, nodes apart", test_derivatives), &
         test_case_t("no second derivatives, the same bits", test_first)]
   end subroutine collect_joints

   ! ---- chains ---------------------------------------------------------------------------------

   !> Tops of two blocks of 2 and 1 cells, the left one tied to the right one.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      logical :: is_corner(3)
      real(wp) :: length(4)
      integer :: i

      call make_pieces(scene)
      call add_tie(scene, 4, 5)
      call chain_init(chain, scene, scene%surface(3), error)
      if (allocated(error)) return
      call check_equal(error, chain%node, [4, 5, 6, 9, 10], "nodes before")
      call chain_join(chain, scene)
      call check_equal(error, reshape(chain%facet, [6]), [6, 5, 5, 4, 10, 9], "edges")
      call check_equal(error, chain%neighbour(1, :), [3, 1, 0], "previous")
      call check_equal(error, chain%neighbour(2, :), [2, 0, 1], "next")
      call check_equal(error, chain%node, [4, 5, 9, 10], "nodes")
      call check_equal(error, chain%duplicate, [0, 0, 6, 0], "twins")
      call check_equal(error, reshape(chain%corner, [6]), [3, 2, 2, 1, 4, 3], "ends")
      call check_equal(error, reshape(chain%node_edge, [8]), [2, 0, 1, 2, 3, 1, 0, 3], &
         "edges of the nodes")
      call check_equal(error, [chain%part, chain%place], [1, 1, 1, 2, 3, 1], "part and places")
      call check_equal(error, chain%around_start, [1, 2, 4, 6, 7], "lists of nodes")
      call check_equal(error, chain%around, [2, 1, 2, 1, 3, 3], "edges around nodes")
      call check_equal(error, chain_distance(chain, 3, 2), 2, "distance")
      call check_true(error, .not. any(chain%is_closed), "open")
      call check_true(error, chain_is_seam(chain, 1, 3) .and. chain_is_seam(chain, 3, 1) .and. &
         .not. chain_is_seam(chain, 1, 2), "where the joint is")
      call check_true(error, all([(chain_touches(chain, 1, i), i = 5, 10)] .eqv. &
         [.true., .true., .false., .false., .true., .false.]), "nodes of an edge")
      call chain_corners(chain, scene%x, 60.0_wp, is_corner)
      call check_true(error, all(is_corner .eqv. [.false., .false., .true.]), "corners")
      call chain_tributary(chain, scene%x, scene%u0, length)
      call check_near(error, length, [0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp], tol, 1.0_wp, "lengths")
   end subroutine test_open

   !> Two blocks side by side; surfaces: both tops and their union, right and left side of the cut.
   subroutine make_pieces(scene)
      type(scene_t), intent(out) :: scene
      type(block_t) :: one, other

      call scene_begin(scene)
      call add_block(scene, "CPE4", [2, 1], [0.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], one)
      call add_block(scene, "CPE4", [1, 1], [2.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], other)
      call add_surface(scene, "ONE", one, [top])
      call add_surface(scene, "OTHER", other, [top])
      call merge_surfaces(scene, "BOTH", 1, 2)
      call add_surface(scene, "ONE_CUT", one, [right])
      call add_surface(scene, "OTHER_CUT", other, [left])
   end subroutine make_pieces

   !> The chain of surface 3 of `scene` with its joints.
   subroutine joined_chain(scene, chain, error)
      type(scene_t), intent(in) :: scene
      type(chain_t), intent(out) :: chain
      type(error_t), allocatable, intent(out) :: error

      call chain_init(chain, scene, scene%surface(3), error)
      if (.not. allocated(error)) call chain_join(chain, scene)
   end subroutine joined_chain

   !> The outline of a square of four squares, each tied to the next one around the middle: it does
   !> not cross itself, and does where a piece of it is turned over.
   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: u(2, 16)
      !> By square: the sides outside, in their order, and the sides at the next and last square.
      integer, parameter :: outside(2, 4) = reshape([left, bottom, bottom, right, right, top, top, &
         left], [2, 4])
      integer, parameter :: after(4) = [right, top, left, bottom], &
         before(4) = [top, left, bottom, right]
      real(wp), parameter :: low(2, 4) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, &
         0.0_wp, 1.0_wp], [2, 4])
      integer :: k, first, second

      call scene_begin(scene)
      do k = 1, 4
         call add_block(scene, "CPE4", [1, 1], low(:, k), [1.0_wp, 1.0_wp], block)
         call add_surface(scene, "OUTSIDE", block, outside(:, k))
         call add_surface(scene, "AFTER", block, [after(k)])
         call add_surface(scene, "BEFORE", block, [before(k)])
      end do
      do k = 1, 4
         call add_tie(scene, 3*k - 1, 3*mod(k, 4) + 3)
      end do
      call merge_surfaces(scene, "THREE", 1, 4)
      call merge_surfaces(scene, "THREE", 13, 7)
      call merge_surfaces(scene, "ALL", 14, 10)
      call chain_init(chain, scene, scene%surface(15), error)
      if (allocated(error)) return
      call check_equal(error, size(chain%is_closed), 4, "parts before")
      call chain_join(chain, scene)
      call check_equal(error, chain%neighbour(2, :), [2, 3, 4, 5, 6, 7, 8, 1], "next")
      call check_equal(error, chain%neighbour(1, :), [8, 1, 2, 3, 4, 5, 6, 7], "previous")
      call check_equal(error, chain%place, [(k, k = 1, 8)], "places")
      call check_true(error, size(chain%is_closed) == 1 .and. all(chain%is_closed), "closed")
      call check_equal(error, [size(chain%node), count(chain%duplicate > 0)], [8, 4], &
         "nodes, joints")
      call check_equal(error, chain_distance(chain, 1, 8), 1, "distance")
      u = 0.0_wp
      call chain_crossing(chain, scene%x, u, first, second)
      call check_equal(error, [first, second], [0, 0], "no crossing")
      u(:, 9:12) = -1.75_wp
      call chain_crossing(chain, scene%x, u, first, second)
      call check_true(error, first > 0, "crossing")
   end subroutine test_closed

   !> The master node, and of two slave nodes of ties the lower one.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      integer :: k
      !> Ties as slave and master surface, and what is left at the joint of nodes 6 and 9.
      integer, parameter :: slave(3) = [4, 5, 5], kept(3) = [9, 6, 6]

      do k = 1, 3
         call make_pieces(scene)
         call add_tie(scene, slave(k), 9 - slave(k))
         if (k == 3) call add_tie(scene, 1, 2)   ! of no use here, but node 6 is slave as well
         call joined_chain(scene, chain, error)
         if (allocated(error)) return
         call check_equal(error, count(chain%duplicate > 0), 1, "one joint, case " // to_text(k))
         call check_equal(error, [pack(chain%node, chain%duplicate > 0), maxval(chain%duplicate)], &
            [kept(k), 15 - kept(k)], "node and twin, case " // to_text(k))
      end do
   end subroutine test_kept

   subroutine test_tolerance(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tolerance(5) = [-1.0_wp, 0.0_wp, 0.05_wp, 0.3_wp, 10.0_wp], &
         limit(5) = [0.1_wp, 0.0_wp, 0.05_wp, 0.3_wp, 0.5_wp], small = 1.0e-6_wp
      type(scene_t) :: scene
      type(chain_t) :: chain
      integer :: k, side

      call make_pieces(scene)
      call joined_chain(scene, chain, error)
      if (allocated(error)) return
      call check_true(error, .not. any(chain%duplicate > 0), "no tie, no joint")
      call add_tie(scene, 4, 5)
      do k = 1, 5
         do side = -1, 1, 2
            scene%x(1, 9) = 2.0_wp + max(0.0_wp, limit(k) + side*small)
            scene%tie(1)%tolerance = tolerance(k)
            call joined_chain(scene, chain, error)
            if (allocated(error)) return
            call check_true(error, any(chain%duplicate > 0) .eqv. side < 0, "joint, case " &
               // to_text(k))
         end do
      end do
   end subroutine test_tolerance

   !> A third block at the place of the second one, also tied to the first: the surface branches.
   subroutine test_two_ways(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: third
      type(chain_t) :: chain

      call make_pieces(scene)
      call add_block(scene, "CPE4", [1, 1], [2.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], third)
      call add_surface(scene, "THIRD", third, [top])
      call add_surface(scene, "THIRD_CUT", third, [left])
      call merge_surfaces(scene, "ALL", 3, 6)
      scene%surface(3) = scene%surface(8)
      call add_tie(scene, 4, 5)
      call joined_chain(scene, chain, error)
      if (allocated(error)) return
      call check_equal(error, count(chain%duplicate > 0), 1, "one continuation")
      call add_tie(scene, 7, 4)
      call joined_chain(scene, chain, error)
      if (allocated(error)) return
      call check_equal(error, count(chain%duplicate > 0), 0, "two continuations")
      call check_equal(error, size(chain%node), 7, "nodes")
   end subroutine test_two_ways

   ! ---- contact --------------------------------------------------------------------------------

   pure subroutine variant(i, formulation, options)
      integer, intent(in) :: i                   !! 1 to n_variant
      integer, intent(out) :: formulation
      type(contact_options_t), intent(out) :: options

      options%integration = merge(integration_segments, integration_elements, btest(i, 0))
      options%multiplier = merge(multiplier_standard, multiplier_dual, btest(i, 1))
      options%normal = merge(normal_edge, normal_nodal, btest(i, 2))
      options%smoothing = merge(smoothing_none, smoothing_hermite, btest(i, 3))
      formulation = formulation_mortar
      if (i <= 16) return
      options%smoothing = merge(smoothing_none, smoothing_hermite, btest(i, 0))
      formulation = merge(formulation_nts, formulation_segment, i <= 18)
   end subroutine variant

   !> The contact `i` of the first pair of `scene`.
   subroutine make_contact(scene, i, contact, error)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options

      call variant(i, scene%pair(1)%formulation, options)
      call new_contact(scene, scene%pair(1), contact, error)
      if (allocated(error)) return
      contact%rounding = 1.0e-3_wp
      call contact%configure(scene%x, options)
   end subroutine make_contact

   !> All constraints of both scenes over one step, those of `cut` as seen on the nodes of `whole`.
   subroutine compare(cut, whole, i, u, du, scale, what, n_near, error)
      type(scene_t), intent(inout) :: cut, whole
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: u(:, :), du(:, :)      !! of `whole`
      real(wp), intent(in) :: scale              !! of coordinates [L]
      character(len=*), intent(in) :: what
      integer, intent(inout) :: n_near
      type(error_t), allocatable, intent(inout) :: error
      class(contact_t), allocatable :: contact, expected
      type(condition_t), allocatable :: item(:), expected_item(:)
      real(wp), allocatable :: v(:, :), dv(:, :), target(:)
      integer, allocatable :: wanted(:)
      integer :: node(size(cut%x, 2)), j, k

      node = same_node(cut, whole)
      v = u(:, node)
      dv = du(:, node)
      call make_contact(whole, i, expected, error)
      if (allocated(error)) return
      call make_contact(cut, i, contact, error)
      if (allocated(error)) return
      call expected%begin_step(whole%x, u, du)
      call expected%measure(whole%x, u, du)
      call contact%begin_step(cut%x, v, dv)
      call contact%measure(cut%x, v, dv)
      call check_equal(error, contact%n_constraint, expected%n_constraint, "constraints" // what)
      if (allocated(error)) return
      wanted = pack([(j, j = 1, contact%n_constraint)], contact%state%is_near)
      n_near = n_near + size(wanted)
      allocate(target(size(wanted)), source=0.02_wp)
      allocate(item(size(wanted)), expected_item(size(wanted)))
      call contact%evaluate(wanted, cut%x, v, dv, target, item)
      do k = 1, size(wanted)
         j = findloc(expected%node, node(contact%node(wanted(k))), 1)
         call expected%evaluate([j], whole%x, u, du, target(k:k), expected_item(k:k))
         associate (a => contact%state(wanted(k)), b => expected%state(j))
            call check_true(error, (a%is_near .eqv. b%is_near) .and. (a%is_over .eqv. b%is_over) &
               .and. (a%is_covered .eqv. b%is_covered), "flags" // what)
            call check_near(error, [a%gap0, a%gap1, a%size], [b%gap0, b%gap1, b%size], tol, scale, &
               "gaps" // what)
         end associate
         call check_same(item(k), expected_item(k), node, size(whole%x, 2), scale, what, error)
         if (allocated(error)) return
      end do
   end subroutine compare

   !> `item` with its nodes replaced by `node` is `expected`.
   subroutine check_same(item, expected, node, n, scale, what, error)
      type(condition_t), intent(in) :: item, expected
      integer, intent(in) :: node(:), n
      real(wp), intent(in) :: scale
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: g(2*n, 2), c(2*n, 2), h(2*n, 2*n, 2)
      integer :: side_node(n), i

      call spread_out(item, node, g(:, 1), c(:, 1), h(:, :, 1))
      side_node = [(i, i = 1, n)]
      call spread_out(expected, side_node, g(:, 2), c(:, 2), h(:, :, 2))
      call check_near(error, [item%gap0, item%gap1, item%dgap], [expected%gap0, expected%gap1, &
         expected%dgap], tol, scale*(1.0_wp + maxval(abs(g))), "values" // what)
      call check_near(error, g(:, 1), g(:, 2), tol, scale*(1.0_wp + maxval(abs(g))), &
         "g" // what)
      call check_near(error, c(:, 1), c(:, 2), tol, scale*(1.0_wp + maxval(abs(c))), &
         "c" // what)
      call check_near(error, reshape(h(:, :, 1), [4*n*n]), reshape(h(:, :, 2), [4*n*n]), tol, &
         scale*(1.0_wp + maxval(abs(h))), "h" // what)
   end subroutine check_same

   pure subroutine spread_out(item, node, g, c, h)
      type(condition_t), intent(in) :: item
      integer, intent(in) :: node(:)
      real(wp), intent(out) :: g(:), c(:), h(:, :)
      integer :: i, j, a, b

      g = 0.0_wp
      c = 0.0_wp
      h = 0.0_wp
      do j = 1, item%n_node
         associate (q => 2*node(item%node(j)) - 2)
            g(q + 1:q + 2) = g(q + 1:q + 2) + item%g(:, j)
            c(q + 1:q + 2) = c(q + 1:q + 2) + item%c(:, j)
            do i = 1, item%n_node
               associate (p => 2*node(item%node(i)) - 2)
                  do b = 1, 2
                     do a = 1, 2
                        h(p + a, q + b) = h(p + a, q + b) + item%h(2*i - 2 + a, 2*j - 2 + b)
                     end do
                  end do
               end associate
            end do
         end associate
      end do
   end subroutine spread_out

   !> Random steps of bent blocks that slide: joints on both sides, anywhere over each other.
   subroutine test_as_whole(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: cut, whole
      type(block_t) :: lower, upper
      real(wp) :: u(2, 16), du(2, 16)
      integer :: i, k, n_near

      n_near = 0
      do i = 1, n_variant
         do k = 1, 6
            call make_cut_blocks(cut, 0.05_wp)
            call make_two_blocks(whole, 0.05_wp, lower, upper)
            call bend_scene(cut, 0.2_wp)
            call bend_scene(whole, 0.2_wp)
            call shake(u, 0.08_wp)
            call shake(du, 0.1_wp)
            u(1, 11:) = u(1, 11:) - 1.2_wp + 0.4_wp*k
            call compare(cut, whole, i, u, du, 1.0_wp, ", variant " // to_text(i) // ", place " &
               // to_text(k), n_near, error)
            if (allocated(error)) return
         end do
      end do
      call check_true(error, n_near > 2*6*n_variant, "most are near: " // to_text(n_near))
   end subroutine test_as_whole

   subroutine test_self(error)
      type(error_t), allocatable, intent(out) :: error

      call compare_strips(.false., [1, n_variant], 0.65_wp, error)
   end subroutine test_self

   !> Node to segment: a node looks at nothing across the cut that it would not see in one piece.
   subroutine test_self_both(error)
      type(error_t), allocatable, intent(out) :: error

      call compare_strips(.true., [17, 18], 0.6_wp, error)
   end subroutine test_self_both

   !> A strip bent into a U, its top inside; cut in one leg, in the bend or in the other leg.
   subroutine compare_strips(both_sides, variants, radius, error)
      logical, intent(in) :: both_sides
      integer, intent(in) :: variants(2)         !! the first and the last
      real(wp), intent(in) :: radius             !! of the bend, of the top [L]
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: leg = 4.0_wp, thickness = 0.5_wp
      integer, parameter :: n = 24, n_first(3) = [4, 12, 20]
      type(scene_t) :: cut, whole
      type(notes_t) :: notes
      real(wp) :: u(2, 2*n + 2), du(2, 2*n + 2)
      integer :: i, k, j, n_near

      n_near = 0
      call make_cut_strip(whole, n, n, [2.0_wp*leg + pi*radius, thickness])
      whole%pair%both_sides = both_sides
      do k = 1, size(n_first)
         call make_cut_strip(cut, n, n_first(k), [2.0_wp*leg + pi*radius, thickness])
         cut%pair%both_sides = both_sides
         call ties_prepare(cut, notes, error)
         if (allocated(error)) return
         do i = variants(1), variants(2)
            call shake(u, 0.01_wp)
            call shake(du, 0.02_wp)
            do j = 1, size(u, 2)
               u(:, j) = u(:, j) + bent(whole%x(:, j)) - whole%x(:, j)
            end do
            call compare(cut, whole, i, u, du, 10.0_wp, ", variant " // to_text(i) // ", cut " &
               // to_text(k), n_near, error)
            if (allocated(error)) return
         end do
      end do
      call check_true(error, n_near > 3*6*(1 + variants(2) - variants(1)), "a leg is near: " &
         // to_text(n_near))

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

   end subroutine compare_strips

   !> Flat surfaces; the nodes of the master's joint at x = 0 are apart along it, overlapping or
   !> with a crack between. The slave edge over it from -7/8 to 1/8 meets both sides and, but for
   !> the crack, nothing is lost: one of three Gauss points is at x = 0.012.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: move(4) = [0.03_wp, -0.03_wp, 0.09_wp, -0.09_wp]
      integer, parameter :: right_node = 10
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(contact_options_t) :: options
      real(wp) :: u(2, 20), cover
      integer :: i, k, formulation

      do i = 1, 16
         do k = 1, size(move)
            call variant(i, formulation, options)
            call make_cut_blocks(scene, 0.25_wp)
            call mortar_init(mortar, scene, scene%pair(1), error)
            if (allocated(error)) return
            call mortar%configure(scene%x, options)
            u = 0.0_wp
            u(1, right_node) = move(k)
            call mortar%begin_step(scene%x, u, 0.0_wp*u)
            call mortar%measure(scene%x, u, 0.0_wp*u)
            call check_true(error, all(mortar%state%is_over), "over, variant " // to_text(i))
            call check_near(error, mortar%state%gap1, 0.25_wp*[1.0_wp, 1.0_wp, 1.0_wp], tol, &
               1.0_wp, "gap, variant " // to_text(i))
            cover = 1.0_wp
            if (options%integration == integration_segments) cover = 1.0_wp - move(k)
            call check_near(error, mortar%form(1)%value(moment_cover, 1), cover, tol, 1.0_wp, &
               "cover, variant " // to_text(i) // ", place " // to_text(k))
            if (allocated(error)) return
         end do
      end do
   end subroutine test_apart

   !> Flat surfaces that touch, all multipliers those of the pressure 1: each edge gives the half of
   !> its length to its own two nodes, the master nodes have the integrals of their hat functions
   !> from -7/8 to 9/8.
   subroutine test_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(contact_options_t) :: options
      type(condition_t) :: item(3)
      real(wp) :: u(2, 20), force(2, 20), expected(2, 20)
      integer :: i, k, j, formulation

      expected = 0.0_wp
      expected(2, [13, 14, 17, 18]) = 0.5_wp
      expected(2, [5, 6]) = -0.5_wp*[0.875_wp**2, 1.0_wp - 0.125_wp**2]
      expected(2, [10, 11]) = -[0.5_wp, 0.5_wp + 0.125_wp - 0.5_wp*0.125_wp**2]
      expected(2, 12) = -0.5_wp*0.125_wp**2
      u = 0.0_wp
      do i = 1, 16
         call variant(i, formulation, options)
         if (options%integration == integration_elements) cycle
         if (options%smoothing == smoothing_hermite) cycle
         call make_cut_blocks(scene, 0.0_wp)
         call mortar_init(mortar, scene, scene%pair(1), error)
         if (allocated(error)) return
         call mortar%configure(scene%x, options)
         call mortar%begin_step(scene%x, u, u)
         call mortar%measure(scene%x, u, u)
         call mortar%evaluate([1, 2, 3], scene%x, u, u, 0.0_wp*[1, 2, 3], item)
         force = 0.0_wp
         do k = 1, 3
            do j = 1, item(k)%n_node
               associate (node => item(k)%node(j))
                  force(:, node) = force(:, node) + mortar%scale(k)*item(k)%g(:, j)
               end associate
            end do
         end do
         call check_near(error, reshape(force, [40]), reshape(expected, [40]), tol, 1.0_wp, &
            "forces, variant " // to_text(i))
      end do
   end subroutine test_pressure

   !> Random steps in which the nodes of joints go their own ways.
   subroutine draw_apart(i, shift, scene, contact, u, du, error)
      integer, intent(in) :: i
      real(wp), intent(in) :: shift              !! of the upper block along x
      type(scene_t), intent(out) :: scene
      class(contact_t), allocatable, intent(out) :: contact
      real(wp), intent(out) :: u(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error

      call make_cut_blocks(scene, 0.05_wp)
      call bend_scene(scene, 0.2_wp)
      call make_contact(scene, i, contact, error)
      if (allocated(error)) return
      call shake(u, 0.03_wp)
      call shake(du, 0.03_wp)
      u(1, 13:) = u(1, 13:) + shift
      call contact%begin_step(scene%x, u, du)
      call contact%measure(scene%x, u, du)
   end subroutine draw_apart

   !> One constraint per place; its increment is g.du, and g has neither force nor moment.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t) :: item(1)
      real(wp) :: u(2, 20), du(2, 20), size_g
      real(wp), allocatable :: mid(:, :)
      integer :: i, j, k, n_both

      n_both = 0
      do i = 1, n_variant
         do k = 1, 8
            call draw_apart(i, 0.2_wp*real(k - 4, wp), scene, contact, u, du, error)
            if (allocated(error)) return
            call check_equal(error, contact%n_constraint, 3, "constraints")
            do j = 1, 3
               if (.not. contact%state(j)%is_near) cycle
               call contact%evaluate([j], scene%x, u, du, [0.02_wp], item)
               associate (a => item(1), g => item(1)%g(:, :item(1)%n_node), &
                     node => item(1)%node(:item(1)%n_node))
                  if (any(node == 14) .and. any(node == 17)) n_both = n_both + 1
                  size_g = 1.0_wp + sum(abs(g))
                  call check_equal(error, node(1), contact%node(j), "slave node")
                  call check_near(error, [sum(g*du(:, node)), a%gap1 - a%gap0], [a%dgap, a%dgap], &
                     tol, size_g, "identity, variant " // to_text(i))
                  mid = scene%x(:, node) + u(:, node) + 0.5_wp*du(:, node)
                  call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, size_g, &
                     "force, variant " // to_text(i))
                  call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
                     size_g*maxval(abs(mid)), "moment, variant " // to_text(i))
               end associate
               if (allocated(error)) return
            end do
         end do
      end do
      call check_equal(error, n_both, 8*(n_variant - 2), "forces on both nodes, but for NTS")
   end subroutine test_momenta

   !> c and h against central differences, where the gradient does not jump: steps and bounds as in
   !> the tests of mortar contact.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: shortest = 0.0625_wp, step = 4.0_wp*shortest*epsilon(1.0_wp) &
         **(1.0_wp/3.0_wp), bound = 25.0_wp*(step/shortest)**2
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t) :: item(3), up(3), down(3)
      real(wp) :: u(2, 20), du(2, 20), way(2, 20), size_h
      integer, allocatable :: wanted(:)
      integer :: i, j, k, a, column, n_checked, n_try

      n_checked = 0
      do i = 1, n_variant
         do n_try = 1, 3, 2
            call draw_apart(i, 0.25_wp*real(n_try - 2, wp), scene, contact, u, du, error)
            if (allocated(error)) return
            wanted = pack([1, 2, 3], contact%state%is_near)
            associate (n => size(wanted), target => [0.02_wp, 0.02_wp, 0.02_wp])
               call contact%evaluate(wanted, scene%x, u, du, target(:n), item(:n))
               do column = 1, size(u)
                  k = (column + 1)/2
                  if (.not. any([(any(item(j)%node(:item(j)%n_node) == k), j = 1, n)])) cycle
                  a = 2 - mod(column, 2)
                  way = 0.0_wp
                  way(a, k) = step
                  call contact%evaluate(wanted, scene%x, u, du + way, target(:n), up(:n))
                  call contact%evaluate(wanted, scene%x, u, du - way, target(:n), down(:n))
                  do j = 1, n
                     call compare_column(item(j), up(j), down(j), a, k)
                     if (allocated(error)) return
                  end do
               end do
            end associate
         end do
      end do
      call check_true(error, n_checked > 2*2*10*n_variant, "most columns are compared: " &
         // to_text(n_checked))

   contains

      subroutine compare_column(item, up, down, a, k)
         type(condition_t), intent(in) :: item, up, down
         integer, intent(in) :: a, k
         integer :: at

         associate (m => item%n_node)
            at = findloc(item%node(:m), k, 1)
            if (at == 0) return
            if (maxval(abs(up%c(:, :m) - down%c(:, :m))) > 1.0e3_wp*step) return
            n_checked = n_checked + 1
            size_h = 1.0_wp + maxval(abs(item%h(:2*m, :2*m)))
            call check_near(error, item%c(a, at), (up%gap1 - down%gap1)/(2.0_wp*step), bound, &
               size_h, "gradient, variant " // to_text(i))
            call check_near(error, item%h(:2*m, 2*at - 2 + a), reshape((up%g(:, :m) &
               - down%g(:, :m))/(2.0_wp*step), [2*m]), bound, size_h, "column, variant " &
               // to_text(i))
         end associate
      end subroutine compare_column

   end subroutine test_derivatives

   !> Where second derivatives are left out, all else has the bits that it has with them.
   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t) :: item(1), first(1)
      real(wp) :: u(2, 20), du(2, 20)
      integer :: i, j, k, n_bent

      first%leaves_second = .true.
      do i = 1, n_variant
         n_bent = 0
         do k = 1, 5
            call draw_apart(i, 0.3_wp*real(k - 3, wp), scene, contact, u, du, error)
            if (allocated(error)) return
            do j = 1, 3
               if (.not. contact%state(j)%is_near) cycle
               call contact%evaluate([j], scene%x, u, du, [0.02_wp], item)
               call contact%evaluate([j], scene%x, u, du, [0.02_wp], first)
               call compare_bits(item(1), first(1))
               if (allocated(error)) return
               if (any(abs(item(1)%h) > 0.0_wp)) n_bent = n_bent + 1
            end do
         end do
         call check_true(error, n_bent > 5, "second derivatives, variant " // to_text(i))
         call check_true(error, all(abs(first(1)%h) <= 0.0_wp), "left out, variant " // to_text(i))
      end do

   contains

      subroutine compare_bits(a, b)
         type(condition_t), intent(in) :: a, b

         call check_equal(error, a%node(:a%n_node), b%node(:b%n_node), "nodes")
         call check_near(error, [b%gap0, b%gap1, b%dgap], [a%gap0, a%gap1, a%dgap], 0.0_wp, &
            0.0_wp, "value, variant " // to_text(i))
         call check_near(error, b%g(:, :a%n_node), a%g(:, :a%n_node), 0.0_wp, 0.0_wp, &
            "discrete gradient, variant " // to_text(i))
         call check_near(error, b%c(:, :a%n_node), a%c(:, :a%n_node), 0.0_wp, 0.0_wp, &
            "gradient at the end, variant " // to_text(i))
      end subroutine compare_bits

   end subroutine test_first

end module test_joints
