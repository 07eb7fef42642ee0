!> Rigid bodies in ties and equations: their nodes follow them already.
module emcon_deck_check_rigid
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_deck_rigid, only : mark_rigid
   use emcon_diagnostics, only : add_error, label_list
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_rigid

contains

   !> No node of a rigid body is slave in a tie, and of its nodes equations name the reference node
   !> alone.
   subroutine check_rigid(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: body(size(scene%node_label)), i, k
      logical, allocatable :: is_slave(:)

      if (size(scene%rigid) == 0) return
      call mark_rigid(scene, body)
      allocate(is_slave(size(body)))
      do i = 1, size(scene%tie)
         if (scene%tie(i)%slave == 0) cycle
         is_slave = .false.
         call mark_nodes(scene, scene%surface(scene%tie(i)%slave), is_slave)
         is_slave = is_slave .and. body > 0
         if (any(is_slave)) call add_error(reader%log, scene%tie(i)%origin, "*TIE " // &
            scene%tie(i)%name // ": slave node " // label_list(pack(scene%node_label, is_slave)) &
            // " belongs to rigid body " // scene%rigid(maxval(body, is_slave))%name // &
            ", which it follows already; let the surface of the rigid body be the master")
      end do
      do i = 1, size(scene%equation)
         associate (equation => scene%equation(i))
            do k = 1, size(equation%node)
               if (body(equation%node(k)) == 0) cycle
               associate (rigid => scene%rigid(body(equation%node(k))))
                  if (rigid%reference == equation%node(k)) cycle
                  call add_error(reader%log, equation%origin, "*EQUATION: node " // &
                     to_text(scene%node_label(equation%node(k))) // " belongs to rigid body " // &
                     rigid%name // "; name its reference node " // &
                     to_text(scene%node_label(rigid%reference)))
                  exit
               end associate
            end do
         end associate
      end do
   end subroutine check_rigid

end module emcon_deck_check_rigid
