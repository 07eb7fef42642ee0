! build: elements
!> What a patch over a surface of triangles sees: a small square that moves with a node, or a
!> triangle of a slave facet. Source: docs/theory.md, eqs. (43) to (46).
module emcon_patch_look_space
   use emcon_frame_vertex_space, only : frame_places, frame_size
   use emcon_kinds, only : wp
   use emcon_patch_moments_space, only : patch_area_t, patch_misses, patch_moments, patch_products
   use emcon_polygon_clip_space, only : barycentric, polygon_beside
   implicit none
   private
   public :: patch_t, patch_start_t, patch_begin, place_vertices, patch_look_t, patch_look, &
      patch_basis_t, patch_basis, patch_shares, patch_cells, patch_moments_of, patch_sees

   !> Places at which a field is given, in the coordinates of the patch.
   real(wp), parameter, public :: unit_corner(2, 3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
      0.0_wp, 1.0_wp], [2, 3])

   !> What is beside a patch by more than so many of the largest changes of coordinates stays so:
   !> sides are slanted by two at most, and as much again is far more than round-off.
   real(wp), parameter :: far_beside = 4.0_wp

   !> What a patch sees as a step begins.
   type :: patch_start_t
      real(wp), allocatable :: place(:, :)       !! (3, n_vertex) where vertices are in it
      !> (n_triangle) number among those over it; 0: it is beside it
      integer, allocatable :: number(:)
      real(wp), allocatable :: beside(:)         !! (n_triangle) how far
      real(wp), allocatable :: moment(:, :, :)   !! (weight, place, those over it) of triangles
   end type patch_start_t

   !> The triangles that a patch may see in a step.
   type :: patch_t
      integer :: n_vertex = 0
      integer :: n_triangle = 0
      integer :: n_own = 0                       !! the first ones are of the surface itself
      integer, allocatable :: triangle(:, :)     !! (3, >= n_triangle) counter-clockwise
      real(wp), allocatable :: chi(:)            !! (>= n_vertex) 1; 0 where the surface ends
      real(wp) :: length = 0.0_wp                !! of the patch' sides, in the frame's vectors
      type(patch_area_t) :: area
      real(wp) :: weight(3) = [1.0_wp, 0.0_wp, 0.0_wp]   !! of each weight of the area, in a gap
      !> (n_triangle + 1) of slip over each triangle, then over the nearest one: those of the start
      !> of the step; not allocated: nobody has asked yet
      real(wp), allocatable :: slip_share(:)
      type(patch_start_t), allocatable :: start  !! of the step; only if it is kept
   end type patch_t

   !> What a patch sees at both ends of a step.
   type :: patch_look_t
      real(wp) :: height(0:1) = 0.0_wp           !! integral of chi times height, by its area [L]
      real(wp) :: cover(0:1) = 0.0_wp            !! that of chi: what is covered
      real(wp) :: way = 0.0_wp                   !! how far vertices go along it, at most [L]
      real(wp) :: ahead = 0.0_wp                 !! height at the start of what is over it at the
                                                 !! end, the least; huge: nothing is [L]
   end type patch_look_t

   !> The same of a patch of a slave facet, weight by weight.
   type :: patch_basis_t
      real(wp) :: height(3, 0:1) = 0.0_wp        !! integral of chi times height [L^3]
      real(wp) :: cover(3, 0:1) = 0.0_wp         !! that of chi [L^2],
      real(wp) :: own(3, 0:1) = 0.0_wp           !! of it by the surface itself, not past its end
      real(wp) :: area(0:1) = 0.0_wp             !! of all of it [L^2]
      real(wp) :: way = 0.0_wp                   !! as above
      real(wp) :: ahead = 0.0_wp                 !! as above
   end type patch_basis_t

