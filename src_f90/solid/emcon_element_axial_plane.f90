!> One element of a solid of revolution over one step: force, tangent and strain energy.
!>
!> The axis is that of y; x is the radius. A point moves in its half plane, and its circle grows by
!> the stretch r/R, whose square is quadratic in the displacements as all strains are: the force is
!> a discrete gradient of the strain energy, without net force along the axis. Source:
!> docs/theory.md, eqs. (6), (10a) and (11e).
module emcon_element_axial_plane
   use emcon_element, only : element_geometry_t
   use emcon_element_space, only : space_motion_t, space_part_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_space, only : law_response_space, law_stress_space, n_strain, &
      space_response_t
   implicit none
   private
   public :: axial_element_respond, axial_element_hold

   integer, parameter :: n_dim = 2
   !> Places of the strains E11, E22, E33 (the circle) and 2 E12 among those of space.
   integer, parameter :: n_own = 4, radial = 1, axial = 2, circle = 3, shear = 4

   !> One point; without NLGEOM stretches and deformation gradients are the identity.
   type :: point_t
      real(wp) :: strain(n_strain) = 0.0_wp      !! at the start
      real(wp) :: dstrain(n_strain) = 0.0_wp
      real(wp) :: f_mid(n_dim, n_dim) = 0.0_wp
      real(wp) :: f_end(n_dim, n_dim) = 0.0_wp
      real(wp) :: stretch_mid = 1.0_wp           !! of the circle
      real(wp) :: stretch_end = 1.0_wp
      real(wp) :: geometric = 0.0_wp             !! df_mid/df_end: 1/2 or 0
   end type point_t

