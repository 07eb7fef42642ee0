!> The square block of constraint rows at their dependent unknowns, G_d, and its factors.
!>
!> Constraints that hold dependent unknowns of each other form a component. Each component is
!> ordered breadth first from one of its ends, as by Cuthill and McKee: a chain of nodes gives a
!> narrow band, however these are numbered. Source: docs/theory.md, section 5.
module emcon_dependent_block
   use emcon_band_blocks, only : band_blocks_factorise, band_blocks_init, band_blocks_place, &
      band_blocks_solve, band_blocks_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: dependent_block_t, dependent_block_init, dependent_block_factorise
   public :: dependent_block_solve

   type :: dependent_block_t
      integer, allocatable :: dependent(:)       !! (n) unknown of each constraint
      integer, allocatable :: order(:)           !! (n) constraints, component after component
      integer, allocatable :: component(:)       !! (n) that a constraint is in
      integer, allocatable :: slot(:)            !! (entries) place in `bands`; 0: independent
      type(band_blocks_t) :: bands               !! rows and columns in `order`
      integer, allocatable :: column_start(:)    !! (components + 1) columns before each component
      integer, allocatable :: column(:)          !! its other unknowns, ascending
   end type dependent_block_t

contains

   !> Components, order and bands of the block of `rows` at the unknowns `dependent`.
   subroutine dependent_block_init(self, rows, dependent)
      type(dependent_block_t), intent(out) :: self
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: dependent(:)            !! (n) one unknown for each row
      integer, allocatable :: owner(:), start(:), neighbour(:), component_start(:)
      integer :: k

      allocate(self%dependent, source=dependent)
      allocate(owner(rows%n_col), source=0)
      do k = 1, rows%n_row
         owner(dependent(k)) = k
      end do
      call list_neighbours(rows, owner, start, neighbour)
      call order_components(self, start, neighbour, component_start)
      call lay_out_bands(self, rows, owner, component_start)
      call list_columns(self, rows)
   end subroutine dependent_block_init

   !> For each row the others that hold its dependent unknown, or whose dependent unknown it holds;
   !> those that do both are listed twice.
   pure subroutine list_neighbours(rows, owner, start, neighbour)
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: owner(:)                !! (n_col) row of a dependent unknown, or 0
      integer, allocatable, intent(out) :: start(:)  !! (n + 1) neighbours before each row
      integer, allocatable, intent(out) :: neighbour(:)
      integer, allocatable :: last(:)
      integer :: k, l, s, pass

      allocate(start(rows%n_row + 1), last(rows%n_row + 1), source=0)
      do pass = 1, 2
         do k = 1, rows%n_row
            do s = rows%row_start(k) + 1, rows%row_start(k + 1)
               l = owner(rows%column(s) + 1)
               if (l == 0 .or. l == k) cycle
               last([k, l]) = last([k, l]) + 1
               if (pass == 2) neighbour(last([k, l])) = [l, k]
            end do
         end do
         if (pass == 2) exit
         do k = 1, rows%n_row
            start(k + 1) = start(k) + last(k)
         end do
         last = start
         allocate(neighbour(start(rows%n_row + 1)))
      end do
   end subroutine list_neighbours

   !> Components in the order of their first constraint, each walked through from an end of it.
   pure subroutine order_components(self, start, neighbour, component_start)
      type(dependent_block_t), intent(inout) :: self
      integer, intent(in) :: start(:), neighbour(:)
      integer, allocatable, intent(out) :: component_start(:)  !! (components + 1) from 0
      integer, allocatable :: last(:)
      integer :: k, i, n, n_component

      n = size(start) - 1
      allocate(self%order(n), self%component(n), source=0)
      allocate(last(n + 1), source=0)
      n_component = 0
      do k = 1, n
         if (self%component(k) > 0) cycle
         n_component = n_component + 1
         associate (before => last(n_component), to => last(n_component + 1))
            call walk(self, start, neighbour, k, n_component, before, to)
            ! What is reached last lies at an end, what is reached last from there at another.
            do i = 1, merge(2, 0, to - before > 2)
               self%component(self%order(before + 1:to)) = 0
               call walk(self, start, neighbour, (self%order(to)), n_component, before, to)
            end do
         end associate
      end do
      allocate(component_start, source=last(:n_component + 1))
   end subroutine order_components

   !> List what can be reached from `seed`, the nearest first, behind the place `before`.
   pure subroutine walk(self, start, neighbour, seed, i_component, before, to)
      type(dependent_block_t), intent(inout) :: self
      integer, intent(in) :: start(:), neighbour(:)
      integer, intent(in) :: seed
      integer, intent(in) :: i_component
      integer, intent(in) :: before
      integer, intent(out) :: to                     !! place of the last one
      integer :: i, l, s

      to = before + 1
      self%order(to) = seed
      self%component(seed) = i_component
      i = before
      do while (i < to)
         i = i + 1
         do s = start(self%order(i)) + 1, start(self%order(i) + 1)
            l = neighbour(s)
            if (self%component(l) > 0) cycle
            self%component(l) = i_component
            to = to + 1
            self%order(to) = l
         end do
      end do
   end subroutine walk

   !> Widths of the bands, and the place of each entry of the rows.
   pure subroutine lay_out_bands(self, rows, owner, component_start)
      type(dependent_block_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: owner(:), component_start(:)
      integer, allocatable :: place(:), lower(:), upper(:)
      integer :: k, l, s, pass

      allocate(place(rows%n_row))
      do k = 1, rows%n_row
         place(self%order(k)) = k - component_start(self%component(self%order(k)))
      end do
      allocate(lower(size(component_start) - 1), upper(size(component_start) - 1), source=0)
      allocate(self%slot(rows%row_start(rows%n_row + 1)), source=0)
      do pass = 1, 2
         do k = 1, rows%n_row
            associate (b => self%component(k))
               do s = rows%row_start(k) + 1, rows%row_start(k + 1)
                  l = owner(rows%column(s) + 1)
                  if (l == 0) cycle
                  if (pass == 1) then
                     lower(b) = max(lower(b), place(k) - place(l))
                     upper(b) = max(upper(b), place(l) - place(k))
                  else
                     self%slot(s) = band_blocks_place(self%bands, b, place(k), place(l))
                  end if
               end do
            end associate
         end do
         if (pass == 1) call band_blocks_init(self%bands, component_start, lower, upper)
      end do
   end subroutine lay_out_bands

   !> The unknowns of each component that are not dependent.
   pure subroutine list_columns(self, rows)
      type(dependent_block_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows
      integer, allocatable :: list(:)
      logical, allocatable :: is_listed(:)
      integer :: b, i, s, n, before

      allocate(is_listed(rows%n_col), source=.false.)
      allocate(list(size(self%slot)), self%column_start(self%bands%n_block + 1), source=0)
      n = 0
      do b = 1, self%bands%n_block
         before = n
         do i = self%bands%start(b) + 1, self%bands%start(b + 1)
            do s = rows%row_start(self%order(i)) + 1, rows%row_start(self%order(i) + 1)
               if (self%slot(s) > 0 .or. is_listed(rows%column(s) + 1)) cycle
               n = n + 1
               list(n) = rows%column(s) + 1
               is_listed(list(n)) = .true.
            end do
         end do
         list(before + 1:n) = unique_sorted(list(before + 1:n))
         is_listed(list(before + 1:n)) = .false.
         self%column_start(b + 1) = n
      end do
      allocate(self%column, source=list(:n))
   end subroutine list_columns

   !> Factorise for the present values of `rows`.
   subroutine dependent_block_factorise(self, rows)
      type(dependent_block_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows
      integer :: s

      self%bands%value = 0.0_dp
      do s = 1, size(self%slot)
         if (self%slot(s) > 0) self%bands%value(self%slot(s)) = rows%value(s)
      end do
      call band_blocks_factorise(self%bands)
   end subroutine dependent_block_factorise

   !> x = G_d^-1 x or G_d^-T x in place; both sides are numbered by constraints.
   subroutine dependent_block_solve(self, is_transposed, x)
      type(dependent_block_t), intent(in) :: self
      logical, intent(in) :: is_transposed       !! G_d^-T, else G_d^-1
      real(dp), intent(inout), contiguous :: x(:)    !! (n)
      real(dp) :: ordered(size(x))
      integer :: one(self%bands%n_block)

      one = 1
      ordered = x(self%order)
      call band_blocks_solve(self%bands, is_transposed, one, ordered)
      x(self%order) = ordered
   end subroutine dependent_block_solve

end module emcon_dependent_block
