!> Outlines of the pieces of a mesh: which edges they have, and how these hang together.
module test_outline
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_outline, only : outline_meets, outline_t
   use emcon_outline_curves_plane, only : outline_curves_init, outline_curves_overlap, &
      outline_curves_t
   use emcon_outline_plane, only : outline_init, outline_links_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use ring_scenes, only : make_rings
   use small_scenes, only : add_block, add_surface, block_node, block_t, bottom, make_block, &
      scene_begin, top
   implicit none
   private
   public :: collect_outline

   !> Some dozen roundings of quantities of size 1.
   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_outline(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("closed outlines of three pieces", test_pieces), &
         test_case_t("where outlines meet in a node", test_pinch), &
         test_case_t("edges of surfaces without elements", test_lone), &
         test_case_t("a single piece without a pair", test_single), &
         test_case_t("curves of unequal edges rise as their circle", test_curves), &
         test_case_t("smoothed edges as cubics", test_cubics), &
         test_case_t("a hollow arc against a round one", test_hollow), &
         test_case_t("arcs end at corners, to the left or right", test_corners)]
   end subroutine collect_outline

   !> Blocks of 3 x 2, 2 x 1 and 1 x 1 cells of heights 1/2, 1 and 2, of quadrilaterals or not.
   subroutine make_three(scene, block)
      type(scene_t), intent(out) :: scene
      type(block_t), intent(out) :: block(3)

      call scene_begin(scene)
      call add_block(scene, "CPE4", [3, 2], [0.0_wp, 0.0_wp], [3.0_wp, 1.0_wp], block(1))
      call add_block(scene, "CPE3", [2, 1], [0.0_wp, 2.0_wp], [6.0_wp, 1.0_wp], block(2))
      call add_block(scene, "CPE4", [1, 1], [0.0_wp, 4.0_wp], [3.0_wp, 2.0_wp], block(3))
      call add_surface(scene, "FIRST", block(1), [top])
      call add_surface(scene, "SECOND", block(2), [bottom])
      call add_surface(scene, "THIRD", block(3), [bottom])
      scene%pair = [contact_pair_t(slave=2, master=1), contact_pair_t(slave=2, master=2)]
   end subroutine make_three

   subroutine test_pieces(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_edge(3) = [10, 6, 4]
      real(wp), parameter :: thickness(3) = [0.5_wp, 1.0_wp, 2.0_wp]
      type(scene_t) :: scene
      type(block_t) :: block(3)
      type(outline_t) :: outline
      type(outline_links_t) :: links
      logical, allocatable :: acts(:)
      integer :: p, i

      call make_three(scene, block)
      call outline_init(outline, links, scene)
      call check_equal(error, outline%n_piece, 3, "pieces")
      call check_equal(error, outline%start, [1, 11, 17, 21], "where they begin")
      call check_equal(error, [size(outline%facet, 2), size(links%link, 2)], [20, 20], "edges")
      if (allocated(error)) return
      do p = 1, 3
         do i = outline%start(p), outline%start(p + 1) - 1
            associate (facet => outline%facet(:, i))
               call check_true(error, all(facet > block(p)%nodes_before) .and. all(facet <= &
                  block(p)%nodes_before + product(block(p)%n + 1)), "of its block")
               call check_true(error, has_body_left(scene, facet), "the body to the left")
               call check_equal(error, outline%facet(1, links%link(2, i)), facet(2), "goes on")
               call check_equal(error, links%link(1, links%link(2, i)), i, "and back")
            end associate
            call check_near(error, outline%thickness(i), thickness(p), 0.0_wp, 1.0_wp, "thickness")
         end do
         call check_equal(error, outline%start(p + 1) - outline%start(p), n_edge(p), "its edges")
      end do
      call check_true(error, all(links%place == outline%facet), "places")
      call check_true(error, all(links%host == 0) .and. .not. any(links%is_buried) .and. &
         .not. any(links%is_profile), "no ties, no profiles")
      acts = spread(.true., 1, size(outline%pair, 2))
      call check_true(error, outline_meets(outline, 1, 2, acts) .and. outline_meets(outline, 2, &
         1, acts) .and. outline_meets(outline, 2, 2, acts), "pairs")
      call check_true(error, .not. (outline_meets(outline, 1, 1, acts) .or. outline_meets(outline, &
         1, 3, acts) .or. outline_meets(outline, 3, 3, acts)), "no others")
      call check_true(error, .not. any([(outline_meets(outline, 1, p, .not. acts), p = 1, 3)]), &
         "none where no pair acts")
      call check_true(error, outline%body(1) /= outline%body(2) .and. outline%body(2) &
         /= outline%body(3), "bodies")
   end subroutine test_pieces

   !> An edge of a rectangle whose centre is to the left.
   pure logical function has_body_left(scene, edge)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: edge(2)
      real(wp) :: along(2), to(2), centre(2)
      integer :: e

      has_body_left = .false.
      along = scene%x(:, edge(2)) - scene%x(:, edge(1))
      do e = 1, size(scene%element%kind)
         associate (node => pack(scene%element%node(:, e), scene%element%node(:, e) > 0))
            if (count(node == edge(1)) + count(node == edge(2)) < 2) cycle
            centre = sum(scene%x(:, node), 2)/real(size(node), wp)
            to = centre - scene%x(:, edge(1))
            has_body_left = along(1)*to(2) - along(2)*to(1) > 0.0_wp
         end associate
      end do
   end function has_body_left

   !> Of 2 x 2 cells two, across: in the middle node neither outline goes on.
   subroutine test_pinch(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(outline_t) :: outline
      type(outline_links_t) :: links
      integer :: i, middle

      call make_block(scene, "CPE4", [2, 2], block)
      middle = block_node(block, 1, 1)
      scene%element%node = scene%element%node(:, [1, 4])
      scene%element%kind = scene%element%kind([1, 4])
      scene%element%section = scene%element%section([1, 4])
      call add_surface(scene, "SELF", block_t(kind=block%kind, n=[1, 1]), [bottom])
      scene%pair = [contact_pair_t(slave=1, master=1)]
      call outline_init(outline, links, scene)
      call check_equal(error, [outline%n_piece, size(outline%facet, 2)], [1, 8], "edges")
      do i = 1, size(outline%facet, 2)
         associate (facet => outline%facet(:, i))
            call check_true(error, (links%link(1, i) == 0) .eqv. facet(1) == middle, "before")
            call check_true(error, (links%link(2, i) == 0) .eqv. facet(2) == middle, "after")
         end associate
      end do
   end subroutine test_pinch

   !> A line of two edges over a block, one edge of which the block has as well.
   subroutine test_lone(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(outline_t) :: outline
      type(outline_links_t) :: links
      integer :: k

      do k = 1, 2
         call make_block(scene, "CPE4", [1, 1], block)
         scene%x = reshape([scene%x, [0.0_wp, 3.0_wp, 2.0_wp, 3.0_wp, 5.0_wp, 3.0_wp]], [2, 7])
         call add_surface(scene, "BLOCK", block, [top])
         call add_surface(scene, "LINE", block, [top])
         deallocate(scene%surface(2)%element, scene%surface(2)%face)
         allocate(scene%surface(2)%element(0), scene%surface(2)%face(0))
         scene%surface(2)%edge = reshape([7, 6, 6, 5, 1, 2], [2, 3])
         scene%surface(2)%is_profile = k == 2
         if (k == 2) scene%surface(2)%edge = scene%surface(2)%edge(:, :2)
         scene%pair = [contact_pair_t(slave=1, master=2)]
         call outline_init(outline, links, scene)
         call check_equal(error, [outline%n_piece, size(outline%facet, 2)], [2, 6], "edges")
         if (allocated(error)) return
         call check_true(error, all(outline%facet(:, 5:) == reshape([7, 6, 6, 5], [2, 2])), "line")
         call check_near(error, outline%thickness(5:), [3.0_wp, 2.0_wp], 0.0_wp, 1.0_wp, &
            "as thick as they are long")
         call check_equal(error, [links%link(:, 5), links%link(:, 6)], [0, 6, 5, 0], "its ends")
         call check_true(error, all(links%is_profile(5:) .eqv. k == 2) .and. &
            .not. any(links%is_profile(:4)), "profile")
      end do
   end subroutine test_lone

   subroutine test_single(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(outline_t) :: outline
      type(outline_links_t) :: links

      call make_block(scene, "CPE4", [2, 1], block)
      call outline_init(outline, links, scene)
      call check_equal(error, [outline%n_piece, size(outline%facet, 2)], [0, 0], "nothing can meet")
      call add_block(scene, "CPE4", [1, 1], [5.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], block)
      call outline_init(outline, links, scene)
      call check_equal(error, [outline%n_piece, size(outline%facet, 2)], [2, 10], "two can")
      call check_true(error, .not. outline_meets(outline, 1, 2, [logical ::]), &
         "though no pair brings them")
   end subroutine test_single

   !> Smoothed edges of the inside of a quarter of a ring lie behind by s (1 - s) L^2/(2 R), but for
   !> the fourth order, and by the difference of neighbours' lengths. An edge beside itself counts
   !> twice.
   subroutine test_curves(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: radius = 2.0_wp
      type(scene_t) :: scene
      type(outline_t) :: outline
      type(outline_links_t) :: links
      type(outline_curves_t) :: curves, more
      type(contact_options_t) :: options
      real(wp), allocatable :: still(:, :)
      real(wp) :: length, share, overlap
      integer :: e, k, n_seen

      call make_rings(scene, [8, 20], 0.0_wp, .false.)
      ! Every second node of the sleeve's inside, nodes 19 to 39, goes on by a third of an edge.
      scene%x(:, 20:38:2) = 0.3_wp*scene%x(:, 21:39:2) + 0.7_wp*scene%x(:, 20:38:2)
      do k = 20, 38, 2
         scene%x(:, k) = scene%x(:, k)*(radius/norm2(scene%x(:, k)))
      end do
      options%smoothing = smoothing_hermite
      call outline_init(outline, links, scene)
      call outline_curves_init(curves, outline, links, scene, options)
      allocate(still, source=0.0_wp*scene%x)
      n_seen = 0
      do e = 1, size(outline%facet, 2)
         associate (a => scene%x(:, outline%facet(1, e)), b => scene%x(:, outline%facet(2, e)))
            if (curves%number(e) == 0) cycle
            ! Ends of the surface bend half as much.
            if (min(a(1), b(1), a(2), b(2)) < 0.05_wp*radius) cycle
            n_seen = n_seen + 1
            length = norm2(b - a)
            do k = 1, 3
               share = 0.25_wp*k
               overlap = outline_curves_overlap(curves, e, e, [share, share], scene%x, still)
               call check_near(error, overlap, share*(1.0_wp - share)*length**2/radius, &
                  0.05_wp, length**2/(4.0_wp*radius), "rise at " // to_text(share, 3))
            end do
         end associate
      end do
      call check_true(error, n_seen == 18, "smoothed edges: " // to_text(n_seen))
      ! A pair whose master is a part of that: the curves of the first one stay.
      scene%surface = [scene%surface, scene%surface(scene%pair(1)%master)]
      associate (part => scene%surface(size(scene%surface)))
         part%element = part%element(4:9)
         part%face = part%face(4:9)
      end associate
      scene%pair = [scene%pair, scene%pair]
      scene%pair(2)%master = size(scene%surface)
      call outline_curves_init(more, outline, links, scene, options)
      do e = 1, size(outline%facet, 2)
         associate (share => [0.25_wp, 0.25_wp])
            call check_near(error, outline_curves_overlap(more, e, e, share, scene%x, still), &
               outline_curves_overlap(curves, e, e, share, scene%x, still), 0.0_wp, 1.0_wp, &
               "with a part of the master once more, edge " // to_text(e))
         end associate
      end do
   end subroutine test_curves

   !> With the tangents of parabolas through three nodes at both ends, within the surface.
   subroutine test_cubics(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: share = 0.3_wp
      type(scene_t) :: scene
      type(outline_t) :: outline
      type(outline_links_t) :: links
      type(outline_curves_t) :: curves
      type(contact_options_t) :: options
      real(wp), allocatable :: still(:, :)
      real(wp) :: edge(2, 3), l(3), tangent(2, 2), offset(2)
      integer :: e, i, n_seen

      call make_rings(scene, [8, 20], 0.0_wp, .false.)
      options%smoothing = smoothing_hermite
      call outline_init(outline, links, scene)
      call outline_curves_init(curves, outline, links, scene, options)
      allocate(still, source=0.0_wp*scene%x)
      n_seen = 0
      do e = 1, size(outline%facet, 2)
         if (curves%number(e) == 0) cycle
         associate (piece => curves%piece(curves%number(e)), before => links%link(1, e), &
               after => links%link(2, e))
            call check_true(error, all(piece%node(:, 0) == outline%facet(:, e)), "its nodes")
            do i = -1, 1, 2
               associate (beside => merge(before, after, i < 0))
                  ! Where the surface ends the outline goes on round a corner.
                  call check_true(error, all(piece%node(:, i) == merge(outline%facet(:, beside), &
                     0, curves%number(beside) > 0)), "what it is joined to")
               end associate
            end do
            if (allocated(error)) return
            if (any(piece%node == 0)) cycle
            n_seen = n_seen + 1
            edge = scene%x(:, piece%node(2, :)) - scene%x(:, piece%node(1, :))
            l = norm2(edge, 1)
            do i = 1, 2
               tangent(:, i) = (l(i + 1)/l(i)*edge(:, i) + l(i)/l(i + 1)*edge(:, i + 1)) &
                  /(l(i) + l(i + 1))
            end do
            offset = share*(1.0_wp - share)*l(2)*((1.0_wp - share)*tangent(:, 1) &
               - share*tangent(:, 2)) + share*(1.0_wp - share)*(2.0_wp*share - 1.0_wp)*edge(:, 2)
            ! To the right of the edge is in front of it: a hollow lies to the left.
            call check_near(error, outline_curves_overlap(curves, e, e, [share, share], scene%x, &
               still), 2.0_wp*(edge(1, 2)*offset(2) - edge(2, 2)*offset(1))/l(2), tol, l(2), &
               "edge " // to_text(e))
         end associate
      end do
      call check_equal(error, n_seen, 18, "edges within")
      ! A pair with options of its own is smoothed as these say, or not at all.
      scene%pair%has_options = .true.
      call outline_curves_init(curves, outline, links, scene, options)
      call check_true(error, all(curves%number == 0), "not by its own options")
      scene%pair%options%smoothing = smoothing_hermite
      call outline_curves_init(curves, outline, links, scene, contact_options_t())
      call check_equal(error, count(curves%number > 0), 20, "by its own options alone")
   end subroutine test_cubics

   !> The inside of a sleeve and the outside of a hub of one radius: a hollow edge lies behind its
   !> chord at its place, and rests on a round one by the smaller of both sagittas, but for the
   !> square of the angle of an edge.
   subroutine test_hollow(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: radius = 2.0_wp, share(2) = [0.3_wp, 0.1_wp]
      integer, parameter :: n(2, 2) = reshape([8, 20, 20, 8], [2, 2])
      type(scene_t) :: scene
      type(outline_t) :: outline
      type(outline_links_t) :: links
      type(outline_curves_t) :: curves
      real(wp), allocatable :: still(:, :)
      real(wp) :: sagitta(2)
      integer :: e(2), i, k, turn

      do k = 1, 2
         call make_rings(scene, n(:, k), 0.0_wp, .false.)
         call outline_init(outline, links, scene)
         call outline_curves_init(curves, outline, links, scene, contact_options_t())
         still = 0.0_wp*scene%x
         e = [edge_at(2, n(2, k)), edge_at(1, n(1, k))]
         do i = 1, 2
            associate (node => outline%facet(:, e(i)))
               sagitta(i) = norm2(scene%x(:, node(2)) - scene%x(:, node(1)))**2/(8.0_wp*radius)
            end associate
         end do
         do turn = 1, 2
            call check_near(error, outline_curves_overlap(curves, e(turn), e(3 - turn), &
               share([turn, &
               3 - turn]), scene%x, still), 4.0_wp*share(1)*(1.0_wp - share(1))*sagitta(1) &
               + minval(sagitta), 0.03_wp, sagitta(1) + minval(sagitta), "rings " // to_text(k))
         end do
      end do

   contains

      !> The edge in the middle of those of piece `p` that lie at the radius of both.
      integer function edge_at(p, n) result(found)
         integer, intent(in) :: p, n
         integer :: f, n_found

         n_found = 0
         found = 0
         do f = outline%start(p), outline%start(p + 1) - 1
            associate (a => outline%facet(1, f), b => outline%facet(2, f))
               if (max(abs(norm2(scene%x(:, a)) - radius), abs(norm2(scene%x(:, b)) - radius)) &
                  > tol) cycle
            end associate
            n_found = n_found + 1
            if (n_found == n/2) found = f
         end do
      end function edge_at

   end subroutine test_hollow

   !> An L of three cells of 2 x 2, anyhow turned: nodes along the sides as far as they are
   !> straight.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(outline_t) :: outline
      type(outline_links_t) :: links
      type(outline_curves_t) :: curves
      integer :: e, i, f, k, at
      real(wp) :: turn

      do k = 0, 7
         call make_block(scene, "CPE4", [4, 4], block)
         associate (kept => [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 13, 14])
            scene%element%node = scene%element%node(:, kept)
            scene%element%kind = scene%element%kind(kept)
            scene%element%section = scene%element%section(kept)
         end associate
         call add_surface(scene, "SELF", block_t(kind=block%kind, n=[1, 1]), [bottom])
         scene%pair = [contact_pair_t(slave=1, master=1)]
         turn = 0.7_wp*k
         scene%x = matmul(reshape([cos(turn), sin(turn), -sin(turn), cos(turn)], [2, 2]), scene%x)
         call outline_init(outline, links, scene)
         call outline_curves_init(curves, outline, links, scene, &
            contact_options_t(smoothing_angle=20.0_wp))
         call check_equal(error, size(outline%facet, 2), 16, "edges")
         if (allocated(error)) return
         do e = 1, size(outline%facet, 2)
            call check_true(error, all(curves%row(1:2, e) == outline%facet(:, e)), "its own nodes")
            do i = 1, 2
               f = e
               do at = 1, 2
                  if (f > 0) then
                     if (is_straight(f, links%link(i, f))) then
                        f = links%link(i, f)
                     else
                        f = 0
                     end if
                  end if
                  associate (node => curves%row(merge(1 - at, 2 + at, i == 1), e))
                     if (f == 0) call check_equal(error, node, 0, "beyond a corner")
                     if (f > 0) call check_equal(error, node, outline%facet(i, f), "along a side")
                  end associate
               end do
            end do
         end do
      end do

   contains

      pure logical function is_straight(a, b)
         integer, intent(in) :: a, b

         associate (x => scene%x, one => outline%facet(:, a), other => outline%facet(:, b))
            is_straight = abs(dot_product(x(:, one(2)) - x(:, one(1)), x(:, other(2)) &
               - x(:, other(1)))) > 0.5_wp
         end associate
      end function is_straight

   end subroutine test_corners

end module test_outline
