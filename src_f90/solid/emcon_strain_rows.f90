! build: elements
!> Strains of elements as linear forms in displacements, and the stress of an isotropic law at rest:
!> of the plane, of space and of solids of revolution alike.
module emcon_strain_rows
   use emcon_element, only : element_geometry_t
   use emcon_incompatible_modes, only : modes_relax
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   implicit none
   private
   public :: moduli_t, moduli_find, stress_of
   public :: strain_rows, strain_change, strain_rows_relax, strain_count
   public :: n_shear, shear_one, shear_other

   !> The two directions of each shear strain: 12, then 23 and 13.
   integer, parameter :: shear_one(*) = [1, 2, 1], shear_other(*) = 1 + [1, 2, 2]
   integer, parameter :: n_most = size(shear_one)          ! dimensions, at most

   !> Lame's moduli of an isotropic law, or all of another.
   type :: moduli_t
      real(wp) :: lambda = 0.0_wp                !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp                    !! [M/(L T^2)]
      !> (n_strain, n_strain) in place of these [M/(L T^2)]
      real(wp), allocatable :: whole(:, :)
   end type moduli_t

contains

   !> Those of a law at rest.
   pure subroutine moduli_find(law, lame)
      class(law_t), intent(in) :: law
      type(moduli_t), intent(out) :: lame
      real(wp), parameter :: rest(3) = 0.0_wp
      type(law_response_t) :: state

      call law_response_plane(law, rest, rest, state)
      lame%mu = 2.0_wp*state%tangent(3, 3)       ! by the end of no step
      lame%lambda = 2.0_wp*state%tangent(1, 1) - 2.0_wp*lame%mu
      if (allocated(law%moduli)) lame%whole = law%moduli
   end subroutine moduli_find

   !> Shear strains; normal ones are as many as dimensions, and one of the circle.
   pure integer function n_shear(n_dim)
      integer, intent(in) :: n_dim               !! of the model

      n_shear = merge(size(shear_one), 1, n_dim == size(shear_one))
   end function n_shear

   !> Components of strain at the points of an element.
   pure integer function strain_count(is_of_rings, n_dim) result(n)
      logical, intent(in) :: is_of_rings         !! of solids of revolution
      integer, intent(in) :: n_dim               !! of the model

      n = n_dim + n_shear(n_dim) + count([is_of_rings])
   end function strain_count

   !> The strains at the points by the components of displacements, node by node, about the
   !> displacements `u`: 11, 22, (33,) shears, doubled; of solids of revolution 11, 22, 12 and the
   !> circle.
   pure subroutine strain_rows(geometry, u, square, row)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains
      real(wp), intent(out), contiguous :: row(:, :, :)      !! (n_strain, n_dim*n, n_gp)
      integer :: g

      do g = 1, size(row, 3)
         call find_rows(geometry%gradient(:, :, g), u, square, row(:, :, g))
         if (.not. allocated(geometry%circle)) cycle
         row(size(row, 1), :, g) = 0.0_wp
         row(size(row, 1), 1::size(u, 1), g) = (1.0_wp + square*dot_product(geometry%circle(:, g), &
            u(1, :)))*geometry%circle(:, g)
      end do
   end subroutine strain_rows

   !> The same at one point, but for the circle.
   pure subroutine find_rows(slope, u, square, row)
      real(wp), intent(in), contiguous :: slope(:, :)        !! (n_dim, n_node) [1/L]
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains
      real(wp), intent(inout), contiguous :: row(:, :)       !! (n_strain, n_dim*n)
      real(wp) :: f(n_most, n_most)
      integer :: b, i, j, k, n_dim

      n_dim = size(u, 1)
      call find_slope(slope, u, f)
      f = square*f
      do k = 1, n_dim
         f(k, k) = f(k, k) + 1.0_wp
      end do
      j = 0
      do i = 1, size(u, 2)
         do b = 1, n_dim
            j = j + 1
            do k = 1, n_dim
               row(k, j) = f(b, k)*slope(k, i)
            end do
            do k = 1, n_shear(n_dim)
               row(n_dim + k, j) = f(b, shear_one(k))*slope(shear_other(k), i) &
                  + f(b, shear_other(k))*slope(shear_one(k), i)
            end do
         end do
      end do
   end subroutine find_rows

   !> The strains at the points over displacements `by` about `u`: the rows times these.
   pure subroutine strain_change(geometry, u, by, square, strain)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in), contiguous :: u(:, :), by(:, :)  !! (n_dim, n_node) [L]
      real(wp), intent(in) :: square             !! part of squares in strains
      real(wp), intent(out), contiguous :: strain(:, :)      !! (n_strain, n_gp)
      real(wp), dimension(n_most, n_most) :: f, h
      integer :: g, k, n_dim

      n_dim = size(u, 1)
      do g = 1, size(strain, 2)
         call find_slope(geometry%gradient(:, :, g), u, f)
         call find_slope(geometry%gradient(:, :, g), by, h)
         f = square*f
         do k = 1, n_dim
            f(k, k) = f(k, k) + 1.0_wp
         end do
         do k = 1, n_dim
            strain(k, g) = dot_product(f(:n_dim, k), h(:n_dim, k))
         end do
         do k = 1, n_shear(n_dim)
            strain(n_dim + k, g) = dot_product(f(:n_dim, shear_one(k)), h(:n_dim, shear_other(k))) &
               + dot_product(f(:n_dim, shear_other(k)), h(:n_dim, shear_one(k)))
         end do
         if (.not. allocated(geometry%circle)) cycle
         strain(size(strain, 1), g) = (1.0_wp + square*dot_product(geometry%circle(:, g), &
            u(1, :)))*dot_product(geometry%circle(:, g), by(1, :))
      end do
   end subroutine strain_change

   !> The gradient of displacements at a point; 0 beyond the dimensions of the model.
   pure subroutine find_slope(slope, u, gradient)
      real(wp), intent(in), contiguous :: slope(:, :)        !! (n_dim, n_node) [1/L]
      real(wp), intent(in), contiguous :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(out) :: gradient(n_most, n_most)
      real(wp) :: total
      integer :: b, i, k

      gradient = 0.0_wp
      do k = 1, size(u, 1)
         do b = 1, size(u, 1)
            total = 0.0_wp
            do i = 1, size(u, 2)
               total = total + u(b, i)*slope(k, i)
            end do
            gradient(b, k) = total
         end do
      end do
   end subroutine find_slope

   !> What incompatible modes leave of the strains at the points by each component.
   pure subroutine strain_rows_relax(geometry, row)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(inout) :: row(:, :, :)    !! (n_strain, n_dim*n, n_gp)
      real(wp) :: by(size(row, 1), size(row, 3))
      integer :: j

      do j = 1, size(row, 2)
         by = row(:, j, :)
         call modes_relax(geometry, by)
         row(:, j, :) = by
      end do
   end subroutine strain_rows_relax

   !> The stress of a strain times a factor, both in the order of `strain_rows`.
   pure subroutine stress_of(lame, n_dim, factor, strain, stress)
      type(moduli_t), intent(in) :: lame
      integer, intent(in) :: n_dim               !! of the model
      real(wp), intent(in) :: factor             !! of any unit
      real(wp), intent(in), contiguous :: strain(:)          !! (n_strain)
      real(wp), intent(out), contiguous :: stress(:)         !! (n_strain) that unit [M/(L T^2)]
      real(wp) :: pressure, shear
      integer :: k, n

      if (allocated(lame%whole)) then
         stress = factor*matmul(lame%whole, strain)
         return
      end if
      n = n_dim + n_shear(n_dim)
      pressure = factor*lame%lambda*(sum(strain(:n_dim)) + sum(strain(n + 1:)))
      shear = factor*lame%mu
      do k = 1, size(strain)
         stress(k) = shear*strain(k)
         if (k <= n_dim .or. k > n) stress(k) = pressure + 2.0_wp*stress(k)
      end do
   end subroutine stress_of

end module emcon_strain_rows
