!> Stress, strain and energy for output: at nodes, extrapolated from the quadrature points and
!> averaged, and of elements.
!>
!> Cauchy stress; without NLGEOM the stress itself. Components xx, yy, zz, xy, yz, xz. Of a law that
!> a program gives zz is not known: it is 0 here, in von Mises' stress too. Where such a law does
!> not answer, the stress is not a number.
module emcon_stress
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use emcon_corotated_plane, only : corotated_init, corotated_strip, corotated_t, &
      corotated_turn_stress
   use emcon_element, only : element_motion_t, element_point, point_motion_t
   use emcon_host_law, only : host_response_t, host_state
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_solid, only : solid_evaluate_given, solid_t
   implicit none
   private
   public :: nodal_stress, element_means, element_energies, von_mises

contains

   !> Stress at the nodes: each element's field through its quadrature points, mean over elements.
   subroutine nodal_stress(solid, u, nlgeom, stress)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)            !! (2, n_node)
      logical, intent(in) :: nlgeom              !! .false.: small strains
      real(wp), intent(out), contiguous :: stress(:, :)      !! (6, n_node)
      type(host_response_t) :: given
      type(element_motion_t) :: motion
      integer :: count_at(solid%n_node), e, i, k, node
      real(wp) :: at_gp(6), strain(3), turn(size(u, 1), size(u, 1))

      call respond_at(solid, u, nlgeom, given)
      stress = 0.0_wp
      count_at = 0
      do e = 1, solid%n_element
         if (solid%is_rigid(e)) cycle
         motion%nlgeom = nlgeom .and. .not. solid%is_small(e)
         call place(solid, e, u, motion, turn)
         do k = 1, solid%geometry(e)%n_gp
            call point_state(solid, e, k, motion, given, at_gp, strain)
            if (solid%is_corotated(e)) call corotated_turn_stress(turn, at_gp)
            do i = 1, solid%geometry(e)%n_node
               node = solid%node(i, e)
               stress(:, node) = stress(:, node) &
                  + solid%to_nodes(solid%kind(e))%weight(k, i)*at_gp
            end do
         end do
         do i = 1, solid%geometry(e)%n_node
            count_at(solid%node(i, e)) = count_at(solid%node(i, e)) + 1
         end do
      end do
      do i = 1, solid%n_node
         if (count_at(i) > 0) stress(:, i) = stress(:, i)/real(count_at(i), wp)
      end do
   end subroutine nodal_stress

   !> What the given laws answer at the displacement `u`.
   subroutine respond_at(solid, u, nlgeom, given)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)
      logical, intent(in) :: nlgeom
      type(host_response_t), intent(inout) :: given
      real(wp), allocatable :: zero(:, :)

      if (.not. solid%has_given) return
      allocate(zero, mold=u)
      zero = 0.0_wp
      call solid_evaluate_given(solid, u, zero, nlgeom, .false., given)
   end subroutine respond_at

   !> No motion of element `e` from displacements `u`; those of a corotated one are what is left in
   !> its frame, which has turned by `turn`.
   pure subroutine place(solid, e, u, motion, turn)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: u(:, :)
      type(element_motion_t), intent(inout) :: motion
      real(wp), intent(inout) :: turn(:, :)              !! set for corotated elements
      type(corotated_t) :: frame
      real(wp) :: u_left(size(u, 1), size(solid%node, 1))
      integer :: i

      associate (node => solid%node(:solid%geometry(e)%n_node, e))
         do i = 1, size(node)
            motion%from(:, i) = u(:, node(i))
         end do
         if (.not. solid%is_corotated(e)) return
         call corotated_init(frame, solid%geometry(e), solid%x(:, node))
         do i = 1, size(node)
            u_left(:, i) = u(:, node(i)) - u(:, node(1))
         end do
         call corotated_strip(frame, u_left, motion%from, turn)
      end associate
   end subroutine place

   !> Stress (6) and strain (E11, E22, 2 E12) at quadrature point `k` of element `e`.
   pure subroutine point_state(solid, e, k, motion, given, stress, strain)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e, k
      type(element_motion_t), intent(in) :: motion       !! of no size
      type(host_response_t), intent(in) :: given
      real(wp), intent(out) :: stress(6), strain(3)
      type(law_response_t) :: state
      type(point_motion_t) :: point
      real(wp) :: s(2, 2), det

      call element_point(solid%geometry(e), k, motion, point)
      strain = point%strain
      if (solid%first_point(e) == 0) then
         call law_response_plane(solid%law(solid%law_of(e))%law, strain, point%dstrain, state)
      else if (given%inverted_element == 0) then
         state = host_state(given%points(solid%law_of(e)), solid%first_point(e) - 1 + k)
      else
         state%stress = ieee_value(strain, ieee_quiet_nan)
      end if
      s = reshape([state%stress(1), state%stress(3), state%stress(3), state%stress(2)], [2, 2])
      associate (f => point%f_end)
         det = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1)
         s = matmul(matmul(f, s), transpose(f))/det
      end associate
      stress = [s(1, 1), s(2, 2), state%stress_33/det, s(1, 2), 0.0_wp, 0.0_wp]
   end subroutine point_state

   !> Means over the reference volume of each element, and that volume.
   subroutine element_means(solid, u, nlgeom, stress, strain, volume)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)   !! (2, n_node) [L]
      logical, intent(in) :: nlgeom              !! .false.: small strains
      real(wp), intent(out) :: stress(:, :)      !! (6, n_element)
      real(wp), intent(out) :: strain(:, :)      !! (3, n_element) E11, E22, 2 E12
      real(wp), intent(out) :: volume(:)         !! (n_element) [L^3]
      type(host_response_t) :: given
      type(element_motion_t) :: motion
      real(wp) :: stress_k(6), strain_k(3), weight, turn(size(u, 1), size(u, 1))
      integer :: e, k

      call respond_at(solid, u, nlgeom, given)
      stress = 0.0_wp
      strain = 0.0_wp
      do e = 1, solid%n_element
         volume(e) = sum(solid%geometry(e)%weight)
         if (solid%is_rigid(e)) cycle
         motion%nlgeom = nlgeom .and. .not. solid%is_small(e)
         call place(solid, e, u, motion, turn)
         do k = 1, solid%geometry(e)%n_gp
            call point_state(solid, e, k, motion, given, stress_k, strain_k)
            if (solid%is_corotated(e)) call corotated_turn_stress(turn, stress_k)
            weight = solid%geometry(e)%weight(k)/volume(e)
            stress(:, e) = stress(:, e) + weight*stress_k
            strain(:, e) = strain(:, e) + weight*strain_k
         end do
      end do
   end subroutine element_means

   !> Kinetic energy of each element.
   pure subroutine element_energies(solid, v, energy)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in) :: v(:, :)            !! (n_dim, n_node) [L/T]
      real(wp), intent(out) :: energy(:)         !! (n_element) [M L^2/T^2]
      integer :: e, i, j

      energy = 0.0_wp
      do e = 1, solid%n_element
         do j = 1, solid%geometry(e)%n_node
            do i = 1, solid%geometry(e)%n_node
               energy(e) = energy(e) + 0.5_wp*solid%mass(i, j, e) &
                  *dot_product(v(:, solid%node(i, e)), v(:, solid%node(j, e)))
            end do
         end do
      end do
   end subroutine element_energies

   !> Von Mises stress of (xx, yy, zz, xy, yz, xz).
   pure real(wp) function von_mises(s)
      real(wp), intent(in) :: s(6)               !! [M/(L T^2)]

      von_mises = sqrt(0.5_wp*((s(1) - s(2))**2 + (s(2) - s(3))**2 + (s(3) - s(1))**2) &
         + 3.0_wp*(s(4)**2 + s(5)**2 + s(6)**2))
   end function von_mises

end module emcon_stress
