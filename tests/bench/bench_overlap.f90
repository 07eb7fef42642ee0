!> Time per facet of the overlap check in space: two bodies that touch, or are in each other.
!>
!> Prints a table; asserts nothing. Both bodies have n/2 facets; the time is the least of several
!> looks by the processor, with all that a step asks for: both are placed, and looked at both ways.
!> Orientation: below 3000 ns, and the exponent of the time over the first size below 1.1.
program bench_overlap
   use, intrinsic :: iso_fortran_env, only : output_unit
   use emcon_kinds, only : dp, wp
   use emcon_overlap_query, only : overlap_t
   use emcon_overlap_space, only : overlap_space_find
   use emcon_search, only : candidates_t, search_candidates
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
   implicit none
   integer, parameter :: n_facets(5) = [1000, 3000, 10000, 30000, 100000], n_run = 5

   call bench("blocks on each other, like meshes", cells=1.0_wp, is_flat=.false., gap=0.0_wp)
   call bench("blocks on each other, unlike meshes", cells=0.8_wp, is_flat=.false., gap=0.0_wp)
   call bench("flat plates on each other, unlike meshes", cells=0.8_wp, is_flat=.true., gap=0.0_wp)
   call bench("flat plates in each other", cells=0.8_wp, is_flat=.true., gap=-0.01_wp)
   call bench("search alone, flat plates on each other", cells=0.8_wp, is_flat=.true., &
      gap=0.0_wp, only_search=.true.)

contains

   subroutine bench(what, cells, is_flat, gap, only_search)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: cells              !! of the second body per length of the first one's
      logical, intent(in) :: is_flat             !! one cell high; else cubes
      real(wp), intent(in) :: gap                !! per cell
      logical, intent(in), optional :: only_search   !! candidates within half a facet
      real(dp) :: seconds, first, per_facet, exponent
      logical :: searches
      integer :: k, n, n_first

      searches = present(only_search)
      write(output_unit, "(/, 2a)") "Overlap in space, ", what
      write(output_unit, "(3a16)") "facets", "ns/facet", "exponent"
      do k = 1, size(n_facets)
         call measure(n_facets(k), cells, is_flat, gap, searches, seconds, n)
         per_facet = 1.0e9_dp*seconds/real(n, dp)
         if (k == 1) first = seconds
         if (k == 1) n_first = n
         exponent = 1.0_dp
         if (k > 1) exponent = log(seconds/first)/log(real(n, dp)/real(n_first, dp))
         write(output_unit, "(i16, f16.1, f16.3)") n, per_facet, exponent
      end do
   end subroutine bench

   !> Seconds of one look at two blocks of together about `n` facets, and how many these are.
   subroutine measure(n, cells, is_flat, gap, only_search, seconds, n_facet)
      integer, intent(in) :: n
      real(wp), intent(in) :: cells, gap
      logical, intent(in) :: is_flat, only_search
      real(dp), intent(out) :: seconds
      integer, intent(out) :: n_facet
      type(triangles_t) :: body(2)
      real(wp), allocatable :: x(:, :), u(:, :), v(:, :), y(:, :)
      type(overlap_t) :: overlap
      type(candidates_t) :: list
      real(dp) :: begin, end
      real(wp) :: reach, high
      integer :: side, levels, run

      side = nint(sqrt(real(n, wp)/merge(4.0_wp, 12.0_wp, is_flat)))
      levels = merge(1, side, is_flat)
      high = real(levels, wp)/real(side, wp)
      call make_block(side, levels, high, 0.0_wp, x, body(1))
      call make_block(max(1, nint(cells*side)), max(1, nint(cells*levels)), high, &
         high + gap/real(side, wp), y, body(2))
      allocate(u(3, size(x, 2)), v(3, size(y, 2)), source=0.0_wp)
      n_facet = body(1)%facets%n_facet + body(2)%facets%n_facet
      reach = max(maxval(body(1)%length), maxval(body(2)%length))
      seconds = huge(seconds)
      do run = 1, n_run
         overlap = overlap_t()
         call cpu_time(begin)
         if (only_search) then
            call search_candidates(body(1)%low, body(1)%high, body(2)%low, body(2)%high, &
               0.5_wp*reach, list)
            call cpu_time(end)
            seconds = min(seconds, end - begin)
            cycle
         end if
         call triangles_place(body(1), x, u, u, 1.0_wp)
         call triangles_place(body(2), y, v, v, 1.0_wp)
         call overlap_space_find(body(1), body(2), reach, .false., overlap)
         call overlap_space_find(body(2), body(1), reach, .false., overlap)
         call cpu_time(end)
         seconds = min(seconds, end - begin)
      end do
   end subroutine measure

   !> The surface of a block of `n` x `n` x `m` cells, 1 long and wide, from `low` on up.
   subroutine make_block(n, m, high, low, x, body)
      integer, intent(in) :: n, m
      real(wp), intent(in) :: high, low
      real(wp), allocatable, intent(out) :: x(:, :)
      type(triangles_t), intent(out) :: body
      integer, allocatable :: facet(:, :)
      integer :: number(0:n, 0:n, 0:m), cells(3), at(3, 4), axis, b, c, i, j, k, end, n_node, j_node

      cells = [n, n, m]
      number = 0
      n_node = 0
      k = 0
      allocate(facet(4, 2*n*(n + 2*m)), x(3, 2*(n + 1)*(n + 2*m + 1)))
      do axis = 1, 3
         b = 1 + mod(axis, 3)
         c = 1 + mod(b, 3)
         do end = 0, 1
            do i = 0, cells(b) - 1
               do j = 0, cells(c) - 1
                  at(axis, :) = end*cells(axis)
                  at(b, :) = [i, i + 1, i + 1, i]
                  at(c, :) = [j, j, j + 1, j + 1]
                  if (end == 0) at = at(:, 4:1:-1)
                  k = k + 1
                  do j_node = 1, 4
                     associate (here => number(at(1, j_node), at(2, j_node), at(3, j_node)))
                        if (here == 0) then
                           n_node = n_node + 1
                           here = n_node
                           x(:, n_node) = [0.0_wp, 0.0_wp, low] + [1.0_wp, 1.0_wp, high] &
                              *real(at(:, j_node), wp)/real(cells, wp)
                        end if
                        facet(j_node, k) = here
                     end associate
                  end do
               end do
            end do
         end do
      end do
      x = x(:, :n_node)
      call triangles_init(body, x, facet, [(high/real(m, wp), i = 1, k)])
   end subroutine make_block

end program bench_overlap
