!> Contact surfaces as chains of edges.
module test_chain
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_chain, only : chain_init, chain_t, chain_tributary
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t, surface_t
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, make_block, right, &
      scene_begin, top
   implicit none
   private
   public :: collect_chain

   real(wp), parameter :: tol = 8.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_chain(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("top of a block", test_open), &
         test_case_t("faces in any order", test_order), &
         test_case_t("closed chain", test_closed), &
         test_case_t("two bodies in one surface", test_two_bodies), &
         test_case_t("surface of nodes", test_nodal), &
         test_case_t("branching surface", test_branch), &
         test_case_t("tributary lengths", test_tributary)]
   end subroutine collect_chain

   !> Edges run with the body to the left: from right to left on top, triangles as quadrilaterals.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      character(len=4), parameter :: name(2) = ["CPE3", "CPE4"]
      integer :: k

      do k = 1, 2
         call make_block(scene, name(k), [3, 1], block)
         call add_surface(scene, "TOP", block, [top])
         call chain_init(chain, scene, scene%surface(1), error)
         if (allocated(error)) return
         call check_equal(error, reshape(chain%edge, [6]), [8, 7, 7, 6, 6, 5], name(k) // " edges")
         call check_equal(error, chain%previous, [0, 1, 2], "previous")
         call check_equal(error, chain%next, [2, 3, 0], "next")
         call check_equal(error, chain%node, [5, 6, 7, 8], "nodes")
         if (allocated(error)) return
      end do
   end subroutine test_open

   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain

      call make_block(scene, "CPE4", [3, 1], block)
      call add_surface(scene, "TOP", block, [top])
      scene%surface(1)%element = scene%surface(1)%element([2, 1, 3])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%previous, [2, 0, 1], "previous")
      call check_equal(error, chain%next, [3, 1, 0], "next")
   end subroutine test_order

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: area
      integer :: i

      call make_block(scene, "CPE3", [3, 2], block)
      call add_surface(scene, "ALL", block, [left, top, bottom, right])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%n_edge, 10, "edges")
      call check_equal(error, chain%next(chain%previous), [(i, i = 1, 10)], "next of the previous")
      area = 0.0_wp
      do i = 1, 10
         area = area + 0.5_wp*(scene%x(1, chain%edge(1, i))*scene%x(2, chain%edge(2, i)) &
            - scene%x(2, chain%edge(1, i))*scene%x(1, chain%edge(2, i)))
      end do
      call check_near(error, area, 6.0_wp, tol, 6.0_wp, "enclosed area, counter-clockwise")
   end subroutine test_closed

   subroutine test_two_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: one, other
      type(chain_t) :: chain

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], one)
      call add_block(scene, "CPE4", [1, 1], [1.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], other)
      call add_surface(scene, "ONE", one, [top])
      call add_surface(scene, "OTHER", other, [top])
      scene%surface(1)%element = [scene%surface(1)%element, scene%surface(2)%element]
      scene%surface(1)%face = [scene%surface(1)%face, scene%surface(2)%face]
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      call check_equal(error, chain%previous, [0, 0], "edges at the same place, other nodes")
      call check_equal(error, chain%node, [3, 4, 7, 8], "nodes")
   end subroutine test_two_bodies

   subroutine test_nodal(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(surface_t) :: surface
      type(chain_t) :: chain
      real(wp) :: length(3)

      call make_block(scene, "CPE4", [3, 1], block)
      surface%name = "NODES"
      surface%is_nodal = .true.
      surface%node = [4, 2, 4, 1]
      call chain_init(chain, scene, surface, error)
      if (allocated(error)) return
      call check_equal(error, chain%node, [1, 2, 4], "nodes")
      call check_equal(error, chain%n_edge, 0, "edges")
      call chain_tributary(chain, scene%x, scene%u0, length)
      call check_near(error, length, [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "lengths")
   end subroutine test_nodal

   !> Two cells one above the other with all their sides: two edges begin at the shared corners.
   subroutine test_branch(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain

      call make_block(scene, "CPE4", [2, 1], block)
      call add_surface(scene, "FORK", block, [bottom])
      scene%surface(1)%element = [1, 1, 2]
      scene%surface(1)%face = [1, 2, 1]          ! bottom and right side of 1, bottom of 2
      call chain_init(chain, scene, scene%surface(1), raised)
      call check_error(error, raised, err_input, "FORK", "branching surface")
      call check_true(error, index(raised%message, "node 2") > 0, "the node is named")
   end subroutine test_branch

   !> Half of the edges beside a node, deformed.
   subroutine test_tributary(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(chain_t) :: chain
      real(wp) :: length(4), u(2, 8)

      call make_block(scene, "CPE4", [3, 1], block)
      call add_surface(scene, "TOP", block, [top])
      call chain_init(chain, scene, scene%surface(1), error)
      if (allocated(error)) return
      u = 1.0e3_wp
      u(2, 8) = u(2, 8) + 0.75_wp                ! the last edge has the length 1.25
      call chain_tributary(chain, scene%x, u, length)
      call check_near(error, length, [0.5_wp, 1.0_wp, 1.125_wp, 0.625_wp], tol, 1.0_wp, "lengths")
   end subroutine test_tributary

end module test_chain
