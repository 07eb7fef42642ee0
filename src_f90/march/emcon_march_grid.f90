!> The grid of increments of a step: times are counted in integers, and meet its end exactly.
module emcon_march_grid
   use emcon_kinds, only : int64, wp
   use emcon_march_types, only : march_t
   use emcon_scene, only : scene_t
   use emcon_step_control, only : most_power
   use emcon_steps, only : step_t
   implicit none
   private
   public :: march_count_grid, march_count_increments, march_grid_time, march_is_done, &
      march_set_time, march_part_time, march_size, grid_whole, easy_increments

   !> An increment is halved so often at most, unless the deck gives h_min.
   integer, parameter :: default_levels = 12, most_levels = 24
   !> So often for its error.
   integer, parameter :: error_levels = 6
   !> Increments without a cut after which an automatic increment is doubled.
   integer, parameter :: easy_increments = 5
   !> Closer than this a step's duration counts as a whole number of increments.
   real(wp), parameter :: grid_whole = 1.0e3_wp*epsilon(1.0_wp)

contains

   !> Grid increments in the step, and by how much they may grow and shrink.
   pure subroutine march_count_grid(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      real(wp) :: ratio, h_max

      ratio = step%duration/step%h
      self%n_grid = nint(ratio)
      if (abs(ratio - real(self%n_grid, wp)) > grid_whole*ratio) self%n_grid = ceiling(ratio)
      self%n_grid = max(1, self%n_grid)
      h_max = step%h_max
      if (.not. h_max > 0.0_wp) then
         h_max = merge(step%h, step%duration, step%scheme%masses_resist)
      end if
      self%most_stride = 1
      if (.not. step%is_direct) then
         do while (2*self%most_stride*step%h <= h_max .and. self%most_stride < self%n_grid)
            self%most_stride = 2*self%most_stride
         end do
      end if
      self%n_level = default_levels
      if (step%h_min > 0.0_wp) then
         self%n_level = max(0, min(most_levels, exponent(step%h/step%h_min) - 1))
      end if
      call count_units(self, step)
   end subroutine march_count_grid

   !> Units of time of a step whose increments follow the error or end at events.
   pure subroutine count_units(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer :: n, power

      self%judges_size = .false.
      self%is_controlled = step%scheme%masses_resist .and. .not. step%scheme%is_explicit .and. &
         (step%tolerance > 0.0_wp .or. step%event_fraction > 0.0_wp)
      if (.not. self%is_controlled) return
      self%h_deck = step%h
      n = self%n_level
      if (step%event_fraction > 0.0_wp) n = max(n, min(most_levels, &
         1 - exponent(step%event_fraction)))
      self%n_unit = 2_int64**n
      self%n_least = 2_int64**(n - self%n_level)
      self%n_window = 0
      if (step%event_fraction > 0.0_wp) self%n_window = max(1_int64, &
         int(step%event_fraction*real(self%n_unit, wp), int64))
      power = exponent(real(self%most_stride, wp)) - 1
      if (step%tolerance > 0.0_wp .and. .not. step%h_max > 0.0_wp) power = &
         exponent(real(self%n_grid, wp)) - 1
      self%largest_power = min(power, most_power)
      self%least_power = -self%n_level
      if (.not. step%h_min > 0.0_wp) self%least_power = -min(self%n_level, error_levels)
   end subroutine count_units

   !> Increments of a step in which none is cut.
   pure integer function march_count_increments(step) result(n)
      type(step_t), intent(in) :: step
      type(march_t) :: march
      integer :: done, stride

      call march_count_grid(march, step)
      n = 0
      done = 0
      stride = 1
      do while (done < march%n_grid)
         done = done + stride
         n = n + 1
         if (mod(n, easy_increments) == 0) stride = min(2*stride, march%most_stride)
      end do
   end function march_count_increments

   !> Is the last increment of the step done?
   pure logical function march_is_done(self)
      type(march_t), intent(in) :: self

      march_is_done = self%state%n_grid >= self%n_grid
   end function march_is_done

   !> Time since the start of the step at grid point `n`.
   pure real(wp) function march_grid_time(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: n                   !! >= 0

      march_grid_time = real(n, wp)*step%h
      if (n >= self%n_grid) march_grid_time = step%duration
   end function march_grid_time

   !> Time since the start of the step after `n` units.
   pure real(wp) function march_part_time(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer(int64), intent(in) :: n            !! >= 0
      integer :: whole
      real(wp) :: part

      whole = int(n/self%n_unit)
      march_part_time = march_grid_time(self, step, whole)
      if (mod(n, self%n_unit) == 0) return
      part = real(mod(n, self%n_unit), wp)/real(self%n_unit, wp)
      march_part_time = march_part_time + part*interval(self, step, whole)
   end function march_part_time

   !> Size of the interval of the grid after point `n` [T]: the last one may be shorter than h.
   pure real(wp) function interval(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: n                   !! >= 0

      interval = step%h
      if (n < self%n_grid - 1 .or. abs(real(self%n_grid, wp)*step%h - step%duration) &
         <= grid_whole*step%duration) return
      interval = step%duration - real(n, wp)*step%h
   end function interval

   !> Size of an increment of `n` units after the first `from` [T]: where it can be without the
   !> rounding of times.
   pure real(wp) function march_size(self, step, from, n) result(h)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer(int64), intent(in) :: from, n      !! >= 0, > 0
      integer :: first, last

      first = int(from/self%n_unit)
      last = int((from + n - 1)/self%n_unit)
      h = real(n, wp)/real(self%n_unit, wp)*interval(self, step, last)
      if (last == first .or. last < self%n_grid - 1) return
      if (interval(self, step, last) < step%h) h = march_part_time(self, step, from + n) &
         - march_part_time(self, step, from)
   end function march_size

   !> Let the state be that of `time` since the start of the step [T]. What differs by no more than
   !> the rounding of sums from a point of the grid is that point.
   subroutine march_set_time(self, scene, time)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: time               !! >= 0 [T]
      integer :: n

      associate (state => self%state, step => scene%step(self%state%i_step))
         n = self%n_grid
         if (time < step%duration) n = min(n, nint(time/step%h))
         if (n == self%n_grid - 1 .and. is_same(time, step%duration)) n = self%n_grid
         state%is_off_grid = .not. is_same(time, march_grid_time(self, step, n))
         state%step_time = time
         if (.not. state%is_off_grid) state%step_time = march_grid_time(self, step, n)
         if (state%step_time < march_grid_time(self, step, n)) n = n - 1
         state%n_grid = n
         state%n_part = 0
         state%time = state%start_time + state%step_time
      end associate

   contains

      pure logical function is_same(a, b)
         real(wp), intent(in) :: a, b

         is_same = abs(a - b) <= grid_whole*b
      end function is_same

   end subroutine march_set_time

end module emcon_march_grid
