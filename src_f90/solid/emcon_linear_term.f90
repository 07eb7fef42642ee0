!> Elements of linear sections as one term: small strains in all steps, a stiffness that stays.
!>
!> The energy is u.K u/2, with K of the laws at rest, so that K at the mean of the ends of a span is
!> its discrete gradient: one product with the assembled K. Source: docs/theory.md, section 3.
module emcon_linear_term
   use emcon_csr, only : csr_t
   use emcon_element_lists, only : element_lists
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_reduction, only : reduction_fold
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_space, only : space_t
   use emcon_stiff_elements, only : stiff_elements_gather, stiff_term_init, stiff_term_t
   use emcon_stiff_product, only : stiff_product_find_sizes, stiff_product_form, &
      stiff_product_init, stiff_product_load, stiff_product_t
   use emcon_term, only : response_t
   implicit none
   private
   public :: linear_term_t, linear_term_init

   type, extends(stiff_term_t) :: linear_term_t
      type(stiff_product_t), private :: product
      real(wp), allocatable, private :: rounding(:)      !! (n_node) as `stiffness` of solid_t
      real(dp), allocatable, private :: value(:)         !! K/2 in the pattern of the matrix
   contains
      procedure :: begin_step
      procedure :: respond
      procedure :: find_energy
      procedure :: tangent_times
   end type linear_term_t

contains

   !> The linear elements of `solid`.
   subroutine linear_term_init(self, solid, n_dim, error)
      type(linear_term_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: start(:), node(:)
      integer :: i, k

      call stiff_term_init(self, solid, n_dim, solid%trait%is_linear)
      call element_lists(solid, 1, start, node, solid%trait%is_linear)
      call stiff_product_init(self%product, n_dim, solid%n_node, start, node, self%own%stiffness, &
         error)
      allocate(self%rounding(solid%n_node), source=0.0_wp)
      do k = 1, size(self%own%element)
         do i = 1, self%own%n_node(k)
            associate (to => self%rounding(self%own%node(i, k)))
               to = to + self%own%rounding(i, k)
            end associate
         end do
      end do
   end subroutine linear_term_init

   !> Put half of the stiffness into the pattern of the matrix.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(linear_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! element matrices by columns
      real(dp) :: side(size(space%reduction%side%value)), half
      integer :: i, j, k, s, m

      if (allocated(self%value)) deallocate(self%value)
      allocate(self%value(size(matrix%column)), source=0.0_dp)
      side = 0.0_dp
      s = 0
      do k = 1, size(self%own%element)
         m = self%own%start(k + 1) - self%own%start(k)
         do j = 1, m
            do i = 1, m
               s = s + 1
               half = real(0.5_wp*self%own%stiffness(i, j, k), dp)
               if (slot(s) > 0) self%value(slot(s)) = self%value(slot(s)) + half
               if (slot(s) < 0) side(-slot(s)) = side(-slot(s)) + half
            end do
         end do
      end do
      call reduction_fold(space%reduction, matrix, self%value, side)
   end subroutine begin_step

   !> Forces of a motion, K at the middle of its span.
   subroutine respond(self, motion, response, value, side)
      class(linear_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: a, i

      if (present(value)) value = value + real(motion%weight, dp)*self%value
      call stiff_product_load(self%product, motion%from, motion%by)
      call stiff_product_form(self%product)
      associate (total => response%part(self%role), product => self%product)
         do i = 1, product%n
            associate (node => product%node(i))
               do a = 1, size(motion%x, 1)
                  total%force(a, node) = total%force(a, node) + product%force(i, a)
               end do
            end associate
         end do
         if (.not. response%with_sizes) return
         call stiff_product_find_sizes(product, motion%computed)
         do i = 1, product%n
            associate (node => product%node(i))
               total%magnitude(:, node) = total%magnitude(:, node) + product%magnitude(i, :)
               response%rounding(:, node) = response%rounding(:, node) &
                  + product%largest(i)*self%rounding(node)
            end associate
         end do
      end associate
   end subroutine respond

   !> Energies at the end of a motion.
   pure subroutine find_energy(self, motion, energy)
      class(linear_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed
      real(wp), intent(inout) :: energy(:)       !! (n_element) [M L^2/T^2]
      real(wp), dimension(size(self%own%stiffness, 1)) :: last, change, pull
      integer :: j, k, m

      do k = 1, size(self%own%element)
         m = size(motion%x, 1)*self%own%n_node(k)
         call stiff_elements_gather(self%own, k, motion%from, last)
         call stiff_elements_gather(self%own, k, motion%by, change)
         last(:m) = last(:m) + change(:m)
         pull(:m) = 0.0_wp
         do j = 1, m
            pull(:m) = pull(:m) + self%own%stiffness(:m, j, k)*last(j)
         end do
         energy(self%own%element(k)) = 0.5_wp*dot_product(last(:m), pull(:m))
      end do
   end subroutine find_energy

   !> Add the tangent of a motion times `direction` to `product`.
   subroutine tangent_times(self, motion, direction, product)
      class(linear_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      integer :: i

      call stiff_product_load(self%product, direction)
      call stiff_product_form(self%product)
      do i = 1, self%product%n
         associate (node => self%product%node(i))
            product(:, node) = product(:, node) + 0.5_wp*motion%weight*self%product%force(i, :)
         end associate
      end do
   end subroutine tangent_times

end module emcon_linear_term
