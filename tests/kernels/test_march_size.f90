!> How long increments may be, and what driven explicit steps put in.
module test_march_size
   use check, only : check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_step, add_surface, block_t, bottom, make_block, &
      prescribe, scene_begin, top
   implicit none
   private
   public :: collect_march_size

   real(wp), parameter :: h = 0.125_wp

contains

   subroutine collect_march_size(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("increments end before boxes can meet", test_apart), &
         test_case_t("work of explicit steps that are driven", test_driven), &
         test_case_t("and of a push at once, to either side", test_pushed)]
   end subroutine collect_march_size

   !> Block 1 is a unit square at the origin, block 2 one at `place`; both fly, with `v1` and `v2`.
   subroutine make_flight(scene, place, v1, v2)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: place(2), v1(2), v2(2)
      type(block_t) :: first, second
      type(contact_pair_t) :: pair

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], first)
      call add_block(scene, "CPE4", [1, 1], place, [1.0_wp, 1.0_wp], second)
      call add_surface(scene, "FIRST", first, [top])
      call add_surface(scene, "SECOND", second, [bottom])
      pair%slave = 2
      pair%master = 1
      scene%pair = [pair]
      call add_step(scene, .false., h, 64)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = 1.0e3_wp
      scene%v0(:, :4) = spread(v1, 2, 4)
      scene%v0(:, 5:) = spread(v2, 2, 4)
   end subroutine make_flight

   !> Of 16 h the longest of which the ways of both are shorter than the gap, by some axis: 0.6.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: place(2, 8) = reshape([0.0_wp, 1.6_wp, 1.6_wp, 0.0_wp, -1.6_wp, &
         0.0_wp, 0.0_wp, -1.6_wp, 0.0_wp, 1.6_wp, 0.0_wp, 1.6_wp, 1.6_wp, 1.1_wp, 0.5_wp, &
         1.6_wp], [2, 8])
      real(wp), parameter :: v1(2, 8) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [2, 8])
      real(wp), parameter :: v2(2, 8) = reshape([0.0_wp, -1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
         0.0_wp, 1.0_wp, 0.0_wp, -1.0_wp, 0.6_wp, -0.8_wp, 0.0_wp, -1.0_wp, 0.0_wp, 1.0_wp], [2, 8])
      real(wp), parameter :: size(10) = [4.0_wp, 4.0_wp, 4.0_wp, 4.0_wp, 2.0_wp, 4.0_wp, 4.0_wp, &
         4.0_wp, 8.0_wp, 16.0_wp]
      type(scene_t) :: scene
      integer :: k

      do k = 1, 10
         call make_flight(scene, place(:, min(k, 8)), v1(:, min(k, 8)), v2(:, min(k, 8)))
         if (k == 9) then
            scene%u0(2, 5:) = 0.6_wp
         else if (k == 10) then
            scene%pair = scene%pair(:0)
         end if
         call check_first(error, scene, size(k)*h, "flight " // to_text(k))
         if (allocated(error)) return
      end do
   end subroutine test_apart

   subroutine check_first(error, scene, length, what)
      type(error_t), allocatable, intent(inout) :: error
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: length
      character(len=*), intent(in) :: what
      type(march_t) :: march
      type(increment_t) :: increment

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      march%state%control%power = 4
      march%state%control%asked = 16.0_wp
      call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_near(error, increment%h, length, 64.0_wp*epsilon(1.0_wp), 1.0_wp, what)
      call march_free(march)
   end subroutine check_first

   !> A block shaken slowly at its bottom, along and across: what is put in is what it has, but for
   !> the square of the step times the fastest frequency, here below 1/40.
   subroutine test_driven(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: drift, largest, put_in, before(2)
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .false., 0.0025_wp, 200)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      do i = 1, 3
         call prescribe(scene%step(1), i, 1, 0.3_wp)
         call prescribe(scene%step(1), i, 2, 0.2_wp)
      end do
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1)%name = "A"
      scene%amplitude(1)%time = [(0.0025_wp*i, i = 0, 200)]
      scene%amplitude(1)%value = [(sin(0.0125_wp*i)**2, i = 0, 200)]
      scene%step(1)%prescribed%amplitude = 1
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      drift = 0.0_wp
      largest = 0.0_wp
      put_in = 0.0_wp
      do i = 1, 200
         before = march%ledger%momentum
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, march%ledger%momentum - before, &
            0.0025_wp*sum(march%state%reaction, 2), 1.0e3_wp*epsilon(1.0_wp), 4.0_wp, "impulse")
         drift = max(drift, abs(march%ledger%kinetic + march%ledger%strain &
            - march%ledger%external_work))
         largest = max(largest, march%ledger%kinetic + march%ledger%strain)
         put_in = max(put_in, march%ledger%external_work)
      end do
      call check_true(error, largest > 1.0_wp, "it is shaken")
      call check_near(error, drift, 0.0_wp, 0.025_wp, largest, "what is put in")
      call check_near(error, put_in, largest, 0.025_wp, largest, "at most")
      call march_free(march)
   end subroutine test_driven

   !> The bottom moves at once, to the left as to the right: in the first step masses there take the
   !> work of their velocity before and after, and elements theirs, while nothing else has moved.
   subroutine test_pushed(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: h = 0.0025_wp, speed = 0.5_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(increment_t) :: increment
      real(wp) :: work(4, -1:1), strain
      integer :: i, k

      do k = -1, 1, 2
         call make_block(scene, "CPE4", [2, 2], block)
         call add_step(scene, .false., h, 4)
         scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
         do i = 1, 3
            call prescribe(scene%step(1), i, 1, speed*k)
         end do
         scene%amplitude = [amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])]
         scene%step(1)%prescribed%amplitude = 1
         block
            type(march_t) :: march

            call march_init(march, scene, error)
            if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
            do i = 1, 4
               if (allocated(error)) return
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               work(i, k) = march%ledger%external_work
               if (i == 1) strain = march%ledger%strain
            end do
            call march_free(march)
         end block
      end do
      ! Three of nine nodes of a mass of 4 have a quarter of it; a shear is linear in so short a
      ! way.
      call check_near(error, work(1, 1), 0.5_wp*1.0_wp*speed**2 + strain, 64.0_wp*epsilon(1.0_wp), &
         1.0_wp, "energy of what is driven")
      call check_near(error, work(:, -1), work(:, 1), 64.0_wp*epsilon(1.0_wp), 1.0_wp, "mirrored")
   end subroutine test_pushed

end module test_march_size
