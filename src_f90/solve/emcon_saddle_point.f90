!> The saddle-point system of the paper's eq. (6), with the multipliers as unknowns.
!>
!> [N, -s Gb^T; s G1, 0] [dq; dlam/s] = -[residual; s defect]. The scale s, the largest diagonal
!> entry of N, makes all blocks of one size and one unit. Source: docs/theory.md, eq. (17). Where N
!> is symmetric and the gradients are the directions of forces, as in statics, and the solver has
!> a use for it, the lower rows are taken with the other sign: then the matrix is symmetric, and
!> has at least one negative eigenvalue for each constraint, or these depend on each other. A
!> contact that gives way has its compliance, 1 by its slope, on the diagonal of the last block.
module emcon_saddle_point
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_find, csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_solver_registry, only : factors_symmetric, solver_create, solver_default
   use emcon_sparse_solver, only : matrix_general, matrix_symmetric, sparse_solver_t
   implicit none
   private
   public :: saddle_point_t, saddle_point_init, saddle_point_factorise, saddle_point_solve
   public :: saddle_point_reset, saddle_point_free

   !> Entries of a symmetric matrix differ by no more than this part of the largest on its diagonal.
   real(dp), parameter :: rounding = 64.0_dp*epsilon(1.0_dp)

   type :: saddle_point_t
      type(csr_t) :: full                        !! (n_unknown + n) square
      integer, allocatable :: slot(:)            !! N, then Gb^T, then G1, then compliances
      integer, allocatable :: diagonal(:)        !! (n_unknown) entries of N
      real(dp) :: scale = 1.0_dp
      class(sparse_solver_t), allocatable :: solver
      !> For symmetric matrices; not there: `solver` takes them like others
      class(sparse_solver_t), allocatable :: symmetric_solver
      integer, allocatable :: mirror(:)          !! entries of N: that of the other triangle
      logical :: is_symmetric = .false.          !! last factorisation: by the symmetric solver
      real(wp), allocatable :: rhs(:), x(:)
   end type saddle_point_t

