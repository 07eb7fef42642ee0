!> Elements of solids of revolution, distorted, with each law, and pressure on their edges.
module test_element_axial
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_element_axial_plane, only : axial_element_hold, axial_element_respond
   use emcon_element_kind, only : element_row_t
   use emcon_element_registry, only : element_row
   use emcon_element_space, only : space_motion_t, space_part_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_law_space, only : law_response_space, space_response_t
   use emcon_pressure_ring_plane, only : press_ring, press_ring_stiffness
   use emcon_scene, only : scene_t
   use emcon_shape, only : m => max_plane_nodes
   use emcon_solid, only : solid_init, solid_t
   use emcon_text, only : to_text
   use kind_rows, only : law_code, n_plane_row, n_axial_row
   use small_scenes, only : scene_begin, shake, young
   implicit none
   private
   public :: collect_element_axial

   real(wp), parameter :: eps = epsilon(1.0_wp), two_pi = 8.0_wp*atan(1.0_wp)
   !> Sums over up to nine points and nodes, each term of some dozen roundings.
   real(wp), parameter :: tol = 512.0_wp*eps
   integer, parameter :: n_law = 6

   !> One distorted element of size 1 at radii about 1.5, with its law.
   type :: sample_t
      character(len=:), allocatable :: what
      integer :: n = 0                           !! nodes
      integer :: n_corner = 0
      logical :: nlgeom = .true.
      real(wp) :: x(2, m) = 0.0_wp
      type(solid_t) :: solid
   end type sample_t

