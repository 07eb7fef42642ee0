!> What STABILIZE bears at the end of a step, and steps over which work and energy do not agree.
module test_march_snap
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : step_done, step_rough
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_march_snap, only : snap_judge, snap_left
   use emcon_march_types, only : part_t
   use emcon_motion, only : motion_evaluate
   use emcon_scene, only : scene_t
   use emcon_term, only : role_internal
   use emcon_term_registry, only : terms_stabilization
   use emcon_text, only : to_text
   use emcon_verdict, only : verdict_start, verdict_t, verdict_update
   use small_scenes, only : add_step, block_t, clamp, make_block, prescribe, shake
   implicit none
   private
   public :: collect_march_snap

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Part of what is stored that work may differ by.
   real(wp), parameter :: bar = 0.02_wp
   !> Viscous forces that are told, by those of the elements.
   real(wp), parameter :: told_share = 1.0e-3_wp

contains

   subroutine collect_march_snap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("work and energy that do not agree", test_judge), &
         test_case_t("where there is hardly energy, but round-off", test_rounding), &
         test_case_t("a balance that is no minimum", test_minimum), &
         test_case_t("contact that takes works", test_taken), &
         test_case_t("what viscous forces are of all", test_left), &
         test_case_t("told where the body is on its way", test_told)]
   end subroutine collect_march_snap

   !> A strip of `n` squares that is pulled, after its first increment.
   subroutine begin(scene, march, n, error)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      type(increment_t) :: increment
      integer :: i

      call make_block(scene, "CPE4", [n, 1], block)
      call add_step(scene, .true., 0.25_wp, 4)
      call clamp(scene%step(1), [1, n + 2])
      do i = n + 1, 2*n + 2, n + 1
         call prescribe(scene%step(1), i, 1, 0.2_wp)
      end do
      scene%step(1)%stabilization = 0.05_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
   end subroutine begin

   !> Forces of chance over ways of chance; the elements store their work but for a part of the
   !> larger energy, that of the start or that of the end.
   subroutine test_judge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part_missed(4) = bar*[0.9_wp, -0.9_wp, 1.1_wp, -1.1_wp]
      type(scene_t) :: scene
      type(march_t) :: march
      type(part_t) :: part
      real(wp), dimension(2, 6) :: force, viscous
      real(wp) :: work, none, stored, missed
      integer :: i, k, status

      call begin(scene, march, 2, error)
      if (allocated(error)) return
      call terms_stabilization(march%system%term, none, viscous)
      call shake(march%state%internal, 1.0_wp)
      call shake(force, 1.0_wp)
      call shake(march%end_state%du, 1.0_wp)
      do i = 1, 20
         k = 1 + mod(i - 1, 4)
         if (k == 1) march%end_state%du = -march%end_state%du
         work = 0.5_wp*sum((march%state%internal + force)*march%end_state%du)
         ! Of the two energies the larger one is 100 times the work.
         stored = 100.0_wp*abs(work)
         missed = part_missed(k)*stored
         march%state%energy = 0.5_wp*merge(stored - (work - missed), stored, work > missed)
         march%end_state%energy = 0.5_wp*merge(stored, stored + (work - missed), work > missed)
         march%end_state%force = force + viscous
         march%step_check%ratio = -1.0_wp
         part%may_cut = i <= 12
         scene%step(1)%stabilization = merge(0.05_wp, 0.0_wp, i <= 16)
         status = step_done
         call snap_judge(march, scene, part, status, error)
         call check_equal(error, status, merge(step_rough, step_done, k > 2 .and. i <= 12), &
            "case " // to_text(i))
         call check_near(error, march%step_check%ratio, merge(abs(part_missed(k)), -1.0_wp, k > 2 &
            .and. i <= 12), 1.0e4_wp*eps, 1.0_wp, "ratio of case " // to_text(i))
         call check_near(error, march%end_state%force, force + merge(0.0_wp, 1.0_wp, i <= 16) &
            *viscous, 4.0_wp*eps, 1.0_wp, "forces of case " // to_text(i))
      end do
      call march_free(march)
   end subroutine test_judge

   !> Forces are rounded by epsilon of what positions change them by.
   subroutine test_rounding(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp), dimension(2, 6) :: viscous
      real(wp) :: none
      integer :: k, status

      call begin(scene, march, 2, error)
      if (allocated(error)) return
      call terms_stabilization(march%system%term, none, viscous)
      call shake(march%end_state%du, 1.0_wp)
      march%state%energy = 1.0e-3_wp
      march%end_state%energy = march%state%energy
      march%state%internal = 0.0_wp
      associate (rounding => march%system%response%rounding, du => march%end_state%du)
         do k = 1, 2
            rounding = 1.0e6_wp/eps
            ! Works of half of what is round-off, and of twice that.
            march%end_state%force = sign(merge(1.0_wp, 4.0_wp, k == 1)*epsilon(1.0_wp)*rounding, du)
            march%end_state%force = march%end_state%force + viscous
            status = step_done
            call snap_judge(march, scene, part_t(may_cut=.true.), status, error)
            call check_equal(error, status, merge(step_done, step_rough, k == 1), "work " &
               // to_text(k))
         end do
      end associate
      call march_free(march)
   end subroutine test_rounding

   !> Contact that acted takes a little less, or more, than the part of what is stored that may be
   !> missed; or it gives.
   subroutine test_taken(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part_taken(3) = bar*[0.9_wp, 1.1_wp, -1.1_wp]
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp) :: work, viscous(2, 6)
      integer :: k, status

      call begin(scene, march, 2, error)
      if (allocated(error)) return
      call terms_stabilization(march%system%term, work, viscous)
      do k = 1, 3
         march%state%internal = 0.0_wp
         march%end_state%force = viscous
         march%end_state%energy = march%state%energy
         call shake(march%end_state%du, 1.0_wp)
         associate (du => march%end_state%du)
            march%state%contact = -part_taken(k)*sum(march%state%energy) &
               /sum(du**2)*du
            march%newton%contact = march%state%contact
         end associate
         status = step_done
         call snap_judge(march, scene, part_t(may_cut=.true.), status, error)
         if (allocated(error)) return
         call check_equal(error, status, merge(step_rough, step_done, k == 2), "case " &
            // to_text(k))
      end do
      call march_free(march)
   end subroutine test_taken

   !> A strip twelve times as long as it is wide that was shortened by a third, far above the load
   !> under which it buckles, and is straight: no work is missed, but it is no minimum. Nor is it
   !> where nothing smaller is possible.
   subroutine test_minimum(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 12
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp) :: work, viscous(2, 2*n + 2)
      integer :: k, status

      call begin(scene, march, n, error)
      if (allocated(error)) return
      do k = 1, 5
         march%active%set%penalty%is_on = k == 4
         march%active%set%n_condition = march%active%set%n + merge(1, 0, k == 5)
         march%motion%du = 0.0_wp
         if (k > 1) march%motion%du(1, :) = -scene%x(1, :)/3.0_wp
         call motion_evaluate(march%motion)
         call terms_stabilization(march%system%term, work, viscous)
         march%state%internal = 0.0_wp
         march%end_state%du = 0.0_wp
         march%end_state%force = viscous
         march%end_state%energy = march%state%energy
         march%step_check%ratio = -1.0_wp
         status = step_done
         call snap_judge(march, scene, part_t(may_cut=k < 3), status, error)
         if (allocated(error)) return
         ! Penalties and laws of contact have energies that are not looked at.
         call check_equal(error, status, merge(step_rough, step_done, k == 2 .or. k == 3), "case " &
            // to_text(k))
         call check_true(error, march%step_check%ratio < 0.0_wp, "no work is missed")
      end do
      call march_free(march)
   end subroutine test_minimum

   !> Of sizes of forces of 3 in each of 12 freedoms.
   subroutine test_left(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp), dimension(2, 6) :: viscous
      real(wp) :: none

      call begin(scene, march, 2, error)
      if (allocated(error)) return
      call terms_stabilization(march%system%term, none, viscous)
      associate (response => march%system%response)
         response%part(role_internal)%magnitude = 3.0_wp
         response%rounding = 0.0_wp
         call check_near(error, snap_left(march), norm2(viscous)/sqrt(108.0_wp), 8.0_wp*eps, &
            1.0e-3_wp, "forces")
         response%rounding = 1.0_wp/epsilon(1.0_wp)
         call check_near(error, snap_left(march), norm2(viscous)/(sqrt(108.0_wp) + sqrt(12.0_wp)), &
            8.0_wp*eps, 1.0e-3_wp, "forces and what they are rounded by")
         response%part(role_internal)%magnitude = 0.0_wp
         response%rounding = 0.0_wp
         call check_near(error, snap_left(march), 0.0_wp, 0.0_wp, 1.0_wp, "no forces")
      end associate
      call march_free(march)
   end subroutine test_left

   !> At the end of a step viscous forces of a thousandth are told, by the root of what is stored:
   !> of the largest energy before, or of this one where it is larger; not without STABILIZE.
   subroutine test_told(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part(6) = [1.05_wp, 0.95_wp, 1.05_wp, 0.95_wp, 1.05_wp, 1.05_wp], &
         largest(6) = [0.25_wp, 0.25_wp, 4.0_wp, 4.0_wp, 0.25_wp, 0.25_wp]
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(verdict_t) :: verdict
      real(wp), dimension(2, 6) :: viscous
      real(wp) :: none
      integer :: k

      call begin(scene, march, 2, error)
      if (allocated(error)) return
      call terms_stabilization(march%system%term, none, viscous)
      do k = 1, size(part)
         march%state%energy = 1.0_wp/size(march%state%energy)
         march%state%clock%n_grid = merge(3, march%grid%n_grid, k == 5)
         if (k == 6) scene%step(1)%stabilization = 0.0_wp
         associate (response => march%system%response)
            response%rounding = 0.0_wp
            response%part(role_internal)%magnitude = norm2(viscous)/sqrt(12.0_wp) &
               /(told_share*part(k)*sqrt(max(1.0_wp, largest(k))))
         end associate
         call verdict_start(verdict, march)
         verdict%energy%largest = largest(k)
         call verdict_update(verdict, scene, march, increment)
         call check_equal(error, count_told(verdict), merge(1, 0, k < 5 .and. part(k) > 1.0_wp), &
            "told " // to_text(k))
      end do
      call march_free(march)
   end subroutine test_told

   pure integer function count_told(verdict) result(n)
      type(verdict_t), intent(in) :: verdict
      integer :: i

      n = 0
      do i = 1, verdict%warnings%n
         if (index(verdict%warnings%item(i)%text, "at the end of step 1 STABILIZE carries ") &
            == 1) then
            n = n + 1
         end if
      end do
   end function count_told

end module test_march_snap
