!> Ties before the first step: crosspoints, moved slave nodes, what cannot be.
module test_ties
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t, unresolved_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_t
   use emcon_text, only : notes_t, to_text
   use emcon_ties, only : ties_prepare
   use small_scenes, only : add_block, add_surface, block_node, block_t, bottom, left, prescribe, &
      right, scene_begin, top
   use tie_scenes, only : even, make_straight, multipliers, row_sum
   implicit none
   private
   public :: collect_ties

   !> Rows have up to 200 roundings of places and weights of order one.
   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_ties(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("surfaces that meet stay where they are", test_still), &
         test_case_t("slave nodes are moved", test_moved), &
         test_case_t("crosspoints", test_crosspoint), &
         test_case_t("held ends", test_held), &
         test_case_t("two ties of one slave surface", test_repeated), &
         test_case_t("a spoilt element", test_spoilt)]
   end subroutine collect_ties

   subroutine add_tie(scene, name, slave, master, multiplier, tolerance)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: slave, master, multiplier
      real(wp), intent(in), optional :: tolerance
      type(tie_t), allocatable :: ties(:)
      integer :: n

      n = size(scene%tie)
      allocate(ties(n + 1))
      ties(:n) = scene%tie
      ties(n + 1)%name = name
      ties(n + 1)%slave = slave
      ties(n + 1)%master = master
      ties(n + 1)%multiplier = multiplier
      if (present(tolerance)) ties(n + 1)%tolerance = tolerance
      call move_alloc(ties, scene%tie)
   end subroutine add_tie

   !> The rows of all ties annihilate the positions, and constants.
   subroutine check_places(error, scene)
      type(error_t), allocatable, intent(inout) :: error
      type(scene_t), intent(in) :: scene
      integer :: t, k, a

      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            do k = 1, size(rows%slave)
               call check_near(error, row_sum(rows, k, 1.0_wp + 0.0_wp*scene%x(1, :)), 0.0_wp, &
                  tol, rows%size(k), "sum of row " // to_text(k))
               do a = 1, 2
                  call check_near(error, row_sum(rows, k, scene%x(a, :)), 0.0_wp, tol, &
                     rows%size(k)*maxval(abs(scene%x)), "places in row " // to_text(k))
               end do
            end do
         end associate
      end do
   end subroutine check_places

   subroutine test_still(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(notes_t) :: notes
      real(wp), allocatable :: x(:, :)
      integer :: m

      do m = 1, 2
         call make_straight(scene, even(5, 0.0_wp, 3.0_wp), even(4, 3.0_wp, 0.0_wp))
         call add_tie(scene, "SEAM", 1, 2, multipliers(m))
         x = scene%x
         call ties_prepare(scene, notes, error)
         if (allocated(error)) return
         call check_true(error, all(scene%x == x), "no node moves, to the bit")
         call check_equal(error, notes%n, 0, "notes")
         call check_equal(error, size(scene%tie(1)%rows%slave), 6, "rows")
         call check_places(error, scene)
      end do
   end subroutine test_still

   !> Slave nodes off the line by a twentieth of an edge go back onto it; a note tells, and the rest
   !> of the scene stays.
   subroutine test_moved(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(notes_t) :: notes
      real(wp), allocatable :: x(:, :)
      integer :: m

      do m = 1, 2
         notes = notes_t()
         call make_straight(scene, even(5, 0.0_wp, 3.0_wp), even(4, 3.0_wp, 0.0_wp))
         call add_tie(scene, "SEAM", 1, 2, multipliers(m))
         scene%x(2, 3) = 0.03125_wp
         scene%x(2, 5) = -0.015625_wp
         x = scene%x
         call ties_prepare(scene, notes, error)
         if (allocated(error)) return
         call check_places(error, scene)
         call check_near(error, scene%x(2, :6), 0.0_wp*x(2, :6), tol, 3.0_wp, "slave nodes")
         call check_true(error, all(scene%x(:, 7:) == x(:, 7:)), "all other nodes stay")
         call check_equal(error, notes%n, 1, "notes")
         if (allocated(error)) return
         call check_true(error, index(notes%item(1)%text, "*TIE SEAM: ") == 1 .and. &
            index(notes%item(1)%text, "(node 3)") > 0, "note: " // notes%item(1)%text)
      end do
   end subroutine test_moved

   !> A block on another one and beside a third, slave on both sides: its corner is the end of two
   !> chains. No multiplier stands there, none is redundant, rows still say all of the surfaces.
   subroutine test_crosspoint(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block(3)
      type(notes_t) :: notes
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      type(unresolved_t), allocatable :: unresolved(:)
      type(prescribed_t) :: nothing(0)
      logical, allocatable :: is_alive(:, :)
      integer :: m, t

      do m = 1, 2
         call scene_begin(scene)
         call add_block(scene, "CPE4", [4, 3], [0.0_wp, 0.0_wp], [2.0_wp, 2.0_wp], block(1))
         call add_block(scene, "CPE4", [3, 1], [0.0_wp, -1.0_wp], [2.0_wp, 1.0_wp], block(2))
         call add_block(scene, "CPE4", [1, 2], [-1.0_wp, 0.0_wp], [1.0_wp, 2.0_wp], block(3))
         call add_surface(scene, "BOTTOM", block(1), [bottom])
         call add_surface(scene, "LEFT", block(1), [left])
         call add_surface(scene, "BELOW", block(2), [top])
         call add_surface(scene, "BESIDE", block(3), [right])
         call add_tie(scene, "A", 1, 3, multipliers(m))
         call add_tie(scene, "B", 2, 4, multipliers(m))
         call ties_prepare(scene, notes, error)
         if (allocated(error)) return
         call check_places(error, scene)
         call check_equal(error, size(scene%tie(1)%rows%slave), 4, "rows along the bottom")
         call check_equal(error, size(scene%tie(2)%rows%slave), 3, "rows along the left side")
         do t = 1, 2
            associate (rows => scene%tie(t)%rows)
               call check_true(error, all(rows%slave /= block_node(block(1), 0, 0)), "not there")
               call check_true(error, any(rows%node == block_node(block(1), 0, 0)), "it is a term")
               call check_near(error, sum(rows%size), 2.0_wp, tol, 1.0_wp, "sizes")
               call check_equal(error, count(rows%neighbour == 0), 2, "an open chain")
               call check_equal(error, rows%start(size(rows%start)), size(rows%node), "entries")
            end associate
         end do
         call linear_rows_init(linear, scene)
         if (allocated(is_alive)) deallocate(is_alive)
         allocate(is_alive(2, size(scene%x, 2)), source=.true.)
         call numbering_init(numbering, is_alive, nothing, linear, unresolved)
         call check_equal(error, size(unresolved), 0, "redundant rows")
         call check_equal(error, numbering%n_dependent, 14, "dependent freedoms")
      end do
   end subroutine test_crosspoint

   !> An end that is held in some step, in x or y, has no multiplier, unless its neighbour is held
   !> in the same direction; a chain that would keep less than two keeps all.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error

      call check_rows(6, [1], [1], [2, 3, 4, 5, 6])
      call check_rows(6, [6], [2], [1, 2, 3, 4, 5])
      call check_rows(6, [1, 6], [2, 1], [2, 3, 4, 5])
      call check_rows(6, [1, 2], [2, 2], [1, 2, 3, 4, 5, 6])
      call check_rows(6, [1, 2], [1, 2], [2, 3, 4, 5, 6])
      call check_rows(6, [3], [1], [1, 2, 3, 4, 5, 6])
      call check_rows(4, [1, 4], [1, 1], [2, 3])
      call check_rows(3, [3], [1], [1, 2])
      call check_rows(3, [1, 3], [1, 1], [1, 2, 3])
      call check_rows(2, [1], [1], [1, 2])
      call check_rows(2, [1, 2], [1, 2], [1, 2])

   contains

      !> The slave nodes with a row, `n` nodes along the slave surface; the second of two steps
      !> holds the `dof` of each of `node`.
      subroutine check_rows(n, node, dof, expected)
         integer, intent(in) :: n, node(:), dof(:), expected(:)
         type(scene_t) :: scene
         type(notes_t) :: notes
         integer :: i, k, m
         character(len=:), allocatable :: text

         do m = 1, 2
            if (allocated(error)) return
            call make_straight(scene, even(n - 1, 0.0_wp, 3.0_wp), even(4, 3.0_wp, 0.0_wp))
            call add_tie(scene, "SEAM", 1, 2, multipliers(m))
            deallocate(scene%step)
            allocate(scene%step(2))
            do i = 1, 2
               allocate(scene%step(i)%prescribed(0))
            end do
            do k = 1, size(node)
               call prescribe(scene%step(2), node(k), dof(k), 0.0_wp)
            end do
            call ties_prepare(scene, notes, error)
            if (allocated(error)) return
            text = to_text(n) // " nodes, multiplier " // to_text(m)
            call check_equal(error, scene%tie(1)%rows%slave, expected, text)
            call check_near(error, sum(scene%tie(1)%rows%size), 3.0_wp, tol, 1.0_wp, text)
            call check_places(error, scene)
         end do
      end subroutine check_rows

   end subroutine test_held

   subroutine test_repeated(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(notes_t) :: notes

      call make_straight(scene, even(5, 0.0_wp, 3.0_wp), even(4, 3.0_wp, 0.0_wp))
      call add_tie(scene, "SEAM", 1, 2, multipliers(1))
      call add_tie(scene, "AGAIN", 1, 2, multipliers(1))
      call ties_prepare(scene, notes, raised)
      call check_error(error, raised, err_input, "*TIE AGAIN over-constrains", "twice a slave")
      call check_error(error, raised, err_input, "of *TIE SEAM already", "twice a slave")
   end subroutine test_repeated

   !> The slave body reaches 0.96 of its height into the other one: its elements would be flat.
   subroutine test_spoilt(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(notes_t) :: notes
      real(wp), allocatable :: x(:, :)
      integer :: pass, e

      do pass = 1, 2
         call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(3, 4.0_wp, 0.0_wp))
         call add_tie(scene, "SEAM", 1, 2, multipliers(1), tolerance=1.0_wp)
         scene%element%label = [(10*e, e = 1, size(scene%element%kind))]
         scene%x(2, :9) = scene%x(2, :9) - merge(0.48_wp, 0.25_wp, pass == 1)
         x = scene%x
         call ties_prepare(scene, notes, raised)
         if (pass == 1) then
            call check_error(error, raised, err_input, "element 10 would be spoilt", "flat")
            call check_true(error, all(scene%x == x), "nothing was moved")
         else
            call check_true(error, .not. allocated(raised), "half of the height is left")
            call check_near(error, scene%x(2, :5), 0.0_wp*x(2, :5), tol, 4.0_wp, "moved")
         end if
      end do
   end subroutine test_spoilt

end module test_ties
