! build: elements
!> The sum over the triangles that a patch is over in a step, and how it changes: fields, what each
!> vertex takes, and what closes the discrete gradient. Source: docs/theory.md, eqs. (46) to (49).
module emcon_patch_sum_space
   use emcon_frame_vertex_space, only : at_eta, at_height, frame_vertex_t
   use emcon_kinds, only : wp
   use emcon_patch_look_space, only : unit_corner
   use emcon_patch_moments_space, only : patch_area_t, patch_moment_slopes
   use emcon_polygon_clip_space, only : barycentric
   implicit none
   private
   public :: field_t, place_field, form_field, add_end, change_of_parts, closing_t, closing_begin, &
      close_sum, change_of_closing, outer

   !> Remainders below so many epsilons of what they are the difference of are round-off.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
   !> A vertex whose triangles cover so much of the patch at both ends together has half its weight.
   real(wp), parameter :: some = 0.1_wp

   !> One triangle over a step.
   type :: field_t
      integer :: vertex(3) = 0                   !! among those that count
      real(wp) :: moment(3, 0:1) = 0.0_wp        !! over the part of the patch that it covers
      real(wp) :: bare(3, 0:1) = 0.0_wp          !! the same without weights
      real(wp) :: products(3, 3, 0:1) = 0.0_wp   !! of patches of facets: for each weight
      real(wp) :: value(3, 0:1) = 0.0_wp         !! its field at the `unit_corner` [L]
      real(wp) :: slope(2, 0:1) = 0.0_wp         !! of the field [L]
      real(wp) :: share(3, 3) = 0.0_wp           !! (j, v) of its corner j at v, in the mean
      real(wp) :: at_end(3, 3, 0:1) = 0.0_wp     !! the same at the start and at the end
      real(wp) :: part(3) = 0.0_wp               !! of the integral that each corner takes
   end type field_t

   !> What is put on the ways of the vertices in the patch, and how it changes.
   type :: closing_t
      real(wp), allocatable :: weight(:)         !! (n_vertex) 0 to 1: as its triangles are covered
      real(wp), allocatable :: weight_slope(:)   !! (n_vertex) by what they cover of the patch
      real(wp), allocatable :: way(:, :)         !! (2, n_vertex)
      real(wp) :: factor = 0.0_wp                !! of weight times way [L]
      real(wp) :: by_rest = 0.0_wp               !! its slope by the rest,
      real(wp) :: by_square = 0.0_wp             !! and by the sum of weight times way squared
   end type closing_t

