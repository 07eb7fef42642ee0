!> Numbers and arithmetic of decks: against the compiler's own, and every fault has a text.
module test_deck_parameters
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_deck_expression, only : evaluate_expression, parameter_table_t
   use emcon_deck_parameters, only : parameter_define, parameters_init, parameters_t, &
      substitute_parameters, unused_override
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : read_integer, read_real, string_t, to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_deck_parameters

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_deck_parameters(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("number forms", test_number_forms), &
         test_case_t("no numbers", test_no_numbers), &
         test_case_t("random numbers", test_random_numbers), &
         test_case_t("range of numbers", test_range), &
         test_case_t("whole numbers", test_whole_numbers), &
         test_case_t("precedence", test_precedence), &
         test_case_t("functions", test_functions), &
         test_case_t("faults of expressions", test_faults), &
         test_case_t("nesting", test_nesting), &
         test_case_t("substitution", test_substitution), &
         test_case_t("overrides", test_overrides)]
   end subroutine collect_deck_parameters

   !> Every form that Fortran or C writes.
   subroutine test_number_forms(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=10), parameter :: word(14) = [character(len=10) :: "1.", ".5", "-.5", "+2", &
         "1e3", "1E+3", "1D3", "1.d+3", "1.5q2", "2e-3", "1.0-100", "007", "0e5", "-0.0"]
      real(wp), parameter :: expected(14) = [1.0_wp, 0.5_wp, -0.5_wp, 2.0_wp, 1000.0_wp, &
         1000.0_wp, 1000.0_wp, 1000.0_wp, 150.0_wp, 2.0e-3_wp, 0.0_wp, 7.0_wp, 0.0_wp, 0.0_wp]
      real(wp) :: value
      integer :: i
      logical :: ok

      do i = 1, size(word)
         call read_real(trim(word(i)), value, ok)
         call check_true(error, ok, trim(word(i)) // " is a number")
         ! 1.0-100 is below the range of real32, where it becomes 0.
         if (word(i) == "1.0-100") then
            call check_true(error, value < 1.0e-30_wp, trim(word(i)))
         else
            call check_near(error, value, expected(i), eps, abs(expected(i)), trim(word(i)))
         end if
      end do
   end subroutine test_number_forms

   subroutine test_no_numbers(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=12), parameter :: word(17) = [character(len=12) :: "", "+", "-", ".", "e5", &
         "1e", "1e+", "1.2.3", "1 2", "nan", "inf", "-Infinity", "0x10", "1,5", "2*3", "1e5000", &
         "1e99999999"]
      real(wp) :: value
      integer :: i
      logical :: ok

      do i = 1, size(word)
         call read_real(trim(word(i)), value, ok)
         call check_true(error, .not. ok, "'" // trim(word(i)) // "' is no number")
      end do
   end subroutine test_no_numbers

   !> Short and long decimals are read as the run-time library reads them.
   subroutine test_random_numbers(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=40) :: word
      real(wp) :: value, expected, random(3)
      integer :: i, stat
      logical :: ok

      do i = 1, 2000
         call draw_random(random)
         if (mod(i, 2) == 0) then
            write(word, "(es40.25e2)") (random(1) - 0.5_wp) &
               *10.0_wp**nint(30.0_wp*random(2) - 15.0_wp)
         else
            write(word, "(f0.6)") (random(1) - 0.5_wp)*1000.0_wp
         end if
         read(word, *, iostat=stat) expected
         call read_real(trim(adjustl(word)), value, ok)
         call check_true(error, ok .and. stat == 0, word)
         ! One product or quotient of exact numbers is correctly rounded: equality.
         call check_near(error, value, expected, 0.0_wp, 1.0_wp, word)
      end do
   end subroutine test_random_numbers

   !> What is too large is refused, what is too small is 0, neither is a floating-point exception.
   subroutine test_range(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: value
      logical :: ok

      call read_real("1e" // to_text(range(1.0_wp) + 2), value, ok)
      call check_true(error, .not. ok, "beyond the range")
      call read_real("1e" // to_text(range(1.0_wp)), value, ok)
      call check_true(error, ok, "at the end of the range")
      call read_real(repeat("9", 10000), value, ok)
      call check_true(error, .not. ok, "ten thousand digits")
      call read_real("1e-99999", value, ok)
      call check_true(error, ok, "very small")
      call check_near(error, value, 0.0_wp, 0.0_wp, 1.0_wp, "very small")
      call read_real("0." // repeat("0", 20) // "1e21", value, ok)
      call check_near(error, value, 1.0_wp, eps, 1.0_wp, "zeros before the first digit")
   end subroutine test_range

   subroutine test_whole_numbers(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=20), parameter :: word(7) = [character(len=20) :: "", "-", "1.", "2147483648", &
         "1e3", "99999999999999999999", "1 2"]
      integer :: value, i
      logical :: ok

      call read_integer("-2147483647", value, ok)
      call check_true(error, ok, "smallest")
      call check_equal(error, value, -2147483647, "smallest")
      call read_integer("+0012", value, ok)
      call check_equal(error, value, 12, "sign and zeros")
      do i = 1, size(word)
         call read_integer(trim(word(i)), value, ok)
         call check_true(error, .not. ok, "'" // trim(word(i)) // "' is no whole number")
      end do
   end subroutine test_whole_numbers

   !> `text` has the value `expected`.
   subroutine check_value(error, text, expected)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: text
      real(wp), intent(in) :: expected
      type(parameter_table_t) :: table
      character(len=:), allocatable :: fault
      real(wp) :: value

      call evaluate_expression(table, text, value, fault)
      call check_equal(error, fault, "", text)
      call check_near(error, value, expected, 4.0_wp*eps, abs(expected), text)
   end subroutine check_value

   subroutine test_precedence(error)
      type(error_t), allocatable, intent(out) :: error

      call check_value(error, "1 + 2*3", 7.0_wp)
      call check_value(error, "(1 + 2)*3", 9.0_wp)
      call check_value(error, "8/4/2", 1.0_wp)
      call check_value(error, "1 - 2 - 3", -4.0_wp)
      call check_value(error, "1/2", 0.5_wp)
      call check_value(error, "-2**2", -4.0_wp)
      call check_value(error, "2**-1", 0.5_wp)
      call check_value(error, "2**3**2", 512.0_wp)
      call check_value(error, "2*-3", -6.0_wp)
      call check_value(error, "--1", 1.0_wp)
      call check_value(error, "1e2+1", 101.0_wp)
      call check_value(error, "1.5d0-.5", 1.0_wp)
      call check_value(error, achar(9) // " 2 " // achar(9), 2.0_wp)
      call check_value(error, "0**0 + 0*5", 1.0_wp)
   end subroutine test_precedence

   subroutine test_functions(error)
      type(error_t), allocatable, intent(out) :: error

      call check_value(error, "sqrt(16)", 4.0_wp)
      call check_value(error, "SIN(pi/6)", sin(acos(-1.0_wp)/6.0_wp))
      call check_value(error, "cos(0)", 1.0_wp)
      call check_value(error, "tan(pi/4)", tan(acos(-1.0_wp)/4.0_wp))
      call check_value(error, "log(exp(2))", 2.0_wp)
      call check_value(error, "abs(-3)", 3.0_wp)
      call check_value(error, "2**0.5", sqrt(2.0_wp))
      call check_value(error, "(-2)**3", -8.0_wp)
      call check_value(error, "0.5**100000", 0.0_wp)
   end subroutine test_functions

   !> What cannot be done is said, and never done.
   subroutine test_faults(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=24), parameter :: text(26) = [character(len=24) :: "", "1/0", "1/(2 - 2)", &
         "sqrt(-1)", "log(0)", "exp(1e30)", "(-8)**(1/3)", "0**-1", "10**100000", "(1 + 2", &
         "1 + 2)", "1 +", "*2", "2 3", "length", "sine(1)", "1..2", "()", "sqrt()", "sqrt 4", &
         "2 $ 3", "1e", "2***3", "(1e30)**(1e30)", "1 = 1", "2 +* 3"]
      type(parameter_table_t) :: table
      character(len=:), allocatable :: fault
      real(wp) :: value
      integer :: i

      do i = 1, size(text)
         call evaluate_expression(table, trim(text(i)), value, fault)
         call check_true(error, fault /= "", "'" // trim(text(i)) // "' has a fault")
      end do
   end subroutine test_faults

   subroutine test_nesting(error)
      type(error_t), allocatable, intent(out) :: error
      type(parameter_table_t) :: table
      character(len=:), allocatable :: fault
      real(wp) :: value

      call check_value(error, repeat("(", 50) // "1" // repeat(")", 50), 1.0_wp)
      call evaluate_expression(table, repeat("(", 100000), value, fault)
      call check_true(error, index(fault, "too deep") > 0, "parentheses")
      call evaluate_expression(table, repeat("-", 100000) // "1", value, fault)
      call check_true(error, index(fault, "too deep") > 0, "signs")
   end subroutine test_nesting

   !> The text of `line` with the parameters put in.
   subroutine check_line(error, parameters, line, expected)
      type(error_t), allocatable, intent(inout) :: error
      type(parameters_t), intent(in) :: parameters
      character(len=*), intent(in) :: line, expected
      character(len=:), allocatable :: text, fault

      call substitute_parameters(parameters, line, text, fault)
      call check_equal(error, fault, "", line)
      call check_equal(error, text, expected, line)
   end subroutine check_line

   subroutine test_substitution(error)
      type(error_t), allocatable, intent(out) :: error
      type(parameters_t) :: parameters
      character(len=:), allocatable :: text, fault
      real(wp) :: value
      logical :: ok

      call parameters_init(parameters, [string_t ::])
      call parameter_define(parameters, "n = 2 + 3   # a remark", fault)
      call parameter_define(parameters, "Long_Name = n/2", fault)
      call parameter_define(parameters, "method = NULL SPACE", fault)
      call parameter_define(parameters, "set = '1st'", fault)
      call parameter_define(parameters, "third = 1/3", fault)
      call check_line(error, parameters, "<n>, < N >,<long_name>", "5, 5,2.5")
      call check_line(error, parameters, "TYPE=<method>, <set>", "TYPE=NULL SPACE, 1st")
      call check_line(error, parameters, "no bracket", "no bracket")
      call check_line(error, parameters, "1 < 2", "1 < 2")
      call substitute_parameters(parameters, "<third>", text, fault)
      call read_real(text, value, ok)
      call check_true(error, ok, text)
      call check_near(error, value, 1.0_wp/3.0_wp, 0.0_wp, 1.0_wp, "no digit is lost")
      call substitute_parameters(parameters, "<metod>", text, fault)
      call check_true(error, index(fault, "did you mean METHOD?") > 0, fault)
      call parameter_define(parameters, "2n = 3", fault)
      call check_true(error, fault /= "", "a name begins with a letter")
   end subroutine test_substitution

   subroutine test_overrides(error)
      type(error_t), allocatable, intent(out) :: error
      type(parameters_t) :: parameters
      type(string_t) :: given(2)
      character(len=:), allocatable :: fault

      given(1)%text = "H = 1/4"
      given(2)%text = "typo=1"
      call parameters_init(parameters, given)
      call parameter_define(parameters, "h = 0.1", fault)
      call parameter_define(parameters, "twice = 2*h", fault)
      call check_line(error, parameters, "<h>, <twice>", "0.25, 0.5")
      call unused_override(parameters, 1, fault)
      call check_equal(error, fault, "", "used")
      call unused_override(parameters, 2, fault)
      call check_equal(error, fault, "the deck has no parameter 'TYPO' (known: H=0.25, " // &
         "TWICE=0.5)", "not used")
      given(1)%text = "h"
      call parameters_init(parameters, given(:1))
      call unused_override(parameters, 1, fault)
      call check_equal(error, fault, "a parameter of the deck is set by NAME=VALUE (it has no " // &
         "*PARAMETER)", "no value")
   end subroutine test_overrides

end module test_deck_parameters
