!> Velocity jump at the end of a step that gives back the energy lost in closing contacts.
!>
!> Along p = M^-1 sum w_k grad gap_k, w_k = lam_k gap_k(q0) >= 0, the kinetic energy changes by
!> s b + s^2 a/2; the positive root of s b + s^2 a/2 = lost energy is taken. The jump pushes the
!> bodies apart and keeps the momenta. Source: Laursen & Love (2002); docs/theory.md,
!> eqs. (21) and (22).
module emcon_velocity_update
   use emcon_constraint, only : condition_add_field, condition_t
   use emcon_constraints, only : constraint_set_t
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
      velocity_update_change, velocity_update_accelerate

   !> Contacts that stay closed keep gaps of this size relative to an edge: round-off, no loss.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)

   !> A push that is to give energy.
   type :: push_t
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) along it [M L/T^2]
      real(wp) :: gain = 0.0_wp                  !! [M L^2/T^2]
   end type push_t

   !> A jump that changes the rates C v of conditions by impulses along their gradients C.
   type :: rate_jump_t
      integer, allocatable :: row(:)             !! (n) which conditions of the set
      real(wp), allocatable :: rate(:)           !! (n) before [L/T]
      real(wp), allocatable :: change(:)         !! (n) [L/T]
      logical :: is_done = .false.               !! .false.: they depend on each other, or it would
                                                 !! make energy
      real(wp), allocatable :: impulse(:)        !! (n) [M L/T]
      real(wp) :: lost = 0.0_wp                  !! in the conditions, >= 0 [M L^2/T^2]
      real(wp) :: gained = 0.0_wp                !! of kinetic energy; more than -lost: by what is
                                                 !! driven [M L^2/T^2]
   end type rate_jump_t

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

   !> Add to `v` the jump M^-1 C^T mu with C M^-1 C^T mu = `change`: docs/theory.md, eq. (22e).
   subroutine velocity_update_change(self, system, set, jump, v, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(rate_jump_t), intent(inout) :: jump
      real(wp), intent(inout), contiguous :: v(:, :)     !! (n_dim, n_node)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: momentum(size(v, 1), size(v, 2))
      real(wp), allocatable :: row(:, :), response(:, :)
      real(dp) :: product(size(jump%row), size(jump%row)), mu(size(jump%row), 1)
      logical :: is_singular

      jump%is_done = .false.
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call find_responses(self, system, set, jump%row, row, response, error)
      if (allocated(error)) return
      product = real(matmul(transpose(row), response), dp)
      call dense_solve(product, reshape(real(jump%change, dp), shape(mu)), mu, is_singular)
      if (is_singular) return
      jump%impulse = real(mu(:, 1), wp)
      jump%lost = -dot_product(jump%impulse, jump%rate + 0.5_wp*jump%change)
      jump%is_done = jump%lost >= 0.0_wp
      if (.not. jump%is_done) return
      self%jump = matmul(response, jump%impulse)
      call mass_times(system, v, momentum)
      call pick(system, momentum, self%push)
      jump%gained = dot_product(self%push, self%jump) &
         + 0.5_wp*dot_product(jump%impulse, jump%change)
      call add_jump(self, system, 1.0_wp, v)
   end subroutine velocity_update_change

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
      integer :: k

      acceleration = 0.0_wp
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (.not. allocated(error)) call keep_held(self, system, held, error, &
         [(-bend(held%item(k), v), k = held%n_linear + 1, held%n_permanent)])
      if (.not. allocated(error)) call add_jump(self, system, 1.0_wp, acceleration)
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

      self%part = 0.0_wp
      if (.not. self%is_ready) call factorise_mass(self, system, error)
      if (allocated(error)) return
      if (self%mass%is_singular) return
      call pick(system, force, self%push)
      call self%mass%solve(self%push, self%jump, error)
      if (.not. allocated(error)) call keep_held(self, system, set, error)
      if (allocated(error)) return
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

   !> Take out of the jump what conditions that always hold, and are not linear, forbid: add
   !> M^-1 C^T mu such that C times the jump is 0, or `wanted`, with their gradients C at the end of
   !> the step.
   subroutine keep_held(self, system, set, error, wanted)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: wanted(:)    !! (conditions that are not linear)
      real(wp), allocatable :: row(:, :), response(:, :)
      real(dp), dimension(set%n_permanent - set%n_linear, 1) :: rate, mu
      real(dp) :: product(size(rate), size(rate))
      integer :: k, l
      logical :: is_singular

      if (size(rate) == 0) return
      call find_responses(self, system, set, [(k, k = set%n_linear + 1, set%n_permanent)], row, &
         response, error)
      if (allocated(error)) return
      do k = 1, size(rate)
         rate(k, 1) = -real(dot_product(row(:, k), self%jump), dp)
         if (present(wanted)) rate(k, 1) = rate(k, 1) + real(wanted(k), dp)
         do l = 1, k
            product(l, k) = real(dot_product(row(:, l), response(:, k)), dp)
            product(k, l) = product(l, k)
         end do
      end do
      call dense_solve(product, rate, mu, is_singular)
      if (.not. is_singular) self%jump = self%jump + matmul(response, real(mu(:, 1), wp))
   end subroutine keep_held

   !> Gradients of conditions at the end of the step, and what impulses of 1 along them move.
   subroutine find_responses(self, system, set, which, row, response, error)
      type(velocity_update_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: which(:)            !! (n) of the conditions of the set
      real(wp), allocatable, intent(out) :: row(:, :), response(:, :) !! (n_unknown, n) C, M^-1 C^T
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: field(size(system%space%is_alive, 1), size(system%space%is_alive, 2))
      integer :: k

      allocate(row(size(self%jump), size(which)), response(size(self%jump), size(which)))
      do k = 1, size(which)
         field = 0.0_wp
         call condition_add_field(set%item(which(k)), 1.0_wp, set%item(which(k))%c, field)
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
