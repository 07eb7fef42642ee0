!> Ties of the plane before the first step: frozen integrals, multipliers at crosspoints, slave
!> nodes moved onto the master surface.
!>
!> Source: docs/theory.md, section 10.
module emcon_ties_plane
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_init, facets_rim, facets_t
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_distribute_rows, midside_init, midside_places, midside_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted
   use emcon_text, only : note_add, notes_t
   use emcon_tie_balance_plane, only : tie_balance, tie_balance_report_t, tie_is_balanced
   use emcon_tie_ends, only : tie_ends_merge, tie_ends_take
   use emcon_tie_maps, only : tie_map_is_given
   use emcon_tie_meetings, only : check_repeated, count_ties, find_held, uncover_exterior
   use emcon_tie_moves, only : ties_move_nodes
   use emcon_tie_plane, only : tie_measure
   implicit none
   private
   public :: ties_prepare_plane, tie_rows_part

   integer, parameter :: most_sweeps = 4

contains

   !> Find the constraint rows of all ties and move their slave nodes so that D x_s = M x_m; the
   !> notes tell how far. What they cover is no exterior any more. Rows are found between contact
   !> points, which midside nodes have, and distributed to nodes at the end.
   subroutine ties_prepare_plane(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: points
      type(midside_t) :: midside
      integer, allocatable :: n_tie(:)
      logical, allocatable :: is_held(:, :)
      type(tie_rows_t) :: rows
      integer :: t

      call midside_init(midside, scene, [scene%tie%slave, scene%tie%master])
      points = scene
      call midside_places(midside, points%x)
      do t = 1, size(scene%tie)
         call tie_measure(points, scene%tie(t), rows, error)
         if (allocated(error)) return
         points%tie(t)%rows = rows
      end do
      call check_repeated(points, error)
      if (allocated(error)) return
      call uncover_exterior(points)
      call count_ties(points, n_tie)
      call find_held(scene, is_held)
      do t = 1, size(scene%tie)
         call tie_ends_merge(points%tie(t)%rows, n_tie, is_held, &
            tie_map_is_given(points%tie(t)%map))
      end do
      call balance(points, error)
      if (allocated(error)) return
      scene%surface = points%surface
      scene%tie = points%tie
      do t = 1, merge(size(scene%tie), 0, midside%n > 0)
         call midside_distribute_rows(midside, scene%tie(t)%rows)
      end do
      call ties_move_nodes(scene, notes, error)
      if (allocated(error)) return
      points%x = scene%x
      call midside_places(midside, points%x)
      call note_unbalanced(points, notes, error)
   end subroutine ties_prepare_plane

   !> The sides of a tie do not stand beside each other: its rows say nothing of where one ends on
   !> the other, and are in no order.
   pure subroutine tie_rows_part(rows)
      type(tie_rows_t), intent(inout) :: rows

      deallocate(rows%neighbour)
      rows%buried = [integer ::]
      rows%ending = rows%ending(:, :0)
   end subroutine tie_rows_part

   !> Let curved ties keep the equilibrium of a constant stress. A tie may be master of another one
   !> whose slave nodes it moves: a few sweeps settle that.
   subroutine balance(scene, error)
      type(scene_t), intent(inout) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: moved
      type(notes_t) :: unused
      logical :: is_balanced, has_changed
      integer :: t, sweep

      moved = scene
      do sweep = 1, most_sweeps
         has_changed = .false.
         do t = 1, size(scene%tie)
            call balance_tie(moved, moved%tie(t), is_balanced, error)
            if (allocated(error)) return
            has_changed = has_changed .or. .not. is_balanced
         end do
         if (.not. has_changed) exit
         call ties_move_nodes(moved, unused, error)
         if (allocated(error)) return
      end do
      do t = 1, size(scene%tie)
         scene%tie(t)%rows = moved%tie(t)%rows
      end do
   end subroutine balance

   !> Balance one tie. On a curved interface the rim of the slave needs no multiplier and may have
   !> none; a surface that would keep less than two stays as it is.
   subroutine balance_tie(scene, tie, was_balanced, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(inout) :: tie
      logical, intent(out) :: was_balanced
      type(error_t), allocatable, intent(out) :: error
      type(facets_t) :: slave, master
      type(tie_balance_report_t) :: report
      type(tie_rows_t) :: rows
      logical :: is_end(size(tie%rows%slave))

      was_balanced = .not. tie%is_adjusted       ! across a gap no stress is balanced
      if (was_balanced) return
      call facets_init(slave, scene, scene%surface(tie%slave), error)
      if (.not. allocated(error)) call facets_init(master, scene, scene%surface(tie%master), error)
      if (.not. allocated(error)) call tie_is_balanced(tie%rows, scene%x, slave%facet, &
         master%facet, was_balanced, error)
      if (allocated(error) .or. was_balanced) return
      rows = tie%rows
      is_end = any(rows%neighbour == 0, dim=1) .and. are_at_rim(slave, rows%slave)
      if (count(.not. is_end) < 2) return
      if (any(is_end)) call tie_ends_take(rows, is_end)
      call tie_balance(rows, scene%x, slave%facet, master%facet, report, error)
      if (.not. allocated(error) .and. report%is_balanced) tie%rows = rows
   end subroutine balance_tie

   !> Are nodes of the scene at the rim of a surface?
   pure function are_at_rim(facets, node) result(at_rim)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: node(:)             !! each one of the surface
      logical :: at_rim(size(node)), is_rim(size(facets%node))
      integer :: i

      call facets_rim(facets, is_rim)
      do i = 1, size(node)
         at_rim(i) = is_rim(find_sorted(facets%node, node(i)))
      end do
   end function are_at_rim

   !> Tell which ties do not keep the equilibrium of a constant stress.
   subroutine note_unbalanced(scene, notes, error)
      type(scene_t), intent(in) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(facets_t) :: slave, master
      logical :: is_balanced
      integer :: t

      do t = 1, size(scene%tie)
         associate (tie => scene%tie(t))
            call facets_init(slave, scene, scene%surface(tie%slave), error)
            if (.not. allocated(error)) call facets_init(master, scene, &
               scene%surface(tie%master), error)
            if (.not. allocated(error)) call tie_is_balanced(tie%rows, scene%x, slave%facet, &
               master%facet, is_balanced, error)
            if (allocated(error)) return
            if (.not. is_balanced) call note_add(notes, "*TIE " // tie%name // ": a constant " // &
               "stress does not pass through its meshes exactly")
         end associate
      end do
   end subroutine note_unbalanced

end module emcon_ties_plane
