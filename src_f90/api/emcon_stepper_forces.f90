!> What a stepper is given from outside: forces and mass, between reading the deck and building.
!>
!> Nodes that stand in no element of the deck are part of the model where they are given something.
!> Gravity acts on the mass of elements only: the weight of given mass is for the giver to add.
module emcon_stepper_forces
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_given_check, only : given_check_force, given_check_mass
   use emcon_given_force, only : given_add_force, given_force_t
   use emcon_stepper, only : stepper_t
   implicit none
   private
   public :: stepper_give_force, stepper_give_mass

contains

   !> Give the model a copy of `force`. Forces add up.
   subroutine stepper_give_force(self, force, error)
      type(stepper_t), intent(inout) :: self
      class(given_force_t), intent(in) :: force
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_time(self, error)
      if (.not. allocated(error)) call given_check_force(force, size(self%scene%x, 2), error)
      if (.not. allocated(error)) call given_add_force(self%given, force)
   end subroutine stepper_give_force

   !> Give the model a mass beside that of its elements, the same in both directions: symmetric, and
   !> no mass negative.
   subroutine stepper_give_mass(self, mass, error)
      type(stepper_t), intent(inout) :: self
      type(csr_t), intent(in) :: mass                    !! (n_node x n_node) [M]
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_time(self, error)
      if (allocated(error)) return
      if (self%given%mass%n_row > 0) call raise(error, err_input, &
         "a mass was given already; give one matrix with all of it")
      if (.not. allocated(error)) call given_check_mass(mass, self%scene, error)
      if (.not. allocated(error)) self%given%mass = mass
   end subroutine stepper_give_mass

   !> The deck is read, the model is not built.
   subroutine check_time(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%is_read) then
         call raise(error, err_input, "there is no scene to give forces or mass to: no deck was " &
            // "read, or reading it failed")
      else if (allocated(self%march%scheme)) then
         call raise(error, err_input, "forces and mass are given before the model is built")
      end if
   end subroutine check_time

end module emcon_stepper_forces
