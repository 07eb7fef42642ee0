!> A step as one problem of its contacts, on a block over a flat floor: what comes out balances and
!> obeys the laws, from wherever it is begun; and who takes part, by what contacts tell.
module test_contact_rounds
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_begin, active_set_init, active_set_select, &
      active_set_t, candidates_clear, candidates_t, step_done, step_stands_off, step_too_far, &
      touch_tol
   use emcon_active_set_solve, only : active_set_solve
   use emcon_constraints, only : constraints_evaluate
   use emcon_contact_candidates, only : candidates_keep_forces, candidates_select
   use emcon_contact_law, only : contact_laws_add
   use emcon_contact_law_registry, only : contact_law_of_method
   use emcon_contact_newton, only : contact_newton_free, contact_newton_solve, contact_newton_t
   use emcon_convergence, only : round_off
   use emcon_correction, only : correction_free, correction_reset
   use emcon_coulomb_law, only : contact_open, contact_slides, contact_sticks, coulomb_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_displacement, instant_t
   use emcon_factor_base, only : factor_base_t
   use emcon_factor_policy, only : factor_policy_step
   use emcon_friction, only : most_lagged
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_evaluate, motion_init, motion_t
   use emcon_newton, only : newton_converged, newton_early, newton_init, newton_t
   use emcon_phases, only : phase_enter, phase_vectors
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_solver_registry, only : solver_default
   use emcon_state, only : state_t
   use emcon_steps, only : method_augmented_lagrange, method_null_space, method_penalty, &
      method_saddle_point
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use floor_contact, only : floor_contact_t, floor_make
   use linear_scenes, only : add_equation
   use random_draws, only : draw_random
   use small_scenes, only : add_step, block_t, clamp, make_block, prescribe, shake
   implicit none
   private
   public :: collect_contact_rounds

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> What Newton's method leaves of a step, by stiffness over inertia.
   real(wp), parameter :: tol = 1.0e5_wp*eps
   real(wp), parameter :: h = 0.05_wp

   !> A block of two elements, nodes 1 to 3 of which are over a floor, and its step.
   type :: case_t
      type(scene_t) :: scene
      type(system_t) :: system
      type(active_set_t) :: active
      type(newton_t) :: newton
      type(motion_t) :: motion
      type(state_t) :: state
      type(floor_contact_t), allocatable :: floor(:)     !! to be given
      real(wp) :: mu = 0.0_wp
      logical :: keeps_factor = .false.
      logical :: holds_gap = .false.             !! of the start
      logical :: has_impacts = .true.            !! else sets are told by trials, as in statics
      logical :: is_linked = .false.             !! nodes 4 and 6 move alike sideways
      integer :: method = method_null_space
      real(wp) :: stiffness = 0.0_wp             !! of the floor, where it gives way [M/T^2]
      logical, allocatable :: was_active(:)      !! contacts; not allocated: none
      real(wp) :: way = 0.0_wp                   !! prescribed of node 6, sideways [L]
      real(wp) :: slides_along = 0.0_wp          !! what slid before
      logical :: is_bound = .false.              !! node 2 is prescribed, into the floor
      logical :: pushes_out = .false.            !! what is closed too far
      logical :: is_at_once = .false.            !! all contacts are candidates from the start
      logical :: polishes = .true.               !! down to round-off
      real(wp) :: largest_move = huge(1.0_wp)    !! of a correction, then [L]
      real(wp), allocatable :: start(:, :)       !! to begin at; not allocated: as things move [L]
      real(wp), allocatable :: lam(:), tau(:)    !! with these forces of contacts [M L/T^2]
      logical :: is_static = .false.             !! the upper nodes are moved to `top`
      real(wp) :: top(2) = 0.0_wp                !! displacement of them [L]
      real(wp) :: tilt = 0.0_wp                  !! and how much higher the last one ends [L]
      integer :: status = 0
   end type case_t

