!> Parts and instances: a deck of *PART, *ASSEMBLY and *INSTANCE as the flat text of the same model.
!>
!> An instance is the text of its part with labels of its own, names that begin with that of the
!> instance and a point, and nodes moved as its data lines say. Each line keeps the file and the
!> number that it has in the deck.
module emcon_deck_parts
   use emcon_deck_source, only : deck_source_t
   use emcon_deck_text, only : bare_name, field, fields_t, gather_keyword, is_comment, keyword_of, &
      option_place, option_t, option_value, split_fields, split_keyword
   use emcon_diagnostics, only : add_error, diagnostics_t, quoted
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_rotation, only : cross_product
   use emcon_text, only : read_integer, read_real, to_text
   implicit none
   private
   public :: parts_are_used, parts_flatten

   integer, parameter :: n_axis = 3
   !> Fields of GENERATE that are labels, and of a point of a profile; those of a term of *EQUATION.
   integer, parameter :: n_ends = 2, n_term = 3
   character(len=*), parameter :: digits = "0123456789"

   !> Lines of a part, from behind *PART to before *END PART.
   type :: part_t
      character(len=:), allocatable :: name        !! upper case, without blanks
      integer :: first = 1, last = 0
   end type part_t

   !> What becomes of labels, names and places of an instance; as it is made: nothing.
   type :: instance_t
      character(len=:), allocatable :: name        !! upper case, without blanks; empty: none
      integer :: shift = 0                         !! of its labels
      logical :: is_moved = .false.
      real(wp) :: way(n_axis) = 0.0_wp             !! first, [L]
      real(wp) :: center(n_axis) = 0.0_wp          !! then turned about this point [L]
      real(wp) :: axis(n_axis) = 0.0_wp            !! and this unit vector
      real(wp) :: angle = 0.0_wp                   !! by that [rad]
   end type instance_t

   !> A card of the source.
   type :: card_text_t
      integer :: line = 0                          !! where it begins,
      integer :: last = 0                          !! ends,
      integer :: data = 0                          !! and where its data lines begin
      character(len=:), allocatable :: title       !! as typed, with its star
      character(len=:), allocatable :: name        !! upper case, without blanks and star
      type(option_t), allocatable :: option(:)
   end type card_text_t

   !> The flat text as it grows.
   type :: flat_t
      type(deck_source_t) :: text
      type(part_t), allocatable :: part(:)
      type(instance_t), allocatable :: instance(:)
      integer :: n = 0                             !! lines so far
      integer :: unit = 1                          !! labels of all parts are smaller
      logical :: in_assembly = .false.
      logical :: has_own = .false.                 !! nodes or elements outside of all parts
      logical :: is_sound = .true.                 !! nothing is wrong with parts and instances
      integer :: n_instance = 0                    !! in all
   end type flat_t

