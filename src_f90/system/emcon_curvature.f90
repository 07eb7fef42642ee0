!> Second derivatives of the selected conditions, summed with factors: what the tangent of a step
!> gets less of, over all degrees of freedom.
module emcon_curvature
   use emcon_constraint_rows, only : constraint_dof
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_from_values, csr_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: curvature_matrix, curvature_add_times

contains

   !> Sum of `factor` times the derivative of the discrete gradient by the end of the step.
   subroutine curvature_matrix(self, factor, n_dof, matrix)
      type(constraint_set_t), intent(in) :: self     !! evaluated
      real(wp), intent(in) :: factor(:)              !! (n) multipliers [M L/T^2]
      integer, intent(in) :: n_dof                   !! n_dim times n_node
      type(csr_t), intent(out) :: matrix             !! (n_dof x n_dof) [M/T^2]
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:)
      integer :: k, i, j, n

      n = 0
      do k = 1, self%n
         n = n + (size(self%item(k)%g, 1)*self%item(k)%n_node)**2
      end do
      allocate(row(n), column(n), value(n))
      n = 0
      do k = 1, self%n
         associate (item => self%item(k))
            do j = 1, size(item%g, 1)*item%n_node
               do i = 1, size(item%g, 1)*item%n_node
                  n = n + 1
                  row(n) = constraint_dof(item, i)
                  column(n) = constraint_dof(item, j)
                  value(n) = factor(k)*item%h(i, j)
               end do
            end do
         end associate
      end do
      call csr_from_values(matrix, n_dof, n_dof, row, column, value)
   end subroutine curvature_matrix

   !> Add the same times `direction`.
   subroutine curvature_add_times(self, factor, direction, product)
      type(constraint_set_t), intent(in) :: self     !! evaluated
      real(wp), intent(in) :: factor(:)              !! (n) multipliers [M L/T^2]
      real(wp), intent(in) :: direction(:, :)        !! (n_dim, n_node)
      real(wp), intent(inout) :: product(:, :)       !! (n_dim, n_node)
      integer :: k, i, j

      do k = 1, self%n
         associate (item => self%item(k), n_dim => size(direction, 1))
            do j = 1, item%n_node
               do i = 1, item%n_node
                  product(:, item%node(i)) = product(:, item%node(i)) + factor(k)*matmul( &
                     item%h(n_dim*(i - 1) + 1:n_dim*i, n_dim*(j - 1) + 1:n_dim*j), &
                     direction(:, item%node(j)))
               end do
            end do
         end associate
      end do
   end subroutine curvature_add_times

end module emcon_curvature
