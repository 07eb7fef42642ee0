! build: streams
!> Operations on long vectors that threads share in pieces of one length: the bits are the same for
!> any number of threads.
module emcon_shared_vectors
   use emcon_kinds, only : dp
   implicit none
   private
   public :: shared_product, shared_add, shared_turn, shared_pick, shared_put

   !> Numbers of a piece, and partial sums in it, side by side.
   integer, parameter :: n_piece = 4096, n_sum = 8

contains

   !> a.b
   real(dp) function shared_product(n_thread, a, b) result(total)
      integer, intent(in) :: n_thread            !! >= 1
      real(dp), intent(in), contiguous :: a(:), b(:)
      real(dp) :: part(pieces(size(a)))
      integer :: k

      !$omp parallel do default(none) shared(part, a, b) num_threads(n_thread) schedule(static) &
      !$omp& if(is_shared(n_thread, size(a)))
      do k = 1, size(part)
         part(k) = product_of(a(first(k):last(k, size(a))), b(first(k):last(k, size(a))))
      end do
      !$omp end parallel do
      total = 0.0_dp
      do k = 1, size(part)
         total = total + part(k)
      end do
   end function shared_product

   !> y = y + s x
   subroutine shared_add(n_thread, s, x, y)
      integer, intent(in) :: n_thread            !! >= 1
      real(dp), intent(in) :: s
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      integer :: i

      !$omp parallel do simd default(none) shared(s, x, y) num_threads(n_thread) schedule(static) &
      !$omp& if(parallel: is_shared(n_thread, size(x)))
      do i = 1, size(x)
         y(i) = y(i) + s*x(i)
      end do
      !$omp end parallel do simd
   end subroutine shared_add

   !> y = x + s y
   subroutine shared_turn(n_thread, s, x, y)
      integer, intent(in) :: n_thread            !! >= 1
      real(dp), intent(in) :: s
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      integer :: i

      !$omp parallel do simd default(none) shared(s, x, y) num_threads(n_thread) schedule(static) &
      !$omp& if(parallel: is_shared(n_thread, size(x)))
      do i = 1, size(x)
         y(i) = x(i) + s*y(i)
      end do
      !$omp end parallel do simd
   end subroutine shared_turn

   !> y = x(place)
   subroutine shared_pick(n_thread, x, place, y)
      integer, intent(in) :: n_thread            !! >= 1
      real(dp), intent(in), contiguous :: x(:)
      integer, intent(in), contiguous :: place(:)        !! (n)
      real(dp), intent(inout), contiguous :: y(:)        !! (n)
      integer :: i

      !$omp parallel do default(none) shared(x, place, y) num_threads(n_thread) schedule(static) &
      !$omp& if(is_shared(n_thread, size(y)))
      do i = 1, size(y)
         y(i) = x(place(i))
      end do
      !$omp end parallel do
   end subroutine shared_pick

   !> y(place) = x
   subroutine shared_put(n_thread, x, place, y)
      integer, intent(in) :: n_thread            !! >= 1
      real(dp), intent(in), contiguous :: x(:)           !! (n)
      integer, intent(in), contiguous :: place(:)        !! (n) each another one
      real(dp), intent(inout), contiguous :: y(:)
      integer :: i

      !$omp parallel do default(none) shared(x, place, y) num_threads(n_thread) schedule(static) &
      !$omp& if(is_shared(n_thread, size(x)))
      do i = 1, size(x)
         y(place(i)) = x(i)
      end do
      !$omp end parallel do
   end subroutine shared_put

   !> Are `n` numbers worth more than one thread?
   pure logical function is_shared(n_thread, n)
      integer, intent(in) :: n_thread, n

      is_shared = n_thread > 1 .and. n > n_piece
   end function is_shared

   pure integer function pieces(n)
      integer, intent(in) :: n                   !! numbers

      pieces = (n + n_piece - 1)/n_piece
   end function pieces

   !> The first number of piece `k`.
   pure integer function first(k)
      integer, intent(in) :: k

      first = n_piece*(k - 1) + 1
   end function first

   !> The last number of piece `k` of `n` numbers.
   pure integer function last(k, n)
      integer, intent(in) :: k, n

      last = min(n_piece*k, n)
   end function last

   !> a.b by partial sums in a fixed order.
   pure real(dp) function product_of(a, b)
      real(dp), intent(in), contiguous :: a(:), b(:)
      real(dp) :: part(n_sum)
      integer :: i, k, n

      part = 0.0_dp
      n = size(a) - modulo(size(a), n_sum)
      do i = 0, n - n_sum, n_sum
         do k = 1, n_sum
            part(k) = part(k) + a(i + k)*b(i + k)
         end do
      end do
      do i = n + 1, size(a)
         part(i - n) = part(i - n) + a(i)*b(i)
      end do
      product_of = sum(part(:n_sum/2) + part(n_sum/2 + 1:))
   end function product_of

end module emcon_shared_vectors
