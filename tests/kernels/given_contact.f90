!> Contact whose gaps are given: what the active set makes of them is seen without any surface.
module given_contact
   use emcon_active_set, only : active_set_init, active_set_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t
   use emcon_contact_law, only : contact_law_t, contact_laws_add
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_init, motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: given_contact_t, open_given_contact, given_of

   !> Constraint i is of node i alone, along y.
   type, extends(contact_t) :: given_contact_t
      type(gap_state_t), allocatable :: given(:)     !! (n_constraint) what is measured
      logical, allocatable :: is_seen(:)             !! (n_constraint) stencils still hold
      real(wp), allocatable :: slid(:)               !! (n_constraint) slip [L]
      real(wp) :: clear = 0.0_wp                     !! clearance of the next look [L]
   contains
      procedure :: configure
      procedure :: begin_points
      procedure :: measure_points
      procedure :: evaluate_points
      procedure :: area_points
      procedure :: covers_points
      procedure :: slip_points
      procedure :: could_hold
   end type given_contact_t

contains

   !> A system of contacts with the gaps `given`, the last `n_guard` of which are guards of the
   !> first ones, and its active set, at rest. With `law` that acts on all.
   subroutine open_given_contact(system, active, motion, given, n_guard, law)
      type(system_t), intent(out) :: system
      type(active_set_t), intent(out) :: active
      type(motion_t), intent(out) :: motion
      type(gap_state_t), intent(in) :: given(:, :)   !! (constraints of each contact, contacts)
      integer, intent(in) :: n_guard
      class(contact_law_t), intent(in), optional :: law
      type(given_contact_t) :: contact
      integer :: k, i, n

      n = size(given)
      if (present(law)) call contact_laws_add(contact%laws, law)
      allocate(system%permanent(0), system%term(0), system%acts(0))
      allocate(system%contact(size(given, 2)), system%first_constraint(size(given, 2) + 1))
      system%n_pair = size(given, 2) - n_guard
      system%n_constraint = n
      do k = 1, size(given, 2)
         system%first_constraint(k) = size(given, 1)*(k - 1)
         system%contact(k)%of_pair = merge(k, k - system%n_pair, k <= system%n_pair)
         contact%n_constraint = size(given, 1)
         contact%given = given(:, k)
         contact%state = given(:, k)
         contact%node = [(system%first_constraint(k) + i, i = 1, size(given, 1))]
         contact%duplicate = 0*contact%node
         contact%is_seen = contact%node > 0
         contact%slid = 0.0_wp*contact%node
         contact%slack = merge(0.0_wp, 0.1_wp, k <= system%n_pair)
         allocate(system%contact(k)%contact, source=contact)
      end do
      system%first_constraint(k) = n
      allocate(system%space%is_alive(2, n), source=.true.)
      allocate(system%response%magnitude(2, n), system%response%rounding(2, n), source=0.0_wp)
      call active_set_init(active, system)
      call motion_init(motion, reshape([(real(i, wp), i = 1, 2*n)], [2, n]))
   end subroutine open_given_contact

   !> Contact `k` of such a system.
   function given_of(system, k) result(given)
      type(system_t), intent(in), target :: system
      integer, intent(in) :: k
      class(given_contact_t), pointer :: given

      nullify(given)
      select type (contact => system%contact(k)%contact)
      class is (given_contact_t)
         given => contact
      end select
   end function given_of

   pure subroutine configure(self, x, options)
      class(given_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(contact_options_t), intent(in) :: options
   end subroutine configure

   pure subroutine begin_points(self, x, u0, du)
      class(given_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      call self%has_looked(self%clear)
   end subroutine begin_points

   pure subroutine measure_points(self, x, u0, du)
      class(given_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      self%state = self%given
   end subroutine measure_points

   pure subroutine evaluate_points(self, wanted, x, u0, du, target, item)
      class(given_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
   end subroutine evaluate_points

   pure subroutine area_points(self, x, u, area, length)
      class(given_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: area(:)
      real(wp), intent(out) :: length(:)

      area = 1.0_wp
      length = 1.0_wp
   end subroutine area_points

   pure logical function covers_points(self, i, x, u0, du) result(covers)
      class(given_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      covers = self%is_seen(i)
   end function covers_points

   pure function slip_points(self, i, x, u0, du) result(slip)
      class(given_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: slip(size(x, 1) - 1)

      slip = self%slid(i)
   end function slip_points

   !> By another choice all.
   pure logical function could_hold(self, is_loose)
      class(given_contact_t), intent(in) :: self
      logical, intent(in) :: is_loose(:)

      could_hold = any(is_loose)
   end function could_hold

end module given_contact
