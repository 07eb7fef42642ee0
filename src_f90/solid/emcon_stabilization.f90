!> Viscous forces of *STATIC, STABILIZE: a stress against the rate of strain, by the moduli at rest,
!> and a drag on velocities, by the volume at nodes, which holds what moves without strain too.
!>
!> In the time of a static step they are a small part of the forces, but where the motion has no
!> equilibrium to follow: there they hold what is on its way to the next one. They are derivatives,
!> by the end, of a potential of the increment, docs/theory.md, eq. (11l).
module emcon_stabilization
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_element_lists, only : element_lists
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_incompatible_modes, only : modes_relax
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_geometry, solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_steps, only : step_square
   use emcon_strain_rows, only : moduli_find, moduli_t, n_shear, shear_one, shear_other, &
      strain_count, strain_rows, strain_rows_relax, strain_change, stress_of
   use emcon_term, only : response_t, role_internal, term_t
   implicit none
   private
   public :: stabilization_term_t, stabilization_term_init, stabilization_force

   type, extends(term_t) :: stabilization_term_t
      type(solid_t), private :: solid
      logical, allocatable, private :: acts(:)           !! (n_element)
      type(moduli_t), allocatable, private :: lame(:)    !! (n_element) at rest
      real(wp), private :: square = 1.0_wp               !! part of squares in strains
      real(wp), private :: lapse = 0.0_wp                !! of the stress, in this step; 0: none [T]
      integer, allocatable, private :: slot(:)           !! element matrices by columns
      real(wp), allocatable, private :: force(:, :)      !! (n_dim, n_node) of the last motion
      real(wp) :: work = 0.0_wp                  !! that it has taken [M L^2/T^2]
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
   end type stabilization_term_t

   !> An element over an increment.
   type :: element_part_t
      real(wp), allocatable :: force(:)          !! (n_dim*n) node by node [M L/T^2]
      real(wp), allocatable :: tangent(:, :)     !! (n_dim*n, n_dim*n) [M/T^2]
      real(wp) :: work = 0.0_wp
   end type element_part_t

