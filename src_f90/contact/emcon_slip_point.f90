!> Slip of a point of a slave edge over a step, along the line of the master edge that it faces.
!>
!> A slave node is such a point; what holds an integrated gap slides by the mean of some. Source:
!> docs/theory.md, eqs. (14e) and (14j). Sign: slip > 0 is towards the last node of the edge.
module emcon_slip_point
   use emcon_constraint, only : condition_t
   use emcon_dgrad8, only : dg8_t => dg_t
   use emcon_dgrad8_first, only : dg8_first_t => dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_kinds, only : wp
   use emcon_nts_gap, only : nts_slip
   use emcon_nts_gap_first, only : nts_slip_first => nts_slip
   use emcon_nts_gap_value, only : first, last, slave
   implicit none
   private
   public :: slip_point_t, slip_list_t, slip_point, slip_over, slip_add, slip_share

   type :: slip_point_t
      integer :: node(4) = 0                     !! of the scene: slave edge, master edge
      real(wp) :: share(4) = 1.0_wp              !! of these; of the slave edge, in the place of the
                                                 !! point, with the sum 1
      real(wp) :: weight = 1.0_wp                !! in the slip of a constraint
   end type slip_point_t

   !> What one constraint slides by.
   type :: slip_list_t
      type(slip_point_t), allocatable :: point(:)
   end type slip_list_t

   !> Which of the places `slave`, `first` and `last` the nodes belong to.
   integer, parameter :: place(4) = [slave, slave, first, last]

