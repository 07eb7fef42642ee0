!> Elimination of sparse rows: pivots, null space, redundant rows and what is left of them.
module test_row_elimination
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, hp, wp
   use emcon_lapack, only : dense_null_space, dense_solve
   use emcon_row_elimination, only : elimination_add, elimination_begin, elimination_left, &
      elimination_resolve, row_elimination_t, row_kept, row_poor, row_redundant
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_row_elimination

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

   !> Sparse rows, entry by entry.
   type :: sample_t
      integer :: n_row = 0, n_col = 0, n_free = 0
      integer, allocatable :: start(:), column(:), own(:)
      real(hp), allocatable :: value(:)
   end type sample_t

contains

   subroutine collect_row_elimination(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("null space of random rows", test_null_space), &
         test_case_t("coupled chain", test_chain), &
         test_case_t("what redundant rows leave", test_left), &
         test_case_t("rows of zeros and of what is prescribed", test_empty), &
         test_case_t("own columns go first", test_own), &
         test_case_t("a poor row has no pivot", test_poor), &
         test_case_t("used again, and in other units: the same bits", test_again)]
   end subroutine collect_row_elimination

   subroutine begin_sample(sample, n_col, n_free)
      type(sample_t), intent(out) :: sample
      integer, intent(in) :: n_col, n_free

      sample%n_col = n_col
      sample%n_free = n_free
      sample%start = [0]
      allocate(sample%column(0), sample%own(0), sample%value(0))
   end subroutine begin_sample

   subroutine add_row(sample, column, value, own)
      type(sample_t), intent(inout) :: sample
      integer, intent(in) :: column(:), own
      real(hp), intent(in) :: value(:)

      sample%n_row = sample%n_row + 1
      sample%column = [sample%column, column]
      sample%value = [sample%value, value]
      sample%own = [sample%own, own]
      sample%start = [sample%start, size(sample%column)]
   end subroutine add_row

   !> Random rows of 2 to 8 entries over 40 columns of which 30 are free; every fifth row is the
   !> sum of half of the one before and a quarter of the first.
   subroutine make_random(sample)
      type(sample_t), intent(out) :: sample
      integer, allocatable :: column(:), last_column(:), first_column(:)
      real(hp), allocatable :: value(:), last_value(:), first_value(:)
      real(hp) :: u(8), w(8)
      integer :: k, n

      call begin_sample(sample, 40, 30)
      do k = 1, 20
         call random_number(u)
         call random_number(w)
         if (mod(k, 5) == 0) then
            column = [last_column, first_column]
            value = [0.5_hp*last_value, 0.25_hp*first_value]
         else
            n = 2 + mod(k, 7)
            column = [k, 1 + int(40.0_hp*u(2:n))]
            value = 2.0_hp*w(:n) - 1.0_hp
            last_column = column
            last_value = value
            if (k == 1) then
               first_column = column
               first_value = value
            end if
         end if
         call add_row(sample, column, value, k)
      end do
   end subroutine make_random

   subroutine eliminate(elimination, sample, fate)
      type(row_elimination_t), intent(inout) :: elimination
      type(sample_t), intent(in) :: sample
      integer, allocatable, intent(out) :: fate(:)
      integer :: k

      call elimination_begin(elimination, sample%n_row, sample%n_col, sample%n_free)
      allocate(fate(sample%n_row), source=0)
      do k = 1, sample%n_row
         associate (from => sample%start(k) + 1, to => sample%start(k + 1))
            call elimination_add(elimination, sample%column(from:to), sample%value(from:to), &
               sample%value(from:to), sample%own(k:k), fate(k))
         end associate
      end do
   end subroutine eliminate

   !> The rows as a full matrix.
   pure function dense_of(sample) result(a)
      type(sample_t), intent(in) :: sample
      real(dp) :: a(sample%n_row, sample%n_col)
      integer :: k, s

      a = 0.0_dp
      do k = 1, sample%n_row
         do s = sample%start(k) + 1, sample%start(k + 1)
            a(k, sample%column(s)) = a(k, sample%column(s)) + real(sample%value(s), dp)
         end do
      end do
   end function dense_of

   !> The matrix that gives all columns from those that are no pivots.
   pure function null_space_of(sample, pivot, start, column, weight) result(z)
      type(sample_t), intent(in) :: sample
      integer, intent(in) :: pivot(:), start(:), column(:)
      real(hp), intent(in) :: weight(:)
      real(dp), allocatable :: z(:, :)
      integer :: number(sample%n_col), j, k, n, s

      n = 0
      number = 0
      do j = 1, sample%n_col
         if (any(pivot == j)) cycle
         n = n + 1
         number(j) = n
      end do
      allocate(z(sample%n_col, n), source=0.0_dp)
      do j = 1, sample%n_col
         if (number(j) > 0) z(j, number(j)) = 1.0_dp
      end do
      do k = 1, size(pivot)
         if (pivot(k) == 0) cycle
         do s = start(k) + 1, start(k + 1)
            z(pivot(k), number(column(s))) = real(weight(s), dp)
         end do
      end do
   end function null_space_of

   !> A Z = 0, and Z spans what LAPACK finds. Each of the products carries at most as many roundings
   !> of its largest term as there are entries in A.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(row_elimination_t) :: elimination
      integer, allocatable :: fate(:), start(:), column(:), pivot(:)
      real(hp), allocatable :: weight(:)
      real(dp), allocatable :: a(:, :), z(:, :), basis(:, :)
      real(wp) :: tol
      integer :: sweep, k

      do sweep = 1, 20
         call make_random(sample)
         call eliminate(elimination, sample, fate)
         call elimination_resolve(elimination, start, column, weight)
         pivot = elimination%pivot
         do k = 1, sample%n_row
            call check_equal(error, fate(k), merge(row_redundant, row_kept, mod(k, 5) == 0), "row")
            call check_true(error, fate(k) == row_kept .eqv. pivot(k) > 0, "kept rows have pivots")
            call check_true(error, pivot(k) <= sample%n_free, "pivots are free")
            if (start(k + 1) > start(k) + 1) call check_true(error, all(column(start(k) + 2: &
               start(k + 1)) > column(start(k) + 1:start(k + 1) - 1)), "columns ascend")
         end do
         do k = 1, start(sample%n_row + 1)
            call check_true(error, all(pivot /= column(k)), "no term is a pivot")
         end do
         if (allocated(error)) return
         a = dense_of(sample)
         z = null_space_of(sample, pivot, start, column, weight)
         tol = real(size(sample%column), wp)*eps*real(maxval(abs(z)), wp)
         call check_near(error, real(matmul(a, z), wp), real(0.0_dp*matmul(a, z), wp), tol, &
            1.0_wp, "A Z")
         if (allocated(error)) return
         call dense_null_space(a, 1.0e-12_dp, basis, error)
         if (allocated(error)) return
         call check_equal(error, size(basis, 2), size(z, 2), "dimension")
         call check_near(error, real(z - matmul(basis, matmul(transpose(basis), z)), wp), &
            real(0.0_dp*z, wp), real(sample%n_col, wp)*tol, 1.0_wp, "Z in the null space")
         if (allocated(error)) return
      end do
   end subroutine test_null_space

   !> (1 4 1)/6 along a chain of slaves against masters in between: D^-1 M, rows that sum to one.
   !> The inverse decays: no entry carries more than some ten roundings of order one.
   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 24
      type(sample_t) :: sample
      type(row_elimination_t) :: elimination
      integer, allocatable :: fate(:), start(:), column(:)
      real(hp), allocatable :: weight(:)
      real(dp) :: d(n, n), m(n, n + 1), x(n, n + 1), row(n + 1)
      logical :: is_singular
      integer :: k, s

      call begin_sample(sample, 2*n + 1, n)
      d = 0.0_dp
      m = 0.0_dp
      do k = 1, n
         d(k, max(1, k - 1):min(n, k + 1)) = 1.0_dp/6.0_dp
         d(k, k) = 4.0_dp/6.0_dp
         m(k, k:k + 1) = 0.5_dp*sum(d(k, :))
         call add_row(sample, [k, (s, s = max(1, k - 1), k - 1), (s, s = k + 1, min(n, k + 1)), &
            n + k, n + k + 1], real([d(k, k), d(k, max(1, k - 1):k - 1), &
            d(k, k + 1:min(n, k + 1)), -m(k, k:k + 1)], hp), k)
      end do
      call eliminate(elimination, sample, fate)
      call elimination_resolve(elimination, start, column, weight)
      call check_equal(error, elimination%pivot, [(k, k = 1, n)], "pivots")
      call dense_solve(d, m, x, is_singular)
      do k = 1, n
         row = 0.0_dp
         row(column(start(k) + 1:start(k + 1)) - n) = real(weight(start(k) + 1:start(k + 1)), dp)
         call check_near(error, real(row, wp), real(x(k, :), wp), 32.0_wp*eps, 1.0_wp, &
            "terms of " // to_text(k))
         call check_near(error, real(sum(row), wp), 1.0_wp, 32.0_wp*eps, 1.0_wp, "their sum")
      end do
   end subroutine test_chain

   !> Two freedoms that follow each other twice, the second time with prescribed ones: exact.
   subroutine test_left(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(row_elimination_t) :: elimination
      integer, allocatable :: fate(:), start(:), column(:)
      real(hp), allocatable :: weight(:)

      call begin_sample(sample, 5, 3)
      call add_row(sample, [1, 2], [1.0_hp, -1.0_hp], 1)
      call add_row(sample, [2, 1, 4, 5, 3], [2.0_hp, -2.0_hp, 3.0_hp, -1.0_hp, 0.0_hp], 2)
      call eliminate(elimination, sample, fate)
      call check_equal(error, fate, [row_kept, row_redundant], "fates")
      call elimination_left(elimination, column, weight)
      call check_equal(error, column, [4, 5], "columns left")
      call check_near(error, real(weight, wp), [3.0_wp, -1.0_wp], 0.0_wp, 1.0_wp, "weights left")
      call elimination_resolve(elimination, start, column, weight)
      call check_equal(error, start, [0, 1, 1], "no terms of a redundant row")
   end subroutine test_left

   subroutine test_empty(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(row_elimination_t) :: elimination
      integer, allocatable :: fate(:), start(:), column(:)
      real(hp), allocatable :: weight(:)

      call begin_sample(sample, 4, 2)
      call add_row(sample, [3, 4], [1.0_hp, -1.0_hp], 3)
      call add_row(sample, [1, 1], [1.0_hp, -1.0_hp], 1)
      call add_row(sample, [integer ::], [real(hp) ::], 1)
      call add_row(sample, [2], [5.0_hp], 2)
      call add_row(sample, [1, 2, 3], [1.0_hp, 7.0_hp, 2.0_hp], 3)
      call eliminate(elimination, sample, fate)
      call check_equal(error, fate, [row_redundant, row_redundant, row_redundant, row_kept, &
         row_kept], "fates")
      call elimination_resolve(elimination, start, column, weight)
      call check_equal(error, elimination%pivot, [0, 0, 0, 2, 1], "pivots")
      call check_equal(error, start, [0, 0, 0, 0, 0, 1], "a single freedom stays where it is")
      call check_equal(error, column, [3], "prescribed freedoms are terms")
      call check_near(error, real(weight, wp), [-2.0_wp], 0.0_wp, 1.0_wp, "weights")
   end subroutine test_empty

   !> A row's own column is taken unless another one is more than ten times as large, or prescribed.
   subroutine test_own(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(row_elimination_t) :: elimination
      integer, allocatable :: fate(:)

      call begin_sample(sample, 7, 6)
      call add_row(sample, [1, 2], [8.0_hp, 1.0_hp], 2)
      call add_row(sample, [3, 4], [16.0_hp, 1.0_hp], 4)
      call add_row(sample, [5, 7], [1.0_hp, 16.0_hp], 7)
      call eliminate(elimination, sample, fate)
      call check_equal(error, elimination%pivot, [2, 3, 5], "pivots")
   end subroutine test_own

   !> Two kinds of a row without a common unknown.
   subroutine test_poor(error)
      type(error_t), allocatable, intent(out) :: error
      type(row_elimination_t) :: elimination
      integer :: fate
      integer, allocatable :: start(:), column(:)
      real(hp), allocatable :: weight(:)

      call elimination_begin(elimination, 2, 3, 3)
      call elimination_add(elimination, [1, 2], [1.0_hp, 0.0_hp], [0.0_hp, 1.0_hp], [1], fate)
      call check_equal(error, fate, row_poor, "fate")
      call elimination_add(elimination, [1, 3], [2.0_hp, 1.0_hp], [2.0_hp, 1.0_hp], [1], fate)
      call check_equal(error, fate, row_kept, "fate of the next row")
      call check_equal(error, elimination%pivot, [0, 1], "pivots")
      call elimination_resolve(elimination, start, column, weight)
      call check_equal(error, start, [0, 0, 1], "terms")
      call check_near(error, real(weight, wp), [-0.5_wp], 0.0_wp, 1.0_wp, "weights")
   end subroutine test_poor

   !> Rows times powers of two, in an object that has seen other rows and another width.
   subroutine test_again(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample, other
      type(row_elimination_t) :: fresh, used
      integer, allocatable :: fate(:), start(:), column(:), start2(:), column2(:)
      real(hp), allocatable :: weight(:), weight2(:)
      integer :: k, pass

      call make_random(other)
      call make_random(sample)
      call eliminate(fresh, sample, fate)
      call elimination_resolve(fresh, start, column, weight)
      call eliminate(used, other, fate)
      do pass = 1, 2
         do k = 1, sample%n_row
            associate (value => sample%value(sample%start(k) + 1:sample%start(k + 1)))
               value = scale(value, mod(7*k, 41) - 20)
            end associate
         end do
         if (pass == 2) then
            call begin_sample(other, 3, 3)
            call add_row(other, [1, 2, 3], [1.0_hp, 2.0_hp, 3.0_hp], 1)
            call eliminate(used, other, fate)
         end if
         call eliminate(used, sample, fate)
         call elimination_resolve(used, start2, column2, weight2)
         call check_equal(error, used%pivot, fresh%pivot, "pivots")
         call check_equal(error, start2, start, "starts")
         call check_equal(error, column2, column, "columns")
         call check_true(error, all(weight2 == weight), "weights, bit by bit")
      end do
   end subroutine test_again

end module test_row_elimination
