!> Guards: one for each direction in which no pair holds the nodes.
module test_guards
   use check, only : check_equal, check_true, test_case_t
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_errors, only : error_t
   use emcon_guard_slack_plane, only : guard_slack_find
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
         test_case_t("corners, smooth sides, hollow corners", test_depth)]
   end subroutine collect_guards

   !> The guards of `pair` must be those from `slave` on `master`, in this order.
   subroutine expect(error, pair, slave, master)
      type(error_t), allocatable, intent(inout) :: error
      type(contact_pair_t), intent(in) :: pair(:)
      integer, intent(in) :: slave(:), master(:)
      type(contact_pair_t), allocatable :: guard(:), damped(:)
      type(surface_t) :: surface(4)

      surface(4)%is_nodal = .true.
      allocate(damped, source=pair)
      damped%interaction%friction = 0.25_wp
      damped%interaction%damping%coefficient = 2.0_wp
      call guards_find(damped, surface, guard)
      call check_true(error, all(guard%interaction%friction >= 0.25_wp) .and. &
         .not. any(guard%interaction%damping%coefficient > 0.0_wp), "friction, no damping")
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

   !> Of a polygon of twelve no node is a corner, of a square all, of a hollow square none.
   subroutine test_depth(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: x(2, 16)
      real(wp), allocatable :: slack(:)
      type(chain_t) :: chain
      integer :: i

      x(:, :12) = reshape([(cos(i*pi/6), sin(i*pi/6), i = 1, 12)], [2, 12])
      x(:, 13:) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp], [2, 4])
      call chain_build(chain, x, [(i, i = 1, 12)], error)
      call guard_slack_find(chain, x, guard_slack, slack)
      call check_true(error, size(slack) == 12 .and. all(slack >= guard_slack), "smooth")
      call chain_build(chain, x, [(i, i = 13, 16)], error)
      call guard_slack_find(chain, x, guard_slack, slack)
      call check_true(error, size(slack) == 4 .and. all(slack <= corner_slack), "corners")
      call chain_build(chain, x, [(i, i = 16, 13, -1)], error)
      call guard_slack_find(chain, x, guard_slack, slack)
      call check_true(error, all(slack >= guard_slack), "hollow corners")
   end subroutine test_depth

end module test_guards
