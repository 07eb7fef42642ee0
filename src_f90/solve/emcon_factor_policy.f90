!> Solves of a step whose corrections come from a factor that is kept over many steps: when there
!> may be one, when it is made anew, and how its corrections are mixed.
!>
!> It is made anew after so many increments, once it has cost as many corrections as a new one is
!> worth, and for another size of the step: of the place that was found last, as that of a first
!> guess is a worse one. The state knows of which motion it was made, so that a run that was resumed
!> makes the same one and has the bits of one that was not. Source: docs/theory.md, section 8.
module emcon_factor_policy
   use emcon_constraints, only : constraint_set_t
   use emcon_correction, only : correction_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t
   use emcon_factor_base, only : factor_base_t
   use emcon_kept_factor, only : kept_factor_correct, kept_factor_forget, &
      kept_factor_forget_rows, kept_factor_is_possible, kept_factor_let_iterate, kept_factor_look, &
      kept_factor_multipliers, kept_factor_reach, kept_factor_renew, kept_factor_take
   use emcon_kinds, only : wp
   use emcon_mixing, only : mixing_begin, mixing_move, mixing_t
   use emcon_motion, only : at_rest, motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: factor_policy_t, factor_policy_step, factor_policy_offer, factor_policy_begin, &
      factor_policy_make, factor_policy_complete, &
      factor_policy_renew, factor_policy_correct, factor_policy_break_off, factor_policy_give_up, &
      factor_policy_commit, factor_policy_forget, factor_policy_looks, factor_policy_provide, &
      factor_policy_may_provide

   !> A factor serves so many increments at most, and until its solves have taken so many
   !> corrections more than short ones: about as many as a new one costs.
   integer, parameter :: most_increments = 20, most_excess = 6

   !> Solves of a step that it may fail: of a set that is not the last one, more often than not.
   integer, parameter :: most_failures = 2

   type :: factor_policy_t
      logical :: is_wanted = .true.              !! in steps that it may serve
      logical :: is_allowed = .false.            !! in the present step
      type(factor_base_t) :: base                !! of the present factor
      logical, private :: is_tried = .false.     !! in the present step
      logical, private :: iterates_no_more = .false. !! iterations have led nowhere: see the base
      logical, private :: is_new = .false.       !! made in it
      integer, private :: n_failure = 0          !! solves of the present step that it has failed
      logical, private :: knows_set = .false.    !! it has taken the solve's constraints
      logical, private :: is_on_its_way = .false.    !! the solve has made a correction
      logical, private :: has_looked = .false.   !! at their second derivatives since then
      type(instant_t), private :: start          !! of the present step
      real(wp), private :: h = 0.0_wp            !! and its size [T]
      integer, private :: increment = 0          !! increments done before it
      integer, private :: n_correction = 0       !! in the present solve
      integer, private :: n_least = 0, n_excess = 0      !! as in the base, with it
      type(mixing_t), private :: mixing
      real(wp), allocatable, private :: guess(:, :)      !! (n_dim, n_node) the solve's first [L]
      !> Correction before mixing, with multipliers that are under way, and the last one after it
      real(wp), allocatable, private :: proposed(:), made(:)
   end type factor_policy_t

