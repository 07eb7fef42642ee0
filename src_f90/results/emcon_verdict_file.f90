!> The verdict for scripts, as JSON, and its running figures in a restart file.
module emcon_verdict_file
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : error_t
   use emcon_files, only : file_close, file_open, file_put, file_remove, file_rename, file_t
   use emcon_kinds, only : wp
   use emcon_march, only : march_t
   use emcon_restart, only : restart_get, restart_put, restart_size, restart_t
   use emcon_stand_off, only : stand_off_mean
   use emcon_text, only : notes_t, string_t, to_text
   use emcon_verdict, only : verdict_end, verdict_is_good, verdict_t
   implicit none
   private
   public :: verdict_so_far, verdict_write, verdict_save, verdict_load

   !> Digits that are written of a number.
   integer, parameter :: n_digit = 9

contains

   !> The verdict on the increments so far, as `line` of JSON, as if the run ended here.
   subroutine verdict_so_far(self, march, line, is_good)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      character(len=:), allocatable, intent(out) :: line
      logical, intent(out) :: is_good
      type(verdict_t) :: ended

      ended = self
      call verdict_end(ended)
      call compose(ended, march, line)
      is_good = verdict_is_good(ended)
   end subroutine verdict_so_far

   !> Write the one line of the file `path`. It appears under its name when it is whole.
   subroutine verdict_write(self, march, path, error)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: second
      type(file_t) :: file
      character(len=:), allocatable :: line

      call compose(self, march, line)
      call file_open(file, path // ".tmp", "w", error)
      if (allocated(error)) return
      call file_put(file, line // achar(10), error)
      call file_close(file, second)
      if (.not. allocated(error)) call move_alloc(second, error)
      if (.not. allocated(error)) call file_rename(path // ".tmp", path, error)
      if (allocated(error)) call file_remove(path // ".tmp", second)
   end subroutine verdict_write

   !> All that is known, as one JSON object.
   subroutine compose(self, march, line)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      character(len=:), allocatable, intent(out) :: line

      line = '{"verdict": "bad"'
      if (verdict_is_good(self)) line = '{"verdict": "good"'
      if (.not. self%is_complete) line = '{"verdict": "not completed"'
      call add_texts(line, "reasons", self%reasons)
      call add_texts(line, "warnings", self%warnings)
      call add_number(line, "warning_count", real(self%n_warning, wp))
      line = line // ', "message": '
      call add_quoted(line, self%message)
      associate (state => march%state, ledger => march%ledger)
         call add_number(line, "increments", real(state%increment, wp))
         call add_number(line, "time", state%time)
         call add_number(line, "newton", real(self%n_newton, wp))
         call add_number(line, "cuts", real(self%n_cut, wp))
         call add_number(line, "guarded_increments", real(self%n_guarded, wp))
         call add_number(line, "held_increments", real(self%n_held, wp))
         call add_number(line, "held_contacts", real(self%most_held, wp))
         call add_number(line, "kinetic", ledger%kinetic)
         call add_number(line, "strain", ledger%strain)
         call add_number(line, "external_work", ledger%external_work)
         call add_number(line, "contact_work", ledger%contact_work)
         call add_number(line, "stabilization", ledger%stabilization)
         call add_number(line, "total", ledger%total)
      end associate
      call add_number(line, "total_at_start", self%total0)
      call add_number(line, "largest_energy", self%largest_energy)
      call add_number(line, "largest_energy_error", self%largest_drift)
      call add_number(line, "penetration", self%deepest)
      call add_number(line, "penetration_time", self%deepest_time)
      line = line // ', "penetration_place": '
      call add_quoted(line, self%place)
      call add_number(line, "stand_off", self%stand_off%largest)
      call add_number(line, "mean_stand_off", stand_off_mean(self%stand_off))
      call add_number(line, "unconverged", self%unconverged)
      line = line // "}"
   end subroutine compose

   !> Append a number; null where it is none.
   subroutine add_number(line, name, value)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value

      line = line // ', "' // name // '": '
      if (ieee_is_finite(value)) then
         line = line // to_text(value, n_digit)
      else
         line = line // "null"
      end if
   end subroutine add_number

   !> Append a list of texts.
   subroutine add_texts(line, name, texts)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name
      type(notes_t), intent(in) :: texts
      integer :: i

      line = line // ', "' // name // '": ['
      do i = 1, texts%n
         if (i > 1) line = line // ", "
         call add_quoted(line, texts%item(i)%text)
      end do
      line = line // "]"
   end subroutine add_texts

   !> Append `text` between quotes, with the escapes of JSON.
   pure subroutine add_quoted(line, text)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: text
      integer :: i

      line = line // '"'
      do i = 1, len(text)
         if (text(i:i) == '"' .or. text(i:i) == achar(92)) line = line // achar(92)
         line = line // merge(" ", text(i:i), iachar(text(i:i)) < iachar(" "))
      end do
      line = line // '"'
   end subroutine add_quoted

   !> Put the running figures into `restart`.
   subroutine verdict_save(self, restart)
      type(verdict_t), intent(in) :: self
      type(restart_t), intent(inout) :: restart
      type(string_t) :: place(1)

      call restart_put(restart, "verdict", [self%total0, self%largest_energy, &
         self%largest_drift, self%reference, self%dynamic_drift, self%deepest, &
         self%deepest_time, self%unconverged, self%unconverged_time, self%stand_off%largest, &
         self%stand_off%impulse, self%stand_off%impulse_gap])
      call restart_put(restart, "effort", [self%n_newton, self%n_cut, self%n_warning, &
         merge(1, 0, self%has_dynamics), self%n_guarded, self%n_held, self%most_held])
      call restart_put(restart, "pair_largest", self%largest_force)
      if (allocated(self%place)) then
         place(1)%text = self%place
         call restart_put(restart, "deepest_place", place)
      end if
      if (self%warnings%n > 0) call restart_put(restart, "warnings", &
         self%warnings%item(:self%warnings%n))
   end subroutine verdict_save

   !> Go on with the running figures in `restart`.
   subroutine verdict_load(self, restart, error)
      type(verdict_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: text(:)
      real(wp) :: figure(12)
      integer :: effort(7)

      call restart_get(restart, "verdict", figure, error)
      if (.not. allocated(error)) call restart_get(restart, "effort", effort, error)
      if (allocated(error)) return
      self%total0 = figure(1)
      self%largest_energy = figure(2)
      self%largest_drift = figure(3)
      self%reference = figure(4)
      self%dynamic_drift = figure(5)
      self%deepest = figure(6)
      self%deepest_time = figure(7)
      self%unconverged = figure(8)
      self%unconverged_time = figure(9)
      self%stand_off%largest = figure(10)
      self%stand_off%impulse = figure(11)
      self%stand_off%impulse_gap = figure(12)
      self%n_newton = effort(1)
      self%n_cut = effort(2)
      self%n_guarded = effort(5)
      self%n_held = effort(6)
      self%most_held = effort(7)
      self%n_warning = effort(3)
      self%has_dynamics = effort(4) == 1
      call restart_get(restart, "pair_largest", self%largest_force, error)
      if (.not. allocated(error) .and. restart_size(restart, "deepest_place") > 0) then
         call restart_get(restart, "deepest_place", text, error)
         if (.not. allocated(error)) self%place = text(1)%text
      end if
      if (allocated(error) .or. restart_size(restart, "warnings") < 0) return
      call restart_get(restart, "warnings", text, error)
      if (.not. allocated(error)) self%warnings = notes_t(size(text), text)
   end subroutine verdict_load

end module emcon_verdict_file
