!> The linear rows of a scene, ties and equations, as conditions that a step can solve for by
!> multipliers. Source: docs/theory.md, section 10.
module emcon_linear_conditions
   use emcon_constraint, only : condition_t, constraint_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_motion, only : motion_t
   implicit none
   private
   public :: linear_conditions_t, linear_conditions_init

   type, extends(constraint_t) :: linear_conditions_t
      type(linear_rows_t), private :: rows
   contains
      procedure :: linearise
   end type linear_conditions_t

contains

   !> One condition for each of `rows`, used or not.
   pure subroutine linear_conditions_init(self, rows)
      type(linear_conditions_t), intent(out) :: self
      type(linear_rows_t), intent(in) :: rows

      self%rows = rows
      self%n_constraint = rows%n
   end subroutine linear_conditions_init

   !> As `constraint_t` has it; the values to hold are 0.
   pure subroutine linearise(self, wanted, motion, target, item)
      class(linear_conditions_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)                !! (n) numbers of rows, ascending
      type(motion_t), intent(in) :: motion            !! placed
      real(wp), intent(in) :: target(:)               !! (n) zeros
      type(condition_t), intent(inout) :: item(:)     !! (n)
      integer :: k

      do k = 1, size(wanted)
         call linearise_row(self%rows, wanted(k), motion%u0, motion%du, item(k))
      end do
   end subroutine linearise

   !> The condition of row `id`: its gradient is the same everywhere.
   pure subroutine linearise_row(linear, id, u0, du, item)
      class(linear_rows_t), intent(in) :: linear
      integer, intent(in) :: id
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      type(condition_t), intent(inout) :: item
      integer :: n_dim, s, a, i, node

      associate (from => linear%start(id) + 1, to => linear%start(id + 1))
         n_dim = size(u0, 1)
         if (.not. allocated(item%node)) allocate(item%node(1 + to - from), &
            item%g(n_dim, 1 + to - from), item%c(n_dim, 1 + to - from), item%h(0, 0))
         item%n_node = 1
         item%n_slave = 1
         item%node(1) = (linear%own(id) - 1)/n_dim + 1
         item%g = 0.0_wp
         item%gap0 = 0.0_wp
         item%dgap = 0.0_wp
         do s = from, to
            node = (linear%dof(s) - 1)/n_dim + 1
            a = linear%dof(s) - n_dim*(node - 1)
            i = findloc(item%node(:item%n_node), node, 1)
            if (i == 0) then
               item%n_node = item%n_node + 1
               i = item%n_node
               item%node(i) = node
            end if
            item%g(a, i) = item%g(a, i) + linear%weight(s)
            item%gap0 = item%gap0 + linear%weight(s)*u0(a, node)
            item%dgap = item%dgap + linear%weight(s)*du(a, node)
         end do
      end associate
      item%c = item%g
      item%gap1 = item%gap0 + item%dgap
      item%size = linear%size(id)
   end subroutine linearise_row

end module emcon_linear_conditions
