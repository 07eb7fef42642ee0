!> From the user's node and element numbers to indices.
module emcon_deck_labels
   use emcon_sort, only : find_sorted, sort_order
   implicit none
   private
   public :: label_map_t, label_map_init, find_label, label_range

   !> Labels in ascending order with the index of each.
   type :: label_map_t
      integer, allocatable :: label(:)
      integer, allocatable :: index(:)
   end type label_map_t

contains

   !> Sort `label`; `repeated` gets the indices whose label an earlier index has, in their order.
   subroutine label_map_init(self, label, repeated)
      type(label_map_t), intent(out) :: self
      integer, intent(in) :: label(:)
      integer, allocatable, intent(out) :: repeated(:)
      logical, allocatable :: again(:)
      integer :: i, n

      n = size(label)
      allocate(again(n))
      if (all(label(2:) > label(:n - 1))) then
         self%label = label
         self%index = [(i, i = 1, n)]
         allocate(repeated(0))
         return
      end if
      self%index = sort_order(label)
      self%label = label(self%index)
      again = .false.
      do i = 2, n
         again(self%index(i)) = self%label(i) == self%label(i - 1)
      end do
      ! The sort is stable: the first of equal labels is the one defined first.
      repeated = pack([(i, i = 1, n)], again)
      self%label = pack(self%label, .not. again(self%index))
      self%index = pack(self%index, .not. again(self%index))
   end subroutine label_map_init

   !> Index of `label`, 0 if it is unknown.
   pure integer function find_label(self, label)
      type(label_map_t), intent(in) :: self
      integer, intent(in) :: label

      find_label = find_sorted(self%label, label)
      if (find_label > 0) find_label = self%index(find_label)
   end function find_label

   !> Places in the sorted list of the labels from `first` to `last`: low..high.
   pure subroutine label_range(self, first, last, low, high)
      type(label_map_t), intent(in) :: self
      integer, intent(in) :: first, last
      integer, intent(out) :: low, high

      low = lower_place(self%label, first)
      high = lower_place(self%label, last)
      if (high <= size(self%label)) then
         if (self%label(high) == last) return
      end if
      high = high - 1
   end subroutine label_range

   !> First place in the ascending `list` of an entry not below `value`; size + 1: none.
   pure integer function lower_place(list, value)
      integer, intent(in) :: list(:)
      integer, intent(in) :: value
      integer :: high, middle

      lower_place = 1
      high = size(list) + 1
      do while (lower_place < high)
         middle = lower_place + (high - lower_place)/2
         if (list(middle) < value) then
            lower_place = middle + 1
         else
            high = middle
         end if
      end do
   end function lower_place

end module emcon_deck_labels
