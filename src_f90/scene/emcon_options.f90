!> The options of contact and of how it is solved: each is one row, which decks and their messages
!> are made from.
module emcon_options
   use emcon_interactions, only : formulation_mortar, formulation_nts, formulation_segment, &
      integration_elements, integration_segments, multiplier_dual, multiplier_standard, &
      normal_edge, normal_nodal, smoothing_hermite, smoothing_none
   use emcon_steps, only : method_null_space, method_saddle_point
   implicit none
   private
   public :: option_row_t, option_rows, option_code, option_words

   !> One value that an option may have.
   type :: option_row_t
      character(len=12) :: kind                  !! the option
      integer :: code
      character(len=16) :: word                  !! in decks
      character(len=40) :: also                  !! other words of decks, ",A,B,", without blanks
   end type option_row_t

   type(option_row_t), parameter :: option_rows(*) = [ &
      option_row_t("formulation", formulation_nts, "NODE TO SURFACE", ""), &
      option_row_t("formulation", formulation_segment, "SEGMENT", ""), &
      option_row_t("formulation", formulation_mortar, "MORTAR", &
         ",LINMORTAR,PGLINMORTAR,SURFACETOSURFACE,"), &
      option_row_t("integration", integration_segments, "SEGMENTS", ""), &
      option_row_t("integration", integration_elements, "ELEMENTS", ""), &
      option_row_t("multiplier", multiplier_standard, "STANDARD", ""), &
      option_row_t("multiplier", multiplier_dual, "DUAL", ""), &
      option_row_t("normal", normal_edge, "EDGE", ""), &
      option_row_t("normal", normal_nodal, "NODAL", ""), &
      option_row_t("smoothing", smoothing_none, "NONE", ""), &
      option_row_t("smoothing", smoothing_hermite, "HERMITE", ""), &
      option_row_t("method", method_null_space, "NULL SPACE", ""), &
      option_row_t("method", method_saddle_point, "SADDLE POINT", "")]

contains

   !> Code of the `word` of a deck; 0: there is none.
   pure integer function option_code(kind, word) result(code)
      character(len=*), intent(in) :: kind
      character(len=*), intent(in) :: word       !! upper case, without blanks
      integer :: i

      code = 0
      if (word == "") return
      do i = 1, size(option_rows)
         if (option_rows(i)%kind /= kind) cycle
         if (without_blanks(option_rows(i)%word) == word &
            .or. index(option_rows(i)%also, "," // word // ",") > 0) code = option_rows(i)%code
      end do
   end function option_code

   !> The words that decks are told: "A, B".
   pure subroutine option_words(kind, list)
      character(len=*), intent(in) :: kind
      character(len=:), allocatable, intent(out) :: list
      integer :: i

      list = ""
      do i = 1, size(option_rows)
         if (option_rows(i)%kind /= kind) cycle
         if (list /= "") list = list // ", "
         list = list // trim(option_rows(i)%word)
      end do
   end subroutine option_words

   !> The text with its blanks moved to its end.
   pure function without_blanks(text) result(squeezed)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: squeezed
      integer :: i, n

      squeezed = ""
      n = 0
      do i = 1, len(text)
         if (text(i:i) == " ") cycle
         n = n + 1
         squeezed(n:n) = text(i:i)
      end do
   end function without_blanks

end module emcon_options
