!> Contact and ties for host codes: against scenes with elements, invariants, a host's own loop.
module test_interface
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      formulation_segment, multiplier_dual, multiplier_standard, smoothing_hermite, smoothing_none
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance
   use emcon_stepper_contact, only : query_areas, query_begin_contact, query_choose, &
      query_contact, query_gaps, query_select
   use emcon_stepper_free, only : stepper_step
   use emcon_stepper_host, only : stepper_add_pair, stepper_add_surface, stepper_add_tie, &
      stepper_set_contact, stepper_tie_matrices
   use emcon_stepper_null_space, only : query_follow_links, query_links, query_null_space, &
      query_particular
   use emcon_stepper_report, only : contact_report_t, query_curvature, query_curvature_times
   use emcon_steps, only : initiation_persistent
   use emcon_surface_facets, only : surface_facets
   use emcon_system, only : system_init, system_t
   use emcon_text, only : notes_t, to_text
   use emcon_ties, only : ties_prepare
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_surface, block_t, bottom, make_two_blocks, shake, top
   use sparse_samples, only : dense_of
   use tie_scenes, only : make_disc
   use truss_host, only : face_build, face_n, face_new, face_t, truss_add, truss_begin, &
      truss_energy, truss_momentum, truss_step, truss_t
   implicit none
   private
   public :: collect_interface

   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar]
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Gradients of some 14 coordinates, each of a few dozen roundings.
   real(wp), parameter :: tol = 512.0_wp*eps

   !> Two edges above each other.
   real(wp), parameter :: square(2, 4) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.5_wp, &
      0.0_wp, 0.5_wp], [2, 4])

