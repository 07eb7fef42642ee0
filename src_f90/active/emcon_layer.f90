!> Equilibrium of massless contact nodes, in increments that open or close contacts.
!>
!> The massless freedoms z balance the elements that stand on them, with all others held: a static
!> problem of contact in z alone, on a scene of these elements with the contact of the whole. Its
!> energy, and what closing contacts have taken, goes back into the velocities along the forces that
!> the contacts which open or close exert on the massive freedoms through z. Source: docs/theory.md,
!> section 6.4.
module emcon_layer
   use emcon_active_set, only : active_set_begin, active_set_init, active_set_t, step_done, &
      step_singular, step_too_far, touch_tol
   use emcon_active_set_solve, only : active_set_solve
   use emcon_constraints, only : constraint_set_t, constraints_dissipated, constraints_evaluate, &
      constraints_select
   use emcon_contact_law, only : loss_friction
   use emcon_correction, only : correction_free, correction_reset
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end
   use emcon_factor_policy, only : factor_policy_offer
   use emcon_friction, only : friction_init, friction_t
   use emcon_gaps, only : gaps_forget
   use emcon_host, only : host_t
   use emcon_kinds, only : wp
   use emcon_layer_push, only : layer_find_push
   use emcon_layer_type, only : layer_t
   use emcon_massless, only : massless_share
   use emcon_motion, only : at_rest, motion_init, motion_evaluate, motion_t
   use emcon_newton, only : newton_init
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : load_point, load_t, method_saddle_point, prescribed_t, step_t
   use emcon_system, only : system_begin_step, system_find_energy, system_init, system_renew, &
      system_respond, system_t
   use emcon_term_registry, only : terms_solid
   implicit none
   private
   public :: layer_t, layer_init, layer_renew, layer_begin_step, layer_mark, layer_settle, &
      layer_count, layer_share, layer_find_acting, layer_take_velocities, layer_guess, layer_free

   !> Work below this part of what it is held against is round-off.
   real(wp), parameter :: rounding = 1.0e3_wp*epsilon(1.0_wp)
   !> With friction the balance is found so often at most: each time it acts where it did at the end
   !> of the one before.
   integer, parameter :: most_balances = 6

