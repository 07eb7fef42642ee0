!> Elements of linear sections as one term: small strains in all steps, a stiffness that stays.
!>
!> The energy is u.K u/2, with K of the laws at rest, so that K at the mean of the ends of a span is
!> its discrete gradient. Displacements count from the first node of an element: flight rounds
!> nothing. Source: docs/theory.md, section 3.
module emcon_linear_term
   use emcon_csr, only : csr_t
   use emcon_element, only : element_motion_t, element_response_t
   use emcon_element_lists, only : element_lists
   use emcon_host_law, only : host_response_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_reduction, only : reduction_fold
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_element_respond, solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_term, only : response_t, role_internal, term_t
   implicit none
   private
   public :: linear_term_t, linear_term_init

   type, extends(term_t) :: linear_term_t
      integer, allocatable, private :: element(:)        !! (n) those of linear sections
      integer, allocatable, private :: n_node(:)         !! (n)
      integer, allocatable, private :: node(:, :)        !! (n_most, n)
      integer, allocatable, private :: start(:), freedom(:)   !! lists of `element_lists`
      real(wp), allocatable, private :: stiffness(:, :, :)    !! (n_most*n_dim, ., n) [M/T^2]
      real(wp), allocatable, private :: rounding(:, :)   !! (n_most, n) as `stiffness` of solid_t
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
      type(element_motion_t) :: rest
      type(element_response_t) :: part
      type(host_response_t) :: none
      integer :: k, m

      self%role = role_internal
      self%element = pack([(k, k = 1, solid%n_element)], solid%is_linear)
      self%n_node = solid%geometry(self%element)%n_node
      self%node = solid%node(:, self%element)
      self%rounding = solid%stiffness(:, self%element)
      call element_lists(solid, n_dim, self%start, self%freedom, solid%is_linear)
      m = n_dim*size(self%node, 1)
      allocate(self%stiffness(m, m, size(self%element)), source=0.0_wp)
      rest%nlgeom = .false.
      do k = 1, size(self%element)
         m = n_dim*self%n_node(k)
         call solid_element_respond(solid, self%element(k), rest, none, .true., part)
         self%stiffness(:m, :m, k) = 2.0_wp*part%tangent(:m, :m)   ! by the end of no way: half
      end do
   end subroutine linear_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(linear_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists

      call lists_append(lists, self%start(2:) - self%start(:size(self%start) - 1), self%freedom)
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
      do k = 1, size(self%element)
         m = self%start(k + 1) - self%start(k)
         do j = 1, m
            do i = 1, m
               s = s + 1
               half = real(0.5_wp*self%stiffness(i, j, k), dp)
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
      real(wp), dimension(size(self%stiffness, 1)) :: last, middle, force, pull
      real(wp) :: largest
      integer :: i, j, k, m, n_dim

      if (present(value)) value = value + real(motion%weight, dp)*self%value
      n_dim = size(motion%x, 1)
      associate (total => response%part(self%role))
         do k = 1, size(self%element)
            m = n_dim*self%n_node(k)
            call gather(self, k, motion%from, last)
            call gather(self, k, motion%by, middle)
            last(:m) = last(:m) + middle(:m)
            middle(:m) = last(:m) - 0.5_wp*middle(:m)
            force(:m) = 0.0_wp
            pull(:m) = 0.0_wp
            do j = 1, m
               force(:m) = force(:m) + self%stiffness(:m, j, k)*middle(j)
               pull(:m) = pull(:m) + self%stiffness(:m, j, k)*last(j)
            end do
            response%energy(self%element(k)) = 0.5_wp*dot_product(last(:m), pull(:m))
            largest = maxval(abs(last(:m)))
            do i = 1, self%n_node(k)
               largest = max(largest, maxval(motion%computed(:, self%node(i, k))))
            end do
            do i = 1, self%n_node(k)
               associate (node => self%node(i, k), part => force(n_dim*(i - 1) + 1:n_dim*i))
                  total%force(:, node) = total%force(:, node) + part
                  total%magnitude(:, node) = total%magnitude(:, node) + abs(part)
                  response%rounding(:, node) = response%rounding(:, node) &
                     + largest*self%rounding(i, k)
               end associate
            end do
         end do
      end associate
   end subroutine respond

   !> A field on the nodes of element `k` of the list, from that of its first node.
   pure subroutine gather(self, k, field, local)
      class(linear_term_t), intent(in) :: self
      integer, intent(in) :: k                                 !! 1 to n
      real(wp), intent(in), contiguous :: field(:, :)          !! (n_dim, n_node)
      real(wp), intent(inout) :: local(:)                      !! (n_dim*n_most)
      integer :: i, n_dim

      n_dim = size(field, 1)
      do i = 1, self%n_node(k)
         local(n_dim*(i - 1) + 1:n_dim*i) = field(:, self%node(i, k)) - field(:, self%node(1, k))
      end do
   end subroutine gather

   !> Add the tangent of a motion times `direction` to `product`.
   subroutine tangent_times(self, motion, direction, product)
      class(linear_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      real(wp), dimension(size(self%stiffness, 1)) :: way, force
      integer :: i, j, k, m, n_dim

      n_dim = size(direction, 1)
      do k = 1, size(self%element)
         m = n_dim*self%n_node(k)
         call gather(self, k, direction, way)
         if (.not. any(abs(way(:m)) > 0.0_wp)) cycle
         force(:m) = 0.0_wp
         do j = 1, m
            force(:m) = force(:m) + 0.5_wp*motion%weight*self%stiffness(:m, j, k)*way(j)
         end do
         do i = 1, self%n_node(k)
            associate (node => self%node(i, k))
               product(:, node) = product(:, node) + force(n_dim*(i - 1) + 1:n_dim*i)
            end associate
         end do
      end do
   end subroutine tangent_times

end module emcon_linear_term
