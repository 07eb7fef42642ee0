!> *INITIAL CONDITIONS: displacements and velocities at the start; those of rigid bodies are given
!> at their reference nodes.
module emcon_deck_initial
   use emcon_deck_dimension, only : freedoms_text, n_plane
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_integer, &
      get_real, next_line
   use emcon_deck_named, only : get_nodes
   use emcon_deck_reader, only : card_error, card_t, note_idle, option_name, reader_t, refuse_option
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_rotation, only : cross_product, n_turn
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_turn_plane, only : turned_left
   implicit none
   private
   public :: read_initial_conditions

   !> Number of the rotation in the plane, and of the numbers that tell two points of an axis.
   integer, parameter :: last_freedom = 6, n_axis = 6
   !> Nodes of a rigid body may differ so much from its motion: decks round.
   real(wp), parameter :: rounding = 1.0e-6_wp

   !> One of the two fields while it grows.
   type :: field_t
      real(wp), allocatable :: value(:, :)         !! (n_dim, n_node) [L] or [L/T]
      logical, allocatable :: is_given(:)          !! (n_node)
      real(wp), allocatable :: spin(:, :)          !! (n_turn, n_rigid) [1/T]
      type(origin_t) :: origin                     !! of the last card
   end type field_t

contains

   !> All cards; of values for one place the last one holds.
   subroutine read_initial_conditions(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      character(len=*), parameter :: known = "VELOCITY, ROTATING VELOCITY, DISPLACEMENT"
      type(field_t) :: u, v
      integer :: i

      call begin(u, scene)
      call begin(v, scene)
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            if (card%name /= "INITIALCONDITIONS") cycle
            select case (option_name(card, "TYPE"))
            case ("VELOCITY")
               call read_values(reader, card, scene, .true., v)
            case ("ROTATINGVELOCITY")
               call read_rotating(reader, card, scene, v)
            case ("DISPLACEMENT")
               call read_values(reader, card, scene, .false., u)
            case ("")
               call card_error(reader, card, "TYPE=VELOCITY or TYPE=DISPLACEMENT is missing")
            case ("TEMPERATURE")
               call note_idle(reader, card%title // ", TYPE=TEMPERATURE", &
                  "no step changes a temperature")
            case ("STRESS", "PLASTICSTRAIN", "SOLUTION", "HARDENING", "CONTACT")
               call refuse_option(reader, card, "TYPE", known, "a run starts without stress")
            case default
               call refuse_option(reader, card, "TYPE", known, "")
            end select
         end associate
      end do
      call follow_references(reader, scene, u, "displacement")
      call follow_references(reader, scene, v, "velocity")
      call move_alloc(u%value, scene%u0)
      call move_alloc(v%value, scene%v0)
   end subroutine read_initial_conditions

   pure subroutine begin(self, scene)
      type(field_t), intent(out) :: self
      type(scene_t), intent(in) :: scene

      allocate(self%value(scene%n_dim, size(scene%node%label)), source=0.0_wp)
      allocate(self%is_given(size(scene%node%label)), source=.false.)
      allocate(self%spin(n_turn(scene%n_dim), size(scene%rigid)), source=0.0_wp)
   end subroutine begin

   !> Lines of node or set, degree of freedom, value.
   subroutine read_values(reader, card, scene, may_turn, field)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: may_turn              !! reference nodes may have a spin
      type(field_t), intent(inout) :: field
      type(data_t) :: data
      integer, allocatable :: item(:), turning(:)
      integer :: dof
      real(wp) :: value

      field%origin = card%origin
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 3, 3, "node or node set, degree of freedom, value")
         if (.not. data%ok) cycle
         call get_integer(reader, data, 2, "degree of freedom", dof)
         if (data%ok .and. (dof > 3 .and. dof <= last_freedom - size(field%spin, 1) &
            .or. dof > last_freedom)) call data_error(reader, data, "degree of freedom " // &
            to_text(dof) // " does not exist; known: " // freedoms_text(scene%n_dim))
         value = 0.0_wp
         call get_real(reader, data, 3, "value", value)
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (.not. data%ok) cycle
         if (dof <= scene%n_dim) then
            call split_turning(scene, item, turning)
            if (size(turning) > 0 .and. may_turn) call put_spin(reader, data, scene, turning, &
               last_freedom - size(field%spin, 1) + dof, value, field)
            field%value(dof, item) = value
            field%is_given(item) = .true.
         else if (dof > last_freedom - size(field%spin, 1) .and. may_turn) then
            call put_spin(reader, data, scene, item, dof, value, field)
         else if (abs(value) > 0.0_wp) then
            call data_error(reader, data, trim(merge("the model is plane", &
               "nodes do not turn ", scene%n_dim == n_plane)) // ": degree of freedom " // &
               to_text(dof) // " must start at 0")
         end if
      end do
   end subroutine read_values

   !> The ROT NODEs of rigid bodies go out of a list of nodes; their reference nodes come back.
   pure subroutine split_turning(scene, item, reference)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(inout) :: item(:)
      integer, allocatable, intent(out) :: reference(:)
      integer :: body(size(item)), i

      body = [(findloc(scene%rigid%turning, item(i), 1), i = 1, size(item))]
      reference = scene%rigid(pack(body, body > 0))%reference
      item = pack(item, body == 0)
   end subroutine split_turning

   !> The spin of the rigid bodies whose reference nodes `item` are.
   subroutine put_spin(reader, data, scene, item, dof, value, field)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item(:)               !! nodes
      integer, intent(in) :: dof                   !! about x, y, z: 4, 5, 6; in the plane 6
      real(wp), intent(in) :: value                !! [1/T]
      type(field_t), intent(inout) :: field
      integer :: i, b

      do i = 1, size(item)
         b = findloc(scene%rigid%reference, item(i), 1)
         if (b > 0) then
            field%spin(dof + size(field%spin, 1) - last_freedom, b) = value
            field%is_given(item(i)) = .true.
         else if (abs(value) > 0.0_wp .and. .not. reader%doubt%rigid) then
            call data_error(reader, data, "node " // to_text(scene%node%label(item(i))) // &
               " cannot turn: degree of freedom " // to_text(dof) // " is that of the reference " &
               // "node of a *RIGID BODY")
            return
         end if
      end do
   end subroutine put_spin

   !> Pairs of lines: node or set, spin, velocity of the axis; then a point on it, or two.
   subroutine read_rotating(reader, card, scene, field)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(field_t), intent(inout) :: field
      type(data_t) :: data
      integer, allocatable :: item(:)
      real(wp) :: spin, velocity(3), axis(n_axis)
      integer :: i

      field%origin = card%origin
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 5, "node or node set, spin, velocity of the axis")
         spin = 0.0_wp
         velocity = 0.0_wp
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (data%ok) call get_real(reader, data, 2, "spin", spin)
         do i = 1, 3
            if (data%ok) call get_real(reader, data, 2 + i, "velocity", velocity(i))
         end do
         if (data%ok .and. any(abs(velocity(scene%n_dim + 1:)) > 0.0_wp)) call data_error(reader, &
            data, "the model is plane: the velocity along 3 must be 0")
         if (.not. data%ok) return
         call read_axis(reader, data, scene%n_dim, axis)
         if (.not. data%ok) return
         do i = 1, size(item)
            field%value(:, item(i)) = velocity(:scene%n_dim) &
               + spin*turned(scene%x(:, item(i)), axis)
         end do
         field%is_given(item) = .true.
         do i = 1, size(scene%rigid)
            if (any(item == scene%rigid(i)%reference)) field%spin(:, i) = spin*about(axis, &
               scene%n_dim)
         end do
      end do
   end subroutine read_rotating

   !> A spin of one about an axis, by its components.
   pure function about(axis, n_dim) result(spin)
      real(wp), intent(in) :: axis(:)              !! (n_axis) [L]
      integer, intent(in) :: n_dim
      real(wp) :: spin(n_turn(n_dim))

      spin = 1.0_wp
      if (n_dim == n_plane) return
      spin = axis(n_dim + 1:) - axis(:n_dim)
      spin = spin/norm2(spin)
   end function about

   !> How the end of an arm moves by a spin.
   pure function carried(arm, spin) result(velocity)
      real(wp), intent(in) :: arm(:)               !! (n_dim) [L]
      real(wp), intent(in) :: spin(:)              !! (n_turn) [1/T]
      real(wp) :: velocity(size(arm))

      if (size(arm) == n_plane) then
         velocity = spin(1)*turned_left(arm)
      else
         velocity = cross_product(spin, arm)
      end if
   end function carried

   !> How a point at `x` moves by a unit spin about an axis: two points of it, or one in the plane.
   pure function turned(x, axis) result(velocity)
      real(wp), intent(in) :: x(:)                 !! (n_dim) [L]
      real(wp), intent(in) :: axis(:)              !! (n_axis) [L]
      real(wp) :: velocity(size(x))

      velocity = carried(x - axis(:size(x)), about(axis, size(x)))
   end function turned

   !> The line behind: a point on the axis; in the plane a second one has to be above it, along 3,
   !> in space there has to be one.
   subroutine read_axis(reader, data, n_dim, axis)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: n_dim
      real(wp), intent(out) :: axis(:)             !! (n_axis) [L]
      logical :: is_there
      integer :: i

      axis = 0.0_wp
      is_there = next_line(reader, data)
      if (.not. is_there) then
         call data_error(reader, data, "the line with a point on the axis is missing")
         return
      end if
      call check_count(reader, data, 1, n_axis, "coordinates of a point on the axis, or of two")
      do i = 1, data%n
         if (data%ok) call get_real(reader, data, i, "coordinate", axis(i))
      end do
      if (n_dim /= n_plane) then
         if (data%ok .and. .not. any(abs(axis(n_dim + 1:) - axis(:n_dim)) > 0.0_wp)) then
            call data_error(reader, data, "the axis needs two points: x, y, z and x, y, z")
         end if
         return
      end if
      if (.not. data%ok .or. data%n <= 3) return
      if (any(abs(axis(4:5) - axis(:2)) > 0.0_wp) .or. .not. axis(n_axis) > axis(3)) then
         call data_error(reader, data, "the model is plane: the axis goes along 3, from its " // &
            "first point up to a second one")
      end if
   end subroutine read_axis

   !> Rigid bodies start as their reference nodes do. What is given at their other nodes has to fit.
   subroutine follow_references(reader, scene, field, name)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(field_t), intent(inout) :: field
      character(len=*), intent(in) :: name
      real(wp) :: start(scene%n_dim), largest
      integer :: b, i

      do b = 1, size(scene%rigid)
         associate (body => scene%rigid(b))
            largest = maxval(abs(field%value(:, body%node)))
            do i = 1, size(body%node)
               start = field%value(:, body%reference) + carried(scene%x(:, body%node(i)) &
                  - scene%x(:, body%reference), field%spin(:, b))
               if (field%is_given(body%node(i)) .and. any(abs(field%value(:, body%node(i)) &
                  - start) > rounding*largest)) then
                  call add_error(reader%log, field%origin, "*INITIAL CONDITIONS: the " // name &
                     // " of node " // to_text(scene%node%label(body%node(i))) // &
                     " does not fit the motion of rigid body " // body%name // &
                     "; give it at the reference node " // &
                     to_text(scene%node%label(body%reference)) // ", degrees of freedom " &
                     // trim(merge("1, 2, 6", "1 to 6 ", scene%n_dim == n_plane)))
                  exit
               end if
               field%value(:, body%node(i)) = start
            end do
         end associate
      end do
   end subroutine follow_references

end module emcon_deck_initial
