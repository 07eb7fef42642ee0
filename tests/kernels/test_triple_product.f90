!> R = P^T N D against dense products.
module test_triple_product
   use check, only : check_equal, check_error, check_near, test_case_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : dp, wp
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   use sparse_samples, only : dense_of, random_sparse
   implicit none
   private
   public :: collect_triple_product

   !> Sums of a few hundred products of numbers of size 1.
   real(wp), parameter :: tol = 100.0_wp*real(epsilon(1.0_dp), wp)

contains

   subroutine collect_triple_product(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("random matrices", test_random), &
         test_case_t("identity leaves the bits", test_identity), &
         test_case_t("null space of two constraints", test_null_space), &
         test_case_t("new values in the same pattern", test_new_values), &
         test_case_t("no columns", test_no_columns), &
         test_case_t("extents that do not match", test_mismatch)]
   end subroutine collect_triple_product

   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p, n, d, r
      type(triple_product_t) :: plan

      call random_sparse(30, 12, 2, p)
      call random_sparse(30, 30, 4, n)
      call random_sparse(30, 17, 3, d)
      call triple_product_init(plan, p, n, d, r, error)
      if (allocated(error)) return
      call triple_product_update(plan, p, n, d, r)
      call check_product(error, p, n, d, r)
   end subroutine test_random

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p, n, r
      type(triple_product_t) :: plan
      integer, allocatable :: slot(:)
      integer :: i

      call random_sparse(30, 30, 4, n)
      call csr_from_entries(p, 30, 30, [(i, i = 1, 30)], [(i, i = 1, 30)], slot)
      p%value = 1.0_dp
      call triple_product_init(plan, p, n, p, r, error)
      if (allocated(error)) return
      call triple_product_update(plan, p, n, p, r)
      call check_equal(error, r%column, n%column, "column")
      call check_near(error, real(r%value, wp), real(n%value, wp), 0.0_wp, 1.0_wp, "value")
   end subroutine test_identity

   !> Unknowns 3 and 7 of ten depend on three others each; one row of D is empty.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p, n, d, r
      type(triple_product_t) :: plan
      integer, allocatable :: slot(:)

      call random_sparse(10, 10, 5, n)
      call csr_from_entries(p, 10, 8, [1, 2, 4, 5, 6, 8, 9, 10, 3, 3, 3, 7, 7, 7], &
         [1, 2, 3, 4, 5, 6, 7, 8, 2, 4, 6, 1, 4, 8], slot)
      call csr_from_entries(d, 10, 8, [1, 2, 4, 5, 6, 8, 9, 10, 3, 3, 3], &
         [1, 2, 3, 4, 5, 6, 7, 8, 2, 4, 6], slot)
      call random_number(p%value)
      call random_number(d%value)
      call triple_product_init(plan, p, n, d, r, error)
      if (allocated(error)) return
      call triple_product_update(plan, p, n, d, r)
      call check_product(error, p, n, d, r)
   end subroutine test_null_space

   subroutine test_new_values(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p, n, d, r
      type(triple_product_t) :: plan
      integer :: i

      call random_sparse(20, 9, 2, p)
      call random_sparse(20, 20, 4, n)
      call random_sparse(20, 9, 2, d)
      call triple_product_init(plan, p, n, d, r, error)
      if (allocated(error)) return
      do i = 1, 3
         call random_number(p%value)
         call random_number(n%value)
         call random_number(d%value)
         call triple_product_update(plan, p, n, d, r)
         call check_product(error, p, n, d, r)
      end do
   end subroutine test_new_values

   !> All unknowns prescribed.
   subroutine test_no_columns(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p, n, r
      type(triple_product_t) :: plan
      integer, allocatable :: slot(:)
      integer :: none(0)

      call random_sparse(5, 5, 2, n)
      call csr_from_entries(p, 5, 0, none, none, slot)
      call triple_product_init(plan, p, n, p, r, error)
      if (allocated(error)) return
      call triple_product_update(plan, p, n, p, r)
      call check_equal(error, size(r%column), 0, "number of slots")
   end subroutine test_no_columns

   subroutine test_mismatch(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(csr_t) :: p, n, r
      type(triple_product_t) :: plan

      call random_sparse(5, 5, 2, n)
      call random_sparse(6, 5, 2, p)
      call triple_product_init(plan, p, n, p, r, raised)
      call check_error(error, raised, err_internal, "6, 5, 6", "rows 6, 5, 6")
   end subroutine test_mismatch

   subroutine check_product(error, p, n, d, r)
      type(error_t), allocatable, intent(inout) :: error
      type(csr_t), intent(in) :: p, n, d, r
      real(dp) :: full_p(p%n_row, p%n_col), full_n(n%n_row, n%n_row), full_d(d%n_row, d%n_col)
      real(dp) :: expected(p%n_col, d%n_col)

      full_p = dense_of(p)
      full_n = dense_of(n)
      full_d = dense_of(d)
      expected = matmul(transpose(full_p), matmul(full_n, full_d))
      call check_near(error, real(dense_of(r), wp), real(expected, wp), tol, 1.0_wp, "P^T N D")
   end subroutine check_product

end module test_triple_product