contains

   !> A point at `xi`, 0 to 1, of a slave edge.
   pure type(slip_point_t) function slip_point(node, xi, weight)
      integer, intent(in) :: node(:)             !! (4) of the scene: slave edge, master edge
      real(wp), intent(in) :: xi                 !! on the slave edge, from its first node
      real(wp), intent(in) :: weight             !! in the slip of a constraint

      slip_point = slip_point_t(node, [1.0_wp - xi, xi, 1.0_wp, 1.0_wp], weight)
   end function slip_point

   !> The part of friction at some points that acts on a slave node.
   pure real(wp) function slip_share(point, node) result(part)
      type(slip_point_t), intent(in) :: point(:) !! weights with the sum 1
      integer, intent(in) :: node                !! of the scene
      integer :: k

      part = 0.0_wp
      do k = 1, size(point)
         part = part + point(k)%weight*sum(point(k)%share, point(k)%node == node .and. &
            place == slave)
      end do
   end function slip_share

   !> Weight times slip.
   pure real(wp) function slip_over(self, x, u0, du) result(slip)
      type(slip_point_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), dimension(size(x, 1), 3) :: local, dlocal
      real(wp), dimension(size(x, 1)) :: a, b, da, db
      real(wp) :: xi

      call gather(self, x, u0, du, local, dlocal)
      a = local(:, last) - local(:, first)
      b = local(:, slave) - local(:, first)
      da = dlocal(:, last) - dlocal(:, first)
      db = dlocal(:, slave) - dlocal(:, first)
      xi = dot_product(b, a)/dot_product(a, a)
      ! (b + db).(a + da) - xi |a + da|^2, without what cancels
      slip = self%weight*sqrt(dot_product(a, a))*(dot_product(db, a + da) + dot_product(b, da) &
         - xi*dot_product(da, a + a + da))/dot_product(a + da, a + da)
   end function slip_over

   !> Add weight times slip, with its derivatives, to a condition.
   pure subroutine slip_add(self, x, u0, du, item)
      type(slip_point_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(condition_t), intent(inout) :: item   !! made for slip, with all nodes of the point
      real(wp), dimension(size(x, 1), 3) :: local, dlocal
      real(wp) :: h(size(local), size(local))
      type(dg8_t) :: slip
      type(dg8_first_t) :: only_first
      integer :: j, k, to(4)

      call gather(self, x, u0, du, local, dlocal)
      do k = 1, size(to)
         to(k) = findloc(item%node(:item%n_node), self%node(k), 1)
      end do
      if (item%leaves_second) then
         only_first = nts_slip_first(local, dlocal)
         item%slip(1) = item%slip(1) + self%weight*only_first%df
         call add_first(self, to, only_first%g, only_first%c, item)
         return
      end if
      slip = nts_slip(local, dlocal)
      item%slip(1) = item%slip(1) + self%weight*slip%df
      call add_first(self, to, slip%g, slip%c, item)
      h = 0.0_wp
      call nodes_add_second(1.0_wp, size(x, 1), slip%h, [slave, first, last], h)
      do k = 1, size(to)
         do j = 1, size(to)
            if (min(self%share(k), self%share(j)) > 0.0_wp) call add_second(k, j, h, &
               self%weight*self%share(k)*self%share(j), to, item)
         end do
      end do
   end subroutine slip_add

   !> Add discrete gradient and gradient at the end.
   pure subroutine add_first(self, to, g, c, item)
      type(slip_point_t), intent(in) :: self
      integer, intent(in) :: to(:)               !! (4) places of the nodes in the condition
      real(wp), intent(in) :: g(:), c(:)         !! of the slip, by the places but the first
      type(condition_t), intent(inout) :: item
      real(wp), dimension(size(item%t, 1), maxval(place)) :: by_g, by_c
      real(wp) :: part
      integer :: k

      by_g = 0.0_wp
      by_c = 0.0_wp
      call nodes_add_first(1.0_wp, g, [slave, first, last], by_g)
      call nodes_add_first(1.0_wp, c, [slave, first, last], by_c)
      do k = 1, size(to)
         part = self%weight*self%share(k)
         if (.not. self%share(k) > 0.0_wp) cycle
         item%t(:, to(k), 1) = item%t(:, to(k), 1) + part*by_g(:, place(k))
         item%t1(:, to(k), 1) = item%t1(:, to(k), 1) + part*by_c(:, place(k))
      end do
   end subroutine add_first

   !> Add the derivatives of the part of node `k` by node `j`.
   pure subroutine add_second(k, j, h, part, to, item)
      integer, intent(in) :: k, j                !! nodes of the point
      real(wp), intent(in) :: h(:, :)            !! of the slip, by `place`
      real(wp), intent(in) :: part               !! weight and shares
      integer, intent(in) :: to(:)               !! (4) places of the nodes in the condition
      type(condition_t), intent(inout) :: item
      integer :: a, b, row, column, n_dim

      n_dim = size(item%t, 1)
      do b = 1, n_dim
         column = n_dim*(to(j) - 1) + b
         do a = 1, n_dim
            row = n_dim*(to(k) - 1) + a
            item%ht(row, column, 1) = item%ht(row, column, 1) &
               + part*h(n_dim*(place(k) - 1) + a, n_dim*(place(j) - 1) + b)
         end do
      end do
   end subroutine add_second

   !> The point and the ends of the master edge, relative to the first of these, and their motion.
   pure subroutine gather(self, x, u0, du, local, dlocal)
      type(slip_point_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(out) :: local(:, :), dlocal(:, :)   !! (n_dim, 3) [L]

      integer :: k

      local = 0.0_wp
      dlocal = 0.0_wp
      do k = 1, size(self%node)
         associate (part => self%share(k), at => place(k))
            local(:, at) = local(:, at) + part*relative(k)
            dlocal(:, at) = dlocal(:, at) + part*du(:, self%node(k))
         end associate
      end do

   contains

      pure function relative(k) result(vector)
         integer, intent(in) :: k                !! node of the point
         real(wp) :: vector(size(x, 1))

         associate (node => self%node)
            vector = (x(:, node(k)) - x(:, node(3))) + (u0(:, node(k)) - u0(:, node(3)))
         end associate
      end function relative

   end subroutine gather

end module emcon_slip_point
