!> The verdict on a run: what was found wrong, in figures that run along with it.
!>
!> A run is good if its energy balance closes, nothing is behind a surface and every residual is
!> within the tolerance. Warnings stand beside that: they do not make a run bad.
module emcon_verdict
   use emcon_bent_bodies, only : bent_body_find, bent_body_t
   use emcon_friction_law, only : slip_rounding
   use emcon_interactions, only : contact_pair_t, formulation_nts
   use emcon_kinds, only : wp
   use emcon_locking, only : locking_advice, locking_element
   use emcon_ledger, only : ledger_t
   use emcon_look_plane, only : overlap_text
   use emcon_march, only : increment_t, march_is_done, march_t
   use emcon_scene, only : scene_t
   use emcon_small_range, only : small_limit, small_range_init, small_range_t, small_range_widen
   use emcon_solid, only : solid_t
   use emcon_stand_off, only : stand_off_mean, stand_off_t
   use emcon_term_registry, only : terms_solid
   use emcon_step_control, only : control_sizes, n_why, why_text
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   use emcon_version, only : this_precision
   implicit none
   private
   public :: verdict_t, verdict_start, verdict_update, verdict_move, verdict_end, &
      verdict_is_good, verdict_is_failure, verdict_balance_lines, verdict_line, guard_advice

   !> Error of the energy balance, relative to the largest energy, that is accepted in single,
   !> double and quadruple precision: 3, 6 and 9 digits above `epsilon`.
   real(wp), parameter :: closing(3) = [1.0e-4_wp, 1.0e-10_wp, 1.0e-25_wp]
   character(len=*), parameter :: closing_digits(3) = [character(len=11) :: "four", "ten", &
      "twenty-five"]
   real(wp), parameter :: energy_bar = closing(this_precision)
   !> Largest relative residual that is accepted where rounding ends Newton's method early: half of
   !> the digits are left.
   real(wp), parameter :: half_digits = sqrt(epsilon(1.0_wp))
   !> So far, per edge, bodies may be in each other: corners of master surfaces are rounded over a
   !> tenth of that, coordinates of decks by less. And so far that the run has failed.
   real(wp), parameter :: touching = 1.0e-3_wp, far_behind = 0.1_wp
   !> What contact gives way by is told; so many times that is deeper, whichever edge counts.
   real(wp), parameter :: most_give = 2.0_wp
   !> The laws of contact and friction may be missed by this part of the largest force; forces that
   !> differ by half of the second number are one to `emcon_friction`.
   real(wp), parameter :: law_bar = max(half_digits, 1.0e5_wp*epsilon(1.0_wp))
   character(len=*), parameter :: stray_words = ", which no contact pair brings together, overlap"
   !> Different warnings that are kept; others are counted only.
   integer, parameter :: most_warnings = 20

   !> Running figures, and how the run ended.
   type :: verdict_t
      real(wp) :: total0 = 0.0_wp                !! total energy at the start
      real(wp) :: largest_energy = 0.0_wp
      real(wp) :: largest_drift = 0.0_wp         !! of total - contact work from `total0`
      real(wp) :: reference = 0.0_wp             !! total - contact work after the last static step
      real(wp) :: dynamic_drift = 0.0_wp         !! from `reference`, in steps that keep energy
      real(wp) :: shown_reference = 0.0_wp       !! the same before steps that do not
      real(wp) :: shown_drift = 0.0_wp           !! from there, in these
      real(wp) :: contact_reference = 0.0_wp     !! work of contact before such steps
      real(wp) :: contact_made = 0.0_wp          !! from there, where it is most
      real(wp) :: contact_kept = 0.0_wp          !! the same of penalties, made or taken
      real(wp) :: deepest = 0.0_wp               !! penetration per edge
      real(wp) :: deepest_time = 0.0_wp          !! [T]
      real(wp) :: of_edges = 0.0_wp              !! of edges that stand for curves, per edge
      character(len=:), allocatable :: place     !! of the deepest one: bodies and nodes
      real(wp) :: unconverged = 0.0_wp           !! largest residual accepted above the tolerance
      real(wp) :: unconverged_time = 0.0_wp      !! [T]
      type(stand_off_t) :: stand_off
      type(small_range_t) :: small               !! what linear sections have met
      real(wp) :: stabilization = 0.0_wp         !! work of what STABILIZE bears
      real(wp) :: law_missed = 0.0_wp            !! of contact and friction, by the largest push
      !> Pushes where it rubs times their edges, root of the sum of squares of increments.
      real(wp) :: grip = 0.0_wp                  !! [M L^2/T^2]
      real(wp) :: give = 0.0_wp                  !! how deep contact has given way, per edge
      real(wp) :: give_time = 0.0_wp             !! [T]
      integer :: most_augmentations = 0          !! of an augmented Lagrangian in an increment
      integer :: n_newton = 0
      integer :: n_cut = 0
      integer :: n_guarded = 0                   !! increments in which guards act
      integer :: n_held = 0                      !! increments in which contacts that come and go
      integer :: most_held = 0                   !! are held closed, and the most of these in one
      real(wp), allocatable :: largest_force(:)  !! (n_pair) on the slave side
      logical :: has_dynamics = .false.          !! a step keeps energy
      integer :: n_warning = 0
      type(notes_t) :: warnings                  !! the first different ones
      type(notes_t) :: reasons                   !! why the run is bad
      logical :: is_complete = .false.           !! the run has come to its end
      character(len=:), allocatable :: message   !! of the error that ended it
   end type verdict_t

