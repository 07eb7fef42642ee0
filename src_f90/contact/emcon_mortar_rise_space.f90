!> How far the curved surfaces that facets stand for rise between a slave triangle and the master:
!> what mortar gaps between facets are larger than those between the surfaces.
!>
!> Source: docs/theory.md, section 14.2.
module emcon_mortar_rise_space
   use emcon_bulges_space, only : bulges_doubt, bulges_largest, bulges_rise, bulges_t
   use emcon_frame_vertex_space, only : frame_place, frame_size
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_t
   use emcon_patch_look_space, only : place_vertices
   use emcon_patch_sides_space, only : patch_triangles_t
   use emcon_patch_places_space, only : patch_stencil_place
   use emcon_polygon_clip_space, only : barycentric, most_corners, polygon_clip
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: mortar_rise_t, mortar_rise, mortar_rise_largest, mortar_rise_doubt

   !> A ray meets the curved surface beside where it meets the facet; each look leaves the square
   !> of a small angle of that.
   integer, parameter :: n_look = 4

   !> Corners, middles of sides and the middle of a triangle: exact to degree 3, which products of
   !> weights and rises have.
   real(wp), parameter :: half = 0.5_wp, third = 1.0_wp/3.0_wp
   real(wp), parameter :: point(3, 7) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
      0.0_wp, 0.0_wp, 1.0_wp, half, half, 0.0_wp, 0.0_wp, half, half, half, 0.0_wp, half, third, &
      third, third], [3, 7])
   real(wp), parameter :: weight(7) = [3.0_wp, 3.0_wp, 3.0_wp, 8.0_wp, 8.0_wp, 8.0_wp, &
      27.0_wp]/60.0_wp

   !> The surfaces that both sides stand for.
   type :: mortar_rise_t
      type(bulges_t) :: slave
      type(bulges_t) :: master
   end type mortar_rise_t

   !> A triangle of the master below one of the slave.
   type :: below_t
      integer :: triangle = 0                    !! of the master
      integer :: corner(3) = 0                   !! which of its corners the places are of
      real(wp) :: place(3, 3) = 0.0_wp           !! corners in the coordinates of the slave's [-, L]
      real(wp) :: normal(3) = 0.0_wp             !! the way out of the master, the same
   end type below_t

