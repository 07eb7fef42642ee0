!> Gaps of segments over a flat surface in closed form, from the gaps of their nodes: all over it,
!> and one past its end; and what they slide by.
module test_segment
   use check, only : check_near, check_true, test_case_t
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, interaction_t, multiplier_dual, &
      multiplier_standard
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_segment, only : segment_init, segment_t
   use emcon_text, only : to_text
   use small_scenes, only : block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_segment

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_segment(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps over a flat surface", test_gaps), &
         test_case_t("stencils that hold", test_covers), &
         test_case_t("slips", test_slips)]
   end subroutine collect_segment

   !> The upper block moved by `way` along x; k: 1 standard, 2 dual.
   subroutine make(way, k, scene, segment, error)
      real(wp), intent(in) :: way
      integer, intent(in) :: k
      type(scene_t), intent(out) :: scene
      type(segment_t), intent(out) :: segment
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      scene%x(1, 11:) = scene%x(1, 11:) + way
      call segment_init(segment, scene, scene%pair(1), error)
      if (allocated(error)) return
      options%multiplier = merge(multiplier_standard, multiplier_dual, k == 1)
      call segment%configure(scene%x, options)
      call contact_laws_of_surface(interaction_t(friction=0.5_wp), segment%laws)
   end subroutine make

   !> Where the last node, at x = 1.125 + way, is over the surface, which ends at 2, and where not,
   !> or where the first one, at -0.875 + way, is not.
   subroutine test_gaps(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(3) = [0.3_wp, 1.1_wp, -1.4_wp]
      type(scene_t) :: scene
      type(segment_t) :: segment
      real(wp), allocatable :: u(:, :), du(:, :), place(:, :)
      real(wp) :: gap(3, 0:1), length(2, 0:1), expected(3, 0:1)
      integer :: k, w, i, at

      do k = 1, 2
         do w = 1, 3
            call make(way(w), k, scene, segment, error)
            if (allocated(error)) return
            allocate(u, du, source=0.0_wp*scene%x)
            call shake(u(:, 11:13), 0.1_wp)
            call shake(du(:, 11:13), 0.1_wp)
            call segment%begin_step(scene%x, u, du)
            call segment%measure(scene%x, u, du)
            do at = 0, 1
               place = scene%x(:, 11:13) + u(:, 11:13) + at*du(:, 11:13)
               gap(:, at) = place(2, :)
               length(:, at) = norm2(place(:, 2:) - place(:, :2), 1)
            end do
            associate (a => length(1, :), b => length(2, :))
               if (k == 2) then
                  ! Each by its own node, whatever the edges are.
                  expected = gap
               else
                  expected(1, :) = (2.0_wp*gap(1, :) + gap(2, :))/3.0_wp
                  expected(2, :) = (a*(2.0_wp*gap(2, :) + gap(1, :))/3.0_wp + b*(2.0_wp*gap(2, :) &
                     + gap(3, :))/3.0_wp)/(a + b)
                  expected(3, :) = (2.0_wp*gap(3, :) + gap(2, :))/3.0_wp
                  ! What is left of the edge past the end belongs to its first node.
                  if (w == 2) expected(2, :) = (a*(2.0_wp*gap(2, :) + gap(1, :))/3.0_wp &
                     + b*gap(2, :))/(a + b)
                  if (w == 3) expected(2, :) = (b*(2.0_wp*gap(2, :) + gap(3, :))/3.0_wp &
                     + a*gap(2, :))/(a + b)
               end if
            end associate
            do i = merge(2, 1, w == 3), merge(2, 3, w == 2)
               ! In the order of the surface, which may be the other way round.
               associate (state => segment%state(findloc(segment%node, 10 + i, 1)))
                  call check_near(error, [state%gap0, state%gap1], expected(i, :), tol, 1.0_wp, &
                     "multiplier " // to_text(k) // ", way " // to_text(w) // ", node " &
                     // to_text(i))
                  call check_true(error, state%is_near .and. state%is_over, "over the surface")
               end associate
            end do
            deallocate(u, du)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_gaps

   !> Stencils of the nodes at all ends of its edges hold, or not.
   subroutine test_covers(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(4) = [-0.125_wp, 1.75_wp, 2.25_wp, 3.25_wp]
      type(scene_t) :: scene
      type(segment_t) :: segment
      real(wp), allocatable :: du(:, :)
      real(wp) :: reach
      logical :: holds(3), expected(3)
      integer :: k, i, seen(0:1)

      call make(-0.5_wp, 1, scene, segment, error)
      if (allocated(error)) return
      allocate(du, source=0.0_wp*scene%x)
      seen = 0
      call segment%begin_step(scene%x, scene%u0, du)
      reach = segment%reach
      ! What one step reaches does not count in the next one.
      call segment%begin_step(scene%x, scene%u0, du + 4.0_wp)
      call check_true(error, segment%reach > 2.0_wp*reach, "a longer step reaches farther")
      segment%reach = 0.0_wp
      call segment%begin_step(scene%x, scene%u0, du)
      call check_near(error, segment%reach, reach, 0.0_wp, 1.0_wp, "reach")
      call segment%begin_step(scene%x, scene%u0, du)
      do k = 1, size(way)
         ! The nodes do not go as far as each other.
         du(1, 11:13) = way(k)*[1.0_wp, 0.75_wp, 0.25_wp]
         call segment%measure(scene%x, scene%u0, du)
         holds = [(segment%nts%covers(findloc(segment%nts%node, 10 + i, 1), scene%x, scene%u0, &
            du), i = 1, 3)]
         expected = [all(holds(:2)), all(holds), all(holds(2:))]
         do i = 1, 3
            call check_true(error, segment%covers(findloc(segment%node, 10 + i, 1), scene%x, &
               scene%u0, du) .eqv. expected(i), "node " // to_text(i) // ", way " // to_text(k))
            seen(merge(1, 0, expected(i))) = seen(merge(1, 0, expected(i))) + 1
         end do
      end do
      call check_true(error, all(seen > 2), "both")
   end subroutine test_covers

   !> The parts of the slips of nodes in that of a constraint, with the sum 1.
   subroutine test_slips(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(2) = [0.3_wp, 1.1_wp]
      type(scene_t) :: scene
      type(segment_t) :: segment
      real(wp), allocatable :: still(:, :)
      real(wp) :: part(3), expected(3)
      integer :: k, w, i, j, m

      do k = 1, 2
         do w = 1, 2
            call make(way(w), k, scene, segment, error)
            if (allocated(error)) return
            allocate(still, source=0.0_wp*scene%x)
            call segment%begin_step(scene%x, still, still)
            do i = 1, merge(3, 2, w == 1)
               expected = 0.0_wp
               expected(i) = 1.0_wp
               if (k == 1) then
                  expected = [2.0_wp, 1.0_wp, 0.0_wp]/3.0_wp
                  if (i == 3) expected = [0.0_wp, 1.0_wp, 2.0_wp]/3.0_wp
                  if (i == 2) expected = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp
                  if (i == 2 .and. w == 2) expected = [1.0_wp, 5.0_wp, 0.0_wp]/6.0_wp
               end if
               part = 0.0_wp
               associate (list => segment%slide(findloc(segment%node, 10 + i, 1)))
                  do j = 1, size(list%point)
                     do m = 1, 2
                        associate (node => list%point(j)%node(m) - 10)
                           if (node < 1 .or. node > 3) cycle
                           if (m == 2 .and. list%point(j)%node(1) == list%point(j)%node(2)) cycle
                           part(node) = part(node) + list%point(j)%weight*list%point(j)%share(m)
                        end associate
                     end do
                  end do
               end associate
               call check_near(error, part, expected, tol, 1.0_wp, "multiplier " // to_text(k) &
                  // ", way " // to_text(w) // ", node " // to_text(i))
            end do
            deallocate(still)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_slips

end module test_segment
