!> The velocity jump that gives back the energy of closing contacts.
module test_velocity_update
   use check, only : check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_select
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of
   use emcon_scene, only : scene_t
   use emcon_system, only : mass_times, system_begin_step, system_init, system_t
   use emcon_velocity_mass, only : velocity_update_free, velocity_update_t
   use emcon_velocity_update, only : velocity_update_apply
   use emcon_steps, only : method_null_space, method_saddle_point
   use linear_scenes, only : add_equation
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks, shake
   implicit none
   private
   public :: collect_velocity_update

   real(wp), parameter :: tol = 450.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_velocity_update(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("restores while bodies part", test_parting), &
         test_case_t("restores while bodies approach", test_approaching), &
         test_case_t("by null space and multipliers, with and without links", test_links), &
         test_case_t("no jump without a loss", test_no_loss), &
         test_case_t("no jump without contact", test_no_contact), &
         test_case_t("no jump of what is prescribed, or has no mass", test_prescribed), &
         test_case_t("gaps that change by round-off have lost nothing", test_noise)]
   end subroutine collect_velocity_update

   !> A step that closes the gaps of 1/8 under multipliers `lam`, then the jump on top of random
   !> velocities and a relative one of `speed`, > 0: parting.
   subroutine jump(lam, speed, gain, lost, change, error, is_held, method, is_linked, has_mass)
      real(wp), intent(in) :: lam, speed
      real(wp), intent(out) :: gain              !! of kinetic energy
      real(wp), intent(out) :: lost              !! work of the multipliers, taken from the bodies
      real(wp), intent(out) :: change(3)         !! of px, py, lz
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_held   !! nodes of both surfaces are prescribed
      integer, intent(in), optional :: method    !! of contact
      logical, intent(in), optional :: is_linked !! with it: the upper corners move alike along x
      logical, intent(in), optional :: has_mass  !! present: nothing has
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      integer :: i
      real(wp), allocatable :: u0(:, :), v0(:, :), v1(:, :), du(:, :), p0(:, :), p1(:, :), x1(:, :)
      real(wp) :: restored
      logical :: has_root

      call make_two_blocks(scene, 0.125_wp, lower, upper)
      call add_step(scene, .false., 0.1_wp, 1)
      if (present(is_held)) call clamp(scene%step(1), [(i, i = 6, 13)])
      if (present(has_mass)) scene%material(1)%density = 0.0_wp
      if (present(method)) then
         scene%step(1)%contact%method = method
         call add_equation(scene, [14, 16], [1, 1], [1.0_wp, -1.0_wp])
         if (.not. is_linked) deallocate(scene%equation)
         if (.not. is_linked) allocate(scene%equation(0))
      end if
      call system_init(system, scene, error)
      if (allocated(error)) return
      call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      allocate(u0, v0, v1, du, p0, p1, x1, source=0.0_wp*scene%x)
      call shake(v0, 0.1_wp)
      v0(2, 11:) = v0(2, 11:) + speed
      if (present(method)) v0(1, 16) = v0(1, 14)
      du(2, 11:) = -0.125_wp
      call system%contact(1)%contact%begin_step(scene%x, u0, du)
      call constraints_select(set, [1, 2, 3])
      set%lam = lam
      call constraints_evaluate(set, system, motion_of(evaluation_t(), scene%x, u0, du))
      lost = -sum(set%lam*set%item%dgap)
      v1 = v0
      call velocity_update_apply(update, system, set, v1, restored, has_root, error)
      if (allocated(error)) return
      call mass_times(system, v0, p0)
      call mass_times(system, v1, p1)
      gain = 0.5_wp*(sum(v1*p1) - sum(v0*p0))
      x1 = scene%x + du
      change = [sum(p1 - p0, dim=2), sum(x1(1, :)*(p1(2, :) - p0(2, :)) &
         - x1(2, :)*(p1(1, :) - p0(1, :)))]
      call velocity_update_free(update)
      if (present(method)) call check_true(error, .not. is_linked .or. abs(v1(1, 16) - v1(1, 14)) &
         <= tol, "nodes that are linked move alike")
      call check_near(error, gain, restored, tol, 10.0_wp, "gain and what is said of it")
      call check_true(error, has_root .neqv. (present(is_held) .or. present(has_mass)), &
         "a way to give it back")
      if (present(has_mass)) call check_near(error, v1, v0, 0.0_wp, 1.0_wp, "no jump")
   end subroutine jump

   subroutine test_parting(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: gain, lost, change(3)

      call jump(1.0_wp, 2.0_wp, gain, lost, change, error)
      if (allocated(error)) return
      call check_near(error, lost, 0.375_wp, tol, 1.0_wp, "three multipliers of 1 over 1/8")
      call check_near(error, gain, lost, tol, 10.0_wp, "energy")
      call check_near(error, change, [0.0_wp, 0.0_wp, 0.0_wp], tol, 10.0_wp, "momenta")
   end subroutine test_parting

   !> Energy and momentum are those of any jump.
   subroutine test_links(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: method(2) = [method_null_space, method_saddle_point]
      real(wp) :: gain, lost, change(3)
      integer :: k, l

      do k = 1, 2
         do l = 0, 1
            call jump(1.0_wp, 2.0_wp, gain, lost, change, error, method=method(k), &
               is_linked=l == 1)
            if (allocated(error)) return
            call check_near(error, gain, lost, tol, 10.0_wp, "energy")
            call check_near(error, change(:2), [0.0_wp, 0.0_wp], tol, 10.0_wp, "momenta")
         end do
      end do
   end subroutine test_links

   subroutine test_approaching(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: gain, lost, change(3)

      call jump(1.0_wp, -2.0_wp, gain, lost, change, error)
      if (allocated(error)) return
      call check_near(error, gain, lost, tol, 10.0_wp, "energy")
      call check_near(error, change, [0.0_wp, 0.0_wp, 0.0_wp], tol, 10.0_wp, "momenta")
   end subroutine test_approaching

   !> Multipliers that pull have taken nothing.
   subroutine test_no_loss(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: gain, lost, change(3)

      call jump(-1.0_wp, 2.0_wp, gain, lost, change, error)
      if (allocated(error)) return
      call check_true(error, lost < 0.0_wp, "the bodies have gained")
      call check_near(error, gain, 0.0_wp, 0.0_wp, 1.0_wp, "energy")
   end subroutine test_no_loss

   subroutine test_no_contact(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: gain, lost, change(3)

      call jump(0.0_wp, 2.0_wp, gain, lost, change, error)
      if (allocated(error)) return
      call check_near(error, [gain, change], spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, "no jump")
   end subroutine test_no_contact

   subroutine test_prescribed(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: gain, lost, change(3)

      call jump(1.0_wp, 2.0_wp, gain, lost, change, error, is_held=.true.)
      if (allocated(error)) return
      call check_near(error, [gain, change], spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, "no jump")
      call jump(1.0_wp, 2.0_wp, gain, lost, change, error, has_mass=.false.)
   end subroutine test_prescribed

   !> Edges of the length 2, of which one contact pulls: 64 epsilon of them, by the sizes of forces.
   subroutine test_noise(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: lam(3) = [1.0_wp, -0.5_wp, 2.0_wp], part(2) = [0.75_wp, 1.5_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      real(wp), allocatable :: u0(:, :), v(:, :), du(:, :)
      real(wp) :: restored, way
      logical :: has_root
      integer :: k

      call make_two_blocks(scene, 0.125_wp, lower, upper)
      scene%x = 2.0_wp*scene%x
      call add_step(scene, .false., 0.1_wp, 1)
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      allocate(u0, v, du, source=0.0_wp*scene%x)
      do k = 1, 2
         way = part(k)*64.0_wp*epsilon(1.0_wp)*2.0_wp*sum(abs(lam))/sum(lam)
         du(2, 11:) = -way
         call system%contact(1)%contact%begin_step(scene%x, u0, du)
         call constraints_select(set, [1, 2, 3])
         set%lam = lam
         call constraints_evaluate(set, system, motion_of(evaluation_t(), scene%x, u0, du))
         v = 0.0_wp
         call velocity_update_apply(update, system, set, v, restored, has_root, error)
         if (allocated(error)) return
         call check_near(error, restored, merge(0.0_wp, sum(lam)*way, k == 1), 0.01_wp, &
            sum(lam)*way, "what is given back")
         call check_true(error, maxval(abs(v)) > 0.0_wp .eqv. k == 2, "a jump")
         call check_true(error, has_root, "nothing is left over")
      end do
      call velocity_update_free(update)
   end subroutine test_noise

end module test_velocity_update
