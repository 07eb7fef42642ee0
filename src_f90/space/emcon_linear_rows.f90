!> The linear constraints of a scene as rows over degrees of freedom: rigid bodies, ties, equations.
!>
!> Row k: the sum of weight times displacement over its entries is zero. There is a row in each
!> direction for each node of a rigid body that is not in its frame, and for each of its arms, then
!> for each row of each tie, then the equations. Source: docs/theory.md, sections 10 and 12.
module emcon_linear_rows
   use emcon_couplings, only : tie_t
   use emcon_kinds, only : wp
   use emcon_rigid_bodies, only : rigid_body_t, rigid_weights
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: linear_rows_t, linear_rows_init, linear_rows_choose

   type :: linear_rows_t
      integer :: n = 0
      logical, allocatable :: is_used(:)         !! (n) else it follows from others in this step,
      logical, allocatable :: is_gone(:)         !! (n) or no longer holds
      integer, allocatable :: tie(:)             !! (n) that it is of; 0: an equation; -b: a body
      integer, allocatable :: place(:)           !! (n) row of tie, number of equation, rigid node
      integer, allocatable :: own(:)             !! (n) the freedom to eliminate, if possible
      !> (n) what a row that is not met is measured by: int psi_k, in space its root; else the
      !> extent of x [L]
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
      real(wp) :: extent
      integer :: t, k, n, n_dim, most

      n_dim = size(scene%x, 1)
      self%n = size(scene%equation)
      most = 0
      do k = 1, size(scene%rigid)
         associate (n_row => n_dim*(n_follower(scene%rigid(k)) + n_arm(scene%rigid(k))))
            self%n = self%n + n_row
            most = most + (n_dim + 2)*n_row
         end associate
      end do
      do t = 1, size(scene%tie)
         self%n = self%n + n_dim*size(scene%tie(t)%rows%slave)
         most = most + n_dim*merge(n_dim, 1, allocated(scene%tie(t)%rows%is_image)) &
            *size(scene%tie(t)%rows%node)
      end do
      do k = 1, size(scene%equation)
         most = most + size(scene%equation(k)%node)
      end do
      allocate(self%tie(self%n), self%place(self%n), self%own(self%n), source=0)
      allocate(self%start(self%n + 1), self%dof(most), source=0)
      allocate(self%size(self%n), self%weight(most), source=0.0_wp)
      n = 0
      extent = 0.0_wp
      if (self%n > 0) extent = maxval(maxval(scene%x, 2) - minval(scene%x, 2))
      do k = 1, size(scene%rigid)
         call add_rigid(self, scene, k, extent, n)
      end do
      do t = 1, size(scene%tie)
         call add_tie(self, scene, t, n)
      end do
      do k = 1, size(scene%equation)
         n = n + 1
         associate (equation => scene%equation(k))
            self%place(n) = k
            self%own(n) = n_dim*(equation%node(1) - 1) + equation%dof(1)
            self%size(n) = extent
            call add_row(self, n, n_dim*(equation%node - 1) + equation%dof, &
               equation%coefficient/maxval(abs(equation%coefficient)))
         end associate
      end do
      allocate(self%is_used(self%n), source=.true.)
      allocate(self%is_gone(self%n), source=.false.)
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
               self%size(n) = rows%size(k)**(1.0_wp/real(n_dim - 1, wp))
               associate (from => rows%start(k) + 1, to => rows%start(k + 1))
                  if (allocated(rows%is_image)) then
                     call add_mapped(self, n, scene%tie(t), from, to, a, rows%size(k))
                  else
                     call add_row(self, n, n_dim*(rows%node(from:to) - 1) + a, &
                        rows%weight(from:to)/rows%size(k))
                  end if
               end associate
            end do
         end do
      end associate
   end subroutine add_tie

   !> Append row `n` of direction `a`: images are displaced by what the map makes of their nodes.
   pure subroutine add_mapped(self, n, tie, from, to, a, length)
      type(linear_rows_t), intent(inout) :: self
      integer, intent(in) :: n
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: from, to, a         !! entries of the row; 1..n_dim
      real(wp), intent(in) :: length             !! int psi
      integer :: dof(size(tie%map%shift)*(to - from + 1)), i, b, m
      real(wp) :: weight(size(dof))

      m = 0
      associate (rows => tie%rows, turn => tie%map%turn, n_dim => size(tie%map%shift))
         do i = from, to
            do b = 1, n_dim
               if (.not. merge(abs(turn(a, b)) > 0.0_wp, a == b, rows%is_image(i))) cycle
               m = m + 1
               dof(m) = n_dim*(rows%node(i) - 1) + b
               weight(m) = merge(turn(a, b), 1.0_wp, rows%is_image(i))*rows%weight(i)/length
            end do
         end do
      end associate
      call add_row(self, n, dof(:m), weight(:m))
   end subroutine add_mapped

   !> Nodes of a rigid body that are not in its frame.
   pure integer function n_follower(rigid)
      type(rigid_body_t), intent(in) :: rigid

      n_follower = size(rigid%node) - size(rigid%frame)
   end function n_follower

   pure integer function n_arm(rigid)
      type(rigid_body_t), intent(in) :: rigid

      n_arm = 0
      if (allocated(rigid%arm)) n_arm = size(rigid%arm)
   end function n_arm

   !> Append the rows of rigid body `b` behind row `n`: nodes follow its frame, and arms are what
   !> its frame moves by less its reference node.
   pure subroutine add_rigid(self, scene, b, extent, n)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: b
      real(wp), intent(in) :: extent             !! of the scene [L]
      integer, intent(inout) :: n
      real(wp) :: weight(size(scene%x, 1) + 1)
      integer :: i

      associate (body => scene%rigid(b), n_dim => size(scene%x, 1))
         do i = 1, size(body%node)
            if (any(body%frame == body%node(i))) cycle
            call rigid_weights(scene%x(:, body%frame), scene%x(:, body%node(i)), weight)
            call add_sums(self, n, n_dim, [body%node(i), body%frame], [1.0_wp, -weight], extent)
            self%tie(n - n_dim + 1:n) = -b
         end do
         do i = 1, n_arm(body)
            call add_sums(self, n, n_dim, [body%arm(i), body%frame(1), body%frame(i + 1)], &
               [1.0_wp, 1.0_wp, -1.0_wp], extent)
            self%tie(n - n_dim + 1:n) = -b
         end do
      end associate
   end subroutine add_rigid

   !> Append the same sum over nodes in each direction behind row `n`; the first node is its own.
   pure subroutine add_sums(self, n, n_dim, node, weight, extent)
      type(linear_rows_t), intent(inout) :: self
      integer, intent(inout) :: n
      integer, intent(in) :: n_dim, node(:)
      real(wp), intent(in) :: weight(:)          !! (size of node)
      real(wp), intent(in) :: extent             !! that a row that is not met is measured by
      integer :: a

      do a = 1, n_dim
         n = n + 1
         self%place(n) = node(1)
         self%own(n) = n_dim*(node(1) - 1) + a
         self%size(n) = extent
         call add_row(self, n, n_dim*(node - 1) + a, weight)
      end do
   end subroutine add_sums

   !> Choose what is eliminated in `step`: arms follow the frame of their body, but where they are
   !> prescribed the frame follows them. All rows that hold are in use then.
   pure subroutine linear_rows_choose(self, scene, i_step)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      integer :: n, k, node

      do n = 1, self%n
         if (self%tie(n) >= 0) cycle
         associate (body => scene%rigid(-self%tie(n)), n_dim => size(scene%x, 1))
            k = 0
            if (allocated(body%arm)) k = findloc(body%arm, self%place(n), 1)
            if (k == 0) cycle
            node = body%arm(k)
            associate (step => scene%step(i_step))
               if (allocated(step%turn)) then
                  if (any(step%turn%rigid == -self%tie(n) .and. .not. step%turn%is_about)) then
                     node = body%frame(k + 1)
                  end if
               end if
            end associate
            self%own(n) = n_dim*(node - 1) + 1 + mod(self%own(n) - 1, n_dim)
         end associate
      end do
      do n = 1, self%n
         if (self%tie(n) == 0) self%is_gone(n) = i_step > scene%equation(self%place(n))%last_step
      end do
      self%is_used = .not. self%is_gone
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
