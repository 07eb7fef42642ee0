!> Ties before the first step: their rows are frozen, slave nodes are moved onto the master surface,
!> and what ties cover is no exterior any more.
!>
!> Source: docs/theory.md, section 10.
module emcon_ties
   use emcon_couplings, only : tie_rows_t
   use emcon_deck_dimension, only : n_plane
   use emcon_errors, only : error_t
   use emcon_scene, only : scene_t
   use emcon_text, only : notes_t
   use emcon_tie_images, only : tie_images_add, tie_images_settle, tie_images_t, tie_images_take
   use emcon_tie_maps, only : tie_map_is_given
   use emcon_tie_meetings, only : check_repeated, count_ties, find_held, uncover_exterior
   use emcon_tie_moves, only : ties_move_nodes, ties_note_gaps
   use emcon_tie_space, only : tie_measure_space
   use emcon_ties_plane, only : ties_prepare_plane
   implicit none
   private
   public :: ties_prepare

contains

   !> Find the constraint rows of all ties and move their slave nodes so that D x_s = M x_m; the
   !> notes tell how far.
   subroutine ties_prepare(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error

      type(scene_t) :: whole
      type(tie_images_t) :: images

      if (.not. any(tie_map_is_given(scene%tie%map))) then
         call prepare(scene, notes, error)
         if (.not. allocated(error)) call ties_note_gaps(scene, notes)
         return
      end if
      whole = scene
      call tie_images_add(images, whole)
      call prepare(whole, notes, error)
      if (.not. allocated(error)) call tie_images_settle(images, whole, notes, error)
      if (allocated(error)) return
      call tie_images_take(images, whole, scene)
      call ties_note_gaps(scene, notes)
      call uncover_exterior(scene)
   end subroutine ties_prepare

   !> The same, where no tie has a map, or the images are there.
   subroutine prepare(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error

      if (size(scene%tie) == 0) return
      if (size(scene%x, 1) == n_plane) then
         call ties_prepare_plane(scene, notes, error)
      else
         call ties_prepare_space(scene, notes, error)
      end if
   end subroutine prepare

   !> The same in space, where a curved tie is not balanced.
   subroutine ties_prepare_space(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: n_tie(:)
      logical, allocatable :: is_held(:, :)
      type(tie_rows_t) :: rows
      integer :: t

      call check_repeated(scene, error)
      if (allocated(error)) return
      call count_ties(scene, n_tie)
      call find_held(scene, is_held)
      do t = 1, size(scene%tie)
         call tie_measure_space(scene, scene%tie(t), n_tie, is_held, rows, error)
         if (allocated(error)) return
         scene%tie(t)%rows = rows
      end do
      call uncover_exterior(scene)
      call ties_move_nodes(scene, notes, error)
   end subroutine ties_prepare_space

end module emcon_ties
