!> Gaps before the first step in space: of a block over another one, and what its nodes see of it.
module test_start_gaps_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_start_gaps_space, only : start_gaps_space_init, start_gaps_space_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_start_gaps_space

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   !> A block of 2 x 2 x 1 cells above one of 3 x 3 x 1, at first far above it.
   integer, parameter :: n_below(3) = [3, 3, 1], n_above(3) = [2, 2, 1]
   integer, parameter :: first_above = 33
   real(wp), parameter :: far = 5.0_wp

contains

   subroutine collect_start_gaps_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps over a flat surface", test_gaps), &
         test_case_t("beyond its end, and with a pad", test_end), &
         test_case_t("the way to it", test_offset), &
         test_case_t("corners, and what faces it", test_corners), &
         test_case_t("in a closed surface", test_closed)]
   end subroutine collect_start_gaps_space

   !> The upper block is `shift` from where it would stand on the middle of the lower one, by
   !> displacements.
   subroutine begin(scene, shift, start, error, is_closed)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: shift(3)
      type(start_gaps_space_t), intent(out) :: start
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_closed !! all of the lower block
      type(surface_t) :: surface
      integer :: i

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, -1.0_wp], [3.0_wp, 3.0_wp, 1.0_wp], n_below)
      call add_box(scene, "C3D8", [0.5_wp, 0.5_wp, far], [2.0_wp, 2.0_wp, 1.0_wp], n_above)
      surface = skin(scene)
      scene%surface = [surface, surface]
      associate (is_top => surface%element <= 9 .and. surface%face == 2)
         scene%surface(1)%element = pack(surface%element, is_top)
         scene%surface(1)%face = pack(surface%face, is_top)
      end associate
      associate (is_below => surface%element <= 9)
         if (present(is_closed)) then
            scene%surface(1)%element = pack(surface%element, is_below)
            scene%surface(1)%face = pack(surface%face, is_below)
         end if
         scene%surface(2)%element = pack(surface%element, .not. is_below)
         scene%surface(2)%face = pack(surface%face, .not. is_below)
      end associate
      allocate(scene%u0, source=0.0_wp*scene%x)
      do i = first_above, size(scene%x, 2)
         scene%u0(:, i) = shift - [0.0_wp, 0.0_wp, far]
      end do
      scene%pair = [contact_pair_t(slave=2, master=1)]
      call start_gaps_space_init(start, scene, scene%pair(1), error)
   end subroutine begin

   !> Each node over the face below it, as high as it is; the upper ones are not near.
   subroutine test_gaps(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_space_t) :: start
      real(wp) :: gap, height
      logical :: is_over
      integer :: i, sign

      do sign = -1, 1, 2
         call begin(scene, [0.0_wp, 0.0_wp, sign*0.125_wp], start, error)
         if (allocated(error)) return
         call check_equal(error, start%n, 18, "slave nodes")
         call start%measure(scene)
         do i = 1, start%n
            height = scene%x(3, start%node(i)) + scene%u0(3, start%node(i))
            call check_equal(error, merge(1, 0, start%facet(i) > 0), &
               merge(1, 0, height < 0.5_wp), "near")
            call start%nearest(i, scene, gap, is_over)
            call check_near(error, gap, height, tol, 1.0_wp, "gap")
            call check_near(error, start%state(i)%gap0, height, tol, 1.0_wp, "state")
            call check_near(error, start%state(i)%size, 1.0_wp, tol, 1.0_wp, "size")
            call check_true(error, is_over, "over")
         end do
      end do
   end subroutine test_gaps

   subroutine test_end(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_space_t) :: start
      real(wp) :: gap
      logical :: is_over
      integer :: i, n

      call begin(scene, [1.0_wp, 0.0_wp, 0.25_wp], start, error)
      if (allocated(error)) return
      n = 0
      do i = 1, start%n
         call start%nearest(i, scene, gap, is_over)
         if (is_over) n = n + 1
         call check_true(error, is_over .eqv. scene%x(1, start%node(i)) < 2.2_wp, "over")
      end do
      call check_equal(error, n, 12, "over it")
      scene%pair%interaction%offset = 0.0625_wp
      call start_gaps_space_init(start, scene, scene%pair(1), error)
      if (allocated(error)) return
      call start%nearest(1, scene, gap, is_over)
      call check_near(error, gap, 0.1875_wp, tol, 1.0_wp, "less the pad")
   end subroutine test_end

   !> Without it nodes stand on the surface, or on its pad.
   subroutine test_offset(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_space_t) :: start
      real(wp) :: offset(3), pad
      logical :: is_last
      integer :: i, k

      do k = 0, 1
         pad = 0.0625_wp*k
         call begin(scene, [0.0_wp, 0.0_wp, -0.125_wp], start, error)
         if (allocated(error)) return
         scene%pair%interaction%offset = pad
         call start_gaps_space_init(start, scene, scene%pair(1), error)
         if (allocated(error)) return
         call start%measure(scene)
         do i = 1, start%n
            if (start%facet(i) == 0) cycle
            call start%offset(i, scene, 0.0_wp, offset, is_last)
            call check_near(error, offset, [0.0_wp, 0.0_wp, -0.125_wp - pad], tol, 1.0_wp, "way")
            call check_true(error, .not. is_last, "not yet")
            scene%x(:, start%node(i)) = scene%x(:, start%node(i)) - offset
            call start%offset(i, scene, 0.0_wp, offset, is_last)
            call check_true(error, is_last, "there")
         end do
         call start%measure(scene)
         call check_near(error, pack(start%state%gap0, start%facet > 0), &
            [(0.0_wp, i = 1, 9)], tol, 1.0_wp, "on it")
      end do
   end subroutine test_offset

   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_space_t) :: start
      logical :: sharp(18)
      integer :: i

      call begin(scene, [0.0_wp, 0.0_wp, 0.125_wp], start, error)
      if (allocated(error)) return
      call start%measure(scene)
      call start%is_sharp(scene, 60.0_wp, sharp)
      do i = 1, start%n
         associate (x => scene%x(:, start%node(i)))
            call check_true(error, sharp(i) .eqv. any(abs(x(:2) - 1.5_wp) > 0.9_wp), "sharp")
            if (start%facet(i) > 0) call check_true(error, start%faces(i, scene), "faces")
         end associate
      end do
      call start%is_sharp(scene, 100.0_wp, sharp)
      call check_true(error, .not. any(sharp), "less than that")
      do i = 1, start%n
         associate (x => scene%x(:, start%node(i)))
            start%facet(i) = 1
            call check_true(error, start%faces(i, scene) .eqv. x(3) < far + 0.5_wp, "upper ones")
         end associate
      end do
   end subroutine test_corners

   !> In a closed surface nodes are near however deep they are, in front of it they are not.
   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_space_t) :: start
      integer :: i

      do i = 0, 1
         call begin(scene, [0.0_wp, 0.0_wp, -0.75_wp + 3.0_wp*i], start, error, .true.)
         if (allocated(error)) return
         call start%measure(scene)
         call check_equal(error, count(start%facet > 0), merge(18, 0, i == 0), "near")
         if (i == 0) call check_near(error, minval(start%state%gap0), -0.25_wp, tol, 1.0_wp, &
            "to the bottom")
         if (i == 0) cycle
         scene%pair%adjust%distance = 2.5_wp
         call start_gaps_space_init(start, scene, scene%pair(1), error)
         if (allocated(error)) return
         call start%measure(scene)
         call check_equal(error, count(start%facet > 0), 9, "near enough to be moved")
      end do
   end subroutine test_closed

end module test_start_gaps_space
