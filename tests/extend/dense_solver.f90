!> A direct solver from outside: LAPACK's LU of the matrix in full.
module dense_solver
   use emcon_api, only : csr_t, dp, error_t, sparse_solver_t, wp
   use emcon_sparse_solver, only : solver_check_square, solver_check_values
   implicit none
   private
   public :: dense_solver_t

   type, extends(sparse_solver_t) :: dense_solver_t
      type(csr_t) :: pattern
      real(dp), allocatable :: factor(:, :)      !! (n, n)
      integer, allocatable :: pivot(:)           !! (n)
   contains
      procedure :: analyse
      procedure :: factorise
      procedure :: solve
      procedure :: free
   end type dense_solver_t

   interface
      subroutine dgetrf(m, n, a, lda, pivot, info)
         import :: dp
         implicit none
         integer, intent(in) :: m, n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: pivot(*), info
      end subroutine dgetrf

      subroutine dgetrs(trans, n, n_rhs, a, lda, pivot, b, ldb, info)
         import :: dp
         implicit none
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, n_rhs, lda, ldb, pivot(*)
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs
   end interface

contains

   subroutine analyse(self, matrix, error)
      class(dense_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      call solver_check_square(matrix, error)
      if (allocated(error)) return
      call self%free()
      self%pattern = matrix
      allocate(self%factor(matrix%n_row, matrix%n_row), self%pivot(matrix%n_row))
      self%n_analysis = self%n_analysis + 1
   end subroutine analyse

   subroutine factorise(self, value, error)
      class(dense_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k, n, info

      self%is_singular = .true.
      call solver_check_values(self%pattern, value, error)
      if (allocated(error)) return
      self%factor = 0.0_dp
      n = self%pattern%n_row
      do i = 1, n
         do k = self%pattern%row_start(i) + 1, self%pattern%row_start(i + 1)
            self%factor(i, self%pattern%column(k) + 1) = value(k)
         end do
      end do
      call dgetrf(n, n, self%factor, n, self%pivot, info)
      self%is_singular = info /= 0
   end subroutine factorise

   subroutine solve(self, rhs, x, error)
      class(dense_solver_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: b(size(rhs), 1)
      integer :: info

      b(:, 1) = real(rhs, dp)
      call dgetrs("N", size(b), 1, self%factor, size(b), self%pivot, b, size(b), info)
      x = real(b(:, 1), wp)
   end subroutine solve

   subroutine free(self)
      class(dense_solver_t), intent(inout) :: self

      if (allocated(self%factor)) deallocate(self%factor, self%pivot)
      self%pattern = csr_t()
      self%is_singular = .false.
   end subroutine free

end module dense_solver
