!> What a law of contact is: multipliers as functions of the gap and the slips of one condition.
!>
!> Rows whose multipliers are unknowns hold their values exactly, as hard contact and sticking do. A
!> law gives the multiplier of the gap in place of its row, or forces beside the rows; of several
!> laws of a condition the forces add up. It knows no mechanics. Source: docs/theory.md, eqs. (14f)
!> to (14r), (20a) to (20f), (22e).
module emcon_contact_law
   use emcon_constraint, only : contact_response_t, most_slips
   use emcon_interactions, only : interaction_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: contact_law_t, contact_law_box_t, contact_laws_t, contact_values_t, contact_place_t
   public :: contact_laws_add, contact_laws_begin, contact_laws_suit, contact_laws_respond, &
      contact_laws_dissipated, contact_laws_reach, contact_laws_rub, contact_laws_rate_change, &
      contact_laws_drag
   public :: loss_damping, loss_friction

   !> What a law takes is told as a loss of one of these kinds.
   integer, parameter :: loss_damping = 1, loss_friction = 2

   !> Where a condition has gone over a step.
   type :: contact_values_t
      real(wp) :: gap0 = 0.0_wp, gap1 = 0.0_wp   !! counted from the one to hold [L]
      real(wp) :: dgap = 0.0_wp                  !! gap1 - gap0, to relative accuracy [L]
      real(wp) :: left = 0.0_wp                  !! of the gap, to what it is to be at the end [L]
      real(wp) :: slip(most_slips) = 0.0_wp      !! [L]
      real(wp) :: size = 0.0_wp                  !! of an edge [L]
      !> Against slip, by the rows of the condition: what sticks, or slides [M L/T^2]
      real(wp) :: friction(most_slips) = 0.0_wp
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
      real(wp) :: stretch(most_slips) = 0.0_wp   !! that of the step before [L]
      real(wp) :: gap = 0.0_wp                   !! mean gap as the step begins [L]
      logical :: is_closed = .false.             !! it touches, whatever the gap says
   end type contact_place_t

   type, abstract :: contact_law_t
      real(wp) :: reach = 0.0_wp                 !! the gap up to which it acts, >= 0 [L]
      logical :: has_friction = .false.          !! it has forces along the surface
      integer :: loss = loss_damping             !! the kind of loss that it dissipates by
   contains
      procedure(respond_interface), deferred :: respond
      procedure :: take
      procedure :: suit
      procedure :: acts_near
      procedure :: begin
      procedure :: push_on
      procedure :: stored
      procedure :: dissipated
      procedure :: stiffest
      procedure :: closure
      procedure :: stretch
      procedure :: gained
      procedure :: gives_back
      procedure :: rate_change
   end type contact_law_t

   !> A law with what it has last responded.
   type :: contact_law_box_t
      class(contact_law_t), allocatable :: law
      type(contact_response_t) :: response
   end type contact_law_box_t

   !> The laws of a condition, or those that all conditions of a pair get copies of.
   type :: contact_laws_t
      !> Gives the multiplier of the gap; not allocated: the row of the gap holds
      class(contact_law_t), allocatable :: row
      type(contact_law_box_t), allocatable :: beside(:)  !! act beside that; not allocated: none do
   end type contact_laws_t

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

   !> Take over what the deck says: of the surfaces, and the method of the step. Laws that decks
   !> cannot ask for leave it.
   pure subroutine take(self, surface, method, acts)
      class(contact_law_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of `emcon_steps`; 0: of no step
      logical, intent(out) :: acts               !! the deck asks for this law

      acts = .false.
   end subroutine take

   !> Beside the rows: does it act on all that is near, whether a row holds or not? Unless
   !> overridden, as by laws that parts of a step ask by themselves: friction and restitution.
   pure logical function acts_near(self)
      class(contact_law_t), intent(in) :: self

      acts_near = .true.
   end function acts_near

   !> A step of the deck begins; nothing to do unless overridden.
   pure subroutine suit(self, i_step)
      class(contact_law_t), intent(inout) :: self
      integer, intent(in) :: i_step              !! its number
   end subroutine suit

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

   !> The same of springs that slip stretches, 0 unless overridden [L].
   pure function stretch(self)
      class(contact_law_t), intent(in) :: self   !! it has responded
      real(wp) :: stretch(most_slips)

      stretch = 0.0_wp
   end function stretch

   !> What slip has added to what the law stores in a step, 0 unless overridden [M L^2/T^2].
   pure real(wp) function gained(self)
      class(contact_law_t), intent(in) :: self   !! it has responded

      gained = 0.0_wp
   end function gained

   !> Has the law stored in steps before what it gives back in this one? Not unless overridden.
   pure logical function gives_back(self)
      class(contact_law_t), intent(in) :: self

      gives_back = .false.
   end function gives_back

   !> By how much an impact changes the rate of a gap once it has been reversed, 0 unless overridden
   !> [L/T].
   pure real(wp) function rate_change(self, rate)
      class(contact_law_t), intent(in) :: self
      real(wp), intent(in) :: rate               !! without that, at the end of the step [L/T]

      rate_change = 0.0_wp
   end function rate_change

   !> Let one more law act beside the others.
   pure subroutine contact_laws_add(self, law)
      type(contact_laws_t), intent(inout) :: self
      class(contact_law_t), intent(in) :: law    !! it is copied
      type(contact_law_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%beside)) n = size(self%beside)
      allocate(longer(n + 1))
      do i = 1, n
         call move_alloc(self%beside(i)%law, longer(i)%law)
      end do
      allocate(longer(n + 1)%law, source=law)
      call move_alloc(longer, self%beside)
   end subroutine contact_laws_add

   !> A step of the deck begins.
   pure subroutine contact_laws_suit(self, i_step)
      type(contact_laws_t), intent(inout) :: self
      integer, intent(in) :: i_step              !! its number
      integer :: i

      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         call self%beside(i)%law%suit(i_step)
      end do
   end subroutine contact_laws_suit

   !> Add copies of the laws of a pair that act on what is near, before a step is solved.
   pure subroutine contact_laws_begin(self, of_pair, place)
      type(contact_laws_t), intent(inout) :: self
      type(contact_laws_t), intent(in) :: of_pair
      type(contact_place_t), intent(in) :: place
      integer :: i

      if (.not. allocated(of_pair%beside)) return
      do i = 1, size(of_pair%beside)
         if (.not. of_pair%beside(i)%law%acts_near()) cycle
         call contact_laws_add(self, of_pair%beside(i)%law)
         call self%beside(size(self%beside))%law%begin(place)
      end do
   end subroutine contact_laws_begin

   !> What the laws beside the rows respond, as a sum.
   pure subroutine contact_laws_respond(self, at, response)
      type(contact_laws_t), intent(inout) :: self        !! some law acts beside the rows
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response   !! what rows give stays
      integer :: i

      response = contact_response_t(stick=response%stick)
      do i = 1, size(self%beside)
         associate (own => self%beside(i)%response)
            own = contact_response_t()
            call self%beside(i)%law%respond(at, own)
            response%lam = response%lam + own%lam
            response%tau = response%tau + own%tau
            response%mu_sigma = response%mu_sigma + own%mu_sigma
            response%stiffness = response%stiffness + own%stiffness
         end associate
      end do
   end subroutine contact_laws_respond

   !> Their forces along the surface, as a sum [M L/T^2].
   pure function contact_laws_drag(self) result(tau)
      type(contact_laws_t), intent(in) :: self   !! they have responded
      real(wp) :: tau(most_slips)
      integer :: i

      tau = 0.0_wp
      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         tau = tau + self%beside(i)%response%tau
      end do
   end function contact_laws_drag

   !> What those laws have taken whose loss is of the kind `kind` [M L^2/T^2].
   pure real(wp) function contact_laws_dissipated(self, at, kind) result(dissipated)
      type(contact_laws_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at   !! to which they have responded
      integer, intent(in) :: kind                !! one of the `loss_` codes
      integer :: i

      dissipated = 0.0_wp
      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         associate (law => self%beside(i)%law)
            if (law%loss == kind) dissipated = dissipated + law%dissipated(at, &
               self%beside(i)%response)
         end associate
      end do
   end function contact_laws_dissipated

   !> The gap up to which laws act on what is near [L]; < 0: none does.
   pure real(wp) function contact_laws_reach(self) result(reach)
      type(contact_laws_t), intent(in) :: self
      integer :: i

      reach = -1.0_wp
      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         associate (law => self%beside(i)%law)
            if (law%acts_near()) reach = max(reach, law%reach)
         end associate
      end do
   end function contact_laws_reach

   !> Has a law forces along the surface?
   pure logical function contact_laws_rub(self) result(rub)
      type(contact_laws_t), intent(in) :: self
      integer :: i

      rub = .false.
      if (allocated(self%row)) rub = self%row%has_friction
      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         rub = rub .or. self%beside(i)%law%has_friction
      end do
   end function contact_laws_rub

   !> By how much impacts change the rate of a gap [L/T].
   pure real(wp) function contact_laws_rate_change(self, rate) result(change)
      type(contact_laws_t), intent(in) :: self
      real(wp), intent(in) :: rate               !! at the end of the step [L/T]
      integer :: i

      change = 0.0_wp
      if (.not. allocated(self%beside)) return
      do i = 1, size(self%beside)
         change = change + self%beside(i)%law%rate_change(rate)
      end do
   end function contact_laws_rate_change

end module emcon_contact_law
