!> Penalties in explicit steps: contacts push where a step begins and ends, as elements do.
!>
!> Which contacts are closed, and how deep, depends on the place alone. What they push with there is
!> added to the internal forces that a step leaves to the next one. Source: docs/theory.md, section
!> 14.
module emcon_explicit_penalty
   use emcon_active_set, only : active_set_update_gaps, active_set_pass
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t
   use emcon_motion_bound, only : largest_motion
   use emcon_numbering, only : numbering_holds
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_scene, only : scene_t
   use emcon_penalty, only : penalty_select
   use emcon_term, only : role_internal
   implicit none
   private
   public :: explicit_penalty_push, explicit_penalty_limit, explicit_penalty_widen

   !> A critical step that was found with closed contacts counts until a node is stiffened by so
   !> much more: places of contact move a little with each step.
   real(wp), parameter :: room = 1.1_wp

contains

   !> Find the contacts that are closed at `self%explicit%place`, as the end of the present step or
   !> its start, and add what they push with to the response of the system there.
   subroutine explicit_penalty_push(self, is_end)
      type(march_t), intent(inout) :: self
      logical, intent(in) :: is_end              !! of the step, else its start
      real(wp) :: force(size(self%end_state%v, 1), size(self%end_state%v, 2))
      integer :: left

      if (.not. self%active%penalty%is_at_ends) return
      call phase_enter(self%system%phases, phase_gaps, left)
      associate (explicit => self%explicit, response => self%system%response)
         associate (penalty => explicit%penalty(merge(1 - explicit%i_start, explicit%i_start, &
            is_end)))
            call find_closed(self, penalty, is_end)
            if (penalty%n > 0) then
               call constraints_evaluate(penalty, self%system, explicit%place, leaves_second=.true.)
               call constraints_force(penalty, 1, force)
               response%residual = response%residual - force
               response%part(role_internal)%force = response%part(role_internal)%force - force
            end if
         end associate
      end associate
      call phase_leave(self%system%phases, left)
   end subroutine explicit_penalty_push

   !> Hand the contacts that are closed at the place to `penalty`. One that was open at the start is
   !> closed no deeper than both sides have moved: else the other side of a thin body is meant.
   subroutine find_closed(self, penalty, is_end)
      type(march_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: penalty
      logical, intent(in) :: is_end
      logical :: is_closed(self%system%n_constraint)
      integer :: pair, i, k, id
      real(wp) :: margin

      is_closed = .false.
      margin = 0.0_wp
      if (is_end) margin = 2.0_wp*largest_motion(self%end_state%du)
      associate (system => self%system, active => self%active, place => self%explicit%place)
         if (is_end) then
            call active_set_pass(active, system, self%motion)
         else
            active%skip_until%passes = .false.
         end if
         do pair = 1, size(system%contact)
            if (active%skip_until(pair)%passes) cycle
            call active_set_update_gaps(active, system, pair, place, place%du)
            associate (contact => system%contact(pair)%contact)
               do i = 1, contact%n_constraint
                  id = system%first_constraint(pair) + i
                  associate (gap => contact%state(i))
                     if (.not. (gap%is_near .and. gap%is_over)) cycle
                     is_closed(id) = gap%gap1 < gap%closed &
                        .and. (self%state%contacts%status(id) > 0 .or. gap%gap1 &
                        - gap%closed > -contact%max_penetration_at_start*gap%size - margin)
                  end associate
               end do
            end associate
         end do
         call constraints_select(penalty, pack([(k, k = 1, size(is_closed))], is_closed))
         do k = 1, penalty%n
            call constraint_index(system, penalty%id(k), pair, i)
            penalty%target(k) = system%contact(pair)%contact%state(i)%closed
         end do
         call penalty_select(active%penalty, system, penalty, is_stored=.true.)
      end associate
   end subroutine find_closed

   !> What pairs stiffen each node by when all of them are closed: the matrix of contacts is below
   !> this diagonal where the nodes of both surfaces stand as close to each other, twice where both
   !> move. Source: docs/theory.md, eq. (42).
   subroutine explicit_penalty_limit(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(facets_t) :: slave, master
      type(error_t), allocatable :: error
      real(wp) :: twice
      integer :: k

      if (allocated(self%explicit%stiffness)) deallocate(self%explicit%stiffness)
      allocate(self%explicit%stiffness(size(scene%x, 2)), source=0.0_wp)
      self%explicit%met = self%explicit%stiffness
      if (.not. self%active%penalty%is_at_ends) return
      associate (bound => self%explicit%stiffness, system => self%system, &
            numbering => self%system%space%numbering)
         do k = 1, system%n_pair             ! guards do not give way
            associate (contact => system%contact(k)%contact, stiffness => &
                  self%active%penalty%stiffness, first => system%first_constraint(k) + 1, &
                  last => system%first_constraint(k + 1), pair => scene%pair(k))
               call facets_init(slave, scene, scene%surface(pair%slave), error)
               if (.not. allocated(error)) call facets_init(master, scene, &
                  scene%surface(pair%master), error)
               if (allocated(error)) return      ! contact of them would not have been built
               twice = 1.0_wp
               if (.not. (all(numbering_holds(numbering, contact%node)) .or. &
                  all(numbering_holds(numbering, master%node)))) twice = 2.0_wp
               bound(contact%node) = bound(contact%node) + twice*stiffness(first:last)
               call add_opposite(bound, master, twice*sum(stiffness(first:last))/sum(slave%size))
            end associate
         end do
      end associate
      self%explicit%met = self%explicit%stiffness
   end subroutine explicit_penalty_limit

   !> Add what master nodes are stiffened by: a pressure by depth over their part of each facet.
   pure subroutine add_opposite(bound, master, by_size)
      real(wp), intent(inout) :: bound(:)        !! (n_node) [M/T^2]
      type(facets_t), intent(in) :: master
      real(wp), intent(in) :: by_size            !! per length or area [M/(L T^2), M/(L^2 T^2)]
      integer :: f

      do f = 1, master%n_facet
         associate (node => pack(master%facet(:, f), master%facet(:, f) > 0))
            bound(node) = bound(node) + by_size*master%size(f)/real(size(node), wp)
         end associate
      end do
   end subroutine add_opposite

   !> Do the contacts that are closed at the start of the step stiffen a node by more than any have
   !> done before? Of one it is at most its stiffness times the node's gradient times those of all
   !> that move.
   subroutine explicit_penalty_widen(self, has_grown)
      type(march_t), intent(inout) :: self
      logical, intent(out) :: has_grown          !! the critical step is to be found with them
      real(wp) :: total(size(self%end_state%v, 2)), slope(size(self%explicit%stiffness))
      integer :: k, i

      has_grown = .false.
      associate (penalty => self%explicit%penalty(self%explicit%i_start), &
            bound => self%explicit%met, numbering => self%system%space%numbering)
         if (.not. self%active%penalty%is_at_ends .or. penalty%n == 0) return
         total = 0.0_wp
         do k = 1, penalty%n
            associate (item => penalty%item(k))
               do i = 1, item%n_node
                  slope(i) = 0.0_wp
                  if (.not. numbering_holds(numbering, item%node(i))) slope(i) &
                     = sqrt(sum(item%c(:, i)**2))
               end do
               do i = 1, item%n_node
                  total(item%node(i)) = total(item%node(i)) &
                     + penalty%law(k)%row%stiffest()*slope(i)*sum(slope(:item%n_node))
               end do
            end associate
         end do
         has_grown = any(total > (1.0_wp + sqrt(epsilon(1.0_wp)))*bound)
         if (has_grown) bound = max(bound, room*total)
      end associate
   end subroutine explicit_penalty_widen

end module emcon_explicit_penalty
