! build: elements
!> Conditions of mortar contact in space: what the triangles of slave facets see over a step, and
!> the sum of it over the facets of a vertex. Source: docs/theory.md, section 14.2.
module emcon_mortar_sum_space
   use emcon_condition_nodes, only : nodes_append
   use emcon_condition_product, only : condition_add_cubed, condition_start
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_t
   use emcon_mortar_slave_space, only : mortar_slave_weight
   use emcon_mortar_slip_space, only : slip_sight_t
   use emcon_patch_gap_space, only : patch_gap_of, patch_gap_t, patch_open, patch_open_cover, &
      patch_open_sums, patch_open_t, patch_sums_t
   use emcon_patch_spread_space, only : patch_spread, patch_spread_list, patch_spread_t, &
      patch_uses
   use emcon_patch_places_space, only : patch_stencil_gather
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: sight_t, mortar_sight, mortar_facet_sums, mortar_begin_sum, mortar_add_facet

   !> Covered but for round-off: the dual multipliers are as they are.
   real(wp), parameter :: whole_cover = 256.0_wp*epsilon(1.0_wp)

   !> What a triangle sees in a step, for all that is asked of it.
   type :: sight_t
      type(patch_open_t) :: open
      logical, allocatable :: is_used(:)              !! (n_node of the stencil) open depends on it
      integer, allocatable :: node(:)                 !! these,
      type(patch_spread_t) :: spread                  !! and what they are in it
      logical :: is_full = .false.                    !! its facet is covered, but for round-off
      logical :: is_blended = .false.                 !! between the linear multipliers and the dual
      type(slip_sight_t) :: slip                      !! with friction
   end type sight_t

