! build: elements
!> From derivatives of a patch's gap by its frame and vertices to those by nodes.
!>
!> Vertices are places from the point of the patch. Where that is a sum of nodes each derivative by
!> a vertex would go to all of them: they take the sum over the vertices, once.
module emcon_patch_spread_space
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap_t
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: patch_uses, patch_spread_t, patch_spread_list, patch_spread

   !> Columns of both vectors of the frame and of its point; those of vertices follow.
   integer, parameter :: at_point = 3

   !> Weights of nodes, but the first, in what a gap depends on.
   type :: patch_spread_t
      integer :: n_node = 0                      !! that are used
      integer, allocatable :: start(:)           !! (n_column + 1) entries before each column
      integer, allocatable :: row(:)             !! (any) of a node, from 1 for the second
      real(wp), allocatable :: entry(:)          !! the same
   end type patch_spread_t

contains

   !> Which nodes of a stencil a gap depends on: those of the slave, and of the vertices it sees.
   pure function patch_uses(stencil, vertex) result(is_used)
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: vertex(:)           !! that it depends on
      logical :: is_used(stencil%n_node)
      integer :: j

      is_used(:stencil%n_slave) = .true.
      is_used(stencil%n_slave + 1:) = .false.
      do j = 1, size(vertex)
         associate (column => 2 + vertex(j))
            is_used(stencil%row(stencil%start(column) + 1:stencil%start(column + 1))) = .true.
         end associate
      end do
   end function patch_uses

   !> The weights of the nodes that are used.
   pure subroutine patch_spread_list(stencil, vertex, is_used, spread)
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: vertex(:)           !! that a gap depends on
      logical, intent(in) :: is_used(:)          !! (n_node of the stencil) of `patch_uses`
      type(patch_spread_t), intent(out) :: spread
      integer :: column(at_point + size(vertex)), place(stencil%n_node), e, j, k, n
      real(wp) :: weight

      spread%n_node = 0
      do k = 1, stencil%n_node
         if (is_used(k)) spread%n_node = spread%n_node + 1
         place(k) = spread%n_node - 1
      end do
      column = [1, 2, 0, 2 + vertex]
      n = stencil%n_origin + sum(stencil%start(column(1:2) + 1) - stencil%start(column(1:2))) &
         + sum(stencil%start(2 + vertex + 1) - stencil%start(2 + vertex))
      allocate(spread%start(size(column) + 1), spread%row(n), spread%entry(n))
      n = 0
      do j = 1, size(column)
         spread%start(j) = n
         if (j == at_point) then
            do k = 2, stencil%n_origin
               call append(place(k), stencil%origin(k), spread, n)
            end do
            cycle
         end if
         do e = stencil%start(column(j)) + 1, stencil%start(column(j) + 1)
            k = stencil%row(e)
            weight = stencil%entry(e)
            if (j > at_point .and. k <= stencil%n_origin) weight = weight + stencil%origin(k)
            if (abs(weight) > 0.0_wp) call append(place(k), weight, spread, n)
         end do
      end do
      spread%start(size(column) + 1) = n
   end subroutine patch_spread_list

   !> One more weight of the last column.
   pure subroutine append(row, entry, spread, n)
      integer, intent(in) :: row
      real(wp), intent(in) :: entry
      type(patch_spread_t), intent(inout) :: spread
      integer, intent(inout) :: n                !! entries so far

      n = n + 1
      spread%row(n) = row
      spread%entry(n) = entry
   end subroutine append

   !> Add a gap by `scale` and its derivatives to a condition.
   pure subroutine patch_spread(gap, spread, scale, place, item)
      type(patch_gap_t), intent(in) :: gap
      type(patch_spread_t), intent(in) :: spread !! of the nodes that it depends on
      real(wp), intent(in) :: scale              !! > 0, what the value is divided by
      integer, intent(in) :: place(:)            !! (n_node) of these in `item`
      type(condition_t), intent(inout) :: item   !! with room for them

      item%gap0 = item%gap0 + gap%f0/scale
      item%gap1 = item%gap1 + gap%f1/scale
      item%dgap = item%dgap + gap%df/scale
      call spread_first(gap%g, spread, 1.0_wp/scale, place, item%g)
      call spread_first(gap%c, spread, 1.0_wp/scale, place, item%c)
      if (.not. item%leaves_second) call spread_second(gap%h, spread, 1.0_wp/scale, place, item%h)
   end subroutine patch_spread

   !> Add derivatives by nodes.
   pure subroutine spread_first(part, spread, factor, place, of_node)
      real(wp), intent(in), contiguous :: part(:)        !! by the frame and the vertices
      type(patch_spread_t), intent(in) :: spread
      real(wp), intent(in) :: factor             !! of what is added
      integer, intent(in) :: place(:)            !! (n_node) of the nodes among those of `of_node`
      real(wp), intent(inout), contiguous :: of_node(:, :)   !! (3, any)
      real(wp) :: by(3, size(spread%start) - 1), full(3, spread%n_node)
      integer :: e, j, k

      do j = 1, size(by, 2)
         k = 3*merge(j, j - 1, j < at_point)
         if (j /= at_point) by(:, j) = part(k - 2:k)
      end do
      by(:, at_point) = -sum(by(:, at_point + 1:), 2)
      full = 0.0_wp
      do j = 1, size(by, 2)
         do e = spread%start(j) + 1, spread%start(j + 1)
            associate (to => full(:, spread%row(e) + 1))
               to = to + spread%entry(e)*by(:, j)
            end associate
         end do
      end do
      full(:, 1) = -sum(full(:, 2:), 2)
      do k = 1, size(place)
         of_node(:, place(k)) = of_node(:, place(k)) + factor*full(:, k)
      end do
   end subroutine spread_first

   !> Add second derivatives by nodes. Each of these is added to once: parts give the same bits in
   !> any order.
   pure subroutine spread_second(part, spread, factor, place, of_node)
      real(wp), intent(in), contiguous :: part(:, :)     !! by the frame and the vertices, twice
      type(patch_spread_t), intent(in) :: spread
      real(wp), intent(in) :: factor             !! of what is added
      integer, intent(in) :: place(:)            !! (n_node) of the nodes among those of `of_node`
      real(wp), intent(inout), contiguous :: of_node(:, :)   !! components of nodes, twice
      real(wp) :: half(3*spread%n_node, 3*(size(spread%start) - 1))
      real(wp) :: full(3*spread%n_node, 3*spread%n_node)
      integer :: a, e, j, k

      half = 0.0_wp
      do k = 1, size(part, 2)
         call add_column(part(:, k), spread, half(:, merge(k, k + 3, k <= 6)))
      end do
      if (spread%start(at_point + 1) > spread%start(at_point)) then
         do k = 3*at_point + 1, size(half, 2), 3
            half(:, 7:9) = half(:, 7:9) - half(:, k:k + 2)
         end do
      end if
      full = 0.0_wp
      do j = 1, size(spread%start) - 1
         do e = spread%start(j) + 1, spread%start(j + 1)
            do a = 1, 3
               associate (to => 3*spread%row(e) + a)
                  full(:, to) = full(:, to) + spread%entry(e)*half(:, 3*(j - 1) + a)
               end associate
            end do
         end do
      end do
      do k = 4, size(full, 2), 3
         full(:, :3) = full(:, :3) - full(:, k:k + 2)
      end do
      do k = 1, size(place)
         do a = -2, 0
            do j = 1, size(place)
               associate (to => of_node(3*place(j) - 2:3*place(j), 3*place(k) + a))
                  to = to + factor*full(3*j - 2:3*j, 3*k + a)
               end associate
            end do
         end do
      end do
   end subroutine spread_second

   !> Add derivatives by nodes to one column of second ones.
   pure subroutine add_column(part, spread, full)
      real(wp), intent(in), contiguous :: part(:)        !! by the frame and the vertices
      type(patch_spread_t), intent(in) :: spread
      real(wp), intent(inout), contiguous :: full(:)     !! (3 n_node)
      real(wp) :: by(3)
      integer :: e, j, k

      do j = 1, size(spread%start) - 1
         if (j == at_point) then
            if (spread%start(j + 1) == spread%start(j)) cycle
            by = 0.0_wp
            do k = 7, size(part), 3
               by = by - part(k:k + 2)
            end do
         else
            k = 3*merge(j, j - 1, j < at_point)
            by = part(k - 2:k)
         end if
         do e = spread%start(j) + 1, spread%start(j + 1)
            associate (to => full(3*spread%row(e) + 1:3*spread%row(e) + 3))
               to = to + spread%entry(e)*by
            end associate
         end do
      end do
      do k = 4, size(full), 3
         full(:3) = full(:3) - full(k:k + 2)
      end do
   end subroutine add_column

end module emcon_patch_spread_space
