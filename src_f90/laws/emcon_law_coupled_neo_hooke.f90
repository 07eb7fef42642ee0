! build: lanes
!> Coupled neo-Hookean law: W = mu/2 (tr C - 3) - mu ln J + lam/2 (ln J)^2.
module emcon_law_coupled_neo_hooke
   use emcon_dgrad_near, only : dg_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_hold_one, law_respond_one, law_t, n_lane, take_elastic
   implicit none
   private
   public :: law_coupled_neo_hooke_t

   type, extends(law_t) :: law_coupled_neo_hooke_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
   contains
      procedure :: take => coupled_neo_hooke_take
      procedure :: energy
      procedure :: respond
      procedure :: hold
      procedure :: divide
      procedure :: volume
   end type law_coupled_neo_hooke_t

   logical, parameter :: is_near = .true.
   include "../dgrad/emcon_dgrad_operators.inc"

contains

   pure subroutine coupled_neo_hooke_take(self, constant, fault)
      class(law_coupled_neo_hooke_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! E, nu
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      call take_elastic(constant, self%lam, self%mu, fault)
      self%shear = self%mu
   end subroutine coupled_neo_hooke_take

   !> For strains of any size: emcon_law_coupled_neo_hooke.inc.
   pure function energy(self, e1, e2, e3) result(w)
      use emcon_dgrad3, only : dg_t, dg_excess, dg_log1p, operator(*), operator(-), operator(+)
      use emcon_invariants, only : volume_excess
      class(law_coupled_neo_hooke_t), intent(in) :: self
      include "emcon_law_coupled_neo_hooke.inc"
   end function energy

   !> The same in numbers for loops over points.
   pure function energy_near(self, e1, e2, e3) result(w)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      include "emcon_law_coupled_neo_hooke.inc"
   end function energy_near

   pure subroutine respond(self, points, with_tangent)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      include "emcon_law_lanes.inc"
   end subroutine respond

   pure subroutine hold(self, points)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      include "emcon_law_held.inc"
   end subroutine hold

   !> As `law_t` has it.
   subroutine divide(self, rest)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      class(law_t), allocatable, intent(out) :: rest

      allocate(rest, source=self)
      select type (rest)
      class is (law_coupled_neo_hooke_t)
         rest%lam = 0.0_wp
      end select
   end subroutine divide

   !> lam/2 ln^2 J by the mean of J; what stays has no stress at rest and little more stiffness
   !> against a change of volume than mu.
   pure function volume(self, v) result(u)
      use emcon_dgrad3, only : dg_log1p, dg_t, operator(*)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      type(dg_t), intent(in) :: v                !! J - 1 or its mean
      type(dg_t) :: u, logarithm                 !! [M/(L T^2)]

      logarithm = dg_log1p(v)
      u = (0.5_wp*self%lam)*(logarithm*logarithm)
   end function volume

   include "../dgrad/emcon_dgrad_rules.inc"
   include "../dgrad/emcon_dgrad_near.inc"
   include "emcon_law_rules.inc"
   include "emcon_law_plane.inc"

end module emcon_law_coupled_neo_hooke
