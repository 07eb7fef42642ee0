!> Jumps that change the rates of contacts by impulses, as laws say that take impulses and rates for
!> forces and motions.
!>
!> Source: docs/theory.md, eqs. (22e) and (22f).
module emcon_rate_jump
   use emcon_constraints, only : constraint_set_t
   use emcon_contact_parts, only : contact_parts_find, contact_parts_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_map, &
      contact_problem_missed, contact_problem_t, met, nearly_met
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_system, only : mass_times, system_t
   use emcon_velocity_mass, only : impulse_row_t, velocity_mass_keep, velocity_mass_move, &
      velocity_mass_pick, velocity_mass_prepare, velocity_mass_respond, velocity_update_t
   implicit none
   private
   public :: rate_jump_t, stopping_t, rate_jump_solve, velocity_update_change

   !> Laws that are met to this part need no jump: a sum of some products.
   real(wp), parameter :: rounded = 64.0_wp*epsilon(1.0_wp)
   !> Where slip has a direction and rows follow from others a law may be met to no more than this
   !> part of the largest impulse. What it leaves of rates the next step begins with: no drift; but
   !> without the jump all that it would stop turns back.
   real(wp), parameter :: nearly_stopped = 1.0e-6_wp

   !> What a jump for that which friction stops has beside its problem.
   type :: stopping_t
      !> (0:n_slip, n) impulses of the step that stay
      logical, allocatable :: stays(:, :)
      logical, allocatable :: slides(:)          !! (n) on, unless the jump turns it back
      real(wp), allocatable :: rate(:, :)        !! (n_slip, n) of slips the other way round that a
                                                 !! stop takes [L/T]
   end type stopping_t

   !> A jump that changes the rates of contacts by impulses along the gradients C of their gaps and
   !> slips, as laws say that take impulses and rates for forces and motions.
   type :: rate_jump_t
      integer, allocatable :: row(:)             !! (n) which conditions of the set
      !> Laws and what the step has done; W [1/M] is found
      type(contact_problem_t) :: problem
      !> (0:n_slip, n) of gaps, and of slips the other way round, before [L/T]
      real(wp), allocatable :: rate(:, :)
      !> (n_slip, n) of slips the other way round: twice the mean rates that the step has with the
      !> velocities before the jump [L/T]; not allocated: what is free in the problem
      real(wp), allocatable :: mean(:, :)
      !> (n) contacts of rigid bodies in space: what stops or sticks does so by its rate at the end
      logical, allocatable :: by_rate(:)
      !> Allocated: the jump is for what friction stops by itself, at the end of the step
      type(stopping_t), allocatable :: stopping
      !> (n) allocated: of what laws say so much is taken, 0 to 1, the least of all that W couples;
      !> what gaps take has no sign by itself then
      real(wp), allocatable :: part(:)
      logical :: is_done = .false.               !! .false.: there is none to take, or it would make
                                                 !! energy
      logical :: is_idle = .false.               !! laws are met without it, to round-off
      real(wp), allocatable :: taken(:)          !! (n) by friction in the step [M L^2/T^2]
      real(wp), allocatable :: impulse(:, :)     !! (0:n_slip, n) added [M L/T]
      real(wp), allocatable :: rubbed(:)         !! (n) what friction takes more by them, or less
                                                 !! [M L^2/T^2]
      real(wp) :: lost = 0.0_wp                  !! beside that, >= 0 up to round-off [M L^2/T^2]
      real(wp) :: gained = 0.0_wp                !! of kinetic energy; more than -lost - sum(rubbed)
                                                 !! by what is driven [M L^2/T^2]
   end type rate_jump_t

