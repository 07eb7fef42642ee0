!> What a law of contact is: multipliers as functions of the gap and the slips of one condition.
!>
!> Rows whose multipliers are unknowns hold their values exactly, as hard contact and sticking do. A
!> law gives multipliers in their place, or beside them; of several laws at a place each has its
!> condition, and their forces add up. It knows no mechanics. Source: docs/theory.md, eqs. (14n) to
!> (14q), (20a) to (20f).
module emcon_contact_law
   use emcon_constraint, only : contact_response_t, most_slips
   use emcon_kinds, only : wp
   implicit none
   private
   public :: contact_law_t, contact_law_box_t, contact_values_t, contact_place_t

   !> Where a condition has gone over a step.
   type :: contact_values_t
      real(wp) :: gap0 = 0.0_wp, gap1 = 0.0_wp   !! counted from the one to hold [L]
      real(wp) :: dgap = 0.0_wp                  !! gap1 - gap0, to relative accuracy [L]
      real(wp) :: left = 0.0_wp                  !! of the gap, to what it is to be at the end [L]
      real(wp) :: slip(most_slips) = 0.0_wp      !! [L]
      real(wp) :: frequency = 0.0_wp             !! 1/h; 0 in statics [1/T]
      !> Multipliers are to be discrete gradients over the step of what the law stores, else what
      !> belongs to its end
      logical :: is_stored = .true.
   end type contact_values_t

   !> What a law acts on in a step.
   type :: contact_place_t
      real(wp) :: area = 0.0_wp                  !! of the condition [L^2]
      real(wp) :: stiffness = 0.0_wp             !! that a penalty has on that area [M/T^2]
      !> That gaps are means over, of the area: a law of d per area acts on share times d
      real(wp) :: share = 1.0_wp
      !> `closure` of the step before, <= 0: 0 where the law did not push; > 0: nothing is known
      real(wp) :: closure = 1.0_wp
   end type contact_place_t

   type, abstract :: contact_law_t
   contains
      procedure(respond_interface), deferred :: respond
      procedure :: begin
      procedure :: push_on
      procedure :: stored
      procedure :: dissipated
      procedure :: stiffest
      procedure :: closure
      procedure :: gives_back
   end type contact_law_t

   !> For arrays of laws of different types; not allocated: the rows hold, nothing else.
   type :: contact_law_box_t
      class(contact_law_t), allocatable :: law
   end type contact_law_box_t

   abstract interface

      !> The multipliers over a step, and how they fall. What the law knows of the step before is in
      !> it; what it learns of this one it keeps.
      pure subroutine respond_interface(self, at, response)
         import :: contact_law_t, contact_response_t, contact_values_t
         class(contact_law_t), intent(inout) :: self
         type(contact_values_t), intent(in) :: at
         type(contact_response_t), intent(inout) :: response     !! nothing yet
      end subroutine respond_interface

   end interface

contains

   !> Told before each solve of a step; nothing to do unless overridden.
   pure subroutine begin(self, place)
      class(contact_law_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place
   end subroutine begin

   !> A step is to be solved again with the multiplier `lam` that has come out, of laws that go on
   !> from it; nothing to do unless overridden.
   pure subroutine push_on(self, lam)
      class(contact_law_t), intent(inout) :: self
      real(wp), intent(in) :: lam                !! [M L/T^2]
   end subroutine push_on

   !> What the law stores where the step ends, 0 unless overridden [M L^2/T^2].
   pure real(wp) function stored(self)
      class(contact_law_t), intent(in) :: self   !! it has responded

      stored = 0.0_wp
   end function stored

   !> What its forces have taken in a step, 0 unless overridden [M L^2/T^2].
   pure real(wp) function dissipated(self, at, response)
      class(contact_law_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(in) :: response           !! to these values

      dissipated = 0.0_wp
   end function dissipated

   !> As stiff as the law becomes by the gap, 0 unless overridden [M/T^2].
   pure real(wp) function stiffest(self)
      class(contact_law_t), intent(in) :: self

      stiffest = 0.0_wp
   end function stiffest

   !> What a step leaves to the next one where the law stores something: how far it is closed by the
   !> whole area of the condition, <= 0, 0 unless overridden [L].
   pure real(wp) function closure(self)
      class(contact_law_t), intent(in) :: self   !! it has responded

      closure = 0.0_wp
   end function closure

   !> Has the law stored in steps before what it gives back in this one? Not unless overridden.
   pure logical function gives_back(self)
      class(contact_law_t), intent(in) :: self

      gives_back = .false.
   end function gives_back

end module emcon_contact_law
