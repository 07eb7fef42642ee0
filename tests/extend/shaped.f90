!> A program that gives the shape of elements of nine nodes to EMCON and runs a deck with them.
!> Arguments: the deck, the type by which the shape is given, the base of the field file. It prints
!> the total energy, its largest change, the largest number of active contacts; position and
!> displacement of each node; the momentum; the stress of each element; what the log says of
!> elements; and how far a run that goes on from a restart after the first increment ends elsewhere.
program shaped
   use emcon_api, only : element_quantity, error_t, increment_t, stepper_advance, stepper_build, &
      restart_t, stepper_close, stepper_give_element, stepper_is_done, stepper_load, &
      stepper_read, stepper_save, stepper_t, string_t, wp
   use emcon_recorder, only : recorder_close, recorder_open, recorder_t, recorder_write
   use emcon_run_log, only : model_lines
   use nine_node_shape, only : nine_node_shape_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(recorder_t) :: recorder
   type(restart_t) :: restart
   type(error_t), allocatable :: error
   character(len=4096) :: deck, name, base
   real(wp) :: total, drift
   integer :: n_active
   logical :: is_saved

   call get_command_argument(1, deck)
   call get_command_argument(2, name)
   call get_command_argument(3, base)
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   call check()
   if (name /= "") call stepper_give_element(stepper, trim(name), nine_node_shape_t(), error)
   if (.not. allocated(error)) call stepper_build(stepper, error)
   call check()
   call recorder_open(recorder, stepper, trim(base), error)
   total = stepper%march%ledger%total
   drift = 0.0_wp
   n_active = 0
   is_saved = .false.
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      drift = max(drift, abs(stepper%march%ledger%total - total))
      n_active = max(n_active, increment%n_active)
      call recorder_write(recorder, stepper, increment, 0.0_wp, error)
      call check()
      if (.not. is_saved) call stepper_save(stepper, restart)
      is_saved = .true.
   end do
   call recorder_close(recorder, error)
   call check()
   write (*, "(2es24.16, i4)") total, drift, n_active
   call show()
   call go_on_from_restart()
   call stepper_close(stepper)

contains

   subroutine go_on_from_restart()
      type(stepper_t) :: again

      call stepper_read(again, trim(deck), [string_t ::], .false., error)
      call check()
      call stepper_give_element(again, trim(name), nine_node_shape_t(), error)
      call check()
      call stepper_load(again, restart, error)
      call check()
      do while (.not. stepper_is_done(again))
         call stepper_advance(again, increment, error)
         call check()
      end do
      write (*, "(a, es24.16)") "restart", maxval(abs(again%march%state%u &
         - stepper%march%state%u))
      call stepper_close(again)
   end subroutine go_on_from_restart

   subroutine show()
      type(string_t), allocatable :: line(:)
      real(wp), allocatable :: stress(:, :)
      integer :: i

      associate (x => stepper%scene%x, u => stepper%march%state%u)
         do i = 1, size(x, 2)
            write (*, "(a, 4es24.16)") "node", x(:, i), u(:, i)
         end do
      end associate
      write (*, "(a, 2es24.16)") "momentum", stepper%march%ledger%momentum
      allocate(stress, source=element_quantity(stepper, "S"))
      do i = 1, size(stress, 2)
         write (*, "(a, 6es24.16)") "stress", stress(:, i)
      end do
      allocate(line, source=model_lines(stepper))
      do i = 1, size(line)
         if (index(line(i)%text, " elements ") > 0) write (*, "(a)") line(i)%text
      end do
   end subroutine show

   subroutine check()
      if (.not. allocated(error)) return
      write (*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program shaped
