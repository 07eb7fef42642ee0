!> Laws of thin sheets against the same laws in three dimensions.
module test_law_thin
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_response_plane, law_response_t, law_t
   use emcon_law_registry, only : law_create, law_make_thin, law_row, law_row_t, n_constant, &
      n_law_row
   use emcon_law_space, only : law_response_space, space_response_t
   use emcon_law_thin_plane, only : thin_law
   use emcon_text, only : to_text
   use kind_rows, only : law_name
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_law_thin

   real(wp), parameter :: eps = epsilon(1.0_wp), none(3) = 0.0_wp
   !> A dozen roundings of each of two ends, of moduli up to five times the shear modulus.
   real(wp), parameter :: tol = 256.0_wp*eps
   !> Constants of the order of 1.
   real(wp), parameter :: ratio = 0.3_wp

contains

   subroutine collect_law_thin(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("as in three dimensions without normal stress", test_space), &
         test_case_t("identity at any increment", test_identity), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("linear: closed form and as any law", test_linear), &
         test_case_t("small strains keep their digits", test_small), &
         test_case_t("Ogden's law is refused", test_refused)]
   end subroutine collect_law_thin

   !> Row `i` in bulk and as a sheet, not allocated where there is none.
   subroutine make(i, bulk, thin)
      integer, intent(in) :: i
      class(law_t), allocatable, intent(out) :: bulk, thin
      type(error_t), allocatable :: raised
      real(wp) :: constant(n_constant(law_row(i)))
      type(law_row_t) :: row

      row = law_row(i)
      constant = 1.0_wp
      where (row%constant(:size(constant)) == "nu") constant = ratio
      where (row%constant(:size(constant)) == "C20") constant = -0.1_wp
      where (row%constant(:size(constant)) == "alpha2") constant = -2.5_wp
      call law_create(row%code, constant, bulk, raised)
      call law_make_thin(bulk, thin)
   end subroutine make

   !> The rows that have one.
   pure logical function has_thin(i)
      integer, intent(in) :: i

      has_thin = index(law_name(i), "ogden") == 0
   end function has_thin

   !> The sheet thins by what `hold` says; there the law in space has its energy and its stress.
   subroutine test_space(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin
      type(law_points_t) :: points
      type(space_response_t) :: space
      type(law_response_t) :: plane
      real(wp) :: e(3, 1), x
      real(wp), parameter :: still(6) = 0.0_wp
      integer :: i, k

      do i = 1, n_law_row()
         if (.not. has_thin(i)) cycle
         call make(i, bulk, thin)
         do k = 0, 9
            call shake(e, 0.3_wp*10.0_wp**(-k/3))
            call law_response_plane(thin, e(:, 1), none, plane)
            points%strain = spread(e(:, 1), 1, size(points%strain, 1))
            call thin%hold(points)
            x = 0.5_wp*(points%stretch_33(1) - 1.0_wp)*(points%stretch_33(1) + 1.0_wp)
            call law_response_space(bulk, [e(1:2, 1), x, e(3, 1), 0.0_wp, 0.0_wp], still, space)
            call check_near(error, space%energy, plane%energy, tol, 1.0_wp, name_of(i, "energy"))
            call check_near(error, space%stress([1, 2, 4]), plane%stress, tol, 1.0_wp, &
               name_of(i, "stress"))
            call check_near(error, space%stress(3), 0.0_wp, tol, 1.0_wp, name_of(i, "normal"))
            call check_near(error, points%stress(1, :), plane%stress, tol, 1.0_wp, &
               name_of(i, "held"))
            call check_near(error, points%stress_33(1), 0.0_wp, 0.0_wp, 1.0_wp, &
               name_of(i, "held normal"))
         end do
         if (allocated(error)) return
      end do
   end subroutine test_space

   pure function name_of(i, what) result(text)
      integer, intent(in) :: i
      character(len=*), intent(in) :: what
      character(len=len_trim(law_name(i)) + 2 + len(what)) :: text

      text = trim(law_name(i)) // ": " // what
   end function name_of

   !> S.dE = W1 - W0, from increments of the size of the strain to those that are round-off of it.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin
      type(law_response_t) :: start, step
      real(wp) :: e(3, 2)
      integer :: i, k

      do i = 1, n_law_row()
         if (.not. has_thin(i)) cycle
         call make(i, bulk, thin)
         do k = 0, 15
            call shake(e, 0.3_wp)
            e(:, 2) = e(:, 2)*10.0_wp**(-k)
            call law_response_plane(thin, e(:, 1), none, start)
            call law_response_plane(thin, e(:, 1), e(:, 2), step)
            call check_near(error, dot_product(step%stress, e(:, 2)), step%energy - start%energy, &
               tol, max(step%energy, start%energy), name_of(i, "1e-" // to_text(k)))
         end do
         if (allocated(error)) return
      end do
   end subroutine test_identity

   !> Central differences over four points, of step h = eps^(0.3): an error of order h^4 = eps^(1.2)
   !> and one of eps/h = eps^(0.7).
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin
      type(law_response_t) :: step, near(2), far(2)
      real(wp) :: e(3, 2), way(3), h
      integer :: a, i, k

      h = eps**0.3_wp
      do i = 1, n_law_row()
         if (.not. has_thin(i)) cycle
         call make(i, bulk, thin)
         do k = 0, 5
            call shake(e, 0.3_wp)
            e(:, 2) = merge(e(:, 2)*10.0_wp**(-k), none, k < 5)
            call law_response_plane(thin, e(:, 1), e(:, 2), step)
            do a = 1, 3
               way = 0.0_wp
               way(a) = h
               call law_response_plane(thin, e(:, 1), e(:, 2) + way, near(1))
               call law_response_plane(thin, e(:, 1), e(:, 2) - way, near(2))
               call law_response_plane(thin, e(:, 1), e(:, 2) + 2.0_wp*way, far(1))
               call law_response_plane(thin, e(:, 1), e(:, 2) - 2.0_wp*way, far(2))
               call check_near(error, step%tangent(:, a), (8.0_wp*(near(1)%stress &
                  - near(2)%stress) - (far(1)%stress - far(2)%stress))/(12.0_wp*h), &
                  800.0_wp*eps**0.7_wp, 1.0_wp, name_of(i, "increment " // to_text(k)))
            end do
         end do
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> E/(1 - nu^2), nu E/(1 - nu^2), G; by the rule for any law the same.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin, other
      type(law_response_t) :: step, like
      real(wp) :: e(3, 2), moduli(3, 3)
      integer :: k

      moduli = reshape([1.0_wp, ratio, 0.0_wp, ratio, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         0.5_wp*(1.0_wp - ratio)], [3, 3])/(1.0_wp - ratio**2)
      call make(1, bulk, thin)
      call thin_law(bulk, other)
      do k = 1, 10
         call shake(e, 0.2_wp)
         call law_response_plane(thin, e(:, 1), e(:, 2), step)
         call law_response_plane(other, e(:, 1), e(:, 2), like)
         call check_near(error, step%stress, matmul(moduli, e(:, 1) + 0.5_wp*e(:, 2)), tol, &
            1.0_wp, "stress")
         call check_near(error, step%tangent, 0.5_wp*moduli, tol, 1.0_wp, "tangent")
         call check_near(error, like%stress, step%stress, tol, 1.0_wp, "stress as of any law")
         call check_near(error, like%tangent, step%tangent, tol, 1.0_wp, "tangent as of any law")
         call check_near(error, like%energy, step%energy, tol, 1.0_wp, "energy as of any law")
      end do
   end subroutine test_linear

   !> At strains of 1e-6 to 1e-12 the law is linear but for terms of that order.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin
      type(law_response_t) :: rest, step
      real(wp) :: e(3, 2), size_of
      integer :: i, k

      do i = 1, n_law_row()
         if (.not. has_thin(i)) cycle
         call make(i, bulk, thin)
         call law_response_plane(thin, none, none, rest)
         do k = 6, 12, 3
            size_of = 10.0_wp**(-k)
            call shake(e, size_of)
            call law_response_plane(thin, e(:, 1), e(:, 2), step)
            call check_near(error, step%stress, 2.0_wp*matmul(rest%tangent, e(:, 1) &
               + 0.5_wp*e(:, 2)), 100.0_wp*size_of + tol, size_of, name_of(i, "1e-" // to_text(k)))
         end do
         if (allocated(error)) return
      end do
   end subroutine test_small

   subroutine test_refused(error)
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: bulk, thin
      integer :: i

      do i = 1, n_law_row()
         call make(i, bulk, thin)
         call check_true(error, allocated(thin) .eqv. has_thin(i), name_of(i, "has a sheet"))
      end do
   end subroutine test_refused

end module test_law_thin
