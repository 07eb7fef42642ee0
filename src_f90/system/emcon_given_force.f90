!> Forces between nodes that come from outside: of a potential, or of a host code that has its own
!> solid.
!>
!> What is given is the discrete gradient of an energy, so the scheme keeps it as it keeps the
!> strain energy. Source: docs/theory.md, section 12.
module emcon_given_force
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   implicit none
   private
   public :: given_force_t, given_force_box_t, given_t, given_add_force, given_copy, &
      given_count
   public :: given_ok, given_outside, given_failed

   !> How a response ended. Outside: there is none at these displacements, as for an inverted
   !> element; the step is cut. Failed: there is no use in going on.
   integer, parameter :: given_ok = 0, given_outside = 1, given_failed = 2

   type, abstract :: given_force_t
      character(len=:), allocatable :: name      !! for messages
      !> (2 n_node x 2 n_node) which freedoms depend on which; freedom a of node i is 2(i - 1) + a.
      !> The values are not used.
      type(csr_t) :: pattern
      !> The tangent is symmetric: that of gradients at the end, that of steps. It costs less to
      !> solve then; one that is not must not be called so.
      logical :: is_symmetric_at_end = .false.
      logical :: is_symmetric_in_steps = .false.
      character(len=:), allocatable :: reason    !! `respond` may say why it failed
   contains
      procedure :: place
      procedure(respond_interface), deferred :: respond
   end type given_force_t

   abstract interface
      !> Forces of the step from `u0` to `u0 + du`: a discrete gradient of the energy E, with
      !> force.du = E(u0 + du) - E(u0); or (`is_end`) the gradient of E at u0 + du.
      subroutine respond_interface(self, u0, du, is_end, wants_tangent, force, magnitude, energy, &
         tangent, status)
         import :: given_force_t, dp, wp
         class(given_force_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: u0(:, :), du(:, :)       !! (2, n_node) [L]
         logical, intent(in) :: is_end
         logical, intent(in) :: wants_tangent                         !! else leave `tangent` alone
         real(wp), intent(inout), contiguous :: force(:, :)           !! (2, n_node) 0 on entry
         !> (2, n_node) sums of |contributions| to `force`; left at 0: not known
         real(wp), intent(inout), contiguous :: magnitude(:, :)
         real(wp), intent(out) :: energy                              !! E(u0 + du) [M L^2/T^2]
         !> Derivative of `force` by u0 + du, in the slots of `pattern`; 0 on entry
         real(dp), intent(inout), contiguous :: tangent(:)
         integer, intent(out) :: status                               !! one of the `given_` codes
      end subroutine respond_interface
   end interface

   type :: given_force_box_t
      class(given_force_t), allocatable :: force
   end type given_force_box_t

   !> All that a model is given: forces, and mass beside that of elements.
   type :: given_t
      type(given_force_box_t), allocatable :: force(:)
      type(csr_t) :: mass                        !! (n_node x n_node) [M]; without rows: none
   end type given_t

contains

   !> Told once, before the first response: the reference positions `x` of the nodes, which ties and
   !> adjusted contact may have moved. To be overridden where they matter.
   subroutine place(self, x)
      class(given_force_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)        !! (2, n_node) [L]
   end subroutine place

   !> Append a copy of `force`.
   subroutine given_add_force(self, force)
      type(given_t), intent(inout) :: self
      class(given_force_t), intent(in) :: force
      type(given_force_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%force)) n = size(self%force)
      allocate(longer(n + 1))
      do i = 1, n
         call move_alloc(self%force(i)%force, longer(i)%force)
      end do
      allocate(longer(n + 1)%force, source=force)
      call move_alloc(longer, self%force)
   end subroutine given_add_force

   !> Number of forces, and of masses.
   pure function given_count(self) result(n)
      type(given_t), intent(in) :: self
      integer :: n(2)

      n = [0, merge(1, 0, self%mass%n_row > 0)]
      if (allocated(self%force)) n(1) = size(self%force)
   end function given_count

   !> `copy` becomes independent of `self`.
   subroutine given_copy(self, copy)
      type(given_t), intent(in) :: self
      type(given_t), intent(out) :: copy
      integer :: i, n

      n = 0
      if (allocated(self%force)) n = size(self%force)
      allocate(copy%force(n))
      do i = 1, n
         allocate(copy%force(i)%force, source=self%force(i)%force)
      end do
      copy%mass = self%mass
   end subroutine given_copy

end module emcon_given_force
