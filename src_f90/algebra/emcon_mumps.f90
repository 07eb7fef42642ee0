!> Sparse factorisation by MUMPS: LU of any matrix, LDL^T of symmetric ones.
!>
!> A symmetric matrix is given in full; only its lower triangle is read. MUMPS counts its negative
!> pivots: a saddle point of a definite matrix and n independent constraints has n of them. Before
!> that, values are scaled by powers of two, which rounds nothing: rows and columns, or where the
!> matrix is symmetric all of it. MUMPS' own scaling stays off, so that units keep the bits.
module emcon_mumps
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_int, c_null_ptr, c_ptr
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_csr, only : csr_copy_pattern, csr_is_same, csr_is_symmetric, csr_t
   use emcon_elimination_tree, only : elimination_tree_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_ordering, only : ordering_find
   use emcon_power_scaling, only : power_of_two, power_scaling_t
   use emcon_sparse_solver, only : matrix_definite, matrix_general, matrix_symmetric, &
      solver_check_square, solver_check_values, solver_raise, sparse_solver_t
   implicit none
   private
   public :: mumps_t

   integer(c_int), parameter :: mumps_ok = 0, mumps_structurally_singular = -6, &
      mumps_no_memory(3) = [-7, -13, -19], mumps_singular = -10

   type, extends(sparse_solver_t) :: mumps_t
      type(csr_t), private :: scaled             !! the pattern, and the values after scaling
      type(power_scaling_t), private :: scaling
      integer, allocatable, private :: entry(:)  !! those of the pattern that MUMPS reads
      real(dp), allocatable, private :: value(:) !! of these
      real(dp), allocatable, private :: x(:)
      logical, private :: is_factorised = .false.
      type(c_ptr), private :: handle = c_null_ptr
   contains
      procedure :: analyse => mumps_analyse
      procedure :: factorise => mumps_factorise
      procedure :: solve => mumps_solve
      procedure :: free => mumps_free
   end type mumps_t

   interface
      type(c_ptr) function emcon_mumps_new(symmetry) bind(c)
         import :: c_int, c_ptr
         integer(c_int), value :: symmetry
      end function emcon_mumps_new

      integer(c_int) function emcon_mumps_analyse(handle, n, n_entry, row, column, &
         n_place, place) bind(c)
         import :: c_int, c_ptr
         type(c_ptr), value :: handle
         integer(c_int), value :: n, n_entry, n_place
         integer(c_int), intent(in) :: row(*), column(*), place(*)
      end function emcon_mumps_analyse

      integer(c_int) function emcon_mumps_factorise(handle, value, n_factor, n_negative) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         real(c_double), intent(in) :: value(*)
         real(c_double), intent(inout) :: n_factor
         integer(c_int), intent(inout) :: n_negative
      end function emcon_mumps_factorise

      integer(c_int) function emcon_mumps_solve(handle, x) bind(c)
         import :: c_double, c_int, c_ptr
         type(c_ptr), value :: handle
         real(c_double), intent(inout) :: x(*)
      end function emcon_mumps_solve

      subroutine emcon_mumps_free(handle) bind(c)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine emcon_mumps_free
   end interface

