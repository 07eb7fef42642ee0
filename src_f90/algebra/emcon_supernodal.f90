!> Sparse Cholesky factorisation by dense blocks, for symmetric positive definite matrices.
!>
!> The matrix is given in full. The values are first multiplied by the power of two that brings the
!> first diagonal entry into [1/2, 1), unless that was done before: without it a factor 2 on the
!> matrix would become sqrt(2) in the factor, and units would change bits.
!>
!> Where halves may be rough and columns are long, factors are of single precision, unless a matrix
!> asks for more digits.
module emcon_supernodal
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_copy_pattern, csr_find, csr_is_same, csr_is_symmetric, csr_t
   use emcon_elimination_tree, only : elimination_tree_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_ordering, only : ordering_find
   use emcon_power_scaling, only : power_of_two
   use emcon_row_panels, only : row_panel_t
   use emcon_sparse_solver, only : matrix_definite, solver_check_square, solver_check_values, &
      solver_raise, sparse_solver_t
   use emcon_supernodal_double, only : double_t => supernodal_factor_t, &
      double_backward => supernodal_backward, double_factorise => supernodal_factorise, &
      double_forward => supernodal_forward, double_free => supernodal_free, &
      double_reach => supernodal_reach, double_rows => supernodal_rows
   use emcon_supernodal_single, only : single_t => supernodal_factor_t, &
      single_backward => supernodal_backward, single_error => supernodal_error, &
      single_factorise => supernodal_factorise, single_forward => supernodal_forward, &
      single_free => supernodal_free, single_reach => supernodal_reach, &
      single_rows => supernodal_rows
   use emcon_supernode_search, only : supernodes_find
   use emcon_supernodes, only : supernodes_t
   implicit none
   private
   public :: supernodal_t

   !> Operations for each entry of a factor from which on halves as long pay.
   real(dp), parameter :: least_density = 32.0_dp
   !> A rough factor may be wrong by so much: less than what a kept one is after a few increments.
   real(dp), parameter :: roughest = 2.0_dp**(-6)

   type, extends(sparse_solver_t) :: supernodal_t
      logical :: is_rough = .false.              !! the last factors have halves alone
      logical, private :: may_use_single = .false.
      logical, private :: is_factorised = .false.
      integer, private :: first_slot = 0         !! of the entry (1, 1)
      type(csr_t), private :: pattern
      type(supernodes_t), private :: nodes
      type(single_t), private :: single
      type(double_t), private :: double
      real(dp), allocatable, private :: x(:)     !! (n) in the order of the factor
   contains
      procedure :: analyse => supernodal_analyse
      procedure :: factorise => supernodal_factorise
      procedure :: solve => supernodal_solve
      procedure :: has_halves => supernodal_has_halves
      procedure :: solve_half => supernodal_solve_half
      procedure :: reach_half => supernodal_reach_half
      procedure :: has_panels => supernodal_has_panels
      procedure :: reach_rows => supernodal_reach_rows
      procedure :: free => supernodal_free
   end type supernodal_t

