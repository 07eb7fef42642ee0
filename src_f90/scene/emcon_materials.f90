!> What bodies are made of: laws with their constants, and sections.
module emcon_materials
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: material_t, section_t
   public :: law_linear, law_neo_hooke, law_coupled_neo_hooke, law_given

   !> Constitutive laws. `law_linear` is linear elasticity, under NLGEOM St. Venant-Kirchhoff;
   !> `law_given` is a function that a program gives.
   integer, parameter :: law_linear = 1, law_neo_hooke = 2, law_coupled_neo_hooke = 3, law_given = 4

   type :: material_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      integer :: law = 0                             !! one of `law_`; 0: none was given
      real(wp), allocatable :: constant(:)           !! as in the deck: E, nu | C10, D1 | any
      real(wp) :: density = 0.0_wp                   !! [M/L^3]
   end type material_t

   type :: section_t
      type(origin_t) :: origin
      character(len=:), allocatable :: set           !! element set
      integer :: material = 0
      real(wp) :: thickness = 1.0_wp                 !! [L]
   end type section_t

end module emcon_materials
