!> Walls of all kinds, about size 1.
module wall_shapes
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   implicit none
   private
   public :: make_wall, turned

   !> A plane, a ball, a bowl; a knob and a tube, turned; a rail and a groove, drawn.
   integer, parameter, public :: n_shape = 7
   !> Vectors have length 1 here.
   real(wp), parameter, public :: unit = 1.0_wp

contains

   !> Shape `number`.
   subroutine make_wall(number, wall)
      integer, intent(in) :: number
      type(wall_t), intent(out) :: wall
      real(wp), parameter :: half = sqrt(0.5_wp)

      wall%arm = unit
      wall%extent = 2.0_wp
      wall%radius = 1.0_wp
      select case (number)
      case (1)
         wall%kind = wall_flat
      case (2, 3)
         wall%kind = wall_round
         wall%bulge = real(5 - 2*number, wp)
      case (4)                                   ! from its round top down its side
         wall%kind = wall_turned
         wall%piece = [arc([0.0_wp, 1.0_wp], [0.6_wp, 0.8_wp], [0.0_wp, 0.0_wp]), &
            line([0.6_wp, 0.8_wp], [0.9_wp, 0.575_wp]), &
            line([0.9_wp, 0.575_wp], [0.9_wp, -1.0_wp])]
         wall%is_open = [.false., .true.]
      case (5)                                   ! a tube with a round mouth, bodies in it
         wall%kind = wall_turned
         wall%piece = [line([0.8_wp, -1.0_wp], [0.8_wp, 0.5_wp]), &
            arc([0.8_wp, 0.5_wp], [1.3_wp, 1.0_wp], [1.3_wp, 0.5_wp])]
         wall%is_open = .true.
      case (6)
         wall%kind = wall_drawn
         wall%piece = [line([-2.0_wp, 0.0_wp], [0.0_wp, 0.0_wp]), &
            arc([0.0_wp, 0.0_wp], [half, half - 1.0_wp], [0.0_wp, -1.0_wp]), &
            line([half, half - 1.0_wp], [2.0_wp*half, -1.0_wp])]
         wall%is_open = .true.
      case (7)
         wall%kind = wall_drawn
         wall%piece = [arc([-1.0_wp, 0.0_wp], [0.0_wp, -1.0_wp], [0.0_wp, 0.0_wp]), &
            arc([0.0_wp, -1.0_wp], [1.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])]
         wall%is_open = .true.
      end select
   end subroutine make_wall

   pure type(profile_piece_t) function line(from, to)
      real(wp), intent(in) :: from(2), to(2)

      line%from = from
      line%to = to
      line%length = norm2(to - from)
      line%along = (to - from)/line%length
      line%leaves = line%along
   end function line

   pure type(profile_piece_t) function arc(from, to, centre)
      real(wp), intent(in) :: from(2), to(2), centre(2)
      real(wp) :: a(2), b(2)

      a = from - centre
      b = to - centre
      arc%from = from
      arc%to = to
      arc%centre = centre
      arc%radius = norm2(a)
      arc%bulge = -sign(1.0_wp, a(1)*b(2) - a(2)*b(1))
      arc%length = arc%radius*acos(dot_product(a, b)/arc%radius**2)
      arc%along = arc%bulge*[a(2), -a(1)]/arc%radius
      arc%leaves = arc%bulge*[b(2), -b(1)]/arc%radius
   end function arc

   !> About two axes.
   pure function turned(angle) result(turn)
      real(wp), intent(in) :: angle(3)
      real(wp) :: turn(3, 3), one(3, 3)

      one = 0.0_wp
      one(3, 3) = 1.0_wp
      one(1, :2) = [cos(angle(1)), -sin(angle(1))]
      one(2, :2) = [sin(angle(1)), cos(angle(1))]
      turn = 0.0_wp
      turn(1, 1) = 1.0_wp
      turn(2, 2:) = [cos(angle(2)), -sin(angle(2))]
      turn(3, 2:) = [sin(angle(2)), cos(angle(2))]
      turn = matmul(turn, one)
   end function turned

end module wall_shapes
