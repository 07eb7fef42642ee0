!> A program that adds a law, a potential and a solver to EMCON and runs a deck with them: what
!> moves keeps its energy. Arguments: the deck, and which of `law`, `well`, `solver` are to be
!> there. It prints the total energy, its largest change, the largest strain energy, the largest
!> number of active contacts, the sum of all displacements, and what the log says of each step.
program extended
   use dense_solver, only : dense_solver_t
   use emcon_api, only : error_t, increment_t, stepper_advance, stepper_build, stepper_close, &
      stepper_give_law, stepper_give_potential, stepper_give_solver, stepper_is_done, &
      stepper_read, stepper_t, string_t, wp
   use emcon_run_log, only : model_lines
   use fading_well, only : fading_well_t
   use gent_law, only : gent_law_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(string_t), allocatable :: line(:)
   character(len=4096) :: deck
   integer :: i, n_active
   real(wp) :: total, drift, strain

   call get_command_argument(1, deck)
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   call check()
   do i = 2, command_argument_count()
      call give(i)
   end do
   call stepper_build(stepper, error)
   call check()
   total = stepper%march%ledger%total
   drift = 0.0_wp
   strain = 0.0_wp
   n_active = 0
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      drift = max(drift, abs(stepper%march%ledger%total - total))
      strain = max(strain, stepper%march%ledger%strain)
      n_active = max(n_active, increment%n_active)
   end do
   write(*, "(3es24.16, i4, es24.16)") total, drift, strain, n_active, &
      sum(abs(stepper%march%state%u))
   allocate(line, source=model_lines(stepper))
   do i = 1, size(line)
      if (index(line(i)%text, "step ") == 1) write(*, "(a)") line(i)%text
   end do
   call stepper_close(stepper)

contains

   subroutine give(argument)
      integer, intent(in) :: argument
      type(fading_well_t) :: well
      character(len=8) :: what
      integer :: node

      call get_command_argument(argument, what)
      select case (what)
      case ("law")
         call stepper_give_law(stepper, "rubber", gent_law_t(), error)
      case ("well")
         well = fading_well_t(depth=0.5_wp, width=2.0_wp)
         well%n_variable = 2
         call stepper_give_potential(stepper, "well", [(node, node = 1, 9)], well, error)
      case ("mumps")
         call stepper_give_solver(stepper, "mumps", dense_solver_t(), error)
      case default
         call stepper_give_solver(stepper, "dense", dense_solver_t(), error)
      end select
      call check()
   end subroutine give

   subroutine check()
      if (.not. allocated(error)) return
      write(*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program extended
