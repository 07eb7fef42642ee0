!> The grid of increments: points, corners and the end of a step, all of them dyadic numbers.
module test_march_grid
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : int64, wp
   use emcon_march_grid, only : march_count_grid, march_count_increments, march_grid_time, &
      march_next_corner, march_part_time, march_set_time, march_size, march_span
   use emcon_march_types, only : march_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, make_block
   implicit none
   private
   public :: collect_march_grid

   real(wp), parameter :: h = 0.25_wp
   integer, parameter :: n = 8
   !> Corners at points 1 and 5 and at the end, and between two at point 3; the last interval is
   !> shorter.
   real(wp), parameter :: time(0:n) = [0.0_wp, 0.25_wp, 0.5_wp, 0.625_wp, 0.875_wp, 1.125_wp, &
      1.375_wp, 1.625_wp, 1.8125_wp]

contains

   subroutine collect_march_grid(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("points and corners", test_points), &
         test_case_t("units between the points", test_units), &
         test_case_t("units late in a long step", test_late), &
         test_case_t("a time that is set", test_set), &
         test_case_t("sizes that the error asks for", test_sizes), &
         test_case_t("increments of a step", test_count)]
   end subroutine collect_march_grid

   subroutine make_step(scene, march, is_direct)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      logical, intent(in) :: is_direct
      type(block_t) :: block

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., h, 1)
      associate (step => scene%step(1))
         step%time%is_direct = is_direct
         step%time%duration = time(n)
         step%time%corner = time([1, 3, 5, n])
         step%time%tolerance = 1.0e-3_wp
         call march_count_grid(march, step)
      end associate
   end subroutine make_step

   subroutine test_points(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: next(0:n - 1) = [1, 3, 3, 5, 5, 8, 8, 8]
      type(scene_t) :: scene
      type(march_t) :: march
      integer :: i, k

      call make_step(scene, march, .false.)
      associate (step => scene%step(1))
         call check_equal(error, march%grid%n_grid, n, "points")
         call check_equal(error, [(march_next_corner(march, i), i = 0, n - 1)], next, "next corner")
         call check_near(error, [(march_grid_time(march, step, i), i = 0, n)], time, 0.0_wp, &
            1.0_wp, "times")
         do i = 0, n - 1
            call check_near(error, [(march_span(march, step, i, k), k = i + 1, next(i))], &
               time(i + 1:next(i)) - time(i), 0.0_wp, 1.0_wp, "spans from point " // to_text(i))
         end do
      end associate
      call make_step(scene, march, .true.)
      call check_equal(error, march%grid%n_grid, n, "points of increments of a given size")
      call check_near(error, march_grid_time(march, scene%step(1), 3), 3.0_wp*h, 0.0_wp, 1.0_wp, &
         "which no corner moves")
   end subroutine test_points

   !> In each interval at each quarter, and from there to each quarter before the next corner.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      integer :: i, k, last
      integer(int64) :: quarter

      call make_step(scene, march, .false.)
      quarter = march%grid%n_unit/4
      call check_true(error, 4*quarter == march%grid%n_unit .and. quarter > 0, "units")
      do i = 0, 4*n - 1
         call check_near(error, march_part_time(march, scene%step(1), i*quarter), at(i), 0.0_wp, &
            1.0_wp, "time at quarter " // to_text(i))
         last = 4*march_next_corner(march, i/4)
         do k = i + 1, last
            ! Within an interval any; beyond, whole ones.
            if (k > 4*(i/4) + 4 .and. (mod(i, 4) > 0 .or. mod(k, 4) > 0)) cycle
            call check_near(error, march_size(march, scene%step(1), i*quarter, (k - i)*quarter), &
               at(k) - at(i), 0.0_wp, 1.0_wp, "quarters " // to_text(i) // " to " // to_text(k))
         end do
      end do

   contains

      pure real(wp) function at(i)
         integer, intent(in) :: i                !! quarters

         at = time(i/4)
         if (mod(i, 4) > 0) at = at + 0.25_wp*mod(i, 4)*(time(i/4 + 1) - time(i/4))
      end function at

   end subroutine test_units

   !> Quarters of the last interval, which is shorter, after a thousand: they are quarters of it,
   !> not differences of times, whose rounding is a thousand times theirs.
   subroutine test_late(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(block_t) :: block
      real(wp) :: whole
      integer :: k
      integer(int64) :: first, quarter

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      associate (step => scene%step(1), grid => march%grid)
         step%time%is_direct = .false.
         step%time%duration = 100.03_wp
         step%time%tolerance = 1.0e-3_wp
         call march_count_grid(march, step)
         call check_equal(error, grid%n_grid, 1001, "intervals")
         first = (grid%n_grid - 1)*grid%n_unit
         quarter = grid%n_unit/4
         whole = march_size(march, step, first, grid%n_unit)
         call check_near(error, whole, 0.03_wp, 4.0_wp*epsilon(1.0_wp), step%time%duration, "last")
         do k = 0, 3
            call check_near(error, march_size(march, step, first + k*quarter, quarter), &
               0.25_wp*whole, 2.0_wp*epsilon(1.0_wp), whole, "quarter " // to_text(k + 1))
         end do
      end associate
   end subroutine test_late

   !> Of twenty increments: halved down to h_min, else six times for the error and twelve in all;
   !> doubled up to h_max, else to the whole step. Events lie in a part of the increment, which has
   !> as many units as that takes.
   subroutine test_sizes(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: h_min(6) = [0.0_wp, 0.25_wp, 0.01_wp, 0.0_wp, 0.25_wp, 2.0_wp]
      real(wp), parameter :: h_max(6) = [0.0_wp, 5.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 1.0_wp]
      real(wp), parameter :: tolerance(6) = [1.0e-3_wp, 1.0e-3_wp, 1.0e-3_wp, 0.0_wp, 0.0_wp, &
         1.0e-3_wp]
      real(wp), parameter :: window(6) = [0.0_wp, 0.0_wp, 0.0_wp, 1.5e-4_wp, 0.125_wp, 0.01_wp]
      integer, parameter :: n_level(6) = [12, 2, 6, 12, 2, 0]
      integer, parameter :: n_unit(6) = [4096, 4, 64, 8192, 8, 128]
      integer, parameter :: n_least(6) = [1, 1, 1, 2, 2, 128]
      integer, parameter :: n_window(6) = [0, 0, 0, 1, 1, 1]
      integer, parameter :: least(6) = [-6, -2, -6, -6, -2, 0]
      integer, parameter :: largest(6) = [4, 2, 4, 0, 1, 0]
      type(scene_t) :: scene
      type(march_t) :: march
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., 1.0_wp, 20)
      associate (step => scene%step(1), grid => march%grid)
         do k = 1, size(h_min)
            step%time%is_direct = .false.
            step%time%h_min = h_min(k)
            step%time%h_max = h_max(k)
            step%time%tolerance = tolerance(k)
            step%time%event_fraction = window(k)
            call march_count_grid(march, step)
            call check_true(error, grid%is_controlled, "controlled")
            call check_near(error, grid%h_deck, 1.0_wp, 0.0_wp, 1.0_wp, "increment")
            call check_equal(error, [grid%n_level, int([grid%n_unit, grid%n_least, &
               grid%n_window]), grid%least_power, grid%largest_power], [n_level(k), n_unit(k), &
               n_least(k), n_window(k), least(k), largest(k)], "sizes " // to_text(k))
         end do
         step%time%event_fraction = 0.0_wp
         call march_count_grid(march, step)
         call check_equal(error, int(grid%n_window), 0, "no window any more")
         step%time%tolerance = 0.0_wp
         call march_count_grid(march, step)
         call check_true(error, .not. grid%is_controlled, "neither errors nor events")
         step%time%tolerance = 1.0e-3_wp
         march%explicit%is_on = .true.
         call march_count_grid(march, step)
         call check_true(error, .not. grid%is_controlled, "explicit steps")
      end associate
      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 20)
      scene%step(1)%time%tolerance = 1.0e-3_wp
      march%explicit%is_on = .false.
      call march_count_grid(march, scene%step(1))
      call check_true(error, .not. march%grid%is_controlled, "statics")
      ! Of viscous forces halves go down to an eighth of their time, but no farther than 2**-24.
      do k = 1, 3
         scene%step(1)%stabilization = 10.0_wp**(2 - 3*k)
         call march_count_grid(march, scene%step(1))
         call check_equal(error, march%grid%n_level, min(24, 12 + 6*(k - 1)), "viscous")
      end do
   end subroutine test_sizes

   !> At each point, up to the rounding of a sum, and in the middle of each interval. The last one
   !> may be so short that its end is nearer to the point before by whole increments.
   subroutine test_set(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      integer :: i, side

      call make_step(scene, march, .false.)
      march%state%clock%i_step = 1
      march%state%clock%start_time = 4.0_wp
      scene%step(1)%time%duration = 1.6875_wp
      do side = -8, 8, 8
         call march_set_time(march, scene, 1.6875_wp*(1.0_wp + side*epsilon(1.0_wp)))
         call check_equal(error, march%state%clock%n_grid, n, "the end")
         call check_near(error, march%state%clock%step_time, 1.6875_wp, 0.0_wp, 1.0_wp, "its time")
      end do
      scene%step(1)%time%duration = time(n)
      associate (clock => march%state%clock)
         do side = -8, 8, 16
            do i = 0, n
               clock%n_part = 1
               call march_set_time(march, scene, time(i)*(1.0_wp + side*epsilon(1.0_wp)))
               call check_equal(error, [clock%n_grid, int(clock%n_part)], [i, 0], "point " &
                  // to_text(i))
               call check_true(error, .not. clock%is_off_grid, "on the grid")
               call check_near(error, [clock%step_time, clock%time], [time(i), 4.0_wp + time(i)], &
                  0.0_wp, 1.0_wp, "times")
            end do
         end do
         do i = 0, n - 1
            call march_set_time(march, scene, 0.5_wp*(time(i) + time(i + 1)))
            call check_equal(error, clock%n_grid, i, "after point " // to_text(i))
            call check_true(error, clock%is_off_grid, "off the grid")
            call check_near(error, clock%step_time, 0.5_wp*(time(i) + time(i + 1)), 0.0_wp, &
               1.0_wp, "as it is")
         end do
         scene%step(1)%time%corner = [0.55_wp]
         call march_count_grid(march, scene%step(1))
         call march_set_time(march, scene, 0.25_wp)
         call check_equal(error, clock%n_grid, 1, "before the first corner, which is between")
         call check_true(error, .not. clock%is_off_grid, "on the grid")
      end associate
   end subroutine test_set

   !> Statics: five increments each of h, 2 h and 4 h, and one for what is left of forty. None of
   !> them passes a corner.
   subroutine test_count(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., h, 40)
      associate (step => scene%step(1))
         call check_equal(error, march_count_increments(step), 40, "of a given size")
         step%time%is_direct = .false.
         call check_equal(error, march_count_increments(step), 16, "that grow")
         step%time%h_max = 3.0_wp*h
         call check_equal(error, march_count_increments(step), 5 + 18, "of 2 h at most")
         step%time%h_max = 0.0_wp
         step%time%corner = [16.0_wp*h, 17.0_wp*h]
         call check_equal(error, march_count_increments(step), 5 + 5 + 2 + 3 + 2, "with corners")
      end associate
   end subroutine test_count

end module test_march_grid
