!> What the reference shape of an element gives, in two dimensions and in three.
module emcon_element
   use emcon_kinds, only : wp
   implicit none
   private
   public :: element_geometry_t

   !> Gradients and volumes at the points of quadrature.
   type :: element_geometry_t
      integer :: n_node = 0
      integer :: n_gp = 0
      real(wp), allocatable :: gradient(:, :, :)           !! (n_dim, n_node, n_gp) of the shape
                                                           !! functions by X [1/L]
      real(wp), allocatable :: weight(:)                   !! (n_gp) reference volume [L^3]
      !> (n_node, n_gp) of solids of revolution: the shape functions over the radius [1/L]
      real(wp), allocatable :: circle(:, :)
      !> (n_strain, n_mode, n_gp) of incompatible modes: their strains, and what measures them
      real(wp), allocatable :: mode(:, :, :), dual(:, :, :)
   end type element_geometry_t

end module emcon_element
