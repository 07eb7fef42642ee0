!> Which contacts penalties push at in explicit steps: gaps at the start and the end are given.
module test_explicit_closed
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_contact, only : gap_state_t
   use emcon_contact_law_registry, only : contact_law_of_method
   use emcon_errors, only : error_t
   use emcon_explicit_penalty, only : explicit_penalty_push
   use emcon_kinds, only : wp
   use emcon_march, only : march_t
   use emcon_motion, only : motion_init
   use emcon_steps, only : method_penalty
   use emcon_term, only : role_internal
   use given_contact, only : given_contact_t, given_of, open_given_contact
   implicit none
   private
   public :: collect_explicit_closed

   integer, parameter :: n = 8
   !> Guards that are closed below -0.02 are the last two; edges are 1/2, so that what begins closed
   !> by more than 0.05 is on the other side.
   real(wp), parameter :: gap(n) = [0.01_wp, -0.01_wp, -0.04_wp, -0.065_wp, -0.06_wp, -0.01_wp, &
      -0.01_wp, -0.03_wp]
   real(wp), parameter :: closed(n) = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, -0.02_wp, &
      -0.02_wp]

contains

   subroutine collect_explicit_closed(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is closed at the start", test_start), &
         test_case_t("what has closed at the end", test_end)]
   end subroutine collect_explicit_closed

   subroutine open(march)
      type(march_t), intent(inout), target :: march
      type(gap_state_t) :: given(n, 1)
      class(given_contact_t), pointer :: contact

      given%is_near = .true.
      given%is_over = .true.
      given%size = 0.5_wp
      given(:, 1)%gap1 = gap
      given(:, 1)%closed = closed
      given(6, 1)%is_over = .false.
      call open_given_contact(march%system, march%active, march%motion, given, 0)
      contact => given_of(march%system, 1)
      contact%max_penetration_at_start = 0.1_wp
      contact%clear = 10.0_wp
      call motion_init(march%explicit%place, march%motion%x)
      march%end_state%du = 0.0_wp*march%motion%x
      march%end_state%v = march%end_state%du
      march%state%contacts%is_active = spread(.false., 1, n)
      march%state%contacts%is_active(5) = .true.
      march%system%response%residual = march%end_state%du
      march%system%response%part(role_internal)%force = march%end_state%du
      associate (penalty => march%active%penalty)
         penalty%is_on = .true.
         penalty%is_at_ends = .true.
         call contact_law_of_method(method_penalty, penalty%law)
         penalty%area = spread(1.0_wp, 1, n)
         penalty%stiffness = penalty%area
         penalty%edge = penalty%area
         penalty%closure = penalty%area
      end associate
   end subroutine open

   !> All pairs are looked at anew, also those that nothing was near.
   subroutine test_start(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t), target :: march

      call open(march)
      march%end_state%du(1, 1) = 1.0_wp
      march%active%skip_until%passes = .true.
      call explicit_penalty_push(march, .false.)
      associate (penalty => march%explicit%penalty(march%explicit%i_start))
         call check_equal(error, penalty%id, [2, 3, 5, 8], "closed")
         call check_near(error, penalty%target, [0.0_wp, 0.0_wp, 0.0_wp, -0.02_wp], 0.0_wp, &
            1.0_wp, "from where they push")
         call check_true(error, penalty%penalty%is_on .and. allocated(penalty%law(4)%row), "laws")
      end associate
      associate (other => march%explicit%penalty(1 - march%explicit%i_start))
         call check_equal(error, other%n, 0, "not at the end")
      end associate
      march%active%penalty%is_at_ends = .false.
      march%explicit%penalty(march%explicit%i_start)%id = [7]
      call explicit_penalty_push(march, .false.)
      call check_equal(error, march%explicit%penalty(march%explicit%i_start)%id, [7], &
         "of other steps nothing")
   end subroutine test_start

   !> Both sides may have moved by 0.01: what is 0.07 deep at most was not behind; what is far apart
   !> is not looked at.
   subroutine test_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t), target :: march
      class(given_contact_t), pointer :: contact

      call open(march)
      contact => given_of(march%system, 1)
      march%end_state%du(:, 3) = [0.006_wp, -0.008_wp]
      call explicit_penalty_push(march, .true.)
      associate (penalty => march%explicit%penalty(1 - march%explicit%i_start))
         call check_equal(error, penalty%id, [2, 3, 4, 5, 8], "closed")
         contact%given(4)%gap1 = -0.071_wp
         contact%given(2)%gap1 = 0.02_wp
         call explicit_penalty_push(march, .true.)
         call check_equal(error, penalty%n, 0, "far apart nothing")
         contact%n_look = contact%n_look + 1
         call explicit_penalty_push(march, .true.)
         call check_equal(error, penalty%id, [3, 5, 8], "looked at again")
      end associate
   end subroutine test_end

end module test_explicit_closed
