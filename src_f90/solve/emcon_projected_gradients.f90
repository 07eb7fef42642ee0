! build: streams
!> Corrections under constraints by conjugate gradients, where the kept factor of the tangent A is
!> an incomplete one, M.
!>
!> With D the diagonal of A, rows are measured by W = D^-1/2 G^T, and P = 1 - W (W^T W)^-1 W^T takes
!> out what would change a constraint. The preconditioner is D^-1/2 P D^1/2 M^-1 D^1/2 P D^-1/2:
!> every step keeps the constraints to round-off, and no row spreads over the body as by a factor.
!> Source: N. I. M. Gould, M. E. Hribar, J. Nocedal, SIAM J. Sci. Comput. 23 (2001) 1376-1395.
module emcon_projected_gradients
   use emcon_conjugate_gradients, only : gradients_are_done, gradients_begin, gradients_move, &
      gradients_t, gradients_turn
   use emcon_diagonal_blocks, only : blocks_multiply, blocks_solve, diagonal_blocks_t
   use emcon_errors, only : error_t
   use emcon_gram_rows, only : gram_rows_meet, gram_rows_project, gram_rows_t
   use emcon_kinds, only : dp
   implicit none
   private
   public :: projected_gradients_t, projected_begin, projected_solve

   !> Steps of a correction at most: others follow.
   integer, parameter :: most_steps = 40

   type :: projected_gradients_t
      integer :: n_step = 0                      !! of all corrections so far
      real(dp) :: accuracy = 0.0_dp              !! of a correction, > 0, set before
      real(dp), allocatable :: root(:)           !! (n_unknown) of the diagonal, > 0
      type(gram_rows_t) :: rows                  !! of the constraints last taken
      type(gradients_t), private :: gradients
      real(dp), allocatable, private :: r(:), z(:), y(:)     !! (n_unknown)
   end type projected_gradients_t

contains

   !> Corrections are to be of a matrix of this diagonal.
   pure subroutine projected_begin(self, diagonal)
      type(projected_gradients_t), intent(inout) :: self
      real(dp), intent(in) :: diagonal(:)        !! (n_unknown) > 0

      self%root = sqrt(diagonal)
      if (allocated(self%r)) then
         if (size(self%r) /= size(diagonal)) deallocate(self%r, self%z, self%y)
      end if
      if (.not. allocated(self%r)) allocate(self%r, self%z, self%y, mold=diagonal)
   end subroutine projected_begin

   !> A x = rhs but for forces along the rows, G x = -defect.
   subroutine projected_solve(self, blocks, defect, rhs, x, error)
      type(projected_gradients_t), intent(inout) :: self
      type(diagonal_blocks_t), intent(inout) :: blocks
      real(dp), intent(in) :: defect(:)                  !! (n)
      real(dp), intent(in), contiguous :: rhs(:)         !! (n_unknown)
      real(dp), intent(out), contiguous :: x(:)          !! (n_unknown)
      type(error_t), allocatable, intent(out) :: error

      call gram_rows_meet(self%rows, -defect, x, error)
      if (allocated(error)) return
      x = x/self%root
      call blocks_multiply(blocks, x, self%r, error)
      if (allocated(error)) return
      self%r = (blocks%scale*rhs - self%r)/self%root
      call gram_rows_project(self%rows, self%r, error)
      if (allocated(error)) return
      self%r = self%r*self%root
      call precondition(self, blocks, error)
      if (allocated(error)) return
      self%gradients%n_thread = blocks%n_thread
      call gradients_begin(self%gradients, self%r, self%z)
      do while (self%gradients%is_definite .and. self%gradients%n < most_steps)
         if (gradients_are_done(self%gradients, self%accuracy)) exit
         call blocks_multiply(blocks, self%gradients%direction, self%y, error)
         if (allocated(error)) return
         call gradients_move(self%gradients, self%y, x, self%r)
         if (.not. self%gradients%is_definite) exit
         call precondition(self, blocks, error)
         if (allocated(error)) return
         call gradients_turn(self%gradients, self%r, self%z)
      end do
      self%n_step = self%n_step + self%gradients%n
   end subroutine projected_solve

   !> z of the present residual.
   subroutine precondition(self, blocks, error)
      type(projected_gradients_t), intent(inout) :: self
      type(diagonal_blocks_t), intent(inout) :: blocks
      type(error_t), allocatable, intent(out) :: error

      self%z = self%r
      if (self%rows%n > 0) call project(self%z, .false.)
      if (allocated(error)) return
      call blocks_solve(blocks, .false., self%z, self%y, error)
      if (.not. allocated(error)) call blocks_solve(blocks, .true., self%y, self%z, error)
      if (self%rows%n > 0 .and. .not. allocated(error)) call project(self%z, .true.)

   contains

      !> Of a motion what keeps the constraints, of forces what is along none.
      subroutine project(v, is_motion)
         real(dp), intent(inout), contiguous :: v(:)     !! (n_unknown)
         logical, intent(in) :: is_motion        !! else forces

         if (is_motion) v = v*self%root
         if (.not. is_motion) v = v/self%root
         call gram_rows_project(self%rows, v, error)
         if (is_motion) v = v/self%root
         if (.not. is_motion) v = v*self%root
      end subroutine project

   end subroutine precondition

end module emcon_projected_gradients
