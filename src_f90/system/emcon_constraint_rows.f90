!> Rows of conditions over the unknowns, and what conditions add to the tangent.
module emcon_constraint_rows
   use emcon_constraint, only : condition_row_force, condition_row_gradient, condition_stiffness, &
      condition_t
   use emcon_constraints, only : constraint_set_t, constraints_lam
   use emcon_csr, only : csr_find, csr_list_users, csr_t
   use emcon_kinds, only : dp, wp
   use emcon_numbering, only : numbering_t
   implicit none
   private
   public :: constraints_rows, constraints_merge_pattern, constraints_add_curvature, constraint_dof

   !> One row while it is made.
   type :: row_t
      integer :: n = 0
      integer, allocatable :: column(:)          !! (>= n) from 0
      real(wp), allocatable :: g(:)              !! (>= n) discrete gradient
      real(wp), allocatable :: c(:)              !! (>= n) gradient at the end
   end type row_t

contains

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
            if (item%has_friction) then
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
   subroutine constraints_merge_pattern(self, base, merged, slot, has_linear)
      type(constraint_set_t), intent(in) :: self
      type(csr_t), intent(in) :: base
      type(csr_t), intent(out) :: merged
      integer, allocatable, intent(out) :: slot(:)       !! (entries of `base`)
      logical, intent(in), optional :: has_linear        !! with what linear constraints join, too
      integer, allocatable :: row_start(:), column(:), user_start(:), user(:)
      integer :: first, i, k, l, n, pass
      integer, allocatable :: seen(:)

      first = self%n_linear + 1
      if (present(has_linear)) first = merge(1, first, has_linear)
      call joined_columns(self, first, row_start, column)
      call csr_list_users(base%n_row, row_start + 1, column + 1, user_start, user)
      allocate(seen(base%n_row))
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
            do l = user_start(i) + 1, user_start(i + 1)
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
      call find_slots(base, merged, slot)

   contains

      subroutine add_column(met)
         integer, intent(in) :: met

         if (seen(met + 1) == i) return
         seen(met + 1) = i
         n = n + 1
         if (pass == 2) merged%column(n) = met
      end subroutine add_column

   end subroutine constraints_merge_pattern

   !> Where the entries of `base` are in a pattern with more of them.
   pure subroutine find_slots(base, merged, slot)
      type(csr_t), intent(in) :: base, merged
      integer, allocatable, intent(out) :: slot(:)       !! (entries of `base`)
      integer :: i, j, k

      allocate(slot(size(base%column)))
      do i = 1, base%n_row
         j = merged%row_start(i) + 1
         do k = base%row_start(i) + 1, base%row_start(i + 1)
            do while (merged%column(j) /= base%column(k))
               j = j + 1
            end do
            slot(k) = j
         end do
      end do
   end subroutine find_slots

   !> The unknowns of what is in the tangent: constraints from `first` on, and what laws give.
   pure subroutine joined_columns(self, first, row_start, column)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: first
      integer, allocatable, intent(out) :: row_start(:)    !! (rows + 1)
      integer, allocatable, intent(out) :: column(:)       !! from 0

      allocate(row_start(1), source=0)
      allocate(column(0))
      associate (start => self%force_rows%row_start)
         if (self%n > 0) then
            row_start = start(first:) - start(first)
            column = self%force_rows%column(start(first) + 1:start(size(start)))
         end if
      end associate
      if (self%n_condition == self%n) return
      associate (start => self%law_rows%row_start)
         row_start = [row_start, size(column) + start(2:)]
         column = [column, self%law_rows%column(:start(size(start)))]
      end associate
   end subroutine joined_columns

   !> Subtract the derivatives of the forces of all conditions by q1 from the matrix `merged`, with
   !> multipliers of rows as they are.
   subroutine constraints_add_curvature(self, numbering, merged, follows)
      type(constraint_set_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(inout) :: merged
      logical, intent(in), optional :: follows   !! as `condition_stiffness` has it
      integer :: k, n

      do k = self%n_linear + 1, self%n_condition
         associate (item => self%item(k))
            n = size(item%g, 1)*item%n_node
            if (item%has_friction .or. allocated(self%law(k)%beside)) then
               call subtract_sum(item, -1.0_wp, condition_stiffness(item, &
                  constraints_lam(self, k), follows), numbering, merged)
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

end module emcon_constraint_rows
