!> Rows of constraints in the measure of a factor, W = L^-1 G^T, that are kept from one set to the
!> next: those of a set are some of them.
!>
!> Sets of a step differ by few rows, and gradients of the others have turned by little. W of a
!> gradient that has turned does for a correction as a factor of an earlier tangent does: the way to
!> the end is longer, its end is the same. Source: docs/theory.md, section 8.
module emcon_row_pool
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_row_panels, only : panels_add, panels_join, panels_subtract_products, row_panel_t
   implicit none
   private
   public :: row_pool_t, row_pool_forget, row_pool_find, row_pool_append, row_pool_fill_products, &
      row_pool_subtract_products, row_pool_add

   type :: row_pool_t
      integer :: n = 0                               !! rows
      integer, allocatable :: place(:)               !! those of the set, 0: not there yet
      integer, allocatable, private :: name(:)       !! (n) of each, > 0
      type(csr_t), private :: gradient               !! (n x n_unknown) that W was made of
      type(row_panel_t), allocatable, private :: panel(:)
      real(dp), allocatable, private :: products(:, :)   !! (n, n) W^T W, its lower triangle
   end type row_pool_t

contains

   !> There are no rows.
   pure subroutine row_pool_forget(self)
      type(row_pool_t), intent(inout) :: self

      self%n = 0
      if (.not. allocated(self%panel)) return
      deallocate(self%panel, self%products, self%name)
      self%gradient = csr_t()
   end subroutine row_pool_forget

   !> Which of the first `size(name)` rows of `rows` are in the pool, with gradients that differ by
   !> `part` of their largest entry at most?
   pure subroutine row_pool_find(self, name, rows, part, missing)
      type(row_pool_t), intent(inout) :: self
      integer, intent(in) :: name(:)             !! (n) > 0, all different
      type(csr_t), intent(in) :: rows            !! of unknowns
      real(dp), intent(in) :: part               !! > 0
      integer, allocatable, intent(out) :: missing(:)    !! rows that are not, ascending
      integer, allocatable :: of_name(:)
      integer :: k

      self%place = [(0, k = 1, size(name))]
      if (self%n > 0) then
         allocate(of_name(max(maxval(name), maxval(self%name))), source=0)
         of_name(self%name) = [(k, k = 1, self%n)]    ! the last one of a name
         do k = 1, size(name)
            if (of_name(name(k)) == 0) cycle
            if (is_near(self, of_name(name(k)), rows, k, part)) self%place(k) = of_name(name(k))
         end do
      end if
      missing = pack([(k, k = 1, size(name))], self%place == 0)
   end subroutine row_pool_find

   !> Is row `k` nearly row `i` of the pool?
   pure logical function is_near(self, i, rows, k, part)
      type(row_pool_t), intent(in) :: self
      integer, intent(in) :: i, k
      type(csr_t), intent(in) :: rows
      real(dp), intent(in) :: part

      associate (own => self%gradient, first => rows%row_start(k) + 1, &
            last => rows%row_start(k + 1))
         associate (from => own%row_start(i) + 1, to => own%row_start(i + 1))
            is_near = last - first == to - from
            if (is_near) is_near = all(rows%column(first:last) == own%column(from:to))
            if (is_near) is_near = maxval(abs(rows%value(first:last) - own%value(from:to))) &
               <= part*maxval(abs(own%value(from:to)))
         end associate
      end associate
   end function is_near

   !> Rows that were missing, with their panels.
   subroutine row_pool_append(self, name, rows, missing, panel)
      type(row_pool_t), intent(inout) :: self
      integer, intent(in) :: name(:)             !! of all rows of the set
      type(csr_t), intent(in) :: rows            !! the missing ones alone
      integer, intent(in) :: missing(:)          !! which these are
      type(row_panel_t), intent(inout) :: panel(:)   !! theirs; has none then
      integer :: k

      if (self%n == 0) then
         allocate(self%panel(0), self%products(0, 0), self%name(0))
         self%gradient%row_start = [0]
         self%gradient%column = [integer ::]
         self%gradient%value = [real(dp) ::]
      end if
      self%place(missing) = [(self%n + k, k = 1, size(missing))]
      self%n = self%n + size(missing)
      self%name = [self%name, name(missing)]
      associate (own => self%gradient)
         own%row_start = [own%row_start, size(own%column) + rows%row_start(2:)]
         own%column = [own%column, rows%column]
         own%value = [own%value, rows%value]
      end associate
      call panels_join(self%panel, panel, size(missing), self%products)
   end subroutine row_pool_append

   !> W^T W of the set, its lower triangle.
   pure subroutine row_pool_fill_products(self, products)
      type(row_pool_t), intent(in) :: self
      real(dp), intent(inout) :: products(:, :)  !! (n, n)
      integer :: i, j

      do j = 1, size(self%place)
         associate (a => self%place(j))
            do i = j, size(self%place)
               products(i, j) = self%products(max(a, self%place(i)), min(a, self%place(i)))
            end do
         end associate
      end do
   end subroutine row_pool_fill_products

   !> mu = mu - W^T y
   subroutine row_pool_subtract_products(self, y, mu)
      type(row_pool_t), intent(in) :: self
      real(dp), intent(in), contiguous :: y(:)   !! (n_unknown) in the order of L
      real(dp), intent(inout) :: mu(:)           !! of the first rows of the set
      real(dp) :: all_mu(self%n)

      all_mu = 0.0_dp
      associate (place => self%place(:size(mu)))
         all_mu(place) = mu
         call panels_subtract_products(self%panel, y, all_mu)
         mu = all_mu(place)
      end associate
   end subroutine row_pool_subtract_products

   !> y = y + W mu
   subroutine row_pool_add(self, mu, y)
      type(row_pool_t), intent(in) :: self
      real(dp), intent(in) :: mu(:)              !! of the last rows of the set
      real(dp), intent(inout), contiguous :: y(:)    !! (n_unknown) in the order of L
      real(dp) :: all_mu(self%n)

      all_mu = 0.0_dp
      all_mu(self%place(size(self%place) - size(mu) + 1:)) = mu
      call panels_add(self%panel, all_mu, y)
   end subroutine row_pool_add

end module emcon_row_pool
