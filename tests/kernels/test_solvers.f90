!> All direct solvers keep one contract: the same answers, refusals and bits.
module test_solvers
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_find, csr_from_entries, csr_t
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_create, solver_default, solver_mumps, &
      solver_row, solver_row_t, n_solver_row
   use emcon_sparse_solver, only : matrix_definite, matrix_general, matrix_symmetric, &
      solver_renew, sparse_solver_t
   use sparse_samples, only : dense_of, quad_mesh_matrix
   implicit none
   private
   public :: collect_solvers

   !> Round-off of a factorisation, for matrices whose condition is below 1e4.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

   !> Solves nothing, and counts.
   type, extends(sparse_solver_t) :: counting_t
      integer :: n_factorisation = 0
   contains
      procedure :: analyse => counting_analyse
      procedure :: factorise => counting_factorise
      procedure :: solve => counting_solve
      procedure :: free => counting_free
   end type counting_t

   integer, parameter :: kinds(3) = [matrix_general, matrix_definite, matrix_symmetric]

contains

   subroutine collect_solvers(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("all against LAPACK", test_all), &
         test_case_t("without symmetry", test_general), &
         test_case_t("same bits again", test_same_bits), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("no factorisation, then one", test_singular), &
         test_case_t("negative pivots of a saddle point", test_saddle_point), &
         test_case_t("a dependent constraint is one less", test_dependent), &
         test_case_t("the same values are factorised once", test_renew), &
         test_case_t("wrong order of calls", test_misuse)]
   end subroutine collect_solvers

   !> Factors are made anew for other values, for another pattern, and where nobody counts those.
   subroutine test_renew(error)
      type(error_t), allocatable, intent(out) :: error
      type(counting_t) :: solver
      type(csr_t) :: a

      call solver_renew(solver, [1.0_dp, 2.0_dp], error)
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 2.0_dp], error)
      if (.not. allocated(error)) call check_equal(error, solver%n_factorisation, 2, "not analysed")
      if (.not. allocated(error)) call solver%analyse(a, error)
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 2.0_dp], error)
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 2.0_dp], error)
      if (.not. allocated(error)) call check_equal(error, solver%n_factorisation, 3, "the same")
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 3.0_dp], error)
      if (.not. allocated(error)) call check_equal(error, solver%n_factorisation, 4, "others")
      if (.not. allocated(error)) call solver%analyse(a, error)
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 3.0_dp], error)
      if (.not. allocated(error)) call check_equal(error, solver%n_factorisation, 5, "pattern")
      if (.not. allocated(error)) call solver_renew(solver, [1.0_dp, 3.0_dp, 0.0_dp], error)
      if (.not. allocated(error)) call check_equal(error, solver%n_factorisation, 6, "longer")
   end subroutine test_renew

   subroutine counting_analyse(self, matrix, error)
      class(counting_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      type(error_t), allocatable, intent(out) :: error

      if (matrix%n_row == 0) self%n_analysis = self%n_analysis + 1
   end subroutine counting_analyse

   subroutine counting_factorise(self, value, error)
      class(counting_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)
      type(error_t), allocatable, intent(out) :: error

      self%is_singular = size(value) == 0
      self%n_factorisation = self%n_factorisation + 1
   end subroutine counting_factorise

   subroutine counting_solve(self, rhs, x, error)
      class(counting_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      x = rhs
      self%is_singular = .true.
   end subroutine counting_solve

   subroutine counting_free(self)
      class(counting_t), intent(inout) :: self

      self%n_factorisation = 0
   end subroutine counting_free

   !> Each choice and each kind of matrix, with a pattern that is analysed once.
   subroutine test_all(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(wp) :: b(60), x(60)
      real(dp) :: expected(60, 1)
      type(solver_row_t) :: row
      logical :: is_singular
      integer :: i, k, pass

      call quad_mesh_matrix(5, 4, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      do i = 1, n_solver_row()
         row = solver_row(i)
         if (.not. row%is_built) cycle
         do k = 1, size(kinds)
            call solver_create(row%code, kinds(k), solver)
            do pass = 1, 2
               a%value = 3.0_dp*a%value
               call solve(solver, a, b, x, error)
               if (allocated(error)) return
               call dense_solve(dense_of(a), reshape(real(b, dp), [60, 1]), expected, is_singular)
               call check_near(error, x, real(expected(:, 1), wp), tol, maxval(abs(x)), &
                  trim(row%word))
               if (allocated(error)) return
            end do
            call check_equal(error, solver%n_analysis, 1, "analyses")
            if (allocated(error)) return
            call check_true(error, solver%n_factor >= 60, "entries of the factors")
            if (allocated(error)) return
            call solver%free()
         end do
      end do
   end subroutine test_all

   subroutine test_general(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(wp) :: b(60), x(60)
      real(dp) :: expected(60, 1)
      logical :: is_singular

      call quad_mesh_matrix(5, 4, 0.5_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call dense_solve(dense_of(a), reshape(real(b, dp), [60, 1]), expected, is_singular)
      call solver_create(solver_mumps, matrix_general, solver)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call check_near(error, x, real(expected(:, 1), wp), tol, maxval(abs(x)), "x")
      if (allocated(error)) return
      call check_equal(error, solver%n_negative, -1, "negative pivots are not counted")
      call solver%free()
   end subroutine test_general

   !> Two objects in turn, on a matrix large enough for dense kernels.
   subroutine test_same_bits(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 2*41*41
      class(sparse_solver_t), allocatable :: solver, other
      type(csr_t) :: a
      real(wp), allocatable :: b(:), x(:), y(:)
      integer :: k

      allocate(b(n), x(n), y(n))
      call quad_mesh_matrix(40, 40, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      do k = 1, size(kinds)
         call solver_create(solver_mumps, kinds(k), solver)
         call solver_create(solver_mumps, kinds(k), other)
         call solve(solver, a, b, x, error)
         if (allocated(error)) return
         call solve(other, a, -b, y, error)
         if (.not. allocated(error)) call solve(other, a, b, y, error)
         if (allocated(error)) return
         call check_near(error, y, x, 0.0_wp, 1.0_wp, "x")
         if (allocated(error)) return
         call solver%free()
         call other%free()
      end do
   end subroutine test_same_bits

   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: powers(4) = [-60, -41, 37, 60]
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a, scaled
      real(wp) :: b(220), x(220), y(220)
      integer :: k, p

      call quad_mesh_matrix(10, 9, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      scaled = a
      do k = 1, size(kinds)
         call solver_create(solver_mumps, kinds(k), solver)
         call solve(solver, a, b, x, error)
         if (allocated(error)) return
         do p = 1, size(powers)
            scaled%value = scale(a%value, powers(p))
            call solve(solver, scaled, b, y, error)
            if (allocated(error)) return
            call check_near(error, scale(y, powers(p)), x, 0.0_wp, 1.0_wp, "x of 2^k A")
            if (allocated(error)) return
         end do
         call solver%free()
      end do
   end subroutine test_powers_of_two

   !> A row of zeros, a NaN, a missing row in the pattern's values; an indefinite "definite" one.
   subroutine test_singular(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      type(error_t), allocatable :: raised
      real(dp), allocatable :: good(:)
      real(wp) :: x(60)
      integer :: i, k, fault

      call quad_mesh_matrix(5, 4, 0.0_dp, a, error)
      if (allocated(error)) return
      good = a%value
      do k = 1, size(kinds)
         call solver_create(solver_mumps, kinds(k), solver)
         call solver%analyse(a, error)
         if (allocated(error)) return
         do fault = 1, 3
            a%value = good
            select case (fault)
            case (1)
               a%value = 0.0_dp
            case (2)
               a%value(4) = ieee_value(1.0_dp, ieee_quiet_nan)
            case (3)
               if (kinds(k) /= matrix_definite) cycle
               i = csr_find(a, 60, 60)
               a%value(i) = -a%value(i)
            end select
            call solver%factorise(a%value, error)
            if (allocated(error)) return
            call check_true(error, solver%is_singular, "is not factorised")
            if (allocated(error)) return
            call solver%solve(spread(1.0_wp, 1, 60), x, raised)
            call check_error(error, raised, err_internal, "no factorisation", "solve")
            if (allocated(error)) return
         end do
         a%value = good
         call solve(solver, a, spread(1.0_wp, 1, 60), x, error)
         if (allocated(error)) return
         call solver%free()
      end do
   end subroutine test_singular

   !> [A, B^T; B, 0] with A definite has as many negative pivots as B has rows, all independent.
   subroutine test_saddle_point(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a
      real(wp) :: b(63), x(63)
      real(dp) :: expected(63, 1)
      logical :: is_singular

      call saddle_point([1, 20, 41], a, error)
      if (allocated(error)) return
      call random_number(b)
      call dense_solve(dense_of(a), reshape(real(b, dp), [63, 1]), expected, is_singular)
      call solver_create(solver_mumps, matrix_symmetric, solver)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call check_near(error, x, real(expected(:, 1), wp), tol, maxval(abs(x)), "x")
      if (allocated(error)) return
      call check_equal(error, solver%n_negative, 3, "negative pivots")
      call solver%free()
   end subroutine test_saddle_point

   !> Twice the same row: no factorisation, or fewer negative pivots than rows by round-off.
   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(csr_t) :: a

      call saddle_point([1, 20, 20], a, error)
      if (allocated(error)) return
      call solver_create(solver_mumps, matrix_symmetric, solver)
      call solver%analyse(a, error)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (allocated(error)) return
      call check_true(error, solver%is_singular .or. solver%n_negative < 3, "it is found out")
      call solver%free()
   end subroutine test_dependent

   subroutine test_misuse(error)
      type(error_t), allocatable, intent(out) :: error
      class(sparse_solver_t), allocatable :: solver
      type(error_t), allocatable :: raised
      type(csr_t) :: empty, a
      real(wp) :: x(60)
      integer :: pass

      call solver_create(solver_mumps, matrix_general, solver)
      call solver%factorise([1.0_dp], raised)
      call check_error(error, raised, err_internal, "before", "factorise before analyse")
      if (allocated(error)) return
      call solver%solve([1.0_wp], x(:1), raised)
      call check_error(error, raised, err_internal, "no factorisation", "solve before factorise")
      if (allocated(error)) return
      call solver%analyse(empty, raised)
      call check_error(error, raised, err_internal, "0 x 0", "no rows")
      if (allocated(error)) return
      call quad_mesh_matrix(5, 4, 0.0_dp, a, error)
      do pass = 1, 2
         if (.not. allocated(error)) call solve(solver, a, spread(1.0_wp, 1, 60), x, error)
         call solver%free()
         call solver%free()
      end do
      call solver_create(solver_default, matrix_general, solver)
   end subroutine test_misuse

   !> A definite matrix of 60 unknowns, bordered by rows that hold single unknowns.
   subroutine saddle_point(held, full, error)
      integer, intent(in) :: held(:)
      type(csr_t), intent(out) :: full
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: row(:), column(:), slot(:)
      integer :: i, k, n

      call quad_mesh_matrix(5, 4, 0.0_dp, a, error)
      if (allocated(error)) return
      n = size(a%column)
      allocate(row(n + 2*size(held)), column(n + 2*size(held)))
      do i = 1, a%n_row
         row(a%row_start(i) + 1:a%row_start(i + 1)) = i
      end do
      column(:n) = a%column + 1
      do k = 1, size(held)
         row(n + 2*k - 1:n + 2*k) = [held(k), a%n_row + k]
         column(n + 2*k - 1:n + 2*k) = [a%n_row + k, held(k)]
      end do
      call csr_from_entries(full, a%n_row + size(held), a%n_row + size(held), row, column, slot)
      full%value(slot(:n)) = a%value
      full%value(slot(n + 1:)) = 1.0_dp
   end subroutine saddle_point

   subroutine solve(solver, a, b, x, error)
      class(sparse_solver_t), intent(inout) :: solver
      type(csr_t), intent(in) :: a
      real(wp), intent(in), contiguous :: b(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      x = 0.0_wp
      call solver%analyse(a, error)
      if (allocated(error)) return
      call solver%factorise(a%value, error)
      if (allocated(error)) return
      call solver%solve(b, x, error)
   end subroutine solve

end module test_solvers
