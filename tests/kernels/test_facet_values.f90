!> Pressures at nodes by forces on facets, and forces at nodes divided among facets.
module test_facet_values
   use check, only : check_near, test_case_t
   use emcon_element_kind, only : find_element_kind
   use emcon_errors, only : error_t
   use emcon_facet_values, only : facets_point_area, facets_pressures, facets_share
   use emcon_facet_split, only : facet_split_centre
   use emcon_facets, only : facets_init, facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_facet_values

   !> Sums over some dozen nodes.
   real(wp), parameter :: tol = 100.0_wp*epsilon(1.0_wp)
   integer, parameter :: none(0) = [integer ::]

contains

   subroutine collect_facet_values(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("pressures at corners", test_corners), &
         test_case_t("pressures with nodes between corners", test_between), &
         test_case_t("shares on a cube", test_shares)]
   end subroutine collect_facet_values

   !> The skin of a box of two by one by one cells.
   subroutine box(facets, scene, error)
      type(facets_t), intent(out) :: facets
      type(scene_t), intent(out) :: scene
      type(error_t), allocatable, intent(out) :: error

      call space_begin(scene)
      call add_box(scene, "C3D8", [0.0_wp, 0.0_wp, 0.0_wp], [2.0_wp, 1.0_wp, 1.0_wp], [2, 1, 1])
      call facets_init(facets, scene, skin(scene), error)
   end subroutine box

   !> The areas at all points that a pressure along `normal` acts on.
   subroutine pressed(facets, middle, x, normal, area)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: middle(:)
      real(wp), intent(in) :: x(:, :), normal(:)
      real(wp), allocatable, intent(out) :: area(:)
      integer :: i

      area = [(facets_point_area(facets, middle, i, normal, x, 0.0_wp*x), &
         i = 1, size(facets%node) + size(middle))]
   end subroutine pressed

   !> The lower side of a box has a quarter of each of its two cells at each of their corners, and
   !> its other sides have nothing of a pressure from below.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: area(:), pressure(:)
      integer :: i

      call box(facets, scene, error)
      if (allocated(error)) return
      call pressed(facets, none, scene%x, [0.0_wp, 0.0_wp, -1.0_wp], area)
      call check_near(error, area, [0.25_wp, 0.5_wp, 0.25_wp, 0.25_wp, 0.5_wp, 0.25_wp, &
         (0.0_wp, i = 1, 6)], tol, 1.0_wp, "areas")
      allocate(pressure(size(area)))
      call facets_pressures(facets, none, [(i, i = 1, size(area))], 3.0_wp*area, area, pressure)
      call check_near(error, pressure, merge(3.0_wp, 0.0_wp, area > 0.0_wp), tol, 3.0_wp, "uniform")
   end subroutine test_corners

   !> Pressure 2 on a face of eight nodes: its corners and the others with 1/12 of it and the centre
   !> with 1/3, or without corners 5/24 and 1/6; and of six nodes. In each way the nodes of the face
   !> get the loads of its element.
   subroutine test_between(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: third = 1.0_wp/3.0_wp, twelfth = 1.0_wp/12.0_wp

      call of_kind("C3D20", [twelfth, twelfth, third], [-twelfth, third])
      call of_kind("C3D20", [0.0_wp, 5.0_wp/24.0_wp, 1.0_wp/6.0_wp], [-twelfth, third])
      call of_kind("C3D10", [1.0_wp/9.0_wp, 1.0_wp/9.0_wp, third], [0.0_wp, third])
      call of_kind("C3D10", [0.0_wp, third, 0.0_wp], [0.0_wp, third])

   contains

      subroutine of_kind(name, part, load)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: part(3)         !! on a corner, a node between, the centre
         real(wp), intent(in) :: load(2)         !! of the element, on a corner, a node between
         type(facets_t) :: facets
         type(scene_t) :: scene
         real(wp), allocatable :: area(:), force(:), pressure(:)
         real(wp) :: normal(3), whole
         integer :: i, n

         if (allocated(error)) return
         call one_face(facets, scene, name, error)
         if (allocated(error)) return
         normal = facets_normal(facets, 1, scene%x, 0.0_wp*scene%x)
         whole = sqrt(dot_product(normal, normal))
         call pressed(facets, [1], scene%x, normal/whole, area)
         call check_near(error, sum(area), whole, tol, whole, name // " all of the area")
         n = size(area)
         allocate(force(n), pressure(n))
         associate (corners => facets%corner(1:n - 1:2, 1), others => facets%corner(2:n - 1:2, 1))
            force(corners) = 2.0_wp*part(1)*whole
            force(others) = 2.0_wp*part(2)*whole
            force(n) = 2.0_wp*part(3)*whole
            associate (on => part(:2) + part(3)*facet_split_weights(n - 1))
               call check_near(error, on, load, tol, 1.0_wp, name // " loads")
            end associate
         end associate
         call facets_pressures(facets, [1], [(i, i = 1, n)], force, area, pressure)
         call check_near(error, pressure, 0.0_wp*area + 2.0_wp, tol, 2.0_wp, name // " uniform")
      end subroutine of_kind

      !> What a corner and a node between have of the virtual centre.
      pure function facet_split_weights(n) result(weight)
         integer, intent(in) :: n
         real(wp) :: weight(2), all_weights(n)

         all_weights = facet_split_centre(n)
         weight = all_weights(:2)
      end function facet_split_weights

   end subroutine test_between

   !> The first face of an element with straight edges.
   subroutine one_face(facets, scene, name, error)
      type(facets_t), intent(out) :: facets
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: cube(3, 8) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
         1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, &
         1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp], [3, 8])
      integer, parameter :: edge(2, 12) = reshape([1, 2, 2, 3, 3, 4, 4, 1, 5, 6, 6, 7, 7, 8, 8, 5, &
         1, 5, 2, 6, 3, 7, 4, 8], [2, 12])
      integer, parameter :: side(2, 6) = reshape([1, 2, 2, 3, 3, 1, 1, 4, 2, 4, 3, 4], [2, 6])
      integer, parameter :: corner(4) = [1, 2, 4, 5]
      type(surface_t) :: surface
      integer :: i

      call space_begin(scene)
      if (name == "C3D20") then
         scene%x = reshape([cube, 0.5_wp*(cube(:, edge(1, :)) + cube(:, edge(2, :)))], [3, 20])
      else
         scene%x = reshape([cube(:, corner), 0.5_wp*(cube(:, corner(side(1, :))) &
            + cube(:, corner(side(2, :))))], [3, 10])
      end if
      scene%element%node = reshape([(i, i = 1, size(scene%x, 2))], [size(scene%x, 2), 1])
      scene%element%kind = [find_element_kind(scene%element%kinds, name)]
      scene%node%label = [(i, i = 1, size(scene%x, 2))]
      scene%element%label = [1]
      surface%name = "FACE"
      surface%element = [1]
      surface%face = [1]
      call facets_init(facets, scene, surface, error)
   end subroutine one_face

   !> A corner of a box: a push along x belongs to the face that it is normal to, one from all sides
   !> to all; a pull is divided likewise, a force of 0 by areas. Shares at a node are 1 in sum.
   subroutine test_shares(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: normal(:, :), force(:, :), share(:, :), whole(:)
      integer :: f, k

      call box(facets, scene, error)
      if (allocated(error)) return
      allocate(normal(3, facets%n_facet), share(4, facets%n_facet))
      do f = 1, facets%n_facet
         normal(:, f) = facets_normal(facets, f, scene%x, 0.0_wp*scene%x)
      end do
      allocate(force(3, size(facets%node)), whole(size(facets%node)))
      force = 0.0_wp
      force(:, 1) = [3.0_wp, 0.0_wp, 0.0_wp]     ! onto the side x = 0 of node 1, at the origin
      force(:, 3) = [1.0_wp, 0.0_wp, 0.0_wp]     ! off the side x = 2
      force(:, 2) = [0.0_wp, 2.0_wp, 0.0_wp]     ! onto both faces of y = 0 at the middle
      call facets_share(facets%corner, normal, force, share)
      whole = 0.0_wp
      do f = 1, facets%n_facet
         do k = 1, 4
            associate (node => facets%corner(k, f))
               whole(node) = whole(node) + share(k, f)
               if (node == 1 .or. node == 3) call check_near(error, [share(k, f)], &
                  [merge(1.0_wp, 0.0_wp, abs(normal(1, f)) > 0.5_wp)], tol, 1.0_wp, "one face")
               if (node == 2) call check_near(error, [share(k, f)], [merge(0.5_wp, 0.0_wp, &
                  normal(2, f) < -0.5_wp)], tol, 1.0_wp, "two of a plane")
            end associate
         end do
      end do
      call check_near(error, whole, 0.0_wp*whole + 1.0_wp, tol, 1.0_wp, "all of it")
   end subroutine test_shares

end module test_facet_values
