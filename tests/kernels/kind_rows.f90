!> What tests ask the registries of laws and elements: kinds by name, how many there are.
module kind_rows
   use emcon_element_kind, only : element_row_t
   use emcon_element_registry, only : element_row, n_element_row
   use emcon_law_registry, only : law_row, law_row_t, n_law_row
   implicit none
   private
   public :: law_name, law_code, n_plane_row, n_axial_row

contains

   pure function law_name(i) result(name)
      integer, intent(in) :: i                   !! row
      character(len=18) :: name
      type(law_row_t) :: row

      row = law_row(i)
      name = row%name
   end function law_name

   !> Code of a law, 0 if there is none.
   pure integer function law_code(name) result(code)
      character(len=*), intent(in) :: name
      type(law_row_t) :: row
      integer :: i

      code = 0
      do i = 1, n_law_row()
         row = law_row(i)
         if (row%name == name) code = row%code
      end do
   end function law_code

   !> Kinds of the plane: the first rows.
   pure integer function n_plane_row() result(n)
      type(element_row_t) :: row

      do n = 0, n_element_row() - 1
         row = element_row(n + 1)
         if (row%n_dim /= 2 .or. row%is_axial) return
      end do
   end function n_plane_row

   !> Solids of revolution: the rows behind them.
   pure integer function n_axial_row() result(n)
      type(element_row_t) :: row
      integer :: i

      n = 0
      do i = 1, n_element_row()
         row = element_row(i)
         if (row%is_axial) n = n + 1
      end do
   end function n_axial_row

end module kind_rows
