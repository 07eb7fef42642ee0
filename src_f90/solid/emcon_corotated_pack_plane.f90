! build: lanes
!> Forces of corotated elements side by side: `emcon_corotated_plane` over lanes.
!>
!> All arrays run over lanes first, and nothing is summed over them. Source: docs/theory.md,
!> section 3.
module emcon_corotated_pack_plane
   use emcon_corotated_plane, only : corotated_t
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   use emcon_shape, only : max_node => max_plane_nodes
   implicit none
   private
   public :: corotated_pack_t, corotated_pack_motion_t
   public :: corotated_pack_fill, corotated_pack_gather, corotated_pack_respond

   !> Elements with as many nodes. Lanes that are left over repeat the first one.
   type :: corotated_pack_t
      integer :: n = 0                                   !! elements in it, 1..n_lane
      integer :: n_node = 0                              !! nodes of each
      integer :: element(n_lane) = 0                     !! their places in the list
      integer, allocatable :: node(:, :)                 !! (n_lane, n_node)
      real(wp), allocatable, private :: x(:, :, :)       !! (n_lane, 2, n_node) positions [L]
      real(wp), allocatable, private :: slope(:, :, :)   !! (n_lane, 2, n_node) [1/L]
      !> (n_lane, 2, n_node, 2, n_node) K [M/T^2]
      real(wp), allocatable, private :: stiffness(:, :, :, :, :)
   end type corotated_pack_t

   !> Displacements of the nodes of each from those of its first one, and what they give.
   type :: corotated_pack_motion_t
      real(wp) :: from(n_lane, 2, max_node) = 0.0_wp     !! at the start [L]
      real(wp) :: by(n_lane, 2, max_node) = 0.0_wp       !! over the span [L]
      real(wp) :: force(n_lane, 2, max_node) = 0.0_wp    !! [M L/T^2]
      logical :: is_inverted(n_lane) = .false.           !! no frame: no force
   end type corotated_pack_motion_t

   !> At one end of a motion, as in `emcon_corotated_plane`.
   type :: end_t
      real(wp) :: y(n_lane, 2, max_node)
      real(wp) :: g(n_lane, 2)
      real(wp) :: rho(n_lane)                            !! 1 where there is no frame
      real(wp) :: d(n_lane, 2, max_node)
      logical :: has_frame(n_lane)
   end type end_t

