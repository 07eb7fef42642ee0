!> The registry of the constraints that hold at the end of every step, those of the deck and those
!> given: what others see of it. Which kinds there are is known to `emcon_constraint_kinds` alone.
module emcon_constraint_registry
   use emcon_constraint, only : constraint_box_t
   use emcon_host, only : host_t
   use emcon_linear_rows, only : linear_rows_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: constraints_create

   interface
      !> The linear rows, the shapes of rigid bodies, then copies of the constraints that are given,
      !> which learn the positions.
      module subroutine constraints_create(scene, linear, held, host)
         type(scene_t), intent(in) :: scene
         type(linear_rows_t), intent(in) :: linear   !! of `scene`
         type(constraint_box_t), allocatable, intent(out) :: held(:)   !! (own + given ones)
         type(host_t), intent(in), optional :: host
      end subroutine constraints_create
   end interface

end module emcon_constraint_registry
