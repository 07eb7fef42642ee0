!> *AMPLITUDE and *TIME POINTS: tables over time.
module emcon_deck_tables
   use emcon_amplitudes, only : amplitude_t
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, next_line
   use emcon_deck_reader, only : card_error, card_t, has_option, n_cards, need_name, option_name, &
      option_word, reader_t
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find, name_index_put, name_index_t
   use emcon_scene, only : scene_t, where_text
   use emcon_text, only : read_real, string_t, to_text
   implicit none
   private
   public :: read_amplitudes, read_time_points
   public :: table_names, card_table_name

   !> More output times than this are a slip of the pen.
   integer, parameter :: max_times = 1000000
   !> By how much of an increment GENERATE may miss its end and still meet it.
   real(wp), parameter :: grid_slack = 1.0e-6_wp

contains

   subroutine read_amplitudes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene

      call read_tables(reader, scene, "AMPLITUDE", scene%amplitude, reader%names%amplitudes)
      call delay_tables(reader, scene%amplitude)
   end subroutine read_amplitudes

   !> Of each amplitude that a card delays, one more, whose times are later.
   subroutine delay_tables(reader, table)
      type(reader_t), intent(inout) :: reader
      type(amplitude_t), allocatable, intent(inout) :: table(:)
      type(amplitude_t), allocatable :: all(:)
      character(len=:), allocatable :: name
      real(wp) :: delay
      integer :: i, k, n
      logical :: ok

      n = size(table)
      k = count([(is_delayed(reader%card(i)), i = 1, size(reader%card))])
      if (k == 0) return
      allocate(all(n + k))
      all(:n) = table
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            if (.not. is_delayed(card)) cycle
            call read_real(option_name(card, "TIMEDELAY"), delay, ok)
            if (.not. ok) then
               call card_error(reader, card, "TIME DELAY=" &
                  // quoted(option_name(card, "TIMEDELAY")) // " is not a number")
               cycle
            end if
            if (.not. has_option(card, "AMPLITUDE")) then
               if (abs(delay) > 0.0_wp) call card_error(reader, card, "TIME DELAY delays an " &
                  // "amplitude; name one by AMPLITUDE=")
               cycle
            end if
            k = name_index_find(reader%names%amplitudes, option_name(card, "AMPLITUDE"))
            call card_table_name(card, name)
            if (k == 0 .or. name_index_find(reader%names%amplitudes, name) > 0) cycle
            n = n + 1
            all(n) = all(k)
            all(n)%name = name
            all(n)%time = all(n)%time + delay
            call name_index_put(reader%names%amplitudes, name, n)
         end associate
      end do
      table = all(:n)
   end subroutine delay_tables

   !> Does a card act by an amplitude, later than that says?
   pure logical function is_delayed(card)
      type(card_t), intent(in) :: card

      is_delayed = any(card%name == ["BOUNDARY", "CLOAD   ", "DLOAD   ", "DSLOAD  "])
      if (is_delayed) is_delayed = has_option(card, "TIMEDELAY")
   end function is_delayed

   !> Name of the amplitude that a card names, with its delay; empty: none.
   subroutine card_table_name(card, name)
      type(card_t), intent(in) :: card
      character(len=:), allocatable, intent(out) :: name

      name = option_name(card, "AMPLITUDE")
      ! No name of a deck has small letters.
      if (name /= "" .and. has_option(card, "TIMEDELAY")) name = name // " later by " &
         // option_name(card, "TIMEDELAY")
   end subroutine card_table_name

   subroutine read_time_points(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(amplitude_t), allocatable :: table(:)

      call read_tables(reader, scene, "TIMEPOINTS", table, reader%names%times)
      call move_alloc(table, reader%time_points)
   end subroutine read_time_points

   !> All tables of one keyword. A table with errors keeps its name.
   subroutine read_tables(reader, scene, keyword, table, index_of)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: keyword
      type(amplitude_t), allocatable, intent(out) :: table(:)
      type(name_index_t), intent(inout) :: index_of    !! where in `table` a name is
      character(len=:), allocatable :: name
      integer :: i, n, i_same

      allocate(table(n_cards(reader, keyword)))
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= keyword) cycle
         call need_name(reader, reader%card(i), "NAME", name)
         if (name == "") cycle
         i_same = name_index_find(index_of, name)
         if (i_same > 0) then
            call card_error(reader, reader%card(i), name // " is defined twice; first at " &
               // where_text(scene, table(i_same)%origin))
            cycle
         end if
         n = n + 1
         table(n)%name = name
         call name_index_put(index_of, name, n)
         table(n)%origin = reader%card(i)%origin
         if (keyword == "AMPLITUDE") then
            call read_amplitude(reader, reader%card(i), table(n))
         else
            call read_times(reader, reader%card(i), table(n))
         end if
      end do
      table = table(:n)
   end subroutine read_tables

   !> Pairs time, value; any number of pairs in a line.
   subroutine read_amplitude(reader, card, table)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(amplitude_t), intent(inout) :: table
      real(wp), allocatable :: number(:)
      character(len=:), allocatable :: word
      integer :: n, n_before

      n_before = reader%log%n_errors
      call option_word(reader, card, "TIME", "STEP TIME, TOTAL TIME", word)
      table%is_total_time = word == "TOTALTIME"
      call option_word(reader, card, "DEFINITION", "TABULAR, SMOOTH STEP", word, "PERIODIC, " // &
         "EQUALLY SPACED, MODULATED, DECAY, USER", "give its values at enough times as a table")
      table%is_smooth = word == "SMOOTHSTEP"
      call read_numbers(reader, card, "time or value", number)
      n = size(number)/2
      if (size(number) == 0) then
         if (reader%log%n_errors == n_before) call card_error(reader, card, "the table is empty")
         number = [0.0_wp, 1.0_wp]
         n = 1
      else if (2*n /= size(number)) then
         call card_error(reader, card, "the last time " // to_text(number(size(number))) &
            // " has no value")
         n = max(n, 1)
         number = [number, 0.0_wp]
      end if
      table%time = number(1:2*n:2)
      table%value = number(2:2*n:2)
      call check_ascending(reader, card, table%time)
   end subroutine read_amplitude

   subroutine check_ascending(reader, card, time)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), intent(in) :: time(:)
      integer :: i

      do i = 2, size(time)
         if (time(i) > time(i - 1)) cycle
         call card_error(reader, card, "times must ascend: " // to_text(time(i)) // " follows " &
            // to_text(time(i - 1)))
         return
      end do
   end subroutine check_ascending

   !> Times one by one, or generated from first, last and distance.
   subroutine read_times(reader, card, table)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(amplitude_t), intent(inout) :: table
      type(data_t) :: data
      real(wp) :: range(3)
      integer :: i, k, n_before

      allocate(table%value(0))
      n_before = reader%log%n_errors
      if (.not. has_option(card, "GENERATE")) then
         call read_numbers(reader, card, "time", table%time)
         call check_ascending(reader, card, table%time)
      else
         allocate(table%time(0))
         call data_open(data, card)
         do while (next_line(reader, data))
            call check_count(reader, data, 3, 3, "first time, last time, distance")
            range = 0.0_wp
            do k = 1, 3
               call get_real(reader, data, k, "time", range(k))
            end do
            if (.not. data%ok) cycle
            if (range(1) < 0.0_wp .or. range(2) < range(1) .or. range(3) <= 0.0_wp) then
               call data_error(reader, data, "needs 0 <= first <= last and distance > 0")
            else if ((range(2) - range(1))/real(max_times, wp) > range(3)) then
               call data_error(reader, data, "more than " // to_text(max_times) // " times")
            else
               table%time = [table%time, (range(1) + real(i, wp)*range(3), &
                  i = 0, int((range(2) - range(1))/range(3) + grid_slack))]
            end if
         end do
         call check_ascending(reader, card, table%time)
      end if
      if (size(table%time) == 0 .and. reader%log%n_errors == n_before) then
         call card_error(reader, card, "no time is given")
      end if
   end subroutine read_times

   !> All numbers of the data lines, in order; an empty field is 0.
   subroutine read_numbers(reader, card, what, number)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: what
      real(wp), allocatable, intent(out) :: number(:)
      type(data_t) :: data
      integer :: k, n

      allocate(number(64))
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         do k = 1, data%n
            if (n == size(number)) number = [number, number]
            n = n + 1
            number(n) = 0.0_wp
            call get_real(reader, data, k, what, number(n))
         end do
      end do
      number = number(:n)
   end subroutine read_numbers

   pure function table_names(table) result(list)
      type(amplitude_t), intent(in) :: table(:)
      type(string_t) :: list(size(table))
      integer :: i

      do i = 1, size(table)
         list(i)%text = table(i)%name
      end do
   end function table_names

end module emcon_deck_tables
