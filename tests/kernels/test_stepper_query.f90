!> What the stepper tells from outside: residual, tangent, constraints, null space, links.
module test_stepper_query
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_multiply, csr_multiply_transposed, csr_t, csr_transpose
   use emcon_csr_product, only : csr_product
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_numbering, only : gather_dependent
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_t
   use emcon_stepper_conditions, only : stepper_remove_prescribed
   use emcon_stepper_null_space, only : query_links, query_multipliers, query_null_space
   use emcon_stepper_free, only : snapshot_t, stepper_restore, stepper_snapshot
   use emcon_stepper_query, only : query_evaluate, query_free, query_guess, query_mass, &
      query_momenta, query_residual, query_t, query_tangent, query_unknowns
   use emcon_stepper_report, only : contact_report_t, query_constraints, query_curvature_times
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake, young
   use stepper_scenes, only : check_same_state, drop_h, make_drop, make_tied_drop, open_scene
   implicit none
   private
   public :: collect_stepper_query

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Sums of some tens of terms.
   real(wp), parameter :: tol = 64.0_wp*eps
   !> Central differences: the step for which truncation and rounding are about the same.
   real(wp), parameter :: probe = eps**(1.0_wp/3.0_wp)
   !> What they leave, for third derivatives up to this many times the value.
   real(wp), parameter :: difference_tol = 1.0e3_wp*probe**2
   integer, parameter :: n_scene = 3

