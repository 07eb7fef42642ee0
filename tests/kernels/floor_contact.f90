!> Contact of nodes with a flat floor: linear, but that what it tells beside gaps is as a test asks.
module floor_contact
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: floor_contact_t, floor_make

   !> Constraint i is of node `node(i)`, along y.
   type, extends(contact_t) :: floor_contact_t
      real(wp), allocatable :: height(:)             !! (n_constraint) of the floor [L]
      real(wp) :: closed = 0.0_wp                    !! the gap that acts [L]
      logical, allocatable :: leaves(:)              !! (n_constraint) it loses its surface
      integer, allocatable :: leaves_at(:)           !! at these looks alone; not allocated: at all
      logical, allocatable :: is_seen(:)             !! (n_constraint) stencils hold
      real(wp) :: shift = 0.0_wp                     !! of slip, at each look up to number `until`
      real(wp) :: drift = 0.0_wp                     !! gaps are measured by so much too large then
      integer :: until = huge(1)
      real(wp) :: size = 1.0_wp                      !! of an edge [L]
   contains
      procedure :: configure
      procedure :: begin_points
      procedure :: measure_points
      procedure :: evaluate_points
      procedure :: area_points
      procedure :: covers_points
      procedure :: slip_points
   end type floor_contact_t

contains

   !> The nodes `node` over a floor at `height`.
   pure subroutine floor_make(self, node, height)
      type(floor_contact_t), intent(out) :: self
      integer, intent(in) :: node(:)                 !! of the scene
      real(wp), intent(in) :: height(:)              !! as many [L]

      self%n_constraint = size(node)
      self%node = node
      self%duplicate = 0*node
      self%height = height
      self%leaves = node < 0
      self%is_seen = .not. self%leaves
      allocate(self%state(size(node)))
   end subroutine floor_make

   pure subroutine configure(self, x, options)
      class(floor_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(contact_options_t), intent(in) :: options
   end subroutine configure

   pure subroutine begin_points(self, x, u0, du)
      class(floor_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      call self%has_looked(0.0_wp)
   end subroutine begin_points

   !> The height of node `i` over the floor.
   pure real(wp) function gap_of(self, i, x, u) result(gap)
      class(floor_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:, :), u(:, :)

      gap = x(2, self%node(i)) + u(2, self%node(i)) - self%height(i)
   end function gap_of

   pure subroutine measure_points(self, x, u0, du)
      class(floor_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      integer :: i

      do i = 1, self%n_constraint
         associate (state => self%state(i))
            state%is_near = .true.
            state%is_over = .true.
            state%is_leaving = self%leaves(i)
            if (allocated(self%leaves_at)) state%is_leaving = state%is_leaving .and. &
               any(self%n_look == self%leaves_at)
            state%size = self%size
            state%closed = self%closed
            state%gap0 = gap_of(self, i, x, u0)
            state%gap1 = gap_of(self, i, x, u0 + du)
            state%slip_shift = 0.0_wp
            if (self%n_look > self%until) cycle
            state%gap1 = state%gap1 + self%drift
            state%slip_shift = self%shift
         end associate
      end do
   end subroutine measure_points

   pure subroutine evaluate_points(self, wanted, x, u0, du, target, item)
      class(floor_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
      integer :: k

      do k = 1, size(wanted)
         associate (item => item(k), node => self%node(wanted(k)))
            call condition_resize(item, 1)
            item%n_slave = 1
            item%node(1) = node
            item%size = self%size
            item%gap0 = gap_of(self, wanted(k), x, u0) - target(k)
            item%gap1 = gap_of(self, wanted(k), x, u0 + du) - target(k)
            item%dgap = du(2, node)
            item%g(:, 1) = [0.0_wp, 1.0_wp]
            item%c(:, 1) = [0.0_wp, 1.0_wp]
            item%h = 0.0_wp
            if (.not. item%has_friction) cycle
            call condition_resize_slip(item)
            item%slip(1) = du(1, node)
            item%t(:, 1, 1) = [1.0_wp, 0.0_wp]
            item%t1(:, 1, 1) = [1.0_wp, 0.0_wp]
         end associate
      end do
   end subroutine evaluate_points

   pure subroutine area_points(self, x, u, area, length)
      class(floor_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: area(:)
      real(wp), intent(out) :: length(:)

      area = 1.0_wp
      length = 1.0_wp
   end subroutine area_points

   pure logical function covers_points(self, i, x, u0, du) result(covers)
      class(floor_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      covers = self%is_seen(i)
   end function covers_points

   pure function slip_points(self, i, x, u0, du) result(slip)
      class(floor_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: slip(size(x, 1) - 1)

      slip = du(1, self%node(i))
   end function slip_points

end module floor_contact
