!> Elements of corotated sections as one term: a constant stiffness in frames that turn with them.
!>
!> Source: docs/theory.md, section 3.
module emcon_corotated_term
   use emcon_corotated_pack_plane, only : corotated_pack_fill, corotated_pack_gather, &
      corotated_pack_motion_t, corotated_pack_respond, corotated_pack_t
   use emcon_corotated_plane, only : corotated_energy, corotated_image, corotated_init, &
      corotated_motion_t, corotated_move, corotated_t
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : dp, wp
   use emcon_law, only : n_lane
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_geometry, solid_t
   use emcon_space, only : space_t
   use emcon_stiff_elements, only : stiff_term_init, stiff_term_t
   use emcon_term, only : response_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: corotated_term_t, corotated_term_init

   type, extends(stiff_term_t) :: corotated_term_t
      type(corotated_t), allocatable, private :: frame(:)    !! (n)
      type(corotated_pack_t), allocatable, private :: pack(:)
      integer, allocatable, private :: label(:)              !! (n) of the elements
      integer, allocatable, private :: slot(:)   !! element matrices by columns
   contains
      procedure :: begin_step
      procedure :: respond
      procedure :: find_energy
      procedure :: tangent_times
      procedure :: is_symmetric
   end type corotated_term_t

contains

   !> The corotated elements of `solid`.
   subroutine corotated_term_init(self, solid, n_dim)
      type(corotated_term_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0
      type(element_geometry_t) :: geometry
      integer :: k, m

      call stiff_term_init(self, solid, n_dim, solid%trait%is_corotated)
      self%label = solid%deck%label(self%own%element)
      allocate(self%frame(size(self%own%element)))
      do k = 1, size(self%frame)
         m = n_dim*self%own%n_node(k)
         call solid_geometry(solid, self%own%element(k), geometry)
         call corotated_init(self%frame(k), geometry, &
            solid%x(:, self%own%node(:self%own%n_node(k), k)))
         allocate(self%frame(k)%stiffness, source=self%own%stiffness(:m, :m, k))
      end do
      call fill_packs(self)
   end subroutine corotated_term_init

   !> Put elements with as many nodes side by side, in the order of the list.
   pure subroutine fill_packs(self)
      type(corotated_term_t), intent(inout) :: self
      integer, allocatable :: like(:)
      integer :: first, n, n_node

      n = 0
      do n_node = 1, size(self%own%node, 1)
         n = n + (count(self%own%n_node == n_node) + n_lane - 1)/n_lane
      end do
      allocate(self%pack(n))
      n = 0
      do n_node = 1, size(self%own%node, 1)
         like = pack([(first, first = 1, size(self%frame))], self%own%n_node == n_node)
         do first = 1, size(like), n_lane
            n = n + 1
            call corotated_pack_fill(self%pack(n), like(first:min(first + n_lane - 1, &
               size(like))), self%own%node, self%frame)
         end do
      end do
   end subroutine fill_packs

   !> As `term_t` has it.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(corotated_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! element matrices by columns

      self%slot = slot
   end subroutine begin_step

   !> Forces of a motion, discrete gradients of the energies of the elements.
   subroutine respond(self, motion, response, value, side)
      class(corotated_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      type(corotated_pack_motion_t) :: local
      integer :: p

      do p = 1, size(self%pack)
         associate (pack => self%pack(p))
            call corotated_pack_gather(pack, motion%from, motion%by, local)
            call corotated_pack_respond(pack, local)
            if (any(local%is_inverted)) then
               response%refusal = "element " // to_text(self%label(pack%element( &
                  findloc(local%is_inverted, .true., 1)))) // " is inverted"
               return
            end if
            call add_forces(self, pack, motion, local, response)
         end associate
      end do
      if (present(value)) call add_tangents(self, motion, value, side)
   end subroutine respond

   !> Add the forces of a pack, element by element, with what its displacements are rounded by.
   pure subroutine add_forces(self, pack, motion, local, response)
      type(corotated_term_t), intent(in) :: self
      type(corotated_pack_t), intent(in) :: pack
      type(motion_t), intent(in) :: motion
      type(corotated_pack_motion_t), intent(in) :: local       !! the same motion, of its nodes
      type(response_t), intent(inout) :: response
      real(wp) :: largest
      integer :: a, i, l, node

      associate (total => response%part(self%role), n => pack%n_node)
         do l = 1, pack%n
            do i = 1, n
               node = pack%node(l, i)
               do a = 1, size(local%force, 2)
                  total%force(a, node) = total%force(a, node) + local%force(l, a, i)
               end do
            end do
            if (.not. response%with_sizes) cycle
            largest = maxval(abs(local%from(l, :, :n) + local%by(l, :, :n)))
            do i = 1, n
               largest = max(largest, maxval(motion%computed(:, pack%node(l, i))))
            end do
            do i = 1, n
               node = pack%node(l, i)
               total%magnitude(:, node) = total%magnitude(:, node) + abs(local%force(l, :, i))
               response%rounding(:, node) = response%rounding(:, node) &
                  + largest*self%own%rounding(i, pack%element(l))
            end do
         end do
      end associate
   end subroutine add_forces

   !> Add the tangents of all elements, none of which is inverted, to their places.
   subroutine add_tangents(self, motion, value, side)
      type(corotated_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      real(dp), intent(inout) :: value(:), side(:)
      type(corotated_motion_t) :: moved
      real(wp), dimension(size(motion%x, 1), size(self%own%node, 1)) :: from, by
      integer :: k, s

      s = 0
      do k = 1, size(self%frame)
         call gather(self, k, motion, from, by)
         call corotated_move(self%frame(k), from, by, moved)
         call scatter(self, k, moved, motion%weight, s, value, side)
      end do
   end subroutine add_tangents

   !> Energies at the end of a motion.
   pure subroutine find_energy(self, motion, energy)
      class(corotated_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed
      real(wp), intent(inout) :: energy(:)       !! (n_element) [M L^2/T^2]
      real(wp), dimension(size(motion%x, 1), size(self%own%node, 1)) :: from, by
      integer :: k

      do k = 1, size(self%frame)
         call gather(self, k, motion, from, by)
         energy(self%own%element(k)) = corotated_energy(self%frame(k), from + by)
      end do
   end subroutine find_energy

   !> Displacements of the nodes of element `k` of the list, from those of its first node.
   pure subroutine gather(self, k, motion, from, by)
      class(corotated_term_t), intent(in) :: self
      integer, intent(in) :: k
      type(motion_t), intent(in) :: motion
      real(wp), intent(inout) :: from(:, :), by(:, :)    !! (n_dim, n_most)
      integer :: i

      from = 0.0_wp
      by = 0.0_wp
      do i = 2, self%own%n_node(k)
         associate (node => self%own%node(i, k), first => self%own%node(1, k))
            from(:, i) = motion%from(:, node) - motion%from(:, first)
            by(:, i) = motion%by(:, node) - motion%by(:, first)
         end associate
      end do
   end subroutine gather

   !> Add the tangent of element `k` to its places, column by column.
   subroutine scatter(self, k, moved, weight, s, value, side)
      class(corotated_term_t), intent(in) :: self
      integer, intent(in) :: k
      type(corotated_motion_t), intent(in) :: moved
      real(wp), intent(in) :: weight                     !! as in `motion_t`
      integer, intent(inout) :: s                        !! slots that were used
      real(dp), intent(inout) :: value(:), side(:)
      real(wp), dimension(size(moved%g), size(self%own%node, 1)) :: displacement, image
      integer :: i, j, a, b

      displacement = 0.0_wp
      do j = 1, self%own%n_node(k)
         do b = 1, size(displacement, 1)
            displacement(b, j) = 1.0_wp
            call corotated_image(self%frame(k), moved, displacement, image)
            displacement(b, j) = 0.0_wp
            do i = 1, self%own%n_node(k)
               do a = 1, size(displacement, 1)
                  s = s + 1
                  associate (at => self%slot(s), more => real(weight*image(a, i), dp))
                     if (at > 0) value(at) = value(at) + more
                     if (at < 0) side(-at) = side(-at) + more
                  end associate
               end do
            end do
         end do
      end do
   end subroutine scatter

   !> Add the tangent of a motion times `direction` to `product`.
   subroutine tangent_times(self, motion, direction, product)
      class(corotated_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      type(corotated_motion_t) :: moved
      real(wp), dimension(size(motion%x, 1), size(self%own%node, 1)) :: from, by, image
      integer :: i, k

      do k = 1, size(self%frame)
         associate (node => self%own%node(:self%own%n_node(k), k))
            if (.not. any(abs(direction(:, node)) > 0.0_wp)) cycle
            call gather(self, k, motion, from, by)
            call corotated_move(self%frame(k), from, by, moved)
            if (.not. min(moved%first%rho, moved%last%rho) > 0.0_wp) return
            do i = 1, size(node)
               by(:, i) = direction(:, node(i))
            end do
            call corotated_image(self%frame(k), moved, by, image)
            do i = 1, size(node)
               product(:, node(i)) = product(:, node(i)) + motion%weight*image(:, i)
            end do
         end associate
      end do
   end subroutine tangent_times

   !> Second derivatives of an energy are symmetric, those of its discrete gradient are not.
   pure logical function is_symmetric(self, motion)
      class(corotated_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = motion%evaluation%is_gradient
   end function is_symmetric

end module emcon_corotated_term
