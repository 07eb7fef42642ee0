!> The faces of elements as surfaces see them: facets, with the body behind them.
!>
!> In the plane a facet is a straight edge between two nodes, the body to its left. In space it is a
!> face with all nodes of its rim, those between the corners too, counter-clockwise from outside.
module emcon_face_facets
   use emcon_element_kind, only : element_row_t
   implicit none
   private
   public :: face_facets, n_face_facet, n_facet_node

contains

   !> Facets that each face is: in the plane one more with each node between its ends.
   elemental integer function n_face_facet(kind)
      class(element_row_t), intent(in) :: kind

      n_face_facet = merge(kind%n_face_node - 1, 1, kind%n_dim == 2)
   end function n_face_facet

   !> Nodes of such a facet.
   elemental integer function n_facet_node(kind)
      class(element_row_t), intent(in) :: kind

      n_facet_node = merge(2, kind%n_face_node, kind%n_dim == 2)
   end function n_facet_node

   !> Their local nodes, facet by facet along the face.
   pure function face_facets(kind, i) result(facet)
      class(element_row_t), intent(in) :: kind
      integer, intent(in) :: i                   !! face, 1 to n_face
      integer :: facet(n_facet_node(kind), n_face_facet(kind))
      integer :: node(kind%n_face_node), path(kind%n_face_node), k

      node = kind%face(i)                        ! corners, then those between them
      if (kind%n_dim == 2) then
         associate (n => size(node))
            path = node([1, (k, k = 3, n), 2])
            facet = reshape([(path(k:k + 1), k = 1, n - 1)], shape(facet))
         end associate
         return
      end if
      path = node
      if (kind%n_node > kind%n_corner) then
         associate (n_corner => size(node)/2)
            path(1::2) = node(:n_corner)
            path(2::2) = node(n_corner + 1:)
         end associate
      end if
      facet(:, 1) = [path(1), path(size(path):2:-1)]   ! faces run the other way, seen from outside
   end function face_facets

end module emcon_face_facets