contains

   subroutine collect_element_axial(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity and force along the axis of a step", test_step), &
         test_case_t("sizes of forces, which no sign changes", test_sizes), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("patch: energy and work of a uniform strain", test_patch), &
         test_case_t("Cauchy stress, by the whole deformation gradient", test_stress), &
         test_case_t("a motion along the axis costs nothing", test_along), &
         test_case_t("pressed to nothing, in the plane or around the axis", test_pressed), &
         test_case_t("rank", test_rank), &
         test_case_t("mass and centre are those of the ring", test_mass), &
         test_case_t("pressure: work on a closed section", test_pressure), &
         test_case_t("pressure: tangent of a displaced edge", test_pressure_tangent), &
         test_case_t("pressure on an edge of any form: force along the axis", test_edge)]
   end subroutine collect_element_axial

   !> The corners moved, nodes between them in the middle, then moved by up to a quarter of `bend`.
   subroutine make_sample(kind, law, nlgeom, bend, sample, error)
      integer, intent(in) :: kind, law
      logical, intent(in) :: nlgeom
      real(wp), intent(in) :: bend
      type(sample_t), intent(out) :: sample
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(element_row_t) :: row
      real(wp), allocatable :: place(:, :)
      real(wp) :: move(2, m)
      integer :: i, n

      call scene_begin(scene)
      row = element_row(n_plane_row() + kind)
      n = row%n_node
      sample%n_corner = row%n_corner
      call scene%element%kinds(n_plane_row() + kind)%shape%places(place)
      if (sample%n_corner == 4) place = 0.5_wp*place
      call shake(move, 0.2_wp)
      place(1, :) = place(1, :) + 1.5_wp
      place(:, :row%n_corner) = place(:, :row%n_corner) + move(:, :row%n_corner)
      call shake(move, 0.25_wp*bend)
      do i = row%n_corner + 1, n
         associate (a => i - row%n_corner)
            place(:, i) = 0.5_wp*(place(:, a) + place(:, 1 + mod(a, row%n_corner))) + move(:, i)
         end associate
      end do
      sample%what = trim(row%name) // ", law " // to_text(law) // ", nlgeom " &
         // to_text(merge(1, 0, nlgeom))
      deallocate(scene%element%node, scene%node%label, scene%node%origin, scene%x, scene%u0, &
         scene%v0, scene%element%origin)
      allocate(scene%element%node(n, 1), scene%node%label(n), scene%node%origin(n), &
         scene%element%origin(1))
      scene%is_axial = .true.
      scene%element%node(:, 1) = [(i, i = 1, n)]
      scene%node%label = scene%element%node(:, 1)
      scene%element%label = [1]
      scene%element%kind = [n_plane_row() + kind]
      scene%element%section = [1]
      scene%x = place
      scene%u0 = 0.0_wp*place
      scene%v0 = 0.0_wp*place
      call set_law(law, scene)
      sample%n = n
      sample%nlgeom = nlgeom
      sample%x(:, :n) = place
      call solid_init(sample%solid, scene, error)
   end subroutine make_sample

   subroutine set_law(law, scene)
      integer, intent(in) :: law                 !! 1..n_law
      type(scene_t), intent(inout) :: scene
      character(len=18), parameter :: names(n_law) = [character(len=18) :: "linear", &
         "coupled neo hooke", "neo hooke", "mooney-rivlin", "yeoh", "ogden 2"]
      real(wp), parameter :: c = 0.2_wp*young, d = 1.0_wp/young

      scene%material(1)%law = law_code(names(law))
      select case (law)
      case (3)
         scene%material(1)%constant = [c, d]
      case (4)
         scene%material(1)%constant = [c, 0.5_wp*c, d]
      case (5)
         scene%material(1)%constant = [c, 0.1_wp*c, 0.1_wp*c, d, d, d]
      case (6)
         scene%material(1)%constant = [c, 1.3_wp, 0.5_wp*c, -2.5_wp, d, d]
      end select
   end subroutine set_law

   !> The response, whatever stands in `part` before.
   subroutine respond(sample, u0, du, with_tangent, part)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: u0(2, m), du(2, m)
      logical, intent(in) :: with_tangent
      type(space_part_t), intent(inout) :: part
      type(space_motion_t) :: motion

      motion%square = merge(1.0_wp, 0.0_wp, sample%nlgeom)
      motion%from(:2, :m) = u0
      motion%by(:2, :m) = du
      part = space_part_t(energy=1.0_wp, is_inverted=.true.)
      part%force(:2, :sample%n) = 2.0_wp
      part%magnitude(:2, :sample%n) = 3.0_wp
      part%tangent(:2, :sample%n, :2, :sample%n) = merge(4.0_wp, 0.0_wp, with_tangent)
      call axial_element_respond(sample%solid%held%single(1), &
         sample%solid%law(sample%solid%law_of(1))%law, motion, with_tangent, part)
   end subroutine respond

   !> A start up to 3 % off, a motion of up to 4 %, with nlgeom and an eighth of the radius more.
   subroutine draw(sample, u0, du)
      type(sample_t), intent(in) :: sample
      real(wp), intent(out) :: u0(2, m), du(2, m)

      call shake(u0, 0.03_wp)
      call shake(du, 0.04_wp)
      if (sample%nlgeom) du(1, :) = du(1, :) + 0.125_wp*sample%x(1, :)
      u0(:, sample%n + 1:) = 0.0_wp
      du(:, sample%n + 1:) = 0.0_wp
   end subroutine draw

   !> f.du = W1 - W0; no net force along the axis.
   subroutine test_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: start, step
      real(wp) :: u0(2, m), du(2, m), zero(2, m)
      integer :: i, k

      zero = 0.0_wp
      do i = 0, 2*n_law*n_axial_row() - 1
         call make_sample(1 + mod(i/n_law, n_axial_row()), 1 + mod(i, n_law), &
            i >= n_law*n_axial_row(), 0.2_wp, sample, error)
         if (allocated(error)) return
         do k = 1, 4
            call draw(sample, u0, du)
            if (k == 4) du = scale(du, -20)
            call respond(sample, u0, zero, .false., start)
            call respond(sample, u0, du, .false., step)
            call check_true(error, .not. step%is_inverted, sample%what // ": is not inverted")
            call check_near(error, sum(step%force(:2, :m)*du), step%energy - start%energy, tol, &
               sum(step%magnitude(:2, :m)*abs(du)) + merge(start%energy, 0.0_wp, k == 4), &
               sample%what)
            call check_near(error, sum(step%force(2, :)), 0.0_wp, tol, sum(step%magnitude), &
               sample%what // ": force")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_step

   !> Of the linear law at small strains forces turn round with the motion, their sizes stay; no
   !> force is larger than its size.
   subroutine test_sizes(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: there, back
      real(wp) :: zero(2, m), du(2, m)
      integer :: i, k

      do i = 1, n_axial_row()
         call make_sample(i, 1, .false., 0.2_wp, sample, error)
         if (allocated(error)) return
         do k = 1, 4
            call draw(sample, zero, du)
            zero = 0.0_wp
            call respond(sample, zero, du, .false., there)
            call respond(sample, zero, -du, .false., back)
            call check_near(error, back%force(:2, :m), -there%force(:2, :m), tol, young, &
               sample%what // ": force")
            call check_near(error, back%magnitude(:2, :m), there%magnitude(:2, :m), tol, young, &
               sample%what // ": size")
            call check_true(error, all(abs(there%force(:2, :m)) <= (1.0_wp + tol) &
               *there%magnitude(:2, :m)), sample%what // ": is its size at most")
         end do
      end do
   end subroutine test_sizes

   !> A motion that leaves the part `left` of one length at the point next to the axis: along the
   !> axis, along the radius or of the circle, and all of the others there. With a law of the volume
   !> the square has to be more than 64 roundings, twice as many of the area, whose terms come to 2;
   !> the other way round it is inverted.
   subroutine test_pressed(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: some(4) = [1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp] &
         *sqrt(64.0_wp*[0.85_wp, 1.15_wp, 0.85_wp, 1.15_wp]*eps)
      type(sample_t) :: sample
      type(space_part_t) :: part
      real(wp) :: u(2, m), zero(2, m), r, left(4)
      integer :: law, way, k

      zero = 0.0_wp
      do law = 1, 3, 2
         call make_sample(1, law, .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         associate (x => sample%x, n => sample%n)
            r = 1.0_wp/maxval(sum(sample%solid%held%single(1)%circle(:n, :), 1))
            do way = 1, 3
               left = merge(sqrt(2.0_wp), 1.0_wp, way < 3)*some
               do k = 1, size(left)
                  u = 0.0_wp
                  select case (way)
                  case (1)
                     u(2, :n) = (left(k) - 1.0_wp)*x(2, :n)
                  case (2)
                     u(1, :n) = (left(k) - 1.0_wp)*(x(1, :n) - r)
                  case default
                     u(1, :n) = (left(k) - 1.0_wp)*r
                  end select
                  call respond(sample, 0.5_wp*u, 0.5_wp*u, .false., part)
                  call check_true(error, part%is_inverted .eqv. (left(k) < 0.0_wp .or. k == 1 &
                     .and. law == 3), sample%what // ", way " // to_text(way) // ", case " &
                     // to_text(k))
                  call respond(sample, zero, 0.5_wp*u, .false., part)
                  call check_true(error, .not. part%is_inverted, "half of it")
               end do
            end do
            do k = 1, 2
               u = 0.0_wp
               u(k, :n) = huge(1.0_wp)**0.11_wp*x(k, :n)
               call respond(sample, zero, u, .false., part)
               call check_true(error, part%is_inverted, "beyond what energies can be told of")
               ! Each line turned towards the other: det F is 1/5, and -1/5.
               u(1, :n) = 2.0_wp*(x(2, :n) - minval(x(2, :n)))
               u(2, :n) = merge(0.4_wp, 0.6_wp, k == 1)*x(1, :n)
               call respond(sample, zero, u, .false., part)
               call check_true(error, part%is_inverted .eqv. k == 2, sample%what // ", turned")
            end do
         end associate
      end do
   end subroutine test_pressed

   !> sigma = F S F^T/det F with F of three rows; E11, E22, 2 E12, E33 of C = F^T F. Of small
   !> strains S by the symmetric part of the gradient.
   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_motion_t) :: motion
      type(space_response_t) :: response
      real(wp), dimension(3, 3) :: h, e, f, s
      real(wp) :: grad(2, 2), stress(6, 16), strain(6, 16), one(6)
      integer :: i, k

      do i = 0, 2*n_law - 1
         call make_sample(n_axial_row(), 1 + mod(i, n_law), i < n_law, 0.2_wp, sample, error)
         if (allocated(error)) return
         call shake(grad, 0.2_wp)
         motion%square = merge(1.0_wp, 0.0_wp, sample%nlgeom)
         associate (x => sample%x, n => sample%n, geometry => sample%solid%held%single(1), &
               law => sample%solid%law(sample%solid%law_of(1))%law)
            motion%from(:2, :n) = matmul(grad, x(:, :n))
            call axial_element_hold(geometry, law, motion, stress, strain)
            do k = 1, geometry%n_gp
               h = 0.0_wp
               h(:2, :2) = grad
               h(3, 3) = dot_product(motion%from(1, :n), geometry%circle(:n, k))
               f = motion%square*h
               e = 0.5_wp*(h + transpose(h) + matmul(transpose(f), f))
               f = f + reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
               one = [e(1, 1), e(2, 2), e(3, 3), 2.0_wp*e(1, 2), 0.0_wp, 0.0_wp]
               call law_response_space(law, one, 0.0_wp*one, response)
               s = 0.0_wp
               s(1, 1) = response%stress(1)
               s(2, 2) = response%stress(2)
               s(3, 3) = response%stress(3)
               s(1, 2) = response%stress(4)
               s(2, 1) = s(1, 2)
               s = matmul(f, matmul(s, transpose(f)))/determinant(f)
               call check_near(error, stress(:, k), [s(1, 1), s(2, 2), s(3, 3), s(1, 2), 0.0_wp, &
                  0.0_wp], tol, young, sample%what // ": stress")
               call check_near(error, strain(:, k), [one([1, 2, 4, 3]), 0.0_wp, 0.0_wp], tol, &
                  1.0_wp, sample%what // ": strain")
            end do
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_stress

   !> Of three rows.
   pure real(wp) function determinant(a)
      real(wp), intent(in) :: a(3, 3)

      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) &
         - a(1, 2)*(a(2, 1)*a(3, 3) - a(2, 3)*a(3, 1)) &
         + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
   end function determinant

   !> Central differences over four points, of step h = eps^(0.3)/4: an error of order h^4 =
   !> eps^(1.2)/256 and one of eps/h = 4 eps^(0.7). Yeoh's (J - 1)^6 bends over longer steps.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step, near(2), far(2)
      real(wp) :: u0(2, m), du(2, m), way(2, m), h
      integer :: a, i, j

      h = 0.25_wp*eps**0.3_wp
      do i = 0, n_law*n_axial_row() - 1
         call make_sample(1 + i/n_law, 1 + mod(i, n_law), mod(i, 3) > 0, 0.2_wp, sample, error)
         if (allocated(error)) return
         call draw(sample, u0, du)
         call respond(sample, u0, du, .true., step)
         do j = 1, sample%n
            do a = 1, 2
               way = 0.0_wp
               way(a, j) = h
               call respond(sample, u0, du + way, .false., near(1))
               call respond(sample, u0, du - way, .false., near(2))
               call respond(sample, u0, du + 2.0_wp*way, .false., far(1))
               call respond(sample, u0, du - 2.0_wp*way, .false., far(2))
               call check_near(error, step%tangent(:2, :m, a, j), &
                  (8.0_wp*(near(1)%force(:2, :m) - near(2)%force(:2, :m)) &
                  - (far(1)%force(:2, :m) - far(2)%force(:2, :m)))/(12.0_wp*h), &
                  800.0_wp*eps**0.7_wp, two_pi*young, sample%what)
            end do
         end do
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> u = (a r, b y + c r): the circle grows as the radius does, and the strain is uniform. W times
   !> the volume of the ring, 2 pi int r, and the work of the forces on such fields.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      type(space_response_t) :: state
      real(wp), parameter :: a = 0.1_wp, b = -0.15_wp, c = 0.2_wp
      real(wp) :: u0(2, m), zero(2, m), e(6), s(6), volume, two
      integer :: i

      zero = 0.0_wp
      do i = 0, 2*n_law*n_axial_row() - 1
         call make_sample(1 + mod(i/n_law, n_axial_row()), 1 + mod(i, n_law), &
            i >= n_law*n_axial_row(), 0.0_wp, sample, error)
         if (allocated(error)) return
         u0(1, :) = a*sample%x(1, :)
         u0(2, :) = b*sample%x(2, :) + c*sample%x(1, :)
         two = merge(1.0_wp, 0.0_wp, sample%nlgeom)
         e = [a + 0.5_wp*two*(a*a + c*c), b + 0.5_wp*two*b*b, a + 0.5_wp*two*a*a, &
            c*(1.0_wp + two*b), 0.0_wp, 0.0_wp]
         call law_response_space(sample%solid%law(1)%law, e, 0.0_wp*e, state)
         volume = ring(sample%x(:, :sample%n_corner), .false.)
         call check_near(error, sum(sample%solid%held%single(1)%weight), volume, tol, volume, &
            sample%what // ": volume")
         call respond(sample, u0, zero, .false., step)
         call check_near(error, step%energy, volume*state%energy, tol, young, &
            sample%what // ": energy")
         s = volume*state%stress
         call check_near(error, sum(step%force(1, :m)*sample%x(1, :)), &
            (1.0_wp + two*a)*(s(1) + s(3)), tol, two_pi*young, sample%what // ": radial")
         call check_near(error, sum(step%force(2, :m)*sample%x(2, :)), &
            (1.0_wp + two*b)*s(2) + two*c*s(4), tol, two_pi*young, sample%what // ": axial")
         if (allocated(error)) return
      end do
   end subroutine test_patch

   !> 2 pi int r dA of a polygon, or 2 pi int r y dA: by its sides, from the theorem of Green.
   pure real(wp) function ring(x, times_y)
      real(wp), intent(in) :: x(:, :)            !! (2, n) corners
      logical, intent(in) :: times_y
      real(wp) :: cross
      integer :: i, j

      ring = 0.0_wp
      do i = 1, size(x, 2)
         j = 1 + mod(i, size(x, 2))
         cross = x(1, i)*x(2, j) - x(2, i)*x(1, j)
         if (times_y) then
            ring = ring + cross*(x(1, i)*x(2, j) + 2.0_wp*x(1, i)*x(2, i) &
               + 2.0_wp*x(1, j)*x(2, j) + x(1, j)*x(2, i))/24.0_wp
         else
            ring = ring + cross*(x(1, i) + x(1, j))/6.0_wp
         end if
      end do
      ring = two_pi*ring
   end function ring

   subroutine test_along(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      real(wp) :: u0(2, m), du(2, m)
      integer :: k

      do k = 1, n_axial_row()
         call make_sample(k, 1 + mod(k, n_law), .true., 0.2_wp, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         du = 0.0_wp
         u0(2, :sample%n) = 3.0_wp
         du(2, :sample%n) = -5.0_wp
         call respond(sample, u0, du, .false., step)
         call check_near(error, step%energy, 0.0_wp, tol**2, young, sample%what // ": energy")
         call check_near(error, step%force, 0.0_wp*step%force, tol, young, &
            sample%what // ": forces")
      end do
   end subroutine test_along

   !> Of the tangent at rest: all but the motion along the axis.
   subroutine test_rank(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      real(wp) :: zero(2, m)
      integer :: k

      zero = 0.0_wp
      do k = 1, n_axial_row()
         call make_sample(k, 1 + mod(k, n_law), .true., 0.2_wp, sample, error)
         if (allocated(error)) return
         call respond(sample, zero, zero, .true., step)
         associate (n => sample%n)
            call check_equal(error, rank_of(reshape(step%tangent(:2, :n, :2, :n), [2*n, 2*n])), &
               2*n - 1, sample%what)
         end associate
      end do
   end subroutine test_rank

   !> By elimination with the largest pivot; what is left below the root of epsilon is round-off.
   pure integer function rank_of(matrix)
      real(wp), intent(in) :: matrix(:, :)
      real(wp) :: a(size(matrix, 1), size(matrix, 2)), row(size(matrix, 2))
      integer :: at(2), j

      a = matrix
      rank_of = 0
      do j = 1, size(a, 1)
         at = maxloc(abs(a))
         if (abs(a(at(1), at(2))) <= tol*maxval(abs(matrix))) return
         rank_of = rank_of + 1
         row = a(at(1), :)/a(at(1), at(2))
         a = a - spread(a(:, at(2)), 2, size(row))*spread(row, 1, size(a, 1))
      end do
   end function rank_of

   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      integer :: k

      do k = 1, n_axial_row()
         call make_sample(k, 1, .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         associate (mass => sample%solid%mass%consistent(:sample%n, :sample%n, 1), &
               corner => sample%x(:, :sample%n_corner))
            call check_near(error, sum(mass), ring(corner, .false.), tol, two_pi, &
               sample%what // ": mass")
            call check_near(error, dot_product(sample%x(2, :sample%n), sum(mass, 2)), &
               ring(corner, .true.), tol, two_pi, sample%what // ": centre")
            call check_near(error, sum(mass, 2), sample%solid%mass%of_volume(:sample%n, 1), tol, &
               two_pi, sample%what // ": gravity")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_mass

   !> On all sides of a section: no force along the axis, the work on u = x is three times -p times
   !> the volume.
   subroutine test_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: p = 0.7_wp
      type(sample_t) :: sample
      real(wp) :: force(2, m), u(2, m)
      integer :: i, k, n

      do k = 3, n_axial_row()
         call make_sample(k, 1, .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         u = 0.0_wp
         force = 0.0_wp
         n = sample%n_corner
         do i = 1, n
            call press_ring([i, 1 + mod(i, n), n + i], p, sample%x, u, .true., force)
         end do
         call check_near(error, sum(force(2, :)), 0.0_wp, tol, two_pi*p, sample%what // ": axis")
         call check_near(error, sum(force*sample%x), &
            -3.0_wp*p*ring(sample%x(:, :n), .false.), tol, two_pi, sample%what // ": work")
      end do
   end subroutine test_pressure

   !> On a displaced edge, straight or bent: the force is quadratic in the places, so that central
   !> differences are exact. Entries beside the matrix are as those in it.
   subroutine test_pressure_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: p = 0.7_wp, h = 0.25_wp
      integer, parameter :: edge(3) = [4, 1, 3]
      real(wp), dimension(2, 4) :: x, u, up, down, step
      real(dp) :: value(36), side(36)
      integer :: slot(6, 6), a, i, j, n

      do n = 2, 3
         call shake(x, 0.5_wp)
         call shake(u, 0.5_wp)
         x(1, :) = x(1, :) + 2.0_wp
         slot = reshape([(merge(i, -i, mod(i, 3) == 0), i = 1, size(slot))], shape(slot))
         value = 0.0_dp
         side = 0.0_dp
         call press_ring_stiffness(edge(:n), p, x, u, slot(:2*n, :2*n), value, side)
         do j = 1, n
            do a = 1, 2
               step = 0.0_wp
               step(a, edge(j)) = h
               up = 0.0_wp
               call press_ring(edge(:n), p, x, u + step, .true., up)
               down = 0.0_wp
               call press_ring(edge(:n), p, x, u - step, .true., down)
               associate (to => slot(:2*n, 2*(j - 1) + a), fall => reshape((down(:, edge(:n)) &
                     - up(:, edge(:n)))/(2.0_wp*h), [2*n]))
                  call check_near(error, real(merge(value(abs(to)), side(abs(to)), to > 0), wp), &
                     fall, 512.0_wp*max(eps, real(epsilon(value), wp)), two_pi, "tangent")
                  call check_near(error, real(merge(side(abs(to)), value(abs(to)), to > 0), wp), &
                     0.0_wp*fall, 0.0_wp, 1.0_wp, "nothing on the other side")
               end associate
            end do
         end do
      end do
   end subroutine test_pressure_tangent

   !> p pi (r_b^2 - r_a^2), however it is bent between; on the places of the start or those that the
   !> displacements lead to.
   subroutine test_edge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: p = 0.7_wp
      real(wp) :: x(2, 4), u(2, 4), at(2, 4), force(2, 4)
      integer, parameter :: edge(3) = [4, 1, 3]
      logical :: follows
      integer :: k, n

      do k = 1, 8
         n = merge(2, 3, btest(k, 0))
         follows = btest(k, 1)
         call shake(x, 0.5_wp)
         call shake(u, 0.5_wp)
         x(1, :) = x(1, :) + 2.0_wp
         at = x
         if (follows) at = x + u
         force = 0.0_wp
         call press_ring(edge(:n), p, x, u, follows, force)
         call check_near(error, sum(force(2, :)), 0.5_wp*two_pi*p*(at(1, 1)**2 &
            - at(1, 4)**2), tol, two_pi, "edge " // to_text(k))
         call check_near(error, force(:, 2), [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "another node")
      end do
   end subroutine test_edge

end module test_element_axial
