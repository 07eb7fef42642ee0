!> What follows from a solved step, beside the set, the motion and the forces that it was solved
!> with: a block thrown aslant, of which contacts slide and stick.
module test_march_commit
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_force, condition_friction, condition_t, most_slips
   use emcon_constraints, only : constraints_dissipated
   use emcon_contact_law, only : loss_friction
   use emcon_errors, only : error_t
   use emcon_flexibility, only : flexibility_free, flexibility_make, flexibility_t
   use emcon_friction, only : friction_missed
   use emcon_friction_limit, only : friction_limit_find, friction_limit_tell
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_march_commit, only : march_commit
   use emcon_nodal_pull, only : nodal_pull_add, nodal_pull_t
   use emcon_rigid_bodies, only : rigid_frame_choose
   use emcon_scene, only : scene_t
   use emcon_stand_off, only : stand_off_add, stand_off_t
   use emcon_state, only : state_t
   use emcon_steps, only : initiation_persistent, load_gravity, load_t
   use emcon_system, only : mass_times
   use emcon_term, only : role_external, role_internal
   use emcon_term_registry, only : terms_stabilization
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_two_blocks, prescribe, shake
   implicit none
   private
   public :: collect_march_commit

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Forces of the size 100 that balance, summed over nodes.
   real(wp), parameter :: tol = 1.0e5_wp*eps
   real(wp), parameter :: h = 0.02_wp
   !> So far to the left the blocks reach.
   real(wp), parameter :: farthest = 5.0_wp

