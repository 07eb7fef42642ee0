!> Guards: one for each direction in which no pair holds the nodes.
module test_guards
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chain, only : chain_init, chain_t
   use emcon_errors, only : error_t
   use emcon_guard_slack_plane, only : guard_slack_depth, guard_slack_init, guard_slack_t
   use emcon_guards, only : corner_slack, guard_slack, guards_find
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use small_scenes, only : scene_begin
   implicit none
   private
   public :: collect_guards

contains

   subroutine collect_guards(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("nodes of the master", test_master), &
         test_case_t("nodes of both sides", test_mortar), &
         test_case_t("no direction twice", test_once), &
         test_case_t("a surface with itself", test_self), &
         test_case_t("surfaces of nodes, and pairs without guards", test_none), &
         test_case_t("corners, smooth sides, hollow ones", test_depth)]
   end subroutine collect_guards

   !> The guards of `pair` must be those from `slave` on `master`, in this order.
   subroutine expect(error, pair, slave, master)
      type(error_t), allocatable, intent(inout) :: error
      type(contact_pair_t), intent(in) :: pair(:)
      integer, intent(in) :: slave(:), master(:)
      type(contact_pair_t), allocatable :: guard(:)
      type(surface_t) :: surface(4)

      surface(4)%is_nodal = .true.
      call guards_find(pair, surface, guard)
      call check_equal(error, guard%slave, slave, "slaves")
      call check_equal(error, guard%master, master, "masters")
      call check_true(error, all(guard%formulation == formulation_nts), "node to segment")
      call check_true(error, all(guard%both_sides .and. guard%slack == guard_slack), "slack")
      call check_true(error, all(guard%is_reverse .eqv. guard%slave /= pair(guard%of_pair)%slave), &
         "sides of the pair")
   end subroutine expect

   subroutine test_master(error)
      type(error_t), allocatable, intent(out) :: error

      call expect(error, [contact_pair_t(slave=1, master=2)], [2], [1])
      call expect(error, [contact_pair_t(slave=1, master=2), contact_pair_t(slave=3, master=1)], &
         [2, 1], [1, 3])
   end subroutine test_master

   subroutine test_mortar(error)
      type(error_t), allocatable, intent(out) :: error

      call expect(error, [contact_pair_t(slave=1, master=2, formulation=formulation_mortar)], &
         [1, 2], [2, 1])
   end subroutine test_mortar

   subroutine test_once(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: pair(2)

      pair = [contact_pair_t(slave=1, master=2), contact_pair_t(slave=2, master=1)]
      call expect(error, pair, [integer ::], [integer ::])
      pair%formulation = formulation_mortar
      call expect(error, pair, [1, 2], [2, 1])
   end subroutine test_once

   subroutine test_self(error)
      type(error_t), allocatable, intent(out) :: error

      call expect(error, [contact_pair_t(slave=3, master=3)], [3], [3])
      call expect(error, [contact_pair_t(slave=3, master=3, both_sides=.true.)], [integer ::], &
         [integer ::])
   end subroutine test_self

   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error

      call expect(error, [contact_pair_t(slave=4, master=2)], [integer ::], [integer ::])
      call expect(error, [contact_pair_t(slave=1, master=2, is_guarded=.false.)], [integer ::], &
         [integer ::])
   end subroutine test_none

   !> The closed chain through nodes in turn.
   subroutine chain_build(chain, x, node, error)
      type(chain_t), intent(out) :: chain
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node(:)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      type(scene_t) :: scene
      type(surface_t) :: surface

      call scene_begin(scene)
      scene%x = x
      scene%u0 = 0.0_wp*x
      surface%edge = reshape([node, cshift(node, 1)], [2, size(node)], order=[2, 1])
      call chain_init(chain, scene, surface, failure)
      if (allocated(failure)) error = failure
   end subroutine chain_build

   !> A regular polygon of unit radius, the body inside, in another one that is hollow; a square.
   subroutine test_depth(error)
      type(error_t), allocatable, intent(out) :: error
      type(guard_slack_t) :: guard
      real(wp), parameter :: eps = epsilon(1.0_wp), pi = acos(-1.0_wp)
      real(wp) :: x(2, 36), turn, edge, own
      type(chain_t) :: inner, outer, square
      integer :: i

      x(:, :12) = reshape([(cos(i*pi/6), sin(i*pi/6), i = 1, 12)], [2, 12])
      x(:, 13:32) = reshape([(cos(i*pi/10), sin(i*pi/10), i = 1, 20)], [2, 20])
      x(:, 33:) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp], [2, 4])
      call chain_build(inner, x, [(i, i = 1, 12)], error)
      call chain_build(outer, x, [(i, i = 32, 13, -1)], error)
      call chain_build(square, x, [(i, i = 33, 36)], error)
      own = 2.0_wp*sin(pi/12)
      edge = 2.0_wp*sin(pi/20)
      turn = 0.125_wp*(pi/6*own + pi/10*edge)
      call guard_slack_init(guard, inner, outer, x, guard_slack)
      call check_near(error, guard_slack_depth(guard, 1, 1, own, edge), guard_slack*edge + turn, &
         64.0_wp*eps, 1.0_wp, "polygons of one curve")
      call guard_slack_init(guard, inner, square, x, guard_slack)
      call check_near(error, guard_slack_depth(guard, 1, 1, own, 1.0_wp), guard_slack*own, &
         64.0_wp*eps, 1.0_wp, "over a flat side")
      call guard_slack_init(guard, square, inner, x, guard_slack)
      call check_near(error, guard_slack_depth(guard, 1, 1, 1.0_wp, own), corner_slack*own, &
         64.0_wp*eps, 1.0_wp, "a corner")
   end subroutine test_depth

end module test_guards
