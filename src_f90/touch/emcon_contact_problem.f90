!> Places of contact whose gaps and slips are linear in their forces: which act, stick and slide.
!>
!> With y, by which all of them push, [g; -s] = free + W y and [lam; tau] = base + y - c ([g; -s] -
!> start), contact by contact, with Coulomb's law at each; c is 0, or what the surfaces were held by
!> as W was found where nothing else holds bodies. By Newton's method for the natural map of all of
!> them at once, which is a trial of the law at every place; where that does not come to an end
!> place by place, each exactly, until nothing changes (Gauss and Seidel), which needs no inverse,
!> so that contacts that follow from others do no harm; the two take turns. Where slip has a
!> direction paths of blurred maps, and forces that stay near, come before that. After two turns,
!> in the plane, by the method of Lemke for forces that push at a and at 0, whose matrix is
!> copositive.
!> Without friction, after a few trials, the least motion that closes no gap is found instead.
!> Where W is positive definite there is a solution for any coefficient.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_problem
   use emcon_constraint, only : most_slips
   use emcon_coulomb_law, only : contact_trial_t, coulomb_map, coulomb_status, slip_status_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_lemke, only : lemke_solve
   use emcon_push_problem, only : push_problem_solve
   use emcon_single_contact, only : single_contact_solve, single_contact_t
   implicit none
   private
   public :: contact_problem_t, contact_effort_t, contact_problem_create, contact_problem_solve, &
      contact_problem_force, contact_problem_missed, contact_problem_status, &
      contact_problem_stiffness, contact_problem_pivot

   !> Trials of all places at once at first, few of them without friction, and when their turn comes
   !> again; sweeps in the first turn, twice as many in each that follows; turns; after this one
   !> comes the method of Lemke.
   integer, parameter :: first_trials = 60, few_trials = 10, more_trials = 20, first_sweeps = 20, &
      most_turns = 8, pivot_turn = 2
   !> Parts of W that places give way by about the forces so far, and how often.
   integer, parameter :: most_nearings = 30, few_nearings = 8
   real(wp), parameter :: first_part = 1.0e-3_wp, largest_part = 10.0_wp
   !> Blurs of the map that paths to the solution begin with, by the largest force, and what is left
   !> in turn; each is followed until no more than this part of the blur is missed; the part of a
   !> step's promise that it is to gain there; steps of which no more than this part does that lead
   !> nowhere after so many in a row; steps in all.
   real(wp), parameter :: first_blur(*) = [1.0e-2_wp, 1.0_wp], next_blur = 0.3_wp, &
      on_path = 0.1_wp, path_gain = 1.0e-2_wp, path_part = 0.03_wp
   integer, parameter :: path_stalls = 8, most_path = 100
   !> Halvings of a step of Newton's method, and the part of what is foreseen that it is to gain.
   integer, parameter :: most_halvings = 12
   real(wp), parameter :: least_gain = 1.0e-4_wp
   !> Where slip has a direction steps of which at most this part gains are so many in a row.
   integer, parameter :: most_stalls = 2
   real(wp), parameter :: no_part = 1.0e-3_wp
   !> The law is met where it is missed by less than this part of the largest force: by what a solve
   !> in double precision leaves of some hundred forces. Where no turn comes to that W is nearly
   !> singular, and what moves nothing may be missed by more.
   real(wp), parameter, public :: met = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), &
      nearly_met = 50.0_wp*met
   !> What gives way with nothing but contact to hold it does so by this part of c.
   real(dp), parameter :: freely = sqrt(epsilon(1.0_dp))
   !> What a sum of W and forces rounds, per sum of their sizes.
   real(wp), parameter :: rounded = 16.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> W of Newton's method is stiffer by this part of its diagonal: its solutions are the same, and
   !> where W is singular it has steps; where c is not 0 by this: a body of which all contacts slide
   !> is nowhere in particular, and round-off over that part is how far it is moved.
   real(wp), parameter :: proximal = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), &
      loosely = sqrt(max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)))

   type :: contact_problem_t
      integer :: n_slip = 0                          !! of each contact, n_dim - 1
      real(wp), allocatable :: w(:, :)               !! W, ((1 + n_slip) n, the same) [T^2/M]
      real(wp), allocatable :: free(:, :)            !! (0:n_slip, n) g and -s without y [L]
      !> (0:n_slip, n) forces that y counts from: near the solution, what is soft keeps its digits
      real(wp), allocatable :: base(:, :)
      real(wp), allocatable :: hold(:, :)            !! (0:n_slip, n) c [M/T^2]
      real(wp), allocatable :: start(:, :)           !! (0:n_slip, n) g and -s that c counts from
      real(wp), allocatable :: slip_target(:, :)     !! (n_slip, n) a [L]
      real(wp), allocatable :: mu(:)                 !! (n) >= 0
      !> (n) of what a contact pushes at, where W knows how bodies move, too; 0: 1/W [M/T^2]
      real(wp), allocatable :: stiffness(:)
   end type contact_problem_t

   !> What a solution has cost.
   type :: contact_effort_t
      integer :: n_trial = 0, n_sweep = 0, n_pivot = 0, n_near = 0, n_path = 0
   end type contact_effort_t

