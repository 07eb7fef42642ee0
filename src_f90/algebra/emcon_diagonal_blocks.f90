!> Factors L L^T of a symmetric definite matrix that falls apart into blocks on its diagonal, one
!> for each: blocks whose values stay the same keep theirs. Threads share the blocks, or work
!> together on each of those that are iterated.
!>
!> Blocks are the parts in which the pattern hangs together; small ones are taken together. The
!> order of the unknowns in L is block by block, so that the bits do not depend on who works on
!> which of them.
module emcon_diagonal_blocks
   use emcon_csr, only : csr_find, csr_is_symmetric, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp
   use emcon_power_scaling, only : power_of_two
   use emcon_row_panels, only : panels_append, row_panel_t
   use emcon_sort, only : sort_order
   use emcon_sparse_solver, only : sparse_solver_t
   implicit none
   private
   public :: diagonal_blocks_t, blocks_analyse, blocks_factorise, blocks_solve, blocks_reach, &
      blocks_has_panels, blocks_reach_rows, blocks_multiply, blocks_free, blocks_let_threads

   !> Parts of fewer than the n-th part of the unknowns are put together.
   integer, parameter :: smallest_part = 64

   type :: block_t
      integer :: first = 0                       !! unknowns of the blocks before it
      integer, allocatable :: unknown(:)         !! (n) ascending
      logical :: is_range = .false.              !! which follow each other
      !> Scale times the symmetric part; without values until there is a factor. A solver that takes
      !> rows has values and pattern: here are no columns then
      type(csr_t) :: matrix
      integer, allocatable :: upper(:)           !! (n) work space: places in the rows
      real(dp), allocatable :: b(:), image(:)    !! (n) work space, where they do not
      class(sparse_solver_t), allocatable :: solver
      logical :: has_factor = .false.            !! of these values
      integer :: n_factor = 0                    !! factors made so far
      type(error_t), allocatable :: error        !! of the last call
   end type block_t

   type :: diagonal_blocks_t
      class(sparse_solver_t), allocatable :: kind      !! solvers are copies of it; it has halves
      logical :: may_be_rough = .false.          !! as of solvers, set before `blocks_analyse`
      real(dp) :: accuracy = 0.0_dp              !! the same
      logical :: is_incomplete = .false.         !! some block's factors are
      !> Entries and operations of complete factors, as far as solvers predict them
      real(dp) :: n_entry = 0.0_dp, n_operation = 0.0_dp
      integer :: n_thread = 1                    !! that may work on the blocks
      integer :: n_block = 0
      integer :: n_factor = 0                    !! factors of blocks made of this pattern
      logical :: is_symmetric = .false.          !! the pattern is, with all of the diagonal
      real(dp) :: scale = 1.0_dp                 !! > 0, a power of two: L L^T = scale A
      type(block_t), allocatable, private :: block(:)
      integer, allocatable, private :: of(:)     !! (n) block of each unknown
      integer, allocatable, private :: place(:)  !! (n) and its number in there
   end type diagonal_blocks_t

