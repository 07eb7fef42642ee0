!> The constraint set: selection, rows, forces, merged pattern, curvature.
module test_constraints
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving, evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : pick_unknowns
   use emcon_scene, only : scene_t
   use emcon_system, only : system_begin_step, system_init, system_t
   use linear_scenes, only : dense_terms, make_random_rows
   use random_constraints, only : make_problem, problem_t, tol_dp
   use small_scenes, only : add_step, block_t, make_two_blocks, shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_constraints

contains

   subroutine collect_constraints(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rows equal the gradients", test_rows), &
         test_case_t("merged pattern holds N and all pairs", test_merge), &
         test_case_t("curvature", test_curvature), &
         test_case_t("contact forces", test_force), &
         test_case_t("rows, curvature and forces over dependent freedoms", test_dependent), &
         test_case_t("a smaller set after a larger one", test_select), &
         test_case_t("gaps that are kept, in motion and in equilibrium", test_kept), &
         test_case_t("numbers over several pairs", test_place)]
   end subroutine collect_constraints

   !> The gradients of constraint `k` over all unknowns.
   pure subroutine dense_rows(problem, k, g, c)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k
      real(wp), intent(out) :: g(:), c(:)
      integer :: i, a, unknown

      g = 0.0_wp
      c = 0.0_wp
      associate (item => problem%set%item(k))
         do i = 1, item%n_node
            do a = 1, 2
               unknown = problem%numbering%unknown(a, item%node(i))
               if (unknown == 0) cycle
               g(unknown) = item%g(a, i)
               c(unknown) = item%c(a, i)
            end do
         end do
      end associate
   end subroutine dense_rows

   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      real(wp), allocatable :: g(:), c(:), force(:, :), gap(:, :)
      integer :: i, k

      call make_problem(problem)
      allocate(g, c, source=problem%residual)
      force = real(dense_of(problem%set%force_rows), wp)
      gap = real(dense_of(problem%set%gap_rows), wp)
      do k = 1, problem%set%n
         call dense_rows(problem, k, g, c)
         call check_near(error, force(k, :), g, tol_dp, 1.0_wp, "force rows")
         call check_near(error, gap(k, :), c, tol_dp, 1.0_wp, "gap rows")
         associate (rows => problem%set%force_rows)
            do i = rows%row_start(k) + 2, rows%row_start(k + 1)
               call check_true(error, rows%column(i) > rows%column(i - 1), "columns ascend")
            end do
         end associate
      end do
   end subroutine test_rows

   subroutine test_merge(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      logical, allocatable :: expected(:, :), is_in(:, :)
      integer :: i, k, n

      call make_problem(problem)
      n = problem%numbering%n_unknown
      allocate(expected(n, n), is_in(problem%set%n, n))
      expected = abs(dense_of(problem%base)) > 0.0_dp
      is_in = abs(dense_of(problem%set%force_rows)) > 0.0_dp
      do k = 1, problem%set%n
         do i = 1, n
            if (is_in(k, i)) expected(:, i) = expected(:, i) .or. is_in(k, :)
         end do
      end do
      associate (a => problem%matrix)
         call check_equal(error, size(a%column), count(expected), "entries")
         a%value = 1.0_dp
         call check_true(error, all((dense_of(a) > 0.0_dp) .eqv. expected), "places")
         a%value = 0.0_dp
         a%value(problem%slot) = problem%base%value
         call check_near(error, real(dense_of(a), wp), real(dense_of(problem%base), wp), 0.0_wp, &
            1.0_wp, "entries of N")
         do i = 1, n
            do k = a%row_start(i) + 2, a%row_start(i + 1)
               call check_true(error, a%column(k) > a%column(k - 1), "columns ascend")
            end do
         end do
      end associate
   end subroutine test_merge

   !> N - sum of lam_k h_k.
   subroutine test_curvature(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      real(wp), allocatable :: expected(:, :)
      integer :: k, i, j, row, column

      call make_problem(problem)
      expected = real(dense_of(problem%base), wp)
      do k = 1, problem%set%n
         associate (item => problem%set%item(k), unknown => problem%numbering%unknown)
            do j = 1, 2*item%n_node
               do i = 1, 2*item%n_node
                  row = unknown(2 - mod(i, 2), item%node((i + 1)/2))
                  column = unknown(2 - mod(j, 2), item%node((j + 1)/2))
                  if (row == 0 .or. column == 0) cycle
                  expected(row, column) = expected(row, column) - problem%set%lam(k)*item%h(i, j)
               end do
            end do
         end associate
      end do
      call check_near(error, real(dense_of(problem%matrix), wp), expected, tol_dp, 1.0_wp, &
         "N with curvature")
   end subroutine test_curvature

   !> sum of lam_k g_k at all nodes, prescribed or not; sizes are added to what was there.
   subroutine test_force(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      real(wp) :: force(2, 30), magnitude(2, 30), expected(2, 30), sizes(2, 30)
      integer :: k, i

      call make_problem(problem)
      expected = 0.0_wp
      sizes = 5.0_wp
      do k = 1, problem%set%n
         associate (item => problem%set%item(k), lam => problem%set%lam(k))
            do i = 1, item%n_node
               expected(:, item%node(i)) = expected(:, item%node(i)) + lam*item%g(:, i)
               sizes(:, item%node(i)) = sizes(:, item%node(i)) + abs(lam*item%g(:, i))
            end do
         end associate
      end do
      magnitude = 5.0_wp
      call constraints_force(problem%set, 1, force, magnitude)
      call check_near(error, force, expected, tol_dp, 1.0_wp, "force")
      call check_near(error, magnitude, sizes, tol_dp, 1.0_wp, "magnitude")
   end subroutine test_force

   subroutine test_select(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      integer :: none(0)

      call make_problem(problem)
      call constraints_select(problem%set, [4, 9])
      call check_equal(error, problem%set%id, [4, 9], "numbers")
      call check_near(error, problem%set%lam, [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "multipliers")
      call check_true(error, .not. any(problem%set%is_kept), "no gap is kept")
      call constraints_select(problem%set, none)
      call check_equal(error, problem%set%n, 0, "empty set")
   end subroutine test_select

   !> What a gap has changed by since the start is left of one that is kept there, also where forces
   !> are of the end alone.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(evaluation_t) :: evaluation(2)
      real(wp), allocatable :: du(:, :)
      integer :: i, k

      call make_two_blocks(scene, 0.5_wp, lower, upper)
      call add_step(scene, .false., 0.1_wp, 1)
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      evaluation = [evaluation_at_end, evaluation_moving(0.1_wp, 0.1_wp, 1.0_wp)]
      allocate(du, source=scene%x)
      call shake(du, 0.1_wp)
      associate (contact => system%contact(1)%contact)
         call contact%begin_step(scene%x, scene%u0, du)
         call contact%measure(scene%x, scene%u0, du)
         call constraints_select(set, [1, 2, 3])
         do i = 1, size(evaluation)
            motion = motion_of(evaluation(i), scene%x, scene%u0, du)
            do k = 1, 2
               set%is_kept = k == 1
               set%target = merge(contact%state%gap0, 0.25_wp, set%is_kept)
               call constraints_evaluate(set, system, motion)
               call check_near(error, set%defect, contact%state%gap1 - set%target, &
                  64.0_wp*epsilon(1.0_wp), 1.0_wp, "what is left of gaps")
            end do
         end do
      end associate
   end subroutine test_kept

   !> Two pairs of 3 and 5 constraints: numbers 1..3 and 4..8.
   subroutine test_place(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      integer :: pair, i, id

      call make_two_blocks(scene, 0.5_wp, lower, upper)
      scene%pair = [scene%pair, scene%pair]
      scene%pair(2)%slave = 1
      scene%pair(2)%master = 2
      call system_init(system, scene, error)
      if (allocated(error)) return
      call check_equal(error, system%first_constraint, [0, 3, 8], "constraints before each pair")
      do id = 1, system%n_constraint
         call constraint_index(system, id, pair, i)
         call check_equal(error, [pair, i], merge([1, id], [2, id - 3], id <= 3), "place")
      end do
   end subroutine test_place

   !> All are those over all freedoms, times T.
   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(problem_t) :: problem
      real(wp), allocatable :: t(:, :), matrix(:, :), sum_of(:)
      real(wp) :: g(60), c(60), h(60, 60), force(2, 30)
      integer :: i, k

      call make_random_rows(linear)
      call make_problem(problem, linear)
      allocate(t, source=dense_terms(problem%numbering))
      h = 0.0_wp
      associate (set => problem%set)
         do k = 1, set%n
            g = 0.0_wp
            c = 0.0_wp
            associate (item => set%item(k), n => set%item(k)%n_node)
               associate (dof => [(2*item%node((i + 1)/2) - mod(i, 2), i = 1, 2*n)])
                  g(dof) = reshape(item%g(:, :n), [2*n])
                  c(dof) = reshape(item%c(:, :n), [2*n])
                  h(dof, dof) = h(dof, dof) + set%lam(k)*item%h(:2*n, :2*n)
               end associate
            end associate
            call check_near(error, real(row_of(set%force_rows), wp), matmul(g, t), tol_dp, 1.0_wp, &
               "force rows")
            call check_near(error, real(row_of(set%gap_rows), wp), matmul(c, t), tol_dp, 1.0_wp, &
               "gap rows")
         end do
         allocate(matrix, source=real(dense_of(problem%base), wp))
         matrix = matrix - matmul(transpose(t), matmul(h, t))
         call check_near(error, real(dense_of(problem%matrix), wp), matrix, tol_dp, 1.0_wp, &
            "curvature")
         call constraints_force(set, 1, force)
         allocate(sum_of(problem%numbering%n_unknown))
         call pick_unknowns(problem%numbering, force, sum_of)
         call check_near(error, sum_of, matmul(set%lam, real(dense_of(set%force_rows), wp)), &
            tol_dp, 1.0_wp, "forces on the unknowns")
      end associate

   contains

      !> Row `k`, whose columns ascend and come once each.
      function row_of(rows) result(row)
         type(csr_t), intent(in) :: rows
         real(dp) :: row(rows%n_col)
         integer :: s

         row = 0.0_dp
         do s = rows%row_start(k) + 1, rows%row_start(k + 1)
            row(rows%column(s) + 1) = rows%value(s)
            if (s == rows%row_start(k) + 1) cycle
            call check_true(error, rows%column(s) > rows%column(s - 1), "columns ascend")
         end do
      end function row_of

   end subroutine test_dependent

end module test_constraints
