!> Contacts that are linear in their forces, of five kinds: of elastic bodies, with and without a
!> skew part, nearly singular, with rows that follow from others, and of one rigid body; without
!> slips, in the plane and in space, with and without slips that lead somewhere.
module test_contact_problem
   use, intrinsic :: iso_fortran_env, only : output_unit
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : most_slips
   use emcon_contact_path, only : contact_path
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_force, contact_problem_missed, contact_problem_status, contact_problem_t, &
      met
   use emcon_contact_solution, only : contact_problem_pivot, contact_problem_solve
   use emcon_coulomb_law, only : contact_free, contact_open, contact_rests, contact_slides, &
      contact_sticks, contact_trial_t, coulomb_violation, slip_status_t
   use emcon_contact_trials, only : contact_travelling
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_single_contact, only : single_contact_solve, single_contact_t, single_contact_trial
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_contact_problem

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: definite = 1, unsymmetric = 2, nearly = 3, redundant = 4, rigid = 5
   character(len=*), parameter :: kind_name(5) = [character(len=16) :: "definite", "unsymmetric", &
      "nearly singular", "redundant", "one rigid body"]
   !> Of a thousand.
   integer, parameter :: most_missed(5) = [0, 0, 5, 1, 1]

contains

   subroutine collect_contact_problem(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("one contact by hand", test_by_hand), &
         test_case_t("one contact at random: the law is met", test_one), &
         test_case_t("the plane is space with one slip held", test_plane_in_space), &
         test_case_t("frames that are turned", test_turned), &
         test_case_t("the only one of all sets that obeys the law", test_all_sets), &
         test_case_t("by pivots as by trials", test_pivots), &
         test_case_t("one body led to slips that differ", test_led_apart), &
         test_case_t("what has no solution is told", test_no_solution), &
         test_case_t("held as W is found: the same forces", test_held), &
         test_case_t("by pivots as if nothing held them", test_held_pivots), &
         test_case_t("a body that its contacts alone hold", test_alone), &
         test_case_t("the same at random, with and without friction", test_at_rest), &
         test_case_t("random problems of all kinds", test_kinds), &
         test_case_t("shares of one body that have far to go", test_shares), &
         test_case_t("a row of rigid bodies by the central path", test_row), &
         test_case_t("rows that miss each other by round-off", test_travel)]
   end subroutine collect_contact_problem

   !> Two units of compliance along the normal, one along the slip; gap -2 without forces: lam = 1.
   subroutine test_by_hand(error)
      type(error_t), allocatable, intent(out) :: error

      call check_one(error, 0.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, "at rest")
      call check_one(error, 0.25_wp, 0.0_wp, 0.5_wp, 0.25_wp, "sticks")
      call check_one(error, 2.0_wp, 0.0_wp, 0.5_wp, 0.5_wp, "slides")
      call check_one(error, -2.0_wp, 0.0_wp, 0.5_wp, -0.5_wp, "slides back")
      call check_one(error, 2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, "without friction")
      call check_one(error, 1.0_wp, 0.75_wp, 0.5_wp, 0.25_wp, "sticks where slip leads to")
      call check_one(error, 2.0_wp, 0.75_wp, 0.5_wp, 0.5_wp, "slides past that")
      call check_one(error, 0.5_wp, 0.75_wp, 0.5_wp, 0.0_wp, "free on the way")
      call check_one(error, -0.25_wp, 0.75_wp, 0.5_wp, -0.25_wp, "rests")
      call check_one(error, -2.0_wp, 0.75_wp, 0.5_wp, -0.5_wp, "slides from there")
      call check_held(error)
   end subroutine test_by_hand

   !> What no force moves along the surface: friction is 0, or against a slip that is given.
   subroutine check_held(error)
      type(error_t), allocatable, intent(inout) :: error
      type(single_contact_t) :: place
      real(wp), parameter :: slip(2) = [0.3_wp, 0.4_wp]
      real(wp) :: force(0:most_slips)

      place%n_slip = 2
      place%w(0, 0) = 2.0_wp
      place%mu = 0.5_wp
      place%free(0) = -2.0_wp
      force = single_contact_solve(place)
      call check_near(error, force, [1.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "held, no slip")
      place%free(1:) = -slip
      force = single_contact_solve(place)
      call check_near(error, force, [1.0_wp, 0.3_wp, 0.4_wp], 8.0_wp*epsilon(1.0_wp), 1.0_wp, &
         "held, slips")
   end subroutine check_held

   !> Slip `slip` without forces, that leads to `lead`, takes friction `tau`.
   subroutine check_one(error, slip, lead, mu, tau, name)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: slip, lead, mu, tau
      character(len=*), intent(in) :: name
      type(single_contact_t) :: place
      integer :: n_slip

      do n_slip = 1, 2
         place = single_contact_t()
         place%n_slip = n_slip
         place%w(0, 0) = 2.0_wp
         place%w(1, 1) = 1.0_wp
         place%w(2, 2) = 1.0_wp
         place%free = [-2.0_wp, 0.0_wp, 0.0_wp]
         place%free(n_slip) = -slip
         place%slip_target(n_slip) = lead
         place%mu = mu
         call check_near(error, single_contact_solve(place), [1.0_wp, merge(tau, 0.0_wp, &
            n_slip == 1), merge(tau, 0.0_wp, n_slip == 2)], 8.0_wp*epsilon(1.0_wp), 1.0_wp, name)
      end do
      place%free(0) = 0.5_wp
      call check_near(error, single_contact_solve(place), spread(0.0_wp, 1, 3), 0.0_wp, 1.0_wp, &
         name // ", open")
   end subroutine check_one

   !> Any coefficient, coupling and target: the law by what the forces lead to.
   subroutine test_one(error)
      type(error_t), allocatable, intent(out) :: error
      type(single_contact_t) :: place
      real(wp) :: a(0:2, 0:2), u(7), force(0:most_slips), missed
      integer :: i, k

      do i = 1, 2000
         place = single_contact_t()
         place%n_slip = mod(i, 3)
         call draw_normal(a)
         call draw_random(u)
         associate (s => place%n_slip)
            place%w(:s, :s) = matmul(a(:s, :), transpose(a(:s, :)))
            do k = 0, s
               place%w(k, k) = place%w(k, k) + 0.05_wp
            end do
            place%free(:s) = 2.0_wp*u(:1 + s) - 1.0_wp
            if (mod(i, 2) == 0) place%slip_target(:s) = u(4:3 + s) - 0.5_wp
         end associate
         place%mu = 2.0_wp*u(7)
         place%stiffness = 1.0_wp/place%w(0, 0)
         force = single_contact_solve(place)
         missed = coulomb_violation(single_contact_trial(place, force), place%mu, place%stiffness)
         ! Of a solve with W, whose condition is below some 1e3.
         call check_true(error, missed <= 1.0e4_wp*epsilon(1.0_wp)*max(1.0_wp, force(0)), &
            "case " // to_text(i) // ": missed by " // to_text(missed, 3))
      end do
   end subroutine test_one

   !> A second slip that moves nothing else changes nothing, and needs not even move by itself.
   subroutine test_plane_in_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: plane, space
      type(contact_effort_t) :: effort
      real(wp), allocatable :: in_plane(:, :), in_space(:, :)
      integer, allocatable :: kept(:)
      integer :: i, k, n
      logical :: is_solved

      do i = 1, 50
         call make_problem(plane, 1, merge(definite, unsymmetric, mod(i, 2) == 0), mod(i, 3) == 0)
         n = size(plane%mu)
         plane%mu = 0.3_wp*plane%mu
         call contact_problem_create(space, 2, n)
         kept = [(3*(k - 1) + [1, 2], k = 1, n)]
         do k = 1, n
            space%w(3*k, 3*k) = real(mod(i/2, 2), wp)
         end do
         space%w(kept, kept) = plane%w
         space%free(:1, :) = plane%free
         space%slip_target(1, :) = plane%slip_target(1, :)
         space%mu = plane%mu
         call solve(plane, in_plane, effort, is_solved)
         call check_true(error, is_solved, "plane")
         call solve(space, in_space, effort, is_solved)
         call check_true(error, is_solved, "space")
         if (allocated(error)) return
         call check_near(error, in_space(:1, :), in_plane, 1.0e6_wp*eps, maxval(in_plane), "forces")
         call check_near(error, in_space(2, :), 0.0_wp*in_space(2, :), 1.0e6_wp*eps, &
            maxval(in_plane), "nothing across")
      end do
   end subroutine test_plane_in_space

   !> Tangents that are turned turn friction with them.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: turn(:, :), force(:, :), turned(:, :)
      real(wp) :: angle
      integer :: i, k, n
      logical :: is_solved

      do i = 1, 50
         call make_problem(problem, 2, merge(definite, unsymmetric, mod(i, 2) == 0), mod(i, 3) == 0)
         problem%mu = 0.3_wp*problem%mu
         n = size(problem%mu)
         if (allocated(turn)) deallocate(turn)
         allocate(turn(3*n, 3*n), source=0.0_wp)
         call solve(problem, force, effort, is_solved)
         call check_true(error, is_solved, "as drawn")
         if (allocated(error)) return
         do k = 1, n
            call draw_random(angle)
            angle = 8.0_wp*angle
            turn(3*k - 2, 3*k - 2) = 1.0_wp
            turn(3*k - 1:3*k, 3*k - 1) = [cos(angle), sin(angle)]
            turn(3*k - 1:3*k, 3*k) = [-sin(angle), cos(angle)]
            problem%slip_target(:, k) = matmul(turn(3*k - 1:3*k, 3*k - 1:3*k), &
               problem%slip_target(:, k))
         end do
         problem%w = matmul(turn, matmul(problem%w, transpose(turn)))
         problem%free = reshape(matmul(turn, reshape(problem%free, [3*n])), [3, n])
         call solve(problem, turned, effort, is_solved)
         call check_true(error, is_solved, "turned")
         if (allocated(error)) return
         call check_near(error, reshape(turned, [3*n]), matmul(turn, reshape(force, [3*n])), &
            1.0e6_wp*eps, maxval(abs(force)), "forces")
      end do
   end subroutine test_turned

   !> A rigid square plate on its corners, which friction strains, and which slip a little each by
   !> itself, as no rigid motion does: friction goes round as far as it may. Trials end before that.
   subroutine test_shares(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.3_wp, apart = 1.0e-5_wp
      real(wp), parameter :: corner(2, 4) = reshape([1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, &
         -1.0_wp, 1.0_wp, -1.0_wp], [2, 4])
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp) :: rows(12, 6), push(0:2, 4), u(8)
      integer :: i, k, n_path
      logical :: is_solved

      rows = 0.0_wp
      do k = 1, 4
         associate (row => 3*(k - 1) + 1, x => corner(1, k), y => corner(2, k))
            rows(row, [1, 4, 5]) = [1.0_wp, x, y]
            rows(row + 1, [2, 6]) = [1.0_wp, -y]
            rows(row + 2, [3, 6]) = [1.0_wp, x]
         end associate
      end do
      n_path = 0
      do i = 1, 20
         call contact_problem_create(problem, 2, 4)
         problem%w = matmul(rows, transpose(rows))
         problem%mu = mu
         call draw_random(u)
         problem%base(0, :) = 1.0_wp
         do k = 1, 4
            problem%base(1:, k) = (-1.0_wp)**k*0.2_wp*corner(:, k)/sqrt(2.0_wp)
         end do
         problem%free(1:, :) = apart*(reshape(u, [2, 4]) - 0.5_wp)
         push = 0.0_wp
         call contact_problem_solve(problem, push, effort, is_solved)
         call check_true(error, is_solved, "solved")
         call check_true(error, contact_problem_missed(problem, push) <= met, "law")
         if (allocated(error)) return
         n_path = n_path + merge(1, 0, effort%n_path > 0)
      end do
      call check_true(error, n_path > 10, "by a path")
   end subroutine test_shares

   !> Rigid bodies in a row, each on the one before by four corners, the first one on a floor:
   !> twelve forces hold six motions. They come with velocities of all sizes, and some are led to a
   !> stop. By the path alone, whose end no trial is near; forces are judged by the law of each
   !> contact.
   subroutine test_row(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_body = 5, n = 4*n_body
      type(contact_problem_t) :: problem
      real(wp) :: push(0:2, n), u(6, n_body), rows(3*n, 6*n_body)
      integer :: i, n_step, n_trial, n_solved
      logical :: is_solved

      n_solved = 0
      do i = 1, 40
         call draw_row(rows)
         call contact_problem_create(problem, 2, n)
         problem%w = matmul(rows, transpose(rows))
         problem%mu = 0.3_wp
         call draw_random(u)
         problem%free = reshape(matmul(rows, reshape((u - 0.5_wp)*spread(10.0_wp**[(-2*n_step, &
            n_step=1, n_body)], 1, 6), [6*n_body])), [3, n])
         problem%base(0, :) = 1.0_wp
         if (mod(i, 2) == 0) problem%slip_target(:, ::4) = 0.5_wp*problem%free(1:, ::4)
         push = 0.0_wp
         n_step = 0
         n_trial = 0
         call contact_path(problem, push, n_step, n_trial, is_solved)
         n_solved = n_solved + merge(1, 0, is_solved)
         if (is_solved) call check_true(error, contact_problem_missed(problem, push) <= met, "law")
         if (is_solved .and. mod(i, 2) == 1) call check_each(error, problem, push)
         if (allocated(error)) return
      end do
      call check_true(error, n_solved >= 39, "solved: " // to_text(n_solved))
   end subroutine test_row

   !> The same bodies, whose corners miss each other by round-off of what is not linear, as gaps and
   !> slips of a step do: some corners come to carry nothing, however much they carried before.
   subroutine test_travel(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_body = 5, n = 4*n_body
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp) :: push(0:2, n), u(6, n_body), rows(3*n, 6*n_body), off(0:2, n)
      integer :: i, k
      logical :: is_solved

      do i = 1, 40
         call draw_row(rows)
         call contact_problem_create(problem, 2, n)
         problem%w = matmul(rows, transpose(rows))
         problem%mu = 0.3_wp
         call draw_random(u)
         u(3:5, :) = 0.5_wp
         call draw_random(off)
         problem%free = 1.0e-10_wp*(off - 0.5_wp) + reshape(matmul(rows, reshape((u - 0.5_wp) &
            *spread(10.0_wp**[(-2*k, k=1, n_body)], 1, 6), [6*n_body])), [3, n])
         problem%base(0, :) = 1.0_wp
         push = 0.0_wp
         effort = contact_effort_t()
         call contact_travelling(problem, push, effort, is_solved)
         call check_true(error, is_solved, "solved: " // to_text(i))
         if (allocated(error)) return
         call check_each(error, problem, push)
         if (allocated(error)) return
      end do
   end subroutine test_travel

   !> No contact pulls or is closed, none pushes where it is open, friction is within its limit, and
   !> at that against slip where there is slip: products of forces and motions by stiffnesses, but
   !> for what sums of W round.
   subroutine check_each(error, problem, push)
      type(error_t), allocatable, intent(inout) :: error
      type(contact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: push(0:, :)
      real(wp), dimension(0:2, size(problem%mu)) :: force, motion
      real(wp) :: largest, slip, moved(0:2, size(problem%mu)), off
      integer :: i, k

      moved = abs(problem%free) + reshape(matmul(abs(problem%w), &
         reshape(abs(push), [size(push)])), shape(push))
      force = problem%base + push
      motion = problem%free + reshape(matmul(problem%w, reshape(push, [size(push)])), shape(push))
      largest = maxval(abs(force))
      do i = 1, size(problem%mu)
         associate (lam => force(0, i), gap => motion(0, i), tau => force(1:, i), &
               stiffness => 3.0_wp/sum([(problem%w(k, k), k = 3*i - 2, 3*i)]))
            motion(:, i) = stiffness*motion(:, i)
            slip = norm2(motion(1:, i))
            off = met*largest + 16.0_wp*eps*stiffness*maxval(moved(:, i))
            call check_true(error, min(lam, gap) >= -off .and. min(lam, gap) <= off, "push")
            ! The law may be missed by `off` in the force that makes the limit and in both of friction.
            call check_true(error, norm2(tau) <= 0.3_wp*(lam + off) + sqrt(2.0_wp)*off, "limit")
            call check_true(error, 0.3_wp*lam*slip + dot_product(tau, motion(1:, i)) &
               <= off*(slip + largest), "against slip")
         end associate
      end do
   end subroutine check_each

   !> Gaps and slips of the corners by the motions of the bodies, turned a little from each other.
   subroutine draw_row(rows)
      real(wp), intent(out) :: rows(:, :)
      real(wp) :: u(3), x(3), at(3, 3)
      integer :: body, corner, k, first

      rows = 0.0_wp
      do body = 1, size(rows, 2)/6
         call draw_random(u)
         do corner = 1, 4
            x = [real(2*mod(corner, 2) - 1, wp), real(2*(corner/3) - 1, wp), 0.0_wp]
            at = reshape([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, &
               0.0_wp], [3, 3])
            at(:, 1) = at(:, 1) + 0.3_wp*(u(1) - 0.5_wp)*at(:, 3)
            at(:, 3) = at(:, 3) + 0.3_wp*(u(2) - 0.5_wp)*at(:, 2)
            first = 3*(4*(body - 1) + corner - 1)
            do k = 1, 3
               associate (row => rows(first + k, :), d => at(k, :))
                  call add_motion(row(6*body - 5:6*body), d, x, 1.0_wp)
                  if (body > 1) call add_motion(row(6*body - 11:6*body - 6), d, x &
                     + [0.0_wp, 0.0_wp, 1.0_wp + u(3)], -1.0_wp)
               end associate
            end do
         end do
      end do
   end subroutine draw_row

   !> How a point of a rigid body moves along d, by its translation and its turn.
   pure subroutine add_motion(row, d, x, factor)
      real(wp), intent(inout) :: row(6)
      real(wp), intent(in) :: d(3), x(3), factor

      row(:3) = row(:3) + factor*d
      row(4:) = row(4:) + factor*[x(2)*d(3) - x(3)*d(2), x(3)*d(1) - x(1)*d(3), &
         x(1)*d(2) - x(2)*d(1)]
   end subroutine add_motion

   !> Two contacts each of which closes the other by more than itself opens, without friction or
   !> beside it; one whose friction closes it so; and what nothing moves: all are closed by 1
   !> without forces, and there is no solution.
   subroutine test_no_solution(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: force(:, :)
      integer :: n_slip, k, s
      logical :: is_solved

      do n_slip = 0, 2
         do k = 1, merge(2, 3, n_slip == 0)
            call contact_problem_create(problem, n_slip, 2)
            problem%free(0, :) = -1.0_wp
            problem%mu = 0.5_wp
            do s = 1, size(problem%w, 1)
               problem%w(s, s) = 1.0_wp
            end do
            associate (m => 1 + n_slip)
               if (k == 1) problem%w([1, 1 + m], [1 + m, 1]) = reshape([-2.0_wp, 1.0_wp, 1.0_wp, &
                  -2.0_wp], [2, 2])
               if (k == 2) problem%w([1, 1 + m], [1, 1 + m]) = 0.0_wp
               if (k == 3) problem%w([1, 2], [2, 1]) = reshape([5.0_wp, 1.0_wp, 1.0_wp, 5.0_wp], &
                  [2, 2])
            end associate
            call solve(problem, force, effort, is_solved)
            associate (what => to_text(n_slip) // " slips, case " // to_text(k))
               call check_true(error, .not. is_solved, what)
               call check_true(error, (effort%n_sweep > 0) .neqv. k == 2, what // ": sweeps")
               call check_true(error, (effort%n_pivot > 0) .eqv. (n_slip == 1 .and. k /= 2), &
                  what // ": pivots")
            end associate
         end do
      end do
   end subroutine test_no_solution

   !> A rigid square on two corners one of which stops a little earlier: it takes all of the
   !> friction, the other one is free on its way, and none pushes against where it slides to.
   subroutine test_led_apart(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: turn = 6.0_wp, pushes(4) = [4.0_wp, -0.25_wp, 4.0_wp, 0.0_wp], &
         rows(4, 3) = reshape([0.0_wp, -1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
         -0.5_wp, -0.5_wp, 0.5_wp, -0.5_wp], [4, 3])
      real(wp), parameter :: apart(3) = [1.0e-3_wp, 1.0e-6_wp, 1.0e-9_wp]
      type(contact_problem_t) :: problem, held
      type(contact_effort_t) :: effort
      real(wp) :: force(0:1, 2)
      integer :: k
      logical :: is_solved

      do k = 1, size(apart)
         call contact_problem_create(problem, 1, 2)
         problem%w = matmul(rows(:, :2), transpose(rows(:, :2))) &
            + turn*spread(rows(:, 3), 2, 4)*spread(rows(:, 3), 1, 4)
         problem%mu = [0.4_wp, 1.0_wp]
         problem%slip_target(1, :) = -[1.0_wp, 1.0_wp + apart(k)]
         problem%free = reshape([0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp] - matmul(problem%w, pushes), [2, &
            2])
         force = 0.0_wp
         call contact_problem_solve(problem, force, effort, is_solved)
         call check_true(error, is_solved, "solved")
         call check_near(error, force, reshape(pushes, [2, 2]), 1.0e6_wp*eps, 4.0_wp, "forces")
         call hold_all(problem, reshape(1.0_wp + abs(normals(4)), [2, 2]), held)
         force = 0.0_wp
         call contact_problem_solve(held, force, effort, is_solved)
         call check_true(error, is_solved, "solved as it is held")
         call check_near(error, contact_problem_force(held, force), reshape(pushes, [2, 2]), &
            1.0e6_wp*eps, 4.0_wp, "forces as it is held")
      end do
   end subroutine test_led_apart

   !> Small coefficients: there is one solution. Pivots take slips from what they lead to.
   subroutine test_pivots(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: force(:, :), pivoted(:, :)
      integer :: i, n_pivot
      logical :: is_solved

      do i = 1, 40
         call make_problem(problem, 1, merge(definite, unsymmetric, mod(i, 2) == 0), .false.)
         problem%mu = 0.2_wp*problem%mu
         problem%w = 4.0_wp**mod(i, 5)*problem%w
         call solve(problem, force, effort, is_solved)
         call check_true(error, is_solved, "by trials")
         if (allocated(error)) return
         allocate(pivoted, source=-1.0_wp - force)
         call contact_problem_pivot(problem, pivoted, n_pivot, is_solved)
         call check_true(error, is_solved .and. n_pivot > 0, "by pivots")
         call check_near(error, pivoted, force, 1.0e6_wp*eps, maxval(abs(force)) &
            + maxval(abs(problem%free))/maxval(abs(problem%w)), "forces")
         deallocate(pivoted)
      end do
   end subroutine test_pivots

   !> In the plane each contact is open, sticks or slides to either side: of all 4^n sets those that
   !> obey the law are looked for by another way, a linear solve of each. With small coefficients
   !> there is one.
   subroutine test_all_sets(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      type(slip_status_t), allocatable :: status(:)
      real(wp), allocatable :: force(:, :), expected(:, :)
      integer :: i, k, n, set, n_found, code
      logical :: is_solved, obeys

      do i = 1, 100
         call make_problem(problem, 1, definite, .false., 1 + mod(i, 4))
         problem%mu = 0.2_wp*problem%mu
         n = size(problem%mu)
         call solve(problem, force, effort, is_solved)
         call check_true(error, is_solved, "solved")
         if (allocated(error)) return
         n_found = 0
         do set = 0, 4**n - 1
            call solve_in_set(problem, set, expected, obeys)
            if (.not. obeys) cycle
            n_found = n_found + 1
            call check_near(error, force, expected, 1.0e6_wp*eps, maxval(abs(expected)), "forces")
            status = contact_problem_status(problem, force)
            do k = 1, n
               code = mod(set/4**(k - 1), 4)
               call check_equal(error, status(k)%kind, merge(contact_open, merge(contact_sticks, &
                  contact_slides, code == 1), code == 0), "status")
            end do
         end do
         call check_equal(error, n_found, 1, "solutions of case " // to_text(i))
      end do
   end subroutine test_all_sets

   !> Forces where contact k is as digit k of `set` to the base 4 says: open, sticks, slides on,
   !> slides back.
   subroutine solve_in_set(problem, set, force, obeys)
      type(contact_problem_t), intent(in) :: problem
      integer, intent(in) :: set
      real(wp), allocatable, intent(out) :: force(:, :)
      logical, intent(out) :: obeys
      real(dp), dimension(size(problem%w, 1), size(problem%w, 1)) :: a
      real(dp), dimension(size(problem%w, 1), 1) :: b, x
      real(wp) :: motion(0:1, size(problem%mu)), side
      integer :: i, n, code
      logical :: is_singular

      n = size(problem%mu)
      a = real(problem%w, dp)
      b(:, 1) = real(reshape(-problem%free, [2*n]), dp)
      do i = 1, n
         code = mod(set/4**(i - 1), 4)
         if (code == 0) call put(2*i - 1, 0.0_wp)
         if (code /= 1) call put(2*i, merge(0.0_wp, real(5 - 2*code, wp)*problem%mu(i), code == 0))
      end do
      call dense_solve(a, b, x, is_singular)
      force = reshape(real(x(:, 1), wp), [2, n])
      motion = problem%free + reshape(matmul(problem%w, reshape(force, [2*n])), [2, n])
      obeys = .not. is_singular
      do i = 1, n
         code = mod(set/4**(i - 1), 4)
         side = real(5 - 2*code, wp)
         if (code == 0) obeys = obeys .and. motion(0, i) >= 0.0_wp
         if (code > 0) obeys = obeys .and. force(1, i) >= 0.0_wp
         if (code == 1) obeys = obeys .and. abs(force(2, i)) <= problem%mu(i)*force(1, i)
         if (code > 1) obeys = obeys .and. -side*motion(1, i) >= 0.0_wp
      end do

   contains

      !> Row `k` says that force `k` is `part` of the push before it.
      subroutine put(k, part)
         integer, intent(in) :: k
         real(wp), intent(in) :: part

         a(k, :) = 0.0_dp
         a(k, k) = 1.0_dp
         if (mod(k, 2) == 0) a(k, k - 1) = -real(part, dp)
         b(k, 1) = 0.0_dp
      end subroutine put

   end subroutine solve_in_set

   !> All that are well posed are solved, and of the others at most one of a thousand is not, of
   !> those that are nearly singular five; the law is met by each solution as it was asked for.
   !> EMCON_TEST_CASES: how many of a kind.
   subroutine test_kinds(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: force(:, :)
      integer :: n_case, n_slip, kind, lead, i, n_missed, n_turned, n_trial
      real(wp) :: worst
      logical :: is_solved

      n_case = asked_cases(60)
      do n_slip = 0, 2
         do kind = definite, rigid
            do lead = 0, min(n_slip, 1)
               n_missed = 0
               n_turned = 0
               n_trial = 0
               worst = 0.0_wp
               do i = 1, n_case
                  call make_problem(problem, n_slip, kind, lead == 1)
                  call solve(problem, force, effort, is_solved)
                  n_trial = n_trial + effort%n_trial
                  if (effort%n_sweep > 0) n_turned = n_turned + 1
                  if (.not. is_solved) then
                     n_missed = n_missed + 1
                  else if (effort%n_pivot == 0) then
                     worst = max(worst, contact_problem_missed(problem, force))
                  end if
               end do
               if (n_case > 1000) write(output_unit, "(a)") "   " // to_text(n_slip) // " slips, " &
                  // trim(kind_name(kind)) // trim(merge(", targets", "         ", lead == 1)) &
                  // ": " // to_text(n_missed) // " of " // to_text(n_case) // " not solved, " &
                  // to_text(n_turned) // " not by trials alone, " &
                  // to_text(real(n_trial, wp)/n_case, 2) // " trials each, law missed by " &
                  // to_text(worst, 2)
               call check_true(error, worst < 1.0e6_wp*eps, "law: " // trim(kind_name(kind)))
               call check_true(error, n_missed <= (n_case*most_missed(kind))/1000, &
                  "solved: " // trim(kind_name(kind)))
               call check_true(error, n_turned <= n_case/4, "by trials: " // trim(kind_name(kind)))
            end do
         end do
      end do
   end subroutine test_kinds

   !> With c G^T G in the tangent W becomes (1 + W c)^-1 W: where W is definite and mu small the
   !> forces are the same ones, in the plane by pivots too.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem, held
      type(contact_effort_t) :: effort
      real(wp), allocatable :: push(:, :), force(:, :)
      logical :: is_solved
      integer :: case, n_slip, m

      do case = 1, 200
         n_slip = modulo(case, 3)
         call make_problem(problem, n_slip, definite, leads=mod(case, 2) == 0)
         problem%mu = 0.1_wp*problem%mu
         m = size(problem%free)
         problem%base = reshape(normals(m), shape(problem%free))
         call solve(problem, push, effort, is_solved)
         call check_true(error, is_solved, "solved as it is")
         if (allocated(error)) return
         force = contact_problem_force(problem, push)
         call hold_all(problem, reshape(abs(normals(m)), shape(problem%hold)), held)
         call solve(held, push, effort, is_solved)
         call check_true(error, is_solved, "solved as it is held")
         if (.not. allocated(error)) call check_near(error, reshape(contact_problem_force(held, &
            push), [m]), reshape(force, [m]), 1.0e6_wp*eps, maxval(abs(held%base) + abs(push)), &
            "forces")
         if (allocated(error)) return
      end do
   end subroutine test_held

   !> Large coefficients, few contacts: of what neither trials nor sweeps solve as it is held pivots
   !> solve some as if it were not, so that it obeys the law as it is held.
   subroutine test_held_pivots(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem, held
      type(contact_effort_t) :: effort
      real(wp), allocatable :: push(:, :)
      logical :: is_solved
      integer :: i, n_pivoted

      n_pivoted = 0
      do i = 1, 1200
         call make_problem(problem, 1, rigid, mod(i, 2) == 0, asked=2 + mod(i, 3))
         problem%mu = 2.0_wp*problem%mu
         call solve(problem, push, effort, is_solved)
         if (.not. is_solved) cycle
         call hold_all(problem, 10.0_wp**mod(i, 4)*reshape(abs(normals(size(problem%hold))), &
            shape(problem%hold)), held)
         call solve(held, push, effort, is_solved)
         if (effort%n_pivot == 0 .or. .not. is_solved) cycle
         n_pivoted = n_pivoted + 1
         call check_true(error, contact_problem_missed(held, push) <= 1.0e6_wp*eps, "law of case " &
            // to_text(i))
         if (allocated(error) .or. n_pivoted > 2) return
      end do
      call check_true(error, .false., to_text(n_pivoted) // " by pivots")
   end subroutine test_held_pivots

   !> The same problem with c and a start to count from.
   subroutine hold_all(problem, hold, held)
      type(contact_problem_t), intent(in) :: problem
      real(wp), intent(in) :: hold(:, :)             !! of the shape of `problem%hold`
      type(contact_problem_t), intent(out) :: held
      real(dp), dimension(size(hold), size(hold)) :: unit, gain
      logical :: is_singular
      integer :: k, m

      m = size(hold)
      held = problem
      held%hold(:, :) = hold
      held%start = reshape(normals(m), shape(held%start))
      unit = 0.0_dp
      do k = 1, m
         unit(k, k) = 1.0_dp
      end do
      call dense_solve(unit + real(problem%w*spread(reshape(hold, [m]), 1, m), dp), unit, gain, &
         is_singular)
      held%w = real(matmul(gain, real(problem%w, dp)), wp)
      held%free = held%start + reshape(real(matmul(gain, reshape(real(problem%free - held%start, &
         dp), [m])), wp), shape(held%free))
   end subroutine hold_all

   !> Two contacts under a body of weight 1 that nothing else holds, at 1 and 3 from its center on
   !> both sides: 3/4 and 1/4, and where it stands on one alone, that is under its center, all.
   subroutine test_alone(error)
      type(error_t), allocatable, intent(out) :: error

      call check_alone(error, [-1.0_wp, 3.0_wp], [0.75_wp, 0.25_wp])
      call check_alone(error, [0.0_wp, 2.0_wp], [1.0_wp, 0.0_wp])
   end subroutine test_alone

   !> A rigid body rests on contacts under a load that some pushes at them balance, which is all
   !> that is known of it: what is found balances the load, too, and obeys the law without any
   !> motion.
   subroutine test_at_rest(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: rows(:, :), push(:, :), known(:, :), force(:, :)
      real(dp), allocatable :: motion(:, :)
      real(wp), allocatable :: load(:)
      integer :: i, k, n, n_slip, rank
      logical :: is_solved, is_singular

      do i = 1, 200
         n_slip = mod(i, 3)
         rank = merge(6, 3, n_slip == 2)
         n = 5 + mod(i, 3)
         call contact_problem_create(problem, n_slip, n)
         allocate(rows((1 + n_slip)*n, rank), motion(rank, 1 + (1 + n_slip)*n), known(0:n_slip, n))
         call make_rigid(rows, n_slip, n)
         call draw_random(problem%mu)
         call draw_random(known)
         known(1:, :) = (1.2_wp*known(1:, :) - 0.6_wp)*spread(problem%mu*known(0, :), 1, n_slip)
         where (spread(mod([(k, k = 1, n)], 3) == 0, 1, 1 + n_slip)) known = 0.0_wp
         load = matmul(reshape(known, [size(known)]), rows)
         problem%hold = 1.0_wp
         call dense_solve(real(matmul(transpose(rows), rows), dp), real(reshape([-load, &
            transpose(rows)], shape(motion)), dp), motion, is_singular)
         problem%free = reshape(matmul(rows, real(motion(:, 1), wp)), shape(problem%free))
         problem%w = matmul(rows, real(motion(:, 2:), wp))
         call solve(problem, push, effort, is_solved)
         call check_true(error, is_solved, "case " // to_text(i))
         force = contact_problem_force(problem, push)
         associate (scale => maxval(abs(push)) + maxval(abs(load)))
            call check_near(error, matmul(reshape(force, [size(force)]), rows), load, &
               1.0e6_wp*eps, &
               scale, "balance of case " // to_text(i))
            call check_true(error, all(norm2(force(2:, :), 1) <= problem%mu*force(1, :) &
               + 1.0e6_wp*eps*scale), "friction of case " // to_text(i))
         end associate
         call check_true(error, contact_problem_missed(problem, push) <= 1.0e6_wp*eps, &
            "law of case " // to_text(i))
         if (allocated(error)) return
         deallocate(rows, motion, known)
      end do
   end subroutine test_at_rest

   subroutine check_alone(error, at, expected)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: at(2)              !! places along the body
      real(wp), intent(in) :: expected(2)
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: push(:, :)
      real(dp) :: g(2, 2), tangent(2, 2), motion(2, 3)
      logical :: is_solved, is_singular

      if (allocated(error)) return
      call contact_problem_create(problem, 0, 2)
      problem%hold = 1.0_wp
      ! Up and round: gaps gain up + at*round, and the tangent is that of what holds.
      g = reshape([1.0_dp, 1.0_dp, real(at, dp)], [2, 2])
      tangent = matmul(transpose(g), g)
      call dense_solve(tangent, reshape([-1.0_dp, 0.0_dp, transpose(g)], [2, 3]), motion, &
         is_singular)
      problem%free(0, :) = real(matmul(g, motion(:, 1)), wp)
      problem%w = real(matmul(g, motion(:, 2:)), wp)
      call solve(problem, push, effort, is_solved)
      call check_true(error, is_solved, "solved")
      if (.not. allocated(error)) call check_near(error, reshape(contact_problem_force(problem, &
         push), [2]), expected, 1.0e4_wp*eps, 1.0_wp, "forces")
   end subroutine check_alone

   integer function asked_cases(otherwise) result(n)
      integer, intent(in) :: otherwise
      character(len=12) :: text
      integer :: status

      call get_environment_variable("EMCON_TEST_CASES", text, status=status)
      n = otherwise
      if (status == 0) read(text, *) n
   end function asked_cases

   !> From forces of 0.
   subroutine solve(problem, force, effort, is_solved)
      type(contact_problem_t), intent(in) :: problem
      real(wp), allocatable, intent(out) :: force(:, :)
      type(contact_effort_t), intent(out) :: effort
      logical, intent(out) :: is_solved

      allocate(force(0:problem%n_slip, size(problem%mu)), source=0.0_wp)
      call contact_problem_solve(problem, force, effort, is_solved)
   end subroutine solve

   !> 1 to 12 contacts, or `asked`, with coefficients up to 1.
   subroutine make_problem(problem, n_slip, kind, leads, asked)
      type(contact_problem_t), intent(out) :: problem
      integer, intent(in) :: n_slip, kind
      logical, intent(in) :: leads                   !! slips have targets
      integer, intent(in), optional :: asked
      real(wp), allocatable :: a(:, :), skew(:, :)
      real(wp) :: u
      integer :: n, m, i, rank

      call draw_random(u)
      n = 1 + min(11, int(12.0_wp*u))
      if (present(asked)) n = asked
      m = (1 + n_slip)*n
      call contact_problem_create(problem, n_slip, n)
      rank = m
      if (kind == nearly) rank = max(1, m - 2)
      if (kind == redundant) rank = max(2, m/2)
      if (kind == rigid) rank = merge(6, 3, n_slip == 2)
      allocate(a(m, rank), skew(m, m))
      call draw_normal(a)
      if (kind == rigid) call make_rigid(a, n_slip, n)
      problem%w = matmul(a, transpose(a))/merge(1, m, kind == rigid)
      do i = 1, m
         if (kind <= unsymmetric) problem%w(i, i) = problem%w(i, i) + 0.05_wp
         if (kind == nearly) problem%w(i, i) = problem%w(i, i) + 5.0e5_wp*eps
      end do
      if (kind == unsymmetric) then
         call draw_normal(skew)
         problem%w = problem%w + 0.05_wp/sqrt(real(m, wp))*(skew - transpose(skew))
      end if
      problem%free = reshape(normals(m), shape(problem%free))
      ! Some motion opens all: it is none of a wedge.
      if (kind > unsymmetric) problem%free = reshape(matmul(a, normals(rank)), shape(problem%free))
      call draw_random(problem%mu)
      if (leads) problem%slip_target = reshape(normals(n_slip*n), shape(problem%slip_target))
   end subroutine make_problem

   !> Rows of normals and tangents of random places of a body of mass and inertia 1.
   subroutine make_rigid(a, n_slip, n)
      real(wp), intent(inout) :: a(:, :)             !! ((1 + n_slip) n, 3 in the plane, 6 in space)
      integer, intent(in) :: n_slip, n
      real(wp) :: frame(3, 0:2), place(3), arm(3)
      integer :: i, k
      logical :: is_plane

      is_plane = n_slip < 2
      do i = 1, n
         place = normals(3)
         frame(:, 0) = normals(3)
         if (is_plane) place(3) = 0.0_wp
         if (is_plane) frame(3, 0) = 0.0_wp
         frame(:, 0) = frame(:, 0)/norm2(frame(:, 0))
         frame(:, 2) = [0.0_wp, 0.0_wp, 1.0_wp]
         frame(:, 1) = cross(frame(:, 2), frame(:, 0))
         frame(:, 1) = frame(:, 1)/norm2(frame(:, 1))
         frame(:, 2) = cross(frame(:, 0), frame(:, 1))
         do k = 0, n_slip
            arm = cross(place, frame(:, k))
            if (is_plane) a((1 + n_slip)*(i - 1) + 1 + k, :) = [frame(:2, k), arm(3)]
            if (.not. is_plane) a((1 + n_slip)*(i - 1) + 1 + k, :) = [frame(:, k), arm]
         end do
      end do
   end subroutine make_rigid

   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)

      c = a([2, 3, 1])*b([3, 1, 2]) - a([3, 1, 2])*b([2, 3, 1])
   end function cross

   function normals(n) result(x)
      integer, intent(in) :: n
      real(wp) :: x(n), column(n, 1)

      call draw_normal(column)
      x = column(:, 1)
   end function normals

   !> Of a normal distribution (Box and Muller).
   subroutine draw_normal(x)
      real(wp), intent(out) :: x(:, :)
      real(wp), dimension(size(x, 1), size(x, 2)) :: u, v

      call draw_random(u)
      call draw_random(v)
      x = sqrt(-2.0_wp*log(max(tiny(u), 1.0_wp - u)))*cos(8.0_wp*atan(1.0_wp)*v)
   end subroutine draw_normal

end module test_contact_problem
