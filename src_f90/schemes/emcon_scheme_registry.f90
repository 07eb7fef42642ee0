!> The time stepping schemes, a row each: the only module that knows their kinds. A program may give
!> schemes of its own, which decks call by name.
module emcon_scheme_registry
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_row_t, scheme_t, setting_t
   use emcon_scheme_bdf2, only : scheme_bdf2_t
   use emcon_scheme_central_difference, only : scheme_central_difference_t
   use emcon_scheme_energy_decaying, only : scheme_energy_decaying_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_generalized_alpha, only : scheme_generalized_alpha_t
   use emcon_scheme_midpoint, only : scheme_midpoint_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_scheme_trapezoidal, only : scheme_trapezoidal_t
   use emcon_text, only : squeezed
   implicit none
   private
   public :: scheme_rows, scheme_given_row, scheme_static, scheme_energy_momentum, scheme_given
   public :: scheme_midpoint, scheme_trapezoidal, scheme_generalized_alpha, scheme_bdf2, &
      scheme_central_difference, scheme_energy_decaying
   public :: scheme_row, scheme_create, setting_range_t, setting_ranges

   integer, parameter :: scheme_static = 1, scheme_energy_momentum = 2, scheme_given = 3, &
      scheme_midpoint = 4, scheme_trapezoidal = 5, scheme_generalized_alpha = 6, scheme_bdf2 = 7, &
      scheme_central_difference = 8, scheme_energy_decaying = 9

   !> The first row of a card is its default.
   type(scheme_row_t), parameter :: scheme_rows(*) = [ &
      scheme_row_t(scheme_static, "STATIC", "", "statics", loads_ramp=.true.), &
      scheme_row_t(scheme_energy_momentum, "DYNAMIC", "ENERGY MOMENTUM", &
         "energy-momentum scheme", masses_resist=.true.), &
      scheme_row_t(scheme_midpoint, "DYNAMIC", "MIDPOINT", "mid-point rule", &
         masses_resist=.true., takes_massless=.false.), &
      scheme_row_t(scheme_trapezoidal, "DYNAMIC", "TRAPEZOIDAL", "trapezoidal rule", &
         masses_resist=.true., takes_jumps=.false., takes_massless=.false., &
         takes_damping=.false., looks_back=.true.), &
      scheme_row_t(scheme_generalized_alpha, "DYNAMIC", "GENERALIZED ALPHA", &
         "generalised-alpha method", masses_resist=.true., takes_jumps=.false., &
         takes_massless=.false., takes_damping=.false., looks_back=.true., &
         is_accelerated=.true., n_past=1, &
         setting=setting_t("ALPHA", -0.05_wp)), &
      scheme_row_t(scheme_bdf2, "DYNAMIC", "BDF2", "backward differences", &
         masses_resist=.true., takes_jumps=.false., takes_massless=.false., &
         takes_damping=.false., looks_back=.true., n_past=2), &
      scheme_row_t(scheme_central_difference, "DYNAMIC", "CENTRAL DIFFERENCE", &
         "central differences", masses_resist=.true., takes_damping=.false., &
         is_explicit=.true.), &
      scheme_row_t(scheme_energy_decaying, "DYNAMIC", "ENERGY DECAYING", &
         "energy-decaying scheme", masses_resist=.true., takes_massless=.false., &
         dissipates=.true., looks_back=.true., n_past=1, &
         setting=setting_t("DISSIPATION", 0.125_wp))]

   !> What the numbers of schemes may be.
   type :: setting_range_t
      integer :: code = 0                        !! of the scheme
      character(len=16) :: word = ""             !! in decks
      real(wp) :: least = 0.0_wp, most = 0.0_wp
      character(len=10) :: range = ""             !! the same, for messages
   end type setting_range_t

   type(setting_range_t), parameter :: setting_ranges(*) = [ &
      setting_range_t(scheme_generalized_alpha, "ALPHA", -1.0_wp/3.0_wp, 0.0_wp, "-1/3 to 0"), &
      setting_range_t(scheme_generalized_alpha, "SPECTRAL RADIUS", 0.0_wp, 1.0_wp, "0 to 1"), &
      setting_range_t(scheme_energy_decaying, "DISSIPATION", 0.0_wp, 1.0_wp, "0 to 1")]

   !> Of schemes that a program gives, before it has: then they say themselves what they keep.
   type(scheme_row_t), parameter :: scheme_given_row = &
      scheme_row_t(scheme_given, "DYNAMIC", masses_resist=.true., looks_back=.true.)

contains

   !> The row that `card` asks for with SCHEME=`word`; "": its default. Code 0: there is none.
   pure type(scheme_row_t) function scheme_row(card, word) result(row)
      character(len=*), intent(in) :: card       !! capital letters
      character(len=*), intent(in) :: word       !! capital letters, without blanks
      integer :: i

      do i = 1, size(scheme_rows)
         if (scheme_rows(i)%card /= card) cycle
         if (word /= "" .and. squeezed(scheme_rows(i)%word) /= word) cycle
         row = scheme_rows(i)
         return
      end do
   end function scheme_row

   !> The scheme of a row, in place of another that was there.
   subroutine scheme_create(row, scheme, given)
      type(scheme_row_t), intent(in) :: row
      class(scheme_t), allocatable, intent(inout) :: scheme
      class(scheme_t), intent(in), optional :: given   !! that of `scheme_given`

      if (allocated(scheme)) deallocate(scheme)
      select case (row%code)
      case (scheme_static)
         allocate(scheme_static_t :: scheme)
      case (scheme_energy_momentum)
         allocate(scheme_energy_momentum_t :: scheme)
      case (scheme_midpoint)
         allocate(scheme_midpoint_t :: scheme)
      case (scheme_trapezoidal)
         allocate(scheme_trapezoidal_t :: scheme)
      case (scheme_generalized_alpha)
         allocate(scheme_generalized_alpha_t :: scheme)
      case (scheme_bdf2)
         allocate(scheme_bdf2_t :: scheme)
      case (scheme_central_difference)
         allocate(scheme_central_difference_t :: scheme)
      case (scheme_energy_decaying)
         allocate(scheme_energy_decaying_t :: scheme)
      case default
         allocate(scheme, source=given)
      end select
      scheme%row = row
   end subroutine scheme_create

end module emcon_scheme_registry