contains

   !> Response to a motion, whose displacements are not those relative to a node.
   pure subroutine axial_element_respond(self, law, motion, with_tangent, part)
      type(element_geometry_t), intent(in) :: self   !! with `circle`
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion     !! its first two components
      logical, intent(in) :: with_tangent            !! else no tangent is computed
      type(space_part_t), intent(inout) :: part      !! its first two components
      type(point_t) :: point
      type(space_response_t) :: response
      integer :: k

      part%energy = 0.0_wp
      part%force(:, :self%n_node) = 0.0_wp
      part%magnitude(:, :self%n_node) = 0.0_wp
      if (with_tangent) part%tangent(:, :self%n_node, :, :self%n_node) = 0.0_wp
      do k = 1, self%n_gp
         call place_point(self, k, motion, point)
         part%is_inverted = .not. is_regular(point, law%has_volume)
         if (part%is_inverted) return
         call law_stress_space(law, point%strain, point%dstrain, response, with_tangent)
         call add_point(self, k, point, response, part)
         if (with_tangent) call add_tangent(self, k, point, response, part)
      end do
   end subroutine axial_element_respond

   !> Cauchy stress and strain at the points of an element that does not move.
   pure subroutine axial_element_hold(self, law, motion, stress, strain)
      type(element_geometry_t), intent(in) :: self   !! with `circle`
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion     !! of no size
      real(wp), intent(out) :: stress(:, :)          !! (6, >= n_gp) [M/(L T^2)]
      real(wp), intent(out) :: strain(:, :)          !! (6, >= n_gp) E11, E22, 2 E12, E33 behind
      type(point_t) :: point
      type(space_response_t) :: response
      real(wp) :: s(n_dim, n_dim), det
      integer :: k

      stress = 0.0_wp
      strain = 0.0_wp
      do k = 1, self%n_gp
         call place_point(self, k, motion, point)
         call law_response_space(law, point%strain, point%dstrain, response)
         associate (f => point%f_end)
            det = (f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1))*point%stretch_end
            s = matmul(f, matmul(tensor_of(response%stress), transpose(f)))/det
         end associate
         stress([radial, axial, shear], k) = [s(1, 1), s(2, 2), s(1, 2)]
         stress(circle, k) = response%stress(circle)*point%stretch_end**2/det
         strain(:n_own, k) = point%strain([radial, axial, shear, circle])
      end do
   end subroutine axial_element_hold

   !> The motion of point `k`: eqs. (6) and (11e).
   pure subroutine place_point(self, k, motion, point)
      type(element_geometry_t), intent(in) :: self
      integer, intent(in) :: k
      type(space_motion_t), intent(in) :: motion
      type(point_t), intent(out) :: point
      real(wp), dimension(n_dim, n_dim) :: h, d, c
      real(wp) :: grown, growth
      integer :: a, i

      h = 0.0_wp
      d = 0.0_wp
      grown = 0.0_wp
      growth = 0.0_wp
      do i = 1, self%n_node                      ! slopes: the first node is the origin
         do a = 1, n_dim
            h(:, a) = h(:, a) + (motion%from(:n_dim, i) - motion%from(:n_dim, 1)) &
               *self%gradient(a, i, k)
            d(:, a) = d(:, a) + (motion%by(:n_dim, i) - motion%by(:n_dim, 1))*self%gradient(a, i, k)
         end do
         grown = grown + motion%from(1, i)*self%circle(i, k)
         growth = growth + motion%by(1, i)*self%circle(i, k)
      end do
      do a = 1, n_dim
         point%f_mid(a, a) = 1.0_wp
      end do
      associate (square => motion%square)
         point%f_end = point%f_mid + square*(h + d)
         point%f_mid = point%f_mid + square*(h + 0.5_wp*d)
         point%stretch_mid = 1.0_wp + square*(grown + 0.5_wp*growth)
         point%stretch_end = 1.0_wp + square*(grown + growth)
         point%geometric = 0.5_wp*square
         point%strain(circle) = grown + square*(0.5_wp*grown**2)
         c = h + transpose(h) + square*matmul(transpose(h), h)
      end associate
      point%strain([radial, axial, shear]) = [0.5_wp*c(1, 1), 0.5_wp*c(2, 2), c(1, 2)]
      c = matmul(transpose(point%f_mid), d)
      point%dstrain([radial, axial, shear]) = [c(1, 1), c(2, 2), c(1, 2) + c(2, 1)]
      point%dstrain(circle) = point%stretch_mid*growth
   end subroutine place_point

   !> Is the end one that the law can answer to?
   pure logical function is_regular(point, has_volume)
      type(point_t), intent(in) :: point
      logical, intent(in) :: has_volume          !! as in law_t
      real(wp), parameter :: largest = huge(1.0_wp)**0.1_wp   ! its powers in energies are finite
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: e(n_strain), area, terms

      e = point%strain + point%dstrain
      associate (f => point%f_end)
         is_regular = maxval(abs(e)) < largest
         if (.not. is_regular) return
         is_regular = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1) > 0.0_wp .and. point%stretch_end > 0.0_wp
      end associate
      if (.not. (is_regular .and. has_volume)) return
      ! det C of the plane, and the stretch of the circle, where they are more than round-off.
      terms = (1.0_wp + 2.0_wp*abs(e(radial)))*(1.0_wp + 2.0_wp*abs(e(axial))) + e(shear)**2
      area = (1.0_wp + 2.0_wp*e(radial))*(1.0_wp + 2.0_wp*e(axial)) - e(shear)**2
      is_regular = 1.0_wp + 2.0_wp*e(circle) > noise .and. area > noise*terms
   end function is_regular

   !> Add the forces of a point, F S grad N, and those of the circle along the radius.
   pure subroutine add_point(self, k, point, response, part)
      type(element_geometry_t), intent(in) :: self
      integer, intent(in) :: k
      type(point_t), intent(in) :: point
      type(space_response_t), intent(in) :: response
      type(space_part_t), intent(inout) :: part
      real(wp), dimension(n_dim, n_dim) :: stress, nominal
      real(wp) :: hoop, f(n_dim)
      integer :: i

      part%energy = part%energy + self%weight(k)*response%energy
      stress = tensor_of(response%stress)
      nominal = self%weight(k)*matmul(point%f_mid, stress)
      hoop = self%weight(k)*point%stretch_mid*response%stress(circle)
      do i = 1, self%n_node
         f = matmul(nominal, self%gradient(:, i, k))
         part%magnitude(:n_dim, i) = part%magnitude(:n_dim, i) + abs(f)
         part%magnitude(1, i) = part%magnitude(1, i) + abs(hoop*self%circle(i, k))
         f(1) = f(1) + hoop*self%circle(i, k)
         part%force(:n_dim, i) = part%force(:n_dim, i) + f
      end do
   end subroutine add_point

   !> Components in the half plane.
   pure function tensor_of(stress) result(s)
      real(wp), intent(in) :: stress(n_strain)
      real(wp) :: s(n_dim, n_dim)

      s = reshape([stress(radial), stress(shear), stress(shear), stress(axial)], [n_dim, n_dim])
   end function tensor_of

   !> Add B(F_mid)^T D B(F_end) and what the stress at fixed strain does: eq. (11).
   pure subroutine add_tangent(self, k, point, response, part)
      type(element_geometry_t), intent(in) :: self
      integer, intent(in) :: k
      type(point_t), intent(in) :: point
      type(space_response_t), intent(in) :: response
      type(space_part_t), intent(inout) :: part
      real(wp) :: b(n_own, n_dim, self%n_node), at_end(n_own, n_dim), flow(n_own), own
      real(wp) :: s(n_dim, n_dim), steep(n_dim), hoop, factor
      integer :: a, c, i, j

      factor = point%geometric*self%weight(k)
      s = factor*tensor_of(response%stress)
      hoop = factor*response%stress(circle)
      do i = 1, self%n_node
         b(:, :, i) = strain_by(point%f_mid, point%stretch_mid, self%gradient(:, i, k), &
            self%circle(i, k))
      end do
      do j = 1, self%n_node
         at_end = self%weight(k)*strain_by(point%f_end, point%stretch_end, &
            self%gradient(:, j, k), self%circle(j, k))
         steep = matmul(s, self%gradient(:, j, k))
         do c = 1, n_dim
            flow = matmul(response%tangent(:n_own, :n_own), at_end(:, c))
            do i = 1, self%n_node
               own = dot_product(self%gradient(:, i, k), steep)
               if (c == 1) own = own + hoop*self%circle(i, k)*self%circle(j, k)
               do a = 1, n_dim
                  part%tangent(a, i, c, j) = part%tangent(a, i, c, j) &
                     + dot_product(b(:, a, i), flow) + merge(own, 0.0_wp, a == c)
               end do
            end do
         end do
      end do
   end subroutine add_tangent

   !> Derivative of the strain by the displacement of a node.
   pure function strain_by(f, stretch, gradient, circle_by) result(b)
      real(wp), intent(in) :: f(n_dim, n_dim), gradient(n_dim)
      real(wp), intent(in) :: stretch            !! of the circle
      real(wp), intent(in) :: circle_by          !! derivative of the stretch by the radius [1/L]
      real(wp) :: b(n_own, n_dim)

      b(radial, :) = f(:, 1)*gradient(1)
      b(axial, :) = f(:, 2)*gradient(2)
      b(circle, :) = [stretch*circle_by, 0.0_wp]
      b(shear, :) = f(:, 1)*gradient(2) + f(:, 2)*gradient(1)
   end function strain_by

end module emcon_element_axial_plane
