!> Resultants on a section: what pulls at the elements on one side of it.
!>
!> A surface names faces of elements. Of each of its nodes the elements count that have one of
!> these faces, or hang on such an element at the node by faces that are not of the surface: all of
!> that side. The sum of their internal forces is in balance with what acts on that side, on any
!> mesh. Source: docs/theory.md, eq. (11k).
module emcon_section_force
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_rotation, only : add_moments
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_stress, only : stress_forces
   implicit none
   private
   public :: section_force

contains

   !> Force and moment about the origin on the elements of a surface, by what is beyond it.
   subroutine section_force(solid, scene, surface, u, square, wrench)
      type(solid_t), intent(in) :: solid
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface     !! of faces of elements
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      real(wp), intent(out) :: wrench(:)         !! (n_dim + n_turn) [M L/T^2], [M L^2/T^2]
      integer, allocatable :: node(:), element(:)
      real(wp) :: force(size(u, 1), size(solid%node, 1), size(solid%node, 2)), own(size(u, 1))
      logical :: is_used(solid%n_element)
      integer :: i, k, n

      call find_sides(scene, surface, node, element)
      is_used = .false.
      is_used(element) = .true.
      call stress_forces(solid, u, square, is_used, force)
      n = size(u, 1)
      wrench = 0.0_wp
      do i = 1, size(element)
         own = 0.0_wp
         do k = 1, solid%trait%n_node(element(i))         ! corners may be one node
            if (solid%node(k, element(i)) == node(i)) own = own + force(:, k, element(i))
         end do
         if (solid%is_of_rings) then
            wrench(n) = wrench(n) + own(n)       ! all else cancels around the axis
            cycle
         end if
         wrench(:n) = wrench(:n) + own
         call add_moments(scene%x(:, node(i)) + square*u(:, node(i)), own, wrench(n + 1:))
      end do
   end subroutine section_force

   !> Pairs of a node of the surface and an element that counts there.
   pure subroutine find_sides(scene, surface, node, element)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: node(:), element(:)
      integer, allocatable :: own(:), first(:), star(:), around(:)
      logical :: is_face(maxval(scene%element%kinds%n_face), size(scene%element%kind))
      logical, allocatable :: counts(:)
      integer :: i, k, n

      is_face = .false.
      do i = 1, size(surface%element)
         is_face(surface%face(i), surface%element(i)) = .true.
      end do
      call find_stars(scene, surface, own, first, star)
      allocate(node(size(star)), element(size(star)))
      n = 0
      do i = 1, size(own)
         around = star(first(i):first(i + 1) - 1)
         call spread_side(scene, is_face, own(i), around, counts)
         k = n + count(counts)
         node(n + 1:k) = own(i)
         element(n + 1:k) = pack(around, counts)
         n = k
      end do
      node = node(:n)
      element = element(:n)
   end subroutine find_sides

   !> The nodes of a surface, and the elements around each: from `first(i)` to `first(i + 1) - 1`.
   pure subroutine find_stars(scene, surface, node, first, star)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: node(:), first(:), star(:)
      integer :: index(0:size(scene%x, 2)), e, i, k, pass

      index = 0
      do i = 1, size(surface%element)
         index(face_nodes(scene, surface%element(i), surface%face(i))) = 1
      end do
      node = pack([(i, i = 1, size(index) - 1)], index(1:) > 0)
      index(node) = [(i, i = 1, size(node))]
      allocate(first(size(node) + 2), source=0)
      do pass = 1, 2                             ! how many there are, then which
         if (pass == 2) then
            first(1) = 1
            do i = 1, size(node) + 1
               first(i + 1) = first(i + 1) + first(i)
            end do
            allocate(star(first(size(first)) - 1))
         end if
         do e = 1, size(scene%element%kind)
            associate (own => scene%element%node(:, e))
               do k = 1, scene%element%kinds(scene%element%kind(e))%n_node
                  i = index(own(k))
                  if (i == 0 .or. any(own(:k - 1) == own(k))) cycle
                  associate (next => first(i + 3 - pass))
                     if (pass == 2) star(next) = e
                     next = next + 1
                  end associate
               end do
            end associate
         end do
      end do
   end subroutine find_stars

   !> Of the elements around a node those that have a face of the surface there, and those that hang
   !> on them by other faces with this node.
   pure subroutine spread_side(scene, is_face, node, star, counts)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_face(:, :)       !! (most faces, n_element) of the surface
      integer, intent(in) :: node                !! of the surface
      integer, intent(in) :: star(:)             !! elements
      logical, allocatable, intent(out) :: counts(:)         !! of `star`
      logical :: has_grown
      integer :: i, k

      counts = [(has_face_at(scene, is_face(:, star(i)), star(i), node), i = 1, size(star))]
      has_grown = .true.
      do while (has_grown)
         has_grown = .false.
         do i = 1, size(star)
            if (counts(i)) cycle
            do k = 1, size(star)
               if (.not. counts(k)) cycle
               if (.not. hangs_on(scene, is_face(:, star(k)), star(i), star(k), node)) cycle
               counts(i) = .true.
               has_grown = .true.
               exit
            end do
         end do
      end do
   end subroutine spread_side

   !> Has an element a face of the surface at a node?
   pure logical function has_face_at(scene, is_face, e, node)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_face(:)          !! of the surface, of this element
      integer, intent(in) :: e                   !! the element
      integer, intent(in) :: node                !! of the surface
      integer :: i

      has_face_at = .false.
      do i = 1, size(is_face)
         if (is_face(i)) has_face_at = has_face_at .or. any(face_nodes(scene, e, i) == node)
      end do
   end function has_face_at

   !> Have two elements a face in common that has the node and is not of the surface?
   pure logical function hangs_on(scene, is_face, e, other, node)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_face(:)          !! of the surface, of the other element
      integer, intent(in) :: e                   !! an element
      integer, intent(in) :: other               !! that has a face of the surface, or hangs on one
      integer, intent(in) :: node                !! of the surface
      integer, allocatable :: face(:)
      integer :: i, k

      hangs_on = .false.
      do i = 1, scene%element%kinds(scene%element%kind(other))%n_face
         if (is_face(i)) cycle
         face = face_nodes(scene, other, i)
         if (.not. any(face == node)) cycle
         if (all([(any(scene%element%node(:, e) == face(k)), k = 1, size(face))])) then
            hangs_on = .true.
            return
         end if
      end do
   end function hangs_on

   !> The nodes of a face of an element.
   pure function face_nodes(scene, e, face) result(node)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e                   !! the element
      integer, intent(in) :: face                !! 1 to n_face
      integer, allocatable :: node(:)

      associate (kind => scene%element%kinds(scene%element%kind(e)))
         node = scene%element%node(kind%face(face), e)
         node = pack(node, node > 0)
      end associate
   end function face_nodes

end module emcon_section_force
