!> The scene: all that a deck says, as plain data. Nothing here computes.
!>
!> Nodes, elements and so on are numbered 1..n in the order of the deck; the user's numbers are
!> kept as labels. Units are the user's own, consistent: length [L], mass [M], time [T].
module emcon_scene
   use emcon_kinds, only : wp
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: origin_t, named_set_t, surface_t, material_t, section_t, amplitude_t
   public :: contact_pair_t, contact_options_t, prescribed_t, load_t, output_t, step_t, scene_t
   public :: tie_t, tie_rows_t, equation_t
   public :: where_text, find_amplitude_value
   public :: law_linear, law_neo_hooke, law_coupled_neo_hooke, law_given
   public :: load_point, load_pressure, load_gravity
   public :: formulation_nts, formulation_segment, formulation_mortar
   public :: integration_segments, integration_elements
   public :: multiplier_standard, multiplier_dual
   public :: normal_edge, normal_nodal, smoothing_none, smoothing_hermite
   public :: procedure_static, procedure_dynamic
   public :: initiation_persistent, initiation_admissible, initiation_velocity_update
   public :: method_null_space, method_saddle_point
   public :: output_node_file, output_element_file, output_contact_file
   public :: output_node_print, output_element_print, output_contact_print, output_energy_print

   !> Constitutive laws. `law_linear` is linear elasticity, under NLGEOM St. Venant-Kirchhoff;
   !> `law_given` is a function that a program gives.
   integer, parameter :: law_linear = 1, law_neo_hooke = 2, law_coupled_neo_hooke = 3, law_given = 4
   integer, parameter :: load_point = 1, load_pressure = 2, load_gravity = 3
   integer, parameter :: formulation_nts = 1, formulation_segment = 2, formulation_mortar = 3
   integer, parameter :: integration_segments = 1, integration_elements = 2
   integer, parameter :: multiplier_standard = 1, multiplier_dual = 2
   integer, parameter :: normal_edge = 1, normal_nodal = 2
   integer, parameter :: smoothing_none = 1, smoothing_hermite = 2
   integer, parameter :: procedure_static = 1, procedure_dynamic = 2
   integer, parameter :: initiation_persistent = 1, initiation_admissible = 2, &
      initiation_velocity_update = 3
   integer, parameter :: method_null_space = 1, method_saddle_point = 2
   integer, parameter :: output_node_file = 1, output_element_file = 2, output_contact_file = 3, &
      output_node_print = 4, output_element_print = 5, output_contact_print = 6, &
      output_energy_print = 7

   !> Where in the deck something was said.
   type :: origin_t
      integer :: file = 0      !! index into `scene_t%file`, 0: not from a deck
      integer :: line = 0
   end type origin_t

   !> A node set or an element set.
   type :: named_set_t
      character(len=:), allocatable :: name          !! upper case
      type(origin_t) :: origin
      integer, allocatable :: item(:)                !! ascending, distinct indices
   end type named_set_t

   !> A surface: element faces in the order of the deck, or nodes, or edges between nodes.
   type :: surface_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      logical :: is_nodal = .false.
      logical :: is_exterior = .false.               !! every free face that no tie covers
      integer, allocatable :: element(:)             !! (n_face)
      integer, allocatable :: face(:)                !! (n_face) 1..n_face of the element kind
      integer, allocatable :: node(:)                !! (n_node), only if `is_nodal`
      !> (2, n_edge) first and last nodes, the body to the left; only of a surface of edges
      integer, allocatable :: edge(:, :)
   end type surface_t

   type :: material_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      integer :: law = 0                             !! one of `law_`; 0: none was given
      real(wp), allocatable :: constant(:)           !! as in the deck: E, nu | C10, D1 | any
      real(wp) :: density = 0.0_wp                   !! [M/L^3]
   end type material_t

   type :: section_t
      type(origin_t) :: origin
      character(len=:), allocatable :: set           !! element set
      integer :: material = 0
      real(wp) :: thickness = 1.0_wp                 !! [L]
   end type section_t

   !> Factor over time: linear between the points, constant outside.
   type :: amplitude_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      logical :: is_total_time = .false.             !! else time since the start of the step
      real(wp), allocatable :: time(:)               !! ascending [T]
      real(wp), allocatable :: value(:)
   end type amplitude_t

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
      real(wp) :: slack = 0.0_wp                     !! so far nodes may go in, by the edge: a guard
      integer :: of_pair = 0                         !! of a guard: the pair that it watches
      real(wp) :: adjust_distance = -1.0_wp          !! ADJUST=distance [L]; < 0: not given
      integer :: adjust_set = 0                      !! ADJUST=node set; 0: not given
   end type contact_pair_t

   !> The constraints of a tie: for row k, in either direction, the sum of weight times position
   !> over its entries is zero. Row k belongs to the multiplier psi_k of slave node k: the entries
   !> are D_kB = int psi_k N_B for slave nodes and -M_kC = -int psi_k N_C for master nodes.
   type :: tie_rows_t
      integer, allocatable :: slave(:)               !! (n) slave nodes, along the chains
      integer, allocatable :: neighbour(:, :)        !! (2, n) row before and after; 0: an end
      integer, allocatable :: start(:)               !! (n + 1) entries before each row, from 0
      integer, allocatable :: node(:)                !! entries; the first is the slave node
      real(wp), allocatable :: weight(:)             !! [L]; the weights of a row sum up to 0
      real(wp), allocatable :: size(:)               !! (n) int psi_k, > 0 [L]
      integer, allocatable :: covered(:, :)          !! (2, any) master edges under slave ones, whole
      integer, allocatable :: buried(:)              !! master nodes with the slave on both sides
      !> (3, any) ends of the slave: the node, first and last node of the master edge under it
      integer, allocatable :: ending(:, :)
   end type tie_rows_t

   !> Two surfaces that stay together, whatever their meshes.
   type :: tie_t
      type(origin_t) :: origin
      character(len=:), allocatable :: name
      integer :: slave = 0                           !! index into `scene_t%surface`
      integer :: master = 0
      real(wp) :: tolerance = -1.0_wp                !! POSITION TOLERANCE [L]; < 0: not given
      integer :: multiplier = multiplier_dual
      type(tie_rows_t) :: rows                       !! frozen before the first step
   end type tie_t

   !> Sum of coefficient times displacement over some degrees of freedom = 0.
   type :: equation_t
      type(origin_t) :: origin
      integer, allocatable :: node(:)                !! (n) the first is the one to eliminate
      integer, allocatable :: dof(:)                 !! (n) 1..n_dim
      real(wp), allocatable :: coefficient(:)        !! (n) the first is not 0
   end type equation_t

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

   !> One prescribed degree of freedom: u = `value` times the amplitude.
   !>
   !> Without amplitude: in a static step u runs linearly from what it is at the start of the step
   !> to `value` at its end; in a dynamic step it is `value` from the first increment on.
   type :: prescribed_t
      type(origin_t) :: origin
      integer :: node = 0
      integer :: dof = 0                             !! 1..n_dim
      real(wp) :: value = 0.0_wp                     !! [L]
      integer :: amplitude = 0                       !! index, 0: none
      logical :: is_frozen = .false.                 !! FIXED: stays where the step found it
   end type prescribed_t

   !> One load. Without amplitude: `value`; in a static step a linear run from `value_start`.
   type :: load_t
      type(origin_t) :: origin
      integer :: kind = 0                            !! one of `load_`
      integer :: target = 0                          !! node (point) or element (pressure, gravity)
      integer :: place = 0                           !! dof (point) or face (pressure)
      real(wp) :: value = 0.0_wp                     !! force | pressure, > 0 inwards | acceleration
      real(wp) :: value_start = 0.0_wp               !! its value at the end of the step before
      real(wp) :: direction(3) = 0.0_wp              !! gravity: unit vector
      integer :: amplitude = 0
   end type load_t

   !> One output request.
   type :: output_t
      type(origin_t) :: origin
      integer :: kind = 0                            !! one of `output_`
      type(string_t), allocatable :: variable(:)     !! "U", "S", ... upper case, short Abaqus forms
      integer :: set = 0                             !! node or element set; 0: all
      integer :: frequency = 1                       !! every so many increments, 0: never
      real(wp), allocatable :: time(:)               !! TIME POINTS, ascending; none: by frequency
      logical :: totals = .false.                    !! TOTALS=YES or ONLY
      logical :: only_totals = .false.
   end type output_t

   type :: step_t
      type(origin_t) :: origin
      integer :: procedure = 0                       !! one of `procedure_`
      logical :: nlgeom = .false.
      integer :: max_increments = 0                  !! INC; 0: not limited
      logical :: is_direct = .false.                 !! increments as given
      real(wp) :: h = 1.0_wp                         !! first, or fixed, increment [T]
      real(wp) :: duration = 1.0_wp                  !! [T]
      real(wp) :: h_min = 0.0_wp                     !! 0: not given
      real(wp) :: h_max = 0.0_wp                     !! 0: not given
      integer :: constraint_method = method_null_space
      integer :: initiation = initiation_persistent
      real(wp) :: gap_tolerance = 0.0_wp             !! fraction of element size; 0: no limit
      type(contact_options_t) :: contact
      logical :: resolves_overclosure = .false.      !! what is closed at the start opens to 0
      integer :: overclosure_amplitude = 0           !! part that is left over time; 0: linear to 0
      logical :: stabilizes = .false.                !! statics: what no load works on may be free
      real(wp) :: newton_tolerance = 1.0e-10_wp      !! relative
      integer :: newton_maximum = 20
      integer :: restart_frequency = 0               !! 0: no restart file
      type(prescribed_t), allocatable :: prescribed(:)   !! all that hold in this step
      type(load_t), allocatable :: load(:)               !! all that act in this step
      type(output_t), allocatable :: output(:)           !! all that hold in this step
   end type step_t

   type :: scene_t
      type(string_t), allocatable :: file(:)         !! names of the deck files
      character(len=:), allocatable :: heading
      integer :: n_dim = 2
      integer, allocatable :: node_label(:)          !! (n_node)
      type(origin_t), allocatable :: node_origin(:)  !! (n_node)
      real(wp), allocatable :: x(:, :)               !! (n_dim, n_node) reference positions [L]
      integer, allocatable :: element_label(:)       !! (n_element)
      type(origin_t), allocatable :: element_origin(:)
      integer, allocatable :: element_kind(:)        !! (n_element) index into `element_kinds`
      integer, allocatable :: element_node(:, :)     !! (max_element_nodes, n_element), 0: no node
      integer, allocatable :: element_section(:)     !! (n_element)
      type(named_set_t), allocatable :: node_set(:)
      type(named_set_t), allocatable :: element_set(:)
      type(surface_t), allocatable :: surface(:)
      type(material_t), allocatable :: material(:)
      type(section_t), allocatable :: section(:)
      type(amplitude_t), allocatable :: amplitude(:)
      type(contact_pair_t), allocatable :: pair(:)
      type(contact_pair_t), allocatable :: guard(:)  !! of the pairs: emcon_guards
      type(tie_t), allocatable :: tie(:)
      type(equation_t), allocatable :: equation(:)
      type(origin_t) :: given_origin
      integer, allocatable :: given_node(:)          !! ascending: what these do comes from outside
      real(wp), allocatable :: u0(:, :)              !! (n_dim, n_node) initial displacement [L]
      real(wp), allocatable :: v0(:, :)              !! (n_dim, n_node) initial velocity [L/T]
      type(step_t), allocatable :: step(:)
   end type scene_t

