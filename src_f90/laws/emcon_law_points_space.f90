! build: lanes
!> Stress and tangent of constitutive laws in three dimensions, at points side by side.
!>
!> A law answers by the invariants of the strain; what these are of the strain is here, for all
!> laws: the third is cubic, and its discrete gradient that of emcon_law_space. Source:
!> docs/theory.md, eq. (10a).
module emcon_law_points_space
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_kinds, only : wp
   use emcon_law, only : law_slopes_t, law_t, n_invariant, n_lane
   use emcon_law_space, only : law_stress_space, n_strain, space_response_t
   implicit none
   private
   public :: law_points_space_t, law_respond_points_space
   public :: change_points_space_t, law_change_points_space

   !> Points side by side; components 11, 22, 33, 12, 23, 13, strains have twice the last three.
   type :: law_points_space_t
      real(wp) :: strain(n_lane, n_strain) = 0.0_wp        !! at the start
      real(wp) :: dstrain(n_lane, n_strain) = 0.0_wp
      real(wp) :: energy(n_lane) = 0.0_wp        !! W at the end [M/(L T^2)]
      real(wp) :: stress(n_lane, n_strain) = 0.0_wp        !! S_alg: S_alg.(E1 - E0) = W1 - W0
      real(wp) :: tangent(n_lane, n_strain, n_strain) = 0.0_wp   !! derivative of S_alg by E1
   end type law_points_space_t

   !> Change of volume v: `energy` is v at the end, `stress` its discrete gradient, `tangent` the
   !> derivative of that.
   type, extends(law_points_space_t) :: change_points_space_t
      real(wp) :: start(n_lane) = 0.0_wp         !! v at the start
      real(wp) :: by(n_lane) = 0.0_wp            !! its increment, to relative accuracy
      real(wp) :: at_end(n_lane, n_strain) = 0.0_wp        !! gradient at the end
   end type change_points_space_t

   !> Tensors of strain over a step, with the gradients of their invariants.
   type :: path_t
      real(wp), dimension(n_lane, n_strain) :: mean, by, last
      real(wp) :: n(n_lane, n_strain, 2:n_invariant)       !! discrete gradients of e2, e3
   end type path_t

   real(wp), parameter :: half = 0.5_wp, two = 2.0_wp

