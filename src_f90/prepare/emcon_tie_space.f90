!> The constraint rows of a tie in space: D x_s - M x_m = 0, one for each slave node that keeps its
!> multiplier.
!>
!> Source: docs/theory.md, section 10.10.
module emcon_tie_space
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_t
   use emcon_interactions, only : multiplier_dual
   use emcon_kinds, only : dp, wp
   use emcon_nearest_space, only : nearest_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, sort_order
   use emcon_tie_basket_space, only : tie_basket_edges, tie_basket_find, tie_basket_release
   use emcon_tie_cells_space, only : tie_cells_find, tie_cells_t
   use emcon_tie_check_space, only : tie_check_cover, tie_check_nodes, tie_check_sides
   use emcon_tie_multipliers_space, only : tie_multipliers_find, tie_multipliers_t
   use emcon_tie_shapes_space, only : tie_shapes
   use emcon_tie_sides_space, only : tie_side_t, tie_sides_init, tie_sides_nearest, tie_sides_t, &
      triangle_at
   implicit none
   private
   public :: tie_measure_space

   !> A sum of terms that is 0 in exact arithmetic stays below this, per weight of its row: nodes
   !> that stand opposite each other are tied one to one.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   !> A master facet is covered as a whole if less than this part of it is free.
   real(wp), parameter :: free_part = 0.1_wp

   !> Entries of all rows, in any order, equal ones several times.
   type :: entries_t
      integer :: n = 0
      integer, allocatable :: row(:), node(:)
      real(wp), allocatable :: weight(:)
   end type entries_t

