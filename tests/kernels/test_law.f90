!> Constitutive laws against their textbook formulas in quadruple precision.
module test_law
   use check, only : check_error, check_near, test_case_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_box_t, law_response_plane, law_response_t
   use emcon_law_registry, only : find_law_row, law_create, law_user, law_row, law_row_t, &
      n_constant, n_law => n_law_row
   use emcon_text, only : to_text
   use kind_rows, only : law_code, name => law_name
   use random_draws, only : draw_random
   use referee, only : increment_doubt, increment_of, qp, slope_doubt, slopes_of
   implicit none
   private
   public :: collect_law

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> 40 roundings; E:E = e1^2 - 2 e2 and its like lose a factor of at most 2.
   real(wp), parameter :: tol = 40.0_wp*eps
   !> Constants of all laws; with `d1` they agree at small strains.
   real(wp), parameter :: lam = 2.5_wp, mu = 1.5_wp, c10 = 0.5_wp*mu, d1 = 2.0_wp/(lam + mu/1.5_wp)
   real(wp), parameter :: young = mu*(3.0_wp*lam + 2.0_wp*mu)/(lam + mu), &
      nu = 0.5_wp*lam/(lam + mu)
   real(wp), parameter :: c01 = 0.25_wp*mu, c20 = -0.05_wp*mu, c30 = 0.02_wp*mu, &
      d2 = 3.0_wp, d3 = 5.0_wp
   real(wp), parameter :: mu_ogden(3) = mu*[0.75_wp, 0.125_wp, 0.125_wp], &
      alpha(3) = [1.3_wp, 4.0_wp, -2.0_wp]
   !> In the order of the rows. Ogden's law of one term is neo-Hooke's, that of two Mooney's.
   real(wp), parameter :: constants(*) = [young, nu, c10, d1, young, nu, c10 - c01, c01, d1, &
      c10, c20, c30, d1, d2, d3, mu, 2.0_wp, d1, &
      2.0_wp*(c10 - c01), 2.0_wp, 2.0_wp*c01, -2.0_wp, d1, 0.0_wp, &
      mu_ogden(1), alpha(1), mu_ogden(2), alpha(2), mu_ogden(3), alpha(3), d1, d2, d3]

