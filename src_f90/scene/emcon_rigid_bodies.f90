!> Rigid bodies: elements that keep their shape, and the few nodes whose motion is that of all.
!>
!> A rigid motion is affine: where the n_dim + 1 nodes of a frame are tells where every other node
!> is. Source: docs/theory.md, section 12.
module emcon_rigid_bodies
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: rigid_body_t, rigid_far_node, rigid_frame_choose, rigid_numbers, &
      rigid_weights

   type :: rigid_body_t
      type(origin_t) :: origin
      character(len=:), allocatable :: name          !! of the set or the surface
      integer :: reference = 0                       !! node that is fixed, driven and loaded
      !> Node whose displacements, in the cards of a deck, are the rotations of the body; 0: none.
      integer :: turning = 0
      integer, allocatable :: element(:)             !! ascending
      integer, allocatable :: node(:)                !! ascending; with the reference node
      integer, allocatable :: frame(:)               !! (n_dim + 1) the reference node comes first
      !> (n_dim) nodes of their own that move as the frame does less its reference node; or none
      integer, allocatable :: arm(:)
   end type rigid_body_t

   !> Nodes nearer to the plane of others than this part of the extent lie in it.
   real(wp), parameter :: flatness = sqrt(epsilon(1.0_wp))

contains

   !> Of `node` those that span the largest frame from `reference` on, one after the other. A flat
   !> body has none: `frame` is not allocated.
   pure subroutine rigid_frame_choose(x, node, reference, frame)
      real(wp), intent(in) :: x(:, :)                !! (n_dim, n_node) [L]
      integer, intent(in) :: node(:)                 !! of the body
      integer, intent(in) :: reference
      integer, allocatable, intent(out) :: frame(:)  !! (n_dim + 1)
      real(wp) :: axis(size(x, 1), size(x, 1)), arm(size(x, 1)), extent, length, longest
      integer :: chosen(size(x, 1) + 1), i, k

      extent = 0.0_wp
      chosen(1) = reference
      do k = 1, size(x, 1)
         longest = -1.0_wp
         do i = 1, size(node)
            arm = beyond(i)
            length = norm2(arm)
            if (length <= longest) cycle
            longest = length
            chosen(k + 1) = node(i)
            axis(:, k) = arm
         end do
         extent = max(extent, longest)
         if (.not. longest > flatness*extent) return
         axis(:, k) = axis(:, k)/longest
      end do
      frame = chosen

   contains

      !> From the reference node to node `i`, less its parts along the axes so far.
      pure function beyond(i) result(arm)
         integer, intent(in) :: i
         real(wp) :: arm(size(x, 1))
         integer :: l

         arm = x(:, node(i)) - x(:, reference)
         do l = 1, k - 1
            arm = arm - dot_product(arm, axis(:, l))*axis(:, l)
         end do
      end function beyond

   end subroutine rigid_frame_choose

   !> The node of a body's frame that is farthest from `node`, which is one of the body; 0 if there
   !> is no such body.
   pure integer function rigid_far_node(rigid, node, x)
      type(rigid_body_t), intent(in) :: rigid(:)     !! with their frames
      integer, intent(in) :: node                    !! of the scene
      real(wp), intent(in) :: x(:, :)                !! (n_dim, n_node) [L]
      integer :: b, k

      rigid_far_node = 0
      do b = 1, size(rigid)
         if (.not. any(rigid(b)%node == node)) cycle
         associate (frame => rigid(b)%frame)
            k = maxloc([(norm2(x(:, frame(k)) - x(:, node)), k = 1, size(frame))], 1)
            rigid_far_node = frame(k)
         end associate
         return
      end do
   end function rigid_far_node

   !> Which of the rigid bodies each node belongs to; 0: none.
   pure function rigid_numbers(rigid, n_node) result(number)
      type(rigid_body_t), intent(in) :: rigid(:)
      integer, intent(in) :: n_node                  !! of the scene
      integer :: number(n_node), b

      number = 0
      do b = 1, size(rigid)
         number(rigid(b)%node) = b
      end do
   end function rigid_numbers

   !> The affine combination of the nodes of a frame that a place is; the weights sum up to 1.
   pure subroutine rigid_weights(frame, place, weight)
      real(wp), intent(in) :: frame(:, :)            !! (n_dim, n_dim + 1) positions [L]
      real(wp), intent(in) :: place(:)               !! (n_dim) [L]
      real(wp), intent(out) :: weight(:)             !! (n_dim + 1)
      real(wp) :: a(size(place), size(place) + 1), row(size(place) + 1)
      integer :: i, k, n

      n = size(place)
      do k = 1, n
         a(:, k) = frame(:, k + 1) - frame(:, 1)
      end do
      a(:, n + 1) = place - frame(:, 1)
      do k = 1, n
         i = k - 1 + maxloc(abs(a(k:, k)), 1)
         row = a(i, :)
         a(i, :) = a(k, :)
         a(k, :) = row/row(k)
         do i = 1, n
            if (i /= k) a(i, :) = a(i, :) - a(i, k)*a(k, :)
         end do
      end do
      weight(2:) = a(:, n + 1)
      weight(1) = 1.0_wp - sum(weight(2:))
   end subroutine rigid_weights

end module emcon_rigid_bodies
