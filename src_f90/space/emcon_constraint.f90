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
   public :: condition_t, contact_response_t, condition_force, condition_find_force, &
      condition_add_field, condition_row_force, condition_row_gradient, condition_rate, &
      condition_drag, condition_friction, condition_stiffness, condition_normal, &
      condition_normal_slope, constraint_t, constraint_box_t

   !> A condition has so many slips at most: one less than there are dimensions.
   integer, parameter, public :: most_slips = 2

   !> What laws of contact make of a condition: multipliers that are no unknowns, and how those fall
   !> with gap (0) and slips. Entries past the slips of a condition are 0.
   type :: contact_response_t
      real(wp) :: lam = 0.0_wp                        !! of the gap, beside its row's [M L/T^2]
      real(wp) :: tau(most_slips) = 0.0_wp            !! against slips [M L/T^2]
      !> Against slips by the normal force: mu sigma where it slides, 0 where it sticks
      real(wp) :: mu_sigma(most_slips) = 0.0_wp
      real(wp) :: stick(most_slips) = 0.0_wp          !! multipliers of the rows of slips [M L/T^2]
      !> (row, by): -d lam or d tau, by the gap or slip at the end [M/T^2]
      real(wp) :: stiffness(0:most_slips, 0:most_slips) = 0.0_wp
   end type contact_response_t

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
      ! Of slip, docs/theory.md, eqs. (14e) to (14h):
      logical :: has_friction = .false.               !! the rest is known
      real(wp) :: slip(most_slips) = 0.0_wp           !! s over the step [L]
      real(wp) :: slip_target(most_slips) = 0.0_wp    !! a, at which it sticks [L]
      type(contact_response_t) :: response            !! of the laws of contact beside its rows
      !> Of integrated gaps, whose normal force is not the multiplier: see `condition_normal`
      logical :: is_mean = .false.
      real(wp) :: normal = 1.0_wp
      real(wp), allocatable :: t(:, :, :)             !! (n_dim, >= n_node, n_slip) T, as `g`
      real(wp), allocatable :: t1(:, :, :)            !! (n_dim, >= n_node, n_slip) as `c`
      real(wp), allocatable :: ht(:, :, :)            !! (i, j, n_slip) as `h`
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

   !> The force of the multiplier `lam`, and of what laws give beside it, on node `i` of the
   !> condition: along the discrete gradient, and of friction along those of slips.
   pure function condition_force(self, lam, i) result(force)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: lam                     !! of the row of its gap; 0: none [M L/T^2]
      integer, intent(in) :: i                        !! 1..n_node
      real(wp) :: force(size(self%g, 1))              !! (n_dim) [M L/T^2]

      call condition_find_force(self, lam + self%response%lam, condition_drag(self, lam), i, force)
   end function condition_force

   !> The force on node `i` of a push along the gap and of friction against slips, without an array
   !> of its own.
   pure subroutine condition_find_force(self, push, tau, i, force)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: push                    !! [M L/T^2]
      real(wp), intent(in) :: tau(:)                  !! (most_slips) no matter without friction
      integer, intent(in) :: i                        !! 1..n_node
      real(wp), intent(out) :: force(:)               !! (n_dim) [M L/T^2]
      integer :: s

      force = push*self%g(:, i)
      if (.not. self%has_friction) return
      do s = 1, size(self%t, 3)
         force = force - tau(s)*self%t(:, i, s)
      end do
   end subroutine condition_find_force

   !> Add `factor` times vectors of the nodes of a condition to a field.
   pure subroutine condition_add_field(self, factor, part, field)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: part(:, :)              !! (n_dim, >= n_node)
      real(wp), intent(inout) :: field(:, :)          !! (n_dim, n_node of the scene)
      integer :: i

      do i = 1, self%n_node
         field(:, self%node(i)) = field(:, self%node(i)) + factor*part(:, i)
      end do
   end subroutine condition_add_field

   !> The normal force by a multiplier of 1, where friction of 1 acts along the surface with 1:
   !> resultants on the slave side. docs/theory.md, eq. (14r).
   pure real(wp) function condition_normal(self) result(normal)
      type(condition_t), intent(in) :: self           !! with friction
      real(wp) :: along

      along = norm2(sum(self%t(:, :self%n_slave, :), 2))/sqrt(real(size(self%t, 3), wp))
      normal = 0.0_wp
      if (along > 0.0_wp) normal = norm2(sum(self%g(:, :self%n_slave), 2))/along
   end function condition_normal

   !> Its derivative by the end coordinates, node by node.
   pure function condition_normal_slope(self) result(slope)
      type(condition_t), intent(in) :: self           !! with friction and second derivatives
      real(wp) :: slope(size(self%g, 1)*self%n_node)  !! [1/L]
      real(wp) :: push(size(self%g, 1)), along(size(self%g, 1), size(self%t, 3))
      integer :: i, a, row, s

      slope = 0.0_wp
      push = sum(self%g(:, :self%n_slave), 2)
      along = sum(self%t(:, :self%n_slave, :), 2)
      if (.not. min(norm2(push), norm2(along)) > 0.0_wp) return
      push = push/norm2(push)/(norm2(along)/sqrt(real(size(along, 2), wp)))
      along = condition_normal(self)*along/sum(along**2)
      do i = 1, self%n_slave
         do a = 1, size(push)
            row = size(push)*(i - 1) + a
            slope = slope + push(a)*self%h(row, :size(slope))
            do s = 1, size(along, 2)
               slope = slope - along(a, s)*self%ht(row, :size(slope), s)
            end do
         end do
      end do
   end function condition_normal_slope

   !> The forces of friction tau against slips.
   pure function condition_drag(self, lam) result(tau)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: lam                     !! of the row of its gap; 0: none [M L/T^2]
      real(wp) :: tau(most_slips)                     !! 0 past the last slip [M L/T^2]

      tau = condition_friction(self, lam) + self%response%tau
   end function condition_drag

   !> Those of its rows: where it slides, and where it sticks.
   pure function condition_friction(self, lam) result(tau)
      type(condition_t), intent(in) :: self
      real(wp), intent(in) :: lam                     !! of the row of its gap; 0: none [M L/T^2]
      real(wp) :: tau(most_slips)                     !! 0 past the last slip [M L/T^2]

      tau = self%response%mu_sigma*self%normal*lam + self%response%stick
   end function condition_friction

   !> The directions in which a unit of the multiplier of a row pushes: where the condition slides
   !> that of its gap is tilted against slip.
   pure function condition_row_force(self, slip) result(push)
      type(condition_t), intent(in) :: self           !! with friction, or `slip` is 0
      integer, intent(in) :: slip                     !! 0: the row of the gap
      real(wp) :: push(size(self%g, 1), self%n_node)
      integer :: s

      if (slip > 0) then
         push = -self%t(:, :self%n_node, slip)
         return
      end if
      push = self%g(:, :self%n_node)
      if (.not. self%has_friction) return
      do s = 1, size(self%t, 3)
         push = push - self%response%mu_sigma(s)*self%normal*self%t(:, :self%n_node, s)
      end do
   end function condition_row_force

   !> The gradient of the value of a row at the end.
   pure function condition_row_gradient(self, slip) result(gradient)
      type(condition_t), intent(in) :: self           !! with friction, or `slip` is 0
      integer, intent(in) :: slip                     !! 0: the row of the gap
      real(wp) :: gradient(size(self%g, 1), self%n_node)

      if (slip > 0) then
         gradient = -self%t1(:, :self%n_node, slip)
      else
         gradient = self%c(:, :self%n_node)
      end if
   end function condition_row_gradient

   !> By how much the value of a row changes at the end with the field `way`, to first order.
   pure real(wp) function condition_rate(self, displacement, slip) result(rate)
      type(condition_t), intent(in) :: self           !! with friction if `slip` is above 0
      real(wp), intent(in) :: displacement(:, :)      !! (n_dim, n_node of the scene)
      integer, intent(in), optional :: slip           !! of the row; 0, as by default: its gap
      integer :: i, s

      s = 0
      if (present(slip)) s = slip
      rate = 0.0_wp
      do i = 1, self%n_node
         if (s == 0) then
            rate = rate + dot_product(self%c(:, i), displacement(:, self%node(i)))
         else
            rate = rate - dot_product(self%t1(:, i, s), displacement(:, self%node(i)))
         end if
      end do
   end function condition_rate

   !> What the forces of a condition fall by with the end coordinates of its nodes, node by node,
   !> while the multipliers of its rows stay; with `follows` those of slips by the normal force of a
   !> multiplier of 1.
   pure function condition_stiffness(self, lam, follows) result(stiffness)
      type(condition_t), intent(in) :: self           !! with second derivatives
      real(wp), intent(in) :: lam                     !! of the row of its gap; 0: none [M L/T^2]
      logical, intent(in), optional :: follows        !! else friction of rows of slips stays
      real(wp), dimension(size(self%g, 1)*self%n_node, size(self%g, 1)*self%n_node) :: stiffness
      real(wp) :: along(size(stiffness, 1), 0:most_slips), tau(most_slips), by_normal(most_slips)
      integer :: s, m, n_slip

      by_normal = self%response%mu_sigma*lam
      if (present(follows)) then
         if (follows .and. self%normal > 0.0_wp) by_normal = condition_friction(self, lam) &
            /self%normal
      end if
      m = size(stiffness, 1)
      n_slip = 0
      if (self%has_friction) n_slip = size(self%t, 3)
      stiffness = -(lam + self%response%lam)*self%h(:m, :m)
      along(:, 0) = reshape(self%g(:, :self%n_node), [m])
      tau = condition_drag(self, lam)
      do s = 1, n_slip
         along(:, s) = reshape(self%t(:, :self%n_node, s), [m])
         stiffness = stiffness + tau(s)*self%ht(:m, :m, s)
         if (.not. (self%is_mean .and. abs(by_normal(s)) > 0.0_wp)) cycle
         stiffness = stiffness + by_normal(s)*spread(along(:, s), 2, m) &
            *spread(condition_normal_slope(self), 1, m)
      end do
      if (all(abs(self%response%stiffness) <= 0.0_wp)) return
      call add_response(0, reshape(self%c(:, :self%n_node), [m]))
      do s = 1, n_slip
         call add_response(s, reshape(self%t1(:, :self%n_node, s), [m]))
      end do

   contains

      !> Add what the laws answer to the gap or a slip with.
      pure subroutine add_response(by, gradient)
         integer, intent(in) :: by                    !! 0: the gap
         real(wp), intent(in) :: gradient(:)          !! (m) of it at the end
         integer :: row, j

         do row = 0, n_slip
            do j = 1, m
               stiffness(:, j) = stiffness(:, j) &
                  + (self%response%stiffness(row, by)*gradient(j))*along(:, row)
            end do
         end do
      end subroutine add_response

   end function condition_stiffness

end module emcon_constraint
