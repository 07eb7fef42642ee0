!> Backward differences of second order, over steps of any size; the first step is the mid-point
!> rule. Source: docs/theory.md, eq. (4d).
module emcon_scheme_bdf2
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_bdf2_t

   type, extends(scheme_t) :: scheme_bdf2_t
   contains
      procedure :: evaluation => bdf2_pose
      procedure :: carry => bdf2_carry
   end type scheme_bdf2_t

contains

   !> r = M (k (v1 - v0) - l dv)/h + forces at the end, v1 = (k du - l du_before)/h, with dv the
   !> change of the velocity over the step before.
   pure function bdf2_pose(self, start, h) result(evaluation)
      class(scheme_bdf2_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation
      real(wp) :: ratio, k, l

      if (.not. start%h_before > 0.0_wp) then
         evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
         evaluation%at = 0.5_wp
         evaluation%load_instant = instant_later(start, 0.5_wp*h)
      else
         ratio = h/start%h_before
         k = (1.0_wp + 2.0_wp*ratio)/(1.0_wp + ratio)
         l = ratio**2/(1.0_wp + ratio)
         evaluation = evaluation_moving(h/k, lapse=h/k, v_weight=1.0_wp)
         evaluation%load_place = 1.0_wp
         evaluation%load_instant = instant_later(start, h)
         evaluation%pushes_at_end = .true.
         evaluation%past_velocity(1) = -l/h
         evaluation%past_change = -[l/h, l/k]
      end if
      evaluation%is_gradient = .true.
   end function bdf2_pose

   !> The way and the change of the velocity.
   pure subroutine bdf2_carry(self, h, du, v0, v1, past)
      class(scheme_bdf2_t), intent(in) :: self
      real(wp), intent(in) :: h                              !! > 0 [T]
      real(wp), intent(in), contiguous :: du(:, :)           !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: v0(:, :), v1(:, :) !! (n_dim, n_node) [L/T]
      real(wp), intent(inout), contiguous :: past(:, :, :)   !! (n_dim, n_node, 2) [L], [L/T]

      past(:, :, 1) = du
      past(:, :, 2) = v1 - v0
   end subroutine bdf2_carry

end module emcon_scheme_bdf2
