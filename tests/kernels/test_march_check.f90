!> What a solved step is judged by: contacts that begin and end in it, and the error of its motion.
module test_march_check
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_select, step_done, step_passes_event, step_rough, &
      step_strikes
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraints, only : constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_init, march_t
   use emcon_march_accuracy, only : accuracy_begin, accuracy_judge, accuracy_keep
   use emcon_march_events, only : events_judge, events_look, events_tell
   use emcon_march_types, only : part_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : events_nodes, events_pairs, step_t
   use emcon_term, only : role_inertia
   use emcon_text, only : to_text
   use given_contact, only : open_given_contact
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks, shake
   implicit none
   private
   public :: collect_march_check

   real(wp), parameter :: tol = 256.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.1_wp, h_before = 0.2_wp

contains

   subroutine collect_march_check(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("contacts that begin or end", test_look), &
         test_case_t("when the first event is", test_first), &
         test_case_t("events of pairs and of nodes", test_events), &
         test_case_t("masses that errors show in", test_mass), &
         test_case_t("the error of a smooth step", test_smooth), &
         test_case_t("the error of a step with an impact", test_impact), &
         test_case_t("what the next step is compared with", test_keep)]
   end subroutine collect_march_check

   !> Two pairs and a guard, two contacts each: what acted and what acts.
   subroutine open(march, was, is)
      type(march_t), intent(inout) :: march
      logical, intent(in) :: was(6), is(6)

      call open_given_contact(march%system, march%active, march%motion, reshape(spread( &
         gap_state_t(is_near=.true., is_over=.true., size=1.0_wp), 1, 6), [2, 3]), 1)
      march%active%start%was_active = was
      march%active%is_active = is
      call active_set_select(march%active, march%system, march%motion)
   end subroutine open

   subroutine test_look(error)
      type(error_t), allocatable, intent(out) :: error
      logical, parameter :: was(6) = [.true., .false., .false., .true., .false., .true.]
      type(march_t) :: march
      logical :: is(6)
      integer :: k

      do k = 0, 6
         is = was
         if (k > 0) is(k) = .not. is(k)
         call open(march, was, is)
         call events_look(march)
         call check_true(error, march%step_check%changes_contact .eqv. (k > 0 .and. k < 5), &
            "contact " // to_text(k))
      end do
      ! What a layer has settled counts in its place.
      march%layer%is_settled = .true.
      march%layer%acts = was
      call events_look(march)
      call check_true(error, .not. march%step_check%changes_contact, "as the layer has it")
      march%layer%acts(4) = .false.
      call events_look(march)
      call check_true(error, march%step_check%changes_contact, "what it lets go")
   end subroutine test_look

   !> A gap closes after the part of the step that velocities at its start take; what does not by
   !> them, and what opens, in the middle.
   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap(8) = [0.1_wp, 0.1_wp, 0.1_wp, -0.1_wp, 0.1_wp, 0.3_wp, 0.1_wp, &
         0.1_wp]
      real(wp), parameter :: rate(8) = [-4.0_wp, -0.5_wp, 4.0_wp, -1.0_wp, -4.0_wp, -4.0_wp, &
         -4.0_wp, -4.0_wp]
      real(wp), parameter :: expected(8) = [0.25_wp, 0.5_wp, 0.5_wp, 0.0_wp, 0.25_wp, 0.5_wp, &
         0.0_wp, 0.0_wp]
      type(march_t) :: march
      type(step_t) :: step
      type(part_t) :: part
      logical :: was(6), is(6)
      integer :: k, status

      part%h = h
      step%time%events = events_nodes
      do k = 1, size(gap)
         was = [.false., .false., k == 5 .or. k == 6, .false., .false., .false.]
         is = [.false., .true., .false., .true., .false., .true.]
         if (k /= 1) is(4) = .false.
         call open(march, was, is)
         call set_rates(march, gap(k), rate(k))
         march%step_check%changes_contact = k /= 7
         march%step_check%event_at = 0.0_wp
         status = step_done
         call events_judge(march, step, part, merge(1.0_wp, 0.5_wp, k == 8)*h, status)
         call check_equal(error, status, merge(step_done, step_passes_event, k > 6), &
            "status " // to_text(k))
         call check_near(error, march%step_check%event_at, expected(k), tol, 1.0_wp, &
            "after " // to_text(k))
      end do
   end subroutine test_first

   !> Contact 2 approaches at `rate` in two nodes, 4 half as fast, and so does a guard at once.
   subroutine set_rates(march, gap, rate)
      type(march_t), intent(inout) :: march
      real(wp), intent(in) :: gap, rate
      integer :: k

      associate (set => march%active%set)
         do k = 1, set%n
            call condition_resize(set%item(k), 2)
            set%item(k)%node = [set%id(k), 1]
            set%item(k)%c = reshape([0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp], [2, 2])
            set%item(k)%gap0 = 0.0_wp            ! it holds the gap of the start
         end do
      end associate
      do k = 1, size(march%system%contact)
         associate (state => march%system%contact(k)%contact%state)
            state%closed = 0.125_wp
            state%gap0 = gap + state%closed
         end associate
      end do
      march%motion%v0 = 0.0_wp
      march%motion%v0(1, 1) = 0.25_wp*rate
      march%motion%v0(2, 2) = 0.75_wp*rate
      march%motion%v0(2, 4) = 0.25_wp*rate
      march%motion%v0(2, 6) = 100.0_wp*rate
   end subroutine set_rates

   !> Of a pair whose first and last contacts are no others nothing is told, of nodes all; guards
   !> never are.
   subroutine test_events(error)
      type(error_t), allocatable, intent(out) :: error
      logical, parameter :: was(6) = [.true., .false., .false., .true., .false., .false.]
      logical, parameter :: is(6) = [.false., .true., .false., .false., .true., .true.]
      type(march_t) :: march
      type(scene_t) :: scene
      type(step_t) :: step
      type(part_t) :: part
      type(increment_t) :: increment
      integer :: k, i

      part%h = 0.125_wp
      part%start%total_time = 2.0_wp
      scene%node%label = [(10*i, i = 1, 6)]
      do k = 1, 2
         step%time%events = merge(events_pairs, events_nodes, k == 1)
         call open(march, was, is)
         march%state%contacts%is_active = is
         march%state%control%n_event = 5
         increment = increment_t()
         call events_tell(march, scene, step, part, increment)
         call check_equal(error, increment%notes%n, merge(1, 3, k == 1), "events")
         call check_equal(error, march%state%control%n_event, merge(6, 8, k == 1), "counted")
         if (allocated(error)) return
         call check_equal(error, increment%notes%item(increment%notes%n)%text, &
            "event: contact ends in pair 2 at slave node 40, time 2 to 2.125", "the last one")
         if (k == 2) call check_equal(error, increment%notes%item(2)%text, &
            "event: contact begins in pair 1 at slave node 20, time 2 to 2.125", "the second one")
      end do
   end subroutine test_events

   !> Two blocks, the bottom of the lower one clamped; all that is judged is made by chance.
   subroutine begin(scene, march, error)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, 0.1_wp, lower, upper)
      call add_step(scene, .false., h, 10)
      call clamp(scene%step(1), [(i, i = 1, 5)])
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call accuracy_begin(march, scene)
      march%grid%h_deck = h
      march%grid%least_power = -1
      march%motion%evaluation = march%scheme%evaluation(march%motion%evaluation%load_instant, h)
      call constraints_select(march%active%set, [1])
      associate (item => march%active%set%item(1))
         call condition_resize(item, 1)
         item%node(1) = 11
         item%g = reshape([1.0_wp, 2.0_wp], [2, 1])
         march%active%set%lam(1) = 3.0_wp
      end associate
      associate (control => march%state%control)
         allocate(control%force, control%contact, control%velocity, control%rate, mold=scene%x)
         call shake(control%force, 1.0_wp)
         call shake(control%contact, 1.0_wp)
         call shake(control%velocity, 0.01_wp)
         call shake(control%rate, 1.0_wp)
         control%h_before = h_before
         control%span = 0.25_wp
         control%n_known = 2
         control%largest_kinetic = 0.125_wp
      end associate
      call shake(march%system%response%part(role_inertia)%force, 1.0_wp)
      call shake(march%motion%v0, 0.01_wp)
      call shake(march%motion%du, 0.01_wp*h)
      march%ledger%kinetic = 0.25_wp
   end subroutine begin

   !> Quarters of the elements around each node; what is held shows no error.
   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp) :: mass(16)

      call begin(scene, march, error)
      if (allocated(error)) return
      mass = 0.0_wp
      mass(6:) = [0.25_wp, 0.5_wp, 0.5_wp, 0.5_wp, 0.25_wp, 0.25_wp, 0.5_wp, 0.25_wp, 0.25_wp, &
         0.5_wp, 0.25_wp]
      call check_near(error, march%step_check%estimate%mass, spread(mass, 1, 2), tol, 1.0_wp, &
         "mass")
      call march_free(march)
   end subroutine test_mass

   !> sqrt(sum m (C h^2 a')^2/(2 T)), docs/theory.md, eqs. (26b) and (26c); a' by forces with or
   !> without those of contact, and by the motion if that is known.
   pure real(wp) function error_of(march, with_contact, kinetic)
      type(march_t), intent(in) :: march
      logical, intent(in) :: with_contact
      real(wp), intent(in) :: kinetic
      real(wp), dimension(2, 16) :: change, by_force, by_motion

      associate (control => march%state%control, mass => march%step_check%estimate%mass)
         change = march%system%response%part(role_inertia)%force - control%force
         change(:, 11) = change(:, 11) - 3.0_wp*[1.0_wp, 2.0_wp]
         if (with_contact) then
            change = change - control%contact
            change(:, 11) = change(:, 11) + 3.0_wp*[1.0_wp, 2.0_wp]
         end if
         by_motion = (march%motion%du/h - control%velocity)/(0.5_wp*(h + h_before))
         by_motion = 2.0_wp*(by_motion - control%rate)/(0.5_wp*(h + h_before) + control%span)
         if (control%n_known < 2) by_motion = huge(1.0_wp)
         by_force = 0.0_wp
         where (mass > 0.0_wp) by_force = change*2.0_wp/(h + h_before)/mass
         error_of = sqrt(sum(mass*(h**2/12.0_wp*min(abs(by_force), abs(by_motion)))**2) &
            /(2.0_wp*kinetic))
      end associate
   end function error_of

   subroutine test_smooth(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k

      do k = 1, 8
         block
            type(march_t) :: march
            type(part_t) :: part
            real(wp) :: kinetic, smooth, ratio
            integer :: status

            call begin(scene, march, error)
            if (allocated(error)) return
            kinetic = 0.25_wp
            associate (control => march%state%control)
               if (k == 2) control%n_known = 1
               if (k == 3) control%largest_kinetic = 0.5_wp
               if (k == 3) kinetic = 0.5_wp
               ! All move with 1 at the end: 6 of mass, where none is held.
               if (k == 4) then
                  march%motion%v0 = -1.0_wp
                  march%motion%du = 0.0_wp
                  kinetic = 6.0_wp
               end if
               smooth = error_of(march, .false., kinetic)
               ratio = merge(0.5_wp, 2.0_wp, k < 6)
               part%h = merge(0.6_wp, 1.0_wp, k == 8)*h
               part%may_cut = k /= 7
               if (k == 8) smooth = 0.0_wp
               if (k == 5) control%h_before = 0.0_wp
            end associate
            status = step_done
            call accuracy_judge(march, part, merge(smooth, 1.0e-9_wp, k < 8)/ratio, status)
            if (k == 5) ratio = -1.0_wp
            if (k < 8) call check_near(error, march%step_check%ratio, ratio, tol, 2.0_wp, &
               "ratio " // to_text(k))
            call check_equal(error, status, merge(step_rough, step_done, k == 6), "status " &
               // to_text(k))
            call check_near(error, march%step_check%estimate%push(:, 11), [3.0_wp, 6.0_wp], tol, &
               10.0_wp, "push")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_smooth

   !> Held against the way in the time in which the smooth motion turns, docs/theory.md, eq. (26d);
   !> a smooth error that is larger counts.
   subroutine test_impact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k

      do k = 1, 4
         block
            type(march_t) :: march
            type(part_t) :: part
            real(wp) :: smooth, struck, tolerance
            integer :: status

            call begin(scene, march, error)
            if (allocated(error)) return
            associate (contact => march%state%control%contact)
               contact = merge(0.0_wp, 100.0_wp, k == 4)*contact
            end associate
            march%state%control%n_known = 1
            smooth = error_of(march, .false., 0.25_wp)
            struck = error_of(march, .true., 0.25_wp)*sqrt(12.0_wp*smooth)
            march%step_check%changes_contact = k /= 3
            tolerance = max(smooth, merge(struck, 0.0_wp, k /= 3))*merge(0.8_wp, 1.25_wp, k == 1 &
               .and. struck > smooth)
            part%h = h
            part%may_cut = .true.
            status = step_done
            call accuracy_judge(march, part, tolerance, status)
            call check_near(error, march%step_check%ratio, max(smooth, merge(struck, 0.0_wp, &
               k /= 3))/tolerance, tol, 2.0_wp, "ratio " // to_text(k))
            call check_equal(error, status, merge(step_strikes, step_done, k == 1), "status " &
               // to_text(k))
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_impact

   subroutine test_keep(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(part_t) :: part
      real(wp) :: before(2, 16), rate(2, 16)
      integer :: k, status

      call begin(scene, march, error)
      if (allocated(error)) return
      part%h = h
      status = step_done
      associate (control => march%state%control, estimate => march%step_check%estimate)
         do k = 0, 2
            control%n_known = k
            control%h_before = h_before
            control%largest_kinetic = 0.0_wp
            march%ledger%kinetic = merge(7.0_wp, 0.25_wp, k == 1)
            before = control%rate
            call accuracy_judge(march, part, 1.0_wp, status)
            rate = (march%motion%du/h - control%velocity)/(0.5_wp*(h + h_before))
            call accuracy_keep(march, h)
            call check_near(error, control%rate, merge(before, rate, k == 0), tol, 1.0_wp, "rate")
            call check_near(error, control%velocity, march%motion%du/h, tol, 1.0_wp, "velocity")
            call check_near(error, control%force, march%system%response%part(role_inertia)%force &
               - estimate%push, tol, 10.0_wp, "forces")
            call check_near(error, control%contact, estimate%push, 0.0_wp, 1.0_wp, "of contact")
            call check_near(error, [control%span, control%h_before], [0.15_wp, h], tol, 1.0_wp, &
               "sizes")
            call check_equal(error, control%n_known, min(k + 1, 2), "known")
            call check_near(error, control%largest_kinetic, march%ledger%kinetic, tol, 1.0_wp, &
               "kinetic energy")
         end do
         ! What the motion is off by for inertia counts.
         march%motion%v0 = -1.0_wp
         march%motion%du = 0.5_wp*h
         march%motion%offset = -0.5_wp*h
         call accuracy_keep(march, h)
         call check_near(error, control%largest_kinetic, 6.0_wp, tol, 6.0_wp, "at the end")
      end associate
      call march_free(march)
   end subroutine test_keep

end module test_march_check
