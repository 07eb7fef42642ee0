!> Velocity jump at the end of a step that gives back the energy lost in closing contacts.
!>
!> Along p = M^-1 sum w_k grad gap_k, w_k = lam_k gap_k(q0) >= 0, the kinetic energy changes by
!> s b + s^2 a/2; the positive root of s b + s^2 a/2 = lost energy is taken. The jump pushes the
!> bodies apart and keeps the momenta. Source: Laursen & Love (2002); docs/theory.md,
!> eqs. (21) and (22).
module emcon_velocity_update
   use emcon_constraint, only : condition_add_field, condition_rate, condition_t
   use emcon_constraints, only : constraint_set_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_root, only : smaller_root
   use emcon_system, only : mass_times, system_t
   use emcon_velocity_mass, only : velocity_mass_keep, velocity_mass_move, velocity_mass_pick, &
      velocity_mass_prepare, velocity_update_t
   implicit none
   private
   public :: push_t, velocity_update_apply, velocity_update_push, push_weights, &
      velocity_update_hold, velocity_update_accelerate

   !> Contacts that stay closed keep gaps of this size relative to an edge: round-off, no loss.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)

   !> A push that is to give energy.
   type :: push_t
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) along it [M L/T^2]
      real(wp) :: gain = 0.0_wp                  !! [M L^2/T^2]
   end type push_t

   !> The kinetic energy that s times a jump gives: s b + s^2 a/2.
   type :: gain_t
      real(wp) :: a = 0.0_wp, b = 0.0_wp         !! [M L^2/T^2]
   end type gain_t

