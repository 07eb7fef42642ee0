!> The curves that edges of outlines stand for: what polygons may overlap by where curves do not.
!>
!> Those of smoothed masters of contact pairs and the circles of rigid ones are what gaps are
!> measured to; other edges are chords of arcs.
!> Source: docs/theory.md, sections 4.3 and 4.11.
module emcon_outline_curves_plane
   use emcon_arcs_plane, only : arc_curvature, arc_rise
   use emcon_chain_plane, only : chain_corners, chain_init, chain_t, next, previous
   use emcon_circles_plane, only : circles_find, circles_t
   use emcon_errors, only : error_t
   use emcon_hermite, only : hermite_curve, hermite_point, hermite_point_t, hermite_stencil_t, &
      joined_pieces
   use emcon_interactions, only : contact_options_t, formulation_segment, &
      smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_outline, only : outline_t
   use emcon_outline_plane, only : outline_links_t
   use emcon_rigid_bodies, only : rigid_numbers
   use emcon_scene, only : scene_t
   use emcon_seams_plane, only : chain_join
   implicit none
   private
   public :: outline_curves_t, outline_curves_init, outline_curves_overlap

   !> An edge and what its curve is joined to.
   type :: piece_t
      integer :: node(2, -1:1) = 0               !! of the edge before, itself, after; 0: not joined
      real(wp) :: length(-1:1) = 1.0_wp          !! reference lengths [L]
   end type piece_t

   type :: outline_curves_t
      integer, allocatable :: number(:)          !! (n_edge) of its smoothed piece; 0: an arc
      type(piece_t), allocatable :: piece(:)
      real(wp), allocatable :: circle(:)         !! (n_edge) curvature of its circle; 0: none [1/L]
      !> (-1:4, n_edge) nodes along the outline, those of the edge at 1 and 2; 0 beyond a corner
      integer, allocatable :: row(:, :)
   end type outline_curves_t

