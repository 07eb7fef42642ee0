!> Force, tangent and strain energy of one element in the plane, over one step.
!>
!> The strain is bilinear in the positions, so with the algorithmic stress of the law the force is
!> a discrete gradient of the strain energy: f.du = W1 - W0, without net force and moment on the
!> mid-configuration. Source: docs/theory.md, eqs. (6) and (11). Strains come from grad u, never
!> from positions: a rigid offset of the scene costs no digits.
module emcon_element
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_t
   use emcon_shape, only : max_node => max_element_nodes
   implicit none
   private
   public :: element_geometry_t, element_motion_t, element_response_t, point_motion_t
   public :: element_point, element_clear, element_add_point, point_is_regular, point_strain

   !> What the reference shape of an element gives.
   type :: element_geometry_t
      integer :: n_node = 0
      integer :: n_gp = 0
      real(wp), allocatable :: gradient(:, :, :)           !! (2, n_node, n_gp) of the shape
                                                           !! functions by X [1/L]
      real(wp), allocatable :: weight(:)                   !! (n_gp) reference volume [L^3]
   end type element_geometry_t

   !> Motion of the nodes of an element, from `from` by `by`.
   type :: element_motion_t
      logical :: nlgeom = .true.                           !! .false.: small strains
      real(wp) :: from(2, max_node) = 0.0_wp               !! displacement at the start [L]
      real(wp) :: by(2, max_node) = 0.0_wp                 !! displacement over the span [L]
   end type element_motion_t

   !> Motion of one quadrature point; without NLGEOM deformation gradients are the identity.
   type :: point_motion_t
      real(wp) :: strain(3) = 0.0_wp                       !! at the start: E11, E22, 2 E12
      real(wp) :: dstrain(3) = 0.0_wp                      !! its increment E1 - E0
      real(wp) :: f_mid(2, 2) = 0.0_wp                     !! of the mid-configuration
      real(wp) :: f_end(2, 2) = 0.0_wp                     !! of the end
      real(wp) :: geometric = 0.0_wp                       !! df_mid/df_end: 1/2 or 0
   end type point_motion_t

   type :: element_response_t
      real(wp) :: energy = 0.0_wp                          !! strain energy at the end
      real(wp) :: force(2, max_node) = 0.0_wp
      real(wp) :: magnitude(2, max_node) = 0.0_wp          !! sum of |contributions| to `force`
      real(wp) :: tangent(2*max_node, 2*max_node) = 0.0_wp !! derivative of `force` by u1
      !> det F <= 0 at some point at the end, or a strain that the law has no energy for.
      logical :: is_inverted = .false.
   end type element_response_t

