!> Names in a hash table: all are found, and nothing else.
module test_name_index
   use check, only : check_equal, test_case_t
   use emcon_errors, only : error_t
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_name_index

contains

   subroutine collect_name_index(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("names", test_names), test_case_t("pairs of numbers", test_pairs)]
   end subroutine collect_name_index

   !> More than any first size of the table, some put twice; blanks at the end count.
   subroutine test_names(error)
      type(error_t), allocatable, intent(out) :: error
      type(name_index_t) :: table
      integer, parameter :: n = 1000
      integer :: i

      call check_equal(error, name_index_find(table, "A"), 0, "of an empty table")
      do i = 1, n
         call name_index_put(table, "A" // to_text(i), i)
      end do
      do i = 1, n, 7
         call name_index_put(table, "A" // to_text(i), i + n)
      end do
      call name_index_put(table, "", n + 1)
      do i = 1, n
         call check_equal(error, name_index_find(table, "A" // to_text(i)), &
            merge(i + n, i, mod(i, 7) == 1), to_text(i))
         call check_equal(error, name_index_find(table, "A" // to_text(i) // " "), 0, "a blank")
         call check_equal(error, name_index_find(table, "B" // to_text(i)), 0, "another")
      end do
      call check_equal(error, name_index_find(table, ""), n + 1, "no letter")
   end subroutine test_names

   !> In order: 1, 2 is not 2, 1.
   subroutine test_pairs(error)
      type(error_t), allocatable, intent(out) :: error
      type(name_index_t) :: table
      integer :: i, j

      do i = 0, 30
         do j = 0, i
            call name_index_put(table, name_index_pair(i, j), 1 + i + 100*j)
         end do
      end do
      do i = 0, 30
         do j = 0, 30
            call check_equal(error, name_index_find(table, name_index_pair(i, j)), &
               merge(1 + i + 100*j, 0, j <= i), to_text(i) // ", " // to_text(j))
         end do
      end do
   end subroutine test_pairs

end module test_name_index
