!> One Newton step towards a balanced tie: the smallest change of M that removes the residual.
!>
!> With z = dM/size per entry and the moves dX of the slave nodes, minimise sum z^2 + weight
!> (dX/size)^2 such that, linearised, rows keep their sums, D X = M X_g, D^T L = s(X) and
!> M^T L = s_g. One band matrix of z, dX, dL and the multipliers of these conditions.
!>
!> The conditions depend on each other: for closed chains by the three motions and two more, and
!> per master node where the chains are straight, as then nothing acts across them. Forces are taken
!> along and across the chain, conditions without effect are left out, and a small negative
!> diagonal at the forces stands for the rest.
module emcon_tie_balance_step_plane
   use emcon_band_blocks, only : band_blocks_factorise, band_blocks_init, band_blocks_place, &
      band_blocks_solve, band_blocks_t
   use emcon_kinds, only : dp, hp, wp
   use emcon_power_scaling, only : power_of_two
   use emcon_tie_balance_data_plane, only : tie_balance_t
   use emcon_tie_balance_order_plane, only : balance_order
   implicit none
   private
   public :: balance_step_t, balance_step_init, balance_step_do

   !> Entries of the conditions, and the matrix they are put into.
   type :: balance_step_t
      integer :: n_unknown = 0                   !! z, dX, dL
      integer :: n_condition = 0
      integer :: n_entry = 0
      integer, allocatable :: row(:), column(:)  !! entries of the conditions
      real(hp), allocatable :: value(:), rhs(:)
      logical, allocatable :: is_idle(:)         !! (n_condition) left out
      real(hp), allocatable :: norm2(:)          !! (n_condition) sum of squares over z
      integer, allocatable :: rank(:)            !! (n_unknown + n_condition) place in the band
      type(band_blocks_t) :: band
   end type balance_step_t

   !> Moves cost more than changes of M, so that slave nodes stay and the problem is nearly linear.
   real(hp), parameter :: move_weight = 1.0e4_hp
   !> Factor of the squares, far below 1: the factors then pivot on the conditions, and weak ones
   !> count by their size, not by its square.
   real(dp), parameter :: square_weight = 1.0e-10_dp
   !> Diagonal at the forces, relative to the squares of their conditions: round-off over it is
   !> how far dependent conditions disturb z.
   real(dp), parameter :: diagonal = 1.0e-8_dp &
      *sqrt(max(1.0_dp, real(epsilon(1.0_wp), dp)/epsilon(1.0_dp)))
   !> Across a straight chain nothing but rounding of the positions is left: so many of it.
   real(hp), parameter :: idle_tol = 256.0_hp*real(epsilon(1.0_wp), hp)

