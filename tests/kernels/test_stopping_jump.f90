!> Jumps by which friction stops a rigid slab on points, whose W is known in closed form: judged by
!> the momenta of the slab and by Coulomb's law at each point, with pushes as they are afterwards.
module test_stopping_jump
   use, intrinsic :: iso_fortran_env, only : dp => real64
   use check, only : check_near, check_true, test_case_t
   use emcon_contact_problem, only : contact_problem_create
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rate_jump, only : rate_jump_solve, rate_jump_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_stopping_jump

   real(wp), parameter :: tol = 1.0e5_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: mass = 2.0_wp, inertia(3) = [0.5_wp, 0.75_wp, 1.0_wp], height = 0.5_wp
   !> Half of the distance of points.
   real(wp), parameter :: half(2) = [1.0_wp, 0.75_wp]
   real(wp), parameter :: corner(3, 4) = reshape([-half(1), -half(2), -height, half(1), -half(2), &
      -height, half(1), half(2), -height, -half(1), half(2), -height], [3, 4])

   !> A slab on points before the jump, and what the step has done.
   type :: slab_t
      real(wp), allocatable :: at(:, :)          !! (3, n) points, from the centre [L]
      real(wp) :: v(3) = 0.0_wp, w(3) = 0.0_wp   !! [L/T], [1/T]
      real(wp), allocatable :: mu(:)             !! (n)
      real(wp), allocatable :: push(:)           !! (n) impulses of the step [M L/T]
      !> (2, n) mean rates of slips over the step, against which friction was [L/T]
      real(wp), allocatable :: mean(:, :)
      logical, allocatable :: stops(:)           !! (n) the step would turn it back
   end type slab_t

