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
   use emcon_active_set, only : active_set_begin, active_set_drop, active_set_select, &
      step_cycling, step_done, step_stands_off, step_too_far
   use emcon_active_set_update, only : active_set_advance
   use emcon_constraints, only : constraint_place, constraints_evaluate, constraints_force, &
      constraints_rows, constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_holding, only : holding_t
   use emcon_judge, only : judge_step, overlap_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_place
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_pose, only : pose_at_end, pose_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_choice, check_field, check_list, check_size
   use emcon_stepper_query, only : query_sync, query_t
   use emcon_steps, only : initiation_persistent, prescribed_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: contact_report_t, query_constraints, query_begin_contact, query_gaps, query_select, &
      query_choose, query_contact, query_curvature, query_curvature_times, query_update_active, &
      query_drop, query_areas, query_overlap
   public :: step_done, step_cycling, step_too_far, step_stands_off

   !> Constraints over a step, ascending by their numbers: f = mean gap - target. Linearised in the
   !> motion at the end: force lam_k times row k of the discrete gradients, defect by the gradients
   !> at the end. In statics the start is the end: gap0 = gap1, dgap = 0, one gradient.
   type :: contact_report_t
      integer :: n = 0
      integer, allocatable :: id(:)              !! (n) 1..n_constraint, as in `state_t`
      integer, allocatable :: pair(:)            !! (n) 1..n_pair; 0: a row of a tie or an equation
      integer, allocatable :: node(:)            !! (n) slave node, 1..n_node; 0 likewise
      real(wp), allocatable :: target(:)         !! (n) mean gap to hold [L]
      real(wp), allocatable :: gap0(:)           !! (n) f at the start [L]
      real(wp), allocatable :: gap1(:)           !! (n) at the end
      real(wp), allocatable :: dgap(:)           !! (n) gap1 - gap0, to relative accuracy
      real(wp), allocatable :: defect(:)         !! (n) what is to be 0: dgap where the gap at the
                                                 !! start is held, else gap1
      real(wp), allocatable :: size(:)           !! (n) length of an edge: defects relate to it
      type(csr_t) :: discrete_gradient           !! (n x 2 n_node) times du it is dgap
      type(csr_t) :: end_gradient                !! (n x 2 n_node) at the end
   end type contact_report_t

