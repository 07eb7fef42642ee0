! build: streams
!> The discrete system of one step: a list of terms, constraints, numbered unknowns, the matrix.
!>
!> It knows configurations and weights, not time stepping, and not which kinds of terms there are:
!> a scheme asks for r = s M (b du - w v0) + f_int - f_ext and its tangent, docs/theory.md,
!> eqs. (2) and (16), which are sums over the terms.
module emcon_system
   use emcon_constraint, only : constraint_box_t
   use emcon_constraint_registry, only : constraints_create
   use emcon_contact, only : contact_box_t
   use emcon_contact_law, only : contact_law_t
   use emcon_contact_registry, only : new_contact
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_host, only : host_find_contact, host_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : dp, wp
   use emcon_lagged_forces, only : lagged_forces_give, lagged_forces_t
   use emcon_memory, only : memory_contact, memory_elements, memory_go_on, memory_matrix, &
      memory_t, memory_take
   use emcon_motion, only : motion_t
   use emcon_phases, only : phase_assemble, phase_enter, phase_leave, phase_residual, phases_t
   use emcon_reduction, only : reduction_add
   use emcon_scene, only : scene_t
   use emcon_space, only : lists_alone, lists_begin, lists_t, space_begin_step, space_init, space_t
   use emcon_steps, only : method_saddle_point, step_is_dynamic
   use emcon_stiffening, only : least_stiffness, stiffening_add, stiffening_set, stiffening_t
   use emcon_term, only : response_begin, response_init, response_t, role_external, &
      role_inertia, role_internal, term_box_t
   use emcon_term_registry, only : terms_create, terms_mass, terms_mass_times
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_vectors, only : vector_add, vector_sum
   implicit none
   private
   public :: system_t, system_init, system_begin_step, system_renew, system_respond, &
      system_release_tangent, system_find_energy, system_check_response, system_stiffen, &
      system_tangent_times, system_loads, system_may_hold, system_springs, mass_times

   type :: system_t
      type(term_box_t), allocatable :: term(:)
      !> That hold at the end of every step: linear ones, then others
      type(constraint_box_t), allocatable :: permanent(:)
      type(contact_box_t), allocatable :: contact(:)
      class(contact_law_t), allocatable :: contact_law   !! of contact that gives way; none: penalty
      integer :: n_pair = 0                      !! of the scene; guards come after them
      !> Conditions are numbered: those of `held`, those of `contact`
      integer :: n_constraint = 0
      logical, allocatable :: acts(:)            !! (conditions of `held`) they act in the step
      integer, allocatable :: first_constraint(:)   !! (n_contact + 1) conditions before each
      integer :: i_step = 0                      !! step of the deck the rest belongs to
      type(space_t) :: space                     !! bodies, freedoms, unknowns
      type(csr_t) :: matrix                      !! tangent over the unknowns, once asked for
      logical :: is_symmetric = .false.          !! `matrix` is, up to round-off
      type(stiffening_t) :: stiffening           !! of bodies that nothing holds, in `matrix`
      type(response_t) :: response               !! of the terms to the last motion
      type(lagged_forces_t) :: lagged            !! forces that stand for those of the terms
      type(notes_t) :: notes                     !! on the linear constraints of the step
      type(phases_t) :: phases                   !! where the time goes
      type(memory_t) :: memory                   !! and the memory
   end type system_t

