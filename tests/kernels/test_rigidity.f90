!> Rigid bodies: frames, weights, and the conditions that keep their shape.
module test_rigidity
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : numbering_init, numbering_t, spread_dependent
   use emcon_rigid_bodies, only : rigid_frame_choose, rigid_weights
   use emcon_rigidity, only : rigidity_init, rigidity_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_t
   use emcon_system, only : mass_times, system_init, system_t
   use random_draws, only : draw_random
   use small_scenes, only : block_t, make_block, shake
   implicit none
   private
   public :: collect_rigidity

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_rigidity(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("frames and weights, in two and three dimensions", test_frame), &
         test_case_t("derivatives of the conditions", test_derivatives), &
         test_case_t("a rigid motion of the frame is one of all nodes", test_follow), &
         test_case_t("inertia of the mesh", test_inertia)]
   end subroutine collect_rigidity

   !> A block of 4 x 2 cells, rigid about node 8, the centre.
   subroutine make_rigid(scene)
      type(scene_t), intent(out) :: scene
      type(block_t) :: block
      integer :: i

      call make_block(scene, "CPE4", [4, 2], block)
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "BLOCK"
         body%reference = 8
         body%element = [(i, i = 1, 8)]
         body%node = [(i, i = 1, 15)]
         call rigid_frame_choose(scene%x, body%node, body%reference, body%frame)
      end associate
   end subroutine make_rigid

   !> Random places are the combinations of the frame that the weights tell; nodes on a line or in
   !> a plane have no frame.
   subroutine test_frame(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      integer, allocatable :: frame(:)
      real(wp), allocatable :: x(:, :), weight(:)
      integer :: n_dim, i, k

      do n_dim = 2, 3
         if (allocated(x)) deallocate(x, weight)
         allocate(x(n_dim, n), weight(n_dim + 1))
         call draw_random(x)
         call rigid_frame_choose(x, [(i, i = 2, n)], 1, frame)
         call check_true(error, allocated(frame), "there is a frame")
         if (allocated(error)) return
         call check_equal(error, frame(1), 1, "the reference node comes first")
         k = 1 + maxloc([(norm2(x(:, i) - x(:, 1)), i = 2, n)], 1)
         call check_equal(error, frame(2), k, "then the one farthest from it")
         do i = 1, n
            call rigid_weights(x(:, frame), x(:, i), weight)
            call check_near(error, [sum(weight), matmul(x(:, frame), weight)], [1.0_wp, x(:, i)], &
               tol, 1.0_wp, "combination")
         end do
         x(n_dim, :) = 0.25_wp*x(1, :) + 3.0_wp
         call rigid_frame_choose(x, [(i, i = 2, n)], 1, frame)
         call check_true(error, .not. allocated(frame), "flat")
      end do
   end subroutine test_frame

   !> Differences of a quadratic condition are exact for any step: what is left is round-off over
   !> the step. In statics the gradient is that at the end; of schemes that push with the mean of
   !> both ends it is a discrete gradient too.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = 2.0_wp**(-6), noise = tol/step
      type(scene_t) :: scene
      type(evaluation_t) :: evaluation
      type(rigidity_t) :: rigidity
      type(condition_t) :: item(3), plus(3), minus(3)
      real(wp), allocatable :: u0(:, :), du(:, :), change(:, :)
      integer :: i, a, k, l, p

      call make_rigid(scene)
      call rigidity_init(rigidity, scene%rigid)
      call check_equal(error, rigidity%n_constraint, 3, "one for each two nodes")
      allocate(u0, du, change, mold=scene%x)
      do p = 1, 3
         evaluation = evaluation_moving(0.5_wp, 0.25_wp, 2.0_wp)
         if (p > 1) evaluation = evaluation_at_end
         if (p == 3) evaluation%start_weight = 1.0_wp
         call shake(u0, 0.3_wp)
         call shake(du, 0.3_wp)
         call evaluate(0.0_wp*du, item)
         do k = 1, 3
            call check_near(error, item(k)%dgap, item(k)%gap1 - item(k)%gap0, tol, 1.0_wp, &
               "change of the gap")
            change = 0.0_wp
            change(:, item(k)%node) = item(k)%g
            if (p /= 2) call check_near(error, sum(change*du), item(k)%dgap, tol, 1.0_wp, &
               "discrete gradient")
            if (p == 2) call check_near(error, item(k)%g, item(k)%c, tol, 1.0_wp, "at the end")
            do i = 1, 2
               do a = 1, 2
                  change = 0.0_wp
                  change(a, item(k)%node(i)) = step
                  call evaluate(change, plus)
                  call evaluate(-change, minus)
                  call check_near(error, item(k)%c(a, i), &
                     (plus(k)%gap1 - minus(k)%gap1)/(2.0_wp*step), noise, 1.0_wp, "gradient")
                  do l = 1, 2
                     call check_near(error, item(k)%h(2*l - 1:2*l, 2*(i - 1) + a), &
                        (plus(k)%g(:, l) - minus(k)%g(:, l))/(2.0_wp*step), noise, 1.0_wp, &
                        "its derivative")
                  end do
               end do
            end do
         end do
      end do

   contains

      subroutine evaluate(change, item)
         real(wp), intent(in) :: change(:, :)
         type(condition_t), intent(inout) :: item(:)
         type(motion_t) :: motion
         integer :: j

         motion = motion_of(evaluation, scene%x, u0, du + change)
         call rigidity%linearise([(j, j = 1, 3)], motion, [(0.0_wp, j = 1, 3)], item)
      end subroutine evaluate

   end subroutine test_derivatives

   !> Turn and shift the frame: all nodes do the same, and the conditions hold.
   subroutine test_follow(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: angle = 2.5_wp
      type(scene_t) :: scene
      type(rigidity_t) :: rigidity
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      type(prescribed_t) :: nothing(0)
      type(condition_t) :: item(3)
      real(wp), allocatable :: u(:, :), expected(:, :)
      logical, allocatable :: is_alive(:, :)
      real(wp) :: turn(2, 2)
      integer :: i

      call make_rigid(scene)
      call linear_rows_init(linear, scene)
      call check_equal(error, count(linear%is_used), 2*12, "rows of the other nodes")
      allocate(is_alive(2, 15), source=.true.)
      call numbering_init(numbering, is_alive, nothing, linear)
      call check_equal(error, numbering%n_unknown, 6, "unknowns of the frame")
      if (allocated(error)) return
      turn = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
      allocate(u, expected, mold=scene%x)
      do i = 1, 15
         expected(:, i) = matmul(turn, scene%x(:, i)) - scene%x(:, i) + [3.0_wp, -5.0_wp]
      end do
      u = 0.0_wp
      u(:, scene%rigid(1)%frame) = expected(:, scene%rigid(1)%frame)
      call spread_dependent(numbering, u)
      call check_near(error, u, expected, tol, 8.0_wp, "all nodes")
      call rigidity_init(rigidity, scene%rigid)
      call rigidity%linearise([1, 2, 3], motion_of(evaluation_at_end, scene%x, u, 0.0_wp*u), &
         [(0.0_wp, i = 1, 3)], item)
      call check_near(error, item%gap1, [(0.0_wp, i = 1, 3)], tol, 8.0_wp, "shape")
   end subroutine test_follow

   !> Kinetic energy and momenta of a rigid motion by the mass matrix of the mesh are those of a
   !> rectangle: m (a^2 + b^2)/12 about its centre.
   subroutine test_inertia(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: velocity(2) = [0.75_wp, -2.0_wp], spin = 3.0_wp
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: v(:, :), momentum(:, :), arm(:, :)
      real(wp) :: extent(2), mass, inertia

      call make_rigid(scene)
      call system_init(system, scene, error)
      if (allocated(error)) return
      extent = maxval(scene%x, 2) - minval(scene%x, 2)
      mass = product(extent)
      inertia = mass*sum(extent**2)/12.0_wp
      allocate(v, momentum, mold=scene%x)
      arm = scene%x - spread(minval(scene%x, 2) + 0.5_wp*extent, 2, 15)
      v(1, :) = velocity(1) - spin*arm(2, :)
      v(2, :) = velocity(2) + spin*arm(1, :)
      call mass_times(system, v, momentum)
      call check_near(error, sum(momentum, 2), mass*velocity, tol, mass, "momentum")
      call check_near(error, sum(arm(1, :)*momentum(2, :) - arm(2, :)*momentum(1, :)), &
         inertia*spin, tol, inertia*spin, "angular momentum")
      call check_near(error, 0.5_wp*sum(v*momentum), &
         0.5_wp*(mass*sum(velocity**2) + inertia*spin**2), tol, inertia*spin**2, "energy")
   end subroutine test_inertia

end module test_rigidity
