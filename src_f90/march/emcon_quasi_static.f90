!> Sections without inertia in dynamic steps: what holds their bodies, whether these begin in
!> balance, and how they move.
!>
!> Rows of nodes without mass are a balance in the mean over the step. One that is not a balance at
!> the start stays what it is with the other sign, from increment to increment, whatever their size.
module emcon_quasi_static
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_evaluation, only : instant_later, instant_t, evaluation_at_end
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : body_masses
   use emcon_march_types, only : march_t
   use emcon_mechanism_text, only : free_motion_text
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_is_dynamic
   use emcon_system, only : system_loads
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: quasi_static_hold, quasi_static_begin, quasi_static_move

   !> What is left of the forces on a node is more than Newton's method leaves.
   real(wp), parameter :: out_of_balance = 1.0e-6_wp

contains

   !> An error if a body without mass may move in a dynamic step with nothing to hold it. Contact
   !> does not count: it opens, and has no friction.
   subroutine quasi_static_hold(self, scene, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      real(dp), allocatable :: mass(:)

      if (.not. any(self%massless%without_density)) return
      call body_masses(self%system, mass)
      call free_motion_text(self%system, scene, scene%step(self%state%clock%i_step)%prescribed, &
         text, with_contact=.true., is_held=mass > 0.0_dp, u=self%state%u)
      if (len(text) > 0) call raise(error, err_analysis, "a MASSLESS section has no inertia to " &
         // "hold it, and contact may open: " // text // "; add *BOUNDARY conditions")
   end subroutine quasi_static_hold

   !> A warning if the forces on nodes without mass do not balance as a dynamic step begins.
   subroutine quasi_static_begin(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(motion_t) :: start
      real(wp), dimension(size(scene%x, 1), size(scene%x, 2)) :: load, left
      real(wp) :: largest

      if (.not. (any(self%massless%without_density) .and. &
         step_is_dynamic(scene%step(self%state%clock%i_step)))) return
      associate (state => self%state)
         start = motion_of(evaluation_at_end, scene%x, state%u, at_rest(scene%x))
         start%evaluation%load_instant = instant_later(instant_t(0.0_wp, state%clock%start_time), &
            0.0_wp)
         call system_loads(self%system, start, load)
         left = abs(state%internal - load - state%contact)
         left = merge(left, 0.0_wp, self%system%space%numbering%unknown > 0 &
            .and. spread(self%massless%without_density, 1, size(left, 1)))
         largest = maxval(left)
         if (largest <= out_of_balance*maxval(abs(load) + abs(state%internal))) return
         call note_add(self%warnings, "a force of " // to_text(largest, 3) // " is not balanced " &
            // "at node " // to_text(scene%node%label(maxloc(maxval(left, 1), 1))) // " of a " // &
            "MASSLESS section as the step begins: it changes its sign in each increment; let " // &
            "loads there rise from 0 by an *AMPLITUDE, or begin with a *STATIC step")
      end associate
   end subroutine quasi_static_begin

   !> In a dynamic step what has no mass moves as its displacement says.
   pure subroutine quasi_static_move(self, h)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! of the step, > 0 [T]
      integer :: i

      do i = 1, size(self%massless%without_density)
         if (self%massless%without_density(i)) self%end_state%v(:, i) = self%end_state%du(:, i)/h
      end do
   end subroutine quasi_static_move

end module emcon_quasi_static
