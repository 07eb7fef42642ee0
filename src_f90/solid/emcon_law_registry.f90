!> The registry of constitutive laws: from a material of the scene to a law.
module emcon_law_registry
   use emcon_errors, only : err_internal, error_t, raise
   use emcon_law, only : law_t
   use emcon_law_coupled_neo_hooke, only : law_coupled_neo_hooke_t
   use emcon_law_linear, only : lame_constants, law_linear_t
   use emcon_law_neo_hooke, only : law_neo_hooke_t
   use emcon_materials, only : law_coupled_neo_hooke, law_linear, law_neo_hooke, material_t
   implicit none
   private
   public :: law_create

contains

   !> The law of `material`, whose constants the deck reader has checked.
   subroutine law_create(material, law, error)
      type(material_t), intent(in) :: material
      class(law_t), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(out) :: error

      select case (material%law)
      case (law_linear)
         allocate(law_linear_t :: law)
      case (law_coupled_neo_hooke)
         allocate(law_coupled_neo_hooke_t :: law)
      case (law_neo_hooke)
         allocate(law_neo_hooke_t :: law)
      case default
         call raise(error, err_internal, "law_create: no law for material " // material%name)
         return
      end select
      law%density = material%density
      select type (law)
      type is (law_linear_t)
         law%has_volume = .false.
         call lame_constants(material%constant(1), material%constant(2), law%lam, law%mu)
      type is (law_coupled_neo_hooke_t)
         call lame_constants(material%constant(1), material%constant(2), law%lam, law%mu)
      type is (law_neo_hooke_t)
         law%c10 = material%constant(1)
         law%d1 = material%constant(2)
      end select
   end subroutine law_create

end module emcon_law_registry
