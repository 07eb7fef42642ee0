!> Sorting and look-up of integers and reals. All sorts are stable, hence deterministic.
module emcon_sort
   use emcon_kinds, only : dp
   implicit none
   private
   public :: sort_order, sort_few, find_sorted, unique_sorted

   !> The stable ascending order of integers (exact in `dp`) or reals.
   interface sort_order
      module procedure sort_order_integer, sort_order_real
   end interface sort_order

contains

   !> Sort a few integers in place.
   pure subroutine sort_few(list)
      integer, intent(inout) :: list(:)
      integer :: i, k, value

      do i = 2, size(list)
         value = list(i)
         do k = i - 1, 1, -1
            if (list(k) <= value) exit
            list(k + 1) = list(k)
         end do
         list(k + 1) = value
      end do
   end subroutine sort_few

   !> The order that sorts the integers `key`: key(order) ascends, equal keys keep their places.
   pure function sort_order_integer(key) result(order)
      integer, intent(in) :: key(:)
      integer :: order(size(key))

      order = sort_order_real(real(key, dp))
   end function sort_order_integer

   !> The order that sorts the reals `key`, by a bottom-up merge.
   pure function sort_order_real(key) result(order)
      real(dp), intent(in) :: key(:)
      integer :: order(size(key))
      integer, allocatable :: spare(:)
      integer :: i, n, width, first, middle, last, i_left, i_right, k
      logical :: take_left

      n = size(key)
      order = [(i, i = 1, n)]
      allocate(spare(n))
      width = 1
      do while (width < n)
         do first = 1, n, 2*width
            middle = min(first + width, n + 1)
            last = min(first + 2*width, n + 1)
            i_left = first
            i_right = middle
            do k = first, last - 1
               take_left = i_left < middle
               if (take_left .and. i_right < last) then
                  take_left = key(order(i_left)) <= key(order(i_right))
               end if
               if (take_left) then
                  spare(k) = order(i_left)
                  i_left = i_left + 1
               else
                  spare(k) = order(i_right)
                  i_right = i_right + 1
               end if
            end do
         end do
         order = spare
         width = 2*width
      end do
   end function sort_order_real

   !> Position of `value` in the ascending `list`, 0 if it is not there.
   pure integer function find_sorted(list, value)
      integer, intent(in) :: list(:)
      integer, intent(in) :: value
      integer :: low, high, middle

      find_sorted = 0
      low = 1
      high = size(list)
      do while (low <= high)
         middle = low + (high - low)/2
         if (list(middle) == value) then
            find_sorted = middle
            return
         else if (list(middle) < value) then
            low = middle + 1
         else
            high = middle - 1
         end if
      end do
   end function find_sorted

   !> The distinct values of `list`, ascending.
   pure function unique_sorted(list) result(unique)
      integer, intent(in) :: list(:)
      integer, allocatable :: unique(:)
      integer :: sorted(size(list)), i, n

      sorted = list(sort_order(list))
      n = 0
      do i = 1, size(sorted)
         if (n > 0) then
            if (sorted(n) == sorted(i)) cycle
         end if
         n = n + 1
         sorted(n) = sorted(i)
      end do
      allocate(unique(n), source=sorted(:n))
   end function unique_sorted

end module emcon_sort
