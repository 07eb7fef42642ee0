!> Bodies as rigid ones: their motions, and what constraints leave of them.
!>
!> Every body has three motions: along x, along y, and a rotation about its centre in which its
!> farthest node moves by one, so that all entries below are of order one. A node without element
!> that stands in an equation is a body that does not rotate. Prescribed freedoms, ties and
!> equations are rows over these motions; what remains is the null space of all rows.
!>
!> The null space z shrinks row by row: a reflection of its columns leaves one column that the row
!> prevents, which is dropped. The columns stay orthonormal, nothing is squared, and only bodies
!> that the row joins take part. Rows between the same bodies come together, the one that prevents
!> most first. What is left of such a row is compared with round-off: that of weights and
!> coordinates, and that of z, which is the round-off of earlier rows over what they prevented.
module emcon_rigid_bodies
   use emcon_bodies, only : bodies_find
   use emcon_contact, only : constraint_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : prescribed_t, scene_t
   use emcon_sort, only : find_sorted, sort_order, unique_sorted
   use emcon_surface_edges, only : surface_edges
   use emcon_system, only : system_t
   implicit none
   private
   public :: rigid_bodies_t, rigid_rows_t, rigid_bodies_find, rigid_rows_find, find_assemblies
   public :: find_free_motions, motions_as_one, rigid_rows_append, rigid_force, rigid_field

   !> Round-off of an entry of a row of weights with sum 1 over coordinates of size 1: weights of
   !> ties are sums of some ten products, coordinates of slave nodes likewise.
   real(dp), parameter :: rounding = 32.0_dp*max(real(epsilon(1.0_wp), dp), epsilon(1.0_dp))

   !> The bodies: first those of elements and given forces, as numbered in `system_t`, then single
   !> nodes of equations.
   type :: rigid_bodies_t
      integer :: n = 0
      integer :: n_mesh = 0                          !! those of `system_t`
      integer, allocatable :: of_node(:)             !! (n_node) 0: none
      real(wp), allocatable :: x(:, :)               !! (2, n_node) [L]
      real(wp), allocatable :: center(:, :)          !! (2, n) [L]
      real(wp), allocatable :: size(:)               !! (n) largest distance from there, 0: a node
      real(wp), allocatable :: reach(:)              !! (n) largest coordinate over `size`
      logical, allocatable :: is_free(:, :)          !! (3, n) motions that rows may prevent
   end type rigid_bodies_t

   !> Sum of weight times displacement over some degrees of freedom = 0; the weights' sizes sum
   !> up to 1.
   type :: rigid_rows_t
      integer :: n = 0
      integer, allocatable :: start(:)               !! (n + 1) entries before each row, from 0
      integer, allocatable :: dof(:)                 !! places in an (n_dim, n_node) array
      real(wp), allocatable :: weight(:)
      integer, allocatable :: low(:), high(:)        !! (n) first and last body; 0: none is free
      real(dp) :: noise = 0.0_dp                     !! what prevents less prevents nothing
   end type rigid_rows_t

   !> A normal that prevents less of a motion than this, per unit of it, does not hold it: normals
   !> are as exact as displacements that Newton's method has converged to.
   real(dp), parameter :: contact_noise = sqrt(epsilon(1.0_dp))

