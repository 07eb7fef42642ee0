!> What a restart file holds: named arrays of integers, reals and texts.
!>
!> One list of calls fills it and, on reading, takes everything out again: each array is named once.
module emcon_restart_data
   use emcon_errors, only : error_t, raise, err_file
   use emcon_kinds, only : wp
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: restart_t, restart_exchange, restart_list, restart_offers, restart_size, &
      restart_rewind, restart_check
   public :: entry_t, entry_add, entry_kind, of_integers, of_reals, of_texts

   !> A named array; one of the components is allocated.
   type :: entry_t
      character(len=:), allocatable :: name
      integer, allocatable :: whole(:)
      real(wp), allocatable :: state(:)
      type(string_t), allocatable :: text(:)
      integer :: n_taken = -1                    !! values handed out; -1: nobody has asked
   end type entry_t

   !> Named arrays, filled to be written; or handed out, as read.
   type :: restart_t
      logical :: is_reading = .false.            !! values are handed out
      integer :: n_entry = 0
      type(entry_t), allocatable :: entry(:)     !! (n_entry) and room
      type(error_t), allocatable, private :: error   !! the first array that was not as wanted
   end type restart_t

   !> Append values to the array of a name; on reading, take the next ones from it. Where there are
   !> none the values stay, and `restart_check` tells.
   interface restart_exchange
      module procedure exchange_integer, exchange_integers, exchange_logical, exchange_logicals, &
         exchange_real, exchange_reals, exchange_table
   end interface restart_exchange

   !> The same for a whole array, which on reading gets the size that it had.
   interface restart_list
      module procedure list_integers, list_texts
   end interface restart_list

   !> Kinds of arrays.
   integer, parameter :: of_integers = 1, of_reals = 2, of_texts = 3

