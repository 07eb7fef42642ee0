!> What pairs are told to transmit is what changes the momenta of the bodies, in every step: for all
!> ways in which contact begins and all formulations, with friction, restitution and penalties.
module test_march_impulse
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : condition_friction, condition_rate, most_slips
   use emcon_errors, only : error_t
   use emcon_interactions, only : formulation_mortar, formulation_nts, formulation_segment
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : initiation_massless, initiation_persistent, &
      method_augmented_lagrange, method_penalty
   use emcon_system, only : mass_times, system_t
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, make_two_blocks
   implicit none
   private
   public :: collect_march_impulse

   !> Round-off of the forces of a step, which are of the size 100, by its duration.
   real(wp), parameter :: tol = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.02_wp
   integer, parameter :: n_step = 30
   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar]

contains

   subroutine collect_march_impulse(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("ways in which contact begins", test_initiations), &
         test_case_t("friction and restitution", test_losses), &
         test_case_t("penalties, implicit and explicit", test_penalties)]
   end subroutine collect_march_impulse

   !> A block thrown aslant on another one, turning; both are free.
   subroutine make_throw(scene, formulation)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: formulation
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 0.0927_wp, lower, upper)
      scene%pair(1)%formulation = formulation
      call add_step(scene, .false., h, n_step)
      scene%v0(1, 11:) = 0.3_wp - 0.2_wp*scene%x(2, 11:)
      scene%v0(2, 11:) = -1.0_wp + 0.2_wp*scene%x(1, 11:)
   end subroutine make_throw

   subroutine test_initiations(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k, initiation

      do k = 1, size(formulations)
         do initiation = initiation_persistent, initiation_massless
            call make_throw(scene, formulations(k))
            scene%step(1)%contact%initiation = initiation
            call follow(scene, "formulation " // to_text(k) // ", initiation " &
               // to_text(initiation), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_initiations

   subroutine test_losses(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k, kind

      do k = 1, size(formulations)
         do kind = 1, 3
            call make_throw(scene, formulations(k))
            if (kind /= 2) scene%pair(1)%interaction%friction = 0.2_wp
            if (kind >= 2) scene%pair(1)%interaction%restitution = 0.4_wp
            call follow(scene, "formulation " // to_text(k) // ", losses " // to_text(kind), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_losses

   subroutine test_penalties(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k, kind

      do k = 1, size(formulations)
         do kind = 1, 3
            call make_throw(scene, formulations(k))
            scene%step(1)%contact%method = method_penalty
            scene%step(1)%contact%penalty%stiffness = 500.0_wp
            if (kind == 2) scene%step(1)%contact%method = method_augmented_lagrange
            if (kind == 3) then
               scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
               scene%step(1)%time%h = 0.125_wp*h
            end if
            call follow(scene, "formulation " // to_text(k) // ", penalty " // to_text(kind), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_penalties

   !> Step by step: the changes of both blocks' momenta, what was summed up from the start, and the
   !> energy that contact makes or takes.
   subroutine follow(scene, what, error)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: before(3, 2), now(3, 2), first(3, 2), total
      integer :: i, k, n_pushed

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      n_pushed = 0
      total = march%ledger%total
      first = momenta_of(march%system, scene%x + march%state%u, march%state%v)
      before = first
      do k = 1, nint(scene%step(1)%time%duration/scene%step(1)%time%h)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         now = momenta_of(march%system, scene%x + march%state%u, march%state%v)
         ! Explicit penalties push at both ends of a step: what is told is the push at its end.
         if (increment%n_cut == 0 .and. .not. scene%step(1)%scheme%is_explicit) then
            associate (total => march%state%pairs%total(1), size => scene%step(1)%time%h)
               call check_near(error, now(:, 2) - before(:, 2), size*total%slave(:3), tol, &
                  2.0_wp, "slave side, " // what)
               call check_near(error, now(:, 1) - before(:, 1), size*total%master(:3), tol, &
                  2.0_wp, "master side, " // what)
            end associate
         end if
         associate (sum => march%state%sums%sum(1))
            call check_near(error, now(:2, 2) - first(:2, 2), sum%impulse(:2), tol, 2.0_wp, &
               "impulse, " // what)
         end associate
         associate (ledger => march%ledger)
            if (.not. scene%step(1)%scheme%is_explicit) call check_near(error, ledger%total &
               - ledger%contact_work + ledger%friction, total, tol, total, "energy, " // what)
         end associate
         call check_massless(error, march, scene%step(1)%time%h, what)
         if (increment%n_cut == 0 .and. scene%pair(1)%interaction%restitution < 1.0_wp) then
            call check_cone(error, march, scene%pair(1)%interaction%friction, what)
         end if
         do i = 1, increment%notes%n
            call check_true(error, index(increment%notes%item(i)%text, "saddle point") == 0, &
               "by the null space, " // what)
            call check_true(error, index(increment%notes%item(i)%text, "rebound fully") == 0, &
               "a part is kept, " // what)
         end do
         if (allocated(error)) return
         if (norm2(now(:2, 2) - before(:2, 2)) > 1.0e-3_wp) n_pushed = n_pushed + 1
         before = now
      end do
      call check_true(error, n_pushed > 2, "contact, " // what)
      call march_free(march)
   end subroutine follow

   !> What has no mass moves as its displacement says, but for a jump where it was balanced anew.
   subroutine check_massless(error, march, h, what)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      real(wp), intent(in) :: h                  !! of an increment that was not cut [T]
      character(len=*), intent(in) :: what
      integer :: i

      if (.not. march%layer%is_on .or. march%layer%is_settled) return
      do i = 1, size(march%layer%is_massless)
         if (.not. march%layer%is_massless(i)) cycle
         if (.not. any(abs(march%motion%du(:, i)) > 0.0_wp)) cycle
         call check_near(error, h*march%state%v(:, i), march%motion%du(:, i), tol, h, &
            "velocities without mass, " // what)
      end do
   end subroutine check_massless

   !> Impulses of the step and of the jump at its end together: friction is in the cone of all, and
   !> within it no jump moves along the surface; but where a jump is one along normals alone.
   subroutine check_cone(error, march, mu, what)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      real(wp), intent(in) :: mu
      character(len=*), intent(in) :: what
      real(wp) :: push, drag(most_slips), change(2, 16)
      integer :: k

      change = march%state%v - (2.0_wp/h*march%motion%du - march%motion%v0)

      associate (set => march%active%set, jump => march%end_state%jump)
         if (size(jump) > 0 .and. .not. any(abs(jump%drag(1)) > 0.0_wp)) return
         do k = set%n_permanent + 1, set%n
            push = h*set%lam(k)*set%item(k)%normal + sum(jump%lam, jump%id == set%id(k)) &
               *set%item(k)%normal
            drag = h*condition_friction(set%item(k), set%lam(k))
            drag(1) = drag(1) + sum(jump%drag(1), jump%id == set%id(k))
            call check_true(error, push >= -tol, "pushes, " // what)
            call check_true(error, abs(drag(1)) <= mu*push + tol, "friction, " // what)
            if (abs(drag(1)) < mu*push - sqrt(tol)) call check_near(error, &
               condition_rate(set%item(k), change, 1), 0.0_wp, tol, 2.0_wp, "sticks, " // what)
         end do
      end associate
   end subroutine check_cone

   !> (px, py, moment about the origin) of the lower and the upper block.
   function momenta_of(system, place, v) result(momenta)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: place(:, :), v(:, :)
      real(wp) :: momenta(3, 2), p(2, size(v, 2))
      integer :: k

      call mass_times(system, v, p)
      do k = 1, 2
         associate (from => merge(1, 11, k == 1), to => merge(10, 16, k == 1))
            momenta(:, k) = [sum(p(:, from:to), 2), sum(place(1, from:to)*p(2, from:to) &
               - place(2, from:to)*p(1, from:to))]
         end associate
      end do
   end function momenta_of

end module test_march_impulse
