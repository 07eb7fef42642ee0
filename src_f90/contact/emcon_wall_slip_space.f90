! build: elements
!> Slip of a point along a wall in space over a step: two numbers.
!>
!> The point in the vectors of the wall is three dot products; their changes along two directions
!> that touch the wall where friction acts are slip. So rigid turns of wall and point together are
!> none, and its forces have no resultant and no moment. Source: docs/theory.md, section 14.3.
module emcon_wall_slip_space
   use emcon_frame_slip_space, only : slip_axis_t, tangent_axis, tangent_basis
   use emcon_kinds, only : wp
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_bend, wall_find, wall_spot_t
   implicit none
   private
   public :: wall_slip_t, wall_slip, wall_axis, wall_axis_for, wall_own_normal, n_wall_point

   !> The point, and the origin and tips of vectors of the wall.
   integer, parameter :: n_wall_point = 5, n_dim = 3
   !> A vector that is normal to the wall but for this part of it is none to count slip along.
   real(wp), parameter :: least_along = 0.5_wp

   type :: wall_slip_t
      real(wp) :: f(2) = 0.0_wp                  !! slip over the step [L]
      real(wp) :: g(n_dim, n_wall_point, 2) = 0.0_wp   !! discrete gradients
      real(wp) :: c(n_dim, n_wall_point, 2) = 0.0_wp   !! gradients at the end
      !> (i, j, which) derivative of g(i, which) by coordinate j at the end, if it is asked for
      real(wp) :: h(n_dim*n_wall_point, n_dim*n_wall_point, 2)
   end type wall_slip_t

   !> The coordinates of a point in the vectors of a wall over a step: the way to it from the origin
   !> times each of them.
   type :: places_t
      real(wp), dimension(n_dim) :: start, change !! [L]
      real(wp), dimension(n_dim) :: mean_way, end_way    !! by the length of vectors
      real(wp), dimension(n_dim, n_dim) :: mean_vector, end_vector   !! of length 1
   end type places_t

