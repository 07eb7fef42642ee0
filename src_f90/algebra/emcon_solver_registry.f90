!> The registry of solvers, by what decks call them: what others see of it. Which kinds there
!> are is known to `emcon_solver_kinds` alone.
module emcon_solver_registry
   use emcon_sparse_solver, only : sparse_solver_t
   implicit none
   private
   public :: solver_row_t, solver_row, n_solver_row, find_solver_row, solver_names, solver_create
   public :: is_foreign_solver, factors_symmetric, solver_default, solver_mumps, solver_user

   !> The default: factors by dense blocks or iterations for definite matrices, UMFPACK for others,
   !> or MUMPS where that is not built in.
   !> Codes above `solver_user` are those that a program gives, in their order.
   integer, parameter :: solver_default = 0, solver_mumps = 2, solver_user = 100

   !> A choice: what decks call it, and whether this build has it.
   type :: solver_row_t
      character(len=9) :: word
      integer :: code
      logical :: is_built
      character(len=40) :: text                  !! in the log
   end type solver_row_t

   !> What decks of other programs ask for, without blanks.
   character(len=*), parameter :: foreign_solvers = ",ITERATIVECHOLESKY," // &
      "ITERATIVESCALING,MATRIXSTORAGE,PARDISO,PASTIX,SGI,SPOOLES,TAUCS,"

   interface
      pure module integer function n_solver_row()
      end function n_solver_row

      pure module function solver_row(i) result(row)
         integer, intent(in) :: i                !! 1..n_solver_row()
         type(solver_row_t) :: row
      end function solver_row

      !> A solver that knows neither its choice nor its kind of matrix.
      module subroutine allocate_solver(choice, symmetry, solver)
         integer, intent(in) :: choice           !! one of `solver_` that is built
         integer, intent(in) :: symmetry         !! one of `matrix_`
         class(sparse_solver_t), allocatable, intent(out) :: solver
      end subroutine allocate_solver

      !> Are symmetric matrices that are not definite factorised as such, negative pivots counted?
      pure module logical function factors_symmetric(choice)
         integer, intent(in) :: choice           !! one of `solver_` that is built, or above
      end function factors_symmetric
   end interface

contains

   !> Number of the row that decks call `word`; 0: there is none.
   pure integer function find_solver_row(word) result(i)
      character(len=*), intent(in) :: word       !! upper case, without blanks
      type(solver_row_t) :: row

      do i = n_solver_row(), 1, -1
         row = solver_row(i)
         if (row%word == word) return
      end do
   end function find_solver_row

   !> "A, B and C": the solvers that have a name of their own.
   pure subroutine solver_names(list)
      character(len=:), allocatable, intent(out) :: list
      type(solver_row_t) :: row
      integer :: i, n

      list = ""
      n = n_solver_row()
      do i = 1, n
         row = solver_row(i)
         if (row%code == solver_default) cycle
         if (list /= "" .and. i < n) list = list // ", "
         if (list /= "" .and. i == n) list = list // " and "
         list = list // trim(row%word)
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
   subroutine solver_create(choice, symmetry, solver, user)
      integer, intent(in) :: choice              !! one of `solver_` that is built, or above
      integer, intent(in) :: symmetry            !! one of `matrix_`
      class(sparse_solver_t), allocatable, intent(inout) :: solver
      !> What solvers are copies of, for a choice above `solver_user`
      class(sparse_solver_t), intent(in), optional :: user

      if (allocated(solver)) then
         if (solver%choice == choice .and. solver%symmetry == symmetry) return
         call solver%free()
         deallocate(solver)
      end if
      if (present(user)) then
         allocate(solver, source=user)
      else
         call allocate_solver(choice, symmetry, solver)
      end if
      solver%choice = choice
      solver%symmetry = symmetry
   end subroutine solver_create

end module emcon_solver_registry
