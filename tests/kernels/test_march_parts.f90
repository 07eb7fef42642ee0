!> Increments in parts: which of them are tried, told and counted, where they end, and what an
!> interrupt leaves.
module test_march_parts
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_active_set, only : step_cycling, step_diverged, step_loose, step_not_held, &
      step_overlaps, step_passes_event, step_refused, step_rough, step_singular, step_stands_off, &
      step_strikes, step_too_far, step_unbalanced
   use emcon_amplitudes, only : amplitude_t
   use emcon_csr, only : csr_from_elements
   use emcon_errors, only : err_analysis, err_interrupt, error_t
   use emcon_evaluation, only : instant_t
   use emcon_host_force, only : force_response_t, host_force_t, host_outside
   use emcon_interactions, only : formulation_mortar, formulation_nts
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_resume, march_watch
   use emcon_march_parts, only : march_reason
   use emcon_march_types, only : march_t, watcher_t
   use emcon_scene, only : scene_t
   use emcon_pair_sums, only : pair_sum_t
   use emcon_phases, only : phase_enter, phase_vectors
   use emcon_state, only : state_t
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_t
   use emcon_stepper_user, only : stepper_give_force
   use emcon_steps, only : initiation_massless, initiation_persistent, initiation_velocity_update, &
      method_penalty
   use emcon_scheme_registry, only : scheme_row
   use emcon_text, only : to_text
   use given_scenes, only : given_eps, make_line, open_given
   use one_element, only : read_one
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks, prescribe
   implicit none
   private
   public :: collect_march_parts

   !> Energies and forces of the size 10 and 100, after two dozen steps.
   real(wp), parameter :: tol = 1.0e5_wp*given_eps
   !> How blocks touch: NTS and friction, mortar and velocity updates, impacts that keep a part,
   !> penalties, in statics, in explicit steps, without mass.
   integer, parameter :: n_kind = 7, kind_static = 5, kind_explicit = 6
   !> The way that a node is driven over all increments.
   real(wp), parameter :: drive = 0.02_wp

   !> No force, but a node may go past the place `wall` in ways of no more than `longest` only.
   type, extends(host_force_t) :: gate_t
      integer :: node = 1
      real(wp) :: wall = 0.0_wp, longest = 0.0_wp
      logical :: is_at_rest = .false.            !! ways are from where it was asked last
      real(wp) :: last = 0.0_wp
   contains
      procedure :: respond => gate_respond
   end type gate_t

   type, extends(watcher_t) :: writer_t
      integer :: n = 0
      integer :: increment(20) = 0, part(20) = 0
      real(wp) :: time(20) = 0.0_wp, least(20) = 0.0_wp
   contains
      procedure :: tell => writer_tell
   end type writer_t

