! build: streams
!> Gradients G of constraints in the measure of a factor L L^T, W = L^-1 G^T by its entries that are
!> not zero, and the Cholesky factor of W^T W; or, where forces are not along gradients but along
!> F, V = L^-1 F^T behind W, and V^T W.
module emcon_factor_rows
   use emcon_kinds, only : dp
   use emcon_row_pool, only : row_pool_add, row_pool_fill_products, row_pool_subtract_products, &
      row_pool_t
   implicit none
   private
   public :: factor_rows_t, factor_rows_begin, factor_rows_make_room, factor_rows_fill_products, &
      factor_rows_subtract_products, factor_rows_add

   type :: factor_rows_t
      integer :: n = 0
      integer :: n_push = 0                      !! the last of them are those of forces
      integer, allocatable :: start(:)           !! (n + 1) entries before each row
      integer, allocatable :: index(:)           !! (>= start(n + 1)) unknowns, from 0
      real(dp), allocatable :: w(:)              !! (>= start(n + 1))
      real(dp), allocatable :: l(:, :)           !! (n, n) W^T W, or its factor
      logical :: by_panels = .false.             !! W is in `pool`, not in `index` and `w`
      type(row_pool_t) :: pool
   end type factor_rows_t

contains

   !> `n` rows are to come.
   pure subroutine factor_rows_begin(self, n, n_push)
      type(factor_rows_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 0
      integer, intent(in) :: n_push              !! the last of them, those of forces: 0 or n/2

      if (allocated(self%l)) then
         if (self%n /= n) deallocate(self%l, self%start)
      end if
      if (.not. allocated(self%l)) allocate(self%l(n, n), self%start(n + 1))
      self%by_panels = .false.
      self%n = n
      self%n_push = n_push
      self%start(1) = 0
   end subroutine factor_rows_begin

   !> Room for `n` entries of W; what there is stays.
   pure subroutine factor_rows_make_room(self, n)
      type(factor_rows_t), intent(inout) :: self
      integer, intent(in) :: n                   !! >= 0
      integer, allocatable :: index(:)
      real(dp), allocatable :: w(:)

      if (.not. allocated(self%w)) allocate(self%index(0), self%w(0))
      if (n <= size(self%w)) return
      allocate(index(2*n), source=0)
      allocate(w(2*n), source=0.0_dp)
      index(:size(self%index)) = self%index
      w(:size(self%w)) = self%w
      call move_alloc(index, self%index)
      call move_alloc(w, self%w)
   end subroutine factor_rows_make_room

   !> W^T W, its lower triangle; with rows of forces V^T W alone, below it and to the left.
   subroutine factor_rows_fill_products(self, y)
      type(factor_rows_t), intent(inout) :: self
      real(dp), intent(out), contiguous :: y(:)  !! (n_unknown) work space
      integer :: k, i, j
      real(dp) :: total

      if (self%by_panels) then
         call row_pool_fill_products(self%pool, self%l)
         return
      end if
      y = 0.0_dp
      do k = 1, self%n - self%n_push
         do j = self%start(k) + 1, self%start(k + 1)
            y(self%index(j) + 1) = self%w(j)
         end do
         do i = merge(k, 1 + self%n - self%n_push, self%n_push == 0), self%n
            total = 0.0_dp
            do j = self%start(i) + 1, self%start(i + 1)
               total = total + self%w(j)*y(self%index(j) + 1)
            end do
            self%l(i, k) = total
         end do
         do j = self%start(k) + 1, self%start(k + 1)
            y(self%index(j) + 1) = 0.0_dp
         end do
      end do
   end subroutine factor_rows_fill_products

   !> mu = mu - W^T y
   subroutine factor_rows_subtract_products(self, y, mu)
      type(factor_rows_t), intent(in) :: self
      real(dp), intent(in), contiguous :: y(:)   !! (n_unknown)
      real(dp), intent(inout) :: mu(:)           !! (n) of gradients
      integer :: k, j

      if (self%by_panels) then
         call row_pool_subtract_products(self%pool, y, mu)
         return
      end if
      do k = 1, size(mu)
         do j = self%start(k) + 1, self%start(k + 1)
            mu(k) = mu(k) - self%w(j)*y(self%index(j) + 1)
         end do
      end do
   end subroutine factor_rows_subtract_products

   !> y = y + W mu, or y + V mu
   subroutine factor_rows_add(self, mu, y)
      type(factor_rows_t), intent(in) :: self
      real(dp), intent(in) :: mu(:)              !! (n) of forces
      real(dp), intent(inout), contiguous :: y(:)    !! (n_unknown)
      integer :: k, j, row

      if (self%by_panels) then
         call row_pool_add(self%pool, mu, y)
         return
      end if
      do k = 1, size(mu)
         row = self%n - size(mu) + k
         do j = self%start(row) + 1, self%start(row + 1)
            y(self%index(j) + 1) = y(self%index(j) + 1) + mu(k)*self%w(j)
         end do
      end do
   end subroutine factor_rows_add

end module emcon_factor_rows
