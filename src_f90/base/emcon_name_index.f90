!> Names and what each stands for: found in a time that does not depend on how many there are.
module emcon_name_index
   use emcon_kinds, only : int64
   use emcon_text, only : string_t
   implicit none
   private
   public :: name_index_t, name_index_put, name_index_find, name_index_pair

   integer, parameter :: first_size = 16          !! of the table, a power of two as all sizes

   !> A hash table with open addresses; at least half of it is free.
   type :: name_index_t
      private
      integer :: n = 0
      integer, allocatable :: slot(:)            !! 0: free; otherwise the entry that is here
      integer, allocatable :: value(:)           !! of each entry
      type(string_t), allocatable :: name(:)     !! of each entry
   end type name_index_t

contains

   !> Let `name` stand for `value`, also if it stood for another before.
   pure subroutine name_index_put(self, name, value)
      type(name_index_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: value               !! above 0
      integer :: here

      if (.not. allocated(self%slot)) call resize(self, first_size)
      if (2*self%n >= size(self%slot)) call resize(self, 2*size(self%slot))
      here = place(self, name)
      if (self%slot(here) == 0) then
         self%n = self%n + 1
         self%slot(here) = self%n
         self%name(self%n)%text = name
      end if
      self%value(self%slot(here)) = value
   end subroutine name_index_put

   !> What `name` stands for; 0: nothing.
   pure integer function name_index_find(self, name) result(value)
      type(name_index_t), intent(in) :: self
      character(len=*), intent(in) :: name

      value = 0
      if (self%n == 0) return
      value = self%slot(place(self, name))
      if (value > 0) value = self%value(value)
   end function name_index_find

   !> Two numbers in order, as a name.
   pure function name_index_pair(first, second) result(name)
      integer, intent(in) :: first, second
      character(len=8) :: name

      name = transfer([first, second], name)
   end function name_index_pair

   !> The slot of `name`, or the free one where it belongs.
   pure integer function place(self, name)
      type(name_index_t), intent(in) :: self
      character(len=*), intent(in) :: name

      place = 1 + int(modulo(hash(name), size(self%slot, kind=int64)))
      do while (self%slot(place) > 0)
         associate (other => self%name(self%slot(place))%text)
            if (len(other) == len(name)) then
               if (other == name) return
            end if
         end associate
         place = 1 + modulo(place, size(self%slot))
      end do
   end function place

   !> A polynomial of the letters modulo a prime below 2**31: products fit into 64 bits.
   pure integer(int64) function hash(name)
      character(len=*), intent(in) :: name
      integer(int64), parameter :: base = 1000003_int64, prime = 2147483647_int64
      integer :: i

      hash = 0
      do i = 1, len(name)
         hash = modulo(hash*base + iachar(name(i:i)), prime)
      end do
   end function hash

   !> Make room for more names.
   pure subroutine resize(self, n)
      type(name_index_t), intent(inout) :: self
      integer, intent(in) :: n                   !! slots
      type(string_t), allocatable :: name(:)
      integer, allocatable :: value(:)
      integer :: i

      allocate(name(n/2), value(n/2))
      do i = 1, self%n
         call move_alloc(self%name(i)%text, name(i)%text)
      end do
      if (self%n > 0) value(:self%n) = self%value(:self%n)
      call move_alloc(name, self%name)
      call move_alloc(value, self%value)
      if (allocated(self%slot)) deallocate(self%slot)
      allocate(self%slot(n), source=0)
      do i = 1, self%n
         self%slot(place(self, self%name(i)%text)) = i
      end do
   end subroutine resize

end module emcon_name_index
