!> What elements with corners alone miss of bending: closed forms of a beam, whichever way it lies.
module test_bending
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_bending, only : bending_measure, bending_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_init, solid_t
   use emcon_text, only : to_text
   use small_scenes, only : block_t, make_block, poisson, young
   implicit none
   private
   public :: collect_bending

   !> Axes are found in double precision, whatever the state is.
   real(wp), parameter :: tol = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Cells of the beam, their sizes, curvature.
   integer, parameter :: n = 5
   real(wp), parameter :: a = 0.5_wp, b = 0.25_wp, curvature = 0.01_wp
   !> Directions in which no neighbours lie lessen the curvature by so much.
   real(wp), parameter :: lessened = 1.0_wp/1.001_wp

contains

   subroutine collect_bending(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a beam of quadrilaterals in closed form", test_beam), &
         test_case_t("a beam of parallelograms in closed form", test_slanted), &
         test_case_t("whichever way it lies and turns", test_turned), &
         test_case_t("body by body", test_bodies)]
   end subroutine collect_bending

   pure function rotation(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(2, 2)

      r = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
   end function rotation

   !> A beam along the direction of `angle`, bent, and turned by `turn` about the origin.
   subroutine make_beam(scene, name, rows, angle, turn, u)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: rows
      real(wp), intent(in) :: angle, turn
      real(wp), allocatable, intent(out) :: u(:, :)
      type(block_t) :: block

      call make_block(scene, name, [n, rows], block)
      scene%x(1, :) = a*scene%x(1, :)
      scene%x(2, :) = b*(scene%x(2, :) - 0.5_wp*rows)
      u = scene%x
      u(1, :) = -curvature*scene%x(1, :)*scene%x(2, :)
      u(2, :) = 0.5_wp*curvature*scene%x(1, :)**2
      scene%x = matmul(rotation(angle), scene%x)
      u = matmul(rotation(angle), u)
      u = matmul(rotation(turn), scene%x + u) - scene%x
   end subroutine make_beam

   subroutine measure(scene, u, nlgeom, bending, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)
      logical, intent(in) :: nlgeom
      type(bending_t), intent(out) :: bending
      type(error_t), allocatable, intent(out) :: error
      type(solid_t) :: solid

      call solid_init(solid, scene, error)
      if (allocated(error)) return
      call bending_measure(bending, solid, spread(1, 1, size(u, 2)), scene%x, u, nlgeom)
   end subroutine measure

   !> Strains along it, -k y, whose mean square is k^2 b^2/12; in place of the strain across it,
   !> -lambda/(lambda + 2 mu) of that, none; and shear with the mean square k^2 a^2/12.
   subroutine test_beam(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = young/(2.0_wp*(1.0_wp + poisson))
      real(wp), parameter :: lambda = 2.0_wp*mu*poisson/(1.0_wp - 2.0_wp*poisson)
      real(wp), parameter :: part = 0.5_wp*curvature**2/12.0_wp*n*a*b
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: u(:, :)

      call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
      call measure(scene, u, .false., bending, error)
      if (allocated(error)) return
      call check_equal(error, bending%element, [1], "first element")
      call check_near(error, bending%strain, [part*((lambda + 2.0_wp*mu)*b**2 + mu*a**2)], tol, &
         bending%strain(1), "strain energy")
      call check_near(error, bending%missed, [lessened**2*part*(lambda**2/(lambda + 2.0_wp*mu) &
         *b**2 + mu*a**2)], tol, bending%missed(1), "missed")
      call measure(scene, 0.0_wp*u, .false., bending, error)
      if (allocated(error)) return
      call check_near(error, [bending%strain, bending%missed], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "at rest")
   end subroutine test_beam

   !> Cells whose sides across lean by the shift 2 c over the thickness. With -1 < p, q < 1 along
   !> the sides nodes take k p q (-a b/4, a c/2) of a plate, which strains along itself alone.
   subroutine test_slanted(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = young/(2.0_wp*(1.0_wp + poisson))
      real(wp), parameter :: lambda = 2.0_wp*mu*poisson/(1.0_wp - 2.0_wp*poisson)
      real(wp), parameter :: c = 0.1_wp, ratio = lambda/(lambda + 2.0_wp*mu)
      !> Mean squares, per square of the curvature: the strain across that is too much, and shear.
      real(wp), parameter :: across = ((a*c/b)**2 + (2.0_wp*c**2/b + 0.5_wp*ratio*b)**2)/3.0_wp, &
         shear = (0.25_wp*a**2 + 4.0_wp*c**2)/3.0_wp
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: u(:, :)
      integer :: k
      real(wp) :: angle

      do k = 0, 3
         angle = 0.7_wp*k
         call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
         scene%x(1, :) = scene%x(1, :) + (2.0_wp*c/b)*scene%x(2, :)
         u(1, :) = -curvature*scene%x(1, :)*scene%x(2, :)
         u(2, :) = 0.5_wp*curvature*scene%x(1, :)**2
         scene%x = matmul(rotation(angle), scene%x)
         u = matmul(rotation(angle), u)
         call measure(scene, u, .false., bending, error)
         if (allocated(error)) return
         call check_near(error, bending%missed, [0.5_wp*(lessened*curvature)**2*n*a*b &
            *((lambda + 2.0_wp*mu)*across + mu*shear)], tol, bending%missed(1), "missed")
      end do
   end subroutine test_slanted

   !> Energies do not change as the beam lies another way, nor, with large rotations, as it turns.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: name(3) = [character(len=5) :: "CPE4", "CPE3", "CPE4"]
      real(wp), parameter :: angles(3) = [0.3_wp, 1.2_wp, -2.0_wp]
      type(scene_t) :: scene
      type(bending_t) :: bending, other
      real(wp), allocatable :: u(:, :)
      integer :: k, i

      do k = 1, 3
         call make_beam(scene, trim(name(k)), merge(2, 1, k == 3), 0.0_wp, 0.0_wp, u)
         call measure(scene, u, .true., bending, error)
         if (allocated(error)) return
         call check_true(error, bending%missed(1) > 0.1_wp*bending%strain(1) .and. &
            bending%strain(1) > 0.0_wp, "it is bent")
         do i = 1, size(angles)
            call make_beam(scene, trim(name(k)), merge(2, 1, k == 3), angles(i), 0.7_wp*i, u)
            call measure(scene, u, .true., other, error)
            if (allocated(error)) return
            call check_near(error, [other%strain, other%missed], [bending%strain, &
               bending%missed], tol/curvature**2, bending%strain(1), trim(name(k)) &
               // ", way " // to_text(i))
         end do
      end do
   end subroutine test_turned

   !> The second of two beams is at rest; what belongs to no body is none, rigid ones do not strain.
   subroutine test_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(bending_t) :: bending, alone
      real(wp), allocatable :: u(:, :)
      integer :: body(2*(n + 1))

      call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
      call measure(scene, u, .false., alone, error)
      if (allocated(error)) return
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      body = 2
      call bending_measure(bending, solid, body, scene%x, u, .false.)
      call check_equal(error, bending%element, [0, 1], "elements")
      call check_near(error, [bending%strain, bending%missed], [0.0_wp, alone%strain(1), 0.0_wp, &
         alone%missed(1)], tol, alone%strain(1), "of the second body")
      body = 0
      call bending_measure(bending, solid, body, scene%x, u, .false.)
      call check_equal(error, size(bending%strain), 0, "of none")
      body = 1
      solid%trait%is_rigid(1) = .true.
      call bending_measure(bending, solid, body, scene%x, u, .false.)
      call check_equal(error, bending%element, [2], "but for the rigid one")
      call check_near(error, bending%strain, alone%strain*(n - 1)/n, tol, alone%strain(1), &
         "four of five")
      solid%trait%is_stiff_bent = .false.
      call bending_measure(bending, solid, body, scene%x, u, .false.)
      call check_near(error, bending%missed, [0.0_wp], 0.0_wp, 1.0_wp, "elements that follow")
   end subroutine test_bodies

end module test_bending
