!> Ties over curved interfaces that pass the patch test.
!>
!> Where two unlike polygons stand for one curve, the mortar integrals keep linear displacements but
!> not the equilibrium of a constant stress: the multipliers that balance the slave side leave a
!> residual at the master nodes. `tie_balance` changes the integrals M, D stands, by the least
!> that removes it: row sums stay, slave nodes follow from D X_s = M X_m, and D^T L = s_s,
!> M^T L = s_g hold to round-off (emcon_tie_balance_data_plane). Newton's method on M, X_s and L;
!> where the residual is round-off from the start, as on straight interfaces, nothing is touched.
!> All of it in double precision at least; the rows are rounded at the end.
!>
!> The ends of an open slave chain should have no row, and lie on the master chain: the multipliers
!> of the chain end belong to their neighbours then. An end with a row keeps equilibrium only by
!> large entries. At a corner of several ties each tie is in equilibrium by itself.
module emcon_tie_balance_plane
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, hp, wp
   use emcon_tie_balance_data_plane, only : tie_balance_free, tie_balance_init, &
      tie_balance_residual, tie_balance_t
   use emcon_tie_balance_step_plane, only : balance_step_do, balance_step_init, balance_step_t
   implicit none
   private
   public :: tie_balance_report_t, tie_balance, tie_is_balanced

   !> What became of the rows. Residuals: out of balance, per largest nodal force of the master
   !> side, under any constant stress.
   type :: tie_balance_report_t
      real(hp) :: before = 0.0_hp
      real(hp) :: after = 0.0_hp             !! of the rows returned
      integer :: n_step = 0
      logical :: is_balanced = .false.       !! if not, the rows are as they were
      logical :: is_changed = .false.
   end type tie_balance_report_t

   !> Round-off of a nodal force per coordinate over edge; steps are solved in dp.
   real(hp), parameter :: round_off = &
      32.0_hp*real(max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), hp)
   !> Weak conditions may halve their residual only, once a step. And so many steps in vain.
   integer, parameter :: max_steps = 100, max_stall = 8
   !> Largest sum of the changes of M in a row, per int psi_k, that a step may make. The rows of a
   !> chain end change by about 1; where balance cannot be had, changes are far larger.
   real(hp), parameter :: max_change = 8.0_hp
   !> Places on a master edge that are nearer, per its length, are one.
   real(hp), parameter :: apart = sqrt(real(epsilon(1.0_wp), hp))

