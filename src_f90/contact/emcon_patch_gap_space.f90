! build: elements
!> The height of a surface of triangles over a patch: its mean over a small square that moves with a
!> node, or its integral over a triangle of a slave facet, with a weight.
!>
!> The field over the frame of the patch is continuous, so its integral is smooth while the patch
!> slides over sides and corners of the triangles. Source: docs/theory.md, eqs. (43) to (49).
module emcon_patch_gap_space
   use emcon_frame_vertex_space, only : at_eta, frame_area, frame_area_t, frame_of, frame_t, &
      frame_vertex, frame_vertex_t, n_frame_var
   use emcon_kinds, only : wp
   use emcon_patch_field_space, only : field_t, place_field
   use emcon_patch_look_space, only : patch_begin, patch_moments_of, patch_sees, patch_start_t, &
      patch_t, place_vertices
   use emcon_patch_sum_space, only : patch_sums_t, sums_make, sums_mix, sums_mix_t, sums_take, &
      sums_take_change
   implicit none
   private
   public :: patch_gap_t, patch_gap, patch_open_t, patch_open, patch_open_cover, &
      patch_sums_t, patch_open_sums, patch_gap_of

   !> The integral of chi (height - target) over the patch by its area, over a step.
   type :: patch_gap_t
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp       !! at both ends [L]
      real(wp) :: df = 0.0_wp                    !! how it changes, to relative accuracy [L]
      integer :: n_vertex = 0                    !! that it depends on: `patch_gap` tells which
      integer, allocatable :: vertex(:)          !! (>= n_vertex) their numbers
      !> By both vectors of the frame, then by the vertices: discrete gradient, that at the end,
      !> and derivative of the first by variables at the end
      real(wp), allocatable :: g(:), c(:)        !! (6 + 3 n_vertex)
      real(wp), allocatable :: h(:, :)           !! the same twice; only if asked for
   end type patch_gap_t

   !> What the gaps of a patch over a step have in common, whatever their weights and targets are.
   type :: patch_open_t
      integer :: n_vertex = 0                    !! that they depend on
      integer, allocatable :: vertex(:)          !! (>= n_vertex) their numbers
      real(wp), allocatable, private :: chi(:)               !! (n_vertex)
      type(frame_vertex_t), allocatable, private :: at(:)    !! (n_vertex)
      !> (., ., ., n_vertex) their second derivatives; of none unless they are asked for
      real(wp), allocatable, private :: second(:, :, :, :)
      type(field_t), allocatable, private :: field(:)
      type(frame_area_t), private :: area        !! of the frame, for an integral
   end type patch_open_t

