! build: holder
!> What the layer of massless contact nodes holds: `emcon_layer` balances it, `emcon_layer_push`
!> finds the forces that what it gives up goes back along.
module emcon_layer_type
   use emcon_active_set, only : active_set_t
   use emcon_host, only : host_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_t
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
   use emcon_system, only : system_t
   use emcon_velocity_jumps, only : velocity_jump_t
   implicit none
   private
   public :: layer_t

   type :: layer_t
      logical :: is_on = .false.                 !! there are massless nodes
      logical, allocatable :: is_massless(:)     !! (n_node)
      type(host_t) :: laws              !! that the model is given
      type(scene_t) :: scene            !! the elements on these nodes
      type(system_t) :: system          !! and the contact of the whole
      type(newton_t), allocatable :: newton      !! if it is on
      type(active_set_t) :: active
      type(state_t) :: state            !! what acts, with which multipliers
      type(motion_t) :: motion
      integer :: n_before = 0                    !! conditions of the model before its contact
      ! of `layer_settle`:
      logical, allocatable :: needs_mass(:)      !! (n_node) where it found no balance
      logical :: is_settled = .false.            !! in the last increment
      real(wp), allocatable :: du(:, :)          !! (n_dim, n_node) how z has moved [L]
      real(wp) :: released = 0.0_wp              !! energy that z has given up [M L^2/T^2]
      real(wp) :: work = 0.0_wp                  !! of the loads on z [M L^2/T^2]
      real(wp) :: rubbed = 0.0_wp                !! what friction took in that [M L^2/T^2]
      real(wp), allocatable :: push(:, :)        !! (n_dim, n_node) forces to give energy back along
      type(velocity_jump_t), allocatable :: jump(:)  !! what they are of each contact
      logical, allocatable :: acts(:)            !! (contacts) at the end
      real(wp), allocatable :: lam(:)            !! (contacts) with these forces [M L/T^2]
   end type layer_t

end module emcon_layer_type
