!> The registry of laws of contact: what others see of it. Which kinds there are is known to
!> `emcon_contact_law_kinds` alone.
module emcon_contact_law_registry
   use emcon_contact_law, only : contact_law_t, contact_laws_add, contact_laws_t
   use emcon_interactions, only : interaction_t, pressure_hard
   use emcon_steps, only : method_penalty
   implicit none
   private
   public :: contact_laws_of_surface, contact_law_of_method, contact_law_in_place

   interface
      !> Number of kinds.
      pure module integer function n_kind()
      end function n_kind

      !> A law of a kind, without what the deck says of it.
      module subroutine allocate_law(kind, law)
         integer, intent(in) :: kind             !! 1..n_kind()
         class(contact_law_t), allocatable, intent(out) :: law
      end subroutine allocate_law
   end interface

contains

   !> The laws that act beside the rows of a pair whose surfaces are `surface`, and that in place of
   !> them where its contact gives way.
   subroutine contact_laws_of_surface(surface, laws)
      type(interaction_t), intent(in) :: surface
      type(contact_laws_t), intent(out) :: laws
      class(contact_law_t), allocatable :: law
      logical :: acts
      integer :: kind

      do kind = 1, n_kind()
         call allocate_law(kind, law)
         call law%take(surface, 0, acts)
         if (acts) call contact_laws_add(laws, law)
      end do
      if (surface%pressure%kind /= pressure_hard) call contact_law_in_place(surface, &
         method_penalty, laws%row)
   end subroutine contact_laws_of_surface

   !> The law that acts in place of the rows of gaps in steps of a method.
   subroutine contact_law_of_method(method, law)
      integer, intent(in) :: method              !! of `emcon_steps`
      class(contact_law_t), allocatable, intent(out) :: law      !! not allocated: rows hold

      call contact_law_in_place(interaction_t(), method, law)
   end subroutine contact_law_of_method

   !> The same of surfaces that may have a law of their own.
   subroutine contact_law_in_place(surface, method, law)
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of `emcon_steps`
      class(contact_law_t), allocatable, intent(out) :: law      !! not allocated: rows hold
      type(interaction_t) :: alone
      logical :: acts
      integer :: kind

      alone%pressure = surface%pressure          ! others act beside
      if (surface%pressure%kind /= pressure_hard) then
         alone%friction = surface%friction
         alone%stick = surface%stick
      end if
      do kind = 1, n_kind()
         call allocate_law(kind, law)
         call law%take(alone, method, acts)
         if (acts) return
      end do
      deallocate(law)
   end subroutine contact_law_in_place

end module emcon_contact_law_registry
