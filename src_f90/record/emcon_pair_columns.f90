!> Columns of the history for each pair of surfaces: force, impulse, where it acts, for how long,
!> and what friction and damping took.
module emcon_pair_columns
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use emcon_history, only : column_t
   use emcon_kinds, only : dp, wp
   use emcon_pair_sums, only : pair_center, pair_force
   use emcon_stepper, only : stepper_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: pair_columns, pair_values

   !> Of these each has a column for each direction.
   character(len=*), parameter :: vectors(3) = [character(len=8) :: "force", "impulse", "center"]
   character(len=*), parameter :: directions = "xyz"
   character(len=*), parameter :: numbers(*) = [character(len=20) :: "duration", "active", &
      "friction_loss", "contact_damping_loss"]

contains

   !> The columns of all pairs, in the order of the deck.
   subroutine pair_columns(stepper, column)
      type(stepper_t), intent(in) :: stepper
      type(column_t), allocatable, intent(out) :: column(:)
      character(len=:), allocatable :: pair
      integer :: p, i, a, n

      associate (n_pair => size(stepper%march%state%sums%sum), n_dim => stepper%scene%n_dim)
         allocate(column(n_pair*n_each(n_dim)))
         n = 0
         do p = 1, n_pair
            pair = "pair" // to_text(p) // "_"
            do i = 1, size(vectors)
               do a = 1, n_dim
                  n = n + 1
                  column(n)%name = pair // trim(vectors(i)) // "_" // directions(a:a)
               end do
            end do
            do i = 1, size(numbers)
               n = n + 1
               column(n)%name = pair // trim(numbers(i))
               column(n)%is_integer = numbers(i) == "active"
            end do
         end do
      end associate
   end subroutine pair_columns

   !> Columns of one pair.
   pure integer function n_each(n_dim)
      integer, intent(in) :: n_dim

      n_each = size(vectors)*n_dim + size(numbers)
   end function n_each

   !> The values in these columns at the present state; where no force acts there is no center.
   pure function pair_values(stepper) result(values)
      type(stepper_t), intent(in) :: stepper
      real(dp), allocatable :: values(:)
      real(wp) :: vector(3, size(vectors))
      integer :: active(size(stepper%march%state%sums%sum)), p, n

      call count_active(stepper, active)
      associate (sum => stepper%march%state%sums%sum, n_dim => stepper%scene%n_dim)
         n = n_each(n_dim)
         allocate(values(n*size(sum)))
         do p = 1, size(sum)
            vector = reshape([pair_force(sum(p)), sum(p)%impulse, pair_center(sum(p), &
               ieee_value(1.0_wp, ieee_quiet_nan))], shape(vector))
            values(n*(p - 1) + 1:n*p) = real([reshape(vector(:n_dim, :), [size(vectors)*n_dim]), &
               sum(p)%duration, real(active(p), wp), sum(p)%friction, &
               sum(p)%damping], dp)
         end do
      end associate
   end function pair_values

   !> Constraints of each pair that act at the end of the increment.
   pure subroutine count_active(stepper, active)
      type(stepper_t), intent(in) :: stepper
      integer, intent(out) :: active(:)
      integer :: k

      active = 0
      associate (system => stepper%march%system, state => stepper%march%state)
         do k = 1, size(system%contact)
            associate (n => active(abs(state%sums%of_pair(k))), first => system%first_constraint)
               n = n + state%contacts%n_acting(first(k) + 1, first(k + 1))
            end associate
         end do
      end associate
   end subroutine count_active

end module emcon_pair_columns
