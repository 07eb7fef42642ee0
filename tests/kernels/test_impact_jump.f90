!> Impacts of a rigid slab on points of a plane, drawn at random: what is taken of the jump with
!> which no rate is kept obeys Coulomb's law with the step before it, and takes energy.
module test_impact_jump
   use, intrinsic :: iso_fortran_env, only : dp => real64
   use check, only : check_near, check_true, test_case_t
   use emcon_contact_problem, only : contact_problem_create
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rate_jump, only : rate_jump_solve, rate_jump_t
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_impact_jump

   real(wp), parameter :: tol = 1.0e5_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Impulses of one jump are solved to this part of the largest one.
   real(wp), parameter :: near = 1.0e-5_wp
   integer, parameter :: n_draw = 300, n_point = 3

   type :: slab_t
      real(wp) :: mass(6) = 1.0_wp               !! of v and of turns
      real(wp) :: row(6, 3, n_point) = 0.0_wp    !! rates of a gap, and of slips the other way round
      real(wp) :: v(6) = 0.0_wp                  !! before the step
      real(wp) :: mu = 0.0_wp
   end type slab_t

contains

   subroutine collect_impact_jump(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a part of what keeps nothing: in the cone, and it takes energy", test_part), &
         test_case_t("of contacts that move each other the least part is taken", test_least)]
   end subroutine collect_impact_jump

   !> At single points the rate is that part of what it was; some of all draws would make energy by
   !> Newton's restitution with Coulomb's law.
   subroutine test_part(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: kept = 0.6_wp
      type(slab_t) :: slab
      type(rate_jump_t) :: step, newton, jump
      real(wp) :: impulse(0:2, n_point), v(6), rate(0:2, n_point)
      integer :: i, k, n_solved, n_gains

      n_solved = 0
      n_gains = 0
      do i = 1, n_draw
         call draw_slab(slab)
         call find_step(slab, step)
         if (.not. step%is_done) cycle
         call find_jump(slab, step, kept, newton)
         call rate_jump_solve(newton)
         if (newton%lost < -tol) n_gains = n_gains + 1
         call find_jump(slab, step, 0.0_wp, jump)
         jump%part = spread(1.0_wp - kept, 1, n_point)
         call rate_jump_solve(jump)
         if (.not. jump%is_done) cycle
         n_solved = n_solved + 1
         impulse = step%impulse + jump%impulse
         v = after(slab, impulse)
         rate = rates(slab, v)
         associate (largest => maxval(abs(impulse)))
            do k = 1, n_point
               call check_true(error, impulse(0, k) >= -near*largest .and. norm2(impulse(1:, k)) &
                  <= slab%mu*impulse(0, k) + near*largest, "Coulomb's cone")
               call check_true(error, rate(0, k) >= kept*jump%rate(0, k) - near, &
                  "what was kept, or it opens")
            end do
         end associate
         call check_true(error, sum(slab%mass*v*v) <= (1.0_wp + near)*sum(slab%mass*slab%v**2), &
            "energy")
         call check_near(error, 0.5_wp*(sum(slab%mass*(v*v - after(slab, step%impulse)**2))), &
            -jump%lost - sum(jump%rubbed), tol, 1.0_wp, "losses")
         call check_true(error, jump%lost >= -tol .and. sum(jump%taken + jump%rubbed) >= -tol, &
            "each has its sign")
         if (allocated(error)) return
      end do
      call check_true(error, n_solved > (9*n_draw)/10, "all but some are solved")
      call check_true(error, n_gains > 0, "some would make energy")
   end subroutine test_part

   !> One point of three keeps all of its rate: nothing is taken, and it is no jump.
   subroutine test_least(error)
      type(error_t), allocatable, intent(out) :: error
      type(slab_t) :: slab
      type(rate_jump_t) :: step, jump

      do
         call draw_slab(slab)
         call find_step(slab, step)
         if (step%is_done) exit
      end do
      call find_jump(slab, step, 0.0_wp, jump)
      jump%part = [0.5_wp, 0.0_wp, 0.25_wp]
      call rate_jump_solve(jump)
      call check_near(error, reshape(jump%impulse, [3*n_point]), spread(0.0_wp, 1, 3*n_point), &
         0.0_wp, 1.0_wp, "nothing moves")
      jump%part = [0.5_wp, 1.0_wp, 0.25_wp]
      call rate_jump_solve(jump)
      step%rate = jump%impulse
      jump%part = spread(0.25_wp, 1, n_point)
      call rate_jump_solve(jump)
      call check_near(error, reshape(jump%impulse - step%rate, [3*n_point]), spread(0.0_wp, 1, &
         3*n_point), 0.0_wp, 1.0_wp, "a quarter")
   end subroutine test_least

   !> A body of any inertia on three points of a plane below it, into which it moves.
   subroutine draw_slab(slab)
      type(slab_t), intent(out) :: slab
      real(wp) :: u(14), at(3)
      integer :: k

      call draw_random(u)
      slab%mass(4:) = 0.05_wp + 0.2_wp*u(:3)
      slab%mu = u(4)
      slab%v = 2.0_wp*u(5:10) - 1.0_wp
      slab%v(4:) = 4.0_wp*slab%v(4:)
      slab%v(3) = -1.0_wp
      do k = 1, n_point
         call draw_random(at)
         at = [2.0_wp*at(1) - 1.0_wp, 2.0_wp*at(2) - 1.0_wp, -0.2_wp - at(3)]
         slab%row(:, 1, k) = [0.0_wp, 0.0_wp, 1.0_wp, at(2), -at(1), 0.0_wp]
         slab%row(:, 2, k) = -[1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, at(3), -at(2)]
         slab%row(:, 3, k) = -[0.0_wp, 1.0_wp, 0.0_wp, -at(3), 0.0_wp, at(1)]
      end do
   end subroutine draw_slab

   !> The step, whose mean rates obey the laws.
   subroutine find_step(slab, step)
      type(slab_t), intent(in) :: slab
      type(rate_jump_t), intent(out) :: step

      call begin(slab, step)
      step%rate = rates(slab, slab%v)
      step%problem%free = 2.0_wp*step%rate
      step%mean = step%problem%free(1:, :)
      call rate_jump_solve(step)
   end subroutine find_step

   !> The jump behind it, with which gaps keep the part `kept`, and what sticks stops.
   subroutine find_jump(slab, step, kept, jump)
      type(slab_t), intent(in) :: slab
      type(rate_jump_t), intent(in) :: step
      real(wp), intent(in) :: kept
      type(rate_jump_t), intent(out) :: jump
      integer :: k

      call begin(slab, jump)
      jump%problem%base = step%impulse
      jump%rate = rates(slab, after(slab, step%impulse))
      jump%problem%free(0, :) = (1.0_wp - kept)*jump%rate(0, :)
      jump%problem%free(1:, :) = jump%rate(1:, :) + step%rate(1:, :)
      jump%mean = jump%problem%free(1:, :)
      jump%taken = -0.5_wp*sum(step%impulse(1:, :)*jump%mean, 1)
      do k = 1, n_point
         if (norm2(step%impulse(1:, k)) < slab%mu*step%impulse(0, k)*(1.0_wp - tol)) &
            jump%problem%free(1:, k) = jump%rate(1:, k)
      end do
   end subroutine find_jump

   subroutine begin(slab, jump)
      type(slab_t), intent(in) :: slab
      type(rate_jump_t), intent(inout) :: jump
      real(wp) :: all(6, 3*n_point)
      integer :: k

      jump%row = [(k, k = 1, n_point)]
      call contact_problem_create(jump%problem, 2, n_point)
      allocate(jump%rate(0:2, n_point), jump%mean(2, n_point), jump%taken(n_point), source=0.0_wp)
      all = reshape(slab%row, [6, 3*n_point])
      jump%problem%w = matmul(transpose(all), all/spread(slab%mass, 2, 3*n_point))
      jump%problem%mu = slab%mu
   end subroutine begin

   !> The velocity behind impulses.
   pure function after(slab, impulse) result(v)
      type(slab_t), intent(in) :: slab
      real(wp), intent(in) :: impulse(0:, :)     !! (0:2, points)
      real(wp) :: v(6)

      v = slab%v + matmul(reshape(slab%row, [6, 3*n_point]), reshape(impulse, [3*n_point])) &
         /slab%mass
   end function after

   pure function rates(slab, v) result(rate)
      type(slab_t), intent(in) :: slab
      real(wp), intent(in) :: v(6)
      real(wp) :: rate(0:2, n_point)

      rate = reshape(matmul(v, reshape(slab%row, [6, 3*n_point])), [3, n_point])
   end function rates

end module test_impact_jump
