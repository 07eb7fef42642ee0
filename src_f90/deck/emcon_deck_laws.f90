!> The registry of constitutive laws that a deck can name. A new law is one row here.
module emcon_deck_laws
   use emcon_kinds, only : wp
   use emcon_materials, only : law_coupled_neo_hooke, law_linear, law_neo_hooke
   implicit none
   private
   public :: law_row_t, law_rows, law_variants, constant_fault

   !> One law: the keyword and the parameter that choose it, and its constants in deck order.
   type :: law_row_t
      character(len=12) :: keyword
      character(len=16) :: variant                 !! parameter without blanks; empty: none
      integer :: law
      integer :: n_constant
      character(len=4) :: constant(4)              !! names; the name fixes the range
   end type law_row_t

   type(law_row_t), parameter :: law_rows(*) = [ &
      law_row_t("ELASTIC", "", law_linear, 2, ["E   ", "nu  ", "    ", "    "]), &
      law_row_t("HYPERELASTIC", "NEOHOOKE", law_neo_hooke, 2, ["C10 ", "D1  ", "    ", "    "]), &
      law_row_t("HYPERELASTIC", "COUPLEDNEOHOOKE", law_coupled_neo_hooke, 2, &
         ["E   ", "nu  ", "    ", "    "])]

contains

   !> The parameters that choose among the laws of a keyword: ",A,B", ready for its list.
   pure subroutine law_variants(keyword, list)
      character(len=*), intent(in) :: keyword
      character(len=:), allocatable, intent(out) :: list
      integer :: i

      list = ""
      do i = 1, size(law_rows)
         if (law_rows(i)%keyword == keyword .and. law_rows(i)%variant /= "") then
            list = list // "," // trim(law_rows(i)%variant)
         end if
      end do
   end subroutine law_variants

   !> What is wrong with the value of the constant `name`; empty: nothing.
   pure subroutine constant_fault(name, value, fault)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=:), allocatable, intent(out) :: fault

      fault = ""
      select case (name)
      case ("E", "C10")
         if (value <= 0.0_wp) fault = "must be positive"
      case ("D1")
         if (value < 0.0_wp) fault = "must not be negative"
      case ("nu")
         if (value <= -1.0_wp .or. value >= 0.5_wp) fault = "must lie between -1 and 0.5"
      end select
   end subroutine constant_fault

end module emcon_deck_laws
