!> The outline of one piece in space as triangles: facets split about their virtual centres, with
!> the edges between them, and where all of it is.
!>
!> Source: docs/theory.md, section 4.15.
module emcon_triangles_space
   use emcon_csr, only : csr_list_users
   use emcon_facet_split, only : facet_split_centre, facet_split_init, facet_split_t
   use emcon_facets, only : facets_t
   use emcon_kinds, only : wp
   use emcon_sort, only : find_sorted, unique_sorted
   implicit none
   private
   public :: triangles_t, triangles_init, triangles_place, triangle_at, cross_product

   type :: triangles_t
      type(facets_t) :: facets                   !! nodes and facets alone
      type(facet_split_t) :: split               !! its points: nodes, then centres
      integer, allocatable :: edge(:, :)         !! (2, n_edge) points, the lower first
      integer, allocatable :: edge_start(:)      !! (n_facet + 1) first edge that a facet brings
      integer, allocatable :: around_start(:)    !! (n_point + 1) from 0
      integer, allocatable :: around(:)          !! edges at each point
      logical :: is_closed = .false.
      logical, allocatable :: is_rim(:)          !! (n_point) where it is not closed
      real(wp), allocatable :: length(:)         !! (n_facet) root of its area, reference [L]
      real(wp), allocatable :: thickness(:)      !! (n_facet) of the element behind it [L]
      real(wp), allocatable :: at(:, :)          !! (3, n_point) where it is placed [L]
      real(wp), allocatable :: low(:, :), high(:, :)   !! (3, n_facet) boxes there [L]
   end type triangles_t

contains

   !> Set up for the facets of one piece.
   pure subroutine triangles_init(self, x, facet, thickness)
      type(triangles_t), intent(out) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) [L]
      integer, intent(in) :: facet(:, :)         !! (most nodes, n_facet) nodes in turn; 0: no more
      real(wp), intent(in) :: thickness(:)       !! (n_facet) [L]
      real(wp) :: area(3), rest(size(x, 1), size(x, 2))
      integer :: f, k

      self%facets%n_dim = size(x, 1)
      self%facets%n_facet = size(facet, 2)
      self%facets%facet = facet
      self%facets%node = unique_sorted(pack(facet, facet > 0))
      allocate(self%facets%corner(size(facet, 1), size(facet, 2)), source=0)
      do f = 1, size(facet, 2)
         do k = 1, count(facet(:, f) > 0)
            self%facets%corner(k, f) = find_sorted(self%facets%node, facet(k, f))
         end do
      end do
      call facet_split_init(self%split, self%facets)
      self%thickness = thickness
      allocate(self%at(3, self%split%n_point), self%length(size(facet, 2)))
      allocate(self%low(3, size(facet, 2)), self%high(3, size(facet, 2)), source=0.0_wp)
      rest = 0.0_wp
      call triangles_place(self, x, rest, rest, 0.0_wp)
      do f = 1, size(facet, 2)
         area = 0.0_wp
         do k = self%split%start(f), self%split%start(f + 1) - 1
            associate (a => self%at(:, self%split%corner(:, k)))
               area = area + 0.5_wp*cross_product(a(:, 2) - a(:, 1), a(:, 3) - a(:, 1))
            end associate
         end do
         self%length(f) = sqrt(sqrt(dot_product(area, area)))
      end do
      call find_edges(self)
   end subroutine triangles_init

   !> The edges, each of the first facet that has it, and where nothing is beyond one.
   pure subroutine find_edges(self)
      type(triangles_t), intent(inout) :: self
      integer, allocatable :: first(:), next(:), turns(:)
      integer :: f, t, k, a, b, e, n

      associate (corner => self%split%corner, n_point => self%split%n_point)
         allocate(first(n_point), source=0)
         n = size(corner)
         allocate(self%edge(2, n), next(n), self%edge_start(self%facets%n_facet + 1))
         allocate(turns(n), source=0)
         n = 0
         do f = 1, self%facets%n_facet
            self%edge_start(f) = n + 1
            do t = self%split%start(f), self%split%start(f + 1) - 1
               do k = 1, 3
                  a = min(corner(k, t), corner(1 + mod(k, 3), t))
                  b = max(corner(k, t), corner(1 + mod(k, 3), t))
                  e = first(a)
                  do while (e > 0)
                     if (self%edge(2, e) == b) exit
                     e = next(e)
                  end do
                  if (e == 0) then
                     n = n + 1
                     e = n
                     self%edge(:, e) = [a, b]
                     next(e) = first(a)
                     first(a) = e
                  end if
                  turns(e) = turns(e) + merge(1, -1, corner(k, t) == a)
               end do
            end do
         end do
         self%edge_start(self%facets%n_facet + 1) = n + 1
         self%edge = self%edge(:, :n)
         allocate(self%is_rim(n_point), source=.false.)
         do e = 1, n
            if (turns(e) /= 0) self%is_rim(self%edge(:, e)) = .true.
         end do
         self%is_closed = .not. any(self%is_rim)
         call csr_list_users(n_point, [(1 + 2*e, e = 0, n)], reshape(self%edge, [2*n]), &
            self%around_start, self%around)
      end associate
   end subroutine find_edges

   !> Place all points, and the boxes of the facets.
   pure subroutine triangles_place(self, x, u0, du, share)
      type(triangles_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: share              !! of the step that lies behind, 0 to 1
      integer :: f, i, k, n

      associate (node => self%facets%node, at => self%at)
         do i = 1, size(node)
            at(:, i) = x(:, node(i)) + (u0(:, node(i)) + share*du(:, node(i)))
         end do
      end associate
      do f = 1, self%facets%n_facet
         associate (corner => self%facets%corner(:, f), low => self%low(:, f), &
               high => self%high(:, f))
            n = self%split%start(f + 1) - self%split%start(f)
            if (self%split%centre(f) == 0) n = 3
            low = self%at(:, corner(1))
            high = low
            do k = 2, n
               low = min(low, self%at(:, corner(k)))
               high = max(high, self%at(:, corner(k)))
            end do
            if (self%split%centre(f) == 0) cycle
            associate (centre => self%at(:, self%split%centre(f)))
               centre = centre_at(self%at(:, corner(:n)))
               low = min(low, centre)
               high = max(high, centre)
            end associate
         end associate
      end do
   end subroutine triangles_place

   !> The virtual centre of a facet.
   pure function centre_at(node) result(centre)
      real(wp), intent(in) :: node(:, :)         !! (3, n) in turn [L]
      real(wp) :: centre(3), weight(size(node, 2))
      integer :: k

      weight = facet_split_centre(size(node, 2))
      centre = 0.0_wp
      do k = 1, size(node, 2)
         centre = centre + weight(k)*node(:, k)
      end do
   end function centre_at

   !> Where the corners of triangle `t` are.
   pure function triangle_at(self, t) result(corner)
      type(triangles_t), intent(in) :: self
      integer, intent(in) :: t                   !! of the split
      real(wp) :: corner(3, 3)                   !! (3, corner) [L]

      corner(:, 1) = self%at(:, self%split%corner(1, t))
      corner(:, 2) = self%at(:, self%split%corner(2, t))
      corner(:, 3) = self%at(:, self%split%corner(3, t))
   end function triangle_at

   pure function cross_product(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)         !! any units
      real(wp) :: c(3)

      c(1) = a(2)*b(3) - a(3)*b(2)
      c(2) = a(3)*b(1) - a(1)*b(3)
      c(3) = a(1)*b(2) - a(2)*b(1)
   end function cross_product

end module emcon_triangles_space
