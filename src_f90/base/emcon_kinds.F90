!> The two real kinds of the code.
!>
!> `wp` carries state, residual and energies; build with `make WP=real128` for a referee.
!> `dp` carries matrices and everything that C or a file sees.
module emcon_kinds
   use, intrinsic :: iso_fortran_env, only : int64, dp => real64, wp => EMCON_WP
   implicit none
   private
   public :: dp, int64, wp
end module emcon_kinds
