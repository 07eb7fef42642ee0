!> Bodies that are bent though their elements cannot follow: the energy of what strains differ by
!> from those of bending, beside the strain energy.
!>
!> An element turns against those beside it; that is the curvature. Of the field of a plate of this
!> curvature an element with nodes at its corners alone takes the values at the nodes, and with
!> them strains along the plate's normal, which the plate has not, and stress there. What is of
!> the plane is here a part of space. Source: docs/theory.md, eq. (11h).
module emcon_bending
   use emcon_csr, only : csr_list_users
   use emcon_element, only : element_geometry_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_eigen
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_space, only : law_response_space, n_strain, space_response_t
   use emcon_solid, only : solid_geometry, solid_t
   implicit none
   private
   public :: bending_t, bending_measure

   integer, parameter :: n_axis = 3
   integer, parameter :: behind(n_axis) = 1 + modulo([1, 2, 3], n_axis), &
      last(n_axis) = behind(behind)
   !> Rows and columns of the components of a strain.
   integer, parameter :: row(n_strain) = [1, 2, 3, 1, 2, 1], column(n_strain) = [1, 2, 3, 2, 3, 3]
   !> Directions in which neighbours lie less than that, per distance, have no curvature.
   real(wp), parameter :: flat = 1.0e-3_wp

   !> What is found, body by body, and what elements have for it.
   type :: bending_t
      real(wp), allocatable :: strain(:)         !! (n_body) strain energy, by the moduli at rest
      real(wp), allocatable :: missed(:)         !! (n_body) of what strains of bending miss
      integer, allocatable :: element(:)         !! (n_body) first of the body's elements, 0: none
      real(wp), allocatable, private :: center(:, :)       !! (n_axis, n_element) [L]
      real(wp), allocatable, private :: slope(:, :, :)     !! (., ., n_element) mean of grad u
      integer, allocatable, private :: start(:), beside(:) !! elements at each node
   end type bending_t

   !> Moduli of a law at rest.
   type :: moduli_t
      real(wp) :: whole(n_strain, n_strain) = 0.0_wp     !! [M/(L T^2)]
      real(wp) :: rest(n_strain, n_strain) = 0.0_wp      !! without resistance to changes of volume
   end type moduli_t

   !> A plate of deflection w = y.H.y/2 over its plane.
   type :: plate_t
      real(wp) :: normal(n_axis) = 0.0_wp        !! unit vector; 0: not bent
      real(wp) :: bend(n_axis, n_axis) = 0.0_wp  !! H [1/L], without part along the normal
   end type plate_t

