!> Contacts that do not move each other are problems of their own: each is solved by itself.
!>
!> Bodies that stand apart, or that touch something held alone, are not coupled by W. A problem
!> costs the cube of its contacts in each trial, and one that is hard to solve makes all of its
!> contacts try again. Only where slip has a direction: there all candidates of a step are rows.
!> Source: docs/theory.md, section 14.3.
module emcon_contact_parts
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_missed, contact_problem_t, nearly_met
   use emcon_contact_solution, only : contact_problem_solve
   use emcon_contact_trials, only : contact_slope_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: contact_parts_solve, contact_parts_find

contains

   !> Forces that obey the law at all contacts.
   subroutine contact_parts_solve(self, push, effort, is_solved, near_enough, slope, stays_near)
      type(contact_problem_t), intent(in) :: self
      real(wp), intent(inout) :: push(0:, :)         !! (0:n_slip, n) start, solution: y [M L/T^2]
      type(contact_effort_t), intent(out) :: effort  !! sum over parts
      logical, intent(out) :: is_solved              !! else `push` is as near as it came
      logical, intent(in) :: near_enough             !! as of `contact_problem_solve`
      type(contact_slope_t), intent(inout), optional :: slope    !! as there
      logical, intent(in), optional :: stays_near    !! as there
      type(contact_problem_t) :: own
      type(contact_effort_t) :: more
      integer :: part(size(self%mu)), p, i
      integer, allocatable :: contact(:)
      real(wp), allocatable :: own_push(:, :)
      logical :: is_own

      part = 1
      if (self%n_slip > 1 .and. any(self%mu > 0.0_wp)) call contact_parts_find(self, part)
      if (all(part == 1)) then
         call contact_problem_solve(self, push, effort, is_solved, near_enough, slope, stays_near)
         return
      end if
      is_solved = .true.
      do p = 1, maxval(part)
         contact = pack([(i, i = 1, size(part))], part == p)
         call pick(self, contact, own)
         own_push = push(:, contact)
         call contact_problem_solve(own, own_push, more, is_own, near_enough, stays_near=stays_near)
         push(:, contact) = own_push
         is_solved = is_solved .and. is_own
         effort = contact_effort_t(effort%n_trial + more%n_trial, effort%n_sweep + more%n_sweep, &
            effort%n_pivot + more%n_pivot, effort%n_near + more%n_near, &
            effort%n_path + more%n_path)
      end do
      ! A part of which all forces are round-off of the others may miss its own laws.
      if (.not. is_solved) is_solved = contact_problem_missed(self, push) <= nearly_met
   end subroutine contact_parts_solve

   !> Number the parts that W couples, from 1 on.
   pure subroutine contact_parts_find(self, part)
      type(contact_problem_t), intent(in) :: self
      integer, intent(out) :: part(:)                !! (n)
      integer :: waiting(size(part)), n_waiting, n_part, first, i, k

      part = 0
      n_part = 0
      do first = 1, size(part)
         if (part(first) > 0) cycle
         n_part = n_part + 1
         part(first) = n_part
         n_waiting = 1
         waiting(1) = first
         do while (n_waiting > 0)
            i = waiting(n_waiting)
            n_waiting = n_waiting - 1
            do k = 1, size(part)
               if (part(k) > 0) cycle
               if (.not. (moves(self, i, k) .or. moves(self, k, i))) cycle
               part(k) = n_part
               n_waiting = n_waiting + 1
               waiting(n_waiting) = k
            end do
         end do
      end do
   end subroutine contact_parts_find

   !> Do the forces of contact `k` move contact `i`?
   pure logical function moves(self, i, k)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: i, k                    !! 1 to n

      associate (m => 1 + self%n_slip)
         moves = maxval(abs(self%w(m*(i - 1) + 1:m*i, m*(k - 1) + 1:m*k))) > 0.0_wp
      end associate
   end function moves

   !> The problem of some contacts.
   pure subroutine pick(self, contact, own)
      type(contact_problem_t), intent(in) :: self
      integer, intent(in) :: contact(:)
      type(contact_problem_t), intent(out) :: own
      integer :: row((1 + self%n_slip)*size(contact)), i, k, m

      m = 1 + self%n_slip
      row = [((m*(contact(i) - 1) + k, k = 1, m), i = 1, size(contact))]
      call contact_problem_create(own, self%n_slip, size(contact))
      own%w = self%w(row, row)
      own%free = self%free(:, contact)
      own%base = self%base(:, contact)
      own%hold = self%hold(:, contact)
      own%start = self%start(:, contact)
      own%slip_target = self%slip_target(:, contact)
      own%mu = self%mu(contact)
      own%stiffness = self%stiffness(contact)
   end subroutine pick

end module emcon_contact_parts
