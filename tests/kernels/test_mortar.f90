!> Mortar contact of small scenes: mean gaps, partition, identity, momenta, derivatives, choice of
!> pairs.
module test_mortar
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_normal, condition_normal_slope, condition_t
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_edge_moments, only : form_share
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving
   use emcon_interactions, only : contact_options_t, contact_pair_t, integration_elements, &
      integration_segments, multiplier_dual, multiplier_standard, normal_edge, normal_nodal, &
      smoothing_hermite, smoothing_none, interaction_t
   use emcon_kinds, only : wp
   use emcon_mortar, only : mortar_init, mortar_t
   use emcon_mortar_choice, only : pair_comes_near
   use emcon_mortar_frame, only : end_rounding, moment_cover, moment_gap
   use emcon_motion, only : motion_init, motion_evaluate, motion_t
   use emcon_scene, only : scene_t
   use emcon_slip_point, only : slip_list_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_surface, bend_scene, block_node, block_t, bottom, left, &
      make_two_blocks, right, scene_begin, shake, top
   implicit none
   private
   public :: collect_mortar

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over a few pairs, each of some 500 roundings.
   real(wp), parameter :: tol = 2048.0_wp*eps
   !> All combinations of integration, multiplier, normal and smoothing.
   integer, parameter :: n_combination = 16
   !> Places of the upper block along x: covered, and its first or last edge in part.
   real(wp), parameter :: shift(3) = [0.0_wp, 1.4_wp, -1.75_wp]

