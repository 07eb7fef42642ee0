!> Arcs that edges are chords of: circles in closed form, what is no arc, and gaps between arcs.
module test_arcs
   use check, only : check_near, check_true, test_case_t
   use emcon_arcs_plane, only : arc_height, arc_rise, arcs_find
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      formulation_segment, integration_elements, integration_segments, multiplier_dual, &
      multiplier_standard, normal_edge, normal_nodal
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_overclosure, only : overclosure_follow_arcs
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use ring_scenes, only : make_rings
   use small_scenes, only : add_block, add_surface, block_t, make_two_blocks, scene_begin, top
   implicit none
   private
   public :: collect_arcs

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: unlike(2) = [7, 10]
   !> The longest edges of these: angle, and sagitta on the radius of 2.
   real(wp), parameter :: turn = acos(0.0_wp)/7.0_wp, sagitta = 2.0_wp*turn**2/8.0_wp

contains

   subroutine collect_arcs(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the circle of the nodes", test_circle), &
         test_case_t("up to corners", test_corners), &
         test_case_t("flat sides, kinks and waves are no arcs", test_no_arc), &
         test_case_t("gaps between chords of one circle are 0", test_gaps), &
         test_case_t("interference of circles", test_interference), &
         test_case_t("surfaces that are measured as they are", test_as_they_are), &
         test_case_t("what is closed is so at rest, whatever was before", test_at_rest)]
   end subroutine collect_arcs

   !> Chords of unequal lengths: their arcs lie on the circle, also beside the ends of the surface.
   subroutine test_circle(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(chain_t) :: chain
      real(wp), allocatable :: curvature(:)
      real(wp) :: a(2), place(2), share
      integer :: s, e, k

      call make_rings(scene, unlike, 0.0_wp, .false.)
      do s = 1, 2
         call chain_init(chain, scene, scene%surface(s), error)
         if (allocated(error)) return
         allocate(curvature(chain%n_facet))
         call arcs_find(chain, scene%x, 60.0_wp, curvature)
         ! Three nodes on an arc tell its curvature to round-off by the square of its angle.
         call check_near(error, curvature, spread(merge(0.5_wp, -0.5_wp, s == 1), 1, &
            chain%n_facet), 16.0_wp*tol/turn**2, 1.0_wp, "curvature")
         do e = 1, chain%n_facet
            a = scene%x(:, chain%facet(2, e)) - scene%x(:, chain%facet(1, e))
            do k = 0, 4
               share = 0.25_wp*k
               place = scene%x(:, chain%facet(1, e)) + share*a + [a(2), -a(1)]/norm2(a) &
                  *arc_rise(curvature(e), chain%size(e), share, 0.0_wp)
               call check_near(error, norm2(place), 2.0_wp, tol, 1.0_wp, "radius")
               call check_height(scene%x(:, chain%facet(:, e)), share, curvature(e), error)
            end do
         end do
         deallocate(curvature)
      end do
   end subroutine test_circle

   !> What lies behind a corner says nothing about the arc before it, at either end.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 9
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: curvature(n), alone(n), turn
      integer :: i, first

      do first = 1, n - 3, 2
         call scene_begin(scene)
         call add_block(scene, "CPE4", [n, 1], [0.0_wp, 0.0_wp], [9.0_wp, 1.0_wp], block)
         ! The top runs back, in arcs of four edges with corners between them and the others.
         do i = 0, n
            turn = 0.3_wp*modulo(i - first, 4)
            scene%x(:, 2*n + 2 - i) = [-8.0_wp*((i - first + 40)/4) - 2.0_wp*sin(turn), &
               2.0_wp*cos(turn) - 0.1_wp*i]
         end do
         call add_surface(scene, "TOP", block, [top])
         call chain_init(chain, scene, scene%surface(1), error)
         if (allocated(error)) return
         call arcs_find(chain, scene%x, 30.0_wp, curvature)
         do i = 1, n
            alone(i) = curvature_of(i)
         end do
         call check_near(error, curvature, alone, tol, 1.0_wp, "corners from " // to_text(first))
         call check_true(error, any(abs(curvature) > 0.1_wp), "arcs")
      end do

   contains

      !> Of a chain of those edges alone that no corner parts from edge `e`.
      real(wp) function curvature_of(e)
         integer, intent(in) :: e
         type(surface_t) :: surface
         type(chain_t) :: part
         type(error_t), allocatable :: failure
         real(wp), allocatable :: of_part(:)
         integer :: low, high, k

         low = e
         do while (low > 1)
            if (turns(low - 1)) exit
            low = low - 1
         end do
         high = e
         do while (high < n)
            if (turns(high)) exit
            high = high + 1
         end do
         surface%name = "PART"
         allocate(surface%element(0), surface%face(0))
         surface%edge = chain%facet(:, low:high)
         call chain_init(part, scene, surface, failure)
         if (allocated(failure)) error = failure
         allocate(of_part(high - low + 1))
         call arcs_find(part, scene%x, 180.0_wp, of_part)
         do k = 1, size(of_part)
            if (part%facet(1, k) == chain%facet(1, e)) curvature_of = of_part(k)
         end do
      end function curvature_of

      !> Is there a corner behind edge `k`?
      logical function turns(k)
         integer, intent(in) :: k
         real(wp) :: a(2), b(2)

         a = scene%x(:, chain%facet(2, k)) - scene%x(:, chain%facet(1, k))
         b = scene%x(:, chain%facet(2, k + 1)) - scene%x(:, chain%facet(1, k + 1))
         turns = dot_product(a, b) < cos(acos(-1.0_wp)/6.0_wp)*norm2(a)*norm2(b)
      end function turns

   end subroutine test_corners

   !> The arc under nodes on one radius, from inside and outside and however far off.
   subroutine check_height(x, share, curvature, error)
      real(wp), intent(in) :: x(2, 2)            !! ends of an edge on the radius 2
      real(wp), intent(in) :: share              !! of it, where the radius goes through
      real(wp), intent(in) :: curvature
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: radius(3) = [1.7_wp, 2.0_wp, 2.5_wp]
      real(wp) :: along(2), normal(2), middle(2), direction(2), node(2)
      integer :: k

      along = (x(:, 2) - x(:, 1))/norm2(x(:, 2) - x(:, 1))
      normal = [along(2), -along(1)]
      middle = 0.5_wp*(x(:, 1) + x(:, 2))
      direction = x(:, 1) + share*(x(:, 2) - x(:, 1))
      direction = direction/norm2(direction)
      do k = 1, size(radius)
         node = radius(k)*direction - middle
         call check_near(error, arc_height(curvature, norm2(x(:, 2) - x(:, 1)), &
            dot_product(node, along), dot_product(node, normal)), &
            dot_product(2.0_wp*direction - middle, normal), tol, 1.0_wp, "along a radius")
      end do
   end subroutine check_height

   !> Sides of four edges by the heights of their nodes.
   subroutine test_no_arc(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: height(5, 4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.25_wp, 0.5_wp, 0.0_wp, 0.25_wp, 0.25_wp, 0.25_wp, 0.0_wp, &
         0.0_wp, 0.25_wp, 0.0_wp, 0.25_wp, 0.0_wp], [5, 4])
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: curvature(4)
      integer :: k

      do k = 1, size(height, 2)
         call scene_begin(scene)
         call add_block(scene, "CPE4", [4, 1], [0.0_wp, 0.0_wp], [4.0_wp, 1.0_wp], block)
         scene%x(2, 6:10) = 1.0_wp + height(:, k)
         call add_surface(scene, "TOP", block, [top])
         call chain_init(chain, scene, scene%surface(1), error)
         if (allocated(error)) return
         call arcs_find(chain, scene%x, 60.0_wp, curvature)
         call check_near(error, curvature, spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, &
            "side " // to_text(k))
      end do
   end subroutine test_no_arc

   !> Formulation `k`, 1 to 6, and its options.
   pure subroutine choose(k, formulation, options)
      integer, intent(in) :: k
      integer, intent(out) :: formulation
      type(contact_options_t), intent(out) :: options

      formulation = merge(formulation_mortar, merge(formulation_nts, formulation_segment, k == 1), &
         k > 2)
      options%multiplier = merge(multiplier_dual, multiplier_standard, mod(k, 2) == 0)
      options%normal = merge(normal_edge, normal_nodal, k == 5)
      options%integration = merge(integration_elements, integration_segments, k == 6)
   end subroutine choose

   !> The contact of two rings with the options `k`, at rest.
   subroutine make(scene, k, has_arcs, contact, error, largest)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      logical, intent(in) :: has_arcs            !! measure between arcs
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(out), optional :: largest !! change of a gap by arcs, taken where it matters
      type(contact_options_t) :: options
      real(wp) :: deepest

      call choose(k, scene%pair(1)%formulation, options)
      call new_contact(scene, scene%pair(1), contact, error)
      if (allocated(error)) return
      call contact%suit_steps(.true.)
      call contact%configure(scene%x, options)
      call contact%follow_arcs(scene%x, options, has_arcs)
      if (present(largest)) call overclosure_follow_arcs(contact, scene%x, scene%u0, options, &
         largest, deepest)
      contact%reach = 0.0_wp
      call contact%begin_step(scene%x, scene%u0, 0.0_wp*scene%u0)
      call contact%measure(scene%x, scene%u0, 0.0_wp*scene%u0)
   end subroutine make

   !> Points on arcs of one circle have no gap, along whatever normal. A condition is that of the
   !> measured gap.
   subroutine test_gaps(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact, chords
      type(condition_t) :: item(1)
      integer :: k, side, i

      do k = 1, 6
         do side = 1, 2
            call make_rings(scene, unlike, 0.0_wp, side == 2)
            call make(scene, k, .true., contact, error)
            if (.not. allocated(error)) call make(scene, k, .false., chords, error)
            if (allocated(error)) return
            associate (name => "combination " // to_text(k) // ", side " // to_text(side))
               call check_true(error, all(contact%state%is_near .and. contact%state%is_over), name)
               call check_near(error, maxval(abs(contact%state%gap0)), 0.0_wp, tol, sagitta, &
                  "gaps between arcs, " // name)
               call check_true(error, maxval(abs(chords%state%gap0)) > 0.1_wp*sagitta, &
                  "gaps between chords, " // name)
               do i = 1, contact%n_constraint
                  call contact%evaluate([i], scene%x, scene%u0, 0.0_wp*scene%u0, [0.125_wp], item)
                  call check_near(error, item(1)%gap1, contact%state(i)%gap0 - 0.125_wp, tol, &
                     1.0_wp, "condition, " // name)
               end do
            end associate
         end do
      end do
   end subroutine test_gaps

   !> A hub that is larger by a fifth of a sagitta: all gaps are that, but for the angle between the
   !> normals of two edges.
   subroutine test_interference(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: more = 0.2_wp*sagitta
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      real(wp) :: largest
      integer :: k, side

      do k = 1, 6
         do side = 1, 2
            call make_rings(scene, unlike, more, side == 2)
            call make(scene, k, .false., contact, error, largest)
            if (allocated(error)) return
            call check_true(error, maxval(abs(contact%state%gap0 + more)) <= more*turn**2, &
               "combination " // to_text(k) // ", side " // to_text(side))
            call check_true(error, largest > 0.1_wp*sagitta, "change")
         end do
      end do
   end subroutine test_interference

   !> Where nodes meet nodes, and on flat sides, gaps are those of edges to the last bit.
   subroutine test_as_they_are(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      class(contact_t), allocatable :: contact, chords
      type(contact_options_t) :: options
      real(wp) :: largest
      real(wp), allocatable :: u(:, :)
      integer :: k, side, formulation

      do k = 1, 6
         do side = 1, 2
            if (side == 1) call make_rings(scene, [8, 8], 0.2_wp*sagitta, .false.)
            if (side == 2) call make_two_blocks(scene, -0.1_wp, lower, upper)
            call make(scene, k, .false., contact, error, largest)
            if (.not. allocated(error)) call make(scene, k, .false., chords, error)
            if (allocated(error)) return
            call check_near(error, largest, 0.0_wp, 0.0_wp, 1.0_wp, "change")
            call check_near(error, contact%state%gap0, chords%state%gap0, 0.0_wp, 1.0_wp, "gaps")
         end do
         call make_rings(scene, unlike, 0.0_wp, .false.)
         call make(scene, k, .true., contact, error)
         if (.not. allocated(error)) call make(scene, k, .false., chords, error)
         if (allocated(error)) return
         ! Nothing rises over what is far away.
         u = 0.0_wp*scene%u0
         u(1, contact%node) = 50.0_wp
         contact%reach = 0.0_wp
         call contact%begin_step(scene%x, u, 0.0_wp*u)
         if (allocated(contact%sagitta)) call check_near(error, contact%sagitta, &
            0.0_wp*contact%sagitta, 0.0_wp, 1.0_wp, "far away")
         contact%reach = 0.0_wp
         call choose(k, formulation, options)
         call contact%follow_arcs(scene%x, options, .false.)
         call contact%begin_step(scene%x, scene%u0, 0.0_wp*scene%u0)
         call contact%measure(scene%x, scene%u0, 0.0_wp*scene%u0)
         call check_near(error, contact%state%gap0, chords%state%gap0, 0.0_wp, 1.0_wp, "once more")
      end do
   end subroutine test_as_they_are

   !> A hub that is larger by as much as an edge is in no touch as nothing moves: nothing changes,
   !> even if all was near in a step before.
   subroutine test_at_rest(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(contact_options_t) :: options
      real(wp) :: largest, deepest
      integer :: k, formulation

      do k = 1, 6
         call make_rings(scene, unlike, 2.0_wp*turn, .false.)
         call make(scene, k, .false., contact, error)
         if (allocated(error)) return
         call choose(k, formulation, options)
         contact%reach = 10.0_wp
         call overclosure_follow_arcs(contact, scene%x, scene%u0, options, largest, &
            deepest)
         call check_near(error, largest, 0.0_wp, 0.0_wp, 1.0_wp, "combination " // to_text(k))
         call check_true(error, .not. any(contact%state%is_near), "far")
      end do
   end subroutine test_at_rest

end module test_arcs
