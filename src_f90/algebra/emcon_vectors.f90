! build: streams
!> Plain loops over fields of any rank, taken as the vectors that they are in memory.
!>
!> Written out for what runs in each correction: a compiler takes an array expression of rank two
!> apart column by column.
module emcon_vectors
   use emcon_kinds, only : wp
   implicit none
   private
   public :: vector_zero, vector_scale, vector_add, vector_sum, vector_product, vector_sizes, &
      vector_copy

contains

   !> y = 0
   pure subroutine vector_zero(n, y)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(out) :: y(n)

      y = 0.0_wp
   end subroutine vector_zero

   !> y = a y
   pure subroutine vector_scale(n, a, y)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: a
      real(wp), intent(inout) :: y(n)

      y = a*y
   end subroutine vector_scale

   !> y = y + a x
   pure subroutine vector_add(n, a, x, y)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: a, x(n)
      real(wp), intent(inout) :: y(n)

      y = y + a*x
   end subroutine vector_add

   !> z = x + a y
   pure subroutine vector_sum(n, x, a, y, z)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: x(n), a, y(n)
      real(wp), intent(out) :: z(n)

      z = x + a*y
   end subroutine vector_sum

   !> z = a x
   pure subroutine vector_product(n, a, x, z)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: a, x(n)
      real(wp), intent(out) :: z(n)

      z = a*x
   end subroutine vector_product

   !> z = |x|
   pure subroutine vector_sizes(n, x, z)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: x(n)
      real(wp), intent(out) :: z(n)

      z = abs(x)
   end subroutine vector_sizes

   !> z = x
   pure subroutine vector_copy(n, x, z)
      integer, intent(in) :: n                   !! numbers in each field
      real(wp), intent(in) :: x(n)
      real(wp), intent(out) :: z(n)

      z = x
   end subroutine vector_copy

end module emcon_vectors
