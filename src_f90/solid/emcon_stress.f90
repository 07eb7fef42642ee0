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
   use emcon_element, only : element_geometry_t
   use emcon_element_axial_plane, only : axial_element_hold
   use emcon_element_plane, only : element_motion_t, element_point, point_motion_t
   use emcon_element_space, only : space_element_hold, space_motion_t
   use emcon_user_space, only : user_space_hold
   use emcon_host_law, only : host_response_t, host_state
   use emcon_incompatible_modes, only : modes_relax, modes_return
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_response_t, n_lane
   use emcon_mean_volume_plane, only : mean_volume_hold
   use emcon_mean_volume_space, only : mean_volume_space_hold
   use emcon_push_forward_plane, only : push_forward
   use emcon_rotation, only : cross_product
   use emcon_solid, only : solid_geometry, solid_t
   use emcon_solid_respond, only : solid_evaluate_user
   implicit none
   private
   public :: nodal_stress, stress_forces, element_means, element_energies, von_mises

   integer, parameter :: n_space = 3
   !> Place of the strain across the plane, or around, behind those of the plane.
   integer, parameter :: across = n_space + 1
   !> Place of each component of the stress tensor.
   integer, parameter :: place_of(n_space, n_space) = reshape([1, 4, 6, 4, 2, 5, 6, 5, 3], &
      [n_space, n_space])

