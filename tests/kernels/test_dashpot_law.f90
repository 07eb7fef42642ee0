!> Viscous damping between surfaces: the mean of the coefficient over a way, and its derivative.
module test_dashpot_law
   use check, only : check_near, check_true, test_case_t
   use emcon_dashpot_law, only : dashpot_at, dashpot_mean, dashpot_mean_slope
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_damping_t
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
         test_case_t("its slope is its derivative", test_slope)]
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

end module test_dashpot_law
