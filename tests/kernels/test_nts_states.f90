!> Node-to-segment contact: what is measured over polygons and smoothed surfaces is what conditions
!> are made of, wherever the nodes are and whatever moves; ends, guards, offsets, slips and areas.
module test_nts_states
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact_law, only : contact_laws_reach, contact_laws_rub
   use emcon_errors, only : error_t
   use emcon_guards, only : corner_slack, guard_slack, guards_find
   use emcon_interactions, only : contact_damping_t, contact_options_t, contact_pair_t, &
      formulation_mortar, interaction_t, smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_nts, only : nts_init, nts_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, make_two_blocks, right, &
      scene_begin, shake, top
   implicit none
   private
   public :: collect_nts_states

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp), end_tol = 1.0e-3_wp
   !> Of `make_two_blocks`: where its slave nodes stand, on a surface from -2 to 2; the master
   !> nodes.
   real(wp), parameter :: at(3) = [-0.875_wp, 0.125_wp, 1.125_wp]
   integer, parameter :: first_upper = 11

contains

   subroutine collect_nts_states(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("measured at any start and for any motion", test_measure), &
         test_case_t("slips of conditions, over polygons and curves", test_slip), &
         test_case_t("over the ends of a surface", test_ends), &
         test_case_t("a curve holds up to the edge after next", test_covers), &
         test_case_t("a curve that turns holds up to its bisector", test_turns), &
         test_case_t("what a step reaches is chosen, from one start", test_reach), &
         test_case_t("statics: a corner pushes nodes of flat sides aside", test_leaving), &
         test_case_t("guards", test_guard), &
         test_case_t("one push on both nodes acts on the finer side's area", test_narrow)]
   end subroutine collect_nts_states

   !> Two blocks, a smoothed master or none, and an offset.
   subroutine begin(scene, smoothing, offset, nts, error)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: smoothing
      real(wp), intent(in) :: offset
      type(nts_t), intent(out) :: nts
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      scene%pair(1)%interaction = interaction_t(offset=offset, friction=0.5_wp)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      call nts%configure(scene%x, contact_options_t(smoothing=smoothing))
   end subroutine begin

   !> Stencils are chosen once; then gaps are measured there and from other starts, where nodes
   !> move, rest, or move elsewhere alone, and there once more: each is that of its condition.
   subroutine test_measure(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: smoothing(2) = [smoothing_none, smoothing_hermite]
      type(scene_t) :: scene
      type(nts_t) :: nts
      type(condition_t) :: item(1)
      real(wp), allocatable :: u(:, :), du(:, :), shift(:, :)
      real(wp) :: gap(3)
      integer :: k, i, m, kind

      do kind = 1, 2
         call begin(scene, smoothing(kind), 0.0625_wp, nts, error)
         if (allocated(error)) return
         allocate(u, du, shift, source=0.0_wp*scene%x)
         do k = 1, 10
            call shake(u, 0.05_wp)
            call nts%begin_step(scene%x, u, du)
            do m = 1, 5
               call shake(shift, 0.02_wp)
               if (m == 1 .or. m == 5) shift = 0.0_wp
               call shake(du, 0.04_wp)            ! in front of the surface: there offsets go around
               if (m == 3 .or. m == 4) du(:, nts%near%node) = 0.0_wp
               if (m == 4) du = 0.0_wp
               call nts%measure(scene%x, u + shift, du)
               do i = 1, 3
                  call nts%evaluate([i], scene%x, u + shift, du, [0.0_wp], item)
                  associate (state => nts%state(i), name => "kind " // to_text(kind) // &
                        ", motion " // to_text(m))
                     call check_true(error, state%is_near .and. state%is_over, name)
                     call check_near(error, [state%gap0, state%gap1], [item(1)%gap0, &
                        item(1)%gap1], 16.0_wp*tol, 1.0_wp, "gaps, " // name)
                     if (m == 3 .or. m == 4) call check_near(error, state%gap1, state%gap0, &
                        merge(0.0_wp, 16.0_wp*tol, kind == 1), 1.0_wp, "at rest, " // name)
                     call check_near(error, [state%size, state%other_size], [1.0_wp, 1.0_wp], tol, &
                        1.0_wp, "edges, " // name)
                  end associate
               end do
               if (allocated(error)) return
            end do
            ! What all nodes move by does not count, however far: these numbers are exact there.
            call shake(du, 0.04_wp)
            du = real(nint(2.0_wp**20*du), wp)*2.0_wp**(-20)
            call nts%measure(scene%x, u, du)
            gap = nts%state%gap1
            call nts%measure(scene%x, u, du + 2.0_wp**(digits(1.0_wp) - 23))
            call check_near(error, nts%state%gap1, gap, 16.0_wp*tol, 1.0_wp, "far away")
            du = 0.0_wp
         end do
         deallocate(u, du, shift)
      end do
   end subroutine test_measure

   !> The slip that is asked for is the one of the condition; along straight edges it is the way.
   subroutine test_slip(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: smoothing(2) = [smoothing_none, smoothing_hermite]
      type(scene_t) :: scene
      type(nts_t) :: nts
      type(condition_t) :: item(1), first(1)
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: k, i, n, kind

      do kind = 1, 2
         call begin(scene, smoothing(kind), 0.0_wp, nts, error)
         if (allocated(error)) return
         allocate(u, du, source=0.0_wp*scene%x)
         do k = 0, 10
            if (k > 0) call shake(u, 0.1_wp)
            if (k > 0) call shake(du, 0.1_wp)
            if (k == 0) du(1, first_upper:) = 0.125_wp
            call nts%begin_step(scene%x, u, du)
            call nts%measure(scene%x, u, du)
            do i = 1, 3
               item(1)%has_friction = .true.
               call nts%evaluate([i], scene%x, u, du, [0.0_wp], item)
               call check_near(error, nts%slip(i, scene%x, u, du), item(1)%slip(:1), 16.0_wp*tol, &
                  1.0_wp, "slip, kind " // to_text(kind))
               first%has_friction = .true.
               first%leaves_second = .true.
               call nts%evaluate([i], scene%x, u, du, [0.0_wp], first)
               n = item(1)%n_node
               call check_near(error, [first(1)%gap1, first(1)%slip(1), first(1)%g(:, :n), &
                  first(1)%t(:, :n, 1), first(1)%t1(:, :n, 1)], [item(1)%gap1, item(1)%slip(1), &
                  item(1)%g(:, :n), item(1)%t(:, :n, 1), item(1)%t1(:, :n, 1)], 0.0_wp, 1.0_wp, &
                  "bits without second derivatives")
               ! The master runs from the right to the left.
               if (k == 0) call check_near(error, abs(item(1)%slip(1)), 0.125_wp, 16.0_wp*tol, &
                  1.0_wp, "way")
            end do
         end do
         deallocate(u, du)
      end do
      nts%edge(1) = 0
      call check_near(error, nts%slip(1, scene%x, scene%u0, scene%x), [0.0_wp], 0.0_wp, 1.0_wp, &
         "nothing near")
   end subroutine test_slip

   !> At either end by less and by more than what counts as over it: where the node stands, or
   !> where its gap closes on the way.
   subroutine test_ends(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: smoothing(2) = [smoothing_none, smoothing_hermite]
      real(wp), parameter :: beyond(4) = [-2.0_wp, 0.5_wp, 2.0_wp, 200.0_wp]*end_tol
      type(scene_t) :: scene
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: place
      integer :: kind, k, side, own, way

      do kind = 1, 2
         call begin(scene, smoothing(kind), 0.0_wp, nts, error)
         if (allocated(error)) return
         allocate(u, du, source=0.0_wp*scene%x)
         do side = -1, 1, 2
            own = 2 + side
            do k = 1, size(beyond)
               place = side*(2.0_wp + beyond(k)) - at(own)
               do way = 0, 5
                  u = 0.0_wp
                  du = 0.0_wp
                  u(1, first_upper:) = place
                  select case (way)
                  case (1)                       ! stays open: where it stands
                     du(:, first_upper:) = spread([-side*0.5_wp, -0.125_wp], 2, 6)
                  case (2, 3)                    ! closes after half of the way, in or out
                     du(:, first_upper:) = spread([(2*way - 5)*0.25_wp, -0.5_wp], 2, 6)
                     u(1, first_upper:) = place - 0.5_wp*du(1, first_upper)
                  case (4)                       ! is closed: where it stands
                     u(2, first_upper:) = -0.3_wp
                     du(:, first_upper:) = spread([-side*0.5_wp, -0.125_wp], 2, 6)
                  case (5)                       ! opens: where it stands
                     u(2, first_upper:) = -0.3_wp
                     du(:, first_upper:) = spread([-side*0.5_wp, 0.125_wp], 2, 6)
                  end select
                  call nts%begin_step(scene%x, u, du)
                  call nts%measure(scene%x, u, du)
                  call check_true(error, &
                     nts%state(own)%is_near .and. (nts%state(own)%is_over .eqv. &
                     k < 3), "kind " // to_text(kind) // ", side " // to_text(side) &
                     // ", place " // to_text(k) // ", way " // to_text(way))
                  if (way == 0 .and. kind == 1) call check_true(error, nts%stands_over(own) &
                     .eqv. k < 3, "stands over it")
               end do
            end do
         end do
         deallocate(u, du)
      end do
   end subroutine test_ends

   !> A wall that leans over the edge beside: close to it, though over the edge beside still, a
   !> curve does not hold any more; nor does it two edges on.
   subroutine test_covers(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: smoothing(2) = [smoothing_none, smoothing_hermite]
      real(wp), parameter :: places(2, 4) = reshape([0.25_wp, 0.5_wp, 0.75_wp, 0.125_wp, 0.7_wp, &
         0.5_wp, 1.5_wp, 0.25_wp], [2, 4])
      logical, parameter :: holds(4) = [.true., .true., .false., .false.]
      type(scene_t) :: scene
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      integer :: k, kind, side, own

      do kind = 1, 2
         do side = -1, 1, 2
            call begin(scene, smoothing(kind), 0.0_wp, nts, error)
            if (allocated(error)) return
            allocate(u, du, source=0.0_wp*scene%x)
            ! At the foot of the wall.
            if (kind == 2) nts%is_corner(merge(2, 3, side == 1)) = .true.
            own = 2 - side
            do k = 1, size(places, 2)
               du(:, 10 + own) = mirrored(places(:, k)) - scene%x(:, 10 + own)
               ! The last node of the surface, or the first two, for the first three.
               u = 0.0_wp
               if (k < 4 .and. side == 1) u(:, 10) = [0.6_wp, 1.0_wp] - scene%x(:, 10)
               if (k < 4 .and. side == -1) u(:, 6:7) = reshape([0.3_wp, 2.0_wp, 0.4_wp, 1.0_wp], &
                  [2, 2]) - scene%x(:, 6:7)
               call nts%begin_step(scene%x, u, du)
               call nts%measure(scene%x, u, du)
               call check_equal(error, nts%edge(own), own + merge(2, -2, side == 1), &
                  "edge at the start")
               call check_true(error, nts%covers(own, scene%x, u, du) .eqv. holds(k), "kind " &
                  // to_text(kind) // ", side " // to_text(side) // ", place " // to_text(k))
            end do
            deallocate(u, du)
         end do
      end do

   contains

      !> As seen from the other end.
      pure function mirrored(place)
         real(wp), intent(in) :: place(2)
         real(wp) :: mirrored(2)

         mirrored = [merge(place(1), 1.0_wp - place(1), side == 1), place(2)]
      end function mirrored

   end subroutine test_covers

   !> In the sector of a convex vertex at the far end of the edge next to the node's: all edges
   !> there are as near, a curve ends there unless a corner comes before. From either side.
   subroutine test_turns(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: smoothing(2) = [smoothing_none, smoothing_hermite]
      real(wp), parameter :: bent(2, 2) = reshape([0.75_wp, -0.5_wp, 1.5_wp, -1.0_wp], [2, 2])
      type(scene_t) :: scene
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), du(:, :)
      real(wp) :: vertex
      integer :: kind, side, own, corner

      do kind = 1, 2
         do corner = 0, 1
            do side = -1, 1, 2
               call begin(scene, smoothing(kind), 0.0_wp, nts, error)
               if (allocated(error)) return
               allocate(u, du, source=0.0_wp*scene%x)
               own = 2 - side
               vertex = merge(1.0_wp, 0.0_wp, side == 1)
               ! Master nodes 6 to 10 from the left, edge 1 from the last one on.
               if (side == 1) u(:, 10) = [vertex + bent(1, 1), bent(2, 1)] - scene%x(:, 10)
               if (side == -1) u(:, 7) = [vertex - bent(1, 1), bent(2, 1)] - scene%x(:, 7)
               if (side == -1) u(:, 6) = [vertex - bent(1, 2), bent(2, 2)] - scene%x(:, 6)
               if (kind == 2) nts%is_corner(2:3) = [side == -1, side == 1] .and. corner == 1
               du(:, nts%node(own)) = [vertex + 0.2_wp*side, 0.5_wp] - scene%x(:, nts%node(own))
               call nts%begin_step(scene%x, u, du)
               call nts%measure(scene%x, u, du)
               call check_true(error, nts%covers(own, scene%x, u, du) .eqv. (kind == 1 .or. &
                  corner == 1), "kind " // to_text(kind) // ", corner " // to_text(corner) // &
                  ", side " // to_text(side))
               deallocate(u, du)
            end do
         end do
      end do
   end subroutine test_turns

   !> A step that reaches farther begins where one that does not began, and once more the first.
   subroutine test_reach(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      integer :: step

      call make_two_blocks(scene, 4.0_wp, lower, upper)
      call nts_init(nts, scene, scene%pair(1), error)
      if (allocated(error)) return
      do step = 1, 3
         nts%reach = 0.0_wp
         call nts%begin_step(scene%x, scene%u0, merge(1.0_wp, 0.0_wp, step == 2) &
            *spread([0.0_wp, 4.0_wp], 2, size(scene%x, 2)))
         call check_equal(error, nts%edge, merge([3, 2, 1], [0, 0, 0], step == 2), "step " &
            // to_text(step))
      end do
   end subroutine test_reach

   !> The corner of a block lies under a flat bottom at a node of that, closed or nearly so: in
   !> statics with both sides held it is the corner's constraint that holds, else the node's.
   subroutine test_leaving(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: edge = 4.0_wp
      real(wp), parameter :: up(3) = [0.0_wp, 0.1_wp, 2.0_wp]*end_tol*edge
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :)
      integer :: own, k, i
      logical :: leaves

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, -edge], [edge, edge], lower)
      call add_block(scene, "CPE4", [2, 1], [0.0_wp, 0.0_wp], [2.0_wp, 1.0_wp]*edge, upper)
      call add_surface(scene, "LOWER", lower, [bottom, right, top, left])
      call add_surface(scene, "UPPER", upper, [bottom])
      allocate(u, source=0.0_wp*scene%x)
      do i = 0, 3
         call nts_init(nts, scene, contact_pair_t(slave=2, master=1, both_sides=btest(i, 0)), error)
         if (allocated(error)) return
         call nts%suit_steps(.true.)
         nts%step%is_static = btest(i, 1)
         own = findloc(nts%node, 6, 1)
         do k = 1, size(up)
            u(1, 5:) = -edge*(1.0_wp + 0.1_wp*end_tol)   ! just past the corner
            u(2, 5:) = up(k)
            call nts%begin_step(scene%x, u, 0.0_wp*u)
            ! What does not move at all leaves nowhere.
            call nts%measure(scene%x, u, epsilon(1.0_wp)*scene%x)
            leaves = i == 3 .and. k < 3
            call check_true(error, (nts%state(own)%is_leaving .eqv. leaves) .and. &
               (nts%state(own)%is_over .neqv. leaves) .and. nts%state(own)%is_near, "case " &
               // to_text(i) // ", gap " // to_text(k))
         end do
      end do
   end subroutine test_leaving

   !> Guards take nothing out of the bodies, watch the mesh, and act from so far inside: ends and
   !> corners from nearly the surface on, unless contact gives way. Friction stays with them.
   subroutine test_guard(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts, plain
      type(contact_pair_t) :: pair
      type(contact_pair_t), allocatable :: guard(:)
      real(wp), parameter :: slack(3) = [corner_slack, guard_slack, corner_slack]
      integer :: k

      call make_two_blocks(scene, 0.25_wp, lower, upper)
      ! Of the slave the edges are half as long.
      scene%x(1, first_upper:) = 0.5_wp*scene%x(1, first_upper:)
      pair = scene%pair(1)
      pair%interaction = interaction_t(friction=0.5_wp, damping=contact_damping_t(1.0_wp, 0.5_wp))
      call nts_init(plain, scene, pair, error)
      if (allocated(error)) return
      pair%formulation = formulation_mortar
      call guards_find([pair], scene%surface, guard)
      call check_equal(error, size(guard), 2, "guards of mortar")
      if (allocated(error)) return
      call nts_init(nts, scene, guard(1), error)
      if (allocated(error)) return
      call check_near(error, [contact_laws_reach(plain%laws), contact_laws_reach(nts%laws)], &
         [0.5_wp, -1.0_wp], 0.0_wp, 1.0_wp, "damping")
      call check_true(error, contact_laws_rub(nts%laws), "friction")
      call nts%configure(scene%x, contact_options_t(smoothing=smoothing_hermite))
      call check_true(error, nts%smoothing == smoothing_none .and. nts%may_sharpen, "the mesh")
      do k = 1, 2
         nts%step%has_compliance = k == 2
         nts%position_memo%is_known = .false.
         call nts%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         call nts%measure(scene%x, scene%u0, 0.0_wp*scene%x)
         call check_near(error, nts%state%closed, -0.5_wp*merge(slack, guard_slack, k == 1), tol, &
            1.0_wp, "closed where")
         call plain%begin_step(scene%x, scene%u0, 0.0_wp*scene%x)
         call plain%measure(scene%x, scene%u0, 0.0_wp*scene%x)
         call check_near(error, plain%state%closed, [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
            "no guard")
      end do
   end subroutine test_guard

   !> A block with edges of 1 on one with edges of 1/2: of the coarse side's area half is left where
   !> nodes stand on nodes; nothing changes for the finer side, beside nodes, or with one side held.
   subroutine test_narrow(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: off(4) = [0.0_wp, 0.45e-3_wp, 0.55e-3_wp, 0.25_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(nts_t) :: nts
      real(wp), allocatable :: u(:, :), area(:), length(:), whole(:)
      integer :: side, k, both, i

      call scene_begin(scene)
      call add_block(scene, "CPE4", [8, 1], [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [2, 1], [-1.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [top])
      call add_surface(scene, "UPPER", upper, [right, bottom, left])
      allocate(u, source=0.0_wp*scene%x)
      do side = 1, 2
         do both = 1, 2
            call nts_init(nts, scene, contact_pair_t(slave=side, master=3 - side, &
               both_sides=both == 2), error)
            if (allocated(error)) return
            allocate(area(nts%n_constraint), length(nts%n_constraint))
            do k = 1, size(off)
               u(1, size(u, 2) - 5:) = off(k)
               call nts%begin_step(scene%x, u, 0.0_wp*u)
               call nts%measure(scene%x, u, 0.0_wp*u)
               call nts%area(scene%x, u, area, length)
               whole = length
               if (side == 2 .and. both == 2) then
                  do i = 1, size(whole)
                     ! At a node is what is nearer than 1/1000 of a master edge.
                     if (scene%x(2, nts%node(i)) > 0.5_wp .or. off(k) > 0.5e-3_wp) cycle
                     whole(i) = 0.5_wp*length(i)
                  end do
               end if
               call check_near(error, area, whole, tol, 1.0_wp, "side " // to_text(side) // &
                  ", both " // to_text(both) // ", off " // to_text(k))
            end do
            deallocate(area, length)
         end do
      end do
   end subroutine test_narrow

end module test_nts_states
