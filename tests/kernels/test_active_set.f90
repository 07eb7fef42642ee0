!> Contact of a block that is thrown on another one: the three treatments of first contact, release,
!> the stand-off, and the two constraint methods.
module test_active_set
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_phases, only : phase_enter, phase_vectors
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_admissible, initiation_persistent, &
      initiation_velocity_update, method_null_space, method_saddle_point
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks
   implicit none
   private
   public :: collect_active_set

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Round-off of some 60 steps, each of the order of epsilon times the energy.
   real(wp), parameter :: tol = 450.0_wp*eps
   integer, parameter :: n_step = 60
   real(wp), parameter :: gap_start = 0.0927_wp, h = 0.02_wp
   !> Slave nodes of the upper block.
   integer, parameter :: slave(3) = [11, 12, 13]

   !> What was seen during a run.
   type :: seen_t
      real(wp) :: drift = 0.0_wp                 !! largest |total - start|
      real(wp) :: gain = 0.0_wp                  !! largest total - start
      real(wp) :: smallest_gap = 0.0_wp
      integer :: n_contact = 0                   !! increments with contact
      integer :: n_release = 0                   !! increments that lost an active constraint
      integer :: n_cut = 0
   end type seen_t

contains

   subroutine collect_active_set(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("persistent keeps the energy", test_persistent), &
         test_case_t("admissible loses lam times the gap", test_admissible), &
         test_case_t("admissible never gains", test_never_gains), &
         test_case_t("velocity update restores", test_velocity_update), &
         test_case_t("momenta of two free blocks", test_momenta), &
         test_case_t("gap tolerance limits the stand-off", test_stand_off), &
         test_case_t("null space and saddle point go together", test_methods), &
         test_case_t("units by powers of two", test_units)]
   end subroutine collect_active_set

   !> The upper block falls with a velocity of 1, aslant; the lower one is clamped or free.
   subroutine make_drop(scene, initiation, is_clamped, march, error)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: initiation
      logical, intent(in) :: is_clamped
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, gap_start, lower, upper)
      call add_step(scene, .false., h, n_step)
      scene%step(1)%contact%initiation = initiation
      if (is_clamped) call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      call begin(scene, march, error)
   end subroutine make_drop

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, error)
   end subroutine begin

   subroutine run(scene, n, march, seen, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n
      type(march_t), intent(inout) :: march
      type(seen_t), intent(out) :: seen
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      type(ledger_t) :: start
      integer :: k, n_before, phase

      start = march%ledger
      do k = 1, n
         n_before = count(march%state%contacts%is_active)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call phase_enter(march%system%phases, phase_vectors, phase)
         call check_equal(error, phase, phase_vectors, "phases that were entered were left")
         if (allocated(error)) return
         seen%drift = max(seen%drift, abs(march%ledger%total - start%total))
         seen%gain = max(seen%gain, march%ledger%total - start%total)
         seen%n_contact = seen%n_contact + merge(1, 0, increment%n_active > 0)
         seen%n_release = seen%n_release + merge(1, 0, increment%n_active < n_before)
         seen%n_cut = seen%n_cut + increment%n_cut
         seen%smallest_gap = min(seen%smallest_gap, minval(scene%x(2, slave) &
            + march%state%u(2, slave)))
      end do
   end subroutine run

   !> On a clamped block, where the gap is the height of the node.
   subroutine test_persistent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(seen_t) :: seen
      real(wp) :: total

      call make_drop(scene, initiation_persistent, .true., march, error)
      if (allocated(error)) return
      total = march%ledger%total
      call run(scene, n_step, march, seen, error)
      if (allocated(error)) return
      call check_near(error, seen%drift, 0.0_wp, tol, total, "energy")
      call check_near(error, seen%smallest_gap, 0.0_wp, tol, 1.0_wp, "no penetration")
      call check_near(error, march%ledger%contact_work, 0.0_wp, tol, total, "contact work")
      call check_near(error, march%ledger%momentum(1), 0.6_wp, tol, 1.0_wp, "px: no friction")
      call check_true(error, seen%n_contact > 1 .and. seen%n_release > 0, &
         "contact " // to_text(seen%n_contact) // ", release " // to_text(seen%n_release))
      call check_true(error, march%ledger%momentum(2) > 0.0_wp, "it has bounced off")
      call check_equal(error, count(march%state%contacts%is_active), 0, "constraints at the end")
      call march_free(march)
   end subroutine test_persistent

   !> In the increment of first contact the total falls by sum of lam_k gap_k(q0) to round-off.
   subroutine test_admissible(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: before, gap(3), loss
      integer :: k

      call make_drop(scene, initiation_admissible, .true., march, error)
      if (allocated(error)) return
      do k = 1, n_step
         before = march%ledger%total
         gap = scene%x(2, slave) + march%state%u(2, slave)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         if (increment%n_active > 0) exit
         call check_near(error, march%ledger%total, before, tol, before, "free flight")
      end do
      loss = sum(march%state%contacts%lam*gap)
      call check_equal(error, increment%n_active, 3, "active constraints")
      call check_equal(error, increment%n_cut, 0, "cuts")
      call check_true(error, loss > 1.0e-3_wp*before, "a loss worth the name")
      call check_near(error, before - march%ledger%total, loss, tol, before, "loss of energy")
      call check_near(error, march%ledger%contact_work, -loss, tol, before, "work of contact")
      call check_near(error, scene%x(2, slave) + march%state%u(2, slave), &
         [0.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, "gaps")
      call march_free(march)
   end subroutine test_admissible

   subroutine test_never_gains(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(seen_t) :: seen
      real(wp) :: total

      call make_drop(scene, initiation_admissible, .false., march, error)
      if (allocated(error)) return
      total = march%ledger%total
      call run(scene, n_step, march, seen, error)
      if (allocated(error)) return
      call check_true(error, seen%n_contact > 1, "contact")
      call check_near(error, max(0.0_wp, seen%gain), 0.0_wp, tol, total, "gain")
      call check_near(error, march%ledger%total - total, march%ledger%contact_work, tol, total, &
         "the loss is the work of contact")
      call march_free(march)
   end subroutine test_never_gains

   !> Up to the increment of first contact, and over all as what the ledger says.
   subroutine test_velocity_update(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(increment_t) :: increment
      type(ledger_t) :: start
      integer :: k
      logical :: is_clamped

      do k = 1, 2
         is_clamped = k == 1
         block
            type(march_t) :: fresh

            call make_drop(scene, initiation_velocity_update, is_clamped, fresh, error)
            if (allocated(error)) return
            start = fresh%ledger
            do
               call march_increment(fresh, scene, increment, error)
               if (allocated(error)) return
               if (increment%n_active > 0 .or. fresh%state%clock%n_grid == n_step) exit
            end do
            call check_true(error, increment%n_active > 0, "first contact")
            call check_near(error, fresh%ledger%total, start%total, tol, start%total, "energy")
            call check_near(error, fresh%ledger%momentum(1), start%momentum(1), tol, &
               abs(start%momentum(2)), "px")
            if (.not. is_clamped) then
               call check_near(error, [fresh%ledger%momentum(2), fresh%ledger%angular], &
                  [start%momentum(2), start%angular], tol, abs(start%momentum(2)), "py, lz")
            end if
            call march_free(fresh)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_velocity_update

   !> Contact forces are internal: px, py, lz stand through contact.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(seen_t) :: seen
      integer :: initiation

      do initiation = initiation_persistent, initiation_velocity_update
         block
            type(march_t) :: march

            call make_drop(scene, initiation, .false., march, error)
            if (allocated(error)) return
            start = march%ledger
            call run(scene, n_step, march, seen, error)
            if (allocated(error)) return
            call check_true(error, seen%n_contact > 1, "contact")
            call check_near(error, [march%ledger%momentum, march%ledger%angular], &
               [start%momentum, start%angular], tol, abs(start%momentum(2)), &
               "momenta by treatment " // to_text(initiation))
            call check_near(error, merge(seen%drift, 0.0_wp, initiation == initiation_persistent), &
               0.0_wp, tol, start%total, "energy")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_momenta

   !> Increments are cut until the gap to hold is below the tolerance.
   subroutine test_stand_off(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: total, gap(3)
      real(wp), parameter :: limit = 1.0e-3_wp
      integer :: k, n_cut, n_contact

      call make_drop(scene, initiation_persistent, .true., march, error)
      if (allocated(error)) return
      scene%step(1)%contact%gap_tolerance = limit
      total = march%ledger%total
      n_cut = 0
      n_contact = 0
      do k = 1, n_step
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         n_cut = n_cut + increment%n_cut
         n_contact = n_contact + increment%n_active
         gap = scene%x(2, slave) + march%state%u(2, slave)
         call check_true(error, all(gap <= limit .or. .not. march%state%contacts%is_active), &
            "stand-off")
         call check_near(error, march%state%clock%time, h*real(k, wp), 0.0_wp, 1.0_wp, &
            "on the grid")
         call check_near(error, march%ledger%total, total, tol, total, "energy")
      end do
      call check_true(error, n_cut > 2 .and. n_contact > 0, "cuts " // to_text(n_cut) // &
         ", contacts " // to_text(n_contact))
      call march_free(march)
   end subroutine test_stand_off

   !> One increment from the same state to 1e-9; displacements after all of them, too.
   subroutine test_methods(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march(2)
      type(increment_t) :: increment
      integer :: k, m

      do m = 1, 2
         call make_drop(scene, initiation_persistent, .false., march(m), error)
         if (allocated(error)) return
      end do
      do k = 1, n_step/2
         do m = 1, 2
            scene%step(1)%contact%method = merge(method_null_space, method_saddle_point, m == 1)
            march(m)%newton%correction%method = scene%step(1)%contact%method
            call march_increment(march(m), scene, increment, error)
            if (allocated(error)) return
         end do
         call check_near(error, march(1)%state%u, march(2)%state%u, 1.0e5_wp*eps, 1.0_wp, &
            "displacements in increment " // to_text(k))
         call check_near(error, march(1)%state%contacts%lam, march(2)%state%contacts%lam, &
            1.0e6_wp*eps, maxval(march(1)%state%contacts%lam) + 1.0_wp, &
            "multipliers in increment " // to_text(k))
      end do
      call check_true(error, march(1)%newton%correction%uses_null_space &
         .and. .not. march(2)%newton%correction%uses_null_space, "each by its own method")
      call march_free(march(1))
      call march_free(march(2))
   end subroutine test_methods

   !> Length by 2^10, mass by 2^20, time by 2^5: the same bits up to these powers.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, other
      type(march_t) :: march, scaled
      type(seen_t) :: seen
      real(wp), parameter :: l = 2.0_wp**10, m = 2.0_wp**20, t = 2.0_wp**5

      call make_drop(scene, initiation_persistent, .false., march, error)
      if (allocated(error)) return
      other = scene
      other%x = l*scene%x
      other%v0 = l/t*scene%v0
      other%material(1)%constant(1) = m/(l*t**2)*scene%material(1)%constant(1)
      other%material(1)%density = m/l**3*scene%material(1)%density
      other%section(1)%thickness = l*scene%section(1)%thickness
      other%step(1)%time%h = t*scene%step(1)%time%h
      other%step(1)%time%duration = t*scene%step(1)%time%duration
      call begin(other, scaled, error)
      if (allocated(error)) return
      call run(scene, n_step/2, march, seen, error)
      if (allocated(error)) return
      call check_true(error, seen%n_contact > 1, "contact")
      call run(other, n_step/2, scaled, seen, error)
      if (allocated(error)) return
      call check_near(error, scaled%state%u, l*march%state%u, 0.0_wp, 1.0_wp, "displacements")
      call check_near(error, scaled%state%v, l/t*march%state%v, 0.0_wp, 1.0_wp, "velocities")
      call check_near(error, scaled%ledger%total, m*l**2/t**2*march%ledger%total, 0.0_wp, 1.0_wp, &
         "energy")
      call march_free(march)
      call march_free(scaled)
   end subroutine test_units

end module test_active_set
