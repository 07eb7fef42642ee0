!> Force, tangent and strain energy of one element in the plane, over one step.
!>
!> The strain is bilinear in the positions, so with the algorithmic stress of the law the force is
!> a discrete gradient of the strain energy: f.du = W1 - W0, without net force and moment on the
!> mid-configuration. Source: docs/theory.md, eqs. (6) and (11). Strains come from grad u, never
!> from positions: a rigid offset of the scene costs no digits.
module emcon_element
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   implicit none
   private
   public :: element_geometry_t, element_response_t, element_respond, element_strain
   public :: element_point_strain, element_respond_known

   integer, parameter :: max_node = 4, max_gp = 4

   !> What the reference shape of an element gives.
   type :: element_geometry_t
      integer :: n_node = 0
      integer :: n_gp = 0
      real(wp) :: gradient(2, max_node, max_gp) = 0.0_wp   !! of the shape functions by X [1/L]
      real(wp) :: weight(max_gp) = 0.0_wp                  !! reference volume of the point [L^3]
   end type element_geometry_t

   type :: element_response_t
      real(wp) :: energy = 0.0_wp                          !! strain energy at the end
      real(wp) :: force(2, max_node) = 0.0_wp
      real(wp) :: magnitude(2, max_node) = 0.0_wp          !! sum of |contributions| to `force`
      real(wp) :: tangent(2*max_node, 2*max_node) = 0.0_wp !! derivative of `force` by u1
      !> det F <= 0 at some point at the end, or a strain that the law has no energy for.
      logical :: is_inverted = .false.
   end type element_response_t

