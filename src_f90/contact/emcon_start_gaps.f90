!> Gaps of nodes over edges before the first step: by them contact of every formulation is judged.
!>
!> Every face counts, also one that does not bear on the node: what is behind at first has no way
!> in. Source: docs/theory.md, section 4.
module emcon_start_gaps
   use emcon_chain, only : chain_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t
   use emcon_kinds, only : wp
   use emcon_midside_plane, only : midside_init, midside_points, midside_t
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: start_gaps_t, start_gaps_init, start_gaps_nearest, start_gaps_measure, start_gaps_way

   type :: start_gaps_t
      integer :: n = 0                           !! slave nodes, each once for bodies it looks at
      logical :: is_self = .false.               !! a surface in contact with itself
      type(chain_t) :: slave
      type(chain_t), allocatable :: master       !! gfortran 12 loses a second one of its kind
      integer, allocatable :: node(:)            !! (n) node of the scene
      integer, allocatable :: duplicate(:)       !! (n) the other one at its place; 0: none
      integer, allocatable :: chain_node(:)      !! (n) index into the slave's nodes
      integer, allocatable :: edge(:)            !! (n) nearest master edge; 0: none near
      type(gap_state_t), allocatable :: state(:) !! (n) as last measured
      type(nts_t), private :: nts
      real(wp), allocatable, private :: still(:, :)  !! (2, n_node) no displacement [L]
      real(wp), allocatable, private :: u(:, :)  !! (2, n_node) initial, of contact points [L]
   end type start_gaps_t

contains

   !> The pair `pair` of `scene`, whose master is smoothed if `options` say so; without them it is
   !> the polygon.
   subroutine start_gaps_init(self, scene, pair, error, options)
      type(start_gaps_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t), intent(in), optional :: options
      type(midside_t) :: midside

      call nts_init(self%nts, scene, pair, error)
      if (allocated(error)) return
      self%nts%every_face = .true.
      if (present(options)) call self%nts%configure(scene%x, options)
      allocate(self%still(size(scene%x, 1), size(scene%x, 2)), source=0.0_wp)
      self%n = self%nts%n_constraint
      self%is_self = self%nts%is_self
      self%slave = self%nts%slave
      allocate(self%master, source=self%nts%master)
      self%node = self%nts%node
      self%duplicate = self%nts%duplicate
      self%chain_node = self%nts%chain_node
      self%edge = self%nts%edge
      self%state = self%nts%state
      call midside_init(midside, scene, [pair%slave, pair%master])
      self%u = scene%u0
      if (midside%n > 0) self%u = midside_points(midside, scene%u0)
   end subroutine start_gaps_init

   !> Gap of node `i` over the nearest master edge, searched among all edges; `edge(i)` tells which.
   pure subroutine start_gaps_nearest(self, i, scene, gap, is_over)
      type(start_gaps_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! not past an end of the surface

      call nts_nearest(self%nts, i, scene%x, self%u, self%still, gap, is_over)
      self%edge(i) = self%nts%edge(i)
   end subroutine start_gaps_nearest

   !> Fill `edge` and `state`: the gaps of nodes that are near.
   pure subroutine start_gaps_measure(self, scene)
      type(start_gaps_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene

      self%nts%reach = 0.0_wp
      call self%nts%begin_points(scene%x, self%u, self%still)
      call self%nts%measure_points(scene%x, self%u, self%still)
      self%edge = self%nts%edge
      self%state = self%nts%state
   end subroutine start_gaps_measure

   !> The way of node `i` off its surface as last measured, along the normal: without it the gap is
   !> closed, to first order.
   pure subroutine start_gaps_way(self, i, scene, way, is_last)
      type(start_gaps_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: way(:)            !! (n_dim) [L]
      logical, intent(out) :: is_last            !! it is round-off
      type(condition_t) :: item(1)

      call self%nts%evaluate_points([i], scene%x, self%u, self%still, [0.0_wp], item)
      associate (normal => item(1)%c(:, 1))
         way = item(1)%gap1*normal/dot_product(normal, normal)
      end associate
      is_last = abs(item(1)%gap1) <= epsilon(1.0_wp)*item(1)%size
   end subroutine start_gaps_way

end module emcon_start_gaps