contains

   !> Does the deck have parts or instances?
   pure logical function parts_are_used(source)
      type(deck_source_t), intent(in) :: source
      integer :: i

      parts_are_used = .false.
      do i = 1, size(source%line)
         parts_are_used = any(keyword_of(source%line(i)%text) == [character(len=11) :: "PART", &
            "INSTANCE", "ASSEMBLY", "ENDPART", "ENDINSTANCE", "ENDASSEMBLY"])
         if (parts_are_used) return
      end do
   end function parts_are_used

   !> The same deck without parts: `flat`. What is wrong with these is added to `log`.
   subroutine parts_flatten(source, flat, labels, log)
      type(deck_source_t), intent(in) :: source
      type(deck_source_t), intent(out) :: flat
      character(len=:), allocatable, intent(out) :: labels   !! what those of instances begin with
      type(diagnostics_t), intent(inout) :: log
      type(flat_t) :: self
      type(card_text_t) :: card
      integer :: i, n_before

      allocate(self%instance(0))
      allocate(self%text%line(64), self%text%file(64), self%text%number(64))
      self%text%file_name = source%file_name
      n_before = log%n_errors
      call find_parts(source, self, log)
      self%is_sound = log%n_errors == n_before
      ! What stands in the wrong place would be read as something else: all that follows is wrong.
      i = merge(1, size(source%line) + 1, self%is_sound)
      do while (i <= size(source%line))
         call read_card(source, i, card)
         i = card%last + 1
         select case (card%name)
         case ("PART")
            i = end_of(source, card, "ENDPART") + 1
         case ("INSTANCE")
            i = end_of(source, card, "ENDINSTANCE") + 1
            call put_instance(source, card, self, log)
         case ("ASSEMBLY")
            self%in_assembly = .true.
         case ("ENDPART", "ENDINSTANCE", "ENDASSEMBLY")
            if (self%is_sound .and. .not. (self%in_assembly .and. card%name == "ENDASSEMBLY")) &
               call add_error(log, origin_of(source, card%line), card%title // " ends nothing")
            self%in_assembly = self%in_assembly .and. card%name /= "ENDASSEMBLY"
         case default
            call put_own(source, card, self, log)
         end select
      end do
      labels = "labels"
      do i = 1, size(self%instance)
         if (i > 1) labels = labels // ","
         labels = labels // " " // self%instance(i)%name // " + " &
            // to_text(self%instance(i)%shift)
      end do
      flat = self%text
      flat%line = self%text%line(:self%n)
      flat%file = self%text%file(:self%n)
      flat%number = self%text%number(:self%n)
   end subroutine parts_flatten

   !> The parts, and a unit above all labels in them.
   subroutine find_parts(source, self, log)
      type(deck_source_t), intent(in) :: source
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      type(card_text_t) :: card
      type(part_t) :: part
      character(len=:), allocatable :: inside, outside
      integer :: i

      allocate(self%part(0))
      inside = ""
      outside = ""
      i = 1
      do while (i <= size(source%line))
         call read_card(source, i, card)
         i = card%last + 1
         if (has_no_end(source, card)) then
            call add_error(log, origin_of(source, card%line), "*END " // card%name // " is missing")
            return
         end if
         call follow(source, card, inside, outside, log)
         if (any(card%name == [character(len=7) :: "NODE", "ELEMENT"])) then
            self%has_own = self%has_own .or. inside // outside == ""
            call raise_unit(source, card, self)
         else if (card%name == "INSTANCE") then
            self%n_instance = self%n_instance + 1
         else if (card%name == "PART") then
            part%name = option_value(card%option, "NAME")
            part%first = card%data
            part%last = end_of(source, card, "ENDPART") - 1
            if (part%name == "") call add_error(log, origin_of(source, card%line), &
               "*PART needs NAME=")
            if (part_number(self, part%name) > 0) call add_error(log, &
               origin_of(source, card%line), "part " // quoted(part%name) // " is given twice")
            self%part = [self%part, part]
         end if
      end do
   end subroutine find_parts

   !> Does a card begin what nothing ends?
   pure logical function has_no_end(source, card)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card

      has_no_end = any(card%name == [character(len=8) :: "PART", "INSTANCE", "ASSEMBLY"])
      if (has_no_end) has_no_end = end_of(source, card, "END" // card%name) > size(source%line)
   end function has_no_end

   !> What a card stands in. Parts and instances hold neither parts nor instances, an assembly no
   !> assembly; what belongs to the whole model stands in none of them.
   subroutine follow(source, card, inside, outside, log)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      character(len=:), allocatable, intent(inout) :: inside   !! PART, INSTANCE or nothing,
      character(len=:), allocatable, intent(inout) :: outside  !! and ASSEMBLY or nothing, around it
      type(diagnostics_t), intent(inout) :: log
      character(len=:), allocatable :: around

      around = inside
      select case (card%name)
      case ("PART", "INSTANCE")
         if (inside == "") inside = card%name
      case ("ASSEMBLY")
         if (inside == "") around = outside
         outside = card%name
      case ("MATERIAL", "STEP")
         if (inside == "") around = outside
      case default
         around = ""
         if (card%name == "END" // inside) inside = ""
         if (card%name == "ENDASSEMBLY") outside = ""
      end select
      if (around /= "") call add_error(log, origin_of(source, card%line), card%title &
         // " may not stand between *" // around // " and *END " // around)
   end subroutine follow

   !> Labels of a card lie below the unit.
   subroutine raise_unit(source, card, self)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      type(flat_t), intent(inout) :: self
      type(fields_t) :: data
      integer :: i, label
      logical :: ok

      do i = card%data, card%last
         call split_fields(data, source%line(i)%text)
         call read_integer(field(data, 1), label, ok)
         do while (ok .and. self%unit <= label &
            .and. 10.0_wp*real(self%unit, wp) < real(huge(1), wp))
            self%unit = 10*self%unit
         end do
      end do
   end subroutine raise_unit

   pure integer function part_number(self, name) result(k)
      type(flat_t), intent(in) :: self
      character(len=*), intent(in) :: name

      do k = size(self%part), 1, -1
         if (self%part(k)%name == name) return
      end do
   end function part_number

   pure integer function instance_number(self, name) result(k)
      type(flat_t), intent(in) :: self
      character(len=*), intent(in) :: name

      do k = size(self%instance), 1, -1
         if (self%instance(k)%name == name) return
      end do
   end function instance_number

   !> An instance: its part, and what it says itself, up to *END INSTANCE.
   subroutine put_instance(source, card, self, log)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      type(instance_t) :: instance
      character(len=:), allocatable :: fault
      integer :: k, last

      fault = ""
      instance%name = option_value(card%option, "NAME")
      instance%shift = self%unit*size(self%instance)
      k = part_number(self, option_value(card%option, "PART"))
      last = end_of(source, card, "ENDINSTANCE")
      if (.not. self%in_assembly) fault = "*INSTANCE stands in *ASSEMBLY alone"
      if (instance%name == "") fault = "*INSTANCE needs NAME="
      if (instance_number(self, instance%name) > 0) fault = "instance " // quoted(instance%name) &
         // " is given twice"
      if (k == 0) fault = "*INSTANCE: there is no part " &
         // quoted(option_value(card%option, "PART"))
      if (real(self%unit, wp)*real(self%n_instance + 1, wp) > real(huge(1), wp)) fault = &
         "labels are too large for so many instances"
      if (fault /= "") then
         ! Others have the same fault, or follow from it.
         if (self%is_sound) call add_error(log, origin_of(source, card%line), fault)
         self%is_sound = .false.
         return
      end if
      call read_motion(source, card, instance, log)
      self%instance = [self%instance, instance]
      call put_lines(source, self%part(k)%first, self%part(k)%last, instance, self, log)
      call put_lines(source, card%last + 1, last - 1, instance, self, log)
   end subroutine put_instance

   !> The data lines of an instance: a way, then two points of an axis and an angle in degrees.
   subroutine read_motion(source, card, instance, log)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      type(instance_t), intent(inout) :: instance
      type(diagnostics_t), intent(inout) :: log
      real(wp), parameter :: degree = atan(1.0_wp)/45.0_wp
      real(wp) :: value(2*n_axis + 1), axis(n_axis)
      type(fields_t) :: data
      integer :: k, i, line
      logical :: ok, all_ok

      k = 0
      do line = card%data, card%last
         if (is_comment(source%line(line)%text)) cycle
         k = k + 1
         value = 0.0_wp
         call split_fields(data, source%line(line)%text)
         all_ok = data%n <= merge(n_axis, size(value), k == 1)
         do i = 1, min(size(value), data%n)
            if (field(data, i) == "") cycle
            call read_real(field(data, i), value(i), ok)
            all_ok = all_ok .and. ok
         end do
         axis = value(n_axis + 1:2*n_axis) - value(:n_axis)
         if (k == 2) all_ok = all_ok .and. any(abs(axis) > 0.0_wp)
         if (k > 2 .or. .not. all_ok) then
            call add_error(log, origin_of(source, line), "*INSTANCE: expected a line of the way " &
               // "x, y, z and one of two points of an axis and an angle in degrees")
            return
         end if
         instance%is_moved = instance%is_moved .or. any(abs(value) > 0.0_wp)
         if (k == 1) then
            instance%way = value(:n_axis)
         else
            instance%center = value(:n_axis)
            instance%axis = axis/norm2(axis)
            instance%angle = degree*value(size(value))
         end if
      end do
   end subroutine read_motion

   !> Where a node of an instance comes to lie.
   pure function moved(instance, x) result(place)
      type(instance_t), intent(in) :: instance
      real(wp), intent(in) :: x(n_axis)          !! in the part [L]
      real(wp) :: place(n_axis), across(n_axis)

      place = x + instance%way
      across = cross_product(instance%axis, place - instance%center)
      place = place + (sin(instance%angle)*across &
         + 2.0_wp*sin(0.5_wp*instance%angle)**2*cross_product(instance%axis, across))
   end function moved

   !> The cards of some lines, as an instance has them.
   subroutine put_lines(source, first, last, instance, self, log)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: first, last
      type(instance_t), intent(in) :: instance
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      type(card_text_t) :: card
      integer :: i

      i = first
      do while (i <= last)
         call read_card(source, i, card)
         card%last = min(card%last, last)
         i = card%last + 1
         call put_card(source, card, instance, self, log)
      end do
   end subroutine put_lines

   !> A card of the assembly, where INSTANCE= says of which instance it speaks, or of the deck.
   subroutine put_own(source, card, self, log)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      type(instance_t) :: instance
      character(len=:), allocatable :: name
      integer :: k

      instance%name = ""
      ! Labels of the assembly itself lie behind those of all instances.
      if (self%in_assembly) instance%shift = self%unit*self%n_instance
      name = option_value(card%option, "INSTANCE")
      if (name /= "") then
         k = instance_number(self, name)
         if (k == 0) then
            if (self%is_sound) call add_error(log, origin_of(source, card%line), card%title &
               // ": there is no instance " // quoted(name))
            return
         end if
         instance%shift = self%instance(k)%shift
         instance%name = name
      end if
      call put_card(source, card, instance, self, log, is_own=.true.)
   end subroutine put_own

   !> A card with labels, names and places of `instance`; what the assembly calls by names of its
   !> own keeps these.
   subroutine put_card(source, card, instance, self, log, is_own)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      type(instance_t), intent(in) :: instance
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      logical, intent(in), optional :: is_own
      character(len=:), allocatable :: line
      type(fields_t) :: data
      integer :: i
      logical :: keeps_names

      keeps_names = .false.
      if (present(is_own)) keeps_names = is_own
      if (card%name /= "") then
         call make_keyword_line(self, card, instance, keeps_names, line)
         call put_line(self, line, source, card%line)
      end if
      if (card%name == "TRANSFORM" .and. instance%is_moved) call add_error(log, origin_of(source, &
         card%line), card%title // ": axes do not move with an instance; put it into the assembly")
      do i = card%data, card%last
         if (is_comment(source%line(i)%text)) cycle
         call split_fields(data, source%line(i)%text)
         if (card%name == "NODE" .and. instance%is_moved) then
            call put_node(source, i, data, instance, self, log)
            cycle
         end if
         if (has_stray_label(self, card, data, instance)) then
            call add_error(log, origin_of(source, i), card%title // ": a label here is none of " &
               // "the part")
         else if (has_bare_label(self, card, data, instance)) then
            call add_error(log, origin_of(source, i), card%title // ": " // field(data, 1) &
               // " may be a label of any instance; write INSTANCE." // field(data, 1) &
               // ", with the name of one")
         end if
         if (is_wall(card) .and. instance%is_moved) then
            call add_error(log, origin_of(source, i), card%title // ": a shape in space is not " &
               // "moved with the instance of a part in this version; define it in the assembly")
            return
         else if (is_profile(card) .and. instance%is_moved) then
            call make_profile_line(data, instance, line)
         else
            call make_data_line(self, card, data, instance, line)
         end if
         call put_line(self, line, source, i)
      end do
   end subroutine put_card

   !> The keyword line with the names of an instance, without INSTANCE=.
   pure subroutine make_keyword_line(self, card, instance, keeps_names, line)
      type(flat_t), intent(in) :: self
      type(card_text_t), intent(in) :: card
      type(instance_t), intent(in) :: instance
      logical, intent(in) :: keeps_names
      character(len=:), allocatable, intent(out) :: line
      character(len=:), allocatable :: word
      integer :: i

      line = card%title
      do i = 1, size(card%option)
         associate (option => card%option(i))
            if (option%name == "INSTANCE" .and. keeps_names) cycle
            line = line // ", " // option%typed
            if (.not. option%has_value) cycle
            if (.not. keeps_names .and. (option%name == "NSET" .or. option%name == "ELSET" &
               .or. (option%name == "NAME" .and. card%name == "SURFACE"))) then
               line = line // "=" // instance%name // "." // bare_name(option%value)
            else if (option%name == "REFNODE") then
               call make_field(self, option%value, instance, is_label=.not. keeps_names &
                  .or. verify(option%value, digits) == 0, word=word)
               line = line // "=" // word
            else
               line = line // "=" // option%value
            end if
         end associate
      end do
   end subroutine make_keyword_line

   !> A data line with the labels and names of an instance.
   pure subroutine make_data_line(self, card, data, instance, line)
      type(flat_t), intent(in) :: self
      type(card_text_t), intent(in) :: card
      type(fields_t), intent(in) :: data
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable, intent(out) :: line
      character(len=:), allocatable :: word
      integer :: i

      line = ""
      do i = 1, data%n
         if (i > 1) line = line // ","
         call make_field(self, field(data, i), instance, is_label(card, i, data%n), word)
         line = line // word
      end do
      if (data%ends_in_comma) line = line // ","
   end subroutine make_data_line

   !> Is field `i` of the `n` of a data line a label, or the name of a set?
   pure logical function is_label(card, i, n)
      type(card_text_t), intent(in) :: card
      integer, intent(in) :: i, n

      select case (card%name)
      case ("NODE", "BOUNDARY", "INITIALCONDITIONS")
         is_label = i == 1
      case ("ELEMENT")
         is_label = .true.
      case ("NSET", "ELSET")
         is_label = i <= n_ends .or. option_place(card%option, "GENERATE") == 0
      case ("SURFACE")
         is_label = i == 1 .and. .not. (is_profile(card) .or. is_wall(card))
      case ("EQUATION")                          ! node, degree of freedom, coefficient
         is_label = n > 1 .and. mod(i - 1, n_term) == 0
      case default
         is_label = .false.
      end select
   end function is_label

   pure logical function is_profile(card)
      type(card_text_t), intent(in) :: card

      is_profile = card%name == "SURFACE" .and. option_value(card%option, "TYPE") == "SEGMENTS"
   end function is_profile

   !> A shape in space: its lines are coordinates.
   pure logical function is_wall(card)
      type(card_text_t), intent(in) :: card

      is_wall = card%name == "SURFACE" .and. any(option_value(card%option, "TYPE") == [ &
         character(len=10) :: "PLANE", "SPHERE", "REVOLUTION", "CYLINDER", "STL"])
   end function is_wall

   !> Does a line name a label that no part can have? It would be one of another instance.
   pure logical function has_stray_label(self, card, data, instance)
      type(flat_t), intent(in) :: self
      type(card_text_t), intent(in) :: card
      type(fields_t), intent(in) :: data
      type(instance_t), intent(in) :: instance
      integer :: i, label
      logical :: ok

      has_stray_label = .false.
      if (instance%name == "" .and. .not. self%in_assembly) return
      do i = 1, data%n
         if (.not. is_label(card, i, data%n)) cycle
         call read_integer(field(data, i), label, ok)
         has_stray_label = has_stray_label .or. (ok .and. (label < 1 .or. label >= self%unit))
      end do
   end function has_stray_label

   !> Does a line that stands in no part and no assembly begin with a label, where all nodes and
   !> elements are those of parts?
   pure logical function has_bare_label(self, card, data, instance)
      type(flat_t), intent(in) :: self
      type(card_text_t), intent(in) :: card
      type(fields_t), intent(in) :: data
      type(instance_t), intent(in) :: instance
      integer :: label

      has_bare_label = .false.
      if (instance%name /= "" .or. self%in_assembly .or. self%has_own) return
      if (all(card%name /= [character(len=17) :: "BOUNDARY", "CLOAD", "DLOAD", "NSET", "ELSET", &
         "SURFACE", "INITIALCONDITIONS"]) .or. is_profile(card) .or. is_wall(card)) return
      call read_integer(field(data, 1), label, has_bare_label)
   end function has_bare_label

   !> A segment of a profile that is moved: a word, then points.
   pure subroutine make_profile_line(data, instance, line)
      type(fields_t), intent(in) :: data
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable, intent(out) :: line
      character(len=26) :: number
      real(wp) :: x(n_axis)
      logical :: ok(n_ends)
      integer :: i, k

      line = field(data, 1)
      do i = n_ends, data%n - 1, n_ends
         x = 0.0_wp
         do k = 1, n_ends
            call read_real(field(data, i + k - 1), x(k), ok(k))
         end do
         if (.not. all(ok)) exit
         x = moved(instance, x)
         do k = 1, n_ends
            write(number, "(es26.17e3)") x(k)
            line = line // ", " // trim(adjustl(number))
         end do
      end do
      if (i < data%n) line = data%text           ! the reader tells what is no number
   end subroutine make_profile_line

   !> A field: labels and names of an instance, and labels such as INSTANCE.7 anywhere.
   pure subroutine make_field(self, text, instance, is_label, word)
      type(flat_t), intent(in) :: self
      character(len=*), intent(in) :: text
      type(instance_t), intent(in) :: instance
      logical, intent(in) :: is_label
      character(len=:), allocatable, intent(out) :: word
      integer :: label, i, k
      logical :: ok

      word = text
      if (text == "") return
      call read_integer(text, label, ok)
      if (ok) then
         if (is_label .and. abs(label) < self%unit) word = to_text(label + instance%shift)
         return
      end if
      i = index(text, ".", back=.true.)
      k = 0
      if (i > 1) k = instance_number(self, bare_name(text(:i - 1)))
      if (k > 0) call read_integer(text(i + 1:), label, ok)
      if (ok) then
         word = to_text(label + self%instance(k)%shift)
      else if (is_label .and. instance%name /= "" .and. k == 0) then
         word = instance%name // "." // bare_name(text)
      end if
   end subroutine make_field

   !> A node of an instance that is moved.
   subroutine put_node(source, line, data, instance, self, log)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line
      type(fields_t), intent(in) :: data         !! of that line
      type(instance_t), intent(in) :: instance
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      character(len=:), allocatable :: text
      character(len=26) :: number
      real(wp) :: x(n_axis)
      integer :: i
      logical :: ok

      x = 0.0_wp
      do i = 1, n_axis
         if (field(data, i + 1) == "") cycle
         call read_real(field(data, i + 1), x(i), ok)
         if (ok) cycle
         call add_error(log, origin_of(source, line), "coordinate " // quoted(field(data, i + 1)) &
            // " of a part that is moved is not a number")
         return
      end do
      x = moved(instance, x)
      call make_field(self, field(data, 1), instance, .true., text)
      do i = 1, merge(n_axis, n_axis - 1, data%n > n_axis .or. abs(x(n_axis)) > 0.0_wp)
         write(number, "(es26.17e3)") x(i)
         text = text // ", " // trim(adjustl(number))
      end do
      call put_line(self, text, source, line)
   end subroutine put_node

   !> One more line, which stands where that of the source does.
   subroutine put_line(self, text, source, line)
      type(flat_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line
      type(deck_source_t) :: grown

      if (self%n == size(self%text%file)) then
         allocate(grown%line(2*self%n), grown%file(2*self%n), grown%number(2*self%n))
         grown%line(:self%n) = self%text%line
         grown%file(:self%n) = self%text%file
         grown%number(:self%n) = self%text%number
         call move_alloc(grown%line, self%text%line)
         call move_alloc(grown%file, self%text%file)
         call move_alloc(grown%number, self%text%number)
      end if
      self%n = self%n + 1
      self%text%line(self%n)%text = text
      self%text%file(self%n) = source%file(line)
      self%text%number(self%n) = source%number(line)
   end subroutine put_line

   !> The card that begins in a line, up to the line before the next keyword; data in front of a
   !> keyword are a card, too.
   subroutine read_card(source, line, card)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line
      type(card_text_t), intent(out) :: card
      character(len=:), allocatable :: text

      card%line = line
      card%data = line
      card%name = ""
      card%title = ""
      allocate(card%option(0))
      if (keyword_of(source%line(line)%text) /= "") then
         call gather_keyword(source%line, card%data, text)
         call split_keyword(text, card%title, card%name, card%option)
         card%data = card%data + 1
      end if
      card%last = card%data
      do while (card%last <= size(source%line))
         if (keyword_of(source%line(card%last)%text) /= "") exit
         card%last = card%last + 1
      end do
      card%last = card%last - 1
   end subroutine read_card

   !> The line that ends what `card` begins; behind the last one if none does.
   pure integer function end_of(source, card, name) result(line)
      type(deck_source_t), intent(in) :: source
      type(card_text_t), intent(in) :: card
      character(len=*), intent(in) :: name

      do line = card%line + 1, size(source%line)
         if (keyword_of(source%line(line)%text) == name) return
      end do
   end function end_of

   pure type(origin_t) function origin_of(source, line)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line

      origin_of = origin_t(source%file(line), source%number(line))
   end function origin_of

end module emcon_deck_parts
