!> Sparse patterns and products against dense arithmetic.
module test_csr
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_find, csr_from_elements, csr_from_entries, csr_is_same, csr_multiply, &
      csr_multiply_transposed, csr_t, csr_transpose
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : dp, wp
   use sparse_samples, only : dense_of, random_sparse
   implicit none
   private
   public :: collect_csr

   !> Sums of at most 40 terms of size 1.
   real(wp), parameter :: tol = 40.0_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

contains

   subroutine collect_csr(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("two triangles", test_two_triangles), &
         test_case_t("assembly equals dense assembly", test_assembly), &
         test_case_t("unknown twice in an element", test_collapsed), &
         test_case_t("unknown without element", test_lonely), &
         test_case_t("no elements", test_no_elements), &
         test_case_t("unknown out of range", test_out_of_range), &
         test_case_t("entries with duplicates", test_entries), &
         test_case_t("products", test_products), &
         test_case_t("transpose", test_transpose)]
   end subroutine collect_csr

   !> Elements (1, 2, 4) and (4, prescribed, 3): the pattern by hand.
   subroutine test_two_triangles(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_elements(a, 4, [1, 4, 7], [1, 2, 4, 4, 0, 3], slot, error)
      if (allocated(error)) return
      call check_equal(error, a%row_start, [0, 3, 6, 8, 12], "row_start")
      call check_equal(error, a%column, [0, 1, 3, 0, 1, 3, 2, 3, 0, 1, 2, 3], "column")
      call check_equal(error, slot, &
         [1, 4, 9, 2, 5, 10, 3, 6, 12, 12, 0, 8, 0, 0, 0, 11, 0, 7], "slot")
      call check_equal(error, csr_find(a, 3, 4), 8, "slot of (3, 4)")
      call check_equal(error, csr_find(a, 1, 3), 0, "slot of (1, 3)")
   end subroutine test_two_triangles

   !> Random elements of 1 to 6 unknowns, a fifth of them prescribed.
   subroutine test_assembly(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 40, n_element = 60
      type(csr_t) :: a
      integer :: list_start(n_element + 1), e, i, j, k
      integer, allocatable :: dof(:), slot(:)
      real(dp) :: dense(n, n), ke
      real(wp) :: u

      list_start(1) = 1
      do e = 1, n_element
         call random_number(u)
         list_start(e + 1) = list_start(e) + 1 + int(6.0_wp*u)
      end do
      allocate(dof(list_start(n_element + 1) - 1))
      do k = 1, size(dof)
         call random_number(u)
         dof(k) = int(u*1.25_wp*real(n, wp)) + 1
         if (dof(k) > n) dof(k) = 0
      end do
      call csr_from_elements(a, n, list_start, dof, slot, error)
      if (allocated(error)) return
      dense = 0.0_dp
      k = 0
      do e = 1, n_element
         do j = list_start(e), list_start(e + 1) - 1
            do i = list_start(e), list_start(e + 1) - 1
               k = k + 1
               call random_number(ke)
               if (slot(k) > 0) a%value(slot(k)) = a%value(slot(k)) + ke
               if (dof(i) > 0 .and. dof(j) > 0) dense(dof(i), dof(j)) = dense(dof(i), dof(j)) + ke
            end do
         end do
      end do
      call check_equal(error, size(slot), k, "number of element entries")
      call check_near(error, real(dense_of(a), wp), real(dense, wp), 0.0_wp, 1.0_wp, "matrix")
      call check_equal(error, count(dense > 0.0_dp), size(a%column), "number of slots")
   end subroutine test_assembly

   subroutine test_collapsed(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_elements(a, 2, [1, 4], [2, 1, 2], slot, error)
      if (allocated(error)) return
      call check_equal(error, a%column, [0, 1, 0, 1], "column")
      call check_equal(error, slot, [4, 2, 4, 3, 1, 3, 4, 2, 4], "slot")
   end subroutine test_collapsed

   subroutine test_lonely(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_elements(a, 3, [1, 3], [1, 3], slot, error)
      if (allocated(error)) return
      call check_equal(error, a%row_start, [0, 2, 2, 4], "row_start")
   end subroutine test_lonely

   subroutine test_no_elements(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)
      integer :: none(0)

      call csr_from_elements(a, 2, [1], none, slot, error)
      if (allocated(error)) return
      call check_equal(error, a%row_start, [0, 0, 0], "row_start")
      call check_equal(error, size(slot), 0, "number of element entries")
   end subroutine test_no_elements

   subroutine test_out_of_range(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_elements(a, 2, [1, 3], [1, 3], slot, raised)
      call check_error(error, raised, err_internal, "unknown 3 of 2", "third unknown of two")
   end subroutine test_out_of_range

   subroutine test_entries(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_entries(a, 3, 4, [3, 1, 3, 0, 3, 1], [2, 4, 2, 1, 1, 0], slot)
      call check_equal(error, a%row_start, [0, 1, 1, 3], "row_start")
      call check_equal(error, a%column, [3, 0, 1], "column")
      call check_equal(error, slot, [3, 1, 3, 0, 2, 0], "slot")
   end subroutine test_entries

   subroutine test_products(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      real(wp) :: x(30), y(20), z(30), full(20, 30)

      call random_sparse(20, 30, 5, a)
      full = real(dense_of(a), wp)
      call random_number(x)
      call csr_multiply(a, x, y)
      call check_near(error, y, matmul(full, x), tol, 1.0_wp, "A x")
      call csr_multiply_transposed(a, y, z)
      call check_near(error, z, matmul(y, full), tol, maxval(abs(y)), "A^T y")
   end subroutine test_products

   subroutine test_transpose(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a, b, c
      integer, allocatable :: from(:)

      call random_sparse(20, 30, 5, a)
      call csr_transpose(a, b, from)
      call check_near(error, real(dense_of(b), wp), real(transpose(dense_of(a)), wp), 0.0_wp, &
         1.0_wp, "A^T")
      call csr_transpose(b, c, from)
      call check_true(error, csr_is_same(a, c), "(A^T)^T has the pattern of A")
      call check_true(error, .not. csr_is_same(a, b), "A^T differs from A")
      call check_near(error, real(c%value, wp), real(a%value, wp), 0.0_wp, 1.0_wp, "(A^T)^T")
   end subroutine test_transpose

end module test_csr
