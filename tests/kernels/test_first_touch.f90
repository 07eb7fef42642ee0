!> When surfaces touch that move along given ways, in closed form.
module test_first_touch
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_first_touch_plane, only : touch_time
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : block_t, make_two_blocks
   implicit none
   private
   public :: collect_first_touch

   real(wp), parameter :: gap = 0.0927_wp, tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_first_touch(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("edges that grow and shrink on the way", test_stretch), &
         test_case_t("a block that comes aslant, and one that leaves", test_aslant)]
   end subroutine collect_first_touch

   !> The lower block rises by 1 a time and is stretched along its top at a rate s: the area between
   !> a node above and an edge is (gap - t)(1 + s t), with a second root after or before.
   subroutine test_stretch(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rate(5) = [0.0_wp, 0.5_wp, -0.5_wp, 4.0_wp, -4.0_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: way(:, :)
      real(wp) :: offset
      integer :: k

      call make_two_blocks(scene, gap, lower, upper)
      allocate(way, source=0.0_wp*scene%x)
      do k = 1, 2*size(rate)
         offset = merge(0.03_wp, 0.0_wp, k > size(rate))
         scene%pair(1)%interaction%offset = offset
         way(1, :10) = rate(1 + mod(k - 1, size(rate)))*scene%x(1, :10)
         way(2, :10) = 1.0_wp
         call check_near(error, touch_time(scene, scene%x, way), gap - offset, tol, gap, &
            "case " // to_text(k))
      end do
   end subroutine test_stretch

   !> The lowest corner of a tilted block, over the ground and past its end; none where it leaves.
   subroutine test_aslant(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slope = 0.25_wp, speed = 2.0_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: way(:, :)

      call make_two_blocks(scene, gap, lower, upper)
      allocate(way, source=0.0_wp*scene%x)
      scene%x(2, 11:) = scene%x(2, 11:) + slope*(scene%x(1, 11:) - scene%x(1, 11))
      way(1, 11:) = 0.5_wp
      way(2, 11:) = -speed
      call check_near(error, touch_time(scene, scene%x, way), gap/speed, tol, gap, "its corner")
      call check_true(error, touch_time(scene, scene%x, -way) >= huge(gap), "it leaves")
      scene%x(1, 11:) = scene%x(1, 11:) - 4.0_wp
      call check_true(error, touch_time(scene, scene%x, way) >= huge(gap), "it passes by")
      ! Its side, which leans by the slope, comes down onto the end of the ground.
      scene%x(1, 11:) = scene%x(1, 11:) + 2.0_wp
      call check_near(error, touch_time(scene, scene%x, way), fall(), tol, gap, "the ground's end")

   contains

      !> Of the bottom's line above the end of the ground, at (-2, 0): it falls by the slope too.
      pure real(wp) function fall()
         fall = (gap + slope*(-2.0_wp - scene%x(1, 11)))/(speed + 0.5_wp*slope)
      end function fall

   end subroutine test_aslant

end module test_first_touch
