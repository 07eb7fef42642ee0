!> How the residual of an iteration comes down, and what is to follow: another tangent, the old one
!> once more, the end.
!>
!> After the tolerance is met, corrections with the last factorisation go on down to round-off:
!> energy is lost to what the residual leaves. Where residuals go up and down, less of each
!> correction is taken. Whether they come down is seen beside the largest forces of the solve:
!> forces of stiff contacts that let go fall with their residual.
module emcon_convergence
   use emcon_kinds, only : wp
   implicit none
   private
   public :: convergence_t, convergence_init, convergence_begin, convergence_judge, &
      convergence_accuracy, convergence_nears_end
   public :: next_done, next_tangent, next_old_tangent, next_give_up, round_off, most_rounding

   !> What follows an evaluation.
   integer, parameter :: next_done = 0, next_tangent = 1, next_old_tangent = 2, next_give_up = 3

   !> A residual below this multiple of epsilon is round-off: of what its contributions are, and of
   !> what the forces' own evaluation rounds.
   real(wp), parameter :: round_off = 4.0_wp*epsilon(1.0_wp)
   !> However much the forces' own evaluation rounds, a residual above this part of them is none.
   real(wp), parameter :: most_rounding = 1.0e-3_wp
   !> Corrections with an old factorisation at most, and the factor each has to gain.
   integer, parameter :: most_polish = 3
   real(wp), parameter :: polish_gain = 0.5_wp
   !> Of the residual, what a correction may leave at least and at most; and the part it may leave
   !> of what the next residual will be.
   real(wp), parameter :: least_left = 1.0e-4_wp, most_left = 1.0e-2_wp, part_left = 0.1_wp
   !> A new best residual is at least this much smaller. After so many iterations without one the
   !> step has failed; after a few it has converged, if it is below this multiple of epsilon.
   real(wp), parameter :: stall_gain = 0.9_wp
   integer, parameter :: most_stalls = 6, few_stalls = 2
   real(wp), parameter :: stall_floor = 1.0e4_wp*epsilon(1.0_wp)
   !> Least part of a correction that is taken: at a kink of contact whole ones lead to and fro.
   real(wp), parameter :: least_damping = 0.125_wp

   !> Corrections by a kept factor, which gain less each: so many without a new best residual are a
   !> stall, so many times the maximum of tangents are allowed, and after so many with one factor
   !> it is too old, unless little is left.
   integer, parameter :: kept_stalls = 4, kept_for_tangent = 2, too_old = 12
   !> Below this multiple of epsilon a correction that does not gain has met round-off, which large
   !> scenes have more of.
   real(wp), parameter :: kept_floor = 16.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: nearly_done = 1.0e4_wp*epsilon(1.0_wp)

   !> With a kept factor, forces whose residual is smaller than this part of their sizes change by
   !> no more of them on the way to the end: the sizes need not be found again.
   real(wp), parameter :: near = 1.0e-2_wp

   !> So many of the last residuals are compared with each other.
   integer, parameter :: n_recent = 3

   type :: convergence_t
      logical :: is_kept = .false.               !! corrections are by a kept factor
      integer :: n_kept = 0                      !! by the present one
      integer :: n_renewal = 0                   !! factors made in the solve for that they stalled
      real(wp) :: tolerance = 0.0_wp             !! of the relative residual
      integer :: maximum = 0                     !! iterations
      real(wp) :: largest_move = huge(1.0_wp)    !! of a correction, where contacts stand beside [L]
      logical :: polishes = .true.               !! else the tolerance is the end
      !> Tangents factorised so far, or corrections by a kept factor before the tolerance was met
      integer :: n_iteration = 0
      integer :: n_history = 0
      real(wp), allocatable :: history(:)        !! relative residuals so far
      real(wp) :: last = 0.0_wp                  !! the last of these
      real(wp) :: largest_force = 0.0_wp         !! of the solve so far [M L/T^2]
      !> The last residuals beside that one, the newest at the end
      real(wp) :: recent(n_recent) = 0.0_wp
      real(wp) :: best = 0.0_wp                  !! the smallest of these so far
      integer :: n_stall = 0                     !! iterations since the best one
      real(wp) :: damping = 1.0_wp               !! part of a correction that is taken
      integer :: n_polish = 0                    !! corrections with the old tangent
      logical :: is_polish = .false.             !! within tolerance: down to round-off from here
      logical :: knows_sizes = .false.           !! those of forces are known to a few digits
   end type convergence_t

