! build: elements
!> Slip of mortar contact in space over a step: how slave facets go over what they cover, in the
!> mean with the weight of each of their vertices.
!>
!> Over each triangle of the master it is the slip of nodes, of the points of the slave's triangle
!> above it, with the weights that the gap gives them; these are kept over the step. Source:
!> docs/theory.md, section 14.3.
module emcon_mortar_slip_space
   use emcon_constraint, only : condition_t, most_slips
   use emcon_frame_slip_space, only : frame_slip, frame_slip_t, slip_axis_t
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_t
   use emcon_mortar_slave_space, only : mortar_slave_weight
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_patch_look_space, only : patch_cells
   use emcon_patch_places_space, only : patch_stencil_gather
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: mortar_slip_t, mortar_slip_choose, mortar_slip_shift, mortar_slip_of, &
      slip_sight_t, mortar_slip_sight, mortar_slip_add

   !> What the slip of a slave triangle is made of in a step: cells, where triangles of the master
   !> are below it.
   type :: mortar_slip_t
      real(wp) :: theta = 0.0_wp                 !! how dual the multipliers of its facet are
      integer, allocatable :: vertex(:, :)       !! (3, n_cell) of its stencil, those of each
      integer, allocatable :: point(:, :)        !! (as `vertex`) of the master
      !> (3, 3, n_cell) integrals of products of the weights that are 1 at one corner [L^2]
      real(wp), allocatable :: products(:, :, :)
   end type mortar_slip_t

   !> Where the vertices of a triangle's stencil are.
   type :: slip_sight_t
      integer, allocatable :: vertex(:)          !! of the stencil, all that slip is over
      real(wp), allocatable :: at(:, :), way(:, :)   !! of `patch_stencil_gather` [L]
   end type slip_sight_t

   !> The triangles of the master that a constraint slides over: frames, and the sum of ways from
   !> their origins to points of the slave by weights.
   type :: slip_cells_t
      integer :: n = 0
      real(wp) :: total = 0.0_wp                 !! of what is covered, with its weight [L^2]
      integer, allocatable :: point(:, :)        !! (3, >= n)
      real(wp), allocatable :: at(:, :, :), way(:, :, :)   !! (3, 4, >= n) as `frame_slip` [L]
      real(wp), allocatable :: weight(:, :, :)   !! (n_node, 3, >= n) of nodes in these vectors
   end type slip_cells_t

