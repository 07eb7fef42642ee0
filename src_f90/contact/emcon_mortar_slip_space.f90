!> Slip of mortar contact in space over a step: how slave facets go over what they cover, in the
!> mean with the weight of each of their vertices.
!>
!> Over each triangle of the master it is the slip of nodes, of the points of the slave's triangle
!> above it, with the weights that the gap gives them; these are kept over the step. Source:
!> docs/theory.md, section 15.3.
module emcon_mortar_slip_space
   use emcon_constraint, only : condition_t, most_slips
   use emcon_frame_slip_space, only : frame_slip, frame_slip_t
   use emcon_frame_vertex_space, only : n_frame_var
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_direction, mortar_faces_t, mortar_faces_weight
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_patch_look_space, only : patch_cells
   use emcon_patch_spread_space, only : patch_uses
   use emcon_patch_stencil_space, only : patch_stencil_gather, patch_stencil_t
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

contains

   !> What slips of the triangles of the slave are made of over a motion, with the weights of gaps:
   !> the mean of those at its start and its end, or those at its end.
   pure subroutine mortar_slip_choose(self, faces, x, u0, du, is_at_end)
      type(mortar_slip_t), intent(inout) :: self(:)   !! (n_triangle)
      type(mortar_faces_t), intent(in) :: faces       !! with their stencils
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      logical, intent(in) :: is_at_end                !! forces act at the end of the motion alone
      real(wp) :: part, covered
      integer :: f, t

      do f = 1, faces%sides%slave%n_facet
         associate (first => faces%split%start(f), last => faces%split%start(f + 1) - 1)
            part = 0.0_wp
            do t = first, last
               call choose_triangle(self(t), faces%stencil(t), x, u0, du, is_at_end, covered)
               part = part + covered/real(last - first + 1, wp)
            end do
            self(first:last)%theta = merge(part**3, 0.0_wp, faces%is_dual)
         end associate
      end do
   end subroutine mortar_slip_choose

   !> That of one triangle; none where nothing is near it.
   pure subroutine choose_triangle(self, stencil, x, u0, du, is_at_end, covered)
      type(mortar_slip_t), intent(inout) :: self
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      logical, intent(in) :: is_at_end
      real(wp), intent(out) :: covered           !! a part of its area
      real(wp), dimension(3, 3 + stencil%patch%n_vertex) :: at, way
      real(wp), dimension(3, 3, stencil%patch%n_triangle) :: products, start
      real(wp) :: area(2)
      integer, allocatable :: cell(:)
      integer :: k

      products = 0.0_wp
      area = 0.0_wp
      covered = 0.0_wp
      if (stencil%triangle > 0) then
         call patch_stencil_gather(stencil, x, u0, du, at, way)
         call patch_cells(stencil%patch, at + way, products, area(1))
         if (.not. is_at_end) then
            call patch_cells(stencil%patch, at, start, area(2))
            products = 0.5_wp*(products + start)
            area(1) = 0.5_wp*sum(area)
         end if
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
            moment(:, c) = matmul(own%products(:, :, c), mortar_faces_weight(faces, k, own%theta))
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
      type(mortar_slip_t), intent(in) :: self(:), before(:)
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

   !> How much there is of the vectors of a slave triangle's frame, and of the first corner of a
   !> cell's triangle, in the way from that to the points of the slave, summed up by their weights.
   pure function way_parts(moment) result(part)
      real(wp), intent(in) :: moment(3)          !! of the cell [L^2]
      real(wp) :: part(3)

      part = [moment(2:) - sum(moment)/3.0_wp, -sum(moment)]
   end function way_parts

   !> The slip of a cell times its weight.
   pure type(frame_slip_t) function slip_of_cell(sight, vertex, moment, along, leaves_second) &
         result(slip)
      type(slip_sight_t), intent(in) :: sight
      integer, intent(in) :: vertex(3)
      real(wp), intent(in) :: moment(3)
      real(wp), intent(in) :: along(3)
      logical, intent(in) :: leaves_second

      call frame_slip(gathered(sight%at), gathered(sight%way), along, leaves_second, slip)

   contains

      !> From the first corner of the triangle: the sides there, and the sum of ways to points.
      pure function gathered(x) result(frame)
         real(wp), intent(in) :: x(:, :)
         real(wp) :: frame(3, 4)

         frame(:, 1) = 0.0_wp
         frame(:, 2) = x(:, 3 + vertex(2)) - x(:, 3 + vertex(1))
         frame(:, 3) = x(:, 3 + vertex(3)) - x(:, 3 + vertex(1))
         associate (part => way_parts(moment))
            frame(:, 4) = part(1)*x(:, 2) + part(2)*x(:, 3) + part(3)*x(:, 3 + vertex(1))
         end associate
      end function gathered

   end function slip_of_cell

   !> The slip of constraint `i` [L].
   pure function mortar_slip_of(self, faces, i, x, u0, du) result(slip)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(most_slips)
      real(wp) :: along(3), total
      type(slip_sight_t) :: sight
      type(frame_slip_t) :: cell
      integer :: c, k

      slip = 0.0_wp
      total = total_of(self, faces, i)
      if (.not. total > 0.0_wp) return
      along = mortar_faces_direction(faces, i, x, u0)
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k), moment => moments_of(self, faces, k)/total)
            call mortar_slip_sight(self(t), faces%stencil(t), x, u0, du, sight)
            do c = 1, size(moment, 2)
               cell = slip_of_cell(sight, self(t)%vertex(:, c), moment(:, c), along, .true.)
               slip = slip + cell%f
            end do
         end associate
      end do
   end function mortar_slip_of

   !> Add the slip of constraint `i` and its derivatives to its condition, which has all nodes of
   !> it, and room for slip.
   pure subroutine mortar_slip_add(self, faces, i, sight, along, item)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      type(slip_sight_t), intent(in) :: sight(:) !! (n_triangle)
      real(wp), intent(in) :: along(3)           !! of `mortar_faces_direction`
      type(condition_t), intent(inout) :: item
      real(wp) :: total
      integer :: c, k

      total = total_of(self, faces, i)
      if (.not. total > 0.0_wp) return
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k), moment => moments_of(self, faces, k)/total)
            do c = 1, size(moment, 2)
               call add_cell(slip_of_cell(sight(t), self(t)%vertex(:, c), moment(:, c), along, &
                  item%leaves_second), faces%stencil(t), self(t)%vertex(:, c), &
                  way_parts(moment(:, c)), item)
            end do
         end associate
      end do
   end subroutine mortar_slip_add

   !> Add that of one cell.
   pure subroutine add_cell(slip, stencil, vertex, part, item)
      type(frame_slip_t), intent(in) :: slip
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: vertex(3)
      real(wp), intent(in) :: part(3)            !! of `way_parts`
      type(condition_t), intent(inout) :: item
      real(wp), allocatable :: weight(:, :)
      integer, allocatable :: place(:), row(:)
      integer :: j, s

      row = pack([(j, j = 1, stencil%n_node)], patch_uses(stencil, vertex))
      place = [(findloc(item%node(:item%n_node), stencil%node(row(j)), 1), j = 1, size(row))]
      allocate(weight(size(row) - 1, n_frame_var/3))
      associate (by => stencil%weight(row(2:), 2 + vertex), frame => stencil%weight(row(2:), :2))
         weight(:, 1) = by(:, 2) - by(:, 1)
         weight(:, 2) = by(:, 3) - by(:, 1)
         weight(:, 3) = matmul(frame, part(:2)) + part(3)*by(:, 1)
      end associate
      do s = 1, size(slip%f)
         item%slip(s) = item%slip(s) + slip%f(s)
         call node_sums_first(slip%g(:, s), weight, 1.0_wp, place, item%t(:, :, s))
         call node_sums_first(slip%c(:, s), weight, 1.0_wp, place, item%t1(:, :, s))
         if (.not. item%leaves_second) call node_sums_second(slip%h(:, :, s), weight, 1.0_wp, &
            place, item%ht(:, :, s))
      end do
   end subroutine add_cell

end module emcon_mortar_slip_space
