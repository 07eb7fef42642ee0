!> Moduli of a linear law of any symmetry as constants: the upper triangle of their matrix C.
module emcon_moduli
   use emcon_kinds, only : wp
   implicit none
   private
   public :: moduli_of, n_moduli, n_strain

   integer, parameter :: n_strain = 6, n_moduli = (n_strain*(n_strain + 1))/2

contains

   !> The matrix C of components 11, 22, 33, 12, 23, 13, by its upper triangle.
   pure function moduli_of(constant) result(c)
      real(wp), intent(in) :: constant(n_moduli)        !! column by column [M/(L T^2)]
      real(wp) :: c(n_strain, n_strain)
      integer :: i, k, n

      n = 0
      do k = 1, n_strain
         do i = 1, k
            n = n + 1
            c(i, k) = constant(n)
            c(k, i) = constant(n)
         end do
      end do
   end function moduli_of

end module emcon_moduli
