!> Bodies that contact alone holds in statics: which gaps close first on a way, where loads carry a
!> body, what is closed without a load, and what nothing holds.
module test_holding
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_contact_support_gaps, only : gaps_measure
   use emcon_contact_support, only : contact_support_complete, contact_support_find_free, &
      contact_support_forget
   use emcon_contact_support_gaps, only : gaps_keep_closed, gaps_measure, &
      gaps_next_guards, gaps_next_to_close
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t, evaluation_at_end
   use emcon_interactions, only : formulation_nts
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_motion, only : motion_init, motion_evaluate, motion_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_point, load_t
   use small_scenes, only : add_load, add_step, block_t, clamp, make_two_blocks, prescribe
   implicit none
   private
   public :: collect_holding

   real(wp), parameter :: eps = epsilon(1.0_wp)
   real(wp), parameter :: gap = 0.01_wp, force = 0.02_wp
   real(wp), parameter :: units(3) = [1.0_wp, 64.0_wp, 1.0_wp/64.0_wp]

contains

   subroutine collect_holding(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps that close first on a way", test_next), &
         test_case_t("of contacts those that are closed", test_closed), &
         test_case_t("a load carries a body to its contacts", test_load), &
         test_case_t("the nearest contacts where there is no load", test_nearest), &
         test_case_t("what a load pulls away is told", test_away)]
   end subroutine collect_holding

   !> Conditions k of node k alone, with the gradient `c` and the gap `target`; edges are 1 long.
   !> All that is a length in units.
   subroutine make_set(set, c, target, unit)
      type(constraint_set_t), intent(inout) :: set
      real(wp), intent(in) :: c(:, :)            !! (2, n)
      real(wp), intent(in) :: target(:)          !! (n)
      real(wp), intent(in) :: unit               !! > 0
      integer :: k

      call constraints_select(set, [(k, k = 1, size(target))])
      set%target = unit*target
      do k = 1, set%n
         call condition_resize(set%item(k), 1)
         set%item(k)%node(1) = k
         set%item(k)%c(:, 1) = c(:, k)
         set%item(k)%size = unit
      end do
   end subroutine make_set

   !> gap/rate; what closes within a thousandth of an edge closes too; what slips or opens does not.
   !> What is closed already is there at once. In any unit of length. Guards hold what is near
   !> alone.
   subroutine test_next(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: c(2, 6) = reshape([0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, &
         0.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 6])
      real(wp), parameter :: target(6) = [0.1_wp, 0.1005_wp, 0.2_wp, 0.05_wp, 0.01_wp, 0.102_wp]
      type(constraint_set_t) :: set
      real(wp) :: way(2, 6), time
      logical :: is_next(6)
      integer :: k

      do k = 1, size(units)
         way(1, :) = 0.0_wp
         way(2, :) = -units(k)
         call make_set(set, c, target, units(k))
         call gaps_next_to_close(set, way, time, is_next)
         call check_near(error, time, 0.1_wp, 4.0_wp*eps, 0.1_wp, "time")
         call check_true(error, all(is_next(:3)) .and. .not. any(is_next(4:)), "what closes")
         call gaps_next_to_close(set, -way, time, is_next)
         call check_near(error, time, 0.05_wp, 4.0_wp*eps, 0.1_wp, "time of the way back")
         call check_equal(error, [count(is_next), findloc(is_next, .true., 1)], [1, 4], "on it")
         set%item([1, 2])%size = [0.11_wp, 0.09_wp]*units(k)
         time = 0.10005_wp
         is_next = [.false., .false., .false., .false., .true., .false.]
         call gaps_next_guards(set, way, time, is_next)
         call check_near(error, time, 0.10005_wp, 0.0_wp, 0.1_wp, "about the time of others")
         call check_equal(error, [count(is_next), findloc(is_next, .true., 1)], [1, 5], "others")
         time = 0.25_wp
         call gaps_next_guards(set, way, time, is_next)
         call check_near(error, time, 0.1_wp, 4.0_wp*eps, 0.1_wp, "time of guards")
         call check_true(error, all(is_next .eqv. [.true., .false., .true., .false., .false., &
            .false.]), "within an edge")
         set%item(:3)%size = 0.09_wp*units(k)
         time = huge(time)
         is_next = .false.
         call gaps_next_guards(set, way, time, is_next)
         call check_true(error, time >= huge(time) .and. .not. any(is_next), "none is so near")
         set%target(2) = -0.01_wp*units(k)
         call gaps_next_to_close(set, way, time, is_next)
         call check_near(error, time, 0.0_wp, 0.0_wp, 1.0_wp, "closed already")
         call check_equal(error, [count(is_next), findloc(is_next, .true., 1)], [1, 2], "that one")
         call gaps_next_to_close(set, 0.0_wp*way, time, is_next)
         call check_true(error, time >= huge(time) .and. .not. any(is_next), "no way")
      end do
   end subroutine test_next

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      logical :: is_meant(4)
      integer :: k

      do k = 1, size(units)
         call make_set(set, reshape(spread(1.0_wp, 1, 8), [2, 4]), &
            [0.9e-3_wp, 1.1e-3_wp, -1.0_wp, 0.0_wp], units(k))
         is_meant = [.true., .true., .true., .false.]
         call gaps_keep_closed(set, is_meant)
         call check_true(error, all(is_meant .eqv. [.true., .false., .true., .false.]), &
            "closed ones")
      end do
   end subroutine test_closed

   !> The upper block over a clamped one, its node 12 held along the floor, in a static step; the
   !> load is shared by the nodes of its top, from the left to the right.
   subroutine begin(scene, share, march, motion, error)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: share(3)           !! of `force`, downwards
      type(march_t), intent(inout) :: march
      type(motion_t), intent(out) :: motion
      type(error_t), allocatable, intent(out) :: error
      type(load_t) :: load
      integer :: i

      scene%pair(1)%formulation = formulation_nts
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [(i, i = 1, 10)])
      call prescribe(scene%step(1), 12, 1, 0.0_wp)
      load%kind = load_point
      load%place = 2
      do i = 1, 3
         load%target = 13 + i
         load%value = -force*share(i)
         if (abs(load%value) > 0.0_wp) call add_load(scene%step(1), load)
      end do
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call motion_init(motion, scene%x)
      motion%evaluation = evaluation_at_end
      motion%evaluation%load_instant = instant_t(step_time=1.0_wp, total_time=1.0_wp)
      call motion_evaluate(motion)
   end subroutine begin

   !> Straight down by the gap if the load is in the middle, all nodes at once; else the block turns
   !> about the corner that lands first, until the other one has landed: two contacts hold it.
   subroutine test_load(error)
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      integer :: k

      do k = 1, 2
         block
            type(scene_t) :: scene
            type(march_t) :: march
            type(motion_t) :: motion
            logical :: is_held

            call make_two_blocks(scene, gap, lower, upper)
            call begin(scene, [0.25_wp, 0.5_wp, 0.25_wp*real(k, wp)], march, motion, error)
            if (allocated(error)) return
            associate (system => march%system, active => march%active)
               call check_true(error, active%support%is_needed, "nothing else holds it")
               call contact_support_complete(active%support, system, scene, motion, &
                  active%is_active)
               if (k == 1) call check_near(error, motion%du(2, 11:), spread(-gap, 1, 6), &
                  64.0_wp*eps, 1.0_wp, "down")
               ! A turn by 0.01 bends the way by its square.
               call check_near(error, motion%du(2, [11, 13]), [-gap, -gap], gap**2, 1.0_wp, &
                  "both corners")
               call check_near(error, motion%du(:, :10), 0.0_wp*motion%du(:, :10), 0.0_wp, 1.0_wp, &
                  "the floor stays")
               call check_true(error, all(active%is_active([1, 3])), "both corners are held")
               call check_true(error, .not. allocated(active%support%text) .and. &
                  .not. any(active%support%is_loose), "all is held")
               call check_true(error, all(abs(active%support%brought) <= 0.0_wp), &
                  "a load closes them")
               call motion_evaluate(motion)
               call gaps_measure(system, motion)
               call contact_support_find_free(active%support, system, scene, motion, &
                  active%is_active, is_held)
               call check_true(error, is_held, "by the contacts")
               active%is_active = .false.
               call contact_support_find_free(active%support, system, scene, motion, &
                  active%is_active, is_held)
               call check_true(error, .not. is_held .and. active%support%is_pushed .and. &
                  allocated(active%support%text), "not without")
            end associate
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_load

   !> A block that stands askew, without load: it is moved until the lowest node touches, and held
   !> by that and by the next, over their gaps, which are told; nodes that have pulled are left out.
   subroutine test_nearest(error)
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      type(scene_t) :: scene
      type(march_t) :: march
      type(motion_t) :: motion
      real(wp) :: expected(3)

      call make_two_blocks(scene, gap, lower, upper)
      scene%x(2, 11:) = scene%x(2, 11:) + 0.01_wp*(scene%x(1, 11:) - scene%x(1, 11))
      call begin(scene, [0.0_wp, 0.0_wp, 0.0_wp], march, motion, error)
      if (allocated(error)) return
      associate (holding => march%active%support, is_active => march%active%is_active)
         expected = [gap, gap + 0.01_wp, 0.0_wp]
         call contact_support_complete(holding, march%system, scene, motion, is_active)
         call check_near(error, holding%brought(1), expected(1), 64.0_wp*eps, 1.0_wp, "a gap")
         call check_true(error, all(holding%brought <= expected .and. (holding%brought &
            > 0.0_wp .eqv. expected > 0.0_wp)), "and what is left of the next")
         call check_true(error, all(is_active .eqv. expected > 0.0_wp), "the nearest two")
         call check_true(error, allocated(holding%brought_text), "it is told")
         call gaps_measure(march%system, motion)
         call check_near(error, march%system%contact(1)%contact%state(1)%gap1, 0.0_wp, &
            64.0_wp*eps, 1.0_wp, "the first touches")
         call check_true(error, .not. any(holding%is_loose), "all is held")
         call contact_support_forget(holding)
         call check_true(error, all(abs(holding%brought) <= 0.0_wp), "forgotten")
      end associate
      call march_free(march)
   end subroutine test_nearest

   !> Upwards nothing is in the way of a load.
   subroutine test_away(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(motion_t) :: motion
      type(block_t) :: lower, upper

      call make_two_blocks(scene, gap, lower, upper)
      call begin(scene, [-0.25_wp, -0.5_wp, -0.25_wp], march, motion, error)
      if (allocated(error)) return
      associate (active => march%active)
         call contact_support_complete(active%support, march%system, scene, motion, &
            active%is_active)
         call check_true(error, active%support%is_pushed .and. allocated(active%support%text), &
            "it is told")
         call check_true(error, .not. any(active%is_active), "nothing holds it")
      end associate
      call march_free(march)
   end subroutine test_away

end module test_holding
