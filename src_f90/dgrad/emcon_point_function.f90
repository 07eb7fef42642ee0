!> Functions of a few variables given at points from outside, and the discrete gradient made for
!> them.
!>
!> What is known of such a function W are values, gradients and second derivatives. With the mean
!> of its gradient over the step, by Gauss's rule of three points, and A = diag(weight)
!>
!>    g = sum_i w_i grad W(z0 + s_i dz) + alpha A dz,  alpha = (W1 - W0 - mean.dz)/(dz.A dz)
!>
!> is a discrete gradient: g.dz = W1 - W0. Source: docs/theory.md, section 2.
module emcon_point_function
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_kinds, only : wp
   implicit none
   private
   public :: point_function_t, point_response_t, point_gradient
   public :: point_ok, point_outside, point_failed

   !> How an evaluation ended. Outside: a state that the function has no value for, as an inverted
   !> element has none; smaller steps may avoid it. Failed: there is no use in going on.
   integer, parameter :: point_ok = 0, point_outside = 1, point_failed = 2

   type, abstract :: point_function_t
      integer :: n_variable = 0                  !! m
      real(wp), allocatable :: weight(:)         !! (m) > 0, the metric A; not allocated: ones
   contains
      procedure(evaluate_interface), deferred :: evaluate
   end type point_function_t

   abstract interface
      !> Value, gradient and second derivatives of W at n points.
      subroutine evaluate_interface(self, z, wants_hessian, value, gradient, hessian, status)
         import :: point_function_t, wp
         class(point_function_t), intent(in) :: self
         real(wp), intent(in), contiguous :: z(:, :)               !! (m, n)
         logical, intent(in) :: wants_hessian                      !! else leave `hessian` alone
         real(wp), intent(inout), contiguous :: value(:)           !! (n)
         real(wp), intent(inout), contiguous :: gradient(:, :)     !! (m, n)
         real(wp), intent(inout), contiguous :: hessian(:, :, :)   !! (m, m, n)
         integer, intent(out) :: status                            !! one of the `point_` codes
      end subroutine evaluate_interface
   end interface

   !> Discrete gradients at n points, and the work space for them; it grows as needed and is kept.
   type :: point_response_t
      real(wp), allocatable :: energy(:)         !! (>= n) W at the end
      real(wp), allocatable :: gradient(:, :)    !! (m, >= n) g
      real(wp), allocatable :: tangent(:, :, :)  !! (m, m, >= n) derivative of g by the end
      ! stacks of all starts, all ends, all first, second and third points between:
      real(wp), allocatable, private :: z(:, :), w(:), dw(:, :)   !! (m, 5 n), (5 n), (m, 5 n)
      real(wp), allocatable, private :: ddw(:, :, :)              !! (m, m, 3 n) between
   end type point_response_t

   !> Gauss's rule on 0..1: points 1/2 - apart, 1/2, 1/2 + apart; weight of the outer ones.
   real(wp), parameter :: apart = sqrt(0.15_wp), outer = 5.0_wp/18.0_wp
   !> Fourth divided difference over start, points and end: factors of ends, outer points, middle.
   real(wp), parameter :: of_end = 20.0_wp, of_outer = -100.0_wp/3.0_wp, of_middle = 80.0_wp/3.0_wp
   !> The rule misses 1/2800 of a sixth power (of the distance from the middle), whose fourth
   !> difference is 2/5.
   real(wp), parameter :: missed = 1.0_wp/1120.0_wp
   !> A defect below this multiple of its terms is round-off: of two values, a mean of three
   !> gradients, a product with the step, and the rounding of the end.
   real(wp), parameter :: noise = 8.0_wp*epsilon(1.0_wp)
   !> One that is so much larger than the rule can miss is not its own: it is round-off of terms
   !> that have cancelled in the function, and would spoil small steps.
   real(wp), parameter :: credible = 1.0e4_wp