contains

   subroutine exchange_integers(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! without slash
      integer, intent(inout) :: values(:)
      integer :: i, first

      call find_values(self, name, of_integers, size(values), i, first)
      if (i == 0) return
      if (self%is_reading) then
         values = self%entry(i)%whole(first:first + size(values) - 1)
      else
         self%entry(i)%whole = [self%entry(i)%whole, values]
      end if
   end subroutine exchange_integers

   subroutine exchange_reals(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      integer :: i, first

      call find_values(self, name, of_reals, size(values), i, first)
      if (i == 0) return
      if (self%is_reading) then
         values = self%entry(i)%state(first:first + size(values) - 1)
      else
         self%entry(i)%state = [self%entry(i)%state, values]
      end if
   end subroutine exchange_reals

   subroutine exchange_integer(self, name, value)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      integer :: values(1)

      values = value
      call exchange_integers(self, name, values)
      value = values(1)
   end subroutine exchange_integer

   subroutine exchange_real(self, name, value)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp) :: values(1)

      values = value
      call exchange_reals(self, name, values)
      value = values(1)
   end subroutine exchange_real

   subroutine exchange_table(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:, :)
      real(wp), allocatable :: column(:)

      allocate(column, source=reshape(values, [size(values)]))
      call exchange_reals(self, name, column)
      values = reshape(column, shape(values))
   end subroutine exchange_table

   subroutine exchange_logical(self, name, value)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      integer :: code

      code = merge(1, 0, value)
      call exchange_integer(self, name, code)
      value = code == 1
   end subroutine exchange_logical

   subroutine exchange_logicals(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: values(:)
      integer, allocatable :: code(:)

      allocate(code, source=merge(1, 0, values))
      call exchange_integers(self, name, code)
      values = code == 1
   end subroutine exchange_logicals

   subroutine list_integers(self, name, list)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: list(:)

      if (self%is_reading) then
         if (allocated(list)) deallocate(list)
         allocate(list(max(0, restart_size(self, name))), source=0)
      end if
      call exchange_integers(self, name, list)
   end subroutine list_integers

   subroutine list_texts(self, name, list)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(string_t), allocatable, intent(inout) :: list(:)
      integer :: i, first

      call find_values(self, name, of_texts, max(0, restart_size(self, name)), i, first)
      if (i == 0) return
      if (self%is_reading) then
         list = self%entry(i)%text
      else
         self%entry(i)%text = list
      end if
   end subroutine list_texts

   !> The array `name` of this kind, and where in it `n` values begin; i = 0: it has not so many.
   subroutine find_values(self, name, kind, n, i, first)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind, n
      integer, intent(out) :: i, first
      logical :: fits

      first = 1
      i = find_entry(self, name)
      if (i == 0 .and. .not. self%is_reading) call entry_add(self, name, kind, i)
      fits = i > 0
      if (fits) fits = entry_kind(self%entry(i)) == kind
      if (fits .and. self%is_reading) then
         first = max(0, self%entry(i)%n_taken) + 1
         self%entry(i)%n_taken = first - 1 + n
         fits = self%entry(i)%n_taken <= entry_size(self%entry(i))
      end if
      if (fits) return
      call note_misfit(self, name, first - 1 + n)
      i = 0
   end subroutine find_values

   !> Add an empty array.
   subroutine entry_add(self, name, kind, i)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: kind                !! one of the `of_` codes
      integer, intent(out) :: i                  !! its place
      type(entry_t), allocatable :: grown(:)

      if (.not. allocated(self%entry)) allocate(self%entry(16))
      if (self%n_entry == size(self%entry)) then
         allocate(grown(2*self%n_entry))
         grown(:self%n_entry) = self%entry
         call move_alloc(grown, self%entry)
      end if
      self%n_entry = self%n_entry + 1
      i = self%n_entry
      self%entry(i)%name = name
      if (kind == of_integers) allocate(self%entry(i)%whole(0))
      if (kind == of_reals) allocate(self%entry(i)%state(0))
      if (kind == of_texts) allocate(self%entry(i)%text(0))
   end subroutine entry_add

   pure integer function find_entry(self, name) result(i)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name

      do i = self%n_entry, 1, -1
         if (self%entry(i)%name == name) exit
      end do
   end function find_entry

   pure integer function entry_size(entry)
      type(entry_t), intent(in) :: entry

      select case (entry_kind(entry))
      case (of_integers)
         entry_size = size(entry%whole)
      case (of_reals)
         entry_size = size(entry%state)
      case default
         entry_size = size(entry%text)
      end select
   end function entry_size

   !> Number of values of the array `name`; -1 if there is none.
   pure integer function restart_size(self, name)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: i

      restart_size = -1
      i = find_entry(self, name)
      if (i > 0) restart_size = entry_size(self%entry(i))
   end function restart_size

   !> Is there an array `name`: to be written, or on reading in the file?
   pure logical function restart_offers(self, name, is_written)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: is_written

      restart_offers = is_written
      if (self%is_reading) restart_offers = find_entry(self, name) > 0
   end function restart_offers

   !> Hand out what is stored, from the first values on.
   pure subroutine restart_rewind(self)
      type(restart_t), intent(inout) :: self

      self%is_reading = .true.
      if (allocated(self%entry)) self%entry%n_taken = -1
      if (allocated(self%error)) deallocate(self%error)
   end subroutine restart_rewind

   !> Tell which array was not as wanted. Arrays that were asked for have to be taken to their ends.
   pure subroutine restart_check(self, error)
      type(restart_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, self%n_entry
         associate (entry => self%entry(i))
            if (entry%n_taken < 0 .or. entry%n_taken == entry_size(entry)) cycle
            call note_misfit(self, entry%name, entry%n_taken)
         end associate
      end do
      call move_alloc(self%error, error)
   end subroutine restart_check

   pure subroutine note_misfit(self, name, n)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n                       !! values wanted
      character(len=:), allocatable :: text

      if (allocated(self%error)) return
      text = "the restart data do not fit the scene: '" // name // "'"
      if (restart_size(self, name) < 0) then
         text = text // " is missing"
      else if (restart_size(self, name) /= n) then
         text = text // " has " // to_text(restart_size(self, name)) // " values, not " &
            // to_text(n)
      else
         text = text // " is of another type"
      end if
      call raise(self%error, err_file, text)
   end subroutine note_misfit

   !> One of the `of_` codes.
   pure integer function entry_kind(entry)
      type(entry_t), intent(in) :: entry

      entry_kind = of_texts
      if (allocated(entry%whole)) entry_kind = of_integers
      if (allocated(entry%state)) entry_kind = of_reals
   end function entry_kind

end module emcon_restart_data
