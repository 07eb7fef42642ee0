!> What a time stepping scheme is: where in a step it evaluates forces, and how inertia enters; the
!> velocity at the end follows from that (`evaluation_velocity`). The residual, Newton's method and
!> the step loop serve all schemes.
module emcon_scheme
   use emcon_evaluation, only : instant_t, evaluation_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: scheme_t, scheme_row_t, setting_t

   !> The number of a scheme that decks may give.
   type :: setting_t
      character(len=16) :: word = ""             !! of decks; "": there is none
      real(wp) :: value = 0.0_wp
   end type setting_t

   !> What is known of a scheme before there is one: decks are read by it.
   type :: scheme_row_t
      integer :: code = 0                        !! one of `scheme_`; 0: none
      character(len=8) :: card = ""              !! that asks for it
      character(len=20) :: word = ""             !! SCHEME= in decks; "": the only one of its card
      character(len=24) :: text = ""             !! in the log; "": the name by which it is given
      logical :: has_inertia = .false.           !! there are velocities, and pushing makes energy
      logical :: loads_ramp = .false.            !! without amplitude they run over the step
      logical :: takes_jumps = .true.            !! velocities may jump where a step ends
      logical :: takes_massless = .true.         !! nodes may be without mass
      logical :: dissipates = .false.            !! elements take energy
      logical :: takes_damping = .true.          !! materials may be damped
      !> It asks for the forces at the start of a step, and for the size of the step before
      logical :: looks_back = .false.
      logical :: is_accelerated = .false.        !! the past is the acceleration
      integer :: n_past = 0                      !! fields that are kept of the steps before
      type(setting_t) :: setting
      logical :: is_explicit = .false.           !! forces are those at the start
      logical :: lumps_mass = .false.            !! which is then the matrix of a step, alone
   end type scheme_row_t

   type, abstract :: scheme_t
      type(scheme_row_t) :: row
   contains
      procedure(pose_interface), deferred :: evaluation
      procedure :: keeps_energy
      procedure :: carry
      procedure :: error_constant
   end type scheme_t

   abstract interface

      !> Evaluation of a step of size `h` from `start`.
      pure function pose_interface(self, start, h) result(evaluation)
         import :: instant_t, evaluation_t, scheme_t, wp
         class(scheme_t), intent(in) :: self
         type(instant_t), intent(in) :: start
         real(wp), intent(in) :: h               !! > 0 [T]
         type(evaluation_t) :: evaluation
      end function pose_interface

   end interface

contains

   !> What is kept of a step of size `h` by `du`, in which velocities went from `v0` to `v1`; `past`
   !> is that of the steps before. Nothing unless overridden.
   pure subroutine carry(self, h, du, v0, v1, past)
      class(scheme_t), intent(in) :: self
      real(wp), intent(in) :: h                              !! > 0 [T]
      real(wp), intent(in), contiguous :: du(:, :)           !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: v0(:, :), v1(:, :) !! (n_dim, n_node) [L/T]
      real(wp), intent(inout), contiguous :: past(:, :, :)   !! (n_dim, n_node, n_past)
   end subroutine carry

   !> Is the energy balance of a step exact? If not, what it is off by is shown, not judged.
   pure logical function keeps_energy(self)
      class(scheme_t), intent(in) :: self

      keeps_energy = .false.
   end function keeps_energy

   !> C of the error C h^3 u''' that a step leaves in the displacement; 0: it is not known, and
   !> increments cannot follow it.
   pure real(wp) function error_constant(self)
      class(scheme_t), intent(in) :: self

      error_constant = 0.0_wp
   end function error_constant

end module emcon_scheme
