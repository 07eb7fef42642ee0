!> Steps of central differences: what comes before and after the solution for the displacements.
!>
!> Forces are those at the start of a step, which the step before has left. A step is half a push by
!> them and by multipliers that hold its end, the way, and half a push by the forces at the end and
!> by multipliers that hold velocities there. Source: docs/theory.md, section 13.
module emcon_explicit
   use emcon_active_set, only : active_set_is_empty, active_set_select, step_done
   use emcon_contact_rounds, only : contact_rounds_stand
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_set_t, constraints_force
   use emcon_critical_step, only : critical_bound, critical_sharp
   use emcon_csr, only : csr_find
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_evaluation, only : instant_later, instant_t, evaluation_at_end
   use emcon_explicit_push, only : explicit_push
   use emcon_explicit_penalty, only : explicit_penalty_limit, explicit_penalty_push, &
      explicit_penalty_widen
   use emcon_kinds, only : dp, wp
   use emcon_lagged_forces, only : lagged_forces_take
   use emcon_march_guess, only : follow_links
   use emcon_march_types, only : march_t, part_t
   use emcon_motion, only : motion_init, motion_evaluate
   use emcon_numbering, only : add_to_dofs, gather_dependent, pick_unknowns
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_scene, only : scene_t, where_text
   use emcon_system, only : mass_times, system_check_response, system_find_energy, system_respond
   use emcon_term, only : role_external, role_internal
   use emcon_term_registry, only : terms_mass_values
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: explicit_prepare, explicit_begin, explicit_fly, explicit_end, explicit_commit

   !> After so many increments the critical step is looked at again.
   integer, parameter :: overlap_query_every = 200
   !> Energy that grows by so much more than what was put in grows without bound: at 0.9999 of the
   !> critical step the fastest vibration holds 5000 times its energy for a while.
   real(wp), parameter :: most_growth = 1.0e6_wp
   !> W^T W of the constraints may be larger than where there is a matrix to compare it with.
   integer, parameter :: most_products = 400

