!> Where the time of a run goes: each moment belongs to one phase, and what the phases have done is
!> counted.
!>
!> Phases are told apart by a clock that is cheap to read, which goes on while the process waits;
!> seconds of the processor are shared out by its ticks, see `phases_seconds`.
module emcon_phases
   use emcon_kinds, only : dp, int64
   implicit none
   private
   public :: phases_t, phases_start, phase_enter, phase_leave, phase_move, phases_seconds, n_phase

   !> Phases of an increment. Eliminate: rows of constraints, patterns, null space; restitution: the
   !> balance of massless nodes, and jumps of velocities; vectors: all the rest.
   integer, parameter, public :: phase_search = 1, phase_gaps = 2, phase_residual = 3, &
      phase_assemble = 4, phase_eliminate = 5, phase_factorise = 6, phase_solve = 7, &
      phase_restitution = 8, phase_judge = 9, phase_vectors = 10
   integer, parameter :: n_phase = 10
   character(len=*), parameter, public :: phase_name(n_phase) = [character(len=11) :: "search", &
      "gaps", "residual", "assemble", "eliminate", "factorise", "solve", "restitution", "judge", &
      "vectors"]

   type :: phases_t
      integer :: n_searched = 0                  !! pairs whose nearest edges were chosen
      integer :: n_measured = 0                  !! pairs whose gaps were measured
      integer :: n_residual = 0                  !! residuals without tangent
      integer :: n_tangent = 0                   !! residuals with tangent
      integer :: n_factorisation = 0             !! of the system, with its constraints
      integer :: n_solve = 0                     !! with those
      integer, private :: current = phase_vectors
      integer(int64), private :: since = 0       !! when it began [ticks]
      integer(int64), private :: ticks(n_phase) = 0
   end type phases_t

contains

   !> Nothing was done yet.
   subroutine phases_start(self)
      type(phases_t), intent(out) :: self

      call system_clock(self%since)
   end subroutine phases_start

   !> From here on time belongs to `phase`.
   subroutine phase_enter(self, phase, left)
      type(phases_t), intent(inout) :: self
      integer, intent(in) :: phase               !! one of the `phase_` codes
      integer, intent(out) :: left               !! the one that is interrupted

      left = self%current
      call phase_leave(self, phase)
   end subroutine phase_enter

   !> Go back to the phase that was interrupted.
   subroutine phase_leave(self, left)
      type(phases_t), intent(inout) :: self
      integer, intent(in) :: left                !! of `phase_enter`
      integer(int64) :: now

      call system_clock(now)
      self%ticks(self%current) = self%ticks(self%current) + (now - self%since)
      self%since = now
      self%current = left
   end subroutine phase_leave

   !> What a part of phase `from` took belongs to phase `to`.
   pure subroutine phase_move(self, from, to, ticks)
      type(phases_t), intent(inout) :: self
      integer, intent(in) :: from, to
      integer(int64), intent(in) :: ticks

      self%ticks(from) = self%ticks(from) - ticks
      self%ticks(to) = self%ticks(to) + ticks
   end subroutine phase_move

   !> The seconds `total` that all phases took together, shared out.
   pure function phases_seconds(self, total) result(seconds)
      type(phases_t), intent(in) :: self
      real(dp), intent(in) :: total              !! [s]
      real(dp) :: seconds(n_phase)

      seconds = total*real(self%ticks, dp)/real(max(1_int64, sum(self%ticks)), dp)
   end function phases_seconds

end module emcon_phases
