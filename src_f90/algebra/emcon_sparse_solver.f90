!> What every solver of sparse systems offers.
!>
!> Order of use: `analyse` once per pattern, `factorise` for each set of values, `solve` for each
!> right-hand side. A matrix that cannot be factorised is a result (`is_singular`), not an error,
!> and so is a solution that has not become as good as was asked for (`is_converged`).
!> An object owns memory of a C library: never assign one to another, and `free` it at the end (at
!> any time, also twice). There is no finaliser: gfortran 12 loses other components of an object
!> that holds one. Copies are made of an object that has analysed nothing: it owns no memory yet.
module emcon_sparse_solver
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_row_panels, only : row_panel_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: sparse_solver_t, solver_box_t, solver_check_square, solver_check_values, &
      solver_raise, solver_renew
   public :: matrix_general, matrix_definite, matrix_symmetric

   !> What a solver may rely on. Matrices are given in full, whatever they are.
   integer, parameter :: matrix_general = 0, matrix_definite = 1, matrix_symmetric = 2

   type, abstract :: sparse_solver_t
      integer :: symmetry = matrix_general    !! one of `matrix_`, set before `analyse`
      integer :: choice = -1                  !! by which it was created; < 0: by none
      !> Set before `analyse`: it is factorised often enough to pay for two analyses
      logical :: seeks_less_fill = .false.
      !> The last `factorise` met a zero pivot, or one that is not positive where it must be, or
      !> values that are not finite: `solve` is then refused.
      logical :: is_singular = .false.
      real(dp) :: rcond = 0.0_dp              !! smallest over largest pivot, or 0: an indicator
      integer :: n_negative = -1              !! pivots < 0 of a symmetric matrix; < 0: not counted
      !> Nonzeros of the factors, as predicted from `analyse` on where that tells operations
      integer(int64) :: n_factor = 0_int64
      real(dp) :: n_operation = 0.0_dp        !! operations of a factorisation; 0: not predicted
      logical :: needs_halves = .false.       !! set before `analyse`, if it `has_halves`
      !> Set before `analyse`, with `needs_halves`: those of a matrix near to it will do
      logical :: may_be_rough = .false.
      logical :: is_scaled = .false.          !! set before `factorise`: `half_scale` stays 1
      real(dp) :: half_scale = 1.0_dp         !! > 0, L L^T of the halves is that times A
      !> Set before `analyse`: solutions may be wrong by so much of themselves; 0: by round-off only
      real(dp) :: accuracy = 0.0_dp
      !> The last `solve` met that; else `x` is as near as it came
      logical :: is_converged = .true.
      !> Known after `analyse`: its halves are of a factor that half_scale*A is near to, no more
      logical :: is_incomplete = .false.
      !> Set before `analyse`, with `accuracy`: iterations take about as many steps on any mesh
      logical :: is_even = .false.
      !> (n, any) Set before `analyse`, with `accuracy`, or not allocated: motions that take hardly
      !> any energy, as those of a rigid body: parts of them are the coarse space of iterations
      real(dp), allocatable :: near_null(:, :)
      integer :: n_analysis = 0               !! analyses made: tells whether a pattern was reused
      integer, private :: of_analysis = 0     !! `n_analysis` when `factored` was factorised
      real(dp), allocatable, private :: factored(:)      !! values of the last `solver_renew`
   contains
      procedure(analyse_pattern), deferred :: analyse
      procedure(factorise_values), deferred :: factorise
      procedure(solve_system), deferred :: solve
      procedure(free_memory), deferred :: free
      procedure :: has_halves
      procedure :: solve_half
      procedure :: reach_half
      procedure :: has_panels
      procedure :: reach_rows
      procedure :: multiply
      procedure :: takes_rows
      procedure :: take_row
      procedure :: factorise_rows
      procedure :: let_threads
   end type sparse_solver_t

   !> For arrays of solvers.
   type :: solver_box_t
      character(len=:), allocatable :: name      !! what decks call it, where they can
      class(sparse_solver_t), allocatable :: solver
   end type solver_box_t

   abstract interface
      !> Order the pattern of a square matrix; returns at once if it is the one already analysed.
      subroutine analyse_pattern(self, matrix, error)
         import :: csr_t, error_t, sparse_solver_t
         class(sparse_solver_t), intent(inout) :: self
         type(csr_t), intent(in) :: matrix              !! its values are not read
         type(error_t), allocatable, intent(out) :: error
      end subroutine analyse_pattern

      !> Factorise the matrix of the analysed pattern; look at `is_singular` afterwards.
      subroutine factorise_values(self, value, error)
         import :: dp, error_t, sparse_solver_t
         class(sparse_solver_t), intent(inout) :: self
         real(dp), intent(in), contiguous :: value(:)   !! (n_slot) of the pattern
         type(error_t), allocatable, intent(out) :: error
      end subroutine factorise_values

      !> x = A^-1 rhs
      subroutine solve_system(self, rhs, x, error)
         import :: error_t, sparse_solver_t, wp
         class(sparse_solver_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: rhs(:)     !! (n)
         real(wp), intent(out), contiguous :: x(:)      !! (n)
         type(error_t), allocatable, intent(out) :: error
      end subroutine solve_system

      subroutine free_memory(self)
         import :: sparse_solver_t
         class(sparse_solver_t), intent(inout) :: self
      end subroutine free_memory
   end interface

contains

   !> Does it factorise definite matrices as half_scale*A = L L^T, and solve by each half alone? Not
   !> unless overridden.
   pure logical function has_halves(self)
      class(sparse_solver_t), intent(in) :: self

      has_halves = .false.
   end function has_halves

   !> x = L^-1 P rhs, or the second half x = P^T L^-T rhs, P an order of the unknowns; for who
   !> `needs_halves`.
   subroutine solve_half(self, is_second, rhs, x, error)
      class(sparse_solver_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)         !! (n)
      real(dp), intent(inout), contiguous :: x(:)        !! (n)
      type(error_t), allocatable, intent(out) :: error

      call raise(error, err_internal, "a solver without halves was asked to solve by one")
   end subroutine solve_half

   !> L^-1 P rhs of a sparse right-hand side: what of it is not zero.
   subroutine reach_half(self, column, value, n_reached, index, x, error)
      class(sparse_solver_t), intent(inout) :: self
      integer, intent(in), contiguous :: column(:)       !! (m) places of the entries, from 0
      real(dp), intent(in), contiguous :: value(:)       !! (m)
      integer, intent(out) :: n_reached                  !! entries of the solution
      integer, intent(inout), contiguous :: index(:)     !! (n) their places, from 0
      real(dp), intent(inout), contiguous :: x(:)        !! (n) and values, the first n_reached
      type(error_t), allocatable, intent(out) :: error

      n_reached = 0
      call raise(error, err_internal, "a solver without halves was asked to solve by one")
   end subroutine reach_half

   !> Do many right-hand sides go through the factor that there is together? Not unless overridden.
   pure logical function has_panels(self)
      class(sparse_solver_t), intent(in) :: self

      has_panels = .false.
   end function has_panels

   !> L^-1 P of many sparse right-hand sides, by panels of columns; for who `has_panels`.
   subroutine reach_rows(self, row_start, column, value, panel, error)
      class(sparse_solver_t), intent(inout) :: self
      integer, intent(in), contiguous :: row_start(:)    !! (n + 1) entries before those of each
      integer, intent(in), contiguous :: column(:)       !! places of the entries, from 0
      real(dp), intent(in), contiguous :: value(:)       !! as `column`
      type(row_panel_t), allocatable, intent(out) :: panel(:)
      type(error_t), allocatable, intent(out) :: error

      call raise(error, err_internal, "a solver without panels was asked for some")
   end subroutine reach_rows

   !> y = half_scale*A x; for who `is_incomplete`.
   subroutine multiply(self, x, y, error)
      class(sparse_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:)           !! (n)
      real(dp), intent(inout), contiguous :: y(:)        !! (n)
      type(error_t), allocatable, intent(out) :: error

      call raise(error, err_internal, "a solver that has factors was asked for the matrix")
   end subroutine multiply

   !> Known after `analyse`: is a matrix given row by row, by `take_row` and `factorise_rows` in
   !> place of `factorise`, so that nobody needs another copy of it? Not unless overridden.
   pure logical function takes_rows(self)
      class(sparse_solver_t), intent(in) :: self

      takes_rows = .false.
   end function takes_rows

   !> The values of row `i` of the analysed pattern; for who `takes_rows`, from the first row on.
   subroutine take_row(self, i, value, error)
      class(sparse_solver_t), intent(inout) :: self
      integer, intent(in) :: i
      real(dp), intent(in), contiguous :: value(:)       !! as the columns of the row
      type(error_t), allocatable, intent(out) :: error

      call raise(error, err_internal, "a solver that takes matrices as a whole was given a row")
   end subroutine take_row

   !> Factorise the matrix whose rows were given; look at `is_singular` afterwards.
   subroutine factorise_rows(self, error)
      class(sparse_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call raise(error, err_internal, "a solver that takes matrices as a whole has no rows")
   end subroutine factorise_rows

   !> Let `n` threads work on it, to the same bits. One does, unless overridden.
   pure subroutine let_threads(self, n)
      class(sparse_solver_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 1
   end subroutine let_threads

   !> Factorise `value`, of the analysed pattern, unless the last factors are those of these values:
   !> matrices of linear bodies stay the same.
   subroutine solver_renew(self, value, error)
      class(sparse_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)       !! (n_slot) of the pattern
      type(error_t), allocatable, intent(out) :: error

      if (is_factored(self, value)) return
      self%of_analysis = 0
      call self%factorise(value, error)
      if (allocated(error)) return
      if (allocated(self%factored)) then
         if (size(self%factored) /= size(value)) deallocate(self%factored)
      end if
      if (.not. allocated(self%factored)) allocate(self%factored(size(value)))
      self%factored = value
      self%of_analysis = self%n_analysis
   end subroutine solver_renew

   !> Does the solver hold factors of `value`? One that does not count its analyses may not.
   pure logical function is_factored(self, value)
      class(sparse_solver_t), intent(in) :: self
      real(dp), intent(in), contiguous :: value(:)
      integer :: k

      is_factored = self%of_analysis > 0 .and. self%of_analysis == self%n_analysis
      if (is_factored) is_factored = size(self%factored) == size(value)
      if (.not. is_factored) return
      do k = 1, size(value)
         is_factored = abs(value(k) - self%factored(k)) <= 0.0_dp
         if (.not. is_factored) return
      end do
   end function is_factored

   !> An error if the matrix is not square or has no rows.
   subroutine solver_check_square(matrix, error)
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      if (matrix%n_row == matrix%n_col .and. matrix%n_row > 0) return
      call raise(error, err_internal, "a solver cannot take a matrix of " &
         // to_text(matrix%n_row) // " x " // to_text(matrix%n_col))
   end subroutine solver_check_square

   !> An error if `value` does not belong to the pattern, or none was analysed.
   subroutine solver_check_values(pattern, value, error)
      type(csr_t), intent(in) :: pattern
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(pattern%column)) then
         call raise(error, err_internal, "a matrix cannot be factorised before its pattern is" &
            // " analysed")
      else if (size(value) /= size(pattern%column)) then
         call raise(error, err_internal, "a solver got " // to_text(size(value)) // " values for " &
            // to_text(size(pattern%column)) // " entries")
      end if
   end subroutine solver_check_values

   !> The error that a library reports by `status`.
   subroutine solver_raise(error, library, action, status, is_memory, matrix)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in) :: library, action
      integer, intent(in) :: status
      logical, intent(in) :: is_memory             !! the status means: out of memory
      type(csr_t), intent(in) :: matrix
      character(len=:), allocatable :: what

      what = action // " of a matrix with " // to_text(matrix%n_row) // " unknowns and " &
         // to_text(size(matrix%column)) // " entries"
      if (is_memory) then
         call raise(error, err_analysis, "out of memory in the " // what)
      else
         call raise(error, err_internal, library // " returns " // to_text(status) // " from the " &
            // what)
      end if
   end subroutine solver_raise

end module emcon_sparse_solver
