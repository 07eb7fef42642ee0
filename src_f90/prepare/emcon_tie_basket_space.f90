!> Which nodes of the slave surface of a tie in space have a multiplier.
!>
!> Source: docs/theory.md, section 11.10.
module emcon_tie_basket_space
   use emcon_facets, only : facets_rim, facets_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: tie_basket_find

   !> Places are on one line if a triangle of them has less than this part of the square of its
   !> longest side as its area.
   real(wp), parameter :: thin = 1.0e-3_wp

contains

   !> On the rim of the slave surface nodes have none that take part in another tie too, or that are
   !> held in a direction in which one beside them is not. A connected part that would keep less
   !> than three nodes that are not on one line, and so could turn about them, keeps all it has.
   pure subroutine tie_basket_find(slave, x, n_tie, is_held, is_kept)
      type(facets_t), intent(in) :: slave
      real(wp), intent(in) :: x(:, :)                    !! (3, n_node of the scene) [L]
      integer, intent(in) :: n_tie(:)                    !! (n_node of the scene) ties of each
      logical, intent(in) :: is_held(:, :)               !! (3, n_node of the scene)
      logical, allocatable, intent(out) :: is_kept(:)    !! (n_node of the surface)
      logical :: is_rim(size(slave%node)), is_part(size(slave%node))
      integer :: k, p

      call facets_rim(slave, is_rim)
      allocate(is_kept(size(slave%node)), source=.true.)
      do k = 1, size(is_kept)
         if (.not. is_rim(k)) cycle
         is_kept(k) = n_tie(slave%node(k)) == 1 .and. .not. is_held_alone(slave, k, is_held)
      end do
      do p = 1, maxval(slave%part)
         is_part = .false.
         do k = 1, slave%n_facet
            if (slave%part(k) == p) is_part(pack(slave%corner(:, k), slave%corner(:, k) > 0)) &
               = .true.
         end do
         if (.not. span_a_plane(x(:, pack(slave%node, is_part .and. is_kept)))) &
            is_kept = is_kept .or. is_part
      end do
   end subroutine tie_basket_find

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
               if (any(is_held(:, slave%node(k)) .and. .not. is_held(:, mates(m)))) &
                  is_held_alone = .true.
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
