!> What elements with corners alone miss of bending: closed forms of a beam, whichever way it lies.
module test_bending
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_bending, only : bending_measure, bending_t
   use emcon_element_kind, only : find_element_kind
   use emcon_element_registry, only : element_kinds_create
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_init, solid_t
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use small_scenes, only : block_t, make_block, poisson, scene_begin, young
   implicit none
   private
   public :: collect_bending

   !> Axes are found in double precision, whatever the state is.
   real(wp), parameter :: tol = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Cells of the beam, their sizes, curvature.
   integer, parameter :: n = 5
   real(wp), parameter :: a = 0.5_wp, b = 0.25_wp, curvature = 0.01_wp
   !> Rubber that hardly changes its volume.
   real(wp), parameter :: shear = 20.0_wp, bulk = 200.0_wp
   !> Directions in which no neighbours lie lessen the curvature by so much.
   real(wp), parameter :: lessened = 1.0_wp/1.001_wp

contains

   subroutine collect_bending(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a beam of quadrilaterals in closed form", test_beam), &
         test_case_t("a beam of parallelograms in closed form", test_slanted), &
         test_case_t("whichever way it lies and turns", test_turned), &
         test_case_t("body by body", test_bodies), &
         test_case_t("bars in the plane and in space, volume in the mean too", test_bars), &
         test_case_t("two triangles, two tetrahedra", test_simplices), &
         test_case_t("uniform strains, those of circles too", test_uniform)]
   end subroutine collect_bending

   pure function rotation(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(2, 2)

      r = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
   end function rotation

   !> A beam along the direction of `angle`, bent, and turned by `turn` about the origin.
   subroutine make_beam(scene, name, rows, angle, turn, u)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: rows
      real(wp), intent(in) :: angle, turn
      real(wp), allocatable, intent(out) :: u(:, :)
      type(block_t) :: block

      call make_block(scene, name, [n, rows], block)
      scene%x(1, :) = a*scene%x(1, :)
      scene%x(2, :) = b*(scene%x(2, :) - 0.5_wp*rows)
      u = scene%x
      u(1, :) = -curvature*scene%x(1, :)*scene%x(2, :)
      u(2, :) = 0.5_wp*curvature*scene%x(1, :)**2
      scene%x = matmul(rotation(angle), scene%x)
      u = matmul(rotation(angle), u)
      u = matmul(rotation(turn), scene%x + u) - scene%x
   end subroutine make_beam

   subroutine measure(scene, u, nlgeom, bending, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)
      logical, intent(in) :: nlgeom
      type(bending_t), intent(out) :: bending
      type(error_t), allocatable, intent(out) :: error
      type(solid_t) :: solid

      call solid_init(solid, scene, error)
      if (allocated(error)) return
      call bending_measure(bending, solid, spread(1, 1, size(u, 2)), scene%x, u, &
         merge(1.0_wp, 0.0_wp, nlgeom))
   end subroutine measure

   !> Strains along it, -k y, whose mean square is k^2 b^2/12; in place of the strain across it,
   !> -lambda/(lambda + 2 mu) of that, none; and shear with the mean square k^2 a^2/12.
   subroutine test_beam(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = young/(2.0_wp*(1.0_wp + poisson))
      real(wp), parameter :: lambda = 2.0_wp*mu*poisson/(1.0_wp - 2.0_wp*poisson)
      real(wp), parameter :: part = 0.5_wp*curvature**2/12.0_wp*n*a*b
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: u(:, :)
      real(wp) :: missed

      call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
      call measure(scene, u, .false., bending, error)
      if (allocated(error)) return
      call check_equal(error, bending%element, [1], "first element")
      call check_near(error, bending%strain, [part*((lambda + 2.0_wp*mu)*b**2 + mu*a**2)], tol, &
         bending%strain(1), "strain energy")
      call check_near(error, bending%missed, [lessened**2*part*(lambda**2/(lambda + 2.0_wp*mu) &
         *b**2 + mu*a**2)], tol, bending%missed(1), "missed")
      missed = bending%missed(1)
      call measure(scene, u + 0.25_wp*scene%x, .false., bending, error)
      if (allocated(error)) return
      call check_near(error, bending%missed, [missed], tol, missed, "whatever it is stretched by")
      call measure(scene, 0.0_wp*u, .false., bending, error)
      if (allocated(error)) return
      call check_near(error, [bending%strain, bending%missed], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "at rest")
   end subroutine test_beam

   !> Cells whose sides across lean by the shift 2 c over the thickness. With -1 < p, q < 1 along
   !> the sides nodes take k p q (-a b/4, a c/2) of a plate, which strains along itself alone.
   subroutine test_slanted(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: mu = young/(2.0_wp*(1.0_wp + poisson))
      real(wp), parameter :: lambda = 2.0_wp*mu*poisson/(1.0_wp - 2.0_wp*poisson)
      real(wp), parameter :: c = 0.1_wp, ratio = lambda/(lambda + 2.0_wp*mu)
      !> Mean squares, per square of the curvature: the strain across that is too much, and shear.
      real(wp), parameter :: across = ((a*c/b)**2 + (2.0_wp*c**2/b + 0.5_wp*ratio*b)**2)/3.0_wp, &
         shear = (0.25_wp*a**2 + 4.0_wp*c**2)/3.0_wp
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: u(:, :)
      integer :: k
      real(wp) :: angle

      do k = 0, 3
         angle = 0.7_wp*k
         call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
         scene%x(1, :) = scene%x(1, :) + (2.0_wp*c/b)*scene%x(2, :)
         u(1, :) = -curvature*scene%x(1, :)*scene%x(2, :)
         u(2, :) = 0.5_wp*curvature*scene%x(1, :)**2
         scene%x = matmul(rotation(angle), scene%x)
         u = matmul(rotation(angle), u)
         call measure(scene, u, .false., bending, error)
         if (allocated(error)) return
         call check_near(error, bending%missed, [0.5_wp*(lessened*curvature)**2*n*a*b &
            *((lambda + 2.0_wp*mu)*across + mu*shear)], tol, bending%missed(1), "missed")
      end do
   end subroutine test_slanted

   !> Energies do not change as the beam lies another way, nor, with large rotations, as it turns.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: name(3) = [character(len=5) :: "CPE4", "CPE3", "CPE4"]
      real(wp), parameter :: angles(3) = [0.3_wp, 1.2_wp, -2.0_wp]
      type(scene_t) :: scene
      type(bending_t) :: bending, other
      real(wp), allocatable :: u(:, :)
      integer :: k, i

      do k = 1, 3
         call make_beam(scene, trim(name(k)), merge(2, 1, k == 3), 0.0_wp, 0.0_wp, u)
         call measure(scene, u, .true., bending, error)
         if (allocated(error)) return
         call check_true(error, bending%missed(1) > 0.1_wp*bending%strain(1) .and. &
            bending%strain(1) > 0.0_wp, "it is bent")
         do i = 1, size(angles)
            call make_beam(scene, trim(name(k)), merge(2, 1, k == 3), angles(i), 0.7_wp*i, u)
            call measure(scene, u, .true., other, error)
            if (allocated(error)) return
            call check_near(error, [other%strain, other%missed], [bending%strain, &
               bending%missed], tol/curvature**2, bending%strain(1), trim(name(k)) &
               // ", way " // to_text(i))
         end do
      end do
   end subroutine test_turned

   !> The second of two beams is at rest; what belongs to no body is none, rigid ones do not strain.
   subroutine test_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(bending_t) :: bending, alone
      real(wp), allocatable :: u(:, :)
      integer :: body(2*(n + 1))

      call make_beam(scene, "CPE4", 1, 0.0_wp, 0.0_wp, u)
      call measure(scene, u, .false., alone, error)
      if (allocated(error)) return
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      body = 2
      call bending_measure(bending, solid, body, scene%x, u, 0.0_wp)
      call check_equal(error, bending%element, [0, 1], "elements")
      call check_near(error, [bending%strain, bending%missed], [0.0_wp, alone%strain(1), 0.0_wp, &
         alone%missed(1)], tol, alone%strain(1), "of the second body")
      body(:2) = 1
      call bending_measure(bending, solid, body, scene%x, u, 0.0_wp)
      call check_equal(error, bending%element, [1, 3], "first elements of both")
      call check_near(error, bending%strain, [2.0_wp, 3.0_wp]/n*alone%strain(1), tol, &
         alone%strain(1), "two elements and three")
      call check_near(error, bending%missed, [2.0_wp, 3.0_wp]/n*alone%missed(1), tol, &
         alone%missed(1), "and what they miss")
      body = 0
      call bending_measure(bending, solid, body, scene%x, u, 0.0_wp)
      call check_equal(error, size(bending%strain), 0, "of none")
      body = 1
      solid%trait%is_rigid(1) = .true.
      call bending_measure(bending, solid, body, scene%x, u, 0.0_wp)
      call check_equal(error, bending%element, [2], "but for the rigid one")
      call check_near(error, bending%strain, alone%strain*(n - 1)/n, tol, alone%strain(1), &
         "four of five")
      solid%trait%is_stiff_bent = .false.
      call bending_measure(bending, solid, body, scene%x, u, 0.0_wp)
      call check_near(error, bending%missed, [0.0_wp], 0.0_wp, 1.0_wp, "elements that follow")
   end subroutine test_bodies

   !> A scene of `n_element` elements of one kind, of nearly incompressible rubber.
   subroutine make_few(scene, name, x, node)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node)
      integer, intent(in) :: node(:, :)          !! (., n_element)
      integer :: i

      call scene_begin(scene)
      scene%n_dim = size(x, 1)
      scene%is_axial = name(:3) == "CAX"
      call element_kinds_create(scene%n_dim, scene%element%kinds)
      scene%material(1)%law = law_code("neo hooke")
      scene%material(1)%constant = [0.5_wp*shear, 2.0_wp/bulk]
      deallocate(scene%element%node, scene%x, scene%element%origin)
      scene%x = x
      scene%element%node = node
      scene%element%kind = spread(find_element_kind(scene%element%kinds, name), 1, size(node, 2))
      scene%element%section = spread(1, 1, size(node, 2))
      scene%element%label = [(i, i = 1, size(node, 2))]
      allocate(scene%element%origin(size(node, 2)))
   end subroutine make_few

   !> Some rotation of the plane or of space: `a` along no axis.
   pure function some_rotation(n_dim) result(r)
      integer, intent(in) :: n_dim
      real(wp) :: r(n_dim, n_dim)

      r = 0.0_wp
      r(n_dim, n_dim) = 1.0_wp
      r(:2, :2) = rotation(0.7_wp)
      if (n_dim == 3) r(:, 2:) = matmul(r(:, 2:), rotation(1.1_wp))
      if (n_dim == 3) r(:, :2) = matmul(r(:, :2), rotation(-0.4_wp))
   end function some_rotation

   !> Two elements along x that are bent in the plane of x and the last axis; then the same in some
   !> other direction, and with large rotations. The elements have no strain across; with the mean
   !> of the volume change they resist as if lambda were -2 mu/3.
   subroutine test_bars(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: name(4) = [character(len=5) :: "CPE4", "CPE4H", "C3D8", &
         "C3D8H"]
      real(wp), parameter :: lambda = bulk - 2.0_wp*shear/3.0_wp, width = 0.75_wp
      real(wp), parameter :: plate = 4.0_wp*shear*(lambda + shear)/(lambda + 2.0_wp*shear)
      !> Corners across a bar.
      real(wp), parameter :: across(2, 4) = reshape(0.5_wp*[-width, -b, width, -b, width, b, &
         -width, b], [2, 4])
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: x(:, :), u(:, :)
      integer, allocatable :: node(:, :)
      real(wp) :: area, of_element, of_bending, missed
      integer :: j, k, n_dim, turned

      do k = 1, size(name)
         n_dim = merge(2, 3, k <= 2)
         if (allocated(x)) deallocate(x, node)
         if (n_dim == 2) then
            allocate(x(2, 6))
            node = reshape([1, 2, 5, 4, 2, 3, 6, 5], [4, 2])
            x(2, :) = 0.5_wp*b*[-1, -1, -1, 1, 1, 1]
            x(1, :) = a*[0, 1, 2, 0, 1, 2]
            area = a*b
         else
            allocate(x(3, 12))
            node = reshape([1, 5, 6, 2, 4, 8, 7, 3, 5, 9, 10, 6, 8, 12, 11, 7], [8, 2])
            do j = 0, 2
               x(1, 4*j + 1:4*j + 4) = a*j
               x(2:, 4*j + 1:4*j + 4) = across
            end do
            area = a*b*width
         end if
         u = 0.0_wp*x
         u(1, :) = -curvature*x(1, :)*x(n_dim, :)
         u(n_dim, :) = 0.5_wp*curvature*x(1, :)**2
         of_element = (merge(-2.0_wp*shear/3.0_wp, lambda, mod(k, 2) == 0) + 2.0_wp*shear)*b**2 &
            + shear*a**2
         of_bending = plate*b**2
         missed = of_element - of_bending
         if (mod(k, 2) == 1) missed = lambda**2/(lambda + 2.0_wp*shear)*b**2 + shear*a**2
         do turned = 0, 1
            associate (turn => some_rotation(n_dim))
               if (turned == 1) x = matmul(turn, x)
               if (turned == 1) u = matmul(turn, u)
            end associate
            call make_few(scene, trim(name(k)), x, node)
            call measure(scene, u, .false., bending, error)
            if (allocated(error)) return
            associate (part => 2.0_wp*area*0.5_wp*curvature**2/12.0_wp)
               call check_near(error, bending%strain, [part*of_element], tol, part*lambda*a**2, &
                  trim(name(k)) // ": strain energy")
               call check_near(error, bending%missed, [lessened**2*part*missed], tol, &
                  part*lambda*a**2, trim(name(k)) // ": missed")
            end associate
            if (turned == 0 .and. .not. allocated(error)) call stretch()
            if (allocated(error)) return
         end do
         call turn_large()
         if (allocated(error)) return
      end do

   contains

      !> Of a stretch along x elements of all kinds store the same, and are not bent.
      subroutine stretch()
         real(wp) :: pulled(size(x, 1), size(x, 2))

         pulled = 0.0_wp
         pulled(1, :) = curvature*x(1, :)
         call measure(scene, pulled, .false., bending, error)
         if (allocated(error)) return
         call check_near(error, bending%strain, [area*(lambda + 2.0_wp*shear)*curvature**2], tol, &
            lambda*area*curvature**2, trim(name(k)) // ": stretched")
         call check_near(error, bending%missed, [0.0_wp], tol, lambda*area*curvature**2, &
            trim(name(k)) // ": not bent")
      end subroutine stretch

      !> With large rotations a turn of the bent bar changes nothing.
      subroutine turn_large()
         type(bending_t) :: other

         call measure(scene, u, .true., bending, error)
         if (allocated(error)) return
         associate (turn => some_rotation(n_dim))
            call measure(scene, matmul(turn, x + u) - x, .true., other, error)
         end associate
         if (allocated(error)) return
         call check_near(error, [other%strain, other%missed], [bending%strain, bending%missed], &
            tol/curvature**2, bending%strain(1), trim(name(k)) // ": turned")
      end subroutine turn_large

   end subroutine test_bars

   !> On either side of a face at x = 0 an element whose tip lies at x and some `tip` across; the
   !> tip of the second is moved across. Each turns against the other, about what is across x and
   !> the motion, and bends in the direction of the motion.
   subroutine test_simplices(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: lambda = bulk - 2.0_wp*shear/3.0_wp
      real(wp), parameter :: side(2) = [0.5_wp, 0.75_wp], tip(2) = [0.2_wp, 0.3_wp], &
         far(2) = [-0.5_wp, 0.4_wp], move(2) = 1.0e-3_wp*[2.0_wp, -1.0_wp]
      type(scene_t) :: scene
      type(bending_t) :: bending
      real(wp), allocatable :: x(:, :), u(:, :)
      integer, allocatable :: node(:, :)
      real(wp) :: missed, curved, normal(3)
      integer :: i, n

      do n = 2, 3
         if (allocated(x)) deallocate(x)
         allocate(x(n, n + 2), source=0.0_wp)
         do i = 2, n
            x(i, i) = side(i - 1)
            x(i, n + 1:) = tip(i - 1)
         end do
         x(1, n + 1:) = far
         u = 0.0_wp*x
         u(2:, n + 2) = move(:n - 1)
         node = reshape([(i, i = 1, n + 1), (i, i = 1, n), n + 2], [n + 1, 2])
         ! Seen from a tip the nodes of the face go round to the left.
         node(:2, merge(1, 2, n == 3)) = [2, 1]
         call make_few(scene, merge("CPE3", "C3D4", n == 2), x, node)
         call measure(scene, u, .false., bending, error)
         if (allocated(error)) return
         normal = 0.0_wp
         normal(2:n) = move(:n - 1)/norm2(move(:n - 1))
         ! The rotation is half of the slope, and the centres differ by this part of the tips.
         curved = lessened*0.5_wp*norm2(move(:n - 1))/far(2)/((far(2) - far(1))/real(n + 1, wp))
         missed = 0.0_wp
         do i = 1, 2
            missed = missed + missed_in_one(far(i))
         end do
         call check_near(error, bending%missed, [missed], tol, missed, "missed")
      end do

   contains

      !> In the element whose tip is at `height`, of a plate with this curvature.
      real(wp) function missed_in_one(height) result(energy)
         real(wp), intent(in) :: height          !! < 0: on the other side
         real(wp), dimension(n + 1) :: along, across
         real(wp), dimension(3, n + 1) :: y, v
         real(wp) :: slope(3, 3), plane(3, 3), volume, trace
         integer :: k

         y = 0.0_wp
         y(:n, :n) = x(:, :n)
         y(:n, n + 1) = [height, tip(:n - 1)]
         y = y - spread(sum(y, 2)/real(n + 1, wp), 2, n + 1)
         along = y(1, :)
         across = matmul(normal, y)
         v = 0.0_wp
         do k = 1, n + 1
            v(:, k) = curved*(0.5_wp*along(k)**2*normal)
            v(1, k) = v(1, k) - curved*across(k)*along(k)
         end do
         ! Slopes along the sides of the face, and from there along x to the tip.
         slope = 0.0_wp
         do k = 2, n
            slope(:, k) = (v(:, k) - v(:, 1))/side(k - 1)
         end do
         slope(:, 1) = v(:, n + 1) - v(:, 1)
         do k = 2, n
            slope(:, 1) = slope(:, 1) - slope(:, k)*tip(k - 1)
         end do
         slope(:, 1) = slope(:, 1)/height
         slope = 0.5_wp*(slope + transpose(slope))
         volume = product(side(:n - 1))*abs(height)/merge(2.0_wp, 6.0_wp, n == 2)
         plane = slope - spread(normal, 2, 3)*spread(matmul(normal, slope), 1, 3)
         plane = plane - spread(matmul(plane, normal), 2, 3)*spread(normal, 1, 3)
         trace = plane(1, 1) + plane(2, 2) + plane(3, 3)
         plane = plane - lambda/(lambda + 2.0_wp*shear)*trace*spread(normal, 2, 3) &
            *spread(normal, 1, 3)
         slope = slope - plane
         trace = slope(1, 1) + slope(2, 2) + slope(3, 3)
         energy = volume*(0.5_wp*lambda*trace**2 + shear*sum(slope**2))
         ! What is linear across the plate, by E': the mean of the square of the distance.
         energy = energy + volume*2.0_wp*shear*(lambda + shear)/(lambda + 2.0_wp*shear) &
            *curved**2*sum(across**2)/real((n + 1)*(n + 2), wp)
      end function missed_in_one

   end subroutine test_simplices

   !> u = c X with a small c: the strain c in each direction, that of circles with rings; none of it
   !> is missed, whatever resists the change of volume.
   subroutine test_uniform(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: c = 1.0e-3_wp, pi = 2.0_wp*acos(0.0_wp)
      real(wp), parameter :: round = 0.5_wp*pi*(2.25_wp**2 - 1.0_wp)
      real(wp), parameter :: ring(2, 4) = reshape([1.0_wp, 0.0_wp, 2.25_wp, 0.0_wp, 2.25_wp, &
         0.5_wp, 1.0_wp, 0.5_wp], [2, 4])
      integer :: i

      call stretch("CAX3", ring, reshape([1, 2, 3, 1, 3, 4], [3, 2]), round)
      call stretch("CAX4", ring, reshape([1, 2, 3, 4], [4, 1]), round)
      call stretch("C3D8H", reshape([0.0_wp, 0.0_wp, 0.0_wp, a, 0.0_wp, 0.0_wp, a, b, 0.0_wp, &
         0.0_wp, b, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, a, 0.0_wp, 1.0_wp, a, b, 1.0_wp, 0.0_wp, b, &
         1.0_wp], [3, 8]), reshape([(i, i = 1, 8)], [8, 1]), a*b)

   contains

      subroutine stretch(name, x, node, volume)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: x(:, :), volume
         integer, intent(in) :: node(:, :)
         type(scene_t) :: scene
         type(bending_t) :: bending

         if (allocated(error)) return
         call make_few(scene, name, x, node)
         call measure(scene, c*x, .false., bending, error)
         if (allocated(error)) return
         call check_near(error, bending%strain, [4.5_wp*bulk*c**2*volume], tol, &
            bending%strain(1), name // ": strain energy")
         call check_near(error, bending%missed, [0.0_wp], tol**2, bending%strain(1), &
            name // ": missed")
      end subroutine stretch

   end subroutine test_uniform

end module test_bending
