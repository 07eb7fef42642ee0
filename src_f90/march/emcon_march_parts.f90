!> One increment in one step, or in dyadic parts of it where a step fails.
module emcon_march_parts
   use emcon_active_set, only : active_set_goes_on, active_set_slides, step_cycling, &
      step_diverged, step_done, step_loose, step_not_held, step_overlaps, step_passes_event, &
      step_refused, step_rough, step_singular, step_stands_off, step_strikes, step_too_far, &
      step_unbalanced
   use emcon_constraints, only : constraint_index
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_evaluation, only : evaluation_has_inertia
   use emcon_kinds, only : wp
   use emcon_locking, only : strainless_element
   use emcon_march_begin, only : march_renumber
   use emcon_march_step, only : march_step, nodes_text
   use emcon_march_types, only : increment_t, march_t, part_t, rollback_t
   use emcon_mass_return, only : mass_find_troubled, mass_match, mass_may_return, mass_return
   use emcon_mechanism_text, only : free_motion_text
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_penalty, only : most_augmentations
   use emcon_system, only : system_may_hold, system_t
   use emcon_term_registry, only : terms_solid
   use emcon_text, only : joined, note_add, notes_append, notes_t, string_t, to_text
   implicit none
   private
   public :: march_in_parts, march_attempt, march_match, march_stop, march_reason

   !> Halvings of an increment after which nodes without mass take it back: what two shorter steps
   !> do not balance the next ones do not.
   integer, parameter :: return_level = 2
   !> Parts of an increment that are tried at most.
   integer, parameter :: most_parts = 4000
   !> Nodes named in a message.
   integer, parameter :: most_named = 10

   !> How an increment goes that is made in parts.
   type :: parts_t
      integer :: n = 0                           !! tried so far
      real(wp) :: h_least = 0.0_wp               !! size of the smallest [T]
      !> (n_constraint) what acted before the part, and what begins or ends in one of them
      logical, allocatable :: was_active(:), changes(:)
   end type parts_t

