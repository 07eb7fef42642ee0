!> Sparse matrices for the tests of `algebra`.
module sparse_samples
   use emcon_csr, only : csr_from_elements, csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp
   implicit none
   private
   public :: dense_of, random_sparse, quad_mesh_matrix

contains

   !> The full matrix.
   pure function dense_of(a) result(dense)
      type(csr_t), intent(in) :: a
      real(dp) :: dense(a%n_row, a%n_col)
      integer :: i, k

      dense = 0.0_dp
      do i = 1, a%n_row
         do k = a%row_start(i) + 1, a%row_start(i + 1)
            dense(i, a%column(k) + 1) = a%value(k)
         end do
      end do
   end function dense_of

   !> About `n_each` random entries in (-1, 1) per row, at random places.
   subroutine random_sparse(n_row, n_col, n_each, a)
      integer, intent(in) :: n_row, n_col, n_each
      type(csr_t), intent(out) :: a
      real(dp) :: u(2, n_row*n_each)
      integer, allocatable :: slot(:)

      call random_number(u)
      call csr_from_entries(a, n_row, n_col, int(u(1, :)*n_row) + 1, int(u(2, :)*n_col) + 1, slot)
      call random_number(a%value)
      a%value = 2.0_dp*a%value - 1.0_dp
   end subroutine random_sparse

   !> Matrix of a mesh of n_x by n_y quadrilaterals, two unknowns a node, from element matrices
   !> B^T B + `skew` C with random B, C: the symmetric part is positive definite.
   subroutine quad_mesh_matrix(n_x, n_y, skew, a, error)
      integer, intent(in) :: n_x, n_y
      real(dp), intent(in) :: skew
      type(csr_t), intent(out) :: a
      type(error_t), allocatable, intent(out) :: error
      integer :: dof(8, n_x*n_y), corner(4), e, i, j, k, i_corner
      integer, allocatable :: slot(:)
      real(dp) :: b(8, 8), c(8, 8)

      e = 0
      do j = 1, n_y
         do i = 1, n_x
            e = e + 1
            k = (j - 1)*(n_x + 1) + i
            corner = [k, k + 1, k + n_x + 2, k + n_x + 1]
            do i_corner = 1, 4
               dof(2*i_corner - 1, e) = 2*corner(i_corner) - 1
               dof(2*i_corner, e) = 2*corner(i_corner)
            end do
         end do
      end do
      call csr_from_elements(a, 2*(n_x + 1)*(n_y + 1), [(8*e + 1, e = 0, n_x*n_y)], &
         reshape(dof, [size(dof)]), slot, error)
      if (allocated(error)) return
      do e = 1, n_x*n_y
         call random_number(b)
         call random_number(c)
         b = matmul(transpose(b), b) + skew*(c - transpose(c))
         do j = 1, 8
            do i = 1, 8
               k = slot(64*(e - 1) + 8*(j - 1) + i)
               a%value(k) = a%value(k) + b(i, j)
            end do
         end do
      end do
   end subroutine quad_mesh_matrix

end module sparse_samples
