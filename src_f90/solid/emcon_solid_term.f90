!> All elements of a scene but those of small strains as one term: forces and tangents.
!>
!> Source: docs/theory.md, section 3.
module emcon_solid_term
   use emcon_csr, only : csr_t
   use emcon_element_lists, only : element_lists
   use emcon_element_pack, only : element_pack_t, pack_add_rounding, pack_gather, pack_make_room, &
      pack_motion_t, pack_response_t, pack_scatter
   use emcon_element_places, only : element_places_find, element_places_init, element_places_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_host_law, only : host_law_t, host_response_t
   use emcon_kinds, only : dp, wp
   use emcon_law, only : n_lane
   use emcon_law_registry, only : law_anisotropic, law_linear
   use emcon_motion, only : motion_t
   use emcon_pack_shares, only : border_keep, pack_shares_t, shares_has, shares_lay_out
   use emcon_point_function, only : point_failed
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_init, solid_t
   use emcon_solid_respond, only : solid_evaluate_user, solid_pack_respond
   use emcon_single_elements, only : compare_frequency, single_find_fastest, single_respond, &
      single_tangent_times
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_steps, only : step_square
   use emcon_term, only : fastest_t, response_t, role_internal, term_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: solid_term_t, solid_term_init

   !> Work space of a thread, made once.
   type :: pack_room_t
      type(pack_motion_t) :: motion
      type(pack_response_t) :: response
   end type pack_room_t

   type, extends(term_t) :: solid_term_t
      type(solid_t) :: solid
      real(wp) :: square = 1.0_wp                !! part of squares in strains; 0: small strains
      logical :: has_linear_laws = .false.       !! all materials of its elements are
      logical, private :: is_empty = .false.     !! no elements are left
      type(element_places_t), private :: to      !! of element matrices
      type(host_response_t), private :: user    !! what given laws answer
      type(pack_shares_t), private :: shares    !! of the threads
      type(pack_room_t), allocatable, private :: room(:)   !! (>= n_share)
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
      procedure :: add_stiffness
      procedure :: is_symmetric
      procedure :: find_fastest
   end type solid_term_t

