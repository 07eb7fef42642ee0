!> Ogden's law with Abaqus' constants: W = sum over i = 1..N of
!> 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3) + (J - 1)^(2 i)/D_i, with the
!> principal stretches times J^(-1/3) for l.
!>
!> Source: docs/theory.md, section 3, principal stretches.
module emcon_law_ogden
   use emcon_dgrad3, only : dg_chain, dg_excess, dg_expm1, dg_log1p, dg_sqrt, dg_t, operator(*), &
      operator(-), operator(+), operator(/)
   use emcon_dgrad_series, only : cosh_chord, cosh_excess, expm1_of, log1p_of
   use emcon_kinds, only : wp
   use emcon_law, only : claim, law_volumetric_t, volume_energy, volume_excess
   implicit none
   private
   public :: law_ogden_t

   type, extends(law_volumetric_t) :: law_ogden_t
      integer :: order = 0                       !! N, 1..3
      real(wp) :: mu(3) = 0.0_wp                 !! (:N) [M/(L T^2)]
      real(wp) :: alpha(3) = 1.0_wp              !! (:N) not 0
   contains
      procedure :: take => ogden_take
      procedure :: energy => ogden_energy
      procedure :: part
   end type law_ogden_t

contains

   pure subroutine ogden_take(self, constant, fault)
      class(law_ogden_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! mu1, alpha1, .., muN, alphaN, D1, .., DN
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing
      integer :: i, n

      n = size(constant)/3
      self%n_part = n
      self%order = n
      self%mu(:n) = constant(1:2*n:2)
      self%alpha(:n) = constant(2:2*n:2)
      self%exponent(:n) = self%alpha(:n)
      self%d(:n) = constant(2*n + 1:3*n)
      self%shear = sum(self%mu(:n))
      call claim(self%shear > 0.0_wp, "the sum of all mu", self%shear, "must be positive", fault)
      do i = 1, n
         call claim(abs(self%alpha(i)) > 0.0_wp, "alpha", self%alpha(i), "must not be 0", fault)
      end do
      call claim(self%d(1) >= 0.0_wp, "D1", self%d(1), "must not be negative", fault)
   end subroutine ogden_take

   !> In the plane l1, l2 = J^(1/6) exp(+-q/2) and l3 = J^(-1/3), with cosh q = 1 + s; so that with
   !> A = J^(alpha/6) a term is 2 A (cosh(alpha q/2) - 1) + (A - 1)^2 (2 A + 1)/A^2.
   pure function ogden_energy(self, e1, e2, e3) result(w)
      class(law_ogden_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, logarithm, s, a, below
      real(wp) :: half
      integer :: i

      y = volume_excess(e1, e2, e3)
      logarithm = dg_log1p(y)
      s = spread_of(e1, e2, y)
      w = volume_energy(self%d(:self%order), y)
      do i = 1, self%order
         half = 0.5_wp*self%alpha(i)
         below = dg_expm1((half/6.0_wp)*logarithm)
         a = below + 1.0_wp
         w = w + (2.0_wp*self%mu(i)/self%alpha(i)**2)*(2.0_wp*(a*cosh_of(half, s)) &
            + (below*below)*(2.0_wp*a + 1.0_wp)/(a*a))
      end do
      call set_normal_slope(self, e1, e2, y, s, w)
   end function ogden_energy

   !> s = tr C/(2 J) - 1 of the plane part of C, without cancellation in the trace.
   pure function spread_of(e1, e2, y) result(s)
      type(dg_t), intent(in) :: e1, e2, y
      type(dg_t) :: s, root

      root = dg_sqrt(y + 1.0_wp)
      s = (2.0_wp*(e1*e1 - 4.0_wp*e2))/(root*((2.0_wp*e1 + 2.0_wp) + 2.0_wp*root))
   end function spread_of

   !> cosh(k acosh(1 + s)) - 1
   pure function cosh_of(k, s) result(c)
      real(wp), intent(in) :: k
      type(dg_t), intent(in) :: s
      type(dg_t) :: c
      real(wp) :: slope, rate, last, unused

      call cosh_chord(k, s%f0, s%f1, slope, rate)
      call cosh_chord(k, s%f1, s%f1, last, unused)
      c = dg_chain(s, cosh_excess(k, s%f0), cosh_excess(k, s%f1), slope, rate, last)
   end function cosh_of

   !> The slope by e3: out of the plane three stretches differ, but all that is asked for is
   !> S33 = g1 + g2 e1 + g3 e2 = dW/dE33 at E33 = 0, where the third stretch is a principal one.
   pure subroutine set_normal_slope(self, e1, e2, y, s, w)
      class(law_ogden_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, y, s
      type(dg_t), intent(inout) :: w
      real(wp) :: s33, logarithm, volume, power, half
      integer :: i

      w%g(3) = 0.0_wp
      if (abs(e2%f1) <= epsilon(1.0_wp)*e1%f1**2) return
      volume = y%f1/(sqrt(1.0_wp + y%f1) + 1.0_wp)
      s33 = 0.0_wp
      power = volume
      do i = 1, self%order
         if (abs(self%d(i)) > 0.0_wp) s33 = s33 + real(i + i, wp)/self%d(i)*power
         power = power*volume*volume
      end do
      s33 = s33*(1.0_wp + volume)
      logarithm = 0.5_wp*log1p_of(y%f1)
      do i = 1, self%order
         half = 0.5_wp*self%alpha(i)
         s33 = s33 + (2.0_wp*self%mu(i)/(3.0_wp*half))*exp(half*logarithm/3.0_wp) &
            *(expm1_of(-half*logarithm) - cosh_excess(half, s%f1))
      end do
      w%g(3) = (s33 - dot_product(w%g, [1.0_wp, e1%f1, 0.0_wp]))/e2%f1
   end subroutine set_normal_slope

   !> With p = alpha ln(J)/3 a term is exp(-p) (t - 3 (exp(p) - 1 - p)); the first one has the
   !> energy of the change of volume beside it.
   pure function part(self, i, y, t) result(w)
      class(law_ogden_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..order
      type(dg_t), intent(in) :: y                !! J^2 - 1
      type(dg_t), intent(in) :: t                !! sum of l^alpha - 1 - alpha ln l
      type(dg_t) :: w, above

      above = dg_expm1((self%alpha(i)/6.0_wp)*dg_log1p(y))
      w = (2.0_wp*self%mu(i)/self%alpha(i)**2)*((t - 3.0_wp*dg_excess(above))/(above + 1.0_wp))
      if (i == 1) w = w + volume_energy(self%d(:self%order), y)
   end function part

end module emcon_law_ogden
