!> The kinds of direct solvers. A new one is one file, one row of `rows` and one case of
!> `allocate_solver`.
!>
!> EMCON_PERMISSIVE: built without SuiteSparse, whose solvers are under the GPL.
submodule (emcon_solver_registry) emcon_solver_kinds
#ifndef EMCON_PERMISSIVE
   use emcon_cholmod, only : cholmod_t
   use emcon_umfpack, only : umfpack_t
#endif
   use emcon_mumps, only : mumps_t
   use emcon_sparse_solver, only : matrix_definite
   implicit none

   !> Besides those of the registry.
   integer, parameter :: solver_umfpack = 1

#ifdef EMCON_PERMISSIVE
   logical, parameter :: has_suitesparse = .false.
   character(len=*), parameter :: default_text = "MUMPS"
#else
   logical, parameter :: has_suitesparse = .true.
   character(len=*), parameter :: default_text = "CHOLMOD, UMFPACK"
#endif
   type(solver_row_t), parameter :: rows(*) = [ &
      solver_row_t("DEFAULT", solver_default, .true., default_text), &
      solver_row_t("UMFPACK", solver_umfpack, has_suitesparse, "UMFPACK"), &
      solver_row_t("MUMPS", solver_mumps, .true., "MUMPS")]

contains

   module procedure n_solver_row
      n_solver_row = size(rows)
   end procedure n_solver_row

   module procedure solver_row
      row = rows(i)
   end procedure solver_row

   module procedure factors_symmetric
      factors_symmetric = choice == solver_mumps .or. (choice == solver_default &
         .and. .not. has_suitesparse)
   end procedure factors_symmetric

   module procedure allocate_solver
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
   end procedure allocate_solver

end submodule emcon_solver_kinds
