!> What is left of a step in which contacts act, stick and slide as their laws say: rows that are to
!> hold and do not, and forces that miss the laws. Source: docs/theory.md, eq. (14i).
module emcon_contact_rest
   use emcon_constraints, only : constraint_set_t, constraints_rounding
   use emcon_contact_problem, only : contact_problem_stiffness, contact_problem_t
   use emcon_convergence, only : round_off
   use emcon_coulomb_law, only : contact_free, contact_open, contact_rests, contact_slides, &
      contact_trial_t, coulomb_t, coulomb_violation, slip_rounding, slip_status_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   implicit none
   private
   public :: contact_rest_defect, contact_rest_missed, contact_rest_gather

contains

   !> What rows that are to hold are off by at worst, and by how much those are closed that are not,
   !> over edges and over what they are computed from.
   subroutine contact_rest_defect(status, set, motion, defect, rounded)
      type(slip_status_t), intent(in) :: status(:)   !! (n) in which way the laws are to hold
      type(constraint_set_t), intent(in) :: set  !! evaluated, with rows of all slips
      type(motion_t), intent(in) :: motion       !! that is of
      real(wp), intent(out) :: defect, rounded   !! >= 0
      real(wp) :: off
      integer :: k

      defect = 0.0_wp
      rounded = 0.0_wp
      do k = 1, set%n_row
         off = abs(set%defect(k))
         associate (condition => set%condition(k), slip => set%slip(k))
            if (condition > set%n_permanent) then
               associate (kind => status(condition - set%n_permanent)%kind)
                  if (slip == 0 .and. kind == contact_open) off = max(0.0_wp, -set%defect(k))
                  if (slip > 0 .and. kind == contact_rests) then
                     off = abs(set%item(condition)%slip(slip))
                  end if
                  if (slip > 0 .and. any(kind == [contact_open, contact_free, contact_slides])) then
                     off = 0.0_wp
                  end if
               end associate
            end if
            defect = max(defect, off/set%item(condition)%size)
            rounded = max(rounded, off/constraints_rounding(set, motion, k))
         end associate
      end do
   end subroutine contact_rest_defect

   !> How far the forces that there are miss the laws with the gaps and slips that there are, over
   !> the largest of them, in the stiffness of a condensed problem.
   pure subroutine contact_rest_missed(law, problem, set, rounding, missed)
      type(coulomb_t), intent(in) :: law(:)      !! (n) of the contacts
      type(contact_problem_t), intent(in) :: problem !! of these contacts
      type(constraint_set_t), intent(in) :: set  !! evaluated, with rows of all slips
      real(wp), intent(in) :: rounding           !! of forces [M L/T^2]
      real(wp), intent(out) :: missed            !! >= 0
      type(contact_trial_t) :: at
      real(wp), dimension(0:problem%n_slip, size(law)) :: force, defect
      real(wp) :: stiffness
      integer :: k

      missed = 0.0_wp
      call contact_rest_gather(set, set%lam, force)
      call contact_rest_gather(set, set%defect, defect)
      associate (n_slip => problem%n_slip, first => set%n_permanent)
         do k = 1, size(law)
            stiffness = contact_problem_stiffness(problem, k)
            at%rounding = slip_rounding*set%item(first + k)%size
            at%lam = force(0, k)
            at%gap = defect(0, k)
            if (abs(at%gap) <= at%rounding) at%gap = 0.0_wp
            at%tau(:n_slip) = force(1:, k)
            at%slip_target(:n_slip) = problem%slip_target(:, k)
            at%slip(:n_slip) = at%slip_target(:n_slip) - defect(1:, k)
            missed = max(missed, coulomb_violation(at, law(k)%mu*set%item(first + k)%normal, &
               stiffness))
         end do
      end associate
      ! Where nothing is loaded all forces are round-off.
      if (missed <= round_off*rounding) missed = 0.0_wp
      if (missed > 0.0_wp) missed = missed/max(maxval(abs(force)), tiny(missed))
   end subroutine contact_rest_missed

   !> Values of the rows of contacts, contact by contact; 0 where there is no row.
   pure subroutine contact_rest_gather(set, of_row, of_contact)
      type(constraint_set_t), intent(in) :: set  !! with their rows
      real(wp), intent(in) :: of_row(:)          !! (n_row)
      real(wp), intent(inout) :: of_contact(0:, :)       !! (0:n_slip, n)
      integer :: k

      of_contact = 0.0_wp
      do k = set%n_permanent + 1, set%n_row
         of_contact(set%slip(k), set%condition(k) - set%n_permanent) = of_row(k)
      end do
   end subroutine contact_rest_gather

end module emcon_contact_rest
