!> One element over one step: identity, momenta, tangent, rigid motions, patch, inversion.
module test_element
   use check, only : check_near, check_true, test_case_t
   use emcon_element, only : element_geometry_t
   use emcon_element_plane, only : element_motion_t, element_response_t, point_motion_t, &
      point_strain
   use emcon_errors, only : error_t
   use emcon_host_law, only : host_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_law_registry, only : law_linear
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_init, solid_t
   use emcon_solid_respond, only : solid_element_respond
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use random_draws, only : draw_random
   use small_scenes, only : block_t, make_block, shake, young
   implicit none
   private
   public :: collect_element

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over four points and four nodes, each term of a dozen roundings.
   real(wp), parameter :: tol = 64.0_wp*eps

   !> One distorted element of size 1 with its law.
   type :: sample_t
      character(len=40) :: what = ""
      integer :: n = 0                           !! nodes
      logical :: nlgeom = .false.
      real(wp) :: x(2, 4) = 0.0_wp
      type(solid_t) :: solid
   end type sample_t
   integer, parameter :: n_sample = 12

contains

   subroutine collect_element(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("tangent", test_tangent), &
         test_case_t("tangent is symmetric without motion", test_symmetry), &
         test_case_t("rigid motions cost nothing", test_rigid), &
         test_case_t("patch of one element", test_patch), &
         test_case_t("strain increment of tiny steps", test_strain), &
         test_case_t("inversion is flagged", test_inversion), &
         test_case_t("a guess that flattens or blows up is flagged", test_wild), &
         test_case_t("a stretch whose det C is round-off is flagged", test_degenerate)]
   end subroutine collect_element

   !> Sample 1..12: CPE3 and CPE4, three laws, with and without geometric non-linearity.
   subroutine make_sample(i, sample, error)
      integer, intent(in) :: i
      type(sample_t), intent(out) :: sample
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: i_law, law(3)
      real(wp) :: move(2, 4)

      sample%nlgeom = mod(i, 2) == 0
      sample%n = 3 + mod((i - 1)/2, 2)
      i_law = 1 + (i - 1)/4
      law = [law_linear, law_code("neo hooke"), law_code("coupled neo hooke")]
      sample%what = "CPE" // to_text(sample%n) // ", law " // to_text(i_law) // ", nlgeom " &
         // to_text(merge(1, 0, sample%nlgeom))
      call make_block(scene, "CPE" // to_text(sample%n), [1, 1], block)
      call shake(move, 0.2_wp)
      scene%x = scene%x + move
      scene%material(1)%law = law(i_law)
      if (i_law == 2) scene%material(1)%constant = [0.2_wp*young, 1.0_wp/young]
      sample%x(:, :sample%n) = scene%x(:, scene%element%node(:sample%n, 1))
      call solid_init(sample%solid, scene, error)
   end subroutine make_sample

   subroutine respond(sample, u0, du, with_tangent, response)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: u0(2, 4), du(2, 4)
      logical, intent(in) :: with_tangent
      type(element_response_t), intent(inout) :: response
      type(element_motion_t) :: motion
      type(host_response_t) :: none

      motion%square = merge(1.0_wp, 0.0_wp, sample%nlgeom)
      response = element_response_t()
      motion%from(:, :4) = u0
      motion%by(:, :4) = du
      call solid_element_respond(sample%solid, 1, motion, none, with_tangent, response)
   end subroutine respond

   !> A start up to 10 % off, and a motion of up to 15 % plus, with nlgeom, a turn of 0.7 rad.
   subroutine draw(sample, u0, du)
      type(sample_t), intent(in) :: sample
      real(wp), intent(out) :: u0(2, 4), du(2, 4)
      real(wp) :: angle
      integer :: i

      call shake(u0, 0.1_wp)
      call shake(du, 0.15_wp)
      angle = merge(0.7_wp, 0.0_wp, sample%nlgeom)
      do i = 1, sample%n
         du(:, i) = du(:, i) + turned(angle, sample%x(:, i) + u0(:, i))
      end do
      u0(:, sample%n + 1:) = 0.0_wp
      du(:, sample%n + 1:) = 0.0_wp
   end subroutine draw

   !> Displacement of `x` in a turn about the origin.
   pure function turned(angle, x) result(u)
      real(wp), intent(in) :: angle, x(2)
      real(wp) :: u(2)

      u = [cos(angle)*x(1) - sin(angle)*x(2), sin(angle)*x(1) + cos(angle)*x(2)] - x
   end function turned

   !> f.du = W1 - W0.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: start, step
      real(wp) :: u0(2, 4), du(2, 4), zero(2, 4)
      integer :: i, k

      zero = 0.0_wp
      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         do k = 1, 20
            call draw(sample, u0, du)
            call respond(sample, u0, zero, .false., start)
            call respond(sample, u0, du, .false., step)
            call check_near(error, sum(step%force(:, :4)*du), step%energy - start%energy, tol, &
               sum(step%magnitude(:, :4)*abs(du)), sample%what)
         end do
         if (allocated(error)) return
      end do
   end subroutine test_identity

   !> No net force; no moment on the mid-configuration, without nlgeom on the reference.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4), place(2, 4)
      integer :: i, k

      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         do k = 1, 20
            call draw(sample, u0, du)
            call respond(sample, u0, du, .false., step)
            place = sample%x
            if (sample%nlgeom) place = place + (u0 + 0.5_wp*du)
            call check_near(error, sum(step%force, dim=2), [0.0_wp, 0.0_wp], tol, &
               sum(step%magnitude), sample%what // ": force")
            call check_near(error, sum(place(1, :)*step%force(2, :4) &
               - place(2, :)*step%force(1, :4)), 0.0_wp, tol, sum(step%magnitude) &
               *maxval(abs(place)), sample%what // ": moment")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_momenta

   !> Central differences over four points, of step h = eps^(0.3): an error of order h^4 = eps^(1.2)
   !> and one of eps/h = eps^(0.7).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step, near(2), far(2)
      real(wp) :: u0(2, 4), du(2, 4), way(2, 4), h
      integer :: i, k, node, a, n

      h = eps**0.3_wp
      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         n = sample%n
         do k = 0, 2
            call draw(sample, u0, du)
            du = scale(du, -20*k)
            call respond(sample, u0, du, .true., step)
            do node = 1, n
               do a = 1, 2
                  way = 0.0_wp
                  way(a, node) = h
                  call respond(sample, u0, du + way, .false., near(1))
                  call respond(sample, u0, du - way, .false., near(2))
                  call respond(sample, u0, du + 2.0_wp*way, .false., far(1))
                  call respond(sample, u0, du - 2.0_wp*way, .false., far(2))
                  call check_near(error, step%tangent(:2*n, 2*node - 2 + a), reshape( &
                     (8.0_wp*(near(1)%force(:, :n) - near(2)%force(:, :n)) &
                     - (far(1)%force(:, :n) - far(2)%force(:, :n)))/(12.0_wp*h), [2*n]), &
                     80.0_wp*eps**0.7_wp, young, &
                     sample%what // ", column " // to_text(2*node - 2 + a))
               end do
            end do
         end do
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> At du = 0 the tangent is half of the Hessian of W.
   subroutine test_symmetry(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4)
      integer :: i

      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         call draw(sample, u0, du)
         du = 0.0_wp
         call respond(sample, u0, du, .true., step)
         call check_near(error, step%tangent, transpose(step%tangent), tol, &
            maxval(abs(step%tangent)), sample%what)
         if (allocated(error)) return
      end do
   end subroutine test_symmetry

   !> The strain is round-off of grad u, and the energy of the order of its square.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4)
      integer :: i, k

      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         du = 0.0_wp
         u0(1, :sample%n) = 1.0_wp
         du(2, :sample%n) = -2.0_wp
         call respond(sample, u0, du, .false., step)
         call check_near(error, step%energy, 0.0_wp, tol**2, young, sample%what // ": moved")
         if (.not. sample%nlgeom) cycle
         do k = 1, sample%n
            u0(:, k) = turned(2.0_wp, sample%x(:, k))
            du(:, k) = turned(3.0_wp, sample%x(:, k)) - u0(:, k)
         end do
         call respond(sample, u0, du, .false., step)
         call check_near(error, step%energy, 0.0_wp, tol**2, young, sample%what // ": turned")
         call check_near(error, step%force, 0.0_wp*step%force, tol, young, &
            sample%what // ": forces of a turn")
         if (allocated(error)) return
      end do
   end subroutine test_rigid

   !> Uniform grad u: W(E) times the area, forces P N of the edges.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      type(law_response_t) :: state
      real(wp), parameter :: grad(2, 2) = reshape([0.1_wp, -0.2_wp, 0.3_wp, 0.15_wp], [2, 2])
      real(wp) :: u0(2, 4), zero(2, 4), e(3), f(2, 2), s(2, 2), p(2, 2), expected(2, 4), d(2), area
      integer :: i, k, before, after

      zero = 0.0_wp
      do i = 1, n_sample
         call make_sample(i, sample, error)
         if (allocated(error)) return
         u0 = matmul(grad, sample%x)
         f = grad
         f(1, 1) = 1.0_wp + grad(1, 1)
         f(2, 2) = 1.0_wp + grad(2, 2)
         e = [grad(1, 1), grad(2, 2), grad(1, 2) + grad(2, 1)]
         if (sample%nlgeom) then
            s = matmul(transpose(f), f)
            e = [0.5_wp*(s(1, 1) - 1.0_wp), 0.5_wp*(s(2, 2) - 1.0_wp), s(1, 2)]
         else
            f = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         end if
         call law_response_plane(sample%solid%law(1)%law, e, [0.0_wp, 0.0_wp, 0.0_wp], state)
         s = reshape([state%stress(1), state%stress(3), state%stress(3), state%stress(2)], [2, 2])
         p = matmul(f, s)
         area = 0.0_wp
         expected = 0.0_wp
         do k = 1, sample%n
            before = 1 + modulo(k - 2, sample%n)
            after = 1 + modulo(k, sample%n)
            d = sample%x(:, after) - sample%x(:, before)
            area = area + 0.5_wp*sample%x(1, k)*d(2)
            expected(:, k) = 0.5_wp*matmul(p, [d(2), -d(1)])
         end do
         call respond(sample, u0, zero, .false., step)
         call check_near(error, step%energy, area*state%energy, tol, young, &
            sample%what // ": energy")
         call check_near(error, step%force(:, :4), expected, tol, young, sample%what // ": force")
         if (allocated(error)) return
      end do
   end subroutine test_patch

   !> E1 - E0 to relative accuracy where the difference of the strains has none.
   subroutine test_strain(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: grad0(2, 2), dgrad(2, 2), f(2, 2), expected(2, 2)
      type(point_motion_t) :: point
      integer :: k

      do k = 0, 900, 100
         call shake(grad0, 0.5_wp)
         call shake(dgrad, 0.5_wp)
         dgrad = scale(dgrad, -k)
         f = grad0
         f(1, 1) = f(1, 1) + 1.0_wp
         f(2, 2) = f(2, 2) + 1.0_wp
         expected = matmul(transpose(f), dgrad) + matmul(transpose(dgrad), f) &
            + matmul(transpose(dgrad), dgrad)
         call point_strain(grad0, dgrad, 1.0_wp, point)
         call check_near(error, point%dstrain, [0.5_wp*expected(1, 1), 0.5_wp*expected(2, 2), &
            expected(1, 2)], 8.0_wp*eps, 4.0_wp*maxval(abs(dgrad)), "at 2^-" // to_text(k))
         call check_near(error, point%f_end - point%f_mid, 0.5_wp*dgrad, 2.0_wp*eps, &
            1.0_wp, "F")
      end do
   end subroutine test_strain

   !> The last node pushed through the opposite side; just before it nothing is said.
   subroutine test_inversion(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4)
      integer :: i

      do i = 2, n_sample, 2
         call make_sample(i, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         du = 0.0_wp
         du(:, sample%n) = 0.3_wp*(sample%x(:, 1) - sample%x(:, sample%n))
         call respond(sample, u0, du, .true., step)
         call check_true(error, .not. step%is_inverted, "pressed, but not inverted")
         du(:, sample%n) = 3.0_wp*(sample%x(:, 2) - sample%x(:, sample%n))
         call respond(sample, u0, du, .true., step)
         call check_true(error, step%is_inverted, sample%what // ": inverted")
      end do
   end subroutine test_inversion

   !> Corrections of Newton's method go anywhere. Where det C is lost in the round-off of |C|^2, the
   !> law would take the logarithm of a negative number: random motions of 1e9 elements either
   !> invert the element or give finite forces.
   subroutine test_wild(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4)
      integer :: i, k

      do i = 2, n_sample, 2
         call make_sample(i, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         do k = 1, 200
            call shake(du, 10.0_wp**mod(k, 10))
            if (mod(k, 4) == 0) du(2, :) = 1.0e-6_wp*du(2, :)
            call respond(sample, u0, du, .true., step)
            if (step%is_inverted) cycle
            call check_true(error, abs(step%energy) < huge(1.0_wp) &
               .and. sum(abs(step%force)) < huge(1.0_wp), sample%what // ": finite")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_wild

   !> F = [s, c s; c s, c^2 s + d] with det F = s d, but |F|^2 of the order of s^2: where d/s is
   !> small against epsilon, 1 + 2 e1 + 4 e2 of the law may come out negative.
   subroutine test_degenerate(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, 4), du(2, 4), c, f(2, 2)
      integer :: i, k

      do i = 2, n_sample, 2
         call make_sample(i, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         do k = 1, 400
            call draw_random(c)
            f = 10.0_wp**mod(k, 9)*reshape([1.0_wp, c, c, c*c], [2, 2])
            f(2, 2) = f(2, 2) + 10.0_wp**(-mod(k, 17))
            du = matmul(f, sample%x) - sample%x
            call respond(sample, u0, du, .true., step)
            if (step%is_inverted) cycle
            call check_true(error, abs(step%energy) < huge(1.0_wp) &
               .and. sum(abs(step%force)) < huge(1.0_wp), sample%what // ": finite")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_degenerate

end module test_element
