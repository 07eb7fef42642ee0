!> What is prescribed as a function of time: amplitudes, and the motion of driven freedoms.
module emcon_prescribed
   use emcon_amplitudes, only : amplitude_t, find_amplitude_value
   use emcon_evaluation, only : instant_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_find, prescribed_t, step_t
   use emcon_turn_plane, only : turn_arm, turn_of, turned_by
   use emcon_turn_space, only : turn_arm_space
   implicit none
   private
   public :: amplitude_at, prescribed_way, prescribed_motion, ramp_at, ramp_turn

contains

   !> Value and rate of an amplitude: of step time, or of total time.
   pure subroutine amplitude_at(amplitude, instant, value, rate)
      type(amplitude_t), intent(in) :: amplitude
      type(instant_t), intent(in) :: instant
      real(wp), intent(out) :: value             !! relative
      real(wp), intent(out) :: rate              !! its slope to the left [1/T]
      real(wp) :: time

      time = instant%step_time
      if (amplitude%is_total_time) time = instant%total_time
      call find_amplitude_value(amplitude, time, value, rate)
   end subroutine amplitude_at

   !> How far a freedom is to be moved: by so much times its amplitude, or without one, by so much
   !> from where it is.
   elemental real(wp) function prescribed_way(prescribed, u) result(way)
      type(prescribed_t), intent(in) :: prescribed
      real(wp), intent(in) :: u                  !! where it is [L]

      way = prescribed%value
      if (prescribed%amplitude == 0) way = way - u
      if (prescribed%is_frozen) way = 0.0_wp
   end function prescribed_way

   !> Displacement and velocity of a prescribed degree of freedom at `instant`; `u_start` are the
   !> displacements at the start of the step. The velocity is the slope to the left.
   pure subroutine prescribed_motion(scene, step, prescribed, instant, u_start, u, v)
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(prescribed_t), intent(in) :: prescribed
      type(instant_t), intent(in) :: instant
      real(wp), intent(in), contiguous :: u_start(:, :)  !! (n_dim, n_node) [L]
      real(wp), intent(out) :: u                 !! [L]
      real(wp), intent(out) :: v                 !! [L/T]
      real(wp), dimension(size(u_start, 1)) :: arm, start, w, rate
      real(wp) :: begun, angle, spin
      integer :: node

      if (prescribed%turn == 0) then
         call given_motion(scene, step, prescribed, instant, &
            u_start(prescribed%dof, prescribed%node), u, v)
         return
      end if
      associate (turn => step%turn(prescribed%turn), a => prescribed%dof)
         associate (body => scene%rigid(turn%rigid))
            node = prescribed%node
            if (.not. turn%is_about) node = body%frame(findloc(body%arm, node, 1) + 1)
         end associate
         arm = scene%x(:, node) - scene%x(:, turn%angle(1)%node)
         start = u_start(:, node) - u_start(:, turn%angle(1)%node)
         u = 0.0_wp
         v = 0.0_wp
         if (turn%is_about) call given_motion(scene, step, step%prescribed(prescribed_find( &
            step%prescribed, turn%angle(1)%node, a)), instant, u_start(a, turn%angle(1)%node), u, v)
         if (turn%angle(1)%is_frozen) then
            u = u + start(a)
            return
         end if
         if (size(turn%angle) == 1) then
            begun = turned_by(arm, arm + start)
            begun = begun + turn_of*anint((turn%angle(1)%before - begun)/turn_of)
            call given_motion(scene, step, turn%angle(1), instant, begun, angle, spin)
            call turn_arm(arm, angle, w, rate)
            rate = spin*rate
         else
            call given_turn_space(scene, step, turn%angle, instant, arm, w, rate)
         end if
         u = u + w(a)
         v = v + rate(a)
      end associate
   end subroutine prescribed_motion

   !> How an arm of a body turns in space, by the components of a rotation vector.
   pure subroutine given_turn_space(scene, step, prescribed, instant, arm, w, v)
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(prescribed_t), intent(in) :: prescribed(:)    !! (3)
      type(instant_t), intent(in) :: instant
      real(wp), intent(in) :: arm(:)             !! (3) [L]
      real(wp), intent(out) :: w(:)              !! (3) [L]
      real(wp), intent(out) :: v(:)              !! (3) [L/T]
      real(wp), dimension(size(prescribed)) :: angle, rate
      integer :: k

      do k = 1, size(prescribed)
         associate (own => prescribed(k))
            call given_motion(scene, step, own, instant, own%before, angle(own%dof - size(arm)), &
               rate(own%dof - size(arm)))
         end associate
      end do
      call turn_arm_space(arm, angle, rate, w, v)
   end subroutine given_turn_space

   !> What an amplitude, or the run of a step from `start`, gives.
   pure subroutine given_motion(scene, step, prescribed, instant, start, u, v)
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(prescribed_t), intent(in) :: prescribed
      type(instant_t), intent(in) :: instant
      real(wp), intent(in) :: start              !! at the start of the step [L] or radians
      real(wp), intent(out) :: u                 !! [L] or radians
      real(wp), intent(out) :: v                 !! its rate
      real(wp) :: factor, rate

      v = 0.0_wp
      if (prescribed%is_frozen) then
         u = start
      else if (prescribed%amplitude > 0) then
         call amplitude_at(scene%amplitude(prescribed%amplitude), instant, factor, rate)
         u = prescribed%value*factor
         v = prescribed%value*rate
      else if (step%scheme%loads_ramp) then
         u = ramp_at(step, instant%step_time, start, prescribed%value)
      else
         u = prescribed%value
      end if
   end subroutine given_motion

   !> Where the linear run of a step from `start` to `last` is.
   pure real(wp) function ramp_at(step, step_time, start, last)
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: step_time              !! since the start of the step [T]
      real(wp), intent(in) :: start, last

      ramp_at = start + (last - start)*min(1.0_wp, step_time/step%time%duration)
   end function ramp_at

   !> Where the run has to start to be at `now`, and end at `last`. It stays after the step, and
   !> where nothing runs.
   pure subroutine ramp_turn(step, step_time, now, last, start)
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: step_time              !! since the start of the step [T]
      real(wp), intent(in) :: now, last
      real(wp), intent(inout) :: start
      real(wp) :: part

      part = min(1.0_wp, step_time/step%time%duration)
      if (.not. step%scheme%loads_ramp .or. part >= 1.0_wp) return
      start = now
      if (part > 0.0_wp) start = (now - last*part)/(1.0_wp - part)
   end subroutine ramp_turn

end module emcon_prescribed
