!> Places of contact whose gaps and slips are linear in their forces: which act, stick and slide.
!>
!> [g; -s] = free + W [lam; tau], contact by contact, with Coulomb's law at each. By Newton's method
!> for the natural map of all of them at once, which is a trial of the law at every place; where
!> that does not come to an end place by place, each exactly, until nothing changes (Gauss and
!> Seidel), which needs no inverse, so that contacts that follow from others do no harm; the two
!> take turns. Last, in the plane, by the method of Lemke for (lam, tau+, tau-, rest of the cone),
!> whose matrix is copositive. Where W is positive definite there is a solution for any coefficient.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_problem
   use emcon_constraint, only : most_slips
   use emcon_coulomb_law, only : contact_trial_t, coulomb_map, coulomb_status, slip_status_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_lemke, only : lemke_solve
   use emcon_single_contact, only : single_contact_solve, single_contact_t
   implicit none
   private
   public :: contact_problem_t, contact_effort_t, contact_problem_create, contact_problem_solve, &
      contact_problem_missed, contact_problem_status, contact_problem_stiffness, &
      contact_problem_pivot

   !> Trials of all places at once at first, and when their turn comes again; sweeps in the first
   !> turn, twice as many in each that follows; turns.
   integer, parameter :: first_trials = 60, more_trials = 20, first_sweeps = 20, most_turns = 8
   !> Halvings of a step of Newton's method, and the part of what is foreseen that it is to gain.
   integer, parameter :: most_halvings = 12
   real(wp), parameter :: least_gain = 1.0e-4_wp
   !> The law is met where it is missed by less than this part of the largest force: by what a solve
   !> in double precision leaves of some hundred forces. Where no turn comes to that W is nearly
   !> singular, and what moves nothing may be missed by more.
   real(wp), parameter :: met = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), &
      nearly_met = 50.0_wp*met
   !> W of Newton's method is stiffer by this part of its diagonal: its solutions are the same, and
   !> where W is singular it has steps.
   real(wp), parameter :: proximal = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

   type :: contact_problem_t
      integer :: n_slip = 0                          !! of each contact, n_dim - 1
      real(wp), allocatable :: w(:, :)               !! W, ((1 + n_slip) n, the same) [T^2/M]
      real(wp), allocatable :: free(:, :)            !! (0:n_slip, n) g and -s without forces [L]
      real(wp), allocatable :: slip_target(:, :)     !! (n_slip, n) a [L]
      real(wp), allocatable :: mu(:)                 !! (n) >= 0
   end type contact_problem_t

   !> What a solution has cost.
   type :: contact_effort_t
      integer :: n_trial = 0, n_sweep = 0, n_pivot = 0
   end type contact_effort_t

