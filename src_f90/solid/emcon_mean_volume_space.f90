!> Elements in three dimensions whose volume resists in the mean alone.
!>
!> As in the plane: W = rest + U(v), v the change of volume, is taken as rest(E) + U(mean of v); the
!> mean is a sum of discrete-gradient numbers and U one divided difference of it. Source:
!> docs/theory.md, eq. (11c).
module emcon_mean_volume_space
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_element_space, only : n_space, space_element_t, space_motion_t, space_part_add, &
      space_part_add_tangent, space_part_clear, space_part_t, space_point, space_point_cauchy, &
      space_point_is_regular, space_point_strain_by, space_point_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_space, only : law_change_space, law_response_space, law_stress_space, &
      space_change_t, space_response_t
   use emcon_shape, only : max_node => max_element_nodes
   implicit none
   private
   public :: mean_volume_space_respond, mean_volume_space_hold

   !> Sums of the gradients of v over the points, weighted.
   type :: gradients_t
      real(wp) :: step(n_space, max_node) = 0.0_wp         !! discrete ones [L^2]
      real(wp) :: last(n_space, max_node) = 0.0_wp         !! those at the end [L^2]
   end type gradients_t

contains

   !> Response to a motion.
   pure subroutine mean_volume_space_respond(self, law, rest, motion, with_tangent, part)
      type(space_element_t), intent(in) :: self
      class(law_t), intent(in) :: law            !! U and v
      class(law_t), intent(in) :: rest           !! of the law, without U
      type(space_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part
      type(space_point_t) :: point
      type(space_response_t) :: response
      type(space_change_t) :: change
      type(gradients_t) :: gradients
      type(dg_t) :: u
      real(wp) :: volume
      integer :: k

      call space_part_clear(self%n_node, with_tangent, part)
      call find_pressure(self, law, motion, u, part%is_inverted)
      if (part%is_inverted) return
      volume = sum(self%weight)
      part%energy = volume*u%f1
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         call law_change_space(law, point%strain, point%dstrain, change)
         call law_stress_space(rest, point%strain, point%dstrain, response, with_tangent)
         response%stress = response%stress + u%g(1)*change%stress
         response%tangent = response%tangent + u%g(1)*change%tangent
         call space_part_add(self, k, point, response, part)
         if (.not. with_tangent) cycle
         call space_part_add_tangent(self, k, point, response, part)
         call add_gradients(self, k, point, change, gradients)
      end do
      if (with_tangent) call add_stiffness(self%n_node, u%h(1, 1)/volume, gradients, part)
   end subroutine mean_volume_space_respond

   !> U of the mean of v over the points.
   pure subroutine find_pressure(self, law, motion, u, is_inverted)
      type(space_element_t), intent(in) :: self
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion
      type(dg_t), intent(out) :: u               !! 0 if `is_inverted`
      logical, intent(out) :: is_inverted        !! at some point at the end
      type(space_point_t) :: point
      type(space_change_t) :: change
      real(wp) :: start, by, volume
      integer :: k

      start = 0.0_wp
      by = 0.0_wp
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         is_inverted = .not. space_point_is_regular(point, law%has_volume)
         if (is_inverted) return
         call law_change_space(law, point%strain, point%dstrain, change)
         start = start + self%weight(k)*change%start
         by = by + self%weight(k)*change%by
      end do
      volume = sum(self%weight)
      u = law%volume(dg_variable(1, start/volume, by/volume))
   end subroutine find_pressure

   !> Add the gradients of v at point `k` by the nodes, at the middle and at the end.
   pure subroutine add_gradients(self, k, point, change, gradients)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(space_point_t), intent(in) :: point
      type(space_change_t), intent(in) :: change
      type(gradients_t), intent(inout) :: gradients
      integer :: i

      do i = 1, self%n_node
         associate (g => self%gradient(:, i, k), w => self%weight(k))
            gradients%step(:, i) = gradients%step(:, i) &
               + w*matmul(change%stress, space_point_strain_by(point%f_mid, g))
            gradients%last(:, i) = gradients%last(:, i) &
               + w*matmul(change%at_end, space_point_strain_by(point%f_end, g))
         end associate
      end do
   end subroutine add_gradients

   !> Add what the pressure changes by the mean: of rank one.
   pure subroutine add_stiffness(n, rate, gradients, part)
      integer, intent(in) :: n                   !! nodes
      real(wp), intent(in) :: rate               !! of the pressure by the mean, per volume
      type(gradients_t), intent(in) :: gradients
      type(space_part_t), intent(inout) :: part
      integer :: c, j

      do j = 1, n
         do c = 1, n_space
            part%tangent(:, :n, c, j) = part%tangent(:, :n, c, j) &
               + (rate*gradients%last(c, j))*gradients%step(:, :n)
         end do
      end do
   end subroutine add_stiffness

   !> Cauchy stress and strain at the points of an element that does not move.
   pure subroutine mean_volume_space_hold(self, law, rest, motion, stress, strain)
      type(space_element_t), intent(in) :: self
      class(law_t), intent(in) :: law            !! U and v
      class(law_t), intent(in) :: rest           !! of the law, without U
      type(space_motion_t), intent(in) :: motion       !! of no size
      real(wp), intent(out) :: stress(:, :)      !! (6, >= n_gp) [M/(L T^2)]
      real(wp), intent(out) :: strain(:, :)      !! (6, >= n_gp) E11, E22, E33, 2 E12, ...
      type(space_point_t) :: point
      type(space_response_t) :: response
      type(space_change_t) :: change
      type(dg_t) :: u
      logical :: is_inverted
      integer :: k

      call find_pressure(self, law, motion, u, is_inverted)
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         call law_change_space(law, point%strain, point%dstrain, change)
         call law_response_space(rest, point%strain, point%dstrain, response)
         stress(:, k) = space_point_cauchy(point, response%stress + u%g(1)*change%stress)
         strain(:, k) = point%strain
      end do
   end subroutine mean_volume_space_hold

end module emcon_mean_volume_space
