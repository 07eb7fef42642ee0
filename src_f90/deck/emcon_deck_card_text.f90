!> A card as the text it is, before decks of parts are made flat: where it stands, its options, and
!> which of its fields are labels.
module emcon_deck_card_text
   use emcon_deck_source, only : deck_source_t
   use emcon_deck_text, only : gather_keyword, keyword_of, option_place, option_t, option_value, &
      split_keyword
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: card_text_t, card_read, card_end, card_field_is_label, card_is_profile, card_is_wall, &
      origin_of

   !> Fields of GENERATE that are labels; those of a term of *EQUATION.
   integer, parameter :: n_ends = 2, n_term = 3

   !> A card of the source.
   type :: card_text_t
      integer :: line = 0                          !! where it begins,
      integer :: last = 0                          !! ends,
      integer :: data = 0                          !! and where its data lines begin
      character(len=:), allocatable :: title       !! as typed, with its star
      character(len=:), allocatable :: name        !! upper case, without blanks and star
      type(option_t), allocatable :: option(:)
   end type card_text_t

contains

   !> The card that begins in a line, up to the line before the next keyword; data in front of a
   !> keyword are a card, too.
   subroutine card_read(source, line, card)
      type(deck_source_t), intent(in) :: source  !! the whole deck
      integer, intent(in) :: line                !! where it begins
      type(card_text_t), intent(out) :: card     !! as it stands there
      character(len=:), allocatable :: text

      card%line = line
      card%data = line
      card%name = ""
      card%title = ""
      allocate(card%option(0))
      if (keyword_of(source%line(line)%text) /= "") then
         call gather_keyword(source%line, card%data, text)
         call split_keyword(text, card%title, card%name, card%option)
         card%data = card%data + 1
      end if
      card%last = card%data
      do while (card%last <= size(source%line))
         if (keyword_of(source%line(card%last)%text) /= "") exit
         card%last = card%last + 1
      end do
      card%last = card%last - 1
   end subroutine card_read

   !> The line that ends what `card` begins; behind the last one if none does.
   pure integer function card_end(source, card, name) result(line)
      type(deck_source_t), intent(in) :: source  !! the whole deck
      type(card_text_t), intent(in) :: card      !! that begins something
      character(len=*), intent(in) :: name       !! of the card that ends it, without blanks

      do line = card%line + 1, size(source%line)
         if (keyword_of(source%line(line)%text) == name) return
      end do
   end function card_end

   !> File and number of a line.
   pure type(origin_t) function origin_of(source, line)
      type(deck_source_t), intent(in) :: source  !! the whole deck
      integer, intent(in) :: line                !! of it

      origin_of = origin_t(source%file(line), source%number(line))
   end function origin_of

   !> Is field `i` of the `n` of a data line a label, or the name of a set?
   pure logical function card_field_is_label(card, i, n) result(is_label)
      type(card_text_t), intent(in) :: card      !! with data lines
      integer, intent(in) :: i, n                !! 1 <= i <= n

      select case (card%name)
      case ("NODE", "BOUNDARY", "INITIALCONDITIONS")
         is_label = i == 1
      case ("ELEMENT")
         is_label = .true.
      case ("NSET", "ELSET")
         is_label = i <= n_ends .or. option_place(card%option, "GENERATE") == 0
      case ("SURFACE")
         is_label = i == 1 .and. .not. (card_is_profile(card) .or. card_is_wall(card))
      case ("EQUATION")                          ! node, degree of freedom, coefficient
         is_label = n > 1 .and. mod(i - 1, n_term) == 0
      case default
         is_label = .false.
      end select
   end function card_field_is_label

   !> A profile in the plane: its lines are words and coordinates.
   pure logical function card_is_profile(card)
      type(card_text_t), intent(in) :: card      !! any

      card_is_profile = card%name == "SURFACE" .and. option_value(card%option, "TYPE") == "SEGMENTS"
   end function card_is_profile

   !> A shape in space: its lines are coordinates.
   pure logical function card_is_wall(card)
      type(card_text_t), intent(in) :: card      !! any

      card_is_wall = card%name == "SURFACE" .and. any(option_value(card%option, "TYPE") == [ &
         character(len=10) :: "PLANE", "SPHERE", "REVOLUTION", "CYLINDER", "STL"])
   end function card_is_wall

end module emcon_deck_card_text
