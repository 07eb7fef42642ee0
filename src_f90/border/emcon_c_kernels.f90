!> The C interface: single kernels. What each function does is said in emcon.h.
module emcon_c_kernels
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_ptr
   use emcon_c_border, only : put_field, put_values
   use emcon_dgrad10, only : dg_t
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_registry, only : law_create
   use emcon_nts_gap, only : nts_gap
   implicit none
   private
   public :: emcon_law_response, emcon_node_gap

contains

   integer(c_int) function emcon_law_response(law, n, constant, strain, dstrain, energy, stress, &
      tangent) result(ierr) bind(c)
      integer(c_int), value :: law, n
      type(c_ptr), value :: constant, strain, dstrain, energy, stress, tangent
      class(law_t), allocatable :: object
      type(law_response_t) :: response
      type(error_t), allocatable :: error
      real(c_double), pointer :: values(:), from(:), by(:)

      ierr = err_input
      if (.not. c_associated(constant) .or. .not. c_associated(strain)) return
      if (.not. c_associated(dstrain)) return
      if (n < 0) return
      call c_f_pointer(constant, values, [n])
      call c_f_pointer(strain, from, [3])
      call c_f_pointer(dstrain, by, [3])
      call law_create(law, real(values, wp), object, error)
      if (allocated(error)) return
      call law_response_plane(object, real(from, wp), real(by, wp), response)
      call put_values([response%energy], energy)
      call put_values(response%stress, stress)
      call put_field(transpose(response%tangent), tangent)     ! C goes along rows
      ierr = err_none
   end function emcon_law_response

   integer(c_int) function emcon_node_gap(x0, dx, has_before, has_after, rounding, gap, g, c, h) &
      result(ierr) bind(c)
      type(c_ptr), value :: x0, dx
      integer(c_int), value :: has_before, has_after
      real(c_double), value :: rounding
      type(c_ptr), value :: gap, g, c, h
      real(c_double), pointer :: from(:, :), by(:, :)
      type(dg_t) :: number

      ierr = err_input
      if (.not. (c_associated(x0) .and. c_associated(dx))) return
      call c_f_pointer(x0, from, [2, 5])
      call c_f_pointer(dx, by, [2, 5])
      number = nts_gap(real(from, wp), real(by, wp), merge(4, 0, has_before /= 0), &
         merge(5, 0, has_after /= 0), spread(spread(real(rounding, wp), 1, 2), 2, 2))
      call put_values([number%f0, number%f1, number%df], gap)
      call put_values(number%g, g)
      call put_values(number%c, c)
      call put_field(transpose(number%h), h)                   ! C goes along rows
      ierr = err_none
   end function emcon_node_gap

end module emcon_c_kernels
