!> The registry of constitutive laws: what others see of it. Which kinds there are is known to
!> `emcon_law_kinds` alone.
module emcon_law_registry
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_text, only : to_text, to_upper
   implicit none
   private
   public :: law_row_t, law_row, n_law_row, law_titles, law_variants, find_law_row, n_constant
   public :: law_create, law_linearise, law_make_thin, law_linear, law_user, law_anisotropic

   !> Codes of laws that others ask for: linear elasticity, under NLGEOM St. Venant-Kirchhoff; those
   !> given by a program; linear ones of any symmetry, in space. The last two have no row.
   integer, parameter :: law_linear = 1, law_user = 4, law_anisotropic = 8

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

   interface
      !> Number of rows: one a law, and one an order of those that have several.
      pure module integer function n_law_row()
      end function n_law_row

      pure module function law_row(i) result(row)
         integer, intent(in) :: i                !! 1..n_law_row()
         type(law_row_t) :: row
      end function law_row

      !> A law without constants.
      module subroutine allocate_law(code, law)
         integer, intent(in) :: code             !! of a row
         class(law_t), allocatable, intent(out) :: law   !! not allocated: there is none
      end subroutine allocate_law

      !> Linear elasticity with the stiffness that `law` has at rest.
      module subroutine law_linearise(law, linear)
         class(law_t), intent(in) :: law
         class(law_t), allocatable, intent(out) :: linear
      end subroutine law_linearise

      !> The law of a thin sheet, in plane stress.
      module subroutine law_make_thin(law, thin)
         class(law_t), intent(in) :: law
         class(law_t), allocatable, intent(out) :: thin   !! not allocated: of plane strain alone
      end subroutine law_make_thin
   end interface

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
      type(law_row_t) :: row
      integer :: i

      list = ""
      do i = 1, n_law_row()
         row = law_row(i)
         if (row%keyword /= keyword .or. row%variant == "" .or. row%order > 1) cycle
         list = list // "," // trim(row%variant)
      end do
   end subroutine law_variants

   !> The same as texts name them: "A, B".
   pure subroutine law_titles(keyword, list)
      character(len=*), intent(in) :: keyword    !! without asterisk, upper case
      character(len=:), allocatable, intent(out) :: list   !! empty: none
      type(law_row_t) :: row
      integer :: i

      list = ""
      do i = 1, n_law_row()
         row = law_row(i)
         if (row%keyword /= keyword .or. row%variant == "" .or. row%order > 1) cycle
         if (list /= "") list = list // ", "
         list = list // to_upper(row%name(:verify(row%name, " 123456789", .true.)))
      end do
   end subroutine law_titles

   !> Row of a law of the `order`; an order that there is not: 0.
   pure integer function find_law_row(keyword, variant, order) result(i)
      character(len=*), intent(in) :: keyword, variant   !! upper case, `variant` without blanks
      integer, intent(in) :: order               !! not looked at for a law that has none
      type(law_row_t) :: row

      do i = n_law_row(), 1, -1
         row = law_row(i)
         if (row%keyword /= keyword .or. row%variant /= variant) cycle
         if (row%order == 0 .or. row%order == order) return
      end do
   end function find_law_row

   !> A law with its constants; err_input with what is wrong with one.
   subroutine law_create(code, constant, law, error)
      integer, intent(in) :: code                !! of a row
      real(wp), intent(in) :: constant(:)        !! as the row says
      class(law_t), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: fault
      type(law_row_t) :: row
      integer :: i

      call allocate_law(code, law)
      if (.not. allocated(law)) then
         call raise(error, err_input, "there is no law with the code " // to_text(code))
         return
      end if
      do i = 1, n_law_row()
         row = law_row(i)
         if (row%code == code .and. n_constant(row) == size(constant)) exit
      end do
      if (i > n_law_row() .and. code /= law_anisotropic) then
         call raise(error, err_input, "a law got too many or too few constants")
         return
      end if
      call law%take(constant, fault)
      if (fault /= "") call raise(error, err_input, fault)
   end subroutine law_create

end module emcon_law_registry
