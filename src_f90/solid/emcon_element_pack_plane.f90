! build: lanes
!> Force, tangent and strain energy of elements in the plane side by side, over one step.
!>
!> The strain is bilinear in the positions, so with the algorithmic stress of the law the force is
!> a discrete gradient of the strain energy: f.du = W1 - W0, without net force and moment on the
!> mid-configuration. Source: docs/theory.md, eqs. (6) and (11). Strains come from grad u, never
!> from positions: a rigid offset of the scene costs no digits. All arrays run over lanes first, and
!> nothing is summed over them: what an element gives does not depend on its neighbours in the pack.
module emcon_element_pack_plane
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, n_lane
   use emcon_shape, only : max_node => max_plane_nodes
   implicit none
   private
   public :: element_pack_t, pack_motion_t, pack_point_t, pack_response_t
   public :: pack_fill, pack_gather, pack_scatter, pack_clear, pack_point, pack_point_check
   public :: pack_add_point, pack_add_rounding

   !> Elements of one kind and one law. Lanes that are left over repeat the first one.
   type :: element_pack_t
      integer :: n = 0                           !! elements in it, 1..n_lane
      integer :: n_node = 0                      !! nodes of each
      integer :: n_gp = 0
      integer :: law = 0                         !! of all of them
      integer :: element(n_lane) = 0
      integer, allocatable :: node(:, :)         !! (n_lane, n_node)
      real(wp), allocatable :: gradient(:, :, :, :)   !! (n_lane, 2, n_node, n_gp) [1/L]
      real(wp), allocatable :: weight(:, :)      !! (n_lane, n_gp) reference volume [L^3]
      !> (n_lane, 3, n_mode, n_gp) as in element_geometry_t
      real(wp), allocatable :: mode(:, :, :, :), dual(:, :, :, :)
   end type element_pack_t

   !> Motion of the nodes, from `from` by `by`, relative to the first node of each element, which
   !> does not round them with the distance that a body has flown.
   type :: pack_motion_t
      real(wp) :: square = 1.0_wp                !! part of squares in strains; 0: small strains
      real(wp) :: from(n_lane, 2, max_node) = 0.0_wp     !! displacement at the start [L]
      real(wp) :: by(n_lane, 2, max_node) = 0.0_wp       !! displacement over the span [L]
   end type pack_motion_t

   !> One quadrature point of each; of small strains deformation gradients are the identity.
   type :: pack_point_t
      type(law_points_t) :: law                  !! strains, and what the law answers
      real(wp) :: f_mid(n_lane, 2, 2) = 0.0_wp   !! of the mid-configuration
      real(wp) :: f_end(n_lane, 2, 2) = 0.0_wp   !! of the end
      real(wp) :: geometric = 0.0_wp             !! df_mid/df_end: 1/2, small strains 0
   end type pack_point_t

   type :: pack_response_t
      real(wp) :: energy(n_lane) = 0.0_wp                  !! strain energy at the end
      real(wp) :: force(n_lane, 2, max_node) = 0.0_wp
      logical :: with_sizes = .true.                       !! there are magnitudes
      real(wp) :: magnitude(n_lane, 2, max_node) = 0.0_wp  !! sum of |contributions| to `force`
      !> Where asked for, derivative of `force` by u1: (lane, component, node, those of u1)
      real(wp) :: tangent(n_lane, 2, max_node, 2, max_node)
      !> det F <= 0 at some point at the end, or a strain that the law has no energy for.
      logical :: is_inverted(n_lane) = .false.
   end type pack_response_t

