!> Connected parts of a mesh.
module test_bodies
   use check, only : check_equal, test_case_t
   use emcon_bodies, only : bodies_find
   use emcon_errors, only : error_t
   implicit none
   private
   public :: collect_bodies

contains

   subroutine collect_bodies(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("two bodies and a lonely node", test_two), &
         test_case_t("parts joined late", test_late), &
         test_case_t("a long strip in any order of elements", test_strip), &
         test_case_t("no elements", test_none)]
   end subroutine collect_bodies

   !> Bodies are numbered by their first node, whatever the order of the elements.
   subroutine test_two(error)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: body(:)
      integer :: n_body

      call bodies_find(reshape([7, 6, 9, 0, 2, 3, 1, 8, 9, 5, 7, 0], [4, 3]), 9, body, n_body)
      call check_equal(error, n_body, 2, "bodies")
      call check_equal(error, body, [1, 1, 1, 0, 2, 2, 2, 1, 2], "bodies of the nodes")
   end subroutine test_two

   !> Three triangles apart, and one that touches all of them.
   subroutine test_late(error)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: body(:)
      integer :: n_body, i

      call bodies_find(reshape([7, 8, 9, 1, 2, 3, 4, 5, 6, 9, 4, 2], [3, 4]), 9, body, n_body)
      call check_equal(error, n_body, 1, "bodies")
      call check_equal(error, body, [(1, i = 1, 9)], "bodies of the nodes")
   end subroutine test_late

   subroutine test_strip(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 1000
      integer, allocatable :: body(:)
      integer :: element(3, n), n_body, e, i

      do e = 1, n
         i = 1 + modulo(377*e, n)                ! 377 has no common factor with n
         element(:, e) = [i + 2, i, i + 1]
      end do
      call bodies_find(element, n + 2, body, n_body)
      call check_equal(error, n_body, 1, "bodies")
      call bodies_find(element(:, 2:), n + 3, body, n_body)
      call check_equal(error, body(n + 3), 0, "node without element")
   end subroutine test_strip

   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: body(:)
      integer :: n_body, element(4, 0)

      call bodies_find(element, 2, body, n_body)
      call check_equal(error, n_body, 0, "bodies")
      call check_equal(error, body, [0, 0], "bodies of the nodes")
   end subroutine test_none

end module test_bodies
