!> Is a set of active constraints seen to be another one before its step is solved to the end?
!>
!> Once forces are met to a few digits, what pulls hard or has gone in deep tells that the set will
!> change: what is left of the way with this one leads nowhere. Only that it changes is told here;
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
   public :: predicts_new_set, early_enough

   !> Relative residual from which on a look is worth while.
   real(wp), parameter :: early_enough = 1.0e-4_wp
   !> A constraint pulls clearly by more than this part of the largest multiplier, and a gap is
   !> clearly closed by more than this part of an edge: far more than the residual leaves open. With
   !> a kept factor it is by more than the last correction: the rest of the way is shorter.
   real(wp), parameter :: clearly = 1.0e-2_wp

contains

   !> Does the motion, which solves the step to a few digits, ask for another set? Gaps and slips
   !> below `left` may be those of what is left of the way: huge, what slides is not looked at.
   subroutine predicts_new_set(system, set, motion, left, changes)
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: left               !! > 0 [L]
      logical, intent(out) :: changes            !! clearly so
      integer :: pair, i, id, k

      changes = .false.
      if (set%n > set%n_permanent) changes = minval(set%lam(set%n_permanent + 1:set%n)) &
         < -clearly*maxval(abs(set%lam(set%n_permanent + 1:set%n)))
      do k = set%n_permanent + 1, merge(set%n, 0, left < huge(left))
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