contains

   subroutine collect_interface(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("bits of the scene with elements", test_bits), &
         test_case_t("identity and momenta", test_identity), &
         test_case_t("second derivatives", test_second), &
         test_case_t("statics", test_statics), &
         test_case_t("areas", test_areas), &
         test_case_t("null space beside a tie", test_null_space), &
         test_case_t("ties: bits of the scene with elements", test_ties), &
         test_case_t("a host's impact", test_impact), &
         test_case_t("bad arguments", test_bad_arguments), &
         test_case_t("calls out of order", test_order)]
   end subroutine collect_interface

   !> The surfaces, pairs and ties of `scene` without its elements.
   subroutine make_interface(scene, options, face, error)
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options
      type(face_t), intent(out) :: face
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: edge(:, :)
      integer :: i, number

      call face_new(face, scene%x, error)
      do i = 1, size(scene%surface)
         if (allocated(error)) return
         call surface_facets(scene, scene%surface(i), edge)
         call stepper_add_surface(face%stepper, scene%surface(i)%name, edge, number, error)
      end do
      do i = 1, size(scene%pair)
         if (allocated(error)) return
         call stepper_add_pair(face%stepper, scene%pair(i)%slave, scene%pair(i)%master, &
            scene%pair(i)%formulation, options, error)
      end do
      do i = 1, size(scene%tie)
         if (allocated(error)) return
         call stepper_add_tie(face%stepper, scene%tie(i)%slave, scene%tie(i)%master, &
            scene%tie(i)%multiplier, scene%tie(i)%tolerance, error)
      end do
   end subroutine make_interface

   !> Two blocks in contact, half a cell of distortion, and the step that they make.
   subroutine make_step(formulation, options, scene, face, u0, du, error)
      integer, intent(in) :: formulation
      type(contact_options_t), intent(in) :: options
      type(scene_t), intent(out) :: scene
      type(face_t), intent(out) :: face
      real(wp), allocatable, intent(out) :: u0(:, :), du(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      logical, allocatable :: held(:, :), none(:), active(:)

      call make_two_blocks(scene, 0.125_wp, lower, upper)
      scene%pair(1)%formulation = formulation
      allocate(u0, du, mold=scene%x)
      call shake(u0, 0.03_wp)
      call shake(du, 0.03_wp)
      call make_interface(scene, options, face, error)
      if (allocated(error)) return
      allocate(held(2, size(u0, 2)), source=.false.)
      call face_build(face, held, error)
      if (allocated(error)) return
      allocate(none(face_n(face)), source=.false.)
      call query_begin_contact(face%query, face%stepper, u0, du, none, active, error)
   end subroutine make_step

   !> Select all constraints that have a surface near, with a gap to hold, and evaluate them.
   subroutine evaluate_all(face, u0, du, values, error)
      type(face_t), intent(inout) :: face
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      type(contact_report_t), intent(out) :: values
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t), allocatable :: state(:)
      integer, allocatable :: id(:)
      real(wp), allocatable :: target(:)
      integer :: i

      call query_gaps(face%query, face%stepper, u0, du, state, error)
      if (allocated(error)) return
      id = pack([(i, i = 1, size(state))], state%is_near)
      allocate(target(size(id)), source=0.0625_wp)
      call query_choose(face%query, face%stepper, u0, du, id, target, error)
      if (.not. allocated(error)) call query_contact(face%query, face%stepper, u0, du, values, &
         error)
   end subroutine evaluate_all

   subroutine test_bits(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      integer :: i, smoothing

      do i = 1, size(formulations)
         do smoothing = smoothing_none, smoothing_hermite
            options%smoothing = smoothing
            call compare(formulations(i), options, error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_bits

   !> Gaps, gradients and second derivatives without elements against those with elements.
   subroutine compare(formulation, options, error)
      integer, intent(in) :: formulation
      type(contact_options_t), intent(in) :: options
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: system
      type(face_t) :: face
      type(contact_report_t) :: values
      type(condition_t), allocatable :: item(:)
      type(gap_state_t), allocatable :: state(:)
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: k, n

      call make_step(formulation, options, scene, face, u0, du, error)
      if (.not. allocated(error)) call system_init(system, scene, error)
      if (.not. allocated(error)) call evaluate_all(face, u0, du, values, error)
      if (allocated(error)) return
      call query_gaps(face%query, face%stepper, u0, du, state, error)
      if (allocated(error)) return
      call check_true(error, values%n >= 3, "there are constraints to compare")
      associate (contact => system%contact(1)%contact)
         contact%rounding = face%query%march%system%contact(1)%contact%rounding
         call contact%configure(scene%x, options)
         call contact%begin_step(scene%x, u0, du)
         call contact%measure(scene%x, u0, du)
         call check_equal(error, values%node, contact%node(values%id), "slave nodes")
         call check_true(error, all(state%is_near .eqv. contact%state%is_near), "is_near")
         call check_near(error, state%gap0, contact%state%gap0, 0.0_wp, 1.0_wp, "gap0")
         call check_near(error, state%gap1, contact%state%gap1, 0.0_wp, 1.0_wp, "gap1")
         allocate(item(values%n))
         call contact%evaluate(values%id, scene%x, u0, du, values%target, item)
      end associate
      do k = 1, values%n
         n = item(k)%n_node
         associate (mine => face%query%march%active%set%item(k))
            call check_equal(error, mine%node(:mine%n_node), item(k)%node(:n), "nodes")
            call check_near(error, mine%g(:, :n), item(k)%g(:, :n), 0.0_wp, 1.0_wp, "g")
            call check_near(error, mine%c(:, :n), item(k)%c(:, :n), 0.0_wp, 1.0_wp, "c")
            call check_near(error, mine%h(:2*n, :2*n), item(k)%h(:2*n, :2*n), 0.0_wp, 1.0_wp, "h")
         end associate
         call check_near(error, [values%gap0(k), values%gap1(k), values%dgap(k), values%size(k)], &
            [item(k)%gap0, item(k)%gap1, item(k)%dgap, item(k)%size], 0.0_wp, 1.0_wp, "values")
      end do
   end subroutine compare

   !> G du = gap1 - gap0; each row of G sums up to 0, and so does its moment at the middle.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      type(scene_t) :: scene
      type(face_t) :: face
      type(contact_report_t) :: values
      real(wp), allocatable :: u0(:, :), du(:, :), g(:, :), row(:, :), middle(:, :)
      real(wp) :: moment
      integer :: i, k

      do i = 1, size(formulations)
         call make_step(formulations(i), options, scene, face, u0, du, error)
         if (.not. allocated(error)) call evaluate_all(face, u0, du, values, error)
         if (allocated(error)) return
         g = real(dense_of(values%discrete_gradient), wp)
         call check_near(error, matmul(g, reshape(du, [size(du)])), values%gap1 - values%gap0, &
            tol, 1.0_wp, "identity")
         middle = scene%x + u0 + 0.5_wp*du
         do k = 1, values%n
            row = reshape(g(k, :), shape(du))
            call check_near(error, sum(row, 2), [0.0_wp, 0.0_wp], tol, 1.0_wp, "forces")
            moment = sum(middle(1, :)*row(2, :) - middle(2, :)*row(1, :))
            call check_near(error, moment, 0.0_wp, tol, 4.0_wp, "moment")
         end do
      end do
   end subroutine test_identity

   !> Curvature against its products, and against differences of the discrete gradients.
   subroutine test_second(error)
      type(error_t), allocatable, intent(out) :: error
      !> The error of a central difference is of the order of its square.
      real(wp), parameter :: width = eps**(1.0_wp/3.0_wp)
      type(contact_options_t) :: options
      type(scene_t) :: scene
      type(face_t) :: face
      type(contact_report_t) :: values
      type(csr_t) :: matrix
      real(wp), allocatable :: u0(:, :), du(:, :), way(:, :), product(:, :), lam(:), change(:)
      integer :: i

      do i = 1, size(formulations)
         call make_step(formulations(i), options, scene, face, u0, du, error)
         if (.not. allocated(error)) call evaluate_all(face, u0, du, values, error)
         if (allocated(error)) return
         if (allocated(way)) deallocate(way, lam)
         allocate(way, mold=du)
         allocate(lam(values%n))
         call shake(way, 1.0_wp)
         call draw_random(lam)
         call query_curvature_times(face%query, face%stepper, lam, way, product, error)
         if (.not. allocated(error)) call query_curvature(face%query, lam, matrix, error)
         if (allocated(error)) return
         call check_near(error, matmul(real(dense_of(matrix), wp), reshape(way, [size(way)])), &
            reshape(product, [size(way)]), tol, 10.0_wp, "curvature times direction")
         call query_contact(face%query, face%stepper, u0, du + width*way, values, error)
         if (allocated(error)) return
         change = matmul(lam, real(dense_of(values%discrete_gradient), wp))
         call query_contact(face%query, face%stepper, u0, du - width*way, values, error)
         if (allocated(error)) return
         change = change - matmul(lam, real(dense_of(values%discrete_gradient), wp))
         change = change/(2.0_wp*width)
         call check_near(error, reshape(product, [size(way)]), change, 100.0_wp*width**2, 10.0_wp, &
            "differences")
      end do
   end subroutine test_second

   !> With `is_end`: gradients at the end, their derivatives, and closed gaps.
   subroutine test_statics(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: width = eps**(1.0_wp/3.0_wp)
      type(contact_options_t) :: options
      type(scene_t) :: scene
      type(face_t) :: face
      type(contact_report_t) :: values
      real(wp), allocatable :: u0(:, :), du(:, :), way(:, :), product(:, :), lam(:), change(:)
      logical, allocatable :: none(:), active(:)
      integer :: i

      do i = 1, size(formulations)
         call make_step(formulations(i), options, scene, face, u0, du, error)
         if (allocated(error)) return
         call stepper_set_contact(face%stepper, initiation_persistent, 0.0_wp, .true., .true., &
            error)
         if (allocated(error)) return
         allocate(none(face_n(face)), source=.false.)
         call query_begin_contact(face%query, face%stepper, u0, du, none, active, error)
         if (.not. allocated(error)) call evaluate_all(face, u0, du, values, error)
         if (allocated(error)) return
         call check_near(error, real(values%discrete_gradient%value, wp), &
            real(values%end_gradient%value, wp), 0.0_wp, &
            1.0_wp, "gradients at the end")
         call check_near(error, values%defect, values%gap1, 0.0_wp, 1.0_wp, "defects")
         allocate(way, mold=du)
         allocate(lam(values%n))
         call shake(way, 1.0_wp)
         call draw_random(lam)
         call query_curvature_times(face%query, face%stepper, lam, way, product, error)
         if (allocated(error)) return
         call query_contact(face%query, face%stepper, u0, du + width*way, values, error)
         if (allocated(error)) return
         change = matmul(lam, real(dense_of(values%discrete_gradient), wp))
         call query_contact(face%query, face%stepper, u0, du - width*way, values, error)
         if (allocated(error)) return
         change = change - matmul(lam, real(dense_of(values%discrete_gradient), wp))
         change = change/(2.0_wp*width)
         call check_near(error, reshape(product, [size(way)]), change, 100.0_wp*width**2, 10.0_wp, &
            "differences")
         active = .false.
         active(values%id) = .true.
         call query_select(face%query, face%stepper, u0, du, active, error)
         if (.not. allocated(error)) call query_contact(face%query, face%stepper, u0, du, values, &
         error)
         if (allocated(error)) return
         call check_near(error, values%target, 0.0_wp*values%target, 0.0_wp, 1.0_wp, "closed gaps")
         deallocate(none, way, lam)
      end do
   end subroutine test_statics

   !> Where all of the slave surface is covered, areas and lengths sum up to its length.
   subroutine test_areas(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      type(face_t) :: face
      real(wp) :: x(2, 7), zero(2, 7)
      real(wp), allocatable :: area(:), length(:)
      logical, allocatable :: held(:, :), none(:), active(:)
      integer :: i, master, slave

      x = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 0.125_wp, 0.625_wp, &
         0.125_wp, 1.25_wp, 0.125_wp, 2.0_wp, 0.125_wp], shape(x))
      zero = 0.0_wp
      allocate(held(2, 7), source=.false.)
      do i = 1, size(formulations)
         call face_new(face, x, error)
         if (.not. allocated(error)) call stepper_add_surface(face%stepper, "LOWER", &
            reshape([2, 1, 3, 2], [2, 2]), master, error)
         if (.not. allocated(error)) call stepper_add_surface(face%stepper, "UPPER", &
            reshape([4, 5, 5, 6, 6, 7], [2, 3]), slave, error)
         if (.not. allocated(error)) call stepper_add_pair(face%stepper, slave, master, &
            formulations(i), options, error)
         if (.not. allocated(error)) call face_build(face, held, error)
         if (allocated(error)) return
         allocate(none(face_n(face)), source=.false.)
         call query_begin_contact(face%query, face%stepper, zero, zero, none, active, error)
         if (.not. allocated(error)) call query_select(face%query, face%stepper, zero, zero, &
            .not. none, error)
         if (.not. allocated(error)) call query_areas(face%query, face%stepper, zero, area, &
            length, error)
         if (allocated(error)) return
         call check_near(error, [sum(area), sum(length)], [2.0_wp, 2.0_wp], tol, 2.0_wp, "sums")
         deallocate(none)
      end do
   end subroutine test_areas

   !> P^T G^T = 0 and C DF = 0, with the master block tied to another one, which is held.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options
      type(scene_t) :: scene
      type(face_t) :: face
      type(block_t) :: lower, upper, base
      type(contact_report_t) :: values
      type(csr_t) :: p, df
      logical, allocatable :: held(:, :), none(:), active(:)
      integer, allocatable :: redundant(:)
      real(wp), allocatable :: u0(:, :), du(:, :), part(:, :), zero(:, :)
      integer :: i

      do i = 1, size(formulations)
         call make_two_blocks(scene, 0.125_wp, lower, upper)
         call add_block(scene, "CPE4", [3, 1], [-2.0_wp, -2.0_wp], [4.0_wp, 1.0_wp], base)
         call add_surface(scene, "UNDER", lower, [bottom])
         call add_surface(scene, "BASE", base, [top])
         scene%pair(1)%formulation = formulations(i)
         call make_interface(scene, options, face, error)
         if (allocated(error)) return
         call stepper_add_tie(face%stepper, 3, 4, multiplier_dual, -1.0_wp, error)
         if (allocated(error)) return
         held = spread(scene%x(2, :) < -1.5_wp, 1, 2)
         call face_build(face, held, error)
         if (allocated(error)) return
         call check_near(error, face%stepper%scene%x, scene%x, 0.0_wp, 1.0_wp, &
            "straight ties move nothing")
         u0 = 0.0_wp*scene%x
         du = u0
         call shake(u0, 0.02_wp)
         call shake(du, 0.02_wp)
         allocate(none(face_n(face)), source=.false.)
         call query_begin_contact(face%query, face%stepper, u0, du, none, active, error)
         if (.not. allocated(error)) call evaluate_all(face, u0, du, values, error)
         if (.not. allocated(error)) call query_null_space(face%query, p, df, redundant, error)
         if (allocated(error)) return
         call check_equal(error, size(redundant), 0, "redundant")
         associate (n_unknown => face%stepper%march%system%space%numbering%n_unknown, n => size(u0))
            call check_equal(error, n_unknown, count(.not. held) - 2*5, "unknowns")
            call check_equal(error, [p%n_row, p%n_col, df%n_row, df%n_col], [n, &
               n_unknown - values%n, n, n_unknown - values%n], "extents")
         end associate
         allocate(zero(values%n, p%n_col), source=0.0_wp)
         call check_near(error, matmul(real(dense_of(values%discrete_gradient), wp), &
            real(dense_of(p), wp)), zero, tol, 10.0_wp, "G P")
         call check_near(error, matmul(real(dense_of(values%end_gradient), wp), &
            real(dense_of(df), wp)), zero, tol, 10.0_wp, "C DF")
         call query_particular(face%query, face%stepper, values%defect, part, error)
         if (allocated(error)) return
         call check_near(error, matmul(real(dense_of(values%end_gradient), wp), &
            reshape(part, [size(part)])), -values%defect, tol, 10.0_wp, "particular motion")
         deallocate(none, zero)
      end do
   end subroutine test_null_space

   !> Discs in holes: rows and moved nodes as with elements, D x = M x, (D - M) T = 0.
   subroutine test_ties(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: multipliers(2) = [multiplier_dual, multiplier_standard]
      type(contact_options_t) :: options
      type(scene_t) :: scene
      type(face_t) :: face
      type(notes_t) :: notes
      type(csr_t) :: d, m, links
      real(wp), allocatable :: rows(:, :), t(:, :), zero(:, :), u(:, :)
      logical, allocatable :: held(:, :)
      integer :: i, a

      do i = 1, 2
         call make_disc(scene, 13, 20, 0.3_wp, .true.)
         deallocate(scene%tie)
         allocate(scene%tie(1))
         scene%tie(1)%name = "DISC"
         scene%tie(1)%slave = 1
         scene%tie(1)%master = 2
         scene%tie(1)%multiplier = multipliers(i)
         allocate(held(2, size(scene%x, 2)), source=.false.)
         call make_interface(scene, options, face, error)
         if (.not. allocated(error)) call face_build(face, held, error)
         if (.not. allocated(error)) call ties_prepare(scene, notes, error)
         if (.not. allocated(error)) call stepper_tie_matrices(face%stepper, 1, d, m, error)
         if (.not. allocated(error)) call query_links(face%stepper, links, error)
         if (allocated(error)) return
         call check_near(error, face%stepper%scene%x, scene%x, 0.0_wp, 1.0_wp, "positions")
         call check_near(error, face%stepper%scene%tie(1)%rows%weight, &
            scene%tie(1)%rows%weight, 0.0_wp, 1.0_wp, "rows")
         rows = real(dense_of(d), wp) - real(dense_of(m), wp)
         call check_near(error, matmul(rows, transpose(face%stepper%scene%x)), &
            0.0_wp*matmul(rows, transpose(face%stepper%scene%x)), tol, 1.0_wp, "D x = M x")
         t = real(dense_of(links), wp)
         allocate(zero(size(rows, 1), size(t, 2)), source=0.0_wp)
         do a = 1, 2
            call check_near(error, matmul(rows, t(a::2, :)), zero, tol, 1.0_wp, "(D - M) T")
         end do
         u = face%stepper%scene%x
         call shake(u, 1.0_wp)
         call query_follow_links(face%stepper, u, error)
         if (allocated(error)) return
         call check_near(error, matmul(rows, transpose(u)), 0.0_wp*matmul(rows, transpose(u)), &
            tol, 1.0_wp, "what follows fulfils the tie")
         deallocate(held, zero)
      end do
   end subroutine test_ties

   !> A truss falls on another one, both free: energy and momenta stay, and they part again.
   subroutine test_impact(error)
      type(error_t), allocatable, intent(out) :: error
      !> A few hundred steps, each a few roundings of the force scale off; the energy is some 10.
      real(wp), parameter :: drift = 4096.0_wp*eps
      integer, parameter :: n_step = 150
      type(truss_t) :: truss
      type(face_t) :: face
      type(contact_options_t) :: options
      logical, allocatable :: held(:, :)
      real(wp) :: energy, momentum(3)
      integer :: i, k, slave, master, n_touch

      do i = 1, size(formulations)
         call truss_begin(truss)
         truss%stiffness = 50.0_wp
         call truss_add(truss, 4, [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], [0.0_wp, 0.25_wp])
         call truss_add(truss, 2, [-0.875_wp, 0.125_wp], [2.0_wp, 1.0_wp], [0.25_wp, -1.0_wp])
         call face_new(face, truss%x, error)
         if (.not. allocated(error)) call stepper_add_surface(face%stepper, "LOWER", &
            reshape([10, 9, 9, 8, 8, 7, 7, 6], [2, 4]), master, error)
         if (.not. allocated(error)) call stepper_add_surface(face%stepper, "UPPER", &
            reshape([11, 12, 12, 13], [2, 2]), slave, error)
         if (.not. allocated(error)) call stepper_add_pair(face%stepper, slave, master, &
            formulations(i), options, error)
         held = spread(0.0_wp*truss%mass > 1.0_wp, 1, 2)
         if (.not. allocated(error)) call face_build(face, held, error)
         if (allocated(error)) return
         allocate(truss%is_active(face_n(face)), source=.false.)
         energy = truss_energy(truss)
         momentum = truss_momentum(truss)
         n_touch = 0
         do k = 1, n_step
            call truss_step(truss, face, 0.02_wp, error)
            if (allocated(error)) return
            if (truss%n_contact > 0) n_touch = n_touch + 1
            call check_near(error, truss_energy(truss), energy, drift, energy, "energy, step " // &
               to_text(k))
            call check_near(error, truss_momentum(truss), momentum, drift, energy, "momenta")
         end do
         call check_true(error, n_touch > 0 .and. n_touch < n_step, "they touch and part")
         call check_true(error, truss%v(2, 12) > truss%v(2, 8), "they have bounced")
      end do
   end subroutine test_impact

   !> The call was refused, in these words.
   subroutine expect(error, refused, text)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable, intent(in) :: refused
      character(len=*), intent(in) :: text

      call check_error(error, refused, err_input, text, text)
   end subroutine expect

   subroutine test_bad_arguments(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(face_t) :: face
      type(contact_options_t) :: options
      real(wp) :: x(2, 4), u(2, 4), none(2, 0)
      logical, allocatable :: active(:)
      integer :: n

      x = square
      u = 0.0_wp
      call face_new(face, none, refused)
      call expect(error, refused, "no nodes")
      u(1, 2) = ieee_value(1.0_wp, ieee_quiet_nan)
      call face_new(face, u, refused)
      call expect(error, refused, "x is not finite at node 2")
      u = 0.0_wp
      call face_new(face, x, refused)
      call refuse_surface([1, 5], "edge(2, 1) is 5, not in 1..4")
      call refuse_surface([1, 2, 3, 3], "edge(:, 2) = 3, 3")
      call refuse_surface([1, 2, 1, 3], "branches at node 1")
      call stepper_add_pair(face%stepper, 1, 2, formulation_nts, options, refused)
      call expect(error, refused, "slave is 1, but there are none")
      call stepper_add_surface(face%stepper, "LOWER", reshape([2, 1], [2, 1]), n, refused)
      call stepper_add_surface(face%stepper, "UPPER", reshape([4, 3], [2, 1]), n, refused)
      call stepper_add_surface(face%stepper, "OTHER", reshape([3, 2], [2, 1]), n, refused)
      call stepper_add_pair(face%stepper, 1, 4, formulation_nts, options, refused)
      call expect(error, refused, "master is 4, not in 1..3")
      call stepper_add_pair(face%stepper, 1, 2, 7, options, refused)
      call expect(error, refused, "formulation is 7")
      options%n_point = 99
      call stepper_add_pair(face%stepper, 1, 2, formulation_mortar, options, refused)
      call expect(error, refused, "n_point is 99")
      options%n_point = 0
      options%normal_angle = -1.0_wp
      call stepper_add_pair(face%stepper, 1, 2, formulation_mortar, options, refused)
      call expect(error, refused, "normal_angle is -1, below 0")
      options%normal_angle = 60.0_wp
      call stepper_add_tie(face%stepper, 2, 2, multiplier_dual, -1.0_wp, refused)
      call expect(error, refused, "both surface UPPER")
      call stepper_add_pair(face%stepper, 2, 3, formulation_nts, options, refused)
      call expect(error, refused, "share node 3")
      call stepper_add_pair(face%stepper, 2, 1, formulation_nts, options, refused)
      call face_build(face, u(:, :3) > 1.0_wp, refused)
      call expect(error, refused, "held is to have 2 flags at each of 4 nodes, not 2 at 3")
      call face_build(face, u > 1.0_wp, refused)
      call check_true(error, .not. allocated(refused), "a call with an error may be repeated")
      call query_begin_contact(face%query, face%stepper, u, u(:, :2), [.false., .false.], active, &
         refused)
      call expect(error, refused, "du is to have 2 components at each of 4 nodes, not 2 at 2")
      call query_begin_contact(face%query, face%stepper, u, u, [.false.], active, refused)
      call expect(error, refused, "was_active is to have 2 entries, not 1")
      call query_begin_contact(face%query, face%stepper, u, u, [.false., .false.], active, refused)
      call query_choose(face%query, face%stepper, u, u, [2, 1], [0.0_wp, 0.0_wp], refused)
      call expect(error, refused, "constraint 1 comes after 2")
      u(1, 3:) = 100.0_wp
      call query_begin_contact(face%query, face%stepper, u, 0.0_wp*u, [.false., .false.], active, &
         refused)
      call query_select(face%query, face%stepper, u, 0.0_wp*u, [.true., .false.], refused)
      call expect(error, refused, "slave node 3 of pair 1")

   contains

      subroutine refuse_surface(edge, text)
         integer, intent(in) :: edge(:)
         character(len=*), intent(in) :: text

         call stepper_add_surface(face%stepper, "BAD", reshape(edge, [2, size(edge)/2]), n, refused)
         call expect(error, refused, text)
      end subroutine refuse_surface

   end subroutine test_bad_arguments

   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(face_t) :: face
      type(contact_options_t) :: options
      type(contact_report_t) :: values
      type(increment_t) :: increment
      type(csr_t) :: p, df
      integer, allocatable :: redundant(:)
      real(wp) :: u(2, 4)
      real(wp), allocatable :: area(:), length(:), part(:, :)
      logical, allocatable :: active(:)
      logical, parameter :: none(2) = .false.
      integer :: n

      u = 0.0_wp
      call stepper_add_surface(face%stepper, "LOWER", reshape([2, 1], [2, 1]), n, refused)
      call expect(error, refused, "there are no nodes")
      call face_new(face, square, refused)
      call stepper_add_surface(face%stepper, "LOWER", reshape([2, 1], [2, 1]), n, refused)
      call stepper_add_surface(face%stepper, "UPPER", reshape([4, 3], [2, 1]), n, refused)
      call stepper_add_pair(face%stepper, 2, 1, formulation_nts, options, refused)
      call query_begin_contact(face%query, face%stepper, u, u, none, active, refused)
      call expect(error, refused, "there is no model")
      call face_build(face, u > 1.0_wp, refused)
      call stepper_add_pair(face%stepper, 1, 2, formulation_nts, options, refused)
      call expect(error, refused, "given before the model is built")
      call stepper_advance(face%stepper, increment, refused)
      call expect(error, refused, "its host makes the steps")
      call stepper_step(face%stepper, 1.0_wp, increment, refused)
      call expect(error, refused, "its host makes the steps")
      call query_contact(face%query, face%stepper, u, u, values, refused)
      call expect(error, refused, "no step of contact was begun")
      call query_areas(face%query, face%stepper, u, area, length, refused)
      call expect(error, refused, "no step of contact was begun")
      call query_begin_contact(face%query, face%stepper, u, u, none, active, refused)
      call query_select(face%query, face%stepper, u, u, .not. none, refused)
      call query_null_space(face%query, p, df, redundant, refused)
      call expect(error, refused, "constraints were selected")
      call query_particular(face%query, face%stepper, [0.0_wp, 0.0_wp], part, refused)
      call expect(error, refused, "there is no null space")
      call stepper_set_contact(face%stepper, 3, 0.0_wp, .true., .false., refused)
      call expect(error, refused, "initiation is 3, not in 1..2")
      call query_begin_contact(face%query, face%stepper, u, u, none, active, refused)
      call query_contact(face%query, face%stepper, u, u, values, refused)
      call check_equal(error, values%n, 0, "a new step begins without a selection")
   end subroutine test_order

end module test_interface
