!> Ends of slave chains of ties: which give their multipliers to their neighbours.
!>
!> Source: docs/theory.md, section 10.
module emcon_tie_ends
   use emcon_couplings, only : tie_rows_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: tie_ends_merge, tie_ends_take

   !> Entries of a row that ties a node to one other.
   integer, parameter :: n_pair = 2

contains

   !> Where the end of a slave chain takes part in another tie too, or is held and its neighbour is
   !> not, its multiplier goes to the neighbour: on the end edge there is a constant one then. The
   !> rows are the same in all steps, as those that come back would not fit the displacements by
   !> then, and in both directions, as rotations would not fulfil them else. A chain that would
   !> keep less than two multipliers stays as it is: one alone would be a hinge. So does an end that
   !> is tied to the image of one node alone: sectors and cells whose meshes match are one mesh.
   pure subroutine tie_ends_merge(rows, n_tie, is_held, has_map)
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(in) :: n_tie(:)                    !! (n_node)
      logical, intent(in) :: is_held(:, :)               !! (2, n_node)
      logical, intent(in) :: has_map                     !! the master is an image
      logical :: is_merged(size(rows%slave))
      integer :: k

      is_merged = .false.
      do k = 1, size(rows%slave)
         if (all(rows%neighbour(:, k) > 0) .or. all(rows%neighbour(:, k) == 0)) cycle
         if (has_map .and. rows%start(k + 1) - rows%start(k) == n_pair) cycle
         associate (node => rows%slave(k), next => rows%slave(maxval(rows%neighbour(:, k))))
            is_merged(k) = n_tie(node) > 1 .or. any(is_held(:, node) .and. .not. is_held(:, next))
         end associate
      end do
      call keep_two(rows%neighbour, is_merged)
      if (any(is_merged)) call tie_ends_take(rows, is_merged)
   end subroutine tie_ends_merge

   !> Take back what is to be merged in chains of rows that would keep less than two.
   pure subroutine keep_two(neighbour, is_merged)
      integer, intent(in) :: neighbour(:, :)             !! (2, rows) before and after; 0: none
      logical, intent(inout) :: is_merged(:)             !! (rows) ends of chains
      integer :: k, last, n

      do k = 1, size(is_merged)
         if (neighbour(1, k) > 0) cycle
         n = 1
         last = k
         do while (neighbour(2, last) > 0)
            last = neighbour(2, last)
            n = n + 1
         end do
         if (n - count(is_merged([k, last])) < 2) is_merged([k, last]) = .false.
      end do
   end subroutine keep_two

   !> Add the rows `is_merged` to their neighbours and leave them out.
   pure subroutine tie_ends_take(rows, is_merged)
      type(tie_rows_t), intent(inout) :: rows
      logical, intent(in) :: is_merged(:)                !! (rows) ends
      type(tie_rows_t) :: old
      integer, allocatable :: kept(:), number(:)
      integer :: i, k, n, side

      old = rows
      kept = pack([(k, k = 1, size(is_merged))], .not. is_merged)
      allocate(number(0:size(is_merged)), source=0)
      number(kept) = [(k, k = 1, size(kept))]
      rows%slave = old%slave(kept)
      rows%size = old%size(kept)
      deallocate(rows%neighbour, rows%start)
      allocate(rows%neighbour(2, size(kept)), rows%start(size(kept) + 1), source=0)
      n = 0
      do i = 1, size(kept)
         k = kept(i)
         call add_entries(old, k, rows, i, n)
         do side = 1, 2
            associate (other => old%neighbour(side, k))
               rows%neighbour(side, i) = number(other)
               if (other == 0) cycle
               if (.not. is_merged(other)) cycle
               call add_entries(old, other, rows, i, n)
               rows%size(i) = rows%size(i) + old%size(other)
            end associate
         end do
         rows%start(i + 1) = n
      end do
      rows%node = rows%node(:n)
      rows%weight = rows%weight(:n)
   end subroutine tie_ends_take

   !> Add the entries of row `k` of `old` to row `i` of `rows`, the last one, which ends at `n`.
   pure subroutine add_entries(old, k, rows, i, n)
      type(tie_rows_t), intent(in) :: old
      integer, intent(in) :: k, i
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(inout) :: n
      integer :: s, place

      do s = old%start(k) + 1, old%start(k + 1)
         place = rows%start(i) + findloc(rows%node(rows%start(i) + 1:n), old%node(s), 1)
         if (place == rows%start(i)) then
            n = n + 1
            place = n
            rows%node(n) = old%node(s)
            rows%weight(n) = 0.0_wp
         end if
         rows%weight(place) = rows%weight(place) + old%weight(s)
      end do
   end subroutine add_entries

end module emcon_tie_ends
