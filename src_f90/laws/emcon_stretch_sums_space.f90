!> Sums over the principal stretches, with their discrete gradients by the strain.
!>
!> t = sum of F(x_i) over the principal values of E, F(x) = c^k - 1 - k ln c with c = 1 + 2 x, of
!> second order at small strains. Axes at the start meet those at the end, each pair with the
!> divided difference of F: nothing is divided by differences of axes, and equal values are no case
!> of their own. Source: docs/theory.md, eqs. (10c) and (10d).
module emcon_stretch_sums_space
   use emcon_dgrad_series, only : atanh_excess, exp_excess, expm1_of, log1p_of, sinh_excess
   use emcon_kinds, only : wp
   implicit none
   private
   public :: n_strain, row, column, principal_t, principal_of, stretch_path_t, stretch_path
   public :: stretch_sum_t, stretch_sum, stretch_add_tangent

   integer, parameter :: n_strain = 6, n = 3
   !> Rows and columns of the components of a tensor.
   integer, parameter :: row(n_strain) = [1, 2, 3, 1, 2, 1], column(n_strain) = [1, 2, 3, 2, 3, 3]

   !> A strain by its principal values.
   type :: principal_t
      real(wp) :: value(n) = 0.0_wp              !! x, > -1/2
      real(wp) :: logarithm(n) = 0.0_wp          !! ln(1 + 2 x)
      real(wp) :: axis(n, n) = 0.0_wp            !! unit vectors, by columns
   end type principal_t

   type :: stretch_path_t
      type(principal_t) :: start, last
      real(wp) :: cosine(n, n) = 0.0_wp          !! of axis i at the start with axis j at the end
   end type stretch_path_t

   type :: stretch_sum_t
      real(wp) :: start = 0.0_wp                 !! t at the start
      real(wp) :: last = 0.0_wp                  !! t at the end
      real(wp) :: gradient(n_strain) = 0.0_wp    !! discrete gradient by E, of tensors
      real(wp) :: at_end(n_strain) = 0.0_wp      !! gradient at the end
   end type stretch_sum_t

   !> Where c is this near to the mean of three of them, relative to it, second divided differences
   !> are summed as a power series; beyond it they lose a factor of 8 at most.
   real(wp), parameter :: near = 0.125_wp

