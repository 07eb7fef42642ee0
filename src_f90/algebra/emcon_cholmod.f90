!> Sparse Cholesky factorisation by CHOLMOD, for symmetric positive definite matrices.
!>
!> The matrix is given in full; only its lower triangle is read. The values are first multiplied by
!> the power of two that brings the first diagonal entry into [1/2, 1), unless that was done before:
!> without it a factor 2 on the matrix would become sqrt(2) in the factor, and units would change
!> bits.
!>
!> Where halves may be rough and columns are long, CHOLMOD orders and we factorise, in single
!> precision (`emcon_supernodal_factor`), unless a matrix asks for more digits.
module emcon_cholmod
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_int, c_null_ptr, c_ptr
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_csr, only : csr_copy_pattern, csr_find, csr_is_same, csr_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_power_scaling, only : power_of_two
   use emcon_row_panels, only : row_panel_t
   use emcon_sparse_solver, only : matrix_definite, solver_check_square, solver_check_values, &
      solver_raise, sparse_solver_t
   use emcon_supernodal_factor, only : supernodal_factor_t, supernodal_factorise, supernodal_free
   use emcon_supernodal_rows, only : supernodal_rows
   use emcon_supernodal_solve, only : supernodal_backward, supernodal_error, supernodal_forward, &
      supernodal_reach
   use emcon_supernodes, only : supernodes_init, supernodes_is_stack, supernodes_t
   implicit none
   private
   public :: cholmod_t

   integer(c_int), parameter :: cholmod_ok = 0, cholmod_not_posdef = 1, cholmod_out_of_memory = -2

   !> Operations for each entry of a factor from which on dense blocks pay.
   real(dp), parameter :: least_density = 32.0_dp
   !> A rough factor may be wrong by so much: less than what a kept one is after a few increments.
   real(dp), parameter :: roughest = 2.0_dp**(-6)

   type, extends(sparse_solver_t) :: cholmod_t
      integer, private :: first_slot = 0                     !! of the entry (1, 1); 0: not there
      type(csr_t), private :: scaled             !! the pattern, and half_scale*value where not 1
      real(dp), allocatable, private :: rhs(:), x(:)
      logical :: is_rough = .false.                          !! the last factors have halves alone
      type(supernodes_t), private :: nodes                   !! none: only factors of CHOLMOD
      type(supernodal_factor_t), private :: rough
      logical, private :: is_factorised = .false.
      type(c_ptr), private :: handle = c_null_ptr
   contains
      procedure :: analyse => cholmod_analyse
      procedure :: factorise => cholmod_factorise
      procedure :: solve => cholmod_solve
      procedure :: has_halves => cholmod_has_halves
      procedure :: solve_half => cholmod_solve_half
      procedure :: reach_half => cholmod_reach_half
      procedure :: has_panels => cholmod_has_panels
      procedure :: reach_rows => cholmod_reach_rows
      procedure :: free => cholmod_free
   end type cholmod_t

   interface
      type(c_ptr) function emcon_cholmod_new(halves) bind(c)
         import :: c_int, c_ptr
         integer(c_int), value :: halves
      end function emcon_cholmod_new

      integer(c_int) function emcon_cholmod_analyse(handle, n, ap, ai) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n
         integer(c_int), intent(in) :: ap(*), ai(*)
      end function emcon_cholmod_analyse

      integer(c_int) function emcon_cholmod_factorise(handle, n, ap, ai, ax, rcond, n_factor) &
         bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*)
         real(c_double), intent(inout) :: rcond, n_factor
      end function emcon_cholmod_factorise

      integer(c_int) function emcon_cholmod_solve(handle, n, b, x) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n
         real(c_double), intent(in) :: b(*)
         real(c_double), intent(inout) :: x(*)
      end function emcon_cholmod_solve

      integer(c_int) function emcon_cholmod_half(handle, n, is_second, b, x) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n, is_second
         real(c_double), intent(in) :: b(*)
         real(c_double), intent(inout) :: x(*)
      end function emcon_cholmod_half

      function emcon_cholmod_reach(handle, n, m, column, value, n_reached, index, x) &
         result(status) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n, m
         integer(c_int), intent(in) :: column(*)
         real(c_double), intent(in) :: value(*)
         integer(c_int), intent(inout) :: n_reached, index(*)
         real(c_double), intent(inout) :: x(*)
         integer(c_int) :: status
      end function emcon_cholmod_reach

      subroutine emcon_cholmod_counts(handle, work, n_factor) bind(c)
         import :: c_double, c_ptr
         type(c_ptr), value :: handle
         real(c_double), intent(inout) :: work, n_factor
      end subroutine emcon_cholmod_counts

      integer(c_int) function emcon_cholmod_nodes(handle, n, ap, ai, n_node, n_row) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n
         integer(c_int), intent(in) :: ap(*), ai(*)
         integer(c_int), intent(inout) :: n_node, n_row
      end function emcon_cholmod_nodes

      subroutine emcon_cholmod_take_nodes(handle, order, first, row_start, row) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), intent(inout) :: order(*), first(*), row_start(*), row(*)
      end subroutine emcon_cholmod_take_nodes

      subroutine emcon_cholmod_free(handle) bind(c)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine emcon_cholmod_free
   end interface

