! build: elements
!> The height of a surface of triangles over a patch: its mean over a small square that moves with a
!> node, or its integral over a triangle of a slave facet, with a weight.
!>
!> The field over the frame of the patch is continuous, so its integral is smooth while the patch
!> slides over sides and corners of the triangles. Source: docs/theory.md, eqs. (43) to (49).
module emcon_patch_gap_space
   use emcon_frame_vertex_space, only : at_eta, at_height, frame_area, frame_area_t, frame_vertex, &
      frame_vertex_t, n_frame_var
   use emcon_kinds, only : wp
   use emcon_patch_look_space, only : patch_t, place_vertices
   use emcon_patch_moments_space, only : patch_area_t, patch_misses, patch_moments, &
      patch_products
   use emcon_patch_sum_space, only : add_end, change_of_closing, change_of_parts, close_sum, &
      closing_begin, closing_t, field_t, form_field, outer, place_field
   implicit none
   private
   public :: patch_gap_t, patch_gap, patch_open_t, patch_open, patch_open_cover, &
      patch_gap_of

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

   !> What the gaps of a patch over a step have in common, whatever their weights and targets are,
   !> and room for those of one of them.
   type :: patch_open_t
      integer :: n_vertex = 0                    !! that they depend on
      integer, allocatable :: vertex(:)          !! (>= n_vertex) their numbers
      real(wp), allocatable, private :: chi(:)               !! (n_vertex)
      type(frame_vertex_t), allocatable, private :: at(:)    !! (n_vertex)
      type(field_t), allocatable, private :: field(:)
      type(closing_t), private :: closing
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

      call patch_open(patch, x, dx, leaves_second, open)
      call patch_gap_of(open, patch%area, patch%of_cover, patch%is_integral, target, &
         leaves_second, gap)
      gap%n_vertex = open%n_vertex
      gap%vertex = open%vertex(:open%n_vertex)
   end subroutine patch_gap

   !> What a patch is over in a step.
   pure subroutine patch_open(patch, x, dx, leaves_second, open)
      type(patch_t), intent(in) :: patch         !! whatever its weights are
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! as `patch_gap`
      logical, intent(in) :: leaves_second       !! no gap with second derivatives is asked for
      type(patch_open_t), intent(out) :: open
      real(wp) :: place(3, patch%n_vertex, 0:1), corner(2, 3, 0:1)
      integer :: end, j, k

      call place_vertices(patch, x, place(:, :, 0))
      call place_vertices(patch, x + dx, place(:, :, 1))
      call choose_fields(patch, place, open)
      allocate(open%at(open%n_vertex))
      do j = 1, open%n_vertex
         associate (node => [1, 2, 3, 3 + open%vertex(j)])
            call frame_vertex(x(:, node), dx(:, node), leaves_second, open%at(j))
         end associate
         call to_patch(patch, leaves_second, open%at(j))
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
      call closing_begin(open%at, open%field, open%closing)
      if (patch%area%n_side == 3) call frame_area(x(:, :3), dx(:, :3), leaves_second, open%area)
   end subroutine patch_open

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
                  f%at_end(:, :, end), f%bare(:, end)))
            end do
         end associate
      end do
   end function patch_open_cover

   !> The gap of a patch.
   pure subroutine patch_gap_of(open, patch_area, of_cover, is_integral, target, leaves_second, &
         gap)
      type(patch_open_t), intent(inout) :: open  !! of the patch
      type(patch_area_t), intent(in) :: patch_area   !! what that is, with its weight
      logical, intent(in) :: of_cover, is_integral   !! as `patch_t` has them
      real(wp), intent(in) :: target             !! that heights are counted from [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(patch_gap_t), intent(inout) :: gap
      integer :: end, k

      call make_room(6 + 3*open%n_vertex, leaves_second, gap)
      if (patch_area%n_side == 3) then
         do k = 1, size(open%field)
            associate (f => open%field(k))
               do end = 0, 1
                  f%moment(:, end) = matmul(patch_area%weight, f%products(:, :, end))
               end do
            end associate
         end do
      end if
      call add_up(open, patch_area, of_cover, target, leaves_second, gap)
      if (is_integral) call times_area(open%area, leaves_second, gap)
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

      mean = 0.5_wp*(gap%f0 + gap%f1)
      mean_area = 0.5_wp*(area%f(0) + area%f(1))
      if (.not. leaves_second) then
         gap%h = mean_area*gap%h
         gap%h(:, :n) = gap%h(:, :n) + 0.5_wp*outer(gap%g, area%c)
         gap%h(:n, :) = gap%h(:n, :) + 0.5_wp*outer(area%g, gap%c)
         gap%h(:n, :n) = gap%h(:n, :n) + mean*area%h
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
   pure subroutine to_patch(patch, leaves_second, at)
      type(patch_t), intent(in) :: patch
      logical, intent(in) :: leaves_second
      type(frame_vertex_t), intent(inout) :: at

      associate (length => patch%length)
         at%f(:at_eta, :) = at%f(:at_eta, :)/length + patch%area%centre
         at%df(:at_eta) = at%df(:at_eta)/length
         at%g(:, :at_eta) = at%g(:, :at_eta)/length
         at%c(:, :at_eta) = at%c(:, :at_eta)/length
         if (.not. leaves_second) at%h(:, :, :at_eta) = at%h(:, :, :at_eta)/length
      end associate
   end subroutine to_patch

   !> The triangles over the patch at either end, and their vertices.
   pure subroutine choose_fields(patch, place, open)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: place(:, :, 0:)    !! (3, n_vertex, 0:1)
      type(patch_open_t), intent(inout) :: open
      type(field_t) :: field
      integer :: number(patch%n_vertex), i, k, n
      logical :: is_seen(patch%n_triangle)

      do k = 1, patch%n_triangle
         is_seen(k) = .not. is_missed(patch, place(:2, patch%triangle(:, k), :))
      end do
      allocate(open%vertex(patch%n_vertex), open%field(count(is_seen)))
      number = 0
      n = 0
      do k = 1, patch%n_triangle
         if (.not. is_seen(k)) cycle
         associate (t => patch%triangle(:, k))
            field = field_t()
            call find_moments(patch, place(:2, t, :), field)
            if (.not. any(abs(field%bare) > 0.0_wp)) cycle
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

   !> Is a triangle beside a patch at both ends?
   pure logical function is_missed(patch, corner)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: corner(2, 3, 0:1)

      is_missed = patch_misses(patch%area, corner(:, :, 0))
      if (is_missed) is_missed = patch_misses(patch%area, corner(:, :, 1))
   end function is_missed

   !> The moments of a triangle at both ends.
   pure subroutine find_moments(patch, corner, field)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: corner(2, 3, 0:1)
      type(field_t), intent(inout) :: field
      integer :: end

      do end = 0, 1
         if (patch%area%n_side == 3) then
            field%products(:, :, end) = patch_products(patch%area, corner(:, :, end))
            field%bare(:, end) = sum(field%products(:, :, end), 1)
         else
            call patch_moments(patch%area, corner(:, :, end), field%moment(:, end), &
               field%bare(:, end))
         end if
      end do
   end subroutine find_moments

   !> The sum over triangles, docs/theory.md, eqs. (46) and (47).
   pure subroutine add_up(open, patch_area, of_cover, target, leaves_second, gap)
      type(patch_open_t), intent(inout) :: open  !! its fields have their moments
      type(patch_area_t), intent(in) :: patch_area
      logical, intent(in) :: of_cover
      real(wp), intent(in) :: target             !! [L]
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(inout) :: gap
      real(wp), dimension(3, open%n_vertex) :: by, end_by
      real(wp), dimension(open%n_vertex) :: chi, flat !! of heights, and of 1
      real(wp) :: corner(2, open%n_vertex)       !! at the end
      real(wp) :: height(open%n_vertex, 0:1)
      real(wp), allocatable :: change(:, :)
      integer :: k

      chi = open%chi
      flat = 0.0_wp
      if (of_cover) then
         flat = chi
         chi = 0.0_wp
      end if
      do k = 1, open%n_vertex
         corner(:, k) = open%at(k)%f(:at_eta, 1)
         height(k, :) = open%at(k)%f(at_height, :)
      end do
      by = 0.0_wp
      end_by = 0.0_wp
      do k = 1, size(open%field)
         associate (f => open%field(k), v => open%field(k)%vertex)
            call form_field(chi(v), flat(v), target, height(v, :), f)
            gap%f0 = gap%f0 + dot_product(f%moment(:, 0), f%value(:, 0))
            gap%f1 = gap%f1 + dot_product(f%moment(:, 1), f%value(:, 1))
            by(at_height, v) = by(at_height, v) + chi(v)*f%part
            by(:at_eta, v) = by(:at_eta, v) - outer(sum(f%slope, 2)/2.0_wp, f%part)
            call add_end(chi(v), f, end_by)
         end associate
      end do
      associate (closing => open%closing)
         call close_sum(open%field, closing)
         by(:at_eta, :) = by(:at_eta, :) + closing%factor*spread(closing%weight, 1, at_eta) &
            *closing%way
         call gather_first(open%at, by, end_by, gap)
         if (leaves_second) return
         allocate(change(3*open%n_vertex, 3*open%n_vertex))
         call change_of_parts(patch_area, chi, corner, open%field, change)
         call change_of_closing(patch_area, chi, corner, open%field, closing, change)
      end associate
      call gather_second(open%at, by, change, gap)
   end subroutine add_up

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

   !> Second derivatives by the frame and by the vertices.
   pure subroutine gather_second(at, by, change, gap)
      type(frame_vertex_t), intent(in) :: at(:)
      real(wp), intent(in) :: by(:, :), change(:, :)
      type(patch_gap_t), intent(inout) :: gap
      real(wp) :: sums(3, 6 + 3*size(at))        !! what places and heights of a vertex take
      integer :: column(n_frame_var), i, j, k, l

      do j = 1, size(at)
         sums = 0.0_wp
         do l = 1, size(at)
            column = places(l)
            associate (by_l => change(3*j - 2:3*j, 3*l - 2:3*l), c => at(l)%c)
               do i = 1, n_frame_var
                  sums(:, column(i)) = sums(:, column(i)) + (by_l(:, 1)*c(i, 1) &
                     + by_l(:, 2)*c(i, 2) + by_l(:, 3)*c(i, 3))
               end do
            end associate
         end do
         associate (row => places(j), g => at(j)%g)
            do i = 1, size(sums, 2)
               gap%h(row, i) = gap%h(row, i) + (g(:, 1)*sums(1, i) + g(:, 2)*sums(2, i) &
                  + g(:, 3)*sums(3, i))
            end do
            do k = 1, 3
               gap%h(row, row) = gap%h(row, row) + by(k, j)*at(j)%h(:, :, k)
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
