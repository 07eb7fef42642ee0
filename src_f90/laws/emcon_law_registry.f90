!> The registry of constitutive laws: the only module that knows their kinds. A new law is one file,
!> one row of `law_rows` and one case of `law_create`.
module emcon_law_registry
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_coupled_neo_hooke, only : law_coupled_neo_hooke_t
   use emcon_law_linear, only : law_linear_t
   use emcon_law_mooney_rivlin, only : law_mooney_rivlin_t
   use emcon_law_neo_hooke, only : law_neo_hooke_t
   use emcon_law_ogden, only : law_ogden_t
   use emcon_law_thin_plane, only : thin_law
   use emcon_law_yeoh, only : law_yeoh_t
   use emcon_text, only : to_text, to_upper
   implicit none
   private
   public :: law_row_t, law_rows, law_titles, law_variants, find_law_row, n_constant, law_create, &
      law_linearise, law_make_thin
   public :: law_linear, law_neo_hooke, law_coupled_neo_hooke, law_given, law_mooney_rivlin, &
      law_yeoh, law_ogden

   !> Codes. `law_linear` is linear elasticity, under NLGEOM St. Venant-Kirchhoff; `law_given` is
   !> given by a program.
   integer, parameter :: law_linear = 1, law_neo_hooke = 2, law_coupled_neo_hooke = 3, &
      law_given = 4, law_mooney_rivlin = 5, law_yeoh = 6, law_ogden = 7

   integer, parameter :: max_constant = 9

   !> One law, at one order if it has several: what chooses it, and its constants in deck order.
   type :: law_row_t
      character(len=18) :: name                  !! in texts; in capitals what decks may write
      character(len=12) :: keyword
      character(len=16) :: variant               !! parameter without blanks; empty: none
      integer :: order                           !! N=; 0: has none
      integer :: code
      character(len=6) :: constant(max_constant) !! names; empty behind the last
   end type law_row_t

   type(law_row_t), parameter :: law_rows(*) = [ &
      law_row_t("linear", "ELASTIC", "", 0, law_linear, [character(len=6) :: "E", "nu", &
         "", "", "", "", "", "", ""]), &
      law_row_t("neo hooke", "HYPERELASTIC", "NEOHOOKE", 0, law_neo_hooke, [character(len=6) :: &
         "C10", "D1", "", "", "", "", "", "", ""]), &
      law_row_t("coupled neo hooke", "HYPERELASTIC", "COUPLEDNEOHOOKE", 0, &
         law_coupled_neo_hooke, [character(len=6) :: "E", "nu", "", "", "", "", "", "", ""]), &
      law_row_t("mooney-rivlin", "HYPERELASTIC", "MOONEY-RIVLIN", 0, law_mooney_rivlin, &
         [character(len=6) :: "C10", "C01", "D1", "", "", "", "", "", ""]), &
      law_row_t("yeoh", "HYPERELASTIC", "YEOH", 0, law_yeoh, [character(len=6) :: &
         "C10", "C20", "C30", "D1", "D2", "D3", "", "", ""]), &
      law_row_t("ogden 1", "HYPERELASTIC", "OGDEN", 1, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "D1", "", "", "", "", "", ""]), &
      law_row_t("ogden 2", "HYPERELASTIC", "OGDEN", 2, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "mu2", "alpha2", "D1", "D2", "", "", ""]), &
      law_row_t("ogden 3", "HYPERELASTIC", "OGDEN", 3, law_ogden, [character(len=6) :: &
         "mu1", "alpha1", "mu2", "alpha2", "mu3", "alpha3", "D1", "D2", "D3"])]

