!> Elements in three dimensions, distorted, with each law: what a step and a mesh ask of them.
module test_element_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_element_pack, only : element_pack_t, pack_begin, pack_geometry, pack_make_room, &
      pack_motion_t, pack_put, pack_response_t
   use emcon_element_space, only : space_element_init, space_element_mass, space_element_place, &
      space_element_respond, space_element_t, space_motion_t, space_part_t
   use emcon_errors, only : error_t
   use emcon_host_law, only : host_response_t
   use emcon_incompatible_modes, only : modes_init
   use emcon_incompatible_space, only : incompatible_space_respond
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t, n_lane
   use emcon_law_registry, only : law_create, law_linear
   use emcon_law_space, only : law_response_space, space_response_t
   use emcon_mean_volume_space, only : mean_volume_space_respond
   use emcon_pack_points_space, only : pack_gradient
   use emcon_shape, only : m => max_element_nodes, shape_fault, shape_t, shape_table_t, &
      shape_tabulate
   use emcon_shape_hexahedron_space, only : shape_hexahedron_t
   use emcon_shape_quadratic_tetrahedron_space, only : shape_quadratic_tetrahedron_t
   use emcon_shape_serendipity_space, only : shape_serendipity_space_t
   use emcon_shape_tetrahedron_space, only : shape_tetrahedron_t
   use emcon_solid, only : solid_t
   use emcon_solid_respond, only : solid_pack_respond
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use random_draws, only : signs_of
   use small_scenes, only : shake, young
   implicit none
   private
   public :: collect_element_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over up to 27 points and 20 nodes, each term of some dozen roundings.
   real(wp), parameter :: tol = 1024.0_wp*eps
   integer, parameter :: n_law = 6, n_kind = 7
   character(len=6), parameter :: name(n_kind) = [character(len=6) :: "C3D4", "C3D8", "C3D10", &
      "C3D20", "C3D20R", "C3D8I", "C3D8H"]

   type :: sample_t
      character(len=:), allocatable :: what
      integer :: n = 0                           !! nodes
      logical :: nlgeom = .true.
      real(wp) :: x(3, m) = 0.0_wp
      type(space_element_t) :: element
      class(shape_t), allocatable :: shape
      class(law_t), allocatable :: law
      class(law_t), allocatable :: rest          !! where volume resists in the mean
   end type sample_t

