!> Condition numbers of the tangent that the last increment of a deck was solved with.
!>
!>     ties_condition DECK [NAME=VALUE ...]
!>
!> Runs the deck and prints one line: form, rows, three conditions, smallest and largest eigenvalue,
!> number of negative eigenvalues. `null space` is eq. (7) of the paper, P^T N DF: one condition,
!> three times. `saddle point` is eq. (6): as it is printed, with rows of ties that are integrals;
!> with all multipliers scaled by the largest diagonal entry of N; and as the program solves it,
!> the rows of ties moreover divided by the integral of their multiplier. The sign of the lower rows
!> is turned: that makes it symmetric where N is and leaves singular values alone. Eigenvalues are
!> those of the symmetric part. Dense LAPACK: for some hundred unknowns.
program ties_condition
   use, intrinsic :: iso_fortran_env, only : error_unit, output_unit
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp
   use emcon_lapack, only : dense_eigen, dense_singular_values, dense_solve
   use emcon_march, only : increment_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_is_done, stepper_open, &
      stepper_t
   use emcon_steps, only : method_saddle_point
   use emcon_text, only : string_t
   implicit none
   type(stepper_t) :: stepper
   type(error_t), allocatable :: error

   call run_deck()
   if (.not. allocated(error)) call report()
   if (allocated(error)) write(error_unit, "(a)") error%message
   call stepper_close(stepper)
   if (allocated(error)) error stop

contains

   !> Run the deck of the command line.
   subroutine run_deck()
      type(string_t), allocatable :: override(:)
      type(increment_t) :: increment
      character(len=:), allocatable :: path
      integer :: i

      allocate(override(max(0, command_argument_count() - 1)))
      call argument(1, path)
      do i = 1, size(override)
         call argument(i + 1, override(i)%text)
      end do
      call stepper_open(stepper, path, override, .false., error)
      do while (.not. allocated(error))
         if (stepper_is_done(stepper)) exit
         call stepper_advance(stepper, increment, error)
      end do
   end subroutine run_deck

   subroutine argument(i, text)
      integer, intent(in) :: i
      character(len=:), allocatable, intent(out) :: text
      integer :: length

      call get_command_argument(i, length=length)
      allocate(character(len=length) :: text)
      if (length > 0) call get_command_argument(i, text)
   end subroutine argument

   !> The matrix of the last increment.
   subroutine report()
      real(dp), allocatable :: a(:, :), length(:)
      integer :: n, k

      associate (march => stepper%march, set => stepper%march%active%set)
         n = march%system%space%numbering%n_unknown
         if (set%n == 0) then
            a = dense(march%system%matrix)
            call print_line("null space", a, [(1.0_dp, k = 1, n)], 1.0_dp)
         else if (march%newton%correction%method == method_saddle_point) then
            allocate(length(n + set%n), source=1.0_dp)
            do k = 1, set%n
               associate (is_linear => set%id(k) <= march%system%space%linear%n)
                  if (is_linear) length(n + k) = real(set%item(k)%size, dp)
               end associate
            end do
            a = dense(march%newton%correction%saddle_point%full)
            a(n + 1:, :) = -a(n + 1:, :)
            call print_line("saddle point", a, length, &
               march%newton%correction%saddle_point%scale, n)
         else
            a = dense(march%newton%correction%null_space%reduced)
            call print_line("null space", a, [(1.0_dp, k = 1, size(a, 1))], 1.0_dp)
         end if
      end associate
   end subroutine report

   pure function dense(matrix) result(a)
      type(csr_t), intent(in) :: matrix
      real(dp), allocatable :: a(:, :)
      integer :: i, k

      allocate(a(matrix%n_row, matrix%n_col), source=0.0_dp)
      do i = 1, matrix%n_row
         do k = matrix%row_start(i) + 1, matrix%row_start(i + 1)
            a(i, matrix%column(k) + 1) = matrix%value(k)
         end do
      end do
   end function dense

   !> One line for `a`, where rows and columns beyond `n_unknown` carry the factor `scale`, and
   !> would be integrals with a further `length`.
   subroutine print_line(form, a, length, scale, n_unknown)
      character(len=*), intent(in) :: form
      real(dp), intent(in), contiguous :: a(:, :)
      real(dp), intent(in), contiguous :: length(:)
      real(dp), intent(in) :: scale
      integer, intent(in), optional :: n_unknown
      real(dp), allocatable :: lambda(:), vector(:, :), inverse(:, :), factor(:)
      real(dp) :: condition(3)

      call dense_eigen(0.5_dp*(a + transpose(a)), lambda, vector, error)
      if (allocated(error)) return
      call invert(a, inverse)
      allocate(factor, source=length)
      if (present(n_unknown)) factor(n_unknown + 1:) = factor(n_unknown + 1:)/scale
      condition(1) = condition_scaled(a, inverse, factor)
      condition(2) = condition_scaled(a, inverse, length)
      factor = 1.0_dp
      condition(3) = condition_scaled(a, inverse, factor)
      if (allocated(error)) return
      write(output_unit, "(2a, i0, 5(a, es13.5e3), a, i0)") form, ",", size(a, 1), ",", &
         condition(1), ",", condition(2), ",", condition(3), ",", lambda(1), ",", &
         lambda(size(lambda)), ",", count(lambda < 0.0_dp)
   end subroutine print_line

   !> A^-1; zero if there is none.
   subroutine invert(a, inverse)
      real(dp), intent(in), contiguous :: a(:, :)
      real(dp), allocatable, intent(out) :: inverse(:, :)
      real(dp), allocatable :: unit(:, :)
      logical :: is_singular
      integer :: i, n

      n = size(a, 1)
      allocate(unit(n, n), inverse(n, n), source=0.0_dp)
      do i = 1, n
         unit(i, i) = 1.0_dp
      end do
      call dense_solve(a, unit, inverse, is_singular)
   end subroutine invert

   !> Condition number of S A S for S = diag(factor): the largest singular value of that matrix
   !> times that of its inverse. The smallest one itself would be lost in the round-off.
   real(dp) function condition_scaled(a, inverse, factor)
      real(dp), intent(in), contiguous :: a(:, :), inverse(:, :), factor(:)
      real(dp), allocatable :: sigma(:), scaled(:, :)
      type(error_t), allocatable :: failure
      integer :: i, j, n

      condition_scaled = 0.0_dp
      n = size(a, 1)
      allocate(scaled(n, n))
      do j = 1, n
         scaled(:, j) = [(factor(i)*a(i, j)*factor(j), i = 1, n)]
      end do
      call dense_singular_values(scaled, sigma, failure)
      if (.not. allocated(failure)) then
         condition_scaled = sigma(1)
         do j = 1, n
            scaled(:, j) = [(inverse(i, j)/factor(i)/factor(j), i = 1, n)]
         end do
         call dense_singular_values(scaled, sigma, failure)
         condition_scaled = condition_scaled*sigma(1)
      end if
      if (allocated(failure)) call move_alloc(failure, error)
   end function condition_scaled

end program ties_condition
