!> Linear elasticity of any symmetry in three dimensions: W = 1/2 E.C E. Under NLGEOM E is the
!> Green-Lagrange strain, as in emcon_law_linear.
!>
!> `energy` is that of the isotropic law nearest to it, which estimates and scales go by.
module emcon_law_anisotropic
   use emcon_dgrad3, only : dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_moduli, only : moduli_of, n_strain
   implicit none
   private
   public :: law_anisotropic_t

   integer, parameter :: n_normal = 3

   type, extends(law_t) :: law_anisotropic_t
      real(wp) :: lam = 0.0_wp                   !! of the isotropic law nearest to it [M/(L T^2)]
   contains
      procedure :: take
      procedure :: energy
   end type law_anisotropic_t

contains

   pure subroutine take(self, constant, fault)
      class(law_anisotropic_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! of `moduli_of`
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing
      real(wp) :: bulk, normal, coupled
      integer :: i, k

      fault = ""
      self%moduli = moduli_of(constant)
      if (.not. is_stable(self%moduli)) fault = "some strain has no energy or a negative one: " &
         // "the matrix of the constants is not positive definite"
      normal = sum([(self%moduli(i, i), i = 1, n_normal)])
      coupled = sum([((self%moduli(i, k), i = 1, k - 1), k = 2, n_normal)])
      bulk = (normal + 2.0_wp*coupled)/9.0_wp
      self%shear = (normal - coupled &
         + 3.0_wp*sum([(self%moduli(i, i), i = n_normal + 1, n_strain)]))/15.0_wp
      self%lam = bulk - 2.0_wp/3.0_wp*self%shear
      self%has_volume = .false.
   end subroutine take

   pure function energy(self, e1, e2, e3) result(w)
      class(law_anisotropic_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3       !! invariants of E
      type(dg_t) :: w                            !! [M/(L T^2)]

      w = (0.5_wp*self%lam + self%shear)*(e1*e1) - (2.0_wp*self%shear)*e2 + 0.0_wp*e3
   end function energy

   !> Is a symmetric matrix positive definite, beyond round-off? By its factors.
   pure logical function is_stable(c)
      real(wp), intent(in) :: c(n_strain, n_strain)          !! [M/(L T^2)]
      real(wp) :: left(n_strain, n_strain)
      integer :: i, k

      left = c
      is_stable = .true.
      do k = 1, n_strain
         is_stable = left(k, k) > n_strain*epsilon(1.0_wp)*c(k, k)
         if (.not. is_stable) return
         do i = k + 1, n_strain
            left(k + 1:, i) = left(k + 1:, i) - (left(k, i)/left(k, k))*left(k + 1:, k)
         end do
      end do
   end function is_stable

end module emcon_law_anisotropic
