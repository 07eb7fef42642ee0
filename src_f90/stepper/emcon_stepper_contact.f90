!> Contact over a step of the caller's own: gaps, discrete gradients, second derivatives, the active
!> set, the null space. Like all queries these leave the model as it is.
!>
!> A host with solids of its own solves, from displacements u0 by du,
!>
!>     M (2/h^2 du - 2/h v0) + f_int - sum lam_k g_k = 0,   defect_k = 0, k in the active set:
!>
!> `query_begin_contact` with the expected du; then, until `query_update_active` is done:
!> `query_select` the set, and Newton's method on `query_contact`. If f_int is a discrete gradient
!> of its energy, energy and momenta are kept. Which contacts acted before, multipliers and
!> displacements are the host's: it may repeat a step with another size. Source: docs/theory.md,
!> sections 4 and 5.
module emcon_stepper_contact
   use emcon_active_set, only : active_set_begin, active_set_select, active_set_suit, &
      step_cycling, step_done, step_stands_off, step_too_far
   use emcon_constraint, only : condition_friction, most_slips
   use emcon_constraints, only : constraint_index, constraints_add_law_forces, &
      constraints_dissipated, constraints_force, constraints_select, constraints_take_lam
   use emcon_contact_law, only : loss_damping
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_contact_support, only : contact_support_t
   use emcon_friction, only : friction_begin
   use emcon_host_friction, only : host_friction_begin, host_friction_slides
   use emcon_host_set, only : host_set_advance, host_set_begin, host_set_choose, &
      host_set_drop, host_set_next
   use emcon_overlap_check, only : overlap_check_step, overlap_t
   use emcon_kinds, only : wp
   use emcon_evaluation, only : evaluation_at_end, evaluation_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_choice, check_field, check_list, check_number, &
      check_size, check_that, stepper_is_damped
   use emcon_gaps, only : gaps_forget, gaps_measure
   use emcon_stepper_query, only : query_forget, query_place, query_sync, query_t
   use emcon_stepper_report, only : contact_report_t, report_check_list, report_evaluate
   use emcon_steps, only : initiation_persistent, step_initiation, step_is_dynamic
   use emcon_text, only : to_text
   implicit none
   private
   public :: query_begin_contact, query_begin_friction, query_begin_damping, query_law_forces
   public :: query_gaps, query_select, query_choose, &
      query_contact, query_update_active, query_drop, query_areas, query_slips, query_overlap
   public :: step_done, step_cycling, step_too_far, step_stands_off

