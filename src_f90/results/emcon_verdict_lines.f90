!> The closing balance of a run and its verdict, as lines for the user.
module emcon_verdict_lines
   use emcon_energy_watch, only : closing_text, energy_bar, energy_rounding
   use emcon_force_scatter, only : scatter_is_comb, scatter_of
   use emcon_guards, only : crossing_bar, overlap_told, touching_bar
   use emcon_interactions, only : contact_pair_t, formulation_nts, multiplier_dual
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : march_t
   use emcon_march_begin, only : overlap_at_start
   use emcon_nodal_pull, only : nodal_pull_text
   use emcon_scene, only : scene_t
   use emcon_small_range, only : small_limit, small_range_t
   use emcon_stand_off, only : stand_off_mean
   use emcon_step_control, only : control_sizes, n_why, why_text
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   use emcon_verdict, only : verdict_jump_violation, verdict_law_violation, verdict_t
   implicit none
   private
   public :: verdict_balance_lines, verdict_line, guard_advice

   !> Stand-offs below that part of an edge are round-off.
   real(wp), parameter :: rounding = sqrt(epsilon(1.0_wp))

contains

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
         call good_line(self, line)
      end if
      do i = 1, self%reasons%n
         line = line // merge(": ", "; ", i == 1) // self%reasons%item(i)%text
      end do
      if (self%n_warning > 0) line = line // "; warnings during the run: " // &
         to_text(self%n_warning)
   end subroutine verdict_line

   !> What a good run is good for.
   subroutine good_line(self, line)
      type(verdict_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: line
      character(len=:), allocatable :: digits
      real(wp) :: bar

      line = "verdict: good: "
      associate (energy => self%energy)
         bar = energy_bar*energy%largest + energy_rounding(energy)
         if (energy%has_dynamics) then
            call closing_text(digits)
            line = line // "the energy balance "
            ! Works of static steps are taken as if forces rose linearly, and are not judged.
            if (energy%largest_error > bar .and. .not. energy%shown_error > bar) then
               line = line // "of the dynamic steps "
            end if
            line = line // "closes to " // digits // " digits or better, "
         end if
         if (energy%shown_error > bar) line = line &
            // "the scheme does not keep energy: the balance is off by " // &
            to_text(energy%shown_error/energy%largest, 3) // " of the largest energy (shown, " // &
            "not judged), "
      end associate
      if (allocated(self%largest_force)) then
         if (self%penalty%give > 0.0_wp .and. self%penalty%is_meant) then
            line = line // "contact penetrates by up to " // to_text(self%penalty%give, 3) // &
               " of an edge, as its PRESSURE-OVERCLOSURE says, nothing else does, "
         else if (self%penalty%give > 0.0_wp) then
            line = line // "contact penetrates by up to " // to_text(self%penalty%give, 3) // &
               " of an edge, nothing else does, "
         else if (self%overlap%deepest > overlap_told) then
            line = line // "nothing penetrates by more than guards allow, "
         else if (self%overlap%deepest > touching_bar .and. self%overlap%bar <= crossing_bar) then
            line = line // "edges cross between nodes by up to " // &
               to_text(self%overlap%deepest, 3) // " of an edge, nothing else penetrates, "
         else if (size(self%largest_force) > 0) then
            line = line // "nothing " // trim(merge("else penetrates,", "penetrates,     ", &
               overlaps_stay(self))) // " "
         end if
      end if
      line = line // "all residuals are within the tolerance"
      if (self%unconverged > 0.0_wp) line = line // ", or round-off (" &
         // to_text(self%unconverged, 3) // " of the forces at time " &
         // to_text(self%unconverged_time, 9) // ")"
   end subroutine good_line

   !> Are there bodies that no pair brings together, and that overlapped as a step began?
   pure logical function overlaps_stay(self)
      type(verdict_t), intent(in) :: self
      integer :: i

      overlaps_stay = .false.
      do i = 1, self%warnings%n
         overlaps_stay = overlaps_stay .or. index(self%warnings%item(i)%text, overlap_at_start) == 1
      end do
   end function overlaps_stay

   !> The closing balance, the warnings and the verdict.
   subroutine verdict_balance_lines(self, scene, march, lines)
      type(verdict_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(notes_t), intent(out) :: lines
      character(len=:), allocatable :: text

      if (march%state%clock%increment > 0) then
         call note_add(lines, "increments " // to_text(march%state%clock%increment) &
            // ", time " // to_text(march%state%clock%time, 9) // ", Newton iterations " &
            // to_text(self%count%newton) // ", cuts " // to_text(self%count%cut))
         call add_energies(self, march%ledger, lines)
         call add_checked(self, march, lines)
         if (self%count%guarded > 0) then
            call guard_advice(scene%pair, text)
            call note_add(lines, "guards act in " // to_text(self%count%guarded) // &
               " increments; to avoid that: " // text)
         end if
         if (self%stand_off%largest > rounding) call note_add(lines, &
            "largest stand-off (gap across which contact forces act) " // &
            to_text(self%stand_off%largest, 3) // " of an element, mean over the impulse " // &
            to_text(stand_off_mean(self%stand_off), 3))
         call add_small(self%small, scene, lines)
         call add_sizes(march, lines)
         call add_pairs(self, scene, march, lines)
      end if
      call verdict_line(self, text)
      call note_add(lines, text)
   end subroutine verdict_balance_lines

   !> Energies, what was taken of them, and how the balance closes.
   subroutine add_energies(self, ledger, lines)
      type(verdict_t), intent(in) :: self
      type(ledger_t), intent(in) :: ledger
      type(notes_t), intent(inout) :: lines
      character(len=:), allocatable :: text

      call note_add(lines, "energy: kinetic " // to_text(ledger%kinetic, 9) // &
         ", strain " // to_text(ledger%strain, 9) // ", external work " // &
         to_text(ledger%external_work, 9) // ", contact work " // to_text(ledger%contact_work, 9))
      call add_losses(self, ledger, lines)
      associate (energy => self%energy)
         call note_add(lines, "total at start " // to_text(energy%at_start, 12) // ", at end " // &
            to_text(ledger%total, 12))
         text = "largest error of the energy balance "
         if (energy%largest_error > energy_rounding(energy) .or. &
            energy%largest_error <= energy_bar*energy%largest) then
            text = text // to_text(energy%largest_error/max(energy%largest, tiny(1.0_wp)), 3) // &
               " of the largest energy"
         else
            text = text // to_text(energy%largest_error, 3) // ", round-off of the forces"
         end if
         call note_add(lines, text)
         if (abs(energy%stabilization) > 0.0_wp) call note_add(lines, &
            "work of stabilization " // to_text(energy%stabilization &
            /max(energy%largest, tiny(1.0_wp)), 3) // " of the largest energy")
      end associate
   end subroutine add_energies

   !> What was taken besides, and what contact gave way by.
   subroutine add_losses(self, ledger, lines)
      type(verdict_t), intent(in) :: self
      type(ledger_t), intent(in) :: ledger
      type(notes_t), intent(inout) :: lines

      if (ledger%restitution > 0.0_wp) call note_add(lines, "impacts with RESTITUTION below 1 " // &
         "dissipated " // to_text(ledger%restitution, 9) // ", part of contact work")
      if (abs(ledger%decay) > 0.0_wp) call note_add(lines, "SCHEME=ENERGY DECAYING dissipated " // &
         to_text(ledger%decay, 9))
      if (abs(ledger%damping) > 0.0_wp) call note_add(lines, "damping dissipated " // &
         to_text(resolved(self, ledger%damping), 9))
      if (abs(ledger%friction) > 0.0_wp) call note_add(lines, "friction dissipated " // &
         to_text(resolved(self, ledger%friction), 9) // "; friction law satisfied to " // &
         to_text(verdict_law_violation(self), 2) // " of the largest force, " // &
         to_text(verdict_jump_violation(self), 2) // " with jumps of velocity")
      if (abs(ledger%contact_damping) > 0.0_wp) call note_add(lines, "contact damping " // &
         "dissipated " // to_text(resolved(self, ledger%contact_damping), 9))
      if (self%penalty%give > 0.0_wp) call note_add(lines, "largest penetration of contact " // &
         to_text(self%penalty%give, 3) // " of an edge, at time " // to_text(self%penalty%time, &
         9) // "; stored at the end " // to_text(ledger%contact_energy, 9))
      if (self%penalty%most_augmentations > 0) call note_add(lines, "augmentations " // &
         to_text(self%penalty%most_augmentations) // " at most in a solve")
   end subroutine add_losses

   !> A loss as it is told: 0 where it is not more than the works of the run are rounded by.
   pure real(wp) function resolved(self, loss)
      type(verdict_t), intent(in) :: self
      real(wp), intent(in) :: loss               !! [M L^2/T^2]

      resolved = merge(loss, 0.0_wp, abs(loss) > energy_rounding(self%energy))
   end function resolved

   !> Whether overlap was looked for, and the deepest.
   subroutine add_checked(self, march, lines)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      type(notes_t), intent(inout) :: lines

      associate (check => march%overlap_check)
         if (check%n_piece == 0) then
            call note_add(lines, "overlap not checked: no *CONTACT PAIR or *CONTACT names " // &
               "a surface")
            return
         end if
         call note_add(lines, "overlap checked: " // to_text(check%n_piece) // &
            trim(merge(" body,  ", " bodies,", check%n_piece == 1)) // " " // &
            to_text(check%n_facet) // trim(merge(" edges", " faces", size(check%low, 1) < 3)) // &
            "; deepest penetration " // &
            to_text(self%overlap%deepest, 3) // " of an element")
         if (self%overlap%of_facets > max(touching_bar, self%overlap%deepest)) then
            call note_add(lines, "straight edges of curved surfaces overlap by up to " // &
            to_text(self%overlap%of_facets, 3) // " of their length, the curves through their " // &
            "nodes do not")
         end if
      end associate
   end subroutine add_checked

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
         call note_add(lines, "increments by size (powers of two): " // &
            joined(sizes%item(:sizes%n), ", ", sizes%n))
         call note_add(lines, "made smaller because of: " // joined(why, ", ", n_why) // &
            "; error above TOLERANCE at the smallest size: " // to_text(control%n_over) // &
            "; events located: " // to_text(control%n_event))
      end associate
   end subroutine add_sizes

   !> What pairs have transmitted, and those whose force is a comb.
   subroutine add_pairs(self, scene, march, lines)
      type(verdict_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(march_t), intent(in) :: march
      type(notes_t), intent(inout) :: lines
      character(len=:), allocatable :: text
      integer :: k, p

      do k = 1, size(self%largest_force)
         call pair_text(scene, k, text)
         call note_add(lines, text // ": " // to_text(march%state%pairs%total(k)%n_active) // &
            " active at end, largest force " // to_text(self%largest_force(k), 9))
      end do
      if (any(scene%step%contact%options%multiplier == multiplier_dual)) then
         call nodal_pull_text(self%nodal_pull, text)
         if (len(text) > 0) call note_add(lines, text)
      end if
      do p = 1, size(self%scatter)
         if (.not. scatter_is_comb(self%scatter(p)) .or. march%active%penalty%is_on) cycle
         k = abs(march%system%contact(findloc(abs(march%state%sums%of_pair), p, 1))%of_pair)
         call pair_text(scene, k, text)
         text = "the force of " // text // " jumps up and down from increment to increment " // &
            "(scatter " // to_text(100.0_wp*scatter_of(self%scatter(p)), 2) // &
            " %); only its mean over several is meaningful: "
         if (march%layer%is_on) then
            call note_add(lines, text // "smaller increments make it smooth")
         else
            call note_add(lines, text // "*CONTACT INITIATION, TYPE=MASSLESS makes it smooth " // &
               "on bodies at least two elements thick")
         end if
      end do
   end subroutine add_pairs

   !> "contact ... on ..." of pair `k`, or "contact ... with itself".
   pure subroutine pair_text(scene, k, text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k                   !! of the scene, from 1
      character(len=:), allocatable, intent(out) :: text

      associate (pair => scene%pair(k))
         text = "contact " // scene%surface(pair%slave)%name
         if (pair%slave == pair%master) then
            text = text // " with itself"
         else
            text = text // " on " // scene%surface(pair%master)%name
         end if
      end associate
   end subroutine pair_text

   !> What these pairs can do to need no guards.
   pure subroutine guard_advice(pair, advice)
      type(contact_pair_t), intent(in) :: pair(:)   !! (any) of the scene
      character(len=:), allocatable, intent(out) :: advice   !! a list, ends without a full stop
      logical :: is_nodes(size(pair)), is_one_sided, is_integrated

      is_nodes = pair%formulation == formulation_nts
      is_one_sided = any(pair%is_guarded .and. is_nodes)
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

end module emcon_verdict_lines