contains

   !> What stays the same in all steps of `scene`, and of what the model is given beside it.
   subroutine system_init(self, scene, error, host)
      type(system_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host
      type(lists_t) :: lists

      call memory_go_on(self%memory)
      call terms_create(scene, self%term, error, host)
      if (allocated(error)) return
      call memory_take(self%memory, memory_elements)
      call lay_out(self, scene, lists)
      call space_init(self%space, scene, lists)
      call memory_take(self%memory, memory_matrix)
      if (scene%host%is_whole) self%space%is_alive = .true.
      call constraints_create(scene, self%space%linear, self%permanent, host)
      if (present(host)) then
         if (allocated(host%contact_law)) allocate(self%contact_law, source=host%contact_law)
      end if
      call init_contact(self, scene, error, host)
      if (allocated(error)) return
      call memory_take(self%memory, memory_contact)
      call response_init(self%response, size(scene%x, 1), size(scene%x, 2), &
         size(scene%element%kind))
      call memory_take(self%memory, memory_elements)
   end subroutine system_init

   !> The contact of pairs and guards, and the numbers of conditions: those of `held`, then theirs.
   subroutine init_contact(self, scene, error, host)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host
      type(contact_pair_t), allocatable :: pair(:)
      integer :: i, k

      do i = 1, size(self%permanent)
         self%n_constraint = self%n_constraint + self%permanent(i)%constraint%n_constraint
      end do
      allocate(self%acts(self%n_constraint), source=.false.)
      self%n_pair = size(scene%pair)
      if (allocated(scene%guard)) then
         allocate(pair, source=[scene%pair, scene%guard])
      else
         allocate(pair, source=scene%pair)
      end if
      allocate(self%contact(size(pair)))
      allocate(self%first_constraint(size(pair) + 1), source=self%n_constraint)
      self%contact(:self%n_pair)%of_pair = [(i, i = 1, self%n_pair)]
      if (allocated(scene%guard)) self%contact(self%n_pair + 1:)%of_pair = &
         merge(-1, 1, scene%guard%is_reverse)*scene%guard%of_pair
      do i = 1, size(pair)
         k = 0
         if (present(host)) k = host_find_contact(host, i)
         if (k > 0) then
            call new_contact(scene, pair(i), self%contact(i)%contact, error, &
               host%contact(k)%contact)
         else
            call new_contact(scene, pair(i), self%contact(i)%contact, error)
         end if
         if (allocated(error)) return
         self%n_constraint = self%n_constraint + self%contact(i)%contact%n_constraint
         self%first_constraint(i + 1) = self%n_constraint
      end do
   end subroutine init_contact

   !> The freedoms that meet in all terms, and with `first` the entries of the lists before each.
   subroutine lay_out(self, scene, lists, first)
      type(system_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(lists_t), intent(out) :: lists
      integer, intent(out), optional :: first(:)         !! (n_term + 1)
      integer :: k

      call lists_begin(lists, size(scene%x, 1))
      do k = 1, size(self%term)
         if (present(first)) first(k) = n_entry()
         call self%term(k)%term%lay_out(lists)
      end do
      if (present(first)) first(size(first)) = n_entry()

   contains

      !> Entries of the matrices over each list so far.
      pure integer function n_entry()
         n_entry = sum((lists%start(2:) - lists%start(:size(lists%start) - 1))**2)
      end function n_entry

   end subroutine lay_out

   !> Number the unknowns of step `i_step` of the deck, lay out its matrix, and let the terms set up
   !> for it.
   subroutine system_begin_step(self, scene, i_step, error)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(error_t), allocatable, intent(out) :: error
      type(lists_t) :: lists
      integer, allocatable :: slot(:)
      integer :: first(size(self%term) + 1), k

      call memory_go_on(self%memory)
      self%i_step = i_step
      self%notes = notes_t()
      self%stiffening = stiffening_t()
      call lay_out(self, scene, lists, first)
      self%lagged%is_known = .false.
      if (scene%step(i_step)%scheme%lumps_mass) call lists_alone(lists)
      call space_begin_step(self%space, scene, i_step, lists, self%matrix, slot, error)
      if (allocated(error)) return
      ! None is held before it is asked for.
      if (allocated(self%matrix%value)) deallocate(self%matrix%value)
      if (scene%step(i_step)%scheme%lumps_mass) then
         deallocate(slot)
         allocate(slot(first(size(first))), source=0)
      end if
      if (scene%step(i_step)%contact%method /= method_saddle_point &
         .and. .not. self%space%is_reduced) call note_add(self%notes, &
         "ties or equations with long rows: solved with their multipliers, as a saddle point; " &
         // "dual multipliers keep rows short")
      do k = 1, size(self%term)
         call self%term(k)%term%begin_step(scene, i_step, self%space, self%matrix, &
            slot(first(k) + 1:first(k + 1)))
      end do
      deallocate(slot)
      call memory_take(self%memory, memory_matrix)
      call find_acting(self)
      if (step_is_dynamic(scene%step(i_step))) call check_mass(self, scene, error)
   end subroutine system_begin_step

   !> Which of the conditions of `held` act: linear ones that are not eliminated, and others that
   !> have something to hold.
   subroutine find_acting(self)
      type(system_t), intent(inout) :: self
      integer :: i, n

      associate (linear => self%space%linear)
         self%acts(:linear%n) = linear%is_used .and. .not. self%space%is_reduced
         n = linear%n
      end associate
      do i = 2, size(self%permanent)
         associate (constraint => self%permanent(i)%constraint)
            call constraint%find_idle(self%space%numbering, &
               self%acts(n + 1:n + constraint%n_constraint))
            n = n + constraint%n_constraint
         end associate
      end do
      associate (others => self%acts(self%space%linear%n + 1:))
         others = .not. others
      end associate
   end subroutine find_acting

   !> In dynamics what is forced needs mass.
   subroutine check_mass(self, scene, error)
      type(system_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      logical :: may_hold(size(scene%x, 2))
      type(csr_t) :: mass
      integer :: i, k

      call terms_may_hold(self%term, may_hold)
      if (.not. any(may_hold)) return
      call terms_mass(self%term, mass)
      do i = 1, size(may_hold)
         if (.not. (may_hold(i) .and. any(self%space%numbering%unknown(:, i) > 0))) cycle
         k = csr_find(mass, i, i)
         if (k > 0) then
            if (mass%value(k) > 0.0_dp) cycle
         end if
         call raise(error, err_input, "node " // to_text(scene%node%label(i)) // &
            " has given forces but no mass: a dynamic step needs it")
         return
      end do
   end subroutine check_mass

   !> The nodes whose bodies forces may hold that are not those of elements.
   pure subroutine terms_may_hold(term, may_hold)
      type(term_box_t), intent(in) :: term(:)
      logical, intent(out) :: may_hold(:)        !! (n_node)
      integer :: k

      may_hold = .false.
      do k = 1, size(term)
         if (allocated(term(k)%term%may_hold)) may_hold = may_hold .or. term(k)%term%may_hold
      end do
   end subroutine terms_may_hold

   !> The nodes whose bodies such forces may hold, and constraints beside those of the deck.
   pure subroutine system_may_hold(self, by_forces, by_constraints)
      type(system_t), intent(in) :: self
      logical, intent(out) :: by_forces(:), by_constraints(:)    !! (n_node)
      integer :: k

      call terms_may_hold(self%term, by_forces)
      by_constraints = .false.
      do k = 1, size(self%permanent)
         associate (constraint => self%permanent(k)%constraint)
            if (allocated(constraint%stands_on)) by_constraints(constraint%stands_on) = .true.
         end associate
      end do
   end subroutine system_may_hold

   !> Values of the step in `scene` have changed, nothing else.
   subroutine system_renew(self, scene)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: k

      self%lagged%is_known = .false.
      do k = 1, size(self%term)
         call self%term(k)%term%renew(scene, self%i_step)
      end do
   end subroutine system_renew

   !> Residual of a motion without constraint forces, and with `with_tangent` the tangent. `refusal`
   !> or `failure` of the response is allocated where there is none.
   subroutine system_respond(self, motion, with_tangent, with_sizes)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed
      logical, intent(in) :: with_tangent        !! else the matrix is left as it is
      logical, intent(in), optional :: with_sizes   !! else those of an earlier motion stay; .true.
      integer :: k, n, left

      call phase_enter(self%phases, merge(phase_assemble, phase_residual, with_tangent), left)
      call response_begin(self%response, with_sizes)
      if (with_tangent) then
         self%phases%n_tangent = self%phases%n_tangent + 1
         self%is_symmetric = .true.
         if (.not. allocated(self%matrix%value)) then
            call memory_go_on(self%memory)
            allocate(self%matrix%value(size(self%matrix%column)))
            call memory_take(self%memory, memory_matrix)
         end if
         self%matrix%value = 0.0_dp
      else if (.not. self%lagged%is_on) then
         self%phases%n_residual = self%phases%n_residual + 1
      end if
      if (self%lagged%is_on) call lagged_forces_give(self%lagged, self%response)
      do k = 1, size(self%term)
         associate (term => self%term(k)%term)
            if (self%lagged%is_on .and. term%role == role_internal) cycle
            if (with_tangent) then
               call term%respond(motion, self%response, self%matrix%value, &
                  self%space%reduction%side%value)
               self%is_symmetric = self%is_symmetric .and. term%is_symmetric(motion)
            else
               call term%respond(motion, self%response)
            end if
         end associate
         if (allocated(self%response%refusal) .or. allocated(self%response%failure)) exit
      end do
      if (with_tangent) then
         call reduction_add(self%space%reduction, self%matrix)
         call stiffening_add(self%stiffening, self%matrix)
      end if
      associate (response => self%response, inertia => self%response%part(role_inertia), &
            internal => self%response%part(role_internal), &
            external => self%response%part(role_external))
         n = size(response%residual)
         call vector_sum(n, internal%force, -1.0_wp, external%force, response%residual)
         call vector_add(n, 1.0_wp, inertia%force, response%residual)
         if (allocated(motion%carried)) call vector_add(n, 1.0_wp, motion%carried, &
            response%residual)
         if (response%with_sizes) then
            call vector_sum(n, internal%magnitude, 1.0_wp, external%magnitude, response%magnitude)
            call vector_add(n, 1.0_wp, inertia%magnitude, response%magnitude)
            if (allocated(motion%carried)) response%magnitude = response%magnitude &
               + abs(motion%carried)
         end if
      end associate
      call phase_leave(self%phases, left)
   end subroutine system_respond

   !> The tangent is not needed before the next one is asked for: half of what a model takes.
   subroutine system_release_tangent(self)
      type(system_t), intent(inout) :: self

      if (.not. allocated(self%matrix%value)) return
      call memory_go_on(self%memory)
      deallocate(self%matrix%value)
      call memory_take(self%memory, memory_matrix)
   end subroutine system_release_tangent

   !> Complete the energies of the elements of the last response, that to `motion`.
   subroutine system_find_energy(self, motion)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed
      integer :: k

      do k = 1, size(self%term)
         call self%term(k)%term%find_energy(motion, self%response%energy)
      end do
   end subroutine system_find_energy

   !> The external forces of a motion.
   subroutine system_loads(self, motion, force)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      real(wp), intent(out), contiguous :: force(:, :)         !! (n_dim, n_node) [M L/T^2]
      type(response_t) :: response
      integer :: k

      call response_init(response, size(force, 1), size(force, 2), 0)
      do k = 1, size(self%term)
         associate (term => self%term(k)%term)
            if (term%role == role_external) call term%respond(motion, response)
         end associate
      end do
      force = response%part(role_external)%force
   end subroutine system_loads

   !> Let Newton's method not move the bodies `is_loose` farther than the residual calls for: a
   !> small stiffness of their nodes in the tangent alone, which changes no solution. Where nothing
   !> deforms it lets loads move them by the size of the scene.
   subroutine system_stiffen(self, is_loose, motion)
      type(system_t), intent(inout) :: self
      logical, intent(in) :: is_loose(:)         !! (n_body)
      type(motion_t), intent(in) :: motion       !! placed
      real(wp) :: stiffness(size(self%space%body)), force(size(motion%x, 1), size(motion%x, 2))
      integer :: i, k

      stiffness = 0.0_wp
      if (any(is_loose)) then
         do k = 1, size(self%term)
            call self%term(k)%term%add_stiffness(stiffness)
         end do
         if (.not. any(stiffness > 0.0_wp)) then
            call system_loads(self, motion, force)
            stiffness = maxval(abs(force))/(least_stiffness*maxval(maxval(motion%x, 2) &
               - minval(motion%x, 2)))
         end if
      end if
      ! What does not deform is moved as what does.
      where (.not. stiffness > 0.0_wp) stiffness = maxval(stiffness)
      do i = 1, size(stiffness)
         if (self%space%body(i) == 0) cycle
         if (.not. is_loose(self%space%body(i))) stiffness(i) = 0.0_wp
      end do
      call stiffening_set(self%stiffening, stiffness, self%space%numbering, self%matrix)
   end subroutine system_stiffen

   !> An error if the last response was none, for the displacements that the words `by` name.
   subroutine system_check_response(self, by, error)
      type(system_t), intent(in) :: self
      character(len=*), intent(in) :: by         !! stands behind "by the displacements"
      type(error_t), allocatable, intent(out) :: error

      if (allocated(self%response%failure)) then
         allocate(error, source=self%response%failure)
      else if (allocated(self%response%refusal)) then
         call raise(error, err_analysis, self%response%refusal // " by the displacements " // by)
      end if
   end subroutine system_check_response

   !> The tangent of internal forces and inertia times `direction`, on all nodes: what prescribed
   !> motion does to first order.
   subroutine system_tangent_times(self, motion, direction, product)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(out), contiguous :: product(:, :)               !! (n_dim, n_node) [M L/T^2]
      integer :: k

      product = 0.0_wp
      do k = 1, size(self%term)
         call self%term(k)%term%tangent_times(motion, direction, product)
      end do
   end subroutine system_tangent_times

   !> Which contacts slip against springs, where they give way?
   pure function system_springs(self) result(springs)
      type(system_t), intent(in) :: self
      logical :: springs(self%n_constraint)
      integer :: k

      springs = .false.
      do k = 1, size(self%contact)
         associate (laws => self%contact(k)%contact%laws)
            if (.not. allocated(laws%row)) cycle
            springs(self%first_constraint(k) + 1:self%first_constraint(k + 1)) &
               = laws%row%has_friction
         end associate
      end do
   end function system_springs

   !> M field, in all directions.
   pure subroutine mass_times(self, field, product)
      type(system_t), intent(in) :: self
      real(wp), intent(in), contiguous :: field(:, :)        !! (n_dim, n_node)
      real(wp), intent(out), contiguous :: product(:, :)     !! (n_dim, n_node)

      call terms_mass_times(self%term, field, product)
   end subroutine mass_times

end module emcon_system