contains

   subroutine collect_mortar(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a uniform gap is the mean gap", test_uniform), &
         test_case_t("the weights add up to 1", test_partition), &
         test_case_t("gap of curved surfaces, by rays", test_rays), &
         test_case_t("dual weights: no coupling", test_dual), &
         test_case_t("let go where hardly covered", test_cover), &
         test_case_t("values and identity", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("gradient and second derivatives", test_derivatives), &
         test_case_t("normal force by the multiplier", test_normal), &
         test_case_t("and its derivatives", test_normal_slope), &
         test_case_t("pushes at the end, slip of the step", test_pushes_at_end), &
         test_case_t("notch: nodes on both sides of a pair", test_notch), &
         test_case_t("the nearer of two layers", test_layers), &
         test_case_t("not the back of a thin body", test_thin), &
         test_case_t("surfaces that look the same way", test_same_way), &
         test_case_t("nothing within reach", test_apart), &
         test_case_t("edges whose boxes come near on the way", test_near), &
         test_case_t("slip is kept from step to step", test_slip_share), &
         test_case_t("points of slip fill what is covered", test_slip_points), &
         test_case_t("before anything is measured", test_before), &
         test_case_t("what comes over the master, and what leaves it", test_come_and_go), &
         test_case_t("slip of what is covered at one end alone, or not at all", test_slip_beside)]
   end subroutine collect_mortar

   ! ---- scenes ---------------------------------------------------------------------------------

   pure function options_of(i) result(options)
      integer, intent(in) :: i                   !! 1 to n_combination
      type(contact_options_t) :: options

      options%integration = merge(integration_segments, integration_elements, btest(i, 0))
      options%multiplier = merge(multiplier_standard, multiplier_dual, btest(i, 1))
      options%normal = merge(normal_edge, normal_nodal, btest(i, 2))
      options%smoothing = merge(smoothing_none, smoothing_hermite, btest(i, 3))
   end function options_of

   !> Two blocks, the upper one moved by `way` along x, bent; contact with the options `i`.
   subroutine make(gap, way, curvature, i, scene, mortar, error)
      real(wp), intent(in) :: gap, way, curvature
      integer, intent(in) :: i
      type(scene_t), intent(out) :: scene
      type(mortar_t), intent(out) :: mortar
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper

      call make_two_blocks(scene, gap, lower, upper)
      scene%x(1, 11:) = scene%x(1, 11:) + way
      call bend_scene(scene, curvature)
      call mortar_init(mortar, scene, scene%pair(1), error)
      if (allocated(error)) return
      call mortar%configure(scene%x, options_of(i))
   end subroutine make

   !> Integral of the weights of constraint `i` over the covered part, at both ends.
   pure function area_of(mortar, i) result(area)
      type(mortar_t), intent(in) :: mortar
      integer, intent(in) :: i
      real(wp) :: area(0:1), part_gap(0:1), part_area(0:1)
      integer :: k

      area = 0.0_wp
      do k = 1, 2
         if (mortar%node_edge(k, i) == 0) cycle
         call form_share(mortar%form(mortar%node_edge(k, i)), 3 - k, mortar%is_dual, part_gap, &
            part_area)
         area = area + part_area
      end do
   end function area_of

   pure function text_of(i, k) result(text)
      integer, intent(in) :: i, k
      character(len=text_length(i, k)) :: text

      text = ", combination " // to_text(i) // ", place " // to_text(k)
   end function text_of

   pure integer function text_length(i, k)
      integer, intent(in) :: i, k

      text_length = len(", combination , place ") + len(to_text(i)) + len(to_text(k))
   end function text_length

   ! ---- closed forms ---------------------------------------------------------------------------

   !> Flat surfaces, 1/4 apart, that come closer by 3/8 and slide by 1/8.
   subroutine test_uniform(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), allocatable :: du(:, :)
      integer :: i, j, k

      do i = 1, n_combination
         do k = 1, 3
            call make(0.25_wp, shift(k), 0.0_wp, i, scene, mortar, error)
            if (allocated(error)) return
            du = 0.0_wp*scene%x
            du(1, 11:) = 0.125_wp
            du(2, 11:) = -0.375_wp
            call mortar%begin_step(scene%x, scene%u0, du)
            call mortar%measure(scene%x, scene%u0, du)
            do j = 1, 3
               associate (state => mortar%state(j))
                  if (.not. state%is_over) cycle
                  call check_near(error, state%gap1, -0.125_wp, tol, 1.0_wp, "gap at the end" &
                     // text_of(i, k))
                  call check_near(error, state%gap0, 0.25_wp, tol, 1.0_wp, "gap at the start" &
                     // text_of(i, k))
               end associate
            end do
            call check_equal(error, count(mortar%state%is_near), 3, "near" // text_of(i, k))
            call check_true(error, count(mortar%state%is_over) >= 2, "over" // text_of(i, k))
         end do
      end do
   end subroutine test_uniform

   !> The sum of the weighted gaps is the integral of the gap, however much is covered.
   subroutine test_partition(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: sum_area, part(0:1), area(0:1), total(0:1)
      integer :: i, k, e, side

      do i = 1, n_combination
         do k = 1, 3
            call make(0.1_wp, shift(k), 0.2_wp, i, scene, mortar, error)
            if (allocated(error)) return
            u = 0.0_wp*scene%x
            du = u
            call shake(u, 0.05_wp)
            call shake(du, 0.05_wp)
            call mortar%begin_step(scene%x, u, du)
            call mortar%measure(scene%x, u, du)
            do e = 1, mortar%slave%n_facet
               total = 0.0_wp
               sum_area = 0.0_wp
               do side = 1, 2
                  call form_share(mortar%form(e), side, mortar%is_dual, part, area)
                  total = total + part
                  sum_area = sum_area + area(1)
                  call check_true(error, minval(area) >= 0.0_wp, "areas are not negative")
               end do
               call check_near(error, total, mortar%form(e)%value(moment_gap, :), tol, 1.0_wp, &
                  "sum" // text_of(i, k))
               call check_true(error, sum_area > 0.0_wp .eqv. &
                  mortar%form(e)%value(moment_cover, 1) > 0.0_wp, "area and cover")
            end do
         end do
      end do
   end subroutine test_partition

   !> Normal of the edge, polygon: the integral by the midpoint rule with n rays per edge, whose
   !> error is O(1/n) of the jump of the slope of the gap (or of the gap, at the end of the master).
   subroutine test_rays(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: i = 5, n_ray = 2000      ! segments, dual, edge normal
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(contact_options_t) :: options
      real(wp), allocatable :: u(:, :)
      real(wp) :: a(2), point(2), normal(2), expected, gap
      integer :: k, e, n

      do k = 1, 3
         call make(0.1_wp, shift(k), 0.3_wp, i, scene, mortar, error)
         if (allocated(error)) return
         options = options_of(i)
         options%smoothing = smoothing_none
         call mortar%configure(scene%x, options)
         u = 0.0_wp*scene%x
         call shake(u, 0.04_wp)
         call mortar%begin_step(scene%x, u, 0.0_wp*u)
         call mortar%measure(scene%x, u, 0.0_wp*u)
         do e = 1, mortar%slave%n_facet
            associate (first => mortar%slave%facet(1, e), last => mortar%slave%facet(2, e))
               a = scene%x(:, last) + u(:, last) - scene%x(:, first) - u(:, first)
               normal = [a(2), -a(1)]/norm2(a)
               expected = 0.0_wp
               do n = 1, n_ray
                  point = scene%x(:, first) + u(:, first) + a*(real(n, wp) - 0.5_wp)/n_ray
                  call ray(mortar%master%facet, scene%x + u, point, normal, gap)
                  if (gap < huge(gap)) expected = expected + gap*norm2(a)/n_ray
               end do
            end associate
            call check_near(error, mortar%form(e)%value(moment_gap, 1), expected, &
               2.0_wp/real(n_ray, wp), 0.3_wp, "integral" // text_of(i, k))
         end do
      end do
   end subroutine test_rays

   !> Distance along `normal` to the nearest of the edges that face `point`; huge if none does.
   pure subroutine ray(edge, x, point, normal, gap)
      integer, intent(in) :: edge(:, :)
      real(wp), intent(in) :: x(:, :), point(2), normal(2)
      real(wp), intent(out) :: gap
      real(wp) :: b(2, 2), along(2), above(2)
      integer :: m

      gap = huge(gap)
      do m = 1, size(edge, 2)
         b = x(:, edge(:, m)) - spread(point, 2, 2)
         along = normal(1)*b(2, :) - normal(2)*b(1, :)
         above = normal(1)*b(1, :) + normal(2)*b(2, :)
         if (along(1) < 0.0_wp .or. along(2) > 0.0_wp) cycle
         gap = min(gap, above(1) + along(1)/(along(1) - along(2))*(above(2) - above(1)))
      end do
   end subroutine ray

   !> Flat surfaces, all covered: moving one slave node along the normal changes, with dual weights,
   !> its own mean gap only; with standard ones also those of its neighbours, by 1/6 of an edge.
   subroutine test_dual(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t) :: item(3)
      real(wp) :: expected, matrix(3, 3), length(3)
      integer :: i, a, b, place

      length = [0.5_wp, 1.0_wp, 0.5_wp]
      do i = 1, n_combination
         call make(0.125_wp, shift(1), 0.0_wp, i, scene, mortar, error)
         if (allocated(error)) return
         call mortar%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         call mortar%measure(scene%x, scene%u0, 0.0_wp*scene%x)
         call mortar%evaluate([1, 2, 3], scene%x, scene%u0, 0.0_wp*scene%x, [0.0_wp, 0.0_wp, &
            0.0_wp], item)
         matrix = 0.0_wp
         do a = 1, 3
            do b = 1, 3
               place = findloc(item(a)%node(:item(a)%n_node), mortar%node(b), 1)
               if (place == 0) cycle
               matrix(a, b) = item(a)%c(2, place)
               call check_true(error, place <= item(a)%n_slave, "slave nodes come first")
            end do
         end do
         do a = 1, 3
            do b = 1, 3
               expected = merge(1.0_wp, 0.0_wp, a == b)
               if (.not. mortar%is_dual) expected = merge(2.0_wp*length(a)/3.0_wp, merge(1.0_wp &
                  /6.0_wp, 0.0_wp, abs(a - b) == 1), a == b)/length(a)
               call check_near(error, matrix(a, b), expected, tol, 1.0_wp, "row " // to_text(a) &
                  // " column " // to_text(b) // text_of(i, 1))
            end do
         end do
      end do
   end subroutine test_dual

   !> The last slave node beyond the end of the master surface, the part c of its edge covered: the
   !> weight's integral is c^2/2, or c^2/2 - c^3 + c^4 with the dual basis; it is let go below 0.02
   !> of half an edge.
   subroutine test_cover(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: least = 0.02_wp*0.5_wp, nearly = 1.0e-6_wp
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t) :: item(1)
      real(wp) :: c, low, high, u(2, 16), area(0:1)
      integer :: i, k, side

      do i = 1, n_combination
         if (.not. btest(i, 0)) cycle            ! Gauss points are covered or not
         low = 0.0_wp
         high = 0.3_wp
         do k = 1, digits(1.0_wp)
            c = 0.5_wp*(low + high)
            if (weight(c) < least) low = c
            if (weight(c) >= least) high = c
         end do
         do side = -1, 1, 2
            call make(0.125_wp, 0.0_wp, 0.0_wp, i, scene, mortar, error)
            if (allocated(error)) return
            u = 0.0_wp
            u(1, 11:) = 1.875_wp - c*(1.0_wp + nearly*real(side, wp))
            call mortar%begin_step(scene%x, u, 0.0_wp*u)
            call mortar%measure(scene%x, u, 0.0_wp*u)
            area = area_of(mortar, 3)
            call check_near(error, area(1), weight(c*(1.0_wp + nearly*real(side, wp))), tol, &
               1.0_wp, "area" // text_of(i, side))
            call check_true(error, mortar%state(3)%is_near, "near" // text_of(i, side))
            call check_true(error, mortar%state(3)%is_over .eqv. side > 0, "over" &
               // text_of(i, side))
            call check_true(error, all(mortar%state(1:2)%is_over), "the others are over")
            call mortar%evaluate([3], scene%x, u, 0.0_wp*u, [0.0_wp], item)
            call check_near(error, item(1)%gap1, 0.125_wp, 4.0_wp*nearly, 1.0_wp, &
               "length of the constraint")
         end do
      end do

   contains

      pure real(wp) function weight(part)
         real(wp), intent(in) :: part

         weight = 0.5_wp*part**2
         if (mortar_is_dual(i)) weight = weight - part**3 + part**4
      end function weight

   end subroutine test_cover

   pure logical function mortar_is_dual(i)
      integer, intent(in) :: i
      type(contact_options_t) :: options

      options = options_of(i)
      mortar_is_dual = options%multiplier == multiplier_dual
   end function mortar_is_dual

   ! ---- steps ----------------------------------------------------------------------------------

   !> A random step of contact `i`: bent blocks, a deformation of up to `size` and a slide.
   subroutine draw(i, k, size, scene, mortar, u, du, error)
      integer, intent(in) :: i, k
      real(wp), intent(in) :: size
      type(scene_t), intent(out) :: scene
      type(mortar_t), intent(out) :: mortar
      real(wp), allocatable, intent(out) :: u(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error

      call make(0.05_wp, shift(k), 0.3_wp, i, scene, mortar, error)
      if (allocated(error)) return
      allocate(u, du, mold=scene%x)
      call shake(u, 0.08_wp)
      call shake(du, size)
      du(1, 11:) = du(1, 11:) + 2.0_wp*du(1, 1)
      call mortar%begin_step(scene%x, u, du)
      call mortar%measure(scene%x, u, du)
   end subroutine draw

   !> The constraint is (Phi - target W)/scale; its increment is g.du. Steps down to 2^-56.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t) :: item(3)
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: target(3), area(0:1), moved, way
      integer :: i, j, k, n, n_checked

      n_checked = 0
      do i = 1, n_combination
         do n = 0, 19
            k = 1 + mod(n, 3)
            call draw(i, k, scale(0.1_wp, -max(0, 8*(n - 12))), scene, mortar, u, du, error)
            if (allocated(error)) return
            target = [0.03_wp, 0.0_wp, -0.02_wp]
            call mortar%evaluate([1, 2, 3], scene%x, u, du, target, item)
            do j = 1, 3
               associate (a => item(j), state => mortar%state(j))
                  call check_equal(error, a%node(1), mortar%node(j), "slave node")
                  area = area_of(mortar, j)
                  moved = sum(abs(a%g(:, :a%n_node)*du(:, a%node(:a%n_node))))
                  way = sum(a%g(:, :a%n_node)*du(:, a%node(:a%n_node)))
                  call check_near(error, way, a%dgap, tol, moved, "identity" // text_of(i, k))
                  call check_near(error, a%gap1 - a%gap0, a%dgap, tol, 1.0_wp + moved, &
                     "increment" // text_of(i, k))
                  if (.not. state%is_over .or. area(0) < mortar%scale(j)) cycle
                  n_checked = n_checked + 1
                  call check_near(error, a%gap0, state%gap0 - target(j), tol, 1.0_wp, &
                     "value at the start" // text_of(i, k))
                  call check_near(error, a%gap1, (state%gap1 - target(j))*area(1)/area(0), tol, &
                     max(1.0_wp, area(1)/area(0)), "value at the end" // text_of(i, k))
               end associate
            end do
         end do
         if (allocated(error)) return
      end do
      call check_true(error, n_checked > 35*n_combination, "most nodes are over the surface: " &
         // to_text(n_checked))
   end subroutine test_identity

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t) :: item(3)
      real(wp), allocatable :: u(:, :), du(:, :), mid(:, :)
      integer :: i, j, k, n

      do i = 1, n_combination
         do n = 0, 5
            k = 1 + mod(n, 3)
            call draw(i, k, 0.1_wp, scene, mortar, u, du, error)
            if (allocated(error)) return
            call mortar%evaluate([1, 2, 3], scene%x, u, du, [0.03_wp, 0.0_wp, -0.02_wp], item)
            do j = 1, 3
               associate (g => item(j)%g(:, :item(j)%n_node), node => item(j)%node(:item(j)%n_node))
                  mid = scene%x(:, node) + u(:, node) + 0.5_wp*du(:, node)
                  call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), &
                     "linear" // text_of(i, k))
                  call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
                     sum(abs(g))*maxval(abs(mid)), "angular" // text_of(i, k))
               end associate
            end do
         end do
      end do
   end subroutine test_momenta

   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, k, n, n_checked

      n_checked = 0
      do i = 1, n_combination
         do n = 0, 3
            k = 1 + mod(n, 3)
            call draw(i, k, merge(0.1_wp, 1.0e-6_wp, n < 3), scene, mortar, u, du, error)
            if (allocated(error)) return
            call compare(mortar, scene, u, du, 0.25_wp, text_of(i, k), n_checked, error)
         end do
         if (allocated(error)) return
      end do
      call check_true(error, n_checked > 4*3*10*n_combination, "most columns are compared: " &
         // to_text(n_checked))
   end subroutine test_derivatives

   !> c and h of all constraints against central differences of steps of 4 eps^(1/3) of the shortest
   !> length, errors as in the tests of one pair: (n + 1)(n + 2)/6 (step/length)^2. None where the
   !> gradient jumps within the step of the difference.
   subroutine compare(mortar, scene, u, du, shortest, what, n_checked, error)
      type(mortar_t), intent(inout) :: mortar
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: u(:, :), du(:, :)
      real(wp), intent(in) :: shortest           !! of edges, covered parts and fields [L]
      character(len=*), intent(in) :: what
      integer, intent(inout) :: n_checked
      type(error_t), allocatable, intent(inout) :: error
      type(condition_t), allocatable :: item(:), up(:), down(:)
      real(wp), allocatable :: target(:)
      real(wp) :: way(size(u, 1), size(u, 2)), step, bound, size_h
      integer, allocatable :: wanted(:)
      integer :: i, k, a, n, column

      step = 4.0_wp*shortest*eps**(1.0_wp/3.0_wp)
      bound = 25.0_wp*(step/shortest)**2
      n = mortar%n_constraint
      allocate(wanted(n), target(n), item(n), up(n), down(n))
      wanted = [(i, i = 1, n)]
      target = 0.02_wp
      call mortar%evaluate(wanted, scene%x, u, du, target, item)
      do k = 1, size(u, 2)
         if (.not. any([(any(item(i)%node(:item(i)%n_node) == k), i = 1, n)])) cycle
         do a = 1, 2
            way = 0.0_wp
            way(a, k) = step
            call mortar%evaluate(wanted, scene%x, u, du + way, target, up)
            call mortar%evaluate(wanted, scene%x, u, du - way, target, down)
            do i = 1, n
               associate (m => item(i)%n_node)
                  column = 2*findloc(item(i)%node(:m), k, 1) - 2 + a
                  if (column < 1) cycle
                  if (maxval(abs(up(i)%c(:, :m) - down(i)%c(:, :m))) > 1.0e3_wp*step) cycle
                  n_checked = n_checked + 1
                  size_h = 1.0_wp + maxval(abs(item(i)%h(:2*m, :2*m)))
                  call check_near(error, item(i)%c(a, findloc(item(i)%node(:m), k, 1)), &
                     (up(i)%gap1 - down(i)%gap1)/(2.0_wp*step), bound, size_h, "gradient" // what)
                  call check_near(error, item(i)%h(:2*m, column), reshape((up(i)%g(:, :m) &
                     - down(i)%g(:, :m))/(2.0_wp*step), [2*m]), bound, size_h, "column" // what)
               end associate
            end do
         end do
      end do
   end subroutine compare

   ! ---- friction -------------------------------------------------------------------------------

   !> On flat surfaces that rest in contact a multiplier of 1 pushes by what is covered over the
   !> scale of the constraint, also where that is a part, and friction of 1 acts with 1; wherever a
   !> scheme evaluates forces.
   subroutine test_normal(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t) :: item(3)
      real(wp), allocatable :: still(:, :)
      real(wp) :: area(0:1)
      integer :: e, i, j, k, n_part

      n_part = 0
      do i = 1, n_combination
         do k = 1, 3
            call make(0.0_wp, shift(k), 0.0_wp, i, scene, mortar, error)
            if (allocated(error)) return
            still = 0.0_wp*scene%x
            call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
            call mortar%begin_step(scene%x, still, still)
            call mortar%measure(scene%x, still, still)
            item%has_friction = .true.
            call mortar%evaluate([1, 2, 3], scene%x, still, still, [0.0_wp, 0.0_wp, 0.0_wp], item)
            do j = 1, 3
               area = area_of(mortar, j)
               if (area(1) < mortar%scale(j)) cycle
               mortar%scale(j) = 0.25_wp
               call mortar%evaluate([j], scene%x, still, still, [0.0_wp], item(j:j))
               ! Of its edges and of no others.
               call check_true(error, all(mortar%is_formed .eqv. [(any(mortar%node_edge(:, j) &
                  == e), &
                  e = 1, 2)]), "edges that are formed" // text_of(i, k))
               if (area(1) < 0.9_wp*mortar%whole(j)) n_part = n_part + 1
               call check_near(error, condition_normal(item(j)), 4.0_wp*area(1), tol, 1.0_wp, &
                  "normal force" // text_of(i, k))
               call check_near(error, abs(sum(item(j)%t(1, :item(j)%n_slave, 1))), 1.0_wp, tol, &
                  1.0_wp, "friction" // text_of(i, k))
               call by_schemes(mortar, j, 4.0_wp*area(1))
            end do
         end do
         if (allocated(error)) return
      end do
      call check_true(error, n_part >= n_combination, "some are covered in part: " &
         // to_text(n_part))

   contains

      !> At rest, over a step, at its end or start: the normal force that a condition knows.
      subroutine by_schemes(mortar, j, expected)
         type(mortar_t), intent(inout) :: mortar
         integer, intent(in) :: j
         real(wp), intent(in) :: expected
         type(motion_t) :: motion
         type(condition_t) :: one(1)
         integer :: scheme

         call motion_init(motion, scene%x)
         do scheme = 1, 4
            motion%evaluation = evaluation_at_end
            if (scheme > 1) motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 1.0_wp)
            motion%evaluation%pushes_at_end = scheme == 3
            if (scheme == 4) motion%evaluation%is_gradient = .true.
            if (scheme == 4) motion%evaluation%at = 0.0_wp
            call motion_evaluate(motion)
            one%has_friction = .true.
            one%normal = 0.0_wp
            call mortar%linearise([j], motion, [0.0_wp], one)
            call check_near(error, one(1)%normal, expected, tol, 1.0_wp, "scheme " &
               // to_text(scheme))
         end do
      end subroutine by_schemes

   end subroutine test_normal

   !> Where a scheme pushes at the end, and in equilibrium, slip and its gradient are those over the
   !> step; what pushes at the end alone opens the gap of the step.
   subroutine test_pushes_at_end(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: none(3) = 0.0_wp
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(motion_t) :: motion
      type(condition_t), dimension(3) :: over, one
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, j, k, scheme, m

      over%has_friction = .true.
      one%has_friction = .true.
      do i = 1, n_combination
         do k = 1, 3
            call draw(i, k, 0.1_wp, scene, mortar, u, du, error)
            if (allocated(error)) return
            call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
            call mortar%begin_step(scene%x, u, du)
            call mortar%measure(scene%x, u, du)
            call mortar%evaluate([1, 2, 3], scene%x, u, du, none, over)
            call motion_init(motion, scene%x)
            motion%u0 = u
            motion%du = du
            do scheme = 1, 2
               motion%evaluation = evaluation_at_end
               if (scheme == 2) motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 1.0_wp)
               if (scheme == 2) motion%evaluation%pushes_at_end = .true.
               call motion_evaluate(motion)
               call mortar%linearise([1, 2, 3], motion, none, one)
               do j = 1, 3
                  m = over(j)%n_node
                  call check_equal(error, one(j)%node(:one(j)%n_node), over(j)%node(:m), "nodes")
                  if (allocated(error)) return
                  call check_near(error, one(j)%slip(1), over(j)%slip(1), 0.0_wp, 1.0_wp, "slip")
                  call check_near(error, one(j)%t1(:, :m, 1), over(j)%t1(:, :m, 1), 0.0_wp, &
                     1.0_wp, &
                     "its gradient" // text_of(i, k))
                  if (scheme == 2) call check_near(error, [one(j)%gap0, one(j)%dgap], &
                     [over(j)%gap0, over(j)%dgap], 0.0_wp, 1.0_wp, "gap of the step")
               end do
            end do
         end do
      end do
   end subroutine test_pushes_at_end

   !> Central differences, with the steps and bounds of `compare`; none where a gradient jumps.
   subroutine test_normal_slope(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: shortest = 0.25_wp, step = 4.0_wp*shortest*eps**(1.0_wp/3.0_wp)
      real(wp), parameter :: none(3) = 0.0_wp
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(condition_t), dimension(3) :: item, up, down
      real(wp), allocatable :: u(:, :), du(:, :), way(:, :), slope(:)
      integer :: i, j, k, n, column, n_checked

      n_checked = 0
      item%has_friction = .true.
      up%has_friction = .true.
      down%has_friction = .true.
      do i = 1, n_combination
         do k = 1, 3
            call draw(i, k, 0.1_wp, scene, mortar, u, du, error)
            if (allocated(error)) return
            call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
            call mortar%begin_step(scene%x, u, du)
            call mortar%measure(scene%x, u, du)
            call mortar%evaluate([1, 2, 3], scene%x, u, du, none, item)
            do n = 0, size(u) - 1
               if (.not. any([(any(item(j)%node(:item(j)%n_node) == 1 + n/2), j = 1, 3)])) cycle
               way = 0.0_wp*u
               way(1 + mod(n, 2), 1 + n/2) = step
               call mortar%evaluate([1, 2, 3], scene%x, u, du + way, none, up)
               call mortar%evaluate([1, 2, 3], scene%x, u, du - way, none, down)
               do j = 1, 3
                  associate (m => item(j)%n_node)
                     column = 2*findloc(item(j)%node(:m), 1 + n/2, 1) - 1 + mod(n, 2)
                     if (column < 1) cycle
                     if (maxval(abs(up(j)%g(:, :m) - down(j)%g(:, :m))) > 1.0e3_wp*step) cycle
                     n_checked = n_checked + 1
                     slope = condition_normal_slope(item(j))
                     call check_near(error, slope(column), (condition_normal(up(j)) &
                        - condition_normal(down(j)))/(2.0_wp*step), 25.0_wp*(step/shortest)**2, &
                        1.0_wp + maxval(abs(item(j)%h(:2*m, :2*m))), "slope" // text_of(i, k))
                  end associate
               end do
            end do
         end do
         if (allocated(error)) return
      end do
      call check_true(error, n_checked > 3*3*10*n_combination, "most columns are compared: " &
         // to_text(n_checked))
   end subroutine test_normal_slope

   ! ---- choice of pairs ------------------------------------------------------------------------

   !> A surface with a narrow notch in contact with itself: its walls are two edges apart, so that
   !> with normals and cubics around the corners nodes stand on both sides of a pair.
   subroutine test_notch(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(contact_pair_t) :: pair
      type(contact_options_t) :: options
      type(mortar_t) :: mortar
      type(condition_t), allocatable :: item(:)
      real(wp), allocatable :: u(:, :), du(:, :), target(:)
      integer, allocatable :: wanted(:)
      real(wp) :: moved
      integer :: i, j, n, n_checked, n_pair

      n_checked = 0
      n_pair = 0
      do i = 1, n_combination
         call scene_begin(scene)
         call add_block(scene, "CPE4", [3, 1], [0.0_wp, -1.0_wp], [3.0_wp, 1.0_wp], block)
         call add_wall(scene, block, 0)
         call add_wall(scene, block, 2)
         scene%x(1, :) = scene%x(1, :) - 0.7_wp*max(0.0_wp, min(1.0_wp, scene%x(1, :) - 1.0_wp))
         call add_surface(scene, "NOTCH", block, [top])
         scene%surface(1)%element = [5, 2, 4]
         scene%surface(1)%face = [4, 3, 2]
         pair%slave = 1
         pair%master = 1
         call mortar_init(mortar, scene, pair, error)
         if (allocated(error)) return
         options = options_of(i)
         options%normal_angle = 120.0_wp
         options%smoothing_angle = 120.0_wp
         call mortar%configure(scene%x, options)
         if (allocated(item)) deallocate(item, wanted, target)
         allocate(item(mortar%n_constraint), wanted(mortar%n_constraint), &
            target(mortar%n_constraint))
         wanted = [(j, j = 1, mortar%n_constraint)]
         target = 0.02_wp
         do n = 1, 2
            u = 0.0_wp*scene%x
            du = u
            call shake(u, 0.04_wp)
            call shake(du, 0.04_wp)
            call mortar%begin_step(scene%x, u, du)
            call mortar%measure(scene%x, u, du)
            n_pair = n_pair + mortar%start(mortar%slave%n_facet + 1) - 1
            call mortar%evaluate(wanted, scene%x, u, du, target, item)
            do j = 1, size(item)
               associate (g => item(j)%g(:, :item(j)%n_node), node => item(j)%node(:item(j)%n_node))
                  moved = sum(abs(g*du(:, node)))
                  call check_near(error, sum(g*du(:, node)), item(j)%gap1 - item(j)%gap0, tol, &
                     1.0_wp + moved, "identity" // text_of(i, n))
                  call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), &
                     "linear" // text_of(i, n))
               end associate
            end do
            ! A cubic that leaves its edge at a right angle has derivatives of any size. Parts down
            ! to 0.02 of an edge are covered.
            if (options%smoothing == smoothing_none) call compare(mortar, scene, u, du, 0.02_wp, &
               text_of(i, n), n_checked, error)
         end do
         if (allocated(error)) return
      end do
      call check_equal(error, n_pair, 2*n_combination, "pairs: the walls, once")
   end subroutine test_notch

   !> Add a cell on top of cell `column` of the block.
   subroutine add_wall(scene, block, column)
      type(scene_t), intent(inout) :: scene
      type(block_t), intent(in) :: block
      integer, intent(in) :: column
      type(block_t) :: wall
      integer :: last

      call add_block(scene, "CPE4", [1, 1], [real(column, wp), 0.0_wp], [1.0_wp, 1.0_wp], wall)
      last = size(scene%element%kind)
      scene%element%node(1:2, last) = [block_node(block, column, 1), block_node(block, column + 1, &
         1)]
   end subroutine add_wall

   !> Two master bodies below each other, 0.1 and 0.4 from the slave, in either order.
   subroutine test_layers(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: near, far, upper
      type(mortar_t) :: mortar
      integer :: i, k

      do i = 1, n_combination
         do k = 1, 2
            call scene_begin(scene)
            call add_block(scene, "CPE4", [4, 1], [-2.0_wp, -0.2_wp], [4.0_wp, 0.1_wp], near)
            call add_block(scene, "CPE4", [3, 1], [-2.0_wp, -1.0_wp], [4.5_wp, 0.6_wp], far)
            call add_block(scene, "CPE4", [2, 1], [-0.875_wp, 0.0_wp], [2.0_wp, 1.0_wp], upper)
            call add_surface(scene, "NEAR", near, [top])
            call add_surface(scene, "FAR", far, [top])
            call add_surface(scene, "UPPER", upper, [bottom])
            scene%surface(k)%element = [scene%surface(k)%element, scene%surface(3 - k)%element]
            scene%surface(k)%face = [scene%surface(k)%face, scene%surface(3 - k)%face]
            call measure_gap(scene, 3, k, i, mortar, error)
            if (allocated(error)) return
            call check_near(error, mortar%state%gap1, spread(0.1_wp, 1, 3), tol, 1.0_wp, "gap" &
               // text_of(i, k))
            call check_near(error, sum(mortar%form%value(moment_cover, 1)), 2.0_wp, tol, 1.0_wp, &
               "covered once" // text_of(i, k))
         end do
      end do
   end subroutine test_layers

   !> Contact of two surfaces at rest.
   subroutine measure_gap(scene, slave, master, i, mortar, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: slave, master, i
      type(mortar_t), intent(out) :: mortar
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: pair

      pair%slave = slave
      pair%master = master
      call mortar_init(mortar, scene, pair, error)
      if (allocated(error)) return
      call mortar%configure(scene%x, options_of(i))
      call mortar%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
      call mortar%measure(scene%x, scene%u0, 0.0_wp*scene%x)
   end subroutine measure_gap

   !> A master sheet of thickness 0.05 with all its sides: over it, and a little into it.
   subroutine test_thin(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap(3) = [0.1_wp, -0.02_wp, -0.04_wp]
      type(scene_t) :: scene
      type(block_t) :: sheet, upper
      type(mortar_t) :: mortar
      integer :: i, k

      do i = 1, n_combination
         do k = 1, size(gap)
            call scene_begin(scene)
            call add_block(scene, "CPE4", [4, 1], [-2.0_wp, -0.05_wp], [4.0_wp, 0.05_wp], sheet)
            call add_block(scene, "CPE4", [2, 1], [-0.875_wp, gap(k)], [2.0_wp, 1.0_wp], upper)
            call add_surface(scene, "SHEET", sheet, [bottom, right, top, left])
            call add_surface(scene, "UPPER", upper, [bottom])
            call measure_gap(scene, 2, 1, i, mortar, error)
            if (allocated(error)) return
            call check_near(error, mortar%state%gap1, spread(gap(k), 1, 3), tol, 1.0_wp, "gap" &
               // text_of(i, k))
         end do
      end do
   end subroutine test_thin

   !> A surface above another that looks the same way, and one deep behind the slave: no pairs.
   subroutine test_same_way(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(mortar_t) :: mortar
      integer :: i, k

      do i = 1, n_combination
         do k = 1, 2
            call scene_begin(scene)
            call add_block(scene, "CPE4", [4, 1], [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], lower)
            call add_block(scene, "CPE4", [2, 1], [-0.875_wp, -0.25_wp], [2.0_wp, 1.0_wp], upper)
            call add_surface(scene, "LOWER", lower, [merge(bottom, top, k == 1)])
            call add_surface(scene, "UPPER", upper, [bottom])
            if (k == 1) scene%x(2, 1:5) = -0.5_wp
            call measure_gap(scene, 2, 1, i, mortar, error)
            if (allocated(error)) return
            call check_true(error, .not. any(mortar%state%is_near .or. mortar%state%is_over), &
               "near" // text_of(i, k))
         end do
      end do
   end subroutine test_same_way

   !> Blocks far apart: no pairs, no gaps, and constraints without value.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp) :: area(3), length(3)

      call make(50.0_wp, 0.0_wp, 0.0_wp, 1, scene, mortar, error)
      if (allocated(error)) return
      call mortar%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
      call mortar%measure(scene%x, scene%u0, 0.0_wp*scene%x)
      call check_true(error, .not. any(mortar%state%is_near .or. mortar%state%is_over), "near")
      call check_near(error, mortar%state%gap1, spread(0.0_wp, 1, 3), 0.0_wp, 1.0_wp, "gaps")
      call check_true(error, mortar%near%reach > 40.0_wp, "reach")
      call mortar%area(scene%x, scene%u0, area, length)
      call check_true(error, minval(area) > 0.0_wp, "areas")
   end subroutine test_apart

   !> There is a time at which all four distances of boxes are below `depth`, where these go
   !> straight from the start to the end: looked for at all times at which one of them passes it.
   subroutine test_near(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: depth = 0.1_wp
      real(wp) :: x0(2, 4), dx(2, 4), d(4, 0:1), time(6)
      logical :: is_near
      integer :: k, i, n

      n = 0
      do k = 1, 400
         call shake(x0, 0.3_wp)
         x0(:, 3:) = x0(:, 3:) + 0.7_wp
         call shake(dx, 1.0_wp)
         if (mod(k, 3) == 0) dx(:, :2) = dx(:, :2) + 0.7_wp
         d(:, 0) = distances(x0) - depth
         d(:, 1) = distances(x0 + dx) - depth
         time = [d(:, 0)/(d(:, 0) - d(:, 1)), 0.0_wp, 1.0_wp]
         is_near = .false.
         do i = 1, 6
            if (time(i) < 0.0_wp .or. time(i) > 1.0_wp) cycle
            is_near = is_near .or. all(d(:, 0) + time(i)*(d(:, 1) - d(:, 0)) <= tol)
         end do
         call check_true(error, pair_comes_near(depth, x0, dx) .eqv. is_near, "draw " // to_text(k))
         if (is_near) n = n + 1
      end do
      call check_true(error, n > 50 .and. n < 350, "both kinds: " // to_text(n))

   contains

      pure function distances(x) result(d)
         real(wp), intent(in) :: x(2, 4)
         real(wp) :: d(4)
         integer :: a

         do a = 1, 2
            d(2*a - 1:2*a) = [minval(x(a, 3:)) - maxval(x(a, :2)), minval(x(a, :2)) &
               - maxval(x(a, 3:))]
         end do
      end function distances

   end subroutine test_near

   !> The part of slip that is by the node itself: a step that is the same again changes nothing,
   !> one past the end of the master and the one back change it by as much.
   subroutine test_slip_share(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), allocatable :: u(:, :), still(:, :)
      real(wp) :: first(3)
      integer :: i

      do i = 1, n_combination
         call make(0.0_wp, 0.0_wp, 0.0_wp, i, scene, mortar, error)
         if (allocated(error)) return
         call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
         still = 0.0_wp*scene%x
         call mortar%begin_step(scene%x, still, still)
         first = mortar%state%slip_shift
         call check_true(error, all(first > 0.1_wp), "all that is known is new")
         u = still
         u(1, 11:) = 0.25_wp
         call mortar%begin_step(scene%x, u, still)
         call check_near(error, mortar%state%slip_shift, 0.0_wp*first, tol, 1.0_wp, &
            "flat and covered all along")
         u(1, 11:) = 2.75_wp
         call mortar%begin_step(scene%x, u, still)
         first = mortar%state%slip_shift
         call check_true(error, maxval(first) > 0.01_wp, "past the end, pair " // to_text(i))
         u(1, 11:) = 0.25_wp
         call mortar%begin_step(scene%x, u, still)
         call check_near(error, mortar%state%slip_shift, first, tol, 1.0_wp, "and back")
         if (allocated(error)) return
      end do
   end subroutine test_slip_share

   !> Flat edges of length 1 over others, all covered, that slide by up to 3/2 past nodes on both
   !> sides: weights are integrals of the multiplier over the edges of a node. What two edges cover
   !> at the start and at the end fills each edge in the mean, too.
   subroutine test_slip_points(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_edge(3) = [1, 2, 1]
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(slip_list_t) :: list
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: way, share, own
      integer :: i, k, j, node

      do i = 1, n_combination
         if (.not. btest(i, 0)) cycle            ! Gauss points of whole edges
         do k = 1, 6
            call make(0.05_wp, 0.0_wp, 0.0_wp, i, scene, mortar, error)
            if (allocated(error)) return
            mortar%step%pushes_at_end = mod(k, 3) == 0
            call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
            call draw_random(way)
            u = 0.0_wp*scene%x
            du = u
            u(1, 11:) = 0.8_wp*(way - 0.5_wp)
            du(1, 11:) = 1.6_wp*(0.5_wp - way)
            call mortar%begin_step(scene%x, u, du)
            do node = 1, 3
               if (allocated(list%point)) deallocate(list%point)
               allocate(list%point(0))
               call mortar%choose_slip(node, scene%x, u, du, list)
               associate (weight => list%point%weight)
                  ! Of a node's own shape function 1/2 on each edge; dual: the same.
                  call check_near(error, sum(weight), 0.5_wp*n_edge(node), end_rounding, &
                     1.0_wp, "sum" // text_of(i, k))
                  ! The mean of the own shape function under its multiplier: 1/3, dual 1/2.
                  own = 0.0_wp
                  do j = 1, size(weight)
                     associate (point => list%point(j))
                        own = own + point%weight*sum(point%share(:2), &
                           mask=point%node(:2) == mortar%node(node))
                     end associate
                  end do
                  share = merge(0.5_wp, 1.0_wp/3.0_wp, mortar%is_dual)
                  call check_near(error, own, share*n_edge(node), end_rounding, 1.0_wp, &
                     "own share" // text_of(i, k))
               end associate
            end do
            if (allocated(error)) return
         end do
      end do
   end subroutine test_slip_points

   !> The first slave node over the master or beside it, at the start and at the end: it acts where
   !> it ends over it, a penalty as long as it began there too. What comes from behind is told: by
   !> more than a twentieth of its edges.
   subroutine test_come_and_go(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap(4) = [0.25_wp, -0.04_wp, -0.06_wp, -0.25_wp]
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, k, m
      logical :: is_in(0:1), is_over

      do i = 1, n_combination
         if (.not. btest(i, 0)) cycle            ! Gauss points look at the same edges all along
         do k = 1, size(gap)
            call make(gap(k), 0.0_wp, 0.0_wp, i, scene, mortar, error)
            if (allocated(error)) return
            do m = 0, 7
               is_in = [btest(m, 0), btest(m, 1)]
               u = 0.0_wp*scene%x
               du = u
               u(1, 11:) = merge(1.1_wp, 2.1_wp, is_in(0)) - scene%x(1, 11)
               du(1, 11:) = merge(1.1_wp, 2.1_wp, is_in(1)) - scene%x(1, 11) - u(1, 11)
               mortar%step%is_penalty = btest(m, 2)
               is_over = is_in(1) .or. (is_in(0) .and. btest(m, 2))
               call mortar%begin_step(scene%x, u, du)
               call mortar%measure(scene%x, u, du)
               associate (state => mortar%state(1))
                  ! Some of the layers behind count as the back of a thin body.
                  if (is_in(0) .and. k == 4) cycle
                  call check_true(error, all([state%is_near, state%is_over, state%is_leaving, &
                     state%is_arriving] .eqv. [any(is_in), is_over, .not. is_over, &
                     .not. is_in(0)]), "case " // to_text(m) // text_of(i, k))
                  call check_true(error, state%was_open .eqv. (is_in(0) .or. .not. is_in(1) .or. &
                     k < 3), "open, case " // to_text(m) // text_of(i, k))
                  call check_near(error, [state%gap0, state%gap1], merge(gap(k), 0.0_wp, is_in), &
                     tol, 1.0_wp, "gaps, case " // to_text(m) // text_of(i, k))
               end associate
            end do
         end do
      end do
   end subroutine test_come_and_go

   !> Constraints count with all of their lengths, and have no mean gap where nothing is covered.
   subroutine test_before(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      real(wp), dimension(3) :: area, length, own
      real(wp), allocatable :: u(:, :)
      integer :: i

      call make(0.25_wp, 0.0_wp, 0.0_wp, 1, scene, mortar, error)
      if (allocated(error)) return
      call check_near(error, [(mortar%share(i), i = 1, 3)], [1.0_wp, 1.0_wp, 1.0_wp], 0.0_wp, &
         1.0_wp, "shares")
      call mortar%own_area(scene%x, own)
      call mortar%area(scene%x, scene%u0, area, length)
      call check_near(error, own, [0.5_wp, 1.0_wp, 0.5_wp], tol, 1.0_wp, "areas")
      call check_near(error, [area, length], [own, spread(0.0_wp, 1, 3)], 0.0_wp, 1.0_wp, &
         "areas of multipliers")
      call check_near(error, mortar%mean_gap(2, 3.0_wp), 0.0_wp, 0.0_wp, 1.0_wp, "mean gap")
      ! Half of the last edge covers nothing.
      u = 0.0_wp*scene%x
      u(1, 11:) = 2.0_wp - scene%x(1, 13) + 0.5_wp
      call mortar%begin_step(scene%x, u, 0.0_wp*u)
      call mortar%measure(scene%x, u, 0.0_wp*u)
      call check_near(error, [(mortar%mean_gap(i, 0.25_wp), i = 1, 2)], [0.25_wp, 0.25_wp], tol, &
         1.0_wp, "as much as at the start")
   end subroutine test_before

   !> A slave that leaves the master in the step slides by what it covers at the start; what is
   !> beside the master, but near, by its own motion; what is far by nothing.
   subroutine test_slip_beside(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(mortar_t) :: mortar
      type(slip_list_t) :: list, still
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, node

      do i = 1, n_combination
         call make(0.05_wp, 0.0_wp, 0.0_wp, i, scene, mortar, error)
         if (allocated(error)) return
         call contact_laws_of_surface(interaction_t(friction=0.5_wp), mortar%laws)
         u = 0.0_wp*scene%x
         du = u
         ! The first edge of the slave from 3/2 to 5/2 over an end at 2, then past that.
         u(1, 11:) = 1.5_wp - scene%x(1, 11)
         du(1, 11:) = 1.0_wp
         mortar%step%pushes_at_end = .true.
         call mortar%begin_step(scene%x, u, du)
         do node = 1, 2
            call choose(mortar, node, du, list)
            call choose(mortar, node, 0.0_wp*du, still)
            call check_true(error, size(list%point) > 0, "covered at the start")
            call check_near(error, list%point%weight, still%point%weight, tol, 1.0_wp, "weights")
         end do
         ! Beside the end by a tenth.
         u(1, 11:) = 2.1_wp - scene%x(1, 11)
         du(:, 11:) = spread([0.05_wp, 0.01_wp], 2, size(u, 2) - 10)
         call mortar%begin_step(scene%x, u, du)
         do node = 1, 3
            call choose(mortar, node, du, list)
            call check_equal(error, size(list%point), merge(1, 0, node < 3), "beside, node " &
               // to_text(node))
            if (allocated(error)) return
            if (node == 3) cycle
            call check_near(error, [list%point(1)%weight, sum(list%point(1)%share(:2), &
               mask=list%point(1)%node(:2) == mortar%node(node))], [1.0_wp, 1.0_wp], tol, 1.0_wp, &
               "its own place")
            call check_near(error, abs(mortar%slip(node, scene%x, u, du)), [0.05_wp], tol, 1.0_wp, &
               "its way")
         end do
         call check_near(error, mortar%slip(3, scene%x, u, du), [0.0_wp], 0.0_wp, 1.0_wp, "far")
      end do

   contains

      subroutine choose(mortar, node, du, list)
         type(mortar_t), intent(in) :: mortar
         integer, intent(in) :: node
         real(wp), intent(in) :: du(:, :)
         type(slip_list_t), intent(inout) :: list

         if (allocated(list%point)) deallocate(list%point)
         allocate(list%point(0))
         call mortar%choose_slip(node, scene%x, u, du, list)
      end subroutine choose

   end subroutine test_slip_beside

end module test_mortar
