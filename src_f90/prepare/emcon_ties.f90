!> Ties before the first step: frozen integrals, multipliers at crosspoints, slave nodes moved onto
!> the master surface.
!>
!> Source: docs/theory.md, section 11.
module emcon_ties
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_init, facets_length, facets_rim, facets_t
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_distribute_rows, midside_init, midside_places, midside_t
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_surface_facets, only : faces_of_facets, surface_facets
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_tie_plane, only : tie_measure
   use emcon_tie_balance_plane, only : tie_balance, tie_balance_report_t, tie_is_balanced
   use emcon_tie_ends, only : tie_ends_merge, tie_ends_take
   use emcon_tie_moves, only : ties_move_nodes
   use emcon_tied_edges, only : tied_edges_find
   implicit none
   private
   public :: ties_prepare, find_crosspoints

   integer, parameter :: most_sweeps = 4

contains

   !> Find the constraint rows of all ties and move their slave nodes so that D x_s = M x_m; the
   !> notes tell how far. What they cover is no exterior any more. Rows are found between contact
   !> points, which midside nodes have, and distributed to nodes at the end.
   subroutine ties_prepare(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: points
      type(midside_t) :: midside
      integer, allocatable :: n_tie(:)
      logical, allocatable :: is_held(:, :)
      type(tie_rows_t) :: rows
      integer :: t

      if (size(scene%tie) == 0) return
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
         call tie_ends_merge(points%tie(t)%rows, n_tie, is_held)
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
   end subroutine ties_prepare

   !> Take the faces that ties cover out of all exterior.
   pure subroutine uncover_exterior(scene)
      type(scene_t), intent(inout) :: scene
      logical, allocatable :: is_tied(:), is_left(:)
      integer, allocatable :: facet(:, :), face(:)
      integer :: s

      do s = 1, size(scene%surface)
         if (.not. scene%surface(s)%is_exterior) cycle
         call surface_facets(scene, scene%surface(s), facet)
         call tied_edges_find(scene, facet, is_tied)
         call faces_of_facets(scene, scene%surface(s), face)
         associate (surface => scene%surface(s))
            is_left = spread(.false., 1, size(surface%face))
            is_left(pack(face, .not. is_tied)) = .true.
            surface%element = pack(surface%element, is_left)
            surface%face = pack(surface%face, is_left)
         end associate
      end do
   end subroutine uncover_exterior

   !> A slave node in the middle of one tie cannot be a slave node of another.
   subroutine check_repeated(scene, error)
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: owner(:)
      logical, allocatable :: is_inner(:)
      integer :: t, k

      allocate(owner(size(scene%x, 2)), source=0)
      allocate(is_inner(size(scene%x, 2)), source=.false.)
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            do k = 1, size(rows%slave)
               associate (node => rows%slave(k), is_inner_here => all(rows%neighbour(:, k) > 0))
                  if (owner(node) > 0 .and. (is_inner(node) .or. is_inner_here)) then
                     call raise(error, err_input, where_text(scene, scene%tie(t)%origin) // &
                        ": *TIE " // scene%tie(t)%name // " over-constrains the model: slave " // &
                        "node " // to_text(scene%node%label(node)) // " is a slave node of *TIE " &
                        // scene%tie(owner(node))%name // " already; let the surface be the " // &
                        "master of one of them")
                     return
                  end if
                  owner(node) = t
                  is_inner(node) = is_inner(node) .or. is_inner_here
               end associate
            end do
         end associate
      end do
   end subroutine check_repeated

   !> Number of ties that each node takes part in.
   pure subroutine count_ties(scene, n_tie)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: n_tie(:)      !! (n_node)
      integer, allocatable :: seen(:), node(:)
      integer :: t, k, side

      allocate(n_tie(size(scene%x, 2)), seen(size(scene%x, 2)), source=0)
      do t = 1, size(scene%tie)
         do side = 1, 2
            call surface_nodes(scene, &
               scene%surface(merge(scene%tie(t)%slave, scene%tie(t)%master, side == 1)), node)
            do k = 1, size(node)
               if (seen(node(k)) == t) cycle
               seen(node(k)) = t
               n_tie(node(k)) = n_tie(node(k)) + 1
            end do
         end do
      end do
   end subroutine count_ties

   !> Nodes at places where ends of several ties meet, and which of these places each is at.
   subroutine find_crosspoints(scene, node, place, n_place)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: node(:)
      integer, allocatable, intent(out) :: place(:)      !! (size of `node`) 1..n_place
      integer, intent(out) :: n_place
      type(facets_t) :: facets
      type(error_t), allocatable :: error
      logical, allocatable :: is_rim(:)
      integer, allocatable :: n_tie(:)
      real(wp) :: reach(size(scene%x, 2))        !! half of the shortest facet at a rim; else 0
      integer :: t, side, k, i, j, f, surface

      call count_ties(scene, n_tie)
      reach = 0.0_wp
      do t = 1, size(scene%tie)
         do side = 1, 2
            surface = merge(scene%tie(t)%slave, scene%tie(t)%master, side == 1)
            call facets_init(facets, scene, scene%surface(surface), error)
            if (allocated(error)) cycle
            is_rim = spread(.false., 1, size(facets%node))
            call facets_rim(facets, is_rim)
            do k = 1, size(facets%node)
               if (.not. is_rim(k) .or. n_tie(facets%node(k)) == 1) cycle
               associate (around => facets%around(facets%around_start(k): &
                     facets%around_start(k + 1) - 1))
                  reach(facets%node(k)) = 0.5_wp*minval([(facets_length(facets, around(f)), &
                     f = 1, size(around))])
               end associate
            end do
         end do
      end do
      node = pack([(i, i = 1, size(reach))], reach > 0.0_wp)
      allocate(place(size(node)), source=0)
      n_place = 0
      do i = 1, size(node)
         do j = 1, i - 1
            if (norm2(scene%x(:, node(i)) - scene%x(:, node(j))) &
               < min(reach(node(i)), reach(node(j)))) place(i) = place(j)
         end do
         if (place(i) > 0) cycle
         n_place = n_place + 1
         place(i) = n_place
      end do
   end subroutine find_crosspoints

   !> Freedoms that are prescribed in some step.
   pure subroutine find_held(scene, is_held)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: is_held(:, :)     !! (n_dim, n_node)
      integer :: i, k

      allocate(is_held(size(scene%x, 1), size(scene%x, 2)), source=.false.)
      do i = 1, size(scene%step)
         associate (prescribed => scene%step(i)%prescribed)
            do k = 1, size(prescribed)
               is_held(prescribed(k)%dof, prescribed(k)%node) = .true.
            end do
         end associate
      end do
   end subroutine find_held

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
            if (.not. is_balanced) call note_add(notes, "*TIE " // tie%name // ": its meshes " // &
               "do not fit so well that a constant stress passes exactly")
         end associate
      end do
   end subroutine note_unbalanced

end module emcon_ties
