!> What takes how much memory: the growth of the heap while the parts of a model are made.
!>
!> Measured, so that nothing is forgotten; what other threads of the process allocate meanwhile is
!> counted too. Known with glibc only.
module emcon_memory
   use, intrinsic :: iso_c_binding, only : c_double
   use emcon_kinds, only : dp
   implicit none
   private
   public :: memory_t, memory_go_on, memory_take, memory_in_use, memory_most, memory_sum
   public :: memory_name

   !> Parts of a model, in the order in which they are told.
   integer, parameter, public :: memory_scene = 1, memory_elements = 2, memory_contact = 3, &
      memory_matrix = 4, memory_factors = 5, memory_results = 6, n_memory = 6
   !> As members of JSON objects.
   character(len=*), parameter :: memory_name(n_memory) = [character(len=8) :: "scene", &
      "elements", "contact", "matrix", "factors", "results"]

   type :: memory_t
      real(dp) :: held(n_memory) = 0.0_dp        !! of each part [byte]
      real(dp), private :: mark = 0.0_dp         !! the heap when the last part was done [byte]
   end type memory_t

   interface
      !> Bytes of the heap that are in use; 0: the C library does not tell.
      real(c_double) function memory_in_use() bind(c, name="emcon_heap_in_use")
         import :: c_double
      end function memory_in_use
   end interface

contains

   !> What is allocated from here on belongs to the next part that is taken.
   subroutine memory_go_on(self)
      type(memory_t), intent(inout) :: self

      self%mark = memory_in_use()
   end subroutine memory_go_on

   !> What was allocated since the last call belongs to `part`.
   subroutine memory_take(self, part)
      type(memory_t), intent(inout) :: self
      integer, intent(in) :: part                !! one of the `memory_` codes
      real(dp) :: before

      before = self%mark
      call memory_go_on(self)
      self%held(part) = self%held(part) + (self%mark - before)
   end subroutine memory_take

   !> The parts that several have measured; what has become less since counts as nothing.
   pure function memory_sum(memory) result(held)
      type(memory_t), intent(in) :: memory(:)
      real(dp) :: held(n_memory)                 !! >= 0 [byte]
      integer :: k

      held = 0.0_dp
      do k = 1, size(memory)
         held = held + memory(k)%held
      end do
      held = max(held, 0.0_dp)
   end function memory_sum

   !> The most memory that the process has held so far, as Linux tells it [byte]; 0: it does not.
   real(dp) function memory_most()
      character(len=80) :: line
      integer :: unit, status
      real(dp) :: kilobytes

      memory_most = 0.0_dp
      open(newunit=unit, file="/proc/self/status", status="old", action="read", iostat=status)
      if (status /= 0) return
      do
         read(unit, "(a)", iostat=status) line
         if (status /= 0) exit
         if (index(line, "VmHWM:") /= 1) cycle
         read(line(len("VmHWM:") + 1:index(line, "kB") - 1), *, iostat=status) kilobytes
         if (status == 0) memory_most = kilobytes*1024.0_dp
         exit
      end do
      close(unit)
   end function memory_most

end module emcon_memory
