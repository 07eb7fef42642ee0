!> When loads and motions that are given change their pace: the corners of amplitudes in use.
module emcon_corners
   use emcon_amplitudes, only : amplitude_corners
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: corners_find

contains

   !> Fill `corner` of all steps of `scene`.
   pure subroutine corners_find(scene)
      type(scene_t), intent(inout) :: scene      !! read
      real(wp) :: start
      integer :: k

      start = 0.0_wp
      do k = 1, size(scene%step)
         call find_in_step(scene, k, start)
         start = start + scene%step(k)%time%duration
      end do
   end subroutine corners_find

   !> Those between the start and the end of step `k`, which begins at the time `start`.
   pure subroutine find_in_step(scene, k, start)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      real(wp), intent(in) :: start              !! [T]
      integer, allocatable :: used(:)            ! amplitudes; 0: none
      real(wp), allocatable :: time(:)
      integer :: i

      associate (step => scene%step(k))
         allocate(used, source=[step%load%amplitude, &
            step%prescribed%amplitude, (step%turn(i)%angle%amplitude, i = 1, size(step%turn)), &
            merge(step%contact%overclosure_amplitude, 0, step%contact%resolves_overclosure)])
         allocate(time(0))
         do i = 1, size(scene%amplitude)
            if (.not. any(used == i)) cycle
            associate (table => scene%amplitude(i))
               time = [time, pack(table%time, amplitude_corners(table)) - merge(start, 0.0_wp, &
                  table%is_total_time)]
            end associate
         end do
         time = pack(time, time > 0.0_wp .and. time < step%time%duration)
         step%time%corner = time(sort_order(real(time, dp)))
      end associate
   end subroutine find_in_step

end module emcon_corners
