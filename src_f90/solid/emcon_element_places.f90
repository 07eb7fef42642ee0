! build: streams
!> Where the entries of element matrices stand in the matrix of the system.
!>
!> Where all unknowns of a node follow each other in rows and columns, as they do where nothing is
!> held or tied, two numbers for each pair of nodes tell the places of a whole block: a hexahedron
!> then takes an eighth of the memory of all its places.
module emcon_element_places
   implicit none
   private
   public :: element_places_t, element_places_init, element_places_find

   type :: element_places_t
      integer, private :: n_dim = 0              !! unknowns of a node
      !> (n_element) entries of `place` before those of each; < 0: one less than minus that, of
      !> blocks
      integer, allocatable, private :: first(:)
      !> All places of an element by columns; or of blocks their first places (n, n) by columns, and
      !> how far the next row is from each (n)
      integer, allocatable, private :: place(:)
   end type element_places_t

contains

   !> Take the places `slot` of all elements, one after the other.
   pure subroutine element_places_init(self, n_dim, n_node, slot)
      type(element_places_t), intent(out) :: self
      integer, intent(in) :: n_dim               !! > 0
      integer, intent(in) :: n_node(:)           !! (n_element) of each; 0: it has no places
      integer, intent(in) :: slot(:)             !! by columns; <= 0: anywhere else
      integer :: e, n, next, m, pass

      self%n_dim = n_dim
      allocate(self%first(size(n_node)), source=0)
      do pass = 1, 2                             ! count, then fill
         n = 0
         next = 0
         do e = 1, size(n_node)
            m = n_node(e)
            if (m == 0) cycle
            associate (own => slot(next + 1:next + (n_dim*m)**2))
               if (pass == 1) self%first(e) = merge(-1 - n, n, is_of_blocks(n_dim, m, own))
               if (pass == 2 .and. self%first(e) < 0) call take_blocks(n_dim, m, own, &
                  self%place(n + 1:))
               if (pass == 2 .and. self%first(e) >= 0) self%place(n + 1:n + size(own)) = own
            end associate
            n = n + merge(m*(m + 1), (n_dim*m)**2, self%first(e) < 0)
            next = next + (n_dim*m)**2
         end do
         if (pass == 1) allocate(self%place(n))
      end do
   end subroutine element_places_init

   !> Do the entries of each pair of nodes follow each other, in rows that have the same distance
   !> for all pairs?
   pure logical function is_of_blocks(n_dim, n, slot)
      integer, intent(in) :: n_dim, n            !! unknowns of a node, nodes
      integer, intent(in) :: slot(n_dim, n, n_dim, n)    !! by columns
      integer :: i, j, a, c, step(n)

      step = slot(min(2, n_dim), :, 1, 1) - slot(1, :, 1, 1)
      is_of_blocks = all(slot > 0)
      do j = 1, n
         do c = 1, n_dim
            do i = 1, n
               do a = 1, n_dim
                  is_of_blocks = is_of_blocks .and. slot(a, i, c, j) == slot(1, i, 1, j) &
                     + (a - 1)*step(i) + c - 1
               end do
            end do
         end do
      end do
   end function is_of_blocks

   !> What tells the places of blocks.
   pure subroutine take_blocks(n_dim, n, slot, place)
      integer, intent(in) :: n_dim, n            !! unknowns of a node, nodes
      integer, intent(in) :: slot(n_dim, n, n_dim, n)    !! by columns
      integer, intent(inout) :: place(n, *)      !! the first n + 1 columns are set
      integer :: j

      do j = 1, n
         place(:, j) = slot(1, :, 1, j)
      end do
      place(:, n + 1) = slot(min(2, n_dim), :, 1, 1) - slot(1, :, 1, 1)
   end subroutine take_blocks

   !> The places of element `e`.
   pure subroutine element_places_find(self, e, n, slot)
      type(element_places_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element, one that has places
      integer, intent(in) :: n                   !! nodes of it
      integer, intent(out) :: slot(self%n_dim, n, self%n_dim, n)     !! by columns
      integer :: i, j, a, c, k

      k = self%first(e)
      if (k >= 0) then
         slot = reshape(self%place(k + 1:k + size(slot)), shape(slot))
         return
      end if
      k = -1 - k
      do j = 1, n
         do c = 1, self%n_dim
            do i = 1, n
               do a = 1, self%n_dim
                  slot(a, i, c, j) = self%place(k + (j - 1)*n + i) + (a - 1)*self%place(k + n*n &
                     + i) + c - 1
               end do
            end do
         end do
      end do
   end subroutine element_places_find

end module emcon_element_places
