!> Contacts that W does not couple: each part as if it were alone, in any order of the contacts.
module test_contact_parts
   use, intrinsic :: iso_fortran_env, only : dp => real64
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_contact_parts, only : contact_parts_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_missed, contact_problem_t, met
   use emcon_contact_solution, only : contact_problem_solve
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_contact_parts

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: n_slip = 2, m = 1 + n_slip
   !> Places of the contacts of two parts among all.
   integer, parameter :: first(3) = [1, 3, 5], second(2) = [2, 4]

contains

   subroutine collect_contact_parts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("each part as if it were alone", test_alone), &
         test_case_t("what couples parts makes one of them", test_coupled)]
   end subroutine collect_contact_parts

   subroutine test_alone(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: whole, one, other
      type(contact_effort_t) :: effort, own(2)
      real(wp) :: push(0:n_slip, 5), alone(0:n_slip, 5)
      logical :: is_solved, are_solved(2)
      integer :: case

      do case = 1, 50
         call draw(one, size(first))
         call draw(other, size(second))
         call join(one, other, whole)
         alone = 0.0_wp
         push = 0.0_wp
         call solve(one, first, own(1), are_solved(1))
         call solve(other, second, own(2), are_solved(2))
         call contact_parts_solve(whole, push, effort, is_solved, .false.)
         call check_true(error, all([is_solved, are_solved]), "solved, case " // to_text(case))
         if (.not. allocated(error)) call check_near(error, [push], [alone], eps, &
            maxval(abs(alone)), "forces, case " // to_text(case))
         if (.not. allocated(error)) call check_equal(error, effort%n_trial, sum(own%n_trial), &
            "trials, case " // to_text(case))
         if (allocated(error)) return
      end do

   contains

      subroutine solve(problem, place, effort, is_solved)
         type(contact_problem_t), intent(in) :: problem
         integer, intent(in) :: place(:)
         type(contact_effort_t), intent(out) :: effort
         logical, intent(out) :: is_solved
         real(wp) :: own_push(0:n_slip, size(place))

         own_push = 0.0_wp
         call contact_problem_solve(problem, own_push, effort, is_solved)
         alone(:, place) = own_push
      end subroutine solve

   end subroutine test_alone

   !> By one entry of W on either side: with the forces of the parts alone the law is missed.
   subroutine test_coupled(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: whole, one, other
      type(contact_effort_t) :: effort
      real(wp) :: push(0:n_slip, 5), apart(0:n_slip, 5)
      logical :: is_solved
      integer :: case, n_missed

      n_missed = 0
      do case = 1, 100
         call draw(one, size(first))
         call draw(other, size(second))
         call join(one, other, whole)
         apart = 0.0_wp
         call contact_parts_solve(whole, apart, effort, is_solved, .false.)
         whole%w(m*(first(1) - 1) + 1, m*(second(1) - 1) + 1) = 0.04_wp
         whole%w(m*(second(1) - 1) + 1, m*(first(1) - 1) + 1) = 0.04_wp
         if (contact_problem_missed(whole, apart) > met) n_missed = n_missed + 1
         push = apart
         call contact_parts_solve(whole, push, effort, is_solved, .false.)
         call check_true(error, is_solved .and. contact_problem_missed(whole, push) <= met, &
            "law of case " // to_text(case))
         if (allocated(error)) return
      end do
      call check_true(error, n_missed > 10, to_text(n_missed) // " were missed")
   end subroutine test_coupled

   !> Of an elastic body: W is definite.
   subroutine draw(problem, n)
      type(contact_problem_t), intent(out) :: problem
      integer, intent(in) :: n
      real(wp) :: a(m*n, m*n), free(m*n)
      integer :: i

      call contact_problem_create(problem, n_slip, n)
      call draw_random(a)
      call draw_random(free)
      call draw_random(problem%mu)
      a = 2.0_wp*a - 1.0_wp
      problem%w = matmul(a, transpose(a))/(m*n)
      do i = 1, m*n
         problem%w(i, i) = problem%w(i, i) + 0.05_wp
      end do
      problem%free = reshape(2.0_wp*free - 1.0_wp, shape(problem%free))
   end subroutine draw

   !> Both in one, which do not move each other.
   subroutine join(one, other, whole)
      type(contact_problem_t), intent(in) :: one, other
      type(contact_problem_t), intent(out) :: whole

      call contact_problem_create(whole, n_slip, size(first) + size(second))
      whole%w = 0.0_wp
      call put(one, first)
      call put(other, second)

   contains

      subroutine put(part, place)
         type(contact_problem_t), intent(in) :: part
         integer, intent(in) :: place(:)
         integer :: row(m*size(place)), i, k

         row = [((m*(place(i) - 1) + k, k = 1, m), i = 1, size(place))]
         whole%w(row, row) = part%w
         whole%free(:, place) = part%free
         whole%mu(place) = part%mu
         whole%stiffness(place) = part%stiffness
      end subroutine put

   end subroutine join

end module test_contact_parts