contains

   !> The layer of `scene` on its massless nodes, with the laws that the model is given.
   subroutine layer_init(self, scene, is_massless, model, error, host)
      type(layer_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_massless(:)      !! (n_node)
      type(system_t), intent(in) :: model        !! whose contact it is
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host
      integer :: n

      self%is_massless = is_massless
      allocate(self%needs_mass(size(is_massless)), source=.false.)
      self%is_on = any(is_massless)
      if (.not. self%is_on) return
      call cut_scene(self, scene)
      if (present(host)) then
         if (allocated(host%law)) allocate(self%laws%law, source=host%law)
      end if
      call system_init(self%system, self%scene, error, self%laws)
      if (allocated(error)) return
      self%n_before = model%first_constraint(1)
      n = model%n_constraint - self%n_before
      self%system%n_pair = model%n_pair
      self%system%n_constraint = n
      self%system%first_constraint = model%first_constraint - self%n_before
      deallocate(self%system%contact)
      allocate(self%system%contact(size(model%contact)))
      self%system%contact%of_pair = model%contact%of_pair
      allocate(self%acts(n), source=.false.)
      allocate(self%lam(n), source=0.0_wp)
      call self%state%contacts%begin(n)
      call motion_init(self%motion, scene%x)
      allocate(self%du, self%push, source=at_rest(scene%x))
      allocate(self%newton)
      call active_set_init(self%active, self%system)
   end subroutine layer_init

   !> What acts at the end of a solved step: what does in it, or in the balance of the layer.
   pure subroutine layer_find_acting(self, active, acts)
      type(layer_t), intent(in) :: self
      type(active_set_t), intent(in) :: active   !! of the step
      logical, intent(out) :: acts(:)            !! (n_constraint)

      acts = active%is_active
      if (self%is_settled) acts(self%n_before + 1:) = self%acts
   end subroutine layer_find_acting

   !> How many of the marked nodes have no mass.
   pure integer function layer_count(self, is_meant)
      type(layer_t), intent(in) :: self
      logical, intent(in) :: is_meant(:)         !! (n_node)

      layer_count = count(self%is_massless .and. is_meant)
   end function layer_count

   !> The largest part of its mass that a body of `model` has moved off massless nodes.
   subroutine layer_share(self, model, share, body)
      type(layer_t), intent(in) :: self
      type(system_t), intent(in), target :: model
      real(wp), intent(out) :: share             !! 0 to 1
      integer, intent(out) :: body               !! its number; 0: no mass is moved

      call massless_share(terms_solid(model%term), self%is_massless, model%space%body, share, body)
   end subroutine layer_share

   !> What has no mass moves as its displacement says.
   pure subroutine layer_take_velocities(self, h, du, v)
      type(layer_t), intent(in) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), intent(in) :: du(:, :)           !! (n_dim, n_node) over the step [L]
      real(wp), intent(inout) :: v(:, :)         !! (n_dim, n_node) at its end [L/T]
      integer :: i

      do i = 1, size(self%is_massless)
         if (self%is_massless(i)) v(:, i) = du(:, i)/h
      end do
   end subroutine layer_take_velocities

   !> First guess of the motion: a node without mass moves as those with mass in its elements, in
   !> the mean. Its own velocity alternates: forces that balance in the mean of a step are off at
   !> its end as at its start, with the other sign.
   pure subroutine layer_guess(self, du)
      type(layer_t), intent(in) :: self
      real(wp), intent(inout) :: du(:, :)        !! (n_dim, n_node) over the step [L]
      real(wp) :: total(size(du, 1), size(du, 2))
      integer :: n(size(du, 2)), i, e

      total = 0.0_wp
      n = 0
      do e = 1, size(self%scene%element%kind)
         associate (nodes => self%scene%element%node(:, e))
            associate (bare => pack(nodes, find_massless(self, nodes, .true.)), &
                  heavy => pack(nodes, find_massless(self, nodes, .false.)))
               do i = 1, size(bare)
                  total(:, bare(i)) = total(:, bare(i)) + sum(du(:, heavy), 2)
               end do
               n(bare) = n(bare) + size(heavy)
            end associate
         end associate
      end do
      do i = 1, size(n)
         if (n(i) > 0) du(:, i) = total(:, i)/n(i)
      end do
   end subroutine layer_guess

   !> Which of these nodes have no mass, or which have some?
   pure function find_massless(self, node, is_massless) result(is_meant)
      type(layer_t), intent(in) :: self
      integer, intent(in) :: node(:)             !! of an element; 0: none
      logical, intent(in) :: is_massless
      logical :: is_meant(size(node))

      is_meant = node > 0 .and. (self%is_massless(max(1, node)) .eqv. is_massless)
   end function find_massless

   !> The layer of `scene` on other massless nodes, with the same laws. The step of the deck has to
   !> begin anew.
   subroutine layer_renew(self, scene, is_massless, model, error)
      type(layer_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_massless(:)      !! (n_node)
      type(system_t), intent(in) :: model        !! whose contact it is
      type(error_t), allocatable, intent(out) :: error
      type(host_t) :: laws

      laws = self%laws
      call layer_free(self)
      call layer_init(self, scene, is_massless, model, error, laws)
   end subroutine layer_renew

   !> Keep of the scene the elements on massless nodes, and nothing that joins or meets.
   subroutine cut_scene(self, scene)
      type(layer_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable :: e(:)
      logical :: is_in(size(scene%element%kind))
      integer :: i

      do i = 1, size(is_in)
         associate (node => scene%element%node(:, i))
            is_in(i) = any(self%is_massless(pack(node, node > 0)))
         end associate
      end do
      e = pack([(i, i = 1, size(is_in))], is_in)
      self%scene = scene
      self%scene%element%label = scene%element%label(e)
      self%scene%element%origin = scene%element%origin(e)
      self%scene%element%kind = scene%element%kind(e)
      self%scene%element%node = scene%element%node(:, e)
      self%scene%element%section = scene%element%section(e)
      associate (own => self%scene)
         deallocate(own%tie, own%equation, own%rigid, own%pair, own%surface, own%set%element, &
            own%step)
         allocate(own%tie(0), own%equation(0), own%rigid(0), own%pair(0), own%surface(0), &
            own%set%element(0), own%step(1))
         allocate(own%step(1)%load(0))
         if (allocated(own%guard)) deallocate(own%guard)
      end associate
   end subroutine cut_scene

   !> Set up for `step` of the deck: statics of z, with the contact of that step.
   subroutine layer_begin_step(self, step, model, error)
      type(layer_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(system_t), intent(in) :: model        !! set up for the step, and its contact
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      associate (own => self%scene%step(1))
         own = step
         own%scheme = scheme_row("STATIC", "")
         own%contact%method = method_saddle_point
         call hold_massive(self, model%space%numbering%unknown, own%prescribed)
         own%load = loads_of(self)
      end associate
      call system_begin_step(self%system, self%scene, 1, error)
      if (allocated(error)) return
      call newton_init(self%newton, self%system%space%numbering%n_unknown, self%scene%x, &
         step%solution%newton_tolerance, step%solution%newton_maximum)
      call correction_reset(self%newton%correction, method_saddle_point, step%solution%solver)
      do i = 1, size(self%system%contact)
         if (allocated(self%system%contact(i)%contact)) deallocate(self%system%contact(i)%contact)
         allocate(self%system%contact(i)%contact, source=model%contact(i)%contact)
      end do
      call begin_friction(self)
      call layer_mark(self, self%system, self%active%rules%closes)
      self%active%rules%holds_gap = .true.
      self%active%rules%has_impacts = .false.
      self%active%rules%puts_off = .true.
      self%active%rules%may_cut = .false.
   end subroutine layer_begin_step

   !> The contacts of the layer rub as those of the model do.
   subroutine begin_friction(self)
      type(layer_t), intent(inout) :: self

      call friction_init(self%active%friction, self%system)
      associate (contacts => self%state%contacts, friction => self%active%friction)
         contacts%slides_along = 0.0_wp*friction%tau
         contacts%drag = 0.0_wp*friction%tau
      end associate
   end subroutine begin_friction

   !> The contacts of `system` whose slave nodes have no mass.
   pure subroutine layer_mark(self, system, is_of_z)
      type(layer_t), intent(in) :: self
      type(system_t), intent(in) :: system
      logical, intent(out) :: is_of_z(:)         !! (n_constraint)
      integer :: i

      is_of_z = .false.
      do i = 1, size(system%contact)
         associate (contact => system%contact(i)%contact, first => system%first_constraint(i))
            is_of_z(first + 1:first + contact%n_constraint) = self%is_massless(contact%node)
         end associate
      end do
   end subroutine layer_mark

   !> All freedoms of the layer's elements but z are prescribed: what has mass, or is no unknown.
   pure subroutine hold_massive(self, unknown, prescribed)
      type(layer_t), intent(in) :: self
      integer, intent(in) :: unknown(:, :)       !! (n_dim, n_node) of the model; 0: it is none
      type(prescribed_t), allocatable, intent(out) :: prescribed(:)
      logical, allocatable :: is_held(:, :)
      integer :: i, a, k

      allocate(is_held, source=self%system%space%is_alive)
      do i = 1, size(is_held, 2)
         if (self%is_massless(i)) is_held(:, i) = is_held(:, i) .and. unknown(:, i) == 0
      end do
      allocate(prescribed(count(is_held)))
      k = 0
      do i = 1, size(is_held, 2)
         do a = 1, size(is_held, 1)
            if (.not. is_held(a, i)) cycle
            k = k + 1
            prescribed(k)%node = i
            prescribed(k)%dof = a
         end do
      end do
   end subroutine hold_massive

   !> A force on each freedom of z, 0 so far.
   pure function loads_of(self) result(load)
      type(layer_t), intent(in) :: self
      type(load_t), allocatable :: load(:)
      integer :: i, a, k

      associate (n_dim => size(self%scene%x, 1))
         allocate(load(n_dim*count(self%is_massless)))
         k = 0
         do i = 1, size(self%is_massless)
            if (.not. self%is_massless(i)) cycle
            do a = 1, n_dim
               k = k + 1
               load(k)%kind = load_point
               load(k)%target = i
               load(k)%place = a
            end do
         end do
      end associate
   end function loads_of

   subroutine layer_free(self)
      type(layer_t), intent(inout) :: self

      if (allocated(self%newton)) call correction_free(self%newton%correction)
   end subroutine layer_free

   !> Balance z at the end of a solved step, if that has opened, closed or moved contacts. `active`
   !> are the contacts of the model in the step, `load` its external forces at the end.
   subroutine layer_settle(self, motion, active, load, status, error)
      type(layer_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! of the step
      type(active_set_t), intent(in) :: active
      real(wp), intent(in) :: load(:, :)         !! (n_dim, n_node) [M L/T^2]
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: stays(size(self%acts)), has_changed(size(self%acts))
      real(wp) :: weight(size(self%acts)), before
      logical :: is_singular

      status = step_done
      self%is_settled = .false.
      self%needs_mass = .false.
      self%acts = active%is_active(self%n_before + 1:)
      has_changed = self%acts .neqv. active%start%was_active(self%n_before + 1:)
      call mark_moved(self, active%set, has_changed)
      if (.not. any(has_changed)) return
      call take_multipliers(self, active)
      call begin(self, motion, load)
      call system_find_energy(self%system, self%motion)
      before = sum(self%system%response%energy)
      call find_apart(self, stays)
      has_changed = has_changed .and. .not. stays
      if (.not. any(has_changed)) return
      call balance(self, stays, status, error)
      if (allocated(error)) return
      if (status /= step_done) then
         call mark_trouble(self, has_changed)
         return
      end if
      call motion_evaluate(self%motion)
      call system_respond(self%system, self%motion, .true.)
      self%du = self%motion%du
      self%work = sum(load*self%du)
      call system_find_energy(self%system, self%motion)
      self%rubbed = dissipated(self%active%set)
      self%released = before - sum(self%system%response%energy) + self%work - self%rubbed
      weight = active%start%lam0(self%n_before + 1:) + self%lam
      where (.not. stays)
         has_changed = has_changed .or. (self%acts .neqv. self%active%is_active)
         self%acts = self%active%is_active
         self%lam = 0.0_wp
      end where
      associate (set => self%active%set)
         self%lam(set%id(:set%n)) = set%lam(:set%n)
      end associate
      weight = merge(weight + self%lam, 0.0_wp, has_changed)
      call layer_find_push(self, weight, is_singular, error)
      ! A contact that has lost its surface has no direction either; one that held nothing no force
      ! that could give back what z has released.
      is_singular = is_singular .or. .not. maxval(abs(self%push)) > epsilon(weight)*sum(abs(weight))
      is_singular = is_singular .or. maxval(abs(self%push))*maxval(abs(self%du)) &
         < rounding*abs(self%released)
      self%is_settled = .not. (is_singular .or. allocated(error))
      if (.not. is_singular) return
      status = step_singular
      call mark_trouble(self, has_changed)
   end subroutine layer_settle

   !> Contacts whose gap has moved by more than a solve leaves: over the edges of their new stencils
   !> the step began with another gap than the last one has ended with.
   pure subroutine mark_moved(self, set, has_changed)
      type(layer_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set  !! of the step
      logical, intent(inout) :: has_changed(:)   !! (contacts)
      integer :: k

      do k = set%n_permanent + 1, set%n
         if (abs(set%item(k)%dgap) > self%newton%convergence%tolerance*set%item(k)%size) then
            has_changed(set%id(k) - self%n_before) = .true.
         end if
      end do
   end subroutine mark_moved

   !> Solve for z and its contacts; those that stay do not act.
   subroutine balance(self, stays, status, error)
      type(layer_t), intent(inout) :: self
      logical, intent(in) :: stays(:)            !! (contacts)
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: before(size(self%du, 1), size(self%du, 2))
      integer :: i

      self%state%contacts%is_active = self%acts .and. .not. stays
      self%state%contacts%lam = self%lam
      call offer_factor(self)
      do i = 1, merge(most_balances, 1, self%active%friction%is_on)
         before = self%motion%du
         call active_set_begin(self%active, self%system, self%motion, self%state)
         self%active%is_left_out = stays
         self%newton%driven = 0.0_wp
         call active_set_solve(self%active, self%system, self%scene, self%newton, self%motion, &
            status, error)
         if (status /= step_done .or. allocated(error)) return
         if (.not. does_shift(self) .or. maxval(abs(self%motion%du - before)) &
            <= rounding*maxval(abs(before))) exit
         self%state%contacts%is_active = self%active%is_active
         self%state%contacts%lam = self%active%lam
         call take_friction(self, self%active%friction, 0)
      end do
      if (any(have_closed(self) .and. .not. stays)) status = step_too_far
   end subroutine balance

   !> Many contacts may be condensed by a factor of this balance. By a tangent they take room for
   !> what each of them moves: more than W of that factor, however many they are.
   pure subroutine offer_factor(self)
      type(layer_t), intent(inout) :: self

      associate (matrix => self%system%matrix, correction => self%newton%correction)
         if (size(matrix%column) > 0) correction%kept%most_products = 1 + int(min( &
            real(matrix%n_row, wp)**2, 0.5_wp*huge(1))/size(matrix%column))
         call factor_policy_offer(self%newton%factor_policy, correction)
      end associate
   end subroutine offer_factor

   !> Does some friction act where it was expected, and not where it is? In the plane that is not
   !> asked.
   pure logical function does_shift(self)
      type(layer_t), intent(in) :: self
      integer :: i

      does_shift = self%active%friction%n_slip == 1
      do i = 1, size(self%system%contact)
         does_shift = does_shift .or. any(self%system%contact(i)%contact%state%slip_shift > 0.0_wp)
      end do
   end function does_shift

   !> The contacts that were left out as they seemed to follow from others, and close all the same:
   !> of two corners that pass each other z may take the wrong side.
   pure function have_closed(self)
      type(layer_t), intent(in) :: self
      logical :: have_closed(size(self%acts))    !! (contacts)
      integer :: i

      have_closed = self%active%is_left_out
      do i = 1, size(self%system%contact)
         associate (contact => self%system%contact(i)%contact, &
               first => self%system%first_constraint(i))
            associate (have => have_closed(first + 1:first + contact%n_constraint), &
                  gap => contact%state)
               have = have .and. gap%is_near .and. gap%is_over .and. &
                  gap%gap1 < min(gap%gap0, 0.0_wp) - touch_tol*gap%size
            end associate
         end associate
      end do
   end function have_closed

   !> The massless slave nodes of the contacts that have opened or closed, or of all.
   pure subroutine mark_trouble(self, has_changed)
      type(layer_t), intent(inout) :: self
      logical, intent(in) :: has_changed(:)      !! (contacts)
      integer :: i

      do i = 1, size(self%system%contact)
         associate (node => self%system%contact(i)%contact%node, &
               first => self%system%first_constraint(i))
            self%needs_mass(pack(node, has_changed(first + 1:first + size(node)))) = .true.
         end associate
      end do
      self%needs_mass = self%needs_mass .and. self%is_massless
      if (.not. any(self%needs_mass)) self%needs_mass = self%is_massless
   end subroutine mark_trouble

   !> The contacts that z takes no part in: those between massive nodes alone stay as they are.
   subroutine find_apart(self, stays)
      type(layer_t), intent(inout) :: self
      logical, intent(out) :: stays(:)           !! (contacts)
      type(constraint_set_t) :: set
      logical :: is_near(size(stays))
      integer :: k, pair

      stays = .not. self%active%rules%closes
      do pair = 1, size(self%system%contact)
         associate (contact => self%system%contact(pair)%contact, motion => self%motion, &
               first => self%system%first_constraint(pair))
            call contact%begin_step(motion%x, motion%u0, motion%du)
            call contact%measure(motion%x, motion%u0, motion%du)
            is_near(first + 1:first + contact%n_constraint) = contact%state%is_near
         end associate
      end do
      call constraints_select(set, pack([(k, k = 1, size(stays))], stays .and. is_near))
      call constraints_evaluate(set, self%system, self%motion, .true.)
      do k = 1, set%n
         associate (item => set%item(k))
            stays(set%id(k)) = .not. any(self%is_massless(item%node(:item%n_node)))
         end associate
      end do
   end subroutine find_apart

   !> What friction takes in the balance.
   pure real(wp) function dissipated(set)
      type(constraint_set_t), intent(in) :: set
      integer :: k

      dissipated = 0.0_wp
      do k = set%n_permanent + 1, set%n_condition
         dissipated = dissipated + constraints_dissipated(set, k, loss_friction)
      end do
   end function dissipated

   !> The mean multipliers of the step, and friction.
   pure subroutine take_multipliers(self, active)
      type(layer_t), intent(inout) :: self
      type(active_set_t), intent(in) :: active
      integer :: k

      self%lam = 0.0_wp
      do k = active%set%n_permanent + 1, active%set%n
         self%lam(active%set%id(k) - self%n_before) = active%set%lam(k)
      end do
      call take_friction(self, active%friction, self%n_before)
   end subroutine take_multipliers

   !> The balance begins with this friction, of contacts behind the first `n_before`.
   pure subroutine take_friction(self, friction, n_before)
      type(layer_t), intent(inout) :: self
      type(friction_t), intent(in) :: friction
      integer, intent(in) :: n_before
      integer :: k

      if (.not. friction%is_on) return
      associate (contacts => self%state%contacts)
         contacts%drag = friction%tau(:, n_before + 1:)
         do k = 1, size(contacts%drag, 2)
            contacts%slides_along(:, k) &
               = friction%law(n_before + k)%status%direction(:friction%n_slip)
         end do
      end associate
   end subroutine take_friction

   !> Place the layer at the end of the step, under its loads.
   subroutine begin(self, motion, load)
      type(layer_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: load(:, :)
      integer :: k

      do k = 1, size(self%scene%step(1)%load)
         associate (own => self%scene%step(1)%load(k))
            own%value = load(own%place, own%target)
            own%value_start = own%value
         end associate
      end do
      call system_renew(self%system, self%scene)
      self%motion%evaluation = evaluation_at_end
      self%motion%u0 = motion%u0 + motion%du
      self%motion%du = 0.0_wp
      call motion_evaluate(self%motion)
      call gaps_forget(self%system)
      call system_respond(self%system, self%motion, .false.)
   end subroutine begin

end module emcon_layer
