!> Which constraints are independent, and for each an unknown that can be eliminated with it.
!>
!> The rows of discrete gradients and of gradients at the end are eliminated together, those of
!> gaps before those of slips, of each the firm ones first, else in their order, or in one that
!> fills them less. What comes out depends on the present gradients only, not on earlier choices. A
!> row is round-off also where its terms cancel before any elimination, between nodes of which one
!> follows the other by a tie. Source: docs/theory.md, section 5.
module emcon_independent_rows
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : hp
   use emcon_numbering, only : numbering_t
   use emcon_row_elimination, only : elimination_add, elimination_begin, elimination_entries, &
      n_kind, row_elimination_t, row_near, row_poor, row_redundant
   use emcon_row_order, only : row_order_nested
   implicit none
   private
   public :: independent_rows_t, independent_rows_find

   !> A constraint of which less than this part is left says nearly what others say: two nodes that
   !> face each other, held from both sides.
   real(hp), parameter :: nearness = 0.01_hp
   !> Where elimination in the order of the constraints makes more entries than so many times those
   !> of the rows, they are eliminated in an order that fills them less.
   integer, parameter :: most_fill = 8

   type :: independent_rows_t
      integer :: n_redundant = 0
      integer, allocatable :: redundant(:)       !! (n) the first n_redundant: rows to be dropped
      logical, allocatable :: is_near(:)         !! (n) of these: it depends on others nearly only
      integer, allocatable :: dependent(:)       !! (n) unknown to eliminate; 0: redundant
      logical :: is_poor = .false.               !! some row has no good pivot in both gradients
      integer :: n_entry = 0                     !! that elimination left in the rows
      type(row_elimination_t), private :: elimination
   end type independent_rows_t

contains

   !> Find the redundant constraints of `set` and the unknowns to eliminate, for its present rows.
   subroutine independent_rows_find(self, set, numbering)
      type(independent_rows_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      real(hp) :: largest(n_kind, set%n_row)
      integer :: own(size(numbering%unknown, 1), set%n_row), k

      do k = 1, set%n_row
         associate (item => set%item(set%condition(k)), n => set%item(set%condition(k))%n_node, &
               s => set%slip(k))
            own(:, k) = numbering%unknown(:, item%node(1))
            if (s == 0) then
               largest(:, k) = real([maxval(abs(item%g(:, :n))), maxval(abs(item%c(:, :n)))], hp)
            else
               largest(:, k) = real([maxval(abs(item%t(:, :n, s))), &
                  maxval(abs(item%t1(:, :n, s)))], hp)
            end if
         end associate
      end do
      call eliminate(self, set, set%gap_rows, own, largest)
      ! Where no unknown serves both, only the forces tell what is redundant.
      if (.not. self%is_poor) return
      call eliminate(self, set, set%force_rows, own, largest([1, 1], :))
      self%is_poor = .true.
   end subroutine independent_rows_find

   !> Eliminate all rows of forces and of `gap`, a matrix of the same pattern, or those before the
   !> first without a good pivot; firm ones first, and gaps before slips: what slip leaves undone
   !> is never a gap.
   subroutine eliminate(self, set, gap, own, largest)
      type(independent_rows_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: gap
      integer, intent(in) :: own(:, :)               !! (n_dim, n_row) unknowns of the slave nodes
      real(hp), intent(in) :: largest(:, :)          !! (n_kind, n_row) of terms, by all freedoms
      integer :: order(set%n_row), k
      logical :: is_full

      order = [(k, k = 1, size(order))]
      call eliminate_in_order(most_fill*set%force_rows%row_start(size(order) + 1), nearness)
      if (.not. is_full) return
      call row_order_nested(set%force_rows, order)
      ! Of the links of a chain the one that closes it from both sides keeps but its share.
      call eliminate_in_order(huge(most_fill), nearness/real(size(order), hp))

   contains

      !> As `order` has them; it is given up above `most` entries. A row of which less than `near`
      !> is left says nearly what others say.
      subroutine eliminate_in_order(most, near)
         integer, intent(in) :: most
         real(hp), intent(in) :: near
         integer :: i, fate

         call begin(self, set%force_rows)
         call put_gaps_first(set, order)
         do i = 1, size(order)
            k = order(i)
            self%elimination%nearness = merge(0.0_hp, near, set%is_firm(k))
            associate (force => set%force_rows, from => set%force_rows%row_start(k) + 1, &
                  to => set%force_rows%row_start(k + 1))
               call elimination_add(self%elimination, force%column(from:to) + 1, &
                  real(force%value(from:to), hp), real(gap%value(from:to), hp), own(:, k), fate, &
                  largest(:, k))
            end associate
            self%dependent(k) = self%elimination%pivot(i)
            if (fate == row_redundant .or. fate == row_near) then
               self%n_redundant = self%n_redundant + 1
               self%redundant(self%n_redundant) = k
               self%is_near(self%n_redundant) = fate == row_near
            end if
            self%n_entry = elimination_entries(self%elimination)
            is_full = self%n_entry > most
            self%is_poor = fate == row_poor
            if (self%is_poor .or. is_full) exit
         end do
      end subroutine eliminate_in_order

   end subroutine eliminate

   !> Gaps before slips, of each the firm ones first, else as they are.
   pure subroutine put_gaps_first(set, order)
      type(constraint_set_t), intent(in) :: set
      integer, intent(inout) :: order(:)         !! (n_row)
      logical :: is_gap(size(order)), is_firm(size(order))

      is_gap = set%slip(order) == 0
      is_firm = set%is_firm(order)
      order = [pack(order, is_gap .and. is_firm), pack(order, is_gap .and. .not. is_firm), &
         pack(order, .not. is_gap .and. is_firm), pack(order, .not. (is_gap .or. is_firm))]
   end subroutine put_gaps_first

   !> Nothing eliminated yet, with room for all rows of `force`.
   subroutine begin(self, force)
      type(independent_rows_t), intent(inout) :: self
      type(csr_t), intent(in) :: force

      if (allocated(self%redundant)) then
         if (size(self%redundant) /= force%n_row) deallocate(self%redundant, self%is_near, &
            self%dependent)
      end if
      if (.not. allocated(self%redundant)) allocate(self%redundant(force%n_row), &
         self%is_near(force%n_row), self%dependent(force%n_row))
      self%n_redundant = 0
      self%redundant = 0
      self%dependent = 0
      self%is_poor = .false.
      call elimination_begin(self%elimination, force%n_row, force%n_col, force%n_col)
   end subroutine begin

end module emcon_independent_rows
