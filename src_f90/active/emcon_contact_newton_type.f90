!> What Newton's method for the contacts of a step holds (emcon_contact_newton), from one iterate to
!> the next and over the solves of a step.
module emcon_contact_newton_type
   use emcon_condensation, only : condensation_t
   use emcon_contact_problem, only : contact_problem_t
   use emcon_contact_trials, only : contact_slope_t
   use emcon_coulomb_law, only : coulomb_t, slip_status_t
   use emcon_kinds, only : wp
   use emcon_mixed_step, only : mixed_step_t
   implicit none
   private
   public :: by_kept_t, contact_newton_t, early_end_t, rest_t

   !> What is left: relative residual, and what contacts miss.
   type :: rest_t
      real(wp) :: size = huge(1.0_wp)            !! of the iterate
      real(wp) :: best = huge(1.0_wp), last = huge(1.0_wp)     !! of the best and the last one
      integer :: n_stall = 0                     !! iterates since the last clear gain
      logical :: is_measured = .false.           !! it is that of the motion as a search has left it
      logical :: has_second = .false.            !! rows were evaluated with second derivatives
   end type rest_t

   !> A solve may end as `newton_early` once forces are met to a few digits, so that its caller sees
   !> whether this is what is to be solved; the next one goes on from there.
   type :: early_end_t
      logical :: is_allowed = .false.            !! before a solve
      logical :: is_made = .false.               !! the last solve ended so
      logical :: goes_on = .false.               !! this one goes on with that
   end type early_end_t

   !> Corrections by a factor that is kept.
   type :: by_kept_t
      logical :: is_on = .false.                 !! they are made, from here on:
      real(wp), allocatable :: du(:, :)          !! (n_dim, n_node) motion [L]
      real(wp), allocatable :: lam(:)            !! (n_row) multipliers
   end type by_kept_t

   !> One solve, or several one after the other for a step.
   type :: contact_newton_t
      type(coulomb_t), allocatable :: law(:)     !! (n) of the contacts; mu = 0: no friction
      !> Before a solve: contact alone holds a body; in it: rows are stiff in tangents
      logical :: holds = .false.
      type(early_end_t) :: early
      type(condensation_t) :: condensation
      type(contact_problem_t) :: problem
      type(contact_slope_t) :: slope    !! of the problem that was solved last
      integer, allocatable :: row(:)    !! what it was condensed for: see `names_of`
      logical :: has_tangent = .false.  !! there is one, of the same rows
      real(wp), allocatable :: push(:, :)       !! (0:n_slip, n) of the condensed contacts
      !> (n) in which way the law is to hold
      type(slip_status_t), allocatable :: status(:)
      type(mixed_step_t) :: step
      type(rest_t) :: rest
      type(by_kept_t) :: kept
      logical :: is_rounding = .false.  !! nothing but round-off is left
      integer :: least_soft = 0         !! first of `softer` that is tried, 0: none
      logical :: is_searching = .false. !! no tangent is wanted
      logical :: turns = .false.        !! something rubs, and slip has a direction
      logical :: is_driven = .false.    !! the next correction meets prescribed motion
      logical :: is_condensed = .false. !! by that, or by the tangent
      !> What was condensed last does for the next correction
      logical :: keeps_tangent = .false.
   end type contact_newton_t

end module emcon_contact_newton_type
