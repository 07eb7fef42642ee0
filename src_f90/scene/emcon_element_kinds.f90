!> What a scene has to know of an element kind: its name, its nodes, its faces.
!>
!> Shape functions and quadrature of the same kinds: `emcon_shape`.
module emcon_element_kinds
   implicit none
   private
   public :: element_kind_t, element_kinds, find_element_kind
   public :: max_element_nodes

   integer, parameter :: max_element_nodes = 4, max_faces = 4, max_face_nodes = 2

   !> Topology of one element kind. Nodes run counter-clockwise in two dimensions.
   type :: element_kind_t
      character(len=8) :: name = ""
      integer :: n_dim = 0
      integer :: n_node = 0
      integer :: n_face = 0
      integer :: n_face_node = 0
      integer :: face_node(max_face_nodes, max_faces) = 0   !! local nodes of face S1, S2, ...
      integer :: vtk_type = 0                               !! cell number of the VTK file format
   end type element_kind_t

   !> The registry: a new kind is one row here and one shape in `emcon_shape`.
   type(element_kind_t), parameter :: element_kinds(2) = [ &
      element_kind_t("CPE3", 2, 3, 3, 2, reshape([1, 2, 2, 3, 3, 1, 0, 0], [2, 4]), 5), &
      element_kind_t("CPE4", 2, 4, 4, 2, reshape([1, 2, 2, 3, 3, 4, 4, 1], [2, 4]), 9)]

contains

   !> Index of the kind called `name` (upper case) in `element_kinds`, 0 if there is none.
   pure integer function find_element_kind(name)
      character(len=*), intent(in) :: name
      integer :: i

      find_element_kind = 0
      do i = 1, size(element_kinds)
         if (element_kinds(i)%name == name) find_element_kind = i
      end do
   end function find_element_kind

end module emcon_element_kinds