contains

   !> Choose the solvers anew.
   subroutine saddle_point_reset(self, choice, user)
      type(saddle_point_t), intent(inout) :: self
      integer, intent(in) :: choice              !! one of `solver_`, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      call solver_create(choice, matrix_general, self%solver, user)
      if (factors_symmetric(choice)) then
         call solver_create(choice, matrix_symmetric, self%symmetric_solver)
      else if (allocated(self%symmetric_solver)) then
         call self%symmetric_solver%free()
         deallocate(self%symmetric_solver)
      end if
   end subroutine saddle_point_reset

   !> Free what the solvers hold.
   subroutine saddle_point_free(self)
      type(saddle_point_t), intent(inout) :: self

      if (allocated(self%solver)) call self%solver%free()
      if (allocated(self%symmetric_solver)) call self%symmetric_solver%free()
   end subroutine saddle_point_free

   !> Lay out the system for the active `set`.
   subroutine saddle_point_init(self, set, matrix, error)
      type(saddle_point_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix                  !! pattern of N
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: row(:), column(:)
      integer :: i, n, n_matrix, n_rows, n_penalty

      n = matrix%n_row
      n_matrix = size(matrix%column)
      n_rows = set%force_rows%row_start(set%n_row + 1)
      n_penalty = merge(set%n - set%n_permanent, 0, set%penalty%is_on)
      allocate(row(n_matrix + 2*n_rows + n_penalty), column(n_matrix + 2*n_rows + n_penalty))
      do i = 1, n
         row(matrix%row_start(i) + 1:matrix%row_start(i + 1)) = i
      end do
      column(:n_matrix) = matrix%column + 1
      do i = 1, set%n_row
         associate (from => n_matrix + set%force_rows%row_start(i) + 1, &
               to => n_matrix + set%force_rows%row_start(i + 1))
            column(from:to) = n + i
            row(n_rows + from:n_rows + to) = n + i
         end associate
      end do
      row(n_matrix + 1:n_matrix + n_rows) = set%force_rows%column(:n_rows) + 1
      column(n_matrix + n_rows + 1:n_matrix + 2*n_rows) = set%force_rows%column(:n_rows) + 1
      row(n_matrix + 2*n_rows + 1:) = [(n + i, i = set%n_row - n_penalty + 1, set%n_row)]
      column(n_matrix + 2*n_rows + 1:) = row(n_matrix + 2*n_rows + 1:)
      call csr_from_entries(self%full, n + set%n_row, n + set%n_row, row, column, self%slot)
      if (.not. allocated(self%solver)) call saddle_point_reset(self, solver_default)
      if (allocated(self%rhs)) deallocate(self%rhs, self%x, self%diagonal)
      allocate(self%rhs(n + set%n_row), self%x(n + set%n_row), self%diagonal(n))
      do i = 1, n
         self%diagonal(i) = csr_find(matrix, i, i)
      end do
      if (allocated(self%symmetric_solver)) then
         self%mirror = [(csr_find(matrix, column(i), row(i)), i = 1, n_matrix)]
      else
         call self%solver%analyse(self%full, error)
      end if
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
      n_rows = set%force_rows%row_start(set%n_row + 1)
      do k = 1, n_matrix
         self%full%value(self%slot(k)) = matrix%value(k)
      end do
      do k = 1, n_rows
         self%full%value(self%slot(n_matrix + k)) = -self%scale*set%force_rows%value(k)
         self%full%value(self%slot(n_matrix + n_rows + k)) = self%scale*set%gap_rows%value(k)
      end do
      if (set%penalty%is_on) then
         do k = set%n_permanent + 1, set%n
            self%full%value(self%slot(n_matrix + 2*n_rows + k - set%n_permanent)) &
               = compliance(self, set%penalty%slope(k))
         end do
      end if
      self%is_symmetric = is_mirrored(self, set, matrix)
      if (self%is_symmetric) then
         call factorise_symmetric(self, set%n_row, n_matrix + n_rows, is_singular, error)
         return
      end if
      call self%solver%analyse(self%full, error)
      if (.not. allocated(error)) call self%solver%factorise(self%full%value, error)
      is_singular = self%solver%is_singular
   end subroutine saddle_point_factorise

   !> Of a contact that gives way, in units of the matrix.
   pure real(dp) function compliance(self, slope)
      type(saddle_point_t), intent(in) :: self
      real(wp), intent(in) :: slope              !! >= 0 [M/T^2]

      compliance = self%scale*(self%scale/max(real(slope, dp), rounding*self%scale))
   end function compliance

   !> Would the matrix be symmetric but for the sign of its lower rows, and is there a use for it?
   pure logical function is_mirrored(self, set, matrix)
      type(saddle_point_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      type(csr_t), intent(in) :: matrix
      integer :: n

      is_mirrored = allocated(self%symmetric_solver)
      if (.not. is_mirrored) return
      n = set%force_rows%row_start(set%n_row + 1)
      is_mirrored = all(self%mirror > 0)
      if (is_mirrored) is_mirrored = all(abs(matrix%value - matrix%value(self%mirror)) &
         <= rounding*self%scale)
      if (is_mirrored) is_mirrored = all(abs(set%force_rows%value(:n) - set%gap_rows%value(:n)) &
         <= rounding*maxval(abs(set%force_rows%value(:n))))
   end function is_mirrored

   !> The lower rows with the other sign. Fewer negative pivots than constraints: these depend on
   !> each other. More of them: N is not definite on what constraints leave free, which may be.
   subroutine factorise_symmetric(self, n, before, is_singular, error)
      type(saddle_point_t), intent(inout) :: self
      integer, intent(in) :: n                   !! constraints
      integer, intent(in) :: before              !! entries before those of the lower rows
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error

      is_singular = .true.
      self%full%value(self%slot(before + 1:)) = -self%full%value(self%slot(before + 1:))
      associate (solver => self%symmetric_solver)
         call solver%analyse(self%full, error)
         if (.not. allocated(error)) call solver%factorise(self%full%value, error)
         if (allocated(error)) return
         is_singular = solver%is_singular .or. solver%n_negative < n
      end associate
   end subroutine factorise_symmetric

   !> Corrections of the unknowns and the multipliers.
   subroutine saddle_point_solve(self, set, residual, dq, dlam, error)
      type(saddle_point_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)      !! (n_unknown) with contact forces
      real(wp), intent(out), contiguous :: dq(:)           !! (n_unknown)
      real(wp), intent(out), contiguous :: dlam(:)         !! (n)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, n

      n = size(residual)
      self%rhs(:n) = -residual
      self%rhs(n + 1:) = -real(self%scale, wp)*set%defect
      if (set%penalty%is_on) then
         do k = set%n_permanent + 1, set%n
            self%rhs(n + k) = self%rhs(n + k) + real(compliance(self, set%penalty%slope(k)), wp) &
               *(set%penalty%lack(k)/real(self%scale, wp))
         end do
      end if
      if (self%is_symmetric) then
         self%rhs(n + 1:) = -self%rhs(n + 1:)
         call self%symmetric_solver%solve(self%rhs, self%x, error)
      else
         call self%solver%solve(self%rhs, self%x, error)
      end if
      if (allocated(error)) return
      dq = self%x(:n)
      dlam = real(self%scale, wp)*self%x(n + 1:)
   end subroutine saddle_point_solve

end module emcon_saddle_point
