!> A crossing of two edges in a step: what it is made of, where its ends are and how they move.
!> Source: docs/theory.md, section 14, after eq. (51).
module emcon_edge_stencil_space
   use emcon_condition_nodes, only : nodes_append
   use emcon_edge_pair_space, only : n_edge_pair_node
   use emcon_element_kind, only : max_face_nodes
   use emcon_kinds, only : wp
   use emcon_outline_edges_space, only : outline_edges_place, outline_edges_t
   implicit none
   private
   public :: edge_ends_t, edge_stencil_t
   public :: edge_stencil_ends, edge_stencil_motion, edge_stencil_place

   !> Two nodes of an edge between nodes, and those of one with a centre at its end.
   integer, parameter :: most_nodes = 2 + max_face_nodes

   !> The crossing of two edges in a step.
   type :: edge_stencil_t
      integer :: edge = 0                        !! a side of faces
      integer :: master = 0                      !! edge that it crosses; 0: none
      real(wp) :: side = 1.0_wp                  !! 1 or -1: heights are gaps
      real(wp) :: height = 0.0_wp                !! gap as the step begins, without an offset [L]
      real(wp) :: beyond = 0.0_wp                !! so far past its ends, by their lengths, >= 0
   end type edge_stencil_t

   !> The nodes that the four ends of a stencil are made of.
   type :: edge_ends_t
      integer :: n = 0
      integer :: n_slave = 0                     !! nodes 1..n_slave are of the pair's slave
      integer :: node(most_nodes) = 0            !! (n) of the scene
      integer :: place(most_nodes) = 0           !! (n) the first end's, then the others' in `node`
      real(wp) :: weight(most_nodes, n_edge_pair_node) = 0.0_wp  !! (n - 1) of others, in ends
   end type edge_ends_t

contains

   !> Where the ends of the edges of a stencil are, from the first one.
   pure subroutine edge_stencil_place(edges, stencil, x, u, at)
      type(outline_edges_t), intent(in) :: edges
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: at(:, :)          !! (3, 4) [L]
      integer :: k

      associate (point => points_of(edges, stencil))
         do k = 1, n_edge_pair_node
            at(:, k) = outline_edges_place(edges, point(k), edges%node(1, point(1)), x, u)
         end do
      end associate
   end subroutine edge_stencil_place

   !> How the ends move in the step, from the first of them on.
   pure subroutine edge_stencil_motion(edges, stencil, du, way)
      type(outline_edges_t), intent(in) :: edges
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: du(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: way(:, :)         !! (3, 4) [L]
      real(wp) :: motion(3)
      integer :: j, k

      way = 0.0_wp
      associate (point => points_of(edges, stencil))
         do k = 2, n_edge_pair_node
            do j = 1, size(edges%node, 1)
               if (edges%node(j, point(k)) == 0) exit
               motion = du(:, edges%node(j, point(k))) - du(:, edges%node(1, point(1)))
               way(:, k) = way(:, k) + edges%weight(j, point(k))*motion
            end do
         end do
      end associate
   end subroutine edge_stencil_motion

   !> The nodes that the ends of a stencil are made of. Those of the surface that the pair names as
   !> its slave come first.
   pure function edge_stencil_ends(edges, stencil) result(ends)
      type(outline_edges_t), intent(in) :: edges
      type(edge_stencil_t), intent(in) :: stencil
      type(edge_ends_t) :: ends
      integer :: i, j, k, point(n_edge_pair_node), order(n_edge_pair_node)

      point = points_of(edges, stencil)
      order = cshift([1, 2, 3, 4], merge(2, 0, edges%surface(stencil%edge) == 2))
      do k = 1, n_edge_pair_node
         call nodes_append(edges%node(:, point(order(k))), ends%node, ends%n)
         if (k == 2) ends%n_slave = ends%n
      end do
      associate (base => findloc(ends%node(:ends%n), edges%node(1, point(1)), 1))
         ends%place(:ends%n) = [base, (i, i = 1, base - 1), (i, i = base + 1, ends%n)]
      end associate
      do k = 1, n_edge_pair_node
         do i = 2, ends%n
            j = findloc(edges%node(:, point(k)), ends%node(ends%place(i)), 1)
            if (j > 0) ends%weight(i - 1, k) = edges%weight(j, point(k))
         end do
      end do
   end function edge_stencil_ends

   !> The ends of the edges of a stencil.
   pure function points_of(edges, stencil) result(point)
      type(outline_edges_t), intent(in) :: edges
      type(edge_stencil_t), intent(in) :: stencil
      integer :: point(n_edge_pair_node)

      point(:2) = edges%ends(:, stencil%edge)
      point(3:) = edges%ends(:, stencil%master)
   end function points_of

end module emcon_edge_stencil_space
