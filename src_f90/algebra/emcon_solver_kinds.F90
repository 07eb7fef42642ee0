!> The kinds of solvers. A new one is one file, one row of `rows` and one case of
!> `allocate_solver`.
!>
!> EMCON_PERMISSIVE: built without UMFPACK, which is under the GPL.
submodule (emcon_solver_registry) emcon_solver_kinds
#ifndef EMCON_PERMISSIVE
   use emcon_umfpack, only : umfpack_t
#endif
   use emcon_chosen_solver, only : chosen_solver_t
   use emcon_mumps, only : mumps_t
   use emcon_sparse_solver, only : matrix_definite, matrix_general, sparse_solver_t
   use emcon_supernodal, only : supernodal_t
   implicit none

   !> Besides those of the registry.
   integer, parameter :: solver_umfpack = 1, solver_direct = 3, solver_iterative = 4

#ifdef EMCON_PERMISSIVE
   logical, parameter :: has_umfpack = .false.
   character(len=*), parameter :: general_text = "MUMPS"
#else
   logical, parameter :: has_umfpack = .true.
   character(len=*), parameter :: general_text = "UMFPACK"
#endif
   type(solver_row_t), parameter :: rows(*) = [ &
      solver_row_t("DEFAULT", solver_default, .true., &
         "Cholesky, " // general_text // " or iterative"), &
      solver_row_t("UMFPACK", solver_umfpack, has_umfpack, "UMFPACK"), &
      solver_row_t("MUMPS", solver_mumps, .true., "MUMPS"), &
      solver_row_t("DIRECT", solver_direct, .true., "Cholesky, " // general_text), &
      solver_row_t("ITERATIVE", solver_iterative, .true., "conjugate gradients where they can be")]

contains

   module procedure n_solver_row
      n_solver_row = size(rows)
   end procedure n_solver_row

   module procedure solver_row
      row = rows(i)
   end procedure solver_row

   module procedure factors_symmetric
      factors_symmetric = choice == solver_mumps .or. (choice /= solver_umfpack &
         .and. choice <= solver_user .and. .not. has_umfpack)
   end procedure factors_symmetric

   module procedure allocate_solver
      if (symmetry == matrix_definite .and. (choice == solver_default &
         .or. choice == solver_iterative)) then
         call allocate_chosen(choice, solver)
      else
         call allocate_direct(choice, symmetry, solver)
      end if
   end procedure allocate_solver

   !> One that chooses between iterations and factors.
   subroutine allocate_chosen(choice, solver)
      integer, intent(in) :: choice
      class(sparse_solver_t), allocatable, intent(out) :: solver
      type(chosen_solver_t), allocatable :: chosen

      allocate(chosen)
      chosen%prefers_iterations = choice == solver_iterative
      call allocate_direct(choice, matrix_definite, chosen%direct)
      call allocate_direct(choice, matrix_general, chosen%general)
      chosen%direct%symmetry = matrix_definite
      chosen%general%symmetry = matrix_general
      call move_alloc(chosen, solver)
   end subroutine allocate_chosen

   !> One that factorises.
   subroutine allocate_direct(choice, symmetry, solver)
      integer, intent(in) :: choice, symmetry
      class(sparse_solver_t), allocatable, intent(out) :: solver

      if (symmetry == matrix_definite .and. choice /= solver_mumps &
         .and. choice /= solver_umfpack) then
         allocate(supernodal_t :: solver)
         return
      end if
#ifndef EMCON_PERMISSIVE
      if (choice /= solver_mumps) then
         allocate(umfpack_t :: solver)
         return
      end if
#endif
      allocate(mumps_t :: solver)
   end subroutine allocate_direct

end submodule emcon_solver_kinds
