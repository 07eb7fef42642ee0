!> The saddle-point system of the paper's eq. (6), with the multipliers as unknowns.
!>
!> [N, -s Gb^T; s G1, 0] [dq; dlam/s] = -[residual; s defect]. The scale s, the largest diagonal
!> entry of N, makes all blocks of one size and one unit. Source: docs/theory.md, eq. (17).
module emcon_saddle_point
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_find, csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_general, sparse_solver_t
   implicit none
   private
   public :: saddle_point_t, saddle_point_init, saddle_point_factorise, saddle_point_solve

   type :: saddle_point_t
      type(csr_t) :: full                        !! (n_unknown + n) square
      integer, allocatable :: slot(:)            !! N, then Gb^T, then G1
      integer, allocatable :: diagonal(:)        !! (n_unknown) entries of N
      real(dp) :: scale = 1.0_dp
      class(sparse_solver_t), allocatable :: solver
      real(wp), allocatable :: rhs(:), x(:)
   end type saddle_point_t

contains

   !> Lay out the system for the active `set`.
   subroutine saddle_point_init(self, set, matrix, error)
      type(saddle_point_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix                  !! pattern of N
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      integer :: i, n, n_matrix, n_rows

      n = matrix%n_row
      n_matrix = size(matrix%column)
      n_rows = set%force_rows%row_start(set%n + 1)
      allocate(row(n_matrix + 2*n_rows), column(n_matrix + 2*n_rows))
      do i = 1, n
         row(matrix%row_start(i) + 1:matrix%row_start(i + 1)) = i
      end do
      column(:n_matrix) = matrix%column + 1
      do i = 1, set%n
         associate (from => n_matrix + set%force_rows%row_start(i) + 1, &
               to => n_matrix + set%force_rows%row_start(i + 1))
            column(from:to) = n + i
            row(n_rows + from:n_rows + to) = n + i
         end associate
      end do
      row(n_matrix + 1:n_matrix + n_rows) = set%force_rows%column(:n_rows) + 1
      column(n_matrix + n_rows + 1:) = set%force_rows%column(:n_rows) + 1
      call csr_from_entries(self%full, n + set%n, n + set%n, row, column, self%slot)
      if (.not. allocated(self%solver)) call solver_create(solver_default, matrix_general, &
         self%solver)
      call self%solver%analyse(self%full, error)
      if (allocated(error)) return
      if (allocated(self%rhs)) deallocate(self%rhs, self%x, self%diagonal)
      allocate(self%rhs(n + set%n), self%x(n + set%n), self%diagonal(n))
      do i = 1, n
         self%diagonal(i) = csr_find(matrix, i, i)
      end do
   end subroutine saddle_point_init

   !> Factorise for the present matrix and gradients.
   subroutine saddle_point_factorise(self, set, matrix, is_singular, error)
      type(saddle_point_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_singular        !! there is no factor to solve with
      type(error_t), allocatable, intent(out) :: error
      integer :: k, n_matrix, n_rows

      self%scale = maxval(abs(matrix%value(self%diagonal)))
      n_matrix = size(matrix%value)
      n_rows = set%force_rows%row_start(set%n + 1)
      do k = 1, n_matrix
         self%full%value(self%slot(k)) = matrix%value(k)
      end do
      do k = 1, n_rows
         self%full%value(self%slot(n_matrix + k)) = -self%scale*set%force_rows%value(k)
         self%full%value(self%slot(n_matrix + n_rows + k)) = self%scale*set%gap_rows%value(k)
      end do
      call self%solver%factorise(self%full%value, error)
      is_singular = self%solver%is_singular
   end subroutine saddle_point_factorise

   !> Corrections of the unknowns and the multipliers.
   subroutine saddle_point_solve(self, set, residual, dq, dlam, error)
      type(saddle_point_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown) with contact forces
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      real(wp), intent(out), contiguous :: dlam(:)         !! (n)
      type(error_t), allocatable, intent(out) :: error
      integer :: n

      n = size(residual)
      self%rhs(:n) = -residual
      self%rhs(n + 1:) = -real(self%scale, wp)*set%defect
      call self%solver%solve(self%rhs, self%x, error)
      if (allocated(error)) return
      dq = self%x(:n)
      dlam = real(self%scale, wp)*self%x(n + 1:)
   end subroutine saddle_point_solve

end module emcon_saddle_point
