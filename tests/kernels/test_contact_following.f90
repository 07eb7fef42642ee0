!> Forces near those before, at the nine points on which a rigid slab sticks: three are as good as
!> nine, so that most of them follow from others.
module test_contact_following
   use, intrinsic :: iso_fortran_env, only : dp => real64
   use check, only : check_near, check_true, test_case_t
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_missed, contact_problem_motion, contact_problem_t, met
   use emcon_contact_trials, only : contact_following
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_contact_following

   integer, parameter :: n = 9
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: mass = 2.0_wp, inertia(3) = [0.5_wp, 0.75_wp, 1.0_wp], mu = 0.5_wp

contains

   subroutine collect_contact_following(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a load that is added is borne", test_load), &
         test_case_t("rows that disagree move forces little", test_disagree), &
         test_case_t("what is drawn away opens", test_drawn)]
   end subroutine collect_contact_following

   !> The slab at rest under a weight of 9, and what its points would move by with velocities `v`:
   !> along x, y, z, and about these.
   subroutine make_slab(v, problem)
      real(wp), intent(in) :: v(6)
      type(contact_problem_t), intent(out) :: problem
      real(wp) :: row(6, 3*n), at(3)
      integer :: i, j, k

      call contact_problem_create(problem, 2, n)
      do j = -1, 1
         do i = -1, 1
            k = 5 + i + 3*j
            at = [real(i, wp), real(j, wp), -0.5_wp]
            row(:, 3*k - 2) = [0.0_wp, 0.0_wp, 1.0_wp, at(2), -at(1), 0.0_wp]
            row(:, 3*k - 1) = -[1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, at(3), -at(2)]
            row(:, 3*k) = -[0.0_wp, 1.0_wp, 0.0_wp, -at(3), 0.0_wp, at(1)]
         end do
      end do
      problem%w = matmul(transpose(row), row/spread([spread(mass, 1, 3), inertia], 2, 3*n))
      problem%free = reshape(matmul(v, row), [3, n])
      problem%base(0, :) = 1.0_wp
      problem%mu = mu
   end subroutine make_slab

   !> It is drawn along x and turned: what all points bear together is what takes that.
   subroutine test_load(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: v(6) = [0.2_wp, 0.0_wp, -0.1_wp, 0.0_wp, 0.0_wp, 0.05_wp]
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp) :: push(0:2, n), motion(0:2, n)
      logical :: is_solved, is_near

      call make_slab(v, problem)
      push = 0.0_wp
      call contact_following(problem, push, effort, is_solved, is_near)
      call check_true(error, is_solved .and. contact_problem_missed(problem, push) <= met, "solved")
      if (allocated(error)) return
      motion = contact_problem_motion(problem, push)
      call check_near(error, reshape(motion, [3*n]), spread(0.0_wp, 1, 3*n), 1.0e6_wp*eps, 1.0_wp, &
         "at rest")
      call check_near(error, [sum(push(0, :)), sum(push(1, :)), sum(push(2, :))], &
         [0.1_wp*mass, 0.2_wp*mass, 0.0_wp], 1.0e6_wp*eps, 1.0_wp, "forces")
   end subroutine test_load

   !> Rows disagree by a billionth, which forces of the size of the weight would make up for: they
   !> stay, and motions are off by no more than that.
   subroutine test_disagree(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: off = 1.0e-9_wp
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp) :: push(0:2, n), more(0:2, n)
      logical :: is_solved, is_near
      integer :: case

      do case = 1, 20
         call make_slab([0.0_wp, 0.01_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], problem)
         call draw_random(more)
         problem%free = problem%free + off*(2.0_wp*more - 1.0_wp)
         push = 0.0_wp
         call contact_following(problem, push, effort, is_solved, is_near)
         call check_true(error, is_near, "found, case " // to_text(case))
         if (.not. is_solved) call check_true(error, maxval(abs(push)) < 0.1_wp, "forces, case " &
            // to_text(case))
         call check_near(error, reshape(contact_problem_motion(problem, push), [3*n]), &
            spread(0.0_wp, 1, 3*n), 10.0_wp*off, 1.0_wp, "motions, case " // to_text(case))
         if (allocated(error)) return
      end do
   end subroutine test_disagree

   !> Drawn up by more than its weight it has no forces, and is drawn as if there were no points.
   subroutine test_drawn(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp) :: push(0:2, n)
      logical :: is_solved, is_near

      call make_slab([0.1_wp, 0.0_wp, 10.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], problem)
      push = 0.0_wp
      call contact_following(problem, push, effort, is_solved, is_near)
      call check_true(error, is_solved, "solved")
      if (.not. allocated(error)) call check_near(error, reshape(problem%base + push, [3*n]), &
         spread(0.0_wp, 1, 3*n), 0.0_wp, 1.0_wp, "no force")
   end subroutine test_drawn

end module test_contact_following