contains

   !> Begin with the first state of `march`.
   subroutine verdict_start(self, march)
      type(verdict_t), intent(out) :: self
      type(march_t), intent(in) :: march

      self%total0 = march%ledger%total
      self%reference = self%total0
      self%shown_reference = self%total0
      self%largest_energy = abs(self%total0)
      self%place = ""
      self%message = ""
      call small_range_init(self%small, terms_solid(march%system%term))
      allocate(self%largest_force(size(march%state%pairs%total)), source=0.0_wp)
      call warn_of_locking(self, terms_solid(march%system%term))
   end subroutine verdict_start

   !> Elements that are too stiff, the one with the largest ratio of Poisson named.
   subroutine warn_of_locking(self, solid)
      type(verdict_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      real(wp) :: ratio
      integer :: e

      call locking_element(solid, e, ratio)
      if (e > 0) call add_warning(self, "element " // to_text(solid%label(e)) // " at nu = " &
         // to_text(ratio) // " locks: " // trim(locking_advice(solid)))
   end subroutine warn_of_locking

   !> The state was set from outside, which turned `before` into `after`: what came in or went out
   !> by that is no error of the balance.
   pure subroutine verdict_move(self, before, after)
      type(verdict_t), intent(inout) :: self
      type(ledger_t), intent(in) :: before, after

      associate (change => kept_by(after) - kept_by(before))
         self%total0 = self%total0 + change
         self%reference = self%reference + change
         self%shown_reference = self%shown_reference + change
      end associate
   end subroutine verdict_move

   !> Take over what `increment` has found, which has led to the state of `march`.
   subroutine verdict_update(self, scene, march, increment)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(increment_t), intent(in) :: increment
      integer :: i

      self%n_newton = self%n_newton + increment%n_newton
      self%n_cut = self%n_cut + increment%n_cut
      if (increment%is_guarded) self%n_guarded = self%n_guarded + 1
      if (increment%n_held > 0) self%n_held = self%n_held + 1
      self%most_held = max(self%most_held, increment%n_held)
      associate (state => march%state)
         self%stabilization = march%ledger%stabilization
         self%law_missed = max(self%law_missed, increment%law_missed)
         self%grip = hypot(self%grip, increment%grip)
         if (increment%give > self%give) then
            self%give = increment%give
            self%give_time = state%time
         end if
         self%most_augmentations = max(self%most_augmentations, increment%n_augmentation)
         if (increment%unconverged > self%unconverged) then
            self%unconverged = increment%unconverged
            self%unconverged_time = state%time
         end if
         do i = 1, size(state%pairs%total)
            self%largest_force(i) = max(self%largest_force(i), &
               norm2(state%pairs%total(i)%slave(:2)))
         end do
      end associate
      self%stand_off%largest = max(self%stand_off%largest, increment%stand_off%largest)
      self%stand_off%impulse = self%stand_off%impulse + increment%stand_off%impulse
      self%stand_off%impulse_gap = self%stand_off%impulse_gap + increment%stand_off%impulse_gap
      do i = 1, increment%warnings%n
         call add_warning(self, increment%warnings%item(i)%text)
      end do
      call follow_overlaps(self, scene, march, increment)
      if (size(self%small%section) > 0) call follow_linear(self, scene, march)
      call follow_energy(self, march)
      if (march_is_done(march)) call follow_bending(self, scene, march)
   end subroutine verdict_update

   !> A body that is bent at the end of a step though its elements are too stiff for it.
   subroutine follow_bending(self, scene, march)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(bent_body_t) :: found
      character(len=:), allocatable :: text
      integer :: i

      call bent_body_find(march, scene, self%largest_energy, found)
      if (found%body == 0) return
      text = "the body of element " // to_text(found%label) // " is bent"
      do i = 1, self%warnings%n
         if (index(self%warnings%item(i)%text, text) == 1) return
      end do
      call add_warning(self, text // ", which elements with nodes at their corners alone resist: " &
         // to_text(found%percent, 2) // " % of its strain energy is in that; " // found%advice)
   end subroutine follow_bending

   !> Bodies in each other: the deepest overlap. Of those that no pair brings together a warning
   !> tells, for the first time of two of them.
   subroutine follow_overlaps(self, scene, march, increment)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(increment_t), intent(in) :: increment
      character(len=:), allocatable :: text, place
      integer :: i

      associate (body => march%system%space%body, overlap => increment%overlap, &
            stray => increment%stray, time => march%state%time)
         self%of_edges = max(self%of_edges, overlap%of_edges)
         if (overlap%depth > self%deepest) then
            self%deepest = overlap%depth
            self%deepest_time = time
            call overlap_text(overlap, scene%node_label, body, self%place)
         end if
         if (.not. stray%depth > touching) return
         text = "bodies " // to_text(min(body(stray%node), body(stray%edge(1)))) // " and " // &
            to_text(max(body(stray%node), body(stray%edge(1)))) // stray_words
         do i = 1, self%warnings%n
            if (index(self%warnings%item(i)%text, text) == 1) return
         end do
         call overlap_text(stray, scene%node_label, body, place)
         call add_warning(self, text // " at time " // to_text(time, 9) // ", " // place // &
            ": name them in a *CONTACT PAIR, or all by *CONTACT")
      end associate
   end subroutine follow_overlaps

   !> Linear sections: a warning where one leaves the range of small kinematics.
   subroutine follow_linear(self, scene, march)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(solid_t), pointer :: solid
      logical :: was_small(size(self%small%section))
      integer :: i

      was_small = max(self%small%rotation, self%small%strain) <= small_limit
      solid => terms_solid(march%system%term)
      call small_range_widen(self%small, solid, march%state%u)
      do i = 1, size(was_small)
         if (.not. was_small(i)) cycle
         if (max(self%small%rotation(i), self%small%strain(i)) <= small_limit) cycle
         call add_warning(self, "section " // scene%section(self%small%section(i))%set // &
            " is linear, but its rotations or strains are not small from time " // &
            to_text(march%state%time, 9) // " on: KINEMATICS=NONLINEAR would follow them")
      end do
   end subroutine follow_linear

   !> The energy balance. Unless the scheme keeps energy the works are sums over increments, exact
   !> only in the limit of small ones, and a scheme makes or takes energy: what they are off by is
   !> shown, not judged.
   pure subroutine follow_energy(self, march)
      type(verdict_t), intent(inout) :: self
      type(march_t), intent(in) :: march
      real(wp) :: kept

      associate (ledger => march%ledger)
         kept = kept_by(ledger)
         self%largest_energy = max(self%largest_energy, ledger%kinetic + ledger%strain)
         self%largest_drift = max(self%largest_drift, abs(kept - self%total0))
      end associate
      if (march%scheme%keeps_energy()) then
         self%has_dynamics = .true.
         self%dynamic_drift = max(self%dynamic_drift, abs(kept - self%reference))
         self%shown_reference = kept
         if (march%active%set%is_stored) then
            self%contact_kept = max(self%contact_kept, abs(march%ledger%contact_work &
               - self%contact_reference))
         else
            self%contact_reference = march%ledger%contact_work
         end if
      else
         self%reference = kept
         if (march%scheme%row%masses_resist) then
            self%shown_drift = max(self%shown_drift, abs(kept - self%shown_reference))
            self%contact_made = max(self%contact_made, &
               march%ledger%contact_work - self%contact_reference)
         else
            self%shown_reference = kept
            self%contact_reference = march%ledger%contact_work
         end if
      end if
   end subroutine follow_energy

   !> What stays, but for what the works of loads and of contact do not tell.
   pure real(wp) function kept_by(ledger) result(kept)
      type(ledger_t), intent(in) :: ledger

      kept = ledger%total - ledger%contact_work + ledger%decay + ledger%damping + ledger%friction &
         + ledger%contact_damping
   end function kept_by

   !> Count a warning, and keep it if it is another one than those before.
   pure subroutine add_warning(self, text)
      type(verdict_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer :: i

      self%n_warning = self%n_warning + 1
      if (self%warnings%n == most_warnings) return
      do i = 1, self%warnings%n
         if (self%warnings%item(i)%text == text) return
      end do
      call note_add(self%warnings, text)
   end subroutine add_warning

   !> Judge the run: it has come to its end, or was ended by the error of text `message`.
   subroutine verdict_end(self, message)
      type(verdict_t), intent(inout) :: self
      character(len=*), intent(in), optional :: message   !! present: the run failed

      self%is_complete = .not. present(message)
      self%message = ""
      if (present(message)) self%message = message
      self%reasons = notes_t()
      if (abs(self%stabilization) > half_digits*self%largest_energy) call note_add(self%reasons, &
         "loads do work on motions that nothing holds: stabilization bears " // &
         to_text(self%stabilization, 3))
      ! What friction takes in an increment is uncertain by what its slip is rounded to.
      if (self%dynamic_drift > energy_bar*self%largest_energy + slip_rounding*self%grip) then
         call note_add(self%reasons, &
            "the energy balance does NOT close to " // trim(closing_digits(this_precision)) // &
            " digits (" // to_text(self%dynamic_drift/self%largest_energy, 3) // &
            " of the largest energy)")
      end if
      if (self%contact_made > half_digits*self%largest_energy) call note_add(self%reasons, &
         "contact has made an energy of " // to_text(self%contact_made, 3) // ", " // &
         to_text(self%contact_made/self%largest_energy, 3) // " of the largest, which bodies " // &
         "that touch cannot do; SCHEME=ENERGY MOMENTUM makes none")
      if (self%contact_kept > energy_bar*self%largest_energy + slip_rounding*self%grip) then
         call note_add(self%reasons, "contact that gives way has made or taken an energy of " // &
            to_text(self%contact_kept, 3) // ", " // &
            to_text(self%contact_kept/self%largest_energy, 3) // " of the largest, which it " // &
            "should have stored: nodes that were in a surface have lost it at an end or a " // &
            "corner, where TYPE=NODE TO SURFACE of *CONTACT PAIR follows them; " // &
            "TYPE=NULL SPACE of *CONSTRAINT METHOD stores nothing")
      end if
      if (self%deepest > most_overlap(self)) call note_add(self%reasons, &
         "bodies overlap by " // &
         to_text(self%deepest, 3) // " of an edge at time " // to_text(self%deepest_time, 9) // &
         ", " // self%place)
      if (self%give > far_behind) call note_add(self%reasons, "contact gives way by up to " // &
         to_text(self%give, 3) // " of an edge: STIFFNESS or FACTOR of *CONSTRAINT METHOD is too " &
         // "small")
      if (self%law_missed > law_bar) call note_add(self%reasons, "the laws of contact and " // &
         "friction are missed by " // to_text(self%law_missed, 3) // " of the largest force")
      if (self%unconverged > half_digits) call note_add(self%reasons, "a residual of " // &
         to_text(self%unconverged, 3) // " was accepted at time " // &
         to_text(self%unconverged_time, 9))
   end subroutine verdict_end

   !> What bodies may be in each other by, per edge. What contact gives way by is told by itself.
   pure real(wp) function most_overlap(self)
      type(verdict_t), intent(in) :: self

      most_overlap = touching + most_give*self%give
      if (self%give <= far_behind) most_overlap = min(most_overlap, far_behind)
   end function most_overlap

   !> Has the run come to its end with nothing found wrong?
   pure logical function verdict_is_good(self)
      type(verdict_t), intent(in) :: self

      verdict_is_good = self%is_complete .and. self%reasons%n == 0
   end function verdict_is_good

   !> Is what was found wrong a failure of the analysis, asked for or not?
   pure logical function verdict_is_failure(self, is_strict)
      type(verdict_t), intent(in) :: self
      logical, intent(in) :: is_strict           !! whatever is bad is a failure

      verdict_is_failure = max(self%deepest, self%give) > far_behind .or. &
         (is_strict .and. self%reasons%n > 0)
   end function verdict_is_failure

   !> The verdict in a line.
   subroutine verdict_line(self, line)
      type(verdict_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: line   !! "verdict: good ..." or what is bad
      integer :: i

      if (.not. self%is_complete) then
         line = "verdict: NOT COMPLETED"
      else if (self%reasons%n > 0) then
         line = "verdict: BAD"
      else
         line = "verdict: good: "
         if (self%has_dynamics) line = line // &
            "the energy balance closes to " // trim(closing_digits(this_precision)) // &
            " digits or better, "
         if (self%shown_drift > energy_bar*self%largest_energy) line = line // "the scheme does " &
            // "not keep energy: the balance is off by " // &
            to_text(self%shown_drift/self%largest_energy, 3) // " of the largest energy (shown, " &
            // "not judged), "
         if (allocated(self%largest_force)) then
            if (self%give > 0.0_wp) then
               line = line // "contact gives way by up to " // to_text(self%give, 3) // &
                  " of an edge and no more penetrates, "
            else if (size(self%largest_force) > 0) then
               line = line // "nothing penetrates" // trim(merge(" where contact pairs are", &
                  repeat(" ", 24), has_stray(self))) // ", "
            end if
         end if
         line = line // "all residuals are within the tolerance"
      end if
      do i = 1, self%reasons%n
         line = line // merge(": ", "; ", i == 1) // self%reasons%item(i)%text
      end do
      if (self%n_warning > 0) line = line // "; warnings: " // to_text(self%n_warning)
   end subroutine verdict_line

   !> Was there an overlap of bodies that no pair brings together?
   pure logical function has_stray(self)
      type(verdict_t), intent(in) :: self
      integer :: i

      has_stray = .false.
      do i = 1, self%warnings%n
         has_stray = has_stray .or. index(self%warnings%item(i)%text, stray_words) > 0
      end do
   end function has_stray

   !> The closing balance, the warnings and the verdict.
   subroutine verdict_balance_lines(self, scene, march, lines)
      type(verdict_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(notes_t), intent(out) :: lines
      character(len=:), allocatable :: text
      real(wp) :: scale
      integer :: k

      associate (state => march%state, ledger => march%ledger)
         if (state%increment > 0) then
            scale = max(self%largest_energy, tiny(scale))
            call note_add(lines, "increments " // to_text(state%increment) // ", time " // &
               to_text(state%time, 9) // ", Newton iterations " // to_text(self%n_newton) // &
               ", cuts " // to_text(self%n_cut))
            call note_add(lines, "energy: kinetic " // to_text(ledger%kinetic, 9) // &
               ", strain " // to_text(ledger%strain, 9) // ", external work " // &
               to_text(ledger%external_work, 9) // ", contact work " // &
               to_text(ledger%contact_work, 9))
            call add_losses(self, ledger, lines)
            call note_add(lines, "total at start " // to_text(self%total0, 12) // ", at end " // &
               to_text(ledger%total, 12))
            call note_add(lines, "largest error of the energy balance " // &
               to_text(self%largest_drift/scale, 3) // &
               " of the largest energy, deepest penetration " // to_text(self%deepest, 3) // &
               " of an element")
            call add_checked(self, march, lines)
            if (abs(self%stabilization) > 0.0_wp) call note_add(lines, &
               "work of what stabilization bears " // to_text(self%stabilization/scale, 3) // &
               " of the largest energy")
            if (self%n_guarded > 0) then
               call guard_advice(scene%pair, text)
               call note_add(lines, "guards hold nodes in " // to_text(self%n_guarded) // &
                  " increments: " // text // " would make them needless")
            end if
            if (self%n_held > 0) call note_add(lines, "contacts that open and close in turn " // &
               "are held closed in " // to_text(self%n_held) // " increments, " // &
               to_text(self%most_held) // " at most in one")
            if (self%stand_off%impulse > 0.0_wp) call note_add(lines, &
               "largest stand-off of contact " // to_text(self%stand_off%largest, 3) // &
               " of an element, mean over the impulse " // &
               to_text(stand_off_mean(self%stand_off), 3))
            call add_small(self%small, scene, lines)
            call add_sizes(march, lines)
            do k = 1, size(self%largest_force)
               call note_add(lines, "contact " // &
                  scene%surface(scene%pair(k)%slave)%name // " on " // &
                  scene%surface(scene%pair(k)%master)%name // ": " // &
                  to_text(state%pairs%total(k)%n_active) // " active at end, largest force " // &
                  to_text(self%largest_force(k), 9))
            end do
         end if
      end associate
      call verdict_line(self, text)
      call note_add(lines, text)
   end subroutine verdict_balance_lines

   !> What was taken besides, and what contact gave way by.
   subroutine add_losses(self, ledger, lines)
      type(verdict_t), intent(in) :: self
      type(ledger_t), intent(in) :: ledger
      type(notes_t), intent(inout) :: lines

      if (ledger%restitution > 0.0_wp) call note_add(lines, "impacts took an energy of " // &
         to_text(ledger%restitution, 9) // " (RESTITUTION), part of contact work")
      if (abs(ledger%decay) > 0.0_wp) call note_add(lines, "the damping of the scheme took an " // &
         "energy of " // to_text(ledger%decay, 9))
      if (abs(ledger%damping) > 0.0_wp) call note_add(lines, "the damping of materials took " // &
         "an energy of " // to_text(ledger%damping, 9))
      if (abs(ledger%friction) > 0.0_wp) call note_add(lines, "friction took an energy of " // &
         to_text(ledger%friction, 9) // "; its law is met to " // to_text(self%law_missed, 3) // &
         " of the largest force")
      if (abs(ledger%contact_damping) > 0.0_wp) call note_add(lines, "the damping between " // &
         "surfaces took an energy of " // to_text(ledger%contact_damping, 9))
      if (self%give > 0.0_wp) call note_add(lines, "contact gave way by " // &
         to_text(self%give, 3) // " of an edge at time " // to_text(self%give_time, 9) // &
         "; it stores an energy of " // to_text(ledger%contact_energy, 9))
      if (self%most_augmentations > 0) call note_add(lines, "augmentations " // &
         to_text(self%most_augmentations) // " at most in a solve")
   end subroutine add_losses

   !> What linear sections have met.
   subroutine add_small(small, scene, lines)
      type(small_range_t), intent(in) :: small
      type(scene_t), intent(in) :: scene
      type(notes_t), intent(inout) :: lines
      integer :: i

      do i = 1, size(small%section)
         call note_add(lines, "linear section " // scene%section(small%section(i))%set // &
            ": rotation up to " // to_text(small%rotation(i), 3) // " rad, strain up to " // &
            to_text(small%strain(i), 3) // trim(merge("            ", ": NOT small ", &
            max(small%rotation(i), small%strain(i)) <= small_limit)))
      end do
   end subroutine add_small

   !> Which sizes increments had that chose them, and what made them smaller.
   subroutine add_sizes(march, lines)
      type(march_t), intent(in) :: march
      type(notes_t), intent(inout) :: lines
      type(notes_t) :: sizes
      type(string_t) :: why(n_why)
      integer :: k

      associate (control => march%state%control)
         call control_sizes(control, sizes)
         if (sizes%n == 0) return
         do k = 1, n_why
            why(k)%text = trim(why_text(k)) // " " // to_text(control%n_less(k))
         end do
         call note_add(lines, "increments of sizes, by the powers of two below them, " // &
            joined(sizes%item(:sizes%n), ", ", sizes%n))
         call note_add(lines, "made smaller for: " // joined(why, ", ", n_why) // &
            "; larger error than TOLERANCE in " // to_text(control%n_over) // &
            "; events located " // to_text(control%n_event))
      end associate
   end subroutine add_sizes

   !> What these pairs can do to need no guards.
   pure subroutine guard_advice(pair, advice)
      type(contact_pair_t), intent(in) :: pair(:)   !! (any) of the scene
      character(len=:), allocatable, intent(out) :: advice   !! a list, ends without a full stop
      logical :: is_nodes(size(pair)), is_one_sided, is_integrated

      is_nodes = pair%formulation == formulation_nts
      is_one_sided = any(pair%is_guarded .and. is_nodes .and. .not. pair%both_sides)
      is_integrated = any(pair%is_guarded .and. .not. is_nodes)
      advice = "a finer mesh there"
      if (is_one_sided .or. is_integrated) advice = "the other surface as slave or " // advice
      if (is_integrated .and. is_one_sided) then
         advice = "TYPE=NODE TO SURFACE with SIDES=BOTH, " // advice
      else if (is_integrated) then
         advice = "TYPE=NODE TO SURFACE, " // advice
      else if (is_one_sided) then
         advice = "SIDES=BOTH, " // advice
      end if
   end subroutine guard_advice

   !> What the judge looks at.
   subroutine add_checked(self, march, lines)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      type(notes_t), intent(inout) :: lines

      associate (outline => march%judge%look%outline)
         if (outline%n_piece == 0) return
         call note_add(lines, "penetration was looked for after every step, both ways, nodes and " &
            // "edges: " // to_text(outline%n_piece) // " bodies with " // &
            to_text(size(outline%edge, 2)) // " edges")
         if (self%of_edges > touching) call note_add(lines, "edges of curved surfaces " // &
            "overlap by up to " // to_text(self%of_edges, 3) // &
            " of their length, the curves that they are chords of do not")
      end associate
   end subroutine add_checked

end module emcon_verdict
