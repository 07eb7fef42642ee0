!> Round tops of corners that face a corner, by how much their fans of normals have in common.
module test_corner_tops
   use check, only : check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_t
   use emcon_corner_tops_plane, only : top_width
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: collect_corner_tops

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp), widest = 0.25_wp

contains

   subroutine collect_corner_tops(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("vertices that face each other", test_facing), &
         test_case_t("what is no vertex of a curve", test_no_vertex), &
         test_case_t("the bent and turned shape counts", test_moved)]
   end subroutine collect_corner_tops

   !> Nodes 1 to 3: a master that turns by `a` at node 2; 4 to 6: a slave that turns by `b` at node
   !> 5 and faces it, turned by `phi`. Edges have lengths of their own.
   pure subroutine place(a, b, phi, x, chain)
      real(wp), intent(in) :: a, b, phi
      real(wp), intent(out) :: x(2, 6)
      type(chain_t), intent(out) :: chain

      x(:, 2) = 0.0_wp
      x(:, 1) = x(:, 2) - 0.7_wp*way(-0.5_wp*a)
      x(:, 3) = x(:, 2) + 1.3_wp*way(0.5_wp*a)
      x(:, 5) = [0.1_wp, -0.2_wp]
      x(:, 4) = x(:, 5) + 0.9_wp*way(phi - 0.5_wp*b)
      x(:, 6) = x(:, 5) - 1.1_wp*way(phi + 0.5_wp*b)
      chain%facet = reshape([4, 5, 5, 6], [2, 2])
      chain%node = [4, 5, 6]
      chain%node_edge = reshape([0, 1, 1, 2, 2, 0], [2, 3])
   end subroutine place

   pure function way(angle)
      real(wp), intent(in) :: angle
      real(wp) :: way(2)

      way = [cos(angle), sin(angle)]
   end function way

   !> The part of the master's fan (-a/2, a/2) that lies in the slave's (phi - b/2, phi + b/2).
   subroutine test_facing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: turn(3) = [0.05_wp, 0.3_wp, 0.9_wp]
      real(wp) :: x(2, 6), phi, common
      type(chain_t) :: chain
      integer :: i, j, k

      do i = 1, 3
         do j = 1, 3
            do k = -6, 6
               phi = 0.11_wp*real(k, wp)
               call place(turn(i), turn(j), phi, x, chain)
               common = max(0.0_wp, min(0.5_wp*turn(i), phi + 0.5_wp*turn(j)) &
                  - max(-0.5_wp*turn(i), phi - 0.5_wp*turn(j)))
               call check_near(error, top_width(chain, 2, [1, 2, 3], x, 0.0_wp*x), &
                  widest*common/turn(i), tol/turn(i), 1.0_wp, "width")
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_facing

   !> An end, a flat side, a dent and a corner have no top, on either side.
   subroutine test_no_vertex(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: other(3) = [0.9e-5_wp, -0.3_wp, 1.06_wp]
      real(wp) :: x(2, 6)
      type(chain_t) :: chain
      integer :: k

      do k = 1, 3
         call place(other(k), 0.3_wp, 0.0_wp, x, chain)
         call check_near(error, top_width(chain, 2, [1, 2, 3], x, 0.0_wp*x), 0.0_wp, 0.0_wp, &
            1.0_wp, "master")
         call place(0.3_wp, other(k), 0.0_wp, x, chain)
         call check_near(error, top_width(chain, 2, [1, 2, 3], x, 0.0_wp*x), 0.0_wp, 0.0_wp, &
            1.0_wp, "slave")
      end do
      call place(1.04_wp, 0.3_wp, 0.0_wp, x, chain)
      call check_true(error, top_width(chain, 2, [1, 2, 3], x, 0.0_wp*x) > 0.0_wp, &
         "just below 60 degrees")
      call check_near(error, [top_width(chain, 1, [1, 2, 3], x, 0.0_wp*x), &
         top_width(chain, 3, [1, 2, 3], x, 0.0_wp*x)], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "ends")
   end subroutine test_no_vertex

   !> By displacements from one to the other shape, unless it is no vertex at first or goes flat.
   subroutine test_moved(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(2, 6) :: x, moved
      type(chain_t) :: chain

      call place(0.3_wp, 0.2_wp, 0.0_wp, x, chain)
      call place(0.5_wp, 0.4_wp, 0.2_wp, moved, chain)
      call check_near(error, top_width(chain, 2, [1, 2, 3], x, moved - x), &
         widest*(0.25_wp - 0.0_wp)/0.5_wp, tol, 1.0_wp, "by the present shape")
      call place(0.3_wp, -0.1_wp, 0.0_wp, moved, chain)
      call check_near(error, top_width(chain, 2, [1, 2, 3], x, moved - x), 0.0_wp, 0.0_wp, 1.0_wp, &
         "bent the other way")
      call check_near(error, top_width(chain, 2, [1, 2, 3], moved, x - moved), 0.0_wp, 0.0_wp, &
         1.0_wp, "bent from the other way")
   end subroutine test_moved

end module test_corner_tops
