!> All elements of a scene but those of small strains as one term: forces and tangents.
!>
!> Source: docs/theory.md, section 3.
module emcon_solid_term
   use emcon_csr, only : csr_t
   use emcon_element, only : element_motion_t, element_response_t
   use emcon_element_lists, only : element_lists
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_host_law, only : host_law_t, host_response_t
   use emcon_kinds, only : dp, wp
   use emcon_law_registry, only : law_linear
   use emcon_motion, only : motion_t
   use emcon_point_function, only : point_failed
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_element_respond, solid_evaluate_given, solid_gather, &
      solid_init, solid_t
   use emcon_shape, only : max_element_nodes
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_term, only : response_t, role_internal, term_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: solid_term_t, solid_term_init

   type, extends(term_t) :: solid_term_t
      type(solid_t) :: solid
      logical :: nlgeom = .true.                 !! .false.: small strains
      logical :: has_linear_laws = .false.       !! all materials of its elements are
      logical, private :: is_empty = .false.     !! no elements are left
      integer, allocatable, private :: slot(:)   !! element matrices by columns
      type(host_response_t), private :: given   !! what given laws answer
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
      procedure :: add_stiffness
      procedure :: is_symmetric
   end type solid_term_t

contains

   !> The elements of `scene`, with the laws that a program gives.
   subroutine solid_term_init(self, scene, error, given)
      type(solid_term_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_law_t), intent(in), optional :: given(:)   !! one for each such material
      logical :: is_here(size(scene%material))

      self%role = role_internal
      call solid_init(self%solid, scene, error, given)
      is_here = .true.
      if (any(self%solid%is_small)) then
         is_here = .false.
         is_here(pack(self%solid%law_of, .not. self%solid%is_small)) = .true.
      end if
      self%has_linear_laws = all(scene%material%law == 0 .or. scene%material%law == law_linear &
         .or. .not. is_here)
      self%is_empty = all(self%solid%is_small) .and. self%solid%n_element > 0
   end subroutine solid_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(solid_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer, allocatable :: start(:), freedom(:)

      call element_lists(self%solid, lists%n_dim, start, freedom, .not. self%solid%is_small)
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

      self%nlgeom = scene%step(i_step)%nlgeom
      self%slot = slot
   end subroutine begin_step

   !> Forces of a motion. What displacements are rounded by, forces are too.
   subroutine respond(self, motion, response, value, side)
      class(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      type(element_response_t) :: part
      type(element_motion_t) :: local
      real(wp) :: largest
      integer :: e, i, n, node, first

      if (self%solid%has_given) then
         call solid_evaluate_given(self%solid, motion%from, motion%by, self%nlgeom, &
            present(value), self%given)
         if (self%given%inverted_element > 0) call refuse(self, self%given%inverted_element, &
            response)
         if (self%given%inverted_element > 0) return
      end if
      local%nlgeom = self%nlgeom
      first = 1
      associate (solid => self%solid, total => response%part(self%role))
         do e = 1, solid%n_element
            if (solid%is_small(e)) cycle
            n = solid%geometry(e)%n_node
            if (solid%is_rigid(e)) then
               first = first + 4*n*n
               cycle
            end if
            call solid_gather(solid%node(:n, e), motion%from, motion%by, local)
            call solid_element_respond(solid, e, local, self%given, present(value), part)
            if (part%is_inverted) then
               call refuse(self, e, response)
               return
            end if
            response%energy(e) = part%energy
            largest = maxval(abs(local%from(:, :n) + local%by(:, :n)))
            do i = 1, n
               largest = max(largest, maxval(motion%computed(:, solid%node(i, e))))
            end do
            do i = 1, n
               node = solid%node(i, e)
               total%force(:, node) = total%force(:, node) + part%force(:, i)
               total%magnitude(:, node) = total%magnitude(:, node) + part%magnitude(:, i)
               response%rounding(:, node) = response%rounding(:, node) &
                  + largest*solid%stiffness(i, e)
            end do
            if (present(value)) then
               call scatter(2*n, part%tangent, motion%weight, self%slot(first:), value, side)
               first = first + 4*n*n
            end if
         end do
      end associate
   end subroutine respond

   !> Why there is no response: element `e` is inverted, or a given law does not answer.
   subroutine refuse(self, e, response)
      type(solid_term_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element
      type(response_t), intent(inout) :: response

      if (self%given%material == 0) then
         response%refusal = "element " // to_text(self%solid%label(e)) // " is inverted"
         return
      end if
      response%refusal = "the law given for material " // &
         self%solid%material(self%given%material)%text
      if (self%given%status == point_failed) then
         response%refusal = response%refusal // " has failed"
         call raise(response%failure, err_analysis, response%refusal)
      else
         response%refusal = response%refusal // " has no finite value at a strain that is met"
      end if
   end subroutine refuse

   !> Add a square element matrix of `n` unknowns to its places; `slot` runs down the columns.
   pure subroutine scatter(n, tangent, factor, slot, value, side)
      integer, intent(in) :: n
      real(wp), intent(in) :: tangent(2*max_element_nodes, 2*max_element_nodes), factor
      integer, intent(in) :: slot(:)
      real(dp), intent(inout) :: value(:), side(:)
      integer :: i, j, k

      do j = 1, n
         do i = 1, n
            k = slot(i + n*(j - 1))
            if (k > 0) then
               value(k) = value(k) + real(factor*tangent(i, j), dp)
            else if (k < 0) then
               side(-k) = side(-k) + real(factor*tangent(i, j), dp)
            end if
         end do
      end do
   end subroutine scatter

   !> Add the tangent of a motion times `direction` to `product`. Elements that `direction` does not
   !> touch are passed over.
   subroutine tangent_times(self, motion, direction, product)
      class(solid_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (2, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (2, n_node) [M L/T^2]
      type(element_response_t) :: part
      type(element_motion_t) :: local
      real(wp) :: image(2*max_element_nodes)
      integer :: e, i, n, node

      if (self%solid%has_given) then
         call solid_evaluate_given(self%solid, motion%from, motion%by, self%nlgeom, .true., &
            self%given)
         if (self%given%inverted_element > 0) return
      end if
      local%nlgeom = self%nlgeom
      associate (solid => self%solid)
         do e = 1, solid%n_element
            n = solid%geometry(e)%n_node
            if (solid%is_small(e)) cycle
            if (solid%is_rigid(e)) cycle
            if (.not. any(abs(direction(:, solid%node(:n, e))) > 0.0_wp)) cycle
            call solid_gather(solid%node(:n, e), motion%from, motion%by, local)
            call solid_element_respond(solid, e, local, self%given, .true., part)
            if (part%is_inverted) return
            image = 0.0_wp
            do i = 1, n
               node = solid%node(i, e)
               image(:2*n) = image(:2*n) + part%tangent(:2*n, 2*i - 1)*direction(1, node) &
                  + part%tangent(:2*n, 2*i)*direction(2, node)
            end do
            do i = 1, n
               node = solid%node(i, e)
               product(:, node) = product(:, node) + motion%weight*image(2*i - 1:2*i)
            end do
         end do
      end associate
   end subroutine tangent_times

   !> As `term_t` has it.
   pure subroutine add_stiffness(self, stiffness)
      class(solid_term_t), intent(in) :: self
      real(wp), intent(inout) :: stiffness(:)    !! (n_node) [M/T^2]
      integer :: e, i

      do e = 1, self%solid%n_element
         do i = 1, self%solid%geometry(e)%n_node
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

      is_symmetric = motion%pose%is_gradient .or. self%is_empty &
         .or. (self%has_linear_laws .and. .not. self%nlgeom)
   end function is_symmetric

end module emcon_solid_term
