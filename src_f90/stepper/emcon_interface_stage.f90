!> What a call for a step of the host needs: an interface at the right stage, arrays of the right
!> shape.
module emcon_interface_stage
   use emcon_errors, only : error_t
   use emcon_interface, only : interface_t
   use emcon_interface_check, only : check_field, check_list, refuse
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_motion, check_begun, check_mask, check_evaluated, check_multipliers

contains

   !> Displacements of a prepared interface.
   pure subroutine check_motion(self, place, u0, du, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      real(wp), intent(in) :: u0(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%is_prepared) then
         call refuse(error, place, "called before interface_prepare")
         return
      end if
      call check_field(error, place, "u0", u0, self%n_node)
      call check_field(error, place, "du", du, self%n_node)
   end subroutine check_motion

   !> A step was begun.
   pure subroutine check_begun(self, place, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (.not. self%has_stencils) call refuse(error, place, "called before interface_begin_step")
   end subroutine check_begun

   !> One entry for each possible constraint.
   pure subroutine check_mask(self, place, name, mask, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place, name
      logical, intent(in) :: mask(:)
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (size(mask) /= self%n_constraint) call refuse(error, place, name // " has " // &
         to_text(size(mask)) // " entries, not " // to_text(self%n_constraint))
   end subroutine check_mask

   !> The selected constraints have their derivatives.
   pure subroutine check_evaluated(self, place, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_evaluated

      is_evaluated = allocated(self%active%set%item)
      if (is_evaluated .and. self%active%set%n > 0) then
         is_evaluated = all(self%active%set%item%n_node > 0)
      end if
      if (.not. is_evaluated) call refuse(error, place, "called before interface_evaluate")
   end subroutine check_evaluated

   !> One finite number for each selected constraint.
   pure subroutine check_multipliers(self, place, lam, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      real(wp), intent(in) :: lam(:)
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call check_evaluated(self, place, error)
      call check_list(error, place, "lam", lam, self%active%set%n)
   end subroutine check_multipliers

end module emcon_interface_stage
