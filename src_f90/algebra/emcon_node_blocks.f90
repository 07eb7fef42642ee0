! build: streams
!> Symmetric sparse matrices by blocks of up to three unknowns, and their products with vectors.
!>
!> Unknowns that follow each other and meet the same others, as those of a node do, are a block,
!> filled up by unknowns of their own where they are fewer. Blocks are numbered breadth first from
!> both ends of the mesh to its middle, so that neighbours are near in memory, incomplete factors
!> are good, and two threads work from the ends to the same bits as one does.
!> Only the lower triangle of blocks is kept: a third of what rows of single entries take.
!> Source: H. A. van der Vorst, Parallel Comput. 5 (1987) 45-54.
module emcon_node_blocks
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_sort, only : find_sorted
   implicit none
   private
   public :: node_blocks_t, node_blocks_init, node_blocks_fill, node_blocks_take_row, &
      node_blocks_multiply, node_blocks_is_of, node_blocks_matrix, node_blocks_quotient, &
      node_blocks_are_shared, n_side, n_end

   !> Unknowns of a block, and ends of the mesh that rows are numbered from.
   integer, parameter :: n_side = 3, n_end = 2
   !> Blocks that are worth a second thread.
   integer, parameter :: least_shared = 512

   type :: node_blocks_t
      integer :: n = 0                           !! unknowns
      integer :: n_block = 0
      integer :: n_slot = 0                      !! of the matrix by single entries
      integer :: n_thread = 1                    !! that may work on products
      !> Rows before those of each end, and of the middle: an end meets itself and the middle
      integer :: first_row(n_end + 1) = 0
      integer, allocatable :: place(:)           !! (n) of each unknown in a vector of blocks
      integer, allocatable :: row_start(:)       !! (n_block + 1) blocks before each row
      integer, allocatable :: column(:)          !! ascending in each row, its own block last
      real(dp), allocatable :: value(:, :, :)    !! (n_side, n_side, blocks)
      ! In the order of the unknowns:
      integer, allocatable, private :: first(:)  !! (n_block + 1) unknowns before each block
      integer, allocatable, private :: start(:)  !! (n_block + 1) before those that it meets
      integer, allocatable, private :: met(:)    !! ascending, itself among them
      integer, allocatable, private :: number(:) !! (n_block) of each as numbered above
      integer, private :: taken = 0              !! block of the row that was taken last
   end type node_blocks_t

   !> Blocks as they are walked through.
   type :: walk_t
      integer, allocatable :: block(:)           !! (n_block) in this order
      logical, allocatable :: is_listed(:)       !! (n_block)
      integer :: n = 0                           !! listed so far
      integer :: last = 0                        !! of them
   end type walk_t

