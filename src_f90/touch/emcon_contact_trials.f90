!> Solutions of a problem of contacts by Newton's method for its natural map: all places at once.
!>
!> From the forces so far, or near them, where places give way by a part of their own W.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_trials
   use emcon_contact_problem, only : contact_effort_t, contact_problem_map, &
      contact_problem_missed, contact_problem_missed_by, contact_problem_row_sizes, &
      contact_problem_slope, contact_problem_t, met
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_lu, dense_lu_solve, dense_lu_t
   implicit none
   private
   public :: contact_slope_t, contact_trials, contact_following, contact_nearing, contact_travelling

   !> Trials of a nearing.
   integer, parameter :: near_trials = 20
   !> Parts of W that places give way by about the forces so far, and how often.
   integer, parameter :: most_nearings = 30, few_nearings = 8
   real(wp), parameter :: first_part = 1.0e-3_wp, largest_part = 10.0_wp, less = 0.1_wp
   !> As parts fall by so much, and by as much more each time that so few trials do: trials of each,
   !> and the least part that is not none.
   integer, parameter :: following_trials = 60, easy_trials = 5
   real(wp), parameter :: least_part = 1.0e-12_wp
   !> Of a travel: by which power what a part falls by grows after few steps, and the most of it;
   !> where it falls by no more than `bends` the way does. Steps of each part, and bends.
   real(wp), parameter :: grows = 1.5_wp, most_less = 1.0e-2_wp, bends = 0.9_wp
   integer, parameter :: few_steps = 4, most_steps = 12, most_bends = 100
   !> Forces that have grown by this have no end.
   real(wp), parameter :: endless = 1.0_wp/epsilon(1.0_wp)
   !> Halvings of a step of Newton's method, and the part of what is foreseen that it is to gain.
   integer, parameter :: most_halvings = 12
   real(wp), parameter :: least_gain = 1.0e-4_wp
   !> Where slip has a direction steps of which at most this part gains are so many in a row.
   integer, parameter :: most_stalls = 2
   real(wp), parameter :: no_part = 1.0e-3_wp
   !> A step by what the map grew by at another trial is to leave no more than this part.
   real(wp), parameter :: gain_again = 0.1_wp

   !> What the map grows by at a trial, factorised.
   type :: contact_slope_t
      !> It was made of the W, c and stiffness of the problem to come
      logical :: stays = .false.
      logical, private :: is_known = .false.
      real(wp), allocatable, private :: by(:, :, :)  !! of `contact_problem_map` it was made of
      logical, allocatable, private :: pushes(:)     !! (rows) of a place that pushes or holds
      integer, allocatable, private :: row(:)        !! numbers of these
      real(dp), allocatable, private :: by_other(:, :)   !! (these, others)
      type(dense_lu_t), private :: lu                !! of these
   end type contact_slope_t

