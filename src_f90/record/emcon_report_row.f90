!> A line of the scene report: the same figures as text for people and as JSON for programs.
module emcon_report_row
   use emcon_json, only : json_number, json_text
   use emcon_kinds, only : wp
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: report_row_t, report_rows_t, row_begin, row_put, rows_add, rows_json

   type :: report_row_t
      character(len=:), allocatable :: kind      !! under which JSON lists it
      character(len=:), allocatable :: text
      character(len=:), allocatable :: json      !! of an object, without the last brace
   end type report_row_t

   !> Rows, with room for more.
   type :: report_rows_t
      integer :: n = 0
      type(report_row_t), allocatable :: row(:)  !! the first n count
   end type report_rows_t

   !> Append a figure or a word: `pattern` is its text, with # where the value stands; empty: it is
   !> in JSON alone.
   interface row_put
      module procedure put_number, put_integer, put_word
   end interface row_put

contains

   !> A row whose text begins with `text`.
   pure subroutine row_begin(row, kind, text)
      type(report_row_t), intent(out) :: row
      character(len=*), intent(in) :: kind
      character(len=*), intent(in) :: text

      row%kind = kind
      row%text = text
      row%json = "{"
   end subroutine row_begin

   pure subroutine put_number(row, name, value, pattern)
      type(report_row_t), intent(inout) :: row
      character(len=*), intent(in) :: name, pattern
      real(wp), intent(in) :: value

      call json_number(row%json, name, value)
      call append(row, to_text(value, 4), pattern)
   end subroutine put_number

   pure subroutine put_integer(row, name, value, pattern)
      type(report_row_t), intent(inout) :: row
      character(len=*), intent(in) :: name, pattern
      integer, intent(in) :: value

      call json_number(row%json, name, real(value, wp))
      call append(row, to_text(value), pattern)
   end subroutine put_integer

   pure subroutine put_word(row, name, value, pattern)
      type(report_row_t), intent(inout) :: row
      character(len=*), intent(in) :: name, value, pattern

      call json_text(row%json, name, value)
      call append(row, value, pattern)
   end subroutine put_word

   pure subroutine append(row, value, pattern)
      type(report_row_t), intent(inout) :: row
      character(len=*), intent(in) :: value, pattern
      integer :: i

      i = index(pattern, "#")
      if (i > 0) row%text = row%text // pattern(:i - 1) // value // pattern(i + 1:)
   end subroutine append

   !> Append `row`, which is empty after.
   pure subroutine rows_add(rows, row)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t), intent(inout) :: row
      type(report_row_t), allocatable :: grown(:)
      integer :: i

      if (.not. allocated(rows%row)) allocate(rows%row(16))
      if (rows%n == size(rows%row)) then
         allocate(grown(2*rows%n))
         do i = 1, rows%n
            call move_row(rows%row(i), grown(i))
         end do
         call move_alloc(grown, rows%row)
      end if
      rows%n = rows%n + 1
      call move_row(row, rows%row(rows%n))
   end subroutine rows_add

   pure subroutine move_row(from, to)
      type(report_row_t), intent(inout) :: from, to

      call move_alloc(from%kind, to%kind)
      call move_alloc(from%text, to%text)
      call move_alloc(from%json, to%json)
   end subroutine move_row

   !> All rows as one JSON object: under each kind a list.
   pure subroutine rows_json(rows, line)
      type(report_rows_t), intent(in) :: rows
      character(len=:), allocatable, intent(out) :: line
      type(notes_t) :: lists
      logical :: is_done(rows%n)
      integer :: i

      is_done = .false.
      do i = 1, rows%n
         if (.not. is_done(i)) call list_kind(rows, i, is_done, lists)
      end do
      line = "{"
      call append_joined(line, lists)
      line = line // "}"
   end subroutine rows_json

   !> Note the JSON of row `i` and of all behind it of its kind, `is_done` then, as one list.
   pure subroutine list_kind(rows, i, is_done, lists)
      type(report_rows_t), intent(in) :: rows
      integer, intent(in) :: i
      logical, intent(inout) :: is_done(:)
      type(notes_t), intent(inout) :: lists
      type(notes_t) :: members
      character(len=:), allocatable :: text
      integer :: j

      do j = i, rows%n
         if (rows%row(j)%kind /= rows%row(i)%kind) cycle
         text = rows%row(j)%json
         call json_text(text, "text", rows%row(j)%text)
         call note_add(members, text // "}")
         is_done(j) = .true.
      end do
      text = '"' // rows%row(i)%kind // '": ['
      call append_joined(text, members)
      call note_add(lists, text // "]")
   end subroutine list_kind

   !> Append `parts`, with commas between, in one go.
   pure subroutine append_joined(text, parts)
      character(len=:), allocatable, intent(inout) :: text
      type(notes_t), intent(in) :: parts
      character(len=:), allocatable :: joined
      integer :: i, n

      n = len(text) + sum([(len(parts%item(i)%text), i = 1, parts%n)]) + 2*max(0, parts%n - 1)
      allocate(character(len=n) :: joined)
      joined(:len(text)) = text
      n = len(text)
      do i = 1, parts%n
         if (i > 1) joined(n + 1:n + 2) = ", "
         if (i > 1) n = n + 2
         joined(n + 1:n + len(parts%item(i)%text)) = parts%item(i)%text
         n = n + len(parts%item(i)%text)
      end do
      call move_alloc(joined, text)
   end subroutine append_joined

end module emcon_report_row
