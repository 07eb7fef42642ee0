!> What the heap has grown by belongs to the part that was taken next.
module test_memory
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_memory, only : memory_elements, memory_go_on, memory_in_use, memory_matrix, &
      memory_most, memory_sum, memory_t, memory_take, n_memory
   implicit none
   private
   public :: collect_memory

   integer, parameter :: n = 500000

contains

   subroutine collect_memory(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("what grows is counted", test_growth)]
   end subroutine collect_memory

   !> Arrays of 8 n bytes, but for what the C library adds; without glibc nothing is told.
   subroutine test_growth(error)
      type(error_t), allocatable, intent(out) :: error
      type(memory_t) :: memory, other
      real(dp), allocatable :: one(:), two(:), three(:)
      real(dp) :: held(n_memory)

      if (.not. memory_in_use() > 0.0_dp) return
      call memory_go_on(memory)
      allocate(one(n), source=1.0_dp)
      call memory_take(memory, memory_elements)
      allocate(two(2*n), source=2.0_dp)
      call memory_take(memory, memory_matrix)
      allocate(three(n), source=3.0_dp)            ! of nothing that is asked for
      call memory_go_on(memory)
      deallocate(one)
      call memory_take(memory, memory_elements)
      held = memory_sum([memory, other])
      call check_near(error, real(held(memory_matrix), wp), 16.0_wp*n, 1.0e-3_wp, 16.0_wp*n, "two")
      call check_near(error, real(held(memory_elements), wp), 0.0_wp, 1.0e-3_wp, 8.0_wp*n, &
         "one is freed")
      call check_equal(error, count(held > 8.0_dp*n), 1, "no other part")
      call check_true(error, memory_most() > 8.0_dp*(size(two) + size(three)) &
         .or. .not. memory_most() > 0.0_dp, "the most at a time")
   end subroutine test_growth

end module test_memory
