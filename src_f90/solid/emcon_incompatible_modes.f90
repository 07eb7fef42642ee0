!> Incompatible modes: what elements with nodes at their corners alone leave out of a strain, so
!> that they bend.
!>
!> A strain E at the points of an element is relaxed by the amounts of its modes that make its
!> energy least by the moduli at rest. That is a fixed linear map of E, which is quadratic in the
!> positions: energy and momenta of a step stay exact, for any law. A uniform strain has no part in
!> any mode. Source: docs/theory.md, eq. (11g).
module emcon_incompatible_modes
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_table_t
   implicit none
   private
   public :: modes_init, modes_relax, modes_return

contains

   !> The modes of an element: the gradients of xi_b**2 along each direction, with the mean gradient
   !> of xi_b in place of that at each point, orthogonal by `moduli`.
   pure subroutine modes_init(geometry, table, moduli)
      type(element_geometry_t), intent(inout) :: geometry  !! the rest of it is set
      type(shape_table_t), intent(in) :: table   !! for stiffness
      real(wp), intent(in) :: moduli(:, :)       !! (n_strain, n_strain) at rest [M/(L T^2)]
      real(wp) :: gradient(size(table%place, 1)), factor(table%n_gp), volume
      integer :: b, c, k, m, n_dim

      if (any(geometry%weight <= 0.0_wp)) return
      n_dim = size(gradient)
      allocate(geometry%mode(size(moduli, 1), n_dim*n_dim, table%n_gp), &
         geometry%dual(size(moduli, 1), n_dim*n_dim, table%n_gp))
      volume = sum(geometry%weight)
      factor = (volume/sum(table%weight))*table%weight/geometry%weight
      m = 0
      do b = 1, n_dim
         gradient = 0.0_wp
         do k = 1, table%n_gp
            gradient = gradient + (geometry%weight(k)/volume) &
               *matmul(geometry%gradient(:, :, k), table%place(b, :))
         end do
         do c = 1, n_dim
            m = m + 1
            do k = 1, table%n_gp
               geometry%mode(:, m, k) = (factor(k)*table%point(b, k))*strain_along(c, gradient)
            end do
            call make_orthogonal(geometry, moduli, m)
         end do
      end do
   end subroutine modes_init

   !> The strain of a displacement along axis `c` with the gradient `way`; behind the normal
   !> components each axis with the next one, and the first with the last.
   pure function strain_along(c, gradient) result(strain)
      integer, intent(in) :: c                   !! 1 to n_dim
      real(wp), intent(in) :: gradient(:)        !! (n_dim) [1/L]
      real(wp) :: strain((size(gradient)*(size(gradient) + 1))/2)
      integer :: column, row, s, n_dim

      n_dim = size(gradient)
      strain = 0.0_wp
      strain(c) = gradient(c)
      do s = 1, size(strain) - n_dim
         row = merge(1, s, s == n_dim)
         column = merge(s, s + 1, s == n_dim)
         if (c == row) strain(n_dim + s) = gradient(column)
         if (c == column) strain(n_dim + s) = gradient(row)
      end do
   end function strain_along

   !> Make mode `m` orthogonal to those before it, once more for what the first time has rounded;
   !> `dual` is what measures its amount.
   pure subroutine make_orthogonal(geometry, moduli, m)
      type(element_geometry_t), intent(inout) :: geometry
      real(wp), intent(in) :: moduli(:, :)       !! (n_strain, n_strain)
      integer, intent(in) :: m
      integer :: k, l, pass

      associate (mode => geometry%mode, dual => geometry%dual)
         do pass = 1, 2
            do l = 1, m - 1
               mode(:, m, :) = mode(:, m, :) - sum(dual(:, l, :)*mode(:, m, :))*mode(:, l, :)
            end do
         end do
         do k = 1, size(mode, 3)
            dual(:, m, k) = geometry%weight(k)*matmul(moduli, mode(:, m, k))
         end do
         dual(:, m, :) = dual(:, m, :)/sum(dual(:, m, :)*mode(:, m, :))
      end associate
   end subroutine make_orthogonal

   !> Take the modes out of a strain.
   pure subroutine modes_relax(geometry, strain)
      type(element_geometry_t), intent(in) :: geometry     !! with modes
      real(wp), intent(inout) :: strain(:, :)    !! (n_strain, n_gp)
      real(wp) :: amount(size(geometry%mode, 2))
      integer :: m

      do m = 1, size(amount)
         amount(m) = sum(geometry%dual(:, m, :)*strain)
      end do
      do m = 1, size(amount)
         strain = strain - amount(m)*geometry%mode(:, m, :)
      end do
   end subroutine modes_relax

   !> The transpose: the stress by which a strain works that is not relaxed, of that which is.
   pure subroutine modes_return(geometry, stress)
      type(element_geometry_t), intent(in) :: geometry     !! with modes
      real(wp), intent(inout) :: stress(:, :)    !! (n_strain, n_gp) [M/(L T^2)]
      real(wp) :: amount(size(geometry%mode, 2))
      integer :: k, m

      amount = 0.0_wp
      do k = 1, geometry%n_gp
         amount = amount + geometry%weight(k)*matmul(stress(:, k), geometry%mode(:, :, k))
      end do
      do k = 1, geometry%n_gp
         do m = 1, size(amount)
            stress(:, k) = stress(:, k) - (amount(m)/geometry%weight(k))*geometry%dual(:, m, k)
         end do
      end do
   end subroutine modes_return

end module emcon_incompatible_modes
