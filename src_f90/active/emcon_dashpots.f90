!> Which contacts are damped in a step: those that act and those whose surfaces are near, by the law
!> of their pairs. Source: docs/theory.md, eqs. (14n) to (14q).
module emcon_dashpots
   use emcon_constraints, only : constraint_set_t, constraints_dissipated
   use emcon_contact, only : contact_t
   use emcon_dashpot_law, only : dashpot_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_is_dynamic, step_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: dashpots_t, dashpots_begin_step, dashpots_restart, dashpots_look, dashpots_select, &
      dashpots_work, dashpots_idle

   !> A gap of less than this fraction of an edge is round-off.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))

   type :: dashpots_t
      logical :: is_on = .false.                 !! some pair is damped, in this step
      real(wp), allocatable :: area(:)           !! (n_constraint) of contacts that are [L^2]
      !> (n_constraint) they are in this increment; there are only more of them as it is solved
      logical, allocatable :: is_near(:)
   end type dashpots_t

contains

   !> Set up for `step`, whose contacts are laid out. Surfaces made of nodes have no areas: the
   !> coefficient is a force by velocity there. Where nodes of both sides are held each has half.
   pure subroutine dashpots_begin_step(self, system, scene, step)
      type(dashpots_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      integer :: k

      do k = 1, size(system%contact)
         self%is_on = self%is_on .or. system%contact(k)%contact%damping%coefficient > 0.0_wp
      end do
      self%is_on = self%is_on .and. step_is_dynamic(step)
      if (.not. self%is_on) return
      allocate(self%area(system%n_constraint), source=0.0_wp)
      allocate(self%is_near(system%n_constraint), source=.false.)
      do k = 1, size(system%contact)
         associate (contact => system%contact(k)%contact, before => system%first_constraint(k))
            if (.not. contact%damping%coefficient > 0.0_wp) cycle
            associate (area => self%area(before + 1:before + contact%n_constraint))
               call contact%own_area(scene%x, area)
               if (.not. sum(area) > 0.0_wp) area = 1.0_wp
               if (contact%both_sides) area = 0.5_wp*area
            end associate
         end associate
      end do
   end subroutine dashpots_begin_step

   !> An increment begins, or begins again.
   pure subroutine dashpots_restart(self)
      type(dashpots_t), intent(inout) :: self

      if (self%is_on) self%is_near = .false.
   end subroutine dashpots_restart

   !> Are there no contacts of this kind?
   pure logical function dashpots_idle(self, contact) result(is_idle)
      type(dashpots_t), intent(in) :: self
      class(contact_t), intent(in) :: contact

      is_idle = .not. (self%is_on .and. contact%damping%coefficient > 0.0_wp)
   end function dashpots_idle

   !> Take in what contact `k`, measured, finds near enough.
   pure subroutine dashpots_look(self, system, k, is_active, grows)
      type(dashpots_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: k                   !! number of a contact that is damped
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
   end subroutine dashpots_look

   !> Is constraint `i` within the clearance in the step, in front of its surface? From behind, the
   !> other side of a thin body is meant.
   pure logical function comes_near(contact, i)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i

      associate (gap => contact%state(i))
         comes_near = gap%is_near .and. gap%is_over .and. .not. (gap%is_arriving .or. &
            gap%is_leaving)
         comes_near = comes_near .and. &
            gap%gap0 >= -contact%max_penetration_at_start*gap%size .and. &
            (min(gap%gap0, gap%gap1) < contact%damping%clearance .or. touches(contact, i))
      end associate
   end function comes_near

   !> Without a clearance, is the gap of constraint `i` none but for round-off? It need not act: of
   !> a rigid body a few nodes hold all.
   pure logical function touches(contact, i)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i

      touches = .not. (contact%damping%clearance > 0.0_wp .or. contact%gives_way) .and. &
         contact%state(i)%gap0 <= touch_tol*contact%state(i)%size
   end function touches

   !> Let the laws of the conditions of `set` behind its own, which are near, be those of damping.
   !> What contact holds exactly is closed, whatever gap that leaves.
   pure subroutine dashpots_select(self, system, is_active, set)
      type(dashpots_t), intent(in) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: is_active(:)        !! (n_constraint)
      type(constraint_set_t), intent(inout) :: set
      integer :: j, k

      k = 1
      do j = set%n + 1, set%n_condition
         associate (id => set%id(j), item => set%item(j))
            do while (id > system%first_constraint(k + 1))
               k = k + 1
            end do
            associate (contact => system%contact(k)%contact, i => id - system%first_constraint(k))
               set%target(j) = contact%state(i)%gap0
               item%rubs = contact%damping%tangent > 0.0_wp
               allocate(set%law(j)%law, source=dashpot_t(contact%damping, &
                  contact%share(i)*self%area(id), set%target(j), (is_active(id) .and. .not. &
                  contact%gives_way) .or. touches(contact, i)))
            end associate
         end associate
      end do
   end subroutine dashpots_select

   !> What damping has taken in the step that `set` has solved, >= 0.
   pure real(wp) function dashpots_work(set) result(work)
      type(constraint_set_t), intent(in) :: set
      integer :: k

      work = 0.0_wp
      do k = set%n + 1, set%n_condition
         work = work + constraints_dissipated(set, k)
      end do
   end function dashpots_work

end module emcon_dashpots
