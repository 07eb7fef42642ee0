!> Python-like arithmetic of decks: + - * / ** ( ), sqrt sin cos tan exp log abs, pi, names.
!>
!> Differences to Python: names do not distinguish case, and `/` never rounds. Every operation is
!> looked at before it is done: no value overflows, faults are texts.
module emcon_deck_expression
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find, name_index_put, name_index_t
   use emcon_text, only : read_real, string_t, to_upper
   implicit none
   private
   public :: parameter_t, parameter_table_t, store_parameter, find_parameter, parameter_list
   public :: evaluate_expression, detabbed, letter, digit

   integer, parameter :: max_nesting = 100         !! of parentheses and signs
   character(len=*), parameter :: digit = "0123456789", &
      letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_"

   !> A named value: a number or a text.
   type :: parameter_t
      character(len=:), allocatable :: name        !! upper case
      character(len=:), allocatable :: text        !! what `<name>` becomes
      real(wp) :: value = 0.0_wp
      logical :: is_number = .true.
      logical :: is_faulty = .false.               !! its definition was refused
   end type parameter_t

   !> The values known so far.
   type :: parameter_table_t
      integer :: n = 0
      type(parameter_t), allocatable :: item(:)
      type(name_index_t), private :: index_of      !! where in `item` a name is
   end type parameter_table_t

   !> An expression while it is read. A fault stops the reading.
   type :: expression_t
      character(len=:), allocatable :: text
      integer :: i = 1                             !! next character
      integer :: depth = 0
      character(len=:), allocatable :: fault       !! empty: none
   end type expression_t

