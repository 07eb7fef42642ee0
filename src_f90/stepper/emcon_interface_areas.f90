!> Contact pressures for a host code: the areas that multipliers act on.
module emcon_interface_areas
   use emcon_errors, only : error_t
   use emcon_interface, only : interface_t
   use emcon_interface_check, only : check_field, refuse
   use emcon_interface_stage, only : check_begun
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: interface_areas

contains

   !> Area of each possible contact over the step that ended at `u1`, whose constraints were
   !> evaluated: the pressure is lam/area. And the length of slave surface that belongs to it.
   subroutine interface_areas(self, u1, area, length, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(in), contiguous :: u1(:, :)         !! (2, n_node) [L]
      real(wp), intent(out) :: area(:)                     !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)                   !! (n_constraint) [L]
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_areas"
      integer :: i

      area = 0.0_wp
      length = 0.0_wp
      call check_begun(self, place, error)
      call check_field(error, place, "u1", u1, self%n_node)
      if (.not. allocated(error) .and. any([size(area), size(length)] /= self%n_constraint)) then
        call refuse(error, place, "area and length have " // to_text(size(area)) // " and " // &
         to_text(size(length)) // " entries, not " // to_text(self%n_constraint))
      end if
      if (allocated(error)) return
      do i = 1, size(self%system%contact)
         associate (first => self%system%first_constraint(i) + 1, &
               last => self%system%first_constraint(i + 1))
            call self%system%contact(i)%contact%area(self%scene%x, u1, area(first:last), &
               length(first:last))
         end associate
      end do
   end subroutine interface_areas

end module emcon_interface_areas
