!> A whole step of a host by one call: its contacts, and Newton's method with them.
!>
!> The host gives its residual r and a solver by its tangent K, both without contact. In each
!> iterate the library condenses K du + r = G^T lam to the rows of all candidates, C K^-1 G^T,
!> solves the small problem of their laws, and moves by K^-1 (G^T lam - r). Source: docs/theory.md,
!> eq. (14i) and section 6.1. C, C++ and FORTRAN 77 call this; Python has `host_newton.py`, which
!> says why.
module emcon_stepper_solve
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_multiply, csr_multiply_transposed, csr_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_kinds, only : dp, wp
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_that
   use emcon_stepper_contact, only : query_begin_contact, query_begin_damping, &
      query_begin_friction, query_contact, query_law_forces, query_update_active, step_done
   use emcon_stepper_problem, only : query_select_candidates, query_solve_contacts
   use emcon_stepper_query, only : query_t
   use emcon_stepper_report, only : contact_report_t, query_curvature
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_solver_t, query_solve_step

   integer, parameter :: most_iterates = 40
   !> Round-off of what is computed: matrices are in double precision at the most.
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Of the positions: a smaller motion that does not decrease is round-off of the host's solver.
   real(wp), parameter :: is_small = eps**(2.0_wp/3.0_wp)

   !> The equations of a host, without contact.
   type, abstract :: host_solver_t
   contains
      procedure(host_solve), deferred :: solve
   end type host_solver_t

   abstract interface
      !> Find the residual r of the step by `du`, and its derivative K by the unknowns at the end,
      !> from which `second` is subtracted. Add r to the last of the columns, then replace each
      !> column b by K^-1 b. Unknowns are those of `query_set_map`; without a map the freedoms of
      !> all nodes, of which those that are held come out as 0.
      subroutine host_solve(self, du, second, columns, error)
         import :: csr_t, error_t, host_solver_t, wp
         implicit none
         class(host_solver_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: du(:, :)           !! (n_dim, n_node) [L]
         type(csr_t), intent(in) :: second                      !! (n_unknown, n_unknown) [M/T^2]
         real(wp), intent(inout), contiguous :: columns(:, :)   !! (n_unknown, any)
         type(error_t), allocatable, intent(out) :: error       !! ends the step
      end subroutine host_solve
   end interface

contains

   !> Solve a step from the displacements `u0`. After an error `du` and `active` are what they were;
   !> an analysis error asks for a smaller step.
   subroutine query_solve_step(self, stepper, u0, du, active, lam, solver, error, stop, h)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :)         !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: du(:, :)      !! (n_dim, n_node) expected; solved [L]
      logical, intent(inout) :: active(:)                  !! (n_constraint) acted before; act
      !> (n_constraint) forces of the gaps, 0 where open [M L/T^2]
      real(wp), allocatable, intent(out) :: lam(:)
      class(host_solver_t), intent(inout) :: solver
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional, contiguous :: stop(:, :)   !! see `query_begin_friction`
      real(wp), intent(in), optional :: h                  !! see `query_begin_damping`
      real(wp), allocatable :: row_lam(:), motion(:, :)
      logical, allocatable :: acts(:)
      logical :: is_done
      integer :: outcome

      call query_begin_contact(self, stepper, u0, du, active, acts, error)
      if (present(stop) .and. .not. allocated(error)) then
         call query_begin_friction(self, stepper, stop, error)
      end if
      if (present(h) .and. .not. allocated(error)) call query_begin_damping(self, stepper, h, error)
      if (allocated(error)) return
      call check_that(allocated(self%map) .or. self%march%system%first_constraint(1) == 0, &
         "surfaces are tied: set the map of the links (emcon_links) first", error)
      if (allocated(error)) return
      allocate(motion, source=du)
      is_done = .false.
      do while (.not. is_done)
         call query_select_candidates(self, stepper, u0, motion, acts, error)
         if (.not. allocated(error)) call newton(self, stepper, u0, motion, solver, row_lam, error)
         if (.not. allocated(error)) call query_update_active(self, stepper, u0, motion, row_lam, &
            acts, is_done, outcome, error)
         if (allocated(error)) return
      end do
      if (outcome /= step_done) call raise(error, err_analysis, "no set of contacts ends the " // &
         "step: try a smaller one")
      if (allocated(error)) return
      du = motion
      active = acts
      allocate(lam(size(acts)), source=0.0_wp)
      associate (set => self%march%active%set)
         lam(set%id(:set%n)) = set%lam(:set%n)
      end associate
   end subroutine query_solve_step

   !> Newton's method with the rows that are selected, until the motion is round-off of the
   !> positions, or round-off of the solver keeps it from decreasing.
   subroutine newton(self, stepper, u0, du, solver, lam, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :)
      real(wp), intent(inout), contiguous :: du(:, :)
      class(host_solver_t), intent(inout) :: solver
      real(wp), allocatable, intent(out) :: lam(:)         !! of the rows [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: reach, length, last, motion(size(du, 1), size(du, 2))
      integer :: iterate

      reach = maxval(abs(stepper%scene%x))
      last = huge(last)
      do iterate = 1, most_iterates
         call correct(self, stepper, u0, du, solver, lam, motion, error)
         if (allocated(error)) return
         du = du + motion
         length = maxval(abs(motion))
         if (length <= 4.0_wp*eps*reach) return
         if (last <= length .and. length < is_small*reach) return
         last = length
      end do
      call raise(error, err_analysis, "Newton's method still moves by " // to_text(length) // &
         ": try a smaller step")
   end subroutine newton

   !> The multipliers, and the motion of the nodes with which an iterate goes on.
   subroutine correct(self, stepper, u0, du, solver, lam, motion, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      class(host_solver_t), intent(inout) :: solver
      real(wp), allocatable, intent(inout) :: lam(:)       !! of the iterate before; of this one
      real(wp), intent(out) :: motion(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(contact_report_t) :: rows
      type(csr_t) :: second
      real(wp), allocatable :: columns(:, :), force(:, :), w(:, :), free(:)
      real(wp) :: dissipated
      integer :: n, k, j

      call query_contact(self, stepper, u0, du, rows, error)
      if (allocated(error)) return
      n = rows%n
      if (.not. allocated(lam)) allocate(lam(n), source=0.0_wp)
      call query_law_forces(self, stepper, force, dissipated, error)
      if (.not. allocated(error)) call query_curvature(self, lam, second, error)
      if (allocated(error)) return
      allocate(columns(second%n_row, n + 1), source=0.0_wp)
      do k = 1, n
         associate (g => rows%discrete_gradient)
            do j = g%row_start(k) + 1, g%row_start(k + 1)
               columns(g%column(j) + 1, k) = real(g%value(j), wp)
            end do
         end associate
      end do
      columns(:, n + 1) = -by_unknowns(self, force, second%n_row)
      call solver%solve(du, second, columns, error)
      if (.not. allocated(error)) then
         if (.not. all(ieee_is_finite(columns))) call raise(error, err_analysis, &
            "what the host's solver found is not finite: try a smaller step")
      end if
      if (allocated(error)) return
      allocate(w(n, n), free(n))
      do k = 1, n
         call csr_multiply(rows%end_gradient, columns(:, k), w(k, :))
      end do
      call csr_multiply(rows%end_gradient, columns(:, n + 1), free)
      free = rows%defect - free
      if (n > 0) call query_solve_contacts(self, w, free, lam, error)
      if (allocated(error)) return
      call put_at_nodes(self, matmul(columns(:, :n), lam) - columns(:, n + 1), motion)
   end subroutine correct

   !> Forces at the nodes, by the unknowns of the host.
   function by_unknowns(self, force, n) result(own)
      type(query_t), intent(in) :: self
      real(wp), intent(in), contiguous :: force(:, :)
      integer, intent(in) :: n                   !! unknowns
      real(wp) :: own(n), all(size(force))

      all = reshape(force, [size(force)])
      if (allocated(self%map)) then
         call csr_multiply_transposed(self%map, all, own)
      else
         own = all
      end if
   end function by_unknowns

   !> A motion of the unknowns of the host, at the nodes.
   subroutine put_at_nodes(self, own, motion)
      type(query_t), intent(in) :: self
      real(wp), intent(in), contiguous :: own(:)
      real(wp), intent(out) :: motion(:, :)
      real(wp) :: all(size(motion))

      if (allocated(self%map)) then
         call csr_multiply(self%map, own, all)
      else
         all = own
      end if
      motion = reshape(all, shape(motion))
   end subroutine put_at_nodes

end module emcon_stepper_solve
