!> What follows from a solved step: velocities, works, forces, and what the user is told.
module emcon_march_commit
   use emcon_constraint, only : condition_friction, most_slips
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_dissipated, &
      constraints_force, constraints_friction
   use emcon_correction, only : correction_reason
   use emcon_contact_law, only : contact_laws_drag, loss_damping, loss_friction
   use emcon_errors, only : error_t
   use emcon_explicit, only : explicit_commit
   use emcon_friction, only : friction_exceeded, friction_missed
   use emcon_friction_limit, only : friction_limit_tell
   use emcon_contact_support, only : contact_support_t
   use emcon_factor_policy, only : factor_policy_commit
   use emcon_interlock_plane, only : interlock_tell
   use emcon_kinds, only : wp
   use emcon_march_guess, only : end_velocities, follow_links
   use emcon_march_jumps, only : march_jump
   use emcon_march_past, only : march_past_keep
   use emcon_march_types, only : increment_t, march_t
   use emcon_nodal_pull, only : nodal_pull_add
   use emcon_numbering, only : gather_dependent
   use emcon_pair_record, only : pair_record_jump, pair_record_measure
   use emcon_pair_sums, only : pair_sums_add, pair_sums_begin, pair_sums_jump
   use emcon_evaluation, only : evaluation_contact_place, evaluation_has_inertia
   use emcon_active_set, only : active_set_brought
   use emcon_rotation, only : add_moments
   use emcon_scene, only : scene_t
   use emcon_penalty, only : penalty_depth, penalty_keep, penalty_stored
   use emcon_stand_off, only : stand_off_add
   use emcon_system, only : system_t
   use emcon_term, only : role_external, role_inertia, role_internal
   use emcon_term_registry, only : terms_dissipation, terms_stabilization
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_tie_couple, only : tie_couple_add, tie_couple_of
   use emcon_rigid_rotation, only : rigid_rotation_measure
   implicit none
   private
   public :: march_commit

