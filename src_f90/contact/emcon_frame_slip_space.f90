! build: elements
!> Slip of a point over the plane of a frame of two vectors in space over a step: two numbers.
!>
!> The changes of its affine coordinates, times the vectors of the frame at a place in the step.
!> Each has forces without resultant and moment, and rigid turns are no slip. Source:
!> docs/theory.md, section 14.3.
module emcon_frame_slip_space
   use emcon_frame_vertex_space, only : at_eta, at_xi, frame_affine, frame_of, frame_vertex_t, &
      n_frame_var
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: frame_slip_t, frame_slip, slip_axis_t, tangent_basis, tangent_axis

   !> A direction that is normal to a plane but for this part of it is no direction in the plane.
   real(wp), parameter :: no_direction = 0.1_wp

   !> What slip is counted along, at a place in the step.
   type :: slip_axis_t
      real(wp) :: along(3) = 0.0_wp              !! there, of any length
      real(wp) :: place = 0.0_wp                 !! 0: at the start, 1: at the end; between
   end type slip_axis_t

   type :: frame_slip_t
      real(wp) :: f(2)                           !! slip over the step [L]
      !> By both vectors of the frame and where the point is, from its origin: discrete gradients,
      real(wp) :: g(n_frame_var, 2)
      real(wp) :: c(n_frame_var, 2)              !! gradients at the end,
      !> and (i, j, which) derivative of g(i, which) by variable j at the end, if asked for
      real(wp) :: h(n_frame_var, n_frame_var, 2)
      !> What `c` and `h` have by components of `along` at the end too
      real(wp) :: c_along(3, 2)
      real(wp) :: h_along(n_frame_var, 3, 2)
   end type frame_slip_t

   !> A frame where friction acts, and how directions in its plane turn in that with it.
   type :: frame_turn_t
      real(wp) :: side(3, 2) = 0.0_wp            !! both of its vectors [L]
      real(wp) :: basis(3, 2) = 0.0_wp           !! directions
      real(wp) :: by_side(3, 2) = 0.0_wp         !! of the first to the second, by both [1/L]
      real(wp) :: by_along(3) = 0.0_wp           !! and by what it follows
   end type frame_turn_t