contains

   subroutine collect_contact_rounds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is found balances and obeys the laws", test_laws), &
         test_case_t("with a kept factor and without", test_kept), &
         test_case_t("with a row that always holds, by trials or not", test_linked), &
         test_case_t("a floor that gives way, or is pushed back", test_soft), &
         test_case_t("all at once, as Newton's method converges", test_at_once), &
         test_case_t("where all is linear one correction does", test_linear), &
         test_case_t("a correction that goes far is cut", test_early), &
         test_case_t("what a first guess leaves of gaps", test_first_guess), &
         test_case_t("statics by sets and all at once", test_static), &
         test_case_t("begun where it ends nothing changes", test_again), &
         test_case_t("of contacts the one that opens has changed", test_one_opens), &
         test_case_t("a node that is prescribed into its floor", test_bound), &
         test_case_t("in any unit of length", test_units), &
         test_case_t("rows that follow from others", test_redundant), &
         test_case_t("what has lost its surface does not come back", test_left), &
         test_case_t("unless it closes again, and once alone", test_back), &
         test_case_t("friction that acts elsewhere", test_lagged), &
         test_case_t("stencils of another motion", test_stale), &
         test_case_t("what cannot begin", test_begins), &
         test_case_t("nothing is known of the step before", test_clear), &
         test_case_t("a guard waits for the pairs", test_guard)]
   end subroutine collect_contact_rounds

   !> A block in the air, not quite straight, that falls with a velocity of 1 and slides.
   subroutine make_case(self, slide)
      type(case_t), intent(inout) :: self
      real(wp), intent(in) :: slide              !! [L/T]
      type(block_t) :: block

      call make_block(self%scene, "CPE4", [2, 1], block)
      call add_step(self%scene, .false., h, 1)
      call shake(self%scene%u0, 0.02_wp)
      call shake(self%scene%v0, 0.2_wp)
      self%scene%v0(1, :) = self%scene%v0(1, :) + slide
      self%scene%v0(2, :) = self%scene%v0(2, :) - 1.0_wp
   end subroutine make_case

   !> Nodes 4 and 6 begin alike sideways.
   pure subroutine align(scene)
      type(scene_t), intent(inout) :: scene

      scene%u0(1, 4) = scene%u0(1, 6)
      scene%v0(1, 4) = scene%v0(1, 6)
   end subroutine align

   !> Solve the step over `floor`.
   subroutine solve(self, error)
      type(case_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(factor_base_t) :: base
      integer :: n
      logical :: is_lost

      if (abs(self%way) > 0.0_wp) call prescribe(self%scene%step(1), 6, 1, self%way)
      if (self%is_bound) call clamp(self%scene%step(1), [2])
      if (self%is_static) then
         deallocate(self%scene%step)
         allocate(self%scene%step(0))
         call add_step(self%scene, .true., h, 1)
         call clamp(self%scene%step(1), [4, 5, 6])
      end if
      if (self%is_linked) call add_equation(self%scene, [4, 6], [1, 1], [1.0_wp, -1.0_wp])
      self%scene%step(1)%contact%method = self%method
      call system_init(self%system, self%scene, error)
      if (.not. allocated(error)) call system_begin_step(self%system, self%scene, 1, error)
      if (allocated(error)) return
      call put_floor(self)
      call active_set_init(self%active, self%system)
      self%active%rules%holds_gap = self%holds_gap
      self%active%rules%has_impacts = self%has_impacts
      self%active%rules%pushes_out = self%pushes_out
      self%active%rules%puts_off = .true.
      call newton_init(self%newton, self%system%space%numbering%n_unknown, self%scene%x, &
         1.0e3_wp*epsilon(1.0_wp), 30)
      call correction_reset(self%newton%correction, merge(method_saddle_point, &
         method_null_space, self%is_linked), solver_default)
      self%newton%factor_policy%is_allowed = self%keeps_factor
      call factor_policy_step(self%newton%factor_policy, self%newton%correction, base, &
         instant_t(), h, 0, is_lost)
      call motion_init(self%motion, self%scene%x)
      self%motion%evaluation = scheme%evaluation(instant_t(), h)
      self%motion%u0 = self%scene%u0
      self%motion%v0 = self%scene%v0
      self%motion%du = h*self%scene%v0
      if (abs(self%way) > 0.0_wp) then
         ! What follows from a prescribed node by an eliminated row is prescribed too.
         do n = merge(4, 6, self%is_linked .and. self%system%space%is_reduced), 6, 2
            self%newton%driven(1, n) = self%way - self%motion%u0(1, n) - self%motion%du(1, n)
            self%motion%du(1, n) = self%way - self%motion%u0(1, n)
         end do
      end if
      if (self%is_static) then
         self%motion%evaluation = evaluation_at_end
         self%motion%du = 0.0_wp
         self%motion%du(:, 4:) = spread(self%top, 2, 3) - self%motion%u0(:, 4:)
         self%motion%du(2, 6) = self%motion%du(2, 6) + self%tilt
         self%newton%driven(:, 4:) = self%motion%du(:, 4:)
      end if
      if (self%is_bound) then
         self%newton%driven(:, 2) = [0.0_wp, self%floor(1)%height(2) - 0.03_wp] &
            - self%motion%u0(:, 2) - self%motion%du(:, 2)
         self%motion%du(:, 2) = self%motion%du(:, 2) + self%newton%driven(:, 2)
      end if
      if (allocated(self%start)) then
         self%motion%du = self%start
         self%newton%driven = 0.0_wp
      end if
      n = self%system%n_constraint
      associate (contacts => self%state%contacts)
         allocate(contacts%is_active(n), source=.false.)
         if (allocated(self%was_active)) contacts%is_active(size(self%system%acts) + 1:) &
            = self%was_active
         allocate(contacts%lam(n), source=0.0_wp)
         allocate(contacts%closure(n), source=1.0_wp)
         allocate(contacts%stretch(2, n), source=0.0_wp)
         allocate(contacts%slides_along(1, n), source=self%slides_along)
         allocate(contacts%drag(1, n), source=0.0_wp)
         if (allocated(self%start)) contacts%lam = self%lam
         if (allocated(self%start)) contacts%drag(1, :) = self%tau
         if (self%stiffness > 0.0_wp) call soften(self, contacts%closure)
      end associate
      call active_set_begin(self%active, self%system, self%motion, self%state)
      if (self%is_at_once) then
         call solve_at_once(self, error)
      else
         call active_set_solve(self%active, self%system, self%scene, self%newton, self%motion, &
            self%status, error)
      end if
      call correction_free(self%newton%correction)
   end subroutine solve

   !> All contacts as one problem of what acts, sticks and slides, whatever acted before.
   subroutine solve_at_once(self, error)
      type(case_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(contact_newton_t) :: solve
      integer, allocatable :: id(:)

      associate (active => self%active, set => self%active%set)
         call candidates_clear(active%candidates)
         active%candidates%takes_part = .true.
         active%candidates%takes_part(:size(self%system%acts)) = self%system%acts
         call candidates_select(active, self%system, self%motion)
         id = set%id(set%n_permanent + 1:set%n)
         allocate(solve%law(size(id)))
         if (active%friction%is_on) solve%law = active%friction%law(id)
         ! What another solve has counted does not matter.
         self%newton%n_solve = 5
         self%newton%convergence%n_iteration = 5
         self%newton%convergence%n_history = 5
         self%newton%convergence%polishes = self%polishes
         self%newton%convergence%largest_move = self%largest_move
         call contact_newton_solve(solve, self%newton, self%system, set, self%motion, &
            self%status, error)
         call contact_newton_free(solve)
         if (allocated(error)) return
         call candidates_keep_forces(active)
         active%is_active(id) = solve%law%status%kind /= contact_open
         if (active%friction%is_on) active%friction%law(id)%status = solve%law%status
         call active_set_select(active, self%system, self%motion)
         call constraints_evaluate(set, self%system, self%motion, .true.)
      end associate
   end subroutine solve_at_once

   !> The floor gives way; `closure` is how far it does so as the step begins.
   subroutine soften(self, closure)
      type(case_t), intent(inout) :: self
      real(wp), intent(inout) :: closure(:)      !! (n_constraint) [L]
      integer :: i

      associate (state => self%active%penalty, floor => self%floor(1), n => size(closure))
         state%is_on = .true.
         state%augments = self%method == method_augmented_lagrange
         state%tolerance = 1.0e-3_wp*tol
         call contact_law_of_method(self%method, state%law)
         allocate(state%stiffness(n), source=self%stiffness)
         allocate(state%area(n), state%edge(n), source=1.0_wp)
         allocate(state%closure(n), source=1.0_wp)
         self%system%contact(1)%contact%step%has_compliance = .true.
         self%system%contact(1)%contact%step%is_penalty = .not. state%augments
         do i = 1, n
            associate (node => floor%node(i))
               if (self%was_active(i)) closure(i) = min(0.0_wp, self%motion%x(2, node) &
                  + self%motion%u0(2, node) - floor%height(i))
            end associate
         end do
      end associate
   end subroutine soften

   !> The contacts of the system are those of `floor`, all with friction.
   subroutine put_floor(self)
      type(case_t), intent(inout) :: self
      integer :: k

      associate (system => self%system)
         deallocate(system%contact, system%first_constraint)
         allocate(system%contact(size(self%floor)), &
            system%first_constraint(size(self%floor) + 1))
         system%first_constraint = size(system%acts)
         system%n_pair = count(.not. self%floor%slack > 0.0_wp)
         do k = 1, size(self%floor)
            if (self%mu > 0.0_wp) call contact_laws_add(self%floor(k)%laws, coulomb_t(mu=self%mu))
            allocate(system%contact(k)%contact, source=self%floor(k))
            system%contact(k)%of_pair = k
            system%n_constraint = system%n_constraint + self%floor(k)%n_constraint
            system%first_constraint(k + 1) = system%n_constraint
         end do
      end associate
   end subroutine put_floor

   !> Without the forces of contact the residual of free nodes is what contacts push and rub with;
   !> what acts holds its gap and pushes, what does not is open, and friction is as Coulomb has it.
   subroutine check_laws(self, what, error)
      type(case_t), intent(inout) :: self
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: left(:, :), lam(:), tau(:), gap0(:), gap1(:), held(:), lead(:), s(:)
      real(wp) :: scale
      integer :: k, pair, i, n

      if (allocated(error)) return
      n = self%system%n_constraint
      allocate(lam(n), tau(n), gap0(n), gap1(n), held(n), lead(n), s(n), source=0.0_wp)
      call check_equal(error, self%status, step_done, what // ": status")
      call phase_enter(self%system%phases, phase_vectors, k)
      call check_equal(error, k, phase_vectors, what // ": phases that were entered were left")
      if (allocated(error)) return
      associate (active => self%active, set => self%active%set, system => self%system, &
            motion => self%motion)
         call check_true(error, all(active%is_active(set%id(:set%n))) .and. &
            count(active%is_active) == set%n, what // ": the set is what acts")
         lam(set%id(:set%n)) = set%lam(:set%n)
         do k = 1, set%n
            tau(set%id(k)) = merge(self%mu*set%lam(k), 0.0_wp, self%mu > 0.0_wp)
            if (self%mu > 0.0_wp) tau(set%id(k)) = tau(set%id(k)) &
               *active%friction%law(set%id(k))%status%direction(1)
         end do
         do k = set%n + 1, set%n_row
            tau(set%id(set%condition(k))) = set%lam(k)
         end do
         call motion_evaluate(motion)
         call system_respond(system, motion, .false., .true.)
         left = system%response%residual
         scale = maxval(system%response%magnitude)
         k = size(system%acts)
         ! Where the row is eliminated the two nodes share what it takes.
         if (self%is_linked .and. set%n_permanent == 0) left(1, [4, 6]) = merge(0.0_wp, &
            left(1, 4) + left(1, 6), abs(self%way) > 0.0_wp)
         do i = 1, set%n_permanent
            associate (item => set%item(i), m => set%item(i)%n_node)
               left(:, item%node(:m)) = left(:, item%node(:m)) - lam(i)*item%g(:, :m)
               lam(i) = 0.0_wp
            end associate
         end do
         do pair = 1, size(system%contact)
            associate (floor => self%floor(pair))
               do i = 1, floor%n_constraint
                  k = k + 1
                  associate (node => floor%node(i))
                     left(:, node) = left(:, node) - [-tau(k), lam(k)]
                     gap0(k) = motion%x(2, node) + motion%u0(2, node) - floor%height(i)
                     gap1(k) = gap0(k) + motion%du(2, node)
                     s(k) = motion%du(1, node)
                     held(k) = merge(gap0(k), floor%closed, self%holds_gap .and. &
                        active%is_candidate(k))
                     ! What slip leads to: with the velocity along the floor at an end of 0.
                     if (active%is_candidate(k) .and. .not. self%is_static) lead(k) = &
                        evaluation_displacement( &
                        motion%evaluation, motion%v0(1, node), 0.0_wp)
                     if (floor%leaves(i)) held(k) = -huge(scale)
                  end associate
               end do
            end associate
         end do
         where (system%space%numbering%unknown == 0) left = 0.0_wp
         call check_near(error, left, 0.0_wp*left, tol, scale, what // ": balance")
         call check_near(error, pack(gap1, active%is_active), pack(held, active%is_active), &
            tol, 1.0_wp, what // ": gaps")
         call check_true(error, all(gap1 >= held - tol), what // ": what does not act is open")
         call check_true(error, all(lam >= -tol*scale), what // ": pushes")
         call check_true(error, all(abs(tau) <= self%mu*lam + tol*scale), what // ": friction")
         if (abs(self%way) > 0.0_wp) call check_near(error, motion%u0(1, 6) + motion%du(1, 6), &
            self%way, 4.0_wp*eps, 1.0_wp, what // ": prescribed")
         if (self%is_linked) call check_near(error, motion%u0(1, 4) + motion%du(1, 4), &
            motion%u0(1, 6) + motion%du(1, 6), 64.0_wp*eps, 1.0_wp, what // ": alike")
      end associate
      if (self%mu > 0.0_wp) call check_friction(self, what, lam, tau, s, lead, scale, error)
   end subroutine check_laws

   !> Friction is mu lam against slip, where that lies off the segment from 0 to what it leads to.
   subroutine check_friction(self, what, lam, tau, s, lead, scale, error)
      type(case_t), intent(in) :: self
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: lam(:), tau(:), s(:), lead(:), scale
      type(error_t), allocatable, intent(inout) :: error
      integer :: k
      real(wp) :: low, high

      do k = 1, size(lam)
         if (.not. self%active%is_active(k)) cycle
         low = min(0.0_wp, lead(k))
         high = max(0.0_wp, lead(k))
         if (s(k) > high + tol) call check_near(error, tau(k), self%mu*lam(k), tol, scale, &
            what // ": slides on")
         if (s(k) < low - tol) call check_near(error, tau(k), -self%mu*lam(k), tol, scale, &
            what // ": slides back")
         if (s(k) > low + tol .and. s(k) < high - tol) call check_near(error, tau(k), 0.0_wp, tol, &
            scale, what // ": free")
         if (abs(s(k) - high) <= tol .and. high > 2.0_wp*tol) call check_true(error, &
            tau(k) >= -tol*scale, what // ": it does not drive")
         if (abs(s(k) - low) <= tol .and. low < -2.0_wp*tol) call check_true(error, &
            tau(k) <= tol*scale, what // ": it does not drive back")
      end do
   end subroutine check_friction

   !> Some contacts act as the step begins, some near by close in it, others do not; with and
   !> without friction, a motion that is prescribed, gaps that are held and a factor that is kept.
   subroutine test_laws(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(7)
      integer :: i, n_open, n_stick, n_slide, n_act

      n_open = 0
      n_stick = 0
      n_slide = 0
      n_act = 0
      do i = 0, 63
         block
            type(case_t) :: self
            logical :: acted(3)

            call draw_random(u)
            call make_case(self, 3.0_wp*u(1) - 1.5_wp)
            self%mu = merge(0.0_wp, 0.6_wp*u(2), mod(i, 2) == 0)
            self%holds_gap = mod(i/2, 2) == 1
            self%keeps_factor = mod(i/4, 2) == 0
            if (mod(i/8, 2) == 1) self%way = 0.1_wp*(u(3) - 0.5_wp)
            self%slides_along = real(mod(i/2, 3) - 1, wp)
            acted = u(4:6) > 0.6_wp
            self%was_active = acted
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.1_wp*u(4:6), acted))
            ! It may rise on one side.
            if (u(7) > 0.5_wp) self%scene%v0(2, :) = self%scene%v0(2, :) + self%scene%x(1, :)
            call solve(self, error)
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            if (self%keeps_factor .and. .not. self%mu > 0.0_wp) call check_one_factor(self, error)
            associate (active => self%active)
               call check_true(error, all(active%candidates%n_change > 0 .or. active%is_active &
                  .or. .not. active%candidates%takes_part), &
                  "that one has opened is counted, case " &
                  // to_text(i))
               call check_true(error, active%n_newton > 0, "iterations are counted")
               n_open = n_open + count(active%is_candidate .and. .not. active%is_active)
               n_act = n_act + count(active%is_active)
               if (.not. active%friction%is_on) cycle
               n_stick = n_stick + count(active%is_active .and. active%friction%law%status%kind &
                  == contact_sticks)
               n_slide = n_slide + count(active%is_active .and. active%friction%law%status%kind &
                  == contact_slides)
            end associate
         end block
      end do
      call check_true(error, min(n_open, n_stick, n_slide, n_act) > 5, "of " // to_text(n_act) // &
         " that act " // to_text(n_stick) // " stick, " // to_text(n_slide) // " slide; " // &
         to_text(n_open) // " open")
   end subroutine test_laws

   !> Whatever was found of candidates, a step knows nothing of it when it begins.
   subroutine test_clear(error)
      type(error_t), allocatable, intent(out) :: error
      type(candidates_t) :: known, none

      allocate(known%takes_part(3), known%acts(3), known%acted(3), known%has_left(3), &
         known%is_back(3), known%is_blamed(3), source=.true.)
      allocate(known%n_change(3), source=7)
      known%is_measured = .true.
      known%have_changed = .true.
      known%is_settled = .true.
      known%one_closes = .true.
      known%is_new_set = .true.
      call candidates_clear(known)
      call check_true(error, .not. any([known%takes_part, known%acts, known%acted, &
         known%has_left, known%is_back, known%is_blamed]), "of each")
      call check_equal(error, known%n_change, [0, 0, 0], "changes")
      call check_true(error, all([known%is_measured, known%have_changed, known%is_settled, &
         known%one_closes, known%is_new_set] .eqv. [none%is_measured, none%have_changed, &
         none%is_settled, none%one_closes, none%is_new_set]), "of all")
   end subroutine test_clear

   !> In a unit of length that is a power of two, with density and modulus in it, every number is
   !> the same but for that power: in the same iterations.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: power(3) = [0, 24, -17]
      real(wp) :: u(6)
      integer :: i, k

      do i = 0, 15
         block
            type(case_t) :: self(3)

            call draw_random(u)
            call make_case(self(1), 3.0_wp*u(1) - 1.5_wp)
            do k = 1, 3
               associate (case => self(k), unit => 2.0_wp**power(k))
                  case%scene = self(1)%scene
                  case%mu = merge(0.0_wp, 0.6_wp*u(2), mod(i, 2) == 0)
                  case%holds_gap = mod(i/2, 2) == 1
                  if (mod(i/8, 2) == 1) case%way = 0.1_wp*(u(3) - 0.5_wp)*unit
                  case%was_active = u(4:6) > 0.6_wp
                  case%slides_along = real(mod(i/2, 3) - 1, wp)
                  allocate(case%floor(1))
                  call floor_make(case%floor(1), [1, 2, 3], (case%scene%u0(2, :3) - merge(0.0_wp, &
                     0.1_wp*u(4:6), case%was_active))*unit)
                  case%floor(1)%size = unit
               end associate
            end do
            do k = 3, 1, -1
               call scale_scene(self(k)%scene, 2.0_wp**power(k))
               call solve(self(k), error)
               call check_equal(error, self(k)%status, step_done, "status, case " // to_text(i))
               if (allocated(error)) return
            end do
            do k = 2, 3
               associate (unit => 2.0_wp**power(k), one => self(1)%active, other => self(k)%active)
                  call check_near(error, self(k)%motion%du/unit, self(1)%motion%du, 0.0_wp, &
                     1.0_wp, &
                     "motion, case " // to_text(i))
                  call check_equal(error, [other%n_newton, other%set%n], [one%n_newton, &
                     one%set%n], &
                     "iterations and contacts")
                  if (allocated(error)) return
                  call check_near(error, other%set%lam(:one%set%n)/unit, one%set%lam(:one%set%n), &
                     0.0_wp, 1.0_wp, "forces, case " // to_text(i))
               end associate
            end do
         end block
      end do
   end subroutine test_units

   subroutine scale_scene(scene, unit)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: unit               !! > 0

      scene%x = unit*scene%x
      scene%u0 = unit*scene%u0
      scene%v0 = unit*scene%v0
      scene%section%thickness = unit*scene%section%thickness
      scene%material%density = scene%material%density/unit**3
      scene%material(1)%constant(1) = scene%material(1)%constant(1)/unit
   end subroutine scale_scene

   !> There is one solution: with a kept factor it is found too, by sets and with that factor alone.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(3), start(2, 6), velocity(2, 6), du(2, 6)
      integer :: i, k

      do i = 1, 12
         call draw_random(u)
         do k = 1, 2
            block
               type(case_t) :: self

               call make_case(self, 1.0_wp)
               if (k > 1) self%scene%u0 = start
               if (k > 1) self%scene%v0 = velocity
               start = self%scene%u0
               velocity = self%scene%v0
               self%keeps_factor = k > 1
               allocate(self%floor(1))
               call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - 0.08_wp*u)
               call solve(self, error)
               call check_laws(self, "case " // to_text(i), error)
               if (allocated(error)) return
               if (k == 1) du = self%motion%du
               call check_near(error, self%motion%du, du, tol, 1.0_wp, "motion " // to_text(i))
               if (self%keeps_factor) call check_one_factor(self, error)
            end block
         end do
      end do
   end subroutine test_kept

   !> An equation that is solved with its multiplier, whatever tells which contacts act: there is
   !> one solution, to whose motion all of that leads.
   subroutine test_linked(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(6), du(2, 6)
      integer :: i, k, n_act

      n_act = 0
      do i = 0, 15
         call draw_random(u)
         block
            type(case_t) :: first

            call make_case(first, 3.0_wp*u(1) - 1.5_wp)
            call align(first%scene)
            if (mod(i/2, 2) == 1) first%way = 0.1_wp*(u(2) - 0.5_wp)
            do k = 1, 4
               block
                  type(case_t) :: self

                  self%scene = first%scene
                  self%way = first%way
                  self%mu = merge(0.0_wp, 0.2_wp, mod(i, 2) == 0)
                  self%has_impacts = mod(k, 2) == 1
                  self%is_linked = .true.
                  if (k > 2) self%method = method_saddle_point
                  self%was_active = u(4:6) > 0.6_wp
                  allocate(self%floor(1))
                  call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
                     0.1_wp*u(4:6), self%was_active))
                  call solve(self, error)
                  call check_laws(self, "case " // to_text(i) // ", way " // to_text(k), error)
                  if (allocated(error)) return
                  if (k == 1) du = self%motion%du
                  call check_near(error, self%motion%du, du, tol, 1.0_wp, "motion of case " &
                     // to_text(i) // ", way " // to_text(k))
                  if (.not. self%has_impacts) call check_true(error, &
                     self%active%candidates%is_settled, "by sets")
                  n_act = n_act + count(self%active%is_active(2:))
               end block
            end do
         end block
      end do
      call check_true(error, n_act > 64, "contacts act")
   end subroutine test_linked

   !> With all contacts as candidates what comes out balances and obeys the laws, too, and once it
   !> is near each iterate leaves the square of what the one before has left.
   subroutine test_at_once(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(7)
      integer :: i, k, n_fast

      n_fast = 0
      do i = 0, 63
         block
            type(case_t) :: self

            call draw_random(u)
            call make_case(self, 3.0_wp*u(1) - 1.5_wp)
            self%is_at_once = .true.
            self%mu = merge(0.0_wp, 0.6_wp*u(2), mod(i, 2) == 0)
            self%is_linked = mod(i/4, 2) == 1
            if (self%is_linked) call align(self%scene)
            self%method = merge(method_saddle_point, method_null_space, mod(i/8, 2) == 1)
            if (mod(i/2, 2) == 1) self%way = 0.1_wp*(u(3) - 0.5_wp)
            self%polishes = mod(i/16, 2) == 0
            self%was_active = u(4:6) > 0.6_wp
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.1_wp*u(4:6), self%was_active))
            if (u(7) > 0.5_wp) self%scene%v0(2, :) = self%scene%v0(2, :) + self%scene%x(1, :)
            call solve(self, error)
            self%active%is_candidate = self%active%start%was_active
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            associate (convergence => self%newton%convergence)
               do k = 2, convergence%n_history
                  if (convergence%history(k - 1) > 0.01_wp) cycle
                  if (convergence%history(k - 1) < convergence%tolerance) exit
                  call check_true(error, convergence%history(k) <= convergence%history(k - 1)**2 &
                     + tol, "iterate " // to_text(k) // " of case " // to_text(i) // " leaves " &
                     // to_text(convergence%history(k), 3))
                  n_fast = n_fast + 1
               end do
               do k = 2, convergence%n_history
                  call check_true(error, ends_at(self, k) .eqv. k == convergence%n_history, &
                     "the end of case " // to_text(i) // " at iterate " // to_text(k))
               end do
            end associate
         end block
      end do
      call check_true(error, n_fast > 32, "iterates near the end: " // to_text(n_fast))

   contains

      !> Within the tolerance, and down to round-off as long as that gains more than two thirds.
      pure logical function ends_at(self, k)
         type(case_t), intent(in) :: self
         integer, intent(in) :: k

         associate (convergence => self%newton%convergence)
            ends_at = convergence%history(k) <= convergence%tolerance
            if (self%polishes) ends_at = convergence%history(k) <= round_off .or. (ends_at .and. &
               convergence%history(k) > 0.3_wp*convergence%history(k - 1))
         end associate
      end function ends_at

   end subroutine test_at_once

   !> Nothing moves farther in a correction than contacts that are no candidates allow, and the
   !> first that would ends the solve.
   subroutine test_early(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(7), start(2, 6)
      integer :: i

      do i = 0, 15
         block
            type(case_t) :: self

            call draw_random(u)
            call make_case(self, 3.0_wp*u(1) - 1.5_wp)
            self%is_at_once = .true.
            self%mu = merge(0.0_wp, 0.6_wp*u(2), mod(i, 2) == 0)
            self%largest_move = merge(1.0e-3_wp, 1.0_wp, i < 12)
            self%was_active = u(4:6) > 0.6_wp
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.1_wp*u(4:6), self%was_active))
            start = h*self%scene%v0
            call solve(self, error)
            if (allocated(error)) return
            call check_equal(error, self%status, merge(newton_early, newton_converged, i < 12), &
               "status of case " // to_text(i))
            if (i < 12) call check_near(error, maxval(abs(self%motion%du - start)), 1.0e-3_wp, &
               tol, &
               1.0_wp, "how far it goes in case " // to_text(i))
         end block
      end do
   end subroutine test_early

   !> Small displacements, a flat floor: one tangent and one correction, also with a prescribed
   !> motion, leave nothing but round-off, whichever contacts come to act, stick and slide.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(7)
      integer :: i

      do i = 0, 31
         block
            type(case_t) :: self

            call draw_random(u)
            call make_case(self, 3.0_wp*u(1) - 1.5_wp)
            self%scene%step(1)%nlgeom = .false.
            self%scene%material(1)%law = law_code("linear")
            self%is_at_once = .true.
            self%mu = merge(0.0_wp, 0.4_wp*u(2), mod(i, 2) == 0)
            if (mod(i/2, 2) == 1) self%way = 0.1_wp*(u(3) - 0.5_wp)
            self%is_linked = mod(i/4, 2) == 1
            if (self%is_linked) call align(self%scene)
            self%method = merge(method_saddle_point, method_null_space, mod(i/8, 2) == 1)
            self%was_active = u(4:6) > 0.6_wp
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.1_wp*u(4:6), self%was_active))
            call solve(self, error)
            self%active%is_candidate = self%active%start%was_active
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            associate (convergence => self%newton%convergence, phases => self%system%phases)
               call check_equal(error, convergence%n_iteration, 1, "tangents of case " &
                  // to_text(i))
               call check_true(error, convergence%history(2) <= tol .and. convergence%last <= tol, &
                  "what is left in case " // to_text(i) // ": " &
                  // to_text(convergence%history(2), 3))
               ! The rest of it is made exact by the same tangent, as long as that gains.
               call check_true(error, self%newton%n_solve <= 3, "corrections of case " &
                  // to_text(i))
               call check_equal(error, [self%newton%n_solve, int(phases%n_solve), &
                  int(phases%n_factorisation)], [convergence%n_history - 1, convergence%n_history &
                  - 1, 1], "what is counted in case " // to_text(i))
            end associate
         end block
      end do
   end subroutine test_linear

   !> A block at rest, without loads, one node of which is in the floor or over it: what its first
   !> guess leaves is how far, by the edge. Where none is in it nothing is loaded in the end.
   subroutine test_first_guess(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: edge = 2.0_wp, rise(3) = [0.01_wp, -0.01_wp, 0.0_wp]
      integer :: k

      do k = 1, size(rise)
         block
            type(case_t) :: self

            call make_case(self, 0.0_wp)
            self%scene%u0 = 0.0_wp
            self%scene%v0 = 0.0_wp
            self%is_at_once = .true.
            self%mu = 0.3_wp
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], rise(k)*[1.0_wp, 0.0_wp, 0.0_wp])
            self%floor(1)%size = edge
            self%pushes_out = .true.
            call solve(self, error)
            self%active%is_candidate = .false.
            call check_laws(self, "case " // to_text(k), error)
            if (allocated(error)) return
            call check_near(error, self%newton%convergence%history(1), abs(rise(k))/edge, &
               64.0_wp*eps, 0.01_wp, "left at first, case " // to_text(k))
            call check_true(error, self%newton%is_idle .eqv. k > 1, "idle, case " // to_text(k))
         end block
      end do
   end subroutine test_first_guess

   !> In equilibrium, its upper nodes pushed down and aside: by sets that trials tell, and all at
   !> once, a block comes to rest the same way.
   subroutine test_static(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(6), du(2, 6)
      integer :: i, k, n_stick, n_slide, n_settled

      n_stick = 0
      n_slide = 0
      n_settled = 0
      do i = 0, 31
         block
            type(case_t) :: first

            call draw_random(u)
            call make_case(first, 0.0_wp)
            do k = 1, 2
               block
                  type(case_t) :: self

                  self%scene = first%scene
                  self%is_static = .true.
                  self%has_impacts = .false.
                  self%is_at_once = k == 2
                  self%top = [0.2_wp*u(1) - 0.1_wp, -0.03_wp - 0.1_wp*u(2)]
                  self%mu = merge(0.0_wp, 0.3_wp, mod(i, 4) == 0)
                  self%was_active = u(4:6) > 0.5_wp
                  allocate(self%floor(1))
                  call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3))
                  call solve(self, error)
                  call check_laws(self, "case " // to_text(i) // ", way " // to_text(k), error)
                  if (allocated(error)) return
                  if (k == 1) du = self%motion%du
                  call check_near(error, self%motion%du, du, tol, 1.0_wp, "motion of case " &
                     // to_text(i))
                  if (k == 1) n_settled = n_settled + merge(1, 0, self%active%candidates%is_settled)
                  if (.not. self%active%friction%is_on) cycle
                  associate (kind => self%active%friction%law%status%kind)
                     n_stick = n_stick + count(self%active%is_active .and. kind == contact_sticks)
                     n_slide = n_slide + count(self%active%is_active .and. kind == contact_slides)
                  end associate
               end block
            end do
         end block
      end do
      call check_true(error, min(n_stick, n_slide) > 5, to_text(n_stick) // " stick, " // &
         to_text(n_slide) // " slide")
      call check_true(error, n_settled > 24, to_text(n_settled) // " of 32 by sets")
   end subroutine test_static

   !> A block that is pushed onto a floor to which it sticks, and begun with what came out: the set
   !> that acts is the first one and the last, and no tangent is asked for but to make it exact.
   subroutine test_again(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(2)
      integer :: i, k

      do i = 0, 7
         block
            type(case_t) :: self(2)

            call draw_random(u)
            call make_case(self(1), 0.0_wp)
            self(2)%scene = self(1)%scene
            do k = 1, 2
               associate (own => self(k))
                  own%is_static = .true.
                  own%has_impacts = .false.
                  own%mu = merge(0.0_wp, 5.0_wp, mod(i, 2) == 0)
                  own%top = [0.05_wp*u(1), -0.03_wp - 0.1_wp*u(2)]
                  own%was_active = [.false., .false., .false.]
                  allocate(own%floor(1))
                  call floor_make(own%floor(1), [1, 2, 3], own%scene%u0(2, :3))
                  if (k == 2) call begin_at_end(self(1), own)
                  call solve(own, error)
                  call check_laws(own, "turn " // to_text(k) // " of case " // to_text(i), error)
                  if (allocated(error)) return
               end associate
            end do
            associate (active => self(2)%active)
               call check_equal(error, active%candidates%n_change, [0, 0, 0], "changes")
               call check_true(error, active%n_newton <= 1 .and. active%candidates%is_settled, &
                  "tangents: " // to_text(active%n_newton))
               call check_near(error, self(2)%motion%du, self(1)%motion%du, tol, 1.0_wp, "motion")
            end associate
         end block
      end do
   end subroutine test_again

   !> A block that sticks to its floor is lifted at one end: what goes on to stick has not changed;
   !> what closes or opens has, once.
   subroutine test_one_opens(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 4
         block
            type(case_t) :: self

            call make_case(self, 0.0_wp)
            self%scene%u0 = 0.0_wp
            self%is_static = .true.
            self%has_impacts = .false.
            self%mu = merge(0.0_wp, 5.0_wp, mod(i, 2) == 0)
            self%top = [0.0_wp, -0.05_wp]
            self%tilt = 0.15_wp
            ! Pushed aside over a floor that is nearly smooth all come to slide.
            if (i == 4) self%mu = 0.05_wp
            if (i == 4) self%tilt = 0.0_wp
            if (i == 4) self%top(1) = 0.1_wp
            ! With a contact that closes beside the one that opens, or without.
            self%was_active = [mod(i, 4) < 2, .true., .true.]
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], [0.0_wp, 0.0_wp, 0.0_wp])
            call solve(self, error)
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            associate (own => self%active%candidates)
               call check_true(error, all(self%active%is_active .eqv. [.true., .true., i == 4]), &
                  "what acts")
               call check_equal(error, own%n_change, merge([1, 1, 1], [merge(0, 1, i < 2), 0, 1], &
                  i == 4), "changes of case " // to_text(i))
               call check_true(error, own%is_settled, "by sets")
            end associate
         end block
      end do
   end subroutine test_one_opens

   !> No force closes the contact of a node that nothing is free to move at: it is left out, and the
   !> others obey the laws.
   subroutine test_bound(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 15
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            self%is_bound = .true.
            self%mu = merge(0.0_wp, 0.3_wp, mod(i, 2) == 0)
            self%is_at_once = mod(i/2, 2) == 1
            self%has_impacts = mod(i/4, 2) == 1
            self%was_active = [.true., i > 7, .false.]
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.01_wp, self%was_active))
            call solve(self, error)
            if (self%is_at_once) self%active%is_candidate = self%active%start%was_active
            self%floor(1)%leaves(2) = .true.
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            call check_true(error, all(self%active%is_left_out .eqv. [.false., .true., .false.]), &
               "left out in case " // to_text(i))
            call check_true(error, all(self%active%is_active .eqv. [.true., .false., .true.]), &
               "acts in case " // to_text(i))
         end block
      end do
   end subroutine test_bound

   !> What acts, pushes and rubs, and the motion, as another has left them.
   subroutine begin_at_end(before, self)
      type(case_t), intent(in) :: before
      type(case_t), intent(inout) :: self
      integer :: k

      self%start = before%motion%du
      self%was_active = before%active%is_active
      allocate(self%lam(3), self%tau(3), source=0.0_wp)
      associate (set => before%active%set)
         self%lam(set%id(:set%n)) = set%lam(:set%n)
         do k = set%n + 1, set%n_row
            self%tau(set%id(set%condition(k))) = set%lam(k)
         end do
      end associate
   end subroutine begin_at_end

   !> What a floor pushes is the discrete gradient of what it stores, also where a node has left it
   !> or come onto it; with an augmented Lagrangian nothing is left of the gaps.
   subroutine test_soft(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u(7)
      integer :: i, n_left, n_came

      n_left = 0
      n_came = 0
      do i = 0, 47
         block
            type(case_t) :: self

            call draw_random(u)
            call make_case(self, 0.5_wp)
            if (mod(i, 3) == 1) self%scene%v0(2, :) = self%scene%v0(2, :) + 3.0_wp*u(7) &
               *(self%scene%x(1, :) - 0.5_wp)
            ! It rises as fast as it would fall.
            if (mod(i, 3) == 2) self%scene%v0(2, :) = self%scene%v0(2, :) + 2.0_wp
            self%stiffness = merge(1.0e5_wp, 100.0_wp*u(1), mod(i, 2) == 0)
            self%method = merge(method_augmented_lagrange, method_penalty, mod(i, 2) == 0)
            self%was_active = u(4:6) > 0.5_wp
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) + merge(merge(0.0_wp, &
               0.05_wp, mod(i, 2) == 0), -0.1_wp, self%was_active)*u(4:6))
            call solve(self, error)
            if (self%method == method_penalty) then
               call check_soft(self, "case " // to_text(i), n_left, n_came, error)
            else
               call check_laws(self, "case " // to_text(i), error)
            end if
            if (allocated(error)) return
         end block
      end do
      call check_true(error, min(n_left, n_came) > 5, to_text(n_left) // " have left the floor, " &
         // to_text(n_came) // " come onto it")
   end subroutine test_soft

   subroutine check_soft(self, what, n_left, n_came, error)
      type(case_t), intent(inout) :: self
      character(len=*), intent(in) :: what
      integer, intent(inout) :: n_left, n_came
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: left(:, :)
      real(wp) :: gap(0:1), push
      integer :: i

      call check_equal(error, self%status, step_done, what // ": status")
      if (allocated(error)) return
      call motion_evaluate(self%motion)
      call system_respond(self%system, self%motion, .false., .true.)
      left = self%system%response%residual
      associate (motion => self%motion, floor => self%floor(1))
         do i = 1, floor%n_constraint
            associate (node => floor%node(i))
               gap = motion%x(2, node) + motion%u0(2, node) - floor%height(i) + [0.0_wp, &
                  motion%du(2, node)]
               push = 0.5_wp*self%stiffness*(min(gap(0), 0.0_wp)**2 - min(gap(1), 0.0_wp)**2) &
                  /(gap(1) - gap(0))
               left(2, node) = left(2, node) - push
               if (gap(0) < 0.0_wp .and. gap(1) > 0.0_wp) n_left = n_left + 1
               if (gap(0) > 0.0_wp .and. gap(1) < 0.0_wp) n_came = n_came + 1
            end associate
         end do
      end associate
      call check_near(error, left, 0.0_wp*left, tol, maxval(self%system%response%magnitude), &
         what // ": balance")
   end subroutine check_soft

   !> Sets have settled the step, with the factor of its first tangent.
   subroutine check_one_factor(self, error)
      type(case_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_true(error, self%active%candidates%is_settled, "by sets")
      call check_equal(error, int(self%system%phases%n_factorisation), 1, "factors")
   end subroutine check_one_factor

   !> Two contacts at one node, as corners have them: both may push, their sum is what counts.
   subroutine test_redundant(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 7
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            if (mod(i, 2) == 1) self%mu = 0.3_wp
            self%keeps_factor = mod(i/2, 2) == 1
            if (i > 3) self%was_active = [.true., .true., .true., .true., .true., .true.]
            allocate(self%floor(2))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) &
               - merge(0.0_wp, 0.02_wp, i > 3))
            call floor_make(self%floor(2), [1, 2, 3], self%floor(1)%height)
            call solve(self, error)
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
         end block
      end do
   end subroutine test_redundant

   !> Node 2 closes, but its surface ends: it is let through, the others act.
   subroutine test_left(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 3
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            if (mod(i, 2) == 1) self%mu = 0.3_wp
            if (i > 1) self%was_active = [.true., .true., .true.]
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.0_wp, &
               0.01_wp, i > 1))
            self%floor(1)%leaves(2) = .true.
            call solve(self, error)
            call check_laws(self, "case " // to_text(i), error)
            if (allocated(error)) return
            call check_true(error, all(self%active%is_active .eqv. [.true., .false., .true.]), &
               "what acts")
         end block
      end do
   end subroutine test_left

   !> Node 2 has lost its surface where the step is first looked at, and closes all the same: it
   !> acts in the end. Where it loses that again the step cannot be solved.
   subroutine test_back(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, 3
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            if (mod(i, 2) == 1) self%mu = 0.3_wp
            self%was_active = [.true., .true., .true.]
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - 0.01_wp)
            self%floor(1)%leaves(2) = .true.
            self%floor(1)%leaves_at = [2]
            if (i > 1) self%floor(1)%leaves_at = [2, 4]
            call solve(self, error)
            if (allocated(error)) return
            if (i > 1) then
               call check_equal(error, self%status, step_too_far, "a second time")
               call check_true(error, all(self%active%candidates%is_blamed .eqv. [.false., &
                  .true., .false.]), "who is blamed")
            else
               self%floor(1)%leaves = .false.
               call check_laws(self, "case " // to_text(i), error)
               if (.not. allocated(error)) call check_true(error, all(self%active%is_active), &
                  "all act")
            end if
            if (allocated(error)) return
         end block
      end do
   end subroutine test_back

   !> The step is solved again while friction acts elsewhere, so often at most.
   subroutine test_lagged(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: most_of(0:3) = [0, 1, most_lagged + 1, 0]
      integer :: k, n_solve(0:3)

      do k = 0, 3
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            self%scene%v0(1, :) = 0.5_wp
            self%scene%v0(2, :) = -1.0_wp
            self%scene%u0 = 0.0_wp
            self%mu = 0.3_wp
            self%was_active = [.true., .true., .true.]
            self%holds_gap = .true.
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3))
            self%floor(1)%shift = merge(1.0_wp, 1.0e-3_wp, k > 0)
            ! Looks: as the step begins, and after each solve.
            if (k == 1) self%floor(1)%until = 2
            if (k == 3) self%mu = 0.0_wp
            call solve(self, error)
            call check_laws(self, "lag " // to_text(k), error)
            if (allocated(error)) return
            n_solve(k) = self%system%contact(1)%contact%n_look - 1
            call check_equal(error, self%active%friction%n_lagged, most_of(k), "lagged")
            if (allocated(error)) return
         end block
      end do
      call check_equal(error, n_solve(2) - n_solve(0), most_lagged, "solved again so often")
      call check_equal(error, n_solve(1) - n_solve(0), 1, "solved again once")
   end subroutine test_lagged

   !> Gaps that come out other than they were held are solved for again, three times; what does not
   !> act does not matter.
   subroutine test_stale(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 0, 5
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            self%scene%v0(2, :) = merge(1.0_wp, -1.0_wp, k == 5)
            self%was_active = [k < 5, k < 5, k < 5]
            self%holds_gap = .true.
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3))
            self%floor(1)%drift = 2.0_wp*touch_tol
            self%floor(1)%until = 1 + k
            call solve(self, error)
            if (allocated(error)) return
            if (k < 4 .or. k == 5) call check_laws(self, "stale " // to_text(k), error)
            call check_equal(error, self%status, merge(step_too_far, step_done, k == 4), "status")
            call check_equal(error, self%active%n_stale, merge(0, k, k == 5), "solved again")
            call check_true(error, all(self%active%candidates%is_blamed .eqv. k == 4), "blamed")
            if (allocated(error)) return
         end block
      end do
   end subroutine test_stale

   !> Contacts whose stencils were chosen for another motion, from gaps that are too large for a
   !> step with impacts, and above those that the deck allows to be held.
   subroutine test_begins(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: expected(0:5) = [step_done, step_too_far, step_too_far, step_too_far, &
         step_stands_off, step_done]
      integer :: k

      do k = 0, 5
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            allocate(self%floor(1))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - 0.01_wp)
            if (k == 1) self%floor(1)%is_seen(2) = .false.
            if (k == 2) self%was_active = [.true., .true., .true.]
            if (k == 2) self%floor(1)%is_seen(2) = .false.
            if (k == 3) self%floor(1)%max_gap_on_entry = 0.005_wp
            if (k > 3) self%active%rules%gap_tolerance = merge(0.005_wp, 0.02_wp, k == 4)
            self%holds_gap = k > 3
            call solve(self, error)
            if (allocated(error)) return
            call check_equal(error, self%status, expected(k), "status of case " // to_text(k))
            if (k < 3) call check_true(error, all(self%active%candidates%is_blamed .eqv. [.false., &
               k > 0, .false.]), "blamed in case " // to_text(k))
            if (expected(k) == step_done) call check_laws(self, "case " // to_text(k), error)
            if (allocated(error)) return
         end block
      end do
   end subroutine test_begins

   !> Pairs and guards would be closed without contact; the pairs hold the block off the guards,
   !> which act where no pair does.
   subroutine test_guard(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 0, 1
         block
            type(case_t) :: self

            call make_case(self, 0.5_wp)
            allocate(self%floor(2))
            call floor_make(self%floor(1), [1, 2, 3], self%scene%u0(2, :3) - merge(0.001_wp, &
               1.0_wp, k == 0))
            call floor_make(self%floor(2), [1, 2, 3], self%scene%u0(2, :3) - 0.001_wp)
            self%floor(2)%slack = 0.01_wp
            self%floor(2)%closed = -0.01_wp
            call solve(self, error)
            call check_laws(self, "case " // to_text(k), error)
            if (allocated(error)) return
            call check_true(error, all(self%active%is_candidate .eqv. [k == 0, k == 0, k == 0, &
               k == 1, k == 1, k == 1]), "who takes part")
         end block
      end do
   end subroutine test_guard

end module test_contact_rounds
