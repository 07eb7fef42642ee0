!> What a slave point sees along the normals of its edge: rays, lines and curves by plain geometry.
module test_mortar_frame
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : end_rounding, frame_cover, frame_hit, frame_init, frame_lean, &
      frame_meet, frame_point, frame_project, frame_t, local_master, n_place, pair_stencil_t, &
      place_after, place_before, place_first, place_last
   use emcon_rounded, only : rounded_clip
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_mortar_frame

   real(wp), parameter :: tol = 512.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_mortar_frame(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rays meet the master edge, or its curve", test_hit), &
         test_case_t("nodes that project to the slave edge", test_project), &
         test_case_t("ends of segments near those of the edge", test_meet), &
         test_case_t("past the ends of the edge the neighbours", test_point), &
         test_case_t("roots of cubics that fall", test_root)]
   end subroutine collect_mortar_frame

   !> A slave edge of about 2 between bent neighbours, and four master nodes that run against it
   !> about 1/2 below.
   subroutine make_pair(x, stencil)
      real(wp), intent(out) :: x(2, n_place)
      type(pair_stencil_t), intent(out) :: stencil

      call shake(x, 0.2_wp)
      x(1, [place_before, place_first, place_last, place_after]) = x(1, [place_before, &
         place_first, place_last, place_after]) + [-2.0_wp, 0.0_wp, 2.0_wp, 4.0_wp]
      x(2, local_master) = x(2, local_master) - 0.5_wp
      x(1, local_master) = x(1, local_master) + [1.75_wp, 0.75_wp, 3.0_wp, -1.0_wp]
      stencil%node = 1
      stencil%tangent = reshape([place_last, place_before, place_after, place_first], [2, 2])
      stencil%weight = [0.25_wp, 0.3_wp]
      stencil%n_master = 4
   end subroutine make_pair

   !> The slave point and its tangent.
   pure subroutine look(x, stencil, xi, at, t)
      real(wp), intent(in) :: x(2, n_place)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: xi
      real(wp), intent(out) :: at(2), t(2)

      at = x(:, place_first) + xi*(x(:, place_last) - x(:, place_first))
      associate (w => stencil%weight)
         t = (1.0_wp - xi)*w(1)*(x(:, place_last) - x(:, place_before)) &
            + xi*w(2)*(x(:, place_after) - x(:, place_first))
      end associate
   end subroutine look

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

   !> The place on the master lies on the ray, at the height of the gap; on the curve too, which
   !> goes on straight past its ends. The ray leans over both edges by the sines of the angles
   !> there.
   subroutine test_hit(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: x(2, n_place), at(2), t(2), place(2), xi, eta, gap, inner, lean(2), edge(2)
      real(wp) :: power(0:3), slope(0:3)
      integer :: case, n_past

      n_past = 0
      do case = 1, 200
         call make_pair(x, stencil)
         stencil%is_smooth = mod(case, 2) == 0
         ! Values at both ends, and slopes by nodes on both sides, which fall together.
         stencil%shape = reshape([1.0_wp, -0.9_wp, 0.0_wp, -0.1_wp, 0.0_wp, 0.9_wp, 0.0_wp, &
            0.1_wp, 0.0_wp, -0.05_wp, 0.1_wp, -0.05_wp, 0.0_wp, 0.05_wp, -0.1_wp, 0.05_wp], [4, 4])
         call draw_random(xi)
         call frame_init(frame, stencil, x)
         call frame_hit(frame, stencil, xi, eta, gap)
         call look(x, stencil, xi, at, t)
         inner = max(0.0_wp, min(1.0_wp, eta))
         power = [1.0_wp, inner, inner**2, inner**3]
         slope = [0.0_wp, 1.0_wp, 2.0_wp*inner, 3.0_wp*inner**2]
         if (stencil%is_smooth) then
            place = matmul(x(:, local_master), matmul(transpose(stencil%shape), power &
               + (eta - inner)*slope))
         else
            place = x(:, local_master(1)) + eta*(x(:, local_master(2)) - x(:, local_master(1)))
         end if
         if (abs(eta - inner) > 0.0_wp) n_past = n_past + 1
         call check_near(error, [dot_product(place - at, t), cross(place - at, t)/norm2(t)], &
            [0.0_wp, gap], tol, 4.0_wp, "case " // to_text(case))
         call frame_lean(frame, xi, lean(1), lean(2))
         edge = x(:, place_last) - x(:, place_first)
         call check_near(error, lean(1), sin(atan2(cross(edge, t), dot_product(edge, t))), tol, &
            1.0_wp, "over the slave edge")
         edge = x(:, local_master(2)) - x(:, local_master(1))
         call check_near(error, lean(2), -sin(atan2(cross(edge, t), dot_product(edge, t))), tol, &
            1.0_wp, "over the master edge")
         call check_near(error, frame%length, norm2(x(:, place_last) - x(:, place_first)), tol, &
            1.0_wp, "length")
         if (allocated(error)) return
      end do
      call check_true(error, n_past > 30 .and. n_past < 170, "past the ends: " // to_text(n_past))
   end subroutine test_hit

   !> A master node lies on the ray of the place to which it projects; past the ends along the
   !> normal there.
   subroutine test_project(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: x(2, n_place), at(2), t(2), s, edge(2)
      integer :: case, k, seen(3)

      seen = 0
      do case = 1, 100
         call make_pair(x, stencil)
         call frame_init(frame, stencil, x)
         edge = x(:, place_last) - x(:, place_first)
         do k = 1, 4
            s = frame_project(frame, k)
            call look(x, stencil, max(0.0_wp, min(1.0_wp, s)), at, t)
            at = at + (s - max(0.0_wp, min(1.0_wp, s)))*edge
            call check_near(error, dot_product(x(:, local_master(k)) - at, t), 0.0_wp, tol, &
               4.0_wp, "node " // to_text(k) // " of case " // to_text(case))
            associate (where => merge(1, merge(2, 3, s <= 1.0_wp), s < 0.0_wp))
               seen(where) = seen(where) + 1
            end associate
         end do
         stencil%node(local_master(3)) = 0
         call frame_init(frame, stencil, x)
         call check_near(error, [frame%along(:, 3), frame%above(:, 3)], spread(0.0_wp, 1, 4), &
            0.0_wp, 1.0_wp, "no node")
      end do
      call check_true(error, all(seen > 20), "before, over and behind")
   end subroutine test_project

   !> A master node that stands over a place near an end: along the field that bends there. Outside
   !> of the bands it is where it projects to.
   subroutine test_meet(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: x(2, n_place), at(2), t(2), u, s, low, high, beside(2)
      integer :: case, n_within

      n_within = 0
      do case = 1, 200
         call make_pair(x, stencil)
         call draw_random(u)
         s = 2.0_wp*end_rounding*(u - 0.25_wp)
         if (mod(case, 2) == 0) s = 1.0_wp - s
         if (mod(case, 5) == 0) s = 0.05_wp + 0.9_wp*u
         call look(x, stencil, max(0.0_wp, min(1.0_wp, s)), at, t)
         at = x(:, place_first) + s*(x(:, place_last) - x(:, place_first))
         x(:, local_master(1)) = at + 0.5_wp*[t(2), -t(1)]/norm2(t)
         call frame_init(frame, stencil, x)
         s = frame_meet(frame, 1)
         at = x(:, place_first) + s*(x(:, place_last) - x(:, place_first))
         associate (z => rounded_clip(s, end_rounding))
            call look(x, stencil, z, beside, t)
            call check_near(error, dot_product(x(:, local_master(1)) - at, t), 0.0_wp, tol, &
               4.0_wp, "case " // to_text(case))
            call frame_cover(frame, low, high)
            call check_near(error, [low, high], [rounded_clip(frame_meet(frame, 2), &
               end_rounding), z], 0.0_wp, 1.0_wp, "what is covered")
            if (abs(z - s) > 0.0_wp .and. z > 0.0_wp .and. z < 1.0_wp) n_within = n_within + 1
         end associate
         if (allocated(error)) return
      end do
      call check_true(error, n_within > 40, "bent: " // to_text(n_within))
   end subroutine test_meet

   !> Where a ray goes past an end of the master edge it meets the line of the neighbour, if there
   !> is one.
   subroutine test_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: x(2, n_place), at(2), t(2), xi, eta, gap, a(2), b(2)
      integer :: case, seen(3)

      seen = 0
      do case = 1, 200
         call make_pair(x, stencil)
         stencil%rounding = sqrt(tiny(1.0_wp))
         if (mod(case, 3) == 0) stencil%node(local_master(3)) = 0
         if (mod(case, 5) == 0) stencil%node(local_master(4)) = 0
         call draw_random(xi)
         call frame_init(frame, stencil, x)
         call frame_point(frame, stencil, xi, eta, gap)
         call look(x, stencil, xi, at, t)
         a = x(:, local_master(1))
         b = x(:, local_master(2))
         if (eta < 0.0_wp .and. mod(case, 3) /= 0) a = x(:, local_master(3))
         if (eta < 0.0_wp .and. mod(case, 3) /= 0) b = x(:, local_master(1))
         if (eta > 1.0_wp .and. mod(case, 5) /= 0) a = x(:, local_master(2))
         if (eta > 1.0_wp .and. mod(case, 5) /= 0) b = x(:, local_master(4))
         a = a + dot_product(at - a, t)/dot_product(b - a, t)*(b - a)
         call check_near(error, gap, cross(a - at, t)/norm2(t), tol, 4.0_wp, "case " &
            // to_text(case))
         associate (where => merge(1, merge(2, 3, eta <= 1.0_wp), eta < 0.0_wp))
            seen(where) = seen(where) + 1
         end associate
      end do
      call check_true(error, all(seen > 10), "before, over and behind")
   end subroutine test_point

   !> A flat edge whose master nodes stand at the coefficients of a cubic: its root, also where it
   !> is nearly level elsewhere and Newton's method leaves the bounds.
   subroutine test_root(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame
      real(wp) :: x(2, n_place), u(4), c(0:3), eta, gap, level, root, bend
      integer :: case, k

      stencil%node = 1
      stencil%tangent = spread([place_last, place_first], 2, 2)
      stencil%weight = 1.0_wp
      stencil%n_master = 4
      stencil%is_smooth = .true.
      stencil%shape = reshape([((merge(1.0_wp, 0.0_wp, k == mod(case, 5)), case = 0, 3), k = 0, &
         3)], [4, 4])
      x = 0.0_wp
      x(1, place_last) = 1.0_wp
      do case = 1, 400
         call draw_random(u)
         bend = 10.0_wp*u(1)
         level = 10.0_wp**(-6.0_wp*u(2))
         root = u(3)
         ! The slope is -bend (eta - p)^2 - level.
         associate (p => u(4))
            c(1:) = [-(bend*p**2 + level), bend*p, -bend/3.0_wp]
            c(0) = -root*(c(1) + root*(c(2) + root*c(3)))
            x(1, local_master) = c
            call frame_init(frame, stencil, x)
            call frame_hit(frame, stencil, 0.0_wp, eta, gap)
            call check_near(error, eta, root, tol*(1.0_wp + bend)/(bend*(root - p)**2 + level), &
               1.0_wp, "case " // to_text(case))
         end associate
      end do
   end subroutine test_root

end module test_mortar_frame
