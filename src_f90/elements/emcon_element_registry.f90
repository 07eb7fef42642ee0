!> The registry of elements: the only module that knows their kinds. A new kind is one file, one row
!> of `element_rows` and one case of `element_kinds_create`.
module emcon_element_registry
   use emcon_element_kind, only : element_kind_t, element_row_t, face_room, find_element_kind
   use emcon_shape_quadratic_triangle_plane, only : shape_quadratic_triangle_t
   use emcon_shape_quadrilateral_plane, only : shape_quadrilateral_t
   use emcon_shape_serendipity_plane, only : shape_serendipity_t
   use emcon_shape_triangle_plane, only : shape_triangle_t
   implicit none
   private
   public :: element_rows, element_kinds_create, find_element_row

   type(element_row_t), parameter :: element_rows(*) = [ &
      element_row_t("CPE3", 2, 3, 3, 3, 2, reshape([1, 2, 2, 3, 3, 1], face_room, pad=[0]), 5, 3), &
      element_row_t("CPE4", 2, 4, 4, 4, 2, &
         reshape([1, 2, 2, 3, 3, 4, 4, 1], face_room, pad=[0]), 9, 4), &
      element_row_t("CPE4H", 2, 4, 4, 4, 2, &
         reshape([1, 2, 2, 3, 3, 4, 4, 1], face_room, pad=[0]), 9, 4, .true.), &
      element_row_t("CPE6", 2, 6, 3, 3, 3, &
         reshape([1, 2, 4, 2, 3, 5, 3, 1, 6], face_room, pad=[0]), 22, 6), &
      element_row_t("CPE8", 2, 8, 4, 4, 3, &
         reshape([1, 2, 5, 2, 3, 6, 3, 4, 7, 4, 1, 8], face_room, pad=[0]), 23, 8), &
      element_row_t("CPE8R", 2, 8, 4, 4, 3, &
         reshape([1, 2, 5, 2, 3, 6, 3, 4, 7, 4, 1, 8], face_room, pad=[0]), 23, 8), &
      element_row_t("CPS3", 2, 3, 3, 3, 2, reshape([1, 2, 2, 3, 3, 1], face_room, pad=[0]), 5, 3, &
         is_thin=.true.), &
      element_row_t("CPS4", 2, 4, 4, 4, 2, &
         reshape([1, 2, 2, 3, 3, 4, 4, 1], face_room, pad=[0]), 9, 4, is_thin=.true.), &
      element_row_t("CPS6", 2, 6, 3, 3, 3, &
         reshape([1, 2, 4, 2, 3, 5, 3, 1, 6], face_room, pad=[0]), 22, 6, is_thin=.true.), &
      element_row_t("CPS8", 2, 8, 4, 4, 3, &
         reshape([1, 2, 5, 2, 3, 6, 3, 4, 7, 4, 1, 8], face_room, pad=[0]), 23, 8, &
         is_thin=.true.), &
      element_row_t("CPS8R", 2, 8, 4, 4, 3, &
         reshape([1, 2, 5, 2, 3, 6, 3, 4, 7, 4, 1, 8], face_room, pad=[0]), 23, 8, &
         is_thin=.true.)]

contains

   !> All kinds, in the order of the rows, with their shapes.
   pure subroutine element_kinds_create(kind)
      type(element_kind_t), allocatable, intent(out) :: kind(:)
      integer :: k

      allocate(kind(size(element_rows)))
      do k = 1, size(kind)
         kind(k)%element_row_t = element_rows(k)
         select case (element_rows(k)%name)
         case ("CPE3", "CPS3")
            allocate(shape_triangle_t :: kind(k)%shape)
         case ("CPE4", "CPE4H", "CPS4")
            allocate(shape_quadrilateral_t :: kind(k)%shape)
         case ("CPE6", "CPS6")
            allocate(shape_quadratic_triangle_t :: kind(k)%shape)
         case ("CPE8", "CPS8")
            allocate(kind(k)%shape, source=shape_serendipity_t(n_side=3))
         case ("CPE8R", "CPS8R")
            allocate(kind(k)%shape, source=shape_serendipity_t(n_side=2))
         end select
      end do
   end subroutine element_kinds_create

   !> Index of the row called `name` (upper case), 0 if there is none.
   pure integer function find_element_row(name)
      character(len=*), intent(in) :: name

      find_element_row = find_element_kind(element_rows, name)
   end function find_element_row

end module emcon_element_registry
