!> A deck with a law of contact from outside: `cushion DECK K`. It prints the largest change of the
!> energy without the work of contact by the largest energy, the sum of all contact forces at the
!> end, how far contact is closed there at most, and the most that it has stored; then what is said
!> to a restart without the law.
program cushion
   use cubic_contact, only : cubic_contact_t
   use emcon_api, only : error_t, increment_t, restart_t, stepper_advance, stepper_build, &
      stepper_close, stepper_give_contact_law, stepper_is_done, stepper_load, stepper_read, &
      stepper_save, stepper_t, string_t, wp
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(cubic_contact_t) :: law
   character(len=4096) :: deck, text
   real(wp) :: start, drift, largest, most

   call get_command_argument(1, deck)
   call get_command_argument(2, text)
   read(text, *) law%by_area
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   call check()
   call stepper_give_contact_law(stepper, law, error)
   call check()
   call stepper_build(stepper, error)
   call check()
   start = stepper%march%ledger%total
   largest = abs(start)
   drift = 0.0_wp
   most = 0.0_wp
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      associate (ledger => stepper%march%ledger)
         drift = max(drift, abs(ledger%total - ledger%contact_work - start))
         largest = max(largest, ledger%kinetic + ledger%strain)
         most = max(most, ledger%contact_energy)
      end associate
   end do
   associate (state => stepper%march%state)
      write(*, "(4es24.16)") drift/largest, sum(state%contacts%lam), &
         -minval(state%contacts%closure), most
   end associate
   call go_on_without_law()
   call stepper_close(stepper)

contains

   subroutine go_on_without_law()
      type(stepper_t) :: again
      type(restart_t) :: restart

      call stepper_save(stepper, restart)
      call stepper_read(again, trim(deck), [string_t ::], .false., error)
      call check()
      call stepper_load(again, restart, error)
      if (allocated(error)) write(*, "(a)") error%message
      call stepper_close(again)
   end subroutine go_on_without_law

   subroutine check()
      if (.not. allocated(error)) return
      write(*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program cushion
