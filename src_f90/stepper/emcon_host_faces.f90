!> Faces of a host's surface, given as lists: kinds as VTK has them, where each ends in one list of
!> nodes, and this list.
module emcon_host_faces
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_stepper_check, only : check_choice, check_size, check_that
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_faces_in_turn

   !> A kind of faces: its number, its nodes, the space it is of. With mid-side nodes corners come
   !> first.
   type :: face_kind_t
      integer :: vtk_type, n_node, n_dim
      character(len=40) :: name
   end type face_kind_t

   type(face_kind_t), parameter :: kinds(*) = [ &
      face_kind_t(3, 2, 2, "edge"), &
      face_kind_t(5, 3, 3, "triangle"), &
      face_kind_t(9, 4, 3, "quadrilateral"), &
      face_kind_t(22, 6, 3, "triangle with mid-side nodes"), &
      face_kind_t(23, 8, 3, "quadrilateral with mid-side nodes")]

contains

   !> The nodes of each face in turn around it, as facets have them.
   subroutine host_faces_in_turn(kind, offset, node, x, facet, error)
      integer, intent(in) :: kind(:)             !! (n_face)
      integer, intent(in) :: offset(:)           !! (n_face) nodes up to and with those of the face
      integer, intent(in) :: node(:)             !! of all faces, one after the other
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      integer, allocatable, intent(out) :: facet(:, :)     !! (most, n_face); 0: no more
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: known
      integer :: f, first, k, n

      call check_that(size(kind) > 0, "there are no faces", error)
      call check_size("offset", size(offset), size(kind), error)
      if (allocated(error)) return
      allocate(facet(maxval(kinds%n_node, mask=kinds%n_dim == size(x, 1)), size(kind)), source=0)
      first = 0
      do f = 1, size(kind)
         k = findloc(kinds%vtk_type == kind(f) .and. kinds%n_dim == size(x, 1), .true., 1)
         if (k == 0) then
            call list_kinds(size(x, 1), known)
            call check_that(.false., "kind(" // to_text(f) // ") is " // to_text(kind(f)) // &
               "; faces of nodes with " // to_text(size(x, 1)) // " coordinates are " // known, &
               error)
            return
         end if
         n = kinds(k)%n_node
         call check_that(offset(f) == first + n, "offset(" // to_text(f) // ")" // " is " // &
            to_text(offset(f)) // ", but the face is a " // trim(kinds(k)%name) // " of " // &
            to_text(n) // " nodes behind " // to_text(first), error)
         call check_that(offset(f) <= size(node), "offset(" // to_text(f) // ")" // " is " // &
            to_text(offset(f)) // ", but node has " // to_text(size(node)) // " entries", error)
         if (allocated(error)) return
         associate (own => node(first + 1:first + n))
            call check_nodes(f, first, own, x, error)
            if (allocated(error)) return
            facet(:n, f) = own
            if (n > 4) facet(:n, f) = reshape(transpose(reshape(own, [n/2, 2])), [n])
         end associate
         first = offset(f)
      end do
      call check_that(first == size(node), "node has " // to_text(size(node)) // &
         " entries, but faces have " // to_text(first), error)
   end subroutine host_faces_in_turn

   !> The kinds of faces by their numbers and names.
   pure subroutine list_kinds(n_dim, text)
      integer, intent(in) :: n_dim               !! coordinates of nodes
      character(len=:), allocatable, intent(out) :: text
      integer :: k

      text = ""
      do k = 1, size(kinds)
         if (kinds(k)%n_dim /= n_dim) cycle
         if (len(text) > 0) text = text // ", "
         text = text // to_text(kinds(k)%vtk_type) // " (" // trim(kinds(k)%name) // ")"
      end do
   end subroutine list_kinds

   !> Nodes of face `f` exist, each once, and the face has a size.
   subroutine check_nodes(f, first, node, x, error)
      integer, intent(in) :: f
      integer, intent(in) :: first               !! entries of the list before them
      integer, intent(in) :: node(:)
      real(wp), intent(in) :: x(:, :)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: normal(3), size_of
      integer :: k, n

      do k = 1, size(node)
         call check_choice("node(" // to_text(first + k) // ")", node(k), 1, size(x, 2), error)
         call check_that(.not. any(node(:k - 1) == node(k)), "face " // to_text(f) // &
            " has node " // to_text(node(k)) // " twice", error)
      end do
      if (allocated(error)) return
      n = size(node)
      if (n > 4) n = n/2
      size_of = maxval(abs(x(:, node(n)) - x(:, node(1))))
      if (size(x, 1) == 3) then
         normal = 0.0_wp
         do k = 3, n
            normal = normal + cross_product(x(:, node(k - 1)) - x(:, node(1)), &
               x(:, node(k)) - x(:, node(1)))
         end do
         size_of = maxval(abs(normal))
      end if
      call check_that(size_of > 0.0_wp, "face " // to_text(f) // " has no " // &
         trim(merge("area  ", "length", size(x, 1) == 3)), error)
   end subroutine check_nodes

end module emcon_host_faces
