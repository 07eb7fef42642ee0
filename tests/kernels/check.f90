!> What a kernel test is made of: the test case and the comparisons.
!>
!> A test is `subroutine test_x(error)`; it has passed if `error` is not allocated at its end, so
!> an error of the library may be handed on as it is. A comparison leaves an earlier failure
!> standing: several may follow each other and the first one that fails is reported. That holds too
!> where a library call with `intent(out)` has erased `error` since (`first_failure`).
module check
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : error_t, raise, err_internal
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use first_failure, only : failure_keep
   implicit none
   private
   public :: test_case_t, check_near, check_equal, check_true, check_error

   abstract interface
      subroutine test_procedure(error)
         import :: error_t
         implicit none
         type(error_t), allocatable, intent(out) :: error
      end subroutine test_procedure
   end interface

   !> One test: `test_case_t("name", test_x)`. With `should_fail=.true.` it passes by failing.
   type :: test_case_t
      character(len=64) :: name
      procedure(test_procedure), pointer, nopass :: run => null()
      logical :: should_fail = .false.
   end type test_case_t

   !> abs(actual - expected) <= rel*scale in every entry; rel = 0 asks for equality, and
   !> what is not finite fails. Matrices of kind `dp` come as real(a, wp).
   interface check_near
      module procedure check_near_0, check_near_1, check_near_2
   end interface check_near

   !> Equality of integers, lists of integers and texts.
   interface check_equal
      module procedure check_equal_0, check_equal_1, check_equal_text
   end interface check_equal

contains

   subroutine check_near_0(error, actual, expected, rel, scale, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: actual, expected
      real(wp), intent(in) :: rel                  !! a named multiple of epsilon, or a known bound
      real(wp), intent(in) :: scale                !! >= 0, the size of what is compared
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: text

      if (is_near(actual, expected, rel, scale)) return
      call numbers(actual, expected, rel, scale, text)
      call fail(error, what // ": " // text)
   end subroutine check_near_0

   subroutine check_near_1(error, actual, expected, rel, scale, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: actual(:), expected(:)
      real(wp), intent(in) :: rel, scale
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: text
      integer :: i

      call check_equal_1(error, shape(actual), shape(expected), what // ", extent")
      if (size(actual) /= size(expected)) return
      do i = 1, size(actual)
         if (is_near(actual(i), expected(i), rel, scale)) cycle
         call numbers(actual(i), expected(i), rel, scale, text)
         call fail(error, what // "(" // to_text(i) // "): " // text)
         return
      end do
   end subroutine check_near_1

   subroutine check_near_2(error, actual, expected, rel, scale, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: actual(:, :), expected(:, :)
      real(wp), intent(in) :: rel, scale
      character(len=*), intent(in) :: what
      integer :: j

      call check_equal_1(error, shape(actual), shape(expected), what // ", extents")
      if (any(shape(actual) /= shape(expected))) return
      do j = 1, size(actual, 2)
         call check_near_1(error, actual(:, j), expected(:, j), rel, scale, &
            what // ", column " // to_text(j))
      end do
   end subroutine check_near_2

   subroutine check_equal_0(error, actual, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: actual, expected
      character(len=*), intent(in) :: what

      if (actual == expected) return
      call fail(error, what // ": " // to_text(actual) // ", expected " // to_text(expected))
   end subroutine check_equal_0

   subroutine check_equal_1(error, actual, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: actual(:), expected(:)
      character(len=*), intent(in) :: what
      integer :: i

      call check_equal_0(error, size(actual), size(expected), what // ", length")
      do i = 1, min(size(actual), size(expected))
         call check_equal_0(error, actual(i), expected(i), what // "(" // to_text(i) // ")")
      end do
   end subroutine check_equal_1

   subroutine check_equal_text(error, actual, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: actual, expected
      character(len=*), intent(in) :: what

      if (actual == expected .and. len(actual) == len(expected)) return
      call fail(error, what // ": '" // actual // "', expected '" // expected // "'")
   end subroutine check_equal_text

   !> `condition` holds; `what` says what does.
   subroutine check_true(error, condition, what)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in) :: condition
      character(len=*), intent(in) :: what

      if (.not. condition) call fail(error, "not so: " // what)
   end subroutine check_true

   !> The library has raised an error of class `code` whose message has `word` in it.
   subroutine check_error(error, raised, code, word, what)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable, intent(in) :: raised
      integer, intent(in) :: code                  !! one of the `err_` codes
      character(len=*), intent(in) :: word         !! may be empty
      character(len=*), intent(in) :: what

      if (.not. allocated(raised)) then
         call fail(error, what // ": no error was raised")
         return
      end if
      call check_equal_0(error, raised%code, code, what // ", code of the error")
      if (index(raised%message, word) == 0) then
         call fail(error, what // ": '" // word // "' is not in '" // raised%message // "'")
      end if
   end subroutine check_error

   subroutine fail(error, message)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: message

      call failure_keep(message)
      if (.not. allocated(error)) call raise(error, err_internal, message)
   end subroutine fail

   !> Looks for NaN and infinity first: under floating-point traps they must fail, not crash.
   logical function is_near(actual, expected, rel, scale)
      real(wp), intent(in) :: actual, expected, rel, scale

      is_near = ieee_is_finite(actual) .and. ieee_is_finite(expected)
      if (is_near) is_near = abs(actual - expected) <= rel*scale
   end function is_near

   subroutine numbers(actual, expected, rel, scale, text)
      real(wp), intent(in) :: actual, expected, rel, scale
      character(len=:), allocatable, intent(out) :: text

      text = trim(exact(actual)) // ", expected " // trim(exact(expected))
      if (.not. (ieee_is_finite(actual) .and. ieee_is_finite(expected))) return
      text = text // ", difference " // trim(short(abs(actual - expected))) // " > " &
         // trim(short(rel)) // "*" // trim(short(scale))
   end subroutine numbers

   function exact(value) result(text)
      real(wp), intent(in) :: value
      character(len=48) :: text

      write(text, "(g0)") value
   end function exact

   function short(value) result(text)
      real(wp), intent(in) :: value
      character(len=10) :: text

      write(text, "(es10.3)") value
      text = adjustl(text)
   end function short

end module check
