!> Elements in the plane, side by side, whose volume resists in the mean alone.
!>
!> A law W = rest + U(v), v its change of volume, is taken as rest(E) + U(mean of v): one resistance
!> to a change of volume per element, so that nearly incompressible ones do not lock. The mean is a
!> sum of discrete-gradient numbers and U one divided difference of it: energy and momenta stay
!> exact, and there are no unknowns beside the displacements. Source: docs/theory.md, eq. (11c).
module emcon_mean_volume_plane
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : change_points_t, law_change_points, law_points_t, law_t, n_lane
   use emcon_pack_points_plane, only : pack_add_point, pack_point, pack_point_check, pack_point_t
   use emcon_shape, only : max_node => max_plane_nodes
   implicit none
   private
   public :: mean_volume_respond, mean_volume_hold

   !> What the mean of v does to a pack: energy, pressure U' and its derivative by the mean.
   type :: pressure_t
      real(wp) :: volume(n_lane) = 0.0_wp        !! reference volume [L^3]
      real(wp) :: energy(n_lane) = 0.0_wp
      real(wp) :: value(n_lane) = 0.0_wp         !! divided difference of U [M/(L T^2)]
      real(wp) :: rate(n_lane) = 0.0_wp          !! its derivative by the mean at the end
   end type pressure_t

   !> Sums of the gradients of v over the points, weighted.
   type :: gradients_t
      real(wp) :: step(n_lane, 2, max_node) = 0.0_wp       !! discrete ones
      real(wp) :: last(n_lane, 2, max_node) = 0.0_wp       !! those at the end
   end type gradients_t

