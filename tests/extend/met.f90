!> A program that gives the contact of two surfaces in three dimensions to EMCON and runs a deck
!> with it. Arguments: the deck, the names of slave and master surface, and the base of files to
!> record it in; none if it is empty. For the start and each increment it prints time, energy, work
!> of contact, linear and angular momentum, the number of contacts that act, force and moment of the
!> pair on the slave and on the master; then what the run says of itself.
program met
   use emcon_api, only : error_t, increment_t, pair_quantity, stepper_advance, stepper_build, &
      stepper_close, stepper_give_contact, stepper_is_done, stepper_read, stepper_t, string_t
   use emcon_record, only : record_begin, record_end, record_increment, record_t
   use emcon_text, only : notes_t
   use emcon_verdict_lines, only : verdict_balance_lines
   use nodes_on_faces, only : nodes_on_faces_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(record_t) :: record
   character(len=4096) :: deck, slave, master, base

   call get_command_argument(1, deck)
   call get_command_argument(2, slave)
   call get_command_argument(3, master)
   call get_command_argument(4, base)
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   if (.not. allocated(error) .and. slave /= "") call stepper_give_contact(stepper, slave, master, &
      nodes_on_faces_t(), error)
   if (.not. allocated(error)) call stepper_build(stepper, error)
   if (.not. allocated(error) .and. base /= "") call record_begin(record, stepper, trim(base), &
      error)
   call check()
   call show()
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      if (.not. allocated(error) .and. base /= "") call record_increment(record, stepper, &
         increment, error)
      call check()
      call show()
   end do
   if (base /= "") call record_end(record, stepper, error)
   call check()
   call tell()
   call stepper_close(stepper)

contains

   subroutine show()
      associate (state => stepper%march%state, ledger => stepper%march%ledger, &
            force => pair_quantity(stepper, "CF"), master => pair_quantity(stepper, "CF_MASTER"))
         write (*, "(22es25.16e3)") state%clock%time, ledger%total, ledger%contact_work, &
            ledger%momentum, ledger%angular, real(state%pairs%total(1)%n_active), force(:, 1), &
            master(:, 1)
      end associate
   end subroutine show

   subroutine tell()
      type(notes_t) :: lines
      integer :: i

      call verdict_balance_lines(stepper%verdict, stepper%scene, stepper%march, lines)
      do i = 1, lines%n
         write (*, "(a)") "# " // lines%item(i)%text
      end do
   end subroutine tell

   subroutine check()
      if (.not. allocated(error)) return
      write (*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program met
