!> A node at a corner of the other surface: which of them the corner may hold.
module test_common_normal
   use check, only : check_true, test_case_t
   use emcon_chain_plane, only : chain_t
   use emcon_common_normal_plane, only : is_pushed_aside
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   implicit none
   private
   public :: collect_common_normal

   real(wp), parameter :: pi = acos(-1.0_wp), delta = 1.0e-4_wp
   real(wp), parameter :: corner_turn = 0.5_wp*pi

contains

   subroutine collect_common_normal(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a node of a flat side at a corner", test_flat_side), &
         test_case_t("within the top of a corner", test_top), &
         test_case_t("vertices of both surfaces, and ends", test_vertices), &
         test_case_t("what is flat at first is no corner", test_reference)]
   end subroutine collect_common_normal

   !> Nodes 1 to 3: a master whose edges before and after its corner, node 2, run at `first` and
   !> `first + corner_turn`, its body above; 4 to 6: a slave below it that turns by `bend` at node
   !> 5, which stands at `place`; all of it turned by `phi`.
   pure subroutine set_up(first, bend, place, phi, x, chain, stencil)
      real(wp), intent(in) :: first, bend, place(2), phi
      real(wp), intent(out) :: x(2, 6)
      type(chain_t), intent(out) :: chain
      type(polygon_stencil_t), intent(out) :: stencil

      x(:, 2) = [0.3_wp, -0.2_wp]
      x(:, 1) = x(:, 2) - way(first + phi)
      x(:, 3) = x(:, 2) + 2.0_wp*way(first + corner_turn + phi)
      x(:, 5) = x(:, 2) + place(1)*way(phi) + place(2)*way(0.5_wp*pi + phi)
      x(:, 4) = x(:, 5) + 0.9_wp*way(phi - 0.5_wp*bend)
      x(:, 6) = x(:, 5) - 1.1_wp*way(phi + 0.5_wp*bend)
      chain%facet = reshape([4, 5, 5, 6], [2, 2])
      chain%node = [4, 5, 6]
      chain%node_edge = reshape([0, 1, 1, 2, 2, 0], [2, 3])
      stencil%n = 4
      stencil%node(:4) = [5, 1, 2, 3]
      stencil%after = 4
      stencil%rounding = reshape([1.0_wp, 2.0_wp, 1.0_wp, 2.0_wp]*delta, [2, 2])
   end subroutine set_up

   pure function way(angle)
      real(wp), intent(in) :: angle
      real(wp) :: way(2)

      way = [cos(angle), sin(angle)]
   end function way

   pure logical function is_aside(first, bend, place, phi)
      real(wp), intent(in) :: first, bend, place(2), phi
      real(wp) :: x(2, 6)
      type(chain_t) :: chain
      type(polygon_stencil_t) :: stencil

      call set_up(first, bend, place, phi, x, chain, stencil)
      is_aside = is_pushed_aside(chain, 2, stencil, x, 0.0_wp*x, 0.0_wp*x)
   end function is_aside

   !> The bottom of a block on a floor: under the bottom the node is held, at its corner and just
   !> beside that it is not, far from it that is no question of the corner; in all directions.
   subroutine test_flat_side(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = -3, 4
         associate (phi => 0.25_wp*pi*real(i, wp) + 0.1_wp)
            call check_true(error, is_aside(0.0_wp, 0.0_wp, [0.0_wp, 0.0_wp], phi), "at it")
            call check_true(error, is_aside(0.0_wp, 0.0_wp, [5.0_wp*delta, 0.0_wp], phi), "beside")
            call check_true(error, .not. is_aside(0.0_wp, 0.0_wp, [-5.0_wp*delta, 0.0_wp], phi), &
               "under the bottom")
            call check_true(error, .not. is_aside(0.0_wp, 0.0_wp, [0.01_wp, 0.0_wp], phi), "far")
            ! By 1/1000 of the shorter edge along the mean of both directions, half of the way here.
            call check_true(error, is_aside(0.0_wp, 0.0_wp, [1.8e-3_wp, 0.0_wp], phi) .and. .not. &
               is_aside(0.0_wp, 0.0_wp, [2.2e-3_wp, 0.0_wp], phi) .and. .not. &
               is_aside(0.0_wp, 0.0_wp, [1.8e-3_wp, 0.4e-3_wp], phi) .and. &
               is_aside(0.0_wp, 0.0_wp, [1.8e-3_wp, -0.4e-3_wp], phi), "how far")
            ! The block leans forward on its corner: its bottom has no normal of the floor either.
            call check_true(error, is_aside(-0.3_wp, 0.0_wp, [-5.0_wp*delta, 0.0_wp], phi), &
               "under a bottom that leans")
            ! It leans back: of both edges the bottom is nearer to the floor.
            call check_true(error, .not. is_aside(0.3_wp, 0.0_wp, [-5.0_wp*delta, 0.0_wp], phi), &
               "under a bottom that leans back")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_flat_side

   !> A corner whose halves lean alike has the floor's normal in the middle of its top.
   subroutine test_top(error)
      type(error_t), allocatable, intent(out) :: error

      call check_true(error, .not. is_aside(-0.5_wp*corner_turn, 0.0_wp, [0.0_wp, 0.0_wp], &
         0.0_wp), "middle")
      call check_true(error, is_aside(-0.5_wp*corner_turn, 0.0_wp, [delta, 0.0_wp], 0.0_wp), &
         "to the right")
      call check_true(error, is_aside(-0.5_wp*corner_turn, 0.0_wp, [-delta, 0.0_wp], 0.0_wp), &
         "to the left")
   end subroutine test_top

   !> The sharper of two vertices is left to hold; a dent has what lies between its edges.
   subroutine test_vertices(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: beside(2) = [5.0_wp*delta, 0.0_wp]
      real(wp) :: x(2, 6)
      type(chain_t) :: chain
      type(polygon_stencil_t) :: stencil

      call check_true(error, is_aside(0.0_wp, 0.3_wp, beside, 0.0_wp), "blunt on sharp")
      call check_true(error, .not. is_aside(0.0_wp, corner_turn, beside, 0.0_wp), "alike")
      call check_true(error, .not. is_aside(0.0_wp, 1.1_wp*corner_turn, beside, 0.0_wp), &
         "sharp on blunt")
      call check_true(error, .not. is_aside(-0.5_wp*corner_turn, -corner_turn, &
         [0.3_wp*delta, 0.0_wp], 0.0_wp), "in a dent")
      ! The body may go on below the floor, whose last node is the corner's.
      call set_up(0.0_wp, 0.0_wp, beside, 0.0_wp, x, chain, stencil)
      chain%node_edge(1, 2) = 0
      call check_true(error, is_pushed_aside(chain, 2, stencil, x, 0.0_wp*x, 0.0_wp*x), "end")
      ! Or stand up from it: it has all normals of the corner.
      chain%node_edge(:, 2) = [1, 0]
      call check_true(error, .not. is_pushed_aside(chain, 2, stencil, x, 0.0_wp*x, 0.0_wp*x), &
         "the other end")
      chain%node_edge(:, 2) = 0
      call check_true(error, .not. is_pushed_aside(chain, 2, stencil, x, 0.0_wp*x, 0.0_wp*x), &
         "without edges")
   end subroutine test_vertices

   !> Bodies that bend make no corners.
   subroutine test_reference(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(2, 6) :: x, u
      type(chain_t) :: chain
      type(polygon_stencil_t) :: stencil

      call set_up(0.0_wp, 0.0_wp, [5.0_wp*delta, 0.0_wp], 0.0_wp, x, chain, stencil)
      u = 0.0_wp
      u(:, 3) = x(:, 3) - (x(:, 2) + [2.0_wp, 0.0_wp])
      call check_true(error, .not. is_pushed_aside(chain, 2, stencil, x - u, u, 0.0_wp*u), &
         "bent at the start")
      call check_true(error, .not. is_pushed_aside(chain, 2, stencil, x - u, 0.0_wp*u, u), &
         "bent by the step")
   end subroutine test_reference

end module test_common_normal
