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
   public :: solver_row_t, solvers, solver_names, solver_create, is_foreign_solver
   public :: factors_symmetric
   public :: solver_default, solver_umfpack, solver_mumps, solver_given

   !> The default: CHOLMOD for definite matrices, UMFPACK for others; MUMPS where these are not.
   !> Codes above `solver_given` are those that a program gives, in their order.
   integer, parameter :: solver_default = 0, solver_umfpack = 1, solver_mumps = 2, &
      solver_given = 100

   !> A choice: what decks call it, and whether this build has it.
   type :: solver_row_t
      character(len=8) :: word
      integer :: code
      logical :: is_built
      character(len=40) :: text                  !! in the log
   end type solver_row_t

#ifdef EMCON_PERMISSIVE
   logical, parameter :: has_suitesparse = .false.
   character(len=*), parameter :: default_text = "MUMPS"
#else
   logical, parameter :: has_suitesparse = .true.
   character(len=*), parameter :: default_text = "CHOLMOD, UMFPACK"
#endif
   type(solver_row_t), parameter :: solvers(3) = [ &
      solver_row_t("DEFAULT", solver_default, .true., default_text), &
      solver_row_t("UMFPACK", solver_umfpack, has_suitesparse, "UMFPACK"), &
      solver_row_t("MUMPS", solver_mumps, .true., "MUMPS")]

   !> What decks of other programs ask for, without blanks.
   character(len=*), parameter :: foreign_solvers = ",DIRECT,ITERATIVE,ITERATIVECHOLESKY," // &
      "ITERATIVESCALING,MATRIXSTORAGE,PARDISO,PASTIX,SGI,SPOOLES,TAUCS,"

contains

   !> "A, B and C": the solvers that have a name of their own.
   pure subroutine solver_names(list)
      character(len=:), allocatable, intent(out) :: list
      integer :: i, n

      list = ""
      n = size(solvers)
      do i = 1, n
         if (solvers(i)%code == solver_default) cycle
         if (list /= "" .and. i < n) list = list // ", "
         if (list /= "" .and. i == n) list = list // " and "
         list = list // trim(solvers(i)%word)
      end do
   end subroutine solver_names

   !> Is it the name of a solver of another program?
   pure logical function is_foreign_solver(word)
      character(len=*), intent(in) :: word       !! upper case, without blanks

      is_foreign_solver = word == ""
      if (word /= "") is_foreign_solver = index(foreign_solvers, "," // word // ",") > 0
   end function is_foreign_solver

   !> A solver for matrices of one kind, in place of another that was there: one of the same choice
   !> and kind stays, with the pattern that it has analysed.
   subroutine solver_create(choice, symmetry, solver, given)
      integer, intent(in) :: choice              !! one of `solver_` that is built, or above
      integer, intent(in) :: symmetry            !! one of `matrix_`
      class(sparse_solver_t), allocatable, intent(inout) :: solver
      !> What solvers are copies of, for a choice above `solver_given`
      class(sparse_solver_t), intent(in), optional :: given

      if (allocated(solver)) then
         if (solver%choice == choice .and. solver%symmetry == symmetry) return
         call solver%free()
         deallocate(solver)
      end if
      if (present(given)) then
         allocate(solver, source=given)
      else
         call create_own(choice, symmetry, solver)
      end if
      solver%choice = choice
      solver%symmetry = symmetry
   end subroutine solver_create

   !> Are symmetric matrices that are not definite factorised as such, negative pivots counted?
   pure logical function factors_symmetric(choice)
      integer, intent(in) :: choice              !! one of `solver_` that is built, or above

      factors_symmetric = choice == solver_mumps .or. (choice == solver_default &
         .and. .not. has_suitesparse)
   end function factors_symmetric

   subroutine create_own(choice, symmetry, solver)
      integer, intent(in) :: choice, symmetry
      class(sparse_solver_t), allocatable, intent(inout) :: solver

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
   end subroutine create_own

end module emcon_solver_registry
