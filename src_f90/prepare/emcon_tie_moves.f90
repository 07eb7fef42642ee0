!> Slave nodes of ties moved onto the master surface: D x_slave = M x_master before the first step.
!>
!> Source: docs/theory.md, section 11.
module emcon_tie_moves
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_scene, only : scene_t, where_text
   use emcon_steps, only : prescribed_t
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: ties_move_nodes

   !> A node that would move by less than this part of the largest coordinate stays where it is.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   !> An element is spoilt if a corner keeps less than this part of its area.
   real(wp), parameter :: least_area = 0.1_wp

contains

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
      allocate(is_alive(size(scene%x, 1), size(scene%x, 2)), source=.true.)
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
               to_text(distance(k)) // " (node " // to_text(scene%node%label(slave(k))) // ")")
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

      do e = 1, size(scene%element%kind)
         n = scene%element%kinds(scene%element%kind(e))%n_corner
         associate (node => scene%element%node(:n, e))
            if (all(abs(move(:, node)) <= 0.0_wp)) cycle
            do i = 1, n
               before = corner_area(scene%x(:, node), i)
               after = corner_area(scene%x(:, node) + move(:, node), i)
               if (.not. before > 0.0_wp .or. after > least_area*before) cycle
               k = maxloc(sum(abs(move(:, node)), 1), 1)
               call tie_text(scene, node(k), tie)
               call raise(error, err_input, tie // "element " // &
                  to_text(scene%element%label(e)) // " would be spoilt: the tie moves its " // &
                  "node " // to_text(scene%node%label(node(k))) // " by " // &
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

end module emcon_tie_moves
