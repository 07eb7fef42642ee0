!> Node-to-segment contact: one constraint per slave node, gap over the nearest master edge.
module emcon_nts
   use emcon_chain, only : chain_init, chain_t, chain_tributary
   use emcon_contact, only : constraint_resize, constraint_t, contact_t, gap_state_t
   use emcon_dgrad10, only : dg_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update
   use emcon_nts_gap, only : nts_gap, nts_gap_value
   use emcon_scene, only : contact_options_t, contact_pair_t, scene_t, smoothing_none
   use emcon_sort, only : find_sorted
   implicit none
   private
   public :: nts_t, nts_init, nts_nearest

   !> Corners sharper than this (cosine of the turn) end the surface: the bisector degenerates.
   real(wp), parameter :: sharpest_cosine = -0.9_wp

   !> So far past the end of a surface, per edge, a node is still over it: a node that meets the end
   !> exactly (as on a plane of symmetry) must not be lost to round-off.
   real(wp), parameter :: end_tol = 1.0e-3_wp
   !> A node counts as outside at the start of a step down to this fraction of a master edge.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))

   type, extends(contact_t) :: nts_t
      type(chain_t) :: slave
      type(chain_t) :: master
      integer :: smoothing = smoothing_none
      integer, allocatable :: edge(:)                 !! (n_constraint) master edge; 0: none near
      type(near_list_t) :: near
   contains
      procedure :: begin_step => nts_begin_step
      procedure :: configure => nts_configure
      procedure :: measure => nts_measure
      procedure :: evaluate => nts_evaluate
      procedure :: area => nts_area
   end type nts_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine nts_init(self, scene, pair, error)
      type(nts_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j, k

      call chain_init(self%slave, scene, scene%surface(pair%slave), error)
      if (allocated(error)) return
      call chain_init(self%master, scene, scene%surface(pair%master), error)
      if (allocated(error)) return
      self%node = self%slave%node
      self%n_constraint = size(self%node)
      allocate(self%edge(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint))
      self%deepest_start = touch_tol
      allocate(self%thickness(self%n_constraint), source=1.0_wp)
      associate (surface => scene%surface(pair%slave))
         do i = 1, self%slave%n_edge
            do j = 1, 2
               k = find_sorted(self%node, self%slave%edge(j, i))
               self%thickness(k) = &
                  scene%section(scene%element_section(surface%element(i)))%thickness
            end do
         end do
      end associate
      call near_list_init(self%near, reshape(self%node, [1, self%n_constraint]), self%master%edge, &
         scene%u0, 0.0_wp)
   end subroutine nts_init

   !> Choose for each slave node the nearest master edge at the start of the step.
   pure subroutine nts_begin_step(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      integer :: i, k, e
      real(wp) :: distance, best

      call near_list_update(self%near, x, u0, du, self%reach)
      do i = 1, self%n_constraint
         self%edge(i) = 0
         best = huge(best)
         do k = self%near%candidates%start(i), self%near%candidates%start(i + 1) - 1
            e = self%near%candidates%edge(k)
            distance = edge_distance(x, u0, self%node(i), self%master%edge(:, e))
            if (distance < best) then
               best = distance
               self%edge(i) = e
            end if
         end do
      end do
   end subroutine nts_begin_step

   !> Distance of a node from an edge as a segment.
   pure real(wp) function edge_distance(x, u, node, edge)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: node, edge(2)
      real(wp) :: a(2), b(2), xi

      a = (x(:, edge(2)) - x(:, edge(1))) + (u(:, edge(2)) - u(:, edge(1)))
      b = (x(:, node) - x(:, edge(1))) + (u(:, node) - u(:, edge(1)))
      xi = max(0.0_wp, min(1.0_wp, dot_product(b, a)/dot_product(a, a)))
      b = b - xi*a
      edge_distance = sqrt(dot_product(b, b))
   end function edge_distance

   !> Nodes of the stencil of constraint `i`: slave, edge, and what is there before and after.
   pure subroutine stencil(self, i, x, u0, n, node, before, after)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      integer, intent(out) :: n, node(:), before, after
      integer :: e

      node(1) = self%node(i)
      node(2:3) = self%master%edge(:, self%edge(i))
      n = 3
      before = 0
      after = 0
      e = self%master%previous(self%edge(i))
      if (e > 0) then
         if (is_smooth(x, u0, self%master%edge(1, e), node(2), node(3))) then
            n = n + 1
            before = n
            node(n) = self%master%edge(1, e)
         end if
      end if
      e = self%master%next(self%edge(i))
      if (e > 0) then
         if (is_smooth(x, u0, node(2), node(3), self%master%edge(2, e))) then
            n = n + 1
            after = n
            node(n) = self%master%edge(2, e)
         end if
      end if
   end subroutine stencil

   !> Is the corner a-b-c blunt enough for a bisector?
   pure logical function is_smooth(x, u, a, b, c)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: a, b, c
      real(wp) :: d(2), e(2)

      d = (x(:, b) - x(:, a)) + (u(:, b) - u(:, a))
      e = (x(:, c) - x(:, b)) + (u(:, c) - u(:, b))
      is_smooth = dot_product(d, e) > sharpest_cosine*sqrt(dot_product(d, d)*dot_product(e, e))
   end function is_smooth

   !> Positions of the stencil's nodes at the start relative to its edge, and their motion.
   pure subroutine gather(x, u0, du, n, node, local, dlocal)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      integer, intent(in) :: n, node(:)
      real(wp), intent(out) :: local(:, :), dlocal(:, :)
      integer :: k

      do k = 1, n
         local(:, k) = (x(:, node(k)) - x(:, node(2))) + (u0(:, node(k)) - u0(:, node(2)))
         dlocal(:, k) = du(:, node(k))
      end do
   end subroutine gather

   !> Reference length of the stencil's edge: what gaps are measured against.
   pure real(wp) function edge_length(x, node)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node(:)
      real(wp) :: a(2)

      a = x(:, node(3)) - x(:, node(2))
      edge_length = sqrt(dot_product(a, a))
   end function edge_length

   pure subroutine nts_configure(self, x, options)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(contact_options_t), intent(in) :: options

      self%smoothing = options%smoothing
   end subroutine nts_configure

   pure subroutine nts_measure(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      integer :: i

      do i = 1, self%n_constraint
         self%state(i) = gap_state(self, i, x, u0, du)
      end do
   end subroutine nts_measure

   pure function gap_state(self, i, x, u0, du) result(state)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(gap_state_t) :: state
      integer :: n, node(5), before, after, k
      real(wp) :: local(2, 5), dlocal(2, 5), xi0, xi1, xi

      if (self%edge(i) == 0) return
      call stencil(self, i, x, u0, n, node, before, after)
      call gather(x, u0, du, n, node, local, dlocal)
      state%size = edge_length(x, node)
      call nts_gap_value(local(:, :n), before, after, self%rounding*state%size, state%gap0, xi0)
      do k = 1, n
         local(:, k) = local(:, k) + (dlocal(:, k) - dlocal(:, 2))
      end do
      call nts_gap_value(local(:, :n), before, after, self%rounding*state%size, state%gap1, xi1)
      state%is_near = .true.
      xi = xi0
      if (state%gap1 < 0.0_wp .and. state%gap0 > 0.0_wp) then
         xi = xi0 + (state%gap0/(state%gap0 - state%gap1))*(xi1 - xi0)
      end if
      state%is_over = (before > 0 .or. xi >= -end_tol) .and. (after > 0 .or. xi <= 1.0_wp + end_tol)
      state%is_covered = .true.
      if (xi1 < 0.0_wp .or. xi1 > 1.0_wp) state%is_covered = is_covered(self, i, x, u0, du)
   end function gap_state

   !> Is the edge or one of its neighbours the nearest at the end of the step, rather than the edges
   !> after next?
   pure logical function is_covered(self, i, x, u0, du)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: inside, outside
      integer :: e, k, side

      inside = end_distance(self%edge(i))
      outside = huge(outside)
      do side = 1, 2
         e = self%edge(i)
         do k = 1, 2
            if (e == 0) exit
            e = merge(self%master%previous(e), self%master%next(e), side == 1)
            if (e == 0) exit
            if (k == 1) inside = min(inside, end_distance(e))
            if (k == 2) outside = min(outside, end_distance(e))
         end do
      end do
      is_covered = inside <= outside

   contains

      !> Distance of the slave node from edge `e` at the end of the step.
      pure real(wp) function end_distance(e)
         integer, intent(in) :: e
         real(wp) :: u(2, 3), local(2, 3)

         associate (node => [self%node(i), self%master%edge(:, e)])
            local = x(:, node)
            u = u0(:, node) + du(:, node)
         end associate
         end_distance = edge_distance(local, u, 1, [2, 3])
      end function end_distance

   end function is_covered

   pure subroutine nts_evaluate(self, wanted, x, u0, du, target, item)
      class(nts_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target(:)
      type(constraint_t), intent(inout) :: item(:)
      integer :: n, node(5), before, after, k
      real(wp) :: local(2, 5), dlocal(2, 5)
      type(dg_t) :: gap

      do k = 1, size(wanted)
         call stencil(self, wanted(k), x, u0, n, node, before, after)
         call gather(x, u0, du, n, node, local, dlocal)
         call constraint_resize(item(k), n)
         item(k)%n_slave = 1
         item(k)%node(:n) = node(:n)
         item(k)%size = edge_length(x, node)
         gap = nts_gap(local(:, :n), dlocal(:, :n), before, after, self%rounding*item(k)%size)
         item(k)%gap0 = gap%f0 - target(k)
         item(k)%gap1 = gap%f1 - target(k)
         item(k)%dgap = gap%df
         item(k)%g(:, :n) = reshape(gap%g(:2*n), [2, n])
         item(k)%c(:, :n) = reshape(gap%c(:2*n), [2, n])
         item(k)%h(:2*n, :2*n) = gap%h(:2*n, :2*n)
      end do
   end subroutine nts_evaluate

   pure subroutine nts_area(self, x, u, area, length)
      class(nts_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: area(:), length(:)

      length = 0.0_wp
      if (self%slave%n_edge > 0) call chain_tributary(self%slave, x, u, length)
      area = length*self%thickness
   end subroutine nts_area

   !> Gap at x + u of slave node `i` over the nearest master edge, searched among all edges.
   !> For checks before the first step only. `is_over`: not past an end of the surface.
   pure subroutine nts_nearest(self, i, x, u, gap, is_over)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: gap
      logical, intent(out) :: is_over
      real(wp) :: distance, best
      real(wp) :: zero(size(x, 1), size(x, 2))
      type(gap_state_t) :: state
      integer :: e

      best = huge(best)
      self%edge(i) = 0
      do e = 1, self%master%n_edge
         distance = edge_distance(x, u, self%node(i), self%master%edge(:, e))
         if (distance < best) then
            best = distance
            self%edge(i) = e
         end if
      end do
      zero = 0.0_wp
      state = gap_state(self, i, x, u, zero)
      gap = state%gap0
      is_over = state%is_over
   end subroutine nts_nearest

end module emcon_nts
