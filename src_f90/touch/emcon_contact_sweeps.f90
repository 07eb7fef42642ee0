!> Solutions of a problem of contacts place by place, each exactly, until nothing changes (Gauss and
!> Seidel). That needs no inverse, so that contacts that follow from others do no harm.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_sweeps
   use emcon_constraint, only : most_slips
   use emcon_contact_problem, only : contact_problem_missed, contact_problem_motion, &
      contact_problem_own_stiffness, contact_problem_t, freely, met
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_single_contact, only : single_contact_solve, single_contact_t
   implicit none
   private
   public :: contact_sweeps

contains

   !> Contact by contact, each exactly with the pushes of the others, over and over.
   subroutine contact_sweeps(self, push, most, n_sweep, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most                    !! sweeps
      integer, intent(inout) :: n_sweep              !! counted on
      logical, intent(out) :: is_solved           !! by the last sweep
      type(single_contact_t) :: place
      real(wp) :: new(0:most_slips), motion(0:self%n_slip, size(self%mu))
      real(wp), dimension(0:self%n_slip) :: force, change
      real(dp) :: yields(0:self%n_slip, 0:self%n_slip, size(self%mu))    ! y by forces
      real(wp) :: endless                            ! forces that grow from sweep to sweep
      integer :: i, m, sweep

      m = 1 + self%n_slip
      place%n_slip = self%n_slip
      call find_yields(self, yields)
      endless = maxval([(contact_problem_own_stiffness(self, i), i = 1, size(self%mu))]) &
         *maxval(abs(self%free))/epsilon(endless)**2
      is_solved = .false.
      do sweep = 1, most
         n_sweep = n_sweep + 1
         motion = contact_problem_motion(self, push)
         do i = 1, size(self%mu)
            associate (w => self%w(:, m*(i - 1) + 1:m*i), row => m*(i - 1) + 1)
               force = self%base(:, i) + push(:, i) - self%hold(:, i)*(motion(:, i) &
                  - self%start(:, i))
               place%w(:self%n_slip, :self%n_slip) = matmul(w(row:m*i, :), &
                  real(yields(:, :, i), wp))
               place%free(:self%n_slip) = motion(:, i) - matmul(place%w(:self%n_slip, &
                  :self%n_slip), force)
               place%slip_target(:self%n_slip) = self%slip_target(:, i)
               place%mu = self%mu(i)
               place%stiffness = contact_problem_own_stiffness(self, i)
               new = single_contact_solve(place)
               change = matmul(real(yields(:, :, i), wp), new(:self%n_slip) - force)
               push(:, i) = push(:, i) + change
               call add_motion(w, change, motion)
            end associate
         end do
         is_solved = contact_problem_missed(self, push) <= met
         if (is_solved .or. maxval(abs(push)) > endless) exit
      end do
   end subroutine contact_sweeps

   !> What y of each contact gains by its force, those of the others as they are.
   subroutine find_yields(self, yields)
      type(contact_problem_t), intent(in) :: self
      real(dp), intent(out) :: yields(0:, 0:, :)     !! (0:n_slip, 0:n_slip, n)
      real(dp), dimension(0:self%n_slip, 0:self%n_slip) :: unit, by
      integer :: i, k, m
      logical :: is_singular

      m = 1 + self%n_slip
      unit = 0.0_dp
      do k = 0, self%n_slip
         unit(k, k) = 1.0_dp
      end do
      do i = 1, size(self%mu)
         yields(:, :, i) = unit
         if (.not. any(self%hold(:, i) > 0.0_wp)) cycle
         do k = 0, self%n_slip
            by(k, :) = (1.0_dp + freely)*unit(k, :) - real(self%hold(k, i)*self%w(m*(i - 1) + 1 &
               + k, m*(i - 1) + 1:m*i), dp)
         end do
         call dense_solve(by, unit, yields(:, :, i), is_singular)
      end do
   end subroutine find_yields

   !> What the forces of one contact more move.
   pure subroutine add_motion(w, change, motion)
      real(wp), intent(in), contiguous :: w(:, :)    !! columns of W
      real(wp), intent(in) :: change(:)              !! [M L/T^2]
      real(wp), intent(inout) :: motion(size(w, 1))  !! [L]
      integer :: k

      do k = 1, size(change)
         motion = motion + change(k)*w(:, k)
      end do
   end subroutine add_motion

end module emcon_contact_sweeps
