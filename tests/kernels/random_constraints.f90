!> A random constrained linear problem: matrix N, constraint rows Gb and G1, right-hand sides.
module random_constraints
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern, &
      constraints_rows
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_condition_nodes, only : condition_resize
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_steps, only : prescribed_t
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: problem_t, make_problem, make_symmetric, make_chain, make_rows, full_gradient, tol_dp

   integer, parameter :: n_node = 30, n_constraint = 6
   !> Matrices are of kind `dp`; the problems have condition numbers of some 100.
   real(wp), parameter :: tol_dp = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

   type :: problem_t
      type(numbering_t) :: numbering
      type(csr_t) :: base                        !! N without constraints
      type(csr_t) :: matrix                      !! N with curvature, on the merged pattern
      integer, allocatable :: slot(:)            !! entries of `base` in `matrix`
      type(constraint_set_t) :: set
      real(wp), allocatable :: residual(:)       !! without contact forces
   end type problem_t

contains

   !> Slave nodes 1..n, masters among the nodes above 10; a sixth of the freedoms is prescribed.
   !> With `linear` some of the freedoms depend on others.
   subroutine make_problem(problem, linear)
      type(problem_t), intent(out) :: problem
      type(linear_rows_t), intent(in), optional :: linear
      type(prescribed_t) :: held(10)
      integer :: k, i
      real(wp) :: u(4)

      do k = 1, 10
         held(k)%node = 2 + 3*(k - 1)
         held(k)%dof = 1 + mod(k, 2)
      end do
      call numbering_init(problem%numbering, spread([(.true., k = 1, n_node)], 1, 2), held, linear)
      call make_base(problem%numbering%n_unknown, 4, problem%base)
      call constraints_select(problem%set, [(k, k = 1, n_constraint)])
      do k = 1, n_constraint
         associate (item => problem%set%item(k))
            call condition_resize(item, 3 + mod(k, 3))
            call draw_random(u)
            item%node(:item%n_node) = [k, 11 + int(5.0_wp*u(:item%n_node - 1)) &
               + [(5*(i - 1), i = 1, item%n_node - 1)]]
            call shake(item%g, 1.0_wp)
            call shake(item%c, 0.2_wp)
            item%c = item%c + item%g
            call shake(item%h, 0.3_wp)
            item%size = 1.0_wp
         end associate
      end do
      call finish(problem)
   end subroutine make_problem

   !> Constraints along a chain of slave nodes, as mortar integrals give them: constraint k stands
   !> at the place at(k) of the chain, on the slave node there, its neighbours and two masters, by
   !> a normal that turns along the chain. Behind the place `cut` a new chain begins.
   subroutine make_chain(at, weight, cut, n_each, problem)
      integer, intent(in) :: at(:)                   !! (n) permutation
      real(wp), intent(in) :: weight(3)              !! of the node before, its own, the next one
      integer, intent(in) :: cut
      integer, intent(in) :: n_each                  !! entries in a row of N
      type(problem_t), intent(out) :: problem
      type(prescribed_t) :: nothing(0)
      integer :: n, i, k, first, last
      real(wp) :: angle, factor, w(3)

      n = size(at)
      call numbering_init(problem%numbering, spread([(.true., k = 1, 3*n + 1)], 1, 2), nothing)
      call make_base(problem%numbering%n_unknown, n_each, problem%base)
      call constraints_select(problem%set, [(k, k = 1, n)])
      do k = 1, n
         first = merge(2, 1, at(k) == 1 .or. at(k) == cut + 1)
         last = merge(2, 3, at(k) == n .or. at(k) == cut)
         w = weight
         w(:first - 1) = 0.0_wp
         w(last + 1:) = 0.0_wp
         associate (item => problem%set%item(k))
            call condition_resize(item, last - first + 3)
            item%node(:item%n_node) = [at(k), [(at(k) + i, i = first - 2, -1)], &
               [(at(k) + i, i = 1, last - 2)], n + at(k), n + at(k) + 1]
            angle = 4.0_wp*real(at(k), wp)/real(n, wp)
            do i = 1, item%n_node
               factor = -0.5_wp*sum(w)
               if (item%node(i) <= n) factor = w(2 + item%node(i) - at(k))
               item%g(:, i) = factor*[cos(angle), sin(angle)]
               item%c(:, i) = factor*[cos(angle + 0.1_wp), sin(angle + 0.1_wp)]
            end do
            call shake(item%h, 0.3_wp)
            item%size = 1.0_wp
         end associate
      end do
      call finish(problem)
   end subroutine make_chain

   !> Multipliers, right-hand sides, rows and the matrix for the constraints that are there.
   subroutine finish(problem)
      type(problem_t), intent(inout) :: problem

      call draw_random(problem%set%lam)
      call draw_random(problem%set%defect)
      allocate(problem%residual(problem%numbering%n_unknown))
      call draw_random(problem%residual)
      call make_rows(problem)
   end subroutine finish

   !> Rows and matrix anew, after the constraints have been changed.
   subroutine make_rows(problem)
      type(problem_t), intent(inout) :: problem

      call constraints_rows(problem%set, problem%numbering)
      call constraints_merge_pattern(problem%set, problem%base, problem%matrix, problem%slot)
      problem%matrix%value(problem%slot) = problem%base%value
      call constraints_add_curvature(problem%set, problem%numbering, problem%matrix)
   end subroutine make_rows

   !> Gradients of constraint `k` by all unknowns, in full precision: discrete, and at the end.
   pure subroutine full_gradient(problem, k, g, c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k
      real(wp), intent(out) :: g(:), c(:)            !! (n_unknown)
      integer :: i, a, unknown

      g = 0.0_wp
      c = 0.0_wp
      associate (item => problem%set%item(k))
         do i = 1, item%n_node
            do a = 1, 2
               unknown = problem%numbering%unknown(a, item%node(i))
               if (unknown == 0) cycle
               g(unknown) = item%g(a, i)
               c(unknown) = item%c(a, i)
            end do
         end do
      end associate
   end subroutine full_gradient

   !> Large diagonal, `n_each` random entries beside it in each row.
   subroutine make_base(n, n_each, a)
      integer, intent(in) :: n, n_each
      type(csr_t), intent(out) :: a
      integer :: row((n_each + 1)*n), column((n_each + 1)*n), i
      integer, allocatable :: slot(:)
      real(wp) :: u(n_each*n)

      call draw_random(u)
      row = [(i, i = 1, n), (1 + mod(i, n), i = 1, n_each*n)]
      column = [(i, i = 1, n), 1 + int(u*real(n, wp))]
      call csr_from_entries(a, n, n, row, column, slot)
      call random_number(a%value)
      do i = 1, n
         a%value(slot(i)) = a%value(slot(i)) + real(n_each + 2, dp)
      end do
   end subroutine make_base

   !> A problem whose matrix has a symmetric pattern: N and entries of zero.
   subroutine make_symmetric(problem)
      type(problem_t), intent(out) :: problem
      type(csr_t) :: base
      integer, allocatable :: slot(:), row(:)
      integer :: i, k

      call make_problem(problem)
      base = problem%base
      allocate(row(size(base%column)))
      do i = 1, base%n_row
         row(base%row_start(i) + 1:base%row_start(i + 1)) = i
      end do
      call csr_from_entries(problem%base, base%n_row, base%n_col, [row, base%column + 1], &
         [base%column + 1, row], slot)
      problem%base%value = 0.0_dp
      do k = 1, size(row)
         problem%base%value(slot(k)) = base%value(k)
      end do
   end subroutine make_symmetric

end module random_constraints
