!> Numbers between 0 and 1 at random, in single and quadruple precision those of double precision:
!> a test looks at the same scenes in all of them.
module random_draws
   use emcon_kinds, only : dp, wp
   implicit none
   private
   public :: draw_random, signs_of

   interface draw_random
      module procedure draw_0, draw_1, draw_2, draw_3
   end interface draw_random

contains

   subroutine draw_0(value)
      real(wp), intent(out) :: value
      real(dp) :: drawn

      call random_number(drawn)
      value = real(drawn, wp)
   end subroutine draw_0

   subroutine draw_1(values)
      real(wp), intent(out) :: values(:)
      real(dp) :: drawn(size(values))

      call random_number(drawn)
      values = real(drawn, wp)
   end subroutine draw_1

   subroutine draw_2(values)
      real(wp), intent(out) :: values(:, :)
      integer :: j

      do j = 1, size(values, 2)
         call draw_1(values(:, j))
      end do
   end subroutine draw_2

   subroutine draw_3(values)
      real(wp), intent(out) :: values(:, :, :)
      integer :: k

      do k = 1, size(values, 3)
         call draw_2(values(:, :, k))
      end do
   end subroutine draw_3

   !> For differences along several freedoms at once: 1 or -1 by chance for each `n_way`-th of `n`,
   !> from the `k`-th on, and 0. Errors of two columns of a derivative cancel by chance alone.
   function signs_of(n, k, n_way) result(signs)
      integer, intent(in) :: n, k, n_way             !! 1 <= k <= n_way
      real(wp) :: signs(n), drawn(n)
      integer :: i

      call draw_random(drawn)
      signs = 0.0_wp
      do i = k, n, n_way
         signs(i) = merge(1.0_wp, -1.0_wp, drawn(i) > 0.5_wp)
      end do
   end function signs_of

end module random_draws