contains

   !> The principal values and axes over a step.
   pure subroutine stretch_path(first, last, path)
      real(wp), intent(in) :: first(n_strain), last(n_strain)   !! E11, E22, E33, E12, E23, E13
      type(stretch_path_t), intent(out) :: path

      path%start = principal_of(first)
      path%last = principal_of(last)
      path%cosine = matmul(transpose(path%start%axis), path%last%axis)
   end subroutine stretch_path

   !> By Jacobi's rotations, until what is left beside the diagonal is the square of round-off.
   pure function principal_of(strain) result(found)
      real(wp), intent(in) :: strain(n_strain)   !! E11, E22, E33, E12, E23, E13
      type(principal_t) :: found
      integer, parameter :: most = 20            ! sweeps; each squares what is left
      real(wp) :: a(n, n), least
      integer :: i, sweep

      a = tensor_of(strain)
      do i = 1, n
         found%axis(i, i) = 1.0_wp
      end do
      least = epsilon(1.0_wp)**2*maxval(abs(a))
      do sweep = 1, most
         if (max(abs(a(1, 2)), abs(a(2, 3)), abs(a(1, 3))) <= least) exit
         do i = n + 1, n_strain
            if (abs(a(row(i), column(i))) > least) call turn_plane(row(i), column(i), a, found%axis)
         end do
      end do
      do i = 1, n
         found%value(i) = a(i, i)
      end do
      found%logarithm = log1p_of(2.0_wp*found%value)
   end function principal_of

   !> Turn the axes `p` and `q` so that a(p, q) vanishes, which is not 0 before.
   pure subroutine turn_plane(p, q, a, axis)
      integer, intent(in) :: p, q
      real(wp), intent(inout) :: a(n, n), axis(n, n)
      real(wp) :: apart, tangent, cosine, sine, old(n)

      apart = (a(q, q) - a(p, p))/(2.0_wp*a(p, q))
      tangent = sign(1.0_wp, apart)/(abs(apart) + sqrt(1.0_wp + apart*apart))
      cosine = 1.0_wp/sqrt(1.0_wp + tangent*tangent)
      sine = tangent*cosine
      old = a(:, p)
      a(:, p) = cosine*old - sine*a(:, q)
      a(:, q) = sine*old + cosine*a(:, q)
      old = a(p, :)
      a(p, :) = cosine*old - sine*a(q, :)
      a(q, :) = sine*old + cosine*a(q, :)
      a(p, q) = 0.0_wp
      a(q, p) = 0.0_wp
      old = axis(:, p)
      axis(:, p) = cosine*old - sine*axis(:, q)
      axis(:, q) = sine*old + cosine*axis(:, q)
   end subroutine turn_plane

   !> t over the step.
   pure subroutine stretch_sum(path, k, total)
      type(stretch_path_t), intent(in) :: path
      real(wp), intent(in) :: k                  !! power of c, not 0
      type(stretch_sum_t), intent(out) :: total
      real(wp) :: by(n, n), last(n, n), f
      integer :: i, j, m

      by = 0.0_wp
      last = 0.0_wp
      associate (x => path%start, z => path%last)
         total%start = sum(exp_excess(k*x%logarithm))
         total%last = sum(exp_excess(k*z%logarithm))
         do j = 1, n
            do i = 1, n
               f = path%cosine(i, j)*chord(k, x%value(i), z%value(j), x%logarithm(i), &
                  z%logarithm(j))
               do m = 1, n
                  by(:, m) = by(:, m) + (f*z%axis(m, j))*x%axis(:, i)
               end do
            end do
            f = 2.0_wp*k*expm1_of(k*z%logarithm(j))/(1.0_wp + 2.0_wp*z%value(j))
            do m = 1, n
               last(:, m) = last(:, m) + (f*z%axis(m, j))*z%axis(:, j)
            end do
         end do
      end associate
      total%gradient = components_of(by)
      total%at_end = components_of(last)
   end subroutine stretch_sum

   !> Add `factor` times the derivative of the discrete gradient by the strain at the end.
   pure subroutine stretch_add_tangent(path, k, factor, tangent)
      type(stretch_path_t), intent(in) :: path
      real(wp), intent(in) :: k                  !! power of c, not 0
      real(wp), intent(in) :: factor             !! derivative of W by t [M/(L T^2)]
      real(wp), intent(inout) :: tangent(n_strain, n_strain)   !! by E11, .., 2 E12, ..
      real(wp) :: pull(n, n, n), direction(n_strain), d(n, n), m(n, n), f
      integer :: i, j, l

      pull = 0.0_wp
      associate (x => path%start, z => path%last, axis => path%last%axis)
         do l = 1, n
            do j = 1, l
               do i = 1, n
                  f = factor*second(k, [x%value(i), z%value(j), z%value(l)], &
                     [x%logarithm(i), z%logarithm(j), z%logarithm(l)])
                  pull(:, j, l) = pull(:, j, l) + (f*path%cosine(i, j))*path%cosine(i, :)
                  if (j < l) pull(:, l, j) = pull(:, l, j) + (f*path%cosine(i, l))*path%cosine(i, :)
               end do
            end do
         end do
         do i = 1, n_strain
            direction = 0.0_wp
            direction(i) = merge(1.0_wp, 0.5_wp, i <= n)
            d = matmul(transpose(axis), matmul(tensor_of(direction), axis))
            do l = 1, n
               m(:, l) = matmul(pull(:, :, l), d(:, l))
            end do
            tangent(:, i) = tangent(:, i) &
               + components_of(matmul(axis, matmul(m, transpose(axis))))
         end do
      end associate
   end subroutine stretch_add_tangent

   !> Divided difference of F between x and y: with the logarithms u and v of c it is
   !> (exp(k v) - exp(k u) - k (v - u))/(y - x).
   pure real(wp) function chord(k, x, y, u, v)
      real(wp), intent(in) :: k, x, y, u, v
      real(wp) :: both, excess, rate, by_x, above

      both = (1.0_wp + 2.0_wp*x) + (1.0_wp + 2.0_wp*y)
      call atanh_excess(2.0_wp*(y - x)/both, excess, rate)
      by_x = 4.0_wp*(1.0_wp + excess)/both       ! (v - u)/(y - x)
      above = sinh_excess(0.5_wp*k*by_x*(y - x))
      chord = k*by_x*(expm1_of(0.5_wp*k*(u + v))*(1.0_wp + above) + above)
   end function chord

   !> Second divided difference of F over three places: of those near to each other the power series
   !> about their mean, whose terms have the complete symmetric polynomials.
   pure real(wp) function second(k, x, u)
      real(wp), intent(in) :: k
      real(wp), intent(in) :: x(n), u(n)         !! values and their logarithms
      real(wp) :: mean, off(n)
      integer :: low, high, middle

      mean = 1.0_wp + 2.0_wp*sum(x)/3.0_wp
      off = 2.0_wp*(x - sum(x)/3.0_wp)/mean
      if (maxval(abs(off)) <= near) then
         second = 4.0_wp/mean**2*series(k, mean**k, off)
         return
      end if
      low = minloc(x, 1)
      high = maxloc(x, 1)
      middle = 6 - low - high
      second = (chord(k, x(middle), x(high), u(middle), u(high)) &
         - chord(k, x(low), x(middle), u(low), u(middle)))/(x(high) - x(low))
   end function second

   !> Second divided difference of power (1 + s)^k - k ln(1 + s) over three places of sum 0.
   pure real(wp) function series(k, power, off)
      real(wp), intent(in) :: k, power
      real(wp), intent(in) :: off(n)             !! at most `near`
      integer, parameter :: most = 80
      real(wp) :: pair, all_three, h(0:2), next, binomial, size, term
      integer :: i

      pair = off(1)*off(2) + off(2)*off(3) + off(1)*off(3)
      all_three = product(off)
      h = [1.0_wp, 0.0_wp, -pair]                ! symmetric polynomials of order i - 2, ..
      binomial = power*0.5_wp*k*(k - 1.0_wp)
      size = 1.0_wp
      series = 0.0_wp
      do i = 2, most
         term = binomial + sign_of(i)*k/real(i, wp)
         series = series + term*h(0)
         binomial = binomial*(k - real(i, wp))/real(i + 1, wp)
         size = size*maxval(abs(off))
         if (real(i*i, wp)*size*(abs(binomial) + abs(k)) <= 0.01_wp*epsilon(k)*abs(series)) exit
         next = all_three*h(0) - pair*h(1)
         h = [h(1), h(2), next]
      end do
   end function series

   !> (-1)^i
   pure real(wp) function sign_of(i)
      integer, intent(in) :: i

      sign_of = merge(1.0_wp, -1.0_wp, mod(i, 2) == 0)
   end function sign_of

   pure function tensor_of(a) result(t)
      real(wp), intent(in) :: a(n_strain)
      real(wp) :: t(n, n)
      integer :: i

      do i = 1, n_strain
         t(row(i), column(i)) = a(i)
         t(column(i), row(i)) = a(i)
      end do
   end function tensor_of

   !> Of the symmetric part.
   pure function components_of(t) result(a)
      real(wp), intent(in) :: t(n, n)
      real(wp) :: a(n_strain)
      integer :: i

      do i = 1, n_strain
         a(i) = 0.5_wp*(t(row(i), column(i)) + t(column(i), row(i)))
      end do
   end function components_of

end module emcon_stretch_sums_space
