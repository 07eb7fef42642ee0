!> Forces that schemes and damped materials take energy by: their work, what they recall of the step
!> before, and drag by mass.
module test_dissipation
   use check, only : check_near, check_true, test_case_t
   use emcon_csr, only : csr_t
   use emcon_dissipation, only : dissipation_term_init, dissipation_term_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_solid, only : solid_init, solid_t
   use emcon_space, only : space_t
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   use small_scenes, only : add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_dissipation

   real(wp), parameter :: tol = 512.0_wp*epsilon(1.0_wp)
   integer, parameter :: n = 6

contains

   subroutine collect_dissipation(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces take what is told", test_work), &
         test_case_t("the step before is recalled", test_recalled), &
         test_case_t("materials and schemes take by the same moduli", test_materials), &
         test_case_t("drag by mass", test_drag)]
   end subroutine collect_dissipation

   !> Two elements with the material damping `alpha` and `beta`, a motion by chance.
   subroutine begin(term, solid, motion, damping, nlgeom, error)
      type(dissipation_term_t), intent(out) :: term
      type(solid_t), intent(out) :: solid
      type(motion_t), intent(out) :: motion
      real(wp), intent(in) :: damping(2)
      logical, intent(in) :: nlgeom
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(space_t) :: space
      type(csr_t) :: matrix
      real(wp) :: u0(2, n), du(2, n)

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "ENERGYDECAYING")
      scene%step(1)%nlgeom = nlgeom
      scene%material(1)%alpha = damping(1)
      scene%material(1)%beta = damping(2)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      call dissipation_term_init(term, solid, scene)
      call term%begin_step(scene, 1, space, matrix, [integer ::])
      call shake(u0, 0.2_wp)
      call shake(du, 0.2_wp)
      motion = motion_of(evaluation_t(mass_scale=10.0_wp), scene%x, u0, du)
   end subroutine begin

   subroutine find(term, motion, force)
      type(dissipation_term_t), intent(inout) :: term
      type(motion_t), intent(in) :: motion
      real(wp), intent(out) :: force(2, n)
      type(response_t) :: response

      call response_init(response, 2, n, 2)
      call response_begin(response)
      call term%respond(motion, response)
      force = response%part(role_internal)%force
   end subroutine find

   !> Without resultant, and without moment in the middle of the step.
   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(dissipation_term_t) :: term
      type(solid_t) :: solid
      type(motion_t) :: motion
      real(wp), dimension(2, n) :: force, moved, middle
      integer :: k

      do k = 1, 3
         call begin(term, solid, motion, [0.0_wp, merge(0.02_wp, 0.0_wp, k > 1)], .true., error)
         if (allocated(error)) return
         if (k /= 2) motion%evaluation%dissipation = 0.5_wp
         motion%evaluation%recalled = 0.5_wp
         if (k == 3) then
            allocate(motion%du_before, mold=motion%du)
            call shake(motion%du_before, 0.2_wp)
         end if
         call find(term, motion, force)
         call check_near(error, sum(force*motion%du), term%work + term%damping, tol, 10.0_wp, &
            "work")
         call check_true(error, (abs(term%work) > 0.01_wp .eqv. k /= 2) .and. &
            (term%damping > 0.01_wp .eqv. k > 1), "by the scheme, by the material")
         middle = motion%x + motion%u0 + 0.5_wp*motion%du
         call check_near(error, [sum(force, 2), sum(middle(1, :)*force(2, :) - middle(2, :) &
            *force(1, :))], [0.0_wp, 0.0_wp, 0.0_wp], tol, 100.0_wp, "resultants")
         motion%u0 = motion%u0 + 0.5_wp
         motion%du = motion%du - 0.25_wp
         if (k == 3) motion%du_before = motion%du_before + 0.125_wp
         call find(term, motion, moved)
         call check_near(error, moved, force, tol, 100.0_wp, "carried along")
      end do
      call check_true(error, .not. term%is_symmetric(motion), "forces in the middle of the step")
      motion%evaluation%mass_scale = 0.0_wp
      call check_true(error, term%is_symmetric(motion), "no forces")
      call find(term, motion, force)
      call check_near(error, force, 0.0_wp*force, 0.0_wp, 1.0_wp, "nothing without inertia")
   end subroutine test_work

   !> A turn before counts as rest; of small strains the same motion before takes a part away.
   subroutine test_recalled(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: c = cos(0.6_wp), s = sin(0.6_wp)
      type(dissipation_term_t) :: term
      type(solid_t) :: solid
      type(motion_t) :: motion
      real(wp), dimension(2, n) :: alone, force, place

      call begin(term, solid, motion, [0.0_wp, 0.0_wp], .true., error)
      if (allocated(error)) return
      motion%evaluation%dissipation = 0.5_wp
      motion%evaluation%recalled = 0.25_wp
      call find(term, motion, alone)
      place = motion%x + motion%u0
      motion%du_before = place
      motion%du_before(1, :) = place(1, :) - (c*place(1, :) - s*place(2, :)) + 0.5_wp
      motion%du_before(2, :) = place(2, :) - (s*place(1, :) + c*place(2, :)) - 0.25_wp
      call find(term, motion, force)
      call check_near(error, force, alone, tol, 100.0_wp, "a turn")
      call begin(term, solid, motion, [0.0_wp, 0.0_wp], .false., error)
      if (allocated(error)) return
      motion%evaluation%dissipation = 0.5_wp
      motion%evaluation%recalled = 0.25_wp
      call find(term, motion, alone)
      motion%du_before = 2.0_wp*motion%du
      call find(term, motion, force)
      call check_near(error, force, 0.5_wp*alone, tol, 100.0_wp, "twice the same")
      call check_true(error, maxval(abs(alone)) > 0.1_wp, "there are forces")
   end subroutine test_recalled

   !> beta/h of one against half the dissipation of the other.
   subroutine test_materials(error)
      type(error_t), allocatable, intent(out) :: error
      type(dissipation_term_t) :: term
      type(solid_t) :: solid
      type(motion_t) :: motion, same
      real(wp), dimension(2, n) :: by_scheme, by_material

      call begin(term, solid, motion, [0.0_wp, 0.0_wp], .true., error)
      if (allocated(error)) return
      motion%evaluation%dissipation = 0.5_wp
      call find(term, motion, by_scheme)
      call begin(term, solid, same, [0.0_wp, 0.05_wp], .true., error)
      if (allocated(error)) return
      same%u0 = motion%u0
      same%du = motion%du
      call find(term, same, by_material)
      call check_near(error, by_material, 2.0_wp*by_scheme, tol, 100.0_wp, "forces")
   end subroutine test_materials

   !> alpha M du/h on each node; it takes its work.
   subroutine test_drag(error)
      type(error_t), allocatable, intent(out) :: error
      type(dissipation_term_t) :: term
      type(solid_t) :: solid
      type(motion_t) :: motion
      real(wp), dimension(2, n) :: force, expected
      integer :: e, i, j

      call begin(term, solid, motion, [3.0_wp, 0.0_wp], .true., error)
      if (allocated(error)) return
      call find(term, motion, force)
      expected = 0.0_wp
      do e = 1, 2
         do i = 1, 4
            do j = 1, 4
               associate (a => solid%node(i, e), b => solid%node(j, e))
                  expected(:, a) = expected(:, a) + 30.0_wp*solid%mass%consistent(i, j, e) &
                     *motion%du(:, b)
               end associate
            end do
         end do
      end do
      call check_near(error, force, expected, tol, 10.0_wp, "drag")
      call check_near(error, [term%damping, term%work], [sum(force*motion%du), 0.0_wp], tol, &
         10.0_wp, "taken")
   end subroutine test_drag

end module test_dissipation
