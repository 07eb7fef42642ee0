!> Seconds for the tangent T^T N T of a deck with ties: dependent freedoms eliminated while
!> elements are assembled, or N assembled with them and T brought in by a product.
!>
!>     ties_elimination DECK [NAME=VALUE ...]
!>
!> Prints a table; asserts nothing. Element matrices are the same made-up ones both times, so that
!> only adding them up, and the elimination, is timed. Times are the least of several runs.
program ties_elimination
   use, intrinsic :: iso_fortran_env, only : error_unit, output_unit
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp
   use emcon_reduction, only : freedom_numbers, reduction_add, reduction_init, reduction_t
   use emcon_space, only : lists_begin, lists_t
   use emcon_stepper, only : stepper_close, stepper_open, stepper_t
   use emcon_system, only : system_t
   use emcon_text, only : string_t
   use emcon_timer, only : cpu_seconds
   use emcon_triple_product, only : triple_product_init, triple_product_t, triple_product_update
   implicit none
   integer, parameter :: n_run = 7
   type(stepper_t) :: stepper
   type(error_t), allocatable :: error

   call open_deck()
   if (allocated(error)) then
      write(error_unit, "(a)") error%message
   else
      call compare(stepper%march%system)
   end if
   call stepper_close(stepper)
   if (allocated(error)) error stop

contains

   !> Open the deck of the command line.
   subroutine open_deck()
      type(string_t), allocatable :: override(:)
      character(len=:), allocatable :: path
      integer :: i

      allocate(override(max(0, command_argument_count() - 1)))
      call argument(1, path)
      do i = 1, size(override)
         call argument(i + 1, override(i)%text)
      end do
      call stepper_open(stepper, path, override, .false., error)
   end subroutine open_deck

   subroutine argument(i, text)
      integer, intent(in) :: i
      character(len=:), allocatable, intent(out) :: text
      integer :: length

      call get_command_argument(i, length=length)
      allocate(character(len=length) :: text)
      if (length > 0) call get_command_argument(i, text)
   end subroutine argument

   !> Both ways for the numbering of `system`.
   subroutine compare(system)
      type(system_t), intent(in) :: system
      type(csr_t) :: direct, product
      real(dp) :: begin_direct, begin_product, add(2), eliminate(2)

      call by_elimination(system, direct, begin_direct, add(1), eliminate(1))
      call by_product(system, product, begin_product, add(2), eliminate(2))
      if (allocated(error)) return
      write(output_unit, "(a, i0, a, i0, a, i0)") "unknowns ", system%space%numbering%n_unknown, &
         ", dependent ", system%space%numbering%n_dependent, ", entries ", size(direct%column)
      write(output_unit, "(a20, 4a18)") "", "once [ms]", "elements [ms]", "T [ms]", "each time [ms]"
      write(output_unit, "(a20, 4f18.2)") "while assembling", 1.0e3_dp*[begin_direct, add(1), &
         eliminate(1), add(1) + eliminate(1)]
      write(output_unit, "(a20, 4f18.2)") "triple product", 1.0e3_dp*[begin_product, add(2), &
         eliminate(2), add(2) + eliminate(2)]
      write(output_unit, "(a20, 4f18.3)") "ratio", begin_direct/begin_product, add(1)/add(2), &
         eliminate(1)/eliminate(2), (add(1) + eliminate(1))/(add(2) + eliminate(2))
      write(output_unit, "(a, es8.1, a)") "the two matrices differ by ", &
         maxval(abs(direct%value - product%value))/maxval(abs(product%value)), &
         " of their largest entry"
   end subroutine compare

   !> As the program does it.
   subroutine by_elimination(system, matrix, begin, add, eliminate)
      type(system_t), intent(in) :: system
      type(csr_t), intent(out) :: matrix
      real(dp), intent(out) :: begin, add, eliminate
      type(reduction_t) :: reduction
      type(csr_t) :: full
      integer, allocatable :: slot(:)
      logical :: is_too_full
      real(dp) :: since
      integer :: run

      call full_pattern(system, full, slot)
      since = cpu_seconds()
      call reduction_init(reduction, system%space%numbering, full, matrix, slot, is_too_full)
      begin = cpu_seconds() - since
      add = huge(add)
      eliminate = huge(eliminate)
      do run = 1, n_run
         since = cpu_seconds()
         matrix%value = 0.0_dp
         call add_elements(slot, matrix%value, reduction%side%value)
         add = min(add, cpu_seconds() - since)
         since = cpu_seconds()
         call reduction_add(reduction, matrix)
         eliminate = min(eliminate, cpu_seconds() - since)
      end do
   end subroutine by_elimination

   !> The whole matrix first.
   subroutine by_product(system, matrix, begin, add, eliminate)
      type(system_t), intent(in) :: system
      type(csr_t), intent(out) :: matrix
      real(dp), intent(out) :: begin, add, eliminate
      type(triple_product_t) :: product
      type(csr_t) :: full, t
      integer, allocatable :: slot(:)
      real(dp) :: since, nothing(0)
      integer :: run

      call full_pattern(system, full, slot)
      since = cpu_seconds()
      call terms_of_all(system%space%reduction, t)
      call triple_product_init(product, t, full, t, matrix, error)
      if (allocated(error)) return
      begin = cpu_seconds() - since
      add = huge(add)
      eliminate = huge(eliminate)
      do run = 1, n_run
         since = cpu_seconds()
         full%value = 0.0_dp
         call add_elements(slot, full%value, nothing)
         add = min(add, cpu_seconds() - since)
         since = cpu_seconds()
         call triple_product_update(product, t, full, t, matrix)
         eliminate = min(eliminate, cpu_seconds() - since)
      end do
   end subroutine by_product

   !> Pattern over unknowns and dependent freedoms.
   subroutine full_pattern(system, full, slot)
      type(system_t), intent(in) :: system
      type(csr_t), intent(out) :: full
      integer, allocatable, intent(out) :: slot(:)
      type(lists_t) :: lists
      integer, allocatable :: number(:)
      integer :: k

      allocate(number, source=freedom_numbers(system%space%numbering))
      call lists_begin(lists, size(system%space%is_alive, 1))
      do k = 1, size(system%term)
         call system%term(k)%term%lay_out(lists)
      end do
      associate (numbering => system%space%numbering)
         call csr_from_elements(full, numbering%n_unknown + numbering%n_dependent, lists%start, &
            number(lists%freedom), slot, error)
      end associate
   end subroutine full_pattern

   !> T for all freedoms: unknowns are themselves.
   subroutine terms_of_all(reduction, t)
      type(reduction_t), intent(in) :: reduction
      type(csr_t), intent(out) :: t
      integer :: i

      associate (n => reduction%n_unknown, terms => reduction%terms)
         t%n_row = n + reduction%n_dependent
         t%n_col = n
         t%row_start = [[(i, i = 0, n)], n + terms%row_start(2:)]
         t%column = [[(i, i = 0, n - 1)], terms%column]
         t%value = [[(1.0_dp, i = 1, n)], terms%value]
      end associate
   end subroutine terms_of_all

   !> Add made-up element matrices up, where `slot` says.
   subroutine add_elements(slot, value, side)
      integer, intent(in) :: slot(:)
      real(dp), intent(inout), contiguous :: value(:), side(:)
      integer :: k, i
      real(dp) :: entry

      do k = 1, size(slot)
         i = slot(k)
         entry = real(1 + mod(k, 64), dp)
         if (i > 0) value(i) = value(i) + entry
         if (i < 0) side(-i) = side(-i) + entry
      end do
   end subroutine add_elements

end program ties_elimination
