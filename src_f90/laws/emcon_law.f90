!> What a constitutive law is: strain energy as a function of the invariants of the strain.
!>
!> E is the Green-Lagrange strain (small strain without NLGEOM). A law gives W(e1, e2, e3) with
!> e1 = tr E, e2 = (tr^2 E - tr E^2)/2, e3 = det E, in discrete-gradient arithmetic; stress and
!> tangent follow here for all laws. In terms of E nothing cancels at small strains, as
!> det C - 1 = 2 e1 + 4 e2 + 8 e3. Source: docs/theory.md, eq. (7).
module emcon_law
   use emcon_dgrad3, only : dg_excess, dg_log1p, dg_sqrt, dg_t, dg_variable, operator(+), &
      operator(*), operator(-), operator(/)
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: law_t, law_box_t, law_response_t, law_response_plane, volume_excess
   public :: claim, isochoric_excess, lame_constants, take_elastic, volume_energy

   type, abstract :: law_t
      real(wp) :: density = 0.0_wp               !! [M/L^3]
      real(wp) :: shear = 0.0_wp                 !! shear modulus at rest [M/(L T^2)]
      logical :: has_volume = .true.             !! W is infinite where det C = 0
   contains
      procedure(take_interface), deferred :: take
      procedure(energy_interface), deferred :: energy
   end type law_t

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

contains

   !> Response to a strain that goes from `strain` to `strain + dstrain` in plane strain:
   !> docs/theory.md, eqs. (9) and (10).
   pure subroutine law_response_plane(law, strain, dstrain, response)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(3), dstrain(3)   !! E11, E22, 2 E12
      type(law_response_t), intent(out) :: response
      type(dg_t) :: e1, e2, e3, w
      real(wp) :: mean(3), last(3), g2(3), c2(3), t1(3), t2(3)
      real(wp), parameter :: g1(3) = [1.0_wp, 1.0_wp, 0.0_wp]

      mean = strain + 0.5_wp*dstrain
      last = strain + dstrain
      g2 = [mean(2), mean(1), -0.5_wp*mean(3)]
      c2 = [last(2), last(1), -0.5_wp*last(3)]
      e1 = dg_variable(1, strain(1) + strain(2), dstrain(1) + dstrain(2))
      e2 = dg_variable(2, strain(1)*strain(2) - 0.25_wp*strain(3)**2, dot_product(g2, dstrain))
      e3 = dg_variable(3, 0.0_wp, 0.0_wp)
      w = law%energy(e1, e2, e3)

      response%energy = w%f1
      response%stress = w%g(1)*g1 + w%g(2)*g2
      response%stress_33 = w%g(1) + w%g(2)*e1%f1 + w%g(3)*e2%f1
      t1 = w%h(1, 1)*g1 + w%h(2, 1)*g2
      t2 = w%h(1, 2)*g1 + w%h(2, 2)*g2
      response%tangent(:, 1) = t1*g1(1) + t2*c2(1)
      response%tangent(:, 2) = t1*g1(2) + t2*c2(2)
      response%tangent(:, 3) = t2*c2(3)
      response%tangent(1, 2) = response%tangent(1, 2) + 0.5_wp*w%g(2)
      response%tangent(2, 1) = response%tangent(2, 1) + 0.5_wp*w%g(2)
      response%tangent(3, 3) = response%tangent(3, 3) - 0.25_wp*w%g(2)
   end subroutine law_response_plane

   !> det C - 1 = 2 e1 + 4 e2 + 8 e3: docs/theory.md, eq. (7).
   pure function volume_excess(e1, e2, e3) result(y)
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: y

      y = 2.0_wp*e1 + 4.0_wp*e2 + 8.0_wp*e3
   end function volume_excess

   !> z with 3 exp(z) = J^(-2k/3) I_k, an invariant of C without its change of volume:
   !> z = ln(1 + a) - k/3 ln(1 + y), a = I_k/3 - 1. At small strains only second-order terms may be
   !> left: z = k/3 phi(y) - phi(a) + rest, phi(x) = x - ln(1 + x); at large ones it is these that
   !> would cancel. Source: docs/theory.md, eq. (8).
   pure function isochoric_excess(part, a, y, rest) result(z)
      real(wp), intent(in) :: part               !! k/3; k = 1: I_1 = tr C; k = 2: I_2 = tr cof C
      type(dg_t), intent(in) :: a, y             !! y = det C - 1
      type(dg_t), intent(in) :: rest             !! a - k y/3
      type(dg_t) :: z
      real(wp), parameter :: small = 0.5_wp

      if (max(abs(a%f0), abs(a%f1), abs(y%f0), abs(y%f1)) < small) then
         z = part*dg_excess(y) - dg_excess(a) + rest
      else
         z = dg_log1p(a) - part*dg_log1p(y)
      end if
   end function isochoric_excess

   !> Sum of (J - 1)^(2 i)/D_i; a D_i of 0 has no term.
   pure function volume_energy(d, y) result(w)
      real(wp), intent(in) :: d(:)               !! [L T^2/M]
      type(dg_t), intent(in) :: y                !! J^2 - 1
      type(dg_t) :: w, volume, square, power
      integer :: i

      volume = y/(dg_sqrt(y + 1.0_wp) + 1.0_wp)
      square = volume*volume
      power = square
      do i = 1, size(d)
         if (i > 1) power = power*square
         if (abs(d(i)) > 0.0_wp) w = w + (1.0_wp/d(i))*power
      end do
   end function volume_energy

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
