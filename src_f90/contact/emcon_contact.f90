!> What a contact formulation is: a list of possible constraints gap_i >= 0.
!>
!> A formulation chooses, once per step, what each constraint is made of (its stencil), and gives
!> its value, discrete gradient and derivatives. Which constraints act is not its business.
module emcon_contact
   use emcon_kinds, only : wp
   implicit none
   private
   public :: contact_t, contact_box_t, constraint_t, gap_state_t, max_constraint_nodes

   integer, parameter :: max_constraint_nodes = 5

   !> One constraint over a step, on its own nodes.
   type :: constraint_t
      integer :: n_node = 0
      integer :: node(max_constraint_nodes) = 0       !! the first one is the slave node
      real(wp) :: gap0 = 0.0_wp                       !! [L], > 0 open
      real(wp) :: gap1 = 0.0_wp
      real(wp) :: dgap = 0.0_wp                       !! gap1 - gap0, to relative accuracy
      real(wp) :: size = 0.0_wp                       !! length of the master edge [L]
      real(wp) :: g(2, max_constraint_nodes) = 0.0_wp   !! discrete gradient
      real(wp) :: c(2, max_constraint_nodes) = 0.0_wp   !! gradient at the end
      !> (i, j): derivative of g(i) by end coordinate j, coordinates node by node
      real(wp) :: h(2*max_constraint_nodes, 2*max_constraint_nodes) = 0.0_wp
   end type constraint_t

   !> Where one possible constraint stands at both ends of a step.
   type :: gap_state_t
      logical :: is_near = .false.                    !! false: no surface within reach
      logical :: is_over = .false.                    !! over the surface (not past its end)
      logical :: is_covered = .true.                  !! the stencil still holds at the end
      real(wp) :: gap0 = 0.0_wp
      real(wp) :: gap1 = 0.0_wp
      real(wp) :: size = 0.0_wp
   end type gap_state_t

   type, abstract :: contact_t
      integer :: n_constraint = 0
      real(wp) :: rounding = 0.0_wp                   !! of corners, as a fraction of a master edge
      real(wp) :: reach = 0.0_wp                      !! of the candidate search; 0: search anew [L]
      integer, allocatable :: node(:)                 !! (n_constraint) slave node of each
      real(wp), allocatable :: thickness(:)           !! (n_constraint) of the slave side [L]
   contains
      procedure(begin_interface), deferred :: begin_step
      procedure(state_interface), deferred :: gap_state
      procedure(evaluate_interface), deferred :: evaluate
      procedure(area_interface), deferred :: area
   end type contact_t

   !> For arrays of formulations of different types.
   type :: contact_box_t
      class(contact_t), allocatable :: contact
   end type contact_box_t

   abstract interface

      !> Choose the stencils for a step from `u0` with the expected motion `du`.
      pure subroutine begin_interface(self, x, u0, du)
         import :: contact_t, wp
         class(contact_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node)
      end subroutine begin_interface

      !> Gap of constraint `i` at both ends of the step, cheaply.
      pure function state_interface(self, i, x, u0, du) result(state)
         import :: contact_t, gap_state_t, wp
         class(contact_t), intent(in) :: self
         integer, intent(in) :: i
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
         type(gap_state_t) :: state
      end function state_interface

      !> Constraint `i` with all its derivatives.
      pure subroutine evaluate_interface(self, i, x, u0, du, constraint)
         import :: constraint_t, contact_t, wp
         class(contact_t), intent(in) :: self
         integer, intent(in) :: i
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
         type(constraint_t), intent(inout) :: constraint
      end subroutine evaluate_interface

      !> Area over which the multiplier of each constraint acts, at x + u.
      pure subroutine area_interface(self, x, u, area)
         import :: contact_t, wp
         class(contact_t), intent(in) :: self
         real(wp), intent(in), contiguous :: x(:, :), u(:, :)
         real(wp), intent(out) :: area(:)             !! (n_constraint) [L^2]
      end subroutine area_interface

   end interface

end module emcon_contact
