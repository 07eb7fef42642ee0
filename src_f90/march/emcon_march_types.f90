! build: holder
!> What a march through time holds, what one increment took, and what a step is.
module emcon_march_types
   use emcon_active_set, only : active_set_t
   use emcon_evaluation, only : instant_t
   use emcon_explicit_type, only : explicit_t
   use emcon_host_scheme, only : host_scheme_t
   use emcon_kinds, only : int64, wp
   use emcon_layer, only : layer_t
   use emcon_ledger, only : ledger_t
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_t
   use emcon_nodal_pull, only : nodal_pull_t
   use emcon_overlap_check, only : overlap_check_t, overlap_t
   use emcon_scheme, only : scheme_t
   use emcon_sparse_solver, only : solver_box_t
   use emcon_stand_off, only : stand_off_t
   use emcon_state, only : state_t
   use emcon_system, only : system_t
   use emcon_text, only : notes_t
   use emcon_velocity_jumps, only : velocity_jump_t
   use emcon_velocity_mass, only : velocity_update_t
   implicit none
   private
   public :: march_t, time_grid_t, increment_t, part_t, end_state_t, rollback_t, step_check_t, &
      step_check_begin, grid_corner_t, watcher_t

   !> Somebody who is told how an increment goes that is made in parts.
   type, abstract :: watcher_t
   contains
      procedure(tell_interface), deferred :: tell
   end type watcher_t

   abstract interface
      !> A part was tried, in increment number `increment` at `time`: `n_part` of them so far, the
      !> smallest of size `h_least`.
      subroutine tell_interface(self, increment, time, n_part, h_least)
         import :: watcher_t, wp
         class(watcher_t), intent(inout) :: self
         integer, intent(in) :: increment            !! from 1
         real(wp), intent(in) :: time                !! [T]
         integer, intent(in) :: n_part               !! tried so far
         real(wp), intent(in) :: h_least             !! [T]
      end subroutine tell_interface
   end interface

   !> A point of the grid at a corner of an amplitude.
   type :: grid_corner_t
      integer :: n = 0                           !! number of the point
      logical :: is_between = .false.            !! it lies between whole increments: the grid goes
                                                 !! on from here
      real(wp) :: time = 0.0_wp                  !! since the start of the step [T]
   end type grid_corner_t

   !> What one increment took.
   type :: increment_t
      real(wp) :: h = 0.0_wp
      real(wp) :: done = 0.0_wp                  !! part of `h` that the state has gone on by
      integer :: n_newton = 0                    !! iterations, over all cuts and active sets
      integer :: n_cut = 0
      integer :: n_active = 0
      integer :: n_augmentation = 0              !! of contact, the most of its steps
      real(wp) :: give = 0.0_wp                  !! how deep contact has given way, by the edge
      logical :: is_guarded = .false.            !! guards act in it
      type(overlap_t) :: overlap                 !! the deepest of bodies, by the judge
      type(overlap_t) :: stray                   !! of bodies that no pair brings together
      type(stand_off_t) :: stand_off             !! air across which contact forces act
      type(nodal_pull_t) :: nodal_pull           !! where contact forces pull at single nodes
      real(wp), allocatable :: residual(:)       !! relative, of the last Newton solve
      !> Largest relative residual above Newton's tolerance that was accepted; 0: there is none.
      real(wp) :: unconverged = 0.0_wp
      real(wp) :: law_missed = 0.0_wp            !! of contact and friction, at most [M L/T^2]
      real(wp) :: jump_missed = 0.0_wp           !! with jumps of velocity, at most [M L/T^2]
      real(wp) :: largest_push = 0.0_wp          !! of contacts where there is friction [M L/T^2]
      real(wp) :: work_scale = 0.0_wp            !! nodal forces times coordinates [M L^2/T^2]
      type(notes_t) :: notes                     !! for the log
      type(notes_t) :: warnings                  !! for the log, the user and the verdict
   end type increment_t

   !> What a step has come to at its end, and what the elements and the given forces are there.
   type :: end_state_t
      real(wp), allocatable :: du(:, :)          !! (n_dim, n_node) displacement over the step [L]
      real(wp), allocatable :: v(:, :)           !! (n_dim, n_node) velocity [L/T]
      real(wp), allocatable :: v_before(:, :)    !! (n_dim, n_node) before it jumps [L/T]
      type(velocity_jump_t), allocatable :: jump(:)  !! by which velocities have jumped there
      real(wp), allocatable :: force(:, :)       !! (n_dim, n_node) internal forces [M L/T^2]
      real(wp), allocatable :: energy(:)         !! (n_element) [M L^2/T^2]
      real(wp) :: potential = 0.0_wp             !! of the given forces [M L^2/T^2]
   end type end_state_t

   !> The part of an increment that is one step.
   type :: part_t
      type(instant_t) :: start
      real(wp) :: h = 0.0_wp                     !! > 0 [T]
      logical :: may_cut = .false.               !! smaller ones are possible
      integer :: level = 0                       !! so often it was made shorter
   end type part_t

   !> What the error of a step is estimated from.
   type :: error_estimate_t
      real(wp), allocatable :: mass(:, :)        !! (n_dim, n_node) of each unknown, else 0 [M]
      !> (n_dim, n_node) mean forces on it over the step: of contact, and all others [M L/T^2]
      real(wp), allocatable :: push(:, :), force(:, :)
      !> (n_dim, n_node) change of the mean velocity over the mean of two steps [L/T^2]
      real(wp), allocatable :: rate(:, :)
   end type error_estimate_t

   !> What was found of the step that was solved last.
   type :: step_check_t
      type(error_estimate_t) :: estimate
      real(wp) :: ratio = -1.0_wp                !! of its error to the tolerance; < 0: not judged
      logical :: changes_contact = .false.       !! contacts begin or end in it
      real(wp) :: event_at = 0.0_wp              !! part of it before the first event
   end type step_check_t

   !> What an increment that is interrupted goes back to.
   type :: rollback_t
      type(state_t) :: state
      type(ledger_t) :: ledger
   end type rollback_t

   !> The increments of a step of the deck: its grid of time, and the sizes that there may be.
   type :: time_grid_t
      integer :: n_grid = 0                      !! grid increments in the step
      type(grid_corner_t), allocatable :: corner(:)   !! ascending, up to its end
      integer :: most_stride = 1                 !! largest increment, in grid increments
      integer :: n_level = 0                     !! halvings allowed
      logical :: is_controlled = .false.
      logical :: judges_size = .false.           !! in this increment: it is none of a given size
      real(wp) :: h_deck = 0.0_wp                !! increment of the deck [T]
      integer(int64) :: n_unit = 1               !! units of time in the increment of the deck,
      integer(int64) :: n_least = 1              !! in the smallest one,
      integer(int64) :: n_window = 0             !! and in one in which an event may lie
      integer :: least_power = 0, largest_power = 0   !! of two, of sizes that the error asks for
   end type time_grid_t

   !> Which nodes have no mass.
   type :: massless_t
      logical, allocatable :: may_be(:)          !! (n_node) of contact surfaces, at first
      logical, allocatable :: without_density(:) !! (n_node) of sections without inertia
   end type massless_t

   !> Kinds that the program has given.
   type :: host_kinds_t
      type(host_scheme_t), allocatable :: scheme(:)  !! (any)
      type(solver_box_t), allocatable :: solver(:)   !! (any)
   end type host_kinds_t

   type :: march_t
      type(time_grid_t) :: grid                  !! increments of the step
      type(system_t) :: system
      type(state_t) :: state
      type(ledger_t) :: ledger
      class(scheme_t), allocatable :: scheme
      type(host_kinds_t) :: host
      type(newton_t) :: newton
      type(active_set_t) :: active
      type(velocity_update_t) :: velocity_update
      type(layer_t) :: layer                     !! of massless contact surfaces
      type(massless_t) :: massless
      type(notes_t) :: warnings                  !! to be told with the next increment
      type(explicit_t) :: explicit               !! of explicit steps
      type(overlap_check_t) :: overlap_check
      type(step_check_t) :: step_check
      integer :: revision = 0                    !! changes with the numbering of the unknowns
      type(motion_t) :: motion                   !! of the step
      type(end_state_t) :: end_state             !! of the step that was solved last
      type(rollback_t), allocatable :: before    !! of an increment that was cut
      class(watcher_t), pointer :: watcher => null()   !! told of each part, if there is one
   end type march_t

contains

   !> Nothing is found yet of the step that begins.
   pure subroutine step_check_begin(self)
      type(step_check_t), intent(inout) :: self

      self%ratio = -1.0_wp
   end subroutine step_check_begin

end module emcon_march_types
