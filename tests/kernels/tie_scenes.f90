!> Lines and circles of edges to be tied, and what holds for the rows of every tie.
module tie_scenes
   use check, only : check_equal, check_near, check_true
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_element_registry, only : find_element_row
   use emcon_errors, only : error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_tie_plane, only : tie_measure
   use random_draws, only : draw_random
   use small_scenes, only : scene_begin
   implicit none
   private
   public :: add_line, make_straight, make_disc, rotate, along_x, even, uneven
   public :: measure, row_sum, entry, check_rows, check_positions
   public :: multipliers, tol

   real(wp), parameter :: pi = acos(-1.0_wp)
   !> A row of n entries sums up in any order to at most n roundings of its absolute sum, which is
   !> below 4 times its size; rows here have up to 200 entries, of which only a few are large.
   real(wp), parameter :: sum_tol = 64.0_wp*epsilon(1.0_wp)
   !> Entries, and moments of them, carry some 100 roundings of the size and the extent named.
   real(wp), parameter :: tol = 128.0_wp*epsilon(1.0_wp)
   integer, parameter :: multipliers(2) = [multiplier_dual, multiplier_standard]

contains

   ! ---- scenes ---------------------------------------------------------------------------------

   !> Add a body of triangles to the left of the line through `points`, one for each edge, and the
   !> surface `name` of these edges. Nodes of the line come first.
   subroutine add_line(scene, name, points, is_closed)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: points(:, :)       !! (2, n)
      logical, intent(in), optional :: is_closed
      type(surface_t) :: surface
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: node(:, :)
      real(wp) :: a(2)
      integer :: i, n, n_edge, last, n_old, n_element

      n = size(points, 2)
      n_edge = n - 1
      if (present(is_closed)) n_edge = merge(n, n - 1, is_closed)
      n_old = size(scene%x, 2)
      n_element = size(scene%element%kind)
      allocate(x(2, n_old + n + n_edge), node(4, n_element + n_edge))
      x(:, :n_old) = scene%x
      x(:, n_old + 1:n_old + n) = points
      node(:, :n_element) = scene%element%node
      do i = 1, n_edge
         last = mod(i, n) + 1
         a = points(:, last) - points(:, i)
         x(:, n_old + n + i) = points(:, i) + 0.5_wp*a + 0.5_wp*[-a(2), a(1)]
         node(:, n_element + i) = [n_old + i, n_old + last, n_old + n + i, 0]
      end do
      call move_alloc(x, scene%x)
      call move_alloc(node, scene%element%node)
      surface%name = name
      allocate(surface%element(n_edge), surface%face(n_edge))
      do i = 1, n_edge
         surface%element(i) = n_element + i
         surface%face(i) = 1
      end do
      scene%surface = [scene%surface, surface]
      n_element = n_element + n_edge
      n = size(scene%x, 2)
      deallocate(scene%element%kind, scene%element%section, scene%node%label)
      allocate(scene%element%kind(n_element), source=find_element_row("CPE3"))
      allocate(scene%element%section(n_element), source=1)
      allocate(scene%node%label(n), source=[(i, i = 1, n)])
   end subroutine add_line

   !> Surface 1 is the slave: a line along x, its body above. Surface 2 is the master below it.
   subroutine make_straight(scene, slave, master)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: slave(:)           !! ascending
      real(wp), intent(in) :: master(:)          !! descending

      call scene_begin(scene)
      call add_line(scene, "UPPER", along_x(slave))
      call add_line(scene, "LOWER", along_x(master))
   end subroutine make_straight

   pure function along_x(place) result(points)
      real(wp), intent(in) :: place(:)
      real(wp) :: points(2, size(place))

      points(1, :) = place
      points(2, :) = 0.0_wp
   end function along_x

   !> n + 1 places from `first` to `last`, evenly spread.
   pure function even(n, first, last) result(place)
      integer, intent(in) :: n
      real(wp), intent(in) :: first, last
      real(wp) :: place(n + 1)
      integer :: i

      do i = 0, n
         place(i + 1) = first + (last - first)*real(i, wp)/real(n, wp)
      end do
      place(n + 1) = last
   end function even

   !> n + 1 places from `first` to `last`, each moved by up to 0.4 of the spacing.
   function uneven(n, first, last) result(place)
      integer, intent(in) :: n
      real(wp), intent(in) :: first, last
      real(wp) :: place(n + 1), r(n + 1)

      place = even(n, first, last)
      call draw_random(r)
      place(2:n) = place(2:n) + 0.8_wp*(r(2:n) - 0.5_wp)*(last - first)/real(n, wp)
   end function uneven

   !> Nodes of a circle around the origin, counter-clockwise or, for a hole, clockwise.
   pure function circle(n, radius, phase, is_hole) result(points)
      integer, intent(in) :: n
      real(wp), intent(in) :: radius, phase      !! [L], edges
      logical, intent(in) :: is_hole
      real(wp) :: points(2, n)
      real(wp) :: angle
      integer :: i

      do i = 1, n
         angle = 2.0_wp*pi*(real(i, wp) + phase)/real(n, wp)
         if (is_hole) angle = -angle
         points(:, i) = radius*[cos(angle), sin(angle)]
      end do
   end function circle

   !> A disc in a hole, both of radius 1; the slave is the disc or, else, the hole.
   subroutine make_disc(scene, n_disc, n_hole, phase, is_disc_slave)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n_disc, n_hole
      real(wp), intent(in) :: phase
      logical, intent(in) :: is_disc_slave

      call scene_begin(scene)
      if (is_disc_slave) call add_line(scene, "DISC", circle(n_disc, 1.0_wp, phase, .false.), &
         .true.)
      call add_line(scene, "HOLE", circle(n_hole, 1.0_wp, 0.0_wp, .true.), .true.)
      if (.not. is_disc_slave) call add_line(scene, "DISC", circle(n_disc, 1.0_wp, phase, &
         .false.), .true.)
   end subroutine make_disc

   !> Rotate a scene by `angle`.
   pure subroutine rotate(scene, angle)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: angle
      real(wp) :: turn(2, 2)

      turn = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
      scene%x = matmul(turn, scene%x)
   end subroutine rotate

   !> Rows of the tie of surface 1, the slave, to surface 2.
   subroutine measure(scene, multiplier, rows, error, tolerance)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: multiplier
      type(tie_rows_t), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: tolerance
      type(tie_t) :: tie

      tie%name = "SEAM"
      tie%slave = 1
      tie%master = 2
      tie%multiplier = multiplier
      if (present(tolerance)) tie%tolerance = tolerance
      call tie_measure(scene, tie, rows, error)
   end subroutine measure

   ! ---- properties -----------------------------------------------------------------------------

   !> Sum of weight times value over the entries of row `k`.
   pure real(wp) function row_sum(rows, k, value)
      type(tie_rows_t), intent(in) :: rows
      integer, intent(in) :: k
      real(wp), intent(in) :: value(:)           !! by node of the scene
      integer :: i

      row_sum = 0.0_wp
      do i = rows%start(k) + 1, rows%start(k + 1)
         row_sum = row_sum + rows%weight(i)*value(rows%node(i))
      end do
   end function row_sum

   !> The weight of `node` in row `k`, 0 if it is not there.
   pure real(wp) function entry(rows, k, node)
      type(tie_rows_t), intent(in) :: rows
      integer, intent(in) :: k, node
      integer :: i

      entry = 0.0_wp
      do i = rows%start(k) + 1, rows%start(k + 1)
         if (rows%node(i) == node) entry = entry + rows%weight(i)
      end do
   end function entry

   !> What holds for all rows: zero sum, the slave node first, no node twice, no zero weight,
   !> sizes that add up to the length of the slave surface.
   subroutine check_rows(scene, rows, length, error)
      type(scene_t), intent(in) :: scene
      type(tie_rows_t), intent(in) :: rows
      real(wp), intent(in) :: length             !! of the slave surface
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: one(size(scene%x, 2))
      integer :: k, i

      one = 1.0_wp
      call check_equal(error, size(rows%weight), rows%start(size(rows%start)), "entries")
      do k = 1, size(rows%slave)
         call check_equal(error, rows%node(rows%start(k) + 1), rows%slave(k), "first entry")
         call check_near(error, row_sum(rows, k, one), 0.0_wp, sum_tol, rows%size(k), &
            "sum of row " // to_text(k))
         call check_true(error, rows%size(k) > 0.0_wp, "size of row " // to_text(k) // " > 0")
         associate (node => rows%node(rows%start(k) + 1:rows%start(k + 1)))
            do i = 2, size(node)
               call check_true(error, all(node(:i - 1) /= node(i)), "row " // to_text(k) // &
                  " has each node once")
            end do
         end associate
      end do
      call check_true(error, all(rows%weight /= 0.0_wp), "no weight is zero")
      call check_near(error, sum(rows%size), length, tol, length, "sizes add up to the length")
   end subroutine check_rows

   !> Rows annihilate the positions, as they do where both surfaces are one straight line.
   subroutine check_positions(scene, rows, extent, error)
      type(scene_t), intent(in) :: scene
      type(tie_rows_t), intent(in) :: rows
      real(wp), intent(in) :: extent             !! of the surfaces
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, a

      do k = 1, size(rows%slave)
         do a = 1, 2
            call check_near(error, row_sum(rows, k, scene%x(a, :)), 0.0_wp, tol, &
               extent*rows%size(k), "positions in row " // to_text(k))
         end do
      end do
   end subroutine check_positions

end module tie_scenes
