!> Stress and tangent of constitutive laws in three dimensions.
!>
!> The third invariant is cubic in the strain: its discrete gradient over a step is the cofactor of
!> the mean strain and a twelfth of that of the increment, exact and isotropic. Source:
!> docs/theory.md, eq. (10a).
module emcon_law_space
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, max_part
   use emcon_stretch_sums_space, only : n_strain, stretch_add_tangent, stretch_path, &
      stretch_path_t, stretch_sum, stretch_sum_t
   implicit none
   private
   public :: n_strain, space_response_t, law_response_space, law_stress_space, space_change_t, &
      law_change_space

   integer, parameter :: n_shear = 3
   !> Components 11, 22, 33, 12, 23, 13; a strain has twice the last three.
   real(wp), parameter :: entry_of(n_strain) = [1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 0.5_wp]
   real(wp), parameter :: unit(n_strain) = [1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
   !> J^2 - 1 by e1, e2, e3: eq. (7).
   real(wp), parameter :: of_volume(3) = [2.0_wp, 4.0_wp, 8.0_wp]

   type :: space_response_t
      real(wp) :: energy = 0.0_wp                !! W at the end [M/(L T^2)]
      real(wp) :: stress(n_strain) = 0.0_wp      !! S_alg: S_alg.(E1 - E0) = W1 - W0
      real(wp) :: tangent(n_strain, n_strain) = 0.0_wp   !! derivative of S_alg by E1
   end type space_response_t

   !> Change of volume v: `energy` is v at the end, `stress` its discrete gradient.
   type, extends(space_response_t) :: space_change_t
      real(wp) :: start = 0.0_wp                 !! v at the start
      real(wp) :: by = 0.0_wp                    !! its increment, to relative accuracy
      real(wp) :: at_end(n_strain) = 0.0_wp      !! gradient at the end
   end type space_change_t

   !> Strains and invariants over a step; shears are those of tensors.
   type :: path_t
      real(wp) :: mean(n_strain) = 0.0_wp        !! strain in the middle
      real(wp) :: by(n_strain) = 0.0_wp          !! its increment
      real(wp) :: first(n_strain) = 0.0_wp       !! strain at the start
      real(wp) :: last(n_strain) = 0.0_wp        !! strain at the end
      type(dg_t) :: e1, e2, e3
      real(wp) :: n(n_strain, 3) = 0.0_wp        !! discrete gradients of e1, e2, e3
      real(wp) :: at_end(n_strain, 3) = 0.0_wp   !! gradients at the end
   end type path_t

contains

   !> Response to a strain that goes from `strain` to `strain + dstrain`.
   pure subroutine law_response_space(law, strain, dstrain, response)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(n_strain), dstrain(n_strain)   !! E11, E22, E33, 2 E12, ...
      type(space_response_t), intent(out) :: response

      call law_stress_space(law, strain, dstrain, response, .true.)
   end subroutine law_response_space

   !> The same without the tangent, unless it is asked for.
   pure subroutine law_stress_space(law, strain, dstrain, response, with_tangent)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(n_strain), dstrain(n_strain)   !! E11, E22, E33, 2 E12, ...
      type(space_response_t), intent(out) :: response
      logical, intent(in) :: with_tangent        !! else the tangent is 0
      type(path_t) :: path
      type(dg_t) :: w

      if (allocated(law%moduli)) then
         response%stress = matmul(law%moduli, strain + 0.5_wp*dstrain)
         response%energy = 0.5_wp*dot_product(strain + dstrain, matmul(law%moduli, strain &
            + dstrain))
         if (with_tangent) response%tangent = 0.5_wp*law%moduli
         return
      end if
      call find_path(strain, dstrain, path)
      if (law%n_part > 0) then
         call add_parts(law, path, response, with_tangent)
         return
      end if
      w = law%energy(path%e1, path%e2, path%e3)
      call chain(path, w, response)
      if (with_tangent) call add_tangent(path, w, response)
   end subroutine law_stress_space

   !> Change of volume over the same step, with its gradients.
   pure subroutine law_change_space(law, strain, dstrain, change)
      class(law_t), intent(in) :: law
      real(wp), intent(in) :: strain(n_strain), dstrain(n_strain)   !! E11, E22, E33, 2 E12, ...
      type(space_change_t), intent(out) :: change
      type(path_t) :: path
      type(dg_t) :: v

      call find_path(strain, dstrain, path)
      v = law%change(path%e1, path%e2, path%e3)
      change%start = v%f0
      change%by = v%df
      call chain(path, v, change%space_response_t)
      call add_tangent(path, v, change%space_response_t)
      change%at_end = matmul(path%at_end, v%c)
   end subroutine law_change_space

   !> The invariants over a step, and their gradients.
   pure subroutine find_path(strain, dstrain, path)
      real(wp), intent(in) :: strain(n_strain), dstrain(n_strain)   !! E11, E22, E33, 2 E12, ...
      type(path_t), intent(out) :: path

      path%first = entry_of*strain
      path%by = entry_of*dstrain
      path%mean = path%first + 0.5_wp*path%by
      path%last = path%first + path%by
      associate (n => path%n, at_end => path%at_end, mean => path%mean, d => path%by, &
            e0 => path%first, last => path%last)
         n(:, 1) = unit
         n(:, 2) = trace(mean)*unit - mean
         n(:, 3) = 0.5_wp*cross(mean, mean) + cross(d, d)/24.0_wp
         at_end(:, 1) = unit
         at_end(:, 2) = trace(last)*unit - last
         at_end(:, 3) = 0.5_wp*cross(last, last)
         path%e1 = dg_variable(1, trace(e0), trace(d))
         path%e2 = dg_variable(2, 0.5_wp*product_of(trace(e0)*unit - e0, e0), &
            product_of(n(:, 2), d))
         path%e3 = dg_variable(3, product_of(cross(e0, e0), e0)/6.0_wp, product_of(n(:, 3), d))
      end associate
   end subroutine find_path

   !> From a function of the invariants to one of the strain.
   pure subroutine chain(path, w, response)
      type(path_t), intent(in) :: path
      type(dg_t), intent(in) :: w                !! of e1, e2, e3
      type(space_response_t), intent(inout) :: response

      response%energy = w%f1
      response%stress = matmul(path%n, w%g)
   end subroutine chain

   !> Its second derivatives.
   pure subroutine add_tangent(path, w, response)
      type(path_t), intent(in) :: path
      type(dg_t), intent(in) :: w                !! of e1, e2, e3
      type(space_response_t), intent(inout) :: response
      real(wp) :: d(n_strain), curved(n_strain)
      integer :: i, j, k

      do j = 1, size(w%g)
         do i = 1, size(w%g)
            do k = 1, n_strain
               response%tangent(:, k) = response%tangent(:, k) &
                  + w%h(i, j)*(path%n(:, i)*path%at_end(k, j))
            end do
         end do
      end do
      curved = 0.5_wp*path%mean + path%by/12.0_wp
      do j = 1, n_strain
         d = 0.0_wp
         d(j) = entry_of(j)
         response%tangent(:, j) = response%tangent(:, j) &
            + (0.5_wp*w%g(2))*(trace(d)*unit - d) + w%g(3)*cross(curved, d)
      end do
   end subroutine add_tangent

   !> Of a law whose W is of sums over the principal stretches: eqs. (10c) and (10d).
   pure subroutine add_parts(law, path, response, with_tangent)
      class(law_t), intent(in) :: law
      type(path_t), intent(in) :: path
      type(space_response_t), intent(inout) :: response    !! 0
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(stretch_path_t) :: stretches
      type(stretch_sum_t) :: total(max_part)
      type(dg_t) :: y, t, w(max_part), by_volume
      integer :: i

      y = dg_variable(1, dot_product(of_volume, [path%e1%f0, path%e2%f0, path%e3%f0]), &
         dot_product(of_volume, [path%e1%df, path%e2%df, path%e3%df]))
      call stretch_path(path%first, path%last, stretches)
      by_volume = dg_t()
      do i = 1, law%n_part
         call stretch_sum(stretches, 0.5_wp*law%exponent(i), total(i))
         t = dg_variable(2, total(i)%start, product_of(total(i)%gradient, path%by))
         t%f1 = total(i)%last
         w(i) = law%part(i, y, t)
         by_volume%f1 = by_volume%f1 + w(i)%f1
         by_volume%g = by_volume%g + w(i)%g(1)*of_volume
         by_volume%h = by_volume%h + w(i)%h(1, 1)*spread(of_volume, 2, 3)*spread(of_volume, 1, 3)
      end do
      call chain(path, by_volume, response)
      do i = 1, law%n_part
         response%stress = response%stress + w(i)%g(2)*total(i)%gradient
      end do
      if (.not. with_tangent) return
      call add_tangent(path, by_volume, response)
      do i = 1, law%n_part
         call stretch_add_tangent(stretches, 0.5_wp*law%exponent(i), w(i)%g(2), response%tangent)
         call add_pairs(path, w(i), total(i), response%tangent)
      end do
   end subroutine add_parts

   !> Add the second derivatives of W by volume and sum, and by the sum twice.
   pure subroutine add_pairs(path, w, total, tangent)
      type(path_t), intent(in) :: path
      type(dg_t), intent(in) :: w                !! of J^2 - 1 and t
      type(stretch_sum_t), intent(in) :: total
      real(wp), intent(inout) :: tangent(n_strain, n_strain)
      real(wp), dimension(n_strain) :: volume, volume_end, by_volume, by_total
      integer :: k

      volume = matmul(path%n, of_volume)
      volume_end = matmul(path%at_end, of_volume)
      by_volume = w%h(2, 1)*total%gradient
      by_total = w%h(1, 2)*volume + w%h(2, 2)*total%gradient
      do k = 1, n_strain
         tangent(:, k) = tangent(:, k) + by_volume*volume_end(k) + by_total*total%at_end(k)
      end do
   end subroutine add_pairs

   pure real(wp) function trace(a)
      real(wp), intent(in) :: a(n_strain)

      trace = a(1) + a(2) + a(3)
   end function trace

   !> a:b of symmetric tensors.
   pure real(wp) function product_of(a, b)
      real(wp), intent(in) :: a(n_strain), b(n_strain)

      product_of = sum(a(:n_shear)*b(:n_shear)) + 2.0_wp*sum(a(n_shear + 1:)*b(n_shear + 1:))
   end function product_of

   !> a x b, symmetric and bilinear, of which a x a is twice the cofactor of a.
   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(n_strain), b(n_strain)
      real(wp) :: c(n_strain)

      c = [a(2)*b(3) + a(3)*b(2) - 2.0_wp*a(5)*b(5), &
         a(1)*b(3) + a(3)*b(1) - 2.0_wp*a(6)*b(6), &
         a(1)*b(2) + a(2)*b(1) - 2.0_wp*a(4)*b(4), &
         a(6)*b(5) + a(5)*b(6) - (a(4)*b(3) + a(3)*b(4)), &
         a(4)*b(6) + a(6)*b(4) - (a(5)*b(1) + a(1)*b(5)), &
         a(4)*b(5) + a(5)*b(4) - (a(6)*b(2) + a(2)*b(6))]
   end function cross

end module emcon_law_space