contains

   !> Number of constants of a law.
   pure integer function n_constant(row)
      type(law_row_t), intent(in) :: row

      n_constant = count(row%constant /= "")
   end function n_constant

   !> The parameters that choose among the laws of a keyword: ",A,B", ready for its list.
   pure subroutine law_variants(keyword, list)
      character(len=*), intent(in) :: keyword    !! without asterisk, upper case
      character(len=:), allocatable, intent(out) :: list   !! empty: none
      integer :: i

      list = ""
      do i = 1, size(law_rows)
         if (law_rows(i)%keyword /= keyword .or. law_rows(i)%variant == "") cycle
         if (law_rows(i)%order > 1) cycle
         list = list // "," // trim(law_rows(i)%variant)
      end do
   end subroutine law_variants

   !> The same as texts name them: "A, B".
   pure subroutine law_titles(keyword, list)
      character(len=*), intent(in) :: keyword    !! without asterisk, upper case
      character(len=:), allocatable, intent(out) :: list   !! empty: none
      integer :: i

      list = ""
      do i = 1, size(law_rows)
         if (law_rows(i)%keyword /= keyword .or. law_rows(i)%variant == "") cycle
         if (law_rows(i)%order > 1) cycle
         if (list /= "") list = list // ", "
         list = list // to_upper(law_rows(i)%name(:verify(law_rows(i)%name, " 123456789", .true.)))
      end do
   end subroutine law_titles

   !> Row of a law of the `order`; an order that there is not: 0.
   pure integer function find_law_row(keyword, variant, order) result(i)
      character(len=*), intent(in) :: keyword, variant   !! upper case, `variant` without blanks
      integer, intent(in) :: order               !! not looked at for a law that has none

      do i = size(law_rows), 1, -1
         if (law_rows(i)%keyword /= keyword .or. law_rows(i)%variant /= variant) cycle
         if (law_rows(i)%order == 0 .or. law_rows(i)%order == order) return
      end do
   end function find_law_row

   !> A law with its constants; err_input with what is wrong with one.
   subroutine law_create(code, constant, law, error)
      integer, intent(in) :: code                !! one of `law_`, but not `law_given`
      real(wp), intent(in) :: constant(:)        !! as the row says
      class(law_t), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: fault

      select case (code)
      case (law_linear)
         allocate(law_linear_t :: law)
      case (law_neo_hooke)
         allocate(law_neo_hooke_t :: law)
      case (law_coupled_neo_hooke)
         allocate(law_coupled_neo_hooke_t :: law)
      case (law_mooney_rivlin)
         allocate(law_mooney_rivlin_t :: law)
      case (law_yeoh)
         allocate(law_yeoh_t :: law)
      case (law_ogden)
         allocate(law_ogden_t :: law)
      case default
         call raise(error, err_input, "there is no law with the code " // to_text(code))
         return
      end select
      if (.not. any(law_rows%code == code .and. count_constants() == size(constant))) then
         call raise(error, err_input, "a law got too many or too few constants")
         return
      end if
      call law%take(constant, fault)
      if (fault /= "") call raise(error, err_input, fault)
   end subroutine law_create

   !> Linear elasticity with the stiffness that `law` has at rest.
   subroutine law_linearise(law, linear)
      class(law_t), intent(in) :: law
      class(law_t), allocatable, intent(out) :: linear
      real(wp), parameter :: rest(3) = 0.0_wp
      type(law_response_t) :: response
      type(law_linear_t) :: plain

      select type (law)
      type is (law_linear_t)
         plain = law
      class default
         call law_response_plane(law, rest, rest, response)
         plain%mu = law%shear                    ! the tangent is by the end of a step of no size
         plain%lam = 2.0_wp*(response%tangent(1, 1) - plain%mu)
         plain%density = law%density
         plain%shear = plain%mu
         plain%has_volume = .false.
      end select
      allocate(linear, source=plain)
   end subroutine law_linearise

   !> The law of a thin sheet, in plane stress.
   subroutine law_make_thin(law, thin)
      class(law_t), intent(in) :: law
      class(law_t), allocatable, intent(out) :: thin   !! not allocated: of plane strain alone

      type(law_linear_t) :: plain

      select type (law)
      type is (law_linear_t)
         plain = law
         call plain%make_thin()
         allocate(thin, source=plain)
      type is (law_ogden_t)                      ! its stretches are those of E33 = 0
         return
      class default
         call thin_law(law, thin)
      end select
   end subroutine law_make_thin

   !> Number of constants of each row.
   pure function count_constants() result(n)
      integer :: n(size(law_rows))
      integer :: i

      do i = 1, size(law_rows)
         n(i) = n_constant(law_rows(i))
      end do
   end function count_constants

end module emcon_law_registry
