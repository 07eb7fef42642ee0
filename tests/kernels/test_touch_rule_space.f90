!> What a surface in space may touch of itself.
module test_touch_rule_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_touch_rule_space, only : touch_rule_space_depth, touch_rule_space_init, &
      touch_rule_space_is_through, touch_rule_space_may, touch_rule_space_measure, &
      touch_rule_space_sees, touch_rule_space_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_touch_rule_space

   integer, parameter :: none(0) = [integer ::]

contains

   subroutine collect_touch_rule_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("facets beside a node, and on another body", test_may), &
         test_case_t("classes of bodies", test_classes), &
         test_case_t("the other side of the body", test_through), &
         test_case_t("the far side of another body", test_far_side)]
   end subroutine collect_touch_rule_space

   !> Boxes of 6 x 6 x 1 cells of size 1 beside each other, `n` of them.
   subroutine begin(n, scene, facets, rule, error)
      integer, intent(in) :: n
      type(scene_t), intent(out) :: scene
      type(facets_t), intent(out) :: facets
      type(touch_rule_space_t), intent(out) :: rule
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: surface
      integer :: i

      call space_begin(scene)
      allocate(scene%tie(0))
      do i = 1, n
         call add_box(scene, "C3D8", [8.0_wp*i, 0.0_wp, 0.0_wp], [6.0_wp, 6.0_wp, 1.0_wp], &
            [6, 6, 1])
      end do
      surface = skin(scene)
      call facets_init(facets, scene, surface, error)
      if (allocated(error)) return
      call touch_rule_space_init(rule, facets, none, scene)
   end subroutine begin

   !> Of its own body a node touches what is two rings of facets away, of another one all.
   subroutine test_may(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(touch_rule_space_t) :: rule
      real(wp) :: away(3)
      integer :: f, i, n

      call begin(2, scene, facets, rule, error)
      if (allocated(error)) return
      do i = 1, size(facets%node)
         n = 0
         do f = 1, facets%n_facet
            associate (at => scene%x(:, facets%node(i)), corner => scene%x(:, facets%facet(:, f)))
               away = sum(corner, 2)/4.0_wp - at
               if (at(1) < 15.0_wp .neqv. corner(1, 1) < 15.0_wp) then
                  call check_true(error, touch_rule_space_may(rule, facets, i, f), "another body")
                  cycle
               end if
               ! In the middle of the upper side: within two facets along each axis it is not.
               if (any(abs(at - [merge(11.0_wp, 19.0_wp, at(1) < 15.0_wp), 3.0_wp, 1.0_wp]) &
                  > 0.0_wp)) cycle
               n = n + 1
               call check_true(error, touch_rule_space_may(rule, facets, i, f) .eqv. &
                  any(abs(away) > [2.0_wp, 2.0_wp, 0.25_wp]), "own body")
            end associate
         end do
         call check_true(error, n == 0 .or. n == facets%n_facet/2, "all were asked")
      end do
   end subroutine test_may

   !> Each facet is seen by one class.
   subroutine test_classes(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(touch_rule_space_t) :: rule
      integer :: class, f, n

      do n = 1, 6
         call begin(n, scene, facets, rule, error)
         if (allocated(error)) return
         call check_equal(error, rule%n_class, min(n, 4), "classes")
         do f = 1, facets%n_facet
            call check_equal(error, count([(touch_rule_space_sees(rule, class, f), &
               class = 1, rule%n_class)]), 1, "one class")
         end do
      end do
   end subroutine test_classes

   !> Seen from a facet below, a node above is through the body, and one below it is not.
   subroutine test_through(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(touch_rule_space_t) :: rule
      real(wp), parameter :: down(3) = [0.0_wp, 0.0_wp, -1.0_wp]

      call begin(1, scene, facets, rule, error)
      if (allocated(error)) return
      call check_true(error, touch_rule_space_is_through(rule, 1, 1, down, -down, .false.), &
         "through")
      call check_true(error, .not. touch_rule_space_is_through(rule, 1, 1, down, -0.25_wp*down, &
         .false.), "a little behind")
      call check_true(error, .not. touch_rule_space_is_through(rule, 1, 1, down, down, .false.), &
         "in front")
   end subroutine test_through

   !> Of two bodies an element thick each the far side is behind by more than half of both.
   subroutine test_far_side(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      type(touch_rule_space_t) :: rule
      real(wp), parameter :: down(3) = [0.0_wp, 0.0_wp, -1.0_wp]

      call begin(2, scene, facets, rule, error)
      if (allocated(error)) return
      associate (node => size(facets%node))
         call check_true(error, .not. touch_rule_space_is_through(rule, node, 1, down, &
            -1.1_wp*down, .false.), "points are not measured")
         call touch_rule_space_measure(rule, facets, facets, none, scene)
         call check_true(error, touch_rule_space_is_through(rule, node, 1, down, -1.1_wp*down, &
            .false.), "through both")
         call check_near(error, [touch_rule_space_depth(rule, node, 1, .false.), &
            touch_rule_space_depth(rule, 1, 1, .false.)], [1.0_wp, 0.5_wp], 1.0e-15_wp, 1.0_wp, &
            "halves of two elements, and of one")
         call check_true(error, .not. touch_rule_space_is_through(rule, node, 1, down, &
            -0.9_wp*down, .false.), "one in the other")
         call check_true(error, .not. touch_rule_space_is_through(rule, node, 1, down, &
            -1.1_wp*down, .true.), "what gives way")
      end associate
   end subroutine test_far_side

end module test_touch_rule_space
