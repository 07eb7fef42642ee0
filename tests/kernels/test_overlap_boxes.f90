!> Where pieces are in a step: boxes, motions and distances beside those of all nodes, what is
!> excused at the start.
module test_overlap_boxes
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_overlap_check, only : overlap_check_excuse, overlap_check_init, overlap_check_step, &
      overlap_check_t, overlap_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use midside_scenes, only : make_rows
   use small_scenes, only : add_block, add_surface, block_t, scene_begin, shake, top
   implicit none
   private
   public :: collect_overlap_boxes

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_overlap_boxes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("boxes, motions and distances", test_boxes), &
         test_case_t("distances of sides with nodes between", test_midside), &
         test_case_t("what overlaps at the start is excused", test_excused), &
         test_case_t("looks on the way", test_looks)]
   end subroutine collect_overlap_boxes

   !> Three blocks of 2 x 1, 1 x 1 and 1 x 2 cells, a pair of the first two.
   subroutine make_scene(scene, second, third)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: second(2), third(2)      !! where their lower left corners are
      type(block_t) :: block(3)

      call scene_begin(scene)
      call add_block(scene, "CPE4", [2, 1], [0.0_wp, 0.0_wp], [2.0_wp, 0.5_wp], block(1))
      call add_block(scene, "CPE4", [1, 1], second, [1.0_wp, 1.0_wp], block(2))
      call add_block(scene, "CPE4", [1, 2], third, [0.5_wp, 2.0_wp], block(3))
      call add_surface(scene, "FIRST", block(1), [top])
      call add_surface(scene, "SECOND", block(2), [top])
      scene%pair = [contact_pair_t(slave=2, master=1)]
   end subroutine make_scene

   !> In one step after the other.
   subroutine test_boxes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: first(4) = [1, 7, 11, 17]
      type(scene_t) :: scene
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp), dimension(2, 16) :: u0, du, from, to
      real(wp) :: apart
      integer :: k, p, q

      call make_scene(scene, [0.5_wp, 3.0_wp], [4.0_wp, 1.0_wp])
      call overlap_check_init(judge, scene)
      call check_equal(error, judge%n_piece, 3, "pieces")
      do k = 1, 4
         call shake(u0, 0.1_wp)
         call shake(du, 0.1_wp)
         du(:, 11:) = du(:, 11:) + 0.1_wp*k
         call overlap_check_step(judge, scene%x, u0, du, overlap)
         from = scene%x + u0
         to = from + du
         apart = huge(1.0_wp)
         do p = 1, 3
            associate (a => first(p), b => first(p + 1) - 1)
               call check_near(error, judge%low(:, p), min(minval(from(:, a:b), 2), minval(to(:, &
                  a:b), 2)), tol, 10.0_wp, "low " // to_text(p))
               call check_near(error, judge%high(:, p), max(maxval(from(:, a:b), 2), maxval(to(:, &
                  a:b), 2)), tol, 10.0_wp, "high " // to_text(p))
               call check_near(error, judge%least(:, p), minval(du(:, a:b), 2), tol, 1.0_wp, &
                  "least motion " // to_text(p))
               call check_near(error, judge%most(:, p), maxval(du(:, a:b), 2), tol, 1.0_wp, &
                  "most motion " // to_text(p))
            end associate
            do q = p + 1, 3
               apart = min(apart, maxval(max(judge%low(:, p) - judge%high(:, q), &
                  judge%low(:, q) - judge%high(:, p))))
            end do
         end do
         call check_near(error, judge%thinnest, [0.5_wp, 1.0_wp, 0.5_wp], tol, 1.0_wp, "thinnest")
         call check_near(error, judge%clearance, 0.495_wp*apart, tol, 10.0_wp, "clearance")
         call check_near(error, overlap%depth, 0.0_wp, 0.0_wp, 1.0_wp, "nothing overlaps")
      end do
   end subroutine test_boxes

   !> Contact points of straight sides go by 5/3 as far as a node: 3 apart is less for nodes.
   subroutine test_midside(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp), allocatable :: rest(:, :)

      call make_rows(scene)
      scene%pair = [contact_pair_t(slave=2, master=1)]
      scene%x(2, 16:) = scene%x(2, 16:) + 3.0_wp
      rest = 0.0_wp*scene%x
      call overlap_check_init(judge, scene)
      call overlap_check_step(judge, scene%x, rest, rest, overlap)
      call check_near(error, judge%clearance, 0.495_wp*3.0_wp*3.0_wp/5.0_wp, tol, 1.0_wp, &
         "clearance")
   end subroutine test_midside

   !> The third block is in the second one by a quarter as all begins, later in the first one.
   subroutine test_excused(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp), dimension(2, 16) :: rest, du

      call make_scene(scene, [0.5_wp, 3.0_wp], [1.25_wp, 2.0_wp])
      call overlap_check_init(judge, scene)
      rest = 0.0_wp
      call overlap_check_step(judge, scene%x, rest, rest, overlap)
      call check_near(error, [overlap%depth, judge%stray%depth], [0.0_wp, 0.25_wp], tol, 1.0_wp, &
         "of no pair")
      call check_near(error, judge%clearance, 0.0_wp, 0.0_wp, 1.0_wp, "they meet")
      call overlap_check_excuse(judge, scene%x, rest, overlap)
      call check_near(error, overlap%depth, 0.25_wp, tol, 1.0_wp, "what is excused")
      call check_equal(error, size(judge%excused), 1, "pieces that are")
      call check_equal(error, [judge%excused%first, judge%excused%second], [2, 3], "which they are")
      overlap = overlap_t()
      call overlap_check_step(judge, scene%x, rest, rest, overlap)
      call check_near(error, [overlap%depth, judge%stray%depth], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "as at first")
      call check_near(error, judge%clearance, 0.495_wp*1.5_wp, tol, 1.0_wp, "of the others")
      du = 0.0_wp
      du(2, 11:) = -1.75_wp
      call overlap_check_step(judge, scene%x, rest, du, overlap)
      call check_near(error, judge%stray%depth, 0.5_wp, tol, 1.0_wp, "another one, by its edge")
      ! What is no more so is excused no longer.
      call overlap_check_excuse(judge, scene%x, du, overlap)
      call check_equal(error, [judge%excused%first, judge%excused%second], [1, 3], "anew")
      ! The third block is in the first one, and touches the second one.
      call make_scene(scene, [0.75_wp, 1.0_wp], [1.75_wp, 0.25_wp])
      call overlap_check_init(judge, scene)
      call overlap_check_excuse(judge, scene%x, rest, overlap)
      call check_equal(error, [judge%excused%first, judge%excused%second], [1, 3], "that alone")
   end subroutine test_excused

   !> The second block falls through the first one or rises through it, and ends behind it or beside
   !> it. So it does where the first one moves, or both of them, the other way round.
   subroutine test_looks(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way(5) = [2.75_wp, 2.9_wp, 4.5_wp, 8.0_wp, 60.0_wp]
      type(scene_t) :: scene
      type(overlap_check_t) :: judge
      type(overlap_t) :: overlap
      real(wp), dimension(2, 16) :: rest, du
      integer :: k, side, frame

      rest = 0.0_wp
      do side = 1, -1, -2
         call make_scene(scene, merge([0.5_wp, 3.0_wp], [0.5_wp, -3.5_wp], side > 0), &
            [90.0_wp, 90.0_wp])
         call overlap_check_init(judge, scene)
         do k = 1, size(way)
            do frame = 0, 2
               du = 0.0_wp
               du(2, 7:10) = -side*way(k)
               du(2, :10) = du(2, :10) + 0.5_wp*frame*side*way(k)
               overlap = overlap_t()
               call overlap_check_step(judge, scene%x, rest, du, overlap)
               call check_true(error, overlap%depth > 0.2_wp, "seen on the way " &
                  // to_text(side*way(k)) // " in frame " // to_text(frame))
               du(1, 7:10) = 3.0_wp*way(k)
               overlap = overlap_t()
               call overlap_check_step(judge, scene%x, rest, du, overlap)
               call check_true(error, overlap%depth <= 0.0_wp, "past it " // to_text(way(k)))
            end do
         end do
      end do
   end subroutine test_looks

end module test_overlap_boxes
