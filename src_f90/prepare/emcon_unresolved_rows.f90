!> What is said of linear constraints that follow from others, or contradict what is prescribed.
module emcon_unresolved_rows
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_numbering, only : unresolved_t
   use emcon_prescribed, only : prescribed_way
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : unique_sorted
   use emcon_system, only : system_t
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   implicit none
   private
   public :: report_unresolved

   !> Nodes named in a message.
   integer, parameter :: most_named = 10
   !> Prescribed values fulfil a constraint up to this part of the largest one: decks round them.
   real(wp), parameter :: rounding = 1.0e-6_wp

contains

   !> Note the redundant rows of the step that `system` is in, which starts from the displacements
   !> `u`; an error if prescribed values contradict one.
   subroutine report_unresolved(scene, system, u, notes, error)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: u(:, :)            !! (2, n_node)
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      integer :: k, t

      associate (unresolved => system%space%unresolved, linear => system%space%linear)
         do k = 1, size(unresolved)
            if (is_met(scene, system%i_step, u, unresolved(k))) cycle
            call contradiction_text(scene, linear, unresolved(k), text)
            call raise(error, err_input, text)
            return
         end do
         do t = 0, size(scene%tie)
            if (any(linear%tie(unresolved%row) == t)) call note_redundant(scene, linear, &
               pack(unresolved%row, linear%tie(unresolved%row) == t), notes)
         end do
      end associate
   end subroutine report_unresolved

   !> Do the motions that step `i_step` prescribes fulfil the row, at all times? Freedoms that share
   !> an amplitude have to do so together; those without are to move from `u` together.
   pure logical function is_met(scene, i_step, u, item)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step
      real(wp), intent(in), contiguous :: u(:, :)
      type(unresolved_t), intent(in) :: item
      real(wp) :: total(0:size(scene%amplitude)), largest(0:size(scene%amplitude)), part, &
         motion
      integer :: i, k

      total = 0.0_wp
      largest = 0.0_wp
      associate (prescribed => scene%step(i_step)%prescribed)
         do k = 1, size(prescribed)
            motion = prescribed_way(prescribed(k), u(prescribed(k)%dof, prescribed(k)%node))
            do i = 1, size(item%dof)
               if (item%dof(i) /= size(u, 1)*(prescribed(k)%node - 1) + prescribed(k)%dof) cycle
               part = item%weight(i)*motion
               associate (a => prescribed(k)%amplitude)
                  total(a) = total(a) + part
                  largest(a) = max(largest(a), abs(part))
               end associate
            end do
         end do
      end associate
      is_met = all(abs(total) <= rounding*largest)
   end function is_met

   subroutine contradiction_text(scene, linear, item, text)
      type(scene_t), intent(in) :: scene
      type(linear_rows_t), intent(in) :: linear
      type(unresolved_t), intent(in) :: item
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable :: nodes

      call row_text(scene, linear, item%row, text)
      call nodes_text(scene, nodes_of(scene, item%dof), nodes)
      text = text // " contradicts what is prescribed at " // nodes // &
         ": the model is over-constrained; take *BOUNDARY off one side"
   end subroutine contradiction_text

   !> Which constraint a row is.
   subroutine row_text(scene, linear, row, text)
      type(scene_t), intent(in) :: scene
      type(linear_rows_t), intent(in) :: linear
      integer, intent(in) :: row
      character(len=:), allocatable, intent(out) :: text

      associate (k => linear%place(row), t => linear%tie(row))
         if (t < 0) then
            text = where_text(scene, scene%rigid(-t)%origin) // ": *RIGID BODY " // &
               scene%rigid(-t)%name // " in " // direction(scene, linear%own(row)) &
               // " at node " // to_text(scene%node%label(k))
         else if (t == 0) then
            text = where_text(scene, scene%equation(k)%origin)
            if (scene%equation(k)%turned == 0) then
               text = text // ": *EQUATION " // to_text(k)
            else
               text = text // ": *TRANSFORM at node " // to_text(scene%node%label( &
                  scene%equation(k)%node(1)))
            end if
         else
            text = where_text(scene, scene%tie(t)%origin) // ": *TIE " // scene%tie(t)%name // &
               " in " // direction(scene, linear%own(row)) // " at slave node " // &
               to_text(scene%node%label(scene%tie(t)%rows%slave(k)))
         end if
      end associate
   end subroutine row_text

   !> The axis of a degree of freedom.
   pure character(len=1) function direction(scene, dof)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: dof
      character(len=*), parameter :: axes = "xyz"
      integer :: a

      a = 1 + mod(dof - 1, scene%n_dim)
      direction = axes(a:a)
   end function direction

   !> The nodes of degrees of freedom; those of stand-ins are their nodes.
   pure function nodes_of(scene, dof) result(node)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: dof(:)
      integer :: node(size(dof)), i

      node = (dof - 1)/scene%n_dim + 1
      do i = 1, size(scene%node%turned)
         where (node == scene%node%turned(i)%stand_in) node = scene%node%turned(i)%node
      end do
   end function nodes_of

   subroutine nodes_text(scene, node, text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node(:)
      character(len=:), allocatable, intent(out) :: text
      type(string_t), allocatable :: label(:)
      integer, allocatable :: distinct(:)
      integer :: i

      allocate(distinct, source=unique_sorted(node))
      allocate(label(size(distinct)))
      do i = 1, size(distinct)
         label(i)%text = to_text(scene%node%label(distinct(i)))
      end do
      text = "node" // trim(merge("s", " ", size(distinct) /= 1)) // " " // &
         joined(label, ", ", most_named)
   end subroutine nodes_text

   !> One note on the rows `row` of one tie, or of the equations.
   subroutine note_redundant(scene, linear, row, notes)
      type(scene_t), intent(in) :: scene
      type(linear_rows_t), intent(in) :: linear
      integer, intent(in) :: row(:)
      type(notes_t), intent(inout) :: notes
      character(len=:), allocatable :: text
      integer :: t

      t = linear%tie(row(1))
      if (t == 0) then
         call row_text(scene, linear, row(1), text)
         call note_add(notes, text // " follows from other " // &
            "constraints: left out (such equations: " // to_text(size(row)) // ")")
      else
         call nodes_text(scene, nodes_of(scene, linear%own(row)), text)
         call note_add(notes, "*TIE " // scene%tie(t)%name // ": constraints at slave " // text // &
            " follow from others or from *BOUNDARY: left out")
      end if
   end subroutine note_redundant

end module emcon_unresolved_rows
