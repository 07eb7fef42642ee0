!> Facets split into simplices: edges stay as they are, faces are triangles about one point.
!>
!> A face of three nodes is a triangle. One of more is split about its virtual centre, which is
!> linear in its nodes: uniform pressure on the triangles loads the nodes as it loads the element.
!> Two triangles for a quadrilateral would not.
module emcon_facet_split
   use emcon_facets, only : facets_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: facet_split_t, facet_split_init, facet_split_place, facet_split_centre, &
      facet_split_middles

   !> Facets of more nodes have some between their corners.
   integer, parameter :: most_simple = 4

   !> Points are the nodes of the surface, numbered as `node` of its facets, then centres.
   type :: facet_split_t
      integer :: n_node = 0                      !! points that are nodes
      integer :: n_point = 0
      integer, allocatable :: corner(:, :)       !! (n_dim, n_simplex) points, in turn as facets
      integer, allocatable :: facet(:)           !! (n_simplex) that each is a part of
      integer, allocatable :: start(:)           !! (n_facet + 1) first simplex of each facet
      integer, allocatable :: of_centre(:)       !! (n_point - n_node) facet of each centre
      integer, allocatable :: centre(:)          !! (n_facet) its centre as a point; 0: none
   end type facet_split_t

contains

   !> Split all facets of a surface.
   pure subroutine facet_split_init(self, facets)
      type(facet_split_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! set up
      integer :: f, k, m, n

      self%n_node = size(facets%node)
      self%n_point = self%n_node
      allocate(self%start(facets%n_facet + 1), self%centre(facets%n_facet))
      n = 0
      do f = 1, facets%n_facet
         m = count(facets%corner(:, f) > 0)
         self%start(f) = n + 1
         self%centre(f) = 0
         if (m > facets%n_dim) then
            self%n_point = self%n_point + 1
            self%centre(f) = self%n_point
         end if
         n = n + merge(m, 1, m > facets%n_dim)
      end do
      self%start(facets%n_facet + 1) = n + 1
      self%of_centre = pack([(f, f = 1, facets%n_facet)], self%centre > 0)
      allocate(self%corner(facets%n_dim, n), self%facet(n))
      do f = 1, facets%n_facet
         m = count(facets%corner(:, f) > 0)
         do k = self%start(f), self%start(f + 1) - 1
            self%facet(k) = f
            if (self%centre(f) == 0) then
               self%corner(:, k) = facets%corner(:facets%n_dim, f)
            else
               n = k - self%start(f) + 1
               self%corner(:, k) = [facets%corner(n, f), facets%corner(1 + mod(n, m), f), &
                  self%centre(f)]
            end if
         end do
      end do
   end subroutine facet_split_init

   !> The weights of the nodes of a facet, in turn around it, in its virtual centre: docs/theory.md,
   !> eq. (15l).
   pure function facet_split_centre(n) result(weight)
      integer, intent(in) :: n                   !! nodes of the facet: 4, 6 or 8
      real(wp) :: weight(n)                      !! of sum 1

      select case (n)
      case (6)
         weight(1::2) = -1.0_wp/3.0_wp
         weight(2::2) = 2.0_wp/3.0_wp
      case (8)
         weight(1::2) = -0.5_wp
         weight(2::2) = 0.75_wp
      case default
         weight = 1.0_wp/n
      end select
   end function facet_split_centre

   !> The facets with nodes between corners, all of which are meant. Uniform pressure loads the
   !> corners of one by nothing, or pulls at them, where it presses on all nodes and on the centre.
   pure function facet_split_middles(facets, is_meant) result(middle)
      type(facets_t), intent(in) :: facets
      logical, intent(in) :: is_meant(:)         !! (n_node)
      integer, allocatable :: middle(:)          !! ascending
      integer :: f

      middle = pack([(f, f = 1, facets%n_facet)], [(has_middle(f), f = 1, facets%n_facet)])

   contains

      pure logical function has_middle(f)
         integer, intent(in) :: f

         associate (n => count(facets%facet(:, f) > 0))
            has_middle = n > most_simple
            if (has_middle) has_middle = all(is_meant(facets%corner(:n, f)))
         end associate
      end function has_middle

   end function facet_split_middles

   !> Where all points are at x + u.
   pure subroutine facet_split_place(self, facets, x, u, at)
      type(facet_split_t), intent(in) :: self
      type(facets_t), intent(in) :: facets       !! that were split
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node of the scene) [L]
      real(wp), intent(out) :: at(:, :)          !! (n_dim, n_point) [L]
      integer :: i, f, n

      do i = 1, self%n_node
         at(:, i) = x(:, facets%node(i)) + u(:, facets%node(i))
      end do
      do i = self%n_node + 1, self%n_point
         f = self%of_centre(i - self%n_node)
         n = count(facets%corner(:, f) > 0)
         at(:, i) = matmul(at(:, facets%corner(:n, f)), facet_split_centre(n))
      end do
   end subroutine facet_split_place

end module emcon_facet_split
