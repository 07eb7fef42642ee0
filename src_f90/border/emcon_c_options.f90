!> The C interface: the tables of options and laws. What each function does is said in emcon.h.
module emcon_c_options
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_f_pointer, c_int, c_ptr
   use emcon_c_border, only : c_string, put_number
   use emcon_errors, only : err_input, err_none
   use emcon_law_registry, only : law_rows, n_constant
   use emcon_options, only : n_option_row, option_default, option_row, option_row_t
   implicit none
   private
   public :: emcon_get_option, emcon_get_law

   character(len=*), parameter :: line_end = new_line("a")

contains

   integer(c_int) function emcon_get_option(i, code, is_default, n_text, text) result(ierr) bind(c)
      integer(c_int), value :: i, n_text
      type(c_ptr), value :: code, is_default, text
      type(option_row_t) :: row

      ierr = err_input
      if (i < 0 .or. i >= n_option_row) return
      row = option_row(i + 1)
      call put_text(trim(row%kind) // line_end // trim(row%word) // line_end // trim(row%c_name) &
         // line_end // trim(row%text), n_text, text, ierr)
      if (ierr /= err_none) return
      call put_number(row%code, code)
      call put_number(merge(1, 0, row%code == option_default(trim(row%kind))), is_default)
   end function emcon_get_option

   integer(c_int) function emcon_get_law(i, code, n_text, text) result(ierr) bind(c)
      integer(c_int), value :: i, n_text
      type(c_ptr), value :: code, text
      character(len=:), allocatable :: said
      integer :: k

      ierr = err_input
      if (i < 0 .or. i >= size(law_rows)) return
      associate (row => law_rows(i + 1))
         said = trim(row%name) // line_end // trim(row%keyword) // line_end // trim(row%variant) &
            // line_end
         do k = 1, n_constant(row)
            said = said // " " // trim(row%constant(k))
         end do
         call put_text(said, n_text, text, ierr)
         if (ierr == err_none) call put_number(row%code, code)
      end associate
   end function emcon_get_law

   !> Write a text of C; err_input: there is no room for it.
   subroutine put_text(said, n_text, text, ierr)
      character(len=*), intent(in) :: said
      integer(c_int), intent(in) :: n_text
      type(c_ptr), intent(in) :: text
      integer(c_int), intent(out) :: ierr
      character(kind=c_char), pointer :: to(:)

      ierr = err_input
      if (n_text <= len(said) .or. .not. c_associated(text)) return
      call c_f_pointer(text, to, [len(said) + 1])
      to = c_string(said)
      ierr = err_none
   end subroutine put_text

end module emcon_c_options
