!> A tie as matrices, and the forces that a constant stress exerts through it.
!>
!> The rows of a tie read D x_s = M x_g: x_s are the slave nodes that have a row, x_g all others,
!> the master nodes and the slave nodes without a row, the ends. A constant stress sigma asks the
!> nodes of a chain of straight edges for the forces sigma R s with s_A = (X_A+1 - X_A-1)/2, R a
!> rotation by 90 degrees. They are in equilibrium if multipliers L, one vector a row, exist with
!>    D^T L = s_s,  M^T L = s_g,
!> where s_g is -s of the part of the master chain that is covered (the chains run against each
!> other), and -s of the slave chain at its ends. `tie_balance_residual` tells the second equation.
module emcon_tie_balance_data_plane
   use emcon_couplings, only : tie_rows_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_kinds, only : dp, hp, wp
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_sparse_solver, only : matrix_general, solver_box_t
   implicit none
   private
   public :: tie_balance_t, tie_balance_init, tie_balance_free, tie_balance_residual

   type :: tie_balance_t
      integer :: n_row = 0
      integer :: n_other = 0
      integer, allocatable :: other(:)           !! (n_other) ascending nodes that have no row
      integer, allocatable :: d_row(:), d_column(:)   !! entries of D
      real(hp), allocatable :: d_value(:)        !! [L]
      integer, allocatable :: start(:)           !! (n_row + 1) entries of M before each row
      integer, allocatable :: column(:)          !! entries of M, 1..n_other
      real(hp), allocatable :: m_value(:)        !! [L]
      real(hp), allocatable :: size(:)           !! (n_row) [L]
      integer, allocatable :: neighbour(:, :)    !! (2, n_row) row before and after; 0: an end
      integer, allocatable :: edge(:, :)         !! (2, n_edge) slave edges: rows, or -others
      real(hp), allocatable :: x_other(:, :)     !! (2, n_other) [L]
      real(hp), allocatable :: s_master(:, :)    !! (2, n_other) -s of the master chain [L]
      real(hp), allocatable :: x(:, :)           !! (2, n_row) slave nodes, D x = M x_other [L]
      real(hp), allocatable :: multiplier(:, :)  !! (2, n_row)
      real(hp), allocatable :: residual(:, :)    !! (2, n_other) M^T L - s_g [L]
      real(hp) :: force = 0.0_hp                 !! largest |s_g| [L]
      type(solver_box_t), private :: side(2)     !! D and its transpose
   end type tie_balance_t

