!> Stress and tangent of constitutive laws in three dimensions.
!>
!> The third invariant is cubic in the strain: its discrete gradient over a step is the cofactor of
!> the mean strain and a twelfth of that of the increment, exact and isotropic. Source:
!> docs/theory.md, eq. (10a).
module emcon_law_space
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   implicit none
   private
   public :: n_strain, space_response_t, law_response_space

   integer, parameter :: n_strain = 6, n_shear = 3
   !> Components 11, 22, 33, 12, 23, 13; a strain has twice the last three.
   real(wp), parameter :: entry_of(n_strain) = [1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 0.5_wp]
   real(wp), parameter :: unit(n_strain) = [1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

   type :: space_response_t
      real(wp) :: energy = 0.0_wp                !! W at the end [M/(L T^2)]
      real(wp) :: stress(n_strain) = 0.0_wp      !! S_alg: S_alg.(E1 - E0) = W1 - W0
      real(wp) :: tangent(n_strain, n_strain) = 0.0_wp   !! derivative of S_alg by E1
   end type space_response_t

contains

   !> Response to a strain that goes from `strain` to `strain + dstrain`.
   pure subroutine law_response_space(law, strain, dstrain, response)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(n_strain), dstrain(n_strain)   !! E11, E22, E33, 2 E12, ...
      type(space_response_t), intent(out) :: response
      real(wp), dimension(n_strain) :: e0, d, mean, last
      real(wp) :: n(n_strain, 3), at_end(n_strain, 3)    ! gradients of e1, e2, e3
      type(dg_t) :: w
      integer :: i, j

      e0 = entry_of*strain
      d = entry_of*dstrain
      mean = e0 + 0.5_wp*d
      last = e0 + d
      n(:, 1) = unit
      n(:, 2) = trace(mean)*unit - mean
      n(:, 3) = 0.5_wp*cross(mean, mean) + cross(d, d)/24.0_wp
      at_end(:, 1) = unit
      at_end(:, 2) = trace(last)*unit - last
      at_end(:, 3) = 0.5_wp*cross(last, last)
      w = law%energy(dg_variable(1, trace(e0), trace(d)), &
         dg_variable(2, 0.5_wp*product_of(trace(e0)*unit - e0, e0), product_of(n(:, 2), d)), &
         dg_variable(3, product_of(cross(e0, e0), e0)/6.0_wp, product_of(n(:, 3), d)))
      response%energy = w%f1
      response%stress = matmul(n, w%g)
      response%tangent = 0.0_wp
      do j = 1, size(w%g)
         do i = 1, size(w%g)
            response%tangent = response%tangent + w%h(i, j)*outer(n(:, i), at_end(:, j))
         end do
      end do
      do j = 1, n_strain
         d = 0.0_wp
         d(j) = entry_of(j)
         response%tangent(:, j) = response%tangent(:, j) &
            + (0.5_wp*w%g(2))*(trace(d)*unit - d) &
            + w%g(3)*cross(0.5_wp*mean + (dstrain*entry_of)/12.0_wp, d)
      end do
   end subroutine law_response_space

   pure real(wp) function trace(a)
      real(wp), intent(in) :: a(n_strain)

      trace = a(1) + a(2) + a(3)
   end function trace

   !> a:b of symmetric tensors.
   pure real(wp) function product_of(a, b)
      real(wp), intent(in) :: a(n_strain), b(n_strain)

      product_of = sum(a(:n_shear)*b(:n_shear)) + 2.0_wp*sum(a(n_shear + 1:)*b(n_shear + 1:))
   end function product_of

   pure function outer(a, b) result(c)
      real(wp), intent(in) :: a(n_strain), b(n_strain)
      real(wp) :: c(n_strain, n_strain)

      c = spread(a, 2, n_strain)*spread(b, 1, n_strain)
   end function outer

   !> a x b, symmetric and bilinear, of which a x a is twice the cofactor of a.
   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(n_strain), b(n_strain)
      real(wp) :: c(n_strain)

      c = [a(2)*b(3) + a(3)*b(2) - 2.0_wp*a(5)*b(5), &
         a(1)*b(3) + a(3)*b(1) - 2.0_wp*a(6)*b(6), &
         a(1)*b(2) + a(2)*b(1) - 2.0_wp*a(4)*b(4), &
         a(6)*b(5) + a(5)*b(6) - (a(4)*b(3) + a(3)*b(4)), &
         a(4)*b(6) + a(6)*b(4) - (a(5)*b(1) + a(1)*b(5)), &
         a(4)*b(5) + a(5)*b(4) - (a(6)*b(2) + a(2)*b(6))]
   end function cross

end module emcon_law_space