contains

   !> Take `element`, at most n_lane of one kind and one law.
   pure subroutine pack_fill(self, element, law, node, geometry)
      type(element_pack_t), intent(out) :: self
      integer, intent(in) :: element(:)          !! 1..n_element
      integer, intent(in) :: law                 !! of all of them
      integer, intent(in) :: node(:, :)          !! (n_most, n_element)
      type(element_geometry_t), intent(in) :: geometry(:)   !! (n_element)
      integer :: e, l

      self%n = size(element)
      self%n_node = geometry(element(1))%n_node
      self%n_gp = geometry(element(1))%n_gp
      self%law = law
      allocate(self%node(n_lane, self%n_node), source=0)
      allocate(self%gradient(n_lane, 2, self%n_node, self%n_gp), &
         self%weight(n_lane, self%n_gp), source=0.0_wp)
      do l = 1, n_lane
         e = element(merge(l, 1, l <= self%n))
         self%element(l) = e
         self%node(l, :) = node(:self%n_node, e)
         self%gradient(l, :, :, :) = geometry(e)%gradient
         self%weight(l, :) = geometry(e)%weight
         if (.not. allocated(geometry(e)%mode)) cycle
         if (l == 1) then
            allocate(self%mode(n_lane, size(geometry(e)%mode, 1), size(geometry(e)%mode, 2), &
               self%n_gp), source=0.0_wp)
            self%dual = self%mode
         end if
         self%mode(l, :, :, :) = geometry(e)%mode
         self%dual(l, :, :, :) = geometry(e)%dual
      end do
   end subroutine pack_fill

   !> The motion of the nodes of each element.
   pure subroutine pack_gather(self, from, by, motion)
      type(element_pack_t), intent(in) :: self
      real(wp), intent(in), contiguous :: from(:, :), by(:, :)   !! (2, n_node) [L]
      type(pack_motion_t), intent(inout) :: motion               !! `from`, `by` are set
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
   end subroutine pack_gather

   !> Add what the nodes of each element get, element by element, to those whose turn it is.
   pure subroutine pack_scatter(self, turn_of, turn, part, total)
      type(element_pack_t), intent(in) :: self
      integer, intent(in), contiguous :: turn_of(:)          !! (n_node)
      integer, intent(in) :: turn                            !! as `turn_of` has them
      real(wp), intent(in) :: part(n_lane, 2, self%n_node)   !! forces, sizes or roundings
      real(wp), intent(inout), contiguous :: total(:, :)     !! (2, n_node)
      integer :: i, l, node

      do l = 1, self%n
         do i = 1, self%n_node
            node = self%node(l, i)
            if (turn_of(node) /= turn) cycle
            total(1, node) = total(1, node) + part(l, 1, i)
            total(2, node) = total(2, node) + part(l, 2, i)
         end do
      end do
   end subroutine pack_scatter

   !> Add to the nodes whose turn it is what the displacements of their elements are rounded by.
   pure subroutine pack_add_rounding(self, turn_of, turn, largest, stiffness, total)
      type(element_pack_t), intent(in) :: self
      integer, intent(in), contiguous :: turn_of(:)          !! (n_node)
      integer, intent(in) :: turn                            !! as `turn_of` has them
      real(wp), intent(in) :: largest(n_lane)                !! displacement [L]
      real(wp), intent(in) :: stiffness(:, :)                !! (>= n_node, n_element) [M/T^2]
      real(wp), intent(inout), contiguous :: total(:, :)     !! (2, n_node)
      integer :: i, l, node

      do l = 1, self%n
         do i = 1, self%n_node
            node = self%node(l, i)
            if (turn_of(node) /= turn) cycle
            total(:, node) = total(:, node) + largest(l)*stiffness(i, self%element(l))
         end do
      end do
   end subroutine pack_add_rounding

   !> Nothing, before points are added.
   pure subroutine pack_clear(n, response, with_tangent)
      integer, intent(in) :: n                   !! nodes of each element
      type(pack_response_t), intent(inout) :: response
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is

      response%energy = 0.0_wp
      response%force(:, :, :n) = 0.0_wp
      if (response%with_sizes) response%magnitude(:, :, :n) = 0.0_wp
      if (with_tangent) response%tangent(:, :, :n, :, :n) = 0.0_wp
      response%is_inverted = .false.
   end subroutine pack_clear

   !> The motion of quadrature point `k`: strains, to relative accuracy their increments too, and
   !> deformation gradients, docs/theory.md, eq. (6).
   pure subroutine pack_point(self, k, motion, point)
      type(element_pack_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(pack_motion_t), intent(in) :: motion
      type(pack_point_t), intent(inout) :: point         !! all but what the law answers is set
      real(wp) :: h(n_lane, 2, 2), d(n_lane, 2, 2)       ! of displacements: (component, by X)

      call displacement_gradient(self%n_node, self%gradient(:, :, :, k), motion%from, h)
      call displacement_gradient(self%n_node, self%gradient(:, :, :, k), motion%by, d)
      call find_strains(h, d, motion%square, point)
   end subroutine pack_point

   !> grad(lane, a, b) = d u_a / d X_b.
   pure subroutine displacement_gradient(n, gradient, u, grad)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(n_lane, 2, n), u(n_lane, 2, n)
      real(wp), intent(out) :: grad(n_lane, 2, 2)
      integer :: i, l

      !$omp simd
      do l = 1, n_lane                           ! the first node is the origin
         grad(l, 1, 1) = u(l, 1, 2)*gradient(l, 1, 2)
         grad(l, 2, 1) = u(l, 2, 2)*gradient(l, 1, 2)
         grad(l, 1, 2) = u(l, 1, 2)*gradient(l, 2, 2)
         grad(l, 2, 2) = u(l, 2, 2)*gradient(l, 2, 2)
      end do
      do i = 3, n
         !$omp simd
         do l = 1, n_lane
            grad(l, 1, 1) = grad(l, 1, 1) + u(l, 1, i)*gradient(l, 1, i)
            grad(l, 2, 1) = grad(l, 2, 1) + u(l, 2, i)*gradient(l, 1, i)
            grad(l, 1, 2) = grad(l, 1, 2) + u(l, 1, i)*gradient(l, 2, i)
            grad(l, 2, 2) = grad(l, 2, 2) + u(l, 2, i)*gradient(l, 2, i)
         end do
      end do
   end subroutine displacement_gradient

   !> Of the gradients of the displacement at the start, `h`, and over the step, `d`; small
   !> strains are those without squares, and their deformation gradients are the identity.
   pure subroutine find_strains(h, d, square, point)
      real(wp), intent(in) :: h(n_lane, 2, 2), d(n_lane, 2, 2)   !! (component, by X)
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      type(pack_point_t), intent(inout) :: point
      integer :: l

      point%geometric = 0.5_wp*square
      associate (e => point%law%strain, de => point%law%dstrain, f => point%f_mid, &
            f1 => point%f_end)
         !$omp simd
         do l = 1, n_lane
            f(l, 1, 1) = 1.0_wp + square*(h(l, 1, 1) + 0.5_wp*d(l, 1, 1))
            f(l, 2, 1) = square*(h(l, 2, 1) + 0.5_wp*d(l, 2, 1))
            f(l, 1, 2) = square*(h(l, 1, 2) + 0.5_wp*d(l, 1, 2))
            f(l, 2, 2) = 1.0_wp + square*(h(l, 2, 2) + 0.5_wp*d(l, 2, 2))
            f1(l, 1, 1) = 1.0_wp + square*(h(l, 1, 1) + d(l, 1, 1))
            f1(l, 2, 1) = square*(h(l, 2, 1) + d(l, 2, 1))
            f1(l, 1, 2) = square*(h(l, 1, 2) + d(l, 1, 2))
            f1(l, 2, 2) = 1.0_wp + square*(h(l, 2, 2) + d(l, 2, 2))
            e(l, 1) = h(l, 1, 1) + 0.5_wp*(square*h(l, 1, 1)*h(l, 1, 1) &
               + square*h(l, 2, 1)*h(l, 2, 1))
            e(l, 2) = h(l, 2, 2) + 0.5_wp*(square*h(l, 1, 2)*h(l, 1, 2) &
               + square*h(l, 2, 2)*h(l, 2, 2))
            e(l, 3) = (h(l, 1, 2) + h(l, 2, 1)) &
               + (square*h(l, 1, 1)*h(l, 1, 2) + square*h(l, 2, 1)*h(l, 2, 2))
            de(l, 1) = f(l, 1, 1)*d(l, 1, 1) + f(l, 2, 1)*d(l, 2, 1)
            de(l, 2) = f(l, 1, 2)*d(l, 1, 2) + f(l, 2, 2)*d(l, 2, 2)
            de(l, 3) = (f(l, 1, 1)*d(l, 1, 2) + f(l, 2, 1)*d(l, 2, 2)) &
               + (f(l, 1, 2)*d(l, 1, 1) + f(l, 2, 2)*d(l, 2, 1))
         end do
      end associate
   end subroutine find_strains

   !> Is the end of the motion one that the law can answer to? Newton's method tries all kinds of
   !> things. Where it is not, the element is inverted, and the law is asked for a point at rest.
   pure subroutine pack_point_check(has_volume, point, response)
      logical, intent(in) :: has_volume                    !! as in law_t
      type(pack_point_t), intent(inout) :: point
      type(pack_response_t), intent(inout) :: response
      real(wp), parameter :: largest = huge(1.0_wp)**0.2_wp   ! its powers in energies are finite
      real(wp) :: e(n_lane, 3), det(n_lane)
      integer :: l, n_fit

      associate (strain => point%law%strain, dstrain => point%law%dstrain, f => point%f_end)
         !$omp simd
         do l = 1, n_lane
            e(l, 1) = strain(l, 1) + dstrain(l, 1)
            e(l, 2) = strain(l, 2) + dstrain(l, 2)
            e(l, 3) = strain(l, 3) + dstrain(l, 3)
            det(l) = merge(f(l, 1, 1)*f(l, 2, 2) - f(l, 1, 2)*f(l, 2, 1), -1.0_wp, &
               max(abs(e(l, 1)), abs(e(l, 2)), abs(e(l, 3)), abs(f(l, 1, 1)), abs(f(l, 2, 1)), &
               abs(f(l, 1, 2)), abs(f(l, 2, 2))) < largest)
         end do
      end associate
      if (has_volume) call compare_volume(e, det)
      n_fit = 0
      !$omp simd reduction(+: n_fit)
      do l = 1, n_lane
         n_fit = n_fit + merge(1, 0, det(l) > 0.0_wp)
      end do
      if (n_fit == n_lane) return
      do l = 1, n_lane
         if (det(l) > 0.0_wp) cycle
         response%is_inverted(l) = .true.
         point%law%strain(l, :) = 0.0_wp
         point%law%dstrain(l, :) = 0.0_wp
      end do
   end subroutine pack_point_check

   !> det C besides det F, where it is more than round-off.
   pure subroutine compare_volume(strain, det)
      real(wp), intent(in) :: strain(n_lane, 3)
      real(wp), intent(inout) :: det(n_lane)     !! the smaller one; not above 0 where that is so
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: e1, e2, e3
      integer :: l

      !$omp simd private(e1, e2, e3)
      do l = 1, n_lane
         e1 = merge(strain(l, 1), 0.0_wp, det(l) > 0.0_wp)
         e2 = merge(strain(l, 2), 0.0_wp, det(l) > 0.0_wp)
         e3 = merge(strain(l, 3), 0.0_wp, det(l) > 0.0_wp)
         det(l) = min(det(l), ((1.0_wp + 2.0_wp*e1)*(1.0_wp + 2.0_wp*e2) - e3*e3) &
            - noise*((1.0_wp + 2.0_wp*abs(e1))*(1.0_wp + 2.0_wp*abs(e2)) + e3*e3))
      end do
   end subroutine compare_volume

   !> Add what point `k` gives, whose law has answered.
   pure subroutine pack_add_point(self, k, point, with_tangent, response)
      type(element_pack_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(pack_point_t), intent(in) :: point
      logical, intent(in) :: with_tangent        !! else no tangent is added
      type(pack_response_t), intent(inout) :: response
      real(wp) :: s(n_lane, 3), nominal(n_lane, 2, 2)
      integer :: i, l

      associate (w => self%weight(:, k), stress => point%law%stress, f => point%f_mid)
         !$omp simd
         do l = 1, n_lane
            response%energy(l) = response%energy(l) + w(l)*point%law%energy(l)
            s(l, 1) = w(l)*stress(l, 1)
            s(l, 2) = w(l)*stress(l, 2)
            s(l, 3) = w(l)*stress(l, 3)
            nominal(l, 1, 1) = f(l, 1, 1)*s(l, 1) + f(l, 1, 2)*s(l, 3)
            nominal(l, 2, 1) = f(l, 2, 1)*s(l, 1) + f(l, 2, 2)*s(l, 3)
            nominal(l, 1, 2) = f(l, 1, 1)*s(l, 3) + f(l, 1, 2)*s(l, 2)
            nominal(l, 2, 2) = f(l, 2, 1)*s(l, 3) + f(l, 2, 2)*s(l, 2)
         end do
      end associate
      associate (g => self%gradient(:, :, :, k), force => response%force)
         do i = 1, self%n_node
            !$omp simd
            do l = 1, n_lane
               force(l, 1, i) = force(l, 1, i) &
                  + (nominal(l, 1, 1)*g(l, 1, i) + nominal(l, 1, 2)*g(l, 2, i))
               force(l, 2, i) = force(l, 2, i) &
                  + (nominal(l, 2, 1)*g(l, 1, i) + nominal(l, 2, 2)*g(l, 2, i))
            end do
         end do
      end associate
      if (response%with_sizes) call add_sizes(self%n_node, nominal, self%gradient(:, :, :, k), &
         response%magnitude)
      if (with_tangent) call add_tangent(self%n_node, self%gradient(:, :, :, k), &
         self%weight(:, k), point, s, response%tangent)
   end subroutine pack_add_point

   !> Add the sizes of the forces of a point.
   pure subroutine add_sizes(n, nominal, gradient, magnitude)
      integer, intent(in) :: n
      real(wp), intent(in) :: nominal(n_lane, 2, 2)        !! stress, weighted
      real(wp), intent(in) :: gradient(n_lane, 2, n)
      real(wp), intent(inout) :: magnitude(n_lane, 2, max_node)
      integer :: i, l

      do i = 1, n
         !$omp simd
         do l = 1, n_lane
            magnitude(l, 1, i) = magnitude(l, 1, i) + abs(nominal(l, 1, 1)*gradient(l, 1, i) &
               + nominal(l, 1, 2)*gradient(l, 2, i))
            magnitude(l, 2, i) = magnitude(l, 2, i) + abs(nominal(l, 2, 1)*gradient(l, 1, i) &
               + nominal(l, 2, 2)*gradient(l, 2, i))
         end do
      end do
   end subroutine add_sizes

   !> Add grad N_i . A . grad N_j, with A the derivative of the nominal stress by grad u at the end:
   !> docs/theory.md, eq. (11).
   pure subroutine add_tangent(n, gradient, weight, point, s, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(n_lane, 2, n), weight(n_lane)
      type(pack_point_t), intent(in) :: point
      real(wp), intent(in) :: s(n_lane, 3)                 !! stress, weighted
      real(wp), intent(inout) :: tangent(n_lane, 2, max_node, 2, max_node)
      real(wp) :: slope(n_lane, 2, 2, 2, 2)                ! A: (component, by X) twice
      real(wp) :: t(n_lane, 2, 2, 2)                       ! A . grad N_j
      integer :: a, b, c, i, j

      call nominal_tangent(point, weight, s, slope)
      do j = 1, n
         do c = 1, 2
            do b = 1, 2
               do a = 1, 2
                  t(:, a, b, c) = slope(:, a, b, c, 1)*gradient(:, 1, j) &
                     + slope(:, a, b, c, 2)*gradient(:, 2, j)
               end do
            end do
         end do
         do i = 1, n
            do c = 1, 2
               do a = 1, 2
                  tangent(:, a, i, c, j) = tangent(:, a, i, c, j) &
                     + (gradient(:, 1, i)*t(:, a, 1, c) + gradient(:, 2, i)*t(:, a, 2, c))
               end do
            end do
         end do
      end do
   end subroutine add_tangent

   !> A_aJcL = F_mid,aI D_IJKL F_end,cK + geometric S_JL delta_ac.
   pure subroutine nominal_tangent(point, weight, s, slope)
      type(pack_point_t), intent(in) :: point
      real(wp), intent(in) :: weight(n_lane), s(n_lane, 3)
      real(wp), intent(out) :: slope(n_lane, 2, 2, 2, 2)
      real(wp) :: d(n_lane, 3, 2)                          ! D_IJKL F_end,cK of one c: (IJ, L)
      integer :: a, c, v, last

      do c = 1, 2
         do v = 1, 3
            associate (law => point%law%tangent, f => point%f_end)
               d(:, v, 1) = weight*(law(:, v, 1)*f(:, c, 1) + law(:, v, 3)*f(:, c, 2))
               d(:, v, 2) = weight*(law(:, v, 3)*f(:, c, 1) + law(:, v, 2)*f(:, c, 2))
            end associate
         end do
         do last = 1, 2
            do a = 1, 2
               associate (f => point%f_mid)
                  slope(:, a, 1, c, last) = f(:, a, 1)*d(:, 1, last) + f(:, a, 2)*d(:, 3, last)
                  slope(:, a, 2, c, last) = f(:, a, 1)*d(:, 3, last) + f(:, a, 2)*d(:, 2, last)
               end associate
            end do
         end do
         slope(:, c, 1, c, 1) = slope(:, c, 1, c, 1) + point%geometric*s(:, 1)
         slope(:, c, 2, c, 1) = slope(:, c, 2, c, 1) + point%geometric*s(:, 3)
         slope(:, c, 1, c, 2) = slope(:, c, 1, c, 2) + point%geometric*s(:, 3)
         slope(:, c, 2, c, 2) = slope(:, c, 2, c, 2) + point%geometric*s(:, 2)
      end do
   end subroutine nominal_tangent

end module emcon_element_pack_plane
