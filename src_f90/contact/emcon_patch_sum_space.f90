! build: elements
!> The sum over the triangles that a patch is over in a step, and how it changes: what each vertex
!> takes, and what closes the discrete gradient. Source: docs/theory.md, eqs. (46) to (49).
!>
!> But for what closes it the sum is linear in the weights of the patch, and in the target that
!> heights are counted from: it is made once for each weight and both kinds of fields, of heights
!> and of 1, and combined for whoever asks.
module emcon_patch_sum_space
   use emcon_frame_vertex_space, only : at_eta, at_height, frame_vertex_t
   use emcon_kinds, only : wp
   use emcon_patch_field_space, only : field_slopes, field_slopes_t, field_t, form_field, &
      formed_t, of_height, of_one
   use emcon_patch_moments_space, only : patch_area_t
   implicit none
   private
   public :: patch_sums_t, sums_make, sums_mix_t, sums_mix, sums_take, sums_take_change

   !> Remainders below so many epsilons of what they are the difference of are round-off.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
   !> A vertex whose triangles cover so much of the patch at both ends together has half its weight.
   real(wp), parameter :: some = 0.1_wp

   !> What is put on the ways of the vertices in the patch, and how it changes.
   type :: closing_t
      real(wp), allocatable :: weight(:)         !! (n_vertex) 0 to 1: as its triangles are covered
      real(wp), allocatable :: way(:, :)         !! (2, n_vertex)
      real(wp) :: square = 0.0_wp                !! the sum of weight times way squared
      !> (3 n_vertex, n_vertex) slopes of the weights, and (3 n_vertex) those of the square
      real(wp), allocatable :: weight_slope(:, :), by_square(:)
   end type closing_t

   !> The sums of a patch, by weight and kind.
   type :: patch_sums_t
      integer :: n_weight = 1
      integer :: n_kind = of_height              !! of gradients: where nothing fades 1 has none
      real(wp) :: f(3, of_height:of_one, 0:1) = 0.0_wp   !! at both ends
      real(wp) :: rest(3, of_height:of_one) = 0.0_wp     !! what moments gain
      !> (3, n_vertex, weight, kind) by places and heights, in the mean and at the end
      real(wp), allocatable :: by(:, :, :, :), end_by(:, :, :, :)
      !> (3 n_vertex, 3 n_vertex, weight, kind) how the first changes, if asked for
      real(wp), allocatable :: change(:, :, :, :)
      real(wp), allocatable :: by_rest(:, :, :)  !! (3 n_vertex, weight, kind) slopes of the rest
      real(wp), allocatable :: total(:, :, :)    !! (3, kind, n_field) values at both ends together
      type(closing_t) :: closing
   end type patch_sums_t

   !> A combination of them, and what closes its gradient.
   type :: sums_mix_t
      real(wp), private :: part(3, of_height:of_one) = 0.0_wp    !! of each sum
      real(wp), private :: factor = 0.0_wp       !! of weight times way [L]
      real(wp), private :: by_rest = 0.0_wp      !! its slope by the rest
   end type sums_mix_t