contains

   subroutine collect_march_parts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("halves, and back on the grid", test_halves), &
         test_case_t("no part is small enough", test_none), &
         test_case_t("too many parts", test_crawl), &
         test_case_t("what is told where statics end", test_end), &
         test_case_t("an interrupt leaves the increment before", test_interrupt), &
         test_case_t("two halves are two increments", test_pieces), &
         test_case_t("what fails at which nodes", test_reasons), &
         test_case_t("each reason in its words", test_words), &
         test_case_t("elements that keep motions without strain are named", test_strainless)]
   end subroutine collect_march_parts

   !> Nodes whose contacts change more than once, and those that go too far, are named; where no
   !> smaller increment is left the user is told what to do.
   subroutine test_reasons(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: status(2) = [step_cycling, step_too_far]
      character(len=*), parameter :: told(2) = [character(len=53) :: &
         "does not converge: its result changes from try to try", &
         "slides too far for one increment"]
      type(stepper_t) :: stepper
      character(len=:), allocatable :: text
      integer :: i, k

      call open_thrown(stepper, 1, 0.25_wp, 4, 1.0_wp, error)
      if (allocated(error)) return
      associate (march => stepper%march, scene => stepper%scene)
         do k = 1, 3
            march%active%rules%may_cut = k == 1
            do i = 1, size(status)
               march%active%candidates%n_change = 0
               march%active%candidates%n_change(2) = merge(0, merge(3, 1, k == 1), k == 3)
               march%active%candidates%n_change(1) = merge(1, 0, k == 1)
               march%active%candidates%is_blamed = .false.
               march%active%candidates%is_blamed(2) = k < 3
               call march_reason(march, scene, status(i), text)
               call check_true(error, (index(text, trim(told(i))) > 0 .and. index(text, &
                  "slave nodes " // to_text(scene%node%label(march%system%contact(1)%contact &
                  %node(2)))) > 0) .eqv. k < 3, text)
               call check_true(error, index(text, to_text(scene%node%label(march%system &
                  %contact(1)%contact%node(1)))) == 0, "one node: " // text)
               call check_true(error, (index(text, "; allow for smaller") > 0) .eqv. &
                  (k == 2 .or. (k == 3 .and. i == 1)), "what to do: " // text)
            end do
         end do
         ! A rigid wall is no slave, and has no faces.
         march%active%candidates%is_blamed(2) = .true.
         march%active%n_stale = huge(i)
         do k = 1, 2
            if (k == 2) allocate(scene%surface(scene%pair(1)%master)%wall)
            call march_reason(march, scene, step_too_far, text)
            call check_true(error, index(text, "other faces") > 0 .eqv. k == 1, text)
            call check_true(error, index(text, "be the slave") > 0 .eqv. k == 1, text)
            call check_true(error, index(text, "the wall") > 0 .eqv. k == 2, text)
         end do
      end associate
      call stepper_close(stepper)
   end subroutine test_reasons

   !> Every status by itself, in dynamics and in statics.
   subroutine test_words(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: status(11) = [step_refused, step_diverged, step_singular, &
         step_stands_off, step_overlaps, step_unbalanced, step_rough, step_strikes, step_loose, &
         step_passes_event, 99]
      character(len=*), parameter :: told(11) = [character(len=90) :: "it is refused", &
         "Newton's method does not converge (relative residual 0.25 after 7 iterations)", &
         "the system is singular", "a contact would act across a gap larger than GAP TOLERANCE", &
         "bodies would overlap where no contact acts", &
         "nodes without mass have no equilibrium where contacts open or close", &
         "the error is 0.5 times TOLERANCE", &
         "contact begins or ends: the error is 0.5 times TOLERANCE", &
         "gaps do not close to TOLERANCE of *CONSTRAINT METHOD in ", &
         "contact begins or ends in it", "reason 99"]
      type(stepper_t) :: stepper
      character(len=:), allocatable :: text, expected
      integer :: i, k

      do k = 1, kind_static, kind_static - 1
         call open_thrown(stepper, k, 0.1_wp, 4, 1.0_wp, error)
         if (allocated(error)) return
         associate (march => stepper%march, reached => stepper%march%newton%convergence)
            march%system%response%refusal = "it is refused"
            reached%history(2) = 0.25_wp
            reached%n_history = 2
            reached%n_iteration = 7
            march%step_check%ratio = 0.5_wp
            march%motion%evaluation = march%scheme%evaluation(instant_t(), 0.1_wp)
            do i = 1, size(status)
               call march_reason(march, stepper%scene, status(i), text)
               expected = trim(told(i))
               if (status(i) == step_loose) expected = told(i)(:56) // "50 augmentations; give a " &
                  // "larger FACTOR"
               if (status(i) == step_rough .and. k == kind_static) expected = "it snaps " &
                  // "through: the work of the increment differs by 50 % from the energy that " // &
                  "the " &
                  // "elements store"
               call check_equal(error, text, expected, "status " // to_text(status(i)))
            end do
            march%step_check%ratio = -1.0_wp
            if (k == kind_static) then
               call march_reason(march, stepper%scene, step_rough, text)
               call check_equal(error, text, "it snaps through: the equilibrium that was " // &
                  "found is not stable", &
                  "statics")
            end if
            march%active%support%text = "body A"
            do i = 0, 1
               march%active%support%is_pushed = i == 1
               call march_reason(march, stepper%scene, step_not_held, text)
               expected = "nothing resists a motion: body A"
               if (i == 0) expected = expected // "; no load does work on it; add *BOUNDARY " // &
                  "conditions, or take the smallest such motion by *CONTACT CONTROLS, STABILIZE"
               if (i == 1) expected = expected // "; add *BOUNDARY conditions"
               call check_equal(error, text, expected, "not held")
            end do
         end associate
         call stepper_close(stepper)
         stepper = stepper_t()
      end do
   end subroutine test_words

   !> Four points of three strains are fewer than the motions of eight nodes that are not rigid.
   subroutine test_strainless(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: name(2) = ["CPE8 ", "CPE8R"]
      type(stepper_t) :: stepper
      character(len=:), allocatable :: text, expected
      integer :: k

      do k = 1, 2
         call read_one(trim(name(k)), 3, "NONLINEAR", stepper, error)
         if (.not. allocated(error)) call stepper_build(stepper, error)
         if (allocated(error)) return
         call march_reason(stepper%march, stepper%scene, step_singular, text)
         expected = "the system is singular"
         if (k == 2) expected = expected // "; elements of type CPE8R, as 1, have zero-energy " &
            // "modes if there is a single one or a single row of them: use two rows, or CPE8"
         call check_equal(error, text, expected, "reason")
         call stepper_close(stepper)
         stepper = stepper_t()
      end do
   end subroutine test_strainless

   subroutine gate_respond(self, u0, du, wants_tangent, response)
      class(gate_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response

      associate (i => self%node, place => u0(1, self%node) + du(1, self%node))
         if (place > self%wall .and. merge(place - self%last, du(1, i), self%is_at_rest) &
            > self%longest) then
            response%status = host_outside
         else
            self%last = place
         end if
      end associate
   end subroutine gate_respond

   subroutine writer_tell(self, increment, time, n_part, h_least)
      class(writer_t), intent(inout) :: self
      integer, intent(in) :: increment, n_part
      real(wp), intent(in) :: time, h_least

      self%n = self%n + 1
      self%increment(self%n) = increment
      self%part(self%n) = n_part
      self%time(self%n) = time
      self%least(self%n) = h_least
   end subroutine writer_tell

   logical function never()
      never = .false.
   end function never

   logical function at_once()
      at_once = .true.
   end function at_once

   !> A mass point at the speed 1/2 in increments of the size 2: each goes on by 1.
   subroutine open_flight(stepper, wall, longest, h_min, error)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: wall, longest, h_min
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(gate_t) :: gate
      integer, allocatable :: slot(:)

      call make_line(scene, 1, .false., 2.0_wp, 4)
      scene%step(1)%time%h_min = h_min
      scene%v0(1, 1) = 0.5_wp
      gate%name = "GATE"
      gate%wall = wall
      gate%longest = longest
      call csr_from_elements(gate%pattern, 2, [1, 3], [1, 2], slot, error)
      if (.not. allocated(error)) call open_given(stepper, scene, gate, 1.0_wp, error)
   end subroutine open_flight

   !> Ways past 1.6 of at most 0.3: the second increment takes 1/2 and twice 1/4 after two that are
   !> too long; the third one tries each half, and takes four times 1/4.
   subroutine test_halves(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_tried(3) = [0, 5, 7], n_cut(3) = [0, 2, 3]
      real(wp), parameter :: time(5) = [2.0_wp, 2.0_wp, 3.0_wp, 3.0_wp, 3.5_wp], &
         least(5) = [2.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(writer_t), target :: writer
      integer :: k, i

      call open_flight(stepper, 1.6_wp, 0.3_wp, 0.0_wp, error)
      if (allocated(error)) return
      call march_watch(stepper%march, never, writer)
      do k = 1, 3
         writer%n = 0
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, [stepper%march%state%clock%time, stepper%march%state%u(1, 1), &
            increment%h, increment%done], [2.0_wp*k, real(k, wp), 2.0_wp, 2.0_wp], &
            16.0_wp*epsilon(1.0_wp), 4.0_wp, "a whole one")
         call check_equal(error, [writer%n, increment%n_cut, increment%notes%n, &
            stepper%march%state%clock%n_easy], [n_tried(k), n_cut(k), n_cut(k), merge(1, 0, &
            k == 1)], "tried, cut, and easy ones in a row")
         call check_equal(error, writer%part(:writer%n), [(i, i = 1, writer%n)], "counted")
         call check_equal(error, writer%increment(:writer%n), spread(k, 1, writer%n), "increment")
         if (k /= 2 .or. allocated(error)) cycle
         call check_near(error, writer%time(:5), time, 0.0_wp, 1.0_wp, "times")
         call check_near(error, writer%least(:5), least, 0.0_wp, 1.0_wp, "the smallest")
         call check_true(error, index(increment%notes%item(2)%text, "increment cut at time 3, " &
            // "h = 1: the given force GATE is put out of its range") == 1, &
            increment%notes%item(2)%text)
      end do
      call stepper_close(stepper)
   end subroutine test_halves

   !> Nothing goes past 1.6: three quarters of the way there is the last that succeeds.
   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 1.6_wp, 0.0_wp, 0.5_wp, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      call stepper_advance(stepper, increment, stopped)
      call check_error(error, stopped, err_analysis, "the analysis stops at time 3: with h = " // &
         "0.5, the smallest allowed, the given force GATE is put out of its range", "stopped")
      call check_equal(error, increment%n_cut, 3, "cuts")
      associate (state => stepper%march%state)
         call check_near(error, [state%clock%time, state%u(1, 1), increment%done], [3.0_wp, &
            1.5_wp, 1.0_wp], 16.0_wp*epsilon(1.0_wp), 1.0_wp, "as far as it came")
         call check_true(error, state%clock%is_off_grid .and. state%clock%n_grid == 1, "between")
      end associate
      call stepper_close(stepper)
   end subroutine test_none

   !> Parts of 2^-12 only. After the first twelve, which are too long, of three that are tried two
   !> go on and one is the double that comes next: 3988 lead to 2659 of 4096.
   subroutine test_crawl(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 0.0_wp, 1.1_wp/4096.0_wp, 1.0_wp/4096.0_wp, error)
      if (allocated(error)) return
      call stepper_advance(stepper, increment, stopped)
      call check_error(error, stopped, err_analysis, "was tried in 4000 parts, the smallest " // &
         "of h = 4.88281E-04, and 64.9 % of it is complete; give smaller increments", "stopped")
      call check_near(error, stepper%march%state%clock%time, 2659.0_wp/2048.0_wp, 0.0_wp, 1.0_wp, &
         "time")
      call stepper_close(stepper)
   end subroutine test_crawl

   !> What holds the upper block beside its conditions is named, and, once there is strain, what
   !> may come next, unless the step goes on to it anyway.
   subroutine test_end(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: held = "is put out of its range; without contact and given " &
         // "forces the body ", beyond = "; no equilibrium was found beyond this time"
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k, last

      do k = 1, 4
         call open_thrown(stepper, kind_static, 0.1_wp, 10, 0.003_wp, error)
         if (.not. allocated(error) .and. k > 1) call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         associate (scene => stepper%scene)
            scene%amplitude(1)%value(2) = 8.0_wp
            stepper%march%grid%n_level = 0
            if (k == 3) scene%step(1)%stabilization = 1.0e-3_wp
            last = size(scene%step(1)%prescribed)
            if (k == 4) scene%step(1)%prescribed = scene%step(1)%prescribed(:last - 6)
         end associate
         call stepper_advance(stepper, increment, stopped)
         call check_error(error, stopped, err_analysis, "is put out of its range", "stopped")
         if (allocated(error)) return
         call check_true(error, (index(stopped%message, beyond) > 0) .eqv. (k == 2 .or. k == 4), &
            "what may come " // to_text(k) // ": " // stopped%message)
         call check_true(error, (index(stopped%message, held) > 0) .eqv. k == 4, &
            "what holds " // to_text(k) // ": " // stopped%message)
         call stepper_close(stepper)
         stepper = stepper_t()
      end do
   end subroutine test_end

   !> After a part that was given up, and before anything else, the state is as it was.
   subroutine test_interrupt(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 1.6_wp, 0.3_wp, 0.0_wp, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      call march_watch(stepper%march, at_once)
      call check_true(error, .not. associated(stepper%march%watcher), "nobody watches")
      call stepper_advance(stepper, increment, stopped)
      call check_equal(error, stopped%code, err_interrupt, "interrupted")
      call check_near(error, [stepper%march%state%clock%time, stepper%march%state%u(1, 1), &
         stepper%march%state%v(1, 1)], [2.0_wp, 1.0_wp, 0.5_wp], 16.0_wp*epsilon(1.0_wp), 1.0_wp, &
         "as before")
      call stepper_close(stepper)
   end subroutine test_interrupt

   !> A block that is thrown on a clamped one, or pressed on it, in `n` increments of `h`; steps in
   !> which node 10 is driven farther than `longest` are refused. `kind`: how they touch.
   subroutine open_thrown(stepper, kind, h, n, longest, error)
      type(stepper_t), intent(inout) :: stepper
      integer, intent(in) :: kind
      real(wp), intent(in) :: h, longest
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      type(gate_t) :: gate
      integer, allocatable :: slot(:)
      logical :: is_static
      integer :: i

      is_static = kind == kind_static
      associate (scene => stepper%scene)
         call make_two_blocks(scene, merge(0.0_wp, 0.03_wp, is_static), lower, upper)
         call add_step(scene, is_static, h, n)
         call clamp(scene%step(1), [(i, i = 1, 5)])
         call prescribe(scene%step(1), 10, 1, drive)
         scene%pair(1)%formulation = formulation_nts
         scene%pair(1)%interaction%friction = 0.3_wp
         associate (contact => scene%step(1)%contact)
            contact%initiation = initiation_persistent
            select case (kind)
            case (2)
               scene%pair(1)%formulation = formulation_mortar
               contact%initiation = initiation_velocity_update
            case (3)
               scene%pair(1)%interaction%restitution = 0.25_wp
            case (4)
               contact%method = method_penalty
            case (kind_explicit)
               contact%method = method_penalty
               scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
            case (7)
               contact%initiation = initiation_massless
            end select
            if (contact%method == method_penalty) scene%pair(1)%interaction%friction = 0.0_wp
         end associate
         scene%amplitude = [amplitude_t(name="RAMP", time=[0.0_wp, n*h], value=[0.0_wp, 1.0_wp])]
         if (.not. is_static) then
            scene%v0(1, 11:) = 0.3_wp
            scene%v0(2, 11:) = -1.0_wp
         else
            do i = 14, 16
               call prescribe(scene%step(1), i, 1, 0.06_wp)
               call prescribe(scene%step(1), i, 2, -0.05_wp)
            end do
         end if
         scene%step(1)%prescribed%amplitude = 1
      end associate
      stepper%is_read = .true.
      gate%name = "GATE"
      gate%node = 10
      gate%longest = longest
      gate%is_at_rest = is_static .or. kind == kind_explicit
      call csr_from_elements(gate%pattern, 32, [1, 3], [19, 20], slot, error)
      if (.not. allocated(error)) call stepper_give_force(stepper, gate, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_thrown

   !> What is refused and made in two halves comes to what two increments come to, of a march that
   !> is spoilt before each, and taken up again.
   subroutine test_pieces(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 12
      real(wp), parameter :: h = 0.015_wp
      type(stepper_t) :: whole, half
      type(increment_t) :: one, two(2)
      type(pair_sum_t) :: pushed(2)
      real(wp) :: way
      integer :: kind, k, i, n_touch

      way = drive/real(2*n, wp)
      do kind = 1, n_kind
         call open_thrown(whole, kind, 2.0_wp*h, n, 1.5_wp*way, error)
         if (.not. allocated(error)) call open_thrown(half, kind, h, 2*n, 1.5_wp*way, error)
         n_touch = 0
         do k = 1, n
            if (.not. allocated(error)) call stepper_advance(whole, one, error)
            if (k > n/2 .and. .not. allocated(error)) call march_resume(half%march, half%scene, &
               error)
            do i = 1, 2
               if (.not. allocated(error)) call soil(half%march)
               if (.not. allocated(error)) call stepper_advance(half, two(i), error)
               if (.not. allocated(error)) pushed(i) = half%march%state%sums%sum(1)
            end do
            if (allocated(error)) return
            call check_phase(error, whole%march)
            call check_phase(error, half%march)
            call check_equal(error, [one%n_cut, two%n_cut], [1, 0, 0], "cuts of kind " &
               // to_text(kind) // " in " // to_text(k))
            call compare_states(error, whole%march%state, half%march%state, "kind " &
               // to_text(kind) // ", increment " // to_text(k))
            call compare_increments(error, one, two)
            ! In statics iterations lead to what is refused; a factor is lost as a step is resumed,
            ! and surfaces that keep their mass are told again.
            if (k <= n/2) then
               call check_equal(error, one%warnings%n, sum(two%warnings%n), "warnings")
               if (kind /= kind_static) call check_equal(error, one%n_newton, &
                  sum(two%n_newton), "iterations")
            end if
            if (.not. allocated(error)) call compare_sums(error, whole%march%state%sums%sum(1), &
               pushed, kind == kind_static)
            if (.not. allocated(error)) call compare_ledgers(error, whole%march%ledger, &
               half%march%ledger)
            if (allocated(error)) return
            if (one%n_active > 0) n_touch = n_touch + 1
         end do
         call check_true(error, n_touch > 2, "contact")
         call stepper_close(whole)
         call stepper_close(half)
         whole = stepper_t()
         half = stepper_t()
      end do
   end subroutine test_pieces

   !> Time is counted for the rest again: each phase was left.
   subroutine check_phase(error, march)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(inout) :: march
      integer :: left

      call phase_enter(march%system%phases, phase_vectors, left)
      call check_equal(error, left, phase_vectors, "phase")
   end subroutine check_phase

   !> Spoil what a march holds beside its state: no increment looks at what the last one left there.
   subroutine soil(march)
      type(march_t), intent(inout) :: march
      real(wp), parameter :: dirt = 1.0e3_wp

      associate (motion => march%motion, ending => march%end_state, newton => march%newton, &
            active => march%active, layer => march%layer, explicit => march%explicit)
         motion%u0 = dirt
         motion%du = dirt
         motion%v0 = dirt
         motion%offset = dirt
         motion%from = dirt
         motion%by = dirt
         motion%at = dirt
         motion%computed = dirt
         if (allocated(ending%du)) ending%du = dirt
         ending%v = dirt
         if (allocated(ending%force)) ending%force = dirt
         if (allocated(ending%energy)) ending%energy = dirt
         ending%potential = dirt
         if (allocated(newton%contact)) newton%contact = dirt
         if (allocated(newton%driven)) newton%driven = dirt
         if (allocated(newton%left)) newton%left = dirt
         newton%convergence%last = dirt
         newton%convergence%n_history = 3
         newton%convergence%history = dirt
         layer%needs_mass = .true.
         layer%is_settled = .true.
         march%step_check%ratio = dirt
         active%rules%may_cut = .not. active%rules%may_cut
         active%rules%gap_tolerance = dirt
         active%start%left = dirt
         active%is_active = .not. active%is_active
         active%is_left_out = .true.
         active%n_newton = 77
         explicit%is_free = .not. explicit%is_free
         if (allocated(explicit%v1)) explicit%v1 = dirt
         if (allocated(explicit%mu)) explicit%mu = dirt
         if (allocated(explicit%residual)) explicit%residual = dirt
         if (allocated(explicit%load0)) explicit%load0 = dirt
         if (allocated(explicit%start)) explicit%start = dirt
         if (allocated(explicit%load)) explicit%load = dirt
         if (allocated(explicit%contact)) explicit%contact = dirt
         march%system%response%residual = dirt
         march%system%response%energy = dirt
         march%system%response%potential = dirt
      end associate
   end subroutine soil

   subroutine compare_states(error, a, b, what)
      type(error_t), allocatable, intent(inout) :: error
      type(state_t), intent(in) :: a, b
      character(len=*), intent(in) :: what

      call check_near(error, [a%clock%time, a%clock%step_time], [b%clock%time, b%clock%step_time], &
         tol, 1.0_wp, "time, " // what)
      call check_near(error, a%u, b%u, tol, 1.0_wp, "u, " // what)
      call check_near(error, a%v, b%v, tol, 10.0_wp, "v, " // what)
      call check_near(error, a%contact, b%contact, tol, 100.0_wp, "contact, " // what)
      call check_near(error, a%reaction, b%reaction, tol, 100.0_wp, "reactions, " // what)
      call check_near(error, a%internal, b%internal, tol, 100.0_wp, "internal forces, " // what)
      call check_near(error, [a%energy, a%potential], [b%energy, b%potential], tol, 10.0_wp, &
         "energies, " // what)
      associate (now => a%contacts, then => b%contacts)
         call check_true(error, all(now%is_active .eqv. then%is_active), "what acts, " // what)
         call check_near(error, [now%lam, now%closure, now%slip_path], [then%lam, then%closure, &
            then%slip_path], tol, 100.0_wp, "contacts, " // what)
         if (size(now%drag) > 0) call check_near(error, [now%drag, now%slip, now%slides_along], &
            [then%drag, then%slip, then%slides_along], tol, 100.0_wp, "friction, " // what)
      end associate
      call check_near(error, a%pairs%total(1)%slave, b%pairs%total(1)%slave, tol, 100.0_wp, &
         "pairs, " // what)
   end subroutine compare_states

   !> Counts and sums are those of both, what is largest that of one of them.
   subroutine compare_increments(error, one, two)
      type(error_t), allocatable, intent(inout) :: error
      type(increment_t), intent(in) :: one, two(2)

      call check_equal(error, [one%n_active, one%n_augmentation, one%notes%n], &
         [two(2)%n_active, maxval(two%n_augmentation), sum(two%notes%n) + 1], &
         "counts")
      call check_near(error, [one%h, one%done], spread(sum(two%h), 1, 2), tol, 1.0_wp, "size")
      call check_near(error, [one%give, one%law_missed, one%largest_push, &
         one%stand_off%largest, one%nodal_pull%force, one%overlap%depth], [maxval(two%give), &
         maxval(two%law_missed), maxval(two%largest_push), maxval(two%stand_off%largest), &
         maxval(two%nodal_pull%force), maxval(two%overlap%depth)], tol, 100.0_wp, "the most")
      call check_near(error, [one%stand_off%impulse, one%stand_off%impulse_gap], &
         [sum(two%stand_off%impulse), sum(two%stand_off%impulse_gap)], tol, 10.0_wp, "impulses")
      call check_near(error, one%work_scale, hypot(two(1)%work_scale, two(2)%work_scale), tol, &
         100.0_wp, "what works are made of")
   end subroutine compare_increments

   !> Of the pair; in statics of the second half.
   subroutine compare_sums(error, one, two, is_static)
      type(error_t), allocatable, intent(inout) :: error
      type(pair_sum_t), intent(in) :: one, two(2)
      logical, intent(in) :: is_static
      integer :: first

      first = merge(2, 1, is_static)
      call check_near(error, [one%span, one%weight], [sum(two(first:)%span), &
         sum(two(first:)%weight)], tol, 10.0_wp, "time and force by it")
      call check_near(error, one%push + one%moment, merge(0.0_wp, two(1)%push + two(1)%moment, &
         is_static) + two(2)%push + two(2)%moment, tol, 10.0_wp, "pushes and moments")
      call check_near(error, [one%impulse, one%friction, one%damping, one%duration], &
         [two(2)%impulse, two(2)%friction, two(2)%damping, two(2)%duration], tol, 10.0_wp, "so far")
      call check_true(error, one%is_pressed .eqv. two(2)%is_pressed, "is pressed at last")
   end subroutine compare_sums

   subroutine compare_ledgers(error, a, b)
      type(error_t), allocatable, intent(inout) :: error
      type(ledger_t), intent(in) :: a, b

      call check_near(error, [a%kinetic, a%strain, a%potential, a%external_work, a%contact_work, &
         a%restitution, a%decay, a%damping, a%friction, a%contact_energy, a%total, a%momentum, &
         a%angular], [b%kinetic, b%strain, b%potential, b%external_work, b%contact_work, &
         b%restitution, b%decay, b%damping, b%friction, b%contact_energy, b%total, b%momentum, &
         b%angular], tol, 10.0_wp, "works")
   end subroutine compare_ledgers

end module test_march_parts
