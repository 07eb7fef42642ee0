!> What a slave edge gives to the constraints of its two nodes: integrals over its covered part.
!>
!> Source: docs/theory.md, eqs. (15) and (15b).
module emcon_edge_moments
   use emcon_condition_nodes, only : condition_resize, nodes_append
   use emcon_constraint, only : condition_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_dgrad_wide, only : wide_add, wide_add_product, wide_clear, wide_t
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : moment_area, moment_area_xi, moment_cover, moment_gap, &
      moment_gap_xi, n_moment
   use emcon_sort, only : sort_few
   implicit none
   private
   public :: edge_moments_t, gap_integral_t, form_begin, form_share, form_constraint

   !> Covered but for round-off: the dual basis needs no care.
   real(wp), parameter :: whole = 256.0_wp*epsilon(1.0_wp)

   type :: edge_moments_t
      real(wp) :: value(n_moment, 0:1) = 0.0_wp  !! the moments at both ends of the step
      !> Lowest gap at the start, on the line of the master edge, of what only the end covers [L].
      real(wp) :: ahead = 0.0_wp
      real(wp) :: other_size = huge(1.0_wp)      !! shortest master edge that covers some of it [L]
      integer :: n_node = 0
      integer :: n_slave = 0                     !! they come first, the edge's own two before
      integer, allocatable :: node(:)            !! (>= n_node)
      type(wide_t) :: moment(n_moment)           !! over the coordinates of nodes 2 to n_node
   end type edge_moments_t

   !> Which weighted gap a constraint holds: that of one slave node.
   type :: gap_integral_t
      integer :: node = 0                        !! of the scene
      integer :: edge(2) = 0                     !! that ends there, that begins there; 0: none
      logical :: is_dual = .true.                !! else the standard basis
      real(wp) :: target = 0.0_wp                !! mean gap to hold [L]
      real(wp) :: scale = 1.0_wp                 !! > 0 [L^2]
   end type gap_integral_t

