!> Is a set of active constraints seen to be another one before its step is solved to the end?
!>
!> What pulls by more than the residual leaves open, or has gone in by more than the last correction
!> has moved, tells that the set will change: what is left of the way with this one leads nowhere.
!> The rest of the way is shorter than the last correction. Only that it changes is told here;
!> which set follows is judged by emcon_contact_sets, and a set that stands has always been
!> solved to the end. Source: docs/theory.md, section 6.1.
module emcon_early_set
   use emcon_constraints, only : constraint_set_t
   use emcon_gaps, only : pair_measure
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: predicts_new_set, first_look, early_enough

   !> Relative residuals below which a solve is looked at, which costs about as much as an evaluation
   !> of contact: that of a set first, and once forces are met to a few digits.
   real(wp), parameter :: first_look = 1.0e-2_wp, early_enough = 1.0e-4_wp
   !> A constraint pulls clearly by more than this part of the largest multiplier, and by more than
   !> so many relative residuals; a gap is clearly closed by more than this part of an edge.
   real(wp), parameter :: clearly = 1.0e-2_wp, residuals = 10.0_wp

contains

   !> Does the motion, which solves the step to a few digits, ask for another set?
   subroutine predicts_new_set(system, set, motion, rest, left, of_slips, changes)
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: rest               !! relative residual
      real(wp), intent(in) :: left               !! > 0, of gaps and slips on the rest of the way [L]
      logical, intent(in) :: of_slips            !! what slides is looked at, too
      logical, intent(out) :: changes            !! clearly so
      integer :: pair, i, id, k

      changes = .false.
      if (set%n > set%n_permanent) changes = minval(set%lam(set%n_permanent + 1:set%n)) &
         < -max(clearly, residuals*rest)*maxval(abs(set%lam(set%n_permanent + 1:set%n)))
      do k = set%n_permanent + 1, merge(set%n, 0, of_slips)
         ! What slides against the way that its friction has stops, or turns back.
         associate (item => set%item(k))
            if (item%has_friction) changes = changes .or. dot_product(item%response%mu_sigma, &
               item%slip) < -left*norm2(item%response%mu_sigma)
         end associate
      end do
      if (changes) return
      k = set%n_permanent                        ! active ones so far; they ascend
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair))
            if (contact%clearance > 0.0_wp) cycle
            call pair_measure(system, pair, motion%x, motion%u0, motion%du)
            do i = 1, contact%n_constraint
               id = first + i
               do while (k < set%n)
                  if (set%id(k + 1) >= id) exit
                  k = k + 1
               end do
               if (k < set%n) then
                  if (set%id(k + 1) == id) cycle
               end if
               associate (gap => contact%state(i))
                  if (.not. (gap%is_near .and. gap%is_over) .or. gap%is_arriving) cycle
                  changes = changes .or. (gap%gap1 < min(gap%gap0, gap%closed) &
                     - min(left, clearly*gap%size))
               end associate
            end do
         end associate
         if (changes) return
      end do
   end subroutine predicts_new_set

end module emcon_early_set
