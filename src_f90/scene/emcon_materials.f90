!> What bodies are made of: laws with their constants, and sections.
module emcon_materials
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: material_t, section_t
   public :: kinematics_nonlinear, kinematics_linear, kinematics_corotated

   !> How the elements of a section deform: as their steps say, or by small strains in all steps, of
   !> the displacement or of what is left of it in a frame that turns with the element.
   integer, parameter :: kinematics_nonlinear = 1, kinematics_linear = 2, kinematics_corotated = 3

   type :: material_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      integer :: law = 0                             !! code of a row of laws; 0: none was given
      real(wp), allocatable :: constant(:)           !! as the row of the law names them | any
      real(wp) :: density = 0.0_wp                   !! [M/L^3]
      type(origin_t) :: damping_origin
      real(wp) :: alpha = 0.0_wp                     !! damping by mass [1/T]
      real(wp) :: beta = 0.0_wp                      !! damping by moduli [T]
   end type material_t

   type :: section_t
      type(origin_t) :: origin
      character(len=:), allocatable :: set           !! element set
      integer :: material = 0
      real(wp) :: thickness = 1.0_wp                 !! [L]
      integer :: kinematics = kinematics_nonlinear   !! one of `kinematics_`
      logical :: is_massless = .false.               !! its elements have no inertia
   end type section_t

end module emcon_materials