contains

   !> By Newton's method for the natural map. `push` stays as it was if that does not end. Where
   !> slip has a direction the second step in a row of which no part gains is the last one, and what
   !> the map grows by is taken from a step before as long as that gains enough.
   subroutine contact_trials(self, push, most, n_trial, is_solved, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most                    !! trials
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved              !! the law is met
      !> Of a problem that is near this one, or of none; out: of this one
      type(contact_slope_t), intent(inout), optional :: slope
      type(contact_slope_t) :: own

      if (present(slope)) then
         call try(self, push, most, n_trial, is_solved, slope)
      else
         call try(self, push, most, n_trial, is_solved, own)
      end if
   end subroutine contact_trials

   subroutine try(self, push, most, n_trial, is_solved, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(in) :: most
      integer, intent(inout) :: n_trial
      logical, intent(out) :: is_solved
      type(contact_slope_t), intent(inout) :: slope
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: trial, defect, new, step
      real(wp) :: part, before, largest, row_size(0:self%n_slip, size(self%mu)), &
         by(0:self%n_slip, 0:self%n_slip, size(self%mu))
      integer :: i, halving, n_stall
      logical :: is_singular, was_solved, gains

      trial = push
      is_solved = .false.
      n_stall = 0
      row_size = contact_problem_row_sizes(self)
      call contact_problem_map(self, trial, defect, by, largest)
      do i = 0, most
         was_solved = is_solved
         is_solved = is_met(self, trial, defect, row_size, largest)
         ! What is near is made exact: the first step to it leaves what W is stiffer by.
         if ((is_solved .and. (was_solved .or. .not. maxval(abs(defect)) > 0.0_wp)) &
            .or. i == most) exit
         n_trial = n_trial + 1
         call step_again(self, slope, trial, defect, by, largest, gains)
         if (gains) cycle
         call find_step(self, by, defect, slope, step, is_singular)
         if (is_singular) exit
         before = norm2(defect)
         part = 1.0_wp
         do halving = 0, most_halvings
            new = trial + part*step
            call contact_problem_map(self, new, defect, by, largest)
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
   end subroutine try

   !> Is the law met? Most trials are so far from it that no sum of W tells otherwise.
   pure logical function is_met(self, trial, defect, row_size, largest)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: trial(0:, :), defect(0:, :)    !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(in) :: row_size(0:, :)        !! (0:n_slip, n) [T^2/M]
      real(wp), intent(in) :: largest                !! force [M L/T^2]

      is_met = contact_problem_missed_by(self, trial, defect, row_size) <= met*largest
      if (is_met) is_met = contact_problem_missed_by(self, trial, defect) <= met*largest
   end function is_met

   !> A step by what the map grew by at another trial. It is taken only if it gains.
   subroutine step_again(self, slope, trial, defect, by, largest, gains)
      type(contact_problem_t), intent(in) :: self
      type(contact_slope_t), intent(in) :: slope
      real(wp), intent(inout) :: trial(0:, :)        !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(inout) :: defect(0:, :)       !! (0:n_slip, n) its map [M L/T^2]
      real(wp), intent(inout) :: by(0:, 0:, :)       !! as of `contact_problem_map`
      real(wp), intent(inout) :: largest             !! force there [M L/T^2]
      logical, intent(out) :: gains
      real(wp) :: largest_new, by_new(0:self%n_slip, 0:self%n_slip, size(self%mu))
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: new, left
      real(dp) :: x(size(trial))

      gains = .false.
      if (self%n_slip < 2 .or. .not. slope%is_known) return
      if (size(slope%pushes) /= size(trial)) return
      call solve_step(slope, reshape(real(-defect, dp), [size(trial)]), x)
      new = trial + reshape(real(x, wp), shape(trial))
      call contact_problem_map(self, new, left, by_new, largest_new)
      gains = norm2(left) <= gain_again*norm2(defect)
      if (.not. gains) return
      trial = new
      defect = left
      by = by_new
      largest = largest_new
   end subroutine step_again

   !> The step of Newton's method, by the slope there is if that is of the same places pushing.
   subroutine find_step(self, by, defect, slope, step, is_singular)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: by(0:, 0:, :)          !! as of `contact_problem_map`
      real(wp), intent(in) :: defect(0:, :)          !! (0:n_slip, n) [M L/T^2]
      type(contact_slope_t), intent(inout) :: slope
      real(wp), intent(out) :: step(0:, :)           !! (0:n_slip, n) [M L/T^2]
      logical, intent(out) :: is_singular            !! then there is none
      real(dp) :: x(size(defect))
      logical :: does

      does = slope%stays .and. slope%is_known
      if (does) does = all(shape(by) == shape(slope%by))
      if (does) does = .not. any(abs(by - slope%by) > 0.0_wp)
      if (.not. does) call find_slope(self, by, slope)
      is_singular = .not. slope%is_known
      step = 0.0_wp
      if (is_singular) return
      call solve_step(slope, reshape(real(-defect, dp), [size(x)]), x)
      step = reshape(real(x, wp), shape(step))
   end subroutine find_step

   !> What the map grows by. Rows of what neither pushes nor holds are those of the unit matrix:
   !> they are left out of the elimination.
   subroutine find_slope(self, by, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: by(0:, 0:, :)          !! as of `contact_problem_map`
      type(contact_slope_t), intent(inout) :: slope  !! not known: it is singular
      real(dp), allocatable :: full(:, :)
      logical :: pushes(size(self%w, 1)), is_singular
      integer :: j

      allocate(full(size(pushes), size(pushes)))
      call contact_problem_slope(self, by, full)
      pushes = reshape(any(abs(by) > 0.0_wp, 2) .or. abs(self%hold) > 0.0_wp, shape(pushes))
      slope%pushes = pushes
      slope%row = pack([(j, j = 1, size(pushes))], pushes)
      slope%by_other = full(slope%row, pack([(j, j = 1, size(pushes))], .not. pushes))
      call dense_lu(full(slope%row, slope%row), slope%lu, is_singular)
      slope%is_known = .not. is_singular
      slope%stays = slope%is_known
      slope%by = by
   end subroutine find_slope

   !> x of slope x = b.
   subroutine solve_step(slope, b, x)
      type(contact_slope_t), intent(in) :: slope
      real(dp), intent(in) :: b(:)                   !! (n)
      real(dp), intent(out) :: x(:)                  !! (n)
      real(dp) :: rest(size(slope%row)), of_other(size(slope%by_other, 2))
      integer :: j

      x = b
      of_other = pack(b, .not. slope%pushes)
      rest = b(slope%row)
      do j = 1, size(of_other)
         rest = rest - slope%by_other(:, j)*of_other(j)
      end do
      call dense_lu_solve(slope%lu, rest)
      x(slope%row) = rest
   end subroutine solve_step

   !> By trials of places that give way by a part of their own W about the forces at the start, ever
   !> less of it, from where the trials before have ended: of forces that follow from others those
   !> are found that are near the start, and ever nearer to what the law asks of them. `push` stays
   !> as it was if nothing is found; else it obeys the law, or that with the last part.
   subroutine contact_following(self, push, effort, is_solved, is_near)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(out) :: is_solved              !! the law is met
      logical, intent(out) :: is_near                !! or that with some part
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: start, trial
      real(wp) :: part, next, shrink
      integer :: n_before
      logical :: has_ended

      start = push
      part = first_part
      shrink = less
      is_solved = .false.
      do
         trial = start
         call try_softly(self, start, part, trial, near_trials, effort%n_trial, is_near)
         if (is_near) exit
         part = part/less
         if (part > largest_part) return
      end do
      do
         push = trial
         effort%n_near = effort%n_near + 1
         is_solved = contact_problem_missed(self, push) <= met
         if (is_solved .or. .not. part > 0.0_wp) return
         next = shrink*part
         if (next < least_part) next = 0.0_wp
         n_before = effort%n_trial
         call try_softly(self, start, next, trial, following_trials, effort%n_trial, has_ended)
         if (.not. has_ended) return
         part = next
         shrink = merge(shrink*less, less, effort%n_trial - n_before <= easy_trials)
      end do
   end subroutine contact_following

   !> To forces that obey the law, however far those that follow from others have to go: along
   !> solutions of places that give way by ever less about the forces at the start, and where their
   !> way bends back from there anew. Where bodies have more contacts than ways to move these are
   !> not closed all at once: gaps that miss each other by round-off trade all of their forces.
   !> `push` is as far as it came.
   subroutine contact_travelling(self, push, effort, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(out) :: is_solved              !! the law is met
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: start, defect
      real(wp) :: largest
      integer :: bend

      call contact_problem_map(self, push, defect, largest=largest)
      largest = max(largest, maxval(abs(defect)))
      do bend = 1, most_bends
         start = push
         call travel(self, endless*largest, start, push, effort, is_solved)
         if (is_solved .or. .not. maxval(abs(push - start)) > 0.0_wp) return
      end do
   end subroutine contact_travelling

   !> As far as the way from `start` leads.
   subroutine travel(self, limit, start, push, effort, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: limit                  !! of forces [M L/T^2]
      real(wp), intent(in) :: start(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(out) :: is_solved              !! the law is met
      type(contact_problem_t) :: soft
      real(wp) :: part, shrink, trial(0:self%n_slip, size(self%mu))
      integer :: n_step
      logical :: has_ended, has_begun

      is_solved = .false.
      has_begun = .false.
      part = first_part
      shrink = less
      do
         trial = push
         call soften(self, start, part, soft)
         call step_freely(soft, limit, trial, n_step, has_ended)
         effort%n_trial = effort%n_trial + n_step
         if (has_ended) then
            has_begun = .true.
            effort%n_near = effort%n_near + 1
            push = trial
            is_solved = contact_problem_missed(self, push) <= met
            if (is_solved .or. part < least_part) return
            if (n_step <= few_steps) shrink = max(shrink**grows, most_less)
            part = shrink*part
         else if (has_begun) then
            part = part/shrink
            shrink = sqrt(shrink)
            if (shrink > bends) return
            part = shrink*part
         else
            part = part/less
            if (part > largest_part) return
         end if
      end do
   end subroutine travel

   !> Whole steps of Newton's method: over the limits of friction, which are round, a way that is to
   !> gain at once leads nowhere.
   subroutine step_freely(self, limit, push, n_step, has_ended)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: limit                  !! of forces [M L/T^2]
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(out) :: n_step
      logical, intent(out) :: has_ended              !! the law is met
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: defect, step
      real(wp) :: largest, row_size(0:self%n_slip, size(self%mu)), &
         by(0:self%n_slip, 0:self%n_slip, size(self%mu))
      type(contact_slope_t) :: slope
      logical :: is_singular

      row_size = contact_problem_row_sizes(self)
      do n_step = 0, most_steps
         call contact_problem_map(self, push, defect, by, largest)
         has_ended = is_met(self, push, defect, row_size, largest)
         if (has_ended .or. n_step == most_steps .or. .not. largest < limit) exit
         call find_step(self, by, defect, slope, step, is_singular)
         if (is_singular) exit
         push = push + step
      end do
   end subroutine step_freely

   !> Trials of places that give way by a part of their own W about `start`.
   subroutine try_softly(self, start, part, push, most, n_trial, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: start(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(in) :: part                   !! >= 0
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) as of `contact_trials`
      integer, intent(in) :: most
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved
      type(contact_problem_t) :: soft

      call soften(self, start, part, soft)
      call contact_trials(soft, push, most, n_trial, is_solved)
   end subroutine try_softly

   !> Places that give way by a part of their own W about `start`.
   pure subroutine soften(self, start, part, soft)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: start(0:, :)           !! (0:n_slip, n) [M L/T^2]
      real(wp), intent(in) :: part                   !! >= 0
      type(contact_problem_t), intent(out) :: soft
      real(wp) :: more
      integer :: i, k, row

      soft = self
      soft%gives_way = part > 0.0_wp
      do i = 1, size(self%mu)
         do k = 0, self%n_slip
            row = (1 + self%n_slip)*(i - 1) + 1 + k
            more = part*abs(self%w(row, row))
            soft%w(row, row) = self%w(row, row) + more
            soft%free(k, i) = self%free(k, i) - more*start(k, i)
         end do
      end do
   end subroutine soften

   !> By trials of places that give way by a part of their own W about the forces so far, a few
   !> times over: forces that follow from others stay as near as can be to those before. The part
   !> grows to what the trials end with, and falls no more below what they have failed at.
   subroutine contact_nearing(self, push, effort, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(out) :: is_solved           !! the law is met
      real(wp) :: found(0:self%n_slip, size(self%mu)), part, least
      integer :: round
      logical :: has_ended

      is_solved = .false.
      least = 0.0_wp
      part = first_part
      do round = 1, most_nearings
         found = push
         call try_softly(self, push, part, found, near_trials, effort%n_trial, has_ended)
         if (has_ended) then
            effort%n_near = effort%n_near + 1
            push = found
            is_solved = contact_problem_missed(self, push) <= met
            if (is_solved .or. effort%n_near == few_nearings) return
            part = max(least, less*part)
         else
            part = part/less
            least = part
            if (part > largest_part) return
         end if
      end do
   end subroutine contact_nearing

end module emcon_contact_trials
