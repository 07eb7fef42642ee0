!> Elements of one kind and one law side by side: which they are, how their nodes move and what they
!> get, in the plane and in space.
!>
!> All arrays run over lanes first, and nothing is summed over them: what an element gives does not
!> depend on its neighbours in the pack. What is computed at their points: emcon_pack_points_plane
!> and emcon_pack_points_space.
module emcon_element_pack
   use emcon_element, only : element_geometry_t
   use emcon_element_space, only : n_space
   use emcon_kinds, only : wp
   use emcon_law, only : n_lane
   implicit none
   private
   public :: element_pack_t, pack_motion_t, pack_response_t
   public :: pack_begin, pack_put, pack_geometry, pack_make_room, pack_gather, pack_scatter
   public :: pack_clear, pack_add_rounding

   !> Elements of one kind and one law. Lanes that are left over repeat the first one.
   !>
   !> In space, where gradients are most of what a pack holds, they are found anew from the places
   !> of the nodes: as fast as they are read.
   type :: element_pack_t
      integer :: n = 0                           !! elements in it, 1..n_lane
      integer :: n_node = 0                      !! nodes of each
      integer :: n_dim = 0                       !! of these
      integer :: n_gp = 0
      integer :: kind = 0                        !! of all of them
      integer :: law = 0                         !! of all of them
      integer :: element(n_lane) = 0
      integer, allocatable :: node(:, :)         !! (n_lane, n_node)
      !> (n_lane, n_dim, n_node, n_gp) in the plane [1/L]
      real(wp), allocatable :: gradient(:, :, :, :)
      !> (n_lane, n_dim, n_node) in space: places of the nodes, from the first of each [L]
      real(wp), allocatable :: x(:, :, :)
      real(wp), allocatable :: weight(:, :)      !! (n_lane, n_gp) reference volume [L^3]
      !> (n_lane, n_strain, n_mode, n_gp) as in element_geometry_t
      real(wp), allocatable :: mode(:, :, :, :), dual(:, :, :, :)
   end type element_pack_t

   !> Motion of the nodes, from `from` by `by`, relative to the first node of each element, which
   !> does not round them with the distance that a body has flown.
   type :: pack_motion_t
      real(wp) :: square = 1.0_wp                !! part of squares in strains; 0: small strains
      real(wp), allocatable :: from(:, :, :)     !! (n_lane, n_dim, n_most) at the start [L]
      real(wp), allocatable :: by(:, :, :)       !! (n_lane, n_dim, n_most) over the span [L]
   end type pack_motion_t

   type :: pack_response_t
      real(wp) :: energy(n_lane) = 0.0_wp        !! strain energy at the end
      real(wp), allocatable :: force(:, :, :)    !! (n_lane, n_dim, n_most)
      logical :: with_sizes = .true.             !! there are magnitudes
      real(wp), allocatable :: magnitude(:, :, :)   !! like `force`: sums of |contributions|
      !> Where asked for, derivative of `force` by u1: (n_lane, n_dim, n_most, those of u1)
      real(wp), allocatable :: tangent(:, :, :, :, :)
      !> det F <= 0 at some point at the end, or a strain that the law has no energy for.
      logical :: is_inverted(n_lane) = .false.
   end type pack_response_t

