!> Unknowns and prescribed degrees of freedom.
module test_numbering
   use check, only : check_equal, check_near, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_numbering, only : add_to_dofs, numbering_init, numbering_t, pick_unknowns
   use emcon_scene, only : step_t
   use small_scenes, only : clamp, prescribe
   implicit none
   private
   public :: collect_numbering

contains

   subroutine collect_numbering(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("numbers run over the nodes", test_numbers), &
         test_case_t("from fields to vectors and back", test_fields), &
         test_case_t("nothing and everything prescribed", test_limits)]
   end subroutine collect_numbering

   !> Node 1 free, 2 held in y, 3 held (and said twice), 4 held in x, 5 without element.
   subroutine make(numbering)
      type(numbering_t), intent(out) :: numbering
      type(step_t) :: step

      allocate(step%prescribed(0))
      call prescribe(step, 2, 2, 0.5_wp)
      call prescribe(step, 4, 1, 0.5_wp)
      call clamp(step, [3, 3])
      call numbering_init(numbering, spread([.true., .true., .true., .true., .false.], 1, 2), &
         step%prescribed)
   end subroutine make

   subroutine test_numbers(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering

      call make(numbering)
      call check_equal(error, numbering%n_unknown, 4, "unknowns")
      call check_equal(error, reshape(numbering%unknown, [10]), [1, 2, 3, 0, 0, 0, 0, 4, 0, 0], &
         "numbers")
      call check_equal(error, numbering%dof, [1, 2, 3, 8], "places")
   end subroutine test_numbers

   subroutine test_fields(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering
      real(wp) :: field(2, 5), vector(4)

      call make(numbering)
      field = reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 7.0_wp, 8.0_wp, &
         9.0_wp, 9.0_wp], [2, 5])
      call pick_unknowns(numbering, field, vector)
      call check_near(error, vector, [1.0_wp, 2.0_wp, 3.0_wp, 8.0_wp], 0.0_wp, 1.0_wp, "vector")
      call add_to_dofs(numbering, vector, -2.0_wp, field)
      call check_near(error, field, reshape([-1.0_wp, -2.0_wp, -3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, &
         7.0_wp, -8.0_wp, 9.0_wp, 9.0_wp], [2, 5]), 0.0_wp, 1.0_wp, "field")
   end subroutine test_fields

   subroutine test_limits(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering
      type(step_t) :: step
      real(wp) :: field(2, 3), vector(0)

      allocate(step%prescribed(0))
      call numbering_init(numbering, spread([.true., .true., .true.], 1, 2), step%prescribed)
      call check_equal(error, numbering%dof, [1, 2, 3, 4, 5, 6], "all free")
      call clamp(step, [1, 2, 3])
      call numbering_init(numbering, spread([.true., .true., .true.], 1, 2), step%prescribed)
      call check_equal(error, numbering%n_unknown, 0, "none free")
      field = 1.0_wp
      call pick_unknowns(numbering, field, vector)
      call add_to_dofs(numbering, vector, 1.0_wp, field)
      call check_near(error, field, 0.0_wp*field + 1.0_wp, 0.0_wp, 1.0_wp, "field")
   end subroutine test_limits

end module test_numbering
