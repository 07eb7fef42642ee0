!> What a constraint is: a number of conditions, each with a value and derivatives over a motion.
!>
!> Who solves a step knows conditions only: its forces are the sum of lam_k times their directions.
!> Source: docs/theory.md, eq. (1) and section 4.
module emcon_constraint
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_t
   implicit none
   private
   public :: condition_t, condition_force, condition_push, condition_rate, condition_slip_rate, &
      condition_drag, condition_normal, condition_normal_slope, constraint_t, constraint_box_t

   !> One condition over a motion, on its own nodes: f = (Phi - t W)/s, docs/theory.md, eq. (15).
   type :: condition_t
      integer :: n_node = 0
      integer :: n_slave = 0                          !! nodes 1..n_slave are on the slave side
      integer, allocatable :: node(:)                 !! (>= n_node) the first is the slave node
      real(wp) :: gap0 = 0.0_wp                       !! f at the start [L], > 0 open
      real(wp) :: gap1 = 0.0_wp                       !! at the end
      real(wp) :: dgap = 0.0_wp                       !! gap1 - gap0, to relative accuracy
      real(wp) :: size = 0.0_wp                       !! length of an edge [L]
      real(wp), allocatable :: g(:, :)                !! (n_dim, >= n_node) discrete gradient
      real(wp), allocatable :: c(:, :)                !! (n_dim, >= n_node) gradient at the end
      !> (i, j): derivative of g(i) by end coordinate j, coordinates node by node
      real(wp), allocatable :: h(:, :)
      logical :: leaves_second = .false.              !! nobody asks for `h`
      ! Of friction, docs/theory.md, eqs. (14e) to (14h):
      logical :: rubs = .false.                       !! the rest is known
      real(wp) :: slip = 0.0_wp                       !! s over the step [L]
      real(wp) :: lead = 0.0_wp                       !! a, from which the law counts slip [L]
      real(wp) :: tilt = 0.0_wp                       !! mu sigma where it slides, 0 where it sticks
      real(wp) :: hold = 0.0_wp                       !! tau where it sticks [M L/T^2]
      !> Of integrated gaps, whose normal force is not the multiplier: see `condition_normal`
      logical :: is_mean = .false.
      real(wp) :: normal = 1.0_wp
      real(wp), allocatable :: t(:, :)                !! (n_dim, >= n_node) T, by discrete gradient
      real(wp), allocatable :: t1(:, :)               !! (n_dim, >= n_node) gradient at the end
      !> (i, j): derivative of t(i) by end coordinate j, coordinates node by node
      real(wp), allocatable :: ht(:, :)
   end type condition_t

   type, abstract :: constraint_t
      character(len=:), allocatable :: name           !! for messages
      integer :: n_constraint = 0                     !! number of conditions
      !> Nodes whose bodies it may hold, for the check of static steps; not allocated: of none
      integer, allocatable :: stands_on(:)
   contains
      procedure :: take_positions
      procedure :: find_idle
      procedure(linearise_interface), deferred :: linearise
   end type constraint_t

   !> For arrays of constraints of different types.
   type :: constraint_box_t
      class(constraint_t), allocatable :: constraint
   end type constraint_box_t

   abstract interface

      !> The conditions `wanted` with their derivatives over a motion that is placed. Of those that
      !> leave the second derivatives `h` may be anything.
      pure subroutine linearise_interface(self, wanted, motion, target, item)
         import :: condition_t, constraint_t, motion_t, wp
         class(constraint_t), intent(inout) :: self
         integer, intent(in) :: wanted(:)             !! (n) numbers of conditions, ascending
         type(motion_t), intent(in) :: motion         !! placed
         real(wp), intent(in) :: target(:)            !! (n) values to hold [L]
         type(condition_t), intent(inout) :: item(:)  !! (n)
      end subroutine linearise_interface

   end interface

