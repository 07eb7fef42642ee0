!> Bodies as rigid ones, and their motions.
!>
!> Every body has n_motion motions: along each axis, and rotations about its centre, in the plane
!> one, in space three, in which its farthest node moves by one, so that what they do to a degree
!> of freedom is of order one. A solid of revolution has that along y alone. A node without element
!> that stands in an equation does not rotate.
module emcon_mechanisms
   use emcon_kinds, only : dp, wp
   use emcon_mechanism_rows, only : mechanism_rows_t
   use emcon_rotation, only : cross_product, n_turn
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_square
   use emcon_surface_nodes, only : surface_nodes
   use emcon_system, only : system_may_hold, system_t
   implicit none
   private
   public :: mechanisms_t, mechanisms_find, mechanism_free, mechanism_places, rigid_motions_at
   public :: rigid_motions_as_one, mechanism_force, mechanism_field, held_places

   !> The bodies: first those of elements and given forces, as numbered in `system_t`, then single
   !> nodes of equations.
   type :: mechanisms_t
      integer :: n_dim = 0
      integer :: n_motion = 0                        !! of each body
      integer :: n = 0
      integer :: n_mesh = 0                          !! those of `system_t`
      integer, allocatable :: of_node(:)             !! (n_node) 0: none
      real(wp), allocatable :: x(:, :)               !! (n_dim, n_node) [L]
      real(wp), allocatable :: center(:, :)          !! (n_dim, n) [L]
      real(wp), allocatable :: size(:)               !! (n) largest distance from there, 0: a node
      real(wp), allocatable :: reach(:)              !! (n) largest coordinate over `size`
      logical, allocatable :: is_free(:, :)          !! (n_motion, n) motions that rows may prevent
   end type mechanisms_t

