!> What the contact pairs transmitted in the last step: per slave node, and in sum per pair.
!>
!> Forces and moments belong to the configuration that the step's gradients are those of; areas and
!> lengths to the multipliers of the step. Signs: docs/theory.md, eq. (1).
module emcon_pair_record
   use emcon_constraint, only : condition_force
   use emcon_constraints, only : constraint_set_t, constraints_lam
   use emcon_kinds, only : wp
   use emcon_rotation, only : add_moments, n_turn
   use emcon_system, only : system_t
   use emcon_velocity_jumps, only : velocity_jump_t
   implicit none
   private
   public :: pair_total_t, pair_record_t, pair_record_init, pair_record_measure, pair_record_jump, &
      pair_components

   !> Directions and rotations in space.
   integer, parameter :: most_components = 6

   !> Sums over one pair. The forces on its sides, and their moments, are opposite to round-off.
   type :: pair_total_t
      !> Force [M L/T^2] and moment about the origin: the first 3 in the plane, in space all
      real(wp) :: slave(most_components) = 0.0_wp
      real(wp) :: master(most_components) = 0.0_wp   !! the same on the master side
      !> Of the slave surface in contact: length [L], in space area [L^2]
      real(wp) :: covered = 0.0_wp
      integer :: n_active = 0                    !! constraints that act
   end type pair_total_t

   type :: pair_record_t
      type(pair_total_t), allocatable :: total(:)   !! (n_pair)
      !> (n_dim, n_constraint) by its pair on the slave node, and on the other one at its place
      real(wp), allocatable :: force(:, :)
      !> (n_constraint) of each multiplier [L^2]; 0: nothing acts in its pair
      real(wp), allocatable :: area(:)
      !> (n_constraint) the same of friction, where it acts [L^2]
      real(wp), allocatable :: shear_area(:)
      ! Of jumps of the velocities, not allocated where there were none: their impulses by the step,
      real(wp), allocatable :: jump(:, :)        !! (n_dim, n_node) on all nodes [M L/T^2]
      real(wp), allocatable :: jump_lam(:)       !! (n_constraint) as multipliers [M L/T^2]
      real(wp), allocatable :: jump_drag(:, :)   !! (n_dim - 1, n_constraint) the same of friction
   end type pair_record_t

   !> Places in a list; none if the last is before the first.
   type :: range_t
      integer :: first = 1, last = 0
   end type range_t

