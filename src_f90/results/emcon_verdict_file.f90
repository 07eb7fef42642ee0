!> The verdict for scripts, as JSON, and its running figures in a restart file.
module emcon_verdict_file
   use emcon_energy_watch, only : energy_watch_t
   use emcon_errors, only : error_t
   use emcon_files, only : file_close, file_open, file_put, file_remove, file_rename, file_t
   use emcon_force_scatter, only : force_scatter_t, scatter_of
   use emcon_json, only : json_number, json_text, json_texts
   use emcon_kinds, only : wp
   use emcon_march, only : march_t
   use emcon_nodal_pull, only : nodal_pull_share
   use emcon_restart_data, only : restart_exchange, restart_list, restart_offers, restart_t
   use emcon_stand_off, only : stand_off_mean
   use emcon_step_control, only : control_sizes, n_why, step_control_t, why_text
   use emcon_text, only : notes_t, string_t
   use emcon_verdict, only : verdict_end, verdict_is_good, verdict_jump_violation, &
      verdict_law_violation, verdict_t
   use emcon_version, only : precision_names, this_precision
   implicit none
   private
   public :: verdict_so_far, verdict_write, verdict_exchange

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

   !> Write the one line of the file `path`, with further members of the object. It appears under
   !> its name when it is whole.
   subroutine verdict_write(self, march, path, members, error)
      type(verdict_t), intent(in) :: self
      type(march_t), intent(in) :: march
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: members    !! as JSON has them, with commas between them
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: second
      type(file_t) :: file
      character(len=:), allocatable :: line

      call compose(self, march, line)
      line = line(:len(line) - 1) // ", " // members // "}"
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
      call json_texts(line, "reasons", self%reasons)
      call json_texts(line, "warnings", self%warnings)
      call json_number(line, "warning_count", real(self%n_warning, wp))
      call json_text(line, "message", self%message)
      call json_text(line, "precision", trim(precision_names(this_precision)))
      associate (state => march%state, ledger => march%ledger)
         call json_number(line, "increments", real(state%clock%increment, wp))
         call json_number(line, "time", state%clock%time)
         call json_number(line, "newton", real(self%count%newton, wp))
         call json_number(line, "cuts", real(self%count%cut, wp))
         call json_number(line, "guarded_increments", real(self%count%guarded, wp))
         call json_number(line, "kinetic", ledger%kinetic)
         call json_number(line, "strain", ledger%strain)
         call json_number(line, "external_work", ledger%external_work)
         call json_number(line, "contact_work", ledger%contact_work)
         call json_number(line, "stabilization", ledger%stabilization)
         call json_number(line, "restitution_loss", ledger%restitution)
         call json_number(line, "scheme_loss", ledger%decay)
         call json_number(line, "damping_loss", ledger%damping)
         call json_number(line, "friction_loss", ledger%friction)
         call json_number(line, "contact_damping_loss", ledger%contact_damping)
         call json_number(line, "contact_energy", ledger%contact_energy)
         call json_number(line, "total", ledger%total)
      end associate
      call json_number(line, "total_at_start", self%energy%at_start)
      call json_number(line, "largest_energy", self%energy%largest)
      call json_number(line, "largest_energy_error", self%energy%largest_error)
      call json_number(line, "penetration", self%overlap%deepest)
      call json_number(line, "penetration_time", self%overlap%time)
      call json_text(line, "penetration_place", self%overlap%place)
      if (self%penalty%give > 0.0_wp) then
         call json_number(line, "give", self%penalty%give)
         call json_number(line, "give_time", self%penalty%time)
      end if
      if (march%active%friction%is_on) then
         call json_number(line, "law_violation", verdict_law_violation(self))
         call json_number(line, "jump_violation", verdict_jump_violation(self))
      end if
      if (self%penalty%most_augmentations > 0) call json_number(line, "augmentations", &
         real(self%penalty%most_augmentations, wp))
      call add_forces(self, line)
      call json_number(line, "unconverged", self%unconverged)
      if (size(self%small%section) > 0) then
         call json_number(line, "linear_rotation", maxval(self%small%rotation))
         call json_number(line, "linear_strain", maxval(self%small%strain))
      end if
      call add_sizes(march%state%control, line)
      line = line // "}"
   end subroutine compose

   !> Where contact forces act, and how even they are.
   subroutine add_forces(self, line)
      type(verdict_t), intent(in) :: self
      character(len=:), allocatable, intent(inout) :: line

      call json_number(line, "stand_off", self%stand_off%largest)
      call json_number(line, "mean_stand_off", stand_off_mean(self%stand_off))
      if (size(self%scatter) > 0) call json_number(line, "force_scatter", &
         maxval(scatter_of(self%scatter)))
      if (self%nodal_pull%force > 0.0_wp) call json_number(line, "nodal_pull", &
         nodal_pull_share(self%nodal_pull))
   end subroutine add_forces

   !> Of a run whose increments choose their sizes: how many of which, and why some are smaller.
   subroutine add_sizes(control, line)
      type(step_control_t), intent(in) :: control
      character(len=:), allocatable, intent(inout) :: line
      type(notes_t) :: sizes
      integer :: k

      call control_sizes(control, sizes)
      if (sizes%n == 0) return
      call json_texts(line, "increment_sizes", sizes)
      do k = 1, n_why
         call json_number(line, "smaller_for_" // trim(why_text(k)), real(control%n_less(k), wp))
      end do
      call json_number(line, "increments_over_tolerance", real(control%n_over, wp))
      call json_number(line, "events", real(control%n_event, wp))
   end subroutine add_sizes

   !> Put the running figures into `restart`, or go on with those that it has.
   subroutine verdict_exchange(self, restart)
      type(verdict_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart

      call exchange_energy(self%energy, restart)
      call restart_exchange(restart, "verdict", self%overlap%deepest)
      call restart_exchange(restart, "verdict", self%overlap%time)
      call restart_exchange(restart, "verdict", self%unconverged)
      call restart_exchange(restart, "verdict", self%unconverged_time)
      call restart_exchange(restart, "verdict", self%stand_off%largest)
      call restart_exchange(restart, "verdict", self%stand_off%impulse)
      call restart_exchange(restart, "verdict", self%stand_off%impulse_gap)
      call restart_exchange(restart, "effort", self%count%newton)
      call restart_exchange(restart, "effort", self%count%cut)
      call restart_exchange(restart, "effort", self%n_warning)
      call restart_exchange(restart, "effort", self%count%guarded)
      call restart_exchange(restart, "pair_largest", self%largest_force)
      if (restart_offers(restart, "linear_range", size(self%small%section) > 0)) then
         call restart_exchange(restart, "linear_range", self%small%rotation)
         call restart_exchange(restart, "linear_strain", self%small%strain)
      end if
      if (restart_offers(restart, "give", self%penalty%give > 0.0_wp &
         .or. self%penalty%most_augmentations > 0)) then
         call restart_exchange(restart, "give", self%penalty%give)
         call restart_exchange(restart, "give", self%penalty%time)
         call restart_exchange(restart, "give_is_meant", self%penalty%is_meant)
         call restart_exchange(restart, "augmentations", self%penalty%most_augmentations)
      end if
      if (restart_offers(restart, "law_missed", self%largest_push > 0.0_wp)) then
         call restart_exchange(restart, "law_missed", self%law_missed)
         call restart_exchange(restart, "law_missed", self%largest_push)
         call restart_exchange(restart, "law_missed", self%jump_missed)
      end if
      if (restart_offers(restart, "nodal_pull", self%nodal_pull%force > 0.0_wp)) then
         call restart_exchange(restart, "nodal_pull", self%nodal_pull%pull)
         call restart_exchange(restart, "nodal_pull", self%nodal_pull%force)
      end if
      call exchange_scatter(self%scatter, restart)
      call exchange_texts(self, restart)
   end subroutine verdict_exchange

   !> The figures of the energy balance.
   subroutine exchange_energy(energy, restart)
      type(energy_watch_t), intent(inout) :: energy
      type(restart_t), intent(inout) :: restart

      call restart_exchange(restart, "verdict", energy%at_start)
      call restart_exchange(restart, "verdict", energy%largest)
      call restart_exchange(restart, "verdict", energy%largest_error)
      call restart_exchange(restart, "verdict", energy%reference)
      call restart_exchange(restart, "verdict", energy%dynamic_error)
      call restart_exchange(restart, "verdict", energy%shown_reference)
      call restart_exchange(restart, "verdict", energy%shown_error)
      call restart_exchange(restart, "verdict", energy%contact_reference)
      call restart_exchange(restart, "verdict", energy%contact_made)
      call restart_exchange(restart, "verdict", energy%contact_kept)
      call restart_exchange(restart, "verdict", energy%contact_before)
      call restart_exchange(restart, "verdict", energy%contact_sum)
      call restart_exchange(restart, "verdict", energy%contact_taken)
      call restart_exchange(restart, "verdict", energy%stabilization)
      call restart_exchange(restart, "verdict", energy%scale)
      call restart_exchange(restart, "effort", energy%has_dynamics)
      call restart_exchange(restart, "effort", energy%has_explicit)
   end subroutine exchange_energy

   !> How the force of each pair scatters.
   subroutine exchange_scatter(scatter, restart)
      type(force_scatter_t), intent(inout) :: scatter(:)   !! (pairs)
      type(restart_t), intent(inout) :: restart
      integer :: p

      do p = 1, size(scatter)
         call restart_exchange(restart, "force_scatter", scatter(p)%last)
         call restart_exchange(restart, "force_scatter", scatter(p)%before)
         call restart_exchange(restart, "force_scatter", scatter(p)%force)
         call restart_exchange(restart, "force_scatter", scatter(p)%off)
         call restart_exchange(restart, "force_counts", scatter(p)%n_force)
         call restart_exchange(restart, "force_counts", scatter(p)%n_dip)
         call restart_exchange(restart, "force_counts", scatter(p)%n_open)
         call restart_exchange(restart, "force_counts", scatter(p)%is_falling)
      end do
   end subroutine exchange_scatter

   !> Place and warnings, which are in the file only if there are some.
   subroutine exchange_texts(self, restart)
      type(verdict_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart
      type(string_t), allocatable :: place(:), warning(:)

      allocate(place(merge(1, 0, allocated(self%overlap%place))))
      if (size(place) > 0) place(1)%text = self%overlap%place
      if (restart_offers(restart, "deepest_place", size(place) > 0)) then
         call restart_list(restart, "deepest_place", place)
         self%overlap%place = place(1)%text
      end if
      allocate(warning(self%warnings%n))
      if (size(warning) > 0) warning = self%warnings%item(:size(warning))
      if (restart_offers(restart, "warnings", size(warning) > 0)) then
         call restart_list(restart, "warnings", warning)
         self%warnings = notes_t(size(warning), warning)
      end if
   end subroutine exchange_texts

end module emcon_verdict_file
