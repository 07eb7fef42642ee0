! build: lanes
!> Force, tangent and strain energy of elements in the plane side by side, at a point over one step.
!>
!> The strain is bilinear in the positions, so with the algorithmic stress of the law the force is
!> a discrete gradient of the strain energy: f.du = W1 - W0, without net force and moment on the
!> mid-configuration. Source: docs/theory.md, eqs. (6) and (11). Strains come from grad u, never
!> from positions: a rigid offset of the scene costs no digits.
module emcon_pack_points_plane
   use emcon_element_pack, only : pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane, points_t => law_points_t
   implicit none
   private

   integer, parameter :: n_dim = 2, n_strain = 3
   integer, parameter :: row(n_strain) = [1, 2, 1], column(n_strain) = [1, 2, 2]
   integer, parameter :: place(n_dim, n_dim) = reshape([1, 3, 3, 2], [n_dim, n_dim])
   real(wp), parameter :: largest = huge(1.0_wp)**0.2_wp   ! its powers in energies are finite

   include "emcon_pack_points.inc"

   pure subroutine find_determinant(f, det)
      real(wp), intent(in) :: f(n_lane, n_dim, n_dim)
      real(wp), intent(out) :: det(n_lane)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         det(l) = f(l, 1, 1)*f(l, 2, 2) - f(l, 1, 2)*f(l, 2, 1)
      end do
   end subroutine find_determinant

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

end module emcon_pack_points_plane
