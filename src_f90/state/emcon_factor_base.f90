!> Of which motion a factor was made that is kept over steps: with it the same factor is made again.
module emcon_factor_base
   use emcon_evaluation, only : instant_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: factor_base_t

   type :: factor_base_t
      logical :: is_set = .false.                !! there is a factor
      integer :: increment = -1                  !! increments done before it was made
      !> Corrections of a short solve: of the shortest one, and one more for each factor since
      integer :: n_least = 7
      integer :: n_excess = 0                    !! that its solves have taken more, in sum
      type(instant_t) :: start                   !! of the step that it was made in
      real(wp) :: h = 0.0_wp                     !! and its size [T]
      real(wp), allocatable :: u0(:, :)          !! (n_dim, n_node) displacement at its start [L]
      real(wp), allocatable :: du(:, :)          !! (n_dim, n_node) and over it [L]
      !> Iterations have led to no set of contacts: complete factors in what is left of the step
      logical :: iterates_no_more = .false.
   end type factor_base_t

end module emcon_factor_base
