!> A balanced tree of boxes, of the plane or of space: which boxes are near a given one.
!>
!> Built by splitting at the median of the centres, along the axis where they spread most, in
!> O(n log n) whatever the boxes are; equal centres keep the order of their indices. Only
!> comparisons, differences and halves are formed: boxes scaled by a power of two give the same
!> tree and the same answers.
module emcon_box_tree
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_kinds, only : dp, wp
   use emcon_sort, only : sort_few, sort_order
   implicit none
   private
   public :: box_tree_t, box_tree_init, box_tree_find, box_tree_guess, box_tree_next, &
      leaf_size

   !> Boxes in a leaf, at most; a leaf of several has more than half of that.
   integer, parameter :: leaf_size = 8
   !> Squares of distances are off by less, relatively.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
   !> Squares of longer reaches are too large.
   real(wp), parameter :: farthest = 0.5_wp*sqrt(huge(1.0_wp))
   !> Up to this length, lists are sorted by insertion.
   integer, parameter :: short_list = 16

   !> A complete binary tree: node k stands above 2k and 2k + 1, leaf i is node n_leaf + i - 1.
   type :: box_tree_t
      private
      integer :: n_leaf = 0                      !! a power of two; 0: no boxes
      integer, allocatable :: start(:)           !! (n_leaf + 1) first box of each leaf
      integer, allocatable :: box(:)             !! (n_box) index of each box, leaf by leaf
      real(wp), allocatable :: bounds(:, :)      !! (2 n_dim, n_box) low corner, then high one
      real(wp), allocatable :: around(:, :)      !! (2 n_dim, 2 n_leaf - 1) the same of each node
   end type box_tree_t

