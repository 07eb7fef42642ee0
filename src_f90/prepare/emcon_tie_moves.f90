!> Slave nodes of ties moved onto the master surface: D x_slave = M x_master before the first step.
!>
!> Source: docs/theory.md, section 10.
module emcon_tie_moves
   use emcon_deck_jacobian, only : determinant
   use emcon_element_kind, only : element_kind_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_scene, only : scene_t, where_text
   use emcon_shape, only : max_element_nodes
   use emcon_steps, only : prescribed_t
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: ties_move_nodes, ties_note_gaps

   !> A node that would move by less than this part of the largest coordinate stays where it is.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   !> An element is spoilt if a corner keeps less than this part of its area or volume.
   real(wp), parameter :: least_area = 0.1_wp

contains

   !> Move the slave nodes onto the places that their ties give them; the notes tell how far.
   subroutine ties_move_nodes(scene, notes, error, before)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      !> (n_dim, n_node) places that were met by the ties: what has moved since is followed. To be
      !> given with ties that have a map [L]
      real(wp), intent(in), optional :: before(:, :)
      type(prescribed_t) :: nothing(0)
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      real(wp), allocatable :: move(:, :)
      logical, allocatable :: is_alive(:, :)

      if (size(scene%tie) == 0) return
      call linear_rows_init(linear, scene)
      linear%is_used = are_adjusted(scene, linear)
      allocate(is_alive(size(scene%x, 1), size(scene%x, 2)), source=.true.)
      call numbering_init(numbering, is_alive, nothing, linear)
      allocate(move, source=0.0_wp*scene%x)
      if (present(before)) then
         call find_moves(numbering, scene%x - before, move)
      else
         call find_moves(numbering, scene%x, move)
      end if
      where (abs(move) <= rounding*maxval(abs(scene%x))) move = 0.0_wp
      call note_moves(scene, move, notes)
      call check_elements(scene, move, error)
      if (.not. allocated(error)) scene%x = scene%x + move
   end subroutine ties_move_nodes

   !> Which rows are those of ties whose slave nodes are moved?
   pure function are_adjusted(scene, linear)
      type(scene_t), intent(in) :: scene
      type(linear_rows_t), intent(in) :: linear
      logical :: are_adjusted(linear%n)
      integer :: k

      are_adjusted = linear%tie > 0
      do k = 1, linear%n
         if (are_adjusted(k)) are_adjusted(k) = scene%tie(linear%tie(k))%is_adjusted
      end do
   end function are_adjusted

   !> Tell how far apart the surfaces of ties stay whose slave nodes are not moved.
   subroutine ties_note_gaps(scene, notes)
      type(scene_t), intent(in) :: scene
      type(notes_t), intent(inout) :: notes
      integer :: t, k
      real(wp) :: gap(size(scene%x, 1)), largest

      do t = 1, size(scene%tie)
         if (scene%tie(t)%is_adjusted) cycle
         associate (rows => scene%tie(t)%rows)
            largest = 0.0_wp
            do k = 1, size(rows%slave)
               associate (at => rows%start(k) + 1, to => rows%start(k + 1))
                  gap = matmul(scene%x(:, rows%node(at:to)), rows%weight(at:to))/rows%weight(at)
               end associate
               largest = max(largest, norm2(gap))
            end do
         end associate
         call note_add(notes, "*TIE " // scene%tie(t)%name // ": its surfaces stay apart by up " &
            // "to " // to_text(largest) // ", as ADJUST=NO asks for: forces across that gap " // &
            "have a couple")
      end do
   end subroutine ties_note_gaps

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
      real(wp), intent(in) :: move(:, :)                 !! (n_dim, n_node)
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

   !> An error if a corner of an element would lose most of its area or volume.
   subroutine check_elements(scene, move, error)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: move(:, :)                 !! (n_dim, n_node)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: tie
      real(wp), dimension(max_element_nodes) :: before, after
      integer :: e, n, k

      do e = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            n = kind%n_corner
            associate (node => scene%element%node(:kind%n_node, e))
               if (all(abs(move(:, node)) <= 0.0_wp)) cycle
               call find_corners(kind, scene%x(:, node), before(:n))
               call find_corners(kind, scene%x(:, node) + move(:, node), after(:n))
               if (.not. any(before(:n) > 0.0_wp &
                  .and. .not. after(:n) > least_area*before(:n))) then
                  cycle
               end if
               k = maxloc(sum(abs(move(:, node)), 1), 1)
               call tie_text(scene, node(k), tie)
               call raise(error, err_input, tie // "element " // &
                  to_text(scene%element%label(e)) // " would be spoilt: the tie moves its " // &
                  "node " // to_text(scene%node%label(node(k))) // " by " // &
                  to_text(norm2(move(:, node(k)))) // " onto the master surface; let the " // &
                  "surfaces meet, or refine the coarser one")
               return
            end associate
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

   !> The Jacobian of an element at its corners.
   pure subroutine find_corners(kind, x, det)
      class(element_kind_t), intent(in) :: kind
      real(wp), intent(in) :: x(:, :)                    !! (n_dim, n_node) [L]
      real(wp), intent(out) :: det(:)                    !! (corners)
      real(wp), allocatable :: place(:, :)
      real(wp) :: value(size(x, 2)), slope(size(x, 1), size(x, 2))
      integer :: i

      if (size(det) == 0) return
      call kind%shape%places(place)
      do i = 1, size(det)
         call kind%shape%values(place(:, i), value, slope)
         det(i) = determinant(matmul(x, transpose(slope)))
      end do
   end subroutine find_corners

end module emcon_tie_moves
