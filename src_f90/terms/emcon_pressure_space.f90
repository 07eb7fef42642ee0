!> Pressure on the faces of a body of three dimensions, and how its force turns with the face.
!>
!> The nodes of a face run counter-clockwise seen from inside, so that the product of its tangents
!> points inwards. Source: docs/theory.md, eq. (11d).
module emcon_pressure_space
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : cross_product
   use emcon_shape, only : shape_table_t
   implicit none
   private
   public :: press_face, press_face_stiffness, face_area

   integer, parameter :: n_dim = 3
   !> Natural coordinates of a face.
   integer, parameter :: along = 1, across = 2

contains

   !> p int N_i x,along x x,across: exact on faces of any shape, so that a closed surface has no
   !> resultant.
   pure subroutine press_face(node, table, p, place, force)
      integer, intent(in) :: node(:)             !! (n) of the face
      type(shape_table_t), intent(in) :: table   !! of a face of so many
      real(wp), intent(in) :: p                  !! [M/(L T^2)] > 0 inwards
      real(wp), intent(in) :: place(:, :)        !! (3, n) of its nodes [L]
      real(wp), intent(inout) :: force(:, :)     !! (3, n_node) [M L/T^2]
      real(wp) :: tangent(n_dim, along:across), area(n_dim)
      integer :: i, k

      do k = 1, table%n_gp
         tangent = tangents_at(table, k, place)
         area = (p*table%weight(k))*cross_product(tangent(:, along), tangent(:, across))
         do i = 1, size(node)
            force(:, node(i)) = force(:, node(i)) + table%value(i, k)*area
         end do
      end do
   end subroutine press_face

   !> The area of a face, and its integrals of the place.
   pure subroutine face_area(table, place, size_of)
      type(shape_table_t), intent(in) :: table   !! of a face of so many
      real(wp), intent(in) :: place(:, :)        !! (3, n) of its nodes [L]
      real(wp), intent(out) :: size_of(:)        !! (1 + 3) [L^2], [L^3]
      real(wp) :: tangent(n_dim, along:across), area
      integer :: k

      size_of = 0.0_wp
      do k = 1, table%n_gp
         tangent = tangents_at(table, k, place)
         area = table%weight(k)*norm2(cross_product(tangent(:, along), tangent(:, across)))
         size_of = size_of + area*[1.0_wp, matmul(place, table%value(:, k))]
      end do
   end subroutine face_area

   !> Its derivative by the places of the nodes, with the sign of a force on the other side.
   pure subroutine press_face_stiffness(table, p, place, slot, value, side)
      type(shape_table_t), intent(in) :: table   !! of a face
      real(wp), intent(in) :: p                  !! [M/(L T^2)] times the derivative of `place`
      real(wp), intent(in) :: place(:, :)        !! (3, n) [L]
      integer, intent(in) :: slot(:, :)          !! (3 n, 3 n) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp), parameter :: axis(n_dim, n_dim) = reshape([1.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [n_dim, n_dim])
      real(wp) :: tangent(n_dim, along:across), column(n_dim)
      integer :: a, b, i, j, k, to

      do k = 1, table%n_gp
         tangent = tangents_at(table, k, place)
         do j = 1, size(place, 2)
            do b = 1, n_dim
               column = (p*table%weight(k))*cross_product(table%slope(across, j, k) &
                  *tangent(:, along) - table%slope(along, j, k)*tangent(:, across), axis(:, b))
               do i = 1, size(place, 2)
                  do a = 1, n_dim
                     to = slot(a + n_dim*(i - 1), b + n_dim*(j - 1))
                     if (to > 0) value(to) = value(to) - real(table%value(i, k)*column(a), dp)
                     if (to < 0) side(-to) = side(-to) - real(table%value(i, k)*column(a), dp)
                  end do
               end do
            end do
         end do
      end do
   end subroutine press_face_stiffness

   !> Derivatives of the place by the natural coordinates at a point; places from the first node.
   pure function tangents_at(table, k, place) result(tangent)
      type(shape_table_t), intent(in) :: table
      integer, intent(in) :: k
      real(wp), intent(in) :: place(:, :)
      real(wp) :: tangent(n_dim, along:across)
      integer :: a, i

      tangent = 0.0_wp
      do i = 1, size(place, 2)
         do a = along, across
            tangent(:, a) = tangent(:, a) + table%slope(a, i, k)*(place(:, i) - place(:, 1))
         end do
      end do
   end function tangents_at

end module emcon_pressure_space
