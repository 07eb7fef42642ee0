!> How far a run is, on standard output: one line that renews itself on a terminal, else a plain
!> line every few seconds.
module emcon_progress
   use, intrinsic :: iso_fortran_env, only : output_unit
   use emcon_files, only : is_terminal
   use emcon_kinds, only : dp
   use emcon_timer, only : wall_seconds
   implicit none
   private
   public :: progress_t, progress_start, progress_show, progress_say, progress_end, plain_interval

   !> Where the display stands.
   type :: progress_t
      private
      logical :: is_quiet = .true.
      logical :: is_terminal = .false.
      integer :: n_shown = 0             !! letters of the line on the terminal
      real(dp) :: time_started = 0.0_dp  !! wall clock [s]
      real(dp) :: time_shown = 0.0_dp
      real(dp) :: fraction_started = 0.0_dp
   end type progress_t

   real(dp), parameter :: terminal_interval = 0.1_dp, plain_interval = 5.0_dp   ! [s]

contains

   !> Begin at the part `fraction` of the run; show nothing ever if `is_quiet`.
   subroutine progress_start(self, fraction, is_quiet)
      type(progress_t), intent(out) :: self
      real(dp), intent(in) :: fraction               !! 0 unless the run is continued
      logical, intent(in) :: is_quiet

      self%is_quiet = is_quiet
      self%is_terminal = is_terminal()
      self%fraction_started = fraction
      self%time_started = wall_seconds()
      self%time_shown = self%time_started
      if (self%is_terminal) self%time_shown = self%time_started - terminal_interval
   end subroutine progress_start

   !> Show where the run is, if it is time to; call it after each increment.
   subroutine progress_show(self, fraction, time, h, n_newton, n_active)
      type(progress_t), intent(inout) :: self
      real(dp), intent(in) :: fraction               !! done, 0..1
      real(dp), intent(in) :: time, h                !! [T]
      integer, intent(in) :: n_newton                !! iterations of the increment
      integer, intent(in) :: n_active                !! active constraints
      character(len=160) :: line
      real(dp) :: now

      if (self%is_quiet) return
      now = wall_seconds()
      if (now - self%time_shown < merge(terminal_interval, plain_interval, self%is_terminal)) return
      write(line, "(f5.1, '%  t = ', a, '  h = ', a, '  Newton ', i0, '  active ', i0, a)") &
         100.0_dp*fraction, trim(short(time)), trim(short(h)), n_newton, n_active, &
         trim(time_left(self, now, fraction))
      call progress_say(self, trim(line))
   end subroutine progress_show

   !> Show a line of text.
   subroutine progress_say(self, text)
      type(progress_t), intent(inout) :: self
      character(len=*), intent(in) :: text

      if (self%is_quiet) return
      self%time_shown = wall_seconds()
      if (self%is_terminal) then
         ! Blanks wipe what a longer line left.
         call put(self, achar(13) // text // repeat(" ", max(0, self%n_shown - len(text))))
         self%n_shown = len(text)
      else
         call put(self, text // new_line("a"))
      end if
   end subroutine progress_say

   !> ", 1:05 left", from the pace so far; nothing while there is none.
   function time_left(self, now, fraction) result(text)
      type(progress_t), intent(in) :: self
      real(dp), intent(in) :: now                    !! wall clock [s]
      real(dp), intent(in) :: fraction
      character(len=31) :: text
      character(len=24) :: buffer
      real(dp) :: seconds, done
      integer :: n

      text = ""
      done = fraction - self%fraction_started
      if (done <= 0.0_dp) return
      seconds = (now - self%time_started)*(1.0_dp - fraction)/done
      if (seconds >= 1.0e8_dp) return
      n = nint(max(seconds, 0.0_dp))
      if (n >= 3600) then
         write(buffer, "(i0, ':', i2.2, ':', i2.2)") n/3600, mod(n/60, 60), mod(n, 60)
      else
         write(buffer, "(i0, ':', i2.2)") n/60, mod(n, 60)
      end if
      text = "  " // trim(buffer) // " left"
   end function time_left

   !> `value` with five significant digits.
   function short(value) result(text)
      real(dp), intent(in) :: value
      character(len=24) :: text

      write(text, "(g0.5)") value
   end function short

   !> Wipe the line on the terminal: what comes next begins on a fresh one.
   subroutine progress_end(self)
      type(progress_t), intent(inout) :: self

      if (self%n_shown > 0) then
         call put(self, achar(13) // repeat(" ", self%n_shown) // achar(13))
      end if
      self%n_shown = 0
   end subroutine progress_end

   !> Write to standard output; once nobody takes it any more, be quiet.
   subroutine put(self, text)
      type(progress_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer :: stat

      write(output_unit, "(a)", advance="no", iostat=stat) text
      if (stat == 0) flush(output_unit, iostat=stat)
      if (stat /= 0) self%is_quiet = .true.
   end subroutine put

end module emcon_progress
