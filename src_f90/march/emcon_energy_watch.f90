!> The energy balance of a run, followed along with it: what it is off by, and why that is bad.
!>
!> Unless the scheme keeps energy the works are sums over increments, exact only in the limit of
!> small ones, and a scheme makes or takes energy: that error is shown, not judged. Nor is an error
!> that is round-off of the works: in a body at rest, or without load, there is nothing else.
module emcon_energy_watch
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_scheme, only : scheme_t
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_version, only : this_precision
   implicit none
   private
   public :: energy_watch_t, energy_start, energy_move, energy_follow, energy_reasons, &
      energy_warnings, energy_rounding, energy_is_failure, energy_bar, closing_text

   !> Error of the balance, relative to the largest energy, that is accepted in single, double and
   !> quadruple precision: 3, 6 and 9 digits above `epsilon`; and so much is a failure.
   real(wp), parameter :: closing(3) = [1.0e-4_wp, 1.0e-10_wp, 1.0e-25_wp], &
      failing(3) = [1.0e-2_wp, 1.0e-6_wp, 1.0e-6_wp]
   character(len=*), parameter :: closing_digits(3) = [character(len=11) :: "four", "ten", &
      "twenty-five"]
   real(wp), parameter :: energy_bar = closing(this_precision)
   !> Work of stabilization and of contact that must be none, relative to the largest energy.
   real(wp), parameter :: half_digits = sqrt(epsilon(1.0_wp))
   !> A work is made of a dozen products of forces and lengths: by so much of them it is uncertain.
   real(wp), parameter :: work_rounding = 16.0_wp*epsilon(1.0_wp)
   !> Contact may take these parts of the largest energy, unasked, before that is told; and before
   !> an explicit step, which cannot be told to do otherwise, is bad.
   real(wp), parameter :: told_loss = 0.01_wp, most_loss = 0.05_wp

   !> Energies and works [M L^2/T^2].
   type :: energy_watch_t
      real(wp) :: at_start = 0.0_wp              !! total energy
      real(wp) :: largest = 0.0_wp               !! kinetic and strain energy
      real(wp) :: largest_error = 0.0_wp         !! of total - contact work from `at_start`
      real(wp) :: reference = 0.0_wp             !! total - contact work after the last static step
      real(wp) :: dynamic_error = 0.0_wp         !! from `reference`, in steps that keep energy
      real(wp) :: shown_reference = 0.0_wp       !! the same before steps that do not
      real(wp) :: shown_error = 0.0_wp           !! from there, in these
      real(wp) :: contact_reference = 0.0_wp     !! work of contact before such steps
      real(wp) :: contact_made = 0.0_wp          !! from there, where it is most
      real(wp) :: contact_kept = 0.0_wp          !! the same of penalties, made or taken
      real(wp) :: contact_before = 0.0_wp        !! work of contact but for RESTITUTION, so far
      real(wp) :: contact_sum = 0.0_wp           !! the same in dynamic steps alone
      real(wp) :: contact_taken = 0.0_wp         !! the most that contact took by then
      real(wp) :: stabilization = 0.0_wp         !! work of what STABILIZE bears
      !> What works are made of, root of the sum of squares of increments.
      real(wp) :: scale = 0.0_wp
      logical :: has_dynamics = .false.          !! a step keeps energy
      logical :: has_explicit = .false.          !! a step is explicit
   end type energy_watch_t

