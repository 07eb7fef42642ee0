!> Shape functions and quadrature of the element kinds.
module emcon_shape
   use emcon_element_kinds, only : element_kinds, max_element_nodes
   use emcon_kinds, only : wp
   implicit none
   private
   public :: shape_t, shape_create, shape_values

   integer, parameter :: max_gauss_points = 4

   !> Shape functions at the points of one quadrature rule.
   type :: shape_t
      integer :: n_node = 0
      integer :: n_gp = 0
      real(wp) :: point(2, max_gauss_points) = 0.0_wp                      !! natural coordinates
      real(wp) :: weight(max_gauss_points) = 0.0_wp
      real(wp) :: value(max_element_nodes, max_gauss_points) = 0.0_wp
      real(wp) :: slope(2, max_element_nodes, max_gauss_points) = 0.0_wp   !! by natural coordinates
   end type shape_t

contains

   !> Shape functions of `kind` at the points for stiffness and stress, and for mass.
   pure subroutine shape_create(kind, stiffness, mass)
      integer, intent(in) :: kind                !! index into `element_kinds`
      type(shape_t), intent(out) :: stiffness, mass
      real(wp), parameter :: g = 1.0_wp/sqrt(3.0_wp), s = 1.0_wp/6.0_wp

      select case (element_kinds(kind)%name)
      case ("CPE3")
         stiffness%n_gp = 1
         stiffness%point(:, 1) = 1.0_wp/3.0_wp
         stiffness%weight(1) = 0.5_wp
         mass%n_gp = 3
         mass%point(:, :3) = reshape([s, s, 4*s, s, s, 4*s], [2, 3])
         mass%weight(:3) = s
      case ("CPE4")
         stiffness%n_gp = 4
         stiffness%point = g*reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp, &
            -1.0_wp, 1.0_wp], [2, 4])
         stiffness%weight = 1.0_wp
         mass = stiffness
      end select
      call fill(stiffness)
      call fill(mass)

   contains

      pure subroutine fill(shape)
         type(shape_t), intent(inout) :: shape
         integer :: k

         shape%n_node = element_kinds(kind)%n_node
         do k = 1, shape%n_gp
            call shape_values(kind, shape%point(:, k), shape%value(:, k), shape%slope(:, :, k))
         end do
      end subroutine fill

   end subroutine shape_create

   !> Values and natural derivatives of the shape functions of `kind` at `point`.
   pure subroutine shape_values(kind, point, value, slope)
      integer, intent(in) :: kind                !! index into `element_kinds`
      real(wp), intent(in) :: point(2)           !! natural coordinates
      real(wp), intent(out) :: value(max_element_nodes)   !! 0 beyond the nodes of `kind`
      real(wp), intent(out) :: slope(2, max_element_nodes)   !! by natural coordinates
      real(wp), parameter :: corner(2, 4) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, &
         1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp], [2, 4])
      integer :: i

      value = 0.0_wp
      slope = 0.0_wp
      select case (element_kinds(kind)%name)
      case ("CPE3")
         value(:3) = [1.0_wp - point(1) - point(2), point(1), point(2)]
         slope(:, :3) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
      case ("CPE4")
         do i = 1, 4
            value(i) = 0.25_wp*(1.0_wp + corner(1, i)*point(1))*(1.0_wp + corner(2, i)*point(2))
            slope(1, i) = 0.25_wp*corner(1, i)*(1.0_wp + corner(2, i)*point(2))
            slope(2, i) = 0.25_wp*corner(2, i)*(1.0_wp + corner(1, i)*point(1))
         end do
      end select
   end subroutine shape_values

end module emcon_shape
