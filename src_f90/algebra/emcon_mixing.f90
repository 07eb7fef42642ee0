! build: streams
!> Anderson's mixing of a fixed-point iteration x <- x + f(x): the next move is the one that makes
!> the smallest f of those that the last moves have shown, to first order.
!>
!> With dX the last moves, dF what they changed in f, and gamma the least-squares solution of
!> dF gamma = f, the move is f - (dX + dF) gamma. D. G. Anderson, J. ACM 12 (1965) 547-560.
module emcon_mixing
   use emcon_kinds, only : wp
   use emcon_lane_sums, only : lane_dot
   implicit none
   private
   public :: mixing_t, mixing_begin, mixing_move

   !> Moves that are remembered.
   integer, parameter :: depth = 5
   !> A change whose part across the newer ones is smaller than this, squared, says nothing new.
   real(wp), parameter :: least_new = 1.0e6_wp*epsilon(1.0_wp)

   type :: mixing_t
      private
      integer :: n_call = 0                      !! since the beginning
      integer :: n = 0                           !! moves remembered
      real(wp), allocatable :: f(:)              !! (n_x) of the last call
      real(wp), allocatable :: df(:, :)          !! (n_x, depth) in a ring
      real(wp), allocatable :: both(:, :)        !! (n_x, depth) dX + dF
      real(wp) :: gram(depth, depth) = 0.0_wp    !! dF^T dF
   end type mixing_t

contains

   !> Begin an iteration of `n_x` variables.
   pure subroutine mixing_begin(self, n_x)
      type(mixing_t), intent(inout) :: self
      integer, intent(in) :: n_x

      self%n_call = 0
      self%n = 0
      if (allocated(self%f)) then
         if (size(self%f) == n_x) return
         deallocate(self%f, self%df, self%both)
      end if
      allocate(self%f(n_x), self%df(n_x, depth), self%both(n_x, depth), source=0.0_wp)
   end subroutine mixing_begin

   !> The next move, for the value `f` at the place that the last move has led to.
   pure subroutine mixing_move(self, f, move)
      type(mixing_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: f(:)         !! (n_x)
      real(wp), intent(inout), contiguous :: move(:)   !! (n_x) the last move as made; the next one
      real(wp) :: gamma(depth)
      integer :: order(depth), k

      if (self%n_call > 0) call remember(self, f, move)
      self%n_call = self%n_call + 1
      self%f = f
      move = f
      ! Newest first: what the older ones add to these is taken if it is new.
      do k = 1, depth
         order(k) = modulo(self%n_call - 1 - k, depth) + 1
      end do
      call least_squares(self, order(:self%n), f, gamma(:self%n))
      do k = 1, self%n
         move = move - gamma(k)*self%both(:, order(k))
      end do
   end subroutine mixing_move

   !> Put the last move and what it changed in the place of the oldest one.
   pure subroutine remember(self, f, move)
      type(mixing_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: f(:), move(:)
      integer :: at, k

      at = modulo(self%n_call - 1, depth) + 1
      self%n = min(self%n + 1, depth)
      self%df(:, at) = f - self%f
      self%both(:, at) = move + self%df(:, at)
      do k = 1, self%n
         self%gram(k, at) = lane_dot(self%df(:, k), self%df(:, at))
         self%gram(at, k) = self%gram(k, at)
      end do
   end subroutine remember

   !> gamma of least |dF gamma - f|, by the normal equations of columns of length one.
   pure subroutine least_squares(self, order, f, gamma)
      type(mixing_t), intent(in) :: self
      integer, intent(in) :: order(:)                  !! (n) places of the columns
      real(wp), intent(in), contiguous :: f(:)
      real(wp), intent(out) :: gamma(:)                !! (n)
      real(wp) :: l(depth, depth), length(depth), rest
      logical :: is_new(depth)
      integer :: i, j

      l = 0.0_wp
      do i = 1, size(order)
         length(i) = sqrt(self%gram(order(i), order(i)))
         is_new(i) = length(i) > 0.0_wp
         if (.not. is_new(i)) cycle
         do j = 1, i - 1
            if (is_new(j)) l(i, j) = (self%gram(order(i), order(j))/(length(i)*length(j)) &
               - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
         rest = 1.0_wp - dot_product(l(i, :i - 1), l(i, :i - 1))
         is_new(i) = rest > least_new
         if (is_new(i)) l(i, i) = sqrt(rest)
      end do
      gamma = 0.0_wp
      do i = 1, size(order)
         if (is_new(i)) gamma(i) = (lane_dot(self%df(:, order(i)), f)/length(i) &
            - dot_product(l(i, :i - 1), gamma(:i - 1)))/l(i, i)
      end do
      do i = size(order), 1, -1
         if (is_new(i)) gamma(i) = (gamma(i) - dot_product(l(i + 1:size(order), i), &
            gamma(i + 1:)))/l(i, i)
      end do
      do i = 1, size(order)
         if (is_new(i)) gamma(i) = gamma(i)/length(i)
      end do
   end subroutine least_squares

end module emcon_mixing
