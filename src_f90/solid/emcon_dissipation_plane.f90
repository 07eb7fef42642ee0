!> Forces of elements that take energy: against strain increments that change from step to step,
!> chi/2 C (dE - dE_before), where the scheme asks for it; of damped materials against the rate of
!> strain, beta C dE/h, and against velocity, alpha M du/h. C are the moduli at rest.
!>
!> Source: docs/theory.md, eqs. (4e) to (4g), (11a) and (11b).
module emcon_dissipation_plane
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_element_lists, only : element_lists
   use emcon_element_plane, only : element_motion_t, element_point, point_motion_t
   use emcon_incompatible_modes, only : modes_relax
   use emcon_kinds, only : dp, wp
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_steps, only : step_square
   use emcon_term, only : response_t, role_internal, term_t
   implicit none
   private
   public :: dissipation_term_t, dissipation_term_init

   !> Components of strain and stress.
   integer, parameter :: n_strain = 3

   type, extends(term_t) :: dissipation_term_t
      type(solid_t), private :: solid
      logical, allocatable, private :: is_damped(:)      !! (n_element) it may take energy
      logical, allocatable, private :: deforms(:)        !! (n_element) and has moduli
      real(wp), allocatable, private :: alpha(:)         !! (n_element) of its material [1/T]
      real(wp), allocatable, private :: beta(:)          !! (n_element) of its material [T]
      !> (3, 3, 2 n_law) of laws at rest, then of what `rest` leaves of them [M/(L T^2)]
      real(wp), allocatable, private :: moduli(:, :, :)
      integer, allocatable, private :: moduli_of(:)      !! (n_element) which of these
      real(wp), private :: square = 1.0_wp               !! part of squares in strains
      integer, allocatable, private :: slot(:)           !! element matrices by columns
      ! Of the last motion's forces [M L^2/T^2]:
      real(wp) :: work = 0.0_wp                  !! taken by the scheme
      real(wp) :: damping = 0.0_wp               !! taken by materials
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: is_symmetric
   end type dissipation_term_t

