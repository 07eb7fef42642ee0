!> A step of the deck begins with displacements and velocities alone: what a march does in its
!> second step is what one does that starts there.
module test_step_begin
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_march_begin, only : march_renumber
   use emcon_scene, only : scene_t
   use emcon_scheme, only : scheme_row_t
   use emcon_scheme_registry, only : n_scheme_row, scheme_row
   use emcon_state, only : state_t
   use linear_scenes, only : add_equation
   use small_scenes, only : add_step, block_t, clamp, make_block, make_two_blocks, prescribe, &
      shake
   implicit none
   private
   public :: collect_step_begin

   real(wp), parameter :: tol = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.01_wp

contains

   subroutine collect_step_begin(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("as a march that starts there, by all schemes", test_schemes), &
         test_case_t("other conditions within a step", test_renumber), &
         test_case_t("and such as equations contradict", test_contradiction), &
         test_case_t("what overlaps as it begins goes over the step", test_overclosure), &
         test_case_t("and is told where no pair is there to hold it", test_overlap)]
   end subroutine collect_step_begin

   !> A block that is held at its left and pulled at its right, in two steps of `n` increments; the
   !> second one is of another size.
   subroutine make_pulled(scene, row, n)
      type(scene_t), intent(out) :: scene
      type(scheme_row_t), intent(in) :: row
      integer, intent(in) :: n
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [2, 1], block)
      call shake(scene%v0, 0.5_wp)
      scene%v0(:, [1, 4]) = 0.0_wp
      do k = 1, 2
         call add_step(scene, .not. row%has_inertia, h*(1.0_wp - 0.25_wp*k), n)
         scene%step(k)%scheme = row
         call clamp(scene%step(k), [1, 4])
         if (.not. row%has_inertia) call prescribe(scene%step(k), 3, 1, 0.1_wp*k)
      end do
   end subroutine make_pulled

   subroutine test_schemes(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_row_t) :: row
      integer :: k

      do k = 1, n_scheme_row()
         row = scheme_row(k)
         call compare(row, error)
         if (allocated(error)) return
      end do
   end subroutine test_schemes

   !> Three increments of the first step and three of the second one, beside three from there.
   subroutine compare(row, error)
      type(scheme_row_t), intent(in) :: row
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, later
      type(march_t) :: march, new
      type(increment_t) :: increment
      integer :: k

      call make_pulled(scene, row, 3)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      do k = 1, 3
         if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      end do
      if (allocated(error)) return
      later = scene
      later%u0 = march%state%u
      later%v0 = march%state%v
      if (.not. row%has_inertia) later%v0 = 1.0_wp
      later%step = scene%step(2:)
      call march_init(new, later, error)
      ! As if increments were of other sizes, and time between two of them.
      associate (clock => march%state%clock)
         clock%grid_stride = 4
         clock%n_easy = 3
         clock%n_part = 2
         clock%is_off_grid = .true.
         march%state%control%power = 2
      end associate
      if (.not. allocated(error)) call march_begin_step(march, scene, 2, error)
      if (.not. allocated(error)) call march_begin_step(new, later, 1, error)
      if (allocated(error)) return
      if (.not. row%has_inertia) call check_near(error, new%state%v, 0.0_wp*scene%x, 0.0_wp, &
         1.0_wp, "no velocities in statics")
      associate (now => march%state%clock, first => new%state%clock)
         call check_equal(error, [now%i_step, now%n_grid, now%n_part, now%grid_stride, now%n_easy, &
            now%n_before, march%state%control%power], [2, first%n_grid, first%n_part, &
            first%grid_stride, first%n_easy, 3, 0], "counts")
         call check_true(error, now%is_off_grid .eqv. first%is_off_grid, "on the grid")
         call check_near(error, [now%start_time, now%step_time], [now%time, first%step_time], &
            0.0_wp, 1.0_wp, "times")
         call check_near(error, march%state%explicit%critical_h, new%state%explicit%critical_h, &
            tol, 1.0_wp, "critical step")
      end associate
      do k = 1, 3
         if (.not. allocated(error)) call march_increment(march, scene, increment, error)
         if (.not. allocated(error)) call march_increment(new, later, increment, error)
         if (allocated(error)) return
         associate (name => trim(row%card) // " " // trim(row%word))
            call check_near(error, march%state%u, new%state%u, tol, 1.0_wp, "u, " // name)
            call check_near(error, h*march%state%v, h*new%state%v, tol, 1.0_wp, "v, " // name)
            call check_near(error, march%state%reaction, new%state%reaction, tol/h, 1.0_wp, &
               "reactions, " // name)
         end associate
      end do
      call check_true(error, norm2(new%state%u - later%u0) > 1.0e-3_wp, "it moves")
      call march_free(march)
      call march_free(new)
   end subroutine compare

   !> Two more nodes are held from the second increment on: the state and the works stay as they
   !> are, and the critical step is that of a march that starts so. At first the right element is
   !> the narrower one, then the left one.
   subroutine test_renumber(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, later
      type(march_t) :: march, new
      type(increment_t) :: increment
      type(state_t) :: before
      type(ledger_t) :: works
      integer :: revision

      call make_pulled(scene, scheme_row("DYNAMIC", "CENTRALDIFFERENCE"), 3)
      scene%x(1, [3, 6]) = scene%x(1, [3, 6]) - 0.25_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_equal(error, march%state%explicit%critical_element, 2, "the right one")
      march%state%u(1, [2, 5]) = -0.5_wp
      march%state%u(1, [3, 6]) = 0.0_wp
      march%state%base%is_set = .true.
      before = march%state
      works = march%ledger
      revision = march%revision
      call clamp(scene%step(1), [3, 6])
      call march_renumber(march, scene, error)
      if (allocated(error)) return
      later = scene
      later%u0 = march%state%u
      later%v0 = march%state%v
      call march_init(new, later, error)
      if (.not. allocated(error)) call march_begin_step(new, later, 1, error)
      if (allocated(error)) return
      call check_equal(error, [march%system%space%numbering%n_unknown, &
         march%state%explicit%critical_element, march%revision - revision], [4, 1, 1], &
         "unknowns, fastest element, revision")
      associate (now => march%state)
         call check_near(error, now%explicit%critical_h, new%state%explicit%critical_h, tol, &
            1.0_wp, "critical step")
         call check_true(error, now%explicit%critical_h < 0.9_wp*before%explicit%critical_h, &
            "another one")
         call check_true(error, .not. now%base%is_set, "no factor")
         call check_equal(error, [now%clock%n_grid, now%clock%increment, now%clock%i_step], &
            [1, 1, 1], "counts")
         call check_near(error, now%internal, before%internal, 0.0_wp, 1.0_wp, "forces")
         call check_near(error, [now%clock%time, now%clock%step_time, now%potential, now%energy], &
            [before%clock%time, before%clock%step_time, before%potential, before%energy], 0.0_wp, &
            1.0_wp, "times and energies")
      end associate
      call check_near(error, [march%ledger%total, march%ledger%external_work], [works%total, &
         works%external_work], 0.0_wp, 1.0_wp, "works")
      call march_free(march)
      call march_free(new)
   end subroutine test_renumber

   !> Two nodes that an equation lets move alike, and that are to move otherwise from then on.
   subroutine test_contradiction(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(march_t) :: march

      call make_pulled(scene, scheme_row("DYNAMIC", ""), 3)
      call add_equation(scene, [3, 6], [1, 1], [1.0_wp, -1.0_wp])
      scene%v0(1, 6) = scene%v0(1, 3)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call prescribe(scene%step(1), 3, 1, 0.125_wp)
      call prescribe(scene%step(1), 6, 1, 0.25_wp)
      call march_renumber(march, scene, refused)
      call check_error(error, refused, err_input, "", "contradiction")
      call march_free(march)
   end subroutine test_contradiction

   !> Held blocks that overlap by 1/20: gaps rise to 0 over the step, or by an amplitude.
   subroutine test_overclosure(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: depth = 0.05_wp
      real(wp), parameter :: left(5, 0:1) = reshape([1.0_wp, 0.75_wp, 0.5_wp, 0.25_wp, 0.0_wp, &
         1.0_wp, 0.5_wp, 0.375_wp, 0.25_wp, 0.25_wp], [5, 2])
      type(scene_t) :: scene
      type(increment_t) :: increment
      type(block_t) :: lower, upper
      integer :: k, i

      do k = 0, 1
         call make_two_blocks(scene, -depth, lower, upper)
         call add_step(scene, .true., 0.25_wp, 4)
         call clamp(scene%step(1), [(i, i = 1, 5), 14, 15, 16])
         scene%amplitude = [amplitude_t(name="LEFT", time=[0.0_wp, 0.25_wp, 0.75_wp], &
            value=[1.0_wp, 0.5_wp, 0.25_wp])]
         scene%step(1)%contact%resolves_overclosure = .true.
         scene%step(1)%contact%overclosure_amplitude = k
         block
            type(march_t) :: march

            call march_init(march, scene, error)
            if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
            call check_near(error, march%overlap_check%meant_overlap, depth, tol, 1.0_wp, "meant")
            call check_true(error, march%system%contact(1)%contact%meets_statics, "for statics")
            do i = 1, 4
               if (allocated(error)) return
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               call check_near(error, march%active%start%left, left(i:i + 1, k), tol, 1.0_wp, &
                  "left")
               call check_near(error, march%system%contact(1)%contact%state%gap1, &
                  spread(-depth*left(i + 1, k), 1, 3), 1.0e-6_wp, 1.0_wp, "gaps")
            end do
            scene%step(1)%contact%resolves_overclosure = .false.
            call march_renumber(march, scene, error)
            if (allocated(error)) return
            call check_near(error, march%overlap_check%meant_overlap, 0.0_wp, 0.0_wp, 1.0_wp, &
               "none is meant")
            call march_free(march)
         end block
      end do
   end subroutine test_overclosure

   !> Node 13 is the deepest, below the edge from node 10 to node 9; with a pair, that cannot hold
   !> what begins behind its surface, it is an error.
   subroutine test_overlap(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      character(len=:), allocatable :: told
      integer :: k

      do k = 0, 1
         call make_two_blocks(scene, -0.0625_wp, lower, upper)
         scene%x(2, 13) = -0.125_wp
         scene%pair = scene%pair(:k)
         call add_step(scene, .false., h, 4)
         block
            type(march_t) :: march

            call march_init(march, scene, error)
            if (allocated(error)) return
            call march_begin_step(march, scene, 1, raised)
            if (k == 1) then
               call check_error(error, raised, err_input, "overlap at the start by 0.125 of an " &
                  // "edge: node 13 of body 2", "with a pair")
               call march_free(march)
               return
            end if
            call check_true(error, .not. allocated(raised), "begins")
            told = ""
            if (march%warnings%n > 0) told = march%warnings%item(1)%text
            call check_equal(error, march%warnings%n, 1, "warnings, first: " // told)
            call check_equal(error, told, "bodies overlap as a step begins, by 0.125 " &
               // "of an edge, node 13 of body 2 is 0.125 behind the edge from node 10 to 9 " // &
               "of body 1: no *CONTACT PAIR names the two, and their overlap is not " // &
               "checked from here on", "told")
            call march_free(march)
         end block
      end do
   end subroutine test_overlap

end module test_step_begin
