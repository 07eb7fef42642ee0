!> Elements in three dimensions whose law a program gives at points.
!>
!> Source: docs/theory.md, section 2 (functions given at points) and eq. (11).
module emcon_user_space
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use emcon_element_space, only : space_element_t, space_motion_t, space_part_add, &
      space_part_add_tangent, space_part_clear, space_part_t, space_point, space_point_cauchy, &
      space_point_is_regular, space_point_t
   use emcon_host_law, only : host_points_t
   use emcon_kinds, only : wp
   use emcon_law_space, only : space_response_t
   implicit none
   private
   public :: user_space_strain, user_space_respond, user_space_hold

contains

   !> Strains over a motion, for the law to answer to.
   pure subroutine user_space_strain(self, first, motion, points, is_inverted)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: first               !! number of its first point in `points`
      type(space_motion_t), intent(in) :: motion
      type(host_points_t), intent(inout) :: points
      logical, intent(out) :: is_inverted        !! at some point at the end
      type(space_point_t) :: point
      integer :: k

      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         is_inverted = .not. space_point_is_regular(point, .false.)
         if (is_inverted) return
         points%strain(:, first - 1 + k) = point%strain
         points%dstrain(:, first - 1 + k) = point%dstrain
      end do
   end subroutine user_space_strain

   !> Response to a motion that the law has answered to.
   pure subroutine user_space_respond(self, first, points, motion, with_tangent, part)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: first               !! number of its first point in `points`
      type(host_points_t), intent(in) :: points
      type(space_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part
      type(space_point_t) :: point
      type(space_response_t) :: response
      integer :: i, k

      call space_part_clear(self%n_node, with_tangent, part)
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         i = first - 1 + k
         response%energy = points%response%energy(i)
         response%stress = points%response%gradient(:, i)
         call space_part_add(self, k, point, response, part)
         if (.not. with_tangent) cycle
         response%tangent = points%response%tangent(:, :, i)
         call space_part_add_tangent(self, k, point, response, part)
      end do
   end subroutine user_space_respond

   !> Cauchy stress and strain at the points of an element that does not move; where the law has
   !> not answered, the stress is not a number.
   pure subroutine user_space_hold(self, first, points, motion, stress, strain)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: first               !! number of its first point; 0: no answer
      type(host_points_t), intent(in) :: points
      type(space_motion_t), intent(in) :: motion       !! of no size
      real(wp), intent(out) :: stress(:, :)      !! (6, >= n_gp) [M/(L T^2)]
      real(wp), intent(out) :: strain(:, :)      !! (6, >= n_gp) E11, E22, E33, 2 E12, ...
      type(space_point_t) :: point
      integer :: k

      stress = ieee_value(1.0_wp, ieee_quiet_nan)
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         strain(:, k) = point%strain
         if (first > 0) stress(:, k) = space_point_cauchy(point, &
            points%response%gradient(:, first - 1 + k))
      end do
   end subroutine user_space_hold

end module emcon_user_space