contains

   !> What slips of the triangles of the slave are made of over a motion, with the weights of gaps:
   !> between those at its start and those at its end.
   pure subroutine mortar_slip_choose(self, faces, x, u0, du, place)
      type(mortar_slip_t), intent(inout) :: self(:)   !! (n_triangle) of the slave
      type(mortar_faces_t), intent(in) :: faces       !! with their stencils
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: place                   !! 0: at its start, 1: at its end; between
      real(wp) :: part, covered
      integer :: f, t

      do f = 1, faces%sides%slave%n_facet
         associate (first => faces%split%start(f), last => faces%split%start(f + 1) - 1)
            part = 0.0_wp
            do t = first, last
               call choose_triangle(self(t), faces%stencil(t), x, u0, du, place, covered)
               part = part + covered/real(last - first + 1, wp)
            end do
            self(first:last)%theta = merge(part**3, 0.0_wp, faces%is_dual)
         end associate
      end do
   end subroutine mortar_slip_choose

   !> That of one triangle; none where nothing is near it.
   pure subroutine choose_triangle(self, stencil, x, u0, du, place, covered)
      type(mortar_slip_t), intent(inout) :: self
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: place
      real(wp), intent(out) :: covered           !! a part of its area
      real(wp), dimension(3, 3 + stencil%patch%n_vertex) :: at, way
      real(wp), dimension(3, 3, stencil%patch%n_triangle) :: products, start
      real(wp) :: area(0:1)
      integer, allocatable :: cell(:)
      integer :: k

      products = 0.0_wp
      area = 0.0_wp
      covered = 0.0_wp
      if (stencil%triangle > 0) then
         call patch_stencil_gather(stencil, x, u0, du, at, way)
         start = 0.0_wp
         if (place < 1.0_wp) call patch_cells(stencil%patch, at, start, area(0))
         call patch_cells(stencil%patch, at + way, products, area(1))
         products = (1.0_wp - place)*start + place*products
         area(1) = (1.0_wp - place)*area(0) + place*area(1)
         if (area(1) > 0.0_wp) covered = sum(products)/area(1)
      end if
      cell = pack([(k, k = 1, size(products, 3))], &
         [(sum(products(:, :, k)) > 0.0_wp, k = 1, size(products, 3))])
      self%products = products(:, :, cell)
      if (size(cell) == 0) then
         self%vertex = reshape(cell, [3, 0])
         self%point = self%vertex
      else
         self%vertex = stencil%patch%triangle(:, cell)
         self%point = reshape(stencil%point([self%vertex]), shape(self%vertex))
      end if
   end subroutine choose_triangle

   !> The integrals of the multiplier of constraint place `k` over the cells of its triangle, with
   !> the weights that are 1 at one corner of that.
   pure function moments_of(self, faces, k) result(moment)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: k
      real(wp) :: moment(3, size(self(faces%triangle(k))%vertex, 2))
      integer :: c

      associate (own => self(faces%triangle(k)))
         do c = 1, size(moment, 2)
            moment(:, c) = matmul(own%products(:, :, c), mortar_slave_weight(faces, k, own%theta))
         end do
      end associate
   end function moments_of

   !> What of the facets at constraint `i` is covered, with its weight [L^2].
   pure real(wp) function total_of(self, faces, i) result(total)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      integer :: k

      total = 0.0_wp
      do k = faces%start(i), faces%start(i + 1) - 1
         total = total + sum(moments_of(self, faces, k))
      end do
   end function total_of

   !> How much of the slip of constraint `i` is over other triangles of the master by one choice
   !> than by the one before.
   pure real(wp) function mortar_slip_shift(self, before, faces, i) result(shift)
      type(mortar_slip_t), intent(in) :: self(:), before(:)   !! (n_triangle) of the slave
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp) :: total, old_total
      integer :: c, k, old

      shift = 0.0_wp
      total = total_of(self, faces, i)
      old_total = total_of(before, faces, i)
      if (.not. min(total, old_total) > 0.0_wp) return
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (now => self(faces%triangle(k))%point, was => before(faces%triangle(k))%point, &
               part => sum(moments_of(self, faces, k), 1)/total, &
               old_part => sum(moments_of(before, faces, k), 1)/old_total)
            ! Half of what comes and half of what goes.
            do c = 1, size(part)
               old = find_cell(was, now(:, c))
               if (old > 0) shift = shift + 0.5_wp*abs(part(c) - old_part(old))
               if (old == 0) shift = shift + 0.5_wp*abs(part(c))
            end do
            do c = 1, size(old_part)
               if (find_cell(now, was(:, c)) == 0) shift = shift + 0.5_wp*abs(old_part(c))
            end do
         end associate
      end do
   end function mortar_slip_shift

   !> The cell over some points; 0: none.
   pure integer function find_cell(list, point) result(c)
      integer, intent(in) :: list(:, :), point(3)

      do c = size(list, 2), 1, -1
         if (all(list(:, c) == point)) return
      end do
   end function find_cell

   !> Where the vertices below a triangle are.
   pure subroutine mortar_slip_sight(self, stencil, x, u0, du, sight)
      type(mortar_slip_t), intent(in) :: self
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      type(slip_sight_t), intent(out) :: sight
      integer :: j

      if (size(self%vertex) == 0) return
      associate (n => stencil%patch%n_vertex)
         allocate(sight%at(3, 3 + n), sight%way(3, 3 + n))
         call patch_stencil_gather(stencil, x, u0, du, sight%at, sight%way)
         sight%vertex = pack([(j, j = 1, n)], [(any(self%vertex == j), j = 1, n)])
      end associate
   end subroutine mortar_slip_sight

   !> Add the cells of place `k` of a constraint, as triangle `t` of the slave sees them, to those
   !> of the places before it: of one triangle of the master the ways to all points of the slave
   !> are summed up, as slip is linear in them. `end_cells` divides by the total.
   pure subroutine add_cells(cells, self, stencil, sight, moment, node)
      type(slip_cells_t), intent(inout) :: cells
      type(mortar_slip_t), intent(in) :: self
      type(patch_stencil_t), intent(in) :: stencil
      type(slip_sight_t), intent(in) :: sight
      real(wp), intent(in) :: moment(:, :)       !! (3, n_cell) of `moments_of`
      integer, intent(in) :: node(:)             !! (n_node) of the condition; none: no weights
      real(wp) :: part(3), own
      integer :: c, j, place(stencil%n_node)

      place = 0
      if (size(node) > 0) then
         do j = 1, stencil%n_node
            place(j) = findloc(node, stencil%node(j), 1)
         end do
      end if
      do c = 1, size(moment, 2)
         own = moment(1, c) + moment(2, c) + moment(3, c)
         part(:2) = moment(2:, c) - own/3.0_wp
         part(3) = -own
         call add_cell(cells, self, stencil, sight, place, c, part)
         cells%total = cells%total + own
      end do
   end subroutine add_cells

   !> Ways by the total; no cells if there is none.
   pure subroutine end_cells(cells)
      type(slip_cells_t), intent(inout) :: cells

      if (.not. cells%total > 0.0_wp) cells%n = 0
      if (cells%n == 0) return
      cells%at(:, 4, :) = cells%at(:, 4, :)/cells%total
      cells%way(:, 4, :) = cells%way(:, 4, :)/cells%total
      cells%weight(:, 3, :) = cells%weight(:, 3, :)/cells%total
   end subroutine end_cells

   !> Add cell `c` of a triangle of the slave.
   pure subroutine add_cell(cells, self, stencil, sight, place, c, part)
      type(slip_cells_t), intent(inout) :: cells
      type(mortar_slip_t), intent(in) :: self
      type(patch_stencil_t), intent(in) :: stencil
      type(slip_sight_t), intent(in) :: sight
      integer, intent(in) :: place(:)            !! of its nodes in the condition; 0: none
      integer, intent(in) :: c
      !> Of both vectors of the slave's triangle, from whose middle ways count, and of the first
      !> corner of the master's
      real(wp), intent(in) :: part(3)
      integer :: l, m, column(3)
      logical :: is_new

      m = 0
      ! Flanges are made of what one triangle of the slave sees.
      if (all(self%point(:, c) > 0)) m = find_cell(cells%point(:, :cells%n), self%point(:, c))
      is_new = m == 0
      if (is_new) then
         cells%n = cells%n + 1
         m = cells%n
         cells%point(:, m) = self%point(:, c)
      end if
      associate (v => self%vertex(:, c), at => cells%at(:, :, m), way => cells%way(:, :, m), &
            weight => cells%weight(:, :, m))
         column = [1, 2, 2 + v(1)]
         do l = 1, 3
            if (is_new .and. l > 1) then
               at(:, l) = sight%at(:, 3 + v(l)) - sight%at(:, 3 + v(1))
               way(:, l) = sight%way(:, 3 + v(l)) - sight%way(:, 3 + v(1))
            end if
            at(:, 4) = at(:, 4) + part(l)*sight%at(:, 1 + column(l))
            way(:, 4) = way(:, 4) + part(l)*sight%way(:, 1 + column(l))
         end do
         if (size(weight, 1) == 0) return
         if (is_new) then
            call add_weight(1.0_wp, stencil%weight(:, 2 + v(2)), place, weight(:, 1))
            call add_weight(1.0_wp, stencil%weight(:, 2 + v(3)), place, weight(:, 2))
            call add_weight(-1.0_wp, stencil%weight(:, 2 + v(1)), place, weight(:, 1))
            call add_weight(-1.0_wp, stencil%weight(:, 2 + v(1)), place, weight(:, 2))
         end if
         do l = 1, 3
            call add_weight(part(l), stencil%weight(:, column(l)), place, weight(:, 3))
         end do
      end associate
   end subroutine add_cell

   !> Add a part of the weights of a stencil's nodes; ways count from its first one.
   pure subroutine add_weight(part, by, place, weight)
      real(wp), intent(in) :: part
      real(wp), intent(in) :: by(:)              !! of the nodes of the stencil
      integer, intent(in) :: place(:)            !! of these in the condition; 0: none
      real(wp), intent(inout) :: weight(:)       !! (n_node) of the condition
      integer :: l

      do l = 2, size(place)
         if (.not. abs(by(l)) > 0.0_wp) cycle
         weight(place(l)) = weight(place(l)) + part*by(l)
         weight(place(1)) = weight(place(1)) - part*by(l)
      end do
   end subroutine add_weight

   !> Room for the cells of constraint `i`.
   pure subroutine begin_cells(cells, self, faces, i, n_node)
      type(slip_cells_t), intent(out) :: cells
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i, n_node
      integer :: k, most

      most = 0
      do k = faces%start(i), faces%start(i + 1) - 1
         most = most + size(self(faces%triangle(k))%vertex, 2)
      end do
      allocate(cells%point(3, most), source=0)
      allocate(cells%at(3, 4, most), cells%way(3, 4, most), cells%weight(n_node, 3, most), &
         source=0.0_wp)
   end subroutine begin_cells

   !> The slip of constraint `i` [L].
   pure function mortar_slip_of(self, faces, i, x, u0, du, axis) result(slip)
      type(mortar_slip_t), intent(in) :: self(:) !! (n_triangle) of the slave
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      type(slip_axis_t), intent(in) :: axis
      real(wp) :: slip(most_slips)
      integer, parameter :: no_node(0) = 0
      type(slip_sight_t) :: sight
      type(slip_cells_t) :: cells
      type(frame_slip_t) :: cell
      integer :: c, k

      slip = 0.0_wp
      call begin_cells(cells, self, faces, i, 0)
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            call mortar_slip_sight(self(t), faces%stencil(t), x, u0, du, sight)
            call add_cells(cells, self(t), faces%stencil(t), sight, moments_of(self, faces, k), &
               no_node)
         end associate
      end do
      call end_cells(cells)
      do c = 1, cells%n
         call frame_slip(cells%at(:, :, c), cells%way(:, :, c), axis, .true., cell)
         slip = slip + cell%f
      end do
   end function mortar_slip_of

   !> Add the slip of constraint `i` and its derivatives to its condition, which has all nodes of
   !> it, and room for slip.
   pure subroutine mortar_slip_add(self, faces, i, slot, sight, axis, item)
      type(mortar_slip_t), intent(in) :: self(:) !! (n_triangle) of the slave
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      integer, intent(in) :: slot(:)             !! (n_triangle) where each is in `sight`
      type(slip_sight_t), intent(in) :: sight(:) !! what triangles see
      type(slip_axis_t), intent(in) :: axis
      type(condition_t), intent(inout) :: item
      type(slip_cells_t) :: cells
      type(frame_slip_t) :: cell
      integer :: c, k

      call begin_cells(cells, self, faces, i, item%n_node)
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            call add_cells(cells, self(t), faces%stencil(t), sight(slot(t)), &
               moments_of(self, faces, k), item%node(:item%n_node))
         end associate
      end do
      call end_cells(cells)
      do c = 1, cells%n
         call frame_slip(cells%at(:, :, c), cells%way(:, :, c), axis, item%leaves_second, cell)
         call spread_cell(cell, cells%weight(:, :, c), item)
      end do
   end subroutine mortar_slip_add

   !> Add that of one triangle of the master, of ways with these weights of the nodes: their sums
   !> are 0, so that of the first node says nothing more.
   pure subroutine spread_cell(slip, weight, item)
      type(frame_slip_t), intent(in) :: slip
      real(wp), intent(in) :: weight(:, :)       !! (n_node, 3)
      type(condition_t), intent(inout) :: item
      real(wp) :: own(size(weight, 1), 3)
      integer :: place(size(weight, 1)), j, n, s

      n = 1
      place(1) = 1
      do j = 2, size(weight, 1)
         if (.not. any(abs(weight(j, :)) > 0.0_wp)) cycle
         n = n + 1
         place(n) = j
         own(n - 1, :) = weight(j, :)
      end do
      do s = 1, size(slip%f)
         item%slip(s) = item%slip(s) + slip%f(s)
         call node_sums_first(slip%g(:, s), own(:n - 1, :), 1.0_wp, place(:n), item%t(:, :, s))
         call node_sums_first(slip%c(:, s), own(:n - 1, :), 1.0_wp, place(:n), item%t1(:, :, s))
         if (item%leaves_second) cycle
         call node_sums_second(slip%h(:, :, s), own(:n - 1, :), 1.0_wp, place(:n), &
            item%ht(:, :, s))
      end do
   end subroutine spread_cell

end module emcon_mortar_slip_space
