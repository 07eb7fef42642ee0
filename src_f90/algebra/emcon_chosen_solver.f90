!> Iterations or factors for symmetric definite matrices: whichever is predicted to take less.
!>
!> Iterations come into question where solutions need not be exact (`accuracy`). The order in which
!> a matrix would be factorised tells what that takes; counts decide, not seconds, so that a run
!> chooses alike whenever it is repeated. Where the unknowns of nodes are blocks, as in space, the
!> nodes are ordered for that: a ninth of the entries. Where iterations do not come to an end, or
!> the matrix turns out not to be definite, it is factorised after all, until the next values.
!> Source: docs/theory.md, section 8.
module emcon_chosen_solver
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_iterative_solver, only : iterative_matrix, iterative_solver_t, iterative_work
   use emcon_kinds, only : dp, int64, wp
   use emcon_node_blocks, only : n_side, node_blocks_quotient
   use emcon_row_panels, only : row_panel_t
   use emcon_sparse_solver, only : sparse_solver_t
   implicit none
   private
   public :: chosen_solver_t

   !> Operations on dense blocks take that much less time than those of iterations.
   real(dp), parameter :: dense_gain = 4.0_dp
   !> Solutions for each factorisation, of one that is kept and of Newton's method.
   integer, parameter :: kept_solutions = 50, newton_solutions = 2
   !> Steps for two digits of a body with mass, and for four of one without: with the number of
   !> unknowns along a side of it. A cube takes half as many, a slender body more.
   real(dp), parameter :: kept_steps = 7.0_dp, newton_steps = 4.0_dp
   !> Of a matrix whose condition no mesh changes, as of mass: solutions, and steps to round-off.
   integer, parameter :: even_solutions = 10
   real(dp), parameter :: even_steps = 20.0_dp
   !> A solution may take as many steps as a factor costs, and these at any rate.
   integer, parameter :: least_steps = 200, most_steps = 10000

   !> Which one does the work.
   integer, parameter :: by_factors = 0, by_iterations = 1, by_general = 2

   type, extends(sparse_solver_t) :: chosen_solver_t
      logical :: prefers_iterations = .false.    !! wherever these can be
      logical :: iterates = .false.              !! chosen for the pattern
      integer :: n_failure = 0                   !! matrices that iterations did not solve, so far
      class(sparse_solver_t), allocatable :: direct      !! of definite matrices
      class(sparse_solver_t), allocatable :: general     !! of those that turn out otherwise
      type(iterative_solver_t) :: iterative
      integer, private :: by = by_factors
      !> Of the pattern that was last found to be for factors; 0: there is none
      integer, private :: n_row = 0, n_slot = 0
   contains
      procedure :: analyse => chosen_analyse
      procedure :: factorise => chosen_factorise
      procedure :: solve => chosen_solve
      procedure :: has_halves => chosen_has_halves
      procedure :: solve_half => chosen_solve_half
      procedure :: reach_half => chosen_reach_half
      procedure :: has_panels => chosen_has_panels
      procedure :: reach_rows => chosen_reach_rows
      procedure :: multiply => chosen_multiply
      procedure :: takes_rows => chosen_takes_rows
      procedure :: take_row => chosen_take_row
      procedure :: factorise_rows => chosen_factorise_rows
      procedure :: let_threads => chosen_let_threads
      procedure :: free => chosen_free
   end type chosen_solver_t

