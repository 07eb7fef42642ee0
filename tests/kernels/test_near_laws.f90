!> Laws that act on what is near a surface: which contacts are, and on what area.
module test_near_laws
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_t
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_dashpot_law, only : dashpot_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_damping_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_near_laws, only : near_laws_are_none, near_laws_begin_step, &
      near_laws_select, near_laws_t, near_laws_update
   use emcon_scene, only : scene_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   use given_contact, only : open_given_contact
   use small_scenes, only : add_step, block_t, make_block
   implicit none
   private
   public :: collect_near_laws

   real(wp), parameter :: reach = 0.2_wp, edge = 0.5_wp, hair = sqrt(epsilon(1.0_wp))*edge

contains

   subroutine collect_near_laws(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is within reach", test_reach), &
         test_case_t("what touches, without a reach", test_touch), &
         test_case_t("areas and rows of a step", test_select)]
   end subroutine collect_near_laws

   subroutine open(given, of_law, is_static, system, laws)
      type(gap_state_t), intent(in) :: given(:)
      real(wp), intent(in) :: of_law
      logical, intent(in) :: is_static
      type(system_t), intent(out) :: system
      type(near_laws_t), intent(out) :: laws
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(scene_t) :: scene
      type(block_t) :: block

      call open_given_contact(system, active, motion, reshape(given, [size(given), 1]), 0, &
         dashpot_t(reach=of_law, has_friction=.true., &
         coefficients=contact_damping_t(1.0_wp, 0.5_wp)))
      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, is_static, 1.0_wp, 1)
      system%contact(1)%contact%max_penetration_at_start = 0.1_wp
      call near_laws_begin_step(laws, system, scene, scene%step(1))
   end subroutine open

   !> At the start or the end of the step, in front of the surface; what acts is; none in statics.
   subroutine test_reach(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap0(11) = [0.19_wp, 0.21_wp, 0.21_wp, 0.1_wp, 0.1_wp, 0.1_wp, &
         0.1_wp, -0.04_wp, -0.06_wp, 0.3_wp, 0.1_wp]
      real(wp), parameter :: gap1(11) = [0.3_wp, 0.19_wp, 0.21_wp, 0.1_wp, 0.1_wp, 0.1_wp, 0.1_wp, &
         0.1_wp, 0.1_wp, 0.3_wp, 0.1_wp]
      logical, parameter :: expected(11) = [.true., .true., .false., .false., .false., .false., &
         .false., .true., .false., .true., .true.]
      type(gap_state_t) :: given(11)
      type(system_t) :: system
      type(near_laws_t) :: laws
      logical :: grows, acts(11)
      integer :: k

      given%gap0 = gap0
      given%gap1 = gap1
      given%size = edge
      given%is_near = [(k /= 4, k = 1, 11)]
      given%is_over = [(k /= 5, k = 1, 11)]
      given%is_arriving = [(k == 6, k = 1, 11)]
      given%is_leaving = [(k == 7, k = 1, 11)]
      acts = [(k == 10, k = 1, 11)]
      call open(given, reach, .false., system, laws)
      call check_true(error, .not. near_laws_are_none(laws, system%contact(1)%contact), "there are")
      grows = .false.
      call near_laws_update(laws, system, 1, acts, grows)
      do k = 1, 11
         call check_true(error, laws%is_near(k) .eqv. expected(k), "near " // to_text(k))
      end do
      call check_true(error, grows, "more")
      grows = .false.
      call near_laws_update(laws, system, 1, acts .and. .false., grows)
      call check_true(error, .not. grows .and. all(laws%is_near .eqv. expected), "no more")
      acts(3) = .true.
      call near_laws_update(laws, system, 1, acts, grows)
      call check_true(error, grows .and. laws%is_near(3), "one more")
      call open(given, reach, .true., system, laws)
      call check_true(error, near_laws_are_none(laws, system%contact(1)%contact), "in statics")
      call open(given, -1.0_wp, .false., system, laws)
      call check_true(error, near_laws_are_none(laws, system%contact(1)%contact) .and. &
         .not. laws%is_on, "no reach at all")
   end subroutine test_reach

   !> A gap that is none but for round-off; a penalty gives way.
   subroutine test_touch(error)
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t) :: given(3)
      type(system_t) :: system
      type(near_laws_t) :: laws
      logical :: grows
      integer :: k

      given%is_near = .true.
      given%is_over = .true.
      given%gap0 = [0.5_wp*hair, 2.0_wp*hair, -0.5_wp*hair]
      given%gap1 = 0.1_wp
      given%size = edge
      do k = 1, 2
         call open(given, 0.0_wp, .false., system, laws)
         system%contact(1)%contact%step%is_penalty = k == 2
         call near_laws_update(laws, system, 1, [.false., .false., .false.], grows)
         call check_true(error, all(laws%is_near .eqv. [k == 1, .false., .true.]), &
            "near " // to_text(k))
      end do
   end subroutine test_touch

   !> Beside rows, which hold what is closed, and where there are none; half where both sides hold.
   subroutine test_select(error)
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t) :: given(3)
      type(system_t) :: system
      type(near_laws_t) :: laws
      type(constraint_set_t) :: set
      integer :: k, i

      given%is_near = .true.
      given%is_over = .true.
      given%gap0 = [0.1_wp, 0.15_wp, 0.05_wp]
      given%size = edge
      do k = 1, 3
         call open(given, merge(0.0_wp, reach, k == 3), .false., system, laws)
         call check_near(error, laws%area, spread(1.0_wp, 1, 3), 0.0_wp, 1.0_wp, "areas")
         system%contact(1)%contact%step%is_penalty = k == 2
         if (k == 3) system%contact(1)%contact%state(2)%gap0 = 0.0_wp
         laws%is_near = [.true., .true., .false.]
         laws%is_held = [.true., .false., .true.]
         laws%area = [1.0_wp, 2.0_wp, 3.0_wp]
         call constraints_select(set, [1, 3], [2])
         set%target = [7.0_wp, 8.0_wp, 9.0_wp]
         call near_laws_select(laws, system, set)
         call check_near(error, set%target, [7.0_wp, 8.0_wp, merge(0.0_wp, 0.15_wp, k == 3)], &
            0.0_wp, 1.0_wp, "what has no row counts from its gap")
         call check_true(error, all(set%item%has_friction .eqv. [.true., .false., .true.]), "rub")
         call check_true(error, .not. allocated(set%law(2)%beside), "what is not near")
         do i = 1, 3, 2
            select type (law => set%law(i)%beside(1)%law)
            type is (dashpot_t)
               call check_near(error, [law%area, law%gap], [merge(1.0_wp, 2.0_wp, i == 1), &
                  system%contact(1)%contact%state(merge(1, 2, i == 1))%gap0], 0.0_wp, 1.0_wp, &
                  "its place")
               call check_true(error, law%is_closed .eqv. ((i == 1 .and. k /= 2) .or. &
                  (i == 3 .and. k == 3)), "closed " // to_text(k))
            end select
         end do
         call check_equal(error, size(set%law(1)%beside), 1, "laws")
      end do
   end subroutine test_select

end module test_near_laws
