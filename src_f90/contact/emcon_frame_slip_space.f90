!> Slip of a point over the plane of a frame of two vectors in space over a step: two numbers.
!>
!> The changes of its affine coordinates, times the vectors of the frame as the step begins. Each
!> has forces without resultant and moment, and rigid turns are no slip. Source: docs/theory.md,
!> section 14.3.
module emcon_frame_slip_space
   use emcon_frame_vertex_space, only : at_eta, at_xi, frame_affine, frame_of, frame_vertex_t, &
      n_frame_var
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: frame_slip_t, frame_slip, tangent_basis, tangent_axis

   !> A direction that is normal to a plane but for this part of it is no direction in the plane.
   real(wp), parameter :: no_direction = 0.1_wp

   type :: frame_slip_t
      real(wp) :: f(2) = 0.0_wp                  !! slip over the step [L]
      !> By both vectors of the frame and where the point is, from its origin: discrete gradients,
      real(wp) :: g(n_frame_var, 2) = 0.0_wp
      real(wp) :: c(n_frame_var, 2) = 0.0_wp     !! gradients at the end,
      !> and (i, j, which) derivative of g(i, which) by variable j at the end; 0 if not asked for
      real(wp) :: h(n_frame_var, n_frame_var, 2) = 0.0_wp
      !> Where the step ends as it starts: `h` has what the frame as the step begins turns and
      !> stretches by, too, half of it as of the rest. This is by components of `along` [1/L]
      real(wp) :: by_along(n_frame_var, 3, 2) = 0.0_wp
   end type frame_slip_t

contains

   !> Slip along two directions in the plane of the frame as the step begins, at right angles: the
   !> first one is as near to `along` as it can be.
   pure subroutine frame_slip(x, dx, along, leaves_second, ends_at_start, slip)
      !> Origin, tips of both vectors, point: where they start, how they move [L]
      real(wp), intent(in) :: x(3, 4), dx(3, 4)
      real(wp), intent(in) :: along(3)           !! of any length
      logical, intent(in) :: leaves_second       !! no second derivatives
      logical, intent(in) :: ends_at_start       !! nothing moves: start and end are one place
      type(frame_slip_t), intent(out) :: slip
      type(frame_vertex_t) :: place
      real(wp) :: a(3), b(3), basis(3, 2), second(n_frame_var, n_frame_var, 3)
      integer :: k

      a = x(:, 2) - x(:, 1)
      b = x(:, 3) - x(:, 1)
      basis = tangent_basis(cross_product(a, b), along)
      call frame_affine(frame_of(x(:, :3), dx(:, :3), leaves_second), x(:, 4), dx(:, 4), place, &
         second)
      do k = 1, 2
         associate (by_xi => dot_product(basis(:, k), a), by_eta => dot_product(basis(:, k), b))
            slip%f(k) = by_xi*place%df(at_xi) + by_eta*place%df(at_eta)
            slip%g(:, k) = by_xi*place%g(:, at_xi) + by_eta*place%g(:, at_eta)
            slip%c(:, k) = by_xi*place%c(:, at_xi) + by_eta*place%c(:, at_eta)
            if (leaves_second) cycle
            slip%h(:, :, k) = by_xi*second(:, :, at_xi) + by_eta*second(:, :, at_eta)
         end associate
      end do
      if (ends_at_start .and. .not. leaves_second) call add_frame(a, b, along, basis, place%g, slip)
   end subroutine frame_slip

   !> What directions and lengths of the frame change gradients by. The first direction stays the
   !> part of `along` in the plane: both turn in it by the rate `turn`, as the plane tilts and as
   !> `along` does.
   pure subroutine add_frame(a, b, along, basis, g, slip)
      real(wp), intent(in) :: a(3), b(3), along(3)
      real(wp), intent(in) :: basis(3, 2)        !! the directions
      real(wp), intent(in) :: g(:, :)            !! (n_frame_var, 3) gradients of places
      type(frame_slip_t), intent(inout) :: slip
      real(wp) :: normal(3), axis(3), turn(3, 2), lean, reach
      integer :: j, k

      normal = cross_product(basis(:, 1), basis(:, 2))
      axis = tangent_axis(normal, along)
      lean = dot_product(normal, axis)
      reach = norm2(axis - lean*normal)
      associate (area => dot_product(normal, cross_product(a, b)))
         turn(:, 1) = lean/reach*dot_product(basis(:, 2), cross_product(b, normal))/area*normal
         turn(:, 2) = lean/reach*dot_product(basis(:, 2), cross_product(normal, a))/area*normal
      end associate
      do k = 1, 2
         associate (other => merge(0.5_wp, -0.5_wp, k == 1)*slip%g(:, 3 - k))
            do j = 1, 3
               slip%h(:, j, k) = slip%h(:, j, k) + 0.5_wp*basis(j, k)*g(:, at_xi) &
                  + turn(j, 1)*other
               slip%h(:, 3 + j, k) = slip%h(:, 3 + j, k) + 0.5_wp*basis(j, k)*g(:, at_eta) &
                  + turn(j, 2)*other
               if (all(abs(axis - along) <= 0.0_wp)) slip%by_along(:, j, k) = &
                  basis(j, 2)/reach*other
            end do
         end associate
      end do
   end subroutine add_frame

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
