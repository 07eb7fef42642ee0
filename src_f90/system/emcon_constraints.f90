!> The active constraints of a step: values, gradients, multipliers.
!>
!> One set serves contact pairs, ties and equations. A contact constraint demands that its mean gap
!> be target_k at the end; its multiplier lam_k >= 0 is the contact force. A linear constraint holds
!> a sum of displacements; it stands here only where it is not eliminated in the numbering. Sign:
!> docs/theory.md, eq. (1).
module emcon_constraints
   use emcon_constraint, only : condition_drag, condition_force, condition_normal_slope, &
      condition_push, condition_t, constraint_t
   use emcon_csr, only : csr_find, csr_t
   use emcon_damped, only : damped_add_forces, damped_evaluate, damped_rows, damped_stiffness, &
      damped_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_t
   use emcon_soft_law, only : soft_augmented, soft_follow, soft_penalty, soft_t
   use emcon_system, only : system_t
   use emcon_vectors, only : vector_zero
   implicit none
   private
   public :: constraint_set_t, constraints_select, constraints_evaluate, constraints_rows
   public :: constraints_add_curvature, constraints_force, constraints_merge_pattern
   public :: constraints_stick, constraints_take_hold, constraints_gives_back
   public :: constraints_push, constraints_add_forces
   public :: constraint_place, constraint_dof

   !> Which constraints act, and the linearised set on the unknowns.
   type :: constraint_set_t
      integer :: n = 0
      integer :: n_linear = 0                    !! the first ones: linear, without curvature
      integer :: n_held = 0                      !! these and the next ones always act
      integer, allocatable :: id(:)              !! (n) numbers over all pairs
      type(condition_t), allocatable :: item(:) !! (n) values and derivatives
      real(wp), allocatable :: target(:)         !! (n) mean gap to hold [L]
      logical, allocatable :: is_kept(:)         !! (n) target is gap(q0): hold the difference at 0
      !> (n_row) it acts also where it says nearly what others say
      logical, allocatable :: is_firm(:)
      real(wp), allocatable :: lam(:)            !! (n_row) multipliers [M L/T^2]
      real(wp), allocatable :: defect(:)         !! (n_row) f(q1), what is left to the target [L]
      !> (n) contacts that give way, whose multipliers follow from gaps; not there: none
      type(soft_t), allocatable :: soft(:)
      logical :: is_stored = .false.             !! by discrete gradients of what these store
      !> Their multipliers are on the way to what the gaps say, as unknowns of a solve
      logical :: is_under_way = .false.
      type(damped_t) :: damped                   !! conditions that are damped, of these and others
      !> Conditions that stick have a second row, behind all others: of slip, whose multiplier is
      !> their friction. `n_row` rows, multipliers and defects.
      integer :: n_row = 0
      integer, allocatable :: stuck(:)           !! (n_row - n) places in the set
      type(csr_t) :: force_rows                  !! (n_row x n_unknown) directions of forces
      type(csr_t) :: gap_rows                    !! (n_row x n_unknown) gradients at the end
   end type constraint_set_t

   !> One row while it is made.
   type :: row_t
      integer :: n = 0
      integer, allocatable :: column(:)          !! (>= n) from 0
      real(wp), allocatable :: g(:)              !! (>= n) discrete gradient
      real(wp), allocatable :: c(:)              !! (>= n) gradient at the end
   end type row_t

