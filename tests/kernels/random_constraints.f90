!> A random constrained linear problem: matrix N, constraint rows Gb and G1, right-hand sides.
module random_constraints
   use emcon_constraints, only : constraint_set_t, constraints_add_curvature, &
      constraints_merge_pattern, constraints_rows, constraints_select
   use emcon_contact, only : constraint_resize
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_kinds, only : dp, wp
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_scene, only : prescribed_t
   use small_scenes, only : shake
   implicit none
   private
   public :: problem_t, make_problem, tol_dp

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
   subroutine make_problem(problem)
      type(problem_t), intent(out) :: problem
      type(prescribed_t) :: held(10)
      integer :: k, i
      real(wp) :: u(4)

      do k = 1, 10
         held(k)%node = 2 + 3*(k - 1)
         held(k)%dof = 1 + mod(k, 2)
      end do
      call numbering_init(problem%numbering, 2, [(1, k = 1, n_node)], held)
      call make_base(problem%numbering%n_unknown, problem%base)
      call constraints_select(problem%set, [(k, k = 1, n_constraint)])
      do k = 1, n_constraint
         associate (item => problem%set%item(k))
            call constraint_resize(item, 3 + mod(k, 3))
            call random_number(u)
            item%node(:item%n_node) = [k, 11 + int(5.0_wp*u(:item%n_node - 1)) &
               + [(5*(i - 1), i = 1, item%n_node - 1)]]
            call shake(item%g, 1.0_wp)
            call shake(item%c, 0.2_wp)
            item%c = item%c + item%g
            call shake(item%h, 0.3_wp)
            item%size = 1.0_wp
         end associate
      end do
      call random_number(problem%set%lam)
      call random_number(problem%set%defect)
      allocate(problem%residual(problem%numbering%n_unknown))
      call random_number(problem%residual)
      call constraints_rows(problem%set, problem%numbering)
      call constraints_merge_pattern(problem%set, problem%base, problem%matrix, problem%slot)
      problem%matrix%value(problem%slot) = problem%base%value
      call constraints_add_curvature(problem%set, problem%numbering, problem%matrix)
   end subroutine make_problem

   !> Large diagonal, four random entries beside it in each row.
   subroutine make_base(n, a)
      integer, intent(in) :: n
      type(csr_t), intent(out) :: a
      integer :: row(5*n), column(5*n), i
      integer, allocatable :: slot(:)
      real(wp) :: u(4*n)

      call random_number(u)
      row = [(i, i = 1, n), (1 + mod(i, n), i = 1, 4*n)]
      column = [(i, i = 1, n), 1 + int(u*real(n, wp))]
      call csr_from_entries(a, n, n, row, column, slot)
      call random_number(a%value)
      do i = 1, n
         a%value(slot(i)) = a%value(slot(i)) + 6.0_dp
      end do
   end subroutine make_base

end module random_constraints
