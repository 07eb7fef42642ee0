!> Contacts that begin and end in a solved step, and when.
module emcon_march_events
   use emcon_active_set, only : step_passes_event
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_index
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_find_acting
   use emcon_march_types, only : increment_t, march_t, part_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : events_nodes, step_t
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: events_look, events_judge, events_tell

contains

   !> Does contact begin or end in the solved step?
   pure subroutine events_look(self)
      type(march_t), intent(inout) :: self       !! solved, not committed
      logical :: acts(size(self%active%start%was_active))

      call layer_find_acting(self%layer, self%active, acts)
      associate (first => self%system%first_constraint)
         self%step_check%changes_contact = any(acts(first(1) + 1:first(self%system%n_pair + 1)) &
            .neqv. self%active%start%was_active(first(1) + 1:first(self%system%n_pair + 1)))
      end associate
   end subroutine events_look

   !> A step longer than `window` in which an event lies is to be made shorter.
   subroutine events_judge(self, step, part, window, status)
      type(march_t), intent(inout) :: self       !! solved, not committed
      type(step_t), intent(in) :: step
      type(part_t), intent(in) :: part
      real(wp), intent(in) :: window             !! > 0 [T]
      integer, intent(inout) :: status           !! one of the `step_` codes
      logical, dimension(size(self%active%start%was_active)) :: acts, is_event

      if (.not. self%step_check%changes_contact .or. part%h <= window) return
      call layer_find_acting(self%layer, self%active, acts)
      call find_events(self, step, self%active%start%was_active, acts, is_event)
      if (.not. any(is_event)) return
      status = step_passes_event
      call find_first(self, part%h, is_event, self%step_check%event_at)
   end subroutine events_judge

   !> Which contacts begin or end: all, or the first and the last ones of a pair.
   pure subroutine find_events(self, step, before, after, is_event)
      type(march_t), intent(in) :: self
      type(step_t), intent(in) :: step
      logical, intent(in) :: before(:), after(:)     !! (n_constraint) what acts
      logical, intent(out) :: is_event(:)            !! (n_constraint)
      integer :: pair

      is_event = .false.
      do pair = 1, self%system%n_pair
         associate (first => self%system%first_constraint(pair) + 1, &
               last => self%system%first_constraint(pair + 1))
            if (step%time%events /= events_nodes .and. (any(before(first:last)) .eqv. &
               any(after(first:last)))) cycle
            is_event(first:last) = before(first:last) .neqv. after(first:last)
         end associate
      end do
   end subroutine find_events

   !> The part of the step after which the first gap closes, by the velocities at its start; of
   !> contacts that end one half.
   pure subroutine find_first(self, h, is_event, part)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      logical, intent(in) :: is_event(:)         !! (n_constraint)
      real(wp), intent(out) :: part              !! 0..1
      real(wp) :: change, open
      integer :: k, i, pair

      part = 1.0_wp
      if (any(is_event .and. self%active%start%was_active)) part = 0.5_wp
      associate (set => self%active%set)
         do k = set%n_permanent + 1, set%n
            if (.not. is_event(set%id(k))) cycle
            change = h*condition_rate(set%item(k), self%motion%v0)
            ! Not that of the condition, which may hold the gap of the start.
            call constraint_index(self%system, set%id(k), pair, i)
            associate (gap => self%system%contact(pair)%contact%state(i))
               open = gap%gap0 - gap%closed
            end associate
            if (-change > open) then
               part = min(part, max(0.0_wp, -open/change))
            else
               part = min(part, 0.5_wp)
            end if
         end do
      end associate
   end subroutine find_first

   !> Tell of the events of the increment that was committed.
   subroutine events_tell(self, scene, step, part, increment)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      logical, dimension(size(self%active%start%was_active)) :: is_event, acts
      character(len=:), allocatable :: what
      integer :: pair, i, id

      acts = self%state%contacts%status([(id, id = 1, size(is_event))]) > 0
      call find_events(self, step, self%active%start%was_active, acts, is_event)
      do pair = 1, self%system%n_pair
         do i = 1, self%system%contact(pair)%contact%n_constraint
            id = self%system%first_constraint(pair) + i
            if (.not. is_event(id)) cycle
            what = "ends"
            if (acts(id)) what = "begins"
            self%state%control%n_event = self%state%control%n_event + 1
            call note_add(increment%notes, "event: contact " // what // " in pair " // &
               to_text(pair) // " at slave node " // &
               to_text(scene%node%label(self%system%contact(pair)%contact%node(i))) // &
               ", time " // to_text(part%start%total_time, 12) // " to " // &
               to_text(part%start%total_time + part%h, 12))
         end do
      end do
   end subroutine events_tell

end module emcon_march_events
