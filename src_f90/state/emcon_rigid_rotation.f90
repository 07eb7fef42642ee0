!> How far rigid bodies of the plane have turned, and the moments that their supports exert.
!>
!> Where the rotation of a body is prescribed, forces on its arms turn it: their moment about the
!> reference node is what the support has to give. Source: docs/theory.md, section 12.
module emcon_rigid_rotation
   use emcon_kinds, only : wp
   use emcon_vectors_plane, only : cross
   use emcon_motion, only : motion_t
   use emcon_rigid_bodies, only : rigid_body_t
   use emcon_rotation, only : n_turn
   use emcon_turn_plane, only : turned_by
   implicit none
   private
   public :: rigid_rotation_t, rigid_rotation_init, rigid_rotation_measure, rigid_rotation_spin

   type :: rigid_rotation_t
      !> (n_rigid, 0 in space) from the reference positions on
      real(wp), allocatable :: angle(:)
      !> (likewise) of the last step, about the reference node, on the body [M L^2/T^2]
      real(wp), allocatable :: moment(:)
   end type rigid_rotation_t

contains

   !> Bodies are where `u` says.
   pure subroutine rigid_rotation_init(self, rigid, x, u)
      type(rigid_rotation_t), intent(out) :: self
      type(rigid_body_t), intent(in) :: rigid(:)             !! with their frames
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      integer :: b

      b = merge(size(rigid), 0, n_turn(size(x, 1)) == 1)
      allocate(self%angle(b), self%moment(b), source=0.0_wp)
      do b = 1, size(self%angle)
         self%angle(b) = turned_by(arm_of(rigid(b), 2, x), arm_of(rigid(b), 2, x + u))
      end do
   end subroutine rigid_rotation_init

   !> Take over a step; no body turns by more than a half turn in it.
   pure subroutine rigid_rotation_measure(self, rigid, motion, reaction)
      type(rigid_rotation_t), intent(inout) :: self
      type(rigid_body_t), intent(in) :: rigid(:)         !! with their frames
      type(motion_t), intent(in) :: motion               !! of the step
      real(wp), intent(in) :: reaction(:, :)             !! (n_dim, n_node) [M L/T^2]
      real(wp) :: first(size(reaction, 1)), displacement(size(reaction, 1))
      integer :: b, k, node

      do b = 1, size(self%angle)
         self%moment(b) = 0.0_wp
         do k = size(rigid(b)%frame), 2, -1
            first = arm_of(rigid(b), k, motion%x) + arm_of(rigid(b), k, motion%u0)
            displacement = arm_of(rigid(b), k, motion%du)
            node = rigid(b)%frame(k)
            self%moment(b) = self%moment(b) + cross(first &
               + motion%evaluation%load_place*displacement, &
               reaction(:, node))
            if (.not. allocated(rigid(b)%arm)) cycle
            node = rigid(b)%arm(k - 1)
            self%moment(b) = self%moment(b) + cross(first &
               + motion%evaluation%load_place*displacement, &
               reaction(:, node))
         end do
         self%angle(b) = self%angle(b) + turned_by(first, first + displacement)
      end do
   end subroutine rigid_rotation_measure

   !> The spin of a body whose nodes move with `v`.
   pure real(wp) function rigid_rotation_spin(rigid, x, u, v) result(spin)
      type(rigid_body_t), intent(in) :: rigid            !! with its frame
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: v(:, :)            !! (n_dim, n_node) [L/T]

      associate (arm => arm_of(rigid, 2, x) + arm_of(rigid, 2, u))
         spin = cross(arm, arm_of(rigid, 2, v))/sum(arm**2)
      end associate
   end function rigid_rotation_spin

   !> From the reference node to node `k` of the frame.
   pure function arm_of(rigid, k, field) result(arm)
      type(rigid_body_t), intent(in) :: rigid            !! with its frame
      integer, intent(in) :: k                           !! 2..n_dim + 1
      real(wp), intent(in) :: field(:, :)                !! (n_dim, n_node)
      real(wp) :: arm(size(field, 1))

      arm = field(:, rigid%frame(k)) - field(:, rigid%frame(1))
   end function arm_of

end module emcon_rigid_rotation
