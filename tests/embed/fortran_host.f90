!> Two models side by side, each with steps of its own size, and a third one alone; a state to come
!> back to; and the residual of a step that was made, by the query.
!>
!> usage: fortran_host DECK
program fortran_host
   use emcon_api, only : error_t, increment_t, query_evaluate, query_free, query_guess, &
      query_residual, query_t, snapshot_t, stepper_close, stepper_open, stepper_restore, &
      stepper_snapshot, stepper_step, stepper_t, string_t, version, wp
   implicit none
   real(wp), parameter :: h(2) = [0.05_wp, 0.025_wp]
   integer, parameter :: n_step = 20
   type(stepper_t) :: model(3)
   type(string_t) :: parameter(2)
   type(error_t), allocatable :: error
   character(len=1000) :: deck
   integer :: i, k

   call get_command_argument(1, deck)
   parameter(1)%text = "h=0.01"
   parameter(2)%text = "t_end=2"
   do i = 1, 3
      call stepper_open(model(i), trim(deck), parameter, .false., error)
      call require(error)
   end do
   print "(2a)", "version ", version
   do k = 1, n_step
      call go_on(model(1), h(1), 1)
      call go_on(model(2), h(2), 2)
      do i = 1, 2
         associate (ledger => model(i)%march%ledger)
            print "(a, i0, 4es25.16)", "model ", i, model(i)%march%state%clock%time, ledger%total, &
               ledger%momentum
         end associate
      end do
   end do
   call go_on(model(3), h(2), 2*n_step)
   print "(a, l2)", "alone", all(abs(model(3)%march%state%u - model(2)%march%state%u) <= 0.0_wp)
   call go_and_come_back(model(2))
   call look_at_step(model(1), h(1))
   do i = 1, 3
      call stepper_close(model(i))
   end do

contains

   subroutine require(error)
      type(error_t), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      print "(a, i0, 2a)", "error ", error%code, ": ", error%message
      stop 1
   end subroutine require

   !> `n` steps of the size `h`.
   subroutine go_on(stepper, h, n)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: h
      integer, intent(in) :: n
      type(increment_t) :: increment
      type(error_t), allocatable :: error
      integer :: j

      do j = 1, n
         call stepper_step(stepper, h, increment, error)
         call require(error)
      end do
   end subroutine go_on

   !> What follows a state has the same bits the second time.
   subroutine go_and_come_back(stepper)
      type(stepper_t), intent(inout) :: stepper
      type(snapshot_t) :: start, first
      type(error_t), allocatable :: error

      call stepper_snapshot(stepper, start)
      call go_on(stepper, 0.03_wp, 3)
      call stepper_snapshot(stepper, first)
      call stepper_restore(stepper, start, error)
      call require(error)
      call go_on(stepper, 0.03_wp, 3)
      print "(a, 3(1x, l1))", "same", all(abs(stepper%march%state%u - first%state%u) <= 0.0_wp), &
         all(abs(stepper%march%state%contacts%lam - first%state%contacts%lam) <= 0.0_wp), &
         any(abs(first%state%u - start%state%u) > 0.0_wp)
   end subroutine go_and_come_back

   !> Make a step, and evaluate it from its start with the contact that it had: the residual where
   !> the iteration begins, and where it has ended.
   subroutine look_at_step(stepper, h)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: h
      type(snapshot_t) :: before, after
      type(query_t) :: query
      type(error_t), allocatable :: error
      real(wp), allocatable :: u1(:, :), nodal(:, :), residual(:)
      real(wp) :: norm(2)
      integer :: i

      call stepper_snapshot(stepper, before)
      call go_on(stepper, h, 1)
      call stepper_snapshot(stepper, after)
      call stepper_restore(stepper, before, error)
      call require(error)
      allocate(u1, mold=after%state%u)
      call query_guess(query, stepper, h, u1, error)
      call require(error)
      do i = 1, 2
         call query_evaluate(query, stepper, h, u1, .false., error, after%state%contacts%lam, &
            after%state%contacts%is_active)
         call require(error)
         call query_residual(query, .true., nodal, residual, error)
         call require(error)
         norm(i) = norm2(residual)
         u1 = after%state%u
      end do
      print "(a, 2es25.16, i4)", "residual", norm, count(after%state%contacts%is_active)
      call query_free(query)
   end subroutine look_at_step

end program fortran_host
