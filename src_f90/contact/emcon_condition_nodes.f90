! build: elements
!> Room for the nodes of a condition and its derivatives.
module emcon_condition_nodes
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: condition_resize, condition_resize_slip, condition_include, condition_fold, &
      condition_take_slip, nodes_append

contains

   !> Make room for `n` nodes and count them.
   pure subroutine condition_resize(self, n, n_dim)
      type(condition_t), intent(inout) :: self
      integer, intent(in) :: n                   !! > 0
      integer, intent(in), optional :: n_dim     !! none: the plane's
      integer :: d

      d = 2
      if (present(n_dim)) d = n_dim
      self%n_node = n
      if (allocated(self%node)) then
         if (size(self%node) >= n) return
         deallocate(self%node, self%g, self%c, self%h)
      end if
      allocate(self%node(n), source=0)
      allocate(self%g(d, n), self%c(d, n), self%h(d*n, d*n), source=0.0_wp)
   end subroutine condition_resize

   !> Let a condition depend on the nodes `node` too, so far by nothing.
   pure subroutine condition_include(self, node)
      type(condition_t), intent(inout) :: self   !! with its values and derivatives
      integer, intent(in) :: node(:)             !! of the scene; not of the slave side if new
      type(condition_t) :: old
      integer :: n, list(self%n_node + size(node)), n_dim

      n = self%n_node
      list(:n) = self%node(:n)
      call nodes_append(node, list, n)
      if (n == self%n_node) return
      old = self
      n_dim = size(self%g, 1)
      call condition_resize(self, n, n_dim)
      self%node(:n) = list(:n)
      self%g = 0.0_wp
      self%c = 0.0_wp
      self%h = 0.0_wp
      associate (m => old%n_node)
         self%g(:, :m) = old%g(:, :m)
         self%c(:, :m) = old%c(:, :m)
         if (.not. self%leaves_second) self%h(:n_dim*m, :n_dim*m) = old%h(:n_dim*m, :n_dim*m)
         if (.not. self%has_friction .or. .not. allocated(old%t)) return
         if (size(old%t, 2) < m) return          ! of another evaluation: slip is not known yet
         call condition_resize_slip(self)
         self%slip = old%slip
         self%t(:, :m, :) = old%t(:, :m, :)
         self%t1(:, :m, :) = old%t1(:, :m, :)
         if (.not. self%leaves_second) self%ht(:n_dim*m, :n_dim*m, :) = &
            old%ht(:n_dim*m, :n_dim*m, :)
      end associate
   end subroutine condition_include

   !> The slip of a condition over one motion, and its gradient at the end, for the same one over
   !> another: what gaps depend on differs from motion to motion, and so do their nodes.
   pure subroutine condition_take_slip(self, over)
      type(condition_t), intent(inout) :: self   !! with friction
      type(condition_t), intent(in) :: over      !! whose slip it is
      logical :: is_missing(over%n_node)
      integer :: place(over%n_node), j

      do j = 1, over%n_node
         is_missing(j) = any(abs(over%t1(:, j, :)) > 0.0_wp) .and. &
            .not. any(self%node(:self%n_node) == over%node(j))
      end do
      call condition_include(self, pack(over%node(:over%n_node), is_missing))
      place = [(findloc(self%node(:self%n_node), over%node(j), 1), j = 1, over%n_node)]
      self%slip = over%slip
      self%t1 = 0.0_wp
      do j = 1, over%n_node
         if (place(j) > 0) self%t1(:, place(j), :) = self%t1(:, place(j), :) + over%t1(:, j, :)
      end do
   end subroutine condition_take_slip

   !> Let a condition depend on nodes alone in the place of nodes and images of them in planes of
   !> symmetry, which move as they do but against the axis of each plane.
   pure subroutine condition_fold(self, flip)
      type(condition_t), intent(inout) :: self   !! with its values and derivatives
      integer, intent(in) :: flip(:)             !! (n_node) planes of each, a bit for each axis
      integer :: of(size(flip)), node(size(flip)), a, i, n, n_slave, s

      n = 0
      node = 0
      call nodes_append(self%node(:size(flip)), node, n)
      n_slave = 0
      do i = 1, size(flip)
         of(i) = findloc(node(:n), self%node(i), 1)
         if (i <= self%n_slave) n_slave = max(n_slave, of(i))
      end do
      associate (d => size(self%g, 1))
         associate (sign => [((merge(-1.0_wp, 1.0_wp, btest(flip(i), a)), a = 0, d - 1), i = 1, &
               size(flip))], to => [((d*(of(i) - 1) + a, a = 1, d), i = 1, size(flip))])
            call fold(sign, to, self%g)
            call fold(sign, to, self%c)
            if (.not. self%leaves_second) call fold_twice(sign, to, self%h)
            if (self%has_friction) then
               do s = 1, d - 1
                  call fold(sign, to, self%t(:, :, s))
                  call fold(sign, to, self%t1(:, :, s))
                  if (.not. self%leaves_second) call fold_twice(sign, to, self%ht(:, :, s))
               end do
            end if
         end associate
      end associate
      self%n_node = n
      self%n_slave = n_slave
      self%node(:n) = node(:n)
   end subroutine condition_fold

   !> Sum up derivatives by components, each times `sign`, at component `to`.
   pure subroutine fold(sign, to, part)
      real(wp), intent(in) :: sign(:)
      integer, intent(in) :: to(:)
      real(wp), intent(inout) :: part(:, :)      !! (n_dim, any)
      real(wp) :: all_of_it(size(part))
      integer :: k

      all_of_it = 0.0_wp
      do k = 1, size(to)
         all_of_it(to(k)) = all_of_it(to(k)) + sign(k)*part(1 + mod(k - 1, size(part, 1)), &
            1 + (k - 1)/size(part, 1))
      end do
      part = reshape(all_of_it, shape(part))
   end subroutine fold

   !> The same of second derivatives.
   pure subroutine fold_twice(sign, to, part)
      real(wp), intent(in) :: sign(:)
      integer, intent(in) :: to(:)
      real(wp), intent(inout) :: part(:, :)
      real(wp) :: all_of_it(size(part, 1), size(part, 2))
      integer :: j, k

      all_of_it = 0.0_wp
      do k = 1, size(to)
         do j = 1, size(to)
            all_of_it(to(j), to(k)) = all_of_it(to(j), to(k)) + sign(j)*sign(k)*part(j, k)
         end do
      end do
      part = all_of_it
   end subroutine fold_twice

   !> Append those of `node` that are nodes and not among list(:n) yet.
   pure subroutine nodes_append(node, list, n)
      integer, intent(in) :: node(:)             !! of the scene; 0: none
      integer, intent(inout) :: list(:), n       !! with room for all of them
      integer :: i

      do i = 1, size(node)
         if (node(i) == 0 .or. any(list(:n) == node(i))) cycle
         n = n + 1
         list(n) = node(i)
      end do
   end subroutine nodes_append

   !> Make room for the derivatives of slip, and set them to 0.
   pure subroutine condition_resize_slip(self)
      type(condition_t), intent(inout) :: self   !! resized

      if (allocated(self%t)) then
         if (size(self%t, 2) /= size(self%g, 2) .or. size(self%t1, 2) /= size(self%g, 2) .or. &
            size(self%ht, 1) /= size(self%h, 1)) deallocate(self%t, self%t1, self%ht)
      end if
      associate (n_dim => size(self%g, 1), n => size(self%g, 2), m => size(self%h, 1))
         if (.not. allocated(self%t)) allocate(self%t(n_dim, n, n_dim - 1), &
            self%t1(n_dim, n, n_dim - 1), self%ht(m, m, n_dim - 1), source=0.0_wp)
      end associate
      self%slip = 0.0_wp
      self%t = 0.0_wp
      self%t1 = 0.0_wp
      if (.not. self%leaves_second) self%ht = 0.0_wp
   end subroutine condition_resize_slip

end module emcon_condition_nodes
