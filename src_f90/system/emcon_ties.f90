!> Ties before the first step: frozen integrals, multipliers at crosspoints, slave nodes moved onto
!> the master surface.
!>
!> Source: docs/theory.md, section 11.
module emcon_ties
   use emcon_chain, only : chain_init, chain_t, surface_edges
   use emcon_element_kinds, only : element_kinds
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_scene, only : prescribed_t, scene_t, tie_rows_t, tie_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_tie, only : tie_measure
   use emcon_tie_balance, only : tie_balance, tie_balance_report_t, tie_is_balanced
   implicit none
   private
   public :: ties_prepare, ties_move_nodes, find_crosspoints

   !> A node that would move by less than this part of the largest coordinate stays where it is.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   !> An element is spoilt if a corner keeps less than this part of its area.
   real(wp), parameter :: least_area = 0.1_wp
   integer, parameter :: most_sweeps = 4

contains

   !> Find the constraint rows of all ties and move their slave nodes so that D x_s = M x_m; the
   !> notes tell how far.
   subroutine ties_prepare(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: n_tie(:)
      logical, allocatable :: is_held(:, :)
      type(tie_rows_t) :: rows
      integer :: t

      if (size(scene%tie) == 0) return
      do t = 1, size(scene%tie)
         call tie_measure(scene, scene%tie(t), rows, error)
         if (allocated(error)) return
         scene%tie(t)%rows = rows
      end do
      call check_repeated(scene, error)
      if (allocated(error)) return
      call count_ties(scene, n_tie)
      call find_held(scene, is_held)
      do t = 1, size(scene%tie)
         call merge_ends(scene%tie(t)%rows, n_tie, is_held)
      end do
      call balance(scene, error)
      if (.not. allocated(error)) call ties_move_nodes(scene, notes, error)
      if (.not. allocated(error)) call note_unbalanced(scene, notes, error)
   end subroutine ties_prepare

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
                        "node " // to_text(scene%node_label(node)) // " is a slave node of *TIE " &
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
      integer, allocatable :: seen(:), edge(:, :)
      integer :: t, i, k, side

      allocate(n_tie(size(scene%x, 2)), seen(size(scene%x, 2)), source=0)
      do t = 1, size(scene%tie)
         do side = 1, 2
            call surface_edges(scene, &
               scene%surface(merge(scene%tie(t)%slave, scene%tie(t)%master, side == 1)), edge)
            do i = 1, size(edge, 2)
               do k = 1, 2
                  associate (node => edge(k, i))
                     if (seen(node) == t) cycle
                     seen(node) = t
                     n_tie(node) = n_tie(node) + 1
                  end associate
               end do
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
      type(chain_t) :: chain
      type(error_t), allocatable :: error
      integer, allocatable :: n_tie(:)
      real(wp) :: reach(size(scene%x, 2))        !! half of the shortest edge at a chain end; else 0
      integer :: t, side, k, i, j, surface

      call count_ties(scene, n_tie)
      reach = 0.0_wp
      do t = 1, size(scene%tie)
         do side = 1, 2
            surface = merge(scene%tie(t)%slave, scene%tie(t)%master, side == 1)
            call chain_init(chain, scene, scene%surface(surface), error)
            if (allocated(error)) cycle
            do k = 1, size(chain%node)
               if (all(chain%node_edge(:, k) > 0) .or. n_tie(chain%node(k)) == 1) cycle
               reach(chain%node(k)) = 0.5_wp*minval(chain%length(pack(chain%node_edge(:, k), &
                  chain%node_edge(:, k) > 0)))
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
      logical, allocatable, intent(out) :: is_held(:, :)     !! (2, n_node)
      integer :: i, k

      allocate(is_held(2, size(scene%x, 2)), source=.false.)
      do i = 1, size(scene%step)
         associate (prescribed => scene%step(i)%prescribed)
            do k = 1, size(prescribed)
               is_held(prescribed(k)%dof, prescribed(k)%node) = .true.
            end do
         end associate
      end do
   end subroutine find_held

   !> Where the end of a slave chain takes part in another tie too, or is held and its neighbour is
   !> not, its multiplier goes to the neighbour: on the end edge there is a constant one then. The
   !> rows are the same in all steps, as those that come back would not fit the displacements by
   !> then, and in both directions, as rotations would not fulfil them else. A chain that would
   !> keep less than two multipliers stays as it is: one alone would be a hinge.
   pure subroutine merge_ends(rows, n_tie, is_held)
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(in) :: n_tie(:)                    !! (n_node)
      logical, intent(in) :: is_held(:, :)               !! (2, n_node)
      logical :: is_merged(size(rows%slave))
      integer :: k

      is_merged = .false.
      do k = 1, size(rows%slave)
         if (all(rows%neighbour(:, k) > 0) .or. all(rows%neighbour(:, k) == 0)) cycle
         associate (node => rows%slave(k), next => rows%slave(maxval(rows%neighbour(:, k))))
            is_merged(k) = n_tie(node) > 1 .or. any(is_held(:, node) .and. .not. is_held(:, next))
         end associate
      end do
      call keep_two(rows%neighbour, is_merged)
      if (any(is_merged)) call take_merged(rows, is_merged)
   end subroutine merge_ends

   !> Take back what is to be merged in chains of rows that would keep less than two.
   pure subroutine keep_two(neighbour, is_merged)
      integer, intent(in) :: neighbour(:, :)             !! (2, rows) before and after; 0: none
      logical, intent(inout) :: is_merged(:)             !! (rows) ends of chains
      integer :: k, last, n

      do k = 1, size(is_merged)
         if (neighbour(1, k) > 0) cycle
         n = 1
         last = k
         do while (neighbour(2, last) > 0)
            last = neighbour(2, last)
            n = n + 1
         end do
         if (n - count(is_merged([k, last])) < 2) is_merged([k, last]) = .false.
      end do
   end subroutine keep_two

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

   !> Balance one tie. On a curved interface the ends of the slave chain need no multiplier and may
   !> have none; a chain that would keep less than two stays as it is.
   subroutine balance_tie(scene, tie, was_balanced, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(inout) :: tie
      logical, intent(out) :: was_balanced
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(tie_balance_report_t) :: report
      type(tie_rows_t) :: rows
      logical :: is_end(size(tie%rows%slave))

      call chain_init(slave, scene, scene%surface(tie%slave), error)
      if (.not. allocated(error)) call chain_init(master, scene, scene%surface(tie%master), error)
      if (.not. allocated(error)) call tie_is_balanced(tie%rows, scene%x, slave%edge, master%edge, &
         was_balanced, error)
      if (allocated(error) .or. was_balanced) return
      rows = tie%rows
      is_end = any(rows%neighbour == 0, dim=1) .and. is_chain_end(slave, rows%slave)
      if (count(.not. is_end) < 2) return
      if (any(is_end)) call take_merged(rows, is_end)
      call tie_balance(rows, scene%x, slave%edge, master%edge, report, error)
      if (.not. allocated(error) .and. report%is_balanced) tie%rows = rows
   end subroutine balance_tie

   !> Is a node an end of the chain?
   pure function is_chain_end(chain, node) result(is_end)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: node(:)
      logical :: is_end(size(node))
      integer :: i

      do i = 1, size(node)
         is_end(i) = any(chain%node_edge(:, find_sorted(chain%node, node(i))) == 0)
      end do
   end function is_chain_end

   !> Tell which ties do not keep the equilibrium of a constant stress.
   subroutine note_unbalanced(scene, notes, error)
      type(scene_t), intent(in) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      logical :: is_balanced
      integer :: t

      do t = 1, size(scene%tie)
         associate (tie => scene%tie(t))
            call chain_init(slave, scene, scene%surface(tie%slave), error)
            if (.not. allocated(error)) call chain_init(master, scene, &
               scene%surface(tie%master), error)
            if (.not. allocated(error)) call tie_is_balanced(tie%rows, scene%x, slave%edge, &
               master%edge, is_balanced, error)
            if (allocated(error)) return
            if (.not. is_balanced) call note_add(notes, "*TIE " // tie%name // ": its meshes " // &
               "do not fit so well that a constant stress passes exactly")
         end associate
      end do
   end subroutine note_unbalanced

   !> Add the rows `is_merged` to their neighbours and leave them out.
   pure subroutine take_merged(rows, is_merged)
      type(tie_rows_t), intent(inout) :: rows
      logical, intent(in) :: is_merged(:)                !! (rows) ends
      type(tie_rows_t) :: old
      integer, allocatable :: kept(:), number(:)
      integer :: i, k, n, side

      old = rows
      kept = pack([(k, k = 1, size(is_merged))], .not. is_merged)
      allocate(number(0:size(is_merged)), source=0)
      number(kept) = [(k, k = 1, size(kept))]
      rows%slave = old%slave(kept)
      rows%size = old%size(kept)
      deallocate(rows%neighbour, rows%start)
      allocate(rows%neighbour(2, size(kept)), rows%start(size(kept) + 1), source=0)
      n = 0
      do i = 1, size(kept)
         k = kept(i)
         call add_entries(old, k, rows, i, n)
         do side = 1, 2
            associate (other => old%neighbour(side, k))
               rows%neighbour(side, i) = number(other)
               if (other == 0) cycle
               if (.not. is_merged(other)) cycle
               call add_entries(old, other, rows, i, n)
               rows%size(i) = rows%size(i) + old%size(other)
            end associate
         end do
         rows%start(i + 1) = n
      end do
      rows%node = rows%node(:n)
      rows%weight = rows%weight(:n)
   end subroutine take_merged

   !> Add the entries of row `k` of `old` to row `i` of `rows`, the last one, which ends at `n`.
   pure subroutine add_entries(old, k, rows, i, n)
      type(tie_rows_t), intent(in) :: old
      integer, intent(in) :: k, i
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(inout) :: n
      integer :: s, place

      do s = old%start(k) + 1, old%start(k + 1)
         place = rows%start(i) + findloc(rows%node(rows%start(i) + 1:n), old%node(s), 1)
         if (place == rows%start(i)) then
            n = n + 1
            place = n
            rows%node(n) = old%node(s)
            rows%weight(n) = 0.0_wp
         end if
         rows%weight(place) = rows%weight(place) + old%weight(s)
      end do
   end subroutine add_entries

   !> Move the slave nodes onto the places that their ties give them; the notes tell how far.
   subroutine ties_move_nodes(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(prescribed_t) :: nothing(0)
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      real(wp), allocatable :: move(:, :)
      logical, allocatable :: is_alive(:, :)

      if (size(scene%tie) == 0) return
      call linear_rows_init(linear, scene)
      linear%is_used = linear%tie > 0
      allocate(is_alive(2, size(scene%x, 2)), source=.true.)
      call numbering_init(numbering, is_alive, nothing, linear)
      allocate(move, source=0.0_wp*scene%x)
      call find_moves(numbering, scene%x, move)
      where (abs(move) <= rounding*maxval(abs(scene%x))) move = 0.0_wp
      call note_moves(scene, move, notes)
      call check_elements(scene, move, error)
      if (.not. allocated(error)) scene%x = scene%x + move
   end subroutine ties_move_nodes

   !> x_d - (T x)_d of the dependent freedoms, from differences of places.
   pure subroutine find_moves(numbering, x, move)
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: x(size(numbering%start) - 1)
      real(wp), intent(inout) :: move(size(numbering%start) - 1)
      integer :: k, t

      do k = 1, numbering%n_dependent
         associate (d => numbering%dependent(k))
            do t = numbering%start(d) + 1, numbering%start(d + 1)
               move(d) = move(d) + numbering%weight(t)*(x(numbering%term(t)) - x(d))
            end do
         end associate
      end do
   end subroutine find_moves

   !> Tell the largest move of each tie.
   subroutine note_moves(scene, move, notes)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: move(:, :)                 !! (2, n_node)
      type(notes_t), intent(inout) :: notes
      real(wp), allocatable :: distance(:)
      integer :: t, k

      do t = 1, size(scene%tie)
         associate (slave => scene%tie(t)%rows%slave)
            allocate(distance(size(slave)))
            do k = 1, size(slave)
               distance(k) = norm2(move(:, slave(k)))
            end do
            k = maxloc(distance, 1)
            if (distance(k) > 0.0_wp) call note_add(notes, "*TIE " // scene%tie(t)%name // &
               ": " // to_text(count(distance > 0.0_wp)) // " of " // to_text(size(slave)) // &
               " slave nodes moved onto the master surface, at most by " // &
               to_text(distance(k)) // " (node " // to_text(scene%node_label(slave(k))) // ")")
            deallocate(distance)
         end associate
      end do
   end subroutine note_moves

   !> An error if a corner of an element would lose most of its area.
   subroutine check_elements(scene, move, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: move(:, :)                 !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: tie
      real(wp) :: before, after
      integer :: e, i, n, k

      do e = 1, size(scene%element_kind)
         n = element_kinds(scene%element_kind(e))%n_node
         associate (node => scene%element_node(:n, e))
            if (all(abs(move(:, node)) <= 0.0_wp)) cycle
            do i = 1, n
               before = corner_area(scene%x(:, node), i)
               after = corner_area(scene%x(:, node) + move(:, node), i)
               if (.not. before > 0.0_wp .or. after > least_area*before) cycle
               k = maxloc(abs(move(1, node)) + abs(move(2, node)), 1)
               call tie_text(scene, node(k), tie)
               call raise(error, err_input, tie // "element " // &
                  to_text(scene%element_label(e)) // " would be spoilt: the tie moves its " // &
                  "node " // to_text(scene%node_label(node(k))) // " by " // &
                  to_text(norm2(move(:, node(k)))) // " onto the master surface; let the " // &
                  "surfaces meet, or refine the coarser one")
               return
            end do
         end associate
      end do
   end subroutine check_elements

   !> Which tie moves slave node `node`.
   subroutine tie_text(scene, node, text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node
      character(len=:), allocatable, intent(out) :: text
      integer :: t

      text = ""
      do t = 1, size(scene%tie)
         if (any(scene%tie(t)%rows%slave == node)) text = where_text(scene, scene%tie(t)%origin) &
            // ": error: tie " // scene%tie(t)%name // ": "
      end do
   end subroutine tie_text

   !> Twice the area of the triangle at corner `i` of a polygon.
   pure real(wp) function corner_area(x, i)
      real(wp), intent(in) :: x(:, :)                    !! (2, corners) counter-clockwise
      integer, intent(in) :: i
      real(wp) :: a(2), b(2)

      a = x(:, 1 + mod(i, size(x, 2))) - x(:, i)
      b = x(:, 1 + mod(i + size(x, 2) - 2, size(x, 2))) - x(:, i)
      corner_area = a(1)*b(2) - a(2)*b(1)
   end function corner_area

end module emcon_ties
