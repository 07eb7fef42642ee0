!> The first guess of a step: prescribed motion, and what the velocities lead to.
module emcon_march_guess
   use emcon_convergence, only : round_off
   use emcon_evaluation, only : evaluation_displacement, evaluation_has_inertia, &
      evaluation_velocity, instant_later, instant_t
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_guess
   use emcon_march_past, only : march_past_take
   use emcon_march_types, only : march_t
   use emcon_motion, only : motion_t
   use emcon_numbering, only : spread_dependent
   use emcon_prescribed, only : prescribed_motion
   use emcon_scene, only : scene_t
   use emcon_space, only : space_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: march_guess, end_velocities, follow_links

contains

   !> First guess of the motion, and the motion and velocity of prescribed freedoms, with the offset
   !> of docs/theory.md, eq. (4). A static step has no velocities: where some nodes had the speed at
   !> which they are driven and all others none, there would be kinetic energy of no motion.
   subroutine march_guess(self, scene, start, h, is_at_rest)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical, intent(in) :: is_at_rest          !! free nodes do not move in the guess
      type(instant_t) :: finish
      real(wp) :: u, v
      logical :: has_inertia
      integer :: k

      finish = instant_later(start, h)
      self%motion%evaluation = self%scheme%evaluation(start, h)
      has_inertia = evaluation_has_inertia(self%motion%evaluation)
      call march_past_take(self)
      self%motion%u0 = self%state%u
      self%motion%v0 = self%state%v
      self%motion%offset = 0.0_wp
      self%motion%du = 0.0_wp
      if (has_inertia .and. .not. is_at_rest) self%motion%du = h*self%state%v
      if (self%layer%is_on .and. has_inertia) call layer_guess(self%layer, self%motion%du)
      where (.not. self%system%space%is_alive) self%motion%du = 0.0_wp
      if (.not. self%explicit%is_on) call round_to_rest(self%system%space, scene%x, &
         self%state%u, self%motion%du)
      self%newton%driven = 0.0_wp
      associate (state => self%state, step => scene%step(self%state%clock%i_step))
         do k = 1, size(step%prescribed)
            associate (a => step%prescribed(k)%dof, i => step%prescribed(k)%node)
               call prescribed_motion(scene, step, step%prescribed(k), finish, &
                  state%u_start, u, v)
               self%motion%du(a, i) = u - state%u(a, i)
               if (.not. (has_inertia .or. self%explicit%is_on)) v = 0.0_wp
               self%end_state%v(a, i) = v
               if (self%explicit%is_on) cycle
               if (has_inertia) then
                  if (allocated(self%motion%v_past)) v = v - self%motion%v_past(a, i)
                  self%motion%offset(a, i) = evaluation_displacement(self%motion%evaluation, &
                     state%v(a, i), v) - self%motion%du(a, i)
               else
                  self%newton%driven(a, i) = self%motion%du(a, i)
               end if
            end associate
         end do
      end associate
      call follow_links(self%system, self%motion%du)
      call follow_links(self%system, self%motion%offset)
      call follow_links(self%system, self%newton%driven)
   end subroutine march_guess

   !> What holds a body at rest lets it move by round-off, which its velocity would carry on from
   !> step to step: bodies that go no farther than their places are rounded stay.
   pure subroutine round_to_rest(space, x, u, du)
      type(space_t), intent(in) :: space
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (n_dim, n_node) places and the way to them [L]
      real(wp), intent(inout) :: du(:, :)        !! (n_dim, n_node) the guess [L]
      real(wp) :: farthest, moved
      integer :: b, i

      do b = 1, space%n_body
         associate (member => space%member(space%first(b):space%first(b + 1) - 1))
            farthest = 0.0_wp
            moved = 0.0_wp
            do i = 1, size(member)
               farthest = max(farthest, maxval(abs(x(:, member(i)) + u(:, member(i)))))
               moved = max(moved, maxval(abs(du(:, member(i)))))
            end do
            if (moved > round_off*farthest) cycle
            do i = 1, size(member)
               du(:, member(i)) = 0.0_wp
            end do
         end associate
      end do
   end subroutine round_to_rest

   !> The velocities at the end of the solved step; those that are prescribed stand.
   subroutine end_velocities(system, motion, v)
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion                   !! of the step
      real(wp), intent(inout), contiguous :: v(:, :)         !! (n_dim, n_node) [L/T]
      integer :: i, a

      do i = 1, size(v, 2)
         do a = 1, size(v, 1)
            if (.not. system%space%numbering%unknown(a, i) > 0) cycle
            v(a, i) = evaluation_velocity(motion%evaluation, motion%v0(a, i), motion%du(a, i))
            if (allocated(motion%v_past)) v(a, i) = v(a, i) + motion%v_past(a, i)
         end do
      end do
      call follow_links(system, v)
   end subroutine end_velocities

   !> Let dependent entries of a motion follow the others, also where `numbering` does not know
   !> them: with multipliers they have to move in the same way.
   subroutine follow_links(system, field)
      type(system_t), intent(in) :: system
      real(wp), intent(inout), contiguous :: field(:, :)     !! (n_dim, n_node)

      if (system%space%linear%n > 0) call spread_dependent(system%space%linked, field)
   end subroutine follow_links

end module emcon_march_guess
