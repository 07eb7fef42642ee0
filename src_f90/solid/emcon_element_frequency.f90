!> How fast an element may vibrate by itself, its mass at its nodes.
!> Source: docs/theory.md, section 13.
module emcon_element_frequency
   use emcon_kinds, only : wp
   implicit none
   private
   public :: element_frequency

   !> The trace of S^(2^n) bounds the largest eigenvalue of S to a factor m^(2^-n), m its
   !> multiplicity: 1.03 for all of eight.
   integer, parameter :: n_square = 6

contains

   !> An upper bound of the square of the frequencies of K u = w^2 M u, as tight as that, and none
   !> where a mass is missing.
   pure real(wp) function element_frequency(stiffness, mass) result(square)
      real(wp), intent(in) :: stiffness(:, :)    !! (n_dim*n, n_dim*n) node by node [M/T^2]
      real(wp), intent(in) :: mass(:)            !! (n) [M]
      real(wp) :: s(size(stiffness, 1), size(stiffness, 1)), root(size(stiffness, 1))
      real(wp) :: length(0:n_square)
      integer :: i, k, n_dim

      square = huge(1.0_wp)
      if (.not. all(mass > 0.0_wp)) return
      n_dim = size(stiffness, 1)/size(mass)
      do i = 1, size(mass)
         root(n_dim*(i - 1) + 1:n_dim*i) = sqrt(mass(i))
      end do
      do i = 1, size(root)
         s(:, i) = 0.5_wp*(stiffness(:, i) + stiffness(i, :))/(root*root(i))
      end do
      do k = 0, n_square
         if (k > 0) s = matmul(s, s)
         length(k) = norm2(s)
         if (.not. length(k) > 0.0_wp) then
            square = 0.0_wp
            return
         end if
         s = s/length(k)
      end do
      square = 1.0_wp
      do k = n_square, 1, -1
         square = sqrt(length(k)*square)
      end do
      square = length(0)*square
   end function element_frequency

end module emcon_element_frequency
