!> Which edges of one surface a node of it may touch: by their order, and across a channel.
module test_self_contact
   use check, only : check_equal, check_true, test_case_t
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_self_contact_plane, only : chain_faces, self_contact_is_apart, self_contact_is_meant, &
      self_contact_may_touch
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use emcon_touch_rule_plane, only : touch_rule_allows, touch_rule_init, touch_rule_may, &
      touch_rule_sees, touch_rule_t
   use small_scenes, only : add_surface, block_t, make_block, top
   implicit none
   private
   public :: collect_self_contact

   integer, parameter :: n = 8
   !> A channel, 1 wide and 3 deep: down its right wall, along the bottom, up the left one.
   real(wp), parameter :: channel(2, n) = reshape([1.0_wp, 3.0_wp, 1.0_wp, 2.0_wp, 1.0_wp, 1.0_wp, &
      1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 3.0_wp], [2, n])

contains

   subroutine collect_self_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("edges that are meant", test_order), &
         test_case_t("edges across a channel", test_across), &
         test_case_t("faces by their angle, whatever their lengths", test_angle), &
         test_case_t("how deep they may overlap", test_deep), &
         test_case_t("the rule of a chain", test_rule)]
   end subroutine collect_self_contact

   subroutine make_channel(scene, chain, error)
      type(scene_t), intent(out) :: scene
      type(chain_t), intent(out) :: chain
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      integer :: i

      call make_block(scene, "CPE4", [3, 1], block)
      scene%x = channel
      call add_surface(scene, "CHANNEL", block, [top])
      deallocate(scene%surface(1)%element, scene%surface(1)%face)
      allocate(scene%surface(1)%element(0), scene%surface(1)%face(0))
      scene%surface(1)%edge = reshape([(i, i + 1, i = 1, n - 1)], [2, n - 1])
      call chain_init(chain, scene, scene%surface(1), error)
   end subroutine make_channel

   !> Neither the edges at a node nor those beside them; of two the later ones, or both.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      integer :: k, e
      logical :: is_apart

      call make_channel(scene, chain, error)
      if (allocated(error)) return
      call check_equal(error, chain%node, [(k, k = 1, n)], "nodes")
      do k = 1, n
         do e = 1, n - 1
            ! Node k stands between the edges k - 1 and k.
            is_apart = min(abs(e - max(1, k - 1)), abs(e - min(n - 1, k))) > 1
            call check_true(error, self_contact_is_apart(chain, k, e) .eqv. is_apart, "apart")
            call check_true(error, self_contact_is_meant(chain, k, e, .true.) .eqv. is_apart, &
               "both")
            call check_true(error, self_contact_is_meant(chain, k, e, .false.) .eqv. is_apart &
               .and. e > max(1, k - 1), "later ones")
         end do
      end do
   end subroutine test_order

   !> Wall and wall face each other and see each other at any distance; bottom and walls do not.
   subroutine test_across(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: u(2, n)
      logical :: expected
      integer :: k, e

      call make_channel(scene, chain, error)
      if (allocated(error)) return
      u = 0.0_wp
      u(1, 5:) = -10.0_wp
      do k = 1, n
         if (k == 4 .or. k == 5) cycle
         do e = 1, n - 1
            expected = (k < 4 .and. e > 4) .or. (k > 5 .and. e < 4)
            call check_true(error, chain_faces(chain, k, chain%facet(:, e), scene%x, u) .eqv. &
               expected, "faces " // to_text(k))
            call check_true(error, self_contact_may_touch(chain, k, e, scene%x, u) .eqv. expected, &
               "touches " // to_text(k))
         end do
      end do
      ! The corners, whose normals are between both.
      call check_true(error, chain_faces(chain, 4, chain%facet(:, 6), scene%x, 0.0_wp*u) .and. &
         .not. chain_faces(chain, 4, chain%facet(:, 2), scene%x, 0.0_wp*u), "a corner")
   end subroutine test_across

   !> Two edges that bend at a node, and one that faces them by a cosine of just more or less than
   !> 1/20.
   subroutine test_angle(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: scales(3) = [0.01_wp, 1.0_wp, 64.0_wp], cosine(2) = [0.06_wp, 0.04_wp]
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: u(5), x(2, n), angle, along
      integer :: case, k

      call make_channel(scene, chain, error)
      if (allocated(error)) return
      do case = 1, 60
         call draw_random(u)
         along = 8.0_wp*u(1)
         x = 0.0_wp
         associate (size => scales(1 + mod(case, 3))*(0.25_wp + u(2:4)), bend => u(5) - 0.5_wp)
            ! Unit vectors of both edges are added up: their lengths do not count.
            x(:, 2) = [3.0_wp, -2.0_wp]
            x(:, 1) = x(:, 2) - size(1)*[cos(along - bend), sin(along - bend)]
            x(:, 3) = x(:, 2) + size(2)*[cos(along + bend), sin(along + bend)]
            do k = 1, 4
               angle = along + merge(1, -1, k > 2)*acos(-cosine(1 + mod(k, 2)))
               x(:, 6) = x(:, 5) + size(3)*[cos(angle), sin(angle)]
               call check_true(error, chain_faces(chain, 2, [5, 6], x, 0.0_wp*x) .eqv. &
                  mod(k, 2) == 0, "case " // to_text(case) // ", angle " // to_text(k))
            end do
         end associate
      end do
   end subroutine test_angle

   !> A fifth of the node's edges: what is farther behind is on the other side.
   subroutine test_deep(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: over(6) = [-0.01_wp, 0.19_wp, 0.21_wp, 0.29_wp, 0.31_wp, 0.19_wp]
      real(wp), parameter :: longer(6) = [1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 2.0_wp, 1.0_wp]
      logical, parameter :: may(6) = [.true., .true., .false., .true., .false., .true.]
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp) :: u(2, n), unit
      integer :: k

      call make_channel(scene, chain, error)
      if (allocated(error)) return
      do k = 1, 6
         unit = 0.25_wp**(k - 3)
         u = 0.0_wp
         u(1, 6:) = 1.0_wp + over(k)
         ! The last edge of the left wall is 1 or 2 long: 1 or 1.5 in the mean at node 7.
         u(2, 8) = longer(k) - 1.0_wp
         call check_true(error, self_contact_may_touch(chain, 7, 2, unit*scene%x, &
            unit*u) .eqv. may(k), &
            "over " // to_text(over(k)))
         ! Its end has one edge alone.
         u(2, 8) = 0.0_wp
         u(2, 7) = -0.5_wp*(longer(k) - 1.0_wp)
         call check_true(error, self_contact_may_touch(chain, 8, 1, unit*scene%x, &
            unit*u) .eqv. may(k), &
            "at an end " // to_text(over(k)))
      end do
   end subroutine test_deep

   !> One class sees all, and what is meant; on another body any edge.
   subroutine test_rule(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      type(touch_rule_t) :: rule
      integer :: k, e

      call make_channel(scene, chain, error)
      if (allocated(error)) return
      call touch_rule_init(rule, chain, scene, .false.)
      call check_equal(error, rule%n_class, 1, "classes")
      do k = 1, n
         do e = 1, n - 1
            call check_true(error, touch_rule_sees(rule, 1, e), "sees all")
            call check_true(error, touch_rule_may(rule, chain, k, e) .eqv. self_contact_is_meant( &
               chain, k, e, .false.), "may")
            call check_true(error, touch_rule_allows(rule, chain, k, e, scene%x, 0.0_wp*scene%x) &
               .eqv. (self_contact_is_meant(chain, k, e, .false.) .and. self_contact_may_touch( &
               chain, k, e, scene%x, 0.0_wp*scene%x)), "allows")
         end do
      end do
      rule%is_buried(8) = .true.
      rule%host(1) = 6
      call check_true(error, .not. (touch_rule_may(rule, chain, 1, 6) .or. touch_rule_may(rule, &
         chain, 8, 1)) .and. touch_rule_may(rule, chain, 1, 5), "ties")
      rule%is_buried = .false.
      rule%host = 0
      rule%n_class = 2
      rule%body = [1, 1, 1, 2, 3, 3, 3]
      call check_true(error, all([(touch_rule_sees(rule, 1, e), e = 1, n - 1)] .eqv. [.true., &
         .true., .true., .false., .true., .true., .true.]), "classes in turn")
      call check_true(error, touch_rule_may(rule, chain, 4, 5) .and. touch_rule_allows(rule, &
         chain, 4, 5, scene%x, 0.0_wp*scene%x), "another body")
      call check_true(error, .not. touch_rule_may(rule, chain, 2, 3), "of the own one not beside")
   end subroutine test_rule

end module test_self_contact