contains

   !> The elements of `solid` that deform.
   subroutine stabilization_term_init(self, solid)
      type(stabilization_term_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer :: e

      self%solid = solid
      allocate(self%lame(solid%n_element))
      allocate(self%force(solid%n_dim, solid%n_node), source=0.0_wp)
      do e = 1, solid%n_element
         if (solid%trait%is_rigid(e)) cycle
         associate (k => solid%law_of(e))
            if (solid%trait%has_mean(e) .and. allocated(solid%rest(k)%law)) then
               call moduli_find(solid%rest(k)%law, self%lame(e))
            else if (allocated(solid%law(k)%law)) then
               call moduli_find(solid%law(k)%law, self%lame(e))
            else
               self%lame(e)%lambda = given_modulus(solid, e)/3.0_wp
               self%lame(e)%mu = self%lame(e)%lambda
            end if
         end associate
      end do
      self%acts = self%lame%mu > 0.0_wp
   end subroutine stabilization_term_init

   !> The modulus of a law that a program gives: that of the stiffness of its element. It stands for
   !> lambda + 2 mu.
   pure real(wp) function given_modulus(solid, e) result(modulus)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      type(element_geometry_t) :: geometry
      real(wp) :: spread
      integer :: g

      spread = 0.0_wp
      call solid_geometry(solid, e, geometry)
      do g = 1, geometry%n_gp
         spread = spread + geometry%weight(g)*sum(abs(geometry%gradient(:, :, g))) &
            *sum(abs(geometry%gradient(:, 1, g)))
      end do
      modulus = 2.0_wp*solid%stiffness(1, e)/spread    ! by the end of no step
   end function given_modulus

   !> The forces of the last motion.
   pure subroutine stabilization_force(self, force)
      type(stabilization_term_t), intent(in) :: self
      real(wp), intent(out) :: force(:, :)       !! (n_dim, n_node) [M L/T^2]

      force = self%force
   end subroutine stabilization_force

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(stabilization_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer, allocatable :: start(:), freedom(:)

      call element_lists(self%solid, lists%n_dim, start, freedom, self%acts)
      call lists_append(lists, start(2:) - start(:size(start) - 1), freedom)
   end subroutine lay_out

   !> As `term_t` has it. A body that strains in proportion to time, from rest, stores W in the
   !> first increment h; a stress of the rate by half of f h takes f W from it.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(stabilization_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! element matrices by columns

      associate (step => scene%step(i_step))
         self%square = step_square(step)
         self%lapse = 0.5_wp*step%stabilization*step%time%h
      end associate
      self%slot = slot
   end subroutine begin_step

   !> Forces over a motion in statics; none else.
   subroutine respond(self, motion, response, value, side)
      class(stabilization_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      type(element_part_t) :: part
      type(element_geometry_t) :: geometry
      real(wp) :: drag
      integer :: e, first, i, m

      self%work = 0.0_wp
      self%force = 0.0_wp
      if (.not. is_on(self, motion)) return
      drag = drag_of(self, motion%u0)
      first = 0
      associate (total => response%part(self%role))
         do e = 1, self%solid%n_element
            if (.not. self%acts(e)) cycle
            associate (node => self%solid%node(:self%solid%trait%n_node(e), e))
               call solid_geometry(self%solid, e, geometry)
               call find_part(self, e, geometry, motion, present(value), part)
               call add_drag(geometry, drag/motion%evaluation%lapse, &
                  motion%du(:, node), present(value), part)
               m = size(motion%du, 1)
               do i = 1, size(node)
                  associate (f => part%force(m*(i - 1) + 1:m*i))
                     self%force(:, node(i)) = self%force(:, node(i)) + f
                     if (response%with_sizes) total%magnitude(:, node(i)) &
                        = total%magnitude(:, node(i)) + abs(f)
                  end associate
               end do
               self%work = self%work + part%work
               m = (m*size(node))**2
               if (present(value)) call add_tangent(self%slot(first + 1:first + m), part%tangent, &
                  value, side)
               first = first + m
            end associate
         end do
         total%force = total%force + self%force
      end associate
   end subroutine respond

   !> Add the entries of the tangent of an element to their places.
   pure subroutine add_tangent(slot, tangent, value, side)
      integer, intent(in) :: slot(:)             !! of the element, by columns
      real(wp), intent(in) :: tangent(:, :)
      real(dp), intent(inout), contiguous :: value(:), side(:)
      integer :: i, j, n

      n = 0
      do j = 1, size(tangent, 2)
         do i = 1, size(tangent, 1)
            n = n + 1
            if (slot(n) > 0) value(slot(n)) = value(slot(n)) + real(tangent(i, j), dp)
            if (slot(n) < 0) side(-slot(n)) = side(-slot(n)) + real(tangent(i, j), dp)
         end do
      end do
   end subroutine add_tangent

   !> As `term_t` has it.
   subroutine tangent_times(self, motion, direction, product)
      class(stabilization_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      type(element_part_t) :: part
      type(element_geometry_t) :: geometry
      real(wp) :: drag
      integer :: e

      if (.not. is_on(self, motion)) return
      drag = drag_of(self, motion%u0)
      do e = 1, self%solid%n_element
         if (.not. self%acts(e)) cycle
         associate (node => self%solid%node(:self%solid%trait%n_node(e), e))
            call solid_geometry(self%solid, e, geometry)
            call find_part(self, e, geometry, motion, .true., part)
            call add_drag(geometry, drag/motion%evaluation%lapse, &
               motion%du(:, node), .true., part)
            product(:, node) = product(:, node) + reshape(matmul(part%tangent, &
               reshape(direction(:, node), [size(part%force)])), [size(direction, 1), size(node)])
         end associate
      end do
   end subroutine tangent_times

   !> Is there any in this step, and over this motion?
   pure logical function is_on(self, motion)
      type(stabilization_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion

      is_on = self%lapse > 0.0_wp .and. evaluation_is_equilibrium(motion%evaluation) &
         .and. motion%evaluation%lapse > 0.0_wp
   end function is_on

   !> The drag per volume. Displacements `u` that grow in proportion to time, and store W by the
   !> moduli at rest, lose the same part of what they store to it as to the stress.
   pure real(wp) function drag_of(self, u) result(drag)
      type(stabilization_term_t), intent(in) :: self
      real(wp), intent(in), contiguous :: u(:, :)          !! (n_dim, n_node) [L]
      type(element_geometry_t) :: geometry
      real(wp), allocatable :: strain(:, :), stress(:)
      real(wp) :: stored, moved                  ! 2 W, and the square of u over the volume
      integer :: e, g

      stored = 0.0_wp
      moved = 0.0_wp
      do e = 1, self%solid%n_element
         if (.not. self%acts(e)) cycle
         call solid_geometry(self%solid, e, geometry)
         associate (node => self%solid%node(:geometry%n_node, e))
            call find_strain(self, e, geometry, 0.0_wp*u(:, node), u(:, node), strain)
            do g = 1, geometry%n_gp
               stress = strain(:, g)
               call stress_of(self%lame(e), size(u, 1), 1.0_wp, strain(:, g), stress)
               stored = stored + geometry%weight(g)*dot_product(strain(:, g), stress)
            end do
            moved = moved + sum(geometry%weight)/size(node)*sum(u(:, node)**2)
         end associate
      end do
      drag = 0.0_wp
      if (moved > 0.0_wp) drag = self%lapse*(stored/moved)
   end function drag_of

   !> Add the drag on the nodes of an element.
   pure subroutine add_drag(geometry, rate, by, with_tangent, part)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in) :: rate               !! drag per volume and time [M/(L T)^2 /L]
      real(wp), intent(in) :: by(:, :)           !! (n_dim, n_node) [L]
      logical, intent(in) :: with_tangent
      type(element_part_t), intent(inout) :: part
      real(wp) :: own
      integer :: i

      own = rate*sum(geometry%weight)/size(by, 2)
      part%force = part%force + own*reshape(by, [size(by)])
      part%work = part%work + own*sum(by**2)
      if (.not. with_tangent) return
      do i = 1, size(by)
         part%tangent(i, i) = part%tangent(i, i) + own
      end do
   end subroutine add_drag

   !> Strains of element `e` at its points over the way `by` from the displacements `from`; what
   !> incompatible modes take is left out.
   pure subroutine find_strain(self, e, geometry, from, by, strain)
      type(stabilization_term_t), intent(in) :: self
      integer, intent(in) :: e
      type(element_geometry_t), intent(in) :: geometry     !! of the element
      real(wp), intent(in), contiguous :: from(:, :)       !! (n_dim, n_node of the element) [L]
      real(wp), intent(in), contiguous :: by(:, :)         !! as `from` [L]
      real(wp), allocatable, intent(out) :: strain(:, :)   !! (n_strain, n_gp) as of `strain_rows`

      associate (n => strain_count(self%solid%is_of_rings, size(by, 1)), &
            square => self%solid%trait%square_of(e, self%square))
         allocate(strain(n, geometry%n_gp))
         call strain_change(geometry, from + 0.5_wp*by, by, square, strain)
         if (allocated(geometry%mode)) call modes_relax(geometry, strain)
      end associate
   end subroutine find_strain

   !> Force and tangent of element `e`: derivatives by the end of 1/2 (lapse/h) int dE.C dE.
   pure subroutine find_part(self, e, geometry, motion, with_tangent, part)
      type(stabilization_term_t), intent(in) :: self
      integer, intent(in) :: e
      type(element_geometry_t), intent(in) :: geometry     !! of the element
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else the tangent is not made
      type(element_part_t), intent(inout) :: part
      real(wp), allocatable :: from(:, :), by(:, :), strain(:, :), last(:, :, :), stress(:)
      real(wp) :: factor
      integer :: g

      associate (n => size(motion%du, 1)*geometry%n_node, &
            node => self%solid%node(:geometry%n_node, e), &
            square => self%solid%trait%square_of(e, self%square))
         allocate(from, source=motion%u0(:, node))
         allocate(by, source=motion%du(:, node))
         call find_strain(self, e, geometry, from, by, strain)
         allocate(last(size(strain, 1), n, geometry%n_gp), stress(size(strain, 1)))
         call strain_rows(geometry, from + by, square, last)
         part%force = spread(0.0_wp, 1, n)
         part%work = 0.0_wp
         if (with_tangent) part%tangent = spread(part%force, 2, n)
         do g = 1, geometry%n_gp
            factor = (self%lapse/motion%evaluation%lapse)*geometry%weight(g)
            call stress_of(self%lame(e), size(by, 1), factor, strain(:, g), stress)
            part%work = part%work + dot_product(stress, strain(:, g))
            part%force = part%force + matmul(stress, last(:, :, g))
            if (with_tangent) call add_geometric(geometry, g, square*stress, part%tangent)
         end do
         if (.not. with_tangent) return
         if (allocated(geometry%mode)) call strain_rows_relax(geometry, last)
         do g = 1, geometry%n_gp
            factor = (self%lapse/motion%evaluation%lapse)*geometry%weight(g)
            call add_material(self%lame(e), size(by, 1), factor, last(:, :, g), part%tangent)
         end do
      end associate
   end subroutine find_part

   !> Add the part of the tangent that the change of stress makes.
   pure subroutine add_material(lame, n_dim, factor, row, tangent)
      type(moduli_t), intent(in) :: lame
      integer, intent(in) :: n_dim
      real(wp), intent(in) :: factor             !! [L^3]
      real(wp), intent(in), contiguous :: row(:, :)          !! (n_strain, n_dim*n)
      real(wp), intent(inout) :: tangent(:, :)
      real(wp) :: stress(size(row, 1))
      integer :: j

      do j = 1, size(row, 2)
         call stress_of(lame, n_dim, factor, row(:, j), stress)
         tangent(:, j) = tangent(:, j) + matmul(stress, row)
      end do
   end subroutine add_material

   !> Add the part that the change of the place makes, where the stress acts.
   pure subroutine add_geometric(geometry, g, stress, tangent)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: g
      real(wp), intent(in) :: stress(:)          !! with the weight of the point [M L^2/T^2]
      real(wp), intent(inout) :: tangent(:, :)
      real(wp) :: s(size(geometry%gradient, 1), size(geometry%gradient, 1)), part
      integer :: a, i, j, k, n_dim

      n_dim = size(s, 1)
      s = 0.0_wp
      do a = 1, n_dim
         s(a, a) = stress(a)
      end do
      do k = 1, n_shear(n_dim)
         s(shear_one(k), shear_other(k)) = stress(n_dim + k)
         s(shear_other(k), shear_one(k)) = stress(n_dim + k)
      end do
      do j = 1, geometry%n_node
         do i = 1, geometry%n_node
            part = dot_product(geometry%gradient(:, i, g), matmul(s, geometry%gradient(:, j, g)))
            do a = 1, n_dim
               associate (to => tangent(n_dim*(i - 1) + a, n_dim*(j - 1) + a))
                  to = to + part
               end associate
            end do
            if (.not. allocated(geometry%circle)) cycle
            associate (to => tangent(n_dim*(i - 1) + 1, n_dim*(j - 1) + 1))
               to = to + stress(size(stress))*geometry%circle(i, g)*geometry%circle(j, g)
            end associate
         end do
      end do
   end subroutine add_geometric

end module emcon_stabilization