contains

   !> Where vertices are in the frame at one configuration, coordinates those of the patch.
   pure subroutine place_vertices(patch, x, place)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(out) :: place(:, :)       !! (3, n_vertex)

      associate (n => patch%n_vertex)
         call frame_places(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1), x(:, 4:3 + n) &
            - spread(x(:, 1), 2, n), place(:, :n))
         place(:2, :n) = place(:2, :n)/patch%length + patch%area%centre
      end associate
   end subroutine place_vertices

   !> What a patch sees as a step begins.
   pure subroutine patch_begin(patch, x, start)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) origin, frame, vertices [L]
      type(patch_start_t), intent(out) :: start
      integer :: k, n

      allocate(start%place(3, patch%n_vertex), start%number(patch%n_triangle), &
         start%beside(patch%n_triangle))
      call place_vertices(patch, x, start%place)
      n = 0
      do k = 1, patch%n_triangle
         start%number(k) = 0
         start%beside(k) = polygon_beside(patch%area%side(:, :patch%area%n_side), &
            start%place(:2, patch%triangle(:, k)))
         if (patch_misses(patch%area, start%place(:2, patch%triangle(:, k)))) cycle
         n = n + 1
         start%number(k) = n
      end do
      allocate(start%moment(patch%area%n_weight, 3, n))
      do k = 1, patch%n_triangle
         if (start%number(k) > 0) start%moment(:, :, start%number(k)) = patch_moments_of(patch, &
            start%place(:2, patch%triangle(:, k)))
      end do
   end subroutine patch_begin

   !> Which triangles are over a patch, where its vertices are at `place`.
   pure subroutine patch_sees(patch, start, place, is_seen)
      type(patch_t), intent(in) :: patch
      type(patch_start_t), intent(in) :: start   !! as the step begins
      real(wp), intent(in) :: place(:, :)        !! (3, n_vertex)
      logical, intent(out) :: is_seen(:)         !! (n_triangle)
      real(wp) :: far
      integer :: j, k

      far = 0.0_wp
      do j = 1, patch%n_vertex
         far = max(far, abs(place(1, j) - start%place(1, j)), abs(place(2, j) - start%place(2, j)))
      end do
      far = far_beside*far
      do k = 1, patch%n_triangle
         is_seen(k) = .not. start%beside(k) > far
         if (is_seen(k)) is_seen(k) = .not. patch_misses(patch%area, place(:2, &
            patch%triangle(:, k)))
      end do
   end subroutine patch_sees

   !> Moments of a triangle over a patch, of each weight.
   pure function patch_moments_of(patch, corner) result(moment)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      real(wp) :: moment(patch%area%n_weight, 3)

      if (patch%area%n_weight > 1) then
         moment = patch_products(patch%area, corner)
      else
         moment(1, :) = patch_moments(patch%area, corner)
      end if
   end function patch_moments_of

   !> What a patch sees at both ends of a step.
   pure function patch_look(patch, x, dx) result(look)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      type(patch_look_t) :: look
      type(patch_start_t) :: start

      if (allocated(patch%start)) then
         call look_from(patch, patch%start, x, dx, look)
      else
         call patch_begin(patch, x, start)
         call look_from(patch, start, x, dx, look)
      end if
   end function patch_look

   pure subroutine look_from(patch, start, x, dx, look)
      type(patch_t), intent(in) :: patch
      type(patch_start_t), intent(in) :: start
      real(wp), intent(in) :: x(:, :), dx(:, :)
      type(patch_look_t), intent(inout) :: look
      real(wp) :: place(3, patch%n_vertex, 0:1)
      logical :: is_seen(patch%n_triangle)

      place(:, :, 0) = start%place
      call place_vertices(patch, x + dx, place(:, :, 1))
      call patch_sees(patch, start, place(:, :, 1), is_seen)
      call find_means(patch, start%number > 0, place(:, :, 0), look%height(0), look%cover(0))
      call find_means(patch, is_seen, place(:, :, 1), look%height(1), look%cover(1))
      look%way = longest_way(patch, x, place)
      look%ahead = height_ahead(patch, is_seen, place(:, :, 0))
   end subroutine look_from

   !> What each triangle covers of what is covered of a patch at one configuration.
   pure function patch_shares(patch, x) result(share)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp) :: share(patch%n_triangle)        !! their sum is 1, or 0 where nothing is covered
      real(wp) :: place(3, patch%n_vertex)
      integer :: k

      call place_vertices(patch, x, place)
      do k = 1, patch%n_triangle
         share(k) = sum(patch_moments(patch%area, place(:2, patch%triangle(:, k))))
      end do
      if (any(share > 0.0_wp)) share = share/sum(share)
   end function patch_shares

   !> What each triangle covers of the patch of a slave facet, as much of it as it has of the field
   !> there: the integrals of products of the weights that are 1 at one of the `unit_corner`.
   pure subroutine patch_cells(patch, x, products, area)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(out) :: products(:, :, :) !! (3, 3, n_triangle) [L^2]
      real(wp), intent(out) :: area              !! of the patch [L^2]
      real(wp) :: place(3, patch%n_vertex), middle(3)
      integer :: k

      call place_vertices(patch, x, place)
      area = 0.5_wp*frame_size(x(:, :3))
      products = 0.0_wp
      do k = 1, patch%n_triangle
         associate (t => patch%triangle(:, k), own => products(:, :, k))
            if (patch_misses(patch%area, place(:2, t))) cycle
            own = 2.0_wp*area*patch_products(patch%area, place(:2, t))
            if (all(patch%chi(t) >= 1.0_wp) .or. .not. sum(own) > 0.0_wp) cycle
            middle = sum(own, 1)/sum(own)
            own = dot_product(patch%chi(t), barycentric(place(:2, t), middle(2:)))*own
         end associate
      end do
   end subroutine patch_cells

   !> What a patch of a slave facet sees at both ends of a step, with each of the weights that are 1
   !> at one of the `unit_corner` and 0 at the others.
   pure subroutine patch_basis(patch, x, dx, knows_start, basis)
      type(patch_t), intent(in) :: patch         !! that looks
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      logical, intent(in) :: knows_start         !! `basis` is of this patch, from the same start
      type(patch_basis_t), intent(inout) :: basis
      type(patch_start_t) :: start

      if (allocated(patch%start)) then
         call basis_from(patch, patch%start, x, dx, knows_start, basis)
      else
         call patch_begin(patch, x, start)
         call basis_from(patch, start, x, dx, knows_start, basis)
      end if
   end subroutine patch_basis

   pure subroutine basis_from(patch, start, x, dx, knows_start, basis)
      type(patch_t), intent(in) :: patch
      type(patch_start_t), intent(in) :: start
      real(wp), intent(in) :: x(:, :), dx(:, :)
      logical, intent(in) :: knows_start
      type(patch_basis_t), intent(inout) :: basis
      real(wp) :: place(3, patch%n_vertex, 0:1)
      logical :: is_seen(patch%n_triangle)

      place(:, :, 0) = start%place
      call place_vertices(patch, x + dx, place(:, :, 1))
      call patch_sees(patch, start, place(:, :, 1), is_seen)
      if (.not. knows_start) call find_basis(patch, start%number > 0, frame_size(x(:, :3)), &
         place(:, :, 0), 0, basis)
      call find_basis(patch, is_seen, frame_size(x(:, :3) + dx(:, :3)), place(:, :, 1), 1, basis)
      basis%way = longest_way(patch, x, place)
      basis%ahead = height_ahead(patch, is_seen, place(:, :, 0))
   end subroutine basis_from

   !> The same at one end of the step.
   pure subroutine find_basis(patch, is_seen, size_of, place, end, basis)
      type(patch_t), intent(in) :: patch
      logical, intent(in) :: is_seen(:)          !! (n_triangle)
      real(wp), intent(in) :: size_of            !! of the frame [L^2]
      real(wp), intent(in) :: place(:, :)        !! (3, n_vertex)
      integer, intent(in) :: end                 !! 0: where it begins, 1
      type(patch_basis_t), intent(inout) :: basis
      real(wp) :: products(3, 3), share(3), corner(2, 3)
      integer :: k, v

      associate (height => basis%height(:, end), cover => basis%cover(:, end), &
            own => basis%own(:, end))
         basis%area(end) = 0.5_wp*size_of
         height = 0.0_wp
         cover = 0.0_wp
         own = 0.0_wp
         do k = 1, patch%n_triangle
            if (k == patch%n_own + 1) own = cover
            if (.not. is_seen(k)) cycle
            associate (t => patch%triangle(:, k))
               corner = place(:2, t)
               products = patch_products(patch%area, corner)
               if (.not. sum(products) > 0.0_wp) cycle
               products = size_of*products
               do v = 1, 3
                  share = barycentric(corner, unit_corner(:, v))*patch%chi(t)
                  height = height + products(:, v)*dot_product(share, place(3, t))
                  cover = cover + products(:, v)*sum(share)
               end do
            end associate
         end do
         if (patch%n_own == patch%n_triangle) own = cover
      end associate
   end subroutine find_basis

   !> How far vertices go along a patch, at most [L].
   pure real(wp) function longest_way(patch, x, place) result(way)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) at the start [L]
      real(wp), intent(in) :: place(:, :, 0:)    !! (3, n_vertex, 0:1)
      real(wp) :: aa, ab, bb, dy(2), square
      integer :: j

      associate (a => x(:, 2) - x(:, 1), b => x(:, 3) - x(:, 1))
         aa = dot_product(a, a)
         ab = dot_product(a, b)
         bb = dot_product(b, b)
      end associate
      square = 0.0_wp
      do j = 1, size(place, 2)
         dy = place(:2, j, 1) - place(:2, j, 0)
         square = max(square, aa*dy(1)**2 + 2.0_wp*ab*dy(1)*dy(2) + bb*dy(2)**2)
      end do
      way = patch%length*sqrt(square)
   end function longest_way

   !> The integral of chi times height over the patch by its area, and what of it is covered.
   pure subroutine find_means(patch, is_seen, place, height, cover)
      type(patch_t), intent(in) :: patch
      logical, intent(in) :: is_seen(:)          !! (n_triangle)
      real(wp), intent(in) :: place(:, :)        !! (3, n_vertex)
      real(wp), intent(out) :: height, cover
      real(wp) :: moment(3), share(3), corner(2, 3)
      integer :: k, v

      height = 0.0_wp
      cover = 0.0_wp
      do k = 1, patch%n_triangle
         if (.not. is_seen(k)) cycle
         associate (t => patch%triangle(:, k))
            corner = place(:2, t)
            moment = patch_moments(patch%area, corner)
            do v = 1, 3
               share = moment(v)*barycentric(corner, unit_corner(:, v))
               height = height + dot_product(share, patch%chi(t)*place(3, t))
               cover = cover + dot_product(share, patch%chi(t))
            end do
         end associate
      end do
   end subroutine find_means

   !> How high the planes of the triangles that are over the patch at the end are over it at the
   !> start: the least; huge if there are none [L].
   pure real(wp) function height_ahead(patch, is_seen, from) result(least)
      type(patch_t), intent(in) :: patch
      logical, intent(in) :: is_seen(:)          !! (n_triangle) at the end
      real(wp), intent(in) :: from(:, :)         !! (3, n_vertex)
      real(wp) :: corner(2, 3)
      integer :: k

      least = huge(least)
      do k = 1, patch%n_triangle
         if (.not. is_seen(k)) cycle
         associate (t => patch%triangle(:, k), centre => patch%area%centre)
            if (any(patch%chi(t) <= 0.0_wp)) cycle
            corner = from(:2, t)
            least = min(least, dot_product(barycentric(corner, [centre, centre]), from(3, t)))
         end associate
      end do
   end function height_ahead

end module emcon_patch_look_space
