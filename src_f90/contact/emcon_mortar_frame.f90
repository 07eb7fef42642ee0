!> A slave edge and a master edge seen along the normal field of the slave edge, as plain values.
!>
!> The slave point x(xi) = x1 + xi a, a = x2 - x1, looks along n(xi), which is t(xi) turned by -90
!> degrees, t(xi) = (1 - xi) t1 + xi t2. A node y stands at (y - x).t along the tangent and at the
!> height (y - x) x t over the point. Source: docs/theory.md, eqs. (15e) to (15h).
module emcon_mortar_frame
   use emcon_kinds, only : wp
   use emcon_rounded, only : rounded_clip, rounded_clip_slope, rounded_negative
   implicit none
   private
   public :: pair_stencil_t, frame_t, frame_init, frame_project, frame_meet, frame_hit, &
      frame_point, frame_cover, frame_lean
   public :: place_first, place_last, place_before, place_after, local_master
   public :: moment_gap, moment_gap_xi, moment_area, moment_area_xi, moment_cover, n_moment
   public :: n_place, end_rounding

   !> Local numbers of the nodes: slave edge, master edge, neighbours of either.
   integer, parameter :: n_place = 8, place_first = 1, place_last = 2, place_before = 5, &
      place_after = 6, local_master(4) = [3, 4, 7, 8]

   !> What is integrated over the covered part of a slave edge: the gap and 1, with weights 1 and
   !> xi, over the area; and the covered fraction.
   integer, parameter :: n_moment = 5, moment_gap = 1, moment_gap_xi = 2, moment_area = 3, &
      moment_area_xi = 4, moment_cover = 5

   !> Nodes and constants of a pair of edges.
   type :: pair_stencil_t
      integer :: node(n_place) = 0               !! 0: absent
      integer :: edge = 0                        !! number of the master edge
      integer :: n_master = 2                    !! 2: polygon; 4: with the master's neighbours
      logical :: has_field = .false.             !! t1 and t2 differ: averaged normals
      integer :: tangent(2, 2) = 0               !! tip and tail of t1 and t2, local
      real(wp) :: weight(2) = 0.0_wp             !! factors that make t1 and t2 about 1 long [1/L]
      real(wp) :: rounding(2) = 0.0_wp           !! of the polygon's corners, for points [L]
      logical :: is_smooth = .false.             !! cubic master, else a polygon
      real(wp) :: shape(0:3, 4) = 0.0_wp         !! its coefficients: power of eta, node
   end type pair_stencil_t

   !> One configuration. First index: with t1, with t2; second: master node.
   type :: frame_t
      real(wp) :: along(2, 4) = 0.0_wp           !! (y - x1).t [L]
      real(wp) :: above(2, 4) = 0.0_wp           !! (y - x1) x t [L]
      real(wp) :: edge_along(2) = 0.0_wp         !! a.t
      real(wp) :: edge_above(2) = 0.0_wp         !! a x t
      real(wp) :: square(3) = 0.0_wp             !! t1.t1, t1.t2, t2.t2
      real(wp) :: length = 0.0_wp                !! |a|
   end type frame_t

   !> The ends of segments are held within the slave edge by bounds with corners rounded over this
   !> fraction of it: so wide that what quadrature leaves of a force where nodes face each other
   !> does not magnify round-off, and the integrals over the strip that changes hands differ by its
   !> square only.
   real(wp), parameter :: end_rounding = 1.0e-2_wp
   integer, parameter :: most_iterations = 50

