!> An element in three dimensions with incompatible modes.
!>
!> Source: docs/theory.md, eqs. (11) and (11g).
module emcon_incompatible_space
   use emcon_element_space, only : n_space, space_element_t, space_motion_t, space_part_add, &
      space_part_add_tangent, space_part_clear, space_part_t, space_point, &
      space_point_is_regular, space_point_strain_by, space_point_t
   use emcon_incompatible_modes, only : modes_relax, modes_return
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_space, only : law_stress_space, n_strain, space_response_t
   implicit none
   private
   public :: incompatible_space_respond

contains

   !> Response to a motion.
   pure subroutine incompatible_space_respond(self, law, motion, with_tangent, part)
      type(space_element_t), intent(in) :: self  !! with modes
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part
      type(space_point_t) :: point(self%n_gp)
      type(space_response_t) :: response(self%n_gp)
      real(wp), dimension(n_strain, self%n_gp) :: strain, dstrain, stress
      real(wp) :: moduli(n_strain, n_strain, self%n_gp)
      integer :: k

      call space_part_clear(self%n_node, with_tangent, part)
      do k = 1, self%n_gp
         call space_point(self, k, motion, point(k))
         strain(:, k) = point(k)%strain
         dstrain(:, k) = point(k)%dstrain
      end do
      call modes_relax(self, strain)
      call modes_relax(self, dstrain)
      do k = 1, self%n_gp
         point(k)%strain = strain(:, k)
         point(k)%dstrain = dstrain(:, k)
         part%is_inverted = .not. space_point_is_regular(point(k), law%has_volume)
         if (part%is_inverted) return
         call law_stress_space(law, strain(:, k), dstrain(:, k), response(k), with_tangent)
         stress(:, k) = response(k)%stress
         moduli(:, :, k) = response(k)%tangent
      end do
      call modes_return(self, stress)
      do k = 1, self%n_gp
         response(k)%stress = stress(:, k)
         response(k)%tangent = 0.0_wp            ! what the stress at fixed strain does
         call space_part_add(self, k, point(k), response(k), part)
         if (with_tangent) call space_part_add_tangent(self, k, point(k), response(k), part)
      end do
      if (with_tangent) call add_tangent(self, point, moduli, part)
   end subroutine incompatible_space_respond

   !> Add what stress does that changes with the strain.
   pure subroutine add_tangent(self, point, moduli, part)
      type(space_element_t), intent(in) :: self
      type(space_point_t), intent(in) :: point(:)          !! (n_gp)
      real(wp), intent(in) :: moduli(:, :, :)              !! (n_strain, n_strain, n_gp)
      type(space_part_t), intent(inout) :: part
      !> Derivatives of the strains, relaxed, by the nodes
      real(wp), dimension(n_strain, self%n_gp, n_space, self%n_node) :: middle, last
      real(wp) :: flow(n_strain)
      integer :: a, c, i, j, k

      do i = 1, self%n_node
         do k = 1, self%n_gp
            middle(:, k, :, i) = space_point_strain_by(point(k)%f_mid, self%gradient(:, i, k))
            last(:, k, :, i) = space_point_strain_by(point(k)%f_end, self%gradient(:, i, k))
         end do
         do a = 1, n_space
            call modes_relax(self, middle(:, :, a, i))
            call modes_relax(self, last(:, :, a, i))
         end do
      end do
      do k = 1, self%n_gp
         do j = 1, self%n_node
            do c = 1, n_space
               flow = self%weight(k)*matmul(moduli(:, :, k), last(:, k, c, j))
               do i = 1, self%n_node
                  do a = 1, n_space
                     part%tangent(a, i, c, j) = part%tangent(a, i, c, j) &
                        + dot_product(middle(:, k, a, i), flow)
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_tangent

end module emcon_incompatible_space
