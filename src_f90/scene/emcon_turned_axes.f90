!> Nodes whose degrees of freedom are along axes of their own: *TRANSFORM.
!>
!> What is prescribed along such an axis is prescribed at a stand-in: a node without mass and
!> stiffness, whose displacements are those of the node along its axes, by equations.
module emcon_turned_axes
   use emcon_kinds, only : dp, wp
   use emcon_origin, only : origin_t
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: turned_axes_t, turned_marks, rectangular_axes, cylindrical_axes, aligned_with
   public :: stand_in_forces, stand_in_shows, turn_values

   !> Components below this are round-off of an axis.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)

   type :: turned_axes_t
      type(origin_t) :: origin                       !! of the card
      integer :: node = 0
      integer :: stand_in = 0                        !! 0: nothing is prescribed along its axes
      logical :: is_central = .false.                !! on the axis of a cylinder
      real(wp) :: axes(3, 3) = 0.0_wp                !! unit vectors, one a column
   end type turned_axes_t

contains

   !> The index in `turned` of each node; 0: it has the axes of the model.
   pure function turned_marks(turned, n_node) result(mark)
      type(turned_axes_t), intent(in) :: turned(:)
      integer, intent(in) :: n_node
      integer :: mark(n_node)
      integer :: i

      mark = 0
      mark(turned%node) = [(i, i = 1, size(turned))]
   end function turned_marks

   !> The first axis leads from the origin to `a`, the second lies in the plane of `a` and `b`, on
   !> the side of `b`.
   pure subroutine rectangular_axes(a, b, axes, fault)
      real(wp), intent(in) :: a(:), b(:)             !! (3) [L]
      real(wp), intent(out) :: axes(:, :)            !! (3, 3)
      character(len=:), allocatable, intent(out) :: fault   !! empty: none
      real(wp) :: first(3), third(3)

      fault = ""
      axes = 0.0_wp
      if (.not. norm2(a) > 0.0_wp) then
         fault = "the first point is the origin: it gives no direction"
         return
      else if (.not. norm2(b) > 0.0_wp) then
         fault = "the second point is the origin: it gives no plane"
         return
      end if
      first = a/norm2(a)
      third = cross_product(first, b/norm2(b))
      if (norm2(third) <= sqrt(epsilon(1.0_wp))) then
         fault = "the two points and the origin lie on one line: they give no plane"
         return
      end if
      third = third/norm2(third)
      axes = reshape([first, cross_product(third, first), third], shape(axes))
      call clear_rounding(axes)
   end subroutine rectangular_axes

   !> Axes at `x`: outwards, around, and along the axis from `a` to `b`. On the axis itself the
   !> first is that axis of the model which is the most across, less what of it is along.
   pure subroutine cylindrical_axes(a, b, x, axes, is_central)
      real(wp), intent(in) :: a(:), b(:)             !! (3) not the same [L]
      real(wp), intent(in) :: x(:)                   !! (3) [L]
      real(wp), intent(out) :: axes(:, :)            !! (3, 3)
      logical, intent(out) :: is_central             !! `x` is on the axis
      real(wp) :: outward(3), along(3)

      along = (b - a)/norm2(b - a)
      outward = x - a
      outward = outward - dot_product(outward, along)*along
      is_central = norm2(outward) <= rounding*(norm2(x) + norm2(a))
      if (is_central) then
         outward = 0.0_wp
         outward(minloc(abs(along), 1)) = 1.0_wp
         outward = outward - dot_product(outward, along)*along
      end if
      outward = outward/norm2(outward)
      axes = reshape([outward, cross_product(along, outward), along], shape(axes))
      call clear_rounding(axes)
   end subroutine cylindrical_axes

   !> Axes that are those of the model but for round-off are these.
   pure subroutine clear_rounding(axes)
      real(wp), intent(inout) :: axes(:, :)

      where (abs(axes) <= rounding) axes = 0.0_wp
      where (abs(abs(axes) - 1.0_wp) <= rounding) axes = sign(1.0_wp, axes)
   end subroutine clear_rounding

   !> The axis of the model along which `axis` is, below 0 if against it; 0: along none.
   pure integer function aligned_with(axis) result(k)
      real(wp), intent(in) :: axis(:)

      k = 0
      if (count(abs(axis) > 0.0_wp) /= 1) return
      k = maxloc(abs(axis), 1)
      if (axis(k) < 0.0_wp) k = -k
   end function aligned_with

   !> Forces on stand-ins are forces on their nodes.
   pure subroutine stand_in_forces(turned, force)
      type(turned_axes_t), intent(in) :: turned(:)
      real(dp), intent(inout) :: force(:, :)         !! (n_dim, n_node) [M L/T^2]
      integer :: i

      do i = 1, size(turned)
         associate (own => turned(i), n_dim => size(force, 1))
            if (own%stand_in == 0) cycle
            force(:, own%node) = force(:, own%node) &
               + real(matmul(own%axes(:n_dim, :n_dim), force(:, own%stand_in)), dp)
            force(:, own%stand_in) = 0.0_dp
         end associate
      end do
   end subroutine stand_in_forces

   !> Results have stand-ins where their nodes are.
   pure subroutine stand_in_shows(turned, values)
      type(turned_axes_t), intent(in) :: turned(:)
      real(dp), intent(inout) :: values(:, :)        !! (any, n_node)
      integer :: i

      do i = 1, size(turned)
         if (turned(i)%stand_in > 0) values(:, turned(i)%stand_in) = values(:, turned(i)%node)
      end do
   end subroutine stand_in_shows

   !> Vectors at nodes, in the axes of these.
   pure subroutine turn_values(turned, values)
      type(turned_axes_t), intent(in) :: turned(:)
      real(dp), intent(inout) :: values(:, :)        !! (n_dim, n_node)
      integer :: i

      do i = 1, size(turned)
         associate (own => turned(i), n_dim => size(values, 1))
            values(:, own%node) = real(matmul(values(:, own%node), own%axes(:n_dim, :n_dim)), dp)
         end associate
      end do
   end subroutine turn_values

end module emcon_turned_axes