contains

   !> Choose what each constraint is made of for a step from `u0` with the expected motion `du`;
   !> `active` are those of `was_active` that can still act.
   subroutine query_begin_contact(self, stepper, u0, du, was_active, active, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      logical, intent(in) :: was_active(:)       !! (n_constraint) at the end of the step before
      logical, allocatable, intent(out) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error

      call query_sync(self, stepper, error)
      self%frequency = 0.0_wp
      if (.not. allocated(error)) call take_options(self, stepper)
      call check_flags(self, "was_active", was_active, error)
      call query_place(self, stepper, u0, du, error)
      if (allocated(error)) return
      call query_forget(self)
      self%has_begun = .true.
      self%has_set = .true.                      ! an empty one
      associate (march => self%march)
         call gaps_forget(march%system)
         march%state%u = u0
         call march%state%contacts%take(spread(0.0_wp, 1, size(was_active)), was_active)
         march%active%rules%puts_off = .false.
         march%active%support = contact_support_t()
         call constraints_select(march%active%set, [integer ::])
         if (march%active%friction%is_on) then
            march%state%contacts%slides_along = 0.0_wp
            march%state%contacts%drag = 0.0_wp
         end if
         march%motion%v0 = 0.0_wp
         call active_set_begin(march%active, march%system, march%motion, march%state)
         call host_set_begin(self%host_set, march%system%n_constraint)
         active = host_set_next(march%active)
         call host_friction_begin(march%active, active, march%system, march%motion)
      end associate
   end subroutine query_begin_contact

   !> After `query_begin_contact`: friction is to bring velocities along surfaces to rest, not to
   !> turn them round. `stop` is the motion over the step with which all velocities end at zero:
   !> h/2 v0 where the velocity at the end is 2 du/h - v0.
   subroutine query_begin_friction(self, stepper, stop, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: stop(:, :)           !! (n_dim, n_node) [L]
      type(error_t), allocatable, intent(out) :: error

      call check_that(self%has_begun, "no step of contact was begun", error)
      call check_field("stop", stop, stepper%scene, error)
      if (allocated(error)) return
      associate (march => self%march, acts => host_set_next(self%march%active))
         march%motion%v0 = stop
         call friction_begin(march%active%friction, march%system, march%motion, acts)
         call host_friction_begin(march%active, acts, march%system, march%motion)
      end associate
   end subroutine query_begin_friction

   !> After `query_begin_contact`, where pairs have damping, whose forces go by velocities: the size
   !> of the step.
   subroutine query_begin_damping(self, stepper, h, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(error_t), allocatable, intent(out) :: error

      call check_that(self%has_begun, "no step of contact was begun", error)
      call check_number("h", h, error, 0.0_wp)
      call check_that(h > 0.0_wp, "h is 0: a step has a size", error)
      if (allocated(error)) return
      self%frequency = 1.0_wp/h
      call take_options(self, stepper)
   end subroutine query_begin_damping

   !> What laws beside the rows, as damping, push at the nodes in the step that was evaluated last,
   !> and what they take, >= 0. Their derivative is in `query_curvature`.
   subroutine query_law_forces(self, stepper, force, dissipated, error)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), allocatable, intent(out) :: force(:, :)    !! (n_dim, n_node) [M L/T^2]
      real(wp), intent(out) :: dissipated                  !! [M L^2/T^2]
      type(error_t), allocatable, intent(out) :: error
      logical :: are_some
      integer :: k

      dissipated = 0.0_wp
      allocate(force, mold=stepper%scene%x)
      force = 0.0_wp
      call check_that(self%has_begun .and. self%has_set, "no constraints were evaluated in this " &
         // "step", error)
      if (allocated(error)) return
      associate (set => self%march%active%set)
         call constraints_add_law_forces(set, force, are_some)
         if (.not. are_some) return
         do k = set%n_permanent + 1, set%n_condition
            dissipated = dissipated + constraints_dissipated(set, k, loss_damping)
         end do
      end associate
   end subroutine query_law_forces

   !> Take over how contact begins, which may have changed.
   subroutine take_options(self, stepper)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper

      associate (active => self%march%active, &
         step => stepper%scene%step(self%march%state%clock%i_step))
         call active_set_suit(active, step)
         active%rules%holds_gap = step_initiation(step) == initiation_persistent
         active%rules%may_cut = stepper%may_cut
         ! Of velocities only the motion that brings them to rest is known, as if they were that.
         self%march%motion%evaluation = merge(evaluation_t(lapse=1.0_wp, v_weight=2.0_wp), &
            evaluation_at_end, step_is_dynamic(step))
         if (step_is_dynamic(step)) self%march%motion%evaluation%mass_scale = self%frequency
      end associate
   end subroutine take_options

   !> All possible constraints at u0 and u0 + du, by the stencils of the step. Rows of ties and
   !> equations have no gaps.
   subroutine query_gaps(self, stepper, u0, du, gap, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(gap_state_t), allocatable, intent(out) :: gap(:)    !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error

      call begin_query(self, stepper, u0, du, error)
      if (.not. allocated(error)) call gaps_measure(self%march%system, self%march%motion, gap)
   end subroutine query_gaps

   !> A step was begun for this model, and goes from `u0` by `du`: take it over.
   subroutine begin_query(self, stepper, u0, du, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: u0(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error

      call check_that(self%has_begun, "no step of contact was begun since the model was made, " // &
         "its unknowns changed, or another question was asked", error)
      if (.not. allocated(error)) call take_options(self, stepper)
      call query_place(self, stepper, u0, du, error)
   end subroutine begin_query

   !> Select the constraints `active`, with the gaps to hold that the initiation asks for.
   subroutine query_select(self, stepper, u0, du, active, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      logical, intent(in) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call begin_query(self, stepper, u0, du, error)
      call check_flags(self, "active", active, error)
      call check_near(self, stepper, pack([(i, i = 1, size(active))], active), error)
      if (allocated(error)) return
      call host_set_choose(self%host_set, self%march%active, active)
      call active_set_select(self%march%active, self%march%system, self%march%motion)
      self%has_set = self%march%active%set%n == 0
      self%has_null_space = .false.
   end subroutine query_select

   !> Select the constraints `id`, with gaps to hold of the caller's own choice.
   subroutine query_choose(self, stepper, u0, du, id, target, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      integer, intent(in) :: id(:)               !! (n) ascending, 1..n_constraint
      real(wp), intent(in) :: target(:)          !! (n) mean gaps [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: k, last

      last = 0
      call begin_query(self, stepper, u0, du, error)
      call check_list("target", target, size(id), error)
      do k = 1, size(id)
         call check_choice("constraint", id(k), 1, self%march%system%n_constraint, error)
         call check_that(id(k) > last, "constraint " // to_text(id(k)) // " comes after " // &
            to_text(last) // ": they are to ascend", error)
         last = id(k)
      end do
      call check_near(self, stepper, id, error)
      if (allocated(error)) return
      call constraints_select(self%march%active%set, id)
      self%march%active%set%target = target
      self%has_set = size(id) == 0
      self%has_null_space = .false.
   end subroutine query_choose

   !> A contact without a surface within reach cannot act.
   subroutine check_near(self, stepper, id, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: id(:)
      type(error_t), allocatable, intent(inout) :: error
      type(gap_state_t), allocatable :: gap(:)
      integer :: k, pair, i

      if (allocated(error)) return
      call gaps_measure(self%march%system, self%march%motion, gap)
      do k = 1, size(id)
         call constraint_index(self%march%system, id(k), pair, i)
         if (pair == 0 .or. gap(id(k))%is_near) cycle
         associate (contact => self%march%system%contact(pair))
            call check_that(.false., "constraint " // to_text(id(k)) // " (slave node " // &
               to_text(stepper%scene%node%label(contact%contact%node(i))) // " of pair " // &
               to_text(abs(contact%of_pair)) // ") has no surface within reach", error)
         end associate
      end do
   end subroutine check_near

   !> Values and gradients of the selected constraints for the step u0 to u0 + du.
   subroutine query_contact(self, stepper, u0, du, report, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(contact_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error

      call begin_query(self, stepper, u0, du, error)
      call check_that(self%frequency > 0.0_wp .or. .not. stepper_is_damped(stepper), "pairs have " &
         // "damping: the size of the step is to be told after it was begun", error)
      if (.not. allocated(error)) call report_evaluate(self, report)
   end subroutine query_contact

   !> The next active set from a solved step: take in what would penetrate, release what pulls.
   !>
   !> `is_done`: the set stands, or `outcome` says why the step cannot be ended: `step_too_far` and
   !> `step_stands_off` ask for a smaller one, `step_cycling` for another one. Signs of round-off
   !> are told from tension by `magnitude`; without it by the contact forces themselves.
   subroutine query_update_active(self, stepper, u0, du, lam, active, is_done, outcome, error, &
      magnitude)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: lam(:)             !! (n) of the selected constraints [M L/T^2]
      logical, intent(inout) :: active(:)        !! (n_constraint) the selected ones; the next ones
      logical, intent(out) :: is_done
      integer, intent(out) :: outcome            !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      !> (n_dim, n_node) sum of |contributions| to the residual [M L/T^2]
      real(wp), intent(in), optional :: magnitude(:, :)
      real(wp) :: force(size(stepper%scene%x, 1), size(stepper%scene%x, 2))

      is_done = .false.
      outcome = step_done
      call begin_query(self, stepper, u0, du, error)
      call report_check_list(self, "lam", lam, error)
      call check_flags(self, "active", active, error)
      if (present(magnitude)) call check_field("magnitude", magnitude, stepper%scene, error)
      if (.not. allocated(error)) call check_that(count(active) == self%march%active%set%n .and. &
         all(active .eqv. host_set_next(self%march%active)), &
         "active is not the set that was selected", error)
      if (allocated(error)) return
      associate (march => self%march, own => self%march%active)
         call constraints_take_lam(own%set, lam)
         own%lam(own%set%id) = lam(:own%set%n)
         march%system%response%magnitude = 0.0_wp
         if (present(magnitude)) then
            march%system%response%magnitude = magnitude
         else
            call constraints_force(own%set, 1, force, march%system%response%magnitude)
         end if
         march%state%u = march%motion%u0
         call host_set_advance(self%host_set, own, march%system, march%motion, is_done, outcome)
         active = host_set_next(own)
      end associate
   end subroutine query_update_active

   !> Leave constraints out for the rest of the step, as they follow from others.
   subroutine query_drop(self, redundant, active, error)
      type(query_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! places in the selected set
      logical, allocatable, intent(out) :: active(:)      !! (n_constraint) what is left
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call check_that(self%has_begun, "no step of contact was begun", error)
      do k = 1, size(redundant)
         call check_choice("redundant", redundant(k), 1, self%march%active%set%n_row, error)
         call check_that(redundant(k) <= self%march%active%set%n, "row " // to_text(redundant(k)) &
            // " holds a slip: it follows from others and cannot be left out; solve with the " // &
            "multipliers", error)
      end do
      if (allocated(error)) return
      call host_set_drop(self%host_set, self%march%active, redundant)
      active = host_set_next(self%march%active)
   end subroutine query_drop

   !> Area of each possible contact over the step that ended at `u1`, whose constraints were
   !> evaluated: the pressure is lam/area. And the length of slave surface that belongs to it.
   subroutine query_areas(self, stepper, u1, area, length, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u1(:, :)         !! (n_dim, n_node) [L]
      real(wp), allocatable, intent(out) :: area(:)        !! (n_constraint) [L^2]
      real(wp), allocatable, intent(out) :: length(:)      !! (n_constraint) [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call check_that(self%has_begun, "no step of contact was begun", error)
      call check_field("u1", u1, stepper%scene, error)
      if (allocated(error)) return
      associate (system => self%march%system)
         allocate(area(system%n_constraint), length(system%n_constraint), source=0.0_wp)
         do i = 1, size(system%contact)
            associate (first => system%first_constraint(i) + 1, &
                  last => system%first_constraint(i + 1))
               call system%contact(i)%contact%area(stepper%scene%x, u1, area(first:last), &
                  length(first:last))
            end associate
         end do
      end associate
   end subroutine query_areas

   !> How each contact holds along the surface, by the step that was solved last: 0 where it is
   !> open, 1 where it acts without sliding, 2 where it slides; its slip, and its friction.
   subroutine query_slips(self, stepper, way, slip, friction, error)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      integer, allocatable, intent(out) :: way(:)          !! (n_constraint)
      real(wp), allocatable, intent(out) :: slip(:, :)     !! (n_slip, n_constraint) [L]
      real(wp), allocatable, intent(out) :: friction(:, :) !! (n_slip, n_constraint) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: drag(most_slips)
      integer :: k

      call check_that(self%has_begun .and. self%has_set, "no constraints were evaluated in this " &
         // "step", error)
      if (allocated(error)) return
      associate (set => self%march%active%set, n => self%march%system%n_constraint, &
            n_slip => stepper%scene%n_dim - 1, acts => host_set_next(self%march%active))
         allocate(way(n), source=0)
         allocate(slip(n_slip, n), friction(n_slip, n), source=0.0_wp)
         do k = set%n_permanent + 1, set%n
            associate (item => set%item(k), id => set%id(k))
               ! A candidate that does not push does not act.
               if (.not. acts(id)) cycle
               way(id) = merge(2, 1, host_friction_slides(self%march%active, id))
               if (.not. item%has_friction) cycle
               drag = condition_friction(item, set%lam(k))
               slip(:, id) = item%slip(:n_slip)
               friction(:, id) = drag(:n_slip)
            end associate
         end do
      end associate
   end subroutine query_slips

   !> The deepest overlap of surfaces in the step from `u0` by `du`, found by geometry alone.
   subroutine query_overlap(self, stepper, u0, du, overlap, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(out) :: overlap
      type(error_t), allocatable, intent(out) :: error

      call query_sync(self, stepper, error)
      call query_place(self, stepper, u0, du, error)
      if (.not. allocated(error)) call overlap_check_step(self%march%overlap_check, &
         stepper%scene%x, u0, du, overlap)
   end subroutine query_overlap

   !> One flag for each possible constraint.
   subroutine check_flags(self, name, flag, error)
      type(query_t), intent(in) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: flag(:)
      type(error_t), allocatable, intent(inout) :: error

      call check_size(name, size(flag), self%march%system%n_constraint, error)
   end subroutine check_flags

end module emcon_stepper_contact
