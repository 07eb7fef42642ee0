!> The nodes of a condition: room for them, and more of them with what is known of the first.
module test_condition_nodes
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_condition_nodes, only : condition_include, condition_resize, condition_resize_slip, &
      condition_take_slip, nodes_append
   use emcon_constraint, only : condition_t
   use emcon_edge_moments, only : edge_moments_t, form_begin
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_condition_nodes

contains

   subroutine collect_condition_nodes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("each node once", test_append), &
         test_case_t("room that grows, never shrinks", test_resize), &
         test_case_t("more nodes, by nothing yet", test_include), &
         test_case_t("slip over another motion, node by node", test_take_slip), &
         test_case_t("moments of an edge over its nodes, in order", test_moments)]
   end subroutine collect_condition_nodes

   subroutine test_append(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: list(8), n

      list(:2) = [7, 3]
      n = 2
      call nodes_append([3, 0, 5, 7, 5, 9], list, n)
      call check_equal(error, list(:n), [7, 3, 5, 9], "nodes")
   end subroutine test_append

   subroutine test_resize(error)
      type(error_t), allocatable, intent(out) :: error
      type(condition_t) :: item
      integer, parameter :: n(4) = [2, 3, 1, 3], room(4) = [2, 3, 3, 3]
      integer :: k

      do k = 1, size(n)
         call condition_resize(item, n(k))
         call condition_resize_slip(item)
         call check_equal(error, [item%n_node, size(item%node), shape(item%g), shape(item%c), &
            shape(item%h), shape(item%t), shape(item%t1), shape(item%ht)], [n(k), room(k), 2, &
            room(k), 2, room(k), 2*room(k), 2*room(k), 2, room(k), 1, 2, room(k), 1, 2*room(k), &
            2*room(k), 1], "sizes")
         call check_true(error, all(abs(item%t) <= 0.0_wp) .and. all(abs(item%t1) <= 0.0_wp) .and. &
            all(abs(item%ht) <= 0.0_wp) .and. all(abs(item%slip) <= 0.0_wp), "no slip yet")
         item%t = 1.0_wp
         item%t1 = 1.0_wp
         item%ht = 1.0_wp
         item%slip = 1.0_wp
      end do
   end subroutine test_resize

   !> Both motions see nodes that the other does not: gradients go to their own nodes, none is lost,
   !> and there is room for all of them.
   subroutine test_take_slip(error)
      type(error_t), allocatable, intent(out) :: error
      type(condition_t) :: item, over
      integer, parameter :: before(3) = [7, 3, 9], after(4) = [7, 5, 3, 8], all_of(5) = [7, 5, 3, &
         8, 9]
      real(wp) :: t1(3, 5, 2), g(3, 4), ht(12, 12, 2)

      call begin(over, before)
      call begin(item, after)
      call draw_random(over%t1(:, :, 1))
      call draw_random(over%t1(:, :, 2))
      over%slip = [0.25_wp, -0.5_wp]
      g = item%g
      ht = item%ht
      t1 = 0.0_wp
      t1(:, [1, 3, 5], :) = over%t1
      call condition_take_slip(item, over)
      call check_equal(error, item%node(:item%n_node), all_of, "nodes")
      call check_true(error, all(shape(item%t1) == [3, 5, 2]) .and. all(shape(item%t) == [3, 5, &
         2]) &
         .and. all(shape(item%ht) == [15, 15, 2]), "there is no room for all nodes")
      if (allocated(error)) return
      call check_true(error, all(abs(item%t1 - t1) <= 0.0_wp), "gradients are those of other nodes")
      call check_true(error, all(abs(item%g(:, :4) - g) <= 0.0_wp) .and. all(abs(item%ht(:12, :12, &
         :) - ht) <= 0.0_wp), "what is known of the first nodes is lost")
      call check_true(error, all(abs(item%slip - over%slip) <= 0.0_wp), "slip")

   contains

      !> A condition with friction over some nodes.
      subroutine begin(self, node)
         type(condition_t), intent(out) :: self
         integer, intent(in) :: node(:)

         self%has_friction = .true.
         call condition_resize(self, size(node), 3)
         self%node(:size(node)) = node
         call condition_resize_slip(self)
         call draw_random(self%g)
         call draw_random(self%ht(:, :, 1))
      end subroutine begin

   end subroutine test_take_slip

   !> With room for them or not, and with second derivatives or not.
   subroutine test_include(error)
      type(error_t), allocatable, intent(out) :: error
      type(condition_t), allocatable :: item
      real(wp) :: g(2, 4), c(2, 4), h(8, 8)
      integer :: k

      do k = 0, 3
         allocate(item)
         if (btest(k, 0)) call condition_resize(item, 6)
         call condition_resize(item, 2)
         item%leaves_second = btest(k, 1)
         item%node(:2) = [7, 3]
         call draw_random(item%g)
         call draw_random(item%c)
         call draw_random(item%h)
         g = 0.0_wp
         c = 0.0_wp
         h = 0.0_wp
         g(:, :2) = item%g(:, :2)
         c(:, :2) = item%c(:, :2)
         if (.not. btest(k, 1)) h(:4, :4) = item%h(:4, :4)
         call condition_include(item, [3, 0, 5, 9, 5])
         call check_equal(error, item%n_node, 4, "number")
         call check_equal(error, item%node(:4), [7, 3, 5, 9], "nodes")
         if (allocated(error)) return
         call check_near(error, item%g(:, :4), g, 0.0_wp, 1.0_wp, "discrete gradient")
         call check_near(error, item%c(:, :4), c, 0.0_wp, 1.0_wp, "gradient")
         if (.not. btest(k, 1)) call check_near(error, item%h(:8, :8), h, 0.0_wp, 1.0_wp, &
            "second derivatives")
         call condition_include(item, [9, 7])
         call check_near(error, item%g(:, :4), g, 0.0_wp, 1.0_wp, "nothing new")
         deallocate(item)
      end do
   end subroutine test_include

   !> The edge's own nodes stay first, the others of either side are sorted; room only grows.
   subroutine test_moments(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: list(6) = [9, 2, 7, 5, 8, 3], n(4) = [4, 6, 3, 6], room(4) = [4, 6, &
         6, 6]
      type(edge_moments_t) :: form
      integer :: k

      do k = 1, size(n)
         call form_begin(form, list(:n(k)), min(4, n(k)), mod(k, 2) == 0)
         call check_equal(error, [form%n_node, form%n_slave, size(form%node)], [n(k), min(4, &
            n(k)), room(k)], "numbers")
         if (allocated(error)) return
         if (n(k) == 3) call check_equal(error, form%node(:3), [9, 2, 7], "three")
         if (n(k) == 4) call check_equal(error, form%node(:4), [9, 2, 5, 7], "four")
         if (n(k) == 6) call check_equal(error, form%node(:6), [9, 2, 5, 7, 3, 8], "six")
      end do
   end subroutine test_moments

end module test_condition_nodes
