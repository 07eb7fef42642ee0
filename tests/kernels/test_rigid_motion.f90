!> Which free motions of a static problem are named.
module test_rigid_motion
   use check, only : check_equal, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rigid_motion, only : free_motion_text
   use emcon_scene, only : scene_t
   use emcon_system, only : system_init, system_t
   use small_scenes, only : add_block, add_step, block_t, clamp, make_block, make_two_blocks, &
      prescribe
   implicit none
   private
   public :: collect_rigid_motion

contains

   subroutine collect_rigid_motion(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("motions that one body can have left", test_motions), &
         test_case_t("second body of two", test_second), &
         test_case_t("bodies in contact", test_contact), &
         test_case_t("scene far from the origin", test_far)]
   end subroutine collect_rigid_motion

   !> The text for the block of 2 x 2 cells (nodes 1 2 3 / 4 5 6 / 7 8 9) with some freedoms held.
   subroutine check_motion(error, node, dof, motion)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: node(:), dof(:)
      character(len=*), intent(in) :: motion     !! empty: none
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      do i = 1, size(node)
         call prescribe(scene%step(1), node(i), dof(i), 0.0_wp)
      end do
      call system_init(system, scene, raised)
      text = free_motion_text(system, scene, scene%step(1)%prescribed)
      if (len(motion) == 0) then
         call check_equal(error, text, "", "no motion is left")
      else
         call check_true(error, index(text, "is free to " // motion // ";") > 0, &
            "'" // motion // "' is in '" // text // "'")
         call check_true(error, index(text, "element 1 ") > 0, "the body is named: " // text)
      end if
   end subroutine check_motion

   subroutine test_motions(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: none(0)

      call check_motion(error, none, none, "move in x, move in y, rotate")
      call check_motion(error, [1], [1], "move in y, rotate")
      call check_motion(error, [1, 2], [2, 2], "move in x")
      call check_motion(error, [1, 7], [1, 1], "move in y")
      call check_motion(error, [5, 5], [1, 2], "rotate")
      call check_motion(error, [1, 2, 3, 4], [1, 1, 1, 2], "rotate")   ! all about the origin
      call check_motion(error, [1, 1, 2], [1, 2, 2], "")
      call check_motion(error, [1, 1, 7], [1, 2, 1], "")
      call check_motion(error, [1, 9, 9], [2, 1, 2], "")
   end subroutine test_motions

   subroutine test_second(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_block(scene, "CPE4", [1, 1], block)
      call add_block(scene, "CPE4", [2, 1], [5.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call system_init(system, scene, error)
      if (allocated(error)) return
      text = free_motion_text(system, scene, scene%step(1)%prescribed)
      call check_true(error, index(text, "element 2 ") > 0, "element 2 is in '" // text // "'")
      call clamp(scene%step(1), [5, 9])
      text = free_motion_text(system, scene, scene%step(1)%prescribed)
      call check_equal(error, text, "", "both held")
   end subroutine test_second

   !> Contact may hold the upper block: it is looked at only on request.
   subroutine test_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call system_init(system, scene, error)
      if (allocated(error)) return
      text = free_motion_text(system, scene, scene%step(1)%prescribed)
      call check_equal(error, text, "", "before contact is known")
      text = free_motion_text(system, scene, scene%step(1)%prescribed, with_contact=.true.)
      call check_true(error, index(text, "element 5 ") > 0, "element 5 is in '" // text // "'")
   end subroutine test_contact

   !> Two neighbours held in a small corner, 1e8 elements away: held is held.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_block(scene, "CPE4", [20, 20], block)
      scene%x = scene%x + 1.0e8_wp
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1])
      call prescribe(scene%step(1), 2, 2, 0.0_wp)
      call system_init(system, scene, error)
      if (allocated(error)) return
      text = free_motion_text(system, scene, scene%step(1)%prescribed)
      call check_equal(error, text, "", "held")
   end subroutine test_far

end module test_rigid_motion
