!> Orders in which symmetric patterns fill little when they are factorised: approximate minimum
!> degree, and nested dissection where that leaves much to do, as for bodies in space.
!>
!> Unknowns with the same neighbours, as those of a node, are ordered together. Both libraries may
!> be passed on with any program: AMD is under the BSD-3-Clause, METIS under the Apache-2.0 licence.
!> Sources: P. R. Amestoy, T. A. Davis, I. S. Duff, SIAM J. Matrix Anal. Appl. 17 (1996) 886-905;
!> G. Karypis, V. Kumar, SIAM J. Sci. Comput. 20 (1998) 359-392.
module emcon_ordering
   use, intrinsic :: iso_c_binding, only : c_int, c_null_ptr, c_ptr
   use emcon_csr, only : csr_t
   use emcon_elimination_tree, only : elimination_tree_t, tree_build
   use emcon_kinds, only : dp
   implicit none
   private
   public :: ordering_find

   !> Operations for each entry of the factor from which on nested dissection is tried: those of
   !> bodies in space, where it spares a fifth to two thirds of them.
   real(dp), parameter :: least_work = 250.0_dp

   interface
      integer(c_int) function amd_order(n, ap, ai, p, control, info) bind(c)
         import :: c_int, c_ptr
         integer(c_int), value :: n
         integer(c_int), intent(in) :: ap(*), ai(*)
         integer(c_int), intent(inout) :: p(*)
         type(c_ptr), value :: control, info
      end function amd_order

      integer(c_int) function metis_nodend(n, xadj, adjncy, vwgt, options, perm, iperm) &
         bind(c, name="METIS_NodeND")
         import :: c_int, c_ptr
         integer(c_int), intent(in) :: n, xadj(*), adjncy(*), vwgt(*)
         type(c_ptr), value :: options
         integer(c_int), intent(inout) :: perm(*), iperm(*)
      end function metis_nodend
   end interface

   integer(c_int), parameter :: amd_out_of_memory = -1, metis_ok = 1

   !> Unknowns taken together, and which of these groups meet.
   type :: quotient_t
      integer, allocatable :: first(:)           !! (n_group + 1) unknowns before each group
      integer(c_int), allocatable :: start(:)    !! (n_group + 1) neighbours before those of each
      integer(c_int), allocatable :: neighbour(:)      !! from 0, without the group itself
   end type quotient_t

contains

   !> The order, by the elimination tree that it gives.
   subroutine ordering_find(pattern, seeks_less_fill, tree, is_found)
      type(csr_t), intent(in) :: pattern         !! symmetric, with all of the diagonal
      logical, intent(in) :: seeks_less_fill     !! try both, whatever the first one leaves to do
      type(elimination_tree_t), intent(out) :: tree
      logical, intent(out) :: is_found           !! else there is not enough memory
      type(quotient_t) :: groups
      type(elimination_tree_t) :: other
      integer(c_int), allocatable :: p(:), inverse(:)
      integer(c_int) :: status

      call find_groups(groups, pattern)
      associate (n => size(groups%first) - 1)
         allocate(p(n), inverse(n), source=0_c_int)
         status = amd_order(n, groups%start, groups%neighbour, p, c_null_ptr, c_null_ptr)
         is_found = status /= amd_out_of_memory
         if (.not. is_found) return
         call tree_build(tree, pattern, unknowns_of(groups, p))
         if (size(groups%neighbour) == 0) return
         if (.not. (seeks_less_fill .or. tree%n_operation >= least_work*tree%n_entry)) return
         ! METIS draws from the generator of the process, which it starts anew each time.
         !$omp critical (emcon_ordering)
         status = metis_nodend(n, groups%start, groups%neighbour, extents(groups), c_null_ptr, p, &
            inverse)
         !$omp end critical (emcon_ordering)
         if (status /= metis_ok) return
         call tree_build(other, pattern, unknowns_of(groups, p))
         if (other%n_operation < tree%n_operation) tree = other
      end associate
   end subroutine ordering_find

   !> Unknowns that follow each other and have the same rows.
   pure subroutine find_groups(self, pattern)
      type(quotient_t), intent(out) :: self
      type(csr_t), intent(in) :: pattern
      integer :: of(pattern%n_row), first(pattern%n_row + 1), i, n

      n = 1
      first(1) = 0
      of(1) = 1
      do i = 2, pattern%n_row
         if (.not. has_same_row(pattern, i)) then
            n = n + 1
            first(n) = i - 1
         end if
         of(i) = n
      end do
      self%first = [first(:n), pattern%n_row]
      call find_neighbours(self, pattern, of)
   end subroutine find_groups

   !> The groups that each one meets: those of the row of its first unknown, which has all unknowns
   !> of a group or none, one after the other.
   pure subroutine find_neighbours(self, pattern, of)
      type(quotient_t), intent(inout) :: self    !! `first` is set
      type(csr_t), intent(in) :: pattern
      integer, intent(in) :: of(:)               !! (n) group of each unknown
      integer, allocatable :: neighbour(:)
      integer :: g, i, k, last, m

      allocate(self%start(size(self%first)), source=0_c_int)
      allocate(neighbour(size(pattern%column)))
      m = 0
      do g = 1, size(self%first) - 1
         i = self%first(g) + 1
         last = g
         do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
            associate (other => of(pattern%column(k) + 1))
               if (other == last .or. other == g) cycle
               last = other
               m = m + 1
               neighbour(m) = other - 1
            end associate
         end do
         self%start(g + 1) = m
      end do
      self%neighbour = neighbour(:m)
   end subroutine find_neighbours

   !> Has unknown `i` the neighbours of the one before it?
   pure logical function has_same_row(pattern, i)
      type(csr_t), intent(in) :: pattern
      integer, intent(in) :: i                   !! > 1

      associate (from => pattern%row_start(i - 1), at => pattern%row_start(i), &
         to => pattern%row_start(i + 1))
         has_same_row = to - at == at - from
         if (has_same_row) has_same_row = all(pattern%column(from + 1:at) &
            == pattern%column(at + 1:to))
      end associate
   end function has_same_row

   !> Unknowns of each group.
   pure function extents(self) result(n)
      type(quotient_t), intent(in) :: self
      integer(c_int) :: n(size(self%first) - 1)

      n = self%first(2:) - self%first(:size(n))
   end function extents

   !> The unknowns, from 1, of groups in an order.
   pure function unknowns_of(self, p) result(order)
      type(quotient_t), intent(in) :: self
      integer(c_int), intent(in) :: p(:)         !! (n_group) from 0
      integer :: order(self%first(size(self%first)))
      integer :: i, k, n

      n = 0
      do k = 1, size(p)
         do i = self%first(p(k) + 1) + 1, self%first(p(k) + 2)
            n = n + 1
            order(n) = i
         end do
      end do
   end function unknowns_of

end module emcon_ordering
