!> The kinds of laws of contact. A new law is one file, and one row here.
submodule (emcon_contact_law_registry) emcon_contact_law_kinds
   use emcon_coulomb_law, only : coulomb_t
   use emcon_dashpot_law, only : dashpot_t
   use emcon_restitution_law, only : restitution_t
   use emcon_penalty_law, only : augmented_t, penalty_t
   use emcon_pressure_law, only : pressure_law_t
   implicit none

contains

   module procedure n_kind
      n_kind = 6
   end procedure n_kind

   module procedure allocate_law
      select case (kind)
      case (1); allocate(coulomb_t :: law)
      case (2); allocate(dashpot_t :: law)
      case (3); allocate(restitution_t :: law)
      case (4); allocate(pressure_law_t :: law)
      case (5); allocate(penalty_t :: law)
      case (6); allocate(augmented_t :: law)
      end select
   end procedure allocate_law

end submodule emcon_contact_law_kinds
