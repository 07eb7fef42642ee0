!> Rigid motions that nothing prevents: what makes a static problem singular.
module emcon_rigid_motion
   use emcon_kinds, only : wp
   use emcon_scene, only : prescribed_t, scene_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: free_motion_text

contains

   !> Names the first body that can move as a rigid one, and how; empty if none can. Bodies in a
   !> contact pair are looked at only `with_contact`: contact may hold them.
   function free_motion_text(system, scene, prescribed, with_contact) result(text)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(prescribed_t), intent(in) :: prescribed(:)
      logical, intent(in), optional :: with_contact
      character(len=:), allocatable :: text, motion
      logical :: touches(system%n_body)
      integer :: b, i, k

      text = ""
      touches = .false.
      if (.not. present(with_contact)) then
         do k = 1, size(system%contact)
            call mark_contact_bodies(system, scene, k, touches)
         end do
      end if
      do b = 1, system%n_body
         if (touches(b)) cycle
         motion = body_motion(system, scene, prescribed, b)
         if (len(motion) == 0) cycle
         i = 1
         do while (system%body(system%solid%node(1, i)) /= b)
            i = i + 1
         end do
         text = "the body of element " // &
            to_text(scene%element_label(i)) // " is free to " // motion // &
            "; add *BOUNDARY conditions"
         return
      end do
   end function free_motion_text

   subroutine mark_contact_bodies(system, scene, pair, touches)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: pair
      logical, intent(inout) :: touches(:)
      integer :: i, surface(2), k

      surface = [scene%pair(pair)%slave, scene%pair(pair)%master]
      do i = 1, 2
         associate (s => scene%surface(surface(i)))
            if (s%is_nodal) then
               do k = 1, size(s%node)
                  if (system%body(s%node(k)) > 0) touches(system%body(s%node(k))) = .true.
               end do
            else
               do k = 1, size(s%element)
                  touches(system%body(scene%element_node(1, s%element(k)))) = .true.
               end do
            end if
         end associate
      end do
   end subroutine mark_contact_bodies

   !> The motions of body `b` that its prescribed freedoms leave, from the rank of these freedoms
   !> on the two translations and the rotation.
   function body_motion(system, scene, prescribed, b) result(text)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(prescribed_t), intent(in) :: prescribed(:)
      integer, intent(in) :: b
      character(len=:), allocatable :: text
      real(wp) :: center(2), arm(2), gram(3, 3), row(3), size_of_body
      logical :: has(2), is_full
      integer :: i, k

      center = 0.0_wp
      do i = 1, size(scene%x, 2)
         if (system%body(i) == b) center = center + scene%x(:, i)
      end do
      center = center/real(count(system%body == b), wp)
      size_of_body = 0.0_wp
      do i = 1, size(scene%x, 2)
         if (system%body(i) /= b) cycle
         size_of_body = max(size_of_body, maxval(abs(scene%x(:, i) - center)))
      end do
      gram = 0.0_wp
      has = .false.
      do k = 1, size(prescribed)
         if (system%body(prescribed(k)%node) /= b) cycle
         arm = (scene%x(:, prescribed(k)%node) - center)/size_of_body
         has(prescribed(k)%dof) = .true.
         row = 0.0_wp
         row(prescribed(k)%dof) = 1.0_wp
         row(3) = merge(-arm(2), arm(1), prescribed(k)%dof == 1)
         do i = 1, 3
            gram(:, i) = gram(:, i) + row*row(i)
         end do
      end do
      do i = 1, 2                                ! the rank of the rotation beside what is missing
         if (.not. has(i)) gram(i, i) = 1.0_wp
      end do
      is_full = determinant(gram) > 1.0e3_wp*epsilon(1.0_wp)*max(1.0_wp, trace(gram))**3
      text = ""
      if (.not. has(1)) text = "move in x"
      if (.not. has(2)) text = join(text, "move in y")
      if (.not. is_full) text = join(text, "rotate")
   end function body_motion

   pure function join(a, b) result(text)
      character(len=*), intent(in) :: a, b
      character(len=:), allocatable :: text

      text = b
      if (len(a) > 0) text = a // ", " // b
   end function join

   pure real(wp) function trace(a)
      real(wp), intent(in) :: a(3, 3)

      trace = a(1, 1) + a(2, 2) + a(3, 3)
   end function trace

   pure real(wp) function determinant(a)
      real(wp), intent(in) :: a(3, 3)

      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) &
         - a(1, 2)*(a(2, 1)*a(3, 3) - a(2, 3)*a(3, 1)) &
         + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
   end function determinant

end module emcon_rigid_motion
