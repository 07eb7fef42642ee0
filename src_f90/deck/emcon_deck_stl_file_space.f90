!> Files of STL: triangles by their corners, as text or binary. What is beside the corners, normals
!> and attributes, follows from them or means nothing here.
module emcon_deck_stl_file_space
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use, intrinsic :: iso_fortran_env, only : int32, real32
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : dp, int64, wp
   use emcon_text, only : read_real, stripped, to_text, to_upper
   implicit none
   private
   public :: stl_corners

   integer, parameter :: n_dim = 3, n_corner = 3
   !> A binary file: a title and a count, then facets: a normal, corners, two more bytes.
   integer, parameter :: title_bytes = 80, header_bytes = 84, facet_bytes = 50, number_bytes = 4
   character(len=*), parameter :: blanks = " " // achar(9) // achar(13)

   !> The words that lines of a text begin with, in turn; behind the last one stands a facet again,
   !> or the end of the solid.
   character(len=8), parameter :: word(8) = [character(len=8) :: "solid", "facet", "outer", &
      "vertex", "vertex", "vertex", "endloop", "endfacet"]
   character(len=*), parameter :: end_word = "endsolid"
   integer, parameter :: at_solid = 1, at_facet = 2, before_vertex = 3

   type :: text_reader_t
      integer :: place = at_solid                !! of the word that is next
      integer :: n_facet = 0
      logical :: has_solid = .false.
      real(dp), allocatable :: corner(:, :, :)   !! (3, 3, room)
   end type text_reader_t

