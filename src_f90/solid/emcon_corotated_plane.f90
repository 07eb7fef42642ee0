!> One corotated element in the plane: a constant stiffness in a frame that turns with the element.
!>
!> d = R^T y - X with R of the mean deformation gradient, whose (F11 + F22, F21 - F12) = g is linear
!> in the positions y, and R = (g, J g)/|g|. So d has the components (g.y)/|g| and (g x y)/|g|, less
!> those of X: invariants, whose discrete gradients are exact and without force and moment. The
!> energy is d.K d/2. Here are energy and tangent, forces are in `emcon_corotated_pack_plane`.
!> Source: docs/theory.md, section 3.
module emcon_corotated_plane
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   use emcon_shape, only : max_plane_nodes
   implicit none
   private
   public :: corotated_t, corotated_motion_t, corotated_init, corotated_move, corotated_energy, &
      corotated_image, corotated_strip, corotated_turn_stress

   !> An element at rest, its positions from those of its first node.
   type :: corotated_t
      integer :: n_node = 0
      real(wp) :: x(2, max_plane_nodes) = 0.0_wp       !! positions [L]
      real(wp) :: slope(2, max_plane_nodes) = 0.0_wp   !! mean gradients of shape functions [1/L]
      real(wp), allocatable :: stiffness(:, :)   !! (2*n_node, 2*n_node) K [M/T^2]
   end type corotated_t

   !> At one end of a motion.
   type :: end_t
      real(wp) :: y(2, max_plane_nodes) = 0.0_wp       !! positions [L]
      real(wp) :: g(2) = 0.0_wp                          !! (F11 + F22, F21 - F12)
      real(wp) :: rho = 0.0_wp                           !! |g|
      real(wp) :: d(2, max_plane_nodes) = 0.0_wp       !! displacement in the frame [L]
   end type end_t

   !> From one end to the other.
   type :: corotated_motion_t
      type(end_t) :: first, last
      real(wp) :: y(2, max_plane_nodes) = 0.0_wp       !! means of the ends
      real(wp) :: g(2) = 0.0_wp
      real(wp) :: k(2, max_plane_nodes) = 0.0_wp       !! K at the mean d [M L/T^2]
      real(wp) :: alpha = 0.0_wp                         !! mean of 1/rho
      real(wp) :: beta = 0.0_wp                          !! weight of g in the force
   end type corotated_motion_t

