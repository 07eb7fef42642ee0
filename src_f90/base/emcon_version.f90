!> What this build is: the version of EMCON, and the precision that it was built for.
module emcon_version
   use emcon_kinds, only : dp, wp
   implicit none
   private
   public :: version, precision_names, this_precision

   character(len=*), parameter :: version = "0.5.0"
   !> Words of `make PRECISION=`, the coarsest first.
   character(len=*), parameter :: precision_names(3) = [character(len=6) :: "single", "double", &
      "quad"]
   !> The one of the state in this build.
   integer, parameter :: this_precision = 1 &
      + merge(1, 0, precision(1.0_wp) >= precision(1.0_dp)) &
      + merge(1, 0, precision(1.0_wp) > precision(1.0_dp))
end module emcon_version