contains

   !> Begin with the energies of `ledger`.
   pure subroutine energy_start(self, ledger)
      type(energy_watch_t), intent(out) :: self
      type(ledger_t), intent(in) :: ledger

      self%at_start = ledger%total
      self%reference = ledger%total
      self%shown_reference = ledger%total
      self%largest = abs(ledger%total)
   end subroutine energy_start

   !> The state was set from outside, which turned `before` into `after`: what came in or went out
   !> by that is no error of the balance.
   pure subroutine energy_move(self, before, after)
      type(energy_watch_t), intent(inout) :: self
      type(ledger_t), intent(in) :: before, after

      associate (change => kept_by(after) - kept_by(before))
         self%at_start = self%at_start + change
         self%reference = self%reference + change
         self%shown_reference = self%shown_reference + change
      end associate
      self%contact_before = self%contact_before + (taken_by(before) - taken_by(after))
   end subroutine energy_move

   !> An increment of `scheme` has led to `ledger`.
   pure subroutine energy_follow(self, ledger, scheme, is_stored, scale)
      type(energy_watch_t), intent(inout) :: self
      type(ledger_t), intent(in) :: ledger
      class(scheme_t), intent(in) :: scheme
      logical, intent(in) :: is_stored           !! contact stores energy
      real(wp), intent(in) :: scale              !! forces times coordinates, >= 0 [M L^2/T^2]
      real(wp) :: kept, done

      kept = kept_by(ledger)
      self%stabilization = ledger%stabilization
      self%scale = hypot(self%scale, scale + sizes_of(ledger))
      self%largest = max(self%largest, ledger%kinetic + ledger%strain)
      self%largest_error = max(self%largest_error, abs(kept - self%at_start))
      self%has_explicit = self%has_explicit .or. scheme%row%is_explicit
      done = -taken_by(ledger) - self%contact_before
      self%contact_before = -taken_by(ledger)
      if (scheme%row%has_inertia .and. .not. is_stored) then
         self%contact_sum = self%contact_sum + done
         self%contact_taken = max(self%contact_taken, -self%contact_sum)
      end if
      if (scheme%keeps_energy()) then
         self%has_dynamics = .true.
         self%dynamic_error = max(self%dynamic_error, abs(kept - self%reference))
         self%shown_reference = kept
         if (is_stored) then
            self%contact_kept = max(self%contact_kept, abs(ledger%contact_work &
               - self%contact_reference))
         else
            self%contact_reference = ledger%contact_work
         end if
      else
         self%reference = kept
         if (scheme%row%has_inertia) then
            self%shown_error = max(self%shown_error, abs(kept - self%shown_reference))
            self%contact_made = max(self%contact_made, &
               ledger%contact_work - self%contact_reference)
         else
            self%shown_reference = kept
            self%contact_reference = ledger%contact_work
         end if
      end if
   end subroutine energy_follow

   !> What stays, but for what the works of loads and of contact do not tell.
   pure real(wp) function kept_by(ledger) result(kept)
      type(ledger_t), intent(in) :: ledger

      kept = ledger%total - ledger%contact_work + ledger%decay + ledger%damping + ledger%friction &
         + ledger%contact_damping
   end function kept_by

   !> What contact has taken that RESTITUTION does not ask for.
   pure real(wp) function taken_by(ledger) result(taken)
      type(ledger_t), intent(in) :: ledger

      taken = -ledger%contact_work - ledger%restitution
   end function taken_by

   !> The sizes of all that the balance is made of.
   pure real(wp) function sizes_of(ledger) result(size)
      type(ledger_t), intent(in) :: ledger

      size = ledger%kinetic + abs(ledger%strain) + abs(ledger%potential) &
         + abs(ledger%external_work) + abs(ledger%contact_work) + abs(ledger%contact_energy) &
         + abs(ledger%decay) + abs(ledger%damping) + abs(ledger%friction) &
         + abs(ledger%contact_damping)
   end function sizes_of

   !> An error of the balance below that is round-off [M L^2/T^2].
   pure real(wp) function energy_rounding(self)
      type(energy_watch_t), intent(in) :: self

      energy_rounding = work_rounding*self%scale
   end function energy_rounding

   !> The digits to which the balance has to close.
   pure subroutine closing_text(text)
      character(len=:), allocatable, intent(out) :: text   !! a word, as "ten"

      text = trim(closing_digits(this_precision))
   end subroutine closing_text

   !> Is the balance so bad that the analysis has failed?
   pure logical function energy_is_failure(self)
      type(energy_watch_t), intent(in) :: self

      energy_is_failure = self%dynamic_error > failing(this_precision)*self%largest &
         + energy_rounding(self)
   end function energy_is_failure

   !> Add what is bad.
   pure subroutine energy_reasons(self, reasons)
      type(energy_watch_t), intent(in) :: self
      type(notes_t), intent(inout) :: reasons
      character(len=:), allocatable :: digits, text

      associate (largest => self%largest, rounding => energy_rounding(self))
         if (abs(self%stabilization) > half_digits*largest + rounding) call note_add(reasons, &
            "loads move a body that no support holds: *CONTACT CONTROLS, STABILIZE does a " // &
            "work of " // to_text(self%stabilization, 3))
         if (self%dynamic_error > energy_bar*largest + rounding) then
            call closing_text(digits)
            call note_add(reasons, "the energy balance does NOT close to " // digits // &
               " digits (" // to_text(self%dynamic_error/largest, 3) // " of the largest energy)")
         end if
         if (self%contact_made > half_digits*largest + rounding) call note_add(reasons, &
            "contact has added an energy of " // to_text(self%contact_made, 3) // ", " // &
            to_text(self%contact_made/largest, 3) // " of the largest, which is " // &
            "an error of the time integration; SCHEME=ENERGY MOMENTUM adds none")
         if (self%contact_kept > energy_bar*largest + rounding) call note_add(reasons, &
            "penalty contact has gained or lost an energy of " // &
            to_text(self%contact_kept, 3) // ", " // to_text(self%contact_kept/largest, 3) // &
            " of the largest: nodes that had penetrated left the surface at an end or corner; " // &
            "use TYPE=NODE TO SURFACE of *CONTACT PAIR in the plane, or TYPE=NULL SPACE of " // &
            "*CONSTRAINT METHOD")
         if (self%has_explicit .and. self%contact_taken > most_loss*largest + rounding) then
            call taken_text(self, text)
            call note_add(reasons, text // " because explicit steps stop nodes that touch: a " &
               // "finer mesh loses less; TYPE=PENALTY of *CONSTRAINT METHOD or an implicit step " &
               // "loses nothing")
         end if
      end associate
   end subroutine energy_reasons

   !> Add what may be wrong.
   pure subroutine energy_warnings(self, warnings)
      type(energy_watch_t), intent(in) :: self
      type(notes_t), intent(inout) :: warnings
      character(len=:), allocatable :: text

      associate (least => told_loss*self%largest + energy_rounding(self), &
            most => most_loss*self%largest + energy_rounding(self))
         if (.not. self%contact_taken > least) return
         call taken_text(self, text)
         if (.not. self%has_explicit) then
            call note_add(warnings, text // " because gaps close exactly; " // &
               "*CONTACT INITIATION, TYPE=PERSISTENT or MASSLESS with SCHEME=ENERGY MOMENTUM " // &
               "conserves it")
         else if (.not. self%contact_taken > most) then
            call note_add(warnings, text // " because explicit steps stop nodes that touch")
         end if
      end associate
   end subroutine energy_warnings

   !> What contact has taken, as the beginning of a sentence.
   pure subroutine taken_text(self, text)
      type(energy_watch_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text

      text = "impacts have lost " // to_text(100.0_wp*self%contact_taken/self%largest, 2) // &
         " % of the largest energy,"
   end subroutine taken_text

end module emcon_energy_watch
