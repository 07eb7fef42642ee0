!> When surfaces in space touch that move along given ways: in closed form, and by looks at many
!> times.
module test_first_touch_space
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_first_touch, only : touch_time
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_first_touch_space

   real(wp), parameter :: gap = 0.0927_wp, tol = 256.0_wp*epsilon(1.0_wp)
   !> Nodes of the lower block.
   integer, parameter :: n_below = 18

contains

   subroutine collect_first_touch_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("faces that grow and shrink on the way", test_stretch), &
         test_case_t("a block that comes aslant, and one that leaves", test_aslant), &
         test_case_t("a fast block far away", test_far), &
         test_case_t("blocks that bend on their way, against a look at all times", test_bent)]
   end subroutine collect_first_touch_space

   !> A block of 2 x 2 x 1 cells on z = 0, 2 wide, and one of as many cells above the middle of it.
   subroutine begin(scene, name)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name       !! C3D4, C3D8
      type(surface_t) :: surface
      integer :: k

      call space_begin(scene)
      call add_box(scene, name, [-1.0_wp, -1.0_wp, -1.0_wp], [2.0_wp, 2.0_wp, 1.0_wp], [2, 2, 1])
      call add_box(scene, name, [-0.5_wp, -0.5_wp, gap], [1.0_wp, 1.0_wp, 0.5_wp], [2, 2, 1])
      surface = skin(scene)
      scene%surface = [surface, surface]
      do k = 1, 2
         associate (own => (scene%element%node(1, surface%element) <= n_below) .eqv. k == 1)
            scene%surface(k)%element = pack(surface%element, own)
            scene%surface(k)%face = pack(surface%face, own)
         end associate
      end do
      scene%pair = [contact_pair_t(slave=2, master=1)]
   end subroutine begin

   !> The lower block rises by 1 a time and is stretched along and across its top.
   subroutine test_stretch(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rate(5) = [0.0_wp, 0.5_wp, -0.5_wp, 4.0_wp, -4.0_wp]
      character(len=4), parameter :: name(2) = ["C3D8", "C3D4"]
      type(scene_t) :: scene
      real(wp), allocatable :: way(:, :)
      real(wp) :: offset
      integer :: k, i

      do i = 1, size(name)
         call begin(scene, name(i))
         if (allocated(way)) deallocate(way)
         allocate(way, source=0.0_wp*scene%x)
         do k = 1, 2*size(rate)
            offset = merge(0.03_wp, 0.0_wp, k > size(rate))
            scene%pair(1)%interaction%offset = offset
            way(1, :n_below) = rate(1 + mod(k - 1, size(rate)))*scene%x(1, :n_below)
            way(2, :n_below) = -0.25_wp*way(1, :n_below) + 0.1_wp
            way(3, :n_below) = 1.0_wp
            call check_near(error, touch_time(scene, 1, scene%x, way), gap - offset, tol, gap, &
               name(i) // ", case " // to_text(k))
         end do
      end do
   end subroutine test_stretch

   !> The lowest corner of a tilted block, over the ground and past its end; none where it leaves.
   subroutine test_aslant(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slope = 0.25_wp, speed = 2.0_wp
      type(scene_t) :: scene
      real(wp), allocatable :: way(:, :)
      integer :: n

      call begin(scene, "C3D8")
      allocate(way, source=0.0_wp*scene%x)
      n = n_below + 1
      scene%x(3, n:) = scene%x(3, n:) + slope*(scene%x(1, n:) + scene%x(2, n:) &
         - sum(scene%x(:2, n)))
      way(1, n:) = 0.1_wp
      way(3, n:) = -speed
      call check_near(error, touch_time(scene, 1, scene%x, way), gap/speed, tol, gap, "its corner")
      call check_true(error, touch_time(scene, 1, scene%x, -way) >= huge(gap), "it leaves")
      scene%x(1, n:) = scene%x(1, n:) - 4.0_wp
      call check_true(error, touch_time(scene, 1, scene%x, way) >= huge(gap), "it passes by")
   end subroutine test_aslant

   !> So far that the first spans of time see nothing, as of a body that drops from high above.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp), allocatable :: way(:, :)
      real(wp), parameter :: far = 1000.0_wp, speed = 0.001_wp

      call begin(scene, "C3D8")
      allocate(way, source=0.0_wp*scene%x)
      scene%x(:, n_below + 1:) = scene%x(:, n_below + 1:) + spread([0.0_wp, far, far], 2, n_below)
      way(2:, n_below + 1:) = -speed
      call check_near(error, touch_time(scene, 1, scene%x, way), (far + gap)/speed, tol, far/speed, &
         "in the end")
   end subroutine test_far

   !> Each node goes its own way: the first time at which one of either side passes a part of a face
   !> of the other one from outside, by the sign of the volume between them; in any unit.
   subroutine test_bent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: longest = 2.0_wp, units(2) = [1.0_wp/32.0_wp, 8.0_wp]
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: x(:, :), way(:, :)
      real(wp) :: u(3), first, unit, found
      integer :: case, side, f, n_touch

      n_touch = 0
      do case = 1, 24
         unit = units(1 + mod(case, 2))
         call begin(scene, "C3D8")
         allocate(x, way, source=scene%x)
         call shake(x, 0.05_wp)
         call shake(way, 0.1_wp)
         call draw_random(u)
         x = unit*(x + scene%x)
         way(:2, n_below + 1:) = way(:2, n_below + 1:) + 2.0_wp*spread(u(:2) - 0.5_wp, 2, n_below)
         way(3, n_below + 1:) = way(3, n_below + 1:) + u(3) - 0.6_wp
         way = unit*way
         first = huge(first)
         do side = 1, 2
            call facets_init(facets, scene, scene%surface(side), error)
            if (allocated(error)) return
            do f = 1, facets%n_facet
               call look(facets%facet(:4, f), merge(0, n_below, side == 2))
            end do
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
      call check_true(error, n_touch > 6 .and. n_touch < 20, "touches: " // to_text(n_touch))

   contains

      !> The nodes after `before` and a face of four nodes.
      subroutine look(face, before)
         integer, intent(in) :: face(4), before
         integer, parameter :: n_time = 100
         real(wp) :: low, high, middle, now, after
         integer :: node, k, m, j

         do node = before + 1, before + n_below
            do j = 1, 4
               after = volume(node, face, j, 0.0_wp)
               do k = 1, n_time
                  now = after
                  after = volume(node, face, j, longest*k/n_time)
                  if (.not. (now > 0.0_wp .and. after <= 0.0_wp)) cycle
                  low = longest*(k - 1)/n_time
                  high = longest*k/n_time
                  do m = 1, digits(first)
                     middle = 0.5_wp*(low + high)
                     if (volume(node, face, j, middle) > 0.0_wp) then
                        low = middle
                     else
                        high = middle
                     end if
                  end do
                  if (is_over(node, face, j, high)) first = min(first, high)
               end do
            end do
         end do
      end subroutine look

      !> Part `j` of a face about its centre, at a time, from the node on.
      function part(node, face, j, time) result(p)
         integer, intent(in) :: node, face(4), j
         real(wp), intent(in) :: time
         real(wp) :: p(3, 3), all(3, 4)

         all = x(:, face) + time*way(:, face)
         p(:, 1) = all(:, j)
         p(:, 2) = all(:, 1 + mod(j, 4))
         p(:, 3) = 0.25_wp*sum(all, 2)
         p = (p - spread(x(:, node) + time*way(:, node), 2, 3))/unit
      end function part

      real(wp) function volume(node, face, j, time)
         integer, intent(in) :: node, face(4), j
         real(wp), intent(in) :: time
         real(wp) :: p(3, 3)

         p = part(node, face, j, time)
         volume = -dot_product(p(:, 1), cross_product(p(:, 2), p(:, 3)))
      end function volume

      logical function is_over(node, face, j, time)
         integer, intent(in) :: node, face(4), j
         real(wp), intent(in) :: time
         real(wp) :: p(3, 3), n(3)

         p = part(node, face, j, time)
         n = cross_product(p(:, 2) - p(:, 1), p(:, 3) - p(:, 1))
         is_over = min(dot_product(n, cross_product(p(:, 1), p(:, 2))), &
            dot_product(n, cross_product(p(:, 2), p(:, 3))), &
            dot_product(n, cross_product(p(:, 3), p(:, 1)))) >= -1.0e-3_wp*dot_product(n, n)
      end function is_over

   end subroutine test_bent

end module test_first_touch_space
