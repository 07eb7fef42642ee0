!> The tie of tie_in_space.c: its links by rows.
program tie_in_space
   use emcon_api, only : csr_t, error_t, multiplier_dual, query_follow_links, query_links, &
      stepper_add_faces, stepper_add_tie, stepper_build, stepper_close, stepper_new, stepper_t, wp
   implicit none
   real(wp), parameter :: x(3, 9) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, &
      2.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 4.0_wp, 1.0_wp, 0.0_wp, 0.5_wp, 0.5_wp, &
      0.0_wp, 1.0_wp, 0.5_wp, 0.0_wp, 0.5_wp, 1.0_wp, 0.0_wp, 2.5_wp, 1.2_wp, 0.0_wp], [3, 9])
   type(stepper_t) :: stepper
   type(error_t), allocatable :: error
   type(csr_t) :: links
   real(wp) :: moved(3, 9)
   integer :: slave, master, i, k

   call stepper_new(stepper, x, error)
   if (.not. allocated(error)) call stepper_add_faces(stepper, "below", [9, 5], [4, 7], &
      [1, 2, 3, 4, 2, 5, 3], master, error)
   if (.not. allocated(error)) call stepper_add_faces(stepper, "above", [5, 5], [3, 6], &
      [6, 8, 7, 7, 8, 9], slave, error)
   if (.not. allocated(error)) call stepper_add_tie(stepper, slave, master, multiplier_dual, &
      -1.0_wp, error)
   if (.not. allocated(error)) call stepper_build(stepper, error)
   if (.not. allocated(error)) call query_links(stepper, links, error)
   moved = 0.0_wp
   moved(:, :5) = cshift(x(:, :5), 1, 1) - 2.0_wp*x(:, :5)
   if (.not. allocated(error)) call query_follow_links(stepper, moved, error)
   if (allocated(error)) then
      print "(2a)", "error: ", error%message
      stop 1
   end if
   do i = 1, links%n_row
      do k = links%row_start(i) + 1, links%row_start(i + 1)
         print *, i - 1, links%column(k), links%value(k)
      end do
   end do
   print "(es25.17)", moved(:, 6:)
   call stepper_close(stepper)
end program tie_in_space
