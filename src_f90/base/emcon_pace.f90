!> When to do again what may be done at any time but must not cost much: some seconds after the last
!> time at the soonest, and so that it takes a small part of the time.
module emcon_pace
   use emcon_kinds, only : dp
   use emcon_timer, only : wall_seconds
   implicit none
   private
   public :: pace_t, pace_is_due, pace_begin, pace_end

   !> When it was done last, and what it took.
   type :: pace_t
      private
      logical :: is_begun = .false.
      real(dp) :: begin = 0.0_dp                 !! wall clock [s]
      real(dp) :: end = 0.0_dp
   end type pace_t

   !> Times are at least so many seconds apart ...
   real(dp), parameter :: min_interval = 2.0_dp
   !> ... and at least so many times what the last one took: one percent.
   real(dp), parameter :: cost_interval = 100.0_dp

contains

   !> Is it time? The first time it is.
   logical function pace_is_due(self)
      type(pace_t), intent(in) :: self

      pace_is_due = .not. self%is_begun
      if (pace_is_due) return
      pace_is_due = wall_seconds() - self%end >= max(min_interval, &
         cost_interval*(self%end - self%begin))
   end function pace_is_due

   subroutine pace_begin(self)
      type(pace_t), intent(inout) :: self

      self%begin = wall_seconds()
   end subroutine pace_begin

   subroutine pace_end(self)
      type(pace_t), intent(inout) :: self

      self%end = wall_seconds()
      self%is_begun = .true.
   end subroutine pace_end

end module emcon_pace
