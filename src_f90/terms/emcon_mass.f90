!> The mass between nodes, the same in both directions: that of the elements and what is given.
module emcon_mass
   use emcon_csr, only : csr_find, csr_from_elements, csr_t
   use emcon_element_kinds, only : element_kinds
   use emcon_element_lists, only : element_lists
   use emcon_errors, only : error_t
   use emcon_given_sum, only : given_sum_t
   use emcon_kinds, only : dp
   use emcon_reduction, only : reduction_add, reduction_slot, reduction_t
   use emcon_solid, only : solid_t
   implicit none
   private
   public :: mass_init, mass_place

contains

   !> The mass matrix, node by node.
   subroutine mass_init(mass, solid, given, error)
      type(csr_t), intent(out) :: mass           !! (n_node x n_node) [M]
      type(solid_t), intent(in) :: solid
      type(given_sum_t), intent(in) :: given
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: start(:), list(:), slot(:)
      integer :: e, i, j, k, n

      call element_lists(solid, 1, start, list)
      if (given%is_any) call append_given(given%given%mass, start, list)
      call csr_from_elements(mass, solid%n_node, start, list, slot, error)
      if (allocated(error)) return
      k = 0
      do e = 1, solid%n_element
         n = start(e + 1) - start(e)
         do j = 1, n
            do i = 1, n
               k = k + 1
               mass%value(slot(k)) = mass%value(slot(k)) + real(solid%mass(i, j, e), dp)
            end do
         end do
      end do
      if (.not. given%is_any) return
      associate (extra => given%given%mass)
         do i = 1, extra%n_row
            do k = extra%row_start(i) + 1, extra%row_start(i + 1)
               associate (to => mass%value(csr_find(mass, i, extra%column(k) + 1)))
                  to = to + extra%value(k)
               end associate
            end do
         end do
      end associate
   end subroutine mass_init

   !> Append the pairs of nodes between which there is mass.
   pure subroutine append_given(mass, start, list)
      type(csr_t), intent(in) :: mass
      integer, allocatable, intent(inout) :: start(:), list(:)
      integer, allocatable :: pair(:, :)
      integer :: i, k, n

      if (mass%n_row == 0) return
      allocate(pair(2, size(mass%column)))
      do i = 1, mass%n_row
         do k = mass%row_start(i) + 1, mass%row_start(i + 1)
            pair(:, k) = [i, mass%column(k) + 1]
         end do
      end do
      n = size(list)
      list = [list, reshape(pair, [size(pair)])]
      start = [start, [(n + 1 + 2*i, i = 1, size(pair, 2))]]
   end subroutine append_given

   !> Put the mass into the pattern of the matrix.
   subroutine mass_place(solid, given, slot, number, reduction, matrix)
      type(solid_t), intent(in) :: solid
      type(given_sum_t), intent(in) :: given
      integer, intent(in) :: slot(:)             !! element entries, as `reduction_slot` gives them
      integer, intent(in) :: number(:)           !! as `freedom_numbers` gives them
      type(reduction_t), intent(inout) :: reduction
      type(csr_t), intent(inout) :: matrix
      integer :: e, i, j, a, k, n, before

      matrix%value = 0.0_dp
      before = 0
      do e = 1, solid%n_element
         n = element_kinds(solid%kind(e))%n_node
         do j = 1, n
            do i = 1, n
               do a = 1, 2
                  call add(slot(before + 2*(i - 1) + a + 2*n*(2*(j - 1) + a - 1)), &
                     real(solid%mass(i, j, e), dp))
               end do
            end do
         end do
         before = before + 4*n*n
      end do
      if (given%is_any) then
         associate (extra => given%given%mass)
            do i = 1, extra%n_row
               do k = extra%row_start(i) + 1, extra%row_start(i + 1)
                  do a = 1, 2
                     call add(reduction_slot(reduction, matrix, number(2*(i - 1) + a), &
                        number(2*extra%column(k) + a)), extra%value(k))
                  end do
               end do
            end do
         end associate
      end if
      call reduction_add(reduction, matrix)

   contains

      subroutine add(slot, mass)
         integer, intent(in) :: slot
         real(dp), intent(in) :: mass

         if (slot > 0) matrix%value(slot) = matrix%value(slot) + mass
         if (slot < 0) reduction%side%value(-slot) = reduction%side%value(-slot) + mass
      end subroutine add

   end subroutine mass_place

end module emcon_mass
