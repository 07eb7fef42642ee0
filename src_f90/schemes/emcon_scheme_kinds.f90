!> The kinds of time stepping schemes. A new scheme is one file, one row of `rows` and one case of
!> `allocate_scheme`.
submodule (emcon_scheme_registry) emcon_scheme_kinds
   use emcon_scheme, only : setting_t
   use emcon_scheme_bdf2, only : scheme_bdf2_t
   use emcon_scheme_central_difference, only : scheme_central_difference_t
   use emcon_scheme_energy_decaying, only : scheme_energy_decaying_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_generalized_alpha, only : scheme_generalized_alpha_t
   use emcon_scheme_midpoint, only : scheme_midpoint_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_scheme_trapezoidal, only : scheme_trapezoidal_t
   implicit none

   !> Codes besides those of the registry.
   integer, parameter :: scheme_midpoint = 4, scheme_trapezoidal = 5, &
      scheme_generalized_alpha = 6, scheme_bdf2 = 7, scheme_central_difference = 8, &
      scheme_energy_decaying = 9

   !> The first row of a card is its default.
   type(scheme_row_t), parameter :: rows(*) = [ &
      scheme_row_t(scheme_static, "STATIC", "", "statics", loads_ramp=.true.), &
      scheme_row_t(scheme_energy_momentum, "DYNAMIC", "ENERGY MOMENTUM", &
         "energy-momentum scheme", has_inertia=.true.), &
      scheme_row_t(scheme_midpoint, "DYNAMIC", "MIDPOINT", "mid-point rule", &
         has_inertia=.true., takes_massless=.false.), &
      scheme_row_t(scheme_trapezoidal, "DYNAMIC", "TRAPEZOIDAL", "trapezoidal rule", &
         has_inertia=.true., takes_jumps=.false., takes_massless=.false., &
         takes_damping=.false., looks_back=.true.), &
      scheme_row_t(scheme_generalized_alpha, "DYNAMIC", "GENERALIZED ALPHA", &
         "generalised-alpha method", has_inertia=.true., takes_jumps=.false., &
         takes_massless=.false., takes_damping=.false., looks_back=.true., &
         is_accelerated=.true., n_past=1, &
         setting=setting_t("ALPHA", -0.05_wp)), &
      scheme_row_t(scheme_bdf2, "DYNAMIC", "BDF2", "backward differences", &
         has_inertia=.true., takes_jumps=.false., takes_massless=.false., &
         takes_damping=.false., looks_back=.true., n_past=2), &
      scheme_row_t(scheme_central_difference, "DYNAMIC", "CENTRAL DIFFERENCE", &
         "central differences", has_inertia=.true., takes_damping=.false., &
         is_explicit=.true., lumps_mass=.true.), &
      scheme_row_t(scheme_energy_decaying, "DYNAMIC", "ENERGY DECAYING", &
         "energy-decaying scheme", has_inertia=.true., takes_massless=.false., &
         dissipates=.true., looks_back=.true., n_past=1, &
         setting=setting_t("DISSIPATION", 0.125_wp))]

   type(setting_range_t), parameter :: ranges(*) = [ &
      setting_range_t(scheme_generalized_alpha, "ALPHA", -1.0_wp/3.0_wp, 0.0_wp, "-1/3 to 0"), &
      setting_range_t(scheme_generalized_alpha, "SPECTRAL RADIUS", 0.0_wp, 1.0_wp, "0 to 1"), &
      setting_range_t(scheme_energy_decaying, "DISSIPATION", 0.0_wp, 1.0_wp, "0 to 1")]

contains

   module procedure n_scheme_row
      n_scheme_row = size(rows)
   end procedure n_scheme_row

   module procedure scheme_row_at
      row = rows(i)
   end procedure scheme_row_at

   module procedure n_setting_range
      n_setting_range = size(ranges)
   end procedure n_setting_range

   module procedure setting_range
      range = ranges(i)
   end procedure setting_range

   module procedure allocate_scheme
      select case (code)
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
      end select
   end procedure allocate_scheme

end submodule emcon_scheme_kinds
