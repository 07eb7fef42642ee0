!> The kinds of elements. A new kind is one file, one row of `plane_rows`, `axial_rows` or
!> `space_rows` and one case of `allocate_shape`.
submodule (emcon_element_registry) emcon_element_kinds
   use emcon_element_kind, only : face_room
   use emcon_shape_hexahedron_space, only : shape_hexahedron_t
   use emcon_shape_quadratic_tetrahedron_space, only : shape_quadratic_tetrahedron_t
   use emcon_shape_quadratic_triangle_plane, only : shape_quadratic_triangle_t
   use emcon_shape_quadrilateral_plane, only : shape_quadrilateral_t
   use emcon_shape_serendipity_plane, only : shape_serendipity_t
   use emcon_shape_serendipity_space, only : shape_serendipity_space_t
   use emcon_shape_tetrahedron_space, only : shape_tetrahedron_t
   use emcon_shape_triangle_plane, only : shape_triangle_t
   implicit none

   !> Faces in the plane, counter-clockwise: corners alone, and with the middles.
   integer, parameter :: triangle(face_room(1)) = reshape([1, 2, 2, 3, 3, 1], face_room, pad=[0])
   integer, parameter :: quadrilateral(face_room(1)) = reshape([1, 2, 2, 3, 3, 4, 4, 1], &
      face_room, pad=[0])
   integer, parameter :: bent_triangle(face_room(1)) = reshape([1, 2, 4, 2, 3, 5, 3, 1, 6], &
      face_room, pad=[0])
   integer, parameter :: bent_quadrilateral(face_room(1)) = reshape([1, 2, 5, 2, 3, 6, 3, 4, 7, &
      4, 1, 8], face_room, pad=[0])

   type(element_row_t), parameter :: plane_rows(*) = [ &
      element_row_t("CPE3", 2, 3, 3, 3, 2, triangle, 5, 3), &
      element_row_t("CPE4", 2, 4, 4, 4, 2, quadrilateral, 9, 4), &
      element_row_t("CPE4H", 2, 4, 4, 4, 2, quadrilateral, 9, 4, .true.), &
      element_row_t("CPE4I", 2, 4, 4, 4, 2, quadrilateral, 9, 4, has_modes=.true.), &
      element_row_t("CPE6", 2, 6, 3, 3, 3, bent_triangle, 22, 6), &
      element_row_t("CPE8", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8), &
      element_row_t("CPE8R", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8), &
      element_row_t("CPS3", 2, 3, 3, 3, 2, triangle, 5, 3, is_thin=.true.), &
      element_row_t("CPS4", 2, 4, 4, 4, 2, quadrilateral, 9, 4, is_thin=.true.), &
      element_row_t("CPS4I", 2, 4, 4, 4, 2, quadrilateral, 9, 4, is_thin=.true., &
         has_modes=.true.), &
      element_row_t("CPS6", 2, 6, 3, 3, 3, bent_triangle, 22, 6, is_thin=.true.), &
      element_row_t("CPS8", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8, is_thin=.true.), &
      element_row_t("CPS8R", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8, is_thin=.true.)]

   !> Solids of revolution: their sections.
   type(element_row_t), parameter :: axial_rows(*) = [ &
      element_row_t("CAX3", 2, 3, 3, 3, 2, triangle, 5, 3, is_axial=.true.), &
      element_row_t("CAX4", 2, 4, 4, 4, 2, quadrilateral, 9, 4, is_axial=.true.), &
      element_row_t("CAX6", 2, 6, 3, 3, 3, bent_triangle, 22, 6, is_axial=.true.), &
      element_row_t("CAX8", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8, is_axial=.true.), &
      element_row_t("CAX8R", 2, 8, 4, 4, 3, bent_quadrilateral, 23, 8, is_axial=.true.)]

   !> Faces of hexahedra, seen from inside counter-clockwise: corners alone, and with the middles.
   integer, parameter :: hexahedron_faces(face_room(1)) = reshape([1, 2, 3, 4, 5, 8, 7, 6, &
      1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 8, 4, 4, 8, 5, 1], face_room, pad=[0])
   integer, parameter :: round_faces(face_room(1)) = [ &
      1, 2, 3, 4, 9, 10, 11, 12, 5, 8, 7, 6, 16, 15, 14, 13, 1, 5, 6, 2, 17, 13, 18, 9, &
      2, 6, 7, 3, 18, 14, 19, 10, 3, 7, 8, 4, 19, 15, 20, 11, 4, 8, 5, 1, 20, 16, 17, 12]

   type(element_row_t), parameter :: space_rows(*) = [ &
      element_row_t("C3D4", 3, 4, 4, 4, 3, &
         reshape([1, 2, 3, 1, 4, 2, 2, 4, 3, 3, 4, 1], face_room, pad=[0]), 10, 4), &
      element_row_t("C3D8", 3, 8, 8, 6, 4, hexahedron_faces, 12, 8), &
      element_row_t("C3D8H", 3, 8, 8, 6, 4, hexahedron_faces, 12, 8, .true.), &
      element_row_t("C3D8I", 3, 8, 8, 6, 4, hexahedron_faces, 12, 8, has_modes=.true.), &
      element_row_t("C3D10", 3, 10, 4, 4, 6, &
         reshape([1, 2, 3, 5, 6, 7, 1, 4, 2, 8, 9, 5, 2, 4, 3, 9, 10, 6, 3, 4, 1, 10, 8, 7], &
            face_room, pad=[0]), 24, 10), &
      element_row_t("C3D20", 3, 20, 8, 6, 8, round_faces, 25, 20), &
      element_row_t("C3D20R", 3, 20, 8, 6, 8, round_faces, 25, 20)]

   type(element_row_t), parameter :: rows(*) = [plane_rows, axial_rows, space_rows]

contains

   module procedure n_element_row
      n_element_row = size(rows)
   end procedure n_element_row

   module procedure element_row
      row = rows(i)
   end procedure element_row

   module procedure allocate_shape
      select case (name)
      case ("CPE3", "CPS3")
         allocate(shape_triangle_t :: shape)
      case ("CAX3")
         allocate(shape, source=shape_triangle_t(is_fine=.true.))
      case ("CPE4", "CPE4H", "CPE4I", "CPS4", "CPS4I", "CAX4")
         allocate(shape_quadrilateral_t :: shape)
      case ("CPE6", "CPS6", "CAX6")
         allocate(shape_quadratic_triangle_t :: shape)
      case ("CPE8", "CPS8", "CAX8")
         allocate(shape, source=shape_serendipity_t(n_side=3))
      case ("CPE8R", "CPS8R", "CAX8R")
         allocate(shape, source=shape_serendipity_t(n_side=2))
      case ("C3D4")
         allocate(shape_tetrahedron_t :: shape)
      case ("C3D8", "C3D8H", "C3D8I")
         allocate(shape_hexahedron_t :: shape)
      case ("C3D10")
         allocate(shape_quadratic_tetrahedron_t :: shape)
      case ("C3D20")
         allocate(shape, source=shape_serendipity_space_t(n_side=3))
      case ("C3D20R")
         allocate(shape, source=shape_serendipity_space_t(n_side=2))
      end select
   end procedure allocate_shape

   module procedure face_shape_create
      select case (n_node)
      case (3)
         allocate(shape_triangle_t :: shape)
      case (4)
         allocate(shape_quadrilateral_t :: shape)
      case (6)
         allocate(shape_quadratic_triangle_t :: shape)
      case (8)
         allocate(shape, source=shape_serendipity_t(n_side=3))
      end select
   end procedure face_shape_create

end submodule emcon_element_kinds