contains

   subroutine collect_law(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("energy at strains of 1 to 1e-12", test_energy), &
         test_case_t("identity at any increment", test_identity), &
         test_case_t("stress is the gradient of the energy", test_stress), &
         test_case_t("tangent", test_tangent), &
         test_case_t("small strains are linear elastic", test_small_strain), &
         test_case_t("stress normal to the plane", test_stress_33), &
         test_case_t("units of stress by powers of two", test_scaling), &
         test_case_t("registry", test_registry), &
         test_case_t("Ogden's law is neo-Hooke's and Mooney's", test_ogden_special), &
         test_case_t("equal principal stretches", test_equal_stretches), &
         test_case_t("simple shear and stretch in closed form", test_closed_form), &
         test_case_t("constants refused", test_refusals)]
   end subroutine collect_law

   !> Place in `constants` of the first one of a law; behind the last law: one more than there are.
   pure integer function first(which)
      integer, intent(in) :: which                   !! row, 1..n_law() + 1
      integer :: i

      first = 1
      do i = 1, which - 1
         first = first + n_constant(law_row(i))
      end do
   end function first

   subroutine make_laws(box, unit)
      type(law_box_t), intent(out) :: box(n_law())
      real(wp), intent(in), optional :: unit         !! of stress
      real(wp), allocatable :: constant(:)
      type(error_t), allocatable :: raised
      type(law_row_t) :: row
      integer :: i, k

      do i = 1, n_law()
         row = law_row(i)
         constant = constants(first(i):first(i + 1) - 1)
         do k = 1, size(constant)
            if (.not. present(unit)) cycle
            select case (row%constant(k)(1:1))
            case ("E", "C", "m")
               constant(k) = constant(k)*unit
            case ("D")
               constant(k) = constant(k)/unit
            end select
         end do
         call law_create(row%code, constant, box(i)%law, raised)
      end do
   end subroutine make_laws

   !> W(E11, E22, 2 E12) in the plane; negative numbers: (W(E) + W(-E))/2.
   pure function textbook(which, x) result(w)
      integer, intent(in) :: which
      real(qp), intent(in) :: x(3)
      real(qp) :: w

      w = printed(which, x, 1.0_qp)
   end function textbook

   !> W as printed in textbooks, at a strain whose normal to the plane is a principal direction.
   pure function printed(which, x, c33) result(w)
      integer, intent(in) :: which                   !! row
      real(qp), intent(in) :: x(3)                   !! E11, E22, 2 E12
      real(qp), intent(in) :: c33                    !! 1 + 2 E33
      real(qp) :: w, trace, j, i1, i2, det
      type(law_row_t) :: row
      integer :: i

      trace = x(1) + x(2) + 0.5_qp*(c33 - 1.0_qp)
      det = (1.0_qp + 2.0_qp*x(1))*(1.0_qp + 2.0_qp*x(2)) - x(3)*x(3)
      j = sqrt(det*c33)
      i1 = (2.0_qp*trace + 3.0_qp)/j**(2.0_qp/3.0_qp)                ! of C, without J
      i2 = (det + c33*(2.0_qp*trace + 3.0_qp - c33))/j**(4.0_qp/3.0_qp)
      row = law_row(which)
      select case (row%name)
      case ("linear")
         w = 0.5_qp*real(lam, qp)*trace**2 + real(mu, qp)*(x(1)**2 + x(2)**2 + 0.5_qp*x(3)**2 &
            + 0.25_qp*(c33 - 1.0_qp)**2)
      case ("neo hooke")
         w = real(c10, qp)*(i1 - 3.0_qp) + volume_part(j, 1)
      case ("coupled neo hooke")
         w = real(mu, qp)*trace - real(mu, qp)*log(j) + 0.5_qp*real(lam, qp)*log(j)**2
      case ("mooney-rivlin")
         w = real(c10 - c01, qp)*(i1 - 3.0_qp) + real(c01, qp)*(i2 - 3.0_qp) + volume_part(j, 1)
      case ("yeoh")
         w = real(c10, qp)*(i1 - 3.0_qp) + real(c20, qp)*(i1 - 3.0_qp)**2 &
            + real(c30, qp)*(i1 - 3.0_qp)**3 + volume_part(j, 3)
      case ("ogden 1", "ogden 2", "ogden 3")
         w = volume_part(j, merge(3, 1, row%order == 3))
         do i = 1, row%order
            associate (m => real(constants(first(which) + 2*i - 2), qp), &
                  a => real(constants(first(which) + 2*i - 1), qp))
               w = w + 2.0_qp*m/a**2*(sum(stretches(x, c33, j)**a) - 3.0_qp)
            end associate
         end do
      case default
         w = huge(w)                                 ! it is missing: each test says so
      end select
   end function printed

   !> Sum of (J - 1)^(2 i)/D_i, i <= n.
   pure real(qp) function volume_part(j, n)
      real(qp), intent(in) :: j
      integer, intent(in) :: n
      real(qp), parameter :: d(3) = real([d1, d2, d3], qp)
      integer :: i

      volume_part = sum([((j - 1.0_qp)**(2*i)/d(i), i = 1, n)])
   end function volume_part

   !> Principal stretches times J^(-1/3).
   pure function stretches(x, c33, j) result(stretch)
      real(qp), intent(in) :: x(3), c33, j
      real(qp) :: stretch(3), apart

      apart = sqrt((x(1) - x(2))**2 + x(3)**2)
      stretch = sqrt([1.0_qp + x(1) + x(2) + apart, 1.0_qp + x(1) + x(2) - apart, c33])
      stretch = stretch/j**(1.0_qp/3.0_qp)
   end function stretches

   !> W to the relative accuracy of `wp`: below 1e-5 the formula loses its digits even here, so
   !> W(s E) = s^2 W2 + s^3 W3 + s^4 W4 with coefficients from strains of 1e-5 and 2e-5.
   pure function energy_of(which, strain) result(w)
      integer, intent(in) :: which
      real(wp), intent(in) :: strain(3)
      real(wp) :: w
      real(qp), parameter :: t = 1.0e-5_qp
      real(qp) :: s, way(3), even(2), odd, w2, w4
      integer :: k

      s = real(maxval(abs(strain)), qp)
      way = real(strain, qp)
      if (s >= t .or. increment_doubt > 0.0_wp) then
         w = real(textbook(which, way), wp)
         return
      end if
      way = way/s
      do k = 1, 2
         even(k) = 0.5_qp*(textbook(which, k*t*way) + textbook(which, -k*t*way))/(k*t)**2
      end do
      w2 = (4.0_qp*even(1) - even(2))/3.0_qp
      w4 = (even(2) - even(1))/(3.0_qp*t*t)
      odd = 0.5_qp*(textbook(which, t*way) - textbook(which, -t*way))/t**3
      w = real(s*s*(w2 + s*(odd + s*w4)), wp)
   end function energy_of

   !> A strain of size `s`, and an increment of up to `ds`.
   subroutine draw(s, ds, strain, dstrain)
      real(wp), intent(in) :: s, ds
      real(wp), intent(out) :: strain(3), dstrain(3)

      do
         call draw_random(strain)
         call draw_random(dstrain)
         strain = 0.5_wp*s*(strain - 0.5_wp)
         dstrain = ds*(dstrain - 0.5_wp)
         if (has_volume(strain + dstrain)) exit
      end do
   end subroutine draw

   !> Is C positive definite, and clearly so?
   pure logical function has_volume(x)
      real(wp), intent(in) :: x(3)

      has_volume = min(1.0_wp + 2.0_wp*x(1), 1.0_wp + 2.0_wp*x(2), &
         (1.0_wp + 2.0_wp*x(1))*(1.0_wp + 2.0_wp*x(2)) - x(3)**2) > 0.2_wp
   end function has_volume

   subroutine test_energy(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3), expected
      integer :: i, k, digits_small

      call make_laws(box)
      zero = 0.0_wp
      do i = 1, n_law()
         do k = 0, 240
            digits_small = mod(k, 13)
            call draw(10.0_wp**(-digits_small), 0.0_wp, strain, zero)
            expected = energy_of(i, strain)
            call law_response_plane(box(i)%law, strain, zero, response)
            call check_near(error, response%energy, expected, tol, &
               expected + increment_doubt, &
               trim(name(i)) // " at 1e-" // to_text(digits_small))
            call law_response_plane(box(i)%law, zero, strain, response)
            call check_near(error, response%energy, expected, tol, &
               expected + increment_doubt, &
               trim(name(i)) // " at the end of a step to 1e-" // to_text(digits_small))
         end do
         do k = 0, 4                             ! stretched up to 140 times and sheared
            strain = [10.0_wp**k, -0.3_wp, 0.4_wp*sqrt(10.0_wp**k)]
            call law_response_plane(box(i)%law, strain, [0.0_wp, 0.0_wp, 0.0_wp], response)
            expected = energy_of(i, strain)
            call check_near(error, response%energy, expected, tol, &
               expected + increment_doubt, &
               trim(name(i)) // " at a strain of 1e" // to_text(k))
         end do
      end do
   end subroutine test_energy

   !> S_alg.dE = W1 - W0 relative to its terms, for increments of 1 to the smallest.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      real(wp) :: strain(3), dstrain(3)
      integer :: i, k

      call make_laws(box)
      do i = 1, n_law()
         do k = 0, -minexponent(1.0_wp) - 12, 3
            call draw(0.8_wp, 0.5_wp, strain, dstrain)
            dstrain = scale(dstrain, -k)
            call law_response_plane(box(i)%law, strain, dstrain, response)
            call check_near(error, dot_product(response%stress, dstrain), &
               increment_of(textbook, i, strain, dstrain), tol, &
               (lam + mu)*(sum(abs(dstrain)) + increment_doubt), &
               trim(name(i)) // " at 2^-" // to_text(k))
         end do
      end do
   end subroutine test_identity

   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3)
      integer :: i, k

      call make_laws(box)
      do i = 1, n_law()
         do k = 1, 50
            call draw(0.8_wp, 0.0_wp, strain, zero)
            call law_response_plane(box(i)%law, strain, zero, response)
            call check_near(error, response%stress, slopes_of(textbook, i, strain), &
               tol + slope_doubt, lam + mu, trim(name(i)))
         end do
      end do
   end subroutine test_stress

   !> Error of a central difference of step eps^(1/3): a multiple of eps^(2/3).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response, up, down
      real(wp) :: strain(3), dstrain(3), way(3), step
      integer :: i, j, k

      step = eps**(1.0_wp/3.0_wp)
      call make_laws(box)
      do i = 1, n_law()
         do k = 0, 48, 4
            call draw(0.8_wp, 0.5_wp, strain, dstrain)
            dstrain = scale(dstrain, -k)
            call law_response_plane(box(i)%law, strain, dstrain, response)
            do j = 1, 3
               way = 0.0_wp
               way(j) = step
               call law_response_plane(box(i)%law, strain, dstrain + way, up)
               call law_response_plane(box(i)%law, strain, dstrain - way, down)
               call check_near(error, response%tangent(:, j), &
                  (up%stress - down%stress)/(2.0_wp*step), 200.0_wp*step**2, lam + mu, &
                  trim(name(i)) // " at 2^-" // to_text(k) // ", column " // to_text(j))
            end do
         end do
      end do
   end subroutine test_tangent

   !> S = D (E0 + E1)/2 up to terms of the order of the strain, for all laws.
   subroutine test_small_strain(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      real(wp) :: strain(3), dstrain(3), d(3, 3), s
      integer :: i, k

      call make_laws(box)
      d = reshape([lam + 2*mu, lam, 0.0_wp, lam, lam + 2*mu, 0.0_wp, 0.0_wp, 0.0_wp, mu], [3, 3])
      do i = 1, n_law()
         do k = 2, 10, 4
            s = 10.0_wp**(-k)
            call draw(s, s, strain, dstrain)
            call law_response_plane(box(i)%law, strain, dstrain, response)
            call check_near(error, response%stress, matmul(d, strain + 0.5_wp*dstrain), &
               8.0_wp*s + tol, (lam + mu)*s, trim(name(i)) // ", stress at 1e-" // to_text(k))
            call check_near(error, response%tangent, 0.5_wp*d, 16.0_wp*s + tol, lam + mu, &
               trim(name(i)) // ", tangent at 1e-" // to_text(k))
         end do
      end do
   end subroutine test_small_strain

   !> S33 = 2 dW/dC33 at C33 = 1, by differences in quadruple precision.
   subroutine test_stress_33(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3)
      real(qp) :: x(3), expected
      real(qp), parameter :: h = 1.0e-10_qp
      integer :: i, k

      call make_laws(box)
      do k = 1, 50
         call draw(0.8_wp, 0.0_wp, strain, zero)
         x = real(strain, qp)
         do i = 1, n_law()
            call law_response_plane(box(i)%law, strain, zero, response)
            expected = (printed(i, x, 1.0_qp + h) - printed(i, x, 1.0_qp - h))/h
            call check_near(error, response%stress_33, real(expected, wp), &
               tol + slope_doubt, lam + mu, trim(name(i)))
         end do
      end do
   end subroutine test_stress_33

   !> Constants times 2^40: energy, stress and tangent change by that factor, bit for bit.
   subroutine test_scaling(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: unit = 2.0_wp**40
      type(law_box_t) :: box(n_law()), scaled(n_law())
      type(law_response_t) :: one, other
      real(wp) :: strain(3), dstrain(3)
      integer :: i, k

      call make_laws(box)
      call make_laws(scaled, unit)
      do i = 1, n_law()
         do k = 1, 50
            call draw(0.8_wp, 0.5_wp, strain, dstrain)
            call law_response_plane(box(i)%law, strain, dstrain, one)
            call law_response_plane(scaled(i)%law, strain, dstrain, other)
            call check_near(error, other%energy, unit*one%energy, 0.0_wp, 1.0_wp, "energy")
            call check_near(error, other%stress, unit*one%stress, 0.0_wp, 1.0_wp, "stress")
            call check_near(error, other%stress_33, unit*one%stress_33, 0.0_wp, 1.0_wp, "S33")
            call check_near(error, other%tangent, unit*one%tangent, 0.0_wp, 1.0_wp, "tangent")
         end do
      end do
   end subroutine test_scaling

   !> Rows and their constants fit; a law that is not in the table is our own bug.
   subroutine test_registry(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(law_box_t) :: created
      type(law_row_t) :: row
      integer :: i, n

      do i = 1, n_law()
         row = law_row(i)
         n = n_constant(row)
         if (first(i) + n /= first(i + 1)) error stop "test_law: constants do not fit the rows"
         call law_create(row%code, constants(first(i):first(i + 1) - 1), created%law, raised)
         call check_near(error, created%law%shear, mu, tol, mu, name(i))
         call law_create(row%code, spread(1.0_wp, 1, n + 1), created%law, raised)
         call check_error(error, raised, err_input, "too many or too few", name(i))
         call check_near(error, real(find_law_row(row%keyword, row%variant, max(row%order, 1)), &
            wp), real(i, wp), 0.0_wp, 1.0_wp, name(i))
      end do
      call check_near(error, real(find_law_row("HYPERELASTIC", "OGDEN", 4), wp), 0.0_wp, 0.0_wp, &
         1.0_wp, "no such order")
      call law_create(law_user, [1.0_wp], created%law, raised)
      call check_error(error, raised, err_input, "no law with the code", "law that is given")
   end subroutine test_registry

   !> With alpha = 2, and with 2 and -2, energy and stress are those of laws in I1 and I2.
   subroutine test_ogden_special(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: one, other
      real(wp) :: strain(3), dstrain(3)
      integer :: i, k
      integer :: pair(2, 2)

      pair(:, 1) = [find_law_row("HYPERELASTIC", "OGDEN", 1), &
         find_law_row("HYPERELASTIC", "NEOHOOKE", 0)]
      pair(:, 2) = [find_law_row("HYPERELASTIC", "OGDEN", 2), &
         find_law_row("HYPERELASTIC", "MOONEY-RIVLIN", 0)]
      call make_laws(box)
      do i = 1, 2
         do k = 0, 100
            call draw(0.8_wp, 0.0_wp, strain, dstrain)
            call law_response_plane(box(pair(1, i))%law, strain, dstrain, one)
            call law_response_plane(box(pair(2, i))%law, strain, dstrain, other)
            call check_near(error, one%energy, other%energy, tol, lam + mu, "energy")
            call check_near(error, one%stress, other%stress, tol, lam + mu, "stress")
            call check_near(error, one%stress_33, other%stress_33, tol, lam + mu, "S33")
            call check_near(error, one%tangent, other%tangent, 2.0_wp*tol, lam + mu, "tangent")
         end do
      end do
   end subroutine test_ogden_special

   !> Steps from, to and through states where the principal stretches are equal or nearly so: the
   !> identity and the tangent hold as elsewhere.
   subroutine test_equal_stretches(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response, up, down
      real(wp) :: strain(3), dstrain(3), way(3), step, off
      integer :: i, j, k

      call make_laws(box)
      step = eps**(1.0_wp/3.0_wp)
      do i = 1, n_law()
         do k = 0, 60, 3
            off = 0.3_wp*2.0_wp**(-k)
            do j = 1, 6
               strain = 0.1_wp*[1.0_wp, 1.0_wp, 0.0_wp]
               dstrain = 0.05_wp*[1.0_wp, 1.0_wp, 0.0_wp]
               if (mod(j, 2) == 0) strain = strain + [off, 0.0_wp, -off]
               if (j > 2) dstrain = dstrain + [0.0_wp, off, off]
               if (j > 4) dstrain = dstrain*off
               call law_response_plane(box(i)%law, strain, dstrain, response)
               call check_near(error, dot_product(response%stress, dstrain), &
                  increment_of(textbook, i, strain, dstrain), tol, &
                  (lam + mu)*(sum(abs(dstrain)) + increment_doubt), &
               trim(name(i)) // " at 2^-" // to_text(k))
               way = 0.0_wp
               way(1 + mod(k, 3)) = step
               call law_response_plane(box(i)%law, strain, dstrain + way, up)
               call law_response_plane(box(i)%law, strain, dstrain - way, down)
               call check_near(error, matmul(response%tangent, way)/step, &
                  (up%stress - down%stress)/(2.0_wp*step), 200.0_wp*step**2, lam + mu, &
                  trim(name(i)) // ", tangent at 2^-" // to_text(k))
            end do
         end do
      end do
   end subroutine test_equal_stretches

   !> Simple shear by g, F = [1 g; 0 1]: sigma12 = dW/dg, with stretches l and 1/l, g = l - 1/l, so
   !> of Ogden's law sum of 2 mu/alpha (l^alpha - l^-alpha)/(l + 1/l), of the laws in I1 and I2
   !> (both 3 + g^2) 2 (W1 + W2) g. Uniform stretch of the plane by l: S11 = S22 from J = l^2.
   subroutine test_closed_form(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law())
      type(law_response_t) :: response
      type(law_row_t) :: row
      real(wp) :: g, l, expected, s(2, 2), sigma
      integer :: i, k

      call make_laws(box)
      do k = 1, 20
         g = 0.1_wp*k
         l = 0.5_wp*(g + sqrt(g*g + 4.0_wp))
         do i = 1, n_law()
            row = law_row(i)
            select case (row%name)
            case ("neo hooke", "mooney-rivlin")
               expected = 2.0_wp*c10*g
            case ("yeoh")
               expected = 2.0_wp*g*(c10 + 2.0_wp*c20*g**2 + 3.0_wp*c30*g**4)
            case ("ogden 1", "ogden 2", "ogden 3")
               expected = ogden_shear(l, constants(first(i):first(i) + 2*row%order - 1))
            case default
               cycle
            end select
            call law_response_plane(box(i)%law, [0.0_wp, 0.5_wp*g*g, g], spread(0.0_wp, 1, 3), &
               response)
            s = reshape(response%stress([1, 3, 3, 2]), [2, 2])
            sigma = s(1, 2) + g*s(2, 2)            ! of F S F^T
            call check_near(error, sigma, expected, tol, 10.0_wp*(lam + mu), trim(name(i)))
         end do
      end do
   end subroutine test_closed_form

   pure real(wp) function ogden_shear(l, constant)
      real(wp), intent(in) :: l                      !! stretch
      real(wp), intent(in) :: constant(:)            !! mu1, alpha1, mu2, ...

      associate (m => constant(1::2), a => constant(2::2))
         ogden_shear = sum(2.0_wp*m/a*(l**a - l**(-a)))/(l + 1.0_wp/l)
      end associate
   end function ogden_shear

   subroutine test_refusals(error)
      type(error_t), allocatable, intent(out) :: error

      call refuse(law_code("neo hooke"), [-1.0_wp, 1.0_wp], "C10 = -1 must be positive")
      call refuse(law_code("mooney-rivlin"), [1.0_wp, -2.0_wp, 1.0_wp], &
         "C10 + C01 = -1 must be positive")
      call refuse(law_code("yeoh"), [1.0_wp, 0.0_wp, 0.0_wp, -1.0_wp, 0.0_wp, 0.0_wp], &
         "D1 = -1 must not")
      call refuse(law_code("ogden 1"), [1.0_wp, 0.0_wp, 1.0_wp], "alpha = 0 must not be 0")
      call refuse(law_code("ogden 1"), [1.0_wp, 2.0_wp, -1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp], &
         "sum of all mu = 0")

   contains

      subroutine refuse(code, constant, text)
         integer, intent(in) :: code
         real(wp), intent(in) :: constant(:)
         character(len=*), intent(in) :: text
         type(law_box_t) :: created
         type(error_t), allocatable :: raised

         call law_create(code, constant, created%law, raised)
         call check_error(error, raised, err_input, text, text)
      end subroutine refuse

   end subroutine test_refusals

end module test_law
