!> The referee of friction: where a step is solved, the problem of its contacts linearised there has
!> that solution, whatever set it is begun from.
module test_friction_referee
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_active_set, only : active_set_t, step_cycling, step_done
   use emcon_coulomb_law, only : contact_slides, contact_sticks, is_same_status
   use emcon_errors, only : error_t
   use emcon_friction_referee, only : friction_referee
   use emcon_interactions, only : formulation_mortar, formulation_nts
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_persistent
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks
   implicit none
   private
   public :: collect_friction_referee

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> What Newton's method leaves of a step, by stiffness over inertia.
   real(wp), parameter :: tol = 1.0e5_wp*eps
   integer, parameter :: n_step = 40

   !> Each kind of contact that was seen.
   type :: seen_t
      integer :: slides = 0, sticks = 0, opens = 0
   end type seen_t

contains

   subroutine collect_friction_referee(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("a step that is solved is found again", test_found_again)]
   end subroutine collect_friction_referee

   !> A block thrown aslant onto one that is clamped.
   subroutine make_drop(scene, formulation, mu, slide)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: formulation
      real(wp), intent(in) :: mu, slide          !! coefficient, velocity along the floor [L/T]
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, 0.0927_wp, lower, upper)
      scene%pair(1)%formulation = formulation
      scene%pair(1)%interaction%friction = mu
      call add_step(scene, .false., 0.02_wp, n_step)
      scene%step(1)%contact%initiation = initiation_persistent
      call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%v0(1, 11:) = slide
      scene%v0(2, 11:) = -1.0_wp
   end subroutine make_drop

   subroutine test_found_again(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(increment_t) :: increment
      type(seen_t) :: seen
      integer :: formulation, k, way

      do formulation = formulation_nts, formulation_mortar
         do way = -1, 1
            call make_drop(scene, formulation, 0.3_wp, 0.5_wp*way)
            block
               type(march_t) :: march

               call march_init(march, scene, error)
               if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
               do k = 1, n_step
                  if (allocated(error)) return
                  call march_increment(march, scene, increment, error)
                  if (allocated(error)) return
                  if (increment%n_active > 0) call check_referee(march, seen, error)
               end do
               call march_free(march)
            end block
            if (allocated(error)) return
         end do
      end do
      call check_true(error, min(seen%slides, seen%sticks, seen%opens) > 0, "of " // &
         to_text(seen%slides) // " that slide, " // to_text(seen%sticks) // " that stick, " // &
         to_text(seen%opens) // " that open each")
   end subroutine test_found_again

   !> Hand the referee all contacts near by, sticking, at the end of the step that was solved last.
   subroutine check_referee(march, seen, error)
      type(march_t), intent(inout) :: march
      type(seen_t), intent(inout) :: seen
      type(error_t), allocatable, intent(inout) :: error
      type(active_set_t) :: solved
      integer :: status
      logical :: is_done
      logical :: sticks(size(march%active%is_active))

      solved = march%active
      associate (active => march%active)
         active%is_active = active%is_candidate .or. active%is_active
         where (active%is_active) active%friction%law%status%kind = contact_sticks
         ! Nothing of these is to be left, and no multiplier to be taken over.
         active%friction%is_idle = .true.
         active%friction%is_needed = .true.
         active%friction%tau = 0.0_wp
         active%lam = 0.0_wp
         active%comes_and_goes = .true.
         is_done = .true.
         status = step_cycling
         call friction_referee(active, march%system, march%motion, march%newton%correction, &
            is_done, status, error)
         if (allocated(error)) return
         call check_true(error, status == step_done .and. .not. is_done, "it finds a set")
         call check_equal(error, active%friction%n_asked, solved%friction%n_asked + 1, "asked")
         call check_equal(error, active%n_tried, 1, "sets tried since then")
         associate (id => active%set%id(:active%set%n))
            call check_true(error, .not. any(active%friction%is_idle(id) .or. &
               active%friction%is_needed(id)), "all hold their own slip")
         end associate
         call check_true(error, .not. any(active%comes_and_goes), "nothing comes and goes")
         call check_true(error, all(active%is_active .eqv. solved%is_active), "what acts")
         call check_true(error, all(is_same_status(active%friction%law%status, &
            solved%friction%law%status) .or. .not. solved%is_active), "what slides where to")
      end associate
      associate (acts => solved%is_active, friction => march%active%friction, &
            lam => march%active%lam)
         call check_near(error, pack(lam, acts), pack(solved%lam, acts), tol, &
            maxval(solved%lam, mask=acts), "pushes")
         sticks = acts .and. solved%friction%law%status%kind == contact_sticks .and. &
            .not. solved%friction%is_idle
         call check_near(error, pack(friction%tau(1, :), sticks), &
            pack(solved%friction%tau(1, :), sticks), tol, maxval(solved%lam, mask=acts), &
            "friction of what sticks")
         sticks = sticks .and. abs(friction%tau(1, :)) > 0.0_wp
      end associate
      seen%sticks = seen%sticks + count(sticks)
      seen%opens = seen%opens + count(solved%is_candidate .and. .not. solved%is_active)
      seen%slides = seen%slides + count(solved%is_active .and. &
         solved%friction%law%status%kind == contact_slides)
   end subroutine check_referee

end module test_friction_referee