contains

   !> The motion of quadrature point `k`.
   pure subroutine element_point(geometry, k, motion, point)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k                   !! 1 to n_gp
      type(element_motion_t), intent(in) :: motion
      type(point_motion_t), intent(inout) :: point       !! all of it is set
      real(wp) :: grad0(2, 2), dgrad(2, 2)

      call displacement_gradient(geometry%n_node, geometry%gradient(:, :, k), motion%from, grad0)
      call displacement_gradient(geometry%n_node, geometry%gradient(:, :, k), motion%by, dgrad)
      call point_strain(grad0, dgrad, motion%nlgeom, point)
   end subroutine element_point

   !> Nothing, before points are added.
   pure subroutine element_clear(n, response, with_tangent)
      integer, intent(in) :: n                   !! nodes of the element
      type(element_response_t), intent(inout) :: response
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is

      response%energy = 0.0_wp
      response%force(:, :n) = 0.0_wp
      response%magnitude(:, :n) = 0.0_wp
      if (with_tangent) response%tangent(:2*n, :2*n) = 0.0_wp
      response%is_inverted = .false.
   end subroutine element_clear

   !> Add what point `k` gives; `state` leaves with the weight of the point.
   pure subroutine element_add_point(geometry, k, point, state, with_tangent, response)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k                   !! 1 to n_gp
      type(point_motion_t), intent(in) :: point
      type(law_response_t), intent(inout) :: state       !! what the law answers to `point`
      logical, intent(in) :: with_tangent        !! else no tangent is added
      type(element_response_t), intent(inout) :: response
      real(wp) :: nominal(2, 2)
      integer :: n

      n = geometry%n_node
      response%energy = response%energy + geometry%weight(k)*state%energy
      state%stress = geometry%weight(k)*state%stress
      nominal(:, 1) = point%f_mid(:, 1)*state%stress(1) + point%f_mid(:, 2)*state%stress(3)
      nominal(:, 2) = point%f_mid(:, 1)*state%stress(3) + point%f_mid(:, 2)*state%stress(2)
      call add_force(n, geometry%gradient(:, :, k), nominal, response%force, response%magnitude)
      if (with_tangent) then
         state%tangent = geometry%weight(k)*state%tangent
         call add_tangent(n, geometry%gradient(:, :, k), point, state, response%tangent)
      end if
   end subroutine element_add_point

   !> Add nominal stress times the gradients of the shape functions.
   pure subroutine add_force(n, gradient, nominal, force, magnitude)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(2, n), nominal(2, 2)
      real(wp), intent(inout) :: force(2, n), magnitude(2, n)
      real(wp) :: part(2)
      integer :: i

      do i = 1, n
         part = nominal(:, 1)*gradient(1, i) + nominal(:, 2)*gradient(2, i)
         force(:, i) = force(:, i) + part
         magnitude(:, i) = magnitude(:, i) + abs(part)
      end do
   end subroutine add_force

   !> Is the end of the motion one that the law can answer to? Newton's method tries all kinds of
   !> things.
   pure logical function point_is_regular(point, has_volume) result(is_regular)
      type(point_motion_t), intent(in) :: point
      logical, intent(in) :: has_volume                    !! as in law_t
      real(wp), parameter :: largest = huge(1.0_wp)**0.2_wp   ! its powers in energies are finite
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: strain(3), volume, terms

      strain = point%strain + point%dstrain
      associate (f => point%f_end)
         is_regular = maxval(abs(f)) < largest .and. maxval(abs(strain)) < largest
         if (.not. is_regular) return
         is_regular = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1) > 0.0_wp
      end associate
      if (.not. (is_regular .and. has_volume)) return
      terms = (1.0_wp + 2.0_wp*abs(strain(1)))*(1.0_wp + 2.0_wp*abs(strain(2))) + strain(3)**2
      volume = (1.0_wp + 2.0_wp*strain(1))*(1.0_wp + 2.0_wp*strain(2)) - strain(3)**2
      is_regular = volume > noise*terms          ! det C, where it is more than round-off
   end function point_is_regular

   !> grad(a, b) = d u_a / d X_b.
   pure subroutine displacement_gradient(n, gradient, u, grad)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(2, n), u(2, n)
      real(wp), intent(out) :: grad(2, 2)
      integer :: i

      grad = 0.0_wp
      do i = 1, n
         grad(:, 1) = grad(:, 1) + u(:, i)*gradient(1, i)
         grad(:, 2) = grad(:, 2) + u(:, i)*gradient(2, i)
      end do
   end subroutine displacement_gradient

   !> Strain and deformation gradients from those of the displacement at the start, `grad0`, and
   !> of its increment; the strain's increment to relative accuracy: docs/theory.md, eq. (6).
   pure subroutine point_strain(grad0, dgrad, nlgeom, point)
      real(wp), intent(in) :: grad0(2, 2), dgrad(2, 2)   !! (component, by X)
      logical, intent(in) :: nlgeom              !! .false.: small strains
      type(point_motion_t), intent(inout) :: point

      point%strain = [grad0(1, 1), grad0(2, 2), grad0(1, 2) + grad0(2, 1)]
      point%f_mid = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      point%f_end = point%f_mid
      if (nlgeom) then
         point%strain = point%strain + [0.5_wp*dot_product(grad0(:, 1), grad0(:, 1)), &
            0.5_wp*dot_product(grad0(:, 2), grad0(:, 2)), dot_product(grad0(:, 1), grad0(:, 2))]
         point%f_mid = point%f_mid + (grad0 + 0.5_wp*dgrad)
         point%f_end = point%f_end + (grad0 + dgrad)
      end if
      point%geometric = merge(0.5_wp, 0.0_wp, nlgeom)
      associate (f => point%f_mid)
         point%dstrain = [dot_product(f(:, 1), dgrad(:, 1)), dot_product(f(:, 2), dgrad(:, 2)), &
            dot_product(f(:, 1), dgrad(:, 2)) + dot_product(f(:, 2), dgrad(:, 1))]
      end associate
   end subroutine point_strain

   !> Add B(mid)^T D B(end) + geometric (grad N_i . S grad N_j) I; stress and tangent are weighted:
   !> docs/theory.md, eq. (11).
   pure subroutine add_tangent(n, gradient, point, state, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: gradient(2, n)
      type(point_motion_t), intent(in) :: point
      type(law_response_t), intent(in) :: state
      real(wp), intent(inout) :: tangent(2*max_node, 2*max_node)
      real(wp) :: b_mid(2*max_node, 3), b_end(3), db(3), stress_gradient(2), geometric
      integer :: i, j, a

      do i = 1, n
         call strain_operator(gradient(:, i), point%f_mid, 1, b_mid(2*i - 1, :))
         call strain_operator(gradient(:, i), point%f_mid, 2, b_mid(2*i, :))
      end do
      do j = 1, n
         do a = 1, 2
            call strain_operator(gradient(:, j), point%f_end, a, b_end)
            db = state%tangent(:, 1)*b_end(1) + state%tangent(:, 2)*b_end(2) &
               + state%tangent(:, 3)*b_end(3)
            do i = 1, 2*n
               tangent(i, 2*j - 2 + a) = tangent(i, 2*j - 2 + a) &
                  + (b_mid(i, 1)*db(1) + b_mid(i, 2)*db(2) + b_mid(i, 3)*db(3))
            end do
         end do
         stress_gradient = point%geometric*[ &
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
