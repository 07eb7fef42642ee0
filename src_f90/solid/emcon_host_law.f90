!> Constitutive laws that a program gives: the strain energy as a function of the strain at a point,
!> or a type of its own that extends `law_t`.
!>
!> Source: docs/theory.md, section 2 (functions given at points).
module emcon_host_law
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_t, law_t, n_lane
   use emcon_materials, only : material_t
   use emcon_point_function, only : point_failed, point_function_t, point_gradient, point_ok, &
      point_response_t
   use emcon_rotation, only : n_turn
   use emcon_scene, only : scene_t, where_text
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_law_t, host_points_t, host_response_t
   public :: host_law_take, host_points_make_room, host_rest_stiffness, host_answer, host_state

   !> One of two: the energy W(E11, E22, 2 E12), in space W(E11, E22, E33, 2 E12, 2 E23, 2 E13), per
   !> reference volume [M/(L T^2)] of a material, or `law`, which takes the constants of its card.
   !> Without NLGEOM the strain is the small one.
   type :: host_law_t
      character(len=:), allocatable :: material  !! its name
      class(point_function_t), allocatable :: energy
      class(law_t), allocatable :: law
   end type host_law_t

   !> All quadrature points of the elements of one law.
   type :: host_points_t
      real(wp), allocatable :: strain(:, :), dstrain(:, :)   !! (3 or 6, n)
      type(point_response_t) :: response
   end type host_points_t

   !> What the given laws answer to a step.
   type :: host_response_t
      real(wp) :: square = 1.0_wp                !! part of squares in the strains of the step
      type(host_points_t), allocatable :: points(:)         !! one per material
      integer :: inverted_element = 0            !! first one that cannot be answered for, or 0
      integer :: material = 0                    !! that has no value there, or 0: det F <= 0
      integer :: status = point_ok               !! what the law of `material` said
   end type host_response_t

contains

   !> Take the law of `material` from those that are `user`.
   subroutine host_law_take(scene, material, law, error, user)
      type(scene_t), intent(in) :: scene
      type(material_t), intent(in) :: material
      type(host_law_t), intent(inout) :: law
      type(error_t), allocatable, intent(out) :: error
      type(host_law_t), intent(in), optional :: user(:)    !! one for each such material
      character(len=:), allocatable :: fault
      integer :: i, n_strain

      n_strain = scene%n_dim + n_turn(scene%n_dim)
      if (present(user)) then
         do i = 1, size(user)
            if (user(i)%material /= material%name) cycle
            law%material = material%name
            if (allocated(user(i)%energy)) allocate(law%energy, source=user(i)%energy)
            if (allocated(user(i)%law)) allocate(law%law, source=user(i)%law)
         end do
      end if
      if (allocated(law%law)) then
         call law%law%take(material%constant, fault)
         law%law%density = material%density
         if (fault /= "") call raise(error, err_input, where_text(scene, material%origin) &
            // ": error: material " // material%name // ": " // fault)
         return
      end if
      if (.not. allocated(law%energy)) then
         call raise(error, err_input, where_text(scene, material%origin) // ": error: material " &
            // material%name // " is a *USER MATERIAL: a program has to give its strain energy, " &
            // "after the deck is read and before the model is built")
      else if (law%energy%n_variable /= n_strain) then
         call raise(error, err_input, "the law given for material " // material%name // " has " &
            // to_text(law%energy%n_variable) // " variables, but a strain has " &
            // to_text(n_strain))
      end if
      if (allocated(error)) return
      law%energy%weight = spread(1.0_wp, 1, n_strain)          ! |E|^2: axes do not matter
      law%energy%weight(scene%n_dim + 1:) = 0.5_wp
   end subroutine host_law_take

   !> Room for `n` points.
   pure subroutine host_points_make_room(self, n_strain, n)
      type(host_points_t), intent(inout) :: self
      integer, intent(in) :: n_strain            !! components of a strain
      integer, intent(in) :: n                   !! >= 0

      if (allocated(self%strain)) return
      allocate(self%strain(n_strain, n), self%dstrain(n_strain, n), source=0.0_wp)
   end subroutine host_points_make_room

   !> The response at point `i`. The stress normal to the plane is not known, and given as 0.
   pure function host_state(self, i) result(state)
      type(host_points_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to the number of points
      type(law_response_t) :: state

      state%energy = self%response%energy(i)
      state%stress = self%response%gradient(:, i)
      state%tangent = self%response%tangent(:, :, i)
   end function host_state

   !> What the law has answered at the points `i`, side by side.
   pure subroutine host_answer(self, i, energy, stress, tangent)
      type(host_points_t), intent(in) :: self
      integer, intent(in) :: i(n_lane)           !! 1 to the number of points
      real(wp), intent(out) :: energy(n_lane)    !! at the end [M/(L T^2)]
      real(wp), intent(out) :: stress(:, :)      !! (n_lane, n_strain) [M/(L T^2)]
      real(wp), intent(inout) :: tangent(:, :, :)    !! (n_lane, n_strain, n_strain)
      integer :: l

      do l = 1, n_lane
         energy(l) = self%response%energy(i(l))
         stress(l, :) = self%response%gradient(:, i(l))
         tangent(l, :, :) = self%response%tangent(:, :, i(l))
      end do
   end subroutine host_answer

   !> Largest second derivative at rest, as half of it: what a step of no size has as its tangent.
   subroutine host_rest_stiffness(law, stiffness, error)
      type(host_law_t), intent(in) :: law
      real(wp), intent(inout) :: stiffness       !! [M/(L T^2)]; not set after an error
      type(error_t), allocatable, intent(out) :: error
      type(point_response_t) :: response
      real(wp) :: rest(law%energy%n_variable, 1)
      integer :: status

      rest = 0.0_wp
      call point_gradient(law%energy, rest, rest, .true., response, status)
      if (status == point_ok) then
         stiffness = maxval(abs(response%tangent(:, :, 1)))
      else if (status == point_failed) then
         call raise(error, err_analysis, "the law given for material " // law%material // &
            " has failed at zero strain")
      else
         call raise(error, err_input, "the law given for material " // law%material // &
            " has no finite value at zero strain")
      end if
   end subroutine host_rest_stiffness

end module emcon_host_law
