!> Forces of integrated gaps on single nodes, against where the conditions push: closed forms.
module test_nodal_pull
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_nodal_pull, only : nodal_pull_add, nodal_pull_join, nodal_pull_share, nodal_pull_t, &
      nodal_pull_text
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_nodal_pull

   real(wp), parameter :: tol = 32.0_wp*epsilon(1.0_wp)
   !> Nodes of the scene; the last one touches nothing.
   integer, parameter :: n_node = 7

contains

   subroutine collect_nodal_pull(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("weights that change their sign", test_weights), &
         test_case_t("whatever multipliers are counted in", test_scaled), &
         test_case_t("what does not count", test_left_out), &
         test_case_t("the larger of two, and what is told", test_told)]
   end subroutine collect_nodal_pull

   !> Conditions 1 and 2 of two slave nodes and two master nodes each, node 2 in both: the second
   !> slave node has the weight -`negative` of its condition, the first what is left of 1. Pushed
   !> along a normal that is `angle` off the second axis.
   subroutine make(set, negative, lam, angle)
      type(constraint_set_t), intent(out) :: set
      real(wp), intent(in) :: negative(2), lam(2), angle
      real(wp) :: normal(2)
      integer :: k

      normal = [-sin(angle), cos(angle)]
      call constraints_select(set, [1, 2])
      do k = 1, 2
         associate (item => set%item(k))
            call condition_resize(item, 4)
            item%is_mean = .true.
            item%n_slave = 2
            item%node(:4) = merge([1, 2, 4, 5], [3, 2, 5, 6], k == 1)
            item%g(:, 1) = (1.0_wp + negative(k))*normal
            item%g(:, 2) = -negative(k)*normal
            item%g(:, 3) = -0.75_wp*normal
            item%g(:, 4) = -0.25_wp*normal
         end associate
      end do
      set%lam(:2) = lam
   end subroutine make

   !> Node 2 is pulled by what both conditions have there; pushed by one more than that it is not
   !> pulled. Where the multiplier pulls, all nodes are.
   subroutine test_weights(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: negative(2, 4) = reshape([0.25_wp, 0.5_wp, 0.25_wp, -0.75_wp, &
         0.0_wp, 0.0_wp, 0.25_wp, 0.25_wp], [2, 4])
      real(wp), parameter :: lam(2, 4) = reshape([2.0_wp, 4.0_wp, 2.0_wp, 4.0_wp, 2.0_wp, 4.0_wp, &
         -2.0_wp, 0.0_wp], [2, 4])
      !> 4 times 3/2 at node 3 of the first, 4 times 3/4 at node 2 less 1/2 and 3/4 of masters, ...
      real(wp), parameter :: pull(4) = [2.5_wp, 0.0_wp, 0.0_wp, 2.5_wp], &
         force(4) = [6.0_wp, 3.5_wp, 4.0_wp, 2.5_wp]
      type(constraint_set_t) :: set
      type(nodal_pull_t) :: found
      integer :: k, i

      do k = 1, 4
         do i = 0, 3
            call make(set, negative(:, k), lam(:, k), 0.7_wp*i)
            found = nodal_pull_t()
            call nodal_pull_add(found, set, n_node)
            call check_near(error, [found%pull, found%force], [pull(k), force(k)], tol, force(k), &
               "weights " // to_text(k))
         end do
      end do
   end subroutine test_weights

   !> A gradient twice as large with half the multiplier is the same push, where normals differ too.
   subroutine test_scaled(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(nodal_pull_t) :: found(2)
      integer :: k

      do k = 1, 2
         call make(set, [0.25_wp, 0.5_wp], [2.0_wp, 4.0_wp], 0.3_wp)
         set%item(2)%g(:, :4) = matmul(reshape([0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp], [2, 2]), &
            set%item(2)%g(:, :4))
         set%item(1)%g = k*set%item(1)%g
         set%lam(1) = set%lam(1)/k
         call nodal_pull_add(found(k), set, n_node)
      end do
      ! Across each other: 1/2 and 2 at node 2, pushed by as much.
      call check_near(error, found%pull, spread(sqrt(4.25_wp), 1, 2), tol, 2.0_wp, "pull")
      call check_near(error, found%force, [6.0_wp, 6.0_wp], tol, 6.0_wp, "force")
   end subroutine test_scaled

   !> Conditions that always act, those that are no integrals, and what comes together in no force.
   subroutine test_left_out(error)
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: set
      type(nodal_pull_t) :: found
      integer :: k

      do k = 1, 5
         call make(set, [0.25_wp, 0.5_wp], [2.0_wp, 4.0_wp], 0.3_wp)
         if (k <= 2) set%n_permanent = k
         if (k == 3) set%item(1)%is_mean = .false.
         if (k == 4) set%item(:)%is_mean = .false.
         if (k == 5) set%item(1)%g(:, 3) = -set%item(1)%g(:, 4)
         found = nodal_pull_t()
         call nodal_pull_add(found, set, n_node)
         call check_near(error, [found%pull, found%force], merge([2.0_wp, 6.0_wp], [0.0_wp, &
            0.0_wp], mod(k, 2) == 1), tol, 6.0_wp, "the second alone, or none " // to_text(k))
      end do
   end subroutine test_left_out

   subroutine test_told(error)
      type(error_t), allocatable, intent(out) :: error
      type(nodal_pull_t) :: found
      character(len=:), allocatable :: text
      integer :: k

      found = nodal_pull_t(pull=0.1_wp, force=4.0_wp)
      call nodal_pull_join(found, nodal_pull_t(pull=0.2_wp, force=2.0_wp))
      call check_near(error, [found%pull, found%force], [0.2_wp, 4.0_wp], 0.0_wp, 1.0_wp, "joined")
      call nodal_pull_join(found, nodal_pull_t(pull=0.1_wp, force=5.0_wp))
      call check_near(error, [found%pull, found%force], [0.2_wp, 5.0_wp], 0.0_wp, 1.0_wp, "again")
      call check_near(error, nodal_pull_share(found), 0.04_wp, tol, 1.0_wp, "share")
      call check_near(error, nodal_pull_share(nodal_pull_t()), 0.0_wp, 0.0_wp, 1.0_wp, "of none")
      do k = 1, 2
         call nodal_pull_text(nodal_pull_t(pull=merge(0.049_wp, 0.06_wp, k == 1), force=1.0_wp), &
            text)
         if (k == 1) call check_equal(error, text, "", "below a twentieth")
         if (k == 2) call check_true(error, index(text, "by up to 6") > 0, "above")
      end do
   end subroutine test_told

end module test_nodal_pull
