!> What elements respond to a motion: a pack of them, or one alone; laws that a program
!> gives answer first, each in one call for all its points.
!>
!> Source: docs/theory.md, eqs. (6) and (11).
module emcon_solid_respond
   use emcon_element_pack, only : element_pack_t, pack_begin, pack_clear, pack_make_room, &
      pack_motion_t, pack_put, pack_response_t
   use emcon_element, only : element_geometry_t
   use emcon_element_plane, only : element_motion_t, element_point, element_response_t, &
      point_is_regular, point_motion_t
   use emcon_element_space, only : n_space, space_motion_t
   use emcon_incompatible_pack_space, only : incompatible_respond_space => incompatible_respond
   use emcon_law_points_space, only : law_respond_points_space
   use emcon_mean_volume_pack_space, only : mean_volume_respond_space => mean_volume_respond
   use emcon_user_space, only : user_space_strain
   use emcon_host_law, only : host_answer, host_points_make_room, host_response_t
   use emcon_incompatible_plane, only : incompatible_respond
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   use emcon_mean_volume_plane, only : mean_volume_respond
   use emcon_pack_points_plane, only : pack_add_point, pack_point, pack_point_check, pack_point_t
   use emcon_pack_points_space, only : add_point_space => pack_add_point, &
      pack_gradient, point_space => pack_point, point_check_space => pack_point_check, &
      point_space_t => pack_point_t
   use emcon_point_function, only : point_gradient, point_ok
   use emcon_solid, only : solid_geometry, solid_t
   implicit none
   private
   public :: solid_element_respond, solid_pack_respond, solid_evaluate_user, solid_gather