contains

   !> Where the corners of a triangle are: their shares at the `unit_corner`.
   pure subroutine place_field(corner, field)
      real(wp), intent(in) :: corner(2, 3, 0:1)  !! at both ends
      type(field_t), intent(inout) :: field
      integer :: v, end

      do v = 1, 3
         do end = 0, 1
            field%at_end(:, v, end) = barycentric(corner(:, :, end), unit_corner(:, v))
         end do
         field%share(:, v) = barycentric(sum(corner, 3)/2.0_wp, unit_corner(:, v))
      end do
   end subroutine place_field

   !> The field of a triangle at both ends.
   pure subroutine form_field(chi, flat, target, height, field)
      real(wp), intent(in) :: chi(3), flat(3)    !! of heights, and of 1
      real(wp), intent(in) :: target             !! [L]
      real(wp), intent(in) :: height(3, 0:1)     !! of its corners [L]
      type(field_t), intent(inout) :: field      !! in: with its moments, placed
      real(wp) :: p(3)
      integer :: v, end

      do end = 0, 1
         p = chi*(height(:, end) - target) + flat
         do v = 1, 3
            field%value(v, end) = dot_product(p, field%at_end(:, v, end))
         end do
         field%slope(:, end) = field%value(2:3, end) - field%value(1, end)
      end do
      field%part = matmul(field%share, sum(field%moment, 2)/2.0_wp)
   end subroutine form_field

   !> Add the gradient at the end by places and heights.
   pure subroutine add_end(chi, field, by)
      real(wp), intent(in) :: chi(3)             !! at its corners
      type(field_t), intent(in) :: field         !! formed
      real(wp), intent(inout) :: by(:, :)        !! (3, n_vertex)
      real(wp) :: part(3)
      integer :: v

      part = 0.0_wp
      do v = 1, 3
         part = part + field%moment(v, 1)*field%at_end(:, v, 1)
      end do
      associate (to => field%vertex)
         by(at_height, to) = by(at_height, to) + chi*part
         by(:at_eta, to) = by(:at_eta, to) - outer(field%slope(:, 1), part)
      end associate
   end subroutine add_end

   !> How what the vertices take changes with places and heights at the end.
   pure subroutine change_of_parts(patch_area, chi, corner, field, change)
      type(patch_area_t), intent(in) :: patch_area   !! what the patch is
      real(wp), intent(in) :: chi(:)             !! (n_vertex)
      real(wp), intent(in) :: corner(:, :)       !! (2, n_vertex) at the end
      type(field_t), intent(in) :: field(:)      !! the triangles, formed
      real(wp), intent(out) :: change(:, :)      !! (3 n_vertex, 3 n_vertex)
      real(wp) :: part(3, 9), slope(2, 9)
      integer :: i, j, k

      change = 0.0_wp
      do k = 1, size(field)
         associate (f => field(k), v => field(k)%vertex)
            call change_of_field(patch_area, chi(v), corner(:, v), f, part, slope)
            do i = 1, 3
               do j = 1, 3
                  associate (row => 3*(v(i) - 1), column => 3*(v(j) - 1), by => 3*(j - 1))
                     change(row + at_height, column + 1:column + 3) = &
                        change(row + at_height, column + 1:column + 3) &
                        + chi(v(i))*part(i, by + 1:by + 3)
                     change(row + 1:row + at_eta, column + 1:column + 3) = &
                        change(row + 1:row + at_eta, column + 1:column + 3) &
                        - outer(sum(f%slope, 2)/2.0_wp, part(i, by + 1:by + 3)) &
                        - f%part(i)*slope(:, by + 1:by + 3)
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine change_of_parts

   !> How the parts of the corners of a triangle and its mean slope change with their places and
   !> heights at the end.
   pure subroutine change_of_field(patch_area, chi, corner, field, part, slope)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(3)
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      real(wp), intent(out) :: part(3, 9), slope(2, 9)
      real(wp) :: lean(2, 3), lean1(2, 3), mean(3)
      real(wp), dimension(3, 2, 3) :: swept, bare
      integer :: l, v

      call patch_moment_slopes(patch_area, corner, swept, bare)
      lean = gradients(field%share)
      lean1 = gradients(field%at_end(:, :, 1))
      mean = sum(field%moment, 2)/2.0_wp
      part = 0.0_wp
      slope = 0.0_wp
      do l = 1, 3
         associate (by => 3*(l - 1))
            part(:, by + 1:by + at_eta) = 0.5_wp*matmul(field%share, swept(:, :, l))
            do v = 1, 3
               part(:, by + 1:by + at_eta) = part(:, by + 1:by + at_eta) &
                  - (0.5_wp*mean(v)*field%share(l, v))*transpose(lean)
            end do
            slope(:, by + 1:by + at_eta) = -0.5_wp*outer(lean1(:, l), field%slope(:, 1))
            slope(:, by + at_height) = 0.5_wp*chi(l)*lean1(:, l)
         end associate
      end do
   end subroutine change_of_field

   !> Gradients of the barycentric coordinates of a triangle.
   pure function gradients(share) result(lean)
      real(wp), intent(in) :: share(3, 3)        !! (j, v) of corner j at the `unit_corner`
      real(wp) :: lean(2, 3)

      lean(1, :) = share(:, 2) - share(:, 1)
      lean(2, :) = share(:, 3) - share(:, 1)
   end function gradients

   !> The ways of the vertices, each by what it has to do with the patch: docs/theory.md, eq. (48).
   pure subroutine closing_begin(at, field, closing)
      type(frame_vertex_t), intent(in) :: at(:)  !! (n_vertex)
      type(field_t), intent(in) :: field(:)      !! the triangles, placed
      type(closing_t), intent(out) :: closing
      real(wp) :: area(size(at))
      integer :: j, k

      area = 0.0_wp
      do k = 1, size(field)
         associate (v => field(k)%vertex)
            area(v) = area(v) + sum(field(k)%bare)
         end associate
      end do
      closing%weight = area/(area + some)
      closing%weight_slope = some/(area + some)**2
      allocate(closing%way(at_eta, size(at)))
      do j = 1, size(at)
         closing%way(:, j) = at(j)%df(:at_eta)
      end do
   end subroutine closing_begin

   !> What the gradient lacks, put on the ways of the vertices.
   pure subroutine close_sum(field, closing)
      type(field_t), intent(in) :: field(:)      !! the triangles, formed
      type(closing_t), intent(inout) :: closing  !! begun
      real(wp) :: rest, square, size_of, ratio
      integer :: k

      rest = 0.0_wp
      size_of = tiny(size_of)
      do k = 1, size(field)
         associate (f => field(k))
            rest = rest + dot_product(f%moment(:, 1) - f%moment(:, 0), sum(f%value, 2)/2.0_wp)
            size_of = max(size_of, maxval(sum(abs(f%value), 2)))
         end associate
      end do
      ! By ways of round-off nothing is divided.
      square = rounding + sum(spread(closing%weight, 1, at_eta)*closing%way**2)
      ratio = (rest/(rounding*size_of))**2
      ratio = merge(ratio/(1.0_wp + ratio), 1.0_wp, ratio <= huge(ratio))
      closing%factor = ratio*rest/square
      closing%by_rest = ratio*(3.0_wp - 2.0_wp*ratio)/square
      closing%by_square = -closing%factor/square
   end subroutine close_sum

   !> Add how the closing term changes.
   pure subroutine change_of_closing(patch_area, chi, corner, field, closing, change)
      type(patch_area_t), intent(in) :: patch_area   !! what the patch is
      real(wp), intent(in) :: chi(:)             !! (n_vertex)
      real(wp), intent(in) :: corner(:, :)       !! (2, n_vertex) at the end
      type(field_t), intent(in) :: field(:)      !! the triangles, formed
      type(closing_t), intent(in) :: closing     !! of `close_sum`
      real(wp), intent(inout) :: change(:, :)    !! (3 n_vertex, 3 n_vertex)
      real(wp) :: by_rest(3, size(chi)), by_square(3, size(chi)), area(3*size(chi), size(chi))
      integer :: a, i, j, k

      by_rest = 0.0_wp
      by_square = 0.0_wp
      area = 0.0_wp
      do k = 1, size(field)
         call add_rest(patch_area, chi(field(k)%vertex), corner(:, field(k)%vertex), field(k), &
            by_rest, area)
      end do
      do j = 1, size(chi)
         associate (slope => closing%weight_slope(j)*area(:, j), way => closing%way(:, j))
            by_square(:at_eta, j) = by_square(:at_eta, j) + 2.0_wp*closing%weight(j)*way
            by_square = by_square + sum(way**2)*reshape(slope, shape(by_square))
            do a = 1, at_eta
               i = 3*(j - 1) + a
               change(i, :) = change(i, :) + closing%factor*way(a)*slope
               change(i, i) = change(i, i) + closing%factor*closing%weight(j)
            end do
         end associate
      end do
      by_rest = closing%by_rest*by_rest + closing%by_square*by_square
      do j = 1, size(chi)
         do a = 1, at_eta
            i = 3*(j - 1) + a
            change(i, :) = change(i, :) + closing%weight(j)*closing%way(a, j)*reshape(by_rest, &
               [size(by_rest)])
         end do
      end do
   end subroutine change_of_closing

   !> Add how what a triangle leaves to the rest changes, and what of the patch it covers.
   pure subroutine add_rest(patch_area, chi, corner, field, by_rest, area)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(3)
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      real(wp), intent(inout) :: by_rest(:, :)   !! (3, n_vertex)
      real(wp), intent(inout) :: area(:, :)      !! (3 n_vertex, n_vertex) of those at a vertex
      real(wp) :: part(3)
      real(wp), dimension(3, 2, 3) :: swept, bare
      integer :: i, j, v

      call patch_moment_slopes(patch_area, corner, swept, bare)
      part = 0.0_wp
      do v = 1, 3
         part = part + 0.5_wp*(field%moment(v, 1) - field%moment(v, 0))*field%at_end(:, v, 1)
      end do
      do j = 1, 3
         associate (to => by_rest(:, field%vertex(j)), at_j => 3*(field%vertex(j) - 1))
            to(:at_eta) = to(:at_eta) + matmul(sum(field%value, 2)/2.0_wp, swept(:, :, j)) &
               - part(j)*field%slope(:, 1)
            to(at_height) = to(at_height) + part(j)*chi(j)
            do i = 1, 3
               associate (of => area(at_j + 1:at_j + at_eta, field%vertex(i)))
                  of = of + sum(bare(:, :, j), 1)
               end associate
            end do
         end associate
      end do
   end subroutine add_rest

   !> a b^T.
   pure function outer(a, b)
      real(wp), intent(in) :: a(:), b(:)         !! any
      real(wp) :: outer(size(a), size(b))

      outer = spread(a, 2, size(b))*spread(b, 1, size(a))
   end function outer

end module emcon_patch_sum_space
