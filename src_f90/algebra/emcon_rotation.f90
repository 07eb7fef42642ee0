!> Cross products and moments in two and three dimensions.
module emcon_rotation
   use emcon_kinds, only : wp
   implicit none
   private
   public :: n_turn, cross_product, add_moments

   !> Of each axis the one behind it, and the one behind that.
   integer, parameter :: n_axis = 3
   integer, parameter :: behind(n_axis) = 1 + modulo([1, 2, 3], n_axis), &
      last(n_axis) = behind(behind)

contains

   !> Rotations: that about z in the plane, those about x, y and z in space.
   pure integer function n_turn(n_dim)
      integer, intent(in) :: n_dim               !! 2 or 3

      n_turn = n_dim*(n_dim - 1)/2
   end function n_turn

   !> a x b.
   pure function cross_product(a, b) result(c)
      real(wp), intent(in) :: a(n_axis), b(n_axis)
      real(wp) :: c(n_axis)

      c = a(behind)*b(last) - a(last)*b(behind)
   end function cross_product

   !> Add to `total` the moments about the origin of what acts at `place`; of a momentum: the
   !> angular momentum.
   pure subroutine add_moments(place, force, total)
      real(wp), intent(in) :: place(:)           !! (n_dim) [L]
      real(wp), intent(in) :: force(:)           !! (n_dim) [M L/T^2], or momentum [M L/T]
      real(wp), intent(inout) :: total(:)        !! (1 or 3) [M L^2/T^2], or [M L^2/T]
      integer :: axis, k

      do k = 1, size(total)
         axis = k + n_axis - size(total)
         total(k) = total(k) + (place(behind(axis))*force(last(axis)) &
            - place(last(axis))*force(behind(axis)))
      end do
   end subroutine add_moments

end module emcon_rotation
