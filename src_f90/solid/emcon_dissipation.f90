! build: elements
!> Forces of elements that take energy: against strain increments that change from step to step,
!> chi/2 C (dE - dE_before), where the scheme asks for it; of damped materials against the rate of
!> strain, beta C dE/h, and against velocity, alpha M du/h. C are the moduli at rest.
!>
!> Source: docs/theory.md, eqs. (4e) to (4g), (11a) and (11b).
module emcon_dissipation
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_element_lists, only : element_lists
   use emcon_incompatible_modes, only : modes_relax
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_geometry, solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_steps, only : step_square
   use emcon_strain_rows, only : moduli_find, moduli_t, strain_count, strain_rows, &
      strain_rows_relax, strain_change, stress_of
   use emcon_term, only : response_t, role_internal, term_t
   implicit none
   private
   public :: dissipation_term_t, dissipation_term_init

   type, extends(term_t) :: dissipation_term_t
      type(solid_t), private :: solid
      logical, allocatable, private :: is_damped(:)      !! (n_element) it may take energy
      logical, allocatable, private :: deforms(:)        !! (n_element) and has moduli
      real(wp), allocatable, private :: alpha(:)         !! (n_element) of its material [1/T]
      real(wp), allocatable, private :: beta(:)          !! (n_element) of its material [T]
      type(moduli_t), allocatable, private :: lame(:)    !! (n_element) at rest
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
      integer :: e

      self%role = role_internal
      self%solid = solid
      allocate(self%lame(solid%n_element))
      allocate(self%deforms(solid%n_element), source=.false.)
      do e = 1, solid%n_element
         associate (k => solid%law_of(e))
            if (solid%trait%is_rigid(e) .or. .not. allocated(solid%law(k)%law)) cycle
            self%deforms(e) = .true.
            if (solid%trait%has_mean(e) .and. allocated(solid%rest(k)%law)) then
               call moduli_find(solid%rest(k)%law, self%lame(e))
            else
               call moduli_find(solid%law(k)%law, self%lame(e))
            end if
         end associate
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
         first = first + (size(motion%du, 1)*self%solid%trait%n_node(e))**2
      end do
   end subroutine respond

   !> Displacements of the nodes of an element, less that of the first one along the directions in
   !> which the whole may move without strain.
   pure function gather(self, e, field) result(local)
      type(dissipation_term_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp), intent(in) :: field(:, :)        !! (n_dim, n_node of the scene) [L]
      real(wp) :: local(size(field, 1), self%solid%trait%n_node(e))
      integer :: first, i

      first = 1 + count([self%solid%is_of_rings])  ! a ring is no ring elsewhere
      do i = 1, size(local, 2)
         local(:, i) = field(:, self%solid%node(i, e))
         local(first:, i) = local(first:, i) - field(first:, self%solid%node(1, e))
      end do
   end function gather

   !> Add the forces of element `e`, and their derivatives to the places from `first` on.
   pure subroutine add_element(self, e, first, motion, response, value, side)
      type(dissipation_term_t), intent(inout) :: self
      integer, intent(in) :: e, first
      type(motion_t), intent(in) :: motion
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)
      real(wp), dimension(size(motion%du, 1), self%solid%trait%n_node(e)) :: from, by, before
      real(wp) :: force(size(by))
      real(wp), dimension(strain_count(self%solid%is_of_rings, size(motion%du, 1)), &
         self%solid%trait%n_point(e)) :: strain, last, stress
      real(wp), dimension(size(strain, 1), size(by), size(strain, 2)) :: middle
      type(element_geometry_t) :: geometry
      real(wp) :: square
      integer :: i

      if (.not. (motion%evaluation%dissipation > 0.0_wp .or. self%beta(e) > 0.0_wp)) return
      square = self%solid%trait%square_of(e, self%square)
      call solid_geometry(self%solid, e, geometry)
      from = gather(self, e, motion%u0)
      by = gather(self, e, motion%du)
      last = 0.0_wp
      if (allocated(motion%du_before) .and. motion%evaluation%dissipation > 0.0_wp) then
         before = gather(self, e, motion%du_before)
         call find_increment(geometry, from - before, before, square, last)
      end if
      call find_increment(geometry, from, by, square, strain)
      call strain_rows(geometry, from + 0.5_wp*by, square, middle)
      call find_stress(self, e, geometry%weight, motion, strain, last, stress)
      call sum_up(stress, middle, force)
      associate (total => response%part(self%role))
         do i = 1, size(by, 2)
            associate (node => self%solid%node(i, e), &
                  own => force((i - 1)*size(by, 1) + 1:i*size(by, 1)))
               total%force(:, node) = total%force(:, node) + own
               if (response%with_sizes) total%magnitude(:, node) = total%magnitude(:, node) &
                  + abs(own)
            end associate
         end do
      end associate
      if (present(value)) call add_tangent(self, e, motion, middle, &
         self%slot(first + 1:), value, side)
   end subroutine add_element

   !> Stresses by the scheme and by the material, with the weights of the points, and what they take
   !> over the strain increments.
   pure subroutine find_stress(self, e, weight, motion, strain, last, stress)
      type(dissipation_term_t), intent(inout) :: self
      integer, intent(in) :: e
      real(wp), intent(in) :: weight(:)                      !! (n_gp) of the element [L^3]
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: strain(:, :), last(:, :)       !! (n_strain, n_gp)
      real(wp), intent(out) :: stress(:, :)                  !! (n_strain, n_gp) [M L^2/T^2]
      real(wp), dimension(size(strain, 1)) :: numerical, viscous
      integer :: g, n_dim

      n_dim = size(motion%du, 1)
      associate (evaluation => motion%evaluation)
         do g = 1, size(strain, 2)
            call stress_of(self%lame(e), n_dim, 0.5_wp*evaluation%dissipation*weight(g), &
               strain(:, g) - evaluation%recalled*last(:, g), numerical)
            call stress_of(self%lame(e), n_dim, self%beta(e)*evaluation%mass_scale*weight(g), &
               strain(:, g), viscous)
            self%work = self%work + dot_product(numerical, strain(:, g))
            self%damping = self%damping + dot_product(viscous, strain(:, g))
            stress(:, g) = numerical + viscous
         end do
      end associate
   end subroutine find_stress

   !> Forces of stresses at the points.
   pure subroutine sum_up(stress, row, force)
      real(wp), intent(in), contiguous :: stress(:, :)       !! (n_strain, n_gp)
      real(wp), intent(in), contiguous :: row(:, :, :)       !! (n_strain, n_dim*n, n_gp)
      real(wp), intent(out), contiguous :: force(:)          !! (n_dim*n)
      integer :: g, j, k

      force = 0.0_wp
      do g = 1, size(stress, 2)
         do j = 1, size(force)
            do k = 1, size(stress, 1)
               force(j) = force(j) + stress(k, g)*row(k, j, g)
            end do
         end do
      end do
   end subroutine sum_up

   !> Increments of the strains at the points. Incompatible modes are taken out, by the same moduli
   !> that make stress of them here: such a stress has no part to be returned.
   pure subroutine find_increment(geometry, from, by, square, strain)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in), contiguous :: from(:, :), by(:, :)         !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains
      real(wp), intent(out), contiguous :: strain(:, :)      !! (n_strain, n_gp)

      call strain_change(geometry, from + 0.5_wp*by, by, square, strain)
      if (allocated(geometry%mode)) call modes_relax(geometry, strain)
   end subroutine find_increment

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
      associate (node => self%solid%node(:, e), n => self%solid%trait%n_node(e), &
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

   !> Add the derivatives of the forces of an element by the end of the step, but for that of the
   !> place where the stress acts: a factor can then be made again without the step before.
   pure subroutine add_tangent(self, e, motion, middle, slot, value, side)
      type(dissipation_term_t), intent(in) :: self
      integer, intent(in) :: e
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous :: middle(:, :, :)    !! (n_strain, n_dim*n, n_gp)
      integer, intent(in) :: slot(:)             !! of the element, by columns
      real(dp), intent(inout), contiguous :: value(:), side(:)
      real(wp) :: at_end(size(motion%du, 1), self%solid%trait%n_node(e)), &
         last(size(middle, 1), size(middle, 2), size(middle, 3)), column(size(middle, 2)), &
         change(size(middle, 1), size(middle, 3)), part
      type(element_geometry_t) :: geometry
      integer :: g, i, j, n

      at_end = gather(self, e, motion%u0) + gather(self, e, motion%du)
      call solid_geometry(self%solid, e, geometry)
      associate (evaluation => motion%evaluation, &
            square => self%solid%trait%square_of(e, self%square))
         part = 0.5_wp*evaluation%dissipation + self%beta(e)*evaluation%mass_scale
         call strain_rows(geometry, at_end, square, last)
         if (allocated(geometry%mode)) call strain_rows_relax(geometry, last)
         n = 0
         do j = 1, size(last, 2)
            do g = 1, geometry%n_gp
               call stress_of(self%lame(e), size(at_end, 1), part*geometry%weight(g), &
                  last(:, j, g), change(:, g))
            end do
            call sum_up(change, middle, column)
            do i = 1, size(column)
               n = n + 1
               if (slot(n) > 0) value(slot(n)) = value(slot(n)) + real(column(i), dp)
               if (slot(n) < 0) side(-slot(n)) = side(-slot(n)) + real(column(i), dp)
            end do
         end do
      end associate
   end subroutine add_tangent

   !> The strain increment has its derivative by the end, its forces act at the middle.
   pure logical function is_symmetric(self, motion)
      class(dissipation_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      is_symmetric = .not. (motion%evaluation%mass_scale > 0.0_wp .and. (self%square > 0.0_wp .or. &
         any(self%solid%trait%is_corotated)))
   end function is_symmetric

end module emcon_dissipation