contains

   !> Components of force and moment: 3 in the plane, 6 in space.
   pure integer function pair_components(self) result(n)
      type(pair_record_t), intent(in) :: self

      n = size(self%force, 1) + n_turn(size(self%force, 1))
   end function pair_components

   !> A record for the pairs of `system` in which nothing has acted.
   pure subroutine pair_record_init(self, system)
      type(pair_record_t), intent(out) :: self
      type(system_t), intent(in) :: system

      allocate(self%total(system%n_pair))
      allocate(self%force(size(system%space%is_alive, 1), system%n_constraint), source=0.0_wp)
      allocate(self%area(system%n_constraint), self%shear_area(system%n_constraint), source=0.0_wp)
   end subroutine pair_record_init

   !> Take over the constraints that acted in the step to `u`, and laws. Their forces act at
   !> u - lag du: half a step back for discrete gradients, at the end (0) in statics.
   subroutine pair_record_measure(self, system, set, x, u, du, lag)
      type(pair_record_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: x(:, :), u(:, :), du(:, :)   !! (n_dim, n_node)
      real(wp), intent(in) :: lag                !! 0 or 1/2
      type(range_t) :: own, by_law
      integer :: k

      self%total = pair_total_t()
      own%last = set%n_permanent
      by_law%last = set%n
      do k = 1, size(system%contact)
         own = range_t(own%last + 1, count(set%id(:set%n) <= system%first_constraint(k + 1)))
         by_law = range_t(by_law%last + 1, set%n + count(set%id(set%n + 1:) &
            <= system%first_constraint(k + 1)))
         associate (total => self%total(abs(system%contact(k)%of_pair)), &
               before => system%first_constraint(k), n => system%first_constraint(k + 1))
            total%n_active = total%n_active + max(0, own%last - own%first + 1)
            if (system%contact(k)%of_pair < 0) call exchange_sides(total)
            call add_up(total, set, own, x, u, du, lag)
            call add_up(total, set, by_law, x, u, du, lag)
            if (system%contact(k)%of_pair < 0) call exchange_sides(total)
            if (own%last >= own%first .or. by_law%last >= by_law%first) then
               call measure_nodes(self, system, k, set, own, by_law)
            else
               self%force(:, before + 1:n) = 0.0_wp
            end if
            associate (acting => set%id(own%first:own%last))
               if (size(acting) > 0) then
                  call measure_areas(self, system, k, acting, x, u)
               else
                  self%area(before + 1:n) = 0.0_wp
               end if
               self%shear_area(before + 1:n) = self%area(before + 1:n)
               self%shear_area(acting) = set%item(own%first:own%last)%normal*self%area(acting)
            end associate
         end associate
      end do
   end subroutine pair_record_measure

   !> Add the impulses of jumps of the velocities at the end of the step, as means over it.
   pure subroutine pair_record_jump(self, system, jump, place, h)
      type(pair_record_t), intent(inout) :: self !! of this step
      type(system_t), intent(in) :: system
      type(velocity_jump_t), intent(in) :: jump(:)   !! (any) of this step
      real(wp), intent(in) :: place(:, :)        !! (n_dim, n_node) of nodes at the end [L]
      real(wp), intent(in) :: h                  !! > 0 [T]
      integer :: k, i, contact, own

      if (allocated(self%jump)) deallocate(self%jump, self%jump_lam, &
         self%jump_drag)
      if (size(jump) == 0) return
      allocate(self%jump, source=0.0_wp*place)
      allocate(self%jump_lam(size(self%area)), self%jump_drag(size(place, 1) - 1, &
         size(self%area)), source=0.0_wp)
      do k = 1, size(jump)
         associate (node => jump(k)%node, id => jump(k)%id)
            self%jump_lam(id) = self%jump_lam(id) + jump(k)%lam/h
            self%jump_drag(:, id) = self%jump_drag(:, id) + jump(k)%drag(:size(place, 1) - 1)/h
            contact = count(system%first_constraint < id)
            call add_total(self%total(abs(system%contact(contact)%of_pair)), jump(k), place, h, &
               system%contact(contact)%of_pair < 0)
            do i = 1, size(node)
               self%jump(:, node(i)) = self%jump(:, node(i)) + jump(k)%impulse(:, i)/h
               if (i > jump(k)%n_slave) cycle
               associate (of => system%contact(contact)%contact)
                  own = findloc(of%node, node(i), 1)
                  if (own == 0) own = findloc(of%duplicate, node(i), 1)
               end associate
               if (own == 0) cycle
               own = own + system%first_constraint(contact)
               self%force(:, own) = self%force(:, own) + jump(k)%impulse(:, i)/h
            end do
         end associate
      end do
   end subroutine pair_record_jump

   !> Add forces and moments of a jump on both sides of its pair.
   pure subroutine add_total(total, jump, place, h, is_exchanged)
      type(pair_total_t), intent(inout) :: total
      type(velocity_jump_t), intent(in) :: jump
      real(wp), intent(in) :: place(:, :)        !! (n_dim, n_node) [L]
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical, intent(in) :: is_exchanged        !! its slave side is the pair's master side
      real(wp) :: force(size(place, 1))
      integer :: i, n, m

      n = size(place, 1)
      m = n + n_turn(n)
      if (is_exchanged) call exchange_sides(total)
      total%slave(n + 1:m) = total%slave(n + 1:m) + jump%slave_moment/h
      total%master(n + 1:m) = total%master(n + 1:m) + jump%master_moment/h
      do i = 1, size(jump%node)
         force = jump%impulse(:, i)/h
         call add_force(total, i <= jump%n_slave, place(:, jump%node(i)), force)
      end do
      if (is_exchanged) call exchange_sides(total)
   end subroutine add_total

   !> Add a force and its moment on one side.
   pure subroutine add_force(total, is_slave, place, force)
      type(pair_total_t), intent(inout) :: total
      logical, intent(in) :: is_slave            !! else on the master side
      real(wp), intent(in) :: place(:)           !! (n_dim) where it acts [L]
      real(wp), intent(in) :: force(:)           !! (n_dim) [M L/T^2]
      real(wp) :: part(most_components)
      integer :: n, m

      n = size(place)
      m = n + n_turn(n)
      part = merge(total%slave, total%master, is_slave)
      part(:n) = part(:n) + force
      call add_moments(place, force, part(n + 1:m))
      if (is_slave) total%slave = part
      if (.not. is_slave) total%master = part
   end subroutine add_force

   pure subroutine exchange_sides(total)
      type(pair_total_t), intent(inout) :: total
      real(wp) :: slave(most_components)

      slave = total%slave
      total%slave = total%master
      total%master = slave
   end subroutine exchange_sides

   !> Add forces and moments of a range of conditions on both sides of a pair.
   pure subroutine add_up(total, set, range, x, u, du, lag)
      type(pair_total_t), intent(inout) :: total
      type(constraint_set_t), intent(in) :: set
      type(range_t), intent(in) :: range
      real(wp), intent(in), contiguous :: x(:, :), u(:, :), du(:, :)
      real(wp), intent(in) :: lag
      real(wp) :: place(size(x, 1)), force(size(x, 1))
      integer :: k, i

      do k = range%first, range%last
         do i = 1, set%item(k)%n_node
            associate (node => set%item(k)%node(i))
               place = x(:, node) + (u(:, node) - lag*du(:, node))
            end associate
            force = condition_force(set%item(k), constraints_lam(set, k), i)
            call add_force(total, i <= set%item(k)%n_slave, place, force)
         end do
      end do
   end subroutine add_up

   !> Forces of contact `k` on its slave nodes.
   subroutine measure_nodes(self, system, k, set, own, by_law)
      type(pair_record_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: k
      type(constraint_set_t), intent(in) :: set
      type(range_t), intent(in) :: own           !! of it, in the set
      type(range_t), intent(in) :: by_law        !! and of laws alone
      real(wp) :: force(size(self%force, 1), size(system%space%body))
      integer, allocatable :: acting(:)
      integer :: j, i, first

      first = system%first_constraint(k)
      allocate(acting, source=[(j, j = own%first, own%last), &
         (j, j = by_law%first, by_law%last)])
      associate (node => system%contact(k)%contact%node, &
            duplicate => system%contact(k)%contact%duplicate)
         do i = 1, size(node)
            force(:, node(i)) = 0.0_wp
            if (duplicate(i) > 0) force(:, duplicate(i)) = 0.0_wp
         end do
         do j = 1, size(acting)                           ! nodes between vertices, too
            associate (item => set%item(acting(j)))
               force(:, item%node(:item%n_slave)) = 0.0_wp
            end associate
         end do
         do j = 1, size(acting)
            call add_forces(acting(j))
         end do
         do i = 1, size(node)
            self%force(:, first + i) = force(:, node(i))
            force(:, node(i)) = 0.0_wp                    ! of several constraints the first has it
            if (duplicate(i) == 0) cycle
            self%force(:, first + i) = self%force(:, first + i) + force(:, duplicate(i))
            force(:, duplicate(i)) = 0.0_wp
         end do
      end associate

   contains

      !> Those of one condition.
      subroutine add_forces(place)
         integer, intent(in) :: place            !! in the set
         integer :: m

         associate (item => set%item(place), lam => constraints_lam(set, place))
            do m = 1, item%n_slave
               force(:, item%node(m)) = force(:, item%node(m)) + condition_force(item, lam, m)
            end do
         end associate
      end subroutine add_forces

   end subroutine measure_nodes

   !> Areas of all multipliers of contact `k`, and of what slave surface it acts.
   subroutine measure_areas(self, system, k, id, x, u)
      type(pair_record_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: k
      integer, intent(in) :: id(:)               !! its constraints that act
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: length(system%contact(k)%contact%n_constraint)

      associate (contact => system%contact(k)%contact, before => system%first_constraint(k))
         call contact%area(x, u, self%area(before + 1:before + contact%n_constraint), length)
         associate (covered => self%total(abs(system%contact(k)%of_pair))%covered)
            if (size(x, 1) == 3) then
               covered = covered + sum(self%area(id))
            else
               covered = covered + sum(length(id - before))
            end if
         end associate
      end associate
   end subroutine measure_areas

end module emcon_pair_record