contains

   !> Where supports hold bodies: as they lie at `u` where displacements are large, else at rest.
   pure function held_places(system, scene, u) result(x)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp) :: x(size(u, 1), size(u, 2))      !! [L]

      x = scene%x + step_square(scene%step(system%i_step))*u
   end function held_places

   !> Bodies at `x`, and which of their motions need to be prevented. Those of bodies that contact
   !> (`contact_holds`) or a given force or constraint (`host_holds`) may hold need not.
   subroutine mechanisms_find(system, scene, x, rows, contact_holds, host_holds, bodies)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: x(:, :)                !! (n_dim, n_node) [L]
      type(mechanism_rows_t), intent(in) :: rows
      logical, intent(in) :: contact_holds, host_holds
      type(mechanisms_t), intent(out) :: bodies
      logical :: is_in_row(size(x, 1), size(x, 2)), touches(system%space%n_body)
      logical, dimension(size(scene%x, 2)) :: by_forces, by_constraints
      integer :: i, k, b

      bodies%n_dim = size(x, 1)
      bodies%n_motion = bodies%n_dim + n_turn(bodies%n_dim)
      is_in_row = .false.
      do k = 1, size(rows%dof)
         is_in_row(axis_of(bodies, rows%dof(k)), node_of(bodies, rows%dof(k))) = .true.
      end do
      allocate(bodies%of_node, source=system%space%body)
      allocate(bodies%x, source=x)
      bodies%n_mesh = system%space%n_body
      bodies%n = system%space%n_body
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
      if (host_holds) then
         call system_may_hold(system, by_forces, by_constraints)
         touches(pack(system%space%body, (by_forces .or. by_constraints) &
            .and. system%space%body > 0)) = .true.
      end if
      allocate(bodies%is_free(bodies%n_motion, bodies%n), source=.false.)
      do b = 1, bodies%n_mesh
         bodies%is_free(:, b) = system%space%has_motion .and. .not. touches(b)
      end do
      do i = 1, size(bodies%of_node)
         b = bodies%of_node(i)
         if (b > bodies%n_mesh) bodies%is_free(:bodies%n_dim, b) = is_in_row(:, i)
      end do
      call measure_bodies(bodies)
      do b = 1, bodies%n
         if (.not. bodies%size(b) > 0.0_wp) bodies%is_free(bodies%n_dim + 1:, b) = .false.
      end do
   end subroutine mechanisms_find

   subroutine mark_contact_bodies(system, scene, pair, touches)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      logical, intent(inout) :: touches(:)
      integer, allocatable :: node(:)
      integer :: i, surface(2)

      surface = [scene%pair(pair)%slave, scene%pair(pair)%master]
      do i = 1, size(surface)
         call surface_nodes(scene, scene%surface(surface(i)), node)
         touches(pack(system%space%body(node), system%space%body(node) > 0)) = .true.
      end do
   end subroutine mark_contact_bodies

   !> Centres and sizes.
   pure subroutine measure_bodies(bodies)
      type(mechanisms_t), intent(inout) :: bodies
      integer :: n_node(bodies%n), i, b

      n_node = 0
      allocate(bodies%center(bodies%n_dim, bodies%n), source=0.0_wp)
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

   !> The body of a degree of freedom, 0 if none or if it is held.
   pure integer function mechanism_free(bodies, dof)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: dof

      mechanism_free = bodies%of_node(node_of(bodies, dof))
      if (mechanism_free == 0) return
      if (.not. any(bodies%is_free(:, mechanism_free))) mechanism_free = 0
   end function mechanism_free

   !> Places of the motions of the k-th of some bodies among those of all of them.
   pure function mechanism_places(bodies, k) result(place)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: k                       !! > 0
      integer :: place(bodies%n_motion), j

      place = [(bodies%n_motion*(k - 1) + j, j = 1, bodies%n_motion)]
   end function mechanism_places

   !> The node of a degree of freedom, and its axis.
   pure integer function node_of(bodies, dof)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: dof

      node_of = (dof - 1)/bodies%n_dim + 1
   end function node_of

   pure integer function axis_of(bodies, dof)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: dof

      axis_of = dof - bodies%n_dim*(node_of(bodies, dof) - 1)
   end function axis_of

   !> The motion at an arm from the centre in a turn of one about each axis, in the plane z.
   pure function turn_field(arm) result(field)
      real(wp), intent(in) :: arm(:)                 !! (n_dim) [L]
      real(wp) :: field(size(arm), n_turn(size(arm)))
      integer, parameter :: n_axis = 3
      real(wp) :: axis(n_axis), at(n_axis), velocity(n_axis)
      integer :: k

      at = 0.0_wp
      at(:size(arm)) = arm
      do k = 1, size(field, 2)
         axis = 0.0_wp
         axis(k + n_axis - size(field, 2)) = 1.0_wp
         velocity = cross_product(axis, at)
         field(:, k) = velocity(:size(arm))
      end do
   end function turn_field

   !> What the motions of body `b` do to a degree of freedom.
   pure function rigid_motions_at(bodies, b, dof) result(motion)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: b, dof
      real(wp) :: motion(bodies%n_motion), turn(bodies%n_dim, bodies%n_motion - bodies%n_dim)
      integer :: a

      a = axis_of(bodies, dof)
      motion = 0.0_wp
      motion(a) = 1.0_wp
      if (.not. bodies%size(b) > 0.0_wp) return
      turn = turn_field((bodies%x(:, node_of(bodies, dof)) - bodies%center(:, b))/bodies%size(b))
      motion(bodies%n_dim + 1:) = turn(a, :)
   end function rigid_motions_at

   !> Motions of all bodies as one: along the axes, and rotations. A node does not rotate.
   pure function rigid_motions_as_one(bodies, member) result(g)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(dp) :: g(bodies%n_motion*size(member), bodies%n_motion)
      real(wp) :: center(bodies%n_dim), extent
      integer :: place(bodies%n_motion), i, j

      center = sum(bodies%center(:, member), dim=2)/real(max(1, size(member)), wp)
      extent = 0.0_wp
      do i = 1, size(member)
         extent = max(extent, bodies%size(member(i)) &
            + maxval(abs(bodies%center(:, member(i)) - center)))
      end do
      g = 0.0_dp
      do i = 1, size(member)
         place = mechanism_places(bodies, i)
         do j = 1, bodies%n_motion
            g(place(j), j) = 1.0_dp
         end do
         if (.not. bodies%size(member(i)) > 0.0_wp) cycle
         associate (n_dim => bodies%n_dim)
            g(place(:n_dim), n_dim + 1:) = real(turn_field((bodies%center(:, member(i)) &
               - center)/extent), dp)
            do j = n_dim + 1, bodies%n_motion
               g(place(j), j) = real(bodies%size(member(i))/extent, dp)
            end do
         end associate
      end do
   end function rigid_motions_as_one

   !> What forces on the nodes do over the motions of an assembly, and the sum of their sizes.
   pure subroutine mechanism_force(bodies, member, force, total, magnitude)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(wp), intent(in) :: force(:, :)                !! (n_dim, n_node)
      real(dp), intent(out) :: total(:)                  !! (n_motion*members)
      real(dp), intent(out) :: magnitude
      integer :: place(bodies%n_motion), i, a, m

      total = 0.0_dp
      magnitude = 0.0_dp
      do i = 1, size(bodies%of_node)
         if (bodies%of_node(i) == 0) cycle
         m = findloc(member, bodies%of_node(i), 1)
         if (m == 0) cycle
         place = mechanism_places(bodies, m)
         do a = 1, bodies%n_dim
            total(place) = total(place) + real(rigid_motions_at(bodies, member(m), &
               bodies%n_dim*(i - 1) + a)*force(a, i), dp)
         end do
         magnitude = magnitude + real(sum(abs(force(:, i))), dp)
      end do
   end subroutine mechanism_force

   !> How the motion `z` of an assembly moves the nodes; those of others stay.
   pure subroutine mechanism_field(bodies, member, z, field)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(dp), intent(in) :: z(:)                       !! (n_motion*members)
      real(wp), intent(out) :: field(:, :)               !! (n_dim, n_node)
      integer :: i, a, m

      field = 0.0_wp
      do i = 1, size(bodies%of_node)
         if (bodies%of_node(i) == 0) cycle
         m = findloc(member, bodies%of_node(i), 1)
         if (m == 0) cycle
         do a = 1, bodies%n_dim
            field(a, i) = dot_product(rigid_motions_at(bodies, member(m), &
               bodies%n_dim*(i - 1) + a), real(z(mechanism_places(bodies, m)), wp))
         end do
      end do
   end subroutine mechanism_field

end module emcon_mechanisms
