!> Contact that gives way: the laws that a set gets, and what they store, leave and are deep.
module test_penalty_state
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_select, active_set_t
   use emcon_contact, only : gap_state_t
   use emcon_contact_law_registry, only : contact_law_of_method
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_motion, only : motion_t
   use emcon_penalty, only : penalty_augment, penalty_begin_step, penalty_depth, penalty_forget, &
      penalty_keep, penalty_owes, penalty_select, penalty_state_t, penalty_stored
   use emcon_penalty_law, only : augmented_t, penalty_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : method_augmented_lagrange, method_penalty
   use emcon_system, only : system_t
   use emcon_term_registry, only : terms_mass_rows
   use emcon_text, only : to_text
   use given_contact, only : open_given_contact
   use given_scenes, only : keep_elements
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks
   implicit none
   private
   public :: collect_penalty_state

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: h = 0.25_wp

contains

   subroutine collect_penalty_state(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("stiffness of a step", test_stiffness), &
         test_case_t("stiffness of the other side", test_opposite), &
         test_case_t("laws of a set", test_laws), &
         test_case_t("what is stored and left", test_stored), &
         test_case_t("pushed back until it is closed", test_augment), &
         test_case_t("stiffer where it does not close", test_raise), &
         test_case_t("how deep it is", test_depth)]
   end subroutine collect_penalty_state

   !> Of the deck, or of what stands at the slave nodes, by area; half of each side where both push.
   !> An augmented Lagrangian is three times as stiff, and as stiff as inertia.
   subroutine test_stiffness(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: k

      do k = 1, 6
         call make_two_blocks(scene, 0.1_wp, lower, upper)
         call add_step(scene, k == 4, h, 1)
         associate (step => scene%step(1))
            if (k == 4) call clamp(step, [1, 2, 11, 12])
            step%contact%method = merge(method_augmented_lagrange, method_penalty, &
               k == 3 .or. k == 4)
            step%contact%penalty%factor = 0.5_wp
            step%contact%penalty%stiffness = merge(7.0_wp, 0.0_wp, k == 2)
            step%contact%penalty%tolerance = 0.25_wp
            step%scheme%is_explicit = k == 6
         end associate
         call check_stiffness(scene, k, error)
         if (allocated(error)) return
      end do
   end subroutine test_stiffness

   subroutine check_stiffness(scene, k, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(penalty_state_t) :: state
      real(wp) :: inner(size(scene%x, 2)), mass(size(scene%x, 2)), area(3), by_area
      integer :: i

      call march_init(march, scene, error)
      if (allocated(error)) return
      associate (system => march%system)
         system%contact(1)%contact%area_factor = merge(0.5_wp, 1.0_wp, k == 5)
         call penalty_begin_step(state, system, scene, scene%step(1), error)
         if (allocated(error)) return
         inner = 0.0_wp
         do i = 1, size(system%term)
            call system%term(i)%term%add_stiffness(inner)
         end do
         mass = 0.0_wp
         if (k == 3) call terms_mass_rows(system%term, mass)
         inner = inner + 2.0_wp*mass/h**2
         area = [0.5_wp, 1.0_wp, 0.5_wp]
         by_area = merge(7.0_wp, merge(1.5_wp, 0.5_wp, k == 3 .or. k == 4) &
            *sum(inner([11, 12, 13]))/2.0_wp, k == 2)
         call check_near(error, state%stiffness, merge(0.5_wp, 1.0_wp, k == 5)*by_area*area, tol, &
            by_area, "stiffness " // to_text(k))
         call check_near(error, state%area, merge(0.5_wp, 1.0_wp, k == 5)*area, tol, 1.0_wp, "area")
         call check_near(error, state%edge, spread(1.0_wp, 1, 3), tol, 1.0_wp, "edge")
         call check_near(error, [state%closure, state%tolerance], [1.0_wp, 1.0_wp, 1.0_wp, &
            0.25_wp], 0.0_wp, 1.0_wp, "nothing is known of the step before")
         call check_true(error, state%is_on .and. (state%augments .eqv. (k == 3 .or. k == 4)) &
            .and. (state%is_at_ends .eqv. k == 6), "kind")
         associate (step => system%contact(1)%contact%step)
            call check_true(error, step%has_compliance .and. (step%is_penalty .neqv. &
               (k == 3 .or. k == 4)), "what the contact knows")
         end associate
      end associate
      call march_free(march)
   end subroutine check_stiffness

   !> Nothing elastic stands on the first slave surface: that of the same pair seen from its other
   !> side counts, of other pairs none.
   subroutine test_opposite(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(penalty_state_t) :: state
      real(wp), allocatable :: inner(:)
      real(wp) :: area(3)
      integer :: i

      call make_two_blocks(scene, 0.1_wp, lower, upper)
      call add_step(scene, .false., h, 1)
      call keep_elements(scene, [.true., .true., .true., .true., .false., .false.])
      scene%pair = [scene%pair, scene%pair, scene%pair]
      scene%pair(2:3)%slave = 1
      scene%pair(2:3)%master = 2
      scene%step(1)%contact%method = method_penalty
      scene%step(1)%contact%penalty%factor = 0.5_wp
      call march_init(march, scene, error)
      if (allocated(error)) return
      march%system%contact(2)%of_pair = -1
      allocate(inner(size(scene%x, 2)), source=0.0_wp)
      do i = 1, size(march%system%term)
         call march%system%term(i)%term%add_stiffness(inner)
      end do
      call penalty_begin_step(state, march%system, scene, scene%step(1), error)
      if (allocated(error)) return
      call march%system%contact(1)%contact%own_area(scene%x, area)
      call check_near(error, state%stiffness(:3), 0.5_wp*sum(inner(6:10))/2.0_wp*area, tol, &
         sum(inner), "stiffness")
      call check_near(error, sum(area), 2.0_wp, tol, 1.0_wp, "area")
      call march_free(march)
   end subroutine test_opposite

   !> Three contacts, of which the first and the last act.
   subroutine open(system, state, active, method)
      type(system_t), intent(out) :: system
      type(penalty_state_t), intent(out) :: state
      type(active_set_t), intent(out) :: active
      integer, intent(in) :: method
      type(motion_t) :: motion
      integer :: k

      call open_given_contact(system, active, motion, reshape(spread(gap_state_t(is_near=.true., &
         is_over=.true., size=1.0_wp), 1, 3), [3, 1]), 0)
      active%is_active = [.true., .false., .true.]
      active%lam = [2.0_wp, 3.0_wp, 4.0_wp]
      call active_set_select(active, system, motion)
      state%is_on = .true.
      state%augments = method == method_augmented_lagrange
      state%area = [1.0_wp, 2.0_wp, 3.0_wp]
      state%stiffness = [10.0_wp, 20.0_wp, 30.0_wp]
      state%closure = [-0.1_wp, -0.2_wp, 0.3_wp]
      state%edge = [0.5_wp, 1.0_wp, 2.0_wp]
      state%tolerance = 0.1_wp
      call contact_law_of_method(method, state%law)
      do k = 1, 2
         active%set%item(k)%size = 1.0_wp
      end do
   end subroutine open

   !> With what the step before has left, if that is known and steps do not push at their ends.
   subroutine test_laws(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: method(4) = [method_penalty, method_penalty, method_penalty, &
         method_augmented_lagrange]
      type(system_t) :: system
      type(penalty_state_t) :: state
      type(active_set_t) :: active
      integer :: k, i

      do k = 1, 4
         call open(system, state, active, method(k))
         state%is_at_ends = k == 3
         call penalty_select(state, system, active%set, k /= 2)
         call check_true(error, active%set%penalty%is_on, "rows give way")
         call check_true(error, active%set%penalty%is_stored .eqv. (k == 1 .or. k == 3), "stored")
         do i = 1, 2
            select type (law => active%set%law(i)%row)
            class is (augmented_t)
               call check_equal(error, k, 4, "augmented")
               call check_near(error, [law%stiffness, law%base], [20.0_wp*i - 10.0_wp, 2.0_wp*i], &
                  tol, 1.0_wp, "pushes on")
            class is (penalty_t)
               call check_true(error, k < 4, "a penalty")
               call check_near(error, [law%stiffness, law%before], [20.0_wp*i - 10.0_wp, &
                  merge(0.4_wp*i - 0.5_wp, 1.0_wp, k == 1)], tol, 10.0_wp, "begins")
            class default
               call check_true(error, .false., "a law of contact that gives way")
            end select
         end do
      end do
      call open(system, state, active, method_penalty)
      state%is_on = .false.
      call penalty_select(state, system, active%set, .true.)
      call check_true(error, .not. (active%set%penalty%is_on .or. &
         allocated(active%set%law(1)%row)), "exact contact")
   end subroutine test_laws

   !> k/2 d^2 of what acts, and how far that is closed; not of an augmented Lagrangian.
   subroutine test_stored(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(penalty_state_t) :: state
      type(active_set_t) :: active
      real(wp) :: closure(3), energy, stretch(2, 3)
      logical :: owes(2)
      integer :: k

      do k = 1, 3
         call open(system, state, active, merge(method_augmented_lagrange, method_penalty, k == 2))
         call penalty_select(state, system, active%set, .true.)
         call set_now(active, -0.2_wp, 0.1_wp)
         active%set%penalty%is_on = k /= 3
         closure = 7.0_wp
         stretch = 0.0_wp
         call penalty_keep(state, active%set, closure, stretch)
         energy = penalty_stored(state, active%set)
         if (k == 1) then
            call check_near(error, [energy, closure], [0.2_wp, -0.2_wp, 7.0_wp, 0.0_wp], tol, &
               1.0_wp, "a penalty")
         else
            call check_near(error, [energy, closure], [0.0_wp, 7.0_wp, 7.0_wp, 7.0_wp], 0.0_wp, &
               1.0_wp, "stores nothing")
         end if
         owes = penalty_owes(state, 2, 3)
         call check_true(error, all(owes .eqv. [k /= 2, .false.]), "owes " // to_text(k))
      end do
      state%is_on = .false.
      owes = penalty_owes(state, 2, 3)
      call check_true(error, .not. any(owes), "exact contact owes nothing")
   end subroutine test_stored

   subroutine set_now(active, first, second)
      type(active_set_t), intent(inout) :: active
      real(wp), intent(in) :: first, second
      real(wp) :: now(2)
      integer :: i

      now = [first, second]
      do i = 1, 2
         select type (law => active%set%law(i)%row)
         class is (penalty_t)
            law%now = now(i)
         end select
      end do
   end subroutine set_now

   !> By a tenth of the edge, on both sides; a pull of one hundredth is none yet.
   subroutine test_augment(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: left(4) = [0.09_wp, 0.11_wp, -0.11_wp, -0.09_wp]
      type(system_t) :: system
      type(penalty_state_t) :: state
      type(active_set_t) :: active
      integer :: k
      logical :: is_done

      call open(system, state, active, method_augmented_lagrange)
      call penalty_select(state, system, active%set, .true.)
      do k = 1, 4
         active%set%penalty%left = [0.0_wp, left(k)]
         active%set%lam = [1.0_wp, real(k, wp)]
         call penalty_augment(state, active%set, is_done)
         call check_true(error, is_done .eqv. (k == 1 .or. k == 4), "done " // to_text(k))
         call check_equal(error, state%n_augmentation, k, "so often")
         select type (law => active%set%law(2)%row)
         class is (augmented_t)
            call check_near(error, law%base, real(k, wp), 0.0_wp, 1.0_wp, "goes on from that")
         end select
      end do
      state%augments = .false.
      call penalty_augment(state, active%set, is_done)
      call check_true(error, is_done .and. state%n_augmentation == 4, "which is not pushed back")
   end subroutine test_augment

   !> Ten times stiffer for each gap that has not fallen to a quarter, until the step is begun anew.
   subroutine test_raise(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: left(8) = [9.0_wp, 2.0_wp, 0.6_wp, 0.1_wp, 1.0_wp, 1.0_wp, 1.0_wp, &
         1.0_wp]
      real(wp), parameter :: raised(8) = [1.0_wp, 1.0_wp, 10.0_wp, 10.0_wp, 1.0e2_wp, 1.0e3_wp, &
         1.0e4_wp, 1.0e4_wp]
      type(system_t) :: system
      type(penalty_state_t) :: state
      type(active_set_t) :: active
      real(wp) :: first
      integer :: k
      logical :: is_done

      call open(system, state, active, method_augmented_lagrange)
      call penalty_select(state, system, active%set, .true.)
      first = stiffness_of(active)
      call check_true(error, first > 0.0_wp, "it pushes")
      do k = 1, size(left)
         active%set%penalty%left = [0.0_wp, -left(k)]
         call penalty_augment(state, active%set, is_done)
         call select_anew(state, system, active)
         call check_near(error, stiffness_of(active), raised(k)*first, 4*epsilon(first), 1.0_wp, &
            "after " // to_text(k))
      end do
      call penalty_forget(state)
      call check_equal(error, state%n_augmentation, 0, "none yet")
      call select_anew(state, system, active)
      call check_near(error, stiffness_of(active), first, 0.0_wp, 1.0_wp, "as at first")
   end subroutine test_raise

   !> As for another solve.
   subroutine select_anew(state, system, active)
      type(penalty_state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(active_set_t), intent(inout) :: active
      integer :: k

      do k = 1, active%set%n
         if (allocated(active%set%law(k)%row)) deallocate(active%set%law(k)%row)
      end do
      call penalty_select(state, system, active%set, .true.)
   end subroutine select_anew

   !> That of the contact in the set.
   real(wp) function stiffness_of(active) result(stiffness)
      type(active_set_t), intent(in) :: active

      stiffness = 0.0_wp
      select type (law => active%set%law(2)%row)
      class is (augmented_t)
         stiffness = law%stiffness
      end select
   end function stiffness_of

   !> By the shorter edge of both sides; of an augmented Lagrangian by that of its tolerance.
   subroutine test_depth(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(penalty_state_t) :: state
      type(active_set_t) :: active

      call open(system, state, active, method_penalty)
      active%set%penalty%left = [-0.1_wp, -0.15_wp]
      call check_near(error, penalty_depth(state, active%set), 0.0_wp, 0.0_wp, 1.0_wp, "exact")
      active%set%penalty%is_on = .true.
      call check_near(error, penalty_depth(state, active%set), 0.2_wp, tol, 1.0_wp, &
         "by the slave's edge")
      active%set%penalty%left(2) = -0.25_wp
      call check_near(error, penalty_depth(state, active%set), 0.25_wp, tol, 1.0_wp, &
         "by the master's")
      state%edge(1) = 0.0_wp
      active%set%penalty%left = [-0.4_wp, 0.5_wp]
      call check_near(error, penalty_depth(state, active%set), 0.4_wp, tol, 1.0_wp, &
         "a slave surface without edges")
      state%augments = .true.
      state%edge(1) = 0.5_wp
      call check_near(error, penalty_depth(state, active%set), 0.4_wp, tol, 1.0_wp, "augmented")
      active%set%n_permanent = 1
      call check_near(error, penalty_depth(state, active%set), 0.0_wp, 0.0_wp, 1.0_wp, "open")
   end subroutine test_depth

end module test_penalty_state