contains

   !> Sum up what fields over a patch are.
   pure subroutine sums_make(area, chi, at, field, leaves_second, sums)
      type(patch_area_t), intent(in) :: area     !! what the patch is
      real(wp), intent(in) :: chi(:)             !! (n_vertex)
      type(frame_vertex_t), intent(in) :: at(:)  !! (n_vertex) where they are
      type(field_t), intent(in) :: field(:)      !! the triangles, placed
      logical, intent(in) :: leaves_second       !! nobody asks how the sums change
      type(patch_sums_t), intent(out) :: sums
      type(formed_t) :: formed
      real(wp) :: height(size(at), 0:1), corner(2, size(at)), covered(size(at))
      integer :: j, k

      sums%n_weight = area%n_weight
      sums%n_kind = merge(of_one, of_height, any(chi < 1.0_wp))
      call make_room(sums, size(at), size(field), leaves_second)
      call closing_begin(at, field, sums%closing, covered)
      do j = 1, size(at)
         corner(:, j) = at(j)%f(:at_eta, 1)
         height(j, :) = at(j)%f(at_height, :)
      end do
      do k = 1, size(field)
         associate (v => field(k)%vertex)
            call form_field(sums%n_weight, chi(v), height(v, :), field(k), formed)
            call add_values(chi(v), field(k), formed, sums)
            sums%total(:, :, k) = sum(formed%value, 3)
            if (.not. leaves_second) call add_changes(area, chi(v), corner(:, v), field(k), &
               formed, sums)
         end associate
      end do
      if (.not. leaves_second) call closing_change(covered, sums%closing)
   end subroutine sums_make

   !> Nothing summed up yet.
   pure subroutine make_room(sums, n_vertex, n_field, leaves_second)
      type(patch_sums_t), intent(inout) :: sums  !! with its weights and kinds
      integer, intent(in) :: n_vertex, n_field
      logical, intent(in) :: leaves_second

      associate (n => n_vertex, m => sums%n_weight)
         allocate(sums%by(3, n, m, sums%n_kind), sums%end_by(3, n, m, sums%n_kind), source=0.0_wp)
         allocate(sums%total(3, of_one, n_field))
         if (leaves_second) return
         allocate(sums%change(3*n, 3*n, m, sums%n_kind), sums%by_rest(3*n, m, of_one), &
            sums%closing%weight_slope(3*n, n), source=0.0_wp)
      end associate
   end subroutine make_room

   !> Add the values of a field, and its gradients by places and heights.
   pure subroutine add_values(chi, field, formed, sums)
      real(wp), intent(in) :: chi(3)             !! at its corners
      type(field_t), intent(in) :: field
      type(formed_t), intent(in) :: formed
      type(patch_sums_t), intent(inout) :: sums
      integer :: a, j, kind, w

      do kind = of_height, of_one
         associate (value => formed%value(:, kind, :))
            do w = 1, sums%n_weight
               sums%f(w, kind, 0) = sums%f(w, kind, 0) + dot_product(field%moment(w, :, 0), &
                  value(:, 1))
               sums%f(w, kind, 1) = sums%f(w, kind, 1) + dot_product(field%moment(w, :, 1), &
                  value(:, 2))
               sums%rest(w, kind) = sums%rest(w, kind) + 0.5_wp*dot_product( &
                  field%moment(w, :, 1) - field%moment(w, :, 0), value(:, 1) + value(:, 2))
            end do
         end associate
      end do
      do kind = of_height, sums%n_kind
         do w = 1, sums%n_weight
            do j = 1, 3
               associate (by => sums%by(:, field%vertex(j), w, kind), part => formed%part(j, w), &
                     end_by => sums%end_by(:, field%vertex(j), w, kind), &
                     end_part => formed%end_part(j, w), slope => formed%slope(:, kind, :))
                  do a = 1, at_eta
                     by(a) = by(a) - 0.5_wp*(slope(a, 1) + slope(a, 2))*part
                     end_by(a) = end_by(a) - slope(a, 2)*end_part
                  end do
                  if (kind /= of_height) cycle
                  by(at_height) = by(at_height) + chi(j)*part
                  end_by(at_height) = end_by(at_height) + chi(j)*end_part
               end associate
            end do
         end do
      end do
   end subroutine add_values

   !> Add how gradients and the rest change with the places and heights at the end.
   pure subroutine add_changes(area, chi, corner, field, formed, sums)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: chi(3)             !! at its corners
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      type(formed_t), intent(in) :: formed
      type(patch_sums_t), intent(inout) :: sums
      type(field_slopes_t) :: slopes
      integer :: a, kind, l, w

      call field_slopes(area, chi, corner, field, formed, slopes)
      do kind = of_height, sums%n_kind
         do w = 1, sums%n_weight
            call add_change(chi, field%vertex, formed, slopes, w, kind, sums%change(:, :, w, kind))
         end do
      end do
      do kind = of_height, of_one
         do w = 1, sums%n_weight
            call add_rest(chi, field%vertex, formed, slopes, w, kind, sums%by_rest(:, w, kind))
         end do
      end do
      do l = 1, 3
         do a = 1, at_eta
            associate (slope => sums%closing%weight_slope(3*(field%vertex(l) - 1) + a, :))
               slope(field%vertex) = slope(field%vertex) &
                  + sum(slopes%moment(:, a, l, :sums%n_weight))
            end associate
         end do
      end do
   end subroutine add_changes

   !> Of the gradient, for one weight and kind.
   pure subroutine add_change(chi, vertex, formed, slopes, w, kind, change)
      real(wp), intent(in) :: chi(3)             !! at the corners
      integer, intent(in) :: vertex(3)           !! which they are
      type(formed_t), intent(in) :: formed
      type(field_slopes_t), intent(in) :: slopes
      integer, intent(in) :: w, kind
      real(wp), intent(inout) :: change(:, :)    !! (3 n_vertex, 3 n_vertex)
      real(wp) :: mean(at_eta)                   ! slope
      integer :: a, b, i, l

      mean = 0.5_wp*(formed%slope(:, kind, 0) + formed%slope(:, kind, 1))
      do l = 1, 3
         do b = 1, 3
            do i = 1, 3
               associate (row => 3*(vertex(i) - 1), column => 3*(vertex(l) - 1) + b, &
                     part => slopes%part(i, b, l, w))
                  do a = 1, at_eta
                     change(row + a, column) = change(row + a, column) - mean(a)*part &
                        - formed%part(i, w)*slopes%slope(a, b, l, kind)
                  end do
                  if (kind == of_height) change(row + at_height, column) = &
                     change(row + at_height, column) + chi(i)*part
               end associate
            end do
         end do
      end do
   end subroutine add_change

   !> Of the rest.
   pure subroutine add_rest(chi, vertex, formed, slopes, w, kind, by_rest)
      real(wp), intent(in) :: chi(3)             !! at the corners
      integer, intent(in) :: vertex(3)           !! which they are
      type(formed_t), intent(in) :: formed
      type(field_slopes_t), intent(in) :: slopes
      integer, intent(in) :: w, kind
      real(wp), intent(inout) :: by_rest(:)      !! (3 n_vertex)
      real(wp) :: mean(3)                        ! value
      integer :: a, l

      mean = 0.5_wp*(formed%value(:, kind, 0) + formed%value(:, kind, 1))
      do l = 1, 3
         associate (to => by_rest(3*vertex(l) - 2:3*vertex(l)), rest => slopes%rest(l, w))
            do a = 1, at_eta
               to(a) = to(a) + dot_product(mean, slopes%moment(:, a, l, w)) &
                  - rest*formed%slope(a, kind, 1)
            end do
            if (kind == of_height) to(at_height) = to(at_height) + rest*chi(l)
         end associate
      end do
   end subroutine add_rest

   !> The ways of the vertices, each by what it has to do with the patch: docs/theory.md, eq. (48).
   pure subroutine closing_begin(at, field, closing, covered)
      type(frame_vertex_t), intent(in) :: at(:)  !! (n_vertex)
      type(field_t), intent(in) :: field(:)      !! the triangles, placed
      type(closing_t), intent(inout) :: closing
      real(wp), intent(out) :: covered(:)        !! (n_vertex) by its triangles, at both ends
      integer :: j, k

      covered = 0.0_wp
      do k = 1, size(field)
         associate (v => field(k)%vertex)
            covered(v) = covered(v) + sum(field(k)%moment)
         end associate
      end do
      allocate(closing%weight(size(at)), closing%way(at_eta, size(at)))
      ! By ways of round-off nothing is divided.
      closing%square = rounding
      do j = 1, size(at)
         closing%weight(j) = covered(j)/(covered(j) + some)
         closing%way(:, j) = at(j)%df(:at_eta)
         closing%square = closing%square + closing%weight(j)*sum(closing%way(:, j)**2)
      end do
   end subroutine closing_begin

   !> From slopes of what is covered to those of the weights, and of the square.
   pure subroutine closing_change(covered, closing)
      real(wp), intent(in) :: covered(:)         !! (n_vertex)
      type(closing_t), intent(inout) :: closing
      integer :: j

      allocate(closing%by_square(size(closing%weight_slope, 1)), source=0.0_wp)
      associate (by_square => closing%by_square, slope => closing%weight_slope)
         do j = 1, size(covered)
            slope(:, j) = some/(covered(j) + some)**2*slope(:, j)
            by_square(3*j - 2:3*j - 1) = by_square(3*j - 2:3*j - 1) &
               + 2.0_wp*closing%weight(j)*closing%way(:, j)
            by_square = by_square + sum(closing%way(:, j)**2)*slope(:, j)
         end do
      end associate
   end subroutine closing_change

   !> The combination by `weight`, of heights from `target` or of 1.
   pure function sums_mix(sums, weight, target, of_cover) result(mix)
      type(patch_sums_t), intent(in) :: sums
      real(wp), intent(in) :: weight(:)          !! (>= n_weight)
      real(wp), intent(in) :: target             !! [L]
      logical, intent(in) :: of_cover            !! of 1: what is covered
      type(sums_mix_t) :: mix
      real(wp) :: of_kind(of_height:of_one)      ! of each kind of field
      real(wp) :: rest, size_of, ratio
      integer :: k, w

      of_kind = [1.0_wp, -target]
      if (of_cover) of_kind = [0.0_wp, 1.0_wp]
      do w = 1, sums%n_weight
         mix%part(w, :) = weight(w)*of_kind
      end do
      rest = sum(mix%part*sums%rest)
      size_of = tiny(size_of)
      do k = 1, size(sums%total, 3)
         size_of = max(size_of, maxval(abs(matmul(sums%total(:, :, k), of_kind))))
      end do
      ratio = (rest/(rounding*size_of))**2
      ratio = merge(ratio/(1.0_wp + ratio), 1.0_wp, ratio <= huge(ratio))
      mix%factor = ratio*rest/sums%closing%square
      mix%by_rest = ratio*(3.0_wp - 2.0_wp*ratio)/sums%closing%square
   end function sums_mix

   !> The values of a combination, and its gradients by places and heights.
   pure subroutine sums_take(sums, mix, f, by, end_by)
      type(patch_sums_t), intent(in) :: sums
      type(sums_mix_t), intent(in) :: mix
      real(wp), intent(out) :: f(0:1)            !! at both ends
      real(wp), intent(out), contiguous :: by(:, :), end_by(:, :)    !! (3, n_vertex)
      integer :: a, end, j, kind, w

      do end = 0, 1
         f(end) = sum(mix%part*sums%f(:, :, end))
      end do
      by = 0.0_wp
      end_by = 0.0_wp
      do kind = of_height, sums%n_kind
         do w = 1, sums%n_weight
            by = by + mix%part(w, kind)*sums%by(:, :, w, kind)
            end_by = end_by + mix%part(w, kind)*sums%end_by(:, :, w, kind)
         end do
      end do
      associate (weight => sums%closing%weight, way => sums%closing%way)
         do j = 1, size(weight)
            do a = 1, at_eta
               by(a, j) = by(a, j) + mix%factor*weight(j)*way(a, j)
            end do
         end do
      end associate
   end subroutine sums_take

   !> How the first of these gradients changes with places and heights at the end.
   pure subroutine sums_take_change(sums, mix, change)
      type(patch_sums_t), intent(in) :: sums     !! with its changes
      type(sums_mix_t), intent(in) :: mix
      real(wp), intent(out), contiguous :: change(:, :)  !! (3 n_vertex, 3 n_vertex)
      real(wp) :: slope(size(change, 1))         ! of the factor
      integer :: a, i, j, k, kind, w

      change = 0.0_wp
      do kind = of_height, sums%n_kind
         do w = 1, sums%n_weight
            change = change + mix%part(w, kind)*sums%change(:, :, w, kind)
         end do
      end do
      slope = 0.0_wp
      do kind = of_height, of_one
         do w = 1, sums%n_weight
            slope = slope + mix%part(w, kind)*sums%by_rest(:, w, kind)
         end do
      end do
      associate (closing => sums%closing)
         slope = mix%by_rest*slope - mix%factor/closing%square*closing%by_square
         do k = 1, size(change, 2)
            do j = 1, size(closing%weight)
               do a = 1, at_eta
                  i = 3*(j - 1) + a
                  change(i, k) = change(i, k) + closing%way(a, j)*(closing%weight(j)*slope(k) &
                     + mix%factor*closing%weight_slope(k, j))
               end do
            end do
         end do
         do j = 1, size(closing%weight)
            do a = 1, at_eta
               i = 3*(j - 1) + a
               change(i, i) = change(i, i) + mix%factor*closing%weight(j)
            end do
         end do
      end associate
   end subroutine sums_take_change

end module emcon_patch_sum_space
