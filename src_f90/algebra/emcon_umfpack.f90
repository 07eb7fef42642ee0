!> Sparse LU factorisation by UMFPACK.
!>
!> CSR arrays are handed over as they are: UMFPACK reads them as the columns of the transpose, and
!> solves with the transpose of what it factorised. Before that, rows and columns are scaled by
!> powers of two, which rounds nothing. UMFPACK's own scaling stays off: it switches between
!> dividing and multiplying by reciprocals at an absolute 1e-12, so that units would change bits.
module emcon_umfpack
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_int, c_null_ptr, c_ptr
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_csr, only : csr_copy_pattern, csr_is_same, csr_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_power_scaling, only : power_scaling_t
   use emcon_sparse_solver, only : solver_check_square, solver_check_values, solver_raise, &
      sparse_solver_t
   implicit none
   private
   public :: umfpack_t, ordering_amd, ordering_metis

   !> Values of `umfpack_t%ordering`, those of UMFPACK.
   integer, parameter :: ordering_amd = 1, ordering_metis = 3

   integer(c_int), parameter :: umfpack_ok = 0, umfpack_singular = 1, umfpack_out_of_memory = -1
   integer(c_int), parameter :: umfpack_aat = 2

   !> Places in UMFPACK's arrays of controls and figures, from 1.
   integer, parameter :: control_irstep = 8, control_ordering = 11, control_scale = 17
   integer, parameter :: info_symmetric_fill = 37, info_symmetric_work = 38, info_lnz = 44
   integer, parameter :: info_unz = 45, info_rcond = 68

   !> Operations for each entry of the factors from which on another ordering is tried: those of
   !> bodies in space, where it spares a fifth to two thirds of them; it costs a seventh of a
   !> factorisation there and less above. In the plane they are of half a million unknowns and more.
   real(c_double), parameter :: least_work = 250.0_c_double

   type, extends(sparse_solver_t) :: umfpack_t
      integer :: ordering = ordering_amd         !! set before `analyse`
      integer :: n_refine = 0                    !! steps of iterative refinement at most
      type(csr_t), private :: scaled             !! the pattern, and the values after scaling
      type(power_scaling_t), private :: scaling
      real(dp), allocatable, private :: rhs(:), x(:), work(:)
      integer(c_int), allocatable, private :: index_work(:)
      real(c_double), private :: control(20), info(90)
      type(c_ptr), private :: symbolic = c_null_ptr
      type(c_ptr), private :: numeric = c_null_ptr
   contains
      procedure :: analyse => umfpack_analyse
      procedure :: factorise => umfpack_factorise
      procedure :: solve => umfpack_solve
      procedure :: free => umfpack_free
   end type umfpack_t

   interface
      subroutine umfpack_di_defaults(control) bind(c)
         import :: c_double
         real(c_double), intent(out) :: control(*)
      end subroutine umfpack_di_defaults

      function umfpack_di_symbolic(n_row, n_col, ap, ai, ax, symbolic, control, info) &
         result(status) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n_row, n_col
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*), control(*)
         type(c_ptr), intent(out) :: symbolic
         real(c_double), intent(inout) :: info(*)
         integer(c_int) :: status
      end function umfpack_di_symbolic

      integer(c_int) function umfpack_di_numeric(ap, ai, ax, symbolic, numeric, control, info) &
         bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*), control(*)
         type(c_ptr), value :: symbolic
         type(c_ptr), intent(out) :: numeric
         real(c_double), intent(inout) :: info(*)
      end function umfpack_di_numeric

      function umfpack_di_wsolve(sys, ap, ai, ax, x, b, numeric, control, info, wi, w) &
         result(status) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: sys
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*), b(*), control(*)
         real(c_double), intent(inout) :: x(*), info(*), w(*)
         type(c_ptr), value :: numeric
         integer(c_int), intent(inout) :: wi(*)
         integer(c_int) :: status
      end function umfpack_di_wsolve

      subroutine umfpack_di_free_symbolic(symbolic) bind(c)
         import :: c_ptr
         type(c_ptr), intent(inout) :: symbolic
      end subroutine umfpack_di_free_symbolic

      subroutine umfpack_di_free_numeric(numeric) bind(c)
         import :: c_ptr
         type(c_ptr), intent(inout) :: numeric
      end subroutine umfpack_di_free_numeric
   end interface

