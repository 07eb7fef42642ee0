!> Schemes that a program gives, in the deck that calls them: what they do not go with.
module emcon_deck_user_scheme
   use emcon_deck_check_massless, only : check_massless_sections
   use emcon_deck_contact_damping, only : check_contact_damping
   use emcon_deck_damping, only : check_damping
   use emcon_deck_dimension, only : check_dimension
   use emcon_deck_friction, only : check_friction
   use emcon_deck_reader, only : reader_t
   use emcon_deck_scheme, only : check_schemes
   use emcon_diagnostics, only : diagnostics_texts
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_scheme, only : host_scheme_find, host_scheme_row, host_scheme_t
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_is_flat
   use emcon_scheme_registry, only : scheme_user
   use emcon_text, only : string_t
   implicit none
   private
   public :: take_user_schemes

contains

   !> Put the rows of the schemes `given` into the steps that call them by name, and see whether
   !> the deck goes with them. A name that was not given stays as it is.
   subroutine take_user_schemes(given, scene, error)
      type(host_scheme_t), allocatable, intent(in) :: given(:)   !! (any) or not allocated
      type(scene_t), intent(inout) :: scene      !! without errors but for schemes
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k

      if (.not. allocated(given)) return
      do i = 1, size(scene%step)
         associate (step => scene%step(i))
            if (step%scheme%code /= scheme_user) cycle
            k = host_scheme_find(given, step%choice%name)
            if (k > 0) step%scheme = host_scheme_row(step%choice%name, given(k)%scheme)
         end associate
      end do
      call check_again(scene, error)
   end subroutine take_user_schemes

   !> Check the deck again, now that the rows of all its schemes are known: its first error.
   subroutine check_again(scene, error)
      type(scene_t), intent(in) :: scene         !! without errors but for the scheme
      type(error_t), allocatable, intent(out) :: error
      type(reader_t) :: reader
      type(string_t), allocatable :: text(:)
      integer :: i

      reader%log%file_name = scene%deck%file
      call check_schemes(reader, scene%pair, scene%step)
      call check_damping(reader, scene)
      call check_friction(reader, scene)
      call check_contact_damping(reader, scene%pair, scene%step)
      call check_massless_sections(reader, scene)
      if (.not. scene_is_flat(scene)) call check_dimension(reader, scene)
      if (reader%log%n_errors == 0) return
      text = diagnostics_texts(reader%log)
      do i = 1, size(text)
         if (index(text(i)%text, ": error: ") == 0) cycle
         call raise(error, err_input, text(i)%text)
         return
      end do
   end subroutine check_again

end module emcon_deck_user_scheme