contains

   !> Add to `v` the jump M^-1 C^T y of impulses that obey the laws of `jump`, if it makes no
   !> energy: docs/theory.md, eqs. (22e) and (22f).
   subroutine velocity_update_change(self, system, set, jump, v, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: momentum(size(v, 1), size(v, 2))
      real(wp), allocatable :: response(:, :)
      logical :: is_singular

      jump%is_done = .false.
      jump%is_idle = .true.
      call velocity_mass_prepare(self, system, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call find_compliance(self, system, set, jump, response, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call rate_jump_solve(jump)
      if (.not. jump%is_done) return
      self%jump = matmul(response, reshape(jump%impulse, [size(jump%impulse)]))
      call mass_times(system, v, momentum)
      call velocity_mass_pick(system, momentum, self%push)
      jump%gained = dot_product(self%push, self%jump) + 0.5_wp*sum(jump%impulse*changes(jump))
      call velocity_mass_move(self, system, 1.0_wp, v)
   end subroutine velocity_update_change

   !> The impulses of a jump whose W is known, and what they take: `is_done` tells whether there are
   !> any to take, `is_idle` that none are called for.
   subroutine rate_jump_solve(jump)
      type(rate_jump_t), intent(inout) :: jump

      if (allocated(jump%impulse)) deallocate(jump%impulse)
      allocate(jump%impulse(0:jump%problem%n_slip, size(jump%row)), source=0.0_wp)
      jump%is_done = .false.
      jump%is_idle = contact_problem_missed(jump%problem, jump%impulse) <= rounded
      if (jump%is_idle) return
      call find_impulses(jump)
      if (allocated(jump%part)) call take_parts(jump)
      if (jump%is_done) call measure_losses(jump, changes(jump))
   end subroutine rate_jump_solve

   !> Leave of the impulses what is to be taken.
   pure subroutine take_parts(jump)
      type(rate_jump_t), intent(inout) :: jump
      integer :: coupled(size(jump%row)), k

      call contact_parts_find(jump%problem, coupled)
      do k = 1, size(coupled)
         jump%impulse(:, k) = minval(jump%part, coupled == coupled(k))*jump%impulse(:, k)
      end do
      jump%is_done = jump%is_done .and. any(jump%part > 0.0_wp)
   end subroutine take_parts

   !> Impulses that obey the laws. A contact that slides on and that they would turn back is one to
   !> stop, too: there are ever more of these.
   subroutine find_impulses(jump)
      type(rate_jump_t), intent(inout) :: jump   !! impulses: a start, the solution
      type(contact_effort_t) :: effort
      logical :: turns_back(size(jump%row))
      integer :: k

      do
         call contact_parts_solve(jump%problem, jump%impulse, effort, jump%is_done, .true.)
         if (jump%is_done) jump%is_done = contact_problem_missed(jump%problem, jump%impulse) &
            <= merge(nearly_stopped, nearly_met, jump%problem%n_slip > 1)
         if (.not. jump%is_done) return
         if (.not. allocated(jump%stopping)) exit
         call find_turning(jump, turns_back)
         if (.not. any(turns_back)) exit
         do k = 1, size(turns_back)
            if (turns_back(k)) jump%problem%free(1:, k) = jump%stopping%rate(:, k)
         end do
         jump%stopping%slides = jump%stopping%slides .and. .not. turns_back
      end do
      if (jump%problem%n_slip > 1) call obey(jump)
      ! Pushes of the step that pull by round-off are those of the step, too.
      if (allocated(jump%stopping)) where (jump%stopping%stays) jump%impulse = 0.0_wp
   end subroutine find_impulses

   !> Which contacts that slide on would have, at the end, a rate against their slip over the step?
   pure subroutine find_turning(jump, turns_back)
      type(rate_jump_t), intent(in) :: jump
      logical, intent(out) :: turns_back(:)      !! (n)
      real(wp), dimension(0:jump%problem%n_slip, size(jump%row)) :: change, after

      change = changes(jump)
      after = jump%rate + change
      turns_back = jump%stopping%slides .and. &
         sum(after(1:, :)*(jump%mean + change(1:, :)), 1) < 0.0_wp
   end subroutine find_turning

   !> What the laws are missed by is left to rates: impulses are as Coulomb's law allows.
   pure subroutine obey(jump)
      type(rate_jump_t), intent(inout) :: jump
      real(wp) :: defect(0:jump%problem%n_slip, size(jump%row))

      call contact_problem_map(jump%problem, jump%impulse, defect)
      jump%impulse = jump%impulse - defect
   end subroutine obey

   !> Of rates, by the impulses [L/T].
   pure function changes(jump) result(change)
      type(rate_jump_t), intent(in) :: jump
      real(wp) :: change(0:jump%problem%n_slip, size(jump%row))

      change = reshape(matmul(jump%problem%w, reshape(jump%impulse, [size(change)])), shape(change))
   end function changes

   !> What friction and the rest take by the impulses of a jump; it is none if the rest would give.
   pure subroutine measure_losses(jump, change)
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(in) :: change(0:, :)      !! (0:n_slip, n) of rates by it [L/T]
      real(wp) :: taken(size(jump%row)), mean(jump%problem%n_slip, size(jump%row)), moved

      ! Slips are by half of the size of the step, so that they are twice their mean rates.
      associate (problem => jump%problem, more => jump%impulse, s => jump%problem%n_slip)
         mean = problem%free(1:s, :)
         if (allocated(jump%mean)) mean = jump%mean
         taken = -0.5_wp*sum((problem%base(1:s, :) + more(1:s, :))*(mean + change(1:s, :)), 1)
         jump%rubbed = taken - jump%taken
         jump%lost = -sum(more*(jump%rate + 0.5_wp*change)) - sum(jump%rubbed)
         moved = sum(abs(jump%rate) + abs(problem%free) + abs(change))
         moved = maxval(abs(problem%base) + abs(more))*moved
         if (allocated(jump%stopping)) then
            ! Where rates of gaps stay pushes take nothing over step and jump.
            call leave_to_friction(jump, taken, jump%lost)
            jump%is_done = sum(jump%taken + jump%rubbed) >= -rounded*moved
         else
            ! What friction seems to give comes from pushes: only the sum of both has a sign.
            call leave_to_friction(jump, taken, max(0.0_wp, -sum(jump%taken + jump%rubbed)))
            if (allocated(jump%part)) call leave_to_friction(jump, taken, min(0.0_wp, jump%lost))
            ! Impulses are as exact as their problem is solved; what friction of the step takes
            ! where nothing slides is round-off of slips.
            jump%is_done = min(jump%lost, sum(jump%taken + jump%rubbed) + max(0.0_wp, &
               -sum(jump%taken))) >= -met*moved
         end if
      end associate
   end subroutine measure_losses

   !> Some of what pushes take is friction's, by contacts as it is `taken` there.
   pure subroutine leave_to_friction(jump, taken, loss)
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(in) :: taken(:)           !! (n) [M L^2/T^2]
      real(wp), intent(in) :: loss               !! so much [M L^2/T^2]
      real(wp) :: part(size(taken))

      part = abs(taken)
      if (.not. sum(part) > 0.0_wp) part = 1.0_wp
      jump%rubbed = jump%rubbed + loss/sum(part)*part
      jump%lost = jump%lost - loss
   end subroutine leave_to_friction

   !> What impulses of 1 in gaps and slips move, such that conditions that always hold go on to
   !> hold, and W of the problem. A contact without friction has no slips to solve for.
   subroutine find_compliance(self, system, set, jump, response, is_singular, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(rate_jump_t), intent(inout) :: jump
      real(wp), allocatable, intent(out) :: response(:, :)   !! (n_unknown, (1 + n_slip) n)
      logical, intent(out) :: is_singular                    !! conditions that always hold depend
      type(error_t), allocatable, intent(out) :: error       !! on each other
      real(wp), allocatable :: row(:, :)
      integer :: i, k, s

      associate (n => size(jump%row), m => 1 + jump%problem%n_slip, w => jump%problem%w)
         call velocity_mass_respond(self, system, set, &
            [((impulse_row_t(jump%row(k), s), s = 0, m - 1), k = 1, n)], row, response, error)
         if (allocated(error)) return
         call velocity_mass_keep(self, system, set, error, response, is_singular)
         if (allocated(error)) return
         w = matmul(transpose(row), response)
         if (allocated(jump%stopping)) call part_rows(pack(jump%stopping%stays, .true.), w)
         do k = 1, n
            if (set%item(jump%row(k))%has_friction) cycle
            do i = m*(k - 1) + 2, m*k
               w(i, i) = w(m*(k - 1) + 1, m*(k - 1) + 1)
            end do
         end do
      end associate
   end subroutine find_compliance

   !> Rows that nothing moves, and that move nothing but themselves.
   pure subroutine part_rows(stays, w)
      logical, intent(in) :: stays(:)                        !! (n)
      real(wp), intent(inout) :: w(:, :)                     !! (n, n)
      real(wp) :: own
      integer :: i

      do i = 1, size(stays)
         if (.not. stays(i)) cycle
         own = w(i, i)
         w(:, i) = 0.0_wp
         w(i, :) = 0.0_wp
         w(i, i) = own
      end do
   end subroutine part_rows

end module emcon_rate_jump
