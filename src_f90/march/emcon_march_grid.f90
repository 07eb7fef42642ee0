! build: holder
!> The grid of increments of a step: times are counted in integers, and meet its end exactly.
module emcon_march_grid
   use emcon_kinds, only : int64, wp
   use emcon_march_types, only : grid_corner_t, march_t
   use emcon_scene, only : scene_t
   use emcon_step_control, only : most_power
   use emcon_steps, only : step_is_dynamic, step_t
   implicit none
   private
   public :: march_count_grid, march_count_increments, march_grid_time, march_is_done, &
      march_next_corner, march_set_time, march_part_time, march_size, march_span, easy_increments

   !> An increment is halved so often at most, unless the deck gives h_min.
   integer, parameter :: default_levels = 12, most_levels = 24
   !> With STABILIZE down to 2/`finest` of the time of its stress.
   real(wp), parameter :: finest = 16.0_wp
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
      real(wp) :: h_max

      call count_points(self, step)
      h_max = step%time%h_max
      if (.not. h_max > 0.0_wp) then
         h_max = merge(step%time%h, step%time%duration, step_is_dynamic(step))
      end if
      self%grid%most_stride = 1
      if (.not. step%time%is_direct) then
         do while (2*self%grid%most_stride*step%time%h <= h_max &
            .and. self%grid%most_stride < self%grid%n_grid)
            self%grid%most_stride = 2*self%grid%most_stride
         end do
      end if
      self%grid%n_level = default_levels
      if (step%time%h_min > 0.0_wp) then
         self%grid%n_level = max(0, min(most_levels, exponent(step%time%h/step%time%h_min) - 1))
      end if
      ! What viscous stress holds on its way moves in its time, not in that of the load.
      if (step%stabilization > 0.0_wp) self%grid%n_level = max(self%grid%n_level, &
         min(most_levels, exponent(finest/step%stabilization)))
      call count_units(self, step)
   end subroutine march_count_grid

   !> Number the points of the grid: whole increments and the end of the step, and of increments
   !> that are automatic the corners of amplitudes too, so that none of them passes one.
   pure subroutine count_points(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(grid_corner_t) :: next
      integer :: i

      if (allocated(self%grid%corner)) deallocate(self%grid%corner)
      allocate(self%grid%corner(0))
      if (allocated(step%time%corner) .and. .not. (step%time%is_direct &
         .or. self%explicit%is_on)) then
         do i = 1, size(step%time%corner)
            next = point_at(self, step, step%time%corner(i))
            if (next%n > last_point(self)) self%grid%corner = [self%grid%corner, next]
         end do
      end if
      next = point_at(self, step, step%time%duration)
      self%grid%n_grid = max(1, next%n)
   end subroutine count_points

   !> The point of the grid at `time`, after all corners so far.
   pure function point_at(self, step, time) result(point)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: time               !! since the start of the step, > 0 [T]
      type(grid_corner_t) :: point, base
      real(wp) :: ratio
      integer :: n

      base = base_of(self, huge(n))
      ratio = (time - base%time)/step%time%h
      n = nint(ratio)
      point%is_between = abs(ratio - real(n, wp)) > grid_whole*(time/step%time%h)
      if (point%is_between) n = ceiling(ratio)
      point%n = base%n + n
      point%time = time
   end function point_at

   pure integer function last_point(self)
      type(march_t), intent(in) :: self

      last_point = 0
      if (size(self%grid%corner) > 0) last_point = self%grid%corner(size(self%grid%corner))%n
   end function last_point

   !> Where the whole increments begin that reach point `n`: the last corner between such, or the
   !> start of the step.
   pure function base_of(self, n) result(base)
      type(march_t), intent(in) :: self
      integer, intent(in) :: n                   !! >= 0
      type(grid_corner_t) :: base
      integer :: i

      do i = size(self%grid%corner), 1, -1
         if (.not. self%grid%corner(i)%is_between .or. self%grid%corner(i)%n > n) cycle
         base = self%grid%corner(i)
         return
      end do
   end function base_of

   !> The first corner after grid point `n`, or the end of the step.
   pure integer function march_next_corner(self, n) result(next)
      type(march_t), intent(in) :: self
      integer, intent(in) :: n                   !! >= 0
      integer :: i

      next = self%grid%n_grid
      do i = size(self%grid%corner), 1, -1
         if (self%grid%corner(i)%n <= n) return
         next = self%grid%corner(i)%n
      end do
   end function march_next_corner

   !> Units of time of a step whose increments follow the error or end at events.
   pure subroutine count_units(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer :: n, power

      self%grid%is_controlled = step_is_dynamic(step) &
         .and. .not. self%explicit%is_on .and. (step%time%tolerance > 0.0_wp &
         .or. step%time%event_fraction > 0.0_wp)
      if (.not. self%grid%is_controlled) return
      self%grid%h_deck = step%time%h
      n = self%grid%n_level
      if (step%time%event_fraction > 0.0_wp) n = max(n, min(most_levels, &
         1 - exponent(step%time%event_fraction)))
      self%grid%n_unit = 2_int64**n
      self%grid%n_least = 2_int64**(n - self%grid%n_level)
      self%grid%n_window = 0
      if (step%time%event_fraction > 0.0_wp) self%grid%n_window = max(1_int64, &
         int(step%time%event_fraction*real(self%grid%n_unit, wp), int64))
      power = exponent(real(self%grid%most_stride, wp)) - 1
      if (step%time%tolerance > 0.0_wp .and. .not. step%time%h_max > 0.0_wp) power = &
         exponent(real(self%grid%n_grid, wp)) - 1
      self%grid%largest_power = min(power, most_power)
      self%grid%least_power = -self%grid%n_level
      if (.not. step%time%h_min > 0.0_wp) self%grid%least_power = -min(self%grid%n_level, &
         error_levels)
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
      do while (done < march%grid%n_grid)
         done = min(done + stride, march_next_corner(march, done))
         n = n + 1
         if (mod(n, easy_increments) == 0) stride = min(2*stride, march%grid%most_stride)
      end do
   end function march_count_increments

   !> Is the last increment of the step done?
   pure logical function march_is_done(self)
      type(march_t), intent(in) :: self

      march_is_done = self%state%clock%n_grid >= self%grid%n_grid
   end function march_is_done

   !> Time since the start of the step at grid point `n`.
   pure real(wp) function march_grid_time(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: n                   !! >= 0

      type(grid_corner_t) :: base

      base = base_of(self, n)
      march_grid_time = base%time + real(n - base%n, wp)*step%time%h
      if (n >= self%grid%n_grid) march_grid_time = step%time%duration
   end function march_grid_time

   !> Time since the start of the step after `n` units.
   pure real(wp) function march_part_time(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer(int64), intent(in) :: n            !! >= 0
      integer :: whole
      real(wp) :: part

      whole = int(n/self%grid%n_unit)
      march_part_time = march_grid_time(self, step, whole)
      if (mod(n, self%grid%n_unit) == 0) return
      part = real(mod(n, self%grid%n_unit), wp)/real(self%grid%n_unit, wp)
      march_part_time = march_part_time + part*interval(self, step, whole)
   end function march_part_time

   !> Size of the interval of the grid after point `n` [T]: the last one, and one before a corner,
   !> may be shorter than h.
   pure real(wp) function interval(self, step, n)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: n                   !! >= 0

      real(wp) :: start, finish

      interval = step%time%h
      start = march_grid_time(self, step, n)
      finish = march_grid_time(self, step, n + 1)
      if (finish - start < step%time%h - grid_whole*finish) interval = finish - start
   end function interval

   !> Size of an increment from grid point `n` to `n_end`, with no corner between [T]: where it can
   !> be without the rounding of times.
   pure real(wp) function march_span(self, step, n, n_end) result(h)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: n, n_end            !! >= 0, > n

      h = real(n_end - n, wp)*step%time%h
      if (interval(self, step, n_end - 1) < step%time%h) h = march_grid_time(self, step, n_end) &
         - march_grid_time(self, step, n)
   end function march_span

   !> Size of an increment of `n` units after the first `from`, with no corner between [T]: where it
   !> can be without the rounding of times.
   pure real(wp) function march_size(self, step, from, n) result(h)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      integer(int64), intent(in) :: from, n      !! >= 0, > 0
      integer :: first, last

      first = int(from/self%grid%n_unit)
      last = int((from + n - 1)/self%grid%n_unit)
      h = real(n, wp)/real(self%grid%n_unit, wp)*interval(self, step, last)
      if (last == first) return
      if (interval(self, step, last) < step%time%h) h = march_part_time(self, step, from + n) &
         - march_part_time(self, step, from)
   end function march_size

   !> Let the state be that of `time` since the start of the step [T]. What differs by no more than
   !> the rounding of sums from a point of the grid is that point.
   subroutine march_set_time(self, scene, time)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: time               !! >= 0 [T]
      type(grid_corner_t) :: base
      integer :: n

      associate (state => self%state, step => scene%step(self%state%clock%i_step))
         n = self%grid%n_grid
         base = base_before(time)
         if (time < step%time%duration) n = min(n, base%n + nint((time - base%time)/step%time%h))
         if (n == self%grid%n_grid - 1 .and. is_same(time, step%time%duration)) n = self%grid%n_grid
         state%clock%is_off_grid = .not. is_same(time, march_grid_time(self, step, n))
         state%clock%step_time = time
         if (.not. state%clock%is_off_grid) state%clock%step_time = march_grid_time(self, step, n)
         if (state%clock%step_time < march_grid_time(self, step, n)) n = n - 1
         state%clock%n_grid = n
         state%clock%n_part = 0
         state%clock%time = state%clock%start_time + state%clock%step_time
      end associate

   contains

      !> Where the whole increments begin that lead to `time`.
      pure function base_before(time) result(base)
         real(wp), intent(in) :: time
         type(grid_corner_t) :: base
         integer :: i

         do i = size(self%grid%corner), 1, -1
            base = base_of(self, self%grid%corner(i)%n)
            if (base%time <= (1.0_wp + grid_whole)*time) return
         end do
         base = grid_corner_t()
      end function base_before

      pure logical function is_same(a, b)
         real(wp), intent(in) :: a, b

         is_same = abs(a - b) <= grid_whole*b
      end function is_same

   end subroutine march_set_time

end module emcon_march_grid
