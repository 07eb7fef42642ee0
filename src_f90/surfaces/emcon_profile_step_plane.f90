!> How far a point is from a profile over a step, with its discrete gradient by both coordinates.
!>
!> Along one piece it has a closed form. On a straight way past several of them each counts with its
!> part of the way. Source: docs/theory.md, section 14.1.
module emcon_profile_step_plane
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_profile_plane, only : profile_find, profile_place_t, profile_slope, profile_value
   use emcon_wall, only : wall_t
   implicit none
   private
   public :: profile_step_t, profile_step

   !> A remainder below so many epsilons of what it is the difference of is round-off.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)

   type :: profile_step_t
      integer :: piece = 0                       !! the one that is passed; 0: several
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp       !! distance at both ends [L]
      real(wp) :: g(2) = 0.0_wp                  !! discrete gradient
      real(wp) :: c(2) = 0.0_wp                  !! gradient at the end
      real(wp) :: h(2, 2) = 0.0_wp               !! (i, j): derivative of g(i) by the end [1/L]
   end type profile_step_t

   !> A place on the way: which part of it lies behind, and how that changes with the end.
   type :: mark_t
      real(wp) :: part = 0.0_wp                  !! 0 to 1
      real(wp) :: slope(2) = 0.0_wp              !! [1/L]
   end type mark_t