contains

   !> The tree of the boxes from `low` to `high`. Boxes that are not finite are left out.
   pure subroutine box_tree_init(self, low, high)
      type(box_tree_t), intent(out) :: self
      real(wp), intent(in) :: low(:, :), high(:, :)   !! (n_dim, n_box) [L]
      integer :: i, k, n, n_dim

      n_dim = size(low, 1)
      allocate(self%box(size(low, 2)))
      n = 0
      do i = 1, size(low, 2)
         if (.not. is_finite_box(low(:, i), high(:, i))) cycle
         n = n + 1
         self%box(n) = i
      end do
      if (n == 0) return
      self%box = self%box(:n)
      self%n_leaf = 1
      do while (leaf_size*self%n_leaf < n)
         self%n_leaf = 2*self%n_leaf
      end do
      call sort_into_leaves(self, low, high)
      allocate(self%bounds(2*n_dim, n), self%around(2*n_dim, 2*self%n_leaf - 1))
      do i = 1, n
         self%bounds(:, i) = [low(:, self%box(i)), high(:, self%box(i))]
      end do
      do i = 1, self%n_leaf
         associate (here => self%bounds(:, self%start(i):self%start(i + 1) - 1))
            self%around(:, self%n_leaf + i - 1) = &
               [minval(here(:n_dim, :), dim=2), maxval(here(n_dim + 1:, :), dim=2)]
         end associate
      end do
      do k = self%n_leaf - 1, 1, -1
         self%around(:n_dim, k) = min(self%around(:n_dim, 2*k), self%around(:n_dim, 2*k + 1))
         self%around(n_dim + 1:, k) = max(self%around(n_dim + 1:, 2*k), &
            self%around(n_dim + 1:, 2*k + 1))
      end do
   end subroutine box_tree_init

   !> Halve the boxes again and again. The orders of the centres along all axes are kept through
   !> each split, so that none is sorted twice.
   pure subroutine sort_into_leaves(self, low, high)
      type(box_tree_t), intent(inout) :: self
      real(wp), intent(in) :: low(:, :), high(:, :)
      real(dp), allocatable :: centre(:, :)
      integer, allocatable :: order(:, :), spare(:)
      logical, allocatable :: is_left(:)
      integer :: n, n_dim, a, stride, k, middle

      n = size(self%box)
      n_dim = size(low, 1)
      allocate(centre(n, n_dim), order(n, n_dim), spare(n), is_left(n))
      do a = 1, n_dim
         centre(:, a) = real(0.5_wp*low(a, self%box) + 0.5_wp*high(a, self%box), dp)
         order(:, a) = sort_order(centre(:, a))
      end do
      allocate(self%start(self%n_leaf + 1))
      self%start(1) = 1
      self%start(self%n_leaf + 1) = n + 1
      stride = self%n_leaf
      do while (stride > 1)
         do k = 1, self%n_leaf, stride
            middle = self%start(k) + (self%start(k + stride) - self%start(k))/2
            self%start(k + stride/2) = middle
            call split(centre, self%start(k), middle, self%start(k + stride) - 1, order, is_left, &
               spare)
         end do
         stride = stride/2
      end do
      self%box = self%box(order(:, 1))
   end subroutine sort_into_leaves

   !> Move what lies left of `middle` along the axis of the larger spread to the left.
   pure subroutine split(centre, first, middle, last, order, is_left, spare)
      real(dp), intent(in), contiguous :: centre(:, :)      !! (n_box, n_dim)
      integer, intent(in) :: first, middle, last            !! first..last is split
      integer, intent(inout), contiguous :: order(:, :)     !! (n_box, n_dim) ascending on each axis
      logical, intent(inout), contiguous :: is_left(:)      !! (n_box) work space
      integer, intent(inout), contiguous :: spare(:)        !! (n_box) work space
      integer :: axis, i, n_left, n_right, other
      real(dp) :: spread(size(centre, 2))

      do axis = 1, size(spread)
         spread(axis) = centre(order(last, axis), axis) - centre(order(first, axis), axis)
      end do
      axis = maxloc(spread, dim=1)
      do i = first, last
         is_left(order(i, axis)) = i < middle
      end do
      do other = 1, size(spread)
         if (other == axis) cycle
         n_left = 0
         n_right = 0
         do i = first, last
            if (is_left(order(i, other))) then
               order(first + n_left, other) = order(i, other)
               n_left = n_left + 1
            else
               n_right = n_right + 1
               spare(n_right) = order(i, other)
            end if
         end do
         order(middle:last, other) = spare(:n_right)
      end do
   end subroutine split

   !> Append to found(:n), ascending, the boxes no farther than `reach` from that of `low`, `high`,
   !> along each axis. Nothing is near a box that is not finite.
   pure subroutine box_tree_find(self, low, high, reach, found, n)
      type(box_tree_t), intent(in) :: self
      real(wp), intent(in), contiguous :: low(:), high(:)    !! (n_dim) [L]
      real(wp), intent(in) :: reach              !! >= 0 [L]
      integer, allocatable, intent(inout) :: found(:)   !! made longer where needed
      integer, intent(inout) :: n                !! number in `found`, >= 0
      integer :: k, i, leaf, n_before

      if (self%n_leaf == 0) return
      if (.not. is_finite_box(low, high)) return
      n_before = n
      k = 1
      do while (k > 0)
         if (is_near(self%around(:, k), low, high, reach)) then
            if (k < self%n_leaf) then
               k = 2*k
               cycle
            end if
            leaf = k - self%n_leaf + 1
            if (size(found) < n + leaf_size) call lengthen(found, n + leaf_size)
            do i = self%start(leaf), self%start(leaf + 1) - 1
               if (.not. is_near(self%bounds(:, i), low, high, reach)) cycle
               n = n + 1
               found(n) = self%box(i)
            end do
         end if
         k = next_node(k)
      end do
      call sort_list(found(n_before + 1:n))
   end subroutine box_tree_find

   !> Some boxes near a point: where it is for the nearer of two branches, again and again.
   pure subroutine box_tree_guess(self, point, found)
      type(box_tree_t), intent(in) :: self
      real(wp), intent(in), contiguous :: point(:)           !! (n_dim) [L]
      integer, allocatable, intent(out) :: found(:)          !! none where there are no boxes
      integer :: k

      k = 1
      do while (k < self%n_leaf)
         associate (one => self%around(:, k + k), other => self%around(:, k + k + 1))
            k = k + k + merge(1, 0, square_to(other, point) < square_to(one, point))
         end associate
      end do
      if (self%n_leaf == 0) then
         allocate(found(0))
      else
         associate (leaf => k - self%n_leaf + 1)
            found = self%box(self%start(leaf):self%start(leaf + 1) - 1)
         end associate
      end if
   end subroutine box_tree_guess

   !> The boxes of the next leaf that has some no farther than `reach` from a point, straight to it,
   !> by found(:n); it may fall from call to call. The walk begins at k = 1 and ends with k = 0.
   pure subroutine box_tree_next(self, point, reach, k, found, n)
      type(box_tree_t), intent(in) :: self
      real(wp), intent(in), contiguous :: point(:)           !! (n_dim) [L]
      real(wp), intent(in) :: reach              !! >= 0 [L]
      integer, intent(inout) :: k                !! node where the walk goes on
      integer, intent(out) :: found(:)           !! (leaf_size)
      integer, intent(out) :: n                  !! number in `found`; 0: the walk has ended
      real(wp) :: bound
      integer :: i, leaf

      n = 0
      if (self%n_leaf == 0) k = 0
      bound = huge(bound)
      if (reach < farthest) bound = (1.0_wp + rounding)*reach**2
      do while (k > 0)
         if (square_to(self%around(:, k), point) <= bound) then
            if (k < self%n_leaf) then
               k = k + k
               cycle
            end if
            leaf = k - self%n_leaf + 1
            do i = self%start(leaf), self%start(leaf + 1) - 1
               if (.not. square_to(self%bounds(:, i), point) <= bound) cycle
               n = n + 1
               found(n) = self%box(i)
            end do
         end if
         k = next_node(k)
         if (n > 0) return
      end do
   end subroutine box_tree_next

   !> The square of the distance of a point from a box.
   pure real(wp) function square_to(bounds, point) result(square)
      real(wp), intent(in), contiguous :: bounds(:), point(:)
      integer :: a

      square = 0.0_wp
      associate (n_dim => size(point))
         do a = 1, n_dim
            square = square + max(0.0_wp, bounds(a) - point(a), point(a) - bounds(n_dim + a))**2
         end do
      end associate
   end function square_to

   !> The node after the branch of node `k`; 0 after the last one.
   pure integer function next_node(k)
      integer, intent(in) :: k

      next_node = k
      do while (mod(next_node, 2) == 1)
         next_node = next_node/2
      end do
      if (next_node > 0) next_node = next_node + 1
   end function next_node

   !> Differences, as in the distance of two boxes: they are monotone when rounded, so what is near
   !> a box is near each node above it.
   pure logical function is_near(bounds, low, high, reach)
      real(wp), intent(in), contiguous :: bounds(:), low(:), high(:)
      real(wp), intent(in) :: reach
      integer :: a

      is_near = .false.
      associate (n_dim => size(low))
         do a = 1, n_dim
            if (.not. (low(a) - bounds(n_dim + a) <= reach)) return
            if (.not. (bounds(a) - high(a) <= reach)) return
         end do
      end associate
      is_near = .true.
   end function is_near

   pure logical function is_finite_box(low, high)
      real(wp), intent(in) :: low(:), high(:)

      is_finite_box = all(ieee_is_finite(low)) .and. all(ieee_is_finite(high))
   end function is_finite_box

   !> Give `list` room for at least `n` entries, and twice what it had.
   pure subroutine lengthen(list, n)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(in) :: n
      integer, allocatable :: longer(:)

      allocate(longer(max(n, 2*size(list))))
      longer(:size(list)) = list
      call move_alloc(longer, list)
   end subroutine lengthen

   pure subroutine sort_list(list)
      integer, intent(inout), contiguous :: list(:)

      if (size(list) > short_list) then
         list = list(sort_order(list))
         return
      end if
      call sort_few(list)
   end subroutine sort_list

end module emcon_box_tree