contains

   subroutine collect_element_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("shape functions", test_shapes), &
         test_case_t("laws: a strain of the plane", test_plane), &
         test_case_t("identity, force and moments of a step", test_step), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("side by side: gradients", test_gradients), &
         test_case_t("side by side: as one by one", test_packs), &
         test_case_t("side by side: bits of a lane", test_lanes), &
         test_case_t("side by side: inverted ones", test_inverted), &
         test_case_t("a turned element responds turned", test_turned), &
         test_case_t("patch: energy and work of a uniform strain", test_patch), &
         test_case_t("rank", test_rank), &
         test_case_t("mean volume: bending does not change it", test_bending), &
         test_case_t("mass, centre and inertia", test_mass), &
         test_case_t("free flight of one element", test_flight)]
   end subroutine collect_element_space

   !> Kind 1..n_kind, its corners moved by up to a tenth of its size, other nodes in the middle of
   !> their sides and moved by up to `bend`.
   subroutine make_sample(kind, law, nlgeom, bend, sample, error)
      integer, intent(in) :: kind, law
      logical, intent(in) :: nlgeom
      real(wp), intent(in) :: bend
      type(sample_t), intent(out) :: sample
      type(error_t), allocatable, intent(out) :: error
      character(len=18), parameter :: names(n_law) = [character(len=18) :: "linear", &
         "coupled neo hooke", "neo hooke", "mooney-rivlin", "yeoh", "ogden 2"]
      integer, parameter :: side(2, 6) = reshape([1, 2, 2, 3, 3, 1, 1, 4, 2, 4, 3, 4], [2, 6])
      real(wp), parameter :: c = 0.2_wp*young, d = 1.0_wp/young
      real(wp), allocatable :: constant(:), place(:, :)
      real(wp) :: move(3, m)
      integer :: i, n_corner

      call make_shape(kind, sample%shape)
      call sample%shape%places(place)
      n_corner = merge(4, 8, kind == 1 .or. kind == 3)
      sample%n = size(place, 2)
      if (n_corner == 8) place = 0.5_wp*place
      call shake(move, 0.1_wp)
      do i = n_corner + 1, sample%n              ! in the middle of its side
         if (n_corner == 4) then
            move(:, i) = 0.5_wp*sum(move(:, side(:, i - 4)), 2)
         else
            move(:, i) = 0.5_wp*sum(move(:, :8), 2, spread(sum(abs(place(:, :8) &
               - spread(place(:, i), 2, 8)), 1) < 0.51_wp, 1, 3))
         end if
      end do
      place = place + move(:, :sample%n)
      call shake(move, bend)
      place(:, n_corner + 1:) = place(:, n_corner + 1:) + move(:, n_corner + 1:sample%n)
      sample%x(:, :sample%n) = place
      sample%nlgeom = nlgeom
      sample%what = trim(name(kind)) // ", law " // to_text(law) // ", nlgeom " &
         // to_text(merge(1, 0, nlgeom))
      select case (law)
      case (3)
         constant = [c, d]
      case (4)
         constant = [c, 0.5_wp*c, d]
      case (5)
         constant = [c, 0.1_wp*c, 0.1_wp*c, d, d, d]
      case (6)
         constant = [c, 1.3_wp, 0.5_wp*c, -2.5_wp, d, d]
      case default
         constant = [young, 0.3_wp]
      end select
      call law_create(law_code(names(law)), constant, sample%law, error)
      if (trim(name(kind)) == "C3D8H") call sample%law%divide(sample%rest)
      call place_element(sample)
      call check_true(error, all(sample%element%weight > 0.0_wp), sample%what // ": volume")
   end subroutine make_sample

   !> The element of the sample at its places, and its modes if it has some.
   subroutine place_element(sample)
      type(sample_t), intent(inout) :: sample
      type(shape_table_t) :: table
      type(space_response_t) :: rest

      call space_element_init(sample%element, sample%shape, sample%x(:, :sample%n))
      if (index(sample%what, "C3D8I") == 0) return
      call shape_tabulate(sample%shape, .false., table)
      call law_response_space(sample%law, spread(0.0_wp, 1, 6), spread(0.0_wp, 1, 6), rest)
      call modes_init(sample%element, table, rest%tangent)
   end subroutine place_element

   subroutine make_shape(kind, shape)
      integer, intent(in) :: kind
      class(shape_t), allocatable, intent(out) :: shape

      select case (kind)
      case (1)
         allocate(shape_tetrahedron_t :: shape)
      case (2, 6, 7)
         allocate(shape_hexahedron_t :: shape)
      case (3)
         allocate(shape_quadratic_tetrahedron_t :: shape)
      case default
         allocate(shape, source=shape_serendipity_space_t(merge(3, 2, kind == 4)))
      end select
   end subroutine make_shape

   !> The response, whatever stands in `part` before.
   subroutine respond(sample, u0, du, with_tangent, part)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: u0(3, m), du(3, m)
      logical, intent(in) :: with_tangent
      type(space_part_t), intent(inout) :: part
      type(space_motion_t) :: motion

      motion%square = merge(1.0_wp, 0.0_wp, sample%nlgeom)
      motion%from = u0
      motion%by = du
      part = space_part_t(energy=1.0_wp, is_inverted=.true.)
      part%force(:, :sample%n) = 2.0_wp
      part%magnitude(:, :sample%n) = 3.0_wp
      part%tangent(:, :sample%n, :, :sample%n) = merge(4.0_wp, 0.0_wp, with_tangent)
      if (allocated(sample%rest)) then
         call mean_volume_space_respond(sample%element, sample%law, sample%rest, motion, &
            with_tangent, part)
      else if (allocated(sample%element%mode)) then
         call incompatible_space_respond(sample%element, sample%law, motion, with_tangent, part)
      else
         call space_element_respond(sample%element, sample%law, motion, with_tangent, part)
      end if
   end subroutine respond

   !> A start up to 2 % off, and a motion of up to 3 % plus, with nlgeom, a turn of 0.7 rad.
   subroutine draw(sample, u0, du)
      type(sample_t), intent(in) :: sample
      real(wp), intent(out) :: u0(3, m), du(3, m)

      call shake(u0, 0.02_wp)
      call shake(du, 0.03_wp)
      if (sample%nlgeom) du = du + matmul(rotation(0.7_wp), sample%x + u0) - (sample%x + u0)
      u0(:, sample%n + 1:) = 0.0_wp
      du(:, sample%n + 1:) = 0.0_wp
   end subroutine draw

   !> About the axis (1, 2, 2)/3.
   pure function rotation(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(3, 3), k(3, 3)
      integer :: a

      k = reshape([0.0_wp, 2.0_wp, -2.0_wp, -2.0_wp, 0.0_wp, 1.0_wp, 2.0_wp, -1.0_wp, 0.0_wp], &
         [3, 3])/3.0_wp
      r = sin(angle)*k + (1.0_wp - cos(angle))*matmul(k, k)
      do a = 1, 3
         r(a, a) = r(a, a) + 1.0_wp
      end do
   end function rotation

   !> Sum of x cross f.
   pure function moment(x, f) result(t)
      real(wp), intent(in) :: x(:, :), f(:, :)
      real(wp) :: t(3)

      t = [sum(x(2, :)*f(3, :) - x(3, :)*f(2, :)), sum(x(3, :)*f(1, :) - x(1, :)*f(3, :)), &
         sum(x(1, :)*f(2, :) - x(2, :)*f(1, :))]
   end function moment

   !> One at their own node, zero at others; sum 1; positions reproduced; slopes by differences,
   !> exact for quadratic functions.
   subroutine test_shapes(error)
      type(error_t), allocatable, intent(out) :: error
      class(shape_t), allocatable :: shape
      character(len=:), allocatable :: fault
      real(wp), allocatable :: place(:, :), value(:), up(:), down(:), slope(:, :), other(:, :)
      real(wp) :: point(3), way(3)
      integer :: a, i, k

      do k = 1, n_kind
         call make_shape(k, shape)
         call shape%places(place)
         call shape_fault(shape, size(place, 2), fault)
         call check_equal(error, fault, "", name(k))
         if (allocated(value)) deallocate(value, up, down, slope, other)
         allocate(value(size(place, 2)), up(size(place, 2)), down(size(place, 2)))
         allocate(slope(3, size(place, 2)), other(3, size(place, 2)))
         do i = 1, size(place, 2)
            call shape%values(place(:, i), value, slope)
            up = 0.0_wp
            up(i) = 1.0_wp
            call check_near(error, value, up, 0.0_wp, 1.0_wp, name(k) // ", node " // to_text(i))
         end do
         point = [0.2_wp, 0.15_wp, 0.4_wp]
         call shape%values(point, value, slope)
         call check_near(error, matmul(place, value), point, tol, 1.0_wp, name(k) // ": place")
         do a = 1, 3
            way = 0.0_wp
            way(a) = 0.5_wp
            call shape%values(point + way, up, other)
            call shape%values(point - way, down, other)
            call check_near(error, slope(a, :), up - down, tol, 1.0_wp, name(k) // ": slope")
         end do
      end do
   end subroutine test_shapes

   !> A strain without components along z gives what the law gives in plane strain; of Ogden's law,
   !> whose discrete gradient in space is another one, where it stands still.
   subroutine test_plane(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_response_t) :: space
      type(law_response_t) :: plane
      real(wp), parameter :: e(3) = [0.1_wp, -0.2_wp, 0.15_wp], d(3) = [0.2_wp, 0.1_wp, -0.3_wp]
      real(wp), parameter :: zero = 0.0_wp
      integer, parameter :: own(3) = [1, 2, 4]
      integer :: law

      do law = 1, n_law
         call make_sample(1, law, .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         call law_response_plane(sample%law, e, d, plane)
         call law_response_space(sample%law, [e(:2), zero, e(3:), zero, zero], &
            [d(:2), zero, d(3:), zero, zero], space)
         call check_near(error, space%energy, plane%energy, tol, young, "energy")
         if (sample%law%n_part == 0) call compare()
         call law_response_plane(sample%law, e, 0.0_wp*d, plane)
         call law_response_space(sample%law, [e(:2), zero, e(3:), zero, zero], &
            spread(zero, 1, 6), space)
         call compare()
         call check_near(error, space%stress(3), plane%stress_33, tol, young, "normal")
      end do

   contains

      subroutine compare()
         call check_near(error, space%stress(own), plane%stress, tol, young, "stress")
         call check_near(error, space%tangent(own, own), plane%tangent, tol, young, "tangent")
      end subroutine compare

   end subroutine test_plane

   !> f.du = W1 - W0; no net force; no moment on the mid-configuration.
   subroutine test_step(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: start, step
      real(wp) :: u0(3, m), du(3, m), zero(3, m), place(3, m)
      integer :: i, k

      zero = 0.0_wp
      do i = 0, 2*n_law*n_kind - 1
         call make_sample(1 + mod(i/n_law, n_kind), 1 + mod(i, n_law), i >= n_law*n_kind, 0.03_wp, &
            sample, error)
         if (allocated(error)) return
         call respond(sample, zero, zero, .false., start)
         call check_near(error, [start%energy, reshape(start%force, [3*m]), &
            reshape(start%magnitude, [3*m])], spread(0.0_wp, 1, 6*m + 1), tol, young, &
            sample%what // ": at rest")
         do k = 1, 2
            call draw(sample, u0, du)
            if (k == 2) du = scale(du, -20)
            call respond(sample, u0, zero, .false., start)
            call respond(sample, u0, du, .false., step)
            call check_true(error, .not. step%is_inverted, sample%what // ": is not inverted")
            call check_near(error, sum(step%force*du), step%energy - start%energy, tol, &
               sum(step%magnitude*abs(du)) + merge(start%energy, 0.0_wp, k == 2), sample%what)
            call check_near(error, sum(step%force, dim=2), [0.0_wp, 0.0_wp, 0.0_wp], tol, &
               sum(step%magnitude), sample%what // ": force")
            place = sample%x
            if (sample%nlgeom) place = place + (u0 + 0.5_wp*du)
            call check_near(error, moment(place, step%force), [0.0_wp, 0.0_wp, 0.0_wp], tol, &
               sum(step%magnitude)*maxval(abs(place)), sample%what // ": moment")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_step

   !> Elements of one kind and law, each with a shape of its own, as a scene has them.
   subroutine make_solid(kind, law, nlgeom, sample, solid, error)
      integer, intent(in) :: kind, law
      logical, intent(in) :: nlgeom
      type(sample_t), intent(out) :: sample(n_lane)
      type(solid_t), intent(out) :: solid
      type(error_t), allocatable, intent(out) :: error
      integer :: e, i

      solid%n_dim = 3
      solid%n_element = n_lane
      allocate(solid%law(1), solid%rest(1), solid%shape(1))
      allocate(solid%trait%has_mean(n_lane), source=name(kind) == "C3D8H")
      allocate(solid%host%first_point(n_lane), source=0)
      do e = 1, n_lane
         call make_sample(kind, law, nlgeom, 0.03_wp, sample(e), error)
         if (allocated(error)) return
      end do
      call shape_tabulate(sample(1)%shape, .false., solid%shape(1)%table)
      allocate(solid%law(1)%law, source=sample(1)%law)
      if (allocated(sample(1)%rest)) allocate(solid%rest(1)%law, source=sample(1)%rest)
      allocate(solid%node(m, n_lane), source=0)
      solid%node(:sample(1)%n, :) = reshape([(i, i = 1, n_lane*sample(1)%n)], [sample(1)%n, n_lane])
   end subroutine make_solid

   !> The elements `which` side by side.
   subroutine fill_pack(sample, solid, which, pack)
      type(sample_t), intent(in) :: sample(:)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: which(:)
      type(element_pack_t), intent(out) :: pack
      integer :: l

      call pack_begin(pack, size(which), 1, 1)
      do l = 1, size(which)
         associate (own => sample(which(l)))
            call pack_put(pack, l, which(l), solid%node(:own%n, which(l)), &
               own%element, own%x(:, :own%n) - spread(own%x(:, 1), 2, own%n))
         end associate
      end do
   end subroutine fill_pack

   !> Gradients of elements side by side, found from their places: those of each alone, bit by bit.
   subroutine test_gradients(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample(n_lane)
      type(solid_t) :: solid
      type(element_pack_t) :: pack
      type(space_element_t) :: held
      real(wp), allocatable :: gradient(:, :, :), x(:, :)
      integer :: i, k, l

      do i = 1, n_kind
         call make_solid(i, 1, .true., sample, solid, error)
         if (allocated(error)) return
         call fill_pack(sample, solid, [3, 7, 1, 5], pack)
         allocate(gradient(n_lane, 3, pack%n_node))
         do l = 1, n_lane
            associate (own => sample(pack%element(l))%element, what => sample(1)%what)
               do k = 1, pack%n_gp
                  call pack_gradient(pack%n_node, pack%x, solid%shape(1)%table%slope(:, :, k), &
                     gradient)
                  call check_true(error, .not. any(abs(gradient(l, :, :) - own%gradient(:, :, k)) &
                     > 0.0_wp), what)
               end do
               call pack_geometry(pack, l, held, x)
               call space_element_place(held, solid%shape(1)%table, x)
               call check_true(error, .not. (any(abs(held%gradient - own%gradient) > 0.0_wp) &
                  .or. any(abs(held%weight - own%weight) > 0.0_wp)), what // ": held")
               if (allocated(own%mode)) call check_true(error, .not. any(abs(held%mode - own%mode) &
                  > 0.0_wp), what // ": modes")
            end associate
         end do
         deallocate(gradient)
      end do
   end subroutine test_gradients

   !> The response of the elements `which`, element e to the motion e.
   subroutine respond_pack(sample, solid, which, u0, du, with_tangent, part)
      type(sample_t), intent(in) :: sample(:)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: which(:)
      real(wp), intent(in) :: u0(:, :, :), du(:, :, :)     !! (3, m, n_lane)
      logical, intent(in) :: with_tangent
      type(pack_response_t), intent(out) :: part
      type(element_pack_t) :: pack
      type(pack_motion_t) :: motion
      type(host_response_t) :: none
      integer :: i, l

      call fill_pack(sample, solid, which, pack)
      call pack_make_room(3, m, with_tangent, motion, part)
      motion%square = merge(1.0_wp, 0.0_wp, sample(1)%nlgeom)
      do l = 1, n_lane
         do i = 1, pack%n_node
            associate (e => pack%element(l))
               motion%from(l, :, i) = u0(:, i, e) - u0(:, 1, e)
               motion%by(l, :, i) = du(:, i, e) - du(:, 1, e)
            end associate
         end do
      end do
      call solid_pack_respond(solid, pack, motion, none, with_tangent, part)
   end subroutine respond_pack

   !> Each lane against the element alone, as the parts of emcon_element_space give it.
   subroutine test_packs(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample(n_lane)
      type(solid_t) :: solid
      type(pack_response_t) :: part
      type(space_part_t) :: one
      real(wp), dimension(3, m, n_lane) :: u0, du
      real(wp) :: size_of
      integer :: e, i

      do i = 0, 2*n_law*n_kind - 1
         call make_solid(1 + mod(i/n_law, n_kind), 1 + mod(i, n_law), i >= n_law*n_kind, sample, &
            solid, error)
         if (allocated(error)) return
         do e = 1, n_lane
            call draw(sample(e), u0(:, :, e), du(:, :, e))
         end do
         du(:, :, 3) = 0.0_wp
         call respond_pack(sample, solid, [(e, e = 1, n_lane)], u0, du, .true., part)
         do e = 1, n_lane
            call respond(sample(e), u0(:, :, e), du(:, :, e), .true., one)
            associate (n => sample(e)%n, what => sample(e)%what)
               size_of = maxval(one%magnitude(:, :n))
               call check_true(error, .not. part%is_inverted(e), what // ": is not inverted")
               call check_near(error, part%energy(e), one%energy, tol, one%energy, what)
               call check_near(error, part%force(e, :, :n), one%force(:, :n), tol, size_of, what)
               call check_near(error, part%magnitude(e, :, :n), one%magnitude(:, :n), tol, &
                  size_of, what // ": sizes")
               call check_near(error, reshape(part%tangent(e, :, :n, :, :n), [3*n, 3*n]), &
                  reshape(one%tangent(:, :n, :, :n), [3*n, 3*n]), tol, &
                  maxval(abs(one%tangent)), what // ": tangent")
            end associate
            if (allocated(error)) return
         end do
      end do
   end subroutine test_packs

   !> The bits of an element are those of it alone, with and without tangent and sizes, beside
   !> elements of any strain, those beyond the reach of series among them.
   subroutine test_lanes(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample(n_lane)
      type(solid_t) :: solid
      type(pack_response_t) :: part, other
      real(wp), dimension(3, m, n_lane) :: u0, du
      integer :: e, i, k, l

      do i = 0, n_law*n_kind - 1
         call make_solid(1 + i/n_law, 1 + mod(i, n_law), .true., sample, solid, error)
         if (allocated(error)) return
         do e = 1, n_lane
            call draw(sample(e), u0(:, :, e), du(:, :, e))
            if (mod(e, 2) == 0) du(:, :, e) = du(:, :, e) + 3.0_wp*sample(e)%x
         end do
         call respond_pack(sample, solid, [(e, e = 1, n_lane)], u0, du, .true., part)
         do e = 1, n_lane
            l = merge(2, 1, e > 4)
            call respond_pack(sample, solid, [(1 + mod(e - l + k + n_lane, n_lane), k = 0, 1)], &
               u0, du, e == 5, other)
            associate (n => sample(e)%n)
               call check_true(error, abs(part%energy(e) - other%energy(l)) <= 0.0_wp .and. &
                  all(abs(part%force(e, :, :n) - other%force(l, :, :n)) <= 0.0_wp), &
                  sample(e)%what // ": bits of element " // to_text(e))
               if (e == 5) call check_true(error, all(abs(part%tangent(e, :, :n, :, :n) &
                  - other%tangent(l, :, :n, :, :n)) <= 0.0_wp), sample(e)%what // ": tangent")
            end associate
         end do
         if (allocated(error)) return
      end do
   end subroutine test_lanes

   !> Turned inside out along one axis, or along two, which det F does not tell: those alone.
   subroutine test_inverted(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample(n_lane)
      type(solid_t) :: solid
      type(pack_response_t) :: part
      type(space_part_t) :: one
      real(wp), dimension(3, m, n_lane) :: u0, du
      integer :: e, i

      do i = 0, n_law*n_kind - 1
         call make_solid(1 + i/n_law, 1 + mod(i, n_law), .true., sample, solid, error)
         if (allocated(error)) return
         do e = 1, n_lane
            call draw(sample(e), u0(:, :, e), du(:, :, e))
         end do
         du(1, :, 2) = -2.0_wp*sample(2)%x(1, :)
         du(:2, :, 5) = -2.0_wp*sample(5)%x(:2, :)
         du(3, :, 7) = huge(1.0_wp)**0.2_wp*sample(7)%x(3, :)
         call respond_pack(sample, solid, [(e, e = 1, n_lane)], u0, du, mod(i, 2) == 0, part)
         do e = 1, n_lane
            call respond(sample(e), u0(:, :, e), du(:, :, e), .false., one)
            call check_true(error, part%is_inverted(e) .eqv. one%is_inverted, sample(e)%what &
               // ": element " // to_text(e))
            if (e == 2 .or. e == 7) call check_true(error, part%is_inverted(e), "inside out")
            if (one%is_inverted) cycle
            associate (n => sample(e)%n)
               call check_near(error, part%force(e, :, :n), one%force(:, :n), tol, &
                  maxval(one%magnitude(:, :n)), sample(e)%what // ": beside inverted ones")
            end associate
         end do
         if (allocated(error)) return
      end do
   end subroutine test_inverted

   !> Central differences over four points, of step h = eps^(0.3): an error of order h^4 = eps^(1.2)
   !> and one of eps/h = eps^(0.7).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step, near(2), far(2)
      real(wp) :: u0(3, m), du(3, m), way(3, m), sum(3, m), h
      integer :: a, i, j, k, n_way

      h = eps**0.3_wp
      do i = 0, n_law*n_kind - 1
         call make_sample(1 + i/n_law, 1 + mod(i, n_law), mod(i, 3) > 0, 0.03_wp, sample, error)
         if (allocated(error)) return
         call draw(sample, u0, du)
         call respond(sample, u0, du, .true., step)
         n_way = (3*sample%n + 4)/5
         do k = 1, n_way
            way = 0.0_wp
            way(:, :sample%n) = reshape(signs_of(3*sample%n, k, n_way), [3, sample%n])
            sum = 0.0_wp
            do j = 1, sample%n
               do a = 1, 3
                  sum = sum + way(a, j)*step%tangent(:, :, a, j)
               end do
            end do
            call respond(sample, u0, du + h*way, .false., near(1))
            call respond(sample, u0, du - h*way, .false., near(2))
            call respond(sample, u0, du + 2.0_wp*h*way, .false., far(1))
            call respond(sample, u0, du - 2.0_wp*h*way, .false., far(2))
            call check_near(error, sum, &
               (8.0_wp*(near(1)%force - near(2)%force) - (far(1)%force - far(2)%force)) &
               /(12.0_wp*h), 800.0_wp*eps**0.7_wp, young, sample%what)
         end do
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> The same motion of the turned element: the same energy, forces turned.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample, other
      type(space_part_t) :: step, turned
      real(wp) :: u0(3, m), du(3, m), r(3, 3)
      integer :: i

      r = rotation(1.1_wp)
      do i = 0, n_law*n_kind - 1
         call make_sample(1 + i/n_law, 1 + mod(i, n_law), .true., 0.03_wp, sample, error)
         if (allocated(error)) return
         call draw(sample, u0, du)
         call respond(sample, u0, du, .false., step)
         other = sample
         other%x = matmul(r, sample%x)
         call place_element(other)
         call respond(other, matmul(r, u0), matmul(r, du), .false., turned)
         call check_near(error, turned%energy, step%energy, tol, young, sample%what // ": energy")
         call check_near(error, turned%force, matmul(r, step%force), tol, young, &
            sample%what // ": forces")
         if (allocated(error)) return
      end do
   end subroutine test_turned

   !> Uniform grad u on a distorted element: W times the volume, and the work of the forces on every
   !> uniform field is stress times its gradient times the volume.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      type(space_response_t) :: state
      real(wp), parameter :: grad(3, 3) = reshape([0.1_wp, -0.2_wp, 0.05_wp, 0.3_wp, 0.15_wp, &
         0.1_wp, -0.1_wp, 0.05_wp, -0.08_wp], [3, 3])
      real(wp) :: u0(3, m), zero(3, m), f(3, 3), c(3, 3), s(3, 3), volume
      integer :: a, i

      zero = 0.0_wp
      do i = 0, 2*n_law*n_kind - 1
         call make_sample(1 + mod(i/n_law, n_kind), 1 + mod(i, n_law), i >= n_law*n_kind, 0.03_wp, &
            sample, error)
         if (allocated(error)) return
         u0 = matmul(grad, sample%x)
         f = 0.0_wp
         do a = 1, 3
            f(a, a) = 1.0_wp
         end do
         c = grad + transpose(grad)
         if (sample%nlgeom) then
            c = c + matmul(transpose(grad), grad)
            f = f + grad
         end if
         call law_response_space(sample%law, [0.5_wp*c(1, 1), 0.5_wp*c(2, 2), 0.5_wp*c(3, 3), &
            c(1, 2), c(2, 3), c(1, 3)], spread(0.0_wp, 1, 6), state)
         s = reshape([state%stress([1, 4, 6]), state%stress([4, 2, 5]), state%stress([6, 5, 3])], &
            [3, 3])
         volume = sum(sample%element%weight)
         call respond(sample, u0, zero, .false., step)
         call check_near(error, step%energy, volume*state%energy, tol, young, &
            sample%what // ": energy")
         call check_near(error, matmul(step%force, transpose(sample%x)), volume*matmul(f, s), tol, &
            young, sample%what // ": stress")
         if (allocated(error)) return
      end do
   end subroutine test_patch

   !> Of the tangent at rest: all but six rigid motions; with 2 x 2 x 2 points no more than these
   !> have strains.
   subroutine test_rank(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      real(wp) :: zero(3, m)
      integer :: k, n

      zero = 0.0_wp
      do k = 1, n_kind
         call make_sample(k, 1 + mod(k, n_law), .true., 0.03_wp, sample, error)
         if (allocated(error)) return
         n = sample%n
         call respond(sample, zero, zero, .true., step)
         call check_equal(error, rank_of(reshape(step%tangent(:, :n, :, :n), [3*n, 3*n])), &
            min(3*n - 6, 6*sample%element%n_gp), sample%what)
      end do
   end subroutine test_rank

   !> The motion u = (x y, 0, 0) of a cube has div u = y, whose mean is 0: the deviator alone
   !> resists, mu (e:e - y^2/3), and the mean of y^2 + x^2/2 - y^2/3 is 7/72.
   subroutine test_bending(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: step
      real(wp), allocatable :: place(:, :)
      real(wp) :: u(3, m), zero(3, m)
      real(wp), parameter :: nu = 0.4999_wp, small = 1.0e-3_wp
      real(wp), parameter :: mu = 0.5_wp*young/(1.0_wp + nu)

      zero = 0.0_wp
      call make_sample(n_kind, 1, .false., 0.0_wp, sample, error)
      call sample%shape%places(place)
      place = 0.5_wp*place
      call space_element_init(sample%element, sample%shape, place)
      call law_create(law_linear, [young, nu], sample%law, error)
      if (allocated(error)) return
      call sample%law%divide(sample%rest)
      u = 0.0_wp
      u(1, :sample%n) = small*place(1, :)*place(2, :)
      call respond(sample, u, zero, .false., step)
      call check_near(error, step%energy, mu*7.0_wp/72.0_wp*small**2, tol, &
         young*small**2, sample%what)
   end subroutine test_bending

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

   !> Of an affine image y = A x + b of the plain element: volume det A V, and with second moments M
   !> of the plain one those A M A^T of its image, in closed form for cube and tetrahedron.
   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      class(shape_t), allocatable :: shape
      real(wp), allocatable :: place(:, :), mass(:, :)
      real(wp), parameter :: a(3, 3) = reshape([1.0_wp, 0.2_wp, -0.1_wp, 0.3_wp, 1.5_wp, 0.2_wp, &
         0.1_wp, -0.4_wp, 0.8_wp], [3, 3])
      real(wp) :: det, volume, centre(3), second(3, 3)
      integer :: k

      det = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) - a(1, 2)*(a(2, 1)*a(3, 3) &
         - a(2, 3)*a(3, 1)) + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
      do k = 1, n_kind
         call make_shape(k, shape)
         call shape%places(place)
         second = 0.0_wp
         if (k == 1 .or. k == 3) then            ! int x = 1/24, int x^2 = 1/60, int x y = 1/120
            volume = 1.0_wp/6.0_wp
            centre = 1.0_wp/24.0_wp
            second = 1.0_wp/120.0_wp
            second(1, 1) = 1.0_wp/60.0_wp
            second(2, 2) = second(1, 1)
            second(3, 3) = second(1, 1)
         else
            volume = 8.0_wp
            centre = 0.0_wp
            second(1, 1) = 8.0_wp/3.0_wp
            second(2, 2) = second(1, 1)
            second(3, 3) = second(1, 1)
         end if
         if (allocated(mass)) deallocate(mass)
         allocate(mass(size(place, 2), size(place, 2)))
         place = matmul(a, place)
         call space_element_mass(shape, place, 3.0_wp, mass)
         call check_near(error, sum(mass), 3.0_wp*det*volume, tol, 1.0_wp, name(k) // ": mass")
         call check_near(error, matmul(place, sum(mass, 2)), 3.0_wp*det*matmul(a, centre), tol, &
            1.0_wp, name(k) // ": centre")
         call check_near(error, matmul(matmul(place, mass), transpose(place)), &
            3.0_wp*det*matmul(matmul(a, second), transpose(a)), tol, 1.0_wp, name(k) // ": inertia")
      end do
   end subroutine test_mass

   !> Energy-momentum steps of one free element that spins and vibrates: energy, momentum and
   !> angular momentum stay, to the round-off of as many steps.
   subroutine test_flight(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_part_t) :: part
      real(wp) :: u(3, m), v(3, m), du(3, m), mass(m, m), start(7), now(7)
      real(wp), parameter :: h = 0.02_wp
      integer, parameter :: n_step = 10
      integer :: i, k

      do k = 1, n_kind
         call make_sample(k, 2 + mod(k, 4), .true., 0.0_wp, sample, error)
         if (allocated(error)) return
         mass = 0.0_wp
         call space_element_mass(sample%shape, sample%x(:, :sample%n), 1.0_wp, &
            mass(:sample%n, :sample%n))
         u = 0.0_wp
         call shake(v, 0.3_wp)
         v = v + matmul(rotation(1.5_wp), sample%x)
         v(:, sample%n + 1:) = 0.0_wp
         call respond(sample, u, 0.0_wp*u, .false., part)
         start = invariants(sample%x + u, v, mass, part%energy)
         do i = 1, n_step
            du = h*v
            call solve_step(sample, mass, h, u, v, du, part, error)
            if (allocated(error)) return
            u = u + du
            v = 2.0_wp/h*du - v
         end do
         now = invariants(sample%x + u, v, mass, part%energy)
         call check_near(error, now, start, n_step*tol, maxval(abs(start)), sample%what)
      end do
   end subroutine test_flight

   !> Energy, momentum, angular momentum.
   pure function invariants(place, v, mass, energy) result(all)
      real(wp), intent(in) :: place(3, m), v(3, m), mass(m, m), energy
      real(wp) :: all(7), momentum(3, m)

      momentum = matmul(v, mass)
      all(1) = energy + 0.5_wp*sum(momentum*v)
      all(2:4) = sum(momentum, 2)
      all(5:7) = moment(place, momentum)
   end function invariants

   !> Newton's method for M (2/h^2 du - 2/h v) + f = 0.
   subroutine solve_step(sample, mass, h, u, v, du, part, error)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: mass(m, m), h, u(3, m), v(3, m)
      real(wp), intent(inout) :: du(3, m)
      type(space_part_t), intent(inout) :: part
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: r(3, m), matrix(3*sample%n, 3*sample%n), way(3*sample%n)
      integer :: a, i, j, k, n

      n = sample%n
      do k = 1, 30
         call respond(sample, u, du, .true., part)
         call check_true(error, .not. part%is_inverted, sample%what // ": is not inverted")
         r = matmul(2.0_wp/h**2*du - 2.0_wp/h*v, mass) + part%force
         if (k > 5 .and. maxval(abs(r)) <= 16.0_wp*eps*maxval(abs(part%magnitude) &
            + 2.0_wp/h*abs(matmul(v, mass)))) return
         if (k > 12) return
         matrix = reshape(part%tangent(:, :n, :, :n), [3*n, 3*n])
         do j = 1, n
            do i = 1, n
               do a = 1, 3
                  matrix(3*i - 3 + a, 3*j - 3 + a) = matrix(3*i - 3 + a, 3*j - 3 + a) &
                     + 2.0_wp/h**2*mass(i, j)
               end do
            end do
         end do
         call solve(matrix, reshape(r(:, :n), [3*n]), way)
         du(:, :n) = du(:, :n) - reshape(way, [3, n])
      end do
   end subroutine solve_step

   !> Gauss's elimination; the matrix is nearly that of the mass, so that its diagonal serves.
   pure subroutine solve(matrix, right, x)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(in) :: right(:)
      real(wp), intent(out) :: x(:)
      real(wp) :: factor
      integer :: i, j, n

      n = size(x)
      x = right
      do j = 1, n
         do i = j + 1, n
            factor = matrix(i, j)/matrix(j, j)
            matrix(i, j:) = matrix(i, j:) - factor*matrix(j, j:)
            x(i) = x(i) - factor*x(j)
         end do
      end do
      do i = n, 1, -1
         x(i) = (x(i) - dot_product(matrix(i, i + 1:), x(i + 1:)))/matrix(i, i)
      end do
   end subroutine solve

end module test_element_space
