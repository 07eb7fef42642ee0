!> Arrays of host codes in C and what they become in Fortran; wrong ones are told in the words of C.
module emcon_c_arrays
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_ptr
   use emcon_c_border, only : put_numbers
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: take_list, take_field, take_integers, take_flags, check_range, check_ascending
   public :: put_flags

   !> Twice as many numbers can just be counted.
   integer, parameter :: most_nodes = 2**30 - 1

contains

   !> The `n` finite numbers at `from`; none where there is an error.
   subroutine take_list(name, from, n, list, error, needed)
      character(len=*), intent(in) :: name       !! of the argument
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      real(wp), allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: needed    !! what `n` has to be; < 0: any
      real(c_double), pointer :: array(:)
      integer :: i

      allocate(list(0))
      call check_array(name, from, n, error, needed)
      if (allocated(error) .or. n == 0) return
      call c_f_pointer(from, array, [n])
      do i = 1, n
         if (ieee_is_finite(array(i))) cycle
         call raise(error, err_input, name // "[" // to_text(i - 1) // "] is not a finite number")
         return
      end do
      list = real(array, wp)
   end subroutine take_list

   !> The same as x and y of `n` nodes.
   subroutine take_field(name, from, n, field, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer, intent(in) :: n
      real(wp), allocatable, intent(out) :: field(:, :)    !! (2, n)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: list(:)

      if (.not. allocated(error) .and. n > most_nodes) call raise(error, err_input, name // &
         " is for " // to_text(n) // " nodes, more than can be counted")
      call take_list(name, from, 2*max(-1, min(n, most_nodes)), list, error)
      allocate(field(2, size(list)/2))
      field = reshape(list, shape(field))
   end subroutine take_field

   !> The `n` integers at `from`, each raised by `base`.
   subroutine take_integers(name, from, n, base, list, error, needed)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      integer, intent(in) :: base                !! 1: numbers that count from 0 in C
      integer, allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: needed    !! what `n` has to be; < 0: any
      integer(c_int), pointer :: array(:)

      allocate(list(0))
      call check_array(name, from, n, error, needed)
      if (allocated(error) .or. n == 0) return
      call c_f_pointer(from, array, [n])
      if (any(array >= huge(array) - base)) then
         call raise(error, err_input, name // " has entries that are too large")
         return
      end if
      list = array + base
   end subroutine take_integers

   !> The `n` flags at `from`.
   subroutine take_flags(name, from, n, flag, error, needed)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      logical, allocatable, intent(out) :: flag(:)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: needed    !! what `n` has to be; < 0: any
      integer, allocatable :: list(:)
      integer :: i

      call take_integers(name, from, n, 0, list, error, needed)
      flag = list /= 0
      if (allocated(error)) return
      do i = 1, size(list)
         if (list(i) == 0 .or. list(i) == 1) cycle
         call raise(error, err_input, name // "[" // to_text(i - 1) // "] is " // &
            to_text(list(i)) // ", neither 0 nor 1")
         return
      end do
   end subroutine take_flags

   !> There is an array of the size that is needed, unless it is empty.
   subroutine check_array(name, from, n, error, needed)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: needed

      if (allocated(error)) return
      if (n < 0) then
         call raise(error, err_input, "the size of " // name // " is " // to_text(int(n)))
      else if (.not. is_needed(n, needed)) then
         call raise(error, err_input, name // " has " // to_text(int(n)) // " entries, not " // &
            to_text(needed))
      else if (n > 0 .and. .not. c_associated(from)) then
         call raise(error, err_input, name // " is NULL")
      end if
   end subroutine check_array

   pure logical function is_needed(n, needed)
      integer(c_int), intent(in) :: n
      integer, intent(in), optional :: needed

      is_needed = .true.
      if (present(needed)) is_needed = n == needed .or. needed < 0
   end function is_needed

   !> Numbers that count from 0 in C, and from 1 in `list`, are below `n`. One may be a scalar.
   pure subroutine check_range(name, list, n, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: list(:)
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: entry
      integer :: i

      if (allocated(error)) return
      do i = 1, size(list)
         if (list(i) >= 1 .and. list(i) <= n) cycle
         entry = ""
         if (size(list) > 1) entry = "[" // to_text(i - 1) // "]"
         entry = name // entry // " is " // to_text(list(i) - 1)
         if (n == 0) call raise(error, err_input, entry // ", but there are none")
         if (n > 0) call raise(error, err_input, entry // ", not in 0.." // to_text(n - 1))
         return
      end do
   end subroutine check_range

   !> Numbers that count from 0 in C, and from 1 in `list`, ascend.
   pure subroutine check_ascending(name, list, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      if (allocated(error)) return
      do i = 2, size(list)
         if (list(i) > list(i - 1)) cycle
         call raise(error, err_input, name // "[" // to_text(i - 1) // "] is " // &
            to_text(list(i) - 1) // " after " // to_text(list(i - 1) - 1) // "; they are to ascend")
         return
      end do
   end subroutine check_ascending

   !> Copy flags to an array of C, if there is one.
   subroutine put_flags(flag, to)
      logical, intent(in) :: flag(:)
      type(c_ptr), intent(in) :: to

      call put_numbers(merge(1, 0, flag), to)
   end subroutine put_flags

end module emcon_c_arrays
