!> Rigid bodies keep their shape: the nodes of their frames stay as far from each other as they are.
!>
!> f = (|d|^2 - l^2)/(2 l) with the vector d between two nodes of a frame, l long at the start. It
!> is quadratic: its discrete gradient is the gradient at the middle of the step, and keeps energy
!> and momenta. Source: docs/theory.md, section 12.
module emcon_rigidity
   use emcon_constraint, only : condition_t, constraint_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_t
   use emcon_rigid_bodies, only : rigid_body_t
   implicit none
   private
   public :: rigidity_t, rigidity_init

   !> Nodes of a condition.
   integer, parameter :: n_end = 2

   type, extends(constraint_t) :: rigidity_t
      integer, allocatable, private :: node(:, :)      !! (n_end, n_constraint)
   contains
      procedure :: linearise
      procedure :: find_idle
   end type rigidity_t

contains

   !> One condition for each two nodes of a frame, body by body.
   pure subroutine rigidity_init(self, rigid)
      type(rigidity_t), intent(out) :: self
      type(rigid_body_t), intent(in) :: rigid(:)      !! (any) with their frames
      integer :: b, i, k, n

      n = 0
      do b = 1, size(rigid)
         n = n + size(rigid(b)%frame)*(size(rigid(b)%frame) - 1)/2
      end do
      self%n_constraint = n
      allocate(self%node(n_end, n))
      n = 0
      do b = 1, size(rigid)
         do k = 2, size(rigid(b)%frame)
            do i = 1, k - 1
               n = n + 1
               self%node(:, n) = rigid(b)%frame([i, k])
            end do
         end do
      end do
   end subroutine rigidity_init

   !> Between nodes that are prescribed there is nothing to hold.
   pure subroutine find_idle(self, numbering, is_idle)
      class(rigidity_t), intent(in) :: self
      type(numbering_t), intent(in) :: numbering
      logical, intent(out) :: is_idle(:)              !! (n_constraint)
      integer :: k, i

      do k = 1, self%n_constraint
         is_idle(k) = .true.
         do i = 1, n_end
            is_idle(k) = is_idle(k) .and. is_given(numbering, self%node(i, k))
         end do
      end do
   end subroutine find_idle

   !> Does no unknown move the node?
   pure logical function is_given(numbering, node)
      type(numbering_t), intent(in) :: numbering
      integer, intent(in) :: node
      integer :: n_dim

      n_dim = size(numbering%unknown, 1)
      associate (from => numbering%start(n_dim*(node - 1) + 1) + 1, &
            to => numbering%start(n_dim*node + 1))
         is_given = all(numbering%column(from:to) == 0)
      end associate
   end function is_given

   !> As `constraint_t` has it; the values to hold are 0.
   pure subroutine linearise(self, wanted, motion, target, item)
      class(rigidity_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)                !! (n) numbers of conditions, ascending
      type(motion_t), intent(in) :: motion            !! placed
      real(wp), intent(in) :: target(:)               !! (n) zeros
      type(condition_t), intent(inout) :: item(:)     !! (n)
      integer :: k

      do k = 1, size(wanted)
         call hold(self%node(:, wanted(k)), motion, item(k))
      end do
   end subroutine linearise

   !> The distance between two nodes; its force acts where the mean of all forces does.
   !> |d|^2 - l^2 is computed from displacements: w.(2 D + w) for d = D + w.
   pure subroutine hold(node, motion, item)
      integer, intent(in) :: node(:)                  !! (n_end)
      type(motion_t), intent(in) :: motion            !! placed
      type(condition_t), intent(inout) :: item
      real(wp), dimension(size(motion%x, 1)) :: rest, w0, dw, direction
      real(wp) :: length, mean
      integer :: a, n_dim

      n_dim = size(motion%x, 1)
      if (.not. allocated(item%node)) allocate(item%node(n_end), item%g(n_dim, n_end), &
         item%c(n_dim, n_end), item%h(n_end*n_dim, n_end*n_dim))
      rest = between(motion%x)
      w0 = between(motion%u0)
      dw = between(motion%du)
      length = norm2(rest)
      item%n_node = n_end
      item%n_slave = n_end
      item%node = node
      item%size = length
      item%gap0 = dot_product(w0, rest + 0.5_wp*w0)/length
      item%dgap = dot_product(rest + w0 + 0.5_wp*dw, dw)/length
      item%gap1 = dot_product(w0 + dw, rest + 0.5_wp*(w0 + dw))/length
      mean = 1.0_wp/(1.0_wp + motion%evaluation%start_weight)
      direction = rest + between(motion%from) + 0.5_wp*between(motion%by)
      if (mean < 1.0_wp) direction = rest + w0 + mean*dw
      direction = direction/length
      item%g(:, 1) = -direction
      item%g(:, n_end) = direction
      direction = (rest + w0 + dw)/length
      item%c(:, 1) = -direction
      item%c(:, n_end) = direction
      item%h = 0.0_wp
      do a = 1, n_dim
         item%h(a, a) = 0.5_wp*mean*motion%weight/length
         item%h(a, n_dim + a) = -item%h(a, a)
         item%h(n_dim + a, a) = -item%h(a, a)
         item%h(n_dim + a, n_dim + a) = item%h(a, a)
      end do

   contains

      pure function between(field) result(apart)
         real(wp), intent(in) :: field(:, :)
         real(wp) :: apart(size(field, 1))

         apart = field(:, node(n_end)) - field(:, node(1))
      end function between

   end subroutine hold

end module emcon_rigidity
