!> What centrifugal forces ask for: small displacements, and an axis about which the model turns.
module emcon_deck_centrifugal
   use emcon_deck_dimension, only : n_space
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_is_flat
   use emcon_steps, only : load_centrifugal, load_t
   implicit none
   private
   public :: check_centrifugal

contains

   !> The first load of each step that is wrong.
   subroutine check_centrifugal(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      character(len=*), parameter :: card = "*DLOAD: CENTRIF "
      integer :: i, k

      do i = 1, size(scene%step)
         k = findloc(scene%step(i)%load%kind, load_centrifugal, 1)
         if (k == 0) cycle
         associate (load => scene%step(i)%load(k))
            if (scene%step(i)%nlgeom) then
               call add_error(reader%log, load%origin, card // "is known but not supported with " &
                  // "NLGEOM: it acts on the places at rest; leave NLGEOM out")
            else if (.not. is_own_axis(scene, load)) then
               if (scene_is_flat(scene)) then
                  call add_error(reader%log, load%origin, card // "turns a plane model about an " &
                     // "axis normal to it: px, py, 0, 0, 0, 1")
               else
                  call add_error(reader%log, load%origin, card // "turns solids of revolution " &
                     // "about their axis: 0, 0, 0, 0, 1, 0")
               end if
            end if
         end associate
      end do
   end subroutine check_centrifugal

   !> Does the model turn in itself?
   pure logical function is_own_axis(scene, load)
      type(scene_t), intent(in) :: scene
      type(load_t), intent(in) :: load

      is_own_axis = scene%n_dim == n_space
      if (is_own_axis) return
      if (scene_is_flat(scene)) then
         is_own_axis = all(abs(load%direction(:scene%n_dim)) <= 0.0_wp)
      else
         is_own_axis = all(abs([load%direction(1), load%direction(n_space), load%point(1), &
            load%point(n_space)]) <= 0.0_wp)
      end if
   end function is_own_axis

end module emcon_deck_centrifugal
