!> The constraints that hold at the end of every step: those of the deck, and those given.
module emcon_constraint_registry
   use emcon_constraint, only : constraint_box_t, constraint_t
   use emcon_host, only : host_t
   use emcon_linear_conditions, only : linear_conditions_init, linear_conditions_t
   use emcon_linear_rows, only : linear_rows_t
   use emcon_rigidity, only : rigidity_init, rigidity_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: constraints_create

   !> Those that every model has; what is given comes after them.
   integer, parameter :: n_own = 2

contains

   !> The linear rows, the shapes of rigid bodies, then copies of the constraints that are given,
   !> which learn the positions.
   subroutine constraints_create(scene, linear, held, given)
      type(scene_t), intent(in) :: scene
      type(linear_rows_t), intent(in) :: linear  !! of `scene`
      type(constraint_box_t), allocatable, intent(out) :: held(:)   !! (n_own + given ones)
      type(host_t), intent(in), optional :: given
      type(linear_conditions_t), allocatable :: conditions
      type(rigidity_t), allocatable :: rigidity
      class(constraint_t), allocatable :: new
      integer :: i, n

      n = 0
      if (present(given)) then
         if (allocated(given%constraint)) n = size(given%constraint)
      end if
      allocate(held(n_own + n), conditions, rigidity)
      call linear_conditions_init(conditions, linear)
      call move_alloc(conditions, held(1)%constraint)
      call rigidity_init(rigidity, scene%rigid)
      call move_alloc(rigidity, held(n_own)%constraint)
      do i = 1, n
         allocate(new, source=given%constraint(i)%constraint)
         call new%take_positions(scene%x)
         call move_alloc(new, held(n_own + i)%constraint)
      end do
   end subroutine constraints_create

end module emcon_constraint_registry
