!> The discrete system of one step: numbered unknowns, forces, mass, tangent, contact pairs.
!>
!> It knows configurations and weights, not time stepping: a scheme asks for
!> r = s M (b du - w v0) + f_int - f_ext and its tangent: docs/theory.md, eqs. (2) and (16).
module emcon_system
   use emcon_contact, only : contact_box_t
   use emcon_contact_registry, only : new_contact
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_given, only : given_t
   use emcon_given_sum, only : given_sum_add_tangent, given_sum_init, given_sum_is_symmetric, &
      given_sum_massless, given_sum_place, given_sum_respond, given_sum_t, given_sum_tangent_times
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : dp, wp
   use emcon_layout, only : layout_bodies, layout_pattern
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_loads, only : loads_add, loads_init, loads_t
   use emcon_mass, only : mass_init, mass_place
   use emcon_law_registry, only : law_linear
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_init, numbering_t, unresolved_t
   use emcon_point_function, only : point_failed
   use emcon_reduction, only : freedom_numbers, reduction_add, reduction_init, reduction_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : obstacle_text, solid_init, solid_respond, solid_response_t, solid_t, &
      solid_tangent_times
   use emcon_steps, only : method_null_space, procedure_dynamic
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_timer, only : stopwatch_t
   implicit none
   private
   public :: system_t, system_init, system_begin_step, system_respond, &
      system_check_response, system_stiffen, system_tangent_times, mass_times

   !> What is added to the tangent of a body that nothing holds, per stiffness of its elements: far
   !> below what bends a body, far above the round-off of its rigid motions.
   real(wp), parameter :: least_stiffness = sqrt(epsilon(1.0_wp))

   type :: system_t
      type(solid_t) :: solid
      type(given_sum_t) :: given                 !! forces and mass from outside
      type(csr_t) :: mass                        !! node by node, the same in all directions
      type(linear_rows_t) :: linear              !! rows of ties and equations
      type(contact_box_t), allocatable :: contact(:)
      integer, allocatable :: first_constraint(:)   !! (n_contact + 1) constraints before each
      integer :: n_pair = 0                      !! of the scene; guards come after them
      integer, allocatable :: of_pair(:)         !! (n_contact) < 0: with the pair's sides exchanged
      integer :: n_constraint = 0
      integer :: n_body = 0
      integer, allocatable :: body(:)            !! (n_node) connected part; 0: of none
      logical, allocatable :: is_alive(:, :)     !! (2, n_node) in an element, given, in an equation
      integer :: i_step = 0                      !! step of the deck the rest belongs to
      logical :: nlgeom = .false.
      logical :: has_linear_laws = .false.
      type(numbering_t) :: linked                !! linear constraints eliminated; if there are any
      type(unresolved_t), allocatable :: unresolved(:)   !! those of them that follow from others
      logical :: is_reduced = .true.             !! `numbering` is that one, else without them
      type(numbering_t) :: numbering
      type(loads_t) :: loads
      type(csr_t) :: matrix                      !! tangent over the unknowns
      logical :: is_symmetric = .false.          !! `matrix` is, up to round-off
      integer, allocatable :: slot(:)            !! element entries, as `reduction_slot` gives them
      type(reduction_t) :: reduction             !! brings dependent freedoms into `matrix`
      type(notes_t) :: notes                     !! on the linear constraints of the step
      real(dp), allocatable :: mass_value(:)     !! mass in the pattern of `matrix`
      type(solid_response_t) :: response         !! of all that has a potential
      real(wp) :: potential = 0.0_wp             !! energy of the given forces at the end
      !> Why there is no response: what "the displacements" did to what. Not allocated: there is one
      character(len=:), allocatable :: refusal
      type(error_t), allocatable :: failure      !! with which a giver ends the analysis
      logical :: is_stiffened = .false.          !! bodies that nothing holds are, in `matrix`
      real(wp), allocatable :: stiffening(:, :)  !! (2, n_node) [M/T^2]
      integer, allocatable :: stiff_slot(:)      !! where that enters `matrix`
      real(dp), allocatable :: stiff_value(:)    !! and what
      real(wp), allocatable :: inertia(:, :)     !! (2, n_node) s M (b du - w v0)
      real(wp), allocatable :: external(:, :)    !! (2, n_node) loads
      real(wp), allocatable :: residual(:, :)    !! (2, n_node) without contact forces
      real(wp), allocatable :: magnitude(:, :)   !! (2, n_node) sum of |contributions| to it
      real(wp), allocatable :: f_work(:, :), zero(:, :)
      type(stopwatch_t) :: contact_clock         !! search, gaps, constraints
   end type system_t

