!> The output quantities by their deck names, as arrays: one function per kind of place.
module emcon_quantities
   use emcon_kinds, only : dp, wp
   use emcon_solid, only : solid_t
   use emcon_stepper, only : contact_gaps, stepper_t
   use emcon_stress, only : element_means, nodal_stress, von_mises
   use emcon_term_registry, only : terms_solid
   use emcon_vtkhdf, only : field_t
   implicit none
   private
   public :: node_quantity, element_quantity, contact_quantity, quantity_components, field_names
   public :: contact_field, pair_quantity, pair_components, pair_variables

   !> What *CONTACT PRINT, TOTALS= with CF writes of each pair.
   character(len=*), parameter :: pair_variables(4) = [character(len=14) :: "CF", "CF_MASTER", &
      "CONTACT_LENGTH", "CNUM"]

contains

   !> Components of the values that the functions below give.
   pure integer function quantity_components(variable)
      character(len=*), intent(in) :: variable

      select case (variable)
      case ("U", "V", "RF", "CF", "CSTR")
         quantity_components = 2
      case ("S")
         quantity_components = 6
      case ("E")
         quantity_components = 3
      case default
         quantity_components = 1
      end select
   end function quantity_components

   !> The fields of the field file that a variable stands for.
   function field_names(variable) result(fields)
      character(len=*), intent(in) :: variable
      type(field_t), allocatable :: fields(:)

      select case (variable)
      case ("U")
         fields = [field_of("displacement", 2)]
      case ("V")
         fields = [field_of("velocity", 2)]
      case ("RF")
         fields = [field_of("reaction_force", 2)]
      case ("S")
         fields = [field_of("cauchy_stress", 6), field_of("von_mises", 1)]
      case ("CDIS")
         fields = [field_of("contact_gap", 1)]
      case ("CSTR")
         fields = [field_of("contact_pressure", 1), field_of("contact_active", 1)]
      case ("CF")
         fields = [field_of("contact_force", 2)]
      case ("ENER")
         fields = [field_of("strain_energy", 1)]
         fields%is_cell = .true.
      case ("E")
         fields = [field_of("strain", 3)]
         fields%is_cell = .true.
      case ("ELKE")
         fields = [field_of("kinetic_energy", 1)]
         fields%is_cell = .true.
      case default
         fields = [field_of("volume", 1)]
         fields%is_cell = .true.
      end select
   end function field_names

   pure function field_of(name, n_component) result(field)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n_component
      type(field_t) :: field

      field%name = name
      field%n_component = n_component
   end function field_of

   !> U, V, RF: (2, n_node); S: Cauchy stress and von Mises stress (7, n_node).
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
         case ("V")
            values = real(state%v, dp)
         case ("RF")
            values = real(state%reaction, dp)
         case default
            allocate(stress(6, size(state%u, 2)), values(7, size(state%u, 2)))
            call nodal_stress(solid, state%u, is_large(stepper), stress)
            values(:6, :) = real(stress, dp)
            do i = 1, size(values, 2)
               values(7, i) = real(von_mises(stress(:, i)), dp)
            end do
         end select
      end associate
   end function node_quantity

   !> Means and sums over elements: S (6), E (3), ENER and ELSE strain energy, ELKE kinetic energy,
   !> EVOL reference volume (1); second index the element.
   function element_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in), target :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp), allocatable :: stress(:, :), strain(:, :), volume(:)
      integer :: n
      type(solid_t), pointer :: solid

      solid => terms_solid(stepper%march%system%term)
      associate (state => stepper%march%state)
         n = size(stepper%scene%element_kind)
         select case (variable)
         case ("ENER", "ELSE")
            values = reshape(real(state%energy, dp), [1, n])
         case ("ELKE")
            values = reshape(real(kinetic_energies(stepper), dp), [1, n])
         case default
            allocate(stress(6, n), strain(3, n), volume(n))
            call element_means(solid, state%u, is_large(stepper), stress, strain, volume)
            if (variable == "S") then
               values = real(stress, dp)
            else if (variable == "E") then
               values = real(strain, dp)
            else
               values = reshape(real(volume, dp), [1, n])
            end if
         end select
      end associate
   end function element_quantity

   !> Does the step take displacements as large?
   pure logical function is_large(stepper)
      type(stepper_t), intent(in) :: stepper

      is_large = stepper%scene%step(stepper%march%state%i_step)%nlgeom
   end function is_large

   !> Kinetic energy of each element.
   function kinetic_energies(stepper) result(energy)
      type(stepper_t), intent(in), target :: stepper
      real(wp), allocatable :: energy(:)
      type(solid_t), pointer :: solid
      integer :: e, i, j

      solid => terms_solid(stepper%march%system%term)
      associate (v => stepper%march%state%v)
         allocate(energy(solid%n_element), source=0.0_wp)
         do e = 1, solid%n_element
            do j = 1, solid%geometry(e)%n_node
               do i = 1, solid%geometry(e)%n_node
                  energy(e) = energy(e) + 0.5_wp*solid%mass(i, j, e) &
                     *dot_product(v(:, solid%node(i, e)), v(:, solid%node(j, e)))
               end do
            end do
         end do
      end associate
   end function kinetic_energies

   !> CDIS gap, + open, NaN where not measured (1); CSTR pressure and active flag (2); CF force of
   !> the pair on the slave node, or both at a joint (2); second index the possible constraint.
   function contact_quantity(stepper, variable) result(values)
      use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      real(wp), allocatable :: gap(:)
      logical, allocatable :: is_near(:)
      integer :: n

      n = stepper%march%system%n_constraint
      associate (state => stepper%march%state)
         select case (variable)
         case ("CDIS")
            allocate(gap(n), is_near(n))
            call contact_gaps(stepper, gap, is_near)
            values = reshape(merge(real(gap, dp), ieee_value(1.0_dp, ieee_quiet_nan), is_near), &
               [1, n])
         case ("CSTR")
            allocate(values(2, n))
            values(1, :) = 0.0_dp
            where (state%pairs%area > 0.0_wp) values(1, :) = real(state%lam/state%pairs%area, dp)
            values(2, :) = merge(1.0_dp, 0.0_dp, state%is_active)
         case default
            values = real(state%pairs%force, dp)
         end select
      end associate
   end function contact_quantity

   !> The same on all nodes: of a node that is slave in several pairs the smallest gap, the sum of
   !> the pressures, and active if it is so in one; off the slave nodes NaN gap, and 0. Both nodes
   !> at a joint of tied pieces have the values of their constraint. CF (2): the contact forces of
   !> all pairs, on both sides.
   function contact_field(stepper, variable) result(values)
      use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :), at_slave(:, :)
      integer :: pair, i, id

      if (variable == "CF") then
         values = real(stepper%march%state%contact, dp)
         return
      end if
      at_slave = contact_quantity(stepper, variable)
      allocate(values(size(at_slave, 1), size(stepper%scene%x, 2)), source=0.0_dp)
      if (variable == "CDIS") values = ieee_value(1.0_dp, ieee_quiet_nan)
      associate (system => stepper%march%system)
         do pair = 1, merge(system%n_pair, size(system%contact), variable == "CDIS")
            do i = 1, system%contact(pair)%contact%n_constraint
               id = system%first_constraint(pair) + i
               associate (node => system%contact(pair)%contact%node(i), &
                     twin => system%contact(pair)%contact%twin(i))
                  call take_over(variable, at_slave(:, id), values(:, node))
                  if (twin > 0) call take_over(variable, at_slave(:, id), values(:, twin))
               end associate
            end do
         end do
      end associate
   end function contact_field

   !> Add to the value of a node that of a constraint there.
   pure subroutine take_over(variable, more, value)
      use, intrinsic :: ieee_arithmetic, only : ieee_is_nan
      character(len=*), intent(in) :: variable
      real(dp), intent(in) :: more(:)
      real(dp), intent(inout) :: value(:)

      if (variable == "CSTR") then
         value(1) = value(1) + more(1)
         value(2) = max(value(2), more(2))
      else if (ieee_is_nan(value(1))) then
         value = more
      else if (.not. ieee_is_nan(more(1))) then
         value = min(value, more)
      end if
   end subroutine take_over

   !> Components of what `pair_quantity` gives.
   pure integer function pair_components(variable)
      character(len=*), intent(in) :: variable

      pair_components = 1
      if (variable == "CF" .or. variable == "CF_MASTER") pair_components = 3
   end function pair_components

   !> Of each contact pair (second index): CF, CF_MASTER force and moment about the origin on the
   !> slave and on the master side (3); CONTACT_LENGTH; CNUM active constraints (1).
   function pair_quantity(stepper, variable) result(values)
      type(stepper_t), intent(in) :: stepper
      character(len=*), intent(in) :: variable
      real(dp), allocatable :: values(:, :)
      integer :: k

      associate (total => stepper%march%state%pairs%total)
         allocate(values(pair_components(variable), size(total)))
         do k = 1, size(total)
            select case (variable)
            case ("CF")
               values(:, k) = real(total(k)%slave, dp)
            case ("CF_MASTER")
               values(:, k) = real(total(k)%master, dp)
            case ("CNUM")
               values(:, k) = real(total(k)%n_active, dp)
            case default
               values(:, k) = real(total(k)%length, dp)
            end select
         end do
      end associate
   end function pair_quantity

end module emcon_quantities