contains

   !> The matrices of `rows`; M gets, with value zero, the entries of the rows beside each row.
   subroutine tie_balance_init(self, rows, x, slave_edge, master_edge, cover, error)
      type(tie_balance_t), intent(inout) :: self
      type(tie_rows_t), intent(in) :: rows
      real(hp), intent(in) :: x(:, :)            !! (2, n_node) positions [L]
      integer, intent(in) :: slave_edge(:, :)    !! (2, n) first and last node
      integer, intent(in) :: master_edge(:, :)   !! (2, n) first and last node
      real(hp), intent(in) :: cover(:, :)        !! (2, n) int N_C over what is covered, per length
      type(error_t), allocatable, intent(out) :: error
      integer :: row_of(size(x, 2)), slave(2*size(slave_edge, 2))
      integer :: i, k

      self%n_row = size(rows%slave)
      slave = reshape(slave_edge, [size(slave)])
      row_of = 0
      row_of(rows%slave) = [(k, k = 1, self%n_row)]
      self%other = unique_sorted([pack(rows%node, row_of(rows%node) == 0), &
         pack(slave, row_of(slave) == 0), &
         pack(master_edge, spread(sum(cover, 1) > 0.0_hp, 1, 2))])
      self%n_other = size(self%other)
      self%x_other = x(:, self%other)
      self%size = real(rows%size, hp)
      self%neighbour = rows%neighbour
      allocate(self%x(2, self%n_row), self%multiplier(2, self%n_row))
      allocate(self%residual(2, self%n_other))
      call split_rows(self, rows, row_of)
      allocate(self%edge(2, size(slave_edge, 2)))
      do i = 1, size(slave_edge, 2)
         do k = 1, 2
            self%edge(k, i) = row_of(slave_edge(k, i))
            if (self%edge(k, i) == 0) self%edge(k, i) = -find_sorted(self%other, slave_edge(k, i))
         end do
      end do
      call add_master(self, x, master_edge, cover)
      call factorise(self, error)
   end subroutine tie_balance_init

   !> D and M of the rows, M widened.
   subroutine split_rows(self, rows, row_of)
      type(tie_balance_t), intent(inout) :: self
      type(tie_rows_t), intent(in) :: rows
      integer, intent(in) :: row_of(:)           !! (n_node)
      integer, allocatable :: place(:), column(:)
      real(hp), allocatable :: value(:)
      integer :: i, j, k, n, n_d, side, beside(3), most

      most = 0
      do k = 1, self%n_row
         most = most + row_entries(rows, k)
         do side = 1, 2
            most = most + row_entries(rows, rows%neighbour(side, k))
         end do
      end do
      allocate(place(self%n_other), source=0)
      allocate(column(most), self%start(self%n_row + 1), source=0)
      allocate(value(most), source=0.0_hp)
      n_d = count(row_of(rows%node) > 0)
      allocate(self%d_row(n_d), self%d_column(n_d), self%d_value(n_d))
      n = 0
      n_d = 0
      do k = 1, self%n_row
         beside = [k, rows%neighbour(:, k)]
         do side = 1, 3
            if (beside(side) == 0) cycle
            do i = rows%start(beside(side)) + 1, rows%start(beside(side) + 1)
               j = row_of(rows%node(i))
               if (j > 0 .and. side == 1) then
                  n_d = n_d + 1
                  self%d_row(n_d) = k
                  self%d_column(n_d) = j
                  self%d_value(n_d) = real(rows%weight(i), hp)
               else if (j == 0) then
                  j = find_sorted(self%other, rows%node(i))
                  if (place(j) <= self%start(k)) then
                     n = n + 1
                     place(j) = n
                     column(n) = j
                  end if
                  if (side == 1) value(place(j)) = value(place(j)) &
                     - real(rows%weight(i), hp)
               end if
            end do
         end do
         self%start(k + 1) = n
      end do
      self%column = column(:n)
      self%m_value = value(:n)
   end subroutine split_rows

   pure integer function row_entries(rows, k)
      type(tie_rows_t), intent(in) :: rows
      integer, intent(in) :: k                   !! 0: none

      row_entries = 0
      if (k > 0) row_entries = rows%start(k + 1) - rows%start(k)
   end function row_entries

   !> -int N_C dX along the covered parts of the master edges.
   pure subroutine add_master(self, x, master_edge, cover)
      type(tie_balance_t), intent(inout) :: self
      real(hp), intent(in) :: x(:, :), cover(:, :)
      integer, intent(in) :: master_edge(:, :)
      real(hp) :: a(2)
      integer :: i, k, j

      allocate(self%s_master(2, self%n_other), source=0.0_hp)
      do i = 1, size(master_edge, 2)
         if (.not. sum(cover(:, i)) > 0.0_hp) cycle
         a = x(:, master_edge(2, i)) - x(:, master_edge(1, i))
         do k = 1, 2
            j = find_sorted(self%other, master_edge(k, i))
            self%s_master(:, j) = self%s_master(:, j) - cover(k, i)*a
         end do
      end do
   end subroutine add_master

   !> Factorise D and its transpose.
   subroutine factorise(self, error)
      type(tie_balance_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: d
      integer, allocatable :: slot(:)
      integer :: i, side

      do side = 1, 2
         if (side == 1) then
            call csr_from_entries(d, self%n_row, self%n_row, self%d_row, self%d_column, slot)
         else
            call csr_from_entries(d, self%n_row, self%n_row, self%d_column, self%d_row, slot)
         end if
         do i = 1, size(slot)
            d%value(slot(i)) = d%value(slot(i)) + real(self%d_value(i), dp)
         end do
         call solver_create(solver_default, matrix_general, self%side(side)%solver)
         call self%side(side)%solver%analyse(d, error)
         if (allocated(error)) return
         call self%side(side)%solver%factorise(d%value, error)
         if (allocated(error)) return
         if (self%side(side)%solver%is_singular) then
            call raise(error, err_internal, "tie_balance_init: the slave matrix is singular")
            return
         end if
      end do
   end subroutine factorise

   subroutine tie_balance_free(self)
      type(tie_balance_t), intent(inout) :: self
      integer :: side

      do side = 1, 2
         if (allocated(self%side(side)%solver)) call self%side(side)%solver%free()
      end do
   end subroutine tie_balance_free

   !> Positions, multipliers and the residual M^T L - s_g for the present M; its largest entry per
   !> largest force.
   subroutine tie_balance_residual(self, largest, error)
      type(tie_balance_t), intent(inout) :: self
      real(hp), intent(out) :: largest
      type(error_t), allocatable, intent(out) :: error
      real(hp) :: rhs(2, self%n_row), s(2, self%n_row), target(2, self%n_other), half(2)
      integer :: i, j, k

      rhs = 0.0_hp
      do k = 1, self%n_row
         do i = self%start(k) + 1, self%start(k + 1)
            rhs(:, k) = rhs(:, k) + self%m_value(i)*self%x_other(:, self%column(i))
         end do
      end do
      call solve(self, 1, rhs, self%x, error)
      if (allocated(error)) return
      s = 0.0_hp
      target = self%s_master
      do i = 1, size(self%edge, 2)
         half = 0.5_hp*(position(self, self%edge(2, i)) - position(self, self%edge(1, i)))
         do k = 1, 2
            j = self%edge(k, i)
            if (j > 0) then
               s(:, j) = s(:, j) + half
            else
               target(:, -j) = target(:, -j) - half
            end if
         end do
      end do
      call solve(self, 2, s, self%multiplier, error)
      if (allocated(error)) return
      self%force = maxval(abs(self%s_master))
      self%residual = -target
      do k = 1, self%n_row
         do i = self%start(k) + 1, self%start(k + 1)
            j = self%column(i)
            self%residual(:, j) = self%residual(:, j) + self%m_value(i)*self%multiplier(:, k)
         end do
      end do
      largest = maxval(abs(self%residual))/self%force
   end subroutine tie_balance_residual

   !> Where a slave node is: a row, or minus another node.
   pure function position(self, k) result(x)
      type(tie_balance_t), intent(in) :: self
      integer, intent(in) :: k
      real(hp) :: x(2)

      if (k > 0) then
         x = self%x(:, k)
      else
         x = self%x_other(:, -k)
      end if
   end function position

   !> D y = rhs (side 1), or D^T y = rhs (2): by the factors in dp, refined.
   subroutine solve(self, side, rhs, y, error)
      type(tie_balance_t), intent(inout) :: self
      integer, intent(in) :: side
      real(hp), intent(in) :: rhs(:, :)          !! (2, n_row)
      real(hp), intent(out) :: y(:, :)           !! (2, n_row)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_refine = 3
      real(hp) :: r(self%n_row)
      real(wp) :: dy(self%n_row)
      integer :: d, i, pass

      do d = 1, 2
         y(d, :) = 0.0_hp
         do pass = 0, n_refine
            r = rhs(d, :)
            do i = 1, size(self%d_value)
               if (side == 1) then
                  r(self%d_row(i)) = r(self%d_row(i)) - self%d_value(i)*y(d, self%d_column(i))
               else
                  r(self%d_column(i)) = r(self%d_column(i)) - self%d_value(i)*y(d, self%d_row(i))
               end if
            end do
            call self%side(side)%solver%solve(real(r, wp), dy, error)
            if (allocated(error)) return
            y(d, :) = y(d, :) + real(dy, hp)
         end do
      end do
   end subroutine solve

end module emcon_tie_balance_data_plane
