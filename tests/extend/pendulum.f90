!> Rods that a program adds to EMCON hold masses and bodies: `pendulum DECK MASS A B C D ...` with a
!> mass of each node and pairs of nodes. It prints, over all increments, the largest change of a
!> length over that length, the largest change of the total energy, the largest work of loads, and
!> the largest number of active contacts.
program pendulum
   use emcon_api, only : csr_from_entries, csr_t, dp, error_t, increment_t, stepper_advance, &
      stepper_build, stepper_close, stepper_give_constraint, stepper_give_mass, stepper_is_done, &
      stepper_read, stepper_t, string_t, wp
   use rods, only : rods_t
   implicit none
   type(stepper_t) :: stepper
   type(increment_t) :: increment
   type(error_t), allocatable :: error
   type(rods_t) :: rod
   character(len=4096) :: deck
   integer :: k, n_active, n_node
   real(wp) :: total, drift, strain, work

   call get_command_argument(1, deck)
   call stepper_read(stepper, trim(deck), [string_t ::], .false., error)
   call check()
   n_node = size(stepper%scene%x, 2)
   call give_masses()
   call give_rods()
   call stepper_build(stepper, error)
   call check()
   total = stepper%march%ledger%total
   drift = 0.0_wp
   strain = 0.0_wp
   n_active = 0
   work = 0.0_wp
   do while (.not. stepper_is_done(stepper))
      call stepper_advance(stepper, increment, error)
      call check()
      drift = max(drift, abs(stepper%march%ledger%total - total))
      work = max(work, abs(stepper%march%ledger%external_work))
      n_active = max(n_active, increment%n_active)
      do k = 1, rod%n_constraint
         associate (a => rod%node(1, k), b => rod%node(2, k), x => stepper%scene%x)
            strain = max(strain, abs(norm2(place(b) - place(a))/norm2(x(:, b) - x(:, a)) - 1.0_wp))
         end associate
      end do
   end do
   write(*, "(3es24.16, i4)") strain, drift, work, n_active
   call stepper_close(stepper)

contains

   function place(node)
      integer, intent(in) :: node
      real(wp) :: place(2)

      place = stepper%scene%x(:, node) + stepper%march%state%u(:, node)
   end function place

   integer function argument(k)
      integer, intent(in) :: k
      character(len=32) :: text

      call get_command_argument(k, text)
      read(text, *) argument
   end function argument

   subroutine give_masses()
      type(csr_t) :: mass
      integer, allocatable :: slot(:)
      integer :: i

      if (argument(2) == 0) return
      call csr_from_entries(mass, n_node, n_node, [(i, i = 1, n_node)], [(i, i = 1, n_node)], slot)
      mass%value = real(argument(2), dp)
      call stepper_give_mass(stepper, mass, error)
      call check()
   end subroutine give_masses

   subroutine give_rods()
      integer :: i

      rod%n_constraint = (command_argument_count() - 2)/2
      rod%node = reshape([(argument(2 + i), i = 1, 2*rod%n_constraint)], [2, rod%n_constraint])
      call stepper_give_constraint(stepper, rod, error)
      call check()
   end subroutine give_rods

   subroutine check()
      if (.not. allocated(error)) return
      write(*, "(a)") error%message
      call stepper_close(stepper)
      stop 1
   end subroutine check

end program pendulum
