!> The constraint rows of a tie: the mortar integrals D and M of two surfaces in the reference
!> configuration, over exact segments.
!>
!> D_AB = int psi_A N_B dA over slave nodes, M_AC = int psi_A N_C dA over master nodes, with the
!> standard (psi = N) or the dual multiplier basis of each slave node. Source: docs/theory.md,
!> eqs. (15b) and (27).
module emcon_tie_plane
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : error_t
   use emcon_gauss, only : gauss_points
   use emcon_interactions, only : multiplier_dual
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : frame_hit, frame_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, sort_order
   use emcon_tie_check_plane, only : tie_check_partners, tie_check_surfaces
   use emcon_tie_cover_plane, only : tie_cover_find
   use emcon_tie_partner_plane, only : polygon, tie_partners_find, tie_partners_frame, &
      tie_partners_t
   implicit none
   private
   public :: tie_measure

   !> Gauss points on a segment. Where both surfaces are straight, psi times a shape function is a
   !> quadratic and two are exact. Elsewhere the place on the master is a quotient; the integrals
   !> are made once, so the third costs nothing.
   integer, parameter :: n_point = 3
   !> A sum of the few terms of an entry that is 0 in exact arithmetic stays below this, per weight
   !> of its row: nodes that stand opposite each other are tied one to one.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)