contains

   !> The curves of `outline` in a step with the options `options`, where pairs have none of their
   !> own.
   subroutine outline_curves_init(self, outline, links, scene, options)
      type(outline_curves_t), intent(out) :: self
      type(outline_t), intent(in) :: outline
      type(outline_links_t), intent(in) :: links     !! of it
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options
      type(contact_options_t) :: chosen
      integer :: i

      allocate(self%number(size(outline%facet, 2)), source=0)
      allocate(self%piece(0))
      allocate(self%circle(size(outline%facet, 2)), source=0.0_wp)
      do i = 1, merge(size(scene%pair), 0, outline%n_piece > 0)
         associate (pair => scene%pair(i))
            chosen = options
            if (pair%has_options) chosen = pair%options
            if (pair%slack > 0.0_wp) cycle
            if (pair%formulation == formulation_segment) chosen%smoothing = smoothing_none
            call add_surface(self, outline, scene, pair%master, chosen)
         end associate
      end do
      call find_rows(self, outline, links, scene, options%smoothing_angle)
   end subroutine outline_curves_init

   !> The nodes that tell the arcs.
   subroutine find_rows(self, outline, links, scene, angle)
      type(outline_curves_t), intent(inout) :: self
      type(outline_t), intent(in) :: outline
      type(outline_links_t), intent(in) :: links
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: angle              !! sharper turns are corners [degrees]
      integer :: beside(-2:2), e, i

      allocate(self%row(-1:4, size(outline%facet, 2)), source=0)
      do e = 1, size(outline%facet, 2)
         beside = 0
         beside(0) = e
         do i = 1, 2
            if (beside(1 - i) > 0) then
               beside(-i) = links%link(1, beside(1 - i))
               if (turns(beside(-i), beside(1 - i))) beside(-i) = 0
            end if
            if (beside(i - 1) > 0) then
               beside(i) = links%link(2, beside(i - 1))
               if (turns(beside(i - 1), beside(i))) beside(i) = 0
            end if
         end do
         do i = -2, 2
            if (beside(i) > 0) self%row(i + 1:i + 2, e) = outline%facet(:, beside(i))
         end do
      end do

   contains

      !> Is there a corner between edge `a` and the next one, `b`?
      pure logical function turns(a, b)
         integer, intent(in) :: a, b             !! 0: none
         real(wp) :: one(2), other(2)

         turns = a == 0 .or. b == 0
         if (turns) return
         one = scene%x(:, outline%facet(2, a)) - scene%x(:, outline%facet(1, a))
         other = scene%x(:, outline%facet(2, b)) - scene%x(:, outline%facet(1, b))
         turns = atan2(abs(one(1)*other(2) - one(2)*other(1)), dot_product(one, other)) &
            > angle*acos(-1.0_wp)/180.0_wp
      end function turns

   end subroutine find_rows

   !> Add the edges of surface `number` that have no curve yet.
   subroutine add_surface(self, outline, scene, number, options)
      type(outline_curves_t), intent(inout) :: self
      type(outline_t), intent(in) :: outline
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number              !! of the surface
      type(contact_options_t), intent(in) :: options   !! of a pair that has it as its master
      type(chain_t) :: chain
      type(circles_t) :: circles
      type(error_t), allocatable :: error
      logical, allocatable :: is_corner(:)
      integer :: begins(size(scene%x, 2)), e, k

      call chain_init(chain, scene, scene%surface(number), error)
      if (allocated(error)) return
      call chain_join(chain, scene)
      call circles_find(circles, chain, scene%x, rigid_numbers(scene%rigid, size(scene%x, 2)))
      allocate(is_corner(chain%n_facet))
      call chain_corners(chain, scene%x, options%smoothing_angle, is_corner)
      begins = 0
      begins(chain%facet(1, :)) = [(k, k = 1, chain%n_facet)]
      do e = 1, size(outline%facet, 2)
         k = begins(outline%facet(1, e))
         if (k == 0 .or. self%number(e) > 0) cycle
         if (chain%facet(2, k) /= outline%facet(2, e)) cycle
         self%circle(e) = circles%curvature(k)
         if (options%smoothing /= smoothing_hermite) cycle
         self%piece = [self%piece, piece_of(chain, is_corner, k)]
         self%number(e) = size(self%piece)
      end do
   end subroutine add_surface

   !> Edge `k` of a chain and those that it is smoothly joined to.
   pure type(piece_t) function piece_of(chain, is_corner, k) result(piece)
      type(chain_t), intent(in) :: chain
      logical, intent(in) :: is_corner(:)        !! (n_edge) at the first node of each
      integer, intent(in) :: k

      call take(k, 0)
      if (.not. is_corner(k)) call take(chain%neighbour(previous, k), -1)
      if (chain%neighbour(next, k) == 0) return
      if (.not. is_corner(chain%neighbour(next, k))) call take(chain%neighbour(next, k), 1)

   contains

      pure subroutine take(edge, i)
         integer, intent(in) :: edge, i

         piece%node(:, i) = chain%facet(:, edge)
         piece%length(i) = chain%size(edge)
      end subroutine take

   end function piece_of

   !> What two polygons may overlap by where the curves that they stand for do not, at a place of
   !> edge `e` and the place next to it of edge `f`, at parts `share` along them [L].
   !>
   !> A hollow curve lies behind its edges. Where it meets one that is not, its nodes rest on edges
   !> of that: behind their curve, by up to their sagitta. It counts up to that of the hollow edge,
   !> as on a flat one nothing has to overlap.
   pure real(wp) function outline_curves_overlap(self, e, f, share, x, u) result(overlap)
      type(outline_curves_t), intent(in) :: self
      integer, intent(in) :: e, f                !! edges of the outline
      real(wp), intent(in) :: share(2)           !! 0 to 1: along `e`, along `f`
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp) :: here(2), sagitta(2)

      here = [rise(self, e, share(1), x, u), rise(self, f, share(2), x, u)]
      sagitta = [rise(self, e, 0.5_wp, x, u), rise(self, f, 0.5_wp, x, u)]
      overlap = sum(max(0.0_wp, -here))
      overlap = overlap + max(0.0_wp, min(-minval(sagitta), maxval(sagitta)))
   end function outline_curves_overlap

   !> How far the curve lies in front of its edge, < 0 behind it [L].
   pure real(wp) function rise(self, e, share, x, u)
      type(outline_curves_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge of the outline
      real(wp), intent(in) :: share              !! place along it, 0 to 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp) :: chord(2)

      if (abs(self%circle(e)) > 0.0_wp) then
         chord = (x(:, self%row(2, e)) - x(:, self%row(1, e))) &
            + (u(:, self%row(2, e)) - u(:, self%row(1, e)))
         rise = arc_rise(self%circle(e), sqrt(dot_product(chord, chord)), share, 0.0_wp)
      else if (self%number(e) > 0) then
         rise = piece_rise(self%piece(self%number(e)), share, x, u)
      else
         rise = row_rise(self%row(:, e), share, x, u)
      end if
   end function rise

   !> How far the arc lies in front of its edge.
   pure real(wp) function row_rise(row, share, x, u)
      integer, intent(in) :: row(-1:)            !! (-1:4) of nodes
      real(wp), intent(in) :: share              !! 0 to 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp) :: chord(2, -2:2)
      integer :: i

      chord = 0.0_wp
      do i = -2, 2
         associate (a => row(i + 1), b => row(i + 2))
            if (a > 0 .and. b > 0) chord(:, i) = (x(:, b) - x(:, a)) + (u(:, b) - u(:, a))
         end associate
      end do
      row_rise = arc_rise(arc_curvature(chord), sqrt(dot_product(chord(:, 0), chord(:, 0))), &
         share, 0.0_wp)
   end function row_rise

   !> How far the curve of a smoothed edge lies in front of it.
   pure real(wp) function piece_rise(piece, share, x, u)
      type(piece_t), intent(in) :: piece
      real(wp), intent(in) :: share              !! 0 to 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      type(hermite_stencil_t) :: stencil
      type(hermite_point_t) :: point
      real(wp) :: edge(2, 5)
      integer :: i

      edge = 0.0_wp
      stencil%node(3:4) = piece%node(:, 0)
      stencil%node(2) = piece%node(1, -1)
      stencil%node(5) = piece%node(2, 1)
      stencil%length(2:4) = piece%length
      do i = -1, 1
         associate (a => piece%node(1, i), b => piece%node(2, i))
            if (a > 0) edge(:, 3 + i) = (x(:, b) - x(:, a)) + (u(:, b) - u(:, a))
         end associate
      end do
      point = hermite_point(hermite_curve(stencil, joined_pieces), edge, share)
      piece_rise = -(edge(1, 3)*point%y(2) - edge(2, 3)*point%y(1)) &
         /sqrt(dot_product(edge(:, 3), edge(:, 3)))
   end function piece_rise

end module emcon_outline_curves_plane