contains

   subroutine mumps_analyse(self, matrix, error)
      class(mumps_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      integer, allocatable :: row(:)
      integer(c_int), allocatable :: place(:)
      integer :: i, k

      if (c_associated(self%handle)) then
         if (csr_is_same(self%scaled, matrix)) return
      end if
      call self%free()
      call solver_check_square(matrix, error)
      if (allocated(error)) return
      call csr_copy_pattern(matrix, self%scaled)
      call self%scaling%init(matrix%n_row, matrix%n_col)
      allocate(row(size(matrix%column)))
      do i = 1, matrix%n_row
         row(matrix%row_start(i) + 1:matrix%row_start(i + 1)) = i
      end do
      allocate(self%entry, source=pack([(k, k = 1, size(row))], &
         self%symmetry == matrix_general .or. matrix%column + 1 <= row))
      allocate(self%value(size(self%entry)), self%x(matrix%n_row))
      call find_place(self, place)
      self%handle = emcon_mumps_new(int(self%symmetry, c_int))
      status = mumps_no_memory(1)
      if (c_associated(self%handle)) then
         status = emcon_mumps_analyse(self%handle, int(matrix%n_row, c_int), &
            int(size(self%entry), c_int), int(row(self%entry), c_int), &
            int(matrix%column(self%entry) + 1, c_int), size(place), place)
      end if
      self%n_analysis = self%n_analysis + 1
      ! A pattern without a full transversal is found out by its values.
      if (status < mumps_ok .and. status /= mumps_structurally_singular) call solver_raise(error, &
         "MUMPS", "ordering", int(status), any(status == mumps_no_memory), self%scaled)
      if (allocated(error)) call self%free()
   end subroutine mumps_analyse

   !> When each unknown is eliminated, from 1; none where MUMPS has to find an order itself: where
   !> the pattern is not symmetric, and for saddle points, whose pivots by value it foresees.
   subroutine find_place(self, place)
      type(mumps_t), intent(in) :: self          !! with the pattern
      integer(c_int), allocatable, intent(out) :: place(:)
      type(elimination_tree_t) :: tree
      logical :: is_found
      integer :: k

      is_found = self%symmetry /= matrix_symmetric
      if (is_found) is_found = csr_is_symmetric(self%scaled)
      if (is_found) call ordering_find(self%scaled, self%seeks_less_fill, tree, is_found)
      if (.not. is_found) then
         allocate(place(0))
         return
      end if
      allocate(place(self%scaled%n_row))
      do k = 1, size(place)
         place(tree%order(k)) = k
      end do
   end subroutine find_place

   subroutine mumps_factorise(self, value, error)
      class(mumps_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status, n_negative
      type(ieee_status_type) :: fp_status
      real(c_double) :: n_factor

      self%is_singular = .true.
      self%is_factorised = .false.
      self%n_negative = -1
      call solver_check_values(self%scaled, value, error)
      if (allocated(error)) return
      call scale_values(self, value)
      if (.not. self%scaling%is_regular) return
      self%value = self%scaled%value(self%entry)
      call blas_enter(fp_status)
      status = emcon_mumps_factorise(self%handle, self%value, n_factor, n_negative)
      call blas_leave(fp_status)
      if (any(status == [mumps_singular, mumps_structurally_singular])) return
      if (status < mumps_ok) call solver_raise(error, "MUMPS", "factorisation", int(status), &
         any(status == mumps_no_memory), self%scaled)
      if (allocated(error)) return
      if (self%symmetry /= matrix_general) self%n_negative = n_negative
      if (self%symmetry == matrix_definite .and. n_negative > 0) return
      self%is_singular = .false.
      self%is_factorised = .true.
      self%n_factor = int(n_factor, int64)
   end subroutine mumps_factorise

   !> `scaling` and `scaled`: a symmetric matrix stays one.
   subroutine scale_values(self, value)
      type(mumps_t), intent(inout) :: self
      real(dp), intent(in) :: value(:)           !! (n_slot)

      if (self%symmetry == matrix_general) then
         call self%scaling%equilibrate(value, self%scaled)
         return
      end if
      self%scaling%is_regular = all(ieee_is_finite(value))
      if (.not. self%scaling%is_regular) return
      self%scaling%is_regular = any(abs(value) > 0.0_dp)
      self%scaling%row = power_of_two(-exponent(maxval(abs(value))))
      self%scaling%column = 1.0_dp
      self%scaled%value = self%scaling%row(1)*value
   end subroutine scale_values

   subroutine mumps_solve(self, rhs, x, error)
      class(mumps_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status

      if (.not. self%is_factorised) then
         call raise(error, err_internal, "mumps_solve: there is no factorisation")
         return
      end if
      self%x = self%scaling%row*real(rhs, dp)
      call blas_enter(fp_status)
      status = emcon_mumps_solve(self%handle, self%x)
      call blas_leave(fp_status)
      if (status < mumps_ok) call solver_raise(error, "MUMPS", "solution", int(status), &
         any(status == mumps_no_memory), self%scaled)
      x = real(self%scaling%column*self%x, wp)
   end subroutine mumps_solve

   subroutine mumps_free(self)
      class(mumps_t), intent(inout) :: self

      call emcon_mumps_free(self%handle)
      self%handle = c_null_ptr
      if (allocated(self%x)) deallocate(self%x, self%value, self%entry)
      self%scaled = csr_t()
      self%is_factorised = .false.
      self%is_singular = .false.
   end subroutine mumps_free

end module emcon_mumps