contains

   !> Take the constraints `id` as the active ones; multipliers start at zero.
   pure subroutine constraints_select(self, id)
      type(constraint_set_t), intent(inout) :: self
      integer, intent(in) :: id(:)               !! (n) ascending, from 1

      self%n = size(id)
      self%n_row = self%n
      self%n_linear = 0
      self%n_held = 0
      self%id = id
      if (allocated(self%soft)) deallocate(self%soft)
      self%is_under_way = .false.
      if (allocated(self%stuck)) deallocate(self%stuck)
      if (allocated(self%item)) deallocate(self%item, self%target, self%is_kept, &
         self%is_firm, self%lam, self%defect)
      allocate(self%item(self%n), self%is_kept(self%n), self%is_firm(self%n))
      allocate(self%target(self%n), self%lam(self%n), self%defect(self%n), source=0.0_wp)
      self%is_kept = .false.
      self%is_firm = .true.
   end subroutine constraints_select

   !> Let the conditions at the places `stuck` stick, with the friction `tau` to start from.
   pure subroutine constraints_stick(self, stuck, tau, is_firm)
      type(constraint_set_t), intent(inout) :: self      !! of `constraints_select`
      integer, intent(in) :: stuck(:)            !! (any) ascending, from 1; these rub
      real(wp), intent(in) :: tau(:)             !! (as many) [M L/T^2]
      logical, intent(in) :: is_firm(:)          !! (as many) also where others nearly do

      self%stuck = stuck
      self%n_row = self%n + size(stuck)
      self%lam = [self%lam(:self%n), tau]
      self%defect = [self%defect(:self%n), 0.0_wp*tau]
      self%is_firm = [self%is_firm(:self%n), is_firm]
      call constraints_take_hold(self)
   end subroutine constraints_stick

   !> The friction of what sticks is its multiplier.
   pure subroutine constraints_take_hold(self)
      type(constraint_set_t), intent(inout) :: self

      if (self%n_row > self%n) self%item(self%stuck)%hold = self%lam(self%n + 1:)
   end subroutine constraints_take_hold

   !> Has condition `k` stored energy in steps before, which it gives back in this one?
   pure logical function constraints_gives_back(self, k) result(gives_back)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! place in the set, from 1

      gives_back = self%is_stored .and. allocated(self%soft)
      if (gives_back) gives_back = self%soft(k)%before < 0.0_wp
   end function constraints_gives_back

   !> Pair and number within the pair of constraint `id`; pair 0: it is not one of contact.
   pure subroutine constraint_place(system, id, pair, i)
      type(system_t), intent(in) :: system
      integer, intent(in) :: id                  !! from 1
      integer, intent(out) :: pair               !! 0: it always holds
      integer, intent(out) :: i                  !! `id`, or number within the pair

      pair = count(system%first_constraint < id)
      i = id
      if (pair > 0) i = id - system%first_constraint(pair)
   end subroutine constraint_place

   !> Is there anything that may push?
   pure logical function constraints_push(self) result(push)
      type(constraint_set_t), intent(in) :: self

      push = self%n > 0 .or. self%damped%n > 0
   end function constraints_push

   !> Values and derivatives of all active constraints over a motion, and of what is damped.
   subroutine constraints_evaluate(self, system, motion, leaves_second)
      type(constraint_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in), optional :: leaves_second       !! no second derivatives
      integer :: k, last, before
      logical :: leaves

      leaves = .false.
      if (present(leaves_second)) leaves = leaves_second
      if (self%damped%n > 0) call damped_evaluate(self%damped, system, motion, leaves)
      if (self%n == 0) return
      self%n_linear = count(self%id <= system%space%linear%n)
      self%n_held = count(self%id <= system%first_constraint(1))
      self%item%leaves_second = leaves
      last = 0
      before = 0
      do k = 1, size(system%held)
         call linearise(system%held(k)%constraint)
      end do
      do k = 1, size(system%contact)
         call linearise(system%contact(k)%contact)
      end do
      do k = 1, self%n
         self%defect(k) = merge(self%item(k)%dgap, self%item(k)%gap1, self%is_kept(k))
      end do
      if (self%n_row > self%n) self%defect(self%n + 1:) = self%item(self%stuck)%lead &
         - self%item(self%stuck)%slip
      if (allocated(self%soft)) call give_way(self)

   contains

      !> The conditions of the next constraint.
      subroutine linearise(constraint)
         class(constraint_t), intent(inout) :: constraint
         integer :: to

         to = count(self%id <= before + constraint%n_constraint)
         if (to > last) call constraint%linearise(self%id(last + 1:to) - before, motion, &
            self%target(last + 1:to), self%item(last + 1:to))
         before = before + constraint%n_constraint
         last = to
      end subroutine linearise

   end subroutine constraints_evaluate

   !> The multipliers of contacts that give way, or what those under way lack; they have no defect.
   pure subroutine give_way(self)
      type(constraint_set_t), intent(inout) :: self
      real(wp) :: lam, start
      integer :: k

      do k = self%n_held + 1, self%n
         associate (soft => self%soft(k), item => self%item(k))
            soft%left = self%defect(k)
            if (self%is_stored) then
               call soft_follow(soft, item%gap0, item%gap1, item%dgap, start)
               call soft_penalty(soft, start, soft%now, lam)
            else
               soft%now = item%gap1
               call soft_augmented(soft, lam)
            end if
            soft%lack = merge(lam - self%lam(k), 0.0_wp, self%is_under_way)
            self%lam(k) = lam - soft%lack
            self%defect(k) = 0.0_wp
         end associate
      end do
   end subroutine give_way

   !> Gradients of the active constraints as rows over the unknowns: those by all freedoms, times T.
   subroutine constraints_rows(self, numbering)
      type(constraint_set_t), intent(inout) :: self
      type(numbering_t), intent(in) :: numbering
      type(row_t) :: row
      integer, allocatable :: order(:)
      integer :: room(self%n_row), k, n

      do k = 1, self%n
         room(k) = entries_of(self%item(k), numbering)
      end do
      do k = self%n + 1, self%n_row
         room(k) = room(self%stuck(k - self%n))
      end do
      n = maxval([0, room])
      allocate(row%column(n), row%g(n), row%c(n), order(n))
      call make_room(self%force_rows, self%n_row, numbering%n_unknown, sum(room))
      call make_room(self%gap_rows, self%n_row, numbering%n_unknown, sum(room))
      n = 0
      do k = 1, self%n_row
         ! A linear constraint stands on single freedoms.
         if (k > self%n) then
            associate (item => self%item(self%stuck(k - self%n)))
               call fill_row(row, item, -item%t, -item%t1, numbering, leaves_zeros=.true.)
            end associate
         else if (self%item(k)%rubs) then
            associate (item => self%item(k))
               call fill_row(row, item, condition_push(item), item%c, numbering, &
                  leaves_zeros=.true.)
            end associate
         else
            call fill_row(row, self%item(k), self%item(k)%g, self%item(k)%c, numbering, &
               leaves_zeros=k > self%n_linear)
         end if
         associate (m => row%n)
            order(:m) = insertion_order(row%column(:m))
            self%force_rows%column(n + 1:n + m) = row%column(order(:m))
            self%force_rows%value(n + 1:n + m) = real(row%g(order(:m)), dp)
            self%gap_rows%value(n + 1:n + m) = real(row%c(order(:m)), dp)
            n = n + m
         end associate
         self%force_rows%row_start(k + 1) = n
      end do
      self%gap_rows%row_start = self%force_rows%row_start
      self%gap_rows%column = self%force_rows%column
      call damped_rows(self%damped, numbering)
   end subroutine constraints_rows

   !> So many unknowns a condition stands on, at most.
   pure integer function entries_of(item, numbering)
      type(condition_t), intent(in) :: item
      type(numbering_t), intent(in) :: numbering
      integer :: i

      entries_of = 0
      do i = 1, item%n_node
         associate (node => item%node(i), n_dim => size(item%g, 1))
            entries_of = entries_of + numbering%start(n_dim*node + 1) &
               - numbering%start(n_dim*(node - 1) + 1)
         end associate
      end do
   end function entries_of

   !> Rows of `n` constraints with `n_entry` entries at most; what fits is kept.
   pure subroutine make_room(rows, n, n_unknown, n_entry)
      type(csr_t), intent(inout) :: rows
      integer, intent(in) :: n, n_unknown, n_entry

      rows%n_row = n
      rows%n_col = n_unknown
      if (allocated(rows%row_start)) then
         if (size(rows%row_start) == n + 1 .and. size(rows%column) == n_entry) return
         deallocate(rows%row_start, rows%column, rows%value)
      end if
      allocate(rows%row_start(n + 1), source=0)
      allocate(rows%column(n_entry), source=0)
      allocate(rows%value(n_entry), source=0.0_dp)
   end subroutine make_room

   !> The derivatives `g` and `c` of a condition by the unknowns, in the order in which these are
   !> met.
   pure subroutine fill_row(row, item, g, c, numbering, leaves_zeros)
      type(row_t), intent(inout) :: row
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: g(:, :), c(:, :)   !! (n_dim, >= n_node) of forces, at the end
      type(numbering_t), intent(in) :: numbering
      logical, intent(in) :: leaves_zeros        !! also freedoms that it does not depend on
      integer :: i, a

      row%n = 0
      do i = 1, item%n_node
         do a = 1, size(item%g, 1)
            if (.not. leaves_zeros .and. abs(g(a, i)) <= 0.0_wp) cycle
            call share_out(row, numbering, size(g, 1)*(item%node(i) - 1) + a, g(a, i), c(a, i))
         end do
      end do
   end subroutine fill_row

   !> Share out the derivatives by freedom `dof`; unknowns that are met again are summed up.
   pure subroutine share_out(row, numbering, dof, dg, dc)
      type(row_t), intent(inout) :: row
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: dof
      real(wp), intent(in) :: dg, dc             !! discrete gradient, gradient at the end
      integer :: t, place

      do t = numbering%start(dof) + 1, numbering%start(dof + 1)
         associate (column => numbering%column(t) - 1, weight => numbering%weight(t))
            if (column < 0) cycle
            place = 0
            if (numbering%n_dependent > 0) place = findloc(row%column(:row%n), column, 1)
            if (place == 0) then
               row%n = row%n + 1
               place = row%n
               row%column(place) = column
               row%g(place) = 0.0_wp
               row%c(place) = 0.0_wp
            end if
            row%g(place) = row%g(place) + weight*dg
            row%c(place) = row%c(place) + weight*dc
         end associate
      end do
   end subroutine share_out

   !> The order that sorts a short list.
   pure function insertion_order(key) result(order)
      integer, intent(in) :: key(:)
      integer :: order(size(key)), i, j, held

      do i = 1, size(key)
         held = i
         do j = i - 1, 1, -1
            if (key(order(j)) <= key(held)) exit
            order(j + 1) = order(j)
         end do
         order(j + 1) = held
      end do
   end function insertion_order

   !> The pattern of `base` widened by all pairs of unknowns that meet in a constraint with
   !> curvature, and where the entries of `base` went.
   subroutine constraints_merge_pattern(self, base, merged, slot)
      type(constraint_set_t), intent(in) :: self
      type(csr_t), intent(in) :: base
      type(csr_t), intent(out) :: merged
      integer, allocatable, intent(out) :: slot(:)       !! (entries of `base`)
      integer, allocatable :: row_start(:), column(:), user_start(:), user(:)
      integer :: i, j, k, l, n, pass
      integer, allocatable :: seen(:)

      call curved_rows(self, row_start, column)
      call list_rows(row_start, column, base%n_row, user_start, user)
      allocate(seen(base%n_row), slot(size(base%column)))
      merged%n_row = base%n_row
      merged%n_col = base%n_col
      allocate(merged%row_start(base%n_row + 1), source=0)
      do pass = 1, 2
         seen = 0
         n = 0
         do i = 1, base%n_row
            do k = base%row_start(i) + 1, base%row_start(i + 1)
               call add_column(base%column(k))
            end do
            do l = user_start(i), user_start(i + 1) - 1
               do k = row_start(user(l)) + 1, row_start(user(l) + 1)
                  call add_column(column(k))
               end do
            end do
            if (pass == 2 .and. user_start(i + 1) > user_start(i)) then
               associate (part => merged%column(merged%row_start(i) + 1:n))
                  part = part(insertion_order(part))
               end associate
            end if
            merged%row_start(i + 1) = n
         end do
         if (pass == 1) allocate(merged%column(n))
      end do
      allocate(merged%value(n), source=0.0_dp)
      do i = 1, base%n_row
         j = merged%row_start(i) + 1
         do k = base%row_start(i) + 1, base%row_start(i + 1)
            do while (merged%column(j) /= base%column(k))
               j = j + 1
            end do
            slot(k) = j
         end do
      end do

   contains

      subroutine add_column(met)
         integer, intent(in) :: met

         if (seen(met + 1) == i) return
         seen(met + 1) = i
         n = n + 1
         if (pass == 2) merged%column(n) = met
      end subroutine add_column

   end subroutine constraints_merge_pattern

   !> The unknowns of what is in the tangent: constraints with curvature, and what is damped.
   pure subroutine curved_rows(self, row_start, column)
      type(constraint_set_t), intent(in) :: self
      integer, allocatable, intent(out) :: row_start(:)    !! (rows + 1)
      integer, allocatable, intent(out) :: column(:)       !! from 0

      associate (start => self%force_rows%row_start(self%n_linear + 1:self%n_row + 1), &
            damped => self%damped)
         row_start = start - start(1)
         column = self%force_rows%column(start(1) + 1:start(size(start)))
         if (damped%n == 0) return
         row_start = [row_start, size(column) + damped%row_start(2:)]
         column = [column, damped%column]
      end associate
   end subroutine curved_rows

   !> For each of `n` unknowns the rows that it occurs in.
   pure subroutine list_rows(row_start, column, n, user_start, user)
      integer, intent(in) :: row_start(:)        !! (rows + 1)
      integer, intent(in) :: column(:)           !! from 0
      integer, intent(in) :: n
      integer, allocatable, intent(out) :: user_start(:), user(:)
      integer :: i, k, place(n)

      allocate(user_start(n + 1), source=0)
      allocate(user(size(column)))
      do k = 1, size(column)
         user_start(column(k) + 2) = user_start(column(k) + 2) + 1
      end do
      user_start(1) = 1
      do i = 1, n
         user_start(i + 1) = user_start(i + 1) + user_start(i)
         place(i) = user_start(i)
      end do
      do i = 1, size(row_start) - 1
         do k = row_start(i) + 1, row_start(i + 1)
            user(place(column(k) + 1)) = i
            place(column(k) + 1) = place(column(k) + 1) + 1
         end do
      end do
   end subroutine list_rows

   !> Forces lam_k g_k on all nodes of the constraints from the `first` one on, and those of what is
   !> damped; with `magnitude` the sum of their sizes.
   pure subroutine constraints_force(self, first, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first               !! place in the set, from 1
      real(wp), intent(out), contiguous :: force(:, :)                   !! (2, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (2, n_node), added to

      call vector_zero(size(force), force)
      if (first <= self%n) call constraints_add_forces(self, first, force, magnitude)
      if (self%damped%n > 0) call damped_add_forces(self%damped, force, magnitude)
   end subroutine constraints_force

   !> Add the forces lam_k g_k alone.
   pure subroutine constraints_add_forces(self, first, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first               !! place in the set, from 1
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)
      real(wp) :: part(size(force, 1))
      integer :: k, i, node

      do k = first, self%n
         do i = 1, self%item(k)%n_node
            node = self%item(k)%node(i)
            part = condition_force(self%item(k), self%lam(k), i)
            force(:, node) = force(:, node) + part
            if (present(magnitude)) magnitude(:, node) = magnitude(:, node) + abs(part)
         end do
      end do
   end subroutine constraints_add_forces

   !> Subtract the sum of lam_k d(discrete gradient of gap_k)/d q1 from the matrix `merged`, and the
   !> derivatives of the forces of what is damped.
   subroutine constraints_add_curvature(self, numbering, merged)
      type(constraint_set_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(inout) :: merged
      integer :: k, n

      do k = self%n_linear + 1, self%n
         associate (item => self%item(k))
            n = size(item%g, 1)*item%n_node
            ! Friction pushes against slip.
            if (item%rubs) call subtract_sum(item, -condition_drag(item, self%lam(k)), &
               item%ht(:n, :n), numbering, merged)
            if (item%rubs .and. item%is_mean .and. abs(item%tilt) > 0.0_wp) call subtract_sum( &
               item, -item%tilt*self%lam(k), spread(reshape(item%t(:, :item%n_node), [n]), 2, n) &
               *spread(condition_normal_slope(item), 1, n), numbering, merged)
            if (all(abs(item%h(:n, :n)) <= 0.0_wp)) cycle
            call subtract_sum(item, self%lam(k), item%h(:n, :n), numbering, merged)
         end associate
      end do
      do k = 1, self%damped%n
         call subtract_sum(self%damped%item(k), -1.0_wp, damped_stiffness(self%damped, k), &
            numbering, merged)
      end do
   end subroutine constraints_add_curvature

   !> Subtract `factor` times the derivatives `h` by the freedoms of a condition, shared out over
   !> their terms.
   subroutine subtract_sum(item, factor, h, numbering, merged)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: h(:, :)            !! (n, n) coordinates node by node
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(inout) :: merged
      integer :: i, j

      do j = 1, size(h, 2)
         do i = 1, size(h, 1)
            call subtract_terms(constraint_dof(item, i), constraint_dof(item, j), factor*h(i, j))
         end do
      end do

   contains

      !> Subtract `value` at the freedoms `row`, `column`.
      subroutine subtract_terms(row, column, value)
         integer, intent(in) :: row, column
         real(wp), intent(in) :: value
         integer :: s, t, slot

         do t = numbering%start(column) + 1, numbering%start(column + 1)
            if (numbering%column(t) == 0) cycle
            do s = numbering%start(row) + 1, numbering%start(row + 1)
               if (numbering%column(s) == 0) cycle
               slot = csr_find(merged, numbering%column(s), numbering%column(t))
               merged%value(slot) = merged%value(slot) &
                  - real(numbering%weight(s)*numbering%weight(t)*value, dp)
            end do
         end do
      end subroutine subtract_terms

   end subroutine subtract_sum

   !> Degree of freedom of local coordinate `i` of a constraint.
   pure integer function constraint_dof(item, i)
      type(condition_t), intent(in) :: item
      integer, intent(in) :: i                   !! 1..n_dim times its nodes

      associate (n_dim => size(item%g, 1))
         constraint_dof = n_dim*(item%node((i - 1)/n_dim + 1) - 1) + mod(i - 1, n_dim) + 1
      end associate
   end function constraint_dof

end module emcon_constraints
