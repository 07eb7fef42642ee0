!> The text of a deck, from a file or from memory, with all the files it includes: one list of lines
!> that know their origin.
module emcon_deck_source
   use emcon_deck_lines, only : deck_source_t
   use emcon_deck_stl_lines_space, only : stl_lines_insert
   use emcon_diagnostics, only : add_error, diagnostics_t, quoted
   use emcon_origin, only : origin_t
   use emcon_text, only : squeezed, string_t, stripped, to_text
   use emcon_text_file, only : text_file_read
   implicit none
   private
   public :: deck_source_t, passage_t, deck_open, deck_open_text

   integer, parameter :: max_depth = 20            !! of files that include files
   integer, parameter :: max_includes = 10000      !! in all: files can include each other in powers
   character(len=3), parameter :: utf8_mark = char(239) // char(187) // char(191)
   character(len=*), parameter :: blanks = " " // achar(9)

   !> Lines of a text that follow each other, and where messages say that they stand.
   type :: passage_t
      integer :: n_line = huge(1)                  !! the last one takes what is left of the text
      integer :: file = 1                          !! index into the file names
      integer :: number = 1                        !! line number of the first one
      logical :: is_counted = .true.               !! false: all lines have that number
   end type passage_t

   !> A deck source while it grows.
   type :: builder_t
      type(deck_source_t) :: source
      type(diagnostics_t) :: log
      integer :: n_line = 0
      integer :: n_file = 0
      integer :: n_memory = 0                      !! files that are texts in memory
      integer :: open_file(max_depth) = 0          !! the chain of files that are being read
      integer :: depth = 0
      logical :: is_full = .false.                 !! too many files: nothing more is read
   end type builder_t

