!> Which degrees of freedom meet in which element.
module emcon_element_lists
   use emcon_solid, only : solid_t
   implicit none
   private
   public :: element_lists

contains

   !> Lists of the degrees of freedom of all elements, or of some, as `csr_from_elements` reads
   !> them; degree of freedom a of node i is `n_dim*(i - 1) + a`.
   pure subroutine element_lists(solid, n_dim, start, list, is_in)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! freedoms per node
      integer, allocatable, intent(out) :: start(:)   !! (elements + 1) into `list`; last: size + 1
      integer, allocatable, intent(out) :: list(:)   !! degrees of freedom, element by element
      logical, intent(in), optional :: is_in(:)  !! (n_element) the elements; absent: all
      logical :: is_meant(solid%n_element)
      integer :: e, i, a, k, n

      is_meant = .true.
      if (present(is_in)) is_meant = is_in
      allocate(start(count(is_meant) + 1), list(n_dim*sum(solid%trait%n_node, is_meant)))
      k = 0
      n = 0
      do e = 1, solid%n_element
         if (.not. is_meant(e)) cycle
         n = n + 1
         start(n) = k + 1
         do i = 1, solid%trait%n_node(e)
            do a = 1, n_dim
               k = k + 1
               list(k) = n_dim*(solid%node(i, e) - 1) + a
            end do
         end do
      end do
      start(n + 1) = k + 1
   end subroutine element_lists

end module emcon_element_lists
