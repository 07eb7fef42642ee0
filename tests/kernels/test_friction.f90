!> Coulomb's law, its small problems, and the slip of a node over an edge.
module test_friction
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_drag, condition_force, condition_t, contact_response_t, &
      most_slips
   use emcon_condition_nodes, only : condition_include, condition_resize, condition_resize_slip
   use emcon_errors, only : error_t
   use emcon_contact_law, only : contact_values_t, loss_friction
   use emcon_coulomb_law, only : contact_free, contact_open, contact_rests, contact_slides, &
      contact_sticks, contact_trial_t, coulomb_map, coulomb_status, coulomb_t, coulomb_violation, &
      slip_status_t
   use emcon_interactions, only : interaction_t
   use emcon_kinds, only : wp
   use emcon_lemke, only : lemke_solve
   use emcon_nts_constraint, only : polygon_constraint
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   use emcon_polygon_slip_plane, only : polygon_slip_over
   use emcon_slip_point, only : slip_add, slip_over, slip_point, slip_point_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_friction

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_friction(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("trials: where the law holds next", test_trial), &
         test_case_t("violation of the law", test_violation), &
         test_case_t("trials of one slip, all over the line", test_line), &
         test_case_t("the law of what is led to a slip", test_led), &
         test_case_t("vectors of slips: the cone, work, and trials that stand", test_vectors), &
         test_case_t("vectors of slips turn with the surface", test_turned), &
         test_case_t("the slope of the natural map is its derivative", test_slope), &
         test_case_t("as a law beside the rows of a condition", test_law), &
         test_case_t("slip: work, rigid motions, differences", test_slip), &
         test_case_t("a disc rolls: work, rigid motions, differences", test_roll), &
         test_case_t("mean slip of points of an edge", test_points), &
         test_case_t("slip along an edge, and of the force", test_along), &
         test_case_t("Lemke: a problem by hand, and one without solution", test_lemke)]
   end subroutine collect_friction

   subroutine test_trial(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.5_wp, c = 4.0_wp
      integer :: next(7)

      next = code_of([coulomb_status(contact_trial_t(gap=1.0_wp), mu, c), &
         coulomb_status(place(0.0_wp, 0.0_wp, 0.4_wp, gap=-1.0_wp), mu, c), &
         coulomb_status(place(0.0_wp, 0.0_wp, -0.6_wp, gap=-1.0_wp), mu, c), &
         coulomb_status(place(2.0_wp, 1.1_wp, 0.0_wp), mu, c), &
         coulomb_status(place(2.0_wp, 1.0_wp, -0.4_wp), mu, c), &
         coulomb_status(place(2.0_wp, 1.0_wp, -0.6_wp), mu, c), &
         coulomb_status(place(-0.1_wp, -0.05_wp, -0.6_wp), mu, c)])
      call check_equal(error, next, [contact_open, contact_sticks, -1, 1, contact_sticks, -1, &
         contact_open], "ways")
   end subroutine test_trial

   !> A place with one slip.
   pure type(contact_trial_t) function place(lam, tau, slip, slip_target, gap, rounding) result(at)
      real(wp), intent(in) :: lam, tau, slip
      real(wp), intent(in), optional :: slip_target, gap, rounding

      at%lam = lam
      at%tau(1) = tau
      at%slip(1) = slip
      if (present(slip_target)) at%slip_target(1) = slip_target
      if (present(gap)) at%gap = gap
      if (present(rounding)) at%rounding = rounding
   end function place

   !> Statuses as codes: where it slides the sign of the one slip.
   elemental integer function code_of(status) result(code)
      type(slip_status_t), intent(in) :: status

      code = status%kind
      if (code == contact_slides) code = nint(status%direction(1))
   end function code_of

   subroutine test_violation(error)
      type(error_t), allocatable, intent(out) :: error

      call check_near(error, [coulomb_violation(place(2.0_wp, 1.0_wp, 3.0_wp), 0.5_wp, 1.0_wp), &
         coulomb_violation(place(2.0_wp, 1.0_wp, -3.0_wp), 0.5_wp, 1.0_wp), &
         coulomb_violation(place(2.0_wp, 1.5_wp, 0.0_wp), 0.5_wp, 1.0_wp), &
         coulomb_violation(contact_trial_t(gap=-0.25_wp), 0.5_wp, 2.0_wp), &
         coulomb_violation(place(2.0_wp, 1.0_wp, -3.0_wp, rounding=0.5_wp), 0.5_wp, 1.0_wp), &
         coulomb_violation(place(2.0_wp, 4.0_wp, 9.0_wp, gap=-0.25_wp), 2.0_wp, 1.0_wp)], &
         [0.0_wp, 2.0_wp, 0.5_wp, 0.5_wp, 1.5_wp, 0.25_wp], tol, 1.0_wp, "missed")
   end subroutine test_violation

   !> One slip with mu lam = 1 and c = 4, led to c a = 2 or nowhere: wherever the trial lies the
   !> status is read off the number line. What is pushed by nothing is open.
   subroutine test_line(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: c = 4.0_wp
      real(wp) :: p, length
      integer :: i, side, led

      do led = 0, 1
         length = 2.0_wp*led
         do side = -1, 1, 2
            do i = -16, 32
               p = 0.125_wp*i
               ! Half by forces, half by slip; the push half by a gap.
               call check_equal(error, code_of(coulomb_status(place(1.0_wp, 0.5_wp*side*p, &
                  0.5_wp*side*p/c, side*length/c, -1.0_wp/c), 0.5_wp, c)), turned(on_graph()), &
                  "at " // to_text(p))
               call check_equal(error, code_of(coulomb_status(place(1.0_wp, 0.5_wp*side*p, &
                  0.5_wp*side*p/c, side*length/c, 1.0_wp/c), 0.5_wp, c)), contact_open, "no push")
               if (allocated(error)) return
            end do
         end do
      end do

   contains

      pure integer function turned(status)
         integer, intent(in) :: status

         turned = status
         if (abs(status) == 1) turned = side*status
      end function turned

      !> Where the graph of the law has it.
      pure integer function on_graph() result(way)
         way = contact_free
         if (p >= length) way = contact_sticks
         if (p <= 0.0_wp .and. led == 1) way = contact_rests
         if (p < -1.0_wp) way = -1
         if (p > length + 1.0_wp) way = 1
         if (led == 0 .and. abs(p) <= 1.0_wp) way = contact_sticks
      end function on_graph

   end subroutine test_line

   !> Friction on the graph misses nothing and takes work; off it, it is missed by the distance.
   subroutine test_led(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.5_wp, lam = 2.0_wp, a = 0.5_wp
      real(wp), parameter :: slip(7) = [-0.4_wp, 0.0_wp, 0.0_wp, 0.2_wp, a, a, 0.9_wp]
      real(wp), parameter :: tau(7) = [-1.0_wp, -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.7_wp, 1.0_wp]
      real(wp) :: missed(7), off(4)
      integer :: k, side

      call check_true(error, all(tau*slip >= 0.0_wp), "work")
      do side = -1, 1, 2
         missed = [(coulomb_violation(place(lam, side*tau(k), side*slip(k), side*a), mu, 4.0_wp), &
            k = 1, 7)]
         call check_near(error, missed, 0.0_wp*tau, tol, 1.0_wp, "on the graph")
         off = [coulomb_violation(at(-0.3_wp, a), mu, 4.0_wp), &
            coulomb_violation(at(0.1_wp, 0.2_wp), mu, 4.0_wp), &
            coulomb_violation(at(0.3_wp, 0.0_wp), mu, 4.0_wp), &
            coulomb_violation(at(0.5_wp, 5.0_wp), mu, 4.0_wp)]
         call check_near(error, off, [0.3_wp, 0.1_wp, 0.3_wp, 0.5_wp], tol, 1.0_wp, "off it")
      end do

   contains

      pure type(contact_trial_t) function at(tau, slip)
         real(wp), intent(in) :: tau, slip

         at = place(lam, side*tau, side*slip, side*a)
      end function at

   end subroutine test_led

   !> Random forces and slips of one place, of `n` slips, and what they are led to in every second.
   subroutine draw_place(n, case, at)
      integer, intent(in) :: n, case
      type(contact_trial_t), intent(out) :: at
      real(wp) :: u(8)

      call draw_random(u)
      at%lam = 2.0_wp*u(1)
      u = 2.0_wp*u - 1.0_wp
      at%gap = 0.2_wp*u(2)
      at%tau(:n) = 2.0_wp*u(3:2 + n)
      at%slip(:n) = u(5:4 + n)
      if (mod(case, 2) == 0) at%slip_target(:n) = u(7:6 + n)
   end subroutine draw_place

   !> Forces that the natural map gives obey the law with slips that make them a fixed point: inside
   !> the cone, against slip, and a trial stands where it has been.
   subroutine test_vectors(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.5_wp, c = 3.0_wp
      type(contact_trial_t) :: at
      type(slip_status_t) :: status
      real(wp) :: force(0:most_slips), slope(0:most_slips, 0:most_slips)
      integer :: case, n, seen(0:4)

      seen = 0
      do case = 1, 4000
         n = 1 + mod(case/2, 2)
         call draw_place(n, case, at)
         call coulomb_map(at, mu, c, force, slope)
         ! lam - c g and tau + c s stay as they are.
         at%gap = at%gap + (force(0) - at%lam)/c
         at%slip = at%slip - (force(1:) - at%tau)/c
         at%lam = force(0)
         at%tau = force(1:)
         call check_true(error, at%lam >= 0.0_wp .and. at%gap >= -tol .and. &
            abs(at%lam*at%gap) <= tol, "push")
         call check_true(error, norm2(at%tau) <= mu*at%lam + tol, "cone")
         call check_true(error, dot_product(at%tau, at%slip) >= -tol, "work")
         call check_true(error, coulomb_violation(at, mu, c) <= tol, "fixed point")
         status = coulomb_status(at, mu, c)
         if (status%kind == contact_slides) call check_near(error, at%tau, &
            mu*at%lam*status%direction, tol, 1.0_wp, "along slip")
         seen(status%kind) = seen(status%kind) + 1
         if (allocated(error)) return
      end do
      call check_true(error, all(seen > 50), "all ways")
   end subroutine test_vectors

   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.5_wp, c = 3.0_wp
      real(wp), parameter :: turn(2, 2) = reshape([0.6_wp, 0.8_wp, -0.8_wp, 0.6_wp], [2, 2])
      type(contact_trial_t) :: at, turned
      type(slip_status_t) :: status, other
      real(wp), dimension(0:most_slips) :: force, again
      real(wp), dimension(0:most_slips, 0:most_slips) :: slope, slope_again
      integer :: case

      do case = 1, 200
         call draw_place(2, case, at)
         turned = at
         turned%tau = matmul(turn, at%tau)
         turned%slip = matmul(turn, at%slip)
         turned%slip_target = matmul(turn, at%slip_target)
         call coulomb_map(at, mu, c, force, slope)
         call coulomb_map(turned, mu, c, again, slope_again)
         call check_near(error, again, [force(0), matmul(turn, force(1:))], tol, 1.0_wp, "forces")
         call check_near(error, [slope_again(1:, 1:)], [matmul(matmul(turn, slope(1:, 1:)), &
            transpose(turn))], tol, 1.0_wp, "slopes")
         status = coulomb_status(at, mu, c)
         other = coulomb_status(turned, mu, c)
         call check_equal(error, other%kind, status%kind, "status")
         call check_near(error, other%direction, matmul(turn, status%direction), tol, 1.0_wp, &
            "direction")
         if (allocated(error)) return
      end do
   end subroutine test_turned

   !> Central differences by the trial, exact but for their square and for rounding over it, away
   !> from kinks: steps over one are left out.
   subroutine test_slope(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.5_wp, c = 3.0_wp
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(contact_trial_t) :: at
      type(slip_status_t) :: status(-1:1)
      real(wp) :: force(0:most_slips, -1:1), slope(0:most_slips, 0:most_slips, -1:1), worst
      integer :: case, i, k, n, n_seen

      worst = 0.0_wp
      n_seen = 0
      do case = 1, 1000
         n = 1 + mod(case/2, 2)
         call draw_place(n, case, at)
         do i = 0, n
            do k = -1, 1
               status(k) = coulomb_status(moved(k*small), mu, c)
               call coulomb_map(moved(k*small), mu, c, force(:, k), slope(:, :, k))
            end do
            if (any(status%kind /= status(0)%kind)) cycle
            if (norm2(slope(:, :, 1) - slope(:, :, -1)) > 0.01_wp) cycle
            n_seen = n_seen + 1
            worst = max(worst, maxval(abs((force(:, 1) - force(:, -1))/(2.0_wp*small) &
               - slope(:, i, 0))))
         end do
      end do
      call check_true(error, n_seen > 2000, "away from kinks")
      call check_true(error, worst < 100.0_wp*small**2/0.01_wp, "differences: " // to_text(worst))

   contains

      !> The place with its trial moved by `way`.
      pure type(contact_trial_t) function moved(way)
         real(wp), intent(in) :: way

         moved = at
         if (i == 0) moved%lam = at%lam + way
         if (i > 0) moved%tau(i) = at%tau(i) + way
      end function moved

   end subroutine test_slope

   !> What slides takes mu times the push over its way; what it holds is what it is led to, or none.
   subroutine test_law(error)
      type(error_t), allocatable, intent(out) :: error
      type(coulomb_t) :: law
      type(contact_response_t) :: response
      type(contact_values_t) :: at
      logical :: acts

      call law%take(interaction_t(friction=0.25_wp, rebound=0.5_wp), 0, acts)
      law%status = slip_status_t(contact_slides, [0.6_wp, -0.8_wp])
      call law%respond(at, response)
      call check_near(error, response%mu_sigma, [0.15_wp, -0.2_wp], tol, 1.0_wp, "part of the push")
      at%friction = 4.0_wp*response%mu_sigma
      at%slip = [0.6_wp, -0.8_wp]
      call check_near(error, [law%dissipated(at, response)], [1.0_wp], tol, 1.0_wp, "work")
      call check_equal(error, law%loss, loss_friction, "loss")
      call check_true(error, acts .and. law%has_friction .and. .not. law%holds_slip(), "it slides")
      call law%leads_to([0.4_wp, 0.2_wp], 0.0_wp)
      law%status = slip_status_t(contact_sticks)
      call check_near(error, law%slip_held(), [0.2_wp, 0.1_wp], tol, 1.0_wp, "it sticks there")
      law%status = slip_status_t(contact_rests)
      call check_true(error, law%holds_slip() .and. .not. any(abs(law%slip_held()) > 0.0_wp), &
         "it rests")
      call law%leads_to([0.8_wp], 0.0_wp)
      call check_near(error, law%slip_target, [0.4_wp, 0.0_wp], tol, 1.0_wp, "one slip")
      call law%leads_to([0.4_wp, 0.2_wp], 1.0_wp)
      call check_true(error, .not. any(abs(law%slip_target) > 0.0_wp), "rounded")
   end subroutine test_law

   !> A node over one polygon, and over the two of a corner, in random motions.
   subroutine test_slip(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(polygon_stencil_t) :: stencil(2)
      type(condition_t) :: item, other
      real(wp), dimension(2, 4) :: x, u0, du, moved, mid
      real(wp) :: worst, work
      integer :: i, j, n, case

      stencil(1)%n = 4
      stencil(1)%node(:4) = [1, 2, 3, 4]
      stencil(1)%after = 4
      stencil(2)%n = 4
      stencil(2)%node(:4) = [1, 3, 4, 2]
      stencil(2)%before = 4
      do case = 1, 40
         n = 1 + mod(case, 2)
         call shake(x, 0.1_wp)
         x = x + reshape([0.9_wp, 0.1_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, -0.1_wp], [2, 4])
         call shake(u0, 0.1_wp)
         call shake(du, 0.3_wp)
         item%has_friction = .true.
         call polygon_constraint(stencil(:n), x, u0, du, 0.0_wp, item)
         associate (place => item%node(:item%n_node))
            work = sum(item%t(:, :item%n_node, 1)*du(:, place))
            call check_near(error, [work], [item%slip(1)], tol, 1.0_wp, "T.D")
            mid = x + u0 + 0.5_wp*du
            call check_near(error, [sum(item%t(1, :item%n_node, 1)), &
               sum(item%t(2, :item%n_node, 1)), sum(item%t(2, :item%n_node, 1)*mid(1, place) &
               - item%t(1, :item%n_node, 1)*mid(2, place))], &
               [0.0_wp, 0.0_wp, 0.0_wp], 4.0_wp*tol, 1.0_wp, "rigid motions of the middle")
            worst = 0.0_wp
            do j = 1, 2*item%n_node
               associate (k => place(1 + (j - 1)/2), a => 1 + mod(j - 1, 2))
                  other%has_friction = .true.
                  moved = du
                  moved(a, k) = du(a, k) + small
                  call polygon_constraint(stencil(:n), x, u0, moved, 0.0_wp, other)
                  worst = max(worst, abs((other%slip(1) - item%slip(1))/small &
                     - item%t1(a, 1 + (j - 1)/2, 1)))
                  do i = 1, 2*item%n_node
                     worst = max(worst, abs((other%t(1 + mod(i - 1, 2), 1 + (i - 1)/2, 1) &
                        - item%t(1 + mod(i - 1, 2), 1 + (i - 1)/2, 1))/small - item%ht(i, j, 1)))
                  end do
               end associate
            end do
            call check_true(error, worst < 100.0_wp*small, "differences: " // to_text(worst))
         end associate
         other%leaves_second = .true.
         call polygon_constraint(stencil(:n), x, u0, du, 0.0_wp, other)
         other%leaves_second = .false.
         call check_true(error, all(abs(other%t - item%t) <= 0.0_wp) .and. &
            all(abs(other%t1 - item%t1) <= 0.0_wp) .and. &
            .not. abs(other%slip(1) - item%slip(1)) > 0.0_wp, "bits without second derivatives")
         if (allocated(error)) return
      end do
   end subroutine test_slip

   !> The outside of a disc: what friction does on the way, what no rigid motion sees, derivatives
   !> by differences, the value alone, and no slip where a disc rolls along an edge.
   subroutine test_roll(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp), turn = 0.75_wp
      type(polygon_stencil_t) :: stencil(1)
      type(condition_t) :: item, other(2)
      real(wp), dimension(2, 4) :: x, du, moved, mid, still
      real(wp) :: worst
      integer :: i, j, n

      stencil(1)%n = 3
      stencil(1)%node(:3) = [1, 2, 3]
      stencil(1)%arm = 4
      stencil(1)%radius = 0.5_wp
      still = 0.0_wp
      item%has_friction = .true.
      other%has_friction = .true.
      do i = 1, 20
         call shake(x, 0.1_wp)
         x = x + reshape([0.4_wp, 0.5_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.1_wp, 0.8_wp], [2, 4])
         call shake(du, 0.15_wp)
         call polygon_constraint(stencil, x, still, du, 0.0_wp, item)
         mid = x + 0.5_wp*du
         associate (t => item%t(:, :4, 1), at => item%node(:4))
            call check_equal(error, [item%n_slave, at], [2, 1, 4, 2, 3], "its nodes first")
            call check_near(error, [sum(t*du(:, at)), polygon_slip_over(stencil(1), 1.0_wp, x, &
               still, du)], &
               item%slip([1, 1]), 4.0_wp*tol, 1.0_wp, "T.D, and its value")
            call check_near(error, [sum(t(1, :)), sum(t(2, :)), &
               sum(t(2, :)*mid(1, at) - t(1, :)*mid(2, at))], [0.0_wp, 0.0_wp, 0.0_wp], &
               8.0_wp*tol, 1.0_wp, "rigid motions of the middle")
         end associate
         worst = 0.0_wp
         do j = 1, 8
            associate (a => 1 + mod(j - 1, 2), k => 1 + (j - 1)/2)
               do n = 1, 2
                  moved = du
                  moved(a, item%node(k)) = du(a, item%node(k)) + (real(n, wp) - 1.5_wp)*small
                  call polygon_constraint(stencil, x, still, moved, 0.0_wp, other(n))
               end do
               worst = max(worst, abs((other(2)%slip(1) - other(1)%slip(1))/small &
                  - item%t1(a, k, 1)), maxval(abs(reshape((other(2)%t(:, :4, 1) &
                  - other(1)%t(:, :4, 1))/small, [8]) - item%ht(:8, j, 1))))
            end associate
         end do
         call check_true(error, worst < small, "differences: " // to_text(worst))
         if (allocated(error)) return
      end do
      x = reshape([0.5_wp, 0.5_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp, 2.5_wp], [2, 4])
      du = 0.0_wp
      du(1, 1) = 2.0_wp*tan(0.5_wp*turn)*stencil(1)%radius
      du(:, 4) = du(:, 1) + 2.0_wp*[sin(turn), cos(turn) - 1.0_wp]
      call polygon_constraint(stencil, x, still, du, 0.0_wp, item)
      call check_near(error, item%slip(:1), [0.0_wp], tol, 1.0_wp, "it rolls")
   end subroutine test_roll

   !> Points of a slave edge over two master edges: work, rigid motions, differences, and the
   !> middle of an edge that slides as one body.
   subroutine test_points(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(slip_point_t) :: point(3)
      type(condition_t) :: item, other
      real(wp), dimension(2, 5) :: x, u0, du, moved, mid
      real(wp) :: worst
      integer :: i, j, case

      point = [slip_point([1, 2, 3, 4], 0.1_wp, 0.7_wp), slip_point([1, 2, 3, 4], 0.6_wp, 0.4_wp), &
         slip_point([1, 2, 4, 5], 0.9_wp, -0.1_wp)]
      do case = 1, 20
         call shake(x, 0.1_wp)
         x = x + reshape([1.5_wp, 0.1_wp, 0.5_wp, 0.1_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, &
            -0.1_wp], [2, 5])
         call shake(u0, 0.1_wp)
         call shake(du, 0.3_wp)
         call slide(du, item)
         mid = x + u0 + 0.5_wp*du
         associate (t => item%t(:, :5, 1), at => mid(:, item%node(:5)))
            call check_near(error, [sum(t*du(:, item%node(:5))), sum([(slip_over(point(i), x, u0, &
               du), i = 1, 3)])], item%slip([1, 1]), 4.0_wp*tol, 1.0_wp, "T.D, and its value")
            call check_near(error, [sum(t(1, :)), sum(t(2, :)), &
               sum(t(2, :)*at(1, :) - t(1, :)*at(2, :))], [0.0_wp, 0.0_wp, 0.0_wp], 8.0_wp*tol, &
               1.0_wp, "rigid motions of the middle")
         end associate
         worst = 0.0_wp
         do j = 1, 10
            associate (a => 1 + mod(j - 1, 2), k => 1 + (j - 1)/2)
               moved = du
               moved(a, item%node(k)) = du(a, item%node(k)) + small
               call slide(moved, other)
               worst = max(worst, abs((other%slip(1) - item%slip(1))/small - item%t1(a, k, 1)), &
                  maxval(abs(reshape((other%t(:, :5, 1) - item%t(:, :5, 1))/small, [10]) &
                  - item%ht(:10, j, 1))))
            end associate
         end do
         call check_true(error, worst < 100.0_wp*small, "differences: " // to_text(worst))
         if (allocated(error)) return
      end do
      du = 0.0_wp
      x(:, 3:) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, 0.0_wp], [2, 3])
      u0 = 0.0_wp
      du(1, :2) = 0.25_wp
      call slide(du, item)
      call check_near(error, item%slip(:1), [0.25_wp*sum(point%weight)], tol, 1.0_wp, "as one body")

   contains

      !> The condition of all three, which so far is of the first node alone.
      subroutine slide(way, item)
         real(wp), intent(in) :: way(:, :)
         type(condition_t), intent(inout) :: item
         integer :: i

         call condition_resize(item, 1)
         item%node(1) = 1
         do i = 1, 3
            call condition_include(item, point(i)%node)
         end do
         call condition_resize_slip(item)
         do i = 1, 3
            call slip_add(point(i), x, u0, way, item)
         end do
      end subroutine slide

   end subroutine test_points

   !> Along an edge that turns by a right angle meanwhile slip is what an observer on it sees, and
   !> friction pushes against it, along the edge in the middle.
   subroutine test_along(error)
      type(error_t), allocatable, intent(out) :: error
      type(polygon_stencil_t) :: stencil(1)
      type(condition_t) :: item
      real(wp), dimension(2, 3) :: x, du
      integer :: i

      stencil(1)%n = 3
      stencil(1)%node(:3) = [1, 2, 3]
      x = reshape([0.5_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp], [2, 3])
      du = reshape([0.0_wp, 1.25_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp], [2, 3]) - x
      item%has_friction = .true.
      call polygon_constraint(stencil, x, 0.0_wp*x, du, 0.0_wp, item)
      item%response%mu_sigma(1) = -0.25_wp
      call check_near(error, [item%slip(1)], [0.75_wp], tol, 1.0_wp, "seen from the edge")
      call check_near(error, condition_drag(item, 8.0_wp), [-2.0_wp, 0.0_wp], tol, 1.0_wp, &
         "friction")
      call check_near(error, [(condition_force(item, 8.0_wp, 1) - 8.0_wp*item%g(:, 1))], &
         2.0_wp*item%t(:, 1, 1), tol, 1.0_wp, "force against slip")
      call check_true(error, all(item%t(:, 1, 1) > 0.0_wp), "along the edge")
      x = x + spread([3.0_wp, 4.0_wp], 2, 3)
      du = reshape([(0.25_wp, 0.0_wp, i = 1, 3)], [2, 3])
      call polygon_constraint(stencil, x, 0.0_wp*x, du, 0.0_wp, item)
      call check_near(error, [item%slip(1)], [0.0_wp], tol, 1.0_wp, "all move")
   end subroutine test_along

   subroutine test_lemke(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: z(2)
      logical :: is_solved
      integer :: n

      call lemke_solve(reshape([2.0_wp, 1.0_wp, 1.0_wp, 2.0_wp], [2, 2]), [-5.0_wp, -6.0_wp], z, &
         is_solved, n)
      call check_true(error, is_solved, "solved")
      call check_near(error, z, [4.0_wp, 7.0_wp]/3.0_wp, tol, 1.0_wp, "by hand")
      call lemke_solve(reshape([0.0_wp, -1.0_wp, 0.0_wp, -1.0_wp], [2, 2]), [-1.0_wp, -1.0_wp], z, &
         is_solved, n)
      call check_true(error, .not. is_solved, "no solution: a ray")
   end subroutine test_lemke

end module test_friction
