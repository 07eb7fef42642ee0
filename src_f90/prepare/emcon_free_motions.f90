!> What rows leave of the motions of rigid bodies: the null space of all rows over the motions of
!> the bodies that they join.
!>
!> The null space z shrinks row by row: a reflection of its columns leaves one column that the row
!> prevents, which is dropped. The columns stay orthonormal, nothing is squared, and only bodies
!> that the row joins take part. Rows between the same bodies come together, the one that prevents
!> most first. What is left of such a row is compared with round-off: that of weights and
!> coordinates, and that of z, which is the round-off of earlier rows over what they prevented.
module emcon_free_motions
   use emcon_bodies, only : bodies_find
   use emcon_kinds, only : dp, wp
   use emcon_mechanisms, only : mechanisms_t, mechanism_free, mechanism_places, &
      rigid_motions_at
   use emcon_mechanism_rows, only : mechanism_rows_t
   use emcon_sort, only : find_sorted, sort_order, unique_sorted
   implicit none
   private
   public :: find_assemblies, find_free_motions

   !> Round-off of an entry of a row of weights with sum 1 over coordinates of size 1: weights of
   !> ties are sums of some ten products, coordinates of slave nodes likewise.
   real(dp), parameter :: rounding = 32.0_dp*max(real(epsilon(1.0_wp), dp), epsilon(1.0_dp))

