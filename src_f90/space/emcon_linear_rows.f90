!> The linear constraints of a scene as rows over degrees of freedom: ties and equations.
!>
!> Row k: the sum of weight times displacement over its entries is zero. There are two rows, in x
!> and y, for each row of each tie, then the equations. Source: docs/theory.md, section 11.
module emcon_linear_rows
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: linear_rows_t, linear_rows_init

   type :: linear_rows_t
      integer :: n = 0
      logical, allocatable :: is_used(:)         !! (n) else it follows from others in this step
      integer, allocatable :: tie(:)             !! (n) that it is of; 0: an equation
      integer, allocatable :: place(:)           !! (n) row of the tie, or number of the equation
      integer, allocatable :: own(:)             !! (n) the freedom to eliminate, if possible
      !> (n) what a row that is not met is measured by: int psi_k; for an equation the extent of x.
      real(wp), allocatable :: size(:)
      integer, allocatable :: start(:)           !! (n + 1) entries before each row, from 0
      integer, allocatable :: dof(:)             !! places in an (n_dim, n_node) array, ascending
      real(wp), allocatable :: weight(:)         !! of order 1
   end type linear_rows_t

contains

   !> The rows of `scene`, all in use.
   pure subroutine linear_rows_init(self, scene)
      type(linear_rows_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: t, k, a, n, n_dim, most

      n_dim = size(scene%x, 1)
      self%n = size(scene%equation)
      most = 0
      do t = 1, size(scene%tie)
         self%n = self%n + n_dim*size(scene%tie(t)%rows%slave)
         most = most + n_dim*size(scene%tie(t)%rows%node)
      end do
      do k = 1, size(scene%equation)
         most = most + size(scene%equation(k)%node)
      end do
      allocate(self%is_used(self%n), source=.true.)
      allocate(self%tie(self%n), self%place(self%n), self%own(self%n), source=0)
      allocate(self%start(self%n + 1), self%dof(most), source=0)
      allocate(self%size(self%n), self%weight(most), source=0.0_wp)
      n = 0
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            do k = 1, size(rows%slave)
               do a = 1, n_dim
                  n = n + 1
                  self%tie(n) = t
                  self%place(n) = k
                  self%own(n) = n_dim*(rows%slave(k) - 1) + a
                  self%size(n) = rows%size(k)
                  associate (from => rows%start(k) + 1, to => rows%start(k + 1))
                     call add_row(self, n, n_dim*(rows%node(from:to) - 1) + a, &
                        rows%weight(from:to)/rows%size(k))
                  end associate
               end do
            end do
         end associate
      end do
      do k = 1, size(scene%equation)
         n = n + 1
         associate (equation => scene%equation(k))
            self%place(n) = k
            self%own(n) = n_dim*(equation%node(1) - 1) + equation%dof(1)
            self%size(n) = maxval(maxval(scene%x, 2) - minval(scene%x, 2))
            call add_row(self, n, n_dim*(equation%node - 1) + equation%dof, &
               equation%coefficient/maxval(abs(equation%coefficient)))
         end associate
      end do
   end subroutine linear_rows_init

   !> Append row `n`: degrees of freedom ascending, equal ones as one.
   pure subroutine add_row(self, n, dof, weight)
      type(linear_rows_t), intent(inout) :: self
      integer, intent(in) :: n, dof(:)
      real(wp), intent(in) :: weight(:)
      integer :: order(size(dof)), i, last

      order = sort_order(dof)
      last = self%start(n)
      do i = 1, size(dof)
         associate (d => dof(order(i)), w => weight(order(i)))
            if (last > self%start(n)) then
               if (self%dof(last) == d) then
                  self%weight(last) = self%weight(last) + w
                  cycle
               end if
            end if
            last = last + 1
            self%dof(last) = d
            self%weight(last) = w
         end associate
      end do
      self%start(n + 1) = last
   end subroutine add_row

end module emcon_linear_rows
