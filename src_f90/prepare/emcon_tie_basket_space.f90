!> Which nodes of the slave surface of a tie in space have a multiplier.
!>
!> Source: docs/theory.md, section 10.10.
module emcon_tie_basket_space
   use emcon_facets, only : facets_normal, facets_rim, facets_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: tie_basket_find, tie_basket_release, tie_basket_edges

   !> Places are on one line if a triangle of them has less than this part of the square of its
   !> longest side as its area.
   real(wp), parameter :: thin = 1.0e-3_wp
   !> Facets have an edge between them if the cosine of their turn is less: of 60 degrees.
   real(wp), parameter :: edge = 0.5_wp

contains

   !> Nodes on the rim of the slave surface that take part in another tie too, or that are held in a
   !> direction in which one beside them is not.
   pure subroutine tie_basket_find(slave, n_tie, is_held, is_free)
      type(facets_t), intent(in) :: slave
      integer, intent(in) :: n_tie(:)                    !! (n_node of the scene) ties of each
      logical, intent(in) :: is_held(:, :)               !! (3, n_node of the scene)
      logical, allocatable, intent(out) :: is_free(:)    !! (n_node of the surface)
      logical :: is_rim(size(slave%node))
      integer :: k

      call facets_rim(slave, is_rim)
      allocate(is_free(size(is_rim)))
      do k = 1, size(is_rim)
         is_free(k) = is_rim(k)
         if (is_free(k)) is_free(k) = n_tie(slave%node(k)) > 1 .or. &
            is_held_alone(slave, k, is_held)
      end do
   end subroutine tie_basket_find

   !> Take the multipliers of nodes. A connected part that would keep less than three nodes that are
   !> not on one line, and so could turn about them, keeps what it has.
   pure subroutine tie_basket_release(slave, x, is_free, is_kept)
      type(facets_t), intent(in) :: slave
      real(wp), intent(in) :: x(:, :)                    !! (3, n_node of the scene) [L]
      logical, intent(in) :: is_free(:)                  !! (n_node of the surface) to be taken
      logical, intent(inout) :: is_kept(:)               !! (n_node of the surface)
      logical :: is_part(size(is_free))
      integer :: k, p

      do p = 1, maxval(slave%part)
         is_part = .false.
         do k = 1, slave%n_facet
            if (slave%part(k) == p) is_part(pack(slave%corner(:, k), slave%corner(:, k) > 0)) &
               = .true.
         end do
         if (span_a_plane(x(:, pack(slave%node, is_part .and. is_kept .and. .not. is_free)))) then
            is_kept = is_kept .and. .not. (is_part .and. is_free)
         end if
      end do
   end subroutine tie_basket_release

   !> At which nodes do facets beside each other turn by more than 60 degrees?
   pure subroutine tie_basket_edges(slave, x, is_edge)
      type(facets_t), intent(in) :: slave
      real(wp), intent(in) :: x(:, :)                    !! (3, n_node of the scene) [L]
      logical, intent(out) :: is_edge(:)                 !! (n_node of the surface)
      real(wp) :: normal(3, slave%n_facet), still(size(x, 1), size(x, 2))
      integer :: f, g, k, n

      still = 0.0_wp
      do f = 1, slave%n_facet
         normal(:, f) = facets_normal(slave, f, x, still)
      end do
      is_edge = .false.
      do f = 1, slave%n_facet
         n = count(slave%corner(:, f) > 0)
         do k = 1, n
            g = slave%neighbour(k, f)
            if (g == 0) cycle
            if (dot_product(normal(:, f), normal(:, g)) < edge*norm2(normal(:, f)) &
               *norm2(normal(:, g))) is_edge(slave%corner([k, 1 + mod(k, n)], f)) = .true.
         end do
      end do
   end subroutine tie_basket_edges

   !> Is a node held in a direction in which another one of its facets is not?
   pure logical function is_held_alone(slave, k, is_held)
      type(facets_t), intent(in) :: slave
      integer, intent(in) :: k                           !! node of the surface
      logical, intent(in) :: is_held(:, :)
      integer :: i, m

      is_held_alone = .false.
      do i = slave%around_start(k), slave%around_start(k + 1) - 1
         associate (mates => slave%facet(:, slave%around(i)))
            do m = 1, size(mates)
               if (mates(m) == 0) cycle
               if (any(is_held(:, slave%node(k)) .and. .not. is_held(:, mates(m)))) then
                  is_held_alone = .true.
               end if
            end do
         end associate
      end do
   end function is_held_alone

   !> Are there three places that are not on one line?
   pure logical function span_a_plane(x) result(span)
      real(wp), intent(in) :: x(:, :)                    !! (3, n) [L]
      real(wp) :: along(3), across(3), square
      integer :: i

      span = .false.
      if (size(x, 2) < 3) return
      along = 0.0_wp
      do i = 2, size(x, 2)
         if (norm2(x(:, i) - x(:, 1)) > norm2(along)) along = x(:, i) - x(:, 1)
      end do
      square = dot_product(along, along)
      do i = 2, size(x, 2)
         across = cross_product(along, x(:, i) - x(:, 1))
         span = span .or. norm2(across) > thin*square
      end do
   end function span_a_plane

end module emcon_tie_basket_space