contains

   !> Response of points side by side.
   pure subroutine law_respond_points_space(law, points, with_tangent)
      class(law_t), intent(in) :: law
      type(law_points_space_t), intent(inout) :: points
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(law_slopes_t) :: w
      type(path_t) :: path

      if (allocated(law%moduli) .or. law%n_part > 0) then
         call respond_each(law, points, with_tangent)
         return
      end if
      call find_path(points%strain, points%dstrain, path, w%start, w%by)
      call law%find_slopes(w, with_tangent)
      points%energy = w%value
      call find_stress(w%slope, path%n, points%stress)
      if (with_tangent) call find_tangent(w, path, points%tangent)
   end subroutine law_respond_points_space

   !> The change of volume of points side by side, with its gradients.
   pure subroutine law_change_points_space(law, with_tangent, points)
      class(law_t), intent(in) :: law
      logical, intent(in) :: with_tangent        !! else it and `at_end` stay as they are
      type(change_points_space_t), intent(inout) :: points     !! all but the strains is set
      type(law_slopes_t) :: w
      type(path_t) :: path
      type(dg_t) :: v
      real(wp) :: slope(n_lane, n_invariant), last(n_lane, n_strain, 2:n_invariant)
      integer :: l

      call find_path(points%strain, points%dstrain, path, w%start, w%by)
      do l = 1, n_lane
         v = law%change(dg_variable(1, w%start(l, 1), w%by(l, 1)), &
            dg_variable(2, w%start(l, 2), w%by(l, 2)), dg_variable(3, w%start(l, 3), w%by(l, 3)))
         points%start(l) = v%f0
         points%by(l) = v%df
         points%energy(l) = v%f1
         w%slope(l, :) = v%g
         slope(l, :) = v%c
         w%second(l, :, :) = v%h
      end do
      call find_stress(w%slope, path%n, points%stress)
      if (.not. with_tangent) return
      call find_complement(path%last, last(:, :, 2))
      call find_cofactor(path%last, last(:, :, 3))
      call find_stress(slope, last, points%at_end)
      call find_tangent(w, path, points%tangent)
   end subroutine law_change_points_space

   !> Response of laws that are no functions of the invariants alone, one by one.
   pure subroutine respond_each(law, points, with_tangent)
      class(law_t), intent(in) :: law
      type(law_points_space_t), intent(inout) :: points
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(space_response_t) :: one
      integer :: l

      do l = 1, n_lane
         call law_stress_space(law, points%strain(l, :), points%dstrain(l, :), one, with_tangent)
         points%energy(l) = one%energy
         points%stress(l, :) = one%stress
         if (with_tangent) points%tangent(l, :, :) = one%tangent
      end do
   end subroutine respond_each

   !> The invariants at the start, their increments to relative accuracy, and their gradients.
   pure subroutine find_path(strain, dstrain, path, start, by)
      real(wp), intent(in) :: strain(n_lane, n_strain), dstrain(n_lane, n_strain)
      type(path_t), intent(out) :: path
      real(wp), intent(out) :: start(n_lane, n_invariant), by(n_lane, n_invariant)
      real(wp), dimension(n_lane, n_strain) :: first, volume, rest
      real(wp) :: part
      integer :: l, v

      do v = 1, n_strain
         part = merge(1.0_wp, half, v <= n_strain/2)
         !$omp simd
         do l = 1, n_lane
            first(l, v) = part*strain(l, v)
            path%by(l, v) = part*dstrain(l, v)
            path%mean(l, v) = first(l, v) + half*path%by(l, v)
            path%last(l, v) = first(l, v) + path%by(l, v)
         end do
      end do
      call find_cofactor(path%mean, path%n(:, :, 3))
      call find_cofactor(path%by, rest)
      path%n(:, :, 3) = path%n(:, :, 3) + rest/12.0_wp
      call find_complement(path%mean, path%n(:, :, 2))
      call find_cofactor(first, volume)
      call find_complement(first, rest)
      !$omp simd
      do l = 1, n_lane
         start(l, 1) = first(l, 1) + first(l, 2) + first(l, 3)
         by(l, 1) = path%by(l, 1) + path%by(l, 2) + path%by(l, 3)
      end do
      call find_product(rest, first, start(:, 2))
      start(:, 2) = half*start(:, 2)
      call find_product(path%n(:, :, 2), path%by, by(:, 2))
      call find_product(volume, first, start(:, 3))
      start(:, 3) = start(:, 3)/3.0_wp
      call find_product(path%n(:, :, 3), path%by, by(:, 3))
   end subroutine find_path

   !> The cofactor of symmetric tensors.
   pure subroutine find_cofactor(a, c)
      real(wp), intent(in) :: a(n_lane, n_strain)
      real(wp), intent(out) :: c(n_lane, n_strain)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         c(l, 1) = a(l, 2)*a(l, 3) - a(l, 5)*a(l, 5)
         c(l, 2) = a(l, 1)*a(l, 3) - a(l, 6)*a(l, 6)
         c(l, 3) = a(l, 1)*a(l, 2) - a(l, 4)*a(l, 4)
         c(l, 4) = a(l, 5)*a(l, 6) - a(l, 3)*a(l, 4)
         c(l, 5) = a(l, 4)*a(l, 6) - a(l, 1)*a(l, 5)
         c(l, 6) = a(l, 4)*a(l, 5) - a(l, 2)*a(l, 6)
      end do
   end subroutine find_cofactor

   !> tr(a) 1 - a
   pure subroutine find_complement(a, c)
      real(wp), intent(in) :: a(n_lane, n_strain)
      real(wp), intent(out) :: c(n_lane, n_strain)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         c(l, 1) = a(l, 2) + a(l, 3)
         c(l, 2) = a(l, 1) + a(l, 3)
         c(l, 3) = a(l, 1) + a(l, 2)
         c(l, 4) = -a(l, 4)
         c(l, 5) = -a(l, 5)
         c(l, 6) = -a(l, 6)
      end do
   end subroutine find_complement

   !> a:b of symmetric tensors.
   pure subroutine find_product(a, b, c)
      real(wp), intent(in) :: a(n_lane, n_strain), b(n_lane, n_strain)
      real(wp), intent(out) :: c(n_lane)
      integer :: l

      !$omp simd
      do l = 1, n_lane
         c(l) = (a(l, 1)*b(l, 1) + a(l, 2)*b(l, 2) + a(l, 3)*b(l, 3)) &
            + two*(a(l, 4)*b(l, 4) + a(l, 5)*b(l, 5) + a(l, 6)*b(l, 6))
      end do
   end subroutine find_product

   !> From the slopes by the invariants to those by the strain.
   pure subroutine find_stress(slope, n, stress)
      real(wp), intent(in) :: slope(n_lane, n_invariant)
      real(wp), intent(in) :: n(n_lane, n_strain, 2:n_invariant)
      real(wp), intent(out) :: stress(n_lane, n_strain)
      integer :: l, v

      do v = 1, n_strain
         !$omp simd
         do l = 1, n_lane
            stress(l, v) = slope(l, 2)*n(l, v, 2) + slope(l, 3)*n(l, v, 3)
         end do
         if (v > n_strain/2) cycle
         !$omp simd
         do l = 1, n_lane
            stress(l, v) = stress(l, v) + slope(l, 1)
         end do
      end do
   end subroutine find_stress

   !> The derivative of the stress by the strain at the end.
   pure subroutine find_tangent(w, path, tangent)
      type(law_slopes_t), intent(in) :: w
      type(path_t), intent(in) :: path
      real(wp), intent(out) :: tangent(n_lane, n_strain, n_strain)
      real(wp) :: last(n_lane, n_strain, 2:n_invariant)    ! gradients of e2, e3 at the end
      real(wp), dimension(n_lane) :: q1, q2, q3, first
      integer :: k, l, v

      call find_complement(path%last, last(:, :, 2))
      call find_cofactor(path%last, last(:, :, 3))
      do k = 1, n_strain
         first = merge(1.0_wp, 0.0_wp, k <= n_strain/2)
         !$omp simd
         do l = 1, n_lane
            q1(l) = w%second(l, 1, 1)*first(l) + w%second(l, 1, 2)*last(l, k, 2) &
               + w%second(l, 1, 3)*last(l, k, 3)
            q2(l) = w%second(l, 2, 1)*first(l) + w%second(l, 2, 2)*last(l, k, 2) &
               + w%second(l, 2, 3)*last(l, k, 3)
            q3(l) = w%second(l, 3, 1)*first(l) + w%second(l, 3, 2)*last(l, k, 2) &
               + w%second(l, 3, 3)*last(l, k, 3)
         end do
         do v = 1, n_strain
            if (v > n_strain/2) q1 = 0.0_wp
            !$omp simd
            do l = 1, n_lane
               tangent(l, v, k) = q1(l) + path%n(l, v, 2)*q2(l) + path%n(l, v, 3)*q3(l)
            end do
         end do
      end do
      call add_curvature(half*w%slope(:, 2), w%slope(:, 3), path, tangent)
   end subroutine find_tangent

   !> Add the second derivatives of e2 and e3, times the slopes by these: of e3 it is a x d, with a
   !> half of the mean strain and a twelfth of its increment.
   pure subroutine add_curvature(slope2, slope3, path, tangent)
      real(wp), intent(in) :: slope2(n_lane)     !! half of the slope by e2
      real(wp), intent(in) :: slope3(n_lane)
      type(path_t), intent(in) :: path
      real(wp), intent(inout) :: tangent(n_lane, n_strain, n_strain)
      real(wp) :: a(n_lane, n_strain)
      integer :: l, v

      do v = 1, n_strain
         a(:, v) = slope3*(half*path%mean(:, v) + path%by(:, v)/12.0_wp)
      end do
      !$omp simd
      do l = 1, n_lane
         tangent(l, 2, 1) = tangent(l, 2, 1) + (slope2(l) + a(l, 3))
         tangent(l, 3, 1) = tangent(l, 3, 1) + (slope2(l) + a(l, 2))
         tangent(l, 5, 1) = tangent(l, 5, 1) - a(l, 5)
         tangent(l, 1, 2) = tangent(l, 1, 2) + (slope2(l) + a(l, 3))
         tangent(l, 3, 2) = tangent(l, 3, 2) + (slope2(l) + a(l, 1))
         tangent(l, 6, 2) = tangent(l, 6, 2) - a(l, 6)
         tangent(l, 1, 3) = tangent(l, 1, 3) + (slope2(l) + a(l, 2))
         tangent(l, 2, 3) = tangent(l, 2, 3) + (slope2(l) + a(l, 1))
         tangent(l, 4, 3) = tangent(l, 4, 3) - a(l, 4)
         tangent(l, 3, 4) = tangent(l, 3, 4) - a(l, 4)
         tangent(l, 4, 4) = tangent(l, 4, 4) - half*(slope2(l) + a(l, 3))
         tangent(l, 5, 4) = tangent(l, 5, 4) + half*a(l, 6)
         tangent(l, 6, 4) = tangent(l, 6, 4) + half*a(l, 5)
         tangent(l, 1, 5) = tangent(l, 1, 5) - a(l, 5)
         tangent(l, 4, 5) = tangent(l, 4, 5) + half*a(l, 6)
         tangent(l, 5, 5) = tangent(l, 5, 5) - half*(slope2(l) + a(l, 1))
         tangent(l, 6, 5) = tangent(l, 6, 5) + half*a(l, 4)
         tangent(l, 2, 6) = tangent(l, 2, 6) - a(l, 6)
         tangent(l, 4, 6) = tangent(l, 4, 6) + half*a(l, 5)
         tangent(l, 5, 6) = tangent(l, 5, 6) + half*a(l, 4)
         tangent(l, 6, 6) = tangent(l, 6, 6) - half*(slope2(l) + a(l, 2))
      end do
   end subroutine add_curvature

end module emcon_law_points_space
