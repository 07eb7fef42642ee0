!> Places of element matrices: whatever they are they come back, in blocks or one by one.
module test_element_places
   use check, only : check_equal, test_case_t
   use emcon_element_places, only : element_places_find, element_places_init, element_places_t
   use emcon_errors, only : error_t
   implicit none
   private
   public :: collect_element_places

contains

   subroutine collect_element_places(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("places come back", test_places)]
   end subroutine collect_element_places

   !> Elements of two and three nodes, one without places between them: whole blocks; an entry that
   !> is elsewhere, at the side or nowhere; rows of other distances.
   subroutine test_places(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_node(*) = [2, 0, 3, 2, 2, 3]
      integer :: n_dim, e, from
      integer, allocatable :: slot(:), found(:)
      type(element_places_t) :: places

      do n_dim = 1, 3
         slot = [blocks(n_dim, 2), blocks(n_dim, 3), blocks(n_dim, 2), blocks(n_dim, 2), &
            blocks(n_dim, 3)]
         associate (third => slot((n_dim*2)**2 + (n_dim*3)**2 + 1:))
            third(2*n_dim) = -7
            third((2*n_dim)**2 + 1) = 0
            third(2*(2*n_dim)**2 + n_dim) = 1
         end associate
         call element_places_init(places, n_dim, n_node, slot)
         from = 0
         do e = 1, size(n_node)
            if (n_node(e) == 0) cycle
            associate (n => (n_dim*n_node(e))**2)
               if (allocated(found)) deallocate(found)
               allocate(found(n))
               call element_places_find(places, e, n_node(e), found)
               call check_equal(error, found, slot(from + 1:from + n), "places")
               if (allocated(error)) return
               from = from + n
            end associate
         end do
      end do
   end subroutine test_places

   !> Places of which those of two nodes follow each other, in rows of several lengths.
   pure function blocks(n_dim, n) result(slot)
      integer, intent(in) :: n_dim, n
      integer :: slot((n_dim*n)**2), i, j, a, c, k

      k = 0
      do j = 1, n
         do c = 1, n_dim
            do i = 1, n
               do a = 1, n_dim
                  k = k + 1
                  slot(k) = 1000*i + 50*(n - j) + (a - 1)*(30 + i) + c
               end do
            end do
         end do
      end do
   end function blocks

end module test_element_places
