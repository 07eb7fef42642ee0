!> A formulation of contact that a program gives, for the pairs of the deck with TYPE=USER.
module emcon_host_contact
   use emcon_contact, only : contact_t, max_penetration_on_entry
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : err_input, error_t, raise
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_contact_t, host_contact_box_t, host_contact_set_up

   type, abstract, extends(contact_t) :: host_contact_t
   contains
      procedure(set_up_interface), deferred :: set_up
   end type host_contact_t

   !> What was given, and for which pair.
   type :: host_contact_box_t
      integer :: pair = 0                        !! of the scene
      class(host_contact_t), allocatable :: contact
   end type host_contact_box_t

   abstract interface

      !> Find the possible constraints of a pair: their number `n_constraint`, and the slave node
      !> `node` of each.
      subroutine set_up_interface(self, scene, pair, error)
         import :: contact_pair_t, error_t, host_contact_t, scene_t
         class(host_contact_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
         type(contact_pair_t), intent(in) :: pair
         type(error_t), allocatable, intent(out) :: error   !! it cannot be set up
      end subroutine set_up_interface

   end interface

contains

   !> Let a formulation that was given set itself up for a pair, and fill in what it leaves out.
   subroutine host_contact_set_up(self, scene, pair, error)
      class(host_contact_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      call self%set_up(scene, pair, error)
      if (.not. allocated(error)) call check(self, size(scene%x, 2), error)
      if (allocated(error)) return
      associate (n => self%n_constraint)
         if (.not. allocated(self%state)) allocate(self%state(n))
         if (.not. allocated(self%duplicate)) allocate(self%duplicate(n), source=0)
         if (.not. allocated(self%thickness)) allocate(self%thickness(n), source=1.0_wp)
         if (.not. allocated(self%sagitta)) allocate(self%sagitta(n), source=0.0_wp)
      end associate
      if (.not. self%max_penetration_at_start > 0.0_wp) self%max_penetration_at_start &
         = max_penetration_on_entry
      call contact_laws_of_surface(pair%interaction, self%laws)
   end subroutine host_contact_set_up

   !> Does each constraint have what belongs to it?
   subroutine check(self, n_node, error)
      class(host_contact_t), intent(in) :: self
      integer, intent(in) :: n_node              !! of the scene
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (self%n_constraint < 0) then
         call refuse("n_constraint = " // to_text(self%n_constraint) // " is negative")
      else if (.not. allocated(self%node)) then
         call refuse("node is not allocated: it has the slave node of each constraint")
      else
         call check_size("node", size(self%node))
         if (allocated(self%state)) call check_size("state", size(self%state))
         if (allocated(self%duplicate)) call check_size("twin", size(self%duplicate))
         if (allocated(self%thickness)) call check_size("thickness", size(self%thickness))
         if (allocated(self%sagitta)) call check_size("sagitta", size(self%sagitta))
      end if
      if (allocated(error)) return
      do i = 1, self%n_constraint
         if (self%node(i) < 1 .or. self%node(i) > n_node) then
            call refuse("node(" // to_text(i) // ") = " // to_text(self%node(i)) // &
               " is not in 1.." // to_text(n_node))
            return
         end if
      end do

   contains

      subroutine check_size(name, n)
         character(len=*), intent(in) :: name
         integer, intent(in) :: n

         if (n /= self%n_constraint .and. .not. allocated(error)) call refuse("the size of " // &
            name // " is " // to_text(n) // ", not n_constraint = " // to_text(self%n_constraint))
      end subroutine check_size

      subroutine refuse(fault)
         character(len=*), intent(in) :: fault

         call raise(error, err_input, fault)
      end subroutine refuse

   end subroutine check

end module emcon_host_contact
