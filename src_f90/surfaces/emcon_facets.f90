!> The facets of a surface and what is beside each: edges in the plane, faces in space.
!>
!> A facet has its nodes in turn, as `surface_facets` has them: the body to the left of an edge, a
!> face counter-clockwise from outside. Its sides are where others may go on: in the plane side k is
!> node k, in space it goes from node k to the next one.
module emcon_facets
   use emcon_csr, only : csr_list_users
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_surface_facets, only : facet_nodes, faces_of_facets, surface_facets
   use emcon_text, only : to_text
   implicit none
   private
   public :: facets_t, facets_init, facets_join_nodes, facets_length, facets_number, &
      facets_normal, facets_rim, facets_text

   type :: facets_t
      integer :: n_dim = 0
      integer :: n_facet = 0
      integer, allocatable :: facet(:, :)        !! (most nodes, n_facet) of the scene; 0: no more
      integer, allocatable :: corner(:, :)       !! the same as indices into `node`
      integer, allocatable :: neighbour(:, :)    !! (most nodes, n_facet) beyond each side; 0: none
      integer, allocatable :: part(:)            !! (n_facet) connected part, by its lowest facet
      real(wp), allocatable :: size(:)           !! (n_facet) length or area in the reference
      integer, allocatable :: element(:)         !! (n_facet) behind it; 0: none
      real(wp), allocatable :: depth(:)          !! (n_facet) of that, for who has measured it [L]
      integer, allocatable :: face(:)            !! (n_facet) of that element
      integer, allocatable :: node(:)            !! (n_node) ascending
      !> (n_node + 1) facets of node i: around(around_start(i):around_start(i + 1) - 1), ascending
      integer, allocatable :: around_start(:)
      integer, allocatable :: around(:)
   end type facets_t

