!> Contact: which surfaces meet, and how that is computed.
module emcon_interactions
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: contact_pair_t, contact_options_t, contact_damping_t, interaction_t, adjustment_t
   public :: pressure_t, pressure_reach, pressure_slope, interaction_reach, interaction_friction
   public :: pressure_hard, pressure_linear, pressure_exponential, pressure_tabular, pressure_tied
   public :: pair_has_order, pair_holds_nodes, pair_may_exchange, pair_is_reverse_of, pair_of_one
   public :: adjustment_moves, pair_acts, pair_begins, pair_first_step
   public :: formulation_nts, formulation_segment, formulation_mortar, formulation_user, &
      formulation_edges
   public :: integration_segments, integration_elements
   public :: multiplier_standard, multiplier_dual
   public :: normal_edge, normal_nodal, smoothing_none, smoothing_hermite

   integer, parameter :: formulation_nts = 1, formulation_segment = 2, formulation_mortar = 3, &
      formulation_user = 4, formulation_edges = 5
   integer, parameter :: integration_segments = 1, integration_elements = 2
   integer, parameter :: multiplier_standard = 1, multiplier_dual = 2
   integer, parameter :: normal_edge = 1, normal_nodal = 2
   integer, parameter :: smoothing_none = 1, smoothing_hermite = 2

   integer, parameter :: pressure_hard = 1, pressure_linear = 2, pressure_exponential = 3, &
      pressure_tabular = 4, pressure_tied = 5
   !> An exponential pressure is cut off at so many clearances, where it is a millionth.
   real(wp), parameter :: exponential_reach = 3.0_wp

   !> How the contact of a step is computed: *MORTAR and *SURFACE SMOOTHING.
   type :: contact_options_t
      integer :: integration = integration_segments
      integer :: n_point = 0                         !! POINTS=; 0: not given
      integer :: multiplier = multiplier_dual
      integer :: normal = normal_nodal
      integer :: smoothing = smoothing_none
      !> Turns sharper than this are corners: normals are not averaged, surfaces not smoothed there
      real(wp) :: normal_angle = 60.0_wp             !! [degrees]
      real(wp) :: smoothing_angle = 60.0_wp          !! [degrees]
   end type contact_options_t

   !> *CONTACT DAMPING: a pressure against the rate at which surfaces approach, part or slide. Of
   !> slave surfaces made of nodes, which have no area, it is a force.
   type :: contact_damping_t
      real(wp) :: coefficient = 0.0_wp               !! pressure by velocity, >= 0 [M/(L^2 T)]
      real(wp) :: clearance = 0.0_wp                 !! from which on there is none, >= 0 [L]
      real(wp) :: flat = 0.0_wp                      !! part of it where it is constant, 0 to 1
      real(wp) :: tangent = 0.0_wp                   !! part of it along the surface, >= 0
   end type contact_damping_t

   !> *SURFACE BEHAVIOR: pressure as a function of the overclosure.
   type :: pressure_t
      integer :: kind = pressure_hard
      real(wp) :: slope = 0.0_wp                     !! LINEAR: by overclosure [M/(L^2 T^2)]
      real(wp) :: tension = 0.0_wp                   !! LINEAR: sigma_inf, 0: none [M/(L T^2)]
      real(wp) :: clearance = 0.0_wp                 !! EXPONENTIAL: c0 [L]
      real(wp) :: at_touch = 0.0_wp                  !! EXPONENTIAL: p0 [M/(L T^2)]
      real(wp), allocatable :: pressure(:)           !! (n) TABULAR: from 0 on [M/(L T^2)]
      real(wp), allocatable :: overclosure(:)        !! (n) of these, ascending [L]
   end type pressure_t

   !> *SURFACE INTERACTION: how surfaces act on each other.
   type :: interaction_t
      real(wp) :: offset = 0.0_wp                    !! of the gap: a layer in between, >= 0 [L]
      real(wp) :: restitution = 1.0_wp               !! of impacts, 0 to 1
      real(wp) :: friction = 0.0_wp                  !! mu of Coulomb's law, >= 0, most of steps
      real(wp), allocatable :: friction_of_step(:)   !! (n_step) not allocated: one for all
      real(wp) :: stick = 0.0_wp                     !! slope of stick, 0: exact [M/(L^2 T^2)]
      real(wp) :: rebound = 0.0_wp                   !! along the surface, of what sticks, 0 to 1
      type(contact_damping_t) :: damping
      type(pressure_t) :: pressure
   end type interaction_t

   !> Nodes of a slave surface that are moved before the first step, onto the master or to a
   !> clearance in front of it.
   type :: adjustment_t
      real(wp) :: distance = -1.0_wp                 !! ADJUST=distance [L]; < 0: not given
      integer :: set = 0                             !! ADJUST=node set; 0: not given
      logical :: is_clearance = .false.              !! *CLEARANCE: all nodes that face the master
      real(wp) :: clearance = 0.0_wp                 !! and their gap then, < 0: overlap [L]
   end type adjustment_t

   type :: contact_pair_t
      type(origin_t) :: origin
      integer :: slave = 0                           !! index into `scene_t%surface`
      integer :: master = 0
      integer :: formulation = formulation_nts
      logical :: both_sides = .false.                !! nodes of both surfaces are held
      logical :: is_reverse = .false.                !! the second half of a pair with both sides
      logical :: may_choose = .false.                !! both sides or one, and which one
      logical :: is_asked = .false.                  !! the deck says so, or which
      logical :: is_exchanged = .false.              !! the deck names what is the master first
      logical :: is_guarded = .true.                 !! nodes that no pair holds get guards
      logical :: holds_crossings = .true.            !! sharp ridges that cross are held, in space
      integer :: initiation = 0                      !! one of `initiation_`, 0: as the step
      real(wp) :: slack = 0.0_wp                     !! so far nodes may go in, by the edge: a guard
      type(interaction_t) :: interaction
      integer :: of_pair = 0                         !! of a guard: the pair that it watches
      type(adjustment_t) :: adjust
      logical :: has_options = .false.               !! of its own, in place of the step's
      type(contact_options_t) :: options
      logical, allocatable :: acts_in_step(:)        !! (n_step) not allocated: in all of them
   end type contact_pair_t

