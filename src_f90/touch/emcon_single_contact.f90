!> One place of contact with Coulomb's law, whose gap and slips are linear in its forces: exactly.
!>
!> [g; -s] = free + W [lam; tau]. The law can hold in few ways: open; at either end of the segment
!> from 0 to a that slip is led along, where it sticks or slides on from; free along that segment,
!> which is a place with one slip fewer. Each is solved, and the one that misses the law least is
!> the solution. Source: docs/theory.md, eqs. (14f), (14i) and (14m).
module emcon_single_contact
   use emcon_constraint, only : most_slips
   use emcon_coulomb_law, only : contact_trial_t, coulomb_violation
   use emcon_kinds, only : wp
   implicit none
   private
   public :: single_contact_t, single_contact_solve, single_contact_trial

   !> Steps to the root of sliding at most: each takes a twentieth of where it lies or more.
   integer, parameter :: most_steps = 100

   type :: single_contact_t
      integer :: n_slip = 0                          !! n_dim - 1
      real(wp) :: w(0:most_slips, 0:most_slips) = 0.0_wp   !! W [T^2/M]
      real(wp) :: free(0:most_slips) = 0.0_wp        !! g and -s without forces [L]
      real(wp) :: slip_target(most_slips) = 0.0_wp   !! a [L]
      real(wp) :: mu = 0.0_wp                        !! >= 0
      real(wp) :: stiffness = 1.0_wp                 !! c > 0, to compare misses of the law by
   end type single_contact_t

