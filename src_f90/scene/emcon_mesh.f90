!> Sets of nodes and elements, and surfaces.
module emcon_mesh
   use emcon_origin, only : origin_t
   use emcon_wall, only : wall_t
   implicit none
   private
   public :: named_set_t, surface_t
   public :: surface_of_faces, surface_of_nodes, surface_of_lines, surface_of_segments, &
      surface_of_plane, surface_of_sphere, surface_of_revolution, surface_of_extrusion, &
      surface_of_triangles

   !> What a surface is made of.
   integer, parameter :: surface_of_faces = 1, surface_of_nodes = 2, surface_of_lines = 3, &
      surface_of_segments = 4, surface_of_plane = 5, surface_of_sphere = 6, &
      surface_of_revolution = 7, surface_of_extrusion = 8, surface_of_triangles = 9

   !> A node set or an element set.
   type :: named_set_t
      character(len=:), allocatable :: name          !! upper case
      type(origin_t) :: origin
      integer, allocatable :: item(:)                !! ascending, distinct indices
   end type named_set_t

   !> A surface: element faces in the order of the deck, or nodes, or edges between nodes.
   type :: surface_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      logical :: is_nodal = .false.
      logical :: is_profile = .false.                !! it has a shape and nodes of its own
      integer :: inner_node = 0                      !! one beside a straight profile, in its body
      logical :: is_exterior = .false.               !! every free face that no tie covers
      integer, allocatable :: element(:)             !! (n_face)
      integer, allocatable :: face(:)                !! (n_face) 1..n_face of the element kind
      integer, allocatable :: node(:)                !! (n_node), if `is_nodal`; those of a wall
      type(wall_t), allocatable :: wall              !! only of a shape in space
      !> Only of a surface of edges: (2, n_edge) first and last nodes, the body to the left; of a
      !> host or of triangles in space (most, n_face) the nodes of faces in turn, seen from
      !> outside, behind them 0
      integer, allocatable :: edge(:, :)
   end type surface_t

end module emcon_mesh
