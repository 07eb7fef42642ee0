!> Contact alone, for a program that has its own solids: surfaces as lists of edges, one step, and
!> what each formulation gives for it; then the same in space, with surfaces as lists of faces.
!>
!> usage: fortran_contact
program fortran_contact
   use emcon_api, only : contact_options_t, contact_report_t, csr_multiply, csr_product, csr_t, &
      dp, error_t, formulation_mortar, formulation_nts, formulation_segment, query_begin_contact, &
      query_contact, query_free, query_null_space, query_select, query_t, stepper_add_faces, &
      stepper_add_pair, stepper_add_surface, stepper_build, stepper_close, stepper_hold, stepper_new, stepper_t, wp
   implicit none
   integer, parameter :: n_node = 6
   !> The floor from right to left and the body from left to right: each has its body to the left.
   integer, parameter :: floor(2, 1) = reshape([2, 1], [2, 1])
   integer, parameter :: body(2, 3) = reshape([3, 4, 4, 5, 5, 6], [2, 3])
   real(wp), parameter :: x(2, n_node) = reshape([0.0_wp, 0.0_wp, 4.0_wp, 0.1_wp, &
      0.5_wp, 0.2_wp, 1.4_wp, 0.15_wp, 2.2_wp, 0.15_wp, 3.1_wp, 0.3_wp], [2, n_node])
   integer, parameter :: formulation(3) = [formulation_nts, formulation_segment, formulation_mortar]
   integer :: k

   do k = 1, size(formulation)
      call look_at(formulation(k))
   end do
   call look_in_space()

contains

   subroutine require(error)
      type(error_t), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      print "(2a)", "error: ", error%message
      stop 1
   end subroutine require

   !> The body turns and comes down; the floor is held.
   subroutine look_at(formulation)
      integer, intent(in) :: formulation
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(contact_report_t) :: values
      type(error_t), allocatable :: error
      real(wp) :: u0(2, n_node), du(2, n_node)
      logical, allocatable :: active(:)
      logical :: held(2, n_node)
      integer :: slave, master, i

      call stepper_new(stepper, x, error)
      if (.not. allocated(error)) call stepper_add_surface(stepper, "BODY", body, slave, error)
      if (.not. allocated(error)) call stepper_add_surface(stepper, "FLOOR", floor, master, error)
      if (.not. allocated(error)) call stepper_add_pair(stepper, slave, master, formulation, &
         contact_options_t(), error)
      held = .false.
      held(:, :2) = .true.
      if (.not. allocated(error)) call stepper_hold(stepper, held, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
      call require(error)
      u0 = 0.0_wp
      du(:, :2) = 0.0_wp
      do i = 3, n_node
         du(:, i) = [0.1_wp - 0.2_wp*x(2, i), 0.2_wp*x(1, i) - 0.7_wp]
      end do
      call query_begin_contact(query, stepper, u0, du, &
         spread(.true., 1, stepper%march%system%n_constraint), active, error)
      if (.not. allocated(error)) call query_select(query, stepper, u0, du, active, error)
      if (.not. allocated(error)) call query_contact(query, stepper, u0, du, values, error)
      call require(error)
      call report(query, values, du)
      call query_free(query)
      call stepper_close(stepper)
   end subroutine look_at

   !> A triangle comes down on a quadrilateral that is held, and turns.
   subroutine look_in_space()
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(contact_report_t) :: values
      type(error_t), allocatable :: error
      real(wp), parameter :: place(3, 7) = reshape([-1.0_wp, -1.0_wp, 0.0_wp, 2.0_wp, -1.0_wp, &
         0.1_wp, 2.0_wp, 2.0_wp, 0.0_wp, -1.0_wp, 2.0_wp, 0.1_wp, 0.0_wp, 0.0_wp, 0.3_wp, &
         1.0_wp, 0.1_wp, 0.3_wp, 0.2_wp, 0.9_wp, 0.3_wp], [3, 7])
      real(wp) :: u0(3, 7), du(3, 7)
      logical, allocatable :: active(:)
      logical :: held(3, 7)
      integer :: slave, master, i

      call stepper_new(stepper, place, error)
      if (.not. allocated(error)) call stepper_add_faces(stepper, "FLOOR", [9], [4], [1, 2, 3, 4], &
         master, error)
      if (.not. allocated(error)) call stepper_add_faces(stepper, "FOOT", [5], [3], [5, 7, 6], &
         slave, error)
      if (.not. allocated(error)) call stepper_add_pair(stepper, slave, master, formulation_nts, &
         contact_options_t(), error)
      held = .false.
      held(:, :4) = .true.
      if (.not. allocated(error)) call stepper_hold(stepper, held, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
      call require(error)
      u0 = 0.0_wp
      du = 0.0_wp
      do i = 5, 7
         du(:, i) = [-0.1_wp*place(2, i), 0.1_wp*place(1, i), -0.4_wp]
      end do
      call query_begin_contact(query, stepper, u0, du, [.true., .true., .true.], active, error)
      if (.not. allocated(error)) call query_select(query, stepper, u0, du, active, error)
      if (.not. allocated(error)) call query_contact(query, stepper, u0, du, values, error)
      call require(error)
      call report(query, values, du)
      call query_free(query)
      call stepper_close(stepper)
   end subroutine look_in_space

   !> Number of constraints; largest change of a gap; by how much g . du differs from that; largest
   !> entry of P^T G^T.
   subroutine report(query, values, du)
      type(query_t), intent(inout) :: query
      type(contact_report_t), intent(in) :: values
      real(wp), intent(in) :: du(:, :)
      type(error_t), allocatable :: error
      type(csr_t) :: p, df, crossed
      real(wp) :: along(values%n)
      integer, allocatable :: redundant(:)

      call csr_multiply(values%discrete_gradient, reshape(du, [size(du)]), along)
      call query_null_space(query, p, df, redundant, error)
      call require(error)
      call csr_product(values%discrete_gradient, p, crossed)
      print "(2(i0, 1x), 3es25.16)", values%n, size(redundant), maxval(abs(values%dgap)), &
         maxval(abs(along - values%dgap)), maxval([0.0_dp, abs(crossed%value)])
   end subroutine report

end program fortran_contact
