!> Where in the deck something was said.
module emcon_origin
   implicit none
   private
   public :: origin_t

   !> Where in the deck something was said.
   type :: origin_t
      integer :: file = 0      !! index into `scene_t%file`, 0: not from a deck
      integer :: line = 0
   end type origin_t

end module emcon_origin
