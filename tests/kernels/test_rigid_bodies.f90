!> What rows leave of the motions of rigid bodies.
module test_rigid_bodies
   use check, only : check_equal, test_case_t
   use emcon_errors, only : error_t
   use emcon_free_motions, only : find_assemblies, find_free_motions
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_rank
   use emcon_mechanisms, only : mechanisms_find, mechanisms_t
   use emcon_mechanism_rows, only : mechanism_rows_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_init, system_t
   use random_draws, only : draw_random
   use small_scenes, only : add_block, block_t, make_block
   implicit none
   private
   public :: collect_rigid_bodies

contains

   subroutine collect_rigid_bodies(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("number of motions, by singular values", test_rank)]
   end subroutine collect_rigid_bodies

   !> Append the row: sum of weight times displacement = 0.
   subroutine add_row(rows, dof, weight)
      type(mechanism_rows_t), intent(inout) :: rows
      integer, intent(in) :: dof(:)
      real(wp), intent(in) :: weight(:)

      if (.not. allocated(rows%start)) then
         allocate(rows%start(1), source=0)
         allocate(rows%dof(0), rows%weight(0))
      end if
      rows%n = rows%n + 1
      rows%dof = [rows%dof, dof]
      rows%weight = [rows%weight, weight/sum(abs(weight))]
      rows%start = [rows%start, size(rows%dof)]
   end subroutine add_row

   !> Rows with random weights at random nodes of five blocks, more and more of them, each followed
   !> by what it and the row before add up to: what is left has the dimension that singular values
   !> tell.
   subroutine test_rank(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 5, n_row = 15
      real(dp), parameter :: rank_tol = 1.0e3_dp*max(epsilon(1.0_dp), real(epsilon(1.0_wp), dp))
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(mechanism_rows_t) :: rows
      real(wp) :: r(8, n_row), a(2*n_row, 3*n)
      integer :: dof(4, n_row), i, k, m, rank

      call make_block(scene, "CPE4", [1, 1], block)
      do i = 2, n
         call add_block(scene, "CPE4", [1, 1], [2.0_wp*real(i, wp), 0.0_wp], [1.0_wp, 1.0_wp], &
            block)
      end do
      call system_init(system, scene, error)
      if (allocated(error)) return
      call draw_random(r)
      dof = 1 + int(r(:4, :)*real(8*n, wp))
      r = r + 0.5_wp
      do k = 1, n_row
         m = max(1, k - 1)
         call add_row(rows, dof(:, k), r(5:, k))
         call add_row(rows, [dof(:, k), dof(:, m)], [r(5:, k), r(5:, m)])
         call fill_row(a(2*k - 1, :), dof(:, k), r(5:, k))
         call fill_row(a(2*k, :), [dof(:, k), dof(:, m)], [r(5:, k), r(5:, m)])
         call dense_rank(real(a(:2*k, :), dp), rank_tol, rank, error)
         if (allocated(error)) return
         call check_equal(error, count_motions(rows, system, scene), 3*n - rank, "motions left")
         if (allocated(error)) return
      end do
      call check_equal(error, rank, 3*n, "all are held in the end")

   contains

      !> A row on the motions (1, 0), (0, 1), (-y, x) of all blocks; the origin does not matter.
      subroutine fill_row(row, dof, weight)
         real(wp), intent(out) :: row(:)
         integer, intent(in) :: dof(:)
         real(wp), intent(in) :: weight(:)
         integer :: s, j

         row = 0.0_wp
         do s = 1, size(dof)
            associate (x => scene%x(:, (dof(s) + 1)/2), b => system%space%body((dof(s) + 1)/2))
               j = 3*b - 1 - mod(dof(s), 2)
               row(j) = row(j) + weight(s)
               row(3*b) = row(3*b) + weight(s)*merge(-x(2), x(1), mod(dof(s), 2) == 1)
            end associate
         end do
      end subroutine fill_row

   end subroutine test_rank

   !> Dimension of all that rows leave.
   integer function count_motions(rows, system, scene)
      type(mechanism_rows_t), intent(in) :: rows
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(mechanisms_t) :: bodies
      type(mechanism_rows_t) :: sorted
      integer, allocatable :: assembly(:), order(:)
      real(dp), allocatable :: z(:, :)
      real(dp) :: noise
      integer :: i, k, n_assembly

      sorted = rows
      call mechanisms_find(system, scene, scene%x, rows, .true., .true., bodies)
      call find_assemblies(bodies, sorted, assembly, n_assembly, order)
      count_motions = 0
      do i = 1, n_assembly
         call find_free_motions(bodies, sorted, pack(order, assembly(sorted%low(order)) == i), &
            pack([(k, k = 1, bodies%n)], assembly == i), z, noise)
         count_motions = count_motions + size(z, 2)
      end do
   end function count_motions

end module test_rigid_bodies
