!> Internal forces that stay the same over a step: those at its start, of a scheme that takes them
!> there.
module emcon_lagged_forces
   use emcon_kinds, only : wp
   use emcon_term, only : forces_t, response_t, role_internal
   use emcon_vectors, only : vector_copy
   implicit none
   private
   public :: lagged_forces_t, lagged_forces_take, lagged_forces_give

   type :: lagged_forces_t
      logical :: is_known = .false.              !! there are such forces
      logical :: is_on = .false.                 !! they stand for those of the terms
      type(forces_t), private :: internal
      real(wp), allocatable, private :: rounding(:, :)   !! (n_dim, n_node)
   end type lagged_forces_t

contains

   !> Keep the forces of a response to a motion that does not move.
   subroutine lagged_forces_take(self, response)
      type(lagged_forces_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      self%internal = response%part(role_internal)
      self%rounding = response%rounding
      self%is_known = .true.
   end subroutine lagged_forces_take

   !> Give them to a response that has begun.
   subroutine lagged_forces_give(self, response)
      type(lagged_forces_t), intent(in) :: self  !! known
      type(response_t), intent(inout) :: response
      integer :: n

      n = size(self%rounding)
      associate (to => response%part(role_internal))
         call vector_copy(n, self%internal%force, to%force)
         if (.not. response%with_sizes) return
         call vector_copy(n, self%internal%magnitude, to%magnitude)
         call vector_copy(n, self%rounding, response%rounding)
      end associate
   end subroutine lagged_forces_give

end module emcon_lagged_forces
