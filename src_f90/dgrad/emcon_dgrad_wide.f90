! build: derivatives
!> Discrete-gradient numbers over any number of variables: sums of numbers over few variables.
!>
!> For functions that are put together from many parts, each over its own variables: only sums and
!> products are needed. Source: docs/theory.md, section 2.
module emcon_dgrad_wide
   use emcon_kinds, only : wp
   implicit none
   private
   public :: wide_t, change_t, wide_clear, wide_add, wide_add_product, wide_add_part

   !> Values at both ends and their difference, as dg_t of emcon_dgrad.inc has them.
   type :: change_t
      real(wp) :: f0, f1, df
   end type change_t

   !> As dg_t of emcon_dgrad.inc, with room for more variables than are used.
   type :: wide_t
      integer :: n = 0                           !! variables
      integer :: n_second = 0                    !! n; 0: without second derivatives
      real(wp) :: f0 = 0.0_wp
      real(wp) :: f1 = 0.0_wp
      real(wp) :: df = 0.0_wp
      real(wp), allocatable :: g(:)              !! (>= n)
      real(wp), allocatable :: c(:)
      real(wp), allocatable :: h(:, :)
   end type wide_t

contains

   !> Zero, over `n` variables. What is added to a number without second derivatives may have them.
   pure subroutine wide_clear(self, n, leaves_second)
      type(wide_t), intent(inout) :: self
      integer, intent(in) :: n
      logical, intent(in) :: leaves_second       !! no second derivatives

      if (allocated(self%g)) then
         if (size(self%g) < n) deallocate(self%g, self%c, self%h)
      end if
      if (.not. allocated(self%g)) allocate(self%g(n), self%c(n), self%h(n, n))
      self%n = n
      self%n_second = merge(0, n, leaves_second)
      self%f0 = 0.0_wp
      self%f1 = 0.0_wp
      self%df = 0.0_wp
      self%g(:n) = 0.0_wp
      self%c(:n) = 0.0_wp
      self%h(:n, :self%n_second) = 0.0_wp
   end subroutine wide_clear

   !> Add `factor` times `a`, over the same variables.
   pure subroutine wide_add(self, factor, a)
      type(wide_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(wide_t), intent(in) :: a

      associate (n => self%n, m => self%n_second)
         self%f0 = self%f0 + factor*a%f0
         self%f1 = self%f1 + factor*a%f1
         self%df = self%df + factor*a%df
         self%g(:n) = self%g(:n) + factor*a%g(:n)
         self%c(:n) = self%c(:n) + factor*a%c(:n)
         self%h(:n, :m) = self%h(:n, :m) + factor*a%h(:n, :m)
      end associate
   end subroutine wide_add

   !> Add `factor` times `a` times `b`, over the same variables.
   pure subroutine wide_add_product(self, factor, a, b)
      type(wide_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(wide_t), intent(in) :: a, b
      real(wp) :: ma, mb
      integer :: j

      ma = 0.5_wp*factor*(a%f0 + a%f1)
      mb = 0.5_wp*factor*(b%f0 + b%f1)
      associate (n => self%n)
         self%f0 = self%f0 + factor*a%f0*b%f0
         self%f1 = self%f1 + factor*a%f1*b%f1
         self%df = self%df + (ma*b%df + mb*a%df)
         self%g(:n) = self%g(:n) + (ma*b%g(:n) + mb*a%g(:n))
         self%c(:n) = self%c(:n) + (factor*a%f1*b%c(:n) + factor*b%f1*a%c(:n))
         do j = 1, self%n_second
            self%h(:n, j) = self%h(:n, j) + (ma*b%h(:n, j) + mb*a%h(:n, j) &
               + (0.5_wp*factor*a%c(j))*b%g(:n) + (0.5_wp*factor*b%c(j))*a%g(:n))
         end do
      end associate
   end subroutine wide_add_product

   !> Add `factor` times a part given by its components over its own variables; its variable i is
   !> number `variable(i)` here, 0: none.
   pure subroutine wide_add_part(self, factor, change, g, c, h, variable)
      type(wide_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(change_t), intent(in) :: change
      real(wp), intent(in) :: g(:), c(:)
      real(wp), intent(in) :: h(:, :)            !! of any size where these are left out
      integer, intent(in) :: variable(:)
      integer :: i, j, row, column

      self%f0 = self%f0 + factor*change%f0
      self%f1 = self%f1 + factor*change%f1
      self%df = self%df + factor*change%df
      do j = 1, size(variable)
         column = variable(j)
         if (column == 0) cycle
         self%g(column) = self%g(column) + factor*g(j)
         self%c(column) = self%c(column) + factor*c(j)
         if (self%n_second == 0) cycle
         do i = 1, size(variable)
            row = variable(i)
            if (row > 0) self%h(row, column) = self%h(row, column) + factor*h(i, j)
         end do
      end do
   end subroutine wide_add_part

end module emcon_dgrad_wide
