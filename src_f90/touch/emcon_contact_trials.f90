!> Solutions of a problem of contacts by Newton's method for its natural map: all places at once.
!>
!> From the forces so far, or near them, where places give way by a part of their own W.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_trials
   use emcon_contact_problem, only : contact_effort_t, contact_problem_force, contact_problem_map, &
      contact_problem_missed, contact_problem_missed_by, contact_problem_t, met
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   implicit none
   private
   public :: contact_trials, contact_nearing

   !> Trials of a nearing.
   integer, parameter :: near_trials = 20
   !> Parts of W that places give way by about the forces so far, and how often.
   integer, parameter :: most_nearings = 30, few_nearings = 8
   real(wp), parameter :: first_part = 1.0e-3_wp, largest_part = 10.0_wp
   !> Halvings of a step of Newton's method, and the part of what is foreseen that it is to gain.
   integer, parameter :: most_halvings = 12
   real(wp), parameter :: least_gain = 1.0e-4_wp
   !> Where slip has a direction steps of which at most this part gains are so many in a row.
   integer, parameter :: most_stalls = 2
   real(wp), parameter :: no_part = 1.0e-3_wp

contains

   !> By Newton's method for the natural map. `push` stays as it was if that does not end. Where
   !> slip has a direction the second step in a row of which no part gains is the last one.
   subroutine contact_trials(self, push, most, n_trial, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most                    !! trials
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved           !! the law is met
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
         call contact_problem_map(self, trial, defect, slope)
         missed = contact_problem_missed_by(self, trial, defect)
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
            call contact_problem_map(self, new, defect)
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
   end subroutine contact_trials

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
   subroutine contact_nearing(self, push, effort, near_enough, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(in) :: near_enough             !! a few nearings do
      logical, intent(out) :: is_solved           !! the law is met
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
         call contact_trials(near, found, near_trials, effort%n_trial, has_ended)
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
   end subroutine contact_nearing

end module emcon_contact_trials
