!> Corners of a profile of lines and arcs made round: FILLET RADIUS.
!>
!> The centre of the arc in a corner is as far from both of its sides, on the side that the profile
!> turns to: where curves at that distance from them meet. Its ends are the feet of the centre.
module emcon_profile_fillet_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: segment_t, round_corners

   !> What a profile goes on with, a line or an arc of less than half a turn; the first one is where
   !> it begins.
   type :: segment_t
      logical :: is_arc = .false.
      real(wp) :: to(2) = 0.0_wp                 !! [L]
      real(wp) :: centre(2) = 0.0_wp             !! of an arc [L]
   end type segment_t

   !> A segment between its ends.
   type :: side_t
      real(wp) :: from(2), to(2)                 !! [L]
      real(wp) :: centre(2) = 0.0_wp             !! of an arc [L]
      real(wp) :: radius = 0.0_wp                !! of an arc [L]; 0: a line
      real(wp) :: turn = 0.0_wp                  !! of an arc: 1 to the left, -1 to the right
      real(wp) :: way = 0.0_wp                   !! along it, length or angle [L or rad]
   end type side_t

   !> An arc in a corner.
   type :: fillet_t
      logical :: is_there = .false.
      real(wp) :: centre(2) = 0.0_wp             !! [L]
      real(wp) :: from(2) = 0.0_wp               !! where it begins and ends [L]
      real(wp) :: to(2) = 0.0_wp
   end type fillet_t

   !> Sides that turn by less are smooth [rad]: data lines have few digits.
   real(wp), parameter :: smooth = 1.0e-3_wp
   !> Of a side that two fillets leave nothing of.
   real(wp), parameter :: rounding = 1.0e-6_wp