contains

   !> Discrete gradients of `given` for steps from `z0` by `dz`; without any step they are
   !> gradients, and the tangent is half the second derivative.
   subroutine point_gradient(given, z0, dz, wants_tangent, response, status)
      class(point_function_t), intent(in) :: given
      real(wp), intent(in), contiguous :: z0(:, :), dz(:, :)     !! (m, n)
      logical, intent(in) :: wants_tangent
      type(point_response_t), intent(inout) :: response
      integer, intent(out) :: status                             !! one of the `point_` codes
      integer :: k, m, n

      m = given%n_variable
      n = size(z0, 2)
      call make_room(response, m, n)
      status = point_ok
      if (n == 0) return
      if (.not. any(abs(dz) > 0.0_wp)) then
         call evaluate_at_rest(given, z0, wants_tangent, response, status)
         return
      end if
      response%z(:, :n) = z0
      response%z(:, n + 1:2*n) = z0 + dz
      response%z(:, 2*n + 1:3*n) = z0 + (0.5_wp - apart)*dz
      response%z(:, 3*n + 1:4*n) = z0 + 0.5_wp*dz
      response%z(:, 4*n + 1:5*n) = z0 + (0.5_wp + apart)*dz
      call given%evaluate(response%z(:, :2*n), .false., response%w(:2*n), response%dw(:, :2*n), &
         response%ddw(:, :, :0), status)
      if (status == point_ok) call given%evaluate(response%z(:, 2*n + 1:5*n), wants_tangent, &
         response%w(2*n + 1:5*n), response%dw(:, 2*n + 1:5*n), response%ddw(:, :, :3*n), status)
      if (status == point_ok) status = finite_status(wants_tangent, response%w(:2*n), &
         response%dw(:, :5*n), response%ddw(:, :, :3*n))
      if (status /= point_ok) return
      do k = 1, n
         call combine(given, dz(:, k), n, k, wants_tangent, response)
      end do
   end subroutine point_gradient

   !> Room for `n` points of `m` variables; stays as it is if there is enough.
   pure subroutine make_room(response, m, n)
      type(point_response_t), intent(inout) :: response
      integer, intent(in) :: m, n

      if (allocated(response%energy)) then
         if (size(response%gradient, 1) == m .and. size(response%energy) >= n) return
         deallocate(response%energy, response%gradient, response%tangent)
         deallocate(response%z, response%w, response%dw, response%ddw)
      end if
      allocate(response%energy(n), response%gradient(m, n), response%tangent(m, m, n), &
         source=0.0_wp)
      allocate(response%z(m, 5*n), response%w(5*n), response%dw(m, 5*n), response%ddw(m, m, 3*n), &
         source=0.0_wp)
   end subroutine make_room

   !> Gradients and half the second derivatives at `z`.
   subroutine evaluate_at_rest(given, z, wants_tangent, response, status)
      class(point_function_t), intent(in) :: given
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_tangent
      type(point_response_t), intent(inout) :: response
      integer, intent(out) :: status
      integer :: n

      n = size(z, 2)
      call given%evaluate(z, wants_tangent, response%energy(:n), response%gradient(:, :n), &
         response%tangent(:, :, :n), status)
      if (status == point_ok) status = finite_status(wants_tangent, response%energy(:n), &
         response%gradient(:, :n), response%tangent(:, :, :n))
      if (status == point_ok .and. wants_tangent) then
        response%tangent(:, :, :n) = 0.5_wp*response%tangent(:, :, :n)
      end if
   end subroutine evaluate_at_rest

   !> What is not finite is no value.
   pure integer function finite_status(has_hessian, w, dw, ddw)
      logical, intent(in) :: has_hessian
      real(wp), intent(in) :: w(:), dw(:, :), ddw(:, :, :)

      finite_status = point_ok
      if (.not. (all(ieee_is_finite(w)) .and. all(ieee_is_finite(dw)))) then
         finite_status = point_outside
      else if (has_hessian) then
         if (.not. all(ieee_is_finite(ddw))) finite_status = point_outside
      end if
   end function finite_status

   !> The discrete gradient of point `k` of `n` from what is known along its step. Equal gradients
   !> have exactly their mean.
   pure subroutine combine(given, dz, n, k, wants_tangent, response)
      class(point_function_t), intent(in) :: given
      real(wp), intent(in) :: dz(:)
      integer, intent(in) :: n, k
      logical, intent(in) :: wants_tangent
      type(point_response_t), intent(inout) :: response
      real(wp) :: terms, defect, fourth

      associate (w0 => response%w(k), w1 => response%w(n + k), &
            z0 => response%z(:, k), z1 => response%z(:, n + k), &
            dw0 => response%dw(:, k), dw1 => response%dw(:, n + k), &
            dwa => response%dw(:, 2*n + k), dwb => response%dw(:, 3*n + k), &
            dwc => response%dw(:, 4*n + k), g => response%gradient(:, k))
         response%energy(k) = w1
         g = dwb + outer*((dwa - dwb) + (dwc - dwb))
         if (wants_tangent) call mean_tangent(response%ddw(:, :, k), response%ddw(:, :, n + k), &
            response%ddw(:, :, 2*n + k), response%tangent(:, :, k))
         terms = abs(w0) + abs(w1) + dot_product(abs(g), abs(z0) + abs(z1))
         defect = (w1 - w0) - dot_product(g, dz)
         fourth = dot_product(of_end*(dw0 + dw1) + of_outer*(dwa + dwc) + of_middle*dwb, dz)
         if (abs(defect) <= noise*terms .or. missed*abs(fourth) <= noise*terms) return
         if (abs(defect) > credible*missed*abs(fourth)) return
         call correct(given, dz, defect, dw1, wants_tangent, g, response%tangent(:, :, k))
      end associate
   end subroutine combine

   !> sum_i w_i s_i H_i
   pure subroutine mean_tangent(first, middle, last, tangent)
      real(wp), intent(in) :: first(:, :), middle(:, :), last(:, :)
      real(wp), intent(inout) :: tangent(:, :)

      tangent = 0.5_wp*(middle + outer*((first - middle) + (last - middle))) &
         + (outer*apart)*(last - first)
   end subroutine mean_tangent

   !> Add alpha A dz to the mean gradient, and to the tangent what follows from it.
   pure subroutine correct(given, dz, defect, dw1, wants_tangent, g, tangent)
      class(point_function_t), intent(in) :: given
      real(wp), intent(in) :: dz(:), defect, dw1(:)
      logical, intent(in) :: wants_tangent
      real(wp), intent(inout) :: g(:), tangent(:, :)
      real(wp) :: weight(size(dz)), change(size(dz)), square, alpha
      integer :: j

      weight = 1.0_wp
      if (allocated(given%weight)) weight = given%weight
      square = sum(weight*dz**2)
      alpha = defect/square
      if (wants_tangent) then
         change = ((dw1 - g) - matmul(dz, tangent) - 2.0_wp*alpha*weight*dz)/square
         do j = 1, size(dz)
            tangent(:, j) = tangent(:, j) + change(j)*(weight*dz)
            tangent(j, j) = tangent(j, j) + alpha*weight(j)
         end do
      end if
      g = g + alpha*weight*dz
   end subroutine correct

end module emcon_point_function
