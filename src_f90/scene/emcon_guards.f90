!> Guards: node-to-segment contact that begins only where a node has gone in too far.
!>
!> A pair holds the nodes of its slave, or means of gaps; a corner of the master may go in between
!> two of them. For each direction in which no pair holds the nodes themselves a guard does, from a
!> small depth on: a corner at once, a node of a smooth side where means of gaps have failed.
!> Source: docs/theory.md, section 4.11.
module emcon_guards
   use emcon_interactions, only : contact_damping_t, contact_pair_t, formulation_nts, &
      pair_holds_nodes
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   implicit none
   private
   public :: guards_find, guard_slack, corner_slack, crossing_slack, overlap_bar, overlap_told, &
      touching_bar, crossing_bar

   !> So far, by the edge, bodies may be in each other where nodes are held themselves.
   real(wp), parameter :: touching_bar = 1.0e-3_wp
   !> So far where nodes are held, in space: edges may cross between them.
   real(wp), parameter :: crossing_bar = 2.0e-2_wp
   !> So far a node may go in: a corner, and any other one. Polygons of coarse curved surfaces, and
   !> gaps that are closed in the mean, stay above it.
   real(wp), parameter :: corner_slack = 0.8_wp*touching_bar, guard_slack = 0.05_wp
   !> So far edges that are not sharp may cross, in space, by the smaller face at both.
   real(wp), parameter :: crossing_slack = 0.8_wp*crossing_bar
   !> So far bodies may be in each other where gaps are closed in the mean, or on one side, with
   !> guards for the rest; more than half of what guards let in is told.
   real(wp), parameter :: overlap_bar = 1.1_wp*guard_slack, overlap_told = 0.5_wp*guard_slack

contains

   !> The guards of the pairs, each direction once.
   pure subroutine guards_find(pair, surface, guard)
      type(contact_pair_t), intent(in) :: pair(:)
      type(surface_t), intent(in) :: surface(:)
      type(contact_pair_t), allocatable, intent(out) :: guard(:)     !! in the order of `pair`
      type(contact_pair_t), allocatable :: all(:)
      type(name_index_t) :: known                !! which sides' nodes are held or guarded, by pair
      integer :: i, n

      do i = 1, size(pair)
         if (pair_holds_nodes(pair(i))) call name_index_put(known, &
            name_index_pair(pair(i)%slave, pair(i)%master), i)
      end do
      allocate(all(2*count(pair%is_guarded)))
      n = 0
      do i = 1, size(pair)
         if (.not. pair(i)%is_guarded .or. pair(i)%slave == 0 .or. pair(i)%master == 0) cycle
         call watch(pair, i, .false., known, all, n)
         if (surface(pair(i)%slave)%is_nodal) cycle
         if (allocated(surface(pair(i)%master)%wall)) cycle     ! without nodes
         call watch(pair, i, .true., known, all, n)
      end do
      guard = all(:n)
   end subroutine guards_find

   !> Append the guard of pair `i`, or of it with its sides exchanged, unless there is one.
   pure subroutine watch(pair, i, is_reverse, known, guard, n)
      type(contact_pair_t), intent(in) :: pair(:)
      integer, intent(in) :: i
      logical, intent(in) :: is_reverse
      type(name_index_t), intent(inout) :: known
      type(contact_pair_t), intent(inout) :: guard(:)
      integer, intent(inout) :: n                  !! guards so far
      type(contact_pair_t) :: new

      new = pair(i)
      if (is_reverse) then
         new%slave = pair(i)%master
         new%master = pair(i)%slave
      end if
      if (name_index_find(known, name_index_pair(new%slave, new%master)) > 0) return
      call name_index_put(known, name_index_pair(new%slave, new%master), i)
      new%formulation = formulation_nts
      new%both_sides = .true.
      new%is_reverse = is_reverse
      new%slack = guard_slack
      new%interaction%damping = contact_damping_t()      ! that is of the nodes of the pair itself
      new%of_pair = i
      n = n + 1
      guard(n) = new
   end subroutine watch

end module emcon_guards
