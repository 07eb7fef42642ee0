!> What a constitutive law is: strain energy as a function of the invariants of the strain.
!>
!> E is the Green-Lagrange strain (small strain without NLGEOM). A law gives W(e1, e2, e3) with
!> e1 = tr E, e2 = (tr^2 E - tr E^2)/2, e3 = det E, in discrete-gradient arithmetic; stress and
!> tangent follow here for all laws. In terms of E nothing cancels at small strains, as
!> det C - 1 = 2 e1 + 4 e2 + 8 e3. Source: docs/theory.md, eq. (7).
module emcon_law
   use emcon_dgrad3, only : dg_sqrt, dg_t, dg_variable, operator(*), operator(+), &
      operator(/)
   use emcon_invariants, only : isochoric_excess, volume_energy, volume_excess
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: law_t, law_volumetric_t, law_box_t, law_points_t, law_response_t, n_lane
   public :: law_response_plane, law_respond_one, law_hold_one, volume_excess
   public :: change_points_t, law_change_points, max_part
   public :: law_slopes_t, law_find_slopes_one, n_invariant
   public :: claim, isochoric_excess, lame_constants, take_elastic, volume_energy

   !> Points that are computed side by side. No lane knows of another: the bits of a point depend
   !> neither on its place nor on how many lanes the machine takes at a time.
   integer, parameter :: n_lane = 8
   !> A law leaves out what resists a change of volume by making it so many powers of two smaller,
   !> below all round-off: loops over points would divide by a D of 0 before they look.
   integer, parameter :: no_volume = digits(1.0_wp) + 7
   integer, parameter :: max_part = 3
   integer, parameter :: n_invariant = 3

   type, abstract :: law_t
      real(wp) :: density = 0.0_wp               !! [M/L^3]
      real(wp) :: shear = 0.0_wp                 !! shear modulus at rest [M/(L T^2)]
      logical :: has_volume = .true.             !! W is infinite where det C = 0
      !> Parts of W that are of sums over principal stretches, 0: none. Then `energy` is that of
      !> E33 = E13 = E23 = 0 alone, and W in space is the sum of `part`.
      integer :: n_part = 0
      real(wp) :: exponent(max_part) = 1.0_wp    !! (:n_part) of the stretches
      !> (6, 6) of components 11, 22, 33, 12, 23, 13: W in space is 1/2 E.C E, and `energy` that of
      !> an isotropic law near it; not allocated: W is of invariants [M/(L T^2)]
      real(wp), allocatable :: moduli(:, :)
   contains
      procedure(take_interface), deferred :: take
      procedure(energy_interface), deferred :: energy
      procedure :: respond => law_respond
      procedure :: hold => law_hold
      procedure :: find_slopes => law_find_slopes
      procedure :: divide => law_divide
      procedure :: change => law_change
      procedure :: volume => law_volume
      procedure :: part => law_part
   end type law_t

   !> A law that resists a change of volume by the sum of (J - 1)^(2 i)/D_i; a D_i of 0 has no term.
   type, abstract, extends(law_t) :: law_volumetric_t
      real(wp) :: d(max_part) = 0.0_wp           !! [L T^2/M]; the first > 0
   contains
      procedure :: divide => volumetric_divide
      procedure :: volume => volumetric_volume
   end type law_volumetric_t

   !> For arrays of laws of different types.
   type :: law_box_t
      class(law_t), allocatable :: law
   end type law_box_t

   abstract interface
      !> Take the constants as a deck gives them, `shear` with them, or say what is wrong with one.
      pure subroutine take_interface(self, constant, fault)
         import :: law_t, wp
         class(law_t), intent(inout) :: self
         real(wp), intent(in) :: constant(:)     !! as many as the law's row has names
         character(len=:), allocatable, intent(out) :: fault   !! empty: nothing
      end subroutine take_interface

      !> Strain energy per reference volume.
      pure function energy_interface(self, e1, e2, e3) result(w)
         import :: dg_t, law_t
         class(law_t), intent(in) :: self
         type(dg_t), intent(in) :: e1, e2, e3    !! invariants of E
         type(dg_t) :: w                         !! [M/(L T^2)]
      end function energy_interface
   end interface

   !> Stress and tangent of a step in the plane; components 11, 22, 12 (strain: 2 E12).
   type :: law_response_t
      real(wp) :: energy = 0.0_wp                !! W at the end
      real(wp) :: stress(3) = 0.0_wp             !! S_alg: S_alg.(E1 - E0) = W1 - W0
      real(wp) :: stress_33 = 0.0_wp             !! normal to the plane; meaningful for E1 = E0
      real(wp) :: tangent(3, 3) = 0.0_wp         !! derivative of S_alg by E1
   end type law_response_t

   !> The same for points side by side.
   type :: law_points_t
      real(wp) :: strain(n_lane, 3) = 0.0_wp     !! at the start: E11, E22, 2 E12
      real(wp) :: dstrain(n_lane, 3) = 0.0_wp
      real(wp) :: energy(n_lane) = 0.0_wp
      real(wp) :: stress(n_lane, 3) = 0.0_wp
      real(wp) :: stress_33(n_lane) = 0.0_wp     !! set by `hold`
      real(wp) :: stretch_33(n_lane) = 1.0_wp    !! normal to the plane, set by `hold` of sheets
      real(wp) :: tangent(n_lane, 3, 3) = 0.0_wp
   end type law_points_t

   !> A function of the invariants of the strain, W or the change of volume, at points side by side.
   type :: law_slopes_t
      real(wp) :: start(n_lane, n_invariant) = 0.0_wp    !! the invariants at the start
      real(wp) :: by(n_lane, n_invariant) = 0.0_wp       !! their increments
      real(wp) :: value(n_lane) = 0.0_wp         !! at the end
      real(wp) :: slope(n_lane, n_invariant) = 0.0_wp    !! discrete gradient
      !> Derivative of `slope` (second index) by the invariants at the end (third).
      real(wp) :: second(n_lane, n_invariant, n_invariant) = 0.0_wp
   end type law_slopes_t

   !> Change of volume v of points side by side: `energy` is v at the end, `stress` its discrete
   !> gradient, `tangent` the derivative of that.
   type, extends(law_points_t) :: change_points_t
      real(wp) :: start(n_lane) = 0.0_wp         !! v at the start
      real(wp) :: by(n_lane) = 0.0_wp            !! its increment, to relative accuracy
      real(wp) :: at_end(n_lane, 3) = 0.0_wp     !! gradient at the end
   end type change_points_t

