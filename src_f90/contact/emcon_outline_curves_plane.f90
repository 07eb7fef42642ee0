!> The curves that edges of outlines stand for where masters of contact pairs are smoothed: how far
!> they lie inside the body, behind the edge.
!>
!> Source: docs/theory.md, sections 4.3 and 4.11.
module emcon_outline_curves_plane
   use emcon_chain, only : chain_corners, chain_init, chain_t
   use emcon_errors, only : error_t
   use emcon_hermite, only : hermite_curve, hermite_point, hermite_point_t, hermite_stencil_t, &
      joined_pieces
   use emcon_interactions, only : contact_options_t, formulation_segment, smoothing_hermite
   use emcon_joints, only : chain_join
   use emcon_kinds, only : wp
   use emcon_outline_plane, only : outline_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: outline_curves_t, outline_curves_init, outline_curves_behind

   !> An edge and what its curve is joined to.
   type :: piece_t
      integer :: node(2, -1:1) = 0               !! of the edge before, itself, after; 0: not joined
      real(wp) :: length(-1:1) = 1.0_wp          !! reference lengths [L]
   end type piece_t

   type :: outline_curves_t
      logical :: is_on = .false.                 !! is there any curve?
      integer, allocatable :: number(:)          !! (n_edge) of its piece; 0: the edge is straight
      type(piece_t), allocatable :: piece(:)
   end type outline_curves_t

contains

   !> The curves of `outline` in a step with the options `options`, where pairs have none of their
   !> own.
   subroutine outline_curves_init(self, outline, scene, options)
      type(outline_curves_t), intent(out) :: self
      type(outline_t), intent(in) :: outline
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options
      type(contact_options_t) :: chosen
      integer :: i

      allocate(self%number(size(outline%edge, 2)), source=0)
      allocate(self%piece(0))
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            chosen = options
            if (pair%has_options) chosen = pair%options
            if (pair%formulation == formulation_segment .or. pair%slack > 0.0_wp) cycle
            if (chosen%smoothing == smoothing_hermite) call add_surface(self, outline, scene, &
               pair%master, chosen%smoothing_angle)
         end associate
      end do
      self%is_on = size(self%piece) > 0
   end subroutine outline_curves_init

   !> Add the edges of surface `number` that have no curve yet.
   subroutine add_surface(self, outline, scene, number, angle)
      type(outline_curves_t), intent(inout) :: self
      type(outline_t), intent(in) :: outline
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number              !! of the surface
      real(wp), intent(in) :: angle              !! sharper turns are corners [degrees]
      type(chain_t) :: chain
      type(error_t), allocatable :: error
      logical, allocatable :: is_corner(:)
      integer :: begins(size(scene%x, 2)), e, k

      call chain_init(chain, scene, scene%surface(number), error)
      if (allocated(error)) return
      call chain_join(chain, scene)
      allocate(is_corner(chain%n_edge))
      call chain_corners(chain, scene%x, angle, is_corner)
      begins = 0
      begins(chain%edge(1, :)) = [(k, k = 1, chain%n_edge)]
      do e = 1, size(outline%edge, 2)
         k = begins(outline%edge(1, e))
         if (k == 0 .or. self%number(e) > 0) cycle
         if (chain%edge(2, k) /= outline%edge(2, e)) cycle
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
      if (.not. is_corner(k)) call take(chain%previous(k), -1)
      if (chain%next(k) == 0) return
      if (.not. is_corner(chain%next(k))) call take(chain%next(k), 1)

   contains

      pure subroutine take(edge, i)
         integer, intent(in) :: edge, i

         piece%node(:, i) = chain%edge(:, edge)
         piece%length(i) = chain%length(edge)
      end subroutine take

   end function piece_of

   !> How far the curve lies behind its edge, 0 in front of it or where there is none [L].
   pure real(wp) function outline_curves_behind(self, e, share, x, u) result(behind)
      type(outline_curves_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge of the outline
      real(wp), intent(in) :: share              !! place along it, 0 to 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      type(hermite_stencil_t) :: stencil
      type(hermite_point_t) :: point
      real(wp) :: edge(2, 5), rise(2)
      integer :: i

      behind = 0.0_wp
      if (.not. self%is_on) return
      if (self%number(e) == 0) return
      edge = 0.0_wp
      associate (piece => self%piece(self%number(e)))
         stencil%node(3:4) = piece%node(:, 0)
         stencil%node(2) = piece%node(1, -1)
         stencil%node(5) = piece%node(2, 1)
         stencil%length(2:4) = piece%length
         do i = -1, 1
            associate (a => piece%node(1, i), b => piece%node(2, i))
               if (a > 0) edge(:, 3 + i) = (x(:, b) - x(:, a)) + (u(:, b) - u(:, a))
            end associate
         end do
      end associate
      point = hermite_point(hermite_curve(stencil, joined_pieces), edge, share)
      rise = point%y - share*edge(:, 3)
      behind = max(0.0_wp, (edge(1, 3)*rise(2) - edge(2, 3)*rise(1)) &
         /sqrt(dot_product(edge(:, 3), edge(:, 3))))
   end function outline_curves_behind

end module emcon_outline_curves_plane
