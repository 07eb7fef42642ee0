!> The output quantities by their deck names, as arrays. Which there are is said in
!> `emcon_quantity_rows`; of what there is not, values are of no size.
module emcon_quantities
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan, ieee_quiet_nan, ieee_value
   use emcon_contact, only : gap_state_t
   use emcon_evaluation, only : evaluation_at_end
   use emcon_gaps, only : gaps_search
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : at_rest, motion_of
   use emcon_quantity_registry, only : at_contacts, at_elements, at_nodes, at_pairs, &
      at_sections, n_quantity_row, of_area, of_length, of_rotation, of_strain, of_vector, &
      of_wrench, quantity_row, quantity_row_of, quantity_row_t
   use emcon_rigid_bodies, only : rigid_body_t
   use emcon_rigid_rotation, only : rigid_rotation_spin
   use emcon_requests, only : output_section_print
   use emcon_rotation, only : add_moments, n_turn
   use emcon_section_force, only : section_force
   use emcon_solid, only : solid_t
   use emcon_system, only : system_springs
   use emcon_stepper, only : stepper_t
   use emcon_steps, only : step_square
   use emcon_stress, only : element_energies, element_means, nodal_stress, von_mises
   use emcon_surface_area, only : surface_area
   use emcon_term_registry, only : terms_solid
   use emcon_text, only : string_t
   use emcon_vtkhdf, only : field_t
   use emcon_turned_axes, only : stand_in_forces, stand_in_shows
   implicit none
   private
   public :: quantity_values, quantity_components, quantity_fields, quantity_of_field
   public :: quantity_variables
   public :: node_quantity, element_quantity, contact_quantity, contact_field, pair_quantity

