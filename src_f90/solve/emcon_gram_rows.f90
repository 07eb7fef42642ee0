!> Rows of constraints in the measure of a diagonal D, W = D^-1/2 G^T, and what of a vector is along
!> none of them.
!>
!> W^T W couples rows that share unknowns. Those of contacts are neighbours on a surface: its factor
!> is sparse, and takes no more room than the rows do.
module emcon_gram_rows
   use emcon_csr, only : csr_pick_rows, csr_t, csr_transpose
   use emcon_csr_product, only : csr_product
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_sparse_solver, only : sparse_solver_t
   implicit none
   private
   public :: gram_rows_t, gram_rows_take, gram_rows_meet, gram_rows_project, gram_rows_free

   type :: gram_rows_t
      integer :: n = 0
      !> Of definite matrices, before rows are taken: factorises W^T W
      class(sparse_solver_t), allocatable :: solver
      type(csr_t), private :: w                  !! (n x n_unknown) W^T
      real(wp), allocatable, private :: rate(:), mu(:)   !! (n) left of rows, and along them
   end type gram_rows_t

contains

   !> Take the first `n` rows of `rows`.
   subroutine gram_rows_take(self, rows, n, root, is_fit, error)
      type(gram_rows_t), intent(inout) :: self   !! with a solver
      type(csr_t), intent(in) :: rows            !! (>= n x n_unknown) G
      integer, intent(in) :: n                   !! >= 0
      real(dp), intent(in) :: root(:)            !! (n_unknown) of D, > 0
      logical, intent(out) :: is_fit             !! none follows from others
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: transposed, gram
      integer, allocatable :: from(:)
      integer :: k

      is_fit = .true.
      self%n = n
      if (n == 0) return
      call csr_pick_rows(rows, [(k, k = 1, n)], self%w)
      self%w%value = self%w%value/root(self%w%column + 1)
      call csr_transpose(self%w, transposed, from)
      call csr_product(self%w, transposed, gram)
      if (allocated(self%mu)) deallocate(self%mu, self%rate)
      allocate(self%mu(n), self%rate(n))
      call self%solver%analyse(gram, error)
      if (.not. allocated(error)) call self%solver%factorise(gram%value, error)
      if (.not. allocated(error)) is_fit = .not. self%solver%is_singular
   end subroutine gram_rows_take

   !> The least y with W^T y = `rate`.
   subroutine gram_rows_meet(self, rate, y, error)
      type(gram_rows_t), intent(inout) :: self   !! with rows
      real(dp), intent(in), contiguous :: rate(:)    !! (n)
      real(dp), intent(out), contiguous :: y(:)  !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error

      y = 0.0_dp
      if (self%n == 0) return
      self%rate = -real(rate, wp)
      call subtract_along(self, y, error)
   end subroutine gram_rows_meet

   !> y = y - W (W^T W)^-1 W^T y: what of it is along no row.
   subroutine gram_rows_project(self, y, error)
      type(gram_rows_t), intent(inout) :: self   !! with rows
      real(dp), intent(inout), contiguous :: y(:)    !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k
      real(dp) :: total

      if (self%n == 0) return
      do i = 1, self%n
         total = 0.0_dp
         do k = self%w%row_start(i) + 1, self%w%row_start(i + 1)
            total = total + self%w%value(k)*y(self%w%column(k) + 1)
         end do
         self%rate(i) = real(total, wp)
      end do
      call subtract_along(self, y, error)
   end subroutine gram_rows_project

   !> y = y - W (W^T W)^-1 `rate`
   subroutine subtract_along(self, y, error)
      type(gram_rows_t), intent(inout) :: self
      real(dp), intent(inout), contiguous :: y(:)    !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k
      real(dp) :: mu

      call self%solver%solve(self%rate, self%mu, error)
      if (allocated(error)) return
      do i = 1, self%n
         mu = real(self%mu(i), dp)
         do k = self%w%row_start(i) + 1, self%w%row_start(i + 1)
            associate (entry => y(self%w%column(k) + 1))
               entry = entry - self%w%value(k)*mu
            end associate
         end do
      end do
   end subroutine subtract_along

   !> Free what the solver holds.
   subroutine gram_rows_free(self)
      type(gram_rows_t), intent(inout) :: self

      if (allocated(self%solver)) call self%solver%free()
   end subroutine gram_rows_free

end module emcon_gram_rows