contains

   !> The gap up to which a pressure acts [L].
   pure real(wp) function pressure_reach(pressure) result(reach)
      type(pressure_t), intent(in) :: pressure

      reach = 0.0_wp
      if (pressure%kind == pressure_exponential) reach = exponential_reach*pressure%clearance
      if (pressure%kind == pressure_tabular) reach = max(0.0_wp, -pressure%overclosure(1))
   end function pressure_reach

   !> How fast a pressure rises [M/(L^2 T^2)]: where gaps are closed, or at the end of its table.
   pure real(wp) function pressure_slope(pressure) result(slope)
      type(pressure_t), intent(in) :: pressure
      real(wp), parameter :: log_100 = log(100.0_wp)

      slope = pressure%slope
      if (pressure%kind == pressure_exponential) slope = &
         log_100*pressure%at_touch/pressure%clearance
      if (pressure%kind /= pressure_tabular) return
      associate (p => pressure%pressure, o => pressure%overclosure, n => size(pressure%pressure))
         slope = (p(n) - p(1))/(o(n) - o(1))
      end associate
   end function pressure_slope

   !> The coefficient of friction in a step, >= 0.
   pure real(wp) function interaction_friction(surface, i_step) result(mu)
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: i_step              !! of the deck

      mu = surface%friction
      if (allocated(surface%friction_of_step)) mu = surface%friction_of_step(i_step)
   end function interaction_friction

   !> The gap up to which surfaces act on each other, pads left out [L].
   pure real(wp) function interaction_reach(surface) result(reach)
      type(interaction_t), intent(in) :: surface

      reach = max(surface%damping%clearance, pressure_reach(surface%pressure))
   end function interaction_reach

   !> Does a pair act in a step?
   elemental logical function pair_acts(pair, i_step) result(acts)
      type(contact_pair_t), intent(in) :: pair
      integer, intent(in) :: i_step              !! of the deck

      acts = .true.
      if (allocated(pair%acts_in_step)) acts = pair%acts_in_step(i_step)
   end function pair_acts

   !> Does it act in a step, after one in which it did not?
   elemental logical function pair_begins(pair, i_step) result(begins)
      type(contact_pair_t), intent(in) :: pair
      integer, intent(in) :: i_step              !! of the deck

      begins = .false.
      if (i_step > 1) begins = pair_acts(pair, i_step) .and. .not. pair_acts(pair, i_step - 1)
   end function pair_begins

   !> The first step in which it acts; 0: it never does.
   elemental integer function pair_first_step(pair) result(i_step)
      type(contact_pair_t), intent(in) :: pair

      i_step = 1
      if (allocated(pair%acts_in_step)) i_step = findloc(pair%acts_in_step, .true., 1)
   end function pair_first_step

   !> Does a pair hold each node of its slave in front of its master?
   elemental logical function pair_holds_nodes(pair) result(holds_nodes)
      type(contact_pair_t), intent(in) :: pair

      holds_nodes = pair%formulation == formulation_nts .and. &
         (pair%slave /= pair%master .or. pair%both_sides)
   end function pair_holds_nodes

   !> Does it make a difference which of its two surfaces is the slave?
   elemental logical function pair_has_order(pair) result(has_order)
      type(contact_pair_t), intent(in) :: pair

      has_order = .not. (pair%both_sides .or. pair%slave == pair%master)
   end function pair_has_order

   !> Have two pairs the same surfaces, in turn?
   elemental logical function pair_is_reverse_of(other, pair) result(is_reverse_of)
      type(contact_pair_t), intent(in) :: other, pair

      is_reverse_of = other%slave == pair%master .and. other%master == pair%slave
   end function pair_is_reverse_of

   !> The pair that holds the nodes of its slave alone, without the other half.
   pure type(contact_pair_t) function pair_of_one(pair)
      type(contact_pair_t), intent(in) :: pair

      pair_of_one = pair
      pair_of_one%both_sides = .false.
      pair_of_one%is_reverse = .false.
      pair_of_one%may_choose = .false.
      pair_of_one%is_guarded = .false.
   end function pair_of_one

   !> Does it move nodes?
   elemental logical function adjustment_moves(adjust) result(moves)
      type(adjustment_t), intent(in) :: adjust

      moves = adjust%distance >= 0.0_wp .or. adjust%set > 0 .or. adjust%is_clearance
   end function adjustment_moves

   !> Does the deck leave it open which one that is? What is adjusted is the slave.
   elemental logical function pair_may_exchange(pair) result(may_exchange)
      type(contact_pair_t), intent(in) :: pair

      may_exchange = pair%may_choose .and. pair_has_order(pair) .and. &
         .not. adjustment_moves(pair%adjust)
   end function pair_may_exchange

end module emcon_interactions
