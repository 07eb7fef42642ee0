!> Steppers on scenes made by hand, and their states compared.
module stepper_scenes
   use check, only : check_near
   use cut_scenes, only : make_cut_blocks
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : formulation_mortar
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_init
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_steps, only : load_point, load_t
   use emcon_ties, only : ties_prepare
   use emcon_verdict, only : verdict_start
   use small_scenes, only : add_load, add_step, block_t, clamp, make_two_blocks
   implicit none
   private
   public :: open_scene, make_drop, make_tied_drop, check_same_state, drop_h

   !> Steps of the dropped blocks: no dyadic number. They meet in the fifth one.
   real(wp), parameter :: drop_h = 0.02_wp

contains

   !> Begin the first step of `scene`.
   subroutine open_scene(stepper, scene, error)
      type(stepper_t), intent(inout) :: stepper
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error

      stepper%scene = scene
      call ties_prepare(stepper%scene, stepper%notes, error)
      if (allocated(error)) return
      call march_init(stepper%march, stepper%scene, error)
      if (allocated(error)) return
      call march_begin_step(stepper%march, stepper%scene, 1, error)
      if (.not. allocated(error)) call verdict_start(stepper%verdict, stepper%march)
   end subroutine open_scene

   !> A block that is thrown on a clamped one, aslant, and pulled by a force that grows with time.
   subroutine make_drop(scene, n)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n                   !! increments
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, 0.0927_wp, lower, upper)
      call add_step(scene, .false., drop_h, n)
      call clamp(scene%step(1), [(i, i = 1, 5)])
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      call add_pull(scene, 16)
   end subroutine make_drop

   !> A force on `node` in x that grows with time.
   subroutine add_pull(scene, node)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: node
      type(load_t) :: pull
      type(amplitude_t) :: growth

      growth%name = "GROWTH"
      growth%time = [0.0_wp, 10.0_wp]
      growth%value = [0.0_wp, 3.0_wp]
      scene%amplitude = [growth]
      pull%kind = load_point
      pull%target = node
      pull%place = 1
      pull%value = 0.7_wp
      pull%amplitude = 1
      call add_load(scene%step(1), pull)
   end subroutine add_pull

   !> The same with both blocks in two tied pieces.
   subroutine make_tied_drop(scene, n, is_mortar)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n                   !! increments
      logical, intent(in) :: is_mortar

      call make_cut_blocks(scene, 0.0927_wp)
      if (is_mortar) scene%pair(1)%formulation = formulation_mortar
      call add_step(scene, .false., drop_h, n)
      where (scene%x(2, :) > 0.0_wp)
         scene%v0(1, :) = 0.3_wp
         scene%v0(2, :) = -1.0_wp
      end where
      call add_pull(scene, size(scene%x, 2))
   end subroutine make_tied_drop

   !> Both have come to the same state, to the last bit.
   subroutine check_same_state(error, a, b, what)
      type(error_t), allocatable, intent(inout) :: error
      type(stepper_t), intent(in) :: a, b
      character(len=*), intent(in) :: what

      associate (p => a%march%state, q => b%march%state)
         call check_near(error, p%u, q%u, 0.0_wp, 1.0_wp, what // ": u")
         call check_near(error, p%v, q%v, 0.0_wp, 1.0_wp, what // ": v")
         call check_near(error, p%contacts%lam, q%contacts%lam, 0.0_wp, 1.0_wp, what // ": lam")
         call check_near(error, p%clock%time, q%clock%time, 0.0_wp, 1.0_wp, what // ": time")
         call check_near(error, a%march%ledger%total, b%march%ledger%total, 0.0_wp, 1.0_wp, &
            what // ": energy")
      end associate
   end subroutine check_same_state

end module stepper_scenes
