!> The outlines of the pieces of a mesh in space, whatever surfaces the deck names: faces that one
!> element alone has.
!>
!> Surfaces without elements stand for themselves, closed or not.
module emcon_outline_space
   use emcon_face_facets, only : face_facets, n_facet_node
   use emcon_kinds, only : wp
   use emcon_outline, only : pieces_of_facets, outline_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: outline_space_init, outline_faces_at

   !> Nodes that tell a face from others: no two faces of a mesh have three of them in common.
   integer, parameter :: n_mark = 3

contains

   !> Set up for the pieces of `scene`.
   subroutine outline_space_init(self, scene)
      type(outline_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable :: facet(:, :)
      real(wp), allocatable :: thickness(:)

      call find_free_faces(scene, facet, thickness)
      call add_lone_facets(scene, facet, thickness)
      call pieces_of_facets(self, scene, facet, thickness)
   end subroutine outline_space_init

   !> The outer faces of elements that have one of some nodes at least, by their nodes in turn.
   pure subroutine outline_faces_at(scene, node, facet, depth)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node(:)             !! of the scene
      integer, allocatable, intent(out) :: facet(:, :)       !! (most nodes, n) 0: no more
      real(wp), allocatable, intent(out), optional :: depth(:)   !! (n) shortest sides of their
                                                 !! elements [L]
      integer, allocatable :: at(:)
      real(wp), allocatable :: thickness(:)
      logical :: is_meant(0:size(scene%x, 2))
      integer :: f

      is_meant = .false.
      is_meant(node) = .true.
      call find_free_faces(scene, facet, thickness)
      at = pack([(f, f = 1, size(facet, 2))], [(any(is_meant(facet(:, f))), &
         f = 1, size(facet, 2))])
      facet = facet(:, at)
      if (present(depth)) depth = thickness(at)
   end subroutine outline_faces_at

   !> The faces that one element alone has.
   pure subroutine find_free_faces(scene, facet, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: facet(:, :)       !! (most nodes, n)
      real(wp), allocatable, intent(out) :: thickness(:)     !! (n) [L]
      logical, allocatable :: is_free(:)
      integer :: i

      call find_faces(scene, facet, thickness)
      call find_free(facet, size(scene%x, 2), is_free)
      associate (free => pack([(i, i = 1, size(is_free))], is_free))
         facet = facet(:, free)
         thickness = thickness(free)
      end associate
   end subroutine find_free_faces

   !> The faces of all elements, and for each the shortest side of its element.
   pure subroutine find_faces(scene, facet, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: facet(:, :)       !! (most nodes, n)
      real(wp), allocatable, intent(out) :: thickness(:)     !! (n) [L]
      integer :: e, f, n, n_before

      n = 0
      do e = 1, size(scene%element%kind)
         n = n + scene%element%kinds(scene%element%kind(e))%n_face
      end do
      allocate(facet(maxval([n_mark, n_facet_node(scene%element%kinds)]), n), source=0)
      allocate(thickness(n))
      n = 0
      do e = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            n_before = n
            do f = 1, kind%n_face
               n = n + 1
               facet(:kind%n_face_node, n) = scene%element%node(reshape(face_facets(kind, f), &
                  [kind%n_face_node]), e)
            end do
            if (n > n_before) thickness(n_before + 1:n) = shortest_side(scene%x, &
               facet(:kind%n_face_node, n_before + 1:n))
         end associate
      end do
   end subroutine find_faces

   !> The shortest side of facets of as many nodes.
   pure real(wp) function shortest_side(x, facet) result(length)
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      integer, intent(in) :: facet(:, :)         !! (n, n_facet) nodes in turn
      integer :: f, k

      length = huge(length)
      do f = 1, size(facet, 2)
         do k = 1, size(facet, 1)
            associate (a => x(:, facet(k, f)), b => x(:, facet(1 + mod(k, size(facet, 1)), f)))
               length = min(length, dot_product(b - a, b - a))
            end associate
         end do
      end do
      length = sqrt(length)
   end function shortest_side

   !> Which faces have no other one with the same corners?
   pure subroutine find_free(facet, n_node, is_free)
      integer, intent(in) :: facet(:, :)         !! (most nodes, n)
      integer, intent(in) :: n_node
      logical, allocatable, intent(out) :: is_free(:)        !! (n)
      integer, allocatable :: mark(:, :), next(:)
      integer :: first(n_node), f, g

      allocate(mark(n_mark, size(facet, 2)), next(size(facet, 2)), is_free(size(facet, 2)))
      first = 0
      is_free = .true.
      do f = 1, size(facet, 2)
         mark(:, f) = lowest_corners(facet(:, f))
         g = first(mark(1, f))
         do while (g > 0)
            if (all(mark(:, g) == mark(:, f))) then
               is_free(f) = .false.
               is_free(g) = .false.
            end if
            g = next(g)
         end do
         next(f) = first(mark(1, f))
         first(mark(1, f)) = f
      end do
   end subroutine find_free

   !> The lowest numbers of the corners of a face, ascending.
   pure function lowest_corners(facet) result(lowest)
      integer, intent(in) :: facet(:)            !! nodes in turn; 0: no more
      integer :: lowest(n_mark)
      integer :: corner(4), n, k, i

      n = count(facet > 0)
      if (n > size(corner)) then                 ! nodes between corners stand in turn with them
         n = n/2
         corner(:n) = facet(1:2*n:2)
      else
         corner(:n) = facet(:n)
      end if
      do i = 1, n_mark
         k = minloc(corner(:n), dim=1)
         lowest(i) = corner(k)
         corner(k) = huge(1)
      end do
   end function lowest_corners

   !> Append the facets of surfaces without elements.
   subroutine add_lone_facets(scene, facet, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(inout) :: facet(:, :)     !! (most nodes, n)
      real(wp), allocatable, intent(inout) :: thickness(:)   !! (n) [L]
      integer, allocatable :: all_facets(:, :)
      integer :: s, f, n

      do s = 1, size(scene%surface)
         if (.not. allocated(scene%surface(s)%edge)) cycle
         associate (own => scene%surface(s)%edge)
            n = size(facet, 2)
            allocate(all_facets(max(size(facet, 1), size(own, 1)), n + size(own, 2)), source=0)
            all_facets(:size(facet, 1), :n) = facet
            all_facets(:size(own, 1), n + 1:) = own
            call move_alloc(all_facets, facet)
            thickness = [thickness, (shortest_side(scene%x, facet(:count(facet(:, f) > 0), f:f)), &
               f = n + 1, size(facet, 2))]
         end associate
      end do
   end subroutine add_lone_facets

end module emcon_outline_space
