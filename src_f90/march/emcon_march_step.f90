!> One step in time: first guess, solution, and what follows from it for state and works.
!>
!> `march_t` holds all that a march through time needs; how it cuts and counts: emcon_march.
module emcon_march_step
   use emcon_active_set, only : active_set_begin, active_set_solve, active_set_t, step_done, &
      step_overlaps, step_refused
   use emcon_amplitudes, only : find_amplitude_value
   use emcon_constraints, only : constraint_place, constraints_force
   use emcon_correction, only : correction_reason
   use emcon_errors, only : error_t
   use emcon_given_scheme, only : given_scheme_t
   use emcon_guards, only : guard_slack
   use emcon_holding, only : holding_t
   use emcon_judge, only : judge_step, judge_t, overlap_t
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_prescribed, only : prescribed_motion
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_newton, only : interrupt_interface, newton_t
   use emcon_numbering, only : gather_dependent, spread_dependent
   use emcon_pair_record, only : pair_record_measure
   use emcon_pose, only : instant_later, instant_t, pose_at_end, pose_velocity, pose_way
   use emcon_scene, only : scene_t
   use emcon_scheme, only : scheme_t
   use emcon_sparse_solver, only : solver_box_t
   use emcon_stand_off, only : stand_off_add, stand_off_t
   use emcon_state, only : state_t
   use emcon_steps, only : initiation_velocity_update
   use emcon_system, only : system_respond, system_t
   use emcon_term, only : role_external, role_inertia, role_internal
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   use emcon_timer, only : stopwatch_start, stopwatch_stop, stopwatch_t
   use emcon_velocity_update, only : velocity_update_apply, velocity_update_t
   implicit none
   private
   public :: march_t, increment_t, part_t, march_step, march_guess, follow_links, cycling_text

   !> New overlap beyond this, by the edge, cuts an increment, down to this level of its halvings.
   real(wp), parameter :: deepest_new = 1.2_wp*guard_slack
   integer, parameter :: judge_levels = 5
   !> Nodes named in a message.
   integer, parameter :: most_named = 10

   !> What one increment took.
   type :: increment_t
      real(wp) :: h = 0.0_wp
      real(wp) :: done = 0.0_wp                  !! part of `h` that the state has gone on by
      integer :: n_newton = 0                    !! iterations, over all cuts and active sets
      integer :: n_cut = 0
      integer :: n_active = 0
      logical :: is_guarded = .false.            !! guards act in it
      integer :: n_held = 0                      !! contacts held closed that come and go
      type(overlap_t) :: overlap                 !! the deepest of bodies, by the judge
      type(stand_off_t) :: stand_off             !! air across which contact forces act
      real(wp), allocatable :: residual(:)       !! relative, of the last Newton solve
      !> Largest relative residual above Newton's tolerance that was accepted; 0: there is none.
      real(wp) :: unconverged = 0.0_wp
      type(notes_t) :: notes                     !! for the log
      type(notes_t) :: warnings                  !! for the log, the user and the verdict
   end type increment_t

   !> What the elements and the given forces have come to at the end of a step.
   type :: ending_t
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) internal forces [M L/T^2]
      real(wp), allocatable :: energy(:)         !! (n_element) [M L^2/T^2]
      real(wp) :: potential = 0.0_wp             !! of the given forces [M L^2/T^2]
   end type ending_t

   !> The part of an increment that is one step.
   type :: part_t
      type(instant_t) :: start
      real(wp) :: h = 0.0_wp                     !! > 0 [T]
      logical :: may_cut = .false.               !! smaller ones are possible
   end type part_t

   type :: march_t
      type(system_t) :: system
      type(state_t) :: state
      type(ledger_t) :: ledger
      class(scheme_t), allocatable :: scheme
      type(given_scheme_t), allocatable :: given_scheme(:)   !! (any) by the program
      type(newton_t) :: newton
      type(active_set_t) :: active
      type(velocity_update_t) :: velocity_update
      type(solver_box_t), allocatable :: solver(:)   !! that a program has given
      type(notes_t) :: warnings                  !! to be told with the next increment
      type(judge_t) :: judge
      type(stopwatch_t) :: judge_clock
      !> Overlap per edge with which a step began that resolves it
      real(wp) :: meant_overlap = 0.0_wp
      integer :: n_grid = 0                      !! grid increments in the step
      integer :: most_stride = 1                 !! largest increment, in grid increments
      integer :: n_level = 0                     !! halvings allowed
      integer :: revision = 0                    !! changes with the numbering of the unknowns
      type(motion_t) :: motion                   !! of the step
      real(wp), allocatable :: v1(:, :)          !! (n_dim, n_node) velocity at its end
      !> Asked before each iteration, if there is one.
      procedure(interrupt_interface), pointer, nopass :: is_interrupted => null()
   end type march_t

