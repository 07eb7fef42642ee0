!> The linear constraints of a scene as rows over degrees of freedom: rigid bodies, ties, equations.
!>
!> Row k: the sum of weight times displacement over its entries is zero. There is a row in each
!> direction for each node of a rigid body but its reference node, then for each row of each tie,
!> then the equations. Source: docs/theory.md, sections 11 and 13.
module emcon_linear_rows
   use emcon_kinds, only : wp
   use emcon_rigid_bodies, only : rigid_weights
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   use emcon_steps, only : step_t
   implicit none
   private
   public :: linear_rows_t, linear_rows_init, linear_rows_choose

   type :: linear_rows_t
      integer :: n = 0
      logical, allocatable :: is_used(:)         !! (n) else it follows from others in this step
      logical, allocatable :: is_off(:)          !! (n) it does not hold in this step
      integer, allocatable :: tie(:)             !! (n) that it is of; 0: an equation; -b: a body
      integer, allocatable :: place(:)           !! (n) row of tie, number of equation, rigid node
      integer, allocatable :: own(:)             !! (n) the freedom to eliminate, if possible
      !> (n) what a row that is not met is measured by: int psi_k; else the extent of x.
      real(wp), allocatable :: size(:)
      integer, allocatable :: start(:)           !! (n + 1) entries before each row, from 0
      integer, allocatable :: dof(:)             !! places in an (n_dim, n_node) array, ascending
      real(wp), allocatable :: weight(:)         !! of order 1
   end type linear_rows_t

contains

   !> The rows of `scene`, all in use but for those of `is_off`.
   pure subroutine linear_rows_init(self, scene)
      type(linear_rows_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: t, k, n, n_dim, most

      n_dim = size(scene%x, 1)
      self%n = size(scene%equation)
      most = 0
      do k = 1, size(scene%rigid)
         associate (n_row => n_dim*(size(scene%rigid(k)%node) - 1))
            self%n = self%n + n_row
            most = most + (n_dim + 2)*n_row
         end associate
      end do
      do t = 1, size(scene%tie)
         self%n = self%n + n_dim*size(scene%tie(t)%rows%slave)
         most = most + n_dim*size(scene%tie(t)%rows%node)
      end do
      do k = 1, size(scene%equation)
         most = most + size(scene%equation(k)%node)
      end do
      allocate(self%is_off(self%n), source=.false.)
      allocate(self%tie(self%n), self%place(self%n), self%own(self%n), source=0)
      allocate(self%start(self%n + 1), self%dof(most), source=0)
      allocate(self%size(self%n), self%weight(most), source=0.0_wp)
      n = 0
      do k = 1, size(scene%rigid)
         call add_rigid(self, scene, k, n)
      end do
      do t = 1, size(scene%tie)
         call add_tie(self, scene, t, n)
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
      allocate(self%is_used, source=.not. self%is_off)
   end subroutine linear_rows_init

   !> Append the rows of tie `t` behind row `n`.
   pure subroutine add_tie(self, scene, t, n)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: t
      integer, intent(inout) :: n
      integer :: k, a, n_dim

      n_dim = size(scene%x, 1)
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
   end subroutine add_tie

   !> Append the rows of rigid body `b` behind row `n`: nodes follow its frame, and those of the
   !> frame follow the reference node in steps in which the body must not turn.
   pure subroutine add_rigid(self, scene, b, n)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: b
      integer, intent(inout) :: n
      real(wp) :: weight(size(scene%x, 1) + 1)
      integer :: i, a, n_dim

      n_dim = size(scene%x, 1)
      associate (body => scene%rigid(b))
         do i = 1, size(body%node)
            if (body%node(i) == body%reference) cycle
            call rigid_weights(scene%x(:, body%frame), scene%x(:, body%node(i)), weight)
            do a = 1, n_dim
               n = n + 1
               self%tie(n) = -b
               self%place(n) = body%node(i)
               self%own(n) = n_dim*(body%node(i) - 1) + a
               self%size(n) = maxval(maxval(scene%x, 2) - minval(scene%x, 2))
               self%is_off(n) = any(body%frame == body%node(i))
               if (self%is_off(n)) then
                  call add_row(self, n, [self%own(n), n_dim*(body%reference - 1) + a], &
                     [1.0_wp, -1.0_wp])
               else
                  call add_row(self, n, [self%own(n), n_dim*(body%frame - 1) + a], &
                     [1.0_wp, -weight])
               end if
            end do
         end do
      end associate
   end subroutine add_rigid

   !> Choose the rows of `step`: those that keep a rigid body from turning where that is prescribed
   !> while its reference node is free, and all that hold in every step. All are in use then.
   pure subroutine linear_rows_choose(self, scene, step)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      integer :: k, n

      do n = 1, self%n
         if (self%tie(n) >= 0) cycle
         associate (body => scene%rigid(-self%tie(n)))
            self%is_off(n) = any(body%frame == self%place(n))
         end associate
         if (.not. (self%is_off(n) .and. allocated(step%turn))) cycle
         do k = 1, size(step%turn)
            if (step%turn(k)%rigid == -self%tie(n) .and. .not. step%turn(k)%is_about) then
               self%is_off(n) = .false.
            end if
         end do
      end do
      self%is_used = .not. self%is_off
   end subroutine linear_rows_choose

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