contains

   !> Find the blocks of a symmetric pattern, and lay out their lower triangle.
   pure subroutine node_blocks_init(self, matrix)
      type(node_blocks_t), intent(out) :: self
      type(csr_t), intent(in) :: matrix
      integer, allocatable :: order(:)
      integer :: b, i

      self%n = matrix%n_row
      self%n_slot = matrix%row_start(self%n + 1)
      call find_blocks(self, matrix)
      call order_blocks(self, order)
      call turn_second_end(self, order)
      allocate(self%number(self%n_block), self%place(self%n), source=0)
      self%number(order) = [(b, b = 1, self%n_block)]
      do b = 1, self%n_block
         do i = self%first(b) + 1, self%first(b + 1)
            self%place(i) = n_side*(self%number(b) - 1) + i - self%first(b)
         end do
      end do
      call lay_out(self, order)
      allocate(self%value(n_side, n_side, self%row_start(self%n_block + 1)), source=0.0_dp)
   end subroutine node_blocks_init

   !> Unknowns that follow each other with the same columns, three at most, and what they meet.
   pure subroutine find_blocks(self, matrix)
      type(node_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      integer, allocatable :: of(:), first(:)
      integer :: b, c, i, k, n, pass
      logical :: is_new

      allocate(of(self%n), first(self%n + 1), source=0)
      n = 0
      do i = 1, self%n
         is_new = i == 1
         if (.not. is_new) is_new = i - first(n) > n_side &
            .or. .not. has_same_columns(matrix, i - 1, i)
         if (is_new) n = n + 1
         if (is_new) first(n) = i - 1
         of(i) = n
      end do
      first(n + 1) = self%n
      self%n_block = n
      self%first = first(:n + 1)
      allocate(self%start(n + 1), source=0)
      do pass = 1, 2
         n = 0
         do b = 1, self%n_block
            c = 0
            do k = matrix%row_start(first(b) + 1) + 1, matrix%row_start(first(b) + 2)
               if (of(matrix%column(k) + 1) == c) cycle
               c = of(matrix%column(k) + 1)
               n = n + 1
               if (pass == 2) self%met(n) = c
            end do
            self%start(b + 1) = n
         end do
         if (pass == 1) allocate(self%met(n), source=0)
      end do
   end subroutine find_blocks

   !> The symmetric pattern by which the blocks of a pattern meet, in the order of the unknowns.
   pure subroutine node_blocks_quotient(matrix, quotient)
      type(csr_t), intent(in) :: matrix          !! symmetric, its values are not read
      type(csr_t), intent(out) :: quotient       !! without values
      type(node_blocks_t) :: blocks

      blocks%n = matrix%n_row
      call find_blocks(blocks, matrix)
      quotient%n_row = blocks%n_block
      quotient%n_col = blocks%n_block
      call move_alloc(blocks%start, quotient%row_start)
      quotient%column = blocks%met - 1
   end subroutine node_blocks_quotient

   pure logical function has_same_columns(matrix, i, j)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: i, j

      associate (start => matrix%row_start, column => matrix%column)
         has_same_columns = start(i + 1) - start(i) == start(j + 1) - start(j)
         if (has_same_columns) has_same_columns = all(column(start(i) + 1:start(i + 1)) &
            == column(start(j) + 1:start(j + 1)))
      end associate
   end function has_same_columns

   !> Breadth first, part by part, from what is reached last from what is reached last.
   pure subroutine order_blocks(self, order)
      type(node_blocks_t), intent(in) :: self
      integer, allocatable, intent(out) :: order(:)      !! (n_block)
      type(walk_t) :: way
      integer :: b, before, pass

      allocate(way%block(self%n_block), source=0)
      allocate(way%is_listed(self%n_block), source=.false.)
      before = 0
      do b = 1, self%n_block
         if (way%is_listed(b)) cycle
         call walk(way, self, b)
         do pass = 1, 2
            way%is_listed(way%block(before + 1:way%n)) = .false.
            way%n = before
            call walk(way, self, way%last)
         end do
         before = way%n
      end do
      call move_alloc(way%block, order)
   end subroutine order_blocks

   !> Put the blocks of the first half that meet the second one behind both, and the second half in
   !> front of them from its far end on.
   pure subroutine turn_second_end(self, order)
      type(node_blocks_t), intent(inout) :: self
      integer, intent(inout) :: order(:)         !! (n_block)
      integer, parameter :: n_pass = 3           ! ends of one size, as the middle's is known better
      integer :: at(self%n_block), i, n_first, n_middle, pass
      logical :: is_middle(self%n_block)

      at(order) = [(i, i = 1, self%n_block)]
      n_middle = 0
      do pass = 1, n_pass
         n_first = (self%n_block + n_middle)/n_end
         do i = 1, self%n_block
            associate (met => self%met(self%start(order(i)) + 1:self%start(order(i) + 1)))
               is_middle(i) = i <= n_first .and. any(at(met) > n_first)
            end associate
         end do
         n_middle = count(is_middle)
      end do
      self%first_row = [0, n_first - n_middle, self%n_block - n_middle]
      order = [pack(order(:n_first), .not. is_middle(:n_first)), &
         order(self%n_block:n_first + 1:-1), pack(order(:n_first), is_middle(:n_first))]
   end subroutine turn_second_end

   !> List the blocks that hang together with `seed` behind those listed so far.
   pure subroutine walk(self, blocks, seed)
      type(walk_t), intent(inout) :: self
      type(node_blocks_t), intent(in) :: blocks
      integer, intent(in), value :: seed
      integer :: at, k, c

      at = self%n
      self%n = at + 1
      self%block(self%n) = seed
      self%is_listed(seed) = .true.
      do while (at < self%n)
         at = at + 1
         do k = blocks%start(self%block(at)) + 1, blocks%start(self%block(at) + 1)
            c = blocks%met(k)
            if (self%is_listed(c)) cycle
            self%is_listed(c) = .true.
            self%n = self%n + 1
            self%block(self%n) = c
         end do
      end do
      self%last = self%block(self%n)
   end subroutine walk

   !> The pattern of the lower triangle.
   pure subroutine lay_out(self, order)
      type(node_blocks_t), intent(inout) :: self
      integer, intent(in) :: order(:)            !! (n_block)
      integer :: b, k, m, n

      ! Each pair of blocks that meet is once in the triangle.
      allocate(self%row_start(self%n_block + 1), source=0)
      allocate(self%column((size(self%met) + self%n_block)/2), source=0)
      n = 0
      do b = 1, self%n_block
         m = n
         do k = self%start(order(b)) + 1, self%start(order(b) + 1)
            if (self%number(self%met(k)) > b) cycle
            n = n + 1
            self%column(n) = self%number(self%met(k))
         end do
         self%column(m + 1:n) = sorted(self%column(m + 1:n))
         self%row_start(b + 1) = n
      end do
   end subroutine lay_out

   !> A short list in ascending order.
   pure function sorted(list)
      integer, intent(in) :: list(:)
      integer :: sorted(size(list))
      integer :: i, j

      do i = 1, size(list)
         do j = i, 2, -1
            if (sorted(j - 1) <= list(i)) exit
            sorted(j) = sorted(j - 1)
         end do
         sorted(j) = list(i)
      end do
   end function sorted

   !> Is the pattern of a matrix the one that was laid out?
   pure logical function node_blocks_is_of(self, matrix) result(is_same)
      type(node_blocks_t), intent(in) :: self
      type(csr_t), intent(in) :: matrix
      integer :: b, c, i, k, t

      is_same = self%n == matrix%n_row .and. self%n == matrix%n_col .and. self%n > 0
      if (is_same) is_same = self%n_slot == matrix%row_start(self%n + 1)
      if (.not. is_same) return
      k = 0
      do b = 1, self%n_block
         do i = self%first(b) + 1, self%first(b + 1)
            do t = self%start(b) + 1, self%start(b + 1)
               do c = self%first(self%met(t)), self%first(self%met(t) + 1) - 1
                  k = k + 1
                  is_same = k <= self%n_slot
                  if (is_same) is_same = matrix%column(k) == c
                  if (.not. is_same) return
               end do
            end do
            is_same = matrix%row_start(i + 1) == k
            if (.not. is_same) return
         end do
      end do
   end function node_blocks_is_of

   !> Take `factor` times the values of a matrix of the pattern.
   pure subroutine node_blocks_fill(self, factor, value)
      type(node_blocks_t), intent(inout) :: self
      real(dp), intent(in) :: factor
      real(dp), intent(in), contiguous :: value(:)       !! (n_slot) of the pattern
      integer :: i, k, n

      k = 0
      do i = 1, self%n
         n = row_length(self, i)
         call node_blocks_take_row(self, i, factor, value(k + 1:k + n))
         k = k + n
      end do
   end subroutine node_blocks_fill

   !> The entries of row `i` of the pattern, behind the rows before it.
   pure integer function row_length(self, i)
      type(node_blocks_t), intent(in) :: self
      integer, intent(in) :: i
      integer :: t

      row_length = 0
      associate (b => block_behind(self, i))
         do t = self%start(b) + 1, self%start(b + 1)
            row_length = row_length + self%first(self%met(t) + 1) - self%first(self%met(t))
         end do
      end associate
   end function row_length

   !> The block of row `i`, where rows before it were taken last.
   pure integer function block_behind(self, i) result(b)
      type(node_blocks_t), intent(in) :: self
      integer, intent(in) :: i

      b = 1
      if (i > 1) b = merge(self%taken + 1, self%taken, i > self%first(self%taken + 1))
   end function block_behind

   !> Take `factor` times the values of row `i`; rows come one after the other, from the first on.
   pure subroutine node_blocks_take_row(self, i, factor, value)
      type(node_blocks_t), intent(inout) :: self
      integer, intent(in) :: i
      real(dp), intent(in) :: factor
      real(dp), intent(in), contiguous :: value(:)       !! of the row's entries
      integer :: b, k, n, p, t

      b = block_behind(self, i)
      self%taken = b
      p = i - self%first(b)
      associate (row => self%number(b))
         if (p == 1) call clear_row(self, b)
         k = 0
         do t = self%start(b) + 1, self%start(b + 1)
            n = self%first(self%met(t) + 1) - self%first(self%met(t))
            associate (c => self%number(self%met(t)))
               if (c <= row) self%value(p, :n, slot_of(self, row, c)) = factor*value(k + 1:k + n)
            end associate
            k = k + n
         end do
      end associate
   end subroutine node_blocks_take_row

   !> No values in the blocks before and on the diagonal in the row of block `b`, and one at the
   !> unknowns that fill it up.
   pure subroutine clear_row(self, b)
      type(node_blocks_t), intent(inout) :: self
      integer, intent(in) :: b
      integer :: p

      associate (row => self%number(b))
         self%value(:, :, self%row_start(row) + 1:self%row_start(row + 1)) = 0.0_dp
         do p = self%first(b + 1) - self%first(b) + 1, n_side
            self%value(p, p, self%row_start(row + 1)) = 1.0_dp
         end do
      end associate
   end subroutine clear_row

   !> `factor` times the matrix by single entries, in full.
   pure subroutine node_blocks_matrix(self, factor, matrix)
      type(node_blocks_t), intent(in) :: self
      real(dp), intent(in) :: factor
      type(csr_t), intent(out) :: matrix
      integer :: b, c, i, k, p, q, t, at

      matrix%n_row = self%n
      matrix%n_col = self%n
      allocate(matrix%row_start(self%n + 1), matrix%column(self%n_slot), source=0)
      allocate(matrix%value(self%n_slot), source=0.0_dp)
      k = 0
      do b = 1, self%n_block
         do i = self%first(b) + 1, self%first(b + 1)
            p = i - self%first(b)
            do t = self%start(b) + 1, self%start(b + 1)
               c = self%met(t)
               at = slot_of(self, max(self%number(b), self%number(c)), &
                  min(self%number(b), self%number(c)))
               do q = 1, self%first(c + 1) - self%first(c)
                  k = k + 1
                  matrix%column(k) = self%first(c) + q - 1
                  if (self%number(c) <= self%number(b)) then
                     matrix%value(k) = factor*self%value(p, q, at)
                  else
                     matrix%value(k) = factor*self%value(q, p, at)
                  end if
               end do
            end do
            matrix%row_start(i + 1) = k
         end do
      end do
   end subroutine node_blocks_matrix

   !> The place of a block of the lower triangle.
   pure integer function slot_of(self, row, column)
      type(node_blocks_t), intent(in) :: self
      integer, intent(in) :: row, column

      associate (first => self%row_start(row))
         slot_of = first + find_sorted(self%column(first + 1:self%row_start(row + 1)), column)
      end associate
   end function slot_of

   !> Do threads share the work on the ends?
   pure logical function node_blocks_are_shared(self) result(are_shared)
      type(node_blocks_t), intent(in) :: self

      are_shared = self%n_thread > 1 .and. self%n_block >= least_shared
   end function node_blocks_are_shared

   !> y = A x, vectors of blocks.
   subroutine node_blocks_multiply(self, x, y)
      type(node_blocks_t), intent(in) :: self
      real(dp), intent(in) :: x(n_side, self%n_block)
      real(dp), intent(out) :: y(n_side, self%n_block)
      integer :: e

      if (node_blocks_are_shared(self)) then
         !$omp parallel do default(none) shared(self, x, y) num_threads(self%n_thread) &
         !$omp schedule(static, 1)
         do e = 1, n_end
            call multiply_rows(self, self%first_row(e), self%first_row(e + 1), x, y)
         end do
         !$omp end parallel do
      else
         call multiply_rows(self, 0, self%first_row(n_end + 1), x, y)
      end if
      call multiply_rows(self, self%first_row(n_end + 1), self%n_block, x, y)
   end subroutine node_blocks_multiply

   !> What the lower triangle has in the rows behind `before` up to `last`, and across the diagonal.
   pure subroutine multiply_rows(self, before, last, x, y)
      type(node_blocks_t), intent(in) :: self
      integer, intent(in) :: before, last
      real(dp), intent(in) :: x(n_side, self%n_block)
      real(dp), intent(inout) :: y(n_side, self%n_block)
      real(dp) :: own(n_side), total(n_side)
      integer :: b, c, j, k

      do b = before + 1, last
         own = x(:, b)
         total = 0.0_dp
         do k = self%row_start(b) + 1, self%row_start(b + 1) - 1
            c = self%column(k)
            do j = 1, n_side
               total = total + self%value(:, j, k)*x(j, c)
               y(j, c) = y(j, c) + dot_product(self%value(:, j, k), own)
            end do
         end do
         k = self%row_start(b + 1)
         do j = 1, n_side
            y(j, b) = total(j) + dot_product(self%value(:, j, k), own)
         end do
      end do
   end subroutine multiply_rows

end module emcon_node_blocks
