!> Rigid bodies in ties and equations: their nodes follow them already.
module emcon_deck_check_rigid
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_dimension, only : n_plane
   use emcon_deck_reader, only : reader_t
   use emcon_deck_rigid, only : mark_rigid
   use emcon_diagnostics, only : add_error, label_list
   use emcon_requests, only : output_section_print
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_find
   use emcon_surface_nodes, only : surface_nodes
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
      integer :: body(size(scene%node%label)), i, k
      logical, allocatable :: is_slave(:)

      call mark_rigid(scene, body)
      call check_profiles(reader, scene, body)
      if (size(scene%rigid) == 0) return
      allocate(is_slave(size(body)))
      do i = 1, size(scene%tie)
         is_slave = .false.
         call mark_nodes(scene, [scene%tie(i)%slave], is_slave)
         is_slave = is_slave .and. body > 0
         if (any(is_slave)) call add_error(reader%log, scene%tie(i)%origin, "*TIE " // &
            scene%tie(i)%name // ": slave node " // label_list(pack(scene%node%label, is_slave)) &
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
                     to_text(scene%node%label(equation%node(k))) // " belongs to rigid body " // &
                     rigid%name // "; name its reference node " // &
                     to_text(scene%node%label(rigid%reference)))
                  exit
               end associate
            end do
         end associate
      end do
      call check_sections(reader, scene)
   end subroutine check_rigid

   !> Rigid elements have no stress that a section could tell.
   subroutine check_sections(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i, k, b

      do i = 1, size(scene%step)
         do k = 1, size(scene%step(i)%output)
            associate (output => scene%step(i)%output(k))
               if (output%kind /= output_section_print) cycle
               if (i > 1) then                   ! carried over: it is told already
                  if (any(scene%step(i - 1)%output%origin%line == output%origin%line)) cycle
               end if
               associate (surface => scene%surface(output%set))
                  do b = 1, size(scene%rigid)
                     if (.not. any_in(surface%element, scene%rigid(b)%element)) cycle
                     call add_error(reader%log, output%origin, "*SECTION PRINT: surface " &
                        // surface%name // " has elements of rigid body " // scene%rigid(b)%name &
                        // ", which have no stress; ask for RF of its reference node by *NODE " &
                        // "PRINT, or for CF by *CONTACT PRINT")
                  end do
               end associate
            end associate
         end do
      end do
   end subroutine check_sections

   pure logical function any_in(element, list)
      integer, intent(in) :: element(:), list(:)
      integer :: i

      any_in = any([(any(list == element(i)), i = 1, size(element))])
   end function any_in

   !> Profiles belong to rigid bodies, which are prescribed in every step if they have nothing else:
   !> there is no mass.
   subroutine check_profiles(reader, scene, body)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: body(:)             !! (n_node) rigid ones, 0: none
      integer, allocatable :: node(:)
      integer :: i, k, a

      do i = 1, size(scene%surface)
         if (.not. scene%surface(i)%is_profile .or. reader%doubt%rigid) cycle
         call surface_nodes(scene, scene%surface(i), node)
         if (any(body(node) == 0)) call add_error(reader%log, scene%surface(i)%origin, &
            "surface " // scene%surface(i)%name // " is that of no *RIGID BODY, ANALYTICAL " // &
            "SURFACE=")
      end do
      if (reader%doubt%prescribed) return
      do i = 1, size(scene%rigid)
         associate (rigid => scene%rigid(i))
            if (any([(any(scene%element%node == rigid%node(k)), k = 1, size(rigid%node))])) cycle
            do k = 1, size(scene%step)
               if (any(scene%step(k)%turn%rigid == i .and. scene%step(k)%turn%axis == 0) .and. &
                  all([(prescribed_find(scene%step(k)%prescribed, rigid%reference, a), &
                  a = 1, scene%n_dim)] > 0)) cycle
               call add_error(reader%log, rigid%origin, "rigid body " // rigid%name // " has no " &
                  // "elements, and so no mass: in step " // to_text(k) // " its reference node " &
                  // to_text(scene%node%label(rigid%reference)) // " is not prescribed in all " &
                  // "degrees of freedom, " // trim(merge("1, 2 and 6", "1 to 6    ", &
                  scene%n_dim == n_plane)))
               exit
            end do
         end associate
      end do
   end subroutine check_profiles

end module emcon_deck_check_rigid