contains

   !> "file:line" of `origin`, for messages.
   pure function where_text(scene, origin) result(text)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin
      character(len=where_length(scene, origin)) :: text

      text = "(no deck)"
      if (origin%file > 0) text = scene%file(origin%file)%text // ":" // to_text(origin%line)
   end function where_text

   pure integer function where_length(scene, origin)
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin

      where_length = len("(no deck)")
      if (origin%file > 0) where_length = len(scene%file(origin%file)%text) + 1 &
         + len(to_text(origin%line))
   end function where_length

   !> Value and slope of an amplitude at `time`; at a kink the slope to the left.
   pure subroutine find_amplitude_value(amplitude, time, value, slope)
      type(amplitude_t), intent(in) :: amplitude
      real(wp), intent(in) :: time
      real(wp), intent(out) :: value                 !! factor
      real(wp), intent(out) :: slope                 !! [1/T]
      integer :: i, n

      n = size(amplitude%time)
      slope = 0.0_wp
      if (time <= amplitude%time(1)) then
         value = amplitude%value(1)
      else if (time > amplitude%time(n)) then
         value = amplitude%value(n)
      else
         i = count(amplitude%time < time)
         slope = (amplitude%value(i + 1) - amplitude%value(i)) &
            /(amplitude%time(i + 1) - amplitude%time(i))
         value = amplitude%value(i) + slope*(time - amplitude%time(i))
      end if
   end subroutine find_amplitude_value

end module emcon_scene
