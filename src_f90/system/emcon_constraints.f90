!> The active constraints of a step: values, gradients, multipliers.
!>
!> One set serves contact pairs, ties and equations. A contact constraint demands that its mean gap
!> be target_k at the end; its multiplier lam_k >= 0 is the contact force. A linear constraint holds
!> a sum of displacements; it stands here only where it is not eliminated in the numbering. Sign:
!> docs/theory.md, eq. (1).
module emcon_constraints
   use emcon_constraint, only : condition_force, condition_row_force, condition_row_gradient, &
      condition_stiffness, condition_t, constraint_t, contact_response_t
   use emcon_contact_law, only : contact_law_box_t, contact_values_t
   use emcon_csr, only : csr_find, csr_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_t
   use emcon_system, only : system_t
   use emcon_vectors, only : vector_zero
   implicit none
   private
   public :: constraint_set_t, constraints_select, constraints_evaluate, constraints_rows
   public :: constraints_add_curvature, constraints_force, constraints_merge_pattern
   public :: constraints_stick, constraints_take_hold, constraints_gives_back
   public :: constraints_add_forces, constraints_lam, constraints_dissipated
   public :: constraint_place, constraint_dof

   !> Which conditions act, and their linearised rows on the unknowns. The first `n` have a row of
   !> their gap, of the same number; those of them that stick have rows of their slips too, after
   !> these. The others are of laws alone, beside those or where only these act.
   type :: constraint_set_t
      integer :: n = 0
      integer :: n_condition = 0
      integer :: n_linear = 0                    !! the first ones: linear, without curvature
      integer :: n_held = 0                      !! these and the next ones always act
      !> (n_condition) numbers over all pairs, ascending up to `n` and from there on
      integer, allocatable :: id(:)
      type(condition_t), allocatable :: item(:)  !! (n_condition) values and derivatives
      real(wp), allocatable :: target(:)         !! (n_condition) mean gap to hold, or to count from
      type(contact_law_box_t), allocatable :: law(:)   !! (n_condition) none: its row holds it
      logical, allocatable :: is_kept(:)         !! (n) target is gap(q0): hold the difference at 0
      !> Contacts give way: laws give the multipliers of their rows
      logical :: gives_way = .false.
      logical :: is_stored = .false.             !! by discrete gradients of what these store
      !> Their multipliers are on the way to what the gaps say, as unknowns of a solve
      logical :: is_under_way = .false.
      real(wp) :: frequency = 0.0_wp             !! 1/h of the motion evaluated; statics: 0 [1/T]
      integer :: n_row = 0
      integer, allocatable :: condition(:)       !! (n_row) that each row is of
      integer, allocatable :: slip(:)            !! (n_row) and of which slip; 0: of the gap
      !> (n_row) it acts also where it says nearly what others say
      logical, allocatable :: is_firm(:)
      real(wp), allocatable :: lam(:)            !! (n_row) multipliers [M L/T^2]
      real(wp), allocatable :: defect(:)         !! (n_row) what is left to the target [L]
      ! Of the gaps of contacts that give way:
      real(wp), allocatable :: left(:)           !! (n) of the gap to the target, at the end [L]
      real(wp), allocatable :: slope(:)          !! (n) -d multiplier / d gap, >= 0 [M/T^2]
      real(wp), allocatable :: lack(:)           !! (n) what one on its way lacks [M L/T^2]
      type(csr_t) :: force_rows                  !! (n_row x n_unknown) directions of forces
      type(csr_t) :: gap_rows                    !! (n_row x n_unknown) gradients at the end
      type(csr_t) :: law_rows                    !! of conditions without a row, directions
   end type constraint_set_t

   !> One row while it is made.
   type :: row_t
      integer :: n = 0
      integer, allocatable :: column(:)          !! (>= n) from 0
      real(wp), allocatable :: g(:)              !! (>= n) discrete gradient
      real(wp), allocatable :: c(:)              !! (>= n) gradient at the end
   end type row_t

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
      self%n_held = 0
      self%id = id
      self%condition = [(k, k = 1, self%n)]
      self%slip = 0*self%condition
      self%is_under_way = .false.
      self%gives_way = .false.
      if (allocated(self%item)) deallocate(self%item, self%law, self%target, self%is_kept, &
         self%is_firm, self%lam, self%defect, self%left, self%slope, self%lack)
      if (present(by_law)) then
         self%n_condition = self%n + size(by_law)
         self%id = [id, by_law]
      end if
      allocate(self%item(self%n_condition), self%law(self%n_condition), self%is_kept(self%n), &
         self%is_firm(self%n))
      allocate(self%target(self%n_condition), self%lam(self%n), self%defect(self%n), &
         self%left(self%n), self%slope(self%n), self%lack(self%n), source=0.0_wp)
      self%is_kept = .false.
      self%is_firm = .true.
   end subroutine constraints_select

   !> Let the conditions `stuck` stick, with the friction `tau` to start from: rows of their slips.
   pure subroutine constraints_stick(self, stuck, tau, is_firm)
      type(constraint_set_t), intent(inout) :: self      !! of `constraints_select`
      integer, intent(in) :: stuck(:)            !! (any) ascending, up to n; these rub
      real(wp), intent(in) :: tau(:, :)          !! (slips, as many) [M L/T^2]
      logical, intent(in) :: is_firm(:)          !! (as many) also where others nearly do
      integer :: k, s

      associate (n => self%n, n_slip => size(tau, 1))
         self%n_row = n + size(tau)
         self%condition = [self%condition(:n), [((stuck(k), s = 1, n_slip), k = 1, size(stuck))]]
         self%slip = [self%slip(:n), [((s, s = 1, n_slip), k = 1, size(stuck))]]
         self%lam = [self%lam(:n), tau]
         self%defect = [self%defect(:n), 0.0_wp*tau]
         self%is_firm = [self%is_firm(:n), [((is_firm(k), s = 1, n_slip), k = 1, size(stuck))]]
      end associate
      call constraints_take_hold(self)
   end subroutine constraints_stick

   !> The friction of what sticks is the multipliers of its slips.
   pure subroutine constraints_take_hold(self)
      type(constraint_set_t), intent(inout) :: self
      integer :: k

      do k = self%n + 1, self%n_row
         self%item(self%condition(k))%response%tau(self%slip(k)) = self%lam(k)
      end do
   end subroutine constraints_take_hold

   !> Has condition `k` stored energy in steps before, which it gives back in this one?
   pure logical function constraints_gives_back(self, k) result(gives_back)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! place in the set, from 1

      gives_back = allocated(self%law(k)%law)
      if (gives_back) gives_back = self%law(k)%law%gives_back()
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

   !> Values and derivatives of all conditions over a motion, and what laws make of them.
   subroutine constraints_evaluate(self, system, motion, leaves_second)
      type(constraint_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in), optional :: leaves_second       !! no second derivatives
      integer :: k

      if (self%n_condition == 0) return
      self%item%leaves_second = .false.
      if (present(leaves_second)) self%item%leaves_second = leaves_second
      self%n_linear = count(self%id(:self%n) <= system%space%linear%n)
      self%n_held = count(self%id(:self%n) <= system%first_constraint(1))
      self%frequency = motion%pose%mass_scale
      call linearise_range(self, self%n + 1, self%n_condition, system, motion)
      call linearise_range(self, 1, self%n, system, motion)
      do k = 1, self%n
         self%defect(k) = merge(self%item(k)%dgap, self%item(k)%gap1, self%is_kept(k))
      end do
      do k = self%n + 1, self%n_row
         associate (item => self%item(self%condition(k)), s => self%slip(k))
            self%defect(k) = item%slip_target(s) - item%slip(s)
         end associate
      end do
      do k = self%n_held + 1, self%n_condition
         if (allocated(self%law(k)%law)) call respond(self, k)
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
      do k = 1, size(system%held)
         call linearise(system%held(k)%constraint)
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
            self%frequency)
         if (k <= self%n) values%left = self%defect(k)
      end associate
   end function values_of

   !> What the law of condition `k` has taken over the motion that was evaluated.
   pure real(wp) function constraints_dissipated(self, k) result(dissipated)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! n + 1..n_condition

      dissipated = self%law(k)%law%dissipated(values_of(self, k), self%item(k)%response)
   end function constraints_dissipated

   !> What the law of condition `k` gives. Where the condition has a row of its gap, that takes the
   !> multiplier, or what one under way lacks of it, and has no defect.
   pure subroutine respond(self, k)
      type(constraint_set_t), intent(inout) :: self
      integer, intent(in) :: k                   !! n_held + 1..n_condition
      type(contact_response_t) :: response

      call self%law(k)%law%respond(values_of(self, k), response)
      if (k > self%n) then
         self%item(k)%response = response
         return
      end if
      self%left(k) = self%defect(k)
      self%slope(k) = response%stiffness(0, 0)
      self%lack(k) = merge(response%lam - self%lam(k), 0.0_wp, self%is_under_way)
      self%lam(k) = response%lam - self%lack(k)
      self%defect(k) = 0.0_wp
   end subroutine respond

   !> Gradients of the rows over the unknowns: those by all freedoms, times T.
   subroutine constraints_rows(self, numbering)
      type(constraint_set_t), intent(inout) :: self
      type(numbering_t), intent(in) :: numbering
      integer :: k

      call make_rows(self, numbering, self%condition, self%slip, self%force_rows, self%gap_rows)
      if (self%n_condition > self%n) call make_rows(self, numbering, [(k, k = self%n + 1, &
         self%n_condition)], [(0, k = self%n + 1, self%n_condition)], self%law_rows)
   end subroutine constraints_rows

   !> Rows of conditions: directions of forces and gradients at the end, of one pattern.
   subroutine make_rows(self, numbering, condition, slip, force_rows, gap_rows)
      type(constraint_set_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: condition(:)        !! (rows) places in the set
      integer, intent(in) :: slip(:)             !! (rows) 0: of the gap
      type(csr_t), intent(inout) :: force_rows   !! (rows x n_unknown)
      type(csr_t), intent(inout), optional :: gap_rows   !! (rows x n_unknown)
      type(row_t) :: row
      integer, allocatable :: order(:)
      integer :: room(size(condition)), k, n

      do k = 1, size(room)
         room(k) = entries_of(self%item(condition(k)), numbering)
      end do
      n = maxval([0, room])
      allocate(row%column(n), row%g(n), row%c(n), order(n))
      call make_room(force_rows, size(room), numbering%n_unknown, sum(room))
      if (present(gap_rows)) call make_room(gap_rows, size(room), numbering%n_unknown, sum(room))
      n = 0
      do k = 1, size(room)
         associate (item => self%item(condition(k)))
            if (item%rubs) then
               call fill_row(row, item, condition_row_force(item, slip(k)), &
                  condition_row_gradient(item, slip(k)), numbering, leaves_zeros=.true.)
            else
               ! A linear constraint stands on single freedoms.
               call fill_row(row, item, item%g, item%c, numbering, &
                  leaves_zeros=condition(k) > self%n_linear)
            end if
         end associate
         associate (m => row%n)
            order(:m) = insertion_order(row%column(:m))
            force_rows%column(n + 1:n + m) = row%column(order(:m))
            force_rows%value(n + 1:n + m) = real(row%g(order(:m)), dp)
            if (present(gap_rows)) gap_rows%value(n + 1:n + m) = real(row%c(order(:m)), dp)
            n = n + m
         end associate
         force_rows%row_start(k + 1) = n
      end do
      if (.not. present(gap_rows)) return
      gap_rows%row_start = force_rows%row_start
      gap_rows%column = force_rows%column
   end subroutine make_rows

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

   !> The unknowns of what is in the tangent: constraints with curvature, and what laws give.
   pure subroutine curved_rows(self, row_start, column)
      type(constraint_set_t), intent(in) :: self
      integer, allocatable, intent(out) :: row_start(:)    !! (rows + 1)
      integer, allocatable, intent(out) :: column(:)       !! from 0

      allocate(row_start(1), source=0)
      allocate(column(0))
      associate (start => self%force_rows%row_start, before => self%n_linear + 1)
         if (self%n > 0) then
            row_start = start(before:) - start(before)
            column = self%force_rows%column(start(before) + 1:start(size(start)))
         end if
      end associate
      if (self%n_condition == self%n) return
      associate (start => self%law_rows%row_start)
         row_start = [row_start, size(column) + start(2:)]
         column = [column, self%law_rows%column(:start(size(start)))]
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

   !> Forces on all nodes of the conditions from the `first` one on, and of laws; with `magnitude`
   !> the sum of their sizes.
   pure subroutine constraints_force(self, first, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first               !! place in the set, from 1
      real(wp), intent(out), contiguous :: force(:, :)                   !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)

      call vector_zero(size(force), force)
      call constraints_add_forces(self, first, self%n_condition, force, magnitude)
   end subroutine constraints_force

   !> Add the forces of the conditions `first` to `last`.
   pure subroutine constraints_add_forces(self, first, last, force, magnitude)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first, last         !! places in the set, from 1
      real(wp), intent(inout), contiguous :: force(:, :)                 !! (n_dim, n_node)
      real(wp), intent(inout), contiguous, optional :: magnitude(:, :)   !! (n_dim, n_node)
      real(wp) :: part(size(force, 1)), lam
      integer :: k, i, node

      do k = first, last
         lam = constraints_lam(self, k)
         do i = 1, self%item(k)%n_node
            node = self%item(k)%node(i)
            part = condition_force(self%item(k), lam, i)
            force(:, node) = force(:, node) + part
            if (present(magnitude)) magnitude(:, node) = magnitude(:, node) + abs(part)
         end do
      end do
   end subroutine constraints_add_forces

   !> The multiplier of the row that condition `k` has of its gap; 0 if there is none.
   pure real(wp) function constraints_lam(self, k) result(lam)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n_condition

      lam = 0.0_wp
      if (k <= self%n) lam = self%lam(k)
   end function constraints_lam

   !> Subtract the derivatives of the forces of all conditions by q1 from the matrix `merged`, with
   !> multipliers of rows as they are.
   subroutine constraints_add_curvature(self, numbering, merged)
      type(constraint_set_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(inout) :: merged
      integer :: k, n

      do k = self%n_linear + 1, self%n_condition
         associate (item => self%item(k))
            n = size(item%g, 1)*item%n_node
            if (item%rubs .or. k > self%n) then
               call subtract_sum(item, -1.0_wp, condition_stiffness(item, &
                  constraints_lam(self, k)), numbering, merged)
            else if (any(abs(item%h(:n, :n)) > 0.0_wp)) then
               call subtract_sum(item, self%lam(k), item%h(:n, :n), numbering, merged)
            end if
         end associate
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
