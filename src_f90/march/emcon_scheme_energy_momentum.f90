!> The energy-momentum scheme, paper eq. (4): discrete gradients, mid-point inertia.
!> Source: docs/theory.md, eqs. (2) and (3).
module emcon_scheme_energy_momentum
   use emcon_kinds, only : wp
   use emcon_motion, only : instant_t, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_energy_momentum_t

   type, extends(scheme_t) :: scheme_energy_momentum_t
   contains
      procedure :: pose => energy_momentum_pose
      procedure :: velocity => energy_momentum_velocity
   end type scheme_energy_momentum_t

contains

   !> r = M (2/h du - 2 v0)/h + forces; loads at mid-time on the mid-configuration.
   pure function energy_momentum_pose(self, start, h) result(pose)
      class(scheme_energy_momentum_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose%mass_scale = 1.0_wp/h
      pose%rate = 2.0_wp/h
      pose%v_weight = 2.0_wp
      pose%load_instant = instant_t(start%step_time + 0.5_wp*h, start%total_time + 0.5_wp*h)
   end function energy_momentum_pose

   elemental function energy_momentum_velocity(self, h, v0, du) result(v1)
      class(scheme_energy_momentum_t), intent(in) :: self
      real(wp), intent(in) :: h, v0, du          !! [T], [L/T], [L]
      real(wp) :: v1

      v1 = (2.0_wp/h)*du - v0
   end function energy_momentum_velocity

end module emcon_scheme_energy_momentum
