!> The structures and callbacks of emcon.h as Fortran sees them; emcon_NAME is NAME_c here.
module emcon_c_types
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_null_ptr, c_ptr
   implicit none
   private
   public :: sizes_c, increment_c, ledger_c, csr_c, constraint_report_c
   public :: pair_options_c, contact_settings_c, gap_c
   public :: progress_interface, log_interface

   type, bind(c) :: sizes_c
      integer(c_int) :: n_node = 0, n_element = 0, n_contact = 0, n_pair = 0, n_body = 0
      integer(c_int) :: n_unknown = 0, n_step = 0, n_constraint = 0, n_load = 0, i_step = 0
      integer(c_int) :: n_surface = 0, n_tie = 0, n_selected = 0
   end type sizes_c

   type, bind(c) :: increment_c
      real(c_double) :: h, time
      integer(c_int) :: n_newton, n_cut, n_active
      real(c_double) :: penetration
   end type increment_c

   type, bind(c) :: ledger_c
      real(c_double) :: kinetic, strain, potential, external_work, contact_work, total, px, py, lz
      real(c_double) :: stabilization
   end type ledger_c

   type, bind(c) :: csr_c
      integer(c_int) :: n_row = 0, n_column = 0
      type(c_ptr) :: row_start = c_null_ptr, column = c_null_ptr, value = c_null_ptr
   end type csr_c

   type, bind(c) :: constraint_report_c
      integer(c_int) :: n = 0
      type(c_ptr) :: id = c_null_ptr, pair = c_null_ptr, node = c_null_ptr
      type(c_ptr) :: target = c_null_ptr, gap0 = c_null_ptr, gap1 = c_null_ptr, dgap = c_null_ptr
      type(c_ptr) :: defect = c_null_ptr, size = c_null_ptr
      type(csr_c) :: discrete_gradient, end_gradient
   end type constraint_report_c

   type, bind(c) :: pair_options_c
      integer(c_int) :: integration, n_point, multiplier, normal, smoothing
      real(c_double) :: normal_angle, smoothing_angle
   end type pair_options_c

   type, bind(c) :: contact_settings_c
      integer(c_int) :: initiation
      real(c_double) :: gap_tolerance
      integer(c_int) :: is_last_try, is_end
   end type contact_settings_c

   type, bind(c) :: gap_c
      integer(c_int) :: is_near, is_over
      real(c_double) :: gap0, gap1, size
   end type gap_c

   abstract interface
      function progress_interface(user, increment, fraction) result(answer) bind(c)
         import :: c_double, c_int, c_ptr, increment_c
         implicit none
         type(c_ptr), value :: user
         type(increment_c), intent(in) :: increment
         real(c_double), value :: fraction
         integer(c_int) :: answer
      end function progress_interface

      subroutine log_interface(user, line) bind(c)
         import :: c_ptr
         implicit none
         type(c_ptr), value :: user, line
      end subroutine log_interface
   end interface

end module emcon_c_types
