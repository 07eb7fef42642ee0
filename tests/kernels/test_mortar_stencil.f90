!> Which nodes and constants a pair of mortar edges has: neighbours up to corners, and cubics that
!> follow parabolas.
module test_mortar_stencil
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_init, chain_shorter, chain_shortest, chain_t, &
      chain_thickness, next, previous
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : frame_t, local_master, n_place, pair_stencil_t, place_after, &
      place_before, place_first, place_last
   use emcon_mortar_stencil, only : frame_faces, stencil_gather, stencil_master, stencil_slave
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : add_surface, block_t, make_block, shake, top
   implicit none
   private
   public :: collect_mortar_stencil

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: n = 5
   !> Nodes of the surface, uneven, from the right to the left.
   real(wp), parameter :: place(0:n) = [4.0_wp, 3.7_wp, 2.7_wp, 1.2_wp, 0.8_wp, 0.0_wp]

contains

   subroutine collect_mortar_stencil(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("masters that are smoothed follow parabolas", test_parabola), &
         test_case_t("masters that are polygons", test_polygon), &
         test_case_t("slaves with averaged normals", test_slave), &
         test_case_t("positions and motions from the first node", test_gather), &
         test_case_t("edges that face each other", test_faces), &
         test_case_t("lengths and thicknesses beside nodes", test_lengths)]
   end subroutine collect_mortar_stencil

   subroutine make_chain(chain, scene, error)
      type(chain_t), intent(out) :: chain
      type(scene_t), intent(out) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      integer :: i

      call make_block(scene, "CPE4", [n, 1], block)
      do i = 0, n
         scene%x(1, [n + 1 - i, 2*(n + 1) - i]) = place(i)
      end do
      call add_surface(scene, "TOP", block, [top])
      call chain_init(chain, scene, scene%surface(1), error)
   end subroutine make_chain

   !> Is there a neighbour that edge `e` is smoothed with?
   pure logical function goes_on(chain, e, side, is_corner)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: e, side
      logical, intent(in) :: is_corner(:)

      associate (beside => chain%neighbour(side, e))
         goes_on = beside > 0
         if (goes_on) goes_on = .not. is_corner(merge(e, beside, side == previous))
      end associate
   end function goes_on

   !> With corners nowhere, at one node and at two: with neighbours on one side at least a parabola
   !> over the surface is met, else its chord.
   subroutine test_parabola(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      type(pair_stencil_t) :: stencil
      real(wp) :: coefficients(0:3), expected(0:3), at(4), h
      logical :: is_corner(n), goes(2)
      integer :: k, m, side

      call make_chain(chain, scene, error)
      if (allocated(error)) return
      do k = 1, 3
         is_corner = .false.
         if (k > 1) is_corner(2) = .true.
         if (k > 2) is_corner(3) = .true.
         do m = 1, n
            call stencil_master(stencil, chain, m, .true., .false., is_corner)
            goes = [(goes_on(chain, m, side, is_corner), side = 1, 2)]
            call check_equal(error, [stencil%edge, stencil%n_master], [m, 4], "edge")
            call check_true(error, all((stencil%node(local_master(3:)) > 0) .eqv. goes), &
               "neighbours")
            at = 0.0_wp
            associate (node => stencil%node(local_master))
               call check_equal(error, node(:2), chain%facet(:, m), "its nodes")
               if (goes(1)) call check_equal(error, node(3), chain%facet(1, chain%neighbour( &
                  previous, m)), "before")
               if (goes(2)) call check_equal(error, node(4), chain%facet(2, chain%neighbour(next, &
                  m)), "after")
               where (node > 0) at = scene%x(1, max(1, node))
            end associate
            h = at(2) - at(1)
            coefficients = matmul(stencil%shape, parabola(at))
            expected = [parabola(at(1)), h*(0.3_wp + 1.4_wp*at(1)), 0.7_wp*h**2, 0.0_wp]
            if (.not. any(goes)) expected(1:) = [parabola(at(2)) - parabola(at(1)), 0.0_wp, 0.0_wp]
            call check_near(error, coefficients, expected, tol, 20.0_wp, "cubic " // to_text(m))
            call check_near(error, sum(stencil%shape, 2), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], tol, &
               1.0_wp, "parts of one")
         end do
      end do

   contains

      elemental real(wp) function parabola(x)
         real(wp), intent(in) :: x

         parabola = 0.0_wp
         if (x >= 0.0_wp) parabola = 2.0_wp + 0.3_wp*x + 0.7_wp*x**2
      end function parabola

   end subroutine test_parabola

   !> Points that look past the ends see the neighbours, whatever corners there are.
   subroutine test_polygon(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      type(pair_stencil_t) :: stencil
      logical, parameter :: is_corner(n) = .true.
      integer :: m

      call make_chain(chain, scene, error)
      if (allocated(error)) return
      do m = 1, n
         stencil%node = 99
         call stencil_master(stencil, chain, m, .false., .true., is_corner)
         call check_true(error, all((stencil%node(local_master(3:)) > 0) .eqv. &
            chain%neighbour(:, m) > 0), "neighbours")
         call check_equal(error, stencil%n_master, 4, "wide")
         call check_near(error, stencil%shape, 0.0_wp*stencil%shape, 0.0_wp, 1.0_wp, "no cubic")
         call stencil_master(stencil, chain, m, .false., .false., is_corner)
         call check_equal(error, [stencil%n_master, stencil%node(local_master)], [2, &
            chain%facet(:, m), 0, 0], "a single edge")
      end do
   end subroutine test_polygon

   subroutine test_slave(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      type(pair_stencil_t) :: stencil
      logical :: is_corner(n), goes(2)
      integer :: e, k, side

      call make_chain(chain, scene, error)
      if (allocated(error)) return
      do k = 1, 3
         ! Corners are at the ends of a surface too.
         is_corner = chain%neighbour(previous, :) == 0
         if (k == 2) is_corner(3) = .true.
         do e = 1, n
            call stencil_slave(stencil, chain, e, k < 3, is_corner)
            goes = [(goes_on(chain, e, side, is_corner) .and. k < 3, side = 1, 2)]
            associate (node => stencil%node, own => chain%size(e))
               call check_equal(error, node([place_first, place_last]), chain%facet(:, e), "nodes")
               call check_true(error, all((node([place_before, place_after]) > 0) .eqv. goes), &
                  "neighbours")
               call check_true(error, stencil%has_field .eqv. any(goes), "two normals")
               call check_equal(error, reshape(stencil%tangent, [4]), [place_last, &
                  merge(place_before, place_first, goes(1)), merge(place_after, &
                  place_last, goes(2)), place_first], "tangents")
               do side = 1, 2
                  if (.not. goes(side)) then
                     call check_near(error, stencil%weight(side), 1.0_wp/own, tol, 4.0_wp, "alone")
                  else
                     associate (beside => chain%neighbour(side, e))
                        call check_near(error, stencil%weight(side), 1.0_wp/(own &
                           + chain%size(beside)), tol, 4.0_wp, "weight")
                        call check_equal(error, node(merge(place_before, place_after, side == 1)), &
                           chain%facet(side, beside), "its far node")
                     end associate
                  end if
               end do
            end associate
         end do
      end do
   end subroutine test_slave

   subroutine test_gather(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      real(wp), dimension(2, 9) :: x, u0, du
      real(wp), dimension(2, n_place) :: local, dlocal
      integer :: k

      call shake(x, 1.0_wp)
      call shake(u0, 1.0_wp)
      call shake(du, 1.0_wp)
      stencil%node = [(1 + mod(5*k, 9), k = 1, n_place)]
      stencil%node(place_after) = 0
      local = 7.0_wp
      dlocal = 7.0_wp
      call stencil_gather(stencil, x, u0, du, local, dlocal)
      do k = 1, n_place
         associate (node => stencil%node(k), first => stencil%node(place_first))
            if (node == 0) then
               call check_near(error, [local(:, k), dlocal(:, k)], spread(0.0_wp, 1, 4), 0.0_wp, &
                  1.0_wp, "absent")
            else
               call check_near(error, local(:, k), x(:, node) + u0(:, node) - x(:, first) &
                  - u0(:, first), tol, 4.0_wp, "position")
               call check_near(error, dlocal(:, k), du(:, node), 0.0_wp, 1.0_wp, "motion")
            end if
         end associate
      end do
   end subroutine test_gather

   !> Against both tangents by more than a quarter, the cosine of their angle.
   subroutine test_faces(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: cosine(5) = [-1.0_wp, -0.26_wp, -0.24_wp, 0.0_wp, 0.9_wp]
      type(frame_t) :: frame
      integer :: i, j

      do i = 1, 5
         do j = 1, 5
            frame%along(:, 2) = 0.5_wp
            frame%above(:, 2) = -0.25_wp
            frame%along(:, 4) = 0.5_wp + 3.0_wp*[cosine(i), cosine(j)]
            frame%above(:, 4) = -0.25_wp + 3.0_wp*sqrt(1.0_wp - [cosine(i), cosine(j)]**2)
            call check_true(error, frame_faces(frame, 2, 4) .eqv. max(i, j) < 3, "faces")
         end do
      end do
   end subroutine test_faces

   !> The shortest edge at each node, the shorter one of each edge and its neighbours, the thickness
   !> of the element behind; 1 where there is none.
   subroutine test_lengths(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp), allocatable :: thickness(:)
      real(wp) :: length(n)
      integer :: e, k

      call make_chain(chain, scene, error)
      if (allocated(error)) return
      length = place(:n - 1) - place(1:)
      do k = 0, n
         associate (i => findloc(chain%node, 2*(n + 1) - k, 1))
            call check_near(error, chain_shortest(chain, i), minval(length(max(1, k):min(n, k &
               + 1))), tol, 4.0_wp, "shortest")
         end associate
      end do
      do e = 1, n
         call check_near(error, chain_shorter(chain, e), [minval(length(max(1, e - 1):e)), &
            minval(length(e:min(n, e + 1)))], tol, 4.0_wp, "shorter ones")
      end do
      scene%section = [scene%section, scene%section]
      scene%section%thickness = [0.5_wp, 0.25_wp]
      scene%element%section = [1, 1, 2, 2, 2]
      chain%element(1) = 0
      call chain_thickness(chain, scene, thickness)
      ! From the left to the right: two elements, then three, the last of them unknown.
      call check_near(error, thickness, [0.5_wp, 0.5_wp, 0.5_wp, 0.25_wp, 0.25_wp, 1.0_wp], &
         0.0_wp, 1.0_wp, "thickness")
   end subroutine test_lengths

end module test_mortar_stencil
