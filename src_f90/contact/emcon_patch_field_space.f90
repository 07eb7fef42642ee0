! build: elements
!> The field of one triangle over a patch in a step, in two kinds: of heights, and of 1. Where the
!> surface ends both fall to 0. Source: docs/theory.md, eqs. (45) and (46).
module emcon_patch_field_space
   use emcon_frame_vertex_space, only : at_eta, at_height
   use emcon_kinds, only : wp
   use emcon_patch_look_space, only : unit_corner
   use emcon_patch_moments_space, only : patch_area_t, patch_moment_slopes
   use emcon_polygon_clip_space, only : barycentric
   implicit none
   private
   public :: field_t, place_field, formed_t, form_field, field_slopes_t, field_slopes

   integer, parameter, public :: of_height = 1, of_one = 2

   !> One triangle over a step.
   type :: field_t
      integer :: vertex(3) = 0                   !! among those that count
      !> (weight, place, end) over the part of the patch that it covers, of the function that is 1
      !> at the `unit_corner`
      real(wp) :: moment(3, 3, 0:1) = 0.0_wp
      real(wp) :: share(3, 3) = 0.0_wp           !! (j, v) of its corner j at v, in the mean
      real(wp) :: at_end(3, 3, 0:1) = 0.0_wp     !! the same at the start and at the end
   end type field_t

   !> What heights make of it: of a height [L], else of 1.
   type :: formed_t
      real(wp) :: value(3, of_height:of_one, 0:1)    !! at the `unit_corner`
      real(wp) :: slope(2, of_height:of_one, 0:1)
      real(wp) :: part(3, 3)                     !! (j, weight) of the integral that corner j takes
      real(wp) :: end_part(3, 3)                 !! the same at the end
   end type formed_t

   !> How parts and slopes change with the coordinates of corner l at the end, and with its height.
   type :: field_slopes_t
      real(wp) :: moment(3, 2, 3, 3)             !! (v, coordinate, l, weight)
      real(wp) :: part(3, 3, 3, 3)               !! (j, coordinate or height, l, weight)
      real(wp) :: slope(2, 3, 3, of_height:of_one)   !! (., coordinate or height, l, kind)
      real(wp) :: rest(3, 3)                     !! (l, weight) of what moments gain, at corner l
   end type field_slopes_t

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
   pure subroutine form_field(n_weight, chi, height, field, formed)
      integer, intent(in) :: n_weight            !! of the patch
      real(wp), intent(in) :: chi(3)             !! at its corners
      real(wp), intent(in) :: height(3, 0:1)     !! of its corners [L]
      type(field_t), intent(in) :: field         !! with its moments, placed
      type(formed_t), intent(out) :: formed
      real(wp) :: mean(3)
      integer :: end, v, w

      do end = 0, 1
         do v = 1, 3
            associate (share => chi*field%at_end(:, v, end))
               formed%value(v, of_height, end) = dot_product(share, height(:, end))
               formed%value(v, of_one, end) = sum(share)
            end associate
         end do
         formed%slope(1, :, end) = formed%value(2, :, end) - formed%value(1, :, end)
         formed%slope(2, :, end) = formed%value(3, :, end) - formed%value(1, :, end)
      end do
      do w = 1, n_weight
         mean = 0.5_wp*(field%moment(w, :, 0) + field%moment(w, :, 1))
         formed%part(:, w) = matmul(field%share, mean)
         formed%end_part(:, w) = matmul(field%at_end(:, :, 1), field%moment(w, :, 1))
      end do
   end subroutine form_field

   !> How the parts of the corners of a triangle and its mean slopes change with their places and
   !> heights at the end.
   pure subroutine field_slopes(area, chi, corner, field, formed, slopes)
      type(patch_area_t), intent(in) :: area     !! what the patch is
      real(wp), intent(in) :: chi(3)             !! at its corners
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      type(formed_t), intent(in) :: formed
      type(field_slopes_t), intent(out) :: slopes
      real(wp) :: lean(2, 3), lean1(2, 3)
      integer :: a, kind, l, w

      call patch_moment_slopes(area, corner, slopes%moment(:, :, :, :area%n_weight))
      lean = gradients(field%share)
      lean1 = gradients(field%at_end(:, :, 1))
      do w = 1, area%n_weight
         do l = 1, 3
            do a = 1, at_eta
               slopes%part(:, a, l, w) = 0.5_wp*(matmul(field%share, slopes%moment(:, a, l, w)) &
                  - formed%part(l, w)*lean(a, :))
            end do
            slopes%part(:, at_height, l, w) = 0.0_wp
         end do
         slopes%rest(:, w) = 0.5_wp*matmul(field%at_end(:, :, 1), field%moment(w, :, 1) &
            - field%moment(w, :, 0))
      end do
      do kind = of_height, of_one
         do l = 1, 3
            do a = 1, at_eta
               slopes%slope(:, a, l, kind) = -0.5_wp*formed%slope(a, kind, 1)*lean1(:, l)
            end do
            slopes%slope(:, at_height, l, kind) = merge(0.5_wp*chi(l), 0.0_wp, &
               kind == of_height)*lean1(:, l)
         end do
      end do
   end subroutine field_slopes

   !> Gradients of the barycentric coordinates of a triangle.
   pure function gradients(share) result(lean)
      real(wp), intent(in) :: share(3, 3)        !! (j, v) of corner j at the `unit_corner`
      real(wp) :: lean(2, 3)

      lean(1, :) = share(:, 2) - share(:, 1)
      lean(2, :) = share(:, 3) - share(:, 1)
   end function gradients

end module emcon_patch_field_space
