!> Triangle of three nodes: linear functions; one point, three for the mass or of a fine one.
module emcon_shape_triangle_plane
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_triangle_t

   type, extends(shape_t) :: shape_triangle_t
      logical :: is_fine = .false.               !! for stiffness, too, exact to degree 2
   contains
      procedure :: places => triangle_places
      procedure :: values => triangle_values
      procedure :: rule => triangle_rule
   end type shape_triangle_t

contains

   pure subroutine triangle_places(self, place)
      class(shape_triangle_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (2, 3)

      place = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
   end subroutine triangle_places

   pure subroutine triangle_values(self, point, value, slope)
      class(shape_triangle_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (2) natural coordinates
      real(wp), intent(out) :: value(:)          !! (3)
      real(wp), intent(out) :: slope(:, :)       !! (2, 3)

      value = [1.0_wp - point(1) - point(2), point(1), point(2)]
      slope = reshape([-1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
   end subroutine triangle_values

   !> Exact to degree 1, for the mass and of a fine one to degree 2.
   pure subroutine triangle_rule(self, is_mass, point, weight)
      class(shape_triangle_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (2, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)
      real(wp), parameter :: s = 1.0_wp/6.0_wp

      if (is_mass .or. self%is_fine) then
         point = reshape([s, s, 4*s, s, s, 4*s], [2, 3])
         weight = [s, s, s]
      else
         point = reshape([1.0_wp/3.0_wp, 1.0_wp/3.0_wp], [2, 1])
         weight = [0.5_wp]
      end if
   end subroutine triangle_rule

end module emcon_shape_triangle_plane
