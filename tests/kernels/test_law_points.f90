!> Laws at points side by side: what they answer one by one, whatever stands in the other lanes.
module test_law_points
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_law, only : law_points_t, law_response_plane, law_response_t, law_t, n_lane
   use emcon_law_registry, only : law_create, law_row, law_row_t, n_constant, n_law_row
   use emcon_text, only : to_text
   use kind_rows, only : law_name
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_law_points

   !> As in test_law, for either way of computing.
   real(wp), parameter :: tol = 80.0_wp*epsilon(1.0_wp)
   !> Energies are up to four times the square of the strains that they are told per.
   real(wp), parameter :: energy_tol = merge(1.0_wp, 4.0_wp, wp == dp)*tol

contains

   subroutine collect_law_points(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("as one by one", test_one_by_one), &
         test_case_t("no lane knows of another", test_lanes), &
         test_case_t("held strains", test_held)]
   end subroutine collect_law_points

   !> Constants of the order of 1, whatever they mean.
   subroutine make_law(i, law)
      integer, intent(in) :: i                   !! row
      class(law_t), allocatable, intent(out) :: law
      type(error_t), allocatable :: raised
      real(wp) :: constant(n_constant(law_row(i)))
      type(law_row_t) :: row

      row = law_row(i)
      constant = 1.0_wp
      where (row%constant(:size(constant)) == "nu") constant = 0.3_wp
      where (row%constant(:size(constant)) == "C20") constant = -0.1_wp
      where (row%constant(:size(constant)) == "alpha2") constant = -2.5_wp
      call law_create(row%code, constant, law, raised)
   end subroutine make_law

   !> Strains of the size `extent`, increments from that size down.
   subroutine draw(extent, points)
      real(wp), intent(in) :: extent
      type(law_points_t), intent(inout) :: points
      real(wp) :: values(2, 3)
      integer :: l

      do l = 1, n_lane
         call shake(values, extent)
         points%strain(l, :) = values(1, :)
         points%dstrain(l, :) = values(2, :)*10.0_wp**(-2*mod(l, 3))
      end do
   end subroutine draw

   !> From strains that are round-off of 1 to those beyond the reach of series: there to the bit.
   subroutine test_one_by_one(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(law_points_t) :: points
      type(law_response_t) :: one
      real(wp) :: extent
      integer :: i, k, l

      do i = 1, n_law_row()
         call make_law(i, law)
         do k = 1, 40
            extent = 0.15_wp
            if (mod(k, 4) == 0) extent = 10.0_wp**(-k/4)
            call draw(extent, points)
            if (mod(k, 4) == 1) points%strain(k/4 - 8*(k/32) + 1, :2) = 3.0_wp
            call law%respond(points, .true.)
            do l = 1, n_lane
               call law_response_plane(law, points%strain(l, :), points%dstrain(l, :), one)
               if (points%strain(l, 1) > 2.0_wp) extent = 30.0_wp
               call check_near(error, points%energy(l), one%energy, energy_tol, extent**2, &
                  law_name(i) // ": energy in lane " // to_text(l))
               call check_near(error, points%stress(l, :), one%stress, tol, 4.0_wp*extent, &
                  law_name(i) // ": stress")
               call check_near(error, points%tangent(l, :, :), one%tangent, tol, &
                  4.0_wp*maxval(abs(one%tangent)), law_name(i) // ": tangent")
            end do
         end do
      end do
   end subroutine test_one_by_one

   !> What a strain that stays answers, with the stress normal to the plane, is that of one by one.
   subroutine test_held(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(law_points_t) :: points
      type(law_response_t) :: one
      real(wp) :: extent
      integer :: i, k, l

      do i = 1, n_law_row()
         call make_law(i, law)
         do k = 1, 20
            extent = 0.15_wp
            if (mod(k, 4) == 0) extent = 10.0_wp**(-k/4)
            call draw(extent, points)
            if (mod(k, 4) == 1) points%strain(k/4 + 1, :2) = 3.0_wp
            points%dstrain = 0.0_wp
            call law%hold(points)
            do l = 1, n_lane
               call law_response_plane(law, points%strain(l, :), points%dstrain(l, :), one)
               if (points%strain(l, 1) > 2.0_wp) extent = 30.0_wp
               call check_near(error, points%stress(l, :), one%stress, tol, 4.0_wp*extent, &
                  law_name(i) // ": stress in lane " // to_text(l))
               call check_near(error, points%stress_33(l), one%stress_33, tol, 4.0_wp*extent, &
                  law_name(i) // ": normal stress in lane " // to_text(l))
            end do
         end do
      end do
   end subroutine test_held

   !> The same bits in each lane, with and without tangent, beside strains of any kind.
   subroutine test_lanes(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: law
      type(law_points_t) :: points, others
      integer :: i, k, l, m

      do i = 1, n_law_row()
         call make_law(i, law)
         do k = 1, 5
            call draw(0.12_wp, points)
            call law%respond(points, .true.)
            do l = 1, n_lane
               m = 1 + mod(l + k, n_lane)
               call draw(0.12_wp, others)
               others%strain(::2, :2) = others%strain(::2, :2) + 0.6_wp
               others%strain(m, :) = points%strain(l, :)
               others%dstrain(m, :) = points%dstrain(l, :)
               call law%respond(others, mod(l, 2) == 0)
               call check_true(error, same(others%energy(m), points%energy(l)) &
                  .and. all(same(others%stress(m, :), points%stress(l, :))), &
                  law_name(i) // ": bits in lane " // to_text(m))
               if (mod(l, 2) == 0) call check_true(error, all(same(others%tangent(m, :, :), &
                  points%tangent(l, :, :))), law_name(i) // ": bits of the tangent")
            end do
         end do
      end do
   end subroutine test_lanes

   elemental logical function same(a, b)
      real(wp), intent(in) :: a, b

      same = abs(a - b) <= 0.0_wp
   end function same

end module test_law_points
