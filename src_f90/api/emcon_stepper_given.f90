!> What a program gives to a model between reading its deck and building it.
module emcon_stepper_given
   use emcon_errors, only : err_input, error_t, raise
   use emcon_given_law, only : given_law_t
   use emcon_point_function, only : point_function_t
   use emcon_scene, only : law_given, where_text
   use emcon_stepper, only : stepper_t
   use emcon_text, only : to_upper
   implicit none
   private
   public :: stepper_give_law

contains

   !> Give the strain energy of the *USER MATERIAL called `name`: W(E11, E22, 2 E12) per reference
   !> volume [M/(L T^2)]. A copy is kept, also for a restart file that is loaded afterwards.
   subroutine stepper_give_law(self, name, energy, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! small or capital letters
      class(point_function_t), intent(in) :: energy
      type(error_t), allocatable, intent(out) :: error
      type(given_law_t), allocatable :: given(:)
      integer :: i, n

      call check_material(self, to_upper(trim(adjustl(name))), error)
      if (allocated(error)) return
      n = 0
      if (allocated(self%given_law)) n = size(self%given_law)
      allocate(given(n + 1))
      do i = 1, n
         given(i)%material = self%given_law(i)%material
         call move_alloc(self%given_law(i)%energy, given(i)%energy)
      end do
      given(n + 1)%material = to_upper(trim(adjustl(name)))
      allocate(given(n + 1)%energy, source=energy)
      call move_alloc(given, self%given_law)
   end subroutine stepper_give_law

   !> Can a law be given for the material `name` now?
   subroutine check_material(self, name, error)
      type(stepper_t), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k

      if (.not. self%is_read) then
         call raise(error, err_input, "there is no scene: no deck was read, or reading it failed")
         return
      else if (allocated(self%march%scheme)) then
         call raise(error, err_input, "the model is built already: laws are given before")
         return
      end if
      k = 0
      do i = 1, size(self%scene%material)
         if (self%scene%material(i)%name == name) k = i
      end do
      if (k == 0) then
         call raise(error, err_input, "there is no material " // name // " in the deck")
      else if (self%scene%material(k)%law /= law_given) then
         call raise(error, err_input, "material " // name // " (" // where_text(self%scene, &
            self%scene%material(k)%origin) // ") has a law of its own: to give one, it has to be " &
            // "a *USER MATERIAL")
      else if (allocated(self%given_law)) then
         do i = 1, size(self%given_law)
            if (self%given_law(i)%material == name) call raise(error, err_input, &
               "the law of material " // name // " is given already")
         end do
      end if
   end subroutine check_material

end module emcon_stepper_given