contains

   !> Response of a pack to a motion.
   pure subroutine mean_volume_respond(pack, law, rest, motion, with_tangent, part)
      type(element_pack_t), intent(in) :: pack
      class(law_t), intent(in) :: law            !! U and v
      class(law_t), intent(in) :: rest           !! of the law, without U
      type(pack_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part
      type(pack_point_t) :: point
      type(change_points_t) :: change
      type(pressure_t) :: p
      type(gradients_t) :: gradients
      integer :: a, b, k

      call pack_clear(pack%n_node, part, with_tangent)
      call find_pressure(pack, law, motion, point, part, p)
      part%energy = p%energy
      do k = 1, pack%n_gp
         call pack_point(pack, k, motion, point)
         call pack_point_check(law%has_volume, point, part)
         change%strain = point%law%strain
         change%dstrain = point%law%dstrain
         call law_change_points(law, with_tangent, change)
         call rest%respond(point%law, with_tangent)
         do a = 1, size(change%stress, 2)
            point%law%stress(:, a) = point%law%stress(:, a) + p%value*change%stress(:, a)
            if (.not. with_tangent) cycle
            do b = 1, size(change%stress, 2)
               point%law%tangent(:, a, b) = point%law%tangent(:, a, b) &
                  + p%value*change%tangent(:, a, b)
            end do
         end do
         call pack_add_point(pack, k, point, with_tangent, part)
         if (with_tangent) call add_gradients(pack, k, point, change, gradients)
      end do
      if (with_tangent) call add_stiffness(pack%n_node, p, gradients, part)
   end subroutine mean_volume_respond

   !> The mean of v over the points of each element, and what U answers to it.
   pure subroutine find_pressure(pack, law, motion, point, part, p)
      type(element_pack_t), intent(in) :: pack
      class(law_t), intent(in) :: law
      type(pack_motion_t), intent(in) :: motion
      type(pack_point_t), intent(inout) :: point           !! work space
      type(pack_response_t), intent(inout) :: part         !! `is_inverted` is set
      type(pressure_t), intent(out) :: p
      type(change_points_t) :: change
      type(dg_t) :: u
      real(wp) :: start(n_lane), by(n_lane)
      integer :: k, l

      start = 0.0_wp
      by = 0.0_wp
      do k = 1, pack%n_gp
         call pack_point(pack, k, motion, point)
         call pack_point_check(law%has_volume, point, part)
         change%strain = point%law%strain
         change%dstrain = point%law%dstrain
         call law_change_points(law, .false., change)
         start = start + pack%weight(:, k)*change%start
         by = by + pack%weight(:, k)*change%by
         p%volume = p%volume + pack%weight(:, k)
      end do
      do l = 1, n_lane
         u = law%volume(dg_variable(1, start(l)/p%volume(l), by(l)/p%volume(l)))
         p%energy(l) = p%volume(l)*u%f1
         p%value(l) = u%g(1)
         p%rate(l) = u%h(1, 1)
      end do
   end subroutine find_pressure

   !> Add the gradients of v at point `k`: F dv/dE . grad N, at the middle and at the end.
   pure subroutine add_gradients(pack, k, point, change, gradients)
      type(element_pack_t), intent(in) :: pack
      integer, intent(in) :: k                   !! 1 to n_gp
      type(pack_point_t), intent(in) :: point
      type(change_points_t), intent(in) :: change
      type(gradients_t), intent(inout) :: gradients
      integer :: i
      real(wp) :: flow(n_lane, 2)

      do i = 1, pack%n_node
         associate (g => pack%gradient(:, :, i, k), w => pack%weight(:, k))
            flow(:, 1) = w*(change%stress(:, 1)*g(:, 1) + change%stress(:, 3)*g(:, 2))
            flow(:, 2) = w*(change%stress(:, 3)*g(:, 1) + change%stress(:, 2)*g(:, 2))
            call add_flow(point%f_mid, flow, gradients%step(:, :, i))
            flow(:, 1) = w*(change%at_end(:, 1)*g(:, 1) + change%at_end(:, 3)*g(:, 2))
            flow(:, 2) = w*(change%at_end(:, 3)*g(:, 1) + change%at_end(:, 2)*g(:, 2))
            call add_flow(point%f_end, flow, gradients%last(:, :, i))
         end associate
      end do
   end subroutine add_gradients

   pure subroutine add_flow(f, flow, total)
      real(wp), intent(in) :: f(n_lane, 2, 2), flow(n_lane, 2)
      real(wp), intent(inout) :: total(n_lane, 2)
      integer :: a

      do a = 1, 2
         total(:, a) = total(:, a) + (f(:, a, 1)*flow(:, 1) + f(:, a, 2)*flow(:, 2))
      end do
   end subroutine add_flow

   !> Add what the pressure changes by the mean: of rank one.
   pure subroutine add_stiffness(n, p, gradients, part)
      integer, intent(in) :: n                   !! nodes of each element
      type(pressure_t), intent(in) :: p
      type(gradients_t), intent(in) :: gradients
      type(pack_response_t), intent(inout) :: part
      real(wp) :: scaled(n_lane)
      integer :: a, c, i, j

      do j = 1, n
         do c = 1, 2
            scaled = p%rate/p%volume*gradients%last(:, c, j)
            do i = 1, n
               do a = 1, 2
                  part%tangent(:, a, i, c, j) = part%tangent(:, a, i, c, j) &
                     + gradients%step(:, a, i)*scaled
               end do
            end do
         end do
      end do
   end subroutine add_stiffness

   !> Stress of the points of one element that does not move, with that normal to the plane.
   pure subroutine mean_volume_hold(law, rest, weight, points)
      class(law_t), intent(in) :: law            !! U and v
      class(law_t), intent(in) :: rest           !! of the law, without U
      real(wp), intent(in) :: weight(:)          !! (n_gp <= n_lane) reference volumes [L^3]
      type(law_points_t), intent(inout) :: points    !! of the element; `dstrain` is 0
      type(change_points_t) :: change
      type(dg_t) :: u

      change%strain = points%strain
      call law_change_points(law, .false., change)
      u = law%volume(dg_variable(1, dot_product(weight, change%start(:size(weight)))/sum(weight), &
         0.0_wp))
      call rest%hold(points)
      points%stress = points%stress + u%g(1)*change%stress
      points%stress_33 = points%stress_33 + u%g(1)*change%stress_33
   end subroutine mean_volume_hold

end module emcon_mean_volume_plane
