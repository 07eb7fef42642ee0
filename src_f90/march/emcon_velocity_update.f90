!> Velocity jump at the end of a step that gives back the energy lost in closing contacts.
!>
!> Along p = M^-1 sum w_k grad gap_k, w_k = lam_k gap_k(q0) >= 0, the kinetic energy changes by
!> s b + s^2 a/2; the positive root of s b + s^2 a/2 = lost energy is taken. The jump pushes the
!> bodies apart and keeps the momenta. Source: Laursen & Love (2002); docs/theory.md,
!> eqs. (21) and (22).
module emcon_velocity_update
   use emcon_constraint, only : condition_add_field, condition_rate, condition_row_gradient, &
      condition_t
   use emcon_constraints, only : constraint_set_t
   use emcon_contact_problem, only : contact_effort_t, contact_problem_missed, &
      contact_problem_solve, contact_problem_t, met, nearly_met
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_numbering, only : add_to_dofs, numbering_matrix, pick_unknowns
   use emcon_root, only : smaller_root
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite, sparse_solver_t
   use emcon_system, only : mass_times, system_t
   use emcon_term_registry, only : terms_mass_values
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   implicit none
   private
   public :: push_t, velocity_update_t, velocity_update_reset, velocity_update_apply, &
      velocity_update_push, velocity_update_free, push_weights, rate_jump_t, &
      velocity_update_change, velocity_update_hold, velocity_update_accelerate

   !> Contacts that stay closed keep gaps of this size relative to an edge: round-off, no loss.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)
   !> Jumps make no energy that is less than this part of what they move: a sum of some products.
   real(wp), parameter :: rounded = 64.0_wp*epsilon(1.0_wp)

   !> A push that is to give energy.
   type :: push_t
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) along it [M L/T^2]
      real(wp) :: gain = 0.0_wp                  !! [M L^2/T^2]
   end type push_t

   !> A jump that changes the rates of contacts by impulses along the gradients C of their gaps and
   !> slips, as laws say that take impulses and rates for forces and motions.
   type :: rate_jump_t
      integer, allocatable :: row(:)             !! (n) which conditions of the set
      !> Laws and what the step has done; W [1/M] is found
      type(contact_problem_t) :: problem
      !> (0:n_slip, n) of gaps, and of slips the other way round, before [L/T]
      real(wp), allocatable :: rate(:, :)
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

   !> What an impulse acts along.
   type :: row_t
      integer :: condition                       !! of the set
      integer :: slip = 0                        !! of it; 0: the gap
   end type row_t

   !> The kinetic energy that s times a jump gives: s b + s^2 a/2.
   type :: gain_t
      real(wp) :: a = 0.0_wp, b = 0.0_wp         !! [M L^2/T^2]
   end type gain_t

   type :: velocity_update_t
      logical :: is_ready = .false.              !! mass factorised for the present numbering
      integer :: choice = solver_default         !! of the direct solver, as the deck asks
      class(sparse_solver_t), allocatable :: user    !! by a program, for that choice
      class(sparse_solver_t), allocatable :: mass
      real(wp), allocatable :: push(:), jump(:)  !! (n_unknown)
      real(wp) :: part = 0.0_wp                  !! of the jump that was taken last [T]
   end type velocity_update_t

