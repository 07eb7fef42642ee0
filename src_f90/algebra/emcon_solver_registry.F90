!> The direct solvers, by what decks call them: the only module that knows their kinds.
!>
!> EMCON_PERMISSIVE: built without SuiteSparse, whose solvers are under the GPL.
module emcon_solver_registry
#ifndef EMCON_PERMISSIVE
   use emcon_cholmod, only : cholmod_t
   use emcon_umfpack, only : umfpack_t
#endif
   use emcon_mumps, only : mumps_t
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   implicit none
   private
   public :: solver_row_t, solvers, solver_create
   public :: solver_default, solver_umfpack, solver_mumps

   !> The default: CHOLMOD for definite matrices, UMFPACK for others; MUMPS where these are not.
   integer, parameter :: solver_default = 0, solver_umfpack = 1, solver_mumps = 2

   !> A choice: what decks call it, and whether this build has it.
   type :: solver_row_t
      character(len=8) :: word
      integer :: code
      logical :: is_built
   end type solver_row_t

#ifdef EMCON_PERMISSIVE
   logical, parameter :: has_suitesparse = .false.
#else
   logical, parameter :: has_suitesparse = .true.
#endif
   type(solver_row_t), parameter :: solvers(3) = [ &
      solver_row_t("DEFAULT", solver_default, .true.), &
      solver_row_t("UMFPACK", solver_umfpack, has_suitesparse), &
      solver_row_t("MUMPS", solver_mumps, .true.)]

contains

   !> A solver for matrices of one kind, in place of another that was there: one of the same choice
   !> and kind stays, with the pattern that it has analysed.
   subroutine solver_create(choice, symmetry, solver)
      integer, intent(in) :: choice              !! one of `solver_` that is built
      integer, intent(in) :: symmetry            !! one of `matrix_`
      class(sparse_solver_t), allocatable, intent(inout) :: solver

      if (allocated(solver)) then
         if (solver%choice == choice .and. solver%symmetry == symmetry) return
         call solver%free()
         deallocate(solver)
      end if
#ifdef EMCON_PERMISSIVE
      allocate(mumps_t :: solver)
#else
      if (choice == solver_mumps) then
         allocate(mumps_t :: solver)
      else if (choice == solver_default .and. symmetry == matrix_definite) then
         allocate(cholmod_t :: solver)
      else
         allocate(umfpack_t :: solver)
      end if
#endif
      solver%choice = choice
      solver%symmetry = symmetry
   end subroutine solver_create

end module emcon_solver_registry
