!> What a scene has to know of an element kind: its name, its nodes, its faces, its shape.
module emcon_element_kind
   use emcon_shape, only : max_element_nodes, shape_t
   implicit none
   private
   public :: element_row_t, element_kind_t, face_shape, max_face_nodes, find_element_kind, &
      user_element_row

   integer, parameter :: max_faces = max_element_nodes, max_face_nodes = 2
   !> Extents of `face_node`.
   integer, parameter :: face_shape(*) = [max_face_nodes, max_faces]
   !> Cells of the VTK file format.
   integer, parameter :: vtk_points = 2, vtk_polygon = 7

   !> Topology of one element kind. In two dimensions corners and faces run counter-clockwise.
   type :: element_row_t
      character(len=8) :: name = ""
      integer :: n_dim = 0
      integer :: n_node = 0
      integer :: n_corner = 0                               !! of a convex polygon, first nodes
      integer :: n_face = 0
      integer :: n_face_node = 0
      integer :: face_node(max_face_nodes, max_faces) = 0   !! local nodes of face S1, S2, ...
      integer :: vtk_type = 0                               !! cell number of VTK files
      integer :: n_vtk = 0                                  !! nodes of that cell, the first
   end type element_row_t

   !> A row with its shape, which a program gives if the row is of a *USER ELEMENT.
   type, extends(element_row_t) :: element_kind_t
      class(shape_t), allocatable :: shape
   end type element_kind_t

contains

   !> Index of the kind called `name` (upper case) in `kind`, 0 if there is none.
   pure integer function find_element_kind(kind, name)
      class(element_row_t), intent(in) :: kind(:)
      character(len=*), intent(in) :: name
      integer :: i

      find_element_kind = 0
      do i = 1, size(kind)
         if (kind(i)%name == name) find_element_kind = i
      end do
   end function find_element_kind

   !> A plane element of `n_node` nodes, whose first `n_face` ones are its outline: from each to the
   !> next goes a face. Without faces it is drawn as its nodes.
   pure function user_element_row(name, n_node, n_face) result(row)
      character(len=*), intent(in) :: name       !! upper case
      integer, intent(in) :: n_node              !! 1 to `max_element_nodes`
      integer, intent(in) :: n_face              !! 0, or 3 to `n_node`
      type(element_row_t) :: row
      integer :: i

      row%name = name
      row%n_dim = 2
      row%n_node = n_node
      row%n_face = n_face
      row%n_face_node = 2
      do i = 1, n_face
         row%face_node(:, i) = [i, 1 + mod(i, n_face)]
      end do
      row%vtk_type = merge(vtk_polygon, vtk_points, n_face > 0)
      row%n_vtk = merge(n_face, n_node, n_face > 0)
   end function user_element_row

end module emcon_element_kind
