!> One element in the plane over one step: its shape, its motion and the strains at its points.
!>
!> Source: docs/theory.md, eq. (6). Strains come from grad u, never from positions: a rigid offset
!> of the scene costs no digits. Forces and tangents: emcon_pack_points_plane.
module emcon_element_plane
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   use emcon_shape, only : max_node => max_plane_nodes
   implicit none
   private
   public :: element_motion_t, element_response_t, point_motion_t
   public :: element_point, point_is_regular, point_strain, reference_gradient

   !> Motion of the nodes of an element, from `from` by `by`.
   type :: element_motion_t
      real(wp) :: square = 1.0_wp                          !! part of squares; 0: small strains
      real(wp) :: from(2, max_node) = 0.0_wp               !! displacement at the start [L]
      real(wp) :: by(2, max_node) = 0.0_wp                 !! displacement over the span [L]
   end type element_motion_t

   !> Motion of one quadrature point; of small strains deformation gradients are the identity.
   type :: point_motion_t
      real(wp) :: strain(3) = 0.0_wp                       !! at the start: E11, E22, 2 E12
      real(wp) :: dstrain(3) = 0.0_wp                      !! its increment E1 - E0
      real(wp) :: f_mid(2, 2) = 0.0_wp                     !! of the mid-configuration
      real(wp) :: f_end(2, 2) = 0.0_wp                     !! of the end
      real(wp) :: geometric = 0.0_wp                       !! df_mid/df_end: 1/2, small strains 0
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

   !> Gradient of the shape functions by X and the Jacobian determinant.
   pure subroutine reference_gradient(n, x, slope, gradient, det)
      integer, intent(in) :: n                   !! nodes
      real(wp), intent(in) :: x(2, n)            !! [L]
      real(wp), intent(in) :: slope(2, n)        !! of the shape functions by natural coordinates
      real(wp), intent(out) :: gradient(2, n)    !! of them by X [1/L]; 0 where `det` is
      real(wp), intent(out) :: det               !! area over natural area [L^2]
      real(wp) :: jacobian(2, 2)
      integer :: i

      jacobian = 0.0_wp
      do i = 1, n
         jacobian(:, 1) = jacobian(:, 1) + x(:, i)*slope(1, i)
         jacobian(:, 2) = jacobian(:, 2) + x(:, i)*slope(2, i)
      end do
      det = jacobian(1, 1)*jacobian(2, 2) - jacobian(1, 2)*jacobian(2, 1)
      gradient = 0.0_wp
      if (.not. abs(det) > 0.0_wp) return
      do i = 1, n
         gradient(1, i) = (jacobian(2, 2)*slope(1, i) - jacobian(2, 1)*slope(2, i))/det
         gradient(2, i) = (jacobian(1, 1)*slope(2, i) - jacobian(1, 2)*slope(1, i))/det
      end do
   end subroutine reference_gradient

   !> The motion of quadrature point `k`.
   pure subroutine element_point(geometry, k, motion, point)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k                   !! 1 to n_gp
      type(element_motion_t), intent(in) :: motion
      type(point_motion_t), intent(inout) :: point       !! all of it is set
      real(wp) :: grad0(2, 2), dgrad(2, 2)

      call displacement_gradient(geometry%n_node, geometry%gradient(:, :, k), motion%from, grad0)
      call displacement_gradient(geometry%n_node, geometry%gradient(:, :, k), motion%by, dgrad)
      call point_strain(grad0, dgrad, motion%square, point)
   end subroutine element_point

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
   pure subroutine point_strain(grad0, dgrad, square, point)
      real(wp), intent(in) :: grad0(2, 2), dgrad(2, 2)   !! (component, by X)
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      type(point_motion_t), intent(inout) :: point
      real(wp), parameter :: one(2, 2) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])

      point%strain = [grad0(1, 1), grad0(2, 2), grad0(1, 2) + grad0(2, 1)] &
         + square*[0.5_wp*dot_product(grad0(:, 1), grad0(:, 1)), &
         0.5_wp*dot_product(grad0(:, 2), grad0(:, 2)), dot_product(grad0(:, 1), grad0(:, 2))]
      point%f_mid = one + square*(grad0 + 0.5_wp*dgrad)
      point%f_end = one + square*(grad0 + dgrad)
      point%geometric = 0.5_wp*square
      associate (f => point%f_mid)
         point%dstrain = [dot_product(f(:, 1), dgrad(:, 1)), dot_product(f(:, 2), dgrad(:, 2)), &
            dot_product(f(:, 1), dgrad(:, 2)) + dot_product(f(:, 2), dgrad(:, 1))]
      end associate
   end subroutine point_strain

end module emcon_element_plane