contains

   !> The elements of `scene`, with the laws that a program gives.
   subroutine solid_term_init(self, scene, error, user)
      type(solid_term_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_law_t), intent(in), optional :: user(:)    !! one for each such material
      logical :: is_here(size(scene%material))

      self%role = role_internal
      call solid_init(self%solid, scene, error, user)
      is_here = .true.
      if (any(self%solid%trait%is_small)) then
         is_here = .false.
         is_here(pack(1 + mod(self%solid%law_of - 1, size(is_here)), &
            .not. self%solid%trait%is_small)) = .true.
      end if
      self%has_linear_laws = all(scene%material%law == 0 .or. scene%material%law == law_linear &
         .or. scene%material%law == law_anisotropic &
         .or. .not. is_here)
      self%is_empty = all(self%solid%trait%is_small) .and. self%solid%n_element > 0
   end subroutine solid_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(solid_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer, allocatable :: start(:), freedom(:)

      call element_lists(self%solid, lists%n_dim, start, freedom, .not. self%solid%trait%is_small)
      call lists_append(lists, start(2:) - start(:size(start) - 1), freedom)
   end subroutine lay_out

   !> As `term_t` has it.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(solid_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! element matrices by columns

      self%square = step_square(scene%step(i_step))
      self%user%square = self%square
      call element_places_init(self%to, size(scene%x, 1), merge(0, self%solid%trait%n_node, &
         self%solid%trait%is_small), slot)
   end subroutine begin_step

   !> Forces of a motion. What displacements are rounded by, forces are too.
   subroutine respond(self, motion, response, value, side)
      class(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: t

      if (self%solid%host%is_used) then
         call solid_evaluate_user(self%solid, motion%from, motion%by, self%square, &
            present(value), self%user)
         if (self%user%inverted_element > 0) call refuse(self, self%user%inverted_element, &
            response)
         if (self%user%inverted_element > 0) return
      end if
      if (size(self%solid%pack) == 0) then
         call single_respond(self%solid, self%user, self%to, motion, response, value, side)
         return
      end if
      call shares_lay_out(self%shares, self%solid%pack, size(motion%by, 2), response%n_thread)
      if (allocated(self%room)) then
         if (size(self%room) < self%shares%n) deallocate(self%room)
      end if
      if (.not. allocated(self%room)) allocate(self%room(self%shares%n))
      if (self%shares%n == 1) then               ! a team of one asks the system for each barrier
         call respond_share(self, 1, motion, response, value, side)
      else
         call respond_shares(self, motion, response, value, side)
      end if
      t = findloc(self%shares%inverted > 0, .true., 1)
      if (t > 0) call refuse(self, self%shares%inverted(t), response)
   end subroutine respond

   !> All shares, by threads.
   subroutine respond_shares(self, motion, response, value, side)
      type(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: t

      !$omp parallel default(none) shared(self, motion, response, value, side) &
      !$omp num_threads(response%n_thread)
      !$omp do schedule(static, 1)
      do t = 1, self%shares%n
         call respond_share(self, t, motion, response, value, side)
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do t = 1, self%shares%n
         call add_borders(self, t, motion%weight, response, value, side)
      end do
      !$omp end do
      !$omp end parallel
   end subroutine respond_shares

   !> The packs of a share: those nodes of theirs that no other share has.
   subroutine respond_share(self, share, motion, response, value, side)
      type(solid_term_t), intent(inout) :: self
      integer, intent(in) :: share               !! from 1
      type(motion_t), intent(in) :: motion       !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(wp) :: largest(n_lane)
      integer :: k, l

      call make_room(self, present(value), self%room(share)%motion, self%room(share)%response)
      self%room(share)%motion%square = self%square
      self%room(share)%response%with_sizes = response%with_sizes
      self%shares%inverted(share) = 0
      do k = self%shares%first(share) + 1, self%shares%first(share + 1)
         associate (pack => self%solid%pack(k), place => self%shares%place(k), &
               local => self%room(share)%motion, part => self%room(share)%response)
            call pack_gather(pack, motion%from, motion%by, local)
            call solid_pack_respond(self%solid, pack, local, self%user, present(value), part)
            if (any(part%is_inverted)) then
               self%shares%inverted(share) = pack%element(findloc(part%is_inverted, .true., 1))
               return
            end if
            do l = 1, pack%n
               response%energy(pack%element(l)) = part%energy(l)
            end do
            if (part%with_sizes) call find_largest(pack, motion, local, largest)
            if (place > 0) call border_keep(self%shares%border(place), part, largest, &
               present(value))
            call add_forces(self, pack, 0, part%force, part%magnitude, largest, response)
            if (present(value)) call add_tangents(self, pack, 0, motion%weight, &
               part%tangent, value, side)
         end associate
      end do
   end subroutine respond_share

   !> Work space for any of the packs.
   pure subroutine make_room(self, with_tangent, local, part)
      type(solid_term_t), intent(in) :: self
      logical, intent(in) :: with_tangent
      type(pack_motion_t), intent(inout) :: local
      type(pack_response_t), intent(inout) :: part
      integer :: k, n_most

      n_most = 0
      do k = 1, size(self%solid%pack)
         n_most = max(n_most, self%solid%pack(k)%n_node)
      end do
      call pack_make_room(self%solid%n_dim, n_most, with_tangent, local, part)
   end subroutine make_room

   !> The nodes that share `share` sums for all shares.
   subroutine add_borders(self, share, factor, response, value, side)
      type(solid_term_t), intent(in) :: self
      integer, intent(in) :: share               !! from 1
      real(wp), intent(in) :: factor             !! of the tangents
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: k

      if (any(self%shares%inverted > 0)) return
      do k = 1, size(self%shares%border)
         associate (border => self%shares%border(k))
            associate (pack => self%solid%pack(border%pack))
               if (.not. shares_has(self%shares, pack, share, share)) cycle
               call add_forces(self, pack, share, border%force, border%magnitude, &
                  border%largest, response)
               if (present(value)) call add_tangents(self, pack, share, factor, &
                  border%tangent, value, side)
            end associate
         end associate
      end do
   end subroutine add_borders

   !> The largest displacement of each element.
   pure subroutine find_largest(pack, motion, local, largest)
      type(element_pack_t), intent(in) :: pack
      type(motion_t), intent(in) :: motion
      type(pack_motion_t), intent(in) :: local   !! the same motion, of its nodes
      real(wp), intent(out) :: largest(n_lane)   !! [L]
      integer :: a, i, l

      largest = 0.0_wp
      do i = 1, pack%n_node
         do a = 1, size(local%by, 2)
            do l = 1, pack%n
               largest(l) = max(largest(l), abs(local%from(l, a, i) + local%by(l, a, i)), &
                  motion%computed(a, pack%node(l, i)))
            end do
         end do
      end do
   end subroutine find_largest

   !> Add the forces of a pack, element by element, with what its displacements are rounded by, to
   !> the nodes whose turn it is.
   pure subroutine add_forces(self, pack, turn, force, magnitude, largest, response)
      type(solid_term_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      integer, intent(in) :: turn                !! as in pack_shares_t
      real(wp), intent(in), contiguous :: force(:, :, :)       !! (n_lane, n_dim, >= n_node)
      real(wp), intent(in), contiguous :: magnitude(:, :, :)   !! (n_lane, n_dim, >= n_node)
      real(wp), intent(in) :: largest(n_lane)    !! displacement [L]
      type(response_t), intent(inout) :: response

      associate (total => response%part(self%role), turn_of => self%shares%turn)
         call pack_scatter(pack, turn_of, turn, force, total%force)
         if (.not. response%with_sizes) return
         call pack_scatter(pack, turn_of, turn, magnitude, total%magnitude)
         call pack_add_rounding(pack, turn_of, turn, largest, self%solid%stiffness, &
            response%rounding)
      end associate
   end subroutine add_forces

   !> Add the tangents of a pack to their places, in the rows of the nodes whose turn it is; the
   !> slots of an element run down the columns.
   pure subroutine add_tangents(self, pack, turn, factor, tangent, value, side)
      type(solid_term_t), intent(in) :: self
      type(element_pack_t), intent(in) :: pack
      integer, intent(in) :: turn                !! as in pack_shares_t
      real(wp), intent(in) :: factor             !! of the tangents
      !> (n_lane, n_dim, >= n_node, n_dim, >= n_node)
      real(wp), intent(in), contiguous :: tangent(:, :, :, :, :)
      real(dp), intent(inout) :: value(:), side(:)             !! slots > 0, slots < 0
      integer :: a, c, i, j, k, l, place, slot((size(tangent, 2)*pack%n_node)**2)

      do l = 1, pack%n
         call element_places_find(self%to, pack%element(l), pack%n_node, slot)
         k = 0
         do j = 1, pack%n_node
            do c = 1, size(tangent, 4)
               do i = 1, pack%n_node
                  do a = 1, size(tangent, 2)
                     k = k + 1
                     if (self%shares%turn(pack%node(l, i)) /= turn) cycle
                     place = slot(k)
                     if (place > 0) then
                        value(place) = value(place) + real(factor*tangent(l, a, i, c, j), dp)
                     else if (place < 0) then
                        side(-place) = side(-place) + real(factor*tangent(l, a, i, c, j), dp)
                     end if
                  end do
               end do
            end do
         end do
      end do
   end subroutine add_tangents

   !> Why there is no response: element `e` is inverted, or a given law does not answer.
   subroutine refuse(self, e, response)
      type(solid_term_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element
      type(response_t), intent(inout) :: response

      if (self%user%material == 0) then
         response%refusal = "element " // to_text(self%solid%deck%label(e)) // " is inverted"
         return
      end if
      response%refusal = "the law given for material " // &
         self%solid%deck%material(self%user%material)%text
      if (self%user%status == point_failed) then
         response%refusal = response%refusal // " has failed"
         call raise(response%failure, err_analysis, response%refusal)
      else
         response%refusal = response%refusal // " has no finite value at a strain that occurs"
      end if
   end subroutine refuse

   !> Add the tangent of a motion times `direction` to `product`. Elements that `direction` does not
   !> touch are passed over.
   subroutine tangent_times(self, motion, direction, product)
      class(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      type(pack_response_t) :: part
      type(pack_motion_t) :: local
      integer :: k

      if (self%solid%host%is_used) then
         call solid_evaluate_user(self%solid, motion%from, motion%by, self%square, .true., &
            self%user)
         if (self%user%inverted_element > 0) return
      end if
      if (size(self%solid%pack) == 0) then
         call single_tangent_times(self%solid, self%user, motion, direction, product)
         return
      end if
      local%square = self%square
      call make_room(self, .true., local, part)
      do k = 1, size(self%solid%pack)
         associate (pack => self%solid%pack(k))
            if (.not. touches(pack, direction)) cycle
            call pack_gather(pack, motion%from, motion%by, local)
            call solid_pack_respond(self%solid, pack, local, self%user, .true., part)
            if (any(part%is_inverted)) return
            call add_image(pack, part, motion%weight, direction, product)
         end associate
      end do
   end subroutine tangent_times

   !> Does `direction` move a node of the pack?
   pure logical function touches(pack, direction)
      type(element_pack_t), intent(in) :: pack
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node)
      integer :: i, l

      touches = .true.
      do i = 1, pack%n_node
         do l = 1, pack%n
            if (any(abs(direction(:, pack%node(l, i))) > 0.0_wp)) return
         end do
      end do
      touches = .false.
   end function touches

   !> Add `factor` times the tangents of a pack times `direction`.
   pure subroutine add_image(pack, part, factor, direction, product)
      type(element_pack_t), intent(in) :: pack
      type(pack_response_t), intent(in) :: part
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node)
      real(wp), intent(inout) :: product(:, :)   !! (n_dim, n_node)
      real(wp) :: sum_of
      integer :: a, c, i, j, l

      do l = 1, pack%n
         do i = 1, pack%n_node
            do a = 1, size(product, 1)
               sum_of = 0.0_wp
               do j = 1, pack%n_node
                  do c = 1, size(product, 1)
                     sum_of = sum_of + part%tangent(l, a, i, c, j)*direction(c, pack%node(l, j))
                  end do
               end do
               product(a, pack%node(l, i)) = product(a, pack%node(l, i)) + factor*sum_of
            end do
         end do
      end do
   end subroutine add_image

   !> As `term_t` has it.
   pure subroutine add_stiffness(self, stiffness)
      class(solid_term_t), intent(in) :: self
      real(wp), intent(inout) :: stiffness(:)    !! (n_node) [M/T^2]
      integer :: e, i

      do e = 1, self%solid%n_element
         do i = 1, self%solid%trait%n_node(e)
            associate (node => self%solid%node(i, e))
               stiffness(node) = stiffness(node) + self%solid%stiffness(i, e)
            end associate
         end do
      end do
   end subroutine add_stiffness

   !> Second derivatives of an energy are symmetric: those at the end of a step, and those of
   !> discrete gradients of quadratic energies.
   pure logical function is_symmetric(self, motion)
      class(solid_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = motion%evaluation%is_gradient .or. self%is_empty &
         .or. (self%has_linear_laws .and. .not. self%square > 0.0_wp)
   end function is_symmetric

   !> The fastest of the elements.
   subroutine find_fastest(self, motion, fastest, is_bounded)
      class(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed at its end
      type(fastest_t), intent(inout) :: fastest
      logical, intent(inout) :: is_bounded       !! by elements
      type(pack_response_t) :: part
      type(pack_motion_t) :: local
      integer :: k, l

      if (self%solid%host%is_used) then
         call solid_evaluate_user(self%solid, motion%from, motion%by, self%square, .true., &
            self%user)
         if (self%user%inverted_element > 0) return
      end if
      if (size(self%solid%pack) == 0) then
         call single_find_fastest(self%solid, self%user, motion, fastest)
         return
      end if
      local%square = self%square
      call make_room(self, .true., local, part)
      do k = 1, size(self%solid%pack)
         associate (pack => self%solid%pack(k))
            call pack_gather(pack, motion%from, motion%by, local)
            call solid_pack_respond(self%solid, pack, local, self%user, .true., part)
            if (any(part%is_inverted)) return
            do l = 1, pack%n
               call compare_frequency(self%solid, pack%element(l), motion%weight, &
                  part%tangent(l, :, :pack%n_node, :, :pack%n_node), fastest)
            end do
         end associate
      end do
   end subroutine find_fastest

end module emcon_solid_term
