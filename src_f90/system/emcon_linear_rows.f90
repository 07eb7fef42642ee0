!> The linear constraints of a step as rows over degrees of freedom: ties and equations.
!>
!> Row k: the sum of weight times displacement over its entries is zero. Candidates are numbered
!> once for all: each row of each tie in x and y, then the equations; which of them act may change
!> from step to step. Source: docs/theory.md, section 11.
module emcon_linear_rows
   use emcon_kinds, only : wp
   use emcon_scene, only : prescribed_t, scene_t
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: linear_rows_t, linear_rows_init, linear_rows_begin_step

   type :: linear_rows_t
      integer :: n = 0                           !! candidates
      logical, allocatable :: is_used(:)         !! (n) else merged into a neighbour, or redundant
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

   !> Number the candidates of `scene`; rows there are none yet.
   pure subroutine linear_rows_init(self, scene)
      type(linear_rows_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: t, k, a, n

      self%n = size(scene%equation)
      do t = 1, size(scene%tie)
         self%n = self%n + 2*size(scene%tie(t)%rows%slave)
      end do
      allocate(self%is_used(self%n), source=.false.)
      allocate(self%tie(self%n), self%place(self%n), self%own(self%n), source=0)
      allocate(self%size(self%n))
      self%size = maxval(maxval(scene%x, 2) - minval(scene%x, 2))
      n = 0
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            do k = 1, size(rows%slave)
               do a = 1, 2
                  n = n + 1
                  self%tie(n) = t
                  self%place(n) = k
                  self%own(n) = 2*(rows%slave(k) - 1) + a
                  self%size(n) = rows%size(k)
               end do
            end do
         end associate
      end do
      do k = 1, size(scene%equation)
         n = n + 1
         self%place(n) = k
         self%own(n) = 2*(scene%equation(k)%node(1) - 1) + scene%equation(k)%dof(1)
      end do
   end subroutine linear_rows_init

   !> The rows of a step in which `prescribed` are held. A tie's multiplier at a held end node is
   !> merged into its neighbour, unless that one is held too.
   pure subroutine linear_rows_begin_step(self, scene, prescribed)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(prescribed_t), intent(in) :: prescribed(:)
      logical :: is_held(2*size(scene%x, 2))
      integer, allocatable :: into(:, :)
      integer :: k, t, a, n, first, most

      is_held = .false.
      do k = 1, size(prescribed)
         is_held(2*(prescribed(k)%node - 1) + prescribed(k)%dof) = .true.
      end do
      most = 0
      do t = 1, size(scene%tie)
         most = most + 2*size(scene%tie(t)%rows%node)
      end do
      do k = 1, size(scene%equation)
         most = most + size(scene%equation(k)%node)
      end do
      if (allocated(self%start)) deallocate(self%start, self%dof, self%weight)
      allocate(self%start(self%n + 1), self%dof(most), source=0)
      allocate(self%weight(most), source=0.0_wp)
      self%is_used = .true.
      first = 0
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            call merge_ends(rows%slave, rows%neighbour, is_held, into)
            do n = first + 1, first + 2*size(rows%slave)
               a = 1 + mod(n - first - 1, 2)
               call add_tie_row(self, scene, n, a, into(a, :))
            end do
            first = first + 2*size(rows%slave)
         end associate
      end do
      do n = first + 1, self%n
         associate (equation => scene%equation(self%place(n)))
            call add_row(self, n, 2*(equation%node - 1) + equation%dof, &
               equation%coefficient/maxval(abs(equation%coefficient)))
         end associate
      end do
   end subroutine linear_rows_begin_step

   !> Which row each row of a tie is merged into, by direction; 0: it stands for itself.
   pure subroutine merge_ends(slave, neighbour, is_held, into)
      integer, intent(in) :: slave(:), neighbour(:, :)
      logical, intent(in) :: is_held(:)              !! (degrees of freedom)
      integer, allocatable, intent(out) :: into(:, :)    !! (2, rows)
      integer :: k, a, other

      allocate(into(2, size(slave)), source=0)
      do k = 1, size(slave)
         if (all(neighbour(:, k) > 0) .or. all(neighbour(:, k) == 0)) cycle
         other = maxval(neighbour(:, k))
         do a = 1, 2
            if (is_held(2*(slave(k) - 1) + a) .and. .not. is_held(2*(slave(other) - 1) + a)) then
               into(a, k) = other
            end if
         end do
      end do
   end subroutine merge_ends

   !> Row `n`, of direction `a`, with what is merged into it.
   pure subroutine add_tie_row(self, scene, n, a, into)
      type(linear_rows_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n, a
      integer, intent(in) :: into(:)                 !! (rows of the tie)
      integer, allocatable :: dof(:)
      real(wp), allocatable :: weight(:)
      integer :: i, j
      integer :: part(3)

      associate (rows => scene%tie(self%tie(n))%rows, k => self%place(n))
         self%is_used(n) = into(k) == 0
         part = [k, 0, 0]
         self%size(n) = rows%size(k)
         do i = 1, 2
            if (rows%neighbour(i, k) == 0) cycle
            if (into(rows%neighbour(i, k)) /= k) cycle
            if (any(part == rows%neighbour(i, k))) cycle
            part(i + 1) = rows%neighbour(i, k)
            self%size(n) = self%size(n) + rows%size(part(i + 1))
         end do
         allocate(dof(0), weight(0))
         do i = 1, 3
            if (part(i) == 0) cycle
            associate (from => rows%start(part(i)) + 1, to => rows%start(part(i) + 1))
               dof = [dof, [(2*(rows%node(j) - 1) + a, j = from, to)]]
               weight = [weight, rows%weight(from:to)/self%size(n)]
            end associate
         end do
      end associate
      if (.not. self%is_used(n)) then
         self%start(n + 1) = self%start(n)
      else
         call add_row(self, n, dof, weight)
      end if
   end subroutine add_tie_row

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
