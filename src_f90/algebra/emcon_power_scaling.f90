!> Scaling of rows and columns by powers of two: exact, hence free of rounding.
!>
!> Rows first, then columns, are brought to a largest entry in [1/2, 1). The scaled values are
!> the same bits whatever power of two the whole matrix, or any of its rows, was multiplied by.
module emcon_power_scaling
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   implicit none
   private
   public :: power_scaling_t, power_of_two

   type :: power_scaling_t
      logical :: is_regular = .false.          !! finite values, no row and no column of zeros
      real(dp), allocatable :: row(:)          !! (n_row) factors
      real(dp), allocatable :: column(:)       !! (n_col) factors
   contains
      procedure :: init => power_scaling_init
      procedure :: equilibrate => power_scaling_equilibrate
   end type power_scaling_t

   !> Keeps the factors, and their products with entries, clear of overflow.
   integer, parameter :: largest_power = maxexponent(1.0_dp) - 4

contains

   subroutine power_scaling_init(self, n_row, n_col)
      class(power_scaling_t), intent(inout) :: self
      integer, intent(in) :: n_row, n_col

      self%is_regular = .false.
      if (allocated(self%row)) deallocate(self%row, self%column)
      allocate(self%row(n_row), self%column(n_col), source=1.0_dp)
   end subroutine power_scaling_init

   !> scaled(i, j) = row(i) value(i, j) column(j)
   subroutine power_scaling_equilibrate(self, value, scaled)
      class(power_scaling_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot) in the pattern of `scaled`
      type(csr_t), intent(inout) :: scaled
      real(dp) :: largest
      integer :: i, j, k

      self%is_regular = .false.
      self%column = 0.0_dp
      do i = 1, scaled%n_row
         largest = 0.0_dp
         do k = scaled%row_start(i) + 1, scaled%row_start(i + 1)
            if (.not. ieee_is_finite(value(k))) return
            largest = max(largest, abs(value(k)))
         end do
         if (largest == 0.0_dp) return
         self%row(i) = power_of_two(-exponent(largest))
         do k = scaled%row_start(i) + 1, scaled%row_start(i + 1)
            j = scaled%column(k) + 1
            scaled%value(k) = self%row(i)*value(k)
            self%column(j) = max(self%column(j), abs(scaled%value(k)))
         end do
      end do
      if (any(self%column == 0.0_dp)) return
      do j = 1, scaled%n_col
         self%column(j) = power_of_two(-exponent(self%column(j)))
      end do
      do k = 1, size(scaled%value)
         scaled%value(k) = scaled%value(k)*self%column(scaled%column(k) + 1)
      end do
      self%is_regular = .true.
   end subroutine power_scaling_equilibrate

   !> 2^n, with n cut to what can be multiplied with safely.
   elemental real(dp) function power_of_two(n)
      integer, intent(in) :: n

      power_of_two = scale(1.0_dp, max(-largest_power, min(largest_power, n)))
   end function power_of_two

end module emcon_power_scaling