contains

   !> The element moves from `u0` to `u0 + du`.
   pure subroutine element_respond(geometry, law, u0, du, nlgeom, with_tangent, response)
      type(element_geometry_t), intent(in) :: geometry
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: u0(2, max_node), du(2, max_node)   !! [L]
      logical, intent(in) :: nlgeom              !! .false.: small strains
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(element_response_t), intent(inout) :: response
      type(law_response_t) :: state
      real(wp) :: grad0(2, 2), dgrad(2, 2), f_mid(2, 2), f_end(2, 2), strain(3), dstrain(3)
      integer :: k

      call clear(response, with_tangent)
      do k = 1, geometry%n_gp
         call displacement_gradient(geometry, k, u0, grad0)
         call displacement_gradient(geometry, k, du, dgrad)
         call element_strain(grad0, dgrad, nlgeom, strain, dstrain, f_mid, f_end)
         response%is_inverted = .not. is_regular(law%has_volume, strain + dstrain, f_end)
         if (response%is_inverted) return
         call law_response_plane(law, strain, dstrain, state)
         call add_point(geometry, k, f_mid, f_end, nlgeom, with_tangent, state, response)
      end do
   end subroutine element_respond

   !> Strain and its increment at point `k` of an element that moves from `u0` to `u0 + du`.
   pure subroutine element_point_strain(geometry, k, u0, du, nlgeom, strain, dstrain, is_inverted)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k                   !! 1 to n_gp
      real(wp), intent(in) :: u0(2, max_node), du(2, max_node)   !! [L]
      logical, intent(in) :: nlgeom              !! .false.: small strains
      real(wp), intent(out) :: strain(3), dstrain(3)       !! E11, E22, 2 E12
      logical, intent(out) :: is_inverted                  !! at the end
      real(wp) :: grad0(2, 2), dgrad(2, 2), f_mid(2, 2), f_end(2, 2)

      call displacement_gradient(geometry, k, u0, grad0)
      call displacement_gradient(geometry, k, du, dgrad)
      call element_strain(grad0, dgrad, nlgeom, strain, dstrain, f_mid, f_end)
      is_inverted = .not. is_regular(.false., strain + dstrain, f_end)
   end subroutine element_point_strain

   !> As `element_respond`, with the response of the law at all points known.
   pure subroutine element_respond_known(geometry, state, u0, du, nlgeom, with_tangent, response)
      type(element_geometry_t), intent(in) :: geometry
      type(law_response_t), intent(in) :: state(:)         !! (n_gp)
      real(wp), intent(in) :: u0(2, max_node), du(2, max_node)   !! [L]
      logical, intent(in) :: nlgeom              !! .false.: small strains
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(element_response_t), intent(inout) :: response
      type(law_response_t) :: weighted
      real(wp) :: grad0(2, 2), dgrad(2, 2), f_mid(2, 2), f_end(2, 2), strain(3), dstrain(3)
      integer :: k

      call clear(response, with_tangent)
      do k = 1, geometry%n_gp
         call displacement_gradient(geometry, k, u0, grad0)
         call displacement_gradient(geometry, k, du, dgrad)
         call element_strain(grad0, dgrad, nlgeom, strain, dstrain, f_mid, f_end)
         weighted = state(k)
         call add_point(geometry, k, f_mid, f_end, nlgeom, with_tangent, weighted, response)
      end do
   end subroutine element_respond_known

   pure subroutine clear(response, with_tangent)
      type(element_response_t), intent(inout) :: response
      logical, intent(in) :: with_tangent

      response%energy = 0.0_wp
      response%force = 0.0_wp
      response%magnitude = 0.0_wp
      if (with_tangent) response%tangent = 0.0_wp
      response%is_inverted = .false.
   end subroutine clear

   !> Add what point `k` gives; `state` leaves with the weight of the point.
   pure subroutine add_point(geometry, k, f_mid, f_end, nlgeom, with_tangent, state, response)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k
      real(wp), intent(in) :: f_mid(2, 2), f_end(2, 2)
      logical, intent(in) :: nlgeom, with_tangent
      type(law_response_t), intent(inout) :: state
      type(element_response_t), intent(inout) :: response
      real(wp) :: nominal(2, 2), part(2)
      integer :: n, i

      n = geometry%n_node
      response%energy = response%energy + geometry%weight(k)*state%energy
      state%stress = geometry%weight(k)*state%stress
      nominal(:, 1) = f_mid(:, 1)*state%stress(1) + f_mid(:, 2)*state%stress(3)
      nominal(:, 2) = f_mid(:, 1)*state%stress(3) + f_mid(:, 2)*state%stress(2)
      do i = 1, n
         part = nominal(:, 1)*geometry%gradient(1, i, k) &
            + nominal(:, 2)*geometry%gradient(2, i, k)
         response%force(:, i) = response%force(:, i) + part
         response%magnitude(:, i) = response%magnitude(:, i) + abs(part)
      end do
      if (with_tangent) then
         state%tangent = geometry%weight(k)*state%tangent
         call add_tangent(n, geometry%gradient(:, :, k), f_mid, f_end, state, &
            merge(0.5_wp, 0.0_wp, nlgeom), response%tangent)
      end if
   end subroutine add_point

   !> Is the end state one that the law can answer to? Newton's method tries all kinds of things.
   pure logical function is_regular(has_volume, strain, f)
      logical, intent(in) :: has_volume                    !! as in law_t
      real(wp), intent(in) :: strain(3), f(2, 2)
      real(wp), parameter :: largest = huge(1.0_wp)**0.2_wp   ! its powers in energies are finite
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: volume, terms

      is_regular = maxval(abs(f)) < largest .and. maxval(abs(strain)) < largest
      if (.not. is_regular) return
      is_regular = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1) > 0.0_wp
      if (.not. (is_regular .and. has_volume)) return
      terms = (1.0_wp + 2.0_wp*abs(strain(1)))*(1.0_wp + 2.0_wp*abs(strain(2))) + strain(3)**2
      volume = (1.0_wp + 2.0_wp*strain(1))*(1.0_wp + 2.0_wp*strain(2)) - strain(3)**2
      is_regular = volume > noise*terms          ! det C, where it is more than round-off
   end function is_regular

   !> grad(a, b) = d u_a / d X_b at quadrature point `k`.
   pure subroutine displacement_gradient(geometry, k, u, grad)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k
      real(wp), intent(in) :: u(2, max_node)
      real(wp), intent(out) :: grad(2, 2)
      integer :: i

      grad = 0.0_wp
      do i = 1, geometry%n_node
         grad(:, 1) = grad(:, 1) + u(:, i)*geometry%gradient(1, i, k)
         grad(:, 2) = grad(:, 2) + u(:, i)*geometry%gradient(2, i, k)
      end do
   end subroutine displacement_gradient

   !> Strain (E11, E22, 2 E12) at the start, its increment E1 - E0 to relative accuracy, and the
   !> deformation gradients of the mid and the end configuration (identity without `nlgeom`):
   !> docs/theory.md, eq. (6).
   pure subroutine element_strain(grad0, dgrad, nlgeom, strain, dstrain, f_mid, f_end)
      real(wp), intent(in) :: grad0(2, 2), dgrad(2, 2)   !! (component, by X)
      logical, intent(in) :: nlgeom              !! .false.: small strains
      real(wp), intent(out) :: strain(3), dstrain(3)   !! E11, E22, 2 E12
      real(wp), intent(out) :: f_mid(2, 2), f_end(2, 2)   !! (component, by X)

      strain = [grad0(1, 1), grad0(2, 2), grad0(1, 2) + grad0(2, 1)]
      f_mid = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      f_end = f_mid
      if (nlgeom) then
         strain = strain + [0.5_wp*dot_product(grad0(:, 1), grad0(:, 1)), &
            0.5_wp*dot_product(grad0(:, 2), grad0(:, 2)), dot_product(grad0(:, 1), grad0(:, 2))]
         f_mid = f_mid + (grad0 + 0.5_wp*dgrad)
         f_end = f_end + (grad0 + dgrad)
      end if
      dstrain = [dot_product(f_mid(:, 1), dgrad(:, 1)), dot_product(f_mid(:, 2), dgrad(:, 2)), &
         dot_product(f_mid(:, 1), dgrad(:, 2)) + dot_product(f_mid(:, 2), dgrad(:, 1))]
   end subroutine element_strain

   !> Add B(mid)^T D B(end) + factor (grad N_i . S grad N_j) I; stress and tangent are weighted:
   !> docs/theory.md, eq. (11).
   pure subroutine add_tangent(n, gradient, f_mid, f_end, state, factor, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(2, max_node), f_mid(2, 2), f_end(2, 2)
      type(law_response_t), intent(in) :: state
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: tangent(2*max_node, 2*max_node)
      real(wp) :: b_mid(3, 2*max_node), b_end(3), db(3), stress_gradient(2), geometric
      integer :: i, j, a

      do i = 1, n
         call strain_operator(gradient(:, i), f_mid, 1, b_mid(:, 2*i - 1))
         call strain_operator(gradient(:, i), f_mid, 2, b_mid(:, 2*i))
      end do
      do j = 1, n
         do a = 1, 2
            call strain_operator(gradient(:, j), f_end, a, b_end)
            db = state%tangent(:, 1)*b_end(1) + state%tangent(:, 2)*b_end(2) &
               + state%tangent(:, 3)*b_end(3)
            do i = 1, 2*n
               tangent(i, 2*j - 2 + a) = tangent(i, 2*j - 2 + a) &
                  + (b_mid(1, i)*db(1) + b_mid(2, i)*db(2) + b_mid(3, i)*db(3))
            end do
         end do
         stress_gradient = factor*[ &
            state%stress(1)*gradient(1, j) + state%stress(3)*gradient(2, j), &
            state%stress(3)*gradient(1, j) + state%stress(2)*gradient(2, j)]
         do i = 1, n
            geometric = gradient(1, i)*stress_gradient(1) + gradient(2, i)*stress_gradient(2)
            tangent(2*i - 1, 2*j - 1) = tangent(2*i - 1, 2*j - 1) + geometric
            tangent(2*i, 2*j) = tangent(2*i, 2*j) + geometric
         end do
      end do
   end subroutine add_tangent

   !> Derivative of (E11, E22, 2 E12) by component `a` of the displacement of a node.
   pure subroutine strain_operator(gradient, f, a, b)
      real(wp), intent(in) :: gradient(2), f(2, 2)
      integer, intent(in) :: a
      real(wp), intent(out) :: b(3)

      b(1) = f(a, 1)*gradient(1)
      b(2) = f(a, 2)*gradient(2)
      b(3) = f(a, 1)*gradient(2) + f(a, 2)*gradient(1)
   end subroutine strain_operator

end module emcon_element
