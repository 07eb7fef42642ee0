! build: lanes
!> Force, tangent and strain energy of elements in space side by side, at a point over one step.
!>
!> The strain is bilinear in the positions, so with the algorithmic stress of the law the force is
!> a discrete gradient of the strain energy: f.du = W1 - W0, without net force and moment on the
!> mid-configuration. Source: docs/theory.md, eqs. (6) and (11). Strains come from grad u, never
!> from positions: a rigid offset of the scene costs no digits.
module emcon_pack_points_space
   use emcon_element_pack, only : pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   use emcon_law_points_space, only : points_t => law_points_space_t
   use emcon_stretch_sums_space, only : column, n_strain, row
   implicit none
   private

   integer, parameter :: n_dim = 3
   integer, parameter :: place(n_dim, n_dim) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], [n_dim, n_dim])
   real(wp), parameter :: largest = huge(1.0_wp)**0.1_wp   ! its powers in energies are finite

   public :: pack_gradient

   include "emcon_pack_points.inc"

   !> Gradients of the functions of the nodes at a point, as `reference_gradient` of
   !> emcon_element_space finds them, to the same bits.
   pure subroutine pack_gradient(n, x, slope, gradient)
      integer, intent(in) :: n                             !! nodes of each element
      real(wp), intent(in) :: x(n_lane, n_dim, n)          !! from the first of each [L]
      real(wp), intent(in) :: slope(n_dim, n)              !! by natural coordinates
      real(wp), intent(out) :: gradient(n_lane, n_dim, n)  !! by X [1/L]
      real(wp), dimension(n_lane, n_dim, n_dim) :: j, c    ! (component, by natural coordinates)
      real(wp) :: by_volume(n_lane)
      integer :: a, b, i, l

      j = 0.0_wp
      do i = 2, n
         do a = 1, n_dim
            do b = 1, n_dim
               !$omp simd
               do l = 1, n_lane
                  j(l, b, a) = j(l, b, a) + x(l, b, i)*slope(a, i)
               end do
            end do
         end do
      end do
      call find_cofactor(j(:, :, 2), j(:, :, 3), c(:, :, 1))
      call find_cofactor(j(:, :, 3), j(:, :, 1), c(:, :, 2))
      call find_cofactor(j(:, :, 1), j(:, :, 2), c(:, :, 3))
      !$omp simd
      do l = 1, n_lane
         by_volume(l) = 1.0_wp/(j(l, 1, 1)*c(l, 1, 1) + j(l, 2, 1)*c(l, 2, 1) &
            + j(l, 3, 1)*c(l, 3, 1))
      end do
      do a = 1, n_dim
         do b = 1, n_dim
            c(:, b, a) = c(:, b, a)*by_volume
         end do
      end do
      do i = 1, n
         do b = 1, n_dim
            !$omp simd
            do l = 1, n_lane
               gradient(l, b, i) = c(l, b, 1)*slope(1, i) + c(l, b, 2)*slope(2, i) &
                  + c(l, b, 3)*slope(3, i)
            end do
         end do
      end do
   end subroutine pack_gradient

   !> Products of two vectors in each lane.
   pure subroutine find_cofactor(a, b, c)
      real(wp), intent(in) :: a(n_lane, n_dim), b(n_lane, n_dim)
      real(wp), intent(out) :: c(n_lane, n_dim)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         c(l, 1) = a(l, 2)*b(l, 3) - a(l, 3)*b(l, 2)
         c(l, 2) = a(l, 3)*b(l, 1) - a(l, 1)*b(l, 3)
         c(l, 3) = a(l, 1)*b(l, 2) - a(l, 2)*b(l, 1)
      end do
   end subroutine find_cofactor

   pure subroutine find_determinant(f, det)
      real(wp), intent(in) :: f(n_lane, n_dim, n_dim)
      real(wp), intent(out) :: det(n_lane)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         det(l) = f(l, 1, 1)*(f(l, 2, 2)*f(l, 3, 3) - f(l, 3, 2)*f(l, 2, 3)) &
            + f(l, 2, 1)*(f(l, 3, 2)*f(l, 1, 3) - f(l, 1, 2)*f(l, 3, 3)) &
            + f(l, 3, 1)*(f(l, 1, 2)*f(l, 2, 3) - f(l, 2, 2)*f(l, 1, 3))
      end do
   end subroutine find_determinant

   !> Besides det F the leading minors of C, det C where it is more than round-off.
   pure subroutine compare_volume(strain, det)
      real(wp), intent(in) :: strain(n_lane, n_strain)
      real(wp), intent(inout) :: det(n_lane)     !! the smallest; not above 0 where that is so
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: c(n_lane, n_strain), volume, terms
      integer :: l, v

      do v = 1, n_strain
         c(:, v) = merge(strain(:, v), 0.0_wp, det > 0.0_wp)
         if (row(v) == column(v)) c(:, v) = 1.0_wp + 2.0_wp*c(:, v)
      end do
      !$omp simd private(volume, terms)
      do l = 1, n_lane
         volume = c(l, 1)*(c(l, 2)*c(l, 3) - c(l, 5)*c(l, 5)) &
            + c(l, 4)*(c(l, 5)*c(l, 6) - c(l, 4)*c(l, 3)) &
            + c(l, 6)*(c(l, 4)*c(l, 5) - c(l, 2)*c(l, 6))
         terms = (abs(c(l, 1)) + abs(c(l, 4)) + abs(c(l, 6))) &
            *(abs(c(l, 4)) + abs(c(l, 2)) + abs(c(l, 5))) &
            *(abs(c(l, 6)) + abs(c(l, 5)) + abs(c(l, 3)))
         det(l) = min(det(l), volume - noise*terms, c(l, 1), c(l, 1)*c(l, 2) - c(l, 4)*c(l, 4))
      end do
   end subroutine compare_volume

end module emcon_pack_points_space
