!> Forces between nodes that come from outside: of a potential, or of a host code that has its own
!> solid.
!>
!> What is given is the discrete gradient of an energy, so the scheme keeps it as it keeps the
!> strain energy. Source: docs/theory.md, section 11.
module emcon_host_force
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   use emcon_point_function, only : host_failed => point_failed, host_ok => point_ok, &
      host_outside => point_outside
   implicit none
   private
   public :: host_force_t, host_force_box_t, force_response_t
   !> How a response ended. Outside: there is none at these displacements, as for an inverted
   !> element; the step is cut. Failed: there is no use in going on.
   public :: host_ok, host_outside, host_failed

   !> What a given force is over a motion.
   type :: force_response_t
      real(wp), allocatable :: force(:, :)       !! (2, n_node) [M L/T^2]
      !> (2, n_node) sums of |contributions| to `force`; left at 0: not known
      real(wp), allocatable :: magnitude(:, :)
      real(wp) :: energy = 0.0_wp                !! E(u0 + du) [M L^2/T^2]
      !> Derivative of `force` by u0 + du, in the slots of `pattern`. Where du = 0, half of the
      !> second derivatives of E
      real(dp), allocatable :: tangent(:)
      integer :: status = host_ok               !! one of the `given_` codes
   end type force_response_t

   type, abstract :: host_force_t
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
   end type host_force_t

   abstract interface
      !> Forces of a motion from `u0` to `u0 + du`: a discrete gradient of the energy E, with
      !> force.du = E(u0 + du) - E(u0); where du = 0, the gradient of E.
      subroutine respond_interface(self, u0, du, wants_tangent, response)
         import :: force_response_t, host_force_t, wp
         class(host_force_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: u0(:, :), du(:, :)   !! (2, n_node) [L]
         logical, intent(in) :: wants_tangent                     !! else leave `tangent` alone
         type(force_response_t), intent(inout) :: response        !! sized, 0 on entry
      end subroutine respond_interface
   end interface

   type :: host_force_box_t
      class(host_force_t), allocatable :: force
   end type host_force_box_t

contains

   !> Told once, before the first response: the reference positions `x` of the nodes, which ties and
   !> adjusted contact may have moved. To be overridden where they matter.
   subroutine place(self, x)
      class(host_force_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)        !! (2, n_node) [L]
   end subroutine place

end module emcon_host_force