contains

   !> The frame of local positions `x`.
   pure subroutine frame_init(self, stencil, x)
      type(frame_t), intent(out) :: self
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)            !! (2, n_place)
      real(wp) :: a(2), b(2), t(2, 2)
      integer :: i, k

      a = x(:, place_last) - x(:, place_first)
      do i = 1, 2
         t(:, i) = stencil%weight(i)*(x(:, stencil%tangent(1, i)) - x(:, stencil%tangent(2, i)))
         self%edge_along(i) = dot_product(a, t(:, i))
         self%edge_above(i) = cross(a, t(:, i))
         do k = 1, stencil%n_master
            if (stencil%node(local_master(k)) == 0) cycle
            b = x(:, local_master(k)) - x(:, place_first)
            self%along(i, k) = dot_product(b, t(:, i))
            self%above(i, k) = cross(b, t(:, i))
         end do
      end do
      self%square = [dot_product(t(:, 1), t(:, 1)), dot_product(t(:, 1), t(:, 2)), &
         dot_product(t(:, 2), t(:, 2))]
      self%length = sqrt(dot_product(a, a))
   end subroutine frame_init

   !> Where master node `k` projects to: xi on the line of the edge; beyond its ends the field is
   !> that of the end. The root of docs/theory.md, eq. (15f).
   pure real(wp) function frame_project(self, k)
      type(frame_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_master
      real(wp) :: a, b, c

      associate (p => self%along(:, k), q => self%edge_along)
         if (p(1) <= 0.0_wp) then
            frame_project = p(1)/q(1)
         else if (p(2) >= q(2)) then
            frame_project = p(2)/q(2)
         else
            a = q(1) - q(2)
            b = (p(2) - p(1)) - q(1)
            c = p(1)
            frame_project = 2.0_wp*c/(sqrt(max(0.0_wp, b*b - 4.0_wp*a*c)) - b)
         end if
      end associate
   end function frame_project

   !> Where master node `k` ends a segment: as `frame_project`, but that the field bends over
   !> `end_rounding` into that of the ends of the edge.
   pure real(wp) function frame_meet(self, k)
      type(frame_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_master
      real(wp) :: low, high, value, slope, last, z, dz
      integer :: i

      frame_meet = frame_project(self, k)
      associate (p => self%along(:, k), q => self%edge_along)
         low = merge(0.0_wp, 1.0_wp - end_rounding, frame_meet < 0.5_wp)
         high = low + end_rounding
         if (.not. (frame_meet > low .and. frame_meet < high)) return
         do i = 1, most_iterations
            last = frame_meet
            z = rounded_clip(last, end_rounding)
            dz = rounded_clip_slope(last, end_rounding)
            value = (p(1) - last*q(1)) + z*((p(2) - p(1)) - last*(q(2) - q(1)))
            slope = dz*((p(2) - p(1)) - last*(q(2) - q(1))) - (q(1) + z*(q(2) - q(1)))
            if (value > 0.0_wp) low = last
            if (value < 0.0_wp) high = last
            frame_meet = last - value/slope
            if (.not. (frame_meet >= low .and. frame_meet <= high)) frame_meet = 0.5_wp*(low + high)
            if (.not. abs(frame_meet - last) > epsilon(last)) exit
         end do
      end associate
   end function frame_meet

   !> The master nodes as the slave point `xi` sees them, and the length of its t.
   pure subroutine look(self, xi, along, above, norm)
      type(frame_t), intent(in) :: self
      real(wp), intent(in) :: xi
      real(wp), intent(out) :: along(4), above(4), norm
      real(wp) :: weight(2)

      weight = [1.0_wp - xi, xi]
      along = weight(1)*self%along(1, :) + xi*self%along(2, :) &
         - xi*dot_product(weight, self%edge_along)
      above = weight(1)*self%above(1, :) + xi*self%above(2, :) &
         - xi*dot_product(weight, self%edge_above)
      norm = sqrt(weight(1)**2*self%square(1) + 2.0_wp*weight(1)*xi*self%square(2) &
         + xi**2*self%square(3))
   end subroutine look

   !> Place eta on the master edge that the slave point `xi` looks at, and the gap there:
   !> docs/theory.md, eq. (15g).
   pure subroutine frame_hit(self, stencil, xi, eta, gap)
      type(frame_t), intent(in) :: self
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: xi                 !! on the slave edge, 0 to 1
      real(wp), intent(out) :: eta               !! 0 to 1 within the master edge
      real(wp), intent(out) :: gap               !! [L]
      real(wp) :: along(4), above(4), norm

      call look(self, xi, along, above, norm)
      eta = along(1)/(along(1) - along(2))
      if (stencil%is_smooth) then
         eta = smooth_root(matmul(stencil%shape, along))
         gap = smooth_value(matmul(stencil%shape, above), eta)/norm
      else
         gap = (above(1) + eta*(above(2) - above(1)))/norm
      end if
   end subroutine frame_hit

   !> How the ray from the slave point `xi` leans over the normals of both edges, of the master one
   !> as seen from there: sines, > 0 towards the last node.
   pure subroutine frame_lean(self, xi, slave, master)
      type(frame_t), intent(in) :: self
      real(wp), intent(in) :: xi                 !! on the slave edge, 0 to 1
      real(wp), intent(out) :: slave, master     !! -1 to 1
      real(wp), dimension(size(local_master)) :: along, above
      real(wp) :: norm

      call look(self, xi, along, above, norm)
      slave = sine(dot_product([1.0_wp - xi, xi], self%edge_along), &
         dot_product([1.0_wp - xi, xi], self%edge_above))
      master = -sine(extent(along), extent(above))

   contains

      !> From the first node of the master edge to its last.
      pure real(wp) function extent(place)
         real(wp), intent(in) :: place(:)        !! of master nodes

         extent = place(2) - place(1)
      end function extent

      pure real(wp) function sine(beside, opposite)
         real(wp), intent(in) :: beside, opposite   !! sides of a triangle with a right angle

         sine = opposite/sqrt(beside**2 + opposite**2)
      end function sine

   end subroutine frame_lean

   !> The gap at the slave point `xi` over the master edge and, on a polygon, over its neighbours
   !> where the point looks past its ends: docs/theory.md, eq. (15h).
   pure subroutine frame_point(self, stencil, xi, eta, gap)
      type(frame_t), intent(in) :: self
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: xi                 !! on the slave edge, 0 to 1
      real(wp), intent(out) :: eta               !! 0 to 1 within the master edge
      real(wp), intent(out) :: gap               !! [L]
      real(wp) :: along(4), above(4), norm, slope

      call frame_hit(self, stencil, xi, eta, gap)
      if (stencil%is_smooth .or. stencil%n_master < 4) return
      call look(self, xi, along, above, norm)
      slope = (above(2) - above(1))/(along(2) - along(1))
      if (stencil%node(local_master(4)) > 0) gap = gap &
         + rounded_negative(-along(2), stencil%rounding(2))/norm &
         *((above(4) - above(2))/(along(4) - along(2)) - slope)
      if (stencil%node(local_master(3)) > 0) gap = gap &
         - rounded_negative(along(1), stencil%rounding(1))/norm &
         *((above(1) - above(3))/(along(1) - along(3)) - slope)
   end subroutine frame_point

   !> The root of `smooth_value`, which falls: by Newton's method between bounds, if it is in 0..1.
   pure real(wp) function smooth_root(c)
      real(wp), intent(in) :: c(0:3)
      real(wp) :: low, high, value, last
      integer :: i

      value = smooth_value(c, 1.0_wp)
      if (.not. c(0) > 0.0_wp) then
         smooth_root = -c(0)/c(1)
      else if (.not. value < 0.0_wp) then
         smooth_root = 1.0_wp - value/smooth_slope(c, 1.0_wp)
      else
         low = 0.0_wp
         high = 1.0_wp
         smooth_root = c(0)/(c(0) - value)
         do i = 1, most_iterations
            last = smooth_root
            value = smooth_value(c, last)
            if (value > 0.0_wp) low = last
            if (value < 0.0_wp) high = last
            smooth_root = last - value/smooth_slope(c, last)
            if (.not. (smooth_root >= low .and. smooth_root <= high)) then
               smooth_root = 0.5_wp*(low + high)
            end if
            if (.not. abs(smooth_root - last) > epsilon(last)) exit
         end do
      end if
   end function smooth_root

   !> The cubic with coefficients `c` in 0..1, its tangents beyond.
   pure real(wp) function smooth_value(c, x)
      real(wp), intent(in) :: c(0:3), x
      real(wp) :: inner

      inner = max(0.0_wp, min(1.0_wp, x))
      smooth_value = (c(0) + inner*(c(1) + inner*(c(2) + inner*c(3)))) &
         + (x - inner)*smooth_slope(c, inner)
   end function smooth_value

   !> Slope of the cubic at `x` within 0..1.
   pure real(wp) function smooth_slope(c, x)
      real(wp), intent(in) :: c(0:3), x

      smooth_slope = c(1) + x*(2.0_wp*c(2) + x*3.0_wp*c(3))
   end function smooth_slope

   !> From where to where on the slave edge the master edge covers it; turned round: nowhere.
   pure subroutine frame_cover(self, low, high)
      type(frame_t), intent(in) :: self
      real(wp), intent(out) :: low, high         !! 0 to 1

      low = rounded_clip(frame_meet(self, 2), end_rounding)
      high = rounded_clip(frame_meet(self, 1), end_rounding)
   end subroutine frame_cover

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_mortar_frame
