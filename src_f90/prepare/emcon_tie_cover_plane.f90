!> What the slave surface of a tie covers of its master surface, which may be larger.
!>
!> Master edges that are covered as a whole touch nothing any more; where the slave surface ends on
!> an edge the rest of that is free. Source: docs/theory.md, section 10.1.
module emcon_tie_cover_plane
   use emcon_couplings, only : tie_rows_t
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : frame_hit, frame_t
   use emcon_tie_partner_plane, only : polygon, tie_partners_frame, tie_partners_t
   implicit none
   private
   public :: tie_cover_find

   !> A free part at the end of an edge is bridged by a joint of the outlines up to this fraction
   !> of it, or up to the position tolerance (`emcon_seams_plane`); a slave that reaches less far
   !> over a node ends there.
   real(wp), parameter :: near = 0.1_wp
   !> Nothing is left free within this fraction of an edge: far above the rounding of coordinates.
   real(wp), parameter :: rounding = 1.0e-3_wp

contains

   !> Fill in what `rows` says of the cover, from the segments of `partners`.
   pure subroutine tie_cover_find(partners, x, rows)
      type(tie_partners_t), intent(in) :: partners
      real(wp), intent(in), contiguous :: x(:, :)            !! (2, n_node of the scene) [L]
      type(tie_rows_t), intent(inout) :: rows
      real(wp), allocatable :: share(:), reach(:, :)
      logical, allocatable :: is_covered(:)
      integer :: m

      call measure(partners, x, share, reach)
      associate (n => partners%master%n_facet)
         allocate(is_covered(n))
         do m = 1, n
            is_covered(m) = leaves_nothing(partners, m, share(m), reach(:, m))
         end do
         if (allocated(rows%covered)) deallocate(rows%covered)
         allocate(rows%covered(size(partners%master%facet, 1), count(is_covered)))
         rows%covered = partners%master%facet(:, pack([(m, m = 1, n)], is_covered))
      end associate
      call find_buried(partners, share, reach, rows%buried)
      call find_ends(partners, rows%ending)
   end subroutine tie_cover_find

   !> So much of each master edge is covered, and from where to where: 0 at its first node, 1 at its
   !> last one.
   pure subroutine measure(partners, x, share, reach)
      type(tie_partners_t), intent(in) :: partners
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), allocatable, intent(out) :: share(:)         !! (n_edge of the master) 0..1
      real(wp), allocatable, intent(out) :: reach(:, :)      !! (2, n_edge of the master)
      type(frame_t) :: frame
      real(wp) :: still(size(x, 1), size(x, 2)), eta(2), gap
      integer :: e, k, i

      still = 0.0_wp
      allocate(share(partners%master%n_facet), source=0.0_wp)
      allocate(reach(2, size(share)))
      reach(1, :) = 1.0_wp
      reach(2, :) = 0.0_wp
      do e = 1, partners%slave%n_facet
         do k = partners%start(e), partners%start(e + 1) - 1
            call tie_partners_frame(partners, e, partners%edge(k), x, still, frame)
            do i = 1, 2
               call frame_hit(frame, polygon, partners%ends(i, k), eta(i), gap)
               eta(i) = max(0.0_wp, min(1.0_wp, eta(i)))
            end do
            associate (m => partners%edge(k))
               share(m) = share(m) + abs(eta(2) - eta(1))
               reach(1, m) = min(reach(1, m), minval(eta))
               reach(2, m) = max(reach(2, m), maxval(eta))
            end associate
         end do
      end do
   end subroutine measure

   !> Is nothing left free of master edge `m`, but what a joint bridges?
   pure logical function leaves_nothing(partners, m, share, reach)
      type(tie_partners_t), intent(in) :: partners
      integer, intent(in) :: m
      real(wp), intent(in) :: share, reach(2)
      real(wp) :: bridged

      bridged = near
      associate (length => partners%master%size(m))
         if (partners%tolerance >= 0.0_wp) bridged = max(rounding, &
            min(near, partners%tolerance/length))
      end associate
      leaves_nothing = reach(1) <= bridged .and. 1.0_wp - reach(2) <= bridged &
         .and. reach(2) - reach(1) - share <= rounding
   end function leaves_nothing

   !> Master nodes over which the slave goes on from one edge to the next.
   pure subroutine find_buried(partners, share, reach, buried)
      type(tie_partners_t), intent(in) :: partners
      real(wp), intent(in) :: share(:), reach(:, :)
      integer, allocatable, intent(out) :: buried(:)         !! nodes of the scene
      logical :: is_buried(size(partners%master%node))
      integer :: k

      associate (master => partners%master)
         do k = 1, size(master%node)
            is_buried(k) = all(master%node_edge(:, k) > 0)
            if (.not. is_buried(k)) cycle
            associate (before => master%node_edge(1, k), after => master%node_edge(2, k))
               is_buried(k) = min(share(before), share(after)) > near &
                  .and. 1.0_wp - reach(2, before) <= rounding .and. reach(1, after) <= rounding
            end associate
         end do
         buried = pack(master%node, is_buried)
      end associate
   end subroutine find_buried

   !> The ends of the slave surface, and the master edges they stand on.
   pure subroutine find_ends(partners, ending)
      type(tie_partners_t), intent(in) :: partners
      integer, allocatable, intent(out) :: ending(:, :)      !! (3, n) node, first and last node
      integer :: e, n, side, segment

      associate (slave => partners%slave, master => partners%master)
         allocate(ending(3, count(slave%neighbour == 0)))
         n = 0
         do e = 1, slave%n_facet
            do side = 1, 2
               if (slave%neighbour(side, e) > 0) cycle
               segment = merge(partners%start(e), partners%start(e + 1) - 1, side == 1)
               n = n + 1
               ending(:, n) = [slave%facet(side, e), master%facet(:, partners%edge(segment))]
            end do
         end do
      end associate
   end subroutine find_ends

end module emcon_tie_cover_plane
