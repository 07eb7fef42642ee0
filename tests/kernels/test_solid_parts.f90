!> Parts of the elements together: shares of threads, lanes of packs, advice on stiff elements, and
!> how far linear sections have turned.
module test_solid_parts
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_corotated_pack_plane, only : corotated_pack_fill, corotated_pack_gather, &
      corotated_pack_motion_t, corotated_pack_t
   use emcon_corotated_plane, only : corotated_t
   use emcon_element, only : element_geometry_t
   use emcon_element_plane, only : point_is_regular, point_motion_t
   use emcon_element_pack, only : element_pack_t, pack_gather, pack_make_room, pack_motion_t, &
      pack_response_t
   use emcon_element_space, only : space_point_is_regular, space_point_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   use emcon_locking, only : bending_advice, locking_advice, locking_element, strainless_element
   use emcon_materials, only : kinematics_corotated, kinematics_linear
   use emcon_pack_points_plane, only : pack_point_check, pack_point_t
   use emcon_pack_points_space, only : point_check_space => pack_point_check, &
      point_space_t => pack_point_t
   use emcon_pack_shares, only : border_keep, pack_shares_t, shares_has, shares_lay_out
   use emcon_scene, only : scene_t
   use emcon_small_range, only : small_range_init, small_range_t, small_range_widen
   use emcon_small_widen_space, only : small_widen
   use emcon_solid, only : solid_init, solid_t
   use emcon_stepper, only : stepper_t
   use emcon_text, only : to_text
   use one_element, only : read_one
   use random_draws, only : draw_random
   use small_scenes, only : add_block, block_t, make_block, poisson, scene_begin, shake
   implicit none
   private
   public :: collect_solid_parts

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_solid_parts(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("shares of packs", test_shares), &
         test_case_t("what a pack at a border keeps", test_border), &
         test_case_t("motions of lanes", test_lanes), &
         test_case_t("turns and strains of linear sections", test_small), &
         test_case_t("corotated sections do not turn", test_corotated), &
         test_case_t("turns and strains in space", test_space), &
         test_case_t("elements that lock", test_locking), &
         test_case_t("what to take in place of stiff elements", test_advice), &
         test_case_t("what may lock, at small and at large strains", test_may_lock), &
         test_case_t("ends of motions that laws answer to", test_regular), &
         test_case_t("the same side by side", test_regular_lanes), &
         test_case_t("the same in space", test_regular_space)]
   end subroutine collect_solid_parts

   !> Packs of one to all lanes with nodes by chance, in one to five shares: by their points, in
   !> their order. A node of several shares is summed by the last of them.
   subroutine test_shares(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_pack = 9, n_node = 40
      type(element_pack_t) :: pack(n_pack)
      type(pack_shares_t) :: shares
      real(wp) :: drawn(n_lane)
      integer :: k, i, n

      do k = 1, n_pack
         pack(k)%n = 1 + mod(3*k, n_lane)
         pack(k)%n_node = 3 + mod(k, 2)
         pack(k)%n_gp = merge(4, 1, mod(k, 3) == 0)
         allocate(pack(k)%node(n_lane, pack(k)%n_node), source=0)
         pack(k)%n_dim = 2
         allocate(pack(k)%gradient(n_lane, 2, pack(k)%n_node, 1))
         do i = 1, pack(k)%n_node
            call draw_random(drawn)
            pack(k)%node(:pack(k)%n, i) = 3*k + int(8.0_wp*drawn(:pack(k)%n))
         end do
      end do
      do n = 1, 5
         call shares_lay_out(shares, pack, n_node, n)
         call check_shares(error, shares, pack, n)
      end do
      shares%turn(1) = 77
      call shares_lay_out(shares, pack, n_node, 5)
      call check_equal(error, shares%turn(1), 77, "laid out once")
      call shares_lay_out(shares, pack(:0), n_node, 2)
      call check_equal(error, [shares%first, size(shares%border)], [0, 0, 0, 0], "no packs")
   end subroutine test_shares

   subroutine check_shares(error, shares, pack, n)
      type(error_t), allocatable, intent(inout) :: error
      type(pack_shares_t), intent(in) :: shares
      type(element_pack_t), intent(in) :: pack(:)
      integer, intent(in) :: n
      integer, dimension(size(shares%turn)) :: low, high
      integer :: share(size(pack)), k, t, i, n_border
      real(wp) :: part

      part = sum(pack%n_gp)/real(n, wp)
      t = 1
      do k = 1, size(pack)
         do while (sum(pack(:k - 1)%n_gp) >= t*part)
            t = t + 1
         end do
         share(k) = t
      end do
      call check_equal(error, shares%first, [(count(share < t), t = 1, n + 1)], "before each share")
      low = huge(1)
      high = 0
      do k = 1, size(pack)
         do i = 1, pack(k)%n_node
            associate (node => pack(k)%node(:pack(k)%n, i))
               low(node) = min(low(node), share(k))
               high(node) = max(high(node), share(k))
            end associate
         end do
      end do
      call check_equal(error, shares%turn, merge(high, 0, high > low), "turns " // to_text(n))
      n_border = 0
      do k = 1, size(pack)
         if (any(shares%turn(reshape(pack(k)%node(:pack(k)%n, :), &
            [pack(k)%n*pack(k)%n_node])) > 0)) then
            n_border = n_border + 1
            call check_equal(error, shares%place(k), n_border, "at a border")
            call check_equal(error, shares%border(n_border)%pack, k, "its pack")
            call check_equal(error, shape(shares%border(n_border)%force), [n_lane, 2, &
               pack(k)%n_node], "its forces")
         else
            call check_equal(error, shares%place(k), 0, "inside")
         end if
         do t = 1, n
            call check_true(error, shares_has(shares, pack(k), t, t) .eqv. any(shares%turn( &
               reshape(pack(k)%node(:pack(k)%n, :), [pack(k)%n*pack(k)%n_node])) == t), &
               "has a turn")
         end do
      end do
      call check_equal(error, size(shares%border), n_border, "borders")
      call check_true(error, n_border > 0 .eqv. n > 1, "some are")
   end subroutine check_shares

   subroutine test_border(error)
      type(error_t), allocatable, intent(out) :: error
      type(pack_shares_t) :: shares
      type(element_pack_t) :: pack(2)
      type(pack_response_t) :: part
      type(pack_motion_t) :: motion
      real(wp) :: largest(n_lane)
      integer :: k

      do k = 1, 2
         pack(k)%n = 1
         pack(k)%n_node = 3
         pack(k)%n_gp = 1
         pack(k)%node = spread([1, 2, 3], 1, n_lane)
         pack(k)%n_dim = 2
         allocate(pack(k)%gradient(n_lane, 2, 3, 1))
      end do
      call shares_lay_out(shares, pack, 3, 2)
      call pack_make_room(2, 5, .true., motion, part)
      call draw_random(part%force)
      call draw_random(part%magnitude)
      call draw_random(part%tangent(:, :, :, 1, 1))
      call draw_random(largest)
      part%tangent(:, :, :, 2, 3) = part%tangent(:, :, :, 1, 1)
      associate (border => shares%border(2))
         part%with_sizes = .false.
         call border_keep(border, part, largest, .false.)
         call check_true(error, all(abs(border%force - part%force(:, :, :3)) <= 0.0_wp), "forces")
         call check_true(error, all(abs(border%magnitude) <= 0.0_wp) .and. &
            all(abs(border%largest) <= 0.0_wp) .and. .not. allocated(border%tangent), "alone")
         part%with_sizes = .true.
         call border_keep(border, part, largest, .true.)
         call check_true(error, all(abs(border%magnitude - part%magnitude(:, :, :3)) <= 0.0_wp), &
            "sizes")
         call check_near(error, border%largest, largest, 0.0_wp, 1.0_wp, "largest")
         call check_true(error, all(abs(border%tangent(:, :, :, 2, 3) - part%tangent(:, :, :3, 2, &
            3)) <= 0.0_wp), "tangent")
      end associate
   end subroutine test_border

   !> Motions are those from the first node of each element; lanes that are left over repeat the
   !> first one.
   subroutine test_lanes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: node(3, 3) = reshape([2, 5, 7, 6, 4, 2, 1, 3, 7], [3, 3])
      type(corotated_t) :: frame(3)
      type(corotated_pack_t) :: pack
      type(corotated_pack_motion_t) :: motion
      type(element_pack_t) :: plain
      type(pack_motion_t) :: moved
      type(pack_response_t) :: unused
      real(wp), dimension(2, 7) :: from, by
      integer :: k, i, l

      do k = 1, 3
         frame(k)%n_node = 3
         allocate(frame(k)%stiffness(6, 6), source=0.0_wp)
      end do
      call shake(from, 1.0_wp)
      call shake(by, 1.0_wp)
      call corotated_pack_fill(pack, [3, 1], node, frame)
      call corotated_pack_gather(pack, from, by, motion)
      plain%n = 2
      plain%n_node = 3
      plain%node = pack%node
      call pack_make_room(2, 4, .false., moved, unused)
      call pack_gather(plain, from, by, moved)
      do l = 1, n_lane
         k = merge(1, 3, l == 2)
         call check_equal(error, pack%element(l), k, "element")
         do i = 1, 3
            call check_near(error, motion%from(l, :, i), from(:, node(i, k)) &
               - from(:, node(1, k)), 0.0_wp, 1.0_wp, "from")
            call check_near(error, motion%by(l, :, i), by(:, node(i, k)) - by(:, node(1, k)), &
               0.0_wp, 1.0_wp, "by")
            call check_near(error, [moved%from(l, :, i), moved%by(l, :, i)], &
               [motion%from(l, :, i), motion%by(l, :, i)], 0.0_wp, 1.0_wp, "the same of others")
         end do
      end do
   end subroutine test_lanes

   !> Three blocks, of sections 1 to 3, of which the first and the last are `kinematics`.
   subroutine make_solid(scene, kinematics, solid, error)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: kinematics
      type(solid_t), intent(out) :: solid
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      integer :: k

      call scene_begin(scene)
      do k = 1, 3
         call add_block(scene, merge("CPE3", "CPE4", k == 3), [2, 1], [3.0_wp*k, 0.0_wp], &
            [2.0_wp, 1.0_wp], block)
         scene%element%section(block%elements_before + 1:) = k
      end do
      scene%section = [scene%section, scene%section, scene%section]
      scene%section(1)%kinematics = kinematics
      scene%section(3)%kinematics = kinematics
      call solid_init(solid, scene, error)
   end subroutine make_solid

   !> |skew part of grad u| by one component, |symmetric part|; what was larger stays.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: h(2, 2) = reshape([0.125_wp, -0.25_wp, 0.5_wp, -0.25_wp], [2, 2])
      !> Of this way half of the digits are left for what is beside it.
      real(wp), parameter :: way = 2.0_wp**nint(0.5_wp*digits(1.0_wp))
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(small_range_t) :: range
      real(wp), allocatable :: u(:, :)

      call make_solid(scene, kinematics_linear, solid, error)
      if (allocated(error)) return
      call small_range_init(range, solid)
      call check_equal(error, range%section, [1, 3], "linear sections")
      call check_near(error, [range%rotation, range%strain], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], &
         0.0_wp, 1.0_wp, "at rest")
      u = matmul(h, scene%x) + way
      u(:, block_of(3):) = 2.0_wp*u(:, block_of(3):)
      call small_range_widen(range, solid, u)
      call check_near(error, range%rotation, [0.375_wp, 0.75_wp], tol, 1.0_wp, "rotations")
      call check_near(error, range%strain, sqrt(0.109375_wp)*[1.0_wp, &
         2.0_wp], tol, 1.0_wp, "strains")
      u(:, block_of(3):) = 0.25_wp*u(:, block_of(3):)
      u(:, :block_of(2) - 1) = 3.0_wp*u(:, :block_of(2) - 1)
      call small_range_widen(range, solid, u)
      call check_near(error, range%rotation, [1.125_wp, 0.75_wp], tol, 1.0_wp, "the largest")
      call check_near(error, range%strain, sqrt(0.109375_wp)*[3.0_wp, 2.0_wp], tol, 1.0_wp, &
         "the largest strains")

   contains

      !> First node of a block of 3 x 2 nodes.
      pure integer function block_of(k)
         integer, intent(in) :: k

         block_of = 6*(k - 1) + 1
      end function block_of

   end subroutine test_small

   !> By a turn of one radian, after a strain of a tenth.
   subroutine test_corotated(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: stretch(2, 2) = reshape([1.1_wp, 0.02_wp, 0.02_wp, 0.95_wp], [2, 2])
      real(wp), parameter :: turn(2, 2) = reshape([cos(1.0_wp), sin(1.0_wp), -sin(1.0_wp), &
         cos(1.0_wp)], [2, 2])
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(small_range_t) :: range

      call make_solid(scene, kinematics_corotated, solid, error)
      if (allocated(error)) return
      call small_range_init(range, solid)
      call small_range_widen(range, solid, matmul(turn, matmul(stretch, scene%x)) - scene%x)
      call check_near(error, range%rotation, [0.0_wp, 0.0_wp], tol, 1.0_wp, "rotations")
      call check_near(error, range%strain, spread(sqrt(0.01_wp + 0.0025_wp + 0.0008_wp), 1, 2), &
         tol, 1.0_wp, "strains")
   end subroutine test_corotated

   !> Of four nodes at the origin and on the axes.
   subroutine test_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_geometry_t) :: geometry
      real(wp) :: h(3, 3), u(3, 4), rotation, strain

      geometry%n_node = 4
      geometry%n_gp = 1
      allocate(geometry%gradient(3, 4, 1))
      geometry%gradient(:, :, 1) = reshape([-1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 4])
      call shake(h, 1.0_wp)
      u(:, 1) = 2.0_wp
      u(:, 2:) = h + 2.0_wp
      rotation = 0.0_wp
      strain = 0.0_wp
      call small_widen(geometry, u, rotation, strain)
      call check_near(error, rotation, 0.25_wp*((h(1, 2) - h(2, 1))**2 + (h(1, 3) - h(3, 1))**2 &
         + (h(2, 3) - h(3, 2))**2), tol, 1.0_wp, "rotation")
      call check_near(error, strain, h(1, 1)**2 + h(2, 2)**2 + h(3, 3)**2 + 0.5_wp*((h(1, 2) &
         + h(2, 1))**2 + (h(1, 3) + h(3, 1))**2 + (h(2, 3) + h(3, 2))**2), tol, 4.0_wp, "strain")
      rotation = 100.0_wp
      strain = 101.0_wp
      call small_widen(geometry, u, rotation, strain)
      call check_near(error, [rotation, strain], [100.0_wp, 101.0_wp], 0.0_wp, 1.0_wp, &
         "larger ones")
   end subroutine test_space

   !> Above a ratio of Poisson of 0.45, by the largest of all; rigid elements never do.
   subroutine test_locking(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: ratios(4) = [poisson, 0.449_wp, 0.451_wp, 0.49_wp]
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid
      real(wp) :: ratio
      integer :: k, e

      do k = 1, 4
         call make_block(scene, "CPE4", [2, 1], block)
         scene%material = [scene%material, scene%material]
         scene%section = [scene%section, scene%section]
         scene%section(2)%material = 2
         scene%element%section = [1, 2]
         scene%material(2)%constant(2) = ratios(k)
         call solid_init(solid, scene, error)
         if (allocated(error)) return
         call locking_element(solid, e, ratio)
         call check_equal(error, e, merge(0, 2, k < 3), "it locks")
         call check_near(error, ratio, merge(0.0_wp, ratios(k), k < 3), 1.0e3_wp*tol, 1.0_wp, &
            "its ratio")
         call check_equal(error, strainless_element(solid), 0, "points enough")
         solid%trait%is_rigid = .true.
         call locking_element(solid, e, ratio)
         call check_equal(error, e, 0, "rigid")
         call check_near(error, ratio, 0.0_wp, 0.0_wp, 1.0_wp, "a ratio of none")
      end do
      solid%trait%is_rigid = .false.
      solid%trait%n_point(2) = 1
      call check_equal(error, strainless_element(solid), 2, "one point for five motions")
      solid%trait%n_node = 3
      call check_equal(error, strainless_element(solid), 0, "of a triangle")
   end subroutine test_locking

   !> Of the family that the elements are of.
   subroutine test_advice(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=4), parameter :: kind(4) = ["CPE4", "CPS4", "C3D8", "CAX4"]
      character(len=5), parameter :: locked(4) = ["CPE4H", "CPE4H", "C3D8H", "CAX6 "], &
         bent(4) = ["CPE4I", "CPS4I", "C3D8I", "CAX6 "]
      type(stepper_t) :: stepper
      type(solid_t) :: solid
      integer :: k

      do k = 1, size(kind)
         stepper = stepper_t()
         call read_one(kind(k), 1, "NONLINEAR", stepper, error)
         if (.not. allocated(error)) call solid_init(solid, stepper%scene, error)
         if (allocated(error)) return
         call check_true(error, index(locking_advice(solid), "; take " // locked(k)) > 0 .and. &
            index(bending_advice(solid), "take " // bent(k)) == 1, kind(k))
      end do
   end subroutine test_advice

   !> Elements of corners alone, with incompatible modes at large strains only.
   subroutine test_may_lock(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: kind(4) = ["CPE4 ", "CPE4H", "CPE4I", "CPE8R"]
      logical, parameter :: expected(4, 2) = reshape([.true., .false., .true., .false., &
         .true., .false., .false., .false.], [4, 2])
      type(stepper_t) :: stepper
      type(solid_t) :: solid
      integer :: k, i

      do i = 1, 2
         do k = 1, size(kind)
            stepper = stepper_t()
            call read_one(trim(kind(k)), 1, "NONLINEAR", stepper, error)
            if (allocated(error)) return
            stepper%scene%step%nlgeom = i == 1
            call solid_init(solid, stepper%scene, error)
            if (allocated(error)) return
            call check_true(error, solid%trait%may_lock(1) .eqv. expected(k, i), kind(k))
            call check_true(error, solid%trait%has_mean(1) .eqv. k == 2, "mean of " // kind(k))
         end do
      end do
   end subroutine test_may_lock

   !> det F > 0, and det C = (1 + 2 E11)(1 + 2 E22) - (2 E12)^2 > 0 where the law knows a volume; of
   !> both ends of the strain the second one counts. No powers that are infinite.
   subroutine test_regular(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: far = 2.0_wp*huge(1.0_wp)**0.2_wp
      real(wp), parameter :: strain(3, 9) = reshape([-0.3_wp, 0.0_wp, 0.0_wp, -0.3_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, -0.3_wp, 0.0_wp, 0.0_wp, -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, &
         0.0_wp, 0.5_wp, -0.6_wp, 0.0_wp, 0.0_wp, far, 0.0_wp, 0.0_wp, -0.6_wp, -0.6_wp, 0.1_wp], &
         [3, 9])
      real(wp), parameter :: change(3, 9) = reshape([-0.1_wp, 0.0_wp, 0.0_wp, -0.3_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, -0.3_wp, 0.0_wp, 0.0_wp, 0.2_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.4_wp, 0.0_wp, &
         0.0_wp, 0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.2_wp, 0.2_wp, 0.0_wp], &
         [3, 9])
      logical, parameter :: regular(9) = [.true., .false., .false., .true., .true., .false., &
         .false., .false., .true.]
      type(point_motion_t) :: point
      integer :: k

      point%f_end = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      do k = 1, 9
         point%strain = strain(:, k)
         point%dstrain = change(:, k)
         call check_true(error, point_is_regular(point, .true.) .eqv. regular(k), "volume " &
            // to_text(k))
         call check_true(error, point_is_regular(point, .false.) .eqv. k /= 8, "none " &
            // to_text(k))
      end do
      ! What of a volume is round-off of its terms, which are 2 in all, is none: 64 eps of them.
      do k = 1, 3
         point%dstrain = 0.0_wp
         point%strain = 0.0_wp
         point%strain(k) = no_volume(k, 0.875_wp)
         call check_true(error, .not. point_is_regular(point, .true.), "round-off")
         point%strain(k) = no_volume(k, 1.125_wp)
         call check_true(error, point_is_regular(point, .true.), "hardly any, but some")
      end do
      point%f_end(1, 2) = 2.0_wp
      point%f_end(2, 1) = 0.4_wp
      call check_true(error, point_is_regular(point, .true.), "det F of 0.2")
      point%f_end(2, 1) = 0.6_wp
      call check_true(error, .not. point_is_regular(point, .false.), "and of -0.2")
      point%f_end = far*reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      call check_true(error, .not. point_is_regular(point, .false.), "too large a one")
   end subroutine test_regular

   !> A strain of component `k` alone whose volume is `part` of what counts as round-off.
   pure real(wp) function no_volume(k, part) result(strain)
      integer, intent(in) :: k
      real(wp), intent(in) :: part

      if (k == 3) then
         strain = 1.0_wp - 64.0_wp*part*epsilon(1.0_wp)
      else
         strain = -0.5_wp*(1.0_wp - 128.0_wp*part*epsilon(1.0_wp))
      end if
   end function no_volume

   !> Ends by chance; ends of which lanes 1 to 7 have one large entry each; ends whose volume is
   !> round-off in lanes 1 to 3 and hardly any in 4 to 6.
   subroutine draw_lanes(draw, strain, change, f)
      integer, intent(in) :: draw                !! 1 to 60
      real(wp), intent(out) :: strain(n_lane, 3), change(n_lane, 3), f(n_lane, 2, 2)
      real(wp), parameter :: largest = huge(1.0_wp)**0.2_wp
      real(wp) :: size(7)
      integer :: i

      call shake(strain, merge(0.1_wp, 0.7_wp, draw > 20))
      call shake(change, 0.3_wp)
      call shake(f(:, :, 1), merge(0.1_wp, 0.8_wp, draw > 20))
      call shake(f(:, :, 2), merge(0.1_wp, 0.8_wp, draw > 20))
      f(:, 1, 1) = f(:, 1, 1) + 1.0_wp
      f(:, 2, 2) = f(:, 2, 2) + 1.0_wp
      if (draw <= 20) return
      if (draw <= 40) then
         call draw_random(size)
         size = largest*(0.5_wp + size)
         do i = 1, 3
            strain(i, i) = merge(size(i), -size(i), mod(draw, 4) < 2)
         end do
         f(4, 1, 1) = size(4)
         f(5, 2, 1) = size(5)
         f(6, 1, 2) = size(6)
         f(7, 2, 2) = size(7)
         ! Turned by half a turn det F is the same.
         if (mod(draw, 4) < 2) f(4:7, :, :) = -f(4:7, :, :)
         return
      end if
      strain(:6, :) = 0.0_wp
      change(:6, :) = 0.0_wp
      do i = 1, 3
         strain(i, i) = no_volume(i, 0.875_wp)
         strain(i + 3, i) = no_volume(i, 1.125_wp)
      end do
   end subroutine draw_lanes

   !> Lanes side by side are as one by one; those that are not fit are told, and given strains of
   !> none to compute with.
   subroutine test_regular_lanes(error)
      type(error_t), allocatable, intent(out) :: error
      type(pack_point_t) :: pack
      type(pack_response_t) :: response
      type(point_motion_t) :: point
      real(wp) :: strain(n_lane, 3), change(n_lane, 3), f(n_lane, 2, 2)
      logical :: fit, has_volume
      integer :: draw, l, n_fit

      n_fit = 0
      do draw = 1, 60
         has_volume = mod(draw, 2) == 0
         call draw_lanes(draw, strain, change, f)
         pack%law%strain = strain
         pack%law%dstrain = change
         pack%f_end = f
         response%is_inverted = .false.
         call pack_point_check(has_volume, pack, response)
         do l = 1, n_lane
            point%strain = strain(l, :)
            point%dstrain = change(l, :)
            point%f_end = f(l, :, :)
            fit = point_is_regular(point, has_volume)
            if (fit) n_fit = n_fit + 1
            call check_true(error, fit .neqv. response%is_inverted(l), "draw " // to_text(draw) &
               // ", lane " // to_text(l))
            if (.not. fit) point%strain = 0.0_wp
            if (.not. fit) point%dstrain = 0.0_wp
            call check_near(error, [pack%law%strain(l, :), pack%law%dstrain(l, :)], &
               [point%strain, point%dstrain], 0.0_wp, 1.0_wp, "strains")
         end do
      end do
      call check_true(error, n_fit > 60 .and. n_fit < 60*n_lane - 60, "both kinds")
   end subroutine test_regular_lanes

   !> In space det F > 0, and all leading minors of C, of which diagonal shears and stretches are
   !> given: no two directions turned inside out together.
   subroutine test_regular_space(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: far = 2.0_wp*huge(1.0_wp)**0.1_wp
      integer, parameter :: n = 14
      real(wp), parameter :: strain(6, n) = reshape([ &
         -0.4_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         -0.6_wp, -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, -0.6_wp, -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         -0.6_wp, 0.0_wp, -0.6_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, -0.6_wp, 1.2_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.8_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.2_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.2_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.7_wp, 0.7_wp, 0.7_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, -0.7_wp, 0.7_wp, 0.7_wp, &
         0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.2_wp, 0.0_wp, &
         1.5_wp, 1.5_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, &
         far, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [6, n])
      ! The tenth and the one behind it: 1 - 3 c^2 + 2 c^3 with c = 0.7, and with c = -0.7 once.
      logical, parameter :: regular(n) = [.true., .false., .false., .false., .false., .false., &
         .true., .false., .false., .true., .false., .true., .true., .false.]
      type(space_point_t) :: point
      integer :: k

      do k = 1, n
         point%f_end = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
            1.0_wp], [3, 3])
         point%strain = 0.5_wp*strain(:, k)
         point%dstrain = 0.5_wp*strain(:, k)
         call check_true(error, space_point_is_regular(point, .true.) .eqv. regular(k), "strain " &
            // to_text(k))
         call check_true(error, space_point_is_regular(point, .false.) .eqv. k < n, "without " &
            // "volume " // to_text(k))
         if (k == n) exit
         point%f_end(1, 1) = far
         call check_true(error, .not. space_point_is_regular(point, .false.), "too large a one")
         point%f_end(1, 1) = 1.0_wp
         point%f_end(1, 2:) = [0.5_wp, 0.75_wp]
         point%f_end(2:, 1) = 0.75_wp
         call check_true(error, space_point_is_regular(point, .false.), "det F of 1/16")
         point%f_end(2, 1) = 1.0_wp
         call check_true(error, .not. space_point_is_regular(point, .false.), "and of -1/16")
      end do
      ! Round-off of terms that are 1 + 1 in each row, but for what the shears leave: 64 eps.
      point%strain = 0.0_wp
      point%dstrain = 0.0_wp
      point%f_end = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         1.0_wp], [3, 3])
      do k = 4, 6
         point%strain(k) = 1.0_wp - 112.0_wp*epsilon(1.0_wp)
         call check_true(error, .not. space_point_is_regular(point, .true.), "round-off")
         point%strain(k) = 1.0_wp - 144.0_wp*epsilon(1.0_wp)
         call check_true(error, space_point_is_regular(point, .true.), "hardly any, but some")
         point%strain(k) = 0.0_wp
      end do
   end subroutine test_regular_space

end module test_solid_parts
