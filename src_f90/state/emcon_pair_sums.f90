!> What each pair of surfaces has transmitted: over the increment and since the start of the run.
!>
!> A pair that is held in both orders, or watched by guards, is one here. Forces are those on the
!> surface that the deck names first.
module emcon_pair_sums
   use emcon_constraint, only : condition_find_force, condition_friction, condition_t
   use emcon_constraints, only : constraint_set_t, constraints_dissipated, constraints_lam
   use emcon_contact_law, only : loss_damping, loss_friction
   use emcon_evaluation, only : evaluation_contact_place, evaluation_has_inertia
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   use emcon_velocity_jumps, only : velocity_jump_t
   implicit none
   private
   public :: pair_sum_t, pair_sums_t, pair_sums_init, pair_sums_begin, pair_sums_add, &
      pair_sums_jump, pair_force, pair_center

   type :: pair_sum_t
      real(wp) :: impulse(3) = 0.0_wp            !! on the first surface, in dynamic steps [M L/T]
      real(wp) :: friction = 0.0_wp              !! work that it has taken, >= 0 [M L^2/T^2]
      real(wp) :: damping = 0.0_wp               !! the same of damping, >= 0 [M L^2/T^2]
      real(wp) :: duration = 0.0_wp              !! of force between the surfaces, in these [T]
      ! of the increment, in statics of its last part:
      real(wp) :: push(3) = 0.0_wp               !! force by time [M L/T]
      real(wp) :: span = 0.0_wp                  !! that time [T]
      real(wp) :: weight = 0.0_wp                !! sizes of nodal forces by time [M L/T]
      real(wp) :: moment(3) = 0.0_wp             !! the same by their places [M L^2/T]
      logical :: is_pressed = .false.            !! there is force
   end type pair_sum_t

   type :: pair_sums_t
      type(pair_sum_t), allocatable :: sum(:)    !! (pairs)
      !> (n_contact) the pair that each contact belongs to, negative: its slave side is the second
      integer, allocatable :: of_pair(:)
   end type pair_sums_t

   !> What forces on a slave side are to a pair.
   type :: side_t
      logical :: is_first = .true.               !! they are on the first surface
      logical :: is_dynamic = .true.             !! forces are means over the step, else its end
   end type side_t

