!> Jumps that change the rates of contacts by impulses, as laws say that take impulses and rates for
!> forces and motions.
!>
!> Source: docs/theory.md, eqs. (22e) and (22f).
module emcon_rate_jump
   use emcon_constraints, only : constraint_set_t
   use emcon_contact_parts, only : contact_parts_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_missed, contact_problem_t, &
      met, nearly_met
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_system, only : mass_times, system_t
   use emcon_velocity_mass, only : impulse_row_t, velocity_mass_keep, velocity_mass_move, &
      velocity_mass_pick, velocity_mass_prepare, velocity_mass_respond, velocity_update_t
   implicit none
   private
   public :: rate_jump_t, velocity_update_change

   !> Laws that are met to this part need no jump: a sum of some products.
   real(wp), parameter :: rounded = 64.0_wp*epsilon(1.0_wp)
   !> Where slip has a direction and rows follow from others a law may be met to no more than this
   !> part of the largest impulse. What it leaves of rates the next step begins with: no drift; but
   !> without the jump all that it would stop turns back.
   real(wp), parameter :: nearly_stopped = 1.0e-6_wp

   !> A jump that changes the rates of contacts by impulses along the gradients C of their gaps and
   !> slips, as laws say that take impulses and rates for forces and motions.
   type :: rate_jump_t
      integer, allocatable :: row(:)             !! (n) which conditions of the set
      !> Laws and what the step has done; W [1/M] is found
      type(contact_problem_t) :: problem
      !> (0:n_slip, n) of gaps, and of slips the other way round, before [L/T]
      real(wp), allocatable :: rate(:, :)
      !> (0:n_slip, n) impulses of the step that stay. Allocated: the jump is for what friction
      !> stops by itself, at the end of the step
      logical, allocatable :: stays(:, :)
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
      real(wp) :: momentum(size(v, 1), size(v, 2)), after(size(jump%rate, 1), size(jump%rate, 2))
      real(wp), allocatable :: response(:, :)
      type(contact_effort_t) :: effort
      logical :: is_singular

      jump%is_done = .false.
      jump%is_idle = .true.
      call velocity_mass_prepare(self, system, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call find_compliance(self, system, set, jump, response, is_singular, error)
      if (allocated(error) .or. is_singular) return
      if (allocated(jump%impulse)) deallocate(jump%impulse)
      allocate(jump%impulse(0:jump%problem%n_slip, size(jump%row)), source=0.0_wp)
      jump%is_idle = contact_problem_missed(jump%problem, jump%impulse) <= rounded
      if (jump%is_idle) return
      call contact_parts_solve(jump%problem, jump%impulse, effort, jump%is_done, .true.)
      if (jump%is_done) jump%is_done = contact_problem_missed(jump%problem, jump%impulse) &
         <= merge(nearly_stopped, nearly_met, jump%problem%n_slip > 1)
      if (.not. jump%is_done) return
      ! Pushes of the step that pull by round-off are those of the step, too.
      if (allocated(jump%stays)) where (jump%stays) jump%impulse = 0.0_wp
      after = reshape(matmul(jump%problem%w, reshape(jump%impulse, [size(after)])), shape(after))
      call measure_losses(jump, after)
      if (.not. jump%is_done) return
      self%jump = matmul(response, reshape(jump%impulse, [size(jump%impulse)]))
      call mass_times(system, v, momentum)
      call velocity_mass_pick(system, momentum, self%push)
      jump%gained = dot_product(self%push, self%jump) + 0.5_wp*sum(jump%impulse*after)
      call velocity_mass_move(self, system, 1.0_wp, v)
   end subroutine velocity_update_change

   !> What friction and the rest take by the impulses of a jump; it is none if the rest would give.
   pure subroutine measure_losses(jump, change)
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(in) :: change(0:, :)      !! (0:n_slip, n) of rates by it [L/T]
      real(wp) :: taken(size(jump%row))

      if (allocated(jump%stays)) then
         associate (s => jump%problem%n_slip)
            jump%rubbed = -sum(jump%impulse(1:s, :)*(jump%rate(1:s, :) + 0.5_wp*change(1:s, :)), 1)
         end associate
         jump%lost = -sum(jump%impulse(0, :)*(jump%rate(0, :) + 0.5_wp*change(0, :)))
         jump%is_done = sum(jump%rubbed) >= 0.0_wp .and. jump%lost >= -met*maxval(abs( &
            jump%problem%base) + abs(jump%impulse))*sum(abs(jump%rate) + abs(change))
         return
      end if
      ! Slips are by half of the size of the step, so that they are twice their mean rates.
      associate (problem => jump%problem, more => jump%impulse, s => jump%problem%n_slip)
         taken = -0.5_wp*sum((problem%base(1:s, :) + more(1:s, :)) &
            *(problem%free(1:s, :) + change(1:s, :)), 1)
         jump%rubbed = taken - jump%taken
         jump%lost = -sum(more*(jump%rate + 0.5_wp*change)) - sum(jump%rubbed)
         ! Impulses are as exact as their problem is solved.
         jump%is_done = jump%lost >= -met*maxval(abs(problem%base) + abs(more)) &
            *sum(abs(jump%rate) + abs(problem%free) + abs(change))
      end associate
   end subroutine measure_losses

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
         if (allocated(jump%stays)) call part_rows(pack(jump%stays, .true.), w)
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
