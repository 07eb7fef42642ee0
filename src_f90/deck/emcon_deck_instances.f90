!> Instances of parts: what becomes of the labels, names and places of a part in each.
module emcon_deck_instances
   use emcon_deck_card_text, only : card_field_is_label, card_text_t, origin_of
   use emcon_deck_source, only : deck_source_t
   use emcon_deck_text, only : bare_name, field, fields_t, is_comment, option_value, &
      split_fields
   use emcon_diagnostics, only : add_error, diagnostics_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_text, only : read_integer, read_real, to_text
   implicit none
   private
   public :: instance_t, instances_t, instance_motion, instance_number, instance_keyword_line, &
      instance_data_line, instance_profile_line, instance_wall_line, instance_node_line

   integer, parameter :: n_axis = 3
   !> Coordinates of a point of a profile.
   integer, parameter :: n_ends = 2
   character(len=*), parameter :: digits = "0123456789"

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

   !> Those of a deck.
   type :: instances_t
      type(instance_t), allocatable :: item(:)
      integer :: unit = 1                          !! labels of all parts are smaller
   end type instances_t

contains

   !> The data lines of an instance: a way, then two points of an axis and an angle in degrees.
   subroutine instance_motion(source, card, instance, log)
      type(deck_source_t), intent(in) :: source  !! the whole deck
      type(card_text_t), intent(in) :: card      !! *INSTANCE
      type(instance_t), intent(inout) :: instance  !! gets its way and turn
      type(diagnostics_t), intent(inout) :: log  !! gets what is wrong with them
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
   end subroutine instance_motion

   !> Where a node of an instance comes to lie.
   pure function instance_moves(instance, x) result(place)
      type(instance_t), intent(in) :: instance
      real(wp), intent(in) :: x(n_axis)          !! in the part [L]
      real(wp) :: place(n_axis)

      place = x + instance%way
      place = place + turn(instance, place - instance%center)
   end function instance_moves

   !> What a vector changes by as an instance turns.
   pure function turn(instance, vector) result(change)
      type(instance_t), intent(in) :: instance
      real(wp), intent(in) :: vector(n_axis)
      real(wp) :: change(n_axis), across(n_axis)

      across = cross_product(instance%axis, vector)
      change = sin(instance%angle)*across &
         + 2.0_wp*sin(0.5_wp*instance%angle)**2*cross_product(instance%axis, across)
   end function turn

   !> The place of an instance among them; 0: there is none of this name.
   pure integer function instance_number(self, name) result(k)
      type(instances_t), intent(in) :: self      !! those so far
      character(len=*), intent(in) :: name       !! upper case, without blanks

      do k = size(self%item), 1, -1
         if (self%item(k)%name == name) return
      end do
   end function instance_number

   !> The keyword line with the names of an instance, without INSTANCE=.
   pure subroutine instance_keyword_line(self, card, instance, keeps_names, line)
      type(instances_t), intent(in) :: self      !! those so far
      type(card_text_t), intent(in) :: card      !! of its part, or about it
      type(instance_t), intent(in) :: instance   !! whose names the line gets
      logical, intent(in) :: keeps_names         !! but for labels
      character(len=:), allocatable, intent(out) :: line  !! without a line end
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
            else if (option%name == "REFNODE" .or. option%name == "ROTNODE") then
               call instance_field(self, option%value, instance, is_label=.not. keeps_names &
                  .or. verify(option%value, digits) == 0, word=word)
               line = line // "=" // word
            else
               line = line // "=" // option%value
            end if
         end associate
      end do
   end subroutine instance_keyword_line

   !> A data line with the labels and names of an instance.
   pure subroutine instance_data_line(self, card, data, instance, line)
      type(instances_t), intent(in) :: self      !! those so far
      type(card_text_t), intent(in) :: card      !! the line is of
      type(fields_t), intent(in) :: data         !! of the line
      type(instance_t), intent(in) :: instance   !! whose labels it gets
      character(len=:), allocatable, intent(out) :: line  !! without a line end
      character(len=:), allocatable :: word
      integer :: i

      line = ""
      do i = 1, data%n
         if (i > 1) line = line // ","
         call instance_field(self, field(data, i), instance, &
            card_field_is_label(card, i, data%n), word)
         line = line // word
      end do
      if (data%ends_in_comma) line = line // ","
   end subroutine instance_data_line

   !> A segment of a profile that is moved: a word, then points.
   pure subroutine instance_profile_line(data, instance, line)
      type(fields_t), intent(in) :: data         !! of the line
      type(instance_t), intent(in) :: instance   !! moved
      character(len=:), allocatable, intent(out) :: line  !! without a line end
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
         x = instance_moves(instance, x)
         call add_point(x(:n_ends), line)
      end do
      if (i < data%n) line = data%text           ! the reader tells what is no number
   end subroutine instance_profile_line

   !> A line of a shape in space that is moved: points, of a plane a point and a normal; what else
   !> there is, as a radius or a segment of a profile, stays.
   pure subroutine instance_wall_line(card, data, instance, line)
      type(card_text_t), intent(in) :: card        !! the line is of
      type(fields_t), intent(in) :: data           !! of the line
      type(instance_t), intent(in) :: instance     !! moved
      character(len=:), allocatable, intent(out) :: line   !! without a line end
      real(wp) :: x(n_axis), scale
      logical :: ok(n_axis), is_normal
      integer :: i, k

      call read_real(option_value(card%option, "SCALE"), scale, ok(1))
      if (.not. (ok(1) .and. abs(scale) > 0.0_wp)) scale = 1.0_wp
      line = ""
      do i = 1, data%n - n_axis + 1, n_axis
         do k = 1, n_axis
            call read_real(field(data, i + k - 1), x(k), ok(k))
         end do
         if (.not. all(ok)) exit
         is_normal = i > 1 .and. option_value(card%option, "TYPE") == "PLANE"
         if (is_normal) then
            x = x + turn(instance, x)
         else
            x = instance_moves(instance, scale*x)/scale
         end if
         call add_point(x, line)
      end do
      do k = i, data%n
         line = line // ", " // field(data, k)
      end do
      line = line(3:)
   end subroutine instance_wall_line

   !> A field: labels and names of an instance, and labels such as INSTANCE.7 anywhere.
   pure subroutine instance_field(self, text, instance, is_label, word)
      type(instances_t), intent(in) :: self
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
         word = to_text(label + self%item(k)%shift)
      else if (is_label .and. instance%name /= "" .and. k == 0) then
         word = instance%name // "." // bare_name(text)
      end if
   end subroutine instance_field

   !> The line of a node of an instance that is moved.
   pure subroutine instance_node_line(self, data, instance, line, wrong)
      type(instances_t), intent(in) :: self      !! those so far
      type(fields_t), intent(in) :: data         !! of *NODE: label, coordinates
      type(instance_t), intent(in) :: instance   !! moved
      character(len=:), allocatable, intent(out) :: line  !! without a line end
      integer, intent(out) :: wrong              !! the first field that is no number; 0: none
      real(wp) :: x(n_axis)
      logical :: ok

      x = 0.0_wp
      do wrong = 2, n_axis + 1
         if (field(data, wrong) == "") cycle
         call read_real(field(data, wrong), x(wrong - 1), ok)
         if (.not. ok) return
      end do
      wrong = 0
      x = instance_moves(instance, x)
      call instance_field(self, field(data, 1), instance, .true., line)
      call add_point(x(:merge(n_axis, n_axis - 1, data%n > n_axis .or. abs(x(n_axis)) > 0.0_wp)), &
         line)
   end subroutine instance_node_line

   !> Add the fields of a point, each behind a comma.
   pure subroutine add_point(x, line)
      real(wp), intent(in) :: x(:)               !! [L]
      character(len=:), allocatable, intent(inout) :: line
      character(len=26) :: number
      integer :: i

      do i = 1, size(x)
         write(number, "(es26.17e3)") x(i)
         line = line // ", " // trim(adjustl(number))
      end do
   end subroutine add_point

end module emcon_deck_instances