contains

   !> One step; if it succeeds the state and the works are moved on.
   subroutine march_step(self, scene, part, increment, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      type(ending_t) :: ending
      integer :: attempt

      self%active%may_cut = part%may_cut
      self%active%gap_tolerance = 0.0_wp
      if (part%may_cut) self%active%gap_tolerance = scene%step(self%state%i_step)%gap_tolerance
      self%active%left = [overclosure_left(scene, self%state, part%start%step_time), &
         overclosure_left(scene, self%state, part%start%step_time + part%h)]
      do attempt = 1, 2
         call march_guess(self, scene, part%start, part%h, is_at_rest=attempt == 2)
         call active_set_begin(self%active, self%system, self%motion, self%state)
         call active_set_solve(self%active, self%system, scene, self%newton, &
            self%motion, status, error)
         if (allocated(error)) return
         increment%n_newton = increment%n_newton + self%active%n_newton
         if (status /= step_refused .or. self%active%n_newton > 0) exit
      end do
      if (status /= step_done) return
      call judge(self, scene, part, increment, status)
      if (status == step_done) call find_ending(self, ending, status, error)
      if (status /= step_done .or. allocated(error)) return
      if (any(self%active%comes_and_goes)) call tell_held(self, scene, increment)
      if (any(self%active%is_dropped)) then
         call nodes_text(self, scene, self%active%is_dropped, text)
         call note_add(increment%notes, "contact is left out, as it follows from that of other " &
            // "nodes or has lost its surface, at slave nodes " // text)
      end if
      call commit(self, scene, part%h, ending, increment, error)
   end subroutine march_step

   !> Look at the end of the solved step, where the scheme evaluates forces before it.
   subroutine find_ending(self, ending, status, error)
      type(march_t), intent(inout) :: self
      type(ending_t), intent(out) :: ending
      integer, intent(inout) :: status           !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_elsewhere

      is_elsewhere = self%motion%pose%place < 1.0_wp
      associate (system => self%system, motion => self%motion)
         if (is_elsewhere) call system_respond(system, motion_of(pose_at_end, motion%x, motion%u0, &
            motion%du), .false.)
         if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
         if (allocated(system%response%refusal)) status = step_refused
         if (status /= step_done .or. allocated(error)) return
         ending%force = system%response%part(role_internal)%force
         ending%energy = system%response%energy
         ending%potential = system%response%potential
         if (is_elsewhere) call system_respond(system, motion, .false.)
      end associate
   end subroutine find_ending

   !> The part of the overclosure at the start of the step that is left at `step_time`.
   pure real(wp) function overclosure_left(scene, state, step_time)
      type(scene_t), intent(in) :: scene
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: step_time          !! [T]
      real(wp) :: slope

      associate (step => scene%step(state%i_step))
         overclosure_left = 1.0_wp - step_time/step%duration
         if (step%overclosure_amplitude == 0) return
         associate (amplitude => scene%amplitude(step%overclosure_amplitude))
            call find_amplitude_value(amplitude, step_time, overclosure_left, slope)
         end associate
      end associate
   end function overclosure_left

   !> Let the judge look at the solved step: cut it, or keep what was found.
   subroutine judge(self, scene, part, increment, status)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      integer, intent(inout) :: status
      type(overlap_t) :: overlap

      call stopwatch_start(self%judge_clock)
      call judge_step(self%judge, scene%x, self%state%u, self%motion%du, overlap)
      overlap%depth = max(0.0_wp, overlap%depth - self%active%left(1)*self%meant_overlap)
      if (part%may_cut .and. part%h > scale(increment%h, -judge_levels)) then
         if (goes_in(self, scene, overlap)) status = step_overlaps
      end if
      call stopwatch_stop(self%judge_clock)
      if (status == step_done .and. overlap%depth > increment%overlap%depth) &
         increment%overlap = overlap
   end subroutine judge

   !> Has the step brought bodies deeper into each other than guards allow, at nodes that contact of
   !> both sides could hold and does not? In a smaller step it sees them come.
   logical function goes_in(self, scene, overlap)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(overlap_t), intent(in) :: overlap
      type(overlap_t) :: before
      integer :: pair

      goes_in = .false.
      if (overlap%depth <= deepest_new) return
      do pair = 1, size(self%system%contact)
         associate (contact => self%system%contact(pair)%contact, &
               is_active => self%active%is_active(self%system%first_constraint(pair) + 1:))
            if (.not. contact%both_sides) cycle
            goes_in = goes_in .or. any(.not. is_active(:contact%n_constraint) .and. &
               (contact%node == overlap%node .or. contact%node == overlap%edge(1) .or. &
               contact%node == overlap%edge(2)))
         end associate
      end do
      if (.not. goes_in) return
      call judge_step(self%judge, scene%x, self%state%u, at_rest(self%motion%du), before)
      goes_in = overlap%depth > before%depth + 0.1_wp*deepest_new
   end function goes_in

   !> Tell of contacts that are held closed because they open and close in turn. Where the gap of
   !> the start is held that makes no energy; else what pulls there is an error of the forces.
   subroutine tell_held(self, scene, increment)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(inout) :: increment
      character(len=:), allocatable :: text

      increment%n_held = max(increment%n_held, count(self%active%comes_and_goes))
      call cycling_text(self, scene, text)
      if (self%active%holds_gap) then
         call note_add(increment%notes, text // ": held closed in this step")
      else
         call note_add(increment%warnings, text // ": held closed in this step, the smallest " // &
            "allowed, where they may pull")
      end if
   end subroutine tell_held

   !> The contacts of the last step that opened and closed in turn, by their slave nodes.
   subroutine cycling_text(self, scene, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text   !! names nodes by their labels

      call nodes_text(self, scene, self%active%comes_and_goes, text)
      text = "contact opens and closes in turn at slave nodes " // text
   end subroutine cycling_text

   !> The slave nodes of the constraints that `is_meant` marks.
   subroutine nodes_text(self, scene, is_meant, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_meant(:)         !! (n_constraint)
      character(len=:), allocatable, intent(out) :: text
      type(string_t) :: found(size(is_meant))
      integer :: id, n, pair, i

      n = 0
      do id = 1, size(is_meant)
         if (.not. is_meant(id)) cycle
         call constraint_place(self%system, id, pair, i)
         if (pair == 0) cycle
         n = n + 1
         found(n)%text = to_text(scene%node_label(self%system%contact(pair)%contact%node(i)))
      end do
      text = joined(found(:n), ", ", most_named)
   end subroutine nodes_text

   !> First guess of the motion, and the motion and velocity of prescribed freedoms, with the offset
   !> of docs/theory.md, eq. (4).
   subroutine march_guess(self, scene, start, h, is_at_rest)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical, intent(in) :: is_at_rest          !! free nodes do not move in the guess
      type(instant_t) :: finish
      real(wp) :: u, v
      integer :: k

      finish = instant_later(start, h)
      self%motion%pose = self%scheme%pose(start, h)
      self%motion%u0 = self%state%u
      self%motion%v0 = self%state%v
      self%motion%offset = 0.0_wp
      self%motion%du = 0.0_wp
      if (self%scheme%row%masses_resist .and. .not. is_at_rest) self%motion%du = h*self%state%v
      where (.not. self%system%space%is_alive) self%motion%du = 0.0_wp
      self%newton%driven = 0.0_wp
      associate (state => self%state, step => scene%step(self%state%i_step))
         do k = 1, size(step%prescribed)
            associate (a => step%prescribed(k)%dof, i => step%prescribed(k)%node)
               call prescribed_motion(scene, step, step%prescribed(k), finish, &
                  state%u_start(a, i), u, v)
               self%motion%du(a, i) = u - state%u(a, i)
               self%v1(a, i) = v
               if (self%scheme%row%masses_resist) then
                  self%motion%offset(a, i) = pose_way(self%motion%pose, state%v(a, i), v) &
                     - self%motion%du(a, i)
               else
                  self%newton%driven(a, i) = self%motion%du(a, i)
               end if
            end associate
         end do
      end associate
      call follow_links(self%system, self%motion%du)
      call follow_links(self%system, self%motion%offset)
      call follow_links(self%system, self%newton%driven)
   end subroutine march_guess

   !> Let dependent entries of a motion follow the others, also where `numbering` does not know
   !> them: with multipliers they have to move in the same way.
   subroutine follow_links(system, field)
      type(system_t), intent(in) :: system
      real(wp), intent(inout), contiguous :: field(:, :)     !! (n_dim, n_node)

      if (system%linear%n > 0) call spread_dependent(system%space%linked, field)
   end subroutine follow_links

   !> Take over the solved step: works, velocities, contact and reaction forces.
   subroutine commit(self, scene, h, ending, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h
      type(ending_t), intent(in) :: ending
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      integer :: i, a, k

      associate (state => self%state, system => self%system, set => self%active%set)
         system%response%residual = system%response%residual - self%newton%contact
         call gather_dependent(system%space%numbering, system%response%residual)
         call book_stabilization(self, increment)
         do i = 1, size(state%v, 2)
            do a = 1, size(state%v, 1)
               if (system%space%numbering%unknown(a, i) > 0) then
                  self%v1(a, i) = pose_velocity(self%motion%pose, state%v(a, i), &
                     self%motion%du(a, i))
                  system%response%residual(a, i) = 0.0_wp
               end if
            end do
         end do
         call follow_links(system, self%v1)
         state%reaction = system%response%residual
         if (set%n_held > 0) call constraints_force(set, set%n_held + 1, self%newton%contact)
         call book_work(self)
         if (scene%step(state%i_step)%initiation == initiation_velocity_update &
            .and. self%scheme%row%masses_resist) call restore_energy(self, increment%notes, error)
         if (allocated(error)) return
         state%u = state%u + self%motion%du
         state%v = self%v1
         state%contact = self%newton%contact
         call pair_record_measure(state%pairs, system, set, scene%x, state%u, self%motion%du, &
            merge(0.5_wp, 0.0_wp, self%scheme%row%masses_resist))
         state%internal = ending%force
         state%energy = ending%energy
         state%potential = ending%potential
         if (self%newton%correction%fell_back .and. set%n > 0) call note_add(increment%notes, &
            trim(correction_reason(self%newton%correction)) // ": solved as a saddle point")
         call stand_off_add(increment%stand_off, system, set, h)
         increment%is_guarded = increment%is_guarded .or. &
            any(set%id > system%first_constraint(system%n_pair + 1))
         increment%residual = self%newton%history(:self%newton%n_history)
         if (self%newton%last > self%newton%tolerance .and. .not. self%newton%is_idle) then
            increment%unconverged = max(increment%unconverged, self%newton%last)
            call note_add(increment%notes, "a relative residual of " // &
               to_text(self%newton%last, 3) // " is accepted as round-off")
         end if
         state%is_active = .false.
         state%lam = 0.0_wp
         do k = 1, set%n
            state%is_active(set%id(k)) = .true.
            state%lam(set%id(k)) = set%lam(k)
         end do
      end associate
   end subroutine commit

   !> Give back by a jump of the velocities what closing contacts have taken.
   subroutine restore_energy(self, notes, error)
      type(march_t), intent(inout) :: self
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: restored
      logical :: has_root

      call velocity_update_apply(self%velocity_update, self%system, self%active%set, self%v1, &
         restored, has_root, error)
      if (allocated(error)) return
      self%ledger%contact_work = self%ledger%contact_work + restored
      if (restored > 0.0_wp) call note_add(notes, "velocity update restores an energy of " // &
         to_text(restored))
      if (.not. has_root) call note_add(notes, &
         "velocity update: no root, the energy lost in this step is not restored")
   end subroutine restore_energy

   !> Tell of what moves with nothing to hold it, and of what was brought into contact without load.
   !> The stiffness of STABILIZE is in the tangent alone: it bears what the balance leaves over.
   subroutine book_stabilization(self, increment)
      type(march_t), intent(inout) :: self
      type(increment_t), intent(inout) :: increment
      integer :: i, a

      associate (holding => self%active%holding, system => self%system)
         if (.not. holding%is_needed) return
         if (any(holding%brought > 0.0_wp .and. self%active%is_active)) call note_add( &
            increment%warnings, holding%brought_text // ", on which no load does work: moved " // &
            "over a gap of " // to_text(maxval(holding%brought, mask=self%active%is_active), 3) &
            // " onto the surface nearest to it")
         if (.not. allocated(holding%text)) return
         call tell_stabilized(self%active%holding, increment)
         do i = 1, size(self%motion%du, 2)
            do a = 1, size(self%motion%du, 1)
               if (system%space%numbering%unknown(a, i) == 0) cycle
               self%ledger%stabilization = self%ledger%stabilization &
                  - system%response%residual(a, i)*self%motion%du(a, i)
            end do
         end do
      end associate
   end subroutine book_stabilization

   !> Tell once in a step of a body that moves with nothing to hold it.
   subroutine tell_stabilized(holding, increment)
      type(holding_t), intent(inout) :: holding
      type(increment_t), intent(inout) :: increment
      integer :: n

      n = index(holding%text, " free to ")
      if (allocated(holding%told)) then
         if (holding%told == holding%text(:n)) return
      end if
      holding%told = holding%text(:n)
      call note_add(increment%warnings, holding%text // ", on which no load does work: the " // &
         "smallest motion is taken, as STABILIZE asks for")
   end subroutine tell_stabilized

   !> Add the works of the step. With inertia the sums are exact for discrete gradients (see
   !> docs/theory.md, eq. (23)); in statics forces are taken as linear over the step.
   subroutine book_work(self)
      type(march_t), intent(inout) :: self
      real(wp) :: contact_work
      integer :: k

      associate (state => self%state, part => self%system%response%part, &
            set => self%active%set, motion => self%motion)
         contact_work = 0.0_wp
         if (self%scheme%row%masses_resist) then
            do k = 1, set%n
               contact_work = contact_work + set%lam(k)*set%item(k)%dgap
            end do
            self%ledger%external_work = self%ledger%external_work &
               + sum(part(role_external)%force*motion%du) + sum(state%reaction*motion%du) &
               + sum(part(role_inertia)%force*motion%offset)
         else
            contact_work = 0.5_wp*sum((state%contact + self%newton%contact)*motion%du)
            self%ledger%external_work = self%ledger%external_work - contact_work &
               + 0.5_wp*sum((state%internal + part(role_internal)%force)*motion%du)
         end if
         self%ledger%contact_work = self%ledger%contact_work + contact_work
      end associate
   end subroutine book_work

end module emcon_march_step
