!> A correction of Newton's method with the multipliers of contacts before and after it, mixed with
!> those before.
!>
!> What a factor that is kept leaves falls by a part each time. Mixed corrections see what it
!> leaves, and fewer of them do. Source: docs/theory.md, section 6.1.
module emcon_mixed_step
   use emcon_kinds, only : wp
   use emcon_mixing, only : mixing_begin, mixing_move, mixing_t
   implicit none
   private
   public :: mixed_step_t, mixed_step_begin, mixed_step_mix, mixed_step_shorten

   type :: mixed_step_t
      real(wp), allocatable :: old(:), new(:)    !! (n_row) multipliers before and after it
      !> (n_row) of friction: the normal force by a multiplier of 1 where the step is linearised;
      !> else 1
      real(wp), allocatable :: normal(:)
      logical :: is_taken = .false.      !! a part of it was, and friction has that normal force yet
      logical :: mixes = .false.                 !! the last one was mixed
      type(mixing_t), private :: mixing
      !> (n_unknown + n_row) the last one as it was made, with its multipliers as lengths [L]
      real(wp), allocatable, private :: made(:)
   end type mixed_step_t

contains

   !> None was made yet.
   pure subroutine mixed_step_begin(self, n_row)
      type(mixed_step_t), intent(inout) :: self
      integer, intent(in) :: n_row               !! of the set

      self%mixes = .false.
      self%is_taken = .false.
      if (allocated(self%old)) deallocate(self%old, self%new, self%normal)
      allocate(self%old(n_row), self%new(n_row), self%normal(n_row))
   end subroutine mixed_step_begin

   !> Mix `dq` and `new` with what was made before.
   subroutine mixed_step_mix(self, length, dq)
      type(mixed_step_t), intent(inout) :: self
      real(wp), intent(in) :: length             !! of a motion by a multiplier [T^2/M]
      real(wp), intent(inout), contiguous :: dq(:)   !! (n_unknown) correction [L]
      real(wp) :: found(size(dq) + size(self%old))

      found = [dq, length*(self%new - self%old)]
      if (.not. self%mixes) then
         call mixing_begin(self%mixing, size(found))
         self%made = 0.0_wp*found
      end if
      self%mixes = .true.
      call mixing_move(self%mixing, found, self%made)
      dq = self%made(:size(dq))
      self%new = self%old + self%made(size(dq) + 1:)/length
   end subroutine mixed_step_mix

   !> Only a part of the last one was made.
   pure subroutine mixed_step_shorten(self, part)
      type(mixed_step_t), intent(inout) :: self
      real(wp), intent(in) :: part               !! of it, at most 1

      if (self%mixes) self%made = part*self%made
   end subroutine mixed_step_shorten

end module emcon_mixed_step
