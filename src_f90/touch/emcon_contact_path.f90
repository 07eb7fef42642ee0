!> Solutions of a problem of contacts along the central path, as primal-dual interior methods go.
!>
!> Forces are kept inside of what the law allows: lam > 0, |tau| < mu lam. Gaps g, speeds sigma and
!> the room rho = mu lam - tau^2/(mu lam) that friction has are unknowns of their own, with products
!> that are to be e^2 on the path and 0 at its end: c g lam, sigma rho/(2 mu^2), where c slip
!> = sigma tau/(mu lam). As a contact opens sigma tends to the size of c slip. A slip a that is led
!> to adds theta c a with 0 < theta < 1 and tau.a/|a| = over - under, where over (1 - theta) c |a|
!> and under theta c |a| are e^2. Of forces that follow from others the path leads to those farthest
!> from limits, however far these are from those before.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_path
   use emcon_contact_problem, only : contact_problem_forces, contact_problem_map, &
      contact_problem_missed, contact_problem_motion, contact_problem_stiffness, &
      contact_problem_t, contact_problem_weigh, met
   use emcon_contact_trials, only : contact_trials
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   implicit none
   private
   public :: contact_path

   !> Steps of a path; of steps that are all but nothing so many are the last ones.
   integer, parameter :: most_steps = 80, most_stalls = 3
   real(wp), parameter :: no_step = 1.0e-4_wp
   !> Farther than so many steps no limit is looked for; a force that has grown by this has no end.
   real(wp), parameter :: far = 2.0_wp, endless = 1.0_wp/epsilon(1.0_wp)
   !> Of the way to the next limit this part is gone. The products that are aimed at next are those
   !> before times the cube of what a step to the end leaves, within these bounds.
   real(wp), parameter :: inside = 0.95_wp, least_aim = 1.0e-6_wp, most_aim = 0.9_wp
   !> Where the products have come to this part of the largest force squared trials may end the
   !> path, and again each time that they fall by this.
   real(wp), parameter :: is_late = 1.0e-12_wp, is_later = 1.0e-2_wp
   integer, parameter :: late_trials = 6
   !> Forces tell room down to this part of that of no friction.
   real(wp), parameter :: exact_room = 1.0e-9_wp

   !> What does not change along a path.
   type :: path_t
      real(wp), allocatable :: c(:)              !! (n) a motion is a force by it [M/T^2]
      real(wp), allocatable :: mu(:)             !! (n) >= 0
      logical, allocatable :: rubs(:)            !! (n) mu > 0
      logical, allocatable :: is_led(:)          !! (n) to a slip a that is not round-off
      real(wp), allocatable :: target(:, :)      !! (n_slip, n) c a, 0 where it is not led
      real(wp), allocatable :: length(:)         !! (n) c |a|; 1 where it is not led
      real(wp) :: largest = 0.0_wp               !! force at the start [M L/T^2]
   end type path_t

   !> A point of a path, or a step along it. Motions are forces by c.
   type :: point_t
      real(wp), allocatable :: push(:, :)        !! (0:n_slip, n) y
      real(wp), allocatable :: lam(:)            !! (n) > 0
      real(wp), allocatable :: tau(:, :)         !! (n_slip, n)
      real(wp), allocatable :: gap(:)            !! (n) > 0
      real(wp), allocatable :: speed(:)          !! (n) sigma > 0
      real(wp), allocatable :: room(:)           !! (n) rho = mu lam - tau^2/(mu lam) > 0
      real(wp), allocatable :: part(:), left(:)  !! (n) theta > 0 and 1 - theta > 0 [1]
      real(wp), allocatable :: over(:), under(:) !! (n) > 0
   end type point_t

   !> What the equations of a point are off by.
   type :: rest_t
      real(wp), allocatable :: force(:, :)       !! (0:n_slip, n) of y less lam, tau
      real(wp), allocatable :: motion(:, :)      !! (0:n_slip, n) gap, slip of y less those
      real(wp), allocatable :: along(:)          !! (n) tau along a less over - under
   end type rest_t

