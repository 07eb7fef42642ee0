!> Rods from outside: pairs of nodes stay as far from each other as they are at the start.
!>
!> f = (|r|^2 - L^2)/(2 L) with the vector r from one node to the other. It is quadratic, so that
!> its discrete gradient is the gradient in the middle, and rods do no work.
module rods
   use emcon_api, only : condition_t, constraint_t, motion_t, wp
   implicit none
   private
   public :: rods_t

   type, extends(constraint_t) :: rods_t
      integer, allocatable :: node(:, :)         !! (2, n_constraint)
      real(wp), allocatable :: length(:)         !! (n_constraint) [L]
   contains
      procedure :: take_positions
      procedure :: linearise
   end type rods_t

contains

   subroutine take_positions(self, x)
      class(rods_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)

      self%stands_on = reshape(self%node, [size(self%node)])
      self%length = norm2(x(:, self%node(2, :)) - x(:, self%node(1, :)), 1)
   end subroutine take_positions

   pure subroutine linearise(self, wanted, motion, target, item)
      class(rods_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
      integer :: k

      do k = 1, size(wanted)
         call rod(self%node(:, wanted(k)), self%length(wanted(k)), motion, item(k))
         item(k)%gap1 = item(k)%gap1 - target(k)
      end do
   end subroutine linearise

   pure subroutine rod(node, length, motion, item)
      integer, intent(in) :: node(2)
      real(wp), intent(in) :: length
      type(motion_t), intent(in) :: motion
      type(condition_t), intent(inout) :: item
      real(wp), dimension(size(motion%x, 1)) :: r0, dr, r1, middle
      integer :: a, n_dim

      n_dim = size(motion%x, 1)
      if (.not. allocated(item%node)) allocate(item%node(2), item%g(n_dim, 2), item%c(n_dim, 2), &
         item%h(2*n_dim, 2*n_dim))
      r0 = between(motion%x) + between(motion%u0)
      dr = between(motion%du)
      r1 = r0 + dr
      middle = between(motion%x) + between(motion%from) + 0.5_wp*between(motion%by)
      item%n_node = 2
      item%n_slave = 1
      item%node = node
      item%size = length
      item%gap0 = (norm2(r0) - length)*(norm2(r0) + length)/(2.0_wp*length)
      item%gap1 = (norm2(r1) - length)*(norm2(r1) + length)/(2.0_wp*length)
      item%dgap = dot_product(r0 + 0.5_wp*dr, dr)/length
      item%g(:, 1) = -middle/length
      item%g(:, 2) = middle/length
      item%c(:, 1) = -r1/length
      item%c(:, 2) = r1/length
      item%h = 0.0_wp
      do a = 1, 2*n_dim
         item%h(a, a) = 0.5_wp*motion%weight/length
         item%h(a, 1 + modulo(a + n_dim - 1, 2*n_dim)) = -item%h(a, a)
      end do

   contains

      pure function between(field) result(apart)
         real(wp), intent(in) :: field(:, :)
         real(wp) :: apart(size(field, 1))

         apart = field(:, node(2)) - field(:, node(1))
      end function between

   end subroutine rod

end module rods
