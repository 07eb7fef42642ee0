!> Conjugate gradients with incomplete factors by blocks: products, factors without fill, solutions
!> as good as was asked for, and what happens where there are none.
module test_iterative
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only : real32
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chosen_solver, only : chosen_solver_t
   use emcon_csr, only : csr_from_entries, csr_multiply, csr_t
   use emcon_errors, only : error_t
   use emcon_incomplete_cholesky, only : incomplete_cholesky_backward, &
      incomplete_cholesky_factorise, incomplete_cholesky_forward, incomplete_cholesky_t
   use emcon_iterative_solver, only : iterative_solver_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_node_blocks, only : node_blocks_fill, node_blocks_init, node_blocks_is_of, &
      node_blocks_matrix, node_blocks_multiply, node_blocks_t
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_iterative

   !> Round-off of products, and of solutions to all digits with conditions below 1e3.
   real(dp), parameter :: tol = 1.0e4_dp*epsilon(1.0_dp)
   !> Of factors in single precision.
   real(dp), parameter :: rough_tol = 1.0e3_dp*epsilon(1.0_real32)
   !> Nodes of a small lattice.
   integer, parameter :: n_x = 4, n_y = 3, n_z = 3

contains

   subroutine collect_iterative(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("products and entries of blocks", test_blocks), &
         test_case_t("without fill the factor is complete", test_complete), &
         test_case_t("as good as was asked for", test_accuracy), &
         test_case_t("a coarse space", test_coarse), &
         test_case_t("both halves are the preconditioner", test_halves), &
         test_case_t("row by row or as a whole", test_rows), &
         test_case_t("ends that do not meet", test_ends), &
         test_case_t("threads keep the bits", test_threads), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("a pivot that is lost to the pattern", test_shift), &
         test_case_t("where steps do not do factors are taken", test_not_converged), &
         test_case_t("not definite, not a number", test_indefinite), &
         test_case_t("counts choose", test_choice), &
         test_case_t("nodes tell what factors take", test_prediction), &
         test_case_t("another pattern", test_pattern)]
   end subroutine collect_iterative

   !> Springs between the neighbours of a lattice, those across diagonals too.
   subroutine lattice(nx, ny, nz, mass, a)
      integer, intent(in) :: nx, ny, nz
      real(dp), intent(in) :: mass               !! added to the diagonal
      type(csr_t), intent(out) :: a
      integer :: b, c, at(3), to(3), n, pair(2, 13*nx*ny*nz)
      real(dp) :: way(3, 13*nx*ny*nz)

      n = 0
      do b = 1, nx*ny*nz
         at = [modulo(b - 1, nx), modulo((b - 1)/nx, ny), (b - 1)/(nx*ny)]
         do c = b + 1, min(nx*ny*nz, b + nx*ny + nx + 1)
            to = [modulo(c - 1, nx), modulo((c - 1)/nx, ny), (c - 1)/(nx*ny)]
            if (any(abs(to - at) > 1)) cycle
            n = n + 1
            pair(:, n) = [b, c]
            way(:, n) = real(to - at, dp)
         end do
      end do
      call join(nx*ny*nz, pair(:, :n), way(:, :n), mass, a)
   end subroutine lattice

   !> Springs from each of `m` nodes to others anywhere: whatever the order, factors fill.
   subroutine tangle(m, mass, a)
      integer, intent(in) :: m
      real(dp), intent(in) :: mass
      type(csr_t), intent(out) :: a
      integer :: b, k, n, c(3), pair(2, 3*m)
      real(dp) :: way(3, 3*m)

      n = 0
      do b = 1, m
         c = 1 + modulo([17*b + 5, modulo(b*b, m) + 7, 331*b + 1], m)
         do k = 1, 3
            if (c(k) == b .or. any(c(:k - 1) == c(k))) cycle
            n = n + 1
            pair(:, n) = [b, c(k)]
            way(:, n) = real([k, modulo(b, 3), 1], dp)
         end do
      end do
      call join(m, pair(:, :n), way(:, :n), mass, a)
   end subroutine tangle

   !> Springs of several stiffnesses along `way` between pairs of nodes: the first two have one
   !> unknown, the next two have two, all others three.
   subroutine join(m, pair, way, mass, a)
      integer, intent(in) :: m, pair(:, :)       !! (2, n)
      real(dp), intent(in) :: way(:, :)          !! (3, n)
      real(dp), intent(in) :: mass
      type(csr_t), intent(out) :: a
      integer :: held(m), first(m + 1), i, p, q, s, t, k
      integer, allocatable :: slot(:)
      integer, dimension(36*size(pair, 2) + 3*m) :: row, column
      real(dp) :: value(36*size(pair, 2) + 3*m), stiffness(3, 3)

      held = [(merge(2, merge(1, 0, i <= 4), i <= 2), i = 1, m)]
      first(1) = 0
      do i = 1, m
         first(i + 1) = first(i) + 3 - held(i)
      end do
      row = 0
      column = 0
      value = 0.0_dp
      k = 0
      do i = 1, size(pair, 2)
         stiffness = (1.0_dp + 0.1_dp*modulo(7*pair(1, i) + 3*pair(2, i), 11)) &
            *spread(way(:, i), 2, 3)*spread(way(:, i), 1, 3)/dot_product(way(:, i), way(:, i))
         do t = 1, 2
            do s = 1, 2
               do q = 1, 3
                  do p = 1, 3
                     call add(pair(s, i), pair(t, i), p, q, merge(1, -1, s == t)*stiffness(p, q))
                  end do
               end do
            end do
         end do
      end do
      do i = 1, m
         do p = 1, 3
            call add(i, i, p, p, mass)
         end do
      end do
      call csr_from_entries(a, first(m + 1), first(m + 1), row, column, slot)
      do i = 1, k
         if (slot(i) > 0) a%value(slot(i)) = a%value(slot(i)) + value(i)
      end do

   contains

      subroutine add(b, c, p, q, x)
         integer, intent(in) :: b, c, p, q
         real(dp), intent(in) :: x

         k = k + 1
         if (p > 3 - held(b) .or. q > 3 - held(c)) return
         row(k) = first(b) + p
         column(k) = first(c) + q
         value(k) = x
      end subroutine add

   end subroutine join

   subroutine test_blocks(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a, back
      type(node_blocks_t) :: blocks
      real(dp), allocatable :: x(:), v(:), image(:)
      real(wp), allocatable :: y(:)

      call lattice(n_x, n_y, n_z, 1.0_dp, a)
      call node_blocks_init(blocks, a)
      call check_equal(error, blocks%n_block, n_x*n_y*n_z, "a block for each node")
      if (allocated(error)) return
      call node_blocks_fill(blocks, 0.5_dp, a%value)
      allocate(x(a%n_row), y(a%n_row), v(3*blocks%n_block), image(3*blocks%n_block))
      call random_number(x)
      v = 0.0_dp
      v(blocks%place) = x
      call node_blocks_multiply(blocks, v, image)
      call csr_multiply(a, real(x, wp), y)
      call check_near(error, real(image(blocks%place), wp), 0.5_wp*y, real(tol, wp), &
         maxval(abs(y)), "y")
      if (allocated(error)) return
      call node_blocks_matrix(blocks, 2.0_dp, back)
      call check_true(error, all(back%row_start == a%row_start) &
         .and. all(back%column == a%column), "the pattern again")
      if (.not. allocated(error)) call check_true(error, .not. any(abs(back%value - a%value) &
         > 0.0_dp), "the values again")
      if (.not. allocated(error)) call check_true(error, node_blocks_is_of(blocks, a), &
         "it is known")
   end subroutine test_blocks

   !> A chain of nodes fills nothing: L L^T = A.
   subroutine test_complete(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(node_blocks_t) :: blocks
      type(incomplete_cholesky_t) :: factor
      real(dp), allocatable :: x(:), v(:), image(:)
      logical :: is_definite

      call lattice(20, 1, 1, 1.0_dp, a)
      call node_blocks_init(blocks, a)
      call node_blocks_fill(blocks, 1.0_dp, a%value)
      call incomplete_cholesky_factorise(factor, blocks, is_definite)
      call check_true(error, is_definite .and. .not. factor%shift > 0.0_dp, "definite as it is")
      if (allocated(error)) return
      allocate(x(a%n_row), v(3*blocks%n_block), image(3*blocks%n_block))
      call random_number(x)
      v = 0.0_dp
      v(blocks%place) = x
      call node_blocks_multiply(blocks, v, image)
      call incomplete_cholesky_forward(factor, blocks, image)
      call incomplete_cholesky_backward(factor, blocks, image)
      call check_near(error, real(image, wp), real(v, wp), real(rough_tol, wp), 1.0_wp, "x")
   end subroutine test_complete

   !> Against LAPACK, by more digits with more steps.
   subroutine test_accuracy(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp), parameter :: accuracy(3) = [1.0e-2_dp, 1.0e-6_dp, 0.0_dp]
      type(iterative_solver_t) :: solver
      type(csr_t) :: a
      real(dp), allocatable :: exact(:, :), b(:, :)
      real(wp), allocatable :: x(:)
      real(dp) :: wrong, whole
      logical :: is_singular
      integer :: i, before

      call lattice(n_x, n_y, n_z, 0.5_dp, a)
      allocate(b(a%n_row, 1), exact(a%n_row, 1), x(a%n_row))
      call random_number(b)
      call dense_solve(dense_of(a), b, exact, is_singular)
      before = 0
      do i = 1, size(accuracy)
         solver%accuracy = accuracy(i)
         call start(solver, a, error)
         if (.not. allocated(error)) call solver%solve(real(b(:, 1), wp), x, error)
         if (allocated(error)) return
         ! The energy of the error beside that of the solution: the residual's size bounds it but
         ! for what the factor lacks, less than a factor of ten here.
         wrong = energy(a, real(x, dp) - exact(:, 1))
         whole = energy(a, exact(:, 1))
         call check_true(error, solver%is_converged, "converged")
         if (.not. allocated(error)) call check_true(error, &
            wrong <= (10.0_dp*max(accuracy(i), tol))**2*whole, "as good as was asked for")
         if (.not. allocated(error)) call check_true(error, solver%n_step > before, "more steps")
         if (allocated(error)) return
         before = solver%n_step
      end do
      call solver%free()
   end subroutine test_accuracy

   !> A long lattice with little mass: what moves it as a whole takes many steps, and few once its
   !> rigid motions are known, in groups. One of them that comes twice changes nothing.
   subroutine test_coarse(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_long = 60, n_mode = 7
      real(dp), parameter :: accuracy = 1.0e-9_dp
      type(iterative_solver_t) :: solver
      type(csr_t) :: a
      real(dp), allocatable :: mode(:, :)
      real(wp), allocatable :: b(:), x(:), coarse(:), again(:)
      integer :: n_step

      call lattice(n_long, 3, 3, 1.0e-6_dp, a)
      allocate(b(a%n_row), x(a%n_row), coarse(a%n_row), again(a%n_row), mode(a%n_row, n_mode))
      call random_number(b)
      call find_modes(n_long, 3, mode)
      solver%accuracy = accuracy
      call start(solver, a, error)
      if (.not. allocated(error)) call solver%solve(b, x, error)
      if (allocated(error)) return
      n_step = solver%n_step
      call solver%take_modes(mode)
      call solver%factorise(a%value, error)
      if (.not. allocated(error)) call solver%solve(b, coarse, error)
      if (.not. allocated(error)) call solver%solve(b, again, error)
      if (allocated(error)) return
      call check_true(error, solver%is_converged .and. 3*solver%n_step < n_step, "fewer steps")
      if (.not. allocated(error)) call check_true(error, energy(a, real(coarse - x, dp)) &
         <= (10.0_dp*accuracy)**2*energy(a, real(x, dp)), "the same solution")
      if (.not. allocated(error)) call check_true(error, .not. any(abs(again - coarse) > 0.0_wp), &
         "the same bits again")
      if (allocated(error)) return
      ! A force that only moves groups as a whole is met at once.
      call csr_multiply(a, real(mode(:, 1), wp), b)
      call solver%solve(b, coarse, error)
      if (allocated(error)) return
      call check_true(error, solver%n_step == 0, "a motion of the coarse space takes no step")
      if (.not. allocated(error)) call check_near(error, coarse, real(mode(:, 1), wp), &
         real(rough_tol, wp), 1.0_wp, "and is found")
   end subroutine test_coarse

   !> Rigid motions of a lattice, the first translation twice.
   pure subroutine find_modes(n_long, n_wide, mode)
      integer, intent(in) :: n_long, n_wide
      real(dp), intent(out) :: mode(:, :)        !! (n, 7)
      real(dp) :: at(3), own(3, size(mode, 2))
      integer :: b, n, p, q, m, row

      mode = 0.0_dp
      row = 0
      b = 0
      do while (row < size(mode, 1))
         at = real([modulo(b, n_long), modulo(b/n_long, n_wide), b/(n_long*n_wide)], dp)
         own = 0.0_dp
         m = 3
         do p = 1, 3
            own(p, p) = 1.0_dp
            do q = p + 1, 3
               m = m + 1
               own(p, m) = -at(q)
               own(q, m) = at(p)
            end do
         end do
         b = b + 1
         n = merge(1, merge(2, 3, b <= 4), b <= 2)   ! unknowns of the first nodes, see `join`
         mode(row + 1:row + n, :) = own(:n, :)
         row = row + n
      end do
      mode(:, 7) = mode(:, 1)
   end subroutine find_modes

   !> x.A x
   real(dp) function energy(a, x)
      type(csr_t), intent(in) :: a
      real(dp), intent(in) :: x(:)
      real(wp) :: y(size(x))

      call csr_multiply(a, real(x, wp), y)
      energy = dot_product(x, real(y, dp))
   end function energy

   subroutine start(solver, a, error)
      type(iterative_solver_t), intent(inout) :: solver
      type(csr_t), intent(in) :: a
      type(error_t), allocatable, intent(out) :: error

      call solver%analyse(a, error)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
   end subroutine start

   !> (L^-T L^-1) is symmetric, and near A^-1 where there is little fill.
   subroutine test_halves(error)
      type(error_t), allocatable, intent(out) :: error
      type(iterative_solver_t) :: solver
      type(csr_t) :: a
      real(dp), allocatable :: b(:, :), x(:, :), y(:), image(:)
      integer :: i

      call lattice(n_x, n_y, n_z, 20.0_dp, a)
      call start(solver, a, error)
      if (allocated(error)) return
      allocate(b(a%n_row, 2), x(a%n_row, 2), y(a%n_row), image(a%n_row))
      call random_number(b)
      do i = 1, 2
         call solver%solve_half(.false., b(:, i), y)
         call solver%solve_half(.true., y, x(:, i))
      end do
      call check_near(error, real(dot_product(b(:, 1), x(:, 2)), wp), &
         real(dot_product(b(:, 2), x(:, 1)), wp), real(rough_tol, wp), &
         real(abs(dot_product(b(:, 1), x(:, 2))), wp), "symmetric")
      if (allocated(error)) return
      call solver%multiply(x(:, 1), image)
      call check_near(error, real(image, wp), &
         real(b(:, 1), wp), 0.1_wp, real(maxval(abs(b)), wp), "near the inverse")
   end subroutine test_halves

   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      type(iterative_solver_t) :: solver
      type(csr_t) :: a
      real(wp), allocatable :: b(:), x(:), y(:)

      call lattice(n_x, n_y, n_z, 0.5_dp, a)
      allocate(b(a%n_row), x(a%n_row), y(a%n_row))
      call random_number(b)
      solver%accuracy = 1.0e-3_dp
      call start(solver, a, error)
      if (.not. allocated(error)) call solver%solve(b, x, error)
      a%value = 2.0_dp**70*a%value
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (.not. allocated(error)) call solver%solve(b, y, error)
      if (.not. allocated(error)) call check_true(error, &
         .not. any(abs(x - 2.0_wp**70*y) > 0.0_wp), "the same bits")
   end subroutine test_powers_of_two

   !> Squares of what each of n by n points differs by from the mean of its four neighbours on a
   !> torus, as of a plate, with a little mass: far from dominated by its diagonal.
   subroutine plate(n, mass, a)
      integer, intent(in) :: n
      real(dp), intent(in) :: mass
      type(csr_t), intent(out) :: a
      integer, parameter :: m = 5
      real(dp), parameter :: part(m) = [1.0_dp, -0.25_dp, -0.25_dp, -0.25_dp, -0.25_dp]
      integer, allocatable :: slot(:)
      integer, dimension((m*n)**2) :: row, column
      integer :: of(m), p, q, i, k
      real(dp) :: value((m*n)**2)

      k = 0
      do q = 0, n - 1
         do p = 0, n - 1
            of = 1 + modulo([p, p - 1, p + 1, p, p], n) + n*modulo([q, q, q, q - 1, q + 1], n)
            do i = 1, m
               row(k + 1:k + m) = of(i)
               column(k + 1:k + m) = of
               value(k + 1:k + m) = part(i)*part
               k = k + m
            end do
            value(k - m**2 + 1) = value(k - m**2 + 1) + mass
         end do
      end do
      call csr_from_entries(a, n*n, n*n, row, column, slot)
      do k = 1, size(slot)
         a%value(slot(k)) = a%value(slot(k)) + value(k)
      end do
   end subroutine plate

   !> Of such a matrix what is lost to the pattern takes pivots below zero.
   subroutine test_shift(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: m = 7, n = m*m
      type(csr_t) :: a
      type(node_blocks_t) :: blocks
      type(incomplete_cholesky_t) :: factor
      type(iterative_solver_t) :: solver
      real(dp) :: b(n, 1), exact(n, 1)
      real(wp) :: x(n)
      logical :: is_definite, is_singular

      call plate(m, 0.01_dp, a)
      call node_blocks_init(blocks, a)
      call node_blocks_fill(blocks, 1.0_dp, a%value)
      call incomplete_cholesky_factorise(factor, blocks, is_definite)
      call check_true(error, is_definite .and. factor%shift > 0.0_dp, "the diagonal was raised")
      if (allocated(error)) return
      call random_number(b)
      call start(solver, a, error)
      if (.not. allocated(error)) call solver%solve(real(b(:, 1), wp), x, error)
      if (allocated(error)) return
      call dense_solve(dense_of(a), b, exact, is_singular)
      call check_near(error, x, real(exact(:, 1), wp), real(tol, wp), maxval(abs(x)), "x")
   end subroutine test_shift

   !> One step at most: the solution is the factor's, and the next matrix is tried by iterations.
   subroutine test_not_converged(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(dp), allocatable :: exact(:, :), b(:, :)
      real(wp), allocatable :: x(:)
      logical :: is_singular
      integer :: i

      call lattice(n_x, n_y, n_z, 0.5_dp, a)
      allocate(b(a%n_row, 1), exact(a%n_row, 1), x(a%n_row))
      call random_number(b)
      call dense_solve(dense_of(a), b, exact, is_singular)
      call make_chosen(solver, 1.0e-4_dp, .true.)
      call solver%analyse(a, error)
      if (allocated(error)) return
      select type (solver)
      type is (chosen_solver_t)
         call check_true(error, solver%iterates, "it iterates")
         solver%iterative%most_steps = 1
      end select
      do i = 1, 2
         if (.not. allocated(error)) call solver%factorise(a%value, error)
         if (.not. allocated(error)) call solver%solve(real(b(:, 1), wp), x, error)
         if (allocated(error)) return
         call check_near(error, x, real(exact(:, 1), wp), real(tol, wp), maxval(abs(x)), "x")
         if (.not. allocated(error)) call check_true(error, solver%is_converged, "a solution")
         if (allocated(error)) return
         select type (solver)
         type is (chosen_solver_t)
            call check_equal(error, solver%n_failure, i, "matrices that were factorised")
         end select
      end do
      call solver%free()
   end subroutine test_not_converged

   !> What a deck gets by SOLVER=ITERATIVE or by none.
   subroutine make_chosen(solver, accuracy, prefers_iterations)
      class(sparse_solver_t), allocatable, intent(out) :: solver
      real(dp), intent(in) :: accuracy
      logical, intent(in) :: prefers_iterations

      call solver_create(solver_default, matrix_definite, solver)
      solver%accuracy = accuracy
      select type (solver)
      type is (chosen_solver_t)
         solver%prefers_iterations = prefers_iterations
      end select
   end subroutine make_chosen

   !> A symmetric matrix that is not definite may have an incomplete factor: it is solved by what
   !> solves any matrix. What has a negative first pivot, or no value, has no factor.
   subroutine test_indefinite(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(wp), allocatable :: x(:), b(:), y(:)
      integer :: i, k

      call lattice(n_x, n_y, n_z, 0.5_dp, a)
      allocate(x(a%n_row), b(a%n_row), y(a%n_row))
      call random_number(b)
      call make_chosen(solver, 1.0e-4_dp, .true.)
      call solver%analyse(a, error)
      if (allocated(error)) return
      ! Each unknown by itself is held, but a rigid motion is pushed on.
      do i = 1, a%n_row
         k = a%row_start(i) + findloc(a%column(a%row_start(i) + 1:a%row_start(i + 1)), i - 1, 1)
         a%value(k) = a%value(k) - 0.6_dp
      end do
      call solver%factorise(a%value, error)
      if (allocated(error)) return
      call check_true(error, .not. solver%is_singular, "its incomplete factor tells nothing")
      if (.not. allocated(error)) call solver%solve(b, x, error)
      if (allocated(error)) return
      call csr_multiply(a, x, y)
      call check_near(error, y, b, real(tol, wp), maxval(abs(b)), "A x")
      if (.not. allocated(error)) call solver%factorise(-a%value, error)
      if (.not. allocated(error)) call check_true(error, solver%is_singular, "a negative pivot")
      a%value(5) = ieee_value(1.0_dp, ieee_quiet_nan)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (.not. allocated(error)) call check_true(error, solver%is_singular, "not a number")
      call solver%free()
   end subroutine test_indefinite

   !> Exact solutions are those of factors, and so are those of a strip, whose factors have few
   !> entries; not so those of a tangle.
   subroutine test_choice(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: strip, knot
      integer :: i

      call lattice(100, 6, 1, 1.0_dp, strip)
      call tangle(2500, 1.0_dp, knot)
      do i = 1, 3
         call make_chosen(solver, merge(0.0_dp, 0.1_dp, i == 1), .false.)
         solver%needs_halves = .true.
         if (i /= 2) call solver%analyse(knot, error)
         if (i == 2) call solver%analyse(strip, error)
         if (allocated(error)) return
         call check_true(error, solver%is_incomplete .eqv. i == 3, "what counts say")
         if (allocated(error)) return
         call solver%free()
      end do
   end subroutine test_choice

   !> The same bits; a row that is no number leaves no factor, until the next matrix.
   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: whole, rows
      type(csr_t) :: a
      real(dp), allocatable :: b(:), x(:), y(:)
      real(dp) :: broken
      integer :: i, pass

      call lattice(n_x, n_y, n_z, 0.5_dp, a)
      allocate(b(a%n_row), x(a%n_row), y(a%n_row))
      call random_number(b)
      call make_chosen(whole, 0.1_dp, .true.)
      call make_chosen(rows, 0.1_dp, .true.)
      call whole%analyse(a, error)
      if (.not. allocated(error)) call whole%factorise(a%value, error)
      if (.not. allocated(error)) call whole%solve_half(.false., b, x, error)
      if (.not. allocated(error)) call rows%analyse(a, error)
      if (.not. allocated(error)) call check_true(error, rows%takes_rows(), "it takes rows")
      do pass = 1, 2
         if (allocated(error)) return
         broken = merge(ieee_value(1.0_dp, ieee_quiet_nan), 1.0_dp, pass == 1)
         do i = 1, a%n_row
            associate (first => a%row_start(i) + 1, last => a%row_start(i + 1))
               call rows%take_row(i, merge(broken, 1.0_dp, i == 7)*a%value(first:last), error)
            end associate
            if (allocated(error)) return
         end do
         call rows%factorise_rows(error)
         if (.not. allocated(error)) call check_true(error, rows%is_singular .eqv. pass == 1, &
            "no number")
      end do
      if (.not. allocated(error)) call rows%solve_half(.false., b, y, error)
      if (.not. allocated(error)) call check_true(error, .not. any(abs(x - y) > 0.0_dp), "bits")
      call whole%free()
      call rows%free()
   end subroutine test_rows

   !> Rows of an end meet none of the other, and both have as many; the middle is the smallest.
   subroutine test_ends(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_long = 20
      type(csr_t) :: a
      type(node_blocks_t) :: blocks
      integer :: b, extent(3)

      call lattice(n_long, n_y, n_z, 1.0_dp, a)
      call node_blocks_init(blocks, a)
      extent = [blocks%first_row(2:), blocks%n_block] - blocks%first_row
      call check_true(error, abs(extent(1) - extent(2)) <= extent(3) &
         .and. extent(3) <= 2*n_y*n_z, "two ends and a middle")
      do b = blocks%first_row(2) + 1, blocks%first_row(3)
         if (.not. allocated(error)) call check_true(error, all(blocks%column( &
            blocks%row_start(b) + 1:blocks%row_start(b + 1)) > blocks%first_row(2)), "apart")
      end do
   end subroutine test_ends

   !> Of a matrix that is large enough for threads to share it.
   subroutine test_threads(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_thread = 3
      type(iterative_solver_t) :: solver(n_thread)
      type(csr_t) :: a
      real(dp), allocatable :: v(:), y(:, :, :)
      real(wp), allocatable :: b(:), x(:, :)
      integer :: t

      call lattice(20, 10, 8, 0.5_dp, a)
      allocate(b(a%n_row), v(a%n_row), x(a%n_row, n_thread), y(a%n_row, n_thread, n_thread), &
         source=0.0_dp)
      call random_number(b)
      v = real(b, dp)
      do t = 1, n_thread
         solver(t)%accuracy = 1.0e-6_dp
         call solver(t)%let_threads(t)
         call start(solver(t), a, error)
         if (.not. allocated(error)) call solver(t)%solve(b, x(:, t), error)
         if (allocated(error)) return
         call solver(t)%solve_half(.false., v, y(:, 1, t))
         call solver(t)%solve_half(.true., v, y(:, 2, t))
         call solver(t)%multiply(v, y(:, 3, t))
         call check_true(error, .not. any(abs(x(:, t) - x(:, 1)) > 0.0_wp) &
            .and. .not. any(abs(y(:, :, t) - y(:, :, 1)) > 0.0_dp), "bits")
         call solver(t)%free()
         if (allocated(error)) return
      end do
      call check_true(error, all(abs(x(:, 1)) > 0.0_wp), "something is solved")
   end subroutine test_threads

   !> The order of the nodes tells about as many operations and entries as that of the unknowns:
   !> within a half, as orders are found by heuristics.
   subroutine test_prediction(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(dp) :: operations(2), entries(2)
      integer :: i

      call lattice(9, 8, 7, 1.0_dp, a)
      do i = 1, 2
         call make_chosen(solver, merge(0.1_dp, 0.0_dp, i == 1), i == 1)
         call solver%analyse(a, error)
         if (allocated(error)) return
         call check_true(error, solver%is_incomplete .eqv. i == 1, "iterations first")
         if (allocated(error)) return
         operations(i) = solver%n_operation
         entries(i) = real(solver%n_factor, dp)
         call solver%free()
      end do
      call check_true(error, abs(log(operations(1)/operations(2))) < log(1.5_dp), "operations")
      if (.not. allocated(error)) call check_true(error, abs(log(entries(1)/entries(2))) &
         < log(1.5_dp), "entries")
   end subroutine test_prediction

   subroutine test_pattern(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a, other
      real(wp), allocatable :: x(:), b(:), y(:)
      integer :: i

      call lattice(n_x, n_y, n_z, 2.0_dp, a)
      call lattice(n_y, n_z, n_x, 2.0_dp, other)
      call make_chosen(solver, 1.0e-8_dp, .true.)
      do i = 1, 3
         if (i == 2) call solver%analyse(other, error)
         if (i /= 2) call solver%analyse(a, error)
         if (allocated(error)) return
         call check_equal(error, solver%n_analysis, i, "patterns analysed")
         if (allocated(error)) return
         if (allocated(b)) deallocate(b, x, y)
         allocate(b(a%n_row), x(a%n_row), y(a%n_row))
         call random_number(b)
         if (i == 2) call solver%factorise(other%value, error)
         if (i /= 2) call solver%factorise(a%value, error)
         if (.not. allocated(error)) call solver%solve(b, x, error)
         if (allocated(error)) return
         if (i == 2) call csr_multiply(other, x, y)
         if (i /= 2) call csr_multiply(a, x, y)
         call check_near(error, y, b, 1.0e-6_wp, maxval(abs(b)), "A x")
         if (allocated(error)) return
      end do
      call solver%analyse(a, error)
      if (.not. allocated(error)) call check_equal(error, solver%n_analysis, 3, "it is known")
      call solver%free()
   end subroutine test_pattern

end module test_iterative