contains

   subroutine collect_stopping_jump(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a slab stops whole: what tips it is less", test_whole), &
         test_case_t("some stop, some slide on by other pushes", test_some), &
         test_case_t("a push that ends takes its friction along", test_opens), &
         test_case_t("what the jump turns back stops, too", test_turned), &
         test_case_t("pushes that stay leave what slides on", test_stay)]
   end subroutine collect_stopping_jump

   !> Sliding along x friction tips: m g h = 1, mu = .4 and the speed of the end is against it. As
   !> it stops, pushes behind and before differ by what is left of friction times the height.
   subroutine test_whole(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = 0.4_wp, back = -0.125_wp, weight = 1.0_wp
      type(slab_t) :: slab
      type(rate_jump_t) :: jump
      real(wp) :: tip, drag
      integer :: k

      slab%at = corner
      slab%v(1) = back
      slab%mu = spread(mu, 1, 4)
      tip = 0.25_wp*mu*weight*height/half(1)
      slab%push = 0.25_wp*weight + tip*[-1, 1, 1, -1]
      slab%mean = spread([0.01_wp, 0.0_wp], 2, 4)
      slab%stops = spread(.true., 1, 4)
      call find_jump(slab, .false., jump)
      call check_jump(slab, jump, "whole", error)
      if (allocated(error)) return
      drag = mu*weight + mass*back
      call check_near(error, sum(jump%problem%base(1, :) + jump%impulse(1, :)), drag, tol, weight, &
         "friction")
      associate (push => jump%problem%base(0, :) + jump%impulse(0, :))
         call check_near(error, [sum(push), push(2) + push(3) - push(1) - push(4)], [weight, &
            drag*height/half(1)], tol, weight, "pushes")
      end associate
      do k = 1, 4
         call check_near(error, rates(slab, jump, k), spread(0.0_wp, 1, 3), tol, 1.0_wp, "stops")
      end do
   end subroutine test_whole

   !> Three points of unequal pushes and coefficients: the first one stops, about which the slab
   !> turns on; pushes of the others change, and what they rub by.
   subroutine test_some(error)
      type(error_t), allocatable, intent(out) :: error
      type(slab_t) :: slab
      type(rate_jump_t) :: jump
      real(wp) :: mean(2), force(0:2)
      integer :: k

      slab%at = corner(:, [1, 2, 4])
      slab%v = [-0.75_wp, 1.0_wp, 0.0_wp]
      slab%w(3) = 1.0_wp
      slab%mu = [0.9_wp, 0.3_wp, 0.2_wp]
      slab%push = [3.0_wp, 2.0_wp, 0.75_wp]
      slab%stops = [.true., .false., .false.]
      slab%v(1:2) = slab%v(1:2) + [0.05_wp, -0.02_wp]
      slab%mean = slips(slab)*0.9_wp
      slab%mean(:, 1) = -0.1_wp*[0.05_wp, -0.02_wp]
      call find_jump(slab, .false., jump)
      call check_jump(slab, jump, "some", error)
      if (allocated(error)) return
      call check_near(error, rates(slab, jump, 1), spread(0.0_wp, 1, 3), tol, 1.0_wp, "it stops")
      do k = 2, 3
         mean = -0.5_wp*(jump%mean(:, k) + matmul(jump%problem%w(3*k - 1:3*k, :), &
            reshape(jump%impulse, [9])))
         force = force_of(jump, k)
         call check_near(error, force(1:), slab%mu(k)*force(0)*mean/norm2(mean), tol, 1.0_wp, &
            "friction of " // to_text(k))
         call check_true(error, abs(jump%impulse(0, k)) > 1.0e-3_wp, "another push")
         call check_true(error, jump%taken(k) + jump%rubbed(k) > 0.0_wp, "it takes energy")
      end do
   end subroutine test_some

   !> The push behind is all but none: as friction tips the slab less the point behind is pushed;
   !> where it tips it more, that opens and does not rub any longer.
   subroutine test_opens(error)
      type(error_t), allocatable, intent(out) :: error
      type(slab_t) :: slab
      type(rate_jump_t) :: jump
      real(wp) :: rate(3)

      slab%at = corner(:, [1, 2, 3])
      slab%at(2, 1) = 0.0_wp
      slab%mu = [0.2_wp, 0.9_wp, 0.9_wp]
      slab%push = [0.01_wp, 1.0_wp, 1.0_wp]
      slab%v(1) = 0.1_wp
      slab%mean = slips(slab)
      slab%stops = [.false., .true., .true.]
      call find_jump(slab, .false., jump, part=0.0_wp)
      call check_jump(slab, jump, "opens", error)
      if (allocated(error)) return
      call check_near(error, jump%problem%base(:, 1) + jump%impulse(:, 1), spread(0.0_wp, 1, 3), &
         0.0_wp, 1.0_wp, "no force")
      rate = rates(slab, jump, 1)
      call check_true(error, rate(1) > 1.0e-3_wp, "it opens")
   end subroutine test_opens

   !> What stops the first point turns the slab, by which the second one, farther out, would slide
   !> back: that stops, too.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      type(slab_t) :: slab
      type(rate_jump_t) :: jump
      integer :: k

      slab%at = corner(:, [1, 2, 4])
      slab%at(2, 2) = -1.5_wp
      slab%mu = [0.9_wp, 0.9_wp, 0.01_wp]
      slab%push = [1.0_wp, 1.0_wp, 0.5_wp]
      slab%v(1) = 0.1_wp
      slab%mean = slips(slab)
      slab%mean(:, 1) = -slab%mean(:, 1)
      slab%stops = [.true., .false., .false.]
      call find_jump(slab, .false., jump)
      call check_jump(slab, jump, "turned", error)
      if (allocated(error)) return
      call check_true(error, .not. jump%stopping%slides(2), "the second one does not slide on")
      do k = 1, 2
         call check_near(error, rates(slab, jump, k), spread(0.0_wp, 1, 3), tol, 1.0_wp, "it stops")
      end do
   end subroutine test_turned

   !> Where all pushes stay so does the friction of what slides on.
   subroutine test_stay(error)
      type(error_t), allocatable, intent(out) :: error
      type(slab_t) :: slab
      type(rate_jump_t) :: jump

      slab%at = corner(:, [1, 2, 4])
      slab%v = [0.05_wp, -0.02_wp, 0.0_wp]
      slab%mu = [0.9_wp, 0.3_wp, 0.2_wp]
      slab%push = [3.0_wp, 2.0_wp, 0.75_wp]
      slab%mean = spread([-0.01_wp, 0.0_wp], 2, 3)
      slab%stops = [.true., .false., .false.]
      call find_jump(slab, .true., jump)
      call check_jump(slab, jump, "stay", error)
      if (allocated(error)) return
      call check_near(error, reshape(jump%impulse(:, 2:), [6]), spread(0.0_wp, 1, 6), 0.0_wp, &
         1.0_wp, "what slides on")
      call check_near(error, jump%impulse(0, 1), 0.0_wp, 0.0_wp, 1.0_wp, "the push")
      associate (after => rates(slab, jump, 1))
         call check_near(error, after(2:), [0.0_wp, 0.0_wp], tol, 1.0_wp, "it stops")
      end associate
   end subroutine test_stay

   !> The jump of the slab. Friction of the step is at its limit, or at `part` of it.
   subroutine find_jump(slab, pushes_stay, jump, part)
      type(slab_t), intent(in) :: slab
      logical, intent(in) :: pushes_stay
      type(rate_jump_t), intent(out) :: jump
      real(wp), intent(in), optional :: part
      real(wp) :: row(6, 3, size(slab%mu))
      integer :: i, k, n
      logical :: stays

      n = size(slab%mu)
      jump%row = [(k, k = 1, n)]
      call contact_problem_create(jump%problem, 2, n)
      allocate(jump%rate(0:2, n), jump%taken(n), source=0.0_wp)
      allocate(jump%stopping)
      allocate(jump%stopping%stays(0:2, n), source=pushes_stay)
      jump%stopping%slides = .not. slab%stops .and. .not. pushes_stay
      jump%stopping%rate = -slips(slab)
      jump%mean = -2.0_wp*slab%mean
      associate (problem => jump%problem)
         do k = 1, n
            row(:, 1, k) = row_of(slab%at(:, k), [0.0_wp, 0.0_wp, 1.0_wp])
            row(:, 2, k) = row_of(slab%at(:, k), [-1.0_wp, 0.0_wp, 0.0_wp])
            row(:, 3, k) = row_of(slab%at(:, k), [0.0_wp, -1.0_wp, 0.0_wp])
            do i = 1, 3
               jump%rate(i - 1, k) = dot_product(row(:, i, k), [slab%v, slab%w])
            end do
            problem%mu(k) = slab%mu(k)
            problem%base(0, k) = slab%push(k)
            problem%base(1:, k) = slab%mu(k)*slab%push(k)*slab%mean(:, k)/norm2(slab%mean(:, k))
            if (present(part)) problem%base(1:, k) = part*problem%base(1:, k)
            jump%taken(k) = dot_product(problem%base(1:, k), slab%mean(:, k))
            problem%free(1:, k) = jump%mean(:, k)
            if (slab%stops(k)) then
               problem%free(1:, k) = jump%rate(1:, k)
               jump%stopping%stays(1:, k) = .false.
            end if
            if (pushes_stay .and. .not. slab%stops(k)) problem%free(1:, k) = 0.0_wp
            if (pushes_stay .and. .not. slab%stops(k)) problem%mu(k) = 2.0_wp*problem%mu(k)
         end do
         problem%w = matmul(transpose(reshape(row, [6, 3*n])), spread(1.0_wp/[spread(mass, 1, 3), &
            inertia], 2, 3*n)*reshape(row, [6, 3*n]))
         do k = 1, n
            do i = 1, 3
               stays = jump%stopping%stays(i - 1, k)
               if (stays) call part_row(problem%w, 3*(k - 1) + i)
            end do
         end do
      end associate
      call rate_jump_solve(jump)
   end subroutine find_jump

   !> A row that nothing moves, and that moves nothing but itself.
   pure subroutine part_row(w, i)
      real(wp), intent(inout) :: w(:, :)
      integer, intent(in) :: i
      real(wp) :: own

      own = w(i, i)
      w(:, i) = 0.0_wp
      w(i, :) = 0.0_wp
      w(i, i) = own
   end subroutine part_row

   !> The gradient of the velocity of a point along `way` by those of the slab.
   pure function row_of(at, way) result(row)
      real(wp), intent(in) :: at(3), way(3)
      real(wp) :: row(6)

      row = [way, cross(at, way)]
   end function row_of

   pure function cross(a, b)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: cross(3)

      cross = a([2, 3, 1])*b([3, 1, 2]) - a([3, 1, 2])*b([2, 3, 1])
   end function cross

   !> Push and friction of step and jump at point `k`.
   pure function force_of(jump, k) result(force)
      type(rate_jump_t), intent(in) :: jump
      integer, intent(in) :: k
      real(wp) :: force(0:2)

      force = jump%problem%base(:, k) + jump%impulse(:, k)
   end function force_of

   !> Rates of slips before the jump.
   pure function slips(slab) result(slip)
      type(slab_t), intent(in) :: slab
      real(wp) :: slip(2, size(slab%mu)), u(3)
      integer :: k

      do k = 1, size(slab%mu)
         u = slab%v + cross(slab%w, slab%at(:, k))
         slip(:, k) = u(:2)
      end do
   end function slips

   !> The velocity of point `k` behind the jump, by momenta: up, and along the surface.
   pure function rates(slab, jump, k) result(rate)
      type(slab_t), intent(in) :: slab
      type(rate_jump_t), intent(in) :: jump
      integer, intent(in) :: k
      real(wp) :: rate(3), v(3), w(3), impulse(3)
      integer :: i

      v = slab%v
      w = slab%w
      do i = 1, size(slab%mu)
         impulse = [-jump%impulse(1:, i), jump%impulse(0, i)]
         v = v + impulse/mass
         w = w + cross(slab%at(:, i), impulse)/inertia
      end do
      v = v + cross(w, slab%at(:, k))
      rate = v([3, 1, 2])
   end function rates

   !> Surfaces push where they hold and part where they do not, friction is within its limit and
   !> opposite to slip where it is at that, and energy goes by what friction takes.
   subroutine check_jump(slab, jump, name, error)
      type(slab_t), intent(in) :: slab
      type(rate_jump_t), intent(in) :: jump
      character(*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: v(3), w(3), rate(3), energy, impulse(3), force(0:2)
      integer :: k

      call check_true(error, jump%is_done, name // ": a jump")
      if (allocated(error)) return
      v = slab%v
      w = slab%w
      do k = 1, size(slab%mu)
         rate = rates(slab, jump, k)
         force = force_of(jump, k)
         call check_true(error, force(0) >= 0.0_wp .and. norm2(force(1:)) <= slab%mu(k)*force(0) &
            *(1.0_wp + tol), name // ": the law at " // to_text(k))
         if (.not. any(jump%stopping%stays)) call check_near(error, force(0)*(rate(1) &
            - jump%rate(0, k)), 0.0_wp, tol, 1.0_wp, name // ": gap " // to_text(k))
         impulse = [-jump%impulse(1:, k), jump%impulse(0, k)]
         v = v + impulse/mass
         w = w + cross(slab%at(:, k), impulse)/inertia
      end do
      energy = 0.5_wp*(mass*sum(v*v - slab%v*slab%v) + sum(inertia*(w*w - slab%w*slab%w)))
      call check_near(error, energy, -sum(jump%rubbed), tol, 1.0_wp, name // ": energy")
      call check_true(error, sum(jump%taken + jump%rubbed) >= 0.0_wp, name // ": friction takes")
   end subroutine check_jump

end module test_stopping_jump
