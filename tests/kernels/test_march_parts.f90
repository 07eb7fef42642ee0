!> Increments in parts: which of them are tried, told and counted, where they end, and what an
!> interrupt leaves.
module test_march_parts
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_from_elements
   use emcon_errors, only : err_analysis, err_interrupt, error_t
   use emcon_host_force, only : force_response_t, host_force_t, host_outside
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_watch
   use emcon_march_types, only : watcher_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_t
   use given_scenes, only : make_line, open_given
   implicit none
   private
   public :: collect_march_parts

   !> No force, but node 1 may go past the place `wall` in ways of no more than `longest` only.
   type, extends(host_force_t) :: gate_t
      real(wp) :: wall = 0.0_wp, longest = 0.0_wp
   contains
      procedure :: respond => gate_respond
   end type gate_t

   type, extends(watcher_t) :: writer_t
      integer :: n = 0
      integer :: increment(20) = 0, part(20) = 0
      real(wp) :: time(20) = 0.0_wp, least(20) = 0.0_wp
   contains
      procedure :: tell => writer_tell
   end type writer_t

contains

   subroutine collect_march_parts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("halves, and back on the grid", test_halves), &
         test_case_t("no part is small enough", test_none), &
         test_case_t("too many parts", test_crawl), &
         test_case_t("an interrupt leaves the increment before", test_interrupt)]
   end subroutine collect_march_parts

   subroutine gate_respond(self, u0, du, wants_tangent, response)
      class(gate_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response

      if (u0(1, 1) + du(1, 1) > self%wall .and. du(1, 1) > self%longest) response%status &
         = host_outside
   end subroutine gate_respond

   subroutine writer_tell(self, increment, time, n_part, h_least)
      class(writer_t), intent(inout) :: self
      integer, intent(in) :: increment, n_part
      real(wp), intent(in) :: time, h_least

      self%n = self%n + 1
      self%increment(self%n) = increment
      self%part(self%n) = n_part
      self%time(self%n) = time
      self%least(self%n) = h_least
   end subroutine writer_tell

   logical function never()
      never = .false.
   end function never

   logical function at_once()
      at_once = .true.
   end function at_once

   !> A mass point at the speed 1/2 in increments of the size 2: each goes on by 1.
   subroutine open_flight(stepper, wall, longest, h_min, error)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: wall, longest, h_min
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(gate_t) :: gate
      integer, allocatable :: slot(:)

      call make_line(scene, 1, .false., 2.0_wp, 4)
      scene%step(1)%time%h_min = h_min
      scene%v0(1, 1) = 0.5_wp
      gate%name = "GATE"
      gate%wall = wall
      gate%longest = longest
      call csr_from_elements(gate%pattern, 2, [1, 3], [1, 2], slot, error)
      if (.not. allocated(error)) call open_given(stepper, scene, gate, 1.0_wp, error)
   end subroutine open_flight

   !> Ways past 1.6 of at most 0.3: the second increment takes 1/2 and twice 1/4 after two that are
   !> too long; the third one tries each half, and takes four times 1/4.
   subroutine test_halves(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_tried(3) = [0, 5, 7], n_cut(3) = [0, 2, 3]
      real(wp), parameter :: time(5) = [2.0_wp, 2.0_wp, 3.0_wp, 3.0_wp, 3.5_wp], &
         least(5) = [2.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp]
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(writer_t), target :: writer
      integer :: k, i

      call open_flight(stepper, 1.6_wp, 0.3_wp, 0.0_wp, error)
      if (allocated(error)) return
      call march_watch(stepper%march, never, writer)
      do k = 1, 3
         writer%n = 0
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, [stepper%march%state%clock%time, stepper%march%state%u(1, 1), &
            increment%h, increment%done], [2.0_wp*k, real(k, wp), 2.0_wp, 2.0_wp], &
            16.0_wp*epsilon(1.0_wp), 4.0_wp, "a whole one")
         call check_equal(error, [writer%n, increment%n_cut, increment%notes%n, &
            stepper%march%state%clock%n_easy], [n_tried(k), n_cut(k), n_cut(k), merge(1, 0, &
            k == 1)], "tried, cut, and easy ones in a row")
         call check_equal(error, writer%part(:writer%n), [(i, i = 1, writer%n)], "counted")
         call check_equal(error, writer%increment(:writer%n), spread(k, 1, writer%n), "increment")
         if (k /= 2 .or. allocated(error)) cycle
         call check_near(error, writer%time(:5), time, 0.0_wp, 1.0_wp, "times")
         call check_near(error, writer%least(:5), least, 0.0_wp, 1.0_wp, "the smallest")
         call check_true(error, index(increment%notes%item(2)%text, "increment cut at time 3, " &
            // "h = 1: the given force GATE is put out of its range") == 1, &
            increment%notes%item(2)%text)
      end do
      call stepper_close(stepper)
   end subroutine test_halves

   !> Nothing goes past 1.6: three quarters of the way there is the last that succeeds.
   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 1.6_wp, 0.0_wp, 0.5_wp, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      call stepper_advance(stepper, increment, stopped)
      call check_error(error, stopped, err_analysis, "the analysis stops at time 3: with h = " // &
         "0.5, the smallest allowed, the given force GATE is put out of its range", "stopped")
      call check_equal(error, increment%n_cut, 3, "cuts")
      associate (state => stepper%march%state)
         call check_near(error, [state%clock%time, state%u(1, 1), increment%done], [3.0_wp, &
            1.5_wp, 1.0_wp], 16.0_wp*epsilon(1.0_wp), 1.0_wp, "as far as it came")
         call check_true(error, state%clock%is_off_grid .and. state%clock%n_grid == 1, "between")
      end associate
      call stepper_close(stepper)
   end subroutine test_none

   !> Parts of 2^-12 only. After the first twelve, which are too long, of three that are tried two
   !> go on and one is the double that comes next: 3988 lead to 2659 of 4096.
   subroutine test_crawl(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 0.0_wp, 1.1_wp/4096.0_wp, 1.0_wp/4096.0_wp, error)
      if (allocated(error)) return
      call stepper_advance(stepper, increment, stopped)
      call check_error(error, stopped, err_analysis, "was tried in 4000 parts, the smallest " // &
         "of h = 4.88281E-04, and 64.9 % of it are done; give smaller increments", "stopped")
      call check_near(error, stepper%march%state%clock%time, 2659.0_wp/2048.0_wp, 0.0_wp, 1.0_wp, &
         "time")
      call stepper_close(stepper)
   end subroutine test_crawl

   !> After a part that was given up, and before anything else, the state is as it was.
   subroutine test_interrupt(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment

      call open_flight(stepper, 1.6_wp, 0.3_wp, 0.0_wp, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      call march_watch(stepper%march, at_once)
      call check_true(error, .not. associated(stepper%march%watcher), "nobody watches")
      call stepper_advance(stepper, increment, stopped)
      call check_equal(error, stopped%code, err_interrupt, "interrupted")
      call check_near(error, [stepper%march%state%clock%time, stepper%march%state%u(1, 1), &
         stepper%march%state%v(1, 1)], [2.0_wp, 1.0_wp, 0.5_wp], 16.0_wp*epsilon(1.0_wp), 1.0_wp, &
         "as before")
      call stepper_close(stepper)
   end subroutine test_interrupt

end module test_march_parts
