!> Lists of what is near, beside all pairs: complete in every step, kept while they are.
module test_near_list
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_find, near_list_init, near_list_t, near_list_update, &
      near_list_within
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_near_list

   real(wp), parameter :: eps = epsilon(1.0_wp)
   integer, parameter :: n_item = 12, n_edge = 10, n_node = n_item + n_edge + 1
   real(wp), parameter :: depth = 0.03_wp

contains

   subroutine collect_near_list(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is near, by all pairs", test_complete), &
         test_case_t("surfaces that approach from far away", test_approach), &
         test_case_t("a list is kept over short ways", test_kept)]
   end subroutine collect_near_list

   !> Slave nodes over a polygon of n_edge edges of about 0.1 by 0.01, `gap` above it.
   subroutine make_list(gap, x, list)
      real(wp), intent(in) :: gap
      real(wp), intent(out) :: x(2, n_node)
      type(near_list_t), intent(out) :: list
      real(wp) :: u0(2, n_node)
      integer :: i

      call draw_random(x)
      x(2, :) = 0.01_wp*x(2, :)
      x(2, :n_item) = x(2, :n_item) + gap
      x(1, n_item + 1:) = [(0.1_wp*i, i = 0, n_edge)]
      u0 = 0.0_wp
      call near_list_init(list, reshape([(i, i = 1, n_item)], [1, n_item]), &
         reshape([(n_item + i, n_item + i + 1, i = 1, n_edge)], [2, n_edge]), x, u0, depth)
   end subroutine make_list

   !> Distance along the axes between item `i` and edge `e`, from above.
   pure real(wp) function distance(list, x, i, e)
      type(near_list_t), intent(in) :: list
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: i, e
      integer :: k

      distance = 0.0_wp
      do k = 1, 2
         associate (at => x(k, list%item(1, i)), side => x(k, list%facet(:, e)))
            distance = max(distance, minval(side) - at, at - maxval(side))
         end associate
      end do
   end function distance

   pure logical function is_listed(list, i, e)
      type(near_list_t), intent(in) :: list
      integer, intent(in) :: i, e

      associate (c => list%candidates)
         is_listed = any(c%facet(c%start(i):c%start(i + 1) - 1) == e)
      end associate
   end function is_listed

   !> Random motions: a list holds all that is near at the start of a step, by half of an edge or by
   !> twice its motion, and depth; what is not in reach of `clearance` is not near.
   subroutine test_complete(error)
      type(error_t), allocatable, intent(out) :: error
      type(near_list_t) :: list
      real(wp), dimension(2, n_node) :: x, u, du
      real(wp) :: within, expected, motion, edge_size
      integer :: found(n_edge), n
      integer :: step, i, e

      call make_list(0.3_wp, x, list)
      edge_size = (1.0_wp + sum(abs(x(2, n_item + 2:) - x(2, n_item + 1:n_node - 1))))/n_edge
      u = 0.0_wp
      do step = 1, 30
         call shake(du, merge(0.2_wp, 0.02_wp, mod(step, 7) == 0))
         du(2, :n_item) = du(2, :n_item) - 0.01_wp
         within = 0.0_wp
         call near_list_update(list, x, u, du, within)
         motion = maxval(norm2(du, 1))
         expected = max(0.5_wp*edge_size, 2.0_wp*motion) + depth
         call check_near(error, within, expected, 16.0_wp*eps, 1.0_wp, "within")
         do i = 1, n_item
            call near_list_find(list, i, within, found, n)
            call check_true(error, n == count([(distance(list, x + u, i, e) <= within, &
               e = 1, n_edge)]), "how many are near")
            call check_true(error, all([(distance(list, x + u, i, found(e)) <= within, &
               e = 1, n)]), "those")
            do e = 1, n_edge
               associate (d => distance(list, x + u, i, e))
                  call check_true(error, near_list_within(list, i, e, within) .eqv. &
                     d <= within, "near")
                  if (d <= within) call check_true(error, is_listed(list, i, e), "in the list")
                  if (list%clearance > 0.0_wp) call check_true(error, d > within, "clear")
               end associate
               if (allocated(error)) return
            end do
         end do
         u = u + du
      end do
      call check_true(error, list%n_list > 1 .and. list%n_list < 30, "lists are kept")
   end subroutine test_complete

   !> Within a step `within` never falls, as what acts has to stay near.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(near_list_t) :: list
      real(wp), dimension(2, n_node) :: x, u, du
      real(wp) :: within, before

      call make_list(0.05_wp, x, list)
      u = 0.0_wp
      du = 0.0_wp
      du(1, :n_item) = 0.2_wp
      within = 0.0_wp
      call near_list_update(list, x, u, du, within)
      call check_equal(error, list%n_list, 1, "the first one")
      before = within
      call near_list_update(list, x, u, 0.5_wp*du, within)
      call check_near(error, within, before, 0.0_wp, 1.0_wp, "it never falls")
      within = 0.0_wp
      call near_list_update(list, x, u + 0.1_wp*du, 0.1_wp*du, within)
      call check_equal(error, list%n_list, 1, "kept")
      within = 0.0_wp
      call near_list_update(list, x, u + 10.0_wp*du, 0.1_wp*du, within)
      call check_equal(error, list%n_list, 2, "made anew")
      call check_near(error, list%u(:, :n_item), 10.0_wp*du(:, :n_item), 16.0_wp*eps, 1.0_wp, &
         "from there")
   end subroutine test_kept

   !> Far apart one list serves for half of the way; what is left of the distance is known, as both
   !> surfaces may have moved by as much.
   subroutine test_approach(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap = 8.0_wp
      type(near_list_t) :: list
      real(wp), dimension(2, n_node) :: x, u, du
      real(wp) :: within, clearance

      call make_list(gap, x, list)
      u = 0.0_wp
      du = 0.0_wp
      du(2, :n_item) = -0.02_wp
      within = 0.0_wp
      call near_list_update(list, x, u, du, within)
      clearance = list%clearance
      call check_true(error, clearance > 0.95_wp*gap .and. clearance < gap, "nearly the gap")
      u(2, :n_item) = -0.3_wp*gap
      within = 0.0_wp
      call near_list_update(list, x, u, du, within)
      call check_equal(error, list%n_list, 1, "the same list")
      call check_near(error, list%clearance, clearance - 0.99_wp*0.6_wp*gap, 16.0_wp*eps, gap, &
         "the rest")
      u(2, :n_item) = -0.6_wp*gap
      within = 0.0_wp
      call near_list_update(list, x, u, du, within)
      call check_equal(error, list%n_list, 2, "another list")
      call check_true(error, list%clearance > 0.95_wp*0.4_wp*gap .and. list%clearance < &
         0.4_wp*gap, "nearly what is left of it")
   end subroutine test_approach

end module test_near_list
