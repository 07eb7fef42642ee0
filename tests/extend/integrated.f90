!> A program that gives the theta method to EMCON and runs a deck with it. Arguments: the deck, the
!> name by which it is given, and theta. For the start and each increment it prints time,
!> displacement and velocity of the last node in the first direction, energy, angular momentum.
program integrated
   use emcon_api, only : error_t, increment_t, stepper_advance, stepper_build, stepper_close, &
      stepper_give_scheme, stepper_is_done, stepper_read, stepper_t, string_t
   use theta_scheme, only : theta_scheme_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(theta_scheme_t) :: scheme
   character(len=4096) :: deck, name, theta

   call get_command_argument(1, deck)
   call get_command_argument(2, name)
   call get_command_argument(3, theta)
   read (theta, *) scheme%theta
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   if (.not. allocated(error) .and. name /= "") call stepper_give_scheme(stepper, trim(name), &
      scheme, error)
   if (.not. allocated(error)) call stepper_build(stepper, error)
   call check()
   call show()
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      call show()
   end do
   call stepper_close(stepper)

contains

   subroutine show()
      integer :: n

      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         n = size(state%u, 2)
         write (*, "(5es25.16e3)") state%time, state%u(1, n), state%v(1, n), ledger%total, &
            ledger%angular
      end associate
   end subroutine show

   subroutine check()
      if (.not. allocated(error)) return
      write (*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program integrated
