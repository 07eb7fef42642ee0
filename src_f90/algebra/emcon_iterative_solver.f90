! build: streams
!> Conjugate gradients with incomplete Cholesky factors by blocks, for symmetric definite matrices:
!> what `emcon_chosen_solver` takes in place of factors.
!>
!> Takes the memory of half the matrix and half as much again, where a factor of a body in space
!> takes many times that. A solution is as good as was asked for, or `is_converged` tells that
!> `most_steps` did not do.
module emcon_iterative_solver
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use emcon_coarse_modes, only : coarse_modes_begin, coarse_modes_complete, &
      coarse_modes_factorise, coarse_modes_init, coarse_modes_t
   use emcon_conjugate_gradients, only : gradients_are_done, gradients_begin, gradients_move, &
      gradients_t, gradients_turn
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_incomplete_cholesky, only : incomplete_cholesky_backward, &
      incomplete_cholesky_factorise, incomplete_cholesky_forward, incomplete_cholesky_t
   use emcon_kinds, only : dp, wp
   use emcon_node_blocks, only : n_side, node_blocks_fill, node_blocks_init, node_blocks_is_of, &
      node_blocks_matrix, node_blocks_multiply, node_blocks_t, node_blocks_take_row
   use emcon_power_scaling, only : power_of_two
   use emcon_shared_vectors, only : shared_add, shared_pick, shared_put
   use emcon_sparse_solver, only : solver_check_square
   use emcon_text, only : to_text
   implicit none
   private
   public :: iterative_solver_t, iterative_matrix, iterative_work

   !> Where no accuracy was asked for, that of a factor.
   real(dp), parameter :: best_accuracy = 64.0_dp*epsilon(1.0_dp)
   !> Entries are below it: sums of their squares in the range of single precision.
   real(dp), parameter :: largest = 2.0_dp**(maxexponent(1.0_sp)/4)

   type :: iterative_solver_t
      ! As those of a solver:
      real(dp) :: accuracy = 0.0_dp
      real(dp) :: half_scale = 1.0_dp
      logical :: is_scaled = .false., is_singular = .false., is_converged = .true.
      integer :: n_analysis = 0
      integer :: most_steps = 1000               !! of a solve
      integer :: n_step = 0                      !! of the last one
      integer, private :: n_thread = 1
      logical :: is_filled = .false.             !! the blocks have values
      logical, private :: is_sound = .false.     !! those that were taken so far can be factorised
      type(node_blocks_t), private :: blocks     !! half_scale times the matrix
      type(incomplete_cholesky_t), private :: factor
      type(coarse_modes_t), allocatable, private :: coarse   !! of `take_modes`, for `solve`
      integer, private :: first_slot = 0         !! of the entry (1, 1); 0: not there
      type(gradients_t), private :: gradients
      real(dp), allocatable, private :: x(:), r(:), z(:)     !! vectors of blocks
   contains
      procedure :: analyse => iterative_analyse
      procedure :: take_modes => iterative_take_modes
      procedure :: factorise => iterative_factorise
      procedure :: take_row => iterative_take_row
      procedure :: factorise_rows => iterative_factorise_rows
      procedure :: solve => iterative_solve
      procedure :: solve_half => iterative_solve_half
      procedure :: multiply => iterative_multiply
      procedure :: let_threads => iterative_let_threads
      procedure :: free => iterative_free
   end type iterative_solver_t

