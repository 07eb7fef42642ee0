!> The active constraints of a step: values, gradients, multipliers.
!>
!> One set serves contact pairs, ties and equations. A contact constraint demands that its mean gap
!> be target_k at the end; its multiplier lam_k >= 0 is the contact force. A linear constraint holds
!> a sum of displacements; it stands here only where it is not eliminated in the numbering. Sign:
!> docs/theory.md, eq. (1).
module emcon_constraints
   use emcon_constraint, only : condition_drag, condition_find_force, condition_friction, &
      condition_t, constraint_t, contact_response_t, most_slips
   use emcon_contact_law, only : contact_laws_dissipated, contact_laws_respond, contact_laws_t, &
      contact_values_t
   use emcon_csr, only : csr_t
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   use emcon_vectors, only : vector_zero
   implicit none
   private
   public :: constraint_set_t, constraints_select, constraints_evaluate, constraints_force
   public :: constraints_stick, constraints_take_hold, constraints_take_lam, constraints_normals, &
      constraints_gives_back, constraints_are_gradients
   public :: constraints_friction, constraints_add_law_forces, constraints_add_row_forces, &
      constraints_lam, constraints_dissipated
   public :: constraint_index, constraints_rounding, constraints_add_rounding

   !> Gradients that are those of forces differ by no more than this part of the largest.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

   !> Of the rows of gaps that do not hold: laws give their multipliers.
   type :: soft_rows_t
      logical :: is_on = .false.                 !! contacts are such ones
      logical :: is_stored = .false.             !! by discrete gradients of what the laws store
      !> Multipliers are on the way to what the gaps say, as unknowns of a solve
      logical :: is_under_way = .false.
      real(wp), allocatable :: left(:)           !! (n) of the gap to the target, at the end [L]
      real(wp), allocatable :: slope(:)          !! (n) -d multiplier / d gap, >= 0 [M/T^2]
      real(wp), allocatable :: lack(:)           !! (n) what one on its way lacks [M L/T^2]
   end type soft_rows_t

   !> Which conditions act, and their linearised rows on the unknowns. The first `n` have a row of
   !> their gap, of the same number; those of them that stick have rows of their slips too, after
   !> these. The others have none: laws alone act there.
   type :: constraint_set_t
      integer :: n = 0
      integer :: n_condition = 0
      integer :: n_linear = 0                    !! the first ones: linear, without curvature
      integer :: n_permanent = 0                 !! these and the next ones always act
      !> (n_condition) numbers over all pairs, ascending up to `n` and from there on
      integer, allocatable :: id(:)
      type(condition_t), allocatable :: item(:)  !! (n_condition) values and derivatives
      real(wp), allocatable :: target(:)         !! (n_condition) mean gap to hold, or to count from
      type(contact_laws_t), allocatable :: law(:)      !! (n_condition)
      logical, allocatable :: is_kept(:)         !! (n) target is gap(q0): hold the difference at 0
      real(wp) :: frequency = 0.0_wp             !! 1/h of the motion evaluated; statics: 0 [1/T]
      integer :: n_row = 0
      integer, allocatable :: condition(:)       !! (n_row) that each row is of
      integer, allocatable :: slip(:)            !! (n_row) and of which slip; 0: of the gap
      !> (n_row) it acts also where it says nearly what others say
      logical, allocatable :: is_firm(:)
      real(wp), allocatable :: lam(:)            !! (n_row) multipliers [M L/T^2]
      real(wp), allocatable :: defect(:)         !! (n_row) what is left to the target [L]
      type(soft_rows_t) :: penalty               !! what laws make of rows of gaps
      type(csr_t) :: force_rows                  !! (n_row x n_unknown) directions of forces
      type(csr_t) :: gap_rows                    !! (n_row x n_unknown) gradients at the end
      type(csr_t) :: law_rows                    !! of conditions without a row, directions
   end type constraint_set_t

