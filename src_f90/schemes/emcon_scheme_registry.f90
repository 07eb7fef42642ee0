!> The time stepping schemes, a row each: the only module that knows their kinds. A program may give
!> schemes of its own, which decks call by name.
module emcon_scheme_registry
   use emcon_scheme, only : scheme_row_t, scheme_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_text, only : squeezed
   implicit none
   private
   public :: scheme_rows, scheme_given_row, scheme_static, scheme_energy_momentum, scheme_given
   public :: scheme_row, scheme_create

   integer, parameter :: scheme_static = 1, scheme_energy_momentum = 2, scheme_given = 3

   !> The first row of a card is its default.
   type(scheme_row_t), parameter :: scheme_rows(*) = [ &
      scheme_row_t(scheme_static, "STATIC", "", "statics", loads_ramp=.true.), &
      scheme_row_t(scheme_energy_momentum, "DYNAMIC", "ENERGY MOMENTUM", &
         "energy-momentum scheme", masses_resist=.true.)]

   !> Of schemes that a program gives.
   type(scheme_row_t), parameter :: scheme_given_row = &
      scheme_row_t(scheme_given, "DYNAMIC", masses_resist=.true.)

contains

   !> The row that `card` asks for with SCHEME=`word`; "": its default. Code 0: there is none.
   pure type(scheme_row_t) function scheme_row(card, word) result(row)
      character(len=*), intent(in) :: card       !! capital letters
      character(len=*), intent(in) :: word       !! capital letters, without blanks
      integer :: i

      do i = 1, size(scheme_rows)
         if (scheme_rows(i)%card /= card) cycle
         if (word /= "" .and. squeezed(scheme_rows(i)%word) /= word) cycle
         row = scheme_rows(i)
         return
      end do
   end function scheme_row

   !> The scheme of a row, in place of another that was there.
   subroutine scheme_create(row, scheme, given)
      type(scheme_row_t), intent(in) :: row
      class(scheme_t), allocatable, intent(inout) :: scheme
      class(scheme_t), intent(in), optional :: given   !! that of `scheme_given`

      if (allocated(scheme)) deallocate(scheme)
      select case (row%code)
      case (scheme_static)
         allocate(scheme_static_t :: scheme)
      case (scheme_energy_momentum)
         allocate(scheme_energy_momentum_t :: scheme)
      case default
         allocate(scheme, source=given)
      end select
      scheme%row = row
   end subroutine scheme_create

end module emcon_scheme_registry
