!> Parameters of cards whose values are rows of a table.
module emcon_deck_options
   use emcon_deck_reader, only : card_error, card_t, option_name, reader_t, refuse_option
   use emcon_options, only : option_code, option_refusal, option_words
   implicit none
   private
   public :: choose_option, check_option

contains

   !> The value of a parameter; `code` stays as it is where the parameter is absent or refused.
   subroutine choose_option(reader, card, parameter, kind, code, is_refused)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: kind         !! of `option_rows`
      integer, intent(inout) :: code
      logical, intent(out), optional :: is_refused
      character(len=:), allocatable :: known
      integer :: found

      if (present(is_refused)) is_refused = .false.
      if (option_name(card, parameter) == "") return
      found = option_code(kind, option_name(card, parameter))
      if (found > 0) then
         call check_option(reader, card, parameter, kind, found)
      else
         call option_words(kind, known)
         call refuse_option(reader, card, parameter, known, "")
      end if
      if (found > 0) code = found
      if (present(is_refused)) is_refused = found == 0
   end subroutine choose_option

   !> Refuse a value that is not for models of this kind: `code` is 0 then.
   subroutine check_option(reader, card, parameter, kind, code)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: parameter
      character(len=*), intent(in) :: kind         !! of `option_rows`
      integer, intent(inout) :: code               !! one of that kind
      character(len=:), allocatable :: why

      call option_refusal(kind, code, reader%n_dim, reader%is_flat, why)
      if (why == "") return
      call card_error(reader, card, parameter // "=" // why)
      code = 0
   end subroutine check_option

end module emcon_deck_options