contains

   !> Begin to sum moments over the nodes `node`.
   pure subroutine form_begin(self, node, n_slave, leaves_second)
      type(edge_moments_t), intent(inout) :: self
      integer, intent(in) :: node(:)             !! (n) distinct, slave nodes first
      integer, intent(in) :: n_slave             !! number of these
      logical, intent(in) :: leaves_second       !! without second derivatives
      integer :: i

      if (allocated(self%node)) then
         if (size(self%node) < size(node)) deallocate(self%node)
      end if
      if (.not. allocated(self%node)) allocate(self%node(size(node)))
      self%n_node = size(node)
      self%n_slave = n_slave
      self%node(:self%n_node) = node
      ! Sums over nodes do not depend on which pair came first.
      call sort_few(self%node(3:n_slave))
      call sort_few(self%node(n_slave + 1:self%n_node))
      do i = 1, n_moment
         call wide_clear(self%moment(i), 2*(self%n_node - 1), leaves_second)
      end do
   end subroutine form_begin

   !> Share of the edge's node `side` (1, 2) in the weighted gap and the covered area, at both ends.
   !>
   !> The weight is N_1 + theta (N_1 - N_2) or N_2 - theta (N_1 - N_2): theta = 1 is the dual basis,
   !> 0 the standard one. Where the edge is covered in part, theta is the square of the part, so
   !> that the integral of a weight is never negative: docs/theory.md, eqs. (15b) to (15d).
   pure subroutine form_share(self, side, is_dual, gap, area)
      type(edge_moments_t), intent(in) :: self
      integer, intent(in) :: side                !! 1: first node of the edge, 2: last
      logical, intent(in) :: is_dual             !! else the standard basis
      real(wp), intent(out) :: gap(0:1)          !! at start and end [L^3]
      real(wp), intent(out) :: area(0:1)         !! at start and end [L^2]
      real(wp) :: theta(0:1)

      theta = merge(self%value(moment_cover, :)**2, 0.0_wp, is_dual)
      gap = share(self%value(moment_gap, :), self%value(moment_gap_xi, :))
      area = share(self%value(moment_area, :), self%value(moment_area_xi, :))

   contains

      pure function share(full, xi) result(part)
         real(wp), intent(in) :: full(0:1), xi(0:1)
         real(wp) :: part(0:1)

         if (side == 1) then
            part = (full - xi) + theta*(full - 2.0_wp*xi)
         else
            part = xi - theta*(full - 2.0_wp*xi)
         end if
      end function share

   end subroutine form_share

   !> The constraint (Phi - target W)/scale of a slave node: docs/theory.md, eq. (15).
   pure subroutine form_constraint(form, gap, work, item)
      type(edge_moments_t), intent(in) :: form(:) !! (n_edge) of the slave side
      type(gap_integral_t), intent(in) :: gap
      type(wide_t), intent(inout) :: work(3)     !! work space
      type(condition_t), intent(inout) :: item
      integer :: list(1 + sum(form(pack(gap%edge, gap%edge > 0))%n_node)), n, k, i
      integer :: place(size(list))

      list(1) = gap%node
      n = 1
      do k = 1, 2
         if (gap%edge(k) == 0) cycle
         associate (edge => form(gap%edge(k)))
            call nodes_append(edge%node(:edge%n_slave), list, n)
         end associate
      end do
      item%n_slave = n
      do k = 1, 2
         if (gap%edge(k) == 0) cycle
         associate (edge => form(gap%edge(k)))
            call nodes_append(edge%node(edge%n_slave + 1:edge%n_node), list, n)
         end associate
      end do
      call condition_resize(item, n)
      item%node(:n) = list(:n)
      item%gap0 = 0.0_wp
      item%gap1 = 0.0_wp
      item%dgap = 0.0_wp
      item%g = 0.0_wp
      item%c = 0.0_wp
      if (.not. item%leaves_second) item%h = 0.0_wp
      do k = 1, 2
         if (gap%edge(k) == 0) cycle
         associate (edge => form(gap%edge(k)))
            call weighted(edge, 3 - k, gap%is_dual, gap%target, work(1), work(2), work(3))
            do i = 1, edge%n_node
               place(i) = findloc(list(:n), edge%node(i), 1)
            end do
            call add(work(1), place(:edge%n_node), 1.0_wp/gap%scale, item)
         end associate
      end do
   end subroutine form_constraint

   !> Share of node `side` in Phi - target W.
   pure subroutine weighted(edge, side, is_dual, target, part, skew, theta)
      type(edge_moments_t), intent(in) :: edge
      integer, intent(in) :: side
      logical, intent(in) :: is_dual
      real(wp), intent(in) :: target
      type(wide_t), intent(inout) :: part
      type(wide_t), intent(inout) :: skew, theta         !! work space
      real(wp) :: sign_skew

      associate (moment => edge%moment, n => 2*(edge%n_node - 1), &
            leaves_second => edge%moment(1)%n_second == 0)
         call wide_clear(part, n, leaves_second)
         call wide_clear(skew, n, leaves_second)
         call wide_add(skew, 1.0_wp, moment(moment_gap))
         call wide_add(skew, -2.0_wp, moment(moment_gap_xi))
         call wide_add(skew, -target, moment(moment_area))
         call wide_add(skew, 2.0_wp*target, moment(moment_area_xi))
         call wide_add(part, 1.0_wp, moment(moment_gap_xi))
         call wide_add(part, -target, moment(moment_area_xi))
         if (side == 1) call wide_add(part, 1.0_wp, skew)
         if (.not. is_dual) return
         sign_skew = merge(1.0_wp, -1.0_wp, side == 1)
         if (all(abs([moment(moment_cover)%f0, moment(moment_cover)%f1] - 1.0_wp) <= whole)) then
            call wide_add(part, sign_skew, skew)
         else
            call wide_clear(theta, n, leaves_second)
            call wide_add_product(theta, 1.0_wp, moment(moment_cover), moment(moment_cover))
            call wide_add_product(part, sign_skew, theta, skew)
         end if
      end associate
   end subroutine weighted

   !> Add `factor` times `part`, whose nodes are at `place`, to a constraint.
   pure subroutine add(part, place, factor, item)
      type(wide_t), intent(in) :: part
      integer, intent(in) :: place(:)
      real(wp), intent(in) :: factor
      type(condition_t), intent(inout) :: item

      item%gap0 = item%gap0 + factor*part%f0
      item%gap1 = item%gap1 + factor*part%f1
      item%dgap = item%dgap + factor*part%df
      call nodes_add_first(factor, part%g, place, item%g)
      call nodes_add_first(factor, part%c, place, item%c)
      if (item%leaves_second) return
      call nodes_add_second(factor, size(item%g, 1), part%h, place, item%h)
   end subroutine add

end module emcon_edge_moments
