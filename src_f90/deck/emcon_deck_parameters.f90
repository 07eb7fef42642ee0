!> *PARAMETER: named values, and `<name>` in the lines that follow; `--set` gives other values.
!>
!> A value is an expression, a text in quotes, or words that are no expression, which is a text
!> too (`method = NULL SPACE`).
module emcon_deck_parameters
   use emcon_deck_expression, only : detabbed, digit, evaluate_expression, find_parameter, letter, &
      parameter_list, parameter_t, parameter_table_t, store_parameter
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_text, only : string_t, to_text, to_upper
   implicit none
   private
   public :: parameters_t, parameters_init, parameter_define, unused_override
   public :: substitute_parameters, told_already

   !> Digits that bring a value of kind `wp` back unchanged.
   integer, parameter :: round_trip_digits = 2 + int(real(digits(1.0_wp), wp)*log10(2.0_wp))

   !> The fault of a line whose parameter was refused where it is defined.
   character(len=*), parameter :: told_already = "told already"

   !> A value that the command line sets.
   type :: override_t
      character(len=:), allocatable :: name
      character(len=:), allocatable :: text
      logical :: is_set = .false.                  !! has a name and a value
      logical :: is_used = .false.
   end type override_t

   !> The parameters defined so far, and the values that the command line sets.
   type :: parameters_t
      type(parameter_table_t) :: table
      type(override_t), allocatable :: override(:)
   end type parameters_t

contains

   !> Start without parameters; `overrides` are texts `NAME=VALUE`.
   subroutine parameters_init(self, overrides)
      type(parameters_t), intent(out) :: self
      type(string_t), intent(in) :: overrides(:)
      integer :: i, i_equal

      allocate(self%override(size(overrides)))
      do i = 1, size(overrides)
         associate (text => overrides(i)%text)
            i_equal = index(text, "=")
            self%override(i)%name = to_upper(trim(adjustl(text(:max(i_equal - 1, 0)))))
            self%override(i)%text = trim(adjustl(text(i_equal + 1:)))
            self%override(i)%is_set = is_name(self%override(i)%name) .and. &
               self%override(i)%text /= ""
         end associate
      end do
   end subroutine parameters_init

   !> Take in one data line of *PARAMETER, `name = expression`. `fault` is empty on success.
   subroutine parameter_define(self, line, fault)
      type(parameters_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      character(len=:), allocatable, intent(out) :: fault
      type(parameter_t) :: new
      character(len=:), allocatable :: text
      integer :: i, i_equal

      text = trim(adjustl(detabbed(line)))
      if (index(text, "#") > 0) text = text(:index(text, "#") - 1)
      fault = ""
      if (text == "") return
      i_equal = index(text, "=")
      new%name = to_upper(trim(adjustl(text(:max(i_equal - 1, 0)))))
      if (.not. is_name(new%name)) then
         fault = "*PARAMETER expects name = value, not " // quoted(line)
         return
      end if
      text = trim(adjustl(text(i_equal + 1:)))
      do i = 1, size(self%override)
         if (self%override(i)%name /= new%name .or. .not. self%override(i)%is_set) cycle
         text = self%override(i)%text
         self%override(i)%is_used = .true.
      end do
      call evaluate_text(self, text, new, fault)
      new%is_faulty = fault /= ""
      if (fault /= "") fault = "parameter " // new%name // ": " // fault
      call store_parameter(self%table, new)
   end subroutine parameter_define

   !> The value of a parameter, given by a text in quotes, by words, or by an expression.
   subroutine evaluate_text(self, text, new, fault)
      type(parameters_t), intent(in) :: self
      character(len=*), intent(in) :: text
      type(parameter_t), intent(inout) :: new
      character(len=:), allocatable, intent(out) :: fault
      integer :: n

      fault = ""
      n = len(text)
      if (n > 1) then
         new%is_number = .not. (scan(text(1:1), "'""") == 1 .and. text(1:1) == text(n:n))
      end if
      if (.not. new%is_number) then
         new%text = text(2:n - 1)
         return
      end if
      if (verify(text, letter // digit // " -") == 0 .and. scan(text, letter) == 1) then
         call evaluate_expression(self%table, text, new%value, fault)
         new%is_number = fault == ""
         fault = ""
      else
         call evaluate_expression(self%table, text, new%value, fault)
      end if
      new%text = text
      if (new%is_number) call number_text(new%value, new%text)
   end subroutine evaluate_text

   !> A whole number without point, so that it may stand for a label or a count.
   pure subroutine number_text(value, text)
      real(wp), intent(in) :: value
      character(len=:), allocatable, intent(out) :: text

      if (abs(value) < real(huge(1), wp)) then
         if (value == anint(value)) then
            text = to_text(nint(value))
            return
         end if
      end if
      text = to_text(value, round_trip_digits)
   end subroutine number_text

   !> What is wrong with an override once all is read: it sets nothing; empty: nothing. What could
   !> be set is told.
   pure subroutine unused_override(self, i, fault)
      type(parameters_t), intent(in) :: self
      integer, intent(in) :: i                     !! 1..size(override)
      character(len=:), allocatable, intent(out) :: fault
      integer :: k

      fault = ""
      if (self%override(i)%is_used) return
      if (self%override(i)%is_set) then
         fault = "the deck has no parameter " // quoted(self%override(i)%name) &
            // suggestion(self%override(i)%name, parameter_list(self%table))
      else
         fault = "a parameter of the deck is set by NAME=VALUE"
      end if
      if (self%table%n == 0) then
         fault = fault // " (it has no *PARAMETER)"
      else
         fault = fault // " (known: "
         do k = 1, self%table%n
            associate (item => self%table%item(k))
               if (k > 1) fault = fault // ", "
               if (item%is_number) then
                  fault = fault // item%name // "=" // to_text(item%value)
               else
                  fault = fault // item%name // "=" // item%text
               end if
            end associate
         end do
         fault = fault // ")"
      end if
   end subroutine unused_override

   !> Put the values of parameters in the place of `<name>`. `fault` is empty on success.
   subroutine substitute_parameters(self, line, text, fault)
      type(parameters_t), intent(in) :: self
      character(len=*), intent(in) :: line
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable, intent(out) :: fault
      character(len=:), allocatable :: name
      integer :: first, i_open, n, i

      text = ""
      fault = ""
      first = 1
      do
         i_open = index(line(first:), "<") + first - 1
         if (i_open < first) exit
         n = index(line(i_open:), ">") - 2
         if (n < 0) exit
         name = to_upper(trim(adjustl(line(i_open + 1:i_open + n))))
         i = find_parameter(self%table, name)
         if (i == 0) then
            fault = "unknown parameter <" // name // ">" &
               // suggestion(name, parameter_list(self%table))
            text = line
            return
         else if (self%table%item(i)%is_faulty) then
            fault = told_already
            text = line
            return
         end if
         text = text // line(first:i_open - 1) // self%table%item(i)%text
         first = i_open + n + 2
      end do
      text = text // line(first:)
   end subroutine substitute_parameters

   pure logical function is_name(text)
      character(len=*), intent(in) :: text

      is_name = scan(text, letter) == 1 .and. verify(text, letter // digit) == 0
   end function is_name

end module emcon_deck_parameters