contains

   !> Put an arc into each corner. `corner` is the number of one that has no room for it, by the
   !> segment that ends there, or 0.
   pure subroutine round_corners(segment, radius, is_closed, corner)
      type(segment_t), allocatable, intent(inout) :: segment(:)  !! (n > 1) kept where it fails
      real(wp), intent(in) :: radius             !! > 0 [L]
      logical, intent(in) :: is_closed           !! the last one ends where the first one begins
      integer, intent(out) :: corner
      type(side_t), allocatable :: side(:)
      type(fillet_t), allocatable :: fillet(:)
      logical :: is_well
      integer :: i, n

      n = size(segment) - 1
      allocate(side(n), fillet(n))
      do i = 1, n
         side(i) = side_of(segment(i)%to, segment(i + 1))
      end do
      corner = 0
      do i = 1, merge(n, n - 1, is_closed)
         call find_fillet(side(i), side(1 + mod(i, n)), radius, fillet(i), is_well)
         if (.not. is_well) corner = i + 1
      end do
      do i = 1, n
         if (fillet(1 + mod(i + n - 2, n))%is_there .or. fillet(i)%is_there) then
            if (left_of(side(i), fillet(1 + mod(i + n - 2, n)), fillet(i)) < -rounding) then
               corner = i + 1
            end if
         end if
      end do
      if (corner == 0) call lay(segment, side, fillet)
   end subroutine round_corners

   pure type(side_t) function side_of(from, segment) result(side)
      real(wp), intent(in) :: from(2)
      type(segment_t), intent(in) :: segment

      side%from = from
      side%to = segment%to
      side%way = norm2(side%to - from)
      if (.not. segment%is_arc) return
      side%centre = segment%centre
      side%radius = norm2(from - side%centre)
      side%way = angle_of(from - side%centre, side%to - side%centre)
      side%turn = sign(1.0_wp, side%way)
      side%way = abs(side%way)
   end function side_of

   !> From `a` to `b`, > 0 to the left.
   pure real(wp) function angle_of(a, b)
      real(wp), intent(in) :: a(2), b(2)

      angle_of = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
   end function angle_of

   !> To the left of `a`.
   pure function left(a)
      real(wp), intent(in) :: a(2)
      real(wp) :: left(2)

      left = [-a(2), a(1)]
   end function left

   !> Of a side at one of its points, of length 1.
   pure function direction(side, at)
      type(side_t), intent(in) :: side
      real(wp), intent(in) :: at(2)
      real(wp) :: direction(2)

      if (side%radius > 0.0_wp) then
         direction = side%turn*left(at - side%centre)/norm2(at - side%centre)
      else
         direction = (side%to - side%from)/side%way
      end if
   end function direction

   !> The arc between two sides, if they meet in a corner and there is one.
   pure subroutine find_fillet(one, next, radius, fillet, is_well)
      type(side_t), intent(in) :: one, next
      real(wp), intent(in) :: radius
      type(fillet_t), intent(out) :: fillet
      logical, intent(out) :: is_well            !! there is such an arc, or no corner
      real(wp) :: angle, place(2)

      angle = angle_of(direction(one, one%to), direction(next, next%from))
      is_well = .true.
      if (abs(angle) <= smooth) return
      place = sign(radius, angle)
      call meet(one, next, place, fillet%centre, is_well)
      if (.not. is_well) return
      fillet%from = foot(one, fillet%centre)
      fillet%to = foot(next, fillet%centre)
      fillet%is_there = .true.
   end subroutine find_fillet

   !> The point nearest to the corner that is `off(i)` to the left of side i.
   pure subroutine meet(one, next, off, point, is_there)
      type(side_t), intent(in) :: one, next
      real(wp), intent(in) :: off(2)             !! [L]
      real(wp), intent(out) :: point(2)
      logical, intent(out) :: is_there
      real(wp) :: radius(2)

      radius = [one%radius - one%turn*off(1), next%radius - next%turn*off(2)]
      is_there = all(radius > 0.0_wp .or. [one%radius, next%radius] <= 0.0_wp)
      point = one%to
      if (.not. is_there) return
      if (one%radius > 0.0_wp .and. next%radius > 0.0_wp) then
         call circles_meet(one%centre, radius(1), next%centre, radius(2), one%to, point, is_there)
      else if (one%radius > 0.0_wp) then
         call line_meets(next%from + off(2)*left(direction(next, next%from)), direction(next, &
            next%from), one%centre, radius(1), one%to, point, is_there)
      else if (next%radius > 0.0_wp) then
         call line_meets(one%to + off(1)*left(direction(one, one%to)), direction(one, one%to), &
            next%centre, radius(2), one%to, point, is_there)
      else
         associate (a => direction(one, one%to), b => direction(next, next%from))
            is_there = abs(a(1)*b(2) - a(2)*b(1)) > 0.0_wp
            if (is_there) point = one%to + (off(1)*b - off(2)*a)/(a(1)*b(2) - a(2)*b(1))
         end associate
      end if
   end subroutine meet

   !> Where the line through `at` along `along` meets a circle, nearest to `near`.
   pure subroutine line_meets(at, along, centre, radius, near, point, is_there)
      real(wp), intent(in) :: at(2), along(2), centre(2), radius, near(2)
      real(wp), intent(out) :: point(2)
      logical, intent(out) :: is_there
      real(wp) :: middle(2), square

      middle = at + dot_product(centre - at, along)*along
      square = radius**2 - dot_product(centre - middle, centre - middle)
      is_there = square >= 0.0_wp
      point = nearer(middle, sqrt(max(square, 0.0_wp))*along, near)
   end subroutine line_meets

   !> Where two circles meet, nearest to `near`.
   pure subroutine circles_meet(a, radius_a, b, radius_b, near, point, is_there)
      real(wp), intent(in) :: a(2), radius_a, b(2), radius_b, near(2)
      real(wp), intent(out) :: point(2)
      logical, intent(out) :: is_there
      real(wp) :: d, part, square

      d = norm2(b - a)
      is_there = d > 0.0_wp
      point = near
      if (.not. is_there) return
      part = 0.5_wp*(d + (radius_a - radius_b)*(radius_a + radius_b)/d)
      square = (radius_a - part)*(radius_a + part)
      is_there = square >= 0.0_wp
      point = nearer(a + part*(b - a)/d, sqrt(max(square, 0.0_wp))*left(b - a)/d, near)
   end subroutine circles_meet

   !> That of `middle + way` and `middle - way` which is nearer to `near`.
   pure function nearer(middle, way, near)
      real(wp), intent(in) :: middle(2), way(2), near(2)
      real(wp) :: nearer(2)

      nearer = middle + sign(1.0_wp, dot_product(near - middle, way))*way
   end function nearer

   !> The point of a side nearest to `point`.
   pure function foot(side, point)
      type(side_t), intent(in) :: side
      real(wp), intent(in) :: point(2)
      real(wp) :: foot(2)

      if (side%radius > 0.0_wp) then
         foot = side%centre + side%radius*(point - side%centre)/norm2(point - side%centre)
      else
         associate (along => direction(side, side%from))
            foot = side%from + dot_product(point - side%from, along)*along
         end associate
      end if
   end function foot

   !> What the fillets at both ends leave of a side, as a part of it.
   pure real(wp) function left_of(side, before, behind)
      type(side_t), intent(in) :: side
      type(fillet_t), intent(in) :: before, behind
      real(wp) :: cut(2)

      cut = 0.0_wp
      if (before%is_there) cut(1) = way_between(side, side%from, before%to)
      if (behind%is_there) cut(2) = way_between(side, behind%from, side%to)
      left_of = 1.0_wp - sum(cut)/side%way
      if (any(cut < 0.0_wp)) left_of = -1.0_wp
   end function left_of

   !> Along a side.
   pure real(wp) function way_between(side, from, to)
      type(side_t), intent(in) :: side
      real(wp), intent(in) :: from(2), to(2)

      if (side%radius > 0.0_wp) then
         way_between = side%turn*angle_of(from - side%centre, to - side%centre)
      else
         way_between = dot_product(to - from, direction(side, side%from))
      end if
   end function way_between

   !> The segments with their fillets. Of a side of which nothing is left there is none.
   pure subroutine lay(segment, side, fillet)
      type(segment_t), allocatable, intent(inout) :: segment(:)
      type(side_t), intent(in) :: side(:)
      type(fillet_t), intent(in) :: fillet(:)
      type(segment_t) :: made(1 + 2*size(side))
      integer :: before, i, k, n

      n = size(side)
      made(1) = segment(1)
      if (fillet(n)%is_there) made(1)%to = fillet(n)%to
      k = 1
      do i = 1, n
         before = 1 + mod(i + n - 2, n)
         if (left_of(side(i), fillet(before), fillet(i)) > rounding) then
            k = k + 1
            made(k) = segment(i + 1)
            if (fillet(i)%is_there) made(k)%to = fillet(i)%from
         end if
         if (.not. fillet(i)%is_there) cycle
         k = k + 1
         made(k) = segment_t(.true., fillet(i)%to, fillet(i)%centre)
      end do
      segment = made(:k)
   end subroutine lay

end module emcon_profile_fillet_plane
