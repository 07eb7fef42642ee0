!> Steps of any size, the state in and out, and conditions changed between steps.
module test_stepper_free
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_numbering, only : spread_dependent
   use emcon_restart_data, only : restart_rewind, restart_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_is_done, stepper_t
   use emcon_stepper_conditions, only : conditions_exchange, &
      stepper_add_prescribed, stepper_remove_prescribed, stepper_set_prescribed
   use emcon_stepper_loads, only : stepper_add_loads, stepper_find_load, stepper_set_load
   use emcon_stepper_free, only : snapshot_t, stepper_next_step, stepper_restore, &
      stepper_set_state, stepper_snapshot, stepper_step
   use emcon_steps, only : load_gravity, load_point, load_pressure, load_t, newton_full
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_block, prescribe, shake, young
   use stepper_scenes, only : check_same_state, drop_h, make_drop, make_tied_drop, open_scene
   implicit none
   private
   public :: collect_stepper_free

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_stepper_free(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("free steps are grid steps", test_grid), &
         test_case_t("off the grid and back", test_off_grid), &
         test_case_t("beyond the end", test_beyond), &
         test_case_t("next step of the deck", test_next_step), &
         test_case_t("a step that fails", test_failure), &
         test_case_t("bad step sizes", test_bad_size), &
         test_case_t("snapshot and restore", test_snapshot), &
         test_case_t("restore over steps of the deck", test_restore_step), &
         test_case_t("the state of another model", test_set_state), &
         test_case_t("ties follow a state that is set", test_links), &
         test_case_t("bad states", test_bad_state), &
         test_case_t("a load from the start", test_load), &
         test_case_t("a load that is added", test_load_added), &
         test_case_t("a load within a static step", test_load_later), &
         test_case_t("a boundary value within a static step", test_prescribed), &
         test_case_t("boundary conditions come and go", test_renumber), &
         test_case_t("conditions through a restart file", test_saved), &
         test_case_t("bad conditions", test_bad_conditions)]
   end subroutine collect_stepper_free

   subroutine test_grid(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: grid, free
      type(increment_t) :: increment
      integer :: k, n_contact

      call make_drop(scene, 30)
      call open_scene(grid, scene, error)
      if (.not. allocated(error)) call open_scene(free, scene, error)
      n_contact = 0
      do k = 1, 30
         if (allocated(error)) return
         call stepper_advance(grid, increment, error)
         if (.not. allocated(error)) call stepper_step(free, drop_h, increment, error)
         if (allocated(error)) return
         n_contact = n_contact + merge(1, 0, increment%n_active > 0)
         call check_same_state(error, free, grid, "step " // to_text(k))
         call check_equal(error, free%march%state%clock%n_grid, k, "grid point")
      end do
      call check_true(error, n_contact > 1, "there was contact")
      call check_true(error, stepper_is_done(free), "the deck is done")
      call stepper_close(grid)
      call stepper_close(free)
   end subroutine test_grid

   !> Thirds of an increment: the grid refuses to go on from between its points.
   subroutine test_off_grid(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k, n

      call make_drop(scene, 9)
      call open_scene(stepper, scene, error)
      do n = 1, 3
         do k = 1, 3
            if (allocated(error)) return
            call stepper_step(stepper, drop_h/3.0_wp, increment, error)
            if (allocated(error)) return
            call check_equal(error, stepper%march%state%clock%n_grid, 2*(n - 1) + k/3, "grid point")
            if (k == 3) exit
            call stepper_advance(stepper, increment, refused)
            call check_error(error, refused, err_input, "between two increments", "refused")
         end do
         if (allocated(error)) return
         call check_near(error, stepper%march%state%clock%time, real(2*n - 1, wp)*drop_h, 0.0_wp, &
            1.0_wp, "at a grid point, exactly")
         if (allocated(error)) return
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, stepper%march%state%clock%time, real(2*n, wp)*drop_h, 0.0_wp, &
            1.0_wp, "at the next one")
      end do
      call stepper_close(stepper)
   end subroutine test_off_grid

   !> In statics a run ends with the step of the deck and keeps its value.
   subroutine test_beyond(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call make_pull(scene, 0.25_wp, 4)
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call stepper_step(stepper, 0.75_wp, increment, error)
      if (allocated(error)) return
      call check_near(error, stepper%march%state%u(1, [2, 4]), 0.15_wp*[1.0_wp, 1.0_wp], &
         4.0_wp*eps, 1.0_wp, "on the way")
      if (allocated(error)) return
      call stepper_step(stepper, 1.0_wp, increment, error)
      if (allocated(error)) return
      call check_near(error, stepper%march%state%u(1, [2, 4]), 0.2_wp*[1.0_wp, 1.0_wp], &
         4.0_wp*eps, 1.0_wp, "beyond the end")
      call check_near(error, stepper%march%state%clock%time, 1.75_wp, 0.0_wp, 1.0_wp, "time")
      call check_true(error, stepper_is_done(stepper), "the deck is done")
      call stepper_close(stepper)
   end subroutine test_beyond

   !> One element that is pulled to a displacement of 0.2 in a static step.
   subroutine make_pull(scene, h, n)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: h
      integer, intent(in) :: n
      type(block_t) :: block

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., h, n)
      call clamp(scene%step(1), [1, 3])
      call prescribe(scene%step(1), 2, 1, 0.2_wp)
      call prescribe(scene%step(1), 4, 1, 0.2_wp)
   end subroutine make_pull

   !> Begun from between two increments, a dynamic step goes on from there; the last has no next.
   subroutine test_next_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call make_drop(scene, 4)
      call add_step(scene, .false., drop_h, 4)
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call stepper_step(stepper, 0.5_wp*drop_h, increment, error)
      if (.not. allocated(error)) call stepper_next_step(stepper, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      call check_equal(error, stepper%march%state%clock%i_step, 2, "step of the deck")
      call check_near(error, stepper%march%state%clock%time, 0.5_wp*drop_h + drop_h, 0.0_wp, &
         1.0_wp, "time")
      call stepper_next_step(stepper, refused)
      call check_error(error, refused, err_input, "is the last one", "refused")
      call stepper_close(stepper)
   end subroutine test_next_step

   !> Steps so large that they fail even in halves leave no trace, although the first half succeeds
   !> for some of them.
   subroutine test_failure(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(stepper_t) :: stepper, before
      type(increment_t) :: increment
      integer :: k, n_failed

      call make_drop(scene, 30)
      scene%step(1)%solution%newton_maximum = 3
      scene%step(1)%time%h_min = 0.26_wp*drop_h
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call open_scene(before, scene, error)
      if (allocated(error)) return
      n_failed = 0
      do k = 1, 40
         call stepper_step(stepper, drop_h*k, increment, failed)
         if (.not. allocated(failed)) then
            before%march%state = stepper%march%state
            before%march%ledger = stepper%march%ledger
            cycle
         end if
         n_failed = n_failed + 1
         call check_equal(error, failed%code, err_analysis, "code")
         call check_same_state(error, stepper, before, "after a failure")
         if (allocated(error)) return
      end do
      call check_true(error, n_failed > 0, "some fail")
      call stepper_close(stepper)
      call stepper_close(before)
   end subroutine test_failure

   subroutine test_bad_size(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(stepper_t) :: stepper, closed
      type(increment_t) :: increment
      real(wp) :: bad(4)
      integer :: k

      call stepper_step(closed, 1.0_wp, increment, failed)
      call check_error(error, failed, err_input, "no model", "refused")
      call make_drop(scene, 3)
      if (.not. allocated(error)) call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call stepper_step(stepper, drop_h, increment, error)
      if (allocated(error)) return
      bad = [0.0_wp, -drop_h, ieee_value(1.0_wp, ieee_quiet_nan), epsilon(1.0_wp)*drop_h]
      do k = 1, 4
         call stepper_step(stepper, bad(k), increment, failed)
         call check_error(error, failed, err_input, "a size h > 0", "refused")
      end do
      call stepper_close(stepper)
   end subroutine test_bad_size

   !> Before, in and after contact: what follows has the same bits.
   subroutine test_snapshot(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper, straight
      type(snapshot_t) :: snapshot, none
      type(error_t), allocatable :: failed
      type(increment_t) :: increment
      integer :: k, start

      call make_tied_drop(scene, 40, is_mortar=.true.)
      do start = 3, 15, 4
         call open_scene(stepper, scene, error)
         if (.not. allocated(error)) call open_scene(straight, scene, error)
         call go(straight, start + 8)
         call go(stepper, start)
         call stepper_snapshot(stepper, snapshot)
         call go(stepper, 20)
         if (.not. allocated(error)) call stepper_restore(stepper, snapshot, error)
         call go(stepper, 8)
         if (allocated(error)) return
         call check_same_state(error, stepper, straight, "from step " // to_text(start))
         call stepper_restore(stepper, none, failed)
         call check_error(error, failed, err_input, "not taken from this model", "refused")
         call stepper_close(stepper)
         call stepper_close(straight)
         if (allocated(error)) return
         stepper = stepper_t()
         straight = stepper_t()
      end do

   contains

      subroutine go(one, n)
         type(stepper_t), intent(inout) :: one
         integer, intent(in) :: n

         do k = 1, n
            if (.not. allocated(error)) call stepper_advance(one, increment, error)
         end do
      end subroutine go

   end subroutine test_snapshot

   !> From the second step of the deck back into the first, which has other unknowns.
   subroutine test_restore_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper, straight
      type(snapshot_t) :: snapshot
      type(increment_t) :: increment
      integer :: k

      call make_drop(scene, 8)
      call add_step(scene, .false., drop_h, 4)
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call open_scene(straight, scene, error)
      do k = 1, 12
         if (k == 6) call stepper_snapshot(stepper, snapshot)
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (.not. allocated(error)) call stepper_advance(straight, increment, error)
      end do
      if (.not. allocated(error)) call stepper_restore(stepper, snapshot, error)
      do k = 6, 12
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      end do
      if (allocated(error)) return
      call check_equal(error, stepper%march%state%clock%i_step, 2, "step of the deck")
      call check_same_state(error, stepper, straight, "once more")
      call stepper_close(stepper)
      call stepper_close(straight)
   end subroutine test_restore_step

   !> A fresh model that is given the state of another one in contact goes on like that one. Its
   !> works begin with it.
   subroutine test_set_state(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper, fresh
      type(increment_t) :: increment
      integer :: k

      call make_drop(scene, 20)
      scene%step%solution%newton = newton_full            ! a kept factor does not come along
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call open_scene(fresh, scene, error)
      do k = 1, 10
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         if (increment%n_active > 0) exit
      end do
      call check_true(error, any(stepper%march%state%contacts%is_active), "in contact")
      if (allocated(error)) return
      associate (state => stepper%march%state)
         call stepper_set_state(fresh, error, u=state%u, v=state%v, lam=state%contacts%lam, &
            is_active=state%contacts%is_active, time=state%clock%time)
      end associate
      if (allocated(error)) return
      associate (a => stepper%march%ledger, b => fresh%march%ledger)
         call check_near(error, b%kinetic, a%kinetic, 0.0_wp, 1.0_wp, "kinetic energy")
         call check_near(error, b%strain, a%strain, 64.0_wp*eps, a%strain, "strain energy")
         call check_near(error, b%angular, a%angular, 0.0_wp, 1.0_wp, "angular momentum")
      end associate
      do k = 1, 10
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (.not. allocated(error)) call stepper_advance(fresh, increment, error)
      end do
      if (allocated(error)) return
      fresh%march%ledger = stepper%march%ledger
      call check_same_state(error, fresh, stepper, "later")
      call stepper_close(stepper)
      call stepper_close(fresh)
   end subroutine test_set_state

   subroutine test_links(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      real(wp), allocatable :: u(:, :), v(:, :)

      call make_tied_drop(scene, 4, is_mortar=.false.)
      call open_scene(stepper, scene, error)
      if (allocated(error)) return
      allocate(u, v, mold=scene%x)
      call shake(u, 0.01_wp)
      call shake(v, 1.0_wp)
      call stepper_set_state(stepper, error, u=u, v=v)
      if (allocated(error)) return
      associate (state => stepper%march%state, numbering => stepper%march%system%space%linked)
         call check_true(error, numbering%n_dependent > 0 .and. any(abs(state%u - u) > 0.0_wp), &
            "some nodes follow")
         call spread_dependent(numbering, u)
         call spread_dependent(numbering, v)
         call check_near(error, state%u, u, 0.0_wp, 1.0_wp, "u")
         call check_near(error, state%v, v, 0.0_wp, 1.0_wp, "v")
      end associate
      call stepper_close(stepper)
   end subroutine test_links

   !> What is refused leaves the state as it was, also if only one of several parts is bad.
   subroutine test_bad_state(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(stepper_t) :: stepper, before
      type(increment_t) :: increment
      real(wp), allocatable :: u(:, :), v(:, :), lam(:)
      integer :: k

      call make_drop(scene, 20)
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call open_scene(before, scene, error)
      do k = 1, 6
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (.not. allocated(error)) call stepper_advance(before, increment, error)
      end do
      if (allocated(error)) return
      u = 0.5_wp*stepper%march%state%u
      v = 0.5_wp*stepper%march%state%v
      lam = stepper%march%state%contacts%lam
      call stepper_set_state(stepper, failed, v=v, u=u(:, 2:))
      call judge(err_input, "u is to have 2 components at each of 16 nodes, not 2 at 15")
      call stepper_set_state(stepper, failed, u=u, v=transpose(v))
      call judge(err_input, "v is to have 2 components")
      v(2, 7) = ieee_value(1.0_wp, ieee_quiet_nan)
      call stepper_set_state(stepper, failed, u=u, v=v)
      call judge(err_input, "v is not finite at node 7")
      call stepper_set_state(stepper, failed, u=u, lam=lam(2:))
      call judge(err_input, "lam is to have 3 entries")
      call stepper_set_state(stepper, failed, u=u, lam=1.0_wp + lam, is_active=lam > huge(lam))
      call judge(err_input, "lam is not 0 at constraint 1")
      call stepper_set_state(stepper, failed, u=u, time=-1.0_wp)
      call judge(err_input, "is before the start")
      u(:, 14) = u(:, 14) + [5.0_wp, 0.0_wp]
      call stepper_set_state(stepper, failed, u=u, time=0.0_wp)
      call judge(err_analysis, "element 5 is inverted")
      if (allocated(error)) return
      call stepper_advance(stepper, increment, error)
      if (.not. allocated(error)) call stepper_advance(before, increment, error)
      if (allocated(error)) return
      call check_same_state(error, stepper, before, "the next step")
      call stepper_close(stepper)
      call stepper_close(before)

   contains

      subroutine judge(code, text)
         integer, intent(in) :: code
         character(len=*), intent(in) :: text

         call check_error(error, failed, code, text, "refused")
         call check_same_state(error, stepper, before, "not " // text)
      end subroutine judge

   end subroutine test_bad_state

   !> A block on its clamped lower edge with a force on its upper right corner.
   subroutine make_loaded(scene, is_static, force)
      type(scene_t), intent(out) :: scene
      logical, intent(in) :: is_static
      real(wp), intent(in) :: force
      type(block_t) :: block
      type(load_t) :: load

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, is_static, 0.1_wp, 10)
      call clamp(scene%step(1), [1, 2, 3])
      load%kind = load_point
      load%target = 9
      load%place = 1
      load%value = force
      call add_load(scene%step(1), load)
   end subroutine make_loaded

   !> As if the deck had said so.
   subroutine test_load(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: deck, changed
      type(increment_t) :: increment
      integer :: k, n, i

      do n = 1, 2
         call make_loaded(scene, n == 1, 3.0_wp)
         call open_scene(deck, scene, error)
         call make_loaded(scene, n == 1, -1.0_wp)
         if (.not. allocated(error)) call open_scene(changed, scene, error)
         if (.not. allocated(error)) call stepper_find_load(changed, load_point, 9, 1, i, error)
         if (.not. allocated(error)) call stepper_set_load(changed, i, 3.0_wp, error)
         do k = 1, 10
            if (.not. allocated(error)) call stepper_advance(deck, increment, error)
            if (.not. allocated(error)) call stepper_advance(changed, increment, error)
         end do
         if (allocated(error)) return
         call check_true(error, maxval(deck%march%state%u) > 0.05_wp, "it moves")
         call check_same_state(error, changed, deck, "static, dynamic " // to_text(n))
         call stepper_close(deck)
         call stepper_close(changed)
         if (allocated(error)) return
         deck = stepper_t()
         changed = stepper_t()
      end do
   end subroutine test_load

   !> A load that is added is one of the deck, to the last bit, and runs from 0 if added half way.
   subroutine test_load_added(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: deck, changed
      type(increment_t) :: increment
      real(wp) :: total(2)
      integer :: k, n, late

      do n = 1, 3
         late = merge(5, 0, n == 3)
         call make_loaded(scene, n /= 2, 3.0_wp)
         call open_scene(deck, scene, error)
         deallocate(scene%step(1)%load)
         allocate(scene%step(1)%load(0))
         if (.not. allocated(error)) call open_scene(changed, scene, error)
         do k = 1, 10
            if (k == late + 1 .and. .not. allocated(error)) call stepper_add_loads(changed, &
               load_point, [9], [1], [3.0_wp], error=error)
            if (.not. allocated(error)) call stepper_advance(deck, increment, error)
            if (.not. allocated(error)) call stepper_advance(changed, increment, error)
            if (allocated(error)) return
            total = sum(changed%march%state%reaction, dim=2)
            if (n == 3) call check_near(error, -total(1), 0.6_wp*max(0, k - late), &
               max(scene%step(1)%solution%newton_tolerance, 64.0_wp*epsilon(1.0_wp)), young, &
               "force " // to_text(k))
            if (allocated(error)) return
         end do
         call check_true(error, maxval(deck%march%state%u) > 0.05_wp, "it moves")
         if (n < 3) call check_same_state(error, changed, deck, "static, dynamic " // to_text(n))
         if (n == 3) call check_near(error, changed%march%state%u, deck%march%state%u, &
            max(scene%step(1)%solution%newton_tolerance, 64.0_wp*epsilon(1.0_wp)), 10.0_wp, "end")
         call stepper_close(deck)
         call stepper_close(changed)
         if (allocated(error)) return
         deck = stepper_t()
         changed = stepper_t()
      end do
   end subroutine test_load_added

   !> Changed half way the force goes on from where it is, and the end is that of the other deck.
   subroutine test_load_later(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: deck, changed
      type(increment_t) :: increment
      real(wp) :: total(2)
      integer :: k

      call make_loaded(scene, .true., 3.0_wp)
      call open_scene(deck, scene, error)
      call make_loaded(scene, .true., -1.0_wp)
      if (.not. allocated(error)) call open_scene(changed, scene, error)
      do k = 1, 10
         if (.not. allocated(error)) call stepper_advance(deck, increment, error)
         if (.not. allocated(error)) call stepper_advance(changed, increment, error)
         if (k == 5 .and. .not. allocated(error)) call stepper_set_load(changed, 1, 3.0_wp, error)
         if (allocated(error)) return
         total = sum(changed%march%state%reaction, dim=2)
         call check_near(error, -total(1), merge(-0.1_wp*k, -0.5_wp + 0.7_wp*(k - 5), k <= 5), &
            max(scene%step(1)%solution%newton_tolerance, 64.0_wp*epsilon(1.0_wp)), young, &
            "force " // to_text(k))
         if (allocated(error)) return
      end do
      call check_near(error, changed%march%state%u, deck%march%state%u, &
         max(scene%step(1)%solution%newton_tolerance, 64.0_wp*epsilon(1.0_wp)), 10.0_wp, "end")
      call stepper_close(deck)
      call stepper_close(changed)
   end subroutine test_load_later

   !> After half the way to 0.2 straight on to -0.3.
   subroutine test_prescribed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k

      call make_pull(scene, 0.125_wp, 8)
      call open_scene(stepper, scene, error)
      do k = 1, 8
         if (allocated(error)) return
         call stepper_advance(stepper, increment, error)
         if (k == 4 .and. .not. allocated(error)) then
            call stepper_set_prescribed(stepper, 2, 1, -0.3_wp, error)
            if (.not. allocated(error)) call stepper_set_prescribed(stepper, 4, 1, -0.3_wp, error)
         end if
         if (allocated(error)) return
         call check_near(error, stepper%march%state%u(1, 2), merge(0.025_wp*k, &
            0.1_wp - 0.1_wp*(k - 4), k <= 4), 16.0_wp*eps, 1.0_wp, "place " // to_text(k))
      end do
      call stepper_close(stepper)
   end subroutine test_prescribed

   !> Like steps of a deck with one condition less, and with it again.
   subroutine test_renumber(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: deck, changed
      type(increment_t) :: increment
      integer :: k

      call make_drop(scene, 24)
      deallocate(scene%step(1)%load)
      allocate(scene%step(1)%load(0))
      call open_scene(changed, scene, error)
      scene%step(1)%time%duration = 8*drop_h
      scene%step = [scene%step(1), scene%step(1), scene%step(1)]
      call free_corner(scene, 2)
      if (.not. allocated(error)) call open_scene(deck, scene, error)
      do k = 1, 24
         if (k == 9 .and. .not. allocated(error)) call stepper_remove_prescribed(changed, 5, 2, &
            error)
         if (k == 17 .and. .not. allocated(error)) call stepper_add_prescribed(changed, 5, 2, &
            0.0_wp, error)
         if (.not. allocated(error)) call stepper_advance(deck, increment, error)
         if (.not. allocated(error)) call stepper_advance(changed, increment, error)
         if (allocated(error)) return
         call check_near(error, changed%march%state%u, deck%march%state%u, 0.0_wp, 1.0_wp, &
            "u " // to_text(k))
         if (k == 16) call check_true(error, abs(deck%march%state%u(2, 5)) > 1.0e-4_wp, &
            "the corner is free")
         if (allocated(error)) return
      end do
      call stepper_close(deck)
      call stepper_close(changed)

   contains

      !> Take the condition on node 5 in y out of step `i_step`.
      subroutine free_corner(scene, i_step)
         type(scene_t), intent(inout) :: scene
         integer, intent(in) :: i_step

         associate (list => scene%step(i_step)%prescribed)
            scene%step(i_step)%prescribed = pack(list, .not. (list%node == 5 .and. list%dof == 2))
         end associate
      end subroutine free_corner

   end subroutine test_renumber

   !> A model of the same deck that is given conditions and state goes on like the one they are of.
   subroutine test_saved(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper, other
      type(restart_t) :: restart, none
      type(snapshot_t) :: snapshot
      type(increment_t) :: increment
      integer :: k

      call make_drop(scene, 20)
      call open_scene(stepper, scene, error)
      if (.not. allocated(error)) call open_scene(other, scene, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (.not. allocated(error)) call stepper_remove_prescribed(stepper, 5, 2, error)
      if (.not. allocated(error)) call stepper_set_prescribed(stepper, 5, 1, 0.01_wp, error)
      if (.not. allocated(error)) call stepper_set_load(stepper, 1, -2.0_wp, error)
      if (.not. allocated(error)) call stepper_step(stepper, 0.3_wp*drop_h, increment, error)
      if (allocated(error)) return
      call conditions_exchange(stepper, restart, error)
      if (allocated(error)) return
      call stepper_snapshot(stepper, snapshot)
      snapshot%state%clock%is_off_grid = .false.
      snapshot%state%clock%step_time = 0.0_wp
      call stepper_restore(other, snapshot, error)
      call restart_rewind(none)
      if (.not. allocated(error)) call conditions_exchange(other, none, error)
      if (allocated(error)) return
      call check_equal(error, size(other%scene%step(1)%prescribed), 10, "nothing saved")
      call restart_rewind(restart)
      if (.not. allocated(error)) call conditions_exchange(other, restart, error)
      do k = 1, 8
         if (.not. allocated(error)) call stepper_step(stepper, drop_h, increment, error)
         if (.not. allocated(error)) call stepper_step(other, drop_h, increment, error)
      end do
      if (allocated(error)) return
      call check_same_state(error, other, stepper, "later")
      call check_near(error, other%march%state%u(1, 5), 0.01_wp, eps, 1.0_wp, "prescribed")
      call check_true(error, other%march%state%clock%is_off_grid, "off the grid")
      call stepper_close(stepper)
      call stepper_close(other)
   end subroutine test_saved

   subroutine test_bad_conditions(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: i

      call make_loaded(scene, .true., 3.0_wp)
      call open_scene(stepper, scene, error)
      if (allocated(error)) return
      call stepper_find_load(stepper, load_point, 9, 2, i, failed)
      call check_error(error, failed, err_input, "no load of this kind on node 9", "refused")
      call stepper_set_load(stepper, 2, 1.0_wp, failed)
      call check_error(error, failed, err_input, "there is no load 2", "refused")
      call stepper_set_load(stepper, 1, ieee_value(1.0_wp, ieee_quiet_nan), failed)
      call check_error(error, failed, err_input, "not finite", "refused")
      call stepper_add_loads(stepper, load_point, [8, 9], [1, 1], [1.0_wp, 1.0_wp], error=failed)
      call check_error(error, failed, err_input, "such a load on node 9 already", "refused")
      call stepper_add_loads(stepper, load_point, [8, 8], [2, 2], [1.0_wp, 1.0_wp], error=failed)
      call check_error(error, failed, err_input, "such a load on node 8 already", "refused")
      call stepper_add_loads(stepper, load_point, [77], [1], [1.0_wp], error=failed)
      call check_error(error, failed, err_input, "no node 77", "refused")
      call stepper_add_loads(stepper, load_point, [8], [3], [1.0_wp], error=failed)
      call check_error(error, failed, err_input, "not in 1..2", "refused")
      call stepper_add_loads(stepper, load_pressure, [1], [5], [1.0_wp], error=failed)
      call check_error(error, failed, err_input, "not in 1..4", "refused")
      call stepper_add_loads(stepper, load_gravity, [1], [0], [1.0_wp], error=failed)
      call check_error(error, failed, err_input, "needs a direction", "refused")
      call stepper_add_loads(stepper, load_gravity, [1], [0], [1.0_wp], &
         spread(0.0_wp, 1, 3), failed)
      call check_error(error, failed, err_input, "direction of gravity is 0", "refused")
      call stepper_add_loads(stepper, 99, [1], [0], [1.0_wp], error=failed)
      call check_error(error, failed, err_input, "kind 99", "refused")
      call check_equal(error, size(stepper%scene%step(1)%load), 1, "nothing was added")
      call stepper_set_prescribed(stepper, 77, 1, 1.0_wp, failed)
      call check_error(error, failed, err_input, "no node 77", "refused")
      call stepper_set_prescribed(stepper, 1, 3, 1.0_wp, failed)
      call check_error(error, failed, err_input, "1 to 2, not 3", "refused")
      call stepper_set_prescribed(stepper, 9, 1, 1.0_wp, failed)
      call check_error(error, failed, err_input, "is not prescribed", "refused")
      call stepper_add_prescribed(stepper, 1, 1, 1.0_wp, failed)
      call check_error(error, failed, err_input, "is prescribed already", "refused")
      call stepper_remove_prescribed(stepper, 9, 2, failed)
      call check_error(error, failed, err_input, "is not prescribed", "refused")
      do i = 1, 3
         if (.not. allocated(error)) call stepper_remove_prescribed(stepper, i, 1, failed)
         if (i < 3 .and. .not. allocated(error)) call check_true(error, .not. allocated(failed), &
            "still held")
      end do
      call check_error(error, failed, err_analysis, "free to move in x", "refused")
      call check_equal(error, size(stepper%scene%step(1)%prescribed), 4, "conditions left")
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      call stepper_close(stepper)
   end subroutine test_bad_conditions

end module test_stepper_free
