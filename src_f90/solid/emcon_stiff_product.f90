!> Products with a stiffness that stays, node by node and several nodes side by side.
!>
!> f_i = sum over the neighbours j of K_ij (u_j - u_i): rows of K add up to zero, so that the blocks
!> of the diagonal are not needed and a translation rounds nothing. Source: docs/theory.md,
!> section 3.
module emcon_stiff_product
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_stiff_product_plane, only : n_lane, n_plane, form_in_plane => stiff_product_form
   implicit none
   private
   public :: stiff_product_t, stiff_product_init, stiff_product_load, stiff_product_form, &
      stiff_product_find_sizes

   !> Rows stand in groups of `n_lane` with as many neighbours as the first of them has; what is
   !> missing are blocks of zeros of the row itself.
   type :: stiff_product_t
      integer :: n = 0                                   !! rows
      integer, private :: n_dim = 0
      integer, allocatable :: node(:)                    !! (n) whose rows they are
      integer, allocatable, private :: first(:)          !! (n_group + 1) slots before each
      integer, allocatable, private :: column(:, :)      !! (n_lane, n_slot) rows of neighbours
      real(wp), allocatable, private :: block(:, :, :, :)   !! (n_lane, n_dim, n_dim, n_slot) K_ij
      real(wp), allocatable, private :: displacement(:, :) !! (n_lane*n_group, n_dim) displacements
      real(wp), allocatable, private :: computed(:)      !! (n_lane*n_group)
      real(wp), allocatable :: force(:, :)               !! (n_lane*n_group, n_dim) [M L/T^2]
      ! of `stiff_product_find_sizes`:
      real(wp), allocatable :: magnitude(:, :)           !! what forces consist of, without signs
      !> (n_lane*n_group) the largest of what differences of displacements are found from [L]
      real(wp), allocatable :: largest(:)
   end type stiff_product_t

