!> What is wrong with the surfaces of a tie, in words.
module emcon_tie_check_plane
   use emcon_chain_plane, only : chain_t
   use emcon_couplings, only : tie_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted
   use emcon_text, only : joined, string_t, to_text
   use emcon_tie_partner_plane, only : default_tolerance, tie_partners_t
   use emcon_tie_text, only : most_named, raise_shared, tie_text, tolerance_text
   implicit none
   private
   public :: tie_check_surfaces, tie_check_partners

   !> Nodes whose distance is measured for a message.
   integer, parameter :: most_measured = 10000
   character(len=*), parameter :: advice = "swap slave and master, leave the faces without " // &
      "partner out of the slave surface, or raise POSITION TOLERANCE"
   character(len=*), parameter :: default_text = "a tenth of the longer of two facing edges"

contains

   !> Both surfaces have edges, and no node in common.
   pure subroutine tie_check_surfaces(scene, tie, partners, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_partners_t), intent(in) :: partners
      type(error_t), allocatable, intent(out) :: error

      call raise_shared(scene, tie, [partners%slave%n_facet, partners%master%n_facet], &
         partners%slave%node, partners%master%node, error)
   end subroutine tie_check_surfaces

   !> Every slave node has a partner within the tolerance, and the master surface has no holes.
   pure subroutine tie_check_partners(scene, tie, partners, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_partners_t), intent(in) :: partners
      type(error_t), allocatable, intent(out) :: error

      if (.not. all(partners%has_partner)) then
         call raise_nodes(scene, tie, partners, error)
      else if (any(partners%hole > 0.0_wp)) then
         call raise_holes(scene, tie, partners, error)
      end if
   end subroutine tie_check_partners

   !> Name the slave nodes without partner, with their distances.
   pure subroutine raise_nodes(scene, tie, partners, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_partners_t), intent(in) :: partners
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: found(count(.not. partners%has_partner))
      real(wp) :: distance(size(found))
      integer :: lonely(size(found)), edge(size(found)), i, n
      character(len=:), allocatable :: text

      associate (node => partners%slave%node)
         lonely = pack(node, .not. partners%has_partner)
         lonely = spread_out(lonely)
         n = min(size(lonely), most_measured)
         call find_nearest(partners%master, scene%x, lonely(:n), distance(:n), edge(:n))
         i = minloc(distance(:n), 1)
         if (size(lonely) == size(node) .and. .not. any_near(partners, lonely(:n), distance(:n), &
            edge(:n))) then
            call raise_apart(scene, tie, partners, lonely(i), distance(i), error)
            return
         end if
         do i = 1, min(n, most_named)
            found(i)%text = to_text(scene%node%label(lonely(i))) // " (" // &
               to_text(distance(i)) // ")"
         end do
         text = tie_text(scene, tie) // to_text(size(lonely)) // " of " // to_text(size(node)) // &
            " nodes of slave surface " // scene%surface(tie%slave)%name // &
            " have no partner on master surface " // scene%surface(tie%master)%name // &
            " within the position tolerance (" // trim(tolerance_text(tie, default_text)) // &
            "), from " // to_text(minval(distance(:n))) // " to " // &
            to_text(maxval(distance(:n))) // &
            " off; node (distance): " // joined(found, ", ", most_named) // "; " // advice
         if (any_near(partners, lonely(:n), distance(:n), edge(:n))) text = text // &
            ". Nodes that are near lie past an end of the master, or faces do not face each " &
            // "other: check the face labels"
      end associate
      call raise(error, err_input, text)
   end subroutine raise_nodes

   !> Is one of the slave nodes `node` within the tolerance of the master edge nearest to it?
   pure logical function any_near(partners, node, distance, edge)
      type(tie_partners_t), intent(in) :: partners
      integer, intent(in) :: node(:)
      real(wp), intent(in) :: distance(:)        !! (size of `node`) [L]
      integer, intent(in) :: edge(:)             !! the same; master edge
      real(wp) :: longer, tolerance
      integer :: i, side

      any_near = .false.
      do i = 1, size(node)
         longer = partners%master%size(edge(i))
         associate (slave => partners%slave)
            associate (beside => slave%node_edge(:, find_sorted(slave%node, node(i))))
               do side = 1, 2
                  if (beside(side) > 0) longer = max(longer, slave%size(beside(side)))
               end do
            end associate
         end associate
         tolerance = partners%tolerance
         if (tolerance < 0.0_wp) tolerance = default_tolerance*longer
         if (distance(i) <= tolerance) any_near = .true.
      end do
   end function any_near

   !> Tell how far the surfaces are apart; `node` of the slave is `distance` from the master.
   pure subroutine raise_apart(scene, tie, partners, node, distance, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_partners_t), intent(in) :: partners
      integer, intent(in) :: node
      real(wp), intent(in) :: distance           !! [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: measured(size(partners%master%node)), edge(size(measured)), n, k, nearest
      real(wp) :: from_master(size(measured)), least

      measured = spread_out(partners%master%node)
      n = min(size(measured), most_measured)
      call find_nearest(partners%slave, scene%x, measured(:n), from_master(:n), edge(:n))
      k = minloc(from_master(:n), 1)
      least = min(distance, from_master(k))
      nearest = merge(measured(k), node, from_master(k) < distance)
      call raise(error, err_input, tie_text(scene, tie) // "slave surface " // &
         scene%surface(tie%slave)%name // " and master surface " // &
         scene%surface(tie%master)%name // ": the surfaces do not meet: the nearest points " // &
         "are " // to_text(least) // " apart (node " // to_text(scene%node%label(nearest)) // &
         "), the position tolerance is " // trim(tolerance_text(tie, default_text)) // &
         "; move a body, or raise POSITION TOLERANCE")
   end subroutine raise_apart

   !> Name the slave edges that no master edge faces over a part of their length.
   pure subroutine raise_holes(scene, tie, partners, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_partners_t), intent(in) :: partners
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: found(count(partners%hole > 0.0_wp))
      integer :: e, n

      n = 0
      associate (slave => partners%slave)
         do e = 1, slave%n_facet
            if (.not. partners%hole(e) > 0.0_wp) cycle
            n = n + 1
            found(n)%text = to_text(scene%node%label(slave%facet(1, e))) // "-" // &
               to_text(scene%node%label(slave%facet(2, e))) // " (" // &
               to_text(partners%hole(e)) // ")"
         end do
      end associate
      call raise(error, err_input, tie_text(scene, tie) // to_text(n) // " of " // &
         to_text(size(partners%hole)) // " faces of slave surface " // &
         scene%surface(tie%slave)%name // " lie over a hole in master surface " // &
         scene%surface(tie%master)%name // " longer than the position " // &
         "tolerance (" // trim(tolerance_text(tie, default_text)) // &
         "); nodes of the face (length): " // joined(found, ", ", most_named) // "; " // advice)
   end subroutine raise_holes

   !> The same list, but of a long one the first `most_measured` entries are spread over all of it,
   !> after those that are named.
   pure function spread_out(list) result(order)
      integer, intent(in) :: list(:)
      integer :: order(size(list))
      integer :: i, n

      order = list
      n = size(list)
      if (n <= most_measured) return
      do i = most_named + 1, most_measured
         order(i) = list(i + nint(real(n - most_measured, wp)*real(i - most_named, wp) &
            /real(most_measured - most_named, wp)))
      end do
   end function spread_out

   !> The edge of `chain` nearest to each node, wherever it looks, and its distance.
   !>
   !> Edges stand in blocks along the chain, as many as edges in a block: unlike a search with a
   !> reach, this is fast far from the surface too.
   pure subroutine find_nearest(chain, x, node, distance, edge)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in), contiguous :: x(:, :)    !! (2, n_node of the scene) [L]
      integer, intent(in) :: node(:)
      real(wp), intent(out) :: distance(:)           !! (size of `node`) [L]
      integer, intent(out) :: edge(:)                !! (size of `node`)
      integer :: edge_at(chain%n_facet), n_block, i, k
      integer, allocatable :: start(:)
      real(wp), allocatable :: low(:, :), high(:, :), bound(:)

      do i = 1, chain%n_facet
         edge_at(chain%place(i)) = i
      end do
      n_block = ceiling(sqrt(real(chain%n_facet, wp)))
      allocate(start(n_block + 1), low(2, n_block), high(2, n_block), bound(n_block))
      do k = 1, n_block + 1
         start(k) = 1 + nint(real(k - 1, wp)*real(chain%n_facet, wp)/real(n_block, wp))
      end do
      do k = 1, n_block
         low(:, k) = huge(low)
         high(:, k) = -huge(high)
         do i = start(k), start(k + 1) - 1
            associate (ends => x(:, chain%facet(:, edge_at(i))))
               low(:, k) = min(low(:, k), minval(ends, 2))
               high(:, k) = max(high(:, k), maxval(ends, 2))
            end associate
         end do
      end do
      do i = 1, size(node)
         associate (y => x(:, node(i)))
            do k = 1, n_block
               bound(k) = norm2(max(0.0_wp, low(:, k) - y, y - high(:, k)))
            end do
            k = minloc(bound, 1)
            distance(i) = huge(distance)
            edge(i) = 1
            call come_nearer(chain, edge_at(start(k):start(k + 1) - 1), x, y, distance(i), edge(i))
            do k = 1, n_block
               if (bound(k) < distance(i)) call come_nearer(chain, &
                  edge_at(start(k):start(k + 1) - 1), x, y, distance(i), edge(i))
            end do
         end associate
      end do
   end subroutine find_nearest

   !> Take the edge of `candidates` nearest to `y` if it is nearer than `distance`.
   pure subroutine come_nearer(chain, candidates, x, y, distance, edge)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: candidates(:)
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), intent(in) :: y(2)
      real(wp), intent(inout) :: distance        !! [L]
      integer, intent(inout) :: edge
      real(wp) :: a(2), b(2), eta, this
      integer :: i

      do i = 1, size(candidates)
         associate (ends => chain%facet(:, candidates(i)))
            a = x(:, ends(2)) - x(:, ends(1))
            b = y - x(:, ends(1))
         end associate
         eta = max(0.0_wp, min(1.0_wp, dot_product(a, b)/dot_product(a, a)))
         this = norm2(b - eta*a)
         if (this >= distance) cycle
         distance = this
         edge = candidates(i)
      end do
   end subroutine come_nearer

end module emcon_tie_check_plane