contains

   subroutine supernodal_analyse(self, matrix, error)
      class(supernodal_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      type(elimination_tree_t) :: tree
      logical :: is_found

      if (allocated(self%x)) then
         if (csr_is_same(self%pattern, matrix)) return
      end if
      call self%free()
      call solver_check_square(matrix, error)
      if (allocated(error)) return
      call csr_copy_pattern(matrix, self%pattern)
      deallocate(self%pattern%value)             ! those that are given will do
      self%n_analysis = self%n_analysis + 1
      allocate(self%x(matrix%n_row))
      if (.not. csr_is_symmetric(self%pattern)) return     ! no definite matrix has such a pattern
      call ordering_find(self%pattern, self%seeks_less_fill, tree, is_found)
      if (.not. is_found) then
         call solver_raise(error, "AMD", "ordering", 0, .true., self%pattern)
         call self%free()
         return
      end if
      self%first_slot = csr_find(matrix, 1, 1)
      call supernodes_find(self%nodes, self%pattern, tree)
      self%n_factor = int(tree%n_entry, int64)
      self%n_operation = tree%n_operation
      self%may_use_single = self%needs_halves .and. self%may_be_rough &
         .and. tree%n_operation >= least_density*tree%n_entry
   end subroutine supernodal_analyse

   subroutine supernodal_factorise(self, value, error)
      class(supernodal_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: scaled(:)

      self%is_singular = .true.
      self%is_factorised = .false.
      call solver_check_values(self%pattern, value, error)
      if (allocated(error)) return
      if (self%first_slot == 0 .or. .not. all(ieee_is_finite(value))) return
      if (value(self%first_slot) <= 0.0_dp) return
      if (self%is_scaled) then
         call factorise_scaled(self, value)
      else
         self%half_scale = power_of_two(-exponent(value(self%first_slot)))
         scaled = self%half_scale*value
         call factorise_scaled(self, scaled)
      end if
      self%is_singular = .not. self%is_factorised
      if (self%is_factorised) self%n_factor = self%nodes%value_start(self%nodes%n_node + 1)
   end subroutine supernodal_factorise

   !> Rough factors, where they may be and are good enough, or those of double precision.
   subroutine factorise_scaled(self, value)
      class(supernodal_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot) half_scale times the matrix
      real(dp) :: largest_error

      self%is_rough = self%may_use_single
      if (self%is_rough) call single_factorise(self%single, self%nodes, value, self%is_rough)
      if (self%is_rough) then
         call single_error(self%single, self%nodes, self%pattern, value, largest_error)
         self%is_rough = largest_error <= roughest
      end if
      self%is_factorised = self%is_rough
      if (self%is_rough) then
         call double_free(self%double)
      else
         call single_free(self%single)
         call double_factorise(self%double, self%nodes, value, self%is_factorised)
      end if
   end subroutine factorise_scaled

   subroutine supernodal_solve(self, rhs, x, error)
      class(supernodal_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%is_factorised) then
         call raise(error, err_internal, "supernodal_solve: there is no factorisation")
         return
      else if (self%is_rough) then
         call raise(error, err_internal, "supernodal_solve: rough factors have halves alone")
         return
      end if
      self%x = self%half_scale*real(rhs(self%nodes%order), dp)
      call double_forward(self%double, self%nodes, self%x)
      call double_backward(self%double, self%nodes, self%x)
      x(self%nodes%order) = real(self%x, wp)
   end subroutine supernodal_solve

   pure logical function supernodal_has_halves(self)
      class(supernodal_t), intent(in) :: self

      supernodal_has_halves = self%symmetry == matrix_definite
   end function supernodal_has_halves

   subroutine supernodal_solve_half(self, is_second, rhs, x, error)
      class(supernodal_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      if (is_second) then
         self%x = rhs
         if (self%is_rough) then
            call single_backward(self%single, self%nodes, self%x)
         else
            call double_backward(self%double, self%nodes, self%x)
         end if
         x(self%nodes%order) = self%x
      else
         x = rhs(self%nodes%order)
         if (self%is_rough) then
            call single_forward(self%single, self%nodes, x)
         else
            call double_forward(self%double, self%nodes, x)
         end if
      end if
   end subroutine supernodal_solve_half

   subroutine supernodal_reach_half(self, column, value, n_reached, index, x, error)
      class(supernodal_t), intent(inout) :: self
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      integer, intent(out) :: n_reached
      integer, intent(inout), contiguous :: index(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      if (self%is_rough) then
         call single_reach(self%single, self%nodes, self%nodes%place(column + 1), value, &
            n_reached, index, x)
      else
         call double_reach(self%double, self%nodes, self%nodes%place(column + 1), value, &
            n_reached, index, x)
      end if
   end subroutine supernodal_reach_half

   pure logical function supernodal_has_panels(self)
      class(supernodal_t), intent(in) :: self

      supernodal_has_panels = self%is_factorised
   end function supernodal_has_panels

   subroutine supernodal_reach_rows(self, row_start, column, value, panel, error)
      class(supernodal_t), intent(inout) :: self
      integer, intent(in), contiguous :: row_start(:)
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      type(row_panel_t), allocatable, intent(out) :: panel(:)
      type(error_t), allocatable, intent(out) :: error

      allocate(panel(self%nodes%n_node))
      if (self%is_rough) then
         call single_rows(self%single, self%nodes, row_start, self%nodes%place(column + 1), value, &
            panel)
      else
         call double_rows(self%double, self%nodes, row_start, self%nodes%place(column + 1), value, &
            panel)
      end if
   end subroutine supernodal_reach_rows

   subroutine supernodal_free(self)
      class(supernodal_t), intent(inout) :: self

      if (allocated(self%x)) deallocate(self%x)
      call single_free(self%single)
      call double_free(self%double)
      self%nodes = supernodes_t()
      self%pattern = csr_t()
      self%first_slot = 0
      self%is_rough = .false.
      self%is_factorised = .false.
      self%is_singular = .false.
   end subroutine supernodal_free

end module emcon_supernodal
