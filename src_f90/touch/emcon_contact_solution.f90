!> Forces that obey the law of a problem of contacts: which method comes when.
!>
!> Newton's method for the natural map of all places at once; where that does not come to an end
!> place by place; the two take turns. Where slip has a direction the central path comes before
!> that, and a travel along forces that follow from others. After two turns, in the plane, by the
!> method of Lemke for forces that push at a and at 0, whose matrix is copositive. Without friction,
!> after a few trials, the least motion that closes no gap is found instead.
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_solution
   use emcon_contact_path, only : contact_path
   use emcon_contact_problem, only : contact_effort_t, contact_problem_forces, &
      contact_problem_missed, contact_problem_motion, contact_problem_t, freely, nearly_met
   use emcon_contact_sweeps, only : contact_sweeps
   use emcon_contact_trials, only : contact_following, contact_nearing, contact_slope_t, &
      contact_travelling, contact_trials
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_lemke, only : lemke_solve
   use emcon_push_problem, only : push_problem_solve
   implicit none
   private
   public :: contact_problem_solve, contact_problem_pivot

   !> Trials of all places at once at first, few of them without friction, and when their turn comes
   !> again; sweeps in the first turn, twice as many in each that follows; turns; after this one
   !> comes the method of Lemke.
   integer, parameter :: first_trials = 60, few_trials = 10, more_trials = 20, first_sweeps = 20, &
      most_turns = 8, pivot_turn = 2

contains

   !> Forces that obey the law at all contacts.
   subroutine contact_problem_solve(self, push, effort, is_solved, near_enough, slope, stays_near)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) start, solution: y [M L/T^2]
      type(contact_effort_t), intent(out) :: effort
      logical, intent(out) :: is_solved              !! else `push` is as near as it came
      !> The problem is one of several that come nearer to what is to be solved: where slip has a
      !> direction, forces that are nearer than those at the start will do
      logical, intent(in), optional :: near_enough
      !> Of a problem before that is near this one, or of none yet
      type(contact_slope_t), intent(inout), optional :: slope
      !> Where slip has a direction: forces that follow from others are to stay near the start,
      !> however near to the law they come; or there are none
      logical, intent(in), optional :: stays_near
      type(contact_problem_t) :: apart
      logical :: is_one_of_several, is_bound, is_near
      integer :: turn, n_turn, n_trial

      is_bound = .false.
      if (present(stays_near)) is_bound = stays_near
      is_one_of_several = .false.
      if (present(near_enough)) is_one_of_several = near_enough
      is_solved = size(self%mu) == 0
      if (is_solved) return
      associate (has_pushes => .not. any(self%mu > 0.0_wp .or. self%hold(0, :) > 0.0_wp), &
            has_direction => self%n_slip > 1 .and. any(self%mu > 0.0_wp))
         n_trial = first_trials
         if (has_pushes .or. has_direction) n_trial = few_trials
         call contact_trials(self, push, n_trial, effort%n_trial, is_solved, slope)
         if (is_solved .or. .not. has_compliance(self)) return
         if (is_bound) then
            call contact_following(self, push, effort, is_solved, is_near)
            is_solved = is_solved .or. is_near
            return
         end if
         if (has_pushes) call solve_by_pushes(self, push, effort%n_pivot, is_solved)
         if (is_solved) return
         if (has_direction) call solve_with_direction(self, push, effort, is_one_of_several, &
            is_solved)
         if (is_solved) return
         n_turn = merge(1, most_turns, has_direction .and. is_one_of_several)
      end associate
      do turn = 1, n_turn
         call contact_sweeps(self, push, first_sweeps*2**(turn - 1), effort%n_sweep, is_solved)
         if (is_solved) return
         call contact_trials(self, push, more_trials, effort%n_trial, is_solved)
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
      call contact_trials(self, push, more_trials, effort%n_trial, is_solved)
   end subroutine contact_problem_solve

   !> Along the central path; where that does not end near the forces there are, if that is
   !> enough, and else as far from them as it takes.
   subroutine solve_with_direction(self, push, effort, near_enough, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      type(contact_effort_t), intent(inout) :: effort    !! counted on
      logical, intent(in) :: near_enough
      logical, intent(out) :: is_solved

      call contact_path(self, push, effort%n_path, effort%n_trial, is_solved)
      if (is_solved) return
      if (near_enough) then
         call contact_nearing(self, push, effort, is_solved)
         is_solved = is_solved .or. effort%n_near > 0
      else
         call contact_travelling(self, push, effort, is_solved)
      end if
   end subroutine solve_with_direction

   !> The same places without what holds them: what moves freely is held by round-off's root of it.
   subroutine let_go(self, apart)
      type(contact_problem_t), intent(in) :: self
      type(contact_problem_t), intent(out) :: apart
      real(dp), dimension(size(self%w, 1), size(self%w, 1)) :: yields, w
      logical :: is_singular

      apart = self
      apart%base = contact_problem_forces(self, 0.0_wp*self%free, self%free)
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

   !> Does each gap open when it is pushed?
   pure logical function has_compliance(self)
      type(contact_problem_t), intent(in) :: self
      integer :: i

      has_compliance = all([(self%w(1 + (i - 1)*(1 + self%n_slip), 1 + (i - 1)*(1 + self%n_slip)) &
         > 0.0_wp, i = 1, size(self%mu))])
   end function has_compliance

   !> Without friction and where nothing is held: the least motion that closes no gap. Contacts that
   !> follow from others, as in stacks of aligned bodies, cost no more than others.
   subroutine solve_by_pushes(self, push, n_pivot, is_solved)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) y [M L/T^2]
      integer, intent(out) :: n_pivot                !! pushes that came or went
      logical, intent(out) :: is_solved              !! else `push` is as it was
      real(wp), dimension(0:self%n_slip, size(self%mu)) :: free, found

      free = contact_problem_motion(self, -self%base)
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
      free = contact_problem_motion(self, -self%base)
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

end module emcon_contact_solution