contains

   !> What the triangles of a facet see, from `first` on.
   pure subroutine mortar_sight(self, first, x, u0, du, leaves_second, sight)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: first               !! triangle of the slave's split
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      logical, intent(in) :: leaves_second       !! no second derivatives are asked for
      type(sight_t), intent(inout) :: sight(:)   !! (triangles of the facet)
      real(wp) :: part(0:1)
      integer :: k

      part = 0.0_wp
      do k = 1, size(sight)
         associate (stencil => self%stencil(first + k - 1))
            if (stencil%triangle == 0) cycle
            call look(stencil, x, u0, du, leaves_second, sight(k))
            if (sight(k)%open%n_vertex == 0) cycle
            part = part + 2.0_wp*patch_open_cover(sight(k)%open)/real(size(sight), wp)
         end associate
      end do
      if (.not. self%is_dual) return
      sight%is_full = all(abs(part - 1.0_wp) <= whole_cover)
      sight%is_blended = any(part > 0.0_wp) .and. .not. sight%is_full
   end subroutine mortar_sight

   !> What one triangle sees.
   pure subroutine look(stencil, x, u0, du, leaves_second, sight)
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      logical, intent(in) :: leaves_second
      type(sight_t), intent(inout) :: sight
      real(wp), dimension(3, 3 + stencil%patch%n_vertex) :: at, way

      call patch_stencil_gather(stencil, x, u0, du, at, way)
      call patch_open(stencil%patch, at, way, leaves_second, sight%open)
      if (sight%open%n_vertex == 0) return
      associate (vertex => sight%open%vertex(:sight%open%n_vertex))
         sight%is_used = patch_uses(stencil, vertex)
         call patch_spread_list(stencil, vertex, sight%is_used, sight%spread)
      end associate
      sight%node = pack(stencil%node(:stencil%n_node), sight%is_used)
   end subroutine look

   !> The sums of the triangles of a facet, from `first` on.
   pure subroutine mortar_facet_sums(self, first, sight, leaves_second, sums)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: first               !! triangle of the slave's split
      type(sight_t), intent(in) :: sight(:)      !! what the triangles of the facet see
      logical, intent(in) :: leaves_second       !! no second derivatives are asked for
      type(patch_sums_t), intent(out) :: sums(:) !! (triangles of the facet)
      integer :: k

      do k = 1, size(sight)
         if (sight(k)%open%n_vertex > 0) call patch_open_sums(self%stencil(first + k - 1)%patch, &
            sight(k)%open, leaves_second, sums(k))
      end do
   end subroutine mortar_facet_sums

   !> Add a facet to the condition of one of its vertices, docs/theory.md, eq. (62).
   pure subroutine mortar_add_facet(self, entry, sight, sums, target, scale, item)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: entry               !! `start` has its first triangle at this place
      type(sight_t), intent(in) :: sight(:)      !! what its triangles see
      type(patch_sums_t), intent(in) :: sums(:)  !! of them
      real(wp), intent(in) :: target             !! height to hold [L]
      real(wp), intent(in) :: scale              !! > 0, what the value is divided by [L^2]
      type(condition_t), intent(inout) :: item
      type(condition_t) :: cover, skew
      type(patch_gap_t) :: gap
      real(wp), parameter :: whole(3) = 1.0_wp
      real(wp) :: theta                          ! of the dual multipliers
      integer :: k

      theta = merge(1.0_wp, 0.0_wp, sight(1)%is_full)
      if (sight(1)%is_blended) then
         cover%leaves_second = item%leaves_second
         skew%leaves_second = item%leaves_second
         call condition_start(cover, item%node(:item%n_node), size(item%g, 1))
         call condition_start(skew, item%node(:item%n_node), size(item%g, 1))
      end if
      do k = 1, size(sight)
         if (sight(k)%open%n_vertex == 0) cycle
         associate (open => sight(k)%open, place => entry + k - 1, leaves => item%leaves_second)
            call patch_gap_of(open, sums(k), mortar_slave_weight(self, place, theta), target, &
               .false., leaves, gap)
            call add_gap(sight(k), gap, scale, item)
            if (.not. sight(k)%is_blended) cycle
            call patch_gap_of(open, sums(k), self%weights%skew(:, self%vertex(place), &
               self%triangle(place)), target, .false., leaves, gap)
            call add_gap(sight(k), gap, scale, skew)
            call patch_gap_of(open, sums(k), whole, 0.0_wp, .true., leaves, gap)
            call add_gap(sight(k), gap, 0.5_wp*real(size(sight), wp), cover)
         end associate
      end do
      if (sight(1)%is_blended) call condition_add_cubed(item, cover, skew)
   end subroutine mortar_add_facet

   !> Add a gap of a triangle by `scale` to a condition that has its nodes.
   pure subroutine add_gap(sight, gap, scale, item)
      type(sight_t), intent(in) :: sight
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: scale
      type(condition_t), intent(inout) :: item
      integer :: j, place(size(sight%node))

      do j = 1, size(place)
         place(j) = findloc(item%node(:item%n_node), sight%node(j), 1)
      end do
      call patch_spread(gap, sight%spread, scale, place, item)
   end subroutine add_gap

   !> The nodes of the condition of constraint `i`, its own first, then others of the slave, and no
   !> derivatives yet.
   pure subroutine mortar_begin_sum(self, i, slot, sight, item)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      integer, intent(in) :: slot(:)             !! (n_triangle) where each is in `sight`
      type(sight_t), intent(in) :: sight(:)      !! what triangles see
      type(condition_t), intent(inout) :: item
      integer, allocatable :: list(:)
      integer :: k, m, n, pass

      associate (triangle => self%triangle(self%start(i):self%start(i + 1) - 1))
         allocate(list(1 + sum(self%stencil(triangle)%n_node)))
         list(1) = self%node(i)
         n = 1
         do pass = 1, 2
            do k = 1, size(triangle)
               associate (stencil => self%stencil(triangle(k)), of => &
                     sight(slot(triangle(k))))
                  if (.not. (of%open%n_vertex > 0 .or. allocated(of%slip%vertex))) cycle
                  associate (is_slave => [(m <= stencil%n_slave, m = 1, stencil%n_node)])
                     call nodes_append(pack(stencil%node(:stencil%n_node), uses(stencil, of) &
                        .and. (is_slave .eqv. pass == 1)), list, n)
                  end associate
               end associate
            end do
            if (pass == 1) item%n_slave = n
         end do
      end associate
      call condition_start(item, list(:n), self%sides%slave%n_dim)
      item%is_mean = .true.
   end subroutine mortar_begin_sum

   !> Which nodes of a stencil gap or slip depend on.
   pure function uses(stencil, sight) result(is_used)
      type(patch_stencil_t), intent(in) :: stencil
      type(sight_t), intent(in) :: sight
      logical :: is_used(stencil%n_node)

      is_used = .false.
      if (allocated(sight%is_used)) is_used = sight%is_used
      if (allocated(sight%slip%vertex)) is_used = is_used .or. patch_uses(stencil, &
         sight%slip%vertex)
   end function uses

end module emcon_mortar_sum_space
