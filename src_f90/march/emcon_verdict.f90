!> The verdict on a run: what was found wrong, in figures that run along with it.
!>
!> A run is good if its energy balance closes, no body is inside another, contact forces act where
!> surfaces touch and every residual is within the tolerance. Warnings stand beside that: they do
!> not make a run bad.
module emcon_verdict
   use emcon_bent_bodies, only : bent_body_find, bent_body_t
   use emcon_energy_watch, only : energy_follow, energy_is_failure, energy_move, energy_reasons, &
      energy_start, energy_warnings, energy_watch_t
   use emcon_evaluation, only : evaluation_has_inertia
   use emcon_far_nodes, only : far_element_find
   use emcon_force_scatter, only : force_scatter_t, scatter_follow
   use emcon_guards, only : overlap_told, touching_bar
   use emcon_kinds, only : wp
   use emcon_locking, only : locking_advice, locking_element
   use emcon_ledger, only : ledger_t
   use emcon_overlap_check, only : overlap_check_own, overlap_check_t
   use emcon_overlap_query, only : overlap_t, overlap_text
   use emcon_march, only : increment_t, march_is_done, march_t
   use emcon_march_snap, only : snap_left
   use emcon_nodal_pull, only : nodal_pull_join, nodal_pull_t
   use emcon_scene, only : scene_t
   use emcon_small_range, only : small_limit, small_range_init, small_range_t, small_range_widen
   use emcon_solid, only : solid_t
   use emcon_stand_off, only : stand_off_mean, stand_off_t
   use emcon_steps, only : initiation_massless, most_stand_off, step_initiation
   use emcon_term_registry, only : terms_solid
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: verdict_t, verdict_start, verdict_update, verdict_move, verdict_end, &
      verdict_is_good, verdict_is_failure, verdict_jump_violation, verdict_law_violation

   !> Largest relative residual that is accepted where rounding ends Newton's method early: half of
   !> the digits are left.
   real(wp), parameter :: half_digits = sqrt(epsilon(1.0_wp))
   !> Part of the forces that STABILIZE may bear at the end of a step.
   real(wp), parameter :: most_viscous = 1.0e-3_wp
   !> So far in each other, per edge, bodies make the run a failure.
   real(wp), parameter :: far_behind = 0.1_wp
   !> What contact gives way by is told; so many times that is deeper, whichever edge counts.
   real(wp), parameter :: most_give = 2.0_wp
   !> The laws of contact and friction may be missed by this part of the largest force; forces that
   !> differ by half of the second number are one to `emcon_friction`.
   real(wp), parameter :: law_bar = max(half_digits, 1.0e5_wp*epsilon(1.0_wp))
   !> Air across which contact forces act, per edge, in the mean over the impulse, that is told.
   real(wp), parameter :: told_stand_off = 0.1_wp
   !> Rotation [rad] beyond which linear sections are wrong by a fifth.
   real(wp), parameter :: most_turn = 0.2_wp
   character(len=*), parameter :: unpaired = ": no *CONTACT PAIR names the two; add one, or " // &
      "name all by *CONTACT"
   character(len=*), parameter :: idle_pair = ": no *CONTACT PAIR that acts then " // &
      "names the two"
   !> Different warnings that are kept; others are counted only.
   integer, parameter :: most_warnings = 20
   !> More than this of the thickness of the element behind a facet is told: contact may soon push
   !> what is in it out on the other side.
   real(wp), parameter :: most_through = 0.2_wp

   !> How far bodies were in each other.
   type :: overlap_found_t
      !> So far, per edge, bodies may be in each other: corners of master surfaces are rounded over
      !> a tenth of that, coordinates of decks by less.
      real(wp) :: bar = touching_bar
      real(wp) :: deepest = 0.0_wp               !! penetration per edge
      real(wp) :: time = 0.0_wp                  !! of the deepest one [T]
      real(wp) :: of_facets = 0.0_wp              !! of edges that stand for curves, per edge
      character(len=:), allocatable :: place     !! of the deepest one: bodies and nodes
   end type overlap_found_t

   !> How contact that gives way has done so.
   type :: penalty_found_t
      real(wp) :: give = 0.0_wp                  !! how deep contact has given way, per edge
      real(wp) :: time = 0.0_wp                  !! of that [T]
      integer :: most_augmentations = 0          !! of an augmented Lagrangian in an increment
      logical :: is_meant = .false.              !! by pressures that the deck gives, all of it
   end type penalty_found_t

   type :: verdict_counts_t
      integer :: newton = 0
      integer :: cut = 0
      integer :: guarded = 0                     !! increments in which guards act
   end type verdict_counts_t

   !> Running figures, and how the run ended.
   type :: verdict_t
      type(energy_watch_t) :: energy
      type(overlap_found_t) :: overlap
      real(wp) :: unconverged = 0.0_wp           !! largest residual accepted above the tolerance
      real(wp) :: unconverged_time = 0.0_wp      !! [T]
      type(stand_off_t) :: stand_off
      logical :: has_massless = .false.          !! in some step, contact has taken masses away
      type(nodal_pull_t) :: nodal_pull
      type(small_range_t) :: small               !! what linear sections have met
      real(wp) :: law_missed = 0.0_wp            !! of contact and friction, at most [M L/T^2]
      real(wp) :: jump_missed = 0.0_wp           !! with jumps of velocity, at most [M L/T^2]
      real(wp) :: largest_push = 0.0_wp          !! of contacts where there is friction [M L/T^2]
      type(penalty_found_t) :: penalty
      type(verdict_counts_t) :: count
      real(wp), allocatable :: largest_force(:)  !! (n_pair) on the slave side
      type(force_scatter_t), allocatable :: scatter(:)   !! (pairs) of forces from increment to next
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
      integer :: k

      call energy_start(self%energy, march%ledger)
      do k = 1, size(march%system%contact)
         self%overlap%bar = max(self%overlap%bar, march%system%contact(k)%contact%lets_in())
      end do
      self%overlap%place = ""
      self%message = ""
      call small_range_init(self%small, terms_solid(march%system%term))
      allocate(self%largest_force(size(march%state%pairs%total)), source=0.0_wp)
      allocate(self%scatter(size(march%state%sums%sum)))
      call warn_of_locking(self, terms_solid(march%system%term))
      call warn_of_distance(self, march, terms_solid(march%system%term))
   end subroutine verdict_start

   !> Elements that are too stiff, the one with the largest ratio of Poisson named.
   subroutine warn_of_locking(self, solid)
      type(verdict_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      real(wp) :: ratio
      integer :: e

      call locking_element(solid, e, ratio)
      if (e > 0) call add_warning(self, "element " // to_text(solid%deck%label(e)) // " at nu = " &
         // to_text(ratio) // " locks: " // trim(locking_advice(solid)))
   end subroutine warn_of_locking

   !> Elements far from the origin, the one whose distances keep fewest digits named; once.
   subroutine warn_of_distance(self, march, solid)
      type(verdict_t), intent(inout) :: self
      type(march_t), intent(in) :: march
      type(solid_t), intent(in) :: solid         !! its elements
      character(len=*), parameter :: text = "far from the origin: distances within element "
      integer :: e, digits

      if (has_warning(self, text)) return
      call far_element_find(march%motion%x, march%state%u, solid%node, e, digits)
      if (e > 0) call add_warning(self, text // to_text(solid%deck%label(e)) // " keep " // &
         to_text(digits) // " digits: move the model to the origin")
   end subroutine warn_of_distance

   !> The state was set from outside, which turned `before` into `after`: what came in or went out
   !> by that is no error of the balance.
   pure subroutine verdict_move(self, before, after)
      type(verdict_t), intent(inout) :: self
      type(ledger_t), intent(in) :: before, after

      call energy_move(self%energy, before, after)
   end subroutine verdict_move

   !> Take over what `increment` has found, which has led to the state of `march`.
   subroutine verdict_update(self, scene, march, increment)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(increment_t), intent(in) :: increment
      integer :: i

      self%count%newton = self%count%newton + increment%n_newton
      self%count%cut = self%count%cut + increment%n_cut
      if (increment%is_guarded) self%count%guarded = self%count%guarded + 1
      associate (state => march%state)
         self%has_massless = self%has_massless .or. &
            step_initiation(scene%step(state%clock%i_step)) == initiation_massless
         self%law_missed = max(self%law_missed, increment%law_missed)
         self%jump_missed = max(self%jump_missed, increment%jump_missed)
         self%largest_push = max(self%largest_push, increment%largest_push)
         call scatter_follow(self%scatter, state%sums%sum, &
            evaluation_has_inertia(march%motion%evaluation))
         if (.not. self%penalty%give > 0.0_wp) self%penalty%is_meant = .true.
         self%penalty%is_meant = self%penalty%is_meant .and. march%active%penalty%is_meant
         if (increment%give > self%penalty%give) then
            self%penalty%give = increment%give
            self%penalty%time = state%clock%time
         end if
         self%penalty%most_augmentations = max(self%penalty%most_augmentations, &
            increment%n_augmentation)
         if (increment%unconverged > self%unconverged) then
            self%unconverged = increment%unconverged
            self%unconverged_time = state%clock%time
         end if
         do i = 1, size(state%pairs%total)
            self%largest_force(i) = max(self%largest_force(i), &
               norm2(state%pairs%total(i)%slave(:size(state%u, 1))))
         end do
      end associate
      self%stand_off%largest = max(self%stand_off%largest, increment%stand_off%largest)
      self%stand_off%impulse = self%stand_off%impulse + increment%stand_off%impulse
      self%stand_off%impulse_gap = self%stand_off%impulse_gap + increment%stand_off%impulse_gap
      call nodal_pull_join(self%nodal_pull, increment%nodal_pull)
      do i = 1, increment%warnings%n
         call add_warning(self, increment%warnings%item(i)%text)
      end do
      call follow_overlaps(self, scene, march, increment)
      if (size(self%small%section) > 0) call follow_linear(self, scene, march)
      call energy_follow(self%energy, march%ledger, march%scheme, &
         march%active%set%penalty%is_stored, &
         increment%work_scale)
      if (.not. march_is_done(march)) return
      call follow_bending(self, scene, march)
      call warn_of_gaps(self, march%ledger)
      call warn_of_snap(self, scene, march)
      call warn_of_distance(self, march, terms_solid(march%system%term))
   end subroutine verdict_update

   !> Ties whose surfaces stay apart: what their couple was, and did to the angular momentum.
   subroutine warn_of_gaps(self, ledger)
      type(verdict_t), intent(inout) :: self
      type(ledger_t), intent(in) :: ledger
      character(len=:), allocatable :: text

      associate (couple => ledger%tie_couple)
         if (.not. couple%largest > 0.0_wp) return
         text = "forces across the gaps of ties with ADJUST=NO have a couple of up to " // &
            to_text(couple%largest, 3)
         if (norm2(couple%impulse) > 0.0_wp) text = text // ": the angular momentum has changed " &
            // "by " // to_text(norm2(couple%impulse), 3) // ", and is " // &
            to_text(couple%angular, 3) // " at most; ADJUST=YES closes the gaps"
         call add_warning(self, text)
      end associate
   end subroutine warn_of_gaps

   !> What STABILIZE holds on its way at the end of a step is not at rest there. What springs back
   !> is, once its forces, as the root of what it stores, are small by what they were.
   subroutine warn_of_snap(self, scene, march)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      real(wp) :: left, largest

      if (.not. scene%step(march%state%clock%i_step)%stabilization > 0.0_wp) return
      largest = max(self%energy%largest, sum(march%state%energy))
      left = snap_left(march)
      if (largest > 0.0_wp) left = left*sqrt(sum(march%state%energy)/largest)
      if (left > most_viscous) call add_warning(self, "at the end of step " // &
         to_text(march%state%clock%i_step) // " STABILIZE carries " // to_text(left, 2) // &
         " of the largest forces: a body is still moving; let the step last longer, or " // &
         "give a smaller value than STABILIZE=" // &
         to_text(scene%step(march%state%clock%i_step)%stabilization, 2))
   end subroutine warn_of_snap

   !> A body that is bent at the end of a step though its elements are too stiff for it.
   subroutine follow_bending(self, scene, march)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(bent_body_t) :: found
      character(len=:), allocatable :: text

      call bent_body_find(march, scene, self%energy%largest, found)
      if (found%body == 0) return
      text = "the body of element " // to_text(found%label) // " is bent"
      if (has_warning(self, text)) return
      call add_warning(self, text // " and made of linear elements, too stiff by about " // &
         to_text(found%percent, 2) // " %; " // found%advice)
   end subroutine follow_bending

   !> Bodies in each other: the deepest overlap, of those that no pair brings together as well.
   subroutine follow_overlaps(self, scene, march, increment)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(increment_t), intent(in) :: increment

      self%overlap%of_facets = max(self%overlap%of_facets, increment%overlap%of_facets)
      associate (overlap => increment%overlap, stray => increment%stray)
         call follow_thickness(self, scene, march, overlap)
         call follow_thickness(self, scene, march, stray)
         if (max(overlap%depth, stray%depth) <= self%overlap%deepest) return
         self%overlap%deepest = max(overlap%depth, stray%depth)
         self%overlap%time = march%state%clock%time
         if (overlap%depth >= stray%depth) then
            call overlap_text(overlap, scene%node%label, march%system%space%body, &
               self%overlap%place)
         else
            call overlap_text(stray, scene%node%label, march%system%space%body, self%overlap%place)
            if (march%overlap_check%query%has_idle()) then
               self%overlap%place = self%overlap%place // idle_pair
            else
               self%overlap%place = self%overlap%place // unpaired
            end if
         end if
      end associate
      if (self%overlap%deepest > most_overlap(self)) call tell_own(self, scene, march, increment)
   end subroutine follow_overlaps

   !> Facets may be much longer than the body behind them is thick: the first place where one is
   !> deep in the other by that is told.
   subroutine follow_thickness(self, scene, march, overlap)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(overlap_t), intent(in) :: overlap
      character(len=:), allocatable :: place, text

      if (overlap%depth*(overlap%length/overlap%thickness) <= most_through) return
      text = "a body is in another by more than " // to_text(most_through) // " of the " // &
         "thickness of the elements there"
      if (has_warning(self, text)) return
      call overlap_text(overlap, scene%node%label, march%system%space%body, place)
      call add_warning(self, text // " at time " // to_text(march%state%clock%time, 9) // ", " // &
         place // ": smaller faces, or SIDES=BOTH of NODE TO SURFACE, keep it out")
   end subroutine follow_thickness

   !> What has gone through itself may come to others from behind.
   subroutine tell_own(self, scene, march, increment)
      type(verdict_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(increment_t), intent(in) :: increment !! with an overlap
      type(overlap_check_t) :: check
      type(overlap_t) :: own
      character(len=:), allocatable :: text

      check = march%overlap_check
      if (increment%overlap%depth >= increment%stray%depth) then
         call overlap_check_own(check, scene%x, march%state%u, increment%overlap, own)
      else
         call overlap_check_own(check, scene%x, march%state%u, increment%stray, own)
      end if
      if (.not. own%depth > 0.0_wp) return
      call overlap_text(own, scene%node%label, march%system%space%body, text)
      self%overlap%place = self%overlap%place // "; a body has gone through itself by then, " &
         // text // ": name that surface in a *CONTACT PAIR with itself"
   end subroutine tell_own

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
            to_text(march%state%clock%time, 9) // " on: KINEMATICS=NONLINEAR would follow them")
      end do
   end subroutine follow_linear

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

   !> Is there a warning that begins with `text`?
   pure logical function has_warning(self, text)
      type(verdict_t), intent(in) :: self
      character(len=*), intent(in) :: text
      integer :: i

      has_warning = .false.
      do i = 1, self%warnings%n
         has_warning = has_warning .or. index(self%warnings%item(i)%text, text) == 1
      end do
   end function has_warning

   !> Judge the run: it has come to its end, or was ended by the error of text `message`.
   subroutine verdict_end(self, message)
      type(verdict_t), intent(inout) :: self
      character(len=*), intent(in), optional :: message   !! present: the run failed

      self%is_complete = .not. present(message)
      self%message = ""
      if (present(message)) self%message = message
      self%reasons = notes_t()
      call energy_reasons(self%energy, self%reasons)
      call judge_geometry(self)
      if (verdict_law_violation(self) > law_bar) call note_add(self%reasons, &
         "the laws of contact and friction are violated by " // &
         to_text(verdict_law_violation(self), 3) // " of the largest force")
      if (verdict_jump_violation(self) > law_bar) call note_add(self%reasons, &
         "where velocities jump the law of friction is violated by " // &
         to_text(verdict_jump_violation(self), 3) // " of the largest force")
      if (self%unconverged > half_digits) call note_add(self%reasons, "a residual of " // &
         to_text(self%unconverged, 3) // " was accepted at time " // &
         to_text(self%unconverged_time, 9))
      if (self%is_complete) call warn_of_whole(self)
   end subroutine verdict_end

   !> What may be wrong with the run as a whole.
   subroutine warn_of_whole(self)
      type(verdict_t), intent(inout) :: self
      type(notes_t) :: found
      character(len=:), allocatable :: text
      integer :: i

      call energy_warnings(self%energy, found)
      associate (mean => stand_off_mean(self%stand_off))
         if (mean > told_stand_off .and. mean <= most_stand_off) then
            call stand_off_text(self, text)
            call note_add(found, text)
         end if
      end associate
      if (self%overlap%deepest > overlap_told .and. .not. (self%penalty%is_meant .and. &
         self%penalty%give > 0.0_wp) &
         .and. self%overlap%deepest <= most_overlap(self)) call note_add( &
         found, "bodies overlap by " // to_text(self%overlap%deepest, 3) &
         // " of an edge at time " // &
         to_text(self%overlap%time, 9) // ", which guards allow: SIDES=BOTH of NODE TO " // &
         "SURFACE stops all nodes, smaller edges reduce the overlap")
      do i = 1, found%n
         call add_warning(self, found%item(i)%text)
      end do
   end subroutine warn_of_whole

   !> Air across which contact forces act, and what to do about it.
   pure subroutine stand_off_text(self, text)
      type(verdict_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text   !! a sentence

      text = "contact forces act across gaps of " // to_text(stand_off_mean(self%stand_off), 2) // &
         " of an edge on average (weighted by impulse): smaller increments, "
      ! Where masses are taken away it is between nodes that have kept theirs.
      if (self%has_massless) then
         text = text // "or TYPE=ADMISSIBLE of *CONTACT INITIATION, make them smaller"
      else
         text = text // "a smaller GAP TOLERANCE, or TYPE=ADMISSIBLE or MASSLESS of *CONTACT " // &
            "INITIATION make them smaller"
      end if
   end subroutine stand_off_text

   !> Where bodies are, what contact forces act across, and how far linear sections have turned.
   subroutine judge_geometry(self)
      type(verdict_t), intent(inout) :: self
      character(len=:), allocatable :: text
      integer :: i

      if (self%overlap%deepest > most_overlap(self)) call note_add(self%reasons, &
         "bodies overlap by " // to_text(self%overlap%deepest, 3) // " of an edge at time " // &
         to_text(self%overlap%time, 9) // ", " // self%overlap%place)
      if (self%penalty%give > far_behind .and. .not. self%penalty%is_meant) call note_add( &
         self%reasons, &
         "contact penetrates by up to " // to_text(self%penalty%give, 3) // &
         " of an edge: STIFFNESS or FACTOR of *CONSTRAINT METHOD is too small")
      if (stand_off_mean(self%stand_off) > most_stand_off) then
         call stand_off_text(self, text)
         call note_add(self%reasons, text)
      end if
      if (.not. allocated(self%small%rotation)) return
      do i = 1, size(self%small%rotation)
         if (self%small%rotation(i) > most_turn) call note_add(self%reasons, "linear elements " &
            // "rotate by " // to_text(self%small%rotation(i), 3) // " rad: KINEMATICS=NONLINEAR " &
            // "of their *SOLID SECTION follows that")
      end do
   end subroutine judge_geometry

   !> What bodies may be in each other by, per edge. What contact gives way by is told by itself.
   pure real(wp) function most_overlap(self)
      type(verdict_t), intent(in) :: self

      most_overlap = self%overlap%bar + most_give*self%penalty%give
      if (self%penalty%give <= far_behind) most_overlap = min(most_overlap, far_behind)
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

      if (self%penalty%is_meant) then
         verdict_is_failure = self%overlap%deepest > max(far_behind, most_overlap(self))
      else
         verdict_is_failure = max(self%overlap%deepest, self%penalty%give) > far_behind
      end if
      verdict_is_failure = verdict_is_failure .or. energy_is_failure(self%energy) .or. &
         (is_strict .and. self%reasons%n > 0)
   end function verdict_is_failure

   !> How far the laws of contact and friction were missed, by the largest force of the run.
   pure real(wp) function verdict_law_violation(self) result(missed)
      type(verdict_t), intent(in) :: self

      missed = 0.0_wp
      if (self%largest_push > 0.0_wp) missed = self%law_missed/self%largest_push
   end function verdict_law_violation

   !> The same of Coulomb's cone, for means over increments with the jumps of velocity at their
   !> ends.
   pure real(wp) function verdict_jump_violation(self) result(missed)
      type(verdict_t), intent(in) :: self

      missed = 0.0_wp
      if (self%largest_push > 0.0_wp) missed = self%jump_missed/self%largest_push
   end function verdict_jump_violation

end module emcon_verdict