contains

   subroutine collect_stepper_query(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("queries leave no trace", test_no_trace), &
         test_case_t("residual of a solved step", test_residual), &
         test_case_t("guess, mass and momenta", test_guess), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("discrete gradients", test_gradients), &
         test_case_t("second derivatives", test_curvature), &
         test_case_t("null space", test_null_space), &
         test_case_t("a query follows its model", test_follows), &
         test_case_t("bad queries", test_bad)]
   end subroutine collect_stepper_query

   !> In one piece with nodes on edges; tied pieces with nodes on edges, with mortar.
   subroutine open_number(k, stepper, error)
      integer, intent(in) :: k                   !! 1..n_scene
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      if (k == 1) call make_drop(scene, 30)
      if (k > 1) call make_tied_drop(scene, 30, is_mortar=k == 3)
      call open_scene(stepper, scene, error)
   end subroutine open_number

   !> Go on until a step has contact, and back to its start; `after` it.
   subroutine go_to_contact(stepper, after, error)
      type(stepper_t), intent(inout) :: stepper
      type(snapshot_t), intent(out) :: after
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      type(snapshot_t) :: before
      integer :: i

      do i = 1, 30
         call stepper_snapshot(stepper, before)
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         if (increment%n_active > 0 .and. increment%n_cut == 0) exit
      end do
      call stepper_snapshot(stepper, after)
      call stepper_restore(stepper, before, error)
      call check_true(error, increment%n_active > 0, "contact")
   end subroutine go_to_contact

   !> Runs with and without queries between all steps give the same bits.
   subroutine test_no_trace(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, n_scene
         call compare(k)
         if (allocated(error)) return
      end do

   contains

      subroutine compare(k)
         integer, intent(in) :: k
         type(stepper_t) :: asked, plain
         type(query_t) :: query
         type(increment_t) :: increment
         integer :: i

         call open_number(k, asked, error)
         if (.not. allocated(error)) call open_number(k, plain, error)
         do i = 1, 30
            if (allocated(error)) return
            call ask(asked, query)
            if (.not. allocated(error)) call stepper_advance(asked, increment, error)
            if (.not. allocated(error)) call stepper_advance(plain, increment, error)
            if (allocated(error)) return
            call check_same_state(error, asked, plain, "scene " // to_text(k) // ", step " // &
               to_text(i))
         end do
         call query_free(query)
         call stepper_close(asked)
         call stepper_close(plain)
      end subroutine compare

      subroutine ask(stepper, query)
         type(stepper_t), intent(in) :: stepper
         type(query_t), intent(inout) :: query
         type(contact_report_t) :: report
         type(csr_t) :: matrix, p, d
         integer, allocatable :: redundant(:)
         real(wp), allocatable :: u1(:, :), momenta(:, :)

         allocate(u1, mold=stepper%scene%x)
         call query_guess(query, stepper, 3.0_wp*drop_h, u1, error)
         if (.not. allocated(error)) call query_evaluate(query, stepper, 0.5_wp*drop_h, u1, &
            .true., error)
         if (.not. allocated(error)) call query_null_space(query, p, d, redundant, error)
         if (.not. allocated(error)) call query_tangent(query, .true., matrix, error)
         u1(2, :) = u1(2, :) - 0.25_wp*stepper%scene%x(2, :)
         if (.not. allocated(error)) call query_constraints(query, stepper, &
            stepper%march%state%u, u1, .true., report, error)
         if (.not. allocated(error)) call query_momenta(query, stepper, momenta, error)
      end subroutine ask

   end subroutine test_no_trace

   !> At the end of a solved step, with the constraints and multipliers that came out of it, nothing
   !> is left on the unknowns; the multipliers follow from the residual.
   subroutine test_residual(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, n_scene
         call solve(k)
         if (allocated(error)) return
      end do

   contains

      subroutine solve(k)
         integer, intent(in) :: k
         type(stepper_t) :: stepper
         type(snapshot_t) :: after
         type(query_t) :: query
         type(csr_t) :: p, d
         integer, allocatable :: redundant(:)
         real(wp), allocatable :: nodal(:, :), unknown(:), lam(:)
         real(wp) :: largest

         call open_number(k, stepper, error)
         if (.not. allocated(error)) call go_to_contact(stepper, after, error)
         if (.not. allocated(error)) call query_evaluate(query, stepper, drop_h, after%state%u, &
            .false., error, after%state%contacts%lam, after%state%contacts%is_active)
         if (.not. allocated(error)) call query_residual(query, .false., nodal, unknown, error)
         if (allocated(error)) return
         largest = maxval(abs(unknown))
         call check_true(error, largest > 1.0e-3_wp*young, "contact forces")
         if (.not. allocated(error)) call query_residual(query, .true., nodal, unknown, error)
         if (allocated(error)) return
         ! Each entry is a sum of inertia, of the order of M v/h, and stresses.
         call check_near(error, unknown, 0.0_wp*unknown, 1.0e3_wp*eps, 1.0_wp/drop_h + young, &
            "residual of scene " // to_text(k))
         call check_reactions(stepper, nodal, after%state%reaction, k)
         if (.not. allocated(error) .or. k > 1) call query_null_space(query, p, d, redundant, error)
         if (allocated(error)) return
         call query_multipliers(query, stepper, lam, error)
         if (allocated(error)) return
         call check_near(error, lam, after%state%contacts%lam, 1.0e4_wp*eps, maxval(abs(lam)), &
            "multipliers")
         call query_free(query)
         call stepper_close(stepper)
      end subroutine solve

      !> What is left on freedoms that are no unknowns are forces of ties, which act between what is
      !> tied, and reactions.
      subroutine check_reactions(stepper, nodal, reaction, k)
         type(stepper_t), intent(in) :: stepper
         real(wp), intent(in) :: nodal(:, :), reaction(:, :)
         integer, intent(in) :: k
         real(wp) :: free(size(nodal, 1), size(nodal, 2)), gathered(size(nodal, 1), size(nodal, 2))

         associate (numbering => stepper%march%system%space%numbering)
            free = merge(1.0_wp, 0.0_wp, numbering%unknown > 0)
            gathered = nodal
            call gather_dependent(numbering, gathered)
            call check_near(error, gathered*(1.0_wp - free), reaction, 1.0e3_wp*eps, &
               1.0_wp/drop_h + young, "reactions of scene " // to_text(k))
            call check_near(error, sum(gathered, dim=2), sum(nodal, dim=2), 1.0e3_wp*eps, &
               1.0_wp/drop_h + young, "forces of ties, scene " // to_text(k))
            call check_true(error, maxval(abs(nodal*(1.0_wp - free))) > 1.0e-3_wp*young, &
               "there are such forces in scene " // to_text(k))
         end associate
      end subroutine check_reactions

   end subroutine test_residual

   subroutine test_guess(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(csr_t) :: mass
      integer, allocatable :: unknown(:, :)
      real(wp), allocatable :: u1(:, :), momenta(:, :), p(:, :), v(:), image(:)
      integer :: a

      call open_number(1, stepper, error)
      if (allocated(error)) return
      allocate(u1, mold=stepper%scene%x)
      call query_guess(query, stepper, drop_h, u1, error)
      if (.not. allocated(error)) call query_unknowns(stepper, unknown, error)
      if (.not. allocated(error)) call query_mass(stepper, mass, error)
      if (.not. allocated(error)) call query_momenta(query, stepper, momenta, error)
      if (allocated(error)) return
      associate (state => stepper%march%state)
         call check_near(error, u1, drop_h*state%v, 2.0_wp*eps, drop_h, "guess")
         call check_equal(error, count(unknown == 0), 10, "held freedoms")
         allocate(p, mold=state%v)
         allocate(v(size(p, 2)), image(size(p, 2)))
         do a = 1, 2
            v = state%v(a, :)
            call csr_multiply(mass, v, image)
            p(a, :) = image
         end do
         call check_near(error, sum(momenta(:2, :), dim=2), sum(p, dim=2), tol, 2.0_wp, "momentum")
         call check_near(error, sum(momenta(3, :)), sum(stepper%scene%x(1, :)*p(2, :) &
            - stepper%scene%x(2, :)*p(1, :)), tol, 4.0_wp, "angular momentum")
      end associate
      call query_free(query)
      call stepper_close(stepper)
   end subroutine test_guess

   !> In contact, in a random direction of the unknowns.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, n_scene
         call differ_residual(k, error)
         if (allocated(error)) return
      end do

   end subroutine test_tangent

   subroutine differ_residual(k, error)
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(snapshot_t) :: after
      type(query_t) :: query
      type(csr_t) :: matrix, plain, links
      real(wp), allocatable :: dq(:), slope(:), product(:), less(:), u1(:, :)
      real(wp), allocatable :: nodal(:, :), high(:), low(:)

      call open_number(k, stepper, error)
      if (.not. allocated(error)) call go_to_contact(stepper, after, error)
      if (.not. allocated(error)) call query_links(stepper, links, error)
      if (allocated(error)) return
      allocate(dq(links%n_col), u1(2, size(stepper%scene%x, 2)))
      call draw_random(dq)
      dq = 2.0_wp*dq - 1.0_wp
      call residual_at(0.0_wp, low)
      call query_tangent(query, .true., matrix, error)
      if (.not. allocated(error)) call query_tangent(query, .false., plain, error)
      if (.not. allocated(error)) call residual_at(probe, high)
      if (.not. allocated(error)) call residual_at(-probe, low)
      if (allocated(error)) return
      slope = (high - low)/(2.0_wp*probe)
      allocate(product, less, mold=slope)
      call csr_multiply(matrix, dq, product)
      call csr_multiply(plain, dq, less)
      call check_true(error, maxval(abs(product - less)) > 1.0e-3_wp*maxval(abs(product)), &
         "second derivatives of gaps take part")
      call check_near(error, product, slope, difference_tol, maxval(abs(slope)), &
         "scene " // to_text(k))
      call query_free(query)
      call stepper_close(stepper)

   contains

      subroutine residual_at(t, unknown)
         real(wp), intent(in) :: t
         real(wp), allocatable, intent(out) :: unknown(:)
         real(wp) :: motion(links%n_row)

         call csr_multiply(links, dq, motion)
         u1 = after%state%u + t*reshape(motion, shape(u1))
         call query_evaluate(query, stepper, drop_h, u1, .true., error, &
            1.0e2_wp*after%state%contacts%lam, after%state%contacts%is_active)
         if (.not. allocated(error)) call query_residual(query, .true., nodal, unknown, error)
      end subroutine residual_at

   end subroutine differ_residual

   !> For a motion into contact: g.(u1 - u0) is the difference of the gaps, and the gradient at the
   !> end the slope of the last gap.
   subroutine test_gradients(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, 2*n_scene
         call differ(1 + mod(k, n_scene), k > n_scene)
         if (allocated(error)) return
      end do

   contains

      subroutine differ(k, keeps_gap)
         integer, intent(in) :: k
         logical, intent(in) :: keeps_gap
         type(stepper_t) :: stepper
         type(query_t) :: query
         type(contact_report_t) :: report, high, low
         real(wp), allocatable :: u0(:, :), u1(:, :), along(:, :), product(:)

         call open_number(k, stepper, error)
         if (allocated(error)) return
         call make_motion(stepper, u0, u1)
         allocate(along, mold=u0)
         call shake(along, 1.0_wp)
         call query_constraints(query, stepper, u0, u1, keeps_gap, report, error)
         if (.not. allocated(error)) call query_constraints(query, stepper, u0, &
            u1 + probe*along, keeps_gap, high, error)
         if (.not. allocated(error)) call query_constraints(query, stepper, u0, &
            u1 - probe*along, keeps_gap, low, error)
         if (allocated(error)) return
         call check_true(error, report%n > 1, "constraints of scene " // to_text(k))
         call check_equal(error, high%id, report%id, "constraints")
         call check_equal(error, low%id, report%id, "constraints")
         if (allocated(error)) return
         allocate(product(report%n))
         call csr_multiply(report%discrete_gradient, reshape(u1 - u0, [size(u0)]), product)
         call check_near(error, product, report%dgap, tol, 1.0_wp, "discrete gradient")
         call check_near(error, report%gap1 - report%gap0, report%dgap, tol, 1.0_wp, "difference")
         call csr_multiply(report%end_gradient, reshape(along, [size(u0)]), product)
         call check_near(error, product, (high%gap1 - low%gap1)/(2.0_wp*probe), difference_tol, &
            1.0_wp, "gradient at the end")
         call check_near(error, stepper%scene%x(2, report%node) + u0(2, report%node), &
            0.0_wp*report%gap0, 1.0_wp, 1.0_wp, "slave nodes of the interface")
         call query_free(query)
         call stepper_close(stepper)
      end subroutine differ

   end subroutine test_gradients

   !> From a deformed state with a gap a motion into the other block, which turns the surfaces.
   subroutine make_motion(stepper, u0, u1)
      type(stepper_t), intent(in) :: stepper
      real(wp), allocatable, intent(out) :: u0(:, :), u1(:, :)

      allocate(u0, u1, mold=stepper%scene%x)
      call shake(u0, 0.01_wp)
      call shake(u1, 0.02_wp)
      where (stepper%scene%x(2, :) > 0.05_wp)
         u1(1, :) = u1(1, :) + 0.05_wp
         u1(2, :) = u1(2, :) - 0.12_wp + 0.03_wp*stepper%scene%x(1, :)
      end where
   end subroutine make_motion

   !> Against differences of the discrete gradients by the end.
   subroutine test_curvature(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, n_scene
         call differ_gradients(k, error)
         if (allocated(error)) return
      end do

   end subroutine test_curvature

   subroutine differ_gradients(k, error)
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(query_t) :: query
      real(wp), allocatable :: u0(:, :), u1(:, :), along(:, :), product(:, :)
      real(wp), allocatable :: high(:), low(:), factor(:)

      call open_number(k, stepper, error)
      if (allocated(error)) return
      call make_motion(stepper, u0, u1)
      allocate(along, mold=u0)
      call shake(along, 1.0_wp)
      call gradient_at(probe, high)
      if (.not. allocated(error)) call gradient_at(-probe, low)
      if (.not. allocated(error)) call gradient_at(0.0_wp, low, high)
      if (allocated(error)) return
      call query_curvature_times(query, stepper, factor, along, product, error)
      if (allocated(error)) return
      call check_true(error, maxval(abs(product)) > 0.1_wp, "there is curvature")
      call check_near(error, reshape(product, [size(product)]), low, difference_tol, &
         maxval(abs(product)), "scene " // to_text(k))
      call query_free(query)
      call stepper_close(stepper)

   contains

      !> Sum of factor times gradients; with `other`, at the end, the slope.
      subroutine gradient_at(t, total, other)
         real(wp), intent(in) :: t
         real(wp), allocatable, intent(inout) :: total(:)
         real(wp), intent(in), optional :: other(:)
         type(contact_report_t) :: report
         integer :: i

         call query_constraints(query, stepper, u0, u1 + t*along, .false., report, error)
         if (allocated(error)) return
         if (present(other)) then
            total = (other - total)/(2.0_wp*probe)
            return
         end if
         factor = [(real(i, wp), i = 1, report%n)]
         if (.not. allocated(total)) allocate(total(size(u0)))
         call csr_multiply_transposed(report%discrete_gradient, factor, total)
      end subroutine gradient_at

   end subroutine differ_gradients

   !> P is normal to the discrete gradients of those that act, DF to the gradients at the end.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, n_scene
         call multiply_null_space(k, error)
         if (allocated(error)) return
      end do

   end subroutine test_null_space

   subroutine multiply_null_space(k, error)
      integer, intent(in) :: k
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(snapshot_t) :: after
      type(query_t) :: query
      type(contact_report_t) :: report
      type(csr_t) :: p, d, rows, links
      integer, allocatable :: redundant(:)
      logical, allocatable :: acts(:)

      call open_number(k, stepper, error)
      if (.not. allocated(error)) call go_to_contact(stepper, after, error)
      if (.not. allocated(error)) call query_links(stepper, links, error)
      if (.not. allocated(error)) call query_evaluate(query, stepper, drop_h, after%state%u, &
         .false., error, after%state%contacts%lam, after%state%contacts%is_active)
      if (.not. allocated(error)) call query_null_space(query, p, d, redundant, error)
      if (.not. allocated(error)) call query_constraints(query, stepper, &
         stepper%march%state%u, after%state%u, .true., report, error)
      if (allocated(error)) return
      acts = after%state%contacts%is_active(report%id)
      call check_equal(error, count(acts), count(after%state%contacts%is_active), &
         "all that act are near")
      call check_equal(error, p%n_col, links%n_col - count(acts), "independent unknowns")
      call csr_product(report%discrete_gradient, p, rows)
      call check_rows(rows, "P")
      call csr_product(report%end_gradient, d, rows)
      call check_rows(rows, "DF")
      call query_free(query)
      call stepper_close(stepper)

   contains

      !> Rows of constraints that act vanish, others do not.
      subroutine check_rows(rows, what)
         type(csr_t), intent(in) :: rows
         character(len=*), intent(in) :: what
         real(wp) :: largest
         integer :: i

         call check_equal(error, rows%n_col, p%n_col, what // ", columns")
         do i = 1, rows%n_row
            largest = real(maxval(abs(rows%value(rows%row_start(i) + 1: &
               rows%row_start(i + 1)))), wp)
            if (acts(i)) then
               call check_near(error, largest, 0.0_wp, tol, 1.0_wp, what // ", scene " // &
                  to_text(k))
            else
               call check_true(error, largest > 0.01_wp, what // ", free constraint")
            end if
         end do
      end subroutine check_rows

   end subroutine multiply_null_space

   !> With one condition less there is one unknown more; an old evaluation is not passed off as new.
   subroutine test_follows(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(csr_t) :: before, after
      real(wp), allocatable :: u1(:, :), momenta(:, :)

      call open_number(1, stepper, error)
      if (allocated(error)) return
      u1 = stepper%march%state%u
      call query_evaluate(query, stepper, drop_h, u1, .true., error)
      if (.not. allocated(error)) call query_tangent(query, .true., before, error)
      if (.not. allocated(error)) call stepper_remove_prescribed(stepper, 5, 1, error)
      if (.not. allocated(error)) call query_momenta(query, stepper, momenta, error)
      if (allocated(error)) return
      call query_tangent(query, .true., after, failed)
      call check_error(error, failed, err_input, "no step was evaluated", "old evaluation")
      if (.not. allocated(error)) call query_evaluate(query, stepper, drop_h, u1, .true., error)
      if (.not. allocated(error)) call query_tangent(query, .true., after, error)
      if (allocated(error)) return
      call check_equal(error, after%n_row, before%n_row + 1, "unknowns")
      call query_free(query)
      call stepper_close(stepper)
   end subroutine test_follows

   subroutine test_bad(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: failed
      type(stepper_t) :: stepper, closed
      type(query_t) :: query
      type(csr_t) :: p, d
      integer, allocatable :: redundant(:)
      real(wp), allocatable :: u1(:, :), lam(:)

      call open_number(1, stepper, error)
      if (allocated(error)) return
      u1 = stepper%march%state%u
      lam = stepper%march%state%contacts%lam
      call query_evaluate(query, closed, drop_h, u1, .true., failed)
      call check_error(error, failed, err_input, "there is no model", "closed")
      call query_null_space(query, p, d, redundant, failed)
      call check_error(error, failed, err_input, "no step was evaluated", "too early")
      call query_evaluate(query, stepper, drop_h, u1(:, 2:), .true., failed)
      call check_error(error, failed, err_input, "at each of 16 nodes, not 2 at 15", "shape")
      call query_evaluate(query, stepper, 0.0_wp, u1, .true., failed)
      call check_error(error, failed, err_input, "h > 0", "size")
      call query_evaluate(query, stepper, drop_h, u1, .true., failed, lam=lam(2:))
      call check_error(error, failed, err_input, "3 entries", "multipliers")
      call query_evaluate(query, stepper, drop_h, u1, .false., failed)
      call query_tangent(query, .true., p, failed)
      call check_error(error, failed, err_input, "without tangent", "tangent")
      u1(1, 14) = 5.0_wp
      call query_evaluate(query, stepper, drop_h, u1, .true., failed)
      call check_error(error, failed, err_analysis, "element 5 is inverted", "inverted")
      call query_multipliers(query, stepper, lam, failed)
      call check_error(error, failed, err_input, "no null space", "multipliers")
      call query_free(query)
      call stepper_close(stepper)
   end subroutine test_bad

end module test_stepper_query