contains

   !> The elements of `solid` that deform by a law of EMCON, and those that have mass.
   subroutine dissipation_term_init(self, solid, scene)
      type(dissipation_term_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      type(scene_t), intent(in) :: scene
      real(wp), parameter :: rest(n_strain) = 0.0_wp
      type(law_response_t) :: state
      integer :: k

      self%role = role_internal
      self%solid = solid
      allocate(self%moduli(n_strain, n_strain, 2*size(solid%law)), source=0.0_wp)
      allocate(self%deforms(solid%n_element), source=.false.)
      self%moduli_of = solid%law_of + merge(size(solid%law), 0, solid%trait%has_mean)
      do k = 1, size(solid%law)
         if (.not. allocated(solid%law(k)%law)) cycle
         call law_response_plane(solid%law(k)%law, rest, rest, state)
         ! By the end of a step of no size.
         self%moduli(:, :, k) = 2.0_wp*state%tangent
         self%deforms = self%deforms .or. (solid%law_of == k .and. .not. solid%trait%is_rigid)
         if (.not. allocated(solid%rest(k)%law)) cycle
         call law_response_plane(solid%rest(k)%law, rest, rest, state)
         self%moduli(:, :, size(solid%law) + k) = 2.0_wp*state%tangent
      end do
      associate (material => scene%section(scene%element%section)%material)
         self%alpha = scene%material(material)%alpha
         self%beta = merge(scene%material(material)%beta, 0.0_wp, self%deforms)
      end associate
      self%is_damped = self%alpha > 0.0_wp .or. self%beta > 0.0_wp
      if (any(scene%step%scheme%dissipates)) self%is_damped = self%is_damped .or. self%deforms
   end subroutine dissipation_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(dissipation_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer, allocatable :: start(:), freedom(:)

      call element_lists(self%solid, lists%n_dim, start, freedom, self%is_damped)
      call lists_append(lists, start(2:) - start(:size(start) - 1), freedom)
   end subroutine lay_out

   !> As `term_t` has it.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(dissipation_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! element matrices by columns

      self%square = step_square(scene%step(i_step))
      self%slot = slot
   end subroutine begin_step

   !> Forces of a motion; none where masses do not resist.
   subroutine respond(self, motion, response, value, side)
      class(dissipation_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: e, first

      self%work = 0.0_wp
      self%damping = 0.0_wp
      if (.not. motion%evaluation%mass_scale > 0.0_wp) return
      first = 0
      do e = 1, self%solid%n_element
         if (.not. self%is_damped(e)) cycle
         if (self%deforms(e)) call add_element(self, e, first, motion, response, value, side)
         if (self%alpha(e) > 0.0_wp) call add_drag(self, e, first, motion, response, value, side)
         first = first + (size(motion%du, 1)*self%solid%geometry(e)%n_node)**2
      end do
   end subroutine respond

   !> The motions of an element over the step, and over the one before.
   pure subroutine gather(self, e, motion, now, before)
      type(dissipation_term_t), intent(in) :: self
      integer, intent(in) :: e
      type(motion_t), intent(in) :: motion
      type(element_motion_t), intent(out) :: now, before
      integer :: i

      now%square = self%solid%trait%square_of(e, self%square)
      before%square = now%square
      do i = 1, self%solid%geometry(e)%n_node
         associate (node => self%solid%node(i, e), u0 => motion%u0)
            now%from(:, i) = u0(:, node) - u0(:, self%solid%node(1, e))
            now%by(:, i) = motion%du(:, node) - motion%du(:, self%solid%node(1, e))
            if (.not. allocated(motion%du_before)) cycle
            before%by(:, i) = motion%du_before(:, node) &
               - motion%du_before(:, self%solid%node(1, e))
            before%from(:, i) = now%from(:, i) - before%by(:, i)
         end associate
      end do
   end subroutine gather

   !> Add the forces of element `e`, and their derivatives to the places from `first` on.
   subroutine add_element(self, e, first, motion, response, value, side)
      type(dissipation_term_t), intent(inout) :: self
      integer, intent(in) :: e, first
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)
      type(element_motion_t) :: now, before
      type(point_motion_t) :: point
      real(wp), dimension(n_strain, n_strain) :: c, viscous
      real(wp), dimension(n_strain, self%solid%geometry(e)%n_gp) :: strain, last
      real(wp) :: s(n_strain), rate(n_strain), f(size(motion%du, 1))
      integer :: g, i

      if (.not. (motion%evaluation%dissipation > 0.0_wp .or. self%beta(e) > 0.0_wp)) return
      call gather(self, e, motion, now, before)
      call find_increments(self%solid%geometry(e), now, strain)
      call find_increments(self%solid%geometry(e), before, last)
      associate (geometry => self%solid%geometry(e), total => response%part(self%role))
         do g = 1, geometry%n_gp
            call element_point(geometry, g, now, point)
            c = 0.5_wp*motion%evaluation%dissipation*geometry%weight(g) &
               *self%moduli(:, :, self%moduli_of(e))
            viscous = (self%beta(e)*motion%evaluation%mass_scale)*geometry%weight(g) &
               *self%moduli(:, :, self%moduli_of(e))
            s = matmul(c, strain(:, g) - motion%evaluation%recalled*last(:, g))
            rate = matmul(viscous, strain(:, g))
            self%work = self%work + dot_product(s, strain(:, g))
            self%damping = self%damping + dot_product(rate, strain(:, g))
            s = s + rate
            do i = 1, geometry%n_node
               f = matmul(point%f_mid, traction(s, geometry%gradient(:, i, g)))
               associate (node => self%solid%node(i, e))
                  total%force(:, node) = total%force(:, node) + f
                  if (response%with_sizes) total%magnitude(:, node) = total%magnitude(:, node) &
                     + abs(f)
               end associate
            end do
            if (present(value)) call add_tangent(self%slot(first + 1:), geometry, g, c + viscous, &
               now, value, side)
         end do
      end associate
   end subroutine add_element

   !> Increments of the strains at the points. Incompatible modes are taken out, by the same moduli
   !> that make stress of them here: such a stress has no part to be returned.
   pure subroutine find_increments(geometry, motion, strain)
      type(element_geometry_t), intent(in) :: geometry
      type(element_motion_t), intent(in) :: motion
      real(wp), intent(out) :: strain(:, :)      !! (n_strain, n_gp)
      type(point_motion_t) :: point
      integer :: g

      do g = 1, geometry%n_gp
         call element_point(geometry, g, motion, point)
         strain(:, g) = point%dstrain
      end do
      if (allocated(geometry%mode)) call modes_relax(geometry, strain)
   end subroutine find_increments

   !> Add the drag of the mass of element `e`, and its derivatives to the places from `first` on.
   pure subroutine add_drag(self, e, first, motion, response, value, side)
      type(dissipation_term_t), intent(inout) :: self
      integer, intent(in) :: e, first
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)
      real(wp) :: f(size(motion%du, 1)), part
      integer :: i, j, a, place, n_dim

      n_dim = size(f)
      associate (node => self%solid%node(:, e), n => self%solid%geometry(e)%n_node, &
            total => response%part(self%role))
         do j = 1, n
            do i = 1, n
               part = self%alpha(e)*motion%evaluation%mass_scale*self%solid%mass%consistent(i, j, e)
               f = part*motion%du(:, node(j))
               self%damping = self%damping + dot_product(f, motion%du(:, node(i)))
               total%force(:, node(i)) = total%force(:, node(i)) + f
               if (response%with_sizes) total%magnitude(:, node(i)) = &
                  total%magnitude(:, node(i)) + abs(f)
               if (.not. present(value)) cycle
               do a = 1, n_dim
                  place = self%slot(first + (n_dim*(j - 1) + a - 1)*n_dim*n + n_dim*(i - 1) + a)
                  if (place > 0) value(place) = value(place) + real(part, dp)
                  if (place < 0) side(-place) = side(-place) + real(part, dp)
               end do
            end do
         end do
      end associate
   end subroutine add_drag

   !> Stress times a gradient.
   pure function traction(s, gradient) result(t)
      real(wp), intent(in) :: s(n_strain)        !! S11, S22, S12
      real(wp), intent(in) :: gradient(:)        !! (n_dim)
      real(wp) :: t(size(gradient))

      t = [s(1)*gradient(1) + s(n_strain)*gradient(2), s(n_strain)*gradient(1) + s(2)*gradient(2)]
   end function traction

   !> Add the derivatives of the forces of a point by the end of the step, but for that of the place
   !> where the stress acts: a factor can then be made again without the step before.
   subroutine add_tangent(slot, geometry, at, c, motion, value, side)
      integer, intent(in) :: slot(:)             !! of the element, by columns
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: at                  !! the point: 1 to n_gp
      real(wp), intent(in) :: c(n_strain, n_strain)          !! with the weight of the point
      type(element_motion_t), intent(in) :: motion
      real(dp), intent(inout), contiguous :: value(:), side(:)
      type(point_motion_t) :: point(geometry%n_gp)
      real(wp) :: k(size(geometry%gradient, 1)), by(n_strain, geometry%n_gp), change(n_strain)
      integer :: i, j, a, b, g, n

      do g = 1, geometry%n_gp
         call element_point(geometry, g, motion, point(g))
      end do
      n = 0
      do j = 1, geometry%n_node
         do b = 1, size(k)
            do g = 1, geometry%n_gp
               by(:, g) = strain_by(point(g)%f_end(b, :), geometry%gradient(:, j, g))
            end do
            if (allocated(geometry%mode)) call modes_relax(geometry, by)
            change = matmul(c, by(:, at))
            do i = 1, geometry%n_node
               k = matmul(point(at)%f_mid, traction(change, geometry%gradient(:, i, at)))
               do a = 1, size(k)
                  n = n + 1
                  if (slot(n) > 0) value(slot(n)) = value(slot(n)) + real(k(a), dp)
                  if (slot(n) < 0) side(-slot(n)) = side(-slot(n)) + real(k(a), dp)
               end do
            end do
         end do
      end do
   end subroutine add_tangent

   !> Derivative of the strain by a component of a node's displacement.
   pure function strain_by(f, gradient) result(by)
      real(wp), intent(in) :: f(:)               !! (n_dim) that component of dx/dX
      real(wp), intent(in) :: gradient(:)        !! (n_dim) of the node's function by X [1/L]
      real(wp) :: by(n_strain)

      by = [f(1)*gradient(1), f(2)*gradient(2), f(1)*gradient(2) + f(2)*gradient(1)]
   end function strain_by

   !> The strain increment has its derivative by the end, its forces act at the middle.
   pure logical function is_symmetric(self, motion)
      class(dissipation_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = .not. (motion%evaluation%mass_scale > 0.0_wp .and. (self%square > 0.0_wp .or. &
         any(self%solid%trait%is_corotated)))
   end function is_symmetric

end module emcon_dissipation_plane
