!> Each row of the table of output quantities has values, and what is in no row has none.
module test_quantities
   use check, only : check_equal, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp
   use emcon_march, only : increment_t, march_free, march_increment
   use emcon_quantities, only : quantity_components, quantity_fields, quantity_of_field, &
      quantity_values, quantity_variables
   use emcon_quantity_registry, only : at_contacts, at_elements, at_nodes, at_pairs, at_sections, &
      n_quantity_row, quantities_of_card, quantity_row, quantity_row_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_text, only : string_t, to_text
   use emcon_vtkhdf, only : field_t
   use stepper_scenes, only : make_drop, open_scene
   implicit none
   private
   public :: collect_quantities

contains

   subroutine collect_quantities(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("each row has its values", test_rows), &
         test_case_t("each field has its values", test_fields), &
         test_case_t("what is in no row has no values", test_none), &
         test_case_t("cards know their quantities once", test_cards)]
   end subroutine collect_quantities

   !> Two blocks in contact, after some increments.
   subroutine open_blocks(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      type(scene_t) :: scene
      integer :: i

      call make_drop(scene, 8)
      call open_scene(stepper, scene, error)
      do i = 1, 6
         if (allocated(error)) return
         call march_increment(stepper%march, stepper%scene, increment, error)
      end do
   end subroutine open_blocks

   !> How many places of a kind there are.
   pure integer function n_place(stepper, place) result(n)
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: place               !! one of the `at_` codes

      n = -1
      select case (place)
      case (at_nodes)
         n = size(stepper%scene%x, 2)
      case (at_elements)
         n = size(stepper%scene%element%kind)
      case (at_contacts)
         n = stepper%march%system%n_constraint
      case (at_sections)
         n = size(stepper%scene%surface)
      case (at_pairs)
         n = size(stepper%scene%pair)
      end select
   end function n_place

   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(quantity_row_t) :: row
      real(dp), allocatable :: values(:, :)
      integer :: i, n

      call open_blocks(stepper, error)
      if (allocated(error)) return
      do i = 1, n_quantity_row()
         row = quantity_row(i)
         values = quantity_values(stepper, trim(row%variable), row%place)
         n = quantity_components(trim(row%variable), row%place, 2)
         ! What is of space alone has no values in the plane.
         call check_equal(error, shape(values), [n, merge(n_place(stepper, row%place), 0, n > 0)], &
            trim(row%variable) // " at " // to_text(row%place))
      end do
      call march_free(stepper%march)
   end subroutine test_rows

   subroutine test_fields(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(string_t), allocatable :: names(:)
      type(field_t), allocatable :: fields(:)
      real(dp), allocatable :: values(:, :)
      integer :: i

      call open_blocks(stepper, error)
      if (allocated(error)) return
      names = quantity_variables()
      do i = 1, size(names)
         fields = quantity_fields(names(i)%text, 2)
         values = quantity_of_field(stepper, names(i)%text)
         call check_equal(error, shape(values), [sum(fields%n_component), n_place(stepper, &
            merge(at_elements, at_nodes, fields(1)%is_cell))], names(i)%text)
      end do
      call march_free(stepper%march)
   end subroutine test_fields

   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      integer :: place

      call open_blocks(stepper, error)
      if (allocated(error)) return
      do place = at_nodes - 1, at_pairs + 1
         call check_equal(error, size(quantity_values(stepper, "NONE", place)), 0, "values at " &
            // to_text(place))
         call check_equal(error, quantity_components("NONE", place, 2), 0, "components at " &
            // to_text(place))
      end do
      call march_free(stepper%march)
   end subroutine test_none

   subroutine test_cards(error)
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: name(:), longer(:)
      integer :: card, i, j, k

      do card = at_nodes, at_contacts
         do k = 0, 1
            call quantities_of_card(card, k == 1, name, longer)
            call check_true(error, size(name) > 0, "there are some")
            do i = 1, size(name)
               call check_true(error, all([(name(j)%text /= name(i)%text, &
                  j = 1, i - 1)]), name(i)%text // " is there once")
            end do
         end do
      end do
   end subroutine test_cards

end module test_quantities
