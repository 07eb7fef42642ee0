!> All calls of a step with friction one by one (an example by one call is fortran_bars.f90): two point
!> masses fly askew at a floor, hit it one after the other and rub on it, with a map to the unknowns of the
!> masses, by sets of contacts and with all candidates. The host's matrix K is diagonal, 2 m/h^2.
!>
!> usage: friction_loop FRICTION
program friction_loop
   use emcon_api, only : contact_options_t, contact_report_t, csr_from_values, csr_multiply, csr_t, error_t, &
      formulation_nts, interaction_t, query_begin_contact, query_begin_friction, query_contact, query_free, query_pattern, &
      query_select, query_select_candidates, query_set_map, query_slips, query_solve_contacts, query_t, query_update_active, &
      step_done, stepper_add_pair, stepper_add_surface, stepper_build, stepper_close, stepper_new, stepper_t, wp
   implicit none
   integer, parameter :: n_node = 4, m = 4            !! unknowns: x and y of the two masses
   real(wp), parameter :: mass = 1.0_wp, h = 0.02_wp
   real(wp), parameter :: x(2, n_node) = reshape([-1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, -0.3_wp, 0.10_wp, 0.3_wp, 0.13_wp], &
      [2, n_node])
   character(len=20) :: argument
   real(wp) :: friction
   logical :: together

   call get_command_argument(1, argument)
   read (argument, *) friction
   together = .false.
   call collide(friction, together)
   call collide(friction, .not. together)

contains

   subroutine require(error)
      type(error_t), allocatable, intent(in) :: error

      if (.not. allocated(error)) return
      print "(2a)", "error: ", error%message
      error stop 1
   end subroutine require

   subroutine collide(friction, together)
      real(wp), intent(in) :: friction
      logical, intent(in) :: together                 !! with all candidates, else by sets
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(csr_t) :: map
      type(error_t), allocatable :: error
      type(interaction_t) :: interaction
      real(wp), allocatable :: slip(:, :), force(:, :)
      real(wp) :: u(2, n_node), v(2, n_node), lost
      logical, allocatable :: active(:)
      integer, allocatable :: way(:)
      integer :: sole, floor, k

      interaction%friction = friction
      call stepper_new(stepper, x, error)
      call require(error)
      call stepper_add_surface(stepper, "floor", reshape([2, 1], [2, 1]), floor, error)
      call require(error)
      call stepper_add_surface(stepper, "sole", reshape([3, 4], [2, 1]), sole, error)
      call require(error)
      call stepper_add_pair(stepper, sole, floor, formulation_nts, contact_options_t(), error, interaction)
      call require(error)
      call stepper_build(stepper, error)
      call require(error)
      call csr_from_values(map, 2*n_node, m, [(4 + k, k = 1, m)], [(k, k = 1, m)], [(1.0_wp, k = 1, m)])
      call query_set_map(query, stepper, map, error)
      call require(error)
      u = 0.0_wp
      v = spread([1.0_wp, -1.0_wp], 2, n_node)
      v(:, :2) = 0.0_wp
      lost = 0.0_wp
      allocate(active(stepper%march%system%n_constraint), source=.false.)
      do k = 1, 20
         call step(stepper, query, u, v, active, together)
         call query_slips(query, stepper, way, slip, force, error)
         call require(error)
         lost = lost + sum(slip*force)
      end do
      print "(6es25.16)", v(:, 3:), 0.5_wp*mass*sum(v**2), lost
      call query_free(query)
      call stepper_close(stepper)
   end subroutine collide

   subroutine step(stepper, query, u, v, active, together)
      type(stepper_t), intent(in) :: stepper
      type(query_t), intent(inout) :: query
      real(wp), intent(inout) :: u(2, n_node), v(2, n_node)
      logical, allocatable, intent(inout) :: active(:)
      logical, intent(in) :: together
      type(csr_t) :: pattern
      type(error_t), allocatable :: error
      real(wp), allocatable :: lam(:)
      real(wp) :: du(2, n_node)
      logical :: was(size(active)), is_done
      integer :: outcome

      du = h*v
      was = active
      call query_begin_contact(query, stepper, u, du, was, active, error)
      call require(error)
      call query_begin_friction(query, stepper, 0.5_wp*h*v, error)
      call require(error)
      call query_pattern(query, stepper, u, du, pattern, error)
      call require(error)
      if (pattern%n_row /= m .or. pattern%n_col /= m) error stop "the pattern is not that of the masses"
      is_done = .false.
      do while (.not. is_done)
         if (together) call query_select_candidates(query, stepper, u, du, active, error)
         if (.not. together) call query_select(query, stepper, u, du, active, error)
         call require(error)
         call newton(stepper, query, u, v, du, together, lam)
         call query_update_active(query, stepper, u, du, lam, active, is_done, outcome, error)
         call require(error)
      end do
      if (outcome /= step_done) error stop "the step cannot be ended"
      u = u + du
      v = 2.0_wp/h*du - v
   end subroutine step

   !> The motion, and the multipliers; a contact sees its own mass alone, so that W = c K^-1 g^T.
   subroutine newton(stepper, query, u, v, du, together, lam)
      type(stepper_t), intent(in) :: stepper
      type(query_t), intent(inout) :: query
      real(wp), intent(in) :: u(2, n_node), v(2, n_node)
      real(wp), intent(inout) :: du(2, n_node)
      logical, intent(in) :: together
      real(wp), allocatable, intent(out) :: lam(:)
      real(wp), parameter :: k = 2.0_wp*mass/h**2
      type(contact_report_t) :: rows
      type(error_t), allocatable :: error
      real(wp), allocatable :: g(:, :), c(:, :), w(:, :), opening(:)
      real(wp) :: residual(m)
      integer :: i

      do i = 1, 8
         call query_contact(query, stepper, u, du, rows, error)
         call require(error)
         g = dense(rows%discrete_gradient)
         c = dense(rows%end_gradient)
         residual = reshape(k*(du(:, 3:) - h*v(:, 3:)), [m])
         w = matmul(g, transpose(c))/k                ! (by multiplier, row)
         opening = rows%defect - matmul(c, residual)/k
         if (together .and. rows%n > 0) then
            call query_solve_contacts(query, w, opening, lam, error)
            call require(error)
         else
            lam = solved(transpose(w), -opening)
         end if
         du(:, 3:) = du(:, 3:) + reshape(matmul(lam, g) - residual, [2, 2])/k
      end do
   end subroutine newton

   function dense(rows) result(matrix)
      type(csr_t), intent(in) :: rows
      real(wp) :: matrix(rows%n_row, rows%n_col), unit(rows%n_col)
      integer :: j

      do j = 1, rows%n_col
         unit = 0.0_wp
         unit(j) = 1.0_wp
         call csr_multiply(rows, unit, matrix(:, j))
      end do
   end function dense

   !> Elimination without pivots: contacts of different masses are diagonal.
   function solved(a, b) result(y)
      real(wp), intent(in) :: a(:, :), b(:)
      real(wp) :: y(size(b)), rest(size(b), size(b))
      integer :: i, j

      rest = a
      y = b
      do i = 1, size(b)
         do j = 1, size(b)
            if (j == i) cycle
            y(j) = y(j) - rest(j, i)/rest(i, i)*y(i)
            rest(j, :) = rest(j, :) - rest(j, i)/rest(i, i)*rest(i, :)
         end do
      end do
      y = [(y(i)/rest(i, i), i = 1, size(b))]
   end function solved

end program friction_loop
