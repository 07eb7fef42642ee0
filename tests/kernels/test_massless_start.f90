!> Sections without inertia as dynamic steps begin: whether forces there balance, what holds them,
!> and their velocities.
module test_massless_start
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : err_analysis, error_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, initiation_persistent, load_point, load_t
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_load, add_step, add_surface, block_t, bottom, clamp, &
      make_block, make_two_blocks
   implicit none
   private
   public :: collect_massless_start

   real(wp), parameter :: h = 0.125_wp

contains

   subroutine collect_massless_start(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces that do not balance are told", test_balance), &
         test_case_t("loads of the time at which a step begins", test_time), &
         test_case_t("velocities are those of the way", test_velocity), &
         test_case_t("a free body without mass is refused", test_free), &
         test_case_t("surfaces that keep their mass are told", test_kept)]
   end subroutine collect_massless_start

   !> Three cells in a row, held on the left; nodes 4 and 8 on the right are of the third alone,
   !> which has no mass.
   subroutine make_tip(scene, is_static)
      type(scene_t), intent(out) :: scene
      logical, intent(in) :: is_static
      type(block_t) :: block

      call make_block(scene, "CPE4", [3, 1], block)
      call add_massless(scene, [3])
      call add_step(scene, is_static, h, 4)
      call clamp(scene%step(1), [1, 5])
   end subroutine make_tip

   subroutine add_massless(scene, element)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: element(:)

      scene%section = [scene%section, scene%section]
      scene%section(2)%is_massless = .true.
      scene%element%section(element) = 2
   end subroutine add_massless

   subroutine pull(scene, node, dof, value)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: value
      type(load_t) :: load

      load%kind = load_point
      load%target = node
      load%place = dof
      load%value = value
      call add_load(scene%step(1), load)
   end subroutine pull

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> At rest or strained: a load of -3 there, one at a node with mass, none in a step without
   !> inertia, and loads that are the forces of the elements.
   subroutine test_balance(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp) :: force(2, 8)
      integer :: k

      do k = 1, 3
         call make_tip(scene, k == 3)
         call pull(scene, merge(3, 8, k == 2), 1, -3.0_wp)
         call look_at(k == 1, "a force of 3 is not balanced at node 8 ")
         if (allocated(error)) return
      end do
      call make_tip(scene, .false.)
      scene%u0(:, 4) = [0.1_wp, 0.05_wp]
      scene%u0(:, 8) = [0.2_wp, -0.05_wp]
      call look_at(.true., " is not balanced at node ")
      if (allocated(error)) return
      call pull(scene, 4, 1, force(1, 4))
      call pull(scene, 4, 2, force(2, 4))
      call pull(scene, 8, 1, force(1, 8))
      call pull(scene, 8, 2, force(2, 8))
      call look_at(.false., "")
      call clamp(scene%step(1), [4, 8])
      scene%step(1)%load = scene%step(1)%load(:0)
      call look_at(.false., "")

   contains

      subroutine look_at(is_told, text)
         logical, intent(in) :: is_told
         character(len=*), intent(in) :: text
         type(march_t) :: march

         call begin(scene, march, error)
         if (allocated(error)) return
         force = march%state%internal
         call check_equal(error, march%warnings%n, merge(1, 0, is_told), "warnings of " // text)
         if (is_told .and. .not. allocated(error)) call check_true(error, &
            index(march%warnings%item(1)%text, text) > 0, march%warnings%item(1)%text)
         call march_free(march)
      end subroutine look_at

   end subroutine test_balance

   !> A load that grows from total time 0.5 on, as the second step begins then or later.
   subroutine test_time(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k

      call make_tip(scene, .false.)
      call add_step(scene, .false., h, 4)
      scene%step(2)%prescribed = scene%step(1)%prescribed
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.5_wp, 1.0_wp], value=[0.0_wp, 1.0_wp], &
         is_total_time=.true.)
      call pull(scene, 8, 2, 6.0_wp)
      scene%step(2)%load = scene%step(1)%load
      scene%step(2)%load%amplitude = 1
      scene%step(1)%load = scene%step(1)%load(:0)
      do k = 1, 2
         call look_at(0.25_wp*(k + 1))
         if (allocated(error)) return
      end do

   contains

      subroutine look_at(time)
         real(wp), intent(in) :: time
         type(march_t) :: march
         integer :: i, n_told

         call begin(scene, march, error)
         if (allocated(error)) return
         march%state%clock%time = time
         call march_begin_step(march, scene, 2, error)
         if (allocated(error)) return
         n_told = 0
         do i = 1, march%warnings%n
            n_told = n_told + merge(1, 0, index(march%warnings%item(i)%text, &
               "a force of 3 is not balanced at node 8 ") == 1)
         end do
         call check_equal(error, [n_told, march%warnings%n], spread(k - 1, 1, 2), "told")
         call march_free(march)
      end subroutine look_at

   end subroutine test_time

   subroutine test_velocity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: before(2, 8)
      integer :: k

      call make_tip(scene, .false.)
      call pull(scene, 3, 2, 0.5_wp)
      call begin(scene, march, error)
      if (allocated(error)) return
      do k = 1, 3
         before = march%state%u
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, march%state%v(:, [4, 8]), (march%state%u(:, [4, 8]) &
            - before(:, [4, 8]))/h, 64.0_wp*epsilon(1.0_wp), 1.0_wp, "increment " // to_text(k))
         call check_true(error, norm2(march%state%v(:, [4, 8])) > 1.0e-6_wp, "it moves")
      end do
      call march_free(march)
   end subroutine test_velocity

   !> The second of two bodies, with mass in none of its cells or in one, free or held.
   subroutine test_free(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: k

      do k = 1, 3
         call make_block(scene, "CPE4", [1, 1], block)
         call add_block(scene, "CPE4", [2, 1], [3.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
         if (k == 2) then
            call add_massless(scene, [3])
         else
            call add_massless(scene, [2, 3])
         end if
         call add_step(scene, .false., h, 1)
         if (k == 3) call clamp(scene%step(1), [5, 8])
         call look_at()
         if (allocated(error)) return
      end do

   contains

      subroutine look_at()
         type(march_t) :: march

         call begin(scene, march, raised)
         if (k > 1) then
            call check_true(error, .not. allocated(raised), "held by mass or supports")
         else
            call check_error(error, raised, err_analysis, "MASSLESS section has no inertia", "free")
         end if
         call march_free(march)
      end subroutine look_at

   end subroutine test_free

   !> The upper block's bottom was to give its mass away and is held: told, unless the pair stands
   !> the other way round too, or keeps contact. A pair of that master with a third body is no help.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      logical, parameter :: is_told(5) = [.false., .true., .false., .true., .false.]
      type(scene_t) :: scene
      type(block_t) :: lower, upper, third
      integer :: k

      do k = 1, size(is_told)
         call make_two_blocks(scene, 0.1_wp, lower, upper)
         call add_block(scene, "CPE4", [2, 1], [-1.0_wp, 4.0_wp], [2.0_wp, 1.0_wp], third)
         call add_surface(scene, "THIRD", third, [bottom])
         call add_step(scene, .false., h, 1)
         scene%step(1)%contact%initiation = initiation_massless
         if (k > 1) call clamp(scene%step(1), [11, 12, 13])
         if (k == 3 .or. k == 4) then
            scene%pair = [scene%pair, scene%pair]
            scene%pair(2)%slave = 1
            scene%pair(2)%master = merge(2, 3, k == 3)
         end if
         if (k == 5) scene%pair(1)%initiation = initiation_persistent
         call look_at()
         if (allocated(error)) return
      end do

   contains

      subroutine look_at()
         type(march_t) :: march

         call begin(scene, march, error)
         if (allocated(error)) return
         call check_equal(error, march%warnings%n, merge(1, 0, is_told(k)), "told " // to_text(k))
         if (is_told(k) .and. .not. allocated(error)) call check_true(error, &
            index(march%warnings%item(1)%text, "the surface UPPER of a contact pair keeps") == 1, &
            march%warnings%item(1)%text)
         call march_free(march)
      end subroutine look_at

   end subroutine test_kept

end module test_massless_start
