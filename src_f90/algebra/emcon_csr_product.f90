!> The product of two sparse matrices.
module emcon_csr_product
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   implicit none
   private
   public :: csr_product

contains

   !> C = A B. Entries stand where terms meet, also where these cancel; columns ascend.
   pure subroutine csr_product(a, b, c)
      type(csr_t), intent(in) :: a                   !! (n x m)
      type(csr_t), intent(in) :: b                   !! (m x l)
      type(csr_t), intent(out) :: c                  !! (n x l)
      real(dp), allocatable :: total(:)
      integer, allocatable :: seen(:)
      integer :: i, k, l, n, pass

      allocate(total(b%n_col), source=0.0_dp)
      allocate(seen(b%n_col), c%row_start(a%n_row + 1), source=0)
      c%n_row = a%n_row
      c%n_col = b%n_col
      do pass = 1, 2                                 ! count, then list
         seen = 0
         n = 0
         do i = 1, a%n_row
            do k = a%row_start(i) + 1, a%row_start(i + 1)
               associate (row => a%column(k) + 1)
                  do l = b%row_start(row) + 1, b%row_start(row + 1)
                     associate (column => b%column(l) + 1)
                        total(column) = total(column) + a%value(k)*b%value(l)
                        if (seen(column) == i) cycle
                        seen(column) = i
                        n = n + 1
                        if (pass == 2) c%column(n) = column - 1
                     end associate
                  end do
               end associate
            end do
            if (pass == 2) call sort(c%column(c%row_start(i) + 1:n))
            do k = c%row_start(i) + 1, n
               if (pass == 2) c%value(k) = total(c%column(k) + 1)
            end do
            if (pass == 2) total(c%column(c%row_start(i) + 1:n) + 1) = 0.0_dp
            c%row_start(i + 1) = n
         end do
         if (pass == 1) allocate(c%column(n), c%value(n))
         total = 0.0_dp
      end do
   end subroutine csr_product

   !> Sort a short list by insertion.
   pure subroutine sort(list)
      integer, intent(inout) :: list(:)
      integer :: i, j, held

      do i = 2, size(list)
         held = list(i)
         do j = i - 1, 1, -1
            if (list(j) <= held) exit
            list(j + 1) = list(j)
         end do
         list(j + 1) = held
      end do
   end subroutine sort

end module emcon_csr_product
