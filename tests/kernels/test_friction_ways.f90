!> In which way each contact of a set rubs: how a step begins, what closes, what is missed.
module test_friction_ways
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_select, active_set_t
   use emcon_contact, only : gap_state_t
   use emcon_coulomb_law, only : contact_free, contact_slides, contact_sticks, coulomb_t, &
      slip_rounding, slip_status_t
   use emcon_convergence, only : round_off
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving
   use emcon_friction, only : friction_begin, friction_close, friction_holds, friction_keep, &
      friction_missed, friction_turn
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   use given_contact, only : given_contact_t, given_of, open_given_contact
   implicit none
   private
   public :: collect_friction_ways

   real(wp), parameter :: tol = 128.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: mu = 0.25_wp
   integer, parameter :: n = 4

contains

   subroutine collect_friction_ways(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a step begins", test_begin), &
         test_case_t("rows of what sticks", test_select), &
         test_case_t("what closes", test_close), &
         test_case_t("what acts goes on, or turns", test_turn), &
         test_case_t("what a held node is missed by", test_held), &
         test_case_t("what is missed", test_missed)]
   end subroutine collect_friction_ways

   !> Four contacts that rub, the fourth without; the matrix has 3 and 5 at each node, and the
   !> second node is held.
   subroutine open(system, active, motion)
      type(system_t), intent(out) :: system
      type(active_set_t), intent(out) :: active
      type(motion_t), intent(out) :: motion
      integer :: i

      call open_given_contact(system, active, motion, reshape(spread(gap_state_t(is_near=.true., &
         is_over=.true., size=1.0_wp), 1, n), [n, 1]), 0, coulomb_t(mu=mu, restitution=0.5_wp))
      active%friction%law(4)%mu = 0.0_wp
      active%friction%mu = active%friction%law%mu
      active%start%was_active = spread(.false., 1, n)
      motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 2.0_wp)
      associate (numbering => system%space%numbering)
         numbering%unknown = reshape([1, 2, 0, 0, 3, 4, 5, 6], [2, n])
         numbering%start = [0, 1, 2, 3, 4, 5, 6, 7, 9]
         numbering%column = [1, 2, 0, 0, 3, 4, 5, 6, 1]
         numbering%weight = [(1.0_wp, i = 1, 8), 0.5_wp]
      end associate
      system%matrix%n_row = 6
      system%matrix%n_col = 6
      system%matrix%row_start = [(i, i = 0, 6)]
      system%matrix%column = [(i, i = 0, 5)]
      system%matrix%value = [3.0_dp, -5.0_dp, 3.0_dp, 5.0_dp, 2.0_dp, 4.0_dp]
   end subroutine open

   !> Let the contacts `is_active` be the set, each of its node and node 4.
   subroutine select(system, active, motion, is_active)
      type(system_t), intent(inout) :: system
      type(active_set_t), intent(inout) :: active
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: is_active(n)
      integer :: k

      active%is_active = is_active
      call active_set_select(active, system, motion)
      do k = 1, active%set%n
         associate (item => active%set%item(k))
            item%n_node = 2
            item%node = [active%set%id(k), 4]
            item%size = 1.0_wp
            allocate(item%g(2, 2), item%t(2, 2, 1), source=0.0_wp)
            item%g(2, :) = [1.0_wp, -1.0_wp]
         end associate
      end do
   end subroutine select

   !> Slides go on, what acted is led to a part of its slip if that is more than round-off, and if
   !> there is inertia.
   subroutine test_begin(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: k, i

      do k = 1, 2
         call open(system, active, motion)
         contact => given_of(system, 1)
         contact%slid = [0.2_wp, -0.4_wp, 0.4_wp, 0.4_wp]
         if (k == 2) motion%evaluation = evaluation_at_end
         associate (friction => active%friction)
            friction%direction0(1, :) = [1.0_wp, -1.0_wp, 0.0_wp, 0.0_wp]
            friction%tau0(1, :) = [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
            friction%n_lagged = 3
            friction%law(3)%slip_target = 7.0_wp
            friction%law(3)%status%kind = contact_free
            call friction_begin(friction, system, motion, [.true., .true., .false., .true.])
            call check_equal(error, friction%law%status%kind, [contact_slides, contact_slides, &
               contact_sticks, contact_sticks], "ways")
            call check_near(error, [(friction%law(i)%status%direction(1), i = 1, 4)], &
               [1.0_wp, -1.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "directions")
            call check_near(error, [(friction%law(i)%slip_target(1), i = 1, 4)], &
               merge(0.0_wp, 1.0_wp, k == 2)*[0.1_wp, -0.2_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, &
               "led to")
            call check_near(error, friction%tau, friction%tau0, 0.0_wp, 1.0_wp, "friction")
            call check_equal(error, friction%n_lagged, 0, "count")
            contact%slid(1) = 1.9_wp*slip_rounding
            call friction_begin(friction, system, motion, [.true., .false., .false., .false.])
            call check_near(error, friction%law(1)%slip_target(1), 0.0_wp, 0.0_wp, 1.0_wp, &
               "round-off leads nowhere")
         end associate
      end do
   end subroutine test_begin

   !> Of contacts 1, 2, 3 and 4 the first slides, the fourth has no friction.
   subroutine test_select(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion

      call open(system, active, motion)
      associate (friction => active%friction, set => active%set)
         friction%law(1)%status = slip_status_t(contact_slides, [1.0_wp, 0.0_wp])
         friction%law(2)%slip_target(1) = 0.3_wp
         friction%tau(1, :) = [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]
         call select(system, active, motion, spread(.true., 1, n))
         call check_true(error, all(set%item%has_friction .eqv. [.true., .true., .true., &
            .false.]), "what rubs")
         call check_equal(error, [set%n_row, set%condition(5:6), set%slip(5:6)], &
            [6, 2, 3, 1, 1], "rows of slips")
         call check_near(error, [set%lam(5), set%item(2)%response%stick(1)], [2.0_wp, 2.0_wp], &
            0.0_wp, 1.0_wp, "begins with")
         call check_near(error, set%item(2)%slip_target(1), 0.3_wp, 0.0_wp, 1.0_wp, "and holds")
         call check_true(error, .not. any(set%is_firm(5:6)), "unless others do")
         call check_true(error, all([allocated(set%law(1)%beside), allocated(set%law(3)%beside)]) &
            .and. .not. allocated(set%law(4)%beside), "laws")
         call check_true(error, all(friction_holds(friction) .eqv. [.false., .true., .true., &
            .false.]), "what may hold")
         set%lam(5) = -7.0_wp
         call friction_keep(friction, set)
         call check_near(error, friction%tau(1, :), [1.0_wp, -7.0_wp, 3.0_wp, 4.0_wp], 0.0_wp, &
            1.0_wp, "kept")
      end associate
   end subroutine test_select

   !> A push of 0.4 by the gap bears friction of 0.1 by the slip.
   subroutine test_close(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slid(6) = [0.09_wp, 0.11_wp, -0.11_wp, 0.11_wp, 0.11_wp, 0.21_wp]
      real(wp), parameter :: gap(6) = [-0.4_wp, -0.4_wp, -0.4_wp, -0.4_wp, 0.0_wp, -0.4_wp]
      real(wp), parameter :: direction(6) = [0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]
      type(system_t), target :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      class(given_contact_t), pointer :: contact
      integer :: k

      do k = 1, size(slid)
         call open(system, active, motion)
         contact => given_of(system, 1)
         contact%slid = slid(k)
         if (k /= 4) motion%evaluation = evaluation_at_end
         associate (friction => active%friction)
            friction%law(3)%slip_target(1) = merge(0.12_wp, 0.0_wp, k == 6)
            friction%law(4)%status%kind = contact_free
            call friction_close(friction, system, 1, 3, motion, gap(k), .true.)
            call check_near(error, friction%law(3)%status%direction(1), direction(k), tol, 1.0_wp, &
               "direction " // to_text(k))
            call check_equal(error, friction%law(3)%status%kind, merge(contact_slides, &
               contact_sticks, abs(direction(k)) > 0.0_wp), "way " // to_text(k))
            call check_near(error, friction%law(3)%slip_target(1), merge(0.055_wp, merge(0.12_wp, &
               0.0_wp, k == 6), k == 4), tol, 1.0_wp, "led to " // to_text(k))
            call friction_close(friction, system, 1, 4, motion, gap(k), .true.)
            call check_equal(error, friction%law(4)%status%kind, contact_free, "without friction")
            motion%evaluation = evaluation_moving(1.0_wp, 0.5_wp, 2.0_wp)
            friction%law(3)%slip_target = 0.0_wp
            call friction_close(friction, system, 1, 3, motion, gap(k), .false.)
            call check_near(error, friction%law(3)%slip_target(1), 0.0_wp, 0.0_wp, 1.0_wp, &
               "a candidate is led where it was")
         end associate
      end do
   end subroutine test_close

   !> A push of 2 bears friction of 1/2. Rows hold the slip, whatever it is rounded to: what they
   !> take more than that it slides by, against it. What nothing pushes goes on as it was.
   subroutine test_turn(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: stick(6) = [0.4_wp, -0.4_wp, 0.6_wp, -0.6_wp, 0.0_wp, 0.6_wp], &
         lam(6) = [2.0_wp, 2.0_wp, 2.0_wp, 2.0_wp, 0.0_wp, 2.0_wp]
      real(wp), parameter :: direction(6) = [0.0_wp, 0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, 0.0_wp]
      logical, parameter :: turned(6) = [.false., .false., .true., .true., .false., .false.]
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      logical :: turns
      integer :: k, side

      do k = 1, size(stick)
         do side = -1, 1, 2
            call open(system, active, motion)
            call select(system, active, motion, [.true., .false., .false., .false.])
            associate (law => active%friction%law(1), item => active%set%item(1))
               law%status = slip_status_t(kind=contact_sticks)
               law%slip_target(1) = 0.5_wp*(-1)**(k - 1)
               if (k == 6) law%mu = 0.0_wp
               item%has_friction = .true.
               item%slip(1) = law%slip_target(1) + 0.125_wp*side
               item%response%stick(1) = stick(k)
               active%set%lam(1) = lam(k)
               turns = .false.
               call friction_turn(active%friction, system, active%set, 1, turns)
               call check_true(error, turns .eqv. turned(k), "turns " // to_text(k))
               call check_equal(error, law%status%kind, merge(contact_slides, contact_sticks, &
                  turned(k)), "kind " // to_text(k))
               call check_near(error, law%status%direction(1), direction(k), tol, 1.0_wp, &
                  "direction " // to_text(k))
               turns = .true.
               call friction_turn(active%friction, system, active%set, 1, turns)
               call check_true(error, turns, "what others do is left")
            end associate
         end do
      end do
   end subroutine test_turn

   !> At a node that is held by the stiffness of the next one: (2 + 4)/2, without what follows by a
   !> half.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      real(wp) :: missed, largest

      call open(system, active, motion)
      call select(system, active, motion, [.false., .true., .false., .false.])
      active%set%lam(1) = 1.0_wp
      active%set%item(1)%slip = 0.0_wp
      active%set%defect(1) = 0.25_wp
      call friction_missed(active%friction, system, active%set, missed, largest)
      call check_near(error, missed, 0.75_wp, tol, 1.0_wp, "by the stiffness of the next node")
   end subroutine test_held

   !> The gap by the stiffness, or friction by what it is off; the largest of all.
   subroutine test_missed(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(active_set_t) :: active
      type(motion_t) :: motion
      real(wp) :: missed, largest

      call open(system, active, motion)
      associate (friction => active%friction, set => active%set)
         call select(system, active, motion, [.true., .false., .true., .true.])
         set%lam(:3) = [2.0_wp, -3.0_wp, 4.0_wp]
         set%lam(2) = 3.0_wp
         set%item%n_slave = 1
         set%defect = 0.0_wp
         set%defect(3) = 9.0_wp
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, [missed, largest], [0.0_wp, 4.0_wp], tol, 1.0_wp, "nothing")
         set%defect(2) = -0.125_wp
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, missed, 0.5_wp, tol, 1.0_wp, "a gap")
         set%item(1)%response%stick(1) = 1.25_wp
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, missed, 0.75_wp, tol, 1.0_wp, "friction")
         set%item(1)%slip = [2.0_wp, 0.0_wp]
         set%item(1)%slip_target = [2.0_wp, 0.0_wp]
         friction%law(1)%slip_target = [2.0_wp, 0.0_wp]
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, missed, 0.75_wp, tol, 1.0_wp, "at the slip that is led to")
         ! A mean gap pushes with three times its multiplier, by resultants on the slave side.
         set%item(1)%is_mean = .true.
         set%item(1)%normal = 3.0_wp
         set%item(1)%n_slave = 1
         set%item(1)%g(:, 1) = [0.0_wp, 1.5_wp]
         set%item(1)%t(:, 1, 1) = [0.5_wp, 0.0_wp]
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, [missed, largest], [0.5_wp, 6.0_wp], tol, 1.0_wp, "a mean gap")
         system%response%rounding = 0.49_wp/round_off
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, missed, 0.5_wp, tol, 1.0_wp, "more than round-off")
         system%response%rounding(2, 1) = 0.51_wp/round_off
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, missed, 0.0_wp, 0.0_wp, 1.0_wp, "round-off of forces that cancel")
         set%lam = 0.0_wp
         call friction_missed(friction, system, set, missed, largest)
         call check_near(error, [missed, largest], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "no push")
      end associate
   end subroutine test_missed

end module test_friction_ways
