!> What a program gives to a model between reading its deck and building it: laws, elements,
!> schemes, forces, mass, constraints, contact, solvers.
!>
!> Copies are kept, also for a restart file that is loaded afterwards. Nodes that stand in no
!> element are part of the model where they are given something. Gravity acts on the mass of
!> elements only: the weight of given mass is for the giver to add.
module emcon_stepper_user
   use emcon_constraint, only : constraint_t
   use emcon_contact_law, only : contact_law_t
   use emcon_csr, only : csr_t
   use emcon_element_kind, only : find_element_kind
   use emcon_element_registry, only : find_element_row
   use emcon_errors, only : error_t
   use emcon_host, only : host_add_constraint, host_add_contact, host_add_force, host_add_law, &
      host_add_solver, host_copy_solvers, host_find_contact, host_find_solver
   use emcon_host_check, only : host_check_force, host_check_mass
   use emcon_host_contact, only : host_contact_t
   use emcon_host_force, only : host_force_t
   use emcon_host_scheme, only : host_scheme_add, host_scheme_check, host_scheme_find
   use emcon_interactions, only : formulation_user
   use emcon_law, only : law_t
   use emcon_law_registry, only : law_user
   use emcon_node_potential, only : node_potential_init, node_potential_t
   use emcon_point_function, only : point_function_t
   use emcon_scene, only : where_text
   use emcon_scheme, only : scheme_row_t, scheme_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_shape, only : shape_fault, shape_t
   use emcon_solver_registry, only : find_solver_row, is_foreign_solver, solver_names
   use emcon_sparse_solver, only : solver_box_t, sparse_solver_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_that
   use emcon_steps, only : method_penalty
   use emcon_text, only : squeezed, to_upper
   implicit none
   private
   public :: stepper_give_law, stepper_give_element, stepper_give_scheme, stepper_give_solver
   public :: stepper_give_potential, stepper_give_force, stepper_give_mass
   public :: stepper_give_constraint, stepper_give_contact, stepper_give_contact_law

   !> Give the law of a *USER MATERIAL: its strain energy at points, or a type that extends `law_t`.
   interface stepper_give_law
      module procedure give_energy, give_law
   end interface stepper_give_law