contains

   !> The first direction is as near to that of `axis` as it can be, which is by the vectors of the
   !> wall.
   pure subroutine wall_slip(wall, x, dx, axis, leaves_second, slip)
      type(wall_t), intent(in) :: wall
      !> Point, origin, tips: where they start, how they move [L]
      real(wp), intent(in) :: x(n_dim, n_wall_point), dx(n_dim, n_wall_point)
      type(slip_axis_t), intent(in) :: axis
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(wall_slip_t), intent(out) :: slip
      type(places_t) :: place
      real(wp) :: basis(n_dim, 2), by_place(n_dim, n_dim, 2), weight(n_dim)
      integer :: i, k

      place = places_of(wall, x, dx)
      call find_basis(wall, place%start + axis%place*place%change, axis%along, basis, by_place)
      do k = 1, 2
         slip%f(k) = dot_product(basis(:, k), place%change)
         slip%g(:, :, k) = sum_of(basis(:, k), place%mean_way, place%mean_vector)
         ! The directions turn with the place at the end.
         do i = 1, n_dim
            weight(i) = basis(i, k) + axis%place*dot_product(place%change, by_place(:, i, k))
         end do
         slip%c(:, :, k) = sum_of(weight, place%end_way, place%end_vector)
      end do
      if (.not. leaves_second) call add_second(wall, place, basis, by_place, slip)
   end subroutine wall_slip

   !> Where the point is in the vectors of the wall.
   pure type(places_t) function places_of(wall, x, dx) result(place)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! as `wall_slip` has them
      real(wp), dimension(n_dim) :: way, change, vector, turn
      integer :: i

      way = x(:, 1) - x(:, 2)
      change = dx(:, 1) - dx(:, 2)
      place%end_way = (way + change)/wall%arm
      place%mean_way = (way + 0.5_wp*change)/wall%arm
      do i = 1, n_dim
         vector = x(:, 2 + i) - x(:, 2)
         turn = dx(:, 2 + i) - dx(:, 2)
         place%end_vector(:, i) = (vector + turn)/wall%arm
         place%mean_vector(:, i) = (vector + 0.5_wp*turn)/wall%arm
         place%start(i) = dot_product(way, vector)/wall%arm
         place%change(i) = dot_product(change, place%mean_vector(:, i)) &
            + dot_product(turn, place%mean_way)
      end do
   end function places_of

   !> Derivatives by all points of a sum of the dot products, from those by the way and the vectors.
   pure function sum_of(weight, way, vector) result(by)
      real(wp), intent(in) :: weight(n_dim)      !! of each
      real(wp), intent(in) :: way(n_dim)         !! by each vector
      real(wp), intent(in) :: vector(n_dim, n_dim)   !! by the way
      real(wp) :: by(n_dim, n_wall_point)
      integer :: i

      by(:, 1) = 0.0_wp
      do i = 1, n_dim
         by(:, 1) = by(:, 1) + weight(i)*vector(:, i)
         by(:, 2 + i) = weight(i)*way
      end do
      by(:, 2) = -(by(:, 1) + sum(weight)*way)
   end function sum_of

   !> Of dot products, and of directions that turn with the place: half of that is by the end, as in
   !> `frame_slip`.
   pure subroutine add_second(wall, place, basis, by_place, slip)
      type(wall_t), intent(in) :: wall
      type(places_t), intent(in) :: place
      real(wp), intent(in) :: basis(:, :), by_place(:, :, :)   !! as `find_basis` has them
      type(wall_slip_t), intent(inout) :: slip
      real(wp), dimension(n_dim, n_wall_point) :: part, turn
      real(wp) :: half
      integer :: a, b, i, j, k

      slip%h = 0.0_wp
      do k = 1, 2
         do i = 1, n_dim
            half = 0.5_wp*basis(i, k)/wall%arm
            do a = 1, n_dim
               associate (h => slip%h(:, :, k), point => a, origin => n_dim + a, &
                     tip => n_dim*(1 + i) + a)
                  h(point, tip) = h(point, tip) + half
                  h(tip, point) = h(tip, point) + half
                  h(tip, origin) = h(tip, origin) - half
                  h(origin, tip) = h(origin, tip) - half
                  h(point, origin) = h(point, origin) - half
                  h(origin, point) = h(origin, point) - half
                  h(origin, origin) = h(origin, origin) + 2.0_wp*half
               end associate
            end do
            if (.not. any(abs(by_place(i, :, k)) > 0.0_wp)) cycle
            part = sum_of(wall_axis(i), place%mean_way, place%mean_vector)
            turn = sum_of(0.5_wp*by_place(i, :, k), place%end_way, place%end_vector)
            do j = 1, n_wall_point
               do b = 1, n_dim
                  do a = 1, n_wall_point
                     associate (rows => slip%h(n_dim*(a - 1) + 1:n_dim*a, n_dim*(j - 1) + b, k))
                        rows = rows + turn(b, j)*part(:, a)
                     end associate
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_second

   !> Vector `i` of the wall in its vectors.
   pure function wall_axis(i) result(axis)
      integer, intent(in) :: i                   !! 1 to 3
      real(wp) :: axis(n_dim)

      axis = 0.0_wp
      axis(i) = 1.0_wp
   end function wall_axis

   !> The vector of the wall that slip is counted along where the wall has a normal: the usual one,
   !> unless it is nearly normal; then, or if there is none, the one that is most along the wall.
   pure integer function wall_axis_for(normal, usual) result(axis)
      real(wp), intent(in) :: normal(n_dim)      !! of `wall_own_normal`
      integer, intent(in), optional :: usual     !! 1 to 3

      axis = minloc(abs(normal), 1)
      if (.not. present(usual)) return
      if (1.0_wp - normal(usual)**2 >= least_along**2) axis = usual
   end function wall_axis_for

   !> The normal of the wall that a point sees, in the vectors of the wall.
   pure function wall_own_normal(wall, at, point) result(normal)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: at(n_dim, n_wall_point - 1)   !! its origin and tips [L]
      real(wp), intent(in) :: point(n_dim)       !! [L]
      real(wp) :: normal(n_dim)
      type(wall_spot_t) :: spot

      spot = wall_find(wall, at, point)
      normal = matmul(spot%normal, at(:, 2:) - spread(at(:, 1), 2, n_dim))/wall%arm
   end function wall_own_normal

   !> Origin and tips of the wall in its vectors.
   pure function own_vectors(wall) result(own)
      type(wall_t), intent(in) :: wall
      real(wp) :: own(n_dim, n_wall_point - 1)   !! [L]
      integer :: i

      own = 0.0_wp
      do i = 1, n_dim
         own(i, 1 + i) = wall%arm
      end do
   end function own_vectors

   !> Directions that touch the wall at a point, in its vectors, and how they turn with that.
   pure subroutine find_basis(wall, point, along, basis, by_place)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: point(n_dim)       !! in the vectors of the wall [L]
      real(wp), intent(in) :: along(n_dim)
      real(wp), intent(out) :: basis(n_dim, 2)
      real(wp), intent(out) :: by_place(n_dim, n_dim, 2)   !! (of, by coordinate, which) [1/L]
      real(wp) :: axis(n_dim), bend(n_dim, n_dim), lean
      type(wall_spot_t) :: spot
      integer :: i

      spot = wall_find(wall, own_vectors(wall), point)
      axis = tangent_axis(spot%normal, along)
      basis = tangent_basis(spot%normal, axis)
      bend = wall_bend(wall, own_vectors(wall), point)
      by_place = 0.0_wp
      if (.not. any(abs(bend) > 0.0_wp)) return  ! its normal does not turn
      lean = dot_product(spot%normal, axis)/norm2(matmul(axis, basis))
      associate (turn => matmul(transpose(basis), bend))
         do i = 1, n_dim
            by_place(:, i, 1) = -turn(1, i)*spot%normal - lean*turn(2, i)*basis(:, 2)
            by_place(:, i, 2) = -turn(2, i)*spot%normal + lean*turn(2, i)*basis(:, 1)
         end do
      end associate
   end subroutine find_basis

end module emcon_wall_slip_space
