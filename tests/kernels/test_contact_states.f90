!> What contacts say of themselves beside their gaps: whether stencils hold, how far apart surfaces
!> are, arcs that are met within a step, places that are fixed as it begins.
module test_contact_states
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_hermite, only : hermite_stencil_t
   use emcon_hermite_gap_value, only : hermite_begin
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_mortar, &
      formulation_nts, formulation_segment, integration_elements, integration_segments, &
      multiplier_dual, multiplier_standard, normal_edge, normal_nodal, smoothing_hermite, &
      smoothing_none
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_points, midside_stretch
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use midside_scenes, only : make_curved_rows
   use random_draws, only : draw_random
   use ring_scenes, only : make_rings
   use small_scenes, only : block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_contact_states

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar]
   !> Kinds of contact: see `make_kind`.
   integer, parameter :: n_kind = 19

contains

   subroutine collect_contact_states(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a smoothed stencil holds up to the edge beside", test_smooth_covers), &
         test_case_t("where pieces of a curve are looked for", test_places), &
         test_case_t("arcs that are met within the step", test_arcs_met), &
         test_case_t("surfaces stay apart as far as is said", test_clearance), &
         test_case_t("in other units of length", test_units)]
   end subroutine collect_contact_states

   !> Over a bulge, at the far node of the edge beside the chosen one: the polygon's edges there are
   !> equally near to what is between their normals, the curve ends in the middle of these.
   subroutine test_smooth_covers(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap = 0.2_wp, off = 0.01_wp*gap
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      class(contact_t), allocatable :: contact
      type(contact_options_t) :: options
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: tangent(2), place(2)
      integer :: k, side, master

      options%smoothing = smoothing_hermite
      call make_two_blocks(scene, gap, lower, upper)
      call new_contact(scene, scene%pair(1), contact, error)
      if (allocated(error)) return
      call contact%configure(scene%x, options)
      allocate(u, du, source=0.0_wp*scene%x)
      u(2, 6:10) = -0.05_wp*scene%x(1, 6:10)**2
      do k = 1, 2
         ! The first node looks at the edge from -1 to 0, the second one at that from 0 to 1.
         master = merge(9, 7, k == 1)
         place = scene%x(:, master) + u(:, master)
         tangent = [1.0_wp, merge(-0.1_wp, 0.1_wp, k == 1)]/hypot(1.0_wp, 0.1_wp)
         do side = -1, 1, 2
            du = 0.0_wp
            contact%reach = 0.0_wp
            call contact%begin_step(scene%x, u, du)
            du(:, 10 + k) = place + gap*[-tangent(2), tangent(1)] + side*off*tangent &
               - scene%x(:, 10 + k)
            call contact%measure(scene%x, u, du)
            call check_true(error, contact%covers(k, scene%x, u, du) .eqv. (side == 1) .eqv. &
               k == 2, "node " // to_text(k) // " on side " // to_text(side))
            call check_near(error, contact%state(k)%gap1, gap, 1.0e-3_wp, gap, "its gap")
         end do
      end do
   end subroutine test_smooth_covers

   !> The nearest point of the straight edge that a piece stands for, ends included: by distance.
   subroutine test_places(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: chain(6) = [6, 4, 2, 3, 5, 7], piece(3) = [3, 2, 4]
      type(hermite_stencil_t) :: stencil
      real(wp) :: x(2, 7), s(3), t, nearest, from(2), edge(2)
      integer :: i, k, j

      stencil%node = chain
      do i = 1, 50
         call draw_random(x)
         x(1, chain) = [(real(j, wp), j = -2, 3)] + 0.4_wp*x(1, chain)
         x(:, 1) = 5.0_wp*x(:, 1) - [2.0_wp, 2.0_wp]
         stencil%length = norm2(x(:, chain(2:)) - x(:, chain(:5)), 1)
         call hermite_begin(stencil, x, s)
         do k = 1, 3
            from = x(:, chain(piece(k)))
            edge = x(:, chain(piece(k) + 1)) - from
            t = s(k) - merge(0.0_wp, merge(-1.0_wp, 1.0_wp, k == 2), k == 1)
            call check_true(error, t >= -tol .and. t <= 1.0_wp + tol, "on the edge")
            nearest = norm2(from + t*edge - x(:, 1))
            do j = 0, 20
               call check_true(error, norm2(from + 0.05_wp*j*edge - x(:, 1)) >= nearest &
                  *(1.0_wp - tol), "no nearer point, piece " // to_text(k))
            end do
         end do
      end do
   end subroutine test_places

   !> A hub that turns into its place within the step has, where it was off the end of the sleeve,
   !> the sagittas of that place: as one that stands there.
   subroutine test_arcs_met(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(contact_options_t) :: options
      real(wp), allocatable :: u(:, :), du(:, :), there(:)
      !> By 30 degrees, clockwise; edges of the hub are 90/7 degrees long.
      real(wp), parameter :: angle = acos(0.0_wp)/3.0_wp, off_below = angle - acos(0.0_wp)/7.0_wp
      real(wp), parameter :: turn(2, 2) = reshape([cos(angle), -sin(angle), sin(angle), &
         cos(angle)], [2, 2])
      integer :: k, i

      call make_rings(scene, [7, 10], 0.0_wp, .false.)
      scene%pair(1)%formulation = formulation_mortar
      allocate(u, du, source=0.0_wp*scene%x)
      do k = 1, 3
         options%multiplier = merge(multiplier_dual, multiplier_standard, btest(k, 0))
         options%normal = merge(normal_edge, normal_nodal, k == 3)
         call new_contact(scene, scene%pair(1), contact, error)
         if (allocated(error)) return
         call contact%suit_steps(.true.)
         call contact%configure(scene%x, options)
         call contact%follow_arcs(scene%x, options, .true.)
         u = 0.0_wp
         call contact%begin_step(scene%x, u, u)
         there = contact%sagitta
         u(:, :16) = matmul(turn, scene%x(:, :16)) - scene%x(:, :16)
         du = -u
         contact%reach = 0.0_wp
         call contact%begin_step(scene%x, u, du)
         do i = 1, contact%n_constraint
            associate (x => scene%x(:, contact%node(i)))
               if (atan2(x(2), x(1)) < off_below) call check_near(error, contact%sagitta(i), &
                  there(i), 16.0_wp*tol, 1.0_wp, "kind " // to_text(k) // ", place " // to_text(i))
            end associate
         end do
         call check_true(error, maxval(abs(contact%sagitta - there)) > 1.0e-3_wp, "others differ")
         if (allocated(error)) return
      end do
   end subroutine test_arcs_met

   !> Nodes of curved sides move by up to half of the clearance, as far as that goes against each
   !> other: contact points move no farther than the clearance says.
   subroutine test_clearance(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      real(wp), allocatable :: u(:, :), du(:, :), point(:, :)
      real(wp) :: apart
      integer :: k, i, middle

      call make_curved_rows(scene)
      scene%x(2, 16:) = scene%x(2, 16:) + 20.0_wp
      allocate(u, du, source=0.0_wp*scene%x)
      do k = 1, size(formulations)
         du = 0.0_wp
         call new_contact(scene, contact_pair_t(slave=2, master=1, formulation=formulations(k)), &
            contact, error)
         if (allocated(error)) return
         call contact%configure(scene%x, contact_options_t())
         call contact%begin_step(scene%x, u, du)
         call check_true(error, contact%clearance > 1.0_wp, "far apart")
         call check_true(error, midside_stretch(contact%midside) > 1.5_wp, "points move farther")
         ! Ends against middles: points move by 5/3 of what nodes move by.
         du(2, :) = -0.5_wp*contact%clearance
         du(2, 16:) = -du(2, 16:)
         do i = 1, contact%midside%n
            middle = contact%midside%side(i)%middle
            du(2, middle) = -du(2, middle)
         end do
         point = midside_points(contact%midside, du)
         apart = minval(scene%x(2, 16:18) + point(2, 16:18)) - maxval(scene%x(2, 11:15) &
            + point(2, 11:15))
         call check_true(error, apart > 0.0_wp, "still apart")
         deallocate(contact)
      end do
   end subroutine test_clearance

   !> Formulation `k`, 1 to n_kind: nodes over polygons and smoothed, segments, mortar of all kinds.
   subroutine make_kind(scene, k, contact, error)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options

      scene%pair(1)%formulation = formulations(max(1, min(3, k - 1)))
      scene%pair(1)%interaction%friction = 0.2_wp
      options%smoothing = merge(smoothing_hermite, smoothing_none, k == 2 .or. (k > 3 .and. &
         btest(k, 0)))
      options%multiplier = merge(multiplier_dual, multiplier_standard, btest(k, 1))
      options%normal = merge(normal_edge, normal_nodal, btest(k, 2))
      options%integration = merge(integration_elements, integration_segments, btest(k, 3))
      call new_contact(scene, scene%pair(1), contact, error)
      if (allocated(error)) return
      call contact%suit_steps(.false.)
      call contact%configure(scene%x, options)
   end subroutine make_kind

   !> All lengths are multiplied by a power of 2: gaps, slips and sizes are to the last bit,
   !> gradients stay, second derivatives are divided by it.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: unit(2) = 2.0_wp**[-20, 20]
      type(scene_t) :: scene, other
      type(block_t) :: lower, upper
      class(contact_t), allocatable :: contact, scaled
      type(condition_t) :: item(3), item_scaled(3)
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: gaps(3, 3)
      integer :: k, i, j

      do k = 1, n_kind
         call make_two_blocks(scene, 0.02_wp, lower, upper)
         allocate(u, du, mold=scene%x)
         call shake(u, 0.05_wp)
         call shake(du, 0.05_wp)
         call make_kind(scene, k, contact, error)
         if (allocated(error)) return
         call contact%begin_step(scene%x, u, du)
         call contact%measure(scene%x, u, du)
         gaps = reshape([contact%state%gap0, contact%state%gap1, contact%state%size], [3, 3])
         item%has_friction = .true.
         call contact%evaluate([1, 2, 3], scene%x, u, du, spread(0.0_wp, 1, 3), item)
         do j = 1, size(unit)
            other = scene
            other%x = unit(j)*scene%x
            call make_kind(other, k, scaled, error)
            if (allocated(error)) return
            call scaled%begin_step(other%x, unit(j)*u, unit(j)*du)
            call scaled%measure(other%x, unit(j)*u, unit(j)*du)
            associate (name => "kind " // to_text(k) // ", unit " // to_text(j))
               call check_near(error, reshape([scaled%state%gap0, scaled%state%gap1, &
                  scaled%state%size], [3, 3]), unit(j)*gaps, 0.0_wp, 1.0_wp, "gaps, " // name)
               item_scaled%has_friction = .true.
               call scaled%evaluate([1, 2, 3], other%x, unit(j)*u, unit(j)*du, &
                  spread(0.0_wp, 1, 3), item_scaled)
               do i = 1, 3
                  associate (a => item(i), b => item_scaled(i), m => item(i)%n_node)
                     call check_equal(error, b%node(:b%n_node), a%node(:m), "nodes, " // name)
                     call check_near(error, b%g(:, :m), a%g(:, :m), 0.0_wp, 1.0_wp, "g, " // name)
                     call check_near(error, b%c(:, :m), a%c(:, :m), 0.0_wp, 1.0_wp, "c, " // name)
                     call check_near(error, unit(j)*b%h(:2*m, :2*m), a%h(:2*m, :2*m), 0.0_wp, &
                        1.0_wp, "h, " // name)
                     call check_near(error, b%slip, unit(j)*a%slip, 0.0_wp, 1.0_wp, "slip, " &
                        // name)
                     call check_near(error, b%t(:, :m, 1), a%t(:, :m, 1), 0.0_wp, 1.0_wp, "t, " &
                        // name)
                  end associate
               end do
            end associate
            if (allocated(error)) return
            deallocate(scaled)
         end do
         deallocate(contact, u, du)
      end do
   end subroutine test_units

end module test_contact_states
