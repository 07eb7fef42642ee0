!> Rows in the measure of a factor, W = L^-1 G^T, by dense panels: for columns of L that are taken
!> together, what of W is not zero there.
!>
!> Where hundreds of rows meet in the columns that are eliminated last, panels are as good as full,
!> and W^T W is a product of dense matrices.
module emcon_row_panels
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_kinds, only : dp
   implicit none
   private
   public :: row_panel_t, panels_append, panels_fill_products, panels_subtract_products, panels_add

   type :: row_panel_t
      integer :: first = 0                       !! columns of L before those of the panel
      integer, allocatable :: row(:)             !! (m) rows of G that it has, ascending
      real(dp), allocatable :: w(:, :)           !! (columns, m)
   end type row_panel_t

   interface
      subroutine dsyrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc)
         import :: dp
         character(len=1), intent(in) :: uplo, trans
         integer, intent(in) :: n, k, lda, ldc
         real(dp), intent(in) :: alpha, a(lda, *), beta
         real(dp), intent(inout) :: c(ldc, *)
      end subroutine dsyrk

      subroutine dgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: dp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         real(dp), intent(in) :: alpha, a(lda, *), x(*), beta
         real(dp), intent(inout) :: y(*)
      end subroutine dgemv
   end interface

contains

   !> Append those of `more` that have rows; nothing is copied.
   subroutine panels_append(panel, more, n_before)
      type(row_panel_t), allocatable, intent(inout) :: panel(:)
      type(row_panel_t), intent(inout) :: more(:)            !! has none then
      integer, intent(in) :: n_before            !! columns before those of `more`
      type(row_panel_t), allocatable :: old(:)
      integer :: k, n

      call move_alloc(panel, old)
      n = size(old)
      do k = 1, size(more)
         if (allocated(more(k)%row)) n = n + 1
      end do
      allocate(panel(n))
      n = 0
      do k = 1, size(old)
         call take(old(k), 0)
      end do
      do k = 1, size(more)
         if (allocated(more(k)%row)) call take(more(k), n_before)
      end do

   contains

      subroutine take(own, n_before)
         type(row_panel_t), intent(inout) :: own
         integer, intent(in) :: n_before

         n = n + 1
         panel(n)%first = n_before + own%first
         call move_alloc(own%row, panel(n)%row)
         call move_alloc(own%w, panel(n)%w)
      end subroutine take

   end subroutine panels_append

   !> W^T W, its lower triangle.
   subroutine panels_fill_products(panel, products)
      type(row_panel_t), intent(in) :: panel(:)
      real(dp), intent(out), contiguous :: products(:, :)    !! (n, n)
      real(dp), allocatable :: own(:, :)
      type(ieee_status_type) :: status
      integer :: i, j, p

      products = 0.0_dp
      call blas_enter(status)
      do p = 1, size(panel)
         associate (row => panel(p)%row, n => size(panel(p)%w, 1), m => size(panel(p)%row))
            allocate(own(m, m), source=0.0_dp)
            call dsyrk("L", "T", m, n, 1.0_dp, panel(p)%w, n, 0.0_dp, own, m)
            do j = 1, m
               do i = j, m
                  products(row(i), row(j)) = products(row(i), row(j)) + own(i, j)
               end do
            end do
            deallocate(own)
         end associate
      end do
      call blas_leave(status)
   end subroutine panels_fill_products

   !> mu = mu - W^T y
   subroutine panels_subtract_products(panel, y, mu)
      type(row_panel_t), intent(in) :: panel(:)
      real(dp), intent(in), contiguous :: y(:)               !! (n_unknown) in the order of L
      real(dp), intent(inout) :: mu(:)                       !! (n)
      real(dp) :: own(size(mu))
      type(ieee_status_type) :: status
      integer :: p

      call blas_enter(status)
      do p = 1, size(panel)
         associate (n => size(panel(p)%w, 1), m => size(panel(p)%row))
            call dgemv("T", n, m, 1.0_dp, panel(p)%w, n, y(panel(p)%first + 1:), 1, 0.0_dp, own, 1)
            mu(panel(p)%row) = mu(panel(p)%row) - own(:m)
         end associate
      end do
      call blas_leave(status)
   end subroutine panels_subtract_products

   !> y = y + W mu
   subroutine panels_add(panel, mu, y)
      type(row_panel_t), intent(in) :: panel(:)
      real(dp), intent(in) :: mu(:)                          !! (n)
      real(dp), intent(inout), contiguous :: y(:)            !! (n_unknown) in the order of L
      real(dp) :: own(size(mu))
      type(ieee_status_type) :: status
      integer :: p

      call blas_enter(status)
      do p = 1, size(panel)
         associate (n => size(panel(p)%w, 1), m => size(panel(p)%row))
            own(:m) = mu(panel(p)%row)
            call dgemv("N", n, m, 1.0_dp, panel(p)%w, n, own, 1, 1.0_dp, y(panel(p)%first + 1:), 1)
         end associate
      end do
      call blas_leave(status)
   end subroutine panels_add

end module emcon_row_panels