contains

   !> Room for `n` elements of one kind and one law.
   pure subroutine pack_begin(self, n, kind, law)
      type(element_pack_t), intent(out) :: self
      integer, intent(in) :: n                   !! 1..n_lane
      integer, intent(in) :: kind, law           !! of all of them

      self%n = n
      self%kind = kind
      self%law = law
   end subroutine pack_begin

   !> Let element `e` have lane `l`; the first one has those that are left over, too.
   pure subroutine pack_put(self, l, e, node, geometry, x)
      type(element_pack_t), intent(inout) :: self
      integer, intent(in) :: l                   !! 1..n, 1 before others
      integer, intent(in) :: e                   !! 1..n_element
      integer, intent(in) :: node(:)             !! (n_node) of it
      type(element_geometry_t), intent(in) :: geometry
      !> (n_dim, n_node) in space: their places, from the first of them [L]
      real(wp), intent(in), optional :: x(:, :)
      integer :: m

      if (l == 1) call make_room(self, size(geometry%gradient, 1), geometry)
      do m = l, merge(n_lane, l, l == 1)
         self%element(m) = e
         self%node(m, :) = node
         if (allocated(self%gradient)) self%gradient(m, :, :, :) = geometry%gradient
         if (allocated(self%x)) self%x(m, :, :) = x
         self%weight(m, :) = geometry%weight
         if (.not. allocated(self%mode)) cycle
         self%mode(m, :, :, :) = geometry%mode
         self%dual(m, :, :, :) = geometry%dual
      end do
   end subroutine pack_put

   pure subroutine make_room(self, n_dim, geometry)
      type(element_pack_t), intent(inout) :: self
      integer, intent(in) :: n_dim               !! > 0
      type(element_geometry_t), intent(in) :: geometry     !! of the first one

      self%n_node = geometry%n_node
      self%n_dim = n_dim
      self%n_gp = geometry%n_gp
      allocate(self%node(n_lane, self%n_node), self%weight(n_lane, self%n_gp))
      if (n_dim == n_space) then
         allocate(self%x(n_lane, n_dim, self%n_node))
      else
         allocate(self%gradient(n_lane, n_dim, self%n_node, self%n_gp))
      end if
      if (.not. allocated(geometry%mode)) return
      allocate(self%mode(n_lane, size(geometry%mode, 1), size(geometry%mode, 2), self%n_gp))
      allocate(self%dual, mold=self%mode)
   end subroutine make_room

   !> What lane `l` has; in space gradients and volumes are to be found from `x`.
   pure subroutine pack_geometry(self, l, geometry, x)
      type(element_pack_t), intent(in) :: self
      integer, intent(in) :: l                             !! 1..n
      type(element_geometry_t), intent(out) :: geometry
      real(wp), intent(inout), allocatable :: x(:, :)      !! (n_dim, n_node) [L], where it has them

      geometry%n_node = self%n_node
      geometry%n_gp = self%n_gp
      if (allocated(self%gradient)) then
         geometry%gradient = self%gradient(l, :, :, :)
         geometry%weight = self%weight(l, :)
      else
         x = self%x(l, :, :)
      end if
      if (.not. allocated(self%mode)) return
      geometry%mode = self%mode(l, :, :, :)
      geometry%dual = self%dual(l, :, :, :)
   end subroutine pack_geometry

   !> Work space for elements of up to `n_most` nodes.
   pure subroutine pack_make_room(n_dim, n_most, with_tangent, motion, response)
      integer, intent(in) :: n_dim               !! > 0
      integer, intent(in) :: n_most              !! nodes, >= 0
      logical, intent(in) :: with_tangent        !! else there is none for a tangent
      type(pack_motion_t), intent(inout) :: motion         !! what it has already stays
      type(pack_response_t), intent(inout) :: response     !! so does what this has

      if (.not. allocated(motion%from)) allocate(motion%from(n_lane, n_dim, n_most), &
         motion%by(n_lane, n_dim, n_most), response%force(n_lane, n_dim, n_most), &
         response%magnitude(n_lane, n_dim, n_most))
      if (with_tangent .and. .not. allocated(response%tangent)) then
         allocate(response%tangent(n_lane, n_dim, n_most, n_dim, n_most))
      end if
   end subroutine pack_make_room

   !> The motion of the nodes of each element.
   pure subroutine pack_gather(self, from, by, motion)
      type(element_pack_t), intent(in) :: self
      real(wp), intent(in), contiguous :: from(:, :), by(:, :)   !! (n_dim, n_node) [L]
      type(pack_motion_t), intent(inout) :: motion               !! `from`, `by` are set
      integer :: a, i, l, first, node

      do l = 1, n_lane
         first = self%node(l, 1)
         do i = 1, self%n_node
            node = self%node(l, i)
            do a = 1, size(from, 1)
               motion%from(l, a, i) = from(a, node) - from(a, first)
               motion%by(l, a, i) = by(a, node) - by(a, first)
            end do
         end do
      end do
   end subroutine pack_gather

   !> Add what the nodes of each element get, element by element, to those whose turn it is.
   pure subroutine pack_scatter(self, turn_of, turn, part, total)
      type(element_pack_t), intent(in) :: self
      integer, intent(in), contiguous :: turn_of(:)          !! (n_node)
      integer, intent(in) :: turn                            !! as `turn_of` has them
      !> (n_lane, n_dim, >= n_node of each) forces, sizes or roundings
      real(wp), intent(in), contiguous :: part(:, :, :)
      real(wp), intent(inout), contiguous :: total(:, :)     !! (n_dim, n_node)
      integer :: a, i, l, node

      do l = 1, self%n
         do i = 1, self%n_node
            node = self%node(l, i)
            if (turn_of(node) /= turn) cycle
            do a = 1, size(total, 1)
               total(a, node) = total(a, node) + part(l, a, i)
            end do
         end do
      end do
   end subroutine pack_scatter

   !> Add to the nodes whose turn it is what the displacements of their elements are rounded by.
   pure subroutine pack_add_rounding(self, turn_of, turn, largest, stiffness, total)
      type(element_pack_t), intent(in) :: self
      integer, intent(in), contiguous :: turn_of(:)          !! (n_node)
      integer, intent(in) :: turn                            !! as `turn_of` has them
      real(wp), intent(in) :: largest(n_lane)                !! displacement [L]
      real(wp), intent(in) :: stiffness(:, :)                !! (>= n_node, n_element) [M/T^2]
      real(wp), intent(inout), contiguous :: total(:, :)     !! (n_dim, n_node)
      integer :: i, l, node

      do l = 1, self%n
         do i = 1, self%n_node
            node = self%node(l, i)
            if (turn_of(node) /= turn) cycle
            total(:, node) = total(:, node) + largest(l)*stiffness(i, self%element(l))
         end do
      end do
   end subroutine pack_add_rounding

   !> Nothing, before points are added.
   pure subroutine pack_clear(n, response, with_tangent)
      integer, intent(in) :: n                   !! nodes of each element
      type(pack_response_t), intent(inout) :: response
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is

      response%energy = 0.0_wp
      response%force(:, :, :n) = 0.0_wp
      if (response%with_sizes) response%magnitude(:, :, :n) = 0.0_wp
      if (with_tangent) response%tangent(:, :, :n, :, :n) = 0.0_wp
      response%is_inverted = .false.
   end subroutine pack_clear

end module emcon_element_pack
