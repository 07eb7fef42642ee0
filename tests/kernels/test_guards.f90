!> Guards: one for each direction in which no pair holds the nodes.
module test_guards
   use check, only : check_equal, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_guards, only : guard_slack, guards_find
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
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
         test_case_t("surfaces of nodes, and pairs without guards", test_none)]
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

end module test_guards
