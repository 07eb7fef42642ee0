!> Time per item of the candidate search: the edges of one wavy surface against those of another.
!>
!> Prints a table; asserts nothing. Both surfaces have n edges, the reach is half an edge; the time
!> is the least of several runs, the building of the tree included. Orientation: the last column,
!> the time per edge over that of n = 1000, should stay below 2.
program bench_search
   use, intrinsic :: iso_fortran_env, only : output_unit
   use emcon_kinds, only : dp, int64, wp
   use emcon_search, only : candidates_t, search_candidates
   implicit none
   integer, parameter :: n_edges(5) = [1000, 3000, 10000, 30000, 100000]
   !> Edges of all pairs of surfaces of one size (as many, so that caches hold none of them more
   !> than others), and runs of which the fastest counts.
   integer, parameter :: n_in_all = 300000, n_run = 7

   call bench("edges in order along the surfaces", is_shuffled=.false.)
   call bench("edges in random order", is_shuffled=.true.)

contains

   subroutine bench(what, is_shuffled)
      character(len=*), intent(in) :: what
      logical, intent(in) :: is_shuffled
      real(dp) :: seconds, per_edge, first
      integer :: k, n_candidate

      write(output_unit, "(/, 2a)") "Candidate search, ", what
      write(output_unit, "(4a16)") "edges", "candidates/edge", "ns/edge", "over the first"
      first = 0.0_dp
      do k = 1, size(n_edges)
         call measure(n_edges(k), is_shuffled, seconds, n_candidate)
         per_edge = 1.0e9_dp*seconds/real(n_edges(k), dp)
         if (k == 1) first = per_edge
         write(output_unit, "(i16, f16.2, f16.1, f16.2)") n_edges(k), &
            real(n_candidate, dp)/real(n_edges(k), dp), per_edge, per_edge/first
      end do
   end subroutine bench

   !> Seconds of one search among `n` edges.
   subroutine measure(n, is_shuffled, seconds, n_candidate)
      integer, intent(in) :: n
      logical, intent(in) :: is_shuffled
      real(dp), intent(out) :: seconds
      integer, intent(out) :: n_candidate
      real(wp), allocatable :: item_low(:, :, :), item_high(:, :, :), low(:, :, :), high(:, :, :)
      type(candidates_t) :: list
      real(wp) :: phase
      integer :: run, i, n_pair
      integer(int64) :: begin, end, rate

      n_pair = n_in_all/n
      allocate(item_low(2, n, n_pair), item_high(2, n, n_pair))
      allocate(low(2, n, n_pair), high(2, n, n_pair))
      do i = 1, n_pair
         call random_number(phase)
         call wavy_surface(phase, 0.3_wp, is_shuffled, item_low(:, :, i), item_high(:, :, i))
         call wavy_surface(phase, 0.0_wp, is_shuffled, low(:, :, i), high(:, :, i))
      end do
      seconds = huge(seconds)
      do run = 1, n_run
         call system_clock(begin, rate)
         do i = 1, n_pair
            call search_candidates(item_low(:, :, i), item_high(:, :, i), low(:, :, i), &
               high(:, :, i), 0.5_wp, list)
         end do
         call system_clock(end)
         seconds = min(seconds, real(end - begin, dp)/real(rate, dp)/real(n_pair, dp))
      end do
      n_candidate = size(list%facet)
   end subroutine measure

   !> Boxes of edges about one unit long along ten waves, moved by `offset` along x, y.
   subroutine wavy_surface(phase, offset, is_shuffled, low, high)
      real(wp), intent(in) :: phase, offset
      logical, intent(in) :: is_shuffled
      real(wp), intent(out) :: low(:, :), high(:, :)
      real(wp) :: ends(2, 2), wave, u
      integer :: i, j, k, n

      n = size(low, 2)
      wave = 20.0_wp*acos(-1.0_wp)/real(n, wp)
      do i = 1, n
         do k = 1, 2
            ends(1, k) = real(i + k, wp) + offset
            ends(2, k) = sin(wave*ends(1, k) + 6.0_wp*phase)/wave + offset
         end do
         low(:, i) = minval(ends, dim=2)
         high(:, i) = maxval(ends, dim=2)
      end do
      if (.not. is_shuffled) return
      do i = n, 2, -1
         call random_number(u)
         j = min(i, 1 + int(u*real(i, wp)))
         low(:, [i, j]) = low(:, [j, i])
         high(:, [i, j]) = high(:, [j, i])
      end do
   end subroutine wavy_surface

end program bench_search
