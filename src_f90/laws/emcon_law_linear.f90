! build: lanes
!> Linear elasticity: W = lam/2 (tr E)^2 + mu E:E. Under NLGEOM this is St. Venant-Kirchhoff.
module emcon_law_linear
   use emcon_dgrad_near, only : dg_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_hold_one, law_respond_one, law_t, n_lane, take_elastic
   implicit none
   private
   public :: law_linear_t

   type, extends(law_t) :: law_linear_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
      !> In plane stress E33 = -contraction e1, and W has the same form with another `lam`.
      logical :: is_thin = .false.
      real(wp) :: contraction = 0.0_wp
   contains
      procedure :: take => linear_take
      procedure :: energy
      procedure :: respond
      procedure :: hold => linear_hold
      procedure :: make_thin
      procedure :: divide
      procedure :: change
      procedure :: volume
   end type law_linear_t

   logical, parameter :: is_near = .true.
   include "../dgrad/emcon_dgrad_operators.inc"

contains

   pure subroutine linear_take(self, constant, fault)
      class(law_linear_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! E, nu
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      call take_elastic(constant, self%lam, self%mu, fault)
      self%shear = self%mu
      self%has_volume = .false.
   end subroutine linear_take

   !> For strains of any size: emcon_law_linear.inc.
   pure function energy(self, e1, e2, e3) result(w)
      use emcon_dgrad3, only : dg_t, operator(*), operator(-), operator(+)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_linear.inc"
   end function energy

   !> The same in numbers for loops over points.
   pure function energy_near(self, e1, e2, e3) result(w)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_linear.inc"
   end function energy_near

   pure subroutine respond(self, points, with_tangent)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_lanes.inc"
   end subroutine respond

   pure subroutine hold(self, points)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_held.inc"
   end subroutine hold

   !> In plane stress no stress is normal to the plane, and there is a stretch.
   pure subroutine linear_hold(self, points)
      class(law_linear_t), intent(in) :: self
      type(law_points_t), intent(inout) :: points    !! `dstrain` is 0

      call hold(self, points)
      if (.not. self%is_thin) return
      points%stress_33 = 0.0_wp
      ! tr E without the shear. Where it would leave no thickness there is a stress all the same.
      points%stretch_33 = sqrt(max(epsilon(1.0_wp), &
         1.0_wp - 2.0_wp*self%contraction*sum(points%strain(:, :size(points%strain, 2) - 1), 2)))
   end subroutine linear_hold

   !> Take the form of plane stress: docs/theory.md, behind eq. (10b).
   pure subroutine make_thin(self)
      class(law_linear_t), intent(inout) :: self

      self%contraction = self%lam/(self%lam + 2.0_wp*self%mu)
      self%lam = 2.0_wp*self%mu*self%contraction
      self%is_thin = .true.
   end subroutine make_thin

   !> As `law_t` has it.
   subroutine divide(self, rest)
      class(law_linear_t), intent(in) :: self
      class(law_t), allocatable, intent(out) :: rest

      allocate(rest, source=self)
      select type (rest)
      class is (law_linear_t)
         rest%lam = -2.0_wp/3.0_wp*self%mu
      end select
   end subroutine divide

   !> tr E, small or not: W is of E.
   pure function change(self, e1, e2, e3) result(v)
      use emcon_dgrad3, only : dg_t, operator(*), operator(+)
      class(law_linear_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3       !! invariants of E
      type(dg_t) :: v

      v = e1 + 0.0_wp*e2 + 0.0_wp*e3
   end function change

   !> K/2 v^2.
   pure function volume(self, v) result(u)
      use emcon_dgrad3, only : dg_t, operator(*)
      class(law_linear_t), intent(in) :: self
      type(dg_t), intent(in) :: v                !! tr E or its mean
      type(dg_t) :: u                            !! [M/(L T^2)]

      u = (0.5_wp*self%lam + self%mu/3.0_wp)*(v*v)
   end function volume

   include "../dgrad/emcon_dgrad_rules.inc"
   include "../dgrad/emcon_dgrad_near.inc"
   include "emcon_law_rules.inc"
   include "emcon_law_plane.inc"

end module emcon_law_linear
