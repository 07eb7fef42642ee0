!> Elements of linear sections as one term: small strains in all steps, a stiffness that stays.
!>
!> The energy is u.K u/2, with K of the laws at rest, so that K at the mean of the ends of a span is
!> its discrete gradient. Displacements count from the first node of an element: flight rounds
!> nothing. Source: docs/theory.md, section 3.
module emcon_linear_term
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_reduction, only : reduction_fold
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_stiff_elements, only : stiff_elements_gather, stiff_elements_init, stiff_elements_t
   use emcon_term, only : response_t, role_internal, term_t
   implicit none
   private
   public :: linear_term_t, linear_term_init

   type, extends(term_t) :: linear_term_t
      type(stiff_elements_t), private :: own
      real(dp), allocatable, private :: value(:)         !! K/2 in the pattern of the matrix
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
   end type linear_term_t

contains

   !> The linear elements of `solid`.
   subroutine linear_term_init(self, solid, n_dim)
      type(linear_term_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0

      self%role = role_internal
      call stiff_elements_init(self%own, solid, n_dim, solid%is_linear)
   end subroutine linear_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(linear_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists

      associate (start => self%own%start)
         call lists_append(lists, start(2:) - start(:size(start) - 1), self%own%freedom)
      end associate
   end subroutine lay_out

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

   !> Forces of a motion, K at the middle of its span, and the energy at its end.
   subroutine respond(self, motion, response, value, side)
      class(linear_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(wp), dimension(size(self%own%stiffness, 1)) :: last, middle, force, pull
      real(wp) :: largest
      integer :: i, j, k, m, n_dim

      if (present(value)) value = value + real(motion%weight, dp)*self%value
      n_dim = size(motion%x, 1)
      associate (total => response%part(self%role))
         do k = 1, size(self%own%element)
            m = n_dim*self%own%n_node(k)
            call stiff_elements_gather(self%own, k, motion%from, last)
            call stiff_elements_gather(self%own, k, motion%by, middle)
            last(:m) = last(:m) + middle(:m)
            middle(:m) = last(:m) - 0.5_wp*middle(:m)
            force(:m) = 0.0_wp
            pull(:m) = 0.0_wp
            do j = 1, m
               force(:m) = force(:m) + self%own%stiffness(:m, j, k)*middle(j)
               pull(:m) = pull(:m) + self%own%stiffness(:m, j, k)*last(j)
            end do
            response%energy(self%own%element(k)) = 0.5_wp*dot_product(last(:m), pull(:m))
            do i = 1, self%own%n_node(k)
               associate (node => self%own%node(i, k), part => force(n_dim*(i - 1) + 1:n_dim*i))
                  total%force(:, node) = total%force(:, node) + part
               end associate
            end do
            if (.not. response%with_sizes) cycle
            largest = maxval(abs(last(:m)))
            do i = 1, self%own%n_node(k)
               largest = max(largest, maxval(motion%computed(:, self%own%node(i, k))))
            end do
            do i = 1, self%own%n_node(k)
               associate (node => self%own%node(i, k), part => force(n_dim*(i - 1) + 1:n_dim*i))
                  total%magnitude(:, node) = total%magnitude(:, node) + abs(part)
                  response%rounding(:, node) = response%rounding(:, node) &
                     + largest*self%own%rounding(i, k)
               end associate
            end do
         end do
      end associate
   end subroutine respond

   !> Add the tangent of a motion times `direction` to `product`.
   subroutine tangent_times(self, motion, direction, product)
      class(linear_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      real(wp), dimension(size(self%own%stiffness, 1)) :: way, force
      integer :: i, j, k, m, n_dim

      n_dim = size(direction, 1)
      do k = 1, size(self%own%element)
         m = n_dim*self%own%n_node(k)
         call stiff_elements_gather(self%own, k, direction, way)
         if (.not. any(abs(way(:m)) > 0.0_wp)) cycle
         force(:m) = 0.0_wp
         do j = 1, m
            force(:m) = force(:m) + 0.5_wp*motion%weight*self%own%stiffness(:m, j, k)*way(j)
         end do
         do i = 1, self%own%n_node(k)
            associate (node => self%own%node(i, k))
               product(:, node) = product(:, node) + force(n_dim*(i - 1) + 1:n_dim*i)
            end associate
         end do
      end do
   end subroutine tangent_times

end module emcon_linear_term
