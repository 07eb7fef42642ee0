!> Where some nodes stood when something was found out about them: as long as they stand there, it
!> need not be found out again.
module emcon_position_memo
   use emcon_kinds, only : wp
   implicit none
   private
   public :: position_memo_t, position_memo_take, position_memo_holds

   type :: position_memo_t
      logical :: is_known = .false.
      real(wp), allocatable, private :: x(:, :), u(:, :)   !! (n_dim, size of `node`) [L]
   end type position_memo_t

contains

   !> The nodes `node` stand at x + u.
   pure subroutine position_memo_take(self, node, x, u)
      type(position_memo_t), intent(inout) :: self
      integer, intent(in) :: node(:)             !! of the scene; always the same ones
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      integer :: i

      if (.not. allocated(self%x)) allocate(self%x(size(x, 1), size(node)), &
         self%u(size(x, 1), size(node)))
      do i = 1, size(node)
         self%x(:, i) = x(:, node(i))
         self%u(:, i) = u(:, node(i))
      end do
      self%is_known = .true.
   end subroutine position_memo_take

   !> Do they stand at x + u, to the last bit?
   pure logical function position_memo_holds(self, node, x, u) result(holds)
      type(position_memo_t), intent(in) :: self
      integer, intent(in) :: node(:)             !! as in `position_memo_take`
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      integer :: i, a

      holds = self%is_known
      if (.not. holds) return
      do i = 1, size(node)
         do a = 1, size(x, 1)
            holds = abs(self%u(a, i) - u(a, node(i))) <= 0.0_wp .and. &
               abs(self%x(a, i) - x(a, node(i))) <= 0.0_wp
            if (.not. holds) return
         end do
      end do
   end function position_memo_holds

end module emcon_position_memo
