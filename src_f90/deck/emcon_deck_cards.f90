!> From lines to cards: keywords and parameters, held against the registry.
module emcon_deck_cards
   use emcon_deck_keywords, only : find_keyword, in_model, in_step, is_neutral, keyword_names, &
      keyword_t, keywords, mark_flag, mark_none, mark_unsupported, mark_value, &
      mark_without_effect, parameter_mark, parameter_names, parameter_reason, refusal_of, refusal_t
   use emcon_deck_parameters, only : parameter_define, parameters_init, parameters_t, &
      substitute_parameters, told_already, unused_override
   use emcon_deck_reader, only : card_error, card_t, card_warning, line_origin, note_idle, &
      reader_t
   use emcon_deck_text, only : gather_keyword, is_card, is_comment, option_t, split_keyword
   use emcon_diagnostics, only : add_error, quoted, suggestion
   use emcon_law_registry, only : law_variants
   use emcon_origin, only : origin_t
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: read_cards, check_parts

   !> Where the reading of cards stands.
   type :: place_t
      integer :: n_card = 0
      integer :: n_step = 0
      logical :: in_step = .false.
      logical :: has_strayed = .false.             !! data before the first keyword were told
      type(origin_t) :: step_origin
   end type place_t

contains

   !> Fill `reader%card` from the lines that `reader` looks at.
   subroutine read_cards(reader, overrides)
      type(reader_t), intent(inout) :: reader
      type(string_t), intent(in) :: overrides(:)   !! NAME=VALUE
      type(parameters_t) :: parameters
      type(place_t) :: place
      character(len=:), allocatable :: fault
      integer :: i

      call parameters_init(parameters, overrides)
      allocate(reader%card(count_cards(reader)))
      i = 1
      do while (i <= size(reader%line))
         call read_line(reader, parameters, place, i)
         i = i + 1
      end do
      reader%card = reader%card(:place%n_card)
      if (place%in_step) call add_error(reader%log, place%step_origin, &
         "*STEP: *END STEP is missing: the deck ends inside this step")
      do i = 1, size(overrides)
         call unused_override(parameters, i, fault)
         if (fault /= "") call add_error(reader%log, origin_t(), fault)
      end do
      if (place%n_card == 0 .and. reader%log%n_errors == 0) then
         call add_error(reader%log, origin_t(1, 0), "the deck is empty: it has no keyword")
      end if
   end subroutine read_cards

   !> Hold the cards of parts and instances against the registry: they leave before cards are read.
   subroutine check_parts(reader)
      type(reader_t), intent(inout) :: reader
      type(card_t) :: card
      character(len=:), allocatable :: text
      logical :: has_data
      integer :: i, k

      has_data = .true.
      i = 0
      do while (i < size(reader%line))
         i = i + 1
         if (is_card(reader%line(i)%text)) then
            k = i
            call gather_keyword(reader%line, i, text)
            call split_keyword(text, card%title, card%name, card%option)
            has_data = all(card%name /= [character(len=11) :: "PART", "ENDPART", "ASSEMBLY", &
               "ENDASSEMBLY", "INSTANCE", "ENDINSTANCE"])
            if (has_data) cycle
            has_data = card%name == "INSTANCE"
            card%origin = line_origin(reader, k)
            call check_options(reader, card, trim(keywords(find_keyword(card%name))%parameters))
         else if (.not. has_data .and. .not. is_comment(reader%line(i)%text)) then
            call add_error(reader%log, line_origin(reader, i), card%title &
               // ": has no data lines, but " // quoted(reader%line(i)%text) // " follows")
            has_data = .true.
         end if
      end do
   end subroutine check_parts

   pure integer function count_cards(reader)
      type(reader_t), intent(in) :: reader
      integer :: i

      count_cards = 0
      do i = 1, size(reader%line)
         if (is_card(reader%line(i)%text)) count_cards = count_cards + 1
      end do
   end function count_cards

   !> Take in the line `i`, for a card also the lines it goes on in: `i` becomes the last of them.
   subroutine read_line(reader, parameters, place, i)
      type(reader_t), intent(inout) :: reader
      type(parameters_t), intent(inout) :: parameters
      type(place_t), intent(inout) :: place
      integer, intent(inout) :: i
      character(len=:), allocatable :: text
      integer :: i_first
      logical :: is_resolved, is_parametric

      if (is_card(reader%line(i)%text)) then
         i_first = i
         call gather_keyword(reader%line, i, text)
         is_parametric = index(text, "<") > 0
         call put_parameters(reader, parameters, i_first, text, is_resolved)
         place%n_card = place%n_card + 1
         reader%doubt%names = reader%doubt%names .or. .not. is_resolved
         call read_card(reader, place, text, i_first, reader%card(place%n_card))
         reader%card(place%n_card)%is_unresolved = .not. is_resolved
         reader%card(place%n_card)%is_parametric = is_parametric
         reader%card(place%n_card)%first = i + 1
         reader%card(place%n_card)%last = i
      else if (is_comment(reader%line(i)%text)) then
         return
      else if (place%n_card == 0) then
         if (.not. place%has_strayed) call add_error(reader%log, line_origin(reader, i), &
            quoted(reader%line(i)%text) // ": a deck begins with a keyword, such as *NODE")
         place%has_strayed = .true.
      else
         reader%card(place%n_card)%last = i
         call read_data(reader, parameters, reader%card(place%n_card)%name, i)
      end if
   end subroutine read_line

   !> A data line: define a parameter, or put parameters in.
   subroutine read_data(reader, parameters, keyword, i)
      type(reader_t), intent(inout) :: reader
      type(parameters_t), intent(inout) :: parameters
      character(len=*), intent(in) :: keyword
      integer, intent(in) :: i
      character(len=:), allocatable :: text, fault
      logical :: is_resolved

      if (keyword == "PARAMETER") then
         call parameter_define(parameters, reader%line(i)%text, fault)
         if (fault /= "") call add_error(reader%log, line_origin(reader, i), fault)
      else if (keyword /= "HEADING" .and. keyword /= "") then
         if (index(reader%line(i)%text, "<") == 0) return
         text = reader%line(i)%text
         call put_parameters(reader, parameters, i, text, is_resolved)
         if (.not. is_resolved) then
            if (.not. allocated(reader%is_unresolved)) then
               allocate(reader%is_unresolved(size(reader%line)), source=.false.)
            end if
            reader%is_unresolved(i) = .true.
         end if
         if (.not. allocated(reader%patched)) allocate(reader%patched(size(reader%line)))
         call move_alloc(text, reader%patched(i)%text)
      end if
   end subroutine read_data

   !> Put the values of parameters into `text`, which stands at line `i`.
   subroutine put_parameters(reader, parameters, i, text, is_resolved)
      type(reader_t), intent(inout) :: reader
      type(parameters_t), intent(in) :: parameters
      integer, intent(in) :: i
      character(len=:), allocatable, intent(inout) :: text
      logical, intent(out) :: is_resolved          !! false: a parameter is unknown
      character(len=:), allocatable :: patched, fault

      is_resolved = .true.
      if (index(text, "<") == 0) return
      call substitute_parameters(parameters, text, patched, fault)
      is_resolved = fault == ""
      if (.not. is_resolved .and. fault /= told_already) call add_error(reader%log, &
         line_origin(reader, i), fault)
      call move_alloc(patched, text)
   end subroutine put_parameters

   !> Make a card of `text`. It gets no name if nothing may be read from it.
   subroutine read_card(reader, place, text, i_line, card)
      type(reader_t), intent(inout) :: reader
      type(place_t), intent(inout) :: place
      character(len=*), intent(in) :: text
      integer, intent(in) :: i_line
      type(card_t), intent(out) :: card
      character(len=:), allocatable :: variants
      type(refusal_t) :: refusal
      integer :: i

      card%origin = line_origin(reader, i_line)
      call split_keyword(text, card%title, card%name, card%option)
      card%title = quoted(card%title)
      card%title = card%title(2:len(card%title) - 1)
      i = find_keyword(card%name)
      if (i == 0) refusal = refusal_of(card%name)
      if (refusal%is_idle) then
         call note_idle(reader, card%title, trim(refusal%reason))
         card%is_idle = .true.
         card%name = ""
      else if (refusal%reason /= "") then
         call refuse_unsupported(reader, card, refusal)
      else if (i == 0) then
         call refuse_keyword(reader, card)
      else
         call law_variants(card%name, variants)
         if (variants /= "") variants = variants(2:) // ","
         call check_options(reader, card, variants // trim(keywords(i)%parameters))
         call check_place(reader, place, card, keywords(i))
      end if
   end subroutine read_card

   !> An unknown keyword. What it would have defined may be missing further on; what it would have
   !> changed nobody knows, so that --lenient does not leave it out.
   subroutine refuse_keyword(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(inout) :: card

      call add_error(reader%log, card%origin, "unknown keyword " // quoted(card%title) &
         // suggestion("*" // card%name, keyword_names()))
      reader%doubt%nodes = .true.
      reader%doubt%elements = .true.
      reader%doubt%names = .true.
      card%name = ""
   end subroutine refuse_keyword

   subroutine refuse_unsupported(reader, card, refusal)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(inout) :: card
      type(refusal_t), intent(in) :: refusal

      if (reader%is_lenient .and. refusal%is_output) then
         call card_warning(reader, card, "not supported, left out: " // trim(refusal%reason))
         card%is_idle = .true.
      else
         call card_error(reader, card, "known but not supported: " // trim(refusal%reason))
      end if
      select case (card%name)
      case ("NGEN", "NCOPY", "NFILL", "ELGEN", "ELCOPY", "SYSTEM")
         reader%doubt%nodes = .true.
         reader%doubt%elements = .true.
         reader%doubt%names = .true.
      end select
      card%name = ""
   end subroutine refuse_unsupported

   !> Hold the parameters of a card against the list of the registry.
   subroutine check_options(reader, card, parameters)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: parameters
      character(len=:), allocatable :: fault, reason
      integer :: i, mark

      do i = 1, size(card%option)
         associate (option => card%option(i))
            fault = ""
            mark = parameter_mark(parameters, option%name)
            if (is_neutral(parameters, option%name, option%value)) cycle
            if (mark == mark_none) then
               fault = "unknown parameter " // quoted(option%typed) &
                  // suggestion(option%name, parameter_names(parameters))
               reader%doubt%names = .true.
            else if (mark == mark_unsupported) then
               call parameter_reason(option%name, mark, reason)
               fault = "parameter " // option%name // " is known but not supported" // reason
            else if (mark == mark_value .and. option%value == "") then
               fault = "parameter " // option%name // " needs a value"
               reader%doubt%names = .true.
            else if (mark == mark_flag .and. option%has_value) then
               fault = "parameter " // option%name // " takes no value"
            else if (mark == mark_without_effect) then
               call parameter_reason(option%name, mark, reason)
               call card_warning(reader, card, "parameter " // option%name // " has no effect" &
                  // reason)
            else if (is_repeated(card%option(:i))) then
               fault = "parameter " // option%name // " is given twice"
            end if
            if (fault /= "") call card_error(reader, card, fault)
         end associate
      end do
   end subroutine check_options

   !> Whether the last of `option` has the name of an earlier one.
   pure logical function is_repeated(option)
      type(option_t), intent(in) :: option(:)
      integer :: i

      is_repeated = .false.
      do i = 1, size(option) - 1
         if (option(i)%name == option(size(option))%name) is_repeated = .true.
      end do
   end function is_repeated

   !> Follow the steps, and refuse a card in the wrong place.
   subroutine check_place(reader, place, card, keyword)
      type(reader_t), intent(inout) :: reader
      type(place_t), intent(inout) :: place
      type(card_t), intent(inout) :: card
      type(keyword_t), intent(in) :: keyword
      character(len=:), allocatable :: fault

      fault = ""
      if (card%name == "STEP") then
         if (place%in_step) call add_error(reader%log, place%step_origin, &
            "*STEP: *END STEP is missing before the *STEP of line " // to_text(card%origin%line))
         place%n_step = place%n_step + 1
         place%in_step = .true.
         place%step_origin = card%origin
      end if
      card%step = merge(place%n_step, 0, place%in_step)
      if (card%name == "ENDSTEP") then
         if (.not. place%in_step) fault = "there is no *STEP to end"
         place%in_step = .false.
      else if (keyword%place == in_step .and. .not. place%in_step) then
         fault = "may stand only inside a step"
      else if (keyword%place == in_model .and. place%n_step > 0) then
         fault = "must stand before the first *STEP"
         reader%doubt%nodes = .true.
         reader%doubt%elements = .true.
         reader%doubt%names = .true.
      else if (place%n_step > 0 .and. .not. place%in_step) then
         if (card%name /= "PARAMETER" .and. card%name /= "HEADING") then
            fault = "between *END STEP and the next *STEP nothing may stand"
            reader%doubt%names = .true.
         end if
      end if
      if (fault == "") return
      call card_error(reader, card, fault)
      card%name = ""
   end subroutine check_place

end module emcon_deck_cards
