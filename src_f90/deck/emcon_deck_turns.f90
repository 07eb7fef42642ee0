!> How rigid bodies turn in a step: all rotations prescribed, or in space those about two axes.
!>
!> With its reference node prescribed, a body whose rotations all are is prescribed by its frame,
!> else by nodes of their own that its arms follow. What turns about one axis has a frame along the
!> axes of space: the arm along that axis stays where it is. Source: docs/theory.md, section 12.
module emcon_deck_turns
   use emcon_deck_dimension, only : n_plane
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_rigid_bodies, only : rigid_weights
   use emcon_rotation, only : n_turn
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_find, prescribed_t, turn_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_turns

contains

   !> All turns of all steps.
   subroutine read_turns(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i_step, i, a

      do i_step = 1, size(scene%step)
         do i = 1, size(scene%step(i_step)%turn)
            associate (turn => scene%step(i_step)%turn(i))
               turn%rigid = findloc(scene%rigid%reference, turn%angle(1)%node, 1)
               if (turn%rigid == 0) cycle
               if (scene%n_dim /= n_plane) turn%axis = free_axis(turn, scene%n_dim)
               if (turn%axis > 0) call add_axes(scene, turn%angle(1)%origin, turn%rigid)
            end associate
         end do
      end do
      do i_step = 1, size(scene%step)
         do i = 1, size(scene%step(i_step)%turn)
            associate (turn => scene%step(i_step)%turn(i))
               if (turn%rigid == 0) cycle
               turn%is_about = turn%axis == 0 .and. all([(prescribed_find( &
                  scene%step(i_step)%prescribed, turn%angle(1)%node, a), a = 1, scene%n_dim)] > 0)
               if (.not. turn%is_about) call add_arms(scene, turn%angle(1)%origin, turn%rigid)
               call prescribe_turn(scene, i_step, i)
            end associate
            if (scene%n_dim /= n_plane) call check_turn(reader, scene, i_step, i)
         end do
      end do
   end subroutine read_turns

   !> The axis of space that a body turns about, where its rotations about the two others are held
   !> at 0; 0: there is none.
   pure integer function free_axis(turn, n_dim)
      type(turn_t), intent(in) :: turn
      integer, intent(in) :: n_dim
      integer :: k

      free_axis = 0
      if (size(turn%angle) /= n_dim - 1 .or. any(turn%angle%is_frozen) &
         .or. any(abs(turn%angle%value) > 0.0_wp)) return
      free_axis = findloc([(any(turn%angle%dof == n_dim + k), k = 1, n_dim)], .false., 1)
   end function free_axis

   !> In space a body turns about all axes as it is told, about one axis freely, or about all. One
   !> that has turned freely is held as it is, by FIXED: rotations are those from the start.
   subroutine check_turn(reader, scene, i_step, i)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step, i             !! turn `i` of that step
      integer :: k

      associate (turn => scene%step(i_step)%turn(i))
         if (turn%axis == 0 .and. (size(turn%angle) < n_turn(scene%n_dim) .or. &
            (any(turn%angle%is_frozen) .and. .not. all(turn%angle%is_frozen)))) then
           call add_error(reader%log, turn%angle(1)%origin, "*BOUNDARY: reference node " // &
            to_text(scene%node%label(turn%angle(1)%node)) // ": in three dimensions degrees " // &
            "of freedom 4 to 6 of a rigid body are all prescribed, all FIXED, or none; or two of " &
            // "them are 0, for a body that turns about the third axis")
         end if
         if (all(turn%angle%is_frozen) .or. i_step == 1) return
         associate (earlier => scene%step(i_step - 1)%turn)
            k = findloc(earlier%rigid, turn%rigid, 1)
            if (k > 0) then
               if (leads_on(earlier(k), turn)) return
            end if
         end associate
         call add_error(reader%log, turn%angle(1)%origin, "*BOUNDARY: rigid body " // &
            scene%rigid(turn%rigid)%name // " may have turned before step " &
            // to_text(i_step) // ": in three dimensions FIXED holds it as it is then, " &
            // "in 4 to 6 together")
      end associate
   end subroutine check_turn

   !> Is it known at the end of `earlier` where the body is, as far as `turn` needs it?
   pure logical function leads_on(earlier, turn)
      type(turn_t), intent(in) :: earlier, turn    !! of one body
      integer :: k

      leads_on = earlier%axis == turn%axis .and. .not. any(earlier%angle%is_frozen)
      if (earlier%axis > 0 .or. turn%axis == 0 .or. any(earlier%angle%is_frozen)) return
      leads_on = .true.
      do k = 1, size(earlier%angle)
         if (any(turn%angle%dof == earlier%angle(k)%dof)) leads_on = leads_on .and. .not. &
            abs(earlier%angle(k)%value) > 0.0_wp
      end do
   end function leads_on

   !> A frame of nodes of its own for rigid body `b`: behind its reference node one along each axis
   !> of space, as far away as its farthest node. They move as the body does from the start.
   subroutine add_axes(scene, origin, b)
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(in) :: origin
      integer, intent(in) :: b
      real(wp) :: place(scene%n_dim, scene%n_dim), weight(scene%n_dim + 1, scene%n_dim), extent
      integer :: i, k

      if (allocated(scene%rigid(b)%arm)) return
      associate (rigid => scene%rigid(b), n_dim => scene%n_dim)
         extent = maxval([(norm2(scene%x(:, rigid%node(i)) - scene%x(:, rigid%reference)), &
            i = 1, size(rigid%node))])
         place = spread(scene%x(:, rigid%reference), 2, n_dim)
         do k = 1, n_dim
            place(k, k) = place(k, k) + extent
            call rigid_weights(scene%x(:, rigid%frame), place(:, k), weight(:, k))
         end do
         call add_nodes(scene, origin, place, matmul(scene%u0(:, rigid%frame), weight), &
            matmul(scene%v0(:, rigid%frame), weight))
      end associate
      associate (rigid => scene%rigid(b), n => size(scene%node%label))
         rigid%frame = [rigid%reference, [(n - scene%n_dim + k, k = 1, scene%n_dim)]]
         rigid%node = [rigid%node, rigid%frame(2:)]
      end associate
      call add_arms(scene, origin, b)
   end subroutine add_axes

   !> Nodes at the ends of the arms of rigid body `b`, behind all others, if it has none.
   subroutine add_arms(scene, origin, b)
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(in) :: origin
      integer, intent(in) :: b
      integer :: k, n

      if (allocated(scene%rigid(b)%arm)) return
      n = size(scene%node%label)
      scene%rigid(b)%arm = [(n + k, k = 1, scene%n_dim)]
      associate (frame => scene%rigid(b)%frame)
         call add_nodes(scene, origin, scene%x(:, frame(2:)), apart(scene%u0), apart(scene%v0))
      end associate

   contains

      pure function apart(field) result(of_arm)
         real(wp), intent(in) :: field(:, :)       !! (n_dim, n_node)
         real(wp) :: of_arm(size(field, 1), size(field, 1))

         associate (frame => scene%rigid(b)%frame)
            of_arm = field(:, frame(2:)) - spread(field(:, frame(1)), 2, size(field, 1))
         end associate
      end function apart

   end subroutine add_arms

   !> Nodes behind all others, with the labels behind the largest one.
   subroutine add_nodes(scene, origin, x, u, v)
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(in) :: origin
      real(wp), intent(in) :: x(:, :), u(:, :), v(:, :)   !! (n_dim, n) [L], [L], [L/T]
      integer :: k, last

      last = maxval([0, scene%node%label])
      scene%node%label = [scene%node%label, [(last + k, k = 1, size(x, 2))]]
      scene%node%origin = [scene%node%origin, [(origin, k = 1, size(x, 2))]]
      scene%x = reshape([scene%x, x], [size(x, 1), size(scene%x, 2) + size(x, 2)])
      scene%u0 = reshape([scene%u0, u], [size(u, 1), size(scene%u0, 2) + size(u, 2)])
      scene%v0 = reshape([scene%v0, v], [size(v, 1), size(scene%v0, 2) + size(v, 2)])
   end subroutine add_nodes

   !> Prescribe the nodes of the frame of turn `i` but the reference node, which is; or the arms; or
   !> of the arm along a free axis what is across it.
   pure subroutine prescribe_turn(scene, i_step, i)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i_step, i
      type(prescribed_t) :: new(scene%n_dim**2)
      integer :: k, a, n

      associate (turn => scene%step(i_step)%turn(i))
         n = 0
         do k = 1, scene%n_dim
            if (turn%axis > 0 .and. k /= turn%axis) cycle
            do a = 1, scene%n_dim
               if (a == turn%axis) cycle
               n = n + 1
               new(n)%origin = turn%angle(1)%origin
               if (turn%is_about) then
                  new(n)%node = scene%rigid(turn%rigid)%frame(k + 1)
               else
                  new(n)%node = scene%rigid(turn%rigid)%arm(k)
               end if
               new(n)%dof = a
               if (turn%axis == 0) new(n)%turn = i
            end do
         end do
      end associate
      scene%step(i_step)%prescribed = [scene%step(i_step)%prescribed, new(:n)]
   end subroutine prescribe_turn

end module emcon_deck_turns
