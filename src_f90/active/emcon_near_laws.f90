!> Laws of contact that act on what is near, beside the rows of gaps: where surfaces are closer
!> than the laws of their pair reach, and where contact acts.
!>
!> Source: docs/theory.md, eqs. (14n) to (14q).
module emcon_near_laws
   use emcon_constraints, only : constraint_index, constraint_set_t
   use emcon_contact, only : contact_t
   use emcon_contact_law, only : contact_laws_begin, contact_laws_reach, contact_laws_rub, &
      contact_place_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_is_dynamic, step_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: near_laws_t, near_laws_begin_step, near_laws_update, near_laws_select, &
      near_laws_are_none

   !> A gap of less than this fraction of an edge is round-off.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))

   type :: near_laws_t
      logical :: is_on = .false.                 !! some pair has such laws, in this step
      real(wp), allocatable :: area(:)           !! (n_constraint) of contacts that have [L^2]
      !> (n_constraint) they act in this increment; there are only more as it is solved
      logical, allocatable :: is_near(:)
      logical, allocatable :: is_held(:)         !! (n_constraint) contact holds them, or may
   end type near_laws_t

contains

   !> Set up for `step`, whose contacts are laid out. Surfaces made of nodes have no areas: laws of
   !> pressures give forces there. Where nodes of both sides are held each has half.
   pure subroutine near_laws_begin_step(self, system, scene, step)
      type(near_laws_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      integer :: k

      do k = 1, size(system%contact)
         self%is_on = self%is_on .or. contact_laws_reach(system%contact(k)%contact%laws) >= 0.0_wp
      end do
      self%is_on = self%is_on .and. step_is_dynamic(step)
      if (.not. self%is_on) return
      allocate(self%area(system%n_constraint), source=0.0_wp)
      allocate(self%is_near(system%n_constraint), self%is_held(system%n_constraint), &
         source=.false.)
      do k = 1, size(system%contact)
         associate (contact => system%contact(k)%contact, before => system%first_constraint(k))
            if (contact_laws_reach(contact%laws) < 0.0_wp) cycle
            associate (area => self%area(before + 1:before + contact%n_constraint))
               call contact%own_area(scene%x, area)
               if (.not. sum(area) > 0.0_wp) area = 1.0_wp
               area = contact%area_factor*area
            end associate
         end associate
      end do
   end subroutine near_laws_begin_step

   !> Has a contact no such laws, in this step?
   pure logical function near_laws_are_none(self, contact) result(are_none)
      type(near_laws_t), intent(in) :: self
      class(contact_t), intent(in) :: contact

      are_none = .not. self%is_on
      if (.not. are_none) are_none = contact_laws_reach(contact%laws) < 0.0_wp
   end function near_laws_are_none

   !> Take in what contact `k`, measured, finds near enough.
   pure subroutine near_laws_update(self, system, k, is_active, grows)
      type(near_laws_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: k                   !! number of a contact that has such laws
      logical, intent(in) :: is_active(:)        !! (n_constraint)
      logical, intent(inout) :: grows            !! becomes true if there are new ones
      integer :: i

      associate (contact => system%contact(k)%contact, before => system%first_constraint(k))
         do i = 1, contact%n_constraint
            if (self%is_near(before + i)) cycle
            self%is_near(before + i) = is_active(before + i) .or. comes_near(contact, i)
            grows = grows .or. self%is_near(before + i)
         end do
      end associate
   end subroutine near_laws_update

   !> Is constraint `i` within reach in the step, in front of its surface? From behind, the other
   !> side of a thin body is meant.
   pure logical function comes_near(contact, i)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i

      associate (gap => contact%state(i))
         comes_near = gap%is_near .and. gap%is_over .and. .not. (gap%is_arriving .or. &
            gap%is_leaving)
         comes_near = comes_near .and. &
            gap%gap0 >= -contact%max_penetration_at_start*gap%size .and. &
            (min(gap%gap0, gap%gap1) < contact_laws_reach(contact%laws) .or. touches(contact, i))
      end associate
   end function comes_near

   !> Of laws without reach, is the gap of constraint `i` none but for round-off? It need not act:
   !> of a rigid body a few nodes hold all.
   pure logical function touches(contact, i)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i

      touches = .not. (contact_laws_reach(contact%laws) > 0.0_wp .or. contact%step%is_penalty) &
         .and. contact%state(i)%gap0 <= touch_tol*contact%state(i)%size
   end function touches

   !> Let such laws act on the conditions of `set` that are near, beside their rows or where they
   !> have none. What contact holds exactly is closed, whatever gap that leaves.
   pure subroutine near_laws_select(self, system, set)
      type(near_laws_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(inout) :: set
      type(contact_place_t) :: place
      integer :: j, i, pair

      do j = 1, set%n_condition
         if (.not. self%is_near(set%id(j))) cycle
         call constraint_index(system, set%id(j), pair, i)
         associate (contact => system%contact(pair)%contact, item => set%item(j))
            if (j > set%n) set%target(j) = contact%state(i)%gap0
            place = contact_place_t(area=self%area(set%id(j)), share=contact%share(i), &
               gap=contact%state(i)%gap0, is_closed=touches(contact, i) .or. &
               (self%is_held(set%id(j)) .and. .not. contact%step%is_penalty))
            call contact_laws_begin(set%law(j), contact%laws, place)
            item%has_friction = item%has_friction .or. contact_laws_rub(set%law(j))
         end associate
      end do
   end subroutine near_laws_select

end module emcon_near_laws
