!> The multipliers of a tie on one slave facet: which node each belongs to, and what they are made
!> of.
!>
!> The dual multipliers of a facet are biorthogonal to its shape functions over what is covered.
!> Those of corners of facets with nodes between them integrate to 0 or less: there they are
!> biorthogonal to a basis in which each corner takes a share of what is between it and the next
!> ones. Nodes without a multiplier hand theirs to the others of the facet. Source:
!> docs/theory.md, eqs. (56) and (57).
module emcon_tie_multipliers_space
   use emcon_kinds, only : wp
   use emcon_tie_shapes_space, only : most_nodes
   implicit none
   private
   public :: tie_multipliers_t, tie_multipliers_find

   type :: tie_multipliers_t
      integer :: n = 0                           !! multipliers
      integer :: node(most_nodes) = 0            !! (n) of the facet that each belongs to; 0: none
      !> (n, node of the facet) psi_k, a sum over shape functions
      real(wp) :: psi(most_nodes, most_nodes) = 0.0_wp
      real(wp) :: d(most_nodes, most_nodes) = 0.0_wp         !! (n, node of it) int psi_k N_j [L^2]
      real(wp) :: size(most_nodes) = 0.0_wp      !! (n) int psi_k [L^2]
   end type tie_multipliers_t

   !> A corner takes this share of each node beside it: with half of the two beside it the integrals
   !> at all nodes of a triangle are equal, and those of a quadrilateral differ by a factor of two.
   real(wp), parameter :: taken = 0.25_wp

contains

   !> Set up for a facet with the integrals `mass`. If none of its nodes keeps a multiplier, there
   !> is one of 1 for another node.
   pure subroutine tie_multipliers_find(self, mass, is_kept, is_dual)
      type(tie_multipliers_t), intent(out) :: self
      real(wp), intent(in) :: mass(:, :)         !! (node, node) int N_i N_j, definite [L^2]
      logical, intent(in) :: is_kept(:)          !! (node) does it keep its multiplier?
      logical, intent(in) :: is_dual
      real(wp), dimension(size(is_kept), size(is_kept)) :: basis, back, own, d, a
      real(wp), allocatable :: sums(:, :)
      integer :: n, m

      n = size(is_kept)
      call basis_of(n, basis, back)
      own = matmul(basis, matmul(mass, transpose(basis)))
      a = 0.0_wp
      if (is_dual) then
         call solve_definite(own, basis, a)
         d = 0.0_wp
         do m = 1, n
            a(m, :) = sum(own(m, :))*a(m, :)
            d(m, :) = sum(own(m, :))*back(:, m)
         end do
      else
         a = basis
         d = matmul(basis, mass)
      end if
      sums = sums_of_kept(is_kept)
      self%n = size(sums, 1)
      self%node(:self%n) = pack([(m, m = 1, n)], is_kept, [(0, m = 1, self%n)])
      self%psi(:self%n, :n) = matmul(sums, a)
      self%d(:self%n, :n) = matmul(sums, d)
      self%size(:self%n) = matmul(sums, sum(own, 2))
   end subroutine tie_multipliers_find

   !> The basis that multipliers are dual to, as sums of shape functions, and how its unknowns come
   !> from nodes: x~_m = sum_i back(i, m) x_i.
   pure subroutine basis_of(n, basis, back)
      integer, intent(in) :: n                   !! nodes of the facet
      real(wp), intent(out) :: basis(n, n), back(n, n)
      integer :: m

      basis = 0.0_wp
      do m = 1, n
         basis(m, m) = 1.0_wp
      end do
      back = basis
      if (n <= 4) return
      do m = 2, n, 2                             ! between corners m - 1 and m + 1
         basis([m - 1, 1 + mod(m, n)], m) = taken
         basis(m, m) = 1.0_wp - 2.0_wp*taken
         back(m, m) = 1.0_wp/basis(m, m)
         back([m - 1, 1 + mod(m, n)], m) = -taken/basis(m, m)
      end do
   end subroutine basis_of

   !> Which sums of multipliers are kept: those that are handed on go to all others alike.
   pure function sums_of_kept(is_kept) result(sums)
      logical, intent(in) :: is_kept(:)
      real(wp), allocatable :: sums(:, :)        !! (kept, node)
      integer :: k, m

      allocate(sums(max(1, count(is_kept)), size(is_kept)), source=0.0_wp)
      k = 0
      do m = 1, size(is_kept)
         if (is_kept(m)) then
            k = k + 1
            sums(k, m) = 1.0_wp
         else
            sums(:, m) = 1.0_wp/size(sums, 1)
         end if
      end do
   end function sums_of_kept

   !> x = A^-1 B for a definite A, by Cholesky's factors.
   pure subroutine solve_definite(a, b, x)
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (n, n)
      real(wp), intent(out) :: x(:, :)           !! (n, n)
      real(wp) :: l(size(a, 1), size(a, 1))
      integer :: i, j, n

      n = size(a, 1)
      l = 0.0_wp
      do j = 1, n
         l(j, j) = sqrt(a(j, j) - sum(l(j, :j - 1)**2))
         do i = j + 1, n
            l(i, j) = (a(i, j) - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
      end do
      do i = 1, n
         x(i, :) = (b(i, :) - matmul(l(i, :i - 1), x(:i - 1, :)))/l(i, i)
      end do
      do i = n, 1, -1
         x(i, :) = (x(i, :) - matmul(l(i + 1:, i), x(i + 1:, :)))/l(i, i)
      end do
   end subroutine solve_definite

end module emcon_tie_multipliers_space
