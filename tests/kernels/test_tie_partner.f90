!> Which points are tied: joints, layers, ends, tolerances, and what is refused.
module test_tie_partner
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : err_input, error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use small_scenes, only : scene_begin
   use tie_scenes, only : add_line, along_x, check_positions, check_rows, entry, even, make_disc, &
      make_straight, measure, multipliers, rotate, row_sum, tol
   implicit none
   private
   public :: collect_tie_partner

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_tie_partner(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("joint under an edge", test_joint), &
         test_case_t("the nearer of two layers", test_layers), &
         test_case_t("steep face beside the end", test_steep), &
         test_case_t("end past the master", test_overhang), &
         test_case_t("master larger", test_larger), &
         test_case_t("what is free of a larger master", test_free), &
         test_case_t("given tolerance", test_tolerance), &
         test_case_t("tolerance at nodes only", test_coarse), &
         test_case_t("error: no faces", test_no_faces), &
         test_case_t("error: common nodes", test_common_nodes), &
         test_case_t("error: apart", test_apart), &
         test_case_t("error: nodes without partner", test_lonely), &
         test_case_t("error: hole", test_hole), &
         test_case_t("error: faces look the same way", test_wrong_side)]
   end subroutine collect_tie_partner

   ! ---- parts and ends -------------------------------------------------------------------------

   !> Two masters end under one slave edge: at one place, overlapping, or apart by less than the
   !> tolerance. Points in the gap belong to the end that is nearer, so the positions are off by
   !> less than the gap there, within int |psi| <= 2 times the gap.
   subroutine test_joint(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp), parameter :: gap(3) = [0.0_wp, -0.3_wp, 0.0625_wp]
      integer :: i, j, k

      do i = 1, 3
         call scene_begin(scene)
         call add_line(scene, "UPPER", along_x(even(4, 0.0_wp, 4.0_wp)))
         call add_line(scene, "RIGHT", along_x(even(3, 4.0_wp, 2.375_wp + 0.5_wp*gap(i))))
         call add_line(scene, "LEFT", along_x(even(5, 2.375_wp - 0.5_wp*gap(i), 0.0_wp)))
         scene%surface(2)%element = [scene%surface(2)%element, scene%surface(3)%element]
         scene%surface(2)%face = [scene%surface(2)%face, scene%surface(3)%face]
         do j = 1, 2
            call measure(scene, multipliers(j), rows, error)
            if (allocated(error)) return
            call check_rows(scene, rows, 4.0_wp, error)
            if (i < 3) call check_positions(scene, rows, 4.0_wp, error)
            do k = 1, 5
               call check_near(error, row_sum(rows, k, scene%x(1, :)), 0.0_wp, 2.0_wp*gap(3)**2, &
                  1.0_wp, "positions over a small hole")
            end do
            ! Node 3 of the slave stands at 2: it sees both bodies.
            call check_true(error, abs(entry(rows, 3, 13)) > 0.0_wp &
               .and. abs(entry(rows, 3, 17)) > 0.0_wp, "both sides of the joint are tied")
            if (allocated(error)) return
         end do
      end do
   end subroutine test_joint

   !> A second master surface further behind does not count, whichever of the two begins first.
   subroutine test_layers(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n_far(2) = [3, 24]
      integer :: first_far, i

      do i = 1, 2
         call scene_begin(scene)
         call add_line(scene, "UPPER", along_x(even(4, 0.0_wp, 4.0_wp)))
         call add_line(scene, "LOWER", along_x(even(5, 4.0_wp, 0.0_wp)))
         first_far = size(scene%x, 2) + 1
         call add_line(scene, "FAR", along_x(even(n_far(i), 5.0_wp, -1.0_wp)))
         scene%x(2, first_far:) = scene%x(2, first_far:) - 0.125_wp
         scene%surface(2)%element = [scene%surface(3)%element, scene%surface(2)%element]
         scene%surface(2)%face = [scene%surface(3)%face, scene%surface(2)%face]
         call measure(scene, multiplier_dual, rows, error)
         if (allocated(error)) return
         call check_rows(scene, rows, 4.0_wp, error)
         call check_positions(scene, rows, 4.0_wp, error)
         call check_true(error, all(rows%node < first_far), "only the nearer layer is tied")
         if (allocated(error)) return
      end do
   end subroutine test_layers

   !> A steep face beside the end of the master does not face the slave, however near.
   subroutine test_steep(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), [3.96875_wp, 3.9375_wp, 2.0_wp, 0.0_wp])
      ! The master nodes are 10 to 13; the face from 10 to 11 falls by six times its width.
      scene%x(2, 10) = -0.1875_wp
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_rows(scene, rows, 4.0_wp, error)
      call check_true(error, all(rows%node /= 10), "the steep face is not tied")
      call check_true(error, any(rows%node == 11), "the end of the master is")
   end subroutine test_steep

   !> A slave edge over 0..1 and a master edge over 0..c: what sticks out belongs to the end of the
   !> master, int xi xi/c over 0..c plus int xi over c..1 with psi = xi.
   subroutine test_overhang(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp), parameter :: c = 0.95_wp
      integer :: side

      do side = 1, 2
         call make_straight(scene, [0.0_wp, 1.0_wp], [c, 0.0_wp])
         if (side == 2) scene%x(1, [4, 5]) = [1.0_wp, 1.0_wp - c]
         call measure(scene, multiplier_standard, rows, error)
         if (allocated(error)) return
         call check_rows(scene, rows, 1.0_wp, error)
         call check_near(error, entry(rows, 3 - side, 3 + side), &
            -(c**2/3.0_wp + (1.0_wp - c**2)/2.0_wp), tol, 1.0_wp, "entry of the master's end")
         if (allocated(error)) return
      end do
      scene%x(1, [4, 5]) = [0.85_wp, 0.0_wp]
      call measure(scene, multiplier_standard, rows, error)
      call expect(error, [character(len=80) :: "1 of 2 nodes", "2 (0.15)"])
   end subroutine test_overhang

   !> What of the master lies beside the slave has no part in the tie.
   subroutine test_larger(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: j

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(20, 10.0_wp, -10.0_wp))
      do j = 1, 2
         call measure(scene, multipliers(j), rows, error)
         if (allocated(error)) return
         call check_rows(scene, rows, 4.0_wp, error)
         call check_positions(scene, rows, 4.0_wp, error)
         ! Master nodes 10 to 30 stand at 10 to -10.
         call check_true(error, all(rows%node <= 5 .or. (rows%node >= 16 .and. rows%node <= 20)), &
            "only nodes within the slave are tied")
         if (allocated(error)) return
      end do
   end subroutine test_larger

   !> The master runs from 6 to 0 in edges of 1, nodes 9 to 15; the slave is in two parts, from 0.5
   !> to 3, past that or short of it, and, on one edge, from 4.25 to 4.75.
   subroutine test_free(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp), parameter :: past(3) = [0.0_wp, 0.05_wp, -0.05_wp]
      integer :: k

      do k = 1, 3
         call scene_begin(scene)
         call add_line(scene, "LONG", along_x(even(2, 0.5_wp, 3.0_wp + past(k))))
         call add_line(scene, "SHORT", along_x(even(1, 4.25_wp, 4.75_wp)))
         scene%surface(1)%element = [scene%surface(1)%element, scene%surface(2)%element]
         scene%surface(1)%face = [scene%surface(1)%face, scene%surface(2)%face]
         call add_line(scene, "LOWER", along_x(even(6, 6.0_wp, 0.0_wp)))
         scene%surface(2) = scene%surface(3)
         call measure(scene, multiplier_dual, rows, error)
         if (allocated(error)) return
         call check_equal(error, reshape(rows%covered, [size(rows%covered)]), [12, 13, 13, 14], &
            "covered")
         call check_equal(error, rows%buried, [13, 14], "buried")
         call check_equal(error, reshape(rows%ending, [size(rows%ending)]), [1, 14, 15, &
            3, merge(11, 12, k == 2), merge(12, 13, k == 2), 6, 10, 11, 7, 10, 11], "ends")
      end do
      ! With a tolerance no joint bridges more than that.
      call measure(scene, multiplier_dual, rows, error, tolerance=0.01_wp)
      if (allocated(error)) return
      call check_equal(error, reshape(rows%covered, [size(rows%covered)]), [13, 14], "not bridged")
   end subroutine test_free

   !> A gap above the default tolerance is tied when the deck says so; with none, what touches is.
   subroutine test_tolerance(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(5, 4.0_wp, 0.0_wp))
      call rotate(scene, 0.3_wp)
      call measure(scene, multiplier_dual, rows, error, tolerance=0.0_wp)
      if (allocated(error)) return
      call check_positions(scene, rows, 4.0_wp, error)
      if (allocated(error)) return
      call rotate(scene, -0.3_wp)
      scene%x(2, 10:) = scene%x(2, 10:) - 0.5_wp
      call measure(scene, multiplier_dual, rows, error, tolerance=0.55_wp)
      if (allocated(error)) return
      call check_rows(scene, rows, 4.0_wp, error)
      if (allocated(error)) return
      call measure(scene, multiplier_dual, rows, error, tolerance=0.45_wp)
      call expect(error, [character(len=80) :: "tie SEAM", "UPPER", "LOWER", &
         "nearest points are 0.5 apart (n", "tolerance is 0.45;"])
   end subroutine test_tolerance

   !> The nodes of an octagon stand on the master, its edges bridge arcs: a small tolerance will do.
   !> The other way round most nodes of the slave are off.
   subroutine test_coarse(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_disc(scene, 8, 80, 0.0_wp, .true.)
      call measure(scene, multiplier_dual, rows, error, tolerance=0.001_wp)
      if (allocated(error)) return
      call check_rows(scene, rows, 16.0_wp*sin(pi/8.0_wp), error)
      if (allocated(error)) return
      call make_disc(scene, 8, 80, 0.0_wp, .false.)
      call measure(scene, multiplier_dual, rows, error, tolerance=0.001_wp)
      call expect(error, ["72 of 80 nodes of slave surface HOLE"])
   end subroutine test_coarse

   ! ---- errors ---------------------------------------------------------------------------------

   !> Turn an expected error of the library into success.
   subroutine expect(error, words)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: words(:)   !! trailing blanks do not count
      type(error_t), allocatable :: raised
      integer :: i

      call move_alloc(error, raised)
      do i = 1, size(words)
         call check_error(error, raised, err_input, trim(words(i)), "tie")
      end do
   end subroutine expect

   subroutine test_no_faces(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(5, 4.0_wp, 0.0_wp))
      deallocate(scene%surface(2)%element, scene%surface(2)%face)
      scene%surface(2)%is_nodal = .true.
      allocate(scene%surface(2)%node, source=[10, 11, 12])
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, ["surface LOWER has no element faces"])
   end subroutine test_no_faces

   subroutine test_common_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(5, 4.0_wp, 0.0_wp))
      ! The last node of the master, 15, becomes the first of the slave.
      where (scene%element%node == 15) scene%element%node = 1
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, ["share nodes (1)"])
   end subroutine test_common_nodes

   !> The nearest points are a master node and the inside of a slave edge.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, [0.0_wp, 4.0_wp], [5.0_wp, 2.0_wp, -1.0_wp])
      scene%x(2, 4) = -8.0_wp
      scene%x(2, 5) = -3.0_wp
      scene%x(2, 6) = -8.0_wp
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, [ &
         "the surfaces do not meet: the nearest points are 3 apart (node 5)"])
   end subroutine test_apart

   !> The slave reaches past the master: nodes 4 to 20 stand 1 to 17 from its end.
   subroutine test_lonely(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_straight(scene, even(19, 0.0_wp, 19.0_wp), even(2, 2.0_wp, 0.0_wp))
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, [character(len=80) :: &
         "17 of 20 nodes of slave surface UPPER have no partner on master surface LOWER", &
         "from 1 to 17 off; node (distance): 4 (1), 5 (2), 6 (3), 7 (4),", &
         "13 (10) and 7 more; swap slave and master"])
   end subroutine test_lonely

   !> The master has a hole of 0.25 between slave nodes that both stand over it.
   subroutine test_hole(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call scene_begin(scene)
      call add_line(scene, "UPPER", along_x(even(4, 0.0_wp, 4.0_wp)))
      call add_line(scene, "LOWER", along_x(even(3, 4.0_wp, 2.5_wp)))
      call add_line(scene, "LEFT", along_x(even(5, 2.25_wp, 0.0_wp)))
      scene%surface(2)%element = [scene%surface(2)%element, scene%surface(3)%element]
      scene%surface(2)%face = [scene%surface(2)%face, scene%surface(3)%face]
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, [character(len=80) :: &
         "1 of 4 faces of slave surface UPPER lie over a hole in master surface LOWER", &
         "nodes of the face (length): 3-4 (0.25);"])
      if (allocated(error)) return
      call measure(scene, multiplier_dual, rows, error, tolerance=0.25_wp)
   end subroutine test_hole

   !> The far side of a strip as thin as the tolerance is no partner, nor is its near side taken
   !> from inside.
   subroutine test_wrong_side(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call scene_begin(scene)
      call add_line(scene, "UPPER", along_x(even(4, 0.0_wp, 4.0_wp)))
      call add_line(scene, "LOWER", along_x(even(5, 0.0_wp, 4.0_wp)))
      scene%x(2, 10:) = scene%x(2, 10:) - 0.0625_wp
      call measure(scene, multiplier_dual, rows, error)
      call expect(error, [character(len=80) :: "5 of 5 nodes", &
         "faces do not face each other: check the face labels"])
   end subroutine test_wrong_side

end module test_tie_partner
