!> A program that gives a scheme to EMCON and runs a deck with it. Arguments: the deck, the name by
!> which the scheme is given (none if empty), and theta of the theta method, "end" behind it if
!> contact pushes at the end, or which of EMCON's own schemes it is a copy of. For the start and
!> each increment it prints time, displacement and velocity of the last node in the first direction,
!> energy, angular momentum, the work of contact and momentum.
program integrated
   use emcon_api, only : error_t, increment_t, scheme_t, stepper_advance, stepper_build, &
      stepper_close, stepper_give_scheme, stepper_is_done, stepper_read, stepper_t, string_t
   use own_schemes, only : own_scheme
   use theta_scheme, only : theta_scheme_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   class(scheme_t), allocatable :: scheme
   character(len=4096) :: deck, name, kind, more

   call get_command_argument(1, deck)
   call get_command_argument(2, name)
   call get_command_argument(3, kind)
   call get_command_argument(4, more)
   call make_scheme()
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

   subroutine make_scheme()
      type(theta_scheme_t) :: theta
      integer :: status

      read (kind, *, iostat=status) theta%theta
      if (status == 0) then
         theta%pushes_at_end = more == "end"
         allocate(scheme, source=theta)
      else
         allocate(scheme, source=own_scheme(trim(kind)))
      end if
   end subroutine make_scheme

   subroutine show()
      integer :: n

      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         n = size(state%u, 2)
         write (*, "(8es25.16e3)") state%time, state%u(1, n), state%v(1, n), ledger%total, &
            ledger%angular, ledger%contact_work, ledger%momentum
      end associate
   end subroutine show

   subroutine check()
      if (.not. allocated(error)) return
      write (*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program integrated