contains

   !> Set up for solves to `tolerance`; none is asked for that only round-off could meet.
   pure subroutine convergence_init(self, tolerance, maximum)
      type(convergence_t), intent(out) :: self
      real(wp), intent(in) :: tolerance          !! > 0, of the relative residual
      integer, intent(in) :: maximum             !! iterations at most

      self%tolerance = max(tolerance, kept_floor)
      self%maximum = maximum
      allocate(self%history((1 + kept_for_tangent)*maximum + most_polish + 3), source=0.0_wp)
      call convergence_begin(self)
   end subroutine convergence_init

   !> A solve begins: nothing is known of it.
   pure subroutine convergence_begin(self)
      type(convergence_t), intent(inout) :: self

      self%n_iteration = 0
      self%n_history = 0
      self%n_polish = 0
      self%n_stall = 0
      self%damping = 1.0_wp
      self%largest_force = 0.0_wp
      self%recent = huge(self%recent)
      self%best = huge(self%best)
      self%last = huge(self%last)
      self%is_polish = .false.
      self%is_kept = .false.
      self%n_kept = 0
      self%n_renewal = 0
      self%knows_sizes = .false.
   end subroutine convergence_begin

   !> Is the next residual, if it follows the last two as the square of what went before, within
   !> the tolerance, so that no tangent will be asked for there?
   pure logical function convergence_nears_end(self) result(nears_end)
      type(convergence_t), intent(in) :: self

      nears_end = self%is_polish
      associate (n => self%n_history)
         if (n < 2 .or. nears_end) return
         nears_end = self%last*(self%last/self%history(n - 1))**2 <= self%tolerance
      end associate
   end function convergence_nears_end

   !> How much of the residual the next correction may leave, by a tangent: a part of what the
   !> square of the last gain will leave of it anyway, and of round-off (Eisenstat and Walker, SIAM
   !> J. Sci. Comput. 17, 1996).
   pure real(wp) function convergence_accuracy(self) result(left)
      type(convergence_t), intent(in) :: self

      left = most_left
      if (self%n_history > 1) left = part_left*(self%last/self%history(self%n_history - 1))**2
      left = min(max(left, least_left), most_left)
      if (self%n_history > 0) left = max(left, part_left*min(1.0_wp, kept_floor/self%last))
   end function convergence_accuracy

   !> What to do next, now that the residual and the defect are known.
   pure subroutine convergence_judge(self, norm, defect, force, is_rounding, next)
      type(convergence_t), intent(inout) :: self
      real(wp), intent(in) :: norm               !! relative residual, >= 0
      real(wp), intent(in) :: defect             !! of gaps, relative to the edge, >= 0
      real(wp), intent(in) :: force              !! size of the forces of `norm` [M L/T^2]
      logical, intent(in) :: is_rounding         !! nothing else is left
      integer, intent(out) :: next               !! one of the `next_` codes
      real(wp) :: size
      logical :: has_gained

      size = max(norm, defect)
      self%largest_force = max(self%largest_force, force)
      self%recent = cshift(self%recent, 1)
      self%recent(n_recent) = size
      if (self%largest_force > 0.0_wp) &
         self%recent(n_recent) = max(norm*(force/self%largest_force), defect)
      self%n_history = self%n_history + 1
      self%history(self%n_history) = size
      has_gained = size <= polish_gain*self%last
      self%last = size
      if (self%is_kept) then
         call judge_kept(self, size, is_rounding, has_gained, next)
      else
         call judge_newton(self, size, is_rounding, has_gained, next)
      end if
   end subroutine convergence_judge

   !> On with a kept factor down to round-off as long as that gains, then with a new one, once.
   pure subroutine judge_kept(self, size, is_rounding, has_gained, next)
      type(convergence_t), intent(inout) :: self
      real(wp), intent(in) :: size
      logical, intent(in) :: is_rounding, has_gained
      integer, intent(out) :: next
      logical :: is_stalled

      self%knows_sizes = size < near
      call count_stalls(self)
      next = next_done
      if (size <= self%tolerance .and. .not. self%polishes) return
      if (size <= round_off .or. (size <= kept_floor .and. .not. has_gained)) return
      is_stalled = self%n_stall >= kept_stalls
      if (is_stalled .and. is_rounding) return
      next = next_give_up
      if (.not. size < huge(size) .or. self%n_history > kept_for_tangent*self%maximum) return
      if (is_stalled .and. self%n_renewal > 0) return
      ! Once for its age: where a new factor is as slow, curved contacts are the cause.
      is_stalled = is_stalled .or. (self%n_kept >= too_old .and. self%n_renewal == 0 &
         .and. self%best > nearly_done)
      next = merge(next_tangent, next_old_tangent, is_stalled)
      if (is_stalled) then
         self%n_renewal = self%n_renewal + 1
         self%n_kept = 0
         self%n_stall = 0
      else
         self%n_kept = self%n_kept + 1
         if (size > self%tolerance .and. .not. is_rounding) self%n_iteration = self%n_iteration + 1
      end if
   end subroutine judge_kept

   !> Once it is within the tolerance, or nothing but round-off, go on with the old tangent as long
   !> as that gains.
   pure subroutine judge_newton(self, size, is_rounding, has_gained, next)
      type(convergence_t), intent(inout) :: self
      real(wp), intent(in) :: size
      logical, intent(in) :: is_rounding, has_gained
      integer, intent(out) :: next

      next = next_done
      if (size <= round_off) return
      if (size <= self%tolerance .and. .not. self%polishes) return
      if (self%is_polish .and. (self%n_polish == most_polish .or. .not. has_gained)) then
         if (size > max(self%tolerance, most_rounding) .and. .not. is_rounding) next = next_give_up
         return
      end if
      self%is_polish = self%is_polish .or. size <= self%tolerance .or. is_rounding
      if (self%is_polish) then
         next = next_tangent                     ! the first guess was good enough
         if (self%n_iteration > 0) next = next_old_tangent
         self%n_polish = self%n_polish + 1
         return
      end if
      call count_stalls(self)
      call choose_damping(self)
      if (self%n_stall > few_stalls .and. size <= stall_floor) return
      next = next_tangent
      if (self%n_stall > most_stalls .or. self%n_iteration == self%maximum &
         .or. .not. size < huge(size)) next = next_give_up
   end subroutine judge_newton

   !> Is the last residual a new best one?
   pure subroutine count_stalls(self)
      type(convergence_t), intent(inout) :: self

      self%n_stall = self%n_stall + 1
      if (self%recent(n_recent) < stall_gain*self%best) self%n_stall = 0
      self%best = min(self%best, self%recent(n_recent))
   end subroutine count_stalls

   !> Half of what was taken of the last correction if the last residual is no smaller than one of
   !> the two before it, else twice as much. The first guess may happen to have a small one.
   pure subroutine choose_damping(self)
      type(convergence_t), intent(inout) :: self

      self%damping = min(1.0_wp, 2.0_wp*self%damping)
      if (self%n_history < 4) return
      if (self%recent(n_recent) >= stall_gain*minval(self%recent(:n_recent - 1))) then
         self%damping = max(least_damping, 0.25_wp*self%damping)
      end if
   end subroutine choose_damping

end module emcon_convergence
