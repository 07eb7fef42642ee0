!> A moment on a rigid body in space, as forces on the four nodes of its frame.
!>
!> F_i = M x b_i/2 with the gradients b_i of the affine coordinates of the frame where it is: in a
!> rigid motion of the spin w they do the work M.w, have no resultant, and have the moment M about
!> any point, also on a frame in the middle of a step, which is no longer of its size. Source:
!> docs/theory.md, section 12.
module emcon_moment_load_space
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: push_frame, push_frame_stiffness

   integer, parameter :: n_dim = 3, n_node = n_dim + 1

contains

   !> Gradients of the affine coordinates of four places: b_1 + ... + b_4 = 0.
   pure function gradients(place) result(b)
      real(wp), intent(in) :: place(:, :)                  !! (3, 4) [L]
      real(wp) :: b(n_dim, n_node), arm(n_dim, n_dim), across(n_dim)
      integer :: k

      do k = 1, n_dim
         arm(:, k) = place(:, k + 1) - place(:, 1)
      end do
      b(:, 1) = 0.0_wp
      do k = 1, n_dim
         across = cross_product(arm(:, 1 + mod(k, n_dim)), arm(:, 1 + mod(k + 1, n_dim)))
         b(:, k + 1) = across/dot_product(across, arm(:, k))
         b(:, 1) = b(:, 1) - b(:, k + 1)
      end do
   end function gradients

   !> Add the forces to those on the nodes.
   pure subroutine push_frame(node, moment, place, force)
      integer, intent(in) :: node(:)                       !! (4)
      real(wp), intent(in) :: moment(:)                    !! (3) [M L^2/T^2]
      real(wp), intent(in) :: place(:, :)                  !! (3, 4) of the nodes [L]
      real(wp), intent(inout) :: force(:, :)               !! (3, n_node) [M L/T^2]
      real(wp) :: b(n_dim, n_node)
      integer :: i

      b = gradients(place)
      do i = 1, n_node
         force(:, node(i)) = force(:, node(i)) + 0.5_wp*cross_product(moment, b(:, i))
      end do
   end subroutine push_frame

   !> Subtract how the forces change with the places: dF_i/dx_j = -(M x b_j) b_i^T/2.
   pure subroutine push_frame_stiffness(place, moment, slot, value, side)
      real(wp), intent(in) :: place(:, :)                  !! (3, 4) of the nodes [L]
      real(wp), intent(in) :: moment(:)                    !! (3) times the derivative of `place`
      integer, intent(in) :: slot(:, :)                    !! (12, 12) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp) :: b(n_dim, n_node), turned(n_dim), df
      integer :: i, j, a, c, k

      b = gradients(place)
      do j = 1, n_node
         turned = 0.5_wp*cross_product(moment, b(:, j))
         do c = 1, n_dim
            do i = 1, n_node
               do a = 1, n_dim
                  k = slot(a + n_dim*(i - 1), c + n_dim*(j - 1))
                  df = -turned(a)*b(c, i)
                  if (k > 0) value(k) = value(k) - real(df, dp)
                  if (k < 0) side(-k) = side(-k) - real(df, dp)
               end do
            end do
         end do
      end do
   end subroutine push_frame_stiffness

end module emcon_moment_load_space