contains

   !> The facets of `surface`; a nodal one gives nodes without facets. Where more than two facets
   !> meet in a side, or two of which one shows its back, that is told.
   subroutine facets_init(self, scene, surface, error)
      type(facets_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: normal(size(scene%x, 1)), u(size(scene%x, 1), size(scene%x, 2))
      integer :: f, k

      self%n_dim = size(scene%x, 1)
      call surface_facets(scene, surface, self%facet)
      self%n_facet = size(self%facet, 2)
      call facet_nodes(surface, self%facet, self%node)
      call find_faces(self, scene, surface)
      allocate(self%corner(size(self%facet, 1), self%n_facet), source=0)
      allocate(self%size(self%n_facet))
      u = 0.0_wp
      do f = 1, self%n_facet
         do k = 1, n_node(self, f)
            self%corner(k, f) = find_sorted(self%node, self%facet(k, f))
         end do
         normal = facets_normal(self, f, scene%x, u)
         self%size(f) = sqrt(dot_product(normal, normal))   ! not norm2: bits depend on the units
      end do
      call facets_join_nodes(self)
      call find_neighbours(self, scene, surface, error)
      if (.not. allocated(error)) call facets_number(self)
   end subroutine facets_init

   !> Nodes of facet `f`.
   pure integer function n_node(self, f)
      type(facets_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1 to n_facet

      n_node = count(self%facet(:, f) > 0)
   end function n_node

   !> The faces of elements that facets are of.
   pure subroutine find_faces(self, scene, surface)
      type(facets_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable :: face(:)

      allocate(self%element(self%n_facet), self%face(self%n_facet), source=0)
      if (allocated(surface%edge) .or. self%n_facet == 0) return
      call faces_of_facets(scene, surface, face)
      self%element = surface%element(face)
      self%face = surface%face(face)
   end subroutine find_faces

   !> List the facets of each node, by `corner`.
   pure subroutine facets_join_nodes(self)
      class(facets_t), intent(inout) :: self
      integer :: f

      associate (m => size(self%corner, 1))
         call csr_list_users(size(self%node), [(1 + m*f, f = 0, self%n_facet)], &
            reshape(self%corner, [size(self%corner)]), self%around_start, self%around)
      end associate
      self%around_start = self%around_start + 1
   end subroutine facets_join_nodes

   !> Find what is beyond each side: the facet that has the same side, run the other way.
   subroutine find_neighbours(self, scene, surface, error)
      type(facets_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error
      integer :: f, k, n_same

      allocate(self%neighbour(size(self%facet, 1), self%n_facet), source=0)
      do f = 1, self%n_facet
         do k = 1, n_node(self, f)
            call find_beyond(self, f, k, self%neighbour(k, f), n_same)
            if (n_same == 0) cycle
            call raise(error, err_input, where_text(scene, surface%origin) // ": surface " // &
               surface%name // " branches at node " // to_text(scene%node%label(self%facet(k, f))))
            return
         end do
      end do
   end subroutine find_neighbours

   !> What is beyond side `k` of facet `f`, and how many more facets that is, or how many others
   !> have the side run the same way.
   pure subroutine find_beyond(self, f, k, beyond, n_same)
      type(facets_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1 to n_facet
      integer, intent(in) :: k                   !! 1 to the number of its nodes
      integer, intent(out) :: beyond             !! 0: none
      integer, intent(out) :: n_same
      integer :: i, g, j, side(2), other(2)

      side = side_of(self, f, k)
      beyond = 0
      n_same = 0
      associate (node => self%corner(k, f))
         do i = self%around_start(node), self%around_start(node + 1) - 1
            g = self%around(i)
            if (g == f) cycle
            do j = 1, n_node(self, g)
               other = side_of(self, g, j)
               if (all(other == side)) n_same = n_same + 1
               if (any(other /= side([2, 1]))) cycle
               if (beyond /= 0) n_same = n_same + 1
               beyond = g
            end do
         end do
      end associate
   end subroutine find_beyond

   !> Side `k` of facet `f`, which the facet beyond it runs the other way: from a node to a node; in
   !> the plane, where it is one node, from that to none or from none to that.
   pure function side_of(self, f, k) result(side)
      type(facets_t), intent(in) :: self
      integer, intent(in) :: f, k
      integer :: side(2)

      if (self%n_dim == 2) then
         side = 0
         side(k) = self%corner(k, f)
      else
         side = self%corner([k, 1 + mod(k, n_node(self, f))], f)
      end if
   end function side_of

   !> Number the connected parts, in the order of their lowest facets.
   pure subroutine facets_number(self)
      class(facets_t), intent(inout) :: self
      integer :: waiting(self%n_facet), i, k, n, n_part

      self%part = [(0, i = 1, self%n_facet)]
      n_part = 0
      do i = 1, self%n_facet
         if (self%part(i) > 0) cycle
         n_part = n_part + 1
         self%part(i) = n_part
         n = 1
         waiting(1) = i
         do while (n > 0)
            associate (beside => self%neighbour(:, waiting(n)))
               n = n - 1
               do k = 1, size(beside)
                  if (beside(k) == 0) cycle
                  if (self%part(beside(k)) > 0) cycle
                  self%part(beside(k)) = n_part
                  n = n + 1
                  waiting(n) = beside(k)
               end do
            end associate
         end do
      end do
   end subroutine facets_number

   !> Is a node at the rim of the surface: on a side with nothing beyond?
   pure subroutine facets_rim(self, is_rim)
      class(facets_t), intent(in) :: self
      logical, intent(out) :: is_rim(:)          !! (n_node)
      integer :: f, k

      is_rim = .false.
      do f = 1, self%n_facet
         do k = 1, n_node(self, f)
            if (self%neighbour(k, f) > 0) cycle
            associate (side => side_of(self, f, k))
               is_rim(pack(side, side > 0)) = .true.
            end associate
         end do
      end do
   end subroutine facets_rim

   !> How long a facet is, or the root of its area, in the reference.
   pure real(wp) function facets_length(self, f) result(length)
      class(facets_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1 to n_facet

      length = self%size(f)
      if (self%n_dim == 3) length = sqrt(length)
   end function facets_length

   !> The normal of a facet at x + u, outwards, as long as its length or area: exact where it is
   !> flat, else that of the closed line through its nodes.
   pure function facets_normal(self, f, x, u) result(normal)
      class(facets_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1 to n_facet
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (n_dim, n_node of the scene) [L]
      real(wp) :: normal(size(x, 1))             !! [L^(n_dim - 1)]
      real(wp) :: a(3), b(3)
      integer :: k

      a = vector(2)
      if (size(normal) == 2) then
         normal = [a(2), -a(1)]
         return
      end if
      normal = 0.0_wp
      do k = 3, n_node(self, f)
         b = vector(k)
         normal = normal + 0.5_wp*(cshift(a, 1)*cshift(b, 2) - cshift(a, 2)*cshift(b, 1))
         a = b
      end do

   contains

      !> From the first node of the facet to its node `k`, differences first.
      pure function vector(k)
         integer, intent(in) :: k
         real(wp) :: vector(3)
         integer :: i

         vector = 0.0_wp
         associate (first => self%facet(1, f), node => self%facet(k, f))
            do i = 1, size(x, 1)
               vector(i) = (x(i, node) - x(i, first)) + (u(i, node) - u(i, first))
            end do
         end associate
      end function vector

   end function facets_normal

   !> "face S1 of element 7 (nodes 1, 2)" for facet `f`; where no element is behind it, "the edge
   !> (nodes 1, 2)".
   subroutine facets_text(self, scene, f, text)
      class(facets_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: f                   !! 1 to n_facet
      character(len=:), allocatable, intent(out) :: text     !! no line ends
      integer :: k

      text = "the edge"
      if (self%n_dim == 3) text = "the face"
      if (self%element(f) > 0) text = "face S" // to_text(self%face(f)) // " of element " &
         // to_text(scene%element%label(self%element(f)))
      text = text // " (nodes "
      do k = 1, count(self%facet(:, f) > 0)
         if (k > 1) text = text // ", "
         text = text // to_text(scene%node%label(self%facet(k, f)))
      end do
      text = text // ")"
   end subroutine facets_text

end module emcon_facets