contains

   !> Take the constraints `id` as the active ones; multipliers start at zero. Beside them, or where
   !> they are not, the conditions `by_law`, whose laws the caller gives.
   pure subroutine constraints_select(self, id, by_law)
      type(constraint_set_t), intent(inout) :: self
      integer, intent(in) :: id(:)               !! (n) ascending, from 1
      integer, intent(in), optional :: by_law(:) !! (any) ascending, of contacts
      integer :: k

      self%n = size(id)
      self%n_condition = self%n
      self%n_row = self%n
      self%n_linear = 0
      self%n_permanent = 0
      self%id = id
      self%condition = [(k, k = 1, self%n)]
      self%slip = 0*self%condition
      self%penalty = soft_rows_t(is_stored=self%penalty%is_stored)
      if (allocated(self%item)) deallocate(self%item, self%law, self%target, self%is_kept, &
         self%is_firm, self%lam, self%defect)
      if (present(by_law)) then
         self%n_condition = self%n + size(by_law)
         self%id = [id, by_law]
      end if
      allocate(self%item(self%n_condition), self%law(self%n_condition), self%is_kept(self%n), &
         self%is_firm(self%n))
      allocate(self%target(self%n_condition), self%lam(self%n), self%defect(self%n), &
         self%penalty%left(self%n), self%penalty%slope(self%n), self%penalty%lack(self%n), &
            source=0.0_wp)
      self%is_kept = .false.
      self%is_firm = .true.
   end subroutine constraints_select

   !> Let the conditions `stuck` stick, with the friction `tau` to start from: rows of their slips.
   pure subroutine constraints_stick(self, stuck, tau)
      type(constraint_set_t), intent(inout) :: self      !! of `constraints_select`
      integer, intent(in) :: stuck(:)            !! (any) ascending, up to n; these rub
      real(wp), intent(in) :: tau(:, :)          !! (slips, as many) [M L/T^2]
      integer :: k, s

      associate (n => self%n, n_slip => size(tau, 1))
         self%n_row = n + size(tau)
         self%condition = [self%condition(:n), [((stuck(k), s = 1, n_slip), k = 1, size(stuck))]]
         self%slip = [self%slip(:n), [((s, s = 1, n_slip), k = 1, size(stuck))]]
         self%lam = [self%lam(:n), tau]
         self%defect = [self%defect(:n), 0.0_wp*tau]
         self%is_firm = [self%is_firm(:n), spread(.false., 1, size(tau))]
      end associate
      call constraints_take_hold(self)
   end subroutine constraints_stick

   !> The friction of what sticks is the multipliers of its slips.
   pure subroutine constraints_take_hold(self)
      type(constraint_set_t), intent(inout) :: self
      integer :: k

      do k = self%n + 1, self%n_row
         self%item(self%condition(k))%response%stick(self%slip(k)) = self%lam(k)
      end do
   end subroutine constraints_take_hold

   !> Of rows of slips the normal force by a multiplier of 1; else 1.
   pure function constraints_normals(self) result(normal)
      type(constraint_set_t), intent(in) :: self !! evaluated
      real(wp) :: normal(self%n_row)
      integer :: k

      do k = 1, self%n_row
         normal(k) = 1.0_wp
         if (self%slip(k) > 0) normal(k) = self%item(self%condition(k))%normal
      end do
   end function constraints_normals

   !> Multipliers from outside, for the motion that was evaluated: friction answers to them.
   subroutine constraints_take_lam(self, lam)
      type(constraint_set_t), intent(inout) :: self
      real(wp), intent(in) :: lam(:)             !! (n_row) [M L/T^2]
      integer :: k

      self%lam = lam
      call constraints_take_hold(self)
      do k = self%n_permanent + 1, self%n_condition
         call respond(self, k)
      end do
   end subroutine constraints_take_lam

   !> Is the part of the tangent that conditions add symmetric, but for round-off? In equilibrium
   !> they push along the gradients of their values; friction does not.
   pure logical function constraints_are_gradients(self) result(are_gradients)
      type(constraint_set_t), intent(in) :: self !! evaluated, with rows
      integer :: n

      are_gradients = .not. (self%frequency > 0.0_wp .or. any(self%item%has_friction))
      if (self%n_row == 0 .or. .not. are_gradients) return
      n = self%force_rows%row_start(self%n_row + 1)
      are_gradients = all(abs(self%force_rows%value(:n) - self%gap_rows%value(:n)) &
         <= rounding*maxval(abs(self%force_rows%value(:n))))
   end function constraints_are_gradients

   !> Has condition `k` stored energy in steps before, which it gives back in this one?
   pure logical function constraints_gives_back(self, k) result(gives_back)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! place in the set, from 1

      gives_back = allocated(self%law(k)%row)
      if (gives_back) gives_back = self%law(k)%row%gives_back()
   end function constraints_gives_back

   !> Pair and number within the pair of constraint `id`; pair 0: it is not one of contact.
   pure subroutine constraint_index(system, id, pair, i)
      type(system_t), intent(in) :: system
      integer, intent(in) :: id                  !! from 1
      integer, intent(out) :: pair               !! 0: it always holds
      integer, intent(out) :: i                  !! `id`, or number within the pair

      pair = count(system%first_constraint < id)
      i = id
      if (pair > 0) i = id - system%first_constraint(pair)
   end subroutine constraint_index

   !> Values and derivatives of all conditions over a motion, and what laws make of them.
   subroutine constraints_evaluate(self, system, motion, leaves_second)
      type(constraint_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in), optional :: leaves_second       !! no second derivatives
      logical :: has_way
      integer :: k

      if (self%n_condition == 0) return
      self%item%leaves_second = .false.
      if (present(leaves_second)) self%item%leaves_second = leaves_second
      self%n_linear = count(self%id(:self%n) <= system%space%linear%n)
      self%n_permanent = count(self%id(:self%n) <= system%first_constraint(1))
      self%frequency = motion%evaluation%mass_scale
      call linearise_range(self, self%n + 1, self%n_condition, system, motion)
      call linearise_range(self, 1, self%n, system, motion)
      ! In equilibrium a contact is measured at the end alone, also one that keeps the gap of the
      ! start.
      has_way = .not. evaluation_is_equilibrium(motion%evaluation)
      do k = 1, self%n
         self%defect(k) = merge(self%item(k)%dgap, self%item(k)%gap1, &
            self%is_kept(k) .and. (has_way .or. k <= self%n_linear))
      end do
      do k = self%n + 1, self%n_row
         associate (item => self%item(self%condition(k)), s => self%slip(k))
            self%defect(k) = item%slip_target(s) - item%slip(s)
         end associate
      end do
      do k = self%n_permanent + 1, self%n_condition
         call respond(self, k)
      end do
   end subroutine constraints_evaluate

   !> The conditions `from` to `to`, whose numbers ascend.
   subroutine linearise_range(self, from, to, system, motion)
      type(constraint_set_t), intent(inout) :: self
      integer, intent(in) :: from, to            !! places in the set
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: k, last, before

      last = from - 1
      before = 0
      do k = 1, size(system%permanent)
         call linearise(system%permanent(k)%constraint)
      end do
      do k = 1, size(system%contact)
         call linearise(system%contact(k)%contact)
      end do

   contains

      !> The conditions of the next constraint.
      subroutine linearise(constraint)
         class(constraint_t), intent(inout) :: constraint
         integer :: first

         first = last + 1
         last = from - 1 + count(self%id(from:to) <= before + constraint%n_constraint)
         if (last >= first) call constraint%linearise(self%id(first:last) - before, motion, &
            self%target(first:last), self%item(first:last))
         before = before + constraint%n_constraint
      end subroutine linearise

   end subroutine linearise_range

   !> Where condition `k` has gone over the motion that was evaluated.
   pure type(contact_values_t) function values_of(self, k) result(values)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n_condition

      associate (item => self%item(k))
         values = contact_values_t(item%gap0, item%gap1, item%dgap, item%gap1, item%slip, &
            item%size, frequency=self%frequency, is_stored=self%penalty%is_stored)
         if (k <= self%n) values%left = self%defect(k)
         if (item%has_friction) values%friction = condition_friction(item, constraints_lam(self, k))
      end associate
   end function values_of

   !> What laws beside the rows of condition `k` have taken over the motion that was evaluated.
   pure real(wp) function constraints_dissipated(self, k, kind) result(dissipated)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! n_permanent + 1..n_condition
      integer, intent(in) :: kind                !! `loss_damping` or `loss_friction`

      dissipated = 0.0_wp
      if (allocated(self%law(k)%beside)) dissipated = contact_laws_dissipated(self%law(k), &
         values_of(self, k), kind)
      if (.not. allocated(self%law(k)%row)) return
      associate (row => self%law(k)%row)
         if (row%loss == kind) dissipated = dissipated + row%dissipated(values_of(self, k), &
            self%item(k)%response)
      end associate
   end function constraints_dissipated

   !> What the laws of condition `k` give. One in place of the row of its gap gives the multiplier,
   !> or what one under way lacks of it, and leaves no defect.
   pure subroutine respond(self, k)
      type(constraint_set_t), intent(inout) :: self
      integer, intent(in) :: k                   !! n_permanent + 1..n_condition
      type(contact_response_t) :: response

      associate (law => self%law(k), penalty => self%penalty)
         if (allocated(law%beside)) call contact_laws_respond(law, values_of(self, k), &
            self%item(k)%response)
         if (.not. allocated(law%row)) return
         call law%row%respond(values_of(self, k), response)
         penalty%left(k) = self%defect(k)
         penalty%slope(k) = response%stiffness(0, 0)
         if (law%row%has_friction) call take_friction(self%item(k)%response, response, &
            allocated(law%beside))
         penalty%lack(k) = merge(response%lam - self%lam(k), 0.0_wp, penalty%is_under_way)
         self%lam(k) = response%lam - penalty%lack(k)
         self%defect(k) = 0.0_wp
      end associate
   end subroutine respond

   !> Friction of a law in place of a row.
   pure subroutine take_friction(self, response, adds)
      type(contact_response_t), intent(inout) :: self
      type(contact_response_t), intent(in) :: response   !! of the law
      logical, intent(in) :: adds                !! to what laws beside it have given

      if (.not. adds) self = contact_response_t()
      self%tau = self%tau + response%tau
      self%stiffness(1:, :) = self%stiffness(1:, :) + response%stiffness(1:, :)
   end subroutine take_friction

   !> Forces on all nodes of the conditions from the `first` one on, and of laws; with `magnitude`
   !> the sum of their sizes.
   pure subroutine constraints_force(self, first, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first               !! place in the set, from 1
      real(wp), intent(out), contiguous :: force(:, :)                   !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)

      real(wp) :: lam
      integer :: k

      call vector_zero(size(force), force)
      do k = first, self%n_condition
         lam = constraints_lam(self, k)
         call add_force(self%item(k), lam + self%item(k)%response%lam, &
            condition_drag(self%item(k), lam), force, magnitude)
      end do
   end subroutine constraints_force

   !> Friction alone, of all conditions and laws, on all nodes.
   pure subroutine constraints_friction(self, force)
      type(constraint_set_t), intent(in) :: self
      real(wp), intent(out), contiguous :: force(:, :)                   !! (n_dim, n_node)
      integer :: k

      call vector_zero(size(force), force)
      do k = 1, self%n_condition
         if (self%item(k)%has_friction) call add_force(self%item(k), 0.0_wp, &
            condition_drag(self%item(k), constraints_lam(self, k)), force)
      end do
   end subroutine constraints_friction

   !> Add the forces of one condition by a push along its gap and friction against its slips.
   pure subroutine add_force(item, push, tau, force, magnitude)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: push, tau(:)
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)
      real(wp) :: part(most_slips + 1)
      integer :: i, n

      n = size(force, 1)
      do i = 1, item%n_node
         associate (node => item%node(i))
            call condition_find_force(item, push, tau, i, part(:n))
            force(:, node) = force(:, node) + part(:n)
            if (present(magnitude)) magnitude(:, node) = magnitude(:, node) + abs(part(:n))
         end associate
      end do
   end subroutine add_force

   !> Add the forces of laws beside the rows.
   pure subroutine constraints_add_law_forces(self, force, are_some)
      type(constraint_set_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      logical, intent(out) :: are_some           !! there are any
      integer :: k

      are_some = .false.
      do k = self%n_permanent + 1, self%n_condition
         associate (response => self%item(k)%response)
            if (.not. (abs(response%lam) > 0.0_wp .or. any(abs(response%tau) > 0.0_wp))) cycle
            are_some = .true.
            call add_force(self%item(k), response%lam, response%tau, force)
         end associate
      end do
   end subroutine constraints_add_law_forces

   !> Add the forces that rows of gaps have by multipliers `lam`, and what those are made of.
   pure subroutine constraints_add_row_forces(self, lam, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      real(wp), intent(in) :: lam(:)             !! (n) [M L/T^2]
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)
      integer :: k

      do k = 1, self%n
         call add_force(self%item(k), lam(k), condition_friction(self%item(k), lam(k)), force, &
            magnitude)
      end do
   end subroutine constraints_add_row_forces

   !> What row `k` is computed from, over the motion that was evaluated: epsilon times this is
   !> round-off of what it lacks, docs/theory.md, eq. (26e).
   pure real(wp) function constraints_rounding(self, motion, k) result(terms)
      type(constraint_set_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: k                   !! 1..n_row
      integer :: i

      associate (item => self%item(self%condition(k)), s => self%slip(k))
         terms = item%size
         do i = 1, item%n_node
            associate (moved => motion%computed(:, item%node(i)))
               if (s == 0) terms = terms + dot_product(abs(item%c(:, i)), moved)
               if (s > 0) terms = terms + dot_product(abs(item%t1(:, i, s)), moved)
            end associate
         end do
      end associate
   end function constraints_rounding

   !> Add what the forces of laws in place of rows are rounded by.
   pure subroutine constraints_add_rounding(self, motion, rounding)
      type(constraint_set_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout), contiguous :: rounding(:, :)              !! (n_dim, n_node)
      real(wp) :: push
      integer :: i, k

      do k = 1, self%n
         if (.not. self%penalty%slope(k) > 0.0_wp) cycle
         push = self%penalty%slope(k)*constraints_rounding(self, motion, k)
         associate (item => self%item(k))
            do i = 1, item%n_node
               rounding(:, item%node(i)) = rounding(:, item%node(i)) + push*abs(item%g(:, i))
            end do
         end associate
      end do
   end subroutine constraints_add_rounding

   !> The multiplier of the row that condition `k` has of its gap; 0 if there is none.
   pure real(wp) function constraints_lam(self, k) result(lam)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n_condition

      lam = 0.0_wp
      if (k <= self%n) lam = self%lam(k)
   end function constraints_lam

end module emcon_constraints
