!> Balanced ties: constant stress is in equilibrium across curved, unlike chains.
module test_tie_balance
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_tie_balance_plane, only : tie_balance, tie_balance_report_t
   implicit none
   private
   public :: collect_tie_balance

   !> Chains as the scene has them: slave nodes first, the chains against each other.
   type :: chains_t
      integer :: n_slave = 0, n_master = 0
      logical :: is_closed = .false.
      real(wp), allocatable :: t(:)              !! (n_node) curve parameter
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: slave_edge(:, :), master_edge(:, :)
      type(tie_rows_t) :: rows
   end type chains_t

   integer, parameter :: circle = 1, arc = 2, wave = 3, line = 4, bend = 5
   real(wp), parameter :: pi = acos(-1.0_wp)
   !> Round-off: solutions of some tens of unknowns, coordinates about tens of edges long.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

contains

   subroutine collect_tie_balance(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("closed chains pass the patch test", test_closed), &
         test_case_t("open chains pass the patch test", test_open), &
         test_case_t("a slave chain may end within master edges", test_part), &
         test_case_t("straight ties stay as they are", test_straight), &
         test_case_t("ends apart from each other are told", test_apart), &
         test_case_t("a power of two changes no bit", test_units)]
   end subroutine collect_tie_balance

   !> Chains of so many edges over `curve`, nodes off their even places by `wobble` of an edge.
   subroutine make_chains(curve, n_slave, n_master, is_dual, wobble, chains)
      integer, intent(in) :: curve, n_slave, n_master
      logical, intent(in) :: is_dual
      real(wp), intent(in) :: wobble
      type(chains_t), intent(out) :: chains
      integer :: i, n, n_s, n_m

      chains%is_closed = curve == circle
      n = merge(0, 1, chains%is_closed)
      n_s = n_slave + n
      n_m = n_master + n
      chains%n_slave = n_s
      chains%n_master = n_m
      allocate(chains%t(n_s + n_m), chains%x(2, n_s + n_m))
      allocate(chains%slave_edge(2, n_slave), chains%master_edge(2, n_master))
      do i = 0, n_s - 1
         chains%t(i + 1) = place(i, n_slave, 0.37_wp, chains%is_closed, wobble)
      end do
      do i = 0, n_m - 1
         chains%t(n_s + i + 1) = place(i, n_master, 0.0_wp, chains%is_closed, -wobble)
      end do
      do i = 1, n_s + n_m
         chains%x(:, i) = point(curve, chains%t(i))
      end do
      do i = 1, n_slave
         chains%slave_edge(:, i) = [i, 1 + mod(i, n_s)]
      end do
      do i = 1, n_master
         chains%master_edge(:, i) = n_s + [1 + mod(i, n_m), i]
      end do
      call make_rows(chains, is_dual)
   end subroutine make_chains

   !> Parameter of node i of an even chain of n edges, shifted along a closed one.
   pure real(wp) function place(i, n, shift, is_closed, wobble)
      integer, intent(in) :: i, n
      real(wp), intent(in) :: shift, wobble
      logical, intent(in) :: is_closed

      place = real(i, wp)
      if (is_closed .or. (i > 0 .and. i < n)) place = place + wobble*sin(7.0_wp*real(i + 1, wp))
      if (is_closed) place = place + shift
      place = place/real(n, wp)
   end function place

   pure function point(curve, t) result(x)
      integer, intent(in) :: curve
      real(wp), intent(in) :: t
      real(wp) :: x(2)

      select case (curve)
      case (circle)
         x = [cos(2.0_wp*pi*t), sin(2.0_wp*pi*t)]
      case (arc)
         x = 3.0_wp*[cos(0.3_wp + 1.5_wp*t), sin(0.3_wp + 1.5_wp*t)]
      case (wave)
         x = [t, 0.15_wp*sin(2.0_wp*pi*t)]
      case (bend)
         ! Half of it straight, inclined; then an arc that goes on in its direction.
         x = [min(t, 0.5_wp), 0.0_wp]
         if (t > 0.5_wp) x = [0.5_wp + sin(3.0_wp*t - 1.5_wp)/3.0_wp, &
            (1.0_wp - cos(3.0_wp*t - 1.5_wp))/3.0_wp]
         x = [0.8_wp*x(1) - 0.6_wp*x(2), 0.6_wp*x(1) + 0.8_wp*x(2)]
      case default
         x = [t, 0.3_wp*t]
      end select
   end function point

   !> Rows of the mortar integrals along the parameter; those of chain ends go to the neighbours.
   subroutine make_rows(chains, is_dual)
      type(chains_t), intent(inout) :: chains
      logical, intent(in) :: is_dual
      real(wp) :: g(chains%n_slave, chains%n_slave + chains%n_master)
      integer :: i, j, k, n, first, last

      g = 0.0_wp
      do i = 1, size(chains%slave_edge, 2)
         do j = 1, size(chains%master_edge, 2)
            do k = -1, 1
               call add_segment(chains, i, j, real(k, wp), is_dual, g)
            end do
         end do
      end do
      n = chains%n_slave
      first = 1
      last = n
      if (.not. chains%is_closed) then
         g(2, :) = g(2, :) + g(1, :)
         g(n - 1, :) = g(n - 1, :) + g(n, :)
         first = 2
         last = n - 1
      end if
      associate (rows => chains%rows)
         rows%slave = [(k, k = first, last)]
         allocate(rows%neighbour(2, last - first + 1))
         rows%neighbour(1, :) = [(k, k = 0, last - first)]
         rows%neighbour(2, :) = [(k, k = 2, last - first + 2)]
         rows%neighbour(2, last - first + 1) = 0
         if (chains%is_closed) rows%neighbour(1, 1) = n
         if (chains%is_closed) rows%neighbour(2, n) = 1
         allocate(rows%start(last - first + 2), source=0)
         allocate(rows%node(0), rows%weight(0), rows%size(0))
         do k = first, last
            rows%node = [rows%node, k]
            rows%weight = [rows%weight, g(k, k)]
            do j = 1, size(g, 2)
               if (j == k .or. .not. abs(g(k, j)) > 0.0_wp) cycle
               rows%node = [rows%node, j]
               rows%weight = [rows%weight, g(k, j)]
            end do
            rows%start(k - first + 2) = size(rows%node)
            rows%size = [rows%size, sum(g(k, :n))]
         end do
      end associate
   end subroutine make_rows

   !> int psi_k N_B and -int psi_k N_C over the part that slave edge i shares with master edge j.
   pure subroutine add_segment(chains, i, j, turn, is_dual, g)
      type(chains_t), intent(in) :: chains
      integer, intent(in) :: i, j
      real(wp), intent(in) :: turn               !! added to the parameter of the master edge
      logical, intent(in) :: is_dual
      real(wp), intent(inout) :: g(:, :)
      real(wp) :: s(2), m(2), low, high, xi, eta, psi(2), weight, length
      integer :: a, q

      s = chains%t(chains%slave_edge(:, i))
      m = chains%t(chains%master_edge([2, 1], j))
      if (s(2) < s(1)) s(2) = s(2) + 1.0_wp
      if (m(2) < m(1)) m(2) = m(2) + 1.0_wp
      m = m + turn
      low = max(s(1), m(1))
      high = min(s(2), m(2))
      if (high - low <= tol*(s(2) - s(1))) return
      length = norm2(chains%x(:, chains%slave_edge(2, i)) - chains%x(:, chains%slave_edge(1, i)))
      do q = -1, 1, 2
         xi = (0.5_wp*(low + high) + 0.5_wp*(high - low)*real(q, wp)/sqrt(3.0_wp) - s(1)) &
            /(s(2) - s(1))
         eta = (s(1) + xi*(s(2) - s(1)) - m(1))/(m(2) - m(1))
         weight = 0.5_wp*length*(high - low)/(s(2) - s(1))
         psi = [1.0_wp - xi, xi]
         if (is_dual) psi = [2.0_wp - 3.0_wp*xi, 3.0_wp*xi - 1.0_wp]
         do a = 1, 2
            associate (row => g(chains%slave_edge(a, i), :), edge => chains%master_edge(:, j))
               row(chains%slave_edge(1, i)) = row(chains%slave_edge(1, i)) &
                  + weight*psi(a)*(1.0_wp - xi)
               row(chains%slave_edge(2, i)) = row(chains%slave_edge(2, i)) + weight*psi(a)*xi
               row(edge(2)) = row(edge(2)) - weight*psi(a)*(1.0_wp - eta)
               row(edge(1)) = row(edge(1)) - weight*psi(a)*eta
            end associate
         end do
      end do
   end subroutine add_segment

   !> Dense matrix of the rows, and slave nodes moved to where the rows have them.
   subroutine relocate(error, chains, g, x)
      type(error_t), allocatable, intent(inout) :: error
      type(chains_t), intent(in) :: chains
      real(wp), intent(out) :: g(:, :)           !! (n_row, n_node)
      real(wp), intent(out) :: x(:, :)           !! (2, n_node)
      real(dp) :: y(size(g, 1), 2)
      integer :: i, k
      logical :: is_singular

      g = 0.0_wp
      do k = 1, size(g, 1)
         do i = chains%rows%start(k) + 1, chains%rows%start(k + 1)
            g(k, chains%rows%node(i)) = g(k, chains%rows%node(i)) + chains%rows%weight(i)
         end do
      end do
      x = chains%x
      do k = 1, 3
         ! What is missing, several times: dp is refined to wp.
         call dense_solve(real(g(:, chains%rows%slave), dp), real(matmul(g, transpose(x)), dp), y, &
            is_singular)
         call check_true(error, .not. is_singular, "the slave nodes follow")
         x(:, chains%rows%slave) = x(:, chains%rows%slave) - transpose(real(y, wp))
      end do
   end subroutine relocate

   !> Largest force out of balance for constant stress, per largest nodal force of the master side.
   subroutine find_unbalance(error, chains, share, unbalance)
      type(error_t), allocatable, intent(inout) :: error
      type(chains_t), intent(in) :: chains
      real(wp), intent(in) :: share(:, :)        !! (2, n_master edges) of each node; 0.5: all
      real(wp), intent(out) :: unbalance
      real(wp) :: g(size(chains%rows%slave), size(chains%t)), x(2, size(chains%t))
      real(wp) :: force(2, size(chains%t)), scale, a(2)
      real(dp) :: y(size(chains%rows%slave), 2)
      integer :: i, k
      logical :: is_singular

      call relocate(error, chains, g, x)
      force = 0.0_wp
      do i = 1, size(chains%master_edge, 2)
         a = x(:, chains%master_edge(2, i)) - x(:, chains%master_edge(1, i))
         do k = 1, 2
            associate (f => force(:, chains%master_edge(k, i)))
               f = f + share(k, i)*a
            end associate
         end do
      end do
      scale = maxval(abs(force))
      do i = 1, size(chains%slave_edge, 2)
         a = x(:, chains%slave_edge(2, i)) - x(:, chains%slave_edge(1, i))
         do k = 1, 2
            associate (f => force(:, chains%slave_edge(k, i)))
               f = f + 0.5_wp*a
            end associate
         end do
      end do
      ! Multipliers that carry the forces of the slave nodes take them off all nodes.
      do k = 1, 3
         call dense_solve(real(transpose(g(:, chains%rows%slave)), dp), &
            real(transpose(force(:, chains%rows%slave)), dp), y, is_singular)
         force = force - matmul(transpose(real(y, wp)), g)
      end do
      unbalance = maxval(abs(force))/scale
   end subroutine find_unbalance

   !> Balance one tie and look at it from outside.
   subroutine check_balance(error, curve, n_slave, n_master, wobble, what)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: curve, n_slave, n_master
      real(wp), intent(in) :: wobble
      character(len=*), intent(in) :: what
      type(chains_t) :: chains
      type(tie_balance_report_t) :: report
      type(error_t), allocatable :: raised
      real(wp), allocatable :: before(:, :), after(:, :), g(:, :), share(:, :)
      real(wp) :: unbalance
      integer :: k, pass

      do pass = 1, 2
         call make_chains(curve, n_slave, n_master, pass == 1, wobble, chains)
         if (allocated(before)) deallocate(before, after, g, share)
         allocate(g(size(chains%rows%slave), size(chains%t)))
         allocate(before(2, size(chains%t)), after(2, size(chains%t)))
         allocate(share(2, n_master), source=0.5_wp)
         call relocate(error, chains, g, before)
         call find_unbalance(error, chains, share, unbalance)
         call tie_balance(chains%rows, chains%x, chains%slave_edge, chains%master_edge, report, &
            raised)
         call check_true(error, .not. allocated(raised), what // ": no error")
         call check_near(error, real(report%before, wp), unbalance, tol, 1.0_wp, &
            what // ": found before")
         call check_true(error, report%is_balanced, what // ": balanced")
         call check_true(error, report%is_changed .or. unbalance <= tol, what // ": changed")
         call find_unbalance(error, chains, share, unbalance)
         call check_near(error, unbalance, 0.0_wp, tol, 1.0_wp, what // ": left")
         call relocate(error, chains, g, after)
         do k = 1, size(g, 1)
            call check_near(error, sum(g(k, :)), 0.0_wp, tol, chains%rows%size(k), &
               what // ": row sum")
            call check_equal(error, chains%rows%node(chains%rows%start(k) + 1), &
               chains%rows%slave(k), what // ": slave node first")
         end do
         ! Far below an edge: the rows stay close to the mortar integrals.
         call check_near(error, after, before, 0.1_wp, minval(chains%rows%size), &
            what // ": moves")
      end do
   end subroutine check_balance

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error

      call check_balance(error, circle, 16, 16, 0.1_wp, "16:16")
      call check_balance(error, circle, 16, 24, 0.0_wp, "16:24")
      call check_balance(error, circle, 48, 32, 0.2_wp, "48:32")
      call check_balance(error, circle, 8, 80, 0.1_wp, "8:80")
      call check_balance(error, circle, 80, 8, 0.2_wp, "80:8")
   end subroutine test_closed

   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error

      call check_balance(error, arc, 12, 18, 0.1_wp, "12:18")
      call check_balance(error, arc, 40, 60, 0.2_wp, "40:60")
      call check_balance(error, arc, 60, 6, 0.2_wp, "60:6")
      call check_balance(error, wave, 12, 18, 0.0_wp, "wave 12:18")
      call check_balance(error, wave, 18, 12, 0.2_wp, "wave 18:12")
      call check_balance(error, wave, 10, 100, 0.2_wp, "wave 10:100")
      call check_balance(error, bend, 20, 30, 0.1_wp, "bend 20:30")
      call check_balance(error, bend, 30, 20, 0.2_wp, "bend 30:20")
      call check_balance(error, bend, 60, 6, 0.2_wp, "bend 60:6")
      call check_balance(error, bend, 6, 60, 0.2_wp, "bend 6:60")
   end subroutine test_open

   !> The slave chain covers the master chain but a part of its first and its last edge.
   subroutine test_part(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(chains_t) :: chains
      type(tie_balance_report_t) :: report
      real(wp) :: share(2, 15), unbalance
      integer :: pass
      real(wp), parameter :: part = 0.25_wp

      do pass = 1, 2
         call make_chains(arc, 10, 15, pass == 1, 0.1_wp, chains)
         deallocate(chains%rows%neighbour, chains%rows%start, chains%rows%node, &
            chains%rows%weight, chains%rows%size)
         associate (s => chains%n_slave)
            chains%t(1) = part*chains%t(s + 2)
            chains%x(:, 1) = (1.0_wp - part)*chains%x(:, s + 1) + part*chains%x(:, s + 2)
            chains%t(s) = part*chains%t(s + 15) + (1.0_wp - part)*chains%t(s + 16)
            chains%x(:, s) = part*chains%x(:, s + 15) + (1.0_wp - part)*chains%x(:, s + 16)
         end associate
         call make_rows(chains, pass == 1)
         ! int N over the part of an edge from `part` to 1: near the cut node, and the other.
         share = 0.5_wp
         share(2, 1) = 0.5_wp*(1.0_wp - part)**2
         share(1, 1) = 0.5_wp*(1.0_wp - part**2)
         share(1, 15) = share(2, 1)
         share(2, 15) = share(1, 1)
         call tie_balance(chains%rows, chains%x, chains%slave_edge, chains%master_edge, report, &
            raised)
         call check_true(error, .not. allocated(raised), "no error")
         call check_true(error, report%is_balanced .and. report%is_changed, "balanced")
         call find_unbalance(error, chains, share, unbalance)
         call check_near(error, unbalance, 0.0_wp, tol, 1.0_wp, "left")
      end do
   end subroutine test_part

   subroutine test_straight(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(chains_t) :: chains
      type(tie_rows_t) :: before
      type(tie_balance_report_t) :: report
      integer :: pass

      do pass = 1, 2
         call make_chains(line, 12, 17, pass == 1, 0.2_wp, chains)
         before = chains%rows
         call tie_balance(chains%rows, chains%x, chains%slave_edge, chains%master_edge, report, &
            raised)
         call check_true(error, .not. allocated(raised), "no error")
         call check_true(error, report%is_balanced .and. .not. report%is_changed, "left alone")
         call check_equal(error, chains%rows%node, before%node, "nodes")
         call check_near(error, chains%rows%weight, before%weight, 0.0_wp, 1.0_wp, "weights")
      end do
   end subroutine test_straight

   !> Chords of unlike length cannot be in equilibrium.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(chains_t) :: chains
      type(tie_rows_t) :: before
      type(tie_balance_report_t) :: report

      call make_chains(arc, 12, 18, .true., 0.1_wp, chains)
      chains%x(:, 1) = 1.01_wp*chains%x(:, 1)
      before = chains%rows
      call tie_balance(chains%rows, chains%x, chains%slave_edge, chains%master_edge, report, raised)
      call check_true(error, .not. allocated(raised), "no error")
      call check_true(error, .not. report%is_balanced .and. .not. report%is_changed, "told")
      call check_true(error, real(report%after, wp) > tol, "the residual stands")
      call check_near(error, chains%rows%weight, before%weight, 0.0_wp, 1.0_wp, "weights")
   end subroutine test_apart

   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(chains_t) :: chains(2)
      type(tie_balance_report_t) :: report
      real(wp), parameter :: factor = 2.0_wp**(-20)
      integer :: k

      do k = 1, 2
         call make_chains(wave, 12, 18, .true., 0.1_wp, chains(k))
      end do
      chains(2)%x = factor*chains(1)%x
      chains(2)%rows%weight = factor*chains(1)%rows%weight
      chains(2)%rows%size = factor*chains(1)%rows%size
      do k = 1, 2
         call tie_balance(chains(k)%rows, chains(k)%x, chains(k)%slave_edge, &
            chains(k)%master_edge, report, raised)
         call check_true(error, .not. allocated(raised) .and. report%is_changed, "balanced")
      end do
      call check_near(error, chains(2)%rows%weight, factor*chains(1)%rows%weight, 0.0_wp, &
         1.0_wp, "weights")
   end subroutine test_units

end module test_tie_balance
