!> Linear complementarity problems w = q + M z, w >= 0, z >= 0, w.z = 0 by Lemke's method.
!>
!> The ray starts along ones; ties of the ratio test are broken lexicographically, so that no basis
!> comes twice. Where M is copositive, and z.q >= 0 for all z >= 0 with M z >= 0 and z.M z = 0, the
!> method ends in a solution (Cottle, Pang and Stone, The linear complementarity problem, 4.4).
module emcon_lemke
   use emcon_kinds, only : wp
   implicit none
   private
   public :: lemke_solve

   !> An entry is no pivot below this part of the largest of its column.
   real(wp), parameter :: least_pivot = 1.0e3_wp*epsilon(1.0_wp)
   !> Pivots per unknown at most.
   integer, parameter :: most_pivots = 50

contains

   !> Solve for `z`. Not solved: it ended in a ray, or in round-off.
   pure subroutine lemke_solve(m, q, z, is_solved, n_pivot)
      real(wp), intent(in) :: m(:, :)                !! (n, n)
      real(wp), intent(in) :: q(:)                   !! (n)
      real(wp), intent(out) :: z(:)                  !! (n) >= 0
      logical, intent(out) :: is_solved
      integer, intent(out) :: n_pivot
      real(wp) :: table(size(q), 2*size(q) + 2)      ! of w, z, the ray; right sides
      integer :: basis(size(q)), n, i, enters, leaves

      n = size(q)
      z = 0.0_wp
      n_pivot = 0
      is_solved = all(q >= 0.0_wp)
      if (is_solved) return
      table = 0.0_wp
      do i = 1, n
         table(i, i) = 1.0_wp
         basis(i) = i
      end do
      table(:, n + 1:2*n) = -m
      table(:, 2*n + 1) = -1.0_wp
      table(:, 2*n + 2) = q
      ! The ray enters where it is needed most; ties by the first place: the last of them.
      leaves = minloc(q, 1, back=.true.)
      enters = 2*n + 1
      do
         call exchange(table, basis, leaves, enters)
         n_pivot = n_pivot + 1
         if (enters == 2*n + 1) exit
         ! Round-off of a tie may leave the ray in the basis, at nothing.
         associate (right => table(:, 2*n + 2))
            if (right(findloc(basis, 2*n + 1, 1)) <= least_pivot*maxval(abs(right))) exit
         end associate
         if (n_pivot > most_pivots*n) return
         call choose(table, basis, enters, leaves)
         if (leaves == 0) return
      end do
      do i = 1, n
         if (basis(i) > n .and. basis(i) <= 2*n) z(basis(i) - n) = max(0.0_wp, table(i, 2*n + 2))
      end do
      is_solved = .true.
   end subroutine lemke_solve

   !> Let variable `enters` take the place of that of row `leaves`; next the complement of what has
   !> left is to enter, or the ray has left.
   pure subroutine exchange(table, basis, leaves, enters)
      real(wp), intent(inout) :: table(:, :)
      integer, intent(inout) :: basis(:)
      integer, intent(in) :: leaves
      integer, intent(inout) :: enters
      integer :: i, left, n

      n = size(basis)
      table(leaves, :) = table(leaves, :)/table(leaves, enters)
      do i = 1, n
         if (i == leaves) cycle
         table(i, :) = table(i, :) - table(i, enters)*table(leaves, :)
         table(i, enters) = 0.0_wp
      end do
      left = basis(leaves)
      basis(leaves) = enters
      enters = left
      if (left <= n) then
         enters = left + n
      else if (left <= 2*n) then
         enters = left - n
      end if
   end subroutine exchange

   !> The row whose variable reaches 0 first as `enters` grows, 0: none does. The ray goes before
   !> others; else ties are decided by what perturbations of q in the first, second, ... place tell.
   pure subroutine choose(table, basis, enters, leaves)
      real(wp), intent(in) :: table(:, :)
      integer, intent(in) :: basis(:)
      integer, intent(in) :: enters
      integer, intent(out) :: leaves
      real(wp) :: least
      integer :: i, n

      n = size(basis)
      least = least_pivot*maxval(abs(table(:, enters)))
      leaves = 0
      do i = 1, n
         if (.not. table(i, enters) > least) cycle
         if (leaves == 0) then
            leaves = i
         else if (is_before(i, leaves)) then
            leaves = i
         end if
      end do

   contains

      !> Does row `i` come to 0 before row `k`?
      pure logical function is_before(i, k)
         integer, intent(in) :: i, k
         real(wp) :: a, b
         integer :: j

         a = max(0.0_wp, table(i, 2*n + 2))/table(i, enters)
         b = max(0.0_wp, table(k, 2*n + 2))/table(k, enters)
         is_before = a < b
         if (abs(a - b) > least_pivot*(a + b)) return
         is_before = basis(i) == 2*n + 1
         if (is_before .or. basis(k) == 2*n + 1) return
         do j = 1, n
            a = table(i, j)/table(i, enters)
            b = table(k, j)/table(k, enters)
            is_before = a < b
            if (abs(a - b) > least_pivot*(abs(a) + abs(b))) return
         end do
         is_before = .false.
      end function is_before

   end subroutine choose

end module emcon_lemke
