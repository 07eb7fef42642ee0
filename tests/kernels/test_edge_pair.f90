!> Crossing edges: places, values, identities, momenta, derivatives.
module test_edge_pair
   use check, only : check_near, check_true, test_case_t
   use emcon_edge_pair_space, only : crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_edge_pair

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1; edges cross at 30 degrees or more.
   real(wp), parameter :: tol = 128.0_wp*eps
   integer, parameter :: n_node = 4

contains

   subroutine collect_edge_pair(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("where edges cross", test_places), &
         test_case_t("parallel edges do not", test_parallel), &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("without second derivatives: the same bits", test_first)]
   end subroutine collect_edge_pair

   !> One edge along the first axis, one along the second and .5 above it.
   subroutine test_places(error)
      type(error_t), allocatable, intent(out) :: error
      type(crossing_t) :: crossing
      real(wp) :: at(3, n_node)

      at = reshape([0.0_wp, 0.0_wp, 0.0_wp, 4.0_wp, 0.0_wp, 0.0_wp, &
         1.0_wp, -3.0_wp, 0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp], shape(at))
      crossing = edge_crossing(at)
      call check_near(error, [crossing%place, crossing%height, crossing%sine], &
         [0.25_wp, 0.75_wp, 0.5_wp, 1.0_wp], tol, 1.0_wp, "place, height, sine")
   end subroutine test_places

   subroutine test_parallel(error)
      type(error_t), allocatable, intent(out) :: error
      type(crossing_t) :: crossing
      real(wp) :: at(3, n_node)

      at = reshape([0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, &
         1.0_wp, 1.0_wp, 0.0_wp, 5.0_wp, 1.0_wp, 0.0_wp], shape(at))
      crossing = edge_crossing(at)
      call check_near(error, [crossing%sine], [0.0_wp], 0.0_wp, 1.0_wp, "sine")
      ! Turned by what round-off leaves nothing of: 4e-12 of a length of 4.
      at(2, 4) = at(2, 4) + 4.0e-12_wp
      crossing = edge_crossing(at)
      call check_near(error, [crossing%sine*1.0e12_wp], [1.0_wp], 0.01_wp, 1.0_wp, "small sine")
      call check_near(error, [crossing%place, crossing%height], [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, &
         1.0_wp, "no place")
   end subroutine test_parallel

   !> Two edges of length 2 that cross, and a motion of the size `size` with a turn by as much.
   subroutine draw_step(size, at, way)
      real(wp), intent(in) :: size
      real(wp), intent(out) :: at(3, n_node), way(3, n_node)
      real(wp) :: draw(3, n_node), axis(3)
      integer :: k

      at = reshape([-1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, -1.0_wp, 0.2_wp, 0.0_wp, 1.0_wp, 0.2_wp], [3, n_node])
      call draw_random(draw)
      at = at + 0.2_wp*(2.0_wp*draw - 1.0_wp)
      call draw_random(draw)
      axis = 2.0_wp*draw(:, 1) - 1.0_wp
      call draw_random(draw)
      do k = 1, n_node
         ! Cayley's turn about the axis, and a change of shape.
         way(:, k) = size*(cross_product(axis, at(:, k) + 0.5_wp*size*cross_product(axis, &
            at(:, k)))/(1.0_wp + 0.25_wp*size**2*dot_product(axis, axis)) &
            + 0.2_wp*(2.0_wp*draw(:, k) - 1.0_wp))
      end do
   end subroutine draw_step

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(edge_pair_gap_t) :: gap
      type(crossing_t) :: from, to
      real(wp) :: at(3, n_node), way(3, n_node), size
      integer :: i, k

      do i = 0, 12, 2
         size = 0.5_wp*0.1_wp**i
         do k = 1, 20
            call draw_step(size, at, way)
            call edge_pair_gap(at, way, -1.0_wp, .true., gap)
            call check_near(error, sum(gap%g*way), gap%dgap, tol, sum(abs(gap%g*way)), &
               "identity, step " // to_text(size, 2))
            from = edge_crossing(at)
            to = edge_crossing(at + way)
            call check_near(error, [gap%gap(0), gap%gap(1), gap%gap(1)], &
               [-from%height, -to%height, gap%gap(0) + gap%dgap], tol, 1.0_wp, "values")
         end do
      end do
   end subroutine test_identity

   !> No resultant and no moment about the mean positions: momenta are kept at any size of step.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(edge_pair_gap_t) :: gap
      real(wp) :: at(3, n_node), way(3, n_node), moment(3)
      integer :: i, k

      do k = 1, 60
         call draw_step(0.4_wp**mod(k, 20), at, way)
         call edge_pair_gap(at, way, 1.0_wp, .true., gap)
         moment = 0.0_wp
         do i = 1, n_node
            moment = moment + cross_product(at(:, i) + 0.5_wp*way(:, i), gap%g(:, i))
         end do
         call check_near(error, [sum(gap%g, 2), moment], [(0.0_wp, i = 1, 6)], tol, 1.0_wp, &
            "resultant and moment")
      end do
   end subroutine test_momenta

   !> Central differences err by the square of their way.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(edge_pair_gap_t) :: gap, up, down
      real(wp), dimension(3, n_node) :: at, way, draw
      real(wp) :: step
      integer :: k

      step = eps**(1.0_wp/3.0_wp)
      do k = 1, 40
         call draw_step(merge(0.5_wp, 0.02_wp, mod(k, 2) == 0), at, way)
         call draw_random(draw)
         draw = 2.0_wp*draw - 1.0_wp
         call edge_pair_gap(at, way, 1.0_wp, .false., gap)
         call edge_pair_gap(at, way + step*draw, 1.0_wp, .true., up)
         call edge_pair_gap(at, way - step*draw, 1.0_wp, .true., down)
         call check_near(error, sum(gap%c*draw), (up%gap(1) - down%gap(1))/(2.0_wp*step), &
            100.0_wp*step**2, 1.0_wp, "gradient")
         call check_near(error, matmul(gap%h, reshape(draw, [12])), &
            reshape(up%g - down%g, [12])/(2.0_wp*step), 100.0_wp*step**2, 1.0_wp, &
            "second derivatives")
         call check_true(error, maxval(abs(gap%h)) < 10.0_wp, "bounded: " &
            // to_text(maxval(abs(gap%h)), 3))
      end do
   end subroutine test_derivatives

   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      type(edge_pair_gap_t) :: gap, first
      real(wp), dimension(3, n_node) :: at, way
      integer :: k

      do k = 1, 10
         call draw_step(0.1_wp, at, way)
         call edge_pair_gap(at, way, 1.0_wp, .false., gap)
         call edge_pair_gap(at, way, 1.0_wp, .true., first)
         call check_near(error, [first%gap, first%dgap, first%g, first%c], &
            [gap%gap, gap%dgap, gap%g, gap%c], 0.0_wp, 1.0_wp, "bits")
      end do
   end subroutine test_first

end module test_edge_pair