contains

   !> A problem of `n` contacts without forces, slips and friction yet.
   pure subroutine contact_problem_create(self, n_slip, n)
      type(contact_problem_t), intent(out) :: self
      integer, intent(in) :: n_slip                  !! n_dim - 1
      integer, intent(in) :: n                       !! contacts

      self%n_slip = n_slip
      allocate(self%w((1 + n_slip)*n, (1 + n_slip)*n), self%free(0:n_slip, n), &
         self%base(0:n_slip, n), &
         self%start(0:n_slip, n), self%hold(0:n_slip, n), self%slip_target(n_slip, n), &
         self%mu(n), self%stiffness(n), source=0.0_wp)
   end subroutine contact_problem_create

   !> Forces that obey the law at all contacts.
   subroutine contact_problem_solve(self, push, effort, is_solved, near_enough)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) start, solution: y [M L/T^2]
      type(contact_effort_t), intent(out) :: effort
      logical, intent(out) :: is_solved              !! else `push` is as near as it came
      !> The problem is one of several that come nearer to what is to be solved: where slip has a
      !> direction, forces that are nearer than those at the start will do
      logical, intent(in), optional :: near_enough
      type(contact_problem_t) :: apart
      logical :: is_one_of_several
      integer :: turn, n_turn

      is_one_of_several = .false.
      if (present(near_enough)) is_one_of_several = near_enough
      is_solved = size(self%mu) == 0
      if (is_solved) return
      associate (has_pushes => .not. any(self%mu > 0.0_wp .or. self%hold(0, :) > 0.0_wp), &
            has_direction => self%n_slip > 1 .and. any(self%mu > 0.0_wp))
         call solve_by_trials(self, push, merge(few_trials, first_trials, has_pushes &
            .or. has_direction), effort%n_trial, is_solved)
         if (is_solved .or. .not. has_compliance(self)) return
         if (has_pushes) call solve_by_pushes(self, push, effort%n_pivot, is_solved)
         if (is_solved) return
         do turn = 1, merge(size(first_blur), 0, has_direction)
            call solve_by_path(self, push, first_blur(turn), effort%n_path, is_solved)
            if (is_solved) return
         end do
         if (has_direction) call solve_by_nearing(self, push, effort, is_one_of_several, is_solved)
         is_solved = is_solved .or. (is_one_of_several .and. effort%n_near > 0)
         if (is_solved) return
         n_turn = merge(1, most_turns, has_direction .and. is_one_of_several)
      end associate
      do turn = 1, n_turn
         call solve_by_sweeps(self, push, first_sweeps*2**(turn - 1), effort%n_sweep, is_solved)
         if (is_solved) return
         call solve_by_trials(self, push, more_trials, effort%n_trial, is_solved)
         if (is_solved) return
         if (turn /= pivot_turn .or. self%n_slip /= 1 .or. any(self%hold > 0.0_wp)) cycle
         call contact_problem_pivot(self, push, effort%n_pivot, is_solved)
         if (is_solved) return
      end do
      is_solved = contact_problem_missed(self, push) <= nearly_met
      if (is_solved .or. self%n_slip /= 1 .or. .not. any(self%hold > 0.0_wp)) return
      call let_go(self, apart)
      call contact_problem_pivot(apart, push, effort%n_pivot, is_solved)
      if (.not. is_solved) return
      call take_back(self, push)
      call solve_by_trials(self, push, more_trials, effort%n_trial, is_solved)
   end subroutine contact_problem_solve

   !> The same places without what holds them: what moves freely is held by round-off's root of it.
   subroutine let_go(self, apart)
      type(contact_problem_t), intent(in) :: self
      type(contact_problem_t), intent(out) :: apart
      real(dp), dimension(size(self%w, 1), size(self%w, 1)) :: yields, w
      logical :: is_singular

      apart = self
      apart%base = force_of(self, 0.0_wp*self%free, self%free)
      call find_yield(self, yields)
      call dense_solve(transpose(yields), real(transpose(self%w), dp), w, is_singular)
      apart%w = real(transpose(w), wp)
   end subroutine let_go

   !> What y of the places as they are held leads to the forces of those that are not.
   subroutine take_back(self, push)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) [M L/T^2]
      real(dp) :: yields(size(push), size(push)), y(size(push), 1)
      logical :: is_singular

      call find_yield(self, yields)
      call dense_solve(yields, reshape(real(push, dp), [size(push), 1]), y, is_singular)
      push = reshape(real(y(:, 1), wp), shape(push))
   end subroutine take_back

   !> What forces gain by y: 1 - c W, and a little more so that it has an inverse.
   pure subroutine find_yield(self, yields)
      type(contact_problem_t), intent(in) :: self
      real(dp), intent(out) :: yields(:, :)
      integer :: i, k, m

      m = 1 + self%n_slip
      do i = 1, size(self%mu)
         do k = 0, self%n_slip
            associate (row => m*(i - 1) + 1 + k)
               yields(row, :) = -real(self%hold(k, i)*self%w(row, :), dp)
            end associate
         end do
      end do
      do k = 1, size(yields, 1)
         yields(k, k) = yields(k, k) + 1.0_dp + freely
      end do
   end subroutine find_yield

   !> Forces [M L/T^2].
   pure function force_of(self, push, motion) result(force)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: motion(0:, :)          !! (0:n_slip, n) it leads to [L]
      real(wp) :: force(0:self%n_slip, size(self%mu))

      force = self%base + push - self%hold*(motion - self%start)
   end function force_of

   !> The forces of y [M L/T^2].
   pure function contact_problem_force(self, push) result(force)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: force(0:self%n_slip, size(self%mu))

      force = force_of(self, push, motion_of(self, push))
   end function contact_problem_force

   !> Does each gap open when it is pushed?
   pure logical function has_compliance(self)
      type(contact_problem_t), intent(in) :: self
      integer :: i

      has_compliance = all([(self%w(1 + (i - 1)*(1 + self%n_slip), 1 + (i - 1)*(1 + self%n_slip)) &
         > 0.0_wp, i = 1, size(self%mu))])
   end function has_compliance

   !> The stiffness by which a miss of the law at contact `i` is a force [M/T^2].
   pure real(wp) function contact_problem_stiffness(self, i) result(stiffness)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n

      stiffness = max(self%stiffness(i), own_stiffness(self, i))
   end function contact_problem_stiffness

   !> How stiff contact `i` is by itself [M/T^2].
   pure real(wp) function own_stiffness(self, i) result(stiffness)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i
      integer :: k, m

      m = 1 + self%n_slip
      stiffness = m/max(sum([(abs(self%w(k, k)), k = m*(i - 1) + 1, m*i)]), tiny(stiffness))
   end function own_stiffness

   !> In which ways the law holds at the contacts.
   pure function contact_problem_status(self, push) result(status)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) of a solution [M L/T^2]
      type(slip_status_t) :: status(size(self%mu))
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: motion, force
      integer :: i

      motion = motion_of(self, push)
      force = force_of(self, push, motion)
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
   pure function motion_of(self, push) result(motion)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: motion(0:self%n_slip, size(self%mu))

      motion = self%free + reshape(matmul(self%w, reshape(push, [size(push)])), shape(push))
   end function motion_of

   !> How far the law is missed at its worst contact, over the largest force; 0: no force at all.
   pure real(wp) function contact_problem_missed(self, push) result(missed)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: defect(0:self%n_slip, size(self%mu))

      call natural_map(self, push, 0.0_wp, defect)
      missed = missed_by(self, push, defect)
      if (missed > 0.0_wp) missed = missed/max(maxval(abs(contact_problem_force(self, push))), &
         tiny(missed))
   end function contact_problem_missed

   !> The same of a natural map that is known, as a force [M L/T^2]. What W rounds is no miss: where
   !> bodies move nearly freely large motions cancel.
   pure real(wp) function missed_by(self, push, defect) result(missed)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: defect(0:, :)          !! (0:n_slip, n) [M L/T^2]
      real(wp) :: moved(0:self%n_slip, size(self%mu))
      integer :: i

      missed = 0.0_wp
      if (.not. maxval(abs(defect)) > 0.0_wp) return
      moved = abs(self%free) + reshape(matmul(abs(self%w), reshape(abs(push), [size(push)])), &
         shape(push))
      do i = 1, size(self%mu)
         missed = max(missed, maxval(abs(defect(:, i)) - rounded*moved(:, i) &
            *contact_problem_stiffness(self, i)))
      end do
   end function missed_by

   !> Forces less those that the natural map makes of them.
   pure subroutine natural_map(self, push, blur, defect, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: blur                   !! of the map, >= 0 [M L/T^2]
      real(wp), intent(out) :: defect(0:, :)         !! (0:n_slip, n) [M L/T^2]
      real(dp), intent(out), optional :: slope(:, :) !! of `defect` by y, proximal
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: motion, force
      real(wp) :: mapped(0:most_slips), by(0:most_slips, 0:most_slips), stiffness, &
         gain(0:self%n_slip, 0:self%n_slip)
      integer :: i, k, m

      m = 1 + self%n_slip
      motion = motion_of(self, push)
      force = force_of(self, push, motion)
      do i = 1, size(self%mu)
         stiffness = contact_problem_stiffness(self, i)
         call coulomb_map(trial_of(self, force(:, i), motion(:, i), i), self%mu(i), stiffness, &
            blur, mapped, by)
         defect(:, i) = force(:, i) - mapped(:self%n_slip)
         if (.not. present(slope)) cycle
         associate (row => m*(i - 1) + 1)
            do k = 0, self%n_slip
               gain(:, k) = (stiffness + self%hold(k, i))*by(:self%n_slip, k)
               gain(k, k) = gain(k, k) - self%hold(k, i)
            end do
            slope(row:m*i, :) = real(matmul(gain, self%w(row:m*i, :)), dp)
            do k = 0, self%n_slip
               slope(row:m*i, row + k) = slope(row:m*i, row + k) + real(by(:self%n_slip, k) &
                  *(stiffness*merge(loosely, proximal, self%n_slip > 1 &
                  .or. self%hold(k, i) > 0.0_wp) &
                  *self%w(row + k, row + k) - 1.0_wp), dp)
               slope(row + k, row + k) = slope(row + k, row + k) + 1.0_dp
            end do
         end associate
      end do
   end subroutine natural_map

   !> By Newton's method for the natural map. `push` stays as it was if that does not end. Where
   !> slip has a direction the second step in a row of which no part gains is the last one.
   subroutine solve_by_trials(self, push, most, n_trial, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most                    !! trials
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: trial, defect, new, step
      real(dp) :: slope(size(push), size(push)), x(size(push))
      real(wp) :: part, before, missed, largest
      integer :: i, halving, n_stall
      logical :: is_singular, was_solved

      trial = push
      is_solved = .false.
      n_stall = 0
      do i = 0, most
         was_solved = is_solved
         call natural_map(self, trial, 0.0_wp, defect, slope)
         missed = missed_by(self, trial, defect)
         largest = maxval(abs(contact_problem_force(self, trial)))
         is_solved = missed <= met*largest
         ! What is near is made exact: the first step to it leaves what W is stiffer by.
         if ((is_solved .and. (was_solved .or. .not. maxval(abs(defect)) > 0.0_wp)) &
            .or. i == most) exit
         n_trial = n_trial + 1
         call find_step(slope, reshape(real(-defect, dp), [size(push)]), x, is_singular)
         if (is_singular) exit
         step = reshape(real(x, wp), shape(step))
         before = norm2(defect)
         part = 1.0_wp
         do halving = 0, most_halvings
            new = trial + part*step
            call natural_map(self, new, 0.0_wp, defect)
            if (norm2(defect) <= (1.0_wp - least_gain*part)*before) exit
            part = 0.5_wp*part
         end do
         if (.not. norm2(defect) < huge(before)) exit
         n_stall = merge(0, n_stall + 1, part > no_part .or. self%n_slip < 2)
         if (n_stall == most_stalls) then
            is_solved = .false.
            exit
         end if
         trial = new
      end do
      if (is_solved) push = trial
   end subroutine solve_by_trials

   !> x of slope x = b. Rows of what neither pushes nor holds are those of the unit matrix: they are
   !> left out of the elimination.
   subroutine find_step(slope, b, x, is_singular)
      real(dp), intent(in) :: slope(:, :)            !! (n, n)
      real(dp), intent(in) :: b(:)                   !! (n)
      real(dp), intent(out) :: x(:)                  !! (n)
      logical, intent(out) :: is_singular            !! then x is nothing
      logical :: pushes(size(b))
      integer, allocatable :: row(:), other(:)
      real(dp), allocatable :: rest(:, :), step(:, :)
      integer :: j

      pushes = .false.
      do j = 1, size(b)
         pushes(:j - 1) = pushes(:j - 1) .or. abs(slope(:j - 1, j)) > 0.0_dp
         pushes(j + 1:) = pushes(j + 1:) .or. abs(slope(j + 1:, j)) > 0.0_dp
         pushes(j) = pushes(j) .or. abs(slope(j, j) - 1.0_dp) > 0.0_dp
      end do
      row = pack([(j, j = 1, size(b))], pushes)
      other = pack([(j, j = 1, size(b))], .not. pushes)
      x = b
      is_singular = .false.
      if (size(row) == 0) return
      rest = reshape(b(row), [size(row), 1])
      do j = 1, size(other)
         rest(:, 1) = rest(:, 1) - slope(row, other(j))*b(other(j))
      end do
      allocate(step(size(row), 1))
      call dense_solve(slope(row, row), rest, step, is_singular)
      x(row) = step(:, 1)
   end subroutine find_step

   !> By trials of places that give way by a part of their own W about the forces so far, over and
   !> over: forces that follow from others stay as near as can be to those before. The part grows
   !> where the trials do not end, and falls where they do; where near enough will do not to what
   !> they have failed at.
   subroutine solve_by_nearing(self, push, effort, near_enough, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(in) :: near_enough             !! a few nearings do
      logical, intent(out) :: is_solved
      type(contact_problem_t) :: near
      real(wp) :: found(0:self%n_slip, size(self%mu)), part, more, least_part
      integer :: i, k, row, round
      logical :: has_ended

      is_solved = .false.
      least_part = 0.0_wp
      near = self
      part = first_part
      do round = 1, most_nearings
         do i = 1, size(self%mu)
            do k = 0, self%n_slip
               row = (1 + self%n_slip)*(i - 1) + 1 + k
               more = part*abs(self%w(row, row))
               near%w(row, row) = self%w(row, row) + more
               near%free(k, i) = self%free(k, i) - more*push(k, i)
            end do
         end do
         found = push
         call solve_by_trials(near, found, more_trials, effort%n_trial, has_ended)
         if (has_ended) then
            effort%n_near = effort%n_near + 1
            push = found
            is_solved = contact_problem_missed(self, push) <= met
            if (is_solved .or. (near_enough .and. effort%n_near == few_nearings)) return
            part = max(least_part, 0.1_wp*part)
         else
            part = 10.0_wp*part
            if (near_enough) least_part = part
            if (part > largest_part) return
         end if
      end do
   end subroutine solve_by_nearing

   !> Along a path to the solution from far inside of what the laws allow: of forces that follow
   !> from others it leads to those farthest from limits, however far these are from those before.
   !> Trials would creep there, as none of their steps goes past the next limit.
   subroutine solve_by_path(self, push, first, n_step, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: first                  !! blur, by the largest force, > 0
      integer, intent(inout) :: n_step               !! counted on
      logical, intent(out) :: is_solved              !! else `push` is as it was
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: at, defect, new
      real(dp) :: slope(size(push), size(push)), x(size(push))
      real(wp) :: blur, before, part
      integer :: i, halving, n_stall
      logical :: is_singular

      is_solved = .false.
      at = push
      n_stall = 0
      call natural_map(self, push, 0.0_wp, defect)
      blur = first*max(maxval(abs(contact_problem_force(self, push))), maxval(abs(defect)))
      do i = 1, most_path
         call natural_map(self, at, blur, defect, slope)
         n_step = n_step + 1
         call find_step(slope, reshape(real(-defect, dp), [size(push)]), x, is_singular)
         if (is_singular) exit
         before = norm2(defect)
         part = 1.0_wp
         do halving = 0, most_halvings
            new = at + part*reshape(real(x, wp), shape(at))
            call natural_map(self, new, blur, defect)
            if (norm2(defect) <= (1.0_wp - path_gain*part)*before) exit
            part = 0.5_wp*part
         end do
         if (.not. norm2(defect) < huge(before)) exit
         at = new
         n_stall = merge(0, n_stall + 1, part > path_part)
         if (n_stall == path_stalls) exit
         if (maxval(abs(defect)) > on_path*blur) cycle
         is_solved = contact_problem_missed(self, at) <= met
         if (is_solved) exit
         blur = next_blur*blur
         if (.not. blur > tiny(blur)) exit
      end do
      if (is_solved) push = at
   end subroutine solve_by_path

   !> Contact by contact, each exactly with the pushes of the others, over and over.
   subroutine solve_by_sweeps(self, push, most, n_sweep, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most                    !! sweeps
      integer, intent(inout) :: n_sweep              !! counted on
      logical, intent(out) :: is_solved
      type(single_contact_t) :: place
      real(wp) :: new(0:most_slips), motion(0:self%n_slip, size(self%mu))
      real(wp), dimension(0:self%n_slip) :: force, change
      real(dp) :: yields(0:self%n_slip, 0:self%n_slip, size(self%mu))    ! y by forces
      real(wp) :: endless                            ! forces that grow from sweep to sweep
      integer :: i, m, sweep

      m = 1 + self%n_slip
      place%n_slip = self%n_slip
      call find_yields(self, yields)
      endless = maxval([(own_stiffness(self, i), i = 1, size(self%mu))]) &
         *maxval(abs(self%free))/epsilon(endless)**2
      is_solved = .false.
      do sweep = 1, most
         n_sweep = n_sweep + 1
         motion = motion_of(self, push)
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
               place%stiffness = own_stiffness(self, i)
               new = single_contact_solve(place)
               change = matmul(real(yields(:, :, i), wp), new(:self%n_slip) - force)
               push(:, i) = push(:, i) + change
               call add_motion(w, change, motion)
            end associate
         end do
         is_solved = contact_problem_missed(self, push) <= met
         if (is_solved .or. maxval(abs(push)) > endless) exit
      end do
   end subroutine solve_by_sweeps

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

   !> Without friction and where nothing is held: the least motion that closes no gap. Contacts that
   !> follow from others, as in stacks of aligned bodies, cost no more than others.
   subroutine solve_by_pushes(self, push, n_pivot, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(out) :: n_pivot                !! pushes that came or went
      logical, intent(out) :: is_solved              !! else `push` is as it was
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: free, found

      free = motion_of(self, -self%base)
      found = -self%base
      found(0, :) = self%base(0, :) + push(0, :)
      associate (of_gap => self%w(1::1 + self%n_slip, 1::1 + self%n_slip))
         call push_problem_solve(of_gap, free(0, :), found(0, :), is_solved, n_pivot)
      end associate
      if (.not. is_solved) return
      push = found
      push(0, :) = push(0, :) - self%base(0, :)
   end subroutine solve_by_pushes

   !> In the plane, by complementary pivoting over (lam, tau+, tau-, gamma+, gamma-): with slip
   !> counted towards a, 0 <= tau+ <= mu lam pushes back what is at a or past it, and
   !> 0 <= tau- <= mu lam what is at 0 or before it; tau = tau+ - tau-, gamma is how far past.
   subroutine contact_problem_pivot(self, push, n_pivot, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:1, n) y [M L/T^2]
      integer, intent(out) :: n_pivot                !! pivots that were taken
      logical, intent(out) :: is_solved              !! else `push` is as it was
      real(wp), dimension(5*size(self%mu), 5*size(self%mu)) :: m
      real(wp), dimension(5*size(self%mu)) :: q, z
      real(wp), dimension(size(self%mu), size(self%mu)) :: w_nt, w_tn, w_tt
      real(wp) :: unit, length, free(0:1, size(self%mu)), sense(size(self%mu))
      integer :: i, n

      n = size(self%mu)
      ! Forces by the largest stiffness, so that all entries are of one size.
      length = maxval(abs(self%w))
      free = motion_of(self, -self%base)
      unit = max(maxval(abs(free)), maxval(abs(self%slip_target)), tiny(unit))
      sense = sign(1.0_wp, self%slip_target(1, :))
      w_nt = self%w(1::2, 2::2)/length*spread(sense, 1, n)
      w_tn = self%w(2::2, 1::2)/length*spread(sense, 2, n)
      w_tt = self%w(2::2, 2::2)/length*spread(sense, 1, n)*spread(sense, 2, n)
      m = 0.0_wp
      m(:n, :3*n) = reshape([self%w(1::2, 1::2)/length, w_nt, -w_nt], [n, 3*n])
      m(n + 1:2*n, :3*n) = reshape([w_tn, w_tt, -w_tt], [n, 3*n])
      m(2*n + 1:3*n, :3*n) = -m(n + 1:2*n, :3*n)
      do i = 1, n
         m(n + i, 3*n + i) = 1.0_wp
         m(2*n + i, 4*n + i) = 1.0_wp
         m([3*n + i, 4*n + i], i) = self%mu(i)
         m(3*n + i, n + i) = -1.0_wp
         m(4*n + i, 2*n + i) = -1.0_wp
      end do
      q = 0.0_wp
      q(:3*n) = [free(0, :), abs(self%slip_target(1, :)) + sense*free(1, :), -sense*free(1, :)]/unit
      call lemke_solve(m, q, z, is_solved, n_pivot)
      if (.not. is_solved) return
      z = (unit/length)*z
      push(0, :) = z(:n) - self%base(0, :)
      push(1, :) = sense*(z(n + 1:2*n) - z(2*n + 1:3*n)) - self%base(1, :)
   end subroutine contact_problem_pivot

end module emcon_contact_problem
