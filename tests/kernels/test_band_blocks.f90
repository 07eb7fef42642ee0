!> Blocks of band matrices against the dense solution.
module test_band_blocks
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_band_blocks, only : band_blocks_factorise, band_blocks_init, band_blocks_place, &
      band_blocks_solve, band_blocks_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   implicit none
   private
   public :: collect_band_blocks

   !> Blocks of one row, a wide band, a narrow one, a triangle.
   integer, parameter :: start(5) = [0, 1, 7, 15, 19], lower(4) = [0, 3, 1, 0], &
      upper(4) = [0, 2, 1, 3], n_rhs(4) = [2, 3, 1, 0]
   !> Round-off of a few rows with a diagonal above the sum of the rest.
   real(wp), parameter :: tol = 1.0e2_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

contains

   subroutine collect_band_blocks(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("solutions are those of the dense blocks", test_solve), &
         test_case_t("rows are exchanged where the diagonal is zero", test_pivoting), &
         test_case_t("a singular block is told", test_singular)]
   end subroutine collect_band_blocks

   !> Random blocks, dense and as bands; the diagonal has `add` in addition.
   subroutine make_blocks(add, blocks, dense)
      real(dp), intent(in) :: add
      type(band_blocks_t), intent(out) :: blocks
      real(dp), intent(out) :: dense(8, 8, 4)
      integer :: b, i, j
      real(dp) :: u

      call band_blocks_init(blocks, start, lower, upper)
      dense = 0.0_dp
      do b = 1, 4
         do i = 1, start(b + 1) - start(b)
            do j = max(1, i - lower(b)), min(start(b + 1) - start(b), i + upper(b))
               call random_number(u)
               if (i == j) u = u + add
               dense(i, j, b) = u
               blocks%value(band_blocks_place(blocks, b, i, j)) = u
            end do
         end do
      end do
   end subroutine make_blocks

   subroutine test_solve(error)
      type(error_t), allocatable, intent(out) :: error
      type(band_blocks_t) :: blocks
      real(dp) :: dense(8, 8, 4), rhs(28), x(28), expected(8, 3)
      integer :: b, n, before, pass
      logical :: is_singular

      call make_blocks(6.0_dp, blocks, dense)
      call band_blocks_factorise(blocks)
      call check_true(error, .not. blocks%is_singular, "it is regular")
      call random_number(rhs)
      do pass = 1, 2
         x = rhs
         call band_blocks_solve(blocks, pass == 2, n_rhs, x)
         before = 0
         do b = 1, 4
            n = start(b + 1) - start(b)
            if (pass == 2) dense(:n, :n, b) = transpose(dense(:n, :n, b))
            call dense_solve(dense(:n, :n, b), reshape(rhs(before + 1:before + n*n_rhs(b)), &
               [n, n_rhs(b)]), expected(:n, :n_rhs(b)), is_singular)
            call check_near(error, real(reshape(x(before + 1:before + n*n_rhs(b)), &
               [n, n_rhs(b)]), wp), real(expected(:n, :n_rhs(b)), wp), tol, 1.0_wp, "solution")
            before = before + n*n_rhs(b)
         end do
         call check_equal(error, before, size(rhs), "all right-hand sides are looked at")
      end do
   end subroutine test_solve

   !> [0 1; 1 0] x = [2; 3].
   subroutine test_pivoting(error)
      type(error_t), allocatable, intent(out) :: error
      type(band_blocks_t) :: blocks
      real(dp) :: x(2)

      call band_blocks_init(blocks, [0, 2], [1], [1])
      blocks%value([band_blocks_place(blocks, 1, 1, 2), band_blocks_place(blocks, 1, 2, 1)]) &
         = 1.0_dp
      call band_blocks_factorise(blocks)
      call check_true(error, .not. blocks%is_singular, "it is regular")
      x = [2.0_dp, 3.0_dp]
      call band_blocks_solve(blocks, .false., [1], x)
      call check_near(error, real(x, wp), [3.0_wp, 2.0_wp], 0.0_wp, 1.0_wp, "x")
   end subroutine test_pivoting

   subroutine test_singular(error)
      type(error_t), allocatable, intent(out) :: error
      type(band_blocks_t) :: blocks
      real(dp) :: dense(8, 8, 4)

      call make_blocks(6.0_dp, blocks, dense)
      blocks%value(band_blocks_place(blocks, 1, 1, 1)) = 0.0_dp
      call band_blocks_factorise(blocks)
      call check_true(error, blocks%is_singular, "the first block is zero")
   end subroutine test_singular

end module test_band_blocks
