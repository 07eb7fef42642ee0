!> Exceptions raised inside library calls stay there; BLAS threads can be switched off.
module test_blas
   use, intrinsic :: ieee_exceptions, only : ieee_divide_by_zero, ieee_get_flag, &
      ieee_get_halting_mode, ieee_set_flag
   use check, only : check_true, test_case_t
   use emcon_blas, only : blas_enter, blas_leave, blas_single_thread, ieee_status_type
   use emcon_errors, only : error_t
   implicit none
   private
   public :: collect_blas

contains

   subroutine collect_blas(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("exceptions stay inside", test_exceptions), &
         test_case_t("single thread", test_single_thread)]
   end subroutine collect_blas

   subroutine test_exceptions(error)
      type(error_t), allocatable, intent(out) :: error
      type(ieee_status_type) :: status
      logical :: halts_before, halts_inside, halts_after, is_raised_before, is_raised_after

      call ieee_get_halting_mode(ieee_divide_by_zero, halts_before)
      call ieee_get_flag(ieee_divide_by_zero, is_raised_before)
      call blas_enter(status)
      call ieee_get_halting_mode(ieee_divide_by_zero, halts_inside)
      call ieee_set_flag(ieee_divide_by_zero, .true.)
      call blas_leave(status)
      call ieee_get_halting_mode(ieee_divide_by_zero, halts_after)
      call ieee_get_flag(ieee_divide_by_zero, is_raised_after)
      call check_true(error, .not. halts_inside, "no halting inside")
      call check_true(error, halts_before .eqv. halts_after, "halting is restored")
      call check_true(error, is_raised_before .eqv. is_raised_after, "the flag is restored")
   end subroutine test_exceptions

   !> Without such a switch the library is serial: both answers are right, but stay the same.
   subroutine test_single_thread(error)
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done, is_done_again

      call blas_single_thread(is_done)
      call blas_single_thread(is_done_again)
      call check_true(error, is_done .eqv. is_done_again, "same answer twice")
   end subroutine test_single_thread

end module test_blas