contains

   !> All contact constraints near from displacements `u0` to `u1`. With `keeps_gap` they are those
   !> that hold the mean gap of `u0`, as persistent contact does: integrated gaps have other
   !> gradients then, and all gaps are counted from there.
   subroutine query_constraints(self, stepper, u0, u1, keeps_gap, report, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: u0(:, :), u1(:, :)     !! (2, n_node) [L]
      logical, intent(in) :: keeps_gap
      type(contact_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      logical, allocatable :: is_near(:)
      integer :: k, pair, i

      call query_sync(self, stepper, error)
      call check_field("u0", u0, stepper%scene, error)
      call check_field("u1", u1, stepper%scene, error)
      if (allocated(error)) return
      self%is_evaluated = .false.                ! the stencils are others from here on
      self%has_begun = .false.
      self%march%motion%pose = pose_t()
      call place(self, u0, u1 - u0)
      associate (system => self%march%system, motion => self%march%motion, &
            set => self%march%active%set)
         allocate(is_near(system%n_constraint), source=.false.)
         do pair = 1, size(system%contact)
            associate (contact => system%contact(pair)%contact)
               contact%reach = 0.0_wp            ! not what was found for another motion
               call contact%begin_step(motion%x, motion%u0, motion%du)
               call contact%measure(motion%x, motion%u0, motion%du)
               is_near(system%first_constraint(pair) + 1:system%first_constraint(pair + 1)) = &
                  contact%state%is_near .and. contact%state%is_over .and. &
                  (pair <= system%n_pair .or. contact%state%gap1 < contact%state%closed)
            end associate
         end do
         call constraints_select(set, pack([(k, k = 1, size(is_near))], is_near))
         do k = 1, merge(set%n, 0, keeps_gap)
            call constraint_place(system, set%id(k), pair, i)
            set%target(k) = system%contact(pair)%contact%state(i)%gap0
         end do
      end associate
      call evaluate(self, report)
   end subroutine query_constraints

   !> Choose what each constraint is made of for a step from `u0` with the expected motion `du`;
   !> `active` are those of `was_active` that can still act.
   subroutine query_begin_contact(self, stepper, u0, du, was_active, active, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical, intent(in) :: was_active(:)       !! (n_constraint) at the end of the step before
      logical, allocatable, intent(out) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: pair

      call query_sync(self, stepper, error)
      call check_field("u0", u0, stepper%scene, error)
      call check_field("du", du, stepper%scene, error)
      call check_flags(self, "was_active", was_active, error)
      if (allocated(error)) return
      self%is_evaluated = .false.
      self%has_set = .true.                      ! an empty one
      self%has_null_space = .false.
      associate (march => self%march)
         do pair = 1, size(march%system%contact)
            march%system%contact(pair)%contact%reach = 0.0_wp   ! nothing depends on the past
         end do
         march%state%u = u0
         march%state%is_active = was_active
         march%state%lam = 0.0_wp
         march%active%puts_off = .false.
         march%active%holding = holding_t()
         call take_options(self, stepper)
         call place(self, u0, du)
         call constraints_select(march%active%set, [integer ::])
         call active_set_begin(march%active, march%system, march%motion, march%state)
         active = march%active%is_active
      end associate
      self%has_begun = .true.
   end subroutine query_begin_contact

   !> Take over how contact begins, which may have changed.
   subroutine take_options(self, stepper)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper

      associate (active => self%march%active, step => stepper%scene%step(self%march%state%i_step))
         active%masses_resist = step%scheme%masses_resist
         active%holds_gap = step%initiation == initiation_persistent .and. active%masses_resist
         active%gap_tolerance = step%gap_tolerance
         active%may_cut = stepper%may_cut
         self%march%motion%pose = pose_t()
         if (.not. active%masses_resist) self%march%motion%pose = pose_at_end
      end associate
   end subroutine take_options

   !> Take over a motion.
   subroutine place(self, u0, du)
      type(query_t), intent(inout) :: self
      real(wp), intent(in) :: u0(:, :), du(:, :)

      self%march%motion%u0 = u0
      self%march%motion%du = du
      call motion_place(self%march%motion)
   end subroutine place

   !> All possible constraints at u0 and u0 + du, by the stencils of the step. Rows of ties and
   !> equations have no gaps.
   subroutine query_gaps(self, stepper, u0, du, state, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(gap_state_t), allocatable, intent(out) :: state(:)  !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call begin_query(self, stepper, u0, du, error)
      if (allocated(error)) return
      associate (system => self%march%system)
         allocate(state(system%n_constraint))
         do i = 1, size(system%contact)
            call system%contact(i)%contact%measure(stepper%scene%x, u0, du)
            state(system%first_constraint(i) + 1:system%first_constraint(i + 1)) = &
               system%contact(i)%contact%state
         end do
      end associate
   end subroutine query_gaps

   !> A step was begun for this model, and goes from `u0` by `du`: take it over.
   subroutine begin_query(self, stepper, u0, du, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: u0(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%has_begun) call raise(error, err_input, "no step of contact was begun since " &
         // "the model was made, its unknowns changed, or another question was asked")
      call check_field("u0", u0, stepper%scene, error)
      call check_field("du", du, stepper%scene, error)
      if (allocated(error)) return
      call take_options(self, stepper)
      call place(self, u0, du)
   end subroutine begin_query

   !> Select the constraints `active`, with the gaps to hold that the initiation asks for.
   subroutine query_select(self, stepper, u0, du, active, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical, intent(in) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call begin_query(self, stepper, u0, du, error)
      call check_flags(self, "active", active, error)
      call check_near(self, stepper, pack([(i, i = 1, size(active))], active), error)
      if (allocated(error)) return
      self%march%active%is_active = active
      call active_set_select(self%march%active, self%march%system, self%march%motion)
      self%has_set = self%march%active%set%n == 0
      self%has_null_space = .false.
   end subroutine query_select

   !> Select the constraints `id`, with gaps to hold of the caller's own choice.
   subroutine query_choose(self, stepper, u0, du, id, target, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer, intent(in) :: id(:)               !! (n) ascending, 1..n_constraint
      real(wp), intent(in) :: target(:)          !! (n) mean gaps [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: k, last

      last = 0
      call begin_query(self, stepper, u0, du, error)
      call check_list("target", target, size(id), error)
      do k = 1, size(id)
         call check_choice("constraint", id(k), 1, self%march%system%n_constraint, error)
         if (allocated(error)) return
         if (id(k) <= last) call raise(error, err_input, "constraint " // to_text(id(k)) // &
            " comes after " // to_text(last) // ": they are to ascend")
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
      integer :: k, pair, i

      if (allocated(error)) return
      associate (system => self%march%system, motion => self%march%motion)
         do pair = 1, size(system%contact)
            call system%contact(pair)%contact%measure(motion%x, motion%u0, motion%du)
         end do
         do k = 1, size(id)
            call constraint_place(system, id(k), pair, i)
            if (pair == 0 .or. allocated(error)) cycle
            associate (contact => system%contact(pair)%contact)
               if (.not. contact%state(i)%is_near) call raise(error, err_input, "constraint " // &
                  to_text(id(k)) // " (slave node " // &
                  to_text(stepper%scene%node_label(contact%node(i))) // " of pair " // &
                  to_text(abs(system%contact(pair)%of_pair)) // ") has no surface within reach")
            end associate
         end do
      end associate
   end subroutine check_near

   !> Values and gradients of the selected constraints for the step u0 to u0 + du.
   subroutine query_contact(self, stepper, u0, du, report, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(contact_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error

      call begin_query(self, stepper, u0, du, error)
      if (.not. allocated(error)) call evaluate(self, report)
   end subroutine query_contact

   !> Evaluate the selected constraints, and report with gradients over all degrees of freedom.
   subroutine evaluate(self, report)
      type(query_t), intent(inout) :: self
      type(contact_report_t), intent(out) :: report
      type(numbering_t) :: freedoms
      type(prescribed_t) :: none(0)
      logical :: is_alive(2, size(self%march%system%space%body))
      integer :: k, i, pair

      is_alive = .true.
      call numbering_init(freedoms, is_alive, none)
      associate (system => self%march%system, set => self%march%active%set)
         call constraints_evaluate(set, system, self%march%motion)
         call constraints_rows(set, freedoms)
         report%n = set%n
         report%id = set%id
         allocate(report%pair(set%n), report%node(set%n), source=0)
         do k = 1, set%n
            call constraint_place(system, set%id(k), pair, i)
            if (pair == 0) cycle
            report%pair(k) = abs(system%contact(pair)%of_pair)
            report%node(k) = system%contact(pair)%contact%node(i)
         end do
         report%target = set%target
         report%gap0 = set%item%gap0
         report%gap1 = set%item%gap1
         report%dgap = set%item%dgap
         report%size = set%item%size
         report%defect = set%defect
         call take_filled(set%force_rows, report%discrete_gradient)
         call take_filled(set%gap_rows, report%end_gradient)
      end associate
      self%has_set = .true.
      self%has_null_space = .false.
   end subroutine evaluate

   !> The rows without the room that is left after the last one.
   pure subroutine take_filled(rows, matrix)
      type(csr_t), intent(in) :: rows
      type(csr_t), intent(out) :: matrix
      integer :: n

      n = rows%row_start(rows%n_row + 1)
      matrix%n_row = rows%n_row
      matrix%n_col = rows%n_col
      allocate(matrix%row_start, source=rows%row_start)
      allocate(matrix%column, source=rows%column(:n))
      allocate(matrix%value, source=rows%value(:n))
   end subroutine take_filled

   !> Sum over the constraints of the last evaluation of `factor` times the derivative of the
   !> discrete gradient by the end: the tangent of a step gets minus this.
   subroutine query_curvature(self, factor, matrix, error)
      type(query_t), intent(in) :: self
      real(wp), intent(in) :: factor(:)          !! (n) multipliers [M L/T^2]
      type(csr_t), intent(out) :: matrix         !! (2 n_node x 2 n_node)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:), slot(:)
      real(wp), allocatable :: value(:)
      integer :: k, i, j, n

      call check_set(self, "factor", factor, error)
      if (allocated(error)) return
      associate (item => self%march%active%set%item)
         n = sum(4*item%n_node**2)
         allocate(row(n), column(n), value(n))
         n = 0
         do k = 1, size(item)
            do j = 1, 2*item(k)%n_node
               do i = 1, 2*item(k)%n_node
                  n = n + 1
                  row(n) = 2*item(k)%node((i + 1)/2) - mod(i, 2)
                  column(n) = 2*item(k)%node((j + 1)/2) - mod(j, 2)
                  value(n) = factor(k)*item(k)%h(i, j)
               end do
            end do
         end do
      end associate
      associate (n_dof => 2*size(self%march%system%space%body))
         call csr_from_entries(matrix, n_dof, n_dof, row, column, slot)
      end associate
      do i = 1, n
         matrix%value(slot(i)) = matrix%value(slot(i)) + real(value(i), dp)
      end do
   end subroutine query_curvature

   !> The same times `direction`.
   subroutine query_curvature_times(self, stepper, factor, direction, product, error)
      type(query_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: factor(:)              !! (n)
      real(wp), intent(in) :: direction(:, :)        !! (2, n_node)
      real(wp), allocatable, intent(out) :: product(:, :)      !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, i, j

      call check_set(self, "factor", factor, error)
      call check_field("direction", direction, stepper%scene, error)
      if (allocated(error)) return
      allocate(product(2, size(direction, 2)), source=0.0_wp)
      do k = 1, self%march%active%set%n
         associate (item => self%march%active%set%item(k))
            do j = 1, item%n_node
               do i = 1, item%n_node
                  product(:, item%node(i)) = product(:, item%node(i)) + factor(k)*matmul( &
                     item%h(2*i - 1:2*i, 2*j - 1:2*j), direction(:, item%node(j)))
               end do
            end do
         end associate
      end do
   end subroutine query_curvature_times

   !> The next active set from a solved step: take in what would penetrate, release what pulls.
   !>
   !> `is_done`: the set stands, or `status` says why the step cannot be ended: `step_too_far` and
   !> `step_stands_off` ask for a smaller one, `step_cycling` for another one. Signs of round-off
   !> are told from tension by `magnitude`; without it by the contact forces themselves.
   subroutine query_update_active(self, stepper, u0, du, lam, active, is_done, status, error, &
      magnitude)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: lam(:)             !! (n) of the selected constraints [M L/T^2]
      logical, intent(inout) :: active(:)        !! (n_constraint) the selected ones; the next ones
      logical, intent(out) :: is_done
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: magnitude(:, :)   !! (2, n_node) sum of |contributions| to
                                                          !! the residual [M L/T^2]
      real(wp) :: force(2, size(stepper%scene%x, 2))

      is_done = .false.
      status = step_done
      call begin_query(self, stepper, u0, du, error)
      call check_set(self, "lam", lam, error)
      call check_flags(self, "active", active, error)
      if (present(magnitude)) call check_field("magnitude", magnitude, stepper%scene, error)
      if (allocated(error)) return
      associate (march => self%march, own => self%march%active)
         if (any(active .neqv. own%is_active) .or. count(active) /= size(lam)) then
            call raise(error, err_input, "active is not the set that was selected")
            return
         end if
         own%set%lam = lam
         own%lam(own%set%id) = lam
         march%system%response%magnitude = 0.0_wp
         if (present(magnitude)) then
            march%system%response%magnitude = magnitude
         else
            call constraints_force(own%set, 1, force, march%system%response%magnitude)
         end if
         march%state%u = march%motion%u0
         call active_set_advance(own, march%system, march%motion, is_done, status)
         active = own%is_active
      end associate
   end subroutine query_update_active

   !> Leave constraints out for the rest of the step, as they follow from others.
   subroutine query_drop(self, redundant, active, error)
      type(query_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! places in the selected set
      logical, allocatable, intent(out) :: active(:)      !! (n_constraint) what is left
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      if (.not. self%has_begun) call raise(error, err_input, "no step of contact was begun")
      do k = 1, size(redundant)
         call check_choice("redundant", redundant(k), 1, self%march%active%set%n, error)
      end do
      if (allocated(error)) return
      call active_set_drop(self%march%active, redundant)
      active = self%march%active%is_active
   end subroutine query_drop

   !> Area of each possible contact over the step that ended at `u1`, whose constraints were
   !> evaluated: the pressure is lam/area. And the length of slave surface that belongs to it.
   subroutine query_areas(self, stepper, u1, area, length, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u1(:, :)         !! (2, n_node) [L]
      real(wp), allocatable, intent(out) :: area(:)        !! (n_constraint) [L^2]
      real(wp), allocatable, intent(out) :: length(:)      !! (n_constraint) [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (.not. self%has_begun) call raise(error, err_input, "no step of contact was begun")
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

   !> The deepest overlap of surfaces in the step from `u0` by `du`, found by geometry alone.
   subroutine query_overlap(self, stepper, u0, du, overlap, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(overlap_t), intent(out) :: overlap
      type(error_t), allocatable, intent(out) :: error

      call query_sync(self, stepper, error)
      call check_field("u0", u0, stepper%scene, error)
      call check_field("du", du, stepper%scene, error)
      if (.not. allocated(error)) call judge_step(self%march%judge, stepper%scene%x, u0, du, &
         overlap)
   end subroutine query_overlap

   !> One flag for each possible constraint.
   subroutine check_flags(self, name, flag, error)
      type(query_t), intent(in) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: flag(:)
      type(error_t), allocatable, intent(inout) :: error

      call check_size(name, size(flag), self%march%system%n_constraint, error)
   end subroutine check_flags

   !> There are evaluated constraints, and `list` has a number for each of them.
   subroutine check_set(self, name, list, error)
      type(query_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: list(:)
      type(error_t), allocatable, intent(inout) :: error

      if (.not. (self%has_set .or. allocated(error))) call raise(error, err_input, "no " // &
         "constraints were evaluated since they were selected, or the unknowns changed")
      call check_list(name, list, self%march%active%set%n, error)
   end subroutine check_set

end module emcon_stepper_contact
