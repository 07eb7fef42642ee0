!> Given forces as a term: their derivative, and the sizes that residuals are held against.
module test_host_sizes
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_host_force, only : force_response_t, host_failed, host_force_t, host_outside
   use emcon_host_term, only : host_term_init, host_term_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   use emcon_text, only : to_text
   use given_hosts, only : chain_host_init, chain_host_t
   use given_scenes, only : make_line
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_host_sizes

   !> A giver whose answers have `what` wrong; 0: nothing.
   type, extends(host_force_t) :: odd_t
      integer :: what = 0
   contains
      procedure :: respond => odd_respond
   end type odd_t

   integer, parameter :: n = 4
   real(wp), parameter :: tol = 64.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_host_sizes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("tangent by finite differences", test_tangent), &
         test_case_t("sizes of forces and positions", test_sizes), &
         test_case_t("sizes that are told too small", test_too_small), &
         test_case_t("symmetric as the giver says", test_symmetric), &
         test_case_t("answers that are none", test_answers)]
   end subroutine collect_host_sizes

   !> Springs 2-3, 3-1 and 1-4 along x, and a motion by chance.
   subroutine begin(term, motion, response, tells, error)
      type(host_term_t), intent(out) :: term
      type(motion_t), intent(out) :: motion
      type(response_t), intent(out) :: response
      logical, intent(in) :: tells
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_host_t) :: host
      real(wp) :: u0(2, n), du(2, n)

      call make_line(scene, n, .false., 0.1_wp, 1)
      scene%x(2, :) = -7.0_wp
      call chain_host_init(host, [2, 3, 1, 4], n, error)
      if (allocated(error)) return
      host%k = 3.0_wp
      host%c = 2.0_wp
      host%tells_magnitude = tells
      call host_term_init(term, host, scene, error)
      if (allocated(error)) return
      call shake(u0, 1.0_wp)
      call shake(du, 0.5_wp)
      ! To either side, farther than before.
      u0(:, 1) = -0.5_wp
      du(:, 1) = -0.25_wp
      u0(:, 3) = 0.5_wp
      du(:, 3) = 0.25_wp
      motion = motion_of(evaluation_t(), scene%x, u0, du)
      call response_init(response, 2, n, 0)
   end subroutine begin

   !> Columns of the tangent.
   subroutine columns(term, motion, k)
      type(host_term_t), intent(inout) :: term
      type(motion_t), intent(in) :: motion
      real(wp), intent(out) :: k(2*n, 2*n)
      real(wp) :: way(2, n), product(2, n)
      integer :: j

      do j = 1, 2*n
         way = 0.0_wp
         way(2 - mod(j, 2), (j + 1)/2) = 1.0_wp
         product = 0.0_wp
         call term%tangent_times(motion, way, product)
         k(:, j) = reshape(product, [2*n])
      end do
   end subroutine columns

   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: d = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(host_term_t) :: term
      type(motion_t) :: motion, moved
      type(response_t) :: response
      real(wp) :: k(2*n, 2*n), force(2, n, 2), du(2, n)
      integer :: j, s

      call begin(term, motion, response, .false., error)
      if (allocated(error)) return
      call columns(term, motion, k)
      do j = 1, 2*n
         do s = 1, 2
            du = motion%du
            du(2 - mod(j, 2), (j + 1)/2) = du(2 - mod(j, 2), (j + 1)/2) + (2*s - 3)*d
            moved = motion_of(motion%evaluation, motion%x, motion%u0, du)
            call response_begin(response)
            call term%respond(moved, response)
            force(:, :, s) = response%part(role_internal)%force
         end do
         call check_near(error, k(:, j), reshape(force(:, :, 2) - force(:, :, 1), [2*n]) &
            /(2.0_wp*d), 64.0_wp*d**2, 10.0_wp, "tangent")
      end do
      call check_true(error, maxval(abs(k)) > 1.0_wp, "it is stiff")
   end subroutine test_tangent

   !> Told, or no smaller than the forces of what depends on it; the tangent times positions, that
   !> of the larger displacement of both ends.
   subroutine test_sizes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: beside(2, n) = reshape([3, 4, 3, 3, 1, 2, 1, 1], [2, n])
      type(host_term_t) :: term
      type(motion_t) :: motion
      type(response_t) :: response
      real(wp) :: k(2*n, 2*n), position(2, n), expected(2, n)
      integer :: i, told

      do told = 1, 2
         call begin(term, motion, response, told == 2, error)
         if (allocated(error)) return
         call columns(term, motion, k)
         call response_begin(response)
         call term%respond(motion, response)
         position = abs(motion%x) + max(abs(motion%u0), abs(motion%u0 + motion%du))
         call check_near(error, response%rounding, reshape(matmul(abs(k), reshape(position, &
            [2*n])), [2, n]), tol, 100.0_wp, "rounding")
         associate (part => response%part(role_internal))
            expected = abs(part%force)
            do i = 1, n
               if (told == 1) expected(1, i) = max(expected(1, i), maxval(abs(part%force(1, &
                  beside(:, i)))))
            end do
            if (told == 2) then
               ! Springs push node 1 from both sides, 2 and 4 from one.
               call check_near(error, part%magnitude(1, [2, 4]), expected(1, [2, 4]), tol, &
                  10.0_wp, "of one spring")
               call check_true(error, all(part%magnitude >= expected), "as told")
               call check_near(error, sum(part%magnitude(1, [1, 3])), sum(expected(1, [2, 4])) &
                  + 2.0_wp*abs(part%force(1, 2) + part%force(1, 3)), tol, 10.0_wp, "of two")
            else
               call check_near(error, part%magnitude, expected, tol, 10.0_wp, "magnitude")
            end if
         end associate
      end do
   end subroutine test_sizes

   !> What is told counts where it is more than the force.
   subroutine test_too_small(error)
      type(error_t), allocatable, intent(out) :: error
      type(host_term_t) :: term
      type(motion_t) :: motion
      type(response_t) :: response
      type(scene_t) :: scene
      type(odd_t) :: odd
      real(wp) :: expected(2, n)

      call begin(term, motion, response, .false., error)
      if (allocated(error)) return
      call make_line(scene, n, .false., 0.1_wp, 1)
      odd%name = "ODD"
      odd%pattern = term%force%pattern
      call host_term_init(term, odd, scene, error)
      if (allocated(error)) return
      call response_begin(response)
      call term%respond(motion, response)
      expected = 1.0_wp
      expected(1, 1) = 3.0_wp
      call check_near(error, response%part(role_internal)%magnitude, expected, 0.0_wp, 1.0_wp, &
         "magnitude")
   end subroutine test_too_small

   !> At the end of a motion, and of a step, each by itself.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(host_term_t) :: term
      type(motion_t) :: motion
      type(response_t) :: response
      integer :: k

      call begin(term, motion, response, .false., error)
      if (allocated(error)) return
      do k = 0, 7
         term%force%is_symmetric_at_end = btest(k, 0)
         term%force%is_symmetric_in_steps = btest(k, 1)
         motion%evaluation%is_gradient = btest(k, 2)
         call check_true(error, term%is_symmetric(motion) .eqv. btest(k, merge(0, 1, btest(k, &
            2))), "case " // to_text(k))
      end do
   end subroutine test_symmetric

   !> What a giver may answer instead of forces: refused by name, or a failure with its reason. The
   !> tangent times a way is nothing then.
   subroutine test_answers(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=56), parameter :: text(7) = [character(len=56) :: &
         "the energy of the given force ODD is made infinite", &
         "the tangent of the given force ODD is made infinite", &
         "ODD is made infinite or NaN at node 20", "ODD is put out of its range", "ODD failed", &
         "ODD failed: no time", "ODD returned the status 77, which is none"]
      type(host_term_t) :: term
      type(motion_t) :: motion
      type(response_t) :: response
      type(scene_t) :: scene
      type(odd_t) :: odd
      real(wp) :: none(2, n), product(2, n)
      integer :: k

      call begin(term, motion, response, .false., error)
      if (allocated(error)) return
      call make_line(scene, n, .false., 0.1_wp, 1)
      odd%name = "ODD"
      odd%pattern = term%force%pattern
      none = 0.0_wp
      do k = 1, size(text)
         odd%what = k
         if (k == 6) odd%reason = "no time"
         call host_term_init(term, odd, scene, error)
         if (allocated(error)) return
         call response_begin(response)
         call term%respond(motion, response)
         if (k <= 4) then
            call check_true(error, allocated(response%refusal) .and. .not. &
               allocated(response%failure), "refused")
            if (allocated(error)) return
            call check_true(error, index(response%refusal, trim(text(k))) > 0, response%refusal)
         else
            call check_error(error, response%failure, merge(err_input, err_analysis, k == 7), &
               trim(text(k)), "failed")
         end if
         call check_near(error, response%part(role_internal)%force, none, 0.0_wp, 1.0_wp, "forces")
         product = 3.0_wp
         call term%tangent_times(motion, none + 1.0_wp, product)
         call check_near(error, product, none + 3.0_wp, 0.0_wp, 1.0_wp, "product")
      end do
   end subroutine test_answers

   !> Answers with one thing wrong.
   subroutine odd_respond(self, u0, du, wants_tangent, response)
      class(odd_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response

      response%force = 1.0_wp
      select case (self%what)
      case (0)
         response%magnitude(1, 1) = 3.0_wp
         response%magnitude(2, 2) = 0.25_wp
      case (1)
         response%energy = ieee_value(1.0_wp, ieee_quiet_nan)
      case (2)
         if (allocated(response%tangent)) response%tangent(1) = ieee_value(1.0_dp, ieee_quiet_nan)
      case (3)
         response%force(2, 2) = ieee_value(1.0_wp, ieee_quiet_nan)
      case (4)
         response%status = host_outside
      case (5, 6)
         response%status = host_failed
      case default
         response%status = 77
      end select
   end subroutine odd_respond

end module test_host_sizes
