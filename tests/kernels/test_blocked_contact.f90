!> Contacts that nothing can fulfil, since the deck moves all of them.
module test_blocked_contact
   use check, only : check_equal, check_true, test_case_t
   use emcon_blocked_contact, only : blocked_contact_text
   use emcon_contact_support_gaps, only : gaps_measure
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_motion, only : motion_init, motion_evaluate, motion_t
   use emcon_scene, only : scene_t
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks, prescribe
   implicit none
   private
   public :: collect_blocked_contact

contains

   subroutine collect_blocked_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("a prescribed node behind a prescribed surface", test_text)]
   end subroutine collect_blocked_contact

   !> Node 12 is the first that is prescribed whole: 11 is free along the floor. It is told if the
   !> motion closes it, it was left out, and all of the master is prescribed.
   subroutine test_text(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: told = "slave node 12 of surface UPPER is 0.05 behind " &
         // "surface LOWER: *BOUNDARY moves it"

      call expect(-0.15_wp, [.true., .true., .true.], 10, told, error)
      if (.not. allocated(error)) call expect(-0.15_wp, [.true., .true., .true.], 9, "", error)
      if (.not. allocated(error)) call expect(-0.05_wp, [.true., .true., .true.], 10, "", error)
      if (.not. allocated(error)) call expect(-0.15_wp, [.true., .false., .false.], 10, "", error)
   end subroutine test_text

   !> The upper block comes down by `way` from 0.1 above the lower one, of which nodes up to
   !> `last_bound` are prescribed.
   subroutine expect(way, is_left_out, last_bound, start, error)
      real(wp), intent(in) :: way
      logical, intent(in) :: is_left_out(3)
      integer, intent(in) :: last_bound
      character(len=*), intent(in) :: start      !! of the text; "": there is none
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(motion_t) :: motion
      type(block_t) :: lower, upper
      character(len=:), allocatable :: text
      integer :: i

      call make_two_blocks(scene, 0.1_wp, lower, upper)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [(i, i = 1, last_bound), (i, i = 12, 16)])
      if (last_bound < 10) call prescribe(scene%step(1), 10, 1, 0.0_wp)
      call prescribe(scene%step(1), 11, 2, 0.0_wp)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call motion_init(motion, scene%x)
      motion%du(2, 11:) = way
      call motion_evaluate(motion)
      call gaps_measure(march%system, motion)
      call blocked_contact_text(march%system, scene, is_left_out, text)
      if (start == "") then
         call check_equal(error, text, "", "nothing")
      else
         call check_true(error, index(text, start) == 1, text)
      end if
      call march_free(march)
   end subroutine expect

end module test_blocked_contact
