!> Penalties in explicit steps: contacts push where a step begins and ends, as elements do.
!>
!> Which contacts are closed, and how deep, depends on the place alone. What they push with there is
!> added to the internal forces that a step leaves to the next one. Source: docs/theory.md, section
!> 14.
module emcon_explicit_soft
   use emcon_active_set, only : active_set_look, active_set_pass
   use emcon_constraints, only : constraint_place, constraint_set_t, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_scene, only : scene_t
   use emcon_softness, only : softness_select
   use emcon_surface_edges, only : surface_edges
   use emcon_term, only : role_internal
   implicit none
   private
   public :: explicit_soft_push, explicit_soft_force, explicit_soft_limit

contains

   !> Find the contacts that are closed at `self%explicit%place`, as the end of the present step or
   !> its start, and add what they push with to the response of the system there.
   subroutine explicit_soft_push(self, is_end)
      type(march_t), intent(inout) :: self
      logical, intent(in) :: is_end              !! of the step, else its start
      real(wp) :: force(size(self%v1, 1), size(self%v1, 2))
      integer :: left

      if (.not. self%active%softness%is_at_ends) return
      call phase_enter(self%system%phases, phase_gaps, left)
      associate (explicit => self%explicit, response => self%system%response)
         associate (soft => explicit%soft(merge(3 - explicit%i_start, explicit%i_start, is_end)))
            call find_closed(self, soft, is_end)
            if (soft%n > 0) then
               call constraints_evaluate(soft, self%system, explicit%place, leaves_second=.true.)
               call explicit_soft_force(soft, force)
               response%residual = response%residual - force
               response%part(role_internal)%force = response%part(role_internal)%force - force
            end if
         end associate
      end associate
      call phase_leave(self%system%phases, left)
   end subroutine explicit_soft_push

   !> Hand the contacts that are closed at the place to `soft`. One that was open at the start may
   !> be closed so deep only that it has not passed a thin body.
   subroutine find_closed(self, soft, is_end)
      type(march_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: soft
      logical, intent(in) :: is_end
      logical :: is_closed(self%system%n_constraint)
      integer :: pair, i, k, id

      is_closed = .false.
      associate (system => self%system, active => self%active, place => self%explicit%place)
         if (is_end) then
            call active_set_pass(active, system, self%motion)
         else
            active%outlook%passes = .false.
         end if
         do pair = 1, size(system%contact)
            if (active%outlook(pair)%passes) cycle
            call active_set_look(active, system, pair, place, place%du)
            associate (contact => system%contact(pair)%contact)
               do i = 1, contact%n_constraint
                  id = system%first_constraint(pair) + i
                  associate (gap => contact%state(i))
                     if (.not. (gap%is_near .and. gap%is_over)) cycle
                     is_closed(id) = gap%gap1 < gap%closed .and. (self%state%is_active(id) &
                        .or. gap%gap1 - gap%closed > -contact%deepest_start*gap%size)
                  end associate
               end do
            end associate
         end do
         call constraints_select(soft, pack([(k, k = 1, size(is_closed))], is_closed))
         do k = 1, soft%n
            call constraint_place(system, soft%id(k), pair, i)
            soft%target(k) = system%contact(pair)%contact%state(i)%closed
         end do
         call softness_select(active%softness, system, soft, is_stored=.true.)
      end associate
   end subroutine find_closed

   !> What the contacts of a set push with.
   pure subroutine explicit_soft_force(soft, force)
      type(constraint_set_t), intent(in) :: soft
      real(wp), intent(out), contiguous :: force(:, :)   !! (n_dim, n_node) [M L/T^2]

      call constraints_force(soft, 1, force)
   end subroutine explicit_soft_force

   !> What contacts stiffen each node by when all of them are closed, at most: their matrix is below
   !> this diagonal in all directions, twice where both sides move. Source: docs/theory.md, eq. (42).
   subroutine explicit_soft_limit(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable :: slave(:, :), master(:, :)
      real(wp) :: twice
      integer :: k

      if (allocated(self%explicit%stiffness)) deallocate(self%explicit%stiffness)
      allocate(self%explicit%stiffness(size(scene%x, 2)), source=0.0_wp)
      if (.not. self%active%softness%is_at_ends) return
      associate (bound => self%explicit%stiffness, system => self%system)
         do k = 1, size(system%contact)
            associate (contact => system%contact(k)%contact, own => self%active%softness%stiffness( &
                  system%first_constraint(k) + 1:system%first_constraint(k + 1)), &
                  pair => scene%pair(abs(system%contact(k)%of_pair)))
               call surface_edges(scene, scene%surface(pair%slave), slave)
               call surface_edges(scene, scene%surface(pair%master), master)
               if (system%contact(k)%of_pair < 0) call exchange(slave, master)
               twice = 1.0_wp
               if (moves(self, contact%node) .and. moves(self, [master])) twice = 2.0_wp
               bound(contact%node) = bound(contact%node) + twice*own
               call add_opposite(bound, scene%x, master, twice*sum(own)/length_of(scene%x, slave), &
                  twice*maxval(own))
            end associate
         end do
      end associate
   end subroutine explicit_soft_limit

   pure subroutine exchange(one, other)
      integer, allocatable, intent(inout) :: one(:, :), other(:, :)
      integer, allocatable :: held(:, :)

      call move_alloc(one, held)
      call move_alloc(other, one)
      call move_alloc(held, other)
   end subroutine exchange

   !> Are some of the nodes free to move?
   pure logical function moves(self, node)
      type(march_t), intent(in) :: self
      integer, intent(in) :: node(:)
      integer :: k, d, t

      moves = .true.
      associate (numbering => self%system%space%numbering)
         do k = 1, size(node)
            do d = size(numbering%unknown, 1)*(node(k) - 1) + 1, size(numbering%unknown, 1)*node(k)
               do t = numbering%start(d) + 1, numbering%start(d + 1)
                  if (numbering%column(t) > 0) return
               end do
            end do
         end do
      end associate
      moves = .false.
   end function moves

   !> Add what master nodes are stiffened by: a pressure by depth over half of their edges, and one
   !> slave node more, as slave nodes need not stand evenly over these.
   pure subroutine add_opposite(bound, x, edge, by_length, one)
      real(wp), intent(inout) :: bound(:)        !! (n_node) [M/T^2]
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      real(wp), intent(in) :: by_length          !! [M/(L T^2)]
      real(wp), intent(in) :: one                !! [M/T^2]
      logical :: is_met(size(bound))
      integer :: e

      is_met = .false.
      do e = 1, size(edge, 2)
         is_met(edge(:, e)) = .true.
         bound(edge(:, e)) = bound(edge(:, e)) + 0.5_wp*by_length*length_of(x, edge(:, e:e))
      end do
      where (is_met) bound = bound + one
   end subroutine add_opposite

   pure real(wp) function length_of(x, edge) result(length)
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      integer :: e

      length = 0.0_wp
      do e = 1, size(edge, 2)
         associate (side => x(:, edge(2, e)) - x(:, edge(1, e)))
            length = length + sqrt(dot_product(side, side))      ! norm2 knows the units
         end associate
      end do
   end function length_of

end module emcon_explicit_soft