contains

   !> Go on by `increment%h` from the time `t0` since the start of the step. A part that fails is
   !> halved, `self%n_level` times at most; on an error the state is that of the last part that
   !> succeeded.
   subroutine march_in_parts(self, scene, t0, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: t0                     !! [T]
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(part_t) :: part
      type(parts_t) :: parts
      character(len=:), allocatable :: reason
      integer :: level, place, status

      self%grid%judges_size = .false.
      call march_match(self, scene, increment, error)
      if (allocated(error)) return
      level = 0
      place = 0
      do while (place < 2**self%grid%n_level)
         part%h = scale(increment%h, -level)
         part%start%step_time = t0 + scale(real(place, wp), -self%grid%n_level)*increment%h
         part%start%total_time = self%state%clock%start_time + part%start%step_time
         part%start%h_before = self%state%history%h_before
         part%may_cut = level < self%grid%n_level
         part%level = level
         call march_attempt(self, scene, part, increment, status, reason, error)
         if (allocated(error)) return
         call count_part(self, part, level > 0 .or. status /= step_done, parts)
         if (status == step_done) then
            place = place + 2**(self%grid%n_level - level)
            increment%done = scale(real(place, wp), -self%grid%n_level)*increment%h
            if (level > 0 .and. mod(place, 2**(self%grid%n_level - level + 1)) == 0) level &
               = level - 1
         else
            level = level + 1
         end if
         if (parts%n >= most_parts .and. place < 2**self%grid%n_level) then
            call stop_crawl(self, scene, increment, parts, error)
            return
         end if
         if (status == step_done) cycle
         if (level <= self%grid%n_level) cycle
         call march_stop(self, scene, part, "with h = " // to_text(part%h) // &
            ", the smallest allowed, " // reason, error)
         return
      end do
   end subroutine march_in_parts

   !> A part was tried: count it, and tell of it if there are several.
   subroutine count_part(self, part, is_cut, parts)
      type(march_t), intent(inout) :: self
      type(part_t), intent(in) :: part
      logical, intent(in) :: is_cut              !! it is a part, or to be cut into some
      type(parts_t), intent(inout) :: parts
      logical, allocatable :: acts(:)
      integer :: id

      parts%n = parts%n + 1
      if (.not. is_cut) return
      if (parts%n == 1 .or. part%h < parts%h_least) parts%h_least = part%h
      acts = self%state%contacts%status([(id, id = 1, self%system%n_constraint)]) > 0
      if (.not. allocated(parts%changes)) then
         parts%was_active = acts
         allocate(parts%changes(size(acts)), source=.false.)
      end if
      parts%changes = parts%changes .or. (parts%was_active .neqv. acts)
      parts%was_active = acts
      if (associated(self%watcher)) call self%watcher%tell(self%state%clock%increment + 1, &
         part%start%total_time, parts%n, parts%h_least)
   end subroutine count_part

   !> The analysis ends, as an increment takes too many parts.
   subroutine stop_crawl(self, scene, increment, parts, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(in) :: increment
      type(parts_t), intent(in) :: parts
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: nodes
      type(part_t) :: last

      last%start%total_time = self%state%clock%time + increment%done
      nodes = ""
      if (any(parts%changes)) then
         call nodes_text(self, scene, parts%changes, nodes)
         nodes = "; in them contact begins and ends at slave nodes " // nodes
      end if
      call march_stop(self, scene, last, "an increment of h = " // to_text(increment%h) // &
         " was tried in " // to_text(parts%n) // " parts, the smallest of h = " // &
         to_text(parts%h_least) // ", and " // to_text(100.0_wp*increment%done/increment%h, 3) // &
         " % of it is complete" // nodes // "; give smaller increments from here on", error)
   end subroutine stop_crawl

   !> One step. Where it fails because nodes without mass find no balance these take their mass back
   !> after some halvings, and it is tried again.
   subroutine march_attempt(self, scene, part, increment, status, reason, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      integer, intent(out) :: status                 !! `step_done`, or why a smaller one may do
      character(len=:), allocatable, intent(out) :: reason   !! of a failure
      type(error_t), allocatable, intent(out) :: error

      do
         call march_step(self, scene, part, increment, status, error)
         if (allocated(error) .or. status == step_done) return
         if (.not. allocated(self%before)) self%before = rollback_t(self%state, self%ledger)
         call march_reason(self, scene, status, reason)
         if (.not. may_return(self, status, part%level)) exit
         call return_mass(self, scene, status, reason, increment, error)
         if (allocated(error)) return
      end do
      if (is_hopeless(self, status)) then
         call march_stop(self, scene, part, reason, error)
         return
      end if
      call note_add(increment%notes, "increment cut at time " // &
         to_text(part%start%total_time, 9) // ", h = " // to_text(part%h) // ": " // reason)
      increment%n_cut = increment%n_cut + 1
   end subroutine march_attempt

   !> The analysis ends as `part` fails.
   subroutine march_stop(self, scene, part, why, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      character(len=*), intent(in) :: why            !! for the message
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason

      reason = why
      call failure_text(self, scene, reason)
      call raise(error, err_analysis, "the analysis stops at time " // &
         to_text(part%start%total_time, 9) // ": " // reason)
   end subroutine march_stop

   !> Begin an increment: tell what there is to tell, and let the model have the masses of the
   !> state, which may be one of before.
   subroutine march_match(self, scene, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      logical :: has_changed

      call notes_append(increment%warnings, self%warnings)
      self%warnings = notes_t()
      call mass_match(self, scene, has_changed, error)
      if (has_changed .and. .not. allocated(error)) call march_renumber(self, scene, error)
   end subroutine march_match

   !> May a step have failed as nodes without mass find no balance? Shorter ones were tried.
   pure logical function may_return(self, status, level)
      type(march_t), intent(in) :: self
      integer, intent(in) :: status, level

      may_return = any(mass_may_return(self)) .and. evaluation_has_inertia(self%motion%evaluation) &
         .and. any(status == [step_refused, step_diverged, &
         step_singular, step_cycling, step_too_far, step_unbalanced]) .and. &
         level >= min(return_level, self%grid%n_level)
   end function may_return

   !> Give the nodes that seem to be the reason their mass back.
   subroutine return_mass(self, scene, status, reason, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: status
      character(len=*), intent(in) :: reason
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: label(size(scene%x, 2))
      logical :: is_back(size(scene%x, 2))
      integer :: i, n

      call mass_find_troubled(self, scene, all(status /= [step_refused, step_too_far]), is_back)
      n = 0
      do i = 1, size(is_back)
         if (.not. is_back(i)) cycle
         n = n + 1
         label(n)%text = to_text(scene%node%label(i))
      end do
      call note_add(increment%notes, reason // ": contact nodes get their mass back: " // &
         joined(label(:n), ", ", most_named))
      call mass_return(self, scene, is_back, error)
      if (.not. allocated(error)) call march_renumber(self, scene, error)
   end subroutine return_mass

   !> Whether a smaller step fails for the same reason: nothing was solved yet, or a larger load
   !> could bring into contact what holds a body, not a smaller one, which friction may hold.
   pure logical function is_hopeless(self, status)
      type(march_t), intent(in) :: self
      integer, intent(in) :: status

      is_hopeless = status == step_not_held .and. (self%active%n_newton == 0 .or. &
         .not. (self%active%support%is_pushed .or. self%active%friction%is_on))
   end function is_hopeless

   !> A singular system; elements with few points keep motions without strain that neighbours on
   !> two sides would stop.
   pure subroutine singular_text(solid, scene, text)
      type(solid_t), intent(in) :: solid
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text
      integer :: e

      text = "the system is singular"
      e = strainless_element(solid)
      if (e == 0) return
      associate (name => scene%element%kinds(solid%kind(e))%name)
         text = text // "; elements of type " // trim(name) // ", as " &
            // to_text(solid%deck%label(e)) &
            // ", have zero-energy modes if there is a single one or a single row of them: " // &
            "use two rows"
         if (name(len_trim(name):len_trim(name)) == "R") text = text // ", or " &
            // name(:len_trim(name) - 1)
      end associate
   end subroutine singular_text

   !> Why a step failed.
   subroutine march_reason(self, scene, status, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: status              !! one of the `step_` codes
      character(len=:), allocatable, intent(out) :: text       !! for the message

      select case (status)
      case (step_refused)
         text = self%system%response%refusal
      case (step_diverged)
         associate (reached => self%newton%convergence)
            text = "Newton's method does not converge (relative residual " // &
               to_text(reached%history(max(1, reached%n_history))) // " after " // &
               to_text(reached%n_iteration) // " iterations)"
         end associate
      case (step_singular)
         call singular_text(terms_solid(self%system%term), scene, text)
      case (step_cycling)
         call cycling_text(self, scene, text)
      case (step_too_far)
         call too_far_text(self, scene, text)
      case (step_stands_off)
         text = "a contact would act across a gap larger than GAP TOLERANCE"
      case (step_not_held)
         text = "nothing resists a motion: " // self%active%support%text
         if (.not. self%active%support%is_pushed) text = text // "; no load does work on it"
         if (active_set_slides(self%active)) text = text // "; friction is at its limit"
         text = text // "; add *BOUNDARY conditions"
         if (active_set_slides(self%active)) text = text // ", or more *FRICTION"
         if (.not. self%active%support%is_pushed) text = text // &
            ", or take the smallest such motion by *CONTACT CONTROLS, STABILIZE"
      case (step_unbalanced)
         text = "nodes without mass have no equilibrium where contacts open or close"
      case (step_overlaps)
         text = "bodies would overlap where no contact acts"
      case (step_rough)
         text = "the error is " // to_text(self%step_check%ratio, 3) // " times TOLERANCE"
         if (.not. evaluation_has_inertia(self%motion%evaluation)) call snap_text(self, text)
      case (step_strikes)
         text = "contact begins or ends: the error is " // to_text(self%step_check%ratio, 3) // &
            " times TOLERANCE"
      case (step_loose)
         text = "gaps do not close to TOLERANCE of *CONSTRAINT METHOD in " // &
            to_text(most_augmentations) // " augmentations; give a larger FACTOR"
      case (step_passes_event)
         text = "contact begins or ends in it"
      case default
         text = "reason " // to_text(status)
      end select
   end subroutine march_reason

   !> Which contacts act, stick and slide is another one from try to try: at which nodes?
   subroutine cycling_text(self, scene, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable :: nodes
      integer :: least

      text = "the search for the contacts that act, stick and slide does not converge"
      associate (n_change => self%active%candidates%n_change)
         least = min(2, maxval(n_change))
         if (least > 0) then
            call nodes_text(self, scene, n_change >= least, nodes)
            text = text // ": its result changes from try to try at slave nodes " // nodes
         end if
      end associate
      if (.not. self%active%rules%may_cut) text = text // "; allow for smaller increments, or " // &
         "let contact give way by *CONSTRAINT METHOD, TYPE=PENALTY"
   end subroutine cycling_text

   !> A contact meets in the step what its stencil does not know, or begins deep: at which nodes? A
   !> rigid wall has no faces, and is no slave.
   subroutine too_far_text(self, scene, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable :: nodes, remedy
      logical :: is_wall

      is_wall = blames_walls(self, scene)
      text = "a contact begins too deep or slides too far for one increment"
      remedy = "give the other surface longer edges there"
      if (is_wall) remedy = "give the body longer edges there"
      if (active_set_goes_on(self%active)) then
         text = "the solutions of the increment touch other faces than those assumed for them"
         remedy = "let the smaller surface be the slave, or take another TYPE of *CONTACT PAIR"
         if (is_wall) then
            text = "the solutions of the increment touch other parts of the wall than those " &
               // "assumed for them"
            remedy = "round the corners of the wall, give the body smaller faces there, or take " &
               // "another TYPE of *CONTACT PAIR"
         end if
      end if
      if (.not. any(self%active%candidates%is_blamed)) return
      call nodes_text(self, scene, self%active%candidates%is_blamed, nodes)
      text = text // ": slave nodes " // nodes
      if (.not. self%active%rules%may_cut) text = text // "; allow for smaller increments, or " // &
         remedy
   end subroutine too_far_text

   !> Are all contacts that a step has failed for with rigid walls?
   pure logical function blames_walls(self, scene)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer :: id, pair, i

      associate (is_blamed => self%active%candidates%is_blamed)
         blames_walls = any(is_blamed)
         do id = 1, size(is_blamed)
            if (.not. is_blamed(id)) cycle
            call constraint_index(self%system, id, pair, i)
            if (pair > 0 .and. pair <= size(scene%pair)) then
               blames_walls = blames_walls .and. allocated( &
                  scene%surface(scene%pair(pair)%master)%wall)
            else
               blames_walls = .false.
            end if
         end do
      end associate
   end function blames_walls

   !> Why an increment with STABILIZE is to be smaller.
   pure subroutine snap_text(self, text)
      type(march_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text

      text = "it snaps through: the equilibrium that was found is not stable"
      if (self%step_check%ratio >= 0.0_wp) text = "it snaps through: the work of the " &
         // "increment differs by " // to_text(100.0_wp*self%step_check%ratio, 2) &
         // " % from the energy that the elements store"
   end subroutine snap_text

   !> Add to the reason why the last step failed, which ends a static analysis, what contact and
   !> what the model is given would have to hold.
   subroutine failure_text(self, scene, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: motion, holders

      if (.not. (evaluation_has_inertia(self%motion%evaluation) &
         .or. allocated(self%active%support%text))) then
         call free_motion_text(self%system, scene, &
            scene%step(self%state%clock%i_step)%prescribed, motion, with_contact=.true., &
            u=self%state%u)
         if (len(motion) > 0) then
            call holders_text(self%system, size(scene%x, 2), holders)
            text = text // "; without " // holders // " " // motion
            if (active_set_slides(self%active)) text = text // &
               "; friction is at its limit at contacts that slide"
            if (size(self%system%contact) > 0) text = text // "; if contact does not hold it " // &
               "there, as it tips or slides off, add *BOUNDARY conditions or go on with *DYNAMIC"
            if (size(self%system%contact) == 0) text = text // "; add *BOUNDARY conditions"
         end if
      end if
      if (evaluation_has_inertia(self%motion%evaluation) &
         .or. .not. sum(self%state%energy) > 0.0_wp) return
      if (scene%step(self%state%clock%i_step)%stabilization > 0.0_wp) return
      text = text // "; no equilibrium was found beyond this time: a body may snap through or " &
         // "slip off there; *STATIC, STABILIZE goes on to the next equilibrium, a *DYNAMIC step " &
         // "follows the motion"
   end subroutine failure_text

   !> What may hold bodies beside the conditions of the deck: "contact and given forces".
   subroutine holders_text(system, n_node, text)
      type(system_t), intent(in) :: system
      integer, intent(in) :: n_node
      character(len=:), allocatable, intent(out) :: text
      logical :: by_forces(n_node), by_constraints(n_node)

      call system_may_hold(system, by_forces, by_constraints)
      text = ""
      if (size(system%contact) > 0) call add("contact")
      if (any(by_forces)) call add("given forces")
      if (any(by_constraints)) call add("given constraints")

   contains

      subroutine add(holder)
         character(len=*), intent(in) :: holder

         if (len(text) > 0) text = text // " and "
         text = text // holder
      end subroutine add

   end subroutine holders_text

end module emcon_march_parts
