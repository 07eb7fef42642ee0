!> The real kinds of the code.
!>
!> `wp` carries state, residual and energies; build with `make PRECISION=quad` for a referee.
!> `dp` carries matrices and everything that C or a file sees. `hp` is the finer of the two.
module emcon_kinds
   use, intrinsic :: iso_fortran_env, only : int64, dp => real64, wp => EMCON_WP
   implicit none
   private
   public :: dp, hp, int64, wp

   integer, parameter :: hp = merge(wp, dp, precision(1.0_wp) > precision(1.0_dp))
end module emcon_kinds