contains

   !> The numbering has changed.
   subroutine velocity_update_reset(self, choice, user)
      type(velocity_update_t), intent(inout) :: self
      integer, intent(in) :: choice              !! one of `solver_`, or above
      class(sparse_solver_t), intent(in), optional :: user     !! as in `solver_create`

      self%choice = choice
      if (allocated(self%user)) deallocate(self%user)
      if (present(user)) allocate(self%user, source=user)
      self%is_ready = .false.
   end subroutine velocity_update_reset

   subroutine velocity_update_free(self)
      type(velocity_update_t), intent(inout) :: self

      if (allocated(self%mass)) call self%mass%free()
      self%is_ready = .false.
   end subroutine velocity_update_free

   !> Add the jump to `v`. `restored` is the energy given back, 0 if there was none to give or no
   !> root (`has_root`).
   subroutine velocity_update_apply(self, system, set, v, restored, has_root, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      real(wp), intent(out) :: restored          !! >= 0 [M L^2/T^2]
      logical, intent(out) :: has_root           !! .false.: `v` is left as it is
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: force(size(v, 1), size(v, 2)), lost, noise
      type(gain_t) :: gain
      integer :: k

      restored = 0.0_wp
      has_root = .true.
      lost = 0.0_wp
      noise = 0.0_wp
      do k = set%n_permanent + 1, set%n
         lost = lost - set%lam(k)*set%item(k)%dgap
         noise = noise + gap_noise*abs(set%lam(k))*set%item(k)%size
      end do
      if (lost <= noise) return
      call push_forces(set, push_weights(set), force)
      call push_along(self, system, set, force, v, gain, error)
      if (allocated(error)) return
      has_root = gain%a > 0.0_wp
      if (.not. has_root) return
      call add_jump(self, system, jump_size(gain%a, gain%b, lost), v)
      restored = lost
   end subroutine velocity_update_apply

   !> Add to `v` the jump along M^-1 of a force that gives an energy to it, the smaller one of the
   !> two: docs/theory.md, eq. (22).
   subroutine velocity_update_push(self, system, set, push, v, has_root, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(push_t), intent(in) :: push
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      logical, intent(inout) :: has_root         !! .false.: `v` is left as it is, as by an error
      type(error_t), allocatable, intent(out) :: error
      type(gain_t) :: gain
      real(wp) :: part

      call push_along(self, system, set, push%force, v, gain, error)
      if (allocated(error)) return
      call smaller_root(gain%a, gain%b, push%gain, part, has_root)
      if (has_root) call add_jump(self, system, part, v)
   end subroutine velocity_update_push

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
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call find_compliance(self, system, set, jump, response, is_singular, error)
      if (allocated(error) .or. is_singular) return
      if (allocated(jump%impulse)) deallocate(jump%impulse)
      allocate(jump%impulse(0:jump%problem%n_slip, size(jump%row)), source=0.0_wp)
      jump%is_idle = contact_problem_missed(jump%problem, jump%impulse) <= rounded
      if (jump%is_idle) return
      call contact_problem_solve(jump%problem, jump%impulse, effort, jump%is_done)
      if (jump%is_done) jump%is_done = contact_problem_missed(jump%problem, jump%impulse) &
         <= nearly_met
      if (.not. jump%is_done) return
      after = reshape(matmul(jump%problem%w, reshape(jump%impulse, [size(after)])), shape(after))
      call measure_losses(jump, after)
      if (.not. jump%is_done) return
      self%jump = matmul(response, reshape(jump%impulse, [size(jump%impulse)]))
      call mass_times(system, v, momentum)
      call pick(system, momentum, self%push)
      jump%gained = dot_product(self%push, self%jump) + 0.5_wp*sum(jump%impulse*after)
      call add_jump(self, system, 1.0_wp, v)
   end subroutine velocity_update_change

   !> What friction and the rest take by the impulses of a jump; it is none if the rest would give.
   pure subroutine measure_losses(jump, change)
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(in) :: change(0:, :)      !! (0:n_slip, n) of rates by it [L/T]
      real(wp), dimension(size(jump%row)) :: taken, uncertain

      ! Slips are by half of the size of the step, so that they are twice their mean rates.
      associate (problem => jump%problem, more => jump%impulse, s => jump%problem%n_slip)
         taken = -0.5_wp*sum((problem%base(1:s, :) + more(1:s, :)) &
            *(problem%free(1:s, :) + change(1:s, :)), 1)
         uncertain = sum((abs(problem%base(1:s, :)) + abs(more(1:s, :))) &
            *(abs(problem%free(1:s, :)) + abs(change(1:s, :))), 1) &
            + sum(abs(more)*(abs(jump%rate) + abs(change)), 1)
         jump%rubbed = taken - jump%taken
         jump%lost = -sum(more*(jump%rate + 0.5_wp*change)) - sum(jump%rubbed)
         ! Impulses are as exact as their problem is solved.
         jump%is_done = jump%lost >= -rounded*sum(uncertain) &
            - met*maxval(abs(problem%base))*sum(abs(jump%rate) + abs(change))
      end associate
   end subroutine measure_losses

   !> Take out of `v` the rates of conditions that always hold and are not linear, as rigid bodies
   !> have none. `lost` is the energy that goes, `gained` that which comes into all that moves.
   subroutine velocity_update_hold(self, system, set, v, lost, gained, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      real(wp), intent(out) :: lost              !! >= 0 [M L^2/T^2]
      real(wp), intent(out) :: gained            !! -lost but for work of what is driven [M L^2/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: jump(:, :)
      real(wp) :: moved(size(v, 1), size(v, 2)), momentum(size(v, 1), size(v, 2))
      logical :: is_singular
      integer :: k

      lost = 0.0_wp
      gained = 0.0_wp
      if (set%n_permanent == set%n_linear) return
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      allocate(jump(size(self%jump), 1), source=0.0_wp)
      call keep_held(self, system, set, error, jump, is_singular, &
         [(-condition_rate(set%item(k), v), k = set%n_linear + 1, set%n_permanent)])
      if (allocated(error) .or. is_singular) return
      self%jump = jump(:, 1)
      call mass_times(system, v, momentum)
      call pick(system, momentum, self%push)
      gained = dot_product(self%push, self%jump)
      moved = 0.0_wp
      call add_jump(self, system, 1.0_wp, moved)
      call mass_times(system, moved, momentum)
      call pick(system, momentum, self%push)
      lost = 0.5_wp*dot_product(self%push, self%jump)
      gained = gained + lost
      v = v + moved
   end subroutine velocity_update_hold

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
         call find_responses(self, system, set, [((row_t(jump%row(k), s), s = 0, m - 1), &
            k = 1, n)], row, response, error)
         if (allocated(error)) return
         call keep_held(self, system, set, error, response, is_singular)
         if (allocated(error)) return
         w = matmul(transpose(row), response)
         do k = 1, n
            if (set%item(jump%row(k))%has_friction) cycle
            do i = m*(k - 1) + 2, m*k
               w(i, i) = w(m*(k - 1) + 1, m*(k - 1) + 1)
            end do
         end do
      end associate
   end subroutine find_compliance

   !> The acceleration M^-1 `force` of what moves with `v`, such that conditions that always hold go
   !> on to hold.
   subroutine velocity_update_accelerate(self, system, held, force, v, acceleration, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: held         !! at the place of the velocities
      real(wp), intent(in), contiguous :: force(:, :)    !! (n_dim, n_node) [M L/T^2]
      real(wp), intent(in), contiguous :: v(:, :)        !! (n_dim, n_node) [L/T]
      real(wp), intent(out), contiguous :: acceleration(:, :)   !! (n_dim, n_node) [L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: jump(:, :)
      logical :: is_singular
      integer :: k

      acceleration = 0.0_wp
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (allocated(error)) return
      jump = reshape(self%jump, [size(self%jump), 1])
      call keep_held(self, system, held, error, jump, is_singular, &
         [(-bend(held%item(k), v), k = held%n_linear + 1, held%n_permanent)])
      if (allocated(error)) return
      self%jump = jump(:, 1)
      call add_jump(self, system, 1.0_wp, acceleration)
   end subroutine velocity_update_accelerate

   !> The second derivative of a condition along `v`.
   pure real(wp) function bend(item, v)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: v(:, :)                    !! (n_dim, n_node) [L/T]
      real(wp) :: own(size(v, 1)*item%n_node)

      own = reshape(v(:, item%node(:item%n_node)), shape(own))
      bend = dot_product(own, matmul(item%h(:size(own), :size(own)), own))
   end function bend

   !> Find the jump M^-1 `force` that the shapes of rigid bodies leave; along it the kinetic energy
   !> changes by s b + s^2 a/2; a = 0: there is none.
   subroutine push_along(self, system, set, force, v, gain, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in), contiguous :: force(:, :), v(:, :)
      type(gain_t), intent(out) :: gain
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: momentum(size(v, 1), size(v, 2))
      real(wp), allocatable :: jump(:, :)
      logical :: is_singular

      self%part = 0.0_wp
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (allocated(error)) return
      jump = reshape(self%jump, [size(self%jump), 1])
      call keep_held(self, system, set, error, jump, is_singular)
      if (allocated(error)) return
      self%jump = jump(:, 1)
      gain%a = dot_product(self%push, self%jump)
      call mass_times(system, v, momentum)
      call pick(system, momentum, self%push)
      gain%b = dot_product(self%push, self%jump)
   end subroutine push_along

   !> The entries of `field` at the unknowns that linear constraints leave.
   pure subroutine pick(system, field, vector)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: field(:, :)    !! (n_dim, n_node)
      real(wp), intent(out) :: vector(:)                 !! (n_unknown)

      if (keeps_links(system)) then
         call pick_unknowns(system%space%linked, field, vector)
      else
         call pick_unknowns(system%space%numbering, field, vector)
      end if
   end subroutine pick

   !> Take out of jumps what conditions that always hold, and are not linear, forbid: add
   !> M^-1 C^T mu such that C times a jump is 0, or `wanted`, with their gradients C at the end of
   !> the step.
   subroutine keep_held(self, system, set, error, jump, is_singular, wanted)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(inout) :: jump(:, :)          !! (n_unknown, any)
      logical, intent(out) :: is_singular            !! the jumps are as they were
      real(wp), intent(in), optional :: wanted(:)    !! (conditions that are not linear)
      real(wp), allocatable :: row(:, :), response(:, :)
      real(dp), dimension(set%n_permanent - set%n_linear, size(jump, 2)) :: rate, mu
      real(dp) :: product(size(rate, 1), size(rate, 1))
      integer :: k

      is_singular = .false.
      if (size(rate) == 0) return
      call find_responses(self, system, set, [(row_t(k), k = set%n_linear + 1, &
         set%n_permanent)], row, response, error)
      if (allocated(error)) return
      rate = -real(matmul(transpose(row), jump), dp)
      if (present(wanted)) rate = rate + spread(real(wanted, dp), 2, size(jump, 2))
      product = real(matmul(transpose(row), response), dp)
      call dense_solve(product, rate, mu, is_singular)
      if (.not. is_singular) jump = jump + matmul(response, real(mu, wp))
   end subroutine keep_held

   !> Gradients of gaps and slips of conditions at the end of the step, and what impulses of 1 along
   !> them move. Without friction those of slips are 0.
   subroutine find_responses(self, system, set, which, row, response, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(row_t), intent(in) :: which(:)        !! (n)
      real(wp), allocatable, intent(out) :: row(:, :), response(:, :) !! (n_unknown, n) C, M^-1 C^T
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: field(size(system%space%is_alive, 1), size(system%space%is_alive, 2))
      integer :: k

      allocate(row(size(self%jump), size(which)), response(size(self%jump), size(which)), &
         source=0.0_wp)
      do k = 1, size(which)
         associate (item => set%item(which(k)%condition), slip => which(k)%slip)
            if (slip > 0 .and. .not. item%has_friction) cycle
            field = 0.0_wp
            call condition_add_field(item, 1.0_wp, condition_row_gradient(item, slip), field)
         end associate
         call pick(system, field, row(:, k))
         call self%mass%solve(row(:, k), response(:, k), error)
         if (allocated(error)) return
      end do
   end subroutine find_responses

   !> Add `part` of the jump to `v`.
   subroutine add_jump(self, system, part, v)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: part
      real(wp), intent(inout), contiguous :: v(:, :)

      self%part = part
      if (keeps_links(system)) then
         call add_to_dofs(system%space%linked, self%jump, part, v)
      else
         call add_to_dofs(system%space%numbering, self%jump, part, v)
      end if
   end subroutine add_jump

   !> The root s > 0 of s b + s^2 a/2 = lost.
   pure real(wp) function jump_size(a, b, lost) result(root)
      real(wp), intent(in) :: a                  !! > 0
      real(wp), intent(in) :: b
      real(wp), intent(in) :: lost               !! > 0

      root = sqrt(b*b + 2.0_wp*a*lost)
      if (b > 0.0_wp) then
         root = 2.0_wp*lost/(b + root)
      else
         root = (root - b)/a
      end if
   end function jump_size

   !> Are linear constraints not eliminated in the numbering? A jump has to keep them all the same.
   pure logical function keeps_links(system)
      type(system_t), intent(in) :: system

      keeps_links = system%space%linear%n > 0 .and. .not. system%space%is_reduced
   end function keeps_links

   !> The weights w_k of the constraints of the set [M L^2/T^2].
   pure function push_weights(set) result(weight)
      type(constraint_set_t), intent(in) :: set
      real(wp) :: weight(set%n)

      weight = max(0.0_wp, set%lam(:set%n))*max(0.0_wp, set%item(:set%n)%gap0)
   end function push_weights

   !> Sum of w_k grad gap_k at the end of the step.
   pure subroutine push_forces(set, weight, force)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: weight(:)          !! (n)
      real(wp), intent(out) :: force(:, :)
      integer :: k

      force = 0.0_wp
      do k = set%n_permanent + 1, set%n
         call condition_add_field(set%item(k), weight(k), set%item(k)%c, force)
      end do
   end subroutine push_forces

   !> Factorise the mass over the unknowns, T^T M T over those that linear constraints leave.
   subroutine factorise_mass(self, system, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(error_t), allocatable, intent(out) :: error
      type(triple_product_t) :: product
      type(csr_t) :: mass, links, reduced
      real(dp), allocatable :: value(:)
      integer :: n

      call solver_create(self%choice, matrix_definite, self%mass, self%user)
      n = system%space%numbering%n_unknown
      call terms_mass_values(system%term, value)
      call fill_massless(system%matrix, value)
      if (keeps_links(system)) then
         n = system%space%linked%n_unknown
         mass = system%matrix
         mass%value = value
         call numbering_matrix(system%space%linked, system%space%numbering%dof, links)
         call triple_product_init(product, links, mass, links, reduced, error)
         if (allocated(error)) return
         call triple_product_update(product, links, mass, links, reduced)
         call self%mass%analyse(reduced, error)
         if (.not. allocated(error)) call self%mass%factorise(reduced%value, error)
      else
         call self%mass%analyse(system%matrix, error)
         if (.not. allocated(error)) call self%mass%factorise(value, error)
      end if
      if (allocated(self%push)) deallocate(self%push, self%jump)
      allocate(self%push(n), self%jump(n))
      self%is_ready = .not. allocated(error)
   end subroutine factorise_mass

   !> What has no mass gets the largest one: it stands alone, and nothing pushes it.
   pure subroutine fill_massless(matrix, value)
      type(csr_t), intent(in) :: matrix          !! its pattern
      real(dp), intent(inout) :: value(:)
      integer :: i, k

      do i = 1, matrix%n_row
         k = csr_find(matrix, i, i)
         if (k > 0) then
            if (.not. value(k) > 0.0_dp) value(k) = maxval(value)
         end if
      end do
   end subroutine fill_massless

end module emcon_velocity_update
