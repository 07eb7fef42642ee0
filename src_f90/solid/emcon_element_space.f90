!> One element in three dimensions over one step: force, tangent and strain energy.
!>
!> The force is a discrete gradient of the strain energy without net force and moment on the
!> mid-configuration, as in the plane: docs/theory.md, eqs. (6), (10a) and (11).
module emcon_element_space
   use emcon_element, only : space_element_t => element_geometry_t
   use emcon_incompatible_modes, only : modes_relax
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_space, only : law_response_space, law_stress_space, n_strain, &
      space_response_t
   use emcon_rotation, only : product_of => cross_product
   use emcon_shape, only : max_node => max_element_nodes, shape_t, shape_table_t, shape_tabulate
   use emcon_stretch_sums_space, only : column, row
   implicit none
   private
   public :: n_space, space_element_t, space_motion_t, space_part_t
   public :: space_element_init, space_element_place, space_element_mass, space_element_add_mass
   public :: space_element_respond, space_element_hold
   public :: space_point_t, space_point, space_point_is_regular, space_point_strain_by, &
      space_point_cauchy, space_part_clear, space_part_add, space_part_add_tangent

   integer, parameter :: n_space = 3, n_dim = n_space

   !> Motion of the nodes, from `from` by `by`.
   type :: space_motion_t
      real(wp) :: square = 1.0_wp                !! part of squares in strains; 0: small strains
      real(wp) :: from(n_dim, max_node) = 0.0_wp !! displacement at the start [L]
      real(wp) :: by(n_dim, max_node) = 0.0_wp   !! displacement over the span [L]
   end type space_motion_t

   type :: space_part_t
      real(wp) :: energy = 0.0_wp                !! strain energy at the end
      real(wp) :: force(n_dim, max_node) = 0.0_wp
      real(wp) :: magnitude(n_dim, max_node) = 0.0_wp    !! sum of |contributions| to `force`
      !> Derivative of `force` by the end, where asked for.
      real(wp) :: tangent(n_dim, max_node, n_dim, max_node) = 0.0_wp
      logical :: is_inverted = .false.           !! det F <= 0 at some point at the end
   end type space_part_t

   !> One point; of small strains deformation gradients are the identity.
   type :: space_point_t
      real(wp) :: strain(n_strain) = 0.0_wp      !! at the start
      real(wp) :: dstrain(n_strain) = 0.0_wp
      real(wp) :: f_mid(n_dim, n_dim) = 0.0_wp
      real(wp) :: f_end(n_dim, n_dim) = 0.0_wp
      real(wp) :: geometric = 0.0_wp             !! df_mid/df_end: 1/2, small strains 0
   end type space_point_t

