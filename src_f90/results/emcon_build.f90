!> What the last bits of a result depend on besides the deck: version, compiler, kind, BLAS.
module emcon_build
   use, intrinsic :: iso_fortran_env, only : compiler_options, compiler_version
   use emcon_blas, only : blas_name
   use emcon_kinds, only : wp
   use emcon_text, only : note_add, notes_t, string_t, to_text
   use emcon_version, only : version
   implicit none
   private
   public :: build_list, build_differences

   character(len=*), parameter :: subject(5) = [character(len=16) :: "version", "compiler", &
      "compiler options", "bits of a real", "BLAS"]

contains

   !> The present build and machine, one text per subject.
   subroutine build_list(list)
      type(string_t), allocatable, intent(out) :: list(:)
      type(notes_t) :: notes
      character(len=:), allocatable :: blas

      call blas_name(blas)
      call note_add(notes, version)
      call note_add(notes, compiler_version())
      call note_add(notes, compiler_options())
      call note_add(notes, to_text(storage_size(1.0_wp)))
      call note_add(notes, blas)
      list = notes%item(:notes%n)
   end subroutine build_list

   !> A text for each subject in which the present build differs from that of `before`.
   subroutine build_differences(before, start, warnings)
      type(string_t), intent(in) :: before(:)
      character(len=*), intent(in) :: start          !! of the texts
      type(notes_t), intent(out) :: warnings
      type(string_t), allocatable :: list(:)
      integer :: i

      call build_list(list)
      do i = 1, min(size(list), size(before))
         if (before(i)%text /= list(i)%text) call note_add(warnings, start // &
            "the run began with another " // trim(subject(i)) // ": '" // before(i)%text // &
            "', now '" // list(i)%text // &
            "'; its last digits may differ from those of a run in one go")
      end do
   end subroutine build_differences

end module emcon_build
