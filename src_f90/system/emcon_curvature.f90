!> Second derivatives of the selected conditions, summed with multipliers, and those of the laws
!> beside their rows: what the tangent of a step gets less of, over all degrees of freedom.
module emcon_curvature
   use emcon_constraint, only : condition_stiffness
   use emcon_constraint_rows, only : constraint_dof
   use emcon_constraints, only : constraint_set_t, constraints_take_lam
   use emcon_csr, only : csr_from_values, csr_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: curvature_matrix, curvature_add_times

contains

   !> Sum over the rows of `factor` times the derivative of the force of its unit by the end.
   subroutine curvature_matrix(self, factor, n_dof, matrix)
      type(constraint_set_t), intent(inout) :: self  !! evaluated; it is left as it was
      real(wp), intent(in) :: factor(:)              !! (n_row) multipliers [M L/T^2]
      integer, intent(in) :: n_dof                   !! n_dim times n_node
      type(csr_t), intent(out) :: matrix             !! (n_dof x n_dof) [M/T^2]
      integer, allocatable :: row(:), column(:)
      real(wp), allocatable :: value(:), second(:, :), lam(:)
      integer :: k, i, j, n

      n = 0
      do k = 1, self%n_condition
         n = n + (size(self%item(k)%g, 1)*self%item(k)%n_node)**2
      end do
      allocate(row(n), column(n), value(n))
      n = 0
      call take_friction(self, factor, lam)
      do k = 1, self%n_condition
         second = second_of(self, k, factor)
         do j = 1, size(second, 2)
            do i = 1, size(second, 1)
               n = n + 1
               row(n) = constraint_dof(self%item(k), i)
               column(n) = constraint_dof(self%item(k), j)
               value(n) = second(i, j)
            end do
         end do
      end do
      call put_back(self, lam)
      call csr_from_values(matrix, n_dof, n_dof, row, column, value)
   end subroutine curvature_matrix

   !> Add the same times `direction`.
   subroutine curvature_add_times(self, factor, direction, product)
      type(constraint_set_t), intent(inout) :: self  !! evaluated; it is left as it was
      real(wp), intent(in) :: factor(:)              !! (n_row) multipliers [M L/T^2]
      real(wp), intent(in) :: direction(:, :)        !! (n_dim, n_node)
      real(wp), intent(inout) :: product(:, :)       !! (n_dim, n_node)
      real(wp), allocatable :: second(:, :), lam(:)
      integer :: k, i, j

      call take_friction(self, factor, lam)
      do k = 1, self%n_condition
         second = second_of(self, k, factor)
         associate (item => self%item(k), n_dim => size(direction, 1))
            do j = 1, item%n_node
               do i = 1, item%n_node
                  product(:, item%node(i)) = product(:, item%node(i)) + matmul( &
                     second(n_dim*(i - 1) + 1:n_dim*i, n_dim*(j - 1) + 1:n_dim*j), &
                     direction(:, item%node(j)))
               end do
            end do
         end associate
      end do
      call put_back(self, lam)
   end subroutine curvature_add_times

   !> Friction is to be that of the factors.
   subroutine take_friction(self, factor, lam)
      type(constraint_set_t), intent(inout) :: self
      real(wp), intent(in) :: factor(:)              !! (n_row)
      real(wp), allocatable, intent(out) :: lam(:)   !! what was in their place

      if (.not. any(self%item(:self%n)%has_friction)) return
      lam = self%lam
      call constraints_take_lam(self, factor)
   end subroutine take_friction

   !> And that of before again.
   subroutine put_back(self, lam)
      type(constraint_set_t), intent(inout) :: self
      real(wp), allocatable, intent(in) :: lam(:)

      if (allocated(lam)) call constraints_take_lam(self, lam)
   end subroutine put_back

   !> The derivative of the forces of condition `k`, coordinates node by node.
   pure function second_of(self, k, factor) result(second)
      type(constraint_set_t), intent(in) :: self
      integer, intent(in) :: k                       !! place in the set, 1..n_condition
      real(wp), intent(in) :: factor(:)              !! (n_row) multipliers [M L/T^2]
      real(wp), allocatable :: second(:, :)
      real(wp) :: lam                                ! of the row of its gap

      lam = 0.0_wp
      if (k <= self%n) lam = factor(k)
      associate (item => self%item(k), n => size(self%item(k)%g, 1)*self%item(k)%n_node)
         if (item%has_friction .or. allocated(self%law(k)%beside)) then
            second = -condition_stiffness(item, lam)
         else
            second = lam*item%h(:n, :n)
         end if
      end associate
   end function second_of

end module emcon_curvature