contains

   !> The distance of a point over its way from `p` by `dp`.
   pure subroutine profile_step(wall, p, dp, step)
      type(wall_t), intent(in) :: wall           !! with a profile
      real(wp), intent(in) :: p(2), dp(2)        !! [L]
      type(profile_step_t), intent(out) :: step
      type(profile_place_t) :: from, to
      type(mark_t) :: mark(0:1)
      integer :: k, n, stride, left

      from = profile_find(wall, p)
      to = profile_find(wall, p + dp)
      step%f0 = from%distance
      step%f1 = to%distance
      step%c = profile_slope(wall%piece(to%piece), p + dp)
      call find_stride(wall, from%piece, to%piece, stride, left)
      if (left == 0) step%piece = from%piece
      n = size(wall%piece)
      k = from%piece
      do
         mark(1) = mark_t(1.0_wp)
         if (left > 0) call find_mark(wall%piece(k), wall%piece(1 + modulo(k - 1 + stride, n)), &
            stride, p, dp, mark(0)%part, mark(1))
         call add_part(wall%piece(k), p, dp, mark, step)
         if (left == 0) exit
         k = 1 + modulo(k - 1 + stride, n)
         left = left - 1
         mark(0) = mark(1)
      end do
      if (step%piece == 0) call close_sum(dp, step)
   end subroutine profile_step

   !> The way along the profile from one piece to another: forwards or backwards, by `left` pieces.
   pure subroutine find_stride(wall, from, to, stride, left)
      type(wall_t), intent(in) :: wall
      integer, intent(in) :: from, to
      integer, intent(out) :: stride, left

      stride = sign(1, to - from)
      left = abs(to - from)
      if (.not. wall%is_ring .or. 2*left <= size(wall%piece)) return
      stride = -stride
      left = size(wall%piece) - left
   end subroutine find_stride

   !> Where the way leaves `piece` over the line that halves the corner to the next one. No earlier
   !> than at the part `after` of the way.
   pure subroutine find_mark(piece, next, stride, p, dp, after, mark)
      type(profile_piece_t), intent(in) :: piece, next
      integer, intent(in) :: stride              !! 1: it is left at its end; -1: at its start
      real(wp), intent(in) :: p(2), dp(2)        !! [L]
      real(wp), intent(in) :: after
      type(mark_t), intent(out) :: mark
      real(wp) :: corner(2), along(2), speed

      if (stride > 0) then
         corner = piece%to
         along = piece%leaves + next%along
      else
         corner = piece%from
         along = piece%along + next%leaves
      end if
      speed = dot_product(along, dp)
      mark%part = after
      if (.not. abs(speed) > 0.0_wp) return
      mark%part = dot_product(along, corner - p)/speed
      if (mark%part > after .and. mark%part < 1.0_wp) then
         mark%slope = -(mark%part/speed)*along
      else
         mark%part = min(1.0_wp, max(after, mark%part))
      end if
   end subroutine find_mark

   !> Add what `piece` has of the gradient, on the way between two marks.
   pure subroutine add_part(piece, p, dp, mark, step)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: p(2), dp(2)        !! [L]
      type(mark_t), intent(in) :: mark(0:1)
      type(profile_step_t), intent(inout) :: step
      real(wp) :: g(2), by_end(2, 2, 0:1), moves(2, 2)
      integer :: end

      call piece_gradient(piece, p + mark(0)%part*dp, p + mark(1)%part*dp, g, by_end)
      associate (part => mark(1)%part - mark(0)%part)
         step%g = step%g + part*g
         step%h = step%h + outer(g, mark(1)%slope - mark(0)%slope)
         do end = 0, 1
            moves = outer(dp, mark(end)%slope)
            moves(1, 1) = moves(1, 1) + mark(end)%part
            moves(2, 2) = moves(2, 2) + mark(end)%part
            step%h = step%h + part*matmul(by_end(:, :, end), moves)
         end do
      end associate
   end subroutine add_part

   !> The discrete gradient of the distance from the line or circle of a piece between two points,
   !> and how it changes with these.
   pure subroutine piece_gradient(piece, a, b, g, by_end)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: a(2), b(2)         !! [L]
      real(wp), intent(out) :: g(2)
      real(wp), intent(out) :: by_end(2, 2, 0:1) !! (i, j, end) [1/L]
      real(wp) :: total, arm(2, 0:1), radius(0:1)
      integer :: end

      by_end = 0.0_wp
      g = profile_slope(piece, a)
      if (.not. abs(piece%bulge) > 0.0_wp) return
      arm(:, 0) = a - piece%centre
      arm(:, 1) = b - piece%centre
      radius = sqrt(sum(arm**2, 1))
      total = sum(radius)
      if (.not. minval(radius) > 0.0_wp) return
      g = piece%bulge/total*sum(arm, 2)
      do end = 0, 1
         by_end(:, :, end) = -outer(g, arm(:, end))/(radius(end)*total)
         by_end(1, 1, end) = by_end(1, 1, end) + piece%bulge/total
         by_end(2, 2, end) = by_end(2, 2, end) + piece%bulge/total
      end do
   end subroutine piece_gradient

   !> Where distances from two pieces differ on the line between them, as away from a corner of an
   !> arc, the gradient lacks that: it is put on the way.
   pure subroutine close_sum(dp, step)
      real(wp), intent(in) :: dp(2)              !! [L]
      type(profile_step_t), intent(inout) :: step
      real(wp) :: rest, square, ratio, by_rest(2)

      square = dot_product(dp, dp)
      if (.not. square > 0.0_wp) return
      rest = (step%f1 - step%f0) - dot_product(step%g, dp)
      ratio = (rest/(rounding*(abs(step%f0) + abs(step%f1) + sqrt(square))))**2
      ratio = merge(ratio/(1.0_wp + ratio), 1.0_wp, ratio <= huge(ratio))
      by_rest = ratio*(3.0_wp - 2.0_wp*ratio)*(step%c - step%g - matmul(dp, step%h))
      step%g = step%g + (ratio*rest/square)*dp
      step%h = step%h + outer(dp, by_rest)/square - (2.0_wp*ratio*rest/square**2)*outer(dp, dp)
      step%h(1, 1) = step%h(1, 1) + ratio*rest/square
      step%h(2, 2) = step%h(2, 2) + ratio*rest/square
   end subroutine close_sum

   pure function outer(a, b)
      real(wp), intent(in) :: a(2), b(2)
      real(wp) :: outer(2, 2)

      outer = spread(a, 2, 2)*spread(b, 1, 2)
   end function outer

end module emcon_profile_step_plane
