!> The verdict from running figures.
module test_verdict
   use check, only : check_equal, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_segment
   use emcon_kinds, only : wp
   use emcon_verdict, only : guard_advice, verdict_end, verdict_is_failure, verdict_is_good, &
      verdict_line, verdict_t
   implicit none
   private
   public :: collect_verdict

contains

   subroutine collect_verdict(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a clean run is good", test_good), &
         test_case_t("what is bad is named", test_bad), &
         test_case_t("a tenth of an edge is a failure", test_deep), &
         test_case_t("a run that failed is not good", test_failed), &
         test_case_t("what pairs can do to need no guards", test_advice)]
   end subroutine collect_verdict

   subroutine test_good(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%largest_energy = 2.0_wp
      verdict%dynamic_drift = energy_bar()
      verdict%largest_drift = 1.0_wp             ! of statics: shown, not judged
      verdict%n_warning = 3
      call verdict_end(verdict)
      call check_true(error, verdict_is_good(verdict), "good")
      call check_true(error, .not. verdict_is_failure(verdict, .true.), "no failure")
   end subroutine test_good

   subroutine test_bad(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      character(len=:), allocatable :: line

      verdict%largest_energy = 2.0_wp
      verdict%dynamic_drift = 3.0_wp*energy_bar()
      verdict%unconverged = 1.0e-3_wp
      verdict%deepest = 1.0e-2_wp
      verdict%law_missed = 0.5_wp
      call verdict_end(verdict)
      call check_equal(error, verdict%reasons%n, 4, "reasons")
      call verdict_line(verdict, line)
      call check_true(error, index(line, "verdict: BAD: ") == 1, line)
      call check_true(error, index(line, "does NOT close") > 0, line)
      call check_true(error, index(line, "friction are missed by 0.5 of") > 0, line)
      call check_true(error, .not. verdict_is_good(verdict), "not good")
      call check_true(error, .not. verdict_is_failure(verdict, .false.), "no failure by itself")
      call check_true(error, verdict_is_failure(verdict, .true.), "a failure if strict")
   end subroutine test_bad

   !> Of a largest energy of 1, by the digits of a real: 4 of 6, 10 of 15, 25 of 33.
   pure real(wp) function energy_bar()
      energy_bar = 1.0e-10_wp
      if (precision(1.0_wp) < 15) energy_bar = 1.0e-4_wp
      if (precision(1.0_wp) > 15) energy_bar = 1.0e-25_wp
   end function energy_bar

   subroutine test_deep(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict

      verdict%deepest = 0.11_wp
      call verdict_end(verdict)
      call check_true(error, verdict_is_failure(verdict, .false.), "a failure")
   end subroutine test_deep

   subroutine test_failed(error)
      type(error_t), allocatable, intent(out) :: error
      type(verdict_t) :: verdict
      character(len=:), allocatable :: line

      verdict%has_dynamics = .true.
      call verdict_end(verdict, "the analysis stops")
      call check_true(error, .not. verdict_is_good(verdict), "not good")
      call verdict_line(verdict, line)
      call check_equal(error, line, "verdict: NOT COMPLETED", "line")
   end subroutine test_failed

   !> Pairs with integrated gaps take no SIDES=BOTH; those that hold both sides have guards only
   !> where nodes cannot be held; those without guards do not count.
   subroutine test_advice(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: one, both, segment, mortar
      character(len=:), allocatable :: advice
      character(len=*), parameter :: mesh = "a finer mesh there", &
         swap = ", the other surface as slave or " // mesh

      both%both_sides = .true.
      segment%formulation = formulation_segment
      mortar%formulation = formulation_mortar
      call guard_advice([one, both], advice)
      call check_equal(error, advice, "SIDES=BOTH" // swap, "one side")
      call guard_advice([mortar, both], advice)
      call check_equal(error, advice, "TYPE=NODE TO SURFACE" // swap, "integrated")
      call guard_advice([one, segment], advice)
      call check_equal(error, advice, "TYPE=NODE TO SURFACE with SIDES=BOTH" // swap, "either")
      one%is_guarded = .false.
      segment%is_guarded = .false.
      call guard_advice([one, segment, both], advice)
      call check_equal(error, advice, mesh, "both sides")
   end subroutine test_advice

end module test_verdict