contains

   !> The rows of `tie`. Only reference positions are looked at.
   !>
   !> Errors: surfaces without faces, or with a node in common; slave nodes without partner within
   !> the tolerance; slave faces that the master does not cover, or in two layers. The nodes of a
   !> slave surface of nodes are tied to the places of the master nearest to them.
   subroutine tie_measure_space(scene, tie, n_tie, is_held, rows, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: n_tie(:)            !! (n_node) ties that each node takes part in
      logical, intent(in) :: is_held(:, :)       !! (3, n_node) prescribed in some step
      type(tie_rows_t), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      type(tie_sides_t) :: sides
      type(tie_cells_t), allocatable :: cells(:)
      logical, allocatable :: is_kept(:), is_spared(:), is_free(:)
      integer :: f

      call tie_sides_init(sides, scene, tie, error)
      if (.not. allocated(error)) call tie_check_sides(scene, tie, sides, error)
      if (.not. allocated(error)) call tie_check_nodes(scene, tie, sides, error)
      if (allocated(error)) return
      if (sides%slave%facets%n_facet == 0) then
         call find_node_rows(sides, rows)
         return
      end if
      allocate(cells(sides%slave%facets%n_facet))
      do f = 1, size(cells)
         call tie_cells_find(cells(f), sides, f)
      end do
      call tie_check_cover(scene, tie, sides, cells, error)
      if (allocated(error)) return
      associate (slave => sides%slave%facets, is_dual => tie%multiplier == multiplier_dual)
         is_kept = spread(.true., 1, size(slave%node))
         call find_rows(sides, cells, is_kept, is_dual, rows)
         is_spared = are_matching(slave, rows)
         call tie_basket_find(slave, n_tie, is_held, is_free)
         call tie_basket_release(slave, scene%x, is_free .and. .not. is_spared, is_kept)
         call tie_basket_edges(slave, scene%x, is_free)
         call tie_basket_release(slave, scene%x, is_free .and. .not. is_spared, is_kept)
         if (.not. all(is_kept)) call find_rows(sides, cells, is_kept, is_dual, rows)
      end associate
      call find_covered(sides%master, cells, rows)
   end subroutine tie_measure_space

   !> Nodes around which the meshes match: at all nodes of their facets rows say the same of both
   !> sides. They are one with those of the master.
   pure function are_matching(slave, rows) result(is_matching)
      type(facets_t), intent(in) :: slave
      type(tie_rows_t), intent(in) :: rows
      logical :: is_matching(size(slave%node))
      real(wp), allocatable :: own(:), other(:)
      logical :: matches(0:size(slave%node))
      integer :: k, i

      matches = .false.
      matches(0) = .true.                        ! behind the last node of a facet
      do k = 1, size(rows%slave)
         associate (node => rows%node(rows%start(k) + 1:rows%start(k + 1)), &
               weight => rows%weight(rows%start(k) + 1:rows%start(k + 1)))
            associate (is_own => [(find_sorted(slave%node, node(i)) > 0, i = 1, size(node))])
               own = pack(weight, is_own)
               other = pack(-weight, .not. is_own)
            end associate
         end associate
         if (size(own) /= size(other)) cycle
         own = own(sort_order(real(own, dp)))
         other = other(sort_order(real(other, dp)))
         matches(find_sorted(slave%node, rows%slave(k))) = all(abs(own - other) <= &
            rounding*rows%size(k))
      end do
      do k = 1, size(is_matching)
         associate (around => slave%around(slave%around_start(k):slave%around_start(k + 1) - 1))
            is_matching(k) = all(matches(reshape(slave%corner(:, around), &
               [size(around)*size(slave%corner, 1)])))
         end associate
      end do
   end function are_matching

   !> Each slave node at the place of the master nearest to it, as shape functions interpolate: such
   !> a row is as large as the facet of that place.
   subroutine find_node_rows(sides, rows)
      type(tie_sides_t), intent(in) :: sides
      type(tie_rows_t), intent(inout) :: rows
      type(nearest_t) :: nearest
      type(entries_t) :: entries
      real(wp) :: length(size(sides%slave%facets%node))
      integer :: k, n

      allocate(entries%row(0), entries%node(0), entries%weight(0))
      associate (slave => sides%slave%facets, master => sides%master%facets, &
            split => sides%master%split)
         do k = 1, size(length)
            call tie_sides_nearest(sides, sides%slave%at(:, k), nearest)
            associate (f => split%facet(nearest%triangle))
               n = count(master%facet(:, f) > 0)
               length(k) = master%size(f)
               call add(entries, k, slave%node(k:k), length(k:k))
               call add(entries, k, master%facet(:n, f), -length(k)*tie_shapes(n, &
                  nearest%triangle - split%start(f) + 1, nearest%weight, sides%master%skew(:, f)))
            end associate
         end do
         allocate(rows%covered(size(master%facet, 1), 0))
         call fill_rows(slave, [(k, k = 1, size(length))], length, entries, rows)
      end associate
   end subroutine find_node_rows

   !> Add up what the facets give to the rows.
   subroutine find_rows(sides, cells, is_kept, is_dual, rows)
      type(tie_sides_t), intent(in) :: sides
      type(tie_cells_t), intent(in) :: cells(:)
      logical, intent(in) :: is_kept(:)          !! (node of the slave)
      logical, intent(in) :: is_dual
      type(tie_rows_t), intent(out) :: rows
      type(tie_multipliers_t) :: multipliers
      type(entries_t) :: entries
      real(wp) :: length(size(is_kept))          !! int psi_k
      integer :: f, k, n, row

      length = 0.0_wp
      allocate(entries%row(0), entries%node(0), entries%weight(0))
      do f = 1, size(cells)
         associate (corner => sides%slave%facets%corner(:, f))
            n = count(corner > 0)
            call tie_multipliers_find(multipliers, cells(f)%mass(:n, :n), is_kept(corner(:n)), &
               is_dual)
            do k = 1, multipliers%n
               if (multipliers%node(k) > 0) then
                  row = corner(multipliers%node(k))
               else
                  row = nearest_kept(sides%slave, f, is_kept)
               end if
               length(row) = length(row) + multipliers%size(k)
               call add(entries, row, sides%slave%facets%facet(:n, f), multipliers%d(k, :n))
               call add_masters(entries, row, multipliers%psi(k, :), sides%master, cells(f))
            end do
         end associate
      end do
      call fill_rows(sides%slave%facets, pack([(k, k = 1, size(is_kept))], is_kept), length, &
         entries, rows)
   end subroutine find_rows

   !> The nearest node that keeps its multiplier, from facet `f` without any, on the same part.
   pure integer function nearest_kept(slave, f, is_kept) result(nearest)
      type(tie_side_t), intent(in) :: slave
      integer, intent(in) :: f
      logical, intent(in) :: is_kept(:)
      real(wp) :: middle(3), square, least
      integer :: k

      nearest = 0
      least = huge(least)
      associate (facets => slave%facets, split => slave%split)
         middle = sum(slave%at(:, split%corner(:, split%start(f))), 2)/3.0_wp
         if (split%centre(f) > 0) middle = slave%at(:, split%centre(f))
         do k = 1, size(is_kept)
            if (.not. is_kept(k)) cycle
            if (facets%part(facets%around(facets%around_start(k))) /= facets%part(f)) cycle
            square = sum((slave%at(:, k) - middle)**2)
            if (square >= least) cycle
            least = square
            nearest = k
         end do
      end associate
   end function nearest_kept

   !> Append -M of one multiplier on a facet, over the nodes of the master.
   subroutine add_masters(entries, row, psi, master, cells)
      type(entries_t), intent(inout) :: entries
      integer, intent(in) :: row
      real(wp), intent(in) :: psi(:)             !! (most nodes) over shape functions of the slave
      type(tie_side_t), intent(in) :: master
      type(tie_cells_t), intent(in) :: cells
      integer :: i, n

      do i = 1, cells%n
         associate (node => master%facets%facet(:, master%split%facet(cells%triangle(i))))
            n = count(node > 0)
            call add(entries, row, node(:n), -matmul(psi, cells%cross(:, :n, i)))
         end associate
      end do
   end subroutine add_masters

   !> Append entries of one row.
   pure subroutine add(entries, row, node, weight)
      type(entries_t), intent(inout) :: entries
      integer, intent(in) :: row, node(:)
      real(wp), intent(in) :: weight(:)          !! (size of node)
      type(entries_t) :: longer
      integer :: n

      n = entries%n + size(node)
      if (n > size(entries%row)) then
         allocate(longer%row(2*n), longer%node(2*n), longer%weight(2*n))
         longer%row(:entries%n) = entries%row(:entries%n)
         longer%node(:entries%n) = entries%node(:entries%n)
         longer%weight(:entries%n) = entries%weight(:entries%n)
         call move_alloc(longer%row, entries%row)
         call move_alloc(longer%node, entries%node)
         call move_alloc(longer%weight, entries%weight)
      end if
      entries%row(entries%n + 1:n) = row
      entries%node(entries%n + 1:n) = node
      entries%weight(entries%n + 1:n) = weight
      entries%n = n
   end subroutine add

   !> The rows of the nodes `kept`, in their order: the slave node first, then others in ascending
   !> order, equal ones as one. The weight of the slave node is what the others leave, added up from
   !> the end: summed up in that order the row is 0 exactly.
   pure subroutine fill_rows(slave, kept, length, entries, rows)
      type(facets_t), intent(in) :: slave
      integer, intent(in) :: kept(:)             !! nodes of the surface
      real(wp), intent(in) :: length(:)          !! (node of the surface) int psi_k [L^2]
      type(entries_t), intent(in) :: entries
      type(tie_rows_t), intent(inout) :: rows
      integer, allocatable :: order(:)
      integer :: k, n, first, last

      allocate(order, source=sort_order(entries%row(:entries%n)))
      rows%slave = slave%node(kept)
      rows%size = length(kept)
      allocate(rows%start(size(kept) + 1), source=0)
      allocate(rows%node(entries%n + size(kept)), rows%weight(entries%n + size(kept)))
      n = 0
      last = 0
      do k = 1, size(kept)
         first = last + 1
         do while (last < entries%n)
            if (entries%row(order(last + 1)) /= kept(k)) exit
            last = last + 1
         end do
         call merge_entries(entries, order(first:last), rows, k, n)
         rows%start(k + 1) = n
      end do
      rows%node = rows%node(:n)
      rows%weight = rows%weight(:n)
   end subroutine fill_rows

   !> Append row `k`, made of the entries `part`.
   pure subroutine merge_entries(entries, part, rows, k, n)
      type(entries_t), intent(in) :: entries
      integer, intent(in) :: part(:)
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(in) :: k
      integer, intent(inout) :: n                !! entries of all rows so far
      integer :: order(size(part)), i, own
      real(wp) :: total

      order = part(sort_order(entries%node(part)))
      n = n + 1
      own = n
      rows%node(own) = rows%slave(k)
      total = 0.0_wp
      do i = 1, size(order)
         associate (node => entries%node(order(i)))
            total = total + entries%weight(order(i))
            if (i < size(order)) then
               if (entries%node(order(i + 1)) == node) cycle
            end if
            if (abs(total) > rounding*rows%size(k) .and. node /= rows%slave(k)) then
               n = n + 1
               rows%node(n) = node
               rows%weight(n) = total
            end if
         end associate
         total = 0.0_wp
      end do
      rows%weight(own) = 0.0_wp
      do i = n, own + 1, -1
         rows%weight(own) = rows%weight(own) - rows%weight(i)
      end do
   end subroutine merge_entries

   !> The master facets that are covered as a whole, by their nodes.
   pure subroutine find_covered(master, cells, rows)
      type(tie_side_t), intent(in) :: master
      type(tie_cells_t), intent(in) :: cells(:)
      type(tie_rows_t), intent(inout) :: rows
      real(wp) :: area(master%facets%n_facet), corner(3, 3), whole(master%facets%n_facet)
      integer :: f, i

      area = 0.0_wp
      whole = 0.0_wp
      do i = 1, size(master%split%facet)
         corner = triangle_at(master, i)
         associate (here => whole(master%split%facet(i)))
            here = here + 0.5_wp*norm2(cross_product(corner(:, 2) - corner(:, 1), &
               corner(:, 3) - corner(:, 1)))
         end associate
      end do
      do f = 1, size(cells)
         do i = 1, cells(f)%n
            associate (here => area(master%split%facet(cells(f)%triangle(i))))
               here = here + cells(f)%area(i)
            end associate
         end do
      end do
      rows%covered = master%facets%facet(:, pack([(f, f = 1, size(area))], &
         area >= (1.0_wp - free_part)*whole))
   end subroutine find_covered

end module emcon_tie_space