contains

   subroutine cholmod_analyse(self, matrix, error)
      class(cholmod_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      real(c_double) :: n_factor

      if (c_associated(self%handle)) then
         if (csr_is_same(self%scaled, matrix)) return
      end if
      call self%free()
      call solver_check_square(matrix, error)
      if (allocated(error)) return
      call csr_copy_pattern(matrix, self%scaled)
      if (self%is_scaled) deallocate(self%scaled%value)      ! those that are given will do
      self%first_slot = csr_find(matrix, 1, 1)
      allocate(self%rhs(matrix%n_row), self%x(matrix%n_row))
      self%handle = emcon_cholmod_new(merge(1_c_int, 0_c_int, self%needs_halves))
      status = cholmod_out_of_memory
      if (c_associated(self%handle)) then
         ! METIS draws from the generator of the process, which it starts anew each time.
         !$omp critical (emcon_ordering)
         status = emcon_cholmod_analyse(self%handle, int(matrix%n_row, c_int), &
            self%scaled%row_start, self%scaled%column)
         !$omp end critical (emcon_ordering)
      end if
      if (status == cholmod_ok) then
         call emcon_cholmod_counts(self%handle, self%n_operation, n_factor)
         self%n_factor = int(n_factor, int64)
         if (self%needs_halves .and. self%may_be_rough &
            .and. self%n_operation >= least_density*n_factor) call find_nodes(self, status)
      end if
      self%n_analysis = self%n_analysis + 1
      if (status /= cholmod_ok) call solver_raise(error, "CHOLMOD", "ordering", int(status), &
         status == cholmod_out_of_memory, self%scaled)
      if (allocated(error)) call self%free()
   end subroutine cholmod_analyse

   !> The nodes of the factor.
   subroutine find_nodes(self, status)
      class(cholmod_t), intent(inout) :: self
      integer(c_int), intent(out) :: status
      integer, allocatable :: order(:), first(:), row_start(:), row(:)
      integer(c_int) :: n_node, n_row

      associate (a => self%scaled)
         status = emcon_cholmod_nodes(self%handle, int(a%n_row, c_int), a%row_start, a%column, &
            n_node, n_row)
         if (status /= cholmod_ok) return
         allocate(order(a%n_row), first(n_node + 1), row_start(n_node + 1), row(n_row), source=0)
         call emcon_cholmod_take_nodes(self%handle, order, first, row_start, row)
         call supernodes_init(self%nodes, a, order, first, row_start, row)
         if (.not. supernodes_is_stack(self%nodes)) self%nodes = supernodes_t()
      end associate
   end subroutine find_nodes

   subroutine cholmod_factorise(self, value, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: scaled(:)

      self%is_singular = .true.
      self%is_factorised = .false.
      self%rcond = 0.0_dp
      call solver_check_values(self%scaled, value, error)
      if (allocated(error)) return
      if (self%first_slot == 0 .or. .not. all(ieee_is_finite(value))) return
      if (value(self%first_slot) <= 0.0_dp) return
      if (self%is_scaled) then
         call factorise_scaled(self, value, error)
      else
         self%half_scale = power_of_two(-exponent(value(self%first_slot)))
         call move_alloc(self%scaled%value, scaled)
         scaled = self%half_scale*value
         call factorise_scaled(self, scaled, error)
         call move_alloc(scaled, self%scaled%value)
      end if
   end subroutine cholmod_factorise

   !> Rough factors, or those of CHOLMOD.
   subroutine factorise_scaled(self, value, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot) half_scale times the matrix
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status
      real(c_double) :: n_factor

      call factorise_nodes(self, value)
      if (self%is_rough) return
      call blas_enter(fp_status)
      associate (a => self%scaled)
         status = emcon_cholmod_factorise(self%handle, int(a%n_row, c_int), a%row_start, a%column, &
            value, self%rcond, n_factor)
      end associate
      call blas_leave(fp_status)
      if (status == cholmod_not_posdef) return
      if (status /= cholmod_ok) call solver_raise(error, "CHOLMOD", "factorisation", int(status), &
         status == cholmod_out_of_memory, self%scaled)
      if (allocated(error)) return
      self%is_singular = .false.
      self%is_factorised = .true.
      self%n_factor = int(n_factor, int64)
   end subroutine factorise_scaled

   !> Rough factors, where there are nodes and they are good enough.
   subroutine factorise_nodes(self, value)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot) half_scale times the matrix

      self%is_rough = .false.
      if (self%nodes%n_node == 0) return
      call supernodal_factorise(self%rough, self%nodes, value, self%is_rough)
      if (self%is_rough) self%is_rough = supernodal_error(self%rough, self%nodes, self%scaled, &
         value) <= roughest
      if (.not. self%is_rough) then
         call supernodal_free(self%rough)
         return
      end if
      self%is_singular = .false.
      self%is_factorised = .true.
      self%n_factor = self%nodes%value_start(self%nodes%n_node + 1)
   end subroutine factorise_nodes

   subroutine cholmod_solve(self, rhs, x, error)
      class(cholmod_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status

      if (.not. self%is_factorised) then
         call raise(error, err_internal, "cholmod_solve: there is no factorisation")
         return
      else if (self%is_rough) then
         call raise(error, err_internal, "cholmod_solve: rough factors have halves alone")
         return
      end if
      self%rhs = self%half_scale*real(rhs, dp)
      call blas_enter(fp_status)
      status = emcon_cholmod_solve(self%handle, int(self%scaled%n_row, c_int), self%rhs, self%x)
      call blas_leave(fp_status)
      if (status /= cholmod_ok) call solver_raise(error, "CHOLMOD", "solution", int(status), &
         status == cholmod_out_of_memory, self%scaled)
      x = real(self%x, wp)
   end subroutine cholmod_solve

   pure logical function cholmod_has_halves(self)
      class(cholmod_t), intent(in) :: self

      cholmod_has_halves = self%symmetry == matrix_definite
   end function cholmod_has_halves

   subroutine cholmod_solve_half(self, is_second, rhs, x, error)
      class(cholmod_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status

      if (self%is_rough .and. is_second) then
         self%x = rhs
         call supernodal_backward(self%rough, self%nodes, self%x)
         x(self%nodes%order) = self%x
         return
      else if (self%is_rough) then
         x = rhs(self%nodes%order)
         call supernodal_forward(self%rough, self%nodes, x)
         return
      end if
      call blas_enter(fp_status)
      status = emcon_cholmod_half(self%handle, int(size(rhs), c_int), &
         merge(1_c_int, 0_c_int, is_second), rhs, x)
      call blas_leave(fp_status)
      if (status /= cholmod_ok) call solver_raise(error, "CHOLMOD", "solution", int(status), &
         status == cholmod_out_of_memory, self%scaled)
   end subroutine cholmod_solve_half

   pure logical function cholmod_has_panels(self)
      class(cholmod_t), intent(in) :: self

      cholmod_has_panels = self%is_factorised .and. self%is_rough
   end function cholmod_has_panels

   subroutine cholmod_reach_rows(self, row_start, column, value, panel, error)
      class(cholmod_t), intent(inout) :: self
      integer, intent(in), contiguous :: row_start(:)
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      type(row_panel_t), allocatable, intent(out) :: panel(:)
      type(error_t), allocatable, intent(out) :: error

      allocate(panel(self%nodes%n_node))
      call supernodal_rows(self%rough, self%nodes, row_start, self%nodes%place(column + 1), value, &
         panel)
   end subroutine cholmod_reach_rows

   subroutine cholmod_reach_half(self, column, value, n_reached, index, x, error)
      class(cholmod_t), intent(inout) :: self
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      integer, intent(out) :: n_reached
      integer, intent(inout), contiguous :: index(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status, n
      type(ieee_status_type) :: fp_status

      if (self%is_rough) then
         call supernodal_reach(self%rough, self%nodes, self%nodes%place(column + 1), value, &
            n_reached, index, x)
         return
      end if
      call blas_enter(fp_status)
      status = emcon_cholmod_reach(self%handle, int(self%scaled%n_row, c_int), &
         int(size(column), c_int), column, value, n, index, x)
      call blas_leave(fp_status)
      n_reached = n
      if (status /= cholmod_ok) call solver_raise(error, "CHOLMOD", "solution", int(status), &
         status == cholmod_out_of_memory, self%scaled)
   end subroutine cholmod_reach_half

   subroutine cholmod_free(self)
      class(cholmod_t), intent(inout) :: self

      call emcon_cholmod_free(self%handle)
      self%handle = c_null_ptr
      if (allocated(self%rhs)) deallocate(self%rhs, self%x)
      call supernodal_free(self%rough)
      self%nodes = supernodes_t()
      self%is_rough = .false.
      self%scaled = csr_t()
      self%is_factorised = .false.
      self%is_singular = .false.
   end subroutine cholmod_free

end module emcon_cholmod