contains

   !> The forces (lam, tau) that obey the law.
   pure recursive function single_contact_solve(self) result(force)
      type(single_contact_t), intent(in) :: self
      real(wp) :: force(0:most_slips)                !! 0 past its slips [M L/T^2]
      real(wp) :: least

      force = 0.0_wp
      if (self%free(0) >= 0.0_wp) return
      least = coulomb_violation(single_contact_trial(self, force), self%mu, self%stiffness)
      if (self%n_slip == 0 .or. .not. self%mu > 0.0_wp) then
         call prefer(self, [-self%free(0)/self%w(0, 0), spread(0.0_wp, 1, most_slips)], force, &
            least)
         return
      end if
      call try_end(self, self%slip_target, force, least)
      if (.not. norm2(self%slip_target) > 0.0_wp) return
      call try_end(self, 0.0_wp*self%slip_target, force, least)
      call try_along(self, force, least)
   end function single_contact_solve

   !> What forces lead to.
   pure type(contact_trial_t) function single_contact_trial(self, force) result(at)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: force(0:most_slips)    !! [M L/T^2]
      real(wp) :: motion(0:most_slips)

      motion = self%free + matmul(self%w, force)
      at = contact_trial_t(force(0), motion(0), force(1:), -motion(1:), self%slip_target)
   end function single_contact_trial

   !> It sticks at `end`, or slides away from there.
   pure subroutine try_end(self, end, force, least)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: end(most_slips)        !! [L]
      real(wp), intent(inout) :: force(0:most_slips) !! that misses the law least so far [M L/T^2]
      real(wp), intent(inout) :: least               !! by so much [M L/T^2]
      real(wp) :: trial(0:most_slips)

      trial = at_compliance(self, end, 0.0_wp)
      if (over_cone(self, trial) > 0.0_wp) trial = sliding(self, end)
      call prefer(self, trial, force, least)
   end subroutine try_end

   !> It is free along the segment: a place with the slip across that alone.
   pure recursive subroutine try_along(self, force, least)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(inout) :: force(0:most_slips) !! as in `try_end`
      real(wp), intent(inout) :: least
      type(single_contact_t) :: part
      real(wp) :: across(0:most_slips, 0:most_slips), along(most_slips)

      along = self%slip_target/norm2(self%slip_target)
      across = 0.0_wp
      across(0, 0) = 1.0_wp
      if (self%n_slip == most_slips) across(1:, 1) = [-along(most_slips), along(1)]
      part%n_slip = self%n_slip - 1
      part%w = matmul(transpose(across), matmul(self%w, across))
      part%free = matmul(transpose(across), self%free)
      part%mu = self%mu
      part%stiffness = self%stiffness
      call prefer(self, matmul(across, single_contact_solve(part)), force, least)
   end subroutine try_along

   !> Take `trial` if it misses the law by less.
   pure subroutine prefer(self, trial, force, least)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: trial(0:most_slips)    !! [M L/T^2]
      real(wp), intent(inout) :: force(0:most_slips) !! as in `try_end`
      real(wp), intent(inout) :: least
      real(wp) :: missed

      missed = coulomb_violation(single_contact_trial(self, trial), self%mu, self%stiffness)
      if (.not. missed < least) return
      least = missed
      force = trial
   end subroutine prefer

   !> Forces that slide on from `end`: s - end = k tau with k > 0 so that |tau| = mu lam, by a root
   !> of that in k between 0, where it sticks, and where the last of tau is gone.
   pure function sliding(self, end) result(force)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: end(most_slips)        !! [L]
      real(wp) :: force(0:most_slips)
      real(wp) :: low, high, f_low, f_high, k, f
      integer :: step

      low = 0.0_wp
      high = 1.0_wp/self%stiffness
      f_low = over_cone(self, at_compliance(self, end, low))
      do step = 1, most_steps
         force = at_compliance(self, end, high)
         f_high = over_cone(self, force)
         if (.not. f_high > 0.0_wp) exit
         low = high
         f_low = f_high
         high = 4.0_wp*high
      end do
      do step = 1, most_steps
         if (.not. high - low > 2.0_wp*epsilon(high)*high) exit
         k = low + (high - low)*min(0.95_wp, max(0.05_wp, f_low/(f_low - f_high)))
         force = at_compliance(self, end, k)
         f = over_cone(self, force)
         if (f > 0.0_wp) then
            low = k
            f_low = f
         else
            high = k
            f_high = f
         end if
         if (abs(f) <= epsilon(f)*abs(force(0))) exit
      end do
   end function sliding

   !> How far friction lies outside the cone [M L/T^2].
   pure real(wp) function over_cone(self, force)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: force(0:most_slips)    !! [M L/T^2]

      over_cone = norm2(force(1:)) - self%mu*force(0)
   end function over_cone

   !> Forces with the gap closed and s = end + k tau: by elimination; 0 where they are not one.
   pure function at_compliance(self, end, k) result(force)
      type(single_contact_t), intent(in) :: self
      real(wp), intent(in) :: end(most_slips)        !! [L]
      real(wp), intent(in) :: k                      !! >= 0 [T^2/M]
      real(wp) :: force(0:most_slips), a(0:most_slips, 0:most_slips + 1), row(0:most_slips + 1)
      integer :: i, j, pivot

      a(:, :most_slips) = self%w
      a(:, most_slips + 1) = -self%free - [0.0_wp, end]
      do i = 1, self%n_slip
         a(i, i) = a(i, i) + k
         ! What no force moves: 0 sticks there if it does not slip, and if it does it slides.
         if (.not. abs(a(i, i)) > 0.0_wp) a(i, i) = epsilon(k)/self%stiffness
      end do
      do i = self%n_slip + 1, most_slips
         a(i, :) = 0.0_wp
         a(i, i) = 1.0_wp
      end do
      force = 0.0_wp
      do i = 0, most_slips
         pivot = i - 1 + maxloc(abs(a(i:, i)), 1)
         if (.not. abs(a(pivot, i)) > 0.0_wp) return
         row = a(pivot, :)
         a(pivot, :) = a(i, :)
         a(i, :) = row/row(i)
         do j = 0, most_slips
            if (j /= i) a(j, :) = a(j, :) - a(j, i)*a(i, :)
         end do
      end do
      force = a(:, most_slips + 1)
   end function at_compliance

end module emcon_single_contact
