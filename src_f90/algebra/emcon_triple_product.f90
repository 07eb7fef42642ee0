!> The product R = P^T N D of sparse matrices, for patterns that stand while values change.
!>
!> Made for the null space (docs/theory.md): most rows of P and D hold a single entry, a few hold
!> many. Where row i of P has one entry (i, a), row i of N D goes straight into row a of R; where it
!> has several, row i of N D is first collected and then scattered once per entry. Sums run in
!> fixed order: the same values give the same bits.
module emcon_triple_product
   use emcon_csr, only : csr_sort_columns, csr_t, csr_transpose
   use emcon_errors, only : err_analysis, err_internal, error_t, raise
   use emcon_kinds, only : dp, int64
   use emcon_text, only : to_text
   implicit none
   private
   public :: triple_product_t, triple_product_init, triple_product_update

   !> Where each term goes; good for the three patterns that `triple_product_init` has seen.
   type :: triple_product_t
      private
      !> For each term N(i, j) D(j, b), in the order of rows i, slots of N, slots of D: the slot of
      !> R, or the place in `collected` if row i of P has several entries.
      integer, allocatable :: target(:)
      integer, allocatable :: n_collected(:)     !! (n) entries of row i of N D
      integer, allocatable :: scatter(:)         !! slot of R for each place, for each entry of P
      real(dp), allocatable :: collected(:)      !! one row of N D, compressed
   end type triple_product_t