contains

   !> Add the jump to `v`. `restored` is the energy given back, 0 if there was none to give or no
   !> root (`has_root`).
   subroutine velocity_update_apply(self, system, set, v, restored, has_root, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      real(wp), intent(out) :: restored          !! >= 0 [M L^2/T^2]
      logical, intent(out) :: has_root           !! .false.: `v` is left as it is
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: force(size(v, 1), size(v, 2)), lost, noise
      type(gain_t) :: gain
      integer :: k

      restored = 0.0_wp
      has_root = .true.
      lost = 0.0_wp
      noise = 0.0_wp
      do k = set%n_permanent + 1, set%n
         lost = lost - set%lam(k)*set%item(k)%dgap
         noise = noise + gap_noise*abs(set%lam(k))*set%item(k)%size
      end do
      if (lost <= noise) return
      call push_forces(set, push_weights(set), force)
      call push_along(self, system, set, force, v, gain, error)
      if (allocated(error)) return
      has_root = gain%a > 0.0_wp
      if (.not. has_root) return
      call velocity_mass_move(self, system, jump_size(gain%a, gain%b, lost), v)
      restored = lost
   end subroutine velocity_update_apply

   !> Add to `v` the jump along M^-1 of a force that gives an energy to it, the smaller one of the
   !> two: docs/theory.md, eq. (22).
   subroutine velocity_update_push(self, system, set, push, v, has_root, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(push_t), intent(in) :: push
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      logical, intent(inout) :: has_root         !! .false.: `v` is left as it is, as by an error
      type(error_t), allocatable, intent(out) :: error
      type(gain_t) :: gain
      real(wp) :: part

      call push_along(self, system, set, push%force, v, gain, error)
      if (allocated(error)) return
      call smaller_root(gain%a, gain%b, push%gain, part, has_root)
      if (has_root) call velocity_mass_move(self, system, part, v)
   end subroutine velocity_update_push

   !> Take out of `v` the rates of conditions that always hold and are not linear, as rigid bodies
   !> have none. `lost` is the energy that goes, `gained` that which comes into all that moves.
   subroutine velocity_update_hold(self, system, set, v, lost, gained, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      real(wp), intent(out) :: lost              !! >= 0 [M L^2/T^2]
      real(wp), intent(out) :: gained            !! -lost but for work of what is driven [M L^2/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: jump(:, :)
      real(wp) :: moved(size(v, 1), size(v, 2)), momentum(size(v, 1), size(v, 2))
      logical :: is_singular
      integer :: k

      lost = 0.0_wp
      gained = 0.0_wp
      if (set%n_permanent == set%n_linear) return
      call velocity_mass_prepare(self, system, is_singular, error)
      if (allocated(error) .or. is_singular) return
      allocate(jump(size(self%jump), 1), source=0.0_wp)
      call velocity_mass_keep(self, system, set, error, jump, is_singular, &
         [(-condition_rate(set%item(k), v), k = set%n_linear + 1, set%n_permanent)])
      if (allocated(error) .or. is_singular) return
      self%jump = jump(:, 1)
      call mass_times(system, v, momentum)
      call velocity_mass_pick(system, momentum, self%push)
      gained = dot_product(self%push, self%jump)
      moved = 0.0_wp
      call velocity_mass_move(self, system, 1.0_wp, moved)
      call mass_times(system, moved, momentum)
      call velocity_mass_pick(system, momentum, self%push)
      lost = 0.5_wp*dot_product(self%push, self%jump)
      gained = gained + lost
      v = v + moved
   end subroutine velocity_update_hold

   !> The acceleration M^-1 `force` of what moves with `v`, such that conditions that always hold go
   !> on to hold.
   subroutine velocity_update_accelerate(self, system, held, force, v, acceleration, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: held         !! at the place of the velocities
      real(wp), intent(in), contiguous :: force(:, :)    !! (n_dim, n_node) [M L/T^2]
      real(wp), intent(in), contiguous :: v(:, :)        !! (n_dim, n_node) [L/T]
      real(wp), intent(out), contiguous :: acceleration(:, :)   !! (n_dim, n_node) [L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: jump(:, :)
      logical :: is_singular
      integer :: k

      acceleration = 0.0_wp
      call velocity_mass_prepare(self, system, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call velocity_mass_pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (allocated(error)) return
      jump = reshape(self%jump, [size(self%jump), 1])
      call velocity_mass_keep(self, system, held, error, jump, is_singular, &
         [(-bend(held%item(k), v), k = held%n_linear + 1, held%n_permanent)])
      if (allocated(error)) return
      self%jump = jump(:, 1)
      call velocity_mass_move(self, system, 1.0_wp, acceleration)
   end subroutine velocity_update_accelerate

   !> The second derivative of a condition along `v`.
   pure real(wp) function bend(item, v)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: v(:, :)                    !! (n_dim, n_node) [L/T]
      real(wp) :: own(size(v, 1)*item%n_node)

      own = reshape(v(:, item%node(:item%n_node)), shape(own))
      bend = dot_product(own, matmul(item%h(:size(own), :size(own)), own))
   end function bend

   !> Find the jump M^-1 `force` that the shapes of rigid bodies leave; along it the kinetic energy
   !> changes by s b + s^2 a/2; a = 0: there is none.
   subroutine push_along(self, system, set, force, v, gain, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: force(:, :), v(:, :)
      type(gain_t), intent(out) :: gain
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: momentum(size(v, 1), size(v, 2))
      real(wp), allocatable :: jump(:, :)
      logical :: is_singular

      self%part = 0.0_wp
      call velocity_mass_prepare(self, system, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call velocity_mass_pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (allocated(error)) return
      jump = reshape(self%jump, [size(self%jump), 1])
      call velocity_mass_keep(self, system, set, error, jump, is_singular)
      if (allocated(error)) return
      self%jump = jump(:, 1)
      gain%a = dot_product(self%push, self%jump)
      call mass_times(system, v, momentum)
      call velocity_mass_pick(system, momentum, self%push)
      gain%b = dot_product(self%push, self%jump)
   end subroutine push_along

   !> The root s > 0 of s b + s^2 a/2 = lost.
   pure real(wp) function jump_size(a, b, lost) result(root)
      real(wp), intent(in) :: a                  !! > 0
      real(wp), intent(in) :: b
      real(wp), intent(in) :: lost               !! > 0

      root = sqrt(b*b + 2.0_wp*a*lost)
      if (b > 0.0_wp) then
         root = 2.0_wp*lost/(b + root)
      else
         root = (root - b)/a
      end if
   end function jump_size

   !> The weights w_k of the constraints of the set [M L^2/T^2].
   pure function push_weights(set) result(weight)
      type(constraint_set_t), intent(in) :: set
      real(wp) :: weight(set%n)

      weight = max(0.0_wp, set%lam(:set%n))*max(0.0_wp, set%item(:set%n)%gap0)
   end function push_weights

   !> Sum of w_k grad gap_k at the end of the step.
   pure subroutine push_forces(set, weight, force)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: weight(:)          !! (n)
      real(wp), intent(out) :: force(:, :)
      integer :: k

      force = 0.0_wp
      do k = set%n_permanent + 1, set%n
         call condition_add_field(set%item(k), weight(k), set%item(k)%c, force)
      end do
   end subroutine push_forces

end module emcon_velocity_update
