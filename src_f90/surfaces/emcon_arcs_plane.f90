!> The arcs that edges of a surface stand for: an edge is a chord of the curve that was meshed.
!>
!> At each node the circle through it and its two neighbours has the curvature there. An edge has
!> the harmonic mean of those at its ends, none where one of them is straight or they bend to
!> different sides. Source: docs/theory.md, section 6.6.
module emcon_arcs_plane
   use emcon_chain_plane, only : chain_corners, chain_t, next, previous
   use emcon_kinds, only : wp
   implicit none
   private
   public :: arc_curvature, arc_height, arc_rise, arcs_find

contains

   !> Curvature of the arc of an edge, > 0 where it bulges out of the body, 0 if it has none [1/L].
   !> At a corner or an end the node after next takes the place of the one that is not there.
   pure real(wp) function arc_curvature(chord) result(curvature)
      !> (2, -2:2) from node to node along the surface, the edge itself at 0; 0 beyond a corner or
      !> an end [L]
      real(wp), intent(in) :: chord(2, -2:2)
      real(wp) :: at(-1:2), one, other

      at = [turn(-1), turn(0), turn(1), turn(2)]
      one = at(0)
      other = at(1)
      if (.not. goes_on(-1)) one = at(2)
      if (.not. goes_on(1)) other = at(-1)
      curvature = 0.0_wp
      if ((one > 0.0_wp .and. other > 0.0_wp) .or. (one < 0.0_wp .and. other < 0.0_wp)) then
         curvature = 2.0_wp/(1.0_wp/one + 1.0_wp/other)
      end if

   contains

      pure logical function goes_on(i)
         integer, intent(in) :: i

         goes_on = any(abs(chord(:, i)) > 0.0_wp)
      end function goes_on

      !> Curvature at the node before edge `i`, 0 if an edge is missing there.
      pure real(wp) function turn(i)
         integer, intent(in) :: i

         turn = 0.0_wp
         if (.not. (goes_on(i - 1) .and. goes_on(i))) return
         associate (a => chord(:, i - 1), b => chord(:, i))
            turn = 2.0_wp*(a(1)*b(2) - a(2)*b(1)) &
               /sqrt(dot_product(a, a)*dot_product(b, b)*dot_product(a + b, a + b))
         end associate
      end function turn

   end function arc_curvature

   !> From an edge to its arc along a ray, > 0 out of the body [L]: the root of the equation of the
   !> circle that is 0 on a straight edge. Source: docs/theory.md, eq. (20g).
   elemental real(wp) function arc_rise(curvature, length, share, lean) result(rise)
      real(wp), intent(in) :: curvature          !! [1/L]
      real(wp), intent(in) :: length             !! of the edge [L]
      real(wp), intent(in) :: share              !! where the ray starts, from 0 to 1 along the edge
      real(wp), intent(in) :: lean               !! sine of its angle with the normal, > 0 forwards
      real(wp) :: inner, half, along

      inner = max(0.0_wp, min(1.0_wp, share))
      half = curvature*length**2*inner*(1.0_wp - inner)
      along = curvature*length*(inner - 0.5_wp)*lean &
         + sqrt(max(0.0_wp, (1.0_wp - 0.25_wp*(curvature*length)**2)*(1.0_wp - lean**2)))
      rise = half/(along + sqrt(max(epsilon(1.0_wp), along**2 + curvature*half)))
   end function arc_rise

   !> How much higher an arc is than its edge where the ray from its center through a node meets it,
   !> > 0 out of the body [L]. Source: docs/theory.md, eq. (20h).
   elemental real(wp) function arc_height(curvature, length, along, above) result(height)
      real(wp), intent(in) :: curvature          !! [1/L]
      real(wp), intent(in) :: length             !! of the edge [L]
      real(wp), intent(in) :: along, above       !! of the node from the middle of the edge [L]
      real(wp) :: cosine, place, half, ratio

      cosine = sqrt(max(epsilon(1.0_wp), 1.0_wp - 0.25_wp*(curvature*length)**2))
      place = along*(cosine/max(epsilon(1.0_wp), cosine + curvature*above))
      half = curvature*max(0.0_wp, 0.25_wp*length**2 - place**2)
      ratio = sqrt(max(epsilon(1.0_wp), 1.0_wp - curvature*half))
      height = half*cosine/(ratio*(1.0_wp + ratio))
   end function arc_height

   !> The arcs of all edges of a surface in the reference configuration.
   pure subroutine arcs_find(chain, x, angle, curvature)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) [L]
      real(wp), intent(in) :: angle              !! sharper turns are corners [degrees]
      real(wp), intent(out) :: curvature(:)      !! (n_edge) [1/L]
      logical :: is_corner(chain%n_facet)
      real(wp) :: chord(2, -2:2)
      integer :: beside(-2:2), e, i

      call chain_corners(chain, x, angle, is_corner)
      do e = 1, chain%n_facet
         beside = 0
         beside(0) = e
         do i = 1, 2
            beside(-i) = before(beside(1 - i))
            beside(i) = after(beside(i - 1))
         end do
         chord = 0.0_wp
         do i = -2, 2
            if (beside(i) > 0) chord(:, i) = x(:, chain%facet(2, beside(i))) &
               - x(:, chain%facet(1, beside(i)))
         end do
         curvature(e) = arc_curvature(chord)
      end do

   contains

      !> The edge before edge `k` around no corner, 0 if there is none.
      pure integer function before(k)
         integer, intent(in) :: k

         before = 0
         if (k == 0) return
         if (.not. is_corner(k)) before = chain%neighbour(previous, k)
      end function before

      !> The edge after edge `k` around no corner.
      pure integer function after(k)
         integer, intent(in) :: k

         after = 0
         if (k > 0) after = chain%neighbour(next, k)
         if (after == 0) return
         if (is_corner(after)) after = 0
      end function after

   end subroutine arcs_find

end module emcon_arcs_plane
