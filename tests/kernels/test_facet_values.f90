!> Pressures at nodes by forces on facets, and forces at nodes divided among facets.
module test_facet_values
   use check, only : check_near, check_true, test_case_t
   use emcon_element_kind, only : find_element_kind
   use emcon_errors, only : error_t
   use emcon_facet_values, only : facets_pressed_areas, facets_pressures, facets_share
   use emcon_facets, only : facets_init, facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use space_scenes, only : add_box, skin, space_begin
   implicit none
   private
   public :: collect_facet_values

   !> Sums over some dozen nodes.
   real(wp), parameter :: tol = 100.0_wp*epsilon(1.0_wp)

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

   !> Equal parts of the areas of facets.
   subroutine equal_parts(facets, x, area)
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :)
      real(wp), allocatable, intent(out) :: area(:)
      integer :: f, n

      allocate(area(size(facets%node)), source=0.0_wp)
      do f = 1, facets%n_facet
         n = count(facets%corner(:, f) > 0)
         associate (node => facets%corner(:n, f), normal => facets_normal(facets, f, x, 0.0_wp*x))
            area(node) = area(node) + sqrt(dot_product(normal, normal))/real(n, wp)
         end associate
      end do
   end subroutine equal_parts

   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(facets_t) :: facets
      real(wp), allocatable :: area(:), same(:), pressure(:)

      call box(facets, scene, error)
      if (allocated(error)) return
      call equal_parts(facets, scene%x, area)
      same = area
      call facets_pressed_areas(facets, scene%x, 0.0_wp*scene%x, area)
      call check_near(error, area, same, 0.0_wp, 1.0_wp, "nothing between corners")
      allocate(pressure(size(area)))
      call facets_pressures(facets, 3.0_wp*area, area, pressure)
      call check_near(error, pressure, 0.0_wp*area + 3.0_wp, tol, 3.0_wp, "uniform")
   end subroutine test_corners

   !> Faces of eight nodes: pressure 2 of their corners with -1/12 of a face and of the others with
   !> 1/3; nothing acts at corners, and a quarter at each of the others; and of six nodes.
   subroutine test_between(error)
      type(error_t), allocatable, intent(out) :: error

      call of_kind("C3D20", [-1.0_wp/12.0_wp, 1.0_wp/3.0_wp])
      call of_kind("C3D20", [0.0_wp, 0.25_wp])
      call of_kind("C3D10", [0.0_wp, 1.0_wp/3.0_wp])

   contains

      subroutine of_kind(name, part)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: part(2)         !! of a face, of a corner and of a node between
         type(facets_t) :: facets
         type(scene_t) :: scene
         real(wp), allocatable :: area(:), force(:), pressure(:)
         real(wp) :: normal(3), whole
         integer :: f, n

         if (allocated(error)) return
         call one_element(facets, scene, name, error)
         if (allocated(error)) return
         call equal_parts(facets, scene%x, area)
         whole = sum(area)
         allocate(force(size(area)), pressure(size(area)))
         force = 0.0_wp
         do f = 1, facets%n_facet
            n = count(facets%corner(:, f) > 0)
            normal = facets_normal(facets, f, scene%x, 0.0_wp*scene%x)
            associate (corners => facets%corner(1:n:2, f), others => facets%corner(2:n:2, f), &
                  load => 2.0_wp*sqrt(dot_product(normal, normal)))
               force(corners) = force(corners) + part(1)*load
               force(others) = force(others) + part(2)*load
            end associate
         end do
         call facets_pressed_areas(facets, scene%x, 0.0_wp*scene%x, area)
         call check_near(error, [sum(area)], [whole], tol, whole, name // " all of the area")
         call check_true(error, count(area > 0.0_wp) == size(area) - count_corners(name), &
            name // " none at corners")
         call facets_pressures(facets, force, area, pressure)
         call check_near(error, pressure, 0.0_wp*area + 2.0_wp, tol, 2.0_wp, name // " uniform")
      end subroutine of_kind

   end subroutine test_between

   pure integer function count_corners(name)
      character(len=*), intent(in) :: name

      count_corners = merge(8, 4, name == "C3D20")
   end function count_corners

   !> The skin of one element with straight edges.
   subroutine one_element(facets, scene, name, error)
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
      call facets_init(facets, scene, skin(scene), error)
   end subroutine one_element

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
