!> Impulses of contacts by which velocities jump at the end of a step.
!>
!> They act in no time: what tells contact forces has them as means over the step.
module emcon_velocity_jumps
   use emcon_constraint, only : condition_row_gradient, condition_t, most_slips
   use emcon_constraints, only : constraint_set_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : add_moments, n_turn
   implicit none
   private
   public :: velocity_jump_t, jumps_begin, jumps_add, jumps_rub, jumps_join, &
      jumps_scale, jumps_sum

   !> The impulse of one contact constraint.
   type :: velocity_jump_t
      integer :: id = 0                          !! number of the constraint over all
      integer :: n_slave = 0                     !! nodes 1..n_slave are on the slave side
      integer, allocatable :: node(:)            !! (nodes) of the scene
      real(wp), allocatable :: impulse(:, :)     !! (n_dim, nodes) [M L/T]
      real(wp) :: lam = 0.0_wp                   !! along the gradient of the gap [M L/T]
      !> Moments on either side beside those of the impulses where the nodes end up, as forces that
      !> stay go with nodes that move [M L^2/T]
      real(wp), allocatable :: slave_moment(:), master_moment(:)   !! (1 or 3)
      real(wp) :: drag(most_slips) = 0.0_wp      !! of friction, against slips [M L/T]
      real(wp) :: rubbed = 0.0_wp                !! what friction takes more by it [M L^2/T^2]
      logical :: is_condensed = .false.          !! through what has no mass, which balances it
   end type velocity_jump_t

contains

   !> There are none so far.
   pure subroutine jumps_begin(jump)
      type(velocity_jump_t), allocatable, intent(inout) :: jump(:)   !! (any)

      if (allocated(jump)) then
         if (size(jump) == 0) return
         deallocate(jump)
      end if
      allocate(jump(0))
   end subroutine jumps_begin

   !> Append impulses `lam` along the gradients at the end of the step. With `way` also what the
   !> multipliers of the set push where their directions turn by that motion.
   pure subroutine jumps_add(jump, set, lam, displacement)
      type(velocity_jump_t), allocatable, intent(inout) :: jump(:)   !! begun
      !> evaluated; with `displacement` second derivatives too
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: lam(:)             !! (n of the set) [M L/T]
      real(wp), intent(in), optional :: displacement(:, :) !! (n_dim, n_node) [L]
      type(velocity_jump_t) :: more(set%n - set%n_permanent)
      integer :: k

      do k = 1, size(more)
         associate (j => set%n_permanent + k)
            more(k) = jump_of(set%item(j), set%id(j), lam(j))
            if (present(displacement)) call turn(set%item(j), set%lam(j), displacement, more(k))
         end associate
      end do
      call jumps_join(jump, more)
   end subroutine jumps_add

   !> Add to the impulses that were appended last for `set` those of friction, against slips at the
   !> end of the step.
   pure subroutine jumps_rub(jump, set, drag, rubbed)
      type(velocity_jump_t), intent(inout) :: jump(:)    !! of `jumps_add`
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: drag(:, :)         !! (slips, n of the set) [M L/T]
      real(wp), intent(in) :: rubbed(:)          !! (n of the set) what that takes [M L^2/T^2]
      integer :: k, s

      do k = set%n_permanent + 1, set%n
         if (.not. set%item(k)%has_friction) cycle
         associate (own => jump(size(jump) + k - set%n))
            own%rubbed = rubbed(k)
            own%drag(:size(drag, 1)) = drag(:, k)
            do s = 1, size(drag, 1)
               own%impulse = own%impulse + drag(s, k)*condition_row_gradient(set%item(k), s)
            end do
         end associate
      end do
   end subroutine jumps_rub

   !> Append others.
   pure subroutine jumps_join(jump, more)
      type(velocity_jump_t), allocatable, intent(inout) :: jump(:)   !! begun
      type(velocity_jump_t), intent(in) :: more(:)   !! (any)
      type(velocity_jump_t), allocatable :: longer(:)
      integer :: n

      n = size(jump)
      allocate(longer(n + size(more)))
      longer(:n) = jump
      longer(n + 1:) = more
      call move_alloc(longer, jump)
   end subroutine jumps_join

   pure type(velocity_jump_t) function jump_of(item, id, lam) result(jump)
      type(condition_t), intent(in) :: item
      integer, intent(in) :: id                  !! number over all constraints
      real(wp), intent(in) :: lam                !! [M L/T]

      associate (none => spread(0.0_wp, 1, n_turn(size(item%c, 1))))
         jump = velocity_jump_t(id, item%n_slave, item%node(:item%n_node), &
            lam*item%c(:, :item%n_node), lam, none, none)
      end associate
   end function jump_of

   !> Add what `lam` pushes where the nodes of a condition move by `way` and its directions turn.
   pure subroutine turn(item, lam, displacement, jump)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: lam                !! [M L/T^2]
      real(wp), intent(in) :: displacement(:, :) !! (n_dim, n_node) [L]
      type(velocity_jump_t), intent(inout) :: jump
      integer :: i, j, n_dim

      n_dim = size(displacement, 1)
      do j = 1, item%n_node
         do i = 1, item%n_node
            jump%impulse(:, i) = jump%impulse(:, i) + lam*matmul(item%h(n_dim*(i - 1) + 1:n_dim*i, &
               n_dim*(j - 1) + 1:n_dim*j), displacement(:, item%node(j)))
         end do
         if (j <= item%n_slave) then
            call add_moments(displacement(:, item%node(j)), lam*item%c(:, j), jump%slave_moment)
         else
            call add_moments(displacement(:, item%node(j)), lam*item%c(:, j), jump%master_moment)
         end if
      end do
   end subroutine turn

   !> What all together give each node.
   pure subroutine jumps_sum(jump, impulse)
      type(velocity_jump_t), intent(in) :: jump(:)       !! (any)
      real(wp), intent(out) :: impulse(:, :)     !! (n_dim, n_node) [M L/T]
      integer :: i, k

      impulse = 0.0_wp
      do k = 1, size(jump)
         do i = 1, size(jump(k)%node)
            associate (own => impulse(:, jump(k)%node(i)))
               own = own + jump(k)%impulse(:, i)
            end associate
         end do
      end do
   end subroutine jumps_sum

   !> Take a part of all.
   elemental subroutine jumps_scale(jump, part)
      type(velocity_jump_t), intent(inout) :: jump
      real(wp), intent(in) :: part               !! of it that is taken

      jump%impulse = part*jump%impulse
      jump%lam = part*jump%lam
      jump%drag = part*jump%drag
      jump%rubbed = part*jump%rubbed
      jump%slave_moment = part*jump%slave_moment
      jump%master_moment = part*jump%master_moment
   end subroutine jumps_scale

end module emcon_velocity_jumps
