!> Loads found, changed and added between steps.
!>
!> What is said holds for the present step of the deck. With an amplitude a value is what the
!> amplitude is multiplied by. Without one, the linear runs of a static step go on from where they
!> are to the new value at the end of the step; in a dynamic step it holds from the next step on.
module emcon_stepper_loads
   use emcon_errors, only : error_t
   use emcon_factor_policy, only : factor_policy_forget
   use emcon_kinds, only : wp
   use emcon_march, only : march_renumber
   use emcon_prescribed, only : ramp_at, ramp_turn
   use emcon_reduction, only : freedom_numbers
   use emcon_restart_data, only : restart_exchange, restart_offers, restart_size, restart_t
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_takes_force
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_choice, check_list, check_number, check_size, check_that, &
      stepper_check_open
   use emcon_steps, only : load_centrifugal, load_gravity, load_moment, load_point, load_pressure, &
      load_t, prescribed_find
   use emcon_system, only : system_renew
   use emcon_text, only : to_text
   implicit none
   private
   public :: stepper_find_load, stepper_set_load, stepper_add_loads
   public :: loads_exchange

   integer, parameter :: n_component = 3             !! of a direction, in the plane too

contains

   !> Number of the load of this kind in the present step: on degree of freedom `place` of node
   !> `label` (`load_point`), on face `place` of element `label` (`load_pressure`), or on element
   !> `label` (`load_gravity`). Of several the first.
   subroutine stepper_find_load(self, kind, label, place, load, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: kind                    !! one of `load_`
      integer, intent(in) :: label                   !! as in the deck
      integer, intent(in) :: place                   !! not looked at for gravity
      integer, intent(out) :: load                   !! 1..number of loads of the step
      type(error_t), allocatable, intent(out) :: error

      load = 0
      call stepper_check_open(self, error)
      if (allocated(error)) return
      associate (i_step => self%march%state%clock%i_step)
         load = place_in(self%scene%step(i_step)%load, kind, find_target(self%scene, kind, label), &
            place)
         call check_that(load > 0, "there is no load of this kind on " // &
            trim(noun_of(kind)) // " " // to_text(label) // " in step " // to_text(i_step) // &
            " of the deck; one that is not there can be added", error)
      end associate
   end subroutine stepper_find_load

   !> Give load `load` of the present step the value `value`.
   subroutine stepper_set_load(self, load, value, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: load                    !! 1..number of loads of the step
      real(wp), intent(in) :: value                  !! force | pressure | acceleration
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: now

      call stepper_check_open(self, error)
      call check_number("the value", value, error)
      if (allocated(error)) return
      associate (state => self%march%state, step => self%scene%step(self%march%state%clock%i_step))
         call check_that(load >= 1 .and. load <= size(step%load), "there is no load " // &
            to_text(load) // ": step " // to_text(state%clock%i_step) // " of the deck has " // &
            to_text(size(step%load)), error)
         if (allocated(error)) return
         associate (own => step%load(load))
            now = ramp_at(step, state%clock%step_time, own%value_start, own%value)
            call ramp_turn(step, state%clock%step_time, now, value, own%value_start)
            own%value = value
         end associate
      end associate
      call system_renew(self%march%system, self%scene)
      self%march%state%base%is_set = .false.
      call factor_policy_forget(self%march%newton%factor_policy, self%march%newton%correction)
   end subroutine stepper_set_load

   !> Add loads of one kind to the present step, where it has none of that kind; without amplitude.
   !> In a static step they run from 0. The state stays; on an error nothing changes.
   subroutine stepper_add_loads(self, kind, label, place, value, direction, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: kind                    !! one of `load_`: point, pressure, gravity
      integer, intent(in) :: label(:)                !! (n) as in the deck
      integer, intent(in) :: place(:)                !! (n) not looked at for gravity
      real(wp), intent(in) :: value(:)               !! (n) force | pressure | acceleration
      real(wp), intent(in), optional :: direction(:) !! (3) of gravity, of any length
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(load_t), allocatable :: list(:), before(:)
      integer, allocatable :: number(:)
      integer :: i, n

      call stepper_check_open(self, error)
      call check_that(any(kind == [load_point, load_pressure, load_gravity]), "kind " // &
         to_text(kind) // " is not one of loads that can be added", error)
      call check_size("the list of places", size(place), size(label), error)
      call check_list("the list of values", value, size(label), error)
      if (kind == load_gravity) call check_direction(self%scene, direction, error)
      if (allocated(error) .or. size(label) == 0) return
      allocate(number, source=freedom_numbers(self%march%system%space%numbering))
      associate (step => self%scene%step(self%march%state%clock%i_step))
         n = size(step%load)
         allocate(list(n + size(label)))
         list(:n) = step%load
         do i = 1, size(label)
            associate (new => list(n + i))
               new%kind = kind
               new%target = find_target(self%scene, kind, label(i))
               new%place = merge(0, place(i), kind == load_gravity)
               call check_place(self, new, label(i), number, error)
               call check_that(place_in(list(:n + i - 1), kind, new%target, new%place) == 0, &
                  "there is such a load on " // trim(noun_of(kind)) // " " // &
                  to_text(label(i)) // " already: it can be given another value", error)
               if (allocated(error)) return
               new%value = value(i)
               call ramp_turn(step, self%march%state%clock%step_time, 0.0_wp, value(i), &
                  new%value_start)
               if (kind == load_gravity) new%direction = direction/norm2(direction)
            end associate
         end do
         call move_alloc(step%load, before)
         call move_alloc(list, step%load)
         call march_renumber(self%march, self%scene, error)
         if (.not. allocated(error)) return
         call move_alloc(before, step%load)
      end associate
      call march_renumber(self%march, self%scene, ignored)
   end subroutine stepper_add_loads

   !> Index of the node or element of a label; 0: there is none.
   pure integer function find_target(scene, kind, label)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: kind                    !! one of `load_`
      integer, intent(in) :: label

      if (kind == load_point) then
         find_target = findloc(scene%node%label, label, 1)
      else
         find_target = findloc(scene%element%label, label, 1)
      end if
   end function find_target

   !> What a load of this kind acts on.
   pure character(len=7) function noun_of(kind)
      integer, intent(in) :: kind                    !! one of `load_`

      noun_of = merge("node   ", "element", kind == load_point)
   end function noun_of

   !> The first load of this kind there; 0: there is none.
   pure integer function place_in(list, kind, target, place)
      type(load_t), intent(in) :: list(:)
      integer, intent(in) :: kind                    !! one of `load_`
      integer, intent(in) :: target                  !! node or element; 0: none
      integer, intent(in) :: place                   !! not looked at for gravity

      place_in = 0
      if (target > 0) place_in = findloc(list%kind == kind .and. list%target == target &
         .and. (list%place == place .or. kind == load_gravity), .true., 1)
   end function place_in

   !> Gravity has a direction of the model; that of solids of revolution is their axis.
   pure subroutine check_direction(scene, direction, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), optional :: direction(:)
      type(error_t), allocatable, intent(inout) :: error

      call check_that(present(direction), "gravity needs a direction", error)
      if (allocated(error)) return
      call check_list("the direction of gravity", direction, n_component, error)
      if (allocated(error)) return
      call check_that(norm2(direction) > 0.0_wp, "the direction of gravity is 0", error)
      call check_that(.not. any(abs(direction(scene%n_dim + 1:)) > 0.0_wp), &
         "the model is plane: gravity has no third component", error)
      call check_that(scene_takes_force(scene, direction), "gravity across " &
         // "the axis of a solid of revolution (CAX) is not the same all around: its direction " &
         // "is 0, 1 or 0, -1", error)
   end subroutine check_direction

   !> The load acts on something of the model.
   subroutine check_place(self, load, label, number, error)
      type(stepper_t), intent(in) :: self
      type(load_t), intent(in) :: load
      integer, intent(in) :: label                   !! of its target
      integer, intent(in) :: number(:)               !! (n_dim*n_node) as `freedom_numbers`
      type(error_t), allocatable, intent(inout) :: error
      integer :: section

      call check_that(load%target > 0, "there is no " // trim(noun_of(load%kind)) // " " // &
         to_text(label), error)
      if (allocated(error)) return
      select case (load%kind)
      case (load_point)
         call check_choice("the degree of freedom", load%place, 1, self%scene%n_dim, error)
         if (allocated(error)) return
         call check_that(number(self%scene%n_dim*(load%target - 1) + load%place) > 0 .or. &
            prescribed_find(self%scene%step(self%march%state%clock%i_step)%prescribed, &
            load%target, load%place) > 0, "node " // to_text(label) &
            // " belongs to no element and no " // "equation", error)
      case (load_pressure)
         call check_choice("the face", load%place, 1, &
            self%scene%element%kinds(self%scene%element%kind(load%target))%n_face, error)
      case (load_gravity)
         section = self%scene%element%section(load%target)
         call check_that(self%scene%material(self%scene%section(section)%material)%density &
            > 0.0_wp, "element " // to_text(label) // " has no mass: its material has no " // &
            "*DENSITY", error)
      end select
   end subroutine check_place

   !> Put the loads of a step into `restart`, or take them from it into `list`; a file without their
   !> places has values of those of the deck.
   subroutine loads_exchange(restart, scene, i_step, list, error)
      type(restart_t), intent(inout) :: restart
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step                  !! from 1
      type(load_t), allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      logical :: has_places
      integer :: n, n_old, k

      has_places = restart_offers(restart, "load_place", .true.)
      n_old = size(scene%step(i_step)%load)
      n = n_old
      if (restart%is_reading .and. has_places) n = max(0, restart_size(restart, "load_value")/2)
      allocate(list(n))
      list(:min(n, n_old)) = scene%step(i_step)%load(:min(n, n_old))
      call restart_exchange(restart, "load_value", list%value)
      call restart_exchange(restart, "load_value", list%value_start)
      if (.not. has_places) return
      call restart_exchange(restart, "load_place", list%kind)
      call restart_exchange(restart, "load_place", list%target)
      call restart_exchange(restart, "load_place", list%place)
      call restart_exchange(restart, "load_place", list%amplitude)
      do k = 1, n_component
         call restart_exchange(restart, "load_axis", list%direction(k))
         call restart_exchange(restart, "load_axis", list%point(k))
      end do
      do k = 1, n
         call check_that(is_possible(scene, list(k)), "the restart data do not fit the scene: " // &
            "'load_place' has a load on what is not there", error)
      end do
   end subroutine loads_exchange

   !> Kind, target, place and amplitude of a load are some of the scene.
   pure logical function is_possible(scene, load)
      type(scene_t), intent(in) :: scene
      type(load_t), intent(in) :: load
      integer :: n_target

      n_target = size(scene%element%label)
      if (any(load%kind == [load_point, load_moment])) n_target = size(scene%node%label)
      is_possible = load%kind >= load_point .and. load%kind <= load_centrifugal &
         .and. load%target >= 1 .and. load%target <= n_target &
         .and. load%amplitude >= 0 .and. load%amplitude <= size(scene%amplitude)
      if (.not. is_possible) return
      select case (load%kind)
      case (load_point)
         is_possible = load%place >= 1 .and. load%place <= scene%n_dim
      case (load_pressure)
         is_possible = load%place >= 1 .and. load%place &
            <= scene%element%kinds(scene%element%kind(load%target))%n_face
      case (load_moment)
         is_possible = any(scene%rigid%reference == load%target)
      end select
   end function is_possible

end module emcon_stepper_loads