contains

   !> The integrals over what is covered of slave triangle `t`, with each of the weights that are 1
   !> at one corner of it and 0 at the others, of how far both surfaces rise, and of 1.
   pure subroutine mortar_rise(self, faces, t, x, u, rise, cover)
      type(mortar_rise_t), intent(in) :: self
      type(mortar_faces_t), intent(in) :: faces  !! with their stencils
      integer, intent(in) :: t                   !! 1..n_triangle of the slave's split
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: rise(3)           !! [L^3]
      real(wp), intent(out) :: cover(3)          !! [L^2]
      real(wp) :: at(3, 3 + faces%stencil(t)%patch%n_vertex)
      real(wp) :: place(3, faces%stencil(t)%patch%n_vertex), polygon(2, most_corners), size_of
      type(below_t) :: below
      integer :: i, k, n

      rise = 0.0_wp
      cover = 0.0_wp
      associate (stencil => faces%stencil(t))
         if (stencil%triangle == 0) return
         call patch_stencil_place(stencil, x, u, at)
         call place_vertices(stencil%patch, at, place)
         size_of = frame_size(at(:, :3))
         do k = 1, stencil%patch%n_triangle
            associate (vertex => stencil%patch%triangle(:, k))
               if (any(stencil%point(vertex) <= 0)) cycle    ! of a flange, of no surface
               call find_below(faces%sides%triangles, stencil%point(vertex), at(:, :3), &
                  at(:, 3 + vertex), place(:, vertex), below)
               call polygon_clip(stencil%patch%area%side(:, :3), place(:2, vertex), polygon, n)
               do i = 2, n - 1
                  call add_part(self, faces, t, below, polygon(:, [1, i, i + 1]), rise, cover)
               end do
            end associate
         end do
         rise = size_of*rise
         cover = size_of*cover
      end associate
   end subroutine mortar_rise

   !> The triangle of the master with some corners, as one of the slave sees it.
   pure subroutine find_below(triangles, point, frame, at, place, below)
      type(patch_triangles_t), intent(in) :: triangles
      integer, intent(in) :: point(3)            !! of the master, in turn as the slave runs
      real(wp), intent(in) :: frame(3, 3)        !! origin and vectors of the slave's triangle [L]
      real(wp), intent(in) :: at(3, 3), place(3, 3)   !! where they are, and in its coordinates
      type(below_t), intent(out) :: below
      real(wp) :: normal(3)
      integer :: i, k

      do i = triangles%around_start(point(1)), triangles%around_start(point(1) + 1) - 1
         associate (corner => triangles%split%corner(:, triangles%around(i)))
            below%corner = [(findloc(corner, point(k), 1), k = 1, 3)]
         end associate
         if (any(below%corner == 0)) cycle
         below%triangle = triangles%around(i)
         exit
      end do
      below%place = place
      normal = cross_product(at(:, 3) - at(:, 1), at(:, 2) - at(:, 1))
      below%normal = frame_place(frame(:, 2) - frame(:, 1), frame(:, 3) - frame(:, 1), &
         normal/sqrt(dot_product(normal, normal)))
   end subroutine find_below

   !> Add what one part of the common polygon, a triangle, has of both integrals.
   pure subroutine add_part(self, faces, t, below, corner, rise, cover)
      type(mortar_rise_t), intent(in) :: self
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: t
      type(below_t), intent(in) :: below
      real(wp), intent(in) :: corner(2, 3)       !! in the coordinates of the slave's triangle
      real(wp), intent(inout) :: rise(3), cover(3)
      real(wp) :: y(2), share(3), area
      integer :: i

      associate (a => corner(:, 2) - corner(:, 1), b => corner(:, 3) - corner(:, 1))
         area = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
      end associate
      do i = 1, size(weight)
         y = matmul(corner, point(:, i))
         share = [1.0_wp - sum(y), y]
         cover = cover + weight(i)*area*share
         rise = rise + weight(i)*area*(bulges_rise(self%slave, faces%split, t, share) &
            + rise_below(self, faces, below, y))*share
      end do
   end subroutine add_part

   !> How far the surface of the master rises over its triangle, along the normal of the slave's.
   pure real(wp) function rise_below(self, faces, below, y) result(rise)
      type(mortar_rise_t), intent(in) :: self
      type(mortar_faces_t), intent(in) :: faces
      type(below_t), intent(in) :: below
      real(wp), intent(in) :: y(2)               !! a place of the slave
      real(wp) :: own, share(3), ordered(3)
      integer :: i

      own = 0.0_wp
      do i = 1, n_look
         ! A point of the surface is over this place if it rises from there:
         share = barycentric(below%place(:2, :), y - own*below%normal(:2))
         ordered(below%corner) = share
         own = bulges_rise(self%master, faces%sides%triangles%split, below%triangle, ordered)
      end do
      share = barycentric(below%place(:2, :), y - own*below%normal(:2)) &
         - barycentric(below%place(:2, :), y)
      rise = -own*below%normal(3) - dot_product(share, below%place(3, :))
   end function rise_below

   !> The largest rise of both surfaces, by the length of their facets.
   pure real(wp) function mortar_rise_largest(self, faces) result(largest)
      type(mortar_rise_t), intent(in) :: self
      type(mortar_faces_t), intent(in) :: faces

      associate (triangles => faces%sides%triangles)
         largest = bulges_largest(self%slave, faces%split, faces%sides%frames%size) &
            + bulges_largest(self%master, triangles%split, triangles%size)
      end associate
   end function mortar_rise_largest

   !> How wrong the rises of both surfaces may be [L].
   pure real(wp) function mortar_rise_doubt(self, faces) result(doubt)
      type(mortar_rise_t), intent(in) :: self
      type(mortar_faces_t), intent(in) :: faces

      doubt = bulges_doubt(self%slave, faces%split) &
         + bulges_doubt(self%master, faces%sides%triangles%split)
   end function mortar_rise_doubt

end module emcon_mortar_rise_space
