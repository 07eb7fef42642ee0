!> The faces of plane elements as surfaces see them: straight edges between their nodes.
module emcon_face_edges_plane
   use emcon_element_kind, only : element_row_t
   implicit none
   private
   public :: n_face_edge, face_edges

contains

   !> Edges that each face is: one more with each node between its ends.
   elemental integer function n_face_edge(kind)
      class(element_row_t), intent(in) :: kind

      n_face_edge = kind%n_face_node - 1
   end function n_face_edge

   !> Their first and last local nodes, along the face.
   pure function face_edges(kind, i) result(edge)
      class(element_row_t), intent(in) :: kind
      integer, intent(in) :: i                   !! face, 1 to n_face
      integer :: edge(2, kind%n_face_node - 1)
      integer :: way(kind%n_face_node), node(kind%n_face_node)

      node = kind%face(i)
      way(1) = node(1)
      way(2:size(way) - 1) = node(3:)
      way(size(way)) = node(2)
      edge(1, :) = way(:size(way) - 1)
      edge(2, :) = way(2:)
   end function face_edges

end module emcon_face_edges_plane
