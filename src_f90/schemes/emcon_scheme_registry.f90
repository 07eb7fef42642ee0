!> The registry of time stepping schemes: what others see of it. Which kinds there are is known to
!> `emcon_scheme_kinds` alone. A program may give schemes of its own, which decks call by name.
module emcon_scheme_registry
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_row_t, scheme_t
   use emcon_text, only : squeezed
   implicit none
   private
   public :: scheme_row, n_scheme_row, scheme_create
   public :: setting_range_t, setting_range, n_setting_range
   public :: scheme_user_row, scheme_static, scheme_energy_momentum, scheme_user

   !> Codes that others ask for.
   integer, parameter :: scheme_static = 1, scheme_energy_momentum = 2, scheme_user = 3

   !> What the numbers of schemes may be.
   type :: setting_range_t
      integer :: code = 0                        !! of the scheme
      character(len=16) :: word = ""             !! in decks
      real(wp) :: least = 0.0_wp, most = 0.0_wp
      character(len=10) :: range = ""             !! the same, for messages
   end type setting_range_t

   !> Of schemes that a program gives, before it has: then they say themselves what they keep.
   type(scheme_row_t), parameter :: scheme_user_row = &
      scheme_row_t(scheme_user, "DYNAMIC", has_inertia=.true., looks_back=.true.)

   !> A row by its number, or by what a deck says.
   interface scheme_row
      module procedure :: scheme_row_at, scheme_row_by_word
   end interface scheme_row

   interface
      pure module integer function n_scheme_row()
      end function n_scheme_row

      !> The first row of a card is its default; statics is the first of all.
      pure module function scheme_row_at(i) result(row)
         integer, intent(in) :: i                !! 1..n_scheme_row()
         type(scheme_row_t) :: row
      end function scheme_row_at

      pure module integer function n_setting_range()
      end function n_setting_range

      pure module function setting_range(i) result(range)
         integer, intent(in) :: i                !! 1..n_setting_range()
         type(setting_range_t) :: range
      end function setting_range

      !> A scheme without its row.
      module subroutine allocate_scheme(code, scheme)
         integer, intent(in) :: code             !! of a row
         class(scheme_t), allocatable, intent(out) :: scheme   !! not allocated: there is none
      end subroutine allocate_scheme
   end interface

contains

   !> The row that `card` asks for with SCHEME=`word`; "": its default. Code 0: there is none.
   pure type(scheme_row_t) function scheme_row_by_word(card, word) result(found)
      character(len=*), intent(in) :: card       !! capital letters
      character(len=*), intent(in) :: word       !! capital letters, without blanks
      type(scheme_row_t) :: row
      integer :: i

      do i = 1, n_scheme_row()
         row = scheme_row_at(i)
         if (row%card /= card) cycle
         if (word /= "" .and. squeezed(row%word) /= word) cycle
         found = row
         return
      end do
   end function scheme_row_by_word

   !> The scheme of a row, in place of another that was there.
   subroutine scheme_create(row, scheme, user)
      type(scheme_row_t), intent(in) :: row
      class(scheme_t), allocatable, intent(inout) :: scheme
      class(scheme_t), intent(in), optional :: user    !! that of `scheme_user`

      call allocate_scheme(row%code, scheme)
      if (.not. allocated(scheme)) allocate(scheme, source=user)
      scheme%row = row
   end subroutine scheme_create

end module emcon_scheme_registry
