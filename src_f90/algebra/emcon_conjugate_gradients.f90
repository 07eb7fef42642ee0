!> The method of conjugate gradients for symmetric definite systems, one step after the other: who
!> calls knows the matrix and the preconditioner.
!>
!> Sizes of residuals are those of the preconditioner, r.M^-1 r: energies where it is good.
!> Source: M. R. Hestenes, E. Stiefel, J. Res. Nat. Bur. Stand. 49 (1952) 409-436.
module emcon_conjugate_gradients
   use emcon_kinds, only : dp
   use emcon_shared_vectors, only : shared_add, shared_product, shared_turn
   implicit none
   private
   public :: gradients_t, gradients_begin, gradients_move, gradients_turn, gradients_are_done

   type :: gradients_t
      real(dp), allocatable :: direction(:)      !! (n) that the next step goes along
      integer :: n_thread = 1                    !! that may work on vectors, set before
      integer :: n = 0                           !! steps made
      logical :: is_definite = .true.            !! matrix and preconditioner are, so far
      real(dp), private :: square = 0.0_dp, first = 0.0_dp      !! r.M^-1 r, now and at first
   end type gradients_t

contains

   !> A solve begins with the residual r = b - A x, and z = M^-1 r.
   subroutine gradients_begin(self, r, z, found)
      type(gradients_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: r(:), z(:)     !! (n)
      !> The energy x.A x of where it begins, if r is orthogonal to that: a part of the solution's
      real(dp), intent(in), optional :: found

      if (allocated(self%direction)) then
         if (size(self%direction) /= size(r)) deallocate(self%direction)
      end if
      if (.not. allocated(self%direction)) allocate(self%direction(size(r)))
      self%direction = z
      self%n = 0
      self%square = shared_product(self%n_thread, r, z)
      self%first = self%square
      if (present(found)) self%first = self%first + found
      self%is_definite = self%square >= 0.0_dp
   end subroutine gradients_begin

   !> The step along the direction p, of which `image` is A p: nothing moves where the matrix is not
   !> definite.
   subroutine gradients_move(self, image, x, r)
      type(gradients_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: image(:)       !! (n)
      real(dp), intent(inout), contiguous :: x(:), r(:)  !! (n)
      real(dp) :: curvature, step

      curvature = shared_product(self%n_thread, self%direction, image)
      self%is_definite = curvature > 0.0_dp
      if (.not. self%is_definite) return
      step = self%square/curvature
      call shared_add(self%n_thread, step, self%direction, x)
      call shared_add(self%n_thread, -step, image, r)
      self%n = self%n + 1
   end subroutine gradients_move

   !> The next direction, for the present residual and z = M^-1 r.
   subroutine gradients_turn(self, r, z)
      type(gradients_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: r(:), z(:)     !! (n)
      real(dp) :: square

      square = shared_product(self%n_thread, r, z)
      self%is_definite = square >= 0.0_dp
      if (.not. self%is_definite) return
      call shared_turn(self%n_thread, square/self%square, z, self%direction)
      self%square = square
   end subroutine gradients_turn

   !> Is the residual within `accuracy` of the first one?
   pure logical function gradients_are_done(self, accuracy)
      type(gradients_t), intent(in) :: self
      real(dp), intent(in) :: accuracy           !! > 0

      gradients_are_done = self%square <= accuracy**2*self%first
   end function gradients_are_done

end module emcon_conjugate_gradients