contains

   !> The values of a variable, (component, place).
   function quantity_values(stepper, variable, place) result(values)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      integer, intent(in) :: place               !! one of the `at_` codes
      real(dp), allocatable :: values(:, :)

      select case (place)
      case (at_nodes)
         values = node_quantity(stepper, variable)
      case (at_elements)
         values = element_quantity(stepper, variable)
      case (at_contacts)
         values = contact_quantity(stepper, variable)
      case (at_sections)
         values = section_quantity(stepper, variable)
      case (at_pairs)
         values = pair_quantity(stepper, variable)
      case default
         allocate(values(0, 0))
      end select
   end function quantity_values

   !> Their components; 0: there is no such quantity.
   pure integer function quantity_components(variable, place, n_dim) result(n)
      character(len=*), intent(in) :: variable
      integer, intent(in) :: place               !! one of the `at_` codes
      integer, intent(in) :: n_dim
      type(quantity_row_t) :: row

      row = quantity_row_of(variable, place)
      n = row%n_component
      if (row%place == 0) then
         n = 0
      else if (n == of_vector) then
         n = n_dim
      else if (n == of_rotation) then
         n = n_turn(n_dim)
      else if (n == of_strain .or. n == of_wrench) then
         n = n_dim + n_turn(n_dim)
      else if (n == of_length .or. n == of_area) then
         n = merge(1, 0, (n == of_area) .eqv. (n_dim == 3))
      end if
   end function quantity_components

   !> All variables that can stand in the field file.
   pure function quantity_variables() result(names)
      type(string_t), allocatable :: names(:)
      type(quantity_row_t) :: row
      integer :: k, n

      allocate(names(n_quantity_row()))
      n = 0
      do k = 1, n_quantity_row()
         row = quantity_row(k)
         if (row%field == "") cycle
         n = n + 1
         names(n)%text = trim(row%variable)
      end do
      names = names(:n)
   end function quantity_variables

   !> The fields of the field file that a variable stands for.
   pure function quantity_fields(variable, n_dim) result(fields)
      character(len=*), intent(in) :: variable
      integer, intent(in) :: n_dim
      type(field_t), allocatable :: fields(:)
      type(quantity_row_t) :: row
      integer :: n

      row = field_row(variable)
      n = merge(2, 1, row%last /= "")
      allocate(fields(n))
      fields%is_cell = row%place == at_elements
      fields%is_sparse = row%is_sparse
      fields(1)%name = row%field
      fields(1)%n_component = quantity_components(variable, row%place, n_dim) - (n - 1)
      if (n > 1) fields(n)%name = row%last
   end function quantity_fields

   !> The values of the fields of a variable, one field behind the other.
   function quantity_of_field(stepper, variable) result(values)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      type(quantity_row_t) :: row

      row = field_row(variable)
      if (row%place == at_contacts) then
         values = contact_field(stepper, variable)
      else
         values = quantity_values(stepper, variable, row%place)
      end if
   end function quantity_of_field

   !> The row of a variable of the field file; place 0: there is none.
   pure type(quantity_row_t) function field_row(variable) result(row)
      character(len=*), intent(in) :: variable
      integer :: k

      do k = 1, n_quantity_row()
         row = quantity_row(k)
         if (row%variable == variable .and. row%field /= "") return
      end do
      row = quantity_row_t()
   end function field_row

   !> U, V, COORD, RF: (n_dim, n_node); UR, VR, RM (1, n_node); S: Cauchy stress and von Mises
   !> stress (7, n_node).
   function node_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in), target :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp), allocatable :: stress(:, :)
      integer :: i
      type(solid_t), pointer :: solid

      solid => terms_solid(stepper%march%system%term)
      associate (state => stepper%march%state)
         select case (variable)
         case ("U")
            values = real(state%u, dp)
            call stand_in_shows(stepper%scene%node%turned, values)
         case ("V")
            values = real(state%v, dp)
            call stand_in_shows(stepper%scene%node%turned, values)
         case ("COORD")
            values = real(stepper%scene%x + state%u, dp)
            call stand_in_shows(stepper%scene%node%turned, values)
         case ("RF")
            values = real(state%reaction, dp)
            call gather_frames(stepper%scene%rigid, values)
            call stand_in_forces(stepper%scene%node%turned, values)
         case ("UR", "VR", "RM")
            allocate(values(n_turn(size(state%u, 1)), size(state%u, 2)), source=0.0_dp)
            do i = 1, size(stepper%scene%rigid)
               values(1, stepper%scene%rigid(i)%reference) = turning(stepper, variable, i)
            end do
         case ("S")
            allocate(stress(6, size(state%u, 2)), values(7, size(state%u, 2)))
            call nodal_stress(solid, state%u, square(stepper), stress)
            values(:6, :) = real(stress, dp)
            do i = 1, size(values, 2)
               values(7, i) = real(von_mises(stress(:, i)), dp)
            end do
         case default
            allocate(values(0, 0))
         end select
      end associate
   end function node_quantity

   !> The angle, the spin, or the moment of the support of rigid body `b`.
   real(dp) function turning(stepper, variable, b)
      type(stepper_t), intent(in) :: stepper
      character(len=*), intent(in) :: variable   !! UR, VR or RM
      integer, intent(in) :: b

      associate (state => stepper%march%state, scene => stepper%scene)
         select case (variable)
         case ("UR")
            turning = real(state%turns%angle(b), dp)
         case ("VR")
            turning = real(rigid_rotation_spin(scene%rigid(b), scene%x, state%u, state%v), dp)
         case ("RM")
            turning = real(state%turns%moment(b), dp)
         end select
      end associate
   end function turning

   !> Forces on the nodes of the frame of a rigid body are those on its reference node; those on its
   !> arms are a moment.
   pure subroutine gather_frames(rigid, values)
      type(rigid_body_t), intent(in) :: rigid(:)
      real(dp), intent(inout) :: values(:, :)
      real(dp) :: total(size(values, 1))
      integer :: b

      do b = 1, size(rigid)
         total = sum(values(:, rigid(b)%frame), 2)
         values(:, rigid(b)%frame) = 0.0_dp
         values(:, rigid(b)%reference) = total
         if (allocated(rigid(b)%arm)) values(:, rigid(b)%arm) = 0.0_dp
      end do
   end subroutine gather_frames

   !> Means and sums over elements: S (6), E (3, in space 6), ENER and ELSE strain energy, ELKE
   !> kinetic energy, EVOL reference volume (1); second index the element.
   function element_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in), target :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp), allocatable :: stress(:, :), strain(:, :), volume(:), energy(:)
      integer :: n
      type(solid_t), pointer :: solid

      solid => terms_solid(stepper%march%system%term)
      associate (state => stepper%march%state)
         n = size(stepper%scene%element%kind)
         select case (variable)
         case ("ENER", "ELSE")
            values = reshape(real(state%energy, dp), [1, n])
         case ("ELKE")
            allocate(energy(n))
            call element_energies(solid, state%v, energy)
            values = reshape(real(energy, dp), [1, n])
         case ("S", "E", "EVOL")
            allocate(stress(6, n), volume(n), &
               strain(quantity_components("E", at_elements, stepper%scene%n_dim), n))
            call element_means(solid, state%u, square(stepper), stress, strain, volume)
            if (variable == "S") then
               values = real(stress, dp)
            else if (variable == "E") then
               values = real(strain, dp)
            else
               values = reshape(real(volume, dp), [1, n])
            end if
         case default
            allocate(values(0, 0))
         end select
      end associate
   end function element_quantity

   !> Part of squares in the strains of the step.
   pure real(wp) function square(stepper)
      type(stepper_t), intent(in) :: stepper

      square = step_square(stepper%scene%step(stepper%march%state%clock%i_step))
   end function square

   !> CDIS gap, + open, NaN where not measured (1); CSTR pressure and active flag (2); CNAREA area
   !> on which it acts, 0 where open (1); CF force of the pair on the slave node, or both at a joint
   !> (2); CSHEAR and CSLIP as `rubbing` has them; second index the possible constraint.
   function contact_quantity(stepper, variable) result(values)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      type(gap_state_t), allocatable :: gap(:)
      integer :: i, n

      n = stepper%march%system%n_constraint
      associate (state => stepper%march%state, u => stepper%march%state%u)
         select case (variable)
         case ("CDIS")
            call gaps_search(stepper%march%system, motion_of(evaluation_at_end, stepper%scene%x, &
               u, at_rest(u)), gap)
            values = reshape(merge(real(gap%gap0, dp), ieee_value(1.0_dp, ieee_quiet_nan), &
               gap%is_near .and. gap%is_over), [1, n])
         case ("CSTR")
            allocate(values(2, n))
            values(1, :) = pressures(stepper, state%contacts%lam)
            if (allocated(state%pairs%jump_lam)) values(1, :) = values(1, :) &
               + pressures(stepper, state%pairs%jump_lam)
            values(2, :) = real(min(1, state%contacts%status([(i, i = 1, n)])), dp)
         case ("CNAREA")
            values = reshape(merge(real(state%pairs%area, dp), 0.0_dp, &
               state%contacts%status([(i, i = 1, n)]) > 0), [1, n])
         case ("CSHEAR", "CSLIP")
            values = rubbing(stepper, variable)
         case ("CF")
            values = real(state%pairs%force, dp)
         case default
            allocate(values(0, 0))
         end select
      end associate
   end function contact_quantity

   !> Pressures of all constraints by their forces `lam`.
   pure function pressures(stepper, lam) result(pressure)
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: lam(:)             !! (n_constraint) [M L/T^2]
      real(dp) :: pressure(size(lam))
      real(wp) :: of_contact(size(lam))
      integer :: k

      pressure = 0.0_dp
      associate (system => stepper%march%system, area => stepper%march%state%pairs%area)
         do k = 1, size(system%contact)
            associate (first => system%first_constraint(k) + 1, last => &
                  system%first_constraint(k + 1))
               call system%contact(k)%contact%pressures(lam(first:last), area(first:last), &
                  of_contact(first:last))
               pressure(first:last) = real(of_contact(first:last), dp)
            end associate
         end do
      end associate
   end function pressures

   !> CSHEAR traction against slip (n_dim - 1), and 1 where a contact sticks, 2 where it slides, 0
   !> where nothing rubs; CSLIP slip along the surface so far (n_dim - 1), and the length of its
   !> path.
   pure function rubbing(stepper, variable) result(values)
      type(stepper_t), intent(in) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp) :: drag(stepper%scene%n_dim - 1)
      logical, allocatable :: rubs(:)
      integer :: n, i

      n = quantity_components(variable, at_contacts, stepper%scene%n_dim)
      allocate(values(n, stepper%march%system%n_constraint), source=0.0_dp)
      if (size(stepper%march%state%contacts%drag) == 0) return
      rubs = system_springs(stepper%march%system)
      if (stepper%march%active%friction%is_on) rubs = rubs .or. &
         stepper%march%active%friction%law%mu > 0.0_wp
      associate (state => stepper%march%state)
         if (variable == "CSLIP") then
            values(:n - 1, :) = real(state%contacts%slip, dp)
            values(n, :) = real(state%contacts%slip_path, dp)
            return
         end if
         do i = 1, size(values, 2)
            drag = state%contacts%drag(:, i)
            if (allocated(state%pairs%jump_drag)) drag = drag + state%pairs%jump_drag(:, i)
            if (state%pairs%shear_area(i) > 0.0_wp) values(:n - 1, i) &
               = real(drag/state%pairs%shear_area(i), dp)
            if (rubs(i)) values(n, i) = real(state%contacts%status(i), dp)
         end do
      end associate
   end function rubbing

   !> The same on all nodes: of a node that is slave in several pairs the smallest gap, the sum of
   !> the pressures, of the shears, slips and areas, the largest status and path, and active if it
   !> is so in one; off the slave nodes NaN gap, and 0. Both nodes at a joint of tied pieces have
   !> the values of their constraint. CF (2): the contact forces of all pairs, on both sides.
   function contact_field(stepper, variable) result(values)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :), at_slave(:, :)
      type(quantity_row_t) :: row
      integer :: pair, i, id

      if (variable == "CF") then
         values = real(stepper%march%state%contact, dp)
         associate (pairs => stepper%march%state%pairs)
            if (allocated(pairs%jump)) values = values + real(pairs%jump, dp)
         end associate
         return
      end if
      row = quantity_row_of(variable, at_contacts)
      at_slave = contact_quantity(stepper, variable)
      allocate(values(size(at_slave, 1), size(stepper%scene%x, 2)), source=0.0_dp)
      if (variable == "CDIS") values = ieee_value(1.0_dp, ieee_quiet_nan)
      associate (system => stepper%march%system)
         do pair = 1, merge(system%n_pair, size(system%contact), variable == "CDIS")
            do i = 1, system%contact(pair)%contact%n_constraint
               id = system%first_constraint(pair) + i
               associate (node => system%contact(pair)%contact%node(i), &
                     duplicate => system%contact(pair)%contact%duplicate(i))
                  call take_over(row, at_slave(:, id), values(:, node))
                  if (duplicate > 0) call take_over(row, at_slave(:, id), values(:, duplicate))
               end associate
            end do
         end do
      end associate
   end function contact_field

   !> Add to the value of a node that of a constraint there.
   pure subroutine take_over(row, more, value)
      type(quantity_row_t), intent(in) :: row    !! of gaps the smallest counts
      real(dp), intent(in) :: more(:)
      real(dp), intent(inout) :: value(:)

      if (row%variable == "CDIS") then
         if (ieee_is_nan(value(1))) then
            value = more
         else if (.not. ieee_is_nan(more(1))) then
            value = min(value, more)
         end if
         return
      end if
      associate (n => size(value) - merge(1, 0, row%last /= ""))   ! of the last the largest
         value(:n) = value(:n) + more(:n)
         value(n + 1:) = max(value(n + 1:), more(n + 1:))
      end associate
   end subroutine take_over

   !> Of each surface (second index) that a request of the step names: SOF force on its elements,
   !> SOM moment about the origin, SOMC about its centre, SOCENTER that, SOAREA area; else 0.
   function section_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in), target :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp) :: wrench(stepper%scene%n_dim + n_turn(stepper%scene%n_dim)), area, &
         centre(stepper%scene%n_dim), shifted(n_turn(stepper%scene%n_dim))
      type(solid_t), pointer :: solid
      integer :: i

      solid => terms_solid(stepper%march%system%term)
      associate (scene => stepper%scene, u => stepper%march%state%u, n => stepper%scene%n_dim, &
            output => stepper%scene%step(stepper%march%state%clock%i_step)%output)
         allocate(values(quantity_components(variable, at_sections, n), size(scene%surface)), &
            source=0.0_dp)
         do i = 1, size(values, 2)
            if (.not. any(output%kind == output_section_print .and. output%set == i)) cycle
            call surface_area(scene, scene%surface(i), scene%x + square(stepper)*u, area, centre)
            call section_force(solid, scene, scene%surface(i), u, square(stepper), wrench)
            select case (variable)
            case ("SOF")
               values(:, i) = real(wrench(:n), dp)
            case ("SOM")
               values(:, i) = real(wrench(n + 1:), dp)
            case ("SOMC")
               shifted = wrench(n + 1:)
               call add_moments(-centre, wrench(:n), shifted)
               values(:, i) = real(shifted, dp)
            case ("SOCENTER")
               values(:, i) = real(centre, dp)
            case ("SOAREA")
               values(:, i) = real(area, dp)
            end select
         end do
      end associate
   end function section_quantity

   !> Of each contact pair (second index): CF, CF_MASTER force and moment about the origin on the
   !> slave and on the master side (3 or 6); CONTACT_LENGTH, in space CONTACT_AREA; CNUM active
   !> constraints (1).
   function pair_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      integer :: k

      associate (total => stepper%march%state%pairs%total, &
            n => quantity_components(variable, at_pairs, stepper%scene%n_dim))
         allocate(values(n, merge(size(total), 0, n > 0)))
         do k = 1, size(values, 2)
            select case (variable)
            case ("CF")
               values(:, k) = real(total(k)%slave(:size(values, 1)), dp)
            case ("CF_MASTER")
               values(:, k) = real(total(k)%master(:size(values, 1)), dp)
            case ("CNUM")
               values(:, k) = real(total(k)%n_active, dp)
            case ("CONTACT_LENGTH", "CONTACT_AREA")
               values(:, k) = real(total(k)%covered, dp)
            end select
         end do
      end associate
   end function pair_quantity

end module emcon_quantities
