!> What a run is asked for that goes on from a restart file: a later end, further steps.
module emcon_deck_further
   use emcon_deck_source, only : deck_open, deck_source_t
   use emcon_diagnostics, only : diagnostics_t, diagnostics_texts
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_is_dynamic
   use emcon_text, only : squeezed, string_t, to_text
   implicit none
   private
   public :: further_t, further_append, further_until

   type :: further_t
      real(wp) :: until = 0.0_wp                 !! total time of the end; 0: as it is [T]
      character(len=:), allocatable :: path      !! of a file with steps; not allocated: none
   end type further_t

contains

   !> Append the lines of the file at `path` to `source`: whole steps and nothing else, else
   !> `error`. Their rows and columns stay those of that file in messages.
   subroutine further_append(source, path, error)
      type(deck_source_t), intent(inout) :: source
      character(len=*), intent(in) :: path       !! of the file, which may include others
      type(error_t), allocatable, intent(out) :: error
      type(deck_source_t) :: more
      type(diagnostics_t) :: diagnostics
      type(string_t), allocatable :: text(:)
      integer :: n_file

      call deck_open(path, more, diagnostics)
      if (diagnostics%n_errors > 0) then
         text = diagnostics_texts(diagnostics)
         call raise(error, err_input, text(1)%text)
         return
      end if
      call check_steps(more, error)
      if (allocated(error)) return
      n_file = size(source%file_name)
      source%line = [source%line, more%line]
      source%file = [source%file, more%file + n_file]
      source%number = [source%number, more%number]
      source%file_name = [source%file_name, more%file_name]
      source%n_own_file = n_file
   end subroutine further_append

   !> Between steps there is no card: the model is that of the run.
   subroutine check_steps(source, error)
      type(deck_source_t), intent(in) :: source
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: word
      logical :: is_in
      integer :: i

      is_in = .false.
      do i = 1, size(source%line)
         associate (line => source%line(i)%text)
            word = squeezed(line(:scan(line // ",", ",") - 1))
            if (index(word, "**") == 1 .or. word == "") cycle
            if (word == "*STEP") is_in = .true.
            if (word == "*NOANALYSIS") then
               call raise(error, err_input, source%file_name(source%file(i))%text // ":" // &
                  to_text(source%number(i)) // ": error: *NO ANALYSIS is no step that a run " // &
                  "could go on with; leave it out")
               return
            end if
            if (.not. is_in) then
               call raise(error, err_input, source%file_name(source%file(i))%text // ":" // &
                  to_text(source%number(i)) // ": error: '" // trim(line) // "' is in no step: " &
                  // "what goes on from a restart file has the model of that run, and here " // &
                  "*STEP to *END STEP only")
               return
            end if
            if (word == "*ENDSTEP") is_in = .false.
         end associate
      end do
   end subroutine check_steps

   !> Let steps of `scene` end at the total times `until`.
   subroutine further_until(scene, until, error)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: until(:)           !! (n_step or less) [T]; 0: as the step says
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: start
      integer :: k

      start = 0.0_wp
      do k = 1, size(until)
         associate (step => scene%step(k))
            if (until(k) > 0.0_wp) then
               if (.not. step_is_dynamic(step)) then
                  call raise(error, err_input, "--until is for dynamic steps: the loads of step " &
                     // to_text(k) // ", which is static, run over its duration; give a further " &
                     // "step by --steps")
               else if (.not. until(k) > start) then
                  call raise(error, err_input, "--until " // to_text(until(k)) // " is not later " &
                     // "than " // to_text(start) // ", when the last step begins")
               end if
               if (allocated(error)) return
               step%time%duration = until(k) - start
            end if
            start = start + step%time%duration
         end associate
      end do
   end subroutine further_until

end module emcon_deck_further
