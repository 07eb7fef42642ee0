!> What a scene has to know of an element kind: its name, its nodes, its faces, its shape.
module emcon_element_kind
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: element_row_t, element_kind_t, face_room, max_face_nodes, find_element_kind, &
      user_element_row

   !> Room for the nodes of all faces of an element: six of eight nodes.
   integer, parameter :: face_room(1) = [48], max_face_nodes = 8
   !> Cells of the VTK file format.
   integer, parameter :: vtk_points = 2, vtk_polygon = 7

   !> Topology of one element kind. In two dimensions corners and faces run counter-clockwise, in
   !> three faces do seen from inside.
   type :: element_row_t
      character(len=8) :: name = ""
      integer :: n_dim = 0
      integer :: n_node = 0
      integer :: n_corner = 0                    !! the first nodes
      integer :: n_face = 0
      integer :: n_face_node = 0
      !> local nodes of face S1, then S2, ...: corners in their order, then those between them
      integer :: face_node(face_room(1)) = 0
      integer :: vtk_type = 0                    !! cell number of VTK files
      integer :: n_vtk = 0                       !! nodes of that cell, the first
      logical :: has_mean_volume = .false.       !! volume resists in the mean over the element
      logical :: is_thin = .false.               !! plane stress, not plane strain
      logical :: is_axial = .false.              !! of solids of revolution
      logical :: has_modes = .false.             !! incompatible ones
   contains
      procedure :: face
      procedure :: may_lock
      procedure :: is_stiff_bent
   end type element_row_t

   !> A row with its shape, which a program gives if the row is of a *USER ELEMENT.
   type, extends(element_row_t) :: element_kind_t
      class(shape_t), allocatable :: shape
   end type element_kind_t

contains

   !> Local nodes of a face.
   pure function face(self, i) result(node)
      class(element_row_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to n_face
      integer :: node(self%n_face_node)

      node = self%face_node(self%n_face_node*(i - 1) + 1:self%n_face_node*i)
   end function face

   !> Does it resist a change of volume at more points than its shape can follow? So do elements
   !> with nodes at their corners alone, but those where the mean resists or modes give way.
   pure logical function may_lock(self)
      class(element_row_t), intent(in) :: self

      may_lock = self%n_node == self%n_corner .and. .not. (self%has_mean_volume .or. self%has_modes)
   end function may_lock

   !> Do its sides stay straight and resist where it is bent? So do those of elements with nodes at
   !> their corners alone, unless modes give way.
   pure logical function is_stiff_bent(self)
      class(element_row_t), intent(in) :: self

      is_stiff_bent = self%n_node == self%n_corner .and. .not. self%has_modes
   end function is_stiff_bent

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
      integer, intent(in) :: n_node              !! 1 to `max_plane_nodes`
      integer, intent(in) :: n_face              !! 0, or 3 to `n_node`
      type(element_row_t) :: row
      integer :: i

      row%name = name
      row%n_dim = 2
      row%n_node = n_node
      row%n_face = n_face
      row%n_face_node = 2
      do i = 1, n_face
         associate (last => row%n_face_node*i)
            row%face_node(last - row%n_face_node + 1:last) = [i, 1 + mod(i, n_face)]
         end associate
      end do
      row%vtk_type = merge(vtk_polygon, vtk_points, n_face > 0)
      row%n_vtk = merge(n_face, n_node, n_face > 0)
   end function user_element_row

end module emcon_element_kind
