!> Viscous damping between surfaces: the mean of the coefficient over a way, and its derivative.
module test_dashpot_law
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_place_t, contact_values_t
   use emcon_dashpot_law, only : dashpot_at, dashpot_mean, dashpot_mean_slope, dashpot_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_damping_t, interaction_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: collect_dashpot_law

   !> Falling from the surface on, from a quarter of the clearance on, at once, and without one.
   type(contact_damping_t), parameter :: laws(4) = [ &
      contact_damping_t(3.0_wp, 0.5_wp, 0.0_wp, 1.0_wp), &
      contact_damping_t(3.0_wp, 0.5_wp, 0.25_wp, 1.0_wp), &
      contact_damping_t(3.0_wp, 0.5_wp, 1.0_wp, 1.0_wp), &
      contact_damping_t(3.0_wp, 0.0_wp, 0.0_wp, 1.0_wp)]
   !> Places on both sides of all kinks, and between them.
   real(wp), parameter :: places(7) = [-0.7_wp, -0.2_wp, 0.05_wp, 0.1_wp, 0.3_wp, 0.45_wp, 0.9_wp]
   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_dashpot_law(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the mean by the way is what the impulse falls by", test_mean), &
         test_case_t("of ways one after the other impulses add up", test_sum), &
         test_case_t("the mean of no way is the coefficient, within its bounds", test_small), &
         test_case_t("its slope is its derivative", test_slope), &
         test_case_t("push and drag of a condition", test_respond)]
   end subroutine collect_dashpot_law

   !> The integral of the coefficient from 0 to `gap`, by its closed form.
   pure real(wp) function impulse(law, gap)
      type(contact_damping_t), intent(in) :: law
      real(wp), intent(in) :: gap
      real(wp) :: flat, reach

      flat = law%flat*law%clearance
      reach = min(gap, law%clearance)
      impulse = law%coefficient*min(gap, flat)
      if (reach > flat) impulse = impulse + law%coefficient/(2.0_wp*(law%clearance - flat)) &
         *((law%clearance - flat)**2 - (law%clearance - reach)**2)
   end function impulse

   subroutine test_mean(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j, k

      do k = 1, size(laws)
         do i = 1, size(places)
            do j = 1, size(places)
               associate (way => places(j) - places(i))
                  call check_near(error, dashpot_mean(laws(k), places(i), way)*way, &
                     impulse(laws(k), places(j)) - impulse(laws(k), places(i)), tol, &
                     laws(k)%coefficient, "mean by way")
               end associate
            end do
         end do
      end do
   end subroutine test_mean

   subroutine test_sum(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: sum
      integer :: i, k

      do k = 1, size(laws)
         sum = 0.0_wp
         do i = 2, size(places)
            associate (way => places(i) - places(i - 1))
               sum = sum + dashpot_mean(laws(k), places(i - 1), way)*way
            end associate
         end do
         associate (way => places(size(places)) - places(1))
            call check_near(error, sum, dashpot_mean(laws(k), places(1), way)*way, tol, &
               laws(k)%coefficient, "sum")
         end associate
      end do
   end subroutine test_sum

   !> Also over ways that are as small as numbers can tell, where a quotient of differences would
   !> be noise.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: mean
      integer :: i, k, n

      do k = 1, size(laws)
         do i = 1, size(places)
            do n = 0, 3
               mean = dashpot_mean(laws(k), places(i), merge(-n, n, n > 1)*spacing(places(i)))
               call check_near(error, mean, dashpot_at(laws(k), places(i)), 8.0_wp*tol, &
                  laws(k)%coefficient, "mean of a small way")
            end do
         end do
         do i = -40, 40
            do n = -40, 40
               mean = dashpot_mean(laws(k), 0.02_wp*i, 0.02_wp*n)
               call check_true(error, mean >= 0.0_wp .and. mean <= laws(k)%coefficient &
                  *(1.0_wp + tol), "bounds")
            end do
         end do
      end do
   end subroutine test_small

   !> Central differences, exact but for their square and for rounding over it.
   subroutine test_slope(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      real(wp) :: difference, way
      integer :: i, j, k

      do k = 1, size(laws)
         do i = 1, size(places)
            do j = 1, size(places)
               way = places(j) - places(i)
               if (.not. abs(way) > 0.0_wp) cycle
               difference = (dashpot_mean(laws(k), places(i), way + small) &
                  - dashpot_mean(laws(k), places(i), way - small))/(2.0_wp*small)
               call check_near(error, dashpot_mean_slope(laws(k), places(i), way), difference, &
                  64.0_wp*small**2, laws(k)%coefficient/abs(way)**3, "slope")
            end do
         end do
      end do
      call check_near(error, dashpot_mean_slope(laws(2), 0.3_wp, 0.0_wp), -4.0_wp, tol, 1.0_wp, &
         "slope of no way")
   end subroutine test_slope

   !> The impulse over a step takes what its work says, and falls by the derivatives that it gives:
   !> central differences. Held contact drags by all of mu.
   subroutine test_respond(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      real(wp), parameter :: frequency = 8.0_wp, area = 0.25_wp*6.0_wp
      type(contact_damping_t) :: surface
      type(contact_response_t) :: response
      type(contact_values_t) :: at
      type(dashpot_t) :: law
      real(wp) :: mean
      integer :: i, j, k, s
      logical :: is_closed

      surface = laws(2)
      surface%tangent = 0.125_wp
      do k = 1, 2
         is_closed = k == 2
         do i = 1, size(places)
            do j = 1, size(places)
               if (i == j) cycle
               response = response_of(0.0_wp, 0)
               at = values(0.0_wp, 0)
               associate (way => places(j) - places(i))
                  mean = dashpot_mean(surface, places(i), way)
                  call check_near(error, response%lam, -area*frequency*mean*way, tol, 100.0_wp, &
                     "push")
                  if (is_closed) mean = surface%coefficient
                  call check_near(error, response%tau, 0.125_wp*area*frequency*mean*at%slip, tol, &
                     100.0_wp, "drag")
                  call check_near(error, law%dissipated(at, response), &
                     dot_product(response%tau, at%slip) - response%lam*way, tol, 100.0_wp, "work")
                  do s = 0, 2
                     call check_near(error, response%stiffness(:, s), difference(s), &
                        64.0_wp*small**2, 100.0_wp/abs(way)**3, "slope")
                  end do
               end associate
            end do
         end do
      end do

   contains

      !> The gap goes from one place to another, its end or slip `s` is moved by `more`.
      pure type(contact_values_t) function values(more, s) result(at)
         real(wp), intent(in) :: more
         integer, intent(in) :: s

         at = contact_values_t(dgap=places(j) - places(i), slip=[0.5_wp, -0.25_wp], &
            frequency=frequency)
         if (s == 0) at%dgap = at%dgap + more
         if (s > 0) at%slip(s) = at%slip(s) + more
      end function values

      type(contact_response_t) function response_of(more, s) result(response)
         real(wp), intent(in) :: more
         integer, intent(in) :: s
         type(dashpot_t) :: law
         logical :: acts

         call law%take(interaction_t(damping=surface), 0, acts)
         call law%begin(contact_place_t(area=6.0_wp, share=0.25_wp, gap=places(i), &
            is_closed=is_closed))
         call law%respond(values(more, s), response)
         call check_true(error, acts .and. law%has_friction, "it acts")
         call check_near(error, law%reach, surface%clearance, 0.0_wp, 1.0_wp, "reach")
      end function response_of

      !> Of the push, falling, and the drags.
      function difference(s) result(slope)
         integer, intent(in) :: s
         real(wp) :: slope(0:2)
         type(contact_response_t) :: low, high

         low = response_of(-small, s)
         high = response_of(small, s)
         slope = [low%lam - high%lam, high%tau - low%tau]/(2.0_wp*small)
      end function difference

   end subroutine test_respond

end module test_dashpot_law