contains

   !> Stress at the nodes: each element's field through its quadrature points, mean over elements.
   subroutine nodal_stress(solid, u, square, stress)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node)
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      real(wp), intent(out), contiguous :: stress(:, :)      !! (6, n_node)
      type(host_response_t) :: user
      integer :: count_at(solid%n_node), e, i, k, node
      real(wp), dimension(6, maxval(solid%trait%n_point)) :: at_gp, strain

      call respond_at(solid, u, square, user)
      stress = 0.0_wp
      count_at = 0
      do e = 1, solid%n_element
         if (solid%trait%is_rigid(e)) cycle
         call state_of(solid, e, u, square, user, at_gp, strain)
         do k = 1, solid%trait%n_point(e)
            do i = 1, solid%trait%n_node(e)
               node = solid%node(i, e)
               stress(:, node) = stress(:, node) &
                  + solid%shape(solid%kind(e))%to_nodes(k, i)*at_gp(:, k)
            end do
         end do
         do i = 1, solid%trait%n_node(e)
            count_at(solid%node(i, e)) = count_at(solid%node(i, e)) + 1
         end do
      end do
      do i = 1, solid%n_node
         if (count_at(i) > 0) stress(:, i) = stress(:, i)/real(count_at(i), wp)
      end do
   end subroutine nodal_stress

   !> Stress and strain at the quadrature points of element `e`, whatever it is.
   pure subroutine state_of(solid, e, u, square, user, stress, strain)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: u(:, :)
      real(wp), intent(in) :: square
      type(host_response_t), intent(in) :: user
      real(wp), intent(inout) :: stress(:, :), strain(:, :)
      type(law_points_t) :: points
      type(element_motion_t) :: motion
      real(wp) :: turn(size(u, 1), size(u, 1))
      integer :: k

      if (solid%is_single) then
         call state_of_single(solid, e, u, square, user, stress, strain)
         return
      end if
      motion%square = merge(0.0_wp, square, solid%trait%is_small(e))
      call place(solid, e, u, motion, turn)
      call element_state(solid, e, motion, user, points, stress, strain)
      if (.not. solid%trait%is_corotated(e)) return
      do k = 1, solid%trait%n_point(e)
         call corotated_turn_stress(turn, stress(:, k))
      end do
   end subroutine state_of

   pure subroutine state_of_single(solid, e, u, square, user, stress, strain)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: u(:, :)
      real(wp), intent(in) :: square
      type(host_response_t), intent(in) :: user
      real(wp), intent(inout) :: stress(:, :), strain(:, :)
      type(space_motion_t) :: motion
      type(element_geometry_t) :: geometry
      integer :: i

      motion%square = merge(0.0_wp, square, solid%trait%is_small(e))
      call solid_geometry(solid, e, geometry)
      associate (node => solid%node(:solid%trait%n_node(e), e))
         if (solid%is_of_rings) then
            motion%from(:size(u, 1), :size(node)) = u(:, node)
            call axial_element_hold(geometry, solid%law(solid%law_of(e))%law, motion, stress, &
               strain)
            return
         end if
         do i = 1, size(node)
            motion%from(:, i) = u(:, node(i)) - u(:, node(1))
         end do
      end associate
      associate (law => solid%law(solid%law_of(e)), rest => solid%rest(solid%law_of(e)))
         if (solid%host%first_point(e) > 0) then
            call user_space_hold(geometry, merge(solid%host%first_point(e), 0, &
               user%inverted_element == 0), user%points(solid%law_of(e)), motion, stress, strain)
         else if (solid%trait%has_mean(e)) then
            call mean_volume_space_hold(geometry, law%law, rest%law, motion, stress, strain)
         else
            call space_element_hold(geometry, law%law, motion, stress, strain)
         end if
      end associate
   end subroutine state_of_single

   !> What the given laws answer at the displacement `u`.
   subroutine respond_at(solid, u, square, user)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)
      real(wp), intent(in) :: square
      type(host_response_t), intent(inout) :: user
      real(wp), allocatable :: zero(:, :)

      if (.not. solid%host%is_used) return
      allocate(zero, mold=u)
      zero = 0.0_wp
      call solid_evaluate_user(solid, u, zero, square, .false., user)
   end subroutine respond_at

   !> No motion of element `e` from displacements `u`; those of a corotated one are what is left in
   !> its frame, which has turned by `turn`.
   pure subroutine place(solid, e, u, motion, turn)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: u(:, :)
      type(element_motion_t), intent(inout) :: motion
      real(wp), intent(inout) :: turn(:, :)              !! set for corotated elements
      integer :: i

      do i = 1, solid%trait%n_node(e)
         motion%from(:, i) = u(:, solid%node(i, e))
      end do
      if (solid%trait%is_corotated(e)) call place_in_frame(solid, e, u, motion, turn)
   end subroutine place

   pure subroutine place_in_frame(solid, e, u, motion, turn)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: u(:, :)
      type(element_motion_t), intent(inout) :: motion
      real(wp), intent(inout) :: turn(:, :)
      type(corotated_t) :: frame
      type(element_geometry_t) :: geometry
      real(wp) :: u_left(size(u, 1), size(solid%node, 1))
      integer :: i

      associate (node => solid%node(:solid%trait%n_node(e), e))
         call solid_geometry(solid, e, geometry)
         call corotated_init(frame, geometry, solid%x(:, node))
         do i = 1, size(node)
            u_left(:, i) = u(:, node(i)) - u(:, node(1))
         end do
         call corotated_strip(frame, u_left, motion%from, turn)
      end associate
   end subroutine place_in_frame

   !> Stress and strain (E11, E22, 2 E12; E33 where it is thin, else 0) at the quadrature points of
   !> element `e`.
   pure subroutine element_state(solid, e, motion, user, points, stress, strain)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      type(element_motion_t), intent(in) :: motion       !! of no size
      type(host_response_t), intent(in) :: user
      type(law_points_t), intent(inout) :: points        !! workspace, as it was made
      real(wp), intent(inout) :: stress(:, :), strain(:, :)   !! (6 and 4, n_gp), and room
      type(point_motion_t) :: point
      type(element_geometry_t) :: geometry
      real(wp) :: f(size(motion%from, 1), size(motion%from, 1), n_lane)
      integer :: before, l, n

      call solid_geometry(solid, e, geometry)
      do before = 0, geometry%n_gp - 1, n_lane
         n = min(n_lane, geometry%n_gp - before)
         do l = 1, n
            call element_point(geometry, before + l, motion, point)
            strain(:3, before + l) = point%strain
            f(:, :, l) = point%f_end
         end do
         if (allocated(geometry%mode)) call modes_relax(geometry, strain(:3, :n))
         points%strain(:n, :) = transpose(strain(:3, before + 1:before + n))
         if (solid%trait%has_mean(e)) then
            call mean_volume_hold(solid%law(solid%law_of(e))%law, solid%rest(solid%law_of(e))%law, &
               geometry%weight, points)
         else if (solid%host%first_point(e) == 0) then
            call solid%law(solid%law_of(e))%law%hold(points)
         else
            call hold_user(user, solid%law_of(e), solid%host%first_point(e) + before, n, points)
         end if
         do l = 1, n
            call push_forward(f(:, :, l), points%stress(l, :), points%stress_33(l), &
               stress(:, before + l))
            strain(across, before + l) = 0.0_wp
            if (.not. (motion%square > 0.0_wp .and. solid%trait%is_thin(e))) cycle
            stress(:, before + l) = stress(:, before + l)/points%stretch_33(l)
            strain(across, before + l) = 0.5_wp*(points%stretch_33(l)**2 - 1.0_wp)
         end do
      end do
   end subroutine element_state

   !> What a given law has answered at `n` points from `first` on.
   pure subroutine hold_user(user, law, first, n, points)
      type(host_response_t), intent(in) :: user
      integer, intent(in) :: law, first, n
      type(law_points_t), intent(inout) :: points
      type(law_response_t) :: state
      integer :: l

      points%stress = ieee_value(1.0_wp, ieee_quiet_nan)
      if (user%inverted_element /= 0) return
      do l = 1, n
         state = host_state(user%points(law), first - 1 + l)
         points%stress(l, :) = state%stress
      end do
   end subroutine hold_user

   !> Means over the reference volume of each element, and that volume.
   subroutine element_means(solid, u, square, stress, strain, volume)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      real(wp), intent(out) :: stress(:, :)      !! (6, n_element)
      !> (3 or 6, n_element) E11, E22, 2 E12, or E11, E22, E33, 2 E12, 2 E23, 2 E13
      real(wp), intent(out) :: strain(:, :)
      real(wp), intent(out) :: volume(:)         !! (n_element) [L^3]
      type(host_response_t) :: user
      real(wp), dimension(6, maxval(solid%trait%n_point)) :: stress_k, strain_k
      type(element_geometry_t) :: geometry
      real(wp) :: weight
      integer :: e, k

      call respond_at(solid, u, square, user)
      stress = 0.0_wp
      strain = 0.0_wp
      do e = 1, solid%n_element
         call solid_geometry(solid, e, geometry)
         volume(e) = sum(geometry%weight)
         if (solid%trait%is_rigid(e)) cycle
         call state_of(solid, e, u, square, user, stress_k, strain_k)
         do k = 1, solid%trait%n_point(e)
            weight = geometry%weight(k)/volume(e)
            stress(:, e) = stress(:, e) + weight*stress_k(:, k)
            strain(:, e) = strain(:, e) + weight*strain_k(:size(strain, 1), k)
         end do
      end do
   end subroutine element_means

   !> Internal forces of elements on their nodes, by the stress at the points: int F S grad N. Of
   !> corotated elements to first order in their strains.
   subroutine stress_forces(solid, u, square, is_used, force)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      logical, intent(in) :: is_used(:)          !! (n_element) those that are asked for
      real(wp), intent(out) :: force(:, :, :)    !! (n_dim, n_most, n_element) [M L/T^2]
      type(host_response_t) :: user
      type(element_geometry_t) :: geometry
      real(wp), dimension(6, maxval(solid%trait%n_point)) :: stress, strain
      real(wp) :: f(n_space, n_space, size(stress, 2)), s(n_space, n_space)
      integer :: e, k, n

      call respond_at(solid, u, square, user)
      force = 0.0_wp
      n = size(u, 1)
      do e = 1, solid%n_element
         if (solid%trait%is_rigid(e) .or. .not. is_used(e)) cycle
         call state_of(solid, e, u, square, user, stress, strain)
         call solid_geometry(solid, e, geometry)
         do k = 1, geometry%n_gp
            call find_deformation(solid, e, geometry%gradient(:, :, k), u, square, f(:, :, k))
            if (n < n_space .and. square > 0.0_wp) f(n_space, n_space, k) &
               = sqrt(1.0_wp + 2.0_wp*strain(across, k))
            call pull_back(f(:, :, k), stress(:, k))
         end do
         if (allocated(geometry%mode)) call return_modes(geometry, n, stress)
         do k = 1, geometry%n_gp
            s = reshape(stress([place_of], k), shape(s))
            force(:, :geometry%n_node, e) = force(:, :geometry%n_node, e) + geometry%weight(k) &
               *matmul(matmul(f(:n, :n, k), s(:n, :n)), geometry%gradient(:, :, k))
         end do
      end do
   end subroutine stress_forces

   !> What incompatible modes return of the stresses at the points.
   pure subroutine return_modes(geometry, n_dim, stress)
      type(element_geometry_t), intent(in) :: geometry       !! with modes
      integer, intent(in) :: n_dim
      real(wp), intent(inout) :: stress(:, :)    !! (6, n_gp), and room [M/(L T^2)]
      integer :: k, row(size(geometry%mode, 1))

      row = [(k, k = 1, size(row))]
      if (n_dim < n_space) row(size(row)) = place_of(1, n_dim)
      associate (n => geometry%n_gp)
         stress(row, :n) = returned(stress(row, :n))
      end associate

   contains

      pure function returned(values) result(part)
         real(wp), intent(in) :: values(:, :)
         real(wp) :: part(size(values, 1), size(values, 2))

         part = values
         call modes_return(geometry, part)
      end function returned

   end subroutine return_modes

   !> By what the material at a point of an element is turned and stretched; 1 across the plane.
   pure subroutine find_deformation(solid, e, gradient, u, square, f)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in) :: gradient(:, :)     !! (n_dim, nodes of it) at the point [1/L]
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      real(wp), intent(out) :: f(n_space, n_space)
      type(element_motion_t) :: motion
      real(wp) :: turn(size(u, 1), size(u, 1))
      integer :: a, n

      n = size(u, 1)
      f = 0.0_wp
      do a = 1, n_space
         f(a, a) = 1.0_wp
      end do
      if (solid%trait%is_corotated(e)) then
         call place(solid, e, u, motion, turn)
         f(:n, :n) = turn
      else if (.not. solid%trait%is_small(e)) then
         associate (node => solid%node(:solid%trait%n_node(e), e))
            f(:n, :n) = f(:n, :n) + square*matmul(u(:, node) &
               - spread(u(:, node(1)), 2, size(node)), &
               transpose(gradient))
         end associate
      end if
   end subroutine find_deformation

   !> The stress of the reference, det F F^-1 sigma F^-T, in place of Cauchy's.
   pure subroutine pull_back(f, stress)
      real(wp), intent(in) :: f(n_space, n_space)            !! det F > 0
      real(wp), intent(inout) :: stress(6)       !! xx, yy, zz, xy, yz, xz [M/(L T^2)]
      real(wp) :: s(n_space, n_space), cofactor(n_space, n_space)
      integer :: a, b

      do a = 1, n_space
         cofactor(:, a) = cross_product(f(:, 1 + modulo(a, n_space)), &
            f(:, 1 + modulo(a + 1, n_space)))
      end do
      s = reshape(stress([place_of]), shape(s))
      s = matmul(transpose(cofactor), matmul(s, cofactor))/dot_product(f(:, 1), cofactor(:, 1))
      do b = 1, n_space
         do a = 1, b
            stress(place_of(a, b)) = s(a, b)
         end do
      end do
   end subroutine pull_back

   !> Kinetic energy of each element.
   pure subroutine element_energies(solid, v, energy)
      type(solid_t), intent(in) :: solid
      real(wp), intent(in) :: v(:, :)            !! (n_dim, n_node) [L/T]
      real(wp), intent(out) :: energy(:)         !! (n_element) [M L^2/T^2]
      integer :: e, i, j

      energy = 0.0_wp
      do e = 1, solid%n_element
         do j = 1, solid%trait%n_node(e)
            do i = 1, solid%trait%n_node(e)
               energy(e) = energy(e) + 0.5_wp*solid%mass%consistent(i, j, e) &
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
