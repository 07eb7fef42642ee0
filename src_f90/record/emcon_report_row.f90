!> A line of the scene report: the same figures as text for people and as JSON for programs.
module emcon_report_row
   use emcon_json, only : json_number, json_text
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: report_row_t, row_begin, row_put, rows_add, rows_json

   type :: report_row_t
      character(len=:), allocatable :: kind      !! under which JSON lists it
      character(len=:), allocatable :: text
      character(len=:), allocatable :: json      !! of an object, without the last brace
   end type report_row_t

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

   pure subroutine rows_add(rows, row)
      type(report_row_t), allocatable, intent(inout) :: rows(:)
      type(report_row_t), intent(in) :: row
      type(report_row_t), allocatable :: grown(:)

      allocate(grown(size(rows) + 1))
      grown(:size(rows)) = rows
      grown(size(grown)) = row
      call move_alloc(grown, rows)
   end subroutine rows_add

   !> All rows as one JSON object: under each kind a list.
   pure subroutine rows_json(rows, line)
      type(report_row_t), intent(in) :: rows(:)
      character(len=:), allocatable, intent(out) :: line
      character(len=:), allocatable :: member
      logical :: is_done(size(rows))
      integer :: i, j

      is_done = .false.
      line = "{"
      do i = 1, size(rows)
         if (is_done(i)) cycle
         if (i > 1) line = line // ", "
         line = line // '"' // rows(i)%kind // '": ['
         do j = i, size(rows)
            if (rows(j)%kind /= rows(i)%kind) cycle
            if (j > i) line = line // ", "
            member = rows(j)%json
            call json_text(member, "text", rows(j)%text)
            line = line // member // "}"
            is_done(j) = .true.
         end do
         line = line // "]"
      end do
      line = line // "}"
   end subroutine rows_json

end module emcon_report_row
