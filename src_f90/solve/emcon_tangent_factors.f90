!> Factors of tangents: by a solver of definite matrices where a tangent is symmetric and turns out
!> as definite, else by one of general matrices.
module emcon_tangent_factors
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_solver_registry, only : solver_create
   use emcon_sparse_solver, only : matrix_definite, matrix_general, solver_renew, sparse_solver_t
   implicit none
   private
   public :: tangent_factors_t, tangent_factors_create, tangent_factors_make, &
      tangent_factors_solve, tangent_factors_free

   type :: tangent_factors_t
      class(sparse_solver_t), allocatable :: general
      class(sparse_solver_t), allocatable :: definite
      logical :: is_definite = .false.           !! last made by `definite`
   end type tangent_factors_t

contains

   !> Choose the solvers; those of the same choice stay.
   subroutine tangent_factors_create(self, choice, user)
      type(tangent_factors_t), intent(inout) :: self
      integer, intent(in) :: choice              !! one of `solver_` that is built, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      call solver_create(choice, matrix_general, self%general, user)
      call solver_create(choice, matrix_definite, self%definite, user)
      self%is_definite = .false.
   end subroutine tangent_factors_create

   !> Factorise a matrix; a pattern that is known is not ordered again, nor are known values
   !> factorised again.
   subroutine tangent_factors_make(self, matrix, is_symmetric, is_singular, error)
      type(tangent_factors_t), intent(inout) :: self     !! created
      type(csr_t), intent(in) :: matrix          !! in full
      logical, intent(in) :: is_symmetric        !! up to round-off
      logical, intent(out) :: is_singular        !! there is no factor to solve with
      type(error_t), allocatable, intent(out) :: error

      is_singular = .true.
      self%is_definite = .false.
      if (is_symmetric) then
         call renew(self%definite, matrix, is_singular, error)
         if (allocated(error)) return
         self%is_definite = .not. is_singular
      end if
      if (is_singular) call renew(self%general, matrix, is_singular, error)
   end subroutine tangent_factors_make

   !> By one of the solvers.
   subroutine renew(solver, matrix, is_singular, error)
      class(sparse_solver_t), intent(inout) :: solver
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error

      is_singular = .true.
      call solver%analyse(matrix, error)
      if (.not. allocated(error)) call solver_renew(solver, matrix%value, error)
      if (.not. allocated(error)) is_singular = solver%is_singular
   end subroutine renew

   !> x = A^-1 rhs
   subroutine tangent_factors_solve(self, rhs, x, error, accuracy)
      type(tangent_factors_t), intent(inout) :: self     !! made
      real(wp), intent(in), contiguous :: rhs(:)         !! (n)
      real(wp), intent(out), contiguous :: x(:)          !! (n)
      type(error_t), allocatable, intent(out) :: error
      !> > 0, that is enough where `definite` iterates; else what it was set to
      real(wp), intent(in), optional :: accuracy

      if (self%is_definite) then
         if (present(accuracy)) self%definite%accuracy = real(accuracy, dp)
         call self%definite%solve(rhs, x, error)
      else
         call self%general%solve(rhs, x, error)
      end if
   end subroutine tangent_factors_solve

   !> Free what the solvers hold.
   subroutine tangent_factors_free(self)
      type(tangent_factors_t), intent(inout) :: self

      if (.not. allocated(self%general)) return
      call self%general%free()
      call self%definite%free()
   end subroutine tangent_factors_free

end module emcon_tangent_factors
