!> Parts and instances: a deck of *PART, *ASSEMBLY and *INSTANCE as the flat text of the same model.
!>
!> An instance is the text of its part with labels of its own, names that begin with that of the
!> instance and a point, and nodes moved as its data lines say. Each line keeps the file and the
!> number that it has in the deck.
module emcon_deck_parts
   use emcon_deck_card_text, only : card_end, card_field_is_label, card_is_profile, card_is_wall, &
      card_read, card_text_t, origin_of
   use emcon_deck_instances, only : instance_data_line, instance_keyword_line, instance_motion, &
      instance_node_line, instance_number, instance_profile_line, instance_t, &
      instance_wall_line, instances_t
   use emcon_deck_source, only : deck_source_t
   use emcon_deck_text, only : field, fields_t, is_comment, keyword_of, option_value, split_fields
   use emcon_diagnostics, only : add_error, diagnostics_t, quoted
   use emcon_kinds, only : wp
   use emcon_text, only : read_integer, to_text
   implicit none
   private
   public :: parts_are_used, parts_flatten

   !> Lines of a part, from behind *PART to before *END PART.
   type :: part_t
      character(len=:), allocatable :: name        !! upper case, without blanks
      integer :: first = 1, last = 0
   end type part_t

   !> The flat text as it grows.
   type :: flat_t
      type(deck_source_t) :: text
      type(part_t), allocatable :: part(:)
      type(instances_t) :: instances
      integer :: n = 0                             !! lines so far
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

      allocate(self%instances%item(0))
      allocate(self%text%line(64), self%text%file(64), self%text%number(64))
      self%text%file_name = source%file_name
      n_before = log%n_errors
      call find_parts(source, self, log)
      self%is_sound = log%n_errors == n_before
      ! What stands in the wrong place would be read as something else: all that follows is wrong.
      i = merge(1, size(source%line) + 1, self%is_sound)
      do while (i <= size(source%line))
         call card_read(source, i, card)
         i = card%last + 1
         select case (card%name)
         case ("PART")
            i = card_end(source, card, "ENDPART") + 1
         case ("INSTANCE")
            i = card_end(source, card, "ENDINSTANCE") + 1
            call put_instance(source, card, self, log)
         case ("ASSEMBLY")
            self%in_assembly = .true.
         case ("ENDPART", "ENDINSTANCE", "ENDASSEMBLY")
            if (self%is_sound .and. .not. (self%in_assembly .and. card%name == "ENDASSEMBLY")) then
               call add_error(log, origin_of(source, card%line), card%title // " ends nothing")
            end if
            self%in_assembly = self%in_assembly .and. card%name /= "ENDASSEMBLY"
         case default
            call put_own(source, card, self, log)
         end select
      end do
      labels = "labels"
      do i = 1, size(self%instances%item)
         if (i > 1) labels = labels // ","
         labels = labels // " " // self%instances%item(i)%name // " + " &
            // to_text(self%instances%item(i)%shift)
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
         call card_read(source, i, card)
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
            part%last = card_end(source, card, "ENDPART") - 1
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
      if (has_no_end) has_no_end = card_end(source, card, "END" // card%name) > size(source%line)
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
         do while (ok .and. self%instances%unit <= label &
            .and. 10.0_wp*real(self%instances%unit, wp) < real(huge(1), wp))
            self%instances%unit = 10*self%instances%unit
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
      instance%shift = self%instances%unit*size(self%instances%item)
      k = part_number(self, option_value(card%option, "PART"))
      last = card_end(source, card, "ENDINSTANCE")
      if (.not. self%in_assembly) fault = "*INSTANCE stands in *ASSEMBLY alone"
      if (instance%name == "") fault = "*INSTANCE needs NAME="
      if (instance_number(self%instances, instance%name) > 0) fault = "instance " &
         // quoted(instance%name) // " is given twice"
      if (k == 0) fault = "*INSTANCE: there is no part " &
         // quoted(option_value(card%option, "PART"))
      if (real(self%instances%unit, wp)*real(self%n_instance + 1, wp) > real(huge(1), wp)) fault = &
         "labels are too large for so many instances"
      if (fault /= "") then
         ! Others have the same fault, or follow from it.
         if (self%is_sound) call add_error(log, origin_of(source, card%line), fault)
         self%is_sound = .false.
         return
      end if
      call instance_motion(source, card, instance, log)
      self%instances%item = [self%instances%item, instance]
      call put_lines(source, self%part(k)%first, self%part(k)%last, instance, self, log)
      call put_lines(source, card%last + 1, last - 1, instance, self, log)
   end subroutine put_instance

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
         call card_read(source, i, card)
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
      if (self%in_assembly) instance%shift = self%instances%unit*self%n_instance
      name = option_value(card%option, "INSTANCE")
      if (name /= "") then
         k = instance_number(self%instances, name)
         if (k == 0) then
            if (self%is_sound) call add_error(log, origin_of(source, card%line), card%title &
               // ": there is no instance " // quoted(name))
            return
         end if
         instance%shift = self%instances%item(k)%shift
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
         call instance_keyword_line(self%instances, card, instance, keeps_names, line)
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
         if (card_is_wall(card) .and. instance%is_moved) then
            call instance_wall_line(card, data, instance, line)
         else if (card_is_profile(card) .and. instance%is_moved) then
            call instance_profile_line(data, instance, line)
         else
            call instance_data_line(self%instances, card, data, instance, line)
         end if
         call put_line(self, line, source, i)
      end do
   end subroutine put_card

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
         if (.not. card_field_is_label(card, i, data%n)) cycle
         call read_integer(field(data, i), label, ok)
         has_stray_label = has_stray_label .or. (ok .and. (label < 1 .or. &
            label >= self%instances%unit))
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
         "SURFACE", "INITIALCONDITIONS"]) .or. card_is_profile(card) .or. card_is_wall(card)) return
      call read_integer(field(data, 1), label, has_bare_label)
   end function has_bare_label

   !> A node of an instance that is moved.
   subroutine put_node(source, line, data, instance, self, log)
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: line
      type(fields_t), intent(in) :: data         !! of that line
      type(instance_t), intent(in) :: instance
      type(flat_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: log
      character(len=:), allocatable :: text
      integer :: wrong

      call instance_node_line(self%instances, data, instance, text, wrong)
      if (wrong > 0) then
         call add_error(log, origin_of(source, line), "coordinate " // quoted(field(data, wrong)) &
            // " of a part that is moved is not a number")
      else
         call put_line(self, text, source, line)
      end if
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

end module emcon_deck_parts
