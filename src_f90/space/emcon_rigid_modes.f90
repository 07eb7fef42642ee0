!> The motions of a rigid body over the unknowns: translations, then small turns in each plane.
module emcon_rigid_modes
   use emcon_kinds, only : dp, wp
   use emcon_numbering, only : numbering_t
   implicit none
   private
   public :: rigid_modes

contains

   !> In the plane three, in space six; turns are about the mean place, by its mean distance.
   pure function rigid_modes(numbering, x) result(mode)
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      real(dp), allocatable :: mode(:, :)        !! (n_unknown, modes) [1]
      real(dp) :: arm(size(x, 1)), mean(size(x, 1)), length
      integer :: n_dim, k, a, p, q, m

      n_dim = size(x, 1)
      mean = real(sum(x, 2)/max(1, size(x, 2)), dp)
      length = 0.0_dp
      do k = 1, size(x, 2)
         length = length + sum(abs(real(x(:, k), dp) - mean))/size(x, 2)
      end do
      allocate(mode(numbering%n_unknown, (n_dim*(n_dim + 1))/2), source=0.0_dp)
      do k = 1, numbering%n_unknown
         a = modulo(numbering%dof(k) - 1, n_dim) + 1
         arm = real(x(:, (numbering%dof(k) - 1)/n_dim + 1), dp) - mean
         if (length > 0.0_dp) arm = arm/length
         mode(k, a) = 1.0_dp
         m = n_dim
         do p = 1, n_dim
            do q = p + 1, n_dim
               m = m + 1
               if (a == p) mode(k, m) = -arm(q)
               if (a == q) mode(k, m) = arm(p)
            end do
         end do
      end do
   end function rigid_modes

end module emcon_rigid_modes
