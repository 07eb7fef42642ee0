!> A program that adds a law and a potential to EMCON and runs a deck with them: what moves keeps
!> its energy. Arguments: the deck, and any word if the potential is to be there.
program extended
   use emcon_api, only : error_t, increment_t, stepper_advance, stepper_build, stepper_close, &
      stepper_give_law, stepper_give_potential, stepper_is_done, stepper_read, stepper_t, &
      string_t, wp
   use fading_well, only : fading_well_t
   use gent_law, only : gent_law_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(fading_well_t) :: well
   character(len=4096) :: deck
   integer :: i
   real(wp) :: total, drift, strain

   call get_command_argument(1, deck)
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   if (.not. allocated(error)) call stepper_give_law(stepper, "rubber", gent_law_t(), error)
   if (.not. allocated(error) .and. command_argument_count() > 1) then
      well = fading_well_t(depth=0.5_wp, width=2.0_wp)
      well%n_variable = 2
      call stepper_give_potential(stepper, "well", [(i, i = 1, 9)], well, error)
   end if
   if (.not. allocated(error)) call stepper_build(stepper, error)
   call check()
   total = stepper%march%ledger%total
   drift = 0.0_wp
   strain = 0.0_wp
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      drift = max(drift, abs(stepper%march%ledger%total - total))
      strain = max(strain, stepper%march%ledger%strain)
   end do
   write(*, "(3es24.16)") total, drift, strain
   call stepper_close(stepper)

contains

   subroutine check()
      if (.not. allocated(error)) return
      write(*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program extended