contains

   !> Bodies that rows join, and the rows in the order of assemblies, then of the bodies that they
   !> join. Held bodies join nothing.
   subroutine find_assemblies(bodies, rows, assembly, n_assembly, order)
      type(mechanisms_t), intent(in) :: bodies
      type(mechanism_rows_t), intent(inout) :: rows
      integer, allocatable, intent(out) :: assembly(:)   !! (bodies) 0: held
      integer, intent(out) :: n_assembly                 !! in the order of their first bodies
      integer, allocatable, intent(out) :: order(:)      !! (rows that join or hold something)
      integer, allocatable :: link(:, :)
      integer :: n, k, s, b

      allocate(link(2, bodies%n + size(rows%dof)))
      n = 0
      do b = 1, bodies%n
         if (any(bodies%is_free(:, b))) call add_link(b, b)
      end do
      allocate(rows%low(rows%n), rows%high(rows%n), source=0)
      do k = 1, rows%n
         do s = rows%start(k) + 1, rows%start(k + 1)
            b = mechanism_free(bodies, rows%dof(s))
            if (b == 0) cycle
            if (rows%low(k) == 0) rows%low(k) = b
            call add_link(rows%low(k), b)
            rows%low(k) = min(rows%low(k), b)
            rows%high(k) = max(rows%high(k), b)
         end do
      end do
      call bodies_find(link(:, :n), bodies%n, assembly, n_assembly)
      order = pack([(k, k = 1, rows%n)], rows%low > 0)
      order = order(sort_order(rows%high(order)))
      order = order(sort_order(rows%low(order)))
      order = order(sort_order(assembly(rows%low(order))))

   contains

      subroutine add_link(first, second)
         integer, intent(in) :: first, second

         n = n + 1
         link(:, n) = [first, second]
      end subroutine add_link

   end subroutine find_assemblies

   !> What the rows `list` leave of the motions of an assembly.
   subroutine find_free_motions(bodies, rows, list, member, z, noise)
      type(mechanisms_t), intent(in) :: bodies
      type(mechanism_rows_t), intent(in) :: rows
      integer, intent(in) :: list(:)                     !! rows between the same bodies in a row
      integer, intent(in) :: member(:)                   !! bodies of the assembly, ascending
      real(dp), allocatable, intent(out) :: z(:, :)      !! (n_motion*members, n) orthonormal
      real(dp), intent(out) :: noise                     !! size of the round-off in `z`
      real(dp), allocatable :: a(:, :), basis(:, :)
      real(dp) :: own_noise, smallest
      integer, allocatable :: motion(:)
      integer :: i, j, n, first, last

      n = bodies%n_motion*size(member)
      allocate(basis(n, n), source=0.0_dp)
      n = 0
      do i = 1, size(member)
         do j = 1, bodies%n_motion
            if (.not. bodies%is_free(j, member(i))) cycle
            n = n + 1
            basis(bodies%n_motion*(i - 1) + j, n) = 1.0_dp
         end do
      end do
      noise = max(rounding, rows%noise)
      last = 0
      do while (last < size(list) .and. n > 0)
         first = last + 1
         last = first
         do while (last < size(list))
            if (rows%low(list(last + 1)) /= rows%low(list(first))) exit
            if (rows%high(list(last + 1)) /= rows%high(list(first))) exit
            last = last + 1
         end do
         call find_entries(bodies, rows, list(first:last), member, a, motion, own_noise)
         call prevent(a, motion, max(own_noise, noise), basis, n, smallest)
         if (smallest > 0.0_dp) noise = max(noise, own_noise/smallest)
      end do
      allocate(z, source=basis(:, :n))
   end subroutine find_free_motions

   !> Rows over the motions of the bodies that they join.
   subroutine find_entries(bodies, rows, list, member, a, motion, noise)
      type(mechanisms_t), intent(in) :: bodies
      type(mechanism_rows_t), intent(in) :: rows
      integer, intent(in) :: list(:)
      integer, intent(in) :: member(:)
      real(dp), allocatable, intent(out) :: a(:, :)      !! (rows, motions)
      integer, allocatable, intent(out) :: motion(:)     !! (motions) places in those of all members
      real(dp), intent(out) :: noise                     !! bound of what round-off makes of `a`
      integer, allocatable :: joined_body(:)
      integer :: place(bodies%n_motion), i, s, b, n

      n = 0
      allocate(joined_body(sum(rows%start(list + 1) - rows%start(list))))
      do i = 1, size(list)
         do s = rows%start(list(i)) + 1, rows%start(list(i) + 1)
            b = mechanism_free(bodies, rows%dof(s))
            if (b == 0) cycle
            n = n + 1
            joined_body(n) = b
         end do
      end do
      joined_body = unique_sorted(joined_body(:n))
      allocate(motion(bodies%n_motion*size(joined_body)))
      do i = 1, size(joined_body)
         motion(mechanism_places(bodies, i)) &
            = mechanism_places(bodies, find_sorted(member, joined_body(i)))
      end do
      allocate(a(size(list), size(motion)), source=0.0_dp)
      do i = 1, size(list)
         do s = rows%start(list(i)) + 1, rows%start(list(i) + 1)
            b = mechanism_free(bodies, rows%dof(s))
            if (b == 0) cycle
            place = mechanism_places(bodies, find_sorted(joined_body, b))
            a(i, place) = a(i, place) &
               + real(rows%weight(s)*rigid_motions_at(bodies, b, rows%dof(s)), dp)
         end do
      end do
      ! The Frobenius norm of the errors of all entries.
      noise = rounding*(1.0_dp + real(maxval(bodies%reach(joined_body)), dp)) &
         *sqrt(real(size(a), dp))
   end subroutine find_entries

   !> Shrink the first `n` columns of `z` to those combinations with a z = 0 up to `noise`.
   pure subroutine prevent(a, motion, noise, z, n, smallest)
      real(dp), intent(in) :: a(:, :)                    !! (rows, motions)
      integer, intent(in) :: motion(:)                   !! (motions) rows of `z`
      real(dp), intent(in) :: noise
      real(dp), intent(inout), contiguous :: z(:, :)     !! orthonormal columns
      integer, intent(inout) :: n
      real(dp), intent(out) :: smallest                  !! that was prevented; 0: nothing was
      real(dp) :: left(size(a, 1), n), v(n)
      integer :: column(n), j, k, m

      m = 0
      do j = 1, n
         if (all(z(motion, j) == 0.0_dp)) cycle
         m = m + 1
         column(m) = j
         left(:, m) = matmul(a, z(motion, j))
      end do
      smallest = 0.0_dp
      do while (m > 0)
         k = maxloc(sum(left(:, :m)**2, dim=2), dim=1)
         v(:m) = left(k, :m)
         if (norm2(v(:m)) <= noise) exit
         smallest = norm2(v(:m))
         ! The reflection that leaves of the row its last entry alone.
         v(m) = v(m) + sign(norm2(v(:m)), v(m))
         v(:m) = v(:m)/norm2(v(:m))
         call reflect(left, [(j, j = 1, m)], v(:m))
         call reflect(z, column(:m), v(:m))
         z(:, column(m)) = z(:, n)
         n = n - 1
         m = m - 1
      end do
   end subroutine prevent

   !> x (1 - 2 v v^T) over some columns of x.
   pure subroutine reflect(x, column, v)
      real(dp), intent(inout), contiguous :: x(:, :)
      integer, intent(in) :: column(:)
      real(dp), intent(in) :: v(:)                       !! (columns) of length 1
      real(dp) :: product(size(x, 1))
      integer :: j

      product = 0.0_dp
      do j = 1, size(column)
         product = product + x(:, column(j))*v(j)
      end do
      do j = 1, size(column)
         x(:, column(j)) = x(:, column(j)) - product*(2.0_dp*v(j))
      end do
   end subroutine reflect

end module emcon_free_motions
