!> The comparisons themselves: what passes, and that each one can fail.
module test_check
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_file, err_input, error_t, raise
   use emcon_kinds, only : wp
   use first_failure, only : failure_take
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_check

contains

   subroutine collect_check(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("all pass", test_all_pass), &
         test_case_t("real", test_real, should_fail=.true.), &
         test_case_t("real of zero scale", test_zero_scale, should_fail=.true.), &
         test_case_t("nan", test_nan, should_fail=.true.), &
         test_case_t("extent", test_extent, should_fail=.true.), &
         test_case_t("integer", test_integer, should_fail=.true.), &
         test_case_t("list", test_list, should_fail=.true.), &
         test_case_t("text", test_text, should_fail=.true.), &
         test_case_t("truth", test_truth, should_fail=.true.), &
         test_case_t("error code", test_error_code, should_fail=.true.), &
         test_case_t("error missing", test_error_missing, should_fail=.true.), &
         test_case_t("first failure stands", test_first_stands), &
         test_case_t("a failure that is erased", test_erased, should_fail=.true.)]
   end subroutine collect_check

   subroutine test_all_pass(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      real(wp) :: a(2, 3)

      call draw_random(a)
      call raise(raised, err_file, "cannot open x")
      call check_near(error, 1.0_wp + epsilon(1.0_wp), 1.0_wp, epsilon(1.0_wp), 1.0_wp, "scalar")
      call check_near(error, a, a, 0.0_wp, 1.0_wp, "matrix")
      call check_near(error, a(1, :), a(1, :), 0.0_wp, 0.0_wp, "vector")
      call check_equal(error, [1, 2], [1, 2], "list")
      call check_equal(error, "word", "word", "text")
      call check_true(error, 1 < 2, "1 < 2")
      call check_error(error, raised, err_file, "open", "raised")
   end subroutine test_all_pass

   subroutine test_real(error)
      type(error_t), allocatable, intent(out) :: error

      call check_near(error, 1.0_wp + 2.0_wp*epsilon(1.0_wp), 1.0_wp, epsilon(1.0_wp), 1.0_wp, "x")
   end subroutine test_real

   subroutine test_zero_scale(error)
      type(error_t), allocatable, intent(out) :: error

      call check_near(error, tiny(1.0_wp), 0.0_wp, 1.0_wp, 0.0_wp, "x")
   end subroutine test_zero_scale

   subroutine test_nan(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2)

      x = ieee_value(1.0_wp, ieee_quiet_nan)
      call check_near(error, x, [1.0_wp, 1.0_wp], 1.0_wp, 1.0_wp, "x")
   end subroutine test_nan

   subroutine test_extent(error)
      type(error_t), allocatable, intent(out) :: error

      call check_near(error, [1.0_wp], [1.0_wp, 2.0_wp], 1.0_wp, 1.0_wp, "x")
   end subroutine test_extent

   subroutine test_integer(error)
      type(error_t), allocatable, intent(out) :: error

      call check_equal(error, 1, 2, "i")
   end subroutine test_integer

   subroutine test_list(error)
      type(error_t), allocatable, intent(out) :: error

      call check_equal(error, [1, 2], [1, 2, 3], "i")
   end subroutine test_list

   subroutine test_text(error)
      type(error_t), allocatable, intent(out) :: error

      call check_equal(error, "word", "word ", "text")
   end subroutine test_text

   subroutine test_truth(error)
      type(error_t), allocatable, intent(out) :: error

      call check_true(error, 1 > 2, "1 > 2")
   end subroutine test_truth

   subroutine test_error_code(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised

      call raise(raised, err_file, "cannot open x")
      call check_error(error, raised, err_input, "", "raised")
   end subroutine test_error_code

   subroutine test_error_missing(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised

      call check_error(error, raised, err_input, "", "raised")
   end subroutine test_error_missing

   subroutine test_first_stands(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: kept
      character(len=:), allocatable :: message

      call check_equal(kept, 1, 2, "first")
      call check_equal(kept, 3, 4, "second")
      call failure_take(message)
      call check_equal(error, kept%message, "first: 1, expected 2", "message")
      call check_equal(error, message, kept%message, "kept beside it")
   end subroutine test_first_stands

   !> As a call of the library does that is handed the error of a test.
   subroutine test_erased(error)
      type(error_t), allocatable, intent(out) :: error

      call check_true(error, .false., "erased")
      if (allocated(error)) deallocate(error)
   end subroutine test_erased

end module test_check