contains

   !> Balance `rows`. Rows with D singular or master edges without entries are the caller's error.
   subroutine tie_balance(rows, x, slave_edge, master_edge, report, error)
      type(tie_rows_t), intent(inout) :: rows
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) positions [L]
      integer, intent(in) :: slave_edge(:, :)    !! (2, n) first and last node, body to the left
      integer, intent(in) :: master_edge(:, :)   !! (2, n) likewise
      type(tie_balance_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(tie_balance_t) :: tie
      real(hp) :: cover(2, size(master_edge, 2))

      if (size(rows%slave) == 0) return
      call find_cover(rows, real(x, hp), slave_edge, master_edge, cover)
      call tie_balance_init(tie, rows, real(x, hp), slave_edge, master_edge, cover, error)
      if (.not. allocated(error)) call tie_balance_residual(tie, report%before, error)
      if (.not. allocated(error)) call improve(tie, report, error)
      if (.not. allocated(error) .and. report%is_changed) call rebuild_rows(rows, tie)
      call tie_balance_free(tie)
   end subroutine tie_balance

   !> Are `rows` in balance as they are, up to round-off?
   subroutine tie_is_balanced(rows, x, slave_edge, master_edge, is_balanced, error)
      type(tie_rows_t), intent(in) :: rows
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) positions [L]
      integer, intent(in) :: slave_edge(:, :), master_edge(:, :)   !! (2, n)
      logical, intent(out) :: is_balanced
      type(error_t), allocatable, intent(out) :: error
      type(tie_balance_t) :: tie
      real(hp) :: cover(2, size(master_edge, 2)), residual

      call find_cover(rows, real(x, hp), slave_edge, master_edge, cover)
      call tie_balance_init(tie, rows, real(x, hp), slave_edge, master_edge, cover, error)
      if (.not. allocated(error)) call tie_balance_residual(tie, residual, error)
      is_balanced = .false.
      if (.not. allocated(error)) is_balanced = residual <= tolerance_of(tie)
      call tie_balance_free(tie)
   end subroutine tie_is_balanced

   !> Residuals below this are round-off.
   pure real(hp) function tolerance_of(tie)
      type(tie_balance_t), intent(in) :: tie

      tolerance_of = round_off*max(maxval(abs(tie%x_other)), maxval(abs(tie%x))) &
         /min(minval(tie%size), tie%force)
   end function tolerance_of

   !> Newton steps until the residual is round-off and falls no more.
   subroutine improve(tie, report, error)
      type(tie_balance_t), intent(inout) :: tie
      type(tie_balance_report_t), intent(inout) :: report
      type(error_t), allocatable, intent(out) :: error
      type(balance_step_t) :: step
      real(hp) :: best(size(tie%m_value)), tolerance, last, now, change
      integer :: i, n_stall

      tolerance = tolerance_of(tie)
      report%after = report%before
      report%is_balanced = report%before <= tolerance
      if (report%is_balanced) return
      call balance_step_init(step, tie)
      best = tie%m_value
      last = report%before
      n_stall = 0
      do i = 1, max_steps
         call balance_step_do(step, tie, change)
         if (.not. (change >= 0.0_hp .and. change <= max_change)) exit
         call tie_balance_residual(tie, now, error)
         if (allocated(error)) return
         report%n_step = i
         n_stall = n_stall + 1
         if (now < report%after) then
            if (now < 0.9_hp*report%after) n_stall = 0
            report%after = now
            best = tie%m_value
         end if
         if (report%after <= tolerance .and. .not. now < 0.5_hp*last) exit
         if (n_stall > max_stall) exit
         last = now
      end do
      report%is_balanced = report%after <= tolerance
      report%is_changed = report%is_balanced
      if (.not. report%is_balanced) report%after = report%before
      tie%m_value = best
   end subroutine improve

   !> The integrals of both shape functions over the part of each master edge that the slave chains
   !> cover, per length of the edge: both nodes are in the rows, and the ends of the slave chains,
   !> which run the other way, bound it. An edge may lie under the ends of two chains.
   pure subroutine find_cover(rows, x, slave_edge, master_edge, cover)
      type(tie_rows_t), intent(in) :: rows
      real(hp), intent(in) :: x(:, :)
      integer, intent(in) :: slave_edge(:, :), master_edge(:, :)
      real(hp), intent(out) :: cover(:, :)
      logical :: is_met(size(x, 2))
      real(hp) :: outmost(2, size(master_edge, 2))   !! last place where covering begins, ends
      integer :: e, i, side, node
      real(hp) :: place

      is_met = .false.
      is_met(rows%node) = .true.
      cover = 0.0_hp
      outmost = -1.0_hp
      do i = 1, size(slave_edge, 2)
         do side = 1, 2
            node = slave_edge(side, i)
            if (any(slave_edge(3 - side, :) == node)) cycle
            call project(x, master_edge, is_met, x(:, node), e, place)
            if (e == 0) cycle
            cover(:, e) = cover(:, e) + merge(1.0_hp, -1.0_hp, side == 1)*up_to(place)
            outmost(3 - side, e) = max(outmost(3 - side, e), place)
         end do
      end do
      do i = 1, size(master_edge, 2)
         if (.not. all(is_met(master_edge(:, i)))) cycle
         if (outmost(2, i) > max(0.0_hp, outmost(1, i)) + apart) cycle
         cover(:, i) = cover(:, i) + up_to(1.0_hp)
      end do
      where (spread(sum(cover, 1) <= apart, 1, 2)) cover = 0.0_hp
   end subroutine find_cover

   !> The integrals of 1 - eta and eta from 0 to `place`.
   pure function up_to(place)
      real(hp), intent(in) :: place              !! 0..1
      real(hp) :: up_to(2)

      up_to = place*[1.0_hp - 0.5_hp*place, 0.5_hp*place]
   end function up_to

   !> The covered master edge next to `point`, the first of equals, and the place on it, 0..1.
   pure subroutine project(x, master_edge, is_met, point, nearest, place)
      real(hp), intent(in) :: x(:, :), point(2)
      integer, intent(in) :: master_edge(:, :)
      logical, intent(in) :: is_met(:)           !! (n_node)
      integer, intent(out) :: nearest            !! 0: there is none
      real(hp), intent(out) :: place
      real(hp) :: a(2), b(2), xi, distance, least
      integer :: i

      nearest = 0
      place = 0.0_hp
      least = huge(1.0_hp)
      do i = 1, size(master_edge, 2)
         if (.not. all(is_met(master_edge(:, i)))) cycle
         a = x(:, master_edge(2, i)) - x(:, master_edge(1, i))
         b = point - x(:, master_edge(1, i))
         xi = max(0.0_hp, min(1.0_hp, dot_product(a, b)/dot_product(a, a)))
         distance = norm2(b - xi*a)
         if (distance >= least) cycle
         least = distance
         nearest = i
         place = xi
      end do
   end subroutine project

   !> Write the matrices back: first the slave nodes of the row, then all others.
   pure subroutine rebuild_rows(rows, tie)
      type(tie_rows_t), intent(inout) :: rows
      type(tie_balance_t), intent(in) :: tie
      integer, allocatable :: node(:)
      real(wp), allocatable :: weight(:)
      integer :: i, j, k, n

      allocate(node(size(tie%d_value) + size(tie%m_value)))
      allocate(weight(size(node)))
      n = 0
      j = 0
      do k = 1, tie%n_row
         rows%start(k) = n
         do while (j < size(tie%d_row))
            if (tie%d_row(j + 1) /= k) exit
            j = j + 1
            n = n + 1
            node(n) = rows%slave(tie%d_column(j))
            weight(n) = real(tie%d_value(j), wp)
         end do
         do i = tie%start(k) + 1, tie%start(k + 1)
            if (tie%m_value(i) == 0.0_hp) cycle
            n = n + 1
            node(n) = tie%other(tie%column(i))
            weight(n) = -real(tie%m_value(i), wp)
         end do
      end do
      rows%start(tie%n_row + 1) = n
      rows%node = node(:n)
      rows%weight = weight(:n)
   end subroutine rebuild_rows

end module emcon_tie_balance_plane
