!> The registry of output quantities: what decks may ask for, where values are, what the field
!> file calls them. The rows stand in `emcon_quantity_rows`; `emcon_quantities` computes values.
module emcon_quantity_registry
   use emcon_text, only : string_t
   implicit none
   private
   public :: quantity_row_t, quantity_row, n_quantity_row, quantity_row_of, quantities_of_card
   public :: at_nodes, at_elements, at_contacts, at_sections, at_pairs, &
      of_vector, of_rotation, of_strain, of_wrench, of_length, of_area

   !> Where the values of a quantity are.
   integer, parameter :: at_nodes = 1, at_elements = 2, at_contacts = 3, &
      at_sections = 4, at_pairs = 5

   !> Components of a vector, in a row: one for each direction; of a rotation: for each plane.
   !> Of a strain: of its tensor, shears twice; of a force and its moment. Of what is told of lines
   !> in the plane alone, and of surfaces in space alone: one there.
   integer, parameter :: of_vector = 0, of_rotation = -1, of_strain = -2, of_wrench = -3, &
      of_length = -4, of_area = -5

   !> A quantity at one kind of places.
   type :: quantity_row_t
      character(len=14) :: variable = ""         !! in decks
      integer :: place = 0                       !! one of the `at_` codes
      integer :: n_component = 1                 !! > 0, or one of the `of_` codes
      character(len=16) :: field = ""            !! in the field file; empty: it is not there
      character(len=16) :: last = ""             !! name of a field for the last component
      logical :: is_sparse = .false.             !! the same at most places
      integer :: card = 0                        !! whose cards ask for it, an `at_` code; 0: none
      character(len=10) :: longer = ""           !! another name in decks
   end type quantity_row_t

   interface
      pure module integer function n_quantity_row()
      end function n_quantity_row

      pure module function quantity_row(i) result(row)
         integer, intent(in) :: i                !! 1..n_quantity_row()
         type(quantity_row_t) :: row
      end function quantity_row
   end interface

contains

   !> The row of a variable at some kind of places; place 0: there is none.
   pure type(quantity_row_t) function quantity_row_of(variable, place) result(found)
      character(len=*), intent(in) :: variable
      integer, intent(in) :: place               !! one of the `at_` codes
      type(quantity_row_t) :: row
      integer :: i

      do i = 1, n_quantity_row()
         row = quantity_row(i)
         if (row%variable /= variable .or. row%place /= place) cycle
         found = row
         return
      end do
   end function quantity_row_of

   !> What a card may ask for, and other names of the same.
   pure subroutine quantities_of_card(card, to_field_file, variable, longer)
      integer, intent(in) :: card                !! one of the `at_` codes
      logical, intent(in) :: to_field_file       !! or to the history
      type(string_t), allocatable, intent(out) :: variable(:)
      type(string_t), allocatable, intent(out) :: longer(:)   !! of the same size
      type(quantity_row_t) :: row
      integer :: i, k, n

      allocate(variable(n_quantity_row()), longer(n_quantity_row()))
      n = 0
      do i = 1, n_quantity_row()
         row = quantity_row(i)
         if (row%card /= card .or. (to_field_file .and. row%field == "")) cycle
         do k = 1, n
            if (variable(k)%text == row%variable) exit
         end do
         if (k <= n) cycle
         n = n + 1
         variable(n)%text = trim(row%variable)
         longer(n)%text = trim(row%longer)
      end do
      variable = variable(:n)
      longer = longer(:n)
   end subroutine quantities_of_card

end module emcon_quantity_registry
