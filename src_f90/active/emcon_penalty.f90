!> Contact that gives way: how stiff each constraint of a step is, by the deck or by the elements at
!> the surfaces. Source: docs/theory.md, eqs. (20a) to (20e).
module emcon_penalty
   use emcon_constraints, only : constraint_index, constraint_set_t
   use emcon_contact, only : contact_t
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_contact_law_registry, only : contact_law_of_method
   use emcon_errors, only : err_input, error_t, raise
   use emcon_gaps, only : pair_measure, pair_search
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t, where_text
   use emcon_state, only : contact_state_t
   use emcon_steps, only : method_augmented_lagrange, method_penalty, step_is_dynamic, step_t
   use emcon_system, only : system_t
   use emcon_term_registry, only : terms_mass_rows
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: penalty_state_t, penalty_begin_step, penalty_forget, penalty_select, penalty_augment, &
      penalty_free, penalty_start, penalty_stored, penalty_depth, penalty_keep, penalty_owes

   !> Solves with multipliers that are given, at most.
   integer, parameter, public :: most_augmentations = 50
   !> By default an augmented Lagrangian is so much stiffer than what it pushes at.
   real(wp), parameter :: augmented_factor = 3.0_wp
   !> Where the largest gap that is left does not fall to this part, pushes are stiffer by `stiffer`
   !> from then on, as of nodes on nodes that both sides hold, whose rows say nearly the same; by
   !> `stiffest` at most.
   real(wp), parameter :: least_gain = 0.25_wp, stiffer = 10.0_wp, stiffest = 1.0e4_wp

   type :: penalty_state_t
      logical :: is_on = .false.                 !! contact gives way in this step
      logical :: augments = .false.              !! and is pushed back: AUGMENTED LAGRANGE
      logical :: is_at_ends = .false.            !! and pushes where steps begin and end: explicit
      real(wp) :: tolerance = 0.0_wp             !! of that, by the edge
      integer :: n_augmentation = 0              !! in the last increment
      real(wp) :: left = huge(1.0_wp)            !! of the gaps before the last one, by the edge
      real(wp) :: raised = 1.0_wp                !! `stiffness` is to be so much larger in the step
      class(contact_law_t), allocatable :: law   !! of contacts, where these give way
      logical :: is_meant = .false.              !! all have their own, as the deck gives them
      real(wp), allocatable :: stiffness(:)      !! (n_constraint) of contacts [M/T^2]
      real(wp), allocatable :: area(:)           !! (n_constraint) of contacts [L^2]
      real(wp), allocatable :: edge(:)           !! (n_constraint) of the slave surface [L]
      real(wp), allocatable :: closure(:)        !! (n_constraint) that of `state_t` [L]
      real(wp), allocatable :: stretch(:, :)     !! (most_slips, n_constraint) the same [L]
   end type penalty_state_t

