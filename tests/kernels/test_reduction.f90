!> The matrix assembled over the unknowns is T^T N T of the one over all freedoms.
module test_reduction
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t, evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_motion, only : motion_of
   use emcon_numbering, only : numbering_init, numbering_t, pick_unknowns
   use emcon_reduction, only : freedom_numbers, reduction_init, reduction_t
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_steps, only : load_pressure, load_t, method_saddle_point, prescribed_t
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_term_registry, only : terms_mass_values
   use emcon_text, only : to_text
   use linear_scenes, only : add_equation, add_node, add_tie_by_hand, begin_rows, dense_terms, &
      put_row
   use small_scenes, only : add_block, add_load, add_step, block_node, block_t, clamp, prescribe, &
      scene_begin, shake, young
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_reduction

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_reduction(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("short rows", test_short), &
         test_case_t("long rows", test_long), &
         test_case_t("statics, with pressure stiffness", test_static), &
         test_case_t("a symmetric matrix stays one", test_symmetric), &
         test_case_t("mass", test_mass), &
         test_case_t("twice the same", test_repeat), &
         test_case_t("rows that are too long", test_too_full)]
   end subroutine collect_reduction

   !> Two blocks of unlike meshes, one on the other; nodes along the upper block's bottom follow two
   !> or, `is_long`, all nodes of the lower block's top, then a bare node drives the right side of
   !> the upper block in x and a mean of displacements in y is another one. Pressure acts on the
   !> edges beside the seam. Some freedoms are prescribed, among them one that others follow.
   subroutine make_scene(is_static, is_long, scene)
      logical, intent(in) :: is_static, is_long
      type(scene_t), intent(out) :: scene
      type(block_t) :: lower, upper
      type(load_t) :: load
      integer :: k, bare, slave(4), master(5, 4)
      real(wp) :: weight(5, 4), at

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 2], [0.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE3", [3, 2], [0.0_wp, 0.0_wp], [4.0_wp, 1.0_wp], upper)
      slave = [(block_node(upper, k, 0), k = 0, 3)]
      if (is_long) then
         do k = 1, 4
            master(:, k) = [block_node(lower, 0, 2), block_node(lower, 1, 2), &
               block_node(lower, 2, 2), block_node(lower, 3, 2), block_node(lower, 4, 2)]
            weight(:, k) = [0.5_wp, 0.25_wp, 0.5_wp, -0.125_wp, -0.125_wp]
            if (k > 2) weight(:, k) = weight(5:1:-1, k)
         end do
         call add_tie_by_hand(scene, slave, master, weight, [0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp])
      else
         do k = 1, 4
            at = min(3.0_wp, real(int(scene%x(1, slave(k))), wp))
            master(1, k) = block_node(lower, int(at), 2)
            master(2, k) = block_node(lower, int(at) + 1, 2)
            weight(2, k) = scene%x(1, slave(k)) - at
            weight(1, k) = 1.0_wp - weight(2, k)
         end do
         call add_tie_by_hand(scene, slave, master(:2, :), weight(:2, :), &
            [0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp])
      end if
      call add_node(scene, [5.0_wp, 0.5_wp], bare)
      do k = 1, 2
         call add_equation(scene, [block_node(upper, 3, k), bare], [1, 1], [2.0_wp, -2.0_wp])
      end do
      call add_equation(scene, [bare, block_node(upper, 0, 2), block_node(upper, 1, 2), &
         block_node(upper, 2, 2), block_node(upper, 3, 2)], [2, 2, 2, 2, 2], &
         [-1.0_wp, 0.25_wp, 0.25_wp, 0.25_wp, 0.25_wp])
      call add_step(scene, is_static, 0.25_wp, 4)
      call clamp(scene%step(1), [1])
      call prescribe(scene%step(1), block_node(lower, 1, 2), 2, 0.1_wp)
      call prescribe(scene%step(1), block_node(upper, 3, 0), 1, 0.0_wp)
      load%kind = load_pressure
      load%value = 0.5_wp*young
      load%target = 8                            ! the lower block's last element, right and top
      load%place = 2
      call add_load(scene%step(1), load)
      load%place = 3
      call add_load(scene%step(1), load)
      load%target = 9                            ! the upper block's first triangle, bottom
      load%place = 1
      call add_load(scene%step(1), load)
   end subroutine make_scene

   !> The system with eliminated constraints, and the one without any.
   subroutine make_systems(scene, reduced, full, error)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(out) :: reduced, full
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: other

      call system_init(reduced, scene, error)
      if (allocated(error)) return
      call system_begin_step(reduced, scene, 1, error)
      if (allocated(error)) return
      other = scene
      other%step(1)%contact%method = method_saddle_point
      call system_init(full, other, error)
      if (allocated(error)) return
      call system_begin_step(full, other, 1, error)
   end subroutine make_systems

   !> Respond in both systems at the same random state and compare matrices and residuals. An entry
   !> of T^T N T is a sum of some 100 terms, each of which is rounded a few times.
   subroutine compare(scene, evaluation, error)
      type(scene_t), intent(in) :: scene
      type(evaluation_t), intent(in) :: evaluation
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: reduced, full
      real(wp), allocatable :: u0(:, :), v0(:, :), du(:, :), t(:, :), expected(:, :), found(:, :)
      real(wp), allocatable :: residual(:), sum_of(:)

      call make_systems(scene, reduced, full, error)
      if (allocated(error)) return
      allocate(u0, v0, du, source=scene%x)
      call shake(u0, 0.05_wp)
      call shake(v0, 1.0_wp)
      call shake(du, 0.05_wp)
      call system_respond(reduced, motion_of(evaluation, scene%x, u0, du, v0), .true.)
      call system_respond(full, motion_of(evaluation, scene%x, u0, du, v0), .true.)
      call check_true(error, .not. allocated(reduced%response%refusal), "a response")
      allocate(t, source=dense_terms(reduced%space%numbering))
      t = t(full%space%numbering%dof, :)
      expected = matmul(transpose(t), matmul(real(dense_of(full%matrix), wp), t))
      found = real(dense_of(reduced%matrix), wp)
      call check_true(error, reduced%space%numbering%n_dependent >= 8, "freedoms depend")
      call check_near(error, found, expected, 128.0_wp*eps, maxval(abs(expected)), "T^T N T")
      allocate(residual(reduced%space%numbering%n_unknown), sum_of(full%space%numbering%n_unknown))
      call pick_unknowns(reduced%space%numbering, reduced%response%residual, residual)
      call pick_unknowns(full%space%numbering, full%response%residual, sum_of)
      call check_near(error, residual, matmul(transpose(t), sum_of), 128.0_wp*eps, &
         maxval(abs(sum_of)), "T^T r")
      call check_true(error, all(reduced%space%reduction%side%value == 0.0_dp), "side cleared")
   end subroutine compare

   subroutine test_short(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene

      call make_scene(.false., .false., scene)
      call compare(scene, scheme%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp), error)
   end subroutine test_short

   subroutine test_long(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene

      call make_scene(.false., .true., scene)
      call compare(scene, scheme%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp), error)
   end subroutine test_long

   subroutine test_static(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_static_t) :: scheme
      type(scene_t) :: scene
      integer :: k

      do k = 1, 2
         call make_scene(.true., k == 2, scene)
         call compare(scene, scheme%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp), error)
         if (allocated(error)) return
      end do
   end subroutine test_static

   !> Without pressure the tangent of gradients at the end is symmetric; so is the reduced one.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_static_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: reduced, full
      real(wp), allocatable :: u(:, :), a(:, :)

      call make_scene(.true., .true., scene)
      deallocate(scene%step(1)%load)
      allocate(scene%step(1)%load(0))
      call make_systems(scene, reduced, full, error)
      if (allocated(error)) return
      allocate(u, source=scene%x)
      call shake(u, 0.05_wp)
      call system_respond(reduced, motion_of(scheme%evaluation(instant_t(), 0.25_wp), scene%x, &
         0.0_wp*u, u), .true.)
      call check_true(error, reduced%is_symmetric, "known as symmetric")
      a = real(dense_of(reduced%matrix), wp)
      call check_near(error, a, transpose(a), 128.0_wp*eps, maxval(abs(a)), "symmetry")
   end subroutine test_symmetric

   !> T^T M T, and the sum of all entries in x over the rigid translation.
   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: reduced, full
      real(wp), allocatable :: t(:, :), expected(:, :), found(:, :)
      type(csr_t) :: mass

      call make_scene(.false., .true., scene)
      deallocate(scene%step(1)%prescribed)
      allocate(scene%step(1)%prescribed(0))
      call make_systems(scene, reduced, full, error)
      if (allocated(error)) return
      allocate(t, source=dense_terms(reduced%space%numbering))
      t = t(full%space%numbering%dof, :)
      mass = full%matrix
      call terms_mass_values(full%term, mass%value)
      expected = matmul(transpose(t), matmul(real(dense_of(mass), wp), t))
      mass = reduced%matrix
      call terms_mass_values(reduced%term, mass%value)
      found = real(dense_of(mass), wp)
      call check_near(error, found, expected, 128.0_wp*eps, maxval(abs(expected)), "T^T M T")
      call check_near(error, sum(found), 2.0_wp*8.0_wp, 1.0e3_wp*eps, 16.0_wp, &
         "mass of both blocks, in both directions")
   end subroutine test_mass

   !> Two responses in a row, with another one in between, give the same bits.
   subroutine test_repeat(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: reduced, full
      real(wp), allocatable :: u(:, :), other(:, :)
      real(dp), allocatable :: first(:)
      integer :: k

      call make_scene(.false., .false., scene)
      call make_systems(scene, reduced, full, error)
      if (allocated(error)) return
      allocate(u, other, source=scene%x)
      call shake(u, 0.05_wp)
      call shake(other, 0.05_wp)
      do k = 1, 3
         call system_respond(reduced, motion_of(scheme%evaluation(instant_t(), 0.25_wp), scene%x, &
            u, merge(other, u, k == 2)), .true.)
         if (k == 1) first = reduced%matrix%value
         call check_true(error, all(reduced%matrix%value == first) .eqv. k /= 2, &
            "bits of response " // to_text(k))
      end do
   end subroutine test_repeat

   !> Ten freedoms that all follow the same 200 others: the product would take 10*(200 + ...) times
   !> 200 terms against an otherwise diagonal matrix.
   subroutine test_too_full(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      type(reduction_t) :: reduction
      type(prescribed_t) :: nothing(0)
      type(csr_t) :: full, matrix
      integer, allocatable :: slot(:), number(:), list(:)
      integer :: i, n_follow, k
      logical :: is_too_full, is_alive(2, 105)
      real(wp) :: weight(201)

      weight(:200) = -1.0_wp/200.0_wp
      weight(201) = 1.0_wp
      is_alive = .true.
      do n_follow = 0, 10, 5
         call begin_rows(linear)
         do k = 1, n_follow
            call put_row(linear, 200 + k, [(i, i = 1, 200), 200 + k], weight)
         end do
         if (n_follow > 0) then
            call numbering_init(numbering, is_alive, nothing, linear)
         else
            call numbering_init(numbering, is_alive, nothing)
         end if
         call check_equal(error, numbering%n_dependent, n_follow, "dependent freedoms")
         if (allocated(error)) return
         allocate(number, source=freedom_numbers(numbering))
         list = number([(i, i = 1, 210)])
         call csr_from_elements(full, 210, [(i, i = 1, 211)], list, slot, error)
         if (allocated(error)) return
         ! 64 terms per entry of 210 are 13440; each long row takes 200*200.
         call reduction_init(reduction, numbering, full, matrix, slot, is_too_full)
         call check_true(error, is_too_full .eqv. n_follow > 0, "too full")
         if (n_follow == 0) call check_equal(error, matrix%n_row, 210, "rows of the matrix")
         deallocate(number)
      end do
   end subroutine test_too_full

end module test_reduction
