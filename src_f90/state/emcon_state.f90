!> Where an analysis stands: all that the next increment depends on.
module emcon_state
   use emcon_constraint, only : most_slips
   use emcon_factor_base, only : factor_base_t
   use emcon_kinds, only : wp
   use emcon_pair_record, only : pair_record_t
   use emcon_pair_sums, only : pair_sums_t
   use emcon_rigid_rotation, only : rigid_rotation_t
   use emcon_step_control, only : step_control_t
   implicit none
   private
   public :: state_t, clock_t, contact_state_t, past_t, explicit_state_t

   !> Where it stands in time.
   type :: clock_t
      integer :: i_step = 0                      !! step of the deck, from 1
      integer :: n_grid = 0                      !! grid increments of h done in this step
      integer :: n_part = 0                      !! and units of the next one
      integer :: grid_stride = 1                 !! grid increments per increment, a power of two
      integer :: n_easy = 0                      !! increments in a row without a cut
      integer :: increment = 0                   !! increments done over all steps
      integer :: n_before = 0                    !! of these, before this step
      real(wp) :: start_time = 0.0_wp            !! total time at the start of the step [T]
      real(wp) :: time = 0.0_wp                  !! total time [T]
      real(wp) :: step_time = 0.0_wp             !! since the start of the step [T]
      logical :: is_off_grid = .false.           !! after grid point `n_grid`, not at it
   end type clock_t

   !> What is known of contacts, of each constraint.
   type :: contact_state_t
      logical, allocatable :: has_mass(:)        !! (n_node) contact nodes: it has come back
      logical, allocatable :: is_active(:)       !! (n_constraint)
      real(wp), allocatable :: lam(:)            !! (n_constraint) contact forces, 0 where inactive
      !> (n_constraint) how far contact by penalty is closed as it stores, <= 0; > 0: as its gap [L]
      real(wp), allocatable :: closure(:)
      real(wp), allocatable :: stretch(:, :)     !! (most_slips, n_constraint) of their springs [L]
      ! Vectors along the surface, of n_dim - 1 components; with friction, else of no constraint:
      !> (n_slip, n_constraint) direction of slip where it slides, of length 1; 0: it sticks
      real(wp), allocatable :: slides_along(:, :)
      real(wp), allocatable :: drag(:, :)        !! (n_slip, n_constraint) friction against slip
      real(wp), allocatable :: slip(:, :)        !! (n_slip, n_constraint) so far, to and fro [L]
      real(wp), allocatable :: slip_path(:)      !! (n_constraint) the same, all of it >= 0 [L]
      !> (n_dim, n_constraint) `slip` as a vector in space, as surfaces lay when it last acted [L]
      real(wp), allocatable :: slid(:, :)
   contains
      procedure :: begin => contacts_begin
      procedure :: clear => contacts_clear
      procedure :: release => contacts_release
      procedure :: keep => contacts_keep
      procedure :: get => contacts_get
      procedure :: take => contacts_take
      procedure :: n_acting => contacts_n_acting
      procedure :: stray => contacts_stray
      procedure :: status => contacts_status
   end type contact_state_t

   !> What schemes look back on.
   type :: past_t
      logical :: has_past = .false.              !! the rest is known
      real(wp) :: h_before = 0.0_wp              !! size of the last step; 0: there is none [T]
      real(wp), allocatable :: load(:, :)        !! (n_dim, n_node) external forces
      real(wp), allocatable :: past(:, :, :)     !! (n_dim, n_node, n_past) as the scheme has it
   end type past_t

   !> What explicit steps know.
   type :: explicit_state_t
      real(wp) :: critical_h = 0.0_wp            !! the critical step as last found; 0: not yet [T]
      integer :: critical_element = 0            !! the fastest one
      real(wp) :: budget = 0.0_wp                !! energy that there may be [M L^2/T^2]
   end type explicit_state_t

   type :: state_t
      type(clock_t) :: clock                     !! where in time
      type(contact_state_t) :: contacts          !! what acts, with which forces
      type(past_t) :: history                    !! of schemes that look back
      type(explicit_state_t) :: explicit         !! of explicit steps
      real(wp), allocatable :: u(:, :)           !! (n_dim, n_node) displacement [L]
      real(wp), allocatable :: v(:, :)           !! (n_dim, n_node) velocity [L/T]
      real(wp), allocatable :: u_start(:, :)     !! (n_dim, n_node) displacement at the step's start
      real(wp), allocatable :: contact(:, :)     !! (n_dim, n_node) nodal contact forces
      !> (n_dim, n_node) friction in them; without friction of no nodes
      real(wp), allocatable :: friction(:, :)
      type(pair_record_t) :: pairs               !! what each contact pair transmits
      type(pair_sums_t) :: sums                  !! and has transmitted so far
      real(wp), allocatable :: reaction(:, :)    !! (n_dim, n_node) forces at prescribed freedoms
      type(rigid_rotation_t) :: turns            !! angles and moments of rigid bodies
      real(wp), allocatable :: internal(:, :)    !! (n_dim, n_node) internal forces
      real(wp), allocatable :: energy(:)         !! (n_element) strain energy
      real(wp) :: potential = 0.0_wp             !! energy of the given forces
      type(factor_base_t) :: base                !! of the factor that is kept over steps
      type(step_control_t) :: control            !! of the size of increments
   end type state_t