contains

   !> Prescribed freedoms, then linear constraints.
   subroutine rigid_rows_find(system, prescribed, rows)
      type(system_t), intent(in) :: system
      type(prescribed_t), intent(in) :: prescribed(:)
      type(rigid_rows_t), intent(out) :: rows
      real(wp) :: total
      integer :: k, m, n, n_linear

      m = size(prescribed)
      n_linear = 0
      if (allocated(system%linear%start)) n_linear = system%linear%n
      n = m
      if (n_linear > 0) n = m + system%linear%start(n_linear + 1)
      rows%n = m + n_linear
      allocate(rows%start(rows%n + 1), rows%dof(n), rows%weight(n))
      rows%start(:m + 1) = [(k, k = 0, m)]
      do k = 1, m
         rows%dof(k) = 2*(prescribed(k)%node - 1) + prescribed(k)%dof
         rows%weight(k) = 1.0_wp
      end do
      do k = 1, n_linear
         associate (from => system%linear%start(k) + 1, to => system%linear%start(k + 1))
            total = sum(abs(system%linear%weight(from:to)))
            if (.not. total > 0.0_wp) total = 1.0_wp
            rows%start(m + k + 1) = m + to
            rows%dof(m + from:m + to) = system%linear%dof(from:to)
            rows%weight(m + from:m + to) = system%linear%weight(from:to)/total
         end associate
      end do
   end subroutine rigid_rows_find

   !> Append the rows of contact: the gradients of gaps at the end.
   subroutine rigid_rows_append(rows, item)
      type(rigid_rows_t), intent(inout) :: rows
      type(constraint_t), intent(in) :: item(:)
      integer :: k, i, a, n
      real(wp) :: total

      if (size(item) == 0) return
      rows%noise = contact_noise
      n = rows%start(rows%n + 1)
      rows%start = [rows%start, (n + 2*sum(item(:k)%n_node), k = 1, size(item))]
      rows%dof = [rows%dof, spread(0, 1, 2*sum(item%n_node))]
      rows%weight = [rows%weight, spread(0.0_wp, 1, 2*sum(item%n_node))]
      rows%n = rows%n + size(item)
      do k = 1, size(item)
         total = sum(abs(item(k)%c(:, :item(k)%n_node)))
         if (.not. total > 0.0_wp) total = 1.0_wp
         do i = 1, item(k)%n_node
            do a = 1, 2
               n = n + 1
               rows%dof(n) = 2*(item(k)%node(i) - 1) + a
               rows%weight(n) = item(k)%c(a, i)/total
            end do
         end do
      end do
   end subroutine rigid_rows_append

   !> Bodies at `x`, and which of their motions need to be prevented. Those of bodies that contact
   !> (`contact_holds`) or a given force (`given_holds`) may hold need not.
   subroutine rigid_bodies_find(system, scene, x, rows, contact_holds, given_holds, bodies)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: x(:, :)                !! (2, n_node) [L]
      type(rigid_rows_t), intent(in) :: rows
      logical, intent(in) :: contact_holds, given_holds
      type(rigid_bodies_t), intent(out) :: bodies
      logical :: is_in_row(2, size(scene%x, 2)), touches(system%n_body)
      integer :: i, k, b

      is_in_row = .false.
      do k = 1, size(rows%dof)
         is_in_row(2 - mod(rows%dof(k), 2), (rows%dof(k) + 1)/2) = .true.
      end do
      allocate(bodies%of_node, source=system%body)
      allocate(bodies%x, source=x)
      bodies%n_mesh = system%n_body
      bodies%n = system%n_body
      do i = 1, size(bodies%of_node)
         if (bodies%of_node(i) > 0 .or. .not. any(is_in_row(:, i))) cycle
         bodies%n = bodies%n + 1
         bodies%of_node(i) = bodies%n
      end do
      touches = .false.
      if (contact_holds) then
         do k = 1, system%n_pair
            call mark_contact_bodies(system, scene, k, touches)
         end do
      end if
      if (given_holds .and. system%given%is_any) then
         touches(pack(system%body, system%given%has_force)) = .true.
      end if
      allocate(bodies%is_free(3, bodies%n), source=.false.)
      do b = 1, bodies%n_mesh
         bodies%is_free(:, b) = .not. touches(b)
      end do
      do i = 1, size(bodies%of_node)
         b = bodies%of_node(i)
         if (b > bodies%n_mesh) bodies%is_free(:2, b) = is_in_row(:, i)
      end do
      call measure_bodies(bodies)
      bodies%is_free(3, :) = bodies%is_free(3, :) .and. bodies%size > 0.0_wp
   end subroutine rigid_bodies_find

   !> Centres and sizes.
   pure subroutine measure_bodies(bodies)
      type(rigid_bodies_t), intent(inout) :: bodies
      integer :: n_node(bodies%n), i, b

      n_node = 0
      allocate(bodies%center(2, bodies%n), source=0.0_wp)
      allocate(bodies%size(bodies%n), bodies%reach(bodies%n), source=0.0_wp)
      do i = 1, size(bodies%of_node)
         b = bodies%of_node(i)
         if (b == 0) cycle
         n_node(b) = n_node(b) + 1
         bodies%center(:, b) = bodies%center(:, b) + bodies%x(:, i)
      end do
      do b = 1, bodies%n
         bodies%center(:, b) = bodies%center(:, b)/real(n_node(b), wp)
      end do
      do i = 1, size(bodies%of_node)
         b = bodies%of_node(i)
         if (b == 0) cycle
         bodies%reach(b) = max(bodies%reach(b), maxval(abs(bodies%x(:, i))))
         bodies%size(b) = max(bodies%size(b), maxval(abs(bodies%x(:, i) - bodies%center(:, b))))
      end do
      bodies%size(bodies%n_mesh + 1:) = 0.0_wp
      where (bodies%size > 0.0_wp)
         bodies%reach = bodies%reach/bodies%size
      else where
         bodies%reach = 0.0_wp
      end where
   end subroutine measure_bodies

   subroutine mark_contact_bodies(system, scene, pair, touches)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      logical, intent(inout) :: touches(:)
      integer, allocatable :: edge(:, :), node(:)
      integer :: i, surface(2)

      surface = [scene%pair(pair)%slave, scene%pair(pair)%master]
      do i = 1, 2
         associate (s => scene%surface(surface(i)))
            call surface_edges(scene, s, edge)
            if (s%is_nodal) then
               node = s%node
            else
               node = edge(1, :)
            end if
         end associate
         touches(pack(system%body(node), system%body(node) > 0)) = .true.
      end do
   end subroutine mark_contact_bodies

   !> Bodies that rows join, and the rows in the order of assemblies, then of the bodies that they
   !> join. Held bodies join nothing.
   subroutine find_assemblies(bodies, rows, assembly, n_assembly, order)
      type(rigid_bodies_t), intent(in) :: bodies
      type(rigid_rows_t), intent(inout) :: rows
      integer, allocatable, intent(out) :: assembly(:)   !! (bodies) 0: held
      integer, intent(out) :: n_assembly                 !! in the order of their first bodies
      integer, allocatable, intent(out) :: order(:)      !! (rows that join or hold something)
      integer, allocatable :: link(:, :)
      integer :: n, k, s, b

      allocate(link(2, bodies%n + size(rows%dof)))
      n = 0
      do b = 1, bodies%n
         if (any(bodies%is_free(:, b))) call add_link(b, b)
      end do
      allocate(rows%low(rows%n), rows%high(rows%n), source=0)
      do k = 1, rows%n
         do s = rows%start(k) + 1, rows%start(k + 1)
            b = free_body(bodies, rows%dof(s))
            if (b == 0) cycle
            if (rows%low(k) == 0) rows%low(k) = b
            call add_link(rows%low(k), b)
            rows%low(k) = min(rows%low(k), b)
            rows%high(k) = max(rows%high(k), b)
         end do
      end do
      call bodies_find(link(:, :n), bodies%n, assembly, n_assembly)
      order = pack([(k, k = 1, rows%n)], rows%low > 0)
      order = order(sort_order(rows%high(order)))
      order = order(sort_order(rows%low(order)))
      order = order(sort_order(assembly(rows%low(order))))

   contains

      subroutine add_link(first, second)
         integer, intent(in) :: first, second

         n = n + 1
         link(:, n) = [first, second]
      end subroutine add_link

   end subroutine find_assemblies

   !> The body of a degree of freedom, 0 if none or if it is held.
   pure integer function free_body(bodies, dof)
      type(rigid_bodies_t), intent(in) :: bodies
      integer, intent(in) :: dof

      free_body = bodies%of_node((dof + 1)/2)
      if (free_body == 0) return
      if (.not. any(bodies%is_free(:, free_body))) free_body = 0
   end function free_body

   !> What the rows `list` leave of the motions of an assembly.
   subroutine find_free_motions(bodies, rows, list, member, z, noise)
      type(rigid_bodies_t), intent(in) :: bodies
      type(rigid_rows_t), intent(in) :: rows
      integer, intent(in) :: list(:)                     !! rows between the same bodies in a row
      integer, intent(in) :: member(:)                   !! bodies of the assembly, ascending
      real(dp), allocatable, intent(out) :: z(:, :)      !! (3*members, n) orthonormal columns
      real(dp), intent(out) :: noise                     !! size of the round-off in `z`
      real(dp), allocatable :: a(:, :), basis(:, :)
      real(dp) :: own_noise, smallest
      integer, allocatable :: motion(:)
      integer :: i, j, n, first, last

      allocate(basis(3*size(member), 3*size(member)), source=0.0_dp)
      n = 0
      do i = 1, size(member)
         do j = 1, 3
            if (.not. bodies%is_free(j, member(i))) cycle
            n = n + 1
            basis(3*(i - 1) + j, n) = 1.0_dp
         end do
      end do
      noise = max(rounding, rows%noise)
      last = 0
      do while (last < size(list) .and. n > 0)
         first = last + 1
         last = first
         do while (last < size(list))
            if (rows%low(list(last + 1)) /= rows%low(list(first))) exit
            if (rows%high(list(last + 1)) /= rows%high(list(first))) exit
            last = last + 1
         end do
         call find_entries(bodies, rows, list(first:last), member, a, motion, own_noise)
         call prevent(a, motion, max(own_noise, noise), basis, n, smallest)
         if (smallest > 0.0_dp) noise = max(noise, own_noise/smallest)
      end do
      allocate(z, source=basis(:, :n))
   end subroutine find_free_motions

   !> Rows over the motions of the bodies that they join.
   subroutine find_entries(bodies, rows, list, member, a, motion, noise)
      type(rigid_bodies_t), intent(in) :: bodies
      type(rigid_rows_t), intent(in) :: rows
      integer, intent(in) :: list(:)
      integer, intent(in) :: member(:)
      real(dp), allocatable, intent(out) :: a(:, :)      !! (rows, motions)
      integer, allocatable, intent(out) :: motion(:)     !! (motions) places in those of all members
      real(dp), intent(out) :: noise                     !! bound of what round-off makes of `a`
      integer, allocatable :: joined_body(:)
      integer :: i, k, s, b, n

      n = 0
      allocate(joined_body(sum(rows%start(list + 1) - rows%start(list))))
      do i = 1, size(list)
         do s = rows%start(list(i)) + 1, rows%start(list(i) + 1)
            b = free_body(bodies, rows%dof(s))
            if (b == 0) cycle
            n = n + 1
            joined_body(n) = b
         end do
      end do
      joined_body = unique_sorted(joined_body(:n))
      allocate(motion(3*size(joined_body)))
      do i = 1, size(joined_body)
         motion(3*i - 2:3*i) = 3*find_sorted(member, joined_body(i)) + [-2, -1, 0]
      end do
      allocate(a(size(list), size(motion)), source=0.0_dp)
      do i = 1, size(list)
         do s = rows%start(list(i)) + 1, rows%start(list(i) + 1)
            b = free_body(bodies, rows%dof(s))
            if (b == 0) cycle
            k = 3*find_sorted(joined_body, b)
            a(i, k - 2:k) = a(i, k - 2:k) + real(rows%weight(s)*entry(bodies, b, rows%dof(s)), dp)
         end do
      end do
      ! The Frobenius norm of the errors of all entries.
      noise = rounding*(1.0_dp + real(maxval(bodies%reach(joined_body)), dp)) &
         *sqrt(real(size(a), dp))
   end subroutine find_entries

   !> What forces on the nodes do over the motions of an assembly, and the sum of their sizes.
   pure subroutine rigid_force(bodies, member, force, total, magnitude)
      type(rigid_bodies_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(wp), intent(in) :: force(:, :)                !! (2, n_node)
      real(dp), intent(out) :: total(:)                  !! (3*members)
      real(dp), intent(out) :: magnitude
      integer :: i, a, m

      total = 0.0_dp
      magnitude = 0.0_dp
      do i = 1, size(bodies%of_node)
         if (bodies%of_node(i) == 0) cycle
         m = findloc(member, bodies%of_node(i), 1)
         if (m == 0) cycle
         do a = 1, 2
            total(3*m - 2:3*m) = total(3*m - 2:3*m) &
               + real(entry(bodies, member(m), 2*(i - 1) + a)*force(a, i), dp)
         end do
         magnitude = magnitude + real(sum(abs(force(:, i))), dp)
      end do
   end subroutine rigid_force

   !> How the motion `z` of an assembly moves the nodes; those of others stay.
   pure subroutine rigid_field(bodies, member, z, field)
      type(rigid_bodies_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(dp), intent(in) :: z(:)                       !! (3*members)
      real(wp), intent(out) :: field(:, :)               !! (2, n_node)
      integer :: i, a, m

      field = 0.0_wp
      do i = 1, size(bodies%of_node)
         if (bodies%of_node(i) == 0) cycle
         m = findloc(member, bodies%of_node(i), 1)
         if (m == 0) cycle
         do a = 1, 2
            field(a, i) = dot_product(entry(bodies, member(m), 2*(i - 1) + a), &
               real(z(3*m - 2:3*m), wp))
         end do
      end do
   end subroutine rigid_field

   !> What the three motions of body `b` do to a degree of freedom.
   pure function entry(bodies, b, dof)
      type(rigid_bodies_t), intent(in) :: bodies
      integer, intent(in) :: b, dof
      real(wp) :: entry(3), arm(2)
      integer :: a

      a = 2 - mod(dof, 2)
      entry = 0.0_wp
      entry(a) = 1.0_wp
      if (.not. bodies%size(b) > 0.0_wp) return
      arm = (bodies%x(:, (dof + 1)/2) - bodies%center(:, b))/bodies%size(b)
      entry(3) = merge(-arm(2), arm(1), a == 1)
   end function entry

   !> Shrink the first `n` columns of `z` to those combinations with a z = 0 up to `noise`.
   pure subroutine prevent(a, motion, noise, z, n, smallest)
      real(dp), intent(in) :: a(:, :)                    !! (rows, motions)
      integer, intent(in) :: motion(:)                   !! (motions) rows of `z`
      real(dp), intent(in) :: noise
      real(dp), intent(inout), contiguous :: z(:, :)     !! orthonormal columns
      integer, intent(inout) :: n
      real(dp), intent(out) :: smallest                  !! that was prevented; 0: nothing was
      real(dp) :: left(size(a, 1), n), v(n)
      integer :: column(n), j, k, m

      m = 0
      do j = 1, n
         if (all(z(motion, j) == 0.0_dp)) cycle
         m = m + 1
         column(m) = j
         left(:, m) = matmul(a, z(motion, j))
      end do
      smallest = 0.0_dp
      do while (m > 0)
         k = maxloc(sum(left(:, :m)**2, dim=2), dim=1)
         v(:m) = left(k, :m)
         if (norm2(v(:m)) <= noise) exit
         smallest = norm2(v(:m))
         ! The reflection that leaves of the row its last entry alone.
         v(m) = v(m) + sign(norm2(v(:m)), v(m))
         v(:m) = v(:m)/norm2(v(:m))
         call reflect(left, [(j, j = 1, m)], v(:m))
         call reflect(z, column(:m), v(:m))
         z(:, column(m)) = z(:, n)
         n = n - 1
         m = m - 1
      end do
   end subroutine prevent

   !> x (1 - 2 v v^T) over some columns of x.
   pure subroutine reflect(x, column, v)
      real(dp), intent(inout), contiguous :: x(:, :)
      integer, intent(in) :: column(:)
      real(dp), intent(in) :: v(:)                       !! (columns) of length 1
      real(dp) :: product(size(x, 1))
      integer :: j

      product = 0.0_dp
      do j = 1, size(column)
         product = product + x(:, column(j))*v(j)
      end do
      do j = 1, size(column)
         x(:, column(j)) = x(:, column(j)) - product*(2.0_dp*v(j))
      end do
   end subroutine reflect

   !> Motions of all bodies as one: along x, along y, and a rotation. A node does not rotate.
   pure function motions_as_one(bodies, member) result(g)
      type(rigid_bodies_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(dp) :: g(3*size(member), 3)
      real(wp) :: center(2), extent
      integer :: i

      center = sum(bodies%center(:, member), dim=2)/real(size(member), wp)
      extent = 0.0_wp
      do i = 1, size(member)
         extent = max(extent, bodies%size(member(i)) &
            + maxval(abs(bodies%center(:, member(i)) - center)))
      end do
      g = 0.0_dp
      do i = 1, size(member)
         g(3*i - 2, 1) = 1.0_dp
         g(3*i - 1, 2) = 1.0_dp
         g(3*i, 3) = 1.0_dp
         if (.not. bodies%size(member(i)) > 0.0_wp) cycle
         associate (arm => (bodies%center(:, member(i)) - center)/extent)
            g(3*i - 2:3*i, 3) = real([-arm(2), arm(1), bodies%size(member(i))/extent], dp)
         end associate
      end do
   end function motions_as_one

end module emcon_rigid_bodies
