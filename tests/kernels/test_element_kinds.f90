!> Every kind of element of the plane, distorted, with each law: what a step and a mesh ask of it.
module test_element_kinds
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_element, only : element_geometry_t
   use emcon_element_plane, only : element_motion_t, element_response_t
   use emcon_element_kind, only : element_row_t
   use emcon_element_registry, only : element_row
   use emcon_errors, only : error_t
   use emcon_host_law, only : host_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_scene, only : scene_t
   use emcon_shape, only : max_plane_nodes
   use emcon_solid, only : solid_geometry, solid_init, solid_t
   use emcon_solid_respond, only : solid_element_respond
   use emcon_text, only : to_text
   use kind_rows, only : law_code, n_plane_row
   use random_draws, only : signs_of
   use small_scenes, only : scene_begin, shake, young
   implicit none
   private
   public :: collect_element_kinds

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over up to nine points and nodes, each term of some dozen roundings.
   real(wp), parameter :: tol = 256.0_wp*eps
   integer, parameter :: n_law = 6, m = max_plane_nodes

   !> One distorted element of size 1 with its law.
   type :: sample_t
      character(len=:), allocatable :: what
      integer :: kind = 0                        !! row
      integer :: n = 0                           !! nodes
      logical :: nlgeom = .true.
      real(wp) :: x(2, m) = 0.0_wp
      type(solid_t) :: solid
   end type sample_t

