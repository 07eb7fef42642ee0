!> Pressure on faces in space: its resultant on a curved face, and its derivative.
module test_press_face
   use check, only : check_near, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_pressure_space, only : press_face, press_face_stiffness
   use emcon_shape, only : shape_table_t
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_press_face

   integer, parameter :: n = 4
   real(wp), parameter :: pressure = 1.5_wp
   real(wp), parameter :: corner(2, n) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, &
      1.0_wp, -1.0_wp, 1.0_wp], [2, n])

contains

   subroutine collect_press_face(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("resultant by the rim", test_resultant), &
         test_case_t("derivative by differences", test_stiffness)]
   end subroutine collect_press_face

   !> A quadrilateral at two by two points, and one whose corners lie anywhere.
   subroutine make_face(table, place)
      type(shape_table_t), intent(out) :: table
      real(wp), intent(out) :: place(3, n)
      integer :: i, k

      table%n_node = n
      table%n_gp = n
      table%point = corner/sqrt(3.0_wp)
      table%weight = spread(1.0_wp, 1, n)
      allocate(table%value(n, n), table%slope(2, n, n))
      do k = 1, n
         do i = 1, n
            associate (along => 1.0_wp + corner(1, i)*table%point(1, k), &
                  across => 1.0_wp + corner(2, i)*table%point(2, k))
               table%value(i, k) = 0.25_wp*along*across
               table%slope(:, i, k) = 0.25_wp*[corner(1, i)*across, corner(2, i)*along]
            end associate
         end do
      end do
      call shake(place, 0.4_wp)
      place(:2, :) = place(:2, :) + corner
   end subroutine make_face

   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)

      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross

   !> The vector area of a bilinear face is half the product of its diagonals, however it is curved;
   !> other nodes get nothing.
   subroutine test_resultant(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_table_t) :: table
      real(wp) :: place(3, n), force(3, n + 2)

      call make_face(table, place)
      force = 7.0_wp
      call press_face([2, 6, 3, 1], table, pressure, place, force)
      call check_near(error, sum(force(:, [2, 6, 3, 1]) - 7.0_wp, 2), 0.5_wp*pressure*cross( &
         place(:, 3) - place(:, 1), place(:, 4) - place(:, 2)), 256.0_wp*epsilon(1.0_wp), 10.0_wp, &
         "resultant")
      call check_near(error, force(:, 4:5), 0.0_wp*force(:, 4:5) + 7.0_wp, 0.0_wp, 1.0_wp, "others")
   end subroutine test_resultant

   !> Forces are of the second degree in each place: central differences are exact but for rounding.
   subroutine test_stiffness(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: d = 0.125_wp
      type(shape_table_t) :: table
      real(wp) :: place(3, n), moved(3, n), force(3, n, 2)
      real(dp) :: value(144), side(144), none(144)
      integer :: slot(12, 12), i, j, s

      call make_face(table, place)
      slot = reshape([(i, i = 1, 144)], [12, 12])
      value = 0.0_dp
      none = 0.0_dp
      side = 0.0_dp
      call press_face_stiffness(table, pressure, place, slot, value, none)
      call press_face_stiffness(table, pressure, place, -slot, none, side)
      do j = 1, 12
         force = 0.0_wp
         do s = 1, 2
            moved = place
            moved(1 + mod(j - 1, 3), (j + 2)/3) = moved(1 + mod(j - 1, 3), (j + 2)/3) &
               + (2*s - 3)*d
            call press_face([1, 2, 3, 4], table, pressure, moved, force(:, :, s))
         end do
         associate (expected => reshape(force(:, :, 1) - force(:, :, 2), [12])/(2.0_wp*d))
            call check_near(error, real(value(slot(:, j)), wp), expected, 1.0e4_wp*max( &
               epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), 1.0_wp, "matrix")
            call check_near(error, real(side(slot(:, j)), wp), expected, 1.0e4_wp*max( &
               epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), 1.0_wp, "beside it")
         end associate
      end do
   end subroutine test_stiffness

end module test_press_face
