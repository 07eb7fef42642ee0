!> *SURFACE, TYPE=STL, INPUT=file: the facets of the file become data lines of the card, so that
!> what comes after knows lines alone, and a restart file carries them.
module emcon_deck_stl_lines_space
   use emcon_deck_lines, only : deck_source_t
   use emcon_deck_stl_file_space, only : stl_corners
   use emcon_deck_text, only : gather_keyword, keyword_of, option_place, option_t, option_value, &
      split_keyword
   use emcon_diagnostics, only : add_error, diagnostics_t
   use emcon_kinds, only : dp
   use emcon_origin, only : origin_t
   use emcon_text, only : string_t, stripped
   use emcon_text_file, only : text_file_read
   implicit none
   private
   public :: stl_lines_insert

   !> What a card becomes: lines of the source that it takes, and what stands for them.
   type :: card_lines_t
      integer :: first = 0, last = 0
      integer :: file = 0                          !! of the facets
      character(len=:), allocatable :: title
      type(string_t), allocatable :: facet(:)
   end type card_lines_t

contains

   !> Put the facets of all files that surfaces name into `source`.
   subroutine stl_lines_insert(source, n_memory, log)
      type(deck_source_t), intent(inout) :: source
      integer, intent(in) :: n_memory              !! the first files are texts in memory
      type(diagnostics_t), intent(inout) :: log
      type(card_lines_t), allocatable :: card(:)
      type(option_t), allocatable :: option(:)
      character(len=:), allocatable :: text, title, name
      integer :: i, first

      allocate(card(0))
      i = 0
      do while (i < size(source%line))
         i = i + 1
         if (keyword_of(source%line(i)%text) /= "SURFACE") cycle
         first = i
         call gather_keyword(source%line, i, text)
         call split_keyword(text, title, name, option)
         if (option_value(option, "TYPE") /= "STL" .or. option_place(option, "INPUT") == 0) cycle
         card = [card, card_lines_t(first, i)]
         call read_file(source, n_memory, title, option, card(size(card)), log)
      end do
      if (size(card) > 0) call insert(source, card)
   end subroutine stl_lines_insert

   !> The facets of the file that a card names.
   subroutine read_file(source, n_memory, title, option, card, log)
      type(deck_source_t), intent(inout) :: source
      integer, intent(in) :: n_memory
      character(len=*), intent(in) :: title
      type(option_t), intent(in) :: option(:)
      type(card_lines_t), intent(inout) :: card
      type(diagnostics_t), intent(inout) :: log
      character(len=:), allocatable :: path, bytes, fault
      real(dp), allocatable :: corner(:, :, :)
      type(string_t) :: name
      integer :: k

      card%title = title
      do k = 1, size(option)
         if (option(k)%name == "INPUT") cycle
         card%title = card%title // ", " // option(k)%typed
         if (option(k)%has_value) card%title = card%title // "=" // option(k)%value
      end do
      allocate(card%facet(0))
      associate (from => source%file(card%first))
         call find_beside(source%file_name(from)%text, from <= n_memory, &
            option(option_place(option, "INPUT"))%value, path)
         call text_file_read(path, bytes, fault)
         if (fault == "") call stl_corners(bytes, corner, fault)
         if (fault /= "") then
            call add_error(log, origin_t(from, source%number(card%first)), &
               "*SURFACE, TYPE=STL: '" // path // "': " // fault)
            source%is_whole = .false.
            return
         end if
      end associate
      name%text = path
      source%file_name = [source%file_name, name]
      card%file = size(source%file_name)
      call facet_lines(corner, card%facet)
   end subroutine read_file

   !> A file is sought beside the one that names it, from a text in memory in the working directory.
   pure subroutine find_beside(file, is_memory, typed, path)
      character(len=*), intent(in) :: file, typed
      logical, intent(in) :: is_memory
      character(len=:), allocatable, intent(out) :: path

      path = stripped(typed, " " // achar(9))
      if (len(path) > 1) then
         if (scan(path(1:1), """'") == 1 .and. path(1:1) == path(len(path):)) then
            path = path(2:len(path) - 1)
         end if
      end if
      if (index(path, "/") /= 1 .and. .not. is_memory .and. path /= "") then
         path = file(:index(file, "/", back=.true.)) // path
      end if
   end subroutine find_beside

   !> The nine coordinates of each facet, to all their digits.
   subroutine facet_lines(corner, line)
      real(dp), intent(in) :: corner(:, :, :)
      type(string_t), allocatable, intent(out) :: line(:)
      character(len=24) :: number
      integer :: f, k, a

      allocate(line(size(corner, 3)))
      do f = 1, size(line)
         line(f)%text = ""
         do k = 1, size(corner, 2)
            do a = 1, size(corner, 1)
               write(number, "(es24.16e3)") corner(a, k, f)
               if (len(line(f)%text) > 0) line(f)%text = line(f)%text // ", "
               line(f)%text = line(f)%text // trim(adjustl(number))
            end do
         end do
      end do
   end subroutine facet_lines

   !> Put the cards into `source` in place of their lines. A facet is told by its number in the
   !> file.
   subroutine insert(source, card)
      type(deck_source_t), intent(inout) :: source
      type(card_lines_t), intent(inout) :: card(:)
      type(deck_source_t) :: new
      integer :: n, i, c, k

      n = size(source%line)
      do c = 1, size(card)
         n = n + size(card(c)%facet) - (card(c)%last - card(c)%first)
      end do
      allocate(new%line(n), new%file(n), new%number(n))
      n = 0
      c = 1
      do i = 1, size(source%line)
         if (c <= size(card)) then
            if (i > card(c)%first .and. i <= card(c)%last) cycle
            if (i > card(c)%last) c = c + 1
         end if
         n = n + 1
         call move_alloc(source%line(i)%text, new%line(n)%text)
         new%file(n) = source%file(i)
         new%number(n) = source%number(i)
         if (c > size(card)) cycle
         if (i /= card(c)%first) cycle
         new%line(n)%text = card(c)%title
         do k = 1, size(card(c)%facet)
            call move_alloc(card(c)%facet(k)%text, new%line(n + k)%text)
            new%file(n + k) = card(c)%file
            new%number(n + k) = k
         end do
         n = n + size(card(c)%facet)
      end do
      call move_alloc(new%line, source%line)
      call move_alloc(new%file, source%file)
      call move_alloc(new%number, source%number)
   end subroutine insert

end module emcon_deck_stl_lines_space