contains

   !> Let `n` threads work on the blocks.
   pure subroutine blocks_let_threads(self, n)
      type(diagonal_blocks_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 1
      integer :: b

      self%n_thread = n
      do b = 1, self%n_block
         if (allocated(self%block(b)%solver)) call self%block(b)%solver%let_threads(n)
      end do
   end subroutine blocks_let_threads

   !> Find the blocks of a square pattern, and order each; nothing is done if it is the last one.
   subroutine blocks_analyse(self, matrix, is_new, error)
      type(diagonal_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_new             !! it is another pattern
      type(error_t), allocatable, intent(out) :: error
      integer :: b
      logical :: is_known

      call compare(self, matrix, is_known, error)
      is_new = .not. is_known
      if (is_known .or. allocated(error)) return
      call blocks_free(self)
      call find_blocks(self, matrix)
      self%n_entry = 0.0_dp
      self%n_operation = 0.0_dp
      self%is_symmetric = .true.
      do b = 1, self%n_block
         call begin_block(self%block(b))
         call extract(self, self%block(b)%unknown, matrix, self%block(b)%matrix)
         self%is_symmetric = self%is_symmetric .and. csr_is_symmetric(self%block(b)%matrix)
         if (.not. self%is_symmetric) return
         allocate(self%block(b)%solver, source=self%kind)
         self%block(b)%solver%needs_halves = .true.
         self%block(b)%solver%may_be_rough = self%may_be_rough
         self%block(b)%solver%accuracy = self%accuracy
         self%block(b)%solver%is_scaled = .true.
         call self%block(b)%solver%let_threads(self%n_thread)
         call self%block(b)%solver%analyse(self%block(b)%matrix, error)
         if (allocated(error)) return
         if (self%block(b)%solver%takes_rows()) deallocate(self%block(b)%matrix%column)
         self%n_entry = self%n_entry + real(self%block(b)%solver%n_factor, dp)
         self%n_operation = self%n_operation + self%block(b)%solver%n_operation
      end do
   end subroutine blocks_analyse

   !> Is it the pattern of the blocks?
   subroutine compare(self, matrix, is_known, error)
      type(diagonal_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_known
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: present
      integer :: b, before

      is_known = allocated(self%block) .and. allocated(self%of)
      if (is_known) is_known = size(self%of) == matrix%n_row
      do b = 1, self%n_block
         if (.not. is_known) return
         ! Behind one that is not symmetric no block has a pattern.
         if (allocated(self%block(b)%matrix%column) .or. .not. allocated(self%block(b)%solver)) then
            is_known = is_pattern_of(self%block(b), matrix)
            cycle
         end if
         associate (block => self%block(b))
            is_known = keeps_within(self, b, matrix)
            if (.not. is_known) return
            call extract(self, block%unknown, matrix, present)
            before = block%solver%n_analysis
            call block%solver%analyse(present, error)
            if (allocated(error)) return
            is_known = block%solver%n_analysis == before
         end associate
      end do
   end subroutine compare

   !> Is it the pattern of a block that has one?
   pure logical function is_pattern_of(block, matrix) result(is_known)
      type(block_t), intent(in) :: block
      type(csr_t), intent(in) :: matrix
      integer :: i, from, to

      associate (rows => block%matrix)
         is_known = .true.
         do i = 1, rows%n_row
            from = matrix%row_start(block%unknown(i)) + 1
            to = matrix%row_start(block%unknown(i) + 1)
            is_known = to - from + 1 == rows%row_start(i + 1) - rows%row_start(i)
            if (is_known) is_known = all(matrix%column(from:to) + 1 &
               == block%unknown(rows%column(rows%row_start(i) + 1:rows%row_start(i + 1)) + 1))
            if (.not. is_known) return
         end do
      end associate
   end function is_pattern_of

   !> Do the unknowns of block `b` meet none of others?
   pure logical function keeps_within(self, b, matrix)
      type(diagonal_blocks_t), intent(in) :: self
      integer, intent(in) :: b
      type(csr_t), intent(in) :: matrix
      integer :: i

      keeps_within = .true.
      do i = 1, size(self%block(b)%unknown)
         associate (first => matrix%row_start(self%block(b)%unknown(i)) + 1, &
               last => matrix%row_start(self%block(b)%unknown(i) + 1))
            keeps_within = all(self%of(matrix%column(first:last) + 1) == b)
         end associate
         if (.not. keeps_within) return
      end do
   end function keeps_within

   !> Which unknowns hang together: `of`, `place`, and the unknowns of the blocks, the largest one
   !> first.
   subroutine find_blocks(self, matrix)
      type(diagonal_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      integer :: number(matrix%n_row), b, i, k
      integer, allocatable :: extent(:), order(:)

      call number_parts(matrix, number, extent)
      call join_small(number, extent, matrix%n_row/smallest_part)
      self%n_block = size(extent)
      order = sort_order(-extent)
      allocate(self%block(self%n_block), self%of(matrix%n_row), self%place(matrix%n_row))
      k = 0
      do b = 1, self%n_block
         self%block(b)%first = k
         allocate(self%block(b)%unknown(extent(order(b))), source=0)
         k = k + extent(order(b))
      end do
      extent(order) = [(b, b = 1, self%n_block)]
      self%of = extent(number)
      extent = 0
      do i = 1, matrix%n_row
         b = self%of(i)
         extent(b) = extent(b) + 1
         self%place(i) = extent(b)
         self%block(b)%unknown(extent(b)) = i
      end do
   end subroutine find_blocks

   !> Number the parts of a pattern in the order of their first unknowns.
   pure subroutine number_parts(matrix, number, extent)
      type(csr_t), intent(in) :: matrix
      integer, intent(out) :: number(:)                !! (n)
      integer, allocatable, intent(out) :: extent(:)   !! (parts) unknowns of each
      integer :: root(matrix%n_row), i, j, k, n

      root = [(i, i = 1, matrix%n_row)]
      do i = 1, matrix%n_row
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1)
            j = root_of(root, i)
            n = root_of(root, matrix%column(k) + 1)
            root(max(j, n)) = min(j, n)
            root(i) = min(j, n)
         end do
      end do
      n = 0
      do i = 1, matrix%n_row
         root(i) = root_of(root, i)
         if (root(i) == i) n = n + 1
         if (root(i) == i) number(i) = n
         number(i) = number(root(i))
      end do
      allocate(extent(n), source=0)
      do i = 1, matrix%n_row
         extent(number(i)) = extent(number(i)) + 1
      end do
   end subroutine number_parts

   pure integer function root_of(root, i)
      integer, intent(in) :: root(:), i

      root_of = i
      do while (root(root_of) /= root_of)
         root_of = root(root_of)
      end do
   end function root_of

   !> Put parts of fewer than `least` unknowns together, in their order, until there are so many.
   pure subroutine join_small(number, extent, least)
      integer, intent(inout) :: number(:)                !! (n)
      integer, allocatable, intent(inout) :: extent(:)   !! (parts)
      integer, intent(in) :: least
      integer :: joined(size(extent)), size_of(size(extent)), open_one, n, b

      n = 0
      open_one = 0
      size_of = 0
      do b = 1, size(extent)
         if (extent(b) >= least .or. open_one == 0) then
            n = n + 1
            joined(b) = n
            if (extent(b) < least) open_one = n
         else
            joined(b) = open_one
         end if
         size_of(joined(b)) = size_of(joined(b)) + extent(b)
         if (joined(b) == open_one .and. size_of(joined(b)) >= least) open_one = 0
      end do
      number = joined(number)
      extent = size_of(:n)
   end subroutine join_small

   !> The work space of a block.
   pure subroutine begin_block(block)
      type(block_t), intent(inout) :: block      !! `unknown` is set
      integer :: n

      n = size(block%unknown)
      block%is_range = block%unknown(n) - block%unknown(1) == n - 1
      allocate(block%upper(n), source=0)
      if (.not. block%is_range) allocate(block%b(n), block%image(n), source=0.0_dp)
   end subroutine begin_block

   !> The pattern of the block of these unknowns, without values.
   pure subroutine extract(self, unknown, matrix, pattern)
      type(diagonal_blocks_t), intent(in) :: self
      integer, intent(in) :: unknown(:)          !! (n) all of a block
      type(csr_t), intent(in) :: matrix
      type(csr_t), intent(out) :: pattern
      integer :: i, k, n, m

      n = size(unknown)
      pattern%n_row = n
      pattern%n_col = n
      allocate(pattern%row_start(n + 1), source=0)
      do i = 1, n
         pattern%row_start(i + 1) = pattern%row_start(i) &
            + matrix%row_start(unknown(i) + 1) - matrix%row_start(unknown(i))
      end do
      m = pattern%row_start(n + 1)
      allocate(pattern%column(m), source=0)
      do i = 1, n
         m = pattern%row_start(i) - matrix%row_start(unknown(i))
         do k = matrix%row_start(unknown(i)) + 1, matrix%row_start(unknown(i) + 1)
            pattern%column(k + m) = self%place(matrix%column(k) + 1) - 1
         end do
      end do
   end subroutine extract

   !> Factorise the symmetric part of the matrix whose pattern was analysed, and is symmetric.
   subroutine blocks_factorise(self, matrix, is_singular, error)
      type(diagonal_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_singular        !! it is not definite: there are no factors
      type(error_t), allocatable, intent(out) :: error
      integer :: b

      is_singular = .not. matrix%value(csr_find(matrix, 1, 1)) > 0.0_dp
      if (is_singular) return
      self%scale = power_of_two(-exponent(matrix%value(csr_find(matrix, 1, 1))))
      do b = 1, self%n_block
         if (self%block(b)%solver%takes_rows()) call factorise_rows(self%block(b), matrix, &
            self%place, self%scale)
      end do
      !$omp parallel do default(none) shared(self, matrix) num_threads(self%n_thread) &
      !$omp schedule(dynamic, 1)
      do b = 1, self%n_block
         if (.not. self%block(b)%solver%takes_rows()) call factorise(self%block(b), matrix, &
            self%scale)
      end do
      !$omp end parallel do
      call take_error(self, error)
      self%n_factor = 0
      self%is_incomplete = .false.
      do b = 1, self%n_block
         self%is_incomplete = self%is_incomplete .or. self%block(b)%solver%is_incomplete
         is_singular = is_singular .or. .not. self%block(b)%has_factor
         self%n_factor = self%n_factor + self%block(b)%n_factor
      end do
   end subroutine blocks_factorise

   !> Factorise a block if its values have changed.
   subroutine factorise(block, matrix, scale)
      type(block_t), intent(inout) :: block
      type(csr_t), intent(in) :: matrix
      real(dp), intent(in) :: scale
      logical :: is_changed

      call take_values(block, matrix, scale, is_changed)
      if (block%has_factor .and. .not. is_changed) return
      block%has_factor = .false.
      block%n_factor = block%n_factor + 1
      call block%solver%factorise(block%matrix%value, block%error)
      block%has_factor = .not. (block%solver%is_singular .or. allocated(block%error))
   end subroutine factorise

   !> Factorise a block whose solver takes rows: entries meet those across the diagonal, which come
   !> in the order of the rows too.
   subroutine factorise_rows(block, matrix, place, scale)
      type(block_t), intent(inout) :: block
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: place(:)            !! (n) of the unknowns in their blocks
      real(dp), intent(in) :: scale
      real(dp) :: row(maxval(block%matrix%row_start(2:) &
         - block%matrix%row_start(:block%matrix%n_row)))
      integer :: i, j, k, from, n

      block%has_factor = .false.
      block%n_factor = block%n_factor + 1
      block%upper = matrix%row_start(block%unknown)      ! the last entry that was met
      do i = 1, block%matrix%n_row
         from = matrix%row_start(block%unknown(i))
         n = matrix%row_start(block%unknown(i) + 1) - from
         do k = 1, n
            j = place(matrix%column(from + k) + 1)
            block%upper(j) = block%upper(j) + 1
            row(k) = scale*0.5_dp*(matrix%value(from + k) + matrix%value(block%upper(j)))
         end do
         call block%solver%take_row(i, row(:n), block%error)
         if (allocated(block%error)) return
      end do
      call block%solver%factorise_rows(block%error)
      block%has_factor = .not. (block%solver%is_singular .or. allocated(block%error))
   end subroutine factorise_rows

   !> The values of a block: entries meet those across the diagonal in the order of the rows.
   pure subroutine take_values(block, matrix, scale, is_changed)
      type(block_t), intent(inout) :: block
      type(csr_t), intent(in) :: matrix
      real(dp), intent(in) :: scale
      logical, intent(out) :: is_changed
      real(dp) :: mean
      integer :: i, j, k, m, start

      is_changed = .not. allocated(block%matrix%value)
      if (is_changed) allocate(block%matrix%value(size(block%matrix%column)))
      associate (rows => block%matrix, upper => block%upper)
         do i = 1, rows%n_row
            start = matrix%row_start(block%unknown(i)) - rows%row_start(i)
            do k = rows%row_start(i) + 1, rows%row_start(i + 1)
               j = rows%column(k) + 1
               if (j > i) exit
               m = k
               if (j < i) m = upper(j)
               upper(j) = m + 1
               mean = scale*0.5_dp*(matrix%value(start + k) + matrix%value(m &
                  + matrix%row_start(block%unknown(j)) - rows%row_start(j)))
               if (.not. is_changed) is_changed = abs(mean - rows%value(k)) > 0.0_dp &
                  .or. mean /= mean
               rows%value(k) = mean
               rows%value(m) = mean
            end do
         end do
      end associate
   end subroutine take_values

   !> The first error of the blocks.
   subroutine take_error(self, error)
      type(diagonal_blocks_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: b

      do b = 1, self%n_block
         if (.not. allocated(self%block(b)%error)) cycle
         if (.not. allocated(error)) allocate(error, source=self%block(b)%error)
         deallocate(self%block(b)%error)
      end do
   end subroutine take_error

   !> x = L^-1 P rhs, or x = P^T L^-T rhs.
   subroutine blocks_solve(self, is_second, rhs, x, error)
      type(diagonal_blocks_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)       !! (n)
      real(dp), intent(inout), contiguous :: x(:)      !! (n)
      type(error_t), allocatable, intent(out) :: error
      integer :: b

      do b = 1, self%n_block
         if (is_alone(self, b)) call solve(self%block(b), is_second, rhs, x)
      end do
      if (are_shared(self)) then
         !$omp parallel do default(none) shared(self, is_second, rhs, x) &
         !$omp num_threads(self%n_thread) schedule(static, 1)
         do b = 1, self%n_block
            if (.not. is_alone(self, b)) call solve(self%block(b), is_second, rhs, x)
         end do
         !$omp end parallel do
      end if
      call take_error(self, error)
   end subroutine blocks_solve

   !> Is the work on block `b` no thread's share of that on all blocks?
   pure logical function is_alone(self, b)
      type(diagonal_blocks_t), intent(in) :: self
      integer, intent(in) :: b

      is_alone = self%n_thread == 1 .or. self%n_block == 1
      if (.not. is_alone) is_alone = self%block(b)%solver%takes_rows()
   end function is_alone

   !> Do threads take blocks? A team of one would ask the system for each barrier.
   pure logical function are_shared(self)
      type(diagonal_blocks_t), intent(in) :: self
      integer :: b

      are_shared = .false.
      do b = 1, self%n_block
         are_shared = are_shared .or. .not. is_alone(self, b)
      end do
   end function are_shared

   !> The part of a block of one half.
   subroutine solve(block, is_second, rhs, x)
      type(block_t), intent(inout) :: block
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)
      real(dp), intent(inout), contiguous :: x(:)
      integer :: n, from, at

      n = size(block%unknown)
      from = block%unknown(1) - 1                ! of the unknowns, where they are a range
      at = block%first
      if (block%is_range .and. is_second) then
         call block%solver%solve_half(is_second, rhs(at + 1:at + n), x(from + 1:from + n), &
            block%error)
      else if (block%is_range) then
         call block%solver%solve_half(is_second, rhs(from + 1:from + n), x(at + 1:at + n), &
            block%error)
      else if (is_second) then
         call block%solver%solve_half(is_second, rhs(at + 1:at + n), block%b, block%error)
         x(block%unknown) = block%b
      else
         block%b = rhs(block%unknown)
         call block%solver%solve_half(is_second, block%b, x(at + 1:at + n), block%error)
      end if
   end subroutine solve

   !> y = scale A x
   subroutine blocks_multiply(self, x, y, error)
      type(diagonal_blocks_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:)         !! (n)
      real(dp), intent(inout), contiguous :: y(:)      !! (n)
      type(error_t), allocatable, intent(out) :: error
      integer :: b

      do b = 1, self%n_block
         if (is_alone(self, b)) call multiply(self%block(b), x, y)
      end do
      if (are_shared(self)) then
         !$omp parallel do default(none) shared(self, x, y) num_threads(self%n_thread) &
         !$omp schedule(static, 1)
         do b = 1, self%n_block
            if (.not. is_alone(self, b)) call multiply(self%block(b), x, y)
         end do
         !$omp end parallel do
      end if
      call take_error(self, error)
   end subroutine blocks_multiply

   !> The part of a block.
   subroutine multiply(block, x, y)
      type(block_t), intent(inout) :: block
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      integer :: n, from

      n = size(block%unknown)
      from = block%unknown(1) - 1                ! of the unknowns, where they are a range
      if (block%is_range) then
         call multiply_part(block, x(from + 1:from + n), y(from + 1:from + n))
      else
         block%b = x(block%unknown)
         call multiply_part(block, block%b, block%image)
         y(block%unknown) = block%image
      end if
   end subroutine multiply

   !> The same, of the unknowns of the block.
   subroutine multiply_part(block, x, y)
      type(block_t), intent(inout) :: block
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      real(dp) :: total
      integer :: i, k

      if (block%solver%takes_rows()) then
         call block%solver%multiply(x, y, block%error)
         return
      end if
      associate (rows => block%matrix)
         do i = 1, rows%n_row
            total = 0.0_dp
            do k = rows%row_start(i) + 1, rows%row_start(i + 1)
               total = total + rows%value(k)*x(rows%column(k) + 1)
            end do
            y(i) = total
         end do
      end associate
   end subroutine multiply_part

   !> L^-1 P rhs of a sparse right-hand side: what of it is not zero.
   subroutine blocks_reach(self, column, value, n_reached, index, x, error)
      type(diagonal_blocks_t), intent(inout) :: self
      integer, intent(in), contiguous :: column(:)     !! (m) places of the entries, from 0
      real(dp), intent(in), contiguous :: value(:)     !! (m)
      integer, intent(out) :: n_reached                !! entries of the solution
      integer, intent(inout), contiguous :: index(:)   !! (n) their places, from 0
      real(dp), intent(inout), contiguous :: x(:)      !! (n) and values, the first n_reached
      type(error_t), allocatable, intent(out) :: error
      integer :: local(size(column)), b, m, n
      real(dp) :: part(size(column))
      integer :: k

      n_reached = 0
      b = 0
      do
         b = minval(self%of(column + 1), mask=self%of(column + 1) > b)
         if (b > self%n_block) return
         m = 0
         do k = 1, size(column)
            if (self%of(column(k) + 1) /= b) cycle
            m = m + 1
            local(m) = self%place(column(k) + 1) - 1
            part(m) = value(k)
         end do
         call self%block(b)%solver%reach_half(local(:m), part(:m), n, index(n_reached + 1:), &
            x(n_reached + 1:), error)
         if (allocated(error)) return
         index(n_reached + 1:n_reached + n) = index(n_reached + 1:n_reached + n) &
            + self%block(b)%first
         n_reached = n_reached + n
      end do
   end subroutine blocks_reach

   !> Do many right-hand sides go through the factors of all blocks together?
   pure logical function blocks_has_panels(self)
      type(diagonal_blocks_t), intent(in) :: self
      integer :: b

      blocks_has_panels = self%n_block > 0
      do b = 1, self%n_block
         if (blocks_has_panels) blocks_has_panels = self%block(b)%solver%has_panels()
      end do
   end function blocks_has_panels

   !> L^-1 P of many sparse right-hand sides, by panels; for who has them.
   subroutine blocks_reach_rows(self, rows, n, panel, error)
      type(diagonal_blocks_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows            !! of unknowns
      integer, intent(in) :: n                   !! the first ones of it
      type(row_panel_t), allocatable, intent(out) :: panel(:)
      type(error_t), allocatable, intent(out) :: error
      type(row_panel_t), allocatable :: own(:)
      integer :: start(n + 1), local(rows%row_start(n + 1)), b, i, k, m
      real(dp) :: part(size(local))

      allocate(panel(0))
      do b = 1, self%n_block
         m = 0
         do i = 1, n
            start(i) = m
            do k = rows%row_start(i) + 1, rows%row_start(i + 1)
               if (self%of(rows%column(k) + 1) /= b) cycle
               m = m + 1
               local(m) = self%place(rows%column(k) + 1) - 1
               part(m) = rows%value(k)
            end do
         end do
         start(n + 1) = m
         call self%block(b)%solver%reach_rows(start, local(:m), part(:m), own, error)
         if (allocated(error)) return
         call panels_append(panel, own, self%block(b)%first)
      end do
   end subroutine blocks_reach_rows

   !> Free what the solvers hold, and forget the pattern.
   subroutine blocks_free(self)
      type(diagonal_blocks_t), intent(inout) :: self
      integer :: b

      if (allocated(self%block)) then
         do b = 1, self%n_block
            if (allocated(self%block(b)%solver)) call self%block(b)%solver%free()
         end do
         deallocate(self%block)
      end if
      if (allocated(self%of)) deallocate(self%of, self%place)
      self%n_block = 0
      self%is_incomplete = .false.
   end subroutine blocks_free

end module emcon_diagonal_blocks
