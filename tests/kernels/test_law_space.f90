!> Laws of sums over principal stretches in three dimensions.
module test_law_space
   use check, only : check_near, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_registry, only : law_create
   use emcon_law_space, only : law_response_space, n_strain, space_response_t
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use random_draws, only : draw_random
   use referee, only : qp
   implicit none
   private
   public :: collect_law_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Axes, three times three terms of some dozen roundings, powers up to 4.
   real(wp), parameter :: tol = 256.0_wp*eps
   real(wp), parameter :: c10 = 0.75_wp, c01 = 0.25_wp, d1 = 0.6_wp, d2 = 3.0_wp, d3 = 5.0_wp
   real(wp), parameter :: m(3) = [1.5_wp, 0.25_wp, 0.25_wp], alpha(3) = [1.3_wp, 4.0_wp, -2.0_wp]
   real(wp), parameter :: modulus = 2.0_wp/d1 + 2.0_wp*sum(m)
   real(wp), parameter :: still(n_strain) = 0.0_wp

contains

   subroutine collect_law_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("Ogden's law is neo-Hooke's and Mooney's", test_special), &
         test_case_t("energy at strains of 1 to 1e-12", test_energy), &
         test_case_t("stress in closed form", test_stress), &
         test_case_t("small strains are linear elastic", test_small), &
         test_case_t("identity at any increment", test_identity), &
         test_case_t("small increments are as quiet as large ones", test_quiet), &
         test_case_t("tangent, also at equal stretches", test_tangent), &
         test_case_t("a turned strain is answered turned", test_turned)]
   end subroutine collect_law_space

   subroutine make_ogden(law, error)
      class(law_t), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(out) :: error

      call law_create(law_code("ogden 3"), [m(1), alpha(1), m(2), alpha(2), m(3), alpha(3), d1, &
         d2, d3], law, error)
   end subroutine make_ogden

   !> E11, E22, E33, 2 E12, 2 E23, 2 E13 of the principal values `x` along turned axes.
   pure function strain_of(x, r) result(e)
      real(wp), intent(in) :: x(3)
      real(wp), intent(in) :: r(3, 3)            !! axes, by columns
      real(wp) :: e(n_strain), t(3, 3)
      integer :: i

      t = 0.0_wp
      do i = 1, 3
         t(i, i) = x(i)
      end do
      t = matmul(r, matmul(t, transpose(r)))
      e = [t(1, 1), t(2, 2), t(3, 3), 2.0_wp*t(1, 2), 2.0_wp*t(2, 3), 2.0_wp*t(1, 3)]
   end function strain_of

   !> Axes anywhere: of a random quaternion.
   subroutine draw_axes(r)
      real(wp), intent(out) :: r(3, 3)
      real(wp) :: q(4)

      call draw_random(q)
      q = q - 0.5_wp
      q = q/sqrt(sum(q*q))
      r(:, 1) = [1.0_wp - 2.0_wp*(q(3)**2 + q(4)**2), 2.0_wp*(q(2)*q(3) + q(1)*q(4)), &
         2.0_wp*(q(2)*q(4) - q(1)*q(3))]
      r(:, 2) = [2.0_wp*(q(2)*q(3) - q(1)*q(4)), 1.0_wp - 2.0_wp*(q(2)**2 + q(4)**2), &
         2.0_wp*(q(3)*q(4) + q(1)*q(2))]
      r(:, 3) = [2.0_wp*(q(2)*q(4) + q(1)*q(3)), 2.0_wp*(q(3)*q(4) - q(1)*q(2)), &
         1.0_wp - 2.0_wp*(q(2)**2 + q(3)**2)]
   end subroutine draw_axes

   !> Principal strains of up to `size`, less below 0.
   subroutine draw_values(size, x)
      real(wp), intent(in) :: size
      real(wp), intent(out) :: x(3)

      call draw_random(x)
      x = size*(x - 0.3_wp)
   end subroutine draw_values

   subroutine test_special(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: one, other
      type(space_response_t) :: a, b
      real(wp) :: r(3, 3), x(3)
      integer :: i, k

      do i = 1, 2
         if (i == 1) then
            call law_create(law_code("ogden 1"), [2.0_wp*c10, 2.0_wp, d1], one, error)
            call law_create(law_code("neo hooke"), [c10, d1], other, error)
         else
            call law_create(law_code("ogden 2"), [2.0_wp*c10, 2.0_wp, 2.0_wp*c01, -2.0_wp, d1, &
               0.0_wp], one, error)
            call law_create(law_code("mooney-rivlin"), [c10, c01, d1], other, error)
         end if
         do k = 1, 100
            call draw_axes(r)
            call draw_values(1.0_wp, x)
            if (mod(k, 3) == 0) x(2) = x(1)
            call law_response_space(one, strain_of(x, r), still, a)
            call law_response_space(other, strain_of(x, r), still, b)
            call check_near(error, a%energy, b%energy, tol, modulus, "energy")
            call check_near(error, a%stress, b%stress, tol, modulus, "stress")
            call check_near(error, a%tangent, b%tangent, 8.0_wp*tol, modulus, "tangent")
         end do
      end do
   end subroutine test_special

   !> W as printed, by principal stretches.
   pure real(qp) function printed(x)
      real(wp), intent(in) :: x(3)               !! principal strains
      real(qp) :: l(3), j
      integer :: i

      l = sqrt(1.0_qp + 2.0_qp*real(x, qp))
      j = product(l)
      l = l/j**(1.0_qp/3.0_qp)
      printed = (j - 1.0_qp)**2/real(d1, qp) + (j - 1.0_qp)**4/real(d2, qp) &
         + (j - 1.0_qp)**6/real(d3, qp)
      do i = 1, 3
         printed = printed + 2.0_qp*real(m(i), qp)/real(alpha(i), qp)**2 &
            *(sum(l**real(alpha(i), qp)) - 3.0_qp)
      end do
   end function printed

   !> Where the formula has lost its digits in quadruple precision, W is quadratic.
   subroutine test_energy(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: response
      real(wp) :: r(3, 3), x(3), expected, bulk
      integer :: k, digits_small

      call make_ogden(law, error)
      bulk = 2.0_wp/d1
      do k = 0, 240
         digits_small = mod(k, 13)
         call draw_axes(r)
         call draw_values(10.0_wp**(-digits_small), x)
         expected = real(printed(x), wp)
         if (digits_small > 7) expected = 0.5_wp*bulk*sum(x)**2 + sum(m)*sum((x - sum(x)/3.0_wp)**2)
         call law_response_space(law, strain_of(x, r), still, response)
         call check_near(error, response%energy, expected, &
            tol + merge(100.0_wp*10.0_wp**(-digits_small), 0.0_wp, digits_small > 7), &
            modulus*sum(x*x), "energy, strain of 1e-" // to_text(digits_small))
      end do
   end subroutine test_energy

   !> Principal stresses l_i^2 S_i = sum of 2 m/alpha (l_i^alpha - mean) + J U'(J), with axes
   !> anywhere; two of three stretches equal (uniaxial and biaxial), and all.
   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: response
      real(wp) :: r(3, 3), l(3), s(3), expected(n_strain), power(3), j
      integer :: i, k

      call make_ogden(law, error)
      do k = 0, 60
         call draw_axes(r)
         call draw_random(l)
         l = 0.6_wp + l
         if (mod(k, 4) == 1) l(2) = l(3)
         if (mod(k, 4) == 2) l = l(1)
         j = product(l)
         s = j*(2.0_wp*(j - 1.0_wp)/d1 + 4.0_wp*(j - 1.0_wp)**3/d2 + 6.0_wp*(j - 1.0_wp)**5/d3)
         do i = 1, 3
            power = (l/j**(1.0_wp/3.0_wp))**alpha(i)
            s = s + 2.0_wp*m(i)/alpha(i)*(power - sum(power)/3.0_wp)
         end do
         expected = strain_of(s/l**2, r)
         expected(4:) = 0.5_wp*expected(4:)
         call law_response_space(law, strain_of(0.5_wp*(l*l - 1.0_wp), r), still, response)
         call check_near(error, response%stress, expected, tol, 10.0_wp*modulus, "stress")
      end do
   end subroutine test_stress

   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: response
      real(wp) :: r(3, 3), x(3), expected(n_strain), small
      integer :: k

      call make_ogden(law, error)
      small = eps**0.75_wp
      do k = 1, 20
         call draw_axes(r)
         call draw_values(small, x)
         expected = strain_of(2.0_wp/d1*sum(x) + 2.0_wp*sum(m)*(x - sum(x)/3.0_wp), r)
         expected(4:) = 0.5_wp*expected(4:)
         call law_response_space(law, strain_of(x, r), still, response)
         call check_near(error, response%stress, expected, tol + 20.0_wp*small, small*modulus, &
            "stress")
      end do
   end subroutine test_small

   !> The work of a step is the change of energy, from and to states with axes anywhere.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: start, step
      real(wp) :: r(3, 3), x(3), first(n_strain), by(n_strain)
      integer :: k

      call make_ogden(law, error)
      do k = 0, 200
         call draw_axes(r)
         call draw_values(1.0_wp, x)
         if (mod(k, 3) == 1) x = x(1)
         first = strain_of(x, r)*10.0_wp**(-mod(k, 8))
         call draw_axes(r)
         call draw_values(1.0_wp, x)
         if (mod(k, 5) == 1) x(2) = x(3)
         by = strain_of(x, r)*10.0_wp**(-mod(k, 8)) - first
         if (mod(k, 2) == 0) by = 10.0_wp**(-mod(k/8, 12))*by
         call law_response_space(law, first, still, start)
         call law_response_space(law, first, by, step)
         call check_near(error, dot_product(step%stress, by), step%energy - start%energy, tol, &
            modulus*(maxval(abs(first)) + maxval(abs(by)))**2, "step " // to_text(k))
      end do
   end subroutine test_identity

   !> Over a small step the stress is that in its middle, but for the square of its size.
   subroutine test_quiet(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: middle, step
      real(wp) :: r(3, 3), x(3), first(n_strain), by(n_strain), small
      integer :: k

      call make_ogden(law, error)
      do k = 1, 24
         small = sqrt(eps)*10.0_wp**(-mod(k, 8))
         call draw_axes(r)
         call draw_values(0.5_wp, x)
         if (mod(k, 3) == 1) x(2) = x(1)
         if (mod(k, 3) == 2) x(2) = x(1) + small
         first = strain_of(x, r)
         call draw_axes(r)
         call draw_values(small, x)
         by = strain_of(x, r)
         call law_response_space(law, first, by, step)
         call law_response_space(law, first + 0.5_wp*by, still, middle)
         call check_near(error, step%stress, middle%stress, tol, 10.0_wp*modulus, &
            "stress " // to_text(k))
      end do
   end subroutine test_quiet

   !> As test_element_space: differences over four points. Stretches are equal, or nearly so, at the
   !> start, at the end, or at both.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: step, near(2), far(2)
      real(wp) :: r(3, 3), x(3), first(n_strain), last(n_strain), by(n_strain), way(n_strain), h
      integer :: i, k

      call make_ogden(law, error)
      h = 0.5_wp*eps**0.3_wp
      do k = 0, 120
         call draw_axes(r)
         call draw_values(0.6_wp, x)
         if (mod(k, 2) == 1) x(2) = x(1) + 0.1_wp*2.0_wp**(-k/2)
         if (mod(k, 4) == 1) x = x(1)
         first = strain_of(x, r)
         if (mod(k, 3) > 0) call draw_axes(r)
         if (mod(k, 3) == 1) call draw_values(0.6_wp, x)
         last = strain_of(x, r)
         by = last - first
         call law_response_space(law, first, by, step)
         do i = 1, n_strain
            way = 0.0_wp
            way(i) = h
            call law_response_space(law, first, by + way, near(1))
            call law_response_space(law, first, by - way, near(2))
            call law_response_space(law, first, by + 2.0_wp*way, far(1))
            call law_response_space(law, first, by - 2.0_wp*way, far(2))
            call check_near(error, step%tangent(:, i), (8.0_wp*(near(1)%stress - near(2)%stress) &
               - (far(1)%stress - far(2)%stress))/(12.0_wp*h), 800.0_wp*eps**0.7_wp, modulus, &
               "tangent " // to_text(k))
         end do
      end do
   end subroutine test_tangent

   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(space_response_t) :: step, turned
      real(wp) :: a(3, 3), b(3, 3), turn(3, 3), x(3), y(3), s(3, 3), expected(n_strain)
      integer :: k

      call make_ogden(law, error)
      do k = 1, 40
         call draw_axes(a)
         call draw_axes(b)
         call draw_axes(turn)
         call draw_values(1.0_wp, x)
         call draw_values(1.0_wp, y)
         call law_response_space(law, strain_of(x, a), strain_of(y, b) - strain_of(x, a), step)
         a = matmul(turn, a)
         b = matmul(turn, b)
         call law_response_space(law, strain_of(x, a), strain_of(y, b) - strain_of(x, a), turned)
         s = reshape(step%stress([1, 4, 6, 4, 2, 5, 6, 5, 3]), [3, 3])
         s = matmul(turn, matmul(s, transpose(turn)))
         expected = [s(1, 1), s(2, 2), s(3, 3), s(1, 2), s(2, 3), s(1, 3)]
         call check_near(error, turned%stress, expected, tol, 10.0_wp*modulus, "stress")
         call check_near(error, turned%energy, step%energy, tol, 10.0_wp*modulus, "energy")
      end do
   end subroutine test_turned

end module test_law_space
