!> What callers of a stepper may hand over wrongly, in words: which argument, where in it.
module emcon_stepper_check
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_steps, only : step_is_dynamic
   use emcon_text, only : to_text
   implicit none
   private
   public :: stepper_check_open, stepper_check_smooth, stepper_is_damped
   public :: check_that, check_field, check_list, &
      check_size, check_choice, check_number

contains

   !> There is a model to work with.
   pure subroutine stepper_check_open(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      call check_that(allocated(self%march%scheme), &
         "there is no model: none was built, or building it failed", error)
   end subroutine stepper_check_open

   !> There is no friction and no damping: what sticks, what slides and what is near is told by no
   !> query of a step from the state.
   pure subroutine stepper_check_smooth(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      call check_that(.not. any(self%scene%pair%interaction%friction > 0.0_wp), "contact with " &
         // "*FRICTION is not evaluated from outside: advance the model by increments", error)
      call check_that(.not. stepper_is_damped(self), "contact with *CONTACT DAMPING is not " // &
         "evaluated from outside: advance the model by increments", error)
   end subroutine stepper_check_smooth

   !> Does contact have damping, in steps with inertia?
   pure logical function stepper_is_damped(self) result(is_damped)
      type(stepper_t), intent(in) :: self

      is_damped = any(self%scene%pair%interaction%damping%coefficient > 0.0_wp) .and. &
         step_is_dynamic(self%scene%step(self%march%state%clock%i_step))
   end function stepper_is_damped

   !> An input error of this text, unless something holds.
   pure subroutine check_that(holds, text, error)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      if (.not. (holds .or. allocated(error))) call raise(error, err_input, text)
   end subroutine check_that

   !> A nodal field called `name` has the right shape and is finite.
   pure subroutine check_field(name, field, scene, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: field(:, :)                  !! (n_dim, n_node)
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done
      integer :: i

      if (allocated(error)) return
      if (any(shape(field) /= shape(scene%x))) then
         call raise(error, err_input, name // " is to have " // &
            to_text(size(scene%x, 1)) // " components at each of " // &
            to_text(size(scene%x, 2)) // " nodes, not " // to_text(size(field, 1)) // " at " // &
            to_text(size(field, 2)))
         return
      end if
      do i = 1, size(field, 2)
         if (all(ieee_is_finite(field(:, i)))) cycle
         call raise(error, err_input, name // " is not finite at node " // &
            to_text(scene%node%label(i)))
         return
      end do
   end subroutine check_field

   !> A list called `name` has `n` entries, all finite.
   pure subroutine check_list(name, list, n, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: list(:)
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done
      integer :: i

      call check_size(name, size(list), n, error)
      if (allocated(error)) return
      i = findloc(ieee_is_finite(list), .false., 1)
      if (i > 0) call raise(error, err_input, name // " is not finite at entry " // to_text(i))
   end subroutine check_list

   !> A list called `name` has as many entries as it has to.
   pure subroutine check_size(name, n, expected, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n, expected
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      if (allocated(error) .or. n == expected) return
      call raise(error, err_input, name // " is to have " // to_text(expected) // " entries, not " &
         // to_text(n))
   end subroutine check_size

   !> A choice, or a number, called `name` is in `least`..`most`.
   pure subroutine check_choice(name, value, least, most, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: value, least, most
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      if (allocated(error) .or. (value >= least .and. value <= most)) return
      if (most < least) call raise(error, err_input, name // " is " // to_text(value) // &
         ", but there are none")
      if (most >= least) call raise(error, err_input, name // " is " // to_text(value) // &
         ", not in " // to_text(least) // ".." // to_text(most))
   end subroutine check_choice

   !> A number called `name` is finite, and not below `least` nor above `most`.
   pure subroutine check_number(name, value, error, least, most)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done
      real(wp), intent(in), optional :: least, most

      if (allocated(error)) return
      if (.not. ieee_is_finite(value)) then
         call raise(error, err_input, name // " is not finite")
         return
      end if
      if (present(least)) then
         if (value < least) call raise(error, err_input, name // " is " // to_text(value) // &
            ", below " // to_text(least))
      end if
      if (present(most)) then
         if (value > most) call raise(error, err_input, name // " is " // to_text(value) // &
            ", above " // to_text(most))
      end if
   end subroutine check_number

end module emcon_stepper_check
