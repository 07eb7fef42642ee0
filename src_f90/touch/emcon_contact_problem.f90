! build: streams
!> Places of contact whose gaps and slips are linear in their forces: the law at all of them.
!>
!> With y, by which all of them push, [g; -s] = free + W y and [lam; tau] = base + y - c ([g; -s] -
!> start), contact by contact, with Coulomb's law at each; c is 0, or what the surfaces were held by
!> as W was found where nothing else holds bodies. Where W is positive definite there is a solution
!> for any coefficient. Source: docs/theory.md, eq. (14i).
module emcon_contact_problem
   use emcon_constraint, only : most_slips
   use emcon_coulomb_law, only : contact_trial_t, coulomb_map, coulomb_status, slip_status_t
   use emcon_kinds, only : dp, wp
   implicit none
   private
   public :: contact_problem_t, contact_effort_t, contact_problem_create, contact_problem_force, &
      contact_problem_forces, contact_problem_motion, contact_problem_map, contact_problem_missed, &
      contact_problem_missed_by, contact_problem_slope, contact_problem_status, &
      contact_problem_stiffness, contact_problem_own_stiffness, contact_problem_row_sizes, &
      contact_problem_weigh

   !> The law is met where it is missed by less than this part of the largest force: by what a solve
   !> in double precision leaves of some hundred forces. Where no turn comes to that W is nearly
   !> singular, and what moves nothing may be missed by more.
   real(wp), parameter, public :: met = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), &
      nearly_met = 50.0_wp*met
   !> What gives way with nothing but contact to hold it does so by this part of c.
   real(dp), parameter, public :: freely = sqrt(epsilon(1.0_dp))
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
      !> W is that of places which give way by a part of themselves: it is not singular
      logical :: gives_way = .false.
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

   !> Forces [M L/T^2].
   pure function contact_problem_forces(self, push, motion) result(force)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: motion(0:, :)          !! (0:n_slip, n) it leads to [L]
      real(wp) :: force(0:self%n_slip, size(self%mu))

      force = self%base + push - self%hold*(motion - self%start)
   end function contact_problem_forces

   !> The forces of y [M L/T^2].
   pure function contact_problem_force(self, push) result(force)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: force(0:self%n_slip, size(self%mu))

      force = contact_problem_forces(self, push, contact_problem_motion(self, push))
   end function contact_problem_force

   !> Gaps, and slips the other way round [L].
   pure function contact_problem_motion(self, push) result(motion)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: motion(0:self%n_slip, size(self%mu))

      motion = 0.0_wp
      call add_product(self%w, push, size(push), motion)
      motion = self%free + motion
   end function contact_problem_motion

   !> Add A x, column by column.
   pure subroutine add_product(a, x, n, sum)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, n), x(n)
      real(wp), intent(inout) :: sum(n)
      integer :: j

      do j = 1, n
         sum = sum + a(:, j)*x(j)
      end do
   end subroutine add_product

   !> Add |A| |x|, column by column.
   pure subroutine add_sizes(a, x, n, sum)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, n), x(n)
      real(wp), intent(inout) :: sum(n)
      integer :: j

      do j = 1, n
         sum = sum + abs(a(:, j))*abs(x(j))
      end do
   end subroutine add_sizes

   !> What W may round: the sum of sizes of its rows [T^2/M].
   pure function contact_problem_row_sizes(self) result(row_size)
      type(contact_problem_t), intent(in) :: self
      real(wp) :: row_size(0:self%n_slip, size(self%mu))
      integer :: i

      row_size = 0.0_wp
      call add_sizes(self%w, [(1.0_wp, i = 1, size(self%w, 2))], size(row_size), row_size)
   end function contact_problem_row_sizes

   !> The stiffness by which a miss of the law at contact `i` is a force [M/T^2].
   pure real(wp) function contact_problem_stiffness(self, i) result(stiffness)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n

      stiffness = max(self%stiffness(i), contact_problem_own_stiffness(self, i))
   end function contact_problem_stiffness

   !> How stiff contact `i` is by itself [M/T^2].
   pure real(wp) function contact_problem_own_stiffness(self, i) result(stiffness)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n
      integer :: k, m

      m = 1 + self%n_slip
      stiffness = m/max(sum([(abs(self%w(k, k)), k = m*(i - 1) + 1, m*i)]), tiny(stiffness))
   end function contact_problem_own_stiffness

   !> In which ways the law holds at the contacts.
   pure function contact_problem_status(self, push) result(status)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) of a solution [M L/T^2]
      type(slip_status_t) :: status(size(self%mu))
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: motion, force
      integer :: i

      motion = contact_problem_motion(self, push)
      force = contact_problem_forces(self, push, motion)
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

   !> How far the law is missed at its worst contact, over the largest force; 0: no force at all.
   pure real(wp) function contact_problem_missed(self, push) result(missed)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp) :: defect(0:self%n_slip, size(self%mu))

      call contact_problem_map(self, push, defect)
      missed = contact_problem_missed_by(self, push, defect)
      if (missed > 0.0_wp) missed = missed/max(maxval(abs(contact_problem_force(self, push))), &
         epsilon(missed)*missed)
   end function contact_problem_missed

   !> The same of a natural map that is known, as a force [M L/T^2]. What W rounds is no miss: where
   !> bodies move nearly freely large motions cancel.
   pure real(wp) function contact_problem_missed_by(self, push, defect, row_size) result(missed)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(in) :: defect(0:, :)          !! (0:n_slip, n) [M L/T^2]
      !> (0:n_slip, n) of `contact_problem_row_sizes`: as little as it can be, by the largest y
      real(wp), intent(in), optional :: row_size(0:, :)
      real(wp) :: moved(0:self%n_slip, size(self%mu))
      integer :: i

      missed = 0.0_wp
      if (.not. maxval(abs(defect)) > 0.0_wp) return
      moved = abs(self%free)
      if (present(row_size)) then
         moved = moved + maxval(abs(push))*row_size
      else
         call add_sizes(self%w, push, size(push), moved)
      end if
      do i = 1, size(self%mu)
         missed = max(missed, maxval(abs(defect(:, i)) - rounded*moved(:, i) &
            *contact_problem_stiffness(self, i)))
      end do
   end function contact_problem_missed_by

   !> Forces less those that the natural map makes of them.
   pure subroutine contact_problem_map(self, push, defect, by, largest)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)            !! (0:n_slip, n) y [M L/T^2]
      real(wp), intent(out) :: defect(0:, :)         !! (0:n_slip, n) [M L/T^2]
      !> (0:n_slip, 0:n_slip, n) what the law makes of trials grows by these: row, by
      real(wp), intent(out), optional :: by(0:, 0:, :)
      real(wp), intent(out), optional :: largest     !! force [M L/T^2]
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: motion, force
      real(wp) :: mapped(0:most_slips), grows(0:most_slips, 0:most_slips)
      integer :: i

      motion = contact_problem_motion(self, push)
      force = contact_problem_forces(self, push, motion)
      do i = 1, size(self%mu)
         call coulomb_map(trial_of(self, force(:, i), motion(:, i), i), self%mu(i), &
            contact_problem_stiffness(self, i), mapped, grows)
         defect(:, i) = force(:, i) - mapped(:self%n_slip)
         if (present(by)) by(:, :, i) = grows(:self%n_slip, :self%n_slip)
      end do
      if (present(largest)) largest = maxval(abs(force))
   end subroutine contact_problem_map

   !> What the natural map grows by with y, proximal: of W, c, stiffness and `by` alone.
   pure subroutine contact_problem_slope(self, by, slope)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: by(0:, 0:, :)          !! as of `contact_problem_map`
      real(dp), intent(out) :: slope(:, :)           !! of `defect` by y, as W
      real(wp) :: gain(0:self%n_slip, 0:self%n_slip, size(self%mu))
      real(wp), dimension(size(self%mu)) :: stiffness
      integer :: i, k, m

      m = 1 + self%n_slip
      do i = 1, size(self%mu)
         stiffness(i) = contact_problem_stiffness(self, i)
         do k = 0, self%n_slip
            gain(:, k, i) = (stiffness(i) + self%hold(k, i))*by(:, k, i)
            gain(k, k, i) = gain(k, k, i) - self%hold(k, i)
         end do
      end do
      call contact_problem_weigh(self, gain, slope)
      do i = 1, size(self%mu)
         associate (row => m*(i - 1) + 1)
            do k = 0, self%n_slip
               slope(row:m*i, row + k) = slope(row:m*i, row + k) + real(by(:, k, i) &
                  *(stiffness(i)*proximal_part(self, i, k) &
                  *give_of(self, i, k, stiffness(i)) - 1.0_wp), dp)
               slope(row + k, row + k) = slope(row + k, row + k) + 1.0_dp
            end do
         end associate
      end do
   end subroutine contact_problem_slope

   !> Weighted sums of the rows of W of each contact. Row by row of W, which lie side by side: a sum
   !> takes rows before and after its own.
   pure subroutine contact_problem_weigh(self, weight, sum)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: weight(0:, 0:, :)      !! (0:n_slip, 0:n_slip, n) sum, of row
      real(dp), intent(out) :: sum(:, :)             !! as W
      real(wp) :: by(size(self%w, 1), -most_slips:most_slips), own(size(self%w, 1))
      integer :: first, last, i, j, k, n, row, shift

      n = size(self%w, 1)
      by = 0.0_wp
      do i = 1, size(weight, 3)
         do k = 0, self%n_slip
            row = (1 + self%n_slip)*(i - 1) + 1 + k
            by(row, -k:self%n_slip - k) = weight(k, :, i)
         end do
      end do
      do j = 1, n
         own = 0.0_wp
         do shift = -self%n_slip, self%n_slip
            first = max(1, 1 - shift)
            last = min(n, n - shift)
            own(first:last) = own(first:last) + by(first:last, shift) &
               *self%w(first + shift:last + shift, j)
         end do
         sum(:, j) = real(own, dp)
      end do
   end subroutine contact_problem_weigh

   !> By which part of its W row `k` of contact `i` is stiffer in a step.
   pure real(wp) function proximal_part(self, i, k) result(part)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n
      integer, intent(in) :: k                       !! 0, its gap; 1 to n_slip

      part = proximal
      if (.not. self%gives_way .and. (self%n_slip > 1 .or. self%hold(k, i) > 0.0_wp)) &
         part = loosely
   end function proximal_part

   !> What row `k` of contact `i` gives way by its own force [T^2/M]. A slip that no force changes,
   !> as one across a plane of symmetry, is taken to give way as its contact: its force stays where
   !> it was as long as it does not slip.
   pure real(wp) function give_of(self, i, k, stiffness) result(give)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i                       !! 1 to n
      integer, intent(in) :: k                       !! 0, its gap; 1 to n_slip
      real(wp), intent(in) :: stiffness              !! of the contact [M/T^2]

      associate (row => (1 + self%n_slip)*(i - 1) + 1 + k)
         give = self%w(row, row)
      end associate
      if (k > 0 .and. .not. abs(give) > 0.0_wp) give = 1.0_wp/stiffness
   end function give_of

end module emcon_contact_problem
