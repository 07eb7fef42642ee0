!> The kinds of constitutive laws. A new law is one file, one row of `rows` and one case of
!> `allocate_law`.
submodule (emcon_law_registry) emcon_law_kinds
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_law_anisotropic, only : law_anisotropic_t
   use emcon_law_coupled_neo_hooke_space, only : law_coupled_neo_hooke_space_t
   use emcon_law_linear, only : law_linear_t
   use emcon_law_linear_space, only : law_linear_space_t
   use emcon_law_mooney_rivlin_space, only : law_mooney_rivlin_space_t
   use emcon_law_neo_hooke_space, only : law_neo_hooke_space_t
   use emcon_law_ogden, only : law_ogden_t
   use emcon_law_thin_plane, only : thin_law
   use emcon_law_yeoh_space, only : law_yeoh_space_t
   implicit none

   !> Codes besides those of the registry.
   integer, parameter :: law_neo_hooke = 2, law_coupled_neo_hooke = 3, law_mooney_rivlin = 5, &
      law_yeoh = 6, law_ogden = 7

   type(law_row_t), parameter :: rows(*) = [ &
      law_row_t("linear", "ELASTIC", "", 0, law_linear, [character(len=6) :: "E", "nu", &
         "", "", "", "", "", "", ""]), &
      law_row_t("neo hooke", "HYPERELASTIC", "NEOHOOKE", 0, law_neo_hooke, [character(len=6) :: &
         "C10", "D1", "", "", "", "", "", "", ""]), &
      law_row_t("coupled neo hooke", "HYPERELASTIC", "COUPLEDNEOHOOKE", 0, &
         law_coupled_neo_hooke, [character(len=6) :: "E", "nu", "", "", "", "", "", "", ""]), &
      law_row_t("mooney-rivlin", "HYPERELASTIC", "MOONEY-RIVLIN", 0, law_mooney_rivlin, &
         [character(len=6) :: "C10", "C01", "D1", "", "", "", "", "", ""]), &
      law_row_t("yeoh", "HYPERELASTIC", "YEOH", 0, law_yeoh, [character(len=6) :: &
         "C10", "C20", "C30", "D1", "D2", "D3", "", "", ""]), &
      law_row_t("ogden 1", "HYPERELASTIC", "OGDEN", 1, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "D1", "", "", "", "", "", ""]), &
      law_row_t("ogden 2", "HYPERELASTIC", "OGDEN", 2, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "mu2", "alpha2", "D1", "D2", "", "", ""]), &
      law_row_t("ogden 3", "HYPERELASTIC", "OGDEN", 3, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "mu2", "alpha2", "mu3", "alpha3", "D1", "D2", "D3"])]

contains

   module procedure n_law_row
      n_law_row = size(rows)
   end procedure n_law_row

   module procedure law_row
      row = rows(i)
   end procedure law_row

   module procedure allocate_law
      select case (code)
      case (law_linear)
         allocate(law_linear_space_t :: law)
      case (law_neo_hooke)
         allocate(law_neo_hooke_space_t :: law)
      case (law_coupled_neo_hooke)
         allocate(law_coupled_neo_hooke_space_t :: law)
      case (law_mooney_rivlin)
         allocate(law_mooney_rivlin_space_t :: law)
      case (law_yeoh)
         allocate(law_yeoh_space_t :: law)
      case (law_ogden)
         allocate(law_ogden_t :: law)
      case (law_anisotropic)
         allocate(law_anisotropic_t :: law)
      end select
   end procedure allocate_law

   module procedure law_linearise
      real(wp), parameter :: rest(3) = 0.0_wp
      type(law_response_t) :: response
      type(law_linear_t) :: plain

      select type (law)
      class is (law_linear_t)
         plain = law
      type is (law_anisotropic_t)
         allocate(linear, source=law)
         return
      class default
         call law_response_plane(law, rest, rest, response)
         plain%mu = law%shear                    ! the tangent is by the end of a step of no size
         plain%lam = 2.0_wp*(response%tangent(1, 1) - plain%mu)
         plain%density = law%density
         plain%shear = plain%mu
         plain%has_volume = .false.
      end select
      allocate(linear, source=plain)
   end procedure law_linearise

   module procedure law_make_thin
      type(law_linear_t) :: plain

      select type (law)
      class is (law_linear_t)
         plain = law
         call plain%make_thin()
         allocate(thin, source=plain)
      type is (law_ogden_t)                      ! its stretches are those of E33 = 0
         return
      type is (law_anisotropic_t)                ! of three dimensions
         return
      class default
         call thin_law(law, thin)
      end select
   end procedure law_make_thin

end submodule emcon_law_kinds