contains

   !> Let `n` threads work on matrices and vectors.
   pure subroutine iterative_let_threads(self, n)
      class(iterative_solver_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 1

      self%n_thread = n
      self%blocks%n_thread = n
      self%gradients%n_thread = n
   end subroutine iterative_let_threads

   subroutine iterative_analyse(self, matrix, error)
      class(iterative_solver_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      if (node_blocks_is_of(self%blocks, matrix)) return
      call self%free()
      call solver_check_square(matrix, error)
      if (allocated(error)) return
      call node_blocks_init(self%blocks, matrix)
      self%blocks%n_thread = self%n_thread
      self%first_slot = csr_find(matrix, 1, 1)
      self%n_analysis = self%n_analysis + 1
      associate (n => n_side*self%blocks%n_block)
         allocate(self%x(n), self%r(n), self%z(n), source=0.0_dp)
      end associate
   end subroutine iterative_analyse

   !> Solutions of the pattern are to be found by a coarse space of these motions, too.
   subroutine iterative_take_modes(self, mode)
      class(iterative_solver_t), intent(inout) :: self   !! analysed
      real(dp), intent(in) :: mode(:, :)                 !! (n, >= 1)

      if (.not. allocated(self%coarse)) allocate(self%coarse)
      call coarse_modes_init(self%coarse, self%blocks, mode)
   end subroutine iterative_take_modes

   subroutine iterative_factorise(self, value, error)
      class(iterative_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error

      self%is_singular = .true.
      self%is_filled = .false.
      if (self%blocks%n == 0 .or. size(value) /= self%blocks%n_slot) then
         call raise(error, err_internal, "an iterative solver got " // to_text(size(value)) // &
            " values for " // to_text(self%blocks%n_slot) // " entries")
         return
      end if
      call begin_values(self, value)
      if (self%is_sound) self%is_sound = are_sound(self, value)
      if (.not. self%is_sound) return
      call node_blocks_fill(self%blocks, self%half_scale, value)
      call self%factorise_rows()
   end subroutine iterative_factorise

   !> Values are to be taken, of which the first ones are these.
   subroutine begin_values(self, value)
      class(iterative_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)

      self%is_singular = .true.
      self%is_filled = .false.
      self%is_sound = self%first_slot > 0
      if (self%is_sound) self%is_sound = value(self%first_slot) > 0.0_dp
      if (self%is_sound) self%is_sound = ieee_is_finite(value(self%first_slot))
      if (self%is_sound .and. .not. self%is_scaled) &
         self%half_scale = power_of_two(-exponent(value(self%first_slot)))
   end subroutine begin_values

   !> Are values numbers in the range of single precision?
   pure logical function are_sound(self, value)
      class(iterative_solver_t), intent(in) :: self
      real(dp), intent(in), contiguous :: value(:)

      are_sound = all(ieee_is_finite(value))
      if (are_sound) are_sound = all(abs(self%half_scale*value) < largest)
   end function are_sound

   !> The values of row `i` of the pattern; rows come one after the other, from the first on.
   subroutine iterative_take_row(self, i, value)
      class(iterative_solver_t), intent(inout) :: self
      integer, intent(in) :: i
      real(dp), intent(in), contiguous :: value(:)

      if (i == 1) call begin_values(self, value)
      if (self%is_sound) self%is_sound = are_sound(self, value)
      if (self%is_sound) call node_blocks_take_row(self%blocks, i, self%half_scale, value)
   end subroutine iterative_take_row

   !> An incomplete factor of what was taken.
   subroutine iterative_factorise_rows(self)
      class(iterative_solver_t), intent(inout) :: self
      logical :: is_definite

      if (.not. self%is_sound) return
      self%is_filled = .true.
      call incomplete_cholesky_factorise(self%factor, self%blocks, is_definite)
      self%is_singular = .not. is_definite
      if (is_definite .and. allocated(self%coarse)) call coarse_modes_factorise(self%coarse, &
         self%blocks)
   end subroutine iterative_factorise_rows

   !> Steps until the residual is small enough, from x = 0, or from the coarse solution.
   subroutine iterative_solve(self, rhs, x, error)
      class(iterative_solver_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: accuracy, found

      if (self%is_singular .or. .not. self%is_filled) then
         call raise(error, err_internal, "iterative_solve: there is no factorisation")
         return
      end if
      accuracy = max(self%accuracy, best_accuracy)
      self%x = 0.0_dp
      call shared_put(self%n_thread, self%half_scale*real(rhs, dp), self%blocks%place, self%r)
      found = 0.0_dp
      if (has_coarse(self)) then
         call coarse_modes_begin(self%coarse, self%r, self%x, found)
         call node_blocks_multiply(self%blocks, self%x, self%z)
         call shared_add(self%n_thread, -1.0_dp, self%z, self%r)
      end if
      self%z = self%r
      call precondition(self, self%z)
      call gradients_begin(self%gradients, self%r, self%z, found)
      do
         self%is_converged = gradients_are_done(self%gradients, accuracy)
         if (self%is_converged .or. .not. self%gradients%is_definite &
            .or. self%gradients%n >= self%most_steps) exit
         call node_blocks_multiply(self%blocks, self%gradients%direction, self%z)
         call gradients_move(self%gradients, self%z, self%x, self%r)
         if (.not. self%gradients%is_definite) exit
         self%z = self%r
         call precondition(self, self%z)
         call gradients_turn(self%gradients, self%r, self%z)
      end do
      self%n_step = self%gradients%n
      x = real(self%x(self%blocks%place), wp)
   end subroutine iterative_solve

   !> Is there a coarse space to solve by?
   pure logical function has_coarse(self)
      type(iterative_solver_t), intent(in) :: self

      has_coarse = allocated(self%coarse)
      if (has_coarse) has_coarse = self%coarse%is_made
   end function has_coarse

   !> z = (L L^T)^-1 z of the present residual, completed by the coarse space.
   subroutine precondition(self, z)
      type(iterative_solver_t), intent(in) :: self
      real(dp), intent(inout), contiguous :: z(:)        !! a vector of blocks

      call incomplete_cholesky_forward(self%factor, self%blocks, z)
      call incomplete_cholesky_backward(self%factor, self%blocks, z)
      if (has_coarse(self)) call coarse_modes_complete(self%coarse, self%r, z)
   end subroutine precondition

   !> (L^-1 or L^-T) rhs
   subroutine iterative_solve_half(self, is_second, rhs, x)
      class(iterative_solver_t), intent(inout) :: self
      logical, intent(in) :: is_second
      real(dp), intent(in), contiguous :: rhs(:)
      real(dp), intent(inout), contiguous :: x(:)

      call shared_put(self%n_thread, rhs, self%blocks%place, self%z)
      if (is_second) call incomplete_cholesky_backward(self%factor, self%blocks, self%z)
      if (.not. is_second) call incomplete_cholesky_forward(self%factor, self%blocks, self%z)
      call shared_pick(self%n_thread, self%z, self%blocks%place, x)
   end subroutine iterative_solve_half

   !> y = half_scale*A x
   subroutine iterative_multiply(self, x, y)
      class(iterative_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)

      call shared_put(self%n_thread, x, self%blocks%place, self%x)
      call node_blocks_multiply(self%blocks, self%x, self%z)
      call shared_pick(self%n_thread, self%z, self%blocks%place, y)
   end subroutine iterative_multiply

   !> The matrix as it was given, by single entries.
   pure subroutine iterative_matrix(self, matrix)
      type(iterative_solver_t), intent(in) :: self       !! it is filled
      type(csr_t), intent(out) :: matrix

      call node_blocks_matrix(self%blocks, 1.0_dp/self%half_scale, matrix)
   end subroutine iterative_matrix

   !> Operations of a step: each block of the triangle is multiplied and substituted twice.
   pure real(dp) function iterative_work(self)
      type(iterative_solver_t), intent(in) :: self       !! that has analysed a matrix

      iterative_work = 8.0_dp*n_side**2*size(self%blocks%column)
   end function iterative_work

   subroutine iterative_free(self)
      class(iterative_solver_t), intent(inout) :: self

      self%blocks = node_blocks_t()
      self%factor = incomplete_cholesky_t()
      if (allocated(self%coarse)) deallocate(self%coarse)
      self%is_filled = .false.
      self%is_singular = .false.
      if (allocated(self%x)) deallocate(self%x, self%r, self%z)
   end subroutine iterative_free

end module emcon_iterative_solver
