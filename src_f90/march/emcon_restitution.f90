!> Impacts that keep a part of their velocity: RESTITUTION below 1.
!>
!> A step that holds a gap reverses its rate. The part of that which is not kept is taken out by
!> impulses along the normals: momenta stay, and the energy that goes is known.
!> Source: docs/theory.md, eq. (22e).
module emcon_restitution
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_index
   use emcon_contact_law, only : contact_laws_rate_change
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t
   use emcon_text, only : note_add, notes_t
   use emcon_velocity_jumps, only : jumps_add
   use emcon_velocity_update, only : rate_jump_t, velocity_update_change
   implicit none
   private
   public :: restitution_take

contains

   !> Take out of the velocities at the end of the step what its impacts do not keep.
   subroutine restitution_take(self, notes, error)
      type(march_t), intent(inout) :: self
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error
      type(rate_jump_t) :: jump
      real(wp), allocatable :: lam(:)

      if (self%active%set%n == self%active%set%n_permanent .or. .not. is_asked(self)) return
      call find_impacts(self, jump)
      if (.not. any(jump%change < 0.0_wp)) return
      associate (set => self%active%set, ledger => self%ledger)
         call velocity_update_change(self%velocity_update, self%system, set, jump, &
            self%end_state%v, error)
         if (allocated(error)) return
         if (.not. jump%is_done) then
            call note_add(notes, "contacts that close in this step rebound fully, whatever their " &
               // "RESTITUTION says: they depend on each other")
            return
         end if
         ledger%external_work = ledger%external_work + (jump%gained + jump%lost)
         ledger%contact_work = ledger%contact_work - jump%lost
         ledger%restitution = ledger%restitution + jump%lost
         allocate(lam(set%n), source=0.0_wp)
         lam(jump%row) = jump%impulse
         call jumps_add(self%end_state%jump, set, lam)
      end associate
   end subroutine restitution_take

   !> Has some pair a law that changes rates?
   pure logical function is_asked(self)
      type(march_t), intent(in) :: self
      integer :: k

      is_asked = .false.
      do k = 1, size(self%system%contact)
         associate (laws => self%system%contact(k)%contact%laws)
            is_asked = is_asked .or. abs(contact_laws_rate_change(laws, 1.0_wp)) > 0.0_wp
         end associate
      end do
   end function is_asked

   !> The conditions that an impact has to do with, their rates at the end of the step and by how
   !> much these are to change: a gap that was held and opens keeps a part of its rate. What acts on
   !> nodes without mass is left out: no impulse acts there.
   subroutine find_impacts(self, jump)
      type(march_t), intent(in) :: self
      type(rate_jump_t), intent(out) :: jump
      real(wp) :: rate(self%active%set%n), change(size(rate))
      logical :: is_row(size(rate))
      integer :: k, i, pair

      change = 0.0_wp
      associate (set => self%active%set)
         is_row = [(k > set%n_linear, k = 1, set%n)]
         do k = set%n_linear + 1, set%n
            rate(k) = condition_rate(set%item(k), self%end_state%v)
            call constraint_index(self%system, set%id(k), pair, i)
            if (pair == 0) cycle
            associate (contact => self%system%contact(pair)%contact, &
                  node => set%item(k)%node(:set%item(k)%n_node))
               is_row(k) = .not. any(self%massless%without_density(node))
               if (self%layer%is_on) then
                  is_row(k) = is_row(k) .and. .not. any(self%layer%is_massless(node))
               end if
               if (is_row(k)) change(k) = contact_laws_rate_change(contact%laws, rate(k))
            end associate
         end do
         jump%row = pack([(k, k = 1, set%n)], is_row)
         jump%rate = rate(jump%row)
         jump%change = change(jump%row)
      end associate
   end subroutine find_impacts

end module emcon_restitution