contains

   !> Measure all bodies at the displacements `u`.
   subroutine bending_measure(self, solid, body, x, u, square)
      type(bending_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: body(:)             !! (n_node) 1 to n_body, 0: none
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains; 0: small
      type(moduli_t) :: moduli(size(solid%law))
      type(plate_t) :: plate
      real(wp) :: curve(n_axis, n_axis)
      integer :: b, e

      b = maxval([0, body])
      allocate(self%strain(b), self%missed(b), source=0.0_wp)
      allocate(self%element(b), source=0)
      call place_elements(self, solid, x, u)
      call join_elements(self, solid)
      call find_moduli(solid, moduli)
      do e = 1, solid%n_element
         b = body(solid%node(1, e))
         if (b == 0 .or. solid%trait%is_rigid(e)) cycle
         if (.not. allocated(solid%law(solid%law_of(e))%law)) cycle
         if (self%element(b) == 0) self%element(b) = e
         associate (own => moduli(solid%law_of(e)))
            self%strain(b) = self%strain(b) + strain_energy(solid, e, u, square, own)
            if (.not. solid%trait%is_stiff_bent(e)) cycle
            call find_curvature(self, solid, e, square, curve)
            call take_plate(curve, plate)
            if (maxval(abs(plate%bend)) > 0.0_wp) call add_missed(self, solid, e, x, plate, own, &
               self%missed(b))
         end associate
      end do
   end subroutine bending_measure

   !> Centres of the elements, and the mean gradients of their displacements.
   pure subroutine place_elements(self, solid, x, u)
      type(bending_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(element_geometry_t) :: geometry
      real(wp) :: slope(n_axis, n_axis)
      integer :: e, k

      allocate(self%center(n_axis, solid%n_element), self%slope(n_axis, n_axis, solid%n_element), &
         source=0.0_wp)
      do e = 1, solid%n_element
         call solid_geometry(solid, e, geometry)
         self%center(:size(x, 1), e) = sum(x(:, solid%node(:geometry%n_node, e)), dim=2) &
            /real(geometry%n_node, wp)
         do k = 1, geometry%n_gp
            call gradient_at(geometry, k, u(:, solid%node(:geometry%n_node, e)), slope)
            self%slope(:, :, e) = self%slope(:, :, e) + geometry%weight(k)*slope
         end do
         self%slope(:, :, e) = self%slope(:, :, e)/sum(geometry%weight)
      end do
   end subroutine place_elements

   !> d u_a / d X_b at point `k` of an element; around the axis of a solid of revolution u_r/r.
   pure subroutine gradient_at(geometry, k, u, slope)
      type(element_geometry_t), intent(in) :: geometry
      integer, intent(in) :: k                   !! 1 to n_gp
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node of the element) [L]
      real(wp), intent(out) :: slope(n_axis, n_axis)
      integer :: b, i, n

      n = size(u, 1)
      slope = 0.0_wp
      do i = 1, size(u, 2)
         do b = 1, n
            slope(:n, b) = slope(:n, b) + u(:, i)*geometry%gradient(b, i, k)
         end do
         if (allocated(geometry%circle)) slope(n_axis, n_axis) = slope(n_axis, n_axis) &
            + u(1, i)*geometry%circle(i, k)
      end do
   end subroutine gradient_at

   !> Lists of the elements at each node.
   pure subroutine join_elements(self, solid)
      type(bending_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      integer :: e

      associate (m => size(solid%node, 1))
         call csr_list_users(solid%n_node, [(1 + m*e, e = 0, solid%n_element)], &
            reshape(solid%node(:, :solid%n_element), [m*solid%n_element]), self%start, self%beside)
      end associate
   end subroutine join_elements

   !> Moduli of the laws at rest, and of those without what the mean change of volume resists.
   pure subroutine find_moduli(solid, moduli)
      type(solid_t), intent(in) :: solid
      type(moduli_t), intent(out) :: moduli(:)   !! (n_law)
      integer :: k

      do k = 1, size(solid%law)
         if (.not. allocated(solid%law(k)%law)) cycle
         call take_moduli(solid%law(k)%law, solid%is_single, moduli(k)%whole)
         moduli(k)%rest = moduli(k)%whole
         if (allocated(solid%rest(k)%law)) call take_moduli(solid%rest(k)%law, solid%is_single, &
            moduli(k)%rest)
      end do
   end subroutine find_moduli

   !> Those of one law. A tangent by the end of a step of no size is half of them.
   pure subroutine take_moduli(law, in_space, moduli)
      class(law_t), intent(in) :: law
      logical, intent(in) :: in_space            !! else of the plane
      real(wp), intent(inout) :: moduli(:, :)    !! (n_strain, n_strain) [M/(L T^2)]
      real(wp), parameter :: still(n_strain) = 0.0_wp
      integer, allocatable :: part(:)
      type(law_response_t) :: plane
      type(space_response_t) :: space
      integer :: c

      if (in_space) then
         call law_response_space(law, still, still, space)
         moduli = space%tangent + space%tangent
         return
      end if
      part = pack([(c, c = 1, n_strain)], max(row, column) < n_axis)
      call law_response_plane(law, still(part), still(part), plane)
      moduli(part, part) = plane%tangent + plane%tangent
   end subroutine take_moduli

   !> Of an element, by the moduli of its law at rest.
   pure real(wp) function strain_energy(solid, e, u, square, moduli) result(energy)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square
      type(moduli_t), intent(in) :: moduli
      type(element_geometry_t) :: geometry
      real(wp) :: slope(n_axis, n_axis), strain(n_strain), mean(n_strain), volume
      integer :: k

      energy = 0.0_wp
      mean = 0.0_wp
      call solid_geometry(solid, e, geometry)
      volume = sum(geometry%weight)
      do k = 1, geometry%n_gp
         call gradient_at(geometry, k, u(:, solid%node(:geometry%n_node, e)), slope)
         strain = components(slope + (0.5_wp*solid%trait%square_of(e, square)) &
            *matmul(transpose(slope), slope))
         mean = mean + (geometry%weight(k)/volume)*strain
         if (solid%trait%has_mean(e)) then
            energy = energy + geometry%weight(k)*work(moduli%rest, strain)
         else
            energy = energy + geometry%weight(k)*work(moduli%whole, strain)
         end if
      end do
      if (solid%trait%has_mean(e)) energy = energy + volume*(work(moduli%whole, mean) &
         - work(moduli%rest, mean))
   end function strain_energy

   !> The symmetric part of a gradient as a strain, shears twice.
   pure function components(slope) result(strain)
      real(wp), intent(in) :: slope(n_axis, n_axis)
      real(wp) :: strain(n_strain)
      integer :: c

      do c = 1, n_strain
         strain(c) = slope(row(c), column(c))
         if (row(c) /= column(c)) strain(c) = strain(c) + slope(column(c), row(c))
      end do
   end function components

   pure real(wp) function work(moduli, strain)
      real(wp), intent(in) :: moduli(:, :), strain(:)

      work = 0.5_wp*product_of(moduli, strain, strain)
   end function work

   !> d omega_a / d X_b, the rotations of the elements beside `e` against its own, by least squares
   !> over the directions in which they lie.
   pure subroutine find_curvature(self, solid, e, square, curve)
      type(bending_t), intent(in) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in) :: square
      real(wp), intent(out) :: curve(n_axis, n_axis)     !! [1/L]
      real(wp) :: offset(n_axis), turn(n_axis), spread(n_axis, n_axis), size_of
      integer :: b, i, k

      curve = 0.0_wp
      spread = 0.0_wp
      do i = 1, solid%trait%n_node(e)
         associate (node => solid%node(i, e))
            do k = self%start(node) + 1, self%start(node + 1)
               offset = self%center(:, self%beside(k)) - self%center(:, e)
               turn = turn_between(self%slope(:, :, e), self%slope(:, :, self%beside(k)), &
                  solid%trait%square_of(e, square))
               do b = 1, n_axis
                  curve(:, b) = curve(:, b) + turn*offset(b)
                  spread(:, b) = spread(:, b) + offset*offset(b)
               end do
            end do
         end associate
      end do
      size_of = 0.0_wp
      do b = 1, n_axis
         size_of = size_of + spread(b, b)
      end do
      if (.not. size_of > 0.0_wp) return
      do b = 1, n_axis
         spread(b, b) = spread(b, b) + flat*size_of
      end do
      call divide(curve, spread)
   end subroutine find_curvature

   !> The rotation from one mean gradient to another, as a vector.
   pure function turn_between(from, to, square) result(turn)
      real(wp), intent(in) :: from(n_axis, n_axis), to(n_axis, n_axis)
      real(wp), intent(in) :: square
      real(wp) :: turn(n_axis), f(n_axis, n_axis)
      integer :: a

      f = to - from
      f = f + square*matmul(transpose(from), f)
      do a = 1, n_axis
         turn(a) = 0.5_wp*(f(last(a), behind(a)) - f(behind(a), last(a)))
      end do
   end function turn_between

   !> a s^-1 with a positive definite s.
   pure subroutine divide(a, s)
      real(wp), intent(inout) :: a(n_axis, n_axis)
      real(wp), intent(in) :: s(n_axis, n_axis)
      real(wp) :: cofactor(n_axis, n_axis)
      integer :: i, j

      do j = 1, n_axis
         do i = 1, n_axis
            cofactor(i, j) = s(behind(i), behind(j))*s(last(i), last(j)) &
               - s(behind(i), last(j))*s(last(i), behind(j))
         end do
      end do
      a = matmul(a, cofactor)/dot_product(s(:, 1), cofactor(:, 1))
   end subroutine divide

   !> The plate that such a curvature bends: neither does it turn about its normal, nor along it.
   subroutine take_plate(curve, plate)
      real(wp), intent(in) :: curve(n_axis, n_axis)      !! [1/L]
      type(plate_t), intent(out) :: plate
      real(dp), allocatable :: lambda(:), axis(:, :)
      type(error_t), allocatable :: error
      real(wp) :: square(n_axis, n_axis), along(n_axis)
      integer :: b

      square = matmul(curve, transpose(curve)) + matmul(transpose(curve), curve)
      if (.not. maxval(square) > 0.0_wp) return
      call dense_eigen(real(square/maxval(square), dp), lambda, axis, error)
      if (allocated(error)) return
      associate (normal => plate%normal, bend => plate%bend)
         normal = real(axis(:, 1), wp)
         do b = 1, n_axis
            bend(:, b) = normal(behind)*curve(last, b) - normal(last)*curve(behind, b)
         end do
         along = matmul(bend, normal)
         do b = 1, n_axis
            bend(:, b) = bend(:, b) - along*normal(b)
         end do
         bend = 0.5_wp*(bend + transpose(bend))
      end associate
   end subroutine take_plate

   !> Energy of what the strains of an element differ by from those of a plate; where the mean
   !> change of volume resists, what the element stores more than the plate.
   pure subroutine add_missed(self, solid, e, x, plate, moduli, missed)
      type(bending_t), intent(in) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      type(plate_t), intent(in) :: plate
      type(moduli_t), intent(in) :: moduli
      real(wp), intent(inout) :: missed          !! [M L^2/T^2]
      real(wp) :: u(size(x, 1), solid%trait%n_node(e)), height
      type(element_geometry_t) :: geometry
      real(wp), dimension(n_axis, n_axis) :: slope, level
      integer :: k

      call place_on_plate(plate, x(:, solid%node(:size(u, 2), e)), self%center(:, e), u, height)
      call solid_geometry(solid, e, geometry)
      do k = 1, geometry%n_gp
         call gradient_at(geometry, k, u, slope)
         slope = 0.5_wp*(slope + transpose(slope))
         call relax_across(plate, moduli, slope, level)
         if (solid%trait%has_mean(e)) then
            missed = missed + geometry%weight(k)*(work(moduli%rest, components(slope)) &
               - work(moduli%whole, components(level)))
         else
            missed = missed + geometry%weight(k)*work(moduli%whole, components(slope - level))
         end if
      end do
      if (geometry%n_gp > 1) return
      ! One point: the strain of bending, linear over the thickness, is missing as a whole.
      call relax_across(plate, moduli, plate%bend, level)
      missed = missed + geometry%weight(1)*work(moduli%whole, components(level))*height &
         /real((size(x, 1) + 1)*(size(x, 1) + 2), wp)
   end subroutine add_missed

   !> Of a strain what lies in the plane of a plate, and so much along its normal that there is no
   !> stress there.
   pure subroutine relax_across(plate, moduli, strain, level)
      type(plate_t), intent(in) :: plate
      type(moduli_t), intent(in) :: moduli
      real(wp), intent(in) :: strain(n_axis, n_axis)     !! symmetric
      real(wp), intent(out) :: level(n_axis, n_axis)
      real(wp), dimension(n_axis, n_axis) :: onto, across
      integer :: i

      do i = 1, n_axis
         across(:, i) = plate%normal*plate%normal(i)
         onto(:, i) = -across(:, i)
         onto(i, i) = 1.0_wp + onto(i, i)
      end do
      level = matmul(onto, matmul(strain, onto))
      associate (along => components(across))
         level = level - across*(product_of(moduli%whole, along, components(level)) &
            /product_of(moduli%whole, along, along))
      end associate
   end subroutine relax_across

   !> The displacements of a plate at the nodes of an element, u = w n - s grad w; the sum of s^2.
   pure subroutine place_on_plate(plate, x, center, u, height)
      type(plate_t), intent(in) :: plate
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) of the element [L]
      real(wp), intent(in) :: center(n_axis)     !! [L]
      real(wp), intent(out) :: u(:, :)           !! (n_dim, n_node) [L]
      real(wp), intent(out) :: height            !! [L^2]
      real(wp) :: y(n_axis), tilt(n_axis)
      integer :: i, n

      n = size(x, 1)
      height = 0.0_wp
      do i = 1, size(x, 2)
         y = 0.0_wp
         y(:n) = x(:, i) - center(:n)
         tilt = matmul(plate%bend, y)
         u(:, i) = 0.5_wp*dot_product(y, tilt)*plate%normal(:n) &
            - dot_product(plate%normal, y)*tilt(:n)
         height = height + dot_product(plate%normal, y)**2
      end do
   end subroutine place_on_plate

   !> Of two strains by the moduli: of one along a direction the stress along it.
   pure real(wp) function product_of(moduli, a, b)
      real(wp), intent(in) :: moduli(:, :), a(:), b(:)

      product_of = dot_product(a, matmul(moduli, b))
   end function product_of

end module emcon_bending
