!> Which constraints are independent, and for each an unknown that can be eliminated with it.
!>
!> The rows of discrete gradients and of gradients at the end are eliminated together, in their
!> order. What comes out depends on the present gradients only, not on earlier choices. Source:
!> docs/theory.md, section 5.
module emcon_independent_rows
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : hp
   use emcon_numbering, only : numbering_t
   use emcon_row_elimination, only : elimination_add, elimination_begin, row_elimination_t, &
      row_poor, row_redundant
   implicit none
   private
   public :: independent_rows_t, independent_rows_find

   type :: independent_rows_t
      integer :: n_redundant = 0
      integer, allocatable :: redundant(:)       !! (n) the first n_redundant: rows to be dropped
      integer, allocatable :: dependent(:)       !! (n) unknown to eliminate; 0: redundant
      logical :: is_poor = .false.               !! some row has no good pivot in both gradients
      type(row_elimination_t), private :: elimination
   end type independent_rows_t

contains

   !> Find the redundant constraints of `set` and the unknowns to eliminate, for its present rows.
   subroutine independent_rows_find(self, set, numbering)
      type(independent_rows_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      integer :: own(2, set%n), k

      do k = 1, set%n
         own(:, k) = numbering%unknown(:, set%item(k)%node(1))
      end do
      call eliminate(self, set%force_rows, set%gap_rows, own)
      ! Where no unknown serves both, only the forces tell what is redundant.
      if (.not. self%is_poor) return
      call eliminate(self, set%force_rows, set%force_rows, own)
      self%is_poor = .true.
   end subroutine independent_rows_find

   !> Eliminate all rows of `force` and `gap`, two matrices of one pattern, or those before the
   !> first without a good pivot.
   subroutine eliminate(self, force, gap, own)
      type(independent_rows_t), intent(inout) :: self
      type(csr_t), intent(in) :: force, gap
      integer, intent(in) :: own(:, :)               !! (2, n) unknowns of the slave nodes
      integer :: k, fate

      if (allocated(self%redundant)) then
         if (size(self%redundant) /= force%n_row) deallocate(self%redundant)
      end if
      if (.not. allocated(self%redundant)) allocate(self%redundant(force%n_row))
      self%n_redundant = 0
      self%redundant = 0
      self%is_poor = .false.
      call elimination_begin(self%elimination, force%n_row, force%n_col, force%n_col)
      do k = 1, force%n_row
         associate (from => force%row_start(k) + 1, to => force%row_start(k + 1))
            call elimination_add(self%elimination, force%column(from:to) + 1, &
               real(force%value(from:to), hp), real(gap%value(from:to), hp), own(:, k), fate)
         end associate
         if (fate == row_redundant) then
            self%n_redundant = self%n_redundant + 1
            self%redundant(self%n_redundant) = k
         end if
         self%is_poor = fate == row_poor
         if (self%is_poor) exit
      end do
      self%dependent = self%elimination%pivot
   end subroutine eliminate

end module emcon_independent_rows
