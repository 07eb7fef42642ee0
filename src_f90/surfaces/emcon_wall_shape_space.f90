!> Walls as faces, to be looked at: grids of quadrilaterals over their curves, whose right-hand
!> normals point out of the body.
module emcon_wall_shape_space
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   implicit none
   private
   public :: wall_shape_t, wall_shape_make

   real(wp), parameter :: half_turn = acos(-1.0_wp)
   !> Sides of quadrilaterals: along what is flat or a sixth of a sphere, of a turn, of arcs.
   integer, parameter :: n_along = 8, n_turn = 48
   real(wp), parameter :: arc = half_turn/24
   integer, parameter :: n_dim = 3

   type :: wall_shape_t
      !> (n_dim, n_point) along the vectors of the wall, from its origin [L]
      real(wp), allocatable :: point(:, :)
      integer, allocatable :: cell(:, :)         !! (4, n_cell) points, in turn
   end type wall_shape_t

contains

   !> The faces of a wall. What has no end goes so far from `middle` as `reach`.
   pure subroutine wall_shape_make(self, wall, middle, reach)
      type(wall_shape_t), intent(out) :: self
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: middle(n_dim)      !! along the vectors of the wall [L]
      real(wp), intent(in) :: reach              !! [L]
      integer, allocatable :: n_cell(:, :)
      integer :: grid, i, j, n_point, m

      call count_cells(wall, n_cell)
      allocate(self%point(n_dim, sum(product(n_cell + 1, 1))))
      allocate(self%cell(4, sum(product(n_cell, 1))))
      n_point = 0
      m = 0
      do grid = 1, size(n_cell, 2)
         associate (n => n_cell(1, grid))
            do j = 0, n_cell(2, grid)
               do i = 0, n
                  n_point = n_point + 1
                  self%point(:, n_point) = place(wall, grid, real(i, wp)/n, &
                     real(j, wp)/n_cell(2, grid), middle, reach)
                  if (i == 0 .or. j == 0) cycle
                  m = m + 1
                  self%cell(:, m) = n_point - [n + 2, n + 1, 0, 1]
               end do
            end do
         end associate
      end do
   end subroutine wall_shape_make

   !> A plane is one grid, a sphere are the six of a cube, and a profile has one for each piece.
   pure subroutine count_cells(wall, n_cell)
      type(wall_t), intent(in) :: wall
      integer, allocatable, intent(out) :: n_cell(:, :)  !! (2, n_grid)
      integer :: k

      select case (wall%kind)
      case (wall_flat)
         allocate(n_cell(2, 1), source=n_along)
      case (wall_round)
         allocate(n_cell(2, 2*n_dim), source=n_along)
      case default
         allocate(n_cell(2, size(wall%piece)), source=1)
         do k = 1, size(wall%piece)
            associate (piece => wall%piece(k))
               if (abs(piece%bulge) > 0.0_wp) n_cell(1, k) = &
                  max(1, ceiling(piece%length/(arc*piece%radius)))
            end associate
         end do
         n_cell(2, :) = merge(n_turn, n_along, wall%kind == wall_turned)
      end select
   end subroutine count_cells

   !> The point of a grid at two numbers from 0 to 1.
   pure function place(wall, grid, s, t, middle, reach) result(point)
      type(wall_t), intent(in) :: wall
      integer, intent(in) :: grid
      real(wp), intent(in) :: s, t
      real(wp), intent(in) :: middle(n_dim), reach       !! [L]
      real(wp) :: point(n_dim)
      real(wp) :: at(2), sign_of
      integer :: axis

      select case (wall%kind)
      case (wall_flat)
         point = [0.0_wp, middle(2:) + reach*(2.0_wp*[s, t] - 1.0_wp)]
      case (wall_round)
         axis = mod(grid - 1, n_dim) + 1
         sign_of = merge(1.0_wp, -1.0_wp, grid <= n_dim)
         at = tan(0.25_wp*half_turn*(2.0_wp*[s, t] - 1.0_wp))
         point = cshift([sign_of, sign_of*wall%bulge*at(1), at(2)], 1 - axis)
         point = wall%radius/norm2(point)*point
      case (wall_turned)
         at = on_piece(wall%piece(grid), s)
         point = [at(2), at(1)*cos(2.0_wp*half_turn*t), at(1)*sin(2.0_wp*half_turn*t)]
      case (wall_drawn)
         point = [on_piece(wall%piece(grid), s), middle(n_dim) + reach*(1.0_wp - 2.0_wp*t)]
      end select
   end function place

   !> The place at a part of the length of a piece.
   pure function on_piece(piece, part) result(at)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: part
      real(wp) :: at(2)
      real(wp) :: angle

      if (abs(piece%bulge) > 0.0_wp) then
         angle = part*piece%length/piece%radius
         at = piece%centre + cos(angle)*(piece%from - piece%centre) &
            + piece%radius*sin(angle)*piece%along
      else
         at = piece%from + part*piece%length*piece%along
      end if
   end function on_piece

end module emcon_wall_shape_space
