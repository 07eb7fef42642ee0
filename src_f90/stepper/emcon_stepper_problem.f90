!> The contacts of a host's step as one small problem: which of them act, stick and slide, from the
!> compliance that the host's tangent has between their rows.
!>
!> `query_select_candidates` in place of `query_select`: all candidates have rows of their gaps and
!> of all slips. In each iterate of Newton's method the host condenses its equations to these rows,
!> [g; a - s] = free + W [lam; tau], and `query_solve_contacts` gives the forces that obey the laws.
!> Sets are not tried one after the other, so that none comes back. Source: docs/theory.md,
!> eq. (14i) and section 6.1.
module emcon_stepper_problem
   use emcon_contact_parts, only : contact_parts_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_status, contact_problem_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_host_friction, only : host_friction_hold, host_friction_lay_out, host_friction_take
   use emcon_host_set, only : host_set_condense
   use emcon_kinds, only : wp
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_list, check_that
   use emcon_stepper_contact, only : query_select
   use emcon_stepper_query, only : query_t
   use emcon_stepper_report, only : report_check_list
   use emcon_text, only : to_text
   implicit none
   private
   public :: query_select_candidates, query_solve_contacts

contains

   !> Select the constraints `active`, of which any may act, stick or slide.
   subroutine query_select_candidates(self, stepper, u0, du, active, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      logical, intent(in) :: active(:)           !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error

      if (self%has_begun) call host_friction_hold(self%march%active)
      call query_select(self, stepper, u0, du, active, error)
      if (.not. allocated(error)) call host_set_condense(self%host_set)
   end subroutine query_select_candidates

   !> The multipliers that obey the laws of all candidates, as evaluated last, where the values of
   !> their rows are `free` without contact forces and grow by `w` with the multipliers.
   subroutine query_solve_contacts(self, w, free, lam, error)
      type(query_t), intent(inout) :: self
      real(wp), intent(in) :: w(:, :)            !! (n_row, n_row) (by multiplier, row) [T^2/M]
      real(wp), intent(in) :: free(:)            !! (n_row) [L]
      real(wp), allocatable, intent(out) :: lam(:)         !! (n_row) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      real(wp), allocatable :: force(:, :)
      logical :: is_solved
      integer :: place(self%march%active%set%n_row), k, m

      call report_check_list(self, "free", free, error)
      do k = 1, size(w, 1)
         call check_list("w(:, " // to_text(k) // ")", w(:, k), size(free), error)
      end do
      call check_that(size(w, 1) == size(w, 2), "w is not square", error)
      if (allocated(error)) return
      associate (set => self%march%active%set)
         m = 1 + maxval([0, set%slip])
         call contact_problem_create(problem, m - 1, set%n)
         allocate(force(0:m - 1, set%n), source=0.0_wp)
         place = m*(set%condition - 1) + 1 + set%slip
         ! Without friction a contact has no slips to solve for: any one by itself.
         do k = 1, set%n
            problem%w(m*(k - 1) + 1:m*k, m*(k - 1) + 1:m*k) = own_block(m, w(k, k))
         end do
         problem%w(place, place) = transpose(w)
         do k = 1, set%n_row
            problem%free(set%slip(k), set%condition(k)) = free(k)
            force(set%slip(k), set%condition(k)) = set%lam(k)
         end do
         call host_friction_lay_out(self%march%active, problem)
         call contact_parts_solve(problem, force, effort, is_solved, .true.)
         if (.not. is_solved) call raise(error, err_analysis, "no forces were found that obey " // &
            "the laws of " // to_text(set%n) // " contacts: try a smaller step")
         if (allocated(error)) return
         allocate(lam(set%n_row))
         do k = 1, set%n_row
            lam(k) = force(set%slip(k), set%condition(k))
         end do
         set%lam = lam
         call host_friction_take(self%march%active, contact_problem_status(problem, force))
      end associate
   end subroutine query_solve_contacts

   !> Of the size `m`, with `value` on the diagonal.
   pure function own_block(m, value) result(block)
      integer, intent(in) :: m
      real(wp), intent(in) :: value
      real(wp) :: block(m, m)
      integer :: k

      block = 0.0_wp
      do k = 1, m
         block(k, k) = value
      end do
   end function own_block

end module emcon_stepper_problem
