!> Terms of elements whose stiffness stays: which elements, and the stiffness of their laws at rest.
module emcon_stiff_elements
   use emcon_element_frequency, only : element_frequency
   use emcon_element_lists, only : element_lists
   use emcon_element_plane, only : element_motion_t, element_response_t
   use emcon_host_law, only : host_response_t
   use emcon_kinds, only : wp
   use emcon_lumped_mass, only : lumped_mass
   use emcon_motion, only : motion_t
   use emcon_single_elements, only : single_rest_tangent
   use emcon_solid, only : solid_t
   use emcon_solid_respond, only : solid_element_respond
   use emcon_space, only : lists_append, lists_t
   use emcon_term, only : fastest_t, role_internal, term_t
   implicit none
   private
   public :: stiff_elements_t, stiff_elements_gather, stiff_term_t, stiff_term_init

   type :: stiff_elements_t
      integer, allocatable :: element(:)         !! (n) their numbers
      integer, allocatable :: n_node(:)          !! (n)
      integer, allocatable :: node(:, :)         !! (n_most, n)
      integer, allocatable :: start(:), freedom(:)   !! lists of `element_lists`
      real(wp), allocatable :: stiffness(:, :, :)    !! (n_most*n_dim, ., n) [M/T^2]
      real(wp), allocatable :: rounding(:, :)    !! (n_most, n) as `stiffness` of solid_t
   end type stiff_elements_t

   type, abstract, extends(term_t) :: stiff_term_t
      type(stiff_elements_t) :: own
      type(fastest_t), private :: fastest        !! of them
   contains
      procedure :: lay_out
      procedure :: find_fastest
   end type stiff_term_t

contains

   !> The term of some elements of `solid`, whose law is linear.
   subroutine stiff_term_init(self, solid, n_dim, is_in)
      class(stiff_term_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0
      logical, intent(in) :: is_in(:)            !! (n_element) these

      self%role = role_internal
      call stiff_elements_init(self%own, solid, n_dim, is_in)
      call stiff_elements_fastest(self%own, solid, self%fastest)
   end subroutine stiff_term_init

   !> The freedoms of each element.
   pure subroutine lay_out(self, lists)
      class(stiff_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists

      associate (start => self%own%start)
         call lists_append(lists, start(2:) - start(:size(start) - 1), self%own%freedom)
      end associate
   end subroutine lay_out

   !> The fastest of the elements. A frame that turns keeps the frequencies.
   subroutine find_fastest(self, motion, fastest, is_bounded)
      class(stiff_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed at its end
      type(fastest_t), intent(inout) :: fastest
      logical, intent(inout) :: is_bounded       !! by elements

      if (self%fastest%square > fastest%square) fastest = self%fastest
   end subroutine find_fastest

   !> Some elements of `solid`, whose law is linear.
   subroutine stiff_elements_init(self, solid, n_dim, is_in)
      type(stiff_elements_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0
      logical, intent(in) :: is_in(:)            !! (n_element) these
      type(element_motion_t) :: rest
      type(element_response_t) :: part
      type(host_response_t) :: none
      integer :: k, m

      self%element = pack([(k, k = 1, solid%n_element)], is_in)
      self%n_node = solid%trait%n_node(self%element)
      self%node = solid%node(:, self%element)
      self%rounding = solid%stiffness(:, self%element)
      call element_lists(solid, n_dim, self%start, self%freedom, is_in)
      m = n_dim*size(self%node, 1)
      allocate(self%stiffness(m, m, size(self%element)), source=0.0_wp)
      rest%square = 0.0_wp
      do k = 1, size(self%element)
         m = n_dim*self%n_node(k)
         if (solid%is_single) then
            call single_rest_tangent(solid, self%element(k), self%stiffness(:m, :m, k))
         else
            call solid_element_respond(solid, self%element(k), rest, none, .true., part)
            self%stiffness(:m, :m, k) = part%tangent(:m, :m)
         end if
         self%stiffness(:m, :m, k) = 2.0_wp*self%stiffness(:m, :m, k)   ! by the end of no way: half
      end do
   end subroutine stiff_elements_init

   !> Take over the fastest of them.
   pure subroutine stiff_elements_fastest(self, solid, fastest)
      type(stiff_elements_t), intent(in) :: self
      type(solid_t), intent(in) :: solid         !! that they were taken from
      type(fastest_t), intent(inout) :: fastest
      real(wp) :: mass(size(self%node, 1)), square
      integer :: k, m

      do k = 1, size(self%element)
         associate (n => self%n_node(k), e => self%element(k))
            m = self%start(k + 1) - self%start(k)
            call lumped_mass(solid%mass%consistent(:n, :n, e), mass(:n))
            square = element_frequency(self%stiffness(:m, :m, k), mass(:n))
            if (square > fastest%square) fastest = fastest_t(e, square)
         end associate
      end do
   end subroutine stiff_elements_fastest

   !> A field on the nodes of element `k` of the list, from that of its first node.
   pure subroutine stiff_elements_gather(self, k, field, local)
      type(stiff_elements_t), intent(in) :: self
      integer, intent(in) :: k                                 !! 1 to n
      real(wp), intent(in), contiguous :: field(:, :)          !! (n_dim, n_node)
      real(wp), intent(inout) :: local(:)                      !! (n_dim*n_most)
      integer :: i, n_dim

      n_dim = size(field, 1)
      do i = 1, self%n_node(k)
         local(n_dim*(i - 1) + 1:n_dim*i) = field(:, self%node(i, k)) - field(:, self%node(1, k))
      end do
   end subroutine stiff_elements_gather

end module emcon_stiff_elements
