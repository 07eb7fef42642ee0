!> Elements in the plane, side by side, with incompatible modes.
!>
!> The law answers to relaxed strains; what works on the nodes is its stress, returned by the
!> transpose of that map. Source: docs/theory.md, eqs. (11) and (11g).
module emcon_incompatible_plane
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, n_lane
   use emcon_pack_points_plane, only : pack_add_point, pack_point, pack_point_check, pack_point_t
   implicit none
   private
   public :: incompatible_respond

   integer, parameter :: n_dim = 2, n_strain = 3

contains

   !> Response of a pack to a motion.
   pure subroutine incompatible_respond(pack, law, motion, with_tangent, part)
      type(element_pack_t), intent(in) :: pack   !! with modes
      class(law_t), intent(in) :: law
      type(pack_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part
      type(pack_point_t) :: point(pack%n_gp)
      real(wp), dimension(n_lane, n_strain, pack%n_gp) :: strain, dstrain, stress
      real(wp) :: moduli(n_lane, n_strain, n_strain, pack%n_gp)
      integer :: k

      call pack_clear(pack%n_node, part, with_tangent)
      do k = 1, pack%n_gp
         call pack_point(pack, k, motion, point(k))
         strain(:, :, k) = point(k)%law%strain
         dstrain(:, :, k) = point(k)%law%dstrain
      end do
      call relax(pack, strain)
      call relax(pack, dstrain)
      do k = 1, pack%n_gp
         point(k)%law%strain = strain(:, :, k)
         point(k)%law%dstrain = dstrain(:, :, k)
         call pack_point_check(law%has_volume, point(k), part)
         call law%respond(point(k)%law, with_tangent)
         stress(:, :, k) = point(k)%law%stress
         moduli(:, :, :, k) = point(k)%law%tangent
      end do
      call return_stress(pack, stress)
      do k = 1, pack%n_gp
         point(k)%law%stress = stress(:, :, k)
         point(k)%law%tangent = 0.0_wp           ! what the stress at fixed strain does
         call pack_add_point(pack, k, point(k), with_tangent, part)
      end do
      if (with_tangent) call add_tangent(pack, point, moduli, part)
   end subroutine incompatible_respond

   !> Take the modes out of a strain.
   pure subroutine relax(pack, strain)
      type(element_pack_t), intent(in) :: pack
      real(wp), intent(inout) :: strain(n_lane, n_strain, pack%n_gp)
      real(wp) :: amount(n_lane, size(pack%mode, 3))
      integer :: k, m, v

      amount = 0.0_wp
      do k = 1, pack%n_gp
         do m = 1, size(amount, 2)
            do v = 1, n_strain
               amount(:, m) = amount(:, m) + pack%dual(:, v, m, k)*strain(:, v, k)
            end do
         end do
      end do
      do k = 1, pack%n_gp
         do m = 1, size(amount, 2)
            do v = 1, n_strain
               strain(:, v, k) = strain(:, v, k) - pack%mode(:, v, m, k)*amount(:, m)
            end do
         end do
      end do
   end subroutine relax

   !> Its transpose, of stresses.
   pure subroutine return_stress(pack, stress)
      type(element_pack_t), intent(in) :: pack
      real(wp), intent(inout) :: stress(n_lane, n_strain, pack%n_gp)
      real(wp) :: amount(n_lane, size(pack%mode, 3))
      integer :: k, m, v

      amount = 0.0_wp
      do k = 1, pack%n_gp
         do m = 1, size(amount, 2)
            do v = 1, n_strain
               amount(:, m) = amount(:, m) &
                  + pack%weight(:, k)*pack%mode(:, v, m, k)*stress(:, v, k)
            end do
         end do
      end do
      do k = 1, pack%n_gp
         do m = 1, size(amount, 2)
            do v = 1, n_strain
               stress(:, v, k) = stress(:, v, k) &
                  - pack%dual(:, v, m, k)*amount(:, m)/pack%weight(:, k)
            end do
         end do
      end do
   end subroutine return_stress

   !> Add what stress does that changes with the strain.
   pure subroutine add_tangent(pack, point, moduli, part)
      type(element_pack_t), intent(in) :: pack
      type(pack_point_t), intent(in) :: point(:)           !! (n_gp)
      real(wp), intent(in) :: moduli(:, :, :, :)           !! (n_lane, 3, 3, n_gp)
      type(pack_response_t), intent(inout) :: part
      !> Derivatives of the strains, relaxed, by the nodes
      real(wp), dimension(n_lane, n_strain, pack%n_gp, n_dim, pack%n_node) :: middle, last
      real(wp) :: flow(n_lane, n_strain)
      integer :: a, c, i, j, k, v

      do i = 1, pack%n_node
         do k = 1, pack%n_gp
            associate (g => pack%gradient(:, :, i, k))
               do a = 1, n_dim
                  middle(:, :, k, a, i) = strain_by(point(k)%f_mid(:, a, :), g)
                  last(:, :, k, a, i) = strain_by(point(k)%f_end(:, a, :), g)
               end do
            end associate
         end do
         do a = 1, n_dim
            call relax(pack, middle(:, :, :, a, i))
            call relax(pack, last(:, :, :, a, i))
         end do
      end do
      do k = 1, pack%n_gp
         do j = 1, pack%n_node
            do c = 1, n_dim
               flow = 0.0_wp
               do v = 1, n_strain
                  flow = flow + moduli(:, :, v, k)*spread(pack%weight(:, k)*last(:, v, k, c, j), &
                     2, n_strain)
               end do
               do i = 1, pack%n_node
                  do a = 1, n_dim
                     part%tangent(:, a, i, c, j) = part%tangent(:, a, i, c, j) &
                        + (middle(:, 1, k, a, i)*flow(:, 1) + middle(:, 2, k, a, i)*flow(:, 2) &
                        + middle(:, n_strain, k, a, i)*flow(:, n_strain))
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_tangent

   !> Derivative of the strain by a component of a node's displacement.
   pure function strain_by(f, gradient) result(b)
      real(wp), intent(in) :: f(n_lane, n_dim)             !! that component of dx/dX
      real(wp), intent(in) :: gradient(n_lane, n_dim)      !! of the node's function by X [1/L]
      real(wp) :: b(n_lane, n_strain)

      b(:, 1) = f(:, 1)*gradient(:, 1)
      b(:, 2) = f(:, 2)*gradient(:, 2)
      b(:, n_strain) = f(:, 1)*gradient(:, 2) + f(:, 2)*gradient(:, 1)
   end function strain_by

end module emcon_incompatible_plane
