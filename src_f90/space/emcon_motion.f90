! build: streams
!> A motion over one step, and where in it forces are evaluated.
!>
!> A scheme decides where. Forces are discrete gradients over a span of the step, from `from` by
!> `by`: from its start, or over nothing at one place, where a discrete gradient is the gradient.
!> Who takes a motion needs not know which: a derivative over the span times `weight` is that by
!> the end of the step. Source: docs/theory.md, section 2.
module emcon_motion
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : wp
   use emcon_vectors, only : vector_product, vector_sizes, vector_sum
   implicit none
   private
   public :: motion_t, motion_init, motion_evaluate, motion_of, at_rest

   type :: motion_t
      type(evaluation_t) :: evaluation
      real(wp), allocatable :: x(:, :)           !! (n_dim, n_node) reference positions [L]
      real(wp), allocatable :: u0(:, :)          !! displacement at the start [L]
      real(wp), allocatable :: v0(:, :)          !! velocity at the start [L/T]
      real(wp), allocatable :: du(:, :)          !! displacement over the step [L]
      real(wp), allocatable :: offset(:, :)      !! to `du`, for inertia [L]
      ! where the scheme keeps something of the steps before:
      real(wp), allocatable :: v_past(:, :)      !! what that adds to the velocity at the end [L/T]
      real(wp), allocatable :: dv_past(:, :)     !! and to the change that inertia sees [L/T]
      real(wp), allocatable :: du_before(:, :)   !! over the step before [L]
      real(wp), allocatable :: carried(:, :)     !! forces from the start, weighted [M L/T^2]
      ! of `motion_evaluate`:
      real(wp), allocatable :: from(:, :)        !! displacement where the span starts [L]
      real(wp), allocatable :: by(:, :)          !! displacement over the span [L]
      real(wp), allocatable :: at(:, :)          !! displacement on which loads act [L]
      real(wp), allocatable :: computed(:, :)    !! >= 0, what was computed to find the span [L]
      real(wp) :: weight = 1.0_wp
      real(wp) :: load_weight = 0.5_wp           !! derivative of `at` by the end of the step
   end type motion_t

contains

   !> A motion of rest of nodes at `x`.
   pure subroutine motion_init(self, x)
      type(motion_t), intent(out) :: self
      real(wp), intent(in), contiguous :: x(:, :)        !! (n_dim, n_node) [L]

      allocate(self%x, source=x)
      allocate(self%u0, self%v0, self%du, self%offset, self%from, self%by, self%at, &
         self%computed, mold=x)
      self%u0 = 0.0_wp
      self%v0 = 0.0_wp
      self%du = 0.0_wp
      self%offset = 0.0_wp
      call motion_evaluate(self)
   end subroutine motion_init

   !> Find the span and the place of the loads for the present `evaluation`, `u0` and `du`: whoever
   !> changes these calls it before forces or constraints are evaluated.
   pure subroutine motion_evaluate(self)
      type(motion_t), intent(inout) :: self

      associate (place => self%evaluation%at)
         if (self%evaluation%is_gradient) then
            self%from = self%u0 + place*self%du
            self%by = 0.0_wp
            self%computed = max(abs(self%from), abs(self%u0))
            self%weight = 2.0_wp*place
         else
            self%from = self%u0
            call vector_product(size(self%du), place, self%du, self%by)
            call vector_sizes(size(self%du), self%by, self%computed)
            self%weight = place
         end if
      end associate
      self%load_weight = self%evaluation%load_place
      call vector_sum(size(self%du), self%u0, self%load_weight, self%du, self%at)
   end subroutine motion_evaluate

   !> The motion from `u0` by `du`, from rest unless `v0` is given, placed.
   pure function motion_of(evaluation, x, u0, du, v0) result(motion)
      type(evaluation_t), intent(in) :: evaluation
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)    !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous, optional :: v0(:, :)             !! (n_dim, n_node) [L/T]
      type(motion_t) :: motion

      call motion_init(motion, x)
      motion%evaluation = evaluation
      motion%u0 = u0
      motion%du = du
      if (present(v0)) motion%v0 = v0
      call motion_evaluate(motion)
   end function motion_of

   !> No displacement over a step of nodes at `x`.
   pure function at_rest(x) result(du)
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node), for its shape
      real(wp) :: du(size(x, 1), size(x, 2))

      du = 0.0_wp
   end function at_rest

end module emcon_motion
