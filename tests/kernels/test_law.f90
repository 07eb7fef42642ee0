!> Constitutive laws against their textbook formulas in quadruple precision.
module test_law
   use check, only : check_error, check_near, test_case_t
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_box_t, law_response_plane, law_response_t
   use emcon_law_coupled_neo_hooke, only : law_coupled_neo_hooke_t
   use emcon_law_linear, only : law_linear_t
   use emcon_law_neo_hooke, only : law_neo_hooke_t
   use emcon_law_registry, only : law_create
   use emcon_materials, only : law_coupled_neo_hooke, law_linear, law_neo_hooke, material_t
   use emcon_text, only : to_text
   use referee, only : increment_of, qp, slopes_of
   implicit none
   private
   public :: collect_law

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> 40 roundings; E:E = e1^2 - 2 e2 and its like lose a factor of at most 2.
   real(wp), parameter :: tol = 40.0_wp*eps
   integer, parameter :: n_law = 3
   character(len=18), parameter :: name(n_law) = [character(len=18) :: "linear", "neo Hooke", &
      "coupled neo Hooke"]
   !> Constants of all laws; with `d1` the three agree at small strains.
   real(wp), parameter :: lam = 2.5_wp, mu = 1.5_wp, c10 = 0.5_wp*mu, d1 = 2.0_wp/(lam + mu/1.5_wp)

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
         test_case_t("registry", test_registry)]
   end subroutine collect_law

   subroutine make_laws(box)
      type(law_box_t), intent(out) :: box(n_law)

      allocate(box(1)%law, source=law_linear_t(lam=lam, mu=mu))
      allocate(box(2)%law, source=law_neo_hooke_t(c10=c10, d1=d1))
      allocate(box(3)%law, source=law_coupled_neo_hooke_t(lam=lam, mu=mu))
   end subroutine make_laws

   !> W(E11, E22, 2 E12) as printed in textbooks; negative numbers: (W(E) + W(-E))/2.
   pure function textbook(which, x) result(w)
      integer, intent(in) :: which
      real(qp), intent(in) :: x(3)
      real(qp) :: w, trace, j

      trace = x(1) + x(2)
      j = sqrt((1.0_qp + 2.0_qp*x(1))*(1.0_qp + 2.0_qp*x(2)) - x(3)*x(3))
      select case (which)
      case (1)
         w = 0.5_qp*real(lam, qp)*trace**2 &
            + real(mu, qp)*(x(1)**2 + x(2)**2 + 0.5_qp*x(3)**2)
      case (2)
         w = real(c10, qp)*((2.0_qp*trace + 3.0_qp)/j**(2.0_qp/3.0_qp) - 3.0_qp) &
            + (j - 1.0_qp)**2/real(d1, qp)
      case default
         w = real(mu, qp)*trace - real(mu, qp)*log(j) + 0.5_qp*real(lam, qp)*log(j)**2
      end select
   end function textbook

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
      if (s >= t) then
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

      call random_number(strain)
      call random_number(dstrain)
      strain = 0.5_wp*s*(strain - 0.5_wp)
      dstrain = ds*(dstrain - 0.5_wp)
   end subroutine draw

   subroutine test_energy(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3), expected
      integer :: i, k, digits_small

      call make_laws(box)
      zero = 0.0_wp
      do i = 1, n_law
         do k = 0, 240
            digits_small = mod(k, 13)
            call draw(10.0_wp**(-digits_small), 0.0_wp, strain, zero)
            expected = energy_of(i, strain)
            call law_response_plane(box(i)%law, strain, zero, response)
            call check_near(error, response%energy, expected, tol, expected, &
               trim(name(i)) // " at 1e-" // to_text(digits_small))
            call law_response_plane(box(i)%law, zero, strain, response)
            call check_near(error, response%energy, expected, tol, expected, &
               trim(name(i)) // " at the end of a step to 1e-" // to_text(digits_small))
         end do
         do k = 0, 4                             ! stretched up to 140 times and sheared
            strain = [10.0_wp**k, -0.3_wp, 0.4_wp*sqrt(10.0_wp**k)]
            call law_response_plane(box(i)%law, strain, [0.0_wp, 0.0_wp, 0.0_wp], response)
            expected = energy_of(i, strain)
            call check_near(error, response%energy, expected, tol, expected, &
               trim(name(i)) // " at a strain of 1e" // to_text(k))
         end do
      end do
   end subroutine test_energy

   !> S_alg.dE = W1 - W0 relative to its terms, for increments of 1 to the smallest.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response
      real(wp) :: strain(3), dstrain(3)
      integer :: i, k

      call make_laws(box)
      do i = 1, n_law
         do k = 0, -minexponent(1.0_wp) - 12, 3
            call draw(0.8_wp, 0.5_wp, strain, dstrain)
            dstrain = scale(dstrain, -k)
            call law_response_plane(box(i)%law, strain, dstrain, response)
            call check_near(error, dot_product(response%stress, dstrain), &
               increment_of(textbook, i, strain, dstrain), tol, &
               (lam + mu)*sum(abs(dstrain)), trim(name(i)) // " at 2^-" // to_text(k))
         end do
      end do
   end subroutine test_identity

   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3)
      integer :: i, k

      call make_laws(box)
      do i = 1, n_law
         do k = 1, 50
            call draw(0.8_wp, 0.0_wp, strain, zero)
            call law_response_plane(box(i)%law, strain, zero, response)
            call check_near(error, response%stress, slopes_of(textbook, i, strain), tol, &
               lam + mu, trim(name(i)))
         end do
      end do
   end subroutine test_stress

   !> Error of a central difference of step eps^(1/3): a multiple of eps^(2/3).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response, up, down
      real(wp) :: strain(3), dstrain(3), way(3), step
      integer :: i, j, k

      step = eps**(1.0_wp/3.0_wp)
      call make_laws(box)
      do i = 1, n_law
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

   !> S = D (E0 + E1)/2 up to terms of the order of the strain, also for the two neo-Hookean laws.
   subroutine test_small_strain(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response
      real(wp) :: strain(3), dstrain(3), d(3, 3), s
      integer :: i, k

      call make_laws(box)
      d = reshape([lam + 2*mu, lam, 0.0_wp, lam, lam + 2*mu, 0.0_wp, 0.0_wp, 0.0_wp, mu], [3, 3])
      do i = 1, n_law
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

   !> S33 = 2 dW/dC33 at C33 = 1.
   subroutine test_stress_33(error)
      type(error_t), allocatable, intent(out) :: error
      type(law_box_t) :: box(n_law)
      type(law_response_t) :: response
      real(wp) :: strain(3), zero(3), expected(n_law), trace, j
      integer :: i, k

      call make_laws(box)
      do k = 1, 50
         call draw(0.8_wp, 0.0_wp, strain, zero)
         trace = strain(1) + strain(2)
         j = sqrt((1.0_wp + 2.0_wp*strain(1))*(1.0_wp + 2.0_wp*strain(2)) - strain(3)**2)
         expected = [lam*trace, 2.0_wp*c10*exp(-log(j)/1.5_wp)*(-2.0_wp*trace/3.0_wp) &
            + 2.0_wp/d1*(j - 1.0_wp)*j, lam*log(j)]
         do i = 1, n_law
            call law_response_plane(box(i)%law, strain, zero, response)
            call check_near(error, response%stress_33, expected(i), tol, lam + mu, trim(name(i)))
         end do
      end do
   end subroutine test_stress_33

   !> Constants times 2^40: energy, stress and tangent change by that factor, bit for bit.
   subroutine test_scaling(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: unit = 2.0_wp**40
      type(law_box_t) :: box(n_law), scaled(n_law)
      type(law_response_t) :: one, other
      real(wp) :: strain(3), dstrain(3)
      integer :: i, k

      call make_laws(box)
      allocate(scaled(1)%law, source=law_linear_t(lam=unit*lam, mu=unit*mu))
      allocate(scaled(2)%law, source=law_neo_hooke_t(c10=unit*c10, d1=d1/unit))
      allocate(scaled(3)%law, source=law_coupled_neo_hooke_t(lam=unit*lam, mu=unit*mu))
      do i = 1, n_law
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

   !> E and nu become Lame's constants, C10 and D1 stay; a material without law is our own bug.
   subroutine test_registry(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(law_box_t) :: created, expected(n_law)
      type(law_response_t) :: one, other
      real(wp) :: constant(2, n_law), dstrain(3)
      integer, parameter :: kind(n_law) = [law_linear, law_neo_hooke, law_coupled_neo_hooke]
      integer :: i

      call make_laws(expected)
      constant(:, 1) = [mu*(3.0_wp*lam + 2.0_wp*mu)/(lam + mu), 0.5_wp*lam/(lam + mu)]
      constant(:, 2) = [c10, d1]
      constant(:, 3) = constant(:, 1)
      dstrain = [0.1_wp, 0.2_wp, -0.3_wp]
      do i = 1, n_law
         call law_create(material_t(name="M", law=kind(i), constant=constant(:, i), &
            density=7.0_wp), created%law, raised)
         call law_response_plane(created%law, 0.5_wp*dstrain, dstrain, one)
         call law_response_plane(expected(i)%law, 0.5_wp*dstrain, dstrain, other)
         call check_near(error, one%stress, other%stress, tol, lam + mu, name(i))
         call check_near(error, created%law%density, 7.0_wp, 0.0_wp, 1.0_wp, "density")
      end do
      call law_create(material_t(name="EMPTY"), created%law, raised)
      call check_error(error, raised, err_internal, "EMPTY", "material without law")
   end subroutine test_registry

end module test_law