contains

   !> Pattern of R and the plan of the product. All that is allocated is allocated here.
   subroutine triple_product_init(self, p, n, d, r, error)
      type(triple_product_t), intent(out) :: self
      type(csr_t), intent(in) :: p                      !! (n x m_p)
      type(csr_t), intent(in) :: n                      !! (n x n)
      type(csr_t), intent(in) :: d                      !! (n x m_d)
      type(csr_t), intent(out) :: r                     !! (m_p x m_d) values are zero
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: p_transposed, n_d
      integer, allocatable :: from(:)

      if (n%n_row /= n%n_col .or. p%n_row /= n%n_row .or. d%n_row /= n%n_row) then
         call raise(error, err_internal, "triple_product_init: rows " // to_text(p%n_row) // ", " &
            // to_text(n%n_row) // ", " // to_text(d%n_row) // " do not match")
         return
      end if
      call csr_transpose(p, p_transposed, from)
      call product_pattern(n, d, n_d, error)
      if (allocated(error)) return
      call product_pattern(p_transposed, n_d, r, error)
      if (allocated(error)) return
      allocate(r%value(size(r%column)), source=0.0_dp)
      call size_plan(self, p, n, d, n_d, error)
      if (allocated(error)) return
      call plan_terms(self, p, n, d, n_d, r)
   end subroutine triple_product_init

   !> Pattern of A B; its values are not allocated.
   subroutine product_pattern(a, b, product, error)
      type(csr_t), intent(in) :: a, b
      type(csr_t), intent(out) :: product
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: seen(:)
      integer(int64) :: n_slot
      integer :: i, j, k, l, pass

      product%n_row = a%n_row
      product%n_col = b%n_col
      allocate(product%row_start(a%n_row + 1), source=0)
      allocate(seen(b%n_col))
      do pass = 1, 2                                    ! count, then fill
         seen = 0
         n_slot = 0
         do i = 1, a%n_row
            do k = a%row_start(i) + 1, a%row_start(i + 1)
               j = a%column(k) + 1
               do l = b%row_start(j) + 1, b%row_start(j + 1)
                  if (seen(b%column(l) + 1) == i) cycle
                  seen(b%column(l) + 1) = i
                  n_slot = n_slot + 1
                  if (pass == 2) product%column(n_slot) = b%column(l)
               end do
            end do
            if (n_slot > huge(1)) then
               call raise(error, err_analysis, "a product of matrices has over 2^31 - 1 entries")
               return
            end if
            product%row_start(i + 1) = int(n_slot)
         end do
         if (pass == 1) allocate(product%column(n_slot))
      end do
      call csr_sort_columns(product)
   end subroutine product_pattern

   !> Allocate the plan.
   subroutine size_plan(self, p, n, d, n_d, error)
      type(triple_product_t), intent(inout) :: self
      type(csr_t), intent(in) :: p, n, d, n_d
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: n_term, n_scatter
      integer :: i, k, n_p, n_most

      n_term = 0
      n_scatter = 0
      n_most = 0
      do i = 1, n%n_row
         n_p = p%row_start(i + 1) - p%row_start(i)
         if (n_p == 0) cycle
         do k = n%row_start(i) + 1, n%row_start(i + 1)
            n_term = n_term + row_length(d, n%column(k) + 1)
         end do
         if (n_p == 1) cycle
         n_scatter = n_scatter + int(n_p, int64)*row_length(n_d, i)
         n_most = max(n_most, row_length(n_d, i))
      end do
      if (max(n_term, n_scatter) > huge(1)) then
         call raise(error, err_analysis, "a product of matrices has over 2^31 - 1 terms")
         return
      end if
      allocate(self%target(n_term), self%scatter(n_scatter), self%n_collected(n%n_row))
      allocate(self%collected(n_most), source=0.0_dp)
   end subroutine size_plan

   pure integer function row_length(a, i)
      type(csr_t), intent(in) :: a
      integer, intent(in) :: i

      row_length = a%row_start(i + 1) - a%row_start(i)
   end function row_length

   !> Fill the plan, in the order in which `triple_product_update` walks.
   subroutine plan_terms(self, p, n, d, n_d, r)
      type(triple_product_t), intent(inout) :: self
      type(csr_t), intent(in) :: p, n, d, n_d, r
      integer, allocatable :: place(:)
      integer :: i, j, k, l, i_target, i_scatter

      allocate(place(d%n_col))
      i_target = 0
      i_scatter = 0
      do i = 1, n%n_row
         self%n_collected(i) = row_length(n_d, i)
         select case (row_length(p, i))
         case (0)
            cycle
         case (1)
            call mark(r, p%column(p%row_start(i + 1)) + 1, 0, place)
         case default
            call mark(n_d, i, n_d%row_start(i), place)
         end select
         do k = n%row_start(i) + 1, n%row_start(i + 1)
            j = n%column(k) + 1
            do l = d%row_start(j) + 1, d%row_start(j + 1)
               i_target = i_target + 1
               self%target(i_target) = place(d%column(l) + 1)
            end do
         end do
         if (row_length(p, i) == 1) cycle
         do k = p%row_start(i) + 1, p%row_start(i + 1)
            call mark(r, p%column(k) + 1, 0, place)
            do l = n_d%row_start(i) + 1, n_d%row_start(i + 1)
               i_scatter = i_scatter + 1
               self%scatter(i_scatter) = place(n_d%column(l) + 1)
            end do
         end do
      end do
   end subroutine plan_terms

   !> place(j) = slot of the entry (i, j) less `offset`, for all entries of row i.
   pure subroutine mark(a, i, offset, place)
      type(csr_t), intent(in) :: a
      integer, intent(in) :: i, offset
      integer, intent(inout), contiguous :: place(:)
      integer :: k

      do k = a%row_start(i) + 1, a%row_start(i + 1)
         place(a%column(k) + 1) = k - offset
      end do
   end subroutine mark

   !> R = P^T N D for new values in the patterns of `triple_product_init`. Allocates nothing.
   pure subroutine triple_product_update(self, p, n, d, r)
      type(triple_product_t), intent(inout) :: self
      type(csr_t), intent(in) :: p, n, d
      type(csr_t), intent(inout) :: r
      integer :: i, k, l, n_p, i_target, i_scatter

      r%value = 0.0_dp
      i_target = 0
      i_scatter = 0
      do i = 1, n%n_row
         n_p = row_length(p, i)
         if (n_p == 1) then
            call add_row(i, p%value(p%row_start(i + 1)), n, d, self%target, i_target, r%value)
         else if (n_p > 1) then
            self%collected(:self%n_collected(i)) = 0.0_dp
            call add_row(i, 1.0_dp, n, d, self%target, i_target, self%collected)
            do k = p%row_start(i) + 1, p%row_start(i + 1)
               do l = 1, self%n_collected(i)
                  i_scatter = i_scatter + 1
                  r%value(self%scatter(i_scatter)) = r%value(self%scatter(i_scatter)) &
                     + p%value(k)*self%collected(l)
               end do
            end do
         end if
      end do
   end subroutine triple_product_update

   !> Add `weight` times row i of N D to `total`, at the places that `target` names.
   pure subroutine add_row(i, weight, n, d, target, i_target, total)
      integer, intent(in) :: i
      real(dp), intent(in) :: weight
      type(csr_t), intent(in) :: n, d
      integer, intent(in), contiguous :: target(:)
      integer, intent(inout) :: i_target                !! terms done so far
      real(dp), intent(inout), contiguous :: total(:)
      real(dp) :: factor
      integer :: j, k, l

      do k = n%row_start(i) + 1, n%row_start(i + 1)
         factor = weight*n%value(k)
         j = n%column(k) + 1
         do l = d%row_start(j) + 1, d%row_start(j + 1)
            i_target = i_target + 1
            total(target(i_target)) = total(target(i_target)) + factor*d%value(l)
         end do
      end do
   end subroutine add_row

end module emcon_triple_product
