!> The next active set of a host from gaps and multipliers that are given: each rule on both sides
!> of its bound, sets that come again; and what a step begins with.
module test_active_choice
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_begin, active_set_could_hold, active_set_is_empty, &
      active_set_mark, active_set_overclosure, active_set_pass, active_set_repeats, &
      active_set_select, active_set_slides, active_set_suit, active_set_t, active_set_take, &
      active_set_update_gaps, &
      candidates_clear, step_cycling, step_done, step_stands_off, step_too_far, touch_tol
   use emcon_contact, only : gap_state_t
   use emcon_contact_candidates, only : candidates_leave_out, candidates_look
   use emcon_coulomb_law, only : contact_slides, contact_sticks, coulomb_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving
   use emcon_host_set, only : host_set_advance, host_set_begin, host_set_drop, host_set_t, &
      host_set_try
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_overlap_query, only : overlap_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_state, only : contact_state_t, state_t
   use emcon_steps, only : step_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   use given_contact, only : given_contact_t, given_of, open_given_contact
   implicit none
   private
   public :: collect_active_choice

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Length of all edges.
   real(wp), parameter :: edge = 0.5_wp

   !> An open contact, the step that it is in, and what becomes of it.
   type :: open_t
      real(wp) :: gap0 = 0.1_wp, gap1 = -0.01_wp
      logical :: closes = .false.
      integer :: status = step_done
      character(len=3) :: gap = ""               !! F: far, E: past the end, A: arriving, B: behind
      character(len=6) :: was = ""               !! W: acted, C: candidate, D: dropped, U: unseen
      character(len=6) :: step = "IM"            !! I: impacts, M: may be cut, H: holds
      logical :: is_penalty = .false.
      real(wp) :: overclosure = 0.0_wp, closed = 0.0_wp
      real(wp) :: most_open = 1.0_wp             !! on entry
   end type open_t

   !> A contact that acts, and what becomes of it.
   type :: acting_t
      real(wp) :: lam = 1.0_wp, gap0 = 0.0_wp, gap1 = 0.0_wp
      logical :: stays = .true.
      integer :: status = step_done
      integer :: n_stale = 0
      character(len=6) :: is = "K"               !! K: kept, W: it acted, L: leaves, U: unseen
      character(len=6) :: step = "I"             !! I: impacts, A: only adds
      real(wp) :: tolerance = 0.0_wp
   end type acting_t

