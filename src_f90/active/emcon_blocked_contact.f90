!> Contacts that nothing can fulfil: a slave node and its whole master are prescribed, and the deck
!> moves them into each other.
module emcon_blocked_contact
   use emcon_active_set, only : touch_tol
   use emcon_kinds, only : wp
   use emcon_numbering, only : numbering_holds
   use emcon_scene, only : scene_t
   use emcon_surface_nodes, only : surface_nodes
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: blocked_contact_text

contains

   !> What to say of the first contact that closes at the end of the motion that was last measured,
   !> but was left out since nothing in it is free.
   subroutine blocked_contact_text(system, scene, is_left_out, text)
      type(system_t), intent(in) :: system       !! numbered for the step
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_left_out(:)       !! (n_constraint)
      character(len=:), allocatable, intent(out) :: text   !! empty: there is none
      integer :: k, i

      text = ""
      do k = 1, system%n_pair
         associate (contact => system%contact(k)%contact, pair => scene%pair(k), &
               first => system%first_constraint(k))
            do i = 1, contact%n_constraint
               if (.not. is_left_out(first + i)) cycle
               if (.not. contact%state(i)%gap1 < -touch_tol*contact%state(i)%size) cycle
               if (.not. numbering_holds(system%space%numbering, contact%node(i))) cycle
               if (.not. surface_is_bound(system, scene, pair%master)) cycle
               text = "slave node " // to_text(scene%node%label(contact%node(i))) // &
                  " of surface " // scene%surface(pair%slave)%name // " is " // &
                  to_text(-contact%state(i)%gap1, 3) // " behind surface " // &
                  scene%surface(pair%master)%name // &
                  ": *BOUNDARY moves it and all of that surface into each other, and no " // &
                  "contact can prevent it; free one of them, or take the node off the surface"
               return
            end do
         end associate
      end do
   end subroutine blocked_contact_text

   !> Are all nodes of surface `number` prescribed?
   logical function surface_is_bound(system, scene, number)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number              !! of the surface
      integer, allocatable :: node(:)
      integer :: i

      call surface_nodes(scene, scene%surface(number), node)
      surface_is_bound = .true.
      do i = 1, size(node)
         surface_is_bound = surface_is_bound .and. numbering_holds(system%space%numbering, node(i))
      end do
   end function surface_is_bound

end module emcon_blocked_contact