contains

   !> The corners of all triangles of a file.
   subroutine stl_corners(bytes, corner, fault)
      character(len=*), intent(in) :: bytes                    !! all of the file
      real(dp), allocatable, intent(out) :: corner(:, :, :)    !! (3, corner, facet) [L]
      character(len=:), allocatable, intent(out) :: fault      !! "line 7: ...", empty: none
      integer(int64) :: n_counted, n_needed

      fault = ""
      n_counted = 0
      if (len(bytes) >= header_bytes) n_counted = count_at(bytes)
      n_needed = header_bytes + n_counted*facet_bytes
      if (len(bytes) >= header_bytes .and. n_needed == len(bytes, int64)) then
         call read_binary(bytes, int(n_counted), corner, fault)
      else if (is_text(bytes)) then
         call read_text(bytes, corner, fault)
      else if (len(bytes) < header_bytes) then
         fault = "byte " // to_text(len(bytes)) // ": the file ends here; as text it begins with " &
            // "'solid', and else it has a header of " // to_text(header_bytes) // " bytes"
      else
         fault = "byte " // to_text(title_bytes + 1) // ": a count of facets with which a " &
            // "binary file has " // trim(whole(n_needed)) // " bytes, but this one has " // &
            to_text(len(bytes))
      end if
      if (fault == "") then
         if (size(corner, 3) == 0) fault = "the file has no facet"
      end if
   end subroutine stl_corners

   !> Does a file begin as a text, and have no byte of 0 as numbers of binary files do?
   pure logical function is_text(bytes)
      character(len=*), intent(in) :: bytes
      integer :: first

      is_text = .false.
      first = verify(bytes, blanks // achar(10))
      if (first == 0 .or. first + 4 > len(bytes)) return
      is_text = to_upper(bytes(first:first + 4)) == "SOLID" .and. index(bytes, achar(0)) == 0
   end function is_text

   !> The count of facets, without sign, its lowest byte first.
   pure integer(int64) function count_at(bytes) result(n)
      character(len=*), intent(in) :: bytes
      integer :: k

      n = 0_int64
      do k = number_bytes, 1, -1
         n = 256_int64*n + int(iachar(bytes(title_bytes + k:title_bytes + k)), int64)
      end do
   end function count_at

   subroutine read_binary(bytes, n_facet, corner, fault)
      character(len=*), intent(in) :: bytes
      integer, intent(in) :: n_facet
      real(dp), allocatable, intent(out) :: corner(:, :, :)
      character(len=:), allocatable, intent(inout) :: fault
      integer :: f, k, a, first

      allocate(corner(n_dim, n_corner, n_facet))
      do f = 1, n_facet
         first = header_bytes + (f - 1)*facet_bytes + 1
         do k = 1, n_corner
            do a = 1, n_dim
               first = header_bytes + (f - 1)*facet_bytes + 1 + number_bytes*(n_dim*k + a - 1)
               corner(a, k, f) = number_at(bytes(first:first + number_bytes - 1))
               if (ieee_is_finite(corner(a, k, f))) cycle
               fault = "byte " // to_text(first) // ": a coordinate of facet " // to_text(f) // &
                  " is no number"
               return
            end do
         end do
      end do
   end subroutine read_binary

   !> A number of single precision, its lowest byte first.
   pure real(dp) function number_at(bytes) result(number)
      character(len=number_bytes), intent(in) :: bytes
      integer(int32) :: bits
      integer :: k

      bits = 0_int32
      do k = 1, number_bytes
         bits = ior(bits, ishft(int(iachar(bytes(k:k)), int32), 8*(k - 1)))
      end do
      number = real(transfer(bits, 1.0_real32), dp)
   end function number_at

   subroutine read_text(bytes, corner, fault)
      character(len=*), intent(in) :: bytes
      real(dp), allocatable, intent(out) :: corner(:, :, :)
      character(len=:), allocatable, intent(inout) :: fault
      type(text_reader_t) :: self
      integer :: first, last, i_line

      allocate(self%corner(n_dim, n_corner, 64))
      i_line = 0
      first = 1
      do while (first <= len(bytes))
         i_line = i_line + 1
         last = index(bytes(first:), achar(10))
         if (last == 0) last = len(bytes) - first + 2
         last = first + last - 2
         call take_line(self, stripped(bytes(first:last), blanks), fault)
         if (fault /= "") then
            fault = "line " // to_text(i_line) // ": " // fault
            return
         end if
         first = last + 2
      end do
      if (self%place /= at_solid .or. .not. self%has_solid) fault = "line " // to_text(i_line) // &
         ": the file ends here, without 'endsolid'"
      corner = self%corner(:, :, :self%n_facet)
   end subroutine read_text

   !> What a line says that stands where `self` is.
   subroutine take_line(self, line, fault)
      type(text_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: line       !! without blanks at its ends
      character(len=:), allocatable, intent(inout) :: fault
      integer :: n

      if (line == "") return
      n = scan(line // " ", " " // achar(9)) - 1
      if (self%place == at_facet .and. to_upper(line(:n)) == to_upper(end_word)) then
         self%place = at_solid
         return
      end if
      if (to_upper(line(:n)) /= to_upper(trim(word(self%place)))) then
         fault = "expected '" // trim(word(self%place)) // "'"
         if (self%place == at_facet) fault = fault // " or '" // end_word // "'"
         fault = fault // ", not " // quoted(line)
         return
      end if
      if (word(self%place) == "vertex") call take_vertex(self, line(n + 1:), fault)
      if (self%place == size(word)) self%n_facet = self%n_facet + 1
      self%has_solid = .true.
      self%place = merge(at_facet, self%place + 1, self%place == size(word))
   end subroutine take_line

   !> The three coordinates of a corner.
   subroutine take_vertex(self, words, fault)
      type(text_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: words
      character(len=:), allocatable, intent(inout) :: fault
      real(dp), allocatable :: grown(:, :, :)
      real(wp) :: number
      integer :: first, last, a
      logical :: ok

      if (self%n_facet == size(self%corner, 3)) then
         allocate(grown(n_dim, n_corner, 2*self%n_facet))
         grown(:, :, :self%n_facet) = self%corner
         call move_alloc(grown, self%corner)
      end if
      last = 0
      do a = 1, n_dim
         first = last + verify(words(last + 1:) // "x", " " // achar(9))
         last = first + scan(words(first:) // " ", " " // achar(9)) - 2
         call read_real(words(first:last), number, ok)
         if (.not. ok) then
            fault = "expected three numbers behind 'vertex', not " // quoted(stripped(words, &
               blanks))
            return
         end if
         self%corner(a, self%place - before_vertex, self%n_facet + 1) = real(number, dp)
      end do
      if (verify(words(last + 1:), " " // achar(9)) > 0) fault = &
         "expected three numbers behind 'vertex', not " // quoted(stripped(words, blanks))
   end subroutine take_vertex

   pure function whole(number) result(text)
      integer(int64), intent(in) :: number
      character(len=24) :: text

      write(text, "(i0)") number
   end function whole

end module emcon_deck_stl_file_space