contains

   !> The gap over a step with its derivatives. None of its vertices counts where nothing is over
   !> the patch at either end.
   pure subroutine patch_gap(patch, x, dx, target, leaves_second, gap)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(in) :: target             !! that heights are counted from [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(patch_gap_t), intent(out) :: gap
      type(patch_open_t) :: open
      type(patch_sums_t) :: sums

      call patch_open(patch, x, dx, leaves_second, open)
      call patch_open_sums(patch, open, leaves_second, sums)
      call patch_gap_of(open, sums, patch%weight, target, .false., leaves_second, gap)
      gap%n_vertex = open%n_vertex
      gap%vertex = open%vertex(:open%n_vertex)
   end subroutine patch_gap

   !> What a patch is over in a step.
   pure subroutine patch_open(patch, x, dx, leaves_second, open)
      type(patch_t), intent(in) :: patch         !! whatever its weights are
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! as `patch_gap`
      logical, intent(in) :: leaves_second       !! no gap with second derivatives is asked for
      type(patch_open_t), intent(out) :: open
      real(wp) :: place(3, patch%n_vertex), corner(2, 3, 0:1)
      type(frame_t) :: frame
      type(patch_start_t) :: start
      integer :: end, j, k, n_second

      call place_vertices(patch, x + dx, place)
      if (allocated(patch%start)) then
         call choose_fields(patch, patch%start, place, open)
      else
         call patch_begin(patch, x, start)
         call choose_fields(patch, start, place, open)
      end if
      frame = frame_of(x(:, :3), dx(:, :3), leaves_second)
      n_second = merge(0, n_frame_var, leaves_second)
      allocate(open%at(open%n_vertex), open%second(n_second, n_second, 3, open%n_vertex))
      do j = 1, open%n_vertex
         associate (node => 3 + open%vertex(j))
            call frame_vertex(frame, x(:, node), dx(:, node), open%at(j), open%second(:, :, :, j))
         end associate
         call to_patch(patch, open%at(j), open%second(:, :, :, j))
      end do
      open%chi = patch%chi(open%vertex(:open%n_vertex))
      do k = 1, size(open%field)
         do j = 1, 3
            do end = 0, 1
               corner(:, j, end) = open%at(open%field(k)%vertex(j))%f(:at_eta, end)
            end do
         end do
         call place_field(corner, open%field(k))
      end do
      if (is_integral(patch)) call frame_area(x(:, :3), dx(:, :3), leaves_second, open%area)
   end subroutine patch_open

   !> Over a part of a slave facet heights are integrated, over the square of a node their mean is
   !> taken.
   pure logical function is_integral(patch)
      type(patch_t), intent(in) :: patch

      is_integral = patch%area%n_side == 3
   end function is_integral

   !> What of a patch is covered at both ends, in its coordinates.
   pure function patch_open_cover(open) result(cover)
      type(patch_open_t), intent(in) :: open
      real(wp) :: cover(0:1)
      integer :: end, k

      cover = 0.0_wp
      do k = 1, size(open%field)
         associate (f => open%field(k))
            do end = 0, 1
               cover(end) = cover(end) + dot_product(open%chi(f%vertex), matmul( &
                  f%at_end(:, :, end), sum(f%moment(:, :, end), 1)))
            end do
         end associate
      end do
   end function patch_open_cover

   !> The sums that the gaps of a patch are made of.
   pure subroutine patch_open_sums(patch, open, leaves_second, sums)
      type(patch_t), intent(in) :: patch
      type(patch_open_t), intent(in) :: open     !! of it
      logical, intent(in) :: leaves_second       !! no gap with second derivatives is asked for
      type(patch_sums_t), intent(out) :: sums

      call sums_make(patch%area, open%chi, open%at, open%field, leaves_second, sums)
   end subroutine patch_open_sums

   !> The gap of a patch.
   pure subroutine patch_gap_of(open, sums, weight, target, of_cover, leaves_second, gap)
      type(patch_open_t), intent(in) :: open     !! of the patch
      type(patch_sums_t), intent(in) :: sums     !! of it
      real(wp), intent(in) :: weight(:)          !! of each weight of the patch
      real(wp), intent(in) :: target             !! that heights are counted from [L]
      logical, intent(in) :: of_cover            !! of 1 in place of heights, by the area: what is
                                                 !! covered
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(patch_gap_t), intent(inout) :: gap
      type(sums_mix_t) :: mix
      real(wp), dimension(3, open%n_vertex) :: by, end_by
      real(wp) :: f(0:1)

      call make_room(6 + 3*open%n_vertex, leaves_second, gap)
      mix = sums_mix(sums, weight, target, of_cover)
      call sums_take(sums, mix, f, by, end_by)
      gap%f0 = f(0)
      gap%f1 = f(1)
      call gather_first(open%at, by, end_by, gap)
      if (.not. leaves_second) call gather_second(open, sums, mix, by, gap)
      if (sums%n_weight > 1 .and. .not. of_cover) call times_area(open%area, leaves_second, gap)
   end subroutine patch_gap_of

   !> No gap yet, of `n` variables.
   pure subroutine make_room(n, leaves_second, gap)
      integer, intent(in) :: n
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(inout) :: gap

      gap%f0 = 0.0_wp
      gap%f1 = 0.0_wp
      gap%df = 0.0_wp
      if (allocated(gap%g)) then
         if (size(gap%g) /= n) deallocate(gap%g, gap%c)
      end if
      if (.not. allocated(gap%g)) allocate(gap%g(n), gap%c(n))
      gap%g = 0.0_wp
      gap%c = 0.0_wp
      if (leaves_second) return
      if (allocated(gap%h)) then
         if (size(gap%h, 1) /= n) deallocate(gap%h)
      end if
      if (.not. allocated(gap%h)) allocate(gap%h(n, n))
      gap%h = 0.0_wp
   end subroutine make_room

   !> Times the area of the frame, by the rule of products.
   pure subroutine times_area(area, leaves_second, gap)
      type(frame_area_t), intent(in) :: area
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(inout) :: gap
      real(wp) :: mean, mean_area
      integer, parameter :: n = 6
      integer :: j

      mean = 0.5_wp*(gap%f0 + gap%f1)
      mean_area = 0.5_wp*(area%f(0) + area%f(1))
      if (.not. leaves_second) then
         do j = 1, size(gap%h, 2)
            gap%h(:, j) = mean_area*gap%h(:, j)
            if (j <= n) then
               gap%h(:, j) = gap%h(:, j) + (0.5_wp*area%c(j))*gap%g
               gap%h(:n, j) = gap%h(:n, j) + mean*area%h(:, j)
            end if
            gap%h(:n, j) = gap%h(:n, j) + (0.5_wp*gap%c(j))*area%g
         end do
      end if
      gap%g = mean_area*gap%g
      gap%g(:n) = gap%g(:n) + mean*area%g
      gap%c = area%f(1)*gap%c
      gap%c(:n) = gap%c(:n) + gap%f1*area%c
      gap%df = mean_area*gap%df + mean*area%df
      gap%f0 = area%f(0)*gap%f0
      gap%f1 = area%f(1)*gap%f1
   end subroutine times_area

   !> Coordinates in the patch in place of those in the frame.
   pure subroutine to_patch(patch, at, second)
      type(patch_t), intent(in) :: patch
      type(frame_vertex_t), intent(inout) :: at
      real(wp), intent(inout) :: second(:, :, :) !! of its place

      associate (length => patch%length)
         at%f(:at_eta, :) = at%f(:at_eta, :)/length + patch%area%centre
         at%df(:at_eta) = at%df(:at_eta)/length
         at%g(:, :at_eta) = at%g(:, :at_eta)/length
         at%c(:, :at_eta) = at%c(:, :at_eta)/length
         second(:, :, :at_eta) = second(:, :, :at_eta)/length
      end associate
   end subroutine to_patch

   !> The triangles over the patch at either end, and their vertices.
   pure subroutine choose_fields(patch, start, place, open)
      type(patch_t), intent(in) :: patch
      type(patch_start_t), intent(in) :: start   !! what it sees there
      real(wp), intent(in) :: place(:, :)        !! (3, n_vertex) at the end
      type(patch_open_t), intent(inout) :: open
      type(field_t) :: field
      integer :: number(patch%n_vertex), i, k, n
      logical :: is_seen(patch%n_triangle), is_over

      call patch_sees(patch, start, place, is_seen)
      allocate(open%vertex(patch%n_vertex), open%field(count(is_seen .or. start%number > 0)))
      number = 0
      n = 0
      do k = 1, patch%n_triangle
         is_over = start%number(k) > 0
         if (.not. (is_seen(k) .or. is_over)) cycle
         associate (t => patch%triangle(:, k), n_weight => patch%area%n_weight)
            field = field_t()
            if (is_over) field%moment(:n_weight, :, 0) = start%moment(:, :, start%number(k))
            if (is_seen(k)) field%moment(:n_weight, :, 1) = patch_moments_of(patch, place(:2, t))
            if (.not. any(abs(field%moment) > 0.0_wp)) cycle
            n = n + 1
            do i = 1, 3
               if (number(t(i)) == 0) then
                  open%n_vertex = open%n_vertex + 1
                  open%vertex(open%n_vertex) = t(i)
                  number(t(i)) = open%n_vertex
               end if
               field%vertex(i) = number(t(i))
            end do
            open%field(n) = field
         end associate
      end do
      if (n < size(open%field)) open%field = open%field(:n)
   end subroutine choose_fields

   !> First derivatives by the frame and by the vertices.
   pure subroutine gather_first(at, by, end_by, gap)
      type(frame_vertex_t), intent(in) :: at(:)
      real(wp), intent(in) :: by(:, :), end_by(:, :)   !! (3, n_vertex)
      type(patch_gap_t), intent(inout) :: gap
      integer :: j

      do j = 1, size(at)
         gap%df = gap%df + dot_product(by(:, j), at(j)%df)
         associate (place => places(j))
            gap%g(place) = gap%g(place) + matmul(at(j)%g, by(:, j))
            gap%c(place) = gap%c(place) + matmul(at(j)%c, end_by(:, j))
         end associate
      end do
   end subroutine gather_first

   !> Second derivatives by the frame and by the vertices: G change C^T, and those of the places.
   pure subroutine gather_second(open, sums, mix, by, gap)
      type(patch_open_t), intent(in) :: open
      type(patch_sums_t), intent(in) :: sums
      type(sums_mix_t), intent(in) :: mix
      real(wp), intent(in), contiguous :: by(:, :)       !! (3, n_vertex)
      type(patch_gap_t), intent(inout) :: gap
      real(wp) :: change(3*open%n_vertex, 3*open%n_vertex)
      real(wp) :: left(6 + 3*open%n_vertex, 3*open%n_vertex)     ! G change
      real(wp) :: frame(6, 3*open%n_vertex), total(6), own(n_frame_var, n_frame_var)
      integer :: i, j, k, l, place(n_frame_var)

      call sums_take_change(sums, mix, change)
      do j = 1, open%n_vertex
         frame(:, 3*j - 2:3*j) = open%at(j)%g(:6, :)
      end do
      do k = 1, size(left, 2)
         total = 0.0_wp
         do i = 1, size(left, 2)
            total = total + frame(:, i)*change(i, k)
         end do
         left(:6, k) = total
         do j = 1, open%n_vertex
            associate (g => open%at(j)%g)
               left(3*j + 4:3*j + 6, k) = g(7:, 1)*change(3*j - 2, k) &
                  + g(7:, 2)*change(3*j - 1, k) + g(7:, 3)*change(3*j, k)
            end associate
         end do
      end do
      do l = 1, open%n_vertex
         place = places(l)
         associate (c => open%at(l)%c, second => open%second(:, :, :, l), last => 3*l + 6)
            own = by(1, l)*second(:, :, 1) + by(2, l)*second(:, :, 2) + by(3, l)*second(:, :, 3)
            do i = 1, n_frame_var
               associate (column => gap%h(:, place(i)))
                  column = column + c(i, 1)*left(:, 3*l - 2) + c(i, 2)*left(:, 3*l - 1) &
                     + c(i, 3)*left(:, 3*l)
                  column(:6) = column(:6) + own(:6, i)
                  column(last - 2:last) = column(last - 2:last) + own(7:, i)
               end associate
            end do
         end associate
      end do
   end subroutine gather_second

   !> Where the variables of vertex `j` are among all.
   pure function places(j) result(place)
      integer, intent(in) :: j
      integer :: place(n_frame_var)
      integer :: k

      place = [(k, k = 1, 6), (6 + 3*(j - 1) + k, k = 1, 3)]
   end function places

end module emcon_patch_gap_space
