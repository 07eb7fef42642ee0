!> Discrete-gradient numbers over any number of variables, against those over eleven.
module test_dgrad_wide
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad11, only : dg_constant, dg_sqrt, dg_t, dg_variable, operator(*), operator(+), &
      operator(/)
   use emcon_dgrad_wide, only : change_t, wide_add, wide_add_part, wide_add_product, wide_clear, &
      wide_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_dgrad_wide

   !> Two sums of products of numbers up to 10, in different order.
   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: n_var = 11

contains

   subroutine collect_dgrad_wide(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("sums and products", test_sums), &
         test_case_t("parts over some of the variables", test_parts), &
         test_case_t("a variable twice, a variable that does not move", test_shared), &
         test_case_t("the same number again, smaller and larger", test_reuse)]
   end subroutine collect_dgrad_wide

   !> A number that bends in three of the variables, those called `i`.
   pure function sample(i, x0, dx) result(s)
      integer, intent(in) :: i(3)                !! 0: stays at x0
      real(wp), intent(in) :: x0(3), dx(3)
      type(dg_t) :: s, v(3)
      integer :: k

      do k = 1, 3
         v(k) = dg_constant(x0(k))
         if (i(k) > 0) v(k) = dg_variable(i(k), x0(k), dx(k))
      end do
      s = v(1)*dg_sqrt(v(2)) + v(3)/v(2) + v(1)*v(3)
   end function sample

   subroutine draw(x0, dx)
      real(wp), intent(out) :: x0(:), dx(:)

      call draw_random(x0)
      call draw_random(dx)
      x0 = 1.0_wp + x0
      dx = dx - 0.5_wp
   end subroutine draw

   !> Add `factor` times `part` to `self`; its variable i is number `variable(i)` there.
   pure subroutine add(self, factor, part, variable)
      type(wide_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(dg_t), intent(in) :: part
      integer, intent(in) :: variable(:)

      call wide_add_part(self, factor, change_t(part%f0, part%f1, part%df), part%g, part%c, &
         part%h, variable)
   end subroutine add

   subroutine check_same(error, actual, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      type(wide_t), intent(in) :: actual
      type(dg_t), intent(in) :: expected
      character(len=*), intent(in) :: what

      associate (n => actual%n)
         call check_near(error, [actual%f0, actual%f1, actual%df], [expected%f0, expected%f1, &
            expected%df], tol, 10.0_wp, what // ", values")
         call check_near(error, actual%g(:n), expected%g(:n), tol, 10.0_wp, what // ", g")
         call check_near(error, actual%c(:n), expected%c(:n), tol, 10.0_wp, what // ", c")
         call check_near(error, actual%h(:n, :n), expected%h(:n, :n), tol, 10.0_wp, what // ", h")
      end associate
   end subroutine check_same

   subroutine test_sums(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(n_var), dx(n_var)
      type(dg_t) :: a, b
      type(wide_t) :: wide_a, wide_b, s
      integer :: i, k
      integer, parameter :: all_of_them(n_var) = [(k, k = 1, n_var)]

      do i = 1, 50
         call draw(x0, dx)
         a = sample([1, 4, 7], x0([1, 4, 7]), dx([1, 4, 7]))
         b = sample([7, 2, 10], x0([7, 2, 10]), dx([7, 2, 10]))
         call wide_clear(wide_a, n_var, .false.)
         call add(wide_a, 1.0_wp, a, all_of_them)
         call wide_clear(wide_b, n_var, .false.)
         call add(wide_b, 1.0_wp, b, all_of_them)
         call wide_clear(s, n_var, .false.)
         s%f0 = 3.0_wp
         s%f1 = 3.0_wp
         call wide_add(s, -2.0_wp, wide_a)
         call wide_add_product(s, 0.5_wp, wide_a, wide_b)
         call check_same(error, s, dg_constant(3.0_wp) + (-2.0_wp)*a + 0.5_wp*(a*b), "sum")
         call wide_clear(s, n_var, .false.)
         call wide_add_product(s, 1.0_wp, wide_a, wide_a)
         call check_same(error, s, a*a, "square")
         call check_near(error, dot_product(s%g(:n_var), dx), s%df, tol, 10.0_wp, "identity")
      end do
   end subroutine test_sums

   subroutine test_parts(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(n_var), dx(n_var)
      type(wide_t) :: s
      integer :: i

      do i = 1, 50
         call draw(x0, dx)
         call wide_clear(s, n_var, .false.)
         call add(s, 1.0_wp, sample([1, 2, 3], x0([9, 2, 5]), dx([9, 2, 5])), [9, 2, 5])
         call add(s, -0.5_wp, sample([2, 1, 3], x0([1, 9, 6]), dx([1, 9, 6])), [9, 1, 6])
         call check_same(error, s, sample([9, 2, 5], x0([9, 2, 5]), dx([9, 2, 5])) &
            + (-0.5_wp)*sample([1, 9, 6], x0([1, 9, 6]), dx([1, 9, 6])), "sum of parts")
      end do
   end subroutine test_parts

   !> Two variables of the part are one; the part does not know.
   subroutine test_shared(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(n_var), dx(n_var)
      type(wide_t) :: s
      integer :: i, k
      integer, parameter :: shared(3, 3) = reshape([4, 4, 8, 4, 8, 4, 8, 4, 4], [3, 3])

      do i = 1, 50
         call draw(x0, dx)
         do k = 1, 3
            associate (j => shared(:, k))
               call wide_clear(s, n_var, .false.)
               call add(s, 1.0_wp, sample([1, 2, 3], x0(j), dx(j)), j)
               call check_same(error, s, sample(j, x0(j), dx(j)), "shared " // to_text(k))
            end associate
         end do
         dx(7) = 0.0_wp
         call wide_clear(s, n_var, .false.)
         call add(s, 1.0_wp, sample([1, 2, 3], x0([4, 7, 8]), dx([4, 7, 8])), [4, 0, 8])
         call check_same(error, s, sample([4, 0, 8], x0([4, 7, 8]), dx([4, 7, 8])), "at rest")
      end do
   end subroutine test_shared

   !> What a number held before is gone, whatever the room it has.
   subroutine test_reuse(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: size_of(4) = [10, 3, 7, 12]
      real(wp) :: x0(3), dx(3)
      type(dg_t) :: a
      type(wide_t) :: s
      integer :: k

      call draw(x0, dx)
      a = sample([1, 2, 3], x0, dx)
      do k = 1, size(size_of)
         call wide_clear(s, size_of(k), .false.)
         call check_true(error, size(s%g) >= size_of(k), "room")
         if (size_of(k) <= n_var) call check_same(error, s, dg_constant(0.0_wp), "cleared")
         call add(s, 1.0_wp, a, [1, 2, 3])
         if (size_of(k) <= n_var) call check_same(error, s, a, "filled")
         call check_near(error, sum(abs(s%h(:s%n, :s%n))), sum(abs(a%h)), tol, 100.0_wp, &
            "nothing else")
      end do
   end subroutine test_reuse

end module test_dgrad_wide