contains

   !> Gradients and volumes at the points for stiffness; a volume <= 0: inverted or flat.
   subroutine space_element_init(self, shape, x)
      type(space_element_t), intent(out) :: self
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      type(shape_table_t) :: table

      call shape_tabulate(shape, .false., table)
      call space_element_place(self, table, x)
   end subroutine space_element_init

   !> The same from the shape functions at the points.
   pure subroutine space_element_place(self, table, x)
      type(space_element_t), intent(inout) :: self
      type(shape_table_t), intent(in) :: table   !! for stiffness
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      integer :: k

      self%n_node = table%n_node
      self%n_gp = table%n_gp
      allocate(self%gradient(n_dim, self%n_node, self%n_gp), self%weight(self%n_gp))
      do k = 1, self%n_gp
         call reference_gradient(x, table%slope(:, :, k), self%gradient(:, :, k), self%weight(k))
         self%weight(k) = table%weight(k)*self%weight(k)
      end do
   end subroutine space_element_place

   !> int rho N_i N_j.
   subroutine space_element_mass(shape, x, density, mass)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      real(wp), intent(in) :: density            !! [M/L^3]
      real(wp), intent(out) :: mass(:, :)        !! (n_node, n_node) [M]
      type(shape_table_t) :: table
      real(wp) :: at_node(size(mass, 1))

      call shape_tabulate(shape, .true., table)
      call space_element_add_mass(table, x, density, mass, at_node)
   end subroutine space_element_mass

   !> The same from the shape functions at the points, and int rho N_i.
   pure subroutine space_element_add_mass(table, x, density, mass, at_node)
      type(shape_table_t), intent(in) :: table   !! for mass
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      real(wp), intent(in) :: density            !! [M/L^3]
      real(wp), intent(out) :: mass(:, :)        !! (n_node, n_node) [M]
      real(wp), intent(out) :: at_node(:)        !! (n_node) [M]
      real(wp) :: gradient(n_dim, size(x, 2)), det
      integer :: i, k

      mass = 0.0_wp
      at_node = 0.0_wp
      do k = 1, table%n_gp
         call reference_gradient(x, table%slope(:, :, k), gradient, det)
         do i = 1, table%n_node
            mass(:, i) = mass(:, i) &
               + density*table%weight(k)*det*table%value(i, k)*table%value(:, k)
         end do
         at_node = at_node + density*table%weight(k)*det*table%value(:, k)
      end do
   end subroutine space_element_add_mass

   !> Gradient of the shape functions by X and the determinant of the Jacobian.
   pure subroutine reference_gradient(x, slope, gradient, det)
      real(wp), intent(in) :: x(:, :), slope(:, :)
      real(wp), intent(out) :: gradient(:, :), det
      real(wp) :: j(n_dim, n_dim), cofactor(n_dim, n_dim)
      integer :: a, i

      ! As `pack_gradient` does it, to the same bits.
      j = 0.0_wp
      do i = 2, size(x, 2)                       ! from the first node
         do a = 1, n_dim
            j(:, a) = j(:, a) + (x(:, i) - x(:, 1))*slope(a, i)
         end do
      end do
      cofactor(:, 1) = product_of(j(:, 2), j(:, 3))
      cofactor(:, 2) = product_of(j(:, 3), j(:, 1))
      cofactor(:, 3) = product_of(j(:, 1), j(:, 2))
      det = j(1, 1)*cofactor(1, 1) + j(2, 1)*cofactor(2, 1) + j(3, 1)*cofactor(3, 1)
      gradient = 0.0_wp
      if (.not. abs(det) > 0.0_wp) return
      cofactor = cofactor*(1.0_wp/det)
      do i = 1, size(x, 2)
         gradient(:, i) = cofactor(:, 1)*slope(1, i) + cofactor(:, 2)*slope(2, i) &
            + cofactor(:, 3)*slope(3, i)
      end do
   end subroutine reference_gradient

   !> Response to a motion.
   pure subroutine space_element_respond(self, law, motion, with_tangent, part)
      type(space_element_t), intent(in) :: self
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion
      logical, intent(in) :: with_tangent        !! else no tangent is computed
      type(space_part_t), intent(inout) :: part
      type(space_point_t) :: point
      type(space_response_t) :: response
      integer :: k

      call space_part_clear(self%n_node, with_tangent, part)
      do k = 1, self%n_gp
         call space_point(self, k, motion, point)
         part%is_inverted = .not. space_point_is_regular(point, law%has_volume)
         if (part%is_inverted) return
         call law_stress_space(law, point%strain, point%dstrain, response, with_tangent)
         call space_part_add(self, k, point, response, part)
         if (with_tangent) call space_part_add_tangent(self, k, point, response, part)
      end do
   end subroutine space_element_respond

   !> Nothing, for so many nodes.
   pure subroutine space_part_clear(n, with_tangent, part)
      integer, intent(in) :: n                   !! nodes
      logical, intent(in) :: with_tangent        !! else the tangent stays as it is
      type(space_part_t), intent(inout) :: part

      part%energy = 0.0_wp
      part%force(:, :n) = 0.0_wp
      part%magnitude(:, :n) = 0.0_wp
      if (with_tangent) part%tangent(:, :n, :, :n) = 0.0_wp
   end subroutine space_part_clear

   !> Cauchy stress and strain at the points of an element that does not move.
   pure subroutine space_element_hold(self, law, motion, stress, strain)
      type(space_element_t), intent(in) :: self
      class(law_t), intent(in) :: law
      type(space_motion_t), intent(in) :: motion       !! of no size
      real(wp), intent(out) :: stress(:, :)      !! (6, >= n_gp) [M/(L T^2)]
      real(wp), intent(out) :: strain(:, :)      !! (6, >= n_gp) E11, E22, E33, 2 E12, ...
      type(space_point_t) :: point(self%n_gp)
      type(space_response_t) :: response
      integer :: k

      do k = 1, self%n_gp
         call space_point(self, k, motion, point(k))
         strain(:, k) = point(k)%strain
      end do
      if (allocated(self%mode)) call modes_relax(self, strain(:, :self%n_gp))
      do k = 1, self%n_gp
         call law_response_space(law, strain(:, k), point(k)%dstrain, response)
         stress(:, k) = space_point_cauchy(point(k), response%stress)
      end do
   end subroutine space_element_hold

   !> F S F^T/det F.
   pure function space_point_cauchy(point, stress) result(cauchy)
      type(space_point_t), intent(in) :: point
      real(wp), intent(in) :: stress(n_strain)   !! S11, S22, S33, S12, S23, S13 [M/(L T^2)]
      real(wp) :: cauchy(n_strain), s(n_dim, n_dim), det
      integer :: v

      associate (f => point%f_end)
         det = dot_product(f(:, 1), product_of(f(:, 2), f(:, 3)))
         s = matmul(f, matmul(tensor_of(stress), transpose(f)))/det
      end associate
      do v = 1, n_strain
         cauchy(v) = s(row(v), column(v))
      end do
   end function space_point_cauchy

   !> The motion of point `k`: eq. (6).
   pure subroutine space_point(self, k, motion, point)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(space_motion_t), intent(in) :: motion
      type(space_point_t), intent(out) :: point
      real(wp), dimension(n_dim, n_dim) :: h, d, c
      integer :: a, i

      h = 0.0_wp
      d = 0.0_wp
      do i = 2, self%n_node                      ! the first node is the origin
         do a = 1, n_dim
            h(:, a) = h(:, a) + (motion%from(:, i) - motion%from(:, 1))*self%gradient(a, i, k)
            d(:, a) = d(:, a) + (motion%by(:, i) - motion%by(:, 1))*self%gradient(a, i, k)
         end do
      end do
      do a = 1, n_dim
         point%f_mid(a, a) = 1.0_wp
      end do
      point%f_end = point%f_mid + motion%square*(h + d)
      point%f_mid = point%f_mid + motion%square*(h + 0.5_wp*d)
      point%geometric = 0.5_wp*motion%square
      point%strain = strain_of(h + transpose(h) + motion%square*matmul(transpose(h), h))
      c = matmul(transpose(point%f_mid), d)
      point%dstrain = strain_of(c + transpose(c))
   end subroutine space_point

   !> E11, E22, E33, 2 E12, 2 E23, 2 E13 of a tensor 2 E.
   pure function strain_of(c) result(e)
      real(wp), intent(in) :: c(n_dim, n_dim)
      real(wp) :: e(n_strain)
      integer :: v

      do v = 1, n_strain
         e(v) = merge(0.5_wp, 1.0_wp, row(v) == column(v))*c(row(v), column(v))
      end do
   end function strain_of

   !> Is the end one that the law can answer to?
   pure logical function space_point_is_regular(point, has_volume) result(is_regular)
      type(space_point_t), intent(in) :: point
      logical, intent(in) :: has_volume          !! as in law_t
      real(wp), parameter :: largest = huge(1.0_wp)**0.1_wp   ! its powers in energies are finite
      real(wp), parameter :: noise = 64.0_wp*epsilon(1.0_wp)
      real(wp) :: c(n_dim, n_dim), e(n_strain)
      integer :: v

      e = point%strain + point%dstrain
      is_regular = maxval(abs(point%f_end)) < largest .and. maxval(abs(e)) < largest
      if (.not. is_regular) return
      is_regular = dot_product(point%f_end(:, 1), product_of(point%f_end(:, 2), &
         point%f_end(:, 3))) > 0.0_wp
      if (.not. (is_regular .and. has_volume)) return
      do v = 1, n_strain
         c(row(v), column(v)) = merge(1.0_wp + 2.0_wp*e(v), e(v), row(v) == column(v))
         c(column(v), row(v)) = c(row(v), column(v))
      end do
      is_regular = dot_product(c(:, 1), product_of(c(:, 2), c(:, 3))) &
         > noise*product(sum(abs(c), 1)) .and. c(1, 1) > 0.0_wp &
         .and. c(1, 1)*c(2, 2) > c(1, 2)**2
   end function space_point_is_regular

   !> Add the forces of a point, F S grad N.
   pure subroutine space_part_add(self, k, point, response, part)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(space_point_t), intent(in) :: point
      type(space_response_t), intent(in) :: response
      type(space_part_t), intent(inout) :: part
      real(wp) :: s(n_dim, n_dim), nominal(n_dim, n_dim), f(n_dim)
      integer :: i

      part%energy = part%energy + self%weight(k)*response%energy
      s = tensor_of(response%stress)
      nominal = self%weight(k)*matmul(point%f_mid, s)
      do i = 1, self%n_node
         f = matmul(nominal, self%gradient(:, i, k))
         part%force(:, i) = part%force(:, i) + f
         part%magnitude(:, i) = part%magnitude(:, i) + abs(f)
      end do
   end subroutine space_part_add

   pure function tensor_of(stress) result(s)
      real(wp), intent(in) :: stress(n_strain)
      real(wp) :: s(n_dim, n_dim)
      integer :: v

      do v = 1, n_strain
         s(row(v), column(v)) = stress(v)
         s(column(v), row(v)) = stress(v)
      end do
   end function tensor_of

   !> Add B(F_mid)^T D B(F_end) and what the stress at fixed strain does: eq. (11).
   pure subroutine space_part_add_tangent(self, k, point, response, part)
      type(space_element_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_gp
      type(space_point_t), intent(in) :: point
      type(space_response_t), intent(in) :: response
      type(space_part_t), intent(inout) :: part
      real(wp) :: b(n_strain, n_dim, max_node), flow(n_strain), s(n_dim, n_dim), steep(n_dim)
      real(wp) :: at_end(n_strain, n_dim), own
      integer :: a, c, i, j

      s = (point%geometric*self%weight(k))*tensor_of(response%stress)
      do i = 1, self%n_node
         b(:, :, i) = space_point_strain_by(point%f_mid, self%gradient(:, i, k))
      end do
      do j = 1, self%n_node
         at_end = self%weight(k)*space_point_strain_by(point%f_end, self%gradient(:, j, k))
         steep = matmul(s, self%gradient(:, j, k))
         do c = 1, n_dim
            flow = matmul(response%tangent, at_end(:, c))
            do i = 1, self%n_node
               own = dot_product(self%gradient(:, i, k), steep)
               do a = 1, n_dim
                  part%tangent(a, i, c, j) = part%tangent(a, i, c, j) &
                     + dot_product(b(:, a, i), flow) + merge(own, 0.0_wp, a == c)
               end do
            end do
         end do
      end do
   end subroutine space_part_add_tangent

   !> Derivative of the strain by the displacement of a node.
   pure function space_point_strain_by(f, gradient) result(b)
      real(wp), intent(in) :: f(n_dim, n_dim)    !! deformation gradient
      real(wp), intent(in) :: gradient(n_dim)    !! of the node's function by X [1/L]
      real(wp) :: b(n_strain, n_dim)
      integer :: v

      do v = 1, n_strain
         if (row(v) == column(v)) then
            b(v, :) = f(:, row(v))*gradient(row(v))
         else
            b(v, :) = f(:, row(v))*gradient(column(v)) + f(:, column(v))*gradient(row(v))
         end if
      end do
   end function space_point_strain_by

end module emcon_element_space
