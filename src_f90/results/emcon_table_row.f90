!> Rows of numbers as lines of text, values parted by commas. Reals read back to the same bits.
module emcon_table_row
   use emcon_kinds, only : dp, int64
   implicit none
   private
   public :: table_row_t, table_row_begin, table_row_line

   integer, parameter :: number_width = 24           !! of a real with 17 significant digits

   !> The last row. Of the next one only what differs is made into text: that takes most of the
   !> time.
   type :: table_row_t
      private
      logical, allocatable :: is_integer(:)          !! (n_column)
      logical :: is_begun = .false.
      integer(int64), allocatable :: bits(:)         !! (n_column) of its values
      character(len=number_width), allocatable :: word(:)   !! (n_column)
   end type table_row_t

contains

   !> There is no row yet.
   pure subroutine table_row_begin(self, is_integer)
      type(table_row_t), intent(out) :: self
      logical, intent(in) :: is_integer(:)           !! (n_column) written as such

      allocate(self%is_integer, source=is_integer)
      allocate(self%bits(size(is_integer)), source=0_int64)
      allocate(self%word(size(is_integer)))
      self%word = ""
   end subroutine table_row_begin

   !> The next row.
   subroutine table_row_line(self, values, line)
      type(table_row_t), intent(inout) :: self
      real(dp), intent(in) :: values(:)              !! (n_column); whole numbers where integer
      character(len=:), allocatable, intent(out) :: line
      character(len=(number_width + 1)*size(values)) :: buffer
      integer(int64) :: bits
      integer :: i, n, n_word

      n = 0
      do i = 1, size(values)
         bits = transfer(values(i), bits)
         associate (word => self%word(i))
            if (bits /= self%bits(i) .or. .not. self%is_begun) then
               if (self%is_integer(i)) then
                  write(word, "(i0)") nint(values(i), int64)
               else
                  write(word, "(es24.16e3)") values(i)
               end if
               word = adjustl(word)
            end if
            n_word = len_trim(word)
            buffer(n + 1:n + n_word) = word(:n_word)
         end associate
         self%bits(i) = bits
         n = n + n_word + 1
         buffer(n:n) = ","
      end do
      self%is_begun = .true.
      line = buffer(:n - 1)
   end subroutine table_row_line

end module emcon_table_row
