!> Constraint rows of ties in space: closed forms, linear fields, sums, nodes between corners.
module test_tie_space
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : err_input, error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_tie_multipliers_space, only : tie_multipliers_find, tie_multipliers_t
   use emcon_tie_space, only : tie_measure_space
   use random_draws, only : draw_random
   use space_scenes, only : add_box, space_begin
   implicit none
   private
   public :: collect_tie_space

   !> Entries, and moments of them, carry some 100 roundings of the size and the extent named.
   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)
   integer, parameter :: multipliers(2) = [multiplier_dual, multiplier_standard]
   character(len=4), parameter :: kinds(4) = ["C3D8", "C3D4", "C3D8", "C3D4"], &
      below(4) = ["C3D8", "C3D8", "C3D4", "C3D4"]

contains

   subroutine collect_tie_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("matching meshes", test_matching), &
         test_case_t("linear fields at any ratio", test_linear), &
         test_case_t("nodes that are held have no row", test_held), &
         test_case_t("a facet without a row of its own", test_lonely), &
         test_case_t("multipliers of a facet", test_multipliers), &
         test_case_t("what cannot be tied", test_errors)]
   end subroutine collect_tie_space

   !> Surface 1, the slave, is the bottom of a box at z >= 0, surface 2 the top of one below it;
   !> both on 0..2, 0..1.5. Nodes in the middle of the interface are moved along it by `shake`.
   subroutine make_boxes(scene, kind, n_upper, n_lower, shake)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: kind(2)
      integer, intent(in) :: n_upper(3), n_lower(3)
      real(wp), intent(in) :: shake
      real(wp) :: draw(2)
      integer :: i

      call space_begin(scene)
      call add_box(scene, kind(1), [0.0_wp, 0.0_wp, 0.0_wp], [2.0_wp, 1.5_wp, 1.0_wp], n_upper)
      call add_side(scene, "UPPER", 1)
      i = size(scene%element%kind)
      call add_box(scene, kind(2), [0.0_wp, 0.0_wp, -1.0_wp], [2.0_wp, 1.5_wp, 1.0_wp], n_lower)
      call add_side(scene, "LOWER", i + 1)
      do i = 1, size(scene%x, 2)
         if (scene%x(3, i) > 0.0_wp .or. scene%x(3, i) < 0.0_wp) cycle
         call draw_random(draw)
         if (min(scene%x(1, i), scene%x(2, i)) <= 0.0_wp .or. scene%x(1, i) >= 2.0_wp &
            .or. scene%x(2, i) >= 1.5_wp) cycle
         scene%x(:2, i) = scene%x(:2, i) + shake*(2.0_wp*draw - 1.0_wp)
      end do
   end subroutine make_boxes

   !> Add the surface of the faces at z = 0 of elements from `first` on.
   subroutine add_side(scene, name, first)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: first
      type(surface_t) :: surface
      integer :: e, f

      surface%name = name
      allocate(surface%element(0), surface%face(0))
      do e = first, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            do f = 1, kind%n_face
               if (any(abs(scene%x(3, scene%element%node(kind%face(f), e))) > 0.0_wp)) cycle
               surface%element = [surface%element, e]
               surface%face = [surface%face, f]
            end do
         end associate
      end do
      scene%surface = [scene%surface, surface]
   end subroutine add_side

   !> Rows of the tie of surface 1 to surface 2.
   subroutine measure(scene, multiplier, rows, error, held_below, shared_below)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: multiplier
      type(tie_rows_t), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: held_below   !! nodes with a lesser x are held along x
      real(wp), intent(in), optional :: shared_below     !! or in another tie too
      type(tie_t) :: tie
      logical :: is_held(3, size(scene%x, 2))
      integer :: n_tie(size(scene%x, 2))

      tie%name = "SEAM"
      tie%slave = 1
      tie%master = 2
      tie%multiplier = multiplier
      is_held = .false.
      if (present(held_below)) is_held(1, :) = scene%x(1, :) < held_below
      n_tie = 1
      if (present(shared_below)) where (scene%x(1, :) < shared_below) n_tie = 2
      call tie_measure_space(scene, tie, n_tie, is_held, rows, error)
   end subroutine measure

   !> Nodes that stand opposite each other are tied one to one.
   subroutine test_matching(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: k

      call make_boxes(scene, ["C3D8", "C3D8"], [3, 2, 1], [3, 2, 1], 0.0_wp)
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_equal(error, rows%start, [(2*k, k = 0, 12)], "two entries a row")
      if (allocated(error)) return
      do k = 1, 12
         call check_equal(error, rows%node(2*k - 1:2*k), [k, k + 36], "nodes of a row")
         call check_near(error, rows%weight(2*k - 1:2*k), rows%size(k)*[1.0_wp, -1.0_wp], tol, &
            rows%size(k), "weights of a row")
      end do
      call check_near(error, sum(rows%size), 3.0_wp, tol, 3.0_wp, "sizes are the area")
   end subroutine test_matching

   !> Linear fields pass unchanged, whatever the meshes; rows sum up to 0, sizes to the area. On a
   !> grid the entries of a master node add up to the load of a unit pressure.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n(6, 4) = reshape([2, 2, 1, 3, 3, 1, 3, 3, 1, 2, 2, 1, 4, 1, 1, 1, 5, &
         1, 1, 1, 1, 7, 6, 1], [6, 4])
      integer :: i, j, k

      do i = 1, size(n, 2)
         do k = 1, size(kinds)
            call make_boxes(scene, [kinds(k), below(k)], n(:3, i), n(4:, i), 0.05_wp)
            do j = 1, 2
               call measure(scene, multipliers(j), rows, error)
               if (allocated(error)) return
               call check_rows(scene, rows, error)
               if (allocated(error)) return
            end do
            if (below(k) /= "C3D8") cycle
            call make_boxes(scene, [kinds(k), below(k)], n(:3, i), n(4:, i), 0.0_wp)
            call measure(scene, multiplier_dual, rows, error)
            if (allocated(error)) return
            call check_loads(scene, rows, n(4:, i), error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_linear

   !> The loads of a master grid of `n` cells are quarters of the areas around each node.
   subroutine check_loads(scene, rows, n, error)
      type(scene_t), intent(in) :: scene
      type(tie_rows_t), intent(in) :: rows
      integer, intent(in) :: n(3)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: load(size(scene%x, 2)), area
      integer :: i, first, cells

      load = 0.0_wp
      do i = 1, size(rows%node)
         load(rows%node(i)) = load(rows%node(i)) - rows%weight(i)
      end do
      area = 3.0_wp/real(n(1)*n(2), wp)
      first = size(load) - product(n + 1)        ! the nodes of the master are the last ones
      do i = 1, size(load)
         if (i <= first .or. scene%x(3, i) < 0.0_wp) cycle
         cells = merge(1, 2, is_end(scene%x(1, i), 2.0_wp))*merge(1, 2, is_end(scene%x(2, i), &
            1.5_wp))
         call check_near(error, load(i), 0.25_wp*area*real(cells, wp), tol, 3.0_wp, "load")
      end do

   contains

      pure logical function is_end(x, length)
         real(wp), intent(in) :: x, length

         is_end = x <= 0.0_wp .or. x >= length
      end function is_end

   end subroutine check_loads

   !> Those at one side of the slave hand their multipliers on: of a part that would keep one line
   !> only, none does.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: n, k

      do n = 1, 4
         call make_boxes(scene, ["C3D8", "C3D8"], [n, 3, 1], [3, 2, 1], 0.05_wp)
         call measure(scene, multiplier_dual, rows, error, 0.1_wp)
         if (allocated(error)) return
         call check_equal(error, size(rows%slave), merge(8, 4*n, n == 1), "rows")
         if (n > 1) call check_true(error, all(scene%x(1, rows%slave) > 0.1_wp), "free nodes")
         call check_rows(scene, rows, error)
         if (allocated(error)) return
         if (n == 1) cycle
         do k = 1, size(rows%slave)              ! no kept node has another one in its row
            associate (node => rows%node(rows%start(k) + 2:rows%start(k + 1)))
               call check_true(error, all(node > size(scene%x, 2)/2 .or. &
                  scene%x(1, node) < 0.1_wp .or. node > 8*(n + 1)), "D is diagonal")
            end associate
         end do
      end do
   end subroutine test_held

   !> All four nodes of the first of three facets in a row are in another tie: it counts for the
   !> nearest of the nodes that are not, and the row of that is as large as a facet and its share.
   subroutine test_lonely(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows

      call make_boxes(scene, ["C3D8", "C3D8"], [3, 1, 1], [2, 2, 1], 0.05_wp)
      call measure(scene, multiplier_dual, rows, error, shared_below=1.0_wp)
      if (allocated(error)) return
      call check_equal(error, rows%slave, [3, 4, 7, 8], "rows")
      call check_rows(scene, rows, error)
      if (allocated(error)) return
      ! Facets of area 1: halves of the second one go to nodes 3 and 7, quarters of the third to
      ! all.
      call check_near(error, rows%size, [1.75_wp, 0.25_wp, 0.75_wp, 0.25_wp], tol, 1.0_wp, &
         "sizes")
   end subroutine test_lonely

   !> Whatever the integrals: multipliers sum up to 1, and are dual to what nodes stand for.
   subroutine test_multipliers(error)
      type(error_t), allocatable, intent(out) :: error
      type(tie_multipliers_t) :: self
      integer, parameter :: n_node(4) = [3, 4, 6, 8]
      logical, allocatable :: is_kept(:)
      real(wp), allocatable :: mass(:, :), draw(:, :)
      real(wp) :: largest
      integer :: i, j, m, n

      do i = 1, size(n_node)
         n = n_node(i)
         allocate(draw(n, n))
         call draw_random(draw)
         mass = 0.2_wp*matmul(draw, transpose(draw))
         do m = 1, n
            mass(m, m) = mass(m, m) + 1.0_wp
         end do
         do j = 1, 4
            is_kept = [(j == 1 .or. j == 4 .or. mod(m, j) == 0 .and. j < 3, m = 1, n)]
            call tie_multipliers_find(self, mass, is_kept, j /= 4)
            call check_equal(error, self%n, merge(1, count(is_kept), j == 3), "multipliers")
            largest = maxval(abs(self%psi))
            call check_near(error, sum(self%psi(:self%n, :n), 1), [(1.0_wp, m = 1, n)], tol, &
               largest, "sum of multipliers")
            call check_near(error, reshape(self%d(:self%n, :n), [self%n*n]), &
               reshape(matmul(self%psi(:self%n, :n), mass), [self%n*n]), tol, &
               largest*maxval(sum(mass, 1)), "D")
            call check_near(error, sum(self%d(:self%n, :n), 2), self%size(:self%n), tol, &
               largest*maxval(sum(mass, 1)), "sizes")
            if (j == 1 .and. n <= 4) call check_near(error, sum(abs(self%d(:n, :n))), &
               sum(self%size(:n)), tol, sum(self%size(:n)), "D is diagonal")
            if (allocated(error)) return
         end do
         deallocate(draw)
      end do
   end subroutine test_multipliers

   !> A part of the slave beyond the master, a hole, nothing near, two layers of the master.
   subroutine test_errors(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: n

      call make_boxes(scene, ["C3D8", "C3D8"], [2, 2, 1], [2, 2, 1], 0.0_wp)
      n = size(scene%x, 2)/2
      scene%x(1, n + 1:) = 0.9_wp*scene%x(1, n + 1:)
      call expect(scene, "3 of 9 nodes of slave surface UPPER are farther", error)
      call make_boxes(scene, ["C3D8", "C3D8"], [2, 2, 1], [3, 3, 1], 0.0_wp)
      call drop_face(scene, 5)
      call expect(scene, "1 of 9 nodes of slave surface UPPER are farther", error)
      call make_boxes(scene, ["C3D8", "C3D8"], [1, 1, 1], [3, 3, 1], 0.0_wp)
      call drop_face(scene, 5)
      call expect(scene, "1 of 1 faces of slave surface UPPER are not covered by", error)
      call make_boxes(scene, ["C3D8", "C3D8"], [2, 2, 1], [2, 2, 1], 0.0_wp)
      scene%x(3, :n) = scene%x(3, :n) + 7.0_wp
      call expect(scene, "do not meet: slave node 1, the nearest one, is 7 from", error)
      call make_boxes(scene, ["C3D8", "C3D8"], [2, 2, 1], [2, 2, 2], 0.0_wp)
      where (scene%x(3, :) < 0.0_wp .and. scene%x(3, :) > -0.75_wp) scene%x(3, :) = -0.0625_wp
      scene%surface(2)%element = [scene%surface(2)%element, scene%surface(2)%element - 4]
      scene%surface(2)%face = [scene%surface(2)%face, scene%surface(2)%face]
      call expect(scene, "two layers of the master lie in front of one face of the slave", error)
   end subroutine test_errors

   !> Take a face off the master.
   subroutine drop_face(scene, i)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i

      associate (master => scene%surface(2))
         master%element = [master%element(:i - 1), master%element(i + 1:)]
         master%face = [master%face(:i - 1), master%face(i + 1:)]
      end associate
   end subroutine drop_face

   !> Its surfaces cannot be tied.
   subroutine expect(scene, words, error)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: words
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: raised
      type(tie_rows_t) :: rows

      call measure(scene, multiplier_dual, rows, raised)
      call check_error(error, raised, err_input, words, "surfaces that cannot be tied")
   end subroutine expect

   subroutine check_rows(scene, rows, error)
      type(scene_t), intent(in) :: scene
      type(tie_rows_t), intent(in) :: rows
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: total(3)
      integer :: k

      do k = 1, size(rows%slave)
         associate (node => rows%node(rows%start(k) + 1:rows%start(k + 1)), &
               weight => rows%weight(rows%start(k) + 1:rows%start(k + 1)))
            call check_near(error, sum(weight), 0.0_wp, tol, rows%size(k), "sum of a row")
            total = matmul(scene%x(:, node), weight)
            call check_near(error, total, 0.0_wp*total, tol, 2.0_wp*rows%size(k), &
               "positions in row " // to_text(k))
            call check_true(error, rows%size(k) > 0.0_wp, "sizes are positive")
         end associate
      end do
      call check_near(error, sum(rows%size), 3.0_wp, tol, 3.0_wp, "sizes are the area")
   end subroutine check_rows

end module test_tie_space