contains

   !> A pack of elements of a list.
   pure subroutine corotated_pack_fill(self, element, node, frame)
      type(corotated_pack_t), intent(out) :: self
      integer, intent(in) :: element(:)                  !! (1 to n_lane) places in the list
      integer, intent(in) :: node(:, :)                  !! (n_most, list) nodes
      type(corotated_t), intent(in) :: frame(:)          !! (list)
      integer :: e, l, m

      self%n = size(element)
      self%n_node = frame(element(1))%n_node
      associate (n => self%n_node)
         m = 2*n
         allocate(self%node(n_lane, n), source=0)
         allocate(self%x(n_lane, 2, n), self%slope(n_lane, 2, n), &
            self%stiffness(n_lane, 2, n, 2, n), source=0.0_wp)
         do l = 1, n_lane
            e = element(merge(l, 1, l <= self%n))
            self%element(l) = e
            self%node(l, :) = node(:n, e)
            self%x(l, :, :) = frame(e)%x(:, :n)
            self%slope(l, :, :) = frame(e)%slope(:, :n)
            self%stiffness(l, :, :, :, :) = reshape(frame(e)%stiffness(:m, :m), [2, n, 2, n])
         end do
      end associate
   end subroutine corotated_pack_fill

   !> The motion of the nodes of each element.
   pure subroutine corotated_pack_gather(self, from, by, motion)
      type(corotated_pack_t), intent(in) :: self
      real(wp), intent(in), contiguous :: from(:, :), by(:, :)       !! (2, n_node) [L]
      type(corotated_pack_motion_t), intent(inout) :: motion         !! `from`, `by` are set
      integer :: i, l, first, node

      do l = 1, n_lane
         first = self%node(l, 1)
         do i = 1, self%n_node
            node = self%node(l, i)
            motion%from(l, 1, i) = from(1, node) - from(1, first)
            motion%from(l, 2, i) = from(2, node) - from(2, first)
            motion%by(l, 1, i) = by(1, node) - by(1, first)
            motion%by(l, 2, i) = by(2, node) - by(2, first)
         end do
      end do
   end subroutine corotated_pack_gather

   !> The discrete gradients of the energies.
   pure subroutine corotated_pack_respond(self, motion)
      type(corotated_pack_t), intent(in) :: self
      type(corotated_pack_motion_t), intent(inout) :: motion         !! what it gives is set
      type(end_t) :: first, last
      real(wp) :: k(n_lane, 2, max_node), g(n_lane, 2), q(n_lane, 2)
      real(wp), dimension(n_lane) :: alpha, beta
      integer :: i

      call find_end(self, motion%from, first)
      call find_end(self, motion%from + motion%by, last)
      motion%is_inverted = .not. (first%has_frame .and. last%has_frame)
      call find_stress(self, first, last, k)
      call find_lever(self%n_node, first, last, k, q)
      beta = spin_work(self%n_node, first, k) + spin_work(self%n_node, last, k)
      beta = beta/(first%rho*last%rho*(first%rho + last%rho))
      alpha = 0.5_wp*(1.0_wp/first%rho + 1.0_wp/last%rho)
      g = 0.5_wp*(first%g + last%g)
      q(:, 1) = alpha*q(:, 1) - beta*g(:, 1)
      q(:, 2) = alpha*q(:, 2) - beta*g(:, 2)
      g(:, 1) = alpha*g(:, 1)
      g(:, 2) = alpha*g(:, 2)
      do i = 1, self%n_node
         motion%force(:, 1, i) = k(:, 1, i)*g(:, 1) - k(:, 2, i)*g(:, 2) &
            + (q(:, 1)*self%slope(:, 1, i) - q(:, 2)*self%slope(:, 2, i))
         motion%force(:, 2, i) = k(:, 1, i)*g(:, 2) + k(:, 2, i)*g(:, 1) &
            + (q(:, 1)*self%slope(:, 2, i) + q(:, 2)*self%slope(:, 1, i))
      end do
   end subroutine corotated_pack_respond

   !> Positions, frame and displacement in it; of small ones nothing cancels.
   pure subroutine find_end(self, u, place)
      type(corotated_pack_t), intent(in) :: self
      real(wp), intent(in) :: u(n_lane, 2, max_node)
      type(end_t), intent(inout) :: place
      real(wp), dimension(n_lane) :: less, sine
      integer :: i

      place%g(:, 1) = 0.0_wp
      place%g(:, 2) = 0.0_wp
      do i = 1, self%n_node
         associate (s => self%slope)
            place%g(:, 1) = place%g(:, 1) + (s(:, 1, i)*u(:, 1, i) + s(:, 2, i)*u(:, 2, i))
            place%g(:, 2) = place%g(:, 2) + (s(:, 1, i)*u(:, 2, i) - s(:, 2, i)*u(:, 1, i))
         end associate
      end do
      place%g(:, 1) = place%g(:, 1) + 2.0_wp
      place%rho = sqrt(place%g(:, 1)**2 + place%g(:, 2)**2)
      place%has_frame = place%rho > 0.0_wp
      place%rho = merge(place%rho, 1.0_wp, place%has_frame)
      sine = place%g(:, 2)/place%rho
      ! cos - 1
      less = merge(place%g(:, 1)/place%rho - 1.0_wp, -place%g(:, 2)**2/(place%rho*(place%rho &
         + abs(place%g(:, 1)))), place%g(:, 1) < 0.0_wp)
      do i = 1, self%n_node
         place%y(:, :, i) = self%x(:, :, i) + u(:, :, i)
         place%d(:, 1, i) = u(:, 1, i) + less*place%y(:, 1, i) + sine*place%y(:, 2, i)
         place%d(:, 2, i) = u(:, 2, i) + less*place%y(:, 2, i) - sine*place%y(:, 1, i)
      end do
   end subroutine find_end

   !> k = K times the mean of d.
   pure subroutine find_stress(self, first, last, k)
      type(corotated_pack_t), intent(in) :: self
      type(end_t), intent(in) :: first, last
      real(wp), intent(inout) :: k(n_lane, 2, max_node)
      real(wp) :: mean(n_lane)
      integer :: a, c, i, j

      k(:, :, :self%n_node) = 0.0_wp
      do j = 1, self%n_node
         do c = 1, 2
            mean = 0.5_wp*(first%d(:, c, j) + last%d(:, c, j))
            do i = 1, self%n_node
               do a = 1, 2
                  k(:, a, i) = k(:, a, i) + self%stiffness(:, a, i, c, j)*mean
               end do
            end do
         end do
      end do
   end subroutine find_stress

   !> How sum of k.(g.y, g x y) changes with g, at the mean positions.
   pure subroutine find_lever(n, first, last, k, q)
      integer, intent(in) :: n                           !! nodes
      type(end_t), intent(in) :: first, last
      real(wp), intent(in) :: k(n_lane, 2, max_node)
      real(wp), intent(out) :: q(n_lane, 2)
      real(wp) :: y(n_lane, 2)
      integer :: i

      q = 0.0_wp
      do i = 1, n
         y = 0.5_wp*(first%y(:, :, i) + last%y(:, :, i))
         q(:, 1) = q(:, 1) + (k(:, 1, i)*y(:, 1) + k(:, 2, i)*y(:, 2))
         q(:, 2) = q(:, 2) + (k(:, 1, i)*y(:, 2) - k(:, 2, i)*y(:, 1))
      end do
   end subroutine find_lever

   !> The sum of k.(g.y, g x y) at an end.
   pure function spin_work(n, place, k) result(total)
      integer, intent(in) :: n                           !! nodes
      type(end_t), intent(in) :: place
      real(wp), intent(in) :: k(n_lane, 2, max_node)
      real(wp) :: total(n_lane)
      integer :: i

      total = 0.0_wp
      do i = 1, n
         associate (g => place%g, y => place%y)
            total = total + (k(:, 1, i)*(g(:, 1)*y(:, 1, i) + g(:, 2)*y(:, 2, i)) &
               + k(:, 2, i)*(g(:, 1)*y(:, 2, i) - g(:, 2)*y(:, 1, i)))
         end associate
      end do
   end function spin_work

end module emcon_corotated_pack_plane