contains

   !> Positions and mean gradients of an element of `geometry`, whose nodes are at `x`.
   pure subroutine corotated_init(self, geometry, x)
      type(corotated_t), intent(out) :: self
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in) :: x(:, :)                    !! (2, n_node) [L]
      integer :: i, k

      self%n_node = geometry%n_node
      do i = 1, self%n_node
         self%x(:, i) = x(:, i) - x(:, 1)
         do k = 1, geometry%n_gp
            self%slope(:, i) = self%slope(:, i) + geometry%gradient(:, i, k) &
               *(geometry%weight(k)/sum(geometry%weight))
         end do
      end do
   end subroutine corotated_init

   !> Displacements in the turned frame, and how far it has turned.
   pure subroutine corotated_strip(self, u, d, turn)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: u(:, :)                    !! (2, n_node) from the first node's [L]
      real(wp), intent(out) :: d(:, :)                   !! (2, n_node) [L]
      real(wp), intent(out) :: turn(2, 2)                !! R
      type(end_t) :: place

      call set_end(self, u, place)
      d(:, :self%n_node) = place%d(:, :self%n_node)
      turn(:, 1) = place%g/place%rho
      turn(:, 2) = quarter(turn(:, 1))
   end subroutine corotated_strip

   !> Turn the stress from the frame of an element to the axes.
   pure subroutine corotated_turn_stress(turn, stress)
      real(wp), intent(in) :: turn(2, 2)            !! of `corotated_strip`
      real(wp), intent(inout) :: stress(:)               !! (6) xx, yy, zz, xy, yz, xz
      integer, parameter :: shear = 4
      real(wp) :: s(2, 2)

      s = reshape([stress(1), stress(shear), stress(shear), stress(2)], [2, 2])
      s = matmul(matmul(turn, s), transpose(turn))
      stress(:2) = [s(1, 1), s(2, 2)]
      stress(shear) = s(1, 2)
   end subroutine corotated_turn_stress

   !> Positions, frame and displacement in it; of small ones nothing cancels.
   pure subroutine set_end(self, u, place)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: u(:, :)
      type(end_t), intent(out) :: place
      real(wp) :: less
      integer :: i

      place%g = frame_of(self, u)
      place%g(1) = place%g(1) + 2.0_wp
      place%rho = norm2(place%g)
      if (.not. place%rho > 0.0_wp) return
      less = -place%g(2)**2/(place%rho*(place%rho + place%g(1)))   ! cos - 1
      if (place%g(1) < 0.0_wp) less = place%g(1)/place%rho - 1.0_wp
      do i = 1, self%n_node
         associate (x => self%x(:, i), sine => place%g(2)/place%rho)
            place%y(:, i) = x + u(:, i)
            place%d(:, i) = u(:, i) + less*place%y(:, i) - sine*quarter(place%y(:, i))
         end associate
      end do
   end subroutine set_end

   !> g of a field.
   pure function frame_of(self, field) result(g)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: field(:, :)                !! (2, n_node)
      real(wp) :: g(2)
      integer :: i

      g = 0.0_wp
      do i = 1, self%n_node
         g = g + turned(self%slope(:, i), field(:, i))
      end do
   end function frame_of

   !> (a.b, a x b)
   pure function turned(a, b)
      real(wp), intent(in) :: a(2), b(2)
      real(wp) :: turned(2)

      turned = [a(1)*b(1) + a(2)*b(2), a(1)*b(2) - a(2)*b(1)]
   end function turned

   !> J a, a by a quarter of a turn.
   pure function quarter(a)
      real(wp), intent(in) :: a(2)
      real(wp) :: quarter(2)

      quarter = [-a(2), a(1)]
   end function quarter

   !> a1 b + a2 J b: `turned` is its adjoint in b.
   pure function spread_over(a, b)
      real(wp), intent(in) :: a(2), b(2)
      real(wp) :: spread_over(2)

      spread_over = a(1)*b + a(2)*quarter(b)
   end function spread_over

   !> d.K d/2 at the displacements `u`.
   pure real(wp) function corotated_energy(self, u)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: u(:, :)                    !! (2, n_node) from the first node's [L]
      type(end_t) :: place

      call set_end(self, u, place)
      corotated_energy = 0.5_wp*sum(place%d(:, :self%n_node)*times(self, place%d))
   end function corotated_energy

   !> From displacements `from` by `by`.
   pure subroutine corotated_move(self, from, by, motion)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: from(:, :), by(:, :)       !! (2, n_node) from the first node's [L]
      type(corotated_motion_t), intent(out) :: motion
      real(wp) :: mean(2, max_plane_nodes), product
      integer :: i, n

      n = self%n_node
      call set_end(self, from, motion%first)
      call set_end(self, from + by, motion%last)
      associate (first => motion%first, last => motion%last)
         if (.not. (first%rho > 0.0_wp .and. last%rho > 0.0_wp)) return
         mean(:, :n) = 0.5_wp*(first%d(:, :n) + last%d(:, :n))
         motion%k(:, :n) = times(self, mean)
         motion%y = 0.5_wp*(first%y + last%y)
         motion%g = 0.5_wp*(first%g + last%g)
         motion%alpha = 0.5_wp*(1.0_wp/first%rho + 1.0_wp/last%rho)
         product = 0.0_wp
         do i = 1, n
            product = product + 0.5_wp*dot_product(motion%k(:, i), turned(first%g, first%y(:, i)) &
               + turned(last%g, last%y(:, i)))
         end do
         motion%beta = product*spread_factor(motion)
      end associate
   end subroutine corotated_move

   !> What a product has in beta.
   pure real(wp) function spread_factor(motion)
      type(corotated_motion_t), intent(in) :: motion

      associate (a => motion%first%rho, b => motion%last%rho)
         spread_factor = 2.0_wp/(a*b*(a + b))
      end associate
   end function spread_factor

   !> K field.
   pure function times(self, field) result(product)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: field(:, :)                !! (2, n_node or more)
      real(wp) :: product(2, self%n_node)
      integer :: i, j

      product = 0.0_wp
      do j = 1, self%n_node
         do i = 1, self%n_node
            product(:, i) = product(:, i) + self%stiffness(2*i - 1:2*i, 2*j - 1)*field(1, j) &
               + self%stiffness(2*i - 1:2*i, 2*j)*field(2, j)
         end do
      end do
   end function times

   !> What k.(g.y, g x y) changes by with g: sum of k1 y - k2 J y.
   pure function lever(self, k, y) result(q)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: k(:, :), y(:, :)           !! (2, n_node or more)
      real(wp) :: q(2)
      integer :: i

      q = 0.0_wp
      do i = 1, self%n_node
         q = q + spread_over([k(1, i), -k(2, i)], y(:, i))
      end do
   end function lever

   !> k along g and J g, and q on g.
   pure subroutine add_force(self, g, k, q, force)
      type(corotated_t), intent(in) :: self
      real(wp), intent(in) :: g(2), k(:, :), q(2)
      real(wp), intent(out) :: force(:, :)
      integer :: i

      do i = 1, self%n_node
         force(:, i) = spread_over(k(:, i), g) + spread_over(q, self%slope(:, i))
      end do
   end subroutine add_force

   !> How the force changes with the last end along `way`.
   pure subroutine corotated_image(self, motion, displacement, image)
      type(corotated_t), intent(in) :: self
      type(corotated_motion_t), intent(in) :: motion
      real(wp), intent(in) :: displacement(:, :)         !! (2, n_node) [L]
      real(wp), intent(out) :: image(:, :)               !! (2, n_node) [M L/T^2]
      real(wp) :: dg(2), drho, dd(2, max_plane_nodes), dk(2, max_plane_nodes)
      real(wp) :: dalpha, dbeta, q(2), more(2, max_plane_nodes), product
      integer :: i, n

      n = self%n_node
      associate (first => motion%first, last => motion%last)
         dg = frame_of(self, displacement)
         drho = dot_product(last%g, dg)/last%rho
         product = 0.0_wp
         do i = 1, n
            dd(:, i) = (turned(dg, last%y(:, i)) + turned(last%g, displacement(:, i)))/last%rho
            product = product + 0.5_wp*last%rho*dot_product(motion%k(:, i), dd(:, i))
            dd(:, i) = dd(:, i) - turned(last%g, last%y(:, i))*(drho/last%rho**2)
         end do
         dk(:, :n) = 0.5_wp*times(self, dd)
         do i = 1, n
            product = product + 0.5_wp*dot_product(dk(:, i), turned(first%g, first%y(:, i)) &
               + turned(last%g, last%y(:, i)))
         end do
         dalpha = -0.5_wp*drho/last%rho**2
         dbeta = product*spread_factor(motion) - motion%beta*drho*(1.0_wp/last%rho &
            + 1.0_wp/(first%rho + last%rho))
      end associate
      q = dalpha*lever(self, motion%k, motion%y) - dbeta*motion%g &
         + motion%alpha*(lever(self, dk, motion%y) + 0.5_wp*lever(self, motion%k, displacement)) &
         - 0.5_wp*motion%beta*dg
      call add_force(self, dalpha*motion%g + 0.5_wp*motion%alpha*dg, motion%k, q, image)
      call add_force(self, motion%alpha*motion%g, dk, [0.0_wp, 0.0_wp], more)
      image(:, :n) = image(:, :n) + more(:, :n)
   end subroutine corotated_image

end module emcon_corotated_plane