contains

   !> A problem of `n` contacts without forces, slips and friction yet.
   pure subroutine contact_problem_create(self, n_slip, n)
      type(contact_problem_t), intent(out) :: self
      integer, intent(in) :: n_slip                  !! n_dim - 1
      integer, intent(in) :: n                       !! contacts

      self%n_slip = n_slip
      allocate(self%w((1 + n_slip)*n, (1 + n_slip)*n), self%free(0:n_slip, n), &
         self%slip_target(n_slip, n), self%mu(n), source=0.0_wp)
   end subroutine contact_problem_create

   !> Forces that obey the law at all contacts.
   subroutine contact_problem_solve(self, force, effort, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: force(0:, :)        !! (0:n_slip, n) start, solution [M L/T^2]
      type(contact_effort_t), intent(out) :: effort
      logical, intent(out) :: is_solved              !! else `force` is as near as it came
      integer :: turn

      call solve_by_trials(self, force, first_trials, effort%n_trial, is_solved)
      if (is_solved .or. .not. has_compliance(self)) return
      do turn = 1, most_turns
         if (is_solved) return
         call solve_by_sweeps(self, force, first_sweeps*2**(turn - 1), effort%n_sweep, is_solved)
         if (is_solved) return
         call solve_by_trials(self, force, more_trials, effort%n_trial, is_solved)
      end do
      is_solved = contact_problem_missed(self, force) <= nearly_met
      if (.not. is_solved .and. self%n_slip == 1) call contact_problem_pivot(self, force, &
         effort%n_pivot, is_solved)
   end subroutine contact_problem_solve

   !> Does each gap open when it is pushed?
   pure logical function has_compliance(self)
      type(contact_problem_t), intent(in) :: self
      integer :: i

      has_compliance = all([(self%w(1 + (i - 1)*(1 + self%n_slip), 1 + (i - 1)*(1 + self%n_slip)) &
         > 0.0_wp, i = 1, size(self%mu))])
   end function has_compliance

   !> The stiffness by which a miss of the law is a force: of contact `i` by itself [M/T^2].
   pure real(wp) function contact_problem_stiffness(self, i) result(stiffness)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n
      integer :: k, m

      m = 1 + self%n_slip
      stiffness = m/max(sum([(abs(self%w(k, k)), k = m*(i - 1) + 1, m*i)]), tiny(stiffness))
   end function contact_problem_stiffness

   !> In which ways the law holds at the contacts.
   pure function contact_problem_status(self, force) result(status)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: force(0:, :)           !! (0:n_slip, n) of a solution [M L/T^2]
      type(slip_status_t) :: status(size(self%mu))
      real(wp) :: motion(0:self%n_slip, size(self%mu))
      integer :: i

      motion = motion_of(self, force)
      do i = 1, size(status)
         status(i) = coulomb_status(trial_of(self, force(:, i), motion(:, i), i), self%mu(i), &
            contact_problem_stiffness(self, i))
      end do
   end function contact_problem_status

   !> Forces, gap and slips of contact `i`.
   pure type(contact_trial_t) function trial_of(self, force, motion, i) result(at)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: force(0:)              !! (0:n_slip) [M L/T^2]
      real(wp), intent(in) :: motion(0:)             !! (0:n_slip) gap, slips the other way [L]
      integer, intent(in) :: i

      associate (s => self%n_slip)
         at%lam = force(0)
         at%gap = motion(0)
         at%tau(:s) = force(1:)
         at%slip(:s) = -motion(1:)
         at%slip_target(:s) = self%slip_target(:, i)
      end associate
   end function trial_of

   !> Gaps, and slips the other way round [L].
   pure function motion_of(self, force) result(motion)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: force(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp) :: motion(0:self%n_slip, size(self%mu))

      motion = self%free + reshape(matmul(self%w, reshape(force, [size(force)])), shape(force))
   end function motion_of

   !> How far the law is missed at its worst contact, over the largest force; 0: no force at all.
   pure real(wp) function contact_problem_missed(self, force) result(missed)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: force(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp) :: defect(0:self%n_slip, size(self%mu))

      call natural_map(self, force, defect)
      missed = maxval(abs(defect))
      if (missed > 0.0_wp) missed = missed/max(maxval(abs(force)), tiny(missed))
   end function contact_problem_missed

   !> Forces less those that the natural map makes of them.
   pure subroutine natural_map(self, force, defect, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: force(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(out) :: defect(0:, :)         !! (0:n_slip, n) [M L/T^2]
      real(dp), intent(out), optional :: slope(:, :) !! of `defect` by `force`, proximal
      real(wp) :: mapped(0:most_slips), by(0:most_slips, 0:most_slips), stiffness, &
         motion(0:self%n_slip, size(self%mu))
      integer :: i, k, m

      m = 1 + self%n_slip
      motion = motion_of(self, force)
      do i = 1, size(self%mu)
         stiffness = contact_problem_stiffness(self, i)
         call coulomb_map(trial_of(self, force(:, i), motion(:, i), i), self%mu(i), stiffness, &
            mapped, by)
         defect(:, i) = force(:, i) - mapped(:self%n_slip)
         if (.not. present(slope)) cycle
         associate (row => m*(i - 1) + 1)
            slope(row:m*i, :) = real(stiffness*matmul(by(:self%n_slip, :self%n_slip), &
               self%w(row:m*i, :)), dp)
            do k = 0, self%n_slip
               slope(row:m*i, row + k) = slope(row:m*i, row + k) + real(by(:self%n_slip, k) &
                  *(stiffness*proximal*self%w(row + k, row + k) - 1.0_wp), dp)
               slope(row + k, row + k) = slope(row + k, row + k) + 1.0_dp
            end do
         end associate
      end do
   end subroutine natural_map

   !> By Newton's method for the natural map. `force` stays as it was if that does not end.
   subroutine solve_by_trials(self, force, most, n_trial, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: force(0:, :)        !! (0:n_slip, n) [M L/T^2]
      integer, intent(in) :: most                    !! trials
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: trial, defect, new, step
      real(dp) :: slope(size(force), size(force)), x(size(force), 1)
      real(wp) :: part, before, now
      integer :: i, halving
      logical :: is_singular

      trial = force
      is_solved = .false.
      do i = 0, most
         call natural_map(self, trial, defect, slope)
         now = maxval(abs(defect))
         is_solved = now <= met*maxval(abs(trial))
         ! A start that is near is made exact.
         if ((is_solved .and. (i > 0 .or. .not. now > 0.0_wp)) .or. i == most) exit
         n_trial = n_trial + 1
         call dense_solve(slope, reshape(real(-defect, dp), [size(force), 1]), x, is_singular)
         if (is_singular) exit
         step = reshape(real(x(:, 1), wp), shape(step))
         before = norm2(defect)
         part = 1.0_wp
         do halving = 0, most_halvings
            new = trial + part*step
            call natural_map(self, new, defect)
            if (norm2(defect) <= (1.0_wp - least_gain*part)*before) exit
            part = 0.5_wp*part
         end do
         if (.not. norm2(defect) < huge(before)) exit
         trial = new
      end do
      if (is_solved) force = trial
   end subroutine solve_by_trials

   !> Contact by contact, each exactly with the forces of the others, over and over.
   subroutine solve_by_sweeps(self, force, most, n_sweep, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: force(0:, :)        !! (0:n_slip, n) [M L/T^2]
      integer, intent(in) :: most                    !! sweeps
      integer, intent(inout) :: n_sweep              !! counted on
      logical, intent(out) :: is_solved
      type(single_contact_t) :: place
      real(wp) :: new(0:most_slips), motion(0:self%n_slip, size(self%mu)), change(0:self%n_slip)
      real(wp) :: endless                            ! forces that grow from sweep to sweep
      integer :: i, m, sweep

      m = 1 + self%n_slip
      place%n_slip = self%n_slip
      endless = maxval([(contact_problem_stiffness(self, i), i = 1, size(self%mu))]) &
         *maxval(abs(self%free))/epsilon(endless)**2
      is_solved = .false.
      do sweep = 1, most
         n_sweep = n_sweep + 1
         motion = motion_of(self, force)
         do i = 1, size(self%mu)
            associate (row => m*(i - 1) + 1)
               place%w(:self%n_slip, :self%n_slip) = self%w(row:m*i, row:m*i)
               place%free(:self%n_slip) = motion(:, i) - matmul(self%w(row:m*i, row:m*i), &
                  force(:, i))
               place%slip_target(:self%n_slip) = self%slip_target(:, i)
               place%mu = self%mu(i)
               place%stiffness = contact_problem_stiffness(self, i)
               new = single_contact_solve(place)
               change = new(:self%n_slip) - force(:, i)
               force(:, i) = new(:self%n_slip)
               call add_motion(self%w(:, row:m*i), change, motion)
            end associate
         end do
         is_solved = contact_problem_missed(self, force) <= met
         if (is_solved .or. maxval(abs(force)) > endless) exit
      end do
   end subroutine solve_by_sweeps

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

   !> In the plane, by complementary pivoting over (lam, tau+, tau-, mu lam - |tau|), with slips
   !> from a: what is free before that, or rests, is for others to find.
   subroutine contact_problem_pivot(self, force, n_pivot, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: force(0:, :)        !! (0:1, n) [M L/T^2]
      integer, intent(out) :: n_pivot                !! pivots that were taken
      logical, intent(out) :: is_solved              !! else `force` is as it was
      real(wp), dimension(4*size(self%mu), 4*size(self%mu)) :: m
      real(wp), dimension(4*size(self%mu)) :: q, z
      real(wp) :: unit, length
      integer :: i, n

      n = size(self%mu)
      ! Forces by the largest stiffness, so that all entries are of one size.
      length = maxval(abs(self%w))
      unit = max(maxval(abs(self%free)), maxval(abs(self%slip_target)), tiny(unit))
      m = 0.0_wp
      q = 0.0_wp
      associate (w => self%w/length, slips => self%free(1, :) + self%slip_target(1, :))
         m(:n, :3*n) = reshape([w(1::2, 1::2), w(1::2, 2::2), -w(1::2, 2::2)], [n, 3*n])
         m(n + 1:2*n, :3*n) = reshape([w(2::2, 1::2), w(2::2, 2::2), -w(2::2, 2::2)], [n, 3*n])
         m(2*n + 1:3*n, :3*n) = -m(n + 1:2*n, :3*n)
         q(:3*n) = [self%free(0, :), slips, -slips]/unit
      end associate
      do i = 1, n
         m([n + i, 2*n + i], 3*n + i) = 1.0_wp
         m(3*n + i, i) = self%mu(i)
         m(3*n + i, [n + i, 2*n + i]) = -1.0_wp
      end do
      call lemke_solve(m, q, z, is_solved, n_pivot)
      if (.not. is_solved) return
      z = (unit/length)*z
      force(0, :) = z(:n)
      force(1, :) = z(n + 1:2*n) - z(2*n + 1:3*n)
   end subroutine contact_problem_pivot

end module emcon_contact_problem
