!> The first comparison of a test that failed, whatever becomes of the error that it was told by.
module first_failure
   implicit none
   private
   public :: failure_keep, failure_take

   !> Since it was last taken.
   character(len=:), allocatable :: kept

contains

   subroutine failure_keep(message)
      character(len=*), intent(in) :: message

      if (.not. allocated(kept)) kept = message
   end subroutine failure_keep

   !> What was kept, and nothing is any longer; not allocated if all comparisons have passed.
   subroutine failure_take(message)
      character(len=:), allocatable, intent(out) :: message

      if (allocated(kept)) call move_alloc(kept, message)
   end subroutine failure_take

end module first_failure