contains

   !> Take over the solved step: works, velocities, contact and reaction forces.
   subroutine march_commit(self, scene, h, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      logical :: is_due

      if (.not. increment%done > 0.0_wp) call pair_sums_begin(self%state%sums%sum)
      associate (state => self%state, system => self%system, set => self%active%set)
         system%response%residual = system%response%residual - self%newton%contact
         if (.not. all(scene%tie%is_adjusted)) call book_ties(self, scene, h)
         call gather_dependent(system%space%numbering, system%response%residual)
         call book_stabilization(self, increment)
         system%response%residual = merge(0.0_wp, system%response%residual, &
            system%space%numbering%unknown > 0)
         state%reaction = system%response%residual/(1.0_wp + self%motion%evaluation%start_weight)
         if (set%n_permanent > 0) call constraints_force(set, set%n_permanent + 1, &
            self%newton%contact)
         if (self%explicit%is_on) then
            self%end_state%v = self%explicit%v1
            call explicit_commit(self, h, error)
            if (allocated(error)) return
         else
            call end_velocities(system, self%motion, self%end_state%v)
            call book_work(self)
         end if
         call march_past_keep(self, h)
         call march_jump(self, scene, h, increment%notes, error)
         if (allocated(error)) return
         state%u = state%u + self%end_state%du
         if (size(scene%rigid) > 0) then
            call rigid_rotation_measure(state%turns, scene%rigid, self%motion, state%reaction)
            ! Else round-off adds up between the nodes of a rigid body.
            call follow_links(system, state%u)
         end if
         state%v = self%end_state%v
         state%contact = self%newton%contact
         if (size(state%friction) > 0) call constraints_friction(set, state%friction)
         call record_pairs(self, scene, h)
         state%internal = self%end_state%force
         state%energy = self%end_state%energy
         state%potential = self%end_state%potential
         if (self%newton%correction%fell_back .and. set%n > 0) call note_add(increment%notes, &
            trim(correction_reason(self%newton%correction)) // ": solved as a saddle point")
         call tell_gaps(self, h, increment)
         call friction_limit_tell(self, scene, increment, error)
         if (allocated(error)) return
         call interlock_tell(self, scene, increment)
         increment%is_guarded = increment%is_guarded .or. guards_act(system, set)
      end associate
      call tell_residual(self, increment)
      call keep_constraints(self)
      if (self%explicit%is_on .and. self%explicit%is_free) return
      call factor_policy_commit(self%newton%factor_policy, self%newton%correction, self%motion, &
         self%state%base, is_due)
      if (is_due) self%system%phases%n_factorisation = self%system%phases%n_factorisation + 1
   end subroutine march_commit

   !> What ties do to the angular momentum whose surfaces stay apart. Explicit steps have two
   !> pushes, one at each end.
   subroutine book_ties(self, scene, h)
      type(march_t), intent(inout) :: self       !! the residual is not yet gathered
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), dimension(size(scene%x, 1), size(scene%x, 2)) :: place, force, other
      real(wp) :: couple(size(self%ledger%angular))

      associate (motion => self%motion, numbering => self%system%space%numbering)
         place = scene%x + self%state%u + 0.5_wp*motion%du
         couple = tie_couple_of(numbering, place, self%system%response%residual) &
            /(1.0_wp + motion%evaluation%start_weight)
         if (self%explicit%is_on) couple = 0.5_wp*(couple + tie_couple_of(numbering, place, &
            self%explicit%residual))
         if (self%active%set%n_permanent > 0) then
            call constraints_force(self%active%set, 1, force)
            call constraints_force(self%active%set, self%active%set%n_permanent + 1, other)
            call add_couple(place, force - other, couple)
         end if
         call tie_couple_add(self%ledger%tie_couple, couple, &
            merge(h, 0.0_wp, evaluation_has_inertia(motion%evaluation)), self%ledger%angular)
      end associate
   end subroutine book_ties

   !> Add the moments of forces on nodes.
   pure subroutine add_couple(place, force, couple)
      real(wp), intent(in) :: place(:, :), force(:, :)   !! (n_dim, n_node) [L], [M L/T^2]
      real(wp), intent(inout) :: couple(:)               !! (turns) [M L^2/T^2]
      integer :: i

      do i = 1, size(place, 2)
         call add_moments(place(:, i), force(:, i), couple)
      end do
   end subroutine add_couple

   !> Does a guard hold something: a node, of corners or of the other side of a pair, or an edge?
   pure logical function guards_act(system, set)
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer :: k, pair, i

      guards_act = .false.
      do k = set%n_permanent + 1, set%n
         call constraint_index(system, set%id(k), pair, i)
         guards_act = guards_act .or. system%contact(pair)%contact%waits(i)
      end do
   end function guards_act

   !> The residuals that were reached, and whether more than Newton's tolerance was accepted.
   subroutine tell_residual(self, increment)
      type(march_t), intent(in) :: self
      type(increment_t), intent(inout) :: increment

      associate (reached => self%newton%convergence)
         increment%residual = reached%history(:reached%n_history)
         if (.not. reached%last > reached%tolerance .or. self%newton%is_idle) return
         increment%unconverged = max(increment%unconverged, reached%last)
         call note_add(increment%notes, "a relative residual of " // to_text(reached%last, 3) &
            // " is accepted as round-off")
      end associate
   end subroutine tell_residual

   !> What the pairs have transmitted; where contacts push at both ends of the step, half of it at
   !> each.
   subroutine record_pairs(self, scene, h)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp) :: lag

      associate (state => self%state, system => self%system, explicit => self%explicit)
         if (.not. self%active%penalty%is_at_ends) then
            lag = 1.0_wp - evaluation_contact_place(self%motion%evaluation)
            if (self%layer%is_settled) then
               ! Forces act where nodes without mass were before their balance.
               call pair_record_measure(state%pairs, system, self%active%set, scene%x, state%u &
                  + (self%motion%du - self%end_state%du), self%motion%du, lag)
            else
               call pair_record_measure(state%pairs, system, self%active%set, scene%x, state%u, &
                  self%motion%du, lag)
            end if
            call pair_sums_add(state%sums, system, self%active%set, self%motion, h)
            call record_jumps(self, scene, h)
            return
         end if
         call pair_sums_add(state%sums, system, explicit%penalty(explicit%i_start), self%motion, &
            0.5_wp*h)
         explicit%i_start = 1 - explicit%i_start
         associate (penalty => explicit%penalty(explicit%i_start))
            call pair_sums_add(state%sums, system, penalty, self%motion, 0.5_wp*h)
            call pair_record_measure(state%pairs, system, penalty, scene%x, state%u, &
               self%motion%du, 0.0_wp)
            self%ledger%contact_energy = penalty_stored(self%active%penalty, penalty)
         end associate
         call record_jumps(self, scene, h)
      end associate
   end subroutine record_pairs

   !> Add the impulses by which velocities jump at the end of the step.
   subroutine record_jumps(self, scene, h)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]

      if (size(self%end_state%jump) == 0 .and. .not. allocated(self%state%pairs%jump)) return
      call pair_sums_jump(self%state%sums, self%system, self%end_state%jump)
      call pair_record_jump(self%state%pairs, self%system, self%end_state%jump, &
         scene%x + self%state%u, h)
   end subroutine record_jumps

   !> What contacts stand off and give way by, how often they were pushed again, how they rub.
   pure subroutine tell_gaps(self, h, increment)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(increment_t), intent(inout) :: increment
      real(wp) :: missed, largest

      call stand_off_add(increment%stand_off, self%system, self%active%set, h)
      ! In space no multipliers are dual.
      if (size(self%state%u, 1) < 3) call nodal_pull_add(increment%nodal_pull, self%active%set, &
         size(self%state%u, 2))
      increment%give = max(increment%give, penalty_depth(self%active%penalty, self%active%set))
      if (self%active%penalty%is_at_ends) increment%give = max(increment%give, &
         penalty_depth(self%active%penalty, self%explicit%penalty(self%explicit%i_start)))
      increment%n_augmentation = max(increment%n_augmentation, self%active%penalty%n_augmentation)
      call friction_missed(self%active%friction, self%system, self%active%set, missed, largest)
      increment%law_missed = max(increment%law_missed, missed)
      increment%jump_missed = max(increment%jump_missed, friction_exceeded(self%active%friction, &
         self%active%set, h, self%end_state%jump))
      increment%largest_push = max(increment%largest_push, largest)
      increment%work_scale = hypot(increment%work_scale, work_scale(self))
   end subroutine tell_gaps

   !> The forces on nodes times the largest coordinate: works are rounded by a part of that, also
   !> where nothing moves [M L^2/T^2].
   pure real(wp) function work_scale(self)
      type(march_t), intent(in) :: self

      associate (motion => self%motion)
         work_scale = (norm2(self%system%response%part(role_external)%force) &
            + norm2(self%state%reaction) + norm2(self%newton%contact)) &
            *(maxval(abs(motion%x)) + maxval(abs(self%state%u)) + maxval(abs(motion%du)))
      end associate
   end function work_scale

   !> What acts at the end of the step, with which multipliers: those of the step, or of the balance
   !> of what has no mass.
   subroutine keep_constraints(self)
      type(march_t), intent(inout) :: self
      logical :: acts
      integer :: k

      associate (state => self%state, set => self%active%set, layer => self%layer, &
            penalty => self%explicit%penalty(self%explicit%i_start))
         call state%contacts%clear()
         call penalty_keep(self%active%penalty, set, state%contacts%closure, &
            state%contacts%stretch)
         if (self%active%penalty%is_at_ends) then
            do k = 1, size(penalty%id)
               call state%contacts%keep(penalty%id(k), penalty%lam(k), .true.)
            end do
            call penalty_keep(self%active%penalty, penalty, state%contacts%closure, &
               state%contacts%stretch)
         end if
         do k = 1, set%n
            acts = .true.
            ! What has opened stores nothing that a later step could give back.
            if (set%penalty%is_on .and. set%penalty%is_stored .and. k > set%n_permanent) acts = &
               set%law(k)%row%closure() < 0.0_wp
            call state%contacts%keep(set%id(k), set%lam(k), acts)
            if (size(state%contacts%drag) > 0) call keep_slip(self, k)
         end do
         if (.not. layer%is_settled) return
         state%contacts%is_active(layer%n_before + 1:) = layer%acts
         state%contacts%lam(layer%n_before + 1:) = layer%lam
      end associate
   end subroutine keep_constraints

   !> How condition `k` has slid.
   subroutine keep_slip(self, k)
      type(march_t), intent(inout) :: self       !! some contact rubs
      integer, intent(in) :: k                   !! place in the set, up to n
      real(wp) :: drag(most_slips), way(size(self%state%u, 1), size(self%state%u, 1) - 1)
      integer :: s
      logical :: is_spring

      is_spring = allocated(self%active%set%law(k)%row)
      if (is_spring) is_spring = self%active%set%law(k)%row%has_friction
      if (.not. (is_spring .or. self%active%friction%is_on)) return
      associate (contacts => self%state%contacts, item => self%active%set%item(k), &
            id => self%active%set%id(k), n => size(self%state%u, 1) - 1)
         if (is_spring) then
            drag = item%response%tau - contact_laws_drag(self%active%set%law(k))
            contacts%slides_along(:, id) = 0.0_wp
            if (constraints_dissipated(self%active%set, k, loss_friction) > 0.0_wp) then
               contacts%slides_along(:, id) = drag(:n)/max(norm2(drag), tiny(drag))
            end if
         else
            if (.not. self%active%friction%law(id)%mu > 0.0_wp) return
            contacts%slides_along(:, id) = self%active%friction%law(id)%status%direction(:n)
            drag = condition_friction(item, self%active%set%lam(k))
         end if
         contacts%drag(:, id) = drag(:n)
         contacts%slip(:, id) = contacts%slip(:, id) + item%slip(:n)
         contacts%slip_path(id) = contacts%slip_path(id) + norm2(item%slip)
         ! Where a motion of its slave side slips to.
         do s = 1, n
            way(:, s) = sum(item%t1(:, :item%n_slave, s), 2)
         end do
         contacts%slid(:, id) = matmul(way, contacts%slip(:, id))
      end associate
   end subroutine keep_slip

   !> Tell of what moves with nothing to hold it, and of what was brought into contact without load.
   !> The stiffness of STABILIZE is in the tangent of loose bodies alone: it bears what the balance
   !> leaves over there.
   subroutine book_stabilization(self, increment)
      type(march_t), intent(inout) :: self
      type(increment_t), intent(inout) :: increment
      real(wp) :: brought
      integer :: i, a

      associate (support => self%active%support, system => self%system, &
            body => self%system%space%body)
         if (.not. support%is_needed) return
         brought = active_set_brought(self%active)
         if (brought > 0.0_wp) call note_add(increment%warnings, support%brought_text // &
            "; no load does work on it: moved over a gap of " // to_text(brought, 3) &
            // " onto the surface nearest to it")
         if (.not. allocated(support%text)) return
         call tell_stabilized(self%active%support, increment)
         do i = 1, size(self%motion%du, 2)
            if (body(i) == 0) cycle
            if (.not. support%is_loose(body(i))) cycle
            do a = 1, size(self%motion%du, 1)
               if (system%space%numbering%unknown(a, i) == 0) cycle
               self%ledger%stabilization = self%ledger%stabilization &
                  - system%response%residual(a, i)*self%motion%du(a, i)
            end do
         end do
      end associate
   end subroutine book_stabilization

   !> Tell once in a step of a body that moves with nothing to hold it.
   subroutine tell_stabilized(support, increment)
      type(contact_support_t), intent(inout) :: support
      type(increment_t), intent(inout) :: increment
      integer :: n

      n = index(support%text, " free to ")
      if (allocated(support%told)) then
         if (support%told == support%text(:n)) return
      end if
      support%told = support%text(:n)
      call note_add(increment%warnings, support%text // "; no load does work on it: the " // &
         "smallest motion is taken, as STABILIZE says")
   end subroutine tell_stabilized

   !> Add the works of the step. With inertia the sums are exact for discrete gradients (see
   !> docs/theory.md, eq. (23)); in statics, and loads where contact pushes at the end, forces are
   !> taken as linear over the step.
   subroutine book_work(self)
      type(march_t), intent(inout) :: self
      real(wp) :: contact_work, decay, damped, damping, friction, energy, viscous
      integer :: k

      associate (state => self%state, part => self%system%response%part, &
            set => self%active%set, motion => self%motion)
         call terms_stabilization(self%system%term, viscous)
         contact_work = 0.0_wp
         friction = 0.0_wp
         damped = 0.0_wp
         do k = set%n_permanent + 1, set%n_condition
            friction = friction + constraints_dissipated(set, k, loss_friction)
            damped = damped + constraints_dissipated(set, k, loss_damping)
         end do
         if (motion%evaluation%pushes_at_end) then
            contact_work = sum((motion%evaluation%start_weight*state%contact &
               + self%newton%contact) *motion%du)/(1.0_wp + motion%evaluation%start_weight)
            self%ledger%external_work = self%ledger%external_work &
               + 0.5_wp*sum((state%history%load + part(role_external)%force)*motion%du) &
               + sum(state%reaction*motion%du) + sum(part(role_inertia)%force*motion%offset) &
               /(1.0_wp + motion%evaluation%start_weight)
         else if (evaluation_has_inertia(motion%evaluation)) then
            do k = 1, set%n
               contact_work = contact_work + set%lam(k)*set%item(k)%dgap
               if (allocated(set%law(k)%row)) contact_work = contact_work - set%law(k)%row%gained()
            end do
            self%ledger%external_work = self%ledger%external_work &
               + sum(part(role_external)%force*motion%du) + sum(state%reaction*motion%du) &
               + sum(part(role_inertia)%force*motion%offset)
         else
            contact_work = 0.5_wp*sum((state%contact + self%newton%contact)*motion%du)
            self%ledger%external_work = self%ledger%external_work - contact_work + viscous &
               + 0.5_wp*sum((state%internal + self%end_state%force)*motion%du)
            contact_work = contact_work + friction
         end if
         self%ledger%friction = self%ledger%friction + friction
         self%ledger%contact_damping = self%ledger%contact_damping + damped
         self%ledger%contact_work = self%ledger%contact_work + contact_work
         ! What penalties store is of the balance: contact work is what is made or taken beyond it.
         energy = penalty_stored(self%active%penalty, set)
         self%ledger%contact_work = self%ledger%contact_work &
            + (energy - self%ledger%contact_energy)
         self%ledger%contact_energy = energy
         call terms_dissipation(self%system%term, decay, damping)
         self%ledger%decay = self%ledger%decay + decay
         self%ledger%damping = self%ledger%damping + damping + viscous
      end associate
   end subroutine book_work

end module emcon_march_commit
