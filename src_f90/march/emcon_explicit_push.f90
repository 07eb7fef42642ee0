!> The second half of an explicit step: the push by the forces at its end, with multipliers that
!> hold velocities there: conditions that always hold, and contacts, which do not pull.
!> Source: docs/theory.md, section 13.
module emcon_explicit_push
   use emcon_constraint, only : condition_add_field, condition_rate
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_kept_factor, only : kept_factor_correct, kept_factor_forget, &
      kept_factor_multipliers, kept_factor_renew, kept_factor_take
   use emcon_kinds, only : wp
   use emcon_march_guess, only : end_velocities, follow_links
   use emcon_march_types, only : march_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_system, only : mass_times, system_respond
   use emcon_text, only : to_text
   implicit none
   private
   public :: explicit_push

contains

   !> Find the velocities at the end of the step, of whose forces there the system has the residual.
   subroutine explicit_push(self, h, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(self%system%space%numbering%n_unknown) :: residual, dq
      logical :: was_made

      associate (system => self%system, explicit => self%explicit, kept => &
            self%newton%correction%kept)
         explicit%residual = system%response%residual
         call pick_unknowns(system%space%numbering, explicit%residual, residual)
         explicit%v1 = self%end_state%v
         call end_velocities(system, self%motion, explicit%v1)
         if (explicit%is_free) then
            explicit%mu = [real(wp) ::]
            call add_to_dofs(system%space%numbering, residual/explicit%mass, -0.5_wp*h, &
               explicit%v1)
            call find_reactions(self, h)
            return
         end if
         was_made = kept%is_made
         if (.not. was_made .and. size(dq) > 0) then
            system%lagged%is_on = .true.
            call system_respond(system, self%motion, .true., .false.)
            call kept_factor_renew(kept, system%matrix, error)
            if (allocated(error)) return
         end if
         call hold_velocities(self, h, residual, dq, error)
         if (.not. was_made) call kept_factor_forget(kept)
         if (allocated(error)) return
         call add_to_dofs(system%space%numbering, dq, 1.0_wp/h, explicit%v1)
         call follow_links(system, explicit%v1)
      end associate
      call find_reactions(self, h)
   end subroutine explicit_push

   !> `dq` is h times the push; contacts that would pull are left out.
   subroutine hold_velocities(self, h, residual, dq, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), intent(in), contiguous :: residual(:)    !! (n_unknown) at the end
      real(wp), intent(out), contiguous :: dq(:)         !! (n_unknown) [L]
      type(error_t), allocatable, intent(out) :: error
      logical :: is_in(self%active%set%n), is_fit
      real(wp) :: mu(self%active%set%n)
      integer :: k

      dq = 0.0_wp
      is_in = .true.
      associate (explicit => self%explicit, kept => self%newton%correction%kept, &
            set => self%active%set)
         explicit%mu = [(0.0_wp, k = 1, set%n)]
         if (size(dq) == 0) return
         do
            explicit%row = pack([(k, k = 1, set%n)], is_in)
            call take_rows(set, explicit%row, explicit%set)
            do k = 1, explicit%set%n
               explicit%set%defect(k) = h*condition_rate(set%item(explicit%row(k)), explicit%v1)
            end do
            call kept_factor_take(kept, explicit%set, .true., is_fit, error)
            if (.not. (is_fit .or. allocated(error))) call raise(error, err_analysis, &
               "the velocities at time " // to_text(self%state%clock%time, 9) &
               // " have no solution: contacts, ties and equations are redundant or " // &
               "contradict each other; leave some out, or use an implicit step")
            if (.not. allocated(error)) call kept_factor_correct(kept, explicit%set, residual, dq, &
               error)
            if (allocated(error)) return
            call kept_factor_multipliers(kept, mu(:explicit%set%n))
            explicit%mu = 0.0_wp
            explicit%mu(explicit%row) = mu(:explicit%set%n)
            if (.not. any(explicit%mu(set%n_permanent + 1:) < 0.0_wp)) exit
            is_in(set%n_permanent + 1:) = is_in(set%n_permanent + 1:) .and. &
               explicit%mu(set%n_permanent + 1:) >= 0.0_wp
         end do
      end associate
   end subroutine hold_velocities

   !> The rows `row` of the conditions of a set.
   subroutine take_rows(set, row, some)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: row(:)              !! (n) ascending
      type(constraint_set_t), intent(inout) :: some
      type(csr_t) :: rows
      integer :: k, n

      some%n = size(row)
      some%n_row = size(row)
      if (allocated(some%defect)) deallocate(some%defect)
      allocate(some%defect(size(row)), source=0.0_wp)
      rows%n_row = size(row)
      allocate(rows%row_start(size(row) + 1), source=0)
      if (size(row) > 0) then
         rows%n_col = set%gap_rows%n_col
         allocate(rows%column(size(set%gap_rows%column)), rows%value(size(set%gap_rows%column)))
         do k = 1, size(row)
            associate (first => set%gap_rows%row_start(row(k)) + 1, &
                  last => set%gap_rows%row_start(row(k) + 1), at => rows%row_start(k))
               n = last - first + 1
               rows%column(at + 1:at + n) = set%gap_rows%column(first:last)
               rows%value(at + 1:at + n) = set%gap_rows%value(first:last)
               rows%row_start(k + 1) = at + n
            end associate
         end do
      end if
      some%gap_rows = rows
   end subroutine take_rows

   !> What holds prescribed freedoms at the end of the step, and the contact forces there.
   subroutine find_reactions(self, h)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), dimension(size(self%end_state%v, 1), size(self%end_state%v, 2)) :: change, product
      integer :: k

      associate (explicit => self%explicit, set => self%active%set)
         change = (2.0_wp/h)*(explicit%v1 - self%motion%evaluation%rate*self%motion%du)
         call mass_times(self%system, change, product)
         explicit%residual = explicit%residual + product
         if (allocated(explicit%contact)) deallocate(explicit%contact)
         allocate(explicit%contact, mold=explicit%v1)
         explicit%contact = 0.0_wp
         do k = 1, set%n
            associate (item => set%item(k), mu => explicit%mu(k))
               call condition_add_field(item, -mu, item%c, explicit%residual)
               if (k > set%n_permanent) call condition_add_field(item, mu, item%c, explicit%contact)
            end associate
         end do
      end associate
   end subroutine find_reactions

end module emcon_explicit_push