contains

   !> Add a parameter, or give it a new value.
   subroutine store_parameter(self, new)
      type(parameter_table_t), intent(inout) :: self
      type(parameter_t), intent(in) :: new
      type(parameter_t), allocatable :: grown(:)
      integer :: i

      if (.not. allocated(self%item)) allocate(self%item(8))
      i = find_parameter(self, new%name)
      if (i == 0) then
         if (self%n == size(self%item)) then
            allocate(grown(2*self%n))
            grown(:self%n) = self%item
            call move_alloc(grown, self%item)
         end if
         self%n = self%n + 1
         i = self%n
         call name_index_put(self%index_of, new%name, i)
      end if
      self%item(i) = new
   end subroutine store_parameter

   !> Index of the parameter `name` (upper case), 0: unknown.
   pure integer function find_parameter(self, name)
      type(parameter_table_t), intent(in) :: self
      character(len=*), intent(in) :: name

      find_parameter = name_index_find(self%index_of, name)
   end function find_parameter

   !> All names, for suggestions.
   pure function parameter_list(self) result(list)
      type(parameter_table_t), intent(in) :: self
      type(string_t), allocatable :: list(:)
      integer :: i

      allocate(list(self%n))
      do i = 1, self%n
         list(i)%text = self%item(i)%name
      end do
   end function parameter_list

   !> Value of the expression `text` over the parameters of `self`. `fault` is empty on success.
   subroutine evaluate_expression(self, text, value, fault)
      type(parameter_table_t), intent(in) :: self
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      character(len=:), allocatable, intent(out) :: fault
      type(expression_t) :: expression
      character(len=2) :: mark

      expression%text = detabbed(text)
      expression%fault = ""
      call read_sum(self, expression, value)
      mark = next_mark(expression)
      if (expression%fault == "" .and. mark /= "") then
         expression%fault = quoted(text(expression%i:)) // " is not understood in " // quoted(text)
      end if
      fault = expression%fault
      if (fault /= "") value = 0.0_wp
   end subroutine evaluate_expression

   recursive subroutine read_sum(self, expression, value)
      type(parameter_table_t), intent(in) :: self
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value
      character(len=2) :: mark
      real(wp) :: right

      call read_product(self, expression, value)
      do while (expression%fault == "")
         mark = next_mark(expression)
         if (mark /= "+" .and. mark /= "-") exit
         expression%i = expression%i + 1
         call read_product(self, expression, right)
         if (mark == "-") right = -right
         if (max(exponent(value), exponent(right)) >= maxexponent(1.0_wp)) then
            expression%fault = "a sum is too large"
         else
            value = value + right
         end if
      end do
   end subroutine read_sum

   recursive subroutine read_product(self, expression, value)
      type(parameter_table_t), intent(in) :: self
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value
      character(len=2) :: mark
      real(wp) :: right

      call read_factor(self, expression, value)
      do while (expression%fault == "")
         mark = next_mark(expression)
         if (mark /= "*" .and. mark /= "/") exit
         expression%i = expression%i + 1
         call read_factor(self, expression, right)
         if (expression%fault /= "") exit
         if (mark == "/" .and. right == 0.0_wp) then
            expression%fault = "division by zero"
         else if (mark == "/") then
            if (exponent(value) - exponent(right) + 1 > maxexponent(1.0_wp)) then
               expression%fault = "a quotient is too large"
            else
               value = value/right
            end if
         else if (exponent(value) + exponent(right) > maxexponent(1.0_wp)) then
            expression%fault = "a product is too large"
         else
            value = value*right
         end if
      end do
   end subroutine read_product

   !> A sign binds weaker than a power: -2**2 = -4.
   recursive subroutine read_factor(self, expression, value)
      type(parameter_table_t), intent(in) :: self
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value
      character(len=2) :: mark
      real(wp) :: power

      value = 0.0_wp
      expression%depth = expression%depth + 1
      if (expression%depth > max_nesting) expression%fault = "it is nested too deep"
      if (expression%fault /= "") return
      mark = next_mark(expression)
      if (mark == "+" .or. mark == "-") then
         expression%i = expression%i + 1
         call read_factor(self, expression, value)
         if (mark == "-") value = -value
      else
         call read_atom(self, expression, value)
         if (expression%fault /= "") return
         if (next_mark(expression) == "**") then
            expression%i = expression%i + 2
            call read_factor(self, expression, power)
            if (expression%fault == "") call raise_power(value, power, expression%fault)
         end if
      end if
      expression%depth = expression%depth - 1
   end subroutine read_factor

   !> value**power, or the reason why not.
   pure subroutine raise_power(value, power, fault)
      real(wp), intent(inout) :: value
      real(wp), intent(in) :: power
      character(len=:), allocatable, intent(inout) :: fault
      logical :: is_whole
      real(wp) :: two_log

      is_whole = abs(power) < real(huge(1), wp)
      if (is_whole) is_whole = power == anint(power)
      if (value == 0.0_wp) then
         if (power < 0.0_wp) fault = "zero to a negative power"
         if (power == 0.0_wp) value = 1.0_wp
         return
      else if (value < 0.0_wp .and. .not. is_whole) then
         fault = "a negative number to a power that is not whole"
         return
      end if
      ! The exponent of the result in base two, kept from overflow itself.
      two_log = log(abs(value))/log(2.0_wp)*min(max(power, -1.0e9_wp), 1.0e9_wp)
      if (two_log > real(maxexponent(1.0_wp) - 2, wp)) then
         fault = "a power is too large"
      else if (two_log < real(-maxexponent(1.0_wp) + 2, wp)) then
         value = 0.0_wp
      else if (is_whole) then
         value = value**nint(power)
      else
         value = value**power
      end if
   end subroutine raise_power

   !> A number, a name, a function of an expression, or an expression in parentheses.
   recursive subroutine read_atom(self, expression, value)
      type(parameter_table_t), intent(in) :: self
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value
      character(len=:), allocatable :: word
      character(len=2) :: mark

      value = 0.0_wp
      mark = next_mark(expression)
      if (mark == "") then
         expression%fault = "the expression ends too early"
      else if (mark == "(") then
         call read_parentheses(self, expression, value)
      else if (scan(mark, digit // ".") == 1) then
         call read_number(expression, value)
      else if (scan(mark, letter) == 1) then
         call next_word(expression, word)
         if (next_mark(expression) == "(") then
            call read_parentheses(self, expression, value)
            if (expression%fault == "") call apply_function(word, value, expression%fault)
         else
            call look_up(self, word, value, expression%fault)
         end if
      else
         expression%fault = quoted(mark) // " is not expected"
      end if
   end subroutine read_atom

   recursive subroutine read_parentheses(self, expression, value)
      type(parameter_table_t), intent(in) :: self
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value

      expression%i = expression%i + 1
      call read_sum(self, expression, value)
      if (expression%fault /= "") return
      if (next_mark(expression) /= ")") then
         expression%fault = "a closing parenthesis is missing"
      else
         expression%i = expression%i + 1
      end if
   end subroutine read_parentheses

   subroutine read_number(expression, value)
      type(expression_t), intent(inout) :: expression
      real(wp), intent(out) :: value
      integer :: last
      logical :: ok

      associate (text => expression%text, first => expression%i)
         last = first
         do while (last <= len(text))
            if (scan(text(last:last), digit // ".eEdD") == 0) then
               if (scan(text(last:last), "+-") == 0 .or. last == first) exit
               if (scan(text(last - 1:last - 1), "eEdD") == 0) exit
            end if
            last = last + 1
         end do
         call read_real(text(first:last - 1), value, ok)
         if (.not. ok) expression%fault = quoted(text(first:last - 1)) // " is not a number"
         first = last
      end associate
   end subroutine read_number

   subroutine look_up(self, word, value, fault)
      type(parameter_table_t), intent(in) :: self
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: value
      character(len=:), allocatable, intent(inout) :: fault
      integer :: i

      value = 0.0_wp
      i = find_parameter(self, word)
      if (i > 0) then
         value = self%item(i)%value
         if (.not. self%item(i)%is_number) fault = "parameter " // word // " is a text"
      else if (word == "PI") then
         value = acos(-1.0_wp)
      else
         fault = "unknown parameter " // quoted(word) // suggestion(word, parameter_list(self))
      end if
   end subroutine look_up

   pure subroutine apply_function(name, value, fault)
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      character(len=:), allocatable, intent(inout) :: fault

      select case (name)
      case ("SQRT")
         if (value < 0.0_wp) then
            fault = "square root of a negative number"
         else
            value = sqrt(value)
         end if
      case ("LOG")
         if (value <= 0.0_wp) then
            fault = "logarithm of a number that is not positive"
         else
            value = log(value)
         end if
      case ("EXP")
         if (value > log(huge(1.0_wp))) then
            fault = "an exponential is too large"
         else
            value = exp(max(value, -log(huge(1.0_wp))))
         end if
      case ("SIN")
         value = sin(value)
      case ("COS")
         value = cos(value)
      case ("TAN")
         value = tan(value)
      case ("ABS")
         value = abs(value)
      case default
         fault = "unknown function " // quoted(name) // "; known: sqrt sin cos tan exp log abs"
      end select
   end subroutine apply_function

   !> The next character that is not blank, or `**`, without taking it; empty at the end.
   function next_mark(expression) result(mark)
      type(expression_t), intent(inout) :: expression
      character(len=2) :: mark
      integer :: n

      associate (text => expression%text, i => expression%i)
         n = len(text)
         do while (i <= n)
            if (text(i:i) /= " ") exit
            i = i + 1
         end do
         mark = text(i:min(i, n))
         if (i < n) then
            if (text(i:i + 1) == "**") mark = "**"
         end if
      end associate
   end function next_mark

   !> Take a name; upper case.
   subroutine next_word(expression, word)
      type(expression_t), intent(inout) :: expression
      character(len=:), allocatable, intent(out) :: word
      integer :: n

      associate (text => expression%text, i => expression%i)
         n = verify(text(i:), letter // digit) - 1
         if (n < 0) n = len(text) - i + 1
         word = to_upper(text(i:i + n - 1))
         i = i + n
      end associate
   end subroutine next_word

   !> `line` with blanks for tabs.
   pure function detabbed(line) result(text)
      character(len=*), intent(in) :: line
      character(len=len(line)) :: text
      integer :: i

      text = line
      do i = 1, len(line)
         if (line(i:i) == achar(9)) text(i:i) = " "
      end do
   end function detabbed

end module emcon_deck_expression