contains

   !> Set up for `step`, whose contacts are laid out.
   subroutine penalty_begin_step(self, system, scene, step, error)
      type(penalty_state_t), intent(out) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: inner(size(scene%x, 2)), mass(size(scene%x, 2))
      integer :: k

      self%augments = step%contact%method == method_augmented_lagrange
      self%is_on = (self%augments .or. step%contact%method == method_penalty) .and. &
         size(system%contact) > 0
      self%is_at_ends = self%is_on .and. step%scheme%is_explicit
      do k = 1, size(system%contact)
         system%contact(k)%contact%step%has_compliance = self%is_on
         system%contact(k)%contact%step%is_penalty = .false.
         system%contact(k)%contact%step%engages = 0.0_wp
      end do
      if (.not. self%is_on) return
      self%tolerance = step%contact%penalty%tolerance
      if (allocated(system%contact_law) .and. .not. self%augments) then
         allocate(self%law, source=system%contact_law)
      else
         call contact_law_of_method(step%contact%method, self%law)
      end if
      self%is_meant = .not. self%augments
      allocate(self%closure(system%n_constraint), source=1.0_wp)
      allocate(self%stiffness(system%n_constraint), self%area(system%n_constraint), &
         self%edge(system%n_constraint), source=0.0_wp)
      inner = 0.0_wp
      do k = 1, size(system%term)
         call system%term(k)%term%add_stiffness(inner)
      end do
      mass = 0.0_wp
      if (self%augments .and. step_is_dynamic(step)) call terms_mass_rows(system%term, mass)
      inner = inner + 2.0_wp*mass/step%time%h**2
      do k = 1, size(system%contact)
         call set_contact(self, system, scene, step, k, inner, error)
         if (allocated(error)) return
      end do
   end subroutine penalty_begin_step

   !> The stiffness of contact `k`: one pressure by penetration for all of its nodes, that of the
   !> deck, or the mean of `inner` at its slave nodes by their area, or else at the master's. Where
   !> nodes of both sides push each side has half of it. Pressures of its surfaces take its place.
   subroutine set_contact(self, system, scene, step, k, inner, error)
      type(penalty_state_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      integer, intent(in) :: k
      real(wp), intent(in) :: inner(:)           !! (n_node) stiffness of what stands there [M/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: area(system%contact(k)%contact%n_constraint), by_area

      associate (contact => system%contact(k)%contact, before => system%first_constraint(k))
         if (contact%n_constraint == 0) return
         call contact%own_area(scene%x, area)
         if (.not. sum(area) > 0.0_wp) then
            call refuse(scene, step, system%contact(k)%of_pair, "a slave surface " // &
               "made of nodes has no area, which penalties need; name its elements and faces, " // &
               "or use hard contact", error)
            return
         end if
         self%area(before + 1:before + size(area)) = area*contact%area_factor
         ! Nodes at the ends of a surface have half of an edge.
         self%edge(before + 1:before + size(area)) = maxval(area/contact%thickness)
         contact%step%is_penalty = .not. self%augments .and. step_is_dynamic(step)
         if (has_own_law(self, contact)) then
            if (k > system%n_pair) return
            contact%step%engages = contact%laws%row%reach
            call tell("the PRESSURE-OVERCLOSURE of its surfaces")
            return
         end if
         self%is_meant = .false.
         by_area = step%contact%penalty%stiffness
         if (.not. by_area > 0.0_wp) by_area = step%contact%penalty%factor*merge( &
            augmented_factor, 1.0_wp, self%augments)*of_either(system, scene, k, inner)/sum(area)
         if (.not. by_area > 0.0_wp) then
            call refuse(scene, step, system%contact(k)%of_pair, "neither " // &
               "surface of a contact pair belongs to elastic elements: give STIFFNESS, the " // &
               "pressure by penetration", error)
            return
         end if
         self%stiffness(before + 1:before + size(area)) = area*contact%area_factor*by_area
         if (k <= system%n_pair) call tell("a stiffness of " // to_text(by_area, 9) // &
            ", pressure by penetration")
      end associate

   contains

      subroutine tell(by_what)
         character(len=*), intent(in) :: by_what

         call note_add(system%notes, "contact of pair " // to_text(k) // " is soft, with " // &
            by_what)
      end subroutine tell

   end subroutine set_contact

   !> An error at the card of the method, or at a pair that gives way by a pressure.
   subroutine refuse(scene, step, of_pair, what, error)
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      integer, intent(in) :: of_pair             !! of the scene; < 0: its sides exchanged
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error

      associate (card => step%contact%penalty%origin, pair => scene%pair(abs(of_pair))%origin)
         if (card%line > 0) then
            call raise(error, err_input, where_text(scene, card) // ": error: *CONSTRAINT " // &
               "METHOD: " // what)
         else
            call raise(error, err_input, where_text(scene, pair) // ": error: *CONTACT PAIR: " // &
               what)
         end if
      end associate
   end subroutine refuse

   !> Have the surfaces of a contact a law of their own, by which it gives way?
   pure logical function has_own_law(self, contact)
      type(penalty_state_t), intent(in) :: self
      class(contact_t), intent(in) :: contact

      has_own_law = allocated(contact%laws%row) .and. .not. self%augments
   end function has_own_law

   !> What is closed as pairs begin to act, and what it stores there. Where no body is in another a
   !> mean gap below 0, as of curved faces, is no closure: forces act against further motion only.
   subroutine penalty_start(self, system, motion, begins, is_apart, closure, energy)
      type(penalty_state_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion       !! none, at the start
      logical, intent(in) :: begins(:)           !! (n_pair) those to look at
      logical, intent(in) :: is_apart            !! no body is in another
      real(wp), intent(inout) :: closure(:)      !! (n_constraint) those of others stand [L]
      real(wp), intent(out) :: energy            !! [M L^2/T^2]
      class(contact_law_t), allocatable :: law
      type(contact_place_t) :: place
      real(wp) :: open
      integer :: i, id, k

      energy = 0.0_wp
      if (.not. self%is_on) return
      do k = 1, system%n_pair
         if (.not. (begins(k) .and. has_own_law(self, system%contact(k)%contact))) cycle
         call pair_search(system, k, motion)
         call pair_measure(system, k, motion%x, motion%u0, motion%du)
         associate (contact => system%contact(k)%contact)
            do i = 1, contact%n_constraint
               id = system%first_constraint(k) + i
               associate (gap => contact%state(i))
                  if (.not. (gap%is_near .and. gap%is_over)) cycle
                  if (gap%gap0 < -contact%max_penetration_at_start*gap%size) cycle
                  open = gap%gap0
                  if (is_apart) open = max(open, 0.0_wp)
                  closure(id) = min(open - gap%closed, 0.0_wp)*contact%share(i)
               end associate
               if (.not. closure(id) < 0.0_wp) cycle
               place = contact_place_t(self%area(id), self%stiffness(id), contact%share(i), &
                  closure(id))
               if (allocated(law)) deallocate(law)
               allocate(law, source=contact%laws%row)
               call law%begin(place)
               energy = energy + law%stored()
            end do
         end associate
      end do
   end subroutine penalty_start

   !> What contact `k` has stored at the end of the last step.
   subroutine penalty_free(self, system, k, contacts, energy)
      type(penalty_state_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: k                   !! number of the contact
      type(contact_state_t), intent(in) :: contacts
      real(wp), intent(out) :: energy            !! [M L^2/T^2]
      class(contact_law_t), allocatable :: law
      type(contact_place_t) :: place
      type(contact_values_t) :: at
      type(contact_response_t) :: response
      integer :: i, id

      energy = 0.0_wp
      if (.not. self%is_on .or. self%augments) return
      associate (contact => system%contact(k)%contact)
         do i = 1, contact%n_constraint
            id = system%first_constraint(k) + i
            if (.not. contacts%closure(id) < 0.0_wp) cycle
            place = contact_place_t(self%area(id), self%stiffness(id), contact%share(i), &
               contacts%closure(id))
            if (allocated(self%stretch)) place%stretch = contacts%stretch(:, id)
            call give_law(self, contact, law)
            call law%begin(place)
            at%gap0 = place%closure/place%share
            at%gap1 = at%gap0
            call law%respond(at, response)
            energy = energy + law%stored()
         end do
      end associate
   end subroutine penalty_free

   !> The stiffness at the nodes of contact `k`, or else of the other side.
   pure real(wp) function of_either(system, scene, k, inner) result(total)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      real(wp), intent(in) :: inner(:)           !! (n_node)

      total = sum(inner(system%contact(k)%contact%node))
      if (.not. total > 0.0_wp) total = of_opposite(system, scene, k, inner)
   end function of_either

   !> The stiffness at the nodes of the other side of contact `k`, if these are some contact's: of
   !> its pair, or of that the other way round.
   pure real(wp) function of_opposite(system, scene, k, inner) result(total)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      real(wp), intent(in) :: inner(:)           !! (n_node)
      integer :: i

      total = 0.0_wp
      do i = 1, size(system%contact)
         associate (own => abs(system%contact(k)%of_pair), other => abs(system%contact(i)%of_pair))
            if (i == k) cycle
            if (own /= other .and. (scene%pair(own)%slave /= scene%pair(other)%master &
               .or. scene%pair(own)%master /= scene%pair(other)%slave)) cycle
         end associate
         total = sum(inner(system%contact(i)%contact%node))
         return
      end do
   end function of_opposite

   !> Let the contacts of `set` give way, whose targets and multipliers stand.
   subroutine penalty_select(self, system, set, is_stored)
      type(penalty_state_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(inout) :: set
      logical, intent(in) :: is_stored           !! pushes are discrete gradients of what is stored
      type(contact_place_t) :: place
      integer :: k, pair, i

      set%penalty%is_on = self%is_on .and. set%n > 0
      if (.not. set%penalty%is_on) return
      set%penalty%is_stored = is_stored .and. .not. self%augments
      do k = 1, set%n
         call constraint_index(system, set%id(k), pair, i)
         if (pair == 0) cycle
         place = contact_place_t(self%area(set%id(k)), self%raised &
            *self%stiffness(set%id(k)), system%contact(pair)%contact%share(i))
         if (set%penalty%is_stored .and. .not. self%is_at_ends) place%closure = &
            self%closure(set%id(k))
         if (allocated(self%stretch)) place%stretch = self%stretch(:, set%id(k))
         call give_law(self, system%contact(pair)%contact, set%law(k)%row)
         call set%law(k)%row%begin(place)
         call set%law(k)%row%push_on(set%lam(k))
         set%item(k)%has_friction = set%item(k)%has_friction .or. set%law(k)%row%has_friction
      end do
   end subroutine penalty_select

   !> A copy of the law of a contact: of its surfaces, or of all.
   subroutine give_law(self, contact, law)
      type(penalty_state_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      class(contact_law_t), allocatable, intent(out) :: law

      if (has_own_law(self, contact)) then
         allocate(law, source=contact%laws%row)
      else
         allocate(law, source=self%law)
      end if
   end subroutine give_law

   !> A step begins: nothing was pushed back in it yet.
   pure subroutine penalty_forget(self)
      type(penalty_state_t), intent(inout) :: self

      self%n_augmentation = 0
      self%left = huge(self%left)
      self%raised = 1.0_wp
   end subroutine penalty_forget

   !> Take the multipliers as those to push with; `is_done` if that has closed what was left of the
   !> gaps.
   pure subroutine penalty_augment(self, set, is_done)
      type(penalty_state_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: set
      logical, intent(out) :: is_done            !! else the step is to be solved again
      real(wp) :: left
      integer :: k

      is_done = .true.
      if (.not. (self%augments .and. set%penalty%is_on)) return
      self%n_augmentation = self%n_augmentation + 1
      left = 0.0_wp
      do k = set%n_permanent + 1, set%n
         left = max(left, abs(set%penalty%left(k))/set%item(k)%size)
         call set%law(k)%row%push_on(set%lam(k))
      end do
      is_done = left <= self%tolerance
      if (.not. is_done .and. left > least_gain*self%left) self%raised = min(stiffer*self%raised, &
         stiffest)
      self%left = left
   end subroutine penalty_augment

   !> What the contacts of `set` store at the end of the step [M L^2/T^2].
   pure real(wp) function penalty_stored(self, set) result(energy)
      type(penalty_state_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      integer :: k

      energy = 0.0_wp
      if (self%augments .or. .not. set%penalty%is_on) return
      do k = set%n_permanent + 1, set%n
         energy = energy + set%law(k)%row%stored()
      end do
   end function penalty_stored

   !> What the contacts of `set` leave to the next step.
   pure subroutine penalty_keep(self, set, closure, stretch)
      type(penalty_state_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout) :: closure(:)      !! (n_constraint) those of others stand [L]
      real(wp), intent(inout) :: stretch(:, :)   !! (most_slips, n_constraint) the same [L]
      integer :: k

      if (self%augments .or. .not. set%penalty%is_on) return
      do k = set%n_permanent + 1, set%n
         closure(set%id(k)) = set%law(k)%row%closure()
         stretch(:, set%id(k)) = set%law(k)%row%stretch()
      end do
   end subroutine penalty_keep

   !> Has the step before left constraints `first` to `last` with something stored?
   pure function penalty_owes(self, first, last) result(owes)
      type(penalty_state_t), intent(in) :: self
      integer, intent(in) :: first, last         !! a range of the constraints
      logical :: owes(last - first + 1)

      owes = .false.
      if (self%is_on .and. .not. self%augments) owes = self%closure(first:last) < 0.0_wp
   end function penalty_owes

   !> How deep the contacts of `set` have given way: the largest, by the edge of the slave or of the
   !> master, whichever is shorter; of an augmented Lagrangian by that of its tolerance.
   pure real(wp) function penalty_depth(self, set) result(depth)
      type(penalty_state_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp) :: edge, reach
      integer :: k

      depth = 0.0_wp
      if (.not. set%penalty%is_on) return
      do k = set%n_permanent + 1, set%n
         edge = set%item(k)%size
         if (self%edge(set%id(k)) > 0.0_wp .and. .not. self%augments) edge = min(edge, &
            self%edge(set%id(k)))
         reach = 0.0_wp
         if (allocated(set%law(k)%row)) reach = set%law(k)%row%reach
         depth = max(depth, (-set%penalty%left(k) - reach)/edge)
      end do
   end function penalty_depth

end module emcon_penalty
