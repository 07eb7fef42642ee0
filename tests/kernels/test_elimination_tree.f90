!> Orders of elimination, their trees and nodes, against eliminating a dense pattern row by row.
module test_elimination_tree
   use check, only : check_equal, check_true, test_case_t
   use emcon_csr, only : csr_from_values, csr_is_symmetric, csr_t
   use emcon_elimination_tree, only : elimination_tree_t, tree_build
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_ordering, only : ordering_find
   use emcon_sort, only : sort_order
   use emcon_supernode_search, only : supernodes_find
   use emcon_supernodes, only : supernodes_is_stack, supernodes_t
   use sparse_samples, only : quad_mesh_matrix
   implicit none
   private
   public :: collect_elimination_tree

contains

   subroutine collect_elimination_tree(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rows and parents of random patterns", test_random), &
         test_case_t("nodes have the rows of their columns", test_nodes), &
         test_case_t("unknowns of a node are ordered together", test_groups), &
         test_case_t("nested dissection in space", test_dissection), &
         test_case_t("symmetric patterns", test_symmetric)]
   end subroutine collect_elimination_tree

   !> `n` unknowns, each with itself and some others, at random.
   subroutine random_pattern(n, n_pair, a)
      integer, intent(in) :: n, n_pair
      type(csr_t), intent(out) :: a
      real(dp) :: draw(n_pair, 2)
      integer :: i, pair(n_pair, 2)

      call random_number(draw)
      pair = 1 + int(n*draw)
      call csr_from_values(a, n, n, [pair(:, 1), pair(:, 2), [(i, i = 1, n)]], &
         [pair(:, 2), pair(:, 1), [(i, i = 1, n)]], spread(1.0_wp, 1, 2*n_pair + n))
   end subroutine random_pattern

   !> The pattern of the factor of A(order, order), by elimination.
   pure subroutine eliminate(a, order, factor)
      type(csr_t), intent(in) :: a
      integer, intent(in) :: order(:)
      logical, intent(out) :: factor(:, :)       !! (n, n) its lower triangle
      integer :: i, j, k, place(size(order))

      place(order) = [(i, i = 1, size(order))]
      factor = .false.
      do i = 1, size(order)
         do k = a%row_start(i) + 1, a%row_start(i + 1)
            factor(place(i), place(a%column(k) + 1)) = .true.
         end do
      end do
      do j = 1, size(order)
         do k = j + 1, size(order)
            if (factor(k, j)) factor(j + 1:, k) = factor(j + 1:, k) .or. factor(j + 1:, j)
         end do
      end do
   end subroutine eliminate

   !> In any order: columns stand behind those below them, with the parents and as many rows as
   !> elimination gives. From hardly any entries to a dense matrix.
   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 40
      type(csr_t) :: a
      type(elimination_tree_t) :: tree
      logical :: factor(n, n)
      real(dp) :: draw(n)
      integer :: i, j, n_below, rows(n)

      do i = 0, 12
         call random_pattern(n, 2**i - 1, a)
         call random_number(draw)
         call tree_build(tree, a, sort_order(draw))
         call check_true(error, all(tree%order(sort_order(tree%order)) == [(j, j = 1, n)]), "order")
         if (allocated(error)) return
         call eliminate(a, tree%order, factor)
         do j = 1, n
            rows(j) = count(factor(j:, j))
            n_below = findloc(factor(min(j + 1, n):, j), .true., dim=1)
            if (j == n) n_below = 0
            call check_equal(error, tree%parent(j), merge(j + n_below, 0, n_below > 0), "parent")
            if (allocated(error)) return
            call check_equal(error, tree%n_row(j), rows(j), "rows")
            if (allocated(error)) return
         end do
         call check_true(error, nint(tree%n_entry) == sum(rows) .and. nint(tree%n_operation) &
            == sum(rows**2), "entries, operations")
         if (allocated(error)) return
      end do
   end subroutine test_random

   !> All rows of a column stand in its node, and each row of a node is one of some column of it.
   subroutine test_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 60
      type(csr_t) :: a
      type(elimination_tree_t) :: tree
      type(supernodes_t) :: nodes
      logical :: factor(n, n), of_node(n)
      logical :: is_found
      integer :: i, s

      do i = 0, 10
         call random_pattern(n, 2**i - 1, a)
         call ordering_find(a, .false., tree, is_found)
         call supernodes_find(nodes, a, tree)
         call eliminate(a, nodes%order, factor)
         call check_true(error, supernodes_is_stack(nodes), "updates are a stack")
         do s = 1, nodes%n_node
            associate (from => nodes%first(s) + 1, to => nodes%first(s + 1), &
               rows => nodes%row(nodes%row_start(s) + 1:nodes%row_start(s + 1)))
               of_node = .false.
               of_node(rows) = .true.
               call check_true(error, all(rows(2:) > rows(:size(rows) - 1)), "rows ascend")
               call check_true(error, all(of_node(from:to)), "the node has its own columns")
               call check_true(error, all((of_node .eqv. any(factor(:, from:to), dim=2)) &
                  .or. [(i < from, i = 1, n)]), "rows of a node")
            end associate
            if (allocated(error)) return
         end do
      end do
   end subroutine test_nodes

   subroutine test_groups(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(elimination_tree_t) :: tree
      logical :: is_found

      call quad_mesh_matrix(9, 7, 0.0_dp, a, error)
      if (allocated(error)) return
      call ordering_find(a, .true., tree, is_found)
      call check_true(error, all((tree%order(1::2) + 1)/2 == (tree%order(2::2) + 1)/2), &
         "both unknowns of a node follow each other")
   end subroutine test_groups

   !> A cube of points, each with its neighbours: about as few operations as by halving it, and its
   !> parts, by planes in the middle. (By minimum degree they are three times as many.)
   subroutine test_dissection(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      type(csr_t) :: a
      type(elimination_tree_t) :: tree, halved
      integer, allocatable :: order(:)
      integer :: i, k, m, row(27*n**3), column(27*n**3), to(3), at(3)
      logical :: is_found

      m = 0
      do i = 0, n**3 - 1
         at = [modulo(i, n), modulo(i/n, n), i/n**2]
         do k = 0, 26
            to = at + [modulo(k, 3), modulo(k/3, 3), k/9] - 1
            if (any(to < 0 .or. to >= n)) cycle
            m = m + 1
            row(m) = i + 1
            column(m) = 1 + to(1) + n*(to(2) + n*to(3))
         end do
      end do
      call csr_from_values(a, n**3, n**3, row(:m), column(:m), spread(1.0_wp, 1, m))
      call ordering_find(a, .false., tree, is_found)
      call check_true(error, is_found, "there is an order")
      allocate(order(0))
      call halve([0, 0, 0], [n, n, n], n, order)
      call tree_build(halved, a, order)
      call check_true(error, tree%n_operation < 1.5_dp*halved%n_operation, "operations")
   end subroutine test_dissection

   !> The points of a box: those of both halves, then those of the plane between them.
   recursive subroutine halve(from, to, n, order)
      integer, intent(in) :: from(3), to(3)      !! points before it, and to its end
      integer, intent(in) :: n                   !! points along a side of the cube
      integer, allocatable, intent(inout) :: order(:)
      integer :: d, end_of(3), i, j, k, middle, start(3)

      if (any(to <= from)) return
      d = maxloc(to - from, dim=1)
      middle = (from(d) + to(d))/2
      if (to(d) - from(d) > 2) then
         end_of = to
         end_of(d) = middle
         call halve(from, end_of, n, order)
         start = from
         start(d) = middle + 1
         call halve(start, to, n, order)
         start(d) = middle
         end_of(d) = middle + 1
      else
         start = from
         end_of = to
      end if
      order = [order, [(((1 + i + n*(j + n*k), i = start(1), end_of(1) - 1), &
         j = start(2), end_of(2) - 1), k = start(3), end_of(3) - 1)]]
   end subroutine halve

   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a

      call random_pattern(30, 50, a)
      call check_true(error, csr_is_symmetric(a), "a pattern and its mirror image")
      call csr_from_values(a, 2, 2, [1, 1, 2], [1, 2, 2], spread(1.0_wp, 1, 3))
      call check_true(error, .not. csr_is_symmetric(a), "one entry above the diagonal")
      call csr_from_values(a, 2, 2, [1, 1, 2], [1, 2, 1], spread(1.0_wp, 1, 3))
      call check_true(error, .not. csr_is_symmetric(a), "a gap in the diagonal")
   end subroutine test_symmetric

end module test_elimination_tree
