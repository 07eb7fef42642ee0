!> What the C library does with freed memory.
!>
!> glibc hands large freed blocks back to the system, and their pages are cleared anew when they are
!> asked for again. Measured: up to a third of the time of small factorisations.
module emcon_heap
   implicit none
   private
   public :: heap_keep, heap_adapt

   interface
      !> Keep freed memory for the next that asks, in the whole process: a matter for a main
      !> program, not for a library inside another.
      subroutine heap_keep() bind(c, name="emcon_heap_keep")
      end subroutine heap_keep

      !> Free a block that was never touched: glibc adapts, and keeps what is freed below its size.
      !> Settings of the host program stand.
      subroutine heap_adapt() bind(c, name="emcon_heap_adapt")
      end subroutine heap_adapt
   end interface

end module emcon_heap