contains

   !> Along the path from the largest force itself. `push` is nearer to a solution at the end, or as
   !> it was.
   subroutine contact_path(self, push, n_step, n_trial, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(inout) :: n_step               !! counted on
      integer, intent(inout) :: n_trial              !! counted on
      logical, intent(out) :: is_solved              !! the law is met
      type(path_t) :: path
      type(point_t) :: at
      type(rest_t) :: rest
      real(wp) :: product, late, missed, least, gone, trial(0:self%n_slip, size(self%mu))
      integer :: i, n_stall
      logical :: has_step

      call begin(self, push, path, at)
      late = is_late*path%largest**2
      least = contact_problem_missed(self, push)
      n_stall = 0
      do i = 1, most_steps
         n_step = n_step + 1
         call measure(self, path, at, rest)
         call advance(self, path, rest, at, gone, has_step)
         if (.not. has_step) exit
         product = mean_product(path, at)
         missed = contact_problem_missed(self, at%push)
         if (missed < least) push = at%push
         least = min(least, missed)
         is_solved = missed <= met
         if (is_solved) return
         if (product < late) then
            late = is_later*product
            trial = at%push
            call contact_trials(self, trial, late_trials, n_trial, is_solved)
            if (is_solved) push = trial
            if (is_solved) return
         end if
         n_stall = merge(0, n_stall + 1, gone > no_step)
         if (n_stall == most_stalls) exit
      end do
      is_solved = .false.
   end subroutine contact_path

   !> Everything far inside, at the size of the largest force.
   subroutine begin(self, push, path, at)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(in) :: push(0:, :)
      type(path_t), intent(out) :: path
      type(point_t), intent(out) :: at
      real(wp) :: defect(0:self%n_slip, size(self%mu))
      integer :: i

      associate (n => size(self%mu))
         path%c = [(contact_problem_stiffness(self, i), i = 1, n)]
         path%mu = self%mu
         path%rubs = self%mu > 0.0_wp
         call contact_problem_map(self, push, defect)
         path%largest = max(maxval(abs(contact_problem_forces(self, push, &
            contact_problem_motion(self, push)))), maxval(abs(defect)), tiny(path%largest))
         path%target = self%slip_target*spread(path%c, 1, self%n_slip)
         path%length = norm2(path%target, 1)
         path%is_led = path%rubs .and. path%length > met*path%largest
         where (spread(.not. path%is_led, 1, self%n_slip)) path%target = 0.0_wp
         where (.not. path%is_led) path%length = 1.0_wp
         at%push = push
         at%lam = spread(path%largest, 1, n)
         at%gap = at%lam
         allocate(at%tau(self%n_slip, n), source=0.0_wp)
         at%room = path%mu*at%lam
         at%speed = 2.0_wp*at%room
         at%part = spread(0.5_wp, 1, n)
         at%left = at%part
         at%over = 2.0_wp*path%largest**2/path%length
         at%under = at%over
         end associate
   end subroutine begin

   !> What is left of the equations.
   subroutine measure(self, path, at, rest)
      type(contact_problem_t), intent(in) :: self
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      type(rest_t), intent(out) :: rest
      integer :: i

      associate (n => size(at%lam))
         allocate(rest%force(0:self%n_slip, n), rest%motion(0:self%n_slip, n))
         allocate(rest%along(n), source=0.0_wp)
      end associate
      rest%motion(:, :) = contact_problem_motion(self, at%push)
      rest%force(:, :) = contact_problem_forces(self, at%push, rest%motion)
      rest%force(0, :) = rest%force(0, :) - at%lam
      rest%force(1:, :) = rest%force(1:, :) - at%tau
      do i = 1, size(at%lam)
         rest%motion(0, i) = path%c(i)*rest%motion(0, i) - at%gap(i)
         rest%motion(1:, i) = -path%c(i)*rest%motion(1:, i) - at%part(i)*path%target(:, i)
         if (path%rubs(i)) rest%motion(1:, i) = rest%motion(1:, i) - at%speed(i)*use(path, at, i)
         if (path%is_led(i)) rest%along(i) = dot_product(at%tau(:, i), path%target(:, i)) &
            /path%length(i) - (at%over(i) - at%under(i))
      end do
   end subroutine measure

   !> One step: by what a step to the end of the path would leave is seen where to aim.
   subroutine advance(self, path, rest, at, gone, has_step)
      type(contact_problem_t), intent(in) :: self
      type(path_t), intent(in) :: path
      type(rest_t), intent(in) :: rest
      type(point_t), intent(inout) :: at
      real(wp), intent(out) :: gone                  !! part of the step that was gone
      logical, intent(out) :: has_step
      type(point_t) :: step
      real(wp), allocatable :: change(:, :, :)
      real(wp) :: aim, product

      gone = 0.0_wp
      call find_changes(self, path, at, rest, change, has_step)
      if (.not. has_step) return
      product = mean_product(path, at)
      call complete(self, path, at, rest, change(:, :, 1), 0.0_wp, step)
      aim = min(max((1.0_wp - min(1.0_wp, reach(path, at, step)))**3, least_aim), most_aim)
      call complete(self, path, at, rest, change(:, :, 1) + aim*product*change(:, :, 2), &
         aim*product, step)
      gone = min(1.0_wp, inside*reach(path, at, step))
      has_step = gone > 0.0_wp .and. maxval(abs(step%push)) < endless*path%largest
      if (.not. has_step) return
      at%push = at%push + gone*step%push
      at%lam = at%lam + gone*step%lam
      at%tau = at%tau + gone*step%tau
      at%gap = at%gap + gone*step%gap
      at%speed = at%speed + gone*step%speed
      at%room = max(at%room + gone*step%room, (1.0_wp - inside)*at%room)
      call keep_inside(path, at)
      at%part = at%part + gone*step%part
      at%left = at%left - gone*step%part
      at%over = at%over + gone*step%over
      at%under = at%under + gone*step%under
   end subroutine advance

   !> Friction over its limit.
   pure function use(path, at, i)
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      integer, intent(in) :: i
      real(wp) :: use(size(at%tau, 1))

      use = at%tau(:, i)/(path%mu(i)*at%lam(i))
   end function use

   !> Room is that of the forces; where these have turned out of the limit, or do not tell it,
   !> friction is brought back to the room that was foreseen, along its way.
   pure subroutine keep_inside(path, at)
      type(path_t), intent(in) :: path
      type(point_t), intent(inout) :: at
      real(wp) :: most, room, length
      integer :: i

      do i = 1, size(at%lam)
         if (.not. path%rubs(i)) cycle
         most = path%mu(i)*at%lam(i)
         length = norm2(at%tau(:, i))
         room = most - length**2/most
         if (room >= max((1.0_wp - inside)*at%room(i), exact_room*most)) then
            at%room(i) = room
         else
            at%room(i) = min(at%room(i), most)
            at%tau(:, i) = sqrt(most*(most - at%room(i)))/length*at%tau(:, i)
         end if
      end do
   end subroutine keep_inside

   !> e^2 of a point that is near the path [(M L/T^2)^2].
   pure real(wp) function mean_product(path, at) result(product)
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      integer :: i

      product = 0.0_wp
      do i = 1, size(at%lam)
         product = product + at%lam(i)*at%gap(i)
         if (path%rubs(i)) product = product + at%speed(i)*at%room(i)/(2.0_wp*path%mu(i)**2)
         if (path%is_led(i)) product = product + path%length(i)*(at%over(i)*at%left(i) &
            + at%under(i)*at%part(i))
      end do
      product = product/(size(at%lam) + count(path%rubs) + 2*count(path%is_led))
   end function mean_product

   !> How y changes by a step to products of 0 (1), and more by each unit of the products that are
   !> aimed at (2): what places give way by about their forces is added to W. Rows are along
   !> friction and across: where it is at its limit these differ by all digits that there are.
   subroutine find_changes(self, path, at, rest, change, has_step)
      type(contact_problem_t), intent(in) :: self
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      type(rest_t), intent(in) :: rest
      real(wp), allocatable, intent(out) :: change(:, :, :)  !! (0:n_slip, n, 2)
      logical, intent(out) :: has_step
      real(dp), allocatable :: a(:, :), b(:, :), x(:, :)
      real(wp), allocatable, dimension(:, :, :) :: own, give
      real(wp) :: frame(0:self%n_slip, 0:self%n_slip), right(0:self%n_slip, 2)
      real(dp) :: row_size(size(self%w, 1))
      logical :: is_singular
      integer :: i, k, m

      m = 1 + self%n_slip
      associate (n => size(at%lam))
         allocate(a(m*n, m*n), b(m*n, 2), x(m*n, 2), own(0:m - 1, 0:m - 1, n), &
            give(0:m - 1, 0:m - 1, n))
         do i = 1, n
            call find_place(path, at, rest, i, frame, give(:, :, i), right)
            own(:, :, i) = path%c(i)*frame - give(:, :, i)*spread(self%hold(:, i), 1, m)
            b(m*(i - 1) + 1:m*i, :) = real(right, dp)
         end do
         call contact_problem_weigh(self, own, a)
         do i = 1, n
            associate (row => m*(i - 1) + 1)
               a(row:m*i, row:m*i) = a(row:m*i, row:m*i) + real(give(:, :, i), dp)
            end associate
         end do
         row_size = 0.0_dp
         do k = 1, m*n
            row_size = max(row_size, abs(a(:, k)))
         end do
         where (.not. row_size > 0.0_dp) row_size = 1.0_dp
         do k = 1, m*n
            a(:, k) = a(:, k)/row_size
         end do
         b = b/spread(row_size, 2, 2)
         call dense_solve(a, b, x, is_singular)
         has_step = .not. is_singular
         change = reshape(real(x, wp), [m, n, 2])
      end associate
   end subroutine find_changes

   !> The rows of place `i`: `frame` times the change of motion and `give` times that of forces are
   !> `right`, of products 0 (1) and of each unit of those aimed at (2).
   pure subroutine find_place(path, at, rest, i, frame, give, right)
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      type(rest_t), intent(in) :: rest
      integer, intent(in) :: i
      real(wp), intent(out) :: frame(0:, 0:), give(0:, 0:), right(0:, :)
      real(wp) :: share, by, way(ubound(frame, 1))
      integer :: s

      associate (tau => at%tau(:, i), lam => at%lam(i), n_slip => ubound(frame, 1))
         frame = 0.0_wp
         give = 0.0_wp
         right = 0.0_wp
         frame(0, 0) = 1.0_wp
         give(0, 0) = at%gap(i)/lam
         right(0, :) = [-at%gap(i) - rest%motion(0, i), 1.0_wp/lam]
         if (path%rubs(i)) then
            share = norm2(use(path, at, i))
            call find_ways(tau, frame(1:, 1:))
            by = at%speed(i)/at%room(i)
            give(1:, 1:) = at%speed(i)/(path%mu(i)*lam)*frame(1:, 1:)
            give(1, 1:) = give(1, 1:) + 2.0_wp*by*share**2*frame(1, 1:)
            give(1, 0) = -2.0_wp*by*path%mu(i)*share
            right(1, :) = share*[at%speed(i), -2.0_wp*path%mu(i)**2/at%room(i)]
            right(1:, 1) = right(1:, 1) + matmul(frame(1:, 1:), rest%motion(1:, i))
            if (path%is_led(i)) then
               way = path%target(:, i)/path%length(i)
               do s = 1, n_slip
                  give(s, 1:) = give(s, 1:) + dot_product(frame(s, 1:), path%target(:, i)) &
                     /width(at, i)*way
               end do
               right(1:, 1) = right(1:, 1) - matmul(frame(1:, 1:), path%target(:, i)) &
                  *(rest%along(i) - off(at, i))/width(at, i)
               right(1:, 2) = right(1:, 2) + matmul(frame(1:, 1:), path%target(:, i)) &
                  *off_by_product(path, at, i)/width(at, i)
            end if
         else
            do s = 1, n_slip
               give(s, s) = 1.0_wp
            end do
         end if
         right(:, 1) = right(:, 1) - matmul(give, rest%force(:, i))
      end associate
   end subroutine find_place

   !> What over - under grows by with theta.
   pure real(wp) function width(at, i)
      type(point_t), intent(in) :: at
      integer, intent(in) :: i

      width = at%over(i)/at%left(i) + at%under(i)/at%part(i)
   end function width

   !> What over - under changes by as products become 0, and by each unit of them.
   pure real(wp) function off(at, i)
      type(point_t), intent(in) :: at
      integer, intent(in) :: i

      off = at%under(i) - at%over(i)
   end function off

   pure real(wp) function off_by_product(path, at, i) result(off)
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      integer, intent(in) :: i

      off = (1.0_wp/at%left(i) - 1.0_wp/at%part(i))/path%length(i)
   end function off_by_product

   !> Along friction, and across.
   pure subroutine find_ways(tau, way)
      real(wp), intent(in) :: tau(:)                 !! (n_slip)
      real(wp), intent(out) :: way(:, :)             !! (n_slip, n_slip) by rows

      way = 0.0_wp
      way(1, 1) = 1.0_wp
      if (norm2(tau) > 0.0_wp) way(1, :) = tau/norm2(tau)
      associate (last => size(tau))
         if (last > 1) way(last, :) = [-way(1, last), way(1, 1)]
      end associate
   end subroutine find_ways

   !> The step of all unknowns to which y changes by `change`, with products of `product`.
   subroutine complete(self, path, at, rest, change, product, step)
      type(contact_problem_t), intent(in) :: self
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at
      type(rest_t), intent(in) :: rest
      real(wp), intent(in) :: change(0:, :)
      real(wp), intent(in) :: product
      type(point_t), intent(out) :: step
      real(wp) :: force(0:self%n_slip, size(at%lam))
      integer :: i

      force = change - self%hold*reshape(matmul(self%w, reshape(change, [size(change)])), &
         shape(change)) + rest%force
      step%push = change
      step%lam = force(0, :)
      step%tau = force(1:, :)
      step%gap = (product - at%gap*step%lam)/at%lam - at%gap
      step%speed = 0.0_wp*at%lam
      step%room = step%speed
      step%part = step%speed
      step%over = step%speed
      step%under = step%speed
      do i = 1, size(at%lam)
         if (.not. path%rubs(i)) cycle
         associate (share => use(path, at, i))
            step%room(i) = path%mu(i)*(1.0_wp + sum(share**2))*step%lam(i) &
               - 2.0_wp*dot_product(share, step%tau(:, i))
         end associate
         step%speed(i) = (2.0_wp*path%mu(i)**2*product - at%speed(i)*step%room(i))/at%room(i) &
            - at%speed(i)
         if (.not. path%is_led(i)) cycle
         associate (left => at%left(i), theta => at%part(i))
            step%part(i) = (rest%along(i) + dot_product(step%tau(:, i), path%target(:, i)) &
               /path%length(i) - off(at, i) - product*off_by_product(path, at, i))/width(at, i)
            step%over(i) = (product/path%length(i) + at%over(i)*step%part(i))/left - at%over(i)
            step%under(i) = (product/path%length(i) - at%under(i)*step%part(i))/theta &
               - at%under(i)
         end associate
      end do
   end subroutine complete

   !> By how many steps the first of the limits would be reached.
   pure real(wp) function reach(path, at, step)
      type(path_t), intent(in) :: path
      type(point_t), intent(in) :: at, step
      integer :: i

      reach = far
      do i = 1, size(at%lam)
         reach = min(reach, until_0(at%lam(i), step%lam(i)), until_0(at%gap(i), step%gap(i)))
         if (.not. path%rubs(i)) cycle
         reach = min(reach, until_0(at%speed(i), step%speed(i)), until_0(at%room(i), &
            step%room(i)))
         if (.not. path%is_led(i)) cycle
         reach = min(reach, until_0(at%over(i), step%over(i)), until_0(at%under(i), &
            step%under(i)), until_0(at%part(i), step%part(i)), until_0(at%left(i), &
            -step%part(i)))
      end do
   end function reach

   !> When does what changes by `change` become 0? Not before `far`: that.
   pure real(wp) function until_0(value, change)
      real(wp), intent(in) :: value, change          !! > 0, any

      until_0 = far
      if (-far*change > value) until_0 = -value/change
   end function until_0

end module emcon_contact_path