contains

   !> Set up for an explicit step: all unknowns need mass, and the increment has a limit, unless the
   !> state knows it: within a step it is looked at now and then.
   subroutine explicit_prepare(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      logical :: is_known, is_bounded

      self%newton%correction%kept%most_products = most_products
      call check_mass(self, scene, error)
      if (allocated(error)) return
      call explicit_penalty_limit(self, scene)
      associate (place => self%explicit%place, step => scene%step(self%state%clock%i_step), &
            limit => self%state%explicit%critical_h)
         call motion_init(place, scene%x)
         call rest_at(self, instant_t(), self%state%u)
         is_known = limit > 0.0_wp
         if (.not. is_known) then
            self%state%explicit%budget = 0.0_wp
            call critical_bound(self%system, place, self%explicit%stiffness, limit, &
               self%state%explicit%critical_element, is_bounded)
            if (step%time%h > limit .or. .not. is_bounded) call critical_sharp(self%system, place, &
               self%explicit%stiffness, limit, error)
            if (allocated(error)) return
         end if
         if (.not. limit < huge(limit)) return
         call limit_text(self, scene, text)
         if (step%time%h > limit .and. .not. is_known) then
            call raise(error, err_input, where_text(scene, step%origin) // ": error: the " // &
               "increment " // to_text(step%time%h) // " is larger than " // text // ": an " // &
               "explicit step grows without bound; give a smaller increment, or an implicit step")
            return
         end if
         call note_add(self%system%notes, text // "; h is " // to_text(step%time%h/limit, 3) &
            // " of it")
      end associate
   end subroutine explicit_prepare

   !> "the critical step ... (element ...)"
   subroutine limit_text(self, scene, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text

      text = "the critical step " // to_text(self%state%explicit%critical_h)
      if (self%active%penalty%is_at_ends) text = text // " with closed contacts"
      if (self%state%explicit%critical_element > 0) text = text // " (the fastest element is " // &
         to_text(scene%element%label(self%state%explicit%critical_element)) // ")"
   end subroutine limit_text

   !> Each unknown has mass: it is kept where that is a diagonal.
   subroutine check_mass(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: value(:)
      real(wp), dimension(size(scene%x, 1), size(scene%x, 2)) :: weight
      integer :: k

      call terms_mass_values(self%system%term, value)
      associate (matrix => self%system%matrix, numbering => self%system%space%numbering)
         do k = 1, numbering%n_unknown
            if (value(csr_find(matrix, k, k)) > 0.0_dp) cycle
            call raise(error, err_input, where_text(scene, &
               scene%step(self%state%clock%i_step)%origin) // ": error: node " // &
               to_text(scene%node%label((numbering%dof(k) - 1)/size(scene%x, 1) + 1)) // &
               " has no mass: in an explicit step all nodes that are not prescribed need mass")
            return
         end do
         if (allocated(self%explicit%mass)) deallocate(self%explicit%mass)
         if (size(value) > numbering%n_unknown .or. numbering%n_dependent > 0) return
         call mass_times(self%system, 1.0_wp + 0.0_wp*self%state%u, weight)
         allocate(self%explicit%mass(numbering%n_unknown))
         call pick_unknowns(numbering, weight, self%explicit%mass)
      end associate
   end subroutine check_mass

   !> Let the place be `u`, at rest, with the loads of `instant`.
   subroutine rest_at(self, instant, u)
      type(march_t), intent(inout) :: self
      type(instant_t), intent(in) :: instant
      real(wp), intent(in), contiguous :: u(:, :)        !! (n_dim, n_node) [L]

      associate (place => self%explicit%place)
         place%evaluation = evaluation_at_end
         place%evaluation%load_instant = instant
         place%u0 = u
         call motion_evaluate(place)
      end associate
   end subroutine rest_at

   !> The forces at the start of a step, unless the step before has left them.
   subroutine explicit_begin(self, scene, part, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error
      logical :: is_known, has_grown

      associate (system => self%system, explicit => self%explicit)
         system%lagged%is_on = .false.
         is_known = system%lagged%is_known
         if (is_known) is_known = all(abs(explicit%place%u0 - self%state%u) <= 0.0_wp)
         if (.not. is_known) then
            call rest_at(self, part%start, self%state%u)
            call system_respond(system, explicit%place, .false.)
            call system_check_response(system, "at the start of the increment", error)
            if (allocated(error)) return
            call explicit_penalty_push(self, is_end=.false.)
            call lagged_forces_take(system%lagged, system%response)
         end if
         call explicit_penalty_widen(self, has_grown)
         if (mod(self%state%clock%increment, overlap_query_every) == 0 &
            .and. self%state%clock%increment > self%state%clock%n_before) call find_limit(self, &
            part, error)
         if (has_grown .and. .not. allocated(error)) call critical_sharp(system, explicit%place, &
            0.0_wp*explicit%stiffness, self%state%explicit%critical_h, error, &
            explicit%penalty(explicit%i_start))
         if (.not. allocated(error)) call check_limit(self, scene, part, error)
         system%lagged%is_on = .not. allocated(error)
      end associate
   end subroutine explicit_begin

   !> Is the step below the critical one, as last found?
   subroutine check_limit(self, scene, part, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      if (part%h <= self%state%explicit%critical_h) return
      call limit_text(self, scene, text)
      call raise(error, err_analysis, "the analysis stops at time " // &
         to_text(part%start%total_time, 9) // ": the increment " // to_text(part%h) // &
         " is larger than " // text // "; go on from there with a smaller one")
   end subroutine check_limit

   !> Find the critical step at the present place, unless that is above the step for sure.
   subroutine find_limit(self, part, error)
      type(march_t), intent(inout) :: self
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: bound
      integer :: element
      logical :: is_bounded

      associate (explicit => self%explicit)
         call critical_bound(self%system, explicit%place, explicit%stiffness, bound, element, &
            is_bounded)
         if (part%h <= bound .and. is_bounded) return
         call critical_sharp(self%system, explicit%place, explicit%stiffness, &
            self%state%explicit%critical_h, error)
         self%state%explicit%critical_element = element
      end associate
   end subroutine find_limit

   !> The way of a step in which nothing is held, the mass a diagonal; else, and where contacts
   !> close on it, `is_done` is false, and it is a first guess.
   subroutine explicit_fly(self, h, is_done, status)
      type(march_t), intent(inout) :: self       !! a step has begun
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical, intent(out) :: is_done            !! else it is to be solved
      integer, intent(inout) :: status           !! one of the `step_` codes, if it is done
      real(wp) :: push(self%system%space%numbering%n_unknown)
      integer :: left

      is_done = .false.
      self%explicit%is_free = .false.
      if (.not. allocated(self%explicit%mass)) return
      associate (system => self%system, motion => self%motion, active => self%active, &
            reached => self%newton%convergence)
         call motion_evaluate(motion)
         call system_respond(system, motion, .false., .false.)
         call pick_unknowns(system%space%numbering, system%response%residual, push)
         call add_to_dofs(system%space%numbering, push/self%explicit%mass, -0.5_wp*h*h, motion%du)
         if (.not. active_set_is_empty(active)) return
         call phase_enter(system%phases, phase_gaps, left)
         call active_set_select(active, system, motion)
         is_done = size(system%contact) == 0 .or. active%penalty%is_at_ends
         status = step_done
         if (.not. is_done) call contact_rounds_stand(active, system, motion, is_done, status)
         call phase_leave(system%phases, left)
         if (.not. is_done) return
         self%explicit%is_free = .true.
         self%newton%contact = 0.0_wp
         reached%n_history = 1
         reached%history(1) = 0.0_wp
         reached%last = 0.0_wp
      end associate
   end subroutine explicit_fly

   !> Forces and energies at the end of the solved step, and the velocities there.
   subroutine explicit_end(self, scene, part, is_refused, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      logical, intent(out) :: is_refused         !! there are no forces there
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: u1(size(scene%x, 1), size(scene%x, 2))

      is_refused = .false.
      associate (system => self%system, end_state => self%end_state, explicit => self%explicit)
         explicit%start = system%response%residual
         explicit%load0 = system%response%part(role_external)%force
         u1 = self%state%u + end_state%du
         if (size(scene%rigid) > 0) call follow_links(system, u1)
         system%lagged%is_on = .false.
         call check_finite(u1, "displacements", part, error)
         if (allocated(error)) return
         call rest_at(self, instant_later(part%start, part%h), u1)
         call system_respond(system, explicit%place, .false.)
         if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
         is_refused = allocated(system%response%refusal)
         if (is_refused .or. allocated(error)) then
            call rest_at(self, part%start, self%state%u)
            if (is_refused) call find_limit(self, part, error)
            if (.not. allocated(error)) call check_limit(self, scene, part, error)
            return
         end if
         call system_find_energy(system, explicit%place)
         end_state%force = system%response%part(role_internal)%force
         end_state%energy = system%response%energy
         end_state%potential = system%response%potential
         explicit%load = system%response%part(role_external)%force
         call explicit_penalty_push(self, is_end=.true.)
         call lagged_forces_take(system%lagged, system%response)
         call explicit_push(self, part%h, error)
         if (allocated(error)) return
         call check_finite(explicit%v1, "velocities", part, error)
         system%response%residual = explicit%start
      end associate
   end subroutine explicit_end

   !> What is not finite ends the analysis.
   subroutine check_finite(field, what, part, error)
      real(wp), intent(in) :: field(:, :)        !! (n_dim, n_node)
      character(len=*), intent(in) :: what
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error

      if (all(abs(field) <= huge(1.0_wp))) return
      call raise(error, err_analysis, "the analysis stops at time " // &
         to_text(part%start%total_time, 9) // ": the explicit step grows without bound, " // what &
         // " are not finite; give a smaller increment")
   end subroutine check_finite

   !> Book the step: the two pushes are taken as one by their mean. `self%newton%contact` and
   !> `self%state%reaction` are those at its start; the works are exact but for those of elements.
   subroutine explicit_commit(self, h, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: work, contact
      integer :: k

      associate (state => self%state, set => self%active%set, explicit => self%explicit, &
            motion => self%motion)
         call gather_dependent(self%system%space%numbering, explicit%residual)
         where (self%system%space%numbering%unknown > 0) explicit%residual = 0.0_wp
         state%reaction = 0.5_wp*(state%reaction + explicit%residual)
         self%newton%contact = 0.5_wp*(self%newton%contact + explicit%contact)
         if (self%active%penalty%is_at_ends) call constraints_force(explicit%penalty(1 &
            - explicit%i_start), 1, self%newton%contact)
         contact = 0.0_wp
         do k = 1, set%n
            contact = contact + 0.25_wp*(set%lam(k)*(h*gap_change(set, k, state%v) &
               + gap_change(set, k, motion%du)) + explicit%mu(k)*(condition_rate(set%item(k), &
               motion%du) + h*condition_rate(set%item(k), self%end_state%v)))
            set%lam(k) = 0.5_wp*(set%lam(k) + explicit%mu(k))
         end do
         work = 0.5_wp*sum((explicit%load0 + explicit%load)*motion%du) &
            + sum(state%reaction*motion%du) + driven_work(self, h)
         self%ledger%contact_work = self%ledger%contact_work + contact
         self%ledger%external_work = self%ledger%external_work + work
         call check_growth(self, abs(work), error)
      end associate
   end subroutine explicit_commit

   !> What gives driven masses their velocities works by the mean of those before and after, not by
   !> the way of the step over its duration: where a velocity jumps these are two.
   real(wp) function driven_work(self, h) result(work)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), dimension(size(self%state%v, 1), size(self%state%v, 2)) :: change, impulse

      work = 0.0_wp
      associate (v0 => self%state%v, v1 => self%end_state%v, &
            numbering => self%system%space%numbering)
         change = v1 - v0
         where (numbering%unknown > 0) change = 0.0_wp
         if (.not. any(abs(change) > 0.0_wp)) return
         change = v1 - v0
         call mass_times(self%system, change, impulse)
         call gather_dependent(numbering, impulse)
         where (numbering%unknown > 0) impulse = 0.0_wp
         work = sum(impulse*(0.5_wp*(v0 + v1) - self%motion%du/h))
      end associate
   end function driven_work

   !> The rate of a condition with the field `way` by its discrete gradient.
   pure real(wp) function gap_change(set, k, displacement) result(rate)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k
      real(wp), intent(in) :: displacement(:, :) !! (n_dim, n_node)
      integer :: i

      rate = 0.0_wp
      do i = 1, set%item(k)%n_node
         rate = rate + dot_product(set%item(k)%g(:, i), displacement(:, set%item(k)%node(i)))
      end do
   end function gap_change

   !> An error if there is far more energy than was put in, or none that is a number.
   subroutine check_growth(self, work, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: work               !! of the step, its size [M L^2/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: energy, momentum(size(self%end_state%v, 1), size(self%end_state%v, 2))
      character(len=:), allocatable :: text

      associate (budget => self%state%explicit%budget)
         call mass_times(self%system, self%end_state%v, momentum)
         energy = 0.5_wp*sum(self%end_state%v*momentum) + abs(sum(self%end_state%energy)) &
            + abs(self%end_state%potential)
         if (.not. budget > 0.0_wp) budget = energy
         budget = budget + work
         if (energy <= min(most_growth*budget, huge(energy))) return
         text = "its energy is not finite"
         if (energy <= huge(energy)) text = "its energy " // to_text(energy) // " is " // &
            to_text(energy/budget, 3) // " times what was put in"
         call raise(error, err_analysis, "the analysis stops at time " // &
            to_text(self%state%clock%time, 9) // ": the explicit step grows without bound, " &
            // text // "; give a smaller increment")
      end associate
   end subroutine check_growth

end module emcon_explicit
