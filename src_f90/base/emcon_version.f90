!> The version of EMCON.
module emcon_version
   implicit none
   private
   public :: version

   character(len=*), parameter :: version = "0.4.0"
end module emcon_version