contains

   !> Give the strain energy of the *USER MATERIAL called `name`: W(E11, E22, 2 E12), in space
   !> W(E11, E22, E33, 2 E12, 2 E23, 2 E13), per reference volume [M/(L T^2)].
   subroutine give_energy(self, name, energy, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! small or capital letters
      class(point_function_t), intent(in) :: energy
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_material(self, plain(name), error)
      if (.not. allocated(error)) call host_add_law(self%host, plain(name), energy=energy)
   end subroutine give_energy

   !> Give a law for the *USER MATERIAL called `name`. It takes the constants of that card.
   subroutine give_law(self, name, law, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! small or capital letters
      class(law_t), intent(in) :: law
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_material(self, plain(name), error)
      if (.not. allocated(error)) call host_add_law(self%host, plain(name), law=law)
   end subroutine give_law

   !> Can a law be given for the material `name`?
   subroutine check_material(self, name, error)
      type(stepper_t), intent(in) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      logical :: is_given
      integer :: i, k

      call check_stage(self, error)
      if (allocated(error)) return
      do k = size(self%scene%material), 1, -1
         if (self%scene%material(k)%name == name) exit
      end do
      call check_that(k > 0, "there is no material " // name // " in the deck", error)
      if (allocated(error)) return
      associate (material => self%scene%material(k))
         call check_that(material%law == law_user, "material " // name // " (" // &
            where_text(self%scene, material%origin) // ") has a law of its own: to give one, it " &
            // "has to be a *USER MATERIAL", error)
      end associate
      is_given = .false.
      if (allocated(self%host%law)) then
         do i = 1, size(self%host%law)
            is_given = is_given .or. self%host%law(i)%material == name
         end do
      end if
      call check_that(.not. is_given, "the law of material " // name // " is given already", error)
   end subroutine check_material

   !> Give the shape of the elements of a *USER ELEMENT.
   subroutine stepper_give_element(self, name, shape, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! TYPE of the card; small or capital letters
      class(shape_t), intent(in) :: shape
      type(error_t), allocatable, intent(out) :: error   !! nothing was given
      character(len=:), allocatable :: fault
      integer :: k

      call check_stage(self, error)
      if (allocated(error)) return
      k = find_element_kind(self%scene%element%kinds, plain(name))
      call check_that(k > 0, "there is no element type " // plain(name) // " in the deck: to " // &
         "give its shape, it has to be the TYPE of a *USER ELEMENT", error)
      call check_that(find_element_row(plain(name)) == 0, "a shape cannot be given for " &
         // plain(name) // ": EMCON has its own", error)
      if (allocated(error)) return
      associate (kind => self%scene%element%kinds(k))
         call check_that(.not. allocated(kind%shape), "the shape of " // plain(name) // &
            " is given already", error)
         call shape_fault(shape, kind%n_node, fault)
         call check_that(fault == "", "the shape given for " // plain(name) // ": " // fault, error)
         if (.not. allocated(error)) allocate(kind%shape, source=shape)
      end associate
   end subroutine stepper_give_element

   !> Give the scheme of time integration that the deck calls `name`, by *TIME INTEGRATION,
   !> SCHEME=`name`.
   subroutine stepper_give_scheme(self, name, scheme, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! small or capital letters
      class(scheme_t), intent(in) :: scheme
      type(error_t), allocatable, intent(out) :: error   !! nothing was given
      type(scheme_row_t) :: own

      call check_stage(self, error)
      if (.not. allocated(error)) call host_scheme_check(squeezed(name), scheme, error)
      if (allocated(error)) return
      own = scheme_row("DYNAMIC", squeezed(name))
      call check_that(own%code == 0, "a scheme cannot be given as " // trim(own%word) // &
         ": EMCON has its own", error)
      call check_that(host_scheme_find(self%march%host%scheme, squeezed(name)) == 0, &
         "the scheme " // squeezed(name) // " is given already", error)
      if (.not. allocated(error)) call host_scheme_add(self%march%host%scheme, squeezed(name), &
         scheme)
   end subroutine stepper_give_scheme

   !> Give a potential V(x, y) [M L^2/T^2] of the present position of each of some nodes.
   subroutine stepper_give_potential(self, name, node, potential, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! for messages
      integer, intent(in) :: node(:)                 !! 1..n_node, each once
      class(point_function_t), intent(in) :: potential
      type(error_t), allocatable, intent(out) :: error   !! nothing was given
      type(node_potential_t) :: force

      call check_stage(self, error)
      if (.not. allocated(error)) call node_potential_init(force, name, node, &
         self%scene%n_dim, size(self%scene%x, 2), potential, error)
      if (.not. allocated(error)) call host_add_force(self%host, force)
   end subroutine stepper_give_potential

   !> Give forces between nodes. Those of several calls add up.
   subroutine stepper_give_force(self, force, error)
      type(stepper_t), intent(inout) :: self
      class(host_force_t), intent(in) :: force
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_stage(self, error)
      if (.not. allocated(error)) call host_check_force(force, self%scene%n_dim, &
         size(self%scene%x, 2), error)
      if (.not. allocated(error)) call host_add_force(self%host, force)
   end subroutine stepper_give_force

   !> Give a mass beside that of the elements, the same in both directions: symmetric, and no mass
   !> negative.
   subroutine stepper_give_mass(self, mass, error)
      type(stepper_t), intent(inout) :: self
      type(csr_t), intent(in) :: mass                    !! (n_node x n_node) [M]
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_stage(self, error)
      call check_that(self%host%mass%n_row == 0, &
         "a mass was given already; give one matrix with all of it", error)
      if (.not. allocated(error)) call host_check_mass(mass, self%scene, error)
      if (.not. allocated(error)) self%host%mass = mass
   end subroutine stepper_give_mass

   !> Give conditions that hold at the end of every step, in both directions: a rod of fixed length,
   !> a pin. They hold at the start of the first step, too.
   subroutine stepper_give_constraint(self, constraint, error)
      type(stepper_t), intent(inout) :: self
      class(constraint_t), intent(in) :: constraint
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_stage(self, error)
      call check_that(constraint%n_constraint > 0, "a constraint was given that has no " // &
         "conditions: n_constraint is to be their number", error)
      if (.not. allocated(error)) call host_add_constraint(self%host, constraint)
   end subroutine stepper_give_constraint

   !> Give the formulation of contact of the *CONTACT PAIR, TYPE=USER of two surfaces.
   subroutine stepper_give_contact(self, slave, master, contact, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: slave          !! surface; small or capital letters
      character(len=*), intent(in) :: master         !! surface; small or capital letters
      class(host_contact_t), intent(in) :: contact
      type(error_t), allocatable, intent(out) :: error   !! nothing was given
      integer :: k

      call check_stage(self, error)
      if (allocated(error)) return
      associate (pair => self%scene%pair, surface => self%scene%surface)
         do k = size(pair), 1, -1
            if (pair(k)%formulation /= formulation_user) cycle
            if (surface(pair(k)%slave)%name == plain(slave) .and. &
               surface(pair(k)%master)%name == plain(master)) exit
         end do
      end associate
      call check_that(k > 0, "there is no *CONTACT PAIR, TYPE=USER of slave surface " // &
         plain(slave) // " and master surface " // plain(master) // " in the deck", error)
      call check_that(host_find_contact(self%host, k) == 0, "the contact of surfaces " // &
         plain(slave) // " and " // plain(master) // " is given already", error)
      if (.not. allocated(error)) call host_add_contact(self%host, k, contact)
   end subroutine stepper_give_contact

   !> Give a direct solver, which steps with SOLVER=`name` factorise their matrices by.
   subroutine stepper_give_solver(self, name, solver, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! small or capital letters, without blanks
      class(sparse_solver_t), intent(in) :: solver   !! it has analysed nothing yet
      type(error_t), allocatable, intent(out) :: error   !! nothing was given
      type(solver_box_t), allocatable :: present(:)
      character(len=:), allocatable :: known, word

      call check_stage(self, error)
      if (allocated(error)) return
      call host_copy_solvers(self%host, present)
      call solver_names(known)
      word = plain(name)
      call check_that(find_solver_row(word) == 0, "a solver cannot be given as " // word // &
         ": EMCON has its own " // known, error)
      call check_that(.not. is_foreign_solver(word) .and. index(word, " ") == 0, "a solver " // &
         "cannot be given as " // word // ": the name has to be one without blanks that no " // &
         "other program has for its own", error)
      call check_that(host_find_solver(present, word) == 0, "the solver " // word // &
         " is given already", error)
      if (.not. allocated(error)) call host_add_solver(self%host, word, solver)
   end subroutine stepper_give_solver

   !> Give the law of all contacts in steps with *CONSTRAINT METHOD, TYPE=PENALTY, in place of the
   !> penalty.
   subroutine stepper_give_contact_law(self, law, error)
      type(stepper_t), intent(inout) :: self
      class(contact_law_t), intent(in) :: law
      type(error_t), allocatable, intent(out) :: error   !! nothing was given

      call check_stage(self, error)
      if (allocated(error)) return
      call check_that(.not. allocated(self%host%contact_law), "a law of contact is given " // &
         "already", error)
      call check_that(any(self%scene%step%contact%method == method_penalty), "a law of " // &
         "contact is given, but no step has a *CONSTRAINT METHOD, TYPE=PENALTY, in whose place " &
         // "it acts", error)
      if (.not. allocated(error)) allocate(self%host%contact_law, source=law)
   end subroutine stepper_give_contact_law

   !> The deck is read, the model is not built.
   subroutine check_stage(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_that(.not. allocated(self%march%scheme), "laws, elements, schemes, forces, " // &
         "mass, constraints, contact, its laws and solvers are given before the model is built", &
         error)
      call check_that(self%is_read, "there is no scene to give anything to: no deck was read, " &
         // "or reading it failed", error)
   end subroutine check_stage

   !> A name in capital letters, without blanks around it.
   pure function plain(name)
      character(len=*), intent(in) :: name
      character(len=len_trim(adjustl(name))) :: plain

      plain = to_upper(adjustl(name))
   end function plain

end module emcon_stepper_user
