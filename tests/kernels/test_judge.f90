!> The judge: overlaps of blocks in closed form, both ways, on the way, and of a piece with itself.
module test_judge
   use check, only : check_equal, check_near, check_true, test_case_t
   use cut_scenes, only : add_tie
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_segment, &
      smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_overlap_check, only : overlap_check_init, overlap_check_smooth, overlap_check_step, &
      overlap_check_t, overlap_t
   use emcon_overlap_query, only : overlap_names
   use emcon_scene, only : scene_t
   use emcon_text, only : notes_t, to_text
   use emcon_ties, only : ties_prepare
   use ring_scenes, only : make_rings
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_surface, block_node, block_t, bottom, left, right, &
      scene_begin, shake, top
   implicit none
   private
   public :: collect_judge

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_judge(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("apart and touching", test_apart), &
         test_case_t("a corner in an edge, whichever is the slave", test_corner), &
         test_case_t("a block in its twin, all sides in line", test_twin), &
         test_case_t("edges that cross with no end inside", test_cross), &
         test_case_t("a block that has been crossed in one step", test_crossed), &
         test_case_t("nothing is lost far from the origin", test_far), &
         test_case_t("a piece that goes into itself", test_self), &
         test_case_t("a piece in itself past a crossing", test_self_past), &
         test_case_t("where a tie ends, pieces meet", test_joint), &
         test_case_t("what is between an edge and its curve", test_curve), &
         test_case_t("chords of one circle, and a circle pushed in", test_circles), &
         test_case_t("a dent is no arc", test_dent), &
         test_case_t("an edge of a profile counts as what is in it", test_profile), &
         test_case_t("bodies that no pair brings together", test_no_pair), &
         test_case_t("a block in its twin, no node of either inside", test_in_line), &
         test_case_t("bent blocks anywhere, against a look at all sides", test_anywhere), &
         test_case_t("a U whose legs cross, as two bodies", test_legs)]
   end subroutine collect_judge

   !> Block 1 on [0, 4] x [0, 1] of 4 x 1 elements, top the master; block 2 of `n` elements on
   !> `extent`, standing at `low`, bottom the slave, or the other way round.
   subroutine make_scene(scene, low, extent, n, is_reversed)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: low(2), extent(2)
      integer, intent(in) :: n(2)
      logical, intent(in) :: is_reversed
      type(block_t) :: lower, upper

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 1], [0.0_wp, 0.0_wp], [4.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", n, low, extent, upper)
      call add_surface(scene, "BASE", lower, [top])
      call add_surface(scene, "SLIDER", upper, [bottom])
      scene%pair = [contact_pair_t(slave=merge(1, 2, is_reversed), &
         master=merge(2, 1, is_reversed))]
   end subroutine make_scene

   !> What the judge finds if nothing moves, or if the nodes from `first` on move by `motion`.
   subroutine judged(scene, overlap, first, motion)
      type(scene_t), intent(in) :: scene
      type(overlap_t), intent(out) :: overlap
      integer, intent(in), optional :: first
      real(wp), intent(in), optional :: motion(2)
      type(overlap_check_t) :: judge
      real(wp) :: du(2, size(scene%x, 2))
      integer :: i

      du = 0.0_wp
      if (present(first)) then
         do i = first, size(du, 2)
            du(:, i) = motion
         end do
      end if
      call overlap_check_init(judge, scene)
      call overlap_check_step(judge, scene%x, scene%u0, du, overlap)
   end subroutine judged

   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_scene(scene, [1.3_wp, 1.5_wp], [1.0_wp, 1.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_equal(error, overlap%node, 0, "apart")
      call make_scene(scene, [1.3_wp, 1.0_wp], [1.0_wp, 1.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_true(error, overlap%depth <= eps, "touching")
      call make_scene(scene, [4.0_wp, 0.2_wp], [1.0_wp, 1.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_true(error, overlap%depth <= eps, "side by side")
   end subroutine test_apart

   !> Both corners of the slider are 1/8 deep between nodes of the base, whose edges are 1 long, but
   !> so is the middle of what it covers of the base in the slider, whose edges are 1/2 long; as
   !> master or slave.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      logical :: is_reversed
      integer :: k

      do k = 1, 2
         is_reversed = k == 2
         call make_scene(scene, [1.3_wp, 0.875_wp], [0.5_wp, 0.5_wp], [1, 1], is_reversed)
         call judged(scene, overlap)
         call check_near(error, overlap%depth, 0.25_wp, 8.0_wp*eps, 1.0_wp, "depth")
         call check_true(error, any(overlap%node == [7, 8]), "node")
         call check_equal(error, overlap%facet(:2), [11, 12], "edge")
         call check_true(error, all(overlap_names(overlap, [overlap%node, 11, 12, 10]) .eqv. &
            [.true., .true., .true., .false.]), "nodes that it is told of")
      end do
   end subroutine test_corner

   !> As wide as the base and in line with it: no edges cross, yet it is 1/4 deep.
   subroutine test_twin(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_scene(scene, [0.0_wp, 0.75_wp], [4.0_wp, 1.0_wp], [4, 1], .false.)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.25_wp, 4.0_wp*eps, 1.0_wp, "depth")
   end subroutine test_twin

   !> A plus of two bars, no node of either in the other: the middle of the sides of the bar that
   !> stands is 1/2 deep in the base, where edges are 1 long.
   subroutine test_cross(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_scene(scene, [1.25_wp, -0.25_wp], [0.5_wp, 2.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.5_wp, 4.0_wp*eps, 1.0_wp, "depth")
      ! Deepest are the sides of the bar, at a third of their way.
      call make_scene(scene, [1.25_wp, -0.1875_wp], [0.5_wp, 2.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.5_wp, 4.0_wp*eps, 1.0_wp, "depth of the sides")
      call check_true(error, any(overlap%node == [11, 12]), "the lower nodes are nearer")
   end subroutine test_cross

   !> From above the base to below it in one step: free at both ends, yet it is seen in the middle.
   subroutine test_crossed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      integer :: k

      do k = 0, 2
         call make_scene(scene, [1.3_wp, 1.25_wp], [0.5_wp, 0.5_wp], [1, 1], .false.)
         scene%x = 0.125_wp**k*scene%x
         call judged(scene, overlap, first=11, motion=0.125_wp**k*[0.0_wp, -2.5_wp])
         call check_true(error, overlap%depth >= 0.25_wp, "seen on the way")
         call judged(scene, overlap, first=11, motion=0.125_wp**k*[0.0_wp, 2.5_wp])
         call check_equal(error, overlap%node, 0, "away from it")
         ! What goes in by little and out again on its way grazes: by its edges, in any unit.
         call judged(scene, overlap, first=11, motion=0.125_wp**k*[6.0_wp, -0.02_wp])
         call check_equal(error, overlap%node, 0, "past it")
      end do
   end subroutine test_crossed

   !> A motion of 2**30 edges for all: rounded by a millionth of an edge, and yet the same.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_scene(scene, [1.25_wp, 0.875_wp], [0.5_wp, 0.5_wp], [1, 1], .false.)
      scene%u0 = 2.0_wp**30
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.25_wp, 8.0_wp*eps, 1.0_wp, "depth")
   end subroutine test_far

   !> A strip of elements 1 x 1 on [0, 8] x [0, 1], in contact with itself.
   subroutine make_strip(scene, strip)
      type(scene_t), intent(out) :: scene
      type(block_t), intent(out) :: strip

      call scene_begin(scene)
      call add_block(scene, "CPE4", [8, 1], [0.0_wp, 0.0_wp], [8.0_wp, 1.0_wp], strip)
      call add_surface(scene, "SKIN", strip, [bottom, right, top, left])
      scene%pair = [contact_pair_t(slave=1, master=1)]
   end subroutine make_strip

   !> Bend the strip back above itself, its last two nodes to the places `tip`.
   pure subroutine bend(scene, strip, tip)
      type(scene_t), intent(inout) :: scene
      type(block_t), intent(in) :: strip
      real(wp), intent(in) :: tip(2, 2)          !! below and above at first
      !> Of the pairs of nodes before.
      real(wp), parameter :: bent(2, 2, 5:7) = reshape([5.5_wp, 0.5_wp, 4.5_wp, 1.5_wp, &
         5.5_wp, 2.5_wp, 4.5_wp, 2.0_wp, 4.5_wp, 3.5_wp, 4.0_wp, 2.5_wp], [2, 2, 3])
      integer :: i, j

      do i = 5, 8
         do j = 0, 1
            associate (node => block_node(strip, i, j))
               if (i < 8) scene%u0(:, node) = bent(:, j + 1, i) - scene%x(:, node)
               if (i == 8) scene%u0(:, node) = tip(:, j + 1) - scene%x(:, node)
            end associate
         end do
      end do
   end subroutine bend

   !> A strip whose end is put into its middle: its lower corner 0.2 below the top.
   subroutine test_self(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      type(block_t) :: strip

      call make_strip(scene, strip)
      call judged(scene, overlap)
      call check_equal(error, overlap%node, 0, "straight")
      call bend(scene, strip, reshape([2.0_wp, 1.5_wp, 2.5_wp, 0.8_wp], [2, 2]))
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.2_wp, 8.0_wp*eps, 1.0_wp, "depth")
      call check_equal(error, overlap%node, block_node(strip, 8, 1), "node")
   end subroutine test_self

   !> The end goes in by one edge of a slope and lies behind the next, whose box is apart from its
   !> own: the depth is that from the next.
   subroutine test_self_past(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      type(block_t) :: strip
      integer :: i

      call make_strip(scene, strip)
      do i = 0, 4
         scene%u0(2, block_node(strip, i, 1)) = 0.25_wp*real(i, wp)
      end do
      call bend(scene, strip, reshape([1.5_wp, 1.49_wp, 2.2_wp, 1.45_wp], [2, 2]))
      call judged(scene, overlap)
      ! 0.1 below a slope of 1/4, by the edge: 0.1 cos^2.
      call check_near(error, overlap%depth, 0.1_wp/1.0625_wp, 8.0_wp*eps, 1.0_wp, "depth")
      call check_equal(error, overlap%node, block_node(strip, 8, 1), "node")
   end subroutine test_self_past

   !> Two blocks side by side, the second a sixteenth lower and a little inside the first: an
   !> overlap by the tops, but not if a tie holds them, which lets its ends slip by its error. What
   !> goes into the other piece elsewhere is seen.
   subroutine test_joint(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(notes_t) :: notes
      type(overlap_t) :: overlap
      type(block_t) :: first, second

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 1], [0.0_wp, 0.0_wp], [4.0_wp, 1.0_wp], first)
      call add_block(scene, "CPE4", [1, 1], [4.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], second)
      call add_surface(scene, "FIRST", first, [top])
      call add_surface(scene, "SECOND", second, [top])
      call add_surface(scene, "FIRST_CUT", first, [right])
      call add_surface(scene, "SECOND_CUT", second, [left])
      scene%pair = [contact_pair_t(slave=1, master=2)]
      call judged(scene, overlap, 11, [-0.25_wp, -0.0625_wp])
      call check_true(error, overlap%depth > 0.03_wp, "not tied")
      call add_tie(scene, 3, 4)
      call ties_prepare(scene, notes, error)
      if (allocated(error)) return
      call judged(scene, overlap, 11, [-0.25_wp, -0.0625_wp])
      call check_equal(error, overlap%node, 0, "tied")
      call judged(scene, overlap, 14, [-1.5_wp, -0.125_wp])
      call check_near(error, overlap%depth, 0.125_wp, 8.0_wp*eps, 1.0_wp, &
         "a corner that is folded over")
      call check_equal(error, overlap%node, 14, "node")
   end subroutine test_joint

   !> The top of the base as a parabola of curvature 2 `bend`, a corner of the slider `depth` below
   !> the middle of an edge: of the curve, that is `bend` times share times 1 - share less. A hollow
   !> master alone stands for a curve that is behind its edges.
   subroutine test_curve(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: bend(4) = [0.25_wp, 0.25_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: depth(4) = [0.125_wp, 0.03125_wp, 0.125_wp, 0.125_wp]
      logical, parameter :: is_reversed(4) = [.false., .false., .true., .false.]
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      real(wp) :: share, of_facets, of_curve, of_arc
      integer :: k

      do k = 1, size(bend)
         call make_hollow(scene, bend(k), depth(k), is_reversed(k))
         scene%x = 0.25_wp**(k - 1)*scene%x
         scene%u0 = 0.25_wp**(k - 1)*scene%u0
         associate (square => 1.0_wp + bend(k)**2)
            share = 0.5_wp + depth(k)*bend(k)/square
            of_facets = depth(k)/square
            of_curve = of_facets - max(0.0_wp, bend(k))*share*(1.0_wp - share)/square
         end associate
         of_arc = of_facets - max(0.0_wp, arc(bend(k), share))
         if (is_reversed(k)) of_curve = of_arc
         call judged_smoothly(scene, overlap)
         call check_near(error, overlap%of_facets, merge(of_facets, 0.0_wp, bend(k) > 0.0_wp), &
            16.0_wp*eps, 1.0_wp, "of edges")
         call check_near(error, overlap%depth, max(0.0_wp, of_curve), 16.0_wp*eps, 1.0_wp, "curve")
         scene%pair%formulation = formulation_segment
         call judged_smoothly(scene, overlap)
         call check_near(error, overlap%depth, max(0.0_wp, of_arc), 16.0_wp*eps, 1.0_wp, "segments")
      end do

   contains

      !> How far the arc lies behind the edge from x = 2 to 3, per its length: its curvature is the
      !> harmonic mean of those of the circles through three nodes of the parabola.
      pure real(wp) function arc(b, s)
         real(wp), intent(in) :: b               !! bend
         real(wp), intent(in) :: s               !! share
         real(wp) :: radius

         associate (square => 1.0_wp + b**2)
            radius = 0.5_wp*(0.5_wp*square/b + 0.5_wp*sqrt(square*(1.0_wp + 9.0_wp*b**2) &
               *(1.0_wp + 4.0_wp*b**2))/b)
            arc = sign(sqrt(radius**2 - (s - 0.5_wp)**2*square) &
               - sqrt(radius**2 - 0.25_wp*square), b)/sqrt(square)
         end associate
      end function arc

   end subroutine test_curve

   !> Nodes on one circle do not overlap, whatever their chords do. A hub that is larger by 1/50
   !> does by that less the sagitta of one of its chords; chords of the sleeve are what it is in.
   subroutine test_circles(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: more = 0.02_wp, sagitta = 2.0_wp*(1.0_wp - cos(acos(0.0_wp)/16.0_wp))
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      real(wp), allocatable :: length(:)
      integer :: k

      do k = 1, 2
         call make_rings(scene, [8, 11], 0.0_wp, k == 2)
         call judged(scene, overlap)
         call check_true(error, overlap%depth <= 16.0_wp*eps, "chords of one circle")
         call check_true(error, overlap%of_facets > 0.01_wp, "edges overlap as they are")
         call make_rings(scene, [8, 11], more, k == 2)
         call judged(scene, overlap)
         length = norm2(scene%x(:, 20:30) - scene%x(:, 19:29), 1)
         ! Distances from chords are those from the arc by the cosine of a quarter of a turn.
         call check_true(error, overlap%depth > 0.95_wp*(more - sagitta)/maxval(length) .and. &
            overlap%depth < 1.01_wp*more/minval(length), "pushed in")
      end do
   end subroutine test_circles

   !> A single turn between flat sides is a valley: what is behind one of them is inside.
   subroutine test_dent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: bend = 0.25_wp, depth = 0.03125_wp
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_hollow(scene, bend, depth, .false.)
      scene%u0(2, :10) = bend*abs(scene%x(1, :10) - 2.0_wp)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, depth/(1.0_wp + bend**2), 16.0_wp*eps, 1.0_wp, "depth")
   end subroutine test_dent

   !> A corner 1/8 deep in a line of edges 1/16 long, by its own edges of 1/2; on its way past the
   !> end of the line it grazes by less than a tenth of these, or goes through it.
   subroutine test_profile(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_profile(scene, 0.875_wp)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.25_wp, 8.0_wp*eps, 1.0_wp, "depth")
      call make_profile(scene, 1.0_wp)
      call judged(scene, overlap, first=size(scene%x, 2) - 3, motion=[6.0_wp, -0.0625_wp])
      call check_equal(error, overlap%node, 0, "past it")
      call judged(scene, overlap, first=size(scene%x, 2) - 3, motion=[6.0_wp, -0.625_wp])
      call check_true(error, overlap%depth > 0.25_wp, "seen on the way")
   end subroutine test_profile

   !> A line from x = 4 to 0 at the height 1, and a square of 1/2 that stands at `height`.
   subroutine make_profile(scene, height)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: height
      integer, parameter :: n = 64
      type(surface_t) :: line
      type(block_t) :: slider
      integer :: i

      call scene_begin(scene)
      call add_block(scene, "CPE4", [1, n - 1], [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], slider)
      ! The nodes of a block without its elements.
      scene%x = reshape([(real(n - i, wp)/16.0_wp, 1.0_wp, i = 0, 2*n - 1)], [2, 2*n])
      deallocate(scene%element%node, scene%element%kind, scene%element%section, &
         scene%element%label, scene%element%origin)
      allocate(scene%element%node(4, 0), scene%element%kind(0), scene%element%section(0), &
         scene%element%label(0), scene%element%origin(0))
      call add_block(scene, "CPE4", [1, 1], [1.3_wp, height], [0.5_wp, 0.5_wp], slider)
      line%name = "LINE"
      line%is_profile = .true.
      line%edge = reshape([(i, i + 1, i = 1, n)], [2, n])
      allocate(line%element(0), line%face(0))
      scene%surface = [line]
      call add_surface(scene, "SLIDER", slider, [bottom])
      scene%pair = [contact_pair_t(slave=2, master=1)]
   end subroutine make_profile

   !> The base bent, and in it a corner of the slider.
   subroutine make_hollow(scene, bend, depth, is_reversed)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: bend, depth
      logical, intent(in) :: is_reversed
      integer :: i

      call make_scene(scene, [1.5_wp, 1.0_wp + 0.5_wp*bend - depth], [0.5_wp, 1.0_wp], [1, 1], &
         is_reversed)
      do i = 1, 10
         scene%u0(2, i) = bend*(scene%x(1, i) - 2.0_wp)**2
      end do
      do i = 11, size(scene%x, 2)
         if (scene%x(1, i) > 1.75_wp .and. scene%x(2, i) < 1.5_wp) scene%u0(2, i) = 0.5_wp
      end do
   end subroutine make_hollow

   !> What the judge finds at rest in a smoothed step.
   subroutine judged_smoothly(scene, overlap)
      type(scene_t), intent(in) :: scene
      type(overlap_t), intent(out) :: overlap
      type(overlap_check_t) :: judge

      call overlap_check_init(judge, scene)
      call overlap_check_smooth(judge, scene, contact_options_t(smoothing=smoothing_hermite))
      call overlap_check_step(judge, scene%x, scene%u0, 0.0_wp*scene%u0, overlap)
   end subroutine judged_smoothly

   subroutine test_no_pair(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      type(overlap_check_t) :: judge

      call make_scene(scene, [1.3_wp, 0.5_wp], [1.0_wp, 1.0_wp], [1, 1], .false.)
      deallocate(scene%pair)
      allocate(scene%pair(0))
      call judged(scene, overlap)
      call check_equal(error, overlap%node, 0, "no pair")
      call overlap_check_init(judge, scene)
      call overlap_check_step(judge, scene%x, scene%u0, 0.0_wp*scene%u0, overlap)
      call check_near(error, judge%stray%depth, 0.5_wp, 4.0_wp*eps, 1.0_wp, "stray")
   end subroutine test_no_pair

   !> Square 2 has the sides of block 1 and stands in it to a quarter: nothing crosses.
   subroutine test_in_line(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap

      call make_scene(scene, [0.0_wp, 0.75_wp], [4.0_wp, 1.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.25_wp, 4.0_wp*eps, 1.0_wp, "in line")
      ! The bottom of the upper block rises by 0.4: it counts by its middle.
      scene%x(2, 11:12) = [0.5_wp, 0.9_wp]
      call judged(scene, overlap)
      call check_near(error, overlap%depth, 0.3_wp, 4.0_wp*eps, 1.0_wp, "aslant")
      call make_scene(scene, [0.0_wp, 1.0_wp], [4.0_wp, 1.0_wp], [1, 1], .false.)
      call judged(scene, overlap)
      call check_equal(error, overlap%node, 0, "on top")
   end subroutine test_in_line

   !> Blocks of bent sides thrown on each other: of all nodes of both, and of the middles of all
   !> parts of sides between crossings, the deepest one in the other block by the side that is
   !> nearest.
   subroutine test_anywhere(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tol = 4096.0_wp*eps
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      real(wp) :: side(2, 9), u(3), depth, deepest(2), longest
      integer, parameter :: node(9) = 10 + [1, 2, 3, 6, 9, 8, 7, 4, 1]
      integer :: case, n_deep

      n_deep = 0
      do case = 1, 300
         call make_scene(scene, [0.0_wp, 0.0_wp], [2.0_wp, 2.0_wp], [2, 2], .false.)
         call draw_random(u)
         call shake(side, 0.2_wp)
         scene%x(:, 11:) = scene%x(:, 11:) + side - 1.0_wp
         associate (c => cos(8.0_wp*u(1)), s => sin(8.0_wp*u(1)))
            scene%x(:, 11:) = matmul(reshape([c, s, -s, c], [2, 2]), scene%x(:, 11:))
         end associate
         scene%x(1, 11:) = scene%x(1, 11:) + 6.0_wp*u(2) - 1.0_wp
         scene%x(2, 11:) = scene%x(2, 11:) + 2.5_wp*u(3) - 1.0_wp
         scene%x = 0.25_wp**mod(case, 4)*scene%x
         call judged(scene, overlap)
         call compare()
         if (allocated(error)) return
      end do
      call check_true(error, n_deep > 100, "overlaps: " // to_text(n_deep))

   contains

      subroutine compare()
         integer, parameter :: base(10) = [1, 2, 3, 4, 5, 10, 9, 8, 7, 6]
         real(wp) :: lower(2, 11), upper(2, 9)
         integer :: i

         lower = scene%x(:, [base, 1])
         upper = scene%x(:, node)
         longest = max(maxval(norm2(lower(:, 2:) - lower(:, :10), 1)), &
            maxval(norm2(upper(:, 2:) - upper(:, :8), 1)))
         deepest = 0.0_wp
         depth = 0.0_wp
         do i = 1, 10
            call look_along(lower(:, i:i + 1), upper)
         end do
         do i = 1, 8
            call look_along(upper(:, i:i + 1), lower)
         end do
         if (depth > 0.99_wp*longest) return     ! deeper than is looked for
         if (deepest(1) > 1.0e-3_wp) n_deep = n_deep + 1
         call check_near(error, max(0.0_wp, overlap%depth), max(deepest(1), min(deepest(2), &
            overlap%depth)), tol, 1.0_wp, "case " // to_text(case))
      end subroutine compare

      !> The ends of an edge, and the middles of its parts.
      subroutine look_along(edge, other)
         real(wp), intent(in) :: edge(2, 2), other(:, :)
         real(wp) :: cut(size(other, 2) + 1), s, t, det, a(2), b(2), c(2)
         integer :: i, j, n

         n = 1
         cut(1) = 0.0_wp
         a = edge(:, 2) - edge(:, 1)
         do i = 1, size(other, 2) - 1
            b = other(:, i + 1) - other(:, i)
            c = other(:, i) - edge(:, 1)
            det = a(1)*b(2) - a(2)*b(1)
            s = (c(1)*b(2) - c(2)*b(1))/det
            t = (c(1)*a(2) - c(2)*a(1))/det
            if (min(s, t) <= 0.0_wp .or. max(s, t) >= 1.0_wp) cycle
            j = count(cut(:n) <= s)
            cut(j + 2:n + 1) = cut(j + 1:n)
            cut(j + 1) = s
            n = n + 1
         end do
         cut(n + 1) = 1.0_wp
         call look_at(edge(:, 1), other)
         do i = 1, n
            if (n > 1) call look_at(edge(:, 1) + 0.5_wp*(cut(i) + cut(i + 1))*a, other)
         end do
      end subroutine look_along

      !> A point by the sides of the other block, counter-clockwise, the first one twice.
      subroutine look_at(point, other)
         real(wp), intent(in) :: point(2), other(:, :)
         real(wp) :: a(2), b(2), least, length(2), turn, distance
         integer :: i

         least = huge(least)
         length = 1.0_wp
         turn = 0.0_wp
         do i = 1, size(other, 2) - 1
            a = other(:, i) - point
            b = other(:, i + 1) - point
            turn = turn + atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
            distance = norm2(a + min(1.0_wp, max(0.0_wp, dot_product(-a, b - a) &
               /dot_product(b - a, b - a)))*(b - a))
            ! At a node of a dent there are two nearest ones.
            if (abs(distance - least) <= 16.0_wp*eps) length = [max(length(1), norm2(b - a)), &
               min(length(2), norm2(b - a))]
            if (distance >= least - 16.0_wp*eps) cycle
            least = distance
            length = norm2(b - a)
         end do
         if (turn < 1.0_wp) return
         depth = max(depth, least)
         deepest = max(deepest, least/length)
      end subroutine look_at

   end subroutine test_anywhere

   !> One leg of a U leans into the other one, by up to 2/5 with its corner: what is found in the
   !> one piece is what is found between two that are the legs, in the order of the strip or against
   !> it.
   subroutine test_legs(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: outer(2, 0:9) = reshape([0.0_wp, 3.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, &
         1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 2.0_wp, -1.0_wp, 3.0_wp, -1.0_wp, 3.0_wp, &
         1.0_wp, 3.0_wp, 2.0_wp, 3.0_wp, 3.0_wp], [2, 10])
      real(wp), parameter :: inner(2, 0:9) = reshape([1.0_wp, 3.0_wp, 1.0_wp, 2.0_wp, 1.0_wp, &
         1.0_wp, 1.0_wp, 0.0_wp, 1.25_wp, 0.0_wp, 1.75_wp, 0.0_wp, 2.0_wp, 0.0_wp, 2.0_wp, &
         1.0_wp, 2.0_wp, 2.0_wp, 2.0_wp, 3.0_wp], [2, 10])
      type(scene_t) :: scene, legs
      type(overlap_t) :: overlap, expected
      type(block_t) :: block, other
      real(wp) :: at(2, 0:9, 2), draw(2, 20), u, lean
      integer :: case, first, n_deep

      n_deep = 0
      do case = 1, 100
         call shake(draw, 0.1_wp)
         draw(1, :) = 0.0_wp                     ! legs are straight: sides that wave may be arcs
         at(:, :, 1) = outer
         at(:, :, 2) = inner
         at = at + reshape(draw, [2, 10, 2])
         call draw_random(u)
         lean = asin((0.9_wp + 0.5_wp*u)/3.0_wp)
         first = merge(7, 0, mod(case, 2) == 0)
         associate (c => cos(lean), s => merge(sin(lean), -sin(lean), first == 7), &
               base => merge(2.5_wp, 0.5_wp, first == 7))
            at(1, first:first + 2, :) = at(1, first:first + 2, :) - base
            at(:, first:first + 2, :) = reshape(matmul(reshape([c, s, -s, c], [2, 2]), &
               reshape(at(:, first:first + 2, :), [2, 6])), [2, 3, 2])
            at(1, first:first + 2, :) = at(1, first:first + 2, :) + base
         end associate
         call scene_begin(scene)
         call add_block(scene, "CPE4", [9, 1], [0.0_wp, 0.0_wp], [9.0_wp, 1.0_wp], block)
         call add_surface(scene, "ALL", block, [bottom, right, top, left])
         scene%pair = [contact_pair_t(slave=1, master=1)]
         scene%x = reshape(at, [2, 20])
         call judged(scene, overlap)
         call scene_begin(legs)
         call add_block(legs, "CPE4", [3, 1], [0.0_wp, 0.0_wp], [3.0_wp, 1.0_wp], block)
         call add_block(legs, "CPE4", [3, 1], [9.0_wp, 0.0_wp], [3.0_wp, 1.0_wp], other)
         call add_surface(legs, "ONE", block, [top])
         call add_surface(legs, "OTHER", other, [top])
         legs%pair = [contact_pair_t(slave=1, master=2)]
         legs%x = reshape([at(:, :3, 1), at(:, :3, 2), at(:, 6:, 1), at(:, 6:, 2)], [2, 16])
         call judged(legs, expected)
         if (expected%depth > 1.0e-3_wp) n_deep = n_deep + 1
         call check_near(error, max(0.0_wp, overlap%depth), max(0.0_wp, expected%depth), &
            64.0_wp*eps, 1.0_wp, "case " // to_text(case))
      end do
      call check_true(error, n_deep > 40 .and. n_deep < 100, "overlaps: " // to_text(n_deep))
   end subroutine test_legs

end module test_judge
