!> Stress of thin elements: a strip that is pulled and free across is as much thinner as narrower.
module test_thin_stress
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : wp
   use emcon_law_registry, only : law_linear
   use emcon_motion, only : motion_of
   use emcon_scene, only : scene_t
   use emcon_solid_term, only : solid_term_init, solid_term_t
   use emcon_stress, only : nodal_stress
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   use small_scenes, only : block_t, make_block
   implicit none
   private
   public :: collect_thin_stress

   real(wp), parameter :: tol = 1.0e3_wp*epsilon(1.0_wp), thickness = 0.25_wp
   !> Stretch along x.
   real(wp), parameter :: pulled = 1.5_wp

contains

   subroutine collect_thin_stress(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("force by the area that is left", test_strip)]
   end subroutine collect_thin_stress

   !> Forces of a square of two triangles that is stretched by `along` and `across`.
   subroutine stretch(term, scene, along, across, u, force)
      type(solid_term_t), intent(inout) :: term
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: along, across
      real(wp), intent(out) :: u(2, 4), force(2, 4)
      type(response_t) :: response

      u(1, :) = (along - 1.0_wp)*scene%x(1, :)
      u(2, :) = (across - 1.0_wp)*scene%x(2, :)
      call response_init(response, 2, 4, 2)
      call response_begin(response)
      call term%respond(motion_of(evaluation_t(), scene%x, u, 0.0_wp*u), response)
      force = response%part(role_internal)%force
   end subroutine stretch

   subroutine test_strip(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term, linear
      real(wp), dimension(2, 4) :: u, force
      real(wp) :: low, high, across, stress(6, 4), part(6, 4)
      integer :: k

      call make_block(scene, "CPS3", [1, 1], block)
      scene%section(1)%thickness = thickness
      call solid_term_init(term, scene, error)
      if (allocated(error)) return
      call check_equal(error, count(term%solid%trait%is_thin), 2, "thin elements")
      low = 0.5_wp
      high = 1.0_wp
      do k = 1, digits(1.0_wp)
         across = 0.5_wp*(low + high)
         call stretch(term, scene, pulled, across, u, force)
         if (sum(force(2, 3:)) > 0.0_wp) then
            high = across
         else
            low = across
         end if
      end do
      call nodal_stress(term%solid, u, 1.0_wp, stress)
      call check_true(error, across < 0.95_wp, "it is narrower")
      call check_near(error, stress(1, :), spread(sum(force(1, [2, 4]))/(thickness*across**2), 1, &
         4), tol, 100.0_wp, "along")
      call check_near(error, stress(2:, :), 0.0_wp*stress(2:, :), tol, 100.0_wp, "nowhere else")
      ! Of small strains the area stays, and all is linear.
      scene%material(1)%law = law_linear
      call solid_term_init(linear, scene, error)
      if (allocated(error)) return
      call nodal_stress(linear%solid, u, 0.0_wp, stress)
      call nodal_stress(linear%solid, 0.125_wp*u, 0.0_wp, part)
      call check_near(error, 8.0_wp*part, stress, tol, 100.0_wp, "linear")
      call check_true(error, stress(1, 1) > 10.0_wp, "pulled")
   end subroutine test_strip

end module test_thin_stress
