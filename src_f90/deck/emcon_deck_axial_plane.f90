!> What solids of revolution ask for: sections right of the axis of y, and loads that are the same
!> all around.
module emcon_deck_axial_plane
   use emcon_deck_reader, only : card_error, option_name, reader_t
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_gravity, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_axial

contains

   !> All of it: errors with the first line that is wrong.
   subroutine check_axial(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i

      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "INITIALCONDITIONS") cycle
         if (option_name(reader%card(i), "TYPE") == "ROTATINGVELOCITY") call card_error(reader, &
            reader%card(i), "a section of a solid of revolution (CAX) cannot turn in its plane")
      end do
      if (reader%doubt%elements .or. reader%doubt%nodes .or. reader%doubt%positions) return
      call check_kinds(reader, scene)
      call check_side(reader, scene)
      call check_gravity(reader, scene)
   end subroutine check_axial

   !> Elements of the plane have no circles.
   subroutine check_kinds(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i

      do i = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(i)))
            if (kind%is_axial) cycle
            call add_error(reader%log, scene%element%origin(i), "element " &
               // to_text(scene%element%label(i)) // " is of type " // trim(kind%name) &
               // ", beside solids of revolution (CAX): a deck has elements of one or the other")
            return
         end associate
      end do
   end subroutine check_kinds

   !> Nodes of elements lie right of the axis, or on it and stay there.
   subroutine check_side(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, dimension(size(scene%node%label)) :: is_used, is_left, is_loose
      integer :: e, i

      is_used = .false.
      do e = 1, size(scene%element%kind)
         associate (node => &
            scene%element%node(:scene%element%kinds(scene%element%kind(e))%n_node, e))
            if (all(node > 0)) is_used(node) = .true.
         end associate
      end do
      is_left = is_used .and. scene%x(1, :) < 0.0_wp
      if (any(is_left)) then
         i = findloc(is_left, .true., 1)
         call add_error(reader%log, scene%node%origin(i), "node " &
            // label_list(pack(scene%node%label, is_left)) // " lies left of the axis, at x = " &
            // to_text(scene%x(1, i)) // ": x is the radius of a solid of revolution (CAX)")
      end if
      is_loose = .false.
      do i = 1, size(scene%step)
         is_loose = is_loose .or. is_used .and. abs(scene%x(1, :)) <= 0.0_wp &
            .and. .not. is_held(scene%step(i), size(is_used))
      end do
      if (.not. any(is_loose)) return
      i = findloc(is_loose, .true., 1)
      call add_warning(reader%log, scene%node%origin(i), "node" &
         // trim(merge("s", " ", count(is_loose) > 1)) // " " &
         // label_list(pack(scene%node%label, is_loose)) // trim(merge(" lie ", " lies", &
         count(is_loose) > 1)) // " on the axis and may leave it; hold degree of freedom 1 there " &
         // "by *BOUNDARY")
   end subroutine check_side

   !> Which nodes are held along the radius.
   pure function is_held(step, n_node)
      type(step_t), intent(in) :: step
      integer, intent(in) :: n_node
      logical :: is_held(n_node)
      integer :: i

      is_held = .false.
      do i = 1, size(step%prescribed)
         if (step%prescribed(i)%dof == 1) is_held(step%prescribed(i)%node) = .true.
      end do
   end function is_held

   !> Gravity acts along the axis.
   subroutine check_gravity(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i, k

      do i = 1, size(scene%step)
         do k = 1, size(scene%step(i)%load)
            associate (load => scene%step(i)%load(k))
               if (load%kind /= load_gravity) cycle
               if (.not. abs(load%direction(1)) > 0.0_wp) cycle
               call add_error(reader%log, load%origin, "gravity across the axis of a solid of " &
                  // "revolution (CAX) is not the same all around: its direction is 0, 1 or 0, -1")
               return
            end associate
         end do
      end do
   end subroutine check_gravity

end module emcon_deck_axial_plane
