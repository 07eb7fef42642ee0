!> Running figures of the verdict: what it keeps of increments that go up and down.
module test_verdict_follow
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_free
   use emcon_materials, only : kinematics_linear
   use emcon_overlap_query, only : overlap_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_verdict, only : verdict_end, verdict_update
   use kind_rows, only : law_code
   use small_scenes, only : add_step, block_t, make_block
   use stepper_scenes, only : make_drop, open_scene
   implicit none
   private
   public :: collect_verdict_follow

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_verdict_follow(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the most, and when", test_most), &
         test_case_t("counts and sums", test_counts), &
         test_case_t("the deepest overlap, of a pair or of none", test_overlap), &
         test_case_t("an overlap of a fifth of a thickness is told once", test_thickness), &
         test_case_t("bodies in each other of which one has gone through itself", test_own), &
         test_case_t("warnings that differ", test_warnings), &
         test_case_t("linear sections that turn", test_turning), &
         test_case_t("a bent body is told once, at the end of a step", test_bent)]
   end subroutine collect_verdict_follow

   subroutine open(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 10)
      call open_scene(stepper, scene, error)
   end subroutine open

   subroutine follow(stepper, time, increment)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: time
      type(increment_t), intent(in) :: increment

      stepper%march%state%clock%time = time
      call verdict_update(stepper%verdict, stepper%scene, stepper%march, increment)
   end subroutine follow

   !> Of three increments the second one has the most.
   subroutine test_most(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: size(3) = [0.25_wp, 0.75_wp, 0.5_wp]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k

      call open(stepper, error)
      if (allocated(error)) return
      do k = 1, 3
         increment = increment_t(give=size(k), unconverged=2.0_wp*size(k), &
            law_missed=3.0_wp*size(k), largest_push=4.0_wp*size(k), &
            n_augmentation=nint(20.0_wp*size(k)))
         increment%stand_off%largest = 5.0_wp*size(k)
         increment%nodal_pull%pull = 6.0_wp*size(k)
         increment%nodal_pull%force = 7.0_wp*size(k)
         stepper%march%state%pairs%total(1)%slave(:3) = size(k)*[-3.0_wp, 4.0_wp, 100.0_wp]
         call follow(stepper, real(k, wp), increment)
      end do
      associate (verdict => stepper%verdict)
         call check_near(error, [verdict%penalty%give, verdict%unconverged, verdict%law_missed, &
            verdict%largest_push, verdict%stand_off%largest, verdict%nodal_pull%pull, &
            verdict%nodal_pull%force, verdict%largest_force], 0.75_wp*[1.0_wp, 2.0_wp, 3.0_wp, &
            4.0_wp, 5.0_wp, 6.0_wp, 7.0_wp, 5.0_wp], tol, 10.0_wp, "the most")
         call check_near(error, [verdict%penalty%time, verdict%unconverged_time], &
            [2.0_wp, 2.0_wp], 0.0_wp, 1.0_wp, "when")
         call check_equal(error, verdict%penalty%most_augmentations, 15, "the most of them")
      end associate
      call march_free(stepper%march)
   end subroutine test_most

   subroutine test_counts(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k

      call open(stepper, error)
      if (allocated(error)) return
      do k = 1, 3
         increment = increment_t(n_newton=k, n_cut=2*k, is_guarded=k /= 2)
         increment%stand_off%impulse = 2.0_wp*k
         increment%stand_off%impulse_gap = 3.0_wp*k
         call follow(stepper, real(k, wp), increment)
      end do
      associate (verdict => stepper%verdict)
         call check_equal(error, [verdict%count%newton, verdict%count%cut, verdict%count%guarded], &
            [6, 12, 2], "counts")
         call check_near(error, [verdict%stand_off%impulse, verdict%stand_off%impulse_gap], &
            [12.0_wp, 18.0_wp], tol, 10.0_wp, "sums")
      end associate
      call march_free(stepper%march)
   end subroutine test_counts

   subroutine test_overlap(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: paired(5) = [0.1_wp, 0.2_wp, 0.3_wp, 0.1_wp, 0.4_wp]
      real(wp), parameter :: stray(5) = [0.0_wp, 0.3_wp, 0.1_wp, 0.2_wp, 0.4_wp]
      real(wp), parameter :: deepest(5) = [0.1_wp, 0.3_wp, 0.3_wp, 0.3_wp, 0.4_wp]
      integer, parameter :: since(5) = [1, 2, 2, 2, 5]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k

      call open(stepper, error)
      if (allocated(error)) return
      do k = 1, 5
         increment = increment_t()
         increment%overlap = overlap_t(depth=paired(k), length=1.0_wp, node=11, &
            of_facets=0.01_wp*abs(k - 3))
         increment%overlap%facet(:2) = [7, 8]
         increment%stray = overlap_t(depth=stray(k), length=1.0_wp, node=12)
         increment%stray%facet(:2) = [6, 7]
         call follow(stepper, real(k, wp), increment)
         associate (found => stepper%verdict%overlap)
            call check_near(error, [found%deepest, found%time], [deepest(k), real(since(k), wp)], &
               0.0_wp, 1.0_wp, "deepest " // to_text(k))
            call check_true(error, (index(found%place, "node 12 ") > 0 .and. index(found%place, &
               "no *CONTACT PAIR") > 0) .eqv. (k > 1 .and. k < 5), "of none " // to_text(k))
            call check_true(error, (index(found%place, "node 11 ") > 0) .eqv. (k == 1 &
               .or. k == 5), "of a pair " // to_text(k))
            call check_near(error, found%of_facets, 0.02_wp, tol, 1.0_wp, "of edges")
         end associate
      end do
      call march_free(stepper%march)
   end subroutine test_overlap

   !> Of elements 0.1 thick behind edges of 2, at increments 3 and 4; not behind a wall.
   subroutine test_thickness(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: depth(5) = [0.5_wp, 0.009_wp, 0.011_wp, 0.02_wp, 0.0_wp]
      integer, parameter :: n_told(5) = [0, 0, 1, 1, 1]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k, n_before

      call open(stepper, error)
      if (allocated(error)) return
      n_before = stepper%verdict%warnings%n
      do k = 1, size(depth)
         increment = increment_t()
         increment%overlap = overlap_t(depth=depth(k), length=2.0_wp, node=11)
         increment%overlap%facet(:2) = [7, 8]
         if (k > 1) increment%overlap%thickness = 0.1_wp
         call follow(stepper, real(k, wp), increment)
         associate (told => stepper%verdict%warnings)
            call check_equal(error, told%n - n_before, n_told(k), "told by " // to_text(k))
            if (allocated(error)) exit
            if (k == 3) call check_true(error, index(told%item(told%n)%text, "0.2 of the " // &
               "thickness") > 0 .and. index(told%item(told%n)%text, "at time 3, node 11 ") > 0, &
               told%item(told%n)%text)
         end associate
      end do
      call march_free(stepper%march)
   end subroutine test_thickness

   !> The lower block is bent until its right end is in the top of its left one: told where an
   !> overlap names that block, be it one of a pair or of none, and not where it names the other.
   subroutine test_own(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: body(4) = [1, 2, 1, 2]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(overlap_t) :: of_body(2)
      integer :: k

      of_body = overlap_t(length=1.0_wp)
      of_body(1)%node = 6
      of_body(1)%facet(:2) = [7, 8]
      of_body(2)%node = 14
      of_body(2)%facet(:2) = [15, 16]
      do k = 1, 4
         call open(stepper, error)
         if (allocated(error)) return
         associate (u => stepper%march%state%u, x => stepper%scene%x)
            u(:, 4) = [1.3_wp, 0.8_wp] - x(:, 4)
            u(:, 5) = [-1.25_wp, 0.8_wp] - x(:, 5)
            u(:, 10) = [-1.25_wp, -0.25_wp] - x(:, 10)
            u(:, 9) = [0.3_wp, 0.3_wp] - x(:, 9)
         end associate
         increment = increment_t()
         increment%overlap = of_body(merge(body(k), 3 - body(k), k < 3))
         increment%overlap%depth = merge(0.4_wp, 0.3_wp, k < 3)
         increment%stray = of_body(merge(3 - body(k), body(k), k < 3))
         increment%stray%depth = merge(0.3_wp, 0.4_wp, k < 3)
         call follow(stepper, 1.0_wp, increment)
         associate (place => stepper%verdict%overlap%place)
            call check_true(error, (index(place, "a body has gone through itself by then, node " &
               // "10 of body 1 is 0.25 behind the edge from node 7 to 6") > 0) .eqv. body(k) &
               == 1, &
               "own " // to_text(k) // ": " // place)
         end associate
         call march_free(stepper%march)
         stepper = stepper_t()
      end do
   end subroutine test_own

   !> All are counted; the first twenty different ones are kept.
   subroutine test_warnings(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      integer :: k, before

      call open(stepper, error)
      if (allocated(error)) return
      before = stepper%verdict%n_warning
      do k = 1, 25
         increment%warnings = notes_t()
         call note_add(increment%warnings, "warning " // to_text(k))
         call note_add(increment%warnings, "warning 1")
         call follow(stepper, real(k, wp), increment)
      end do
      call check_equal(error, stepper%verdict%n_warning - before, 50, "all")
      call check_equal(error, stepper%verdict%warnings%n, 20, "kept")
      call check_equal(error, stepper%verdict%warnings%item(20)%text, "warning " &
         // to_text(20 - before), "the last one")
      call march_free(stepper%march)
   end subroutine test_warnings

   !> A linear block that turns more and more, and back: told once, when it is no more small, and
   !> what makes the run bad is the largest rotation.
   subroutine test_turning(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: sine(5) = [0.04_wp, 0.06_wp, 0.15_wp, 0.25_wp, 0.01_wp]
      integer, parameter :: n_told(5) = [0, 1, 1, 1, 1], n_reason(5) = [0, 0, 0, 1, 1]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [1, 1], block)
      scene%section(1)%kinematics = kinematics_linear
      scene%material(1)%law = law_code("linear")
      scene%material(1)%constant = [100.0_wp, 0.3_wp]
      call add_step(scene, .false., 0.1_wp, 10)
      call open_scene(stepper, scene, error)
      if (allocated(error)) return
      associate (verdict => stepper%verdict, u => stepper%march%state%u, x => scene%x)
         do k = 1, 5
            ! The skew part is the sine; strains, 1 - cos, are smaller.
            u(1, :) = (sqrt(1.0_wp - sine(k)**2) - 1.0_wp)*x(1, :) - sine(k)*x(2, :)
            u(2, :) = sine(k)*x(1, :) + (sqrt(1.0_wp - sine(k)**2) - 1.0_wp)*x(2, :)
            call follow(stepper, real(k, wp), increment)
            call check_equal(error, verdict%warnings%n, n_told(k), "told by " // to_text(k))
            call verdict_end(verdict)
            call check_equal(error, verdict%reasons%n, n_reason(k), "reasons at " // to_text(k))
         end do
         if (allocated(error)) return
         call check_true(error, index(verdict%warnings%item(1)%text, "section ALL is linear") == 1 &
            .and. index(verdict%warnings%item(1)%text, "from time 2 on") > 0, &
            verdict%warnings%item(1)%text)
         call check_true(error, index(verdict%reasons%item(1)%text, "rotate by 0.25 rad") > 0, &
            verdict%reasons%item(1)%text)
      end associate
      call march_free(stepper%march)
   end subroutine test_turning

   !> A row of quadrilaterals that is bent misses more than half of its energy, whatever the bend.
   subroutine test_bent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: bend(4) = [0.01_wp, 0.0_wp, 0.01_wp, 0.02_wp]
      integer, parameter :: n_kept(4) = [1, 1, 2, 2]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [5, 1], block)
      call add_step(scene, .false., 0.1_wp, 10)
      call open_scene(stepper, scene, error)
      if (allocated(error)) return
      call note_add(increment%warnings, "another one")
      associate (verdict => stepper%verdict, march => stepper%march, x => scene%x)
         do k = 1, 4
            if (k > 1) march%state%clock%n_grid = 10
            march%state%u(1, :) = -bend(k)*x(1, :)*(x(2, :) - 0.5_wp)
            march%state%u(2, :) = 0.5_wp*bend(k)*x(1, :)**2
            call follow(stepper, real(k, wp), increment)
            call check_equal(error, verdict%warnings%n, n_kept(k), "kept after " // to_text(k))
            call check_equal(error, verdict%n_warning, k + merge(1, 0, k > 2), "all")
         end do
         if (allocated(error)) return
         call check_true(error, index(verdict%warnings%item(2)%text, &
            "the body of element 1 is bent and made of linear elements, too stiff by about ") == 1 &
            .and. index(verdict%warnings%item(2)%text, " %; take CPE4I, CPE6 or CPE8R") > 0, &
            verdict%warnings%item(2)%text)
      end associate
      call march_free(stepper%march)
   end subroutine test_bent

end module test_verdict_follow
