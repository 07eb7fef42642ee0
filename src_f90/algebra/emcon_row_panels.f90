!> Rows in the measure of a factor, W = L^-1 G^T, by dense panels: for columns of L that are taken
!> together, what of W is not zero there.
!>
!> Where hundreds of rows meet in the columns that are eliminated last, panels are as good as full,
!> and W^T W is a product of dense matrices.
module emcon_row_panels
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_blocks_lapack, only : dgemm, dsyrk
   use emcon_kinds, only : dp
   implicit none
   private
   public :: row_panel_t, panels_append, panels_join, panels_subtract_products, panels_add

   type :: row_panel_t
      integer :: first = 0                       !! columns of L before those of the panel
      integer, allocatable :: row(:)             !! (m) rows of G that it has, ascending
      real(dp), allocatable :: w(:, :)           !! (columns, m)
   end type row_panel_t

   interface
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
         call panel_move(own, panel(n))
         panel(n)%first = n_before + panel(n)%first
      end subroutine take

   end subroutine panels_append

   !> Add rows to panels, behind those that there are, and their products to the lower triangle of
   !> W^T W.
   subroutine panels_join(panel, more, n_more, products)
      type(row_panel_t), allocatable, intent(inout) :: panel(:)  !! ascending by columns
      type(row_panel_t), intent(inout) :: more(:)            !! so are these; has none then
      integer, intent(in) :: n_more              !! rows of `more`, numbered from 1
      real(dp), allocatable, intent(inout) :: products(:, :) !! (n, n), then with `n_more` more
      type(row_panel_t), allocatable :: old(:)
      type(ieee_status_type) :: status
      integer :: i, k, m, n

      call enlarge(products, n_more)
      call move_alloc(panel, old)
      allocate(panel(size(old) + size(more)))
      n = 0
      i = 1
      call blas_enter(status)
      do k = 1, size(more)
         more(k)%row = size(products, 1) - n_more + more(k)%row
         do while (i <= size(old))
            if (old(i)%first >= more(k)%first) exit
            call keep(old(i))
         end do
         m = i
         if (i <= size(old)) then
            if (old(i)%first == more(k)%first) call keep(old(i))
         end if
         if (i > m) call add_products(panel(n), more(k), products)
         call add_own_products(more(k), products)
         if (i > m) then
            call widen(panel(n), more(k))
         else
            n = n + 1
            call panel_move(more(k), panel(n))
         end if
      end do
      call blas_leave(status)
      do while (i <= size(old))
         call keep(old(i))
      end do
      if (n < size(panel)) call shorten(panel, n)

   contains

      subroutine keep(own)
         type(row_panel_t), intent(inout) :: own

         n = n + 1
         call panel_move(own, panel(n))
         i = i + 1
      end subroutine keep

   end subroutine panels_join

   !> What `from` has, and has no more then.
   subroutine panel_move(from, to)
      type(row_panel_t), intent(inout) :: from
      type(row_panel_t), intent(inout) :: to

      to%first = from%first
      call move_alloc(from%row, to%row)
      call move_alloc(from%w, to%w)
   end subroutine panel_move

   !> Keep the first `n`.
   subroutine shorten(panel, n)
      type(row_panel_t), allocatable, intent(inout) :: panel(:)
      integer, intent(in) :: n
      type(row_panel_t), allocatable :: old(:)
      integer :: k

      call move_alloc(panel, old)
      allocate(panel(n))
      do k = 1, n
         call panel_move(old(k), panel(k))
      end do
   end subroutine shorten

   !> Rows and columns of 0 behind those that there are.
   pure subroutine enlarge(products, n_more)
      real(dp), allocatable, intent(inout) :: products(:, :) !! (n, n)
      integer, intent(in) :: n_more
      real(dp), allocatable :: old(:, :)
      integer :: n

      call move_alloc(products, old)
      n = size(old, 1)
      allocate(products(n + n_more, n + n_more), source=0.0_dp)
      products(:n, :n) = old
   end subroutine enlarge

   !> Of rows that come with those that are there, over the columns of a panel.
   subroutine add_products(there, come, products)
      type(row_panel_t), intent(in) :: there, come
      real(dp), intent(inout), contiguous :: products(:, :)
      real(dp), allocatable :: own(:, :)
      integer :: i, j

      associate (m => size(come%row), n => size(there%row), l => size(there%w, 1))
         allocate(own(m, n), source=0.0_dp)
         call dgemm("T", "N", m, n, l, 1.0_dp, come%w, l, there%w, l, 0.0_dp, own, m)
         do j = 1, n
            do i = 1, m
               associate (to => products(come%row(i), there%row(j)))
                  to = to + own(i, j)
               end associate
            end do
         end do
      end associate
   end subroutine add_products

   !> Of rows with each other.
   subroutine add_own_products(panel, products)
      type(row_panel_t), intent(in) :: panel
      real(dp), intent(inout), contiguous :: products(:, :)
      real(dp), allocatable :: own(:, :)
      integer :: i, j

      associate (row => panel%row, n => size(panel%w, 1), m => size(panel%row))
         allocate(own(m, m), source=0.0_dp)
         call dsyrk("L", "T", m, n, 1.0_dp, panel%w, n, 0.0_dp, own, m)
         do j = 1, m
            do i = j, m
               products(row(i), row(j)) = products(row(i), row(j)) + own(i, j)
            end do
         end do
      end associate
   end subroutine add_own_products

   !> The rows of `more` behind those of `panel`.
   pure subroutine widen(panel, more)
      type(row_panel_t), intent(inout) :: panel, more        !! this has none then
      real(dp), allocatable :: w(:, :)
      integer :: m

      m = size(panel%row)
      allocate(w(size(panel%w, 1), m + size(more%row)))
      w(:, :m) = panel%w
      w(:, m + 1:) = more%w
      panel%row = [panel%row, more%row]
      call move_alloc(w, panel%w)
      deallocate(more%row, more%w)
   end subroutine widen

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
