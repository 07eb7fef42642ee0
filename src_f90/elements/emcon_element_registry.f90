!> The registry of elements: what others see of it. Which kinds there are is known to
!> `emcon_element_kinds` alone.
module emcon_element_registry
   use emcon_element_kind, only : element_kind_t, element_row_t
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: element_row, n_element_row, element_kinds_create, find_element_row, face_shape_create

   interface
      pure module integer function n_element_row()
      end function n_element_row

      !> Those of the plane, of solids of revolution, of space, in this order.
      pure module function element_row(i) result(row)
         integer, intent(in) :: i                !! 1..n_element_row()
         type(element_row_t) :: row
      end function element_row

      pure module subroutine allocate_shape(name, shape)
         character(len=*), intent(in) :: name    !! of a row
         class(shape_t), allocatable, intent(inout) :: shape   !! none so far
      end subroutine allocate_shape

      !> The shape of faces of so many nodes, corners in their order and then those between them;
      !> none if there is no such face.
      module subroutine face_shape_create(n_node, shape)
         integer, intent(in) :: n_node
         class(shape_t), allocatable, intent(out) :: shape
      end subroutine face_shape_create
   end interface

contains

   !> All kinds of so many dimensions, in the order of the rows, with their shapes.
   pure subroutine element_kinds_create(n_dim, kind)
      integer, intent(in) :: n_dim               !! 2 or 3
      type(element_kind_t), allocatable, intent(out) :: kind(:)
      type(element_row_t) :: row
      integer :: i, k

      k = 0
      do i = 1, n_element_row()
         row = element_row(i)
         if (row%n_dim == n_dim) k = k + 1
      end do
      allocate(kind(k))
      k = 0
      do i = 1, n_element_row()
         row = element_row(i)
         if (row%n_dim /= n_dim) cycle
         k = k + 1
         kind(k)%element_row_t = row
         call allocate_shape(row%name, kind(k)%shape)
      end do
   end subroutine element_kinds_create

   !> Number of the row called `name` (upper case), 0 if there is none.
   pure integer function find_element_row(name) result(i)
      character(len=*), intent(in) :: name
      type(element_row_t) :: row

      do i = n_element_row(), 1, -1
         row = element_row(i)
         if (row%name == name) return
      end do
   end function find_element_row

end module emcon_element_registry