contains

   !> Lay out and add up the stiffness of elements.
   subroutine stiff_product_init(self, n_dim, n_node, start, node, stiffness, error)
      type(stiff_product_t), intent(out) :: self
      integer, intent(in) :: n_dim                       !! > 0
      integer, intent(in) :: n_node                      !! of the mesh
      integer, intent(in), contiguous :: start(:)        !! (n_element + 1) into `node`
      integer, intent(in), contiguous :: node(:)         !! of all elements
      real(wp), intent(in) :: stiffness(:, :, :)         !! (n_dim*n_most, ., n_element) [M/T^2]
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: meets
      integer, allocatable :: slot(:)
      real(wp), allocatable :: block(:, :, :)
      integer :: e, i, j, k, n

      call csr_from_elements(meets, n_node, start, node, slot, error)
      if (allocated(error)) return
      self%n_dim = n_dim
      allocate(block(n_dim, n_dim, size(meets%column)), source=0.0_wp)
      k = 0
      do e = 1, size(start) - 1
         n = start(e + 1) - start(e)
         do j = 1, n
            do i = 1, n
               k = k + 1
               associate (to => block(:, :, slot(k)), own => stiffness(:, :, e), &
                     a => n_dim*(i - 1), b => n_dim*(j - 1))
                  to = to + 0.5_wp*(own(a + 1:a + n_dim, b + 1:b + n_dim) &
                     + transpose(own(b + 1:b + n_dim, a + 1:a + n_dim)))
               end associate
            end do
         end do
      end do
      call lay_out(self, meets)
      call fill(self, meets, block)
   end subroutine stiff_product_init

   !> Groups of rows, those with many neighbours first.
   pure subroutine lay_out(self, meets)
      type(stiff_product_t), intent(inout) :: self
      type(csr_t), intent(in) :: meets                   !! (n_node x n_node) which nodes do
      integer :: n_other(meets%n_row)
      integer :: g, i, n, n_group

      n_other = meets%row_start(2:) - meets%row_start(:meets%n_row) - 1
      self%n = count(n_other >= 0)
      n_group = (self%n + n_lane - 1)/n_lane
      allocate(self%node(self%n), self%first(n_group + 1))
      i = 0
      do n = maxval(n_other), 0, -1
         do g = 1, meets%n_row
            if (n_other(g) /= n) cycle
            i = i + 1
            self%node(i) = g
         end do
      end do
      self%first(1) = 0
      do g = 1, n_group
         self%first(g + 1) = self%first(g) + n_other(self%node(n_lane*(g - 1) + 1))
      end do
      n = n_lane*n_group
      allocate(self%displacement(n, self%n_dim), self%force(n, self%n_dim), self%magnitude(n, &
         self%n_dim), &
         self%computed(n), self%largest(n), source=0.0_wp)
   end subroutine lay_out

   !> Put the blocks beside the diagonal into their places.
   pure subroutine fill(self, meets, block)
      type(stiff_product_t), intent(inout) :: self
      type(csr_t), intent(in) :: meets
      real(wp), intent(in) :: block(:, :, :)             !! (n_dim, n_dim, entries of `meets`)
      integer :: row(meets%n_row)
      integer :: g, i, k, l, other, slot

      row(self%node) = [(i, i = 1, self%n)]
      associate (n_slot => self%first(size(self%first)))
         allocate(self%column(n_lane, n_slot), source=1)
         allocate(self%block(n_lane, self%n_dim, self%n_dim, n_slot), source=0.0_wp)
      end associate
      do g = 1, size(self%first) - 1
         do l = 1, n_lane
            i = n_lane*(g - 1) + l
            if (i > self%n) cycle
            slot = self%first(g)
            associate (node => self%node(i))
               do k = meets%row_start(node) + 1, meets%row_start(node + 1)
                  other = meets%column(k) + 1
                  if (other == node) cycle
                  slot = slot + 1
                  self%column(l, slot) = row(other)
                  self%block(l, :, :, slot) = block(:, :, k)
               end do
            end associate
         end do
      end do
   end subroutine fill

   !> Take displacements `field`, with half of `by`.
   pure subroutine stiff_product_load(self, field, by)
      type(stiff_product_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: field(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous, optional :: by(:, :)     !! (n_dim, n_node) [L]
      integer :: i

      if (present(by)) then
         do i = 1, self%n
            self%displacement(i, :) = field(:, self%node(i)) + 0.5_wp*by(:, self%node(i))
         end do
      else
         do i = 1, self%n
            self%displacement(i, :) = field(:, self%node(i))
         end do
      end if
   end subroutine stiff_product_load

   !> Forces of the displacements that were taken.
   pure subroutine stiff_product_form(self)
      type(stiff_product_t), intent(inout) :: self
      real(wp) :: f(n_lane, self%n_dim), d(n_lane), pull(n_lane, self%n_dim)
      integer :: a, b, g, i, k

      if (self%n_dim == n_plane) then
         call form_in_plane(self%first, self%column, self%block, self%displacement, self%force)
         return
      end if
      do g = 1, size(self%first) - 1
         i = n_lane*(g - 1)
         f = 0.0_wp
         do k = self%first(g) + 1, self%first(g + 1)
            pull = 0.0_wp
            do b = 1, self%n_dim
               d = self%displacement(self%column(:, k), b) - self%displacement(i + 1:i + n_lane, b)
               do a = 1, self%n_dim
                  pull(:, a) = pull(:, a) + self%block(:, a, b, k)*d
               end do
            end do
            f = f + pull
         end do
         self%force(i + 1:i + n_lane, :) = f
      end do
   end subroutine stiff_product_form

   !> The sizes of what the forces of the displacements that were taken consist of.
   pure subroutine stiff_product_find_sizes(self, computed)
      type(stiff_product_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: computed(:, :)         !! (n_dim, n_node) as in `motion_t`
      real(wp) :: d(self%n_dim), pull(self%n_dim)
      integer :: b
      integer :: g, i, j, k, l

      do i = 1, self%n
         self%computed(i) = maxval(computed(:, self%node(i)))
      end do
      self%magnitude = 0.0_wp
      self%largest = self%computed
      do g = 1, size(self%first) - 1
         do k = self%first(g) + 1, self%first(g + 1)
            do l = 1, n_lane
               i = n_lane*(g - 1) + l
               j = self%column(l, k)
               d = self%displacement(j, :) - self%displacement(i, :)
               pull = 0.0_wp
               do b = 1, self%n_dim
                  pull = pull + self%block(l, :, b, k)*d(b)
               end do
               self%magnitude(i, :) = self%magnitude(i, :) + abs(pull)
               self%largest(i) = max(self%largest(i), self%computed(j), maxval(abs(d)))
            end do
         end do
      end do
   end subroutine stiff_product_find_sizes

end module emcon_stiff_product
