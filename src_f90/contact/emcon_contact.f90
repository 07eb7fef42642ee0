!> What a contact formulation is: a list of possible constraints gap_i >= 0.
!>
!> A formulation chooses, once per step, what each constraint is made of (its stencil), and gives
!> its value, discrete gradient and derivatives. Which constraints act is not its business.
module emcon_contact
   use emcon_condition_nodes, only : condition_take_slip
   use emcon_constraint, only : condition_normal, condition_t, constraint_t
   use emcon_contact_law, only : contact_laws_t
   use emcon_evaluation, only : evaluation_is_at_start, evaluation_is_equilibrium
   use emcon_guards, only : overlap_bar, touching_bar
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_distribute, midside_points, midside_stretch, midside_t
   use emcon_motion, only : motion_t
   implicit none
   private
   public :: strained_only, contact_t, contact_box_t, contact_step_t, gap_state_t
   public :: max_penetration_on_entry, gap_ratio, push_place, slip_place

   !> Corners of master surfaces are rounded over these fractions of an edge: with and without a
   !> static step among those to come.
   real(wp), parameter :: static_rounding = 1.0e-4_wp, dynamic_rounding = 1.0e-6_wp

   !> So far, per edge, a contact may close in the step in which it slides onto its surface: corners
   !> dip into edges; beyond, a body flies through.
   real(wp), parameter :: max_penetration_on_entry = 0.05_wp

   !> Gaps that are integrated follow what is free to move by this part, at most, where that is but
   !> the strains of faces at a node that is held. A force that closes such a gap is as much larger
   !> than what it does.
   real(wp), parameter :: strained_only = 0.1_wp

   !> Where one possible constraint stands at both ends of a step.
   type :: gap_state_t
      logical :: is_near = .false.                    !! false: no surface within reach
      logical :: is_over = .false.                    !! over the surface (not past its end)
      logical :: is_arriving = .false.                !! too little is covered at the start
      logical :: was_open = .true.                    !! arriving: the start is seen from the front
      logical :: is_leaving = .false.                 !! too little is covered at the end
      logical :: is_covered = .true.                  !! see `covers`
      real(wp) :: gap0 = 0.0_wp                       !! mean gap Phi/W [L]
      real(wp) :: gap1 = 0.0_wp
      real(wp) :: size = 0.0_wp                       !! edge that gaps are measured against [L]
      real(wp) :: other_size = huge(1.0_wp)           !! shortest of the other side there, if known
      real(wp) :: closed = 0.0_wp                     !! the gap at which it acts, < 0: a guard [L]
      !> So much of friction goes to another node by the last choice of stencils than by the one
      !> before, 0 to 1
      real(wp) :: slip_shift = 0.0_wp
   end type gap_state_t

   !> What the present step asks of a contact.
   type :: contact_step_t
      logical :: is_sharp = .false.                   !! convex corners are not rounded
      logical :: pushes_at_end = .false.              !! forces act at its end, else all over it
      logical :: is_static = .false.                  !! it seeks a state of rest
      logical :: has_compliance = .false.             !! by a penalty, or augmented
      logical :: is_penalty = .false.                 !! it stores what it takes: a penalty
      real(wp) :: engages = 0.0_wp                    !! the gap at which that begins, if > 0 [L]
      logical :: is_idle = .false.                    !! it does not act: nothing is near
      !> (n_constraint) it is measured if it is near, whether or not it may close in the step; not
      !> allocated: none of them
      logical, allocatable :: is_watched(:)
   end type contact_step_t

   type, abstract, extends(constraint_t) :: contact_t
      real(wp) :: rounding = 0.0_wp                   !! of corners, as a fraction of a master edge
      logical :: may_sharpen = .false.                !! of polygons: convex corners are rounded
      logical :: meets_statics = .false.              !! a step of the deck is static
      logical :: may_leave = .false.                  !! constraints lose their surface, in a step
      type(contact_step_t) :: step
      real(wp) :: area_factor = 1.0_wp                !! of its areas that are its own: 1/2 or 1
      real(wp) :: slack = 0.0_wp                      !! > 0: a guard, closed at -slack by the edge
      real(wp) :: offset = 0.0_wp                     !! gaps are counted from it on, >= 0 [L]
      type(contact_laws_t) :: laws                    !! that conditions get copies of
      real(wp) :: reach = 0.0_wp                      !! so far it is near; 0: a step begins [L]
      !> Where nothing was near in the last step: how far apart the surfaces were as it began, by
      !> the largest motion of nodes; else 0 [L].
      real(wp) :: clearance = 0.0_wp
      integer :: n_look = 0                           !! steps begun so far
      !> So far, per edge, a gap may be closed at the start of a step in which it begins to act;
      !> from there on the other side of a thin body is meant.
      real(wp) :: max_penetration_at_start = 0.0_wp
      !> From a larger gap at the start no contact may begin in a step with inertia: what it is made
      !> of would be seen only with a motion that goes through the surface [L].
      real(wp) :: max_gap_on_entry = huge(1.0_wp)
      integer, allocatable :: node(:)                 !! (n_constraint) slave node of each
      !> (n_constraint) the other slave node at the same place of a surface of tied pieces; 0: none
      integer, allocatable :: duplicate(:)
      real(wp), allocatable :: thickness(:)           !! (n_constraint) of the slave side [L]
      !> (n_constraint) how far the arcs that edges stand for rise over them where a gap is measured
      !> in the step, in the mean: counted off the gap. 0 unless `follow_arcs` says so [L]
      real(wp), allocatable :: sagitta(:)
      type(gap_state_t), allocatable :: state(:)      !! (n_constraint) as last measured
      type(midside_t) :: midside                      !! whose contact points are not the nodes
   contains
      procedure :: suit_steps
      procedure :: follow_arcs
      procedure :: curve_doubt
      procedure :: linearise
      procedure :: has_looked
      procedure :: own_area
      procedure :: mean_size
      procedure :: share
      procedure :: narrow
      procedure :: pressures
      procedure :: mean_gap
      procedure :: could_hold
      procedure :: lets_in
      procedure :: least_free
      procedure :: waits
      procedure :: follow_slips
      ! To be called, with the displacements of nodes:
      procedure, non_overridable :: begin_step
      procedure, non_overridable :: measure
      procedure, non_overridable :: evaluate
      procedure, non_overridable :: covers
      procedure, non_overridable :: slip
      procedure, non_overridable :: area
      ! To be given, by the displacements of contact points:
      procedure(configure_interface), deferred :: configure
      procedure(begin_interface), deferred :: begin_points
      procedure(begin_interface), deferred :: measure_points
      procedure(evaluate_interface), deferred :: evaluate_points
      procedure(area_interface), deferred :: area_points
      procedure :: covers_points
      procedure :: slip_points
   end type contact_t

   !> For arrays of formulations of different types.
   type :: contact_box_t
      integer :: of_pair = 0                          !! of the scene; < 0: its sides exchanged
      class(contact_t), allocatable :: contact
   end type contact_box_t

   abstract interface

      !> Take over the options of a step of the deck.
      pure subroutine configure_interface(self, x, options)
         import :: contact_t, contact_options_t, wp
         class(contact_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
         type(contact_options_t), intent(in) :: options
      end subroutine configure_interface

      !> As `begin_step` and `measure`.
      pure subroutine begin_interface(self, x, u0, du)
         import :: contact_t, wp
         class(contact_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node)
      end subroutine begin_interface

      !> As `evaluate`.
      pure subroutine evaluate_interface(self, wanted, x, u0, du, target, item)
         import :: condition_t, contact_t, wp
         class(contact_t), intent(inout) :: self
         integer, intent(in) :: wanted(:)             !! (n) numbers of constraints, ascending
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
         real(wp), intent(in) :: target(:)            !! (n) [L]
         type(condition_t), intent(inout) :: item(:) !! (n)
      end subroutine evaluate_interface

      !> As `area`.
      pure subroutine area_interface(self, x, u, area, length)
         import :: contact_t, wp
         class(contact_t), intent(in) :: self
         real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
         real(wp), intent(out) :: area(:)             !! (n_constraint) [L^2]
         real(wp), intent(out) :: length(:)           !! (n_constraint) [L]
      end subroutine area_interface

   end interface

contains

   !> The part of the step after which contact forces act: in the mean at its middle, or its end.
   pure real(wp) function push_place(step)
      type(contact_step_t), intent(in) :: step

      push_place = merge(1.0_wp, 0.5_wp, step%pushes_at_end)
   end function push_place

   !> Where in the step the vectors of meshes are that slip is measured in: where friction acts, if
   !> that is its end. Where it acts all over the step those of its start: with others the rates of
   !> slip at its end, along which velocities jump, would have a moment.
   pure real(wp) function slip_place(step)
      type(contact_step_t), intent(in) :: step

      slip_place = merge(1.0_wp, 0.0_wp, step%pushes_at_end)
   end function slip_place

   !> A gap by the shorter edge of both sides: how far apart they are as each of them sees it.
   pure real(wp) function gap_ratio(state, gap)
      type(gap_state_t), intent(in) :: state
      real(wp), intent(in) :: gap                !! [L]

      gap_ratio = gap/min(state%size, state%other_size)
   end function gap_ratio

   !> Set up for steps some of which are static, or none; before `configure`.
   pure subroutine suit_steps(self, meets_statics)
      class(contact_t), intent(inout) :: self
      logical, intent(in) :: meets_statics       !! some step has no inertia

      self%meets_statics = meets_statics
      self%rounding = merge(static_rounding, dynamic_rounding, meets_statics)
   end subroutine suit_steps

   !> Measure gaps between the arcs that edges stand for, or between edges; after `configure`. A
   !> formulation that knows of no arcs leaves gaps as they are: nothing to do unless overridden.
   pure subroutine follow_arcs(self, x, options, is_wanted)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (n_dim, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options   !! as `configure` had them
      logical, intent(in) :: is_wanted           !! else between edges
   end subroutine follow_arcs

   !> At nodes that are held a constraint of which no larger part is free to move does not act, 0 to
   !> 1.
   pure real(wp) function least_free(self)
      class(contact_t), intent(in) :: self

      least_free = 0.0_wp
   end function least_free

   !> How wrong gaps between arcs may be; circles are exact in the plane [L].
   pure real(wp) function curve_doubt(self)
      class(contact_t), intent(in) :: self

      curve_doubt = 0.0_wp
   end function curve_doubt

   !> A step has begun; see `clearance`.
   pure subroutine has_looked(self, clearance)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in) :: clearance          !! >= 0; 0: something is near [L]

      self%clearance = clearance
      self%n_look = 1 + mod(self%n_look, huge(self%n_look) - 1)
   end subroutine has_looked

   !> The mean facet of the slave side in the reference configuration; huge where it has none [L].
   pure real(wp) function mean_size(self, x) result(length)
      class(contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (n_dim, n_node) reference positions [L]
      real(wp), dimension(self%n_constraint) :: area, part
      real(wp) :: u(size(x, 1), size(x, 2))

      u = 0.0_wp
      call self%area_points(x, u, area, part)
      length = huge(length)
      if (sum(part) > 0.0_wp) length = sum(part)/self%n_constraint
   end function mean_size

   !> Area that belongs to each constraint in the reference configuration.
   pure subroutine own_area(self, x, area)
      class(contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (2, n_node) reference positions [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp) :: length(size(area)), u(size(x, 1), size(x, 2))

      u = 0.0_wp
      call self%area_points(x, u, area, length)
   end subroutine own_area

   !> What slips are made of in the step is to be as the motion of the last `begin_step` has it;
   !> nothing where that is so anyway.
   pure subroutine follow_slips(self)
      class(contact_t), intent(inout) :: self
   end subroutine follow_slips

   !> What the values of constraint `i` are to be multiplied by to be the same function in all
   !> steps.
   pure real(wp) function share(self, i)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      share = 1.0_wp
   end function share

   !> Take off the areas at x + u of constraints what they do not press on; nothing unless
   !> overridden.
   pure subroutine narrow(self, x, u, area)
      class(contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(inout) :: area(:)         !! (n_constraint) [L^2]
   end subroutine narrow

   !> Pressures by forces of constraints on their areas; 0 without area.
   pure subroutine pressures(self, force, area, pressure)
      class(contact_t), intent(in) :: self
      real(wp), intent(in) :: force(:)           !! (n_constraint) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n_constraint) of `area` [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n_constraint) [M/(L T^2)]

      pressure = 0.0_wp
      where (area > 0.0_wp) pressure = force/area
   end subroutine pressures

   !> The gap at the end of the step, as in `state`, of constraint `i` whose value there is `gap`.
   pure real(wp) function mean_gap(self, i, gap)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: gap                !! [L]

      mean_gap = gap
   end function mean_gap

   !> Choose the stencils for a step from `u0` with the expected motion `du`.
   pure subroutine begin_step(self, x, u0, du)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]

      if (self%step%is_idle) then
         self%state%is_near = .false.
         self%state%is_over = .false.
         call self%has_looked(huge(1.0_wp))
      else if (self%midside%n == 0) then
         call self%begin_points(x, u0, du)
      else
         call self%begin_points(x, midside_points(self%midside, u0), &
            midside_points(self%midside, du))
         self%clearance = self%clearance/midside_stretch(self%midside)
      end if
   end subroutine begin_step

   !> Fill `state`: all gaps at both ends of the step, cheaply.
   pure subroutine measure(self, x, u0, du)
      class(contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]

      if (self%step%is_idle) return
      if (self%midside%n == 0) then
         call self%measure_points(x, u0, du)
      else
         call self%measure_points(x, midside_points(self%midside, u0), &
            midside_points(self%midside, du))
      end if
      if (self%step%engages > 0.0_wp) self%state%closed = self%step%engages
   end subroutine measure

   !> The constraints `wanted` with their derivatives, as `constraint_t` has it; `target` are the
   !> mean gaps to hold.
   pure subroutine evaluate(self, wanted, x, u0, du, target, item)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: k

      if (self%midside%n == 0) then
         call self%evaluate_points(wanted, x, u0, du, target, item)
      else
         call self%evaluate_points(wanted, x, midside_points(self%midside, u0), &
            midside_points(self%midside, du), target, item)
         do k = 1, size(item)
            call midside_distribute(self%midside, item(k))
         end do
      end if
   end subroutine evaluate

   !> Does the stencil of constraint `i` still hold at the end of the motion that was last measured?
   pure logical function covers(self, i, x, u0, du)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]

      if (self%midside%n == 0) then
         covers = self%covers_points(i, x, u0, du)
      else
         covers = self%covers_points(i, x, midside_points(self%midside, u0), &
            midside_points(self%midside, du))
      end if
   end function covers

   !> The same by contact points.
   pure logical function covers_points(self, i, x, u0, du) result(covers)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]

      covers = self%state(i)%is_covered
   end function covers_points

   !> How far the contact point of constraint `i` slides along the surface over the step, or would
   !> by a field `du` that is small: docs/theory.md, eq. (14e).
   pure function slip(self, i, x, u0, du)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]

      if (self%midside%n == 0) then
         slip = self%slip_points(i, x, u0, du)
      else
         slip = self%slip_points(i, x, midside_points(self%midside, u0), &
            midside_points(self%midside, du))
      end if
   end function slip

   !> The same by contact points.
   pure function slip_points(self, i, x, u0, du) result(slip)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]

      slip = 0.0_wp
   end function slip_points

   !> Area over which each multiplier of the last step acts, which ended at x + u: pressure is
   !> multiplier over area. And the length of slave surface that belongs to it at the end.
   pure subroutine area(self, x, u, of_multiplier, length)
      class(contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(out) :: of_multiplier(:)  !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) [L]

      of_multiplier = 0.0_wp
      length = 0.0_wp
      if (self%step%is_idle) return
      if (self%midside%n == 0) then
         call self%area_points(x, u, of_multiplier, length)
         call self%narrow(x, u, of_multiplier)
      else
         call self%area_points(x, midside_points(self%midside, u), of_multiplier, length)
         call self%narrow(x, midside_points(self%midside, u), of_multiplier)
      end if
   end subroutine area

   !> Could it hold what is marked, by another choice of those that act?
   pure logical function could_hold(self, is_loose)
      class(contact_t), intent(in) :: self
      logical, intent(in) :: is_loose(:)              !! (n_constraint) it is not held, and goes in

      could_hold = .false.
   end function could_hold

   !> So far, by the edge, it lets bodies into each other that it holds.
   pure real(wp) function lets_in(self)
      class(contact_t), intent(in) :: self

      lets_in = merge(overlap_bar, touching_bar, self%slack > 0.0_wp)
   end function lets_in

   !> Is constraint `i` a guard, which begins only where nothing else does?
   pure logical function waits(self, i)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      waits = self%slack > 0.0_wp
   end function waits

   !> As `constraint_t` has it: second derivatives are by the end of the step. Conditions hold at
   !> that end, and work over the whole step, wherever in it a scheme evaluates forces, or push
   !> along gradients at the start or the end, where a scheme says so.
   pure subroutine linearise(self, wanted, motion, target, item)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)                !! (n) numbers of constraints, ascending
      type(motion_t), intent(in) :: motion            !! placed
      real(wp), intent(in) :: target(:)               !! (n) mean gaps to hold [L]
      type(condition_t), intent(inout) :: item(:)     !! (n)
      real(wp), dimension(size(item)) :: gap0, dgap
      type(condition_t), allocatable :: over(:)
      integer :: k

      if (evaluation_is_at_start(motion%evaluation)) then
         call from_start(self, wanted, motion, target, item)
         call find_normals(item)
         return
      end if
      if (.not. evaluation_is_equilibrium(motion%evaluation) .or. any(item%has_friction)) then
         call self%evaluate(wanted, motion%x, motion%u0, motion%du, target, item)
      end if
      if (.not. (evaluation_is_equilibrium(motion%evaluation) &
         .or. motion%evaluation%pushes_at_end)) then
         call find_normals(item)
         return
      end if
      gap0 = item%gap0
      dgap = item%dgap
      if (any(item%has_friction)) over = item
      call self%evaluate(wanted, motion%x, motion%from, motion%by, target, item)
      do k = 1, size(item)
         if (.not. item(k)%leaves_second) item(k)%h = motion%weight*item(k)%h
         if (.not. item(k)%has_friction) cycle
         if (.not. item(k)%leaves_second) item(k)%ht = motion%weight*item(k)%ht
         ! Slip is over the step, wherever it pushes.
         call condition_take_slip(item(k), over(k))
      end do
      call find_normals(item)
      if (evaluation_is_equilibrium(motion%evaluation)) return
      item%gap0 = gap0
      item%dgap = dgap
   end subroutine linearise

   !> The normal forces of integrated gaps that rub.
   pure subroutine find_normals(item)
      type(condition_t), intent(inout) :: item(:)
      integer :: k

      do k = 1, size(item)
         if (item(k)%has_friction .and. item(k)%is_mean) item(k)%normal = condition_normal(item(k))
      end do
   end subroutine find_normals

   !> The gradients at the start in place of discrete ones: forces along them have no moment there,
   !> docs/theory.md, section 13. Stencils that are others there keep the discrete ones.
   pure subroutine from_start(self, wanted, motion, target, item)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)                !! (n)
      type(motion_t), intent(in) :: motion            !! placed
      real(wp), intent(in) :: target(:)               !! (n)
      type(condition_t), intent(inout) :: item(:)     !! (n)
      type(condition_t) :: start(size(item))
      integer :: i, k, n

      start%leaves_second = .true.
      call self%evaluate(wanted, motion%x, motion%from, motion%by, target, start)
      call self%evaluate(wanted, motion%x, motion%u0, motion%du, target, item)
      do k = 1, size(item)
         n = item(k)%n_node
         associate (place => [(findloc(item(k)%node(:n), start(k)%node(i), 1), &
               i = 1, start(k)%n_node)])
            if (any(place == 0)) cycle
            item(k)%g(:, :n) = 0.0_wp
            item(k)%g(:, place) = start(k)%g(:, :size(place))
         end associate
         item(k)%h = 0.0_wp
      end do
   end subroutine from_start

end module emcon_contact