contains

   !> The rows of `tie`, one for each slave node. Only reference positions are looked at.
   !>
   !> Errors: surfaces of nodes, or with a node in common; slave nodes without partner within the
   !> tolerance; holes in the master surface.
   subroutine tie_measure(scene, tie, rows, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_rows_t), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      type(tie_partners_t) :: partners
      real(wp), allocatable :: moment(:, :, :)

      partners%tolerance = tie%tolerance
      call chain_init(partners%slave, scene, scene%surface(tie%slave), error)
      if (.not. allocated(error)) call chain_init(partners%master, scene, &
         scene%surface(tie%master), error)
      if (.not. allocated(error)) call tie_check_surfaces(scene, tie, partners, error)
      if (allocated(error)) return
      call tie_partners_find(partners, scene%x)
      call tie_check_partners(scene, tie, partners, error)
      if (allocated(error)) return
      call measure_segments(partners, scene%x, tie%multiplier == multiplier_dual, moment)
      call order_rows(partners%slave, rows)
      call fill_rows(partners, tie%multiplier == multiplier_dual, moment, rows)
      call tie_cover_find(partners, scene%x, rows)
   end subroutine tie_measure

   !> Integrals of psi times a master shape function over each segment.
   pure subroutine measure_segments(partners, x, is_dual, moment)
      type(tie_partners_t), intent(in) :: partners
      real(wp), intent(in), contiguous :: x(:, :)            !! (2, n_node of the scene) [L]
      logical, intent(in) :: is_dual
      real(wp), allocatable, intent(out) :: moment(:, :, :)  !! (2 master nodes, 2 psi, n_segment)
      type(frame_t) :: frame
      real(wp), allocatable :: still(:, :)
      real(wp) :: point(n_point), weight(n_point), xi, eta, gap, psi(2), area
      integer :: e, k, i

      call gauss_points(point, weight)
      allocate(still(size(x, 1), size(x, 2)), source=0.0_wp)
      allocate(moment(2, 2, partners%start(size(partners%start)) - 1), source=0.0_wp)
      do e = 1, partners%slave%n_facet
         do k = partners%start(e), partners%start(e + 1) - 1
            call tie_partners_frame(partners, e, partners%edge(k), x, still, frame)
            associate (low => partners%ends(1, k), high => partners%ends(2, k))
               do i = 1, n_point
                  xi = low + (high - low)*point(i)
                  call frame_hit(frame, polygon, xi, eta, gap)
                  eta = max(0.0_wp, min(1.0_wp, eta))
                  psi = [1.0_wp - xi, xi]
                  if (is_dual) psi = [2.0_wp - 3.0_wp*xi, 3.0_wp*xi - 1.0_wp]
                  area = weight(i)*(high - low)*frame%length
                  moment(1, :, k) = moment(1, :, k) + area*(1.0_wp - eta)*psi
                  moment(2, :, k) = moment(2, :, k) + area*eta*psi
               end do
            end associate
         end do
      end do
   end subroutine measure_segments

   !> Slave nodes in the order of the chains, and their neighbours.
   pure subroutine order_rows(slave, rows)
      type(chain_t), intent(in) :: slave
      type(tie_rows_t), intent(inout) :: rows
      integer :: edge_at(slave%n_facet), p, i, first, n

      do i = 1, slave%n_facet
         edge_at(slave%place(i)) = i
      end do
      allocate(rows%slave(size(slave%node)))
      allocate(rows%neighbour(2, size(slave%node)), source=0)
      n = 0
      do p = 1, size(slave%is_closed)
         first = n + 1
         do i = slave%start(p), slave%start(p + 1) - 1
            n = n + 1
            rows%slave(n) = slave%facet(1, edge_at(i))
         end do
         if (.not. slave%is_closed(p)) then
            n = n + 1
            rows%slave(n) = slave%facet(2, edge_at(slave%start(p + 1) - 1))
         end if
         do i = first, n
            if (i > first) rows%neighbour(1, i) = i - 1
            if (i < n) rows%neighbour(2, i) = i + 1
         end do
         if (.not. slave%is_closed(p)) cycle
         rows%neighbour(1, first) = n
         rows%neighbour(2, n) = first
      end do
   end subroutine order_rows

   !> The entries of all rows.
   pure subroutine fill_rows(partners, is_dual, moment, rows)
      type(tie_partners_t), intent(in) :: partners
      logical, intent(in) :: is_dual
      real(wp), intent(in) :: moment(:, :, :)
      type(tie_rows_t), intent(inout) :: rows
      integer :: k, n, n_row

      n_row = size(rows%slave)
      n = 3*n_row + 4*size(moment, 3)
      allocate(rows%start(n_row + 1), rows%size(n_row), rows%node(n), rows%weight(n))
      n = 0
      do k = 1, n_row
         rows%start(k) = n
         call fill_row(partners, is_dual, moment, k, rows, n)
      end do
      rows%start(n_row + 1) = n
      rows%node = rows%node(:n)
      rows%weight = rows%weight(:n)
   end subroutine fill_rows

   !> Append row `k`: its slave node, neighbours of that, and master nodes in ascending order.
   !>
   !> As slave edges are covered as a whole, D_AB = l/6 needs no quadrature, and int psi_A is what
   !> the master entries add up to. The weight of the slave node itself is what the others leave,
   !> added up from the end: summed up in that order the row is 0 exactly.
   pure subroutine fill_row(partners, is_dual, moment, k, rows, n)
      type(tie_partners_t), intent(in) :: partners
      logical, intent(in) :: is_dual
      real(wp), intent(in) :: moment(:, :, :)
      integer, intent(in) :: k
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(inout) :: n                !! entries so far
      integer :: beside(2), side, e, i, i_self

      associate (slave => partners%slave)
         beside = slave%node_edge(:, find_sorted(slave%node, rows%slave(k)))
         n = n + 1
         i_self = n
         rows%node(i_self) = rows%slave(k)
         rows%size(k) = 0.0_wp
         do side = 1, 2
            e = beside(side)
            if (e == 0) cycle
            rows%size(k) = rows%size(k) + 0.5_wp*slave%size(e)
            if (is_dual) cycle
            n = n + 1
            rows%node(n) = slave%facet(side, e)
            rows%weight(n) = slave%size(e)/6.0_wp
         end do
      end associate
      call add_masters(partners, moment, beside, rounding*rows%size(k), rows, n)
      rows%weight(i_self) = 0.0_wp
      do i = n, i_self + 1, -1
         rows%weight(i_self) = rows%weight(i_self) - rows%weight(i)
      end do
   end subroutine fill_row

   !> Append -M over the edges `beside` a slave node, equal nodes merged, ascending.
   pure subroutine add_masters(partners, moment, beside, negligible, rows, n)
      type(tie_partners_t), intent(in) :: partners
      real(wp), intent(in) :: moment(:, :, :)
      integer, intent(in) :: beside(2)           !! edges that end and begin at the node; 0: none
      real(wp), intent(in) :: negligible         !! [L]
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(inout) :: n
      integer, allocatable :: node(:), order(:)
      real(wp), allocatable :: weight(:)
      real(wp) :: total
      integer :: side, s, m, i

      m = 0
      do side = 1, 2
         if (beside(side) > 0) m = m + 2*(partners%start(beside(side) + 1) &
            - partners%start(beside(side)))
      end do
      allocate(node(m), weight(m))
      m = 0
      do side = 1, 2
         if (beside(side) == 0) cycle
         do s = partners%start(beside(side)), partners%start(beside(side) + 1) - 1
            node(m + 1:m + 2) = partners%master%facet(:, partners%edge(s))
            weight(m + 1:m + 2) = moment(:, 3 - side, s)
            m = m + 2
         end do
      end do
      order = sort_order(node)
      total = 0.0_wp
      do i = 1, m
         total = total - weight(order(i))
         if (i < m) then
            if (node(order(i + 1)) == node(order(i))) cycle
         end if
         if (abs(total) > negligible) then
            n = n + 1
            rows%node(n) = node(order(i))
            rows%weight(n) = total
         end if
         total = 0.0_wp
      end do
   end subroutine add_masters

end module emcon_tie_plane
