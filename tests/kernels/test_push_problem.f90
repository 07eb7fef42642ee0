!> Gaps without friction that follow from others: pushes, open gaps, what cannot be opened.
module test_push_problem
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_push_problem, only : push_problem_solve
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_push_problem

   !> What sums of some hundred terms round.
   real(wp), parameter :: tol = 1.0e4_wp*epsilon(1.0_wp)

contains

   subroutine collect_push_problem(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rows that follow from others, drawn", test_drawn), &
         test_case_t("the same row many times", test_same), &
         test_case_t("gaps that are open need no push", test_open), &
         test_case_t("opposite gaps cannot both open", test_opposite)]
   end subroutine collect_push_problem

   !> A third of the rows are others once more, a third are sums of two; the gaps are such that
   !> there is a solution. No gap is closed, no push pulls, and none of them does work, from
   !> whatever it begins: no push, drawn ones, its own solution, which stands.
   subroutine test_drawn(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: row(:, :), w(:, :), free(:), push(:), gap(:), extra(:), motion(:)
      real(wp) :: draw(2)
      integer :: i, k, n, n_step, begins
      logical :: is_solved

      do i = 1, 60
         call draw_random(draw)
         n = 6 + int(60.0_wp*draw(1))
         allocate(row(2 + int(30.0_wp*draw(2)), n), extra(n), push(n))
         allocate(motion(size(row, 1)))
         call draw_random(row)
         row = row - 0.5_wp
         do k = 1, n/3
            row(:, k) = row(:, n - k + 1)
            row(:, n/3 + k) = row(:, n - k + 1) + row(:, n - k)
         end do
         call draw_random(motion)
         call draw_random(extra)
         w = matmul(transpose(row), row)
         free = matmul(transpose(row), motion - 0.5_wp) + modulo(i, 2)*0.1_wp*extra
         do begins = 1, 3
            if (begins == 1) push = 0.0_wp
            if (begins == 2) call draw_random(push)
            call push_problem_solve(w, free, push, is_solved, n_step)
            call check_true(error, is_solved .and. (begins < 3 .or. n_step == 0), "a solution")
            gap = free + matmul(w, push)
            associate (scale => maxval(abs(free)))
               call check_true(error, all(push >= 0.0_wp), "pushes")
               call check_true(error, all(gap >= -tol*scale), "open gaps")
               call check_near(error, dot_product(push, gap), 0.0_wp, tol, &
                  scale*max(sum(push), tiny(scale)), "work")
            end associate
         end do
         deallocate(row, extra, push, motion)
      end do
   end subroutine test_drawn

   !> One of them pushes for all.
   subroutine test_same(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      real(wp) :: w(n, n), push(n)
      integer :: n_step
      logical :: is_solved

      w = 2.0_wp
      push = 0.0_wp
      call push_problem_solve(w, spread(-1.0_wp, 1, n), push, is_solved, n_step)
      call check_true(error, is_solved, "a solution")
      call check_near(error, sum(push), 0.5_wp, tol, 1.0_wp, "all pushes")
   end subroutine test_same

   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(2, 2), push(2)
      integer :: n_step
      logical :: is_solved

      w = 1.0_wp
      push = 0.0_wp
      call push_problem_solve(w, [0.0_wp, 1.0_wp], push, is_solved, n_step)
      call check_true(error, is_solved .and. n_step == 0 .and. all(push <= 0.0_wp), "nothing")
   end subroutine test_open

   !> A body between two walls that are nearer than it is thick.
   subroutine test_opposite(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(2, 2), push(2)
      integer :: n_step
      logical :: is_solved

      w = reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
      push = 1.0_wp
      call push_problem_solve(w, [-1.0_wp, -1.0_wp], push, is_solved, n_step)
      call check_true(error, .not. is_solved, "no motion opens both")
   end subroutine test_opposite

end module test_push_problem
