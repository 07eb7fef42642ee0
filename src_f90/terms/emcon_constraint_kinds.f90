!> The constraints that hold at the end of every step, in the order in which they are listed.
submodule (emcon_constraint_registry) emcon_constraint_kinds
   use emcon_constraint, only : constraint_t
   use emcon_linear_conditions, only : linear_conditions_init, linear_conditions_t
   use emcon_rigidity, only : rigidity_init, rigidity_t
   implicit none

   !> Those that every model has; what is given comes after them.
   integer, parameter :: n_own = 2

contains

   module procedure constraints_create
      type(linear_conditions_t), allocatable :: conditions
      type(rigidity_t), allocatable :: rigidity
      class(constraint_t), allocatable :: new
      integer :: i, n

      n = 0
      if (present(host)) then
         if (allocated(host%constraint)) n = size(host%constraint)
      end if
      allocate(held(n_own + n), conditions, rigidity)
      call linear_conditions_init(conditions, linear)
      call move_alloc(conditions, held(1)%constraint)
      call rigidity_init(rigidity, scene%rigid)
      call move_alloc(rigidity, held(n_own)%constraint)
      do i = 1, n
         allocate(new, source=host%constraint(i)%constraint)
         call new%take_positions(scene%x)
         call move_alloc(new, held(n_own + i)%constraint)
      end do
   end procedure constraints_create

end submodule emcon_constraint_kinds
