!> Pressures by the overclosure: closed forms, means over ways, what is stored, derivatives.
module test_pressure_law
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_contact_law_registry, only : contact_law_in_place
   use emcon_errors, only : error_t
   use emcon_interactions, only : interaction_t, pressure_exponential, pressure_linear, &
      pressure_reach, pressure_t, pressure_tabular
   use emcon_kinds, only : wp
   use emcon_pressure_law, only : pressure_at, pressure_mean, pressure_stored
   use emcon_steps, only : method_null_space, method_penalty
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_pressure_law

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 64.0_wp*eps

contains

   subroutine collect_pressure_law(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("pressures in closed form", test_forms), &
         test_case_t("means over ways are differences of what is stored", test_means), &
         test_case_t("derivatives of means", test_rates), &
         test_case_t("short ways are smooth", test_short), &
         test_case_t("a law stores what it takes, over many steps", test_steps), &
         test_case_t("which law acts", test_which)]
   end subroutine collect_pressure_law

   !> One of each kind: linear, with a tension, exponential, a table that begins at a clearance.
   pure function curve_of(kind) result(curve)
      integer, intent(in) :: kind                !! 1..4
      type(pressure_t) :: curve

      select case (kind)
      case (1); curve = pressure_t(pressure_linear, slope=5.0_wp)
      case (2); curve = pressure_t(pressure_linear, slope=5.0_wp, tension=0.1_wp)
      case (3); curve = pressure_t(pressure_exponential, clearance=0.2_wp, at_touch=0.7_wp)
      case default; curve = pressure_t(pressure_tabular, pressure=[0.0_wp, 0.0_wp, 0.5_wp, &
         4.0_wp], overclosure=[-0.3_wp, -0.1_wp, 0.2_wp, 0.5_wp])
      end select
   end function curve_of

   subroutine test_forms(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp), bend = pi*0.1_wp/5.0_wp
      real(wp) :: p, slope

      call pressure_at(curve_of(1), 0.3_wp, p, slope)
      call check_near(error, [p, slope], [1.5_wp, 5.0_wp], tol, 1.0_wp, "linear")
      call pressure_at(curve_of(2), 0.3_wp, p, slope)
      call check_near(error, p, 1.5_wp*(0.5_wp + atan(0.3_wp/bend)/pi), tol, 1.0_wp, "tension")
      call pressure_at(curve_of(2), 1.0e6_wp, p, slope)
      call check_near(error, [5.0e6_wp - p, slope], [0.1_wp, 5.0_wp], 1.0e-8_wp, 1.0_wp, &
         "far in, the line less the tension")
      call pressure_at(curve_of(3), 0.0_wp, p, slope)
      call check_near(error, p, 0.7_wp, tol, 1.0_wp, "p0 where it touches")
      call pressure_at(curve_of(3), -0.2_wp, p, slope)
      call check_near(error, p, 0.007_wp, tol, 1.0_wp, "a hundredth at the clearance")
      call pressure_at(curve_of(4), 0.35_wp, p, slope)
      call check_near(error, p, 2.25_wp, tol, 1.0_wp, "table")
      call pressure_at(curve_of(4), 0.8_wp, p, slope)
      call check_near(error, p, 7.5_wp, tol, 8.0_wp, "a table goes on")
      call pressure_at(curve_of(4), -0.31_wp, p, slope)
      call check_true(error, .not. abs(p) + abs(slope) > 0.0_wp, "nothing before its start")
      call check_near(error, [pressure_reach(curve_of(1)), pressure_reach(curve_of(3)), &
         pressure_reach(curve_of(4))], [0.0_wp, 0.6_wp, 0.3_wp], tol, 1.0_wp, "reach")
   end subroutine test_forms

   !> Of ways of all lengths, within the curve and beyond its start.
   subroutine test_means(error)
      type(error_t), allocatable, intent(out) :: error
      type(pressure_t) :: curve
      real(wp) :: way(2), mean, rate
      integer :: i, kind

      do i = 1, 400
         kind = 1 + mod(i, 4)
         call draw_random(way)
         way = -0.8_wp + 1.6_wp*way
         if (mod(i, 8) > 3) way(2) = way(1) + 1.0e-3_wp*(way(2) - way(1))
         curve = curve_of(kind)
         call pressure_mean(curve, way(1), way(2), mean, rate)
         call check_near(error, mean*(way(2) - way(1)), pressure_stored(curve, way(2)) &
            - pressure_stored(curve, way(1)), tol, 4.0_wp + pressure_stored(curve, &
            maxval(way)), "kind " // to_text(kind))
      end do
   end subroutine test_means

   !> The derivative by the end of the way against differences, away from kinks.
   subroutine test_rates(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = eps**(1.0_wp/3.0_wp)
      type(pressure_t) :: curve
      real(wp) :: way(2), mean(3), rate(3)
      integer :: i, kind

      do i = 1, 400
         kind = 1 + mod(i, 4)
         call draw_random(way)
         way = -0.8_wp + 1.6_wp*way
         if (abs(way(2) - way(1)) < 0.05_wp) cycle
         curve = curve_of(kind)
         if (any(abs(way(2) - [-0.6_wp, -0.3_wp, -0.1_wp, 0.0_wp, 0.2_wp, 0.5_wp]) &
            < 2.0_wp*step)) cycle
         call pressure_mean(curve, way(1), way(2), mean(1), rate(1))
         call pressure_mean(curve, way(1), way(2) + step, mean(2), rate(2))
         call pressure_mean(curve, way(1), way(2) - step, mean(3), rate(3))
         ! Second derivatives are some (1/0.05)^2.
         call check_near(error, rate(1), (mean(2) - mean(3))/(2.0_wp*step), &
            1.0e3_wp*step**2, 1.0e3_wp + abs(rate(1)), "kind " // to_text(kind))
      end do
   end subroutine test_rates

   !> A way of no length has the pressure there, and half of its slope; a short one nearly so, with
   !> no loss of digits.
   subroutine test_short(error)
      type(error_t), allocatable, intent(out) :: error
      type(pressure_t) :: curve
      real(wp) :: at, mean, rate, p, slope, short
      integer :: i, kind, k

      do i = 1, 100
         kind = 1 + mod(i, 4)
         call draw_random(at)
         at = 0.01_wp + 0.15_wp*at
         curve = curve_of(kind)
         call pressure_at(curve, at, p, slope)
         do k = 0, 15
            short = merge(0.0_wp, 10.0_wp**(-k), k == 15)
            if (k < 5) cycle
            call pressure_mean(curve, at, at + short, mean, rate)
            call check_near(error, mean, p + 0.5_wp*slope*short, tol + 1.0e3_wp*short**2, 1.0_wp &
               + p, &
               "mean of kind " // to_text(kind))
            call check_near(error, rate, 0.5_wp*slope, tol + 1.0e3_wp*short, 10.0_wp + slope, &
               "rate of kind " // to_text(kind))
         end do
      end do
   end subroutine test_short

   !> Work over a walk is what is stored at its end less that at its start, however the gap at the
   !> start of a step is found anew.
   subroutine test_steps(error)
      type(error_t), allocatable, intent(out) :: error
      class(contact_law_t), allocatable :: law
      type(interaction_t) :: surface
      type(contact_values_t) :: at
      type(contact_response_t) :: response
      type(contact_place_t) :: place
      real(wp) :: work, scale, closure, next, begun
      integer :: i, kind

      do kind = 1, 4
         surface%pressure = curve_of(kind)
         place = contact_place_t(area=0.5_wp, share=0.75_wp)
         closure = 0.0_wp
         work = 0.0_wp
         scale = 0.0_wp
         begun = 0.0_wp
         do i = 1, 100
            call contact_law_in_place(surface, method_penalty, law)
            place%closure = closure
            call law%begin(place)
            call check_near(error, law%stored(), begun, tol, 1.0_wp + abs(begun), "as it was left")
            at%gap0 = merge(closure/place%share, 0.1_wp, closure < 0.0_wp) + 1.0e-3_wp
            call draw_random(next)
            at%gap1 = -1.0_wp + 1.4_wp*next
            if (closure < 0.0_wp) at%dgap = at%gap1 - closure/place%share
            if (.not. closure < 0.0_wp) at%dgap = at%gap1 - at%gap0
            response = contact_response_t()
            call law%respond(at, response)
            work = work + response%lam*at%dgap
            scale = scale + abs(response%lam*at%dgap)
            closure = law%closure()
            begun = law%stored()
            call check_true(error, response%lam >= 0.0_wp .and. &
               response%stiffness(0, 0) >= 0.0_wp, "it pushes, and gives way")
         end do
         call check_near(error, work, -begun, tol, scale, "work of kind " // to_text(kind))
      end do
   end subroutine test_steps

   !> A pressure takes the place of a penalty, where contact gives way.
   subroutine test_which(error)
      type(error_t), allocatable, intent(out) :: error
      class(contact_law_t), allocatable :: law
      type(interaction_t) :: surface
      type(contact_response_t) :: response

      surface%pressure = curve_of(1)
      call contact_law_in_place(surface, method_penalty, law)
      call law%begin(contact_place_t(area=2.0_wp, stiffness=1.0e3_wp))
      call law%respond(contact_values_t(gap1=-0.5_wp, left=-0.5_wp, is_stored=.false.), response)
      call check_near(error, [response%lam, response%stiffness(0, 0)], [5.0_wp, 10.0_wp], tol, &
         10.0_wp, "pressure by area")
      call contact_law_in_place(interaction_t(), method_penalty, law)
      call law%begin(contact_place_t(area=2.0_wp, stiffness=1.0e3_wp))
      call law%respond(contact_values_t(gap1=-0.5_wp, left=-0.5_wp, is_stored=.false.), response)
      call check_near(error, response%lam, 500.0_wp, tol, 500.0_wp, "a penalty")
      deallocate(law)
      call contact_law_in_place(interaction_t(), method_null_space, law)
      call check_true(error, .not. allocated(law), "rows hold")
   end subroutine test_which

end module test_pressure_law
