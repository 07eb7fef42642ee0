!> Node-to-segment contact of a moving surface: nearest edges, gap states, evaluation, areas.
module test_nts
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_contact, only : constraint_t, gap_state_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_scene, only : contact_pair_t, scene_t
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, make_two_blocks, right, &
      scene_begin, shake, top
   implicit none
   private
   public :: collect_nts

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_nts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps of a block over another", test_states), &
         test_case_t("past the end of the surface", test_past_end), &
         test_case_t("nearest edge all along a random walk", test_walk), &
         test_case_t("no candidates while far apart", test_apart), &
         test_case_t("evaluation equals the state", test_evaluate), &
         test_case_t("areas", test_area)]
   end subroutine collect_nts

   !> A gap of 1/4 that closes by 3/8 in the middle of the step.
   subroutine test_states(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      real(wp), allocatable :: du(:, :)
      integer :: i

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.375_wp
      call nts%begin_step(scene%x, scene%u0, du)
      call check_equal(error, nts%node, [11, 12, 13], "slave nodes")
      call check_equal(error, nts%edge, [3, 2, 1], "edges under them, counted from the right")
      do i = 1, 3
         call nts%measure(scene%x, scene%u0, du)
         state = nts%state(i)
         call check_true(error, state%is_near .and. state%is_over .and. state%is_covered, "near")
         call check_near(error, [state%gap0, state%gap1, state%size], [0.25_wp, -0.125_wp, &
            1.0_wp], tol, 1.0_wp, "gap")
      end do
   end subroutine test_states

   !> Over the side of the lower block no constraint may act; at its corner one may.
   subroutine test_past_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp), parameter :: way(3) = [0.5_wp, 0.874_wp, 0.876_wp]
      integer :: k

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.5_wp
      do k = 1, 3
         u(1, 11:) = way(k)                      ! the right node is at 1.125 + way
         call nts%begin_step(scene%x, u, du)
         call nts%measure(scene%x, u, du)
         state = nts%state(3)
         call check_true(error, state%is_over .eqv. k < 3, "over the surface " // to_text(k))
      end do
      u(1, 11:) = 0.5_wp                         ! flies over the end on its way down
      du(1, 11:) = 1.0_wp
      call nts%begin_step(scene%x, u, du)
      call nts%measure(scene%x, u, du)
      state = nts%state(3)
      call check_true(error, .not. state%is_over, "past the end where the gap closes")
   end subroutine test_past_end

   !> A slave square tumbles over a master square: at each step the edge is the nearest of all
   !> wherever the node could touch in this step.
   subroutine test_walk(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(contact_pair_t) :: pair
      type(nts_t) :: nts, all
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: gap, speed(2, 1), path(2)
      logical :: is_over
      integer :: i, step, n_near

      call scene_begin(scene)
      call add_block(scene, "CPE4", [8, 8], [0.0_wp, 0.0_wp], [8.0_wp, 8.0_wp], lower)
      call add_block(scene, "CPE3", [5, 5], [9.0_wp, 1.0_wp], [3.0_wp, 3.0_wp], upper)
      call add_surface(scene, "MASTER", lower, [bottom, right, top, left])
      call add_surface(scene, "SLAVE", upper, [bottom, right, top, left])
      pair%slave = 2
      pair%master = 1
      call nts_init(nts, scene, pair, error)
      if (allocated(error)) return
      call nts_init(all, scene, pair, error)
      allocate(u, du, source=0.0_wp*scene%x)
      n_near = 0
      do step = 1, 400
         call shake(du, 0.02_wp)
         call shake(speed, 0.3_wp)
         path = [-5.0_wp, 2.0_wp] + [5.0_wp*sin(0.01_wp*step), 5.0_wp*cos(0.017_wp*step)]
         do i = 82, size(u, 2)
            du(:, i) = du(:, i) + speed(:, 1) + 0.05_wp*(path - u(:, i))
         end do
         call nts%begin_step(scene%x, u, du)
         do i = 1, nts%n_constraint
            call nts_nearest(all, i, scene%x, u, gap, is_over)
            if (distance(all%node(i), all%master%edge(:, all%edge(i))) > 2.0_wp*length_of(du)) cycle
            n_near = n_near + 1
            if (nts%edge(i) /= all%edge(i)) call check_near(error, &
               distance(nts%node(i), nts%master%edge(:, max(1, nts%edge(i)))), &
               distance(all%node(i), all%master%edge(:, all%edge(i))), tol, 1.0_wp, &
               "distance of the nearest edge in step " // to_text(step))
         end do
         if (allocated(error)) return
         u = u + du
      end do
      call check_true(error, n_near > 1000, "many nodes come near: " // to_text(n_near))

   contains

      pure real(wp) function distance(node, edge)
         integer, intent(in) :: node, edge(2)
         real(wp) :: a(2), b(2)

         a = scene%x(:, edge(2)) + u(:, edge(2)) - scene%x(:, edge(1)) - u(:, edge(1))
         b = scene%x(:, node) + u(:, node) - scene%x(:, edge(1)) - u(:, edge(1))
         b = b - max(0.0_wp, min(1.0_wp, dot_product(a, b)/dot_product(a, a)))*a
         distance = sqrt(dot_product(b, b))
      end function distance

   end subroutine test_walk

   pure real(wp) function length_of(field)
      real(wp), intent(in) :: field(:, :)

      length_of = sqrt(maxval(sum(field**2, dim=1)))
   end function length_of

   !> Bodies 50 edges apart: an empty list that stands until half of the way is gone.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: step, n_list
      real(wp) :: last

      call make_two_blocks(scene, 50.0_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      du(2, 11:) = -0.1_wp
      n_list = 0
      last = 0.0_wp
      do step = 1, 450
         call nts%begin_step(scene%x, u, du)
         if (abs(nts%reach - last) > 0.0_wp) n_list = n_list + 1
         last = nts%reach
         call check_equal(error, size(nts%near%candidates%edge), 0, "candidates in step " &
            // to_text(step))
         u = u + du
      end do
      call check_true(error, n_list <= 5, "few lists: " // to_text(n_list))
   end subroutine test_apart

   subroutine test_evaluate(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      type(gap_state_t) :: state
      type(constraint_t) :: item(1)
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: i, k, n

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      allocate(u, du, source=0.0_wp*scene%x)
      do k = 1, 20
         call shake(u, 0.1_wp)
         call shake(du, 0.2_wp)
         call nts%begin_step(scene%x, u, du)
         do i = 1, 3
            call nts%measure(scene%x, u, du)
            state = nts%state(i)
            call nts%evaluate([i], scene%x, u, du, [0.0_wp], item)
            associate (constraint => item(1))
               n = constraint%n_node
               call check_equal(error, constraint%node(1), nts%node(i), "slave node first")
               call check_near(error, [constraint%gap0, constraint%gap1, constraint%size], &
                  [state%gap0, state%gap1, state%size], tol, 1.0_wp, "values")
               call check_near(error, sum(constraint%g(:, :n)*du(:, constraint%node(:n))), &
                  constraint%dgap, tol, 1.0_wp, "identity")
            end associate
         end do
      end do
   end subroutine test_evaluate

   !> Lengths of the slave edges times the thickness: their sum is the area of the surface.
   subroutine test_area(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp) :: area(3), length(3)

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      scene%section(1)%thickness = 0.5_wp
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      call nts%area(scene%x, 2.0_wp*scene%x, area, length)
      call check_near(error, area, [0.75_wp, 1.5_wp, 0.75_wp], tol, 1.0_wp, "areas at scale 3")
      call check_near(error, length, 2.0_wp*area, tol, 1.0_wp, "lengths")
   end subroutine test_area

end module test_nts
