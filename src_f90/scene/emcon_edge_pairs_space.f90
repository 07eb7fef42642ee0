!> Contact of sharp edges beside pairs in space: what crosses with no node in front of a face.
!> Source: docs/theory.md, section 14.
module emcon_edge_pairs_space
   use emcon_interactions, only : contact_damping_t, contact_pair_t, formulation_edges, &
      formulation_user, pair_is_reverse_of, pressure_hard
   use emcon_mesh, only : surface_t
   implicit none
   private
   public :: edge_pairs_find

contains

   !> The edges of pairs of faces that hold them, those of a pair with both sides once.
   !> Damping and pressures by the overclosure have no area of edges to act on.
   pure subroutine edge_pairs_find(pair, surface, edges)
      type(contact_pair_t), intent(in) :: pair(:)
      type(surface_t), intent(in) :: surface(:)
      type(contact_pair_t), allocatable, intent(out) :: edges(:)   !! in the order of `pair`
      logical :: has_faces(0:size(surface)), is_meant(size(pair))
      integer :: i

      has_faces = [.false., (.not. allocated(surface(i)%wall), i = 1, size(surface))]
      do i = 1, size(pair)
         is_meant(i) = pair(i)%holds_crossings .and. pair(i)%formulation /= formulation_user &
            .and. pair(i)%interaction%pressure%kind == pressure_hard &
            .and. has_faces(pair(i)%slave) .and. has_faces(pair(i)%master)
         if (is_meant(i)) is_meant(i) = .not. any(pair_is_reverse_of(pair(:i - 1), pair(i)))
      end do
      edges = pair
      edges%formulation = formulation_edges
      edges%both_sides = .true.
      edges%of_pair = [(i, i = 1, size(pair))]
      edges%interaction%damping = contact_damping_t()
      edges = pack(edges, is_meant)
   end subroutine edge_pairs_find

end module emcon_edge_pairs_space
