!> An order of rows in which elimination fills them little.
module test_row_order
   use check, only : check_equal, check_true, test_case_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, hp
   use emcon_row_elimination, only : elimination_add, elimination_begin, elimination_entries, &
      elimination_resolve, row_elimination_t, row_kept
   use emcon_row_order, only : row_order_nested
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_row_order

contains

   subroutine collect_row_order(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a chain that does not decay", test_chain), &
         test_case_t("a band as wide as its halves", test_band), &
         test_case_t("rows in any order, in pieces, with a column of all", test_pieces)]
   end subroutine collect_row_order

   !> x_k - x_(k-1) + y_k = 0 in the order `at` of the rows; `cut` > 0: each `cut`-th one has no
   !> x_(k-1). All have one more column if `is_tied`. Behind the last row room is left.
   subroutine make_chain(at, cut, is_tied, rows)
      integer, intent(in) :: at(:), cut
      logical, intent(in) :: is_tied
      type(csr_t), intent(out) :: rows
      integer :: i, k, m, n

      n = size(at)
      rows%n_row = n
      rows%n_col = 2*n + 1
      allocate(rows%row_start(n + 1), rows%column(4*n + 3), source=0)
      allocate(rows%value(4*n + 3), source=0.0_dp)
      m = 0
      do i = 1, n
         k = at(i)
         if (k > 1 .and. .not. begins(k)) call put(k - 1, -1.0_dp)
         call put(k, 1.0_dp)
         call put(n + k, 1.0_dp)
         if (is_tied) call put(2*n + 1, 1.0_dp)
         rows%row_start(i + 1) = m
      end do

   contains

      pure logical function begins(k)
         integer, intent(in) :: k

         begins = .false.
         if (cut > 0) begins = mod(k, cut) == 0
      end function begins

      subroutine put(column, value)
         integer, intent(in) :: column
         real(dp), intent(in) :: value

         m = m + 1
         rows%column(m) = column - 1
         rows%value(m) = value
      end subroutine put

   end subroutine make_chain

   !> Eliminate x_`at(order(i))` from the rows in the order `order`.
   subroutine eliminate(error, rows, at, order, elimination)
      type(error_t), allocatable, intent(inout) :: error
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: at(:), order(:)
      type(row_elimination_t), intent(out) :: elimination
      integer :: i, fate

      call elimination_begin(elimination, rows%n_row, rows%n_col, rows%n_col)
      do i = 1, size(order)
         associate (k => order(i))
            associate (from => rows%row_start(k) + 1, to => rows%row_start(k + 1))
               call elimination_add(elimination, rows%column(from:to) + 1, &
                  real(rows%value(from:to), hp), real(rows%value(from:to), hp), [at(k)], fate)
            end associate
            call check_equal(error, fate, row_kept, "row " // to_text(k))
            call check_equal(error, elimination%pivot(i), at(k), "pivot " // to_text(i))
         end associate
      end do
   end subroutine eliminate

   pure logical function is_permutation(order)
      integer, intent(in) :: order(:)
      logical :: is_there(size(order))

      is_there = .false.
      is_there(order) = .true.
      is_permutation = all(is_there)
   end function is_permutation

   !> In its own order row k holds y_1 to y_k. Nested, each row holds at most the y between two
   !> cuts, whose distance halves from level to level, and x beside them; rows that are not cut
   !> further hold those of 17 rows. x_k = -(y_1 + ... + y_k) comes out of both to the last bit.
   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 512, levels = 9, most = n*(levels + 17 + 2)
      type(csr_t) :: rows
      type(row_elimination_t) :: elimination
      integer, allocatable :: start(:), column(:)
      real(hp), allocatable :: weight(:)
      integer :: at(n), order(n), i, k

      at = [(k, k = 1, n)]
      call make_chain(at, 0, .false., rows)
      call eliminate(error, rows, at, at, elimination)
      call check_equal(error, elimination_entries(elimination), n*(n + 1)/2, "in their order")
      call row_order_nested(rows, order)
      call check_true(error, is_permutation(order), "a permutation")
      if (allocated(error)) return
      call eliminate(error, rows, at, order, elimination)
      call check_true(error, elimination_entries(elimination) <= most, "nested: " &
         // to_text(elimination_entries(elimination)) // " of " // to_text(most) // " entries")
      call elimination_resolve(elimination, start, column, weight)
      do i = 1, n
         associate (from => start(i) + 1, to => start(i + 1), y => order(i))
            call check_equal(error, column(from:to), [(n + k, k = 1, y)], "terms")
            call check_true(error, all(abs(weight(from:to) + 1.0_hp) <= 0.0_hp), "weights")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_chain

   !> Each row shares a column with so many before it that a half of a half is not cut off by what
   !> cuts the halves: each row stands in the order once.
   subroutine test_band(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 100, width = 30
      type(csr_t) :: rows
      integer :: order(n), i, k, m

      rows%n_row = n
      rows%n_col = n + width
      rows%row_start = [(width*(i - 1), i = 1, n + 1)]
      rows%column = [((i + k, k = 0, width - 1), i = 0, n - 1)]
      rows%value = [(1.0_dp, m = 1, n*width)]
      call row_order_nested(rows, order)
      call check_true(error, is_permutation(order), "a permutation")
   end subroutine test_band

   !> The chain in pieces of a hundred rows, turned inside out. Where all rows share a column
   !> nothing keeps halves apart, and an order there is all the same.
   subroutine test_pieces(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 700, piece = 100, levels = 3, most = n*(levels + 17 + 2)
      type(csr_t) :: rows
      type(row_elimination_t) :: elimination
      integer :: at(n), order(n), k

      at = [(1 + mod(197*k, n), k = 1, n)]
      call make_chain(at, piece, .false., rows)
      call row_order_nested(rows, order)
      call check_true(error, is_permutation(order), "a permutation")
      if (allocated(error)) return
      call eliminate(error, rows, at, order, elimination)
      call check_true(error, elimination_entries(elimination) <= most, "pieces: " &
         // to_text(elimination_entries(elimination)) // " of " // to_text(most) // " entries")
      call make_chain(at, 0, .true., rows)
      call row_order_nested(rows, order)
      call check_true(error, is_permutation(order), "with a column of all")
   end subroutine test_pieces

end module test_row_order