contains

   !> Read the deck at `path` and the files it includes. Failures are in `diagnostics`.
   subroutine deck_open(path, source, diagnostics)
      character(len=*), intent(in) :: path
      type(deck_source_t), intent(out) :: source
      type(diagnostics_t), intent(out) :: diagnostics
      type(builder_t) :: builder

      call begin(builder)
      call append_file(builder, path, origin_t())
      call finish(builder, source, diagnostics)
   end subroutine deck_open

   !> Take the deck `text` and read the files that it includes, those relative to the working
   !> directory. Line ends are LF, CR LF or CR. Failures are in `diagnostics`.
   subroutine deck_open_text(text, passage, file_name, source, diagnostics)
      character(len=*), intent(in) :: text
      type(passage_t), intent(in) :: passage(:)        !! of the text, in its order; at least one
      type(string_t), intent(in) :: file_name(:)       !! for messages; at least one
      type(deck_source_t), intent(out) :: source
      type(diagnostics_t), intent(out) :: diagnostics
      type(builder_t) :: builder
      character(len=:), allocatable :: fault
      integer :: i

      call begin(builder)
      do i = 1, size(file_name)
         call add_file_name(builder, file_name(i)%text)
      end do
      builder%n_memory = size(file_name)
      call binary_fault(text, fault)
      if (size(passage) == 0 .or. size(file_name) == 0) then
         fault = "a deck in memory has passages and file names"
      else if (any(passage%file < 1) .or. any(passage%file > size(file_name))) then
         fault = "a passage belongs to a file from 1 to " // to_text(size(file_name))
      end if
      if (fault == "") then
         call append_text(builder, text, passage)
      else
         call add_error(builder%log, origin_t(min(1, size(file_name)), 0), fault)
         builder%source%is_whole = .false.
      end if
      call finish(builder, source, diagnostics)
   end subroutine deck_open_text

   subroutine begin(builder)
      type(builder_t), intent(inout) :: builder

      allocate(builder%source%line(0), builder%source%file(0), builder%source%number(0))
      allocate(builder%source%file_name(4))
   end subroutine begin

   !> Hand over what was read.
   subroutine finish(builder, source, diagnostics)
      type(builder_t), intent(inout) :: builder
      type(deck_source_t), intent(inout) :: source
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: n

      n = builder%n_line
      call resize(builder, n)
      builder%source%file_name = builder%source%file_name(:builder%n_file)
      call move_alloc(builder%source%line, source%line)
      call move_alloc(builder%source%file, source%file)
      call move_alloc(builder%source%number, source%number)
      call move_alloc(builder%source%file_name, source%file_name)
      source%is_whole = builder%source%is_whole
      call stl_lines_insert(source, builder%n_memory, builder%log)
      diagnostics = builder%log
      diagnostics%file_name = source%file_name
      if (n == 0 .and. diagnostics%n_errors == 0) then
         call add_error(diagnostics, origin_t(1, 0), "the deck is empty")
      end if
   end subroutine finish

   !> Append the lines of one file; `origin` is the line that includes it (file 0: none).
   recursive subroutine append_file(builder, path, origin)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: path
      type(origin_t), intent(in) :: origin
      character(len=:), allocatable :: text, fault
      type(origin_t) :: here

      call include_fault(builder, path, fault)
      if (fault == "") call text_file_read(path, text, fault)
      if (fault == "") call binary_fault(text, fault)
      here = origin
      if (fault == "" .or. origin%file == 0) then
         call add_file_name(builder, path)
         if (origin%file == 0) here = origin_t(builder%n_file, 0)
      end if
      if (fault /= "") then
         if (origin%file > 0) fault = "*INCLUDE " // quoted(path) // ": " // fault
         call add_error(builder%log, here, fault)
         builder%source%is_whole = .false.
         return
      end if
      builder%depth = builder%depth + 1
      builder%open_file(builder%depth) = builder%n_file
      call append_text(builder, text, [passage_t(file=builder%n_file)])
      builder%depth = builder%depth - 1
   end subroutine append_file

   !> Why `path` may not be included here; empty if it may.
   subroutine include_fault(builder, path, fault)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: fault
      integer :: i

      fault = ""
      do i = 1, builder%depth
         if (builder%source%file_name(builder%open_file(i))%text == path) then
            fault = "the file includes itself"
            return
         end if
      end do
      if (builder%depth == max_depth) then
         fault = "files are nested more than " // to_text(max_depth) // " deep"
      else if (builder%n_file == max_includes) then
         fault = "more than " // to_text(max_includes) // " files are included"
         builder%is_full = .true.
      end if
   end subroutine include_fault

   !> Says so if `text` holds bytes that no text has.
   pure subroutine binary_fault(text, fault)
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(out) :: fault
      integer :: i, code

      fault = ""
      do i = 1, len(text)
         code = iachar(text(i:i))
         if (code >= 32 .and. code /= 127) cycle
         if (code >= 9 .and. code <= 13) cycle
         ! Control-Z ends text files of old systems.
         if (code == 26 .and. i == len(text)) cycle
         fault = "not a text file: byte " // to_text(i) // " has code " // to_text(code)
         return
      end do
   end subroutine binary_fault

   !> Append the lines of `text`; line ends are LF, CR LF or CR.
   recursive subroutine append_text(builder, text, passage)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: text
      type(passage_t), intent(in) :: passage(:)
      character(len=:), allocatable :: include_card
      integer :: first, last, i, i_passage, i_line, n_needed
      type(origin_t) :: origin, here

      n_needed = builder%n_line + count_lines(text)
      if (n_needed > size(builder%source%file)) then
         call resize(builder, max(n_needed, 2*size(builder%source%file)))
      end if
      include_card = ""
      i_passage = 1
      i_line = 0
      first = 1
      if (index(text, utf8_mark) == 1) first = 4
      do while (first <= len(text) .and. .not. builder%is_full)
         do last = first, len(text)
            if (text(last:last) == achar(10) .or. text(last:last) == achar(13)) exit
         end do
         call next_place(passage, i_passage, i_line, here)
         i = first
         first = last + 1
         if (first <= len(text)) then
            if (text(first - 1:first) == achar(13) // achar(10)) first = first + 1
         end if
         if (last > len(text)) last = len(text) + 1
         if (include_card == "") origin = here
         if (include_card /= "" .or. is_include(text(i:last - 1))) then
            include_card = include_card // stripped(text(i:last - 1), blanks)
            if (include_card(len(include_card):) == "," .and. first <= len(text)) cycle
            call append_included(builder, include_card, origin)
            include_card = ""
         else
            call append_line(builder, text(i:last - 1), here)
         end if
      end do
   end subroutine append_text

   !> Go on to the next line of a text: line `i_line` of passage `i_passage`, which stands `here`.
   pure subroutine next_place(passage, i_passage, i_line, here)
      type(passage_t), intent(in) :: passage(:)
      integer, intent(inout) :: i_passage, i_line
      type(origin_t), intent(out) :: here

      i_line = i_line + 1
      do while (i_passage < size(passage))
         if (i_line <= passage(i_passage)%n_line) exit
         i_line = 1
         i_passage = i_passage + 1
      end do
      associate (this => passage(i_passage))
         here = origin_t(this%file, this%number)
         if (this%is_counted) here%line = here%line + i_line - 1
      end associate
   end subroutine next_place

   pure integer function count_lines(text)
      character(len=*), intent(in) :: text
      integer :: i

      count_lines = 1
      do i = 1, len(text)
         if (text(i:i) == achar(10)) count_lines = count_lines + 1
      end do
   end function count_lines

   pure logical function is_include(line)
      character(len=*), intent(in) :: line
      character(len=:), allocatable :: word
      integer :: first

      is_include = .false.
      first = verify(line, blanks)
      if (first == 0) return
      if (line(first:first) /= "*") return
      word = squeezed(line(first:))
      is_include = word == "*INCLUDE" .or. index(word, "*INCLUDE,") == 1
   end function is_include

   !> Follow `*INCLUDE, INPUT=file`; the file is sought beside the file that names it, from a text
   !> in memory in the working directory.
   recursive subroutine append_included(builder, card, origin)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: card
      type(origin_t), intent(in) :: origin
      character(len=:), allocatable :: name, folder
      integer :: i_equal, i_comma

      i_comma = index(card, ",")
      i_equal = index(card, "=")
      name = ""
      if (i_comma > 0 .and. i_equal > i_comma) then
         if (squeezed(card(i_comma + 1:i_equal - 1)) == "INPUT") then
            name = stripped(card(i_equal + 1:), blanks)
         end if
      end if
      if (len(name) > 0) then
         if (name(len(name):) == ",") name = stripped(name(:len(name) - 1), blanks)
      end if
      if (len(name) > 1) then
         if (scan(name(1:1), """'") == 1 .and. name(1:1) == name(len(name):)) then
            name = name(2:len(name) - 1)
         end if
      end if
      if (len(name) == 0) then
         call add_error(builder%log, origin, "*INCLUDE needs INPUT=file")
         builder%source%is_whole = .false.
         return
      end if
      folder = builder%source%file_name(origin%file)%text
      folder = folder(:index(folder, "/", back=.true.))
      if (name(1:1) == "/" .or. builder%depth == 0) folder = ""
      call append_file(builder, folder // name, origin)
   end subroutine append_included

   subroutine append_line(builder, line, origin)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: line
      type(origin_t), intent(in) :: origin

      if (builder%n_line == size(builder%source%file)) call resize(builder, 2*builder%n_line + 8)
      builder%n_line = builder%n_line + 1
      builder%source%line(builder%n_line)%text = line
      builder%source%file(builder%n_line) = origin%file
      builder%source%number(builder%n_line) = origin%line
   end subroutine append_line

   !> Give the lists of lines the length `n`; texts are moved, not copied.
   subroutine resize(builder, n)
      type(builder_t), intent(inout) :: builder
      integer, intent(in) :: n
      type(string_t), allocatable :: line(:)
      integer, allocatable :: file(:), number(:)
      integer :: i

      allocate(line(n), file(n), number(n))
      do i = 1, min(n, builder%n_line)
         call move_alloc(builder%source%line(i)%text, line(i)%text)
      end do
      file(:i - 1) = builder%source%file(:i - 1)
      number(:i - 1) = builder%source%number(:i - 1)
      call move_alloc(line, builder%source%line)
      call move_alloc(file, builder%source%file)
      call move_alloc(number, builder%source%number)
   end subroutine resize

   subroutine add_file_name(builder, path)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: path
      type(string_t), allocatable :: grown(:)

      if (builder%n_file == size(builder%source%file_name)) then
         allocate(grown(2*builder%n_file))
         grown(:builder%n_file) = builder%source%file_name
         call move_alloc(grown, builder%source%file_name)
      end if
      builder%n_file = builder%n_file + 1
      builder%source%file_name(builder%n_file)%text = path
   end subroutine add_file_name

end module emcon_deck_source