contains

   !> What stays the same in all steps of `scene`, and of what the model is given beside it.
   subroutine system_init(self, scene, error, given)
      type(system_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(given_t), intent(in), optional :: given
      integer :: n

      if (present(given)) then
         call solid_init(self%solid, scene, error, given%law)
         if (.not. allocated(error)) call given_sum_init(self%given, given, scene, error)
      else
         call solid_init(self%solid, scene, error)
      end if
      if (allocated(error)) return
      call mass_init(self%mass, self%solid, self%given, error)
      if (allocated(error)) return
      allocate(self%unresolved(0))
      self%has_linear_laws = all(scene%material%law == 0 .or. scene%material%law == law_linear)
      call linear_rows_init(self%linear, scene)
      call init_contact(self, scene, error)
      if (allocated(error)) return
      call layout_bodies(self%solid, self%given, scene%equation, self%body, self%n_body, &
         self%is_alive)
      n = self%solid%n_node
      allocate(self%response%force(2, n), self%response%magnitude(2, n), source=0.0_wp)
      allocate(self%response%rounding(2, n), source=0.0_wp)
      allocate(self%response%energy(self%solid%n_element), source=0.0_wp)
      allocate(self%inertia(2, n), self%external(2, n), source=0.0_wp)
      allocate(self%residual(2, n), self%magnitude(2, n), source=0.0_wp)
      allocate(self%f_work(2, n), self%zero(2, n), source=0.0_wp)
   end subroutine system_init

   !> The contact of pairs and guards, and the numbers of their constraints, after the linear ones.
   subroutine init_contact(self, scene, error)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t), allocatable :: pair(:)
      integer :: i

      self%n_pair = size(scene%pair)
      self%of_pair = [(i, i = 1, self%n_pair)]
      if (allocated(scene%guard)) then
         allocate(pair, source=[scene%pair, scene%guard])
         self%of_pair = [self%of_pair, merge(-1, 1, scene%guard%is_reverse)*scene%guard%of_pair]
      else
         allocate(pair, source=scene%pair)
      end if
      allocate(self%contact(size(pair)))
      allocate(self%first_constraint(size(pair) + 1), source=self%linear%n)
      self%n_constraint = self%linear%n
      do i = 1, size(pair)
         call new_contact(scene, pair(i), self%contact(i)%contact, error)
         if (allocated(error)) return
         self%n_constraint = self%n_constraint + self%contact(i)%contact%n_constraint
         self%first_constraint(i + 1) = self%n_constraint
      end do
   end subroutine init_contact

   !> Number the unknowns of step `i_step` of the deck and lay out its matrix. Linear constraints
   !> are eliminated, unless the deck asks for multipliers or their rows are too long.
   subroutine system_begin_step(self, scene, i_step, error)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(error_t), allocatable, intent(out) :: error
      logical :: is_too_full

      self%i_step = i_step
      self%is_stiffened = .false.
      self%nlgeom = scene%step(i_step)%nlgeom
      call begin_linear(self, scene)
      self%is_reduced = scene%step(i_step)%constraint_method == method_null_space
      call number_and_lay_out(self, scene, is_too_full, error)
      if (allocated(error)) return
      if (is_too_full) then
         call note_add(self%notes, "ties or equations with long rows: solved with their " // &
            "multipliers, as a saddle point; dual multipliers keep rows short")
         self%is_reduced = .false.
         call number_and_lay_out(self, scene, is_too_full, error)
         if (allocated(error)) return
      end if
      call mass_place(self%solid, self%given, self%slot, freedom_numbers(self%numbering), &
         self%reduction, self%matrix)
      if (allocated(self%mass_value)) deallocate(self%mass_value)
      allocate(self%mass_value(size(self%matrix%value)), source=self%matrix%value)
      if (self%given%is_any) call begin_given(self, scene, error)
      if (allocated(error)) return
      call loads_init(self%loads, scene, scene%step(i_step), self%numbering, self%matrix, &
         self%reduction)
   end subroutine system_begin_step

   !> Find the places of given tangents. In dynamics what is forced needs mass.
   subroutine begin_given(self, scene, error)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: node

      call given_sum_place(self%given, freedom_numbers(self%numbering), self%reduction, self%matrix)
      if (scene%step(self%i_step)%procedure /= procedure_dynamic) return
      node = given_sum_massless(self%given, self%numbering%unknown, self%mass)
      if (node > 0) call raise(error, err_input, "node " // to_text(scene%node_label(node)) // &
         " has given forces but no mass: a dynamic step needs it")
   end subroutine begin_given

   !> The linear constraints of the step, less those that follow from others.
   subroutine begin_linear(self, scene)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene

      self%notes = notes_t()
      self%linear%is_used = .true.
      if (self%linear%n == 0) return
      call numbering_init(self%linked, self%is_alive, scene%step(self%i_step)%prescribed, &
         self%linear, self%unresolved)
      self%linear%is_used(self%unresolved%row) = .false.
   end subroutine begin_linear

   !> Unknowns, and the pattern of the matrix with the places of element entries in it.
   subroutine number_and_lay_out(self, scene, is_too_full, error)
      type(system_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(out) :: is_too_full
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: full

      if (self%is_reduced .and. self%linear%n > 0) then
         self%numbering = self%linked
      else
         call numbering_init(self%numbering, self%is_alive, &
            scene%step(self%i_step)%prescribed)
      end if
      call layout_pattern(self%solid, self%given, self%is_alive, self%numbering, full, self%slot, &
         error)
      if (allocated(error)) return
      call reduction_init(self%reduction, self%numbering, full, self%matrix, self%slot, &
         is_too_full)
   end subroutine number_and_lay_out

   !> Residual of a motion without contact forces, and with `with_tangent` the tangent. `refusal` or
   !> `failure` is allocated where there is none.
   subroutine system_respond(self, motion, with_tangent)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else the matrix is left as it is

      if (allocated(self%refusal)) deallocate(self%refusal)
      if (allocated(self%failure)) deallocate(self%failure)
      self%external = 0.0_wp
      if (with_tangent) then
         self%is_symmetric = has_symmetric_tangent(self, motion)
         self%matrix%value = real(motion%pose%mass_scale*motion%pose%rate, dp)*self%mass_value
         call solid_respond(self%solid, motion, self%nlgeom, self%response, self%slot, &
            self%matrix%value, self%reduction%side%value)
         call loads_add(self%loads, self%solid, motion, self%external, self%matrix%value, &
            self%reduction%side%value)
      else
         call solid_respond(self%solid, motion, self%nlgeom, self%response)
         call loads_add(self%loads, self%solid, motion, self%external)
      end if
      if (self%given%is_any) call add_given(self, motion, with_tangent)
      if (with_tangent) call reduction_add(self%reduction, self%matrix)
      if (with_tangent .and. self%is_stiffened) call add_stiffening(self)
      if (self%response%inverted_element > 0) then
         call obstacle_text(self%solid, self%response, "", self%refusal)
         if (self%response%given%status == point_failed) call raise(self%failure, err_analysis, &
            self%refusal)
      end if
      if (allocated(self%refusal) .or. allocated(self%failure)) return
      call respond_inertia(self, motion)
      self%residual = self%inertia + (self%response%force - self%external)
      self%magnitude = self%magnitude + (self%response%magnitude + abs(self%external))
   end subroutine system_respond

   !> s M (b du - w v0), and the sizes of what it consists of in `magnitude`.
   subroutine respond_inertia(self, motion)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion

      self%inertia = 0.0_wp
      self%magnitude = 0.0_wp
      associate (pose => motion%pose)
         if (.not. pose%mass_scale > 0.0_wp) return
         self%f_work = pose%rate*(motion%du + motion%offset) - pose%v_weight*motion%v0
         call mass_times(self, self%f_work, self%inertia)
         self%inertia = pose%mass_scale*self%inertia
         self%f_work = abs(pose%rate*(motion%du + motion%offset)) + abs(pose%v_weight*motion%v0)
         call mass_times(self, self%f_work, self%magnitude)
         self%magnitude = pose%mass_scale*self%magnitude
      end associate
   end subroutine respond_inertia

   !> Let Newton's method not move the bodies `is_loose` farther than the residual calls for: a
   !> small stiffness of their nodes in the tangent alone, which changes no solution.
   subroutine system_stiffen(self, is_loose)
      type(system_t), intent(inout) :: self
      logical, intent(in) :: is_loose(:)         !! (n_body)
      integer :: e, i, d, s, t, n, pass

      self%is_stiffened = any(is_loose)
      if (.not. self%is_stiffened) return
      if (.not. allocated(self%stiffening)) allocate(self%stiffening(2, self%solid%n_node))
      self%stiffening = 0.0_wp
      do e = 1, self%solid%n_element
         if (.not. is_loose(self%body(self%solid%node(1, e)))) cycle
         do i = 1, self%solid%geometry(e)%n_node
            associate (node => self%solid%node(i, e))
               self%stiffening(:, node) = self%stiffening(:, node) &
                  + least_stiffness*self%solid%stiffness(i, e)
            end associate
         end do
      end do
      associate (numbering => self%numbering)
         do pass = 1, 2                          ! count, then list
            n = 0
            do d = 1, 2*self%solid%n_node
               if (.not. self%stiffening(2 - mod(d, 2), (d + 1)/2) > 0.0_wp) cycle
               do t = numbering%start(d) + 1, numbering%start(d + 1)
                  do s = numbering%start(d) + 1, numbering%start(d + 1)
                     if (numbering%column(t) == 0 .or. numbering%column(s) == 0) cycle
                     n = n + 1
                     if (pass == 1) cycle
                     self%stiff_slot(n) = csr_find(self%matrix, numbering%column(s), &
                        numbering%column(t))
                     self%stiff_value(n) = real(numbering%weight(s)*numbering%weight(t) &
                        *self%stiffening(2 - mod(d, 2), (d + 1)/2), dp)
                  end do
               end do
            end do
            if (pass == 2) exit
            if (allocated(self%stiff_slot)) deallocate(self%stiff_slot, self%stiff_value)
            allocate(self%stiff_slot(n), self%stiff_value(n))
         end do
      end associate
   end subroutine system_stiffen

   pure subroutine add_stiffening(self)
      type(system_t), intent(inout) :: self
      integer :: k

      do k = 1, size(self%stiff_slot)
         associate (slot => self%stiff_slot(k))
            if (slot > 0) self%matrix%value(slot) = self%matrix%value(slot) + self%stiff_value(k)
         end associate
      end do
   end subroutine add_stiffening

   !> Add the given forces to what the elements respond.
   subroutine add_given(self, motion, with_tangent)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent

      if (self%response%inverted_element > 0) return
      call given_sum_respond(self%given, motion, with_tangent, self%refusal, self%failure)
      if (allocated(self%refusal) .or. allocated(self%failure)) return
      self%response%force = self%response%force + self%given%force
      self%response%magnitude = self%response%magnitude + self%given%magnitude
      self%response%rounding = self%response%rounding + self%given%rounding
      self%potential = self%given%energy
      if (with_tangent) call given_sum_add_tangent(self%given, self%matrix%value, &
         self%reduction%side%value)
   end subroutine add_given

   !> An error if the last response was none, for the displacements that the words `by` name.
   subroutine system_check_response(self, by, error)
      type(system_t), intent(in) :: self
      character(len=*), intent(in) :: by         !! stands behind "by the displacements"
      type(error_t), allocatable, intent(out) :: error

      if (allocated(self%failure)) then
         allocate(error, source=self%failure)
      else if (allocated(self%refusal)) then
         call raise(error, err_analysis, self%refusal // " by the displacements " // by)
      end if
   end subroutine system_check_response

   !> Second derivatives of a potential are symmetric: those of discrete gradients of quadratic
   !> energies and of gradients at the end, unless a pressure follows the surface.
   pure logical function has_symmetric_tangent(self, motion)
      type(system_t), intent(in) :: self
      type(motion_t), intent(in) :: motion

      has_symmetric_tangent = motion%pose%is_end .or. (self%has_linear_laws .and. .not. self%nlgeom)
      if (self%nlgeom .and. self%loads%has_pressure) has_symmetric_tangent = .false.
      if (.not. given_sum_is_symmetric(self%given, motion)) has_symmetric_tangent = .false.
   end function has_symmetric_tangent

   !> The tangent of internal forces and inertia times `direction`, on all nodes: what prescribed
   !> motion does to first order.
   subroutine system_tangent_times(self, motion, direction, product)
      type(system_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous :: direction(:, :)            !! (2, n_node)
      real(wp), intent(inout), contiguous :: product(:, :)           !! (2, n_node)

      self%f_work = (motion%pose%mass_scale*motion%pose%rate)*direction
      call mass_times(self, self%f_work, product)
      call solid_tangent_times(self%solid, motion, self%nlgeom, direction, product)
      if (self%given%is_any) call given_sum_tangent_times(self%given, motion, direction, product)
   end subroutine system_tangent_times

   !> M field, in both directions.
   pure subroutine mass_times(self, field, product)
      type(system_t), intent(in) :: self
      real(wp), intent(in), contiguous :: field(:, :)        !! (2, n_node)
      real(wp), intent(inout), contiguous :: product(:, :)   !! (2, n_node)
      real(wp) :: total(2)
      integer :: i, k

      do i = 1, self%mass%n_row
         total = 0.0_wp
         do k = self%mass%row_start(i) + 1, self%mass%row_start(i + 1)
            total = total + real(self%mass%value(k), wp)*field(:, self%mass%column(k) + 1)
         end do
         product(:, i) = total
      end do
   end subroutine mass_times

end module emcon_system
