!> The C functions of the tables of options and laws, and of single kernels, in Fortran. What each
!> does is said in emcon.h.
module emcon_model_tables
   use emcon_dgrad8, only : dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_registry, only : law_create, law_row, law_row_t, n_constant, n_law_row
   use emcon_nts_gap, only : nts_gap
   use emcon_options, only : n_option_row, option_default, option_models, option_row, option_row_t
   implicit none
   private
   public :: model_option, model_law, model_law_response, model_node_gap

   character(len=*), parameter :: line_end = new_line("a")

contains

   subroutine model_option(i, code, is_default, text, error)
      integer, intent(in) :: i                               !! from 1
      integer, intent(out) :: code
      logical, intent(out) :: is_default
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      type(option_row_t) :: row
      character(len=:), allocatable :: models

      if (i < 1 .or. i > n_option_row()) then
         call raise(error, err_input, "there is no such option")
         return
      end if
      row = option_row(i)
      code = row%code
      is_default = row%code == option_default(trim(row%kind))
      call option_models(row, models)
      text = trim(row%kind) // line_end // trim(row%word) // line_end // trim(row%c_name) // &
         line_end // trim(row%text) // line_end // models // line_end // trim(row%instead)
   end subroutine model_option

   subroutine model_law(i, code, text, error)
      integer, intent(in) :: i                               !! from 1
      integer, intent(out) :: code
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      type(law_row_t) :: row
      integer :: k

      if (i < 1 .or. i > n_law_row()) then
         call raise(error, err_input, "there is no such law")
         return
      end if
      row = law_row(i)
      code = row%code
      text = trim(row%name) // line_end // trim(row%keyword) // line_end // trim(row%variant) &
         // line_end
      do k = 1, n_constant(row)
         text = text // " " // trim(row%constant(k))
      end do
   end subroutine model_law

   subroutine model_law_response(law, constant, strain, dstrain, energy, stress, tangent, error)
      integer, intent(in) :: law
      real(wp), intent(in) :: constant(:)
      real(wp), intent(in) :: strain(:), dstrain(:)          !! (3)
      real(wp), intent(out) :: energy
      real(wp), allocatable, intent(out) :: stress(:)        !! (3)
      real(wp), allocatable, intent(out) :: tangent(:, :)    !! (3, 3) along rows, as C goes
      type(error_t), allocatable, intent(out) :: error
      class(law_t), allocatable :: object
      type(law_response_t) :: response

      call law_create(law, constant, object, error)
      if (allocated(error)) return
      call law_response_plane(object, strain, dstrain, response)
      energy = response%energy
      allocate(stress, source=response%stress)
      allocate(tangent, source=transpose(response%tangent))
   end subroutine model_law_response

   subroutine model_node_gap(x0, dx, has_before, has_after, rounding, gap, g, c, h)
      real(wp), intent(in) :: x0(:, :), dx(:, :)             !! (2, 5)
      logical, intent(in) :: has_before, has_after
      real(wp), intent(in) :: rounding
      real(wp), allocatable, intent(out) :: gap(:)           !! (3)
      real(wp), allocatable, intent(out) :: g(:), c(:)       !! (10)
      real(wp), allocatable, intent(out) :: h(:, :)          !! (10, 10) along rows, as C goes
      real(wp), dimension(size(x0, 1), size(x0, 2)) :: by_g, by_c
      real(wp) :: by_h(size(x0), size(x0))
      integer, parameter :: in_order(5) = [1, 2, 3, 4, 5]
      type(dg_t) :: number

      number = nts_gap(x0, dx, merge(4, 0, has_before), merge(5, 0, has_after), &
         spread([rounding, rounding], 2, 2))
      gap = [number%f0, number%f1, number%df]
      by_g = 0.0_wp
      by_c = 0.0_wp
      by_h = 0.0_wp
      call nodes_add_first(1.0_wp, number%g, in_order, by_g)
      call nodes_add_first(1.0_wp, number%c, in_order, by_c)
      call nodes_add_second(1.0_wp, size(x0, 1), number%h, in_order, by_h)
      allocate(g, source=pack(by_g, .true.))
      allocate(c, source=pack(by_c, .true.))
      allocate(h, source=transpose(by_h))
   end subroutine model_node_gap

end module emcon_model_tables
