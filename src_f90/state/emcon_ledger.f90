!> The energy and momentum ledger: what the system holds and what was done to it.
module emcon_ledger
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : add_moments, n_turn
   use emcon_space, only : space_t
   use emcon_state, only : state_t
   use emcon_system, only : mass_times, system_t
   use emcon_term_registry, only : terms_mass
   use emcon_tie_couple, only : tie_couple_t
   implicit none
   private
   public :: ledger_t, ledger_init, ledger_measure, ledger_momenta, body_momenta, body_masses

   !> Dimensions of space, at most.
   integer, parameter :: most_dim = 3

   !> total = kinetic + strain + potential + contact_energy - external_work stays constant up to the
   !> work of contact, and what damping and friction take: docs/theory.md, eqs. (23) and (24).
   type :: ledger_t
      real(wp) :: kinetic = 0.0_wp               !! [M L^2/T^2]
      real(wp) :: strain = 0.0_wp
      real(wp) :: potential = 0.0_wp             !! of given forces
      real(wp) :: external_work = 0.0_wp         !! of loads and prescribed motion, since the start
      real(wp) :: contact_work = 0.0_wp          !! of contact forces, since the start
      !> Of what STABILIZE bears: forces that are left on bodies that nothing holds, since the start
      real(wp) :: stabilization = 0.0_wp
      !> Of contact work: what impacts with a restitution below 1 took, since the start, >= 0
      real(wp) :: restitution = 0.0_wp
      real(wp) :: decay = 0.0_wp                 !! taken by the scheme, since the start
      real(wp) :: damping = 0.0_wp               !! taken by damped materials, since the start
      real(wp) :: friction = 0.0_wp              !! taken by friction, since the start, >= 0
      real(wp) :: contact_damping = 0.0_wp       !! taken between surfaces, since the start, >= 0
      real(wp) :: contact_energy = 0.0_wp        !! that contact by penalty stores
      real(wp) :: total = 0.0_wp
      real(wp), allocatable :: momentum(:)       !! (n_dim) [M L/T]
      real(wp), allocatable :: angular(:)        !! (1 or 3) about the origin [M L^2/T]
      type(tie_couple_t) :: tie_couple           !! of ties whose surfaces stay apart
      real(wp), allocatable, private :: work(:, :)   !! (n_dim, n_node) momentum of each node
   end type ledger_t

contains

   !> Nothing is held and nothing was done.
   pure subroutine ledger_init(self, n_dim)
      type(ledger_t), intent(out) :: self
      integer, intent(in) :: n_dim               !! > 0

      allocate(self%momentum(n_dim), self%angular(n_turn(n_dim)), source=0.0_wp)
   end subroutine ledger_init

   !> Energies and momenta of `state`; the works stand.
   subroutine ledger_measure(self, system, x, state)
      type(ledger_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: x(:, :)   !! (n_dim, n_node) reference positions [L]
      type(state_t), intent(in) :: state
      real(wp) :: place(most_dim)
      integer :: i, n_dim

      n_dim = size(x, 1)
      if (.not. allocated(self%work)) allocate(self%work, mold=x)
      call mass_times(system, state%v, self%work)
      self%kinetic = 0.5_wp*sum(state%v*self%work)
      self%strain = sum(state%energy)
      self%potential = state%potential
      self%total = self%kinetic + self%strain + self%potential + self%contact_energy &
         - self%external_work
      self%momentum = sum(self%work, dim=2)
      self%angular = 0.0_wp
      do i = 1, size(x, 2)
         place(:n_dim) = x(:, i) + state%u(:, i)
         call add_moments(place(:n_dim), self%work(:, i), self%angular)
      end do
      call keep_motions(system%space, self%momentum, self%angular)
   end subroutine ledger_measure

   !> Linear and angular momentum of each body, rows px, py, lz, in space px to pz and lx to lz, in
   !> the state last measured.
   pure subroutine ledger_momenta(self, system, x, state, momenta)
      type(ledger_t), intent(in) :: self         !! of a measured state
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: x(:, :)   !! (n_dim, n_node) reference positions [L]
      type(state_t), intent(in) :: state         !! the same
      real(wp), intent(out) :: momenta(:, :)     !! (3 or 6, n_body)

      call add_up(system%space, x, state%u, self%work, momenta)
   end subroutine ledger_momenta

   !> The same in any state.
   subroutine body_momenta(system, x, state, momenta)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: x(:, :)   !! (n_dim, n_node) reference positions [L]
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: momenta(:, :)     !! (3 or 6, n_body)
      real(wp) :: momentum(size(x, 1), size(x, 2))

      call mass_times(system, state%v, momentum)
      call add_up(system%space, x, state%u, momentum, momenta)
   end subroutine body_momenta

   !> Sums over the nodes of each body.
   pure subroutine add_up(space, x, u, momentum, momenta)
      type(space_t), intent(in) :: space         !! its bodies
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: momentum(:, :)     !! (n_dim, n_node) [M L/T]
      real(wp), intent(out) :: momenta(:, :)     !! (3 or 6, n_body)
      real(wp) :: place(most_dim)
      integer :: i, n

      n = size(x, 1)
      momenta = 0.0_wp
      do i = 1, size(x, 2)
         if (space%body(i) == 0) cycle
         associate (to => momenta(:, space%body(i)))
            place(:n) = x(:, i) + u(:, i)
            to(:n) = to(:n) + momentum(:, i)
            call add_moments(place(:n), momentum(:, i), to(n + 1:))
         end associate
      end do
      do i = 1, size(momenta, 2)
         call keep_motions(space, momenta(:n, i), momenta(n + 1:, i))
      end do
   end subroutine add_up

   !> What bodies as a whole cannot do, as circles across their axis, has no momentum.
   pure subroutine keep_motions(space, momentum, angular)
      type(space_t), intent(in) :: space
      real(wp), intent(inout) :: momentum(:)     !! (n_dim) [M L/T]
      real(wp), intent(inout) :: angular(:)      !! [M L^2/T]

      where (.not. space%has_motion(:size(momentum))) momentum = 0.0_wp
      where (.not. space%has_motion(size(momentum) + 1:)) angular = 0.0_wp
   end subroutine keep_motions

   !> Mass of each body.
   subroutine body_masses(system, mass)
      type(system_t), intent(in) :: system           !! its terms and bodies
      real(dp), allocatable, intent(out) :: mass(:)  !! (n_body) [M]
      type(csr_t) :: between
      integer :: i, k

      call terms_mass(system%term, between)
      allocate(mass(system%space%n_body), source=0.0_dp)
      do i = 1, between%n_row
         do k = between%row_start(i) + 1, between%row_start(i + 1)
            mass(system%space%body(i)) = mass(system%space%body(i)) + between%value(k)
         end do
      end do
   end subroutine body_masses

end module emcon_ledger
