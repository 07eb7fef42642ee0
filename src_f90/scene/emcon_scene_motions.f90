!> What a model moves in: its plane as sheets, circles about an axis, or space; and what follows for
!> momenta, masses and forces of whole bodies.
module emcon_scene_motions
   use emcon_kinds, only : wp
   use emcon_rotation, only : n_turn
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: scene_is_flat, scene_motions, scene_takes_force, scene_inertia

contains

   !> Are the bodies sheets, with a thickness, that move in their plane?
   pure logical function scene_is_flat(scene) result(is_flat)
      type(scene_t), intent(in) :: scene

      is_flat = n_turn(scene%n_dim) == 1 .and. .not. scene%is_axial
   end function scene_is_flat

   !> Which rigid motions a body can have, and so momenta: displacements, then rotations. Whole
   !> circles move along their axis alone.
   pure function scene_motions(scene) result(has_motion)
      type(scene_t), intent(in) :: scene
      logical :: has_motion(scene%n_dim + n_turn(scene%n_dim))

      has_motion = .not. scene%is_axial
      has_motion(2:scene%n_dim) = .true.
   end function scene_motions

   !> May the same force act along `direction` on all mass?
   pure logical function scene_takes_force(scene, direction) result(takes_force)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: direction(:)       !! (n_dim or more)

      associate (has_motion => scene_motions(scene))
         takes_force = .not. any(abs(direction(:scene%n_dim)) > 0.0_wp &
            .and. .not. has_motion(:scene%n_dim))
      end associate
   end function scene_takes_force

   !> The moments of inertia of the mass `m` that places `a` and `b` share, a.b less what is along
   !> each axis of rotation; of circles that about their own axis.
   pure function scene_inertia(scene, m, a, b) result(inertia)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: m                  !! [M]
      real(wp), intent(in) :: a(:), b(:)         !! (n_dim) [L]
      real(wp) :: inertia(n_turn(size(a)))

      if (scene%is_axial) then
         inertia = m*a(1)*b(1)
         return
      end if
      inertia = dot_product(a, b)
      if (size(inertia) == size(a)) inertia = inertia - a*b
      inertia = m*inertia
   end function scene_inertia

end module emcon_scene_motions