contains

   !> Forget the factor, as what it is made of has changed.
   pure subroutine factor_policy_forget(self, correction)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction

      call kept_factor_forget(correction%kept)
      self%base%is_set = .false.
   end subroutine factor_policy_forget

   !> Before a step: may a factor be kept in it, and does the one there is still serve, or is lost?
   pure subroutine factor_policy_step(self, correction, base, start, h, increment, is_lost)
      type(factor_policy_t), intent(inout) :: self   !! `is_allowed` is set
      type(correction_t), intent(inout) :: correction
      type(factor_base_t), intent(in) :: base        !! of the state
      type(instant_t), intent(in) :: start           !! of the step
      real(wp), intent(in) :: h                      !! > 0 [T]
      integer, intent(in) :: increment               !! increments done
      logical, intent(out) :: is_lost                !! and `self%base` says how to make it again

      is_lost = .false.
      self%iterates_no_more = base%iterates_no_more
      call kept_factor_forget_rows(correction%kept)
      if (self%is_allowed) self%is_allowed = kept_factor_is_possible(correction%kept)
      self%is_tried = self%is_allowed
      self%n_failure = 0
      if (.not. self%is_allowed) return
      if (.not. correction%kept%is_made) self%base = base
      self%is_new = self%base%is_set .and. abs(h - self%base%h) > 0.0_wp
      if (self%is_new) then
         call kept_factor_forget(correction%kept)
         self%base%du = (h/self%base%h)*self%base%du
         self%base%h = h
      end if
      is_lost = self%base%is_set .and. .not. correction%kept%is_made
      self%start = start
      self%h = h
      self%increment = increment
      self%n_least = self%base%n_least
      self%n_excess = self%base%n_excess
      self%n_correction = 0
   end subroutine factor_policy_step

   !> A solve beside the steps may make a factor for itself, for many contacts to be condensed by.
   pure subroutine factor_policy_offer(self, correction)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction

      call factor_policy_forget(self, correction)
      call kept_factor_forget_rows(correction%kept)
      self%is_allowed = .false.
      self%is_tried = kept_factor_is_possible(correction%kept)
      self%n_failure = 0
   end subroutine factor_policy_offer

   !> Corrections by an incomplete factor have led nowhere with contacts: a complete one is to be
   !> made, in this step and in those after it.
   subroutine factor_policy_complete(self, correction, goes_on)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      logical, intent(out) :: goes_on            !! else it was complete, or there is to be none

      goes_on = self%is_tried .and. correction%kept%blocks%is_incomplete
      if (.not. goes_on) return
      call kept_factor_let_iterate(correction%kept, .false.)
      self%iterates_no_more = .true.
      self%is_allowed = .true.
      self%n_failure = 0
      self%base%is_set = .false.
      self%knows_set = .false.
   end subroutine factor_policy_complete

   !> The last solve is over: how many corrections has it taken, beside the shortest one?
   pure subroutine count_solve(self)
      type(factor_policy_t), intent(inout) :: self

      if (self%n_correction > 0) then
         self%n_least = min(self%n_least, self%n_correction)
         self%n_excess = self%n_excess + self%n_correction - self%n_least
      end if
      self%n_correction = 0
   end subroutine count_solve

   !> A solve begins from `du`.
   pure subroutine factor_policy_begin(self, n_unknown, du)
      type(factor_policy_t), intent(inout) :: self
      integer, intent(in) :: n_unknown           !! > 0, with multipliers that are under way
      real(wp), intent(in) :: du(:, :)           !! (n_dim, n_node) [L]

      self%guess = du
      call count_solve(self)
      if (allocated(self%proposed)) then
         if (size(self%proposed) /= n_unknown) deallocate(self%proposed, self%made)
      end if
      if (.not. allocated(self%proposed)) allocate(self%proposed(n_unknown), self%made(n_unknown))
      self%knows_set = .false.
      self%is_on_its_way = .false.
      self%has_looked = .false.
      call mixing_begin(self%mixing, n_unknown)
   end subroutine factor_policy_begin

   !> Are second derivatives of the constraints to be looked at? They are after the first
   !> correction, which takes the solve most of its way: multipliers before it are those of a guess,
   !> and tell nothing where they are another set's.
   pure logical function factor_policy_looks(self)
      type(factor_policy_t), intent(in) :: self

      factor_policy_looks = self%is_on_its_way .and. .not. self%has_looked
   end function factor_policy_looks

   !> Let there be a factor, of the present tangent if it is a new one, that knows the constraints.
   subroutine factor_policy_make(self, correction, system, set, motion, is_fit, error)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion       !! that the tangent is of
      logical, intent(out) :: is_fit             !! there is one
      type(error_t), allocatable, intent(out) :: error

      is_fit = self%knows_set
      if (.not. is_fit) then
         if (.not. correction%knows_multipliers) return
         if (.not. correction%kept%is_made) call factor_policy_provide(self, correction, system, &
            motion, error)
         if (allocated(error)) return
         call kept_factor_take(correction%kept, set, .false., is_fit, error)
         if (allocated(error)) return
         self%knows_set = is_fit
      end if
      if (.not. is_fit) return
      if (factor_policy_looks(self)) then
         call kept_factor_look(correction%kept, set, system%space%numbering)
         self%has_looked = .true.
      end if
   end subroutine factor_policy_make

   !> Make a factor of the present tangent, if it is definite.
   subroutine factor_policy_provide(self, correction, system, motion, error)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      type(system_t), intent(in) :: system       !! with the tangent
      type(motion_t), intent(in) :: motion       !! that it is of
      type(error_t), allocatable, intent(out) :: error

      call kept_factor_renew(correction%kept, system%matrix, error)
      if (allocated(error)) return
      self%n_least = self%n_least + 1
      self%base = factor_base_t(correction%kept%is_made, self%increment, self%n_least, 0, &
         self%start, self%h, motion%u0, motion%du)
      self%is_new = .true.
      self%n_correction = 0
      self%n_excess = 0
   end subroutine factor_policy_provide

   !> May a factor be kept in the present step, whether or not sets have found it to serve?
   pure logical function factor_policy_may_provide(self)
      type(factor_policy_t), intent(in) :: self

      factor_policy_may_provide = self%is_tried
   end function factor_policy_may_provide

   !> The next factor is to be of the tangent at the present place.
   pure subroutine factor_policy_renew(self, correction)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction

      call factor_policy_forget(self, correction)
      self%knows_set = .false.
      self%has_looked = .false.
      call mixing_begin(self%mixing, size(self%proposed))
   end subroutine factor_policy_renew

   !> The next correction, where the last one was `dq`, and `dlam` of multipliers under way.
   subroutine factor_policy_correct(self, correction, set, residual, dq, dlam, error)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown) with contact forces
      real(wp), intent(inout), contiguous :: dq(:)       !! (n_unknown) [L]
      real(wp), intent(inout), contiguous :: dlam(:)     !! (n) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error

      self%n_correction = self%n_correction + 1
      self%is_on_its_way = .true.
      call kept_factor_correct(correction%kept, set, residual, self%proposed(:size(dq)), error)
      if (allocated(error)) return
      if (set%penalty%is_under_way) then
         call move_with_multipliers(self, correction, dq, dlam)
      else
         call mixing_move(self%mixing, self%proposed, dq)
      end if
   end subroutine factor_policy_correct

   !> The next move of unknowns and multipliers together, these by how far they reach.
   subroutine move_with_multipliers(self, correction, dq, dlam)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(in) :: correction
      real(wp), intent(inout) :: dq(:)           !! (n_unknown) [L]
      real(wp), intent(inout) :: dlam(:)         !! (n) [M L/T^2]
      real(wp) :: reach(size(dlam))

      associate (n => size(dq))
         call kept_factor_reach(correction%kept, reach)
         call kept_factor_multipliers(correction%kept, self%proposed(n + 1:))
         self%proposed(n + 1:) = reach*self%proposed(n + 1:)
         self%made(:n) = dq
         self%made(n + 1:) = reach*dlam
         call mixing_move(self%mixing, self%proposed, self%made)
         dq = self%made(:n)
         dlam = self%made(n + 1:)/reach
      end associate
   end subroutine move_with_multipliers

   !> A solve ends before its end: it tells nothing of what the factor costs.
   pure subroutine factor_policy_break_off(self)
      type(factor_policy_t), intent(inout) :: self

      self%n_correction = 0
   end subroutine factor_policy_break_off

   !> The factor does not lead to an end: back to the first guess. Other sets of the step may do
   !> with a new one. One that cannot take the set's constraints may take those of the next step.
   pure subroutine factor_policy_give_up(self, correction, is_fit, du)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      logical, intent(in) :: is_fit              !! it was, and has failed
      real(wp), intent(out) :: du(:, :)          !! (n_dim, n_node) [L]

      if (is_fit) call factor_policy_forget(self, correction)
      self%n_failure = self%n_failure + 1
      self%is_allowed = self%knows_set .and. self%n_failure < most_failures
      du = self%guess
   end subroutine factor_policy_give_up

   !> After a step by `motion`: what the state has to know of the factor, or of the next one.
   pure subroutine factor_policy_commit(self, correction, motion, base, is_due)
      type(factor_policy_t), intent(inout) :: self
      type(correction_t), intent(inout) :: correction
      type(motion_t), intent(in) :: motion
      type(factor_base_t), intent(inout) :: base     !! of the state
      logical, intent(out) :: is_due                 !! a new factor is to be made

      call count_solve(self)
      is_due = self%is_tried .and. (.not. self%base%is_set .or. self%n_excess > most_excess &
         .or. self%increment + 1 - self%base%increment >= most_increments)
      if (is_due) then
         call kept_factor_forget(correction%kept)
         self%base = factor_base_t(.true., self%increment + 1, self%n_least + 1, 0, self%start, &
            self%h, motion%u0 + motion%du, at_rest(motion%du))
      else
         self%base%n_least = self%n_least
         self%base%n_excess = self%n_excess
      end if
      if (self%base%is_set .and. (is_due .or. self%is_new)) base = self%base
      base%is_set = self%base%is_set
      base%iterates_no_more = self%iterates_no_more
      base%n_least = self%base%n_least
      base%n_excess = self%base%n_excess
   end subroutine factor_policy_commit

end module emcon_factor_policy