contains

   !> Nothing has been transmitted so far. `contact` are the contacts of the system, `pair` those of
   !> the scene.
   pure subroutine pair_sums_init(self, system, pair)
      type(pair_sums_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(contact_pair_t), intent(in) :: pair(:)    !! of the scene, before guards
      integer :: own(size(pair)), first, k, n

      n = 0
      do k = 1, size(pair)
         first = findloc(pair(:k - 1)%slave == pair(k)%master .and. &
            pair(:k - 1)%master == pair(k)%slave, .true., 1)
         if (first > 0) then
            own(k) = -own(first)
         else
            n = n + 1
            own(k) = merge(-n, n, pair(k)%is_exchanged)
         end if
      end do
      allocate(self%sum(n))
      allocate(self%of_pair(size(system%contact)))
      do k = 1, size(system%contact)
         associate (of_pair => system%contact(k)%of_pair)
            self%of_pair(k) = sign(1, of_pair)*own(abs(of_pair))
         end associate
      end do
   end subroutine pair_sums_init

   !> An increment begins: what the last one was is forgotten.
   elemental subroutine pair_sums_begin(sum)
      type(pair_sum_t), intent(inout) :: sum

      sum%push = 0.0_wp
      sum%span = 0.0_wp
      sum%weight = 0.0_wp
      sum%moment = 0.0_wp
   end subroutine pair_sums_begin

   !> Add the constraints that acted over `motion`, of the size `h`, and laws.
   pure subroutine pair_sums_add(self, system, set, motion, h)
      type(pair_sums_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical :: is_dynamic
      integer :: k, contact

      if (size(self%sum) == 0) return
      is_dynamic = evaluation_has_inertia(motion%evaluation)
      if (.not. is_dynamic) call pair_sums_begin(self%sum)
      self%sum%span = self%sum%span + h
      self%sum%is_pressed = .false.
      contact = 1
      do k = set%n_permanent + 1, set%n_condition
         if (k == set%n + 1) contact = 1
         do while (set%id(k) > system%first_constraint(contact + 1))
            contact = contact + 1
         end do
         associate (item => set%item(k), sum => self%sum(abs(self%of_pair(contact))))
            call add_forces(sum, item, constraints_lam(set, k), motion, h, side_t( &
               self%of_pair(contact) > 0, is_dynamic))
            sum%damping = sum%damping + constraints_dissipated(set, k, loss_damping)
            sum%friction = sum%friction + constraints_dissipated(set, k, loss_friction)
            sum%is_pressed = sum%is_pressed .or. abs(constraints_lam(set, k)) > 0.0_wp
         end associate
      end do
      if (.not. is_dynamic) return
      where (self%sum%is_pressed) self%sum%duration = self%sum%duration + h
   end subroutine pair_sums_add

   !> Add the forces of a condition on the nodes of its slave side, by the size `h` of the step.
   pure subroutine add_forces(sum, item, lam, motion, h, side)
      type(pair_sum_t), intent(inout) :: sum
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: lam                !! of the row of its gap [M L/T^2]
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(side_t), intent(in) :: side
      real(wp), dimension(size(motion%x, 1)) :: push, place
      real(wp) :: part
      integer :: i

      part = evaluation_contact_place(motion%evaluation)
      do i = 1, item%n_slave
         associate (node => item%node(i))
            place = motion%x(:, node) + (motion%u0(:, node) + part*motion%du(:, node))
         end associate
         call condition_find_force(item, lam, condition_friction(item, lam), i, push)
         call add_push(sum, h*push, place, side)
         call condition_find_force(item, item%response%lam, item%response%tau, i, push)
         if (any(abs(push) > 0.0_wp)) call add_push(sum, h*push, place, side)
      end do
   end subroutine add_forces

   !> Add the impulse of a force at `place`.
   pure subroutine add_push(sum, push, place, side)
      type(pair_sum_t), intent(inout) :: sum
      real(wp), intent(in) :: push(:)            !! (n_dim) [M L/T]
      real(wp), intent(in) :: place(:)           !! (n_dim) [L]
      type(side_t), intent(in) :: side
      real(wp) :: signed(size(push))

      associate (n => size(push))
         signed = merge(push, -push, side%is_first)
         sum%push(:n) = sum%push(:n) + signed
         if (side%is_dynamic) sum%impulse(:n) = sum%impulse(:n) + signed
         sum%weight = sum%weight + sqrt(dot_product(push, push))
         sum%moment(:n) = sum%moment(:n) + sqrt(dot_product(push, push))*place
      end associate
   end subroutine add_push

   !> Add the impulses of jumps of the velocities at the end of a step.
   pure subroutine pair_sums_jump(self, system, jump)
      type(pair_sums_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(velocity_jump_t), intent(in) :: jump(:)   !! (any) of this step
      real(wp) :: signed(size(system%space%is_alive, 1))
      integer :: k, contact

      do k = 1, size(jump)
         contact = count(system%first_constraint < jump(k)%id)
         associate (sum_of => self%sum(abs(self%of_pair(contact))), n => size(signed))
            signed = sum(jump(k)%impulse(:, :jump(k)%n_slave), 2)
            if (self%of_pair(contact) < 0) signed = -signed
            sum_of%push(:n) = sum_of%push(:n) + signed
            sum_of%impulse(:n) = sum_of%impulse(:n) + signed
            sum_of%friction = sum_of%friction + jump(k)%rubbed
         end associate
      end do
   end subroutine pair_sums_jump

   !> The mean force over the last increment, of a static step that at its end [M L/T^2]; 0 before
   !> the first.
   pure function pair_force(sum) result(force)
      type(pair_sum_t), intent(in) :: sum
      real(wp) :: force(size(sum%push))

      force = 0.0_wp
      if (sum%span > 0.0_wp) force = sum%push/sum%span
   end function pair_force

   !> The mean of the places where forces act, by their sizes [L]; `none` where there is no force.
   pure function pair_center(sum, none) result(center)
      type(pair_sum_t), intent(in) :: sum
      real(wp), intent(in) :: none               !! where there is no place
      real(wp) :: center(size(sum%moment))

      center = none
      if (sum%weight > 0.0_wp) center = sum%moment/sum%weight
   end function pair_center

end module emcon_pair_sums
