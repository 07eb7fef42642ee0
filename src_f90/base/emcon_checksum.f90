!> A checksum of bytes: their number and two Fletcher sums of words of four bytes, as Adler takes
!> them modulo a prime. Any change within one word is found, others but for one in 2**64.
module emcon_checksum
   use, intrinsic :: iso_fortran_env, only : int32, int64
   implicit none
   private
   public :: checksum_t, checksum_add, checksum_text

   type :: checksum_t
      private
      integer(int64) :: n = 0                        !! bytes
      integer(int64) :: first = 1, second = 0        !! sum of words, sum of these sums
   end type checksum_t

   !> The largest prime below 2**32.
   integer(int64), parameter :: modulus = 4294967291_int64
   integer(int64), parameter :: low_bits = 4294967295_int64
   !> Words that can be added before the sums have to be reduced: n (n + 1)/2 2**32 < 2**63.
   integer, parameter :: most_words = 16384
   integer, parameter :: word_size = 4

contains

   !> Go on with the bytes of `text`; all but the last piece are of a multiple of four bytes.
   pure subroutine checksum_add(self, text)
      type(checksum_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer(int32) :: words(most_words)
      character(len=word_size) :: last
      integer :: at, n

      at = 0
      do while (len(text) - at >= word_size)
         n = min(most_words, (len(text) - at)/word_size)
         words(:n) = transfer(text(at + 1:at + word_size*n), words, n)
         call add_words(self, words(:n))
         at = at + word_size*n
      end do
      if (at < len(text)) then
         last = text(at + 1:)
         call add_words(self, transfer(last, words, 1))
      end if
      self%n = self%n + len(text)
   end subroutine checksum_add

   pure subroutine add_words(self, word)
      type(checksum_t), intent(inout) :: self
      integer(int32), intent(in) :: word(:)          !! at most `most_words`
      integer(int64) :: first, second
      integer :: i

      first = self%first
      second = self%second
      do i = 1, size(word)
         first = first + iand(int(word(i), int64), low_bits)
         second = second + first
      end do
      self%first = mod(first, modulus)
      self%second = mod(second, modulus)
   end subroutine add_words

   !> The number of bytes and the sums, in digits.
   pure subroutine checksum_text(self, text)
      type(checksum_t), intent(in) :: self
      character(len=40), intent(out) :: text

      write(text, "(i0, 1x, z8.8, z8.8)") self%n, self%second, self%first
   end subroutine checksum_text

end module emcon_checksum
