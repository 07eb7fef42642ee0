!> Elements that respond one by one, those of three dimensions and of revolution: forces and
!> tangents in the order of the scene.
!>
!> Source: docs/theory.md, section 3.
module emcon_single_elements
   use emcon_element, only : element_geometry_t
   use emcon_element_axial_plane, only : axial_element_respond
   use emcon_element_space, only : space_element_respond, space_motion_t, space_part_t
   use emcon_element_frequency, only : element_frequency
   use emcon_element_places, only : element_places_find, element_places_t
   use emcon_user_space, only : user_space_respond
   use emcon_host_law, only : host_response_t
   use emcon_incompatible_space, only : incompatible_space_respond
   use emcon_kinds, only : dp, wp
   use emcon_lumped_mass, only : lumped_mass
   use emcon_mean_volume_space, only : mean_volume_space_respond
   use emcon_motion, only : motion_t
   use emcon_solid, only : solid_geometry, solid_t
   use emcon_term, only : fastest_t, response_t, role_internal
   use emcon_text, only : to_text
   implicit none
   private
   public :: single_respond, single_tangent_times, single_find_fastest
   public :: single_rest_tangent, compare_frequency

   !> Elements that threads share at a time.
   integer, parameter :: n_block = 1024

contains

   !> Forces of a motion. What displacements are rounded by, forces are too. Threads share the
   !> elements of a block, whose forces are added in the order of the scene.
   subroutine single_respond(solid, user, slots, motion, response, value, side)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      type(element_places_t), intent(in) :: slots      !! of element matrices
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      type(space_motion_t), allocatable :: local(:)
      type(space_part_t), allocatable :: part(:)
      logical :: with_tangent
      integer :: e, first, k, n

      with_tangent = present(value)
      n = merge(n_block, 1, response%n_thread > 1)
      allocate(local(n), part(n))
      local%square = user%square
      do first = 0, solid%n_element - 1, n
         n = min(n, solid%n_element - first)
         !$omp parallel do default(none) num_threads(response%n_thread) if(n > 1) &
         !$omp shared(solid, user, motion, local, part, first, n, with_tangent) schedule(static)
         do k = 1, n
            if (is_here(solid, first + k)) call respond_at(solid, user, first + k, motion, &
               with_tangent, local(k), part(k))
         end do
         !$omp end parallel do
         do k = 1, n
            e = first + k
            if (.not. is_here(solid, e)) cycle
            if (part(k)%is_inverted) then
               response%refusal = "element " // to_text(solid%deck%label(e)) // " is inverted"
               return
            end if
            response%energy(e) = part(k)%energy
            call add_forces(solid, e, motion, local(k), part(k), response)
            if (present(value)) call add_tangent(slots, solid, e, motion%weight, part(k), value, &
               side)
         end do
      end do
   end subroutine single_respond

   !> Is the element one of those that respond here?
   pure logical function is_here(solid, e)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element

      is_here = .not. (solid%trait%is_rigid(e) .or. solid%trait%is_small(e))
   end function is_here

   !> The tangent of element `e` where it has not moved, of small strains.
   pure subroutine single_rest_tangent(solid, e, tangent)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(out) :: tangent(:, :)     !! (n_dim*n, n_dim*n), n nodes [M/T^2]
      type(space_motion_t) :: rest
      type(space_part_t) :: part
      type(host_response_t) :: none

      rest%square = 0.0_wp
      call respond_to(solid, none, e, rest, .true., part)
      associate (n => solid%trait%n_node(e), m => solid%n_dim)
         tangent = reshape(part%tangent(:m, :n, :m, :n), [m*n, m*n])
      end associate
   end subroutine single_rest_tangent

   !> The response of element `e`, in space its motion from that of its first node.
   subroutine respond_at(solid, user, e, motion, with_tangent, local, part)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      integer, intent(in) :: e                   !! 1..n_element
      type(motion_t), intent(in) :: motion       !! placed
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_motion_t), intent(inout) :: local     !! all but `square` is set
      type(space_part_t), intent(inout) :: part
      integer :: i, n

      associate (node => solid%node(:solid%trait%n_node(e), e))
         n = solid%n_dim
         if (solid%is_of_rings) then
            local%from(:n, :size(node)) = motion%from(:, node)
            local%by(:n, :size(node)) = motion%by(:, node)
         else
            do i = 1, size(node)
               local%from(:, i) = motion%from(:, node(i)) - motion%from(:, node(1))
               local%by(:, i) = motion%by(:, node(i)) - motion%by(:, node(1))
            end do
         end if
      end associate
      call respond_to(solid, user, e, local, with_tangent, part)
   end subroutine respond_at

   !> The response of element `e` to a motion of its nodes.
   pure subroutine respond_to(solid, user, e, local, with_tangent, part)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      integer, intent(in) :: e                   !! 1..n_element
      type(space_motion_t), intent(in) :: local
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part
      type(element_geometry_t) :: geometry

      if (solid%held%at(e) < 0) then             ! without a copy
         call respond_with(solid, user, e, solid%held%single(-solid%held%at(e)), local, &
            with_tangent, part)
      else
         call solid_geometry(solid, e, geometry)
         call respond_with(solid, user, e, geometry, local, with_tangent, part)
      end if
   end subroutine respond_to

   !> The same, of an element with this geometry.
   pure subroutine respond_with(solid, user, e, geometry, local, with_tangent, part)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      integer, intent(in) :: e                   !! 1..n_element
      type(element_geometry_t), intent(in) :: geometry
      type(space_motion_t), intent(in) :: local
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part

      associate (law => solid%law(solid%law_of(e)), rest => solid%rest(solid%law_of(e)))
         if (solid%host%first_point(e) > 0) then
            call user_space_respond(geometry, solid%host%first_point(e), &
               user%points(solid%law_of(e)), local, with_tangent, part)
         else if (solid%is_of_rings) then
            call axial_element_respond(geometry, law%law, local, with_tangent, part)
         else if (solid%trait%has_mean(e)) then
            call mean_volume_space_respond(geometry, law%law, rest%law, local, with_tangent, part)
         else if (allocated(geometry%mode)) then
            call incompatible_space_respond(geometry, law%law, local, with_tangent, part)
         else
            call space_element_respond(geometry, law%law, local, with_tangent, part)
         end if
      end associate
   end subroutine respond_with

   !> Add the forces of element `e`, with what its displacements are rounded by.
   subroutine add_forces(solid, e, motion, local, part, response)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      type(motion_t), intent(in) :: motion
      type(space_motion_t), intent(in) :: local  !! the same motion, of its nodes
      type(space_part_t), intent(in) :: part
      type(response_t), intent(inout) :: response
      real(wp) :: largest
      integer :: a, i

      associate (node => solid%node(:solid%trait%n_node(e), e), &
            total => response%part(role_internal))
         do i = 1, size(node)
            total%force(:, node(i)) = total%force(:, node(i)) + part%force(:solid%n_dim, i)
         end do
         if (.not. response%with_sizes) return
         largest = 0.0_wp
         do i = 1, size(node)
            do a = 1, solid%n_dim
               largest = max(largest, abs(local%from(a, i) + local%by(a, i)), &
                  motion%computed(a, node(i)))
            end do
         end do
         do i = 1, size(node)
            total%magnitude(:, node(i)) = total%magnitude(:, node(i)) &
               + part%magnitude(:solid%n_dim, i)
            response%rounding(:, node(i)) = response%rounding(:, node(i)) &
               + largest*solid%stiffness(i, e)
         end do
      end associate
   end subroutine add_forces

   !> Add the tangent of an element to its places; its slots run down the columns.
   pure subroutine add_tangent(slots, solid, e, factor, part, value, side)
      type(element_places_t), intent(in) :: slots
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: factor             !! of the tangent
      type(space_part_t), intent(in) :: part
      real(dp), intent(inout) :: value(:), side(:)             !! slots > 0, slots < 0
      integer :: slot((solid%n_dim*solid%trait%n_node(e))**2)
      integer :: a, c, i, j, k, place

      call element_places_find(slots, e, solid%trait%n_node(e), slot)
      k = 0
      do j = 1, solid%trait%n_node(e)
         do c = 1, solid%n_dim
            do i = 1, solid%trait%n_node(e)
               do a = 1, solid%n_dim
                  k = k + 1
                  place = slot(k)
                  if (place > 0) then
                     value(place) = value(place) + real(factor*part%tangent(a, i, c, j), dp)
                  else if (place < 0) then
                     side(-place) = side(-place) + real(factor*part%tangent(a, i, c, j), dp)
                  end if
               end do
            end do
         end do
      end do
   end subroutine add_tangent

   !> Add the tangent of a motion times `direction` to `product`. Elements that `direction` does not
   !> touch are passed over.
   subroutine single_tangent_times(solid, user, motion, direction, product)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      type(space_motion_t) :: local
      type(space_part_t) :: part
      integer :: a, e, i, j

      local%square = user%square
      do e = 1, solid%n_element
         associate (node => solid%node(:solid%trait%n_node(e), e))
            if (.not. (is_here(solid, e) .and. any(abs(direction(:, node)) > 0.0_wp))) cycle
            call respond_at(solid, user, e, motion, .true., local, part)
            if (part%is_inverted) return
            do i = 1, size(node)
               do a = 1, solid%n_dim
                  do j = 1, size(node)
                     product(a, node(i)) = product(a, node(i)) + motion%weight &
                        *dot_product(part%tangent(a, i, :solid%n_dim, j), direction(:, node(j)))
                  end do
               end do
            end do
         end associate
      end do
   end subroutine single_tangent_times

   !> The fastest of the elements.
   subroutine single_find_fastest(solid, user, motion, fastest)
      type(solid_t), intent(in) :: solid
      type(host_response_t), intent(in) :: user !! of the same motion
      type(motion_t), intent(in) :: motion       !! placed at its end
      type(fastest_t), intent(inout) :: fastest
      type(space_motion_t) :: local
      type(space_part_t) :: part
      integer :: e

      local%square = user%square
      do e = 1, solid%n_element
         if (.not. is_here(solid, e)) cycle
         call respond_at(solid, user, e, motion, .true., local, part)
         if (part%is_inverted) return
         associate (n => solid%trait%n_node(e), m => solid%n_dim)
            call compare_frequency(solid, e, motion%weight, part%tangent(:m, :n, :m, :n), &
               fastest)
         end associate
      end do
   end subroutine single_find_fastest

   !> Is element `e` faster than the fastest so far?
   pure subroutine compare_frequency(solid, e, factor, tangent, fastest)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: factor             !! of the tangent
      real(wp), intent(in) :: tangent(:, :, :, :)   !! (n_dim, n, n_dim, n)
      type(fastest_t), intent(inout) :: fastest
      real(wp) :: mass(size(tangent, 2)), square
      integer :: m

      m = size(tangent, 1)*size(tangent, 2)
      call lumped_mass(solid%mass%consistent(:size(mass), :size(mass), e), mass)
      square = element_frequency(factor*reshape(tangent, [m, m]), mass)
      if (square > fastest%square) fastest = fastest_t(e, square)
   end subroutine compare_frequency

end module emcon_single_elements
