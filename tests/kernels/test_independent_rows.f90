!> Redundant constraints, and the choice of the unknowns to eliminate.
module test_independent_rows
   use check, only : check_equal, check_true, test_case_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_errors, only : error_t
   use emcon_independent_rows, only : independent_rows_find, independent_rows_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use linear_scenes, only : begin_rows, put_row
   use random_constraints, only : make_chain, make_problem, make_rows, problem_t
   implicit none
   private
   public :: collect_independent_rows

contains

   subroutine collect_independent_rows(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("random constraints are independent", test_independent), &
         test_case_t("of opposite constraints the later one is redundant", test_opposite), &
         test_case_t("a combination of three is redundant", test_combination), &
         test_case_t("nearly dependent is not dependent", test_nearly), &
         test_case_t("what is nearly dependent waits, unless it is firm", test_near), &
         test_case_t("a constraint without unknowns is redundant", test_prescribed), &
         test_case_t("a constraint between tied nodes is redundant", test_tied), &
         test_case_t("a chain has the slave nodes' larger unknowns", test_chain), &
         test_case_t("a long chain is not filled", test_long_chain), &
         test_case_t("entries equal by symmetry: the first", test_tie), &
         test_case_t("no unknown good for both gradients", test_no_common)]
   end subroutine collect_independent_rows

   !> A second search with the same work space finds the same.
   subroutine test_independent(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer, allocatable :: first(:)
      integer :: k

      do k = 1, 10
         call make_problem(problem)
         call independent_rows_find(rows, problem%set, problem%numbering)
         call check_equal(error, rows%n_redundant, 0, "redundant constraints")
         first = rows%dependent
         call independent_rows_find(rows, problem%set, problem%numbering)
         call check_equal(error, rows%dependent, first, "the choice, once more")
      end do
   end subroutine test_independent

   !> Two nodes that face each other, each slave of the other: row 5 = -row 2.
   subroutine test_opposite(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows

      call make_problem(problem)
      call become_combination(problem, 5, [2], [-1.0_wp])
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%redundant(:rows%n_redundant), [5], "redundant constraints")
   end subroutine test_opposite

   subroutine test_combination(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows

      call make_problem(problem)
      call become_combination(problem, 4, [1, 2, 3], [0.3_wp, -0.7_wp, 1.9_wp])
      call become_combination(problem, 6, [1], [-1.0_wp])
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%redundant(:rows%n_redundant), [4, 6], "redundant constraints")
   end subroutine test_combination

   !> One node's entries are off by the root of the unit round-off of the rows: far above what
   !> elimination rounds.
   subroutine test_nearly(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: off = sqrt(max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)))
      type(problem_t) :: problem
      type(independent_rows_t) :: rows

      call make_problem(problem)
      call become_combination(problem, 5, [2], [-1.0_wp])
      associate (item => problem%set%item(5))
         item%g(:, 2) = item%g(:, 2)*(1.0_wp + off)
         item%c(:, 2) = item%c(:, 2)*(1.0_wp + off)
      end associate
      call make_rows(problem)
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%n_redundant, 0, "redundant constraints")
   end subroutine test_nearly

   !> Two nodes over each other: row 5 = -row 2 but for a distance between the nodes, by the edge.
   !> Down to round-off it depends on row 2 nearly. Firm rows come first; two firm ones both stay.
   subroutine test_near(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: round_off = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
      real(wp), parameter :: distance(6) = merge([1.0_wp, 1.0e6_wp, 1.0e9_wp, 1.0e12_wp, &
         1.0e13_wp, 1.0e15_wp], [1.0_wp, 4.0e3_wp, 8.0e3_wp, 1.6e4_wp, 3.0e4_wp, 2.0e6_wp], &
         round_off < 1.0e-10_wp)*round_off
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: i

      do i = 1, size(distance)
         call make_problem(problem)
         call become_combination(problem, 5, [2], [-1.0_wp])
         associate (item => problem%set%item(5))
            item%g(:, 2) = item%g(:, 2)*(1.0_wp - distance(i))
            item%c(:, 2) = item%c(:, 2)*(1.0_wp - distance(i))
         end associate
         call make_rows(problem)
         problem%set%is_firm = .false.
         call find([5])
         if (i > 1 .and. i < size(distance)) call check_true(error, rows%is_near(1), "nearly")
         problem%set%is_firm(5) = .true.
         call find([2])
         problem%set%is_firm = .true.
         if (i > 1) call find([integer ::])
         if (i == 1) call find([5])
         if (i == 1) call check_true(error, .not. rows%is_near(1), "to round-off")
      end do

   contains

      !> `expected` are redundant, but for the largest distance.
      subroutine find(expected)
         integer, intent(in) :: expected(:)

         call independent_rows_find(rows, problem%set, problem%numbering)
         if (i < size(distance)) then
            call check_equal(error, rows%redundant(:rows%n_redundant), expected, "to be dropped")
         else
            call check_equal(error, rows%n_redundant, 0, "to be dropped")
         end if
      end subroutine find

   end subroutine test_near

   subroutine test_prescribed(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: i, k

      call make_problem(problem)
      k = 0
      do i = 1, size(problem%numbering%unknown, 2)
         if (count(problem%numbering%unknown(:, i) == 0) == 1) k = i
      end do
      call condition_resize(problem%set%item(3), 1)
      associate (item => problem%set%item(3))
         item%node(1) = k
         item%g(:, 1) = merge(1.0_wp, 0.0_wp, problem%numbering%unknown(:, k) == 0)
         item%c(:, 1) = item%g(:, 1)
      end associate
      call make_rows(problem)
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%redundant(:rows%n_redundant), [3], "redundant constraints")
   end subroutine test_prescribed

   !> Node 6 follows nodes 19 and 22, and may not move against the place between them: by their
   !> freedoms nothing is left of row 6 but round-off.
   subroutine test_tied(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: share = 0.1_wp, less = 0.3_wp - 0.2_wp
      type(linear_rows_t) :: linear
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: a

      call begin_rows(linear)
      do a = 1, 2
         call put_row(linear, 10 + a, [10 + a, 36 + a, 42 + a], [1.0_wp, -share, share - 1.0_wp])
      end do
      call make_problem(problem, linear)
      associate (item => problem%set%item(6))
         call condition_resize(item, 3)
         item%node(:3) = [6, 19, 22]
         item%g(:, 2) = -less*item%g(:, 1)
         item%c(:, 2) = -less*item%c(:, 1)
         item%g(:, 3) = (less - 1.0_wp)*item%g(:, 1)
         item%c(:, 3) = (less - 1.0_wp)*item%c(:, 1)
      end associate
      call make_rows(problem)
      associate (set => problem%set, from => problem%set%force_rows%row_start(6) + 1)
         call check_true(error, any(abs(set%force_rows%value(from:)) > 0.0_dp), "not exactly 0")
      end associate
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%redundant(:rows%n_redundant), [6], "redundant constraints")
   end subroutine test_tied

   !> By x where the normal lies along x, by y where it lies along y, and always the own node.
   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: node, k

      call make_chain([(k, k = 1, 40)], [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, 40, 4, problem)
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%n_redundant, 0, "redundant constraints")
      call check_true(error, .not. rows%is_poor, "the choice is good")
      do k = 1, 40
         associate (item => problem%set%item(k))
            node = item%node(1)
            call check_true(error, any(problem%numbering%unknown(:, node) == rows%dependent(k)), &
               "it is an unknown of the slave node")
            if (abs(item%g(1, 1)) > 2.0_wp*abs(item%g(2, 1))) call check_equal(error, &
               rows%dependent(k), problem%numbering%unknown(1, node), "by x")
            if (abs(item%g(2, 1)) > 2.0_wp*abs(item%g(1, 1))) call check_equal(error, &
               rows%dependent(k), problem%numbering%unknown(2, node), "by y")
         end associate
      end do
   end subroutine test_chain

   !> A normal of 45 degrees, rounded up or down.
   subroutine test_tie(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: i

      call make_problem(problem)
      do i = -1, 1
         associate (item => problem%set%item(1))
            item%g(:, 1) = [1.0_wp, -1.0_wp - real(i, wp)*epsilon(1.0_wp)]
            item%c(:, 1) = [1.0_wp, -1.0_wp + real(i, wp)*epsilon(1.0_wp)]
         end associate
         call make_rows(problem)
         call independent_rows_find(rows, problem%set, problem%numbering)
         call check_equal(error, rows%dependent(1), problem%numbering%unknown(1, 1), "by x")
      end do
   end subroutine test_tie

   !> The forces act along x, the gap is along y: that is regular, but not for an elimination. What
   !> is redundant is found all the same.
   subroutine test_no_common(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(independent_rows_t) :: rows

      call make_problem(problem)
      associate (item => problem%set%item(1))
         item%g = 0.0_wp
         item%c = 0.0_wp
         item%g(1, 1) = 1.0_wp
         item%c(2, 1) = 1.0_wp
      end associate
      call become_combination(problem, 5, [2], [-1.0_wp])
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_true(error, rows%is_poor, "the choice is poor")
      call check_equal(error, rows%redundant(:rows%n_redundant), [5], "redundant constraints")
   end subroutine test_no_common

   !> Constraint `k` becomes the sum of `weight` times `other`; it keeps its slave node.
   subroutine become_combination(problem, k, other, weight)
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: k, other(:)
      real(wp), intent(in) :: weight(:)
      integer :: i, j, m, n
      integer, allocatable :: node(:)

      allocate(node(1 + sum(problem%set%item(other)%n_node)), source=0)
      n = 1
      node(1) = problem%set%item(k)%node(1)
      do m = 1, size(other)
         do i = 1, problem%set%item(other(m))%n_node
            if (any(node(:n) == problem%set%item(other(m))%node(i))) cycle
            n = n + 1
            node(n) = problem%set%item(other(m))%node(i)
         end do
      end do
      associate (item => problem%set%item(k))
         call condition_resize(item, n)
         item%node(:n) = node(:n)
         item%g = 0.0_wp
         item%c = 0.0_wp
         do m = 1, size(other)
            associate (from => problem%set%item(other(m)))
               do i = 1, from%n_node
                  j = findloc(node(:n), from%node(i), dim=1)
                  item%g(:, j) = item%g(:, j) + weight(m)*from%g(:, i)
                  item%c(:, j) = item%c(:, j) + weight(m)*from%c(:, i)
               end do
            end associate
         end do
      end associate
      call make_rows(problem)
   end subroutine become_combination

   !> Each node follows the one before, along directions that turn: row k would hold unknowns of all
   !> k nodes, 512*513/2 and more together. They are found as in a short chain.
   subroutine test_long_chain(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 512
      type(problem_t) :: problem
      type(independent_rows_t) :: rows
      integer :: k

      call make_chain([(k, k = 1, n)], [-1.0_wp, 1.0_wp, 0.0_wp], 0, 4, problem)
      call independent_rows_find(rows, problem%set, problem%numbering)
      call check_equal(error, rows%n_redundant, 0, "redundant constraints")
      call check_true(error, .not. rows%is_poor, "pivots are good")
      call check_equal(error, (rows%dependent + 1)/2, [(k, k = 1, n)], "slave nodes")
      call check_true(error, rows%n_entry < 8*problem%set%force_rows%row_start(n + 1), "entries")
   end subroutine test_long_chain

end module test_independent_rows
