!> What conditions, forces and equations say along the axes of *TRANSFORM, in the axes of the model.
!>
!> Forces and terms of equations become their components. A displacement that is prescribed along
!> an axis of the model stays one; any other is prescribed at the stand-in of its node, which is
!> made for it. Source: docs/theory.md, section 10.
module emcon_deck_turned
   use emcon_couplings, only : equation_t
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_moment, load_point, load_t, prescribed_find, prescribed_t, step_t
   use emcon_text, only : to_text
   use emcon_turned_axes, only : aligned_with, turned_axes_t, turned_marks
   implicit none
   private
   public :: turn_conditions, turn_equation

   !> Degrees of freedom up to this one are across the axis of a cylinder.
   integer, parameter :: last_across = 2

contains

   !> All conditions and forces of all steps.
   subroutine turn_conditions(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer, allocatable :: mark(:)
      logical :: is_told(size(scene%node%label))
      integer :: i

      if (size(scene%node%turned) == 0) return
      allocate(mark, source=turned_marks(scene%node%turned, size(scene%node%label)))
      is_told = .false.
      do i = 1, size(scene%step)
         call check_step(reader, scene, mark, scene%step(i), is_told)
      end do
      call add_stand_ins(scene, mark)
      do i = 1, size(scene%step)
         call turn_prescribed(scene%node%turned, mark, scene%n_dim, scene%step(i)%prescribed)
         call turn_loads(scene%node%turned, mark, scene%n_dim, scene%step(i)%load)
      end do
   end subroutine turn_conditions

   !> What a step prescribes, and its forces, suit the axes of their nodes.
   subroutine check_step(reader, scene, mark, step, is_told)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: mark(:)
      type(step_t), intent(in) :: step
      logical, intent(inout) :: is_told(:)           !! (n_node)
      integer :: k, other

      do k = 1, size(step%turn)
         associate (angle => step%turn(k)%angle(1))
            call check_node(reader, scene, mark, "*BOUNDARY", angle%origin, angle%node, is_told)
         end associate
      end do
      do k = 1, size(step%prescribed)
         associate (new => step%prescribed(k))
            if (new%turn > 0) cycle
            call check_node(reader, scene, mark, "*BOUNDARY", new%origin, new%node, is_told)
            other = 0
            if (new%dof <= last_across) other = prescribed_find(step%prescribed, new%node, &
               last_across + 1 - new%dof)
            if (new%dof > last_across .or. (other > 0 .and. .not. abs(new%value) > 0.0_wp)) cycle
            call check_across(reader, scene, mark, "*BOUNDARY", new%origin, new%node, is_told)
         end associate
      end do
      do k = 1, size(step%load)
         associate (new => step%load(k))
            if (new%kind == load_moment) call check_node(reader, scene, mark, "*CLOAD", &
               new%origin, new%target, is_told)
            if (new%kind /= load_point .or. .not. abs(new%value) > 0.0_wp) cycle
            if (new%place <= last_across) call check_across(reader, scene, mark, "*CLOAD", &
               new%origin, new%target, is_told)
         end associate
      end do
   end subroutine check_step

   !> Rigid bodies have the axes of the model.
   subroutine check_node(reader, scene, mark, card, origin, node, is_told)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: mark(:)
      character(len=*), intent(in) :: card
      type(origin_t), intent(in) :: origin
      integer, intent(in) :: node
      logical, intent(inout) :: is_told(:)           !! (n_node)

      if (mark(node) == 0 .or. is_told(node) .or. size(scene%rigid) == 0) return
      if (.not. any(scene%rigid%reference == node)) return
      call add_error(reader%log, origin, card // ": node " // to_text(scene%node%label(node)) // &
         " is of a *RIGID BODY, whose degrees of freedom are along the axes of the model; take " &
         // "it out of the set of *TRANSFORM")
      is_told(node) = .true.
   end subroutine check_node

   !> Nothing is outwards on the axis of a cylinder.
   subroutine check_across(reader, scene, mark, card, origin, node, is_told)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: mark(:)
      character(len=*), intent(in) :: card
      type(origin_t), intent(in) :: origin
      integer, intent(in) :: node
      logical, intent(inout) :: is_told(:)           !! (n_node)

      if (mark(node) == 0 .or. is_told(node)) return
      if (.not. scene%node%turned(mark(node))%is_central) return
      call add_error(reader%log, origin, card // ": node " // to_text(scene%node%label(node)) // &
         " lies on the axis of its *TRANSFORM: it has no radial direction; hold 1 and 2 at 0 " &
         // "both, or take it out of the set")
      is_told(node) = .true.
   end subroutine check_across

   !> A stand-in, behind all other nodes, for each node at which something is prescribed along an
   !> axis that is none of the model, and the equations between the two.
   pure subroutine add_stand_ins(scene, mark)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: mark(:)
      type(equation_t), allocatable :: equation(:)
      integer :: i, k, n, last

      n = size(mark)
      last = maxval(scene%node%label)
      do i = 1, size(scene%step)
         associate (list => scene%step(i)%prescribed)
            do k = 1, size(list)
               if (mark(list(k)%node) == 0 .or. list(k)%turn > 0) cycle
               associate (turned => scene%node%turned(mark(list(k)%node)))
                  if (aligned_with(turned%axes(:, list(k)%dof)) /= 0) cycle
                  if (turned%stand_in > 0) cycle
                  n = n + 1
                  turned%stand_in = n
               end associate
            end do
         end associate
      end do
      if (n == size(mark)) return
      call add_nodes(scene, n)
      scene%node%label = [scene%node%label, [(last + k, k = 1, n - size(mark))]]
      call link_stand_ins(scene, equation)
      call append_equations(scene%equation, equation)
   end subroutine add_stand_ins

   !> Places, and what the nodes start with, of the stand-ins.
   pure subroutine add_nodes(scene, n)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: n                       !! nodes with stand-ins
      type(origin_t) :: origin(n)
      real(wp), dimension(scene%n_dim, n) :: x, u0, v0
      integer :: i

      associate (n_old => size(scene%node%label), n_dim => scene%n_dim)
         origin(:n_old) = scene%node%origin
         x(:, :n_old) = scene%x
         u0(:, :n_old) = scene%u0
         v0(:, :n_old) = scene%v0
         do i = 1, size(scene%node%turned)
            associate (turned => scene%node%turned(i))
               if (turned%stand_in == 0) cycle
               origin(turned%stand_in) = turned%origin
               x(:, turned%stand_in) = scene%x(:, turned%node)
               u0(:, turned%stand_in) = matmul(scene%u0(:, turned%node), &
                  turned%axes(:n_dim, :n_dim))
               v0(:, turned%stand_in) = matmul(scene%v0(:, turned%node), &
                  turned%axes(:n_dim, :n_dim))
            end associate
         end do
      end associate
      scene%node%origin = origin
      scene%x = x
      scene%u0 = u0
      scene%v0 = v0
   end subroutine add_nodes

   !> The displacement of a node is the sum of those of its stand-in along the axes.
   pure subroutine link_stand_ins(scene, equation)
      type(scene_t), intent(in) :: scene
      type(equation_t), allocatable, intent(out) :: equation(:)
      integer, allocatable :: axis(:)
      integer :: i, b, a, n

      n = 0
      allocate(equation(scene%n_dim*count(scene%node%turned%stand_in > 0)))
      do i = 1, size(scene%node%turned)
         associate (turned => scene%node%turned(i))
            if (turned%stand_in == 0) cycle
            do b = 1, scene%n_dim
               axis = pack([(a, a = 1, scene%n_dim)], abs(turned%axes(b, :scene%n_dim)) > 0.0_wp)
               if (size(axis) == 1) cycle
               n = n + 1
               equation(n)%origin = turned%origin
               equation(n)%turned = i
               equation(n)%node = [turned%node, spread(turned%stand_in, 1, size(axis))]
               equation(n)%dof = [b, axis]
               equation(n)%coefficient = [1.0_wp, -turned%axes(b, axis)]
            end do
         end associate
      end do
      equation = equation(:n)
   end subroutine link_stand_ins

   pure subroutine append_equations(list, more)
      type(equation_t), allocatable, intent(inout) :: list(:)
      type(equation_t), intent(in) :: more(:)
      type(equation_t), allocatable :: grown(:)

      allocate(grown(size(list) + size(more)))
      grown(:size(list)) = list
      grown(size(list) + 1:) = more
      call move_alloc(grown, list)
   end subroutine append_equations

   !> Prescribed displacements along axes of the model, or at stand-ins.
   pure subroutine turn_prescribed(turned, mark, n_dim, list)
      type(turned_axes_t), intent(in) :: turned(:)
      integer, intent(in) :: mark(:), n_dim
      type(prescribed_t), intent(inout) :: list(:)
      integer :: k, axis

      do k = 1, size(list)
         if (mark(list(k)%node) == 0 .or. list(k)%turn > 0) cycle
         associate (own => turned(mark(list(k)%node)), new => list(k))
            axis = aligned_with(own%axes(:n_dim, new%dof))
            if (axis == 0) then
               new%node = own%stand_in
            else
               new%dof = abs(axis)
               new%value = sign(1, axis)*new%value
               new%before = sign(1, axis)*new%before
            end if
         end associate
      end do
   end subroutine turn_prescribed

   !> Forces on nodes by their components.
   pure subroutine turn_loads(turned, mark, n_dim, list)
      type(turned_axes_t), intent(in) :: turned(:)
      integer, intent(in) :: mark(:), n_dim
      type(load_t), allocatable, intent(inout) :: list(:)
      type(load_t) :: grown(n_dim*size(list))
      real(wp) :: part
      integer :: k, n, b

      n = 0
      do k = 1, size(list)
         if (list(k)%kind == load_point) then
            if (mark(list(k)%target) > 0) then
               do b = 1, n_dim
                  part = turned(mark(list(k)%target))%axes(b, list(k)%place)
                  if (.not. abs(part) > 0.0_wp) cycle
                  n = n + 1
                  grown(n) = list(k)
                  grown(n)%place = b
                  grown(n)%value = part*list(k)%value
                  grown(n)%value_start = part*list(k)%value_start
               end do
               cycle
            end if
         end if
         n = n + 1
         grown(n) = list(k)
      end do
      list = grown(:n)
   end subroutine turn_loads

   !> An equation with terms along turned axes, by their components: the largest one of the first
   !> term stays the first.
   pure subroutine turn_equation(turned, mark, n_dim, equation)
      type(turned_axes_t), intent(in) :: turned(:)
      integer, intent(in) :: mark(:), n_dim
      type(equation_t), intent(inout) :: equation
      real(wp) :: part(n_dim), coefficient(n_dim*size(equation%node))
      integer, dimension(n_dim*size(equation%node)) :: node, dof
      integer :: k, b, n, first

      n = 0
      first = 1
      do k = 1, size(equation%node)
         part = 0.0_wp
         part(equation%dof(k)) = 1.0_wp
         if (mark(equation%node(k)) > 0) part = turned(mark(equation%node(k)))%axes(:n_dim, &
            equation%dof(k))
         do b = 1, n_dim
            if (.not. abs(part(b)) > 0.0_wp) cycle
            n = n + 1
            node(n) = equation%node(k)
            dof(n) = b
            coefficient(n) = part(b)*equation%coefficient(k)
         end do
         if (k == 1) first = maxloc(abs(coefficient(:n)), 1)
      end do
      node([1, first]) = node([first, 1])
      dof([1, first]) = dof([first, 1])
      coefficient([1, first]) = coefficient([first, 1])
      equation%node = node(:n)
      equation%dof = dof(:n)
      equation%coefficient = coefficient(:n)
   end subroutine turn_equation

end module emcon_deck_turned
