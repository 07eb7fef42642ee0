!> Free edges at ties whose rows are frozen: which have nothing free any more, and where the slave
!> surface of a tie ends on one.
module emcon_tied_edges
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_scene, only : scene_t
   use emcon_surface_facets, only : surface_facets
   implicit none
   private
   public :: tied_edges_find, tied_ends_find

contains

   !> Which facets are on the slave surface of a tie, or covered by it as a whole? Their first two
   !> nodes tell: of the facets of a surface only one has these in turn.
   pure subroutine tied_edges_find(scene, edge, is_tied)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: edge(:, :)                !! (most nodes, n) facets by their nodes
      logical, allocatable, intent(out) :: is_tied(:)  !! (n)
      integer, allocatable :: slave(:, :)
      type(name_index_t) :: tied
      integer :: t, i

      do t = 1, size(scene%tie)
         associate (tie => scene%tie(t))
            if (tie%slave == 0) cycle                  ! known by its rows alone
            call surface_facets(scene, scene%surface(tie%slave), slave)
            call put(tied, slave)
            if (allocated(tie%rows%covered)) call put(tied, tie%rows%covered)
         end associate
      end do
      is_tied = [(name_index_find(tied, name_index_pair(edge(1, i), edge(2, i))) > 0, &
         i = 1, size(edge, 2))]

   contains

      pure subroutine put(tied, facet)
         type(name_index_t), intent(inout) :: tied
         integer, intent(in) :: facet(:, :)
         integer :: k

         do k = 1, size(facet, 2)
            call name_index_put(tied, name_index_pair(facet(1, k), facet(2, k)), t)
         end do
      end subroutine put

   end subroutine tied_edges_find

   !> On which edge does the end of a slave surface stand, and which nodes are under one?
   pure subroutine tied_ends_find(scene, edge, host, is_buried)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: edge(:, :)                !! (2, n) first and last nodes
      integer, allocatable, intent(out) :: host(:)     !! (n_node) index into `edge`; 0: on none
      logical, allocatable, intent(out) :: is_buried(:)    !! (n_node)
      integer :: begins(size(scene%x, 2)), i, t

      allocate(host(size(scene%x, 2)), source=0)
      allocate(is_buried(size(scene%x, 2)), source=.false.)
      if (size(scene%tie) == 0) return
      begins = 0
      begins(edge(1, :)) = [(i, i = 1, size(edge, 2))]
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            if (.not. allocated(rows%ending)) cycle
            is_buried(rows%buried) = .true.
            do i = 1, size(rows%ending, 2)
               associate (node => rows%ending(1, i), e => begins(rows%ending(2, i)))
                  if (e == 0) cycle
                  if (edge(2, e) == rows%ending(3, i)) host(node) = e
               end associate
            end do
         end associate
      end do
   end subroutine tied_ends_find

end module emcon_tied_edges