contains

   subroutine chosen_analyse(self, matrix, error)
      class(chosen_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      integer :: before

      before = self%iterative%n_analysis
      if (self%iterates) then
         call self%iterative%analyse(matrix, error)
         if (self%iterative%n_analysis == before .or. allocated(error)) return
         call self%iterative%free()              ! another pattern, which may be for factors
      end if
      before = self%direct%n_analysis
      call prepare_direct(self)
      if (self%n_row == matrix%n_row .and. self%n_slot == size(matrix%column)) then
         call self%direct%analyse(matrix, error)
         if (allocated(error) .or. self%direct%n_analysis == before) return
      end if
      self%n_analysis = self%n_analysis + 1
      call choose(self, matrix, error)
      self%is_incomplete = self%iterates
   end subroutine chosen_analyse

   !> Hand on what was set.
   subroutine prepare_direct(self)
      class(chosen_solver_t), intent(inout) :: self

      self%direct%symmetry = self%symmetry
      self%direct%seeks_less_fill = self%seeks_less_fill
      self%direct%needs_halves = self%needs_halves
      self%direct%may_be_rough = self%may_be_rough
      self%direct%is_scaled = self%is_scaled
      self%iterative%is_scaled = self%is_scaled
      self%iterative%accuracy = self%accuracy
   end subroutine prepare_direct

   !> Iterations or factors? First by the entries of the matrix, then by those of its blocks, which
   !> are filled up where nodes have fewer than three unknowns.
   subroutine choose(self, matrix, error)
      class(chosen_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: step
      logical :: is_predicted

      self%n_row = 0
      is_predicted = .false.
      if (self%accuracy > 0.0_dp) call predict_by_nodes(self, matrix, is_predicted, error)
      if (.not. (is_predicted .or. allocated(error))) call analyse_direct(self, matrix, error)
      if (allocated(error)) return
      step = 4.0_dp*size(matrix%column)
      self%iterates = self%accuracy > 0.0_dp .and. (self%prefers_iterations &
         .or. takes_less(self, matrix%n_row, step))
      if (self%iterates) then
         call self%iterative%analyse(matrix, error)
         if (allocated(error)) return
         step = iterative_work(self%iterative)
         self%iterates = self%prefers_iterations .or. takes_less(self, matrix%n_row, step)
      end if
      self%iterative%most_steps = max(least_steps, int(min(real(most_steps, dp), &
         self%n_operation/dense_gain/step)))
      if (self%iterates) then
         call self%direct%free()
         if (allocated(self%near_null)) then
            if (size(self%near_null, 1) == matrix%n_row) call self%iterative%take_modes( &
               self%near_null)
         end if
      else
         call self%iterative%free()
         call analyse_direct(self, matrix, error)
         self%n_row = matrix%n_row
         self%n_slot = size(matrix%column)
      end if
   end subroutine choose

   !> Order the pattern for factors, which tells what they take.
   subroutine analyse_direct(self, matrix, error)
      class(chosen_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      call self%direct%analyse(matrix, error)
      self%n_factor = self%direct%n_factor
      self%n_operation = self%direct%n_operation
   end subroutine analyse_direct

   !> What factors would take, by the order of the nodes: where most of them have three unknowns.
   subroutine predict_by_nodes(self, matrix, is_predicted, error)
      class(chosen_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      logical, intent(out) :: is_predicted       !! else that is not known yet
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: nodes
      real(dp) :: part

      call node_blocks_quotient(matrix, nodes)
      part = real(matrix%n_row, dp)/max(1, nodes%n_row)
      is_predicted = part > n_side - 0.5_dp
      if (.not. is_predicted) return
      self%direct%may_be_rough = .false.         ! nothing is factorised
      call self%direct%analyse(nodes, error)
      self%direct%may_be_rough = self%may_be_rough
      self%n_factor = int(part**2*real(self%direct%n_factor, dp), int64)
      self%n_operation = part**3*self%direct%n_operation
   end subroutine predict_by_nodes

   !> Do iterations whose steps take `step` operations take fewer of them than factors?
   pure logical function takes_less(self, n, step)
      class(chosen_solver_t), intent(in) :: self
      integer, intent(in) :: n                   !! unknowns
      real(dp), intent(in) :: step
      real(dp) :: n_step, n_solution

      n_solution = real(merge(kept_solutions, newton_solutions, self%needs_halves), dp)
      n_step = kept_steps
      if (.not. self%needs_halves) n_step = newton_steps*real(n, dp)**(1.0_dp/3.0_dp)
      if (self%is_even) then
         n_solution = real(even_solutions, dp)
         n_step = even_steps
      end if
      takes_less = n_solution*n_step*step < self%n_operation/dense_gain &
         + n_solution*4.0_dp*real(self%n_factor, dp)
   end function takes_less

   subroutine chosen_factorise(self, value, error)
      class(chosen_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error

      if (self%iterates) then
         call self%iterative%factorise(value, error)
         if (.not. allocated(error)) call look_at_iterations(self, error)
      else
         self%by = by_factors
         self%is_incomplete = .false.
         call self%direct%factorise(value, error)
         call take_figures(self, self%direct)
      end if
   end subroutine chosen_factorise

   !> Factors after all of what iterations have taken, if it is not definite.
   subroutine look_at_iterations(self, error)
      class(chosen_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      self%by = by_iterations
      self%is_incomplete = .true.
      self%is_singular = self%iterative%is_singular
      self%half_scale = self%iterative%half_scale
      if (self%is_singular .and. self%iterative%is_filled) call factorise_after_all(self, error)
   end subroutine look_at_iterations

   pure logical function chosen_takes_rows(self)
      class(chosen_solver_t), intent(in) :: self

      chosen_takes_rows = self%iterates
   end function chosen_takes_rows

   subroutine chosen_take_row(self, i, value, error)
      class(chosen_solver_t), intent(inout) :: self
      integer, intent(in) :: i
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error

      call self%iterative%take_row(i, value)
   end subroutine chosen_take_row

   subroutine chosen_factorise_rows(self, error)
      class(chosen_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call self%iterative%factorise_rows()
      call look_at_iterations(self, error)
   end subroutine chosen_factorise_rows

   !> Factors after all, of what the iterations hold.
   subroutine factorise_after_all(self, error)
      class(chosen_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: matrix

      self%n_failure = self%n_failure + 1
      self%is_incomplete = .false.
      self%by = by_factors
      call iterative_matrix(self%iterative, matrix)
      call take_factors(self, self%direct, matrix, error)
   end subroutine factorise_after_all

   subroutine take_factors(self, solver, matrix, error)
      class(chosen_solver_t), intent(inout) :: self
      class(sparse_solver_t), intent(inout) :: solver
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      call solver%analyse(matrix, error)
      if (.not. allocated(error)) call solver%factorise(matrix%value, error)
      call take_figures(self, solver)
   end subroutine take_factors

   !> What the last factorisation tells.
   subroutine take_figures(self, solver)
      class(chosen_solver_t), intent(inout) :: self
      class(sparse_solver_t), intent(in) :: solver

      self%is_singular = solver%is_singular
      self%rcond = solver%rcond
      self%n_factor = solver%n_factor
      self%half_scale = solver%half_scale
   end subroutine take_figures

   subroutine chosen_solve(self, rhs, x, error)
      class(chosen_solver_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: matrix

      self%is_converged = .true.
      if (self%by == by_iterations) then
         self%iterative%accuracy = self%accuracy
         call self%iterative%solve(rhs, x, error)
         if (allocated(error) .or. self%iterative%is_converged) return
         call factorise_after_all(self, error)
         if (self%is_singular .and. .not. allocated(error)) then
            self%by = by_general
            call iterative_matrix(self%iterative, matrix)
            call take_factors(self, self%general, matrix, error)
         end if
         self%is_converged = .not. self%is_singular
         if (self%is_singular .or. allocated(error)) return
      end if
      if (self%by == by_factors) call self%direct%solve(rhs, x, error)
      if (self%by == by_general) call self%general%solve(rhs, x, error)
   end subroutine chosen_solve

   pure logical function chosen_has_halves(self)
      class(chosen_solver_t), intent(in) :: self

      chosen_has_halves = self%direct%has_halves()
   end function chosen_has_halves

   subroutine chosen_solve_half(self, is_second, rhs, x, error)
      class(chosen_solver_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      if (self%by == by_iterations) then
         call self%iterative%solve_half(is_second, rhs, x)
      else
         call self%direct%solve_half(is_second, rhs, x, error)
      end if
   end subroutine chosen_solve_half

   subroutine chosen_reach_half(self, column, value, n_reached, index, x, error)
      class(chosen_solver_t), intent(inout) :: self
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      integer, intent(out) :: n_reached
      integer, intent(inout), contiguous :: index(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      call self%direct%reach_half(column, value, n_reached, index, x, error)
   end subroutine chosen_reach_half

   pure logical function chosen_has_panels(self)
      class(chosen_solver_t), intent(in) :: self

      chosen_has_panels = self%by == by_factors .and. self%direct%has_panels()
   end function chosen_has_panels

   subroutine chosen_reach_rows(self, row_start, column, value, panel, error)
      class(chosen_solver_t), intent(inout) :: self
      integer, intent(in), contiguous :: row_start(:)
      integer, intent(in), contiguous :: column(:)
      real(dp), intent(in), contiguous :: value(:)
      type(row_panel_t), allocatable, intent(out) :: panel(:)
      type(error_t), allocatable, intent(out) :: error

      call self%direct%reach_rows(row_start, column, value, panel, error)
   end subroutine chosen_reach_rows

   subroutine chosen_multiply(self, x, y, error)
      class(chosen_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      type(error_t), allocatable, intent(out) :: error

      call self%iterative%multiply(x, y)
   end subroutine chosen_multiply

   pure subroutine chosen_let_threads(self, n)
      class(chosen_solver_t), intent(inout) :: self
      integer, intent(in) :: n

      call self%iterative%let_threads(n)
   end subroutine chosen_let_threads

   subroutine chosen_free(self)
      class(chosen_solver_t), intent(inout) :: self

      if (allocated(self%direct)) call self%direct%free()
      if (allocated(self%general)) call self%general%free()
      call self%iterative%free()
      self%n_row = 0
      self%iterates = .false.
      self%is_incomplete = .false.
      self%is_singular = .false.
      self%by = by_factors
   end subroutine chosen_free

end module emcon_chosen_solver