contains

   subroutine umfpack_analyse(self, matrix, error)
      class(umfpack_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      integer :: n

      if (c_associated(self%symbolic)) then
         if (csr_is_same(self%scaled, matrix)) return
      end if
      call self%free()
      call solver_check_square(matrix, error)
      if (allocated(error)) return
      n = matrix%n_row
      call csr_copy_pattern(matrix, self%scaled)
      allocate(self%rhs(n), self%x(n), self%work(5*n), self%index_work(n))
      call self%scaling%init(n, n)
      call umfpack_di_defaults(self%control)
      self%control(control_scale) = 0.0_c_double
      ! Ones, not a null pointer: without values UMFPACK counts no diagonal entry and takes the
      ! strategy for unsymmetric patterns, which here costs twice the time and many digits.
      self%scaled%value = 1.0_dp
      call order(self, self%ordering, status)
      if (status == umfpack_ok .and. self%ordering == ordering_amd) call order_better(self, status)
      self%n_analysis = self%n_analysis + 1
      if (status /= umfpack_ok) call solver_raise(error, "UMFPACK", "ordering", int(status), &
         status == umfpack_out_of_memory, self%scaled)
   end subroutine umfpack_analyse

   !> Nested dissection in place of minimum degree, where that is worth another ordering and fills
   !> less.
   subroutine order_better(self, status)
      type(umfpack_t), intent(inout) :: self     !! analysed by minimum degree
      integer(c_int), intent(out) :: status
      real(c_double) :: fill
      logical :: is_dense

      status = umfpack_ok
      fill = self%info(info_symmetric_fill)      ! < 0: not ordered as a symmetric pattern
      is_dense = fill > 0.0_c_double .and. self%info(info_symmetric_work) >= least_work*fill
      if (.not. (self%seeks_less_fill .or. is_dense)) return
      call order(self, ordering_metis, status)
      if (status == umfpack_ok .and. self%info(info_symmetric_fill) > fill) call order(self, &
         ordering_amd, status)
   end subroutine order_better

   !> Analyse the pattern with one ordering of UMFPACK.
   subroutine order(self, ordering, status)
      type(umfpack_t), intent(inout) :: self
      integer, intent(in) :: ordering
      integer(c_int), intent(out) :: status

      call umfpack_di_free_symbolic(self%symbolic)
      self%control(control_ordering) = real(ordering, c_double)
      associate (a => self%scaled)
         ! METIS draws from the generator of the process, which it starts anew each time.
         !$omp critical (emcon_ordering)
         status = umfpack_di_symbolic(int(a%n_row, c_int), int(a%n_row, c_int), a%row_start, &
            a%column, a%value, self%symbolic, self%control, self%info)
         !$omp end critical (emcon_ordering)
      end associate
   end subroutine order

   subroutine umfpack_factorise(self, value, error)
      class(umfpack_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status

      self%is_singular = .true.
      self%rcond = 0.0_dp
      call umfpack_di_free_numeric(self%numeric)
      call solver_check_values(self%scaled, value, error)
      if (allocated(error)) return
      call self%scaling%equilibrate(value, self%scaled)
      if (.not. self%scaling%is_regular) return
      call blas_enter(fp_status)
      associate (a => self%scaled)
         status = umfpack_di_numeric(a%row_start, a%column, a%value, self%symbolic, &
            self%numeric, self%control, self%info)
      end associate
      call blas_leave(fp_status)
      if (status == umfpack_singular) return
      if (status /= umfpack_ok) call solver_raise(error, "UMFPACK", "factorisation", int(status), &
         status == umfpack_out_of_memory, self%scaled)
      if (allocated(error)) return
      self%is_singular = .false.
      self%rcond = self%info(info_rcond)
      self%n_factor = int(self%info(info_lnz) + self%info(info_unz), int64)
   end subroutine umfpack_factorise

   subroutine umfpack_solve(self, rhs, x, error)
      class(umfpack_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      type(ieee_status_type) :: fp_status
      integer :: i

      if (self%is_singular .or. .not. c_associated(self%numeric)) then
         call raise(error, err_internal, "umfpack_solve: there is no factorisation")
         return
      end if
      do i = 1, self%scaled%n_row
         self%rhs(i) = self%scaling%row(i)*real(rhs(i), dp)
      end do
      self%control(control_irstep) = real(self%n_refine, c_double)
      call blas_enter(fp_status)
      associate (a => self%scaled)
         status = umfpack_di_wsolve(umfpack_aat, a%row_start, a%column, a%value, self%x, &
            self%rhs, self%numeric, self%control, self%info, self%index_work, self%work)
      end associate
      call blas_leave(fp_status)
      if (status /= umfpack_ok) call solver_raise(error, "UMFPACK", "solution", int(status), &
         status == umfpack_out_of_memory, self%scaled)
      do i = 1, self%scaled%n_row
         x(i) = real(self%scaling%column(i)*self%x(i), wp)
      end do
   end subroutine umfpack_solve

   subroutine umfpack_free(self)
      class(umfpack_t), intent(inout) :: self

      call umfpack_di_free_numeric(self%numeric)
      call umfpack_di_free_symbolic(self%symbolic)
      if (allocated(self%rhs)) deallocate(self%rhs, self%x, self%work, self%index_work)
      self%scaled = csr_t()
      self%is_singular = .false.
   end subroutine umfpack_free

end module emcon_umfpack
