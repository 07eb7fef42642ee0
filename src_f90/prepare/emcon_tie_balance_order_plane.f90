!> The order in which the unknowns and conditions of a balanced tie make a narrow band.
module emcon_tie_balance_order_plane
   use emcon_tie_balance_data_plane, only : tie_balance_t
   implicit none
   private
   public :: balance_order

contains

   !> Number all unknowns and conditions along the chain, a closed one from both sides at once.
   pure subroutine balance_order(tie, n_unknown, rank)
      type(tie_balance_t), intent(in) :: tie
      integer, intent(in) :: n_unknown           !! z, dX, dL
      integer, intent(out) :: rank(:)            !! (n_unknown + n_condition) place in the order
      integer :: position(tie%n_row), first(tie%n_other), last(tie%n_other), i, j, k, n, n_z, p
      integer :: key(size(rank)), start(0:tie%n_row)

      n = tie%n_row
      n_z = size(tie%column)
      call number_rows(tie%neighbour, position)
      first = n
      last = 1
      do k = 1, n
         do i = tie%start(k) + 1, tie%start(k + 1)
            key(i) = position(k)
            first(tie%column(i)) = min(first(tie%column(i)), position(k))
            last(tie%column(i)) = max(last(tie%column(i)), position(k))
         end do
      end do
      do i = 0, 8
         key(n_z + i*n + 1:n_z + (i + 1)*n) = position
      end do
      do i = 0, 1
         j = n_unknown + 5*n + i*tie%n_other
         key(j + 1:j + tie%n_other) = (first + last)/2
      end do
      start = 0
      do i = 1, size(key)
         start(key(i)) = start(key(i)) + 1
      end do
      do p = 1, n
         start(p) = start(p) + start(p - 1)
      end do
      do i = 1, size(key)
         start(key(i) - 1) = start(key(i) - 1) + 1
         rank(i) = start(key(i) - 1)
      end do
   end subroutine balance_order

   !> Breadth first from an end, or from the first row of a closed chain.
   pure subroutine number_rows(neighbour, position)
      integer, intent(in) :: neighbour(:, :)     !! (2, n_row)
      integer, intent(out) :: position(:)        !! (n_row)
      integer :: queue(size(position)), pass, k, i, side, n_found, n_done

      position = 0
      n_found = 0
      n_done = 0
      do pass = 1, 2
         do k = 1, size(position)
            if (position(k) > 0) cycle
            if (pass == 1 .and. all(neighbour(:, k) > 0)) cycle
            n_found = n_found + 1
            position(k) = n_found
            queue(n_found) = k
            do while (n_done < n_found)
               n_done = n_done + 1
               do side = 1, 2
                  i = neighbour(side, queue(n_done))
                  if (i == 0) cycle
                  if (position(i) > 0) cycle
                  n_found = n_found + 1
                  position(i) = n_found
                  queue(n_found) = i
               end do
            end do
         end do
      end do
   end subroutine number_rows

end module emcon_tie_balance_order_plane