contains

   subroutine collect_march_commit(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a step with friction", test_step), &
         test_case_t("works in statics", test_statics), &
         test_case_t("what is told of a step", test_told), &
         test_case_t("nothing is left of contacts before", test_forgotten), &
         test_case_t("what always holds is no contact", test_permanent), &
         test_case_t("what is told of bodies that nothing holds", test_stabilized), &
         test_case_t("friction above what one contact bears", test_limit), &
         test_case_t("the contact that bears least is named", test_least), &
         test_case_t("impacts that keep a part", test_restitution)]
   end subroutine collect_march_commit

   !> The lower block is clamped at its bottom and driven on its right; both have weight.
   subroutine begin(scene, is_static, march, error, stabilization)
      type(scene_t), intent(out) :: scene
      logical, intent(in) :: is_static
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: stabilization
      type(block_t) :: lower, upper
      type(load_t) :: weight
      integer :: i

      call make_two_blocks(scene, merge(0.0_wp, 0.03_wp, is_static), lower, upper)
      scene%x(1, :) = scene%x(1, :) - (farthest - 2.0_wp)
      scene%pair(1)%interaction%friction = merge(0.05_wp, 0.3_wp, is_static)
      call add_step(scene, is_static, merge(0.25_wp, h, is_static), merge(4, 40, is_static))
      scene%step(1)%contact%initiation = initiation_persistent
      if (present(stabilization)) scene%step(1)%stabilization = stabilization
      call clamp(scene%step(1), [(i, i = 1, 5)])
      call prescribe(scene%step(1), 10, 1, 0.02_wp)
      if (is_static) then
         do i = 14, 16
            call prescribe(scene%step(1), i, 2, -0.05_wp)
            call prescribe(scene%step(1), i, 1, 0.06_wp)
         end do
      end if
      weight%kind = load_gravity
      weight%value = 2.0_wp
      weight%direction(:2) = [0.0_wp, -1.0_wp]
      do i = 1, size(scene%element%kind)
         weight%target = i
         call add_load(scene%step(1), weight)
      end do
      if (.not. is_static) then
         scene%v0(1, 11:) = 0.3_wp
         scene%v0(2, 11:) = -1.0_wp
      end if
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   subroutine test_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(state_t) :: before
      type(ledger_t) :: books
      integer :: k, n_seen

      call begin(scene, .false., march, error)
      if (allocated(error)) return
      n_seen = 0
      do k = 1, 40
         before = march%state
         books = march%ledger
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         if (increment%n_cut > 0) cycle
         call check_equal(error, increment%n_newton, march%active%n_newton, "solved once")
         call check_motion(error, march, before, books)
         associate (response => march%system%response, state => march%state)
            call check_near(error, increment%work_scale, (norm2(state%contact) &
               + norm2(state%reaction) + norm2(response%part(role_external)%force)) &
               *(farthest + maxval(abs(state%u)) + maxval(abs(march%motion%du))), tol, 100.0_wp, &
               "what works are made of")
         end associate
         if (.not. allocated(error)) call check_contacts(error, march, before, increment)
         if (.not. allocated(error)) call check_pairs(error, march)
         if (allocated(error)) return
         if (increment%n_active > 0) n_seen = n_seen + 1
      end do
      call check_true(error, n_seen > 3, "contact")
      call march_free(march)
   end subroutine test_step

   !> u1 = u0 + du, v1 = 2 du/h - v0; loads, reactions and driven inertia work over the way.
   subroutine check_motion(error, march, before, books)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      type(state_t), intent(in) :: before
      type(ledger_t), intent(in) :: books
      real(wp), dimension(2, 16) :: change, inertia, rest
      integer :: i, a

      associate (state => march%state, motion => march%motion)
         call check_near(error, state%u, before%u + motion%du, 4.0_wp*eps, 1.0_wp, "displacements")
         do i = 6, 16
            do a = 1, 2
               if (i == 10 .and. a == 1) cycle
               call check_near(error, state%v(a, i), 2.0_wp*motion%du(a, i)/h - before%v(a, i), &
                  64.0_wp*eps/h, 1.0_wp, "velocities")
            end do
         end do
         ! Balance of all forces over the step, with what supports have to give.
         change = (2.0_wp*(motion%du + motion%offset)/h - 2.0_wp*before%v)/h
         call mass_times(march%system, change, inertia)
         rest = inertia - (march%system%response%part(role_external)%force + state%contact &
            + state%reaction - internal_of(march))
         call check_near(error, rest, 0.0_wp*rest, tol, 100.0_wp, "balance")
         call check_near(error, march%ledger%external_work - books%external_work, &
            sum(march%system%response%part(role_external)%force*motion%du) &
            + sum(state%reaction*motion%du) + sum(inertia*motion%offset), tol, 10.0_wp, "work")
      end associate
   end subroutine check_motion

   !> The mean internal forces over the last step.
   pure function internal_of(march) result(force)
      type(march_t), intent(in) :: march
      real(wp) :: force(2, 16)

      force = march%system%response%part(role_internal)%force
   end function internal_of

   !> What acts, with which forces, how it slid, and what of it is told.
   subroutine check_contacts(error, march, before, increment)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      type(state_t), intent(in) :: before
      type(increment_t), intent(in) :: increment
      type(stand_off_t) :: stand_off
      real(wp), allocatable :: lam(:)
      logical, allocatable :: is_active(:)
      real(wp) :: drag(most_slips), missed, largest
      logical :: acts(3)
      integer :: k

      acts = .false.
      associate (set => march%active%set, now => march%state%contacts, was => before%contacts)
         do k = 1, set%n
            associate (id => set%id(k), item => set%item(k))
               acts(id) = .true.
               call check_near(error, now%lam(id), set%lam(k), 0.0_wp, 1.0_wp, "multiplier")
               drag = condition_friction(item, set%lam(k))
               call check_near(error, [now%drag(1, id), now%slides_along(1, id)], [drag(1), &
                  march%active%friction%law(id)%status%direction(1)], 0.0_wp, 1.0_wp, "friction")
               call check_near(error, [now%slip(1, id), now%slip_path(id)], [was%slip(1, id) &
                  + item%slip(1), was%slip_path(id) + abs(item%slip(1))], 4.0_wp*eps, 1.0_wp, &
                  "slip")
            end associate
         end do
         call check_true(error, all(now%is_active .eqv. acts), "what acts")
         call now%get(2, lam, is_active)
         call check_near(error, lam, now%lam(2:), 0.0_wp, 1.0_wp, "multipliers from there on")
         call check_equal(error, size(is_active), size(now%is_active) - 1, "as many")
         call check_true(error, all(is_active .eqv. now%is_active(2:)), "and what acts")
         do k = 1, 3
            call check_equal(error, now%status(k), merge(merge(2, 1, abs(now%slides_along(1, k)) &
               > 0.0_wp), 0, acts(k)), "how it acts")
            if (acts(k)) cycle
            call check_near(error, [now%lam(k), now%drag(1, k), now%slides_along(1, k)], &
               spread(0.0_wp, 1, 3), 0.0_wp, 1.0_wp, "what does not")
            call check_near(error, [now%slip(1, k), now%slip_path(k)], [was%slip(1, k), &
               was%slip_path(k)], 0.0_wp, 1.0_wp, "nor slides")
         end do
         call check_equal(error, increment%n_active, count(acts), "number of them")
         call stand_off_add(stand_off, march%system, set, h)
         call check_near(error, [increment%stand_off%largest, increment%stand_off%impulse], &
            [stand_off%largest, stand_off%impulse], tol, 1.0_wp, "air")
         call friction_missed(march%active%friction, march%system, set, missed, largest)
         call check_near(error, [increment%law_missed, increment%largest_push], [missed, largest], &
            0.0_wp, 1.0_wp, "laws")
      end associate
   end subroutine check_contacts

   !> Nodal forces are sums over conditions; those of the pair are they.
   subroutine check_pairs(error, march)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      real(wp) :: force(2, 16)
      integer :: k, i

      force = 0.0_wp
      associate (set => march%active%set)
         do k = 1, set%n
            do i = 1, set%item(k)%n_node
               associate (node => set%item(k)%node(i))
                  force(:, node) = force(:, node) + condition_force(set%item(k), set%lam(k), i)
               end associate
            end do
         end do
      end associate
      call check_near(error, march%state%contact, force, tol, 10.0_wp, "forces of contact")
      call check_near(error, march%state%pairs%total(1)%slave(:2), sum(force(:, 11:), 2), tol, &
         10.0_wp, "of the pair")
      call check_near(error, march%state%sums%sum(1)%push(:2), h*sum(force(:, 11:), 2), tol, &
         1.0_wp, "its impulse")
   end subroutine check_pairs

   !> Forces are linear over a step: what the supports do beside contact and weight is half of both
   !> ends, and what viscous forces of STABILIZE take; friction takes what it dissipates.
   subroutine test_statics(error)
      type(error_t), allocatable, intent(out) :: error

      call look_at_statics(error, 0.0_wp)
      if (.not. allocated(error)) call look_at_statics(error, 0.01_wp)
   end subroutine test_statics

   subroutine look_at_statics(error, part)
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in) :: part               !! of the energy that viscous forces take
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(state_t) :: before
      type(ledger_t) :: books
      real(wp) :: contact, friction, internal, viscous, held(2, 16)
      integer :: k, i

      call begin(scene, .true., march, error, part)
      if (allocated(error)) return
      do k = 1, 4
         before = march%state
         books = march%ledger
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         if (increment%n_cut > 0) cycle
         friction = 0.0_wp
         associate (set => march%active%set, state => march%state, du => march%motion%du)
            do i = 1, set%n
               friction = friction + constraints_dissipated(set, i, loss_friction)
            end do
            contact = 0.5_wp*sum((before%contact + state%contact)*du)
            internal = 0.5_wp*sum((before%internal + state%internal)*du)
            call terms_stabilization(march%system%term, viscous, held)
            call check_true(error, (viscous > 0.0_wp) .eqv. part > 0.0_wp, "viscous forces")
            call check_near(error, march%ledger%friction - books%friction, friction, tol, 1.0_wp, &
               "friction")
            call check_near(error, march%ledger%contact_work - books%contact_work, contact &
               + friction, tol, 1.0_wp, "work of contact")
            call check_near(error, march%ledger%external_work - books%external_work, internal &
               - contact + viscous, tol, 10.0_wp, "work")
            call check_near(error, march%ledger%damping - books%damping, viscous, tol, 1.0_wp, &
               "damping")
            call check_near(error, state%internal, internal_of(march) - held, tol, 100.0_wp, &
               "forces of elements")
            call check_near(error, state%v, 0.0_wp*state%v, 0.0_wp, 1.0_wp, "no velocities")
         end associate
         if (allocated(error)) return
      end do
      call check_true(error, march%ledger%friction > 0.0_wp, "it slides")
      call march_free(march)
   end subroutine look_at_statics

   !> A residual above the tolerance, unless nothing was solved; the way that it was solved; guards.
   subroutine test_told(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: before(4) = [0.0_wp, 0.5_wp, 0.0_wp, 0.0_wp]
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: k
      logical :: is_told

      call begin(scene, .false., march, error)
      do while (increment%n_active == 0)
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
      end do
      do k = 1, 4
         increment = increment_t(unconverged=before(k), n_augmentation=k)
         march%active%penalty%n_augmentation = 3
         march%newton%convergence%last = merge(1.0e-12_wp, 0.25_wp, k == 3)
         march%newton%is_idle = k == 4
         march%newton%correction%fell_back = k == 1
         march%system%contact(1)%contact%slack = merge(0.05_wp, 0.0_wp, k == 2)
         call march_commit(march, scene, h, increment, error)
         if (allocated(error)) return
         is_told = .false.
         if (increment%notes%n > 0) is_told = index(increment%notes%item(increment%notes%n)%text, &
            "a relative residual of 0.25 is accepted") == 1
         call check_true(error, is_told .eqv. k < 3, "told " // to_text(k))
         call check_equal(error, increment%n_augmentation, max(k, 3), "the most augmentations")
         call check_near(error, increment%unconverged, max(before(k), merge(0.25_wp, 0.0_wp, &
            k < 3)), 0.0_wp, 1.0_wp, "accepted")
         associate (reached => march%newton%convergence)
            call check_near(error, increment%residual, reached%history(:reached%n_history), &
               0.0_wp, 1.0_wp, "all residuals")
         end associate
         call check_true(error, increment%is_guarded .eqv. k == 2, "guards")
         call check_equal(error, increment%notes%n, merge(2, merge(1, 0, k == 2), k == 1), "notes")
      end do
      call march_free(march)
   end subroutine test_told

   !> Whatever the state has of contacts before the step: what acts has that of the step, all else
   !> nothing, but for how far it has slid.
   subroutine test_forgotten(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(nodal_pull_t) :: pull
      real(wp) :: expected(3)
      integer :: k

      call begin(scene, .false., march, error)
      do k = 1, 40
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
         if (any(increment%n_active == [1, 2])) exit
      end do
      if (allocated(error)) return
      associate (now => march%state%contacts, set => march%active%set)
         now%is_active = .true.
         now%lam = 7.0_wp
         now%closure = 7.0_wp
         now%drag = 7.0_wp
         now%slides_along = 7.0_wp
         now%slip = 7.0_wp
         now%slip_path = 7.0_wp
         ! As if gaps were integrals, of one node that is pulled.
         set%item(:set%n)%is_mean = .true.
         increment = increment_t()
         call march_commit(march, scene, h, increment, error)
         if (allocated(error)) return
         expected = 0.0_wp
         expected(set%id(:set%n)) = set%lam(:set%n)
         call check_true(error, any(set%n == [1, 2]) .and. all(abs(set%lam(:set%n)) > 0.0_wp), &
            "some act")
         call check_near(error, now%lam, expected, 0.0_wp, 1.0_wp, "multipliers")
         call check_true(error, all(now%is_active .eqv. abs(expected) > 0.0_wp), "what acts")
         call check_near(error, now%closure, 0.0_wp*expected, 0.0_wp, 1.0_wp, "nothing gives way")
         where (now%is_active) expected = now%drag(1, :)
         call check_near(error, now%drag(1, :), expected, 0.0_wp, 1.0_wp, "friction")
         where (now%is_active) expected = now%slides_along(1, :)
         call check_near(error, now%slides_along(1, :), expected, 0.0_wp, 1.0_wp, "directions")
         call check_true(error, all(abs(now%slides_along(1, :)) <= 1.0_wp), "they are directions")
         where (now%is_active) expected = now%slip(1, :) - 7.0_wp
         call check_near(error, now%slip(1, :), 7.0_wp + expected, tol, 1.0_wp, "slips")
         call check_true(error, all(now%slip_path >= 7.0_wp), "ways")
         call nodal_pull_add(pull, set, 16)
         call check_true(error, pull%force > 0.0_wp, "nodes are pushed")
         call check_near(error, [increment%nodal_pull%pull, increment%nodal_pull%force], &
            [pull%pull, pull%force], 0.0_wp, 1.0_wp, "at single nodes")
      end associate
      call march_free(march)
   end subroutine test_forgotten

   !> A rigid block falls on another: forces of contact are those of gaps, not those that keep it
   !> rigid, and all of the set act.
   subroutine test_permanent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: force(2, 16)
      integer :: k, i, j, n_seen

      call make_two_blocks(scene, 0.03_wp, lower, upper)
      call add_step(scene, .false., h, 8)
      call clamp(scene%step(1), [(i, i = 1, 5)])
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "UPPER"
         body%reference = 11
         body%element = upper%elements_before + [1, 2]
         body%node = [(i, i = 11, 16)]
         call rigid_frame_choose(scene%x, body%node, body%reference, body%frame)
      end associate
      scene%v0(2, 11:) = -1.0_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      n_seen = 0
      do k = 1, 8
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         force = 0.0_wp
         associate (set => march%active%set)
            call check_true(error, set%n_permanent > 0, "the body is rigid")
            call check_true(error, all(march%active%is_active(set%id(:set%n))), "what acts")
            do i = set%n_permanent + 1, set%n
               do j = 1, set%item(i)%n_node
                  associate (node => set%item(i)%node(j))
                     force(:, node) = force(:, node) + condition_force(set%item(i), set%lam(i), j)
                  end associate
               end do
            end do
            if (set%n > set%n_permanent) n_seen = n_seen + 1
         end associate
         call check_near(error, march%state%contact, force, tol, 10.0_wp, "forces of contact")
      end do
      call check_true(error, n_seen > 0, "contact")
      call march_free(march)
   end subroutine test_permanent

   !> The lower block moves as nothing holds it: what the balance leaves over does work; told once
   !> of each body, and of gaps that were closed where contact acts.
   subroutine test_stabilized(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: who(4) = ["A", "A", "B", "B"], way(4) = ["x", "y", "y", "x"]
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      character(len=:), allocatable :: told
      real(wp) :: force(2, 16), work
      integer :: k

      call begin(scene, .false., march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call shake(force, 1.0_wp)
      associate (support => march%active%support, system => march%system, du => march%motion%du)
         support%is_needed = .true.
         support%is_loose = [.true., .false.]
         support%brought = [0.5_wp, 0.25_wp, 0.0_wp]
         support%brought_text = "body of C"
         work = sum(force(:, :10)*du(:, :10), mask=system%space%numbering%unknown(:, :10) > 0)
         do k = 1, 4
            support%text = "body of " // who(k) // " free to move in " // way(k)
            march%active%is_active = [.false., k == 4, .true.]
            system%response%residual = force + march%newton%contact
            increment = increment_t()
            call march_commit(march, scene, h, increment, error)
            if (allocated(error)) return
            call check_near(error, march%ledger%stabilization, -k*work, tol, 1.0_wp, "work")
            call check_equal(error, increment%warnings%n, merge(1, 0, k /= 2), "told " &
               // to_text(k))
            if (allocated(error)) return
            if (k == 2) cycle
            told = "body of C; no load does work on it: moved over a gap of 0.25 onto"
            if (k < 4) told = support%text // "; no load does work on it: the smallest motion"
            call check_true(error, index(increment%warnings%item(1)%text, told) == 1, told)
         end do
      end associate
      call check_true(error, abs(work) > 1.0e3_wp*tol, "it moves")
      call march_free(march)
   end subroutine test_stabilized

   !> Told once, of pairs whose coefficient is above their limit: far above it, or below.
   subroutine test_limit(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu(2) = [0.3_wp, 1.0e4_wp]
      type(scene_t) :: scene
      integer :: k

      do k = 1, 2
         if (.not. allocated(error)) call look_at()
      end do

   contains

      subroutine look_at()
         type(march_t) :: march
         type(increment_t) :: increment
         integer :: i, j, n_told, n_touch

         call begin(scene, .false., march, error)
         if (allocated(error)) return
         call march_free(march)
         march = march_t()
         scene%pair(1)%interaction%friction = mu(k)
         call march_init(march, scene, error)
         if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
         if (allocated(error)) return
         n_told = 0
         n_touch = 0
         do i = 1, 8
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            if (increment%n_active > 0) n_touch = n_touch + 1
            do j = 1, increment%notes%n
               if (index(increment%notes%item(j)%text, "may have several solutions") > 0) n_told &
                  = n_told + 1
            end do
         end do
         call check_true(error, n_touch > 1, "contact")
         call check_equal(error, n_told, k - 1, "told")
         call march_free(march)
      end subroutine look_at

   end subroutine test_limit

   !> Of those that rub it is named, whichever is pushed most.
   subroutine test_least(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(flexibility_t) :: flexibility
      real(wp) :: limit(3)
      character(len=:), allocatable :: told
      integer :: i, k, least

      call begin(scene, .false., march, error)
      do while (march%active%set%n < 2)
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
      end do
      if (allocated(error)) return
      associate (set => march%active%set, friction => march%active%friction)
         call flexibility_make(flexibility, march%system, set, march%newton%correction, error)
         if (.not. allocated(error)) call friction_limit_find(march%system, set, &
            [(k, k = 1, set%n)], flexibility, limit(:set%n), error)
         call flexibility_free(flexibility)
         if (allocated(error)) return
         least = minloc(limit(:set%n), 1)
         call check_true(error, maxval(limit(:set%n)) > 1.01_wp*limit(least), "unlike")
         friction%law%mu = 2.0_wp*maxval(limit(:set%n))
         do i = 1, set%n
            set%lam(:set%n) = 1.0_wp
            set%lam(i) = 2.0_wp
            friction%knows_limit = .false.
            increment = increment_t()
            call friction_limit_tell(march, scene, increment, error)
            if (allocated(error)) return
            told = "the contact of slave node " // to_text(scene%node%label( &
               march%system%contact(1)%contact%node(set%id(least)))) // " may have"
            call check_equal(error, increment%notes%n, 1, "told")
            if (allocated(error)) return
            call check_true(error, index(increment%notes%item(1)%text, told) > 0, told // ": " &
               // increment%notes%item(1)%text)
         end do
         call friction_limit_tell(march, scene, increment, error)
         call check_equal(error, increment%notes%n, 1, "told once")
      end associate
      call march_free(march)
   end subroutine test_least

   !> Of two free blocks: each gap that was held and opens keeps a part of its rate; what that takes
   !> is told, momenta stay.
   subroutine test_restitution(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: kept = 0.25_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(ledger_t) :: start
      real(wp) :: before, rate, rebound
      integer :: k, i, n_impact

      call make_two_blocks(scene, 0.03_wp, lower, upper)
      scene%pair(1)%interaction%restitution = kept
      call add_step(scene, .false., h, 40)
      scene%step(1)%contact%initiation = initiation_persistent
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      start = march%ledger
      n_impact = 0
      do k = 1, 40
         before = march%ledger%restitution
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         associate (ledger => march%ledger, set => march%active%set, motion => march%motion)
            call check_near(error, ledger%total + ledger%restitution, start%total, tol, &
               start%total, "energy")
            call check_near(error, [ledger%momentum, ledger%angular], [start%momentum, &
               start%angular], tol, abs(start%momentum(2)), "momenta")
            call check_true(error, ledger%restitution >= before, "never given back")
            call check_true(error, allocated(march%state%pairs%jump) .eqv. &
               ledger%restitution > before, "a jump where it is taken, and no longer")
            if (increment%n_cut > 0) cycle
            do i = 1, set%n
               rate = rate_of(set%item(i), march%state%v)
               rebound = rate_of(set%item(i), 2.0_wp*motion%du/h - motion%v0)
               call check_near(error, rate, kept*rebound, tol, 1.0_wp, "rate")
               if (rebound > 0.01_wp) n_impact = n_impact + 1
            end do
         end associate
         if (allocated(error)) return
      end do
      call check_true(error, n_impact > 2 .and. march%ledger%restitution > 0.01_wp, "impacts")
      call march_free(march)
   end subroutine test_restitution

   !> Of the gap of a condition.
   pure real(wp) function rate_of(item, v)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: v(:, :)

      rate_of = sum(item%c(:, :item%n_node)*v(:, item%node(:item%n_node)))
   end function rate_of

end module test_march_commit
