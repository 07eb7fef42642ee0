!> A program that gives a scheme to EMCON and runs a deck with it. Arguments: the deck, the name by
!> which the scheme is given (none if empty), and theta of the theta method, "end" behind it if
!> contact pushes at the end, or which of EMCON's own schemes it is a copy of; behind that "again"
!> if the run is to go on in another stepper after each increment. For the start and each increment
!> it prints time, displacement and velocity of the last node in the first direction, energy,
!> angular momentum, the work of contact and momentum.
program integrated
   use emcon_api, only : error_t, increment_t, restart_t, scheme_t, stepper_advance, &
      stepper_build, stepper_close, stepper_give_scheme, stepper_is_done, stepper_load, &
      stepper_read, stepper_save, stepper_t, string_t
   use own_schemes, only : own_scheme
   use theta_scheme, only : theta_scheme_t
   implicit none
   type(stepper_t), target :: both(0:1)
   type(stepper_t), pointer :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   class(scheme_t), allocatable :: scheme
   character(len=4096) :: deck, name, kind, more

   call get_command_argument(1, deck)
   call get_command_argument(2, name)
   call get_command_argument(3, kind)
   call get_command_argument(4, more)
   call make_scheme()
   stepper => both(0)
   call read_deck()
   if (.not. allocated(error)) call stepper_build(stepper, error)
   call check()
   call show()
   do while (.not. stepper_is_done(stepper))
      if (more == "again") call go_on()
      call stepper_advance(stepper, increment, error)
      call check()
      call show()
   end do
   call stepper_close(stepper)

contains

   subroutine read_deck()
      call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
      if (.not. allocated(error) .and. name /= "") call stepper_give_scheme(stepper, trim(name), &
         scheme, error)
   end subroutine read_deck

   !> Take the state to the other stepper.
   subroutine go_on()
      type(restart_t) :: restart

      call stepper_save(stepper, restart)
      call stepper_close(stepper)
      if (associated(stepper, both(0))) then
         call begin_anew(both(1))
         stepper => both(1)
      else
         call begin_anew(both(0))
         stepper => both(0)
      end if
      call read_deck()
      if (.not. allocated(error)) call stepper_load(stepper, restart, error)
      call check()
   end subroutine go_on

   subroutine begin_anew(new)
      type(stepper_t), intent(out) :: new

      new%is_read = .false.
   end subroutine begin_anew

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
         write (*, "(8es25.16e3)") state%clock%time, state%u(1, n), state%v(1, n), ledger%total, &
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
