!> A small stiffness of nodes that nothing holds, in the matrix alone: it changes no solution.
!>
!> Newton's method then moves no body farther than the residual calls for.
!> Source: docs/theory.md, section 6.2.
module emcon_stiffening
   use emcon_csr, only : csr_find, csr_t
   use emcon_kinds, only : dp, wp
   use emcon_numbering, only : numbering_t
   implicit none
   private
   public :: stiffening_t, stiffening_set, stiffening_add, least_stiffness

   !> Per stiffness of what stands on a node: far below what bends a body, far above the round-off
   !> of its rigid motions.
   real(wp), parameter :: least_stiffness = sqrt(epsilon(1.0_wp))

   type :: stiffening_t
      private
      integer, allocatable :: slot(:)            !! where it enters the matrix
      real(dp), allocatable :: value(:)          !! and what [M/T^2]
   end type stiffening_t

contains

   !> Stiffen the nodes by a part of `stiffness`; nowhere above 0: nothing.
   pure subroutine stiffening_set(self, stiffness, numbering, matrix)
      type(stiffening_t), intent(out) :: self
      real(wp), intent(in) :: stiffness(:)       !! (n_node) >= 0 [M/T^2]
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(in) :: matrix          !! its pattern
      integer :: d, s, t, n, n_dim, pass

      n_dim = size(numbering%unknown, 1)
      do pass = 1, 2                             ! count, then list
         n = 0
         do d = 1, size(numbering%unknown)
            associate (part => least_stiffness*stiffness((d - 1)/n_dim + 1))
               if (.not. part > 0.0_wp) cycle
               do t = numbering%start(d) + 1, numbering%start(d + 1)
                  do s = numbering%start(d) + 1, numbering%start(d + 1)
                     if (numbering%column(t) == 0 .or. numbering%column(s) == 0) cycle
                     n = n + 1
                     if (pass == 1) cycle
                     self%slot(n) = csr_find(matrix, numbering%column(s), numbering%column(t))
                     self%value(n) = real(numbering%weight(s)*numbering%weight(t)*part, dp)
                  end do
               end do
            end associate
         end do
         if (pass == 1) allocate(self%slot(n), self%value(n))
      end do
   end subroutine stiffening_set

   !> Add it to the matrix.
   pure subroutine stiffening_add(self, matrix)
      type(stiffening_t), intent(in) :: self
      type(csr_t), intent(inout) :: matrix
      integer :: k

      if (.not. allocated(self%slot)) return
      do k = 1, size(self%slot)
         associate (slot => self%slot(k))
            if (slot > 0) matrix%value(slot) = matrix%value(slot) + self%value(k)
         end associate
      end do
   end subroutine stiffening_add

end module emcon_stiffening
