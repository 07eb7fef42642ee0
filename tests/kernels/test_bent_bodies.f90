!> Bodies that are told to be too stiff where they bend: which, from which part of their energy on.
module test_bent_bodies
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_bending, only : bending_measure, bending_t
   use emcon_bent_bodies, only : bent_body_find, bent_body_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_term_registry, only : terms_solid
   use small_scenes, only : add_block, add_step, block_t, poisson, scene_begin
   implicit none
   private
   public :: collect_bent_bodies

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Elements along a beam, their height, curvature.
   integer, parameter :: n = 5
   real(wp), parameter :: height = 0.25_wp, curvature = 0.01_wp

contains

   subroutine collect_bent_bodies(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("more than a fifth of its energy", test_share), &
         test_case_t("the first of several", test_first), &
         test_case_t("not where nothing is strained, or no step runs", test_none)]
   end subroutine collect_bent_bodies

   !> Two beams of one row of elements of length(k) each, at rest.
   subroutine begin(scene, march, length, error)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      real(wp), intent(in) :: length(2)
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: beam
      integer :: k

      call scene_begin(scene)
      do k = 1, 2
         call add_block(scene, "CPE4", [n, 1], [0.0_wp, 2.0_wp*k], [n*length(k), height], beam)
      end do
      scene%element%label = scene%element%label + 100
      call add_step(scene, .false., 0.01_wp, 10)
      scene%step(1)%nlgeom = .false.
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> Bend both beams, the k-th with curvature(k).
   pure subroutine bend(scene, curvatures, u)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: curvatures(2)
      real(wp), intent(out) :: u(:, :)           !! (2, n_node)
      integer :: i, k

      do i = 1, size(u, 2)
         k = merge(1, 2, scene%x(2, i) < 3.0_wp)
         u(1, i) = -curvatures(k)*scene%x(1, i)*(scene%x(2, i) - 2.0_wp*k - 0.5_wp*height)
         u(2, i) = 0.5_wp*curvatures(k)*scene%x(1, i)**2
      end do
   end subroutine bend

   !> Strains -k y along elements of length a and height b cost (lambda + 2 mu) b^2 + mu a^2, of
   !> which a beam would not have lambda^2/(lambda + 2 mu) b^2 + mu a^2.
   subroutine test_share(error)
      type(error_t), allocatable, intent(out) :: error
      !> By mu: lambda + 2 mu, and what is missed across.
      real(wp), parameter :: lambda = 2.0_wp*poisson/(1.0_wp - 2.0_wp*poisson), &
         along = lambda + 2.0_wp, across = lambda**2/(lambda + 2.0_wp)
      !> The part that is missed; neighbours lie in one direction alone, which lessens it.
      real(wp), parameter :: share(4) = [0.195_wp, 0.205_wp, 0.3_wp, 0.6_wp]
      type(scene_t) :: scene
      type(march_t) :: march
      type(bent_body_t) :: found
      real(wp) :: part, length
      integer :: k

      do k = 1, size(share)
         part = share(k)*1.001_wp**2
         length = height*sqrt((part*along - across)/(1.0_wp - part))
         call begin(scene, march, [length, length], error)
         if (allocated(error)) return
         call bend(scene, [curvature, 0.0_wp], march%state%u)
         call bent_body_find(march, scene, 0.0_wp, found)
         call check_equal(error, found%body, merge(1, 0, share(k) > 0.2_wp), "told")
         call check_true(error, (len(found%advice) > 0) .eqv. share(k) > 0.2_wp, "advice")
         if (share(k) > 0.2_wp) then
            call check_near(error, found%percent, 100.0_wp*share(k), 1.0e4_wp*eps, 100.0_wp, &
               "per cent")
            call check_equal(error, found%label, 101, "its first element")
         end if
         call march_free(march)
         march = march_t()
         if (allocated(error)) return
      end do
   end subroutine test_share

   !> The second of two beams is bent; both are.
   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(bent_body_t) :: found
      type(bending_t) :: bending
      type(solid_t), pointer :: solid

      call begin(scene, march, [height, 2.0_wp*height], error)
      if (allocated(error)) return
      solid => terms_solid(march%system%term)
      call bend(scene, [0.0_wp, curvature], march%state%u)
      call bent_body_find(march, scene, 0.0_wp, found)
      call bending_measure(bending, solid, march%system%space%body, scene%x, march%state%u, 0.0_wp)
      call check_equal(error, [found%body, found%label], [2, 101 + n], "the second")
      call check_near(error, found%percent, 100.0_wp*bending%missed(2)/bending%strain(2), &
         8.0_wp*eps, found%percent, "per cent of it")
      call bend(scene, [0.5_wp*curvature, curvature], march%state%u)
      call bent_body_find(march, scene, 0.0_wp, found)
      call check_equal(error, [found%body, found%label], [1, 101], "both")
      call march_free(march)
   end subroutine test_first

   !> A strain energy that is round-off of the largest energy of the run; no step; elements that
   !> follow.
   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(bent_body_t) :: found
      type(bending_t) :: bending
      type(solid_t), pointer :: solid
      integer :: k

      call begin(scene, march, [height, height], error)
      if (allocated(error)) return
      solid => terms_solid(march%system%term)
      call bend(scene, [curvature, 0.0_wp], march%state%u)
      call bending_measure(bending, solid, march%system%space%body, scene%x, march%state%u, 0.0_wp)
      associate (largest => bending%strain(1)/sqrt(epsilon(1.0_wp)))
         do k = 1, 2
            call bent_body_find(march, scene, merge(0.9_wp, 1.1_wp, k == 1)*largest, found)
            call check_equal(error, found%body, 2 - k, "above round-off and below")
         end do
      end associate
      march%state%clock%i_step = 0
      call bent_body_find(march, scene, 0.0_wp, found)
      call check_equal(error, found%body, 0, "before the first step")
      march%state%clock%i_step = 1
      solid%trait%is_stiff_bent = .false.
      call bent_body_find(march, scene, 0.0_wp, found)
      call check_equal(error, [found%body, len(found%advice)], [0, 0], "elements that follow")
      call march_free(march)
   end subroutine test_none

end module test_bent_bodies
