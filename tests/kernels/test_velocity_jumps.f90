!> Impulses of contacts: what is collected of a set, and how it turns with a motion.
module test_velocity_jumps
   use check, only : check_equal, check_near, test_case_t
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_velocity_jumps, only : jumps_add, jumps_begin, jumps_join, jumps_rub, jumps_scale, &
      velocity_jump_t
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_velocity_jumps

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_velocity_jumps(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("impulses of contacts, not of what always holds", test_add), &
         test_case_t("what pushes turn by on a way", test_turn), &
         test_case_t("friction of those that rub", test_rub), &
         test_case_t("a part of all, and others behind", test_parts)]
   end subroutine collect_velocity_jumps

   !> Three conditions of three nodes, the first of which always holds.
   subroutine make_set(set)
      type(constraint_set_t), intent(inout) :: set
      integer :: k

      call constraints_select(set, [4, 7, 9])
      set%n_permanent = 1
      set%lam = [3.0_wp, -2.0_wp, 5.0_wp]
      do k = 1, 3
         associate (item => set%item(k))
            call condition_resize(item, 4)
            item%n_node = 3
            item%n_slave = 1
            item%node = [k, 4, 5, 0]
            call shake(item%c, 1.0_wp)
            call shake(item%h, 1.0_wp)
         end associate
      end do
   end subroutine make_set

   subroutine test_add(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(velocity_jump_t), allocatable :: jump(:)
      real(wp), parameter :: lam(3) = [1.0_wp, 2.0_wp, -4.0_wp]
      integer :: k, round

      call make_set(set)
      do round = 1, 2
         call jumps_begin(jump)
         call check_equal(error, size(jump), 0, "none at first")
         call jumps_add(jump, set, lam)
         call check_equal(error, [size(jump), jump%id, jump%n_slave], [2, 7, 9, 1, 1], "which")
         do k = 1, 2
            call check_equal(error, jump(k)%node, set%item(k + 1)%node(:3), "nodes")
            call check_near(error, jump(k)%impulse, lam(k + 1)*set%item(k + 1)%c(:, :3), tol, &
               4.0_wp, "impulses")
         end do
         do k = 1, 2
            call check_near(error, [jump(k)%lam, jump(k)%slave_moment, jump(k)%master_moment], &
               [lam(k + 1), 0.0_wp, 0.0_wp], tol, 4.0_wp, "without moments")
         end do
      end do
   end subroutine test_add

   !> lam H way is added to the impulses, and the moment of way x lam c to that of each side.
   subroutine test_turn(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(velocity_jump_t), allocatable :: jump(:)
      real(wp) :: way(2, 5), expected(2, 3), moment(3)
      integer :: k, i

      call make_set(set)
      call shake(way, 0.5_wp)
      call jumps_begin(jump)
      call jumps_add(jump, set, [0.0_wp, 2.0_wp, -4.0_wp], way)
      do k = 1, 2
         associate (item => set%item(k + 1), lam => set%lam(k + 1))
            expected = jump(k)%lam*item%c(:, :3) + lam*reshape(matmul(item%h(:6, :6), &
               reshape(way(:, item%node(:3)), [6])), [2, 3])
            call check_near(error, jump(k)%impulse, expected, tol, 8.0_wp, "impulses")
            moment = [(lam*(way(1, item%node(i))*item%c(2, i) &
               - way(2, item%node(i))*item%c(1, i)), i = 1, 3)]
            call check_near(error, [jump(k)%slave_moment, jump(k)%master_moment], &
               [moment(1), moment(2) + moment(3)], tol, 8.0_wp, "moments")
         end associate
      end do
   end subroutine test_turn

   !> The last of two takes friction as well, of impulses appended last alone.
   subroutine test_rub(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: drag(1, 3) = reshape([7.0_wp, 8.0_wp, -0.5_wp], [1, 3]), &
         rubbed(3) = [5.0_wp, 6.0_wp, 0.75_wp]
      type(constraint_set_t) :: set
      type(velocity_jump_t), allocatable :: jump(:), before(:)

      call make_set(set)
      set%item%has_friction = [.true., .false., .true.]
      call condition_resize_slip(set%item(3))
      call shake(set%item(3)%t1(:, :, 1), 1.0_wp)
      call jumps_begin(jump)
      call jumps_add(jump, set, [0.0_wp, 2.0_wp, -4.0_wp])
      call jumps_add(jump, set, [0.0_wp, 1.0_wp, 3.0_wp])
      before = jump
      call jumps_rub(jump, set, drag, rubbed)
      call check_near(error, [jump%rubbed, jump%drag(1)], [0.0_wp, 0.0_wp, 0.0_wp, 0.75_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, -0.5_wp], 0.0_wp, 1.0_wp, "what it takes")
      before(4)%impulse = before(4)%impulse + 0.5_wp*set%item(3)%t1(:, :3, 1)
      call check_near(error, [jump(1)%impulse, jump(2)%impulse, jump(3)%impulse, &
         jump(4)%impulse], [before(1)%impulse, before(2)%impulse, before(3)%impulse, &
         before(4)%impulse], tol, 4.0_wp, "impulses")
   end subroutine test_rub

   subroutine test_parts(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(velocity_jump_t), allocatable :: jump(:), all(:)
      real(wp) :: way(2, 5)
      integer :: k

      call make_set(set)
      call shake(way, 0.5_wp)
      call jumps_begin(jump)
      call jumps_add(jump, set, [0.0_wp, 2.0_wp, -4.0_wp], way)
      call jumps_begin(all)
      call jumps_join(all, jump)
      call jumps_scale(jump, 0.25_wp)
      call jumps_join(all, jump)
      call check_equal(error, all%id, [7, 9, 7, 9], "in their order")
      do k = 1, 2
         call check_near(error, all(k + 2)%impulse, 0.25_wp*all(k)%impulse, 0.0_wp, 1.0_wp, "part")
         call check_near(error, [all(k + 2)%lam, all(k + 2)%slave_moment, &
            all(k + 2)%master_moment], 0.25_wp*[all(k)%lam, all(k)%slave_moment, &
            all(k)%master_moment], 0.0_wp, 1.0_wp, "part of the rest")
      end do
   end subroutine test_parts

end module test_velocity_jumps
