! build: streams
!> What a term is: whatever has forces over a motion, with their sizes, an energy and a tangent.
!>
!> The residual of a step is s M (b du - w v0) + f_int - f_ext, docs/theory.md, eqs. (2) and (16).
!> Each term adds to one of these three; who solves a step knows their sums only.
module emcon_term
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_space, only : lists_t, space_t
   use emcon_vectors, only : vector_zero
   implicit none
   private
   public :: term_t, term_box_t, forces_t, response_t, response_init, response_begin
   public :: role_inertia, role_internal, role_external, fastest_t

   !> Which of the three sums a term adds to.
   integer, parameter :: role_inertia = 1, role_internal = 2, role_external = 3

   type :: forces_t
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) [M L/T^2]
      real(wp), allocatable :: magnitude(:, :)   !! (n_dim, n_node) sum of |contributions|
   end type forces_t

   !> What all terms give over one motion.
   type :: response_t
      integer :: n_thread = 1                    !! that may work on it, to the same bits
      type(forces_t) :: part(3)                  !! by role
      !> Terms add to the sizes, `magnitude` and `rounding`; else these stay what they were found to
      !> be before
      logical :: with_sizes = .true.
      real(wp), allocatable :: rounding(:, :)    !! (n_dim, n_node) times epsilon: round-off
      real(wp), allocatable :: residual(:, :)    !! (n_dim, n_node) without constraint forces
      real(wp), allocatable :: magnitude(:, :)   !! (n_dim, n_node) sum of |contributions| to it
      !> (n_element) strain energy at the end; that of some terms comes by `find_energy` alone
      real(wp), allocatable :: energy(:)
      real(wp) :: potential = 0.0_wp             !! other energies at the end [M L^2/T^2]
      !> Why there are no forces: what "the displacements" did to what. Not allocated: there are
      character(len=:), allocatable :: refusal
      type(error_t), allocatable :: failure      !! with which a term ends the analysis
   end type response_t

   type, abstract :: term_t
      integer :: role = role_internal            !! one of `role_`
      !> (n_node) its forces may hold the body of a node, and do not come with mass of their own;
      !> not allocated: nowhere
      logical, allocatable :: may_hold(:)
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: renew
      procedure(respond_interface), deferred :: respond
      procedure :: find_energy
      procedure :: tangent_times
      procedure :: add_stiffness
      procedure :: is_symmetric
      procedure :: find_fastest
   end type term_t

   !> The element of the highest frequency.
   type :: fastest_t
      integer :: element = 0                     !! 0: none has one
      real(wp) :: square = 0.0_wp                !! of the frequency, an upper bound [1/T^2]
   end type fastest_t

   type :: term_box_t
      class(term_t), allocatable :: term
   end type term_box_t

   abstract interface

      !> Add the forces of a motion, their sizes and energy to `response`, and, if they are there,
      !> the derivatives by the end of the step to the matrix. Where there are none, `refusal` or
      !> `failure` says why.
      subroutine respond_interface(self, motion, response, value, side)
         import :: dp, motion_t, response_t, term_t
         class(term_t), intent(inout) :: self
         type(motion_t), intent(in) :: motion                     !! placed
         type(response_t), intent(inout) :: response
         !> Entries of the matrix: those with slots > 0, those with slots < 0
         real(dp), intent(inout), contiguous, optional :: value(:), side(:)
      end subroutine respond_interface

   end interface

contains

   !> Append the lists of freedoms that meet in this term; a freedom that meets none but itself
   !> stands alone. None unless overridden.
   pure subroutine lay_out(self, lists)
      class(term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
   end subroutine lay_out

   !> Set up for step `i_step` of the deck; `slot` are the places of the lists that `lay_out`
   !> appended, entry by entry as `csr_from_elements` has them. To be overridden.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix          !! its pattern
      integer, intent(in) :: slot(:)             !! as `reduction_slot` gives them
   end subroutine begin_step

   !> Values of step `i_step` have changed, nothing else. To be overridden by what keeps them.
   subroutine renew(self, scene, i_step)
      class(term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
   end subroutine renew

   !> Energies of elements at the end of a motion, of a term whose `respond` leaves them out. None
   !> unless overridden.
   pure subroutine find_energy(self, motion, energy)
      class(term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed
      real(wp), intent(inout) :: energy(:)       !! (n_element) [M L^2/T^2]
   end subroutine find_energy

   !> Add the tangent of a motion times `direction` to `product`, to first order in what a
   !> prescribed motion does. Nothing unless overridden.
   subroutine tangent_times(self, motion, direction, product)
      class(term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
   end subroutine tangent_times

   !> Add the force that a displacement of one node causes before anything cancels. Nothing unless
   !> overridden.
   pure subroutine add_stiffness(self, stiffness)
      class(term_t), intent(in) :: self
      real(wp), intent(inout) :: stiffness(:)    !! (n_node) [M/T^2]
   end subroutine add_stiffness

   !> Is the tangent of a motion symmetric, up to round-off?
   pure logical function is_symmetric(self, motion)
      class(term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = .true.
   end function is_symmetric

   !> Take over the element with the highest frequency at the end of a motion, its mass at its
   !> nodes. `is_bounded` becomes false if the term has a tangent and knows no elements. Nothing
   !> unless overridden.
   subroutine find_fastest(self, motion, fastest, is_bounded)
      class(term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed at its end
      type(fastest_t), intent(inout) :: fastest
      logical, intent(inout) :: is_bounded       !! by elements
   end subroutine find_fastest

   !> Room for the forces of all terms.
   pure subroutine response_init(self, n_dim, n_node, n_element)
      type(response_t), intent(out) :: self
      integer, intent(in) :: n_dim               !! > 0
      integer, intent(in) :: n_node              !! >= 0
      integer, intent(in) :: n_element           !! >= 0
      integer :: k

      do k = 1, size(self%part)
         allocate(self%part(k)%force(n_dim, n_node), source=0.0_wp)
         allocate(self%part(k)%magnitude(n_dim, n_node), source=0.0_wp)
      end do
      allocate(self%rounding(n_dim, n_node), self%residual(n_dim, n_node), &
         self%magnitude(n_dim, n_node), source=0.0_wp)
      allocate(self%energy(n_element), source=0.0_wp)
   end subroutine response_init

   !> No term has given anything yet.
   pure subroutine response_begin(self, with_sizes)
      type(response_t), intent(inout) :: self
      logical, intent(in), optional :: with_sizes   !! else the sizes stay; .true.
      integer :: k

      self%with_sizes = .true.
      if (present(with_sizes)) self%with_sizes = with_sizes
      do k = 1, size(self%part)
         call vector_zero(size(self%rounding), self%part(k)%force)
         if (self%with_sizes) call vector_zero(size(self%rounding), self%part(k)%magnitude)
      end do
      if (self%with_sizes) call vector_zero(size(self%rounding), self%rounding)
      self%potential = 0.0_wp
      if (allocated(self%refusal)) deallocate(self%refusal)
      if (allocated(self%failure)) deallocate(self%failure)
   end subroutine response_begin

end module emcon_term