contains

   !> `n` constraints, of which none acts.
   pure subroutine contacts_begin(self, n)
      class(contact_state_t), intent(inout) :: self
      integer, intent(in) :: n                   !! constraints

      allocate(self%is_active(n), source=.false.)
      allocate(self%lam(n), self%closure(n), self%stretch(most_slips, n), source=0.0_wp)
   end subroutine contacts_begin

   !> Nothing acts, stores or rubs any more.
   pure subroutine contacts_clear(self)
      class(contact_state_t), intent(inout) :: self

      self%is_active = .false.
      self%lam = 0.0_wp
      self%closure = 0.0_wp
      self%stretch = 0.0_wp
      self%slides_along = 0.0_wp
      self%drag = 0.0_wp
   end subroutine contacts_clear

   !> The same of constraints `first` to `last` alone.
   pure subroutine contacts_release(self, first, last)
      class(contact_state_t), intent(inout) :: self
      integer, intent(in) :: first, last         !! numbers of constraints

      self%is_active(first:last) = .false.
      self%lam(first:last) = 0.0_wp
      self%closure(first:last) = 0.0_wp
      self%stretch(:, first:last) = 0.0_wp
      if (size(self%slides_along) == 0) return
      self%slides_along(:, first:last) = 0.0_wp
      self%drag(:, first:last) = 0.0_wp
   end subroutine contacts_release

   !> What constraint `id` ends a step with.
   pure subroutine contacts_keep(self, id, lam, acts)
      class(contact_state_t), intent(inout) :: self
      integer, intent(in) :: id                  !! 1 to n_constraint
      real(wp), intent(in) :: lam                !! its multiplier [M L/T^2]
      logical, intent(in) :: acts                !! it is closed

      self%lam(id) = lam
      self%is_active(id) = acts
   end subroutine contacts_keep

   !> What acts, with which multipliers, from constraint `first` on.
   pure subroutine contacts_get(self, first, lam, acts)
      class(contact_state_t), intent(in) :: self
      integer, intent(in) :: first               !! from 1
      real(wp), allocatable, intent(out) :: lam(:)       !! [M L/T^2]
      logical, allocatable, intent(out) :: acts(:)       !! as long

      lam = self%lam(first:)
      acts = self%is_active(first:)
   end subroutine contacts_get

   !> What acts, with which multipliers, in place of what did, as far as given.
   pure subroutine contacts_take(self, lam, acts)
      class(contact_state_t), intent(inout) :: self
      real(wp), intent(in), optional :: lam(:)   !! (n_constraint) [M L/T^2]
      logical, intent(in), optional :: acts(:)   !! (n_constraint)

      if (present(acts)) self%is_active = acts
      if (present(lam)) self%lam = lam
   end subroutine contacts_take

   !> How many of the constraints `first` to `last` act.
   pure integer function contacts_n_acting(self, first, last) result(n)
      class(contact_state_t), intent(in) :: self
      integer, intent(in) :: first, last         !! numbers of constraints

      n = count(self%is_active(first:last))
   end function contacts_n_acting

   !> The first constraint with a multiplier that does not act; 0: none.
   pure integer function contacts_stray(self, lam) result(id)
      class(contact_state_t), intent(in) :: self
      real(wp), intent(in) :: lam(:)             !! (n_constraint) [M L/T^2]

      id = findloc(abs(lam) > 0.0_wp .and. .not. self%is_active, .true., 1)
   end function contacts_stray

   !> 0: constraint `id` does not act, 1: it does, and nothing slides, 2: it slides.
   elemental integer function contacts_status(self, id) result(status)
      class(contact_state_t), intent(in) :: self
      integer, intent(in) :: id                  !! 1 to n_constraint

      status = merge(1, 0, self%is_active(id))
      if (status == 0 .or. .not. allocated(self%slides_along)) return
      if (size(self%slides_along) == 0) return
      if (any(abs(self%slides_along(:, id)) > 0.0_wp)) status = 2
   end function contacts_status

end module emcon_state