contains

   !> Slip along two directions in the plane of the frame where `axis` is, at right angles: the
   !> first one is as near to that as it can be. Lengths are those of the frame there, too. Friction
   !> that acts there is opposite to slip, however frame and directions turn and stretch meanwhile.
   pure subroutine frame_slip(x, dx, axis, leaves_second, slip)
      !> Origin, tips of both vectors, point: where they start, how they move [L]
      real(wp), intent(in) :: x(3, 4), dx(3, 4)
      type(slip_axis_t), intent(in) :: axis
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(frame_slip_t), intent(out) :: slip
      type(frame_vertex_t) :: vertex
      type(frame_turn_t) :: turn
      real(wp) :: side(3, 2), by(2, 2), second(n_frame_var, n_frame_var, 3)
      integer :: k

      do k = 1, 2
         side(:, k) = (x(:, 1 + k) - x(:, 1)) + axis%place*(dx(:, 1 + k) - dx(:, 1))
      end do
      turn = turn_of(side, axis%along)
      by = matmul(transpose(turn%side), turn%basis)
      call frame_affine(frame_of(x(:, :3), dx(:, :3), leaves_second), x(:, 4), dx(:, 4), vertex, &
         second)
      slip%f = matmul(vertex%df(:at_eta), by)
      slip%g = matmul(vertex%g(:, :at_eta), by)
      slip%c = matmul(vertex%c(:, :at_eta), by)
      do k = 1, 2
         call add_frame_first(turn, k, axis%place, vertex%df(:at_eta), slip)
         if (leaves_second) cycle
         slip%h(:, :, k) = by(at_xi, k)*second(:, :, at_xi) + by(at_eta, k)*second(:, :, at_eta)
         call add_frame_second(turn, k, axis%place, vertex%g(:, :at_eta), slip)
      end do
   end subroutine frame_slip

   !> The first direction stays the part of `along` in the plane: both turn in it as the plane tilts
   !> and as `along` does.
   pure type(frame_turn_t) function turn_of(side, along) result(turn)
      real(wp), intent(in) :: side(3, 2)         !! both vectors of the frame [L]
      real(wp), intent(in) :: along(3)
      real(wp) :: normal(3), axis(3), lean, reach, area

      turn%side = side
      turn%basis = tangent_basis(cross_product(side(:, 1), side(:, 2)), along)
      normal = cross_product(turn%basis(:, 1), turn%basis(:, 2))
      axis = tangent_axis(normal, along)
      lean = dot_product(normal, axis)
      reach = norm2(axis - lean*normal)
      area = dot_product(normal, cross_product(side(:, 1), side(:, 2)))
      associate (second => turn%basis(:, 2))
         turn%by_side(:, 1) = (lean/reach*dot_product(second, cross_product(side(:, 2), normal)) &
            /area)*normal
         turn%by_side(:, 2) = (lean/reach*dot_product(second, cross_product(normal, side(:, 1))) &
            /area)*normal
         if (all(abs(axis - along) <= 0.0_wp)) turn%by_along = second/reach
      end associate
   end function turn_of

   !> What the frame changes slip `k` by.
   pure subroutine add_frame_first(turn, k, place, change, slip)
      type(frame_turn_t), intent(in) :: turn
      integer, intent(in) :: k
      real(wp), intent(in) :: place              !! of `slip_axis_t`
      real(wp), intent(in) :: change(:)          !! (2) of affine coordinates
      type(frame_slip_t), intent(inout) :: slip
      integer :: m

      associate (other => merge(place, -place, k == 1)*slip%f(3 - k))
         do m = 1, 2
            associate (own => slip%c(3*m - 2:3*m, k))
               own = own + (place*change(m))*turn%basis(:, k) + other*turn%by_side(:, m)
            end associate
         end do
         slip%c_along(:, k) = other*turn%by_along
      end associate
   end subroutine add_frame_first

   !> What it changes the discrete gradient of slip `k` by: nothing by the end where the frame is
   !> that of the start. Where it is that of the end, steps end as they start, and half is by each.
   pure subroutine add_frame_second(turn, k, place, g, slip)
      type(frame_turn_t), intent(in) :: turn
      integer, intent(in) :: k
      real(wp), intent(in) :: place              !! of `slip_axis_t`
      real(wp), intent(in) :: g(:, :)            !! (n_frame_var, 2) of affine coordinates
      type(frame_slip_t), intent(inout) :: slip
      real(wp) :: part
      integer :: j, m

      part = min(0.5_wp, place)
      associate (other => merge(part, -part, k == 1)*slip%g(:, 3 - k))
         do j = 1, 3
            do m = 1, 2
               associate (own => slip%h(:, 3*(m - 1) + j, k))
                  own = own + (part*turn%basis(j, k))*g(:, m) + turn%by_side(j, m)*other
               end associate
            end do
            slip%h_along(:, j, k) = turn%by_along(j)*other
         end do
      end associate
   end subroutine add_frame_second

   !> Two directions at right angles to `normal` and to each other, of length 1: the first one as
   !> near to `tangent_axis` as it can be.
   pure function tangent_basis(normal, along) result(basis)
      real(wp), intent(in) :: normal(3), along(3)   !! not 0, of any length
      real(wp) :: basis(3, 2)
      real(wp) :: unit(3), part(3)

      unit = normal/norm2(normal)
      part = tangent_axis(unit, along)
      part = part - dot_product(part, unit)*unit
      basis(:, 1) = part/norm2(part)
      basis(:, 2) = cross_product(unit, basis(:, 1))
   end function tangent_basis

   !> `along`, unless that is nearly normal: then the axis that is least so.
   pure function tangent_axis(unit, along) result(axis)
      real(wp), intent(in) :: unit(3)            !! normal, of length 1
      real(wp), intent(in) :: along(3)           !! of any length
      real(wp) :: axis(3)

      axis = along
      if (norm2(along - dot_product(along, unit)*unit) > no_direction*norm2(along)) return
      axis = 0.0_wp
      axis(minloc(abs(unit), 1)) = 1.0_wp
   end function tangent_axis

end module emcon_frame_slip_space
