!> What explicit steps hold from one to the next; nothing of it is needed to go on.
module emcon_explicit_type
   use emcon_constraints, only : constraint_set_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   implicit none
   private
   public :: explicit_t

   type :: explicit_t
      logical :: is_on = .false.                 !! the step of the deck is explicit
      !> (n_unknown) what unknowns weigh, where the mass between them is a diagonal [M]
      real(wp), allocatable :: mass(:)
      logical :: is_free = .false.               !! nothing was held in the step
      type(motion_t) :: place                    !! and the place, that rests
      real(wp), allocatable :: start(:, :)       !! (n_dim, n_node) residual at the step's start
      real(wp), allocatable :: load0(:, :)       !! (n_dim, n_node) external forces there
      real(wp), allocatable :: v1(:, :)          !! (n_dim, n_node) velocity there [L/T]
      real(wp), allocatable :: load(:, :)        !! (n_dim, n_node) external forces there
      real(wp), allocatable :: residual(:, :)    !! (n_dim, n_node) reactions there
      real(wp), allocatable :: contact(:, :)     !! (n_dim, n_node) contact forces there
      type(constraint_set_t) :: set              !! that holds velocities there
      integer, allocatable :: row(:)             !! (set%n) and their places in the set of the step
      real(wp), allocatable :: mu(:)             !! (constraints of the step) multipliers there
      !> Contacts that give way at the start and the end of the step, at whichever of its two places
      !> that is.
      type(constraint_set_t) :: penalty(0:1)
      integer :: i_start = 0                     !! that of the start
      real(wp), allocatable :: stiffness(:)      !! (n_node) of closed contacts [M/T^2]
      real(wp), allocatable :: met(:)            !! (n_node) that, or the most so far [M/T^2]
   end type explicit_t

end module emcon_explicit_type