contains

   !> Response of a pack to a motion, which is that of `user` too.
   pure subroutine solid_pack_respond(self, pack, motion, user, with_tangent, part)
      type(solid_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      type(pack_motion_t), intent(in) :: motion
      type(host_response_t), intent(in) :: user
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part

      if (self%n_dim == n_space) then
         call pack_respond_space(self, pack, motion, user, with_tangent, part)
      else
         call pack_respond_plane(self, pack, motion, user, with_tangent, part)
      end if
   end subroutine solid_pack_respond

   pure subroutine pack_respond_plane(self, pack, motion, user, with_tangent, part)
      type(solid_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      type(pack_motion_t), intent(in) :: motion
      type(host_response_t), intent(in) :: user
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part
      type(pack_point_t) :: point
      integer :: k

      if (allocated(pack%mode)) then
         call incompatible_respond(pack, pack%gradient, self%law(pack%law)%law, motion, &
            with_tangent, part)
         return
      else if (self%trait%has_mean(pack%element(1))) then
         call mean_volume_respond(pack, pack%gradient, self%law(pack%law)%law, &
            self%rest(pack%law)%law, motion, with_tangent, part)
         return
      end if
      call pack_clear(pack%n_node, part, with_tangent)
      do k = 1, pack%n_gp
         call pack_point(pack%n_node, pack%gradient(:, :, :, k), motion, point)
         if (self%host%first_point(pack%element(1)) > 0) then
            call host_answer(user%points(pack%law), self%host%first_point(pack%element) - 1 + k, &
               point%law%energy, point%law%stress, point%law%tangent)
         else
            associate (law => self%law(pack%law)%law)
               call pack_point_check(law%has_volume, point, part)
               call law%respond(point%law, with_tangent)
            end associate
         end if
         call pack_add_point(pack%n_node, pack%gradient(:, :, :, k), pack%weight(:, k), point, &
            with_tangent, part)
      end do
   end subroutine pack_respond_plane

   pure subroutine pack_respond_space(self, pack, motion, user, with_tangent, part)
      type(solid_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      type(pack_motion_t), intent(in) :: motion
      type(host_response_t), intent(in) :: user
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part
      type(point_space_t) :: point
      real(wp) :: gradient(n_lane, n_space, pack%n_node)
      integer :: k

      if (allocated(pack%mode) .or. self%trait%has_mean(pack%element(1))) then
         call pack_respond_whole(self, pack, motion, with_tangent, part)
         return
      end if
      call pack_clear(pack%n_node, part, with_tangent)
      do k = 1, pack%n_gp
         call pack_gradient(pack%n_node, pack%x, self%shape(pack%kind)%table%slope(:, :, k), &
            gradient)
         call point_space(pack%n_node, gradient, motion, point)
         if (self%host%first_point(pack%element(1)) > 0) then
            call host_answer(user%points(pack%law), self%host%first_point(pack%element) - 1 + k, &
               point%law%energy, point%law%stress, point%law%tangent)
         else
            associate (law => self%law(pack%law)%law)
               call point_check_space(law%has_volume, point, part)
               call law_respond_points_space(law, point%law, with_tangent)
            end associate
         end if
         call add_point_space(pack%n_node, gradient, pack%weight(:, k), point, with_tangent, part)
      end do
   end subroutine pack_respond_space

   !> The same of elements whose points answer together.
   pure subroutine pack_respond_whole(self, pack, motion, with_tangent, part)
      type(solid_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      type(pack_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(pack_response_t), intent(inout) :: part
      real(wp) :: gradient(n_lane, n_space, pack%n_node, pack%n_gp)
      integer :: k

      do k = 1, pack%n_gp
         call pack_gradient(pack%n_node, pack%x, self%shape(pack%kind)%table%slope(:, :, k), &
            gradient(:, :, :, k))
      end do
      if (allocated(pack%mode)) then
         call incompatible_respond_space(pack, gradient, self%law(pack%law)%law, motion, &
            with_tangent, part)
      else
         call mean_volume_respond_space(pack, gradient, self%law(pack%law)%law, &
            self%rest(pack%law)%law, motion, with_tangent, part)
      end if
   end subroutine pack_respond_whole

   !> Response of element `e` of the plane alone.
   pure subroutine solid_element_respond(self, e, motion, user, with_tangent, part)
      type(solid_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1 to n_element
      type(element_motion_t), intent(in) :: motion
      type(host_response_t), intent(in) :: user
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(element_response_t), intent(inout) :: part
      type(element_pack_t) :: pack
      type(pack_motion_t) :: motions
      type(pack_response_t) :: parts
      type(element_geometry_t) :: geometry
      integer :: i, n

      call solid_geometry(self, e, geometry)
      call pack_begin(pack, 1, self%kind(e), self%law_of(e))
      call pack_put(pack, 1, e, self%node(:geometry%n_node, e), geometry)
      motions%square = motion%square
      n = pack%n_node
      call pack_make_room(self%n_dim, n, with_tangent, motions, parts)
      do i = 1, n
         motions%from(:, :, i) = spread(motion%from(:, i) - motion%from(:, 1), 1, n_lane)
         motions%by(:, :, i) = spread(motion%by(:, i) - motion%by(:, 1), 1, n_lane)
      end do
      call solid_pack_respond(self, pack, motions, user, with_tangent, parts)
      part%energy = parts%energy(1)
      part%force(:, :n) = parts%force(1, :, :n)
      part%magnitude(:, :n) = parts%magnitude(1, :, :n)
      if (with_tangent) part%tangent(:2*n, :2*n) = reshape(parts%tangent(1, :, :n, :, :n), &
         [2*n, 2*n])
      part%is_inverted = parts%is_inverted(1)
   end subroutine solid_element_respond

   !> Let the given laws answer to the step, each in one call for all its points.
   subroutine solid_evaluate_user(self, u0, du, square, with_tangent, user)
      type(solid_t), intent(in) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)     !! (n_dim, n_node)
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(host_response_t), intent(inout) :: user
      integer :: k

      user%material = 0
      user%status = point_ok
      user%square = square
      call make_room(self, user)
      if (self%is_single) then
         call gather_in_space(self, u0, du, user)
      else
         call gather_strains(self, u0, du, user)
      end if
      if (user%inverted_element > 0) return
      do k = 1, size(self%host%law)
         if (self%host%n_point(k) == 0) cycle
         associate (points => user%points(k))
            call point_gradient(self%host%law(k)%energy, points%strain, points%dstrain, &
               with_tangent, points%response, user%status)
         end associate
         if (user%status == point_ok) cycle
         user%material = k
         user%inverted_element = findloc(self%law_of, k, 1)
         return
      end do
   end subroutine solid_evaluate_user

   pure subroutine make_room(self, user)
      type(solid_t), intent(in) :: self
      type(host_response_t), intent(inout) :: user
      integer :: k

      if (.not. allocated(user%points)) allocate(user%points(size(self%host%law)))
      do k = 1, size(self%host%law)
         if (self%host%n_point(k) > 0) call host_points_make_room(user%points(k), &
            self%host%law(k)%energy%n_variable, self%host%n_point(k))
      end do
   end subroutine make_room

   !> The strains of the elements of given laws, and the first of these that is inverted.
   pure subroutine gather_strains(self, u0, du, user)
      type(solid_t), intent(in) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)     !! (2, n_node)
      type(host_response_t), intent(inout) :: user
      type(element_motion_t) :: local
      type(point_motion_t) :: point
      type(element_geometry_t) :: geometry
      integer :: e, i, k

      user%inverted_element = 0
      local%square = user%square
      do e = 1, self%n_element
         if (self%host%first_point(e) == 0) cycle
         call solid_geometry(self, e, geometry)
         call solid_gather(self%node(:geometry%n_node, e), u0, du, local)
         do k = 1, geometry%n_gp
            i = self%host%first_point(e) - 1 + k
            call element_point(geometry, k, local, point)
            associate (points => user%points(self%law_of(e)))
               points%strain(:, i) = point%strain
               points%dstrain(:, i) = point%dstrain
            end associate
            if (.not. point_is_regular(point, .false.)) then
               user%inverted_element = e
               return
            end if
         end do
      end do
   end subroutine gather_strains

   !> The same in three dimensions.
   pure subroutine gather_in_space(self, u0, du, user)
      type(solid_t), intent(in) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)     !! (3, n_node)
      type(host_response_t), intent(inout) :: user
      type(space_motion_t) :: local
      type(element_geometry_t) :: geometry
      logical :: is_inverted
      integer :: e, i

      user%inverted_element = 0
      local%square = user%square
      do e = 1, self%n_element
         if (self%host%first_point(e) == 0) cycle
         call solid_geometry(self, e, geometry)
         associate (node => self%node(:geometry%n_node, e))
            do i = 1, size(node)
               local%from(:, i) = u0(:, node(i)) - u0(:, node(1))
               local%by(:, i) = du(:, node(i)) - du(:, node(1))
            end do
         end associate
         call user_space_strain(geometry, self%host%first_point(e), local, &
            user%points(self%law_of(e)), is_inverted)
         if (.not. is_inverted) cycle
         user%inverted_element = e
         return
      end do
   end subroutine gather_in_space

   !> Displacements of the nodes of an element relative to its first node, which does not round them
   !> with the distance that a body has flown.
   pure subroutine solid_gather(node, u0, du, local)
      integer, intent(in) :: node(:)                             !! of the element
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)     !! (2, n_node)
      type(element_motion_t), intent(inout) :: local             !! `from`, `by` are set
      integer :: i

      do i = 1, size(node)
         local%from(:, i) = u0(:, node(i)) - u0(:, node(1))
         local%by(:, i) = du(:, node(i)) - du(:, node(1))
      end do
   end subroutine solid_gather

end module emcon_solid_respond