contains

   !> Response to a strain that goes from `strain` to `strain + dstrain` in plane strain:
   !> docs/theory.md, eqs. (9) and (10).
   pure subroutine law_response_plane(law, strain, dstrain, response)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(3), dstrain(3)   !! E11, E22, 2 E12
      type(law_response_t), intent(out) :: response
      type(law_points_t) :: points
      type(dg_t) :: e1, e2, e3, w

      points%strain(1, :) = strain
      points%dstrain(1, :) = dstrain
      call plane_invariants(points, 1, e1, e2)
      e3 = dg_variable(3, 0.0_wp, 0.0_wp)
      w = law%energy(e1, e2, e3)
      call plane_stress(w, 1, points)
      call plane_tangent(w, 1, points)
      response%energy = points%energy(1)
      response%stress = points%stress(1, :)
      response%stress_33 = plane_normal(w, w%g(3), e1, e2)
      response%tangent = points%tangent(1, :, :)
   end subroutine law_response_plane

   !> Response of points side by side, one after the other. A law that can take several at a time
   !> overrides this, as emcon_law_neo_hooke does: the same to round-off.
   pure subroutine law_respond(self, points, with_tangent)
      class(law_t), intent(in) :: self
      type(law_points_t), intent(inout) :: points
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      integer :: l

      do l = 1, n_lane
         call law_respond_one(self, l, with_tangent, points)
      end do
   end subroutine law_respond

   !> Response of the point in lane `l`, whatever its strain.
   pure subroutine law_respond_one(law, l, with_tangent, points)
      class(law_t), intent(in) :: law
      integer, intent(in) :: l                   !! 1..n_lane
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(law_points_t), intent(inout) :: points
      type(dg_t) :: e1, e2, w

      call plane_invariants(points, l, e1, e2)
      w = law%energy(e1, e2, dg_variable(3, 0.0_wp, 0.0_wp))
      call plane_stress(w, l, points)
      if (with_tangent) call plane_tangent(w, l, points)
   end subroutine law_respond_one

   !> Stress of points side by side that do not move, with that normal to the plane. Overridden like
   !> `respond`, by emcon_law_held.inc.
   pure subroutine law_hold(self, points)
      class(law_t), intent(in) :: self
      type(law_points_t), intent(inout) :: points    !! `dstrain` is 0
      integer :: l

      do l = 1, n_lane
         call law_hold_one(self, l, points)
      end do
   end subroutine law_hold

   !> The same of the point in lane `l`.
   pure subroutine law_hold_one(law, l, points)
      class(law_t), intent(in) :: law
      integer, intent(in) :: l                   !! 1..n_lane
      type(law_points_t), intent(inout) :: points
      type(law_response_t) :: response

      call law_response_plane(law, points%strain(l, :), points%dstrain(l, :), response)
      points%stress(l, :) = response%stress
      points%stress_33(l) = response%stress_33
   end subroutine law_hold_one

   !> W by the invariants of points side by side, one after the other. Overridden like `respond`, by
   !> emcon_law_slopes_space.inc.
   pure subroutine law_find_slopes(self, points, with_second)
      class(law_t), intent(in) :: self
      type(law_slopes_t), intent(inout) :: points      !! all but the invariants is set
      logical, intent(in) :: with_second         !! else `second` stays as it is
      integer :: l

      do l = 1, n_lane
         call law_find_slopes_one(self, l, with_second, points)
      end do
   end subroutine law_find_slopes

   !> The same of the point in lane `l`, whatever its strain.
   pure subroutine law_find_slopes_one(law, l, with_second, points)
      class(law_t), intent(in) :: law
      integer, intent(in) :: l                   !! 1..n_lane
      logical, intent(in) :: with_second         !! else `second` stays as it is
      type(law_slopes_t), intent(inout) :: points      !! lane `l` is set, but for the invariants
      integer, parameter :: first = 1, second = 2, third = n_invariant
      type(dg_t) :: e(n_invariant), w
      integer :: k

      do k = 1, n_invariant
         e(k) = dg_variable(k, points%start(l, k), points%by(l, k))
      end do
      w = law%energy(e(first), e(second), e(third))
      points%value(l) = w%f1
      points%slope(l, :) = w%g
      if (with_second) points%second(l, :, :) = w%h
   end subroutine law_find_slopes_one

   !> The law without what resists a change of volume: W = rest + U(v). Here: that W has no such
   !> parts.
   subroutine law_divide(self, rest)
      class(law_t), intent(in) :: self
      class(law_t), allocatable, intent(out) :: rest   !! not allocated: the law has no parts
   end subroutine law_divide

   !> The change of volume v that U is of: J - 1.
   pure function law_change(self, e1, e2, e3) result(v)
      class(law_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3       !! invariants of E
      type(dg_t) :: v, y

      y = volume_excess(e1, e2, e3)
      v = y/(dg_sqrt(y + 1.0_wp) + 1.0_wp)
   end function law_change

   !> U(v), of a law that `divide` divides.
   pure function law_volume(self, v) result(u)
      class(law_t), intent(in) :: self
      type(dg_t), intent(in) :: v                !! change of volume, `change` or its mean
      type(dg_t) :: u                            !! [M/(L T^2)]

      u = dg_t()
   end function law_volume

   !> Part `i` of W in space, of a law that has such parts, by the change of volume and
   !> t = sum of l^a - 1 - a ln l over the principal stretches, a = `exponent(i)`.
   pure function law_part(self, i, y, t) result(w)
      class(law_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_part
      type(dg_t), intent(in) :: y                !! J^2 - 1
      type(dg_t), intent(in) :: t                !! of second order at small strains
      type(dg_t) :: w                            !! [M/(L T^2)]

      w = dg_t()
   end function law_part

   !> Below all round-off is what is left of the change of volume.
   subroutine volumetric_divide(self, rest)
      class(law_volumetric_t), intent(in) :: self
      class(law_t), allocatable, intent(out) :: rest

      allocate(rest, source=self)
      select type (rest)
      class is (law_volumetric_t)
         rest%d = scale(rest%d, no_volume)
      end select
   end subroutine volumetric_divide

   !> By the mean of J - 1.
   pure function volumetric_volume(self, v) result(u)
      class(law_volumetric_t), intent(in) :: self
      type(dg_t), intent(in) :: v                !! change of volume
      type(dg_t) :: u                            !! [M/(L T^2)]

      u = volume_energy(self%d, v*(v + 2.0_wp))
   end function volumetric_volume

   !> The change of volume of points in plane strain, with its gradients.
   pure subroutine law_change_points(law, with_tangent, points)
      class(law_t), intent(in) :: law
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(change_points_t), intent(inout) :: points   !! all but the strains is set
      type(dg_t) :: e1, e2, v
      integer :: l

      do l = 1, n_lane
         call plane_invariants(points%law_points_t, l, e1, e2)
         v = law%change(e1, e2, dg_variable(3, 0.0_wp, 0.0_wp))
         points%start(l) = v%f0
         points%by(l) = v%df
         call plane_stress(v, l, points%law_points_t)
         points%stress_33(l) = plane_normal(v, v%g(3), e1, e2)
         points%at_end(l, :) = plane_slope(v, points%strain(l, :) + points%dstrain(l, :))
         if (with_tangent) call plane_tangent(v, l, points%law_points_t)
      end do
   end subroutine law_change_points

   include "emcon_law_plane.inc"

   !> Lame's constants from Young's modulus and Poisson's ratio.
   pure subroutine lame_constants(young, nu, lam, mu)
      real(wp), intent(in) :: young, nu          !! E > 0; nu in (-1, 0.5)
      real(wp), intent(out) :: lam, mu           !! [M/(L T^2)]

      lam = young*nu/((1.0_wp + nu)*(1.0_wp - 2.0_wp*nu))
      mu = 0.5_wp*young/(1.0_wp + nu)
   end subroutine lame_constants

   !> Lame's constants of the two that decks give, or what is wrong with these.
   pure subroutine take_elastic(constant, lam, mu, fault)
      real(wp), intent(in) :: constant(:)        !! E, nu
      real(wp), intent(out) :: lam, mu           !! [M/(L T^2)]
      character(len=:), allocatable, intent(out) :: fault   !! empty: nothing

      lam = 0.0_wp
      mu = 0.0_wp
      associate (young => constant(1), nu => constant(2))
         call claim(young > 0.0_wp, "E", young, "must be positive", fault)
         call claim(nu < 0.5_wp .or. nu > 0.5_wp, "nu", nu, "must lie between -1 and 0.5; what " &
            // "is incompressible is computed with 0.49 to 0.4999 and C3D8H, CPE4H or elements " &
            // "with nodes between corners", fault)
         call claim(nu > -1.0_wp .and. nu < 0.5_wp, "nu", nu, "must lie between -1 and 0.5", fault)
         if (fault == "") call lame_constants(young, nu, lam, mu)
      end associate
   end subroutine take_elastic

   !> Note in `fault` that the constant `name` is not what the `rule` says; the first one stays.
   pure subroutine claim(holds, name, value, rule, fault)
      logical, intent(in) :: holds               !! does the constant follow the rule?
      character(len=*), intent(in) :: name       !! of the constant
      real(wp), intent(in) :: value              !! of the constant
      character(len=*), intent(in) :: rule       !! "must ..."
      character(len=:), allocatable, intent(inout) :: fault   !! empty: nothing so far

      if (.not. allocated(fault)) fault = ""
      if (.not. holds .and. fault == "") fault = name // " = " // to_text(value) // " " // rule
   end subroutine claim

end module emcon_law
