!> When surfaces touch that move along given ways, in closed form.
module test_first_touch
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_first_touch_plane, only : touch_time
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_first_touch

   real(wp), parameter :: gap = 0.0927_wp, tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_first_touch(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("edges that grow and shrink on the way", test_stretch), &
         test_case_t("a block that comes aslant, and one that leaves", test_aslant), &
         test_case_t("bent blocks that bend on their way, against a look at all times", test_bent)]
   end subroutine collect_first_touch

   !> The lower block rises by 1 a time and is stretched along its top at a rate s: the area between
   !> a node above and an edge is (gap - t)(1 + s t), with a second root after or before.
   subroutine test_stretch(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rate(5) = [0.0_wp, 0.5_wp, -0.5_wp, 4.0_wp, -4.0_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: way(:, :)
      real(wp) :: offset
      integer :: k

      call make_two_blocks(scene, gap, lower, upper)
      allocate(way, source=0.0_wp*scene%x)
      do k = 1, 2*size(rate)
         offset = merge(0.03_wp, 0.0_wp, k > size(rate))
         scene%pair(1)%interaction%offset = offset
         way(1, :10) = rate(1 + mod(k - 1, size(rate)))*scene%x(1, :10)
         way(2, :10) = 1.0_wp
         call check_near(error, touch_time(scene, 1, scene%x, way), gap - offset, tol, gap, &
            "case " // to_text(k))
      end do
   end subroutine test_stretch

   !> The lowest corner of a tilted block, over the ground and past its end; none where it leaves.
   subroutine test_aslant(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slope = 0.25_wp, speed = 2.0_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: way(:, :)

      call make_two_blocks(scene, gap, lower, upper)
      allocate(way, source=0.0_wp*scene%x)
      scene%x(2, 11:) = scene%x(2, 11:) + slope*(scene%x(1, 11:) - scene%x(1, 11))
      way(1, 11:) = 0.5_wp
      way(2, 11:) = -speed
      call check_near(error, touch_time(scene, 1, scene%x, way), gap/speed, tol, gap, "its corner")
      call check_true(error, touch_time(scene, 1, scene%x, -way) >= huge(gap), "it leaves")
      scene%x(1, 11:) = scene%x(1, 11:) - 4.0_wp
      call check_true(error, touch_time(scene, 1, scene%x, way) >= huge(gap), "it passes by")
      ! Its side, which leans by the slope, comes down onto the end of the ground.
      scene%x(1, 11:) = scene%x(1, 11:) + 2.0_wp
      call check_near(error, touch_time(scene, 1, scene%x, way), fall(), tol, gap, "the ground's end")

   contains

      !> Of the bottom's line above the end of the ground, at (-2, 0): it falls by the slope too.
      pure real(wp) function fall()
         fall = (gap + slope*(-2.0_wp - scene%x(1, 11)))/(speed + 0.5_wp*slope)
      end function fall

   end subroutine test_aslant

   !> Each node goes its own way: the first time at which one of either side passes an edge of the
   !> other one from outside, by the sign of the area between them at many times; in any unit.
   subroutine test_bent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: longest = 2.0_wp, units(2) = [1.0_wp/32.0_wp, 8.0_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp), allocatable :: x(:, :), way(:, :)
      real(wp) :: u(2), first, unit, found
      integer :: case, i, n_touch

      n_touch = 0
      do case = 1, 60
         unit = units(1 + mod(case, 2))
         call make_two_blocks(scene, 0.3_wp, lower, upper)
         scene%pair(1)%interaction%offset = merge(0.05_wp, 0.0_wp, mod(case, 3) == 0)*unit
         allocate(x, way, source=scene%x)
         call shake(x, 0.1_wp)
         call shake(way, 0.4_wp)
         call draw_random(u)
         x = unit*(x + scene%x)
         way(1, 11:) = way(1, 11:) + 4.0_wp*(u(1) - 0.5_wp)
         way(2, 11:) = way(2, 11:) + u(2) - 0.4_wp
         way = unit*way
         first = huge(first)
         do i = 1, 4
            call look(11, 13, [6 + i, 5 + i])
         end do
         do i = 1, 2
            call look(6, 10, [10 + i, 11 + i])
         end do
         found = touch_time(scene, 1, x, way)
         if (first < longest) then
            n_touch = n_touch + 1
            call check_near(error, found, first, 1.0e3_wp*tol, longest, "case " // to_text(case))
         else
            call check_true(error, found >= longest, "none, case " // to_text(case))
         end if
         deallocate(x, way)
         if (allocated(error)) return
      end do
      call check_true(error, n_touch > 15 .and. n_touch < 50, "touches: " // to_text(n_touch))

   contains

      !> Nodes `low` to `high` and an edge whose outside is to the right.
      subroutine look(low, high, edge)
         integer, intent(in) :: low, high, edge(2)
         integer, parameter :: n_time = 400
         real(wp) :: before, after, middle, now
         integer :: node, k, m

         do node = low, high
            after = area(node, edge, 0.0_wp)
            do k = 1, n_time
               now = after
               after = area(node, edge, longest*k/n_time)
               if (.not. (now > 0.0_wp .and. after <= 0.0_wp)) cycle
               before = longest*(k - 1)/n_time
               middle = longest*k/n_time
               do m = 1, digits(first)
                  now = 0.5_wp*(before + middle)
                  if (area(node, edge, now) > 0.0_wp) before = now
                  if (.not. area(node, edge, now) > 0.0_wp) middle = now
               end do
               if (abs(share(node, edge, middle) - 0.5_wp) <= 0.501_wp) first = min(first, middle)
            end do
         end do
      end subroutine look

      !> The edge, moved outwards by the layer, and the way to the node, at a time.
      subroutine place(node, edge, time, along, to_node)
         integer, intent(in) :: node, edge(2)
         real(wp), intent(in) :: time
         real(wp), intent(out) :: along(2), to_node(2)

         along = x(:, edge(2)) - x(:, edge(1))
         to_node = x(:, node) - x(:, edge(1)) - scene%pair(1)%interaction%offset*[along(2), &
            -along(1)]/norm2(along) + time*(way(:, node) - way(:, edge(1)))
         along = along + time*(way(:, edge(2)) - way(:, edge(1)))
      end subroutine place

      real(wp) function area(node, edge, time)
         integer, intent(in) :: node, edge(2)
         real(wp), intent(in) :: time
         real(wp) :: a(2), b(2)

         call place(node, edge, time, a, b)
         area = (b(1)*a(2) - b(2)*a(1))/unit**2
      end function area

      real(wp) function share(node, edge, time)
         integer, intent(in) :: node, edge(2)
         real(wp), intent(in) :: time
         real(wp) :: a(2), b(2)

         call place(node, edge, time, a, b)
         share = dot_product(a, b)/dot_product(a, a)
      end function share

   end subroutine test_bent

end module test_first_touch
