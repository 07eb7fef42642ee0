!> Which free motions of a static problem are named.
module test_rigid_motion
   use check, only : check_equal, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_mechanism_text, only : free_motion_text
   use emcon_scene, only : scene_t
   use emcon_system, only : system_init, system_t
   use emcon_text, only : to_text
   use small_scenes, only : add_block, add_step, block_node, block_t, clamp, make_block, &
      make_two_blocks, prescribe
   implicit none
   private
   public :: collect_rigid_motion

   !> Ranks are found in double, of positions and weights that are rounded to `wp`; what is below
   !> the root of some hundred epsilon, times the distance in sizes of a body, is no motion. That of
   !> one body of n in a row is 1/n^1.5 of what it is of all.
   logical, parameter :: is_fine = epsilon(1.0_wp) < 1.0e-10_wp
   !> Length of short ties beside blocks of size 1: the root of epsilon.
   real(wp), parameter :: short = merge(sqrt(max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))), &
      0.125_wp, is_fine)
   real(wp), parameter :: far = merge(1.0e8_wp, 10.0_wp, is_fine)
   integer, parameter :: n_chain = merge(20, 8, is_fine), n_many = merge(300, 12, is_fine)

contains

   subroutine collect_rigid_motion(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("motions that one body can have left", test_motions), &
         test_case_t("second body of two", test_second), &
         test_case_t("bodies in contact", test_contact), &
         test_case_t("scene far from the origin", test_far), &
         test_case_t("two tied blocks", test_tied), &
         test_case_t("tied blocks far from the origin", test_tied_far), &
         test_case_t("tie much shorter than its blocks", test_short_tie), &
         test_case_t("ties that follow from a short one", test_behind_short_tie), &
         test_case_t("chain of tied blocks", test_chain), &
         test_case_t("closed ring of tied blocks", test_ring), &
         test_case_t("mechanisms", test_mechanism), &
         test_case_t("slanted direction", test_slanted), &
         test_case_t("reference node", test_reference_node), &
         test_case_t("periodic equations", test_periodic), &
         test_case_t("tied to a body in contact", test_tied_contact), &
         test_case_t("units", test_units), &
         test_case_t("many bodies", test_many)]
   end subroutine collect_rigid_motion

   !> The text for the block of 2 x 2 cells (nodes 1 2 3 / 4 5 6 / 7 8 9) with some freedoms held.
   subroutine check_motion(error, node, dof, motion)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: node(:), dof(:)
      character(len=*), intent(in) :: motion     !! empty: none
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      do i = 1, size(node)
         call prescribe(scene%step(1), node(i), dof(i), 0.0_wp)
      end do
      call system_init(system, scene, raised)
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      if (len(motion) == 0) then
         call check_equal(error, text, "", "no motion is left")
      else
         call check_true(error, index(text // ";", "is free to " // motion // ";") > 0, &
            "'" // motion // "' is in '" // text // "'")
         call check_true(error, index(text, "element 1 ") > 0, "the body is named: " // text)
      end if
   end subroutine check_motion

   subroutine test_motions(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: none(0)

      call check_motion(error, none, none, "move in x, move in y, rotate")
      call check_motion(error, [1], [1], "move in y, rotate")
      call check_motion(error, [1, 2], [2, 2], "move in x")
      call check_motion(error, [1, 7], [1, 1], "move in y")
      call check_motion(error, [5, 5], [1, 2], "rotate")
      call check_motion(error, [1, 2, 3, 4], [1, 1, 1, 2], "rotate")   ! all about the origin
      call check_motion(error, [1, 1, 2], [1, 2, 2], "")
      call check_motion(error, [1, 1, 7], [1, 2, 1], "")
      call check_motion(error, [1, 9, 9], [2, 1, 2], "")
   end subroutine test_motions

   subroutine test_second(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_block(scene, "CPE4", [1, 1], block)
      call add_block(scene, "CPE4", [2, 1], [5.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call system_init(system, scene, error)
      if (allocated(error)) return
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      call check_true(error, index(text, "element 2 ") > 0, "element 2 is in '" // text // "'")
      call clamp(scene%step(1), [5, 9])
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      call check_equal(error, text, "", "both held")
   end subroutine test_second

   !> Contact may hold the upper block: it is looked at only on request.
   subroutine test_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call system_init(system, scene, error)
      if (allocated(error)) return
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      call check_equal(error, text, "", "before contact is known")
      call free_motion_text(system, scene, scene%step(1)%prescribed, text, with_contact=.true.)
      call check_true(error, index(text, "element 5 ") > 0, "element 5 is in '" // text // "'")
   end subroutine test_contact

   !> Two neighbours held in a small corner, far away: held is held.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_block(scene, "CPE4", [20, 20], block)
      scene%x = scene%x + far
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1])
      call prescribe(scene%step(1), 2, 2, 0.0_wp)
      call system_init(system, scene, error)
      if (allocated(error)) return
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      call check_equal(error, text, "", "held")
   end subroutine test_far

   !> Append the row: sum of weight times displacement `dof` of `node` = 0.
   subroutine add_row(linear, node, dof, weight)
      type(linear_rows_t), intent(inout) :: linear
      integer, intent(in) :: node(:), dof(:)
      real(wp), intent(in) :: weight(:)

      if (.not. allocated(linear%start)) then
         allocate(linear%start(1), source=0)
         allocate(linear%is_gone(0))
         allocate(linear%dof(0), linear%weight(0))
      end if
      linear%n = linear%n + 1
      linear%is_gone = [linear%is_gone, .false.]
      linear%dof = [linear%dof, 2*(node - 1) + dof]
      linear%weight = [linear%weight, weight]
      linear%start = [linear%start, size(linear%dof)]
   end subroutine add_row

   subroutine drop_rows(linear)
      type(linear_rows_t), intent(out) :: linear

      linear%n = 0
   end subroutine drop_rows

   !> Tie a node in both directions to a place on the edge between two others, a fraction `t` from
   !> the first, and put it there.
   subroutine tie_node(scene, linear, node, edge, t)
      type(scene_t), intent(inout) :: scene
      type(linear_rows_t), intent(inout) :: linear
      integer, intent(in) :: node, edge(2)
      real(wp), intent(in) :: t
      real(wp) :: weight(2)
      integer :: a

      weight = [1.0_wp - t, t]
      scene%x(:, node) = weight(1)*scene%x(:, edge(1)) + weight(2)*scene%x(:, edge(2))
      do a = 1, 2
         call add_row(linear, [node, edge], [a, a, a], [1.0_wp, -weight])
      end do
   end subroutine tie_node

   !> Blocks of alternately 1 x 2 and 1 x 3 cells in a row along x, each 2 by 2 and with its first
   !> element 1, 3, 6, 8, 11 ...; neighbours are tied. One step without conditions.
   subroutine make_chain(scene, system, n, block, error)
      type(scene_t), intent(out) :: scene
      type(system_t), intent(out) :: system
      integer, intent(in) :: n
      type(block_t), intent(out) :: block(:)         !! (n)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      integer :: i, k

      call make_block(scene, "CPE4", [1, 2], block(1))
      scene%x(1, :) = 2.0_wp*scene%x(1, :)
      do i = 2, n
         call add_block(scene, "CPE4", [1, 3 - mod(i, 2)], [2.0_wp*real(i - 1, wp), 0.0_wp], &
            [2.0_wp, 2.0_wp], block(i))
      end do
      do i = 2, n, 2
         do k = i - 1, min(i + 1, n), 2
            call tie_facing(scene, linear, block(i), block(k), k > i)
         end do
      end do
      call add_step(scene, .true., 1.0_wp, 1)
      call system_init(system, scene, error)
      system%space%linear = linear
   end subroutine make_chain

   !> "the bodies of elements 1, 3, 6, 8 and 10 more, held together, are": ten are named.
   subroutine name_chain(n, who)
      integer, intent(in) :: n                       !! blocks
      character(len=:), allocatable, intent(out) :: who
      integer :: i

      who = "the bodies of elements 1"
      do i = 2, min(n, 10)
         who = who // ", " // to_text(1 + 5*((i - 1)/2) + 2*mod(i - 1, 2))
      end do
      if (n > 10) who = who // " and " // to_text(n - 10) // " more"
      who = who // ", held together, are"
   end subroutine name_chain

   !> Tie the left or right side of `slave`, of three cells, to the side of `master`, of two.
   subroutine tie_facing(scene, linear, slave, master, is_right)
      type(scene_t), intent(inout) :: scene
      type(linear_rows_t), intent(inout) :: linear
      type(block_t), intent(in) :: slave, master
      logical, intent(in) :: is_right
      integer :: i, j, column

      column = merge(1, 0, is_right)
      do i = 0, 3
         j = i/2
         call tie_node(scene, linear, block_node(slave, column, i), &
            [block_node(master, 1 - column, j), block_node(master, 1 - column, j + 1)], &
            2.0_wp*real(i, wp)/3.0_wp - real(j, wp))
      end do
   end subroutine tie_facing

   !> The whole text: "WHO free to MOTION".
   subroutine check_text(error, system, scene, who, motion)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: who            !! empty: nothing is free
      character(len=*), intent(in) :: motion
      character(len=:), allocatable :: text

      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      if (len(who) == 0) then
         call check_equal(error, text, "", motion)
      else
         call check_equal(error, text, &
            who // " free to " // motion, motion)
      end if
   end subroutine check_text

   subroutine test_tied(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(2)
      type(system_t) :: system
      character(len=*), parameter :: both = "the bodies of elements 1, 3, held together, are"

      call make_chain(scene, system, 2, block, error)
      if (allocated(error)) return
      call check_text(error, system, scene, both, "move in x, move in y, rotate")
      call prescribe(scene%step(1), block_node(block(2), 1, 0), 2, 0.0_wp)
      call check_text(error, system, scene, both, "move in x, rotate")
      call prescribe(scene%step(1), block_node(block(1), 0, 0), 2, 0.0_wp)
      call check_text(error, system, scene, both, "move in x")
      call prescribe(scene%step(1), block_node(block(1), 1, 2), 1, 0.0_wp)
      call check_text(error, system, scene, "", "held, each block alone is not")
   end subroutine test_tied

   !> Nodes are put on the other side to epsilon of the distance from the origin: a rotation of both
   !> blocks violates the ties by that much.
   subroutine test_tied_far(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(2)
      type(system_t) :: system
      type(linear_rows_t) :: linear

      call make_chain(scene, system, 2, block, error)
      if (allocated(error)) return
      scene%x = scene%x + far
      call tie_facing(scene, linear, block(2), block(1), .false.)
      call check_text(error, system, scene, &
         "the bodies of elements 1, 3, held together, are", "move in x, move in y, rotate")
      call clamp(scene%step(1), [block_node(block(2), 1, 0)])
      call check_text(error, system, scene, &
         "the bodies of elements 1, 3, held together, are", "rotate")
      call clamp(scene%step(1), [block_node(block(2), 1, 1)])
      call check_text(error, system, scene, "", "held")
   end subroutine test_tied_far

   !> Two nodes at a distance whose square would be lost in round-off.
   subroutine test_short_tie(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(2)
      type(system_t) :: system

      call make_chain(scene, system, 2, block, error)
      if (allocated(error)) return
      scene%x(2, block_node(block(1), 1, 1)) = short
      call drop_rows(system%space%linear)
      call tie_node(scene, system%space%linear, block_node(block(2), 0, 0), &
         [block_node(block(1), 1, 0), block_node(block(1), 1, 1)], 0.0_wp)
      call tie_node(scene, system%space%linear, block_node(block(2), 0, 1), &
         [block_node(block(1), 1, 0), block_node(block(1), 1, 1)], 1.0_wp)
      call clamp(scene%step(1), [1, 2])
      call check_text(error, system, scene, "", "held")
      scene%x(2, [block_node(block(1), 1, 1), block_node(block(2), 0, 1)]) = 0.0_wp
      call check_text(error, system, scene, "the body of element 3 is", "rotate")
   end subroutine test_short_tie

   !> Two blocks tied over the short length stand askew by round-off over it; a third one is tied to
   !> both.
   subroutine test_behind_short_tie(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(3)
      type(system_t) :: system
      integer :: side(2), k

      call make_chain(scene, system, 3, block, error)
      if (allocated(error)) return
      call drop_rows(system%space%linear)
      side = [block_node(block(1), 1, 0), block_node(block(1), 1, 1)]
      scene%x(2, side) = 0.7_wp + [0.0_wp, short]
      call tie_node(scene, system%space%linear, block_node(block(2), 0, 0), side, 0.3_wp)
      call tie_node(scene, system%space%linear, block_node(block(2), 0, 1), side, 0.9_wp)
      do k = 1, 2
         side = [block_node(block(k), 0, 2), block_node(block(k), 1, 2)]
         call tie_node(scene, system%space%linear, block_node(block(3), k - 1, 0), side, 0.3_wp)
         call tie_node(scene, system%space%linear, block_node(block(3), k - 1, 1), side, 0.9_wp)
      end do
      call check_text(error, system, scene, &
         "the bodies of elements 1, 3, 6, held together, are", "move in x, move in y, rotate")
      call clamp(scene%step(1), [block_node(block(2), 1, 0), block_node(block(2), 1, 1)])
      call check_text(error, system, scene, "", "held")
   end subroutine test_behind_short_tie

   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(n_chain)
      type(system_t) :: system
      character(len=:), allocatable :: who

      call name_chain(n_chain, who)
      call make_chain(scene, system, n_chain, block, error)
      if (allocated(error)) return
      call check_text(error, system, scene, who, "move in x, move in y, rotate")
      call prescribe(scene%step(1), block_node(block(7), 0, 0), 2, 0.0_wp)
      call check_text(error, system, scene, who, "move in x, rotate")
      call prescribe(scene%step(1), block_node(block(n_chain), 1, 0), 1, 0.0_wp)
      call check_text(error, system, scene, who, "rotate")
      call prescribe(scene%step(1), block_node(block(1), 0, 0), 2, 0.0_wp)
      call check_text(error, system, scene, "", "held at three blocks")
   end subroutine test_chain

   !> The last tie of a ring follows from the others up to round-off.
   subroutine test_ring(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 24
      real(wp), parameter :: angle = 2.0_wp*acos(-1.0_wp)/n
      type(scene_t) :: scene
      type(block_t) :: block(n)
      type(system_t) :: system
      integer :: i
      character(len=:), allocatable :: text

      call make_chain(scene, system, n, block, error)
      if (allocated(error)) return
      do i = 1, size(scene%x, 2)
         associate (r => 10.0_wp + scene%x(2, i), phi => 0.5_wp*angle*scene%x(1, i))
            scene%x(:, i) = r*[cos(phi), sin(phi)]
         end associate
      end do
      call drop_rows(system%space%linear)
      do i = 2, n, 2
         call tie_facing(scene, system%space%linear, block(i), block(i - 1), .false.)
         call tie_facing(scene, system%space%linear, block(i), block(1 + mod(i, n)), .true.)
      end do
      call free_motion_text(system, scene, scene%step(1)%prescribed, text)
      call check_true(error, index(text // ";", "free to move in x, move in y, rotate;") > 0, text)
      call clamp(scene%step(1), [1, 2])
      call check_text(error, system, scene, "", "held")
   end subroutine test_ring

   !> Two blocks that one row, or both of one node, join.
   subroutine test_mechanism(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block, other
      type(system_t) :: system
      integer :: hinge(2)
      character(len=*), parameter :: both = "the bodies of elements 1, 5, held together, are"

      call make_block(scene, "CPE4", [2, 2], block)
      call add_block(scene, "CPE4", [2, 2], [2.0_wp, 0.0_wp], [2.0_wp, 2.0_wp], other)
      call add_step(scene, .true., 1.0_wp, 1)
      call system_init(system, scene, error)
      if (allocated(error)) return
      hinge = [block_node(block, 2, 0), block_node(other, 0, 0)]
      call add_row(system%space%linear, hinge, [1, 1], [1.0_wp, -1.0_wp])
      call check_text(error, system, scene, both, &
         "move in x, move in y, rotate, move against each other")
      call clamp(scene%step(1), [1, 2])
      call check_text(error, system, scene, "the body of element 5 is", "move in y, rotate")
      call add_row(system%space%linear, hinge, [2, 2], [1.0_wp, -1.0_wp])
      call check_text(error, system, scene, "the body of element 5 is", "rotate")
      call prescribe(scene%step(1), block_node(other, 2, 1), 2, 0.0_wp)
      call check_text(error, system, scene, "", "held")
      ! Both supported where the hinge is halfway between: it can buckle.
      deallocate(scene%step(1)%prescribed)
      allocate(scene%step(1)%prescribed(0))
      call clamp(scene%step(1), [block_node(block, 0, 0), block_node(other, 2, 0)])
      call check_text(error, system, scene, both, &
         "move against each other")
   end subroutine test_mechanism

   subroutine test_slanted(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call system_init(system, scene, error)
      if (allocated(error)) return
      call add_row(system%space%linear, [1, 1], [1, 2], [1.0_wp, 2.0_wp])
      call add_row(system%space%linear, [3, 3], [1, 2], [-1.0_wp, -2.0_wp])
      call check_text(error, system, scene, "the body of element 1 is", "move along (1, -0.5)")
      call prescribe(scene%step(1), 5, 1, 0.0_wp)
      call check_text(error, system, scene, "", "held")
   end subroutine test_slanted

   !> The nodes of one side follow a node without element along x.
   subroutine test_reference_node(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call add_loose_nodes(scene, 2)
      call system_init(system, scene, error)
      if (allocated(error)) return
      do i = 1, 3
         call add_row(system%space%linear, [3*i, 11], [1, 1], [1.0_wp, -1.0_wp])
      end do
      call check_text(error, system, scene, &
         "the body of element 1 and node 11, held together, are", "move in x, move in y")
      call prescribe(scene%step(1), 1, 2, 0.0_wp)
      call check_text(error, system, scene, &
         "the body of element 1 and node 11, held together, are", "move in x")
      call prescribe(scene%step(1), 11, 1, 0.5_wp)
      call check_text(error, system, scene, "", "held by the node")
      call add_row(system%space%linear, [10, 11, 10], [1, 1, 2], [1.0_wp, -1.0_wp, 1.0_wp])
      call check_text(error, system, scene, "node 10 is", "move along (1, -1)")
   end subroutine test_reference_node

   subroutine add_loose_nodes(scene, n)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: n
      real(wp), allocatable :: x(:, :)
      integer :: i, m

      m = size(scene%x, 2)
      allocate(x(2, m + n), source=7.0_wp)
      x(:, :m) = scene%x
      call move_alloc(x, scene%x)
      allocate(x(2, m + n), source=0.0_wp)
      scene%u0 = x
      scene%v0 = x
      scene%node%label = [(i, i = 1, m + n)]
      deallocate(scene%node%origin)
      allocate(scene%node%origin(m + n))
   end subroutine add_loose_nodes

   !> The right side moves as the left one does, or as much more as a node without element.
   subroutine test_periodic(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      integer :: i, a

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call add_loose_nodes(scene, 1)
      call system_init(system, scene, error)
      if (allocated(error)) return
      do i = 1, 3
         do a = 1, 2
            call add_row(system%space%linear, [3*i, 3*i - 2], [a, a], [1.0_wp, -1.0_wp])
         end do
      end do
      call check_text(error, system, scene, "the body of element 1 is", "move in x, move in y")
      call clamp(scene%step(1), [5])
      call check_text(error, system, scene, "", "rotation is not periodic")
      call drop_rows(system%space%linear)
      do i = 1, 3
         do a = 1, 2
            call add_row(system%space%linear, [3*i, 3*i - 2, 10], [a, a, a], &
               [1.0_wp, -1.0_wp, -1.0_wp])
         end do
      end do
      call check_text(error, system, scene, &
         "the body of element 1 and node 10, held together, are", "rotate")
      call prescribe(scene%step(1), 10, 2, 0.0_wp)
      call check_text(error, system, scene, "", "no shear")
   end subroutine test_periodic

   !> The lower of two blocks in contact carries a third one.
   subroutine test_tied_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper, third
      type(system_t) :: system
      character(len=:), allocatable :: text

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      call add_block(scene, "CPE4", [1, 1], [2.0_wp, -1.0_wp], [1.0_wp, 1.0_wp], third)
      call add_step(scene, .true., 1.0_wp, 1)
      call system_init(system, scene, error)
      if (allocated(error)) return
      call tie_node(scene, system%space%linear, block_node(third, 0, 0), [5, 10], 0.0_wp)
      call check_text(error, system, scene, "the body of element 7 is", "rotate")
      call tie_node(scene, system%space%linear, block_node(third, 0, 1), [5, 10], 1.0_wp)
      call check_text(error, system, scene, "", "before contact is known")
      call free_motion_text(system, scene, scene%step(1)%prescribed, text, with_contact=.true.)
      call check_equal(error, text, "the bodies of elements 1, 7, held together, are free " &
         // "to move in x, move in y, rotate", "without contact")
   end subroutine test_tied_contact

   !> Other units of length and rows times powers of two change nothing.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(4)
      type(system_t) :: system
      character(len=*), parameter :: who = "the bodies of elements 1, 3, 6, 8, held together, " &
         // "are"
      integer :: power

      do power = -80, 80, 40
         call make_chain(scene, system, 4, block, error)
         if (allocated(error)) return
         scene%x = scale(scene%x, power)
         system%space%linear%weight = scale(system%space%linear%weight, power/2)
         call check_text(error, system, scene, who, "move in x, move in y, rotate")
         call clamp(scene%step(1), [block_node(block(4), 1, 1)])
         call check_text(error, system, scene, who, "rotate")
         call prescribe(scene%step(1), 1, 2, 0.0_wp)
         call check_text(error, system, scene, "", "held")
         if (allocated(error)) return
      end do
   end subroutine test_units

   !> What the last of 300 blocks in a row does depends on all ties before it.
   subroutine test_many(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = n_many
      type(scene_t) :: scene
      type(block_t) :: block(n)
      type(system_t) :: system
      character(len=:), allocatable :: who

      call name_chain(n, who)
      call make_chain(scene, system, n, block, error)
      if (allocated(error)) return
      call check_text(error, system, scene, who, "move in x, move in y, rotate")
      call clamp(scene%step(1), [block_node(block(n), 1, 0)])
      call check_text(error, system, scene, who, "rotate")
      call clamp(scene%step(1), [block_node(block(n), 1, 1)])
      call check_text(error, system, scene, "", "held at the end")
   end subroutine test_many

end module test_rigid_motion
