!> What a host code may set between steps.
module emcon_interface_settings
   use emcon_errors, only : error_t
   use emcon_interface, only : interface_t
   use emcon_interface_check, only : check_choice, check_number, refuse
   use emcon_kinds, only : wp
   use emcon_steps, only : initiation_admissible, initiation_persistent
   implicit none
   private
   public :: interface_set

contains

   !> The settings of `interface_t`, checked; they are unchanged after an error.
   subroutine interface_set(self, initiation, gap_tolerance, may_cut, is_end, error)
      type(interface_t), intent(inout) :: self
      integer, intent(in) :: initiation          !! persistent or admissible
      real(wp), intent(in) :: gap_tolerance      !! per edge; 0: any
      logical, intent(in) :: may_cut, is_end
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_set"

      call check_choice(error, place, "initiation", initiation, initiation_persistent, &
         initiation_admissible)
      call check_number(error, place, "gap_tolerance", gap_tolerance)
      if (.not. allocated(error) .and. gap_tolerance < 0.0_wp) call refuse(error, place, &
         "gap_tolerance is negative")
      if (allocated(error)) return
      self%initiation = initiation
      self%gap_tolerance = gap_tolerance
      self%may_cut = may_cut
      self%is_end = is_end
   end subroutine interface_set

end module emcon_interface_settings