contains

   subroutine collect_active_choice(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is open closes, or not", test_open), &
         test_case_t("what acts stays, or goes", test_acting), &
         test_case_t("a step that is solved again", test_stale), &
         test_case_t("sets that come again", test_cycles), &
         test_case_t("a guard waits for the pairs", test_guard), &
         test_case_t("a step begins", test_begin), &
         test_case_t("what is too far to be looked at", test_pass), &
         test_case_t("gaps to hold", test_select), &
         test_case_t("contacts that are dropped", test_drop), &
         test_case_t("candidates as they are looked at", test_look), &
         test_case_t("what is asked of a set", test_asked), &
         test_case_t("what a step asks of contact", test_suit), &
         test_case_t("rows that follow from others wait", test_leave_out), &
         test_case_t("a candidate that does not act closes, or not", test_closes), &
         test_case_t("what closes sticks by how far it is closed", test_joins), &
         test_case_t("overclosure of a step", test_overclosure)]
   end subroutine collect_active_choice

   pure logical function has(text, letter)
      character(len=*), intent(in) :: text
      character(len=1), intent(in) :: letter

      has = index(text, letter) > 0
   end function has

   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(open_t), allocatable :: row(:)
      integer :: k

      row = [ &
         open_t(closes=.true.), &
         open_t(gap1=0.01_wp), &
         open_t(gap1=-32.0_wp*eps*edge), &
         open_t(gap1=-128.0_wp*eps*edge, closes=.true.), &
         open_t(gap1=-32.0_wp*eps*edge, closes=.true., is_penalty=.true.), &
         open_t(gap="F"), &
         open_t(gap="E"), &
         open_t(gap0=-0.06_wp), &
         open_t(gap0=-0.04_wp, closes=.true.), &
         open_t(gap0=-0.06_wp, was="W", closes=.true.), &
         ! Three quarters of an overclosure are left at the start, half of it at the end.
         open_t(gap0=-0.1_wp, gap1=-0.03_wp, overclosure=-0.08_wp), &
         open_t(gap0=-0.1_wp, gap1=-0.05_wp, overclosure=-0.08_wp, closes=.true.), &
         open_t(gap0=-0.12_wp, gap1=-0.05_wp, overclosure=-0.08_wp), &
         open_t(closed=-0.02_wp), &
         open_t(gap1=-0.03_wp, closed=-0.02_wp, closes=.true.), &
         open_t(gap0=-0.06_wp, gap1=-0.03_wp, closed=-0.02_wp, closes=.true.), &
         open_t(was="D", status=step_too_far), &
         open_t(was="D", step="I"), &
         open_t(was="D", gap1=0.01_wp), &
         open_t(was="D", gap1=-0.5_wp*touch_tol*edge), &
         open_t(was="D", gap0=-0.02_wp), &
         open_t(was="D", gap0=-0.02_wp, gap1=-0.03_wp, status=step_too_far), &
         open_t(was="D", overclosure=-0.08_wp), &
         open_t(gap="A", is_penalty=.true., closes=.true.), &
         open_t(gap="A", is_penalty=.true., gap1=0.01_wp), &
         open_t(gap="A", is_penalty=.true., gap1=-0.06_wp), &
         open_t(gap="A", gap1=-0.02_wp), &
         open_t(gap="A", gap1=-0.03_wp, status=step_too_far), &
         open_t(gap="A", gap1=-0.03_wp, step="I", closes=.true.), &
         open_t(gap="AB", gap1=-0.03_wp), &
         open_t(gap="A", step="M", closes=.true.), &
         open_t(gap1=0.05_wp, was="C", step="IMH"), &
         open_t(was="U", closes=.true., status=step_too_far), &
         open_t(most_open=0.05_wp, closes=.true., status=step_too_far), &
         open_t(most_open=0.05_wp, step="M", closes=.true.)]
      do k = 1, size(row)
         call look_at_open(error, row(k), "open " // to_text(k))
      end do
   end subroutine test_open

   subroutine look_at_open(error, row, what)
      type(error_t), allocatable, intent(inout) :: error
      type(open_t), intent(in) :: row
      character(len=*), intent(in) :: what
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      type(host_set_t) :: sets
      integer :: status
      logical :: is_done

      call host_set_begin(sets, 1)
      call open_given_contact(system, active, motion, reshape([gap_state_t( &
         is_near=.not. has(row%gap, "F"), is_over=.not. has(row%gap, "E"), &
         is_arriving=has(row%gap, "A"), was_open=.not. has(row%gap, "B"), gap0=row%gap0, &
         gap1=row%gap1, size=edge, closed=row%closed)], [1, 1]), 0)
      contact => given_of(system, 1)
      contact%max_penetration_at_start = 0.1_wp
      contact%max_gap_on_entry = row%most_open
      contact%step%is_penalty = row%is_penalty
      contact%is_seen = .not. has(row%was, "U")
      active%start%left = [0.75_wp, 0.5_wp]
      active%start%overclosure = row%overclosure
      active%start%was_active = [has(row%was, "W")]
      active%is_candidate = has(row%was, "C")
      active%is_left_out = has(row%was, "D")
      active%rules%has_impacts = has(row%step, "I")
      active%rules%may_cut = has(row%step, "M")
      active%rules%holds_gap = has(row%step, "H")
      call host_set_advance(sets, active, system, motion, is_done, status)
      call check_true(error, active%is_active(1) .eqv. row%closes, what // " closes")
      call check_equal(error, status, row%status, what // ", status")
      call check_true(error, is_done .eqv. (.not. row%closes .or. row%status /= step_done), &
         what // " is done")
      call check_true(error, active%is_candidate(1) .eqv. (row%closes .or. has(row%was, "C")), &
         what // ", candidate")
   end subroutine look_at_open

   !> Forces at its node are 3 and, by round-off, 2 more where no impact is.
   subroutine test_acting(error)
      type(error_t), allocatable, intent(out) :: error
      type(acting_t), allocatable :: row(:)
      integer :: k

      row = [ &
         acting_t(), &
         acting_t(lam=-1.0_wp, stays=.false.), &
         acting_t(lam=-2.0e3_wp*eps), &
         acting_t(lam=-4.0e3_wp*eps, stays=.false.), &
         acting_t(lam=-4.0e3_wp*eps, step=""), &
         acting_t(lam=-6.0e3_wp*eps, step="", stays=.false.), &
         acting_t(lam=-1.0_wp, step="IA"), &
         acting_t(is="KL", stays=.false.), &
         acting_t(is="KL", step="IA", stays=.false.), &
         acting_t(is="KU", status=step_too_far), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp, tolerance=0.1_wp, status=step_stands_off), &
         acting_t(gap0=0.04_wp, gap1=0.04_wp, tolerance=0.1_wp), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp, tolerance=0.1_wp, is="KW"), &
         acting_t(gap0=0.06_wp, tolerance=0.1_wp, is=""), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp + 0.5_wp*touch_tol*edge), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp + 2.0_wp*touch_tol*edge, n_stale=1), &
         acting_t(gap0=0.06_wp, gap1=0.06_wp - 2.0_wp*touch_tol*edge, n_stale=1), &
         acting_t(gap1=2.0_wp*touch_tol*edge, is="KL", stays=.false.), &
         acting_t(gap1=2.0_wp*touch_tol*edge, is="", n_stale=1)]
      do k = 1, size(row)
         call look_at_acting(error, row(k), "acting " // to_text(k))
      end do
   end subroutine test_acting

   subroutine look_at_acting(error, row, what)
      type(error_t), allocatable, intent(inout) :: error
      type(acting_t), intent(in) :: row
      character(len=*), intent(in) :: what
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      type(host_set_t) :: sets
      integer :: status
      logical :: is_done

      call host_set_begin(sets, 1)
      call open_given_contact(system, active, motion, reshape([gap_state_t(is_near=.true., &
         is_over=.true., is_leaving=has(row%is, "L"), gap0=row%gap0, gap1=row%gap1, size=edge)], &
         [1, 1]), 0)
      contact => given_of(system, 1)
      contact%is_seen = .not. has(row%is, "U")
      system%response%magnitude(:, 1) = [1.0_wp, 2.0_wp]
      system%response%rounding(:, 1) = [0.5_wp, 1.5_wp]
      active%start%was_active = [has(row%is, "W")]
      active%is_active = .true.
      active%rules%has_impacts = has(row%step, "I")
      sets%only_adds = has(row%step, "A")
      active%rules%gap_tolerance = row%tolerance
      call active_set_select(active, system, motion)
      active%set%lam = row%lam
      active%set%is_kept = has(row%is, "K")
      if (.not. has(row%is, "K")) active%set%target = 0.0_wp
      call host_set_advance(sets, active, system, motion, is_done, status)
      call check_true(error, active%is_active(1) .eqv. row%stays, what // " stays")
      call check_equal(error, status, row%status, what // ", status")
      call check_equal(error, active%n_stale, row%n_stale, what // ", solved again")
      call check_true(error, is_done .eqv. ((row%stays .and. row%n_stale == 0) .or. &
         row%status /= step_done), what // " is done")
   end subroutine look_at_acting

   !> Three times; the fourth is too far, whether the set changes or not.
   subroutine test_stale(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(host_set_t) :: sets
      integer :: k, status
      logical :: is_done

      call open_given_contact(system, active, motion, reshape([gap_state_t(is_near=.true., &
         is_over=.true., gap0=0.1_wp, gap1=0.2_wp, size=edge)], [1, 1]), 0)
      call host_set_begin(sets, 1)
      active%start%was_active = [.true.]
      active%is_active = .true.
      do k = 1, 4
         call host_set_try(sets, active)
         call active_set_select(active, system, motion)
         active%set%lam = 1.0_wp
         call host_set_advance(sets, active, system, motion, is_done, status)
         call check_true(error, is_done .eqv. k == 4, "done")
         call check_equal(error, status, merge(step_too_far, step_done, k == 4), "status")
         call check_equal(error, sets%n_tried, 0, "sets tried")
      end do
      ! With a penalty what is left of the gap is held.
      active%n_stale = 0
      active%set%penalty%is_on = .true.
      active%set%penalty%left = 0.1_wp
      call host_set_advance(sets, active, system, motion, is_done, status)
      call check_true(error, is_done .and. status == step_done, "as deep as it was pushed")
   end subroutine test_stale

   !> The gaps of four contacts by edges of several lengths.
   subroutine open_four(system, active, motion, gap1, size)
      type(system_t), intent(out) :: system
      type(active_set_t), intent(out) :: active
      type(motion_t), intent(out) :: motion
      real(wp), intent(in) :: gap1(4), size(4)
      type(gap_state_t) :: given(4, 1)

      given%is_near = .true.
      given%is_over = .true.
      given%gap0 = 0.3_wp
      given(:, 1)%gap1 = gap1
      given(:, 1)%size = size
      call open_given_contact(system, active, motion, given, 0)
      active%start%was_active = spread(.false., 1, 4)
   end subroutine open_four

   !> Sets {1, 4}, {2, 4} and {1, 4} again, before them {3, 4} too, by the step that they are in.
   subroutine test_cycles(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=2), parameter :: step(4) = ["M ", "H ", "HM", "  "]
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(host_set_t) :: sets
      integer :: k, status
      logical :: is_done

      do k = 1, size(step)
         call open_four(system, active, motion, [-0.1_wp, 0.3_wp, 0.3_wp, 0.3_wp], &
            spread(edge, 1, 4))
         active%rules%holds_gap = has(step(k), "H")
         active%rules%may_cut = has(step(k), "M")
         call host_set_begin(sets, 4)
         active%is_active = [.false., .false., .true., .true.]
         call host_set_try(sets, active)
         active%is_active = [.true., .false., .false., .true.]
         call host_set_try(sets, active)
         call select_two(active, system, motion)
         call host_set_try(sets, active)
         call host_set_advance(sets, active, system, motion, is_done, status)
         call check_true(error, all(active%is_active .eqv. [.true., k > 1, .false., .true.]), &
            "the union " // step(k))
         call check_equal(error, status, merge(step_cycling, step_done, k == 1), "status")
         call check_true(error, is_done .eqv. k == 1, "done " // step(k))
         call check_true(error, sets%only_adds .neqv. k == 1, "nothing is let go " // step(k))
         call check_equal(error, sets%n_tried, merge(3, 0, k == 1), "tried " // step(k))
      end do
      ! A set that is new is no cycle, and nothing ends one in which nothing is let go but a cut.
      call select_two(active, system, motion)
      active%set%lam = 1.0_wp
      call host_set_advance(sets, active, system, motion, is_done, status)
      call check_true(error, .not. is_done .and. status == step_done, "a new set")
      call host_set_try(sets, active)
      call select_two(active, system, motion)
      active%set%lam = 1.0_wp
      call host_set_advance(sets, active, system, motion, is_done, status)
      call check_true(error, is_done .and. status == step_cycling, "one that is not")
   end subroutine test_cycles

   !> Contacts 2, which pulls, and 4 as the set, with the gaps of the start to hold.
   subroutine select_two(active, system, motion)
      type(active_set_t), intent(inout) :: active
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion

      active%is_active = [.false., .true., .false., .true.]
      call active_set_select(active, system, motion)
      active%set%is_kept = .true.
      active%set%lam = [-1.0_wp, 1.0_wp]
   end subroutine select_two

   !> What is dropped does not act, and sets are tried anew.
   subroutine test_drop(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(host_set_t) :: sets

      call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
      call host_set_begin(sets, 4)
      active%is_active = [.true., .false., .true., .true.]
      call active_set_select(active, system, motion)
      call host_set_try(sets, active)
      call host_set_drop(sets, active, [3])
      call check_true(error, all(active%is_left_out .eqv. [.false., .false., .false., .true.]) &
         .and. all(active%is_active .eqv. [.true., .false., .true., .false.]), "dropped")
      call check_equal(error, sets%n_tried, 0, "sets tried")
   end subroutine test_drop

   !> Contacts 1 and 2 act, 3 has opened, 4 is no candidate: each alone is stale, or is not seen, or
   !> leaves, or closes. Who is blamed, takes part, acts next.
   subroutine test_look(error)
      type(error_t), allocatable, intent(out) :: error
      !> S: stale, U: unseen, L: leaves, C: closes; on contact number.
      character(len=2), parameter :: what(10) = ["  ", "S1", "S2", "U1", "U2", "L1", "L3", "C3", &
         "C4", "L4"]
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      logical :: is_it(4), part(4), acts(4)
      integer :: k, i, status

      do k = 1, size(what)
         call open_four(system, active, motion, [0.3_wp, 0.3_wp, 0.4_wp, 0.4_wp], &
            spread(edge, 1, 4))
         contact => given_of(system, 1)
         is_it = [(index(what(k)(2:), achar(iachar("0") + i)) > 0, i = 1, 4)]
         active%is_active = [.true., .true., .false., .false.]
         active%start%was_active = [.true., .true., .false., .false.]
         call candidates_clear(active%candidates)
         active%candidates%takes_part = [.true., .true., .true., .false.]
         active%candidates%acts = active%is_active
         call active_set_select(active, system, motion)
         active%set%lam = 1.0_wp
         if (has(what(k), "S")) where (is_it) contact%given%gap1 = 0.35_wp
         if (has(what(k), "C")) where (is_it) contact%given%gap1 = -0.1_wp
         if (has(what(k), "L")) contact%given%is_leaving = is_it
         if (has(what(k), "U")) contact%is_seen = .not. is_it
         ! What was found at another look counts no more.
         active%candidates%is_blamed = .true.
         active%candidates%have_changed = .true.
         active%candidates%one_closes = .true.
         active%is_stale = .true.
         call candidates_look(active, system, motion, status, .true.)
         part = [.true., .true., .true., what(k) == "C4"]
         acts = [.true., .true., what(k) == "C3", what(k) == "C4"]
         if (has(what(k), "L")) then
            part = part .and. .not. is_it
            acts = acts .and. .not. is_it
         end if
         associate (own => active%candidates)
            call check_equal(error, status, merge(step_too_far, step_done, has(what(k), "U")), &
               "status " // what(k))
            call check_true(error, all(own%takes_part .eqv. part), "takes part " // what(k))
            call check_true(error, all(own%acts .eqv. acts), "acts " // what(k))
            call check_true(error, all(own%is_blamed .eqv. (is_it .and. (has(what(k), "S") &
               .or. has(what(k), "U")))), "blamed " // what(k))
            call check_true(error, own%one_closes .eqv. what(k) == "C3", "closes " // what(k))
            call check_true(error, own%have_changed .eqv. any(what(k) == ["S1", "S2", "L1", "L3", &
               "C4"]), "has changed " // what(k))
            call check_true(error, active%is_stale .eqv. has(what(k), "S"), "stale " // what(k))
            call check_true(error, own%is_measured, "measured " // what(k))
            call check_true(error, all(own%has_left .eqv. (is_it .and. any(what(k) == ["L1", &
               "L3"]))), "has left " // what(k))
         end associate
      end do
   end subroutine test_look

   !> A row that always holds waits for the step, in all its rounds; one of a gap for a try, or for
   !> the step where nothing is free in it; rows of slips do not.
   subroutine test_leave_out(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      integer :: k
      logical :: goes_on

      do k = 1, 6
         call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
         active%is_active = .true.
         call candidates_clear(active%candidates)
         active%candidates%takes_part = .true.
         active%candidates%acts = .true.
         call active_set_select(active, system, motion)
         active%set%n_permanent = 1
         ! Nothing is free in the third row.
         active%set%force_rows%row_start = [1, 3, 5, 5, 7]
         if (k < 5) call candidates_leave_out(active, [k], goes_on)
         if (k == 5) call candidates_leave_out(active, [5], goes_on)
         if (k == 6) call candidates_leave_out(active, [5, 2], goes_on)
         call check_true(error, goes_on .eqv. k < 5, "goes on " // to_text(k))
         call check_true(error, all(active%is_active .neqv. [k == 1, k == 2 .or. k == 6, k == 3, &
            k == 4]), "acts " // to_text(k))
         call check_true(error, all(active%candidates%takes_part .neqv. [k == 1, .false., k == 3, &
            .false.]), "takes part " // to_text(k))
         call check_true(error, all(active%is_left_out .eqv. [k == 1, .false., k == 3, .false.]) &
            .and. all(active%candidates%acts .neqv. [.false., .false., k == 3, .false.]), &
            "left out " // to_text(k))
      end do
   end subroutine test_leave_out

   !> Below the gap to act at, with half of an overclosure left, or that of the start if it is
   !> lower.
   subroutine test_closes(error)
      type(error_t), allocatable, intent(out) :: error
      type(open_t), allocatable :: row(:)
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: k, status

      row = [ &
         open_t(closes=.true.), &
         open_t(gap1=0.01_wp), &
         open_t(gap1=-48.0_wp*eps*edge), &
         open_t(gap1=-96.0_wp*eps*edge, closes=.true.), &
         open_t(gap1=-96.0_wp*eps*edge, gap="F"), &
         open_t(gap1=-96.0_wp*eps*edge, gap="E"), &
         open_t(closed=-0.02_wp), &
         open_t(gap1=-0.03_wp, closed=-0.02_wp, closes=.true.), &
         open_t(gap1=-0.05_wp, closed=-0.02_wp, overclosure=-0.08_wp), &
         open_t(gap1=-0.07_wp, closed=-0.02_wp, overclosure=-0.08_wp, closes=.true.), &
         open_t(gap1=0.05_wp, step="H"), &
         open_t(closed=-0.02_wp, step="H"), &
         open_t(step="H", closes=.true.), &
         open_t(gap0=-0.05_wp, gap1=-0.03_wp, step="H"), &
         open_t(gap0=-0.05_wp, gap1=-0.06_wp, step="H", closes=.true.)]
      do k = 1, size(row)
         call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
         contact => given_of(system, 1)
         contact%given(3)%gap0 = row(k)%gap0
         contact%given(3)%gap1 = row(k)%gap1
         contact%given(3)%closed = row(k)%closed
         contact%given(3)%is_near = .not. has(row(k)%gap, "F")
         contact%given(3)%is_over = .not. has(row(k)%gap, "E")
         active%rules%holds_gap = has(row(k)%step, "H")
         active%start%left(1) = 0.5_wp
         active%start%overclosure(3) = row(k)%overclosure
         call candidates_clear(active%candidates)
         active%candidates%takes_part(3) = .true.
         call candidates_look(active, system, motion, status, .true.)
         call check_true(error, active%candidates%one_closes .eqv. row(k)%closes, "closes " &
            // to_text(k))
         call check_true(error, active%candidates%acts(3) .eqv. row(k)%closes, "acts " &
            // to_text(k))
      end do
   end subroutine test_closes

   !> A contact that closes by 0.1, from a gap of 0.3, and slips by less than half of the way below
   !> the gap that it will hold, or by more.
   subroutine test_joins(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slip(4) = [0.04_wp, 0.06_wp, 0.19_wp, 0.21_wp]
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: k, status

      do k = 1, size(slip)
         call open_given_contact(system, active, motion, reshape([gap_state_t(is_near=.true., &
            is_over=.true., gap0=0.3_wp, gap1=-0.1_wp, size=edge)], [1, 1]), 0, &
            coulomb_t(mu=0.5_wp))
         contact => given_of(system, 1)
         contact%slid = slip(k)
         motion%evaluation = evaluation_at_end
         active%rules%holds_gap = k > 2
         active%start%was_active = [.false.]
         call candidates_clear(active%candidates)
         call candidates_look(active, system, motion, status, .true.)
         call check_true(error, active%candidates%takes_part(1), "it closes")
         call check_equal(error, active%friction%law(1)%status%kind, merge(contact_sticks, &
            contact_slides, mod(k, 2) == 1), "slip " // to_text(slip(k)))
      end do
   end subroutine test_joins

   !> Impacts in dynamics; in statics what is closed too far is pushed out.
   subroutine test_suit(error)
      type(error_t), allocatable, intent(out) :: error
      type(active_set_t) :: active
      type(step_t) :: step
      integer :: k

      do k = 1, 2
         step%scheme = scheme_row(merge("STATIC ", "DYNAMIC", k == 1), "")
         step%contact%gap_tolerance = 0.25_wp
         call active_set_suit(active, step)
         call check_true(error, (active%rules%has_impacts .eqv. k == 2) .and. &
            (active%rules%pushes_out .eqv. k == 1), "impacts " // to_text(k))
         call check_near(error, active%rules%gap_tolerance, 0.25_wp, 0.0_wp, 1.0_wp, "stand-off")
      end do
   end subroutine test_suit

   !> Two contacts with friction, of a node each.
   subroutine test_asked(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(contact_state_t) :: contacts
      type(overlap_t) :: overlap
      logical :: is_marked(2), acts(2)
      integer :: k, i

      call open_given_contact(system, active, motion, reshape([(gap_state_t(), i = 1, 2)], [1, &
         2]), &
         0, coulomb_t(mu=0.5_wp))
      contacts%lam = [1.0_wp, 2.0_wp]
      contacts%closure = [-0.1_wp, -0.2_wp]
      allocate(contacts%stretch(2, 2), source=0.0_wp)
      do k = 0, 3
         acts = btest(k, [0, 1])
         active%is_active = acts
         do i = 1, 2
            active%friction%law%status%kind = contact_sticks
            call check_true(error, .not. active_set_slides(active), "all that acts sticks")
            active%friction%law(i)%status%kind = contact_slides
            call check_true(error, active_set_slides(active) .eqv. acts(i), "slides")
            ! What holds a node already could not do so by another choice.
            overlap%node = i
            overlap%facet(:2) = [7, 8]
            call check_true(error, active_set_could_hold(active, system, overlap) .neqv. acts(i), &
               "could hold")
            overlap%facet(:2) = [8, 3 - i]
            call check_true(error, active_set_could_hold(active, system, overlap) .neqv. &
               all(acts), "could hold one of both")
         end do
         contacts%is_active = [.true., .false.]
         is_marked = .false.
         call active_set_mark(active, system, contacts, is_marked)
         call check_true(error, all(is_marked .eqv. [.true., acts(2)]), "marked")
         active%candidates%acted = [.true., .false.]
         call check_true(error, active_set_repeats(active) .eqv. k == 1, "repeats")
         call check_true(error, active_set_is_empty(active) .eqv. k == 0, "empty")
         contacts%is_active = [.true., .true.]
         call active_set_take(active, system, contacts, acts)
         call check_true(error, all(active%is_active .eqv. acts) .and. all(active%is_candidate &
            .eqv. acts), "what is near is taken")
         call check_near(error, [active%lam, active%penalty%closure], [contacts%lam, &
            contacts%closure], 0.0_wp, 1.0_wp, "with its forces")
      end do
   end subroutine test_asked

   !> A guard closes with a contact of its pair in one step: it waits; alone it does not.
   subroutine test_guard(error)
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t) :: given(1, 2)
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(host_set_t) :: sets
      integer :: k, status
      logical :: is_done

      given%is_near = .true.
      given%is_over = .true.
      given%gap1 = -0.1_wp
      given%size = edge
      do k = 1, 2
         given(1, 1)%is_near = k == 1
         call open_given_contact(system, active, motion, given, 1)
         call host_set_begin(sets, 2)
         active%start%was_active = [.false., .false.]
         call host_set_advance(sets, active, system, motion, is_done, status)
         call check_true(error, all(active%is_active .eqv. [k == 1, k == 2]), "one of both")
      end do
   end subroutine test_guard

   !> From a state in which three of four contacts act: one has lost its surface, and leaves what it
   !> stores, if it does. Of the step before nothing else is left.
   subroutine test_begin(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(state_t) :: state
      class(given_contact_t), pointer :: contact
      integer :: k

      do k = 1, 4
         call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
         contact => given_of(system, 1)
         contact%given(2)%is_over = .false.
         contact%given(4)%is_leaving = .true.
         contact%may_leave = k == 3
         contact%step%is_sharp = .true.
         contact%reach = 3.0_wp
         active%penalty%is_on = k == 2
         active%penalty%is_at_ends = k == 4
         state%contacts%is_active = [.true., .true., .false., .true.]
         state%contacts%lam = [1.0_wp, 2.0_wp, 0.0_wp, 3.0_wp]
         state%contacts%closure = [0.1_wp, -0.1_wp, -0.1_wp, 0.0_wp]
         if (.not. allocated(state%contacts%stretch)) allocate(state%contacts%stretch(2, 4), &
            source=0.0_wp)
         motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 2.0_wp)
         motion%evaluation%pushes_at_end = k == 3
         if (k == 2) motion%evaluation = evaluation_at_end
         call soil(active)
         call active_set_begin(active, system, motion, state)
         call check_true(error, all(active%is_active .eqv. [k < 4, k == 2, .false., k < 3]), &
            "acts " // to_text(k))
         call check_near(error, active%lam, state%contacts%lam, 0.0_wp, 1.0_wp, "multipliers")
         call check_true(error, all(active%start%was_active .eqv. &
            state%contacts%is_active), "acted")
         call check_true(error, all(active%is_candidate .eqv. state%contacts%is_active), &
            "candidates")
         call check_true(error, .not. (contact%step%is_sharp .or. contact%reach > 0.0_wp), &
            "the contact begins anew")
         call check_true(error, contact%step%pushes_at_end .eqv. (k == 2 .or. k == 3), &
            "pushes at the end")
         call check_true(error, is_clean(active), "nothing is left")
      end do
   end subroutine test_begin

   subroutine soil(active)
      type(active_set_t), intent(inout) :: active

      active%n_newton = 7
      active%n_stale = 7
      active%penalty%n_augmentation = 7
      active%is_left_out = .true.
      active%near_laws%is_on = .true.
      active%near_laws%is_near = active%is_left_out
   end subroutine soil

   pure logical function is_clean(active)
      type(active_set_t), intent(in) :: active

      is_clean = all([active%n_newton, active%n_stale, active%penalty%n_augmentation] == 0) .and. &
         .not. any([active%is_left_out, active%near_laws%is_near])
   end function is_clean

   !> Surfaces 1 apart at a look as the nodes had gone 0.5: each of two sides may have closed by
   !> what they have gone since, 2 (0.7 - 0.5), and by the motion or the reach on top of that.
   subroutine test_pass(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact

      call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
      contact => given_of(system, 1)
      contact%clear = 1.0_wp
      contact%reach = 0.55_wp
      active%motion_bound%total = 0.5_wp
      call active_set_update_gaps(active, system, 1, motion)
      associate (skip => active%skip_until(1))
         call check_near(error, [skip%at, skip%apart, skip%reach], [0.5_wp, 1.0_wp, 0.55_wp], &
            0.0_wp, 1.0_wp, "as looked at")
         active%motion_bound%total = 0.7_wp
         call check_passes(.true., "neither")
         skip%reach = 0.65_wp
         call check_passes(.false., "the reach")
         skip%reach = 0.0_wp
         motion%du(:, 3) = [0.0_wp, 0.29_wp]
         call check_passes(.true., "a motion")
         motion%du(1, 3) = 0.1_wp
         call check_passes(.false., "a larger one")
         motion%du = 0.0_wp
         active%motion_bound%total = 1.01_wp
         call check_passes(.false., "since then")
         active%motion_bound%total = 0.5_wp
         contact%n_look = contact%n_look + 1
         call check_passes(.false., "another look")
         call active_set_update_gaps(active, system, 1, motion)
         call check_passes(.true., "at which it is clear")
         call check_equal(error, [contact%n_look, skip%n_look], [3, 3], "looks")
         contact%clear = 0.0_wp
         call active_set_update_gaps(active, system, 1, motion)
         skip%apart = 5.0_wp
         call check_passes(.false., "something is near")
      end associate

   contains

      subroutine check_passes(passes, what)
         logical, intent(in) :: passes
         character(len=*), intent(in) :: what

         call active_set_pass(active, system, motion)
         call check_true(error, active%skip_until(1)%passes .eqv. passes, what)
      end subroutine check_passes

   end subroutine test_pass

   !> Kept is the gap of the start; else the one to act at, with what is left of an overclosure.
   subroutine test_select(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: k

      do k = 1, 4
         call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
         contact => given_of(system, 1)
         contact%given%gap0 = [0.1_wp, -0.2_wp, -0.05_wp, -0.01_wp]
         contact%given%closed = [0.0_wp, 0.0_wp, 0.0_wp, -0.02_wp]
         active%is_active = [.true., .true., .true., .true.]
         active%lam = [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
         active%start%left(1) = 0.5_wp
         active%start%overclosure(3) = -0.2_wp
         active%rules%holds_gap = k == 1
         active%rules%closes = .true.
         active%rules%closes(2) = .false.
         active%rules%pushes_out = k == 3
         active%rules%puts_off = k > 3
         call active_set_select(active, system, motion)
         associate (set => active%set)
            call check_near(error, set%lam, active%lam, 0.0_wp, 1.0_wp, "multipliers")
            call check_true(error, all(set%is_kept .eqv. [.false., k /= 3, .false., .false.]), &
               "kept " // to_text(k))
            call check_near(error, set%target, [0.0_wp, merge(0.0_wp, -0.2_wp, k == 3), -0.1_wp, &
               -0.02_wp], 4.0_wp*eps, 1.0_wp, "to hold " // to_text(k))
            call check_true(error, all(set%is_firm .eqv. k /= 4), "firm " // to_text(k))
         end associate
      end do
   end subroutine test_select

   !> Only what is closed and over its surface, and only where a step resolves it.
   subroutine test_overclosure(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact

      call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
      contact => given_of(system, 1)
      contact%given%gap0 = [-0.1_wp, -0.2_wp, 0.3_wp, -0.4_wp]
      contact%given(2)%is_near = .false.
      contact%given(4)%is_over = .false.
      contact%reach = 1.0_wp
      call active_set_overclosure(active, system, motion%x, motion%u0, .true.)
      call check_near(error, active%start%overclosure, [-0.1_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, &
         1.0_wp, "what is closed")
      call check_near(error, contact%reach, 0.0_wp, 0.0_wp, 1.0_wp, "a step begins")
      call check_near(error, active%rules%largest_move, contact%mean_size(motion%x), 0.0_wp, &
         1.0_wp, "the largest move")
      active%rules%largest_move = 0.0_wp
      call active_set_overclosure(active, system, motion%x, motion%u0, .false.)
      call check_near(error, active%rules%largest_move, contact%mean_size(motion%x), 0.0_wp, &
         1.0_wp, "as large in any step")
      call check_near(error, active%start%overclosure, spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, "none")
   end subroutine test_overclosure

end module test_active_choice
