!> The keywords of decks as a list to read: what the registry says of each, line by line.
module emcon_deck_keyword_list
   use emcon_deck_keywords, only : in_both, in_model, in_step, keyword_t, keywords, refusal_t, &
      refusals
   use emcon_diagnostics, only : entries
   use emcon_law_registry, only : law_variants
   use emcon_text, only : squeezed, string_t
   implicit none
   private
   public :: keyword_lines

   character(len=*), parameter :: tab = "   "

contains

   !> A line for each keyword, and further ones that begin with blanks; then the keywords of other
   !> programs, one line a reason.
   pure subroutine keyword_lines(beginning, line)
      character(len=*), intent(in) :: beginning    !! of the names, any case; empty: all
      type(string_t), allocatable, intent(out) :: line(:)
      integer :: i

      allocate(line(0))
      do i = 1, size(keywords)
         if (index(squeezed(keywords(i)%name), squeezed(beginning)) == 1) call put_keyword(line, &
            keywords(i))
      end do
      do i = 1, size(refusals)
         call put_refusal(line, refusals(i), squeezed(beginning))
      end do
   end subroutine keyword_lines

   pure subroutine put_keyword(line, keyword)
      type(string_t), allocatable, intent(inout) :: line(:)
      type(keyword_t), intent(in) :: keyword
      character(len=:), allocatable :: list, variants

      call law_variants(squeezed(keyword%name), variants)
      list = trim(keyword%parameters)
      if (variants /= "") list = variants(2:) // "," // list
      select case (keyword%place)
      case (in_model); call put(line, "*" // trim(keyword%name) // ": before the first step")
      case (in_step); call put(line, "*" // trim(keyword%name) // ": in a step")
      case (in_both); call put(line, "*" // trim(keyword%name) // ": before and in steps")
      end select
      call put_parameters(line, list, " ", "takes")
      call put_parameters(line, list, ":", "neutral values")
      call put_parameters(line, list, "~", "without effect, with a warning")
      call put_parameters(line, list, "!", "refused")
   end subroutine put_keyword

   !> The parameters of one kind: marked by ~ or !, neither, or : those with a neutral value,
   !> which changes nothing.
   pure subroutine put_parameters(line, list, kind, title)
      type(string_t), allocatable, intent(inout) :: line(:)
      character(len=*), intent(in) :: list         !! as in the registry
      character(len=1), intent(in) :: kind
      character(len=*), intent(in) :: title
      type(string_t), allocatable :: word(:)
      character(len=:), allocatable :: text, name
      integer :: i, colon

      allocate(word, source=entries(list))
      text = ""
      do i = 1, size(word)
         name = word(i)%text
         colon = index(name, ":")
         if (kind == ":" .and. colon == 0) cycle
         if (kind /= ":" .and. kind /= name(1:1) .and. (kind /= " " .or. scan(name(1:1), "!~") &
            > 0)) cycle
         if (kind == ":") name = name(:colon - 1) // "=" // name(colon + 1:)
         if (kind /= " ") name = name(2:)
         if (kind /= ":" .and. colon > 0) name = name(:colon - 2)
         if (name(len(name):) == "?") name = name(:len(name) - 1) // "[=]"
         text = text // ", " // name
      end do
      if (text /= "") call put(line, tab // title // ": " // text(len(", ") + 1:))
   end subroutine put_parameters

   !> Keywords of other programs: what is done with those that begin so.
   pure subroutine put_refusal(line, refusal, beginning)
      type(string_t), allocatable, intent(inout) :: line(:)
      type(refusal_t), intent(in) :: refusal
      character(len=*), intent(in) :: beginning    !! without blanks, upper case
      type(string_t), allocatable :: word(:)
      character(len=:), allocatable :: text
      integer :: i

      allocate(word, source=entries(trim(refusal%names)))
      text = ""
      do i = 1, size(word)
         if (index(squeezed(word(i)%text), beginning) == 1) text = text // ", *" // word(i)%text
      end do
      if (text == "") return
      if (refusal%is_idle) then
         call put(line, "changes nothing: " // text(len(", ") + 1:) // ": " // &
            trim(refusal%reason))
      else if (refusal%is_output) then
         call put(line, "not supported, left out with --lenient: " // text(len(", ") + 1:) // &
            ": " // trim(refusal%reason))
      else
         call put(line, "not supported: " // text(len(", ") + 1:) // ": " // trim(refusal%reason))
      end if
   end subroutine put_refusal

   pure subroutine put(line, text)
      type(string_t), allocatable, intent(inout) :: line(:)
      character(len=*), intent(in) :: text

      line = [line, string_t(text)]
   end subroutine put

end module emcon_deck_keyword_list
