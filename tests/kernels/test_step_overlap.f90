!> What an increment of several steps tells of overlaps: the deepest, whatever came last.
module test_step_overlap
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : step_done, step_overlaps
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, smoothing_hermite
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_init, march_t
   use emcon_march_step, only : march_step
   use emcon_march_types, only : part_t
   use emcon_overlap_check, only : overlap_check_init, overlap_check_smooth, overlap_check_step, &
      overlap_check_t, overlap_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : method_penalty
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, make_two_blocks
   implicit none
   private
   public :: collect_step_overlap

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.02_wp, gap = 0.05_wp
   integer, parameter :: n_step = 10

contains

   subroutine collect_step_overlap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("bodies that no pair brings together", test_stray), &
         test_case_t("by facets and by what they stand for", test_smooth), &
         test_case_t("steps that go deeper than guards allow", test_deeper), &
         test_case_t("a body that goes through another one in a step", test_through)]
   end subroutine collect_step_overlap

   subroutine begin(scene, march, part, error)
      type(scene_t), intent(inout) :: scene
      type(march_t), intent(inout) :: march
      type(part_t), intent(out) :: part
      type(error_t), allocatable, intent(out) :: error

      part%h = h
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> A free block flies into another and out again: nothing holds it. Edges are 1 long.
   subroutine test_stray(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(part_t) :: part
      real(wp) :: height, deepest
      integer :: k, status

      call make_two_blocks(scene, gap, lower, upper)
      scene%pair = scene%pair(:0)
      call add_step(scene, .false., h, n_step)
      scene%v0(2, 11:) = -1.0_wp
      call begin(scene, march, part, error)
      if (allocated(error)) return
      increment%h = h
      height = gap
      deepest = 0.0_wp
      do k = 1, n_step
         if (k == n_step/2 + 1) march%state%v = -march%state%v
         height = height + merge(-h, h, k <= n_step/2)
         deepest = max(deepest, -height)
         call march_step(march, scene, part, increment, status, error)
         if (allocated(error)) return
         call check_equal(error, status, step_done, "step " // to_text(k))
         call check_near(error, [increment%stray%depth, increment%overlap%depth], [deepest, &
            0.0_wp], 1.0e3_wp*eps, 1.0_wp, "deepest so far, step " // to_text(k))
      end do
      call check_true(error, height > 0.0_wp .and. deepest > 0.5_wp*gap, "in and out")
      call march_free(march)
   end subroutine test_stray

   !> The upper block is below the lower one in the end, or the lower one above it, while the left
   !> end of the other moves with it: seen on the way.
   subroutine test_through(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 3.0_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp) :: du(2, 16)
      integer :: k

      call make_two_blocks(scene, gap, lower, upper)
      call add_step(scene, .false., h, n_step)
      do k = 1, 3
         du = 0.0_wp
         if (k == 1) du(2, [1, 6, 11, 12, 13, 14, 15, 16]) = -way
         if (k == 2) du(2, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]) = way
         if (k == 3) du(2, [1, 6, 11, 12, 13, 14, 15, 16]) = way
         call overlap_check_init(judge, scene)
         call overlap_check_smooth(judge, scene, contact_options_t())
         call overlap_check_step(judge, scene%x, 0.0_wp*du, du, overlap)
         call check_true(error, overlap%depth > 0.1_wp .eqv. k < 3, "way " // to_text(k))
         ! In the end there is none.
         call overlap_check_step(judge, scene%x, du, 0.0_wp*du, overlap)
         call check_near(error, overlap%depth, 0.0_wp, 0.0_wp, 1.0_wp, "end " // to_text(k))
      end do
   end subroutine test_through

   !> Blocks that are too deep in each other for contact to begin fly on: a step by which they come
   !> deeper than a tenth of what guards let in is to be smaller, if nodes of both sides are held,
   !> contact does not give way and there is a smaller one.
   subroutine test_deeper(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: deep = 0.4_wp, allowed = 1.2_wp*0.05_wp
      real(wp), parameter :: way(7) = -[0.11_wp, 0.09_wp, -0.09_wp, 0.11_wp, 0.11_wp, 0.11_wp, &
         0.11_wp]*allowed
      integer, parameter :: expected(7) = [step_overlaps, step_done, step_done, step_done, &
         step_done, step_done, step_done]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(increment_t) :: increment
      type(part_t) :: part
      integer :: k, status

      do k = 1, 7
         call make_two_blocks(scene, 0.0_wp, lower, upper)
         call add_step(scene, .false., h, n_step)
         scene%pair(1)%both_sides = k /= 4
         if (k == 5) scene%step(1)%contact%method = method_penalty
         if (k == 5) scene%step(1)%contact%penalty%stiffness = 1.0e-6_wp
         scene%v0(2, 11:) = way(k)/h
         block
            type(march_t) :: march

            call begin(scene, march, part, error)
            if (allocated(error)) return
            march%state%u(2, 11:) = -merge(0.5_wp*allowed, deep, k == 7)
            if (k == 7) march%system%contact(1)%contact%max_penetration_at_start = -1.0_wp
            part%may_cut = k /= 6
            increment = increment_t(h=h)
            call march_step(march, scene, part, increment, status, error)
            if (allocated(error)) return
            call check_equal(error, status, expected(k), "case " // to_text(k))
            call march_free(march)
         end block
      end do
   end subroutine test_deeper

   !> A corner goes through a hollow arc of edges, with a contact that hardly pushes: it is deepest
   !> by the curve elsewhere than by the edges, which is told of each by itself.
   subroutine test_smooth(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: bend = 0.25_wp, soft = 1.0e-6_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(part_t) :: part
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp) :: u(2, 16), deepest(2)
      integer :: k, i, status, at(2)

      call make_two_blocks(scene, gap, lower, upper)
      do i = 1, 10
         scene%x(2, i) = scene%x(2, i) + 0.5_wp*bend*scene%x(1, i)**2
      end do
      scene%x(2, 11:) = scene%x(2, 11:) + 0.4_wp
      call add_step(scene, .false., h, n_step)
      scene%step(1)%contact%method = method_penalty
      scene%step(1)%contact%penalty%stiffness = soft
      scene%step(1)%contact%options%smoothing = smoothing_hermite
      scene%v0(:, 11:) = spread([3.0_wp, -2.0_wp], 2, 6)
      call begin(scene, march, part, error)
      if (allocated(error)) return
      call overlap_check_init(judge, scene)
      call overlap_check_smooth(judge, scene, contact_options_t(smoothing=smoothing_hermite))
      increment%h = h
      deepest = 0.0_wp
      at = 0
      do k = 1, n_step
         u = march%state%u
         call march_step(march, scene, part, increment, status, error)
         if (allocated(error)) return
         call check_equal(error, status, step_done, "step " // to_text(k))
         call overlap_check_step(judge, scene%x, u, march%motion%du, overlap)
         where ([overlap%depth, overlap%of_facets] > deepest) at = k
         deepest = max(deepest, [overlap%depth, overlap%of_facets])
         call check_near(error, [increment%overlap%depth, increment%overlap%of_facets], deepest, &
            1.0e3_wp*eps, 1.0_wp, "deepest so far, step " // to_text(k))
      end do
      call check_true(error, all(at > 0) .and. at(1) /= at(2), "not in the same step")
      call march_free(march)
   end subroutine test_smooth

end module test_step_overlap