contains

   !> Told once, before the first step: the reference positions `x` of the nodes, which ties and
   !> adjusted contact may have moved. To be overridden where they matter.
   subroutine take_positions(self, x)
      class(constraint_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)     !! (n_dim, n_node) [L]
   end subroutine take_positions

   !> Told at the beginning of each step: which conditions have nothing to hold in it, as no unknown
   !> enters them. None unless overridden.
   pure subroutine find_idle(self, numbering, is_idle)
      class(constraint_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      logical, intent(out) :: is_idle(:)              !! (n_constraint)

      is_idle = .false.
   end subroutine find_idle

   !> The force of the multiplier `lam` on node `i` of the condition: along the discrete gradient,
   !> and of friction along that of slip.
   pure function condition_force(self, lam, i) result(force)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: lam                     !! [M L/T^2]
      integer, intent(in) :: i                        !! 1..n_node
      real(wp) :: force(size(self%g, 1))              !! (n_dim) [M L/T^2]

      force = lam*self%g(:, i)
      if (self%rubs) force = force - condition_drag(self, lam)*self%t(:, i)
   end function condition_force

   !> The normal force by a multiplier of 1, where friction of 1 acts along the surface with 1:
   !> resultants on the slave side. docs/theory.md, eq. (14r).
   pure real(wp) function condition_normal(self) result(normal)
      type(condition_t), intent(in) :: self           !! it rubs
      real(wp) :: along

      along = norm2(sum(self%t(:, :self%n_slave), 2))
      normal = 0.0_wp
      if (along > 0.0_wp) normal = norm2(sum(self%g(:, :self%n_slave), 2))/along
   end function condition_normal

   !> Its derivative by the end coordinates, node by node.
   pure function condition_normal_slope(self) result(slope)
      type(condition_t), intent(in) :: self           !! it rubs, with second derivatives
      real(wp) :: slope(size(self%g, 1)*self%n_node)  !! [1/L]
      real(wp), dimension(size(self%g, 1)) :: push, along
      integer :: i, a, row

      slope = 0.0_wp
      push = sum(self%g(:, :self%n_slave), 2)
      along = sum(self%t(:, :self%n_slave), 2)
      if (.not. min(norm2(push), norm2(along)) > 0.0_wp) return
      push = push/norm2(push)/norm2(along)
      along = condition_normal(self)*along/dot_product(along, along)
      do i = 1, self%n_slave
         do a = 1, size(push)
            row = size(push)*(i - 1) + a
            slope = slope + push(a)*self%h(row, :size(slope)) - along(a)*self%ht(row, :size(slope))
         end do
      end do
   end function condition_normal_slope

   !> The force of friction tau against slip.
   pure real(wp) function condition_drag(self, lam) result(tau)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: lam                     !! the multiplier [M L/T^2]

      tau = self%tilt*self%normal*lam + self%hold
   end function condition_drag

   !> The directions in which a unit of the multiplier pushes: where the condition slides, tilted
   !> against slip.
   pure function condition_push(self) result(push)
      type(condition_t), intent(in) :: self
      real(wp) :: push(size(self%g, 1), self%n_node)

      push = self%g(:, :self%n_node)
      if (self%rubs) push = push - self%tilt*self%normal*self%t(:, :self%n_node)
   end function condition_push

   !> By how much the condition's value at the end changes with the field `way`, to first order.
   pure real(wp) function condition_rate(self, way) result(rate)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: way(:, :)               !! (n_dim, n_node of the scene)
      integer :: i

      rate = 0.0_wp
      do i = 1, self%n_node
         rate = rate + dot_product(self%c(:, i), way(:, self%node(i)))
      end do
   end function condition_rate

   !> The same of its slip.
   pure real(wp) function condition_slip_rate(self, way) result(rate)
      type(condition_t), intent(in) :: self      !! it rubs
      real(wp), intent(in) :: way(:, :)          !! (n_dim, n_node of the scene)
      integer :: i

      rate = 0.0_wp
      do i = 1, self%n_node
         rate = rate + dot_product(self%t1(:, i), way(:, self%node(i)))
      end do
   end function condition_slip_rate

end module emcon_constraint