contains

   subroutine collect_element_kinds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity and momenta of a step", test_step), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("tangent is symmetric without motion", test_symmetry), &
         test_case_t("patch: energy and work of a uniform strain", test_patch), &
         test_case_t("rigid motions cost nothing", test_rigid), &
         test_case_t("rank", test_rank), &
         test_case_t("mass, centre and inertia are those of the polygon", test_mass), &
         test_case_t("bending of the mean kinds costs no change of volume", test_bending)]
   end subroutine collect_element_kinds

   !> The corners moved by up to `size`, nodes between them in the middle, then moved by up to a
   !> quarter of `bend`.
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
      row = element_row(kind)
      n = row%n_node
      call scene%element%kinds(kind)%shape%places(place)
      if (n == 4 .or. n == 8) place = 0.5_wp*place
      call shake(move, 0.2_wp)
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
      scene%element%node(:, 1) = [(i, i = 1, n)]
      scene%node%label = scene%element%node(:, 1)
      scene%element%label = [1]
      scene%element%kind = [kind]
      scene%element%section = [1]
      scene%x = place
      scene%u0 = 0.0_wp*place
      scene%v0 = 0.0_wp*place
      ! Ogden's law is not known in plane stress: another one in its place.
      call set_law(merge(n_law - 1, law, row%is_thin .and. law == n_law), scene)
      sample%kind = kind
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
         scene%material(1)%constant = [c, 2.5_wp, 0.5_wp*c, -1.5_wp, d, d]
      end select
   end subroutine set_law

   subroutine respond(sample, u0, du, with_tangent, response)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: u0(2, m), du(2, m)
      logical, intent(in) :: with_tangent
      type(element_response_t), intent(inout) :: response
      type(element_motion_t) :: motion
      type(host_response_t) :: none

      motion%square = merge(1.0_wp, 0.0_wp, sample%nlgeom)
      response = element_response_t()
      motion%from(:, :m) = u0
      motion%by(:, :m) = du
      call solid_element_respond(sample%solid, 1, motion, none, with_tangent, response)
   end subroutine respond

   !> A start up to 3 % off, and a motion of up to 4 % plus, with nlgeom, a turn of 0.7 rad.
   subroutine draw(sample, u0, du)
      type(sample_t), intent(in) :: sample
      real(wp), intent(out) :: u0(2, m), du(2, m)
      real(wp) :: angle
      integer :: i

      call shake(u0, 0.03_wp)
      call shake(du, 0.04_wp)
      angle = merge(0.7_wp, 0.0_wp, sample%nlgeom)
      do i = 1, sample%n
         du(:, i) = du(:, i) + turned(angle, sample%x(:, i) + u0(:, i))
      end do
      u0(:, sample%n + 1:) = 0.0_wp
      du(:, sample%n + 1:) = 0.0_wp
   end subroutine draw

   !> Displacement of `x` in a turn about the origin.
   pure function turned(angle, x) result(u)
      real(wp), intent(in) :: angle, x(2)
      real(wp) :: u(2)

      u = [cos(angle)*x(1) - sin(angle)*x(2), sin(angle)*x(1) + cos(angle)*x(2)] - x
   end function turned

   !> f.du = W1 - W0; no net force; no moment on the mid-configuration, without nlgeom on the
   !> reference.
   subroutine test_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: start, step
      real(wp) :: u0(2, m), du(2, m), zero(2, m), place(2, m)
      integer :: i, k, law

      zero = 0.0_wp
      do i = 1, 2*n_law*n_plane_row()
         law = 1 + mod(i, n_law)
         call make_sample(1 + mod(i/n_law, n_plane_row()), law, i > n_law*n_plane_row(), &
            0.2_wp, sample, error)
         if (allocated(error)) return
         do k = 1, 2
            call draw(sample, u0, du)
            if (k == 2) du = scale(du, -20)       ! a small step
            call respond(sample, u0, zero, .false., start)
            call respond(sample, u0, du, .false., step)
            call check_true(error, .not. step%is_inverted, sample%what // ": is not inverted")
            call check_near(error, sum(step%force(:, :m)*du), step%energy - start%energy, tol, &
               sum(step%magnitude(:, :m)*abs(du)) + merge(start%energy, 0.0_wp, k == 2), &
               sample%what)
            call check_near(error, sum(step%force, dim=2), [0.0_wp, 0.0_wp], tol, &
               sum(step%magnitude), sample%what // ": force")
            place = sample%x
            if (sample%nlgeom) place = place + (u0 + 0.5_wp*du)
            call check_near(error, sum(place(1, :)*step%force(2, :m) &
               - place(2, :)*step%force(1, :m)), 0.0_wp, tol, sum(step%magnitude) &
               *maxval(abs(place)), sample%what // ": moment")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_step

   !> Central differences over four points, of step h = eps^(0.3): an error of order h^4 = eps^(1.2)
   !> and one of eps/h = eps^(0.7).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step, near(2), far(2)
      real(wp) :: u0(2, m), du(2, m), way(2, m), h
      real(wp), allocatable :: sign(:)
      integer :: i, k, n, n_way

      h = eps**0.3_wp
      do i = 1, n_law*n_plane_row()
         call make_sample(1 + (i - 1)/n_law, 1 + mod(i, n_law), mod(i/2, 2) == 0, 0.2_wp, sample, &
            error)
         if (allocated(error)) return
         n = sample%n
         call draw(sample, u0, du)
         call respond(sample, u0, du, .true., step)
         n_way = (2*n + 4)/5
         do k = 1, n_way
            sign = signs_of(2*n, k, n_way)
            way = 0.0_wp
            way(:, :n) = reshape(h*sign, [2, n])
            call respond(sample, u0, du + way, .false., near(1))
            call respond(sample, u0, du - way, .false., near(2))
            call respond(sample, u0, du + 2.0_wp*way, .false., far(1))
            call respond(sample, u0, du - 2.0_wp*way, .false., far(2))
            call check_near(error, matmul(step%tangent(:2*n, :2*n), sign), reshape( &
               (8.0_wp*(near(1)%force(:, :n) - near(2)%force(:, :n)) &
               - (far(1)%force(:, :n) - far(2)%force(:, :n)))/(12.0_wp*h), [2*n]), &
               800.0_wp*eps**0.7_wp, young, sample%what // ", way " // to_text(k))
         end do
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> At du = 0 the tangent is half of the Hessian of W.
   subroutine test_symmetry(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, m), du(2, m)
      integer :: i

      do i = 1, n_law*n_plane_row()
         call make_sample(1 + (i - 1)/n_law, 1 + mod(i, n_law), .true., 0.2_wp, sample, error)
         if (allocated(error)) return
         call draw(sample, u0, du)
         du = 0.0_wp
         call respond(sample, u0, du, .true., step)
         call check_near(error, step%tangent, transpose(step%tangent), tol, &
            maxval(abs(step%tangent)), sample%what)
         if (allocated(error)) return
      end do
   end subroutine test_symmetry

   !> Uniform grad u on a distorted element with straight or bent sides: W times the area, and the
   !> work of the forces on every uniform field is stress times its gradient times the area.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      type(law_response_t) :: state
      type(element_geometry_t) :: geometry
      real(wp), parameter :: grad(2, 2) = reshape([0.1_wp, -0.2_wp, 0.3_wp, 0.15_wp], [2, 2])
      real(wp) :: u0(2, m), zero(2, m), e(3), f(2, 2), s(2, 2), p(2, 2), area
      integer :: a, b, i

      zero = 0.0_wp
      do i = 1, 2*n_law*n_plane_row()
         call make_sample(1 + mod(i/n_law, n_plane_row()), 1 + mod(i, n_law), &
            i > n_law*n_plane_row(), 0.2_wp, sample, error)
         if (allocated(error)) return
         u0 = matmul(grad, sample%x)
         f = grad
         f(1, 1) = 1.0_wp + grad(1, 1)
         f(2, 2) = 1.0_wp + grad(2, 2)
         e = [grad(1, 1), grad(2, 2), grad(1, 2) + grad(2, 1)]
         if (sample%nlgeom) then
            s = matmul(transpose(f), f)
            e = [0.5_wp*(s(1, 1) - 1.0_wp), 0.5_wp*(s(2, 2) - 1.0_wp), s(1, 2)]
         else
            f = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         end if
         call law_response_plane(sample%solid%law(sample%solid%law_of(1))%law, e, &
            [0.0_wp, 0.0_wp, 0.0_wp], state)
         s = reshape([state%stress(1), state%stress(3), state%stress(3), state%stress(2)], [2, 2])
         p = matmul(f, s)
         call solid_geometry(sample%solid, 1, geometry)
         area = sum(geometry%weight)
         call respond(sample, u0, zero, .false., step)
         call check_near(error, step%energy, area*state%energy, tol, young, &
            sample%what // ": energy")
         do b = 1, 2
            do a = 1, 2
               call check_near(error, sum(step%force(a, :m)*sample%x(b, :)), area*p(a, b), tol, &
                  young, sample%what // ": stress")
            end do
         end do
         if (allocated(error)) return
      end do
   end subroutine test_patch

   !> The strain is round-off of grad u, and the energy of the order of its square.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      real(wp) :: u0(2, m), du(2, m)
      integer :: i, k

      do i = 1, n_law*n_plane_row()
         call make_sample(1 + (i - 1)/n_law, 1 + mod(i, n_law), .true., 0.2_wp, sample, error)
         if (allocated(error)) return
         u0 = 0.0_wp
         du = 0.0_wp
         do k = 1, sample%n
            u0(:, k) = turned(2.0_wp, sample%x(:, k)) + [1.0_wp, 0.0_wp]
            du(:, k) = turned(3.0_wp, sample%x(:, k)) - u0(:, k)
         end do
         call respond(sample, u0, du, .false., step)
         call check_near(error, step%energy, 0.0_wp, tol**2, young, sample%what // ": energy")
         call check_near(error, step%force, 0.0_wp*step%force, tol, young, &
            sample%what // ": forces of a turn")
         if (allocated(error)) return
      end do
   end subroutine test_rigid

   !> Of the tangent at rest: all but the three rigid motions. With fewer points there is one motion
   !> more without strain at any of them, as is known of CPE8R and CPS8R; neighbours stop it.
   subroutine test_rank(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      type(element_row_t) :: row
      real(wp) :: zero(2, m)
      integer :: k, law

      zero = 0.0_wp
      do k = 1, n_plane_row()
         row = element_row(k)
         do law = 1, n_law
            call make_sample(k, law, .true., 0.2_wp, sample, error)
            if (allocated(error)) return
            call respond(sample, zero, zero, .true., step)
            call check_equal(error, rank_of(step%tangent(:2*sample%n, :2*sample%n)), &
               2*sample%n - merge(4, 3, index(row%name, "8R") > 0), sample%what)
         end do
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
         if (abs(a(at(1), at(2))) <= sqrt(eps)*maxval(abs(matrix))) return
         rank_of = rank_of + 1
         row = a(at(1), :)/a(at(1), at(2))
         a = a - spread(a(:, at(2)), 2, size(row))*spread(row, 1, size(a, 1))
      end do
   end function rank_of

   !> By the moments of a polygon: sums over its sides, from the theorem of Green.
   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_row_t) :: row
      real(wp) :: area, first(2), second, cross
      integer :: i, j, k, n

      do k = 1, n_plane_row()
         call make_sample(k, 1, .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         area = 0.0_wp
         first = 0.0_wp
         second = 0.0_wp
         row = element_row(k)
         n = row%n_corner
         do i = 1, n
            j = 1 + mod(i, n)
            associate (a => sample%x(:, i), b => sample%x(:, j))
               cross = a(1)*b(2) - a(2)*b(1)
               area = area + cross/2.0_wp
               first = first + cross*(a + b)/6.0_wp
               second = second + cross*(dot_product(a, a) + dot_product(a, b) &
                  + dot_product(b, b))/12.0_wp
            end associate
         end do
         associate (mass => sample%solid%mass%consistent(:sample%n, :sample%n, 1), x => &
            sample%x(:, :sample%n))
            call check_near(error, sum(mass), area, tol, 1.0_wp, sample%what // ": mass")
            call check_near(error, matmul(x, sum(mass, 2)), first, tol, 1.0_wp, &
               sample%what // ": centre")
            call check_near(error, sum(matmul(x, mass)*x), second, tol, 1.0_wp, &
               sample%what // ": inertia")
            call check_near(error, sum(mass, 2), sample%solid%mass%of_volume(:sample%n, 1), tol, &
               1.0_wp, sample%what // ": gravity")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_mass

   !> The motion u = (x y, 0) of a square has div u = y: fully integrated, an element takes the bulk
   !> modulus for it; the mean of y is 0.
   subroutine test_bending(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(element_response_t) :: step
      type(scene_t) :: scene
      type(element_row_t) :: row
      real(wp) :: u(2, m), zero(2, m)
      real(wp), parameter :: nu = 0.4999_wp, small = 1.0e-3_wp
      integer :: k

      zero = 0.0_wp
      do k = 1, n_plane_row()
         row = element_row(k)
         if (.not. row%has_mean_volume) cycle
         call scene_begin(scene)
         call make_sample(k, 1, .true., 0.0_wp, sample, error)
         call scene%element%kinds(k)%shape%places(scene%x)
         scene%x = 0.5_wp*scene%x
         scene%u0 = 0.0_wp*scene%x
         scene%v0 = 0.0_wp*scene%x
         scene%element%node = sample%solid%node
         scene%element%kind = [k]
         scene%element%section = [1]
         scene%element%label = [1]
         deallocate(scene%element%origin)
         allocate(scene%element%origin(1))
         scene%material(1)%constant = [young, nu]
         call solid_init(sample%solid, scene, error)
         if (allocated(error)) return
         u = 0.0_wp
         u(1, :sample%n) = small*scene%x(1, :)*scene%x(2, :)
         call respond(sample, u, zero, .false., step)
         ! mu e:e over the square, of which the mean of y^2 + x^2/2 is 1/8
         call check_near(error, step%energy, young/24.0_wp*small**2, 1.0e-4_wp, young*small**2, &
            sample%what)
      end do
   end subroutine test_bending

end module test_element_kinds