contains

   subroutine balance_step_init(self, tie)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      integer :: n, n_z

      n_z = size(tie%column)
      self%n_unknown = n_z + 4*tie%n_row
      self%n_condition = 5*tie%n_row + 2*tie%n_other
      n = n_z + 2*(n_z + size(tie%d_value)) + 2*size(tie%d_value) + 16*size(tie%edge, 2) + 6*n_z
      allocate(self%row(n), self%column(n), self%value(n), self%rhs(self%n_condition))
      allocate(self%is_idle(self%n_condition), self%norm2(self%n_condition))
   end subroutine balance_step_init

   !> Change `tie%m_value`; `largest` is the largest sum of |z| over a row, < 0: no solution.
   subroutine balance_step_do(self, tie, largest)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(inout) :: tie
      real(hp), intent(out) :: largest
      real(dp) :: rhs(self%n_unknown + self%n_condition), y(self%n_unknown + self%n_condition)
      integer :: k

      self%n_entry = 0
      self%rhs = 0.0_hp
      self%is_idle = .false.
      self%norm2 = 0.0_hp
      call put_geometry(self, tie)
      call put_forces(self, tie)
      if (.not. allocated(self%rank)) call find_order(self, tie)
      rhs(:self%n_unknown) = 0.0_dp
      rhs(self%n_unknown + 1:) = merge(0.0_dp, real(self%rhs, dp), self%is_idle)
      call solve_band(self, tie, rhs, y)
      largest = -1.0_hp
      if (self%band%is_singular) return
      do k = 1, tie%n_row
         associate (i => tie%start(k) + 1, j => tie%start(k + 1))
            tie%m_value(i:j) = tie%m_value(i:j) + tie%size(k)*real(y(i:j), hp)
            largest = max(largest, real(sum(abs(y(i:j))), hp))
         end associate
      end do
   end subroutine balance_step_do

   !> Add an entry of condition `row`.
   pure subroutine put(self, row, column, value)
      type(balance_step_t), intent(inout) :: self
      integer, intent(in) :: row, column
      real(hp), intent(in) :: value

      self%n_entry = self%n_entry + 1
      self%row(self%n_entry) = row
      self%column(self%n_entry) = column
      self%value(self%n_entry) = value
   end subroutine put

   !> Row sums; D dX - dM X_g = 0; D^T dL - ds(dX) = 0.
   pure subroutine put_geometry(self, tie)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      integer :: d, i, j, k, n, p, q, n_z
      real(hp) :: total(tie%n_row)

      n = tie%n_row
      n_z = size(tie%column)
      total = 0.0_hp
      do i = 1, size(tie%d_value)
         j = tie%d_row(i)
         k = tie%d_column(i)
         total(j) = total(j) + tie%d_value(i)
         do d = 1, 2
            call put(self, d*n + j, n_z + (d - 1)*n + k, &
               tie%d_value(i)/tie%size(j)*(tie%size(k)/tie%size(j)))
            call put(self, (d + 2)*n + k, n_z + (d + 1)*n + j, tie%d_value(i)/tie%size(k))
         end do
      end do
      do k = 1, n
         do i = tie%start(k) + 1, tie%start(k + 1)
            total(k) = total(k) - tie%m_value(i)
            call put(self, k, i, 1.0_hp)
            do d = 1, 2
               call put(self, d*n + k, i, &
                  -(tie%x_other(d, tie%column(i)) - tie%x(d, k))/tie%size(k))
            end do
         end do
         self%rhs(k) = total(k)/tie%size(k)
      end do
      do i = 1, size(tie%edge, 2)
         do p = 1, 2
            j = tie%edge(p, i)
            if (j < 0) cycle
            do q = 1, 2
               k = tie%edge(q, i)
               if (k < 0) cycle
               do d = 1, 2
                  call put(self, (d + 2)*n + j, n_z + (d - 1)*n + k, &
                     merge(0.5_hp, -0.5_hp, q == 1)*(tie%size(k)/tie%size(j)))
               end do
            end do
         end do
      end do
   end subroutine put_geometry

   !> dM^T L + M^T dL - ds_g(dX) = -residual, along the force of each node and across.
   subroutine put_forces(self, tie)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      real(hp) :: frame(2, 2, tie%n_other), length(tie%n_other), value
      integer :: c, d, f, i, j, k, n, p, q, n_z, row

      n = tie%n_row
      n_z = size(tie%column)
      call find_frames(tie, frame, length)
      do f = 1, 2
         do k = 1, n
            do i = tie%start(k) + 1, tie%start(k + 1)
               c = tie%column(i)
               row = 5*n + (f - 1)*tie%n_other + c
               value = tie%size(k)/length(c)*dot_product(frame(:, f, c), tie%multiplier(:, k))
               self%norm2(row) = self%norm2(row) + value**2
               call put(self, row, i, value)
               do d = 1, 2
                  call put(self, row, n_z + (d + 1)*n + k, tie%m_value(i)/length(c)*frame(d, f, c))
               end do
            end do
         end do
         do i = 1, size(tie%edge, 2)
            do p = 1, 2
               c = -tie%edge(p, i)
               j = tie%edge(3 - p, i)
               if (c < 0 .or. j < 0) cycle
               q = 3 - p
               do d = 1, 2
                  call put(self, 5*n + (f - 1)*tie%n_other + c, n_z + (d - 1)*n + j, &
                     merge(0.5_hp, -0.5_hp, q == 2)*tie%size(j)/length(c)*frame(d, f, c))
               end do
            end do
         end do
         do c = 1, tie%n_other
            self%rhs(5*n + (f - 1)*tie%n_other + c) = &
               -dot_product(frame(:, f, c), tie%residual(:, c))/length(c)
         end do
      end do
      call find_idle(self, tie, length)
   end subroutine put_forces

   !> Unit vectors along and across the force of each node, and the length of chain it stands for.
   pure subroutine find_frames(tie, frame, length)
      type(tie_balance_t), intent(in) :: tie
      real(hp), intent(out) :: frame(:, :, :)    !! (2, along or across, n_other)
      real(hp), intent(out) :: length(:)         !! (n_other) [L]
      real(hp) :: force(2, tie%n_other), norm
      integer :: c, i, k

      force = 0.0_hp
      length = 0.0_hp
      do k = 1, tie%n_row
         do i = tie%start(k) + 1, tie%start(k + 1)
            c = tie%column(i)
            force(:, c) = force(:, c) + tie%m_value(i)*tie%multiplier(:, k)
            length(c) = length(c) + abs(tie%m_value(i))
         end do
      end do
      where (.not. length > 0.0_hp) length = maxval(tie%size)
      do c = 1, tie%n_other
         norm = norm2(force(:, c))
         if (norm > 0.0_hp) then
            frame(:, 1, c) = force(:, c)/norm
         else
            frame(:, 1, c) = [1.0_hp, 0.0_hp]
         end if
         frame(:, 2, c) = [-frame(2, 1, c), frame(1, 1, c)]
      end do
   end subroutine find_frames

   !> Conditions that no entry of M can act on but by rounding.
   pure subroutine find_idle(self, tie, length)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      real(hp), intent(in) :: length(:)
      integer :: c, f, row, n_user(tie%n_other), i
      real(hp) :: rounding

      n_user = 0
      do i = 1, size(tie%column)
         n_user(tie%column(i)) = n_user(tie%column(i)) + 1
      end do
      rounding = idle_tol*maxval(abs(tie%x_other))
      do f = 1, 2
         do c = 1, tie%n_other
            row = 5*tie%n_row + (f - 1)*tie%n_other + c
            self%is_idle(row) = sqrt(self%norm2(row)) <= &
               rounding/length(c)*sqrt(real(n_user(c), hp))
         end do
      end do
   end subroutine find_idle

   !> Solve [square_weight*H A^T; A -diagonal] y = rhs in the order of the chain.
   subroutine solve_band(self, tie, rhs, y)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      real(dp), intent(in) :: rhs(:)
      real(dp), intent(out) :: y(:)
      integer, parameter :: n_refine = 2
      real(dp) :: main(size(rhs)), row(size(rhs)), column(size(rhs)), x(size(rhs)), r(size(rhs))
      integer :: i, pass

      call find_diagonal(self, tie, main)
      call scale_rows(self, main, row, column)
      self%band%value = 0.0_dp
      do i = 1, size(rhs)
         call add(i, i, main(i))
      end do
      do i = 1, self%n_entry
         if (self%is_idle(self%row(i))) cycle
         call add(self%n_unknown + self%row(i), self%column(i), real(self%value(i), dp))
         call add(self%column(i), self%n_unknown + self%row(i), real(self%value(i), dp))
      end do
      call band_blocks_factorise(self%band)
      y = 0.0_dp
      if (self%band%is_singular) return
      do pass = 0, n_refine
         call multiply(self, main, y, r)
         x(self%rank) = row*(rhs - r)
         call band_blocks_solve(self%band, .false., [1], x)
         y = y + column*x(self%rank)
      end do

   contains

      subroutine add(i, j, value)
         integer, intent(in) :: i, j
         real(dp), intent(in) :: value

         associate (slot => band_blocks_place(self%band, 1, self%rank(i), self%rank(j)))
            self%band%value(slot) = self%band%value(slot) + row(i)*value*column(j)
         end associate
      end subroutine add
   end subroutine solve_band

   pure subroutine find_diagonal(self, tie, main)
      type(balance_step_t), intent(in) :: self
      type(tie_balance_t), intent(in) :: tie
      real(dp), intent(out) :: main(:)
      integer :: i, n_z

      n_z = size(tie%column)
      main = 0.0_dp
      main(:n_z) = square_weight
      main(n_z + 1:n_z + 2*tie%n_row) = square_weight*real(move_weight, dp)
      do i = 5*tie%n_row + 1, self%n_condition
         main(self%n_unknown + i) = -diagonal*real(self%norm2(i), dp)
         if (self%is_idle(i)) main(self%n_unknown + i) = 1.0_dp
      end do
   end subroutine find_diagonal

   !> Powers of two that bring rows, then columns, to a largest entry in [1/2, 1).
   pure subroutine scale_rows(self, main, row, column)
      type(balance_step_t), intent(in) :: self
      real(dp), intent(in) :: main(:)
      real(dp), intent(out) :: row(:), column(:)
      real(dp) :: value
      integer :: i, j, k

      row = abs(main)
      do k = 1, self%n_entry
         if (self%is_idle(self%row(k))) cycle
         i = self%n_unknown + self%row(k)
         value = abs(real(self%value(k), dp))
         row(i) = max(row(i), value)
         row(self%column(k)) = max(row(self%column(k)), value)
      end do
      row = power_of_two(-exponent(row))
      column = row*abs(main)
      do k = 1, self%n_entry
         if (self%is_idle(self%row(k))) cycle
         i = self%n_unknown + self%row(k)
         j = self%column(k)
         value = abs(real(self%value(k), dp))
         column(j) = max(column(j), row(i)*value)
         column(i) = max(column(i), row(j)*value)
      end do
      column = power_of_two(-exponent(column))
   end subroutine scale_rows

   !> r = K y
   pure subroutine multiply(self, main, y, r)
      type(balance_step_t), intent(in) :: self
      real(dp), intent(in) :: main(:), y(:)
      real(dp), intent(out) :: r(:)
      integer :: i, j, k

      r = main*y
      do k = 1, self%n_entry
         if (self%is_idle(self%row(k))) cycle
         i = self%n_unknown + self%row(k)
         j = self%column(k)
         r(i) = r(i) + real(self%value(k), dp)*y(j)
         r(j) = r(j) + real(self%value(k), dp)*y(i)
      end do
   end subroutine multiply

   !> The band that the entries need, with all unknowns and conditions in the order of the chain.
   subroutine find_order(self, tie)
      type(balance_step_t), intent(inout) :: self
      type(tie_balance_t), intent(in) :: tie
      integer :: width

      allocate(self%rank(self%n_unknown + self%n_condition))
      call balance_order(tie, self%n_unknown, self%rank)
      width = maxval(abs(self%rank(self%n_unknown + self%row(:self%n_entry)) &
         - self%rank(self%column(:self%n_entry))))
      call band_blocks_init(self%band, [0, size(self%rank)], [width], [width])
   end subroutine find_order

end module emcon_tie_balance_step_plane
