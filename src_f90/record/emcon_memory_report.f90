!> What takes how much memory, as a line of reports and as a member of the JSON object of a run.
module emcon_memory_report
   use emcon_json, only : json_number
   use emcon_kinds, only : dp, wp
   use emcon_memory, only : memory_in_use, memory_most, memory_name, memory_results, memory_sum, &
      n_memory
   use emcon_report_row, only : report_row_t, row_begin, row_put
   use emcon_stepper, only : stepper_t
   implicit none
   private
   public :: memory_report, megabyte

   real(dp), parameter :: megabyte = 1024.0_dp**2
   !> What reports call the parts.
   character(len=*), parameter :: words(n_memory) = [character(len=14) :: "deck and mesh", &
      "elements", "contact", "matrix", "factors", "results"]

contains

   !> A row of the parts in megabytes, and of the most that the process has held; no text where the
   !> C library does not tell.
   subroutine memory_report(stepper, results, row)
      type(stepper_t), intent(in) :: stepper     !! built
      real(dp), intent(in) :: results            !! what files take [byte]
      type(report_row_t), intent(out) :: row
      real(dp) :: held(n_memory), now
      integer :: k

      call row_begin(row, "memory", "")
      now = memory_in_use()
      if (.not. now > 0.0_dp) return
      associate (correction => stepper%march%newton%correction)
         held = memory_sum([stepper%memory, stepper%march%system%memory, correction%kept%memory])
      end associate
      held(memory_results) = max(results, 0.0_dp)
      row%text = "memory:"
      do k = 1, n_memory
         call put(trim(memory_name(k)), held(k), " " // trim(words(k)) // " # MB,")
      end do
      call put("rest", max(now - sum(held), 0.0_dp), " the rest # MB")
      if (memory_most() > 0.0_dp) call put("most", memory_most(), "; at most # MB at a time")

   contains

      subroutine put(name, bytes, pattern)
         character(len=*), intent(in) :: name, pattern
         real(dp), intent(in) :: bytes

         call row_put(row, name, 0.01_wp*real(anint(100.0_dp*bytes/megabyte), wp), pattern)
      end subroutine put

   end subroutine memory_report

end module emcon_memory_report
