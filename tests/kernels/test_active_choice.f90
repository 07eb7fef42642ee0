!> The next active set from gaps and multipliers that are given: each rule on both sides of its
!> bound, sets that come again, and what a step begins with.
module test_active_choice
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_begin, active_set_drop, active_set_let_go, &
      active_set_overclosure, active_set_pass, active_set_put_off, active_set_select, &
      active_set_t, active_set_update_gaps, step_cycling, step_done, step_stands_off, &
      step_too_far, touch_tol
   use emcon_active_set_update, only : active_set_advance, active_set_leave, active_set_narrow, &
      most_early
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_penalty_law, only : penalty_t
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
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
      character(len=6) :: step = "IM"            !! I: impacts, M: may be cut, H: holds, Y: cycled
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
      real(wp) :: given_back = 0.0_wp            !! < 0: by a penalty
   end type acting_t

contains

   subroutine collect_active_choice(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is open closes, or not", test_open), &
         test_case_t("what acts stays, or goes", test_acting), &
         test_case_t("a step that is solved again", test_stale), &
         test_case_t("one by one", test_one_by_one), &
         test_case_t("sets that come again", test_cycles), &
         test_case_t("a guard waits for the pairs", test_guard), &
         test_case_t("a set that is left early", test_leave), &
         test_case_t("of what follows from others the deepest stay", test_narrow), &
         test_case_t("a step begins", test_begin), &
         test_case_t("what is too far to be looked at", test_pass), &
         test_case_t("gaps to hold", test_select), &
         test_case_t("let go, put off, dropped", test_let_go), &
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
         open_t(gap1=0.05_wp, was="C", step="IMHY", closes=.true.), &
         open_t(gap1=0.15_wp, was="C", step="IMHY"), &
         open_t(gap1=0.05_wp, was="C", step="IMH"), &
         open_t(gap1=0.05_wp, step="IMHY"), &
         open_t(gap1=0.05_wp, was="C", step="IMY"), &
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
      integer :: status
      logical :: is_done

      call open_given_contact(system, active, motion, reshape([gap_state_t( &
         is_near=.not. has(row%gap, "F"), is_over=.not. has(row%gap, "E"), &
         is_arriving=has(row%gap, "A"), was_open=.not. has(row%gap, "B"), gap0=row%gap0, &
         gap1=row%gap1, size=edge, closed=row%closed)], [1, 1]), 0)
      contact => given_of(system, 1)
      contact%max_penetration_at_start = 0.1_wp
      contact%max_gap_on_entry = row%most_open
      contact%step%is_penalty = row%is_penalty
      contact%is_seen = .not. has(row%was, "U")
      active%left = [0.75_wp, 0.5_wp]
      active%overclosure = row%overclosure
      active%was_active = [has(row%was, "W")]
      active%is_candidate = has(row%was, "C")
      active%is_dropped = has(row%was, "D")
      active%has_impacts = has(row%step, "I")
      active%may_cut = has(row%step, "M")
      active%holds_gap = has(row%step, "H")
      active%has_cycled = has(row%step, "Y")
      call active_set_advance(active, system, motion, is_done, status)
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
         acting_t(is="KL", given_back=-0.1_wp), &
         acting_t(lam=-1.0_wp, given_back=-0.1_wp), &
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
      integer :: status
      logical :: is_done

      call open_given_contact(system, active, motion, reshape([gap_state_t(is_near=.true., &
         is_over=.true., is_leaving=has(row%is, "L"), gap0=row%gap0, gap1=row%gap1, size=edge)], &
         [1, 1]), 0)
      contact => given_of(system, 1)
      contact%is_seen = .not. has(row%is, "U")
      system%response%magnitude(:, 1) = [1.0_wp, 2.0_wp]
      system%response%rounding(:, 1) = [0.5_wp, 1.5_wp]
      active%was_active = [has(row%is, "W")]
      active%is_active = .true.
      active%has_impacts = has(row%step, "I")
      active%only_adds = has(row%step, "A")
      active%gap_tolerance = row%tolerance
      call active_set_select(active, system, motion)
      active%set%lam = row%lam
      active%set%is_kept = has(row%is, "K")
      if (.not. has(row%is, "K")) active%set%target = 0.0_wp
      if (row%given_back < 0.0_wp) allocate(active%set%law(1)%row, &
         source=penalty_t(before=row%given_back))
      call active_set_advance(active, system, motion, is_done, status)
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
      integer :: k, status
      logical :: is_done

      call open_given_contact(system, active, motion, reshape([gap_state_t(is_near=.true., &
         is_over=.true., gap0=0.1_wp, gap1=0.2_wp, size=edge)], [1, 1]), 0)
      active%was_active = [.true.]
      active%is_active = .true.
      do k = 1, 4
         call active_set_select(active, system, motion)
         active%set%lam = 1.0_wp
         call active_set_advance(active, system, motion, is_done, status)
         call check_true(error, is_done .eqv. k == 4, "done")
         call check_equal(error, status, merge(step_too_far, step_done, k == 4), "status")
         call check_equal(error, active%n_tried, merge(1, 0, k == 4), "sets tried")
      end do
      ! With a penalty what is left of the gap is held.
      active%n_stale = 0
      active%set%penalty%is_on = .true.
      active%set%penalty%left = 0.1_wp
      call active_set_advance(active, system, motion, is_done, status)
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
      active%was_active = spread(.false., 1, 4)
   end subroutine open_four

   !> What pulls most, then what is deepest by the edge; what leaves goes with it.
   subroutine test_one_by_one(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: status
      logical :: is_done

      call open_four(system, active, motion, [-0.1_wp, -0.2_wp, -0.3_wp, 0.1_wp], &
         [0.25_wp, 0.5_wp, 2.0_wp, 1.0_wp])
      active%one_by_one = .true.
      active%left(1) = 0.5_wp
      active%overclosure(1) = -0.1_wp
      call active_set_advance(active, system, motion, is_done, status)
      call check_true(error, all(active%is_active .eqv. [.false., .true., .false., .false.]), &
         "the deepest by the edge, of what is to be held")
      active%overclosure = 0.0_wp
      active%is_active = .false.
      call active_set_advance(active, system, motion, is_done, status)
      call check_equal(error, findloc(active%is_active, .true., 1), 1, "the first of two as deep")
      call check_equal(error, count(active%is_active), 1, "alone")
      active%is_active = [.false., .true., .true., .true.]
      contact => given_of(system, 1)
      contact%given%gap1 = [-0.4_wp, 0.3_wp, 0.3_wp, 0.3_wp]
      call active_set_select(active, system, motion)
      active%set%lam = [-1.0_wp, -2.0_wp, 1.0_wp]
      call active_set_advance(active, system, motion, is_done, status)
      call check_true(error, all(active%is_active .eqv. [.false., .true., .false., .true.]), &
         "what pulls most, before what closes")
      contact%given(4)%is_leaving = .true.
      call active_set_select(active, system, motion)
      active%set%lam = [-1.0_wp, 1.0_wp]
      call active_set_advance(active, system, motion, is_done, status)
      call check_true(error, .not. any(active%is_active), "and what leaves")
      call check_true(error, .not. is_done .and. status == step_done, "to be solved")
   end subroutine test_one_by_one

   !> Sets {1, 4}, {2, 4} and {1, 4} again, before them {3, 4} too, by the step that they are in.
   subroutine test_cycles(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: step(10) = [character(len=5) :: "M", "H", "HM", "HMY", "HY", &
         "HMYG", "HYG", "HMC", "HC", "HMP"]
      integer, parameter :: cuts(3) = [1, 6, 8], first(2) = [2, 3]
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      integer :: k, status
      logical :: is_done

      do k = 1, size(step)
         call open_four(system, active, motion, [-0.1_wp, 0.3_wp, 0.3_wp, 0.3_wp], &
            spread(edge, 1, 4))
         active%holds_gap = has(step(k), "H")
         active%may_cut = has(step(k), "M")
         active%has_cycled = has(step(k), "Y")
         active%closes(3) = has(step(k), "C")
         active%penalty%is_on = has(step(k), "P")
         if (has(step(k), "G")) system%n_pair = 0
         active%tried(:, 1) = [.false., .false., .true., .true.]
         active%tried(:, 2) = [.true., .false., .false., .true.]
         active%n_tried = 2
         active%is_active = [.false., .true., .false., .true.]
         call select_by_hand(active, 3)
         active%set%lam = [-1.0_wp, 1.0_wp]
         call active_set_advance(active, system, motion, is_done, status)
         call check_true(error, all(active%is_active .eqv. [.true., .true., .false., .true.]), &
            "the union " // step(k))
         call check_equal(error, status, merge(step_cycling, step_done, any(k == cuts)), &
            "status " // step(k))
         call check_true(error, is_done .eqv. any(k == cuts), "done " // step(k))
         call check_true(error, active%has_cycled .eqv. (any(k == first) .or. has(step(k), "Y")), &
            "candidates close below their gaps " // step(k))
         call check_true(error, active%only_adds .neqv. (any(k == cuts) .or. any(k == first)), &
            "nothing is let go " // step(k))
         call check_true(error, all(active%comes_and_goes .eqv. [.not. any(k == first), &
            .not. any(k == first), .false., .false.]), "what comes and goes " // step(k))
         call check_equal(error, active%n_tried, merge(3, 0, any(k == cuts)), "tried " // step(k))
      end do
      ! A set that is new is no cycle, and nothing ends one in which nothing is let go but a cut.
      active%n_tried = 0
      active%has_cycled = .false.
      active%only_adds = .true.
      active%may_cut = .false.
      active%is_active = [.false., .true., .false., .true.]
      call select_by_hand(active, 1)
      active%set%lam = [1.0_wp, 1.0_wp]
      call active_set_advance(active, system, motion, is_done, status)
      call check_true(error, .not. is_done .and. status == step_done, "a new set")
      active%tried(:, 1) = [.true., .true., .false., .true.]
      active%is_active = [.false., .true., .false., .true.]
      call active_set_advance(active, system, motion, is_done, status)
      call check_true(error, is_done .and. status == step_cycling, "one that is not")
   end subroutine test_cycles

   !> The contacts 2 and 4 as the set, tried as number `n`, with the gaps of the start to hold.
   subroutine select_by_hand(active, n)
      type(active_set_t), intent(inout) :: active
      integer, intent(in) :: n
      type(system_t), target :: system
      type(active_set_t) :: other
      type(motion_t) :: motion

      call open_four(system, other, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
      other%is_active = [.false., .true., .false., .true.]
      call active_set_select(other, system, motion)
      active%set = other%set
      active%set%is_kept = .true.
      active%n_tried = n
      active%tried(:, n) = other%is_active
   end subroutine select_by_hand

   !> A guard closes with a contact of its pair in one step: it waits; alone it does not.
   subroutine test_guard(error)
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t) :: given(1, 2)
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      integer :: k, status
      logical :: is_done

      given%is_near = .true.
      given%is_over = .true.
      given%gap1 = -0.1_wp
      given%size = edge
      do k = 1, 2
         given(1, 1)%is_near = k == 1
         call open_given_contact(system, active, motion, given, 1)
         active%was_active = [.false., .false.]
         call active_set_advance(active, system, motion, is_done, status)
         call check_true(error, all(active%is_active .eqv. [k == 1, k == 2]), "one of both")
      end do
   end subroutine test_guard

   !> A set that would change is left for the next one, which was not tried; one that stands stays.
   subroutine test_leave(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact

      call open_four(system, active, motion, [-0.1_wp, 0.3_wp, 0.3_wp, 0.3_wp], &
         spread(edge, 1, 4))
      active%n_tried = 4
      call active_set_leave(active, system, motion)
      call check_true(error, all(active%is_active .eqv. [.true., .false., .false., .false.]), &
         "next")
      call check_equal(error, [active%n_tried, active%n_early], [3, 1], "counts")
      call active_set_select(active, system, motion)
      active%set%lam = 1.0_wp
      contact => given_of(system, 1)
      contact%given(1)%gap1 = 0.3_wp
      call active_set_leave(active, system, motion)
      call check_equal(error, [active%n_tried, active%n_early], [3, most_early], "it stands")
      contact%given(2)%gap1 = -0.1_wp
      contact%is_seen(1) = .false.
      active%n_early = 0
      call active_set_leave(active, system, motion)
      call check_true(error, all(active%is_active .eqv. [.true., .false., .false., .false.]), &
         "what follows is nothing to go on with")
      call check_equal(error, active%n_early, most_early, "no more")
   end subroutine test_leave

   !> Contacts 1, 3 and 4 closed between bodies 1 and 2, contact 2 acted before.
   subroutine test_narrow(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      type(scene_t) :: scene
      integer :: i, k
      logical :: has_narrowed

      do k = 1, 5
         call open_four(system, active, motion, [-0.3_wp, -0.1_wp, -0.2_wp, -0.3_wp], &
            spread(edge, 1, 4))
         if (.not. allocated(scene%rigid)) then
            allocate(scene%rigid(2))
            scene%rigid(1)%node = [1, 2, 3, 4]
            scene%rigid(2)%node = [5]
            scene%node%label = [(i, i = 1, 6)]
         end if
         active%was_active(2) = .true.
         active%is_active = .true.
         call active_set_select(active, system, motion)
         do i = 1, 4
            active%set%item(i)%n_node = 2
            active%set%item(i)%node = [i, merge(6, 5, k == 2 .and. i == 3)]
         end do
         active%has_rigid = k /= 3
         active%one_by_one = k == 4
         call active_set_narrow(active, system, scene, [merge(2, 3, k == 5)], has_narrowed)
         call check_true(error, has_narrowed .eqv. k == 1, "narrowed " // to_text(k))
         call check_true(error, all(active%is_active .eqv. [.true., .true., k /= 1, .true.]), &
            "the deepest " // to_text(k))
         call check_true(error, active%one_by_one .eqv. (k == 1 .or. k == 4), "one by one")
         call check_equal(error, active%n_tried, merge(0, 1, k == 1), "sets tried")
      end do
   end subroutine test_narrow

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
         motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 2.0_wp)
         motion%evaluation%pushes_at_end = k == 3
         if (k == 2) motion%evaluation = evaluation_at_end
         call soil(active)
         call active_set_begin(active, system, motion, state)
         call check_true(error, all(active%is_active .eqv. [k < 4, k == 2, .false., k < 3]), &
            "acts " // to_text(k))
         call check_near(error, active%lam, state%contacts%lam, 0.0_wp, 1.0_wp, "multipliers")
         call check_true(error, all(active%was_active .eqv. state%contacts%is_active), "acted")
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
      active%n_tried = 7
      active%n_stale = 7
      active%n_early = 7
      active%penalty%n_augmentation = 7
      active%only_adds = .true.
      active%has_cycled = .true.
      active%one_by_one = .true.
      active%comes_and_goes = .true.
      active%is_dropped = .true.
      active%is_put_off = .true.
      active%is_let_go = .true.
      active%near_laws%is_on = .true.
      active%near_laws%is_near = active%is_let_go
   end subroutine soil

   pure logical function is_clean(active)
      type(active_set_t), intent(in) :: active

      is_clean = all([active%n_newton, active%n_tried, active%n_stale, active%n_early, &
         active%penalty%n_augmentation] == 0) .and. .not. any([active%only_adds, &
         active%has_cycled, active%one_by_one, active%comes_and_goes, active%is_dropped, &
         active%is_put_off, active%is_let_go, active%near_laws%is_near])
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

      do k = 1, 5
         call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
         contact => given_of(system, 1)
         contact%given%gap0 = [0.1_wp, -0.2_wp, -0.05_wp, -0.01_wp]
         contact%given%closed = [0.0_wp, 0.0_wp, 0.0_wp, -0.02_wp]
         active%is_active = [.true., .true., .true., .true.]
         active%lam = [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
         active%left(1) = 0.5_wp
         active%overclosure(3) = -0.2_wp
         active%holds_gap = k == 1
         active%closes = .true.
         active%closes(2) = .false.
         active%pushes_out = k == 3
         active%puts_off = k > 3
         active%only_adds = k == 5
         active%is_put_off(4) = .true.
         call active_set_select(active, system, motion)
         associate (set => active%set)
            call check_near(error, set%lam, active%lam, 0.0_wp, 1.0_wp, "multipliers")
            call check_true(error, all(set%is_kept .eqv. [.false., k /= 3, .false., .false.]), &
               "kept " // to_text(k))
            call check_near(error, set%target, [0.0_wp, merge(0.0_wp, -0.2_wp, k == 3), -0.1_wp, &
               -0.02_wp], 4.0_wp*eps, 1.0_wp, "to hold " // to_text(k))
            call check_true(error, all(set%is_firm .eqv. [k /= 4, k /= 4, k /= 4, .true.]), &
               "firm " // to_text(k))
         end associate
         call check_true(error, all(active%tried(:, 1)) .and. active%n_tried == 1, "remembered")
      end do
   end subroutine test_select

   !> Contact 1, 3 and 4 act; of those that pull 3 was let go before, and 4 gives back.
   subroutine test_let_go(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      logical :: is_done

      call open_four(system, active, motion, spread(0.3_wp, 1, 4), spread(edge, 1, 4))
      active%is_active = [.true., .false., .true., .true.]
      active%lam0 = [4.0_wp, 3.0_wp, 2.0_wp, 1.0_wp]
      active%before = motion%du + 1.0_wp
      call active_set_select(active, system, motion)
      active%set%lam = [-1.0_wp, -1.0_wp, -1.0_wp]
      active%is_let_go(3) = .true.
      allocate(active%set%law(3)%row, source=penalty_t(before=-0.1_wp))
      active%only_adds = .true.
      call active_set_let_go(active, motion%du, is_done)
      call check_true(error, is_done .and. count(active%is_active) == 3, "nothing any more")
      active%only_adds = .false.
      call active_set_let_go(active, motion%du, is_done)
      call check_true(error, .not. is_done .and. all(active%is_active .eqv. [.false., .false., &
         .true., .true.]), "the first one")
      call check_near(error, active%lam, active%lam0, 0.0_wp, 1.0_wp, "multipliers")
      call check_near(error, motion%du, active%before, 0.0_wp, 1.0_wp, "from where it started")
      call check_equal(error, active%n_tried, 0, "sets tried")
      call active_set_let_go(active, motion%du, is_done)
      call check_true(error, is_done, "each once")
      active%n_tried = 5
      call active_set_put_off(active, [2])
      call check_true(error, all(active%is_put_off .eqv. [.false., .false., .true., .false.]) &
         .and. .not. active%is_active(3) .and. active%n_tried == 0, "put off")
      active%has_rigid = .true.
      active%n_tried = 5
      call active_set_drop(active, [3])
      call check_true(error, active%one_by_one .and. .not. (active%is_active(4) .or. &
         any(active%is_dropped)) .and. active%n_tried == 0, "it may come back")
      active%is_active = .true.
      call active_set_drop(active, [3])
      call check_true(error, all(active%is_dropped .eqv. [.false., .false., .false., .true.]) &
         .and. all(active%is_active .neqv. active%is_dropped), "dropped")
      active%has_rigid = .false.
      active%one_by_one = .false.
      call active_set_drop(active, [1])
      call check_true(error, active%is_dropped(1) .and. .not. active%one_by_one, "no rigid body")
   end subroutine test_let_go

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
      call check_near(error, active%overclosure, [-0.1_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, &
         1.0_wp, "what is closed")
      call check_near(error, contact%reach, 0.0_wp, 0.0_wp, 1.0_wp, "a step begins")
      call active_set_overclosure(active, system, motion%x, motion%u0, .false.)
      call check_near(error, active%overclosure, spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, "none")
   end subroutine test_overclosure

end module test_active_choice
