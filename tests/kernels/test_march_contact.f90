!> What the march decides of contact, on a block that is thrown on another one: friction and its
!> limit, restitution, surfaces without mass, contact that gives way, bodies that contact holds.
module test_march_contact
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_condition_nodes, only : condition_resize
   use emcon_correction, only : correction_t
   use emcon_errors, only : err_analysis, error_t
   use emcon_flexibility, only : flexibility_free, flexibility_make, flexibility_row, flexibility_t
   use emcon_friction_limit, only : friction_limit_find
   use emcon_interactions, only : formulation_mortar, formulation_nts
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : initiation_massless, initiation_persistent, load_point, load_t, &
      method_augmented_lagrange, method_penalty
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_two_blocks, prescribe, shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_march_contact

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Round-off of some 60 steps, each of the order of epsilon times the energy.
   real(wp), parameter :: tol = 450.0_wp*eps
   integer, parameter :: n_step = 60
   real(wp), parameter :: gap_start = 0.0927_wp, h = 0.02_wp

contains

   subroutine collect_march_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("friction is at most mu times the push, and takes", test_friction), &
         test_case_t("limit of friction of a contact by itself", test_limit), &
         test_case_t("restitution takes what the ledger says", test_restitution), &
         test_case_t("surfaces without mass keep energy and momenta", test_massless), &
         test_case_t("penalties store what they take", test_penalty), &
         test_case_t("dashpots between surfaces take energy, not momentum", test_dashpots), &
         test_case_t("a body that contact alone holds", test_held), &
         test_case_t("a body that a load takes away", test_taken)]
   end subroutine collect_march_contact

   !> The upper block, nodes 11 to 16, falls with a velocity of 1, aslant by `slide`.
   subroutine make_drop(scene, formulation, slide)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: formulation
      real(wp), intent(in) :: slide              !! [L/T]
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, gap_start, lower, upper)
      scene%pair(1)%formulation = formulation
      call add_step(scene, .false., h, n_step)
      scene%step(1)%contact%initiation = initiation_persistent
      call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%v0(1, 11:) = slide
      scene%v0(2, 11:) = -1.0_wp
   end subroutine make_drop

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> |T| <= mu N of the sums over the upper block's nodes, = where it slides all the way; the
   !> energy falls by what friction takes and by nothing else, and in no increment less than 0.
   subroutine test_friction(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.2_wp
      type(scene_t) :: scene
      type(increment_t) :: increment
      type(ledger_t) :: start
      real(wp) :: push(2), taken
      integer :: formulation, k, n_slide

      do formulation = formulation_nts, formulation_mortar
         call make_drop(scene, formulation, 0.6_wp)
         scene%pair(1)%interaction%friction = mu
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            n_slide = 0
            do k = 1, n_step
               taken = march%ledger%friction
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               associate (ledger => march%ledger)
                  call check_near(error, ledger%total + ledger%friction, start%total, tol, &
                     start%total, "energy and what friction took")
                  call check_true(error, ledger%friction >= taken - tol*start%total, &
                     "friction takes")
               end associate
               push = sum(march%state%contact(:, 11:), 2)
               call check_true(error, abs(push(1)) <= mu*push(2) + tol*march%ledger%total, &
                  "the law, formulation " // to_text(formulation))
               if (push(2) > 0.0_wp .and. abs(push(1) + mu*push(2)) <= sqrt(eps)*push(2)) then
                  n_slide = n_slide + 1
               end if
               if (allocated(error)) return
            end do
            call check_true(error, n_slide > 0, "it slides, formulation " // to_text(formulation))
            call check_true(error, march%ledger%friction > 0.01_wp*start%total, "friction took")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_friction

   !> Wnn/|Wnt| of dense inverses, for random rows; where the slip moves no gap there is no limit.
   subroutine test_limit(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(flexibility_t) :: flexibility
      type(correction_t) :: correction
      type(increment_t) :: increment
      real(wp) :: limit(3), row(2)
      real(dp), allocatable :: matrix(:, :), force(:, :), way(:, :)
      logical :: is_singular
      integer :: k

      call make_drop(scene, formulation_nts, 0.6_wp)
      call begin(scene, march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call constraints_select(set, [1, 2, 3])
      do k = 1, 3
         call condition_resize(set%item(k), 3)
         set%item(k)%node(:3) = [10 + k, 6, 7]
         call shake(set%item(k)%g, 1.0_wp)
         call shake(set%item(k)%c, 0.1_wp)
         set%item(k)%c = set%item(k)%c + set%item(k)%g
         allocate(set%item(k)%t(size(set%item(k)%g, 1), size(set%item(k)%g, 2), 1))
         call shake(set%item(k)%t(:, :, 1), 1.0_wp)
      end do
      set%item(3)%t = 0.0_wp
      correction%choice = solver_default
      associate (numbering => march%system%space%numbering)
         call flexibility_make(flexibility, march%system, set, correction, error)
         if (allocated(error)) return
         call friction_limit_find(march%system, set, [1, 2, 3], flexibility, limit, error)
         if (allocated(error)) return
         call check_true(error, .not. flexibility%is_singular, "it is regular")
         matrix = dense_of(march%system%matrix)
         allocate(force(size(matrix, 1), 2), way(size(matrix, 1), 2))
         do k = 1, 2
            force(:, 1) = real(flexibility_row(numbering, set%item(k), set%item(k)%g), dp)
            force(:, 2) = real(flexibility_row(numbering, set%item(k), set%item(k)%t(:, :, 1)), dp)
            call dense_solve(matrix, force, way, is_singular)
            row = real(matmul(real(flexibility_row(numbering, set%item(k), set%item(k)%c), dp), &
               way), wp)
            if (row(1) > 0.0_wp) then
               call check_near(error, limit(k), row(1)/abs(row(2)), 1.0e5_wp*eps, limit(k), "limit")
            else
               call check_true(error, limit(k) >= huge(limit), "no limit")
            end if
         end do
      end associate
      call check_true(error, limit(3) >= huge(limit), "a slip that moves no gap")
      call flexibility_free(flexibility)
      call march_free(march)
   end subroutine test_limit

   !> Energy and what impacts took are constant; it is taken, and momentum along the floor stays.
   subroutine test_restitution(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(ledger_t) :: start
      type(increment_t) :: increment
      integer :: k

      call make_drop(scene, formulation_nts, 0.3_wp)
      scene%pair(1)%interaction%restitution = 0.5_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      start = march%ledger
      do k = 1, n_step
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         associate (ledger => march%ledger)
            call check_near(error, ledger%total + ledger%restitution, start%total, tol, &
               start%total, "energy and what impacts took")
            call check_near(error, ledger%momentum(1), start%momentum(1), tol, start%momentum(1), &
               "momentum along the floor")
         end associate
         if (allocated(error)) return
      end do
      call check_true(error, march%ledger%restitution > 0.05_wp*start%total, "impacts took")
      call march_free(march)
   end subroutine test_restitution

   !> Both blocks are free: all momenta.
   subroutine test_massless(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(increment_t) :: increment
      integer :: formulation, k, n_contact

      do formulation = formulation_nts, formulation_mortar
         call make_drop(scene, formulation, 0.3_wp)
         scene%step(1)%contact%initiation = initiation_massless
         deallocate(scene%step(1)%prescribed)
         allocate(scene%step(1)%prescribed(0))
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            n_contact = 0
            do k = 1, n_step
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               if (increment%n_active > 0) n_contact = n_contact + 1
               associate (ledger => march%ledger)
                  call check_near(error, ledger%total, start%total, tol, start%total, &
                     "energy, formulation " // to_text(formulation))
                  call check_near(error, [ledger%momentum, ledger%angular], &
                     [start%momentum, start%angular], tol, abs(start%momentum(2)), "momenta")
               end associate
               if (allocated(error)) return
            end do
            call check_true(error, n_contact > 3, "contact")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_massless

   !> Kinetic, strain and contact energy stay as a sum: but for what multipliers that are found by
   !> steps leave of gaps, in units of the edges. Contact stores on the way, not at the end.
   subroutine test_penalty(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(increment_t) :: increment
      real(wp) :: most, push, left
      integer :: method, k

      do method = method_penalty, method_augmented_lagrange
         call make_drop(scene, formulation_nts, 0.3_wp)
         scene%step(1)%contact%method = method
         scene%step(1)%contact%penalty%stiffness = 500.0_wp
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            most = 0.0_wp
            left = tol*start%total
            do k = 1, n_step
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               most = max(most, march%ledger%contact_energy)
               associate (contacts => march%state%contacts)
                  if (method == method_penalty) call check_true(error, all(contacts%is_active &
                     .eqv. contacts%closure < 0.0_wp), "what stores acts")
               end associate
               push = sum(march%state%contact(2, 11:))
               if (method == method_augmented_lagrange) left = left &
                  + push*scene%step(1)%contact%penalty%tolerance
               call check_true(error, abs(march%ledger%total - start%total) <= left, &
                  "energy, method " // to_text(method))
               if (allocated(error)) return
            end do
            if (method == method_penalty) call check_true(error, most > 1.0e-4_wp*start%total, &
               "stored")
            call check_near(error, march%ledger%contact_energy, 0.0_wp, tol, start%total, &
               "given back")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_penalty

   !> Before anything has moved a dashpot pushes by coefficient, length of its node and velocity. In
   !> a drop on a free block energy and what was taken stay as a sum, and so do the momenta.
   subroutine test_dashpots(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: coefficient = 2.0_wp, short = 1.0e-5_wp
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(increment_t) :: increment
      real(wp) :: taken
      integer :: formulation, k, n

      do k = 1, 4
         formulation = merge(formulation_nts, formulation_mortar, mod(k, 2) == 0)
         call make_drop(scene, formulation, 0.3_wp)
         scene%pair(1)%interaction%damping%coefficient = coefficient
         scene%pair(1)%interaction%damping%clearance = 2.0_wp*gap_start
         scene%pair(1)%interaction%damping%flat = 1.0_wp
         if (k > 2) scene%step(1)%time%h = short
         deallocate(scene%step(1)%prescribed)
         allocate(scene%step(1)%prescribed(0))
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            do n = 1, merge(n_step, 1, k <= 2)
               taken = march%ledger%contact_damping
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               associate (ledger => march%ledger)
                  call check_near(error, ledger%total + ledger%contact_damping, start%total, tol, &
                     start%total, "energy and what is taken, formulation " // to_text(formulation))
                  call check_near(error, [ledger%momentum, ledger%angular], [start%momentum, &
                     start%angular], tol, norm2(start%momentum), "momenta")
                  call check_true(error, ledger%contact_damping >= taken - tol*start%total, "taken")
               end associate
               if (allocated(error)) return
            end do
            if (k <= 2) then
               call check_true(error, march%ledger%contact_damping > 0.1_wp*start%total, "much")
            else
               call check_near(error, sum(march%state%contact(:, 11:), 2), [0.0_wp, &
                  2.0_wp*coefficient], 1.0e3_wp*short, coefficient, "the push over a length of 2")
            end if
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_dashpots

   !> Statics: a load presses the upper block, which nothing else holds upright, through its gap.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: force = 0.02_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(increment_t) :: increment
      type(load_t) :: load
      integer :: formulation, i

      do formulation = formulation_nts, formulation_mortar
         call make_two_blocks(scene, gap_start, lower, upper)
         scene%pair(1)%formulation = formulation
         call add_step(scene, .true., 1.0_wp, 1)
         call clamp(scene%step(1), [(i, i = 1, 10)])
         call prescribe(scene%step(1), 12, 1, 0.0_wp)
         load%kind = load_point
         load%place = 2
         load%value = -force/3.0_wp
         do i = 14, 16
            load%target = i
            call add_load(scene%step(1), load)
         end do
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (.not. allocated(error)) call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            associate (state => march%state)
               call check_near(error, sum(state%contact(:, 11:), 2), [0.0_wp, force], sqrt(eps), &
                  force, "the push, formulation " // to_text(formulation))
               call check_near(error, sum(state%reaction(:, :10), 2), [0.0_wp, force], sqrt(eps), &
                  force, "the reaction")
               call check_true(error, all(state%u(2, 11:) < -0.9_wp*gap_start), "it has come down")
               call check_true(error, increment%n_active >= 2, "two contacts at least")
            end associate
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_held

   !> Nothing holds it upwards: no smaller increment does, and none is tried.
   subroutine test_taken(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      integer :: i

      call make_two_blocks(scene, 0.05_wp, lower, upper)
      call add_step(scene, .true., 0.25_wp, 4)
      call clamp(scene%step(1), [(i, i = 1, 5)])
      do i = 11, 16
         call prescribe(scene%step(1), i, 1, 0.0_wp)
      end do
      load%kind = load_point
      load%target = 15
      load%place = 2
      load%value = 1.0_wp
      call add_load(scene%step(1), load)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call march_increment(march, scene, increment, stopped)
      call check_error(error, stopped, err_analysis, &
         "the analysis stops at time 0: nothing resists a motion", "stopped")
      call check_equal(error, increment%n_cut, 0, "cuts")
      call march_free(march)
   end subroutine test_taken

end module test_march_contact
